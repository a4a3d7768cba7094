//! Which bodies stand in each other's way along a direction, and which enter each other.
//!
//! In: placed solids and a direction. Out: for every pair of bodies whether one is in the other's way over the whole path,
//! and how deep they enter each other. Read from columns of material, so features narrower than about three cells (a
//! twentieth of what two bodies share) are not seen; contacts have to supply those. Says nothing of fits.

use super::columns::{Columns, Extent, Frame, Grid, erode, project};
use crate::solid::{Solid, TriMesh};
use nalgebra::{Isometry3, Unit, Vector3};
use rayon::prelude::*;
use std::sync::Arc;

/// Bodies that enter each other less than this (mm) along the direction do not block.
const DEPTH_TOLERANCE: f64 = 0.02;
/// Cells across the region two bodies share, and the least side of a cell (mm).
const CELLS_ACROSS: f64 = 64.0;
const FINEST_CELL: f64 = 0.05;

/// How the bodies meet along one direction.
pub(crate) struct Meetings {
    /// `way[a][b]`: b stands in the way of a.
    pub way: Vec<Vec<bool>>,
    pub entering: Vec<Entering>,
}

/// Two components whose material overlaps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Entering {
    pub a: usize,
    pub b: usize,
    /// The shorter of the ways out along the direction and across it (mm).
    pub depth: f64,
}

impl Meetings {
    pub fn new<'a>(direction: Unit<Vector3<f64>>, solids: &'a [Arc<Solid>], poses: &[Isometry3<f64>]) -> Self {
        let frame = Frame::along(direction);
        let body = |(solid, pose): (&'a Arc<Solid>, &Isometry3<f64>)| {
            let points = project(&solid.mesh, pose, &frame);
            Body { mesh: &solid.mesh, extent: Extent::of(&points), points }
        };
        let bodies: Vec<Body> = solids.iter().zip(poses).map(body).collect();
        let n = bodies.len();
        let pairs: Vec<[usize; 2]> = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b])).collect();
        let met: Vec<Option<Meeting>> = pairs.par_iter().map(|pair| meeting(pair.map(|i| &bodies[i]))).collect();
        let mut meetings = Meetings { way: vec![vec![false; n]; n], entering: Vec::new() };
        for ([a, b], meeting) in pairs.into_iter().zip(met) {
            let Some(meeting) = meeting else { continue };
            meetings.way[a][b] = meeting.second_above;
            meetings.way[b][a] = meeting.first_above;
            meetings.entering.extend(meeting.depth.map(|depth| Entering { a, b, depth }));
        }
        meetings
    }
}

/// A body in the coordinates of the direction.
struct Body<'a> {
    mesh: &'a TriMesh,
    points: Vec<[f64; 3]>,
    extent: Extent,
}

/// How two bodies meet along the direction.
struct Meeting {
    /// The second has material above where the first begins, and the other way round.
    second_above: bool,
    first_above: bool,
    /// How far they enter each other (mm).
    depth: Option<f64>,
}

/// `None` for bodies that pass each other by.
fn meeting(bodies: [&Body; 2]) -> Option<Meeting> {
    let region = bodies[0].extent.common(&bodies[1].extent);
    let size = [0, 1].map(|i| region.high[i] - region.low[i]);
    if size[0] <= 0.0 || size[1] <= 0.0 {
        return None;
    }
    let cell = (size[0].max(size[1]) / CELLS_ACROSS).max(FINEST_CELL);
    let grid = Grid::over(&region, cell);
    let [p, q] = bodies.map(|b| Columns::new(b.mesh, &b.points, &grid));
    Some(Meeting {
        second_above: any_wide(&grid, |c| above(&p, &q, c)),
        first_above: any_wide(&grid, |c| above(&q, &p, c)),
        depth: if region.high[2] - region.low[2] > DEPTH_TOLERANCE { depth(&p, &q, &grid) } else { None },
    })
}

/// Whether q has material above where p begins.
fn above(p: &Columns, q: &Columns, cell: usize) -> bool {
    matches!((p.bottom(cell), q.top(cell)), (Some(low), Some(high)) if high > low + DEPTH_TOLERANCE)
}

/// Whether cells that answer yes form a patch wider than the facets of a curved face.
fn any_wide(grid: &Grid, test: impl Fn(usize) -> bool) -> bool {
    let marked: Vec<bool> = (0..grid.cells()).map(test).collect();
    marked.iter().any(|m| *m) && erode(&marked, grid).contains(&true)
}

/// How far two bodies enter each other (mm): the shorter of the way out along the direction and across it.
fn depth(p: &Columns, q: &Columns, grid: &Grid) -> Option<f64> {
    let shared: Vec<f64> = (0..grid.cells()).map(|c| shared_length(p.spans(c), q.spans(c))).collect();
    let mut marked: Vec<bool> = shared.iter().map(|d| *d > DEPTH_TOLERANCE).collect();
    let mut across = 0.0;
    let mut along: f64 = 0.0;
    while marked.iter().any(|m| *m) {
        marked = erode(&marked, grid);
        let deepest = (0..grid.cells()).filter(|c| marked[*c]).map(|c| shared[c]).fold(0.0, f64::max);
        along = along.max(deepest);
        across += 2.0 * grid.cell;
    }
    (along > 0.0).then(|| along.min(across))
}

/// The longest stretch of material two columns have in common.
fn shared_length(p: &[[f64; 2]], q: &[[f64; 2]]) -> f64 {
    let pairs = p.iter().flat_map(|s| q.iter().map(move |t| s[1].min(t[1]) - s[0].max(t[0])));
    pairs.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{place::place, sample};

    #[test]
    fn bodies_in_each_other_are_measured() {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
        shop.place("lower", plate, [0.0; 3], 0.0, 0.0);
        shop.place("upper", plate, [3.0, 0.0, 1.7], 0.0, 0.0);
        let a = shop.finish();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        assert_eq!(meetings.entering.len(), 1);
        assert!((meetings.entering[0].depth - 0.3).abs() < 1e-9, "{:?}", meetings.entering);
    }

    #[test]
    fn a_pin_that_fits_its_hole_enters_nothing() {
        let a = sample::pattern_wheel();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        assert!(meetings.entering.is_empty(), "{:?}", meetings.entering);
    }
}
