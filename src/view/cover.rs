//! Several cameras where one does not do: the fewest views that leave no fault to chance.
//!
//! In: views with what each lets pass of every error mode. Out: the smallest set of them such that every mode that any view
//! tells is told by one of the set. Never looks at a picture.

use super::escape::Weighed;

/// A view tells an error mode if it is predicted to let no more than this share pass.
pub const TELLS: f64 = 0.1;
/// Sets that are tried before the search settles for a greedy one.
const MOST_SETS: usize = 20_000;

/// The fewest of the views (indices into `views`, ascending) that tell every mode which any of them tells, with `first`
/// among them; of equally many, those that let the least pass. Searched exhaustively while the sets are few, greedily beyond.
pub fn fewest(views: &[Weighed], first: usize) -> Vec<usize> {
    let Some(start) = views.get(first) else { return Vec::new() };
    let share = |view: usize, mode: usize| views[view].escapes[mode].share;
    let told = |set: &[usize], mode: usize| set.iter().any(|&view| share(view, mode) <= TELLS);
    let all: Vec<usize> = (0..views.len()).collect();
    let modes: Vec<usize> = (0..start.escapes.len()).filter(|&mode| told(&all, mode)).collect();
    let covers = |set: &[usize]| modes.iter().all(|&mode| told(set, mode));
    let passes = |set: &[usize]| -> f64 {
        let least = |&mode: &usize| set.iter().map(|&view| share(view, mode)).fold(f64::INFINITY, f64::min);
        modes.iter().map(least).sum()
    };
    let others: Vec<usize> = all.iter().copied().filter(|&view| view != first).collect();
    let mut tried = 0;
    for size in 0..=others.len() {
        let mut best: Option<(f64, Vec<usize>)> = None;
        let mut places: Vec<usize> = (0..size).collect();
        loop {
            tried += 1;
            if tried > MOST_SETS {
                return greedy(first, &others, &modes, told);
            }
            let set: Vec<usize> = [first].into_iter().chain(places.iter().map(|&at| others[at])).collect();
            if covers(&set) {
                let worth = passes(&set);
                if best.as_ref().is_none_or(|(least, _)| worth < *least) {
                    best = Some((worth, set));
                }
            }
            if !advance(&mut places, others.len()) {
                break;
            }
        }
        if let Some((_, mut set)) = best {
            set.sort_unstable();
            return set;
        }
    }
    all
}

/// Takes, as long as a mode is not told, the view that tells most of those; of equals the first.
fn greedy(first: usize, others: &[usize], modes: &[usize], told: impl Fn(&[usize], usize) -> bool) -> Vec<usize> {
    let mut set = vec![first];
    loop {
        let left: Vec<usize> = modes.iter().copied().filter(|&mode| !told(&set, mode)).collect();
        let gain = |view: usize| left.iter().filter(|&&mode| told(&[view], mode)).count();
        let best = others.iter().copied().reduce(|best, next| if gain(next) > gain(best) { next } else { best });
        match best.filter(|&view| gain(view) > 0) {
            Some(view) => set.push(view),
            None => break,
        }
    }
    set.sort_unstable();
    set
}

/// The next ascending choice of as many places out of `count`; false after the last.
fn advance(places: &mut [usize], count: usize) -> bool {
    let size = places.len();
    let Some(at) = (0..size).rev().find(|&i| places[i] < count - size + i) else { return false };
    places[at] += 1;
    (at + 1..size).for_each(|i| places[i] = places[i - 1] + 1);
    true
}

#[cfg(test)]
mod tests {
    use super::super::escape::ModeEscape;
    use super::*;
    use crate::assembly::fault::FaultKind;

    fn views(shares: &[&[f64]]) -> Vec<Weighed> {
        let escape = |&share: &f64| ModeEscape { component: 1, kind: FaultKind::Missing, share };
        shares.iter().enumerate().map(|(view, s)| Weighed { view, escapes: s.iter().map(escape).collect() }).collect()
    }

    #[test]
    fn one_view_does_where_it_tells_all() {
        let views = views(&[&[0.0, 0.05], &[0.0, 0.0]]);
        assert_eq!(fewest(&views, 0), [0]);
        assert_eq!(fewest(&views, 1), [1]);
        assert_eq!(fewest(&[], 0), [0usize; 0]);
    }

    #[test]
    fn what_no_view_tells_asks_for_no_camera() {
        assert_eq!(fewest(&views(&[&[0.0, 0.9], &[0.0, 0.8]]), 0), [0]);
    }

    /// Greedy would take view 1 first and need three more; two others do.
    #[test]
    fn the_fewest_are_found_where_greed_takes_more() {
        let (yes, no) = (0.0, 1.0);
        let all = views(&[
            &[no, no, no, no, no, no],
            &[no, yes, yes, yes, yes, no],
            &[yes, yes, yes, no, no, no],
            &[no, no, no, yes, yes, yes],
        ]);
        assert_eq!(fewest(&all, 0), [0, 2, 3]);
    }

    /// Against every subset, for random tables.
    #[test]
    fn no_smaller_set_covers() {
        let mut stream = crate::rng::Stream::new(4, "cover", 0);
        for _ in 0..50 {
            let table: Vec<Vec<f64>> =
                (0..6).map(|_| (0..5).map(|_| if stream.uniform() < 0.35 { 0.0 } else { 1.0 }).collect()).collect();
            let views = views(&table.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let told = |set: u32, mode: usize| (0..6).any(|v| set >> v & 1 == 1 && table[v][mode] <= TELLS);
            let covers = |set: u32| (0..5).all(|mode| told(set, mode) || !told(63, mode));
            let least = (0..64u32).filter(|set| set & 1 == 1 && covers(*set)).map(u32::count_ones).min().unwrap();
            let found = fewest(&views, 0);
            assert_eq!(found.len() as u32, least);
            assert!(covers(found.iter().map(|v| 1 << v).sum()));
        }
    }

    #[test]
    fn many_views_are_covered_greedily_and_still_all() {
        // Forty modes, each told by one view alone: no set smaller than all is enough, and sets are far too many.
        let table: Vec<Vec<f64>> = (0..40).map(|v| (0..40).map(|m| f64::from(u8::from(v != m))).collect()).collect();
        let views = views(&table.iter().map(Vec::as_slice).collect::<Vec<_>>());
        assert_eq!(fewest(&views, 0).len(), 40);
    }
}
