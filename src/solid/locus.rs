//! Curves that surfaces share: lines, circles, ellipses and traced curves with a parameter, and where they meet a third
//! surface.
//!
//! In: surfaces. Out: points in mm and parameters (mm along a line, rad round a circle or ellipse, segments of a traced
//! curve). Nothing here knows a feature.

use super::csg::Bounds;
use super::roots::{Form, search};
use super::surface::{across, radial};
use super::traced::Traced;
use super::{Curve, Surface, tolerance};
use nalgebra::{Point3, Unit, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// An unbounded line, a whole circle or ellipse, or a traced curve.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Locus {
    Line {
        point: Point3<f64>,
        along: Unit<Vector3<f64>>,
    },
    Circle {
        centre: Point3<f64>,
        axis: Unit<Vector3<f64>>,
        x: Vector3<f64>,
        y: Vector3<f64>,
        radius: f64,
    },
    /// Half axes square to each other.
    Ellipse {
        centre: Point3<f64>,
        major: Vector3<f64>,
        minor: Vector3<f64>,
    },
    Traced(Arc<Traced>),
}

impl Locus {
    pub fn circle(centre: Point3<f64>, axis: Unit<Vector3<f64>>, radius: f64) -> Self {
        let (x, y) = across(&axis);
        Locus::Circle { centre, axis, x, y, radius }
    }

    /// An ellipse, or a circle where its half axes are alike.
    pub fn ellipse(centre: Point3<f64>, major: Vector3<f64>, minor: Vector3<f64>) -> Self {
        if (major.norm() - minor.norm()).abs() < tolerance::POINT {
            return Locus::circle(centre, Unit::new_normalize(major.cross(&minor)), major.norm());
        }
        Locus::Ellipse { centre, major, minor }
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> Point3<f64> {
        match self {
            Locus::Line { point, along } => point + along.into_inner() * t,
            Locus::Circle { centre, x, y, radius, .. } => centre + (x * t.cos() + y * t.sin()) * *radius,
            Locus::Ellipse { centre, major, minor } => centre + major * t.cos() + minor * t.sin(),
            Locus::Traced(curve) => curve.at(t),
        }
    }

    /// Unit tangent towards growing `t`.
    pub fn tangent(&self, t: f64) -> Vector3<f64> {
        match self {
            Locus::Line { along, .. } => along.into_inner(),
            Locus::Circle { x, y, .. } => y * t.cos() - x * t.sin(),
            Locus::Ellipse { major, minor, .. } => (minor * t.cos() - major * t.sin()).normalize(),
            Locus::Traced(curve) => curve.tangent(t),
        }
    }

    /// A point and its derivative by the parameter, for integrals: a traced curve answers with the cubic through its points.
    pub fn moving(&self, t: f64) -> (Point3<f64>, Vector3<f64>) {
        match self {
            Locus::Line { along, .. } => (self.at(t), along.into_inner()),
            Locus::Circle { radius, .. } => (self.at(t), self.tangent(t) * *radius),
            Locus::Ellipse { major, minor, .. } => (self.at(t), minor * t.cos() - major * t.sin()),
            Locus::Traced(curve) => curve.cubic(t),
        }
    }

    /// Parameter of the point nearest to `p`; from 0 to the period on a closed curve. On an ellipse, of the point in the same
    /// direction once the ellipse is squeezed to a circle, which is the same for points on it.
    pub fn parameter(&self, p: &Point3<f64>) -> f64 {
        match self {
            Locus::Line { point, along } => (p - point).dot(along),
            Locus::Circle { centre, x, y, .. } => (p - centre).dot(y).atan2((p - centre).dot(x)).rem_euclid(TAU),
            Locus::Ellipse { centre, major, minor } => {
                let q = p - centre;
                (q.dot(minor) / minor.norm_squared()).atan2(q.dot(major) / major.norm_squared()).rem_euclid(TAU)
            }
            Locus::Traced(curve) => curve.parameter(p),
        }
    }

    /// Parameters of all passages through `p`, a point on the curve: a traced curve may come back to a place where its
    /// surfaces touch.
    pub fn parameters(&self, p: &Point3<f64>) -> Vec<f64> {
        match self {
            Locus::Traced(curve) => curve.passages(p),
            _ => vec![self.parameter(p)],
        }
    }

    /// After how much the parameter of a closed curve returns to the same point.
    pub fn period(&self) -> Option<f64> {
        match self {
            Locus::Line { .. } => None,
            Locus::Circle { .. } | Locus::Ellipse { .. } => Some(TAU),
            Locus::Traced(curve) => curve.closed.then_some(curve.segments() as f64),
        }
    }

    /// The curve from parameter `a` to `b`.
    pub fn curve(&self, [a, b]: [f64; 2]) -> Curve {
        match self {
            Locus::Line { .. } => Curve::Line,
            Locus::Circle { centre, axis, radius, .. } => {
                Curve::Circle { centre: *centre, axis: *axis, radius: *radius }
            }
            Locus::Ellipse { centre, major, minor } => Curve::Ellipse { centre: *centre, major: *major, minor: *minor },
            Locus::Traced(curve) => curve.spline(a, b),
        }
    }

    /// A box round the curve; `None` for a line.
    pub fn bounds(&self) -> Option<Bounds> {
        let round = |centre: &Point3<f64>, half: Vector3<f64>| Some(Bounds { low: centre - half, high: centre + half });
        match self {
            Locus::Line { .. } => None,
            Locus::Circle { centre, axis, radius, .. } => {
                round(centre, axis.map(|c| radius * (1.0 - c * c).max(0.0).sqrt()))
            }
            Locus::Ellipse { centre, major, minor } => round(centre, major.zip_map(minor, f64::hypot)),
            Locus::Traced(curve) => {
                let mut all = Bounds::empty();
                curve.points.iter().for_each(|p| all.include(p));
                Some(all.widened(tolerance::CULL + curve.longest()))
            }
        }
    }

    /// True when both are the same set of points, within tolerance.
    pub fn same(&self, other: &Locus) -> bool {
        match (self, other) {
            (Locus::Line { point: p, along: d }, Locus::Line { point: q, along: e }) => {
                d.cross(e).norm() < tolerance::DIRECTION && radial(p, d, q).norm() < tolerance::POINT
            }
            (
                Locus::Circle { centre: p, axis: d, radius: r, .. },
                Locus::Circle { centre: q, axis: e, radius: s, .. },
            ) => {
                (r - s).abs() < tolerance::POINT
                    && (p - q).norm() < tolerance::POINT
                    && d.cross(e).norm() * r < tolerance::POINT
            }
            (Locus::Ellipse { centre: p, major: a, minor: b }, Locus::Ellipse { centre: q, major: c, minor: d }) => {
                let alike = |a: &Vector3<f64>, c: &Vector3<f64>| {
                    (a - c).norm().min((a + c).norm()) < ELLIPSE_TOLERANCE * (1.0 + a.norm())
                };
                (p - q).norm() < tolerance::POINT && alike(a, c) && alike(b, d)
            }
            (Locus::Traced(a), Locus::Traced(b)) => a.same(b),
            _ => false,
        }
    }

    /// Parameters where the curve meets `surface`, a touch counted once; `None` when it lies in it.
    pub fn crossings(&self, surface: &Surface) -> Option<Vec<f64>> {
        if let Locus::Traced(curve) = self {
            return curve.crossings(surface);
        }
        let Some(form) = Form::of(surface) else { return self.crossings_by_search(surface) };
        let mut found = match self {
            Locus::Line { point, along } => form.on_line(point, along)?,
            Locus::Circle { centre, x, y, radius, .. } => form.on_circle(centre, &(x * *radius), &(y * *radius))?,
            Locus::Ellipse { centre, major, minor } => form.on_circle(centre, major, minor)?,
            Locus::Traced(_) => Vec::new(),
        };
        if let Surface::Cone { apex, axis, .. } = surface {
            found.retain(|t| (self.at(*t) - apex).dot(axis) > -tolerance::POINT);
        }
        Some(found)
    }

    /// With a torus: its tube is wider than a few steps of the search.
    fn crossings_by_search(&self, torus: &Surface) -> Option<Vec<f64>> {
        let Surface::Torus { centre, major, minor, .. } = torus else { return Some(Vec::new()) };
        let reach = major.abs() + minor;
        let (from, to, speed) = match self {
            Locus::Line { point, along } => {
                let foot = (centre - point).dot(along);
                (foot - reach - minor, foot + reach + minor, 1.0)
            }
            Locus::Circle { radius, .. } => (0.0, TAU, *radius),
            Locus::Ellipse { major, minor, .. } => (0.0, TAU, major.norm().max(minor.norm())),
            Locus::Traced(_) => return Some(Vec::new()),
        };
        let steps = ((to - from) * speed / (minor * TUBE_STEP)).ceil().clamp(FEWEST_STEPS, MOST_STEPS);
        let grid: Vec<f64> = (0..=steps as usize).map(|i| from + (to - from) * i as f64 / steps).collect();
        let value = |t: f64| torus.distance(&self.at(t));
        if grid.iter().all(|t| value(*t).abs() < tolerance::POINT) {
            return None;
        }
        let slope = |t: f64| torus.normal_at(&self.at(t)).dot(&self.tangent(t));
        let found = search(&grid, &value, &slope);
        Some(found.into_iter().map(|t| self.period().map_or(t, |p| t.rem_euclid(p))).collect())
    }
}

/// Half axes of ellipses that differ by less, per mm of their length, are the same: an ellipse from a plane that is nearly
/// along a cylinder is long, and its length is no more exact than the angle.
const ELLIPSE_TOLERANCE: f64 = 1e-7;
/// Steps of a search against a torus: as a share of its tube's radius, the fewest and the most.
const TUBE_STEP: f64 = 0.15;
const FEWEST_STEPS: f64 = 96.0;
const MOST_STEPS: f64 = 20_000.0;
