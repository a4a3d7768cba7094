//! Completion, which knows the place.

use crate::editor::Editor;
use crate::two_specs;

#[test]
fn completion_knows_the_place() {
    let mut editor = Editor::new();
    let wheel = include_str!("../../specs/pattern_wheel.gng");
    let mut expect = |before: &str, typed: &str, some: &[&str], none: &[&str]| {
        editor.open("/w/wheel.gng", &wheel.replacen(before, &format!("{before}{typed}"), 1));
        let at = wheel.find(before).unwrap() + before.len() + typed.len();
        let found = editor.complete("/w/wheel.gng", at);
        some.iter().for_each(|word| assert!(found.contains(&word.to_string()), "{typed}: no {word} in {found:?}"));
        none.iter().for_each(|word| assert!(!found.contains(&word.to_string()), "{typed}: {word} in {found:?}"));
    };
    expect("units mm deg\n", "pa", &["part", "assembly", "let"], &["add", "place"]);
    expect("part gear {\n", "    ", &["add", "cut", "keep", "outline", "material"], &["place", "part", "z"]);
    expect("part gear {\n", "    material = ", &["brass", "polished_steel"], &["gear", "through"]);
    expect("part gear {\n", "    add x = ", &["box", "cylinder", "countersink", "group"], &["circle", "room"]);
    expect("part gear {\n", "    cut x = cylinder(", &["d", "h", "chamfer"], &["x", "tip"]);
    expect("part gear {\n", "    cut x = cylinder(d = 6, ", &["h", "chamfer"], &["d"]);
    expect("part gear {\n", "    cut x = cylinder(d = 6 ", &["H7", "mm", "basic"], &["g6", "deg"]);
    expect("part gear {\n", "    add x = cylinder(d = 6 ", &["g6", "h6", "mm"], &["H7"]);
    expect("part gear {\n", "    cut x = cylinder(h = ", &["through", "gear_height"], &["foot"]);
    expect("part gear {\n", "    cut x = 3x sphere(d = 1) on ", &["circle", "line", "grid"], &["gear"]);
    expect(
        "    let tip_d  = 3 -0.003/-0.010\n",
        "    add x = box(x = (",
        &["foot", "collar", "gear_height"],
        &["brass"],
    );
    expect("    root gear\n", "    place x = ", &["shaft", "alignment_pin"], &["brass"]);
    expect("    root gear\n", "    place shaft on ", &["gear", "wheel_a1"], &["bore"]);
    expect("    root gear\n", "    place shaft on gear.", &["bore", "pin_hole"], &["hd_hole"]);
    expect("    place shaft on gear {\n", "        rz = ", &["free"], &["through"]);
    expect("    place shaft on gear {\n", "        ", &["x", "ry"], &["material"]);
    expect("station A {\n", "    light x = ", &["ring", "panel", "room"], &["box"]);
    expect("    false_reject = 0.1 %\n", "    watch ", &["shaft", "hd_pin"], &["bore"]);
    expect("train {\n", "    draw = ", &["uniform", "nominal"], &[]);
    expect("units mm deg\n", "tolerances ", &["ISO2768-m", "exact"], &[]);
    expect("// The pattern wheel", " pa", &[], &["part"]);
}

#[test]
fn completion_offers_files_to_use() {
    let mut editor = two_specs();
    editor.open("/w/one.gng", "gonogo 1\nuse \"par\n");
    let found = editor.complete("/w/one.gng", "gonogo 1\nuse \"par".len());
    assert_eq!(found[..2], ["parts/pin.gng", "two.gng"]);
    assert!(
        found[2..].iter().all(|name| name.starts_with("std/")) && found.contains(&"std/iso2338".to_string()),
        "{found:?}"
    );
}
