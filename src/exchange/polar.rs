//! Round surfaces as mapmakers see them: a longitude u and a height v, with the curves along which a seam may run.
//!
//! In: a [`Surface`]. Out: angles and heights, and curves of constant longitude or height. Cylinder: v = z; cone: v =
//! distance from the apex; sphere: v = latitude; torus: v = angle round the tube, from the side away from the axis. Never
//! knows a face.

use super::track::Track;
use crate::solid::Surface;
use nalgebra::{Isometry3, Point3, Unit, UnitVector3, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A point nearer to the axis than this (mm) has no longitude: the kernel's corners are one from here on.
const NO_LONGITUDE: f64 = 1e-6;

/// A curve that strays less than this (mm) from a meridian or a parallel is one.
const STRAIGHT: f64 = 1e-7;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Cylinder,
    Cone,
    Sphere { radius: f64 },
    Torus { major: f64, minor: f64 },
}

/// The map of one round surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Polar {
    kind: Kind,
    /// z along the axis, u counted from x towards y.
    frame: Isometry3<f64>,
}

/// A frame at `origin` with z along `axis` and the x of every surface about such an axis, whichever way it points: so
/// seams of coaxial faces meet.
pub(super) fn frame_about(origin: Point3<f64>, axis: UnitVector3<f64>) -> Isometry3<f64> {
    let turn = Surface::Plane { normal: axis, offset: 0.0 }.frame().rotation;
    Isometry3::from_parts(origin.into(), turn)
}

impl Polar {
    /// `None` for a plane. A sphere has its poles along `axis` where one is given.
    pub fn new(surface: &Surface, axis: Option<UnitVector3<f64>>) -> Option<Polar> {
        let kind = match surface {
            Surface::Plane { .. } => return None,
            Surface::Cylinder { .. } => Kind::Cylinder,
            Surface::Cone { .. } => Kind::Cone,
            Surface::Sphere { radius, .. } => Kind::Sphere { radius: *radius },
            Surface::Torus { major, minor, .. } => Kind::Torus { major: *major, minor: *minor },
        };
        let axis = axis.unwrap_or_else(|| surface.axis());
        Some(Polar { kind, frame: frame_about(surface.origin(), axis) })
    }

    pub fn frame(&self) -> &Isometry3<f64> {
        &self.frame
    }

    /// Longitude (rad, -π..=π) and height (mm or rad) of a point.
    pub fn uv(&self, p: &Point3<f64>) -> [f64; 2] {
        let q = self.frame.inverse_transform_point(p);
        let rho = q.x.hypot(q.y);
        let v = match self.kind {
            Kind::Cylinder => q.z,
            Kind::Cone => q.coords.norm(),
            Kind::Sphere { .. } => q.z.atan2(rho),
            Kind::Torus { major, .. } => q.z.atan2(rho - major),
        };
        [q.y.atan2(q.x), v]
    }

    /// False at an apex or a pole.
    pub fn has_longitude(&self, p: &Point3<f64>) -> bool {
        self.distance_from_axis(p) > NO_LONGITUDE
    }

    pub fn distance_from_axis(&self, p: &Point3<f64>) -> f64 {
        let q = self.frame.inverse_transform_point(p);
        q.x.hypot(q.y)
    }

    /// Radius of a sphere (mm), zero elsewhere.
    pub fn radius(&self) -> f64 {
        if let Kind::Sphere { radius } = self.kind { radius } else { 0.0 }
    }

    /// Radius of a torus' tube (mm), zero elsewhere.
    pub fn tube(&self) -> f64 {
        if let Kind::Torus { minor, .. } = self.kind { minor } else { 0.0 }
    }

    /// Whether a curve on the surface is a meridian or a parallel, hence straight on the map.
    pub fn is_straight(&self, track: &Track) -> bool {
        let points = track.steps().into_iter().map(|t| track.at(t)).filter(|p| self.has_longitude(p));
        let points: Vec<Point3<f64>> = points.collect();
        let Some(start) = points.first().map(|p| self.uv(p)) else { return true };
        let lengths = matches!(self.kind, Kind::Cylinder | Kind::Cone);
        let reach = points.iter().map(|p| self.distance_from_axis(p)).fold(self.tube().max(self.radius()), f64::max);
        let off = |k: usize| {
            let away = |p: &Point3<f64>| match self.uv(p)[k] - start[k] {
                length if k == 1 && lengths => length.abs(),
                angle => 2.0 * (angle / 2.0).sin().abs() * reach,
            };
            points.iter().map(away).fold(0.0, f64::max)
        };
        off(0) < STRAIGHT || off(1) < STRAIGHT
    }

    /// A torus whose tube misses the axis: its heights start again after a turn.
    pub fn is_ring(&self) -> bool {
        matches!(self.kind, Kind::Torus { major, minor } if major > minor)
    }

    /// Pole or apex at the lower (0) or upper (1) end of the meridians.
    pub fn pole(&self, end: usize) -> Option<Point3<f64>> {
        let sign = if end == 0 { -1.0 } else { 1.0 };
        let z = match self.kind {
            Kind::Cone if end == 0 => 0.0,
            Kind::Sphere { radius } => sign * radius,
            Kind::Torus { major, minor } if major <= minor => sign * (minor * minor - major * major).max(0.0).sqrt(),
            _ => return None,
        };
        Some(self.frame * Point3::new(0.0, 0.0, z))
    }

    /// The meridian at `u` from one point of it up to another.
    pub fn meridian(&self, u: f64, from: Point3<f64>, to: Point3<f64>) -> Track {
        let out = self.out(u);
        let (centre, radius) = match self.kind {
            Kind::Cylinder | Kind::Cone => return Track::Line { from, to },
            Kind::Sphere { radius } => (self.origin(), radius),
            Kind::Torus { major, minor } => (self.origin() + out * major, minor),
        };
        let up = self.frame.rotation * Vector3::z();
        let angle = |p: &Point3<f64>| (p - centre).dot(&up).atan2((p - centre).dot(&out));
        arc(centre, out * radius, up * radius, angle(&from), angle(&to))
    }

    /// The circle at height `v` of a torus, once round from longitude `u`.
    pub fn parallel(&self, u: f64, v: f64) -> Option<Track> {
        let Kind::Torus { major, minor } = self.kind else { return None };
        let centre = self.origin() + self.frame.rotation * Vector3::z() * (minor * v.sin());
        let rho = major + minor * v.cos();
        Some(arc(centre, self.out(u) * rho, self.out(u + FRAC_PI_2) * rho, 0.0, 0.0))
    }

    /// The point at longitude `u` and height `v` of a torus.
    pub fn on_torus(&self, u: f64, v: f64) -> Option<Point3<f64>> {
        let Kind::Torus { major, minor } = self.kind else { return None };
        let up = self.frame.rotation * Vector3::z();
        Some(self.origin() + self.out(u) * (major + minor * v.cos()) + up * (minor * v.sin()))
    }

    fn origin(&self) -> Point3<f64> {
        Point3::from(self.frame.translation.vector)
    }

    fn out(&self, u: f64) -> Vector3<f64> {
        self.frame.rotation * Vector3::new(u.cos(), u.sin(), 0.0)
    }
}

fn arc(centre: Point3<f64>, x: Vector3<f64>, y: Vector3<f64>, from: f64, to: f64) -> Track {
    let turn = (to - from).rem_euclid(TAU);
    Track::Arc { centre, x, y, from, sweep: if turn > 0.0 { turn } else { TAU } }
}

/// Directions spread over half a sphere (a Fibonacci spiral), for the poles of a sphere whose own are in the way.
pub(super) fn directions(count: usize) -> impl Iterator<Item = UnitVector3<f64>> {
    // The golden angle: no two turns of the spiral line up.
    let turn = TAU * (1.0 - 2.0 / (1.0 + 5f64.sqrt()));
    (0..count).map(move |i| {
        let z = 1.0 - (i as f64 + 0.5) / count as f64;
        let (sin, cos) = (turn * i as f64).sin_cos();
        let rho = (1.0 - z * z).sqrt();
        Unit::new_normalize(Vector3::new(rho * cos, rho * sin, z))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meridians_and_parallels_lie_on_their_surfaces() {
        let axis = Unit::new_normalize(Vector3::new(0.2, -0.4, 0.9));
        let c = Point3::new(1.0, 2.0, 3.0);
        for s in [
            Surface::Sphere { centre: c, radius: 4.0, axis },
            Surface::Torus { centre: c, axis, major: 5.0, minor: 2.0 },
            Surface::Torus { centre: c, axis, major: -1.0, minor: 2.0 },
        ] {
            let polar = Polar::new(&s, Some(axis)).unwrap();
            let (a, b) = (polar.pole(0), polar.pole(1));
            let ends = a.zip(b).or_else(|| polar.on_torus(0.7, -1.0).zip(polar.on_torus(0.7, 1.2))).unwrap();
            let track = polar.meridian(0.7, ends.0, ends.1);
            for t in [0.0, 0.3, 0.6, 1.0] {
                assert!(s.distance(&track.at(t)).abs() < 1e-12, "{s:?}");
            }
            assert!((track.at(0.0) - ends.0).norm() < 1e-12 && (track.at(1.0) - ends.1).norm() < 1e-12, "{s:?}");
            let middle = polar.uv(&track.at(0.5));
            assert!((middle[0] - 0.7).abs() < 1e-12 && middle[1].abs() < 1.0, "{middle:?}");
        }
    }
}
