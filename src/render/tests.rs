//! The renderer against closed forms, against itself by other ways, and against energy.

mod rays;

use super::bsdf::Bsdf;
use super::*;
use crate::design::model::{Colour, Grooves, Lay, MaterialKind, Tint};
use crate::scene::{Body, Emitter, Finish, Ground, Lamp};
use crate::solid::TriMesh;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

fn finish(kind: MaterialKind, reflectance: f64, roughness: f64) -> Finish {
    let mottle_size = [5.0; 3];
    let [n, k, mottle, edge_break] = [0.0, 1.0, 0.0, 0.0];
    Finish {
        kind,
        n,
        k,
        tints: Vec::new(),
        reflectance,
        roughness,
        mottle,
        mottle_size,
        mottle_seed: 1,
        edge_break,
        lay: None,
    }
}

fn ground(finish: Finish) -> Option<Ground> {
    Some(Ground { z: 0.0, finish, origin: Point3::origin() })
}

/// A frame at `at` whose +z points up or down.
fn facing(at: [f64; 3], up: bool) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), if up { 0.0 } else { PI });
    Isometry3::from_parts(Translation3::from(at), turn)
}

fn lamp(emitter: Emitter, group: usize) -> Lamp {
    Lamp { name: format!("lamp {group}"), emitter, group, colour: Colour::White }
}

fn whole_sky(group: usize) -> Lamp {
    lamp(Emitter::Sky { sin_low: 0.0, sin_high: 1.0, azimuth_low: 0.0, azimuth_high: TAU }, group)
}

/// A closed cylinder about z with smooth normals on its side.
fn cylinder(radius: f64, height: f64, segments: u32) -> TriMesh {
    let mut mesh = TriMesh::default();
    let around = |i: u32| {
        let (s, c) = (TAU * f64::from(i % segments) / f64::from(segments)).sin_cos();
        Vector3::new(c, s, 0.0)
    };
    for z in [0.0, height] {
        mesh.positions.extend((0..segments).map(|i| Point3::from(around(i) * radius + Vector3::z() * z)));
        mesh.positions.push(Point3::new(0.0, 0.0, z));
    }
    let top = segments + 1;
    for i in 0..segments {
        let (j, up, down) = ((i + 1) % segments, Vector3::z(), -Vector3::z());
        let (a, b) = (around(i), around(j));
        mesh.triangles.extend([[i, j, j + top], [i, j + top, i + top]]);
        mesh.normals.extend([[a, b, b], [a, b, a]]);
        mesh.triangles.extend([[i + top, j + top, segments + top], [j, i, segments]]);
        mesh.normals.extend([[up; 3], [down; 3]]);
    }
    mesh.faces = vec![0; mesh.triangles.len()];
    mesh
}

fn body(mesh: TriMesh, at: [f64; 3], finish: Finish) -> Body {
    Body { mesh: Arc::new(mesh), pose: Translation3::from(at).into(), finish, component: 0, axes: Arc::default() }
}

/// A turned metal pin beside a matt one on mottled ground, under a ring, a panel and the sky, each in its own group.
fn small_scene() -> Scene {
    let lay = Some(Lay { grooves: Grooves::Circular, along: 0.4 });
    let metal = Finish { lay, ..finish(MaterialKind::Metal, 0.9, 0.25) };
    let plate = Finish { mottle: 0.3, ..finish(MaterialKind::Plastic, 0.4, 0.2) };
    Scene {
        bodies: vec![
            body(cylinder(6.0, 12.0, 48), [-7.0, 0.0, 0.0], Finish { mottle: 0.2, ..metal }),
            body(cylinder(4.0, 8.0, 48), [7.0, 0.0, 0.5], finish(MaterialKind::Matt, 0.7, 0.0)),
        ],
        ground: ground(plate),
        lamps: vec![
            lamp(Emitter::Ring { frame: facing([0.0, 0.0, 100.0], false), inner: 30.0, outer: 50.0 }, 0),
            lamp(Emitter::Panel { frame: facing([60.0, 0.0, 60.0], false), width: 40.0, height: 50.0 }, 1),
            whole_sky(2),
        ],
        groups: 3,
    }
}

fn small_camera() -> Camera {
    Camera::look_at([0.0, -60.0, 70.0], [0.0, 0.0, 5.0], 90.0, [32, 24])
}

/// Straight down from a height of 50 at the origin, a fraction of a degree wide.
fn narrow_camera() -> Camera {
    Camera::look_at([0.0, 0.0, 50.0], [0.0, 0.0, 0.0], 1e5, [8, 8])
}

fn mean(image: &[f32]) -> f64 {
    image.iter().map(|&v| f64::from(v)).sum::<f64>() / image.len() as f64
}

/// Mean and its standard error over renders with different seeds, per group.
fn replicated(scene: &Scene, camera: &Camera, settings: &Settings, strategy: Strategy) -> Vec<(f64, f64)> {
    let runs: Vec<LightImages> =
        (0..6).map(|seed| render_with(scene, camera, &Settings { seed, ..settings.clone() }, strategy)).collect();
    let n = runs.len() as f64;
    (0..scene.groups)
        .map(|group| {
            let means: Vec<f64> = runs.iter().map(|r| mean(&r.groups[group])).collect();
            let mean = means.iter().sum::<f64>() / n;
            (mean, (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
        })
        .collect()
}

#[test]
fn a_ring_light_on_a_matt_plane_is_its_closed_form() {
    for (inner, outer, height) in [(40.0_f64, 60.0_f64, 100.0_f64), (45.0, 75.0, 310.0)] {
        let frame = facing([0.0, 0.0, height], false);
        let scene = Scene {
            bodies: Vec::new(),
            ground: ground(finish(MaterialKind::Matt, 0.5, 0.0)),
            lamps: vec![lamp(Emitter::Ring { frame, inner, outer }, 0)],
            groups: 1,
        };
        let share = |r: f64| r * r / (r * r + height * height);
        let exact = 0.5 * (share(outer) - share(inner));
        let (mean, error) = replicated(&scene, &narrow_camera(), &Settings::exact(64, 4), Strategy::Both)[0];
        assert!((mean - exact).abs() < 4.0 * error + 1e-4 * exact, "{mean} ± {error}, exact {exact}");
        assert!((mean / exact - 1.0).abs() < 2e-3);
    }
}

#[test]
fn a_white_world_under_a_white_sky_is_white() {
    let white = finish(MaterialKind::Matt, 1.0, 0.0);
    let scene = Scene {
        // Finely cut: where smooth normals lean off their triangles some light is lost.
        bodies: vec![body(cylinder(6.0, 12.0, 128), [0.0, 0.0, 8.0], white.clone())],
        ground: ground(white),
        lamps: vec![whole_sky(0)],
        groups: 1,
    };
    // Every path that leaves brings exactly 1, so what is missing from 1 is energy lost and not noise.
    let image = render_with(&scene, &small_camera(), &Settings::exact(8, 64), Strategy::SurfacesOnly);
    assert!((mean(&image.groups[0]) - 1.0).abs() < 1e-3, "{}", mean(&image.groups[0]));
    let (mean, error) = replicated(&scene, &small_camera(), &Settings::exact(32, 64), Strategy::Both)[0];
    assert!((mean - 1.0).abs() < 4.0 * error + 1e-3, "{mean} ± {error}");
}

/// Brass is dark in blue light. Two skies of different colours over it: each image is what that colour's index alone gives.
#[test]
fn each_colour_of_light_meets_its_own_index() {
    let brass = [(Colour::Blue, 1.09, 1.83), (Colour::Red, 0.45, 3.48)];
    let tints = brass.map(|(colour, n, k)| Tint { colour, n, k }).to_vec();
    let scene = |finish: Finish, colours: &[Colour]| Scene {
        bodies: vec![body(cylinder(6.0, 12.0, 48), [0.0, 0.0, 8.0], finish.clone())],
        ground: ground(finish),
        lamps: (0..).zip(colours).map(|(group, &colour)| Lamp { colour, ..whole_sky(group) }).collect(),
        groups: colours.len(),
    };
    let metal = finish(MaterialKind::Metal, 1.0, 0.3);
    let settings = Settings::exact(4, 3);
    let both = scene(Finish { tints, ..metal.clone() }, &[Colour::Red, Colour::Blue, Colour::White]);
    let both = render(&both, &small_camera(), &settings);
    for (group, n, k) in [(0, 0.45, 3.48), (1, 1.09, 1.83), (2, metal.n, metal.k)] {
        let mut alone = scene(Finish { n, k, ..metal.clone() }, &[Colour::White; 3]);
        alone.lamps.iter_mut().for_each(|lamp| lamp.colour = Colour::White);
        assert_eq!(render(&alone, &small_camera(), &settings).groups[group], both.groups[group], "{group}");
    }
    assert!(mean(&both.groups[1]) < 0.6 * mean(&both.groups[0]), "brass is dark in blue light");
}

#[test]
fn rough_metal_under_a_white_sky_returns_its_albedo() {
    let scene = Scene {
        bodies: Vec::new(),
        ground: ground(finish(MaterialKind::Metal, 1.0, 0.3)),
        lamps: vec![whole_sky(0)],
        groups: 1,
    };
    let camera = Camera::look_at([0.0, -80.0, 60.0], [0.0; 3], 1e5, [8, 8]);
    let (mean, error) = replicated(&scene, &camera, &Settings::exact(64, 3), Strategy::Both)[0];
    let exact = albedo(Bsdf::Metal { alpha: [0.3; 2], n: 0.0, k: 1.0, scale: 1.0 }, 0.6);
    assert!((mean - exact).abs() < 4.0 * error + 1e-3, "{mean} ± {error}, by quadrature {exact}");
}

/// Share of light returned towards a viewer at `cosine`, by the midpoint rule.
fn albedo(bsdf: Bsdf, cosine: f32) -> f64 {
    let direction = |z: f32, turns: f32| {
        let (s, c) = vector::sine_cosine(turns);
        Vec3::new((1.0 - z * z).sqrt() * c, (1.0 - z * z).sqrt() * s, z)
    };
    let n = 500;
    let cell = |i: u32| {
        f64::from(
            bsdf.evaluate(
                direction(cosine, 0.0),
                direction(((i / n) as f32 + 0.5) / n as f32, (i % n) as f32 / n as f32),
            )
            .value,
        )
    };
    (0..n * n).map(cell).sum::<f64>() * TAU / f64::from(n * n)
}

#[test]
fn lamps_alone_surfaces_alone_and_both_agree() {
    let (scene, camera, settings) = (small_scene(), small_camera(), Settings::exact(64, 4));
    let [both, lamps, surfaces] = [Strategy::Both, Strategy::LampsOnly, Strategy::SurfacesOnly]
        .map(|strategy| replicated(&scene, &camera, &settings, strategy));
    for group in 0..scene.groups {
        for other in [lamps[group], surfaces[group]] {
            let (difference, error) = (both[group].0 - other.0, both[group].1.hypot(other.1));
            // The floor of 0.3 % is for an error estimated from six runs only.
            assert!(difference.abs() < 4.0 * error + 3e-3 * both[group].0, "group {group}: {both:?} {other:?}");
        }
        assert!(both[group].1 <= surfaces[group].1 * 1.5, "group {group}: {both:?} {surfaces:?}");
    }
}

#[test]
fn a_group_is_what_its_lamps_give_alone_and_the_sum_is_all_lamps_at_once() {
    let (scene, camera, settings) = (small_scene(), small_camera(), Settings::exact(8, 4));
    let apart = render(&scene, &camera, &settings);
    for group in 0..scene.groups {
        let mut alone = scene.clone();
        alone.lamps.iter_mut().for_each(|l| l.group = if l.group == group { 0 } else { usize::MAX });
        alone.groups = 1;
        assert_eq!(render(&alone, &camera, &settings).groups[0], apart.groups[group]);
    }
    let mut together = scene.clone();
    together.lamps.iter_mut().for_each(|l| l.group = 0);
    together.groups = 1;
    let sum = sensor::combine(&apart, &[1.0; 3]);
    for (a, b) in render(&together, &camera, &settings).groups[0].iter().zip(&sum) {
        assert!((a - b).abs() < 1e-4 * b.max(0.01), "{a} {b}");
    }
}

#[test]
fn the_same_bytes_at_any_number_of_threads_and_for_any_crop() {
    let (scene, camera) = (small_scene(), small_camera());
    let settings = Settings { samples: 4, seed: 5, ..Settings::default() };
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &camera, &settings))
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(3));
    let part = render(&scene, &camera, &Settings { crop: Some([3, 5, 40, 11]), ..settings.clone() });
    assert_eq!((part.crop, part.size()), ([3, 5, 32, 11], [29, 6]));
    for (row, values) in part.groups[1].chunks(29).enumerate() {
        let start = (row + 5) * 32 + 3;
        assert_eq!(values, &one.groups[1][start..start + 29]);
    }
    assert_ne!(one, render(&scene, &camera, &Settings { seed: 6, ..settings }));
}

#[test]
fn lamps_have_bodies_bright_in_front_and_black_behind() {
    let mirror = finish(MaterialKind::Metal, 1.0, 0.0);
    let panel = |up| lamp(Emitter::Panel { frame: facing([0.0, 0.0, 90.0], up), width: 80.0, height: 80.0 }, 0);
    let seen = |floor: &Finish, up| {
        let lamps = vec![panel(up), whole_sky(1)];
        let scene = Scene { bodies: Vec::new(), ground: ground(floor.clone()), lamps, groups: 2 };
        let image = render(&scene, &narrow_camera(), &Settings::exact(16, 4));
        [mean(&image.groups[0]), mean(&image.groups[1])]
    };
    let close = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() < 0.01 && (a[1] - b[1]).abs() < 0.01;
    assert!(close(seen(&mirror, false), [1.0, 0.0]), "{:?}", seen(&mirror, false));
    assert!(close(seen(&mirror, true), [0.0, 0.0]), "{:?}", seen(&mirror, true));
    // A matt floor under the black back loses the part of the sky that the panel hides: 1 - 0.1745 ... by its view factor.
    let matt = seen(&finish(MaterialKind::Matt, 1.0, 0.0), true);
    assert!(matt[0] == 0.0 && (matt[1] - (1.0 - square_view_factor(40.0, 90.0))).abs() < 0.01, "{matt:?}");
}

/// View factor from a point to a parallel square centred over it (half side `a`, distance `h`): textbook closed form.
fn square_view_factor(a: f64, h: f64) -> f64 {
    let x = a / h;
    let s = (1.0 + x * x).sqrt();
    4.0 / TAU * (2.0 * x / s * (x / s).atan())
}

#[test]
fn the_inside_of_touching_bodies_stays_dark() {
    let white = finish(MaterialKind::Matt, 1.0, 0.0);
    // The camera stands inside the cylinder.
    let scene = Scene {
        bodies: vec![body(cylinder(20.0, 100.0, 32), [0.0; 3], white.clone())],
        ground: ground(white),
        lamps: vec![whole_sky(0)],
        groups: 1,
    };
    assert!(render(&scene, &narrow_camera(), &Settings::exact(4, 8)).groups[0].iter().all(|&v| v == 0.0));
}

#[test]
fn production_settings_cost_little_energy() {
    let (scene, camera) = (small_scene(), small_camera());
    let exact = replicated(&scene, &camera, &Settings::exact(64, 4), Strategy::Both);
    let held = replicated(&scene, &camera, &Settings { samples: 64, ..Settings::default() }, Strategy::Both);
    for (a, b) in exact.iter().zip(&held) {
        assert!((b.0 / a.0 - 1.0).abs() < 0.01, "{exact:?} {held:?}");
    }
}

/// A grooved floor whose grooves run along x shines as its BSDF says in its own frame; a quarter turn further it is another.
#[test]
fn grooved_metal_returns_its_albedo_by_the_direction_of_its_grooves() {
    let seen = |axis: usize| {
        let lay = Some(Lay { grooves: Grooves::Straight(axis), along: 0.2 });
        let scene = Scene {
            bodies: Vec::new(),
            ground: ground(Finish { lay, ..finish(MaterialKind::Metal, 1.0, 0.6) }),
            lamps: vec![whole_sky(0)],
            groups: 1,
        };
        let camera = Camera::look_at([0.0, -80.0, 60.0], [0.0; 3], 1e5, [8, 8]);
        replicated(&scene, &camera, &Settings::exact(64, 3), Strategy::Both)[0]
    };
    let metal = |alpha| Bsdf::Metal { alpha, n: 0.0, k: 1.0, scale: 1.0 };
    // The viewer stands at -y: across grooves along x, along grooves along y. `albedo` looks along x of the BSDF's frame.
    for (axis, alpha) in [(0, [0.6, 0.12]), (1, [0.12, 0.6]), (2, [0.6, 0.6])] {
        let (exact, (mean, error)) = (albedo(metal(alpha), 0.6), seen(axis));
        assert!((mean - exact).abs() < 4.0 * error + 1e-3, "{axis}: {mean} ± {error}, by quadrature {exact}");
    }
}

/// Lit from one side, a turned end shows the streak of a record: bright where its grooves run across the plane of light.
#[test]
fn turned_ends_shine_in_a_streak_through_their_axis() {
    let lay = Some(Lay { grooves: Grooves::Circular, along: 0.1 });
    let disc = |lay| {
        let scene = Scene {
            bodies: vec![body(
                cylinder(20.0, 2.0, 64),
                [0.0; 3],
                Finish { lay, ..finish(MaterialKind::Metal, 1.0, 0.5) },
            )],
            ground: None,
            lamps: vec![lamp(
                Emitter::Panel { frame: facing([60.0, 0.0, 100.0], false), width: 20.0, height: 20.0 },
                0,
            )],
            groups: 1,
        };
        let camera = Camera::look_at([0.0, 0.0, 300.0], [0.0, 0.0, 2.0], 400.0, [48, 48]);
        let image = render(&scene, &camera, &Settings::exact(64, 2));
        // Half way out on the side of the lamp, and a quarter turn further.
        [[34, 24], [24, 34]].map(|[x, y]: [usize; 2]| f64::from(image.groups[0][y * 48 + x]))
    };
    let ([side, turned], [plain, plain_turned]) = (disc(lay), disc(None));
    assert!(side > 3.0 * turned && side > plain, "{side} {turned} {plain}");
    assert!(plain < 2.0 * plain_turned, "{plain} {plain_turned}");
}

/// The spread over seeds is what the spread within halves of the samples says, and falls faster than by independent draws.
#[test]
fn noise_is_known_from_replicates_and_falls_faster_than_by_chance() {
    let (scene, camera) = (small_scene(), small_camera());
    let noise = |samples: u32, seeds: std::ops::Range<u64>| {
        let runs: Vec<Vec<f32>> = seeds
            .map(|seed| {
                render(&scene, &camera, &Settings { seed, ..Settings::exact(samples, 3) }).groups.swap_remove(0)
            })
            .collect();
        let n = runs.len() as f64;
        let variance = |i: usize| {
            let mean = runs.iter().map(|r| f64::from(r[i])).sum::<f64>() / n;
            runs.iter().map(|r| (f64::from(r[i]) - mean).powi(2)).sum::<f64>() / (n - 1.0)
        };
        (0..runs[0].len()).map(variance).sum::<f64>() / runs[0].len() as f64
    };
    let (few, many, others) = (noise(4, 0..8), noise(16, 0..8), noise(16, 100..108));
    assert!((0.8..1.25).contains(&(many / others)), "{many} {others}");
    // Independent draws would leave a quarter.
    assert!(many < 0.22 * few, "{few} {many}");
}

#[test]
fn an_empty_scene_is_black() {
    let scene = Scene { bodies: Vec::new(), ground: None, lamps: Vec::new(), groups: 1 };
    let settings = Settings { samples: 0, segments: 0, ..Settings::default() };
    let image = render(&scene, &small_camera(), &settings);
    assert!(image.groups[0].len() == 32 * 24 && image.groups[0].iter().all(|&v| v == 0.0));
}
