//! The geometry of one surface: signed distance, normal, curvature, frame and equal-area chart.
//!
//! In: a [`Surface`] and a point. Out: numbers in mm and rad. Nothing here knows a feature, a face or a solid.
//!
//! Charts are right-handed with the canonical normal and *equal-area*: a region's area in the chart, in mm², is its
//! area on the surface. So one formula, `-∮ v du`, measures every kind of face.

use super::{Surface, tolerance};
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::f64::consts::TAU;

/// A direction with a component above this along world x takes its frame from world y (cosine).
const FRAME_SWITCH: f64 = 0.9;

/// Two unit vectors that make `(x, y, axis)` a right-handed frame, the same for all surfaces with this axis.
pub(super) fn across(axis: &Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let seed = if axis.x.abs() < FRAME_SWITCH { Vector3::x() } else { Vector3::y() };
    let x = (seed - axis.into_inner() * seed.dot(axis)).normalize();
    (x, axis.cross(&x))
}

impl Surface {
    /// Unit vector the surface is built about: the normal of a plane, the axis of a cylinder, cone or torus, the axis of a
    /// sphere's chart.
    pub fn axis(&self) -> Unit<Vector3<f64>> {
        match self {
            Surface::Plane { normal, .. } => *normal,
            Surface::Cylinder { axis, .. }
            | Surface::Cone { axis, .. }
            | Surface::Sphere { axis, .. }
            | Surface::Torus { axis, .. } => *axis,
        }
    }

    /// Origin of the frame: the plane's foot of the part's origin, a point on the axis, the apex, the centre.
    pub fn origin(&self) -> Point3<f64> {
        match self {
            Surface::Plane { normal, offset } => Point3::from(normal.into_inner() * *offset),
            Surface::Cylinder { point, .. } => *point,
            Surface::Cone { apex, .. } => *apex,
            Surface::Sphere { centre, .. } | Surface::Torus { centre, .. } => *centre,
        }
    }

    /// The frame of the chart: z along [`Surface::axis`], origin at [`Surface::origin`], x the projection of world x
    /// (of world y where the axis is near world x), from which the angle θ counts towards y.
    pub fn frame(&self) -> Isometry3<f64> {
        let axis = self.axis();
        let (x, y) = across(&axis);
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, axis.into_inner()]));
        Isometry3::from_parts(Translation3::from(self.origin().coords), UnitQuaternion::from_rotation_matrix(&turn))
    }

    /// Distance from the surface in mm, positive on the side of the canonical normal. For a cone, the distance from the
    /// flank's tangent plane on that side of the axis, which is the distance where the foot lies on the flank.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        match self {
            Surface::Plane { normal, offset } => normal.dot(&p.coords) - offset,
            Surface::Cylinder { point, axis, radius } => radial(point, axis, p).norm() - radius,
            Surface::Cone { apex, axis, half_angle } => {
                let (sin, cos) = half_angle.sin_cos();
                radial(apex, axis, p).norm() * cos - (p - apex).dot(axis) * sin
            }
            Surface::Sphere { centre, radius, .. } => (p - centre).norm() - radius,
            Surface::Torus { centre, axis, major, minor } => {
                let rho = radial(centre, axis, p).norm();
                (rho - major).hypot((p - centre).dot(axis)) - minor
            }
        }
    }

    /// The canonical unit normal at `p`, a point on the surface: away from the axis or centre. Zero on an apex, an axis
    /// or a centre, where there is none.
    pub fn normal_at(&self, p: &Point3<f64>) -> Vector3<f64> {
        let unit = |v: Vector3<f64>| v.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros);
        match self {
            Surface::Plane { normal, .. } => normal.into_inner(),
            Surface::Cylinder { point, axis, .. } => unit(radial(point, axis, p)),
            Surface::Cone { apex, axis, half_angle } => {
                let out = unit(radial(apex, axis, p));
                let (sin, cos) = half_angle.sin_cos();
                if out == Vector3::zeros() { out } else { out * cos - axis.into_inner() * sin }
            }
            Surface::Sphere { centre, .. } => unit(p - centre),
            Surface::Torus { centre, axis, major, .. } => {
                let out = unit(radial(centre, axis, p));
                unit(p - centre - out * *major)
            }
        }
    }

    /// Second derivative of [`Surface::distance`] at `p` on the surface along the unit tangent `d`, in 1/mm.
    pub(super) fn bend(&self, p: &Point3<f64>, d: &Vector3<f64>) -> f64 {
        match self {
            Surface::Plane { .. } => 0.0,
            Surface::Cylinder { axis, radius, .. } => (1.0 - d.dot(axis).powi(2)) / radius,
            Surface::Cone { apex, axis, half_angle } => {
                let out = radial(apex, axis, p);
                let round = axis.cross(&out) / out.norm_squared().max(f64::MIN_POSITIVE).sqrt();
                half_angle.cos() / out.norm().max(f64::MIN_POSITIVE) * d.dot(&round).powi(2)
            }
            Surface::Sphere { radius, .. } => 1.0 / radius,
            Surface::Torus { centre, axis, minor, .. } => {
                let out = radial(centre, axis, p);
                let rho = out.norm().max(f64::MIN_POSITIVE);
                let round = axis.cross(&out) / rho;
                let (along, around) = (d.dot(&round).powi(2), 1.0 - d.dot(&round).powi(2));
                self.normal_at(p).dot(&out) / (rho * rho) * along + around / minor
            }
        }
    }

    /// Width of the chart of a closed surface, where u starts again; `None` for a plane.
    pub fn period(&self) -> Option<f64> {
        match self {
            Surface::Plane { .. } => None,
            Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => Some(TAU * radius),
            Surface::Cone { .. } => Some(TAU),
            Surface::Torus { minor, .. } => Some(TAU * minor),
        }
    }

    /// Height of the chart of a torus, where v starts again; `None` for the others, and for a torus that reaches its axis.
    pub fn period_across(&self) -> Option<f64> {
        match self {
            Surface::Torus { major, minor, .. } if is_ring(*major, *minor) => Some(TAU * major),
            _ => None,
        }
    }

    /// The v of the chart at which a whole row is one point: an apex, the poles of a sphere or of a torus that reaches its
    /// axis; below and above the rest.
    pub(super) fn poles(&self) -> [Option<f64>; 2] {
        match self {
            Surface::Plane { .. } | Surface::Cylinder { .. } => [None, None],
            Surface::Cone { .. } => [Some(0.0), None],
            Surface::Sphere { radius, .. } => [Some(0.0), Some(2.0 * radius)],
            Surface::Torus { major, minor, .. } if is_ring(*major, *minor) => [None, None],
            Surface::Torus { major, minor, .. } => {
                let angle = pole_angle(*major, *minor);
                let v = major * angle + minor * angle.sin();
                [Some(-v), Some(v)]
            }
        }
    }

    /// Chart coordinates of `p`, in the frame of [`Surface::frame`]:
    /// plane (x, y); cylinder (rθ, z); cone (θ, s² sin α / 2) with s the distance from the apex; sphere
    /// (Rθ, R + z), z the height above the centre; torus (rθ, Rφ + r sin φ), φ the angle round the tube from the side away
    /// from the axis. θ and φ in -π..=π. Equal-area in each case.
    pub fn chart(&self, p: &Point3<f64>) -> [f64; 2] {
        let q = p - self.origin();
        let axis = self.axis();
        let (x, y) = across(&axis);
        let (a, b, c) = (q.dot(&x), q.dot(&y), q.dot(&axis));
        match self {
            Surface::Plane { .. } => [a, b],
            Surface::Cylinder { radius, .. } => [radius * b.atan2(a), c],
            Surface::Cone { half_angle, .. } => [b.atan2(a), q.norm_squared() * half_angle.sin() / 2.0],
            Surface::Sphere { radius, .. } => [radius * b.atan2(a), radius + c],
            Surface::Torus { major, minor, .. } => {
                let tube = c.atan2(a.hypot(b) - major);
                [minor * b.atan2(a), major * tube + minor * tube.sin()]
            }
        }
    }

    /// The point at chart coordinates `uv`: the inverse of [`Surface::chart`].
    pub fn at(&self, uv: [f64; 2]) -> Point3<f64> {
        let axis = self.axis();
        let (x, y) = across(&axis);
        let ring = |theta: f64, rho: f64, z: f64| {
            let (sin, cos) = theta.sin_cos();
            self.origin() + x * (rho * cos) + y * (rho * sin) + axis.into_inner() * z
        };
        match self {
            Surface::Plane { .. } => self.origin() + x * uv[0] + y * uv[1],
            Surface::Cylinder { radius, .. } => ring(uv[0] / radius, *radius, uv[1]),
            Surface::Cone { half_angle, .. } => {
                let (sin, cos) = half_angle.sin_cos();
                let s = (2.0 * uv[1].max(0.0) / sin).sqrt();
                ring(uv[0], s * sin, s * cos)
            }
            Surface::Sphere { radius, .. } => {
                let z = (uv[1] - radius).clamp(-*radius, *radius);
                ring(uv[0] / radius, (radius * radius - z * z).max(0.0).sqrt(), z)
            }
            Surface::Torus { major, minor, .. } => {
                let (sin, cos) = tube_angle(*major, *minor, uv[1]).sin_cos();
                ring(uv[0] / minor, major + minor * cos, minor * sin)
            }
        }
    }

    /// The canonical normal at chart coordinates, defined at an apex or a pole too.
    pub(super) fn chart_normal(&self, uv: [f64; 2]) -> Vector3<f64> {
        let axis = self.axis().into_inner();
        let (x, y) = across(&self.axis());
        let out = |theta: f64| x * theta.cos() + y * theta.sin();
        match self {
            Surface::Plane { .. } => axis,
            Surface::Cylinder { radius, .. } => out(uv[0] / radius),
            Surface::Cone { half_angle, .. } => out(uv[0]) * half_angle.cos() - axis * half_angle.sin(),
            Surface::Sphere { radius, .. } => {
                let sin = ((uv[1] - radius) / radius).clamp(-1.0, 1.0);
                out(uv[0] / radius) * (1.0 - sin * sin).sqrt() + axis * sin
            }
            Surface::Torus { major, minor, .. } => {
                let (sin, cos) = tube_angle(*major, *minor, uv[1]).sin_cos();
                out(uv[0] / minor) * cos + axis * sin
            }
        }
    }
}

/// The angle φ round the tube of a torus with `major φ + minor sin φ = v`: the left side never falls where the surface
/// is, so bisection finds it, and Newton's steps make it exact.
pub(super) fn tube_angle(major: f64, minor: f64, v: f64) -> f64 {
    let turns = if is_ring(major, minor) { (v / (TAU * major)).round() } else { 0.0 };
    let v = v - turns * TAU * major;
    let reach = pole_angle(major, minor);
    let (mut low, mut high) = (-reach, reach);
    let mut angle = (v / (major + minor)).clamp(low, high);
    for _ in 0..TUBE_STEPS {
        let excess = major * angle + minor * angle.sin() - v;
        if excess > 0.0 {
            high = angle
        } else {
            low = angle
        }
        let newton = angle - excess / (major + minor * angle.cos());
        let next = if newton > low && newton < high { newton } else { (low + high) / 2.0 };
        if next == angle {
            break;
        }
        angle = next;
    }
    angle + turns * TAU
}

/// Whether a torus keeps off its axis.
pub(super) fn is_ring(major: f64, minor: f64) -> bool {
    major > minor + tolerance::WELD
}

/// The angle φ at which a torus ends: where it meets its axis, or half way round.
pub(super) fn pole_angle(major: f64, minor: f64) -> f64 {
    (-major / minor).clamp(-1.0, 1.0).acos()
}

/// Steps after which bisection alone has used up the precision of a double.
const TUBE_STEPS: usize = 60;

/// The part of `p - foot` across `axis`.
pub(super) fn radial(foot: &Point3<f64>, axis: &Unit<Vector3<f64>>, p: &Point3<f64>) -> Vector3<f64> {
    let q = p - foot;
    q - axis.into_inner() * q.dot(axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn examples() -> Vec<Surface> {
        let axis = Unit::new_normalize(Vector3::new(0.3, -0.5, 0.7));
        let p = Point3::new(1.0, 2.0, -3.0);
        vec![
            Surface::Plane { normal: axis, offset: 1.5 },
            Surface::Cylinder { point: p, axis, radius: 2.5 },
            Surface::Cone { apex: p, axis, half_angle: 0.4 },
            Surface::Sphere { centre: p, radius: 4.0, axis },
            Surface::Torus { centre: p, axis, major: 5.0, minor: 2.0 },
            Surface::Torus { centre: p, axis, major: 1.5, minor: 2.0 },
            Surface::Torus { centre: p, axis, major: -3.0, minor: 7.0 },
        ]
    }

    #[test]
    fn chart_and_point_are_inverse_and_lie_on_the_surface() {
        for s in examples() {
            let p = s.at([1.1, 2.2]);
            assert!(s.distance(&p).abs() < 1e-12, "{s:?}");
            let uv = s.chart(&p);
            assert!((uv[0] - 1.1).abs() < 1e-12 && (uv[1] - 2.2).abs() < 1e-12, "{s:?} {uv:?}");
            assert!((s.chart_normal(uv) - s.normal_at(&p)).norm() < 1e-12);
        }
    }

    #[test]
    fn charts_keep_area_and_are_right_handed() {
        for s in examples() {
            let (uv, h) = ([1.1, 2.2], 1e-5);
            let du = (s.at([uv[0] + h, uv[1]]) - s.at([uv[0] - h, uv[1]])) / (2.0 * h);
            let dv = (s.at([uv[0], uv[1] + h]) - s.at([uv[0], uv[1] - h])) / (2.0 * h);
            let area = du.cross(&dv).dot(&s.chart_normal(uv));
            assert!((area - 1.0).abs() < 1e-7, "{s:?} {area}");
        }
    }

    #[test]
    fn bend_is_the_second_difference_of_the_distance() {
        for s in examples() {
            let p = s.at([1.1, 2.2]);
            let n = s.normal_at(&p);
            let d = n.cross(&Vector3::new(0.2, 0.9, 0.1)).normalize();
            let h = 1e-3;
            let second = (s.distance(&(p + d * h)) + s.distance(&(p - d * h)) - 2.0 * s.distance(&p)) / (h * h);
            assert!((s.bend(&p, &d) - second).abs() < 1e-5, "{s:?}");
        }
    }
}
