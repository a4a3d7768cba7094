//! The command line as a stranger meets it: what goes in wrong, what comes out, and with which exit code.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// What a run said and how it ended.
struct Run {
    code: i32,
    out: String,
    err: String,
}

impl Run {
    #[track_caller]
    fn expect(&self, code: i32, said: &[&str]) -> &Run {
        assert_eq!(self.code, code, "out: {}\nerr: {}", self.out, self.err);
        let all = format!("{}{}", self.out, self.err);
        for part in said {
            assert!(all.contains(part), "`{part}` is not in:\n{all}");
        }
        self
    }
}

/// A folder of one test's own.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Folder {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    fn file(&self, name: &str, content: impl AsRef<[u8]>) -> &Folder {
        fs::write(self.0.join(name), content).unwrap();
        self
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(&self.0).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    fn run(&self, args: &[&str]) -> Run {
        self.run_with(args, "")
    }

    fn run_with(&self, args: &[&str], input: &str) -> Run {
        self.file(".input", input);
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        let input = fs::File::open(self.0.join(".input")).unwrap();
        fs::remove_file(self.0.join(".input")).unwrap();
        let output = command.current_dir(&self.0).args(args).stdin(Stdio::from(input)).output().unwrap();
        Run {
            code: output.status.code().expect("no signal"),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn spec() -> String {
    fs::read_to_string(root().join("tests/data/two_pins.gng")).unwrap()
}

/// The small plate compiled once, with its synthetic photos: model, calibration, `good.png`, `missing.png`.
fn plate() -> &'static Folder {
    static PLATE: OnceLock<Folder> = OnceLock::new();
    PLATE.get_or_init(|| {
        let folder = Folder::new("plate");
        folder.file("plate.gng", spec());
        folder.run(&["compile", "plate.gng", "--emit", "images,model"]).expect(0, &["plate.model.ron", "escapes"]);
        let images = folder.0.join("plate.images");
        fs::copy(images.join("good.png"), folder.0.join("good.png")).unwrap();
        fs::copy(images.join("01 pin[1] missing.png"), folder.0.join("missing.png")).unwrap();
        folder.run(&["calibrate", "plate.model.ron", "good.png", "-o", "plate.calibration.ron"]).expect(0, &[]);
        folder.file("rubbish.png", "not an image");
        folder
    })
}

const MODEL: &str = "plate.model.ron";
const CALIBRATION: [&str; 2] = ["--calibration", "plate.calibration.ron"];

fn inspect(photos: &[&str], more: &[&str]) -> Run {
    plate().run(&[&["inspect", MODEL], &CALIBRATION[..], photos, more].concat())
}

// --- Specs with faults -----------------------------------------------------------------------------------------------

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

// --- Compiling -------------------------------------------------------------------------------------------------------

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

// --- Layout ----------------------------------------------------------------------------------------------------------

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

// --- Models ----------------------------------------------------------------------------------------------------------

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
    model_refused("newer", |text| text.replacen("format: 4", "format: 99", 1), &["E0801", "format 99"]);
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

// --- Photos ----------------------------------------------------------------------------------------------------------

#[test]
fn exit_codes_tell_go_no_go_and_trouble_apart() {
    inspect(&["good.png"], &[]).expect(0, &["go", "good.png"]);
    inspect(&["good.png", "missing.png"], &[]).expect(1, &["no-go", "pin[1]: missing"]);
    inspect(&["missing.png", "rubbish.png", "good.png"], &[]).expect(2, &["no-go", "cannot-inspect", "good.png"]);
    inspect(&["nowhere.png", "good.png"], &[]).expect(2, &["cannot-inspect", "nowhere.png"]);
}

#[test]
fn json_has_one_object_a_line_whatever_the_photo_is_like() {
    let wrong_size = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::GrayImage::new(64, 48).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    };
    plate().file("small.png", wrong_size);
    let photos = ["good.png", "missing.png", "rubbish.png", "small.png", "nowhere.png"];
    let run = inspect(&photos, &["--format", "json"]);
    let lines: Vec<serde_json::Value> = run.out.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let verdicts: Vec<&str> = lines.iter().map(|l| l["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["go", "no-go", "cannot-inspect", "cannot-inspect", "cannot-inspect"]);
    assert_eq!(run.code, 2);
    for (line, photo) in lines.iter().zip(photos) {
        let mut keys: Vec<&String> = line.as_object().unwrap().keys().collect();
        keys.sort();
        assert_eq!(keys, ["findings", "milliseconds", "photo", "pose", "reason", "verdict"]);
        assert_eq!(line["photo"], photo);
    }
    assert!(lines[0]["pose"]["x"].as_f64().unwrap().abs() < 0.5, "{}", lines[0]);
    assert_eq!(lines[1]["findings"][0]["component"], "pin[1]");
    assert_eq!(lines[1]["findings"][0]["box"].as_array().unwrap().len(), 4);
    assert!(lines[3]["reason"].as_str().unwrap().contains("64x48"), "{}", lines[3]);
}

#[test]
fn junit_is_one_report_for_all() {
    let run = inspect(&["good.png", "missing.png", "rubbish.png"], &["--format", "junit"]);
    assert!(run.out.starts_with("<?xml") && run.out.trim_end().ends_with("</testsuites>"), "{}", run.out);
    run.expect(2, &[r#"tests="6" failures="1" errors="2""#]);
    run.expect(2, &[r#"<testcase classname="good.png" name="pin[1]"/>"#, r#"name="pin[1]"><failure type="no-go""#]);
    let suites = elements(&run.out);
    assert_eq!(suites.iter().filter(|(path, _)| path == "testsuites/testsuite").count(), 3);
    for (path, attributes) in &suites {
        let told = |key: &str| attributes.split_once(&format!(" {key}=\"")).map(|(_, v)| v.split('"').next().unwrap());
        match path.as_str() {
            "testsuites" => {
                assert_eq!((told("tests"), told("failures"), told("errors")), (Some("6"), Some("1"), Some("2")))
            }
            "testsuites/testsuite" => assert_eq!((told("tests"), told("skipped")), (Some("2"), Some("0"))),
            "testsuites/testsuite/testcase" => assert!(["pin[1]", "pin[2]"].contains(&told("name").unwrap())),
            other => assert!(other.ends_with("testcase/failure") || other.ends_with("testcase/error"), "{other}"),
        }
    }
}

/// The elements of an XML text with their paths and attributes; fails where a tag closes what is not open.
fn elements(xml: &str) -> Vec<(String, String)> {
    let (mut open, mut found) = (Vec::new(), Vec::new());
    for tag in xml.split('<').skip(1).map(|t| t.split_once('>').expect("a tag ends").0).filter(|t| !t.starts_with('?'))
    {
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
            continue;
        }
        let (name, attributes) = tag.trim_end_matches('/').split_once(' ').unwrap_or((tag, ""));
        open.push(name);
        found.push((open.join("/"), format!(" {attributes}")));
        if tag.ends_with('/') {
            open.pop();
        }
    }
    assert!(open.is_empty(), "{open:?}");
    found
}

#[test]
fn overlays_are_written_for_photos_that_can_be_seen() {
    let dir = Folder::new("overlays");
    let out = dir.0.join("over");
    inspect(&["good.png", "missing.png", "rubbish.png"], &["--overlay", out.to_str().unwrap()]).expect(2, &[]);
    assert_eq!(Folder(out.clone()).names(), ["good.png", "missing.png"]);
    let size = |name: &str| image::image_dimensions(out.join(name)).unwrap();
    assert_eq!((size("good.png"), size("missing.png")), ((96, 72), (96, 72)));
}

#[test]
fn an_overlay_never_takes_the_place_of_its_photo() {
    let before = fs::read(plate().0.join("good.png")).unwrap();
    inspect(&["good.png"], &["--overlay", "."]).expect(2, &["overwrite"]);
    assert_eq!(fs::read(plate().0.join("good.png")).unwrap(), before);
}

#[test]
fn without_calibration_the_spec_is_taken_at_its_word() {
    let run = plate().run(&["inspect", MODEL, "good.png"]);
    assert!(run.err.contains("not calibrated"), "{}", run.err);
    assert!(run.out.contains("good.png"));
}

#[test]
fn a_photo_of_a_faulty_assembly_does_not_calibrate() {
    let run = plate().run(&["calibrate", MODEL, "missing.png", "-o", "faulty.calibration.ron"]);
    run.expect(1, &["error[E080"]);
    assert!(!plate().0.join("faulty.calibration.ron").exists());
}

#[test]
fn a_photo_of_the_wrong_size_does_not_calibrate() {
    plate().file("tiny.png", {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::GrayImage::new(8, 8).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    });
    plate().run(&["calibrate", MODEL, "tiny.png", "-o", "t.calibration.ron"]).expect(2, &["8x8"]);
    assert!(!plate().0.join("t.calibration.ron").exists());
}

// --- Goldens ---------------------------------------------------------------------------------------------------------

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
