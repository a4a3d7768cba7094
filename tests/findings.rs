//! Every finding on solids and on an assembly, as the user sees it.
//!
//! `tests/findings/*.md` holds pairs of blocks: a fenced `gng` block with the lines of parts and assembly, and a fenced `text`
//! block with the report. `GONOGO_BLESS=1` rewrites the reports; read the difference before committing it.

#![cfg(feature = "cli")]

use gonogo::artifacts::Artifact;
use gonogo::{Options, compile};
use std::fs;
use std::path::PathBuf;

/// What every spec needs besides.
const FRAME: [&str; 2] = [
    "gonogo 1\nunits mm deg\ntolerances exact\nmaterial steel { metal = steel }\n",
    "station bench { light room = room() }\n",
];

#[test]
fn findings_are_as_written_down() {
    let bless = std::env::var_os("GONOGO_BLESS").is_some();
    let mut wrong = Vec::new();
    for path in pages() {
        let text = fs::read_to_string(&path).unwrap();
        let mut blessed = text.clone();
        for (spec, expected) in cases(&text) {
            let found = report(&spec);
            if found != expected {
                blessed = blessed.replacen(&page_of(&spec, &expected), &page_of(&spec, &found), 1);
                wrong.push(format!("{}:\n{spec}\n--- expected\n{expected}\n--- found\n{found}", path.display()));
            }
        }
        if bless && blessed != text {
            fs::write(&path, blessed).unwrap();
        }
    }
    assert!(wrong.is_empty() || bless, "{}", wrong.join("\n"));
}

#[test]
fn every_code_of_solids_and_assembly_is_shown() {
    let shown: String =
        pages().iter().flat_map(|p| cases(&fs::read_to_string(p).unwrap())).map(|(_, report)| report).collect();
    for code in [
        "E0401", "E0403", "E0405", "E0406", "E0407", "E0408", "E0501", "W0502", "E0503", "E0506", "W0507", "E0508",
        "E0509",
    ] {
        assert!(shown.contains(&format!("[{code}]")), "{code} has no test");
    }
}

fn pages() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/findings");
    let mut pages: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    pages
}

fn cases(text: &str) -> Vec<(String, String)> {
    let blocks = |fence: &str| -> Vec<String> {
        text.split(fence).skip(1).map(|part| part.split("```").next().unwrap_or("").to_string()).collect()
    };
    let (specs, reports) = (blocks("```gng\n"), blocks("```text\n"));
    assert_eq!(specs.len(), reports.len(), "a spec without a report, or the other way round");
    specs.into_iter().zip(reports).collect()
}

fn page_of(spec: &str, report: &str) -> String {
    format!("```gng\n{spec}```\n\n```text\n{report}```")
}

fn report(spec: &str) -> String {
    let text = FRAME.join(spec);
    let options = Options { wanted: [Artifact::Contacts].into(), ..Options::default() };
    let compiled = compile("spec.gng", &|_| Ok(text.clone()), &options, &|_| {});
    let lines = gonogo::cli::report::human(&compiled.sources, &compiled.diagnostics, false);
    lines.lines().map(|line| format!("{}\n", line.trim_end())).collect()
}
