//! A reader of model and calibration files written from `docs/src/model_file.md` alone: it knows of the project only that page,
//! takes the tables from it, and must find in the files exactly what the library finds.

#![cfg(feature = "cli")]

use gonogo::runtime::calibrate::Calibration;
use gonogo::runtime::model::Model;
use gonogo::runtime::rig::{Component, Mode, Rig, RigCalibration, Seen};
use ron_value::Value;
use std::collections::BTreeMap;
use std::fs;

#[path = "model_file/ron_value.rs"]
mod ron_value;

mod plate;

/// Records by name, each with its fields and their types.
type Tables = BTreeMap<String, Vec<(String, String)>>;

/// The tables under the headings of the page.
fn tables() -> Tables {
    let page = fs::read_to_string(plate::root().join("docs/src/model_file.md")).unwrap();
    let mut tables = Tables::new();
    for section in page.split("\n### ").skip(1) {
        let name = section.lines().next().unwrap().trim().to_string();
        let rows = section.split("\n## ").next().unwrap().lines().filter(|l| l.starts_with("| `"));
        let cells = rows.map(|row| row.split('|').map(str::trim).collect::<Vec<_>>());
        let fields = cells.map(|c| (c[1].trim_matches('`').to_string(), c[2].to_string())).collect();
        tables.insert(name, fields);
    }
    tables
}

/// What stands before the digest line, if the digest is right.
fn opened(text: &str) -> Result<&str, String> {
    const LINE: &str = "// digest: blake3:";
    let start = text.rfind(LINE).ok_or("no digest")?;
    let (body, line) = text.split_at(start);
    let digest = line[LINE.len()..].strip_suffix('\n').ok_or("no end of the line")?;
    if digest.len() != 64 || blake3::hash(body.as_bytes()).to_hex().as_str() != digest {
        return Err("the digest does not agree".into());
    }
    Ok(body)
}

/// Reads a text as the record `name`, checked against the tables.
fn read(text: &str, name: &str, tables: &Tables) -> Result<Value, String> {
    let value = ron_value::parse(opened(text)?)?;
    check(&value, name, tables, name)?;
    let format = if name == "Calibration" || name == "RigCalibration" { 5 } else { 7 };
    match value.at("format") {
        Value::Int(is) if *is == format => Ok(value),
        other => Err(format!("format {other:?}")),
    }
}

fn check(value: &Value, kind: &str, tables: &Tables, path: &str) -> Result<(), String> {
    let wrong = || Err(format!("{path} is no `{kind}`: {value:?}"));
    let kind = kind.trim();
    if let Some(inner) = kind.strip_prefix('[').and_then(|k| k.strip_suffix(']')) {
        let Value::List(items) = value else { return wrong() };
        return items.iter().enumerate().try_for_each(|(i, v)| check(v, inner, tables, &format!("{path}[{i}]")));
    }
    if let Some(inner) = kind.strip_prefix("option ") {
        return match value {
            Value::Word(word) if word == "None" => Ok(()),
            Value::Some(value) => check(value, inner, tables, path),
            _ => wrong(),
        };
    }
    if let Some((count, inner)) = kind.split_once(' ').and_then(|(n, k)| Some((n.parse::<usize>().ok()?, k))) {
        let Value::Tuple(items) = value else { return wrong() };
        if items.len() != count {
            return wrong();
        }
        return items.iter().enumerate().try_for_each(|(i, v)| check(v, inner, tables, &format!("{path}[{i}]")));
    }
    match (kind, value) {
        ("int", Value::Int(_)) | ("float", Value::Float(_)) | ("string", Value::Text(_)) => Ok(()),
        ("bool", Value::Word(word)) if word == "true" || word == "false" => Ok(()),
        ("Tone", Value::Word(word)) if word == "Linear" || word == "Srgb" => Ok(()),
        ("row", Value::Text(text)) => row(text).map(|_| ()).ok_or_else(|| format!("{path} is no row: {text}")),
        (record, Value::Record(fields)) => {
            let table = tables.get(record).ok_or_else(|| format!("{path}: the page has no `{record}`"))?;
            let is: Vec<&String> = fields.iter().map(|f| &f.0).collect();
            // What is optional is left out where it is usual.
            let needed = |f: &&(String, String)| !f.1.starts_with("optional ") || is.contains(&&f.0);
            let table: Vec<(String, String)> = table.iter().filter(needed).cloned().collect();
            let want: Vec<&String> = table.iter().map(|f| &f.0).collect();
            if is != want {
                return Err(format!("{path} has the fields {is:?}, the page says {want:?}"));
            }
            let mut both = fields.iter().zip(&table);
            both.try_for_each(|((n, v), (_, k))| {
                check(v, k.trim_start_matches("optional "), tables, &format!("{path}.{n}"))
            })
        }
        _ => wrong(),
    }
}

/// "Rows of images", rule by rule.
fn row(text: &str) -> Option<Vec<u16>> {
    let code = |c: char| match c {
        '{' => Some(34),
        '}' => Some(92),
        '"' | '\\' => None,
        c => Some(c as i64).filter(|c| *c < 128),
    };
    let (mut values, mut left) = (Vec::new(), 0i64);
    let mut letters = text.chars();
    while let Some(letter) = letters.next() {
        left = match code(letter)? {
            126 => {
                let mut digit = || code(letters.next()?).map(|c| c - 48).filter(|d| (0..64).contains(d));
                (digit()? * 64 + digit()?) * 64 + digit()?
            }
            step @ 33..=122 => left + step - 78,
            _ => return None,
        };
        values.push(u16::try_from(left).ok()?);
    }
    Some(values)
}

#[test]
fn the_example_of_a_row_is_right() {
    assert_eq!(row("NNO~000"), Some(vec![0, 0, 1, 0]));
}

#[test]
fn a_reader_written_from_the_page_reads_what_the_library_reads() {
    let folder = plate::plate("model_file");
    let tables = tables();
    let text = fs::read_to_string(folder.join(plate::MODEL)).unwrap();
    let value = read(&text, "Model", &tables).unwrap();
    let model = Model::read(&text).unwrap();
    same_model(&value, &model);

    let calibration = fs::read_to_string(folder.join(plate::CALIBRATION)).unwrap();
    let value = read(&calibration, "Calibration", &tables).unwrap();
    let calibration = Calibration::read(&calibration, &model).unwrap();
    assert_eq!(value.at("model").text(), model.digest());
    assert_eq!(text.trim_end().rsplit(':').next(), Some(model.digest().as_str()));
    assert_eq!(value.at("lamps").floats(), calibration.lamps);
    assert_eq!(value.at("noise").float(), calibration.noise);
    assert_eq!(value.at("installation").at("turn").floats(), calibration.installation.turn);
    assert_eq!(value.at("poses").items()[0].at("rz").float(), calibration.poses[0].rz);
    let shifts = value.at("references").items()[0].at("shifts").items();
    assert_eq!(shifts.iter().map(Value::floats).collect::<Vec<_>>(), calibration.references[0].shifts);
    for (i, window) in value.at("references").items()[0].at("windows").items().iter().enumerate() {
        let grid = calibration.references[0].window(i);
        let light = |r: &Value| row(r.text()).unwrap().into_iter().map(|v| f32::from(v) / 4000.0).collect::<Vec<_>>();
        assert_eq!(window.items().iter().flat_map(light).collect::<Vec<f32>>(), grid.values);
    }

    reads_a_rig(&model, &calibration, &tables);

    // Every record of the page is met in these files.
    let met = ["Model", "Station", "Camera", "Install", "Lamp", "Promise", "Rate", "ModeRate", "Locator", "PointGroup"];
    let more =
        ["PointSet", "Node", "Hypothesis", "Disturbed", "Image", "Calibration", "Installation", "Pose", "Reference"];
    let several = ["Rig", "Component", "Mode", "Seen", "RigCalibration", "Usual", "Rise", "Shown"];
    let mut known: Vec<&str> = met.iter().chain(&more).chain(&several).copied().collect();
    known.sort_unstable();
    assert_eq!(tables.keys().map(String::as_str).collect::<Vec<_>>(), known);

    // And a reader from the page refuses what the library refuses.
    for broken in [text.replacen("format: 7", "format: 8", 1), text.replacen("seed: 7", "seed: 8", 1)] {
        assert!(read(&broken, "Model", &tables).is_err() && Model::read(&broken).is_err());
    }
}

/// The model as that of the only camera of a rig.
fn reads_a_rig(model: &Model, calibration: &Calibration, tables: &Tables) {
    let mut camera = model.clone();
    camera.station.name = "bench.top".into();
    let node = &model.nodes[0];
    let seen = Seen { camera: 0, weight: 2.5, offset: -0.25, power: 9.0 };
    let mode = Mode { fault: node.hypotheses[1].fault.clone(), threshold: -0.5, seen: vec![seen] };
    let scores = (vec![0.5, 1.0], vec![-1.0]);
    let of = Component { name: node.name.clone(), modes: vec![mode], good_scores: scores.0, fault_scores: scores.1 };
    let rig = Rig {
        format: model.format,
        rig: "bench".into(),
        writer: model.writer.clone(),
        assembly: model.assembly.clone(),
        spec: model.spec.clone(),
        seed: model.seed,
        promise: model.promise.clone(),
        components: vec![of],
        cameras: vec![camera],
    };
    let text = rig.write();
    assert_eq!(Rig::read(&text).unwrap(), rig);
    let value = read(&text, "Rig", tables).unwrap();
    assert_eq!(value.at("rig").text(), "bench");
    same_model(&value.at("cameras").items()[0], &rig.cameras[0]);
    let component = &value.at("components").items()[0];
    assert_eq!(
        (component.at("name").text(), component.at("good_scores").floats()),
        (node.name.as_str(), vec![0.5, 1.0])
    );
    let mode = &component.at("modes").items()[0];
    assert_eq!(mode.at("threshold").float(), -0.5);
    let seen = &mode.at("seen").items()[0];
    let numbers = ["weight", "offset", "power"].map(|name| seen.at(name).float());
    assert_eq!(numbers, [2.5, -0.25, 9.0]);

    let own = Calibration { model: rig.cameras[0].digest(), ..calibration.clone() };
    let calibration = RigCalibration::of(&rig, vec![own]);
    let text = calibration.write();
    assert_eq!(RigCalibration::read(&text, &rig).unwrap(), calibration);
    let value = read(&text, "RigCalibration", tables).unwrap();
    assert_eq!(value.at("rig").text(), rig.digest());
    assert_eq!(value.at("cameras").items()[0].at("noise").float(), calibration.cameras[0].noise);
}

fn same_model(value: &Value, model: &Model) {
    assert_eq!(value.at("assembly").text(), model.assembly);
    let (station, camera) = (value.at("station"), &model.station.camera);
    assert_eq!(station.at("camera").at("position").floats(), camera.position);
    assert_eq!(station.at("camera").at("axes").items()[2].floats(), camera.axes[2]);
    assert_eq!(station.at("standing").items()[3].floats(), model.station.standing[3]);
    assert_eq!(value.at("promise").at("modes").items().len(), model.promise.modes.len());
    let group = &value.at("locator").at("groups").items()[0].at("alternatives").items()[0];
    let points = &model.locator.groups[0].alternatives[0].fine;
    assert_eq!(group.at("fine").items().iter().map(Value::ints).collect::<Vec<_>>(), as_ints(points));
    let nodes = value.at("nodes").items();
    assert_eq!(nodes.len(), model.nodes.len());
    for (node, own) in nodes.iter().zip(&model.nodes) {
        assert_eq!(node.at("name").text(), own.name);
        assert_eq!(node.at("steps").floats(), own.steps);
        assert_eq!(node.at("good_scores").floats(), own.good_scores);
        assert_eq!(node.at("mask").items().len(), own.size[1] as usize);
        assert_eq!(node.at("hypotheses").items().len(), own.hypotheses.len());
        for (hypothesis, own) in node.at("hypotheses").items().iter().zip(&own.hypotheses) {
            assert_eq!(hypothesis.at("fault").text(), own.fault);
            assert_eq!(hypothesis.at("threshold").float(), own.threshold);
            for (k, (image, own)) in hypothesis.at("images").items().iter().zip(&own.images).enumerate() {
                let lamps = model.station.lamps.len() as i64;
                let place = (image.at("draw").int(), image.at("lamp").int());
                assert_eq!(place, (k as i64 / lamps, k as i64 % lamps));
                let rows: Vec<_> = image.at("rows").items().iter().map(|r| row(r.text()).unwrap()).collect();
                assert_eq!(rows, own.rows.iter().map(|r| r.0.clone()).collect::<Vec<_>>());
            }
        }
    }
}

fn as_ints(points: &[[i32; 6]]) -> Vec<Vec<i64>> {
    points.iter().map(|p| p.iter().map(|&v| i64::from(v)).collect()).collect()
}

/// The camera as the page describes it sees what the library's sees.
#[test]
fn the_camera_is_as_the_page_says() {
    use gonogo::runtime::camera::Camera;
    let (k1, k2) = (-0.08, 0.03);
    let camera = Camera { k1, k2, ..Camera::look_at([20.0, -155.0, 303.0], [0.0, 0.0, 12.0], 2162.0, [640, 480]) };
    for point in [[3.0, 4.0, 5.0], [-20.0, 11.0, 0.0], [25.0, -14.0, 18.0]] {
        let along = |axis: usize| (0..3).map(|i| camera.axes[axis][i] * (point[i] - camera.position[i])).sum::<f64>();
        let (u, v) = (camera.focal * along(0) / along(2), camera.focal * along(1) / along(2));
        let rho = (u * u + v * v) / camera.centre[0].powi(2);
        let s = 1.0 + k1 * rho + k2 * rho * rho;
        let seen = camera.project(point).unwrap();
        let expected = [u * s + camera.centre[0], v * s + camera.centre[1]];
        assert!((0..2).all(|i| (seen[i] - expected[i]).abs() < 1e-9), "{seen:?} {expected:?}");
    }
}
