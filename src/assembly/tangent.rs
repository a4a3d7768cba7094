//! Contacts in a line or a point: a shaft on a plate, a ball in a cone, a pin in a bore much wider than itself.
//!
//! In: two placed faces whose surfaces cannot touch over an area. Out: where they touch, and the normal there. Where they
//! could touch is worked out on the surfaces; whether both faces reach that far is read from their triangles.

use super::body::{Body, PlacedFace};
use super::boxes::{Bounds, distance_to_triangle};
use super::contact::{Contact, ContactKind, FaceRef, TOUCH};
use super::matching::parallel;
use super::overlap::square_to;
use crate::solid::Surface;
use nalgebra::{Point3, Unit, Vector3};
use std::f64::consts::TAU;

/// Where two faces touch without sharing an area.
pub(crate) struct Tangent {
    pub point: Point3<f64>,
    /// Out of the first face.
    pub normal: Unit<Vector3<f64>>,
    /// mm; negative where they enter each other.
    pub gap: f64,
}

/// Normals oppose each other when their sum is shorter than this.
const OPPOSED: f64 = 1e-3;
/// A face reaches a point that lies nearer than this (mm) to its triangles: their chords' sag, with room.
const REACHED: f64 = 0.03;
/// Points tried along a line or round a circle of contact.
const TRIED: usize = 16;

/// The first place at which two faces touch.
pub(crate) fn tangent(faces: [&PlacedFace; 2], bodies: [&Body; 2], index: [usize; 2]) -> Option<Tangent> {
    let common = faces[0].bounds.widened(REACHED).common(&faces[1].bounds.widened(REACHED));
    if (0..3).any(|i| common.low[i] > common.high[i]) {
        return None;
    }
    let flip = order(&faces[0].surface) > order(&faces[1].surface);
    let [f, g] = if flip { [faces[1], faces[0]] } else { faces };
    let touching = nearest_points(&f.surface, &g.surface, &common).into_iter().find_map(|p| {
        let gap = g.surface.distance(&p) * if g.outward { 1.0 } else { -1.0 };
        let out = |face: &PlacedFace| face.surface.normal_at(&p) * if face.outward { 1.0 } else { -1.0 };
        let opposed = (out(f) + out(g)).norm() < OPPOSED;
        let here = Bounds { low: p.coords, high: p.coords }.widened(REACHED);
        let reached =
            |k: usize| bodies[k].triangles(index[k], &here).iter().any(|t| distance_to_triangle(&p, t) < REACHED);
        let touches = gap.abs() <= TOUCH && opposed && reached(0) && reached(1);
        touches.then(|| Tangent { point: p, normal: Unit::new_normalize(out(f)), gap })
    })?;
    Some(if flip { Tangent { normal: -touching.normal, ..touching } } else { touching })
}

impl Tangent {
    pub fn contact(&self, [a, b]: [FaceRef; 2]) -> Contact {
        let height = self.point.coords.dot(&self.normal);
        Contact {
            a,
            b,
            kind: ContactKind::Tangent,
            direction: self.normal,
            point: self.point,
            area: 0.0,
            span: [height; 2],
            gap: self.gap,
            gap_range: [self.gap; 2],
            play: [self.gap; 2],
            fit: None,
            arc: 0,
            slope: 0.0,
            full: true,
        }
    }
}

/// The rounder surface is asked for its points nearest to the other.
fn order(surface: &Surface) -> u8 {
    match surface {
        Surface::Sphere { .. } => 0,
        Surface::Torus { .. } => 1,
        Surface::Cone { .. } => 2,
        Surface::Cylinder { .. } => 3,
        Surface::Plane { .. } => 4,
    }
}

/// Points of the first surface at which it could touch the second; both ways along a normal, for either may be hollow.
fn nearest_points(f: &Surface, g: &Surface, common: &Bounds) -> Vec<Point3<f64>> {
    match (f, g) {
        (Surface::Sphere { centre, radius, .. }, _) => {
            towards(g, centre).into_iter().flat_map(|n| [centre + n * *radius, centre - n * *radius]).collect()
        }
        (Surface::Torus { centre, axis, major, minor }, Surface::Plane { normal, .. }) => {
            let tube = |out: Vector3<f64>| {
                let middle = centre + out * *major;
                [middle + normal.into_inner() * *minor, middle - normal.into_inner() * *minor]
            };
            if parallel(axis, normal) {
                return round(*axis).flat_map(tube).collect();
            }
            let across = normal.into_inner() - axis.into_inner() * normal.dot(axis);
            [1.0, -1.0].iter().flat_map(|s| tube(across.normalize() * *s)).collect()
        }
        (Surface::Torus { centre, axis, major, minor }, Surface::Cylinder { axis: m, .. }) if parallel(axis, m) => {
            round(*axis).flat_map(|out| [centre + out * (major + minor), centre + out * (major - minor)]).collect()
        }
        (Surface::Cone { apex, axis, half_angle }, Surface::Plane { normal, .. }) => {
            let across = normal.into_inner() - axis.into_inner() * normal.dot(axis);
            let Some(out) = across.try_normalize(TOUCH) else { return Vec::new() };
            let rulings = [out, -out].map(|o| axis.into_inner() * half_angle.cos() + o * half_angle.sin());
            rulings.iter().flat_map(|r| along(apex, r, common)).collect()
        }
        (Surface::Cylinder { point, axis, radius }, Surface::Plane { normal, .. }) => {
            if axis.dot(normal).abs() > TOUCH {
                return Vec::new();
            }
            let foot = |s: f64| point + normal.into_inner() * (s * radius);
            [1.0, -1.0].iter().flat_map(|s| along(&foot(*s), axis, common)).collect()
        }
        (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: q, axis: m, .. }) => {
            let apart = q - point;
            if parallel(axis, m) {
                let across = apart - axis.into_inner() * apart.dot(axis);
                let Some(out) = across.try_normalize(TOUCH) else { return Vec::new() };
                return [1.0, -1.0].iter().flat_map(|s| along(&(point + out * (s * radius)), axis, common)).collect();
            }
            let square = axis.cross(m);
            let at = point + axis.into_inner() * (m.cross(&square).dot(&apart) / square.norm_squared());
            let out = square.normalize();
            vec![at + out * *radius, at - out * *radius]
        }
        _ => Vec::new(),
    }
}

/// Directions from a point to the nearest of a surface: one, or many round its axis.
fn towards(surface: &Surface, from: &Point3<f64>) -> Vec<Vector3<f64>> {
    let normal = surface.normal_at(from);
    let axis = surface.axis();
    let slant = match surface {
        Surface::Cone { half_angle, .. } => half_angle.sin(),
        _ => 0.0,
    };
    let off_axis = (from - surface.origin()).cross(&axis).norm() > TOUCH;
    match surface {
        Surface::Cylinder { .. } | Surface::Cone { .. } if !off_axis => round(axis)
            .map(|out| (out * (1.0f64 - slant * slant).sqrt() - axis.into_inner() * slant).normalize())
            .collect(),
        _ => normal.try_normalize(0.5).into_iter().collect(),
    }
}

/// Unit vectors evenly round an axis.
fn round(axis: Unit<Vector3<f64>>) -> impl Iterator<Item = Vector3<f64>> {
    let (u, v) = square_to(axis);
    (0..TRIED).map(move |k| {
        let angle = TAU * k as f64 / TRIED as f64;
        u * angle.cos() + v * angle.sin()
    })
}

/// Points of a line within a box, from its middle outwards.
fn along(point: &Point3<f64>, direction: &Vector3<f64>, within: &Bounds) -> Vec<Point3<f64>> {
    let mut stretch = [f64::NEG_INFINITY, f64::INFINITY];
    for i in 0..3 {
        let ends = [within.low[i] - TOUCH, within.high[i] + TOUCH].map(|e| (e - point[i]) / direction[i]);
        if direction[i].abs() < f64::EPSILON {
            if !(within.low[i] - TOUCH..=within.high[i] + TOUCH).contains(&point[i]) {
                return Vec::new();
            }
            continue;
        }
        stretch = [stretch[0].max(ends[0].min(ends[1])), stretch[1].min(ends[0].max(ends[1]))];
    }
    if stretch.iter().any(|t| !t.is_finite()) || stretch[0] > stretch[1] {
        return Vec::new();
    }
    let share = |k: usize| 0.5 + (k as f64 / 2.0).ceil() / TRIED as f64 * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
    (0..TRIED).map(|k| point + direction * (stretch[0] + (stretch[1] - stretch[0]) * share(k))).collect()
}
