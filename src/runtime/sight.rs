//! A node in a photo at a pose: its coefficients at any shift, all of them or the few that a search asks.
//!
//! In: a node's window and cells, a photo, where the node lies in it. Out: coefficients. A search over shifts asks which of
//! two is likelier: in a large node some cells tell, and these are not the smallest, so the search sees the node in blocks of
//! 2 × 2 px, a quarter of the work. Never weighs.

use super::camera::Camera;
use super::grid::Grid;
use super::light::Light;
use super::pose::Pose;
use super::window::{Placed, Stencil, Window};
use std::sync::Arc;

/// A search over shifts looks at so many coefficients: fewer tell too little, more only cost time.
const SEARCHED: [usize; 2] = [500, 2000];

/// Some cells of a large node, in blocks.
pub struct Glance {
    /// Of the blocks.
    window: Window,
    stencil: Stencil,
    /// Which cells of the node these are.
    pub cells: Arc<[usize]>,
}

impl Glance {
    /// `None` where a node has too few cells to leave the smallest out.
    pub fn new(window: &Window, stencil: &Stencil) -> Option<Glance> {
        let finest = stencil.levels.first()?.len() / 2;
        let coarse = stencil.len() / 2 - finest;
        let [least, most] = SEARCHED;
        if 2 * coarse < least {
            return None;
        }
        let cells: Arc<[usize]> = (finest..finest + coarse).step_by((2 * coarse).div_ceil(most)).collect();
        let stencil = stencil.in_blocks(&cells);
        let blocks = window.blocks();
        let wanted = stencil.covered(blocks.frame.size.map(|s| s as usize));
        Some(Glance { window: blocks.masked(wanted), stencil, cells })
    }

    /// The coefficients of these cells.
    pub fn of(cells: &[usize], all: &[f32]) -> Vec<f32> {
        cells.iter().flat_map(|&c| [all[2 * c], all[2 * c + 1]]).collect()
    }
}

/// A photo reduced by a node's factor, and the same smoothed over 2 × 2 px: px (x, y) is the mean of those at x, x + 1, y, y + 1.
pub struct Reduced {
    pub grid: Grid,
    smooth: Grid,
}

impl Reduced {
    pub fn new(grid: Grid) -> Reduced {
        let (width, height) = (grid.width.saturating_sub(1).max(1), grid.height.saturating_sub(1).max(1));
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            let row = |y: usize| &grid.values[y.min(grid.height - 1) * grid.width..][..grid.width];
            let sums: Vec<f32> = row(y).iter().zip(row(y + 1)).map(|(a, b)| a + b).collect();
            values.extend((0..width).map(|x| (sums[x] + sums[(x + 1).min(grid.width - 1)]) * 0.25));
        }
        Reduced { smooth: Grid::new(width, height, values), grid }
    }
}

/// A node in a photo.
pub struct Sight<'a> {
    pub(super) window: &'a Window,
    pub(super) stencil: &'a Stencil,
    pub(super) glance: Option<&'a Glance>,
    pub(super) light: &'a Light,
    pub(super) surroundings: &'a [bool],
    photo: &'a Reduced,
    placed: Placed,
    /// Where the blocks lie.
    blocks: Option<Placed>,
}

impl<'a> Sight<'a> {
    pub(super) fn new(
        (window, stencil, glance): (&'a Window, &'a Stencil, Option<&'a Glance>),
        (light, surroundings): (&'a Light, &'a [bool]),
        photo: &'a Reduced,
        (camera, pose): (&Camera, &Pose),
    ) -> Sight<'a> {
        // Open light levels a window as a whole.
        let blocks = glance.filter(|_| !light.is_open()).map(|g| g.window.place(camera, pose));
        let placed = window.place(camera, pose);
        Sight { window, stencil, glance, light, surroundings, photo, placed, blocks }
    }

    /// All coefficients at a shift (node px).
    pub(super) fn all(&self, shift: [f64; 2]) -> Vec<f32> {
        let image = self.window.cut(&self.photo.grid, &self.placed, shift);
        self.stencil.coefficients(&self.light.level(image, self.surroundings))
    }

    /// Those that a search asks; `None` where it asks all.
    pub(super) fn some(&self, shift: [f64; 2]) -> Option<Vec<f32>> {
        let glance = self.glance?;
        let Some(blocks) = &self.blocks else { return Some(Glance::of(&glance.cells, &self.all(shift))) };
        // The smooth photo's first px has its centre at the corner of four.
        let image = glance.window.cut(&self.photo.smooth, blocks, shift.map(|s| s - 0.5));
        Some(glance.stencil.coefficients(&image))
    }

    /// Share of the window inside the photo.
    pub(super) fn inside(&self) -> f64 {
        self.window.inside(&self.photo.grid, &self.placed)
    }
}

#[cfg(test)]
mod tests {
    use super::super::model::Lamp;
    use super::super::window::Frame;
    use super::*;

    /// Of a smooth photo blocks show what their px do, at any shift and turn.
    #[test]
    fn what_a_search_sees_are_the_coefficients_of_its_cells() {
        let camera = Camera::look_at([0.0, -100.0, 280.0], [0.0; 3], 2000.0, [240, 200]);
        let home = Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 };
        let frame = Frame { plane: 0.0, factor: 2, origin: [30, 25], size: [57, 48] };
        let wave =
            |x: usize, y: usize| (x as f32 * 0.11).sin() * (y as f32 * 0.08).cos() + 0.3 * (x as f32 * 0.05).cos();
        let photo = Grid::new(240, 200, (0..240 * 200).map(|i| 0.5 + 0.3 * wave(i % 240, i / 240)).collect());
        let reduced = Reduced::new(photo.reduced(2));
        let window = Window::new(frame, &camera, &home).unwrap();
        let stencil = Stencil::new(&vec![vec![true; 57]; 48], 4);
        let glance = Glance::new(&window, &stencil).expect("a large node");
        let lamp = Lamp { name: "l".into(), light: 0, power: 1.0, drift: 0.1 };
        let light = Light::new(&[1.0], &[lamp]);
        let pose = Pose { x: 0.4, y: -0.3, z: 0.0, rz: 0.06 };
        let sight = Sight::new((&window, &stencil, Some(&glance)), (&light, &[]), &reduced, (&camera, &pose));
        for shift in [[0.0, 0.0], [0.5, -1.25], [-2.0, 0.75]] {
            let (all, some) = (Glance::of(&glance.cells, &sight.all(shift)), sight.some(shift).unwrap());
            let size = (all.iter().map(|v| v * v).sum::<f32>() / all.len() as f32).sqrt();
            let off = all.iter().zip(&some).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(size > 0.01 && off < 0.03 * size, "{off} of {size}");
        }
    }

    #[test]
    fn a_small_node_is_searched_by_all_it_has() {
        let camera = Camera::look_at([0.0, -100.0, 280.0], [0.0; 3], 2000.0, [240, 200]);
        let frame = Frame { plane: 0.0, factor: 2, origin: [30, 25], size: [20, 20] };
        let window = Window::new(frame, &camera, &Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 }).unwrap();
        assert!(Glance::new(&window, &Stencil::new(&vec![vec![true; 20]; 20], 4)).is_none());
    }
}
