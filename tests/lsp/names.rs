//! Where names lead, and what renaming them does in every spec that knows them.

use crate::editor::Editor;
use crate::two_specs;

#[test]
fn names_lead_to_their_definitions() {
    let mut editor = Editor::new();
    editor.open("/w/wheel.gng", include_str!("../../specs/pattern_wheel.gng"));
    for (at, line) in [
        ("polished_steel\n\n    let d", "material polished_steel {"),
        ("gear_height\n        rz", "let gear_height = 6 ±0.05"),
        ("foot + collar))", "let foot   = 8.5 ±0.02"),
        ("shaft on gear", "part shaft {"),
        ("gear.pin_hole {", "root gear"),
        ("pin_hole {", "cut pin_hole = 3x cylinder(d = 4 +0.012/0 each, h = through) on circle(r = 18, from = 90 deg)"),
        ("pattern_wheel {\n    false", "assembly pattern_wheel {"),
    ] {
        assert_eq!(editor.definition_line("/w/wheel.gng", at), line, "{at}");
    }
}

#[test]
fn faces_lead_to_features_and_sides() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\npart p {\n    outline o {\n        from (0, 0)\n        line base to (9, 0) round 1\n        line to (9, 9)\n    }\n    add rail = prism(outline = o, h = 5)\n    cut g = group {\n        add deep = box(x = 1, y = 1, z = 9)\n    }\n}\nassembly a {\n    measure w = from q.rail.base_corner to q.g.deep.+x\n    root q = p\n}\n";
    editor.open("/w/a.gng", spec);
    for (at, line) in [
        ("base_corner", "line base to (9, 0) round 1"),
        ("rail.base", "add rail = prism(outline = o, h = 5)"),
        ("deep.+x", "add deep = box(x = 1, y = 1, z = 9)"),
        ("o, h", "outline o {"),
        ("q.rail", "root q = p"),
    ] {
        assert_eq!(editor.definition_line("/w/a.gng", at), line, "{at}");
    }
}

#[test]
fn renames_reach_every_spec_that_uses_the_file() {
    let mut editor = two_specs();
    let renamed = editor.rename("/w/parts/pin.gng", "size = 6", "length").unwrap();
    assert_eq!(renamed.keys().collect::<Vec<_>>(), ["/w/one.gng", "/w/parts/pin.gng", "/w/two.gng"]);
    assert_eq!(renamed["/w/one.gng"].matches("z = length\n").count(), 1);
    assert!(renamed["/w/parts/pin.gng"].contains("let d = length\n") && !renamed["/w/parts/pin.gng"].contains("size"));
    // A part's new name leaves the components theirs.
    let renamed = editor.rename("/w/parts/pin.gng", "pin {", "dowel").unwrap();
    assert!(
        renamed["/w/one.gng"].contains("    root pin = dowel\n    place b = dowel on pin {"),
        "{}",
        renamed["/w/one.gng"]
    );
}

#[test]
fn a_component_may_part_from_its_part() {
    let mut editor = Editor::new();
    editor.open("/w/wheel.gng", include_str!("../../specs/pattern_wheel.gng"));
    let renamed = editor.rename("/w/wheel.gng", "wheel_a1 on gear", "upper").unwrap();
    let text = &renamed["/w/wheel.gng"];
    assert!(
        text.contains("place upper = wheel_a1 on gear {") && text.contains("place hd_pin on upper.hd_hole {"),
        "{text}"
    );
    assert!(text.contains("part wheel_a1 {"));
    assert_eq!(gonogo::syntax::parse(text, 0).1, []);
}

#[test]
fn renames_are_refused_with_a_reason() {
    let mut editor = two_specs();
    let mut refused = |at: &str, new: &str, why: &str| {
        let said = editor.rename("/w/parts/pin.gng", at, new).unwrap_err();
        assert!(said.contains(why), "{said}");
    };
    refused("size = 6", "9 lives", "is not a name");
    refused("size = 6", "größe", "is not a name");
    refused("size = 6", "through", "is a word of the language");
    refused("m {", "", "is not a name");
    // The piece's own `d` would hide the file's.
    refused("size = 6", "d", "would mean something else");
    refused("kind = matt", "x", "there is no name here");
    let mut editor = Editor::new();
    editor.open("/w/wheel.gng", include_str!("../../specs/pattern_wheel.gng"));
    let said = editor.rename("/w/wheel.gng", "part shaft", "gear");
    assert!(said.is_err(), "the cursor stands on a keyword");
    let said = editor.rename("/w/wheel.gng", "shaft {\n    material", "gear").unwrap_err();
    assert!(said.contains("there is a part `gear` already: /w/wheel.gng, line 55"), "{said}");
}

#[test]
fn references_come_from_all_specs() {
    let mut editor = two_specs();
    let found = editor.references("/w/parts/pin.gng", "pin {");
    let in_one = found.iter().filter(|(file, _)| file == "/w/one.gng").count();
    assert_eq!((found.len(), in_one), (5, 2), "{found:?}");
}
