//! A part put on its pins at the wrong angle.
//!
//! In: a component held against turning, its liaisons, the solids. Out: the turns that keep it from its seat and, for a turn
//! and a draw of the assembly, where it then lies. Components that stand on nothing firm (pins held by their sides alone)
//! may be pushed down by it; the others stay.

use super::columns::Frame;
use super::insertion::Insertion;
use super::liaison::Liaison;
use super::rest::{Bed, Lie};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use serde::Serialize;
use std::f64::consts::TAU;
use std::sync::Arc;

/// The turns by which a component can be misplaced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Turn {
    /// A point of the axis (mm, assembly's frame).
    pub point: [f64; 3],
    /// The axis, towards where the component is removed.
    pub direction: [f64; 3],
    /// Angles (rad), low to high, at which it does not find its seat.
    pub ranges: Vec<[f64; 2]>,
    /// Components that bear it; the others give way.
    pub firm: Vec<usize>,
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

/// Turns are looked for up to this angle (rad), or half the period of the seats if that is less.
const WIDEST: f64 = 40.0 * TAU / 360.0;
/// Turns are tried in steps of this (rad), and the first that lifts the part is found to within a sixteenth of it.
const STEP: f64 = 4.0 * TAU / 360.0;
/// Side of a cell (mm) in the search for turns and in the pose a turn leads to.
const COARSE: f64 = 0.4;
const FINE: f64 = 0.2;
/// Contacts closer to the axis than this (mm) do not stop a turn.
const ON_AXIS: f64 = 0.5;
/// Directions that differ by less than this sine are parallel.
const PARALLEL: f64 = 1e-3;
/// The axis of a part lies within this share of the part's reach from its middle.
const CENTRAL: f64 = 0.25;

/// The turns that lift a component by `least` mm or more. `None` for one that nothing stops from turning, that would find
/// its seat at any angle, or that others hold down: its error shows as theirs.
pub(crate) fn turns(
    liaison: &Liaison,
    insertion: &Insertion,
    component: usize,
    least: f64,
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
) -> Option<Turn> {
    let direction = insertion.direction(component);
    let axis = Axis::of(&solids[component], &poses[component], direction);
    let seats = seats(liaison, component, &axis);
    if seats.is_empty() || !insertion.is_free(component) {
        return None;
    }
    let stands = |c: &usize| *c == 0 || liaison.rests(*c, direction);
    let firm: Vec<usize> = (0..liaison.components).filter(|c| *c != component).filter(stands).collect();
    let bed = axis.bed(component, COARSE, &firm, solids, poses);
    let lifted = |angle: f64| {
        let landing = bed.set_down(&solids[component].mesh, &(axis.turn(angle) * poses[component]));
        landing.lie(false).is_some_and(|l| l.height >= least)
    };
    let widest = WIDEST.min(period(&seats) / 2.0);
    let ranges: Vec<[f64; 2]> = [-1.0, 1.0].iter().filter_map(|sign| range(*sign, widest, &lifted)).collect();
    let (point, direction) = (axis.point.coords.into(), direction.into_inner().into());
    (!ranges.is_empty()).then_some(Turn { point, direction, ranges, firm })
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
        let bed = axis.bed(component, FINE, &self.firm, solids, poses);
        let landing = bed.set_down(&solids[component].mesh, &turned);
        let first = landing.lie(false);
        let firm = landing.lie(true).filter(|l| l.height > 0.0);
        let (Some(from), Some(to)) = (first.or(firm), firm.or(first)) else {
            return Settled { pose: turned, pushed: Vec::new(), angle, lift: 0.0 };
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
    /// The axis a component is likely to be turned about: that of its largest central cylinder along the direction, else
    /// the direction through the middle of its vertices.
    fn of(solid: &Solid, pose: &Isometry3<f64>, direction: Unit<Vector3<f64>>) -> Self {
        let positions = &solid.mesh.positions;
        let sum: Vector3<f64> = positions.iter().map(|p| p.coords).sum();
        let middle = Axis { point: pose * Point3::from(sum / positions.len().max(1) as f64), direction };
        let central = CENTRAL * middle.reach(solid, pose);
        let cylinders = solid.faces.iter().filter_map(|f| match &solid.surfaces[f.surface] {
            Surface::Cylinder { point, axis, radius } => {
                Some((pose * point, pose.rotation * axis.into_inner(), *radius))
            }
            _ => None,
        });
        let candidates =
            cylinders.filter(|(p, a, _)| a.cross(&direction).norm() < PARALLEL && middle.offset(p).norm() < central);
        match candidates.max_by(|a, b| a.2.total_cmp(&b.2)) {
            Some((point, ..)) => Axis { point, direction },
            None => middle,
        }
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

    /// What a component turned about the axis is set down on.
    fn bed(&self, component: usize, cell: f64, firm: &[usize], solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Bed {
        let others = (0..solids.len()).filter(|c| *c != component).map(|c| (c, firm.contains(&c)));
        let [u, v, _] = Frame::along(self.direction).coordinates(&self.point);
        let radius = self.reach(&solids[component], &poses[component]);
        Bed::new(self.direction, [u, v], radius, cell, &others.collect::<Vec<_>>(), solids, poses)
    }
}

/// The contacts that stop a component from turning about an axis: where they stand round it.
fn seats(liaison: &Liaison, component: usize, axis: &Axis) -> Vec<Vector3<f64>> {
    let sideways = liaison.of(component).filter(|c| c.sideways_span(axis.direction).is_some());
    sideways.map(|c| axis.offset(&c.point)).filter(|o| o.norm() > ON_AXIS).collect()
}

/// The smallest turn that maps the seats on themselves (rad); a whole turn if there is none.
fn period(seats: &[Vector3<f64>]) -> f64 {
    let maps = |turn: &UnitQuaternion<f64>| seats.iter().all(|s| seats.iter().any(|t| (turn * s - t).norm() < ON_AXIS));
    let turns = seats[1..].iter().filter_map(|s| UnitQuaternion::rotation_between(&seats[0], s));
    turns.filter(maps).map(|t| t.angle()).filter(|a| *a > PARALLEL).fold(TAU, f64::min)
}

/// The turns of one sign that lift the part, from the first on (rad, low to high).
fn range(sign: f64, widest: f64, lifted: &dyn Fn(f64) -> bool) -> Option<[f64; 2]> {
    let steps = (widest / STEP + 1e-6).floor() as usize;
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
        let turn = turns(&found.liaison, &found.insertion, WHEEL_A2, 0.8, &a.solids, &poses);
        (a, poses, turn.expect("wheel_a2 can be turned"))
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
    fn seats_on_a_regular_pattern_repeat() {
        let at = |degrees: f64| Vector3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0) * 18.0;
        let six: Vec<_> = (0..6).map(|k| at(60.0 * k as f64)).collect();
        assert!((period(&six).to_degrees() - 60.0).abs() < 1e-6);
        assert!((period(&[at(0.0), at(90.0), at(200.0)]) - TAU).abs() < 1e-6);
    }

    #[test]
    fn shares_run_through_all_ranges() {
        let ranges = [[-3.0, -1.0], [2.0, 4.0]];
        assert_eq!([0.0, 0.5, 0.75, 1.0].map(|u| pick(&ranges, u)), [-3.0, -1.0, 3.0, 4.0]);
    }
}
