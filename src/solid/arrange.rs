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

use super::csg::{Bounds, Leaf, Side, Tree};
use super::intersect::{Known, intersect};
use super::locus::Locus;
use super::tolerance;
use super::trace::{Meeting, Shared, Tangled, trace};
use crate::diag::Diagnostic;
use nalgebra::{Point3, Vector3};
use std::collections::{BTreeMap, HashMap};

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
    /// Parameters of the ends, the second the larger; a period apart on a closed arc.
    pub span: [f64; 2],
    /// Corners at the ends; `None` on a closed arc.
    pub ends: Option<[usize; 2]>,
    pub uses: Vec<Use>,
}

#[derive(Debug, Clone)]
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
    let arcs = dissolve(arcs, corners.points.len(), &curves);
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
    /// Points on it where two of its surfaces touch, or have no normal.
    nodes: Vec<Point3<f64>>,
}

/// Curves of all pairs of surfaces whose leaves come near each other.
fn shared_curves(tree: &Tree) -> Result<Vec<SharedCurve>, Vec<Diagnostic>> {
    let mut pool = Pool::new(tree);
    for (pair, meetings) in meetings(tree) {
        let shared = match intersect(&tree.surfaces[pair.0], &tree.surfaces[pair.1]) {
            Known::All(shared) => shared,
            Known::Touching(touching) => {
                let traced = trace(tree, [pair.0, pair.1], &meetings, &touching);
                let Shared { mut loci, nodes } = traced.map_err(|Tangled| vec![tangled(tree, &meetings)])?;
                loci.extend(touching);
                Shared { loci, nodes }
            }
        };
        for locus in shared.loci {
            let curve = pool.intern(locus, pair.0, pair.1);
            let curve = &mut pool.curves[curve];
            meetings.iter().for_each(|m| curve.extend(&m.bounds));
            curve.nodes.extend(&shared.nodes);
        }
    }
    Ok(pool.curves)
}

/// Where leaves on each pair of surfaces come near each other, in the order in which the pairs are first met.
fn meetings(tree: &Tree) -> Vec<((usize, usize), Vec<Meeting>)> {
    let material = tree.material().widened(tolerance::CULL);
    let mut place: HashMap<(usize, usize), usize> = HashMap::new();
    let mut found: Vec<((usize, usize), Vec<Meeting>)> = Vec::new();
    for (i, first) in tree.leaves.iter().enumerate() {
        for (j, second) in tree.leaves.iter().enumerate().skip(i) {
            let both = first.bounds.common(&second.bounds.widened(tolerance::CULL));
            let Some(bounds) = both.and_then(|b| b.common(&material)) else { continue };
            for pair in side_pairs(first, second) {
                let at = *place.entry(pair).or_insert_with(|| {
                    found.push((pair, Vec::new()));
                    found.len() - 1
                });
                found[at].1.push(Meeting { leaves: [i, j], bounds });
            }
        }
    }
    found
}

fn side_pairs(first: &Leaf, second: &Leaf) -> Vec<(usize, usize)> {
    let pairs = first.sides.iter().flat_map(|a| second.sides.iter().map(move |b| (a.surface, b.surface)));
    pairs.filter(|(a, b)| a != b).map(|(a, b)| (a.min(b), a.max(b))).collect()
}

fn tangled(tree: &Tree, meetings: &[Meeting]) -> Diagnostic {
    let [first, second] = meetings.first().map_or([0, 0], |m| m.leaves).map(|l| &tree.leaves[l]);
    let message = format!(
        "`{}` and `{}` of `{}` almost touch: their curve cannot be told",
        first.name, second.name, tree.part.name
    );
    Diagnostic::error("E0406", second.span, message)
        .label("runs along the other closer than can be resolved")
        .also(first.span, "this one")
        .note("let them touch exactly, overlap clearly, or keep them apart")
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
        self.curves.push(SharedCurve {
            locus,
            surfaces: Vec::new(),
            reach,
            bounds: Bounds::empty(),
            nodes: Vec::new(),
        });
        self.curves.len() - 1
    }

    /// A distance that moves by at most a few tolerances between equal curves, in bins.
    fn key(&self, locus: &Locus) -> f64 {
        let distance = match locus {
            Locus::Line { point, along } => super::surface::radial(point, along, &self.reference).norm(),
            Locus::Circle { centre, radius, .. } => (centre - self.reference).norm() + radius,
            Locus::Ellipse { centre, .. } => (centre - self.reference).norm(),
            // The same curve may be traced from another start, so all traced curves share a bin.
            Locus::Traced(_) => 0.0,
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
            other => {
                let Some(round) = other.bounds().filter(|b| b.common(&near).is_some()) else { return };
                self.reach = [0.0, other.period().unwrap_or(f64::INFINITY)];
                self.bounds = round;
            }
        }
    }

    /// Corners on the curve in the order of their parameters: where the sides of leaves cross it, and its nodes.
    fn stops(&self, tree: &Tree, corners: &mut Corners) -> Vec<(f64, usize)> {
        let mut stops: Vec<(f64, usize)> = Vec::new();
        if self.reach[0] > self.reach[1] {
            return stops;
        }
        let near = self.bounds.widened(tolerance::CULL);
        let mut stop = |p: Point3<f64>, stops: &mut Vec<(f64, usize)>| {
            let corner = corners.intern(p);
            stops.extend(self.locus.parameters(&corners.points[corner]).into_iter().map(|t| (t, corner)));
        };
        let mut known: BTreeMap<usize, Vec<Point3<f64>>> = BTreeMap::new();
        for leaf in tree.leaves.iter().filter(|l| l.bounds.common(&near).is_some()) {
            for side in leaf.sides.iter().filter(|s| self.surfaces.binary_search(&s.surface).is_err()) {
                let points = known.entry(side.surface).or_insert_with(|| {
                    let crossings = self.locus.crossings(&tree.surfaces[side.surface]).unwrap_or_default();
                    crossings.into_iter().map(|t| self.locus.at(t)).filter(|p| near.holds(p)).collect()
                });
                for p in points {
                    if tree.near_leaf(leaf, p, Some(side.surface), tolerance::WELD) {
                        stop(*p, &mut stops);
                    }
                }
            }
        }
        for node in &self.nodes {
            if (self.locus.at(self.locus.parameter(node)) - node).norm() < tolerance::WELD {
                stop(*node, &mut stops);
            }
        }
        stops.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        stops.dedup_by(|b, a| self.at_one_corner(*a, *b));
        if let (Some(period), [first, .., last]) = (self.locus.period(), &stops[..])
            && self.at_one_corner(*last, (first.0 + period, first.1))
        {
            stops.pop();
        }
        stops
    }

    /// Whether two stops are one, rather than the ends of a loop from a corner back to it.
    fn at_one_corner(&self, a: (f64, usize), b: (f64, usize)) -> bool {
        let [from, middle] = [a.0, (a.0 + b.0) / 2.0].map(|t| self.locus.at(t));
        a.1 == b.1 && (middle - from).norm() < CELL
    }

    /// Arcs between neighbouring stops; a closed curve without a stop is one arc.
    fn arcs(&self, curve: usize, stops: &[(f64, usize)]) -> Vec<Arc> {
        let arc = |span, ends| Arc { curve, span, ends, uses: Vec::new() };
        let Some(period) = self.locus.period().filter(|_| self.reach[0] <= self.reach[1]) else {
            let between = |w: &[(f64, usize)]| arc([w[0].0, w[1].0], Some([w[0].1, w[1].1]));
            return stops.windows(2).map(between).collect();
        };
        let Some(&(start, corner)) = stops.first() else { return vec![arc([0.0, period], None)] };
        let between = |w: &[(f64, usize)]| arc([w[0].0, w[1].0], Some([w[0].1, w[1].1]));
        let mut arcs: Vec<Arc> = stops.windows(2).map(between).collect();
        let &(last, from) = stops.last().unwrap_or(&(start, corner));
        arcs.push(arc([last, start + period], Some([from, corner])));
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
    /// Per side of the leaf: known to be inside or not, or through the curve (place in the curve's list, sense).
    sides: Vec<At>,
}

#[derive(Clone, Copy)]
enum At {
    Known(bool),
    Through(usize, f64),
}

/// The faces that end at the arc: sheets that bound the solid on one side of it only, or with different senses.
fn uses(tree: &Tree, curve: &SharedCurve, arc: &Arc) -> Vec<Use> {
    let t = (arc.span[0] + arc.span[1]) / 2.0;
    let (middle, tangent) = (curve.locus.at(t), curve.locus.tangent(t));
    // The curve of a cone, beyond its apex, is on none of its surfaces.
    let surfaces: Vec<usize> = curve
        .surfaces
        .iter()
        .copied()
        .filter(|s| tree.surfaces[*s].distance(&middle).abs() < tolerance::WELD)
        .collect();
    let through = Through { tree, surfaces: &surfaces, middle };
    let leaves: Vec<Nearby> = (0..tree.leaves.len()).filter_map(|l| through.nearby(l)).collect();
    if leaves.is_empty() || surfaces.len() < 2 {
        return Vec::new();
    }
    let mut uses = Vec::new();
    // Faces that pass the arc as if it were not there: two of them touch along it.
    let mut passing = Vec::new();
    for (place, &surface) in surfaces.iter().enumerate() {
        let left = tree.surfaces[surface].normal_at(&middle).cross(&tangent);
        let sheets = [left, -left].map(|step| through.sheet(&leaves, place, &step));
        if sheets[0].map(|s| s.0) == sheets[1].map(|s| s.0) {
            passing.extend(sheets[0].map(|(outward, leaf)| (surface, outward, leaf)));
            continue;
        }
        for (sheet, on_left) in sheets.iter().zip([true, false]) {
            if let Some((outward, leaf)) = *sheet {
                uses.push(Use { surface, outward, forward: on_left == outward, leaf });
            }
        }
    }
    if passing.len() > 1 || !(passing.is_empty() || uses.is_empty()) {
        let both = |(surface, outward, leaf)| [true, false].map(|forward| Use { surface, outward, forward, leaf });
        uses.extend(passing.into_iter().flat_map(both));
    }
    uses
}

/// The middle of an arc and the surfaces through it.
struct Through<'a> {
    tree: &'a Tree<'a>,
    surfaces: &'a [usize],
    middle: Point3<f64>,
}

impl Through<'_> {
    fn nearby(&self, leaf: usize) -> Option<Nearby> {
        let Leaf { bounds, sides, formula, .. } = &self.tree.leaves[leaf];
        if !bounds.widened(tolerance::CULL).holds(&self.middle) {
            return None;
        }
        let at = |side: &Side| match self.surfaces.binary_search(&side.surface) {
            Ok(place) => At::Through(place, side.sense),
            Err(_) => At::Known(self.tree.surfaces[side.surface].distance(&self.middle) * side.sense <= 0.0),
        };
        let sides: Vec<At> = sides.iter().map(at).collect();
        let may = formula.may_hold(&|i| match sides[i] {
            At::Known(inside) => Some(inside),
            At::Through(..) => None,
        });
        may.then_some(Nearby { leaf, sides })
    }

    /// Whether the sheet of the surface at `place`, a step from the arc along `step`, bounds the solid: with its outward
    /// sense and the first leaf whose side it is.
    fn sheet(&self, leaves: &[Nearby], place: usize, step: &Vector3<f64>) -> Option<(bool, usize)> {
        let signs: Vec<f64> = (0..self.surfaces.len()).map(|other| self.sign(place, other, step)).collect();
        let holds = |near: &Nearby, side: f64| {
            self.tree.leaves[near.leaf].formula.holds(&|i| match near.sides[i] {
                At::Known(inside) => inside,
                At::Through(at, sense) => sense * if at == place { side } else { signs[at] } < 0.0,
            })
        };
        let held = |side: f64| -> Vec<bool> { leaves.iter().map(|l| holds(l, side)).collect() };
        let sides = [held(-1.0), held(1.0)];
        let inside = |held: &[bool]| {
            self.tree.inside(leaves.iter().zip(held).filter(|(_, held)| **held).map(|(near, _)| near.leaf))
        };
        let (below, above) = (inside(&sides[0]), inside(&sides[1]));
        if below == above {
            return None;
        }
        let changes = (0..leaves.len()).find(|l| sides[0][*l] != sides[1][*l]);
        changes.map(|l| (below, leaves[l].leaf))
    }

    /// Sign of the distance from the surface at `other` after a step along `step` on the surface at `place`.
    fn sign(&self, place: usize, other: usize, step: &Vector3<f64>) -> f64 {
        if place == other {
            return 0.0;
        }
        let [on, to] = [place, other].map(|p| &self.tree.surfaces[self.surfaces[p]]);
        let normal = to.normal_at(&self.middle);
        let first = normal.dot(step);
        if first.abs() > TANGENT {
            return first.signum();
        }
        let middle = &self.middle;
        (to.bend(middle, step) - normal.dot(&on.normal_at(middle)) * on.bend(middle, step)).signum()
    }
}

/// Surfaces that meet at a smaller angle (rad) touch along their curve: the angle of a cylinder's side and a flat that
/// overlap by [`tolerance::TOUCH`] at a radius of 5 mm.
const TANGENT: f64 = 2e-4;

/// Joins arcs of one curve at corners where nothing else ends.
fn dissolve(arcs: Vec<Arc>, corners: usize, curves: &[SharedCurve]) -> Vec<Arc> {
    let mut degree = vec![0_u32; corners];
    arcs.iter().flat_map(|a| a.ends).flatten().for_each(|c| degree[c] += 1);
    let mut merged: Vec<Arc> = Vec::with_capacity(arcs.len());
    let mut first_of_curve = 0;
    for arc in arcs {
        if merged.last().is_none_or(|last| last.curve != arc.curve) {
            close_up(&mut merged, first_of_curve, &degree, curves);
            first_of_curve = merged.len();
        }
        match merged.last_mut() {
            Some(last) if joins(last, &arc, &degree) => last.absorb(&arc),
            _ => merged.push(arc),
        }
    }
    close_up(&mut merged, first_of_curve, &degree, curves);
    merged
}

/// Joins the last arc of a closed curve to its first, and makes a closed arc of one that meets itself.
fn close_up(arcs: &mut Vec<Arc>, first: usize, degree: &[u32], curves: &[SharedCurve]) {
    let period = arcs.get(first).and_then(|a| curves[a.curve].locus.period());
    let Some(period) = period else { return };
    if arcs.len() > first + 1 && joins(&arcs[arcs.len() - 1], &arcs[first], degree) {
        let head = arcs.remove(first);
        if let Some(last) = arcs.last_mut() {
            last.absorb(&head);
        }
    }
    if let Some(only) = arcs.get_mut(first)
        && only.ends.is_some_and(|[a, b]| a == b && degree[a] == 2)
    {
        only.span = [0.0, period];
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
