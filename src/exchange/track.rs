//! The exact curve under an edge, with a parameter that runs from 0 at its start to 1 at its end.
//!
//! In: an [`Edge`] and the solid's vertices. Out: points on it, and parts of it. Never leaves the curve: what is cut out
//! of a circle is a circle, what is cut out of a spline is the same polynomial.

use crate::solid::{Curve, Edge};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// Chords of a whole turn when an arc is followed step by step: a turn of 5.6° cannot jump across a face unseen.
const STEPS_PER_TURN: f64 = 64.0;
/// Steps between two knots of a spline.
const STEPS_PER_SPAN: usize = 4;
/// Turns smaller than this (rad) are rounding, not arcs.
const NO_TURN: f64 = 1e-12;

/// A curve from a start to an end, mm.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Track {
    Line {
        from: Point3<f64>,
        to: Point3<f64>,
    },
    /// `centre + x cos a + y sin a` for `a` in `from..=from + sweep` (rad); x and y are square to each other, as long as
    /// the half axes, and equally long on a circle.
    Arc {
        centre: Point3<f64>,
        x: Vector3<f64>,
        y: Vector3<f64>,
        from: f64,
        sweep: f64,
    },
    /// At `knots[i]` it passes `points[i]` with the derivative `slopes[i]`; a cubic between.
    Spline {
        knots: Vec<f64>,
        points: Vec<Point3<f64>>,
        slopes: Vec<Vector3<f64>>,
    },
}

impl Track {
    /// The curve of an edge between its corners; a closed edge starts at its first sample.
    pub fn new(edge: &Edge, vertices: &[Point3<f64>]) -> Option<Track> {
        let (first, last) = (edge.samples.first()?, edge.samples.last()?);
        let from = edge.ends[0].map_or(*first, |v| vertices[v]);
        let to = edge.ends[1].map_or(*last, |v| vertices[v]);
        let whole = edge.ends[0] == edge.ends[1];
        Some(match &edge.curve {
            Curve::Line => Track::Line { from, to },
            Curve::Circle { centre, axis, radius } => {
                let out = from - centre;
                let x = (out - axis.into_inner() * out.dot(axis)).try_normalize(f64::MIN_POSITIVE)? * *radius;
                Track::arc(*centre, x, axis.cross(&x), &from, &to, whole)
            }
            Curve::Ellipse { centre, major, minor } => Track::arc(*centre, *major, *minor, &from, &to, whole),
            Curve::Spline { points, tangents } => Track::Spline {
                knots: (0..points.len()).map(|i| i as f64).collect(),
                points: points.clone(),
                slopes: tangents.clone(),
            },
        })
    }

    fn arc(
        centre: Point3<f64>,
        x: Vector3<f64>,
        y: Vector3<f64>,
        start: &Point3<f64>,
        end: &Point3<f64>,
        whole: bool,
    ) -> Track {
        let angle = |p: &Point3<f64>| {
            let q = p - centre;
            (q.dot(&y) / y.norm_squared()).atan2(q.dot(&x) / x.norm_squared())
        };
        let from = angle(start);
        let turn = (angle(end) - from).rem_euclid(TAU);
        let sweep = if whole || turn < NO_TURN { TAU } else { turn };
        Track::Arc { centre, x, y, from, sweep }
    }

    /// The point at `t` in 0..=1; a whole turn goes on beyond 1.
    pub fn at(&self, t: f64) -> Point3<f64> {
        match self {
            Track::Line { from, to } => from + (to - from) * t,
            Track::Arc { centre, x, y, from, sweep } => {
                let (sin, cos) = (from + sweep * t).sin_cos();
                centre + x * cos + y * sin
            }
            Track::Spline { knots, .. } => self.spline_at(knots[0] + (knots[knots.len() - 1] - knots[0]) * t).0,
        }
    }

    /// Parameters at which to look, both ends included.
    pub fn steps(&self) -> Vec<f64> {
        let count = match self {
            Track::Line { .. } => 1,
            Track::Arc { sweep, .. } => (sweep / TAU * STEPS_PER_TURN).ceil().max(2.0) as usize,
            Track::Spline { knots, .. } => (knots.len() - 1) * STEPS_PER_SPAN,
        };
        (0..=count).map(|i| i as f64 / count as f64).collect()
    }

    /// The piece between two parameters, `a < b`; of a whole turn `b` may go beyond 1.
    pub fn part(&self, a: f64, b: f64) -> Track {
        match self {
            Track::Line { .. } => Track::Line { from: self.at(a), to: self.at(b) },
            Track::Arc { centre, x, y, from, sweep } => {
                Track::Arc { centre: *centre, x: *x, y: *y, from: from + sweep * a, sweep: sweep * (b - a) }
            }
            Track::Spline { knots, points, slopes } => {
                let (first, length) = (knots[0], knots[knots.len() - 1] - knots[0]);
                let (low, high) = (first + length * a, first + length * b);
                let ((p, d), (q, e)) = (self.spline_at(low), self.spline_at(high));
                let inner = |i: &usize| knots[*i] > low && knots[*i] < high;
                let inner: Vec<usize> = (0..knots.len()).filter(inner).collect();
                Track::Spline {
                    knots: around(low, inner.iter().map(|i| knots[*i]), high),
                    points: around(p, inner.iter().map(|i| points[*i]), q),
                    slopes: around(d, inner.iter().map(|i| slopes[*i]), e),
                }
            }
        }
    }

    /// Point and derivative at a knot value.
    fn spline_at(&self, knot: f64) -> (Point3<f64>, Vector3<f64>) {
        let Track::Spline { knots, points, slopes } = self else { return (self.at(0.0), Vector3::zeros()) };
        let last = knots.len().saturating_sub(2);
        let i = knots.partition_point(|k| *k <= knot).saturating_sub(1).min(last);
        let h = knots[i + 1] - knots[i];
        let s = (knot - knots[i]) / h;
        let rise = points[i + 1] - points[i];
        let (d, e) = (slopes[i] * h, slopes[i + 1] * h);
        // p + d s + (3 rise - 2 d - e) s² + (d + e - 2 rise) s³
        let (second, third) = (rise * 3.0 - d * 2.0 - e, d + e - rise * 2.0);
        let point = points[i] + d * s + second * (s * s) + third * (s * s * s);
        (point, (d + second * (2.0 * s) + third * (3.0 * s * s)) / h)
    }
}

fn around<T>(first: T, inner: impl Iterator<Item = T>, last: T) -> Vec<T> {
    std::iter::once(first).chain(inner).chain(std::iter::once(last)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spline() -> Track {
        let point = |t: f64| Point3::new(t, t * t, t * t * t);
        let slope = |t: f64| Vector3::new(1.0, 2.0 * t, 3.0 * t * t);
        let knots = vec![0.0, 1.0, 2.0, 3.0];
        let (points, slopes) = (knots.iter().map(|t| point(*t)).collect(), knots.iter().map(|t| slope(*t)).collect());
        Track::Spline { knots, points, slopes }
    }

    #[test]
    fn a_spline_reproduces_a_cubic_and_so_do_its_parts() {
        let whole = spline();
        let part = whole.part(0.2, 0.9);
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            let k = 3.0 * t;
            assert!((whole.at(t) - Point3::new(k, k * k, k * k * k)).norm() < 1e-12);
            assert!((part.at(t) - whole.at(0.2 + 0.7 * t)).norm() < 1e-12);
        }
    }

    #[test]
    fn parts_of_an_arc_lie_on_it() {
        let arc = Track::Arc {
            centre: Point3::origin(),
            x: Vector3::x() * 3.0,
            y: Vector3::y() * 2.0,
            from: 0.4,
            sweep: TAU,
        };
        let part = arc.part(0.75, 1.25);
        assert!((part.at(0.5) - arc.at(1.0)).norm() < 1e-12 && (part.at(1.0) - arc.at(0.25)).norm() < 1e-12);
    }
}
