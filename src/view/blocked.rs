//! E0603: a camera or a lamp that stands where nothing can stand.
//!
//! In: the station, its bodies in the middle of where they may stand, the chosen camera. Out: what stands inside a component
//! or below the floor, in the user's names. Looks at centres only: a lamp that reaches into a part is the user's affair.

use crate::design::model::{Design, LightShape, Station};
use crate::diag::{Diagnostic, Span};
use crate::runtime::camera::{Camera, Vec3};
use crate::scene::Body;
use nalgebra::Point3;

/// The camera, if it is blocked: what it sees means nothing then.
pub fn camera(design: &Design, station: &Station, bodies: &[Body], camera: &Camera) -> Option<Diagnostic> {
    let what = format!("the camera of station `{}`", station.name);
    let help = "give it a larger `distance`, or another `aim`";
    fault(design, station, bodies, &what, camera.position, station.camera.span, help)
}

/// The panels that are blocked. Rings ride on the camera, and a room has no place.
pub fn lamps(design: &Design, station: &Station, bodies: &[Body]) -> Vec<Diagnostic> {
    let blocked = station.lights.iter().filter_map(|light| match light.shape {
        LightShape::Panel { at, .. } => {
            let what = format!("light `{}` of station `{}`", light.name, station.name);
            fault(design, station, bodies, &what, at, light.span, "move it with `at`")
        }
        LightShape::Ring { .. } | LightShape::Room { .. } => None,
    });
    blocked.collect()
}

fn fault(
    design: &Design,
    station: &Station,
    bodies: &[Body],
    what: &str,
    at: Vec3,
    span: Span,
    help: &str,
) -> Option<Diagnostic> {
    let [x, y, z] = at;
    let place = format!("it stands at ({x:.1}, {y:.1}, {z:.1})");
    if let Some(body) = bodies.iter().find(|body| body.mesh.holds(&(body.pose.inverse() * Point3::from(at)))) {
        let component = &design.components[body.component];
        let message = format!("{what} stands inside `{}`", component.name);
        let fault = Diagnostic::error("E0603", span, message).label(place).also(component.span, "placed here");
        return Some(fault.help(help));
    }
    let floor = station.floor.as_ref().filter(|floor| z < floor.z)?;
    let message = format!("{what} stands below the floor, which is at z = {}", floor.z);
    Some(Diagnostic::error("E0603", span, message).label(place).help(help))
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{block, cylinder};
    use super::*;

    /// Against the formula of each shape.
    #[test]
    fn a_mesh_holds_what_its_shape_holds() {
        let (block, round) = (block([20.0, 10.0, 4.0]), cylinder(12.0, 8.0, 96));
        let mut inside = 0;
        for i in 0..4000u32 {
            // A lattice without a direction in common with the faces.
            let share = |step: f64| (f64::from(i) * step).fract();
            let p = Point3::new(
                share(0.618_034) * 24.0 - 12.0,
                share(0.754_878) * 14.0 - 7.0,
                share(0.569_84) * 10.0 - 1.0,
            );
            let in_block = p.x.abs() < 10.0 && p.y.abs() < 5.0 && p.z > 0.0 && p.z < 4.0;
            assert_eq!(block.holds(&p), in_block, "{p}");
            let r = p.x.hypot(p.y);
            // The sides of the prism lie up to 0.004 mm inside of the cylinder.
            if (r - 6.0).abs() > 0.01 {
                assert_eq!(round.holds(&p), r < 6.0 && p.z > 0.0 && p.z < 8.0, "{p}");
            }
            inside += u32::from(in_block);
        }
        assert!(inside > 500, "{inside}");
    }
}
