//! Rates and their confidence.

use crate::runtime::model::Rate;

/// `events` among `trials` with the upper end of the two-sided 95 % interval (Clopper and Pearson 1934).
pub fn rate(events: u32, trials: u32) -> Rate {
    Rate { events, trials, upper_95: rounded(upper(events, trials, 0.975)) }
}

/// The lower end of the same interval.
pub fn lower_95(rate: &Rate) -> f64 {
    let kept = rate.trials.saturating_sub(rate.events);
    rounded(1.0 - upper(kept, rate.trials, 0.975))
}

/// The p at which seeing at most `events` in `trials` has probability 1 - confidence.
fn upper(events: u32, trials: u32, confidence: f64) -> f64 {
    if events >= trials {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let p = (low + high) / 2.0;
        if at_most(events, trials, p) > 1.0 - confidence {
            low = p;
        } else {
            high = p;
        }
    }
    (low + high) / 2.0
}

/// Binomial distribution function.
fn at_most(events: u32, trials: u32, p: f64) -> f64 {
    let mut term = (f64::from(trials) * (1.0 - p).ln()).exp();
    let mut sum = term;
    for k in 0..events {
        term *= f64::from(trials - k) / f64::from(k + 1) * p / (1.0 - p);
        sum += term;
    }
    sum
}

/// The z below which a standard normal falls with probability `p` (Abramowitz and Stegun 26.2.23, error below 4.5e-4).
pub fn normal_quantile(p: f64) -> f64 {
    if p < 0.5 {
        return -normal_quantile(1.0 - p);
    }
    let t = (-2.0 * (1.0 - p).max(1e-12).ln()).sqrt();
    let top = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let bottom = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    t - top / bottom
}

/// Four decimals: what a person reads, and the same on every machine.
pub fn rounded(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_quantiles_match_the_table() {
        for (p, z) in [(0.5, 0.0), (0.975, 1.959_964), (0.999, 3.090_232), (0.05, -1.644_854)] {
            assert!((normal_quantile(p) - z).abs() < 5e-4);
        }
    }

    #[test]
    fn clopper_pearson_matches_published_values() {
        // Closed form for no event: 1 - 0.025^(1/n).
        assert!((rate(0, 33).upper_95 - (1.0 - 0.025f64.powf(1.0 / 33.0))).abs() < 1e-4);
        // 2 of 20: upper end 0.3170 (Clopper and Pearson's chart; any statistics package).
        assert!((rate(2, 20).upper_95 - 0.3170).abs() < 2e-4);
        assert_eq!(rate(5, 5).upper_95, 1.0);
        assert_eq!(lower_95(&rate(0, 33)), 0.0);
        assert!((lower_95(&rate(2, 20)) - 0.0123).abs() < 2e-4);
    }
}
