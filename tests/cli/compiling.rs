//! Compiling, the goldens of its stages, and the pages of diagnostics.

use crate::{Folder, spec};
use std::process::Command;

#[test]
fn every_code_is_listed_and_a_wrong_one_is_answered_with_the_nearest() {
    let folder = Folder::new("explain");
    folder.run(&["explain"]).expect(0, &["E0305  ", "W0502  "]);
    folder.run(&["explain", "e0305"]).expect(0, &["# E0305: "]);
    folder.run(&["explain", "E0350"]).expect(2, &["there is no diagnostic `E0350`; did you mean `E0305`?"]);
    folder.run(&["explain", "nonsense"]).expect(2, &["`gonogo explain` lists all"]);
}

#[test]
fn the_same_spec_gives_the_same_bytes_at_any_number_of_threads() {
    let folder = Folder::new("threads");
    folder.file("plate.gng", spec());
    folder.run(&["compile", "plate.gng", "--no-cache", "-j", "1", "-o", "one.ron"]).expect(0, &[]);
    folder.run(&["compile", "plate.gng", "--no-cache", "-j", "2", "-o", "two.ron"]).expect(0, &[]);
    assert!(folder.read("one.ron") == folder.read("two.ron"), "the models differ");
    assert_eq!(folder.names(), ["one.ron", "plate.gng", "two.ron"]);
}

#[test]
fn emitted_stages_lie_beside_the_model_that_was_not_asked_for() {
    let folder = Folder::new("emit");
    folder.file("plate.gng", spec());
    let stages = "design,brep,contacts,liaison,error-trees,object-tree,insertion,exploded,view";
    folder.run(&["compile", "plate.gng", "--emit", stages, "--deps", "plate.d"]).expect(0, &[]);
    let expected = [
        "plate.assembled.svg",
        "plate.brep.ron",
        "plate.contacts.ron",
        "plate.d",
        "plate.design.ron",
        "plate.error_trees",
        "plate.error_trees.json",
        "plate.error_trees.ron",
        "plate.exploded.svg",
        "plate.gng",
        "plate.insertion.ron",
        "plate.liaison.dot",
        "plate.liaison.json",
        "plate.liaison.ron",
        "plate.liaison.svg",
        "plate.object_tree.dot",
        "plate.object_tree.json",
        "plate.object_tree.ron",
        "plate.object_tree.svg",
        "plate.view.ron",
    ];
    assert_eq!(folder.names(), expected);
    let rule = folder.read("plate.d");
    assert!(rule.contains("plate.liaison.ron") && rule.ends_with(": plate.gng\n"), "{rule}");
}

#[test]
fn solids_leave_as_step_and_gltf() {
    let folder = Folder::new("exchange");
    folder.file("plate.gng", spec());
    folder.run(&["compile", "plate.gng", "--emit", "step,gltf"]).expect(0, &[]);
    let names = folder.names();
    for name in ["plate.step", "plate.parts", "plate.glb", "plate.exploded.glb"] {
        assert!(names.contains(&name.to_string()), "{names:?}");
    }
    let text = folder.read("plate.step");
    assert!(text.starts_with("ISO-10303-21;") && text.contains("NEXT_ASSEMBLY_USAGE_OCCURRENCE"), "{text}");
}

#[test]
fn a_place_that_cannot_be_written_is_found_out_before_the_work() {
    let folder = Folder::new("unwritable");
    folder.file("plate.gng", spec());
    folder.run(&["compile", "plate.gng", "-o", "nowhere/plate.model.ron"]).expect(2, &["cannot write", "nowhere"]);
    folder.run(&["compile", "plate.gng", "-o", "."]).expect(2, &["cannot write"]);
    assert_eq!(folder.names(), ["plate.gng"]);
}

#[test]
fn usage_errors_and_missing_files_exit_with_two() {
    let folder = Folder::new("usage");
    folder.run(&["compile"]).expect(2, &["Usage"]);
    folder.run(&["compile", "no.gng"]).expect(2, &["cannot read `no.gng`"]);
    folder.run(&["check", "no.gng"]).expect(2, &["cannot read `no.gng`"]);
    folder.run(&["inspect", "no.model.ron", "a.png"]).expect(2, &["cannot read `no.model.ron`"]);
    folder.run(&["compile", "x.gng", "--emit", "nonsense"]).expect(2, &["nonsense"]);
    folder.run(&["compile", "x.gng", "--set", "nonsense"]).expect(2, &["NAME=VALUE"]);
    folder.run(&["--help"]).expect(0, &["compile", "inspect", "demo"]);
    folder.run(&["--version"]).expect(0, &["gonogo"]);
}

#[test]
fn a_golden_that_is_missing_or_differs_fails_and_names_the_place() {
    let folder = Folder::new("goldens");
    folder.file("plate.gng", spec());
    let check = ["golden", "check", "plate.gng", "--stages", "liaison,insertion"];
    folder.run(&check).expect(1, &["no blessed output", "golden bless"]);
    let bless = ["golden", "bless", "plate.gng", "--stages", "liaison,insertion"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    let refused = command.current_dir(&folder.0).args(bless).env("CI", "true").output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(!folder.0.join("golden").exists());
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    assert!(command.current_dir(&folder.0).args(bless).env_remove("CI").output().unwrap().status.success());
    folder.run(&check).expect(0, &[]);
    let blessed = folder.read("golden/plate/liaison.ron");
    folder.file("golden/plate/liaison.ron", blessed.replacen("75.4", "80.0", 1));
    folder.run(&check).expect(1, &["liaison.ron", "area: 80.0 blessed, 75.4 now"]);
    assert_eq!(folder.read("target/golden/plate/liaison.ron"), blessed);
}
