//! What of a line can be seen.
//!
//! In: triangles in the view's frame, and lines. Out: the stretches of each line that no triangle covers. Exact: every piece
//! is cut where it enters and leaves a triangle's shadow and where it passes through its plane. A grid over the paper
//! keeps the search short. Depth counts from [`CLEAR`] on, so a line never hides behind the faces it borders.

use nalgebra::{Point3, Vector3};

/// A triangle covers a line when it is nearer to the viewer by more than this (mm), or this share of the drawing if that is
/// less: several times the chord height of the triangles, by which parts that fit closely may pass through each other.
const CLEAR: f64 = 0.05;
const CLEAR_SHARE: f64 = 3e-3;
/// A triangle whose normal is this square to the view (mm² of shadow) covers nothing.
const LEAST_SHADOW: f64 = 1e-9;
/// Shares of a piece closer than this are one.
const SAME: f64 = 1e-9;
/// Triangles per cell of the grid, about.
const PER_CELL: f64 = 2.0;
/// Cells along one side of the grid, at most.
const MOST_CELLS: f64 = 1024.0;

/// A triangle turned to the viewer.
struct Cover {
    corners: [Point3<f64>; 3],
    /// Depth over the paper: `z = plane · (x, y, 1)`.
    plane: Vector3<f64>,
}

/// All triangles turned to the viewer, over a grid on the paper.
pub(super) struct Covers {
    covers: Vec<Cover>,
    low: [f64; 2],
    cell: f64,
    cells: [usize; 2],
    /// Per cell the triangles that reach it.
    lists: Vec<Vec<u32>>,
    /// A triangle covers what lies deeper by this (mm).
    clear: f64,
}

impl Covers {
    /// Triangles in the view's frame, counter-clockwise seen from outside of their solids.
    pub fn new(triangles: impl Iterator<Item = [Point3<f64>; 3]>) -> Covers {
        let covers: Vec<Cover> = triangles.filter_map(Cover::new).collect();
        let points = || covers.iter().flat_map(|c| &c.corners);
        let low = [0, 1].map(|i| points().map(|p| p[i]).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|i| points().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max));
        let size = [0, 1].map(|i| (high[i] - low[i]).max(f64::MIN_POSITIVE));
        let wanted = (covers.len() as f64 / PER_CELL).sqrt().clamp(1.0, MOST_CELLS);
        let cell = size[0].max(size[1]) / wanted;
        let cells = size.map(|s| if s.is_finite() { (s / cell) as usize + 1 } else { 1 });
        let clear = CLEAR.min(CLEAR_SHARE * size[0].max(size[1]));
        let mut grid = Covers { lists: vec![Vec::new(); cells[0] * cells[1]], covers, low, cell, cells, clear };
        grid.fill();
        grid
    }

    fn fill(&mut self) {
        for (i, cover) in self.covers.iter().enumerate() {
            let flat = cover.corners.map(|c| [c.x, c.y]);
            for cell in reached(self.low, self.cell, self.cells, &flat) {
                self.lists[cell].push(i as u32);
            }
        }
    }

    /// Stretches of the piece from `a` to `b` that can be seen, as shares of it, in order.
    pub fn seen(&self, a: &Point3<f64>, b: &Point3<f64>) -> Vec<[f64; 2]> {
        let mut near: Vec<u32> = Vec::new();
        for cell in reached(self.low, self.cell, self.cells, &[[a.x, a.y], [b.x, b.y]]) {
            near.extend(&self.lists[cell]);
        }
        near.sort_unstable();
        near.dedup();
        let mut hidden: Vec<[f64; 2]> =
            near.iter().filter_map(|c| self.covers[*c as usize].shadow(a, b, self.clear)).collect();
        hidden.sort_by(|x, y| x[0].total_cmp(&y[0]));
        rest(&hidden)
    }
}

/// Cells that the box round some points reaches.
fn reached(low: [f64; 2], cell: f64, cells: [usize; 2], points: &[[f64; 2]]) -> impl Iterator<Item = usize> + use<> {
    let index = |value: f64, i: usize| (((value - low[i]) / cell).max(0.0) as usize).min(cells[i] - 1);
    let first = [0, 1].map(|i| index(points.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min), i));
    let last = [0, 1].map(|i| index(points.iter().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max), i));
    (first[1]..=last[1]).flat_map(move |y| (first[0]..=last[0]).map(move |x| y * cells[0] + x))
}

/// What is left of 0..1 without these stretches, which are sorted by their beginnings.
fn rest(hidden: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut seen = Vec::new();
    let mut from = 0.0;
    for [low, high] in hidden {
        if *low > from + SAME {
            seen.push([from, *low]);
        }
        from = from.max(*high);
    }
    if from < 1.0 - SAME {
        seen.push([from, 1.0]);
    }
    seen
}

impl Cover {
    /// `None` for a triangle turned away from the viewer.
    fn new(corners: [Point3<f64>; 3]) -> Option<Cover> {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        (normal.z > LEAST_SHADOW).then(|| {
            let [x, y] = [-normal.x / normal.z, -normal.y / normal.z];
            let height = corners[0].z - x * corners[0].x - y * corners[0].y;
            Cover { corners, plane: Vector3::new(x, y, height) }
        })
    }

    /// The stretch of the piece from `a` to `b` that lies in the shadow of this triangle, deeper by `clear` mm.
    fn shadow(&self, a: &Point3<f64>, b: &Point3<f64>, clear: f64) -> Option<[f64; 2]> {
        let mut stretch = [0.0, 1.0];
        for i in 0..3 {
            let (p, q) = (self.corners[i], self.corners[(i + 1) % 3]);
            let inside = |r: &Point3<f64>| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
            clip(&mut stretch, inside(a), inside(b))?;
        }
        let in_front = |r: &Point3<f64>| self.plane.dot(&Vector3::new(r.x, r.y, 1.0)) - r.z - clear;
        clip(&mut stretch, in_front(a), in_front(b))?;
        Some(stretch)
    }
}

/// Keeps the part of a stretch where a linear function, given at 0 and at 1, is not negative.
fn clip(stretch: &mut [f64; 2], at_0: f64, at_1: f64) -> Option<()> {
    match (at_0 < 0.0, at_1 < 0.0) {
        (true, true) => return None,
        (false, false) => return Some(()),
        (true, false) => stretch[0] = stretch[0].max(at_0 / (at_0 - at_1)),
        (false, true) => stretch[1] = stretch[1].min(at_0 / (at_0 - at_1)),
    }
    (stretch[0] < stretch[1]).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A right triangle with legs of 10 mm at the height 5.
    fn roof() -> Covers {
        let corners = [[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]].map(|[x, y]| Point3::new(x, y, 5.0));
        Covers::new(std::iter::once(corners))
    }

    fn sees(covers: &Covers, p: &Point3<f64>) -> bool {
        !covers.seen(p, p).is_empty()
    }

    #[test]
    fn a_line_below_is_cut_at_the_border() {
        let seen = roof().seen(&Point3::new(-5.0, 5.0, 0.0), &Point3::new(15.0, 5.0, 0.0));
        assert_eq!(seen.len(), 2);
        assert!((seen[0][1] - 0.25).abs() < 1e-12 && (seen[1][0] - 0.5).abs() < 1e-12, "{seen:?}");
    }

    #[test]
    fn a_line_above_is_whole_and_one_that_dives_is_cut_at_the_plane() {
        let above = roof().seen(&Point3::new(1.0, 1.0, 6.0), &Point3::new(3.0, 3.0, 6.0));
        assert_eq!(above, [[0.0, 1.0]]);
        let clear = roof().clear;
        let dives = roof().seen(&Point3::new(1.0, 1.0, 10.0 - clear), &Point3::new(3.0, 3.0, -clear));
        assert_eq!(dives.len(), 1);
        assert!((dives[0][1] - 0.5).abs() < 1e-12, "{dives:?}");
    }

    #[test]
    fn what_is_turned_away_covers_nothing() {
        let corners = [[0.0, 0.0], [0.0, 10.0], [10.0, 0.0]].map(|[x, y]| Point3::new(x, y, 5.0));
        let covers = Covers::new(std::iter::once(corners));
        assert!(sees(&covers, &Point3::new(1.0, 1.0, 0.0)));
        assert!(!sees(&roof(), &Point3::new(1.0, 1.0, 0.0)));
    }

    /// A thousand points against a fan of random triangles, by testing each triangle.
    #[test]
    fn the_grid_forgets_nothing() {
        let number = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) % 10_007) / 10_007.0;
        let corner = |i: u32| Point3::new(number(i) * 20.0, number(i + 1) * 20.0, number(i + 2) * 20.0);
        let triangles: Vec<[Point3<f64>; 3]> = (0..60).map(|t| [0, 1, 2].map(|c| corner(t * 9 + c * 3))).collect();
        let covers = Covers::new(triangles.iter().copied());
        for i in 0..1000 {
            let p = corner(10_000 + 3 * i);
            let alone =
                triangles.iter().filter_map(|t| Cover::new(*t)).all(|c| c.shadow(&p, &p, covers.clear).is_none());
            assert_eq!(sees(&covers, &p), alone, "{p}");
        }
    }
}
