//! What build tools rely on: dependencies, locks, the cache, watching, and the same bytes wherever a spec is compiled.

#![cfg(feature = "cli")]

mod folder;

use folder::{Folder, PIN, SPEC, installed};
use std::fs;
use std::io::Write;
use std::process::{Child, Stdio};
use std::time::{Duration, SystemTime};

// --- Dependencies ----------------------------------------------------------------------------------------------------

#[test]
fn a_rule_names_every_file_that_was_read() {
    let folder = Folder::with_specs("deps_rule");
    folder.gonogo(&["compile", SPEC, "--emit", "view", "--deps", "plate.d"]).expect(0, &[]);
    assert_eq!(folder.read("plate.d"), format!("plate.view.ron: {SPEC} {PIN}\n\n{PIN}:\n"));
    folder.gonogo(&["check", SPEC, "--deps", "check.d", "--stamp", "plate.checked"]).expect(0, &[]);
    assert_eq!(folder.read("check.d"), format!("plate.checked: {SPEC} {PIN}\n\n{PIN}:\n"));
    assert_eq!(folder.read("plate.checked"), "");
    folder.gonogo(&["check", SPEC, "--deps", "x.d"]).expect(2, &["--stamp"]);
}

#[test]
fn what_was_read_is_told_of_a_failure_too_but_not_as_a_rule() {
    let folder = Folder::with_specs("deps_failure");
    folder.edit(SPEC, "use \"parts/pin.gng\"", "use \"parts/pin.gng\"\nuse \"parts/none.gng\"");
    folder.gonogo(&["compile", SPEC, "--deps", "plate.json", "--deps-format", "json"]).expect(1, &["E0201"]);
    let deps: serde_json::Value = serde_json::from_str(&folder.read("plate.json")).unwrap();
    let missing = ["specs/parts/none.gng"];
    assert_eq!(deps, serde_json::json!({ "outputs": [], "inputs": [SPEC, PIN], "missing": missing }));
    folder.gonogo(&["check", SPEC, "--deps", "plate.zero", "--deps-format", "zero"]).expect(1, &[]);
    assert_eq!(folder.read("plate.zero"), format!("{SPEC}\0{PIN}\0"));
    folder.gonogo(&["compile", SPEC, "--deps", "plate.d"]).expect(1, &[]);
    folder.gonogo(&["check", SPEC, "--deps", "plate.d", "--stamp", "stamp"]).expect(1, &[]);
    assert!(!folder.has("plate.d") && !folder.has("stamp"));
}

#[test]
fn standard_input_is_no_file_to_depend_on() {
    let folder = Folder::with_specs("deps_stdin");
    let text = folder.read(SPEC).replace("parts/", "specs/parts/");
    let args = ["check", "-", "--deps", "-", "--deps-format", "json"];
    let mut child = folder.command(env!("CARGO_BIN_EXE_gonogo"), &args);
    let mut child = child.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let run = folder::Run::of(child.wait_with_output().unwrap());
    run.expect(0, &[]);
    let deps: serde_json::Value = serde_json::from_str(&run.out).unwrap();
    assert_eq!(deps, serde_json::json!({ "outputs": [], "inputs": [PIN], "missing": [] }));
}

/// make is the judge of whether names are escaped rightly: it runs the recipe exactly when the file behind the name is newer.
#[test]
fn make_and_ninja_read_names_as_they_are() {
    let folder = Folder::with_specs("deps_names");
    let (spec, part) = ("a b#c$d.gng", "parts/p q%$$.gng");
    fs::rename(folder.0.join(SPEC), folder.0.join(spec)).unwrap();
    fs::create_dir(folder.0.join("parts")).unwrap();
    fs::rename(folder.0.join(PIN), folder.0.join(part)).unwrap();
    folder.edit(spec, "parts/pin.gng", part);
    folder.gonogo(&["check", spec, "--deps", "x.d", "--stamp", "out #1"]).expect(0, &[]);
    // Long ago, so that what is made now is younger.
    let start = SystemTime::now() - Duration::from_secs(3600);
    let later = |name: &str, seconds: u64| {
        let file = fs::File::options().append(true).open(folder.0.join(name)).unwrap();
        file.set_modified(start + Duration::from_secs(seconds)).unwrap();
    };
    for name in [spec, part] {
        [spec, part].into_iter().for_each(|name| later(name, 0));
        later("out #1", 10);
        let (rule, rest) = folder.read("x.d").split_once('\n').map(|(r, s)| (r.to_string(), s.to_string())).unwrap();
        if installed("make") {
            folder.write("Makefile", &format!("{rule}\n\t@echo made\n{rest}"));
            let make = || folder::Run::of(folder.command("make", &[]).output().unwrap());
            assert!(!make().expect(0, &[]).out.contains("made"), "{rule}");
            later(name, 20);
            make().expect(0, &["made"]);
        }
        later(name, 0);
        if installed("ninja") {
            let _ = fs::remove_file(folder.0.join(".ninja_log"));
            folder.write(
                "build.ninja",
                "rule touch\n  command = touch $out && echo made\n  depfile = x.d\nbuild out$ #1: touch\n",
            );
            let ninja = || folder::Run::of(folder.command("ninja", &[]).output().unwrap());
            ninja().expect(0, &["made"]);
            ninja().expect(0, &["no work to do"]);
            later(name, 7200);
            ninja().expect(0, &["made"]);
        }
    }
}

// --- Locks -----------------------------------------------------------------------------------------------------------

const LOCK: &str = "specs/plate.lock.ron";

fn with_choice(name: &str) -> Folder {
    let folder = Folder::with_specs(name);
    folder.edit(SPEC, "camera fixed", "camera auto");
    folder.edit(SPEC, "distance  = 250", "distance  = 240 .. 260");
    folder.edit(SPEC, "elevation = 65", "elevation = 60 .. 80");
    folder
}

const VIEW: [&str; 6] = ["compile", SPEC, "--emit", "view", "-o", "plate.model.ron"];

fn view(folder: &Folder, more: &[&str]) -> folder::Run {
    folder.gonogo(&[&["compile", SPEC, "--emit", "view"], more].concat())
}

#[test]
fn nothing_is_locked_where_nothing_is_chosen() {
    let folder = Folder::with_specs("lock_none");
    view(&folder, &[]).expect(0, &[]);
    assert!(!folder.has(LOCK));
    view(&folder, &["--locked"]).expect(0, &[]);
    assert!(!folder.has(LOCK));
}

#[test]
fn a_choice_is_locked_and_stands_until_its_question_changes() {
    let folder = with_choice("lock");
    view(&folder, &["--locked"]).expect(1, &["E0605", "there is no lock", "camera auto"]);
    assert!(!folder.has(LOCK));
    view(&folder, &[]).expect(0, &[]);
    let locked = folder.read(LOCK);
    assert!(locked.starts_with("// What gonogo chose") && locked.contains("\"bench\""), "{locked}");
    let searched = folder.read("plate.view.ron");
    view(&folder, &["--locked"]).expect(0, &[]);
    let camera =
        |text: &str| text.lines().filter(|l| l.contains("camera") || l.contains("position")).collect::<String>();
    assert_eq!(camera(&folder.read("plate.view.ron")), camera(&searched));
    // A comment, a name and the training have nothing to do with the camera; the lock is left as it was.
    folder.edit(SPEC, "images  = 2", "images  = 3");
    folder.edit(SPEC, "station bench", "// The bench by the door.\nstation bench");
    folder.gonogo(&["check", SPEC]).expect(0, &[]);
    view(&folder, &["--locked"]).expect(0, &[]);
    assert_eq!(folder.read(LOCK), locked);
    folder.edit(PIN, "h = 10 ±0.05", "h = 9 ±0.05");
    view(&folder, &["--locked"]).expect(1, &["E0605", "other parts"]);
    assert_eq!(folder.read(LOCK), locked);
    view(&folder, &[]).expect(0, &[]);
    assert_ne!(folder.read(LOCK), locked);
    view(&folder, &["--locked"]).expect(0, &[]);
    folder.edit(SPEC, "seed    = 7", "seed    = 8");
    view(&folder, &["--locked"]).expect(1, &["seed 7", "seed 8"]);
}

#[test]
fn the_choice_comes_from_the_lock_and_from_nowhere_else() {
    let folder = with_choice("lock_taken");
    view(&folder, &[]).expect(0, &[]);
    let locked = folder.read(LOCK);
    let distance = locked.lines().find(|l| l.contains("distance:")).unwrap().trim().to_string();
    folder.write(LOCK, &locked.replace(&distance, "distance: 251.25,"));
    view(&folder, &["--locked"]).expect(0, &[]);
    let seen = folder.read("plate.view.ron");
    let position = seen.split("position: (").nth(1).unwrap().split(')').next().unwrap();
    let [x, y, z] = position.split(", ").map(|v| v.parse::<f64>().unwrap()).collect::<Vec<_>>()[..] else {
        panic!("{seen}")
    };
    // From the point it is aimed at.
    assert!(((x * x + y * y + (z - 4.0) * (z - 4.0)).sqrt() - 251.25).abs() < 0.01, "{seen}");
    assert!(seen.contains("views_tried: 1,"), "{seen}");
    folder.write(LOCK, &locked.replace(&distance, "distance: 900.0,"));
    view(&folder, &["--locked"]).expect(1, &["E0605"]);
    folder.write(LOCK, "<<<<<<< ours");
    view(&folder, &[]).expect(2, &["plate.lock.ron", "delete it"]);
}

// --- The cache -------------------------------------------------------------------------------------------------------

fn found(run: &folder::Run) -> &str {
    run.err.lines().find_map(|l| l.strip_prefix("cache ")).unwrap_or_else(|| panic!("{}", run.err)).trim()
}

#[test]
fn models_are_the_same_with_and_without_the_cache() {
    let folder = Folder::with_specs("cache");
    let compile = |more: &[&str]| {
        let run = folder.gonogo(&[&["compile", SPEC, "-o", "m.ron", "--timings"], more].concat());
        run.expect(0, &[]);
        (folder.read("m.ron"), run)
    };
    // (an edit, what is found then): 2 draws to learn from and 7 for each of six customers, and what was learnt from them.
    let edits = [
        (SPEC, "station bench", "// Layout and comments.\nstation   bench", "1 of 1 found"),
        (SPEC, "false_reject = 1 %", "false_reject = 2 %", "1 of 1 found"),
        (PIN, "material white", "material chalk", ""),
        (PIN, "material = white", "material = chalk", "1 of 1 found"),
        (SPEC, "levels  = 1", "levels  = 2", "44 of 45 found"),
        (SPEC, "noise = 0.004", "noise = 0.005", "44 of 45 found"),
        (SPEC, "images  = 2", "images  = 3", "44 of 46 found"),
        (PIN, "h = 10 ±0.05", "h = 9.9 ±0.05", "0 of 46 found"),
    ];
    let (cold, run) = compile(&[]);
    assert_eq!(found(&run), "0 of 45 found");
    let (bare, run) = compile(&["--no-cache"]);
    assert!(!run.err.contains("cache "), "{}", run.err);
    let (warm, run) = compile(&[]);
    assert_eq!(found(&run), "1 of 1 found");
    assert!(cold == bare && warm == bare, "the models differ");
    for (file, from, to, expected) in edits {
        folder.edit(file, from, to);
        if expected.is_empty() {
            continue;
        }
        let (kept, run) = compile(&[]);
        assert_eq!(found(&run), expected, "{to}");
        assert!(kept == compile(&["--no-cache"]).0, "{to}: the models differ");
    }
}

#[test]
fn damaged_entries_are_made_anew() {
    let folder = Folder::with_specs("cache_damage");
    let compile = |more: &[&str]| {
        folder.gonogo(&[&["compile", SPEC, "-o", "m.ron", "--timings"], more].concat()).expect(0, &[]);
        folder.read("m.ron")
    };
    let first = compile(&["--cache-dir", "kept"]);
    let mut entries = Vec::new();
    for below in fs::read_dir(folder.0.join("kept")).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_dir()) {
        entries.extend(fs::read_dir(below).unwrap().map(|e| e.unwrap().path()));
    }
    assert_eq!(entries.len(), 45);
    for (i, path) in entries.iter().enumerate() {
        let mut bytes = fs::read(path).unwrap();
        match i % 3 {
            0 => bytes.truncate(bytes.len() / 2),
            1 => *bytes.last_mut().unwrap() ^= 1,
            _ => bytes.clear(),
        }
        fs::write(path, bytes).unwrap();
    }
    assert!(compile(&["--cache-dir", "kept"]) == first);
    let run = folder.gonogo(&["compile", SPEC, "-o", "m.ron", "--timings", "--cache-dir", "kept"]);
    assert_eq!(found(&run), "1 of 1 found");
    assert!(!folder.has(".cache"), "a folder given on the command line is the only one");
}

// --- The same everywhere ---------------------------------------------------------------------------------------------

#[test]
fn models_are_the_same_in_any_folder_for_any_user_and_at_any_number_of_threads() {
    let here = Folder::with_specs("same_here");
    let there = Folder::with_specs("same there, too");
    let compile = |folder: &Folder, shell: &str| {
        let gonogo = env!("CARGO_BIN_EXE_gonogo");
        let script = format!("{shell} \"{gonogo}\" compile \"$SPEC\" -o m.ron --no-cache \"$@\"");
        let mut command = folder.command("sh", &["-c", &script, "sh"]);
        command.env("SPEC", SPEC);
        command
    };
    let mut first = compile(&here, "");
    folder::Run::of(first.args(["-j", "1"]).output().unwrap()).expect(0, &[]);
    let mut second = compile(&there, "umask 077;");
    second.args(["-j", "3"]).env("HOME", "/nonexistent").env("USER", "someone").env("LOGNAME", "someone");
    second.env("LANG", "de_DE.UTF-8").env("TZ", "Asia/Tokyo").env("SPEC", there.0.join(SPEC));
    folder::Run::of(second.output().unwrap()).expect(0, &[]);
    assert!(here.read("m.ron") == there.read("m.ron"), "the models differ");
}

// --- Watching --------------------------------------------------------------------------------------------------------

/// A watching gonogo, ended at the latest with the test.
struct Watching(Child);

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a watch of which each line is handed to `then`, which edits files; the number of rounds, and the exit code.
fn watch(folder: &Folder, args: &[&str], mut then: impl FnMut(usize, &str)) -> (Vec<String>, Option<i32>) {
    use std::io::{BufRead, BufReader};
    let mut command = folder.command(env!("CARGO_BIN_EXE_gonogo"), args);
    let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut watching = Watching(child);
    let lines = BufReader::new(watching.0.stderr.take().unwrap()).lines().map(Result::unwrap);
    let mut rounds = Vec::new();
    for line in lines.filter(|line| line.starts_with("round ")) {
        then(rounds.len(), &line);
        rounds.push(line);
    }
    (rounds, watching.0.wait().unwrap().code())
}

#[test]
fn check_looks_again_when_a_used_file_changes() {
    let folder = Folder::with_specs("watch_check");
    let args = ["check", SPEC, "--watch", "--rounds", "4"];
    let (rounds, code) = watch(&folder, &args, |round, _| match round {
        0 => folder.edit(PIN, "material = white", "material = whote"),
        1 => fs::remove_file(folder.0.join(PIN)).unwrap(),
        2 => fs::copy(folder::root().join("docs/src/recipes/build_script").join(PIN), folder.0.join(PIN))
            .map(drop)
            .unwrap(),
        _ => {}
    });
    let starts = ["round 1: no faults in", "round 2: 1 error", "round 3: ", "round 4: no faults in"];
    assert_eq!(rounds.len(), 4, "{rounds:?}");
    assert!(rounds.iter().zip(starts).all(|(line, start)| line.starts_with(start)), "{rounds:?}");
    assert!(rounds.iter().all(|line| line.ends_with("; watching 2 files")), "{rounds:?}");
    assert_eq!(code, Some(0));
}

#[test]
fn compile_writes_anew_and_ends_with_its_input() {
    let folder = Folder::with_specs("watch_compile");
    let args = [&VIEW[..4], &["--watch", "--rounds", "2"]].concat();
    let mut before = String::new();
    let (rounds, code) = watch(&folder, &args, |round, _| {
        if round == 0 {
            before = folder.read("plate.view.ron");
            folder.edit(SPEC, "elevation = 65", "elevation = 70");
        }
    });
    assert_eq!((rounds.len(), code), (2, Some(0)), "{rounds:?}");
    assert_ne!(folder.read("plate.view.ron"), before);
    // Standard input is at its end here.
    let run = folder.gonogo(&[&VIEW[..4], &["--watch"]].concat());
    run.expect(0, &["round 1: no faults"]);
    assert!(!run.err.contains("round 2"));
    folder.gonogo(&["check", "-", "--watch"]).expect(2, &["cannot be watched"]);
    folder.gonogo(&["check", "none.gng", "--watch", "--rounds", "1"]).expect(2, &["cannot read", "watching 1 file"]);
}

// --- Timings, shells, manual pages -----------------------------------------------------------------------------------

#[test]
fn timings_name_every_stage_that_ran() {
    let folder = Folder::with_specs("timings");
    folder.gonogo(&["check", SPEC, "--timings"]).expect(0, &["specs/plate.gng:", "design ", "view ", "total "]);
    let run = folder.gonogo(&["check", SPEC, "--timings", "--message-format", "json"]);
    let value: serde_json::Value = serde_json::from_str(run.out.lines().last().unwrap()).unwrap();
    let stages: Vec<&str> =
        value["timings"]["stages"].as_array().unwrap().iter().map(|s| s["stage"].as_str().unwrap()).collect();
    assert_eq!(stages, ["design", "solid", "assembly", "view"]);
}

#[test]
fn completions_are_scripts_that_their_shells_read() {
    let folder = Folder::empty("completions");
    for (shell, args) in [("bash", &["-n"][..]), ("zsh", &["-n"]), ("fish", &["-n"])] {
        let run = folder.gonogo(&["completions", shell]);
        run.expect(0, &["compile", "deps-format", "no-cache"]);
        folder.write("script", &run.out);
        if installed(shell) {
            folder::Run::of(folder.command(shell, &[args, &["script"]].concat()).output().unwrap()).expect(0, &[]);
        }
    }
    if installed("bash") {
        folder.write("script", &folder.gonogo(&["completions", "bash"]).out);
        let asks =
            "source ./script; COMP_WORDS=(gonogo comp); COMP_CWORD=1; _gonogo gonogo comp gonogo; echo ${COMPREPLY[@]}";
        folder::Run::of(folder.command("bash", &["-c", asks]).output().unwrap()).expect(0, &["compile"]);
    }
}

#[test]
fn completions_offer_what_is_documented() {
    let folder = Folder::empty("offered");
    let documented = fs::read_to_string(folder::root().join("docs/src/command_line.md")).unwrap();
    let word = |c: char| c.is_ascii_lowercase() || c == '-';
    for (shell, before) in [("bash", " --"), ("zsh", "'--"), ("fish", "\" -l ")] {
        let script = folder.gonogo(&["completions", shell]).out;
        let offered = script.match_indices(before).map(|(i, _)| &script[i + before.len()..]);
        let names = offered.map(|rest| &rest[..rest.find(|c| !word(c)).unwrap_or(rest.len())]);
        let names: Vec<&str> = names.filter(|name| name.len() > 1).collect();
        assert!(names.contains(&"deps-format"), "{shell}: {names:?}");
        for name in names {
            assert!(documented.contains(&format!("--{name}")), "{shell} offers `--{name}`, which nobody knows");
        }
    }
}

#[test]
fn the_library_can_be_looked_through() {
    let folder = Folder::empty("shelf");
    folder.gonogo(&["std", "list"]).expect(
        0,
        &[
            "std/iso4762: Socket head cap screws after ISO 4762:2004, in the lengths of ISO 888\n  iso4762(d, l)\n    d = M1.6 M2 ",
            "std/materials: Surfaces of standard parts\n  material std_steel\n",
        ],
    );
    let run = folder.gonogo(&["std", "list", "--message-format", "json"]);
    let shelves: Vec<serde_json::Value> = run.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(shelves.len(), gonogo::design::library::files().count());
    for shelf in &shelves {
        assert!(!shelf["title"].as_str().unwrap().is_empty(), "{shelf}");
        for family in shelf["families"].as_array().unwrap() {
            for parameter in family["parameters"].as_array().unwrap() {
                assert!(!parameter["sizes"].as_array().unwrap().is_empty(), "{family}");
            }
        }
    }
    let text = gonogo::design::library::text("std/iso4762").unwrap();
    for name in ["iso4762", "std/iso4762"] {
        assert_eq!(folder.gonogo(&["std", "show", name]).expect(0, &[]).out, text);
    }
    folder.gonogo(&["std", "show", "iso2338_h8"]).expect(0, &["part iso2338(d, l) {"]);
    folder.gonogo(&["std", "show", "iso4763"]).expect(2, &["no `iso4763`", "did you mean `std/iso4762`?"]);
}

#[test]
fn there_is_a_manual_page_for_every_command() {
    let folder = Folder::empty("man");
    folder.gonogo(&["man", "pages"]).expect(0, &[]);
    let mut names: Vec<String> =
        fs::read_dir(folder.0.join("pages")).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    let help = folder.gonogo(&["--help"]).out;
    let commands = help.split("Commands:").nth(1).unwrap().split("Options:").next().unwrap();
    // Lines indented further go on with what a command does.
    let named = commands.lines().filter(|l| l.starts_with("  ") && !l.starts_with("   "));
    for command in named.filter_map(|l| l.split_whitespace().next()).filter(|c| *c != "help") {
        assert!(names.contains(&format!("gonogo-{command}.1")), "{command}: {names:?}");
    }
    for name in &names {
        let page = folder.read(&format!("pages/{name}"));
        assert!(page.contains(".SH NAME") && page.contains(".SH SYNOPSIS"), "{name}");
        if installed("groff") {
            let path = format!("pages/{name}");
            let run = folder::Run::of(
                folder.command("groff", &["-Kutf8", "-man", "-Tutf8", "-wall", "-z", &path]).output().unwrap(),
            );
            assert!(run.code == 0 && run.err.is_empty(), "{name}: {}", run.err);
        }
    }
}
