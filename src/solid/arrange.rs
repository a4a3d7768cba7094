//! The arrangement: every curve between two surfaces, once, cut into arcs; and which arcs bound faces.
//!
//! In: a [`Tree`]. Out: [`Arrangement`]: corners, and arcs with the two faces that meet there. A curve is shared by all
//! surfaces through it, so both faces of an edge get the same arc and the same ends.
//!
//! Instead of classifying a point inside each cell of each surface, the sheets beside each arc are classified: at the
//! arc's middle, a step to the left or right on a surface, then above and below it. Surfaces through the curve answer
//! from the direction of the step (to second order where they touch), the surface stepped on from its sense, all others
//! from the sign of their distance, which is not small there. No probe point, so no probe distance to choose.
//! Merging of equal neighbours is implied: an arc with the same face on both sides is no edge.

use super::csg::{Bounds, Leaf, Tree};
use super::intersect::{Oblique, intersect, meet};
use super::locus::Locus;
use super::tolerance;
use crate::diag::Diagnostic;
use nalgebra::{Point3, Vector3};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;

/// A face that ends at an arc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Use {
    pub surface: usize,
    /// The outward normal equals the canonical one.
    pub outward: bool,
    /// The face lies to the left of the arc's direction, seen from outside.
    pub forward: bool,
    /// First leaf whose side the face is.
    pub leaf: usize,
}

/// A stretch of a curve on which nothing changes.
#[derive(Debug, Clone)]
pub(super) struct Arc {
    pub curve: usize,
    /// Parameters of the ends, the second the larger; a whole turn apart on a closed arc.
    pub span: [f64; 2],
    /// Corners at the ends; `None` on a closed arc.
    pub ends: Option<[usize; 2]>,
    pub uses: Vec<Use>,
}

#[derive(Debug)]
pub(super) struct Arrangement {
    pub curves: Vec<Locus>,
    pub corners: Vec<Point3<f64>>,
    pub arcs: Vec<Arc>,
}

/// Arcs that bound the solid, merged where no corner remains between them.
pub(super) fn arrange(tree: &Tree) -> Result<Arrangement, Vec<Diagnostic>> {
    let curves = shared_curves(tree)?;
    let mut corners = Corners::default();
    let mut arcs = Vec::new();
    for (index, curve) in curves.iter().enumerate() {
        let stops = curve.stops(tree, &mut corners);
        arcs.extend(curve.arcs(index, &stops).into_iter().filter_map(|mut arc| {
            arc.uses = uses(tree, curve, &arc);
            (!arc.uses.is_empty()).then_some(arc)
        }));
    }
    let arcs = dissolve(arcs, corners.points.len());
    Ok(Arrangement { curves: curves.into_iter().map(|c| c.locus).collect(), corners: corners.points, arcs })
}

/// A curve with all surfaces through it.
struct SharedCurve {
    locus: Locus,
    /// Ascending.
    surfaces: Vec<usize>,
    /// Stretch of a line that lies near both its surfaces' leaves.
    reach: [f64; 2],
    bounds: Bounds,
}

/// Curves of all pairs of surfaces whose leaves come near each other.
fn shared_curves(tree: &Tree) -> Result<Vec<SharedCurve>, Vec<Diagnostic>> {
    let mut pool = Pool::new(tree);
    let material = tree.material().widened(tolerance::CULL);
    let mut known: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    for (i, first) in tree.leaves.iter().enumerate() {
        for second in &tree.leaves[i..] {
            let both = first.bounds.common(&second.bounds.widened(tolerance::CULL));
            let Some(both) = both.and_then(|b| b.common(&material)) else { continue };
            for (a, b) in side_pairs(first, second) {
                if let std::collections::btree_map::Entry::Vacant(entry) = known.entry((a, b)) {
                    match intersect(&tree.surfaces[a], &tree.surfaces[b]) {
                        Ok(loci) => entry.insert(loci.into_iter().map(|l| pool.intern(l, a, b)).collect()),
                        Err(Oblique) if meet(tree, (a, b), [first, second], &both) => {
                            return Err(vec![oblique(tree, first, second)]);
                        }
                        // Another pair of leaves on these surfaces may meet.
                        Err(Oblique) => continue,
                    };
                }
                known[&(a, b)].iter().for_each(|c| pool.curves[*c].extend(&both));
            }
        }
    }
    Ok(pool.curves)
}

fn side_pairs(first: &Leaf, second: &Leaf) -> Vec<(usize, usize)> {
    let pairs = first.sides.iter().flat_map(|a| second.sides.iter().map(move |b| (a.surface, b.surface)));
    pairs.filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b))).collect()
}

fn oblique(tree: &Tree, first: &Leaf, second: &Leaf) -> Diagnostic {
    let span = |leaf: &Leaf| tree.part.features[leaf.feature].span;
    let message = format!(
        "`{}` and `{}` of `{}` meet in a curve that is neither a line nor a circle",
        first.name, second.name, tree.part.name
    );
    Diagnostic::error("E0406", span(second), message)
        .label("set obliquely to the other")
        .also(span(first), "this one")
        .note("axes may be parallel, or square to a flat face; cones and spheres may share an axis with what they meet")
}

/// Interns curves by their parameters.
struct Pool {
    curves: Vec<SharedCurve>,
    /// Curves by a number that equal curves share, rounded; see [`Pool::key`].
    index: HashMap<i64, Vec<usize>>,
    /// A point of no symmetry, so that few curves share a key.
    reference: Point3<f64>,
}

/// Width of a key's bin in mm: many tolerances wide, so that a curve is looked for in at most two bins.
const BIN: f64 = 1e-3;

impl Pool {
    fn new(tree: &Tree) -> Self {
        let mut all = Bounds::empty();
        tree.leaves.iter().for_each(|l| [l.bounds.low, l.bounds.high].iter().for_each(|p| all.include(p)));
        let reference = all.low + (all.high - all.low).component_mul(&Vector3::new(0.137, 0.291, 0.411));
        Pool { curves: Vec::new(), index: HashMap::new(), reference }
    }

    /// Index of the curve, now known to lie on surfaces `a` and `b`.
    fn intern(&mut self, locus: Locus, a: usize, b: usize) -> usize {
        let key = self.key(&locus);
        let bins = [key - 2.0 * tolerance::POINT / BIN, key + 2.0 * tolerance::POINT / BIN].map(|k| k.floor() as i64);
        let near = (bins[0]..=bins[1]).flat_map(|bin| self.index.get(&bin).into_iter().flatten().copied());
        let found = near.min_by_key(|c| (!self.curves[*c].locus.same(&locus), *c));
        let found = found.filter(|c| self.curves[*c].locus.same(&locus)).unwrap_or_else(|| self.add(locus, key));
        for surface in [a, b] {
            if let Err(at) = self.curves[found].surfaces.binary_search(&surface) {
                self.curves[found].surfaces.insert(at, surface);
            }
        }
        found
    }

    fn add(&mut self, locus: Locus, key: f64) -> usize {
        self.index.entry(key.floor() as i64).or_default().push(self.curves.len());
        let reach = [f64::INFINITY, f64::NEG_INFINITY];
        self.curves.push(SharedCurve { locus, surfaces: Vec::new(), reach, bounds: Bounds::empty() });
        self.curves.len() - 1
    }

    /// A distance that moves by at most a few tolerances between equal curves, in bins.
    fn key(&self, locus: &Locus) -> f64 {
        let distance = match locus {
            Locus::Line { point, along } => super::surface::radial(point, along, &self.reference).norm(),
            Locus::Circle { centre, radius, .. } => (centre - self.reference).norm() + radius,
        };
        distance / BIN
    }
}

impl SharedCurve {
    /// Counts the stretch inside `near` as part of the curve.
    fn extend(&mut self, near: &Bounds) {
        let near = near.widened(tolerance::CULL);
        match &self.locus {
            Locus::Line { point, along } => {
                let Some([a, b]) = near.clip(point, along) else { return };
                self.reach = [self.reach[0].min(a), self.reach[1].max(b)];
                [a, b].iter().for_each(|t| self.bounds.include(&(point + along.into_inner() * *t)));
            }
            Locus::Circle { centre, axis, radius, .. } => {
                let half = axis.map(|c| radius * (1.0 - c * c).max(0.0).sqrt());
                let round = Bounds { low: centre - half, high: centre + half };
                if round.common(&near).is_some() {
                    self.reach = [0.0, TAU];
                    self.bounds = round;
                }
            }
        }
    }

    /// Corners on the curve in the order of their parameters: where the sides of leaves cross it.
    fn stops(&self, tree: &Tree, corners: &mut Corners) -> Vec<(f64, usize)> {
        let mut stops: Vec<(f64, usize)> = Vec::new();
        if self.reach[0] > self.reach[1] {
            return stops;
        }
        let near = self.bounds.widened(tolerance::CULL);
        for leaf in tree.leaves.iter().filter(|l| l.bounds.common(&near).is_some()) {
            for side in leaf.sides.iter().filter(|s| self.surfaces.binary_search(&s.surface).is_err()) {
                for t in self.locus.crossings(&tree.surfaces[side.surface]).unwrap_or_default() {
                    let p = self.locus.at(t);
                    if near.holds(&p) && tree.near_leaf(leaf, &p, side.surface) {
                        let corner = corners.intern(p);
                        stops.push((self.locus.parameter(&corners.points[corner]), corner));
                    }
                }
            }
        }
        stops.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        stops.dedup_by_key(|s| s.1);
        if self.locus.closed() && stops.len() > 1 && stops[0].1 == stops[stops.len() - 1].1 {
            stops.pop();
        }
        stops
    }

    /// Arcs between neighbouring stops; a closed curve without a stop is one arc.
    fn arcs(&self, curve: usize, stops: &[(f64, usize)]) -> Vec<Arc> {
        let arc = |span, ends| Arc { curve, span, ends, uses: Vec::new() };
        if self.reach[0] > self.reach[1] || (!self.locus.closed() && stops.is_empty()) {
            return Vec::new();
        }
        let Some(&(start, corner)) = stops.first() else { return vec![arc([0.0, TAU], None)] };
        let between = |w: &[(f64, usize)]| arc([w[0].0, w[1].0], Some([w[0].1, w[1].1]));
        let mut arcs: Vec<Arc> = stops.windows(2).map(between).collect();
        if self.locus.closed() {
            let &(last, from) = stops.last().unwrap_or(&(start, corner));
            arcs.push(arc([last, start + TAU], Some([from, corner])));
        }
        arcs
    }
}

/// Points interned within [`tolerance::WELD`].
#[derive(Default)]
struct Corners {
    points: Vec<Point3<f64>>,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

/// Edge of the cells that corners are looked up in, in mm.
const CELL: f64 = 1e-4;

impl Corners {
    fn intern(&mut self, p: Point3<f64>) -> usize {
        let cell = |p: Point3<f64>| [p.x, p.y, p.z].map(|c| (c / CELL).floor() as i64);
        let reach = Vector3::repeat(tolerance::WELD);
        let (low, high) = (cell(p - reach), cell(p + reach));
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let here = self.cells.get(&[x, y, z]).into_iter().flatten();
                    if let Some(&i) = here.into_iter().find(|i| (self.points[**i] - p).norm() < tolerance::WELD) {
                        return i;
                    }
                }
            }
        }
        self.cells.entry(cell(p)).or_default().push(self.points.len());
        self.points.push(p);
        self.points.len() - 1
    }
}

/// A leaf that holds the middle of an arc, as far as the surfaces through the curve allow.
struct Nearby {
    leaf: usize,
    /// Its sides through the curve: (place in the curve's list, sense).
    through: Vec<(usize, f64)>,
}

/// The faces that end at the arc: sheets that bound the solid on one side of it only, or with different senses.
fn uses(tree: &Tree, curve: &SharedCurve, arc: &Arc) -> Vec<Use> {
    let t = (arc.span[0] + arc.span[1]) / 2.0;
    let (middle, tangent) = (curve.locus.at(t), curve.locus.tangent(t));
    let leaves: Vec<Nearby> = (0..tree.leaves.len()).filter_map(|l| nearby(tree, curve, l, &middle)).collect();
    if leaves.is_empty() {
        return Vec::new();
    }
    let mut uses = Vec::new();
    for (place, &surface) in curve.surfaces.iter().enumerate() {
        let normal = tree.surfaces[surface].normal_at(&middle);
        let left = normal.cross(&tangent);
        let sheets = [left, -left].map(|step| sheet(tree, curve, &leaves, place, &middle, &step));
        if sheets[0].map(|s| s.0) == sheets[1].map(|s| s.0) {
            continue;
        }
        for (sheet, on_left) in sheets.iter().zip([true, false]) {
            if let Some((outward, leaf)) = *sheet {
                uses.push(Use { surface, outward, forward: on_left == outward, leaf });
            }
        }
    }
    uses
}

fn nearby(tree: &Tree, curve: &SharedCurve, leaf: usize, p: &Point3<f64>) -> Option<Nearby> {
    if !tree.leaves[leaf].bounds.widened(tolerance::CULL).holds(p) {
        return None;
    }
    let mut through = Vec::new();
    for side in &tree.leaves[leaf].sides {
        match curve.surfaces.binary_search(&side.surface) {
            Ok(place) => through.push((place, side.sense)),
            Err(_) if tree.surfaces[side.surface].distance(p) * side.sense > 0.0 => return None,
            Err(_) => {}
        }
    }
    Some(Nearby { leaf, through })
}

/// Whether the sheet of the curve's surface `place`, a step from the arc along `step`, bounds the solid: with its
/// outward sense and the first leaf whose side it is.
fn sheet(
    tree: &Tree,
    curve: &SharedCurve,
    leaves: &[Nearby],
    place: usize,
    middle: &Point3<f64>,
    step: &Vector3<f64>,
) -> Option<(bool, usize)> {
    let signs: Vec<f64> =
        (0..curve.surfaces.len()).map(|other| sign(tree, curve, place, other, middle, step)).collect();
    let holds = |near: &Nearby, side: f64| {
        near.through.iter().all(|&(at, sense)| sense * if at == place { side } else { signs[at] } < 0.0)
    };
    let inside = |side: f64| tree.inside(leaves.iter().filter(|l| holds(l, side)).map(|l| l.leaf));
    let (below, above) = (inside(-1.0), inside(1.0));
    if below == above {
        return None;
    }
    let is_side =
        |near: &&Nearby| near.through.iter().any(|(at, _)| *at == place) && (holds(near, -1.0) || holds(near, 1.0));
    leaves.iter().find(is_side).map(|owner| (below, owner.leaf))
}

/// Sign of the distance from surface `other` after a step along `step` on surface `place`.
fn sign(
    tree: &Tree,
    curve: &SharedCurve,
    place: usize,
    other: usize,
    middle: &Point3<f64>,
    step: &Vector3<f64>,
) -> f64 {
    if place == other {
        return 0.0;
    }
    let (on, to) = (&tree.surfaces[curve.surfaces[place]], &tree.surfaces[curve.surfaces[other]]);
    let normal = to.normal_at(middle);
    let first = normal.dot(step);
    if first.abs() > TANGENT {
        return first.signum();
    }
    (to.bend(middle, step) - normal.dot(&on.normal_at(middle)) * on.bend(middle, step)).signum()
}

/// Surfaces that meet at a smaller angle (rad) touch along their curve: the angle of a cylinder's side and a flat that
/// overlap by [`tolerance::TOUCH`] at a radius of 5 mm.
const TANGENT: f64 = 2e-4;

/// Joins arcs of one curve at corners where nothing else ends.
fn dissolve(arcs: Vec<Arc>, corners: usize) -> Vec<Arc> {
    let mut degree = vec![0_u32; corners];
    arcs.iter().flat_map(|a| a.ends).flatten().for_each(|c| degree[c] += 1);
    let mut merged: Vec<Arc> = Vec::with_capacity(arcs.len());
    let mut first_of_curve = 0;
    for arc in arcs {
        if merged.last().is_none_or(|last| last.curve != arc.curve) {
            close_up(&mut merged, first_of_curve, &degree);
            first_of_curve = merged.len();
        }
        match merged.last_mut() {
            Some(last) if joins(last, &arc, &degree) => last.absorb(&arc),
            _ => merged.push(arc),
        }
    }
    close_up(&mut merged, first_of_curve, &degree);
    merged
}

/// Joins the last arc of a closed curve to its first, and makes a closed arc of one that meets itself.
fn close_up(arcs: &mut Vec<Arc>, first: usize, degree: &[u32]) {
    if arcs.len() > first + 1 && joins(&arcs[arcs.len() - 1], &arcs[first], degree) {
        let head = arcs.remove(first);
        if let Some(last) = arcs.last_mut() {
            last.absorb(&head);
        }
    }
    if let Some(only) = arcs.get_mut(first)
        && only.ends.is_some_and(|[a, b]| a == b && degree[a] == 2)
    {
        only.span = [0.0, TAU];
        only.ends = None;
    }
}

fn joins(a: &Arc, b: &Arc, degree: &[u32]) -> bool {
    let (Some([_, end]), Some([start, _])) = (a.ends, b.ends) else { return false };
    a.curve == b.curve && end == start && degree[end] == 2
}

impl Arc {
    /// Goes on to the end of `next`, which starts where this one ends.
    fn absorb(&mut self, next: &Arc) {
        self.span[1] += next.span[1] - next.span[0];
        if let (Some(mine), Some(other)) = (&mut self.ends, next.ends) {
            mine[1] = other[1];
        }
        for (mine, other) in self.uses.iter_mut().zip(&next.uses) {
            mine.leaf = mine.leaf.min(other.leaf);
        }
    }
}
