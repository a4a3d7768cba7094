//! Parts that stand a little above their place.
//!
//! In: by how much a node appears beside where calibration expects it, the way on which its part comes out of its seat. Out:
//! how far up that way the part appears to stand, and what that says for its being seated. A small rise hardly changes what a
//! part looks like, and what is not quite as rendered hides it easily; but it moves the whole image of the part. Never looks
//! at an image.

use super::calibrate::SLIGHT;
use super::camera::Camera;
use super::judge::INDEPENDENT;
use super::math::{length, ln};
use super::model::Node;
use super::pose::Pose;
use serde::{Deserialize, Serialize};

/// Where a mm of rise moves the image by less than this (px), its place tells nothing.
const LEAST_SEEN: f64 = 0.5;
/// A place says at most so much (natural logarithm): what lies far out has reasons of its own.
const MOST: f64 = 20.0;

/// What the model file says of a part's rising.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rise {
    /// The way out of its seat (unit vector, assembly frame).
    pub direction: [f64; 3],
    /// A point of the part (mm, assembly frame).
    pub at: [f64; 3],
    /// How high the part appears to stand in held-out renders; `None` in a model that was not held against any.
    pub shown: Option<Shown>,
}

/// Lifts (mm) that held-out renders show.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shown {
    /// Standard deviation of a seated part's, whose mean is 0.
    pub seated: f64,
    /// Middle of [`Lift::unsure`] in the same photos.
    pub unsure: f64,
    /// Mean and standard deviation of those of a part that is not seated.
    pub raised: [f64; 2],
}

/// How high a part appears to stand.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lift {
    /// Above its place (mm).
    pub mm: f64,
    /// By how much the photo's other nodes disagree about their places, as a standard deviation of it (mm).
    pub unsure: f64,
}

impl Rise {
    /// Whether all its numbers can be reckoned with.
    pub(super) fn is_sound(&self) -> bool {
        let shown = |s: &Shown| {
            let positive = [s.seated, s.unsure, s.raised[1]];
            positive.iter().all(|v| v.is_finite() && *v > 0.0) && s.raised[0].is_finite()
        };
        self.direction.iter().chain(&self.at).all(|v| v.is_finite()) && self.shown.iter().all(shown)
    }

    /// How far (px) the part's image moves per mm of rise in a photo by `camera` of an assembly at `pose`. `None` where it does
    /// hardly, because the camera looks along the way.
    pub fn seen(&self, camera: &Camera, pose: &Pose) -> Option<[f64; 2]> {
        let up = [0, 1, 2].map(|k| self.at[k] + self.direction[k]);
        let [low, high] = [self.at, up].map(|p| camera.project(pose.apply(p)));
        let along = low.zip(high).map(|(low, high)| [0, 1].map(|k| high[k] - low[k]));
        along.filter(|a| length(a[0], a[1]) >= LEAST_SEEN)
    }

    /// From how far off its place the node appears, and by how much the other nodes disagree (px).
    pub fn lift(&self, camera: &Camera, pose: &Pose, off: [f64; 2], apart: [f64; 2]) -> Option<Lift> {
        let along = self.seen(camera, pose)?;
        let square = along[0] * along[0] + along[1] * along[1];
        let unsure = length(along[0] * apart[0], along[1] * apart[1]) / square;
        Some(Lift { mm: (along[0] * off[0] + along[1] * off[1]) / square, unsure })
    }
}

/// Log-likelihood ratio of a seated part against a raised one by where it appears: normal variables, both wider in a photo whose
/// nodes disagree more than usual.
fn for_seated(shown: &Shown, lift: Lift) -> f64 {
    let wider = (lift.unsure / shown.unsure).max(1.0);
    let seated = shown.seated * wider;
    let [middle, spread] = shown.raised;
    let raised = length(spread, seated);
    let (own, other) = (lift.mm / seated, (lift.mm - middle) / raised);
    ((other * other - own * own) / 2.0 + ln(raised / seated)).clamp(-MOST, MOST)
}

/// Log-likelihood ratios per coefficient of the good state against each hypothesis, with what the node's place adds to those
/// against a part that is not seated.
pub fn weighed(node: &Node, against: &[f64], lift: Option<Lift>) -> Vec<f64> {
    let shown = node.rise.as_ref().and_then(|rise| rise.shown);
    let by_place = shown.zip(lift).map_or(0.0, |(shown, lift)| for_seated(&shown, lift) / INDEPENDENT);
    let of = |(h, value): (usize, &f64)| if node.hypotheses[h].fault == SLIGHT { value + by_place } else { *value };
    against.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::model::tests::tiny;

    const SHOWN: Shown = Shown { seated: 0.1, unsure: 0.1, raised: [0.8, 0.3] };

    fn nats(mm: f64, unsure: f64) -> f64 {
        for_seated(&SHOWN, Lift { mm, unsure })
    }

    /// Two normal densities by hand: at 0 the raised one's is exp(-(0.8²/0.1)/2) over its width of √0.1, the seated one's 1 over 0.1.
    #[test]
    fn the_ratio_is_that_of_two_normal_densities() {
        let by_hand = 0.5 * 0.64 / 0.1 + (0.1f64.sqrt() / 0.1).ln();
        assert!((nats(0.0, 0.1) - by_hand).abs() < 1e-12);
        assert!(nats(0.2, 0.1) > 0.0 && nats(0.4, 0.1) < -4.0, "0.2: {}, 0.4: {}", nats(0.2, 0.1), nats(0.4, 0.1));
        assert_eq!(nats(9.0, 0.1), -MOST);
        assert!(nats(-0.3, 0.1) > 0.0, "lower than its place is not raised");
    }

    #[test]
    fn where_the_nodes_disagree_a_place_says_less() {
        assert_eq!(nats(0.4, 0.05), nats(0.4, 0.1), "agreeing better than usual proves nothing");
        assert!(nats(0.4, 0.3) > nats(0.4, 0.1) / 4.0);
    }

    /// Half a millimetre of rise is read as such from how the image moves, whichever way the assembly is turned; what moves
    /// beside that way is none.
    #[test]
    fn a_lift_is_read_along_the_way_out_of_the_seat() {
        let model = tiny();
        let camera = model.station.camera;
        let home = Pose::home(&model.station);
        let rise = |direction| Rise { direction, at: [0.0; 3], shown: None };
        // Whichever way this camera looks, it sees one of these from the side.
        for turn in [0.0, 1.0] {
            let pose = Pose { rz: home.rz + turn, ..home };
            let ways = [[1.0, 0.0, 0.0], [0.0, 0.6, 0.8]].map(rise);
            let seen: Vec<_> = ways.iter().filter_map(|way| Some((way, way.seen(&camera, &pose)?))).collect();
            assert!(!seen.is_empty());
            for (way, along) in seen {
                let lift = way.lift(&camera, &pose, along.map(|v| 0.5 * v), [0.0; 2]).unwrap();
                assert!((lift.mm - 0.5).abs() < 1e-9 && lift.unsure == 0.0);
                let beside = [along[1], -along[0]];
                assert!(way.lift(&camera, &pose, beside, [0.0; 2]).unwrap().mm.abs() < 1e-9);
            }
        }
    }

    #[test]
    fn only_parts_that_are_not_seated_are_weighed_by_their_place() {
        let mut node = tiny().nodes.remove(0);
        let of = |fault: &str| crate::runtime::model::Hypothesis { fault: fault.into(), ..node.hypotheses[0].clone() };
        node.hypotheses = ["good", "missing", SLIGHT].map(of).into();
        node.rise = Some(Rise { direction: [0.0, 0.0, 1.0], at: [0.0; 3], shown: Some(SHOWN) });
        let lift = Some(Lift { mm: 0.8, unsure: 0.1 });
        let weighed = weighed(&node, &[0.0, 0.4, 0.1], lift);
        assert_eq!(weighed[..2], [0.0, 0.4]);
        assert!((weighed[2] - (0.1 + nats(0.8, 0.1) / INDEPENDENT)).abs() < 1e-12 && weighed[2] < 0.0);
        assert_eq!(super::weighed(&node, &[0.0, 0.4, 0.1], None), [0.0, 0.4, 0.1]);
    }
}
