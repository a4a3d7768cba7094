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

/// Binomial distribution function, its terms taken as logarithms: far from the mode they are smaller than any number.
fn at_most(events: u32, trials: u32, p: f64) -> f64 {
    let odds = (p / (1.0 - p)).ln();
    let mut term = f64::from(trials) * (1.0 - p).ln();
    let mut sum = term.exp();
    for k in 0..events {
        term += (f64::from(trials - k) / f64::from(k + 1)).ln() + odds;
        sum += term.exp();
    }
    sum
}

/// Four decimals: what a person reads, and the same on every machine.
pub fn rounded(v: f64) -> f64 {
    (v * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clopper and Pearson's interval for 5 of 1000 and for 990 of 1000, from the quantiles of the beta distribution.
    #[test]
    fn many_trials_have_the_interval_of_the_beta_distribution() {
        let [few, most] = [rate(5, 1000), rate(990, 1000)];
        assert!((lower_95(&few) - 0.0016).abs() < 1e-4 && (few.upper_95 - 0.0116).abs() < 1e-4, "{few:?}");
        assert!((lower_95(&most) - 0.9817).abs() < 1e-4 && (most.upper_95 - 0.9952).abs() < 1e-4, "{most:?}");
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
