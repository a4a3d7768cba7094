//! Stage 3: a part and a draw of its dimensions become a solid: exact faces, edges and vertices, and watertight triangles.
//!
//! In: [`crate::design::model::Part`] and one value per dimension. Out: [`Solid`] in the part's frame, or diagnostics that
//! name the features. Never a wrong solid: what fails the checks is an error.

//! Method: boundary evaluation after Requicha and Voelcker (1985), with coincident surfaces made one before anything is
//! computed. `csg` resolves the part into half-spaces over interned surfaces, `arrange` cuts the curves they share into
//! arcs and tells which bound faces, `brep` links arcs into loops and faces and checks them, `measure` integrates area
//! and volume, `mesh` triangulates.

mod arrange;
mod border;
mod brep;
mod corner;
mod csg;
mod flat;
mod intersect;
mod locus;
mod measure;
mod mesh;
mod outline;
mod primitive;
mod quality;
mod region;
mod ring;
mod roots;
mod surface;
mod tolerance;
mod touching;
mod trace;
mod traced;

#[cfg(test)]
mod tests;

use crate::design::model::{Part, Values};
use crate::diag::Diagnostic;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::f64::consts::PI;

pub use quality::Quality;
pub use region::Counts;

/// The solid of a part at these dimensions: one value per dimension, indexed by `DimId`.
///
/// Errors, each with the features it comes from: E0401 nothing is left, E0405 the part falls into pieces, E0406 features
/// meet in a curve that is neither a line nor a circle, E0407 features touch along a line only, E0408 a size or place
/// that makes no sense, E0410 the boundary cannot be closed.
pub fn evaluate(part: &Part, values: &Values, quality: &Quality) -> Result<Solid, Vec<Diagnostic>> {
    let mut tree = csg::Tree::build(part, values)?;
    let arrangement = arrange::arrange(&tree)?;
    closed(&mut tree, &arrangement, quality)
}

/// The same without triangles: for limits, of which only faces and figures are asked.
pub fn boundary(part: &Part, values: &Values, quality: &Quality) -> Result<Solid, Vec<Diagnostic>> {
    let mut tree = csg::Tree::build(part, values)?;
    let arrangement = arrange::arrange(&tree)?;
    fine_enough(quality, |quality| brep::build(&mut tree, arrangement.clone(), quality))
}

/// Faces and triangles.
fn closed(
    tree: &mut csg::Tree,
    arrangement: &arrange::Arrangement,
    quality: &Quality,
) -> Result<Solid, Vec<Diagnostic>> {
    fine_enough(quality, |quality| close(tree, arrangement, quality))
}

/// A solid with finer chords where those asked for are too coarse.
fn fine_enough(
    quality: &Quality,
    mut close: impl FnMut(&Quality) -> Result<Solid, brep::Failure>,
) -> Result<Solid, Vec<Diagnostic>> {
    let mut outcome = close(quality);
    // Chords of curves that come near each other may cross where the curves do not: shorter ones do not.
    for (chord, angle) in FINER {
        if !matches!(outcome, Err(brep::Failure::Coarse(_))) {
            break;
        }
        let finer = Quality { chord: quality.chord * chord, angle: quality.angle * angle };
        outcome = close(&finer).or(outcome);
    }
    outcome.map_err(|failure| match failure {
        brep::Failure::Certain(faults) | brep::Failure::Coarse(faults) => faults,
    })
}

/// Shares of the quality that are tried when chords are too coarse for a part.
const FINER: [(f64, f64); 3] = [(0.5, 1.0), (0.25, 0.5), (0.03, 0.5)];

/// Faces and triangles.
fn close(tree: &mut csg::Tree, arrangement: &arrange::Arrangement, quality: &Quality) -> Result<Solid, brep::Failure> {
    let mut solid = brep::build(tree, arrangement.clone(), quality)?;
    solid.mesh = mesh::triangulate(&solid, quality).map_err(|face| {
        let what = format!("`{}` cannot be filled with triangles", solid.faces[face].name);
        brep::Failure::Coarse(vec![brep::internal(tree, &what)])
    })?;
    Ok(solid)
}

/// The surface that a face of this name (`bore[2].side`, `slab.top`) lies on at these dimensions, in the part's frame;
/// `None` for a name that is no side of a feature, or where a size makes no sense.
pub fn side_at(part: &Part, values: &Values, face: &str) -> Option<Surface> {
    csg::side_at(part, values, face)
}

/// A surface without a sense: which side is material belongs to the face. All in the part's frame, mm and rad.
#[derive(Debug, Clone, PartialEq)]
pub enum Surface {
    /// Points p with `normal · p = offset`.
    Plane {
        normal: Unit<Vector3<f64>>,
        offset: f64,
    },
    Cylinder {
        point: Point3<f64>,
        axis: Unit<Vector3<f64>>,
        radius: f64,
    },
    /// The half of the double cone on the side of `axis`, seen from the apex.
    Cone {
        apex: Point3<f64>,
        axis: Unit<Vector3<f64>>,
        half_angle: f64,
    },
    Sphere {
        centre: Point3<f64>,
        radius: f64,
        /// Of its chart: a sphere is the same about any axis, so one is chosen whose poles lie far from all edges.
        axis: Unit<Vector3<f64>>,
    },
    /// A tube of radius `minor` about a circle of radius `major` round the axis. `minor` may exceed `major`, and `major`
    /// may be negative (a barrel: its profile is centred beyond the axis): then only the part whose profile lies on the
    /// near side of the axis is meant.
    Torus {
        centre: Point3<f64>,
        axis: Unit<Vector3<f64>>,
        major: f64,
        minor: f64,
    },
}

/// The curve an edge lies on.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    Line,
    /// Counter-clockwise about the axis, from the edge's start to its end.
    Circle {
        centre: Point3<f64>,
        axis: Unit<Vector3<f64>>,
        radius: f64,
    },
    /// From `major` towards `minor`, which are square to each other and as long as the half axes.
    Ellipse {
        centre: Point3<f64>,
        major: Vector3<f64>,
        minor: Vector3<f64>,
    },
    /// Any other intersection curve, as a piecewise cubic from the edge's start to its end: at the whole parameter i it
    /// passes through `points[i]` with the derivative `tangents[i]`. Both surfaces are nearer than 1e-4 mm everywhere.
    Spline {
        points: Vec<Point3<f64>>,
        tangents: Vec<Vector3<f64>>,
    },
}

/// Where two faces meet.
#[derive(Debug, Clone)]
pub struct Edge {
    pub curve: Curve,
    /// Indices into [`Solid::vertices`]; `None` twice for a closed curve without a corner.
    pub ends: [Option<usize>; 2],
    /// The two faces, indices into [`Solid::faces`] (the same twice for a seam).
    pub faces: [usize; 2],
    /// Samples from end to end, shared by both faces' triangles; a closed edge returns to its first sample.
    pub samples: Vec<Point3<f64>>,
}

#[derive(Debug, Clone)]
pub struct Face {
    /// Index into [`Solid::surfaces`].
    pub surface: usize,
    /// True when material lies on the side the surface's canonical normal points away from: that is, when the outward
    /// normal of the solid equals the canonical normal (plane: `normal`; others: away from the axis or centre).
    pub outward: bool,
    /// Loops of (edge, runs forward), the outer one first where there is one.
    pub loops: Vec<Vec<(usize, bool)>>,
    pub area: f64,
    /// Feature side the face comes from: `bore[2].side`, `slab.top`.
    pub name: String,
}

/// A B-rep with its triangles.
#[derive(Debug, Clone)]
pub struct Solid {
    pub surfaces: Vec<Surface>,
    pub faces: Vec<Face>,
    pub edges: Vec<Edge>,
    pub vertices: Vec<Point3<f64>>,
    /// Volume (mm³) and area (mm²) by the divergence theorem over the exact faces.
    pub volume: f64,
    pub area: f64,
    pub mesh: TriMesh,
}

/// Watertight triangles, counter-clockwise seen from outside.
#[derive(Debug, Clone, Default)]
pub struct TriMesh {
    pub positions: Vec<Point3<f64>>,
    /// Vertex indices per triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Outward analytic unit normals at the three corners of each triangle.
    pub normals: Vec<[Vector3<f64>; 3]>,
    /// Face of the solid each triangle belongs to.
    pub faces: Vec<u32>,
}

impl TriMesh {
    /// The mesh moved by a rigid motion.
    pub fn moved(&self, pose: &Isometry3<f64>) -> TriMesh {
        TriMesh {
            positions: self.positions.iter().map(|p| pose * p).collect(),
            triangles: self.triangles.clone(),
            normals: self.normals.iter().map(|n| n.map(|v| pose.rotation * v)).collect(),
            faces: self.faces.clone(),
        }
    }

    /// Whether the mesh, a closed one, holds a point: all around it, its triangles fill the whole sphere of directions.
    pub fn holds(&self, p: &Point3<f64>) -> bool {
        let within = |axis: usize| {
            let along = || self.positions.iter().map(|q| q[axis]);
            along().any(|v| v <= p[axis]) && along().any(|v| v >= p[axis])
        };
        (0..3).all(within) && self.triangles.iter().map(|t| self.solid_angle(t, p)).sum::<f64>() > 2.0 * PI
    }

    /// The signed solid angle of a triangle seen from a point (van Oosterom and Strackee, 1983).
    fn solid_angle(&self, triangle: &[u32; 3], p: &Point3<f64>) -> f64 {
        let [a, b, c] = triangle.map(|i| self.positions[i as usize] - p);
        let [la, lb, lc] = [a.norm(), b.norm(), c.norm()];
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    }
}
