//! Where `inspect` takes photos from: folders, standard input, and a folder that is watched.

#![cfg(feature = "cli")]

mod plate;

use plate::{CALIBRATION, MODEL};
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::OnceLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

fn folder() -> &'static PathBuf {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| plate::plate("photos"))
}

/// An empty folder of one test's own, in the plate's.
fn fresh(name: &str) -> PathBuf {
    let fresh = folder().join(name);
    let _ = fs::remove_dir_all(&fresh);
    fs::create_dir(&fresh).unwrap();
    fresh
}

fn photo(name: &str) -> Vec<u8> {
    fs::read(folder().join(name)).unwrap()
}

fn command(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    command.current_dir(folder()).args(["inspect", MODEL, "--calibration", CALIBRATION, "--format", "json"]).args(args);
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Runs with `input` on standard input: exit code, photos with verdicts, and what was said on standard error.
fn judged(args: &[&str], input: &[u8]) -> (i32, Vec<String>, String) {
    let mut child = command(args).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    // A program that stops early closes the pipe.
    let _ = stdin.write_all(input);
    drop(stdin);
    let output = child.wait_with_output().unwrap();
    let out = String::from_utf8(output.stdout).unwrap();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code().expect("no signal"), out.lines().map(short).collect(), err)
}

/// `good.png go`
fn short(line: &str) -> String {
    let line: serde_json::Value = serde_json::from_str(line).unwrap();
    format!("{} {}", line["photo"].as_str().unwrap(), line["verdict"].as_str().unwrap())
}

#[test]
fn a_folder_is_its_photos_in_order() {
    let dir = fresh("folder");
    for (name, from) in [("b.png", "missing.png"), ("a.PNG", "good.png"), (".c.png", "good.png"), ("d.txt", "good.png")]
    {
        fs::write(dir.join(name), photo(from)).unwrap();
    }
    fs::create_dir(dir.join("e.png")).unwrap();
    let (code, lines, _) = judged(&["good.png", "folder"], b"");
    assert_eq!(
        (code, &lines[..]),
        (1, &["good.png go".into(), "folder/a.PNG go".into(), "folder/b.png no-go".into()][..])
    );
}

#[test]
fn a_folder_without_photos_is_a_mistake() {
    fresh("empty");
    let (code, lines, err) = judged(&["empty"], b"");
    assert!(code == 2 && lines.is_empty() && err.contains("no photo in `empty`"), "{code} {lines:?} {err}");
}

#[test]
fn standard_input_may_be_an_image() {
    let (code, lines, _) = judged(&["-"], &photo("missing.png"));
    assert_eq!((code, &lines[..]), (1, &["- no-go".to_string()][..]));
    let (code, lines, _) = judged(&["-"], &photo("cut.png"));
    assert_eq!((code, &lines[..]), (2, &["- cannot-inspect".to_string()][..]));
}

#[test]
fn standard_input_may_be_a_list() {
    let (code, lines, _) = judged(&["-"], b"good.png\r\n\nnowhere.png\nmissing.png");
    let expected = ["good.png go".to_string(), "nowhere.png cannot-inspect".into(), "missing.png no-go".into()];
    assert_eq!((code, &lines[..]), (2, &expected[..]));
    let (code, lines, _) = judged(&["-"], b"");
    assert_eq!((code, lines.len()), (2, 0), "nothing judged is not go");
}

#[test]
fn a_list_is_judged_line_by_line() {
    let mut watching = Watching::start(&["-"]);
    let mut stdin = watching.child.stdin.take().unwrap();
    for (name, verdict) in [("good.png", "go"), ("missing.png", "no-go")] {
        writeln!(stdin, "{name}").unwrap();
        assert_eq!(watching.next(), format!("{name} {verdict}"));
    }
    drop(stdin);
    assert_eq!(watching.end(), Some(1));
}

#[test]
fn formats_other_than_png_are_judged_alike() {
    let dir = fresh("kinds");
    let image = image::open(folder().join("missing.png")).unwrap();
    for kind in ["bmp", "tif", "tiff"] {
        image.save(dir.join(format!("missing.{kind}"))).unwrap();
    }
    let jpeg = fs::File::create(dir.join("missing.jpg")).unwrap();
    image.to_luma8().write_with_encoder(image::codecs::jpeg::JpegEncoder::new_with_quality(jpeg, 95)).unwrap();
    let (code, lines, _) = judged(&["kinds"], b"");
    assert!(code == 1 && lines.len() == 4 && lines.iter().all(|l| l.ends_with("no-go")), "{lines:?}");
}

/// The whole line, whatever the file was called and however long it took.
#[test]
fn the_same_photo_in_every_lossless_format_has_the_same_verdict_to_the_last_digit() {
    let dir = fresh("lossless");
    for from in ["good.png", "missing.png"] {
        let grey = image::DynamicImage::from(image::open(folder().join(from)).unwrap().to_luma8());
        let kinds: [(&str, image::DynamicImage); 3] =
            [("grey", grey.clone()), ("colour", grey.to_rgb8().into()), ("alpha", grey.to_rgba8().into())];
        for (name, image) in &kinds {
            for end in ["png", "bmp", "tif"] {
                image.save(dir.join(format!("{name}.{end}"))).unwrap();
            }
        }
        for end in ["png", "tif"] {
            image::DynamicImage::from(grey.to_luma16()).save(dir.join(format!("deep.{end}"))).unwrap();
        }
        let output = command(&["lossless"]).stdin(Stdio::null()).output().unwrap();
        let bare = |line: &str| {
            let mut line: serde_json::Value = serde_json::from_str(line).unwrap();
            let fields = line.as_object_mut().unwrap();
            fields.remove("photo").unwrap();
            fields.remove("milliseconds").unwrap();
            line
        };
        let lines: Vec<_> = std::str::from_utf8(&output.stdout).unwrap().lines().map(bare).collect();
        assert_eq!(lines.len(), 11);
        assert!(lines.iter().all(|l| *l == lines[0]), "{from}: {lines:#?}");
    }
}

#[test]
fn two_photos_of_one_stem_in_a_list_cannot_share_an_overlay() {
    let dir = fresh("stems");
    fs::write(dir.join("good.png"), photo("good.png")).unwrap();
    let (code, lines, err) = judged(&["-", "--overlay", "stems/over"], b"good.png\nstems/good.png\n");
    assert!(code == 2 && lines.len() == 1 && err.contains("several photos"), "{code} {lines:?} {err}");
}

/// A run that goes on, stopped when it is dropped.
struct Watching {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Watching {
    fn start(args: &[&str]) -> Watching {
        let mut child = command(args).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Watching { child, lines }
    }

    fn watch(dir: &str, more: &[&str]) -> Watching {
        // The first photo is judged when the folder is already watched.
        let mut watching = Watching::start(&[&["good.png", "--watch", dir], more].concat());
        assert_eq!(watching.next(), "good.png go");
        watching
    }

    fn next(&mut self) -> String {
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        short(&line)
    }

    fn end(mut self) -> Option<i32> {
        self.child.wait().unwrap().code()
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Writes a file in pieces, as a camera over a slow line does.
fn write_slowly(path: &Path, bytes: &[u8]) {
    let mut file = fs::File::create(path).unwrap();
    for piece in bytes.chunks(bytes.len().div_ceil(5)) {
        file.write_all(piece).unwrap();
        file.sync_all().unwrap();
        sleep(Duration::from_millis(200));
    }
}

#[test]
fn a_watched_folder_tells_of_each_new_photo_once_it_is_complete() {
    let dir = fresh("watched");
    fs::write(dir.join("old.png"), photo("missing.png")).unwrap();
    let mut watching = Watching::watch("watched", &["--for-count", "4"]);
    write_slowly(&dir.join("slow.png"), &photo("missing.png"));
    assert_eq!(watching.next(), "watched/slow.png no-go");
    // Written elsewhere and moved into place; what is no photo is passed over.
    fs::write(dir.join(".part"), photo("good.png")).unwrap();
    fs::write(dir.join("notes.txt"), "x").unwrap();
    fs::rename(dir.join(".part"), dir.join("moved.png")).unwrap();
    assert_eq!(watching.next(), "watched/moved.png go");
    // A camera that always writes to the same file.
    fs::write(dir.join("slow.png"), photo("good.png")).unwrap();
    assert_eq!(watching.next(), "watched/slow.png go");
    // A file that never becomes whole is told after some patience.
    let begun = Instant::now();
    fs::write(dir.join("half.png"), photo("cut.png")).unwrap();
    assert_eq!(watching.next(), "watched/half.png cannot-inspect");
    assert!(begun.elapsed() > Duration::from_secs(2));
    assert_eq!(watching.end(), Some(2));
}

#[test]
fn a_sentinel_ends_the_watch_after_what_was_there_before_it() {
    let dir = fresh("sentinel");
    let mut watching = Watching::watch("sentinel", &["--until", "sentinel/stop"]);
    for name in ["a.png", "b.png", "c.png"] {
        fs::write(dir.join(name), photo("good.png")).unwrap();
    }
    fs::write(dir.join("stop"), "").unwrap();
    let mut lines = [(); 3].map(|()| watching.next());
    lines.sort();
    assert_eq!(lines, ["sentinel/a.png go", "sentinel/b.png go", "sentinel/c.png go"]);
    assert_eq!(watching.end(), Some(0));
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_watch_and_every_line_is_whole() {
    let dir = fresh("interrupted");
    let mut watching = Watching::watch("interrupted", &[]);
    fs::write(dir.join("a.png"), photo("good.png")).unwrap();
    assert_eq!(watching.next(), "interrupted/a.png go");
    assert!(Command::new("kill").args(["-INT", &watching.child.id().to_string()]).status().unwrap().success());
    let mut rest = String::new();
    watching.lines.read_line(&mut rest).unwrap();
    assert_eq!((rest.as_str(), watching.end()), ("", None), "ended by the signal");
}

#[test]
fn a_folder_to_watch_must_be_there() {
    let (code, lines, err) = judged(&["--watch", "no_such_folder"], b"");
    assert!(code == 2 && lines.is_empty() && err.contains("no_such_folder"), "{err}");
    let (code, _, err) = judged(&["good.png", "--for-count", "3"], b"");
    assert!(code == 2 && err.contains("--watch"), "{err}");
    assert_eq!(judged(&[], b"").0, 2);
}
