//! Closed meshes and cameras for this stage's tests.

use crate::design::model::MaterialKind;
use crate::runtime::camera::Camera;
use crate::scene::{Body, Finish};
use crate::solid::TriMesh;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A box standing on z = 0, centred in x and y; faces: 0 bottom, 1 top, 2 -y, 3 +x, 4 +y, 5 -x.
pub fn block([x, y, z]: [f64; 3]) -> TriMesh {
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        Point3::new(side(0) * x, side(1) * y, (side(2) + 0.5) * z)
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
    let mut mesh = TriMesh { positions: (0..8).map(corner).collect(), ..TriMesh::default() };
    for (face, [a, b, c, d]) in quads.into_iter().enumerate() {
        push(&mut mesh, [a, b, c], face as u32);
        push(&mut mesh, [a, c, d], face as u32);
    }
    mesh
}

/// A prism with `sides` sides standing on z = 0; faces: 0 bottom, 1 top, 2 side.
pub fn cylinder(d: f64, h: f64, sides: u32) -> TriMesh {
    let rim = |z: f64| {
        (0..sides).map(move |k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            Point3::new(d / 2.0 * cos, d / 2.0 * sin, z)
        })
    };
    let mut mesh = TriMesh { positions: rim(0.0).chain(rim(h)).collect(), ..TriMesh::default() };
    for k in 0..sides {
        let next = (k + 1) % sides;
        push(&mut mesh, [k, next, sides + next], 2);
        push(&mut mesh, [k, sides + next, sides + k], 2);
        if k >= 1 && k + 1 < sides {
            push(&mut mesh, [0, k + 1, k], 0);
            push(&mut mesh, [sides, sides + k, sides + k + 1], 1);
        }
    }
    mesh
}

pub fn body(component: usize, mesh: TriMesh, pose: Isometry3<f64>) -> Body {
    let finish = Finish {
        kind: MaterialKind::Matt,
        n: 1.5,
        k: 0.0,
        tints: Vec::new(),
        reflectance: 0.5,
        roughness: 0.5,
        edge_break: 0.0,
        mottle: 0.0,
        mottle_size: [1.0; 3],
        mottle_seed: 0,
        lay: None,
    };
    Body { mesh: Arc::new(mesh), pose, finish, component, axes: Arc::default() }
}

pub fn placed(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

/// Straight above the origin at `height` mm, x right, y up in the image; `focal` in px.
pub fn overhead(size: [u32; 2], focal: f64, height: f64) -> Camera {
    Camera::look_at([0.0, 0.0, height], [0.0; 3], focal, size)
}

fn push(mesh: &mut TriMesh, corners: [u32; 3], face: u32) {
    let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
    let normal: Vector3<f64> = (b - a).cross(&(c - a)).normalize();
    mesh.triangles.push(corners);
    mesh.normals.push([normal; 3]);
    mesh.faces.push(face);
}
