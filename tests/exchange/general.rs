//! Solids whose faces meet in any manner: oblique cuts, cross-drilled holes, tori, outlines extruded and turned.

use super::{at, block, cone, cylinder, feature, lying, number, one, posed, sphere};
use gonogo::design::model::{Corner, Extent, Feature, Op, Outline, OutlinePath, OutlineSide, Shape};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

type Parts = Vec<(&'static str, Vec<Feature>)>;

pub fn parts() -> Parts {
    [oblique(), crossed(), tori(), outlines()].concat()
}

fn oblique() -> Parts {
    let rod = || one("rod", Op::Add, cylinder(10.0, 40.0), -20.0);
    let saw = |r: [f64; 3], z: f64| feature("saw", Op::Cut, vec![(block(60.0, 60.0, 60.0), posed([0.0, 0.0, z], r))]);
    let slab = || one("slab", Op::Add, block(40.0, 20.0, 5.0), 0.0);
    let drill = |shape: Shape| feature("drill", Op::Cut, vec![(shape, posed([0.0, 0.0, 2.5], [0.5, 0.2, 0.0]))]);
    let through = Shape::Cylinder { d: number(4.0), h: Extent::Through };
    vec![
        ("mitre", vec![rod(), saw([0.6, 0.0, 0.0], 5.0)]),
        ("chisel", vec![rod(), saw([1.1, 0.0, 0.0], 12.0), saw([-1.1, 0.0, 0.0], 12.0)]),
        ("slanted_hole", vec![slab(), drill(through)]),
        ("cone_mitre", vec![one("cone", Op::Add, cone(10.0, 4.0, 30.0), -15.0), saw([0.4, 0.0, 0.0], 2.0)]),
        ("cone_tip_off", vec![one("cone", Op::Add, cone(10.0, 0.0, 30.0), -15.0), saw([0.4, 0.0, 0.0], 2.0)]),
        (
            "cone_hyperbola",
            vec![
                one("cone", Op::Add, cone(10.0, 2.0, 8.0), 0.0),
                feature("flat", Op::Cut, vec![(block(10.0, 20.0, 20.0), at(7.0, 0.0, -1.0))]),
            ],
        ),
        (
            "nut_chamfer",
            vec![
                one("block", Op::Add, block(10.0, 10.0, 6.0), 0.0),
                one("turned", Op::Keep, cone(16.0, 6.0, 10.0), -2.0),
            ],
        ),
    ]
}

fn crossed() -> Parts {
    let rod =
        |name: &str, d: f64, r: [f64; 3], op: Op| feature(name, op, vec![(cylinder(d, 40.0), posed(start(r), r))]);
    let rolled = [FRAC_PI_2, 0.0, 0.0];
    let leaning = [1.0, 0.3, 0.0];
    let upright = || rod("post", 12.0, [0.0; 3], Op::Add);
    vec![
        ("cross_hole", vec![upright(), rod("hole", 5.0, rolled, Op::Cut)]),
        ("cross_equal", vec![upright(), rod("bar", 12.0, rolled, Op::Add)]),
        (
            "cross_hole_equal",
            vec![
                one("block", Op::Add, block(30.0, 30.0, 30.0), -15.0),
                rod("a", 10.0, [0.0; 3], Op::Cut),
                rod("b", 10.0, rolled, Op::Cut),
            ],
        ),
        ("leaning_hole", vec![upright(), rod("hole", 5.0, leaning, Op::Cut)]),
        (
            "offset_hole",
            vec![upright(), feature("hole", Op::Cut, vec![(cylinder(4.0, 40.0), posed([3.0, 20.0, 0.0], rolled))])],
        ),
        ("steinmetz", vec![upright(), rod("other", 12.0, rolled, Op::Keep)]),
        (
            "ball_hole",
            vec![
                one("ball", Op::Add, sphere(20.0), 0.0),
                feature("hole", Op::Cut, vec![(cylinder(5.0, 40.0), at(4.0, 1.0, -20.0))]),
            ],
        ),
        ("ball_on_post", vec![upright(), feature("ball", Op::Add, vec![(sphere(9.0), at(5.0, 0.0, 3.0))])]),
        ("cone_post", vec![upright(), feature("horn", Op::Add, vec![(cone(6.0, 2.0, 20.0), posed([0.0; 3], rolled))])]),
        (
            "sphere_cone",
            vec![
                one("ball", Op::Add, sphere(20.0), 0.0),
                feature("sink", Op::Cut, vec![(cone(2.0, 8.0, 12.0), posed([3.0, 0.0, 0.0], [0.2, 0.4, 0.0]))]),
            ],
        ),
    ]
}

/// Where a rod of 40 mm begins so that its middle is the origin.
fn start(r: [f64; 3]) -> [f64; 3] {
    let axis = lying(r).eval(&[]).rotation * nalgebra::Vector3::z();
    (axis * -20.0).into()
}

fn torus(d: f64, tube: f64) -> Shape {
    Shape::Torus { d: number(d), tube: number(tube) }
}

fn tori() -> Parts {
    let ring = || one("ring", Op::Add, torus(20.0, 6.0), 0.0);
    let half = |r: [f64; 3]| feature("half", Op::Keep, vec![(block(60.0, 60.0, 60.0), posed([0.0; 3], r))]);
    vec![
        ("torus", vec![ring()]),
        ("torus_half_flat", vec![ring(), half([0.0; 3])]),
        ("torus_half_round", vec![ring(), half([FRAC_PI_2, 0.0, 0.0])]),
        ("torus_quarter", vec![ring(), half([FRAC_PI_2, 0.0, 0.0]), half([0.0, FRAC_PI_2, 0.0])]),
        ("torus_slanted", vec![ring(), half([0.3, 0.2, 0.0])]),
        ("torus_villarceau", vec![ring(), half([(3.0_f64 / 10.0).asin() + 0.05, 0.0, 0.0])]),
        (
            "torus_off_centre",
            vec![ring(), feature("cut", Op::Cut, vec![(block(60.0, 60.0, 60.0), at(0.0, 38.5, -30.0))])],
        ),
        ("torus_hole", vec![ring(), feature("hole", Op::Cut, vec![(cylinder(2.0, 8.0), at(10.0, 0.0, 0.0))])]),
        (
            "torus_drilled",
            vec![
                ring(),
                feature("hole", Op::Cut, vec![(cylinder(2.0, 40.0), posed([0.0, 20.0, 0.0], [FRAC_PI_2, 0.0, 0.0]))]),
            ],
        ),
        (
            "o_ring_groove",
            vec![one("shaft", Op::Add, cylinder(20.0, 20.0), -10.0), one("groove", Op::Cut, torus(20.0, 3.0), 0.0)],
        ),
        (
            "fillet",
            vec![
                one("plate", Op::Add, cylinder(30.0, 4.0), 0.0),
                one("boss", Op::Add, cylinder(14.0, 10.0), 4.0),
                one("foot", Op::Add, cylinder(20.0, 3.0), 4.0),
                one("fillet", Op::Cut, torus(20.0, 6.0), 7.0),
            ],
        ),
        (
            "lemon",
            vec![one(
                "lemon",
                Op::Add,
                Shape::Revolve { outline: outline([0.0, -4.0], &[([0.0, 4.0], Some((6.0, true)))]) },
                0.0,
            )],
        ),
        (
            "lemon_cut",
            vec![
                one(
                    "lemon",
                    Op::Add,
                    Shape::Revolve { outline: outline([0.0, -4.0], &[([0.0, 4.0], Some((6.0, true)))]) },
                    0.0,
                ),
                feature("flat", Op::Cut, vec![(block(20.0, 20.0, 20.0), at(0.0, 11.0, -10.0))]),
            ],
        ),
        (
            "apple_flat",
            vec![
                one("apple", Op::Add, Shape::Revolve { outline: apple() }, 0.0),
                feature("flat", Op::Cut, vec![(block(20.0, 20.0, 20.0), at(0.0, 0.0, 1.5))]),
            ],
        ),
        (
            "apple_sawn",
            vec![
                one("apple", Op::Add, Shape::Revolve { outline: apple() }, 0.0),
                feature("saw", Op::Cut, vec![(block(20.0, 20.0, 20.0), posed([0.0, 0.0, 1.0], [0.2, 0.0, 0.0]))]),
            ],
        ),
        (
            "lemon_dent",
            vec![
                one("block", Op::Add, cylinder(30.0, 10.0), -10.0),
                one(
                    "dent",
                    Op::Cut,
                    Shape::Revolve { outline: outline([0.0, -4.0], &[([0.0, 4.0], Some((6.0, true)))]) },
                    0.0,
                ),
            ],
        ),
    ]
}

/// An arc of more than half a turn about a point off the axis, closed along the axis.
fn apple() -> Outline {
    let mut apple = outline([0.0, -8f64.sqrt()], &[([0.0, 8f64.sqrt()], Some((3.0, true)))]);
    if let OutlinePath::Arc { long, .. } = &mut apple.sides[0].path {
        *long = true;
    }
    apple
}

/// End of a side, and its arc (radius, counter-clockwise) unless it is straight.
type Drawn = ([f64; 2], Option<(f64, bool)>);

/// An outline of straight sides and arcs.
fn outline(start: [f64; 2], sides: &[Drawn]) -> Outline {
    let side = |(i, (to, arc)): (usize, &Drawn)| OutlineSide {
        name: format!("{}", i + 1),
        to: to.map(number),
        path: match arc {
            None => OutlinePath::Line,
            Some((radius, left)) => OutlinePath::Arc { radius: number(*radius), left: *left, long: false },
        },
        corner: Corner::Sharp,
    };
    Outline {
        start: start.map(number),
        start_corner: Corner::Sharp,
        sides: sides.iter().enumerate().map(side).collect(),
    }
}

fn outlines() -> Parts {
    let rail = || {
        outline(
            [0.0, 0.0],
            &[([10.0, 0.0], None), ([10.0, 3.0], None), ([6.0, 7.0], Some((4.0, false))), ([0.0, 7.0], None)],
        )
    };
    let cup = || {
        outline(
            [3.0, 0.0],
            &[
                ([9.0, 0.0], None),
                ([12.0, 3.0], Some((3.0, true))),
                ([12.0, 10.0], None),
                ([10.0, 10.0], None),
                ([5.0, 4.0], None),
                ([3.0, 4.0], None),
            ],
        )
    };
    let prism = |h: f64| Shape::Prism { outline: rail(), h: Extent::Length(number(h)) };
    let turned = || Shape::Revolve { outline: cup() };
    vec![
        ("rail", vec![one("rail", Op::Add, prism(20.0), 0.0)]),
        (
            "rail_mitred",
            vec![
                one("rail", Op::Add, prism(20.0), 0.0),
                feature(
                    "saw",
                    Op::Cut,
                    vec![(block(60.0, 60.0, 60.0), posed([0.0, 0.0, 14.0], [0.3, FRAC_PI_4, 0.0]))],
                ),
            ],
        ),
        ("cup", vec![one("cup", Op::Add, turned(), 0.0)]),
        (
            "cup_drilled",
            vec![
                one("cup", Op::Add, turned(), 0.0),
                feature("hole", Op::Cut, vec![(cylinder(2.0, 20.0), posed([0.0, 0.0, 6.0], [0.0, FRAC_PI_2, 0.0]))]),
            ],
        ),
        (
            "cup_sawn",
            vec![
                one("cup", Op::Add, turned(), 0.0),
                feature("saw", Op::Cut, vec![(block(60.0, 60.0, 60.0), posed([0.0, 0.0, 5.0], [0.25, 0.1, 0.0]))]),
            ],
        ),
        (
            "bullet",
            vec![one(
                "bullet",
                Op::Add,
                Shape::Revolve {
                    outline: outline(
                        [0.0, 0.0],
                        &[([4.0, 0.0], None), ([4.0, 10.0], None), ([0.0, 20.0], Some((14.5, true)))],
                    ),
                },
                0.0,
            )],
        ),
    ]
}
