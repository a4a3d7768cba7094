//! A part put in at the wrong angle.
//!
//! In: a component whose angle matters, the solids, the removal order. Out: the turns that keep it from its seat, those at
//! which it finds another one and looks different, and, for a turn and a draw of the assembly, where it then lies.
//! Components that stand on nothing firm (pins held by their sides alone) may be pushed down by it; the others stay.
//! Decided by setting the turned part down on the solids, so a part held by loose pegs is as good as one held by a fit.

use super::columns::Frame;
use super::insertion::Insertion;
use super::liaison::Liaison;
use super::rest::{Bed, Landing, Lie};
use super::room::{Among, Room};
use crate::solid::{Face, Solid, Surface};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Serialize;
use std::cell::OnceCell;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The turns by which a component can be misplaced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Turn {
    /// A point of the axis (mm, assembly's frame).
    pub point: [f64; 3],
    /// The axis, towards where the component is removed.
    pub direction: [f64; 3],
    /// Angles (rad), low to high.
    pub ranges: Vec<[f64; 2]>,
    /// Components that bear it; the others give way.
    pub firm: Vec<usize>,
    /// Components that hold it down: it lies under them.
    pub above: Vec<usize>,
    /// At these angles it finds another seat; else it lies on what it meets.
    pub seated: bool,
}

/// Where a turned component lies.
pub(crate) struct Settled {
    pub pose: Isometry3<f64>,
    /// Components pushed down, with their new poses.
    pub pushed: Vec<(usize, Isometry3<f64>)>,
    /// rad.
    pub angle: f64,
    /// At its centre of mass (mm).
    pub lift: f64,
}

/// Turns out of the seat are looked for up to this angle (rad).
const WIDEST: f64 = 40.0 * TAU / 360.0;
/// Turns are tried in steps of this (rad), and the first that lifts the part is found to within a sixteenth of it.
const STEP: f64 = 4.0 * TAU / 360.0;
/// Side of a cell (mm) in the search for turns and in the pose a turn leads to.
const COARSE: f64 = 0.4;
const FINE: f64 = 0.2;
/// Patterns repeat after a whole turn divided by one of these: there a part may find another seat.
const REPEATS: [u32; 6] = [2, 3, 4, 5, 6, 8];
/// A part that lies lower than this over its seat (mm) is in it.
const IN_SEAT: f64 = 0.1;
/// A turned part looks different where its surface is higher or lower by more than this (mm).
const DIFFERENT: f64 = 0.3;
/// A part that nothing keeps from turning this far is tried at multiples of this angle (rad), and one that has less room at
/// those of the smaller angle; beyond this many times the half width of its tolerance.
const PLAIN: f64 = 5.0 * TAU / 360.0;
const SLIGHT: f64 = TAU / 360.0;
const PLAIN_ZONES: f64 = 3.0;
/// Directions that differ by less than this sine are parallel.
const PARALLEL: f64 = 1e-3;
/// Axes nearer to each other than this (mm) are one.
const SAME_AXIS: f64 = 0.05;
/// The axis of a part lies within this share of the part's reach from its middle.
const CENTRAL: f64 = 0.25;
/// A part is round about a cylinder of more than this share of its reach, or within this share of the middle of its box.
const ROUND: f64 = 0.5;
const CENTRED: f64 = 0.02;
/// Axes tried of a part that is not round.
const MOST_AXES: usize = 3;

/// Whose turns are asked for, and among what.
pub(crate) struct Turning<'a> {
    pub component: usize,
    pub insertion: &'a Insertion,
    pub liaison: &'a Liaison,
    /// One per component, at nominal.
    pub solids: &'a [Arc<Solid>],
    pub poses: &'a [Isometry3<f64>],
    /// Half width of the tolerance of its angle (rad).
    pub zone: f64,
}

impl<'a> Turning<'a> {
    fn among(&self) -> Among<'a> {
        let Turning { component, insertion, solids, poses, .. } = *self;
        Among { component, insertion, solids, poses }
    }

    fn middle(&self) -> Point3<f64> {
        self.poses[self.component] * box_middle(&self.solids[self.component].mesh.positions)
    }
}

/// The turns that lift a component by `least` mm or more, and those at which it finds another seat and looks different.
/// A part that others hold down is not lifted: its error would show as theirs.
pub(crate) fn turns(of: &Turning, least: f64) -> Vec<Turn> {
    let direction = of.insertion.direction(of.component);
    let axes = Axis::candidates(&of.solids[of.component], &of.poses[of.component], direction);
    let trials: Vec<Trial> = axes.iter().map(|axis| Trial::new(of, *axis)).collect();
    let free = of.insertion.is_free(of.component);
    let lifted = trials.iter().filter(|_| free).find_map(|t| t.turn(t.lifted(least), false));
    // Held down or not: what lies as low as it should and clears what stands above may be turned.
    let unstopped = lifted.is_none();
    let loose = || trials.iter().filter(|_| unstopped);
    let wide = loose().find_map(|t| t.turn(t.plain(PLAIN, PLAIN, WIDEST), false));
    let slight = || loose().find_map(|t| t.turn(t.plain(SLIGHT, least / t.reach(), PLAIN), false));
    let plain = wide.or_else(slight);
    // What turns freely finds no other seat: it has them all.
    let stopped = plain.as_ref().is_none_or(|t| t.ranges.iter().flatten().all(|a| a.abs() < WIDEST - SLIGHT));
    let seated = trials.iter().filter(|_| stopped).find_map(|t| t.turn(t.seats(), true));
    lifted.into_iter().chain(plain).chain(seated).collect()
}

/// A component turned about one axis.
struct Trial<'a> {
    of: &'a Turning<'a>,
    axis: Axis,
    firm: Vec<usize>,
    bed: Bed,
    room: OnceCell<Room<'a>>,
}

impl<'a> Trial<'a> {
    fn new(of: &'a Turning<'a>, axis: Axis) -> Self {
        let stands = |c: &usize| *c == 0 || of.liaison.rests(*c, axis.direction);
        let firm: Vec<usize> = (0..of.liaison.components).filter(|c| *c != of.component).filter(stands).collect();
        let below: Vec<usize> =
            (0..of.solids.len()).filter(|c| !of.insertion.above[of.component].contains(c)).collect();
        let bed = axis.bed(of.component, COARSE, &below, &firm, of.solids, of.poses);
        Trial { of, axis, firm, bed, room: OnceCell::new() }
    }

    fn landing(&self, angle: f64) -> Landing<'_> {
        self.bed.set_down(&self.of.solids[self.of.component].mesh, &self.pose(angle))
    }

    /// Lift over its seat (mm); `None` where it would slide off.
    fn lift(&self, angle: f64) -> Option<f64> {
        self.landing(angle).lie(false).map(|l| l.height)
    }

    fn lifted(&self, least: f64) -> Vec<[f64; 2]> {
        let lifted = |angle: f64| self.lift(angle).is_some_and(|h| h >= least);
        [-1.0, 1.0].iter().filter_map(|sign| range(*sign, &lifted)).collect()
    }

    /// Whether the turned component lies as low as it should, keeps clear of what stands above, and looks different.
    fn seated(&self, angle: f64) -> bool {
        let landing = self.landing(angle);
        let low = landing.lie(false).is_some_and(|l| l.height < IN_SEAT);
        low && self.landing(0.0).looks_unlike(&landing, DIFFERENT) && self.clears(angle)
    }

    /// Other seats at the angles where patterns repeat.
    fn seats(&self) -> Vec<[f64; 2]> {
        let wide = |angle: f64| {
            let ends = [angle - self.of.zone, angle + self.of.zone];
            if ends.iter().all(|a| self.seated(*a)) { ends } else { [angle; 2] }
        };
        repeats().into_iter().filter(|a| self.seated(*a)).map(wide).collect()
    }

    /// Angles in steps between two of them, and well outside the tolerance, at which it looks different, to either side up to
    /// where something stops it.
    fn plain(&self, step: f64, from: f64, to: f64) -> Vec<[f64; 2]> {
        let from = from.max(PLAIN_ZONES * self.of.zone);
        [-1.0, 1.0].into_iter().filter_map(|sign| self.plain_side(sign, step, from, to)).collect()
    }

    /// The first run of angles at which it lies as it should, enters nothing and looks different.
    fn plain_side(&self, sign: f64, step: f64, from: f64, to: f64) -> Option<[f64; 2]> {
        let steps = (to / step + 1e-6).floor() as u32;
        let angles = (1..=steps).map(|k| step * f64::from(k)).filter(|a| *a >= from - 1e-9);
        let stays = |a: &f64| self.seated(sign * a) && self.room().clears(&self.pose(sign * a));
        let mut run = angles.skip_while(|a| !stays(a));
        let first = run.next()?;
        let last = run.take_while(stays).last().unwrap_or(first);
        Some([(sign * first).min(sign * last), (sign * first).max(sign * last)])
    }

    /// The room that the others leave it while it turns.
    fn room(&self) -> &Room<'a> {
        let beside = self.axis.offset(&self.of.middle()).norm();
        self.room.get_or_init(|| Room::new(&self.of.among(), 2.0 * beside))
    }

    fn pose(&self, angle: f64) -> Isometry3<f64> {
        self.axis.turn(angle) * self.of.poses[self.of.component]
    }

    /// How far the component reaches from the axis (mm).
    fn reach(&self) -> f64 {
        self.axis.reach(&self.of.solids[self.of.component], &self.of.poses[self.of.component])
    }

    /// Whether what stands above the component has its place still.
    fn clears(&self, angle: f64) -> bool {
        let (solids, poses) = (self.of.solids, self.of.poses);
        let pose = self.pose(angle);
        let above = self.of.insertion.above[self.of.component].iter();
        above.into_iter().all(|&c| self.bed.clear(&solids[self.of.component].mesh, &pose, &solids[c].mesh, &poses[c]))
    }

    fn turn(&self, ranges: Vec<[f64; 2]>, seated: bool) -> Option<Turn> {
        let (point, direction) = (self.axis.point.coords.into(), self.axis.direction.into_inner().into());
        let (firm, above) = (self.firm.clone(), self.of.insertion.above[self.of.component].clone());
        (!ranges.is_empty()).then_some(Turn { point, direction, ranges, firm, above, seated })
    }
}

/// The angles after which patterns repeat (rad), within half a turn to either side.
fn repeats() -> Vec<f64> {
    let mut shares: Vec<(u32, u32)> = Vec::new();
    for k in REPEATS {
        for j in 1..k {
            if !shares.iter().any(|(a, b)| a * k == j * b) {
                shares.push((j, k));
            }
        }
    }
    let wrapped = |(j, k): (u32, u32)| {
        let angle = TAU * f64::from(j) / f64::from(k);
        if 2 * j > k { angle - TAU } else { angle }
    };
    shares.into_iter().map(wrapped).collect()
}

impl Turn {
    /// Where the component lies at `u[0]` of the angles laid end to end. With `u[1]` = 0 it lies on whatever it meets
    /// first, with 1 it has pushed down all that gives way; between, part of the way.
    pub(crate) fn settle(
        &self,
        component: usize,
        u: [f64; 3],
        solids: &[Arc<Solid>],
        poses: &[Isometry3<f64>],
    ) -> Settled {
        let axis = Axis { point: self.point.into(), direction: Unit::new_normalize(Vector3::from(self.direction)) };
        let angle = pick(&self.ranges, u[0]);
        let turned = axis.turn(angle) * poses[component];
        let still = Settled { pose: turned, pushed: Vec::new(), angle, lift: 0.0 };
        if self.seated {
            return still;
        }
        let below: Vec<usize> = (0..solids.len()).filter(|c| !self.above.contains(c)).collect();
        let bed = axis.bed(component, FINE, &below, &self.firm, solids, poses);
        let landing = bed.set_down(&solids[component].mesh, &turned);
        let first = landing.lie(false);
        let firm = landing.lie(true).filter(|l| l.height > 0.0);
        let (Some(from), Some(to)) = (first.or(firm), firm.or(first)) else {
            return still;
        };
        let lie: Lie = from.towards(&to, u[1]);
        let down = |(c, depth): (usize, f64)| (c, Translation3::from(axis.direction.into_inner() * -depth) * poses[c]);
        let pushed = landing.pushed(&lie).into_iter().map(down).collect();
        Settled { pose: lie.motion(&bed.frame, landing.level) * turned, pushed, angle, lift: lie.height }
    }
}

/// An axis in the assembly's frame.
#[derive(Debug, Clone, Copy)]
struct Axis {
    point: Point3<f64>,
    direction: Unit<Vector3<f64>>,
}

impl Axis {
    /// The axes a component is likely to be turned about, the likeliest first: that of its largest central cylinder along
    /// the direction; those of its only hole, through the middle of its pegs, of its box and of its vertices.
    fn candidates(solid: &Solid, pose: &Isometry3<f64>, direction: Unit<Vector3<f64>>) -> Vec<Self> {
        let through = |point: Point3<f64>| Axis { point, direction };
        let middle = through(pose * mean(&solid.mesh.positions));
        let bounds = through(pose * box_middle(&solid.mesh.positions));
        let reach = middle.reach(solid, pose);
        let cylinder = |f: &Face| match &solid.surfaces[f.surface] {
            Surface::Cylinder { point, axis, radius } => {
                let along = (pose.rotation * axis.into_inner()).cross(&direction).norm() < PARALLEL;
                along.then_some((pose * point, *radius, f.outward))
            }
            _ => None,
        };
        let cylinders: Vec<(Point3<f64>, f64, bool)> = solid.faces.iter().filter_map(cylinder).collect();
        let about = cylinders.iter().filter(|(p, ..)| middle.offset(p).norm() < CENTRAL * reach);
        let largest = about.max_by(|a, b| a.1.total_cmp(&b.1)).map(|c| (through(c.0), c.1));
        // Not the end of a slot in the middle of a bar.
        let round = largest.is_some_and(|(axis, radius)| {
            radius > ROUND * reach || axis.offset(&bounds.point).norm() < CENTRED * reach
        });
        let holes = distinct(cylinders.iter().filter(|c| !c.2).map(|c| through(c.0)));
        let hole = holes.first().filter(|_| holes.len() == 1).copied();
        let pegs: Vec<Point3<f64>> = cylinders.iter().filter(|c| c.2).map(|c| c.0).collect();
        let pegs = (pegs.len() > 1).then(|| through(mean(&pegs)));
        let found = [largest.map(|l| l.0), hole, pegs, Some(bounds), Some(middle)];
        let mut axes = distinct(found.into_iter().flatten());
        // A round part has its one axis; of any other the likeliest few are enough.
        axes.truncate(if round { 1 } else { MOST_AXES });
        axes
    }

    fn turn(&self, angle: f64) -> Isometry3<f64> {
        let to_axis = Translation3::from(self.point.coords);
        to_axis * UnitQuaternion::from_axis_angle(&self.direction, angle) * to_axis.inverse()
    }

    /// From the axis to a point, square to it.
    fn offset(&self, p: &Point3<f64>) -> Vector3<f64> {
        let r = p - self.point;
        r - self.direction.into_inner() * r.dot(&self.direction)
    }

    /// How far a placed solid reaches from the axis (mm).
    fn reach(&self, solid: &Solid, pose: &Isometry3<f64>) -> f64 {
        solid.mesh.positions.iter().map(|p| self.offset(&(pose * p)).norm()).fold(0.0, f64::max)
    }

    /// What a component turned about the axis is set down on: `others`, of which some stand firm.
    fn bed(
        &self,
        component: usize,
        cell: f64,
        others: &[usize],
        firm: &[usize],
        solids: &[Arc<Solid>],
        poses: &[Isometry3<f64>],
    ) -> Bed {
        let others = others.iter().filter(|c| **c != component).map(|c| (*c, firm.contains(c)));
        let [u, v, _] = Frame::along(self.direction).coordinates(&self.point);
        let radius = self.reach(&solids[component], &poses[component]);
        Bed::new(self.direction, [u, v], radius, cell, &others.collect::<Vec<_>>(), solids, poses)
    }
}

/// Each axis once, in the order given.
fn distinct(all: impl Iterator<Item = Axis>) -> Vec<Axis> {
    let mut axes: Vec<Axis> = Vec::new();
    for axis in all {
        if axes.iter().all(|a| a.offset(&axis.point).norm() > SAME_AXIS) {
            axes.push(axis);
        }
    }
    axes
}

fn mean(points: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
    Point3::from(sum / points.len().max(1) as f64)
}

fn box_middle(points: &[Point3<f64>]) -> Point3<f64> {
    let ends = |i: usize| points.iter().fold([f64::MAX, f64::MIN], |e, p| [e[0].min(p[i]), e[1].max(p[i])]);
    Point3::from(Vector3::from_fn(|i, _| ends(i).iter().sum::<f64>() / 2.0))
}

/// The turns of one sign that lift the part, from the first on (rad, low to high).
fn range(sign: f64, lifted: &dyn Fn(f64) -> bool) -> Option<[f64; 2]> {
    let steps = (WIDEST / STEP + 1e-6).floor() as usize;
    let holds = |k: &usize| lifted(sign * STEP * *k as f64);
    let first = (1..=steps).find(holds)?;
    let last = (first + 1..=steps).take_while(holds).last().unwrap_or(first);
    let (mut low, mut high) = (STEP * (first - 1) as f64, STEP * first as f64);
    for _ in 0..4 {
        let middle = (low + high) / 2.0;
        if lifted(sign * middle) { high = middle } else { low = middle }
    }
    let end = STEP * last as f64;
    Some(if sign > 0.0 { [high, end] } else { [-end, -high] })
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{analyse, place::place, sample};

    const WHEEL_A2: usize = 4;

    fn wheel() -> (sample::Assembly, Vec<Isometry3<f64>>, Turn) {
        let a = sample::pattern_wheel();
        let poses = place(&a.design, &a.design.nominal());
        let (found, _) = analyse(&a.design, &a.solids);
        let of = Turning {
            component: WHEEL_A2,
            insertion: &found.insertion,
            liaison: &found.liaison,
            solids: &a.solids,
            poses: &poses,
            zone: 0.001,
        };
        let mut turns = turns(&of, 0.8);
        assert!(!turns[0].seated);
        (a, poses, turns.remove(0))
    }

    /// The alignment pins end at z = 20.6, hd_pin at 21.5, unlatch_pin at 23; the wheel's underside is at 18.
    #[test]
    fn a_turned_wheel_lies_on_the_pins() {
        let (a, poses, turn) = wheel();
        for degrees in [28.0_f64, -17.0] {
            let turn = Turn { ranges: vec![[degrees.to_radians(); 2]], ..turn.clone() };
            let settled = turn.settle(WHEEL_A2, [0.5, 0.0, 0.0], &a.solids, &poses);
            let lift = (settled.pose * Point3::origin()).z - 18.0;
            let tilt = (settled.pose.rotation * Vector3::z()).angle(&Vector3::z()).to_degrees();
            assert!((3.4..3.9).contains(&lift), "lift {lift}");
            assert!((1.0..6.0).contains(&tilt), "tilt {tilt}");
            let under = |x: f64, y: f64, z: f64| settled.pose.inverse().transform_point(&Point3::new(x, y, z)).z < 0.06;
            assert!(under(0.0, 18.0, 20.6) && under(-23.5 * 0.75f64.sqrt(), 11.75, 23.0), "{degrees}");
        }
    }

    #[test]
    fn pins_that_stand_on_nothing_can_be_pushed_down() {
        let (a, poses, turn) = wheel();
        let settled = turn.settle(WHEEL_A2, [0.9, 1.0, 0.0], &a.solids, &poses);
        assert!(((settled.pose * Point3::origin()).z - 20.6).abs() < 1e-6);
        assert_eq!(settled.pushed.iter().map(|(c, _)| *c).collect::<Vec<_>>(), [8, 9]);
        assert!((settled.pushed[1].1.translation.z - (11.0 - 2.4)).abs() < 1e-6);
    }

    #[test]
    fn turns_start_where_the_holes_no_longer_pass() {
        let (_, _, turn) = wheel();
        assert_eq!(turn.firm, [0, 2, 3, 5, 6, 7]);
        assert_eq!(turn.ranges.len(), 2);
        for [low, high] in &turn.ranges {
            let [near, far] = [low.abs().min(high.abs()), low.abs().max(high.abs())].map(f64::to_degrees);
            assert!((0.2..4.0).contains(&near) && (far - 40.0).abs() < 1e-6, "{near} {far}");
        }
    }

    #[test]
    fn shares_run_through_all_ranges() {
        let ranges = [[-3.0, -1.0], [2.0, 4.0]];
        assert_eq!([0.0, 0.5, 0.75, 1.0].map(|u| pick(&ranges, u)), [-3.0, -1.0, 3.0, 4.0]);
    }
}
