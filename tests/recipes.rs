//! The recipes in `docs/src/recipes`, each run by its own tool where that is installed: the first run makes a model, the second
//! does nothing, and a change of a used file makes it anew.

#![cfg(feature = "cli")]

mod folder;

use folder::{Folder, PIN, Run, SPEC, installed, root};
use std::fs;
use std::time::{Duration, SystemTime};

fn with_recipe(name: &str, recipe: &str, file: &str) -> Folder {
    let folder = Folder::with_specs(name);
    fs::copy(root().join("docs/src/recipes").join(recipe).join(file), folder.0.join(file)).unwrap();
    folder
}

fn run(folder: &Folder, program: &str, args: &[&str]) -> Run {
    Run::of(folder.command(program, args).output().unwrap())
}

/// Blesses the outputs, then checks that `test` sees a difference and only a difference.
fn golden(folder: &Folder, program: &str, test: &[&str]) {
    folder.gonogo(&["golden", "bless", SPEC]).expect(0, &[]);
    run(folder, program, test).expect(0, &[]);
    folder.edit(PIN, "h = 10 ±0.05", "h = 9 ±0.05");
    assert_ne!(run(folder, program, test).code, 0);
    folder.edit(PIN, "h = 9 ±0.05", "h = 10 ±0.05");
}

/// Runs `build` three times: from nothing, without a change, and after a change of a used file.
fn builds(folder: &Folder, model: &str, build: impl Fn() -> Run) {
    build().expect(0, &["predicted escapes"]);
    let first = folder.read(model);
    let again = build();
    assert!(!again.expect(0, &[]).out.contains("predicted"), "the second run did something: {}", again.out);
    folder.edit(PIN, "h = 10 ±0.05", "h = 9.8 ±0.05");
    touch(folder, PIN);
    build().expect(0, &["predicted escapes"]);
    assert!(folder.read(model) != first);
    folder.edit(PIN, "h = 9.8 ±0.05", "h = 10 ±0.05");
}

/// Later than anything made so far, however coarse the file system's clock is.
fn touch(folder: &Folder, name: &str) {
    let file = fs::File::options().append(true).open(folder.0.join(name)).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_secs(2)).unwrap();
}

#[test]
fn make() {
    if !installed("make") {
        return;
    }
    let folder = with_recipe("recipe_make", "make", "Makefile");
    builds(&folder, "build/plate.model.ron", || run(&folder, "make", &[]));
    golden(&folder, "make", &["test"]);
    // A file that is used no more may go.
    folder.edit(
        SPEC,
        "use \"parts/pin.gng\"",
        &folder.read(PIN).replace("gonogo 1\n\nunits mm deg\ntolerances exact\n", ""),
    );
    fs::remove_file(folder.0.join(PIN)).unwrap();
    touch(&folder, SPEC);
    run(&folder, "make", &[]).expect(0, &[]);
}

#[test]
fn ninja() {
    if !installed("ninja") {
        return;
    }
    let folder = with_recipe("recipe_ninja", "ninja", "build.ninja");
    builds(&folder, "build/plate.model.ron", || run(&folder, "ninja", &["-v"]));
    golden(&folder, "ninja", &["test"]);
}

#[test]
fn cmake() {
    if !installed("cmake") {
        return;
    }
    for (generator, tool) in [("Unix Makefiles", "make"), ("Ninja", "ninja")] {
        if !installed(tool) {
            continue;
        }
        let folder = with_recipe(&format!("recipe_cmake_{tool}"), "cmake", "CMakeLists.txt");
        run(&folder, "cmake", &["-G", generator, "-B", "build"]).expect(0, &[]);
        builds(&folder, "build/plate.model.ron", || run(&folder, "cmake", &["--build", "build"]));
        golden(&folder, "ctest", &["--test-dir", "build"]);
    }
}

/// Not GitHub, but its shell: every line of the workflow that speaks to gonogo is run as written.
#[test]
fn the_github_workflow_says_what_gonogo_understands() {
    let folder = with_recipe("recipe_github", "github", "gonogo.yml");
    let text = folder.read("gonogo.yml");
    let lines: Vec<&str> = text.lines().filter_map(|l| l.trim().strip_prefix("run: ")).collect();
    let ours: Vec<&str> =
        lines.into_iter().filter(|l| l.contains("gonogo ")).filter(|l| !l.starts_with("cargo")).collect();
    assert_eq!(ours.len(), 4, "{ours:?}");
    folder.gonogo(&["golden", "bless", SPEC]).expect(0, &[]);
    for line in ours {
        run(&folder, "bash", &["-e", "-o", "pipefail", "-c", line]).expect(0, &[]);
    }
    assert!(folder.has("models/plate.model.ron"));
    if run(&folder, "python3", &["-c", "import yaml"]).code == 0 {
        let keys = "import yaml; w = yaml.safe_load(open('gonogo.yml')); print(*w['jobs']['specs']['steps'][3].keys())";
        run(&folder, "python3", &["-c", keys]).expect(0, &["name run"]);
    }
}

#[test]
fn pre_commit() {
    let hooks = fs::read_to_string(root().join(".pre-commit-hooks.yaml")).unwrap();
    let config = fs::read_to_string(root().join("docs/src/recipes/pre-commit/.pre-commit-config.yaml")).unwrap();
    let ids = |text: &str| -> Vec<String> {
        text.lines().filter_map(|l| l.trim().strip_prefix("- id: ")).map(String::from).collect()
    };
    assert_eq!(ids(&hooks), ["gonogo-fmt", "gonogo-check"]);
    assert_eq!(ids(&config), ids(&hooks));
    if !installed("pre-commit") || !installed("git") {
        return;
    }
    // A repository of hooks, and one of specs that uses it.
    let folder = Folder::with_specs("recipe_pre_commit");
    let git = |at: &str, args: &[&str]| {
        let who = ["-C", at, "-c", "user.name=a", "-c", "user.email=a@b.c", "-c", "init.defaultBranch=main"];
        run(&folder, "git", &[&who[..], args].concat()).expect(0, &[]);
    };
    fs::create_dir(folder.0.join("hooks")).unwrap();
    folder.write("hooks/.pre-commit-hooks.yaml", &hooks);
    git("hooks", &["init", "-q"]);
    git("hooks", &["add", "."]);
    git("hooks", &["commit", "-q", "-m", "hooks"]);
    git(".", &["init", "-q"]);
    git(".", &["add", "specs"]);
    git(".", &["commit", "-q", "-m", "specs"]);
    let hook = |id: &str| {
        let mut command = folder.command("pre-commit", &["try-repo", "hooks", id, "--all-files"]);
        Run::of(command.env("PRE_COMMIT_HOME", folder.0.join("home")).output().unwrap())
    };
    hook("gonogo-fmt").expect(0, &["gonogo fmt", "Passed"]);
    hook("gonogo-check").expect(0, &["gonogo check", "Passed"]);
    folder.edit(SPEC, "material = paint", "material =  paint");
    git(".", &["add", "specs"]);
    hook("gonogo-fmt").expect(1, &["Failed"]);
    folder.edit(SPEC, "material = paint", "material = point");
    git(".", &["add", "specs"]);
    hook("gonogo-check").expect(1, &["Failed", "E0201"]);
}
