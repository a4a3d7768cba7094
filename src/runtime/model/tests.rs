//! Model files come back as they were written, and nothing else is read.

use super::*;

/// A model of one node, small enough to read.
pub(crate) fn tiny() -> Model {
    let images = |fault: &str| Hypothesis {
        fault: fault.into(),
        sweep: String::new(),
        threshold: 0.0,
        images: (0..3).map(|draw| Image { draw, lamp: 0, rows: vec![Row(vec![7, 8, 9, 10]); 4] }).collect(),
    };
    let rate = Rate { events: 0, trials: 10, upper_95: 0.3085 };
    let points = PointSet { fault: "good".into(), coarse: vec![[1, 2, 3, 4, 5, 6]], fine: vec![] };
    Model {
        format: FORMAT,
        writer: "gonogo test".into(),
        assembly: "tiny".into(),
        spec: "0".into(),
        seed: 1,
        station: Station {
            name: "bench".into(),
            camera: Camera::look_at([0.0, 0.0, 100.0], [0.0; 3], 100.0, [16, 12]),
            tone: Tone::Linear,
            vignetting: 0.0,
            install: Install { position_mm: 1.0, angle_rad: 0.01, focal_share: 0.005, k1: [0.0, 0.0] },
            standing: [[-1.0, 1.0], [-1.0, 1.0], [0.0, 0.0], [0.0, 0.0]],
            noise: 0.01,
            lamps: vec![Lamp { name: "key".into(), light: 0, power: 1.0, drift: 0.15 }],
            least_correlation: 0.4,
        },
        promise: Promise { false_reject_asked: 0.01, false_reject: rate, escape: rate, modes: vec![] },
        locator: Locator {
            unsigned: false,
            coarse: 2,
            fine: 1,
            groups: vec![PointGroup { name: "datum".into(), alternatives: vec![points] }],
            accept: 0.2,
        },
        nodes: vec![Node {
            name: "pin".into(),
            parent: None,
            level: 1,
            plane: 0.0,
            factor: 1,
            levels: 2,
            origin: [4, 4],
            size: [4, 4],
            visible: [5.0, 5.0, 7.0, 7.0],
            mask: vec![vec![0, 4]; 4],
            spread: [1.0, 1.0],
            disturbs: vec![],
            steps: vec![0.01],
            usual: Vec::new(),
            rise: None,
            good_scores: vec![],
            fault_scores: vec![],
            hypotheses: vec![images("good"), images("missing")],
            disturbed: vec![Disturbed { by: 0, fault: "missing".into(), images: images("missing").images }],
        }],
    }
}

#[test]
fn a_model_comes_back_and_is_one_row_a_line() {
    let model = tiny();
    let text = model.write();
    assert_eq!(Model::read(&text).unwrap(), model);
    assert_eq!(text, Model::read(&text).unwrap().write());
    assert_eq!(text.lines().filter(|l| l.trim() == "\"UOOO\",").count(), 36, "{text}");
}

#[test]
fn every_cut_and_every_edit_is_noticed() {
    let text = tiny().write();
    for end in (0..text.len()).step_by(37) {
        assert!(Model::read(&text[..end]).is_err(), "cut at {end}");
    }
    let edited = text.replacen("UOOO", "UPNO", 1);
    assert!(matches!(Model::read(&edited), Err(ModelError::Digest { .. })));
}

#[test]
fn other_formats_are_named() {
    let newer = tiny().write().replacen("format: 7", "format: 9", 1);
    assert_eq!(Model::read(&newer), Err(ModelError::Newer { format: 9 }));
    assert!(Model::read(&newer).unwrap_err().to_string().contains("E0801"));
    let older = tiny().write().replacen("format: 7", "format: 0", 1);
    assert_eq!(Model::read(&older), Err(ModelError::Older { format: 0 }));
}

#[test]
fn numbers_that_do_not_fit_together_are_refused() {
    type Spoil = fn(&mut Model);
    let spoils: [Spoil; 9] = [
        |m| m.nodes[0].size = [5, 4],
        |m| m.nodes[0].mask[0] = vec![2, u32::MAX],
        |m| m.nodes[0].parent = Some(3),
        |m| m.nodes[0].steps.clear(),
        |m| m.nodes[0].hypotheses[1].images[0].draw = 5,
        |m| m.station.lamps.clear(),
        |m| m.station.camera.focal = f64::NAN,
        |m| m.station.standing[0] = [1.0, -1.0],
        |m| m.locator.fine = 0,
    ];
    for (i, spoil) in spoils.into_iter().enumerate() {
        let mut model = tiny();
        spoil(&mut model);
        // A file with a fitting digest, as an attacker would write it.
        assert!(Model::read(&model.write()).is_err(), "spoil {i}");
    }
}

#[test]
fn what_is_too_large_to_be_read_is_not_written() {
    assert_eq!(too_large(LARGEST_FILE), None);
    let why = too_large(LARGEST_FILE + 1).unwrap();
    assert!(why.contains("1024 MiB") && why.contains("train { images }"), "{why}");
}
