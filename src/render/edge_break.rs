//! Broken edges: no real edge is sharp, and its rounding catches light that neither face would send to the camera.
//!
//! In: a triangle mesh with its faces. Out: for every triangle the sides that lie on a convex edge between two faces, with
//! the other face's normals; the normal of the rounded surface that a ray meets; and which rays pass where the rounding took
//! material away. Shadows stay those of sharp edges.

use super::vector::Vec3;
use crate::solid::TriMesh;
use nalgebra::Matrix3;
use std::collections::BTreeMap;

/// Faces that meet at a smaller angle than this (cosine) meet smoothly.
const SMOOTH: f64 = 0.97;
/// An edge is convex where the other face falls away from this one by more than this (sine).
const FALLS_AWAY: f64 = 0.05;

/// Normals of the face beyond a side, at the side's two ends.
pub(super) type Beyond = [Vec3; 2];

/// The convex sharp sides of each triangle; side k runs from corner k to the next.
pub(super) fn sides(mesh: &TriMesh, rotation: &Matrix3<f64>) -> Vec<[Option<Beyond>; 3]> {
    let mut owner: BTreeMap<(u32, u32), (usize, usize)> = BTreeMap::new();
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for side in 0..3 {
            owner.insert((triangle[side], triangle[(side + 1) % 3]), (index, side));
        }
    }
    let of = |index: usize, side: usize| {
        let triangle = mesh.triangles[index];
        let &(other, other_side) = owner.get(&(triangle[(side + 1) % 3], triangle[side]))?;
        beyond(mesh, [index, side], [other, other_side]).map(|ends| ends.map(|n| (rotation * n).cast()))
    };
    (0..mesh.triangles.len()).map(|index| [0, 1, 2].map(|side| of(index, side))).collect()
}

fn beyond(
    mesh: &TriMesh,
    [index, side]: [usize; 2],
    [other, other_side]: [usize; 2],
) -> Option<[nalgebra::Vector3<f64>; 2]> {
    if mesh.faces[index] == mesh.faces[other] {
        return None;
    }
    // The neighbour walks the side the other way.
    let ends = [mesh.normals[other][(other_side + 1) % 3], mesh.normals[other][other_side]];
    let own = mesh.normals[index][side];
    let [a, _, c] = [0, 1, 2].map(|k| mesh.positions[mesh.triangles[index][(side + k) % 3] as usize]);
    let inward = c - a;
    let convex = ends[0].dot(&inward) < -FALLS_AWAY * inward.norm();
    (convex && own.dot(&ends[0]) < SMOOTH).then_some(ends)
}

/// The rounding of a side as a ray meets it: the edge is taken for straight, the rounding for a cylinder that touches both faces
/// `width` (mm) from it.
struct Rounding {
    /// From the cylinder's axis to where the ray meets the sharp face.
    arm: Vec3,
    /// The ray across the axis.
    across: Vec3,
    radius: f32,
    /// How far from the edge the ray meets the sharp face (mm).
    distance: f32,
}

impl Rounding {
    /// `own` is the normal of the face where it meets the triangle, `weights` are barycentric. `None` away from the edge.
    fn new(
        (direction, own): (Vec3, Vec3),
        corners: [Vec3; 3],
        weights: [f32; 3],
        (side, [from, to]): (usize, &Beyond),
        width: f32,
    ) -> Option<Rounding> {
        let line = corners[(side + 1) % 3] - corners[side];
        let length = line.norm();
        let double_area = line.cross(&(corners[(side + 2) % 3] - corners[side])).norm();
        let distance = weights[(side + 2) % 3] * double_area / length;
        if distance >= width {
            return None;
        }
        let edge = line / length;
        let along = weights[(side + 1) % 3] / (weights[side] + weights[(side + 1) % 3]).max(1e-6);
        let cosine = own.dot(&from.lerp(to, along).normalize());
        let radius = width * (1.0 + cosine) / (1.0 - cosine * cosine).max(1e-6).sqrt();
        let arm = own.cross(&edge) * (distance - width) + own * radius;
        Some(Rounding { arm, across: direction - edge * edge.dot(&direction), radius, distance })
    }

    fn is_missed(&self) -> bool {
        self.arm.cross(&self.across).norm_squared() > self.radius * self.radius * self.across.norm_squared()
    }

    /// Where the ray meets the cylinder.
    fn normal(&self) -> Vec3 {
        let [a, b] = [self.across.norm_squared(), self.arm.dot(&self.across)];
        let c = self.arm.norm_squared() - self.radius * self.radius;
        let on = (-b - (b * b - a * c).max(0.0).sqrt()) / a.max(f32::MIN_POSITIVE);
        (self.arm + self.across * on).normalize()
    }
}

/// The normal of the rounded surface that a ray meets where it meets a triangle at a point with barycentric `weights`;
/// `smooth` is that of the face. `width` (mm) is how far the rounding reaches into the face. Of two edges the nearer counts.
pub(super) fn rounded(
    smooth: Vec3,
    direction: Vec3,
    corners: [Vec3; 3],
    weights: [f32; 3],
    sides: &[Option<Beyond>; 3],
    width: f32,
) -> Vec3 {
    let convex = sides.iter().enumerate().filter_map(|(side, beyond)| Some((side, beyond.as_ref()?)));
    let met = convex.filter_map(|side| Rounding::new((direction, smooth), corners, weights, side, width));
    met.min_by(|a, b| a.distance.total_cmp(&b.distance)).map_or(smooth, |rounding| rounding.normal())
}

/// Whether a ray that meets a triangle, from either side, at a point with barycentric `weights` passes through what the
/// rounding of one of its edges took away.
pub(super) fn passes(
    direction: Vec3,
    corners: [Vec3; 3],
    weights: [f32; 3],
    sides: &[Option<Beyond>; 3],
    width: f32,
) -> bool {
    let own = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
    let mut convex = sides.iter().enumerate().filter_map(|(side, beyond)| Some((side, beyond.as_ref()?)));
    convex.any(|side| {
        Rounding::new((direction, own), corners, weights, side, width).is_some_and(|rounding| rounding.is_missed())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    /// The top (+z) and the side (+x) of a box that meet along y, and a step up from the top.
    fn corner() -> TriMesh {
        let p = |x: f64, y: f64, z: f64| Point3::new(x, y, z);
        let (z, x) = (Vector3::z(), Vector3::x());
        TriMesh {
            positions: vec![
                p(0., 0., 0.),
                p(0., 4., 0.),
                p(-4., 0., 0.),
                p(0., 0., -4.),
                p(-4., 4., 0.),
                p(-4., 4., 4.),
            ],
            triangles: vec![[0, 1, 2], [1, 0, 3], [4, 2, 1], [2, 4, 5]],
            normals: vec![[z; 3], [x; 3], [z; 3], [x; 3]],
            faces: vec![0, 1, 0, 2],
        }
    }

    #[test]
    fn only_convex_edges_between_faces_are_broken() {
        let sides = sides(&corner(), &Matrix3::identity());
        assert!(sides[0][0].is_some() && sides[1][0].is_some());
        assert!(sides[0][1].is_none(), "inside the top");
        assert!(sides[2].iter().all(Option::is_none), "the foot of the step is a corner, not an edge");
    }

    /// Seen straight from above, the normal of a quarter circle leans by what is left of the radius.
    #[test]
    fn the_normal_is_that_of_the_cylinder() {
        let mesh = corner();
        let sides = sides(&mesh, &Matrix3::identity());
        let corners = mesh.triangles[0].map(|i| mesh.positions[i as usize].coords.cast());
        let at = |distance: f32| {
            let c = distance / 4.0;
            rounded(Vec3::z(), -Vec3::z(), corners, [0.5 - c / 2.0, 0.5 - c / 2.0, c], &sides[0], 0.5)
        };
        for distance in [0.01f32, 0.1, 0.25, 0.4, 0.49] {
            assert!((at(distance).x - (0.5 - distance) / 0.5).abs() < 1e-3, "{distance}: {:?}", at(distance));
        }
        assert_eq!(at(0.6), Vec3::z());
    }

    /// A rounding of radius r draws the silhouette of a right angle in by r (sin θ + cos θ - 1), seen from θ above; what enters
    /// at the top and passes leaves at the side.
    #[test]
    fn a_rounding_draws_the_silhouette_in() {
        let mesh = corner();
        let sides = sides(&mesh, &Matrix3::identity());
        let corners = |i: usize| mesh.triangles[i].map(|i| mesh.positions[i as usize].coords.cast());
        let radius = 0.5f32;
        for degrees in [20.0f32, 45.0, 60.0, 80.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let limit = radius * (sin + cos - 1.0) / sin;
            let passes = |triangle: usize, distance: f32| {
                let c = distance / 4.0;
                let weights = [0.5 - c / 2.0, 0.5 - c / 2.0, c];
                passes(Vec3::new(cos, 0.0, -sin), corners(triangle), weights, &sides[triangle], radius)
            };
            assert!(passes(0, 0.98 * limit) && passes(1, 0.98 * limit * sin / cos), "behind the edge");
            assert!(!passes(0, 1.02 * limit) && !passes(1, 1.02 * limit * sin / cos), "meets the rounding");
            assert!(!passes(0, 1.5 * radius), "meets the face");
        }
    }
}
