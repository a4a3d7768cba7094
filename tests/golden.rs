//! The blessed outputs of the stages, compared by the same command that users have; and that command itself.
//!
//! `GONOGO_BLESS=1 cargo test --test golden` rewrites them (refused where CI is set); review the difference before committing.

#![cfg(feature = "cli")]

use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs `gonogo golden` on a spec, the blessed outputs being in `golden/`.
fn golden(spec: &str, stages: &str) {
    let verb = if std::env::var_os("GONOGO_BLESS").is_some_and(|v| v == "1") { "bless" } else { "check" };
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    command.current_dir(root()).args(["golden", verb, spec, "--stage", stages, "--diff"]);
    let output = command.output().unwrap();
    let (said, diff) = (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
    assert!(output.status.success(), "{said}\n{diff}");
}

#[test]
fn the_pattern_wheel_is_analysed_as_blessed() {
    let stages = "design,brep,contacts,liaison,error-trees,object-tree,insertion,view";
    golden("specs/pattern_wheel.gng", stages);
}

#[test]
fn a_small_plate_is_analysed_trained_and_rendered_as_blessed() {
    let stages = "design,brep,contacts,liaison,error-trees,object-tree,insertion,view,images,model";
    golden("tests/data/two_pins.gng", stages);
}

#[test]
fn all_shapes_and_their_measure_are_made_as_blessed() {
    golden("specs/shapes.gng", "brep,measures");
}

#[test]
fn goldens_are_short_enough_to_be_read() {
    const LARGEST: u64 = 20 << 10;
    let mut folders = vec![root().join("golden")];
    while let Some(folder) = folders.pop() {
        for file in fs::read_dir(folder).unwrap() {
            let file = file.unwrap();
            if file.file_type().unwrap().is_dir() {
                folders.push(file.path());
                continue;
            }
            let size = file.metadata().unwrap().len();
            assert!(size <= LARGEST, "{} has {size} bytes", file.path().display());
        }
    }
}

// --- The command -----------------------------------------------------------------------------------------------------

/// A folder with the small plate as `plate.gng`, and with blessed outputs of these stages.
struct Bench(PathBuf);

struct Run {
    code: i32,
    out: String,
    err: String,
}

impl Bench {
    fn new(name: &str, stages: &str) -> Bench {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("golden_{name}"));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        let bench = Bench(path);
        bench.write("plate.gng", &fs::read_to_string(root().join("tests/data/two_pins.gng")).unwrap());
        if !stages.is_empty() {
            bench.run("bless", &["--stage", stages]).expect(0, "");
        }
        bench
    }

    fn run(&self, verb: &str, more: &[&str]) -> Run {
        self.run_on(verb, &["plate.gng"], more)
    }

    fn run_on(&self, verb: &str, specs: &[&str], more: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        command.current_dir(&self.0).env_remove("CI").args(["golden", verb]).args(specs).args(more);
        let output = command.output().unwrap();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
        Run { code: output.status.code().unwrap(), out: text(output.stdout), err: text(output.stderr) }
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    /// Changes a text once.
    #[track_caller]
    fn change(&self, name: &str, from: &str, to: &str) {
        let text = self.read(name);
        assert!(text.contains(from), "{name} has no `{from}`:\n{text}");
        self.write(name, &text.replacen(from, to, 1));
    }

    fn has(&self, name: &str) -> bool {
        self.0.join(name).exists()
    }
}

impl Run {
    #[track_caller]
    fn expect(&self, code: i32, said: &str) -> &Run {
        let all = format!("{}{}", self.out, self.err);
        assert_eq!(self.code, code, "{all}");
        assert!(all.contains(said), "`{said}` is not in:\n{all}");
        self
    }
}

const CONTACTS: &str = "golden/plate/contacts.ron";

#[test]
fn a_number_a_word_a_lost_and_a_new_entry_are_named_by_path() {
    let bench = Bench::new("differences", "contacts");
    let blessed = bench.read(CONTACTS);
    bench.run("check", &["--stage", "contacts"]).expect(0, "golden/plate: 1 golden agrees");
    let cases = [
        ("mmc: 0.004", "mmc: 0.005", "contacts.ron: contacts[0].gap.mmc: 0.005 blessed, 0.004 now"),
        ("kind: Cylinder", "kind: Cone", "contacts[0].kind: Cone blessed, Cylinder now"),
        ("lmc: 0.024", "lmc: 0.024, max: 1", "contacts[0].gap.max: 1 blessed, nothing now"),
        (", fit: Some(Clearance)", "", "contacts[0].fit: nothing blessed, Some(Clearance) now"),
    ];
    for (from, to, said) in cases {
        bench.change(CONTACTS, from, to);
        let run = bench.run("check", &["--stage", "contacts"]);
        run.expect(1, said).expect(1, "gonogo golden bless plate.gng --stage contacts");
        assert_eq!(bench.read("target/golden/plate/contacts.ron"), blessed);
        bench.write(CONTACTS, &blessed);
    }
    // The one that agrees again leaves nothing that would mislead.
    bench.run("check", &["--stage", "contacts"]).expect(0, "");
    assert!(!bench.has("target/golden/plate/contacts.ron"));
}

#[test]
fn the_goldens_own_tolerances_decide() {
    let bench = Bench::new("tolerances", "contacts,view");
    bench.change(CONTACTS, "mmc: 0.004", "mmc: 0.0041");
    bench.run("check", &["--stage", "contacts"]).expect(0, "");
    bench.change(CONTACTS, "±0.0002 ±0 %", "±0.00001 ±0 %");
    bench.run("check", &["--stage", "contacts"]).expect(1, "gap.mmc: 0.0041 blessed, 0.004 now");
    bench.change(CONTACTS, "\n[", "\n// tolerance of gap: ±0.001\n[");
    bench.run("check", &["--stage", "contacts"]).expect(0, "");
    // What a person wrote about tolerances outlives a blessing, and so do digits that count as equal.
    bench.change(CONTACTS, "Cylinder", "Cone");
    bench.run("bless", &["--stage", "contacts"]).expect(0, "1 blessed");
    let text = bench.read(CONTACTS);
    assert!(text.contains("tolerance of gap: ±0.001\n") && text.contains("mmc: 0.0041"), "{text}");
    bench.change(CONTACTS, "tolerance of gap: ±0.001", "tolerance of gap: a lot");
    bench.run("check", &["--stage", "contacts"]).expect(1, "line 3: `// tolerance of gap: a lot` is no tolerance");
    bench.run("bless", &["--stage", "contacts"]).expect(1, "nothing was blessed");
}

/// The objects on standard output.
fn objects(run: &Run) -> Vec<Value> {
    run.out.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

#[test]
fn programs_are_told_every_difference() {
    let bench = Bench::new("json", "contacts,insertion");
    let json = ["--stage", "contacts,insertion,measures", "--message-format", "json"];
    let run = bench.run("check", &json);
    assert_eq!((run.code, run.err.as_str()), (0, ""));
    let said = objects(&run);
    assert_eq!(said.len(), 3, "two goldens and a summary");
    assert!(said[..2].iter().all(|o| o["reason"] == "golden" && o["verdict"] == "equal"), "{}", run.out);
    assert_eq!((&said[2]["reason"], &said[2]["equal"]), (&json!("golden-summary"), &json!(2)));

    bench.change(CONTACTS, "mmc: 0.004", "mmc: 0.005");
    bench.change(CONTACTS, "kind: Cylinder", "kind: Cone");
    bench.write("golden/plate/measures.ron", "[1]\n");
    bench.write("golden/plate/notes.txt", "hello");
    fs::remove_file(bench.0.join("golden/plate/insertion.ron")).unwrap();
    let run = bench.run("check", &[&json[..], &["--diff"]].concat());
    assert_eq!((run.code, run.err.as_str()), (1, ""));
    let said = objects(&run);
    let of = |file: &str| said.iter().find(|o| o["file"] == format!("golden/plate/{file}")).unwrap();
    let contacts = of("contacts.ron");
    assert_eq!((&contacts["spec"], &contacts["stage"]), (&json!("plate.gng"), &json!("contacts")));
    let kind = json!({ "path": "contacts[0].kind", "expected": "Cone", "actual": "Cylinder", "tolerance": null });
    let gap = json!({
        "path": "contacts[0].gap.mmc", "expected": "0.005", "actual": "0.004",
        "tolerance": { "absolute": 0.0002, "share": 0.0 },
    });
    assert_eq!(contacts["differences"], json!([kind, gap]));
    assert_eq!(contacts["kept"], "target/golden/plate/contacts.ron");
    assert!(bench.has("target/golden/plate/contacts.ron"));
    assert!(contacts["diff"].as_str().unwrap().starts_with("--- golden/plate/contacts.ron\n+++ "));
    let verdicts = ["insertion.ron", "measures.ron", "notes.txt"].map(|file| of(file)["verdict"].clone());
    assert_eq!(verdicts, [json!("missing"), json!("stale"), json!("stranger")]);
    let summary = said.last().unwrap();
    let counts = ["equal", "differs", "missing", "stale", "stranger", "unclear", "faulty_specs"].map(|k| &summary[k]);
    assert_eq!(counts, [0, 1, 1, 1, 1, 0, 0].map(|n| json!(n)).each_ref());
    assert_eq!(summary["bless"], json!(["gonogo golden bless plate.gng --stage contacts,insertion,measures"]));

    for (more, dry, code) in [(&["--dry-run"][..], true, 1), (&[], false, 0)] {
        let run = bench.run("bless", &[&json[..], more].concat());
        assert_eq!((run.code, run.err.as_str()), (0, ""));
        let said = objects(&run);
        let done: Vec<&Value> = said.iter().filter(|o| o["done"].is_string()).map(|o| &o["done"]).collect();
        assert_eq!(done, ["blessed", "blessed", "removed"], "{}", run.out);
        let last = said.last().unwrap();
        assert_eq!((&last["blessed"], &last["removed"], &last["dry_run"]), (&json!(2), &json!(1), &json!(dry)));
        assert_eq!(bench.run("check", &json).code, code);
    }
}

#[test]
fn programs_are_told_of_specs_with_errors() {
    let bench = Bench::new("json_errors", "contacts");
    bench.change("plate.gng", "material = ", "material = un");
    let run = bench.run("check", &["--message-format", "json"]);
    assert_eq!((run.code, run.err.as_str()), (1, ""));
    let said = objects(&run);
    assert!(said[0]["code"].is_string() && said[0]["reason"].is_null(), "{}", run.out);
    assert_eq!(said.last().unwrap()["faulty_specs"], 1);
}

#[test]
fn a_diff_shows_what_counts_and_nothing_else() {
    let bench = Bench::new("diff", "contacts");
    let blessed = bench.read(CONTACTS);
    bench.change(CONTACTS, "mmc: 0.004", "mmc: 0.0041");
    bench.change(CONTACTS, "pin[2].shank.side", "pin[2].head.side");
    let run = bench.run("check", &["--stage", "contacts", "--diff"]);
    run.expect(1, "");
    assert!(
        run.out.starts_with("--- golden/plate/contacts.ron\n+++ golden/plate/contacts.ron (now)\n@@ "),
        "{}",
        run.out
    );
    let changed = run.out.lines().skip(2).filter(|l| l.starts_with(['-', '+']));
    assert!(changed.clone().all(|l| l.contains("pin[2]")) && changed.count() == 2, "{}", run.out);
    assert!(bench.read("target/golden/plate/contacts.ron").contains("0.0041"));
    bench.run("check", &["--stage", "contacts", "--beside"]).expect(1, "golden/plate/contacts.now.ron");
    assert!(bench.has("golden/plate/contacts.now.ron"));
    bench.run("bless", &["--stage", "contacts"]).expect(0, "contacts[1].faces[1]: \"pin[2].head.side\" blessed");
    assert!(!bench.has("golden/plate/contacts.now.ron"));
    assert_eq!(bench.read(CONTACTS), blessed.replacen("mmc: 0.004", "mmc: 0.0041", 1));
}

#[test]
fn missing_stale_and_strange_files_are_told_apart() {
    let bench = Bench::new("files", "contacts,measures");
    assert!(!bench.has("golden/plate/measures.ron"), "there is nothing to measure");
    bench.write("golden/plate/measures.ron", "[1]\n");
    bench.write("golden/plate/notes.txt", "hello");
    let run = bench.run("check", &["--stage", "contacts,measures,insertion"]);
    run.expect(1, "error: golden/plate/measures.ron: stale: this is not made any more");
    run.expect(1, "error: golden/plate/insertion.ron: no blessed output to compare with");
    run.expect(1, "warning: golden/plate/notes.txt: no stage writes this");
    assert!(!run.err.contains("contacts.ron"), "{}", run.err);
    bench.run("check", &["--stage", "contacts"]).expect(0, "warning: golden/plate/notes.txt");
    // Blessing takes away what is stale, of the stages asked for only.
    bench.run("bless", &["--stage", "insertion"]).expect(0, "1 blessed, 0 removed, 0 unchanged");
    assert!(bench.has("golden/plate/measures.ron"));
    let run = bench.run("bless", &["--stage", "measures,insertion"]);
    run.expect(0, "golden/plate/measures.ron: removed").expect(0, "0 blessed, 1 removed, 1 unchanged");
    assert!(!bench.has("golden/plate/measures.ron") && bench.has("golden/plate/notes.txt"));
}

#[test]
fn without_stages_the_quick_ones_and_those_once_blessed_are_meant() {
    let bench = Bench::new("stages", "");
    bench.run("bless", &[]).expect(0, "8 blessed, 0 removed, 0 unchanged");
    assert!(bench.has("golden/plate/object_tree.ron") && !bench.has("golden/plate/model.ron"));
    bench.run("check", &["--stages", "design,view"]).expect(0, "2 goldens agree");
    fs::remove_file(bench.0.join("golden/plate/design.ron")).unwrap();
    bench.run("check", &[]).expect(1, "design.ron: no blessed output");
    bench.run("check", &["--stage", "step"]).expect(2, "design, brep, contacts");
}

#[test]
fn pictures_are_small_and_compared_by_their_grey_values() {
    let bench = Bench::new("pictures", "images");
    let (good, now) = ("golden/plate/images/good.png", "target/golden/plate/images/good.png");
    let mut picture = image::open(bench.0.join(good)).unwrap().into_luma8();
    let (x, y) = (20, 11);
    let value = picture.get_pixel(x, y)[0];
    picture.put_pixel(x, y, image::Luma([value ^ 4]));
    picture.save(bench.0.join(good)).unwrap();
    bench.run("check", &["--stage", "images"]).expect(0, "");
    picture.put_pixel(x, y, image::Luma([value ^ 0x80]));
    picture.save(bench.0.join(good)).unwrap();
    fs::remove_file(bench.0.join("golden/plate/images/01 pin[1] missing.png")).unwrap();
    fs::copy(bench.0.join(good), bench.0.join("golden/plate/images/09 nut missing.png")).unwrap();
    let run = bench.run("check", &["--stage", "images", "--diff"]);
    run.expect(1, &format!("most at pixel (20, 11): {} blessed, {value} now", value ^ 0x80));
    run.expect(1, "01 pin[1] missing.png: no blessed output").expect(1, "09 nut missing.png: stale");
    let sheet = image::open(bench.0.join("target/golden/plate/images/good.diff.png")).unwrap();
    assert_eq!((sheet.width(), sheet.height()), (3 * 96 + 8, 72));
    assert_eq!(image::open(bench.0.join(now)).unwrap().into_luma8().get_pixel(x, y)[0], value);
    // What is allowed stands in the list of the pictures.
    bench.change("golden/plate/images.ron", "mean 0.5, most 12", "mean 0.5, most 200");
    assert!(!bench.run("check", &["--stage", "images"]).err.contains("good.png"));
    bench.run("bless", &["--stage", "images"]).expect(0, "1 blessed, 1 removed,");
}

#[test]
fn a_dry_run_changes_nothing_and_ci_blesses_nothing() {
    let bench = Bench::new("dry", "contacts");
    bench.change(CONTACTS, "Cylinder", "Cone");
    let (changed, again) = (bench.read(CONTACTS), ["--stage", "contacts,liaison", "--dry-run"]);
    let run = bench.run("bless", &again);
    run.expect(0, "contacts[0].kind: Cone blessed, Cylinder now").expect(0, "liaison.ron: new");
    run.expect(0, "2 would be blessed, 0 would be removed, 0 unchanged");
    assert_eq!(bench.read(CONTACTS), changed);
    assert!(!bench.has("golden/plate/liaison.ron"));
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    let ci = command.current_dir(&bench.0).env("CI", "1").args(["golden", "bless", "plate.gng"]).output().unwrap();
    assert_eq!(ci.status.code(), Some(2));
    assert_eq!(bench.read(CONTACTS), changed);
}

#[test]
fn specs_with_faults_and_names_that_clash_bless_nothing() {
    let bench = Bench::new("faults", "");
    bench.write("bad.gng", "gonogo 1\n");
    bench.run_on("check", &["bad.gng", "plate.gng"], &[]).expect(1, "E0207").expect(1, "design.ron: no blessed output");
    bench.run_on("bless", &["plate.gng", "bad.gng"], &[]).expect(1, "nothing was blessed");
    assert!(!bench.has("golden"));
    fs::create_dir_all(bench.0.join("other")).unwrap();
    fs::copy(bench.0.join("plate.gng"), bench.0.join("other/plate.gng")).unwrap();
    bench.run_on("check", &["plate.gng", "other/plate.gng"], &[]).expect(2, "would share their goldens");
    bench.run_on("check", &["-"], &[]).expect(2, "give a file");
    bench.run_on("check", &["nowhere.gng"], &[]).expect(2, "nowhere.gng");
}
