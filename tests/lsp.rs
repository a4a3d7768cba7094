//! The language server as an editor meets it: a session with the program over its pipes, and answers one by one.

#![cfg(feature = "cli")]

mod editor;

use editor::{Editor, WHEEL, position};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

/// The program at the other end of a pipe.
struct Session {
    child: Child,
    out: BufReader<ChildStdout>,
    next: i64,
    /// Notifications that came while something else was waited for.
    kept: Vec<Value>,
}

impl Session {
    fn start() -> Session {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        let child = command.arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        let mut child = child.spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Session { child, out, next: 0, kept: Vec::new() }
    }

    fn send(&mut self, message: &Value) {
        let text = message.to_string();
        let input = self.child.stdin.as_mut().unwrap();
        write!(input, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        input.flush().unwrap();
    }

    fn receive(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            assert!(self.out.read_line(&mut line).unwrap() > 0, "the server has closed its pipe");
            match line.trim_end().split_once(": ") {
                Some(("Content-Length", n)) => length = n.parse().unwrap(),
                Some(_) => {}
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.out.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }

    fn notify(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The whole response.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let message = self.receive();
            if message["id"] == json!(id) {
                return message;
            }
            self.kept.push(message);
        }
    }

    fn result(&mut self, method: &str, params: Value) -> Value {
        let response = self.ask(method, params);
        assert!(response["error"].is_null(), "{method}: {response}");
        response["result"].clone()
    }

    /// The next diagnostics of a text in a version that `wanted` likes.
    fn diagnostics(&mut self, version: i64, wanted: impl Fn(&[Value]) -> bool) -> Vec<Value> {
        let mut early = std::mem::take(&mut self.kept).into_iter();
        loop {
            let message = early.next().unwrap_or_else(|| self.receive());
            let is_it =
                message["method"] == "textDocument/publishDiagnostics" && message["params"]["version"] == version;
            if let (true, Some(list)) = (is_it, message["params"]["diagnostics"].as_array())
                && wanted(list)
            {
                return list.clone();
            }
        }
    }
}

/// An edit of the text: the server is told, and the text follows.
fn type_over(session: &mut Session, text: &mut String, version: i64, old: &str, new: &str) {
    let at = text.find(old).unwrap();
    let range = json!({ "start": position(text, at), "end": position(text, at + old.len()) });
    *text = text.replacen(old, new, 1);
    session.notify(
        "textDocument/didChange",
        json!({ "textDocument": { "uri": WHEEL, "version": version }, "contentChanges": [{ "range": range, "text": new }] }),
    );
}

#[test]
fn a_session_over_pipes() {
    let mut session = Session::start();
    let refused = session.ask("textDocument/hover", json!({}));
    assert_eq!(refused["error"]["code"], -32002);
    let capabilities = session.result("initialize", json!({ "processId": null, "rootUri": null, "capabilities": {} }));
    assert_eq!(capabilities["capabilities"]["renameProvider"]["prepareProvider"], true);
    session.notify("initialized", json!({}));

    let mut text = include_str!("../specs/pattern_wheel.gng").to_string();
    let document = json!({ "uri": WHEEL, "languageId": "gonogo", "version": 1, "text": text });
    session.notify("textDocument/didOpen", json!({ "textDocument": document }));
    assert_eq!(session.diagnostics(1, |_| true), Vec::<Value>::new(), "the quick stages find nothing");
    // The slow stages begin by themselves when nothing is typed.
    let slow = session.diagnostics(1, |list| !list.is_empty());
    assert!(slow.iter().all(|d| d["code"] == "W0502" && d["severity"] == 2), "{slow:#?}");

    // Broken, and mended.
    type_over(&mut session, &mut text, 2, "material = brass\n", "material = bras\n");
    let broken = session.diagnostics(2, |_| true);
    assert_eq!((broken.len(), &broken[0]["code"]), (1, &json!("E0201")), "{broken:#?}");
    assert!(broken[0]["message"].as_str().unwrap().contains("help: did you mean `brass`?"), "{broken:#?}");
    type_over(&mut session, &mut text, 3, "material = bras\n", "material = brass // ±µ🔩\n");
    assert_eq!(session.diagnostics(3, |_| true), Vec::<Value>::new());
    session.notify("textDocument/didSave", json!({ "textDocument": { "uri": WHEEL } }));
    assert_eq!(session.diagnostics(3, |list| !list.is_empty()).len(), slow.len());

    let at = |text: &str, needle: &str, skip: usize| json!({ "textDocument": { "uri": WHEEL }, "position": position(text, text.find(needle).unwrap() + skip) });
    let hover = session.result("textDocument/hover", at(&text, "4 +0.012/0 each", 0));
    let said = hover["contents"]["value"].as_str().unwrap();
    assert!(said.contains("4.000 … 4.012 mm") && said.contains("MMC 4.000, LMC 4.012"), "{said}");
    let definition = session.result("textDocument/definition", at(&text, "on wheel_a1.hd_hole", 4));
    let expected = position(&text, text.find("place wheel_a1 on").unwrap() + "place ".len());
    assert_eq!(definition["range"]["start"], expected);

    let mut rename = at(&text, "let gear_height", 5);
    rename["newName"] = json!("height_of_gear");
    let edits = session.result("textDocument/rename", rename.clone());
    let edits = edits["changes"][WHEEL].as_array().unwrap().clone();
    assert_eq!(edits.len(), text.matches("gear_height").count());
    rename["newName"] = json!("each");
    let refused = session.ask("textDocument/rename", rename);
    assert_eq!(refused["error"]["message"], "`each` is a word of the language");

    type_over(&mut session, &mut text, 4, "    root gear\n", "root   gear\n\n\n");
    session.diagnostics(4, |_| true);
    let options = json!({ "tabSize": 4, "insertSpaces": true });
    let edits =
        session.result("textDocument/formatting", json!({ "textDocument": { "uri": WHEEL }, "options": options }));
    let laid_out = editor::applied(&text, edits.as_array().unwrap());
    assert_eq!(laid_out, gonogo::syntax::format(&text).unwrap());

    let malformed = session.ask("textDocument/hover", json!({ "textDocument": 7 }));
    assert_eq!(malformed["error"]["code"], -32602, "{malformed}");
    assert_eq!(session.ask("no/such", json!(null))["error"]["code"], -32601);
    session.notify("textDocument/didChange", json!([1, 2, 3]));
    assert_eq!(session.result("shutdown", json!(null)), Value::Null);
    session.notify("exit", json!(null));
    assert!(session.child.wait().unwrap().success());
}

#[test]
fn a_client_that_goes_without_a_word_is_noticed() {
    let mut session = Session::start();
    drop(session.child.stdin.take());
    assert_eq!(session.child.wait().unwrap().code(), Some(1));
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
fn names_lead_to_their_definitions() {
    let mut editor = Editor::new();
    editor.open("/w/wheel.gng", include_str!("../specs/pattern_wheel.gng"));
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
    editor.open("/w/wheel.gng", include_str!("../specs/pattern_wheel.gng"));
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
    editor.open("/w/wheel.gng", include_str!("../specs/pattern_wheel.gng"));
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
fn completion_knows_the_place() {
    let mut editor = Editor::new();
    let wheel = include_str!("../specs/pattern_wheel.gng");
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

/// All requests that take a place in a text.
const METHODS: [&str; 13] = [
    "textDocument/hover",
    "textDocument/completion",
    "textDocument/signatureHelp",
    "textDocument/definition",
    "textDocument/references",
    "textDocument/documentHighlight",
    "textDocument/documentSymbol",
    "textDocument/codeAction",
    "textDocument/formatting",
    "textDocument/prepareRename",
    "textDocument/rename",
    "textDocument/inlayHint",
    "textDocument/semanticTokens/full",
];

#[test]
fn messages_that_make_no_sense_are_answered() {
    let mut editor = Editor::new();
    editor.open("/w/a.gng", "gonogo 1\nlet a = 1\n");
    let wrong = [json!(null), json!(7), json!("x"), json!([]), json!({}), json!({ "textDocument": { "uri": 1 } })];
    for method in METHODS.iter().chain(&["workspace/symbol", "workspace/executeCommand"]) {
        for params in &wrong {
            assert!(editor.raw(method, params.clone()).is_err(), "{method} {params}");
        }
    }
    // Texts that are not open, and places that are nowhere.
    let far = json!({ "line": 4_000_000_000_u32, "character": 4_000_000_000_u32 });
    for uri in ["file:///w/a.gng", "file:///w/none.gng", "untitled:Untitled-1", "file://host/%ff"] {
        for method in METHODS {
            let params = json!({
                "textDocument": { "uri": uri }, "position": far, "newName": "b", "options": { "tabSize": 4, "insertSpaces": true },
                "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1, "isRetrigger": false }, "range": { "start": far, "end": far },
            });
            let answer = editor.raw(method, params);
            assert!(answer.is_ok() || method == "textDocument/rename", "{method} {uri}: {answer:?}");
        }
    }
    assert!(editor.raw("initialize", json!({})).is_err());
}

#[test]
fn texts_that_were_never_saved_have_answers() {
    let mut editor = Editor::new();
    let text = "gonogo 1\nlet a = 6 H7\nlet b = (a * 2)\n";
    let document = json!({ "uri": "untitled:Untitled-1", "languageId": "gonogo", "version": 1, "text": text });
    editor.notify("textDocument/didOpen", json!({ "textDocument": document }));
    let at = json!({ "textDocument": { "uri": "untitled:Untitled-1" }, "position": { "line": 2, "character": 9 } });
    let hover = editor.raw("textDocument/hover", at).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("6.000 … 6.012 mm"), "{hover}");
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]

    /// A spec cut and pasted at random has answers everywhere.
    #[test]
    fn no_text_and_no_place_is_too_strange(
        at in 0.0f64..1.0,
        cut in 0usize..60,
        paste in proptest::sample::select(vec!["", "(", "{", "}", "±µ🔩", " \n", "part x {\n add y = ", "on gear.", "// ", "\"", "\r"]),
        places in proptest::collection::vec((0u32..200, 0u32..90), 4),
    ) {
        let text = include_str!("../specs/pinned_plate.gng");
        let start = text.floor_char_boundary((at * text.len() as f64) as usize);
        let end = text.ceil_char_boundary((start + cut).min(text.len()));
        let mut editor = Editor::new();
        editor.open("/w/a.gng", &format!("{}{paste}{}", &text[..start], &text[end..]));
        for (line, character) in places {
            let position = json!({ "line": line, "character": character });
            for method in METHODS {
                let params = json!({
                    "textDocument": { "uri": "file:///w/a.gng" }, "position": position, "newName": "other",
                    "options": { "tabSize": 4, "insertSpaces": true },
                    "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1, "isRetrigger": false },
                    "range": { "start": position, "end": position },
                });
                let answer = editor.raw(method, params);
                proptest::prop_assert!(answer.is_ok() || method == "textDocument/rename", "{method}: {answer:?}");
            }
        }
    }
}
