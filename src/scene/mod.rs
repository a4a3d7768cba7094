//! Stage 5a: an instance of the assembly, a camera and lights become a scene to look at.
//!
//! In: placed solids with sampled materials, a station. Out: [`Scene`] in the station's frame (mm). Never traces a ray.

pub mod build;
mod turning;

use crate::design::model::{Colour, Lay, MaterialKind, Tint};
use crate::solid::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// A sampled material: numbers, no ranges.
#[derive(Debug, Clone, PartialEq)]
pub struct Finish {
    pub kind: MaterialKind,
    pub n: f64,
    pub k: f64,
    /// Index under coloured light; `n` and `k` under the colours that are not listed.
    pub tints: Vec<Tint>,
    pub reflectance: f64,
    pub roughness: f64,
    /// Width of the rounding of convex edges on each face (mm).
    pub edge_break: f64,
    pub mottle: f64,
    pub mottle_size: [f64; 3],
    /// Which pattern of blotches this piece happens to have.
    pub mottle_seed: u64,
    pub lay: Option<Lay>,
}

/// A straight line in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    pub point: Point3<f64>,
    pub direction: Vector3<f64>,
}

/// One closed body.
#[derive(Debug, Clone)]
pub struct Body {
    /// In the part's own frame.
    pub mesh: Arc<TriMesh>,
    /// Part to station frame.
    pub pose: Isometry3<f64>,
    pub finish: Finish,
    /// Index of the component in the design.
    pub component: usize,
    /// The axis that each face of the mesh was turned about, in the part's frame. Empty where nobody asks: z stands in.
    pub axes: Arc<[Axis]>,
}

/// A light source. Its radiance is 1 in its own group's image; weights come afterwards, because images are linear in light.
#[derive(Debug, Clone, PartialEq)]
pub enum Emitter {
    /// A flat annulus that emits on the side of its frame's +z; the back is black and blocks light.
    Ring { frame: Isometry3<f64>, inner: f64, outer: f64 },
    /// A flat rectangle (width along x, height along y of its frame), emitting towards +z; the back is black and blocks.
    Panel { frame: Isometry3<f64>, width: f64, height: f64 },
    /// A part of the upper hemisphere at infinity: elevation (sine) and azimuth ranges in rad.
    Sky { sin_low: f64, sin_high: f64, azimuth_low: f64, azimuth_high: f64 },
}

/// An emitter and the image it contributes to.
#[derive(Debug, Clone, PartialEq)]
pub struct Lamp {
    pub name: String,
    pub emitter: Emitter,
    /// Light group: images are returned one per group.
    pub group: usize,
    pub colour: Colour,
}

/// An endless horizontal plane.
#[derive(Debug, Clone)]
pub struct Ground {
    pub z: f64,
    pub finish: Finish,
    /// Where the plate's own blotches are anchored: they do not move with the assembly.
    pub origin: Point3<f64>,
}

#[derive(Debug, Clone)]
pub struct Scene {
    pub bodies: Vec<Body>,
    pub ground: Option<Ground>,
    pub lamps: Vec<Lamp>,
    /// Number of light groups: every lamp's group is below it.
    pub groups: usize,
}
