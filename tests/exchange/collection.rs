//! Solids of every kind that the writers must get right, as given and turned.

#[path = "general.rs"]
mod general;

use gonogo::design::model::{Expr, Extent, Feature, FeatureCopy, Op, Part, PoseExpr, Shape};
use gonogo::diag::{Diagnostic, Span};
use gonogo::solid::{Quality, Solid, evaluate};
use nalgebra::Translation3;
use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

/// A solid with the name of its file.
pub struct Specimen {
    pub name: String,
    pub solid: Arc<Solid>,
}

static SPECIMENS: LazyLock<Vec<Specimen>> = LazyLock::new(make);

/// Every part of the collection, as given and with all operands turned and moved together.
pub fn specimens() -> &'static [Specimen] {
    &SPECIMENS
}

fn make() -> Vec<Specimen> {
    let both = |(name, features): (&'static str, Vec<Feature>)| {
        let turned = moved(&features);
        [(name.to_string(), features), (format!("{name}_turned"), turned)]
    };
    let made = |(name, features): (String, Vec<Feature>)| match evaluated(&name, features) {
        Ok(solid) => Specimen { solid: Arc::new(solid), name },
        Err(faults) => panic!("{name}: {faults:#?}"),
    };
    parts().into_iter().flat_map(both).map(made).collect()
}

fn parts() -> Vec<(&'static str, Vec<Feature>)> {
    [reference(), cones(), spheres(), voids(), rims(), general::parts()].concat()
}

/// The reference parts, whose figures an independent modeller has measured.
pub fn reference() -> Vec<(&'static str, Vec<Feature>)> {
    let plate = vec![
        one("body", Op::Add, cylinder(56.0, 2.0), 0.0),
        one("bore", Op::Cut, cylinder(20.0, 2.0), 0.0),
        ring_of("hole", Op::Cut, &cylinder(4.5, 2.0), 3, 18.0, 0.0),
        ring_of("slot", Op::Cut, &block(4.0, 1.2, 2.0), 60, 25.0, 0.0),
    ];
    let gear = vec![
        one("body", Op::Add, cylinder(50.0, 6.0), 0.0),
        ring_of("tooth", Op::Add, &block(6.0, 3.0, 6.0), 24, 25.0, 0.0),
        ring_of("hole", Op::Cut, &cylinder(6.0, 6.0), 4, 15.0, 0.0),
        one("bore", Op::Cut, cylinder(10.0, 6.0), 0.0),
    ];
    let pin = stack(&[(4.0, 5.0), (6.0, 2.0), (4.0, 8.0), (3.0, 4.0)]);
    let equal = stack(&[(4.0, 5.0), (4.0, 2.0), (6.0, 8.0), (6.0, 4.0)]);
    vec![("plate", plate), ("pin", pin), ("pin_equal", equal), ("gear", gear)]
}

fn stack(sizes: &[(f64, f64)]) -> Vec<Feature> {
    let mut z = 0.0;
    let step = |(d, h): &(f64, f64)| {
        z += h;
        one("step", Op::Add, cylinder(*d, *h), z - h)
    };
    sizes.iter().map(step).collect()
}

fn cones() -> Vec<(&'static str, Vec<Feature>)> {
    let shank = || one("shank", Op::Add, cylinder(10.0, 20.0), 0.0);
    let slab = || one("slab", Op::Add, block(40.0, 20.0, 5.0), 0.0);
    vec![
        ("frustum_tip", vec![shank(), one("tip", Op::Add, cone(10.0, 8.4, 4.0), 20.0)]),
        ("point", vec![shank(), one("tip", Op::Add, cone(10.0, 0.0, 4.0), 20.0)]),
        ("cone", vec![one("cone", Op::Add, cone(10.0, 0.0, 7.0), 0.0)]),
        (
            "double_cone",
            vec![one("up", Op::Add, cone(10.0, 0.0, 7.0), 0.0), one("down", Op::Add, cone(0.0, 10.0, 3.0), -3.0)],
        ),
        (
            "half_cone",
            vec![
                one("cone", Op::Add, cone(10.0, 0.0, 7.0), 0.0),
                feature("half", Op::Keep, vec![(block(10.0, 20.0, 10.0), at(5.0, 0.0, 0.0))]),
            ],
        ),
        (
            "drilled",
            vec![
                slab(),
                one("hole", Op::Cut, cylinder(4.0, 3.0), 2.0),
                one("point", Op::Cut, cone(0.0, 4.0, 1.2), 0.8),
            ],
        ),
        (
            "countersink",
            vec![
                slab(),
                one("hole", Op::Cut, cylinder(4.0, 5.0), 0.0),
                one("sink", Op::Cut, cone(4.0, 10.0, 3.0), 2.0),
            ],
        ),
    ]
}

fn spheres() -> Vec<(&'static str, Vec<Feature>)> {
    let ball = |d: f64| one("ball", Op::Add, sphere(d), 0.0);
    let bar = |name: &str, r: [f64; 3]| feature(name, Op::Cut, vec![(cylinder(3.0, 40.0), lying(r))]);
    vec![
        ("ball", vec![ball(10.0)]),
        ("bead", vec![ball(10.0), one("bore", Op::Cut, cylinder(6.0, 20.0), -10.0)]),
        ("blind_bead", vec![ball(10.0), one("bore", Op::Cut, cylinder(3.0, 20.0), 1.0)]),
        ("die", vec![ball(13.0), one("cube", Op::Keep, block(10.0, 10.0, 10.0), -5.0)]),
        ("cross_bead", vec![ball(20.0), pockets(0.0), bar("bore", [0.0, 0.0, 0.0])]),
        (
            "octant_gone",
            vec![ball(10.0), feature("octant", Op::Cut, vec![(block(10.0, 10.0, 10.0), at(5.0, 5.0, 0.0))])],
        ),
        ("octant", vec![ball(10.0), feature("octant", Op::Keep, vec![(block(10.0, 10.0, 10.0), at(5.0, 5.0, 0.0))])]),
        (
            "half_ball",
            vec![ball(10.0), feature("half", Op::Keep, vec![(block(10.0, 20.0, 20.0), at(5.0, 0.0, -10.0))])],
        ),
        ("dome", vec![one("shank", Op::Add, cylinder(6.0, 10.0), 0.0), one("dome", Op::Add, sphere(6.0), 10.0)]),
        ("snowman", vec![ball(10.0), one("head", Op::Add, sphere(7.0), 6.0)]),
        ("dimple", vec![one("slab", Op::Add, block(9.0, 9.0, 4.0), 0.0), one("dimple", Op::Cut, sphere(5.0), 4.5)]),
    ]
}

/// Blind holes round the equator of a ball, at this height, each along its own radius: only lines and circles.
fn pockets(z: f64) -> Feature {
    let place = |k: usize| {
        let a = TAU * k as f64 / 5.0;
        let pose = PoseExpr { t: [8.0 * a.cos(), 8.0 * a.sin(), z].map(number), r: [0.0, TAU / 4.0, a].map(number) };
        (cylinder(2.0, 9.0), pose)
    };
    feature("pocket", Op::Cut, (0..5).map(place).collect())
}

fn voids() -> Vec<(&'static str, Vec<Feature>)> {
    let body = || one("body", Op::Add, cylinder(30.0, 10.0), 0.0);
    vec![
        ("void", vec![body(), one("void", Op::Cut, cylinder(4.0, 2.0), 4.0)]),
        ("bubble", vec![body(), one("bubble", Op::Cut, sphere(4.0), 5.0)]),
        (
            "two_voids",
            vec![
                body(),
                feature(
                    "void",
                    Op::Cut,
                    vec![(block(4.0, 4.0, 4.0), at(6.0, 0.0, 3.0)), (cone(4.0, 1.0, 4.0), at(-6.0, 0.0, 3.0))],
                ),
            ],
        ),
    ]
}

/// Round faces whose borders have corners, notches and windows: seams must find their way.
fn rims() -> Vec<(&'static str, Vec<Feature>)> {
    let tube = || one("tube", Op::Add, cylinder(30.0, 20.0), 0.0);
    let window = |x: f64, y: f64, z: f64, turn: f64| {
        (block(6.0, 4.0, 5.0), PoseExpr { t: [x, y, z].map(number), r: [0.0, 0.0, turn].map(number) })
    };
    let windows: Vec<_> = (0..9)
        .map(|k| {
            let a = TAU * k as f64 / 9.0;
            window(15.0 * a.cos(), 15.0 * a.sin(), 2.0 + 1.5 * (k % 5) as f64, a)
        })
        .collect();
    let crown: Vec<_> = (0..8)
        .map(|k| {
            let a = TAU * k as f64 / 8.0;
            window(15.0 * a.cos(), 15.0 * a.sin(), 17.0, a)
        })
        .collect();
    // Seven windows in two storeys that overlap all the way round: no meridian passes without crossing one.
    let wall: Vec<_> = (0..14)
        .map(|k| {
            let a = TAU * k as f64 / 14.0;
            (
                block(6.0, 8.0, 5.0),
                PoseExpr {
                    t: [15.0 * a.cos(), 15.0 * a.sin(), 3.0 + 8.0 * (k % 2) as f64].map(number),
                    r: [0.0, 0.0, a].map(number),
                },
            )
        })
        .collect();
    vec![
        ("windows", vec![tube(), feature("window", Op::Cut, windows)]),
        ("crown", vec![tube(), feature("notch", Op::Cut, crown.clone())]),
        ("wall", vec![tube(), feature("window", Op::Cut, wall)]),
        ("ring", vec![tube(), one("bore", Op::Cut, cylinder(20.0, 20.0), 0.0), feature("notch", Op::Cut, crown)]),
        (
            "half_tube",
            vec![
                tube(),
                one("bore", Op::Cut, cylinder(20.0, 20.0), 0.0),
                feature("half", Op::Keep, vec![(block(40.0, 20.0, 20.0), at(0.0, 10.0, 0.0))]),
            ],
        ),
        (
            "slot",
            vec![
                one("slab", Op::Add, block(40.0, 20.0, 5.0), 0.0),
                one("slot", Op::Cut, block(10.0, 6.0, 5.0), 0.0),
                feature("end", Op::Cut, [-5.0, 5.0].map(|x| (cylinder(6.0, 5.0), at(x, 0.0, 0.0))).to_vec()),
            ],
        ),
    ]
}

pub fn part(name: &str, features: Vec<Feature>) -> Part {
    Part { name: name.into(), material: 0, features, span: Span::default() }
}

fn evaluated(name: &str, features: Vec<Feature>) -> Result<Solid, Vec<Diagnostic>> {
    evaluate(&part(name, features), &[], &Quality::default())
}

/// The same features turned and moved together.
fn moved(features: &[Feature]) -> Vec<Feature> {
    let common = Translation3::new(13.0, -7.0, 29.0) * lying([0.7, -0.4, 1.1]).eval(&[]);
    let mut features = features.to_vec();
    for copy in features.iter_mut().flat_map(|f| &mut f.copies) {
        let pose = common * copy.pose.eval(&[]);
        let (rx, ry, rz) = pose.rotation.euler_angles();
        let t = pose.translation.vector;
        copy.pose = PoseExpr { t: [t.x, t.y, t.z].map(number), r: [rx, ry, rz].map(number) };
    }
    features
}

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

fn sphere(d: f64) -> Shape {
    Shape::Sphere { d: number(d) }
}

fn at(x: f64, y: f64, z: f64) -> PoseExpr {
    PoseExpr { t: [x, y, z].map(number), r: [0.0; 3].map(number) }
}

fn lying(r: [f64; 3]) -> PoseExpr {
    posed([0.0; 3], r)
}

fn posed(t: [f64; 3], r: [f64; 3]) -> PoseExpr {
    PoseExpr { t: t.map(number), r: r.map(number) }
}

fn feature(name: &str, op: Op, copies: Vec<(Shape, PoseExpr)>) -> Feature {
    let copies: Vec<FeatureCopy> = copies.into_iter().map(|(shape, pose)| FeatureCopy { shape, pose }).collect();
    Feature { name: name.into(), op, patterned: copies.len() > 1, copies, span: Span::default() }
}

fn one(name: &str, op: Op, shape: Shape, z: f64) -> Feature {
    feature(name, op, vec![(shape, at(0.0, 0.0, z))])
}

/// Copies on a circle, each turned to face outwards.
fn ring_of(name: &str, op: Op, shape: &Shape, count: usize, radius: f64, from: f64) -> Feature {
    let place = |k: usize| {
        let a = from + TAU * k as f64 / count as f64;
        let pose = PoseExpr { t: [radius * a.cos(), radius * a.sin(), 0.0].map(number), r: [0.0, 0.0, a].map(number) };
        (shape.clone(), pose)
    };
    feature(name, op, (0..count).map(place).collect())
}
