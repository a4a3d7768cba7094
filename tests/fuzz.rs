//! Thousands of damaged models, calibrations, photos, specs, foreign designs and messages of editors: an error each, never a
//! panic, and no flood of memory.
//!
//! The damage is drawn from a seed, so every run is the same. `GONOGO_FUZZ_SECONDS=600 cargo test --release --test fuzz` goes on
//! with further seeds; what breaks is kept in `target/tmp/fuzz`. `fuzz/` has the same targets for libFuzzer.

#[path = "fuzz/targets.rs"]
mod targets;

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// No single damaged input may take longer (optimised, on one core).
const LONGEST: Duration = Duration::from_secs(10);
/// Nor all together more memory.
const MOST_MEMORY_KB: u64 = 2 << 20;

/// SplitMix64 (Steele, Lea and Flood 2014).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn one<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }
}

/// Numbers and words that have broken programs before, in the languages of models and specs.
const NASTY: &[&str] = &[
    "0",
    "-1",
    "1",
    "2",
    "3",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "1e308",
    "-1e308",
    "1e-308",
    "NaN",
    "inf",
    "-inf",
    "0.0",
    "-0.0",
    "1e9",
    "0.000001",
    "65535",
    "65536",
    "",
    "()",
    "[]",
    "{",
    "}",
    "(",
    ")",
    "\"",
    "360 deg",
    "through",
    "±",
    "free",
    "1e9 mm",
    "(1/0)",
    "H7",
    "±1e9",
    "999999x",
    "basic",
    "auto",
];

/// A few changes to a file of bytes.
fn bytes_damaged(original: &[u8], draw: &mut Draw) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for _ in 0..=draw.below(6) {
        let at = draw.below(bytes.len());
        let end = (at + draw.below(24)).min(bytes.len());
        match draw.below(8) {
            _ if bytes.is_empty() => break,
            0 => bytes[at] ^= 1 << draw.below(8),
            1 => bytes[at] = draw.next() as u8,
            2 => bytes[at] = [0, 0xff, 0x7f, 0x80][draw.below(4)],
            3 => bytes.truncate(at),
            4 => drop(bytes.drain(at..end)),
            5 => {
                let piece = bytes[at..end].to_vec();
                let to = draw.below(bytes.len());
                bytes.splice(to..to, piece);
            }
            6 => bytes[at..end].fill(draw.next() as u8),
            // Mostly headers.
            _ => {
                let at = draw.below(bytes.len().min(64));
                bytes[at] = draw.next() as u8;
            }
        }
    }
    if draw.below(2) == 0 {
        mend_png(&mut bytes);
    }
    bytes
}

/// Gives the chunks of a damaged PNG checksums that fit, so that the damage is seen.
fn mend_png(bytes: &mut [u8]) {
    let mut at = 8;
    while bytes.starts_with(b"\x89PNG") && at + 12 <= bytes.len() {
        let size = u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
        let Some(end) = at.checked_add(8).and_then(|e| e.checked_add(size)).filter(|e| e + 4 <= bytes.len()) else {
            return;
        };
        let mut crc = u32::MAX;
        for byte in &bytes[at + 4..end] {
            crc = (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xedb8_8320 } else { c >> 1 });
        }
        bytes[end..end + 4].copy_from_slice(&(!crc).to_be_bytes());
        at = end + 4;
    }
}

/// A few changes to a text, most of them in its own words.
fn text_damaged(original: &str, others: &[&str], draw: &mut Draw) -> String {
    let mut words = words(original);
    for _ in 0..=draw.below(4) {
        let at = draw.below(words.len());
        match draw.below(8) {
            _ if words.is_empty() => break,
            0..=2 => {
                // A number becomes another one.
                let numbers: Vec<usize> =
                    (0..words.len()).filter(|&i| words[i].starts_with(|c: char| c.is_ascii_digit())).collect();
                if !numbers.is_empty() {
                    words[numbers[draw.below(numbers.len())]] = draw.one(NASTY);
                }
            }
            3 => words[at] = draw.one(NASTY),
            4 => drop(words.remove(at)),
            5 => {
                let to = draw.below(words.len());
                words.swap(at, to);
            }
            6 => {
                let end = (at + draw.below(30)).min(words.len());
                let piece = words[at..end].to_vec();
                if draw.below(2) == 0 {
                    let to = draw.below(words.len());
                    words.splice(to..to, piece);
                } else {
                    words.drain(at..end);
                }
            }
            _ => {
                let other = draw.one(others);
                let lines: Vec<&str> = other.split_inclusive('\n').collect();
                words.insert(at, lines[draw.below(lines.len())]);
            }
        }
    }
    words.concat()
}

/// Names and numbers in one piece each, everything else by the character.
fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let in_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let end = if in_word(first) { rest.find(|c| !in_word(c)).unwrap_or(rest.len()) } else { first.len_utf8() };
        let (word, after) = rest.split_at(end);
        words.push(word);
        rest = after;
    }
    words
}

/// Feeds a target `rounds` damaged inputs, or as many as there is time for, and reports those that broke it.
fn fuzz(name: &str, rounds: u64, target: fn(&[u8]), damaged: impl Fn(&mut Draw) -> Vec<u8>) {
    let seconds = std::env::var("GONOGO_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).map(Duration::from_secs);
    let (start, folder) = (Instant::now(), Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz"));
    fs::create_dir_all(&folder).unwrap();
    let current = folder.join(format!("{name}.current"));
    let (mut seed, mut broken) = (0, Vec::new());
    while seed < rounds || seconds.is_some_and(|s| start.elapsed() < s) {
        let input = damaged(&mut Draw(seed));
        if seconds.is_some() {
            // What ends the whole process leaves this behind.
            fs::write(&current, &input).unwrap();
        }
        let begun = spent(start);
        let sound = catch_unwind(|| target(&input)).is_ok();
        let took = spent(start).saturating_sub(begun);
        if !sound || took > LONGEST {
            let kept: PathBuf = folder.join(format!("{name}-{seed}"));
            fs::write(&kept, &input).unwrap();
            broken.push(format!("{} ({})", kept.display(), if sound { format!("{took:?}") } else { "panic".into() }));
        }
        seed += 1;
    }
    let _ = fs::remove_file(current);
    println!("{name}: {seed} inputs in {:.1?}, {} broke it", start.elapsed(), broken.len());
    assert!(broken.is_empty(), "{broken:#?}");
    let memory = peak_memory_kb();
    assert!(memory < MOST_MEMORY_KB, "{memory} kB");
}

/// Time this thread has computed, so that a busy machine makes no input slow; time on the clock where the system does not tell.
fn spent(start: Instant) -> Duration {
    let told = fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|t| t.split(' ').next().and_then(|n| n.parse().ok()));
    nanoseconds.map_or_else(|| start.elapsed(), Duration::from_nanos)
}

/// What a fuzzer begins with, for those who ask: see `fuzz/README.md`.
fn seeds(name: &str, files: &[&[u8]]) {
    let Some(corpus) = std::env::var_os("GONOGO_FUZZ_CORPUS") else { return };
    let folder = Path::new(&corpus).join(name);
    fs::create_dir_all(&folder).unwrap();
    for (i, file) in files.iter().enumerate() {
        fs::write(folder.join(i.to_string()), file).unwrap();
    }
}

/// The most memory this process has had, where the system tells.
fn peak_memory_kb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse().ok()).unwrap_or(0)
}

#[cfg(feature = "compile")]
fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn models() {
    let text = targets::tiny().write();
    let body = targets::unsealed(&text).to_string();
    targets::model(body.as_bytes());
    seeds("model", &[body.as_bytes()]);
    fuzz("model", 3_000, targets::model, |draw| text_damaged(&body, &[&body], draw).into_bytes());
}

#[test]
fn calibrations() {
    let model = targets::tiny();
    let mut calibration = gonogo::runtime::calibrate::Calibration::nominal(&model);
    calibration.poses.push(gonogo::runtime::pose::Pose { x: 0.1, y: 0.2, z: 0.0, rz: 0.3 });
    let text = calibration.write();
    let body = targets::unsealed(&text).to_string();
    targets::calibration(body.as_bytes());
    seeds("calibration", &[body.as_bytes()]);
    fuzz("calibration", 3_000, targets::calibration, |draw| text_damaged(&body, &[&body], draw).into_bytes());
}

#[test]
fn photos() {
    use image::{DynamicImage, ImageFormat};
    let scene = image::GrayImage::from_fn(45, 31, |x, y| image::Luma([(x * 5 + y * 3) as u8]));
    let scene = DynamicImage::from(scene);
    let mut files = Vec::new();
    for (image, formats) in [
        (scene.to_luma8().into(), &[ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff, ImageFormat::Bmp][..]),
        (scene.to_rgb8().into(), &[ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::Tiff, ImageFormat::Bmp]),
        (DynamicImage::from(scene.to_rgba16()), &[ImageFormat::Png, ImageFormat::Tiff]),
        (scene.to_rgb32f().into(), &[ImageFormat::Tiff]),
    ] {
        for format in formats {
            let mut bytes = std::io::Cursor::new(Vec::new());
            image.write_to(&mut bytes, *format).unwrap();
            files.push(bytes.into_inner());
        }
    }
    files.iter().for_each(|file| targets::photo(file));
    let files: Vec<&[u8]> = files.iter().map(Vec::as_slice).collect();
    seeds("photo", &files);
    fuzz("photo", 4_000, targets::photo, |draw| {
        let file = draw.one(&files);
        bytes_damaged(file, draw)
    });
}

#[cfg(feature = "compile")]
fn specs() -> Vec<String> {
    let mut specs = vec![fs::read_to_string(root().join("tests/data/two_pins.gng")).unwrap()];
    for name in ["pinned_plate", "shapes", "four_screws", "pattern_wheel"] {
        specs.push(fs::read_to_string(root().join(format!("specs/{name}.gng"))).unwrap());
    }
    specs
}

#[cfg(feature = "compile")]
#[test]
fn texts_of_specs() {
    let specs = specs();
    let specs: Vec<&str> = specs.iter().map(String::as_str).collect();
    fuzz("syntax", 400, targets::syntax, |draw| {
        let spec = draw.one(&specs);
        text_damaged(spec, &specs, draw).into_bytes()
    });
}

#[cfg(feature = "compile")]
#[test]
fn specs_up_to_the_view() {
    let specs = specs();
    let specs: Vec<&str> = specs.iter().map(String::as_str).collect();
    // The small ones: a check of the pattern wheel takes long.
    fuzz("spec", 40, targets::spec, |draw| {
        let spec = draw.one(&specs[..2]);
        text_damaged(spec, &specs, draw).into_bytes()
    });
}

#[cfg(feature = "compile")]
#[test]
fn designs_of_openscad() {
    let designs = [PLATE, KNOB];
    designs.iter().for_each(|design| targets::import(design.as_bytes()));
    seeds("import", &designs.map(str::as_bytes));
    fuzz("import", 1_500, targets::import, |draw| {
        let design = draw.one(&designs);
        text_damaged(design, &designs, draw).into_bytes()
    });
}

/// As OpenSCAD 2021.01 writes them: a plate with a ring of holes, and a knob turned about its axis.
#[cfg(feature = "compile")]
const PLATE: &str = r"difference() {
	union() {
		cube(size = [40, 20, 5], center = true);
		multmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2.5], [0, 0, 0, 1]]) {
			cylinder($fn = 48, $fa = 12, $fs = 2, h = 10, r1 = 6, r2 = 5, center = false);
		}
		multmatrix([[0.866025, -0.5, 0, 10], [0.5, 0.866025, 0, 3], [0, 0, 1, 0], [0, 0, 0, 1]]) {
			linear_extrude(height = 3, center = false, convexity = 1, scale = [1, 1], $fn = 0, $fa = 12, $fs = 2) {
				polygon(points = [[0, 0], [5, 0], [5, 4], [1, 1]], paths = [[0, 1, 2, 3]], convexity = 1);
			}
		}
	}
	group() {
		multmatrix([[1, 0, 0, -15], [0, 1, 0, -6], [0, 0, 1, -5], [0, 0, 0, 1]]) {
			cylinder($fn = 48, $fa = 12, $fs = 2, h = 20, r1 = 1.5, r2 = 1.5, center = false);
		}
		multmatrix([[1, 0, 0, 15], [0, 1, 0, -6], [0, 0, 1, -5], [0, 0, 0, 1]]) {
			cylinder($fn = 6, $fa = 12, $fs = 2, h = 20, r1 = 1.5, r2 = 1.5, center = false);
		}
	}
	hull() {
		multmatrix([[1, 0, 0, -5], [0, 1, 0, 5], [0, 0, 1, -5], [0, 0, 0, 1]]) {
			cylinder($fn = 48, $fa = 12, $fs = 2, h = 20, r1 = 1, r2 = 1, center = false);
		}
		multmatrix([[1, 0, 0, 5], [0, 1, 0, 5], [0, 0, 1, -5], [0, 0, 0, 1]]) {
			cylinder($fn = 48, $fa = 12, $fs = 2, h = 20, r1 = 1, r2 = 1, center = false);
		}
	}
}
";
#[cfg(feature = "compile")]
const KNOB: &str = r"union() {
	rotate_extrude(angle = 360, convexity = 2, $fn = 64, $fa = 12, $fs = 2) {
		polygon(points = [[0, 0], [9, 0], [9, 4], [6, 7], [0, 7]], paths = undef, convexity = 1);
	}
	intersection() {
		multmatrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 7], [0, 0, 0, 1]]) {
			sphere($fn = 64, $fa = 12, $fs = 2, r = 5);
		}
		%cube(size = 3, center = false);
		multmatrix([[1, 0, 0, -8], [0, 1, 0, -8], [0, 0, 1, 6], [0, 0, 0, 1]]) {
			cube(size = [16, 16, 8], center = false);
		}
	}
	linear_extrude(height = 2, center = true, convexity = 1, $fn = 0, $fa = 12, $fs = 2) {
		offset(r = 1, $fn = 0, $fa = 12, $fs = 2) {
			square(size = [20, 6], center = true);
		}
	}
}
";

#[cfg(feature = "cli")]
#[test]
fn messages_of_editors() {
    let session = session(&specs()[0]);
    targets::messages(session.as_bytes());
    seeds("messages", &[session.as_bytes()]);
    fuzz("messages", 60, targets::messages, |draw| text_damaged(&session, &[&session], draw).into_bytes());
}

/// What an editor sends: a text is opened, everything is asked about it, it is changed and asked about again, and closed.
#[cfg(feature = "cli")]
fn session(spec: &str) -> String {
    use serde_json::json;
    const QUESTIONS: [&str; 13] = [
        "hover",
        "completion",
        "signatureHelp",
        "definition",
        "references",
        "documentHighlight",
        "documentSymbol",
        "codeAction",
        "formatting",
        "prepareRename",
        "rename",
        "inlayHint",
        "semanticTokens/full",
    ];
    let document = json!({ "uri": "file:///w/a.gng", "version": 1 });
    let mut opened = document.clone();
    (opened["languageId"], opened["text"]) = (json!("gonogo"), json!(spec));
    let place = |line: u32, character: u32| json!({ "line": line, "character": character });
    let mut lines = vec![json!(["textDocument/didOpen", { "textDocument": opened }])];
    for round in 0..2 {
        for question in QUESTIONS {
            let at = place(17 + 9 * round, 11);
            let params = json!({
                "textDocument": document, "position": at, "newName": "other",
                "options": { "tabSize": 4, "insertSpaces": true },
                "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1, "isRetrigger": false },
                "range": { "start": at, "end": place(40, 0) },
            });
            lines.push(json!([format!("textDocument/{question}"), params]));
        }
        let range = json!({ "start": place(12, 4), "end": place(14, 6) });
        let changes = json!([{ "range": range, "text": "part p {\n add b = 3x cylinder(" }]);
        lines.push(json!(["textDocument/didChange", { "textDocument": document, "contentChanges": changes }]));
    }
    lines.push(json!(["workspace/executeCommand", { "command": "gonogo.explain", "arguments": ["E0305"] }]));
    lines.push(json!(["workspace/symbol", { "query": "pin" }]));
    lines.push(json!(["textDocument/didSave", { "textDocument": document }]));
    lines.push(json!(["textDocument/didClose", { "textDocument": document }]));
    lines.iter().map(|line| format!("{line}\n")).collect()
}
