//! What strangers' bytes are fed to: by `tests/fuzz.rs` with mutations of real files, by `fuzz/` with libFuzzer's.
//!
//! None may panic, whatever the bytes are.

use gonogo::runtime::calibrate::{self, Calibration};
use gonogo::runtime::camera::Camera;
use gonogo::runtime::grid::Grid;
use gonogo::runtime::inspect::{Decision, Inspector};
use gonogo::runtime::model::{
    self, Disturbed, Hypothesis, Install, Lamp, Locator, Model, Node, PointGroup, PointSet, Promise, Rate, Station,
};
use gonogo::runtime::photo::{Photo, Tone};
use gonogo::runtime::row::Row;

/// The bytes of an image file. Small sizes only: what is refused for its size tells nothing.
pub fn photo(bytes: &[u8]) {
    for tone in [Tone::Linear, Tone::Srgb] {
        for size in [[45, 31], [16, 12]] {
            if let Ok(photo) = Photo::decode(bytes, tone, size) {
                assert!(photo.light.values.iter().all(|v| (0.0..=1.0).contains(v)));
            }
        }
    }
}

/// The text of a model without its digest line: as an attacker would, it is sealed before it is read. What is read judges and
/// calibrates by a photo.
pub fn model(body: &[u8]) {
    let Ok(body) = std::str::from_utf8(body) else { return };
    let _ = Model::read(body);
    let Ok(model) = Model::read(&sealed(body)) else { return };
    // A fuzzer has no time for photos of a real size.
    if model.station.camera.size.iter().any(|s| *s > 64) {
        return;
    }
    let photo = Photo::from_light(pattern(model.station.camera.size));
    let calibration = Calibration::nominal(&model);
    if let Some(inspector) = Inspector::new(&model, &calibration) {
        let _ = inspector.inspect(&photo);
    }
    let _ = calibrate::fit(&model, &[photo]);
}

/// The text of a calibration of [`tiny`], likewise.
pub fn calibration(body: &[u8]) {
    let Ok(body) = std::str::from_utf8(body) else { return };
    let model = tiny();
    let _ = Calibration::read(body, &model);
    let Ok(calibration) = Calibration::read(&sealed(body), &model) else { return };
    if let Some(inspector) = Inspector::new(&model, &calibration) {
        let verdict = inspector.inspect(&Photo::from_light(pattern(model.station.camera.size)));
        let numbers = verdict.nodes.iter().all(|n| n.score.is_finite() || n.faulty);
        assert!(verdict.decision != Decision::Go || numbers, "go without a number: {verdict:?}");
    }
}

/// The text of a spec, up to the view.
#[cfg(feature = "compile")]
pub fn spec(text: &[u8]) {
    let Ok(text) = std::str::from_utf8(text) else { return };
    let options = gonogo::Options { wanted: [gonogo::artifacts::Artifact::View].into(), ..Default::default() };
    let read = |name: &str| match name {
        "fuzz.gng" => Ok(text.to_string()),
        other => Err(std::io::Error::new(std::io::ErrorKind::NotFound, other.to_string())),
    };
    gonogo::compile("fuzz.gng", &read, &options, &|_| {});
}

/// The text of a spec, parsed, resolved and laid out; what has been laid out stays as it is.
#[cfg(feature = "compile")]
pub fn syntax(text: &[u8]) {
    let Ok(text) = std::str::from_utf8(text) else { return };
    if let Ok(laid_out) = gonogo::syntax::format(text) {
        assert_eq!(gonogo::syntax::format(&laid_out).as_ref(), Ok(&laid_out));
    }
    let read = |name: &str| match name {
        "fuzz.gng" => Ok(text.to_string()),
        other => Err(std::io::Error::new(std::io::ErrorKind::NotFound, other.to_string())),
    };
    gonogo::design::load("fuzz.gng", &read, &[]);
}

/// The text of an OpenSCAD design. What is made of it is a spec that reads.
#[cfg(feature = "compile")]
pub fn import(text: &[u8]) {
    let Ok(text) = std::str::from_utf8(text) else { return };
    if let Ok(part) = gonogo::import::openscad(text, "fuzz.csg", "part_1") {
        assert_eq!(gonogo::syntax::parse(&part, 0).1, [], "{part}");
        let loaded = gonogo::design::load("fuzz.gng", &|_| Ok(part.clone()), &[]);
        let unread = loaded.diagnostics.iter().find(|d| ["E0201", "E0202", "E0203", "E0204"].contains(&d.code));
        assert!(unread.is_none(), "{unread:?}\n{part}");
    }
}

/// Messages of an editor, one a line: `[method, parameters]`. Those that are no JSON are left out: the wire does not let them
/// through.
#[cfg(feature = "cli")]
pub fn messages(lines: &[u8]) {
    use gonogo::lsp::Server;
    let missing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let mut server = Server::new(Box::new(missing));
    let _ = server.request("initialize", serde_json::json!({}));
    for line in String::from_utf8_lossy(lines).lines() {
        let Ok((method, params)) = serde_json::from_str::<(String, serde_json::Value)>(line) else { continue };
        let _ = server.request(&method, params.clone());
        let _ = server.notification(&method, params);
        server.refresh();
        server.jobs();
    }
}

/// A text with the digest that fits.
pub fn sealed(body: &str) -> String {
    format!("{body}// digest: blake3:{}\n", blake3::hash(body.as_bytes()).to_hex())
}

/// A text without its digest line.
pub fn unsealed(text: &str) -> &str {
    &text[..text.rfind("// digest").unwrap_or(text.len())]
}

/// A few edges.
fn pattern(size: [u32; 2]) -> Grid {
    let [width, height] = size.map(|s| s as usize);
    let value = |i: usize| if (i % width / 5 + i / width / 4).is_multiple_of(2) { 0.2 } else { 0.8 };
    Grid::new(width, height, (0..width * height).map(value).collect())
}

/// A model of one node and one lamp.
pub fn tiny() -> Model {
    let images = |fault: &str, value: u16| Hypothesis {
        fault: fault.into(),
        sweep: String::new(),
        threshold: 0.0,
        images: (0..3)
            .map(|draw| model::Image { draw, lamp: 0, rows: vec![Row(vec![7 + draw as u16, 8, value, 10]); 4] })
            .collect(),
    };
    let rate = Rate { events: 0, trials: 10, upper_95: 0.3085 };
    let row = |i: i32| [1_000 * i, -500 * i, 0, 0, 1_000, 0];
    let points =
        PointSet { fault: "good".into(), coarse: (-2..3).map(row).collect(), fine: (-3..4).map(row).collect() };
    Model {
        format: model::FORMAT,
        writer: "gonogo test".into(),
        assembly: "tiny".into(),
        spec: "0".into(),
        seed: 1,
        station: Station {
            name: "bench".into(),
            camera: Camera::look_at([0.0, 0.0, 100.0], [0.0; 3], 100.0, [32, 24]),
            tone: Tone::Linear,
            vignetting: 0.0,
            install: Install { position_mm: 1.0, angle_rad: 0.01, focal_share: 0.005, k1: [0.0, 0.0] },
            standing: [[-1.0, 1.0], [-1.0, 1.0], [0.0, 0.0], [-0.1, 0.1]],
            noise: 0.01,
            lamps: vec![Lamp { name: "key".into(), light: 0, power: 1.0, drift: 0.15 }],
            least_correlation: -1.0,
        },
        promise: Promise { false_reject_asked: 0.01, false_reject: rate, escape: rate, modes: vec![] },
        locator: Locator {
            unsigned: false,
            coarse: 2,
            fine: 1,
            groups: vec![PointGroup { name: "datum".into(), alternatives: vec![points] }],
            accept: -1.0,
        },
        nodes: vec![Node {
            name: "pin".into(),
            parent: None,
            level: 1,
            plane: 0.0,
            factor: 1,
            levels: 2,
            origin: [8, 8],
            size: [4, 4],
            visible: [9.0, 9.0, 11.0, 11.0],
            mask: vec![vec![0, 4]; 4],
            spread: [1.0, 1.0],
            disturbs: vec![],
            steps: vec![0.01],
            usual: Vec::new(),
            rise: None,
            good_scores: vec![0.1, 0.2],
            fault_scores: vec![],
            hypotheses: vec![images("good", 90), images("missing", 9)],
            disturbed: vec![Disturbed { by: 0, fault: "missing".into(), images: images("missing", 40).images }],
        }],
    }
}
