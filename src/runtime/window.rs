//! A node's window on the photo: the pixels of the node carried to the photo through the node's plane and the camera.
//!
//! In: where the node lies in the nominal photo, a pose, a camera. Out: the node's image cut from a photo, and its Haar
//! coefficients inside the mask. Training cuts renders with the same code, so what is trained is what will judge.

use super::camera::{Camera, Vec3};
use super::grid::Grid;
use super::haar::Integral;
use super::model::Node;
use super::pose::Pose;
use std::collections::BTreeMap;

/// Where a node lies in the nominal photo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Height of its plane (mm, assembly frame).
    pub plane: f64,
    /// px of the photo per px of the node.
    pub factor: u32,
    /// Top left corner and size in node px.
    pub origin: [i32; 2],
    pub size: [u32; 2],
}

impl Frame {
    pub fn of(node: &Node) -> Frame {
        Frame { plane: node.plane, factor: node.factor, origin: node.origin, size: node.size }
    }
}

/// The node's pixels as points of the assembly.
pub struct Window {
    pub frame: Frame,
    points: Vec<Vec3>,
    /// Which of them are looked at.
    wanted: Vec<bool>,
}

/// Places of the node's pixels in a photo reduced by the node's factor (px).
pub struct Placed(Vec<[f64; 2]>);

impl Window {
    /// # Errors
    /// `None` when the node's plane is not in front of the camera.
    pub fn new(frame: Frame, nominal: &Camera, home: &Pose) -> Option<Window> {
        let camera = nominal.reduced(frame.factor);
        let mut points = Vec::with_capacity((frame.size[0] * frame.size[1]) as usize);
        for y in 0..frame.size[1] {
            for x in 0..frame.size[0] {
                let pixel = [f64::from(frame.origin[0]) + f64::from(x), f64::from(frame.origin[1]) + f64::from(y)];
                let point = camera.on_plane(pixel.map(|v| v + 0.5), frame.plane + home.z)?;
                points.push(home.invert(point));
            }
        }
        let wanted = vec![true; points.len()];
        Some(Window { frame, points, wanted })
    }

    /// The same window in blocks of 2 × 2 px, each a pixel; what is left over at the right and the bottom is dropped.
    pub fn blocks(&self) -> Window {
        let [width, height] = self.frame.size.map(|s| s as usize);
        let size = [width / 2, height / 2];
        let mut points = Vec::with_capacity(size[0] * size[1]);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let first = 2 * (y * width + x);
                let four = [first, first + 1, first + width, first + width + 1];
                points.push([0, 1, 2].map(|k| four.iter().map(|&i| self.points[i][k]).sum::<f64>() / 4.0));
            }
        }
        let wanted = vec![true; points.len()];
        Window { frame: Frame { size: size.map(|s| s as u32), ..self.frame }, points, wanted }
    }

    /// The same window in which only these pixels are looked at: the others are cut as 0.
    pub fn masked(self, wanted: Vec<bool>) -> Window {
        Window { wanted, ..self }
    }

    /// Where the pixels lie in a photo by `camera` of an assembly at `pose`.
    pub fn place(&self, camera: &Camera, pose: &Pose) -> Placed {
        let camera = camera.reduced(self.frame.factor);
        let (stood, outside) = (pose.stood(), [f64::NEG_INFINITY; 2]);
        let place =
            |(&p, &wanted): (&Vec3, &bool)| wanted.then(|| camera.project(stood.apply(p))).flatten().unwrap_or(outside);
        Placed(self.points.iter().zip(&self.wanted).map(place).collect())
    }

    /// Share of the wanted pixels inside a photo already reduced by the node's factor.
    pub fn inside(&self, reduced: &Grid, placed: &Placed) -> f64 {
        let seen = placed.0.iter().zip(&self.wanted).filter(|(_, wanted)| **wanted).map(|(p, _)| reduced.sample(*p));
        let (mut inside, mut all) = (0usize, 0usize);
        for value in seen {
            all += 1;
            inside += usize::from(value.is_some());
        }
        inside as f64 / all.max(1) as f64
    }

    /// The node's image from a photo already reduced by the node's factor, moved by `shift` (node px). Wanted pixels
    /// outside the photo repeat their left neighbour.
    pub fn cut(&self, reduced: &Grid, placed: &Placed, shift: [f64; 2]) -> Grid {
        let [width, height] = self.frame.size.map(|s| s as usize);
        let mut values = Vec::with_capacity(width * height);
        let mut last = 0.0;
        for (p, &wanted) in placed.0.iter().zip(&self.wanted) {
            if !wanted {
                values.push(0.0);
                continue;
            }
            last = reduced.sample([p[0] + shift[0], p[1] + shift[1]]).unwrap_or(last);
            values.push(last);
        }
        Grid::new(width, height, values)
    }
}

/// The Haar cells of a node: inside its mask, at every level, half overlapping.
pub struct Stencil {
    cells: Vec<Cell>,
    /// First coefficient of each level; two coefficients a cell.
    pub levels: Vec<std::ops::Range<usize>>,
}

struct Cell {
    x: usize,
    y: usize,
    half: usize,
}

impl Stencil {
    /// Levels 1..=`levels` of the cells whose centre is in the mask and whose square is in the node. A level with no cell
    /// ends the list.
    pub fn new(mask: &[Vec<bool>], levels: u32) -> Stencil {
        let (width, height) = (mask.first().map_or(0, Vec::len), mask.len());
        let mut stencil = Stencil { cells: Vec::new(), levels: Vec::new() };
        for half in (0..levels).map(|l| 1usize << l) {
            let start = 2 * stencil.cells.len();
            for y in (half..(height + 1).saturating_sub(half)).step_by(half) {
                for x in (half..(width + 1).saturating_sub(half)).step_by(half) {
                    // The cell's centre is a pixel corner: it counts when one of the four pixels around it does.
                    if mask[y - 1][x - 1] || mask[y - 1][x] || mask[y][x - 1] || mask[y][x] {
                        stencil.cells.push(Cell { x, y, half });
                    }
                }
            }
            if 2 * stencil.cells.len() == start {
                break;
            }
            stencil.levels.push(start..2 * stencil.cells.len());
        }
        stencil
    }

    /// These cells, none of them the smallest, where a pixel is a block of 2 × 2. They are of one level.
    pub fn in_blocks(&self, cells: &[usize]) -> Stencil {
        let half = |c: &Cell| Cell { x: c.x / 2, y: c.y / 2, half: c.half / 2 };
        let cells: Vec<Cell> = cells.iter().map(|&c| half(&self.cells[c])).collect();
        let levels = std::iter::once(0..2 * cells.len()).collect();
        Stencil { cells, levels }
    }

    /// Number of coefficients.
    pub fn len(&self) -> usize {
        2 * self.cells.len()
    }

    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// The pixels of a node of this size that lie in any cell.
    pub fn covered(&self, [width, height]: [usize; 2]) -> Vec<bool> {
        let mut covered = vec![false; width * height];
        for c in &self.cells {
            for y in c.y - c.half..(c.y + c.half).min(height) {
                covered[y * width + c.x - c.half..y * width + (c.x + c.half).min(width)].fill(true);
            }
        }
        covered
    }

    /// H and V of every cell.
    pub fn coefficients(&self, image: &Grid) -> Vec<f32> {
        let integral = Integral::new(image);
        let mut out = Vec::with_capacity(self.len());
        for c in &self.cells {
            out.extend_from_slice(&match c.half {
                1 => Integral::smallest(image, c.x, c.y),
                half => integral.gradient(c.x, c.y, half),
            });
        }
        out
    }

    /// The mean of a value per coefficient over every square of the coarsest levels' cells (the coarsest first), each with all
    /// coefficients of any level whose cell has its centre in it; NaN for squares with few coefficients.
    pub fn square_means<const SCALES: usize>(&self, values: &[f32]) -> [Vec<f64>; SCALES] {
        const FEWEST: usize = 24;
        let width = self.cells.iter().map(|c| c.x).max().unwrap_or(0) + 1;
        let height = self.cells.iter().map(|c| c.y).max().unwrap_or(0) + 1;
        let mut sums = Grid::filled(width, height, 0.0);
        let mut counts = Grid::filled(width, height, 0.0);
        for (c, pair) in self.cells.iter().zip(values.chunks_exact(2)) {
            sums.values[c.y * width + c.x] += pair[0] + pair[1];
            counts.values[c.y * width + c.x] += 2.0;
        }
        let (sums, counts) = (Integral::new(&sums), Integral::new(&counts));
        let mean = |s: &Cell| {
            let (x, y) = (s.x.saturating_sub(s.half), s.y.saturating_sub(s.half));
            let ends = [(s.x + s.half + 1).min(width), (s.y + s.half + 1).min(height)];
            let count = counts.between([x, y], ends);
            if count >= FEWEST as f64 { sums.between([x, y], ends) / count } else { f64::NAN }
        };
        let mut levels = self.levels.iter().rev();
        std::array::from_fn(|_| {
            let level = levels.next().cloned().unwrap_or(0..0);
            self.cells[level.start / 2..level.end / 2].iter().map(mean).collect()
        })
    }

    /// Sides of a square of [`Stencil::square_means`] (node px): x0, y0, x1, y1.
    pub fn square(&self, scale: usize, index: usize) -> Option<[usize; 4]> {
        let level = self.levels.iter().rev().nth(scale)?;
        let of = self.cells[level.start / 2..level.end / 2].get(index)?;
        Some([of.x - of.half, of.y - of.half, of.x + of.half, of.y + of.half])
    }

    /// Per square of [`Stencil::square_means`] the highest mean of it and of those that overlap it.
    pub fn widened<const SCALES: usize>(&self, means: &[Vec<f64>; SCALES]) -> [Vec<f64>; SCALES] {
        let mut levels = self.levels.iter().rev();
        std::array::from_fn(|scale| {
            let level = levels.next().cloned().unwrap_or(0..0);
            let squares = &self.cells[level.start / 2..level.end / 2];
            let at: BTreeMap<[usize; 2], f64> =
                squares.iter().zip(&means[scale]).map(|(s, mean)| ([s.x, s.y], *mean)).collect();
            let highest = |s: &Cell| {
                let rows = [s.y - s.half, s.y, s.y + s.half];
                let round = rows.iter().flat_map(|y| [s.x - s.half, s.x, s.x + s.half].map(|x| at.get(&[x, *y])));
                round.flatten().copied().fold(f64::NAN, f64::max)
            };
            squares.iter().map(highest).collect()
        })
    }

    /// True for the coefficients whose cell holds a pixel at or above `limit`.
    pub fn touching(&self, image: &Grid, limit: f32) -> Vec<bool> {
        let over = Grid::new(image.width, image.height, image.values.iter().map(|&v| f32::from(v >= limit)).collect());
        let integral = Integral::new(&over);
        self.cells.iter().flat_map(|c| [integral.sum(c.x, c.y, c.half) > 0.5; 2]).collect()
    }
}

/// A node's mask, pixel by pixel.
pub fn mask_of(node: &Node) -> Vec<Vec<bool>> {
    let row = |runs: &Vec<u32>| {
        let mut row = vec![false; node.size[0] as usize];
        for run in runs.chunks_exact(2) {
            row[run[0] as usize..(run[0] + run[1]) as usize].fill(true);
        }
        row
    };
    node.mask.iter().map(row).collect()
}

/// A mask as the model file writes it.
pub fn runs_of(mask: &[Vec<bool>]) -> Vec<Vec<u32>> {
    let runs = |row: &Vec<bool>| {
        let mut out = Vec::new();
        let mut x = 0;
        while x < row.len() {
            let end = x + row[x..].iter().take_while(|&&m| m).count();
            if end > x {
                out.extend([x as u32, (end - x) as u32]);
            }
            x = end.max(x + 1);
        }
        out
    };
    mask.iter().map(runs).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_square_is_widened_to_those_that_overlap_it() {
        let stencil = Stencil::new(&vec![vec![true; 40]; 40], 4);
        // One cell of the smallest is off, far from the border.
        let mut values = vec![0.0; stencil.len()];
        let odd = stencil.cells.iter().position(|c| [c.x, c.y, c.half] == [20, 20, 1]).unwrap();
        values[2 * odd] = 100.0;
        let means: [Vec<f64>; 2] = stencil.square_means(&values);
        let wide = stencil.widened(&means);
        let count = |all: &Vec<f64>| all.iter().filter(|v| **v > 0.0).count();
        assert!(stencil.square(1, 0).is_some_and(|[x0, y0, x1, y1]| x1 - x0 == 8 && y1 - y0 == 8));
        let [x0, y0, x1, y1] = stencil.square(0, means[0].iter().position(|v| *v > 0.0).unwrap()).unwrap();
        assert!(x0 <= 20 && 20 <= x1 && y0 <= 20 && 20 <= y1 && x1 - x0 == 16 && y1 - y0 == 16);
        assert_eq!((stencil.square(0, 10_000), stencil.square(9, 0)), (None, None));
        for scale in 0..2 {
            assert!(count(&means[scale]) > 0 && count(&wide[scale]) > count(&means[scale]), "{scale}");
            assert!(wide[scale].iter().zip(&means[scale]).all(|(w, m)| w >= m));
        }
    }
}
