//! The density of a node's Haar coefficients under one hypothesis.
//!
//! z = mean + W a + e: `a` are a few nuisances with unit normal priors (reflectance, glint, lamp drift), `e` independent
//! Student-t noise with its own scale per coefficient. W's first columns are the leading principal directions of the
//! training draws in the metric of the noise (probabilistic principal components, Tipping and Bishop 1999), the rest are
//! the lamps' own images scaled by their drift: images are linear in light. A diagonal Gaussian would average bright and
//! dark parts into "no edge, large variance".

use super::linear;
use super::math::{ln, ln_product};
use super::sight::Glance;
use std::ops::Range;
use std::sync::Arc;

/// Learned directions per hypothesis.
const DIRECTIONS: usize = 3;
/// Weight of the level's median variance, in draws.
const SHRINK_DRAWS: f64 = 6.0;
/// Variance floor: share of the template's root mean square at the level, for what no renderer knows.
const MODEL_ERROR: f64 = 0.12;
/// Degrees of freedom of the noise.
const STUDENT: f64 = 5.0;

pub struct Density {
    mean: Vec<f32>,
    /// Columns of W.
    columns: Vec<Vec<f32>>,
    /// 1 / variance per coefficient.
    precision: Vec<f32>,
    /// Cholesky factor of I + WᵀΛW.
    factor: Vec<f64>,
    /// -(log det(I + WᵀΛW) - Σ log precision) / 2.
    log_norm: f64,
    /// The same of the cells that a search asks, where these are not all.
    some: Option<(Arc<[usize]>, Box<Density>)>,
}

/// What the densities of one node share.
pub struct Floor {
    pub levels: Vec<Range<usize>>,
    /// Sensor noise in the node's px (standard deviation).
    pub noise: f64,
    /// Root mean square of the good template per level.
    pub rms: Vec<f64>,
    /// The cells that a search asks; `None` where it asks all.
    pub searched: Option<Arc<[usize]>>,
}

impl Floor {
    pub fn new(levels: &[Range<usize>], noise: f64, good_mean: &[f32], searched: Option<Arc<[usize]>>) -> Floor {
        let square = |r: &Range<usize>| good_mean[r.clone()].iter().map(|&v| f64::from(v).powi(2)).sum::<f64>();
        let rms = levels.iter().map(|r| (square(r) / r.len().max(1) as f64).sqrt()).collect();
        Floor { levels: levels.to_vec(), noise, rms, searched }
    }
}

/// The mean of samples of equal length.
pub fn mean_of(samples: &[Vec<f32>]) -> Vec<f32> {
    let mut mean = vec![0.0f64; samples[0].len()];
    for sample in samples {
        mean.iter_mut().zip(sample).for_each(|(m, &v)| *m += f64::from(v));
    }
    mean.into_iter().map(|m| (m / samples.len() as f64) as f32).collect()
}

impl Density {
    /// From coefficient vectors of the draws (at least two) and, per lamp, the column of its drift.
    pub fn fit(samples: &[Vec<f32>], lamps: Vec<Vec<f32>>, floor: &Floor) -> Density {
        let mean = mean_of(samples);
        let residuals: Vec<Vec<f32>> =
            samples.iter().map(|s| s.iter().zip(&mean).map(|(a, b)| a - b).collect()).collect();
        let total = variance(&residuals, samples.len() - 1, floor);
        let (columns, rests) = principal(&residuals, &total);
        let freedom = samples.len().saturating_sub(1 + columns.len()).max(1);
        let variance = variance(&rests, freedom, floor);
        let precision: Vec<f32> = variance.iter().map(|&v| 1.0 / v).collect();
        let columns = columns.into_iter().chain(lamps).collect();
        Density::assemble(mean, columns, precision, floor.searched.clone())
    }

    fn assemble(
        mean: Vec<f32>,
        columns: Vec<Vec<f32>>,
        precision: Vec<f32>,
        searched: Option<Arc<[usize]>>,
    ) -> Density {
        let some = searched.map(|cells| {
            let of = |all: &Vec<f32>| Glance::of(&cells, all);
            let some = Density::whole(of(&mean), columns.iter().map(of).collect(), of(&precision));
            (cells, Box::new(some))
        });
        Density { some, ..Density::whole(mean, columns, precision) }
    }

    fn whole(mean: Vec<f32>, columns: Vec<Vec<f32>>, precision: Vec<f32>) -> Density {
        let n = columns.len();
        let mut gram = vec![0.0; n * n];
        for i in 0..n {
            let column = weighted(&columns[i], &precision);
            for j in 0..=i {
                let dot = dot(&column, &columns[j]);
                gram[i * n + j] = dot + f64::from(u8::from(i == j));
                gram[j * n + i] = gram[i * n + j];
            }
        }
        // I + WᵀΛW is positive definite; only non-finite coefficients could make it fail.
        let factor = linear::cholesky(&gram, n).unwrap_or_else(|| identity(n));
        let log_det: f64 = (0..n).map(|i| ln(factor[i * n + i]) * 2.0).sum();
        let log_precision: f64 = ln_product(precision.iter().map(|&p| f64::from(p)));
        Density { mean, columns, precision, factor, log_norm: (log_precision - log_det) / 2.0, some: None }
    }

    /// What a real sample has and neither mean nor nuisances know.
    pub fn gap(&self, z: &[f32]) -> Vec<f32> {
        let a = self.nuisances(z);
        let mut rest: Vec<f32> = z.iter().zip(&self.mean).map(|(z, m)| z - m).collect();
        for (column, &weight) in self.columns.iter().zip(&a) {
            rest.iter_mut().zip(column).for_each(|(r, &w)| *r -= w * weight as f32);
        }
        rest
    }

    /// How much of each coefficient two densities have in common (0..1): 1 where their means agree within the noise.
    pub fn shared(&self, other: &Density) -> Vec<f32> {
        let pair = |k: usize| {
            let apart = self.mean[k] - other.mean[k];
            1.0 / (1.0 + apart * apart * self.precision[k].min(other.precision[k]))
        };
        (0..self.mean.len()).map(pair).collect()
    }

    /// Moves towards real samples by their gaps where `share` (0..1 per coefficient) lets it: half the way with one sample,
    /// all the way with many, and what is left becomes a nuisance. One sample cannot tell what is this station's from
    /// what is that assembly's.
    pub fn adapt(&mut self, gaps: &[Vec<f32>], share: &[f32]) {
        let part = 1.0 / (gaps.len() + 1) as f32;
        for gap in gaps {
            self.mean.iter_mut().zip(gap).zip(share).for_each(|((m, g), s)| *m += g * s * part);
        }
        let column = |gap: &Vec<f32>| gap.iter().zip(share).map(|(g, s)| g * s * part.sqrt()).collect();
        let columns = std::mem::take(&mut self.columns).into_iter().chain(gaps.iter().map(column)).collect();
        let (mean, precision) = (std::mem::take(&mut self.mean), std::mem::take(&mut self.precision));
        let searched = self.some.take().map(|(cells, _)| cells);
        *self = Density::assemble(mean, columns, precision, searched);
    }

    /// Log density under Gaussian noise, up to a constant: fast, for the search over shifts. `z` is what the search asks: of a large
    /// node some of its cells, whose log density counts for all of them.
    pub fn searched(&self, z: &[f32]) -> f64 {
        match &self.some {
            Some((_, some)) => some.gaussian(z) * self.mean.len() as f64 / some.mean.len() as f64,
            None => self.gaussian(z),
        }
    }

    /// The same under Student's noise.
    pub fn searched_student(&self, z: &[f32]) -> f64 {
        match &self.some {
            Some((_, some)) => some.student(z) * self.mean.len() as f64 / some.mean.len() as f64,
            None => self.student(z),
        }
    }

    /// Log density under Gaussian noise, up to the constant all hypotheses share.
    fn gaussian(&self, z: &[f32]) -> f64 {
        let (square, b) = self.project(z);
        let a = linear::solve_with(&self.factor, &b);
        let explained: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
        self.log_norm - (square - explained) / 2.0
    }

    /// Log density under Student-t noise: nuisances at their robust maximum, integrated by Laplace's method.
    pub fn student(&self, z: &[f32]) -> f64 {
        let a = self.nuisances(z);
        let rest = self.residual(z, &a);
        let noise = log_tails(&rest);
        let prior: f64 = a.iter().map(|v| v * v).sum();
        self.log_norm - (STUDENT + 1.0) / 2.0 * noise - prior / 2.0
    }

    /// Per coefficient, minus the logarithm of the noise's density relative to its peak: 0 for one as expected.
    pub fn surprise(&self, z: &[f32]) -> Vec<f32> {
        let rest = self.residual(z, &self.nuisances(z));
        let tail = |r: &f32| ((STUDENT + 1.0) / 2.0 * ln(1.0 + f64::from(r * r) / STUDENT)) as f32;
        rest.iter().map(tail).collect()
    }

    /// The nuisances' robust maximum. Every round is a step of Newton's method with the curvature that Gaussian noise has, which is
    /// at hand: a round then costs a pass per column and not one per pair of columns.
    fn nuisances(&self, z: &[f32]) -> Vec<f64> {
        const ROUNDS: usize = 3;
        let (_, b) = self.project(z);
        let mut a = linear::solve_with(&self.factor, &b);
        for _ in 0..ROUNDS {
            let slope = self.slope(z, &a);
            a.iter_mut().zip(linear::solve_with(&self.factor, &slope)).for_each(|(a, step)| *a += step);
        }
        a
    }

    /// Slope of the logarithm of nuisances' posterior under Student-t noise.
    fn slope(&self, z: &[f32], a: &[f64]) -> Vec<f64> {
        const NU: f32 = STUDENT as f32;
        let pull = |r: f32, p: f32| r * p.sqrt() * (NU + 1.0) / (NU + r * r);
        let pulls: Vec<f32> = self.residual(z, a).iter().zip(&self.precision).map(|(&r, &p)| pull(r, p)).collect();
        self.columns.iter().zip(a).map(|(column, a)| dot(column, &pulls) - a).collect()
    }

    /// Residual in standard deviations after taking the nuisances off.
    fn residual(&self, z: &[f32], a: &[f64]) -> Vec<f32> {
        let mut rest: Vec<f32> = z.iter().zip(&self.mean).map(|(z, m)| z - m).collect();
        for (column, &weight) in self.columns.iter().zip(a) {
            rest.iter_mut().zip(column).for_each(|(r, &w)| *r -= w * weight as f32);
        }
        rest.iter_mut().zip(&self.precision).for_each(|(r, &p)| *r *= p.sqrt());
        rest
    }

    /// (rᵀΛr, WᵀΛr) for r = z - mean.
    fn project(&self, z: &[f32]) -> (f64, Vec<f64>) {
        let rest: Vec<f32> = z.iter().zip(&self.mean).map(|(z, m)| z - m).collect();
        let scaled = weighted(&rest, &self.precision);
        (dot(&rest, &scaled), self.columns.iter().map(|c| dot(c, &scaled)).collect())
    }
}

/// Sum of the logarithms of Student-t densities of one scale relative to their peak.
pub fn of_scale(z: &[f32], scale: f64) -> f64 {
    let rest: Vec<f32> = z.iter().map(|v| v / scale as f32).collect();
    -(STUDENT + 1.0) / 2.0 * log_tails(&rest)
}

fn identity(n: usize) -> Vec<f64> {
    (0..n * n).map(|i| f64::from(u8::from(i % (n + 1) == 0))).collect()
}

/// Products are summed side by side in this many f32, which the compiler keeps in vector registers, and these after every
/// [`RUN`] products in f64: fast, accurate, and always in one order.
const LANES: usize = 16;
const RUN: usize = 64 * LANES;

fn dot(a: &[f32], b: &[f32]) -> f64 {
    let run = |(a, b): (&[f32], &[f32])| -> f64 {
        let mut lanes = [0.0f32; LANES];
        let (xs, ys) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
        let rest = xs.remainder().iter().zip(ys.remainder());
        lanes.iter_mut().zip(rest).for_each(|(lane, (x, y))| *lane = x * y);
        for (x, y) in xs.zip(ys) {
            for k in 0..LANES {
                lanes[k] += x[k] * y[k];
            }
        }
        lanes.iter().map(|&v| f64::from(v)).sum()
    };
    a.chunks(RUN).zip(b.chunks(RUN)).map(run).sum()
}

fn weighted(a: &[f32], weights: &[f32]) -> Vec<f32> {
    a.iter().zip(weights).map(|(a, w)| a * w).collect()
}

/// Sum of ln(1 + r²/ν): logarithms of products, few enough to stay in range for any square that f32 holds.
fn log_tails(rest: &[f32]) -> f64 {
    const FACTORS: usize = 7;
    let tail = |&r: &f32| 1.0 + f64::from(r * r) / STUDENT;
    ln_product(rest.chunks(FACTORS).map(|rest| rest.iter().map(tail).product()))
}

/// Variance per coefficient: the draws', shrunk towards its level's median, not below the floor.
fn variance(rests: &[Vec<f32>], freedom: usize, floor: &Floor) -> Vec<f32> {
    let n = rests.len() as f64;
    let mut out = vec![0.0f32; rests[0].len()];
    for (k, v) in out.iter_mut().enumerate() {
        let sum: f64 = rests.iter().map(|r| f64::from(r[k]).powi(2)).sum();
        *v = (sum / freedom as f64) as f32;
    }
    for (level, range) in floor.levels.iter().enumerate() {
        let typical = f64::from(linear::median(&mut out[range.clone()].to_vec()));
        let sensor = floor.noise * floor.noise / 4f64.powi(level as i32 + 1);
        let least = sensor + (MODEL_ERROR * floor.rms[level]).powi(2) + 1e-12;
        for v in &mut out[range.clone()] {
            let shrunk = (SHRINK_DRAWS * typical + n * f64::from(*v)) / (SHRINK_DRAWS + n);
            *v = shrunk.max(least) as f32;
        }
    }
    out
}

/// The leading directions of the residuals in the metric 1/variance, scaled to unit nuisances, and what they leave.
fn principal(residuals: &[Vec<f32>], variance: &[f32]) -> (Vec<Vec<f32>>, Vec<Vec<f32>>) {
    let n = residuals.len();
    let precision: Vec<f32> = variance.iter().map(|v| 1.0 / v).collect();
    let mut gram = vec![0.0; n * n];
    for i in 0..n {
        let residual = weighted(&residuals[i], &precision);
        for j in 0..=i {
            gram[i * n + j] = dot(&residual, &residuals[j]);
            gram[j * n + i] = gram[i * n + j];
        }
    }
    let (values, vectors) = linear::symmetric_eigen(&gram, n);
    let count = DIRECTIONS.min(n.saturating_sub(2));
    let mut rests = residuals.to_vec();
    let mut columns = Vec::new();
    for (_, vector) in values.iter().zip(&vectors).take(count).filter(|(value, _)| **value > 0.0) {
        let mut direction = vec![0.0f32; variance.len()];
        for (residual, &e) in residuals.iter().zip(vector) {
            direction.iter_mut().zip(residual).for_each(|(d, &r)| *d += r * e as f32);
        }
        for (rest, &e) in rests.iter_mut().zip(vector) {
            rest.iter_mut().zip(&direction).for_each(|(r, &d)| *r -= d * e as f32);
        }
        let unit = 1.0 / (n as f32).sqrt();
        columns.push(direction.iter().map(|d| d * unit).collect());
    }
    (columns, rests)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_in_lanes_and_logarithms_of_products_are_exact_enough() {
        for n in [1, 15, 16, 17, 1023, 1024, 2500] {
            let (a, b) = (noise(n, 1), noise(n, 2));
            let plain: f64 = a.iter().zip(&b).map(|(x, y)| f64::from(x * y)).sum();
            assert!((dot(&a, &b) - plain).abs() < 1e-4, "{n}");
            let tails: f64 = a.iter().map(|r| (1.0 + f64::from(r * r) / STUDENT).ln()).sum();
            assert!((log_tails(&a) - tails).abs() < 1e-9 * n as f64, "{n}");
        }
        assert!(log_tails(&[1e19; 21]).is_finite());
    }

    /// A few numbers without structure.
    fn noise(n: usize, seed: u64) -> Vec<f32> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32 - 0.5
        };
        (0..n).map(|_| next() + next() + next() + next()).collect()
    }

    fn one_level(n: usize) -> Floor {
        Floor { levels: std::iter::once(0..n).collect(), noise: 0.01, rms: vec![0.1], searched: None }
    }

    #[test]
    fn nuisances_stand_where_the_posterior_is_flat() {
        let samples: Vec<Vec<f32>> = (0..12).map(|i| noise(300, i)).collect();
        let density = Density::fit(&samples, vec![noise(300, 100)], &one_level(300));
        let mut z = noise(300, 40);
        z[..30].iter_mut().for_each(|v| *v += 8.0);
        let zero = vec![0.0; density.columns.len()];
        let norm = |a: &[f64]| density.slope(&z, a).iter().map(|v| v * v).sum::<f64>().sqrt();
        let found = density.nuisances(&z);
        assert!(norm(&found) < 0.1 * norm(&zero), "{} of {}", norm(&found), norm(&zero));
    }

    /// A search over shifts asks which of two is likelier, not how likely they are.
    #[test]
    fn some_cells_of_a_large_node_tell_which_shift_is_likelier() {
        let n = 6002;
        let samples: Vec<Vec<f32>> = (0..9).map(|i| noise(n, i)).collect();
        let cells: Arc<[usize]> = (0..n / 2).step_by(6).collect();
        let floor = Floor { searched: Some(cells.clone()), ..one_level(n) };
        let density = Density::fit(&samples, Vec::new(), &floor);
        let off = |by: f32| -> Vec<f32> { noise(n, 40).iter().zip(&density.mean).map(|(r, m)| r * by + m).collect() };
        let (near, far) = (off(1.0), off(2.0));
        let searched = |z: &[f32]| density.searched(&Glance::of(&cells, z));
        let (some, all) = (searched(&near) - searched(&far), density.gaussian(&near) - density.gaussian(&far));
        assert!((some / all - 1.0).abs() < 0.1, "{some} {all}");
    }

    #[test]
    fn gaussian_equals_the_density_of_the_full_covariance() {
        let n = 7;
        let samples: Vec<Vec<f32>> = (0..9).map(|i| noise(n, i)).collect();
        let density = Density::fit(&samples, vec![noise(n, 100)], &one_level(n));
        let mut covariance = vec![0.0; n * n];
        for i in 0..n {
            covariance[i * n + i] = 1.0 / f64::from(density.precision[i]);
            for j in 0..n {
                for w in &density.columns {
                    covariance[i * n + j] += f64::from(w[i]) * f64::from(w[j]);
                }
            }
        }
        let z = noise(n, 55);
        let r: Vec<f64> = z.iter().zip(&density.mean).map(|(z, m)| f64::from(z - m)).collect();
        let l = linear::cholesky(&covariance, n).unwrap();
        let x = linear::solve_with(&l, &r);
        let square: f64 = x.iter().zip(&r).map(|(a, b)| a * b).sum();
        let log_det: f64 = (0..n).map(|i| l[i * n + i].ln() * 2.0).sum();
        let expected = -(square + log_det) / 2.0;
        assert!((density.gaussian(&z) - expected).abs() < 1e-4 * expected.abs(), "{} {expected}", density.gaussian(&z));
    }

    #[test]
    fn a_direction_forgives_what_varies_together_and_nothing_else() {
        let n = 40;
        let pattern = noise(n, 3);
        let base = noise(n, 4);
        let with = |gain: f32, seed| -> Vec<f32> {
            noise(n, seed).iter().zip(&pattern).zip(&base).map(|((e, p), b)| b + gain * p + 0.05 * e).collect()
        };
        let gains = [-2.0, -1.2, -0.6, -0.1, 0.3, 0.8, 1.3, 1.9];
        let samples: Vec<Vec<f32>> = gains.iter().enumerate().map(|(i, &g)| with(g, 10 + i as u64)).collect();
        let density = Density::fit(&samples, Vec::new(), &one_level(n));
        let other = noise(n, 5);
        let strange: Vec<f32> = with(0.0, 30).iter().zip(&other).map(|(z, o)| z + o).collect();
        let usual = density.student(&with(1.6, 31));
        assert!(usual > density.student(&with(0.0, 32)) - 0.2 * n as f64);
        assert!(usual > density.student(&strange) + 0.5 * n as f64);
    }

    #[test]
    fn what_a_real_sample_adds_is_forgiven_where_hypotheses_agree() {
        let n = 60;
        let step =
            |from: usize, to: usize, v: f32| (0..n).map(|k| if (from..to).contains(&k) { v } else { 0.0 }).collect();
        let draws = |mean: &Vec<f32>, seed: u64| -> Vec<Vec<f32>> {
            let draw = |i| noise(n, seed + i).iter().zip(mean).map(|(e, m)| m + 0.1 * e).collect();
            (0..9).map(draw).collect()
        };
        let (part, hole): (Vec<f32>, Vec<f32>) = (step(0, 20, 1.0), step(0, 20, -1.0));
        let fit = |mean, seed| Density::fit(&draws(mean, seed), Vec::new(), &one_level(n));
        let (mut good, mut missing) = (fit(&part, 100), fit(&hole, 200));
        // The real surroundings have an edge that no render has, and the real part is brighter than rendered.
        let edge: Vec<f32> = step(40, 50, 2.0);
        let real: Vec<f32> = (0..n).map(|k| part[k] * 1.5 + edge[k]).collect();
        let empty: Vec<f32> = (0..n).map(|k| hole[k] + edge[k]).collect();
        let before = [&real, &empty].map(|z| [good.student(z), missing.student(z)]);
        let gap = vec![good.gap(&real)];
        let shares = [good.shared(&good), missing.shared(&good)];
        good.adapt(&gap, &shares[0]);
        missing.adapt(&gap, &shares[1]);
        let after = [&real, &empty].map(|z| [good.student(z), missing.student(z)]);
        assert!(after[0][0] > before[0][0] + 20.0 && after[1][1] > before[1][1] + 20.0, "{before:?} {after:?}");
        assert!(after[0][0] > after[0][1] && after[1][1] > after[1][0]);
        assert!(shares[0].iter().all(|&s| s == 1.0) && shares[1][5] < 0.1 && shares[1][45] > 0.8);
    }

    #[test]
    fn one_wild_coefficient_costs_a_student_little() {
        let n = 40;
        let samples: Vec<Vec<f32>> = (0..9).map(|i| noise(n, i)).collect();
        let density = Density::fit(&samples, Vec::new(), &one_level(n));
        let mut z = noise(n, 77);
        let (gaussian, student) = (density.gaussian(&z), density.student(&z));
        z[3] += 20.0;
        assert!(gaussian - density.gaussian(&z) > 100.0);
        assert!(student - density.student(&z) < 25.0);
    }
}
