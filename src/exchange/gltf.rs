//! glTF 2.0, binary (`.glb`): the assembly in triangles, for viewers.
//!
//! In: a [`Kit`] and, for an exploded view, how far every component is moved. Out: the bytes of a file: one mesh per part, one
//! node per component under a root that turns z up into the y up of glTF and mm into m. Never exact: that is what STEP is for.

use super::json::{array, numbers, object, string};
use super::{Kit, KitPart, Paint};
use crate::solid::TriMesh;
use nalgebra::{Isometry3, Vector3};
use std::collections::BTreeMap;

/// Metres in a millimetre.
const METRE: f64 = 1e-3;

/// Codes of the standard.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// The file; component i is moved by `offsets[i]` (mm, in the assembly's frame), one without an entry not at all.
pub fn assembly(kit: &Kit, offsets: &[Vector3<f64>]) -> Vec<u8> {
    let mut buffer = Buffer::default();
    let paints = paints(kit);
    let material = |paint: &Paint| paints.iter().position(|p| p == paint).unwrap_or(0);
    let meshes: Vec<String> = kit.parts.iter().map(|p| mesh(p, material(&p.paint), &mut buffer)).collect();
    let moved = |i: usize| offsets.get(i).copied().unwrap_or_else(Vector3::zeros);
    let components = kit.placed.iter().enumerate().map(|(i, c)| {
        let pose = nalgebra::Translation3::from(moved(i)) * c.pose;
        object(&[("name", string(&c.name)), ("mesh", c.part.to_string()), ("matrix", matrix(&pose))])
    });
    let nodes = array(std::iter::once(root(kit)).chain(components));
    let generator = string(concat!("gonogo ", env!("CARGO_PKG_VERSION")));
    let json = object(&[
        ("asset", object(&[("version", string("2.0")), ("generator", generator)])),
        ("scene", "0".into()),
        ("scenes", array([object(&[("name", string(&kit.name)), ("nodes", "[0]".into())])])),
        ("nodes", nodes),
        ("meshes", array(meshes)),
        ("materials", array(paints.iter().map(look))),
        ("accessors", array(buffer.accessors)),
        ("bufferViews", array(buffer.views)),
        ("buffers", array([object(&[("byteLength", buffer.bytes.len().to_string())])])),
    ]);
    pack(json.into_bytes(), buffer.bytes)
}

/// Header, JSON filled up with spaces, bytes filled up with zeros.
fn pack(mut json: Vec<u8>, mut bytes: Vec<u8>) -> Vec<u8> {
    json.resize(json.len().next_multiple_of(4), b' ');
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let length = 12 + 8 + json.len() + 8 + bytes.len();
    let mut file = Vec::with_capacity(length);
    let word = |n: usize| (n as u32).to_le_bytes();
    file.extend(b"glTF");
    file.extend(word(2));
    file.extend(word(length));
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bytes)] {
        file.extend(word(chunk.len()));
        file.extend(kind);
        file.extend(chunk);
    }
    file
}

/// Different looks, in order of their first part.
fn paints(kit: &Kit) -> Vec<Paint> {
    let mut paints: Vec<Paint> = Vec::new();
    for part in &kit.parts {
        if !paints.contains(&part.paint) {
            paints.push(part.paint);
        }
    }
    paints
}

fn look(paint: &Paint) -> String {
    let [r, g, b] = paint.rgb;
    let surface = object(&[
        ("baseColorFactor", numbers([r, g, b, 1.0])),
        ("metallicFactor", paint.metallic.to_string()),
        ("roughnessFactor", paint.roughness.to_string()),
    ]);
    object(&[("pbrMetallicRoughness", surface)])
}

/// The node all components hang on: (x, y, z) mm becomes (x, z, -y) m.
fn root(kit: &Kit) -> String {
    let m = METRE;
    let columns = [[m, 0.0, 0.0, 0.0], [0.0, 0.0, -m, 0.0], [0.0, m, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    object(&[
        ("name", string(&kit.name)),
        ("matrix", numbers(columns.concat())),
        ("children", array((1..=kit.placed.len()).map(|i| i.to_string()))),
    ])
}

/// Column by column.
fn matrix(pose: &Isometry3<f64>) -> String {
    numbers(pose.to_homogeneous().iter().copied())
}

fn mesh(part: &KitPart, material: usize, buffer: &mut Buffer) -> String {
    let Triangles { positions, normals, indices } = Triangles::new(&part.solid.mesh);
    let positions = buffer.vectors(&positions, true);
    let normals = buffer.vectors(&normals, false);
    let indices = buffer.indices(&indices);
    let attributes = object(&[("POSITION", positions.to_string()), ("NORMAL", normals.to_string())]);
    let primitive =
        object(&[("attributes", attributes), ("indices", indices.to_string()), ("material", material.to_string())]);
    object(&[("name", string(&part.name)), ("primitives", array([primitive]))])
}

/// Vertices with one normal each: a point of the solid once for every normal that its triangles have there.
struct Triangles {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    indices: Vec<u32>,
}

impl Triangles {
    fn new(mesh: &TriMesh) -> Triangles {
        let mut known: BTreeMap<(u32, [u32; 3]), u32> = BTreeMap::new();
        let mut out = Triangles { positions: Vec::new(), normals: Vec::new(), indices: Vec::new() };
        let corners = mesh.triangles.iter().flatten().zip(mesh.normals.iter().flatten());
        for (vertex, normal) in corners {
            let single = |v: [f64; 3]| v.map(|c| c as f32 + 0.0);
            let normal = single((*normal).into());
            let index = *known.entry((*vertex, normal.map(f32::to_bits))).or_insert_with(|| {
                out.positions.push(single(mesh.positions[*vertex as usize].coords.into()));
                out.normals.push(normal);
                out.positions.len() as u32 - 1
            });
            out.indices.push(index);
        }
        out
    }
}

/// The binary chunk with the views and accessors into it.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
}

impl Buffer {
    /// Vectors as 32-bit floats, with their bounds where the standard asks for them; the number of the accessor.
    fn vectors(&mut self, vectors: &[[f32; 3]], bounds: bool) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(vectors.iter().flatten().flat_map(|v| v.to_le_bytes()));
        let mut members = self.members(start, VERTICES, FLOAT, vectors.len(), "VEC3");
        if bounds {
            let fold = |pick: fn(f32, f32) -> f32| {
                let first = vectors.first().copied().unwrap_or_default();
                let all = vectors.iter().fold(first, |r, v| [0, 1, 2].map(|k| pick(r[k], v[k])));
                numbers(all.map(f64::from))
            };
            members.extend([("min", fold(f32::min)), ("max", fold(f32::max))]);
        }
        self.accessors.push(object(&members));
        self.accessors.len() - 1
    }

    fn indices(&mut self, indices: &[u32]) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
        let members = self.members(start, INDICES, UNSIGNED_INT, indices.len(), "SCALAR");
        self.accessors.push(object(&members));
        self.accessors.len() - 1
    }

    /// A view of what was written from `start` on, and the members of an accessor to it.
    fn members(
        &mut self,
        start: usize,
        target: u32,
        component: u32,
        count: usize,
        kind: &str,
    ) -> Vec<(&'static str, String)> {
        let length = self.bytes.len() - start;
        let view = [("byteOffset", start), ("byteLength", length), ("target", target as usize)];
        let view = view.map(|(k, n)| (k, n.to_string()));
        self.views.push(object(&[&[("buffer", "0".to_string())], &view[..]].concat()));
        vec![
            ("bufferView", (self.views.len() - 1).to_string()),
            ("componentType", component.to_string()),
            ("count", count.to_string()),
            ("type", string(kind)),
        ]
    }
}
