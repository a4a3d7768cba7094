//! A part put down beside its place.
//!
//! In: the room that the others leave a component, and the zone in which it may lie. Out: the ways along the seat on which
//! it then lies as low as it should, from well outside its zone up to where something stops it. Decided by solids, so loose
//! pegs and studs count, and a part held by a fit has no way to go.

use super::room::Room;
use nalgebra::{Isometry3, Translation3, Unit, Vector3};
use serde::Serialize;

/// The ways in which a component can lie beside its place.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Shift {
    pub ways: Vec<Way>,
}

/// A way along the seat.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Way {
    /// Unit vector (assembly's frame).
    pub direction: [f64; 3],
    /// Distances from its place (mm).
    pub from: f64,
    pub to: f64,
}

/// Ways tried, evenly all round.
const WAYS: usize = 8;
/// A part is beside its place from this many half widths of its zone on.
const ZONES: f64 = 3.0;
/// What lies this far (mm) beside its place is as easy to see as what lies farther: of a large part a share of its reach,
/// but no farther than [`FAR`].
const NEAR: f64 = 4.0;
const SHARE_OF_REACH: f64 = 0.15;
pub(crate) const FAR: f64 = 8.0;
/// Distances tried along a way.
const STEPS: usize = 6;
/// The ways of a component by `least` mm or more; `zone` tells the half width of its zone along a direction (mm).
pub(crate) fn shift(room: &Room, zone: &dyn Fn(&Vector3<f64>) -> f64, least: f64) -> Option<Shift> {
    let ways = room.around(WAYS).into_iter().filter_map(|d| way(room, d, least.max(ZONES * zone(&d))));
    let ways: Vec<Way> = ways.collect();
    (!ways.is_empty()).then_some(Shift { ways })
}

fn way(room: &Room, direction: Unit<Vector3<f64>>, from: f64) -> Option<Way> {
    let far = (SHARE_OF_REACH * room.reach).clamp(NEAR, FAR).max(from);
    let at = |distance: f64| Translation3::from(direction.into_inner() * distance) * room.home();
    let stays = |distance: &f64| {
        let pose = at(*distance);
        room.clears(&pose) && room.bears(&pose)
    };
    let steps = (0..=STEPS).map(|k| from + (far - from) * k as f64 / STEPS as f64);
    let to = steps.take_while(stays).last()?;
    room.shows(&at(to)).then(|| Way { direction: direction.into_inner().into(), from, to })
}

impl Shift {
    /// The pose beside a component's own: `u[0]` picks the distance, `u[1]` the way. With the distance (mm).
    pub(crate) fn moved(&self, u: [f64; 3], pose: &Isometry3<f64>) -> (Isometry3<f64>, f64) {
        let index = (u[1] * self.ways.len() as f64) as usize;
        let Some(way) = self.ways.get(index).or(self.ways.last()) else { return (*pose, 0.0) };
        let size = way.from + (way.to - way.from) * u[0];
        (Translation3::from(Vector3::from(way.direction) * size) * pose, size)
    }
}
