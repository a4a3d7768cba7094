//! Area and volume of a face by the divergence theorem, in closed form.
//!
//! In: a surface and the loops of arcs round a face. Out: [`Flux`]. The vector area of a face is `½ ∮ r × dr` on any
//! surface; with it and the area, the flux of `p / 3` through planes, cylinders, cones and spheres follows. The area
//! itself is the vector area along the normal (plane), `-∮ v du` in the equal-area chart (cylinder, cone), or comes from
//! the theorem of Gauss and Bonnet (sphere).

use super::Surface;
use super::locus::Locus;
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

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

impl Run<'_> {
    fn way(&self) -> f64 {
        if self.forward { 1.0 } else { -1.0 }
    }

    /// Unit direction of travel at the start (0) or the end (1).
    fn heading(&self, end: usize) -> (Point3<f64>, Vector3<f64>) {
        let t = self.span[if self.forward { end } else { 1 - end }];
        (self.locus.at(t), self.locus.tangent(t) * self.way())
    }

    /// `½ ∫ r × dr` in the direction of travel, r from `from`.
    fn vector_area(&self, from: &Point3<f64>) -> Vector3<f64> {
        let [a, b] = self.span;
        let swept = match self.locus {
            Locus::Line { .. } => (self.locus.at(a) - from).cross(&(self.locus.at(b) - from)),
            Locus::Circle { centre, axis, radius, .. } => {
                let chord = self.locus.at(b) - self.locus.at(a);
                (centre - from).cross(&chord) + axis.into_inner() * (radius * radius * (b - a))
            }
        };
        swept * (self.way() / 2.0)
    }

    /// Turn about `axis` in the direction of travel, of a circle about that axis; nothing along a ruling.
    fn turn(&self, axis: &Vector3<f64>) -> f64 {
        match self.locus {
            Locus::Line { .. } => 0.0,
            Locus::Circle { axis: own, .. } => (self.span[1] - self.span[0]) * own.dot(axis).signum() * self.way(),
        }
    }
}

/// Flux through the face left of its loops, seen from its outward side, from the point `from`.
pub(super) fn flux(surface: &Surface, outward: bool, loops: &[Vec<Run>], from: &Point3<f64>) -> Flux {
    let sense = if outward { 1.0 } else { -1.0 };
    let vector: Vector3<f64> = loops.iter().flatten().map(|run| run.vector_area(&surface.origin())).sum();
    let offset = surface.origin() - from;
    let area = match surface {
        Surface::Plane { normal, .. } => normal.dot(&vector) * sense,
        Surface::Cylinder { .. } | Surface::Cone { .. } => sense * developed(surface, loops),
        Surface::Sphere { radius, .. } | Surface::Torus { minor: radius, .. } => {
            radius * radius * spherical_angle(surface, sense, loops)
        }
    };
    // p·n = offset·n + the distance of the surface from its own origin along n.
    let own = match surface {
        Surface::Plane { .. } | Surface::Cone { .. } | Surface::Torus { .. } => 0.0,
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => *radius,
    };
    // The vector area already points outwards, for it follows the loops.
    let volume = (offset.dot(&vector) + own * area * sense) / 3.0;
    Flux { area, volume }
}

/// `-∮ v du` in the chart of a cylinder or cone.
fn developed(surface: &Surface, loops: &[Vec<Run>]) -> f64 {
    let girth = match surface {
        Surface::Cylinder { radius, .. } => *radius,
        _ => 1.0,
    };
    let axis = surface.axis();
    let under = |run: &Run| -surface.chart(&run.locus.at(run.span[0]))[1] * girth * run.turn(&axis);
    loops.iter().flatten().map(under).sum()
}

/// Solid angle of a face of a sphere (Gauss and Bonnet): `2πχ`, less the geodesic curvature along its loops, less the
/// turns at their corners. χ is 2 less the number of loops.
fn spherical_angle(surface: &Surface, sense: f64, loops: &[Vec<Run>]) -> f64 {
    let Surface::Sphere { centre, radius, .. } = surface else { return 0.0 };
    let bend = |run: &Run| match run.locus {
        Locus::Circle { centre: c, axis, .. } => {
            (c - centre).dot(axis) / radius * (run.span[1] - run.span[0]) * run.way()
        }
        Locus::Line { .. } => 0.0,
    };
    let corner = |runs: &[Run], i: usize| {
        let ((_, came), (p, goes)) = (runs[i].heading(1), runs[(i + 1) % runs.len()].heading(0));
        surface.normal_at(&p).dot(&came.cross(&goes)).atan2(came.dot(&goes))
    };
    let turned = |runs: &Vec<Run>| -> f64 { (0..runs.len()).map(|i| bend(&runs[i]) + corner(runs, i)).sum() };
    TAU * (2.0 - loops.len() as f64) - sense * loops.iter().map(turned).sum::<f64>()
}
