//! The paths along which components go in.
//!
//! In: solids, where they stand assembled and how far they are moved apart, their contacts. Out: straight lines in the
//! assembly's frame, each drawn once where components share one.

use crate::assembly::liaison::Liaison;
use crate::solid::Solid;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::sync::Arc;

/// Lines nearer to each other than this (mm) are one, and axes this parallel (sine).
const SAME: f64 = 1e-3;
/// A component that moves less than this (mm) has no path.
const STILL: f64 = 1e-6;

/// A stretch of a line: from where to where along a direction through a point.
struct Track {
    foot: Point3<f64>,
    along: Unit<Vector3<f64>>,
    reach: [f64; 2],
}

/// From where each component rests to where it is drawn: through the axis of the fit it goes into, where it has but one,
/// else through its middle.
pub(super) fn paths(
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
    shifts: &[Vector3<f64>],
    liaison: &Liaison,
) -> Vec<[Point3<f64>; 2]> {
    let mut tracks: Vec<Track> = Vec::new();
    for (c, shift) in shifts.iter().enumerate().filter(|(_, s)| s.norm() > STILL) {
        let along = Unit::new_normalize(*shift);
        let through = axis(liaison, c, along).unwrap_or_else(|| middle(&solids[c], &poses[c]));
        let foot = through - along.into_inner() * through.coords.dot(&along);
        let points = solids[c].mesh.positions.iter().map(|p| (poses[c] * p).coords.dot(&along));
        let low = points.fold(f64::INFINITY, f64::min);
        add(&mut tracks, Track { foot, along, reach: [low, low + shift.norm()] });
    }
    let ends = |t: &Track| t.reach.map(|s| t.foot + t.along.into_inner() * s);
    tracks.iter().map(ends).collect()
}

/// A point on the only axis of the fits that guide a component along a direction.
fn axis(liaison: &Liaison, component: usize, along: Unit<Vector3<f64>>) -> Option<Point3<f64>> {
    let guides: Vec<_> = liaison.of(component).filter(|c| c.sideways_span(along).is_some()).collect();
    let first = guides.first()?;
    let off = |p: &Point3<f64>| (p - first.point).cross(&along).norm();
    guides.iter().all(|c| off(&c.point) < SAME).then_some(first.point)
}

/// The middle of the box round a placed solid, square to the assembly's axes.
fn middle(solid: &Solid, pose: &Isometry3<f64>) -> Point3<f64> {
    let points = || solid.mesh.positions.iter().map(|p| pose * p);
    let low = points().fold(Point3::from([f64::INFINITY; 3]), |low, p| low.inf(&p));
    let high = points().fold(Point3::from([f64::NEG_INFINITY; 3]), |high, p| high.sup(&p));
    nalgebra::center(&low, &high)
}

/// Adds a track, or lengthens the one on the same line.
fn add(tracks: &mut Vec<Track>, new: Track) {
    let same = |t: &&mut Track| {
        t.along.cross(&new.along).norm() < SAME
            && t.along.dot(&new.along) > 0.0
            && (t.foot - new.foot).norm() < SAME
            && t.reach[0] <= new.reach[1]
            && new.reach[0] <= t.reach[1]
    };
    match tracks.iter_mut().find(same) {
        Some(track) => track.reach = [track.reach[0].min(new.reach[0]), track.reach[1].max(new.reach[1])],
        None => tracks.push(new),
    }
}
