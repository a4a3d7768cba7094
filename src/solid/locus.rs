//! Curves that surfaces share: lines and circles with a parameter, and where they meet a third surface.
//!
//! In: surfaces. Out: points in mm and parameters (mm along a line, rad round a circle). Nothing here knows a feature.

use super::surface::{across, radial};
use super::{Curve, Surface, tolerance};
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use std::f64::consts::TAU;

/// An unbounded line or a whole circle.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Locus {
    Line { point: Point3<f64>, along: Unit<Vector3<f64>> },
    Circle { centre: Point3<f64>, axis: Unit<Vector3<f64>>, x: Vector3<f64>, y: Vector3<f64>, radius: f64 },
}

impl Locus {
    pub fn circle(centre: Point3<f64>, axis: Unit<Vector3<f64>>, radius: f64) -> Self {
        let (x, y) = across(&axis);
        Locus::Circle { centre, axis, x, y, radius }
    }

    /// The point at parameter `t`.
    pub fn at(&self, t: f64) -> Point3<f64> {
        match self {
            Locus::Line { point, along } => point + along.into_inner() * t,
            Locus::Circle { centre, x, y, radius, .. } => centre + (x * t.cos() + y * t.sin()) * *radius,
        }
    }

    /// Unit tangent towards growing `t`.
    pub fn tangent(&self, t: f64) -> Vector3<f64> {
        match self {
            Locus::Line { along, .. } => along.into_inner(),
            Locus::Circle { x, y, .. } => y * t.cos() - x * t.sin(),
        }
    }

    /// Parameter of the point nearest to `p`; 0..2π on a circle.
    pub fn parameter(&self, p: &Point3<f64>) -> f64 {
        match self {
            Locus::Line { point, along } => (p - point).dot(along),
            Locus::Circle { centre, x, y, .. } => (p - centre).dot(y).atan2((p - centre).dot(x)).rem_euclid(TAU),
        }
    }

    /// True for a curve that returns to its start.
    pub fn closed(&self) -> bool {
        matches!(self, Locus::Circle { .. })
    }

    pub fn curve(&self) -> Curve {
        match self {
            Locus::Line { .. } => Curve::Line,
            Locus::Circle { centre, axis, radius, .. } => {
                Curve::Circle { centre: *centre, axis: *axis, radius: *radius }
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
            _ => false,
        }
    }

    /// Parameters where the curve meets `surface`, a touch counted once; `None` when it lies in it.
    pub fn crossings(&self, surface: &Surface) -> Option<Vec<f64>> {
        let form = Form::of(surface);
        let mut found = match self {
            Locus::Line { point, along } => form.on_line(point, along)?,
            Locus::Circle { centre, x, y, radius, .. } => form.on_circle(centre, &(x * *radius), &(y * *radius))?,
        };
        if let Surface::Cone { apex, axis, .. } = surface {
            found.retain(|t| (self.at(*t) - apex).dot(axis) > -tolerance::POINT);
        }
        Some(found)
    }
}

/// A surface as `q(p) = (p-o)·M(p-o) + n·(p-o) - k`, scaled so that |q| is about the distance near the surface.
struct Form {
    origin: Point3<f64>,
    square: Matrix3<f64>,
    linear: Vector3<f64>,
    constant: f64,
}

impl Form {
    fn of(surface: &Surface) -> Form {
        let plane = |normal: &Unit<Vector3<f64>>, offset: f64| (Matrix3::zeros(), normal.into_inner(), offset);
        let (square, linear, constant) = match surface {
            Surface::Plane { normal, .. } => plane(normal, 0.0),
            Surface::Cylinder { axis, radius, .. } => {
                let across = Matrix3::identity() - axis.into_inner() * axis.transpose();
                (across / (2.0 * radius), Vector3::zeros(), radius / 2.0)
            }
            Surface::Cone { axis, half_angle, .. } => {
                let along = axis.into_inner() * axis.transpose();
                let (sin, cos) = half_angle.sin_cos();
                ((Matrix3::identity() - along) * (cos * cos) - along * (sin * sin), Vector3::zeros(), 0.0)
            }
            Surface::Sphere { radius, .. } | Surface::Torus { minor: radius, .. } => {
                (Matrix3::identity() / (2.0 * radius), Vector3::zeros(), radius / 2.0)
            }
        };
        Form { origin: surface.origin(), square, linear, constant }
    }

    /// Roots of the quadratic `a t² + b t + c` along a line with unit direction.
    fn on_line(&self, point: &Point3<f64>, along: &Unit<Vector3<f64>>) -> Option<Vec<f64>> {
        // Seen from the foot of the origin the coefficients stay small and the roots symmetric.
        let start = (self.origin - point).dot(along);
        let q = point + along.into_inner() * start - self.origin;
        let d = along.into_inner();
        let a = d.dot(&(self.square * d));
        let b = 2.0 * d.dot(&(self.square * q)) + self.linear.dot(&d);
        let c = q.dot(&(self.square * q)) + self.linear.dot(&q) - self.constant;
        Some(quadratic(a, b, c)?.into_iter().map(|t| t + start).collect())
    }

    /// Roots of `A + B cos t + C sin t + D cos 2t + E sin 2t` round a circle with half axes `x` and `y`.
    fn on_circle(&self, centre: &Point3<f64>, x: &Vector3<f64>, y: &Vector3<f64>) -> Option<Vec<f64>> {
        let q = centre - self.origin;
        let (mx, my, mq) = (self.square * x, self.square * y, self.square * q);
        let (xx, yy, xy) = (x.dot(&mx), y.dot(&my), x.dot(&my));
        let wave = Wave {
            constant: q.dot(&mq) + self.linear.dot(&q) - self.constant + (xx + yy) / 2.0,
            cos: 2.0 * x.dot(&mq) + self.linear.dot(x),
            sin: 2.0 * y.dot(&mq) + self.linear.dot(y),
            cos2: (xx - yy) / 2.0,
            sin2: xy,
        };
        wave.roots()
    }
}

/// Roots of a quadratic whose value is about a distance in mm; a touch within tolerance is one root; `None` when it
/// vanishes.
fn quadratic(a: f64, b: f64, c: f64) -> Option<Vec<f64>> {
    let flat = tolerance::DIRECTION;
    if a.abs() < flat * flat && b.abs() < flat {
        return if c.abs() < tolerance::POINT { None } else { Some(Vec::new()) };
    }
    if a.abs() < flat * flat {
        return Some(vec![-c / b]);
    }
    let middle = -b / (2.0 * a);
    // Value of the quadratic at its extreme: a distance, compared with the tolerance of distances.
    let extreme = c - b * b / (4.0 * a);
    if extreme.abs() < tolerance::TOUCH {
        return Some(vec![middle]);
    }
    if (extreme > 0.0) == (a > 0.0) {
        return Some(Vec::new());
    }
    let half = (-extreme / a).sqrt();
    Some(vec![middle - half, middle + half])
}

/// A trigonometric polynomial of degree 2.
struct Wave {
    constant: f64,
    cos: f64,
    sin: f64,
    cos2: f64,
    sin2: f64,
}

/// Steps that a whole turn is searched in for sign changes: a degree-2 wave has at most four roots.
const WAVE_STEPS: usize = 96;
/// Halvings of a step when a root or an extreme is bracketed; beyond the precision of a double.
const HALVINGS: usize = 60;

impl Wave {
    fn roots(&self) -> Option<Vec<f64>> {
        let first = self.cos.hypot(self.sin);
        let second = self.cos2.hypot(self.sin2);
        if first < tolerance::POINT && second < tolerance::POINT {
            return if self.constant.abs() < tolerance::POINT { None } else { Some(Vec::new()) };
        }
        if second < tolerance::DIRECTION * first {
            return Some(self.harmonic(first));
        }
        Some(self.search())
    }

    /// Roots of `constant + first cos(t - phase)`.
    fn harmonic(&self, first: f64) -> Vec<f64> {
        let phase = self.sin.atan2(self.cos);
        if (self.constant.abs() - first).abs() < tolerance::TOUCH {
            let touch = if self.constant < 0.0 { phase } else { phase + TAU / 2.0 };
            return vec![touch.rem_euclid(TAU)];
        }
        if self.constant.abs() > first {
            return Vec::new();
        }
        let half = (-self.constant / first).acos();
        vec![(phase - half).rem_euclid(TAU), (phase + half).rem_euclid(TAU)]
    }

    fn value(&self, t: f64) -> f64 {
        let ((s, c), (s2, c2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        self.constant + self.cos * c + self.sin * s + self.cos2 * c2 + self.sin2 * s2
    }

    fn slope(&self, t: f64) -> f64 {
        let ((s, c), (s2, c2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        self.sin * c - self.cos * s + 2.0 * (self.sin2 * c2 - self.cos2 * s2)
    }

    /// Splits the turn at the extremes, so that each stretch holds at most one root, and bisects.
    fn search(&self) -> Vec<f64> {
        let step = TAU / WAVE_STEPS as f64;
        let mut stops: Vec<f64> = Vec::new();
        for i in 0..WAVE_STEPS {
            let (a, b) = (i as f64 * step, (i + 1) as f64 * step);
            if (self.slope(a) > 0.0) != (self.slope(b) > 0.0) {
                stops.push(bisect(|t| self.slope(t), a, b));
            }
        }
        let mut roots: Vec<f64> = stops.iter().copied().filter(|t| self.value(*t).abs() < tolerance::TOUCH).collect();
        for (i, &a) in stops.iter().enumerate() {
            let b = if i + 1 < stops.len() { stops[i + 1] } else { stops[0] + TAU };
            let clear = self.value(a).abs() >= tolerance::TOUCH && self.value(b).abs() >= tolerance::TOUCH;
            if clear && (self.value(a) > 0.0) != (self.value(b) > 0.0) {
                roots.push(bisect(|t| self.value(t), a, b).rem_euclid(TAU));
            }
        }
        roots
    }
}

/// The sign change of `f` between `a` and `b`.
fn bisect(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let rising = f(b) > 0.0;
    for _ in 0..HALVINGS {
        let m = (a + b) / 2.0;
        if (f(m) > 0.0) == rising { b = m } else { a = m }
    }
    (a + b) / 2.0
}
