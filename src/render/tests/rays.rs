//! Rays against real parts: no ray slips between triangles, and the rasteriser sees what rays see.

use super::super::accel::{Accel, Corners, Ray};
use super::super::vector::Vec3;
use crate::assembly::place::place;
use crate::runtime::camera::{Camera, dot};
use crate::scene::{Body, Finish};
use crate::solid::{Quality, evaluate};
use crate::view::item_buffer::ItemBuffer;
use nalgebra::Isometry3;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A ray has to meet the surface at its target or before; behind it by more than this (share of the distance) is a leak.
const BEHIND: f32 = 2e-5;

/// The pattern wheel at its nominal sizes: slots, bores and pins, flush faces, long thin triangles.
fn wheel() -> Vec<Body> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/specs/pattern_wheel.gng");
    let loaded = crate::design::load(path, &|name| std::fs::read_to_string(name), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
    let values = design.nominal();
    let poses = place(&design, &values);
    let body = |(component, (placed, pose)): (usize, (&crate::design::model::Component, Isometry3<f64>))| {
        let part = &design.parts[placed.part];
        let finish: Finish = crate::scene::build::finish_nominal(&design.materials[part.material]);
        let solid = evaluate(part, &values, &Quality::default()).unwrap_or_else(|faults| panic!("{faults:#?}"));
        Body { mesh: Arc::new(solid.mesh), pose, finish, component, axes: Arc::default() }
    };
    design.components.iter().zip(poses).enumerate().map(body).collect()
}

fn triangles(body: &Body, shift: Vec3) -> Vec<Corners> {
    let at = |i: u32| (body.pose * body.mesh.positions[i as usize]).coords.cast::<f32>() + shift;
    body.mesh.triangles.iter().map(|t| t.map(|i| at(i).into())).collect()
}

/// Points on edges and vertices that are met from the front on all sides: a ray towards them cannot pass by.
fn targets(triangles: &[Corners], direction: Vec3) -> Vec<Vec3> {
    let key = |p: [f32; 3]| p.map(f32::to_bits);
    let front = |t: &Corners| {
        let [a, b, c] = t.map(Vec3::from);
        let normal = (b - a).cross(&(c - a));
        // Nearly edge-on triangles may turn over by rounding.
        normal.dot(&direction) < -0.02 * normal.norm()
    };
    // Per vertex and per edge: how many triangles, and whether all of them face the ray.
    let mut corners: BTreeMap<[u32; 3], (bool, Vec3)> = BTreeMap::new();
    let mut edges: BTreeMap<[[u32; 3]; 2], (usize, bool, [Vec3; 2])> = BTreeMap::new();
    for triangle in triangles {
        let faces = front(triangle);
        for k in 0..3 {
            let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
            corners.entry(key(p)).or_insert((true, p.into())).0 &= faces;
            let mut ends = [key(p), key(q)];
            ends.sort_unstable();
            let edge = edges.entry(ends).or_insert((0, true, [p.into(), q.into()]));
            (edge.0, edge.1) = (edge.0 + 1, edge.1 && faces);
        }
    }
    let on_edges = edges
        .values()
        .filter(|e| e.0 == 2 && e.1)
        .flat_map(|(_, _, [p, q])| [0.5, 0.25, 0.123].map(|along| p.lerp(q, along)));
    corners.values().filter(|c| c.0).map(|c| c.1).chain(on_edges).collect()
}

#[test]
fn no_ray_slips_between_the_triangles_of_real_parts() {
    let bodies = wheel();
    let directions = [[0.0, -0.0, -1.0], [-0.0, 0.0, 1.0], [0.3, -0.5, -0.8], [-1.0, -0.0, 0.0], [0.001, 0.7, -0.7]];
    let (mut rays, mut leaks) = (0, 0);
    for shift in [Vec3::zeros(), Vec3::new(311.0, -127.0, 53.0)] {
        for body in &bodies {
            let triangles = triangles(body, shift);
            let accel = Accel::new(&triangles);
            for direction in directions.map(|d| Vec3::from(d).normalize()) {
                for target in targets(&triangles, direction).into_iter().step_by(3) {
                    let ray = Ray { origin: target - direction * 200.0, direction, reach: f32::INFINITY };
                    let met = accel.closest(&ray, |_, _| true).is_some_and(|hit| hit.t <= 200.0 * (1.0 + BEHIND));
                    let shaded = accel.occluded(&Ray { reach: 200.0 * (1.0 + BEHIND), ..ray });
                    rays += 1;
                    leaks += usize::from(!met || !shaded);
                }
            }
        }
    }
    assert!(rays > 20_000, "the test has to shoot: {rays}");
    assert_eq!(leaks, 0, "of {rays} rays");
}

#[test]
fn the_rasteriser_sees_what_rays_see() {
    let bodies = wheel();
    let mut all = Vec::new();
    let mut owners = Vec::new();
    for body in &bodies {
        all.extend(triangles(body, Vec3::zeros()));
        owners.extend(body.mesh.faces.iter().map(|&face| (1 + body.component as u32, face)));
    }
    let accel = Accel::new(&all);
    for camera in [
        Camera { k1: -0.04, ..Camera::look_at([0.0, -155.0, 303.0], [0.0, 0.0, 12.0], 1081.0, [320, 240]) },
        Camera::look_at([0.0, 0.0, 330.0], [0.0, 0.0, 0.0], 1081.0, [320, 240]),
    ] {
        let buffer = ItemBuffer::of(&bodies, &camera);
        let (mut differ, mut covered) = (0, 0);
        for i in 0..buffer.id.len() {
            let pixel = [(i % 320) as f64 + 0.5, (i / 320) as f64 + 0.5];
            let direction = camera.ray(pixel);
            let ray = Ray {
                origin: Vec3::from(camera.position.map(|c| c as f32)),
                direction: Vec3::from(direction.map(|c| c as f32)),
                reach: f32::INFINITY,
            };
            let hit = accel.closest(&ray, |_, _| true);
            let seen = hit.map_or((0, 0), |hit| owners[hit.triangle]);
            // Flush faces are met at one depth; which of two is named is the rasteriser's rule, not the ray's.
            let depth = hit.map_or(f64::INFINITY, |hit| f64::from(hit.t) * dot(direction, camera.axes[2]));
            let flush = (depth - f64::from(buffer.depth[i])).abs() < 2e-3;
            differ += usize::from(seen != (buffer.id[i], buffer.face[i]) && !flush);
            covered += usize::from(buffer.id[i] != 0);
        }
        // 0.02 % of the pixels: those whose centre lies on an edge within the rounding of f32.
        assert!(covered > 10_000 && differ <= buffer.id.len() / 5000, "{differ} of {covered}");
    }
}
