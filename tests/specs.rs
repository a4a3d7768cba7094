//! The specifications users start from: each must load without a word of complaint and lie in canonical layout.

#![cfg(feature = "compile")]

use gonogo::design::model::{Colour, Corner, Design, Expr, LightShape, Sense, Shape};
use gonogo::design::{Loaded, load};
use gonogo::solid::Quality;
use std::collections::BTreeMap;

fn read(path: &str) -> std::io::Result<String> {
    std::fs::read_to_string(path)
}

fn loaded(path: &str) -> Loaded {
    load(path, &read, &[])
}

fn design(name: &str) -> Design {
    let loaded = loaded(&format!("specs/{name}.gng"));
    assert!(loaded.diagnostics.is_empty(), "{:#?}", loaded.diagnostics);
    loaded.design.unwrap()
}

fn dim<'a>(design: &'a Design, name: &str) -> &'a gonogo::design::model::Dimension {
    design.dims.iter().find(|d| d.name == name).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
fn every_spec_is_in_canonical_layout() {
    for name in ["pattern_wheel", "four_screws", "pinned_plate", "shapes", "bearing_block", "two_views"] {
        let text = read(&format!("specs/{name}.gng")).unwrap();
        assert_eq!(gonogo::syntax::format(&text).unwrap(), text, "{name}");
    }
}

#[test]
fn pattern_wheel_has_the_components_of_the_paper() {
    let design = design("pattern_wheel");
    let names: Vec<&str> = design.components.iter().map(|c| c.name.as_str()).collect();
    let expected = [
        "gear",
        "shaft",
        "locking_ring",
        "alignment_pin[1]",
        "alignment_pin[2]",
        "alignment_pin[3]",
        "wheel_a1",
        "wheel_a2",
        "hd_pin",
        "unlatch_pin",
    ];
    assert_eq!(names, expected);
    assert_eq!(design.inspect.watch.len(), expected.len() - 1);
    let stations: Vec<&str> = design.stations.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(stations, ["A", "B", "C"]);
    assert!(matches!(design.stations[0].lights[0].shape, LightShape::Ring { inner: 45.0, outer: 75.0, setback: 20.0 }));
    assert!((design.stations[0].lights[0].drift - 0.15).abs() < 1e-12);
}

#[test]
fn pattern_wheel_stands_where_its_table_says() {
    let design = design("pattern_wheel");
    let poses = gonogo::assembly::place::place(&design, &design.nominal());
    let polar = |r: f64, degrees: f64| [r * degrees.to_radians().cos(), r * degrees.to_radians().sin()];
    let expected = [
        (1, [0.0, 0.0], -4.0),
        (2, [0.0, 0.0], 6.0),
        (3, polar(18.0, 90.0), 0.5),
        (4, polar(18.0, 210.0), 0.5),
        (5, polar(18.0, 330.0), 0.5),
        (6, [0.0, 0.0], 12.0),
        (7, [0.0, 0.0], 18.0),
        (8, polar(23.5, 30.0), 11.0),
        (9, polar(23.5, 150.0), 11.0),
    ];
    for (i, [x, y], z) in expected {
        let t = poses[i].translation.vector;
        assert!((t.x - x).abs() + (t.y - y).abs() + (t.z - z).abs() < 1e-9, "{} {t:?}", design.components[i].name);
    }
}

#[test]
fn every_pin_is_a_piece_of_its_own() {
    let design = design("pattern_wheel");
    for pin in 1..=3 {
        let foot = dim(&design, &format!("alignment_pin[{pin}].foot_step.d"));
        assert_eq!(foot.sense, Sense::External);
        assert!((foot.mmc - 3.996).abs() < 1e-12 && (foot.lmc - 3.988).abs() < 1e-12);
        dim(&design, &format!("alignment_pin[{pin}].z"));
    }
    let parts: Vec<usize> = (3..=5).map(|i| design.components[i].part).collect();
    assert!(parts[0] != parts[1] && parts[1] != parts[2]);
}

#[test]
fn holes_are_drawn_one_by_one_and_tooth_gaps_together() {
    let design = design("pattern_wheel");
    for hole in 1..=3 {
        let d = dim(&design, &format!("gear.pin_hole[{hole}].d"));
        assert_eq!((d.sense, d.mmc, d.lmc), (Sense::Internal, 4.0, 4.012));
    }
    assert_eq!(design.dims.iter().filter(|d| d.name.starts_with("gear.gap")).count(), 1);
}

#[test]
fn the_steps_of_a_pin_share_their_lengths() {
    let design = design("pattern_wheel");
    let pin = &design.parts[design.components[3].part];
    let mut values = design.nominal();
    let foot = design.dims.iter().position(|d| d.name == "alignment_pin[1].foot").unwrap();
    values[foot] += 0.01;
    let collar = pin.features[1].copies[0].pose.eval(&values).translation.z;
    assert!((collar - 8.51).abs() < 1e-12);
    assert!(!matches!(pin.features[1].copies[0].pose.t[2], Expr::Const(_)));
}

#[test]
fn screws_are_numbered_as_a_page_is_read() {
    let design = design("four_screws");
    let poses = gonogo::assembly::place::place(&design, &design.nominal());
    let screw = |i: usize| design.components.iter().position(|c| c.name == format!("screw[{i}]")).unwrap();
    let expected = [[-13.4, 15.05], [13.4, 15.05], [-13.4, -15.05], [13.4, -15.05]];
    for (i, [x, y]) in expected.into_iter().enumerate() {
        let t = poses[screw(i + 1)].translation.vector;
        assert!((t.x - x).abs() + (t.y - y).abs() < 1e-9 && t.z > 0.0, "{t:?}");
    }
    let camera = &design.stations[0].camera;
    let pixel = 150.0 * camera.pitch / camera.focal.nominal;
    assert!((pixel - 0.086).abs() < 1e-4, "{pixel}");
    assert!(design.components[screw(1)].free[5]);
}

#[test]
fn pinned_plate_has_the_limits_of_the_standards() {
    let design = design("pinned_plate");
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
    let bore = dim(&design, "plate.bore[2].d");
    assert!(close(bore.mmc, 6.0) && close(bore.lmc, 6.012));
    let shank = dim(&design, "pin[3].shank.d");
    assert!(close(shank.mmc, 5.996) && close(shank.lmc, 5.988));
    let y = dim(&design, "plate.slab.y");
    assert!(close(y.range.low, 49.7) && close(y.range.high, 50.3));
    let key = dim(&design, "plate.key.x");
    assert_eq!((key.sense, key.mmc, key.lmc), (Sense::Internal, 8.0, 8.05));
    let relief = dim(&design, "plate.relief.d");
    assert_eq!((relief.mmc, relief.range.nominal, relief.lmc), (15.8, 16.0, 16.3));
}

#[test]
fn a_setting_overrides_a_let_and_the_digest_knows_it() {
    let path = "specs/pinned_plate.gng";
    let set = [("pin_size".to_string(), "8".to_string())];
    let larger = load(path, &read, &set);
    assert!(larger.diagnostics.is_empty(), "{:#?}", larger.diagnostics);
    assert!((dim(larger.design.as_ref().unwrap(), "plate.bore[1].d").mmc - 8.0).abs() < 1e-12);
    assert_ne!(larger.text, loaded(path).text);
    assert_eq!(larger.inputs, [path]);
}

/// A metal with a name has the index of the light that falls on it; one with numbers of its own keeps them.
#[test]
fn metals_know_the_colours_that_shine_on_them() {
    let wheel = read("specs/pattern_wheel.gng").unwrap();
    let tints = |ring: &str, brass: &str| -> BTreeMap<String, Vec<(Colour, f64)>> {
        let text = wheel.replacen("= ring(", ring, 1).replacen("= brass\n", brass, 1);
        let loaded = load("lit.gng", &|_| Ok(text.clone()), &[]);
        assert!(loaded.diagnostics.is_empty(), "{:#?}", loaded.diagnostics);
        let materials = loaded.design.unwrap().materials.into_iter();
        materials.map(|m| (m.name, m.tints.iter().map(|t| (t.colour, t.n)).collect())).collect()
    };
    assert!(tints("= ring(", "= brass\n").values().all(Vec::is_empty), "white light needs none");
    let blue = tints("= ring(colour = blue, ", "= brass\n");
    assert_eq!(blue["brass"], [(Colour::Blue, 1.09)]);
    assert_eq!(blue["machined_steel"], [(Colour::Blue, 1.68)]);
    assert_eq!(blue["dark_plate"], [], "no metal");
    let own = tints("= ring(colour = blue, ", "= brass\n    n = 1.2\n");
    assert_eq!(own["brass"], []);
}

#[test]
fn shapes_of_every_kind_make_a_design() {
    let design = design("shapes");
    let bracket = &design.parts[0];
    let Shape::Prism { outline, .. } = &bracket.features[0].copies[0].shape else { panic!("the rail is a prism") };
    let sides: Vec<&str> = outline.sides.iter().map(|s| s.name.as_str()).collect();
    assert_eq!(sides, ["base", "2", "3", "crown", "5"]);
    assert_eq!(outline.sides[1].corner, Corner::Round(outline.sides[1].corner.size().unwrap().clone()));
    let mount = bracket.features.iter().find(|f| f.name == "mount").unwrap();
    let Shape::Group { features } = &mount.copies[0].shape else { panic!("the mount is a group") };
    let names: Vec<(&str, usize)> = features.iter().map(|f| (f.name.as_str(), f.copies.len())).collect();
    assert_eq!(names, [("screw", 4), ("dowel", 2)]);
    let Shape::Group { features } = &features[0].copies[3].shape else { panic!("a counterbore is a group") };
    let names: Vec<&str> = features.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["bore", "head"]);
    let sense = |name: &str| dim(&design, name).sense;
    assert_eq!(sense("bracket.mount.screw.head_h"), Sense::Internal);
    assert_eq!(sense("bracket.profile.2.round"), Sense::Internal);
    assert_eq!(sense("bushing.body.d"), Sense::External);
    assert_eq!(design.measures.len(), 1);
    assert_eq!(design.measures[0].from.face, "rail.top");
}

#[test]
fn the_spec_of_all_shapes_keeps_its_faces_within_tolerance() {
    solids_keep_their_faces(&design("shapes"));
}

/// A hole clears a little above its face; a boss put there afterwards has the height it is given, and no face of the hole's.
#[test]
fn a_boss_beside_a_hole_keeps_its_faces_whatever_its_height() {
    for height in ["0.9", "1", "1.1"] {
        let text = format!(
            "gonogo 1\nunits mm deg\ntolerances exact\nmaterial steel {{\n    metal = steel\n}}\npart plate {{\n    material = steel\n    \
             add slab = box(x = 60, y = 60 ±0.1, z = 12)\n    cut pocket = hole(d = 40, h = 2) at (0, 0, 12)\n    \
             add boss = cylinder(d = 12, h = (12 + rise))\n    let rise = {height} ±0.05\n}}\nassembly a {{\n    root plate\n}}\n\
             station s {{\n    light room = room(patches = 9)\n}}\n"
        );
        let loaded = load("plate.gng", &|_| Ok(text.clone()), &[]);
        let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
        solids_keep_their_faces(&design);
    }
}

/// Every part can be made at least material, at nominal and at most material, with the same faces and more each time.
fn solids_keep_their_faces(design: &Design) {
    for part in &design.parts {
        let made = |values: &[f64]| -> (Vec<String>, f64) {
            let solid = gonogo::solid::evaluate(part, values, &Quality::default());
            let solid = solid.unwrap_or_else(|faults| panic!("{faults:#?}"));
            (solid.faces.iter().map(|f| f.name.clone()).collect(), solid.volume)
        };
        let [least, nominal, most] = [design.lmc(), design.nominal(), design.mmc()].map(|values| made(&values));
        assert!(least.0 == nominal.0 && most.0 == nominal.0, "{}: {least:?} {nominal:?} {most:?}", part.name);
        assert!(least.1 < nominal.1 && nominal.1 < most.1, "{}", part.name);
    }
}

#[test]
fn what_is_emitted_of_a_design_names_its_measures() {
    let emitted = gonogo::artifacts::design(&design("shapes"));
    assert!(
        emitted.contains("\"flush\": (\"bracket.rail.top\", \"bushing.body.top\", Some((-0.01, 0.01)))"),
        "{emitted}"
    );
    assert!(!gonogo::artifacts::design(&design("pinned_plate")).contains("measures"));
}

#[test]
fn parts_kept_from_an_earlier_text_change_nothing() {
    use gonogo::artifacts::Artifact;
    use gonogo::{Options, compile};
    let text = read("tests/data/two_pins.gng").unwrap();
    let shelf = std::sync::Arc::default();
    // As it is typed: a size, then the same again, then one that is wrong, then the first.
    for (from, to) in [("", ""), ("40 ±0.1", "41 ±0.1"), ("40 ±0.1", "41 ±0.1"), ("6 +0.012/0", "600"), ("", "")] {
        let text = text.replacen(from, to, 1);
        let made = |shelf| {
            let wanted = [Artifact::Brep, Artifact::Contacts].into();
            let options = Options { wanted, shelf, ..Options::default() };
            let compiled = compile("x.gng", &|_| Ok(text.clone()), &options, &|_| {});
            (compiled.diagnostics, compiled.artifacts)
        };
        assert_eq!(made(Some(std::sync::Arc::clone(&shelf))), made(None), "{to}");
    }
}
