//! A node in a photo at every shift of its local search.
//!
//! In: the node's coefficients as a function of the shift, densities. Out: the shift at which a density fits best under what is
//! known of the place. Whole px of the photo come first; only round the best of each density half px follow. Never decides.

use super::density::Density;
use super::settle::Expected;
use std::collections::BTreeSet;

/// Local search: shifts of up to this many standard deviations of the node's place, and at most so many px of the photo,
/// each way. More would let a part that stands too high pass as one that stands a little further back.
const REACH: f64 = 2.0;
const LARGEST_REACH: f64 = 12.0;
/// A reach of more px than this is searched coarsely.
const FEW: f64 = 2.0;
/// Shifts that Gaussian noise likes best, among which Student's decides.
const SHORT_LIST: usize = 4;

/// A node's coefficients at one shift (node px).
pub(super) struct Shifted {
    pub shift: [f64; 2],
    pub coefficients: Vec<f32>,
}

pub struct Look<'a> {
    pub(super) densities: &'a [Density],
    pub(super) shifted: Vec<Shifted>,
    /// Per density, its Gaussian log-likelihood at every shift.
    fits: Vec<Vec<f64>>,
    /// Share of the window inside the photo.
    pub(super) inside: f64,
    /// Standard deviation of the place before anything is known of this photo's station (px of the photo).
    spread: [f64; 2],
    factor: f64,
}

impl<'a> Look<'a> {
    /// `spread` is the standard deviation of the node's shift in node px, each of `factor` px of the photo.
    pub(super) fn new(
        densities: &'a [Density],
        spread: [f64; 2],
        factor: u32,
        inside: f64,
        coefficients: &dyn Fn([f64; 2]) -> Vec<f32>,
    ) -> Look<'a> {
        let factor = f64::from(factor);
        let spread = spread.map(|s| s * factor);
        let fits = vec![Vec::new(); densities.len()];
        let mut look = Look { densities, shifted: Vec::new(), fits, inside, spread, factor };
        let [columns, rows] = spread.map(|spread| steps(spread, factor));
        for &y in &rows {
            for &x in &columns {
                look.add([x, y].map(|v| f64::from(v) / 2.0), coefficients);
            }
        }
        let halves: BTreeSet<[i32; 2]> = if spread.iter().all(|s| reach(*s) <= FEW) {
            (0..densities.len()).flat_map(|density| look.round_best(density)).collect()
        } else {
            BTreeSet::new()
        };
        for half in halves {
            look.add(half.map(|v| f64::from(v) / 2.0), coefficients);
        }
        look
    }

    /// Takes in a shift (px of the photo).
    fn add(&mut self, at: [f64; 2], coefficients: &dyn Fn([f64; 2]) -> Vec<f32>) {
        let shift = at.map(|v| v / self.factor);
        let coefficients = coefficients(shift);
        for (fits, density) in self.fits.iter_mut().zip(self.densities) {
            fits.push(density.gaussian(&coefficients));
        }
        self.shifted.push(Shifted { shift, coefficients });
    }

    /// What lies half a px (of the photo) beside the best shift of a density, in half px.
    fn round_best(&self, density: usize) -> Vec<[i32; 2]> {
        let free = self.free();
        let fit = |i: usize| self.fits[density][i] + self.prior(i, &free);
        let best = (0..self.shifted.len()).max_by(|&a, &b| fit(a).total_cmp(&fit(b)));
        let [x, y] = best.map_or([0, 0], |i| self.shifted[i].shift.map(|v| (v * self.factor * 2.0).round() as i32));
        let ways = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];
        ways.into_iter().map(|[dx, dy]| [x + dx, y + dy]).collect()
    }

    fn free(&self) -> Expected {
        Expected { at: [0.0; 2], spread: self.spread }
    }

    /// Log density of a shift where the node is expected so, up to a constant.
    fn prior(&self, i: usize, expected: &Expected) -> f64 {
        let apart = |k: usize| (self.shifted[i].shift[k] * self.factor - expected.at[k]) / expected.spread[k];
        -0.5 * (apart(0).powi(2) + apart(1).powi(2))
    }

    /// Log-likelihood and index of the shift at which a density fits best; `weight` is that of the place beside the image.
    pub(super) fn likeliest(&self, density: usize, expected: &Expected, weight: f64) -> (f64, usize) {
        let prior = |i: usize| weight * self.prior(i, expected);
        let mut quick: Vec<(f64, usize)> =
            self.fits[density].iter().enumerate().map(|(i, fit)| (fit + prior(i), i)).collect();
        quick.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let robust =
            |&(_, i): &(f64, usize)| (self.densities[density].student(&self.shifted[i].coefficients) + prior(i), i);
        let listed = quick.iter().take(SHORT_LIST).map(robust);
        listed.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))).unwrap_or((f64::NEG_INFINITY, 0))
    }

    /// The shift (node px) at which the first density fits best.
    pub fn best_shift(&self) -> [f64; 2] {
        self.shifted[self.likeliest(0, &self.free(), 1.0).1].shift
    }
}

/// How far to look along one axis for a standard deviation (px of the photo).
fn reach(spread: f64) -> f64 {
    (REACH * spread).min(LARGEST_REACH).round().max(FEW)
}

/// Shifts along one axis in half px of the photo: every px where they are few, else half px of the node.
fn steps(spread: f64, factor: f64) -> Vec<i32> {
    let reach = reach(spread);
    let step = if reach <= FEW { 1.0 } else { (factor / 2.0).max(1.0) };
    let count = (reach / step).round() as i32;
    let halves = (2.0 * step) as i32;
    (-count..=count).map(|i| i * halves).collect()
}
