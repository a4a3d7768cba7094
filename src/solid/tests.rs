//! Solids against closed forms and the reference figures of an independent modeller.

mod fault;
mod oblique;
mod random;
mod wheel;

use super::*;
use crate::design::model::{Expr, Extent, Feature, FeatureCopy, Op, PoseExpr, Shape};
use crate::diag::Span;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

fn number(v: f64) -> Expr {
    Expr::Const(v)
}

fn length(v: f64) -> Extent {
    Extent::Length(number(v))
}

fn cylinder(d: f64, h: f64) -> Shape {
    Shape::Cylinder { d: number(d), h: length(h) }
}

fn cone(d1: f64, d2: f64, h: f64) -> Shape {
    Shape::Cone { d1: number(d1), d2: number(d2), h: length(h) }
}

fn block(x: f64, y: f64, z: f64) -> Shape {
    Shape::Box { x: number(x), y: number(y), z: length(z) }
}

fn ball(d: f64) -> Shape {
    Shape::Sphere { d: number(d) }
}

fn through(mut shape: Shape) -> Shape {
    match &mut shape {
        Shape::Box { z: e, .. } | Shape::Cylinder { h: e, .. } | Shape::Cone { h: e, .. } => *e = Extent::Through,
        _ => {}
    }
    shape
}

/// Translation, then turn about z.
fn pose(t: [f64; 3], rz: f64) -> PoseExpr {
    PoseExpr { t: t.map(number), r: [0.0, 0.0, rz].map(number) }
}

fn turned(r: [f64; 3]) -> PoseExpr {
    PoseExpr { t: [0.0; 3].map(number), r: r.map(number) }
}

fn feature(name: &str, op: Op, copies: Vec<(Shape, PoseExpr)>) -> Feature {
    let patterned = copies.len() > 1;
    let copies = copies.into_iter().map(|(shape, pose)| FeatureCopy { shape, pose }).collect();
    Feature { name: name.into(), op, patterned, copies, span: Span::default() }
}

fn one(name: &str, op: Op, shape: Shape, z: f64) -> Feature {
    feature(name, op, vec![(shape, pose([0.0, 0.0, z], 0.0))])
}

/// Copies on a circle, each turned to face outwards.
fn ring_of(name: &str, op: Op, shape: &Shape, count: usize, radius: f64, from: f64) -> Feature {
    let place = |k: usize| {
        let a = from + TAU * k as f64 / count as f64;
        (shape.clone(), pose([radius * a.cos(), radius * a.sin(), 0.0], a))
    };
    feature(name, op, (0..count).map(place).collect())
}

fn part(features: Vec<Feature>) -> Part {
    Part { name: "part".into(), material: 0, features, span: Span::default() }
}

fn solid(features: Vec<Feature>) -> Solid {
    let solid = evaluate(&part(features), &[], &Quality::default());
    let solid = solid.unwrap_or_else(|faults| panic!("{faults:#?}"));
    check_mesh(&solid);
    solid
}

fn faults(features: Vec<Feature>) -> Vec<&'static str> {
    let result = evaluate(&part(features), &[], &Quality::default());
    result.map(|s| s.volume).unwrap_err().iter().map(|d| d.code).collect()
}

/// The same part with every operand turned and moved together.
fn moved(features: &[Feature]) -> Vec<Feature> {
    let common = turned([0.7, -0.4, 1.1]).eval(&[]);
    let common = nalgebra::Translation3::new(13.0, -7.0, 29.0) * common;
    let mut features = features.to_vec();
    for copy in features.iter_mut().flat_map(|f| &mut f.copies) {
        let pose = common * copy.pose.eval(&[]);
        let (rx, ry, rz) = pose.rotation.euler_angles();
        let t = pose.translation.vector;
        copy.pose = PoseExpr { t: [t.x, t.y, t.z].map(number), r: [rx, ry, rz].map(number) };
    }
    features
}

/// Closed, outward, and with areas and volume near the exact ones.
fn check_mesh(solid: &Solid) {
    let mesh = &solid.mesh;
    let mut sides: BTreeMap<(u32, u32), i32> = BTreeMap::new();
    let (mut volume, mut areas) = (0.0, vec![0.0; solid.faces.len()]);
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            *sides.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
        let [a, b, c] = t.map(|v| mesh.positions[v as usize]);
        volume += a.coords.dot(&b.coords.cross(&c.coords)) / 6.0;
        let normal = (b - a).cross(&(c - a));
        areas[mesh.faces[i] as usize] += normal.norm() / 2.0;
        for (corner, p) in mesh.normals[i].iter().zip([a, b, c]) {
            assert!((corner.norm() - 1.0).abs() < 1e-9);
            let surface = solid.surface(mesh.faces[i] as usize);
            assert!(surface.distance(&p).abs() < 1e-9, "vertex off its surface");
            assert!(normal.dot(corner) > 0.5 * normal.norm(), "{:?}", solid.faces[mesh.faces[i] as usize]);
        }
    }
    for ((a, b), count) in &sides {
        assert_eq!((*count, sides.get(&(*b, *a))), (1, Some(&1)), "mesh edge {a} {b}");
    }
    assert!((volume / solid.volume - 1.0).abs() < 8e-3, "{volume} {}", solid.volume);
    for (face, area) in solid.faces.iter().zip(areas) {
        assert!((area - face.area).abs() < 5e-3 * face.area + 0.02, "{} {area} {}", face.name, face.area);
    }
    for (i, face) in solid.faces.iter().enumerate() {
        let region: f64 = solid.face_region(i).iter().map(|p| polygon_area(p)).sum();
        assert!((region - face.area).abs() < 5e-3 * face.area + 0.02, "{} {region} {}", face.name, face.area);
    }
}

fn polygon_area(p: &[[f64; 2]]) -> f64 {
    let n = p.len();
    (0..n).map(|i| (p[i][0] * p[(i + 1) % n][1] - p[(i + 1) % n][0] * p[i][1]) / 2.0).sum()
}

fn plate() -> Vec<Feature> {
    vec![
        one("body", Op::Add, cylinder(56.0, 2.0), 0.0),
        one("bore", Op::Cut, cylinder(20.0, 2.0), 0.0),
        ring_of("hole", Op::Cut, &cylinder(4.5, 2.0), 3, 18.0, 0.0),
        ring_of("slot", Op::Cut, &block(4.0, 1.2, 2.0), 60, 25.0, 0.0),
    ]
}

fn pin(sizes: [(f64, f64); 4]) -> Vec<Feature> {
    let mut z = 0.0;
    let mut features = Vec::new();
    for (i, (d, h)) in sizes.into_iter().enumerate() {
        features.push(one(&format!("step{i}"), Op::Add, cylinder(d, h), z));
        z += h;
    }
    features
}

fn gear() -> Vec<Feature> {
    vec![
        one("body", Op::Add, cylinder(50.0, 6.0), 0.0),
        ring_of("tooth", Op::Add, &block(6.0, 3.0, 6.0), 24, 25.0, 0.0),
        ring_of("hole", Op::Cut, &cylinder(6.0, 6.0), 4, 15.0, 0.0),
        one("bore", Op::Cut, cylinder(10.0, 6.0), 0.0),
    ]
}

/// Volume, area, planes, cylinders, edges and vertices as Open CASCADE counts them.
type Figures = (f64, f64, usize, usize, usize, usize);

fn compare(features: &[Feature], expected: Figures) {
    for features in [features.to_vec(), moved(features)] {
        let s = solid(features);
        let c = s.counts();
        assert!((s.volume - expected.0).abs() < 1e-6, "{} {}", s.volume, expected.0);
        assert!((s.area - expected.1).abs() < 1e-6, "{} {}", s.area, expected.1);
        let counts = (c.planes, c.cylinders, c.edges_with_seams(), c.vertices());
        assert_eq!(counts, (expected.2, expected.3, expected.4, expected.5), "{c:?}");
    }
}

#[test]
fn plate_has_the_reference_figures() {
    compare(&plate(), (3626.272873, 5436.617958, 242, 5, 735, 490));
}

#[test]
fn plate_cut_through_has_the_same_figures() {
    let mut features = plate();
    for copy in features.iter_mut().skip(1).flat_map(|f| &mut f.copies) {
        copy.shape = through(copy.shape.clone());
    }
    compare(&features, (3626.272873, 5436.617958, 242, 5, 735, 490));
}

#[test]
fn stepped_pin_has_the_reference_figures() {
    compare(&pin([(4.0, 5.0), (6.0, 2.0), (4.0, 8.0), (3.0, 4.0)]), (248.185820, 295.309709, 5, 4, 12, 8));
}

#[test]
fn pin_of_equal_radii_has_the_reference_figures() {
    compare(&pin([(4.0, 5.0), (4.0, 2.0), (6.0, 8.0), (6.0, 4.0)]), (427.256601, 370.707933, 3, 2, 6, 4));
}

#[test]
fn gear_has_the_reference_figures() {
    compare(&gear(), (11933.633043, 6437.952443, 74, 29, 303, 202));
}

#[test]
fn frustum_tip_and_point_have_closed_forms() {
    let tip =
        |d2: f64| vec![one("body", Op::Add, cylinder(10.0, 20.0), 0.0), one("tip", Op::Add, cone(10.0, d2, 4.0), 20.0)];
    for (d2, planes) in [(8.4, 2), (0.0, 1)] {
        for features in [tip(d2), moved(&tip(d2))] {
            let s = solid(features);
            let (a, b) = (5.0, d2 / 2.0);
            let frustum = PI * 4.0 / 3.0 * (a * a + a * b + b * b);
            let slant = ((a - b) * (a - b) + 16.0_f64).sqrt();
            let area = PI * (25.0 + b * b) + TAU * 5.0 * 20.0 + PI * (a + b) * slant;
            assert!((s.volume - PI * 500.0 - frustum).abs() < 1e-9 && (s.area - area).abs() < 1e-9);
            assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().cones), (planes, 1, 1));
        }
    }
}

#[test]
fn ball_and_ball_less_a_bore_have_closed_forms() {
    let bored = vec![one("ball", Op::Add, ball(10.0), 0.0), one("bore", Op::Cut, through(cylinder(6.0, 0.0)), 0.0)];
    for (features, volume) in
        [(vec![one("ball", Op::Add, ball(10.0), 3.0)], PI * 1000.0 / 6.0), (bored, PI * 512.0 / 6.0)]
    {
        for features in [features.clone(), moved(&features)] {
            let s = solid(features);
            assert!((s.volume - volume).abs() < 1e-9, "{} {volume}", s.volume);
        }
    }
}

#[test]
fn dome_on_a_pin_has_its_closed_form() {
    let features = vec![one("shank", Op::Add, cylinder(6.0, 10.0), 0.0), one("dome", Op::Add, ball(6.0), 10.0)];
    for features in [features.clone(), moved(&features)] {
        let s = solid(features);
        assert!((s.volume - PI * 90.0 - PI * 18.0).abs() < 1e-9, "{}", s.volume);
        assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().spheres), (1, 1, 1));
    }
}

#[test]
fn a_slot_with_round_ends_is_smooth_where_its_sides_touch() {
    let features = vec![
        one("slab", Op::Add, block(40.0, 20.0, 5.0), 0.0),
        one("slot", Op::Cut, through(block(10.0, 6.0, 0.0)), 0.0),
        feature("end", Op::Cut, [-5.0, 5.0].map(|x| (through(cylinder(6.0, 0.0)), pose([x, 0.0, 0.0], 0.0))).to_vec()),
    ];
    for features in [features.clone(), moved(&features)] {
        let s = solid(features);
        assert!((s.volume - (800.0 - 60.0 - PI * 9.0) * 5.0).abs() < 1e-8, "{}", s.volume);
        assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().edges), (8, 2, 24));
    }
}

#[test]
fn a_slot_open_at_the_rim_and_a_notch_to_the_bore_work() {
    let features = vec![
        one("body", Op::Add, cylinder(46.0, 3.0), 0.0),
        one("bore", Op::Cut, through(cylinder(26.0, 0.0)), 0.0),
        ring_of("notch", Op::Cut, &through(block(14.0, 5.0, 0.0)), 1, 18.0, 1.5 * PI),
        ring_of("hole", Op::Cut, &through(cylinder(4.0, 0.0)), 3, 18.0, PI / 2.0),
    ];
    for features in [features.clone(), moved(&features)] {
        let s = solid(features);
        // Ring, less the strip of half width 2.5 between the circles, less the holes.
        let half = |r: f64| 2.5 * (r * r - 6.25_f64).sqrt() + r * r * (2.5 / r).asin();
        let plan = PI * (23.0 * 23.0 - 13.0 * 13.0) - (half(23.0) - half(13.0)) - 3.0 * PI * 4.0;
        assert!((s.volume - plan * 3.0).abs() < 1e-8, "{} {}", s.volume, plan * 3.0);
        assert_eq!((s.counts().planes, s.counts().cylinders), (4, 5));
    }
}

#[test]
fn a_void_and_a_blind_slot_in_the_rim_work() {
    let features = vec![
        one("body", Op::Add, cylinder(30.0, 10.0), 0.0),
        one("void", Op::Cut, cylinder(4.0, 2.0), 4.0),
        feature("window", Op::Cut, vec![(block(6.0, 4.0, 2.0), pose([15.0, 0.0, 6.0], 0.0))]),
        feature("blind", Op::Cut, vec![(block(6.0, 4.0, 5.0), pose([-15.0, 0.0, 7.0], 0.0))]),
    ];
    for features in [features.clone(), moved(&features)] {
        let s = solid(features);
        let half = 2.0 * (225.0 - 4.0_f64).sqrt() + 225.0 * (2.0 / 15.0_f64).asin();
        let bite = half - 12.0 * 4.0;
        assert!((s.volume - (2250.0 * PI - 8.0 * PI - bite * 5.0)).abs() < 1e-8, "{}", s.volume);
    }
}

#[test]
fn a_ball_cut_by_planes_through_its_centre_is_exact() {
    let wedge = vec![
        one("ball", Op::Add, ball(10.0), 0.0),
        feature("octant", Op::Cut, vec![(block(10.0, 10.0, 10.0), pose([5.0, 5.0, 0.0], 0.0))]),
    ];
    let half = vec![
        one("ball", Op::Add, ball(10.0), 0.0),
        feature("half", Op::Keep, vec![(block(10.0, 20.0, 20.0), pose([5.0, 0.0, -10.0], 0.0))]),
    ];
    let full = PI * 1000.0 / 6.0;
    for (features, volume, area) in [(wedge, full * 7.0 / 8.0, 87.5 * PI + 18.75 * PI), (half, full / 2.0, 75.0 * PI)] {
        for features in [features.clone(), moved(&features)] {
            let s = solid(features);
            assert!((s.volume - volume).abs() < 1e-9, "{} {volume}", s.volume);
            assert!((s.area - area).abs() < 1e-9, "{} {area}", s.area);
        }
    }
}

#[test]
fn a_slot_that_passes_a_countersink_is_not_refused() {
    let features = vec![
        one("slab", Op::Add, block(40.0, 20.0, 5.0), 0.0),
        feature("sink", Op::Cut, vec![(cone(4.0, 10.0, 3.0), pose([0.0, 0.0, 2.0], 0.0))]),
        feature("slot", Op::Cut, vec![(block(2.0, 2.0, 5.0), pose([4.9, 4.9, 0.0], 0.3))]),
    ];
    let sink = PI * (4.0 + 10.0 + 25.0);
    for features in [features.clone(), moved(&features)] {
        assert!((solid(features).volume - (4000.0 - sink - 20.0)).abs() < 1e-8);
    }
}

#[test]
fn keep_intersects() {
    let s = solid(vec![
        one("bar", Op::Add, block(20.0, 20.0, 5.0), 0.0),
        one("round", Op::Keep, through(cylinder(10.0, 0.0)), 0.0),
    ]);
    assert!((s.volume - PI * 125.0).abs() < 1e-9);
}

#[test]
fn faces_are_named_after_the_first_feature() {
    let s = solid(gear());
    let names: Vec<&str> = s.faces.iter().map(|f| f.name.as_str()).collect();
    assert!(
        ["body.side", "body.top", "body.bottom", "tooth[3].+x", "hole[2].side", "bore.side"]
            .iter()
            .all(|n| names.contains(n)),
        "{names:?}"
    );
    assert!(!names.contains(&"tooth[1].top"));
}

#[test]
fn faults_have_codes() {
    let slab = || one("slab", Op::Add, block(10.0, 10.0, 2.0), 0.0);
    assert_eq!(faults(vec![slab(), one("all", Op::Cut, through(block(20.0, 20.0, 0.0)), 0.0)]), ["E0401"]);
    assert_eq!(faults(vec![slab(), one("saw", Op::Cut, through(block(1.0, 20.0, 0.0)), 0.0)]), ["E0405"]);
    let corner = feature("corner", Op::Add, vec![(block(10.0, 10.0, 2.0), pose([10.0, 10.0, 0.0], 0.0))]);
    assert_eq!(faults(vec![slab(), corner]), ["E0407"]);
    assert_eq!(faults(vec![one("slab", Op::Add, block(10.0, -1.0, 2.0), 0.0)]), ["E0408"]);
    assert_eq!(faults(vec![one("slab", Op::Add, block(10.0, f64::NAN, 2.0), 0.0)]), ["E0408"]);
}

#[test]
fn the_body_that_stands_apart_is_named() {
    let told = |features| {
        let faults = evaluate(&part(features), &[], &Quality::default()).map(|s| s.volume).unwrap_err();
        faults[0].labels[1].text.clone()
    };
    let slab = || one("slab", Op::Add, block(10.0, 10.0, 2.0), 0.0);
    assert_eq!(told(vec![slab(), one("lid", Op::Add, block(4.0, 4.0, 1.0), 2.5)]), "`lid` touches none of the others");
    assert_eq!(told(vec![slab(), one("saw", Op::Cut, through(block(1.0, 20.0, 0.0)), 0.0)]), "`saw` cuts it off");
}

#[test]
fn a_cut_that_misses_changes_nothing() {
    let s = solid(vec![
        one("slab", Op::Add, block(10.0, 10.0, 2.0), 0.0),
        one("relief", Op::Cut, block(1.0, 1.0, 1.0), 5.0),
    ]);
    assert!((s.volume - 200.0).abs() < 1e-9 && s.faces.len() == 6);
}

/// Wheel A1 of the pattern wheel.
fn wheel() -> Vec<Feature> {
    let hole = |d: f64| through(cylinder(d, 0.0));
    let at = |r: f64, a: f64| pose([r * a.to_radians().cos(), r * a.to_radians().sin(), 0.0], 0.0);
    vec![
        one("body", Op::Add, cylinder(56.0, 2.0), 0.0),
        one("bore", Op::Cut, hole(20.0), 0.0),
        ring_of("alignment", Op::Cut, &hole(4.5), 3, 18.0, PI / 2.0),
        feature("hd", Op::Cut, vec![(hole(2.5), at(23.5, 30.0))]),
        feature("unlatch", Op::Cut, vec![(hole(3.5), at(23.5, 150.0))]),
        ring_of("window", Op::Cut, &hole(9.0), 3, 16.0, PI / 6.0),
        ring_of("slot", Op::Cut, &through(block(3.0, 1.0, 0.0)), 24, 28.0, 7.5_f64.to_radians()),
    ]
}

#[test]
fn wheel_has_the_expected_faces() {
    for features in [wheel(), moved(&wheel())] {
        let s = solid(features);
        assert_eq!((s.counts().cylinders, s.counts().planes), (24 + 9, 2 + 72));
    }
}
