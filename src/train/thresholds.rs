//! From what held-out renders scored to the thresholds of a node's error modes.
//!
//! In: log-likelihood ratios of good and faulty renders against every hypothesis of a node. Out: a threshold per hypothesis and
//! the node's scores. Never looks at an image.

use super::stats::rounded;
use crate::runtime::inspect;
use crate::runtime::judge::INDEPENDENT;
use crate::runtime::model::Node;
use crate::runtime::rise::{Lift, Shown};

/// Good renders that say, before any is seen, that ratios below zero are as rare as their size says.
const TRUSTED: f64 = 15.0;
/// No render counts for more than this many times what ratios say for themselves: in a photo in which the pose went wrong every
/// node looks wrong, which says nothing of one of them.
const WILDEST: f64 = 10.0;
/// Fewer faulty renders say nothing of a hypothesis by themselves.
const FEWEST: usize = 4;
/// Who finds next to nothing gains nothing by coming near the goods, of which a few dozen renders of a few stations tell little.
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
/// each hypothesis has its own.
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

/// The log-likelihood ratio below which a node counts as faulty in one way, from those of good renders, ascending. Its sign decides,
/// less what the promised rate of false rejects takes: of good renders a share falls below zero, and from there on ever fewer, by the
/// exponential law of likelihood ratios: a ratio of Λ is at most 1 / Λ as likely (Markov's inequality), so that the mean below zero
/// is 1 / `independent` (ratios are natural logarithms, a ratio of 1 being that of `independent` coefficients' worth). Where
/// renders lie further below on average, ratios are not what they say, and the renders are believed in proportion to their number.
/// Where faulty renders lie has nothing to do with what a good photo shows; but what would find less than a quarter of those
/// that show most is kept away from the goods.
pub(super) fn threshold(good: &[f64], fault: &[f64], false_reject: f64, independent: f64) -> f64 {
    if good.is_empty() || fault.is_empty() {
        return 0.0;
    }
    let middle = at_share(good, 0.5);
    let below: Vec<f64> = good.iter().filter(|g| **g < 0.0).map(|g| -g.max(-WILDEST / independent)).collect();
    let seen = below.len() as f64 / good.len() as f64;
    let share = below_zero(middle, middle - at_share(good, ONE_DEVIATION_DOWN)).max(seen);
    let mean = (below.iter().sum::<f64>() + TRUSTED / independent) / (below.len() as f64 + TRUSTED);
    let limit = -(share / false_reject).ln().max(0.0) * mean.max(1.0 / independent);
    let shown = most_shown(fault);
    let found = shown.iter().filter(|f| **f < limit).count();
    if 4 * found >= shown.len() { limit } else { SILENT * limit }
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

    /// Faults that every threshold finds.
    const CLEAR: [f64; 4] = [-3.0; 4];

    #[test]
    fn the_sign_decides_where_goods_lie_far_above_zero() {
        let good = [0.2, 0.4, 0.42, 0.45, 0.45, 0.45, 0.48, 0.5, 0.5, 0.5, 0.6];
        assert_eq!(threshold(&good, &CLEAR, 1e-3, INDEPENDENT), 0.0);
        assert_eq!(threshold(&[], &CLEAR, 1e-3, INDEPENDENT), 0.0);
    }

    /// Goods of mean 0.2 and deviation 0.1 fall below zero in 0.5 e^-2 = 6.8 % of photos; one in a thousand is allowed:
    /// ln 67.7 = 4.2 in a hundred independent coefficients.
    #[test]
    fn goods_near_zero_lower_it_by_what_the_promise_takes() {
        let good = [0.0, 0.1, 0.1, 0.15, 0.2, 0.2, 0.2, 0.25, 0.3, 0.3, 0.4];
        let limit = threshold(&good, &CLEAR, 1e-3, INDEPENDENT);
        assert!((limit + (0.5f64 * (-2.0f64).exp() / 1e-3).ln() / 100.0).abs() < 1e-9, "{limit}");
        assert!(threshold(&good, &CLEAR, 1e-5, INDEPENDENT) < limit, "a stricter promise costs more");
    }

    /// Three of 24 goods lie 0.05 below zero on average, where fifteen trusted ones would lie 0.01: 0.3 / 18 together, and one
    /// in eight is 125 times too many.
    #[test]
    fn renders_that_belie_the_ratio_lower_it_in_proportion_to_their_number() {
        let good = |low: [f64; 3]| -> Vec<f64> { low.into_iter().chain([0.5; 21]).collect() };
        let limit = |low: [f64; 3]| threshold(&good(low), &CLEAR, 1e-3, INDEPENDENT);
        let deep = limit([-0.06, -0.05, -0.04]);
        assert!((deep + 0.3 / 18.0 * 125f64.ln()).abs() < 1e-9, "{deep}");
        let shallow = limit([-0.006, -0.005, -0.004]);
        assert!((shallow + 0.01 * 125f64.ln()).abs() < 1e-9, "never less than ratios say: {shallow}");
        assert_eq!(limit([-5.0, -0.05, -0.04]), limit([-0.1, -0.05, -0.04]), "a lost photo says only that it was lost");
    }

    /// Who finds one in four of those that show most may come as near as the goods allow.
    #[test]
    fn what_finds_next_to_nothing_stays_away_from_the_goods() {
        let good = [0.0, 0.1, 0.1, 0.15, 0.2, 0.2, 0.2, 0.25, 0.3, 0.3, 0.4];
        let limit = |fault: &[f64]| threshold(&good, fault, 1e-3, INDEPENDENT);
        assert_eq!(limit(&[-0.3, 0.0, 0.05, 0.1, 0.1]), limit(&CLEAR));
        assert_eq!(limit(&[-0.01, 0.0, 0.05, 0.1, 0.1]), SILENT * limit(&CLEAR));
    }

    proptest::proptest! {
        /// It never finds what looks better than good, and the stricter promise finds no more.
        #[test]
        fn a_stricter_promise_never_rejects_more(mut good in proptest::collection::vec(-1.0f64..1.0, 1..40), share in 1e-6f64..0.1) {
            good.sort_by(f64::total_cmp);
            let [strict, lax] = [0.1, 1.0].map(|by| threshold(&good, &CLEAR, by * share, INDEPENDENT));
            proptest::prop_assert!(strict <= lax && lax <= 0.0);
        }
    }

    /// A small fault near which the goods lie takes nothing of a large one's threshold.
    #[test]
    fn a_small_fault_hides_no_large_one() {
        let good = [-0.1, -0.02, 0.0, 0.05, 0.1, 0.15].map(|small| vec![0.0, small, 0.5 + small]).to_vec();
        let mut node = tiny().nodes.remove(0);
        let of = |fault: &str| Hypothesis { fault: fault.into(), ..node.hypotheses[0].clone() };
        node.hypotheses = ["good", "not seated", "not seated"].map(of).into();
        let faulty = vec![vec![0.0, -0.5, 0.2], vec![0.0, -0.5, -0.9]];
        set(&mut node, &Seen { good, faulty: vec![("not seated".into(), faulty)] }, 1e-3);
        let limits: Vec<f64> = node.hypotheses.iter().map(|h| h.threshold).collect();
        assert!(limits[1] < -0.1 && limits[2] == 0.0, "{limits:?}");
        assert_eq!(node.fault_scores.len(), 2);
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
