//! The command line as a stranger meets it: what goes in wrong, what comes out, and with which exit code.

#[path = "cli/compiling.rs"]
mod compiling;
#[path = "cli/layout.rs"]
mod layout;
#[path = "cli/models.rs"]
mod models;
#[path = "cli/photos.rs"]
mod photos;
#[path = "cli/specs.rs"]
mod specs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Inputs of runs, counted.
static INPUTS: AtomicU64 = AtomicU64::new(0);

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
        // Tests share folders.
        let name = format!(".input {}", INPUTS.fetch_add(1, Ordering::Relaxed));
        self.file(&name, input);
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        let input = fs::File::open(self.0.join(&name)).unwrap();
        fs::remove_file(self.0.join(&name)).unwrap();
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
