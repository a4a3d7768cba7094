//! Rays against triangles: the only file that knows the bounding volume hierarchy underneath.
//!
//! In: triangles in mm of the station's frame. Out: the nearest hit of a ray, or whether anything is in its way. Never
//! knows a material, a part or a lamp.
//!
//! The triangle test is the watertight one of Woop, Benthin and Wald (JCGT 2013): a ray aimed at an edge hits one of
//! the two triangles that share it. Boxes are padded, so the box test cannot lose what the triangle test would find.

use super::vector::Vec3;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::RayHit;
use obvhs::splits::split_aabbs_precise;
use obvhs::triangle::Triangle;
use std::time::Duration;

/// The corners of a triangle (mm), counter-clockwise seen from outside.
pub(super) type Corners = [[f32; 3]; 3];

/// Boxes grow by this much (mm) all round, ...
const BOX_PADDING: f32 = 2e-4;
/// ... and by this share of the largest coordinate: four roundings of an `f32`.
const BOX_PADDING_SHARE: f32 = 2.5e-7;
/// Boxes of more half area than this many mean triangle areas are split, ...
const SPLIT_ABOVE: f32 = 8.0;
/// ... if the pieces together are smaller by this factor, ...
const SPLIT_GAIN: f32 = 1.6;
/// ... each at most this many times over.
const SPLIT_ROUNDS: u32 = 5;
/// A direction component smaller than this is treated as this: keeps 0 · 1/0 out of the box test.
const LEAST_COMPONENT: f32 = 1e-18;

/// A ray; `direction` need not be a unit vector. Hits count at 0 < t < `reach`, t in units of `direction`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: Vec3,
    pub direction: Vec3,
    pub reach: f32,
}

/// The nearest hit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hit {
    pub t: f32,
    /// Index of the triangle in the list given to [`Accel::new`].
    pub triangle: usize,
    /// Weights of the three corners; they add up to 1.
    pub weights: [f32; 3],
}

/// Triangles with a hierarchy over them.
pub(super) struct Accel {
    bvh: Bvh2,
    /// In the order of the hierarchy's leaves.
    corners: Vec<Corners>,
    /// Index in the caller's list of each of `corners`.
    original: Vec<u32>,
}

impl Accel {
    /// Builds the hierarchy. Triangles with a coordinate that is not finite are left out.
    pub fn new(triangles: &[Corners]) -> Accel {
        let sound: Vec<u32> = (0..triangles.len() as u32)
            .filter(|&i| triangles[i as usize].iter().flatten().all(|c| c.is_finite()))
            .collect();
        if sound.is_empty() {
            return Accel { bvh: Bvh2::default(), corners: Vec::new(), original: Vec::new() };
        }
        let flat: Vec<Triangle> = sound.iter().map(|&i| obvhs_triangle(&triangles[i as usize])).collect();
        let (boxes, owners) = tight_boxes(&flat);
        // The builder reports its time through this; nobody reads it.
        let mut time = Duration::default();
        // A scene is built once for millions of rays.
        let bvh = build_bvh2(&boxes, BvhBuildParams::slow_build(), &mut time);
        let original: Vec<u32> = bvh.primitive_indices.iter().map(|&i| sound[owners[i as usize] as usize]).collect();
        let corners = original.iter().map(|&i| triangles[i as usize]).collect();
        Accel { bvh, corners, original }
    }

    /// The nearest triangle on the ray among those that count where it meets them (index, weights of the corners).
    pub fn closest(&self, ray: &Ray, counts: impl Fn(usize, [f32; 3]) -> bool) -> Option<Hit> {
        match Shear::longest_axis(ray.direction) {
            0 => self.closest_along::<0>(ray, counts),
            1 => self.closest_along::<1>(ray, counts),
            _ => self.closest_along::<2>(ray, counts),
        }
    }

    /// Whether any triangle is in the way.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match Shear::longest_axis(ray.direction) {
            0 => self.occluded_along::<0>(ray),
            1 => self.occluded_along::<1>(ray),
            _ => self.occluded_along::<2>(ray),
        }
    }

    fn closest_along<const AXIS: usize>(&self, ray: &Ray, counts: impl Fn(usize, [f32; 3]) -> bool) -> Option<Hit> {
        let shear = Shear::new::<AXIS>(ray);
        let mut nearest: Option<Hit> = None;
        self.bvh.ray_traverse(box_ray(ray), &mut RayHit::none(), |limited, i| {
            match shear.intersect::<AXIS>(&self.corners[i], limited.tmax) {
                Some((t, weights)) if counts(self.original[i] as usize, weights) => {
                    nearest = Some(Hit { t, triangle: self.original[i] as usize, weights });
                    t
                }
                _ => f32::INFINITY,
            }
        });
        nearest
    }

    fn occluded_along<const AXIS: usize>(&self, ray: &Ray) -> bool {
        let shear = Shear::new::<AXIS>(ray);
        !self.bvh.ray_traverse_miss(box_ray(ray), |limited, i| {
            shear.intersect::<AXIS>(&self.corners[i], limited.tmax).map_or(f32::INFINITY, |(t, _)| t)
        })
    }
}

fn obvhs_triangle(corners: &Corners) -> Triangle {
    let [v0, v1, v2] = corners.map(Vec3A::from_array);
    Triangle { v0, v1, v2 }
}

/// Boxes that cover the triangles, and which triangle each belongs to. Flat faces of machined parts come as long thin
/// triangles, whose boxes are mostly empty: those are covered by several small boxes.
fn tight_boxes(triangles: &[Triangle]) -> (Vec<Aabb>, Vec<u32>) {
    let mut boxes: Vec<Aabb> = triangles.iter().map(Triangle::aabb).collect();
    let mut owners: Vec<u32> = (0..triangles.len() as u32).collect();
    let area = |t: &Triangle| 0.5 * (t.v1 - t.v0).cross(t.v2 - t.v0).length();
    let enough = SPLIT_ABOVE * triangles.iter().map(area).sum::<f32>() / triangles.len() as f32;
    split_aabbs_precise(&mut boxes, &mut owners, triangles, enough, enough, SPLIT_GAIN, SPLIT_GAIN, SPLIT_ROUNDS, 4);
    (boxes.into_iter().map(padded).collect(), owners)
}

/// A box padded so that rounding in the box test cannot lose a hit on its boundary.
fn padded(tight: Aabb) -> Aabb {
    let pad = BOX_PADDING + BOX_PADDING_SHARE * tight.min.abs().max(tight.max.abs()).max_element();
    Aabb { min: tight.min - pad, max: tight.max + pad }
}

/// The ray for the box test. Built by hand: the reciprocal of obvhs replaces components up to 1e-7 by 1e-7, which
/// shortens the stay of a ray in a slab that it runs along; and a component of -0 must count as 0.
fn box_ray(ray: &Ray) -> obvhs::ray::Ray {
    let reciprocal = |d: f32| 1.0 / if d.abs() < LEAST_COMPONENT { LEAST_COMPONENT } else { d };
    let d = ray.direction;
    obvhs::ray::Ray {
        origin: Vec3A::new(ray.origin.x, ray.origin.y, ray.origin.z),
        direction: Vec3A::new(d.x, d.y, d.z),
        inv_direction: Vec3A::new(reciprocal(d.x), reciprocal(d.y), reciprocal(d.z)),
        tmin: 0.0,
        tmax: ray.reach,
    }
}

/// The shear that turns a ray into the axis `AXIS`: the triangle test happens in the plane across it.
struct Shear {
    origin: [f32; 3],
    across: f32,
    up: f32,
    along: f32,
}

impl Shear {
    fn longest_axis(direction: Vec3) -> usize {
        let [x, y, z] = [direction.x.abs(), direction.y.abs(), direction.z.abs()];
        if x > y && x > z {
            0
        } else if y > z {
            1
        } else {
            2
        }
    }

    fn new<const AXIS: usize>(ray: &Ray) -> Shear {
        let along = 1.0 / ray.direction[AXIS];
        Shear {
            origin: ray.origin.into(),
            across: ray.direction[(AXIS + 1) % 3] * along,
            up: ray.direction[(AXIS + 2) % 3] * along,
            along,
        }
    }

    /// (t, corner weights) of the hit at 0 < t < reach.
    #[inline(always)]
    fn intersect<const AXIS: usize>(&self, corners: &Corners, reach: f32) -> Option<(f32, [f32; 3])> {
        let a = self.transform::<AXIS>(&corners[0]);
        let b = self.transform::<AXIS>(&corners[1]);
        let c = self.transform::<AXIS>(&corners[2]);
        let mut u = c[0] * b[1] - c[1] * b[0];
        let mut v = a[0] * c[1] - a[1] * c[0];
        let mut w = b[0] * a[1] - b[1] * a[0];
        if u == 0.0 || v == 0.0 || w == 0.0 {
            // On an edge as far as f32 can tell: decide in f64, where the products are exact.
            (u, v, w) = (signed_area(c, b), signed_area(a, c), signed_area(b, a));
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        let t = (u * a[2] + v * b[2] + w * c[2]) * self.along / sum;
        // A triangle seen edge-on has sum 0 and a t that is not a number: neither comparison holds then.
        (t > 0.0 && t < reach).then(|| (t, [u / sum, v / sum, w / sum]))
    }

    #[inline(always)]
    fn transform<const AXIS: usize>(&self, p: &[f32; 3]) -> [f32; 3] {
        let (x, y) = ((AXIS + 1) % 3, (AXIS + 2) % 3);
        let z = p[AXIS] - self.origin[AXIS];
        [(p[x] - self.origin[x]) - self.across * z, (p[y] - self.origin[y]) - self.up * z, z]
    }
}

fn signed_area(a: [f32; 3], b: [f32; 3]) -> f32 {
    (f64::from(a[0]) * f64::from(b[1]) - f64::from(a[1]) * f64::from(b[0])) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    fn random_triangles(n: usize) -> Vec<Corners> {
        let mut s = Stream::new(5, "triangles", 0);
        (0..n)
            .map(|_| {
                let centre = [0; 3].map(|_| s.between(-20.0, 20.0));
                [0; 3].map(|_| [0, 1, 2].map(|i| (centre[i] + s.between(-3.0, 3.0)) as f32))
            })
            .collect()
    }

    fn brute_force(triangles: &[Corners], ray: &Ray) -> Option<f32> {
        let nearest = triangles.iter().filter_map(|c| moeller_trumbore(c, ray)).fold(f64::INFINITY, f64::min);
        nearest.is_finite().then_some(nearest as f32)
    }

    /// Another test in f64, so that the oracle shares nothing with the code under test.
    fn moeller_trumbore(corners: &Corners, ray: &Ray) -> Option<f64> {
        let [a, b, c] = corners.map(|p| nalgebra::Vector3::from(p).cast::<f64>());
        let (o, d) = (ray.origin.cast::<f64>(), ray.direction.cast::<f64>());
        let p = d.cross(&(c - a));
        let det = (b - a).dot(&p);
        let u = (o - a).dot(&p) / det;
        let q = (o - a).cross(&(b - a));
        let v = d.dot(&q) / det;
        let t = (c - a).dot(&q) / det;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < f64::from(ray.reach)).then_some(t)
    }

    fn random_direction(s: &mut Stream) -> Vec3 {
        Vec3::new(s.normal() as f32, s.normal() as f32, s.normal() as f32).normalize()
    }

    /// A sphere of latitude bands, closed, with its vertices shared bit for bit.
    fn sphere(radius: f32, bands: usize) -> Vec<Corners> {
        let point = |i: usize, j: usize| {
            let theta = std::f32::consts::PI * i as f32 / bands as f32;
            let phi = std::f32::consts::TAU * (j % (2 * bands)) as f32 / (2 * bands) as f32;
            match i {
                0 => [0.0, 0.0, radius],
                i if i == bands => [0.0, 0.0, -radius],
                _ => [radius * theta.sin() * phi.cos(), radius * theta.sin() * phi.sin(), radius * theta.cos()],
            }
        };
        let mut triangles = Vec::new();
        for i in 0..bands {
            for j in 0..2 * bands {
                let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                triangles.extend(
                    [[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[0] != t[2]),
                );
            }
        }
        triangles
    }

    #[test]
    fn agrees_with_brute_force_on_random_triangles() {
        let triangles = random_triangles(2000);
        let accel = Accel::new(&triangles);
        let mut s = Stream::new(6, "rays", 0);
        for i in 0..2000 {
            let origin = Vec3::new(0.0, 0.0, 0.0).map(|_: f32| s.between(-30.0, 30.0) as f32);
            let reach = if i % 2 == 0 { f32::INFINITY } else { s.between(1.0, 30.0) as f32 };
            let ray = Ray { origin, direction: random_direction(&mut s), reach };
            let expected = brute_force(&triangles, &ray);
            let hit = accel.closest(&ray, |_, _| true);
            assert_eq!(hit.is_some(), expected.is_some(), "ray {i}");
            assert_eq!(accel.occluded(&ray), expected.is_some(), "ray {i}");
            if let (Some(hit), Some(t)) = (hit, expected) {
                assert!((hit.t - t).abs() < 1e-3, "ray {i}: {} {t}", hit.t);
            }
        }
    }

    #[test]
    fn axis_parallel_rays_and_negative_zeros_lose_nothing() {
        let triangles = random_triangles(2000);
        let accel = Accel::new(&triangles);
        let mut s = Stream::new(7, "rays", 0);
        let components = [-1.0, -0.0, 0.0, 1.0_f32];
        let mut hits = 0;
        for direction in components.iter().flat_map(|&x| components.iter().map(move |&y| (x, y))) {
            for z in components {
                let direction = Vec3::new(direction.0, direction.1, z);
                if direction.norm() == 0.0 {
                    continue;
                }
                for _ in 0..8 {
                    let target = Vec3::zeros().map(|_: f32| s.between(-20.0, 20.0) as f32);
                    let ray = Ray { origin: target - direction * 60.0, direction, reach: f32::INFINITY };
                    let expected = brute_force(&triangles, &ray);
                    assert_eq!(accel.closest(&ray, |_, _| true).is_some(), expected.is_some(), "{direction:?}");
                    hits += usize::from(expected.is_some());
                }
            }
        }
        assert!(hits > 100, "the test has to hit something: {hits}");
    }

    #[test]
    fn rays_in_the_plane_of_a_face_find_what_stands_on_it() {
        // A long floor at z = 6 and a wall that starts there: the ray runs along the floor's plane.
        let wall = [[300.0, -1.0, 6.0], [300.0, 1.0, 6.0], [300.0, 0.0, 8.0]];
        let accel = Accel::new(&[wall]);
        for z in [0.0, -0.0] {
            let ray =
                Ray { origin: Vec3::new(-300.0, 0.0, 6.0), direction: Vec3::new(1.0, 0.0, z), reach: f32::INFINITY };
            assert_eq!(accel.closest(&ray, |_, _| true).map(|h| h.t), Some(600.0));
        }
    }

    #[test]
    fn no_ray_leaves_a_closed_mesh() {
        for radius in [0.1, 30.0, 500.0] {
            let triangles = sphere(radius, 48);
            let accel = Accel::new(&triangles);
            let mut s = Stream::new(8, "leaks", 0);
            for triangle in &triangles {
                let [a, b, c] = triangle.map(Vec3::from);
                for target in [a, a.lerp(&b, 0.5), b.lerp(&c, s.uniform() as f32), (a + b + c) / 3.0] {
                    let origin = Vec3::zeros().map(|_: f32| s.between(-0.3, 0.3) as f32 * radius);
                    let ray = Ray { origin, direction: (target - origin).normalize(), reach: f32::INFINITY };
                    assert!(
                        accel.closest(&ray, |_, _| true).is_some() && accel.occluded(&ray),
                        "radius {radius} {target:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn nothing_and_one_triangle_are_fine() {
        let ray = Ray { origin: Vec3::new(0.1, 0.1, 5.0), direction: Vec3::new(0.0, 0.0, -1.0), reach: f32::INFINITY };
        assert!(Accel::new(&[]).closest(&ray, |_, _| true).is_none());
        let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let broken = [[f32::NAN, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let hit = Accel::new(&[broken, triangle]).closest(&ray, |_, _| true).unwrap();
        assert!((hit.t - 5.0).abs() < 1e-5 && hit.triangle == 1);
        assert!((hit.weights[1] - 0.1).abs() < 1e-6 && (hit.weights[2] - 0.1).abs() < 1e-6);
    }
}
