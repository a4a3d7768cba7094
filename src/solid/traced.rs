//! A curve that is neither line, circle nor ellipse: points on two surfaces, and between them whatever both surfaces say.
//!
//! In: points with tangents, as `trace` finds them. Out: exact points at any parameter (the cubic between two points, moved
//! onto both surfaces), crossings with other surfaces, splines. Parameter t counts segments. Finds no curve by itself.

use super::roots::search;
use super::{Curve, Surface, tolerance};
use nalgebra::{Point3, Vector3};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Traced {
    /// The two surfaces it was found on.
    pub surfaces: [Surface; 2],
    /// A closed curve does not repeat its first point.
    pub points: Vec<Point3<f64>>,
    /// Unit tangents forward.
    pub tangents: Vec<Vector3<f64>>,
    pub closed: bool,
}

/// Newton's steps onto two surfaces; three are enough from a cubic, more near a place where the surfaces touch.
const STEPS: usize = 12;
/// Below this sine of the angle between two surfaces they are met one after the other instead of at once.
const NEARLY_TANGENT: f64 = 1e-7;
/// What is left of a distance (mm) after the last step: rounding at places 100 mm away.
const ARRIVED: f64 = 1e-14;

/// `p` moved onto both surfaces by the shortest steps.
pub(super) fn onto([a, b]: [&Surface; 2], mut p: Point3<f64>) -> Point3<f64> {
    for _ in 0..STEPS {
        let (d, e) = (a.distance(&p), b.distance(&p));
        if d.abs().max(e.abs()) < ARRIVED {
            break;
        }
        let (n, m) = (a.normal_at(&p), b.normal_at(&p));
        let c = n.dot(&m);
        let sine = 1.0 - c * c;
        if sine > NEARLY_TANGENT * NEARLY_TANGENT {
            p -= n * ((d - c * e) / sine) + m * ((e - c * d) / sine);
        } else {
            p -= n * d;
        }
    }
    p
}

/// A point and its derivative on the cubic from `p` to `q` with unit tangents there, at share `s`.
pub(super) fn cubic(
    (p, u): (&Point3<f64>, &Vector3<f64>),
    (q, v): (&Point3<f64>, &Vector3<f64>),
    s: f64,
) -> (Point3<f64>, Vector3<f64>) {
    let chord = q - p;
    // The derivative that makes a cubic hug an arc of this turn: 4 r tan(turn / 4), to second order.
    let turn = u.cross(v).norm().atan2(u.dot(v));
    let speed = chord.norm() * (1.0 + turn * turn / 16.0);
    let (u, v) = (u * speed, v * speed);
    let (s2, s3) = (s * s, s * s * s);
    let place = p + chord * (3.0 * s2 - 2.0 * s3) + u * (s3 - 2.0 * s2 + s) + v * (s3 - s2);
    let motion = chord * (6.0 * s - 6.0 * s2) + u * (3.0 * s2 - 4.0 * s + 1.0) + v * (3.0 * s2 - 2.0 * s);
    (place, motion)
}

impl Traced {
    pub fn segments(&self) -> usize {
        if self.closed { self.points.len() } else { self.points.len() - 1 }
    }

    /// Longest chord (mm).
    pub fn longest(&self) -> f64 {
        (0..self.segments()).map(|i| (self.end(i).0 - self.points[i]).norm()).fold(0.0, f64::max)
    }

    fn end(&self, segment: usize) -> (&Point3<f64>, &Vector3<f64>) {
        let next = (segment + 1) % self.points.len();
        (&self.points[next], &self.tangents[next])
    }

    /// Segment and share of it.
    fn locate(&self, t: f64) -> (usize, f64) {
        let n = self.segments();
        let t = if self.closed { t.rem_euclid(n as f64) } else { t.clamp(0.0, n as f64) };
        let segment = (t.floor() as usize).min(n - 1);
        (segment, t - segment as f64)
    }

    /// The cubic at `t` and its derivative.
    pub fn cubic(&self, t: f64) -> (Point3<f64>, Vector3<f64>) {
        let (i, s) = self.locate(t);
        cubic((&self.points[i], &self.tangents[i]), self.end(i), s)
    }

    pub fn at(&self, t: f64) -> Point3<f64> {
        let (i, s) = self.locate(t);
        // The points themselves are exact, even where the surfaces touch.
        if s == 0.0 {
            return self.points[i];
        }
        if s == 1.0 {
            return *self.end(i).0;
        }
        let from = self.cubic(t).0;
        let place = onto([&self.surfaces[0], &self.surfaces[1]], from);
        let moved = (place - from).norm();
        if moved <= STRAYED { place } else { from }
    }

    pub fn tangent(&self, t: f64) -> Vector3<f64> {
        let motion = self.cubic(t).1;
        let p = self.at(t);
        let [n, m] = self.surfaces.each_ref().map(|s| s.normal_at(&p));
        let exact = n.cross(&m);
        if exact.norm() < SLANT {
            return motion.normalize();
        }
        exact.normalize() * exact.dot(&motion).signum()
    }

    /// Of the nearest point.
    pub fn parameter(&self, p: &Point3<f64>) -> f64 {
        let near = |i: &usize| {
            let (a, b) = (self.points[*i], *self.end(*i).0);
            let share = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            (p - (a + (b - a) * share)).norm()
        };
        let segment = (0..self.segments()).min_by(|i, j| near(i).total_cmp(&near(j))).unwrap_or(0);
        let t = self.parameter_in(segment, p);
        if self.closed { t.rem_euclid(self.segments() as f64) } else { t }
    }

    /// Of the point of one segment nearest to `p`.
    fn parameter_in(&self, segment: usize, p: &Point3<f64>) -> f64 {
        let mut s = 0.5;
        for _ in 0..STEPS {
            let (q, motion) = cubic((&self.points[segment], &self.tangents[segment]), self.end(segment), s);
            let step = (p - q).dot(&motion) / motion.norm_squared();
            s = (s + step).clamp(0.0, 1.0);
        }
        segment as f64 + s
    }

    /// Parameters at which the curve passes `p`, ascending; the nearest where it passes none.
    pub fn passages(&self, p: &Point3<f64>) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::new();
        for segment in 0..self.segments() {
            let (from, to) = (self.points[segment], *self.end(segment).0);
            let chord = to - from;
            let share = ((p - from).dot(&chord) / chord.norm_squared()).clamp(0.0, 1.0);
            if (p - (from + chord * share)).norm() > chord.norm() * BOW {
                continue;
            }
            let t = self.parameter_in(segment, p);
            let off = |t: f64| (self.cubic(t).0 - p).norm();
            if off(t) >= PASSES {
                continue;
            }
            // By a point of the curve both segments there pass: the nearer one is right.
            match found.last_mut() {
                Some(last) if t - *last < 1.0 && off((*last + t) / 2.0) < PASSES => {
                    if off(t) < off(*last) {
                        *last = t;
                    }
                }
                _ => found.push(t),
            }
        }
        if self.closed {
            let last = self.segments() as f64;
            found.iter_mut().for_each(|t| *t = t.rem_euclid(last));
            found.sort_by(f64::total_cmp);
            let wraps = found.len() > 1 && found[0] < WRAPPED && found[found.len() - 1] > last - WRAPPED;
            if wraps {
                found.pop();
            }
        }
        if found.is_empty() { vec![self.parameter(p)] } else { found }
    }

    /// Whether both are the same points: either's lie on the surfaces of the other.
    pub fn same(&self, other: &Traced) -> bool {
        let on = |p: &Point3<f64>, curve: &Traced| {
            curve.surfaces.iter().all(|s| s.distance(p).abs() < tolerance::POINT)
                && (curve.at(curve.parameter(p)) - p).norm() < tolerance::WELD
        };
        let middle = |curve: &Traced| curve.at(curve.segments() as f64 / 2.0 + 0.37);
        self.closed == other.closed
            && on(&middle(self), other)
            && on(&middle(other), self)
            && self.points.iter().all(|p| on(p, other))
    }

    pub fn crossings(&self, surface: &Surface) -> Option<Vec<f64>> {
        let finest = match surface {
            Surface::Plane { .. } => f64::INFINITY,
            Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => *radius,
            Surface::Torus { minor, .. } => *minor,
            Surface::Cone { .. } => f64::INFINITY,
        };
        let parts = (self.longest() / (finest * SEARCH_STEP)).ceil().clamp(1.0, 64.0) as usize;
        let count = self.segments() * parts;
        let grid: Vec<f64> = (0..=count).map(|k| k as f64 / parts as f64).collect();
        let value = |t: f64| surface.distance(&self.at(t));
        let last = self.segments() as f64;
        if grid.iter().all(|t| value(*t).abs() < tolerance::POINT) {
            return None;
        }
        let slope = |t: f64| surface.normal_at(&self.at(t)).dot(&self.tangent(t));
        let mut found = search(&grid, &value, &slope);
        if self.closed {
            found.iter_mut().for_each(|t| *t = t.rem_euclid(last));
        } else {
            let known = found.clone();
            let ends = [0.0, last].into_iter().filter(|e| value(*e).abs() < tolerance::POINT);
            found.extend(ends.filter(|e| known.iter().all(|t| (self.at(*t) - self.at(*e)).norm() > tolerance::WELD)));
        }
        Some(found)
    }

    /// The stretch from `a` to `b` as a cubic through evenly spaced points, with points doubled until it is exact enough.
    pub fn spline(&self, a: f64, b: f64) -> Curve {
        let mut pieces = FEWEST_PIECES;
        loop {
            let spline = self.even(a, b, pieces);
            if pieces >= MOST_PIECES || self.strays(&spline) < SPLINE_TOLERANCE {
                let (points, tangents) = spline;
                return Curve::Spline { points, tangents };
            }
            pieces *= 2;
        }
    }

    /// Points at equal distances along the curve, and derivatives as long as the distance.
    fn even(&self, a: f64, b: f64, pieces: usize) -> (Vec<Point3<f64>>, Vec<Vector3<f64>>) {
        let lengths = self.lengths(a, b);
        let total = lengths[lengths.len() - 1].1;
        let mut points = Vec::with_capacity(pieces + 1);
        let mut tangents = Vec::with_capacity(pieces + 1);
        let step = total / pieces as f64;
        for k in 0..=pieces {
            let wanted = step * k as f64;
            let after = lengths.partition_point(|l| l.1 < wanted).clamp(1, lengths.len() - 1);
            let ((t, l), (u, m)) = (lengths[after - 1], lengths[after]);
            let t = if k == 0 {
                a
            } else if k == pieces {
                b
            } else {
                t + (u - t) * ((wanted - l) / (m - l).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
            };
            points.push(self.at(t));
            tangents.push(self.tangent(t) * step);
        }
        (points, tangents)
    }

    /// Parameters and the distance along the curve up to them.
    fn lengths(&self, a: f64, b: f64) -> Vec<(f64, f64)> {
        let steps = ((b - a) * LENGTH_STEPS).ceil().max(LENGTH_STEPS) as usize;
        let mut lengths = vec![(a, 0.0)];
        let mut before = self.cubic(a).0;
        for k in 1..=steps {
            let t = a + (b - a) * k as f64 / steps as f64;
            let here = self.cubic(t).0;
            lengths.push((t, lengths[k - 1].1 + (here - before).norm()));
            before = here;
        }
        lengths
    }

    /// Greatest distance of a spline from either surface, looked for at the middles and quarters of its pieces.
    fn strays(&self, (points, tangents): &(Vec<Point3<f64>>, Vec<Vector3<f64>>)) -> f64 {
        let mut worst: f64 = 0.0;
        for i in 0..points.len() - 1 {
            for s in [0.25, 0.5, 0.75] {
                let (s2, s3) = (s * s, s * s * s);
                let chord = points[i + 1] - points[i];
                let p = points[i]
                    + chord * (3.0 * s2 - 2.0 * s3)
                    + tangents[i] * (s3 - 2.0 * s2 + s)
                    + tangents[i + 1] * (s3 - s2);
                worst = self.surfaces.iter().map(|surface| surface.distance(&p).abs()).fold(worst, f64::max);
            }
        }
        worst
    }
}

/// How far a segment bows out from its chord at most, as a share of it; more than enough for the turn of a step.
const BOW: f64 = 0.1;
/// A curve that comes this near a point (mm) passes it.
const PASSES: f64 = 5e-6;
/// Parameters this near both ends of a closed curve are one place.
const WRAPPED: f64 = 1e-3;
/// A point that Newton's steps move farther than this (mm) from the cubic has gone astray, as may happen where the surfaces
/// touch: the cubic is nearer than that by construction.
const STRAYED: f64 = 1e-4;
/// Below this sine of their angle the normals of two surfaces do not tell the direction of their curve.
const SLANT: f64 = 1e-6;
/// Steps of a search as a share of the radius of what is searched for.
const SEARCH_STEP: f64 = 0.5;
/// Pieces of a spline, fewest and most.
const FEWEST_PIECES: usize = 8;
const MOST_PIECES: usize = 4096;
/// Distance of a spline from its surfaces (mm): a fifth of what is promised.
const SPLINE_TOLERANCE: f64 = 2e-5;
/// Chords per segment when lengths are measured.
const LENGTH_STEPS: f64 = 8.0;
