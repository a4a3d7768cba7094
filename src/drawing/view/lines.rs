//! Lines that may be seen: sharp edges, and outlines of curved faces.
//!
//! In: a placed solid and the projection. Out: [`Line`]s in the view's frame. Edges come from the B-rep with their samples; an
//! edge over which the surface runs on smoothly is none. Outlines are where the exact normal, interpolated over each
//! triangle, turns from the viewer to away (Hertzmann and Zorin 2000): straight on cylinders and cones, smooth elsewhere.
//! Whether anything stands in front is not asked here.

use super::Item;
use super::projection::Projection;
use crate::solid::{Curve, Edge, Solid, TriMesh};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::collections::BTreeMap;

/// Faces that meet at a smaller angle than this (its cosine: 2°) run on smoothly.
const SMOOTH: f64 = 0.9994;
/// A normal this square to the view (cosine) still counts as seen: what is left after arithmetic.
const GRAZING: f64 = 1e-7;
/// Outlines are looked for just outside their face, where the chords of its own triangles cannot cover them: this far (mm), or
/// this share of the part if that is less; twice the chord height of the triangles.
const OUTSIDE: f64 = 0.02;
const OUTSIDE_SHARE: f64 = 1.2e-3;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Weight {
    /// The border of what is seen of a face.
    Wide,
    /// Between two faces that are both seen.
    Narrow,
}

/// A chain of straight pieces, in the view's frame.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub weight: Weight,
    pub points: Vec<Point3<f64>>,
    /// Where to look whether it is covered, relative to `points`.
    pub aside: Vec<Vector3<f64>>,
    /// The circle that the points lie on, where it is one.
    pub circle: Option<Circle>,
}

/// A circle in space, in the view's frame; counter-clockwise about the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Circle {
    pub centre: Point3<f64>,
    pub axis: Unit<Vector3<f64>>,
}

/// Everything of one component that may be seen.
pub(super) fn lines(item: &Item, projection: &Projection) -> Vec<Line> {
    let view = View { pose: item.pose, projection };
    let edges = item.solid.edges.iter().flat_map(|e| edge_lines(item.solid, e, &view));
    edges.chain(outlines(item.solid, &view)).collect()
}

struct View<'a> {
    pose: Isometry3<f64>,
    projection: &'a Projection,
}

impl View<'_> {
    fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.projection.point(&(self.pose * p))
    }

    fn vector(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.projection.vector(&(self.pose * v))
    }
}

/// An edge cut into stretches of one weight; stretches with no seen face beside them are left out.
fn edge_lines(solid: &Solid, edge: &Edge, view: &View) -> Vec<Line> {
    if edge.faces[0] == edge.faces[1] {
        return Vec::new();
    }
    let circle = match &edge.curve {
        Curve::Circle { centre, axis, .. } => {
            Some(Circle { centre: view.point(centre), axis: Unit::new_normalize(view.vector(axis)) })
        }
        _ => None,
    };
    let mut lines: Vec<Line> = Vec::new();
    let mut open = None;
    for pair in edge.samples.windows(2) {
        let weight = weight(solid, edge, &nalgebra::center(&pair[0], &pair[1]), view);
        match (weight, lines.last_mut()) {
            (Some(w), Some(line)) if open == Some(w) => line.points.push(view.point(&pair[1])),
            (Some(w), _) => {
                let points = vec![view.point(&pair[0]), view.point(&pair[1])];
                lines.push(Line { weight: w, points, aside: Vec::new(), circle });
            }
            (None, _) => {}
        }
        open = weight;
    }
    lines.iter_mut().for_each(|l| l.aside = vec![Vector3::zeros(); l.points.len()]);
    lines
}

/// How an edge shows at a point: not at all where both faces are turned away or run on smoothly.
fn weight(solid: &Solid, edge: &Edge, at: &Point3<f64>, view: &View) -> Option<Weight> {
    let [a, b] = edge.faces.map(|f| outward(solid, f, at));
    if a.dot(&b) > SMOOTH {
        return None;
    }
    match [a, b].map(|n| view.vector(&n).z > -GRAZING) {
        [true, true] => Some(Weight::Narrow),
        [false, false] => None,
        _ => Some(Weight::Wide),
    }
}

/// The outward unit normal of a face at a point near it.
fn outward(solid: &Solid, face: usize, at: &Point3<f64>) -> Vector3<f64> {
    let face = &solid.faces[face];
    let normal = solid.surfaces[face.surface].normal_at(at);
    if face.outward { normal } else { -normal }
}

/// Outlines of all curved faces.
fn outlines(solid: &Solid, view: &View) -> Vec<Line> {
    let mesh = &solid.mesh;
    let outside = OUTSIDE.min(OUTSIDE_SHARE * reach(mesh));
    let mut chains = Chains::default();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        let facing = mesh.normals[t].map(|n| {
            let z = view.vector(&n).z;
            if z.abs() < GRAZING { GRAZING } else { z }
        });
        if facing.iter().any(|z| (*z > 0.0) != (facing[0] > 0.0)) {
            let ends = [0, 1, 2].map(|i| crossing(mesh, t, corners, &facing, [i, (i + 1) % 3]));
            chains.add(ends.into_iter().flatten().collect());
        }
    }
    chains.finish(view, outside)
}

/// The diagonal of the box round a part (mm).
fn reach(mesh: &TriMesh) -> f64 {
    let low = mesh.positions.iter().fold(Point3::from([f64::INFINITY; 3]), |low, p| low.inf(p));
    let high = mesh.positions.iter().fold(Point3::from([f64::NEG_INFINITY; 3]), |high, p| high.sup(p));
    (high - low).norm()
}

/// A point of an outline: the side of a triangle it crosses, in which face, and where.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    key: (u32, u32, u32),
    point: Point3<f64>,
    normal: Vector3<f64>,
}

fn crossing(mesh: &TriMesh, t: usize, corners: &[u32; 3], facing: &[f64; 3], [i, j]: [usize; 2]) -> Option<Crossing> {
    if (facing[i] > 0.0) == (facing[j] > 0.0) {
        return None;
    }
    // Always from the lower index, so that both triangles of a side find the same point.
    let (i, j) = if corners[i] < corners[j] { (i, j) } else { (j, i) };
    let share = facing[i] / (facing[i] - facing[j]);
    let [p, q] = [i, j].map(|k| mesh.positions[corners[k] as usize]);
    let [m, n] = [i, j].map(|k| mesh.normals[t][k]);
    Some(Crossing {
        key: (mesh.faces[t], corners[i], corners[j]),
        point: p + (q - p) * share,
        normal: m + (n - m) * share,
    })
}

/// Pieces of outlines joined where they meet on a side of a triangle.
#[derive(Default)]
struct Chains {
    pieces: Vec<[Crossing; 2]>,
}

impl Chains {
    fn add(&mut self, ends: Vec<Crossing>) {
        if let [a, b] = ends[..] {
            self.pieces.push([a, b]);
        }
    }

    fn finish(self, view: &View, outside: f64) -> Vec<Line> {
        let mut meeting: BTreeMap<(u32, u32, u32), Vec<usize>> = BTreeMap::new();
        for (i, piece) in self.pieces.iter().enumerate() {
            piece.iter().for_each(|end| meeting.entry(end.key).or_default().push(i));
        }
        let mut used = vec![false; self.pieces.len()];
        let mut lines = Vec::new();
        for first in 0..self.pieces.len() {
            if !used[first] {
                used[first] = true;
                let [a, b] = self.pieces[first];
                let back = self.follow(a, &meeting, &mut used);
                let on = self.follow(b, &meeting, &mut used);
                let chain: Vec<Crossing> = back.into_iter().rev().chain([a, b]).chain(on).collect();
                lines.push(line(&chain, view, outside));
            }
        }
        lines
    }

    /// What comes after an end of a chain.
    fn follow(
        &self,
        from: Crossing,
        meeting: &BTreeMap<(u32, u32, u32), Vec<usize>>,
        used: &mut [bool],
    ) -> Vec<Crossing> {
        let (mut chain, mut end) = (Vec::new(), from);
        while let Some(next) = meeting[&end.key].iter().copied().find(|p| !used[*p]) {
            used[next] = true;
            let [a, b] = self.pieces[next];
            end = if a.key == end.key { b } else { a };
            chain.push(end);
        }
        chain
    }
}

fn line(chain: &[Crossing], view: &View, outside: f64) -> Line {
    let aside = chain.iter().map(|c| {
        let normal = view.vector(&c.normal);
        let flat = Vector3::new(normal.x, normal.y, 0.0);
        flat.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::zeros) * outside
    });
    Line {
        weight: Weight::Wide,
        points: chain.iter().map(|c| view.point(&c.point)).collect(),
        aside: aside.collect(),
        circle: None,
    }
}
