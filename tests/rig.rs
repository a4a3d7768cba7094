//! Two cameras and one verdict: `specs/two_views.gng`, really compiled, judging rendered photos.
//!
//! From above no pin shows that it stands too high, and from the side the wall hides the second pin, `pin[1]`.

#![cfg(feature = "cli")]

use folder::Folder;
use gonogo::artifacts::Artifact;
use gonogo::runtime::calibrate::Calibration;
use gonogo::runtime::inspect::Decision;
use gonogo::runtime::joint::{self, RigInspector};
use gonogo::runtime::model::Model;
use gonogo::runtime::photo::Photo;
use gonogo::runtime::rig::{Rig, RigCalibration};
use gonogo::{Compiled, Options, compile};
use std::fs;
use std::sync::LazyLock;

mod folder;

const SPEC: &str = "specs/two_views.gng";
/// Hidden from the side by the wall, and seen by both.
const HIDDEN: &str = "pin[1]";
const OPEN: &str = "pin[2]";

static COMPILED: LazyLock<Compiled> = LazyLock::new(|| {
    let read = |path: &str| fs::read_to_string(folder::root().join(path));
    let wanted = [Artifact::Model, Artifact::Images, Artifact::View].into();
    compile(SPEC, &read, &Options { wanted, ..Options::default() }, &|_| ())
});

fn rig() -> &'static Rig {
    COMPILED.rig.as_ref().unwrap_or_else(|| panic!("{:#?}", COMPILED.diagnostics))
}

/// Bytes of a rendered photo whose name ends so.
fn png(camera: &str, shows: &str) -> &'static [u8] {
    let (start, end) = (format!("images/{camera}/"), format!("{shows}.png"));
    let found = COMPILED.artifacts.iter().find(|(name, _)| name.starts_with(&start) && name.ends_with(&end));
    found.unwrap_or_else(|| panic!("no {start}{end} in {:?}", COMPILED.artifacts.keys())).1
}

fn photo(camera: &str, shows: &str) -> Photo {
    let model = &rig().cameras[rig().names().iter().position(|name| *name == camera).unwrap()];
    Photo::decode(png(camera, shows), model.station.tone, model.station.camera.size).unwrap()
}

fn assembly(shows: &str) -> Vec<Photo> {
    vec![photo("top", shows), photo("side", shows)]
}

static CALIBRATION: LazyLock<RigCalibration> =
    LazyLock::new(|| joint::calibrate(rig(), &[assembly("good")]).unwrap_or_else(|e| panic!("{e}")));

fn inspector() -> RigInspector<'static> {
    RigInspector::new(rig(), &CALIBRATION).unwrap()
}

fn knows(camera: usize, component: &str, fault: &str) -> bool {
    let node = rig().cameras[camera].nodes.iter().find(|n| n.name == component);
    node.is_some_and(|n| n.hypotheses.iter().any(|h| h.fault == fault))
}

/// How surely a camera tells, in the joint verdict.
fn power(camera: u32, component: &str, fault: &str) -> f64 {
    let of = rig().components.iter().find(|c| c.name == component);
    let mode = of.and_then(|c| c.modes.iter().find(|m| m.fault == fault));
    mode.map_or(0.0, |m| m.seen.iter().filter(|s| s.camera == camera).map(|s| s.power).sum())
}

#[test]
fn each_camera_knows_what_it_sees() {
    assert_eq!(rig().names(), ["top", "side"]);
    assert!(knows(1, OPEN, "not seated") && power(0, OPEN, "not seated") < power(1, OPEN, "not seated") / 4.0);
    assert!(knows(0, HIDDEN, "missing") && !knows(1, HIDDEN, "missing"));
    assert_eq!(rig().components.len(), 2);
    for component in &rig().components {
        for mode in &component.modes {
            let by: Vec<u32> = mode.seen.iter().map(|s| s.camera).collect();
            assert!((0..2).all(|c| knows(c, &component.name, &mode.fault) || !by.contains(&(c as u32))), "{mode:?}");
        }
    }
}

/// A fault is invisible only where no camera shows it.
#[test]
fn warnings_are_about_the_cameras_together() {
    let doubts = COMPILED.diagnostics.iter().filter(|d| ["W0602", "W0703"].contains(&d.code));
    let said: Vec<&str> = doubts.map(|d| d.message.as_str()).collect();
    // Of the other pin some slight ones may pass at this resolution.
    assert!(said.contains(&"station `line` can hardly tell when `pin[1]` is not seated"), "{said:?}");
    assert!(said.iter().all(|m| m.ends_with("not seated")), "{said:?}");
    assert!(!COMPILED.diagnostics.iter().any(|d| d.code == "E0601"), "the wall hides a pin from one camera only");
}

#[test]
fn the_promise_is_of_the_joint_verdict() {
    let promise = &rig().promise;
    // Six customers with six goods each beside that for calibration, and two of every fault that any camera shows.
    assert_eq!(promise.false_reject.trials, 36);
    assert!(promise.modes.iter().all(|m| m.escape.trials == 12), "{promise:?}");
    let escaped = |component: &str, fault: &str| {
        let of = promise.modes.iter().find(|m| m.component == component && m.fault == fault);
        of.map(|m| m.escape.events)
    };
    assert_eq!(escaped(HIDDEN, "missing"), Some(0), "{promise:?}");
    assert_eq!(escaped(OPEN, "missing"), Some(0), "{promise:?}");
    // Nearly half of the pins stand less than 1.4 mm too high, few px at this resolution.
    assert!(escaped(OPEN, "not seated").is_some_and(|e| e <= 6), "{promise:?}");
    assert!(escaped(HIDDEN, "not seated") > escaped(OPEN, "not seated"), "{promise:?}");
    assert!(promise.false_reject.events <= 2, "{promise:?}");
}

#[test]
fn a_fault_that_one_camera_sees_is_named() {
    let inspector = inspector();
    let judge = |shows: &str| inspector.inspect(&assembly(shows).into_iter().map(Ok).collect::<Vec<_>>());
    let good = judge("good");
    assert_eq!((good.joint.decision, good.joint.reason.as_str()), (Decision::Go, ""));
    let raised = judge(&format!("{OPEN} not seated"));
    assert_eq!(raised.joint.decision, Decision::NoGo, "{}", raised.joint.reason);
    assert_eq!(raised.joint.reason, format!("{OPEN}: not seated"));
    assert_eq!(raised.seen_by, ["side"]);
    let [x0, y0, x1, y1] = raised.joint.findings[0].box_px;
    assert!(0.0 <= x0 && x0 < x1 && x1 <= 96.0 && 0.0 <= y0 && y0 < y1 && y1 <= 72.0);
    // The overlay of the camera that does not see it has no cross.
    let crossed = |view: usize| raised.views[view].nodes.iter().filter(|n| n.faulty).count();
    assert_eq!((crossed(0), crossed(1)), (0, 1));
    let gone = judge(&format!("{HIDDEN} missing"));
    assert_eq!(gone.joint.reason, format!("{HIDDEN}: missing"));
    assert_eq!(gone.seen_by, ["top"]);
    assert_eq!(judge(&format!("{OPEN} missing")).joint.reason, format!("{OPEN}: missing"));
}

/// Without one photo nothing passes; a fault that the other shows stands.
#[test]
fn trouble_with_one_photo_never_looks_like_go() {
    let inspector = inspector();
    let lost = || Err("cut short".to_string());
    let verdict = inspector.inspect(&[lost(), Ok(photo("side", "good"))]);
    assert_eq!(verdict.joint.decision, Decision::CannotInspect);
    assert_eq!(verdict.joint.reason, "camera top: cut short");
    assert_eq!(inspector.inspect(&[]).joint.decision, Decision::CannotInspect);
    let verdict = inspector.inspect(&[lost(), Ok(photo("side", &format!("{OPEN} not seated")))]);
    assert_eq!(verdict.joint.reason, format!("{OPEN}: not seated"));
}

/// A pin outside one photo is judged by the other camera where that can tell, and not guessed at where it cannot.
#[test]
fn a_component_outside_one_photo_is_left_to_the_others() {
    let mut cut = rig().clone();
    let far = |model: &mut Model, name: &str| {
        let node = model.nodes.iter_mut().find(|n| n.name == name).unwrap();
        // The window lies beside every photo; its images are the same.
        node.origin[0] += 4096;
    };
    far(&mut cut.cameras[0], OPEN);
    let calibration = RigCalibration {
        rig: cut.digest(),
        cameras: CALIBRATION.cameras.iter().map(|c| Calibration { references: Vec::new(), ..c.clone() }).collect(),
        ..CALIBRATION.clone()
    };
    let judge = |shows: &str| {
        let inspector = RigInspector::new(&cut, &calibration).unwrap();
        inspector.inspect(&assembly(shows).into_iter().map(Ok).collect::<Vec<_>>()).joint
    };
    let good = judge("good");
    assert!(good.decision == Decision::Go, "{}", good.reason);
    assert_eq!(judge(&format!("{OPEN} missing")).decision, Decision::NoGo);
    far(&mut cut.cameras[1], OPEN);
    let inspector = RigInspector::new(&cut, &calibration).unwrap();
    let good = inspector.inspect(&assembly("good").into_iter().map(Ok).collect::<Vec<_>>()).joint;
    assert_eq!(good.decision, Decision::CannotInspect);
    assert!(good.reason.contains(OPEN) && good.reason.contains("inside the photo"), "{}", good.reason);
}

#[test]
fn a_photo_with_a_fault_does_not_calibrate() {
    let refused = joint::calibrate(rig(), &[assembly(&format!("{OPEN} not seated"))]).unwrap_err().to_string();
    assert!(refused.starts_with("E0808: ") && refused.contains(OPEN), "{refused}");
    let refused = joint::calibrate(rig(), &[]).unwrap_err().to_string();
    assert!(refused.starts_with("E0806: camera top: "), "{refused}");
}

#[test]
fn files_are_read_as_written_and_not_taken_for_one_another() {
    let text = rig().write();
    assert_eq!(&Rig::read(&text).unwrap(), rig());
    assert_eq!(Rig::read(&text).unwrap().write(), text);
    let alone = rig().cameras[0].write();
    assert!(Model::read(&text).unwrap_err().to_string().contains("several cameras"));
    assert!(Rig::read(&alone).unwrap_err().to_string().contains("one camera"));
    assert_eq!(Model::read(&alone).unwrap(), rig().cameras[0]);
    let calibration = CALIBRATION.write();
    assert_eq!(&RigCalibration::read(&calibration, rig()).unwrap(), &*CALIBRATION);
    let other = Rig { seed: 8, ..rig().clone() };
    assert!(RigCalibration::read(&calibration, &other).unwrap_err().to_string().contains("another model"));
    assert!(
        RigCalibration::read(&CALIBRATION.cameras[0].write(), rig()).unwrap_err().to_string().contains("one camera")
    );
}

#[test]
fn what_does_not_fit_together_is_refused() {
    type Break = fn(&mut Rig);
    let breaks: [(&str, Break); 9] = [
        ("a camera that is not there", |rig| rig.components[0].modes[0].seen[0].camera = 7),
        ("a mode nobody knows", |rig| rig.components[0].modes[0].fault = "stolen".into()),
        ("a component nobody knows", |rig| rig.components[0].name = "ghost".into()),
        ("a weight that is no number", |rig| rig.components[0].modes[0].seen[0].weight = f64::NAN),
        ("a negative weight", |rig| rig.components[0].modes[0].seen[0].weight = -1.0),
        ("a threshold that is no number", |rig| rig.components[0].modes[0].threshold = f64::NAN),
        ("two cameras of one name", |rig| rig.cameras[1] = rig.cameras[0].clone()),
        ("a camera of another rig", |rig| rig.cameras[1].station.name = "bench.side".into()),
        ("no camera", |rig| rig.cameras.clear()),
    ];
    for (what, harm) in breaks {
        let mut broken = rig().clone();
        harm(&mut broken);
        let refused = Rig::read(&broken.write()).err().map(|e| e.to_string());
        assert!(refused.is_some_and(|e| e.starts_with("E0803: ")), "{what}");
    }
    let text = rig().write();
    let refused = |text: &str| Rig::read(text).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(refused(&text.replacen("two_views", "two_lies!", 1)).starts_with("E0802: "));
    assert!(refused(&text[..text.len() / 2]).starts_with("E0802: "));
    assert!(refused(&text.replacen("format: 7", "format: 8", 1)).starts_with("E0801: "));
}

#[test]
fn emitted_pictures_and_views_are_by_camera() {
    for name in ["top.view.ron", "side.view.ron", "images/top/good.png", "images/side/components.png"] {
        assert!(COMPILED.artifacts.contains_key(name), "no {name} in {:?}", COMPILED.artifacts.keys());
    }
}

/// One camera of the station alone is a model as ever.
#[test]
fn a_camera_may_be_compiled_alone() {
    let read = |path: &str| fs::read_to_string(folder::root().join(path));
    let view = |station: &str| {
        let options = Options { station: Some(station.into()), wanted: [Artifact::View].into(), ..Options::default() };
        compile(SPEC, &read, &options, &|_| ())
    };
    assert!(view("line.top").artifacts.contains_key("top.view.ron"));
    assert!(view("line.side").diagnostics.iter().any(|d| d.code == "E0601"), "alone it does not see every pin");
    let unknown = view("lin").diagnostics.remove(0);
    assert_eq!((unknown.code, unknown.help.as_deref()), ("E0201", Some("did you mean `--station line`?")));
}

#[test]
fn the_command_line_takes_photos_by_camera() {
    let here = Folder::empty("rig");
    fs::create_dir_all(here.0.join("photos/top")).unwrap();
    fs::create_dir_all(here.0.join("photos/side")).unwrap();
    here.write("line.model.ron", &rig().write());
    let raised = format!("{OPEN} not seated");
    for (name, shows) in [("a", "good"), ("b", raised.as_str())] {
        for camera in ["top", "side"] {
            fs::write(here.0.join(format!("photos/{camera}/{name}.png")), png(camera, shows)).unwrap();
        }
    }
    let [top, side] = ["top=photos/top/a.png", "side=photos/side/a.png"];
    let out = ["-o", "line.calibration.ron"];
    here.gonogo(&[&["calibrate", "line.model.ron", side, top][..], &out].concat()).expect(0, &[]);
    let inspect = |photos: &[&str]| {
        let with = ["inspect", "line.model.ron", "--calibration", "line.calibration.ron"];
        here.gonogo(&[&with[..], photos].concat())
    };
    inspect(&[top, side]).expect(0, &["go              photos/top/a.png + photos/side/a.png"]);
    let folders = inspect(&["photos", "--format", "json", "--overlay", "seen"]);
    folders.expect(1, &[]);
    let lines: Vec<serde_json::Value> = folders.out.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 2);
    assert_eq!((&lines[0]["verdict"], &lines[1]["verdict"]), (&"go".into(), &"no-go".into()));
    assert_eq!(lines[1]["photo"], "photos/top/b.png");
    assert_eq!(lines[1]["photos"], serde_json::json!({"top": "photos/top/b.png", "side": "photos/side/b.png"}));
    let finding = &lines[1]["findings"][0];
    assert_eq!((&finding["component"], &finding["fault"]), (&OPEN.into(), &"not seated".into()));
    assert_eq!(finding["camera"], "side");
    for overlay in ["seen/top/a.png", "seen/side/a.png", "seen/top/b.png", "seen/side/b.png"] {
        assert!(here.has(overlay), "{overlay}");
    }
    inspect(&["top=photos/top", "side=photos/side", "--format", "junit"])
        .expect(1, &[r#"<testsuites name="two_views.line" tests="4" failures="1" errors="0""#]);
    inspect(&["top=photos/top/b.png", "side=photos/side/b.png"]).expect(1, &["pin[2]: not seated (p = ", ", side px "]);
    // What is said wrongly is said before anything is judged.
    inspect(&[top])
        .expect(2, &["every assembly needs a photo of each camera, but there are 1 of `top` and 0 of `side`"]);
    inspect(&["top=a.png", "sied=b.png"]).expect(2, &["no camera is named `sied`", "did you mean `side=b.png`?"]);
    inspect(&["photos/top/a.png"]).expect(2, &["say which camera took it", "top=PHOTO side=PHOTO"]);
    inspect(&[top, "side=photos/side"]).expect(2, &["are a folder and a photo"]);
    fs::remove_file(here.0.join("photos/side/a.png")).unwrap();
    inspect(&["photos"]).expect(2, &["`photos/top/a.png` has no partner: there is no photo `a` in `photos/side`"]);
    inspect(&[top, side]).expect(2, &["cannot-inspect", "camera side: cannot read the file"]);
}
