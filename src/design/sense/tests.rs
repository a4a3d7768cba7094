//! Senses of dimensions in parts whose material is easily thought through.

use crate::design::load;
use crate::design::model::{Design, Sense};

use Sense::{External, Internal, Neutral};

/// A design whose one part has these lines, and the codes of its warnings.
fn part(lines: &str) -> (Design, Vec<&'static str>) {
    let text = format!(
        "gonogo 1\nmaterial m {{\n kind = matt\n}}\npart p {{\n material = m\n{lines}\n}}\nassembly a {{\n root p\n}}\n\
         station s {{\n light room = room(patches = 1)\n}}\n"
    );
    let loaded = load("x.gng", &|_| Ok(text.to_string()), &[]);
    let codes = loaded.diagnostics.iter().map(|d| d.code).collect();
    (loaded.design.unwrap_or_else(|| panic!("{:#?}\n{text}", loaded.diagnostics)), codes)
}

fn sense(design: &Design, name: &str) -> Sense {
    let dim = design.dims.iter().find(|d| d.name == name);
    let names: Vec<&str> = design.dims.iter().map(|d| d.name.as_str()).collect();
    dim.unwrap_or_else(|| panic!("no {name} among {names:?}")).sense
}

/// Senses of the dimensions of a part that has nothing to warn of.
fn senses(lines: &str, expected: &[(&str, Sense)]) {
    let (design, codes) = part(lines);
    assert_eq!(codes, [""; 0], "{lines}");
    for (name, expected) in expected {
        assert_eq!(sense(&design, &format!("p.{name}")), *expected, "{name} in\n{lines}");
    }
}

#[test]
fn a_pocket_that_follows_its_slab_leaves_the_slab_external() {
    // The depth of the pocket grows with the slab, but its floor stays: only the rim moves.
    senses(
        "let t = 10 ±0.1\nlet floor = 3 ±0.1\nadd slab = box(x = 40, y = 40, z = t)\n\
         cut pocket = box(x = 20, y = 20, z = (t - floor)) at (0, 0, floor)",
        &[("t", External), ("floor", External)],
    );
}

#[test]
fn a_floor_is_external_though_it_only_moves_a_cut() {
    senses(
        "let floor = 3 ±0.1\nadd slab = box(x = 40, y = 40, z = 10)\n\
         cut pocket = box(x = 20, y = 20, z = 50) at (0, 0, floor)",
        &[("floor", External)],
    );
}

#[test]
fn steps_of_a_stack_are_external() {
    senses(
        "let foot = 8 ±0.02\nlet collar = 3 ±0.02\nadd a = cylinder(d = 4, h = foot)\n\
         add b = cylinder(d = 6, h = collar) at (0, 0, foot)\nadd c = cylinder(d = 4, h = 5) at (0, 0, (foot + collar))",
        &[("foot", External), ("collar", External)],
    );
}

#[test]
fn a_hole_that_only_moves_is_neutral() {
    senses(
        "let across = 20 ±0.1\nadd slab = box(x = 40, y = 40, z = 10)\n\
         cut bore = 4x cylinder(d = 5 ±0.1, h = through) on grid(columns = 2, x = across, y = 20)",
        &[("across", Neutral), ("bore.d", Internal)],
    );
}

#[test]
fn an_edge_that_moves_a_hole_is_external() {
    senses(
        "let w = 40 ±0.1\nadd slab = box(x = w, y = 40, z = 10)\n\
         cut bore = cylinder(d = 5, h = through) at ((w / 2 - 10), 0)",
        &[("w", External)],
    );
}

#[test]
fn parity_counts_every_cut_around_a_feature() {
    senses(
        "add slab = box(x = 60, y = 40, z = 10)\n\
         cut ring = group at (0, 0, 5) {\n add disc = cylinder(d = 30 ±0.1, h = 20)\n\
         cut core = group {\n  add post = cylinder(d = 20 ±0.1, h = through)\n  cut eye = box(x = 4 ±0.1, y = 30, z = through)\n }\n}",
        &[("ring.disc.d", Internal), ("ring.core.post.d", External), ("ring.core.eye.x", Internal)],
    );
}

#[test]
fn a_body_in_a_group_is_external_and_its_hole_internal() {
    senses(
        "add lug = 2x group on line(pitch = 30 ±0.1) {\n add ear = box(x = 20 ±0.1, y = 10, z = 5)\n\
         cut eye = cylinder(d = 4 ±0.1, h = through)\n}\nadd bar = box(x = 60, y = 4, z = 5) at (15, 7)",
        &[("lug.ear.x", External), ("lug.eye.d", Internal), ("lug.line.pitch", Neutral)],
    );
}

#[test]
fn sizes_of_holes_are_internal_and_depth_too() {
    senses(
        "add slab = box(x = 60, y = 40, z = 20)\n\
         cut a = counterbore(d = 6 ±0.1, h = through, head_d = 11 ±0.1, head_h = 6 ±0.1) at (-20, 0, 20)\n\
         cut b = countersink(d = 6 ±0.1, h = 15 ±0.1, head_d = 12 ±0.1) at (0, 0, 20)\n\
         cut c = hole(d = 6 ±0.1, h = 8 ±0.1, tip = 118) at (20, 0, 20)",
        &[
            ("a.d", Internal),
            ("a.head_d", Internal),
            ("a.head_h", Internal),
            ("b.d", Internal),
            ("b.h", Internal),
            ("b.head_d", Internal),
            ("c.d", Internal),
            ("c.h", Internal),
        ],
    );
}

#[test]
fn chamfers_take_material_from_a_body_and_from_the_mouth_of_a_hole() {
    senses(
        "add pin = cylinder(d = 20 ±0.1, h = 30 ±0.1, chamfer = 1 ±0.1)\n\
         cut bore = cylinder(d = 8 ±0.1, h = 12, chamfer_top = 1 ±0.1) at (0, 0, 18)",
        &[
            ("pin.d", External),
            ("pin.h", External),
            ("pin.chamfer", Internal),
            ("bore.d", Internal),
            ("bore.chamfer_top", Internal),
        ],
    );
}

#[test]
fn coordinates_of_an_outline_have_the_sense_of_its_area() {
    let outline = "outline ell {\n from (0, 0)\n line to (30 ±0.1, 0) round 2 ±0.2\n line to (30, 5 ±0.1)\n line to (5, 5)\n line neck to (5 ±0.1, 20)\n line to (0, 20)\n}\n";
    let dims = [("ell.1.x", External), ("ell.1.round", Internal), ("ell.2.y", External), ("ell.neck.x", External)];
    senses(
        &format!("{outline}add bar = prism(outline = ell, h = 8 ±0.1)"),
        &[&dims[..], &[("bar.h", External)]].concat(),
    );
    let cut = dims.map(|(name, sense)| (name, if sense == External { Internal } else { External }));
    senses(
        &format!(
            "{outline}add slab = box(x = 80, y = 80, z = 8)\ncut bar = prism(outline = ell, h = 4 ±0.1) at (0, 0, 4)"
        ),
        &[&cut[..], &[("bar.h", Internal)]].concat(),
    );
}

#[test]
fn a_groove_turned_about_an_axis_is_internal_where_it_deepens() {
    senses(
        "outline groove {\n from (8, 4)\n line to (12, 4)\n line to (12, 6)\n line floor to (9 ±0.05, 6)\n line to (9.2 ±0.05, 4.5)\n line to (8, 4.5)\n}\n\
         add shaft = cylinder(d = 22 ±0.1, h = 30)\ncut ring = revolve(outline = groove)",
        &[("shaft.d", External)],
    );
    let lines = "let deep = 9 ±0.05\noutline groove {\n from (deep, 4)\n line to (12, 4)\n line to (12, 6)\n line floor to (deep, 6)\n}\n\
                 add shaft = cylinder(d = 22 ±0.1, h = 30)\ncut ring = revolve(outline = groove)";
    senses(lines, &[("deep", External)]);
}

#[test]
fn a_torus_and_a_flared_cone_have_the_senses_of_their_sizes() {
    senses(
        "add ring = torus(d = 40, tube = 6 ±0.1)\nadd horn = cone(d1 = 4 ±0.1, d2 = 20 ±0.1, h = 10 ±0.1) at (50, 0, 0)\n\
         add bar = box(x = 60, y = 4, z = 4) at (25, 0, -2)",
        &[("ring.tube", External), ("horn.d1", External), ("horn.d2", External), ("horn.h", External)],
    );
}

#[test]
fn only_a_size_used_both_ways_is_ambiguous_and_stating_it_ends_that() {
    let lines = |wall: &str| {
        format!(
            "let wall = {wall}\nadd tube = cylinder(d = (wall + 20), h = 30)\ncut inner = cylinder(d = (wall + 4), h = through)"
        )
    };
    let (design, codes) = part(&lines("8 ±0.1"));
    assert_eq!((sense(&design, "p.wall"), codes), (Neutral, vec!["W0311"]));
    let (design, codes) = part(&lines("{ mmc 8.1, nominal 8, lmc 7.9 }"));
    assert_eq!((sense(&design, "p.wall"), codes), (Neutral, vec![]));
    assert!(design.dims.iter().any(|d| (d.mmc, d.lmc) == (8.1, 7.9)));
}

#[test]
fn every_copy_may_have_its_own_dimensions_in_groups_and_positions_too() {
    let (design, _) = part(
        "add slab = box(x = 90, y = 60, z = 10)\ncut set = 2x group at (0 ±0.1 each, 0) on line(pitch = 40) {\n\
         add bore = 3x cylinder(d = 5 ±0.1 each, h = through) on circle(r = 8 ±0.05 each)\n add key = box(x = 2 ±0.1, y = 30, z = through)\n}",
    );
    let mut names: Vec<&str> = design.dims.iter().map(|d| d.name.as_str()).collect();
    names.sort_unstable();
    let own = |set: usize| {
        let bores =
            (1..=3).flat_map(move |bore| ["circle.r", "d"].map(move |key| format!("p.set[{set}].bore[{bore}].{key}")));
        [format!("p.set[{set}].at.x")].into_iter().chain(bores)
    };
    let mut expected: Vec<String> = (1..=2).flat_map(own).chain(["p.set.key.x".to_string()]).collect();
    expected.sort_unstable();
    assert_eq!(names, expected);
}

#[test]
fn least_material_lies_inside_most_material() {
    use super::body::Body;
    use nalgebra::Point3;
    let (design, _) = part(
        "let floor = 3 ±0.8\nlet t = 12 ±1\noutline ell {\n from (-20, -20)\n line to (22 ±1, -20) round 5 ±1\n line to (22, 18 ±1)\n line to (-20, 20)\n}\n\
         add slab = prism(outline = ell, h = t)\ncut pocket = box(x = 16 ±1, y = 16 ±1, z = (t - floor)) at (0, 0, floor)\n\
         add post = cone(d1 = 12 ±1, d2 = 7 ±1, h = 8 ±1)\ncut sink = countersink(d = 3 ±0.5, h = through, head_d = 6 ±0.5) at (0, 0, 8)",
    );
    let body = Body::of(&design.parts[0]);
    let [least, most] = [design.lmc(), design.mmc()].map(|values| body.at(&values));
    let (mut both, mut band) = (0, 0);
    for i in 0..60_000u32 {
        let share = |step: f64| (f64::from(i) * step).fract();
        let p = Point3::new(
            60.0 * share(0.819_172_5) - 30.0,
            60.0 * share(0.671_043_6) - 30.0,
            16.0 * share(0.549_700_5) - 1.0,
        );
        match (body.inside(&least, &p), body.inside(&most, &p)) {
            (true, true) => both += 1,
            (false, true) => band += 1,
            (true, false) => panic!("{p} is in least material only"),
            (false, false) => {}
        }
    }
    assert!(both > 10_000 && band > 1_000, "{both} {band}");
}

#[test]
fn all_pieces_of_a_part_have_the_same_senses() {
    let text = "gonogo 1\nmaterial m {\n kind = matt\n}\nlet t = 10 ±0.1\npart p {\n material = m\n let floor = 3 ±0.1\n\
                add slab = box(x = 40, y = 40, z = t)\n cut pocket = box(x = 20, y = 20, z = (t - floor)) at (0, 0, floor)\n\
                cut bore = 2x cylinder(d = 2, h = through) at (15 ±0.1 each, 0) on line(pitch = 3)\n}\n\
                assembly a {\n root p\n place b = 2x p on p.bore[1..2]\n place c = p on p\n place d = p on p\n}\n\
                station s {\n light room = room(patches = 1)\n}\n";
    let loaded = load("x.gng", &|_| Ok(text.to_string()), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
    for piece in ["p", "b[1]", "b[2]", "c", "d"] {
        assert_eq!(sense(&design, &format!("{piece}.floor")), External);
        assert_eq!(sense(&design, &format!("{piece}.bore[2].at.x")), Neutral);
    }
    assert_eq!(sense(&design, "t"), External);
}
