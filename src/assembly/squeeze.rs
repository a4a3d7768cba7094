//! Shafts in bores that are far too small for them.
//!
//! In: two round faces that are no fit, since one is much larger than the other. Out: by how much the full one enters the
//! hollow one, where material of both is really there: between a sleeve and what stands inside of it there is none. The
//! columns of [`meeting`](super::meeting) see rings wider than a few of their cells only; here none is too thin. A ring may be
//! open, as a circlip is.

use super::body::{Body, PlacedFace};
use super::contact::{Clash, FaceRef};
use super::matching::parallel;
use super::overlap::square_to;
use crate::solid::Surface;
use nalgebra::Point3;
use std::f64::consts::TAU;

/// Less of a common stretch of the axis (mm) is none.
const LEAST_STRETCH: f64 = 0.05;
/// Less of a ring (mm) may be the sagging of facets.
const LEAST_RING: f64 = 0.04;
/// Where material is looked for: so many places round the axis, and these shares of the ring's width and of the stretch.
const AROUND: usize = 6;
const DEEP: f64 = 0.25;
const ALONG: [f64; 3] = [0.5, 0.1, 0.9];

/// How far the full one of two cylinders enters the hollow one: in diameter, if their axes are one.
pub(crate) fn squeezed(pair: [(FaceRef, &PlacedFace); 2], bodies: [&Body; 2]) -> Option<Clash> {
    let full = usize::from(pair[1].1.outward);
    let [(shaft, f), (bore, g)] = [pair[full], pair[1 - full]];
    let (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: q, axis: m, radius: hollow }) =
        (&f.surface, &g.surface)
    else {
        return None;
    };
    if !f.outward || g.outward || !parallel(axis, m) {
        return None;
    }
    let between = q - point;
    let miss = (between - axis.into_inner() * between.dot(axis)).norm();
    let ring = radius - hollow - miss;
    let ([low, high], other) = (f.stretch?, g.stretch?);
    // Along the shaft's axis, from its point.
    let ends = other.map(|h| (q + m.into_inner() * h - point).dot(axis));
    let (low, high) = (low.max(ends[0].min(ends[1])), high.min(ends[0].max(ends[1])));
    if ring < LEAST_RING || high - low < LEAST_STRETCH {
        return None;
    }
    let (u, v) = square_to(*axis);
    let bore_axis = |h: f64| {
        let on_shaft = point + axis.into_inner() * h;
        q + m.into_inner() * (on_shaft - q).dot(m)
    };
    let place = |along: f64, k: usize| {
        let angle = (k as f64 + 0.5) * TAU / AROUND as f64;
        bore_axis(low + (high - low) * along) + (u * angle.cos() + v * angle.sin()) * (hollow + DEEP * ring)
    };
    let filled = |p: &Point3<f64>| bodies.iter().all(|body| body.solid.mesh.holds(&(body.pose.inverse() * p)));
    let mut places = ALONG.iter().flat_map(|along| (0..AROUND).map(move |k| (*along, k)));
    let depth = 2.0 * (radius - hollow);
    places.any(|(along, k)| filled(&place(along, k))).then_some(Clash { a: bore, b: shaft, depth })
}
