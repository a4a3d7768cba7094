//! The small plate, compiled and calibrated once a test program, with photos good and bad.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const MODEL: &str = "plate.model.ron";
pub const CALIBRATION: &str = "plate.calibration.ron";

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A folder of its own with model, calibration, `good.png`, `missing.png`, `cut.png` (half a file) and `small.png` (not the
/// station's size).
pub fn plate(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::copy(root().join("tests/data/two_pins.gng"), folder.join("plate.gng")).unwrap();
    gonogo(&folder, &["compile", "plate.gng", "--emit", "images,model"]);
    fs::copy(folder.join("plate.images/good.png"), folder.join("good.png")).unwrap();
    fs::copy(folder.join("plate.images/01 pin[1] missing.png"), folder.join("missing.png")).unwrap();
    let good = fs::read(folder.join("good.png")).unwrap();
    fs::write(folder.join("cut.png"), &good[..good.len() / 2]).unwrap();
    image::GrayImage::new(64, 48).save(folder.join("small.png")).unwrap();
    gonogo(&folder, &["calibrate", MODEL, "good.png", "-o", CALIBRATION]);
    folder
}

#[track_caller]
pub fn gonogo(folder: &Path, args: &[&str]) -> Output {
    ran(Command::new(env!("CARGO_BIN_EXE_gonogo")).current_dir(folder).args(args))
}

/// Runs a program that may find faults but not break.
#[track_caller]
pub fn ran(command: &mut Command) -> Output {
    let output = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.code().is_some_and(|c| c <= 2), "{command:?}: {}\n{out}\n{err}", output.status);
    output
}
