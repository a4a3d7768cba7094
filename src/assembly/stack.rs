//! Tolerance stack-up: what limits and zones do to a number worked out from dimensions.
//!
//! In: a function of the design's dimensions and those it depends on. Out: its extremes over all limits, its distribution
//! over the draws that the images are made from, and what each dimension contributes. Never knows what the number means.

use crate::design::model::{Design, DimId, Values};
use crate::variation::{draw_of, free_turns, quantile};

/// A number that depends on dimensions.
pub(crate) struct Stack<'a> {
    pub design: &'a Design,
    /// Those it depends on and that vary.
    pub dims: Vec<DimId>,
    pub of: &'a dyn Fn(&Values) -> f64,
}

/// What limits do to it.
#[derive(Debug, Clone)]
pub(crate) struct Spread {
    pub nominal: f64,
    /// The least and the largest value over all limits.
    pub worst: [f64; 2],
    pub mean: f64,
    pub deviation: f64,
    /// Below which 0.135 % and 99.865 % of the draws lie.
    pub quantiles: [f64; 2],
    /// Share of the draws outside the limits asked about.
    pub outside: f64,
    /// The largest first; those without effect left out.
    pub effects: Vec<Effect>,
}

/// What one dimension does by itself, the others at nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Effect {
    pub dim: DimId,
    /// Change per unit of the dimension, at nominal.
    pub sensitivity: f64,
    /// Largest less least over its limits.
    pub range: f64,
    /// Share of the sum of all such variances.
    pub variance: f64,
}

/// Draws of the assembly: the 0.135 % quantile is then the 14th value from the end, give or take four.
const DRAWS: u64 = 10_000;
/// The shares of a normal distribution beyond three standard deviations.
const TAILS: [f64; 2] = [0.00135, 0.99865];
/// Points of its distribution at which a dimension's own effect is taken.
const POINTS: usize = 21;
/// Points between its limits at which a dimension is tried while others stand at an extreme.
const TRIED: usize = 5;
/// Rounds of the search for an extreme; each goes through every dimension.
const ROUNDS: usize = 20;
/// Effects below this (mm) are rounding.
const NOTHING: f64 = 1e-9;
/// The step of a difference quotient, as a share of the dimension's range.
const STEP: f64 = 1e-3;

impl Stack<'_> {
    /// Everything about the number; `limits` are those it is held against.
    pub fn spread(&self, limits: Option<[f64; 2]>) -> Spread {
        let mut values = self.design.nominal();
        let nominal = (self.of)(&values);
        let free = self.free();
        let mut drawn: Vec<f64> = (0..DRAWS).map(|k| self.drawn(&mut values, &free, k)).collect();
        let worst = self.worst(&drawn, &free);
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let variance = drawn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (drawn.len() - 1) as f64;
        let beyond = |v: &&f64| limits.is_some_and(|[low, high]| **v < low || **v > high);
        let outside = drawn.iter().filter(beyond).count() as f64 / drawn.len() as f64;
        drawn.sort_by(f64::total_cmp);
        let quantiles = TAILS.map(|t| at(&drawn, t));
        Spread { nominal, worst, mean, deviation: variance.sqrt(), quantiles, outside, effects: self.effects(&free) }
    }

    fn free(&self) -> Vec<bool> {
        let free = free_turns(self.design);
        self.dims.iter().map(|d| free[d.0 as usize]).collect()
    }

    fn drawn(&self, values: &mut Values, free: &[bool], number: u64) -> f64 {
        for (dim, free) in self.dims.iter().zip(free) {
            values[dim.0 as usize] = draw_of(self.design, *dim, *free, number);
        }
        (self.of)(values)
    }

    /// The extremes. From the nominal values, and from the draws where it is least and largest, every dimension in turn is
    /// put where the number is worst, until none can be moved to make it worse: for what is monotone in each dimension
    /// these are the corners, and where it is not the extreme between the limits is found too. No draw lies outside.
    fn worst(&self, drawn: &[f64], free: &[bool]) -> [f64; 2] {
        [-1.0, 1.0].map(|sign| {
            let nominal = self.design.nominal();
            let farthest = (0..drawn.len()).max_by(|i, j| (sign * drawn[*i]).total_cmp(&(sign * drawn[*j])));
            let mut far = nominal.clone();
            if let Some(number) = farthest {
                self.drawn(&mut far, free, number as u64);
            }
            let ends = [nominal, far].map(|start| sign * self.climb(start, free, sign));
            sign * ends[0].max(ends[1])
        })
    }

    fn climb(&self, mut values: Vec<f64>, free: &[bool], sign: f64) -> f64 {
        let mut best = sign * (self.of)(&values);
        for _ in 0..ROUNDS {
            let before = best;
            for (dim, free) in self.dims.iter().zip(free) {
                let own = values[dim.0 as usize];
                let (value, reached) = self.best_of(&mut values, *dim, *free, sign);
                let better = reached > best;
                values[dim.0 as usize] = if better { value } else { own };
                best = best.max(reached);
            }
            if best <= before + NOTHING {
                break;
            }
        }
        sign * best
    }

    /// Where one dimension makes the number largest (times `sign`), and how large.
    fn best_of(&self, values: &mut Values, dim: DimId, free: bool, sign: f64) -> (f64, f64) {
        let ends = [0.0, 1.0].map(|u| quantile(self.design, dim, free, u));
        let mut at = |x: f64| {
            values[dim.0 as usize] = x;
            sign * (self.of)(values)
        };
        let point = |k: usize| ends[0] + (ends[1] - ends[0]) * k as f64 / (TRIED - 1) as f64;
        let tried: Vec<f64> = (0..TRIED).map(|k| at(point(k))).collect();
        let best = (0..TRIED).max_by(|i, j| tried[*i].total_cmp(&tried[*j])).unwrap_or(0);
        if best == 0 || best == TRIED - 1 {
            return (point(best), tried[best]);
        }
        let found = summit(&mut at, point(best - 1), point(best + 1));
        if found.1 > tried[best] { found } else { (point(best), tried[best]) }
    }

    fn effects(&self, free: &[bool]) -> Vec<Effect> {
        let mut values = self.design.nominal();
        let mut effects: Vec<Effect> =
            self.dims.iter().zip(free).filter_map(|(dim, free)| self.effect(&mut values, *dim, *free)).collect();
        let total: f64 = effects.iter().map(|e| e.variance).sum();
        effects.iter_mut().for_each(|e| e.variance /= total.max(f64::MIN_POSITIVE));
        effects.sort_by_key(|e| (std::cmp::Reverse((e.range / NOTHING) as i64), e.dim));
        effects
    }

    /// `variance` not yet as a share. `values` are nominal, before and after.
    fn effect(&self, values: &mut Values, dim: DimId, free: bool) -> Option<Effect> {
        let (slot, nominal) = (dim.0 as usize, self.design.dims[dim.0 as usize].range.nominal);
        let mut at = |x: f64| {
            values[slot] = x;
            let found = (self.of)(values);
            values[slot] = nominal;
            found
        };
        let ends = [0.0, 1.0].map(|u| quantile(self.design, dim, free, u));
        let step = (ends[1] - ends[0]) * STEP;
        let sensitivity = (at(nominal + step) - at(nominal - step)) / (2.0 * step);
        let shares = (0..POINTS).map(|k| (k as f64 + 0.5) / POINTS as f64);
        let own: Vec<f64> = shares.map(|u| at(quantile(self.design, dim, free, u))).collect();
        let mean = own.iter().sum::<f64>() / POINTS as f64;
        let variance = own.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / POINTS as f64;
        let all = own.into_iter().chain([at(ends[0]), at(nominal), at(ends[1])]);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
        (high - low > NOTHING).then_some(Effect { dim, sensitivity, range: high - low, variance })
    }
}

/// The value at a share of a sorted list, between neighbours in proportion.
fn at(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let (below, rest) = (place.floor() as usize, place.fract());
    sorted[below] + rest * (sorted[(below + 1).min(sorted.len() - 1)] - sorted[below])
}

/// The largest value of a function with one summit between two points (golden section, Kiefer 1953).
fn summit(f: &mut dyn FnMut(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    const STEPS: usize = 40;
    for _ in 0..STEPS {
        let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
        if f(a) < f(b) { low = a } else { high = b }
    }
    let middle = (low + high) / 2.0;
    (middle, f(middle))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample::Shop;

    /// Diameters and heights of two plates: dimensions 0 (5 ±1), 1 (3 ±0.5), 2 (20 ±2), 3 (10 ±0.1).
    fn design() -> Design {
        let mut shop = Shop::default();
        let parts =
            [("p", [3.0, 0.5], [5.0, 1.0]), ("q", [10.0, 0.1], [20.0, 2.0])].map(|(n, h, d)| shop.plate(n, h, d, &[]));
        parts.iter().for_each(|p| {
            shop.place("c", *p, [0.0; 3], 0.0, 0.0);
        });
        shop.finish().design
    }

    fn spread(of: &dyn Fn(&Values) -> f64) -> Spread {
        let design = design();
        Stack { design: &design, dims: (0..4).map(DimId).collect(), of }.spread(None)
    }

    #[test]
    fn extremes_of_monotone_sums_are_at_the_corners() {
        let found = spread(&|v| v[0] - 2.0 * v[1] + v[2] * v[3]);
        assert!((found.worst[1] - (6.0 - 5.0 + 22.0 * 10.1)).abs() < 1e-9, "{:?}", found.worst);
        assert!((found.worst[0] - (4.0 - 7.0 + 18.0 * 9.9)).abs() < 1e-9, "{:?}", found.worst);
        assert_eq!(found.effects[0].dim, DimId(2));
    }

    #[test]
    fn an_extreme_between_the_limits_is_found() {
        let found = spread(&|v| 4.0 - (v[0] - 5.3).powi(2) + v[1]);
        assert!((found.worst[1] - 7.5).abs() < 1e-9, "{:?}", found.worst);
        assert!((found.worst[0] - (4.0 - 1.3 * 1.3 + 2.5)).abs() < 1e-9);
    }

    /// Nominal is a saddle: no dimension alone makes the product negative, two together do.
    #[test]
    fn an_extreme_that_needs_two_dimensions_at_once_is_found() {
        let found = spread(&|v| (v[0] - 5.0) * (v[1] - 3.0));
        assert!((found.worst[0] + 0.5).abs() < 1e-9 && (found.worst[1] - 0.5).abs() < 1e-9, "{:?}", found.worst);
        assert!(found.effects.is_empty());
    }

    #[test]
    fn quantiles_are_those_of_a_uniform_dimension() {
        let found = spread(&|v| v[0]);
        assert!((found.quantiles[0] - 4.0027).abs() < 3e-3 && (found.quantiles[1] - 5.9973).abs() < 3e-3);
        assert!((found.deviation - 2.0 / 12f64.sqrt()).abs() < 0.01);
    }
}
