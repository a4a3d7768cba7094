//! The blessed outputs of the stages, compared by the same command that users have.
//!
//! `GONOGO_BLESS=1 cargo test --test golden` rewrites them (refused where CI is set); review the difference before committing.

use std::path::Path;
use std::process::Command;

/// Runs `gonogo golden` on a spec, the blessed outputs being in `golden/`.
fn golden(spec: &str, stages: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let verb = if std::env::var_os("GONOGO_BLESS").is_some_and(|v| v == "1") { "bless" } else { "check" };
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    command.current_dir(root).args(["golden", verb, spec, "--stages", stages]);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

#[test]
fn the_pattern_wheel_is_analysed_as_blessed() {
    let stages = "design,brep,contacts,liaison,error-trees,object-tree,insertion,view";
    golden("specs/pattern_wheel.gng", stages);
}

#[test]
fn a_small_plate_is_analysed_and_trained_as_blessed() {
    golden("tests/data/two_pins.gng", "design,brep,liaison,error-trees,insertion,view,model");
}

#[test]
fn goldens_are_short_enough_to_be_read() {
    const LARGEST: u64 = 20 << 10;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden");
    for folder in std::fs::read_dir(root).unwrap() {
        for file in std::fs::read_dir(folder.unwrap().path()).unwrap() {
            let file = file.unwrap();
            let size = file.metadata().unwrap().len();
            assert!(size <= LARGEST, "{} has {size} bytes", file.path().display());
        }
    }
}
