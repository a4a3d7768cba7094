//! Nodes that look like nothing the model knows: a chip, a foreign object, a part of some other kind.
//!
//! In: how unlike its good state each node of a photo is, square by square, what held-out renders of correct assemblies show
//! there, and what the calibration photo showed. Out: per node by how many standard deviations its oddest square is odder than
//! it should be, and which that is, and the node that stands out. Never says what it is.
//!
//! A square is held against itself: a bright rim is never quite as rendered, a plain face nearly always. Logarithms are
//! compared: unlikeness is a mean of squares' logarithms, so what a station adds to it, it adds by a factor. A model that is
//! not quite this station's makes all nodes of a photo less like themselves; only what is more than their middle counts.

use super::inspect::NodeReport;
use super::linear;
use super::math;
use super::model::{Node, SCALES, Usual};
use super::row::Row;

/// Mean surprise in every square of each size: steps of its logarithm from ln 0.001, counted from 1; 0 where a square holds
/// too few coefficients.
pub type Unlikeness = [Row; SCALES];

/// A square of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Square {
    /// Index into an [`Unlikeness`].
    pub scale: usize,
    /// Index into its row.
    pub index: usize,
}

/// Beyond this many standard deviations of renders a node is strange: of hundreds of squares the oddest counts, and photos
/// scatter more than renders.
const LIMIT: f64 = 5.0;
/// No square is strange whose coefficients lie, in the mean, nearer to what is expected than this (the surprise of one that
/// is 1.4 standard deviations off).
const LEAST: f64 = 1.0;
/// Unlikeness of a square in which every coefficient is three standard deviations off (Student's t, five degrees).
const FAR: f64 = 3.09;
/// Weight of the middle unlikeness of the photo's other nodes in what one may have.
const COMMON: f64 = 2.0;
/// Renders of one node scatter by at least this factor's logarithm: a few dozen do not show all that photos do.
const LEAST_DEVIATION: f64 = 0.3;
/// A square may show what so many good photos of it showed.
const HIGH: usize = 2;
/// Share of a normal variable below one standard deviation above its mean.
const ONE_DEVIATION_UP: f64 = 0.84;
/// What has no logarithm.
const FAINTEST: f64 = 1e-3;
/// Of the logarithms that are kept.
const STEP: f64 = 0.05;

/// The fault of a node that looks neither as it should nor as when faulty in any way that the compiler thought of.
pub const UNKNOWN: &str = "unknown";

/// Of the mean surprise in the squares of each size; NaN where there is none.
pub fn unlikeness(means: &[Vec<f64>; SCALES]) -> Unlikeness {
    let code = |&mean: &f64| if mean.is_nan() { 0 } else { code(math::ln(mean.max(FAINTEST))) };
    means.each_ref().map(|means| Row(means.iter().map(code).collect()))
}

/// A logarithm as it is kept.
fn code(log: f64) -> u16 {
    1 + ((log - math::ln(FAINTEST)) / STEP).round() as u16
}

/// The logarithm that a code stands for; `None` for a square with too few coefficients.
fn log(code: u16) -> Option<f64> {
    (code > 0).then(|| math::ln(FAINTEST) + f64::from(code - 1) * STEP)
}

/// The mean of several photos'.
pub fn mean(all: &[Unlikeness]) -> Option<Unlikeness> {
    let first = all.first()?;
    let square = |scale: usize, k: usize| {
        let sum: u32 = all.iter().map(|u| u32::from(u[scale].0[k])).sum();
        (sum / all.len() as u32) as u16
    };
    Some(std::array::from_fn(|scale| Row((0..first[scale].0.len()).map(|k| square(scale, k)).collect())))
}

/// Per node and size of squares what good photos show. `photos` holds, per photo, what each node shows and what it showed at
/// calibration; of good photos a share of `false_reject` may be strange.
pub fn usual(photos: &[(Vec<Unlikeness>, &[Option<Unlikeness>])], false_reject: f64) -> Vec<Vec<Usual>> {
    let nodes = photos.iter().map(|(unlike, _)| unlike.len()).min().unwrap_or(0);
    let mut usual = vec![Vec::new(); nodes];
    for scale in 0..SCALES {
        let highs = |node: usize| Highs::of(&photos.iter().map(|(unlike, _)| &unlike[node][scale]).collect::<Vec<_>>());
        let highs: Vec<Highs> = (0..nodes).map(highs).collect();
        let of = |(p, (unlike, calibrated)): (usize, &(Vec<Unlikeness>, &[Option<Unlikeness>]))| -> Vec<f64> {
            let of = |node: usize| {
                excess(&unlike[node][scale], &highs[node].without(Some(p)), before(calibrated, node, scale))
            };
            (0..nodes).map(of).collect()
        };
        let excesses: Vec<Vec<f64>> = photos.iter().enumerate().map(of).collect();
        let common = |node: usize| {
            let mut own: Vec<f32> = excesses.iter().map(|photo| photo[node] as f32).collect();
            f64::from(linear::median(&mut own))
        };
        let common: Vec<f64> = (0..nodes).map(common).collect();
        let beyond =
            |photo: &Vec<f64>| beyond(&photo.iter().zip(&common).map(|(e, c)| Some(e - c)).collect::<Vec<_>>());
        let beyond: Vec<Vec<f64>> = excesses.iter().map(beyond).collect();
        for (node, usual) in usual.iter_mut().enumerate() {
            let mut own: Vec<f64> = beyond.iter().map(|photo| photo[node]).collect();
            own.sort_by(f64::total_cmp);
            let deviation = deviation(&own, false_reject / (nodes * SCALES) as f64);
            usual.push(Usual { high: highs[node].without(None), excess: [common[node], deviation] });
        }
    }
    usual
}

/// The highest that each square showed in some photos, with the photo.
struct Highs(Vec<Vec<(u16, usize)>>);

impl Highs {
    fn of(all: &[&Row]) -> Highs {
        let squares = all.iter().map(|row| row.0.len()).min().unwrap_or(0);
        let square = |k: usize| {
            let mut codes: Vec<(u16, usize)> = all.iter().enumerate().map(|(p, row)| (row.0[k], p)).collect();
            codes.sort_unstable_by(|a, b| b.cmp(a));
            codes.truncate(HIGH + 1);
            codes
        };
        Highs((0..squares).map(square).collect())
    }

    /// Per square what [`HIGH`] photos reach, and not only one that went wrong; a photo that is held against the others is
    /// none of them.
    fn without(&self, photo: Option<usize>) -> Row {
        let of = |codes: &Vec<(u16, usize)>| {
            let others = codes.iter().filter(|(_, p)| Some(*p) != photo).map(|(code, _)| *code);
            others.take(HIGH).last().unwrap_or(0)
        };
        Row(self.0.iter().map(of).collect())
    }
}

/// The standard deviation by which to measure what lies beyond the usual, from ascending values of good photos. Where these belie
/// [`LIMIT`], the tail is heavier than a normal variable's, and the next photos will lie further out than the few that are known:
/// an exponential tail, whose mean excess over one deviation theirs is, then says where a share of `beyond` lies above the limit.
fn deviation(own: &[f64], beyond: f64) -> f64 {
    let highest = own[own.len() - 1];
    let high = own[((own.len() - 1) as f64 * ONE_DEVIATION_UP).round() as usize];
    let normal = high.max(LEAST_DEVIATION);
    if highest <= LIMIT * normal {
        return normal;
    }
    let over: Vec<f64> = own.iter().map(|v| v - high).filter(|v| *v > 0.0).collect();
    let mean = over.iter().sum::<f64>() / over.len() as f64;
    let limit = high + mean * math::ln((1.0 - ONE_DEVIATION_UP) / beyond).max(0.0);
    limit.max(highest) / LIMIT
}

/// By how much the logarithm of what a square shows exceeds what it usually shows, or what it showed at calibration, where it
/// does so most; 0 where no square is unlike.
fn excess(unlike: &Row, high: &Row, calibrated: Option<&Row>) -> f64 {
    oddest(unlike, high, calibrated).map_or(0.0, |(excess, _)| excess)
}

/// That excess, where it is above 0, and the square.
fn oddest(unlike: &Row, high: &Row, calibrated: Option<&Row>) -> Option<(f64, usize)> {
    let squares = unlike.0.iter().zip(&high.0).enumerate();
    let of = |(k, (&shown, &usual)): (usize, (&u16, &u16))| {
        let shown = log(shown).filter(|shown| *shown >= math::ln(LEAST))?;
        let before = calibrated.and_then(|row| log(*row.0.get(k)?));
        let excess = shown - before.map_or(log(usual)?, |before| before.max(log(usual).unwrap_or(before)));
        (excess > 0.0).then_some((excess, k))
    };
    squares.filter_map(of).max_by(|a, b| a.0.total_cmp(&b.0))
}

/// What a node showed at calibration.
fn before(calibrated: &[Option<Unlikeness>], node: usize, scale: usize) -> Option<&Row> {
    calibrated.get(node).and_then(Option::as_ref).map(|before| &before[scale])
}

/// By how much each node's excess is more than usual, and than the middle of what the photo's other nodes have more than
/// theirs. `more` holds the former, `None` where nothing is known of the node; it has 0.
fn beyond(more: &[Option<f64>]) -> Vec<f64> {
    let of = |i: usize| -> Option<f64> {
        let mut others: Vec<f32> =
            (0..more.len()).filter(|&k| k != i).filter_map(|k| more[k]).map(|e| e as f32).collect();
        let common = if others.is_empty() { 0.0 } else { f64::from(linear::median(&mut others)) };
        Some(more[i]? - common.max(0.0))
    };
    (0..more.len()).map(|i| of(i).unwrap_or(0.0)).collect()
}

/// By how much the nodes' excesses are more than usual.
fn more(
    unlike: &[Unlikeness],
    usual: &[Vec<Usual>],
    calibrated: &[Option<Unlikeness>],
    scale: usize,
) -> Vec<Option<f64>> {
    let more = |(i, unlike): (usize, &Unlikeness)| {
        let usual = usual.get(i)?.get(scale)?;
        Some(excess(&unlike[scale], &usual.high, before(calibrated, i, scale)) - usual.excess[0])
    };
    unlike.iter().enumerate().map(more).collect()
}

/// Writes every node's strangeness: standard deviations beyond what it may show. `calibrated` holds what each node showed in the
/// calibration photos, the mean of them. Returns per node the square that says so, `None` where none is odd.
pub fn weigh(nodes: &mut [NodeReport], of: &[Node], calibrated: &[Option<Unlikeness>]) -> Vec<Option<Square>> {
    let unlike: Vec<Unlikeness> = nodes.iter().map(|n| n.unlike.clone()).collect();
    let usual: Vec<Vec<Usual>> = of.iter().map(|n| n.usual.clone()).collect();
    nodes.iter_mut().for_each(|n| n.strangeness = 0.0);
    let mut squares = vec![None; nodes.len()];
    for scale in 0..SCALES {
        let beyond = beyond(&more(&unlike, &usual, calibrated, scale));
        for i in (0..nodes.len()).filter(|&i| usual[i].len() > scale) {
            let deviation = usual[i][scale].excess[1] * of_middle(nodes.len());
            if beyond[i] / deviation > nodes[i].strangeness {
                nodes[i].strangeness = beyond[i] / deviation;
                let odd = oddest(&unlike[i][scale], &usual[i][scale].high, before(calibrated, i, scale));
                squares[i] = odd.map(|(_, index)| Square { scale, index });
            }
        }
    }
    for (i, node) in nodes.iter_mut().enumerate() {
        let far = LIMIT * far(&unlike, i);
        if far > node.strangeness {
            node.strangeness = far;
            squares[i] = highest(&unlike[i]).map(|(index, _)| Square { scale: 0, index });
        }
    }
    squares
}

/// The highest of a node's largest squares, and what it shows.
fn highest(unlike: &Unlikeness) -> Option<(usize, f64)> {
    let (index, code) = unlike[0].0.iter().enumerate().max_by_key(|(_, code)| **code)?;
    Some((index, math::exp(log(*code)?)))
}

/// Renders of few draws leave much room for what they have not shown; but no square of a correct assembly is far from all that
/// was rendered, unless the whole photo is: how far it is of what decides (1 at the limit). A lone node has nothing to be
/// held against.
fn far(unlike: &[Unlikeness], node: usize) -> f64 {
    let highest = |k: usize| highest(&unlike[k]).map_or(0.0, |(_, shown)| shown);
    let mut others: Vec<f32> = (0..unlike.len()).filter(|&k| k != node).map(|k| highest(k) as f32).collect();
    let common = |others: &mut Vec<f32>| FAR + COMMON * f64::from(linear::median(others));
    if others.is_empty() { 0.0 } else { highest(node) / common(&mut others) }
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
    use crate::runtime::inspect::tests::correct;
    use crate::runtime::model::tests::tiny;

    /// A node of four squares of each size that show this many times 0.4, and the last `odd` times that.
    fn node(factor: f64, odd: f64) -> Unlikeness {
        unlikeness(&std::array::from_fn(|_| vec![0.4 * factor, f64::NAN, 0.4 * factor, 0.4 * factor * odd]))
    }

    fn usual_nodes(count: usize) -> Vec<Vec<Usual>> {
        let high = node(1.0, 1.0);
        let of = |scale: usize| Usual { high: high[scale].clone(), excess: [0.3, 0.25] };
        (0..count).map(|_| (0..SCALES).map(of).collect()).collect()
    }

    fn strangeness(photo: &[Unlikeness], calibrated: &[Unlikeness]) -> Vec<f64> {
        let calibrated: Vec<Option<Unlikeness>> = calibrated.iter().cloned().map(Some).collect();
        beyond(&more(photo, &usual_nodes(photo.len()), &calibrated, 0)).into_iter().map(|b| b / 0.25).collect()
    }

    fn nodes(count: usize, other: usize, unlike: Unlikeness) -> Vec<Unlikeness> {
        (0..count).map(|i| if i == other { unlike.clone() } else { node(1.0, 1.0) }).collect()
    }

    #[test]
    fn a_node_with_an_odd_square_is_strange() {
        let odd = strangeness(&nodes(5, 2, node(1.0, 8.0)), &nodes(5, 0, node(1.0, 1.0)));
        assert!(odd[2] > LIMIT, "{odd:?}");
        assert!(odd.iter().enumerate().all(|(i, s)| i == 2 || *s < 1.0), "{odd:?}");
    }

    #[test]
    fn the_odd_square_is_named() {
        let tiny = tiny().nodes.remove(0);
        let of: Vec<Node> = usual_nodes(5).into_iter().map(|usual| Node { usual, ..tiny.clone() }).collect();
        let report = |unlike: Unlikeness| NodeReport { unlike, ..correct() };
        let squares = |odd: f64| {
            let mut nodes: Vec<NodeReport> = nodes(5, 2, node(1.0, odd)).into_iter().map(report).collect();
            (weigh(&mut nodes, &of, &[])[2], strangest(&nodes))
        };
        // The last of four, in the size of squares that was looked at first, of all that say the same.
        let named = Some(Square { scale: 0, index: 3 });
        assert_eq!(squares(8.0), (named, Some(2)));
        assert_eq!(squares(400.0), (named, Some(2)), "far from all renders");
        assert_eq!(squares(1.0).1, None);
    }

    #[test]
    fn what_all_nodes_of_a_photo_have_in_common_is_not_strange() {
        let photo: Vec<Unlikeness> = [8.0, 8.8, 8.0, 7.2, 8.0].map(|f| node(f, 1.0)).into();
        let common = strangeness(&photo, &nodes(5, 0, node(1.0, 1.0)));
        assert!(common.iter().all(|s| s.abs() < 1.0), "{common:?}");
    }

    /// The rim of a part is not as rendered at this station: at calibration no more than today. Another square of it is.
    #[test]
    fn what_a_square_showed_at_calibration_is_not_strange_in_it() {
        let rim = |other: f64| unlikeness(&std::array::from_fn(|_| vec![0.4 * other, f64::NAN, 0.4, 3.2]));
        let known = strangeness(&nodes(5, 2, rim(1.0)), &nodes(5, 2, rim(1.0)));
        assert!(known.iter().all(|s| *s < 1.0), "{known:?}");
        assert!(strangeness(&nodes(5, 2, rim(8.0)), &nodes(5, 2, rim(1.0)))[2] > LIMIT);
    }

    #[test]
    fn a_node_far_from_all_renders_is_strange_whatever_they_leave_open() {
        let all = |v: f64| unlikeness(&std::array::from_fn(|_| vec![v; 2]));
        let limit = |node: f64, others: f64| far(&[all(node), all(others)], 0);
        assert!(limit(4.4, 0.5) > 1.0 && limit(3.9, 0.5) < 1.0 && limit(4.4, 1.0) < 1.0);
        assert_eq!(far(&[all(9.0)], 0), 0.0);
    }

    #[test]
    fn a_lone_node_is_held_against_what_it_usually_shows() {
        assert!(strangeness(&[node(1.0, 8.0)], &[node(1.0, 1.0)])[0] > LIMIT);
        assert_eq!(beyond(&more(&[node(1.0, 8.0)], &[], &[], 0)), [0.0], "nothing is known of it");
    }

    #[test]
    fn logarithms_come_back_to_half_a_step() {
        for value in [1e-3, 0.07, 1.0, 3.3, 50.0] {
            assert!((log(code(math::ln(value))).unwrap() - math::ln(value)).abs() <= STEP / 2.0 + 1e-12);
        }
        assert_eq!(unlikeness(&std::array::from_fn(|_| vec![f64::NAN]))[0].0, [0]);
        assert_eq!(mean(&[node(1.0, 1.0), node(1.0, 1.0)]), Some(node(1.0, 1.0)));
    }

    /// 36 good photos of normal scatter, then with one that lies beyond five deviations: its excess of 1.47 is one of six over the
    /// 84th percentile, so the mean excess is 0.27, and one in 36 000 lies ln(0.16 · 36 000) = 8.7 times that beyond it.
    #[test]
    fn a_photo_beyond_the_limit_says_that_others_will_lie_further_out() {
        let mut own: Vec<f64> = (0..36).map(|i| f64::from(i) / 35.0 * 0.4 - 0.2).collect();
        assert_eq!(deviation(&own, 1e-3 / 36.0), LEAST_DEVIATION);
        own[35] = 1.6;
        let (high, over) = (own[29], [own[30], own[31], own[32], own[33], own[34], own[35]].map(|v| v - own[29]));
        let mean = over.iter().sum::<f64>() / 6.0;
        let limit = high + mean * (0.16f64 * 36e3).ln();
        let found = deviation(&own, 1e-3 / 36.0) * LIMIT;
        assert!((found - limit).abs() < 1e-9 && found > 1.4 * 1.6, "{found} {limit}");
        assert!(deviation(&own, 0.9) * LIMIT >= 1.6, "no photo of these is strange");
    }

    /// Of good photos none is strange; each square is held against its own middle, the rest is scatter.
    #[test]
    fn no_good_photo_is_strange_by_what_is_learnt_of_them() {
        let square =
            |p: usize, n: usize, k: usize| [1.0, 2.0, 4.0][k] * (1.0 + 0.3 * ((p * 7 + n * 3 + k * 5) % 4) as f64);
        let unlike = |p: usize| -> Vec<Unlikeness> {
            (0..6).map(|n| unlikeness(&std::array::from_fn(|_| (0..3).map(|k| square(p, n, k)).collect()))).collect()
        };
        let photos: Vec<(Vec<Unlikeness>, &[Option<Unlikeness>])> = (0..30).map(|p| (unlike(p), &[][..])).collect();
        let learnt = usual(&photos, 1e-3);
        for (photo, calibrated) in &photos {
            for scale in 0..SCALES {
                for (beyond, of) in beyond(&more(photo, &learnt, calibrated, scale)).iter().zip(&learnt) {
                    assert!(beyond / of[scale].excess[1] <= LIMIT + 1e-9);
                    assert!(of[scale].excess[1] < 0.5, "squares of unlike height are no scatter: {of:?}");
                }
            }
        }
    }
}
