//! The exploded view (Fig. 7 of the paper): how far each component moves along its removal direction.
//!
//! In: the removal order and the placed solids. Out: a shift per component (mm). A component moves until it clears, along its
//! direction, everything that stays longer and, of those that leave in the same round, everything it stands over; so
//! no two components stand in each other in the picture. Groups that leave as a whole move as one.

use super::columns::{Extent, Frame, project};
use super::insertion::Insertion;
use crate::solid::Solid;
use nalgebra::{Isometry3, Vector3};
use std::sync::Arc;

/// How far apart the exploded view sets components (mm).
const GAP: f64 = 5.0;

/// How far each component moves (mm). `poses` as the solids: one per component.
pub fn exploded(insertion: &Insertion, solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
    let mut view = View { insertion, solids, poses, shifts: vec![Vector3::zeros(); solids.len()] };
    let leaves =
        |c: &usize| insertion.rounds.iter().chain(insertion.groups.iter().map(|g| &g.members)).any(|r| r.contains(c));
    let mut placed: Vec<usize> = (0..solids.len()).filter(|c| !leaves(c)).collect();
    for round in (0..=insertion.rounds.len()).rev() {
        if let Some(round) = insertion.rounds.get(round) {
            view.set_round(round, &placed);
            placed.extend(round);
        }
        for group in insertion.groups.iter().rev().filter(|g| g.after == round) {
            view.set_group(&group.members, &placed);
            placed.extend(&group.members);
        }
    }
    view.shifts
}

struct View<'a> {
    insertion: &'a Insertion,
    solids: &'a [Arc<Solid>],
    poses: &'a [Isometry3<f64>],
    shifts: Vec<Vector3<f64>>,
}

impl View<'_> {
    /// The broadest first: what leaves through it stands above it.
    fn set_round(&mut self, round: &[usize], below: &[usize]) {
        let mut order: Vec<(f64, usize)> = round.iter().map(|c| (self.breadth(*c), *c)).collect();
        order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut beside: Vec<usize> = Vec::new();
        for (_, c) in order {
            let frame = Frame::along(self.insertion.direction(c));
            let own = self.extent(&frame, c);
            let over = |o: &usize| meet(&own, &self.extent(&frame, *o));
            let under: Vec<usize> = below.iter().copied().chain(beside.iter().copied().filter(over)).collect();
            self.lift(&frame, &[c], &under);
            beside.push(c);
        }
    }

    fn set_group(&mut self, members: &[usize], below: &[usize]) {
        if let Some(first) = members.first() {
            self.lift(&Frame::along(self.insertion.direction(*first)), members, below);
        }
    }

    fn lift(&mut self, frame: &Frame, members: &[usize], under: &[usize]) {
        let top = under.iter().map(|c| self.extent(frame, *c).high[2]).fold(f64::NEG_INFINITY, f64::max);
        let bottom = members.iter().map(|c| self.extent(frame, *c).low[2]).fold(f64::INFINITY, f64::min);
        let lift = top + GAP - bottom;
        if lift > 0.0 && lift.is_finite() {
            members.iter().for_each(|c| self.shifts[*c] = frame.d * lift);
        }
    }

    fn breadth(&self, component: usize) -> f64 {
        let extent = self.extent(&Frame::along(self.insertion.direction(component)), component);
        (extent.high[0] - extent.low[0]) * (extent.high[1] - extent.low[1])
    }

    fn extent(&self, frame: &Frame, component: usize) -> Extent {
        let by = frame.coordinates(&self.shifts[component].into());
        let own = Extent::of(&project(&self.solids[component].mesh, &self.poses[component], frame));
        Extent { low: [0, 1, 2].map(|i| own.low[i] + by[i]), high: [0, 1, 2].map(|i| own.high[i] + by[i]) }
    }
}

/// Whether two boxes meet across the direction.
fn meet(a: &Extent, b: &Extent) -> bool {
    (0..2).all(|i| a.low[i] < b.high[i] && b.low[i] < a.high[i])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{analyse, place::place, sample};

    #[test]
    fn nothing_stands_in_anything_in_the_picture() {
        let a = sample::pattern_wheel();
        let found = analyse(&a.design, &a.solids).0.insertion;
        let poses = place(&a.design, &a.design.nominal());
        let shifts = exploded(&found, &a.solids, &poses);
        assert_eq!(shifts[0], Vector3::zeros());
        let frame = Frame::along(Vector3::z_axis());
        let view = View { insertion: &found, solids: &a.solids, poses: &poses, shifts };
        let extents: Vec<Extent> = (0..a.solids.len()).map(|c| view.extent(&frame, c)).collect();
        for (k, own) in extents.iter().enumerate() {
            for other in &extents[k + 1..] {
                let apart = own.low[2] > other.high[2] + GAP - 1e-6 || other.low[2] > own.high[2] + GAP - 1e-6;
                assert!(apart || !meet(own, other));
            }
        }
        for pair in found.rounds.windows(2) {
            let clears =
                |c: &usize| pair[1].iter().all(|below| extents[*c].low[2] > extents[*below].high[2] + GAP - 1e-6);
            assert!(pair[0].iter().all(clears));
        }
    }
}
