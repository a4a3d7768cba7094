//! Every finding on solids and on an assembly, as the user sees it: `tests/findings/*.md`, with the lines of parts and
//! assembly in their `gng` blocks.

#![cfg(feature = "cli")]

mod pages;

use gonogo::artifacts::Artifact;
use gonogo::diag::{Diagnostic, Sources};
use gonogo::{Options, compile};
use pages::Book;

/// What every spec needs besides.
const FRAME: [&str; 2] = [
    "gonogo 1\nunits mm deg\ntolerances exact\nmaterial steel { metal = steel }\n",
    "station bench { light room = room() }\n",
];

const BOOK: Book = Book { folder: "tests/findings", whole: |spec| FRAME.join(spec), run };

#[test]
fn findings_are_as_written_down() {
    BOOK.hold();
}

#[test]
fn every_fix_mends_its_fault_and_does_no_harm() {
    let codes = BOOK.mend();
    assert!(codes.contains(&"W0502") && codes.contains(&"E0509"), "{codes:?}");
}

#[test]
fn every_code_of_solids_and_assembly_is_shown() {
    let shown = BOOK.reports();
    for code in [
        "E0401", "W0402", "E0403", "E0405", "E0406", "E0407", "E0408", "E0501", "W0502", "E0503", "E0506", "W0507",
        "E0508", "E0509", "W0411", "W0510",
    ] {
        assert!(shown.contains(&format!("[{code}]")), "{code} has no test");
    }
}

fn run(text: &str) -> (Sources, Vec<Diagnostic>) {
    let options = Options { wanted: [Artifact::Contacts].into(), ..Options::default() };
    let compiled = compile("spec.gng", &|_| Ok(text.to_string()), &options, &|_| {});
    (compiled.sources, compiled.diagnostics)
}
