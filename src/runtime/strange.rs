//! Nodes that look like nothing the model knows: a chip, a foreign object, a part of some other kind.
//!
//! In: how unlike its good state each node of a photo is where it is least like it, what held-out renders of correct
//! assemblies show there, and what the calibration photo showed. Out: per node by how many standard deviations that is more
//! than it should be, and the node that stands out. Never says what it is.
//!
//! Logarithms are compared: unlikeness is a mean of squares' logarithms, so what a station adds to it, it adds by a factor.
//! A model that is not quite this station's makes all nodes of a photo less like themselves; only what is more than their
//! middle counts.

use super::inspect::NodeReport;
use super::linear;
use super::math;
use super::model::{Node, SCALES};

/// Mean surprise in the least likely square of each size.
pub type Unlikeness = [f64; SCALES];

/// Beyond this many standard deviations a node is strange: once in four thousand nodes if the logarithms were normal.
const LIMIT: f64 = 3.5;
/// No square is strange whose coefficients lie, in the mean, nearer to what is expected than this (the surprise of one that
/// is 1.4 standard deviations off).
const LEAST: f64 = 1.0;
/// Unlikeness of a square in which every coefficient is three standard deviations off (Student's t, five degrees).
const FAR: f64 = 3.09;
/// Weight of the middle unlikeness of the photo's other nodes in what one may have.
const COMMON: f64 = 2.0;
/// Renders of one node scatter by at least this factor's logarithm: a few dozen do not show all that photos do.
const LEAST_DEVIATION: f64 = 0.25;
/// Share of a normal variable below one standard deviation above its mean.
const ONE_DEVIATION_UP: f64 = 0.84;
/// What has no logarithm.
const FAINTEST: f64 = 1e-3;

/// The fault of a node that looks neither as it should nor as when faulty in any way that the compiler thought of.
pub const UNKNOWN: &str = "unknown";

/// The mean of several photos'.
pub fn mean(all: &[Unlikeness]) -> Option<Unlikeness> {
    let count = all.len() as f64;
    (!all.is_empty()).then(|| std::array::from_fn(|scale| all.iter().map(|u| u[scale]).sum::<f64>() / count))
}

/// Per node and size of squares the middle of the logarithms of what good photos show, and the deviation upwards of what is
/// left of them beyond what a photo's nodes have in common (see [`weigh`]). `photos` holds, per photo, what each node shows
/// and what it showed at calibration.
pub fn usual(photos: &[(Vec<Unlikeness>, &[Option<Unlikeness>])]) -> Vec<Vec<[f64; 2]>> {
    let nodes = photos.iter().map(|(unlike, _)| unlike.len()).min().unwrap_or(0);
    let mut usual = vec![vec![[0.0, LEAST_DEVIATION]; SCALES]; nodes];
    for scale in 0..SCALES {
        for node in 0..nodes {
            let mut logs: Vec<f32> = photos.iter().map(|(unlike, _)| log(unlike[node][scale]) as f32).collect();
            usual[node][scale][0] = f64::from(linear::median(&mut logs));
        }
        let beyond: Vec<Vec<f64>> =
            photos.iter().map(|(unlike, calibrated)| beyond(unlike, &usual, calibrated, scale)).collect();
        for node in 0..nodes {
            let mut own: Vec<f64> = beyond.iter().map(|photo| photo[node]).collect();
            own.sort_by(f64::total_cmp);
            let high = own[((own.len() - 1) as f64 * ONE_DEVIATION_UP).round() as usize];
            // Tails may be heavier than a normal variable's: no photo of these is strange.
            let highest = own[own.len() - 1] / LIMIT;
            usual[node][scale][1] = high.max(highest).max(LEAST_DEVIATION);
        }
    }
    usual
}

fn log(unlikeness: f64) -> f64 {
    math::ln(unlikeness.max(FAINTEST))
}

/// By how much the logarithm of what each node shows exceeds what it may show: its own usual, and more by as much as the middle
/// of the photo's other nodes shows more than theirs, or as it did itself at calibration. 0 where nothing is known of the
/// node.
fn beyond(unlike: &[Unlikeness], usual: &[Vec<[f64; 2]>], calibrated: &[Option<Unlikeness>], scale: usize) -> Vec<f64> {
    let excess = |i: usize, u: &Unlikeness| Some(log(u[scale]) - usual.get(i)?.get(scale)?[0]);
    let all: Vec<Option<f64>> = unlike.iter().enumerate().map(|(i, u)| excess(i, u)).collect();
    let of = |i: usize| -> Option<f64> {
        let mut others: Vec<f32> =
            (0..all.len()).filter(|&k| k != i).filter_map(|k| all[k]).map(|e| e as f32).collect();
        let common = if others.is_empty() { 0.0 } else { f64::from(linear::median(&mut others)) };
        let before = calibrated.get(i).copied().flatten().and_then(|u| excess(i, &u)).unwrap_or(0.0);
        Some(all[i]? - common.max(before).max(0.0))
    };
    (0..all.len()).map(|i| of(i).unwrap_or(0.0)).collect()
}

/// Writes every node's strangeness: standard deviations beyond what it may show, 0 where it is not even unlike. `calibrated`
/// holds what each node showed in the calibration photos, the mean of them.
pub fn weigh(nodes: &mut [NodeReport], of: &[Node], calibrated: &[Option<Unlikeness>]) {
    let unlike: Vec<Unlikeness> = nodes.iter().map(|n| n.unlike).collect();
    let usual: Vec<Vec<[f64; 2]>> = of.iter().map(|n| n.usual.clone()).collect();
    nodes.iter_mut().for_each(|n| n.strangeness = 0.0);
    for scale in 0..SCALES {
        let beyond = beyond(&unlike, &usual, calibrated, scale);
        let known = (0..nodes.len()).filter(|&i| usual[i].len() > scale && unlike[i][scale] >= LEAST);
        for i in known {
            nodes[i].strangeness = nodes[i].strangeness.max(beyond[i] / (usual[i][scale][1] * of_middle(nodes.len())));
        }
    }
    for (i, node) in nodes.iter_mut().enumerate() {
        node.strangeness = node.strangeness.max(LIMIT * far(&unlike, i));
    }
}

/// Renders of few draws leave much room for what they have not shown; but no square of a correct assembly is far from all that
/// was rendered, unless the whole photo is: how far it is of what decides (1 at the limit). A lone node has nothing to be
/// held against.
fn far(unlike: &[Unlikeness], node: usize) -> f64 {
    let mut others: Vec<f32> = (0..unlike.len()).filter(|&k| k != node).map(|k| unlike[k][0] as f32).collect();
    if others.is_empty() { 0.0 } else { unlike[node][0] / (FAR + COMMON * f64::from(linear::median(&mut others))) }
}

/// What the scatter of the other nodes' median adds to a deviation from it: its variance is π/2 of the mean's.
fn of_middle(nodes: usize) -> f64 {
    let others = nodes.saturating_sub(1).max(1) as f64;
    (1.0 + std::f64::consts::FRAC_PI_2 / others).sqrt()
}

/// The strangest node, if it is strange.
pub fn strangest(nodes: &[NodeReport]) -> Option<usize> {
    let strange = (0..nodes.len()).filter(|&i| nodes[i].strangeness > LIMIT);
    strange.max_by(|&a, &b| nodes[a].strangeness.total_cmp(&nodes[b].strangeness))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo(factors: &[f64]) -> Vec<Unlikeness> {
        factors.iter().map(|f| [2.0 * f; SCALES]).collect()
    }

    fn strangeness(factors: &[f64], calibrated: &[f64]) -> Vec<f64> {
        let usual = vec![vec![[2.0f64.ln(), 0.3]; SCALES]; factors.len()];
        let calibrated: Vec<Option<Unlikeness>> = photo(calibrated).into_iter().map(Some).collect();
        beyond(&photo(factors), &usual, &calibrated, 0).into_iter().map(|b| b / 0.3).collect()
    }

    #[test]
    fn one_node_that_shows_more_than_the_others_is_strange() {
        let as_ever = [1.0; 5];
        let odd = strangeness(&[1.0, 1.1, 4.0, 0.9, 1.0], &as_ever);
        assert!(odd[2] > LIMIT, "{odd:?}");
        assert!(odd.iter().enumerate().all(|(i, s)| i == 2 || *s < 1.0), "{odd:?}");
    }

    #[test]
    fn what_all_nodes_of_a_photo_have_in_common_is_not_strange() {
        let common = strangeness(&[4.0, 4.4, 4.0, 3.6, 4.0], &[1.0; 5]);
        assert!(common.iter().all(|s| s.abs() < 1.0), "{common:?}");
    }

    #[test]
    fn what_a_node_showed_at_calibration_is_not_strange() {
        let known = strangeness(&[1.0, 1.1, 4.0, 0.9, 1.0], &[1.0, 1.0, 3.5, 1.0, 1.0]);
        assert!(known.iter().all(|s| *s < 1.0), "{known:?}");
    }

    #[test]
    fn a_node_far_from_all_renders_is_strange_whatever_they_leave_open() {
        let limit = |node: f64, others: f64| far(&[[node; SCALES], [others; SCALES]], 0);
        assert!(limit(4.2, 0.5) > 1.0 && limit(4.0, 0.5) < 1.0 && limit(4.2, 1.0) < 1.0);
        assert_eq!(far(&[[9.0; SCALES]], 0), 0.0);
    }

    #[test]
    fn a_lone_node_is_held_against_what_it_usually_shows() {
        assert!(strangeness(&[4.0], &[1.0])[0] > LIMIT);
        assert_eq!(beyond(&photo(&[4.0]), &[], &[], 0), [0.0], "nothing is known of it");
    }

    /// Logarithms of the nodes differ by a common term per photo, which is no deviation of theirs, and by 0, 0.5 or -0.5.
    #[test]
    fn the_deviation_is_what_is_left_beyond_the_photos_common_term() {
        let own = |photo: usize, node: usize| [0.0, 0.5, -0.5][(photo + node) % 3];
        let unlike = |p: usize| -> Vec<Unlikeness> {
            let common = (p % 5) as f64 - 2.0;
            (0..30).map(|node| [(node as f64 / 10.0 + common + own(p, node)).exp(); SCALES]).collect()
        };
        let photos: Vec<_> = (0..30).map(|p| (unlike(p), &[][..])).collect();
        for (node, of) in usual(&photos).iter().enumerate() {
            assert!((of[0][0] - node as f64 / 10.0).abs() < 0.51, "{node} {of:?}");
            assert!(of[0][1] < 1.1, "{node} {of:?}: without the common term it were 1.5 and more");
        }
    }
}
