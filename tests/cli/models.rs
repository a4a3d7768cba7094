//! Models and calibrations that are damaged, of another version or of something else.

use crate::{Folder, MODEL, plate, spec};
use std::fs;

#[track_caller]
fn model_refused(name: &str, damage: impl Fn(String) -> String, said: &[&str]) {
    let folder = Folder::new(name);
    folder.file("bad.model.ron", damage(plate().read(MODEL)));
    fs::copy(plate().0.join("good.png"), folder.0.join("good.png")).unwrap();
    folder.run(&["inspect", "bad.model.ron", "good.png"]).expect(2, said);
    folder.run(&["calibrate", "bad.model.ron", "good.png", "-o", "c.ron"]).expect(2, said);
    assert_eq!(folder.names(), ["bad.model.ron", "good.png"]);
}

#[test]
fn a_truncated_model_is_refused() {
    model_refused("truncated", |text| text[..text.len() / 2].to_string(), &["error", "bad.model.ron", "E0802"]);
}

#[test]
fn an_edited_model_is_refused() {
    model_refused("edited", |text| text.replacen("seed: 7", "seed: 8", 1), &["E0802", "changed"]);
}

#[test]
fn a_model_of_a_newer_format_says_which() {
    model_refused("newer", |text| text.replacen("format: 7", "format: 99", 1), &["E0801", "format 99"]);
}

#[test]
fn something_else_is_no_model() {
    model_refused("no_model", |_| "hello".into(), &["E0803"]);
}

#[test]
fn a_calibration_of_another_model_is_refused() {
    let folder = Folder::new("other_calibration");
    folder.file("plate.gng", spec().replacen("seed    = 7", "seed    = 8", 1));
    folder.run(&["compile", "plate.gng"]).expect(0, &[]);
    for name in ["good.png", "plate.calibration.ron"] {
        fs::copy(plate().0.join(name), folder.0.join(name)).unwrap();
    }
    let args = ["inspect", MODEL, "--calibration", "plate.calibration.ron", "good.png"];
    folder.run(&args).expect(2, &["another model"]);
}
