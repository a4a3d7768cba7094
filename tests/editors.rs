//! The files for editors, and the words that completions and hovers know, held against the grammar and the compiler.

#![cfg(feature = "cli")]

use fancy_regex::Regex;
use gonogo::lsp::words::{GENERAL, HOLES, KEYWORDS, OWNERS, Owner, Role, SHAFTS, UNITS};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

fn file(name: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(name)).unwrap()
}

fn json(name: &str) -> Value {
    serde_json::from_str(&file(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The words in quotes in the grammar: those of two letters and more.
fn grammar_words() -> BTreeSet<String> {
    let grammar = file("grammar/gonogo.pest");
    let code =
        grammar.lines().map(|line| line.split("//  ").next().unwrap()).filter(|l| !l.trim_start().starts_with("//"));
    let quoted = Regex::new("\"([a-z]{2,})\"").unwrap();
    let mut words = BTreeSet::new();
    for line in code {
        words.extend(quoted.captures_iter(line).map(|c| c.unwrap()[1].to_string()));
    }
    assert!(words.contains("assembly") && words.contains("mmc") && words.len() > 40, "{words:?}");
    words
}

#[test]
fn every_word_of_the_grammar_is_known_to_editors() {
    let known: BTreeSet<&str> = KEYWORDS.iter().map(|k| k.word).collect();
    let colours = file("editors/gonogo.tmLanguage.json");
    let word = Regex::new("[a-z]+").unwrap();
    let coloured: BTreeSet<String> = word.find_iter(&colours).map(|m| m.unwrap().as_str().to_string()).collect();
    for word in grammar_words() {
        assert!(known.contains(word.as_str()), "`{word}` is in the grammar but not in src/lsp/keywords.rs");
        assert!(coloured.contains(&word), "`{word}` is in the grammar but not in editors/gonogo.tmLanguage.json");
    }
}

/// What the compiler says an owner takes, when it is given something else.
fn taken(owner: &Owner) -> Vec<String> {
    let wrong = "zzz = 1";
    let name = owner.name;
    let part = |statement: String| {
        format!("part p {{\n    material = m\n    add b = box(x = 9, y = 9, z = 9)\n    {statement}\n}}\n")
    };
    let item = match (owner.role, name) {
        (Role::Shape, _) => part(format!("cut c = {name}({wrong})")),
        (Role::Pattern, _) => part(format!("cut c = 2x sphere(d = 1) on {name}({wrong})")),
        (Role::Light, _) => format!("station s {{\n    light l = {name}({wrong})\n}}\n"),
        (Role::Options, _) => format!("inspect {{\n    {name} p ({wrong})\n}}\n"),
        (Role::Block, "material") => format!("material x {{\n    {wrong}\n}}\n"),
        (Role::Block, "part") => part(wrong.to_string()),
        (Role::Block, "place") => {
            format!("assembly a {{\n    root p\n    place q = p on p {{\n        {wrong}\n    }}\n}}\n")
        }
        (Role::Block, "camera" | "floor" | "vary") => {
            format!("station s {{\n    {name} {{\n        {wrong}\n    }}\n}}\n")
        }
        (Role::Block, _) => format!("{name} {{\n    {wrong}\n}}\n"),
    };
    let rest = [("part p", part(String::new())), ("assembly a", "assembly a {\n    root p\n}\n".to_string())];
    let rest: String = rest.iter().filter(|(head, _)| !item.contains(head)).map(|(_, text)| text.as_str()).collect();
    let text = format!("gonogo 1\nmaterial m {{\n    kind = matt\n}}\n{item}{rest}");
    let loaded = gonogo::design::load("x.gng", &|_| Ok(text.clone()), &[]);
    let fault = loaded
        .diagnostics
        .iter()
        .find(|d| d.code == "E0206")
        .unwrap_or_else(|| panic!("{text}\n{:#?}", loaded.diagnostics));
    let said: Vec<&String> = fault.notes.iter().chain(&fault.help).collect();
    let list = said.iter().find_map(|text| text.split_once("it takes ")).unwrap_or_else(|| panic!("{fault:#?}")).1;
    list.split(['`', ',', ' ']).filter(|word| !word.is_empty()).map(str::to_string).collect()
}

#[test]
fn arguments_and_fields_are_those_of_the_compiler() {
    for owner in OWNERS {
        let known: Vec<&str> = owner.arguments.iter().map(|a| a.name).collect();
        assert_eq!(known, taken(owner), "{}", owner.name);
    }
}

#[test]
fn shapes_units_and_classes_are_those_of_the_compiler() {
    let load = |text: &str| gonogo::design::load("x.gng", &|_| Ok(text.to_string()), &[]).diagnostics;
    let unknown = |words: &str| load(&format!("gonogo 1\npart p {{\n    add b = {words}\n}}\n"));
    let shapes = unknown("nothing(d = 1)").into_iter().find(|d| d.code == "E0201").unwrap();
    for owner in OWNERS.iter().filter(|o| o.role == Role::Shape) {
        assert!(shapes.notes[0].contains(owner.name), "{}: {shapes:?}", owner.name);
    }
    assert_eq!(shapes.notes[0].split(',').count(), OWNERS.iter().filter(|o| o.role == Role::Shape).count());
    for (unit, _) in UNITS {
        assert!(!load(&format!("gonogo 1\nlet a = 1 {unit}\n")).iter().any(|d| d.code == "E0204"), "{unit}");
    }
    for (class, _) in GENERAL {
        assert!(!load(&format!("gonogo 1\ntolerances {class}\n")).iter().any(|d| d.code == "E0302"), "{class}");
    }
    for class in HOLES.iter().chain(SHAFTS) {
        assert!(gonogo::iso::fit(class, 20.0).is_ok(), "{class}");
    }
}

/// A rule of the colours: what it looks for, and the scope of the whole and of its groups.
struct Rule {
    pattern: Regex,
    scope: Option<String>,
    groups: Vec<(usize, String)>,
}

fn rules(grammar: &Value, patterns: &Value, out: &mut Vec<Rule>) {
    for rule in patterns.as_array().unwrap() {
        if let Some(name) = rule["include"].as_str() {
            let included = &grammar["repository"][name.strip_prefix('#').unwrap()];
            assert!(included.is_object(), "{name} is not in the repository");
            rules(grammar, &Value::Array(vec![included.clone()]), out);
        } else if rule["patterns"].is_array() {
            rules(grammar, &rule["patterns"], out);
        } else {
            let groups = rule["captures"].as_object().into_iter().flatten();
            let groups = groups.map(|(number, c)| (number.parse().unwrap(), c["name"].as_str().unwrap().to_string()));
            out.push(Rule {
                pattern: Regex::new(rule["match"].as_str().unwrap()).unwrap(),
                scope: rule["name"].as_str().map(str::to_string),
                groups: groups.collect(),
            });
        }
    }
}

/// The scope of every byte of a line, as an editor finds it: the first match from the left, of equals the first rule.
fn scopes(rules: &[Rule], line: &str) -> Vec<String> {
    let mut scopes = vec![String::new(); line.len()];
    let mut at = 0;
    while at < line.len() {
        let found = rules.iter().enumerate().filter_map(|(i, rule)| {
            let captures = rule.pattern.captures_from_pos(line, at).unwrap()?;
            Some((captures.get(0).unwrap().start(), i, captures))
        });
        let Some((_, i, captures)) = found.min_by_key(|(start, i, _)| (*start, *i)) else { break };
        let whole = captures.get(0).unwrap();
        let mut paint =
            |range: std::ops::Range<usize>, scope: &str| scopes[range].iter_mut().for_each(|s| *s = scope.to_string());
        rules[i].scope.iter().for_each(|scope| paint(whole.range(), scope));
        for (group, scope) in &rules[i].groups {
            captures.get(*group).iter().for_each(|m| paint(m.range(), scope));
        }
        assert!(whole.end() > at, "a rule matches nothing: {}", rules[i].pattern.as_str());
        at = whole.end();
    }
    scopes
}

fn colours() -> Vec<Rule> {
    let grammar = json("editors/gonogo.tmLanguage.json");
    let mut out = Vec::new();
    rules(&grammar, &grammar["patterns"], &mut out);
    out
}

#[test]
fn every_letter_of_the_specs_has_a_scope() {
    let rules = colours();
    for spec in ["pattern_wheel", "pinned_plate", "shapes", "four_screws"] {
        for line in file(&format!("specs/{spec}.gng")).lines() {
            let scopes = scopes(&rules, line);
            let bare = line.char_indices().find(|(at, c)| !c.is_whitespace() && scopes[*at].is_empty());
            assert!(bare.is_none(), "{spec}: `{line}` at {bare:?}");
        }
    }
}

#[test]
fn tokens_have_the_scopes_of_their_kind() {
    let rules = colours();
    for (line, token, scope) in [
        ("gonogo 1", "gonogo", "keyword"),
        ("units mm deg", "deg", "support.constant.unit"),
        ("tolerances ISO2768-m  // c", "ISO2768-m", "support.constant.tolerance"),
        ("use \"std/iso2338\"", "std", "string"),
        ("part gear {", "part", "storage.type"),
        ("part gear {", "gear", "entity.name.type"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "add", "keyword.operator.word"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "body", "entity.name.function"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "cylinder", "support.function"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "d =", "variable.parameter"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "50", "constant.numeric"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "±", "keyword.operator"),
        ("    add body     = cylinder(d = 50 ±0.1, h = gear_height)", "gear_height", "variable.other"),
        ("    cut pin_hole = 3x cylinder(d = 4 +0.012/0 each, h = through)", "3x", "constant.numeric.count"),
        ("    cut pin_hole = 3x cylinder(d = 4 +0.012/0 each, h = through)", "each", "storage.modifier"),
        ("    cut pin_hole = 3x cylinder(d = 4 +0.012/0 each, h = through)", "through", "storage.modifier"),
        ("    cut bore = cylinder(d = 6 H7) on circle(r = 18, from = 90 deg)", "H7", "support.constant.fit"),
        ("    cut bore = cylinder(d = 6 H7) on circle(r = 18, from = 90 deg)", "on", "keyword"),
        ("    cut bore = cylinder(d = 6 H7) on circle(r = 18, from = 90 deg)", "deg", "keyword.other.unit"),
        ("    cut bore = cylinder(d = 6 H7) on circle(r = 18, from = 90 deg)", "circle", "support.function"),
        ("    cut a = 2x group at (0, 0, 1) on line(pitch = 3) {", "group", "support.function"),
        ("    let tip_d  = 3 -0.003/-0.010", "tip_d", "variable.other.constant"),
        ("        line edge to (5, 3)", "edge", "entity.name.tag"),
        ("        line to (5, 3) round 1", "round", "keyword"),
        ("    camera fixed {", "fixed", "storage.modifier"),
        ("    reflectance = 0.55 ±28 %", "%", "keyword.other.unit"),
        ("    h = { mmc 19.8, nominal 20.0, lmc 20.3 }", "mmc", "storage.modifier"),
        ("    place shaft on gear {", "shaft", "entity.name.function"),
        ("    watch pin (depth = 2)", "watch", "keyword"),
        ("train {", "train", "storage.type"),
        ("    // ± µ", "µ", "comment"),
    ] {
        let at = line.find(token).unwrap();
        let found = &scopes(&rules, line)[at];
        assert!(found.starts_with(scope), "`{token}` in `{line}`: {found}");
    }
}

#[test]
fn the_extension_is_whole() {
    let package = json("editors/vscode/package.json");
    let contributes = &package["contributes"];
    let language = &contributes["languages"][0];
    assert_eq!(language["extensions"], serde_json::json!([".gng"]));
    assert_eq!(contributes["grammars"][0]["scopeName"], json("editors/gonogo.tmLanguage.json")["scopeName"]);
    assert_eq!(contributes["grammars"][0]["language"], language["id"]);
    let main = package["main"].as_str().unwrap().trim_start_matches("./");
    let code = file(&format!("editors/vscode/{main}"));
    for command in contributes["commands"].as_array().unwrap() {
        assert!(code.contains(command["command"].as_str().unwrap()), "{command} is not in {main}");
    }
    assert!(code.contains("\"lsp\"") && package["dependencies"]["vscode-languageclient"].is_string());
    // Packaging copies the grammar to where the package looks for it.
    let grammar = contributes["grammars"][0]["path"].as_str().unwrap().trim_start_matches("./");
    let prepackage = package["scripts"]["prepackage"].as_str().unwrap();
    assert!(prepackage.contains("'../gonogo.tmLanguage.json'") && prepackage.contains(&format!("'{grammar}'")));
    let configuration = json("editors/vscode/language-configuration.json");
    assert_eq!(configuration["comments"]["lineComment"], "//");
    for rule in ["increaseIndentPattern", "decreaseIndentPattern"] {
        Regex::new(configuration["indentationRules"][rule].as_str().unwrap()).unwrap();
    }
}

/// The extension's own code, with the real server at the other end of its pipes: see tests/editor/extension.js.
#[test]
fn the_extension_starts_the_server_and_shows_its_pages() {
    let node = Command::new("node").arg("--version").output();
    if !node.is_ok_and(|node| node.status.success()) {
        return eprintln!("skipped: node is not installed");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new("node");
    command.arg(root.join("tests/editor/extension.js")).arg(root.join("editors/vscode/extension.js"));
    let output = command.arg(env!("CARGO_BIN_EXE_gonogo")).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = said.lines().collect();
    let titles = ["E0305", "E0102"].map(|code| format!("# {code}: {}", gonogo::diag::title(code).unwrap()));
    assert_eq!(lines, [&titles[0], "true", &titles[1], "2 to dispose of, ended with 0"], "{}", output.status);
}
