//! Where a node's good state is expected in a photo, once the station is calibrated.
//!
//! In: how far every node was from where pose and camera have it, in the calibration's photos and in this one. Out: middle and
//! standard deviation of each node's place. What camera and pose leave is the same in every photo of a station but for a
//! little, so a part that stands higher than it did shows by where it appears. Never looks at an image.

use super::linear;
use super::math::length;
use super::model::Node;

/// Standard deviation of a node's place before calibration, beside its placement (px of the photo): what pose and camera leave.
pub const POSE_RESIDUAL: f64 = 1.0;
/// The same from photo to photo of one station (px).
const PHOTO_RESIDUAL: f64 = 0.4;
/// With fewer other nodes than this a photo does not tell how far all of them are off.
pub(super) const LEAST_OTHERS: usize = 3;

/// Where a node's good state is expected (px of the photo): middle and standard deviation of its shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    pub at: [f64; 2],
    pub spread: [f64; 2],
}

/// Standard deviation of a component's place by its tolerances alone (px of the photo), along the axis where it is largest.
pub fn play(node: &Node) -> f64 {
    node.spread.iter().map(|s| (s * s - POSE_RESIDUAL.powi(2)).max(0.0).sqrt()).fold(0.0, f64::max)
}

/// A node's place after some photos that showed it at `seen` (px): a normal station error of which the photos are noisy readings.
pub fn after(node: &Node, seen: &[[f64; 2]]) -> Expected {
    let count = seen.len() as f64;
    let mut out = Expected { at: [0.0; 2], spread: [0.0; 2] };
    for k in 0..2 {
        let zone = (node.spread[k].powi(2) - POSE_RESIDUAL.powi(2)).max(0.0);
        let photo = zone + PHOTO_RESIDUAL.powi(2);
        let certain = 1.0 / POSE_RESIDUAL.powi(2) + count / photo;
        out.at[k] = seen.iter().map(|s| s[k]).sum::<f64>() / photo / certain;
        out.spread[k] = (1.0 / certain + photo).sqrt();
    }
    out
}

/// The same in a photo that shows all nodes at `shifts` (px): what the other nodes have in common is the pose's doing, and where
/// they disagree no place is sure.
pub fn in_photo(expected: &[Expected], shifts: &[[f64; 2]], node: usize) -> Expected {
    let (common, apart) = others(expected, shifts, node);
    let own = expected[node];
    Expected { at: [0, 1].map(|k| own.at[k] + common[k]), spread: [0, 1].map(|k| length(own.spread[k], apart[k])) }
}

/// What the other nodes of a photo have in common beside where they are expected (px), and by how much they disagree: a standard
/// deviation. Nothing where they are few.
pub fn others(expected: &[Expected], shifts: &[[f64; 2]], node: usize) -> ([f64; 2], [f64; 2]) {
    let (mut common, mut apart) = ([0.0; 2], [0.0; 2]);
    if expected.len() <= LEAST_OTHERS {
        return (common, apart);
    }
    let others: Vec<usize> = (0..expected.len()).filter(|&i| i != node).collect();
    for axis in 0..2 {
        let off: Vec<f32> = others.iter().map(|&i| (shifts[i][axis] - expected[i].at[axis]) as f32).collect();
        let middle = linear::median(&mut off.clone());
        let distance = linear::median(&mut off.iter().map(|o| (o - middle).abs()).collect::<Vec<_>>());
        common[axis] = f64::from(middle);
        // The median distance of a normal variable from its mean is 0.6745 standard deviations.
        apart[axis] = f64::from(distance) / 0.6745;
    }
    (common, apart)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::model::tests::tiny;

    fn node(spread: f64) -> Node {
        Node { spread: [spread; 2], ..tiny().nodes[0].clone() }
    }

    /// A normal prior of standard deviation 1 px and one reading of 0.4 px: the textbook's posterior, and a photo more.
    #[test]
    fn one_photo_moves_the_place_most_of_the_way() {
        let place = after(&node(1.0), &[[1.16, -0.58]]);
        assert!((place.at[0] - 1.0).abs() < 1e-12 && (place.at[1] + 0.5).abs() < 1e-12, "{place:?}");
        let sure = (0.16f64 / 1.16 + 0.16).sqrt();
        assert!(place.spread.iter().all(|s| (s - sure).abs() < 1e-12), "{place:?}");
        let many = after(&node(1.0), &vec![[1.16, 0.0]; 1000]);
        assert!((many.at[0] - 1.16).abs() < 1e-3 && (many.spread[0] - 0.4).abs() < 1e-3, "{many:?}");
    }

    #[test]
    fn a_part_with_play_is_expected_nowhere_exactly() {
        let (tight, loose) = (after(&node(1.0), &[[0.0; 2]]), after(&node(3.0), &[[0.0; 2]]));
        assert!(loose.spread[0] > 2.0 * tight.spread[0]);
    }

    #[test]
    fn what_all_others_do_is_the_poses_doing() {
        let expected = vec![after(&node(1.0), &[[0.0; 2]]); 6];
        let together = vec![[0.5, 0.0]; 6];
        assert_eq!(in_photo(&expected, &together, 2), Expected { at: [0.5, 0.0], ..expected[2] });
        // One that goes alone is held to where the others are.
        let mut alone = vec![[0.0; 2]; 6];
        alone[2] = [3.0, 0.0];
        assert_eq!(in_photo(&expected, &alone, 2), expected[2]);
        // Where everything scatters, nothing is sure; with too few others nothing is changed.
        let scattered: Vec<[f64; 2]> = (0..6).map(|i| [f64::from(i * i % 5) - 2.0, 0.0]).collect();
        assert!(in_photo(&expected, &scattered, 2).spread[0] > 2.0 * expected[2].spread[0]);
        assert_eq!(in_photo(&expected[..3], &together[..3], 2), expected[2]);
    }
}
