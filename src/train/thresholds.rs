//! From what held-out renders scored to the thresholds of a node's error modes.
//!
//! In: log-likelihood ratios of good and faulty renders against every hypothesis of a node. Out: a threshold per hypothesis and
//! the node's scores. Never looks at an image.

use super::stats::{normal_quantile, rounded};
use crate::runtime::inspect;
use crate::runtime::judge::INDEPENDENT;
use crate::runtime::model::Node;
use crate::runtime::rise::{Lift, Shown};

/// Share of the lowest goods and the highest faults left out when asking whether they overlap: photos in which the pose
/// went wrong, which say nothing about the node.
pub(super) const TRIM: f64 = 0.1;
/// Fewer faulty renders say nothing of a hypothesis by themselves.
const FEWEST: usize = 4;
/// Who finds next to nothing gains nothing by coming near the goods: their spread, of which a few dozen renders of a few stations
/// tell little, counts so many times.
const SILENT: f64 = 2.0;
/// Share of a normal variable more than one standard deviation below its mean.
const ONE_DEVIATION_DOWN: f64 = 0.16;
/// Standard deviation of a part's place in a photo (px) although it is in its place, beside what renders show of that: edges are not
/// quite as rendered.
const LEAST_PLACE: f64 = 0.2;

/// What the held-out renders showed of one node: per render the ratio against each hypothesis.
pub struct Seen {
    pub good: Vec<Vec<f64>>,
    /// By error mode.
    pub faulty: Vec<(String, Vec<Vec<f64>>)>,
}

/// Writes the thresholds and the scores into the node. `false_reject` is the node's share of what the spec allows. A mode
/// that hardly differs from the good state must not make the node blind to one that does, nor a small fault to a large one: so
/// each hypothesis has its own, from the renders of its mode that look most like it.
pub fn set(node: &mut Node, seen: &Seen, false_reject: f64) {
    if node.hypotheses.len() < 2 {
        return;
    }
    let share = false_reject / node.hypotheses.len().saturating_sub(1).max(1) as f64;
    for (kind, faulty) in &seen.faulty {
        let own: Vec<usize> = (1..node.hypotheses.len()).filter(|&h| node.hypotheses[h].fault == *kind).collect();
        for &h in &own {
            let nearest = |against: &&Vec<f64>| own.iter().all(|&other| against[h] <= against[other]);
            let alike: Vec<Vec<f64>> = faulty.iter().filter(nearest).cloned().collect();
            let faulty = if alike.len() < FEWEST { faulty } else { &alike };
            let against = |all: &Vec<f64>| all[h];
            let limit = threshold(&sorted(&seen.good, against), &sorted(faulty, against), share, INDEPENDENT);
            node.hypotheses[h].threshold = rounded(limit);
        }
    }
    let score = |against: &Vec<f64>| rounded(inspect::score(node, against).1);
    let faulty: Vec<Vec<f64>> = seen.faulty.iter().flat_map(|(_, of)| of.iter().cloned()).collect();
    let scores = (sorted(&seen.good, score), sorted(&faulty, score));
    (node.good_scores, node.fault_scores) = scores;
}

fn sorted(all: &[Vec<f64>], value: impl Fn(&Vec<f64>) -> f64) -> Vec<f64> {
    let mut out: Vec<f64> = all.iter().map(value).collect();
    out.sort_by(f64::total_cmp);
    out
}

/// The log-likelihood ratio below which a node counts as faulty in one way. Its sign decides, less what the promised rate of false
/// rejects takes: of good renders a share `p0` falls below zero, and from there on likelihood ratios fall off as their own size
/// says (a ratio of Λ is at most 1 / Λ as likely, Markov's inequality). Where the bulk of the goods reaches below zero, or it overlaps
/// with that of the faulty ones and less than half of these are found, ratios are not what they say, and the spread of the goods may
/// take more.
/// Ratios are natural logarithms, a ratio of 1 being that of `independent` coefficients' worth.
/// What then finds less than a quarter of the faulty renders that show most is kept far from the goods.
/// Never a quantile of the goods: their few lowest scores say nothing about a photo's.
pub(super) fn threshold(good: &[f64], fault: &[f64], false_reject: f64, independent: f64) -> f64 {
    if good.is_empty() || fault.is_empty() {
        return 0.0;
    }
    let (lowest, highest) = (at_share(good, TRIM), at_share(fault, 1.0 - TRIM));
    let middle = at_share(good, 0.5);
    let below_zero = below_zero(middle, middle - at_share(good, ONE_DEVIATION_DOWN));
    let by_ratio = -(below_zero / false_reject).ln().max(0.0) / independent;
    let found = fault.iter().filter(|f| **f < by_ratio).count();
    if lowest > 0.0 && (lowest > highest || 2 * found >= fault.len()) {
        return by_ratio;
    }
    let mut distances: Vec<f64> = good.iter().map(|g| (g - middle).abs()).collect();
    distances.sort_by(f64::total_cmp);
    // The median distance of a normal variable from its mean is 0.6745 standard deviations.
    let deviation = at_share(&distances, 0.5) / 0.6745;
    let by_spread = |deviations: f64| (middle - deviations * deviation).min(by_ratio);
    let usual = normal_quantile(1.0 - false_reject);
    let shown = most_shown(fault);
    let found = shown.iter().filter(|f| **f < by_spread(usual)).count();
    by_spread(if 4 * found >= shown.len() { usual } else { SILENT * usual })
}

/// From how high a part appears to stand in correct assemblies and where it is not seated, and how far (px) its image moves per mm
/// of rise. `None` where that does not tell one from the other.
pub(super) fn shown(good: &[Lift], faulty: &[Lift], px_per_mm: f64) -> Option<Shown> {
    let lifts = |all: &[Lift], value: &dyn Fn(&Lift) -> f64| {
        let mut out: Vec<f64> = all.iter().map(value).collect();
        out.sort_by(f64::total_cmp);
        (!out.is_empty()).then_some(out)
    };
    let seated = lifts(good, &|l| l.mm)?;
    let (low, high) = (at_share(&seated, ONE_DEVIATION_DOWN), at_share(&seated, 1.0 - ONE_DEVIATION_DOWN));
    let deviation = high.max(-low).max(LEAST_PLACE / px_per_mm);
    let unsure = at_share(&lifts(good, &|l| l.unsure)?, 0.5).max(LEAST_PLACE / px_per_mm);
    let middle = at_share(&lifts(faulty, &|l| l.mm)?, 0.5).max(0.0);
    let spread = at_share(&lifts(faulty, &|l| (l.mm - middle).abs())?, 0.5) / 0.6745;
    let raised = [middle, spread.max(deviation)];
    (middle > deviation).then(|| Shown {
        seated: rounded(deviation),
        unsure: rounded(unsure),
        raised: raised.map(rounded),
    })
}

/// Share of a normal variable below zero, from its mean and its deviation downwards: Chernoff's bound, halved.
fn below_zero(middle: f64, deviation: f64) -> f64 {
    if middle <= 0.0 { 0.5 } else { 0.5 * (-0.5 * (middle / deviation.max(f64::MIN_POSITIVE)).powi(2)).exp() }
}

/// Of the ascending scores of faulty renders the half that shows most: a sweep begins with sizes that nobody could tell.
pub(super) fn most_shown(faulty: &[f64]) -> &[f64] {
    &faulty[..faulty.len().div_ceil(2)]
}

/// The value below which a share of ascending values lies.
pub(super) fn at_share(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::model::Hypothesis;
    use crate::runtime::model::tests::tiny;

    #[test]
    fn the_sign_decides_where_renders_lie_apart() {
        let good = [0.2, 0.4, 0.42, 0.45, 0.45, 0.45, 0.48, 0.5, 0.5, 0.5, 0.6];
        let fault = [-0.9, -0.8, -0.8, -0.7, -0.6, -0.5, -0.5, -0.4, -0.3, -0.2, 0.1];
        assert_eq!(threshold(&good, &fault, 1e-3, INDEPENDENT), 0.0);
    }

    /// Goods of mean 0.2 and deviation 0.1 fall below zero in 0.5 e^-2 = 6.8 % of photos; one in a thousand is allowed:
    /// ln 67.7 = 4.2 in a hundred independent coefficients.
    #[test]
    fn goods_near_zero_lower_it_by_what_the_promise_takes() {
        let good = [0.0, 0.1, 0.1, 0.15, 0.2, 0.2, 0.2, 0.25, 0.3, 0.3, 0.4];
        let limit = threshold(&good, &[-0.8, -0.7, -0.6, -0.5], 1e-3, INDEPENDENT);
        assert!((limit + (0.5f64 * (-2.0f64).exp() / 1e-3).ln() / 100.0).abs() < 1e-9, "{limit}");
        assert!(
            threshold(&good, &[-0.8, -0.7, -0.6, -0.5], 1e-5, INDEPENDENT) < limit,
            "a stricter promise costs more"
        );
    }

    /// Good renders of a part that hardly shows scatter into what its faults look like: who finds one fault in five may not
    /// reject as many good ones.
    #[test]
    fn what_finds_next_to_nothing_rejects_nothing() {
        let good = [0.01, 0.02, 0.05, 0.08, 0.1, 0.12, 0.15, 0.18, 0.2];
        let limit = |fault: &[f64]| threshold(&good, fault, 1e-3, INDEPENDENT);
        let spread = |deviations: f64| 0.1 - deviations * 3.0902 * 0.05 / 0.6745;
        assert!((limit(&[-0.3, 0.0, 0.05, 0.1, 0.1]) - spread(1.0)).abs() < 1e-3, "one of the three that show most");
        assert!((limit(&[-0.1, 0.0, 0.05, 0.1, 0.1]) - spread(SILENT)).abs() < 1e-3, "none");
        assert!(limit(&[-0.3, -0.3, -0.3, 0.05, 0.1]) > spread(1.0) + 0.05, "most are found");
    }

    /// Of a sweep the large half lies apart, the small half does not: it alone has the spread's threshold.
    #[test]
    fn a_small_fault_hides_no_large_one() {
        let good: Vec<Vec<f64>> =
            [-0.1, -0.02, 0.0, 0.05, 0.1, 0.15].iter().map(|&small| vec![0.0, small, 0.5 + small]).collect();
        let small = [-0.3, -0.2, -0.1, 0.0, 0.05].map(|v| vec![0.0, v, v + 0.3]);
        let large = [-0.9, -0.8, -0.7, -0.6, -0.5].map(|v| vec![0.0, v + 0.4, v]);
        let faulty = vec![("not seated".to_string(), small.into_iter().chain(large).collect())];
        let mut node = tiny().nodes.remove(0);
        let of = |fault: &str| Hypothesis { fault: fault.into(), ..node.hypotheses[0].clone() };
        node.hypotheses = ["good", "not seated", "not seated"].map(of).into();
        set(&mut node, &Seen { good, faulty }, 1e-3);
        let limits: Vec<f64> = node.hypotheses.iter().map(|h| h.threshold).collect();
        assert!(limits[1] < -0.2 && limits[2] > -0.1, "{limits:?}");
    }

    /// A gap between good and faulty renders, however clear, says nothing of the next good one where the ratio has no meaning: only
    /// their spread does.
    #[test]
    fn a_gap_below_zero_is_no_promise() {
        let good = [-0.05, -0.04, -0.03, -0.01, 0.0, 0.05, 0.1, 0.15, 0.2, 0.25];
        let limit = threshold(&good, &[-0.09, -0.08, -0.08, -0.07, -0.06, -0.06], 1e-3, INDEPENDENT);
        assert!(limit < -0.3, "{limit}");
        let far = threshold(&[-0.2, -0.1, 0.0], &[-0.8, -0.7, -0.6], 1e-3, INDEPENDENT);
        assert!((far - (-0.1 - 3.0902 * 0.1 / 0.6745)).abs() < 1e-3, "{far}");
        assert_eq!(threshold(&[0.3, 0.4], &[0.1, 0.2], 1e-3, INDEPENDENT), 0.0);
    }

    #[test]
    fn where_they_overlap_the_spread_of_the_goods_decides_if_it_takes_more() {
        let limit = |good: &[f64]| threshold(good, &[-0.3, -0.1, 0.0, 0.1], 1e-3, INDEPENDENT);
        let (by_spread, by_ratio) = (|deviation: f64| -3.0902 * deviation / 0.6745, -(0.5f64 / 1e-3).ln() / 100.0);
        assert!((limit(&[-0.010, -0.005, 0.0, 0.005, 0.010]) - by_ratio).abs() < 1e-9, "what the ratio takes");
        assert!((limit(&[-0.1, -0.05, 0.0, 0.05, 0.1]) - by_spread(0.05)).abs() < 1e-3, "renders belie the ratio");
    }

    /// Seated parts within 0.1 mm, raised ones from 0.5 to 1 mm; an image that moves by 10 px per mm tells 0.02 mm at best, one
    /// by 1 px per mm 0.2 mm.
    #[test]
    fn a_place_tells_raised_from_seated_only_where_it_can() {
        let lifts = |mm: &[f64]| mm.iter().map(|&mm| Lift { mm, unsure: 0.05 }).collect::<Vec<_>>();
        let good = lifts(&[-0.1, -0.05, -0.05, 0.0, 0.0, 0.05, 0.1]);
        let raised = lifts(&[0.5, 0.6, 0.7, 0.8, 1.0]);
        let of = |good: &[Lift], px_per_mm: f64| shown(good, &raised, px_per_mm);
        assert_eq!(of(&good, 10.0), Some(Shown { seated: 0.05, unsure: 0.05, raised: [0.7, rounded(0.1 / 0.6745)] }));
        assert_eq!(of(&good, 1.0).map(|s| (s.seated, s.raised)), Some((0.2, [0.7, 0.2])));
        assert_eq!(of(&lifts(&[-1.0, -0.9, -0.8, 0.0, 0.8, 0.9, 1.0]), 10.0), None, "seated parts scatter as much");
        assert_eq!(of(&[], 10.0), None);
        assert_eq!(shown(&good, &[], 10.0), None);
    }
}
