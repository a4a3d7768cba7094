//! Specs with faults: what is said, in which form, and what `check --fix` makes of them.

use crate::{Folder, spec};

#[track_caller]
fn refused(name: &str, from: &str, to: &str, said: &[&str]) {
    let folder = Folder::new(name);
    let text = spec();
    assert!(text.contains(from), "the spec has no `{from}`");
    folder.file("bad.gng", text.replacen(from, to, 1));
    folder.run(&["check", "bad.gng"]).expect(1, said).expect(1, &["bad.gng"]);
    folder.run(&["compile", "bad.gng", "-o", "bad.model.ron"]).expect(1, said);
    assert_eq!(folder.names(), ["bad.gng"], "nothing may be left behind");
}

#[test]
fn an_unknown_name_is_named_with_the_nearest_one() {
    refused("unknown_name", "material = white", "material = whote", &["E0201", "whote", "white"]);
}

#[test]
fn a_missing_brace_is_reported_where_it_belongs() {
    refused("missing_brace", "reflectance = 0.6 .. 0.9\n}", "reflectance = 0.6 .. 0.9\n", &["E0102", "never closed"]);
}

#[test]
fn reversed_tolerances_are_refused() {
    refused("reversed", "+0.012/0", "0/+0.012", &["E0301"]);
}

#[test]
fn one_run_reports_several_faults() {
    let folder = Folder::new("several");
    folder.file(
        "bad.gng",
        spec().replacen("material = white", "material = whote", 1).replacen("+0.012/0", "0/+0.012", 1),
    );
    folder.run(&["check", "bad.gng"]).expect(1, &["E0201", "E0301"]);
}

#[test]
fn an_unknown_station_is_answered_with_the_known_ones() {
    let folder = Folder::new("station");
    folder.file("plate.gng", spec());
    folder.run(&["compile", "plate.gng", "--station", "bank"]).expect(1, &["no station `bank`", "bench"]);
    assert_eq!(folder.names(), ["plate.gng"]);
}

#[test]
fn a_spec_may_come_by_standard_input() {
    let folder = Folder::new("stdin");
    folder.run_with(&["check", "-"], &spec()).expect(0, &[]);
    let bad = spec().replacen("material = white", "material = whote", 1);
    folder.run_with(&["check", "-"], &bad).expect(1, &["E0201", "<stdin>"]);
    assert!(folder.names().is_empty());
}

#[test]
fn diagnostics_can_be_json_lines_or_annotations() {
    let folder = Folder::new("formats");
    folder.file("bad.gng", spec().replacen("material = white", "material = whote", 1));
    let run = folder.run(&["check", "bad.gng", "--message-format", "json"]);
    let lines = run.out.lines().map(|l| serde_json::from_str::<serde_json::Value>(l).unwrap());
    let codes: Vec<String> = lines.map(|l| l["code"].as_str().unwrap().to_string()).collect();
    assert!(run.code == 1 && codes.contains(&"E0201".to_string()), "{codes:?}");
    let run = folder.run(&["check", "bad.gng", "--message-format", "github"]);
    assert!(run.out.contains("::error file=bad.gng,line="), "{}", run.out);
    folder.run(&["check", "bad.gng", "--message-format", "short"]).expect(1, &["bad.gng:", "error[E0201]"]);
}

#[test]
fn sarif_is_one_log_for_all_specs() {
    let folder = Folder::new("sarif");
    folder.file("good.gng", spec()).file("a.gng", spec().replace("root plate", "root plat"));
    folder.file("b.gng", spec().replace("6 +0.012/0", "6 +0/+0.012"));
    let run = folder.run(&["check", "good.gng", "a.gng", "b.gng", "--message-format", "sarif"]);
    run.expect(1, &[]);
    let log: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    let uri = |i: usize| &log["runs"][0]["results"][i]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"];
    assert_eq!((uri(0), uri(1)), (&"a.gng".into(), &"b.gng".into()), "{}", run.out);
    let nothing = folder.run(&["check", "good.gng", "--message-format", "sarif"]);
    nothing.expect(0, &["\"results\": []"]);
}

#[test]
fn warnings_can_be_denied_and_allowed_by_code() {
    let folder = Folder::new("levels");
    folder.file("plate.gng", spec().replace("d = 6 -0.004/-0.012", "d = 6 H7"));
    let check = |more: &[&str]| folder.run(&[&["check", "plate.gng"], more].concat());
    check(&[]).expect(0, &["warning[W0304]"]);
    check(&["-D", "warnings"]).expect(1, &["error[W0304]"]);
    check(&["-D", "W0304"]).expect(1, &["error[W0304]"]);
    check(&["-D", "W0310"]).expect(0, &["warning[W0304]"]);
    let allowed = check(&["-D", "warnings", "--allow", "W0304", "--allow", "W0502"]);
    assert_eq!(allowed.expect(0, &[]).err, "");
    check(&["--allow", "W0340"]).expect(2, &["did you mean `W0304`?"]);
    check(&["-D", "E0305"]).expect(2, &["only warnings"]);
    folder.run(&["compile", "plate.gng", "-D", "W0304"]).expect(1, &["error[W0304]"]);
    assert_eq!(folder.names(), ["plate.gng"]);
}

#[test]
fn fixes_are_made_until_none_is_left() {
    let folder = Folder::new("fixed");
    let broken =
        spec().replace("gonogo 1\n\n", "").replace("h = through)", "h = through").replace("40 ±0.1", "40,5 ±0,1");
    folder
        .file("plate.gng", broken.replace("z = 0 ±0.05", "z = 0 ±0.05;").replace("6 +0.012/0", "6 +0.012"))
        .file("other.gng", "gonogo 1;\n");
    let run = folder.run(&["check", "--fix", "plate.gng"]);
    let made = ["mended E0105", "mended E0101: write `40.5 ±0.1`", "a `)` is missing before `on`", "remove the `;`"];
    run.expect(1, &made);
    // What could mean several things is left to people.
    let spec = spec().replace("gonogo 1\n\n", "gonogo 1\n");
    assert_eq!(folder.read("plate.gng"), spec.replace("40 ±0.1", "40.5 ±0.1").replace("6 +0.012/0", "6 +0.012"));
    assert_eq!((folder.read("other.gng").as_str(), folder.names().len()), ("gonogo 1;\n", 2));
    let good = folder.file("good.gng", spec).run(&["check", "--fix", "good.gng"]);
    assert_eq!(good.expect(0, &[]).err, "");
}

#[test]
fn fixes_of_standard_input_go_to_standard_output() {
    let folder = Folder::new("fixed_input");
    let run = folder.run_with(&["check", "--fix", "-"], &spec().replace("root plate", "root plate;"));
    assert_eq!(run.expect(0, &["<stdin>:30:15: mended E0101: remove the `;`"]).out, spec());
    let mixed = folder.run_with(&["check", "--fix", "-", "--message-format", "json"], &spec());
    mixed.expect(2, &["standard output"]);
}

#[test]
fn fixes_stay_in_the_files_that_are_named() {
    let folder = Folder::new("fixed_use");
    let (head, rest) = spec().split_once("part pin").map(|(h, r)| (h.to_string(), format!("part pin{r}"))).unwrap();
    let used = head.replace("z = 4 ±0.05)", "z = 4 ±0.05))");
    folder.file("used.gng", &used).file("top.gng", format!("gonogo 1\nuse \"used.gng\"\n{rest}"));
    folder.run(&["check", "--fix", "top.gng"]).expect(1, &["this `)` closes nothing"]);
    assert_eq!(folder.read("used.gng"), used);
    folder.run(&["check", "--fix", "top.gng", "used.gng"]).expect(1, &["used.gng:19:58:", "mended E0101: remove it"]);
    assert_eq!(folder.read("used.gng"), head);
}
