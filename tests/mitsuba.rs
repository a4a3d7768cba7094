//! The renderer against Mitsuba 3: seven small scenes, each with direct light only, with one interreflection, with all.
//!
//! The scenes and Mitsuba's figures are in `oracle/mitsuba`, made once by `scenes.py` there. Held are the mean of the
//! image and the means of its twelve blocks. `cargo test --test mitsuba -- --nocapture` prints the ratios.
//!
//! Nothing is left out. Where the two do not model the same, the difference is far below what is held:
//! - Our Smith term is height-correlated, Mitsuba's separable. Theirs is ours divided by 1 + Λi Λo / (1 + Λi + Λo): less
//!   than 1.0001 on the top of the plate in b, about 1.01 on the sides of the step in e, and more than 1.01 on the sphere
//!   in d only where it is seen at less than 8°, on 2 % of its disc. On the grooved metal of f and g, which lamps alone
//!   light, it is less than 1.002 where it shines.
//! - Our floor is endless and our room ends at the horizon. Mitsuba's floor ends 20 m away and its room goes on below,
//!   which fills 1/1000 rad under the horizon.
//! - Our ring is round, Mitsuba's has 256 corners: ours gets the same area. Our spheres are cut into triangles with the
//!   normals of the sphere.

#![cfg(feature = "compile")]

use gonogo::design::model::{Colour, Grooves, Lay, MaterialKind};
use gonogo::render::{Settings, render};
use gonogo::runtime::camera::Camera;
use gonogo::scene::{Body, Emitter, Finish, Ground, Lamp, Scene};
use gonogo::solid::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Relative difference of the mean of an image, over what noise explains.
const MEAN: f64 = 0.003;
/// The same of a block.
const BLOCK: f64 = 0.01;
/// Standard errors that noise may explain: 195 figures are compared, each beyond 4 with a probability of 6e-5.
const SIGMAS: f64 = 4.0;
/// Samples per pixel of each of two renders.
const SAMPLES: u32 = 256;
/// Longest path where Mitsuba has no longest: the albedo is at most 0.8, and only in corners do paths live on.
const ENDLESS: u32 = 48;
/// Rings of triangles from pole to pole of a sphere; twice as many around. The chord is 3e-4 of the radius off.
const RINGS: u32 = 128;

#[derive(Deserialize)]
struct Scenes {
    image: [u32; 2],
    scenes: BTreeMap<String, Setup>,
}

#[derive(Deserialize)]
struct Setup {
    title: String,
    camera: View,
    objects: Vec<Thing>,
    lights: Vec<Light>,
}

#[derive(Deserialize)]
struct View {
    at: [f64; 3],
    /// Columns: right, up, back.
    #[serde(rename = "R")]
    turn: [[f64; 3]; 3],
    f: f64,
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Thing {
    Floor {
        z: f64,
        material: Material,
    },
    Sphere {
        center: [f64; 3],
        d: f64,
        material: Material,
    },
    /// Turned by degrees about x, then y, then z.
    Box {
        size: [f64; 3],
        at: [f64; 3],
        turn: [f64; 3],
        material: Material,
    },
    /// A cylinder that stands on z = 0 of its frame.
    Pin {
        at: [f64; 3],
        d: f64,
        h: f64,
        material: Material,
    },
    /// A rectangle about the origin of its frame, facing +z.
    Sheet {
        size: [f64; 2],
        at: [f64; 3],
        turn: [f64; 3],
        material: Material,
    },
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Material {
    Diffuse {
        albedo: f64,
    },
    Conductor {
        n: f64,
        k: f64,
        alpha: f64,
    },
    /// With grooves: circles on a pin, lines along x on a sheet.
    Grooved {
        n: f64,
        k: f64,
        along: f64,
        across: f64,
    },
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Light {
    Quad { at: [f64; 3], aim: [f64; 3], width: f64, height: f64, radiance: f64 },
    Annulus { center: [f64; 3], normal: [f64; 3], inner: f64, outer: f64, segments: u32, radiance: f64 },
    Environment { radiance: f64 },
}

/// Mean radiance of an image and of its blocks, with standard errors.
#[derive(Deserialize)]
struct Figures {
    mean: f64,
    se: f64,
    blocks: [[f64; 4]; 3],
    blocks_se: [[f64; 4]; 3],
}

#[test]
fn images_converge_to_those_of_mitsuba() {
    let scenes: Scenes = serde_json::from_str(include_str!("oracle/mitsuba/scenes.json")).unwrap();
    let figures: BTreeMap<String, BTreeMap<String, Figures>> =
        serde_json::from_str(include_str!("oracle/mitsuba/figures.json")).unwrap();
    let mut off = Vec::new();
    println!("scene depth  mean: ratio    ±   | blocks: lowest highest");
    for (name, setup) in &scenes.scenes {
        for (depth, theirs) in &figures[name] {
            let segments = depth.parse().unwrap_or(ENDLESS);
            let ours = measure(setup, scenes.image, segments);
            report(name, depth, &ours, theirs);
            off.extend(differences(&ours, theirs).map(|d| format!("{name} ({}), depth {depth}: {d}", setup.title)));
        }
    }
    assert!(off.is_empty(), "{}", off.join("\n"));
}

fn report(name: &str, depth: &str, ours: &Figures, theirs: &Figures) {
    let blocks = ours.blocks.as_flattened().iter().zip(theirs.blocks.as_flattened()).map(|(a, b)| a / b);
    let (low, high) = blocks.fold((f64::MAX, f64::MIN), |(low, high), r| (low.min(r), high.max(r)));
    let error = ours.se.hypot(theirs.se) / theirs.mean;
    println!("{name:5} {depth:5}  {:10.5} {error:.5} | {low:14.4} {high:7.4}", ours.mean / theirs.mean);
}

/// What differs by more than noise and the tolerance.
fn differences(ours: &Figures, theirs: &Figures) -> impl Iterator<Item = String> {
    let image = ("image".to_owned(), MEAN, [ours.mean, theirs.mean], ours.se.hypot(theirs.se));
    let block = |i: usize| {
        let [means, errors] = [[&ours.blocks, &theirs.blocks], [&ours.blocks_se, &theirs.blocks_se]]
            .map(|both| both.map(|blocks| blocks.as_flattened()[i]));
        (format!("block {i}"), BLOCK, means, errors[0].hypot(errors[1]))
    };
    let all = std::iter::once(image).chain((0..12).map(block)).collect::<Vec<_>>();
    all.into_iter().filter_map(|(what, share, [ours, theirs], error)| {
        let off = (ours - theirs).abs() > share * theirs + SIGMAS * error;
        off.then(|| format!("{what} is {ours:.6}, Mitsuba has {theirs:.6}, ± {error:.6} both"))
    })
}

/// Two renders with seeds of their own: their mean, and from their differences the error of it.
fn measure(setup: &Setup, [width, height]: [u32; 2], segments: u32) -> Figures {
    let (scene, camera) = (scene(setup), camera(&setup.camera, [width, height]));
    let [a, b] = [1, 2].map(|seed| {
        let images = render(&scene, &camera, &Settings { seed, ..Settings::exact(SAMPLES, segments) });
        let weighted = |pixel: usize| {
            let groups = setup.lights.iter().zip(&images.groups);
            groups.map(|(light, image)| light.radiance() * f64::from(image[pixel])).sum::<f64>()
        };
        (0..(width * height) as usize).map(weighted).collect::<Vec<f64>>()
    });
    // Pixels are independent of each other.
    let over = |x: std::ops::Range<u32>, y: std::ops::Range<u32>| {
        let n = f64::from(x.len() as u32 * y.len() as u32);
        let pixels = || y.clone().flat_map(|y| x.clone().map(move |x| (y * width + x) as usize));
        let mean = pixels().map(|i| a[i] + b[i]).sum::<f64>() / (2.0 * n);
        let error = pixels().map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt() / (2.0 * n);
        [mean, error]
    };
    let (w, h) = (width / 4, height / 3);
    let block = |i: u32, j: u32| over(j * w..(j + 1) * w, i * h..(i + 1) * h);
    let [mean, se] = over(0..width, 0..height);
    let [blocks, blocks_se] = [0, 1].map(|k| [0, 1, 2].map(|i| [0, 1, 2, 3].map(|j| block(i, j)[k])));
    Figures { mean, se, blocks, blocks_se }
}

fn camera(view: &View, size: [u32; 2]) -> Camera {
    let column = |j: usize, sign: f64| [0, 1, 2].map(|i| sign * view.turn[i][j]);
    Camera {
        position: view.at,
        axes: [column(0, 1.0), column(1, -1.0), column(2, -1.0)],
        focal: view.f,
        centre: size.map(|n| f64::from(n) / 2.0),
        k1: 0.0,
        k2: 0.0,
        size,
    }
}

fn scene(setup: &Setup) -> Scene {
    let lamps: Vec<Lamp> = setup.lights.iter().enumerate().map(|(group, light)| light.lamp(group)).collect();
    Scene {
        bodies: setup.objects.iter().filter_map(Thing::body).collect(),
        ground: setup.objects.iter().find_map(Thing::ground),
        groups: lamps.len(),
        lamps,
    }
}

impl Thing {
    fn body(&self) -> Option<Body> {
        let turned =
            |[x, y, z]: [f64; 3]| UnitQuaternion::from_euler_angles(x.to_radians(), y.to_radians(), z.to_radians());
        let (mesh, pose, finish) = match self {
            Thing::Floor { .. } => return None,
            Thing::Sphere { center, d, material } => {
                (ball(d / 2.0), Translation3::from(*center).into(), material.finish())
            }
            Thing::Box { size, at, turn, material } => {
                (block(*size), Isometry3::from_parts(Translation3::from(*at), turned(*turn)), material.finish())
            }
            Thing::Pin { at, d, h, material } => {
                let finish = material.grooved(Grooves::Circular);
                (pin(d / 2.0, *h), Translation3::from(*at).into(), finish)
            }
            Thing::Sheet { size, at, turn, material } => {
                let finish = material.grooved(Grooves::Straight(0));
                (sheet(*size), Isometry3::from_parts(Translation3::from(*at), turned(*turn)), finish)
            }
        };
        Some(Body { mesh: Arc::new(mesh), pose, finish, component: 0, axes: Arc::default() })
    }

    fn ground(&self) -> Option<Ground> {
        let Thing::Floor { z, material } = self else { return None };
        Some(Ground { z: *z, finish: material.finish(), origin: Point3::origin() })
    }
}

impl Material {
    fn finish(&self) -> Finish {
        let (kind, n, k, reflectance, roughness) = match *self {
            Material::Diffuse { albedo } => (MaterialKind::Matt, 1.0, 0.0, albedo, 0.0),
            Material::Conductor { n, k, alpha } => (MaterialKind::Metal, n, k, 1.0, alpha),
            Material::Grooved { n, k, across, .. } => (MaterialKind::Metal, n, k, 1.0, across),
        };
        let ([edge_break, mottle], mottle_size) = ([0.0; 2], [1.0; 3]);
        Finish {
            kind,
            n,
            k,
            tints: Vec::new(),
            reflectance,
            roughness,
            edge_break,
            mottle,
            mottle_size,
            mottle_seed: 0,
            lay: None,
        }
    }

    fn grooved(&self, grooves: Grooves) -> Finish {
        let lay = match *self {
            Material::Grooved { along, across, .. } => Some(Lay { grooves, along: along / across }),
            _ => None,
        };
        Finish { lay, ..self.finish() }
    }
}

impl Light {
    fn radiance(&self) -> f64 {
        match self {
            Light::Quad { radiance, .. } | Light::Annulus { radiance, .. } | Light::Environment { radiance } => {
                *radiance
            }
        }
    }

    fn lamp(&self, group: usize) -> Lamp {
        let emitter = match *self {
            Light::Quad { at, aim, width, height, .. } => {
                let frame = Isometry3::face_towards(&at.into(), &aim.into(), &Vector3::z());
                Emitter::Panel { frame, width, height }
            }
            Light::Annulus { center, normal, inner, outer, segments, .. } => {
                let at = Point3::from(center);
                let frame = Isometry3::face_towards(&at, &(at + Vector3::from(normal)), &Vector3::y());
                let corner = TAU / f64::from(segments);
                let [inner, outer] = [inner, outer].map(|r| r * (corner.sin() / corner).sqrt());
                Emitter::Ring { frame, inner, outer }
            }
            Light::Environment { .. } => {
                Emitter::Sky { sin_low: 0.0, sin_high: 1.0, azimuth_low: 0.0, azimuth_high: TAU }
            }
        };
        Lamp { name: format!("lamp {group}"), emitter, group, colour: Colour::White }
    }
}

/// A box centred in x and y that stands on z = 0.
fn block([x, y, z]: [f64; 3]) -> TriMesh {
    let corner = |i: u32| [i & 1, i >> 1 & 1, i >> 2].map(f64::from);
    let positions = (0..8).map(corner).map(|[i, j, k]| Point3::new((i - 0.5) * x, (j - 0.5) * y, k * z)).collect();
    let mut mesh = TriMesh { positions, ..TriMesh::default() };
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for (face, [a, b, c, d]) in sides.into_iter().enumerate() {
        let [p, q, r] = [a, b, c].map(|i: u32| mesh.positions[i as usize]);
        let normal = (q - p).cross(&(r - p)).normalize();
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
        mesh.normals.extend([[normal; 3]; 2]);
        mesh.faces.extend([face as u32; 2]);
    }
    mesh
}

/// A rectangle about the origin that faces +z.
fn sheet([x, y]: [f64; 2]) -> TriMesh {
    let positions = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    TriMesh {
        positions: positions.iter().map(|[i, j]| Point3::new(i * x / 2.0, j * y / 2.0, 0.0)).collect(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: vec![[Vector3::z(); 3]; 2],
        faces: vec![0; 2],
    }
}

/// Side and top of a cylinder that stands on z = 0.
fn pin(radius: f64, height: f64) -> TriMesh {
    /// The chord is 2e-5 of the radius off.
    const AROUND: u32 = 512;
    let out = |i: u32| {
        let (s, c) = (TAU * f64::from(i % AROUND) / f64::from(AROUND)).sin_cos();
        Vector3::new(c, s, 0.0)
    };
    let mut mesh = TriMesh { positions: vec![Point3::new(0.0, 0.0, height)], ..TriMesh::default() };
    for i in 0..AROUND {
        mesh.positions.extend([0.0, height].map(|z| Point3::from(out(i) * radius + Vector3::z() * z)));
        let [a, b] = [i, (i + 1) % AROUND].map(|i| 1 + 2 * i);
        mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1], [0, a + 1, b + 1]]);
        let [n, m] = [out(i), out(i + 1)];
        mesh.normals.extend([[n, m, m], [n, m, n], [Vector3::z(); 3]]);
        mesh.faces.extend([0, 0, 1]);
    }
    mesh
}

/// A sphere about the origin with its own normals.
fn ball(radius: f64) -> TriMesh {
    let around = 2 * RINGS;
    let direction = |i: u32, j: u32| {
        let (s, c) = (PI * f64::from(i) / f64::from(RINGS)).sin_cos();
        let (y, x) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
        Vector3::new(s * x, s * y, c)
    };
    // The poles, then the circles of latitude between them.
    let circles = (1..RINGS).flat_map(|i| (0..around).map(move |j| direction(i, j)));
    let directions: Vec<Vector3<f64>> = [Vector3::z(), -Vector3::z()].into_iter().chain(circles).collect();
    let vertex = |i: u32, j: u32| match i {
        0 => 0,
        RINGS => 1,
        _ => 2 + (i - 1) * around + j % around,
    };
    let cell = |i: u32, j: u32| {
        let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
        [(i + 1 < RINGS).then_some([a, b, c]), (i > 0).then_some([a, c, d])]
    };
    let cells = (0..RINGS).flat_map(|i| (0..around).flat_map(move |j| cell(i, j)));
    let triangles: Vec<[u32; 3]> = cells.flatten().collect();
    TriMesh {
        positions: directions.iter().map(|d| Point3::from(d * radius)).collect(),
        normals: triangles.iter().map(|t| t.map(|i| directions[i as usize])).collect(),
        faces: vec![0; triangles.len()],
        triangles,
    }
}
