//! Which surfaces can touch over an area, and how two that match lie to each other.
//!
//! In: two faces' surfaces and senses. Out: the kind of contact, and for any draw the gap between the surfaces and by how
//! much their axes or centres miss each other. Decided on the parameters of the surfaces alone.

use super::body::PlacedFace;
use super::contact::ContactKind;
use crate::solid::Surface;
use nalgebra::{Point3, Unit, Vector3};

/// Normals and axes are parallel when the sine of their angle is below this.
pub(crate) const PARALLEL: f64 = 1e-5;
/// The loosest pair of round faces still called a fit: near ISO 286 H11/c11 (mm, and mm per mm of diameter).
const LOOSEST: [f64; 2] = [0.05, 0.02];

/// Two surfaces of one kind with opposed senses, and how they lie to each other.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub kind: ContactKind,
    pub direction: Unit<Vector3<f64>>,
    pub point: Point3<f64>,
    /// Distance of planes; difference of diameters; 0 for cones.
    pub gap: f64,
    /// By how much their axes, apexes or centres miss each other (mm).
    pub offset: Vector3<f64>,
}

impl Candidate {
    /// By how much the surfaces miss each other, beyond what their clearance allows (mm).
    pub fn miss(&self) -> f64 {
        match self.kind {
            ContactKind::Plane => self.gap.abs(),
            _ => self.offset.norm() - self.gap.abs() / 2.0,
        }
    }
}

/// How two faces match; `None` where they cannot touch over an area.
pub(crate) fn candidate(f: &PlacedFace, g: &PlacedFace) -> Option<Candidate> {
    let round = |kind, direction, point| Candidate { kind, direction, point, gap: 0.0, offset: Vector3::zeros() };
    match (&f.surface, &g.surface) {
        (Surface::Plane { normal: n, offset: p }, Surface::Plane { normal: m, offset: q }) => {
            planes(if f.outward { (*n, *p) } else { (-*n, -p) }, if g.outward { (*m, *q) } else { (-*m, -q) })
        }
        (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: q, axis: m, radius: s }) => {
            let gap = clearance(f, g, *radius, *s)?;
            let offset = q - point - axis.into_inner() * (q - point).dot(axis);
            parallel(axis, m).then(|| Candidate { gap, offset, ..round(ContactKind::Cylinder, *axis, *point) })
        }
        (Surface::Cone { apex, axis, half_angle }, Surface::Cone { apex: q, axis: m, half_angle: t }) => {
            let same = parallel(axis, m) && axis.dot(m) > 0.0 && (half_angle - t).abs() < PARALLEL;
            let opposed = f.outward != g.outward;
            (same && opposed).then(|| Candidate { offset: q - apex, ..round(ContactKind::Cone, *axis, *apex) })
        }
        (Surface::Sphere { centre, radius, .. }, Surface::Sphere { centre: q, radius: s, .. }) => {
            let gap = clearance(f, g, *radius, *s)?;
            Some(Candidate { gap, offset: q - centre, ..round(ContactKind::Sphere, Vector3::z_axis(), *centre) })
        }
        (
            Surface::Torus { centre, axis, major, minor },
            Surface::Torus { centre: q, axis: m, major: other, minor: s },
        ) => {
            let gap = clearance(f, g, *minor, *s)?;
            let same = parallel(axis, m) && (major - other).abs() <= gap.abs() / 2.0 + ALIKE;
            same.then(|| Candidate { gap, offset: q - centre, ..round(ContactKind::Torus, *axis, *centre) })
        }
        _ => None,
    }
}

/// Tubes whose circles differ by less than this (mm) in radius, clearance deducted, are on one circle.
const ALIKE: f64 = 1e-3;

/// Planes given by their outward normals and offsets.
fn planes((n, p): (Unit<Vector3<f64>>, f64), (m, q): (Unit<Vector3<f64>>, f64)) -> Option<Candidate> {
    let opposed = parallel(&n, &m) && n.dot(&m) < 0.0;
    let (point, offset) = (Point3::from(n.scale(p)), Vector3::zeros());
    opposed.then_some(Candidate { kind: ContactKind::Plane, direction: n, point, gap: -q - p, offset })
}

pub(crate) fn parallel(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    a.cross(b).norm() < PARALLEL
}

/// Diameter of the hollow face less that of the full one, when there is one of each and they are of a size to fit.
fn clearance(f: &PlacedFace, g: &PlacedFace, r: f64, s: f64) -> Option<f64> {
    let gap = match (f.outward, g.outward) {
        (true, false) => 2.0 * (s - r),
        (false, true) => 2.0 * (r - s),
        _ => return None,
    };
    (gap.abs() <= LOOSEST[0] + LOOSEST[1] * 2.0 * r.min(s)).then_some(gap)
}

/// How two surfaces of a contact lie to each other at one place and one draw.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lie {
    /// Between the surfaces if their axes met, square to them (mm).
    pub gap: f64,
    /// By how much the axes or centres miss each other, as it counts square to the surfaces (mm).
    pub offset: Vector3<f64>,
    /// The direction of the offset in which the surfaces come nearer; `None` where they surround each other, so that any does.
    pub way: Option<Vector3<f64>>,
}

impl Lie {
    /// The distance of the surfaces where they come nearest (mm); negative where they enter each other.
    pub fn margin(&self) -> f64 {
        self.gap - self.way.map_or_else(|| self.offset.norm(), |way| way.dot(&self.offset))
    }

    /// What of another is to be added to this one.
    pub fn plus(&self, other: &Lie) -> Lie {
        Lie { gap: self.gap + other.gap, offset: self.offset + other.offset, way: self.way }
    }

    /// What this one has more than another.
    pub fn minus(&self, other: &Lie) -> Lie {
        Lie { gap: self.gap - other.gap, offset: self.offset - other.offset, way: self.way }
    }
}

/// Where and in what sense two surfaces of a contact are compared.
#[derive(Debug, Clone)]
pub(crate) struct Gauge {
    pub kind: ContactKind,
    pub direction: Unit<Vector3<f64>>,
    /// Planes: points round the common region. Others: the ends of the common stretch of the axis, or the centre.
    pub probes: Vec<Point3<f64>>,
    /// +1 when the first face is the full one (or out of whose plane `direction` points), -1 when the second is.
    pub sign: f64,
    /// Of cylinders that surround each other in part only: the directions of the offset in which they come nearer.
    pub ways: Vec<Vector3<f64>>,
}

impl Gauge {
    /// Lies at all probes, in all ways; nothing where the surfaces are no longer of the contact's kind.
    pub fn lies(&self, s: &Surface, t: &Surface) -> Vec<Lie> {
        let lies = self.probes.iter().filter_map(|p| self.lie(p, s, t));
        if self.ways.is_empty() {
            return lies.collect();
        }
        lies.flat_map(|lie| self.ways.iter().map(move |&way| Lie { way: Some(way), ..lie })).collect()
    }

    fn lie(&self, p: &Point3<f64>, s: &Surface, t: &Surface) -> Option<Lie> {
        let d = self.direction.into_inner();
        match (s, t) {
            (Surface::Plane { normal: n, offset: f }, Surface::Plane { normal: m, offset: g }) => {
                let along = |n: &Vector3<f64>, offset: f64| (offset - n.dot(&p.coords)) / n.dot(&d);
                Some(Lie { gap: along(m, *g) - along(n, *f), offset: Vector3::zeros(), way: None })
            }
            (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: q, axis: m, radius: r }) => {
                let offset = pierce(q, m, p, &d) - pierce(point, axis, p, &d);
                Some(Lie { gap: self.sign * (r - radius), offset, way: None })
            }
            (Surface::Cone { apex, axis, half_angle }, Surface::Cone { apex: q, axis: m, half_angle: t }) => {
                let wide = |apex: &Point3<f64>, axis: &Vector3<f64>, angle: f64| (p - apex).dot(axis) * angle.tan();
                let gap = self.sign * (wide(q, m, *t) - wide(apex, axis, *half_angle)) * half_angle.cos();
                let offset = (pierce(q, m, p, &d) - pierce(apex, axis, p, &d)) * half_angle.cos();
                Some(Lie { gap, offset, way: None })
            }
            (Surface::Sphere { centre, radius, .. }, Surface::Sphere { centre: q, radius: r, .. }) => {
                Some(Lie { gap: self.sign * (r - radius), offset: q - centre, way: None })
            }
            (Surface::Torus { centre, major, minor, .. }, Surface::Torus { centre: q, major: wide, minor: r, .. }) => {
                Some(Lie { gap: self.sign * (r - minor) - (wide - major).abs(), offset: q - centre, way: None })
            }
            _ => None,
        }
    }

    /// The gap as a drawing gives it: between planes and cones square to them, otherwise as a difference of diameters.
    pub fn drawn(&self, lies: &[Lie]) -> Option<f64> {
        let least = lies.iter().map(|l| l.gap).reduce(f64::min)?;
        Some(match self.kind {
            ContactKind::Cylinder | ContactKind::Sphere | ContactKind::Torus => 2.0 * least,
            _ => least,
        })
    }
}

/// Where an axis passes through the plane square to `d` at `p`.
fn pierce(point: &Point3<f64>, axis: &Vector3<f64>, p: &Point3<f64>, d: &Vector3<f64>) -> Point3<f64> {
    point + axis * ((p - point).dot(d) / axis.dot(d))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gauge(kind: ContactKind, probes: Vec<Point3<f64>>) -> Gauge {
        Gauge { kind, direction: Vector3::z_axis(), probes, sign: 1.0, ways: Vec::new() }
    }

    fn cone(z: f64, x: f64, half_angle: f64) -> Surface {
        Surface::Cone { apex: Point3::new(x, 0.0, z), axis: Vector3::z_axis(), half_angle }
    }

    /// Drawn apart along the axis by h, the flanks are h sin α apart.
    #[test]
    fn cones_part_by_the_sine_of_their_half_angle() {
        let (angle, h) = (0.4f64, 0.3);
        let gauge = gauge(ContactKind::Cone, vec![Point3::new(0.0, 0.0, 5.0), Point3::new(0.0, 0.0, 9.0)]);
        let lies = gauge.lies(&cone(0.0, 0.0, angle), &cone(-h, 0.0, angle));
        assert!(lies.iter().all(|l| (l.margin() - h * angle.sin()).abs() < 1e-12), "{lies:?}");
        assert!((gauge.drawn(&lies).unwrap() - h * angle.sin()).abs() < 1e-12);
    }

    #[test]
    fn a_wider_cone_gapes_with_its_distance_from_the_apex() {
        let (a, b) = (0.4f64, 0.41f64);
        let gauge = gauge(ContactKind::Cone, vec![Point3::new(0.0, 0.0, 5.0), Point3::new(0.0, 0.0, 9.0)]);
        let lies = gauge.lies(&cone(0.0, 0.0, a), &cone(0.0, 0.0, b));
        for (lie, h) in lies.iter().zip([5.0, 9.0]) {
            assert!((lie.gap - h * (b.tan() - a.tan()) * a.cos()).abs() < 1e-12);
        }
        // Beside each other the flanks meet where the offset points, by its share square to them.
        let beside = gauge.lies(&cone(0.0, 0.0, a), &cone(0.0, 0.02, a));
        assert!((beside[0].margin() + 0.02 * a.cos()).abs() < 1e-12);
    }

    #[test]
    fn tubes_part_by_their_radii_less_what_their_circles_miss_by() {
        let torus = |x: f64, major: f64, minor: f64| Surface::Torus {
            centre: Point3::new(x, 0.0, 0.0),
            axis: Vector3::z_axis(),
            major,
            minor,
        };
        let gauge = gauge(ContactKind::Torus, vec![Point3::origin()]);
        let lies = gauge.lies(&torus(0.0, 10.0, 2.0), &torus(0.03, 10.05, 2.2));
        assert!((lies[0].gap - 0.15).abs() < 1e-12 && (lies[0].margin() - 0.12).abs() < 1e-12, "{lies:?}");
    }

    /// Half a pin in half a hole: where the hole's wall is missing nothing meets.
    #[test]
    fn parts_of_cylinders_meet_in_their_own_directions_only() {
        let cylinder = |x: f64, radius: f64| Surface::Cylinder {
            point: Point3::new(x, 0.0, 0.0),
            axis: Vector3::z_axis(),
            radius,
        };
        let ways = vec![Vector3::x(), (Vector3::x() + Vector3::y()).normalize()];
        let gauge = Gauge { ways, ..gauge(ContactKind::Cylinder, vec![Point3::origin()]) };
        let nearest = |x: f64| {
            let lies = gauge.lies(&cylinder(0.0, 3.0), &cylinder(x, 3.02));
            lies.iter().map(Lie::margin).fold(f64::INFINITY, f64::min)
        };
        assert!((nearest(0.5) - (0.02 - 0.5)).abs() < 1e-12 && nearest(-0.5) > 0.37);
    }

    #[test]
    fn cylinders_that_lean_meet_at_the_ends() {
        let cylinder = |lean: f64, radius: f64| Surface::Cylinder {
            point: Point3::origin(),
            axis: Unit::new_normalize(Vector3::new(lean, 0.0, 1.0)),
            radius,
        };
        let gauge = gauge(ContactKind::Cylinder, vec![Point3::origin(), Point3::new(0.0, 0.0, 10.0)]);
        let lies = gauge.lies(&cylinder(0.0, 3.0), &cylinder(0.001, 3.02));
        assert!((lies[0].margin() - 0.02).abs() < 1e-12 && (lies[1].margin() - 0.01).abs() < 1e-12, "{lies:?}");
    }
}
