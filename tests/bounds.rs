//! Specs that ask for too much: an error or a bounded cost, never a hang, a crash or an overflow of the stack.
//!
//! Each test would take minutes, gigabytes or the whole stack if nothing bounded it; none asserts a time.

#![cfg(feature = "compile")]

use gonogo::design::{Loaded, load};

/// A spec around the lines of a part and those of the assembly.
fn spec(part: &str, assembly: &str) -> String {
    format!(
        "gonogo 1\nmaterial steel {{\n    metal = steel\n}}\npart p {{\n    material = steel\n{part}}}\n\
         assembly a {{\n    root p\n{assembly}}}\nstation bench {{\n    light room = room(patches = 1)\n}}\n"
    )
}

fn loaded(text: &str) -> Loaded {
    load("x.gng", &|_| Ok(text.to_string()), &[])
}

/// The codes of what is wrong, each once.
fn codes(text: &str) -> Vec<&'static str> {
    let mut codes: Vec<&str> = loaded(text).diagnostics.iter().map(|d| d.code).collect();
    codes.sort_unstable();
    codes.dedup();
    codes
}

#[test]
fn ten_thousand_features_are_too_many() {
    let lines: String = (0..10_000).map(|i| format!("    add f{i} = box(x = 1, y = 1, z = 1)\n")).collect();
    assert_eq!(codes(&spec(&lines, "")), ["E0212"]);
}

#[test]
fn patterns_of_patterns_are_counted_before_they_are_built() {
    let nested = "add a = 1000x group on line(pitch = 1) {\n".repeat(12);
    let part = format!("{nested}add b = 1000x sphere(d = 1) on line(pitch = 2)\n{}", "}\n".repeat(12));
    assert_eq!(codes(&spec(&part, "")), ["E0212"]);
}

#[test]
fn a_large_part_in_many_pieces_is_too_much() {
    let part: String = (0..900).map(|i| format!("    add f{i} = box(x = 1, y = 1, z = 1) at ({i}, 0)\n")).collect();
    let places: String = (0..900).map(|i| format!("    place p{i} = p on p\n")).collect();
    assert_eq!(codes(&spec(&part, &places)), ["E0212"]);
}

#[test]
fn a_thousand_pieces_are_no_trouble() {
    let part = "    let h = 3 ±0.1\n    add foot = cylinder(d = 4 ±0.1, h = h)\n    \
                add head = 3x box(x = 2 ±0.1, y = 1, z = 1) at (0, 0, h) on circle(r = 1)\n";
    let places: String =
        (1..=1000).map(|i| format!("    place q{i} = p on p {{\n        x = {i} ±0.1\n    }}\n")).collect();
    let loaded = loaded(&spec(part, &places));
    assert!(loaded.diagnostics.is_empty(), "{:#?}", loaded.diagnostics);
    assert_eq!(loaded.design.unwrap().components.len(), 1001);
}

#[test]
fn many_features_that_move_are_judged_within_a_budget() {
    let moving = |i: usize| format!("    cut b{i} = cylinder(d = 1, h = through) at ({i} ±0.1, {} ±0.1)\n", 2 * i);
    let part: String = (0..500).map(moving).collect();
    let found = loaded(&spec(&format!("    add slab = box(x = 9000, y = 9000, z = 5)\n{part}"), ""));
    assert!(found.diagnostics.is_empty(), "{:#?}", found.diagnostics);
    let one = "    let pitch = 2 ±0.1\n    add slab = box(x = 9000, y = 9000, z = 5)\n    \
               cut b = 1000x cylinder(d = 1, h = through) on line(pitch = pitch)\n    \
               cut c = 1000x cylinder(d = 1, h = through) at (0, 5) on line(pitch = pitch)\n";
    assert!(loaded(&spec(one, "")).design.is_some());
}

#[test]
fn outlines_of_many_sides_are_checked_or_refused() {
    let outline = |sides: usize| {
        let step = |i: usize| {
            format!("        line to ({} ±0.01, {} ±0.01)\n", 10 * (i + 1), if i.is_multiple_of(2) { 3 } else { 5 })
        };
        let up: String = (0..sides - 2).map(step).collect();
        let end = format!("        line to ({}, -5)\n        line to (0, -5)\n", 10 * sides);
        format!("    outline saw {{\n        from (0, 5)\n{up}{end}    }}\n    add saw = prism(outline = saw, h = 3)\n")
    };
    assert!(loaded(&spec(&outline(190), "")).design.is_some());
    assert_eq!(codes(&spec(&outline(250), "")), ["E0212"]);
}

#[test]
fn names_in_long_chains_and_circles_have_no_value() {
    let chain: String = (0..200).map(|i| format!("    let a{i} = (a{} + 1 mm)\n", i + 1)).collect();
    let part = format!("{chain}    let a200 = 1\n    add slab = box(x = a0, y = 1, z = 1)\n");
    assert_eq!(codes(&spec(&part, "")), ["E0208"]);
    let part = "    let a = (b)\n    let b = (c)\n    let c = (a)\n    add slab = box(x = a, y = 1, z = 1)\n";
    assert_eq!(codes(&spec(part, "")), ["E0208"]);
}

#[test]
fn components_in_circles_and_long_chains_end() {
    let circle: String = (0..300).map(|i| format!("    place q{i} = p on q{}\n", (i + 1) % 300)).collect();
    assert_eq!(codes(&spec("    add slab = box(x = 1, y = 1, z = 1)\n", &circle)), ["E0504"]);
    let chain: String = (0..300).map(|i| format!("    place q{i} = p on q{}\n", i + 1)).collect();
    let part = "    add slab = box(x = 1, y = 1, z = 1)\n";
    assert!(loaded(&spec(part, &format!("{chain}    place q300 = p on p\n"))).design.is_some());
}

#[test]
fn a_thousand_unknown_and_very_long_names_are_reported_in_time() {
    let long = "x".repeat(100_000);
    let lets: String = (0..2_000).map(|i| format!("    let name_{i} = 1\n    let {long}{i} = 1\n")).take(600).collect();
    let part: String = (0..2_000).map(|i| format!("    add f{i} = box(x = nam_{i}, y = 1, z = 1)\n")).collect();
    let lets: String = lets.chars().take(400_000).collect();
    let lets = &lets[..lets.rfind('\n').map_or(0, |at| at + 1)];
    assert!(codes(&spec(&format!("{lets}{part}"), "")).contains(&"E0201"));
    let word = "    add f = bx(x = 1)\n".replace("bx", &long);
    assert!(codes(&spec(&word, "")).contains(&"E0201"));
}

#[test]
fn unplaced_parts_are_checked_once_each() {
    let parts: String = (0..3_000)
        .map(|i| format!("part u{i} {{\n    material = steel\n    add b = box(x = 1 ±0.1, y = 1, z = 1)\n}}\n"))
        .collect();
    let text =
        spec("    add slab = box(x = 1, y = 1, z = 1)\n", "").replacen("assembly", &format!("{parts}assembly"), 1);
    assert_eq!(codes(&text), ["W0209"]);
}

#[test]
fn infinite_and_missing_numbers_are_refused_everywhere() {
    for number in ["1e308", "-1e300", "(1 mm * (1e200 * 1e200))", "(0 mm * (1 / 0))", "1e9 mm", "(1 mm * (0 / 0))"] {
        for line in [
            format!("    add b = box(x = {number}, y = 1, z = 1)\n"),
            format!("    add b = box(x = 1, y = 1, z = 1) at ({number}, 0, 0)\n"),
            format!("    add b = 2x box(x = 1, y = 1, z = 1) on line(pitch = {number})\n"),
            format!(
                "    outline o {{\n from (0, 0)\n line to ({number}, 0)\n line to (1, 1)\n }}\n    add b = prism(outline = o, h = 1)\n"
            ),
            format!("    add b = cylinder(d = 10, h = 5, chamfer = {number})\n"),
        ] {
            let found = loaded(&spec(&line, ""));
            assert!(found.design.is_none() && !found.diagnostics.is_empty(), "{line}");
        }
    }
}

/// Text that opens far more than any stack could follow, closed or not.
#[test]
fn brackets_may_be_nested_a_hundred_thousand_deep() {
    const DEEP: usize = 100_000;
    for (before, opens, closes) in [
        ("let a = ", "(", ")"),
        ("let a = ", "(-", ")"),
        ("let a = ", "{ mmc ", " }"),
        ("part p {\nadd f = ", "box(x = ", ")"),
        ("", "part p {\n", "}\n"),
    ] {
        for depth in [0, DEEP] {
            let text = format!("gonogo 1\n{before}{}1{}\n", opens.repeat(DEEP), closes.repeat(depth));
            assert!(!codes(&text).is_empty() && gonogo::syntax::format(&text).is_err(), "{opens}");
        }
    }
}

#[test]
fn groups_may_be_nested_ten_thousand_deep() {
    const DEEP: usize = 10_000;
    for head in ["add g = group {\n", "cut g = 2x group on line(pitch = 1) {\n"] {
        let part = format!("{}add a = sphere(d = 1)\n{}", head.repeat(DEEP), "}\n".repeat(DEEP));
        assert_eq!(codes(&spec(&part, "")), ["E0101"]);
    }
}
