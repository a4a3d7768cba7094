//! Error modes: the ways in which a component can be wrong, and what the assembly then looks like.
//!
//! In: liaisons, insertion order and solids. Out: per watched component its modes (missing, not seated, misplaced, wrong
//! part), each a motion with a range of sizes, and for a size the pose it leads to. All other components stay
//! where they are, but for loose ones that a misplaced part pushes down, and those that rested on a missing one: they are
//! as often found lower as where they were, because a thread or a tight fit may hold them.

use super::flip::Flip;
use super::insertion::Insertion;
use super::liaison::Liaison;
use super::loose::{askew, loose};
use super::piece;
use super::place::place;
use super::room::Among;
use super::shift::Shift;
use super::sink::{Sink, sink};
use super::tilt::Tilt;
use super::turn::{Turn, Turning, turns};
use crate::design::model::{Design, Expr, Values};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Translation3, Unit, Vector3};
use serde::Serialize;
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
    /// As [`Motion::Remove`], from under others, which may come down.
    RemoveUnder(Sink),
    /// Short of its seat along its removal direction (unit vector) by `from`..`to` mm ([`swept`]).
    Slide {
        direction: [f64; 3],
        from: f64,
        to: f64,
    },
    /// Turned out of its seat, resting on what blocks it, or turned into another seat.
    Turn(Turn),
    /// On its seat beside its place.
    Shift(Shift),
    /// Up at one side.
    Tilt(Tilt),
    /// Upside down.
    Flip(Flip),
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

impl ErrorMode {
    /// What is said of the component in this mode: the kind, or how it lies where the kind leaves that open.
    pub fn said(&self) -> &'static str {
        match self.motion {
            Motion::Tilt(_) => "up at one side",
            Motion::Shift(_) => "beside its place",
            Motion::Flip(_) => "upside down",
            _ => self.kind.word(),
        }
    }

    /// Whether it comes in more than one size.
    pub fn has_size(&self) -> bool {
        matches!(self.motion, Motion::Slide { .. } | Motion::Turn(_) | Motion::Shift(_) | Motion::Tilt(_))
    }

    /// What to hand to [`apply`] to see it at all of `sizes` (0..1), or as far as it goes to every side.
    pub fn looks(&self, sizes: &[f64]) -> Vec<[f64; 3]> {
        let sides = match &self.motion {
            Motion::Shift(shift) => shift.ways.len(),
            Motion::Tilt(tilt) => tilt.sides.len(),
            _ => return sizes.iter().map(|u| [*u, 0.5, 0.5]).collect(),
        };
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        (0..sides).map(|side| [largest, (side as f64 + 0.5) / sides as f64, 0.5]).collect()
    }
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
    /// mm for slides, shifts and tilts, rad for turns, 0 otherwise.
    pub size: f64,
    /// `raised 1.9 mm`.
    pub text: String,
}

/// The smallest error in position that matters (mm).
const SMALLEST: f64 = 0.5;
/// The largest that is looked for (mm): what stands higher is as easy to see.
const LARGEST: f64 = 4.0;
/// A part that fits hold over no more than this (mm) in all may come out of them at one side.
const BARELY: f64 = 1.5;
/// The share of cases in which what rested on a missing part stays where it was.
const STAYS: f64 = 0.5;
/// A part lifted by less than this (mm) lies where it should.
const LYING: f64 = 0.05;
/// A part thicker than a hole by less than this (mm) is taken to enter it.
const TIGHT: f64 = 0.005;

/// The error modes of every watched component, in the design's order. `solids` holds one solid per component at nominal.
pub fn modes(design: &Design, liaison: &Liaison, insertion: &Insertion, solids: &[Arc<Solid>]) -> Vec<ErrorMode> {
    let poses = place(design, &design.nominal());
    let watched = design.inspect.watch.iter().map(|w| w.component).filter(|c| *c != 0);
    let of_one = |component: usize| {
        let slide = slide(liaison, insertion, component).map(|m| (FaultKind::NotSeated, m));
        let zone = turn_zone(design, component);
        let turning = zone.map(|zone| Turning { component, insertion, liaison, solids, poses: &poses, zone });
        let turns = turning.map(|of| turns(&of, SMALLEST)).unwrap_or_default();
        let turns = turns.into_iter().map(|t| (FaultKind::Misplaced, Motion::Turn(t)));
        let remove = sink(component, insertion, liaison, solids, &poses).map_or(Motion::Remove, Motion::RemoveUnder);
        let among = Among { component, insertion, solids, poses: &poses };
        let loose = match held(liaison, insertion, component) {
            Some(length) if length < BARELY => loose(design, &among, SMALLEST),
            // What lies on it holds it down.
            Some(length) if insertion.above[component].is_empty() => askew(&among, SMALLEST, length),
            _ => Vec::new(),
        };
        let motions = [(FaultKind::Missing, remove)].into_iter().chain(slide).chain(turns).chain(loose);
        motions.map(move |(kind, motion)| ErrorMode { component, kind, motion }).collect::<Vec<_>>()
    };
    watched.flat_map(of_one).collect()
}

/// [`modes`] and after them [`wrong_parts`].
pub fn all(design: &Design, liaison: &Liaison, insertion: &Insertion, solids: &[Arc<Solid>]) -> Vec<ErrorMode> {
    let mut all = modes(design, liaison, insertion, solids);
    all.extend(wrong_parts(design, liaison, solids));
    all
}

/// For every watched component the other parts that could stand in its place. Who renders them changes the finish with
/// the solid.
pub fn wrong_parts(design: &Design, liaison: &Liaison, solids: &[Arc<Solid>]) -> Vec<ErrorMode> {
    let watched = design.inspect.watch.iter().map(|w| w.component).filter(|c| *c != 0);
    let nominal = design.nominal();
    let of_one = |component: usize| {
        let motions = swaps(design, &nominal, liaison, solids, component).into_iter();
        motions.map(move |motion| ErrorMode { component, kind: FaultKind::WrongPart, motion })
    };
    watched.flat_map(of_one).collect()
}

/// The fault at a size: `u` in 0..1 picks it within the mode's range (`u[0]` the size; `u[1]` how far loose components give
/// way under a misplaced part, whether what rested on a missing one comes down, and to which side a part is off). `solids` and `poses` hold one entry per component, of the same draw.
pub fn apply(mode: &ErrorMode, u: [f64; 3], solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Faulted {
    let pose = poses[mode.component];
    match &mode.motion {
        Motion::Remove => Faulted { pose: None, ..still(pose, "missing") },
        Motion::RemoveUnder(sink) => {
            let pushed = if u[1] < STAYS { Vec::new() } else { sink.moved(poses) };
            Faulted { pose: None, pushed, ..still(pose, "missing") }
        }
        Motion::Slide { direction, from, to } => {
            let size = swept(*from, *to, u[0]);
            let moved = Translation3::from(Vector3::from(*direction) * size) * pose;
            let word = if direction[2] > 0.7 { "raised" } else { "short of its seat by" };
            Faulted { size, ..still(moved, &format!("{word} {size:.1} mm")) }
        }
        Motion::Turn(turn) => {
            let settled = turn.settle(mode.component, u, solids, poses);
            let turned = format!("turned {:.1} deg", settled.angle.to_degrees());
            let lies = settled.lift < LYING;
            let text = if lies { turned } else { format!("{turned} and lifted {:.1} mm", settled.lift) };
            Faulted { size: settled.angle, pushed: settled.pushed, ..still(settled.pose, &text) }
        }
        Motion::Shift(shift) => {
            let (moved, size) = shift.moved(u, &pose);
            Faulted { size, ..still(moved, &format!("shifted {size:.1} mm")) }
        }
        Motion::Tilt(tilt) => {
            let (moved, size) = tilt.moved(u, &pose);
            Faulted { size, ..still(moved, &format!("tilted, one side {size:.1} mm up")) }
        }
        Motion::Flip(flip) => still(flip.moved(&pose), "upside down"),
        Motion::Replace { by, name } => {
            Faulted { solid: Some(solids[*by].clone()), ..still(pose, &format!("in its place the part of {name}")) }
        }
    }
}

/// The size at a place (0..1) in the sweep of a slide (mm). It grows with the square of the place: a small fault is the harder
/// to see, and a little more of it changes it more.
pub fn swept(from: f64, to: f64, place: f64) -> f64 {
    from + (to - from) * place * place
}

fn still(pose: Isometry3<f64>, text: &str) -> Faulted {
    Faulted { pose: Some(pose), solid: None, pushed: Vec::new(), size: 0.0, text: text.to_string() }
}

/// Half the tolerance of a component's angle about its own axes (rad); `None` if some turn is free: no angle is wrong.
fn turn_zone(design: &Design, component: usize) -> Option<f64> {
    let placed = &design.components[component];
    let half = |turn: &Expr| match turn {
        Expr::Dim(id) => design.dims[id.0 as usize].range.half_width(),
        _ => 0.0,
    };
    let free = placed.free[3..].contains(&true);
    (!free).then(|| placed.pose.r.iter().map(half).fold(0.0, f64::max))
}

/// Short of its seat: for a component that sits in or on others along its removal direction.
fn slide(liaison: &Liaison, insertion: &Insertion, component: usize) -> Option<Motion> {
    let direction = insertion.direction(component);
    let engaged = engaged_length(liaison, component, direction);
    let seated = engaged.is_some() || liaison.rests(component, direction);
    let to = engaged.unwrap_or(LARGEST).clamp(SMALLEST, LARGEST);
    seated.then(|| Motion::Slide { direction: insertion.directions[component], from: SMALLEST, to })
}

/// Over what length along a direction the component is held sideways (mm); `None` if nowhere.
fn engaged_length(liaison: &Liaison, component: usize, direction: Unit<Vector3<f64>>) -> Option<f64> {
    let mut spans: Vec<[f64; 2]> = liaison.of(component).filter_map(|c| c.sideways_span(direction)).collect();
    spans.sort_by(|p, q| p[0].total_cmp(&q[0]));
    let (mut total, mut end) = (0.0, f64::NEG_INFINITY);
    for [low, high] in &spans {
        total += (high - low.max(end)).max(0.0);
        end = end.max(*high);
    }
    (!spans.is_empty()).then_some(total)
}

/// Over what length fits hold a component sideways (mm) that rests on others; `None` if it does not.
fn held(liaison: &Liaison, insertion: &Insertion, component: usize) -> Option<f64> {
    let direction = insertion.direction(component);
    liaison.rests(component, direction).then(|| engaged_length(liaison, component, direction).unwrap_or(0.0))
}

/// Components whose part could stand in this one's place: another part, held by the same neighbours in the same way, and
/// no thicker than the holes here. Another piece of the same part is as right as this one.
fn swaps(design: &Design, nominal: &Values, liaison: &Liaison, solids: &[Arc<Solid>], component: usize) -> Vec<Motion> {
    let part = |c: usize| design.components[c].part;
    let own = &design.parts[part(component)];
    let mut parts = vec![part(component)];
    let mut found = Vec::new();
    for other in 1..liaison.components {
        let alike = seat(liaison, component) == seat(liaison, other) && !seat(liaison, other).is_empty();
        let another = || !parts.contains(&part(other)) && !piece::alike(own, &design.parts[part(other)], nominal);
        if alike && another() && enters(liaison, solids, other, component) {
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
    matches!((thickness(guest), thickness(host)), (Some(g), Some(h)) if g <= h + TIGHT)
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
        // On top, and guided by the pins over 2 mm only.
        assert_eq!(kinds(&modes, WHEEL_A2), [Missing, NotSeated, Misplaced, NotSeated]);
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

    /// The design has an entry for every piece of a part: two equal pins are two parts there.
    #[test]
    fn pieces_of_one_part_are_not_wrong_in_each_others_place() {
        let pinned = |second: f64| {
            let mut shop = sample::Shop::default();
            let holes = [-6.0, 6.0].map(|x| sample::Cut::hole("hole", x, 0.0, 4.0, 0.012));
            let plate = shop.plate("plate", [5.0, 0.0], [30.0, 0.0], &holes);
            let pins = [4.0, second].map(|d| shop.pin("pin", &[("shank", d, d, [-0.012, -0.004], 10.0)]));
            shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
            shop.place("pin[1]", pins[0], [-6.0, 0.0, 0.0], 0.0, 0.0);
            shop.place("pin[2]", pins[1], [6.0, 0.0, 0.0], 0.0, 0.0);
            let a = shop.finish();
            let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
            wrong_parts(&a.design, &liaison, &a.solids).len()
        };
        assert_eq!(pinned(4.0), 0);
        assert!(pinned(3.998) > 0, "a pin that is not the same is another part");
    }

    #[test]
    fn a_raised_pin_goes_up_by_what_it_says() {
        let (a, _, modes) = wheel();
        let poses = place(&a.design, &a.design.nominal());
        let mode = modes.iter().find(|m| m.component == 8 && m.kind == FaultKind::NotSeated).expect("hd_pin");
        let faulted = apply(mode, [0.5, 0.0, 0.0], &a.solids, &poses);
        let up = faulted.pose.expect("still there").translation.vector - poses[8].translation.vector;
        assert!((up - Vector3::z() * 1.375).norm() < 1e-9);
        assert!((faulted.size - 1.375).abs() < 1e-9);
        assert_eq!(faulted.text, "raised 1.4 mm");
    }

    #[test]
    fn a_misplaced_wheel_says_how_it_lies() {
        let (a, _, modes) = wheel();
        let misplaced = |m: &&ErrorMode| m.kind == FaultKind::Misplaced && m.component == WHEEL_A2;
        let mode = modes.iter().find(misplaced).expect("wheel_a2");
        let faulted = apply(mode, [1.0, 1.0, 0.0], &a.solids, &place(&a.design, &a.design.nominal()));
        assert_eq!(faulted.text, "turned 40.0 deg and lifted 2.6 mm");
        assert!((faulted.size.to_degrees() - 40.0).abs() < 1e-6);
    }
}
