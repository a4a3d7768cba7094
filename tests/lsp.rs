//! The language server as an editor meets it: a session with the program over its pipes, and answers one by one.

#![cfg(feature = "cli")]

mod editor;
#[path = "lsp/names.rs"]
mod names;
#[path = "lsp/session.rs"]
mod session;
#[path = "lsp/strange.rs"]
mod strange;
#[path = "lsp/typing.rs"]
mod typing;

use editor::Editor;
use serde_json::{Value, json};

/// Specs that use a file of parts, in a folder that the server knows.
fn two_specs() -> Editor {
    let parts = "gonogo 1\nlet size = 6 ±0.1\nmaterial m {\n    kind = matt\n}\npart pin {\n    material = m\n    let d = size\n    add body = cylinder(d = d, h = size)\n}\n";
    let spec = |name: &str| {
        format!(
            "gonogo 1\nuse \"parts/pin.gng\"\nassembly {name} {{\n    root pin\n    place b = pin on pin {{\n        z = size\n    }}\n}}\nstation s {{\n    light r = room()\n}}\n"
        )
    };
    let mut editor = Editor::with_files(&[
        ("/w/parts/pin.gng", parts.to_string()),
        ("/w/one.gng", spec("one")),
        ("/w/two.gng", spec("two")),
    ]);
    editor.open("/w/parts/pin.gng", parts);
    editor
}

#[test]
fn hovers_tell_limits_and_where_they_come_from() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\ntolerances ISO2768-m\nmaterial m {\n    kind = matt\n}\nlet t = 5 ±0.1 // ø 🔩\npart p {\n    material = m\n    add slab = box(x = 80, y = (2 * t), z = t)\n    cut bore = cylinder(d = 6 H7, h = through)\n    cut gap = cylinder(d = 0.5 in, h = 2 js7) at (20, 0, 3)\n}\nassembly a {\n    root p\n}\nstation s {\n    light r = room(power = 1 ±10 %)\n}\n";
    editor.open("/w/a.gng", spec);
    let mut expect = |needle: &str, said: &[&str]| {
        let hover = editor.hover("/w/a.gng", needle);
        said.iter().for_each(|part| assert!(hover.contains(part), "{needle}: `{part}` is not in\n{hover}"));
    };
    expect("6 H7", &["6.000 … 6.012 mm", "MMC 6.000, LMC 6.012", "ISO 286 hole class H7: +0.012/0 mm", "p.bore.d"]);
    expect("80, y", &["79.700 … 80.300 mm", "MMC 80.300, LMC 79.700", "general tolerance ISO2768-m: ±0.3 mm"]);
    expect("(2 * t)", &["9.800 … 10.200 mm", "MMC 10.200, LMC 9.800", "arithmetic"]);
    expect("5 ±0.1", &["4.900 … 5.100 mm", "tolerance as written"]);
    expect("t)\n", &["dimension `t`", "4.900 … 5.100 mm"]);
    expect("0.5 in", &["12.500 … 12.900 mm", "general tolerance ISO2768-m: ±0.2 mm"]);
    expect("2 js7", &["1.995 … 2.005 mm", "shaft class js7"]);
    expect("cut gap", &["cuts a shape"]);
    expect("cylinder(d = 6", &["cylinder(d, h, chamfer, chamfer_top, chamfer_bottom)", "a cylinder about z"]);
    expect("h = through", &["height", "through"]);
    expect("room(", &["light from the whole upper hemisphere"]);
    expect("root p", &["the part that the others stand on"]);
    expect("p\n}\nstation", &["part `p`", "component `p`"]);
    expect("m\n    add slab", &["material `m`"]);
    expect("1 ±10 %", &["0.9 … 1.1"]);
}

#[test]
fn hovers_work_while_the_spec_is_broken() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\nmaterial m {\n    kind = matt\n}\npart p {\n    material = m\n    add slab = box(x = 8 g6, y = 5, z = 5)\n    cut bore = cylinder(d = , h = 3)\n}\n";
    editor.open("/w/a.gng", spec);
    let hover = editor.hover("/w/a.gng", "8 g6");
    assert!(hover.contains("7.986 … 7.995 mm") && hover.contains("MMC 7.995, LMC 7.986"), "{hover}");
}

#[test]
fn unsaved_texts_count_before_the_disk() {
    let mut editor = two_specs();
    let spec = editor.disk("/w/one.gng");
    editor.open("/w/one.gng", &spec);
    let shown = editor.shown("/w/one.gng");
    assert!(shown.iter().all(|d| d["severity"] != 1), "{shown:?}");
    editor.change("/w/parts/pin.gng", "let size", "let sizes");
    let shown = editor.shown("/w/one.gng");
    assert!(
        shown.iter().any(|d| d["code"] == "E0201" && d["message"].as_str().unwrap().contains("`size`")),
        "{shown:?}"
    );
    assert!(editor.shown("/w/parts/pin.gng").iter().any(|d| d["code"] == "E0201"));
    editor.close("/w/parts/pin.gng");
    assert!(editor.shown("/w/one.gng").iter().all(|d| d["severity"] != 1));
}

#[test]
fn a_file_of_parts_alone_is_no_error() {
    let mut editor = Editor::new();
    editor.open(
        "/w/parts.gng",
        "gonogo 1\nmaterial m {\n    kind = matt\n}\npart p {\n    material = m\n    add a = sphere(d = 1)\n}\n",
    );
    let shown = editor.shown("/w/parts.gng");
    assert_eq!(shown.iter().map(|d| d["severity"].as_i64().unwrap()).collect::<Vec<_>>(), [4], "{shown:?}");
}

#[test]
fn other_places_are_related_information() {
    let mut editor = Editor::new();
    editor.open("/w/a.gng", "gonogo 1\nlet a = 1 // ±🔩\nlet a = 2\n");
    let shown = editor.shown("/w/a.gng");
    let twice = shown.iter().find(|d| d["code"] == "E0202").unwrap();
    assert_eq!(twice["range"], json!({ "start": { "line": 2, "character": 4 }, "end": { "line": 2, "character": 5 } }));
    let related = &twice["relatedInformation"][0];
    assert_eq!(related["location"]["range"]["start"], json!({ "line": 1, "character": 4 }));
    assert_eq!(related["message"], "first defined here");
}

#[test]
fn families_and_their_members_are_known() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\nuse \"std/iso2338\"\nmaterial m {\n    kind = matt\n}\npart post(d, h) {\n    material = m\n    table d (size) {\n        row 6 = (6 m6)\n        row 8 = (8 m6)\n    }\n    add body = cylinder(d = size, h = h)\n}\npart a = post(d = 6, h = 20)\npart pin = iso2338(d = 6, l = 20)\nassembly t {\n    root a\n    place pin on a.body {\n        z = 20\n    }\n}\nstation s {\n    light r = room()\n}\n";
    editor.open("/w/a.gng", spec);
    let shown = editor.shown("/w/a.gng");
    assert!(shown.iter().all(|d| d["severity"] != 1), "{shown:#?}");
    for (at, line) in [
        ("post(d = 6", "part post(d, h) {"),
        ("body {\n        z", "add body = cylinder(d = size, h = h)"),
        ("size, h = h)", "table d (size) {"),
        ("d = 6, h", "part post(d, h) {"),
        ("a.body {", "root a"),
    ] {
        assert_eq!(editor.definition_line("/w/a.gng", at), line, "{at}");
    }
    assert!(
        editor.hover("/w/a.gng", "iso2338(d").contains("Parallel pins"),
        "{}",
        editor.hover("/w/a.gng", "iso2338(d")
    );
    assert!(editor.hover("/w/a.gng", "6 m6").contains("6.004 … 6.012 mm"), "{}", editor.hover("/w/a.gng", "6 m6"));
    let renamed = editor.rename("/w/a.gng", "post(d = 6", "column").unwrap();
    assert!(
        renamed["/w/a.gng"].contains("part column(d, h) {") && renamed["/w/a.gng"].contains("part a = column(d = 6")
    );
    let said = editor.rename("/w/a.gng", "iso2338(d", "x").unwrap_err();
    assert!(said.contains("not yours to change"), "{said}");
    editor.open("/w/a.gng", &spec.replace("part pin = iso2338(d = 6, l = 20)", "part pin = iso2338(d = "));
    let at = spec.find("iso2338(d = ").unwrap() + "iso2338(d = ".len();
    let found = editor.complete("/w/a.gng", at);
    assert!(found.contains(&"2.5".to_string()) && found.contains(&"50".to_string()), "{found:?}");
}

#[test]
fn dimensions_of_other_pieces_are_known() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\nuse \"std/iso7089\"\nmaterial m {\n    kind = matt\n}\npart plate {\n    material = m\n    let depth = 10 ±0.2\n    add body = box(x = 30, y = 30, z = depth)\n}\npart washer = iso7089(d = M5)\nassembly t {\n    root plate\n    place washer on plate {\n        z = plate.depth\n    }\n    place lid = plate on washer {\n        z = (washer.h + 0 * lid.depth)\n    }\n}\nstation s {\n    light r = room()\n}\n";
    editor.open("/w/a.gng", spec);
    let shown = editor.shown("/w/a.gng");
    assert!(shown.iter().all(|d| d["severity"] != 1), "{shown:#?}");
    assert_eq!(editor.definition_line("/w/a.gng", "depth\n    }"), "let depth = 10 ±0.2");
    assert_eq!(editor.definition_line("/w/a.gng", "plate.depth"), "root plate");
    let hover = editor.hover("/w/a.gng", "plate.depth");
    assert!(hover.contains("9.800 … 10.200 mm"), "{hover}");
    let renamed = editor.rename("/w/a.gng", "depth\n    }", "thick").unwrap();
    let text = &renamed["/w/a.gng"];
    assert!(text.contains("let thick = 10 ±0.2") && text.contains("z = plate.thick\n"), "{text}");
    for (typed, line) in [("plate.", "        z = plate."), ("(washer.", "        z = (washer.")] {
        let text = spec.replacen("        z = plate.depth", line, 1);
        editor.open("/w/a.gng", &text);
        let found = editor.complete("/w/a.gng", text.find(line).unwrap() + line.len());
        let wanted = if typed == "plate." { "depth" } else { "h" };
        assert!(found.contains(&wanted.to_string()) && !found.contains(&"lid".to_string()), "{typed}: {found:?}");
    }
    let text = spec.replacen("z = plate.depth", "z = ", 1);
    editor.open("/w/a.gng", &text);
    let found = editor.complete("/w/a.gng", text.find("z = \n").unwrap() + 4);
    assert!(found.contains(&"plate".to_string()), "{found:?}");
}

#[test]
fn fixes_are_code_actions() {
    let mut editor = Editor::new();
    let spec = "gonogo 1\nlet ab = 6 // ±🔩\nlet c = ab + 2\n";
    editor.open("/w/a.gng", spec);
    let actions = editor.actions("/w/a.gng", "ab + 2");
    let fix = actions.iter().find(|a| a["kind"] == "quickfix").unwrap_or_else(|| panic!("{actions:#?}"));
    assert_eq!((&fix["isPreferred"], &fix["diagnostics"][0]["code"]), (&json!(true), &json!("E0103")));
    let edits = fix["edit"]["changes"]["file:///w/a.gng"].as_array().unwrap();
    assert!(editor::applied(spec, edits).contains("let c = (ab + 2)\n"));
}

#[test]
fn hints_stand_behind_fits_and_general_tolerances() {
    let mut editor = Editor::new();
    editor.open("/w/plate.gng", include_str!("../specs/pinned_plate.gng"));
    let whole = json!({ "start": { "line": 0, "character": 0 }, "end": { "line": 9999, "character": 0 } });
    let hints = editor.ask("textDocument/inlayHint", "/w/plate.gng", json!({ "range": whole }));
    let labels: Vec<&str> = hints.as_array().unwrap().iter().map(|h| h["label"].as_str().unwrap()).collect();
    assert!(labels.contains(&"6.000 … 6.012"), "{labels:?}");
}

#[test]
fn symbols_form_a_tree() {
    let mut editor = Editor::new();
    editor.open("/w/wheel.gng", include_str!("../specs/pattern_wheel.gng"));
    let symbols = editor.ask("textDocument/documentSymbol", "/w/wheel.gng", json!({}));
    let named =
        |list: &Value, name: &str| list.as_array().unwrap().iter().find(|s| s["name"] == name).cloned().unwrap();
    assert_eq!(named(&named(&symbols, "gear")["children"], "bore")["detail"], "feature");
    assert_eq!(named(&named(&symbols, "pattern_wheel")["children"], "hd_pin")["detail"], "component hd_pin");
    let colours = editor.ask("textDocument/semanticTokens/full", "/w/wheel.gng", json!({}));
    assert_eq!(colours["data"].as_array().unwrap().len() % 5, 0);
    let help = editor.signature("/w/wheel.gng", "from = 90 deg)");
    assert_eq!(
        (help["signatures"][0]["label"].as_str(), help["activeParameter"].as_u64()),
        (Some("circle(d, r, from, step)"), Some(2))
    );
}

#[test]
fn pages_of_diagnostics_are_a_command() {
    let mut editor = Editor::new();
    let ask = |arguments: Value| json!({ "command": "gonogo.explain", "arguments": arguments });
    let page = editor.raw("workspace/executeCommand", ask(json!(["e0305"]))).unwrap();
    assert_eq!(page.as_str(), gonogo::diag::explain("E0305"));
    for wrong in [json!([]), json!(["E9999"]), json!([7]), json!({})] {
        assert!(editor.raw("workspace/executeCommand", ask(wrong)).is_err());
    }
}
