//! The curves that two surfaces share.
//!
//! In: two distinct surfaces. Out: lines and circles; a line along which they merely touch counts. Positions whose
//! curve is neither (an oblique plane through a cylinder, crossing cylinders) are refused, never approximated.

use super::Surface;
use super::csg::{Bounds, Leaf, Tree};
use super::locus::Locus;
use super::surface::radial;
use super::tolerance;
use nalgebra::{Point3, Unit, Vector3};

/// The two surfaces may meet in a curve that is neither a line nor a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Oblique;

type Shared = Result<Vec<Locus>, Oblique>;
type Direction = Unit<Vector3<f64>>;

/// Curves common to `a` and `b`, in a fixed order.
pub(super) fn intersect(a: &Surface, b: &Surface) -> Shared {
    use Surface::{Cone, Cylinder, Plane, Sphere, Torus};
    match (a, b) {
        (Plane { normal: n, offset: d }, Plane { normal: m, offset: e }) => Ok(planes((n, *d), (m, *e))),
        (Plane { normal, .. }, Cylinder { point, axis, radius }) => {
            plane_cylinder(normal, a.distance(point), point, axis, *radius)
        }
        (Plane { normal, .. }, Cone { apex, axis, half_angle }) => {
            plane_cone(normal, a.distance(apex), apex, axis, *half_angle)
        }
        (Plane { normal, .. }, Sphere { centre, radius, .. }) => {
            Ok(plane_sphere(normal, a.distance(centre), centre, *radius))
        }
        (Cylinder { point: p, axis: d, radius: r }, Cylinder { point: q, axis: e, radius: s }) => {
            cylinders((p, d, *r), (q, e, *s))
        }
        (Torus { .. }, _) | (_, Torus { .. }) => Err(Oblique),
        (Sphere { centre: p, radius: r, .. }, Sphere { centre: q, radius: s, .. }) => Ok(spheres(p, *r, q, *s)),
        (Cylinder { .. } | Cone { .. }, Cone { .. }) | (Cylinder { .. } | Cone { .. }, Sphere { .. }) => coaxial(a, b),
        _ => intersect(b, a),
    }
}

/// Least edge of the boxes in which surfaces are looked for, in mm: what comes nearer counts as meeting.
const NEAR: f64 = 0.02;

/// Whether the sides of two leaves on surfaces `a` and `b` come near each other inside `region`: boxes are halved until
/// they are too far from either surface, or outside either leaf, for any point of theirs to be on both.
pub(super) fn meet(tree: &Tree, (a, b): (usize, usize), leaves: [&Leaf; 2], region: &Bounds) -> bool {
    let mut open = vec![*region];
    while let Some(cell) = open.pop() {
        let (middle, extent) = (nalgebra::center(&cell.low, &cell.high), cell.high - cell.low);
        let reach = extent.norm() / 2.0;
        let far = |s: usize| tree.surfaces[s].distance(&middle).abs() > reach;
        let off =
            |leaf: &&Leaf| leaf.sides.iter().any(|s| tree.surfaces[s.surface].distance(&middle) * s.sense > reach);
        if far(a) || far(b) || leaves.iter().any(off) {
            continue;
        }
        let longest = extent.imax();
        if extent[longest] < NEAR {
            return true;
        }
        let (mut low, mut high) = (cell, cell);
        low.high[longest] = middle[longest];
        high.low[longest] = middle[longest];
        open.extend([low, high]);
    }
    false
}

fn parallel(a: &Direction, b: &Direction) -> bool {
    a.cross(b).norm() < tolerance::DIRECTION
}

fn square(a: &Direction, b: &Direction) -> bool {
    a.dot(b).abs() < tolerance::DIRECTION
}

fn planes((n, d): (&Direction, f64), (m, e): (&Direction, f64)) -> Vec<Locus> {
    if parallel(n, m) {
        return Vec::new();
    }
    let along = Unit::new_normalize(n.cross(m));
    let c = n.dot(m);
    let s = 1.0 - c * c;
    let foot = n.into_inner() * ((d - c * e) / s) + m.into_inner() * ((e - c * d) / s);
    vec![Locus::Line { point: Point3::from(foot), along }]
}

/// `distance`: of the cylinder's point from the plane.
fn plane_cylinder(normal: &Direction, distance: f64, point: &Point3<f64>, axis: &Direction, radius: f64) -> Shared {
    if parallel(normal, axis) {
        let centre = point - axis.into_inner() * (distance / normal.dot(axis));
        return Ok(vec![Locus::circle(centre, *axis, radius)]);
    }
    if !square(normal, axis) {
        return Err(Oblique);
    }
    let foot = point - normal.into_inner() * distance;
    Ok(rulings(&foot, &axis.cross(normal), distance, radius, axis))
}

/// Lines along `axis` where a flat at `distance` from the axis of a cylinder cuts it, beside `foot` along `aside`.
fn rulings(foot: &Point3<f64>, aside: &Vector3<f64>, distance: f64, radius: f64, axis: &Direction) -> Vec<Locus> {
    let line = |offset: f64| Locus::Line { point: foot + aside * offset, along: *axis };
    let gap = distance.abs() - radius;
    if gap.abs() < tolerance::TOUCH {
        return vec![line(0.0)];
    }
    if gap > 0.0 {
        return Vec::new();
    }
    let half = (radius * radius - distance * distance).sqrt();
    vec![line(-half), line(half)]
}

/// `distance`: of the apex from the plane.
fn plane_cone(normal: &Direction, distance: f64, apex: &Point3<f64>, axis: &Direction, half_angle: f64) -> Shared {
    let rise = -distance / normal.dot(axis);
    if parallel(normal, axis) {
        let circle = |rise: f64| Locus::circle(apex + axis.into_inner() * rise, *axis, rise * half_angle.tan());
        return Ok(if rise > tolerance::POINT { vec![circle(rise)] } else { Vec::new() });
    }
    if !square(normal, axis) || distance.abs() > tolerance::POINT {
        return Err(Oblique);
    }
    let aside = axis.cross(normal);
    let (sin, cos) = half_angle.sin_cos();
    let flank = |side: f64| Unit::new_normalize(axis.into_inner() * cos + aside * (side * sin));
    Ok([-1.0, 1.0].map(|side| Locus::Line { point: *apex, along: flank(side) }).to_vec())
}

/// `distance`: of the centre from the plane. A plane that touches shares only a point, which bounds nothing.
fn plane_sphere(normal: &Direction, distance: f64, centre: &Point3<f64>, radius: f64) -> Vec<Locus> {
    if distance.abs() > radius - tolerance::TOUCH {
        return Vec::new();
    }
    let rho = (radius * radius - distance * distance).sqrt();
    vec![Locus::circle(centre - normal.into_inner() * distance, *normal, rho)]
}

fn cylinders((p, d, r): (&Point3<f64>, &Direction, f64), (q, e, s): (&Point3<f64>, &Direction, f64)) -> Shared {
    if !parallel(d, e) {
        return Err(Oblique);
    }
    let between = radial(p, d, q);
    let gap = between.norm();
    if gap < tolerance::POINT || gap > r + s + tolerance::TOUCH || gap < (r - s).abs() - tolerance::TOUCH {
        return Ok(Vec::new());
    }
    let towards = between / gap;
    let distance = (gap * gap + r * r - s * s) / (2.0 * gap);
    Ok(rulings(&(p + towards * distance), &d.cross(&towards), distance, r, d))
}

fn spheres(p: &Point3<f64>, r: f64, q: &Point3<f64>, s: f64) -> Vec<Locus> {
    let between = q - p;
    let gap = between.norm();
    if gap < tolerance::POINT || gap > r + s - tolerance::TOUCH || gap < (r - s).abs() + tolerance::TOUCH {
        return Vec::new();
    }
    let distance = (gap * gap + r * r - s * s) / (2.0 * gap);
    plane_sphere(&Unit::new_normalize(between), -distance, p, r)
}

/// Two surfaces of revolution about one axis share circles; their half sections are lines and circles in (z, rho).
fn coaxial(a: &Surface, b: &Surface) -> Shared {
    let axis = a.axis();
    let origin = a.origin();
    let along = matches!(b, Surface::Sphere { .. }) || parallel(&axis, &b.axis());
    if !along || radial(&origin, &axis, &b.origin()).norm() > tolerance::POINT {
        return Err(Oblique);
    }
    let shift = (b.origin() - origin).dot(&axis);
    let facing = b.axis().dot(&axis).signum();
    let heights = match (Section::of(a, 0.0, 1.0), Section::of(b, shift, facing)) {
        (Section::Line { at, slope }, Section::Line { at: other, slope: tilt }) => line_line(at, slope, other, tilt),
        (Section::Line { at, slope }, Section::Round { at: z, radius }) => line_round(at, slope, z, radius),
        _ => Vec::new(),
    };
    let (first, second) = (Section::of(a, 0.0, 1.0), Section::of(b, shift, facing));
    let circle = |z: f64| Locus::circle(origin + axis.into_inner() * z, axis, first.radius_at(z));
    let shared = |z: &f64| first.radius_at(*z) > tolerance::POINT && second.reaches(*z);
    Ok(heights.into_iter().filter(shared).map(circle).collect())
}

/// The half section of a surface of revolution: `rho = at + slope z`, or a circle about `(at, 0)`.
enum Section {
    Line { at: f64, slope: f64 },
    Round { at: f64, radius: f64 },
}

impl Section {
    fn of(surface: &Surface, shift: f64, facing: f64) -> Section {
        match surface {
            Surface::Cone { half_angle, .. } => {
                let slope = half_angle.tan() * facing;
                Section::Line { at: -slope * shift, slope }
            }
            Surface::Cylinder { radius, .. } => Section::Line { at: *radius, slope: 0.0 },
            Surface::Sphere { radius, .. } => Section::Round { at: shift, radius: *radius },
            Surface::Plane { .. } | Surface::Torus { .. } => Section::Line { at: 0.0, slope: 0.0 },
        }
    }

    fn radius_at(&self, z: f64) -> f64 {
        match self {
            Section::Line { at, slope } => at + slope * z,
            Section::Round { at, radius } => (radius * radius - (z - at).powi(2)).max(0.0).sqrt(),
        }
    }

    /// False on the nappe of a cone that is not there.
    fn reaches(&self, z: f64) -> bool {
        self.radius_at(z) > 0.0
    }
}

fn line_line(at: f64, slope: f64, other: f64, tilt: f64) -> Vec<f64> {
    if (slope - tilt).abs() < tolerance::DIRECTION { Vec::new() } else { vec![(other - at) / (slope - tilt)] }
}

fn line_round(at: f64, slope: f64, centre: f64, radius: f64) -> Vec<f64> {
    // Distance of the sphere's centre from the line, and the foot of the perpendicular.
    let scale = 1.0 + slope * slope;
    let rho = at + slope * centre;
    let foot = centre - slope * rho / scale;
    let distance = rho.abs() / scale.sqrt();
    if (distance - radius).abs() < tolerance::TOUCH {
        return vec![foot];
    }
    if distance > radius {
        return Vec::new();
    }
    let half = ((radius * radius - distance * distance) / scale).sqrt();
    vec![foot - half, foot + half]
}
