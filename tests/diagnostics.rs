//! Every diagnostic of the language, as the user sees it.
//!
//! `tests/diagnostics/*.md` holds pairs of blocks: a fenced `gng` block with a spec, or with the lines that matter, and a
//! fenced `text` block with the report. `GONOGO_BLESS=1` rewrites the reports; read the difference before committing it.
//!
//! A spec that does not begin with `gonogo` is completed by [`FRAME`], with its lines in the place of the part `pin`.

#![cfg(feature = "cli")]

use gonogo::design::load;
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// A spec without faults around the lines under test.
const FRAME: [&str; 2] = [
    "gonogo 1\nunits mm deg\ntolerances exact\n",
    "material steel {\n    metal = steel\n}\n\
     part plate {\n    material = steel\n    add slab = box(x = 80 ±0.2, y = 50, z = 10)\n    \
     cut bore = 3x cylinder(d = 6 H7, h = through) on circle(d = 36)\n}\n\
     assembly pinned {\n    root plate\n    place pin on plate.bore[1]\n}\n\
     station bench {\n    light room = room(patches = 9)\n}\n",
];

struct Case {
    spec: String,
    report: String,
}

#[test]
fn reports_are_as_written_down() {
    let bless = std::env::var_os("GONOGO_BLESS").is_some();
    let mut wrong = Vec::new();
    for path in pages() {
        let text = fs::read_to_string(&path).unwrap();
        let mut blessed = text.clone();
        for case in cases(&text) {
            let report = report(&case.spec);
            if report != case.report {
                blessed = blessed.replacen(&page_of(&case.spec, &case.report), &page_of(&case.spec, &report), 1);
                wrong.push(format!(
                    "{}:\n{}\n--- expected\n{}\n--- found\n{report}",
                    path.display(),
                    case.spec,
                    case.report
                ));
            }
        }
        if bless && blessed != text {
            fs::write(&path, blessed).unwrap();
        }
    }
    assert!(wrong.is_empty() || bless, "{}", wrong.join("\n"));
}

#[test]
fn every_code_has_a_page_and_a_test() {
    let tested: String =
        pages().iter().flat_map(|p| cases(&fs::read_to_string(p).unwrap())).map(|c| c.report).collect();
    let tested: BTreeSet<&str> = tested.match_indices('[').filter_map(|(i, _)| tested.get(i + 1..i + 6)).collect();
    for code in gonogo::diag::codes().filter(|code| ("E0".."E06").contains(&&code[..3]) || code.starts_with('W')) {
        assert!(tested.contains(code) || belongs_to_a_later_stage(code), "{code} has no test");
    }
    for code in tested.iter().filter(|c| c.starts_with("E0") || c.starts_with("W0")) {
        assert!(gonogo::diag::explain(code).is_some(), "{code} has no page");
    }
}

/// Codes that are found on solids and pictures are tested where they are found.
fn belongs_to_a_later_stage(code: &str) -> bool {
    let number: u32 = code[1..].parse().unwrap_or(0);
    number >= 400 && ![504, 505].contains(&number)
}

fn pages() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/diagnostics");
    let mut pages: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    pages
}

fn cases(text: &str) -> Vec<Case> {
    let blocks = |fence: &str| -> Vec<String> {
        let parts = text.split(fence).skip(1);
        parts.map(|part| part.split("```").next().unwrap_or("").to_string()).collect()
    };
    let (specs, reports) = (blocks("```gng\n"), blocks("```text\n"));
    assert_eq!(specs.len(), reports.len(), "a spec without a report, or the other way round");
    specs.into_iter().zip(reports).map(|(spec, report)| Case { spec, report }).collect()
}

fn page_of(spec: &str, report: &str) -> String {
    format!("```gng\n{spec}```\n\n```text\n{report}```")
}

fn report(spec: &str) -> String {
    let text = if spec.starts_with("gonogo") || spec.starts_with("//!") { spec.to_string() } else { FRAME.join(spec) };
    let read = |path: &str| match path {
        "spec.gng" => Ok(text.clone()),
        "other.gng" => Ok("gonogo 1\nuse \"spec.gng\"\n".to_string()),
        _ => Err(std::io::Error::new(std::io::ErrorKind::NotFound, "not found")),
    };
    let loaded = load("spec.gng", &read, &[]);
    assert_eq!(loaded.design.is_none(), loaded.diagnostics.iter().any(|d| d.is_error()));
    let lines = gonogo::cli::report::human(&loaded.sources, &loaded.diagnostics, false);
    lines.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
