//! Positions whose curves are ellipses or have no formula, tori, prisms, revolves and groups, against closed forms.

use super::*;
use crate::design::model::{Corner, Outline, OutlinePath, OutlineSide};

fn at(shape: Shape, t: [f64; 3], r: [f64; 3]) -> (Shape, PoseExpr) {
    (shape, PoseExpr { t: t.map(number), r: r.map(number) })
}

fn torus(d: f64, tube: f64) -> Shape {
    Shape::Torus { d: number(d), tube: number(tube) }
}

type Drawn<'a> = (&'a str, [f64; 2], Option<(f64, bool)>);

fn outline(start: [f64; 2], sides: &[Drawn]) -> Outline {
    let side = |(name, to, arc): &Drawn| OutlineSide {
        name: name.to_string(),
        to: to.map(number),
        path: match arc {
            None => OutlinePath::Line,
            Some((r, left)) => OutlinePath::Arc { radius: number(*r), left: *left, long: false },
        },
        corner: Corner::Sharp,
    };
    Outline { start: start.map(number), start_corner: Corner::Sharp, sides: sides.iter().map(side).collect() }
}

/// The part as given and turned; volume and area must agree, and the volume be as expected.
fn both(features: &[Feature], volume: f64) -> Solid {
    let given = solid(features.to_vec());
    let turned = solid(moved(features));
    assert!((given.volume - volume).abs() < 1e-6 * volume.max(1.0), "{} {volume}", given.volume);
    assert!((given.volume - turned.volume).abs() < 1e-6 * volume.max(1.0), "{} {}", given.volume, turned.volume);
    assert!((given.area - turned.area).abs() < 1e-6 * given.area, "{} {}", given.area, turned.area);
    assert_eq!(given.counts(), turned.counts());
    given
}

#[test]
fn an_oblique_hole_through_a_slab() {
    let tilt: f64 = 0.4;
    let features = vec![
        one("slab", Op::Add, block(40.0, 30.0, 5.0), 0.0),
        feature("drill", Op::Cut, vec![at(through(cylinder(6.0, 0.0)), [0.0; 3], [tilt, 0.0, 0.0])]),
    ];
    let s = both(&features, 40.0 * 30.0 * 5.0 - PI * 9.0 * 5.0 / tilt.cos());
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().edges), (6, 1, 14));
    assert!(s.edges.iter().filter(|e| matches!(e.curve, Curve::Ellipse { .. })).count() == 2);
}

#[test]
fn pipes_of_one_bore_cross() {
    // Steinmetz: two crossed cylinders of radius r share 16 r³ / 3.
    let features = vec![
        one("post", Op::Add, cylinder(6.0, 20.0), -10.0),
        feature("beam", Op::Add, vec![at(cylinder(6.0, 20.0), [-10.0, 0.0, 0.0], [0.0, PI / 2.0, 0.0])]),
    ];
    let s = both(&features, 2.0 * PI * 9.0 * 20.0 - 16.0 / 3.0 * 27.0);
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().corners), (4, 4, 2));
    let kept = vec![features[0].clone(), Feature { op: Op::Keep, ..features[1].clone() }];
    let s = both(&kept, 16.0 / 3.0 * 27.0);
    assert!((s.area - 16.0 * 9.0).abs() < 1e-6, "{}", s.area);
}

#[test]
fn a_thin_hole_across_a_bar() {
    let features = vec![
        one("bar", Op::Add, cylinder(10.0, 30.0), -15.0),
        feature("hole", Op::Cut, vec![at(through(cylinder(4.0, 0.0)), [0.0; 3], [PI / 2.0, 0.0, 0.0])]),
    ];
    // Volume common to crossed cylinders of radii 5 and 2: 8 ∫₀² √(25 - x²) √(4 - x²) dx.
    let n = 20_000;
    let slice = |k: usize| {
        let a = (k as f64 + 0.5) / n as f64 * PI / 2.0;
        let x = 2.0 * a.sin();
        (25.0 - x * x).sqrt() * 4.0 * a.cos() * a.cos() * (PI / 2.0 / n as f64)
    };
    let common: f64 = 8.0 * (0..n).map(slice).sum::<f64>();
    let s = both(&features, PI * 25.0 * 30.0 - common);
    assert_eq!((s.counts().cylinders, s.counts().edges), (2, 4));
    assert!(s.edges.iter().filter(|e| matches!(e.curve, Curve::Spline { .. })).count() == 2);
}

#[test]
fn splines_keep_to_both_surfaces() {
    let features = vec![
        one("cone", Op::Add, cone(20.0, 4.0, 20.0), 0.0),
        feature("hole", Op::Cut, vec![at(through(cylinder(4.0, 0.0)), [1.0, 0.5, 8.0], [1.2, 0.3, 0.0])]),
    ];
    let s = solid(features);
    for edge in &s.edges {
        let Curve::Spline { points, tangents } = &edge.curve else { continue };
        for i in 0..points.len() - 1 {
            for k in 0..=10 {
                let t = f64::from(k) / 10.0;
                let (t2, t3) = (t * t, t * t * t);
                let p = points[i].coords * (2.0 * t3 - 3.0 * t2 + 1.0)
                    + points[i + 1].coords * (3.0 * t2 - 2.0 * t3)
                    + tangents[i] * (t3 - 2.0 * t2 + t)
                    + tangents[i + 1] * (t3 - t2);
                for face in edge.faces {
                    assert!(s.surface(face).distance(&Point3::from(p)).abs() < 1e-4);
                }
            }
        }
    }
}

#[test]
fn rings_have_the_volume_of_pappus() {
    let s = both(&[one("ring", Op::Add, torus(20.0, 4.0), 0.0)], TAU * 10.0 * PI * 4.0);
    assert!((s.area - TAU * 10.0 * TAU * 2.0).abs() < 1e-9, "{}", s.area);
    // A quarter pipe bend between two straight pipes of the same bore.
    let bend = vec![
        one("bend", Op::Add, torus(20.0, 4.0), 0.0),
        feature("quarter", Op::Keep, vec![at(block(20.0, 20.0, 20.0), [10.0, 10.0, -10.0], [0.0; 3])]),
    ];
    let quarter = TAU * 10.0 * PI * 4.0 / 4.0;
    let s = both(&bend, quarter);
    assert_eq!((s.counts().planes, s.counts().tori), (2, 1));
    let mut pipe = bend;
    pipe.push(feature("leg", Op::Add, vec![at(cylinder(4.0, 7.0), [10.0, 0.0, 0.0], [PI / 2.0, 0.0, 0.0])]));
    let s = both(&pipe, quarter + PI * 4.0 * 7.0);
    assert_eq!((s.counts().planes, s.counts().tori, s.counts().cylinders), (2, 1, 1));
}

#[test]
fn a_ring_groove_and_a_drilled_ring() {
    let groove = vec![one("pin", Op::Add, cylinder(20.0, 30.0), 0.0), one("groove", Op::Cut, torus(20.0, 4.0), 15.0)];
    // The inner half of the ring: Pappus with the centroid of a half disc.
    let inner = PI * 2.0 * TAU * (10.0 - 8.0 / (3.0 * PI));
    let s = both(&groove, PI * 100.0 * 30.0 - inner);
    assert_eq!((s.counts().tori, s.counts().cylinders, s.counts().edges), (1, 2, 4));
    let drilled = vec![
        one("ring", Op::Add, torus(20.0, 8.0), 0.0),
        feature("hole", Op::Cut, vec![at(cylinder(2.0, 30.0), [10.0, 1.0, -15.0], [0.0; 3])]),
    ];
    let s = solid(drilled.clone());
    let turned = solid(moved(&drilled));
    assert!((s.volume - turned.volume).abs() < 1e-6 && s.counts().tori == 1);
    let whole = TAU * 10.0 * PI * 16.0;
    assert!(s.volume < whole - 20.0 && s.volume > whole - PI * 8.0, "{}", s.volume);
}

#[test]
fn prisms_and_revolves_have_closed_forms() {
    let slot = outline(
        [0.0, 0.0],
        &[
            ("low", [6.0, 0.0], None),
            ("nose", [6.0, 2.0], Some((1.0, true))),
            ("high", [0.0, 2.0], None),
            ("tail", [0.0, 0.0], Some((1.0, true))),
        ],
    );
    let rail = vec![one("rail", Op::Add, Shape::Prism { outline: slot, h: length(3.0) }, 0.0)];
    let s = both(&rail, (12.0 + PI) * 3.0);
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().edges), (4, 2, 12));
    assert!(["rail.low", "rail.nose", "rail.top", "rail.bottom"].iter().all(|n| s.faces.iter().any(|f| f.name == *n)));
    // A V-shaped wall with a pocket in its outline.
    let vee = outline([0.0, 0.0], &[[4.0, 0.0], [4.0, 6.0], [2.0, 2.0], [0.0, 6.0]].map(|p| ("v", p, None)));
    let s = both(&[one("vee", Op::Add, Shape::Prism { outline: vee, h: length(2.0) }, 0.0)], 2.0 * (24.0 - 8.0));
    assert_eq!(s.counts().planes, 7);
    // A domed knob on a stem with a fillet between.
    let knob = outline(
        [0.0, 0.0],
        &[
            ("foot", [3.0, 0.0], None),
            ("stem", [3.0, 5.0], None),
            ("neck", [4.0, 6.0], Some((1.0, false))),
            ("flat", [6.0, 6.0], None),
            ("dome", [0.0, 12.0], Some((6.0, true))),
        ],
    );
    let fillet = TAU * ((1.0 - PI / 4.0) * 3.0) + TAU * (1.0 / 2.0 - (PI / 4.0 - 1.0 / 3.0));
    let s = both(
        &[one("knob", Op::Add, Shape::Revolve { outline: knob }, 0.0)],
        PI * 9.0 * 6.0 + PI * 6.0 * 36.0 / 3.0 * 2.0 + fillet,
    );
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().spheres, s.counts().tori), (2, 1, 1, 1));
    // A barrel: its profile is centred beyond the axis.
    let barrel = outline(
        [0.0, -3.0],
        &[("low", [4.0, -3.0], None), ("crown", [4.0, 3.0], Some((5.0, true))), ("high", [0.0, 3.0], None)],
    );
    let exact = PI * (2.0 * (25.0 * 3.0 - 9.0));
    both(&[one("barrel", Op::Add, Shape::Revolve { outline: barrel }, 0.0)], exact);
}

#[test]
fn holes_may_leave_no_straight_seam() {
    let window = |k: usize| {
        let a = TAU * k as f64 / 14.0;
        at(
            block(6.0, 8.0, 5.0),
            [15.0 * a.cos(), 15.0 * a.sin(), if k.is_multiple_of(2) { 3.0 } else { 11.0 }],
            [0.0, 0.0, a],
        )
    };
    let tube = vec![
        one("tube", Op::Add, cylinder(30.0, 20.0), 0.0),
        feature("window", Op::Cut, (0..14).map(window).collect()),
    ];
    let turned = solid(moved(&tube));
    assert!((solid(tube).volume - turned.volume).abs() < 1e-6);
    let die = vec![one("ball", Op::Add, ball(13.0), 0.0), one("die", Op::Keep, block(10.0, 10.0, 10.0), -5.0)];
    let cap = PI * 1.5 * 1.5 / 3.0 * (3.0 * 6.5 - 1.5);
    let s = both(&die, PI * 13.0f64.powi(3) / 6.0 - 6.0 * cap);
    assert_eq!((s.counts().planes, s.counts().spheres), (6, 1));
}

#[test]
fn rims_may_touch_edges_in_a_point() {
    let boss =
        vec![one("slab", Op::Add, block(20.0, 16.0, 10.0), 0.0), one("boss", Op::Add, cylinder(16.0, 3.0), 10.0)];
    let s = both(&boss, 3200.0 + PI * 64.0 * 3.0);
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().edges, s.counts().corners), (8, 1, 17, 10));
    let stack = vec![
        feature("low", Op::Add, vec![at(cylinder(16.0, 5.0), [-5.0, 0.0, 5.0], [0.0; 3])]),
        one("high", Op::Add, cylinder(6.0, 3.0), 10.0),
    ];
    let s = both(&stack, PI * 64.0 * 5.0 + PI * 9.0 * 3.0);
    assert_eq!((s.counts().planes, s.counts().cylinders, s.counts().edges, s.counts().corners), (3, 2, 4, 1));
    let half = vec![
        one("cone", Op::Add, cone(10.0, 0.0, 7.0), 0.0),
        feature("half", Op::Keep, vec![at(block(10.0, 20.0, 10.0), [5.0, 0.0, 0.0], [0.0; 3])]),
    ];
    both(&half, PI * 25.0 * 7.0 / 6.0);
}

#[test]
fn groups_are_folded_by_themselves() {
    let boss = vec![one("post", Op::Add, cylinder(6.0, 8.0), 0.0), one("bore", Op::Cut, cylinder(3.0, 8.0), 0.0)];
    let group = Shape::Group { features: boss };
    let features = vec![
        one("slab", Op::Add, block(40.0, 20.0, 4.0), 0.0),
        feature("boss", Op::Add, [-10.0, 10.0].map(|x| at(group.clone(), [x, 0.0, 0.0], [0.0; 3])).to_vec()),
    ];
    // The bore is the group's own: the slab fills it up to its top.
    let s = both(&features, 3200.0 + 2.0 * (PI * 9.0 * 4.0 - PI * 2.25 * 4.0));
    assert!(s.faces.iter().any(|f| f.name == "boss[2].bore.side"));
    let mut ring = Feature { op: Op::Cut, ..features[1].clone() };
    ring.copies.iter_mut().for_each(|c| c.pose.t[2] = number(2.0));
    let s = both(&[features[0].clone(), ring], 3200.0 - 2.0 * PI * (9.0 - 2.25) * 2.0);
    assert_eq!((s.counts().planes, s.counts().cylinders), (10, 4));
}

#[test]
fn curves_cross_where_surfaces_touch() {
    // A cylinder that touches a sphere from inside (Viviani), and a cross hole that touches the bore.
    let viviani = vec![
        feature("pin", Op::Add, vec![at(cylinder(6.0, 4.0), [-1.0, 0.0, 0.0], [0.0; 3])]),
        feature("ball", Op::Add, vec![at(ball(8.0), [-1.0, 1.0, 1.0], [0.0; 3])]),
    ];
    both(&viviani, 274.5863865931568);
    let bores = vec![
        one("bar", Op::Add, cylinder(16.0, 20.0), 0.0),
        one("bore", Op::Cut, through(cylinder(10.0, 0.0)), 0.0),
        feature("cross", Op::Cut, vec![at(cylinder(6.0, 12.0), [0.0, 2.0, 10.0], [0.0, PI / 2.0, 0.0])]),
    ];
    let (given, turned) = (solid(bores.clone()), solid(moved(&bores)));
    assert!((given.volume / turned.volume - 1.0).abs() < 1e-7, "{} {}", given.volume, turned.volume);
}

#[test]
fn a_torus_may_be_drilled_all_round() {
    let hole = |k: usize| {
        let a = TAU * k as f64 / 4.0;
        at(through(cylinder(3.0, 0.0)), [10.0 * a.cos(), 10.0 * a.sin(), 0.0], [0.0; 3])
    };
    let ring = vec![one("ring", Op::Add, torus(20.0, 4.0), 0.0), feature("hole", Op::Cut, (0..4).map(hole).collect())];
    let s = both(&ring, 685.107177806);
    assert_eq!((s.counts().tori, s.counts().cylinders, s.counts().edges), (1, 4, 8));
    // A lemon, whole, and a cylinder rounded down to its axis.
    let lemon = outline([0.0, -12.0], &[("peel", [0.0, 12.0], Some((18.0, true)))]);
    let centre = 180.0f64.sqrt();
    let lens = |z: f64| ((324.0 - z * z).sqrt() - centre).powi(2);
    let exact = PI * (0..60_000).map(|k| lens(-12.0 + (f64::from(k) + 0.5) / 2500.0) / 2500.0).sum::<f64>();
    both(&[one("lemon", Op::Add, Shape::Revolve { outline: lemon }, 0.0)], exact);
    let dimple = outline(
        [0.0, 0.0],
        &[
            ("foot", [2.0, 0.0], None),
            ("side", [2.0, 2.0], None),
            ("top", [0.5, 2.0], None),
            ("dip", [0.0, 1.5], Some((0.5, true))),
        ],
    );
    let dip = TAU * (0.0625 - (PI / 16.0 * 0.5 - 0.125 / 3.0));
    // Its triangles are no test: no chord follows a surface that runs into its axis without an angle.
    let dimple = part(vec![one("dimple", Op::Add, Shape::Revolve { outline: dimple }, 0.0)]);
    let s = evaluate(&dimple, &[], &Quality::default()).unwrap();
    assert!((s.volume - 8.0 * PI + dip).abs() < 1e-9, "{} {}", s.volume, 8.0 * PI - dip);
}

#[test]
fn grooves_and_bores_that_meet_have_the_figures_of_open_cascade() {
    let across = |d: f64, h: f64, t: [f64; 3]| at(cylinder(d, h), t, [0.0, PI / 2.0, 0.0]);
    let ball = one("ball", Op::Add, ball(16.0), 0.0);
    let cases = [
        (
            vec![
                ball.clone(),
                one("groove", Op::Cut, torus(14.0, 5.0), 3.0),
                feature("bore", Op::Cut, vec![across(3.0, 40.0, [0.0; 3])]),
            ],
            1664.8405234,
            (1, 1, 2, 1),
        ),
        (
            vec![
                ball.clone(),
                one("groove", Op::Cut, torus(16.0, 5.0), 0.0),
                ring_of("hole", Op::Cut, &through(cylinder(2.0, 0.0)), 4, 6.0, 0.0),
            ],
            1650.70087,
            (0, 4, 2, 1),
        ),
        (
            vec![
                one("ring", Op::Add, torus(20.0, 4.0), 0.0),
                feature(
                    "half",
                    Op::Cut,
                    vec![at(block(40.0, 40.0, 40.0), [2.0, 0.0, 1.0], [20f64.to_radians(), 0.0, 0.0])],
                ),
                ring_of("slot", Op::Cut, &block(8.0, 2.0, 4.0), 3, 10.0, 0.0),
            ],
            448.153326766,
            (9, 0, 0, 1),
        ),
        (
            vec![
                one("block", Op::Add, block(20.0, 20.0, 10.0), 0.0),
                feature("point", Op::Cut, vec![at(cone(0.0, 4.0, 4.0), [10.0, 0.0, 6.0], [0.0; 3])]),
            ],
            4000.0 - PI * 8.0 / 3.0,
            (6, 0, 0, 0),
        ),
    ];
    for (features, volume, expected) in cases {
        let c = both(&features, volume).counts();
        assert_eq!((c.planes, c.cylinders, c.spheres, c.tori), expected);
    }
}

#[test]
fn bores_that_touch_from_inside_have_the_figures_of_open_cascade() {
    let x = |d: f64, h: f64, t: [f64; 3]| at(cylinder(d, h), t, [0.0, PI / 2.0, 0.0]);
    let touching = vec![
        one("bar", Op::Add, cylinder(20.0, 16.0), 0.0),
        one("bore", Op::Cut, cylinder(10.0, 16.0), 0.0),
        feature("across", Op::Cut, vec![at(through(cylinder(4.0, 0.0)), [3.0, 0.0, 5.0], [0.0, PI / 2.0, 0.0])]),
        feature("aside", Op::Cut, vec![at(cylinder(4.0, 10.0), [3.0, 2.0, 8.0], [PI / 2.0, 0.0, 0.0])]),
        feature("along", Op::Cut, vec![at(through(cylinder(4.0, 0.0)), [0.0, 2.0, 4.0], [0.0; 3])]),
    ];
    let c = both(&touching, 3589.38451119).counts();
    assert_eq!((c.planes, c.cylinders, c.edges, c.corners), (4, 6, 14, 3));
    let rings = vec![
        one("disc", Op::Add, cylinder(16.0, 4.0), -2.0),
        one("rim", Op::Add, torus(16.0, 4.0), 0.0),
        one("groove", Op::Cut, torus(16.0, 2.0), -2.0),
        ring_of("hole", Op::Cut, &through(cylinder(2.0, 0.0)), 4, 8.0, 0.0),
    ];
    let c = both(&rings, 1040.06556511).counts();
    assert_eq!((c.planes, c.cylinders, c.tori, c.edges, c.corners), (2, 4, 5, 32, 20));
    let halved = vec![
        one("ball", Op::Add, ball(16.0), 0.0),
        one("groove", Op::Cut, torus(12.0, 5.0), 3.0),
        feature("half", Op::Cut, vec![at(block(40.0, 40.0, 40.0), [0.0, 20.0, -20.0], [0.0; 3])]),
        feature("bore", Op::Cut, vec![x(3.0, 40.0, [0.0, 0.0, 4.0])]),
    ];
    let c = both(&halved, 786.469354866).counts();
    assert_eq!((c.planes, c.cylinders, c.spheres, c.tori), (2, 1, 2, 1));
}

#[test]
fn planes_may_touch_a_torus_and_faces_may_not_touch_along_a_circle() {
    // The keeping box touches the ring in one point on either side.
    let half = vec![
        one("ring", Op::Add, torus(24.0, 6.0), 0.0),
        feature("half", Op::Keep, vec![at(block(30.0, 30.0, 40.0), [15.0, 0.0, -20.0], [0.0; 3])]),
    ];
    both(&half, TAU * 12.0 * PI * 9.0 / 2.0);
    let necked = vec![
        one("ball", Op::Add, ball(16.0), 0.0),
        one("groove", Op::Cut, torus(16.0, 4.0), 0.0),
        one("bore", Op::Cut, through(cylinder(12.0, 0.0)), 0.0),
    ];
    assert_eq!(faults(necked.clone()), ["E0407"]);
    assert_eq!(faults(moved(&necked)), ["E0407"]);
    let skin =
        vec![one("slab", Op::Add, block(10.0, 10.0, 5.0), 0.0), one("slot", Op::Cut, block(4.0, 10.000002, 2.0), 3.0)];
    assert_eq!(faults(skin), ["E0406"]);
}

#[test]
fn a_lens_and_a_far_wedge_are_exact_wherever_they_stand() {
    let quarter = PI / 2.0;
    let lens = vec![
        feature("ring", Op::Add, vec![at(torus(8.0, 2.0), [2.0, -1.0, 0.0], [0.0, quarter, 0.0])]),
        feature("point", Op::Keep, vec![at(cone(0.0, 6.0, 1.0), [2.0, -2.0, 0.0], [0.0, quarter, 0.0])]),
    ];
    // So thin that its triangles, coarse as they are, hold much less; but they close.
    for lens in [lens.clone(), moved(&lens)] {
        let s = evaluate(&part(lens), &[], &Quality::default()).unwrap();
        assert!((s.volume - 0.04666325).abs() < 1e-7, "{}", s.volume);
        assert_eq!((s.counts().tori, s.counts().cones, s.counts().edges), (1, 1, 1));
    }
    let sides = [("1", [1.0, 0.0], None), ("2", [1.0, 2.0], Some((2.0, true))), ("3", [-1.0, 2.0], None)];
    let mut tongue = outline([-1.0, 0.0], &sides);
    tongue.sides[2].corner = Corner::Round(number(0.5));
    let wedge = vec![
        feature("cone", Op::Add, vec![at(cone(4.0, 10.0, 2.0), [1.0, 3.0, 1.0], [0.0; 3])]),
        feature(
            "tongue",
            Op::Keep,
            vec![at(Shape::Prism { outline: tongue, h: length(3.0) }, [2.0, -3.0, 0.0], [0.0; 3])],
        ),
    ];
    let [given, turned] = [wedge.clone(), moved(&wedge)].map(|f| evaluate(&part(f), &[], &Quality::default()).unwrap());
    assert!((given.volume / turned.volume - 1.0).abs() < 1e-7, "{} {}", given.volume, turned.volume);
    // The flat side is cut off by a hyperbola, z = 1 + (√((x - 1)² + 16) - 2) / 1.5.
    let root = |u: f64| u / 2.0 * (u * u + 16.0).sqrt() + 8.0 * (u / 4.0).asinh();
    let exact = 3.0 - (root(2.0) - root(0.5) - 3.0) / 1.5;
    for s in [given, turned] {
        let flat = s.faces.iter().find(|f| f.name == "tongue.3").expect("the side is there");
        assert!((flat.area - exact).abs() < 1e-6, "{} {exact}", flat.area);
    }
}
