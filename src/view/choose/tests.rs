//! The camera that shows the watched faces is chosen, and what no view shows is an error.

use super::super::shapes::{block, body, placed};
use super::*;
use crate::design::model::{
    CameraSpec, Colour, Component, Floor, Inspect, LightShape, LightSpec, PerPhoto, PoseExpr, Response, Train, Watch,
};
use crate::diag::Span;

fn station(placing: CameraPlacing) -> Station {
    let camera = CameraSpec {
        image: [640, 480],
        focal: Range::exactly(16.0),
        pitch: 0.0074,
        aim: [0.0, 0.0, 10.0],
        placing,
        k1: Range { low: -0.05, nominal: -0.02, high: 0.0 },
        k2: 0.0,
        vignetting: Range::exactly(0.0),
        full_well: f64::INFINITY,
        depth: 8,
        install_mm: 0.0,
        install_rad: 0.0,
        blur: PerPhoto::exactly(0.5),
        response: Response::Linear,
        span: Span::default(),
    };
    Station {
        name: "S".into(),
        camera,
        lights: Vec::new(),
        floor: None,
        x: Range::symmetric(0.0, 3.0),
        y: Range::symmetric(0.0, 3.0),
        z: Range::exactly(0.0),
        rz: Range::symmetric(0.0, 0.1),
        exposure: PerPhoto::exactly(1.0),
        noise: 0.0,
        span: Span::default(),
    }
}

fn design(components: usize, watch: &[usize]) -> Design {
    let component = |i: usize| Component {
        name: format!("part[{}]", i + 1),
        part: i,
        parent: i.checked_sub(1).map(|_| 0),
        frame: PoseExpr::identity(),
        pose: PoseExpr::identity(),
        free: [false; 6],
        span: Span::default(),
    };
    Design {
        name: "test".into(),
        dims: Vec::new(),
        materials: Vec::new(),
        parts: Vec::new(),
        components: (0..components).map(component).collect(),
        measures: Vec::new(),
        stations: Vec::new(),
        inspect: Inspect {
            watch: watch.iter().map(|&component| Watch { component, depth: None }).collect(),
            root: false,
            false_reject: 0.01,
            span: Span::default(),
        },
        train: Train { images: 1, seed: 1, levels: 1, samples: 1, uniform: true },
    }
}

fn anywhere() -> CameraPlacing {
    let degrees = |low: f64, high: f64| Range { low: low.to_radians(), nominal: 0.0, high: high.to_radians() };
    let distance = Range { low: 300.0, nominal: 350.0, high: 400.0 };
    CameraPlacing::Auto { distance, elevation: degrees(20.0, 90.0), azimuth: degrees(-180.0, 180.0) }
}

fn overhead_fixed() -> CameraPlacing {
    CameraPlacing::Fixed { distance: 350.0, elevation: 90f64.to_radians(), azimuth: 0.0 }
}

/// A table with a niche: a small block that a wall hides from everywhere but +y and above.
fn niche() -> Vec<Body> {
    vec![
        body(0, block([50.0, 50.0, 4.0]), placed(0.0, 0.0, 0.0)),
        body(1, block([50.0, 4.0, 40.0]), placed(0.0, -10.0, 4.0)),
        body(2, block([10.0, 10.0, 10.0]), placed(0.0, 0.0, 4.0)),
    ]
}

#[test]
fn a_face_weighs_less_the_lower_it_stands() {
    let face = |component, face| FaceRef { component, face };
    let levels = BTreeMap::from([(face(2, 0), 0), (face(1, 2), 2), (face(0, 5), 1)]);
    let weights: Vec<(usize, u32, f64)> = targets(&levels).iter().map(|t| (t.component, t.face, t.weight)).collect();
    assert_eq!(weights, [(0, 5, 0.5), (1, 2, 0.25), (2, 0, 1.0)]);
}

#[test]
fn the_search_finds_the_side_the_watched_face_is_on() {
    let targets = [Target { component: 2, face: 4, weight: 1.0 }];
    let choice = choose(&design(3, &[2]), &station(anywhere()), &niche(), &targets);
    let placing = choice.table[choice.best].placing;
    assert!(choice.diagnostics.is_empty());
    assert!((placing.azimuth - 90f64.to_radians()).abs() < 20f64.to_radians(), "{placing:?}");
    assert!(placing.elevation < 40f64.to_radians());
    assert!(choice.table.len() > 252);
    let found = choice.seen.iter().find(|s| s.component == 2).unwrap();
    let face = found.faces.iter().find(|f| f.0 == 4).unwrap().1;
    let estimate = choice.table[choice.best].pixels;
    assert!(face.abs_diff(estimate) < face / 10, "{face} {estimate}");
}

#[test]
fn the_assembly_stays_in_the_image_wherever_it_stands() {
    let targets = [Target { component: 0, face: 1, weight: 1.0 }];
    let mut station = station(anywhere());
    let all = choose(&design(3, &[0]), &station, &niche(), &targets);
    assert!(all.table[all.best].framed);
    station.x = Range::symmetric(0.0, 300.0);
    let none = choose(&design(3, &[0]), &station, &niche(), &targets);
    assert!(!none.table[none.best].framed);
}

#[test]
fn a_component_no_view_shows_is_an_error_in_names_and_numbers() {
    let mut bodies = niche();
    bodies.push(body(3, block([4.0; 3]), placed(0.0, 0.0, 6.0)));
    for placing in [anywhere(), overhead_fixed()] {
        let is_auto = placing != overhead_fixed();
        let choice = choose(&design(4, &[2, 3]), &station(placing), &bodies, &[]);
        let [fault] = &choice.diagnostics[..] else { panic!("{:?}", choice.diagnostics) };
        assert_eq!(fault.code, "E0601");
        assert!(fault.message.contains("`part[4]`: 0 of "), "{}", fault.message);
        assert_eq!(fault.message.starts_with("no allowed camera"), is_auto);
    }
}

#[test]
fn cameras_and_lamps_inside_of_parts_or_below_the_floor_are_errors() {
    let faults = |distance: f64, lamp: [f64; 3]| -> Vec<String> {
        let elevation = 90f64.to_radians();
        let mut station = station(CameraPlacing::Fixed { distance, elevation, azimuth: 0.0 });
        let shape = LightShape::Panel { width: 100.0, height: 100.0, at: lamp, aim: [0.0; 3] };
        station.lights.push(LightSpec {
            name: "top".into(),
            shape,
            colour: Colour::White,
            power: 1.0,
            drift: 0.1,
            span: Span::default(),
        });
        station.floor = Some(Floor { z: -5.0, material: 0 });
        let choice = choose(&design(3, &[2]), &station, &niche(), &[]);
        choice.diagnostics.iter().map(|d| format!("{} {}", d.code, d.message)).collect()
    };
    assert_eq!(faults(300.0, [0.0, 0.0, 400.0]), [""; 0]);
    // The aim is at z = 10, the small block reaches from 4 to 14.
    assert_eq!(faults(2.0, [0.0, 0.0, 400.0]), ["E0603 the camera of station `S` stands inside `part[3]`"]);
    assert_eq!(faults(300.0, [20.0, 20.0, 2.0]), ["E0603 light `top` of station `S` stands inside `part[1]`"]);
    assert_eq!(
        faults(300.0, [200.0, 0.0, -6.0]),
        ["E0603 light `top` of station `S` stands below the floor, which is at z = -5"]
    );
}

#[test]
fn a_fixed_camera_is_a_choice_of_one() {
    let targets = [Target { component: 2, face: 1, weight: 2.0 }];
    let choice = choose(&design(3, &[2]), &station(overhead_fixed()), &niche(), &targets);
    let [only] = &choice.table[..] else { panic!() };
    // 10 mm at (350 + 10 - 14) mm, 2162 px: 62.5 px square.
    assert!((f64::from(only.pixels) / (62.5 * 62.5) - 1.0).abs() < 0.06, "{}", only.pixels);
    assert_eq!((only.surfaces, choice.best), (1, 0));
    assert!((only.score - 2.0 * (f64::from(only.pixels) / 16.0).ln_1p()).abs() < 1e-12);
}

#[test]
fn the_table_does_not_depend_on_the_number_of_threads() {
    let targets = [Target { component: 2, face: 1, weight: 1.0 }];
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| choose(&design(3, &[2]), &station(anywhere()), &niche(), &targets))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.table, three.table);
    assert_eq!(one.best, three.best);
}

#[test]
fn a_camera_is_looked_through_in_full_wherever_the_search_leaves_a_doubt() {
    let (design, station, bodies) = (design(3, &[0, 2]), station(overhead_fixed()), niche());
    let (mut doubts, mut faults) = (0, 0);
    for distance in [350.0, 900.0, 4000.0] {
        for step in 0..16 {
            let elevation = (5.0 + 25.0 * f64::from(step / 8)).to_radians();
            let placing = Placed { distance, elevation, azimuth: f64::from(step % 8) * TAU / 8.0 };
            let [full, quick] = [Asks::What, Asks::Whether].map(|a| keep(&design, &station, &bodies, &[], placing, a));
            assert_eq!(full.diagnostics, quick.diagnostics, "{placing:?}");
            assert_eq!((full.seen.is_empty(), full.camera), (false, quick.camera));
            doubts += usize::from(!quick.seen.is_empty());
            faults += full.diagnostics.len();
        }
    }
    assert!(doubts > 0 && doubts < 48 && faults > 0, "{doubts} {faults}");
}
