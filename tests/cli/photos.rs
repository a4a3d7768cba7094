//! Judging photos: verdicts, formats and overlays; and photos that do not calibrate.

use crate::{Folder, MODEL, Run, plate};
use std::fs;

const CALIBRATION: [&str; 2] = ["--calibration", "plate.calibration.ron"];

fn inspect(photos: &[&str], more: &[&str]) -> Run {
    plate().run(&[&["inspect", MODEL], &CALIBRATION[..], photos, more].concat())
}

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

/// Verdicts are the same whoever listens; only `milliseconds` differ from run to run.
#[test]
fn timings_name_every_part_and_change_no_verdict() {
    let photos = ["good.png", "missing.png", "rubbish.png"];
    let plain = |text: &str| -> Vec<String> {
        text.lines()
            .filter(|l| l.starts_with("{\"photo\""))
            .map(|l| l.split("\"milliseconds\"").next().unwrap().into())
            .collect()
    };
    let quiet = inspect(&photos, &["--format", "json"]);
    let table = inspect(&photos, &["--format", "json", "--timings"]);
    assert_eq!(plain(&table.out), plain(&quiet.out));
    assert!(table.err.contains("2 judged"), "what is no image is not judged: {}", table.err);
    let objects = inspect(&photos, &["--format", "json", "--timings", "--message-format", "json"]);
    assert_eq!(plain(&objects.out), plain(&quiet.out));
    let timings: Vec<serde_json::Value> = objects.out.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let timings: Vec<&serde_json::Value> = timings.iter().filter_map(|l| l.get("timings")).collect();
    assert_eq!(timings.iter().map(|t| t["photo"].as_str().unwrap()).collect::<Vec<_>>(), ["good.png", "missing.png"]);
    for photo in timings {
        let parts = photo["parts"].as_array().unwrap();
        let sum: f64 = parts.iter().map(|p| p["milliseconds"].as_f64().unwrap()).sum();
        assert!((sum - photo["total"].as_f64().unwrap()).abs() < 1e-6);
        for part in parts {
            let name = part["part"].as_str().unwrap();
            assert!(table.err.contains(&format!("\n{name} ")), "{name} is not in\n{}", table.err);
            // A sound plate has nothing to explain, but every other part takes its time.
            assert!(part["milliseconds"].as_f64().unwrap() > 0.0 || name == "explain", "{name}");
        }
    }
}
