//! A node in a photo at every shift of its local search.
//!
//! In: the node as the photo shows it at any shift, densities. Out: the shift at which a density fits best under what is
//! known of the place. Whole px of the photo come first; only round the best of each density half px follow. Never decides.

use super::density::Density;
use super::parts::{Listener, Part};
use super::settle::Expected;
use super::sight::Sight;
use std::cell::{OnceCell, RefCell};
use std::cmp::Ordering;
use std::collections::BTreeMap;

/// Local search: shifts of up to this many standard deviations of the node's place, and at most so many px of the photo,
/// each way. More would let a part that stands too high pass as one that stands a little further back.
const REACH: f64 = 2.0;
const LARGEST_REACH: f64 = 12.0;
/// A reach of more px than this is searched coarsely.
const FEW: f64 = 2.0;
/// Shifts that Gaussian noise likes best, among which Student's decides.
const SHORT_LIST: usize = 4;

/// A best shift nearer than this to where the search ends (px of the photo) lies at its edge.
const EDGE: f64 = 0.75;
/// A part is not looked for further from its place (px of the photo).
const FARTHEST: f64 = 16.0;
/// What lies beside a shift.
const WAYS: [[i32; 2]; 8] = [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

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
        WAYS.into_iter().map(|[dx, dy]| [x + dx, y + dy]).collect()
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

    /// By how much the first density fits better beyond the reach of the search (log-likelihood): what fits best at the edge of
    /// the search and ever better from there on lies beyond it. 0 where it fits best within.
    pub(super) fn beyond(&self) -> f64 {
        let start = self.best_shift().map(|v| v * self.factor);
        if [0, 1].iter().all(|&k| start[k].abs() + EDGE < reach(self.spread[k])) {
            return 0.0;
        }
        (self.listener)(Part::Shifts);
        let density = &self.densities[0];
        let at = |place: [f64; 2]| place.map(|v| v / self.factor);
        let fit = |place: [f64; 2]| match self.sight.some(at(place)) {
            Some(asked) => density.searched(&asked),
            None => density.searched(&self.sight.all(at(place))),
        };
        let step = (self.factor / 2.0).max(1.0);
        let (mut place, mut value) = (start, fit(start));
        loop {
            let round = WAYS.map(|way| [0, 1].map(|k| place[k] + step * f64::from(way[k])));
            let inside = round.into_iter().filter(|p| p.iter().all(|v| v.abs() <= FARTHEST));
            let Some((next, better)) = inside.map(|p| (p, fit(p))).max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            // What is no number is no better.
            if better.partial_cmp(&value) != Some(Ordering::Greater) {
                break;
            }
            (place, value) = (next, better);
        }
        if place == start {
            return 0.0;
        }
        let student = |place| density.student(&self.sight.all(at(place)));
        (student(place) - student(start)).max(0.0)
    }

    /// The likeliest of all densities: its log-likelihood and its best shift, of those tried.
    pub(super) fn likeliest_state(&self) -> (f64, usize) {
        let free = self.free();
        let all = (0..self.densities.len()).map(|density| self.likeliest(density, &free, 1.0));
        all.fold((f64::NEG_INFINITY, 0), |best, of| if of.0 > best.0 { of } else { best })
    }

    /// A shift in px of the photo.
    pub(super) fn shift_in_photo(&self, shift: usize) -> [f64; 2] {
        self.shift(shift).map(|v| v * self.factor)
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
    use super::super::camera::Camera;
    use super::super::density::{Floor, mean_of};
    use super::super::grid::Grid;
    use super::super::light::Light;
    use super::super::model::Lamp;
    use super::super::parts::nobody;
    use super::super::pose::Pose;
    use super::super::sight::Reduced;
    use super::super::window::{Frame, Stencil, Window};
    use super::*;

    /// A blob that the model expects in the middle of its window, in photos that show it there, within reach, and 6 px further.
    #[test]
    fn what_lies_beyond_the_search_fits_better_there() {
        let size = 120;
        let camera = Camera::look_at([0.0, 0.0, 300.0], [0.0; 3], 600.0, [size as u32; 2]);
        let home = Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 };
        let frame = Frame { plane: 0.0, factor: 1, origin: [40, 40], size: [40, 40] };
        let window = Window::new(frame, &camera, &home).unwrap();
        let stencil = Stencil::new(&vec![vec![true; 40]; 40], 4);
        let photo = |at: [f64; 2], bright: f64| {
            let value = |i: usize| {
                let [x, y] = [(i % size) as f64 - 60.0 - at[0], (i / size) as f64 - 60.0 - at[1]];
                (0.3 + bright * (-(x * x + y * y) / 60.0).exp()) as f32
            };
            Reduced::new(Grid::new(size, size, (0..size * size).map(value).collect()))
        };
        let lamp = Lamp { name: "l".into(), light: 0, power: 1.0, drift: 0.1 };
        let light = Light::new(&[1.0], &[lamp]);
        let in_place = [0.36, 0.4, 0.42, 0.44].map(|bright| photo([0.0; 2], bright));
        let sample = |reduced: &Reduced| {
            stencil.coefficients(&window.cut(&reduced.grid, &window.place(&camera, &home), [0.0; 2]))
        };
        let samples: Vec<Vec<f32>> = in_place.iter().map(sample).collect();
        let floor = Floor::new(&stencil.levels, 0.005, &mean_of(&samples), None);
        let densities = [Density::fit(&samples, Vec::new(), &floor)];
        let beyond = |at: [f64; 2]| {
            let reduced = photo(at, 0.4);
            let sight = Sight::new((&window, &stencil, None), (&light, &[]), &reduced, (&camera, &home));
            Look::new(&densities, [0.7; 2], sight, &nobody).beyond()
        };
        assert_eq!(beyond([0.0, 0.0]), 0.0);
        assert_eq!(beyond([1.0, -1.0]), 0.0, "within the search");
        assert!(
            beyond([6.0, 0.0]) > 100.0 && beyond([-4.0, 5.0]) > 100.0,
            "{} {}",
            beyond([6.0, 0.0]),
            beyond([-4.0, 5.0])
        );
    }

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
