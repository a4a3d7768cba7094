//! Which bodies stand in each other's way along a direction, and which enter each other.
//!
//! In: placed solids and a direction. Out: for every body those in its way over the whole path, and how deep bodies enter
//! each other. Read from columns of material over what two bodies share; what is too thin for the columns is looked for
//! among the triangles one by one. Bodies whose shadows lie apart are never compared, and pairs that stand to each other
//! as another pair does are worked out once. Says nothing of fits.

use super::boxes::BoxTree;
use super::columns::{Columns, Extent, Frame, Grid, erode};
use super::overlap::clipped;
use super::silhouette::{Seen, Shade, doubled, shades};
use crate::solid::Solid;
use nalgebra::{Isometry3, Unit, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Bodies that enter each other less than this (mm) along the direction do not block.
const DEPTH_TOLERANCE: f64 = 0.02;
/// Cells across the region two bodies share, and the least side of a cell (mm).
const CELLS_ACROSS: f64 = 64.0;
const FINEST_CELL: f64 = 0.05;
/// Cells across the places where two bodies enter each other, to measure how far.
const FINE_CELLS_ACROSS: f64 = 256.0;
/// What two triangles share may be the sagging of facets up to this width (mm).
const SAG: f64 = 0.04;
/// Places that differ by less than this (mm) are one.
const SAME_PLACE: f64 = 1e-9;

/// How the bodies meet along one direction.
#[derive(Debug, Default)]
pub(crate) struct Meetings {
    /// Per body those in its way, ascending.
    pub way: Vec<Vec<usize>>,
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
    pub fn new(direction: Unit<Vector3<f64>>, solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Self {
        let shades = shades(&Frame::along(direction), solids, poses);
        let tree = BoxTree::new(shades.iter().map(Shade::bounds).collect());
        let near =
            |a: usize| tree.meeting(&shades[a].bounds()).into_iter().filter(move |b| *b > a).map(move |b| [a, b]);
        let shades_of = |[a, b]: [usize; 2]| [&shades[a], &shades[b]];
        // Whether one passes the other by does not depend on their heights: a pin through ten plates is asked about once.
        let passing = Alike::of((0..shades.len()).flat_map(near), |pair| shadow_key(shades_of(pair)));
        let pass: Vec<bool> = passing.jobs.par_iter().map(|pair| pass_by(shades_of(*pair))).collect();
        let stopped = passing.pairs.iter().filter(|(_, job)| !pass[*job]).map(|(pair, _)| *pair);
        let Alike { pairs, jobs } = Alike::of(stopped, |pair| key(shades_of(pair)));
        let met: Vec<Option<Meeting>> = jobs.par_iter().map(|pair| meeting(shades_of(*pair))).collect();
        let mut meetings = Meetings { way: vec![Vec::new(); shades.len()], entering: Vec::new() };
        for ([a, b], job) in pairs {
            if let Some(meeting) = &met[job] {
                meetings.note(a, b, meeting);
            }
        }
        meetings.way.iter_mut().for_each(|w| w.sort_unstable());
        meetings
    }

    fn note(&mut self, a: usize, b: usize, meeting: &Meeting) {
        if meeting.second_above {
            self.way[a].push(b);
        }
        if meeting.first_above {
            self.way[b].push(a);
        }
        self.entering.extend(meeting.depth.map(|depth| Entering { a, b, depth }));
    }
}

/// Pairs of bodies, and the first of each kind of pairs that are alike.
struct Alike {
    /// Each with the place of its kind in `jobs`.
    pairs: Vec<([usize; 2], usize)>,
    jobs: Vec<[usize; 2]>,
}

impl Alike {
    fn of<K: Ord>(all: impl Iterator<Item = [usize; 2]>, key: impl Fn([usize; 2]) -> K) -> Alike {
        let (mut alike, mut known) = (Alike { pairs: Vec::new(), jobs: Vec::new() }, BTreeMap::new());
        for pair in all {
            let job = *known.entry(key(pair)).or_insert_with(|| {
                alike.jobs.push(pair);
                alike.jobs.len() - 1
            });
            alike.pairs.push((pair, job));
        }
        alike
    }
}

/// What a pair's meeting depends on: the two silhouettes and how the second stands to the first.
fn key([a, b]: [&Shade; 2]) -> (usize, usize, [i64; 3]) {
    (a.number, b.number, [0, 1, 2].map(|i| place_of(a, b, i)))
}

/// The same without the heights.
fn shadow_key([a, b]: [&Shade; 2]) -> (usize, usize, [i64; 2]) {
    (a.number, b.number, [0, 1].map(|i| place_of(a, b, i)))
}

fn place_of(a: &Shade, b: &Shade, axis: usize) -> i64 {
    ((b.shift[axis] - a.shift[axis]) / SAME_PLACE).round() as i64
}

/// Whether the two pass each other by, whatever their heights: beside each other, or one in a round opening of the other.
fn pass_by(bodies: [&Shade; 2]) -> bool {
    let size = shared(bodies).1;
    // Overlap narrower than a cell never fills the three cells that count.
    let clear = |p: usize| bodies[p].is_clear_of(bodies[1 - p], FINEST_CELL);
    size[0] <= 0.0 || size[1] <= 0.0 || clear(0) || clear(1)
}

/// What two extents have in common, and its width along u and v.
fn shared(bodies: [&Shade; 2]) -> (Extent, [f64; 2]) {
    let region = bodies[0].extent().common(&bodies[1].extent());
    (region, [0, 1].map(|i| region.high[i] - region.low[i]))
}

/// How two bodies meet along the direction.
struct Meeting {
    /// The second has material above where the first begins, and the other way round.
    second_above: bool,
    first_above: bool,
    /// How far they enter each other (mm).
    depth: Option<f64>,
}

/// How two bodies meet that do not pass each other by; `None` where they share nothing.
fn meeting(bodies: [&Shade; 2]) -> Option<Meeting> {
    let [first, second] = bodies.map(Shade::extent);
    let (region, size) = shared(bodies);
    if size[0] <= 0.0 || size[1] <= 0.0 {
        return None;
    }
    let cell = (size[0].max(size[1]) / CELLS_ACROSS).max(FINEST_CELL);
    let grid = Grid::over(&region, cell);
    let [p, q] = bodies.map(|b| Columns::of(b.over(&region), &grid));
    let higher = |low: &Extent, high: &Extent| high.high[2] > low.low[2] + DEPTH_TOLERANCE;
    let is_above = |below: usize, p: &Columns, q: &Columns, possible: bool| {
        possible && (any_wide(&grid, |c| above(p, q, c)) || thinly_above(bodies[below], bodies[1 - below], &region))
    };
    Some(Meeting {
        second_above: is_above(0, &p, &q, higher(&first, &second)),
        first_above: is_above(1, &q, &p, higher(&second, &first)),
        depth: if region.high[2] - region.low[2] > DEPTH_TOLERANCE { entered(bodies, &p, &q, &grid) } else { None },
    })
}

/// Whether some triangle of the second body's upper side lies above one of the first's underside, over more than facets sag.
fn thinly_above(first: &Shade, second: &Shade, region: &Extent) -> bool {
    first.over(region).filter(|s| doubled(s) < 0.0).any(|s| {
        let lowest = s.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        let above = |t: &Seen| doubled(t) > 0.0 && t.iter().any(|p| p[2] > lowest + DEPTH_TOLERANCE);
        second.over(&Extent::of(&s)).filter(above).any(|t| shared_and_above(&s, &t))
    })
}

fn shared_and_above(s: &Seen, t: &Seen) -> bool {
    let flat = |t: &Seen| t.map(|p| [p[0], p[1]]);
    let (common, area) = clipped(&flat(s), &flat(t));
    let perimeter: f64 = (0..common.len())
        .map(|i| {
            let (p, q) = (common[i], common[(i + 1) % common.len()]);
            (p[0] - q[0]).hypot(p[1] - q[1])
        })
        .sum();
    if 2.0 * area <= SAG * perimeter {
        return false;
    }
    let count = common.len() as f64;
    let middle = [0, 1].map(|i| common.iter().map(|p| p[i]).sum::<f64>() / count);
    height(t, middle) > height(s, middle) + DEPTH_TOLERANCE
}

/// The height of a triangle's plane over a point.
fn height(t: &Seen, [u, v]: [f64; 2]) -> f64 {
    let (p, q) = ([0, 1, 2].map(|i| t[1][i] - t[0][i]), [0, 1, 2].map(|i| t[2][i] - t[0][i]));
    let area = doubled(t);
    let slope = [(p[2] * q[1] - p[1] * q[2]) / area, (p[0] * q[2] - p[2] * q[0]) / area];
    t[0][2] + slope[0] * (u - t[0][0]) + slope[1] * (v - t[0][1])
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

/// How far two bodies enter each other (mm), from a closer look at where columns of a coarse grid do: the flanks of two teeth may be
/// in each other over a few tenths of a mm of bodies that share a hundred.
fn entered(bodies: [&Shade; 2], p: &Columns, q: &Columns, coarse: &Grid) -> Option<f64> {
    let marked: Vec<[f64; 3]> = (0..coarse.cells())
        .filter(|c| shared_length(p.spans(*c), q.spans(*c)) > DEPTH_TOLERANCE)
        .map(|c| [coarse.centre(c)[0], coarse.centre(c)[1], 0.0])
        .collect();
    if marked.is_empty() {
        return None;
    }
    let mut region = Extent::of(&marked);
    for axis in 0..2 {
        (region.low[axis], region.high[axis]) = (region.low[axis] - coarse.cell, region.high[axis] + coarse.cell);
    }
    let across = (region.high[0] - region.low[0]).max(region.high[1] - region.low[1]);
    let cell = (across / FINE_CELLS_ACROSS).max(FINEST_CELL);
    if cell >= coarse.cell {
        return depth(p, q, coarse);
    }
    let grid = Grid::over(&region, cell);
    let [p, q] = bodies.map(|b| Columns::of(b.over(&region), &grid));
    depth(&p, &q, &grid)
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

    /// Side by side, 0.3 mm of each in the other over their whole length of 20 mm.
    #[test]
    fn what_is_narrow_and_long_is_measured_too() {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
        shop.place("left", plate, [0.0; 3], 0.0, 0.0);
        shop.place("right", plate, [19.7, 0.0, 0.0], 0.0, 0.0);
        let a = shop.finish();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        assert_eq!(meetings.entering.len(), 1);
        assert!((meetings.entering[0].depth - 0.3).abs() < 0.1, "{:?}", meetings.entering);
    }

    #[test]
    fn a_pin_that_fits_its_hole_enters_nothing() {
        let a = sample::pattern_wheel();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        assert!(meetings.entering.is_empty(), "{:?}", meetings.entering);
    }

    /// A wall 0.2 mm thick over a block, and a block under it that the columns' cells are too coarse for.
    #[test]
    fn a_thin_wall_stands_in_the_way() {
        use crate::design::model::{Expr, Extent, Op, Shape};
        let cuboid = |x: f64, y: f64, z: f64| {
            let [x, y, z] = [x, y, z].map(Expr::Const);
            Shape::Box { x, y, z: Extent::Length(z) }
        };
        let mut shop = sample::Shop::default();
        let block = shop.made_of("block", vec![("slab", Op::Add, cuboid(40.0, 30.0, 5.0), [0.0; 3])]);
        let wall = shop.made_of("wall", vec![("slab", Op::Add, cuboid(0.2, 30.0, 5.0), [0.0; 3])]);
        shop.place("block", block, [0.0; 3], 0.0, 0.0);
        shop.place("wall", wall, [3.3, 1.0, 50.0], 0.0, 0.0);
        let a = shop.finish();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        assert_eq!(meetings.way, [vec![1], vec![]]);
    }

    #[test]
    fn pairs_that_stand_alike_meet_alike() {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
        for k in 0..5 {
            shop.place(&format!("plate_{k}"), plate, [0.25 * k as f64, 0.0, 2.0 * k as f64], 0.0, 0.0);
        }
        let a = shop.finish();
        let meetings = Meetings::new(Vector3::z_axis(), &a.solids, &place(&a.design, &a.design.nominal()));
        for (k, way) in meetings.way.iter().enumerate() {
            assert_eq!(*way, (k + 1..5).collect::<Vec<_>>());
        }
    }
}
