//! The curves that two surfaces share.
//!
//! In: two distinct surfaces. Out: lines, circles and ellipses by formula; a line or circle along which they merely touch
//! counts. What no formula covers is left to `trace`.

use super::Surface;
use super::locus::Locus;
use super::surface::{is_ring, radial};
use super::tolerance;
use super::trace::Shared;
use nalgebra::{Point3, Unit, Vector3};

/// What a formula knows of two surfaces.
#[derive(Debug)]
pub(super) enum Known {
    /// All they share.
    All(Shared),
    /// Curves along which they touch; there may be others.
    Touching(Vec<Locus>),
}

type Direction = Unit<Vector3<f64>>;

/// Curves common to `a` and `b`, in a fixed order.
pub(super) fn intersect(a: &Surface, b: &Surface) -> Known {
    use Surface::{Cone, Cylinder, Plane, Sphere, Torus};
    match (a, b) {
        (Plane { normal: n, offset: d }, Plane { normal: m, offset: e }) => all(planes((n, *d), (m, *e))),
        (Plane { normal, .. }, Cylinder { point, axis, radius }) => {
            all(plane_cylinder(normal, a.distance(point), point, axis, *radius))
        }
        (Plane { normal, .. }, Cone { apex, axis, half_angle }) => {
            plane_cone(normal, a.distance(apex), apex, axis, *half_angle)
        }
        (Plane { normal, .. }, Sphere { centre, radius, .. }) => {
            all(plane_sphere(normal, a.distance(centre), centre, *radius))
        }
        (Plane { normal, .. }, Torus { centre, axis, major, minor }) => {
            plane_torus(normal, a.distance(centre), (centre, axis, *major, *minor))
        }
        (Cylinder { point: p, axis: d, radius: r }, Cylinder { point: q, axis: e, radius: s }) => {
            cylinders((p, d, *r), (q, e, *s))
        }
        (Sphere { centre: p, radius: r, .. }, Sphere { centre: q, radius: s, .. }) => all(spheres(p, *r, q, *s)),
        (_, Plane { .. }) | (Cone { .. } | Sphere { .. } | Torus { .. }, Cylinder { .. }) => intersect(b, a),
        (Sphere { .. } | Torus { .. }, Cone { .. }) | (Torus { .. }, Sphere { .. }) => intersect(b, a),
        (Cylinder { .. } | Cone { .. } | Sphere { .. } | Torus { .. }, _) => {
            coaxial(a, b).map_or_else(|| Known::Touching(joints(a, b)), all)
        }
    }
}

fn all(loci: Vec<Locus>) -> Known {
    Known::All(Shared { loci, nodes: Vec::new() })
}

fn traced() -> Known {
    Known::Touching(Vec::new())
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
fn plane_cylinder(normal: &Direction, distance: f64, point: &Point3<f64>, axis: &Direction, radius: f64) -> Vec<Locus> {
    if square(normal, axis) {
        let foot = point - normal.into_inner() * distance;
        return rulings(&foot, &axis.cross(normal), distance, radius, axis);
    }
    let slope = normal.dot(axis);
    let centre = point - axis.into_inner() * (distance / slope);
    if parallel(normal, axis) {
        return vec![Locus::circle(centre, *axis, radius)];
    }
    let minor = normal.cross(axis).normalize();
    let major = normal.cross(&minor);
    vec![Locus::ellipse(centre, major * (radius / slope.abs()), minor * radius)]
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
fn plane_cone(normal: &Direction, distance: f64, apex: &Point3<f64>, axis: &Direction, half_angle: f64) -> Known {
    let rise = -distance / normal.dot(axis);
    if parallel(normal, axis) {
        let circle = |rise: f64| Locus::circle(apex + axis.into_inner() * rise, *axis, rise * half_angle.tan());
        return all(if rise > tolerance::POINT { vec![circle(rise)] } else { Vec::new() });
    }
    // The direction of the axis in the plane, and how steep the plane is against the flanks.
    let fall = axis.into_inner() - normal.into_inner() * normal.dot(axis);
    let (steep, fall) = (fall.norm(), fall.normalize());
    let aside = normal.cross(&fall);
    if distance.abs() < tolerance::POINT {
        return Known::All(Shared { loci: flanks(apex, &fall, &aside, half_angle.cos() / steep), nodes: vec![*apex] });
    }
    if steep > half_angle.cos() - NEARLY_PARABOLA {
        return if rise_of_nearest(distance, normal, axis, half_angle) { traced() } else { all(Vec::new()) };
    }
    if rise < 0.0 {
        return all(Vec::new());
    }
    // The two flanks in the plane of symmetry give the ends of the major axis.
    let out = (fall - axis.into_inner() * fall.dot(axis)).normalize();
    let end = |side: f64| {
        let flank = axis.into_inner() * half_angle.cos() + out * (side * half_angle.sin());
        apex + flank * (-distance / normal.dot(&flank))
    };
    let (p, q) = (end(1.0), end(-1.0));
    let centre = nalgebra::center(&p, &q);
    // Across, the half axis is the mean proportional of the distances of the ends from the axis.
    let out = |p: &Point3<f64>| radial(apex, axis, p).norm();
    let minor = (out(&p) * out(&q)).sqrt();
    all(vec![Locus::ellipse(centre, (p - q) / 2.0, aside * minor)])
}

/// A plane within this of a flank's slope (cosine) cuts a cone in a curve too long to be told from a parabola.
const NEARLY_PARABOLA: f64 = 1e-6;

/// Whether a steep plane meets the nappe: it always does but where it only meets the other one.
fn rise_of_nearest(distance: f64, normal: &Direction, axis: &Direction, half_angle: f64) -> bool {
    // The nappe reaches furthest against the normal, or along it, along its extreme flank.
    let out = normal.into_inner() - axis.into_inner() * normal.dot(axis);
    let out = out.normalize();
    [1.0, -1.0].iter().any(|side| {
        let flank = axis.into_inner() * half_angle.cos() + out * (side * half_angle.sin());
        -distance * normal.dot(&flank) > 0.0
    })
}

/// Lines through the apex in a plane: where `cosine`, of their angle with `fall`, allows.
fn flanks(apex: &Point3<f64>, fall: &Vector3<f64>, aside: &Vector3<f64>, cosine: f64) -> Vec<Locus> {
    let line = |d: Vector3<f64>| Locus::Line { point: *apex, along: Unit::new_normalize(d) };
    if cosine > 1.0 + tolerance::DIRECTION {
        return Vec::new();
    }
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    if sine < TOUCHED_FLANK {
        return vec![line(*fall)];
    }
    [-1.0, 1.0].map(|side| line(fall * cosine + aside * (side * sine))).to_vec()
}

/// A plane through the apex whose two lines enclose less than this (rad) touches the cone.
const TOUCHED_FLANK: f64 = 1e-5;

/// `distance`: of the centre from the plane.
fn plane_torus(
    normal: &Direction,
    distance: f64,
    (centre, axis, major, minor): (&Point3<f64>, &Direction, f64, f64),
) -> Known {
    if parallel(normal, axis) {
        let z = -distance / normal.dot(axis);
        let gap = minor - z.abs();
        let circle = |radius: f64| Locus::circle(centre + axis.into_inner() * z, *axis, radius);
        let half = (minor * minor - z * z).max(0.0).sqrt();
        let radii = if gap < -tolerance::TOUCH {
            vec![]
        } else if gap < tolerance::TOUCH {
            vec![major]
        } else {
            vec![major - half, major + half]
        };
        return all(radii.into_iter().filter(|r| *r > tolerance::POINT).map(circle).collect());
    }
    if square(normal, axis) && distance.abs() < tolerance::POINT {
        let out = axis.cross(normal).normalize();
        let loci = [1.0, -1.0].map(|side| Locus::circle(centre + out * (side * major), *normal, minor)).to_vec();
        let pole = (minor * minor - major * major).max(0.0).sqrt();
        let poles = [pole, -pole].map(|z| centre + axis.into_inner() * z);
        return Known::All(Shared { loci, nodes: if !is_ring(major, minor) { poles.to_vec() } else { Vec::new() } });
    }
    traced()
}

/// `distance`: of the centre from the plane. A plane that touches shares only a point, which bounds nothing.
fn plane_sphere(normal: &Direction, distance: f64, centre: &Point3<f64>, radius: f64) -> Vec<Locus> {
    if distance.abs() > radius - tolerance::TOUCH {
        return Vec::new();
    }
    let rho = (radius * radius - distance * distance).sqrt();
    vec![Locus::circle(centre - normal.into_inner() * distance, *normal, rho)]
}

fn cylinders((p, d, r): (&Point3<f64>, &Direction, f64), (q, e, s): (&Point3<f64>, &Direction, f64)) -> Known {
    if !parallel(d, e) {
        return crossed((p, d, r), (q, e, s));
    }
    let between = radial(p, d, q);
    let gap = between.norm();
    if gap < tolerance::POINT || gap > r + s + tolerance::TOUCH || gap < (r - s).abs() - tolerance::TOUCH {
        return all(Vec::new());
    }
    let towards = between / gap;
    let distance = (gap * gap + r * r - s * s) / (2.0 * gap);
    all(rulings(&(p + towards * distance), &d.cross(&towards), distance, r, d))
}

/// Cylinders of one radius whose axes meet share two ellipses, in the planes that halve the angles of the axes.
fn crossed((p, d, r): (&Point3<f64>, &Direction, f64), (q, e, s): (&Point3<f64>, &Direction, f64)) -> Known {
    let square = d.cross(e);
    let gap = (q - p).dot(&square) / square.norm();
    if (r - s).abs() > tolerance::POINT || gap.abs() > tolerance::POINT {
        return traced();
    }
    // The point of the first axis nearest to the second.
    let along = (q - p).cross(e).dot(&square) / square.norm_squared();
    let centre = p + d.into_inner() * along;
    let planes = [d.into_inner() - e.into_inner(), d.into_inner() + e.into_inner()].map(Unit::new_normalize);
    let loci = planes.iter().flat_map(|n| plane_cylinder(n, 0.0, &centre, d, r)).collect();
    let reach = square.normalize() * r;
    Known::All(Shared { loci, nodes: vec![centre + reach, centre - reach] })
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
fn coaxial(a: &Surface, b: &Surface) -> Option<Vec<Locus>> {
    let spheres = [a, b].map(|s| matches!(s, Surface::Sphere { .. }));
    let axis = if spheres[0] { b.axis() } else { a.axis() };
    let origin = a.origin();
    let along = spheres[0] || spheres[1] || parallel(&axis, &b.axis());
    if !along || radial(&origin, &axis, &b.origin()).norm() > tolerance::POINT {
        return None;
    }
    let shift = (b.origin() - origin).dot(&axis);
    let facing = |s: &Surface| s.axis().dot(&axis).signum();
    let (first, second) = (Section::of(a, 0.0, facing(a)), Section::of(b, shift, facing(b)));
    let points = match (&first, &second) {
        (Section::Line { at, slope }, Section::Line { at: other, slope: tilt }) => {
            line_line(*at, *slope, *other, *tilt)
        }
        (Section::Line { at, slope }, Section::Round { centre, radius })
        | (Section::Round { centre, radius }, Section::Line { at, slope }) => line_round(*at, *slope, *centre, *radius),
        (Section::Round { centre, radius }, Section::Round { centre: other, radius: s }) => {
            round_round(*centre, *radius, *other, *s)
        }
    };
    let circle = |[z, rho]: [f64; 2]| Locus::circle(origin + axis.into_inner() * z, axis, rho);
    Some(points.into_iter().filter(|p| p[1] > tolerance::POINT).map(circle).collect())
}

/// The half section of a surface of revolution in (z, rho): `rho = at + slope z`, or a circle.
enum Section {
    Line { at: f64, slope: f64 },
    Round { centre: [f64; 2], radius: f64 },
}

impl Section {
    fn of(surface: &Surface, shift: f64, facing: f64) -> Section {
        match surface {
            Surface::Cone { half_angle, .. } => {
                let slope = half_angle.tan() * facing;
                Section::Line { at: -slope * shift, slope }
            }
            Surface::Cylinder { radius, .. } => Section::Line { at: *radius, slope: 0.0 },
            Surface::Sphere { radius, .. } => Section::Round { centre: [shift, 0.0], radius: *radius },
            Surface::Torus { major, minor, .. } => Section::Round { centre: [shift, *major], radius: *minor },
            Surface::Plane { .. } => Section::Line { at: 0.0, slope: 0.0 },
        }
    }
}

fn line_line(at: f64, slope: f64, other: f64, tilt: f64) -> Vec<[f64; 2]> {
    if (slope - tilt).abs() < tolerance::DIRECTION {
        return Vec::new();
    }
    let z = (other - at) / (slope - tilt);
    vec![[z, at + slope * z]]
}

fn line_round(at: f64, slope: f64, centre: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    // Distance of the centre from the line, and the foot of the perpendicular.
    let scale = 1.0 + slope * slope;
    let off = at + slope * centre[0] - centre[1];
    let foot = centre[0] - slope * off / scale;
    let point = |z: f64| [z, at + slope * z];
    let distance = off.abs() / scale.sqrt();
    if (distance - radius).abs() < tolerance::TOUCH {
        return vec![point(foot)];
    }
    if distance > radius {
        return Vec::new();
    }
    let half = ((radius * radius - distance * distance) / scale).sqrt();
    vec![point(foot - half), point(foot + half)]
}

fn round_round(p: [f64; 2], r: f64, q: [f64; 2], s: f64) -> Vec<[f64; 2]> {
    let between = [q[0] - p[0], q[1] - p[1]];
    let gap = between[0].hypot(between[1]);
    if gap < tolerance::POINT {
        return Vec::new();
    }
    let d = [between[0] / gap, between[1] / gap];
    let distance = (gap * gap + r * r - s * s) / (2.0 * gap);
    let point = |aside: f64| [p[0] + d[0] * distance - d[1] * aside, p[1] + d[1] * distance + d[0] * aside];
    if (gap - r - s).abs() < tolerance::TOUCH || (gap - (r - s).abs()).abs() < tolerance::TOUCH {
        return vec![point(0.0)];
    }
    let square = r * r - distance * distance;
    if square < 0.0 { Vec::new() } else { vec![point(square.sqrt()), point(-square.sqrt())] }
}

/// Circles along which tubes of one radius touch where their spines do: a bend and the straight pipe it leads into, two
/// bends, a bend and its round end.
fn joints(a: &Surface, b: &Surface) -> Vec<Locus> {
    let Surface::Torus { centre, axis, major, minor } = b else {
        return if matches!(a, Surface::Torus { .. }) { joints(b, a) } else { Vec::new() };
    };
    let joint = |on_spine: &Point3<f64>| {
        let out = radial(centre, axis, on_spine);
        let near =
            (out.norm() - major).abs() < tolerance::POINT && (on_spine - centre).dot(axis).abs() < tolerance::POINT;
        let tangent = Unit::new_normalize(axis.cross(&out));
        near.then_some((*on_spine, tangent))
    };
    let circle = |(p, tangent)| Locus::circle(p, tangent, *minor);
    let alike = |r: &f64| (r - minor).abs() < tolerance::POINT && *major > *minor;
    match a {
        Surface::Sphere { centre: p, radius, .. } if alike(radius) => joint(p).map(circle).into_iter().collect(),
        Surface::Cylinder { point, axis: d, radius } if alike(radius) => {
            let foot = point + d.into_inner() * (centre - point).dot(d);
            joint(&foot).filter(|(_, tangent)| parallel(tangent, d)).map(circle).into_iter().collect()
        }
        Surface::Torus { centre: p, axis: d, major: other, minor: s } if alike(s) => {
            // Spines that touch do so on the line of their centres when they lie in one plane, else on both planes' line.
            let line = if parallel(axis, d) {
                (p - centre).try_normalize(tolerance::POINT)
            } else {
                Some(axis.cross(d).normalize())
            };
            let Some(line) = line else { return Vec::new() };
            let touches = [1.0, -1.0].map(|side| centre + line * (side * major));
            let on_other = |q: &&Point3<f64>| {
                let out = radial(p, d, q);
                (out.norm() - other).abs() < tolerance::POINT && (*q - p).dot(d).abs() < tolerance::POINT
            };
            let aligned = |q: &Point3<f64>| {
                parallel(
                    &Unit::new_normalize(axis.cross(&radial(centre, axis, q))),
                    &Unit::new_normalize(d.cross(&radial(p, d, q))),
                )
            };
            touches.iter().filter(on_other).filter(|q| aligned(q)).filter_map(joint).map(circle).collect()
        }
        _ => Vec::new(),
    }
}
