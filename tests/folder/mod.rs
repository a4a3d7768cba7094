//! A folder of one test's own with the small spec of the recipes in it, and runs of programs there.

#![allow(dead_code)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The plate with one pin, which uses `parts/pin.gng`: compiles in a second.
pub const SPEC: &str = "specs/plate.gng";
pub const PIN: &str = "specs/parts/pin.gng";

pub struct Folder(pub PathBuf);

pub struct Run {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Run {
    pub fn of(output: Output) -> Run {
        Run {
            code: output.status.code().expect("no signal"),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }

    #[track_caller]
    pub fn expect(&self, code: i32, said: &[&str]) -> &Run {
        assert_eq!(self.code, code, "out: {}\nerr: {}", self.out, self.err);
        let all = format!("{}{}", self.out, self.err);
        for part in said {
            assert!(all.contains(part), "`{part}` is not in:\n{all}");
        }
        self
    }
}

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

impl Folder {
    /// An empty folder.
    pub fn empty(name: &str) -> Folder {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    /// With the small spec and the part it uses.
    pub fn with_specs(name: &str) -> Folder {
        let folder = Folder::empty(name);
        fs::create_dir_all(folder.0.join("specs/parts")).unwrap();
        for file in [SPEC, PIN] {
            folder.write(file, &fs::read_to_string(root().join("docs/src/recipes/build_script").join(file)).unwrap());
        }
        folder
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.0.join(name), text).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    pub fn has(&self, name: &str) -> bool {
        self.0.join(name).exists()
    }

    /// Replaces the first occurrence of `from`, which must be there.
    #[track_caller]
    pub fn edit(&self, name: &str, from: &str, to: &str) {
        let text = self.read(name);
        assert!(text.contains(from), "{name} has no `{from}`");
        self.write(name, &text.replacen(from, to, 1));
    }

    /// gonogo in this folder, with a cache of the folder's own.
    pub fn gonogo(&self, args: &[&str]) -> Run {
        Run::of(self.command(env!("CARGO_BIN_EXE_gonogo"), args).output().unwrap())
    }

    /// Any program in this folder that finds our gonogo on its path.
    pub fn command(&self, program: &str, args: &[&str]) -> Command {
        let bin = Path::new(env!("CARGO_BIN_EXE_gonogo")).parent().unwrap().to_path_buf();
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths([bin].into_iter().chain(std::env::split_paths(&path))).unwrap();
        let mut command = Command::new(program);
        command.args(args).current_dir(&self.0).stdin(Stdio::null()).env("PATH", path);
        command.env("GONOGO_CACHE_DIR", self.0.join(".cache")).env_remove("CI");
        command
    }
}

/// Whether a program is installed here; tests of it are skipped where it is not.
pub fn installed(program: &str) -> bool {
    let found = Command::new(program).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let found = found.is_ok_and(|status| status.success());
    if !found {
        eprintln!("skipped: {program} is not installed");
    }
    found
}
