//! The lines along which an assembly comes apart: from each fit to the feature it belongs to.
//!
//! In: solids, where they stand assembled, how far each is moved, their contacts. Out: straight lines in the assembly's frame,
//! each drawn once where several share an axis.

use crate::assembly::contact::Contact;
use crate::assembly::liaison::Liaison;
use crate::solid::Solid;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::sync::Arc;

/// Lines nearer to each other than this (mm) are one, and axes this parallel (sine).
const SAME: f64 = 1e-3;
/// What moves less than this (mm) does not move.
const STILL: f64 = 1e-6;

/// A stretch of a line: from where to where along a direction through a point.
struct Track {
    foot: Point3<f64>,
    along: Unit<Vector3<f64>>,
    reach: [f64; 2],
}

impl Track {
    /// From `low` to `high` along `along` (mm from the origin), through a point.
    fn new(through: &Point3<f64>, along: Unit<Vector3<f64>>, reach: [f64; 2]) -> Track {
        Track { foot: through - along.into_inner() * through.coords.dot(&along), along, reach }
    }

    fn meets(&self, other: &Track) -> bool {
        self.along.dot(&other.along) > 0.0
            && self.along.cross(&other.along).norm() < SAME
            && (self.foot - other.foot).norm() < SAME
            && self.reach[0] <= other.reach[1]
            && other.reach[0] <= self.reach[1]
    }
}

/// A line along the axis of every fit that is pulled apart, from its one surface to its other; for what moves without such a
/// fit, a line through its middle. `poses` and `shifts` hold one entry per component, as `solids` does.
pub(super) fn paths(
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
    shifts: &[Vector3<f64>],
    liaison: &Liaison,
) -> Vec<[Point3<f64>; 2]> {
    let mut tracks: Vec<Track> = Vec::new();
    let mut guided = vec![false; shifts.len()];
    for contact in &liaison.contacts {
        if let Some(track) = pulled_apart(contact, shifts) {
            [contact.a, contact.b].iter().for_each(|f| guided[f.component] = true);
            add(&mut tracks, track);
        }
    }
    for c in (0..shifts.len()).filter(|c| !guided[*c] && shifts[*c].norm() > STILL) {
        add(&mut tracks, lifted(&solids[c], &poses[c], &shifts[c]));
    }
    let ends = |t: &Track| t.reach.map(|s| t.foot + t.along.into_inner() * s);
    tracks.iter().map(ends).collect()
}

/// The axis of a fit between components that move apart along it.
fn pulled_apart(contact: &Contact, shifts: &[Vector3<f64>]) -> Option<Track> {
    let [a, b] = [contact.a, contact.b].map(|f| shifts[f.component]);
    let along = Unit::try_new(b - a, STILL)?;
    let along = if along.dot(&contact.direction) < 0.0 { -along } else { along };
    let [low, high] = contact.sideways_span(along)?;
    let (a, b) = (a.dot(&along), b.dot(&along));
    Some(Track::new(&contact.point, along, [low + a.min(b), high + a.max(b)]))
}

/// The line through the middle of what is moved, as far as it is moved.
fn lifted(solid: &Solid, pose: &Isometry3<f64>, shift: &Vector3<f64>) -> Track {
    let along = Unit::new_normalize(*shift);
    let points = || solid.mesh.positions.iter().map(|p| pose * p);
    let low = points().fold(Point3::from([f64::INFINITY; 3]), |low, p| low.inf(&p));
    let high = points().fold(Point3::from([f64::NEG_INFINITY; 3]), |high, p| high.sup(&p));
    let from = points().map(|p| p.coords.dot(&along)).fold(f64::INFINITY, f64::min);
    Track::new(&nalgebra::center(&low, &high), along, [from, from + shift.norm()])
}

/// Adds a track, or lengthens the one on the same line.
fn add(tracks: &mut Vec<Track>, mut new: Track) {
    while let Some(at) = tracks.iter().position(|t| t.meets(&new)) {
        let old = tracks.remove(at);
        new.reach = [old.reach[0].min(new.reach[0]), old.reach[1].max(new.reach[1])];
    }
    tracks.push(new);
}
