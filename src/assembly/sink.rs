//! What comes down when the component that bears it is missing.
//!
//! In: who rests on whom and who is above whom, the solids in their places. Out: the components that then have no rest left,
//! and how far they come down, all together, until one of them meets what stays. Never says that they must: what is tight
//! or threaded may stay where it was. Never tilts anything.

use super::columns::{Columns, Extent, Frame, Grid, project};
use super::insertion::Insertion;
use super::liaison::Liaison;
use crate::solid::Solid;
use nalgebra::{Isometry3, Translation3, Unit, Vector3};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Components that come down together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sink {
    /// Indices into the design's components, ascending.
    pub components: Vec<usize>,
    /// The motion (mm, assembly's frame).
    pub down: [f64; 3],
}

/// Only towards the floor do things fall: the cosine between the removal direction and upwards is at least this.
const UPRIGHT: f64 = 0.7;
/// Side of a cell (mm), and the most cells across.
const CELL: f64 = 0.3;
const MOST_CELLS: f64 = 400.0;
/// What enters by less than this (mm) lies on the other; what enters more is held by its side, as a thread is.
const ENTERS: f64 = 0.1;
/// So many cells have to meet: fewer are the facets of two round faces.
const CELLS_THAT_BEAR: usize = 6;
/// Who comes down by less than this (mm) looks as before.
const LEAST: f64 = 0.3;

/// What comes down when a component is taken away, if anything does. `solids` and `poses` hold one entry per component.
pub(crate) fn sink(
    missing: usize,
    insertion: &Insertion,
    liaison: &Liaison,
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
) -> Option<Sink> {
    let direction = insertion.direction(missing);
    if direction.z < UPRIGHT {
        return None;
    }
    let components = left_without_rest(missing, &insertion.above[missing], liaison, direction);
    let stays = |c: &usize| *c != missing && !components.contains(c);
    let others: Vec<usize> = (0..solids.len()).filter(stays).collect();
    let components: Vec<usize> = components.iter().copied().collect();
    let depth = fall(&components, &others, direction, solids, poses)?;
    let down = (direction.into_inner() * -depth).into();
    (depth >= LEAST).then_some(Sink { components, down })
}

impl Sink {
    /// The components with their new poses.
    pub(crate) fn moved(&self, poses: &[Isometry3<f64>]) -> Vec<(usize, Isometry3<f64>)> {
        let down = Translation3::from(Vector3::from(self.down));
        self.components.iter().map(|&c| (c, down * poses[c])).collect()
    }
}

/// Those above that rest on nothing but the missing component and each other.
fn left_without_rest(
    missing: usize,
    above: &[usize],
    liaison: &Liaison,
    direction: Unit<Vector3<f64>>,
) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    loop {
        let falls = |c: &&usize| {
            let mut bearers = liaison.bearers(**c, direction).peekable();
            !found.contains(*c) && bearers.peek().is_some() && bearers.all(|b| b == missing || found.contains(&b))
        };
        match above.iter().find(falls) {
            Some(&next) => found.insert(next),
            None => return found,
        };
    }
}

/// How far (mm) `components` come down together until they meet one of `others`; `None` if they meet nothing.
fn fall(
    components: &[usize],
    others: &[usize],
    direction: Unit<Vector3<f64>>,
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
) -> Option<f64> {
    let frame = Frame::along(direction);
    let points = |c: usize| project(&solids[c].mesh, &poses[c], &frame);
    let extents: Vec<Extent> = components.iter().map(|&c| Extent::of(&points(c))).collect();
    let whole = extents.into_iter().reduce(|a, b| Extent {
        low: [0, 1, 2].map(|i| a.low[i].min(b.low[i])),
        high: [0, 1, 2].map(|i| a.high[i].max(b.high[i])),
    })?;
    let widest = (0..2).map(|i| whole.high[i] - whole.low[i]).fold(0.0, f64::max);
    let grid = Grid::over(&whole, CELL.max(widest / MOST_CELLS));
    let columns = |c: usize| Columns::new(&solids[c].mesh, &points(c), &grid);
    let falling: Vec<Columns> = components.iter().map(|&c| columns(c)).collect();
    let staying: Vec<Columns> = others.iter().map(|&c| columns(c)).collect();
    let mut gaps: Vec<f64> = Vec::new();
    for cell in 0..grid.cells() {
        let tops = || staying.iter().flat_map(|s| s.spans(cell)).map(|span| span[1]);
        let undersides = falling.iter().flat_map(|f| f.spans(cell)).map(|span| span[0]);
        let gap = |underside: f64| tops().map(|top| underside - top).filter(|g| *g > -ENTERS).reduce(f64::min);
        gaps.extend(undersides.filter_map(gap).reduce(f64::min));
    }
    gaps.sort_by(f64::total_cmp);
    gaps.get(CELLS_THAT_BEAR - 1).map(|gap| gap.max(0.0))
}

#[cfg(test)]
mod tests {
    use super::super::{contact::contacts, insertion::insertion, sample};
    use super::*;
    use crate::assembly::place::place;

    /// A stud in a plate, on the plate a strap with a hole, on it a washer, on that a nut.
    fn clamped(washer: f64) -> [Option<Sink>; 3] {
        let mut shop = sample::Shop::default();
        let hole = |d: f64| vec![sample::Cut::hole("hole", 0.0, 0.0, d, 0.0)];
        let plate = shop.plate("plate", [5.0, 0.0], [40.0, 0.0], &hole(6.0));
        let strap = shop.plate("strap", [4.0, 0.0], [30.0, 0.0], &hole(7.0));
        let ring = shop.plate("washer", [washer, 0.0], [14.0, 0.0], &hole(6.4));
        let nut = shop.plate("nut", [5.0, 0.0], [10.0, 0.0], &hole(6.0));
        let stud = shop.pin("stud", &[("bar", 6.0, 6.0, [0.0, 0.0], 25.0)]);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        shop.place("strap", strap, [0.0, 0.0, 5.0], 0.0, 0.0);
        shop.place("washer", ring, [0.0, 0.0, 9.0], 0.0, 0.0);
        shop.place("nut", nut, [0.0, 0.0, 9.0 + washer], 0.0, 0.0);
        shop.place("stud", stud, [0.0; 3], 0.0, 0.0);
        let a = shop.finish();
        let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
        let order = insertion(&a.design, &a.solids, &liaison);
        let poses = place(&a.design, &a.design.nominal());
        [1, 2, 3].map(|c| sink(c, &order, &liaison, &a.solids, &poses))
    }

    #[test]
    fn the_nut_comes_down_by_the_thickness_of_its_missing_washer() {
        let [strap, washer, nut] = clamped(1.6);
        let washer = washer.expect("the nut has nothing under it");
        assert_eq!(washer.components, [3]);
        assert!((Vector3::from(washer.down) + Vector3::z() * 1.6).norm() < 1e-6, "{washer:?}");
        let strap = strap.expect("washer and nut have nothing under them");
        assert_eq!(strap.components, [2, 3]);
        assert!((strap.down[2] + 4.0).abs() < 1e-6, "{strap:?}");
        assert_eq!(nut, None, "nothing rests on the nut");
    }

    #[test]
    fn what_comes_down_by_less_than_can_be_seen_stays() {
        assert_eq!(clamped(0.2)[1], None);
    }
}
