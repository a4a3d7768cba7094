//! A scene made ready for rays: one hierarchy over all bodies, the ground, the lamps, and the look of every point.
//!
//! In: [`Scene`]. Out: what a ray meets first, whether anything is between two points, and the [`Bsdf`] at a point with
//! its blotches. Never follows light further than one ray.

use super::accel::{Accel, Corners, Ray};
use super::bsdf::Bsdf;
use super::edge_break::{Beyond, passes, rounded, sides};
use super::lamp::{FlatLamp, LampHit, Sky};
use super::mottle::blotches;
use super::vector::Vec3;
use crate::design::model::{Colour, Grooves, Lay, MaterialKind};
use crate::scene::{Axis, Body, Finish, Ground, Scene};
use nalgebra::Matrix3;

/// Rays start this far (mm) off the surface along its geometric normal, ...
const LEAST_OFFSET: f32 = 1e-4;
/// ... or this share of the largest coordinate where that is more: several roundings of an `f32`.
const OFFSET_SHARE: f32 = 2e-6;
/// Shadow rays stop this share short of the lamp, so that they do not meet the lamp itself.
const SHORT_OF_LAMP: f32 = 1e-4;

pub(super) struct World {
    accel: Accel,
    triangles: Vec<Triangle>,
    corners: Vec<Corners>,
    skins: Vec<Skin>,
    ground: Option<Plane>,
    pub lamps: Vec<FlatLamp>,
    pub sky: Sky,
    /// Middle of the box round the bodies; the origin of the ground's blotches without bodies.
    pub middle: Vec3,
}

struct Triangle {
    normals: [Vec3; 3],
    /// Sides on a broken edge.
    sides: [Option<Beyond>; 3],
    skin: u32,
    /// Face of the body.
    face: u32,
}

struct Plane {
    z: f32,
    skin: Skin,
}

/// What a ray meets first.
pub(super) enum Encounter {
    Surface(Spot),
    Lamp {
        index: usize,
        hit: LampHit,
    },
    /// The dark inside of a body, reached where bodies touch.
    Inside,
    Nothing,
}

/// A point on a surface, seen from outside.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub position: Vec3,
    /// Normal of the triangle.
    pub geometric: Vec3,
    /// Normal of the surface that the triangle stands for; the ray comes from its upper side.
    pub shading: Vec3,
    /// Along the grooves of machining, not of unit length nor quite in the surface: x of the frame that the BSDF is meant in.
    pub grooves: Option<Vec3>,
    pub bsdf: Bsdf,
}

impl Spot {
    /// Where rays that leave the surface start.
    pub fn lifted(&self) -> Vec3 {
        self.position + self.geometric * LEAST_OFFSET.max(OFFSET_SHARE * self.position.amax())
    }
}

impl World {
    /// Surfaces are as they are under light of one colour.
    pub fn new(scene: &Scene, colour: Colour) -> World {
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for (skin, body) in scene.bodies.iter().enumerate() {
            add_body(body, skin as u32, &mut corners, &mut triangles);
        }
        World {
            accel: Accel::new(&corners),
            middle: middle(&corners).or(scene.ground.as_ref().map(|g| g.origin.coords.cast())).unwrap_or_default(),
            corners,
            triangles,
            skins: scene.bodies.iter().map(|body| Skin::of_body(body, colour)).collect(),
            ground: scene.ground.as_ref().map(|ground| Plane::new(ground, colour)),
            lamps: scene.lamps.iter().filter_map(FlatLamp::new).collect(),
            sky: Sky::new(&scene.lamps),
        }
    }

    /// What a ray (unit direction) meets first.
    pub fn closest(&self, ray: &Ray) -> Encounter {
        let lamp = self.lamp_ahead(ray);
        let mut reach = lamp.map_or(ray.reach, |(_, hit)| hit.t);
        let ground = self.ground.as_ref().and_then(|g| g.hit(ray)).filter(|&t| t < reach);
        reach = ground.unwrap_or(reach);
        let stands = |triangle: usize, weights: [f32; 3]| self.stands(ray.direction, triangle, weights);
        if let Some(hit) = self.accel.closest(&Ray { reach, ..*ray }, stands) {
            return self.on_body(ray, hit.triangle, hit.weights);
        }
        match (ground, lamp, &self.ground) {
            (Some(t), _, Some(plane)) => Encounter::Surface(plane.spot(ray, t)),
            (_, Some((index, hit)), _) => Encounter::Lamp { index, hit },
            _ => Encounter::Nothing,
        }
    }

    /// Whether a ray that meets a triangle meets the surface: not where it passes through what an edge's rounding took away.
    fn stands(&self, direction: Vec3, index: usize, weights: [f32; 3]) -> bool {
        let triangle = &self.triangles[index];
        let width = self.skins[triangle.skin as usize].edge_break;
        if width <= 0.0 || triangle.sides.iter().all(Option::is_none) {
            return true;
        }
        !passes(direction, self.corners[index].map(Vec3::from), weights, &triangle.sides, width)
    }

    /// The first lamp on a ray, as if there were nothing else.
    pub fn lamp_ahead(&self, ray: &Ray) -> Option<(usize, LampHit)> {
        let mut nearest: Option<(usize, LampHit)> = None;
        for (index, lamp) in self.lamps.iter().enumerate() {
            let reach = nearest.map_or(ray.reach, |(_, hit)| hit.t);
            nearest = lamp.hit(&Ray { reach, ..*ray }).map(|hit| (index, hit)).or(nearest);
        }
        nearest
    }

    /// Whether bodies or ground are in the way; lamps do not count.
    pub fn occluded_by_things(&self, ray: &Ray) -> bool {
        self.ground.as_ref().is_some_and(|g| g.hit(ray).is_some()) || self.accel.occluded(ray)
    }

    /// Whether anything is between a point and a light at `distance` in a direction.
    pub fn shadowed(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let ray = Ray { origin, direction, reach: distance * (1.0 - SHORT_OF_LAMP) };
        self.lamps.iter().any(|lamp| lamp.hit(&ray).is_some()) || self.occluded_by_things(&ray)
    }

    fn on_body(&self, ray: &Ray, index: usize, weights: [f32; 3]) -> Encounter {
        let [a, b, c] = self.corners[index].map(Vec3::from);
        let geometric = (b - a).cross(&(c - a)).normalize();
        if geometric.dot(&ray.direction) >= 0.0 {
            return Encounter::Inside;
        }
        let triangle = &self.triangles[index];
        let position = a * weights[0] + b * weights[1] + c * weights[2];
        let [p, q, r] = triangle.normals;
        let smooth = (p * weights[0] + q * weights[1] + r * weights[2]).normalize();
        let width = self.skins[triangle.skin as usize].edge_break;
        let smooth = rounded(smooth, ray.direction, [a, b, c], weights, &triangle.sides, width);
        let shading = facing(smooth, geometric, ray.direction);
        let skin = &self.skins[triangle.skin as usize];
        let grooves = skin.grooves(position, triangle.face).filter(|along| lies_in(along, shading));
        let bsdf = skin.at(position, grooves.is_some());
        Encounter::Surface(Spot { position, geometric, shading, grooves, bsdf })
    }
}

/// The shading normal bent so that the viewer is above its horizon: at silhouettes the smooth normal of a coarse mesh may
/// face away while its triangle is in view.
fn facing(smooth: Vec3, geometric: Vec3, direction: Vec3) -> Vec3 {
    const LEAST_COSINE: f32 = 1e-3;
    if smooth.dot(&geometric) <= 0.0 || !smooth.x.is_finite() {
        return geometric;
    }
    let below = smooth.dot(&direction) + LEAST_COSINE;
    if below <= 0.0 { smooth } else { (smooth - direction * below).normalize() }
}

/// Whether grooves may run along a direction: not where it leaves the surface, nor at the centre of circles.
fn lies_in(along: &Vec3, normal: Vec3) -> bool {
    /// Steeper than this (cosine from the normal), no tool leaves grooves.
    const STEEPEST: f32 = 0.95;
    along.norm() > 1e-6 && along.dot(&normal).abs() < STEEPEST * along.norm()
}

fn add_body(body: &Body, skin: u32, corners: &mut Vec<Corners>, triangles: &mut Vec<Triangle>) {
    let positions: Vec<[f32; 3]> =
        body.mesh.positions.iter().map(|p| (body.pose * p).coords.cast::<f32>().into()).collect();
    let rotation = body.pose.rotation.to_rotation_matrix();
    let sides = sides(&body.mesh, rotation.matrix());
    for (i, (indices, normals)) in body.mesh.triangles.iter().zip(&body.mesh.normals).enumerate() {
        corners.push(indices.map(|i| positions[i as usize]));
        let face = body.mesh.faces.get(i).copied().unwrap_or_default();
        triangles.push(Triangle { normals: normals.map(|n| (rotation * n).cast()), sides: sides[i], skin, face });
    }
}

fn middle(corners: &[Corners]) -> Option<Vec3> {
    let mut points = corners.iter().flatten().map(|&p| Vec3::from(p));
    let first = points.next()?;
    let (low, high) = points.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    Some((low + high) / 2.0)
}

impl Plane {
    fn new(ground: &Ground, colour: Colour) -> Plane {
        let origin = ground.origin.coords.cast();
        Plane { z: ground.z as f32, skin: Skin::new(&ground.finish, colour, Matrix3::identity(), origin, &[]) }
    }

    /// Where a ray meets the plane from above.
    fn hit(&self, ray: &Ray) -> Option<f32> {
        let t = (self.z - ray.origin.z) / ray.direction.z;
        (ray.direction.z < 0.0 && t > 0.0 && t < ray.reach).then_some(t)
    }

    fn spot(&self, ray: &Ray, t: f32) -> Spot {
        let mut position = ray.origin + ray.direction * t;
        position.z = self.z;
        let up = Vec3::z();
        let grooves = self.skin.grooves(position, 0).filter(|along| lies_in(along, up));
        let bsdf = self.skin.at(position, grooves.is_some());
        Spot { position, geometric: up, shading: up, grooves, bsdf }
    }
}

/// A finish and where its blotches are anchored.
struct Skin {
    kind: MaterialKind,
    n: f32,
    k: f32,
    reflectance: f32,
    roughness: f32,
    edge_break: f32,
    mottle: f32,
    /// Station frame to blotches: (p - origin) turned into the part's frame and divided by the blotch size.
    to_blotches: Matrix3<f32>,
    origin: Vec3,
    seed: u32,
    lines: Lines,
    /// Roughness along the lines, as a share of that across them.
    along: f32,
}

/// How grooves run, in the station's frame.
enum Lines {
    None,
    Straight(Vec3),
    /// About the axis of each face (point, direction); about the last beyond them.
    Circles(Vec<(Vec3, Vec3)>),
}

impl Lines {
    fn new(lay: Option<&Lay>, to_part: &Matrix3<f32>, origin: Vec3, axes: &[Axis]) -> Lines {
        let to_station = to_part.transpose();
        let placed = |axis: &Axis| {
            (to_station * axis.point.coords.cast::<f32>() + origin, to_station * axis.direction.cast::<f32>())
        };
        match lay.map(|lay| lay.grooves) {
            None => Lines::None,
            Some(Grooves::Straight(axis)) => Lines::Straight(to_station.column(axis.min(2)).into_owned()),
            Some(Grooves::Circular) if axes.is_empty() => {
                Lines::Circles(vec![(origin, to_station.column(2).into_owned())])
            }
            Some(Grooves::Circular) => Lines::Circles(axes.iter().map(placed).collect()),
        }
    }
}

impl Skin {
    fn of_body(body: &Body, colour: Colour) -> Skin {
        let to_part = body.pose.rotation.to_rotation_matrix().into_inner().transpose().cast();
        Skin::new(&body.finish, colour, to_part, body.pose.translation.vector.cast(), &body.axes)
    }

    fn new(finish: &Finish, colour: Colour, to_part: Matrix3<f32>, origin: Vec3, axes: &[Axis]) -> Skin {
        // A size of 0 would be noise without end: blotches smaller than a micrometre do not show.
        let scale = Vec3::from(finish.mottle_size.map(|s| 1.0 / s.abs().max(1e-3) as f32));
        let tint = finish.tints.iter().find(|t| t.colour == colour);
        let [n, k] = tint.map_or([finish.n, finish.k], |t| [t.n, t.k]);
        Skin {
            kind: finish.kind,
            n: n as f32,
            k: k as f32,
            reflectance: finish.reflectance as f32,
            roughness: finish.roughness as f32,
            edge_break: finish.edge_break as f32,
            mottle: finish.mottle as f32,
            to_blotches: Matrix3::from_diagonal(&scale) * to_part,
            origin,
            seed: (finish.mottle_seed ^ finish.mottle_seed >> 32) as u32,
            lines: Lines::new(finish.lay.as_ref(), &to_part, origin, axes),
            along: finish.lay.map_or(1.0, |lay| lay.along as f32),
        }
    }

    /// The direction of the grooves at a point of a face; zero at the centre of circles.
    fn grooves(&self, position: Vec3, face: u32) -> Option<Vec3> {
        match &self.lines {
            Lines::None => None,
            Lines::Straight(along) => Some(*along),
            Lines::Circles(axes) => {
                let (point, axis) = axes.get(face as usize).or(axes.last())?;
                Some(axis.cross(&(position - point)))
            }
        }
    }

    /// The surface at a point of the station frame, where it is grooved along x of its own frame or not.
    fn at(&self, position: Vec3, grooved: bool) -> Bsdf {
        let [light, rough] = if self.mottle > 0.0 {
            blotches(self.to_blotches * (position - self.origin), self.seed).map(|b| 1.0 + self.mottle * b)
        } else {
            [1.0, 1.0]
        };
        let reflectance = (self.reflectance * light).max(0.0);
        let alpha = (self.roughness * rough).clamp(0.0, 1.0);
        match self.kind {
            MaterialKind::Metal => {
                let alpha = if grooved { [alpha * self.along, alpha] } else { [alpha; 2] };
                Bsdf::Metal { alpha, n: self.n, k: self.k, scale: reflectance }
            }
            MaterialKind::Plastic => Bsdf::Plastic { albedo: reflectance.min(1.0), alpha: self.roughness },
            MaterialKind::Matt => Bsdf::Matt { albedo: reflectance.min(1.0) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shading_normals_keep_the_viewer_above_the_horizon() {
        let geometric = Vec3::new(0.0, 0.0, 1.0);
        for tilt in [0.0_f32, 0.02, 0.05] {
            let smooth = Vec3::new(tilt, 0.0, 1.0).normalize();
            for slope in [0.001_f32, 0.01, 0.5] {
                let direction = Vec3::new(1.0, 0.0, -slope).normalize();
                let bent = facing(smooth, geometric, direction);
                assert!(bent.dot(&direction) < 0.0 && (bent.norm() - 1.0).abs() < 1e-5, "{tilt} {slope}");
            }
        }
        assert_eq!(facing(-geometric, geometric, -geometric), geometric);
    }
}
