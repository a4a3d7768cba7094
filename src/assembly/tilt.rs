//! A part that stands on something at one side.
//!
//! In: the room that the others leave a component. Out: the sides that can be up while the opposite rim stays on the seat: a
//! ring out of its groove at one side, a cover on a chip. Only for parts that rest on a seat wide compared with their height:
//! others fall over, or lie in a way of their own. A part that pins or a bore guide over a length short compared with its width
//! jams askew, as a drawer does; what holds it or lies on it is then no bar.

use super::room::Room;
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Serialize;

/// The ways in which a component can be up at one side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tilt {
    pub sides: Vec<Side>,
}

/// One side, and the opposite rim about which it is up.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Side {
    /// A point of the rim (mm, assembly's frame), and its direction: a positive turn lifts the side.
    pub point: [f64; 3],
    pub rim: [f64; 3],
    /// From the rim to the side (mm).
    pub width: f64,
    /// How far the side is up (mm).
    pub from: f64,
    pub to: f64,
}

/// Sides tried, evenly all round.
const SIDES: usize = 8;
/// The seat is at least this many times as wide as the part is high.
const WIDE: f64 = 3.0;
/// What is higher at one side than this (mm) is as easy to see.
const HIGHEST: f64 = 2.5;
/// Nor is it higher than this share of the width: it would slide off.
const STEEPEST: f64 = 0.25;
/// Heights tried.
const STEPS: usize = 4;
/// A seat has at least this many cells.
const SEAT: usize = 9;

/// What guides a part over less than this share of its seat's width does not keep it level.
const SHORT: f64 = 0.5;

/// The sides of a component that can be up by `least` mm or more. `guided` is over what length fits guide it (mm); `None` for a
/// part that lies loose.
pub(crate) fn tilt(room: &Room, least: f64, guided: Option<f64>) -> Option<Tilt> {
    let seat: Vec<Point3<f64>> = room.seat();
    if seat.len() < SEAT {
        return None;
    }
    let sides: Vec<Side> =
        room.around(SIDES).into_iter().filter_map(|up| side(room, &seat, up, least, guided)).collect();
    (!sides.is_empty()).then_some(Tilt { sides })
}

fn side(room: &Room, seat: &[Point3<f64>], up: Unit<Vector3<f64>>, least: f64, guided: Option<f64>) -> Option<Side> {
    let along = |p: &Point3<f64>| p.coords.dot(&up);
    let low = seat.iter().min_by(|a, b| along(a).total_cmp(&along(b)))?;
    let high = seat.iter().map(along).fold(f64::NEG_INFINITY, f64::max);
    let centre = room.centre();
    let width = along(&centre) + room.reach_along(&up, &room.home()) - along(low);
    let seat_width = high - along(low);
    if seat_width < WIDE * room.height || along(low) > along(&centre) {
        return None;
    }
    if guided.is_some_and(|length| length > SHORT * seat_width) {
        return None;
    }
    // The middle of the rim: nearest to the middle of the part.
    let point = low + (centre - low) - room.direction() * (centre - low).dot(&room.direction());
    let point = point + up.into_inner() * (along(low) - along(&point));
    let rim = up.cross(&room.direction());
    let all = Side { point: point.into(), rim: rim.into(), width, from: least, to: HIGHEST.min(STEEPEST * width) };
    if all.to < least {
        return None;
    }
    let heights = (0..=STEPS).map(|k| all.from + (all.to - all.from) * k as f64 / STEPS as f64);
    let to = heights.take_while(|h| guided.is_some() || room.clears(&all.up(*h, &room.home()))).last()?;
    room.shows(&all.up(to, &room.home())).then_some(Side { to, ..all })
}

impl Side {
    fn up(&self, height: f64, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let rim = Unit::new_normalize(Vector3::from(self.rim));
        let turn = UnitQuaternion::from_axis_angle(&rim, (height / self.width).asin());
        let to_rim = Translation3::from(Vector3::from(self.point));
        to_rim * turn * to_rim.inverse() * pose
    }
}

impl Tilt {
    /// The pose up at one side: `u[0]` picks how far, `u[1]` which side. With how far (mm).
    pub(crate) fn moved(&self, u: [f64; 3], pose: &Isometry3<f64>) -> (Isometry3<f64>, f64) {
        let index = (u[1] * self.sides.len() as f64) as usize;
        let Some(side) = self.sides.get(index).or(self.sides.last()) else { return (*pose, 0.0) };
        let size = side.from + (side.to - side.from) * u[0];
        (side.up(size, pose), size)
    }
}
