//! What the nodes of a photo say, and where they say the assembly stands.
//!
//! In: a photo, and the pose that its edges tell. Out: log-likelihoods of all nodes under every hypothesis, at that pose or at one
//! that suits them all better. Never decides.

use super::{Inspector, LEAST_INSIDE, NodeReport};
use crate::runtime::anywhere::{Anywhere, Seen};
use crate::runtime::calibrate::widened;
use crate::runtime::judge::{Evidence, NodeImages, Pyramid};
use crate::runtime::locate::Located;
use crate::runtime::look::Look;
use crate::runtime::parts::{Part, nobody};
use crate::runtime::photo::Photo;
use crate::runtime::pose::Pose;
use crate::runtime::regain::{self, Fit};
use crate::runtime::rise::Lift;
use crate::runtime::settle::{self, POSE_RESIDUAL};

/// The nodes of a photo where the assembly may stand.
struct Place<'l> {
    found: Located,
    looks: Vec<Look<'l>>,
}

/// The pose is taken anew where the nodes are this many times further from it than it leaves them, at most so many times.
const ELSEWHERE: f64 = 3.0;
const REGAINS: usize = 4;

impl Inspector<'_> {
    /// Log-likelihoods of all nodes, and the pose at which they were taken: of those that the edges tell the one where the nodes
    /// explain most; and where they agree that they stand elsewhere and explain more there, that is where the assembly stands.
    pub(super) fn settled(&self, photo: &Photo, located: &[Located]) -> (Vec<Evidence>, Located) {
        (self.listener)(Part::Windows);
        let pyramid = self.prepared.pyramid(&photo.light);
        let place = |found: Located| Place { looks: self.looks(&pyramid, &found.pose), found };
        let mut places: Vec<Place> = located.iter().copied().map(place).collect();
        let mut taken = places.swap_remove(self.clearest(&places));
        for _ in 0..REGAINS {
            let Some(pose) = self.regained(&taken.looks, &taken.found.pose) else { break };
            let there = place(Located { pose, ..taken.found });
            let mut both = vec![taken, there];
            let clearest = self.clearest(&both);
            taken = both.swap_remove(clearest);
            if clearest == 0 {
                break;
            }
        }
        (self.weighed(&taken.looks, &taken.found.pose), taken.found)
    }

    /// The place of which the nodes explain most beside what any place of this photo looks like, the first of equals.
    fn clearest(&self, places: &[Place]) -> usize {
        if places.len() < 2 {
            return 0;
        }
        let states: Vec<Vec<(f64, Seen)>> = places.iter().map(|place| self.states(&place.looks)).collect();
        let anywhere = Anywhere::of(states.iter().flatten().map(|(_, seen)| seen));
        let explained = |of: &Vec<(f64, Seen)>| -> f64 {
            of.iter().map(|(likelihood, seen)| likelihood - anywhere.log_likelihood(seen)).sum()
        };
        let explained: Vec<f64> = states.iter().map(explained).collect();
        (0..places.len()).rev().max_by(|&a, &b| explained[a].total_cmp(&explained[b])).unwrap_or(0)
    }

    /// Every node in its likeliest state: its log-likelihood and its window.
    fn states<'l>(&'l self, looks: &'l [Look]) -> Vec<(f64, Seen<'l>)> {
        let state = |(look, node): (&'l Look, &'l NodeImages)| {
            let (likelihood, shift) = look.likeliest_state();
            let coefficients = look.coefficients(shift);
            (likelihood, Seen { factor: node.window.frame.factor, levels: &node.stencil.levels, coefficients })
        };
        looks.iter().zip(&self.prepared.nodes).map(state).collect()
    }

    /// The pose to which the nodes point, if that is elsewhere.
    fn regained(&self, looks: &[Look], pose: &Pose) -> Option<Pose> {
        let fit = |(i, look): (usize, &Look)| {
            let node = &self.model.nodes[i];
            let expected = self.expected.as_ref().map_or([0.0; 2], |all| all[i].at);
            let shift = look.shift_in_photo(look.likeliest_state().1);
            let off = [0, 1].map(|k| shift[k] - expected[k]);
            let [x0, y0, x1, y1] = node.visible;
            let at = self.prepared.home.invert(self.on_plane([(x0 + x1) / 2.0, (y0 + y1) / 2.0], node.plane)?);
            (look.inside >= LEAST_INSIDE).then_some(Fit { at, off, spread: node.spread })
        };
        let fits: Vec<Fit> = looks.iter().enumerate().filter_map(fit).collect();
        let (other, motion) = regain::corrected(pose, &self.camera, &widened(&self.model), &fits)?;
        (motion > ELSEWHERE * POSE_RESIDUAL).then_some(other)
    }

    /// Log-likelihoods of all nodes at a pose.
    pub fn evidence(&self, photo: &Photo, pose: &Pose) -> Vec<Evidence> {
        (self.listener)(Part::Windows);
        self.weighed(&self.looks(&self.prepared.pyramid(&photo.light), pose), pose)
    }

    fn weighed(&self, looks: &[Look], pose: &Pose) -> Vec<Evidence> {
        let factor = |node: usize| f64::from(self.prepared.nodes[node].window.frame.factor);
        let shift = |(i, look): (usize, &Look)| look.measured_shift().map(|v| v * factor(i));
        let shifts: Vec<[f64; 2]> = looks.iter().enumerate().map(shift).collect();
        let own = |(i, look): (usize, &Look)| {
            let expected = self.expected.as_ref().map(|all| settle::in_photo(all, &shifts, i));
            let lift = self.lift(i, &shifts, pose);
            Evidence { lift, ..self.prepared.nodes[i].evidence(look, expected.as_ref()) }
        };
        looks.iter().enumerate().map(own).collect()
    }

    /// How high a node's part appears to stand in a photo that shows the nodes at `shifts` (px).
    fn lift(&self, node: usize, shifts: &[[f64; 2]], pose: &Pose) -> Option<Lift> {
        let (rise, expected) = self.model.nodes[node].rise.as_ref().zip(self.expected.as_ref())?;
        let (common, apart) = settle::others(expected, shifts, node);
        let off = [0, 1].map(|k| shifts[node][k] - expected[node].at[k] - common[k]);
        rise.lift(&self.camera, pose, off, apart)
    }

    /// Every node at a pose under its own hypotheses.
    fn looks<'l>(&'l self, pyramid: &'l Pyramid, pose: &Pose) -> Vec<Look<'l>> {
        let look = |(i, node): (usize, &'l NodeImages)| {
            let reduced = pyramid.at(node.window.frame.factor);
            node.look(&self.densities[i][..node.own], &self.light, reduced, &self.camera, pose, self.listener)
        };
        self.prepared.nodes.iter().enumerate().map(look).collect()
    }

    /// Log-likelihoods of the disturbed states of the nodes that need an explanation; empty for the others.
    pub(in crate::runtime) fn disturbed(&self, nodes: &[NodeReport], photo: &Photo, pose: &Pose) -> Vec<Vec<f64>> {
        let needed = |i: usize| nodes[i].faulty && !self.model.nodes[i].disturbed.is_empty();
        if nodes.iter().filter(|n| n.faulty).count() < 2 {
            return vec![Vec::new(); nodes.len()];
        }
        let pyramid = self.prepared.pyramid(&photo.light);
        let states = |i: usize| {
            let node = &self.prepared.nodes[i];
            let densities = &self.densities[i][node.own..];
            let reduced = pyramid.at(node.window.frame.factor);
            let look = node.look(densities, &self.light, reduced, &self.camera, pose, &nobody);
            node.evidence(&look, None).log_likelihoods
        };
        (0..nodes.len()).map(|i| if needed(i) { states(i) } else { Vec::new() }).collect()
    }
}
