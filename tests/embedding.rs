//! The runtime in other programs: a C program links the static library, Node loads the WebAssembly. Both must say what
//! `gonogo inspect` says, to the letter, but for the time it took.

#![cfg(feature = "cli")]

use plate::{CALIBRATION, MODEL, gonogo, ran, root};
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::OnceLock;

mod plate;
mod webassembly;

const PHOTOS: [&str; 4] = ["good.png", "missing.png", "cut.png", "small.png"];

fn tmp() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR"))
}

/// The small plate, and what the command line says of its photos.
fn judged_plate() -> &'static (PathBuf, Vec<String>) {
    static PLATE: OnceLock<(PathBuf, Vec<String>)> = OnceLock::new();
    PLATE.get_or_init(|| {
        let folder = plate::plate("embedding");
        let inspect = ["inspect", MODEL, "--calibration", CALIBRATION, "--format", "json"];
        let verdicts = lines(&gonogo(&folder, &[&inspect[..], &PHOTOS].concat()));
        assert_eq!(verdicts.len(), 4, "{verdicts:?}");
        assert!(verdicts[0].contains("\"go\"") && verdicts[1].contains("pin[1]"), "{verdicts:?}");
        (folder, verdicts)
    })
}

/// The lines said, the time taken out.
fn lines(output: &Output) -> Vec<String> {
    let untimed = |line: &str| match line.rsplit_once("\"milliseconds\":") {
        Some((before, _)) => before.to_string(),
        None => line.to_string(),
    };
    String::from_utf8_lossy(&output.stdout).lines().map(untimed).collect()
}

#[test]
fn a_c_program_links_the_static_library_and_judges() {
    let (folder, expected) = judged_plate();
    let library = static_library();
    let program = folder.join("judge");
    let mut compiler = Command::new(std::env::var("CC").unwrap_or("cc".into()));
    compiler.args(["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]).arg(root().join("include"));
    compiler.arg(root().join("tests/embedding/judge.c")).arg(library).args(["-lm", "-lpthread", "-ldl", "-o"]);
    assert!(ran(compiler.arg(&program)).status.success());

    // The good photo again as bare pixels, with spare bytes after each row.
    let grey = image::open(folder.join("good.png")).unwrap().into_luma8();
    let rows: Vec<u8> = grey.rows().flat_map(|row| row.map(|p| p[0]).chain([0xa5; 7]).collect::<Vec<u8>>()).collect();
    fs::write(folder.join("good.raw"), rows).unwrap();
    let mut judge = Command::new(&program);
    judge.current_dir(folder).args([MODEL, CALIBRATION]).args(PHOTOS).arg("good.raw");
    let said = ran(&mut judge);
    assert_eq!(said.status.code(), Some(2), "the worst verdict");
    let lines = lines(&said);
    assert_eq!(&lines[..4], &expected[..]);
    assert_eq!(lines[4], expected[0].replace("good.png", "good.raw"));
}

/// Builds the library as `include/gonogo.h` says, in a folder of its own and without optimisation, which would take longer.
fn static_library() -> PathBuf {
    let target = tmp().join("static");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(root()).args(["rustc", "--locked", "--quiet", "--lib", "--crate-type", "staticlib"]);
    cargo.args(["--no-default-features", "--features", "c", "--target-dir"]).arg(&target);
    for setting in ["opt-level=0", "debug=0", "package.\"*\".opt-level=0"] {
        cargo.args(["--config", &format!("profile.dev.{setting}")]);
    }
    cargo.env_remove("CARGO_PROFILE_DEV_OPT_LEVEL").env_remove("RUSTFLAGS");
    assert!(ran(&mut cargo).status.success());
    target.join("debug/libgonogo.a")
}

#[test]
fn node_loads_the_webassembly_and_judges() {
    let Some(module) = webassembly_for_node() else { return };
    let (folder, expected) = judged_plate();
    let mut node = Command::new("node");
    node.current_dir(folder).arg(root().join("tests/embedding/judge.mjs")).arg(root().join("include/gonogo.mjs"));
    node.arg(module).args([MODEL, CALIBRATION]).args(PHOTOS);
    let output = node.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(&lines(&output)[..], &expected[..]);
}

/// The module, or `None` where nothing makes or runs one: CI has both and must not skip.
fn webassembly_for_node() -> Option<PathBuf> {
    let node = Command::new("node").arg("--version").output().is_ok_and(|o| o.status.success());
    assert!(node || std::env::var_os("CI").is_none(), "CI has no node");
    if !node {
        eprintln!("skipped: there is no node here");
        return None;
    }
    webassembly::module()
}
