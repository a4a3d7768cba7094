//! A part put in upside down.
//!
//! In: the room that the others leave a component. Out: a half turn about an axis along the seat after which it lies in its
//! place again, clears all others and looks different. A screw that would stand on its head is no such part.

use super::room::Room;
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Serialize;
use std::f64::consts::PI;

/// A half turn, and how much higher the component then lies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Flip {
    /// A point of the axis (mm, assembly's frame) and its direction.
    pub point: [f64; 3],
    pub axis: [f64; 3],
    /// After the turn (mm, assembly's frame).
    pub lift: [f64; 3],
}

/// Axes tried, evenly over half a turn.
const AXES: usize = 8;
/// It lies higher than its box did by this share of its height at most: what stood in others before, now stands up.
const HIGHER: f64 = 0.5;
/// It lies lower by this (mm) at most, and leans by this (rad).
const LOWER: f64 = 0.1;
const LEANS: f64 = 0.01;

/// Its outline reaches as far as before, to within this (mm).
const SAME_OUTLINE: f64 = 0.5;

/// How a component that lies on its seat can be upside down.
pub(crate) fn flip(room: &Room) -> Option<Flip> {
    room.around(2 * AXES).into_iter().take(AXES).find_map(|axis| about(room, axis))
}

fn about(room: &Room, axis: Unit<Vector3<f64>>) -> Option<Flip> {
    let turned = Flip { point: room.centre().into(), axis: axis.into_inner().into(), lift: [0.0; 3] };
    let pose = turned.moved(&room.home());
    let same = |way: &Unit<Vector3<f64>>| {
        (room.reach_along(way, &pose) - room.reach_along(way, &room.home())).abs() < SAME_OUTLINE
    };
    // Else it lies across its place: a bar turned about its diagonal.
    if !room.around(2 * AXES).iter().all(same) {
        return None;
    }
    let lie = room.set_down(&pose).lie(false)?;
    let lies = (-LOWER..HIGHER * room.height).contains(&lie.height) && lie.tilt() < LEANS;
    let flip = Flip { lift: (room.direction() * lie.height).into(), ..turned };
    let pose = flip.moved(&room.home());
    (lies && room.clears(&pose) && room.shows(&pose)).then_some(flip)
}

impl Flip {
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(Vector3::from(self.axis)), PI);
        let to_axis = Translation3::from(Vector3::from(self.point));
        Translation3::from(Vector3::from(self.lift)) * to_axis * turn * to_axis.inverse() * pose
    }
}
