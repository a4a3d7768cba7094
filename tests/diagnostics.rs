//! Every diagnostic of the language, as the user sees it: `tests/diagnostics/*.md`.
//!
//! A spec that does not begin with `gonogo` is completed by [`FRAME`], with its lines in the place of the part `pin`.

#![cfg(feature = "cli")]

mod pages;

use gonogo::design::load;
use gonogo::diag::{Diagnostic, Sources};
use pages::Book;
use std::collections::BTreeSet;

/// A spec without faults around the lines under test.
const FRAME: [&str; 2] = [
    "gonogo 1\nunits mm deg\ntolerances exact\n",
    "material steel {\n    metal = steel\n}\n\
     part plate {\n    material = steel\n    add slab = box(x = 80 ±0.2, y = 50, z = 10)\n    \
     cut bore = 3x cylinder(d = 6 H7, h = through) on circle(d = 36)\n}\n\
     assembly pinned {\n    root plate\n    place pin on plate.bore[1]\n}\n\
     station bench {\n    light room = room(patches = 9)\n}\n",
];

const BOOK: Book = Book { folder: "tests/diagnostics", whole, run };

#[test]
fn reports_are_as_written_down() {
    BOOK.hold();
}

#[test]
fn every_fix_mends_its_fault_and_does_no_harm() {
    let codes: BTreeSet<&str> = BOOK.mend().into_iter().collect();
    for code in [
        "E0101", "E0102", "E0103", "E0104", "E0105", "E0201", "E0202", "E0204", "E0205", "E0206", "E0207", "E0211",
        "E0214", "E0301", "E0302", "W0304", "E0305", "E0306", "E0309", "W0310", "W0311", "E0505", "E0701",
    ] {
        assert!(codes.contains(code), "{code} has no fix that is tried");
    }
}

#[test]
fn every_code_has_a_page_and_a_test() {
    let tested = BOOK.reports();
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
    number >= 400 && ![504, 505, 701].contains(&number)
}

fn whole(spec: &str) -> String {
    // A spec of its own has a word on the version, or says what begins without one.
    let own = spec.contains("gonogo ") || spec.starts_with("//!");
    if own { spec.to_string() } else { FRAME.join(spec) }
}

fn run(text: &str) -> (Sources, Vec<Diagnostic>) {
    let read = |path: &str| match path {
        "spec.gng" => Ok(text.to_string()),
        "other.gng" => Ok("gonogo 1\nuse \"spec.gng\"\n".to_string()),
        _ => Err(std::io::Error::new(std::io::ErrorKind::NotFound, "not found")),
    };
    let loaded = load("spec.gng", &read, &[]);
    assert_eq!(loaded.design.is_none(), loaded.diagnostics.iter().any(|d| d.is_error()));
    (loaded.sources, loaded.diagnostics)
}
