//! A solid seen along a direction: its triangles in the plane square to it, with their depths.
//!
//! In: a solid, its rotation and a direction. Out: the triangles near a box of that plane, and whether one body can stand in
//! another's way there. Copies of a solid in the same rotation share one silhouette, whatever their places.

use super::boxes::{Bounds, BoxTree};
use super::columns::{EDGE_ON, Extent, Frame};
use crate::solid::Solid;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A triangle in the coordinates of a [`Frame`].
pub(crate) type Seen = [[f64; 3]; 3];

#[derive(Debug)]
pub(crate) struct Silhouette {
    /// Those not seen edge-on.
    triangles: Vec<Seen>,
    tree: BoxTree,
    pub extent: Extent,
    /// Of the circle round the middle of the extent that holds everything (mm).
    radius: f64,
}

/// A silhouette where its body stands.
#[derive(Debug, Clone)]
pub(crate) struct Shade {
    pub silhouette: Arc<Silhouette>,
    /// Which silhouette it is: bodies of one number differ by their place only.
    pub number: usize,
    pub shift: [f64; 3],
}

/// A solid in a rotation, by the bits of its quaternion.
type Turned = (*const Solid, [u64; 4]);

/// One shade per body.
pub(crate) fn shades(frame: &Frame, solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Vec<Shade> {
    let mut known: BTreeMap<Turned, (usize, Arc<Silhouette>)> = BTreeMap::new();
    let shade = |(solid, pose): (&Arc<Solid>, &Isometry3<f64>)| {
        let turn: [f64; 4] = pose.rotation.coords.into();
        let key = (Arc::as_ptr(solid), turn.map(f64::to_bits));
        let number = known.len();
        let make = || (number, Arc::new(Silhouette::new(frame, solid, &pose.rotation)));
        let (number, silhouette) = known.entry(key).or_insert_with(make).clone();
        let shift = frame.coordinates(&pose.translation.vector.into());
        Shade { silhouette, number, shift }
    };
    solids.iter().zip(poses).map(shade).collect()
}

impl Silhouette {
    fn new(frame: &Frame, solid: &Solid, turn: &UnitQuaternion<f64>) -> Self {
        let points: Vec<[f64; 3]> = solid.mesh.positions.iter().map(|p| frame.coordinates(&(turn * p))).collect();
        let extent = Extent::of(&points);
        let middle = [0, 1].map(|i| (extent.low[i] + extent.high[i]) / 2.0);
        let radius = points.iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(0.0, f64::max);
        let seen = solid.mesh.triangles.iter().map(|t| t.map(|i| points[i as usize]));
        let triangles: Vec<Seen> = seen.filter(|t| doubled(t).abs() >= EDGE_ON).collect();
        let tree = BoxTree::new(triangles.iter().map(flat_box).collect());
        Silhouette { triangles, tree, extent, radius }
    }
}

/// Twice the area of a triangle in the plane; positive when its upper side is seen.
pub(crate) fn doubled([a, b, c]: &Seen) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The box of a triangle in the plane; depth does not count.
fn flat_box(triangle: &Seen) -> Bounds {
    let extent = Extent::of(triangle);
    plane_box(&extent)
}

fn plane_box(extent: &Extent) -> Bounds {
    let corner = |c: &[f64; 3]| Vector3::new(c[0], c[1], 0.0);
    Bounds { low: corner(&extent.low), high: corner(&extent.high) }
}

impl Shade {
    pub fn extent(&self) -> Extent {
        let moved = |c: [f64; 3]| [0, 1, 2].map(|i| c[i] + self.shift[i]);
        Extent { low: moved(self.silhouette.extent.low), high: moved(self.silhouette.extent.high) }
    }

    /// The box of the whole in the plane.
    pub fn bounds(&self) -> Bounds {
        plane_box(&self.extent())
    }

    /// The triangles over a box of the plane.
    pub fn over(&self, extent: &Extent) -> impl Iterator<Item = Seen> + '_ {
        let by = Vector3::new(self.shift[0], self.shift[1], 0.0);
        let query = plane_box(extent);
        let found = self.silhouette.tree.meeting(&Bounds { low: query.low - by, high: query.high - by });
        found.into_iter().map(|t| self.silhouette.triangles[t].map(|p| [0, 1, 2].map(|i| p[i] + self.shift[i])))
    }

    /// Whether this body lies in a round opening of the other, or beside it: nothing of the other comes more than `rim`
    /// (mm) into the circle round this one.
    pub fn is_clear_of(&self, other: &Shade, rim: f64) -> bool {
        let extent = self.extent();
        let middle = [0, 1].map(|i| (extent.low[i] + extent.high[i]) / 2.0);
        let reach = self.silhouette.radius - rim;
        reach <= 0.0 || other.over(&extent).all(|t| distance(middle, &t) >= reach)
    }
}

/// The distance of a point of the plane from a triangle; 0 inside.
fn distance(p: [f64; 2], t: &Seen) -> f64 {
    let side = |a: &[f64; 3], b: &[f64; 3]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let edges = [(&t[0], &t[1]), (&t[1], &t[2]), (&t[2], &t[0])];
    let sense = doubled(t).signum();
    if edges.iter().all(|(a, b)| side(a, b) * sense >= 0.0) {
        return 0.0;
    }
    let to_edge = |(a, b): &(&[f64; 3], &[f64; 3])| {
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let along = ((p[0] - a[0]) * x + (p[1] - a[1]) * y) / (x * x + y * y).max(f64::MIN_POSITIVE);
        let share = along.clamp(0.0, 1.0);
        (p[0] - a[0] - share * x).hypot(p[1] - a[1] - share * y)
    };
    edges.iter().map(to_edge).fold(f64::INFINITY, f64::min)
}
