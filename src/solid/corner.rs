//! How edges follow each other round a corner.
//!
//! In: the half-edges of one sheet that leave a corner, and the one that came to it. Out: the one to go on along. Where curves
//! touch at the corner, and their directions tell nothing, their bends decide.

use super::arrange::Arrangement;
use super::csg::Tree;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Of the half-edges that leave a corner, the first clockwise from the one that came. Where curves touch at the corner their
/// bends decide.
pub(super) fn sharpest(
    tree: &Tree,
    arrangement: &Arrangement,
    (surface, outward): (usize, bool),
    halves: &[(usize, bool)],
    came: (usize, bool),
    choices: &[usize],
) -> Option<usize> {
    if let [only] = choices {
        return Some(*only);
    }
    let back = Leaving::new(arrangement, (came.0, !came.1));
    let normal = tree.surfaces[surface].normal_at(&back.corner) * if outward { 1.0 } else { -1.0 };
    let bend = |l: &Leaving| l.bend.dot(&normal.cross(&l.direction));
    let clockwise = |h: usize| {
        let leaving = Leaving::new(arrangement, halves[h]);
        let (d, from) = (leaving.direction, back.direction);
        let angle = -(normal.dot(&from.cross(&d))).atan2(from.dot(&d));
        // Straight back comes last: a face is not left by the edge it came along. A curve that touches that edge and bends
        // away clockwise comes first.
        let angle = match angle {
            a if a.abs() < TIE && bend(&leaving) < bend(&back) - SAME_BEND => 0.0,
            a if a.abs() < TIE => TAU,
            a if a < 0.0 => a + TAU,
            a => a,
        };
        ((angle / TIE).round() as i64, -bend(&leaving))
    };
    let before =
        |a: &(i64, f64), b: &(i64, f64)| if (a.0 - b.0).abs() <= 1 { a.1.total_cmp(&b.1) } else { a.0.cmp(&b.0) };
    choices.iter().copied().min_by(|a, b| before(&clockwise(*a), &clockwise(*b)))
}

/// Directions at a corner that differ by less (rad) touch: two curves that overlap by the tolerance of touching.
pub(super) const TIE: f64 = 2e-5;
/// Bends (1/mm) that differ by less are one edge's.
const SAME_BEND: f64 = 1e-6;

/// How a half-edge leaves its corner: direction, and how the direction turns per mm.
pub(super) struct Leaving {
    corner: Point3<f64>,
    pub direction: Vector3<f64>,
    pub bend: Vector3<f64>,
}

/// Share of an edge over which its bend at the end is taken.
const BEND_SHARE: f64 = 1e-3;

impl Leaving {
    pub fn new(arrangement: &Arrangement, (arc, forward): (usize, bool)) -> Self {
        let arc = &arrangement.arcs[arc];
        let locus = &arrangement.curves[arc.curve];
        let way = if forward { 1.0 } else { -1.0 };
        let t = arc.span[usize::from(!forward)];
        let on = t + way * (arc.span[1] - arc.span[0]) * BEND_SHARE;
        let (corner, direction) = (locus.at(t), locus.tangent(t) * way);
        let length = (locus.at(on) - corner).norm().max(f64::MIN_POSITIVE);
        Leaving { corner, direction, bend: (locus.tangent(on) * way - direction) / length }
    }
}
