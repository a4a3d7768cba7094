//! Where a curve with a parameter meets a surface: roots of quadratics, of waves of degree two, and by search.
//!
//! In: lines, circles, ellipses or any function with its slope. Out: parameters, ascending within one answer's own order; a touch within
//! tolerance is one root; `None` where the function vanishes throughout.

use super::{Surface, tolerance};
use nalgebra::{Matrix3, Point3, Unit, Vector3};
use std::f64::consts::TAU;

/// A surface of the second degree as `q(p) = (p-o)·M(p-o) + n·(p-o) - k`, scaled so that |q| is about the distance near the surface.
pub(super) struct Form {
    origin: Point3<f64>,
    square: Matrix3<f64>,
    linear: Vector3<f64>,
    constant: f64,
}

impl Form {
    /// `None` for a torus, which is of the fourth degree.
    pub fn of(surface: &Surface) -> Option<Form> {
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
            Surface::Sphere { radius, .. } => (Matrix3::identity() / (2.0 * radius), Vector3::zeros(), radius / 2.0),
            Surface::Torus { .. } => return None,
        };
        Some(Form { origin: surface.origin(), square, linear, constant })
    }

    /// Roots of the quadratic `a t² + b t + c` along a line with unit direction.
    pub fn on_line(&self, point: &Point3<f64>, along: &Unit<Vector3<f64>>) -> Option<Vec<f64>> {
        // Seen from the foot of the origin the coefficients stay small and the roots symmetric.
        let start = (self.origin - point).dot(along);
        let q = point + along.into_inner() * start - self.origin;
        let d = along.into_inner();
        let a = d.dot(&(self.square * d));
        let b = 2.0 * d.dot(&(self.square * q)) + self.linear.dot(&d);
        let c = q.dot(&(self.square * q)) + self.linear.dot(&q) - self.constant;
        Some(quadratic(a, b, c)?.into_iter().map(|t| t + start).collect())
    }

    /// Roots of `A + B cos t + C sin t + D cos 2t + E sin 2t` round a circle or ellipse with half axes `x` and `y`.
    pub fn on_circle(&self, centre: &Point3<f64>, x: &Vector3<f64>, y: &Vector3<f64>) -> Option<Vec<f64>> {
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

    fn search(&self) -> Vec<f64> {
        let grid: Vec<f64> = (0..=WAVE_STEPS).map(|i| i as f64 * TAU / WAVE_STEPS as f64).collect();
        let found = search(&grid, &|t| self.value(t), &|t| self.slope(t));
        found.into_iter().map(|t| t.rem_euclid(TAU)).collect()
    }
}

/// Roots of a function between the first and last place of a grid so fine that its slope changes sign at most once from
/// one place to the next. The range is split at the extremes, so that each stretch holds at most one root.
pub(super) fn search(grid: &[f64], value: &dyn Fn(f64) -> f64, slope: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (grid.first(), grid.last()) else { return Vec::new() };
    let slopes: Vec<f64> = grid.iter().map(|t| slope(*t)).collect();
    let mut stops: Vec<(f64, f64)> = vec![(first, value(first))];
    let mut roots = Vec::new();
    for (i, w) in grid.windows(2).enumerate() {
        if (slopes[i] > 0.0) == (slopes[i + 1] > 0.0) {
            continue;
        }
        let extreme = bisect(slope, w[0], w[1]);
        let height = value(extreme);
        if height.abs() < tolerance::TOUCH {
            roots.push(extreme);
        }
        stops.push((extreme, height));
    }
    stops.push((last, value(last)));
    for pair in stops.windows(2) {
        let [(a, from), (b, to)] = [pair[0], pair[1]];
        let inner = |t: f64| t != first && t != last;
        let touched = inner(a) && from.abs() < tolerance::TOUCH || inner(b) && to.abs() < tolerance::TOUCH;
        if !touched && (from > 0.0) != (to > 0.0) {
            roots.push(bisect(value, a, b));
        }
    }
    roots
}

/// The sign change of `f` between `a` and `b`.
fn bisect(f: &dyn Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    let rising = f(b) > 0.0;
    for _ in 0..HALVINGS {
        let m = (a + b) / 2.0;
        if (f(m) > 0.0) == rising { b = m } else { a = m }
    }
    (a + b) / 2.0
}
