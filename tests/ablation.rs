//! The ablation tool edits a copy of the tree: each edit must still find its place.
//!
//! The table of switches is read by a few lines of our own: keys with strings and with literals in three quotes, as the
//! tool's file has them.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// An edit: where, what, and what in its place.
struct Edit {
    file: String,
    old: String,
    new: String,
}

#[test]
fn every_edit_finds_its_place_exactly_once() {
    let edits = edits(&table());
    assert!(edits.len() > 15, "only {} edits were read", edits.len());
    for Edit { file, old, .. } in &edits {
        let source = fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let found = source.matches(old.as_str()).count();
        assert_eq!(found, 1, "tools/ablation/switches.toml: {file} has {found} times\n{old}");
    }
}

/// Two edits of one place would each undo the other.
#[test]
fn edits_of_a_file_lie_apart() {
    let edits = edits(&table());
    for (i, a) in edits.iter().enumerate() {
        for b in edits[..i].iter().filter(|b| b.file == a.file) {
            let source = fs::read_to_string(root().join(&a.file)).unwrap();
            let place = |e: &Edit| source.find(e.old.as_str()).map(|at| at..at + e.old.len()).unwrap();
            let (p, q) = (place(a), place(b));
            assert!(p.end <= q.start || q.end <= p.start, "{}: two edits touch\n{}\n{}", a.file, a.old, b.old);
        }
    }
}

#[test]
fn every_switch_is_asked_for_and_every_row_throws_known_ones() {
    let table = table();
    let switches: BTreeSet<String> = sections(&table, "switch").iter().map(|s| string(s, "name")).collect();
    let asked: BTreeSet<String> = edits(&table).iter().flat_map(|edit| asked(&edit.new)).collect();
    assert_eq!(switches, asked, "switches of the table and those that the edits ask for");
    let rows = sections(&table, "row");
    let thrown = |row: &String| -> Vec<String> {
        let list = row.split("without = [").nth(1).unwrap().split(']').next().unwrap();
        list.split(',').map(|name| name.trim().trim_matches('"').to_string()).filter(|n| !n.is_empty()).collect()
    };
    for row in &rows {
        assert!(thrown(row).iter().all(|name| switches.contains(name)), "{row}");
    }
    let all: BTreeSet<String> = rows.iter().flat_map(thrown).collect();
    assert_eq!(all, switches, "every switch is thrown in some row");
    assert!(rows.iter().any(|row| thrown(row).is_empty()), "one row has everything");
}

/// Files that the tool names beside the edits.
#[test]
fn what_renders_is_where_the_tool_looks_for_it() {
    let script = fs::read_to_string(root().join("tools/ablation/ablation.py")).unwrap();
    let start = script.find("RENDERER = ").unwrap();
    let lines = &script[start..start + script[start..].find("SHIPPED").unwrap()];
    let first = lines.lines().next().unwrap();
    let quoted = |line: &str| line.split('"').skip(1).step_by(2).map(String::from).collect::<Vec<_>>();
    assert!(!quoted(first).is_empty());
    for name in quoted(first) {
        assert!(root().join("src").join(&name).exists(), "src/{name}");
    }
    for line in lines.lines().skip(1).filter(|l| l.starts_with("RENDERER")) {
        let names = quoted(line);
        for name in &names[1..] {
            let path = root().join("src").join(names[0].replace("{name}", name));
            assert!(path.exists(), "{}", path.display());
        }
    }
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

/// Without comments.
fn table() -> String {
    let text = fs::read_to_string(root().join("tools/ablation/switches.toml")).unwrap();
    text.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect()
}

/// The bodies of all `[[name]]`.
fn sections(table: &str, name: &str) -> Vec<String> {
    let head = format!("[[{name}]]\n");
    let bodies = table.split("\n[[").map(|body| format!("[[{body}"));
    bodies.filter_map(|body| body.strip_prefix(&head).map(|b| format!("{b}\n"))).collect()
}

fn edits(table: &str) -> Vec<Edit> {
    let all = sections(table, "always").into_iter().chain(sections(table, "change"));
    all.map(|s| Edit { file: string(&s, "file"), old: literal(&s, "old"), new: literal(&s, "new") }).collect()
}

fn string(section: &str, key: &str) -> String {
    let rest = section.split(&format!("{key} = \"")).nth(1).unwrap_or_else(|| panic!("no {key} in\n{section}"));
    rest.split('"').next().unwrap().to_string()
}

/// A literal in three quotes; the line break after the first ones does not count.
fn literal(section: &str, key: &str) -> String {
    let rest = section.split(&format!("{key} = '''\n")).nth(1).unwrap_or_else(|| panic!("no {key} in\n{section}"));
    rest.split("'''").next().unwrap().to_string()
}

/// The switches a text asks for.
fn asked(text: &str) -> Vec<String> {
    let parts = text.split("::without(\"").skip(1);
    parts.map(|rest| rest.split('"').next().unwrap().to_string()).collect()
}
