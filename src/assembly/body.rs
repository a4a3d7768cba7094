//! Solids placed in the assembly, ready to be asked which faces and triangles lie near a box.
//!
//! In: one solid and one pose per component. Out: faces with their surfaces and boxes in the assembly's frame, and the
//! triangles of a face within a box. What copies of one solid have in common is worked out once and shared, so memory
//! grows with the number of faces placed and with the triangles of distinct solids only.

use super::boxes::{Bounds, BoxTree};
use super::sides::moved;
use crate::solid::{Curve, Face, Solid, Surface};
use nalgebra::{Isometry3, Point3, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A component's faces in the assembly's frame.
pub(crate) struct Body {
    pub solid: Arc<Solid>,
    pub faces: Vec<PlacedFace>,
    pub bounds: Bounds,
    pub pose: Isometry3<f64>,
    /// Which solid it is: bodies of one number differ by their pose only.
    pub number: usize,
    blank: Arc<Blank>,
}

pub(crate) struct PlacedFace {
    pub surface: Surface,
    pub outward: bool,
    pub bounds: Bounds,
    /// Of a cylinder all the way round between two planes square to it: its ends along the axis, from the surface's point
    /// (mm).
    pub ring: Option<[f64; 2]>,
    /// The ends of any cylinder, whole or not, along its axis (mm from its point).
    pub stretch: Option<[f64; 2]>,
}

/// What all copies of a solid share, in its own frame.
struct Blank {
    faces: Vec<BlankFace>,
}

struct BlankFace {
    /// Indices into the mesh's triangles.
    triangles: Vec<u32>,
    bounds: Bounds,
    /// Over the boxes of the triangles, of faces with many.
    tree: Option<BoxTree>,
    ring: Option<[f64; 2]>,
    stretch: Option<[f64; 2]>,
}

/// Stances that differ by less than this (mm, or half an angle in rad) are one.
const SAME_STANCE: f64 = 1e-9;
/// Faces with more triangles than this are searched by a tree.
const MANY: usize = 256;
/// Circles whose axis differs from a cylinder's by less than this (sine) are square to it.
const SQUARE: f64 = 1e-9;

/// One body per component.
pub(crate) fn placed(solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Vec<Body> {
    let mut blanks: BTreeMap<*const Solid, (usize, Arc<Blank>)> = BTreeMap::new();
    let body = |(solid, pose): (&Arc<Solid>, &Isometry3<f64>)| {
        let number = blanks.len();
        let make = || (number, Arc::new(Blank::new(solid)));
        Body::new(solid, pose, blanks.entry(Arc::as_ptr(solid)).or_insert_with(make).clone())
    };
    solids.iter().zip(poses).map(body).collect()
}

impl Body {
    fn new(solid: &Arc<Solid>, pose: &Isometry3<f64>, (number, blank): (usize, Arc<Blank>)) -> Self {
        let shifted_only = pose.rotation.angle() == 0.0;
        let place = |(face, own): (&Face, &BlankFace)| {
            let by = pose.translation.vector;
            let bounds = if shifted_only {
                Bounds { low: own.bounds.low + by, high: own.bounds.high + by }
            } else {
                let points: Vec<Point3<f64>> = own.corners(solid).map(|p| pose * p).collect();
                Bounds::of(&points)
            };
            PlacedFace {
                surface: moved(&solid.surfaces[face.surface], pose),
                outward: face.outward,
                bounds,
                ring: own.ring,
                stretch: own.stretch,
            }
        };
        let faces: Vec<PlacedFace> = solid.faces.iter().zip(&blank.faces).map(place).collect();
        let bounds = faces.iter().fold(Bounds::EMPTY, |b, f| b.around(&f.bounds));
        Body { solid: solid.clone(), faces, bounds, pose: *pose, number, blank }
    }

    /// Whether a face has so many triangles that laying them over others' is work.
    pub fn is_broad(&self, face: usize) -> bool {
        self.blank.faces[face].tree.is_some()
    }

    /// How another body stands to this one, to within rounding.
    pub fn stance(&self, other: &Body) -> [i64; 7] {
        let between = self.pose.inv_mul(&other.pose);
        let (t, r) = (between.translation.vector, between.rotation.coords);
        [t.x, t.y, t.z, r.x, r.y, r.z, r.w].map(|v| (v / SAME_STANCE).round() as i64)
    }

    /// The triangles of a face that come near a box, in the assembly's frame.
    pub fn triangles(&self, face: usize, near: &Bounds) -> Vec<[Point3<f64>; 3]> {
        let own = &self.blank.faces[face];
        let place =
            |t: u32| self.solid.mesh.triangles[t as usize].map(|i| self.pose * self.solid.mesh.positions[i as usize]);
        match &own.tree {
            None => own.triangles.iter().map(|t| place(*t)).collect(),
            Some(tree) => {
                let near = turned(near, &self.pose.inverse());
                tree.meeting(&near).into_iter().map(|k| place(own.triangles[k])).collect()
            }
        }
    }
}

/// A box round a box that was moved.
fn turned(bounds: &Bounds, pose: &Isometry3<f64>) -> Bounds {
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { bounds.low[axis] } else { bounds.high[axis] };
        pose * Point3::new(pick(0), pick(1), pick(2))
    };
    Bounds::of(&(0..8).map(corner).collect::<Vec<_>>())
}

impl Blank {
    fn new(solid: &Solid) -> Self {
        let mut triangles = vec![Vec::new(); solid.faces.len()];
        for (index, face) in solid.mesh.faces.iter().enumerate() {
            triangles[*face as usize].push(index as u32);
        }
        let face = |(face, triangles)| BlankFace::new(solid, face, triangles);
        Blank { faces: solid.faces.iter().zip(triangles).map(face).collect() }
    }
}

impl BlankFace {
    fn new(solid: &Solid, face: &Face, triangles: Vec<u32>) -> Self {
        let mut own = BlankFace {
            triangles,
            bounds: Bounds::EMPTY,
            tree: None,
            ring: ring(solid, face),
            stretch: stretch(solid, face),
        };
        own.bounds = own
            .corners(solid)
            .fold(Bounds::EMPTY, |b, p| Bounds { low: b.low.inf(&p.coords), high: b.high.sup(&p.coords) });
        if own.triangles.len() > MANY {
            let bounds =
                |t: &u32| Bounds::of(&solid.mesh.triangles[*t as usize].map(|i| solid.mesh.positions[i as usize]));
            own.tree = Some(BoxTree::new(own.triangles.iter().map(bounds).collect()));
        }
        own
    }

    fn corners<'a>(&'a self, solid: &'a Solid) -> impl Iterator<Item = Point3<f64>> + 'a {
        self.triangles.iter().flat_map(|t| solid.mesh.triangles[*t as usize].map(|i| solid.mesh.positions[i as usize]))
    }
}

/// The ends of a cylinder that is whole all the way round; see [`PlacedFace::ring`].
fn ring(solid: &Solid, face: &Face) -> Option<[f64; 2]> {
    let Surface::Cylinder { point, axis, .. } = &solid.surfaces[face.surface] else { return None };
    let [first, second] = face.loops.as_slice() else { return None };
    let height = |edges: &Vec<(usize, bool)>| -> Option<f64> {
        let [(edge, _)] = edges.as_slice() else { return None };
        let edge = &solid.edges[*edge];
        let Curve::Circle { centre, axis: own, .. } = &edge.curve else { return None };
        let square = edge.ends == [None, None] && own.cross(axis).norm() < SQUARE;
        square.then(|| (centre - point).dot(axis))
    };
    let (low, high) = (height(first)?, height(second)?);
    Some([low.min(high), low.max(high)])
}

/// From where to where along its axis a cylinder reaches; see [`PlacedFace::stretch`].
fn stretch(solid: &Solid, face: &Face) -> Option<[f64; 2]> {
    let Surface::Cylinder { point, axis, .. } = &solid.surfaces[face.surface] else { return None };
    let samples = face.loops.iter().flatten().flat_map(|(edge, _)| &solid.edges[*edge].samples);
    let heights = samples.map(|p| (p - point).dot(axis));
    heights.fold(None, |ends: Option<[f64; 2]>, h| Some(ends.map_or([h; 2], |[low, high]| [low.min(h), high.max(h)])))
}

/// The middle of what two boxes share.
pub(crate) fn middle(a: &Bounds, b: &Bounds) -> Point3<f64> {
    let centre: Vector3<f64> = a.common(b).centre();
    Point3::from(centre)
}
