//! Where a part's boundary goes when a dimension grows.
//!
//! In: a part at nominal and a dimension. Out: whether material is gained and lost, each with the first face where it is.
//! Points on the faces of the primitives that follow the dimension are kept when material lies on one side of them only:
//! those are on the part's boundary. Their speed along the outward direction says what becomes of the material.

use super::super::model::{DimId, Shape};
use super::super::profile::{self, Stretch};
use super::body::{Body, Leaf, Placed, Sample};
use crate::diag::Span;
use std::collections::BTreeSet;

/// How far to both sides of a face the material is asked for (mm): above the rounding of coordinates, below any wall.
const PROBE: f64 = 1e-4;
/// The share of its tolerance by which a dimension is moved to and fro.
const STEP: f64 = 0.1;
/// Speeds below this share of the greatest are rounding.
const STILL: f64 = 1e-4;
/// Points per face, unless there are too many faces.
const SAMPLES: usize = 16;
/// Membership questions to primitives per part, which bounds the time that large patterns take.
const BUDGET: usize = 10_000_000;
/// And per dimension, so that one does not take what the others need.
const BUDGET_EACH: usize = 2_000_000;

/// A face that moves, for messages.
#[derive(Debug, Clone)]
pub struct Use {
    /// `slab.top`
    pub face: String,
    pub span: Span,
}

/// What becomes of material when a dimension grows.
#[derive(Debug, Clone, Default)]
pub struct Motion {
    pub gained: Option<Use>,
    pub lost: Option<Use>,
}

/// A part at nominal, ready to be asked about many dimensions.
pub struct Nominal<'a> {
    body: Body<'a>,
    placed: Vec<Option<Placed>>,
    /// Dimensions of each leaf.
    dims: Vec<BTreeSet<DimId>>,
    radius: f64,
    /// Membership questions per dimension.
    budget: usize,
}

impl<'a> Nominal<'a> {
    /// Ready for questions about `count` dimensions.
    pub fn of(body: Body<'a>, values: &[f64], count: usize) -> Self {
        let placed = body.at(values);
        let radius = placed.iter().flatten().map(Placed::extent).fold(1.0, f64::max);
        let dims = body.leaves.iter().map(leaf_dims).collect();
        let budget = (BUDGET / count.max(1)).min(BUDGET_EACH);
        Nominal { body, placed, dims, radius, budget }
    }

    /// Moves the dimension `id` by a share of `half_width` to both sides of its nominal value, which `values` holds.
    pub fn motion(&self, id: DimId, half_width: f64, values: &mut [f64]) -> Motion {
        let moving: Vec<usize> = (0..self.dims.len()).filter(|i| self.dims[*i].contains(&id)).collect();
        let faces: usize = moving.iter().filter_map(|i| self.placed[*i].as_ref()).map(Placed::faces).sum();
        let questions = self.budget / (2 * self.body.leaves.len()).max(1);
        let count = (questions / faces.max(1)).clamp(1, SAMPLES);
        let stride = (faces * count / questions.max(1)).max(1);
        let step = half_width * STEP;
        let mut speeds: Vec<(f64, usize, usize)> = Vec::new();
        for leaf in moving.into_iter().step_by(stride) {
            self.leaf_speeds(leaf, id, step, count, values, &mut speeds);
        }
        let fastest = speeds.iter().map(|s| s.0.abs()).fold(0.0, f64::max);
        let first = |sign: f64| {
            let found = speeds.iter().find(|(speed, ..)| sign * speed > STILL * fastest)?;
            let (leaf, placed) = (&self.body.leaves[found.1], self.placed[found.1].as_ref()?);
            Some(Use { face: format!("{}.{}", leaf.name, placed.face_name(found.2)), span: leaf.span })
        };
        Motion { gained: first(1.0), lost: first(-1.0) }
    }

    /// Appends the speed at which material is gained, the leaf and the face, for the points of a leaf on the boundary.
    fn leaf_speeds(
        &self,
        leaf: usize,
        id: DimId,
        step: f64,
        count: usize,
        values: &mut [f64],
        speeds: &mut Vec<(f64, usize, usize)>,
    ) {
        let nominal = values[id.0 as usize];
        let [less, more] = [-step, step].map(|by| {
            values[id.0 as usize] = nominal + by;
            self.body.leaves[leaf].at(values)
        });
        values[id.0 as usize] = nominal;
        let (Some(less), Some(more), Some(here)) = (less, more, &self.placed[leaf]) else { return };
        if less.faces() != here.faces() || more.faces() != here.faces() {
            return;
        }
        for face in 0..here.faces() {
            for sample in here.samples(face, count, self.radius) {
                let outward = (less.distance(face, &sample.point) - more.distance(face, &sample.point)) / (2.0 * step);
                let side = if outward == 0.0 { 0.0 } else { self.material_side(&sample) };
                if side != 0.0 {
                    speeds.push((outward * side, leaf, face));
                }
            }
        }
    }

    /// +1 when material lies inside the primitive only, -1 when outside it only, 0 when the face is no boundary there.
    fn material_side(&self, sample: &Sample) -> f64 {
        let inside = |by: f64| self.body.inside(&self.placed, &(sample.point + sample.normal * by));
        match (inside(-PROBE), inside(PROBE)) {
            (true, false) => 1.0,
            (false, true) => -1.0,
            _ => 0.0,
        }
    }
}

/// Which way the area of a leaf's own outline goes with each dimension of it: grows, shrinks. Neither where it only moves.
pub fn outline_growth(leaf: &Leaf, id: DimId, half_width: f64, values: &mut [f64]) -> [bool; 2] {
    /// Growth below this share of all motion is none.
    const BALANCED: f64 = 1e-2;
    const POINTS: usize = 9;
    let nominal = values[id.0 as usize];
    let step = half_width * STEP;
    let [less, here, more] = [-step, 0.0, step].map(|by| {
        values[id.0 as usize] = nominal + by;
        leaf.own_outline(values)
    });
    values[id.0 as usize] = nominal;
    let (Some(less), Some(here), Some(more)) = (less, here, more) else { return [false; 2] };
    if less.len() != here.len() || more.len() != here.len() {
        return [false; 2];
    }
    let outwards = profile::area(&here).signum();
    let (mut gained, mut lost) = (0.0, 0.0);
    for (i, s) in here.iter().enumerate() {
        for k in 0..POINTS {
            let (p, _) = s.at((k as f64 + 0.5) / POINTS as f64);
            let weight =
                s.length() / POINTS as f64 * if matches!(leaf.shape, Shape::Revolve { .. }) { p[0] } else { 1.0 };
            let speed = outwards * (less[i].offset(p) - more[i].offset(p)) * weight;
            if speed > 0.0 { gained += speed } else { lost -= speed }
        }
    }
    let all: f64 = gained + lost;
    match () {
        () if all == 0.0 || (gained - lost).abs() < BALANCED * all => [false, false],
        () => [gained > BALANCED * all, lost > BALANCED * all],
    }
}

impl Leaf<'_> {
    fn own_outline(&self, values: &[f64]) -> Option<Vec<Stretch>> {
        match self.shape {
            Shape::Prism { outline, .. } | Shape::Revolve { outline } => profile::trace(outline, values).ok(),
            _ => None,
        }
    }

    /// Dimensions of its own sizes.
    pub fn size_dims(&self) -> BTreeSet<DimId> {
        let mut dims = Vec::new();
        self.shape.exprs().into_iter().for_each(|e| e.dims(&mut dims));
        dims.into_iter().collect()
    }

    /// Dimensions of its outline, if it has one.
    pub fn outline_dims(&self) -> BTreeSet<DimId> {
        let mut dims = Vec::new();
        if let Shape::Prism { outline, .. } | Shape::Revolve { outline } = self.shape {
            outline.exprs().into_iter().for_each(|e| e.dims(&mut dims));
        }
        dims.into_iter().collect()
    }

    /// Dimensions of the poses it stands in.
    pub fn pose_dims(&self) -> BTreeSet<DimId> {
        let mut dims = Vec::new();
        self.poses.iter().flat_map(|pose| pose.t.iter().chain(&pose.r)).for_each(|e| e.dims(&mut dims));
        dims.into_iter().collect()
    }
}

fn leaf_dims(leaf: &Leaf) -> BTreeSet<DimId> {
    let mut dims = leaf.pose_dims();
    dims.extend(leaf.size_dims());
    dims
}
