//! STEP and glTF as a reader sees them: parsed again, counted, and held against the solids they were made of.
//!
//! What Open CASCADE makes of the same files is checked by hand: `cargo test --test exchange -- --ignored` writes them to
//! `target/step-oracle`, and `tests/oracle/step.py` reads them.

#![cfg(feature = "compile")]

#[path = "exchange/collection.rs"]
mod collection;
#[path = "exchange/part21.rs"]
mod part21;

use collection::{Specimen, specimens};
use gonogo::exchange::{Kit, KitPart, Paint, Placed, gltf, step};
use gonogo::solid::{Solid, Surface};
use nalgebra::{Isometry3, Vector3};
use part21::File;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

const GREY: Paint = Paint { rgb: [0.5; 3], metallic: 1.0, roughness: 0.3 };

fn part(specimen: &Specimen) -> KitPart {
    KitPart { name: specimen.name.clone(), solid: specimen.solid.clone(), paint: GREY }
}

/// Faces by kind: plane, cylinder, cone, sphere, torus.
fn kinds(solid: &Solid) -> [usize; 5] {
    let mut kinds = [0; 5];
    for face in &solid.faces {
        let kind = match solid.surfaces[face.surface] {
            Surface::Plane { .. } => 0,
            Surface::Cylinder { .. } => 1,
            Surface::Cone { .. } => 2,
            Surface::Sphere { .. } => 3,
            Surface::Torus { .. } => 4,
        };
        kinds[kind] += 1;
    }
    kinds
}

#[test]
fn every_file_is_sound_and_complete() {
    for specimen in specimens() {
        let file = File::parse(&step::part(&part(specimen)));
        check(&specimen.name, &file);
        let of_kind = |word: &str| file.all(word).count();
        let tori = of_kind("TOROIDAL_SURFACE") + of_kind("DEGENERATE_TOROIDAL_SURFACE");
        let round = ["CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SPHERICAL_SURFACE"].map(of_kind);
        let found = [of_kind("PLANE"), round[0], round[1], round[2], tori];
        assert_eq!(found, kinds(&specimen.solid), "{}", specimen.name);
        assert_eq!(of_kind("ADVANCED_FACE"), specimen.solid.faces.len());
        assert_eq!(of_kind("MANIFOLD_SOLID_BREP") + of_kind("BREP_WITH_VOIDS"), 1);
    }
}

/// References lead somewhere; edges have two faces, with opposite senses, and join their vertices; loops close.
fn check(name: &str, file: &File) {
    let mut sides: BTreeMap<u32, (usize, usize)> = BTreeMap::new();
    for face in file.all("ADVANCED_FACE") {
        for bound in file.references(face) {
            if !file.word(bound).ends_with("BOUND") {
                continue;
            }
            let path = file.references(bound)[0];
            let turned = file.flag(bound) == Some(false);
            let mut ends = Vec::new();
            if file.word(path) == "EDGE_LOOP" {
                for side in file.references(path) {
                    let edge = file.references(side)[0];
                    let forward = file.flag(side) == Some(true);
                    let count = sides.entry(edge).or_default();
                    if forward != turned {
                        count.0 += 1
                    } else {
                        count.1 += 1
                    }
                    let [a, b] = [0, 1].map(|k| file.references(edge)[k]);
                    ends.push(if forward { [a, b] } else { [b, a] });
                }
            }
            for (i, [_, end]) in ends.iter().enumerate() {
                assert_eq!(*end, ends[(i + 1) % ends.len()][0], "{name}: a loop breaks off");
            }
        }
    }
    assert_eq!(sides.len(), file.all("EDGE_CURVE").count(), "{name}: an edge without a face");
    assert!(sides.values().all(|s| *s == (1, 1)), "{name}: {sides:?}");
}

/// A face without a seam where it needs one would have no outer loop, or one that breaks off; only a whole sphere has none.
#[test]
fn every_face_has_one_outer_loop() {
    for specimen in specimens() {
        let file = File::parse(&step::part(&part(specimen)));
        for face in file.all("ADVANCED_FACE") {
            let of_kind = |word: &str| file.references(face).iter().filter(|b| file.word(**b) == word).count();
            let whole = of_kind("SPHERICAL_SURFACE") == 1 && of_kind("FACE_BOUND") == 1;
            assert!(of_kind("FACE_OUTER_BOUND") == 1 || whole, "{}", specimen.name);
        }
    }
}

/// Faces that go all the way round have one loop more than their holes: the two rings are joined.
#[test]
fn seams_join_the_rings_of_a_round_face() {
    for (name, loops) in [("pin", 1), ("crown", 1), ("bead", 1), ("torus", 1), ("cross_hole", 3), ("windows", 10)] {
        let specimen = specimens().iter().find(|s| s.name == name).unwrap();
        let file = File::parse(&step::part(&part(specimen)));
        let bounds = |face: u32| file.references(face).iter().filter(|b| file.word(**b).ends_with("BOUND")).count();
        let round = |face: &u32| file.references(*face).iter().all(|s| file.word(*s) != "PLANE");
        assert_eq!(file.all("ADVANCED_FACE").filter(round).map(bounds).max(), Some(loops), "{name}");
    }
}

#[test]
fn the_assembly_places_every_component_and_names_it() {
    let all = specimens();
    let parts: Vec<KitPart> = all.iter().take(3).map(part).collect();
    let place = |i: usize| Placed {
        name: format!("bolt ø{i}"),
        part: i % 3,
        pose: Isometry3::new(Vector3::new(i as f64, 0.0, 0.0), Vector3::new(0.1, 0.2, 0.3 * i as f64)),
    };
    let kit = Kit { name: "it's".into(), parts, placed: (0..7).map(place).collect() };
    let text = step::assembly(&kit);
    let file = File::parse(&text);
    check("assembly", &file);
    for (word, count) in [
        ("PRODUCT", 4),
        ("NEXT_ASSEMBLY_USAGE_OCCURRENCE", 7),
        ("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", 7),
        ("ITEM_DEFINED_TRANSFORMATION", 7),
        ("ADVANCED_BREP_SHAPE_REPRESENTATION", 3),
        ("STYLED_ITEM", 3),
    ] {
        assert_eq!(file.all(word).count(), count, "{word}");
    }
    assert!(text.contains("PRODUCT('it''s','it''s','',"), "quotes are doubled");
    assert!(text.contains("'bolt \\X2\\00F8\\X0\\6'"), "what is not ASCII is escaped");
    assert_eq!(text, step::assembly(&kit), "the same kit gives the same text");
}

/// A binary glTF file taken apart: the JSON and the bytes.
fn unpacked(file: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
    let json = word(12);
    assert_eq!((&file[16..20], json % 4), (&b"JSON"[..], 0));
    let binary = word(20 + json);
    assert_eq!((&file[24 + json..28 + json], binary % 4), (&b"BIN\0"[..], 0));
    assert_eq!(file.len(), 28 + json + binary);
    (serde_json::from_slice(&file[20..20 + json]).unwrap(), file[28 + json..].to_vec())
}

/// The 32-bit words of an accessor, by component.
fn words(json: &Value, bytes: &[u8], accessor: &Value) -> Vec<[u8; 4]> {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let [start, length] = ["byteOffset", "byteLength"].map(|k| view[k].as_u64().unwrap() as usize);
    let wide = if accessor["type"] == "VEC3" { 3 } else { 1 };
    assert_eq!(length, 4 * wide * accessor["count"].as_u64().unwrap() as usize);
    assert!(start % 4 == 0 && start + length <= bytes.len());
    bytes[start..start + length].chunks_exact(4).map(|c| c.try_into().unwrap()).collect()
}

#[test]
fn gltf_holds_closed_meshes_of_the_right_size() {
    let kit = collection_kit(&specimens()[..12]);
    let (json, bytes) = unpacked(&gltf::assembly(&kit, &[]));
    assert_eq!(json["buffers"][0]["byteLength"].as_u64().unwrap() as usize, bytes.len());
    for (mesh, part) in json["meshes"].as_array().unwrap().iter().zip(&kit.parts) {
        assert_eq!(mesh["name"], part.name.as_str());
        let primitive = &mesh["primitives"][0];
        let vectors = |name: &str| -> Vec<Vector3<f64>> {
            let floats = words(&json, &bytes, &primitive["attributes"][name]);
            let floats: Vec<f64> = floats.iter().map(|b| f64::from(f32::from_le_bytes(*b))).collect();
            floats.chunks_exact(3).map(|v| Vector3::new(v[0], v[1], v[2])).collect()
        };
        let (positions, normals) = (vectors("POSITION"), vectors("NORMAL"));
        let indices: Vec<usize> =
            words(&json, &bytes, &primitive["indices"]).iter().map(|b| u32::from_le_bytes(*b) as usize).collect();
        assert!(positions.len() == normals.len() && indices.iter().all(|i| *i < positions.len()));
        assert!(normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-6));
        let bounds = &json["accessors"][primitive["attributes"]["POSITION"].as_u64().unwrap() as usize];
        for k in 0..3 {
            let least = positions.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let most = positions.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            // Numbers are exact to single precision, as the positions are.
            let bound = |name: &str| bounds[name][k].as_f64().unwrap() as f32;
            assert_eq!((bound("min"), bound("max")), (least as f32, most as f32));
        }
        let corner = |t: &[usize], k: usize| positions[t[k]];
        let volume = |t: &[usize]| corner(t, 0).dot(&corner(t, 1).cross(&corner(t, 2))) / 6.0;
        let volume: f64 = indices.chunks_exact(3).map(volume).sum();
        assert!((volume / part.solid.volume - 1.0).abs() < 8e-3, "{} {volume}", part.name);
    }
}

#[test]
fn gltf_places_components_and_turns_z_up_to_y_up() {
    let kit = collection_kit(&specimens()[..4]);
    let shift = Vector3::new(0.0, 0.0, 25.0);
    let [still, exploded] = [&[][..], &[Vector3::zeros(), shift][..]].map(|o| unpacked(&gltf::assembly(&kit, o)).0);
    let root = &still["nodes"][0]["matrix"];
    let root: Vec<f64> = root.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let root = nalgebra::Matrix4::from_column_slice(&root);
    assert_eq!(root.transform_vector(&Vector3::z()), Vector3::y() * 1e-3);
    assert!((root.fixed_view::<3, 3>(0, 0) * 1e3).determinant() > 0.999, "a mirror image");
    assert_eq!(still["nodes"][0]["children"].as_array().unwrap().len(), 4);
    for (i, c) in kit.placed.iter().enumerate() {
        let node = |json: &Value| {
            let numbers: Vec<f64> =
                json["nodes"][i + 1]["matrix"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
            nalgebra::Matrix4::from_column_slice(&numbers)
        };
        assert_eq!(still["nodes"][i + 1]["name"], c.name.as_str());
        assert!((node(&still) - c.pose.to_homogeneous()).norm() < 1e-12);
        let moved = (node(&exploded) - node(&still)).fixed_view::<3, 1>(0, 3).into_owned();
        assert!((moved - if i == 1 { shift } else { Vector3::zeros() }).norm() < 1e-12);
    }
}

/// The specimens side by side, turned this way and that.
fn collection_kit(all: &[Specimen]) -> Kit {
    let place = |(i, s): (usize, &Specimen)| Placed {
        name: format!("{} \"{i}\"", s.name),
        part: i,
        pose: Isometry3::new(Vector3::new(100.0 * i as f64, 0.0, 0.0), Vector3::new(0.0, 0.1, i as f64)),
    };
    Kit {
        name: "collection".into(),
        parts: all.iter().map(part).collect(),
        placed: all.iter().enumerate().map(place).collect(),
    }
}

/// Writes the collection for `tests/oracle/step.py`.
#[test]
#[ignore = "writes files for Open CASCADE"]
fn write_the_collection() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("target/step-oracle");
    std::fs::create_dir_all(&folder).unwrap();
    let all = specimens();
    let mut list = String::from("[\n");
    for specimen in all {
        std::fs::write(folder.join(format!("{}.step", specimen.name)), step::part(&part(specimen))).unwrap();
        line(&mut list, &specimen.name, 1, &[&specimen.solid]);
    }
    let kit = collection_kit(all);
    std::fs::write(folder.join("assembly.step"), step::assembly(&kit)).unwrap();
    std::fs::write(folder.join("assembly.glb"), gltf::assembly(&kit, &[])).unwrap();
    line(&mut list, "assembly", all.len(), &all.iter().map(|s| &*s.solid).collect::<Vec<_>>());
    let list = list.trim_end_matches(",\n").to_string() + "\n]\n";
    std::fs::write(folder.join("figures.json"), list).unwrap();
}

fn line(list: &mut String, name: &str, count: usize, solids: &[&Solid]) {
    let volume: f64 = solids.iter().map(|s| s.volume).sum();
    let area: f64 = solids.iter().map(|s| s.area).sum();
    let faces = solids.iter().map(|s| kinds(s)).fold([0; 5], |sum, k| [0, 1, 2, 3, 4].map(|i| sum[i] + k[i]));
    let [plane, cylinder, cone, sphere, torus] = faces;
    writeln!(
        list,
        "{{\"file\": \"{name}.step\", \"solids\": {count}, \"volume\": {volume}, \"area\": {area}, \"faces\": \
         {{\"plane\": {plane}, \"cylinder\": {cylinder}, \"cone\": {cone}, \"sphere\": {sphere}, \"torus\": {torus}}}}},"
    )
    .unwrap();
}
