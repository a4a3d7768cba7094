//! Area and volume of a face by the divergence theorem, in closed form.
//!
//! In: a surface and the arcs round a face. Out: [`Flux`]. On a closed surface an area element integrates to
//! `-∮ F(v) dθ` with F the integral along v from the south pole (or apex, or v = 0); F is constant along circles about
//! the axis and rulings have dθ = 0. Only arcs that are neither are integrated numerically, to rounding.

use super::locus::Locus;
use super::surface::{across, radial};
use super::{Surface, tolerance};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_PI_4, TAU};

/// Area (mm²) of a face and the volume (mm³) of the cone from a point to it, signed by its outward side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flux {
    pub area: f64,
    pub volume: f64,
}

/// Flux through the face left of `runs` = (curve, parameters, forward). `north`: the north pole of a sphere is inside.
pub(super) fn flux<'a>(
    surface: &Surface,
    outward: bool,
    runs: impl Iterator<Item = (&'a Locus, [f64; 2], bool)>,
    north: bool,
    from: &Point3<f64>,
) -> Flux {
    let (mut area, mut moment) = (0.0, 0.0);
    for (locus, span, forward) in runs {
        let way = if forward == outward { 1.0 } else { -1.0 };
        let (a, m) = match surface {
            Surface::Plane { .. } => (sweep(surface, locus, span), 0.0),
            _ => around(surface, locus, span, from),
        };
        area += way * a;
        moment += way * m;
    }
    if let (Surface::Plane { normal, offset }, false) = (surface, north) {
        moment = area * (offset - normal.dot(&from.coords));
    }
    if let (Surface::Sphere { radius, .. }, true) = (surface, north) {
        area += 2.0 * TAU * radius * radius;
        moment += 2.0 * TAU * radius.powi(3);
    }
    Flux { area, volume: moment / 3.0 * if outward { 1.0 } else { -1.0 } }
}

/// `½ ∫ (x dy - y dx)` along an arc in a plane, from the plane's origin.
fn sweep(plane: &Surface, locus: &Locus, [a, b]: [f64; 2]) -> f64 {
    let normal = plane.axis();
    let turn = |p: Vector3<f64>, q: Vector3<f64>| normal.dot(&p.cross(&q)) / 2.0;
    match locus {
        Locus::Line { .. } => turn(locus.at(a) - plane.origin(), locus.at(b) - plane.origin()),
        Locus::Circle { centre, axis, radius, .. } => {
            let sector = radius * radius * (b - a) / 2.0 * axis.dot(&normal).signum();
            sector + turn(centre - plane.origin(), locus.at(b) - locus.at(a))
        }
    }
}

/// Integrals along v per unit of θ: area, and flux as `fixed + round (e·C)`, where e points from the axis and C from
/// the reference to the surface's origin.
struct Column {
    area: f64,
    fixed: f64,
    round: f64,
}

fn column(surface: &Surface, v: f64, offset: &Vector3<f64>) -> Column {
    match surface {
        Surface::Cylinder { radius, .. } => Column { area: radius * v, fixed: radius * radius * v, round: radius * v },
        Surface::Cone { axis, half_angle, .. } => {
            let (sin, cos) = half_angle.sin_cos();
            Column { area: v, fixed: -v * sin * axis.dot(offset), round: v * cos }
        }
        Surface::Sphere { radius, .. } => {
            let w = (v / radius - 1.0).clamp(-1.0, 1.0);
            let across = (w * (1.0 - w * w).sqrt() + w.asin()) / 2.0 + FRAC_PI_4;
            let along = (w * w - 1.0) / 2.0 * surface.axis().dot(offset);
            let square = radius * radius;
            Column { area: radius * v, fixed: square * (v + along), round: square * across }
        }
        Surface::Plane { .. } => Column { area: 0.0, fixed: 0.0, round: 0.0 },
    }
}

/// `-∫ F dθ` along an arc on a closed surface: (area, flux).
fn around(surface: &Surface, locus: &Locus, span: [f64; 2], from: &Point3<f64>) -> (f64, f64) {
    let offset = surface.origin() - from;
    match locus {
        Locus::Line { .. } => (0.0, 0.0),
        Locus::Circle { centre, axis, x, y, .. } if about(surface, centre, axis) => {
            let [a, b] = span;
            let way = axis.dot(&surface.axis()).signum();
            let column = column(surface, surface.chart(&locus.at(a))[1], &offset);
            let out = x * (b.sin() - a.sin()) + y * (a.cos() - b.cos());
            let turn = way * (b - a);
            (-column.area * turn, -column.fixed * turn - column.round * way * out.dot(&offset))
        }
        Locus::Circle { radius, .. } => numeric(surface, locus, span, *radius, &offset),
    }
}

/// True when the circle runs about the surface's own axis.
fn about(surface: &Surface, centre: &Point3<f64>, axis: &nalgebra::Unit<Vector3<f64>>) -> bool {
    let own = surface.axis();
    own.cross(axis).norm() < tolerance::DIRECTION
        && radial(&surface.origin(), &own, centre).norm() < 10.0 * tolerance::POINT
}

/// Panels of an arc, each integrated by Gauss and Legendre's rule of five points.
const PANELS: usize = 256;
const GAUSS: [(f64, f64); 5] = [
    (0.0, 0.568_888_888_888_888_9),
    (-0.538_469_310_105_683, 0.478_628_670_499_366_5),
    (0.538_469_310_105_683, 0.478_628_670_499_366_5),
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

fn numeric(surface: &Surface, locus: &Locus, [a, b]: [f64; 2], speed: f64, offset: &Vector3<f64>) -> (f64, f64) {
    let axis = surface.axis();
    let (x, y) = across(&axis);
    let half = (b - a) / PANELS as f64 / 2.0;
    let (mut area, mut moment) = (0.0, 0.0);
    for panel in 0..PANELS {
        let middle = a + half * (2 * panel + 1) as f64;
        for (node, weight) in GAUSS {
            let t = middle + half * node;
            let p = locus.at(t);
            let q = p - surface.origin();
            let out = x * q.dot(&x) + y * q.dot(&y);
            let rho = out.norm();
            let turn = axis.cross(&out).dot(&locus.tangent(t)) * speed / (rho * rho) * weight * half;
            let column = column(surface, surface.chart(&p)[1], offset);
            area -= column.area * turn;
            moment -= (column.fixed + column.round * out.dot(offset) / rho) * turn;
        }
    }
    (area, moment)
}
