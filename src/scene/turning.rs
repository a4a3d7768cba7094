//! Turning: which axis each face of a part was turned about.
//!
//! In: a [`Solid`]. Out: one [`Axis`] per face, in the part's frame (mm). The sides of shafts and bores, cones and rings were turned
//! about their own axis; an end face or a ball about that of its largest round edge; what has neither about z of the part's frame.
//! Never asks whether the part was turned at all: the spec says so.

use super::Axis;
use crate::solid::{Curve, Face, Solid, Surface};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

/// A round edge lies square to the axis of a face when their directions differ by less than this (sine of the angle).
const SQUARE: f64 = 1e-6;

/// The axis of every face of a solid, in the order of its faces.
pub(super) fn axes(solid: &Solid) -> Arc<[Axis]> {
    solid.faces.iter().map(|face| axis(solid, face)).collect()
}

fn axis(solid: &Solid, face: &Face) -> Axis {
    match &solid.surfaces[face.surface] {
        Surface::Cylinder { point, axis, .. } => Axis { point: *point, direction: axis.into_inner() },
        Surface::Cone { apex, axis, .. } => Axis { point: *apex, direction: axis.into_inner() },
        Surface::Torus { centre, axis, .. } => Axis { point: *centre, direction: axis.into_inner() },
        Surface::Plane { normal, .. } => {
            let square = |direction: &Vector3<f64>| direction.cross(normal).norm() < SQUARE;
            largest_circle(solid, face, square).unwrap_or(Z)
        }
        Surface::Sphere { .. } => largest_circle(solid, face, |_| true).unwrap_or(Z),
    }
}

const Z: Axis = Axis { point: Point3::new(0.0, 0.0, 0.0), direction: Vector3::new(0.0, 0.0, 1.0) };

/// The axis of the largest round edge of a face; of several, the first.
fn largest_circle(solid: &Solid, face: &Face, fits: impl Fn(&Vector3<f64>) -> bool) -> Option<Axis> {
    let mut largest: Option<(f64, Axis)> = None;
    for (edge, _) in face.loops.iter().flatten() {
        let Curve::Circle { centre, axis, radius } = &solid.edges[*edge].curve else { continue };
        if fits(axis) && largest.is_none_or(|(most, _)| *radius > most) {
            largest = Some((*radius, Axis { point: *centre, direction: axis.into_inner() }));
        }
    }
    largest.map(|(_, axis)| axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::{Quality, evaluate};

    /// The axes of a part's faces by their names.
    fn turned(features: &str) -> Vec<(String, Axis)> {
        let text = format!(
            "gonogo 1\nmaterial m {{\n metal = steel\n lay = circular\n}}\npart p {{\n material = m\n{features}\n}}\n\
             assembly a {{\n root p\n}}\nstation s {{\n light r = room()\n}}"
        );
        let loaded = crate::design::load("turned.gng", &|_| Ok(text.clone()), &[]);
        let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
        let part = &design.parts[0];
        let solid = evaluate(part, &design.nominal(), &Quality::default()).unwrap();
        solid.faces.iter().map(|f| f.name.clone()).zip(axes(&solid).iter().copied()).collect()
    }

    fn through(axis: &Axis, at: [f64; 3], direction: [f64; 3]) -> bool {
        let (to, direction) = (Point3::from(at) - axis.point, Vector3::from(direction));
        axis.direction.cross(&direction).norm() < 1e-9 && to.cross(&axis.direction).norm() < 1e-9
    }

    #[test]
    fn faces_are_turned_about_their_own_axis_and_ends_about_their_largest_edge() {
        let faces = turned(
            "add pin = cylinder(d = 10, h = 20) at (3, 4, 0) turn (90 deg, 0, 0)\ncut bore = cylinder(d = 4, h = through) at (3, 0, 2) turn (90 deg, 0, 0)",
        );
        for (name, axis) in &faces {
            let at = if name.starts_with("bore") { [3.0, 0.0, 2.0] } else { [3.0, 0.0, 0.0] };
            assert!(through(axis, at, [0.0, 1.0, 0.0]), "{name}: {axis:?}");
        }
        assert!(faces.len() >= 4);
    }

    #[test]
    fn flats_without_round_edges_are_turned_about_z() {
        for (name, axis) in turned("add block = box(x = 20, y = 10, z = 5) at (7, 0, 0)") {
            assert!(through(&axis, [0.0; 3], [0.0, 0.0, 1.0]), "{name}: {axis:?}");
        }
    }
}
