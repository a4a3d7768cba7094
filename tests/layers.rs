//! The house: a room uses only the rooms below it, and outside tools come in through one door each.

use std::fs;
use std::path::{Path, PathBuf};

/// Each room with the rooms it may use besides itself, from the ground up. `lib.rs` and `main.rs` are the page above.
const HOUSE: &[(&str, &[&str])] = &[
    ("units", &[]),
    ("rng", &[]),
    ("diag", &[]),
    ("cache", &[]),
    ("iso", &["units"]),
    ("runtime", &[]),
    ("ffi", &["runtime"]),
    ("syntax", &["diag"]),
    ("design", &["syntax", "iso", "diag", "units"]),
    ("variation", &["design", "rng", "units"]),
    ("solid", &["design", "diag", "units"]),
    ("assembly", &["solid", "variation", "design", "diag", "units"]),
    ("exchange", &["assembly", "solid", "design"]),
    ("drawing", &["assembly", "solid", "design"]),
    ("scene", &["assembly", "solid", "variation", "design", "runtime", "diag", "units", "rng"]),
    ("view", &["scene", "assembly", "solid", "design", "runtime", "diag", "units"]),
    ("render", &["scene", "solid", "design", "runtime", "units", "rng"]),
    (
        "train",
        &[
            "view",
            "render",
            "scene",
            "assembly",
            "solid",
            "variation",
            "design",
            "runtime",
            "cache",
            "diag",
            "units",
            "rng",
        ],
    ),
    (
        "report",
        &["train", "view", "scene", "exchange", "drawing", "assembly", "solid", "design", "runtime", "diag", "units"],
    ),
    ("golden", &[]),
    ("lsp", &["design", "syntax", "iso", "diag", "units"]),
    ("import", &["syntax", "diag"]),
    (
        "artifacts",
        &[
            "line", "train", "view", "render", "scene", "exchange", "drawing", "assembly", "solid", "design",
            "runtime", "units",
        ],
    ),
    (
        "line",
        &[
            "artifacts",
            "train",
            "view",
            "render",
            "scene",
            "assembly",
            "solid",
            "design",
            "runtime",
            "cache",
            "diag",
            "units",
        ],
    ),
    ("build", &["artifacts", "view", "runtime", "cache", "diag"]),
];

/// An outside crate and the files that may use it.
const DOORS: &[(&str, &[&str])] = &[
    ("pest", &["syntax/parse/"]),
    ("pest_derive", &["syntax/parse/"]),
    ("obvhs", &["render/accel.rs"]),
    ("libm", &["runtime/math.rs"]),
    ("clap", &["cli/"]),
    ("annotate_snippets", &["cli/"]),
    ("anstream", &["cli/"]),
    ("indicatif", &["cli/"]),
    ("serde_json", &["cli/", "lsp/", "drawing/json.rs"]),
    ("lsp_server", &["cli/"]),
    ("lsp_types", &["cli/", "lsp/"]),
];

/// Files outside the command line that may know files and clocks: the keeping of results, and what runs in a build script.
const AT_THE_DOOR: &[&str] = &["cache/folder.rs", "build.rs"];

/// What only the command line does.
const CLI_ONLY: &[&str] =
    &["println!", "eprintln!", "print!(", "eprint!(", "dbg!(", "std::fs", "std::env", "Instant", "SystemTime"];

struct Source {
    /// `view/choose.rs`
    path: String,
    /// Without comments and without the tests at its end.
    code: String,
}

impl Source {
    /// `view`
    fn room(&self) -> &str {
        let first = self.path.split('/').next().unwrap_or_default();
        first.strip_suffix(".rs").unwrap_or(first)
    }
}

#[test]
fn a_room_uses_only_rooms_below_it() {
    let mut broken = Vec::new();
    for source in sources() {
        let Some((room, below)) = HOUSE.iter().find(|(room, _)| *room == source.room()) else {
            assert!(["lib", "main", "cli"].contains(&source.room()), "{} stands in no room of the house", source.path);
            continue;
        };
        for used in rooms_used(&source.code) {
            if used != *room && !below.contains(&used.as_str()) {
                broken.push(format!("{} uses `crate::{used}`", source.path));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn outside_tools_come_in_through_one_door_each() {
    let mut broken = Vec::new();
    for source in sources() {
        for (tool, doors) in DOORS {
            let uses = [format!("use {tool}"), format!("{tool}::")].iter().any(|u| names(&source.code, u));
            if uses && !doors.iter().any(|door| source.path.starts_with(door)) {
                broken.push(format!("{} uses {tool}", source.path));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn only_the_command_line_prints_and_knows_files_and_clocks() {
    let mut broken = Vec::new();
    let inside = |s: &&Source| s.room() != "cli" && !AT_THE_DOOR.contains(&s.path.as_str());
    for source in sources().iter().filter(inside) {
        let said = CLI_ONLY.iter().filter(|word| names(&source.code, word));
        broken.extend(said.map(|word| format!("{}: {word}", source.path)));
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

#[test]
fn only_the_c_interface_may_be_unsafe() {
    for source in sources() {
        let told = names(&source.code, "unsafe ") || names(&source.code, "unsafe_code");
        let may = ["ffi.rs", "lib.rs"].contains(&source.path.as_str());
        assert!(may || !told, "{} speaks of unsafe", source.path);
    }
}

#[test]
fn the_runtime_needs_none_of_the_compilers_crates() {
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    for line in manifest.lines().filter(|l| l.contains("optional = true")) {
        let name = line.split_whitespace().next().unwrap().replace('-', "_");
        for source in sources().iter().filter(|s| s.room() == "runtime") {
            assert!(!names(&source.code, &format!("{name}::")), "{} uses {name}", source.path);
        }
    }
}

/// Each platform has its own sine; what judges must say the same on all of them.
#[test]
fn the_runtime_takes_transcendental_functions_from_one_place() {
    let of_the_platform = [
        "sin", "cos", "sin_cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "exp", "exp2",
        "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "hypot", "cbrt",
    ];
    for source in sources().iter().filter(|s| s.room() == "runtime" && s.path != "runtime/math.rs") {
        for name in of_the_platform {
            let called = [format!(".{name}("), format!("f64::{name}("), format!("f32::{name}(")];
            assert!(!called.iter().any(|c| source.code.contains(c)), "{} calls {name}", source.path);
        }
    }
}

#[test]
fn every_code_has_a_page() {
    let pages: Vec<&str> = gonogo::diag::codes().collect();
    for source in sources() {
        for code in codes(&source.code) {
            assert!(pages.contains(&code), "{}: {code} has no page in src/diag/explain", source.path);
        }
    }
}

#[test]
fn files_stay_short_enough_to_read() {
    const LONGEST: usize = 600;
    for source in sources() {
        let lines = source.code.lines().count();
        assert!(lines <= LONGEST, "{} has {lines} lines before its tests", source.path);
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn sources() -> Vec<Source> {
    let mut found = Vec::new();
    collect(&root().join("src"), "", &mut found);
    assert!(found.len() > 40, "the sources were not found");
    found
}

fn collect(folder: &Path, prefix: &str, found: &mut Vec<Source>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for entry in entries {
        let path = format!("{prefix}{}", entry.file_name().unwrap().to_str().unwrap());
        if entry.is_dir() {
            collect(&entry, &format!("{path}/"), found);
        } else if path.ends_with(".rs") && !is_for_tests(&path) {
            found.push(Source { code: code(&fs::read_to_string(&entry).unwrap()), path });
        }
    }
}

/// Files behind `#[cfg(test)]` may use what they like.
fn is_for_tests(path: &str) -> bool {
    path.contains("/tests/") || ["tests.rs", "sample.rs", "shapes.rs"].iter().any(|n| path.ends_with(&format!("/{n}")))
}

fn code(text: &str) -> String {
    let tests = text.find("#[cfg(test)]\nmod tests").unwrap_or(text.len());
    let lines = text[..tests].lines().map(|l| if l.trim_start().starts_with("//") { "" } else { l });
    lines.collect::<Vec<_>>().join("\n")
}

/// What follows `crate::`, also in the first level of `use crate::{…}`.
fn rooms_used(code: &str) -> Vec<String> {
    let word = |text: &str| text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut used = Vec::new();
    for (at, pattern) in code.match_indices("crate::") {
        let rest = &code[at + pattern.len()..];
        match rest.strip_prefix('{') {
            Some(list) => {
                let list = &list[..list.find('}').unwrap_or(list.len())];
                used.extend(list.split(',').map(|item| word(item.trim())));
            }
            None => used.push(word(rest)),
        }
    }
    // Names with a capital are items of lib.rs itself, re-exported from below.
    used.retain(|name| name.starts_with(|c: char| c.is_ascii_lowercase()));
    used
}

/// `E0305` and the like, behind a quotation mark.
fn codes(code: &str) -> impl Iterator<Item = &str> {
    let is_code = |c: &&str| c.starts_with(['E', 'W']) && c[1..].bytes().all(|b| b.is_ascii_digit());
    code.match_indices('"').filter_map(|(at, _)| code.get(at + 1..at + 6)).filter(is_code)
}

/// Whether `word` occurs without being the end of a longer name.
fn names(code: &str, word: &str) -> bool {
    code.match_indices(word).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        !before.is_some_and(|c| c.is_alphanumeric() || c == '_')
    })
}

#[test]
fn the_reader_of_uses_reads_them_all() {
    assert_eq!(
        rooms_used("use crate::view::x; use crate::{Stage, solid::y, rng}; crate::diag::z()"),
        ["view", "solid", "rng", "diag"]
    );
    assert!(names("use pest::Parser", "pest::") && !names("tempest::x", "pest::"));
}
