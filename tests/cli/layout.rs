//! `gonogo fmt`.

use crate::{Folder, root, spec};
use std::fs;

#[test]
fn fmt_lays_out_in_place_and_check_only_tells() {
    let folder = Folder::new("fmt");
    let untidy = "gonogo   1\nunits mm deg\n\n\n\nlet  a=6\n";
    folder.file("a.gng", untidy);
    folder.run(&["fmt", "--check", "a.gng"]).expect(1, &["a.gng"]);
    assert_eq!(folder.read("a.gng"), untidy);
    folder.run(&["fmt", "a.gng"]).expect(0, &[]);
    let tidy = folder.read("a.gng");
    folder.run(&["fmt", "--check", "a.gng"]).expect(0, &[]);
    let run = folder.run_with(&["fmt", "-"], untidy);
    assert_eq!((run.code, run.out), (0, tidy));
    folder.run_with(&["fmt", "-"], "part {").expect(1, &["E01"]);
    assert_eq!(folder.names(), ["a.gng"]);
}

#[test]
fn fmt_shows_what_it_would_change() {
    let folder = Folder::new("fmt_diff");
    folder.file("good.gng", spec()).file("bad.gng", spec().replace("    root plate", "  root   plate"));
    let run = folder.run(&["fmt", "--diff", "good.gng", "bad.gng"]);
    run.expect(1, &["--- bad.gng\n+++ bad.gng\n@@ ", "\n-  root   plate\n+    root plate\n"]);
    assert!(!run.out.contains("good.gng") && !run.out.contains('\x1b'), "{}", run.out);
    assert!(folder.read("bad.gng").contains("  root   plate"));
    assert_eq!(folder.run(&["fmt", "--diff", "good.gng"]).expect(0, &[]).out, "");
    folder.run(&["fmt", "--diff", "--color", "always", "bad.gng"]).expect(1, &["\x1b[31m-  root"]);
    let input = folder.run_with(&["fmt", "--diff", "-"], &spec().replace("    root plate", " root plate"));
    input.expect(1, &["--- -\n", "+    root plate"]);
}

#[test]
fn the_specs_we_ship_are_laid_out() {
    for folder in ["specs", "tests/data"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "gng") {
                Folder::new("shipped").run(&["fmt", "--check", path.to_str().unwrap()]).expect(0, &[]);
            }
        }
    }
}
