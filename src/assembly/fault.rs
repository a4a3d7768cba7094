//! Error modes: the ways in which a component can be wrong, and what the assembly then looks like.
//!
//! In: liaisons, insertion order and solids. Out: per watched component its modes (missing, not seated, misplaced, wrong
//! part), each a motion with a range of sizes, and for a size the pose it leads to. Follows DESIGN section 4. All other
//! components stay where they are, but for loose ones that a misplaced part pushes down.

use super::contact::{Contact, ContactKind};
use super::insertion::Insertion;
use super::liaison::Liaison;
use super::place::place;
use super::rest::Bed;
use crate::design::model::Design;
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum FaultKind {
    Missing,
    NotSeated,
    Misplaced,
    WrongPart,
}

impl FaultKind {
    /// The word in findings and reports.
    pub fn word(self) -> &'static str {
        match self {
            FaultKind::Missing => "missing",
            FaultKind::NotSeated => "not seated",
            FaultKind::Misplaced => "misplaced",
            FaultKind::WrongPart => "wrong part",
        }
    }
}

/// What a fault does to its component.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Motion {
    Remove,
    /// Short of its seat along its removal direction (unit vector) by `from`..`to` mm.
    Slide {
        direction: [f64; 3],
        from: f64,
        to: f64,
    },
    /// Turned about an axis (point in mm and unit vector in the assembly's frame) by an angle in one of the ranges (rad),
    /// resting on what blocks it. `firm` lists the components that bear it; the others can be pushed down.
    Turn {
        point: [f64; 3],
        direction: [f64; 3],
        ranges: Vec<[f64; 2]>,
        firm: Vec<usize>,
    },
    /// The part of another component, with that component's name.
    Replace {
        by: usize,
        name: String,
    },
}

/// One way in which one component can be wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorMode {
    /// Index into [`Design::components`].
    pub component: usize,
    pub kind: FaultKind,
    pub motion: Motion,
}

/// A component after a fault of a certain size.
#[derive(Debug, Clone)]
pub struct Faulted {
    /// Its pose in the assembly's frame; `None` when it is missing.
    pub pose: Option<Isometry3<f64>>,
    /// The solid that stands in its place, if it is another.
    pub solid: Option<Arc<Solid>>,
    /// Loose components pushed down: index and new pose.
    pub pushed: Vec<(usize, Isometry3<f64>)>,
    /// mm for slides, rad for turns, 0 otherwise.
    pub size: f64,
    /// `raised 1.9 mm`.
    pub text: String,
}

/// The smallest error in position that matters (mm).
const SMALLEST: f64 = 0.8;
/// The largest that is looked for (mm): what stands higher is as easy to see.
const LARGEST: f64 = 4.0;
/// Turns are looked for up to this angle (rad), or half the period of the holes if that is less.
const WIDEST_TURN: f64 = 40.0 * TAU / 360.0;
/// Turns are tried in steps of this (rad), and the first that lifts the part is found to within a sixteenth of it.
const TURN_STEP: f64 = 4.0 * TAU / 360.0;
/// Side of a cell (mm) in the search for turns and in the pose a turn leads to.
const COARSE: f64 = 0.4;
const FINE: f64 = 0.2;
/// Holes closer to the turn axis than this (mm) do not stop a turn.
const ON_AXIS: f64 = 0.5;
/// Directions that differ by less than this sine are parallel.
const PARALLEL: f64 = 1e-3;

/// The error modes of every watched component, in the design's order. `solids` holds one solid per component at nominal.
pub fn modes(design: &Design, liaison: &Liaison, insertion: &Insertion, solids: &[Arc<Solid>]) -> Vec<ErrorMode> {
    let poses = place(design, &design.nominal());
    let watched = design.inspect.watch.iter().map(|w| w.component).filter(|c| *c != 0);
    let of_one = |component: usize| {
        let slide = slide(liaison, insertion, component).map(|m| (FaultKind::NotSeated, m));
        let turn = turn(liaison, insertion, component, solids, &poses).map(|m| (FaultKind::Misplaced, m));
        let motions = [(FaultKind::Missing, Motion::Remove)].into_iter().chain(slide).chain(turn);
        motions.map(move |(kind, motion)| ErrorMode { component, kind, motion }).collect::<Vec<_>>()
    };
    watched.flat_map(of_one).collect()
}

/// For every watched component the other parts that could stand in its place. Apart from [`modes`]: who renders them has
/// to change the solid and its material, and they are the least likely of errors.
pub fn wrong_parts(design: &Design, liaison: &Liaison, solids: &[Arc<Solid>]) -> Vec<ErrorMode> {
    let watched = design.inspect.watch.iter().map(|w| w.component).filter(|c| *c != 0);
    let of_one = |component: usize| {
        let motions = swaps(design, liaison, solids, component).into_iter();
        motions.map(move |motion| ErrorMode { component, kind: FaultKind::WrongPart, motion })
    };
    watched.flat_map(of_one).collect()
}

/// Components that a mode neither moves nor hides: what the assembly can be located by while the fault is sought.
pub fn datum(liaison: &Liaison, mode: &ErrorMode) -> Vec<usize> {
    let hidden = match mode.kind {
        FaultKind::Misplaced => liaison.neighbours(mode.component),
        _ => Vec::new(),
    };
    (0..liaison.components).filter(|c| *c != mode.component && !hidden.contains(c)).collect()
}

/// The fault at a size: `u` in 0..1 picks it within the mode's range (`u[0]` the size; `u[1]` how far loose components give
/// way under a misplaced part). `solids` and `poses` hold one entry per component, of the same draw.
pub fn apply(mode: &ErrorMode, u: [f64; 3], solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Faulted {
    let pose = poses[mode.component];
    match &mode.motion {
        Motion::Remove => Faulted { pose: None, ..still(pose, "missing") },
        Motion::Slide { direction, from, to } => {
            let size = from + (to - from) * u[0];
            let moved = Translation3::from(Vector3::from(*direction) * size) * pose;
            let word = if direction[2] > 0.7 { "raised" } else { "short of its seat by" };
            Faulted { size, ..still(moved, &format!("{word} {size:.1} mm")) }
        }
        Motion::Turn { .. } => turned(mode, u, solids, poses),
        Motion::Replace { by, name } => {
            Faulted { solid: Some(solids[*by].clone()), ..still(pose, &format!("in its place the part of {name}")) }
        }
    }
}

fn still(pose: Isometry3<f64>, text: &str) -> Faulted {
    Faulted { pose: Some(pose), solid: None, pushed: Vec::new(), size: 0.0, text: text.to_string() }
}

/// Short of its seat: for a component that sits in or on others along its removal direction.
fn slide(liaison: &Liaison, insertion: &Insertion, component: usize) -> Option<Motion> {
    let direction = insertion.direction(component);
    let engaged = engaged_length(liaison, component, direction);
    let seated = engaged.is_some() || rests(liaison, component, direction);
    let to = engaged.unwrap_or(LARGEST).clamp(SMALLEST, LARGEST);
    seated.then(|| Motion::Slide { direction: insertion.directions[component], from: SMALLEST, to })
}

/// Over what length along a direction the component is held sideways (mm); `None` if nowhere.
fn engaged_length(liaison: &Liaison, component: usize, direction: Unit<Vector3<f64>>) -> Option<f64> {
    let mut spans: Vec<[f64; 2]> = liaison.of(component).filter_map(|c| sideways_span(c, direction)).collect();
    spans.sort_by(|p, q| p[0].total_cmp(&q[0]));
    let (mut total, mut end) = (0.0, f64::NEG_INFINITY);
    for [low, high] in &spans {
        total += (high - low.max(end)).max(0.0);
        end = end.max(*high);
    }
    (!spans.is_empty()).then_some(total)
}

fn sideways_span(contact: &Contact, direction: Unit<Vector3<f64>>) -> Option<[f64; 2]> {
    let parallel = contact.kind == ContactKind::Cylinder && contact.direction.cross(&direction).norm() < PARALLEL;
    let [low, high] = contact.span;
    parallel.then(|| if contact.direction.dot(&direction) > 0.0 { [low, high] } else { [-high, -low] })
}

/// Whether a component stands on another, seen along its removal direction.
fn rests(liaison: &Liaison, component: usize, direction: Unit<Vector3<f64>>) -> bool {
    liaison.of(component).filter(|c| c.kind != ContactKind::Cylinder).any(|c| {
        let outward = if c.a.component == component { c.direction } else { -c.direction };
        c.kind != ContactKind::Plane || outward.dot(&direction) < -PARALLEL
    })
}

/// Turned out of its seat: for a component held against turning by pins, with nothing above it.
fn turn(
    liaison: &Liaison,
    insertion: &Insertion,
    component: usize,
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
) -> Option<Motion> {
    let direction = insertion.direction(component);
    let axis = turn_axis(&solids[component], &poses[component], direction);
    let seats = seats(liaison, component, &axis);
    if seats.is_empty() || !insertion.is_free(component) {
        return None;
    }
    let stands = |c: &usize| *c == 0 || rests(liaison, *c, direction);
    let firm: Vec<usize> = (0..liaison.components).filter(|c| *c != component).filter(stands).collect();
    let bed = bed(component, &axis, COARSE, &firm, solids, poses);
    let lifted = |angle: f64| {
        let landing = bed.set_down(&solids[component].mesh, &(axis.turn(angle) * poses[component]));
        landing.lie(false).is_some_and(|l| l.height >= SMALLEST)
    };
    let widest = WIDEST_TURN.min(period(&seats) / 2.0);
    let ranges: Vec<[f64; 2]> = [-1.0, 1.0].iter().filter_map(|sign| turn_range(*sign, widest, &lifted)).collect();
    let (point, direction) = (axis.point.coords.into(), axis.direction.into_inner().into());
    (!ranges.is_empty()).then_some(Motion::Turn { point, direction, ranges, firm })
}

/// An axis in the assembly's frame.
#[derive(Debug, Clone, Copy)]
struct Axis {
    point: Point3<f64>,
    direction: Unit<Vector3<f64>>,
}

impl Axis {
    fn turn(&self, angle: f64) -> Isometry3<f64> {
        let to_axis = Translation3::from(self.point.coords);
        to_axis * UnitQuaternion::from_axis_angle(&self.direction, angle) * to_axis.inverse()
    }

    /// From the axis to a point, square to it.
    fn offset(&self, p: &Point3<f64>) -> Vector3<f64> {
        let r = p - self.point;
        r - self.direction.into_inner() * r.dot(&self.direction)
    }
}

/// The axis a component is likely to be turned about: that of its largest cylinder along the direction, else the
/// direction through the centre of its vertices.
fn turn_axis(solid: &Solid, pose: &Isometry3<f64>, direction: Unit<Vector3<f64>>) -> Axis {
    let cylinders = solid.faces.iter().filter_map(|f| match &solid.surfaces[f.surface] {
        Surface::Cylinder { point, axis, radius } => Some((pose * point, pose.rotation * axis.into_inner(), *radius)),
        _ => None,
    });
    let along = cylinders.filter(|(_, axis, _)| axis.cross(&direction).norm() < PARALLEL);
    let largest = along.max_by(|a, b| a.2.total_cmp(&b.2)).map(|(point, ..)| point);
    let sum: Vector3<f64> = solid.mesh.positions.iter().map(|p| p.coords).sum();
    let centre = pose * Point3::from(sum / solid.mesh.positions.len().max(1) as f64);
    Axis { point: largest.unwrap_or(centre), direction }
}

/// The contacts that stop a component from turning about an axis: where they stand round it.
fn seats(liaison: &Liaison, component: usize, axis: &Axis) -> Vec<Vector3<f64>> {
    let along = liaison.of(component).filter(|c| sideways_span(c, axis.direction).is_some());
    along.map(|c| axis.offset(&c.point)).filter(|o| o.norm() > ON_AXIS).collect()
}

/// The smallest turn that maps the seats on themselves (rad); a whole turn if there is none.
fn period(seats: &[Vector3<f64>]) -> f64 {
    let maps = |turn: &UnitQuaternion<f64>| seats.iter().all(|s| seats.iter().any(|t| (turn * s - t).norm() < ON_AXIS));
    let turns = seats[1..].iter().filter_map(|s| UnitQuaternion::rotation_between(&seats[0], s));
    turns.filter(maps).map(|t| t.angle()).filter(|a| *a > PARALLEL).fold(TAU, f64::min)
}

fn bed(
    component: usize,
    axis: &Axis,
    cell: f64,
    firm: &[usize],
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
) -> Bed {
    let positions = solids[component].mesh.positions.iter();
    let radius = positions.map(|p| axis.offset(&(poses[component] * p)).norm()).fold(0.0, f64::max);
    let others: Vec<(usize, bool)> =
        (0..solids.len()).filter(|c| *c != component).map(|c| (c, firm.contains(&c))).collect();
    let frame = super::columns::Frame::along(axis.direction);
    let [u, v, _] = frame.coordinates(&axis.point);
    Bed::new(axis.direction, [u, v], radius, cell, &others, solids, poses)
}

/// The turns of one sign that lift the part, from the first on (rad, low to high).
fn turn_range(sign: f64, widest: f64, lifted: &dyn Fn(f64) -> bool) -> Option<[f64; 2]> {
    let steps = (widest / TURN_STEP + 1e-6).floor() as usize;
    let first = (1..=steps).find(|k| lifted(sign * TURN_STEP * *k as f64))?;
    let last = (first + 1..=steps).take_while(|k| lifted(sign * TURN_STEP * *k as f64)).last().unwrap_or(first);
    let (mut low, mut high) = (TURN_STEP * (first - 1) as f64, TURN_STEP * first as f64);
    for _ in 0..4 {
        let middle = (low + high) / 2.0;
        if lifted(sign * middle) { high = middle } else { low = middle }
    }
    let end = TURN_STEP * last as f64;
    Some(if sign > 0.0 { [high, end] } else { [-end, -high] })
}

fn turned(mode: &ErrorMode, u: [f64; 3], solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Faulted {
    let Motion::Turn { point, direction, ranges, firm } = &mode.motion else {
        return still(poses[mode.component], "");
    };
    let axis = Axis { point: Point3::from(*point), direction: Unit::new_normalize(Vector3::from(*direction)) };
    let angle = pick(ranges, u[0]);
    let pose = axis.turn(angle) * poses[mode.component];
    let bed = bed(mode.component, &axis, FINE, firm, solids, poses);
    let landing = bed.set_down(&solids[mode.component].mesh, &pose);
    let on_all = landing.lie(false);
    let on_firm = landing.lie(true);
    let (Some(from), Some(to)) = (on_all.or(on_firm), on_firm.or(on_all)) else {
        return Faulted { size: angle, ..still(pose, &format!("turned {:.1} deg", angle.to_degrees())) };
    };
    let lie = from.towards(&to, u[1]);
    let down = |(c, depth): (usize, f64)| (c, Translation3::from(axis.direction.into_inner() * -depth) * poses[c]);
    let text = format!("turned {:.1} deg and lifted {:.1} mm", angle.to_degrees(), lie.height);
    let pushed = landing.pushed(&lie).into_iter().map(down).collect();
    Faulted { size: angle, pushed, ..still(lie.motion(&bed.frame, landing.level) * pose, &text) }
}

/// The value at a share of the ranges laid end to end.
fn pick(ranges: &[[f64; 2]], u: f64) -> f64 {
    let total: f64 = ranges.iter().map(|r| r[1] - r[0]).sum();
    let mut rest = u.clamp(0.0, 1.0) * total;
    for [low, high] in ranges {
        if rest <= high - low {
            return low + rest;
        }
        rest -= high - low;
    }
    ranges.last().map_or(0.0, |r| r[1])
}

/// Components whose part could stand in this one's place: another part, held by the same neighbours in the same way, and
/// no thicker than the holes here.
fn swaps(design: &Design, liaison: &Liaison, solids: &[Arc<Solid>], component: usize) -> Vec<Motion> {
    let part = |c: usize| design.components[c].part;
    let mut parts = vec![part(component)];
    let mut found = Vec::new();
    for other in 1..liaison.components {
        let alike = seat(liaison, component) == seat(liaison, other) && !seat(liaison, other).is_empty();
        if alike && !parts.contains(&part(other)) && enters(liaison, solids, other, component) {
            parts.push(part(other));
            found.push(Motion::Replace { by: other, name: design.components[other].name.clone() });
        }
    }
    found
}

/// Whom a component touches and how, with how many surfaces.
fn seat(liaison: &Liaison, component: usize) -> Vec<(usize, u8)> {
    let mut seat: Vec<(usize, u8)> = liaison.of(component).map(|c| (c.other(component), c.kind as u8)).collect();
    seat.sort_unstable();
    seat
}

/// Whether one component's round surfaces are no thicker than the holes in which another sits.
fn enters(liaison: &Liaison, solids: &[Arc<Solid>], guest: usize, host: usize) -> bool {
    let thickness = |component: usize| -> Option<f64> {
        let faces = liaison.surfaces(component).into_iter().map(|f| &solids[component].faces[f.face]);
        let radii = faces.filter_map(|f| match &solids[component].surfaces[f.surface] {
            Surface::Cylinder { radius, .. } if f.outward => Some(*radius),
            _ => None,
        });
        radii.reduce(f64::max)
    };
    matches!((thickness(guest), thickness(host)), (Some(g), Some(h)) if g <= h + ON_AXIS / 100.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{contact::contacts, insertion::insertion, sample};

    const WHEEL_A2: usize = 4;

    fn wheel() -> (sample::Assembly, Liaison, Vec<ErrorMode>) {
        let a = sample::pattern_wheel();
        let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
        let order = insertion(&a.design, &a.solids, &liaison);
        let modes = modes(&a.design, &liaison, &order, &a.solids);
        (a, liaison, modes)
    }

    fn kinds(modes: &[ErrorMode], component: usize) -> Vec<FaultKind> {
        modes.iter().filter(|m| m.component == component).map(|m| m.kind).collect()
    }

    #[test]
    fn every_part_can_be_missing_and_pins_can_stand_high() {
        let (_, _, modes) = wheel();
        use FaultKind::{Misplaced, Missing, NotSeated};
        assert_eq!(kinds(&modes, 1), [Missing, NotSeated]);
        assert_eq!(kinds(&modes, 3), [Missing, NotSeated]);
        assert_eq!(kinds(&modes, WHEEL_A2), [Missing, NotSeated, Misplaced]);
        assert_eq!(kinds(&modes, 5), [Missing, NotSeated]);
        assert_eq!(kinds(&modes, 8), [Missing, NotSeated]);
        assert_eq!(kinds(&modes, 9), [Missing, NotSeated]);
        let slide = |c: usize| modes.iter().find(|m| m.component == c && m.kind == NotSeated).map(|m| &m.motion);
        assert!(matches!(slide(8), Some(Motion::Slide { to, .. }) if (to - 4.0).abs() < 1e-9));
        assert!(matches!(slide(WHEEL_A2), Some(Motion::Slide { to, .. }) if (to - 2.0).abs() < 1e-9));
    }

    #[test]
    fn the_thinner_pin_fits_where_the_thicker_one_belongs() {
        let (a, liaison, _) = wheel();
        let found = wrong_parts(&a.design, &liaison, &a.solids);
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].component, 9);
        assert_eq!(found[0].motion, Motion::Replace { by: 8, name: "hd_pin".into() });
    }

    #[test]
    fn a_raised_pin_goes_up_by_what_it_says() {
        let (a, _, modes) = wheel();
        let poses = place(&a.design, &a.design.nominal());
        let mode = modes.iter().find(|m| m.component == 8 && m.kind == FaultKind::NotSeated).expect("hd_pin");
        let faulted = apply(mode, [0.5, 0.0, 0.0], &a.solids, &poses);
        let up = faulted.pose.expect("still there").translation.vector - poses[8].translation.vector;
        assert!((up - Vector3::z() * 2.4).norm() < 1e-9);
        assert!((faulted.size - 2.4).abs() < 1e-9);
        assert_eq!(faulted.text, "raised 2.4 mm");
    }

    fn turned_by(a: &sample::Assembly, mode: &ErrorMode, degrees: f64, give: f64) -> Faulted {
        let Motion::Turn { point, direction, firm, .. } = mode.motion.clone() else { panic!("not a turn") };
        let ranges = vec![[degrees.to_radians(); 2]];
        let mode = ErrorMode { motion: Motion::Turn { point, direction, ranges, firm }, ..*mode };
        apply(&mode, [0.5, give, 0.0], &a.solids, &place(&a.design, &a.design.nominal()))
    }

    /// The alignment pins end at z = 20.6, hd_pin at 21.5, unlatch_pin at 23; the wheel's underside is at 18.
    #[test]
    fn a_turned_wheel_lies_on_the_pins() {
        let (a, _, modes) = wheel();
        let mode = modes.iter().find(|m| m.kind == FaultKind::Misplaced).expect("wheel_a2");
        for degrees in [28.0, -17.0] {
            let on_all = turned_by(&a, mode, degrees, 0.0);
            let pose = on_all.pose.expect("still there");
            let lift = (pose * Point3::origin()).z - 18.0;
            let tilt = (pose.rotation * Vector3::z()).angle(&Vector3::z()).to_degrees();
            assert!((3.4..3.9).contains(&lift), "lift {lift}");
            assert!((1.0..6.0).contains(&tilt), "tilt {tilt}");
            let clear = |z: f64, x: f64, y: f64| {
                let local = pose.inverse() * Point3::new(x, y, z);
                local.z < 0.06
            };
            assert!(clear(20.6, 0.0, 18.0) && clear(23.0, -23.5 * 0.75f64.sqrt(), 11.75), "{degrees}");
            assert!(on_all.pushed.iter().all(|(_, p)| p.translation.z > 10.9));

            let on_firm = turned_by(&a, mode, degrees, 1.0);
            let pose = on_firm.pose.expect("still there");
            assert!(((pose * Point3::origin()).z - 20.6).abs() < 1e-6);
            assert_eq!(on_firm.pushed.iter().map(|(c, _)| *c).collect::<Vec<_>>(), [8, 9]);
            assert!((on_firm.pushed[1].1.translation.z - (11.0 - 2.4)).abs() < 1e-6);
        }
    }

    #[test]
    fn turns_start_where_the_holes_no_longer_pass() {
        let (_, _, modes) = wheel();
        let mode = modes.iter().find(|m| m.kind == FaultKind::Misplaced).expect("wheel_a2");
        let Motion::Turn { ranges, firm, .. } = &mode.motion else { panic!("not a turn") };
        assert_eq!(firm, &[0, 2, 3, 5, 6, 7]);
        for range in ranges {
            let [near, far] = if range[0] > 0.0 { *range } else { [-range[1], -range[0]] };
            assert!(near.to_degrees() < 4.0 && (far.to_degrees() - 40.0).abs() < 1e-6, "{near} {far}");
        }
    }

    #[test]
    fn a_turned_wheel_is_no_datum_and_neither_are_its_pins() {
        let (_, liaison, modes) = wheel();
        let mode = modes.iter().find(|m| m.kind == FaultKind::Misplaced).expect("wheel_a2");
        assert_eq!(datum(&liaison, mode), [0, 1, 2, 3]);
    }
}
