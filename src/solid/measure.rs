//! Area and volume of a face by the divergence theorem, from the curves round it.
//!
//! In: a surface and the loops of arcs round a face. Out: [`Flux`]. The vector area of a face is `½ ∮ r × dr` on any
//! surface; with it and the area, the flux of `p / 3` through planes, cylinders, cones and spheres follows; a torus needs
//! one integral more. The area itself is the vector area along the normal (plane), or `-∮ v du` in the equal-area chart.
//! Straight lines and circles are integrated in closed form where there is one, other curves by Gauss's quadrature.

use super::Surface;
use super::locus::Locus;
use super::surface::{across, is_ring, pole_angle};
use nalgebra::{Point3, Vector3};
use std::f64::consts::{PI, TAU};
use std::iter::Sum;
use std::ops::Mul;

/// Area (mm²) of a face and the volume (mm³) of the cone from a point to it, signed by its outward side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Flux {
    pub area: f64,
    pub volume: f64,
}

/// An arc of a loop: its curve, its parameters, and whether the loop runs along it forward.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run<'a> {
    pub locus: &'a Locus,
    pub span: [f64; 2],
    pub forward: bool,
}

/// Places and weights of Gauss's quadrature with six points on -1..1.
const GAUSS: [(f64, f64); 6] = [
    (-0.932_469_514_203_152, 0.171_324_492_379_170_3),
    (-0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (-0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
    (0.932_469_514_203_152, 0.171_324_492_379_170_3),
];
/// Stretches that a whole turn of a circle or ellipse is cut into, and a line that is no ruling of its surface.
const STRETCHES: f64 = 64.0;
const LINE_STRETCHES: f64 = 16.0;

impl Run<'_> {
    fn way(&self) -> f64 {
        if self.forward { 1.0 } else { -1.0 }
    }

    /// `½ ∫ r × dr` in the direction of travel, r from `from`.
    fn vector_area(&self, from: &Point3<f64>) -> Vector3<f64> {
        let [a, b] = self.span;
        let chord = self.locus.at(b) - self.locus.at(a);
        let swept = match self.locus {
            Locus::Line { .. } => (self.locus.at(a) - from).cross(&(self.locus.at(b) - from)),
            Locus::Circle { centre, axis, radius, .. } => {
                (centre - from).cross(&chord) + axis.into_inner() * (radius * radius * (b - a))
            }
            Locus::Ellipse { centre, major, minor } => (centre - from).cross(&chord) + major.cross(minor) * (b - a),
            Locus::Traced(curve) => {
                // The cubic ends a hair's breadth from the corners: straight steps lead there.
                let ends = [a, b].map(|t| (self.locus.at(t) - from, curve.cubic(t).0 - from));
                let gaps = ends[0].0.cross(&ends[0].1) + ends[1].1.cross(&ends[1].0);
                gaps + self.sum(|p, motion| (p - from).cross(&motion))
            }
        };
        swept * (self.way() / 2.0)
    }

    /// Integral over the parameter of a function of the point and its derivative, forward along the curve.
    fn sum<T>(&self, f: impl Fn(Point3<f64>, Vector3<f64>) -> T) -> T
    where
        T: Sum<T> + Mul<f64, Output = T>,
    {
        let slice = |(t, weight): (f64, f64)| {
            let (p, motion) = self.locus.moving(t);
            f(p, motion) * weight
        };
        self.places().into_iter().map(slice).sum()
    }

    /// Parameters and weights of the quadrature, ascending.
    fn places(&self) -> Vec<(f64, f64)> {
        let [a, b] = self.span;
        let mut cuts = vec![a];
        match self.locus {
            // A traced curve is smooth only between its points.
            Locus::Traced(_) => cuts.extend((a.floor() as i64 + 1..b.ceil() as i64).map(|k| k as f64)),
            locus => {
                let whole = if locus.period().is_some() { STRETCHES * (b - a) / TAU } else { LINE_STRETCHES };
                let count = whole.ceil().max(1.0) as usize;
                cuts.extend((1..count).map(|k| a + (b - a) * k as f64 / count as f64));
            }
        }
        cuts.push(b);
        let stretch = |w: &[f64]| {
            let (middle, half) = ((w[0] + w[1]) / 2.0, (w[1] - w[0]) / 2.0);
            GAUSS.map(|(x, weight)| (middle + half * x, half * weight))
        };
        cuts.windows(2).flat_map(stretch).collect()
    }
}

/// Flux through the face left of its loops, seen from its outward side, from the point `from`.
pub(super) fn flux(surface: &Surface, outward: bool, loops: &[Vec<Run>], from: &Point3<f64>) -> Flux {
    let sense = if outward { 1.0 } else { -1.0 };
    let vector: Vector3<f64> = loops.iter().map(|runs| vector_area(runs)).sum();
    let offset = surface.origin() - from;
    // The area, and the integral over it of the distance of the tangent plane from the surface's origin: p·n = offset·n +
    // that.
    let (area, own) = match surface {
        Surface::Plane { normal, .. } => (normal.dot(&vector) * sense, 0.0),
        Surface::Cone { .. } => (sense * developed(surface, loops), 0.0),
        Surface::Cylinder { radius, .. } => {
            let area = sense * developed(surface, loops);
            (area, area * radius)
        }
        Surface::Sphere { radius, .. } => {
            let area = within(sense * developed(surface, loops), 4.0 * PI * radius * radius);
            (area, area * radius)
        }
        Surface::Torus { major, minor, .. } => tube(surface, sense, loops, *major, *minor),
    };
    // The vector area already points outwards, for it follows the loops.
    Flux { area, volume: (offset.dot(&vector) + own * sense) / 3.0 }
}

/// `½ ∮ r × dr` round a loop. It is the same from any point; from one of its own the small gaps between a cubic and the
/// corners it should end at weigh least.
fn vector_area(runs: &[Run]) -> Vector3<f64> {
    let Some(first) = runs.first() else { return Vector3::zeros() };
    let from = first.locus.at(first.span[0]);
    runs.iter().map(|run| run.vector_area(&from)).sum()
}

/// `value` moved by whole amounts of `most` to more than zero and at most `most`: a face that holds a pole, or goes round
/// both ways, is what its loops leave of the whole surface.
fn within(value: f64, most: f64) -> f64 {
    let rest = value.rem_euclid(most);
    if rest > most * LEAST_SHARE { rest } else { rest + most }
}

/// A face smaller than this share of its surface is taken for all of it but for rounding.
const LEAST_SHARE: f64 = 1e-12;

/// `-∮ v du` in the chart of a cylinder, a cone or a sphere.
fn developed(surface: &Surface, loops: &[Vec<Run>]) -> f64 {
    let girth = match surface {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => *radius,
        _ => 1.0,
    };
    let (axis, origin) = (surface.axis(), surface.origin());
    let under = |run: &Run| match run.locus {
        Locus::Circle { axis: own, .. } if is_about(run.locus, surface) => {
            let turn = (run.span[1] - run.span[0]) * own.dot(&axis).signum();
            -surface.chart(&run.locus.at(run.span[0]))[1] * girth * turn * run.way()
        }
        Locus::Line { .. } if !matches!(surface, Surface::Sphere { .. }) => 0.0,
        _ => {
            let slice = |p: Point3<f64>, motion: Vector3<f64>| {
                -surface.chart(&p)[1] * girth * spin(&axis, &origin, &p, &motion)
            };
            run.sum(slice) * run.way()
        }
    };
    loops.iter().flatten().map(under).sum()
}

/// Whether the curve is a circle about the surface's axis: straight in its chart.
pub(super) fn is_about(locus: &Locus, surface: &Surface) -> bool {
    let Locus::Circle { centre, axis, .. } = locus else { return false };
    let own = surface.axis();
    axis.cross(&own).norm() < ABOUT && (centre - surface.origin()).cross(&own).norm() < ABOUT
}

/// A circle whose axis is off by less (rad, mm) goes round the surface's own axis.
const ABOUT: f64 = 1e-7;

/// Angular speed about an axis.
fn spin(axis: &Vector3<f64>, origin: &Point3<f64>, p: &Point3<f64>, motion: &Vector3<f64>) -> f64 {
    let q = p - origin;
    let out = q - axis * q.dot(axis);
    axis.cross(&out).dot(motion) / out.norm_squared().max(f64::MIN_POSITIVE)
}

/// Area of a face of a torus, and the integral over it of `R cos φ + r`. Green's theorem in the angles (θ, φ): as `-∮ G(φ) dθ`
/// where the loops do not go round the tube, else as `∮ θ g(φ) dφ`. Either is known up to whole tori.
fn tube(surface: &Surface, sense: f64, loops: &[Vec<Run>], major: f64, minor: f64) -> (f64, f64) {
    // Area and flux of the tube from φ = 0 on, per radian of θ. Both are counted from the lower end of the tube, so that a
    // lower pole adds nothing and an upper one the whole.
    let area_to = |phi: f64| minor * (major * phi + minor * phi.sin());
    let flux_to = |phi: f64| {
        let (squares, mixed) = (major * major + minor * minor, major * minor);
        minor * (squares * phi.sin() + mixed * (1.5 * phi + (2.0 * phi).sin() / 4.0))
    };
    let ends = pole_angle(major, minor);
    let (all_area, all_flux) = (TAU * 2.0 * area_to(ends), TAU * 2.0 * flux_to(ends));
    let rings: Vec<Vec<Angles>> = loops.iter().map(|runs| angles(surface, runs)).collect();
    let round_tube = is_ring(major, minor) && rings.iter().any(|ring| turns(ring));
    let mut sums = [0.0, 0.0];
    for step in rings.iter().flatten() {
        let (area, flux) = if round_tube {
            let (density, distance) = (minor * (major + minor * step.phi.cos()), major * step.phi.cos() + minor);
            (step.theta * density * step.phi_by, step.theta * density * distance * step.phi_by)
        } else {
            (-(area_to(step.phi) + area_to(ends)) * step.theta_by, -(flux_to(step.phi) + flux_to(ends)) * step.theta_by)
        };
        sums[0] += area * sense;
        sums[1] += flux * sense;
    }
    let area = within(sums[0], all_area);
    let added = ((area - sums[0]) / all_area).round();
    (area, sums[1] + added * all_flux)
}

/// A step of a quadrature round a torus: both angles, unrolled, and what they grow by in it, weighted.
struct Angles {
    theta: f64,
    phi: f64,
    theta_by: f64,
    phi_by: f64,
}

fn angles(surface: &Surface, runs: &[Run]) -> Vec<Angles> {
    let Surface::Torus { centre, axis, major, .. } = surface else { return Vec::new() };
    let (x, y) = across(axis);
    let mut last: Option<[f64; 2]> = None;
    let mut steps = Vec::new();
    for run in runs {
        let mut places = run.places();
        if !run.forward {
            places.reverse();
        }
        for (t, weight) in places {
            let (p, motion) = run.locus.moving(t);
            let q = p - centre;
            let (a, b, c) = (q.dot(&x), q.dot(&y), q.dot(axis));
            let rho = a.hypot(b);
            let found = [b.atan2(a), c.atan2(rho - major)];
            let near = |k: usize| last.map_or(found[k], |l| found[k] + ((l[k] - found[k]) / TAU).round() * TAU);
            let (theta, phi) = (near(0), near(1));
            last = Some([theta, phi]);
            let motion = motion * (weight * run.way());
            let out = (x * a + y * b) / rho.max(f64::MIN_POSITIVE);
            let (out_by, up_by) = (motion.dot(&out), motion.dot(axis));
            let (d, square) = (rho - major, (rho - major).powi(2) + c * c);
            steps.push(Angles {
                theta,
                phi,
                theta_by: spin(axis, centre, &p, &motion),
                phi_by: (d * up_by - c * out_by) / square.max(f64::MIN_POSITIVE),
            });
        }
    }
    steps
}

/// Whether a ring goes round the tube.
fn turns(ring: &[Angles]) -> bool {
    ring.iter().map(|s| s.phi_by).sum::<f64>().abs() > PI
}
