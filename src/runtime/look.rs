//! A node in a photo at every shift of its local search.
//!
//! In: the node as the photo shows it at any shift, densities. Out: the shift at which a density fits best under what is
//! known of the place. Whole px of the photo come first; only round the best of each density half px follow. Never decides.

use super::density::Density;
use super::parts::{Listener, Part};
use super::settle::Expected;
use super::sight::Sight;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;

/// Local search: shifts of up to this many standard deviations of the node's place, and at most so many px of the photo,
/// each way. More would let a part that stands too high pass as one that stands a little further back.
const REACH: f64 = 2.0;
const LARGEST_REACH: f64 = 12.0;
/// A reach of more px than this is searched coarsely.
const FEW: f64 = 2.0;
/// Shifts that Gaussian noise likes best, among which Student's decides.
const SHORT_LIST: usize = 4;

/// A node at one shift (node px).
struct Shifted {
    shift: [f64; 2],
    /// The coefficients that a search asks, where these are not all.
    some: Option<Vec<f32>>,
    all: OnceCell<Vec<f32>>,
}

pub struct Look<'a> {
    pub(super) densities: &'a [Density],
    sight: Sight<'a>,
    shifted: Vec<Shifted>,
    /// Per density, shifts with its Gaussian log-likelihood there.
    fits: Vec<Vec<(usize, f64)>>,
    /// Per density and shift its log-likelihood under Student's noise, as far as it was asked for.
    robust: RefCell<BTreeMap<(usize, usize), f64>>,
    /// Share of the window inside the photo.
    pub(super) inside: f64,
    /// Standard deviation of the place before anything is known of this photo's station (px of the photo).
    spread: [f64; 2],
    factor: f64,
    pub(super) listener: &'a Listener<'a>,
}

impl<'a> Look<'a> {
    /// `spread` is the standard deviation of the node's shift in node px, each of `factor` px of the photo.
    pub(super) fn new(
        densities: &'a [Density],
        spread: [f64; 2],
        sight: Sight<'a>,
        listener: &'a Listener<'a>,
    ) -> Look<'a> {
        listener(Part::Windows);
        let (factor, inside) = (f64::from(sight.window.frame.factor), sight.inside());
        let spread = spread.map(|s| s * factor);
        let [columns, rows] = spread.map(|spread| steps(spread, factor));
        let whole = rows.iter().flat_map(|&y| columns.iter().map(move |&x| [x, y]));
        let shifted = whole.map(|halves| seen(halves, factor, &sight)).collect();
        let fits = vec![Vec::new(); densities.len()];
        let robust = RefCell::default();
        let mut look = Look { densities, sight, shifted, fits, robust, inside, spread, factor, listener };
        listener(Part::Shifts);
        // One density at a time: it is read again and again and should stay near.
        for density in 0..densities.len() {
            (0..look.shifted.len()).for_each(|i| look.fit(density, i));
        }
        if spread.iter().all(|s| reach(*s) <= FEW) {
            look.closer();
        }
        look
    }

    /// Looks at what lies half a px beside the best shift of each density; the first one is tried on all of them.
    fn closer(&mut self) {
        let mut taken: BTreeMap<[i32; 2], usize> = BTreeMap::new();
        for density in (0..self.densities.len()).rev() {
            for halves in self.round_best(density) {
                let index = *taken.entry(halves).or_insert(self.shifted.len());
                if index == self.shifted.len() {
                    (self.listener)(Part::Windows);
                    self.shifted.push(seen(halves, self.factor, &self.sight));
                    (self.listener)(Part::Shifts);
                }
                if density > 0 {
                    self.fit(density, index);
                }
            }
        }
        taken.into_values().for_each(|index| self.fit(0, index));
    }

    fn fit(&mut self, density: usize, shift: usize) {
        let asked = self.shifted[shift].some.as_deref().unwrap_or_else(|| self.coefficients(shift));
        let fit = self.densities[density].searched(asked);
        self.fits[density].push((shift, fit));
    }

    /// What lies half a px (of the photo) beside the best shift of a density, in half px.
    fn round_best(&self, density: usize) -> Vec<[i32; 2]> {
        let free = self.free();
        let fit = |&(i, fit): &(usize, f64)| fit + self.prior(i, &free);
        let best = self.fits[density].iter().max_by(|a, b| fit(a).total_cmp(&fit(b)));
        let [x, y] = best.map_or([0, 0], |b| self.shifted[b.0].shift.map(|v| (v * self.factor * 2.0).round() as i32));
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
        (self.listener)(Part::Likelihood);
        let prior = |i: usize| weight * self.prior(i, expected);
        let mut quick: Vec<(f64, usize)> = self.fits[density].iter().map(|&(i, fit)| (fit + prior(i), i)).collect();
        let better = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1));
        quick.sort_by(|a, b| better(b, a));
        quick.truncate(SHORT_LIST);
        // Where a search asks some coefficients only, these choose among the listed as well.
        let some = |&(_, i): &(f64, usize)| {
            let asked = self.shifted[i].some.as_deref()?;
            Some((self.densities[density].searched_student(asked) + prior(i), i))
        };
        if let Some(of_some) = quick.iter().map(some).collect::<Option<Vec<_>>>() {
            quick = of_some.into_iter().max_by(better).into_iter().collect();
        }
        let robust = |&(_, i): &(f64, usize)| (self.student(density, i) + prior(i), i);
        quick.iter().map(robust).max_by(better).unwrap_or((f64::NEG_INFINITY, 0))
    }

    /// A density's log-likelihood at a shift, worked out once.
    fn student(&self, density: usize, shift: usize) -> f64 {
        let known = self.robust.borrow().get(&(density, shift)).copied();
        known.unwrap_or_else(|| {
            let all = self.coefficients(shift);
            (self.listener)(Part::Likelihood);
            let value = self.densities[density].student(all);
            self.robust.borrow_mut().insert((density, shift), value);
            value
        })
    }

    /// All coefficients at a shift, worked out once.
    pub(super) fn coefficients(&self, shift: usize) -> &[f32] {
        let shifted = &self.shifted[shift];
        shifted.all.get_or_init(|| {
            (self.listener)(Part::Windows);
            self.sight.all(shifted.shift)
        })
    }

    /// A shift in node px.
    pub(super) fn shift(&self, shift: usize) -> [f64; 2] {
        self.shifted[shift].shift
    }

    /// The shift (node px) at which the first density fits best.
    pub fn best_shift(&self) -> [f64; 2] {
        self.shift(self.likeliest(0, &self.free(), 1.0).1)
    }

    /// The same between the shifts tried: where a parabola through the best and those beside it has its top, along either axis.
    pub fn measured_shift(&self) -> [f64; 2] {
        let best = self.likeliest(0, &self.free(), 1.0).1;
        let at = self.shift(best);
        let here = self.fits[0].iter().find(|(i, _)| *i == best).map_or(0.0, |(_, fit)| *fit);
        [0, 1].map(|axis| {
            // (distance, fit) of the nearest on either side.
            let beside = |side: f64| {
                let along = |&(i, fit): &(usize, f64)| {
                    let shift = self.shift(i);
                    let far = (shift[axis] - at[axis]) * side;
                    (shift[1 - axis] == at[1 - axis] && far > 0.0).then_some((far, fit))
                };
                self.fits[0].iter().filter_map(along).min_by(|a, b| a.0.total_cmp(&b.0))
            };
            let top = beside(-1.0).zip(beside(1.0)).and_then(|(below, above)| top(below, here, above));
            at[axis] + top.unwrap_or(0.0)
        })
    }
}

/// Where a parabola through three points, (distance below, value), value at 0 and (distance above, value), has its top: at most half
/// way to its neighbours. `None` where it has none.
fn top(below: (f64, f64), here: f64, above: (f64, f64)) -> Option<f64> {
    let ((a, left), (b, right)) = (below, above);
    let (down, up) = ((left - here) / a, (right - here) / b);
    let bend = down + up;
    let top = (up * a - down * b) / -(2.0 * bend);
    (bend < 0.0).then(|| top.clamp(-a / 2.0, b / 2.0))
}

/// A node at a shift in half px of the photo.
fn seen(halves: [i32; 2], factor: f64, sight: &Sight) -> Shifted {
    let shift = halves.map(|v| f64::from(v) / 2.0 / factor);
    Shifted { shift, some: sight.some(shift), all: OnceCell::new() }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_top_where_it_was_drawn() {
        for at in [-0.2, 0.0, 0.15] {
            let value = |x: f64| 3.0 - 2.0 * (x - at) * (x - at);
            let found = top((0.5, value(-0.5)), value(0.0), (1.0, value(1.0))).unwrap();
            assert!((found - at).abs() < 1e-12, "{found} for {at}");
        }
        assert_eq!(top((0.5, 1.0), 0.0, (0.5, 1.0)), None, "a valley has no top");
        assert_eq!(top((1.0, -9.0), 0.0, (1.0, 8.0)), Some(0.5), "at most half way");
    }
}
