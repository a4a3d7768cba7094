//! Contacts of the sample assemblies, their areas in closed form, and their fits.

use super::*;
use crate::assembly::sample;
use crate::design::model::{Expr, Extent, Op, Shape};

#[test]
fn limits_decide_the_fit() {
    assert_eq!(fit([0.004, 0.024]), Fit::Clearance);
    assert_eq!(fit([-0.004, 0.012]), Fit::Transition);
    assert_eq!(fit([-0.02, -0.004]), Fit::Interference);
}

#[test]
fn a_pin_in_a_hole_touches_by_its_side_over_the_plate_thickness() {
    let a = sample::pattern_wheel();
    let contacts = contacts(&a.design, &a.solids);
    let c = contacts.iter().find(|c| (c.a.component, c.b.component) == (3, 8)).expect("hd_pin in wheel_a1");
    assert_eq!((c.kind, c.fit), (ContactKind::Cylinder, Some(Fit::Clearance)));
    let exact = std::f64::consts::PI * 2.5 * 2.0;
    assert!((c.area / exact - 1.0).abs() < 1e-3, "{} {exact}", c.area);
    assert!((c.gap_range[0] - 0.003).abs() < 1e-9 && (c.gap_range[1] - 0.020).abs() < 1e-9, "{:?}", c.gap_range);
    assert!((c.span[0] - 12.0).abs() < 1e-9 && (c.span[1] - 14.0).abs() < 1e-9, "{:?}", c.span);
}

#[test]
fn plates_a_little_apart_touch_only_within_their_zones() {
    for (z, zone, expected) in [(2.0, 0.0, 1), (2.05, 0.0, 0), (2.05, 0.06, 1), (1.95, 0.06, 1)] {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
        shop.place("lower", plate, [0.0; 3], 0.0, 0.0);
        shop.place("upper", plate, [5.0, 0.0, z], zone, 0.0);
        let a = shop.finish();
        assert_eq!(contacts(&a.design, &a.solids).len(), expected, "{z} {zone}");
    }
}

/// A pin of 6 -0.02/-0.01 in a hole of 6 +0.01/0, moved by up to 0.003 and 0.004 across: half of the least clearance
/// of 0.01 less 0.005.
#[test]
fn zones_across_an_axis_add_up_in_their_corner() {
    let mut shop = sample::Shop::default();
    let plate = shop.plate("plate", [5.0, 0.0], [20.0, 0.0], &[sample::Cut::hole("hole", 0.0, 0.0, 6.0, 0.01)]);
    let pin = shop.pin("pin", &[("shank", 6.0, 6.0, [-0.02, -0.01], 10.0)]);
    shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
    let placed = shop.place("pin", pin, [0.0, 0.0, -1.0], 0.0, 0.0);
    shop.vary(placed, 0, 0.003);
    shop.vary(placed, 1, 0.004);
    let a = shop.finish();
    let found = contacts(&a.design, &a.solids);
    assert_eq!((found.len(), found[0].fit), (1, Some(Fit::Clearance)));
    assert!((found[0].play[0] - (0.005 - 0.005)).abs() < 1e-9, "{:?}", found[0].play);
    assert!((found[0].play[1] - 0.015).abs() < 1e-9, "{:?}", found[0].play);
}

/// A lean of rx about the foot moves the far end of a hole 5 thick by 5 sin rx more than the near one.
#[test]
fn a_lean_counts_where_it_moves_most() {
    let mut shop = sample::Shop::default();
    let plate = shop.plate("plate", [5.0, 0.0], [20.0, 0.0], &[sample::Cut::hole("hole", 0.0, 0.0, 6.1, 0.0)]);
    let pin = shop.pin("pin", &[("shank", 6.0, 6.0, [0.0; 2], 10.0)]);
    shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
    let placed = shop.place("pin", pin, [0.0, 0.0, -1.0], 0.0, 0.0);
    shop.vary(placed, 3, 0.002);
    let a = shop.finish();
    let found = contacts(&a.design, &a.solids);
    let exact = 0.05 - 6.0 * 0.002f64.tan();
    assert!((found[0].play[0] - exact).abs() < 1e-6, "{:?} {exact}", found[0].play);
}

/// A stack of two plates of 2 ±0.1 under a third placed at 4 ±0.05.
#[test]
fn heights_add_up_between_planes() {
    let mut shop = sample::Shop::default();
    let lower = shop.plate("lower", [4.0, 0.2], [20.0, 0.0], &[]);
    let upper = shop.plate("upper", [2.0, 0.1], [20.0, 0.0], &[]);
    shop.place("lower", lower, [0.0; 3], 0.0, 0.0);
    let placed = shop.place("upper", upper, [5.0, 0.0, 4.0], 0.05, 0.0);
    let flat = shop.components[placed].clone();
    shop.vary(placed, 4, 0.001);
    let mut a = shop.finish();
    // Tilted about y by 0.001 the plate's rim, 10 mm off its middle, sinks by 0.01; the plates share it up to x = 10.
    let tilted = contacts(&a.design, &a.solids)[0].play;
    a.design.components[placed] = flat;
    let level = contacts(&a.design, &a.solids)[0].play;
    assert!((level[0] + 0.25).abs() < 1e-9 && (level[1] - 0.25).abs() < 1e-9, "{level:?}");
    assert!((tilted[0] + 0.26).abs() < 2e-3, "{tilted:?}");
}

fn cone(d1: f64, d2: f64, h: f64) -> Shape {
    let [d1, d2, h] = [d1, d2, h].map(Expr::Const);
    Shape::Cone { d1, d2, h: Extent::Length(h) }
}

fn cylinder(d: f64, h: f64) -> Shape {
    Shape::Cylinder { d: Expr::Const(d), h: Extent::Length(Expr::Const(h)) }
}

fn pair(first: Vec<(&str, Op, Shape, [f64; 3])>, second: Vec<(&str, Op, Shape, [f64; 3])>, at: [f64; 3]) -> Found {
    let mut shop = sample::Shop::default();
    let parts = [shop.made_of("first", first), shop.made_of("second", second)];
    shop.place("first", parts[0], [0.0; 3], 0.0, 0.0);
    shop.place("second", parts[1], at, 0.0, 0.0);
    let a = shop.finish();
    find(&a.design, &a.solids)
}

/// A plug in a countersink of 4 to 10 over 3: the flank's area is π (r + R) s.
#[test]
fn a_plug_seats_in_its_cone() {
    let seat =
        vec![("block", Op::Add, cylinder(20.0, 3.0), [0.0; 3]), ("sink", Op::Cut, cone(4.0, 10.0, 3.0), [0.0; 3])];
    let plug = vec![("plug", Op::Add, cone(4.0, 10.0, 3.0), [0.0; 3])];
    let found = pair(seat, plug, [0.0; 3]);
    let seat = found.contacts.iter().find(|c| c.kind == ContactKind::Cone).expect("the flanks touch");
    let exact = std::f64::consts::PI * 7.0 * 18f64.sqrt();
    assert!((seat.area / exact - 1.0).abs() < 2e-3, "{} {exact}", seat.area);
    assert!(seat.gap.abs() < 1e-9 && !seat.full, "{seat:?}");
    assert!(seat.stops(1, -Vector3::z_axis()) && !seat.stops(1, Vector3::z_axis()));
    assert!(seat.stops(1, Vector3::x_axis()), "round the whole turn");
}

/// A ball of 8 in a socket of 8.04, its lower half: 2πR² shared.
#[test]
fn a_ball_sits_in_its_socket() {
    let sphere = |d: f64| Shape::Sphere { d: Expr::Const(d) };
    let socket =
        vec![("block", Op::Add, cylinder(20.0, 6.0), [0.0; 3]), ("socket", Op::Cut, sphere(8.04), [0.0, 0.0, 6.0])];
    let found = pair(socket, vec![("ball", Op::Add, sphere(8.0), [0.0; 3])], [0.0, 0.0, 6.0]);
    let contact = &found.contacts[0];
    assert_eq!((contact.kind, contact.fit), (ContactKind::Sphere, Some(Fit::Clearance)));
    assert!((contact.gap - 0.04).abs() < 1e-9 && (contact.play[0] - 0.02).abs() < 1e-9, "{contact:?}");
    let exact = std::f64::consts::TAU * 4.02f64.powi(2);
    assert!((contact.area / exact - 1.0).abs() < 0.01, "{} {exact}", contact.area);
}

/// A ball of 6 in a cone of half angle 45 degrees touches it round a circle; on a plate in a point.
#[test]
fn balls_touch_in_points_and_circles() {
    let ball = || vec![("ball", Op::Add, Shape::Sphere { d: Expr::Const(6.0) }, [0.0; 3])];
    let plate = vec![("block", Op::Add, cylinder(20.0, 6.0), [0.0; 3])];
    let on_plate = pair(plate, ball(), [2.0, 1.0, 9.0]);
    assert_eq!((on_plate.contacts.len(), on_plate.tangents.len()), (0, 1));
    let touch = &on_plate.tangents[0];
    assert!((touch.point - Point3::new(2.0, 1.0, 6.0)).norm() < 1e-9 && touch.direction.z > 0.999);
    let sink =
        vec![("block", Op::Add, cylinder(20.0, 6.0), [0.0; 3]), ("sink", Op::Cut, cone(0.0, 12.0, 6.0), [0.0; 3])];
    let in_cone = pair(sink, ball(), [0.0, 0.0, 3.0 * 2f64.sqrt()]);
    assert_eq!((in_cone.contacts.len(), in_cone.tangents.len()), (0, 1));
    assert!((in_cone.tangents[0].point.z - 3.0 / 2f64.sqrt()).abs() < 1e-9, "{:?}", in_cone.tangents);
    assert!(pair(vec![("block", Op::Add, cylinder(20.0, 6.0), [0.0; 3])], ball(), [2.0, 1.0, 9.1]).tangents.is_empty());
}
