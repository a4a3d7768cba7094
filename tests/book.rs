//! The book in `docs/`: what it shows is what the program does.
//!
//! Fenced blocks are marked behind the language:
//!
//! - `gonogo`: a whole spec, which must load without a word. `gonogo,part`, `,assembly`, `,station`, `,inspect` are lines of
//!   such a block, `gonogo,top` blocks of a file; `fails=E0305` and `warns=W0310` say what the compiler must answer.
//! - `gonogo,file=lid.gng` begins a file in the chapter's folder, `add=lid.gng` goes on with it, and a `diff,file=lid.gng`
//!   block changes its lines.
//! - `console` blocks are run in that folder, line by line behind `$ `, and their output compared. `[..]` stands for any
//!   text in a line, `...` for any lines. Those marked `slow` are run where `CI` or `GONOGO_SLOW` is set.
//! - `c` and `js` blocks are compiled, `rust` blocks are tests of rustdoc (`src/lib.rs`).
//!
//! `GONOGO_BLESS=1` rewrites the output of the console blocks that are run, and the list of diagnostics.

#![cfg(feature = "cli")]

use block::{Block, blocks};
use gonogo::artifacts::Artifact;
use gonogo::diag::Diagnostic;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[path = "book/block.rs"]
mod block;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn src() -> PathBuf {
    root().join("docs/src")
}

fn blesses() -> bool {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|v| !v.is_empty());
    is_set("GONOGO_BLESS") && !is_set("CI")
}

/// Every chapter: its name in `docs/src`, and its text.
fn chapters() -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![src()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                let name = path.strip_prefix(src()).unwrap().to_str().unwrap().to_string();
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

fn chapter(name: &str) -> String {
    fs::read_to_string(src().join(name)).unwrap()
}

// --- Links -----------------------------------------------------------------------------------------------------------

#[test]
fn the_summary_lists_every_chapter_once() {
    let listed: Vec<String> = links(&chapter("SUMMARY.md"));
    let once: BTreeSet<&String> = listed.iter().collect();
    assert_eq!(once.len(), listed.len(), "{listed:?}");
    let names: Vec<String> = chapters().into_iter().map(|(name, _)| name).filter(|n| n != "SUMMARY.md").collect();
    let missing: Vec<&String> = names.iter().filter(|n| !once.contains(n)).collect();
    assert!(missing.is_empty(), "not in SUMMARY.md: {missing:?}");
}

#[test]
fn links_and_pictures_lead_somewhere() {
    let mut broken = Vec::new();
    let readme = fs::read_to_string(root().join("README.md")).unwrap();
    let pages = chapters().into_iter().map(|(name, text)| (src().join(name), text));
    for (page, text) in pages.chain([(root().join("README.md"), readme)]) {
        for link in links(&text).into_iter().filter(|l| !l.contains("://")) {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let known = anchor.is_empty() || fs::read_to_string(&target).is_ok_and(|t| anchors(&t).contains(anchor));
            if !target.exists() || !known {
                broken.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// By mdBook itself, where it is installed: without a warning, and with every link of every page in place.
#[test]
fn the_book_is_built_without_a_warning() {
    let Ok(version) = Command::new("mdbook").arg("--version").output() else {
        return eprintln!("skipped: mdbook is not installed");
    };
    assert!(version.status.success());
    let built = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mdbook");
    let _ = fs::remove_dir_all(&built);
    let output = Command::new("mdbook").args(["build", "docs", "-d"]).arg(&built).current_dir(root()).output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && !said.contains("WARN") && !said.contains("ERROR"), "{said}");
    let mut broken = Vec::new();
    for (name, _) in chapters().iter().filter(|(name, _)| name != "SUMMARY.md") {
        let page = built.join(name).with_extension("html");
        let html = fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
        for attribute in ["href=\"", "src=\""] {
            for (at, _) in html.match_indices(attribute) {
                let link = html[at + attribute.len()..].split('"').next().unwrap();
                let file = link.split('#').next().unwrap();
                let is_local = !file.is_empty() && !link.contains(':');
                if is_local && !page.parent().unwrap().join(file).exists() {
                    broken.push(format!("{name}: {link}"));
                }
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// What stands in `](…)`, outside of code.
fn links(text: &str) -> Vec<String> {
    let mut prose = String::new();
    let mut code = false;
    for line in text.lines() {
        if line.starts_with("```") {
            code = !code;
        } else if !code {
            // Between backticks nothing is a link.
            line.split('`').step_by(2).for_each(|part| prose.push_str(part));
            prose.push('\n');
        }
    }
    prose.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link.to_string()).collect()
}

/// The headings as mdBook names them in addresses.
fn anchors(text: &str) -> BTreeSet<String> {
    let headings = text.lines().filter(|l| l.starts_with('#')).map(|l| l.trim_start_matches('#').trim().to_lowercase());
    let kept = |c: char| (c.is_alphanumeric() || "_- ".contains(c)).then_some(if c == ' ' { '-' } else { c });
    headings.map(|h| h.chars().filter_map(kept).collect()).collect()
}

// --- Specs -----------------------------------------------------------------------------------------------------------

const TITLE: &str = "gonogo 1\ntolerances ISO2768-m\n";
const STEEL: &str = "material steel {\n    metal = steel\n}\n";
const PLATE: &str = "part plate {\n    material = steel\n    add slab = box(x = 80, y = 50, z = 10)\n    \
                     cut bore = 3x cylinder(d = 6 H7, h = through) on circle(d = 36)\n}\n";
const PIN: &str = "part pin {\n    material = steel\n    add shank = cylinder(d = 6 g6, h = 18)\n}\n";
const ASSEMBLY: &str = "assembly pinned {\n    root plate\n    place pin = 3x pin on plate.bore\n}\n";
const STATION: &str = "station bench {\n    light room = room(patches = 9)\n}\n";

/// The block as a whole spec.
fn whole(block: &Block) -> String {
    let lines = &block.text;
    let frame = |own: String, parts: &[&str]| [&[TITLE, &own], parts].concat().concat();
    let alone = "assembly plate {\n    root plate\n}\n";
    match block.kind() {
        None => lines.clone(),
        Some("part") => frame(format!("part plate {{\n    material = steel\n{lines}}}\n"), &[STEEL, alone, STATION]),
        Some("assembly") => {
            let own = format!("assembly pinned {{\n    root plate\n    place pin = 3x pin on plate.bore\n{lines}}}\n");
            frame(own, &[STEEL, PLATE, PIN, STATION])
        }
        Some("station") => frame(format!("station bench {{\n{lines}}}\n"), &[STEEL, PLATE, PIN, ASSEMBLY]),
        Some("inspect") => frame(format!("inspect pinned {{\n{lines}}}\n"), &[STEEL, PLATE, PIN, ASSEMBLY, STATION]),
        Some("top") => frame(lines.clone(), &[STEEL, PLATE, PIN, ASSEMBLY, STATION]),
        Some(other) => panic!("line {}: a block of `{other}`", block.line),
    }
}

fn diagnostics(text: &str) -> Vec<Diagnostic> {
    let read = |path: &str| match path {
        "book.gng" => Ok(text.to_string()),
        _ => Err(std::io::Error::new(std::io::ErrorKind::NotFound, "not found")),
    };
    let options = gonogo::Options { wanted: BTreeSet::from([Artifact::View]), ..Default::default() };
    gonogo::compile("book.gng", &read, &options, &|_| {}).diagnostics
}

#[test]
fn every_example_of_the_language_compiles_or_fails_as_it_says() {
    let mut seen = 0;
    for (name, text) in chapters() {
        for block in blocks(&text).iter().filter(|b| ["gonogo", "gng"].contains(&b.language())) {
            if block.value("file").or(block.value("add")).is_some() {
                continue;
            }
            seen += 1;
            let text = whole(block);
            let found = diagnostics(&text);
            let wanted = block.value("fails").or(block.value("warns"));
            let codes: BTreeSet<&str> = found.iter().map(|d| d.code).collect();
            assert_eq!(codes, wanted.into_iter().collect(), "{name}, line {}: {found:#?}\n{text}", block.line);
            let fails = found.iter().any(Diagnostic::is_error);
            assert_eq!(fails, block.value("fails").is_some(), "{name}, line {}", block.line);
        }
    }
    assert!(seen >= 12, "{seen}");
}

// --- Commands --------------------------------------------------------------------------------------------------------

#[test]
fn every_command_says_what_the_book_shows() {
    let slow = ["CI", "GONOGO_SLOW"].iter().any(|name| std::env::var_os(name).is_some_and(|v| !v.is_empty()));
    let mut wrong = Vec::new();
    for (name, text) in chapters() {
        let blocks = blocks(&text);
        if !blocks.iter().any(|b| b.language() == "console") {
            continue;
        }
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book").join(name.trim_end_matches(".md"));
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).unwrap();
        let mut blessed = text.clone();
        for block in &blocks {
            prepare(&folder, block);
            if block.language() != "console" || (block.has("slow") && !slow) {
                continue;
            }
            let said = session(&folder, block);
            if !agrees(&block.text, &said) {
                let place = format!("{name}, line {}", block.line);
                wrong.push(format!("{place}:\n--- the book\n{}--- the program\n{said}", block.text));
                blessed = blessed.replacen(&block.text, &said, 1);
            }
        }
        if blesses() && blessed != text {
            fs::write(src().join(&name), blessed).unwrap();
        }
    }
    assert!(wrong.is_empty() || blesses(), "{}", wrong.join("\n"));
}

/// Writes or changes the file that a block is about.
fn prepare(folder: &Path, block: &Block) {
    let path = |name: &str| folder.join(name);
    match (block.language(), block.value("file"), block.value("add")) {
        ("gonogo", Some(file), _) => fs::write(path(file), &block.text).unwrap(),
        ("gonogo", None, Some(file)) => {
            let before = fs::read_to_string(path(file)).unwrap();
            fs::write(path(file), format!("{before}\n{}", block.text)).unwrap();
        }
        ("diff", Some(file), _) => {
            let side = |mark: char| -> String {
                let lines = block.text.lines().filter(|l| l.starts_with([mark, ' ']));
                lines.map(|l| format!("{}\n", &l[1..])).collect()
            };
            let (before, after) = (side('-'), side('+'));
            let text = fs::read_to_string(path(file)).unwrap();
            assert_eq!(text.matches(&before).count(), 1, "line {}: `{before}` in\n{text}", block.line);
            fs::write(path(file), text.replacen(&before, &after, 1)).unwrap();
        }
        _ => {}
    }
}

/// The block with what its commands say now.
fn session(folder: &Path, block: &Block) -> String {
    let bin = Path::new(env!("CARGO_BIN_EXE_gonogo")).parent().unwrap();
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let mut last = 0;
    let mut said = String::new();
    for command in block.text.lines().filter_map(|l| l.strip_prefix("$ ")) {
        said += &format!("$ {command}\n");
        if command == "echo $?" {
            said += &format!("{last}\n");
            continue;
        }
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("{{ {command} ; }} 2>&1")).current_dir(folder).stdin(Stdio::null());
        shell.env("PATH", &path).env("NO_COLOR", "1").env_remove("CI");
        let output = shell.output().unwrap();
        last = output.status.code().unwrap();
        let lines = String::from_utf8(output.stdout).unwrap();
        lines.lines().for_each(|line| said += &format!("{}\n", line.trim_end()));
    }
    said
}

/// Whether `said` is as expected, with `[..]` for any text and `...` for any lines.
fn agrees(expected: &str, said: &str) -> bool {
    let (expected, said): (Vec<&str>, Vec<&str>) = (expected.lines().collect(), said.lines().collect());
    fn all(expected: &[&str], said: &[&str]) -> bool {
        match (expected, said) {
            ([], []) => true,
            (["...", rest @ ..], _) => (0..=said.len()).any(|skipped| all(rest, &said[skipped..])),
            ([e, rest @ ..], [s, others @ ..]) => line(e, s) && all(rest, others),
            _ => false,
        }
    }
    fn line(expected: &str, said: &str) -> bool {
        let Some((head, rest)) = expected.split_once("[..]") else { return expected == said };
        let Some(said) = said.strip_prefix(head) else { return false };
        (0..=said.len()).filter(|&i| said.is_char_boundary(i)).any(|i| line(rest, &said[i..]))
    }
    all(&expected, &said)
}

#[test]
fn wildcards_stand_for_text_and_for_lines() {
    assert!(agrees("a [..] b\n...\nc\n", "a 1 2 b\nx\ny\nc\n") && agrees("...\n", "") && agrees("", ""));
    assert!(!agrees("a\n", "a\nb\n") && !agrees("a [..] b\n", "a b\n") && !agrees("a\n...\n", "b\n"));
}

// --- References ------------------------------------------------------------------------------------------------------

/// Words in backticks, and in blocks of the language.
fn words_of(text: &str) -> BTreeSet<String> {
    let inline = text.lines().filter(|l| !l.starts_with("```")).flat_map(|l| l.split('`').skip(1).step_by(2));
    let blocks = blocks(text);
    let code = blocks.iter().filter(|b| b.language() == "gonogo" || b.language() == "gng").map(|b| b.text.as_str());
    let split = |c: char| !(c.is_alphanumeric() || c == '_');
    inline.chain(code).flat_map(|t| t.split(split)).map(str::to_string).collect()
}

#[test]
fn the_reference_has_every_word_of_the_grammar() {
    let grammar = fs::read_to_string(root().join("grammar/gonogo.pest")).unwrap();
    let rules = grammar.lines().map(|l| l.split("//").next().unwrap_or_default());
    let quoted = rules.flat_map(|l| l.split('"').skip(1).step_by(2));
    let words: BTreeSet<&str> = quoted.filter(|w| w.len() > 1 && w.chars().all(|c| c.is_ascii_lowercase())).collect();
    assert!(words.len() > 40, "{words:?}");
    let known = words_of(&chapter("language.md"));
    let missing: Vec<&&str> = words.iter().filter(|w| !known.contains(**w)).collect();
    assert!(missing.is_empty(), "the language reference does not tell of {missing:?}");
}

#[test]
fn the_reference_has_every_field_and_argument() {
    let known = words_of(&chapter("language.md"));
    let mut missing = BTreeSet::new();
    let mut seen = 0;
    for entry in fs::read_dir(root().join("src/design")).unwrap() {
        let path = entry.unwrap().path();
        let Ok(code) = fs::read_to_string(&path) else { continue };
        let code = code.split("#[cfg(test)]").next().unwrap();
        for list in ["check_fields(", "known(&[", "FIELDS: [", "_FIELDS: ["] {
            for (at, _) in code.match_indices(list) {
                let call = code[at..].split(';').take(if list.contains(':') { 2 } else { 1 }).collect::<String>();
                for word in call.split('"').skip(1).step_by(2) {
                    seen += 1;
                    if !known.contains(word) && word.chars().all(|c| c.is_alphanumeric() || c == '_') {
                        missing.insert(format!("{}: {word}", path.file_name().unwrap().to_string_lossy()));
                    }
                }
            }
        }
    }
    assert!(seen > 60, "{seen}");
    assert!(missing.is_empty(), "the language reference does not tell of {missing:#?}");
}

#[test]
fn every_diagnostic_has_a_page_with_the_text_of_explain() {
    let folder = src().join("diagnostics");
    let page = |code: &str| format!("{{{{#include ../../../src/diag/explain/{code}.md}}}}\n");
    let title = |code: &str| gonogo::diag::explain(code).unwrap().lines().next().unwrap()[2..].to_string();
    let codes: BTreeSet<&str> = gonogo::diag::codes().collect();
    let wanted: BTreeMap<String, String> = codes.iter().map(|c| (format!("{c}.md"), page(c))).collect();
    let list: String = codes.iter().map(|c| format!("  - [{}](diagnostics/{c}.md)\n", title(c))).collect();
    let summary = chapter("SUMMARY.md");
    let listed = |line: &&str| line.starts_with("  - [") && line.contains("](diagnostics/");
    let now: String = summary.lines().filter(listed).map(|l| format!("{l}\n")).collect();
    if blesses() {
        wanted.iter().for_each(|(name, text)| fs::write(folder.join(name), text).unwrap());
        let summary = if now.is_empty() { summary + &list } else { summary.replacen(&now, &list, 1) };
        fs::write(src().join("SUMMARY.md"), summary).unwrap();
        return;
    }
    let is = chapters().into_iter().filter_map(|(n, t)| Some((n.strip_prefix("diagnostics/")?.to_string(), t)));
    let is: BTreeMap<String, String> = is.filter(|(name, _)| name != "README.md").collect();
    assert_eq!(is, wanted, "bless it: GONOGO_BLESS=1 cargo test --test book");
    assert_eq!(now, list, "SUMMARY.md; bless it: GONOGO_BLESS=1 cargo test --test book");
    for code in codes {
        let text = fs::read_to_string(root().join(format!("src/diag/explain/{code}.md"))).unwrap();
        assert_eq!(gonogo::diag::explain(code), Some(text.as_str()));
    }
}

#[test]
fn the_command_reference_has_every_command_and_option() {
    let help = |args: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_gonogo")).args(args).arg("--help").output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let section = |text: &str, from: &str| {
        let lines = text.lines().skip_while(|l| !l.starts_with(from)).skip(1);
        lines.take_while(|l| l.is_empty() || l.starts_with(' ')).map(str::to_string).collect::<Vec<_>>()
    };
    let commands = |text: &str| -> Vec<String> {
        let words = section(text, "Commands:").into_iter().filter(|l| !l.starts_with("    "));
        words.filter_map(|l| l.split_whitespace().next().map(str::to_string)).filter(|c| c != "help").collect()
    };
    let reference = chapter("command_line.md");
    let mut missing = Vec::new();
    for command in commands(&help(&[])) {
        let part = reference.split("\n## ").find(|p| p.starts_with(&format!("`gonogo {command}`")));
        let Some(part) = part else {
            missing.push(format!("gonogo {command}"));
            continue;
        };
        let inner = commands(&help(&[&command]));
        let texts: Vec<String> = match inner.is_empty() {
            true => vec![help(&[&command])],
            false => inner.iter().map(|c| help(&[&command, c])).collect(),
        };
        for line in texts.iter().flat_map(|t| section(t, "Options:")) {
            // Options begin their line; what else begins with dashes is prose.
            let first = line.trim_start().starts_with('-');
            let words = line.split([' ', ',']).filter(|w| first && w.starts_with("--")).take(1);
            let told = |o: &&str| part.contains(&format!("`{o}")) || reference.contains(&format!("\n| `{o}"));
            let unknown = words.filter(|o| !["--help", "--version"].contains(o) && !told(o));
            missing.extend(unknown.map(|o| format!("gonogo {command} {o}")));
        }
    }
    missing.sort();
    missing.dedup();
    assert!(missing.is_empty(), "the command line reference does not tell of {missing:#?}");
}

#[test]
fn the_page_on_goldens_has_the_tolerances_that_are_written_first() {
    let page = chapter("golden_files.md");
    let table = page.split("## Tolerances").nth(1).unwrap();
    for stage in Artifact::ALL.into_iter().filter(|a| a.is_reviewed()) {
        let name = format!("`{}`", stage.name());
        let row = table.lines().find(|l| l.starts_with('|') && l.split('|').nth(1).is_some_and(|c| c.contains(&name)));
        for rule in gonogo::golden::usual(&stage.stem()).lines() {
            let (subject, amount) = rule.split_once(':').unwrap();
            let row = row.unwrap_or_else(|| panic!("no row for {name}"));
            let amount = amount.replace(" ±0 %", "");
            assert!(row.contains(amount.trim()), "{name}: `{rule}` is not in {row}");
            let field = subject.strip_prefix("// tolerance of ");
            assert!(field.is_none_or(|f| row.contains(&format!("`{f}`"))), "{name}: `{rule}` is not in {row}");
        }
    }
}

// --- Other languages -------------------------------------------------------------------------------------------------

#[test]
fn blocks_in_c_and_javascript_are_correct() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book_code");
    fs::create_dir_all(&folder).unwrap();
    let has_node = Command::new("node").arg("--version").output().is_ok_and(|o| o.status.success());
    let mut seen = BTreeSet::new();
    for (name, text) in chapters() {
        for block in blocks(&text) {
            let mut command = match block.language() {
                "c" => {
                    let mut cc = Command::new(std::env::var("CC").unwrap_or("cc".into()));
                    cc.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only", "-I"]);
                    cc.arg(root().join("include")).arg(folder.join("block.c"));
                    cc
                }
                "js" if has_node => {
                    let mut node = Command::new("node");
                    node.arg("--check").arg(folder.join("block.mjs"));
                    node
                }
                _ => continue,
            };
            seen.insert(block.language().to_string());
            let file = if block.language() == "c" { "block.c" } else { "block.mjs" };
            fs::write(folder.join(file), &block.text).unwrap();
            let output = command.output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{name}, line {}: {said}", block.line);
        }
    }
    assert!(seen.contains("c") && (seen.contains("js") || !has_node), "{seen:?}");
}
