//! A part and its values as a tree of half-spaces over interned surfaces.
//!
//! In: [`Part`] and one value per dimension. Out: [`Tree`]: every copy of every feature as a leaf, a formula over
//! half-spaces. Surfaces that coincide are one from here on: coincidence is decided here, once, on their parameters.

use super::primitive::Sized;
use super::surface::radial;
use super::{Surface, tolerance};
use crate::design::model::{Feature, FeatureCopy, Op, Part, Shape, Values};
use crate::diag::{Diagnostic, Span};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::iter::Peekable;
use std::ops::Range;

/// One bounding side of a leaf.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub surface: usize,
    /// +1 when the leaf lies where the surface's distance is negative, -1 when where it is positive.
    pub sense: f64,
    /// Empty when the leaf has no face there.
    pub name: Cow<'static, str>,
}

/// Where a leaf is, in terms of its sides.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Formula {
    /// Inside that side, an index into the leaf's sides.
    Side(usize),
    All(Vec<Formula>),
    Any(Vec<Formula>),
    Not(Box<Formula>),
}

impl Formula {
    pub fn not(of: Formula) -> Formula {
        match of {
            Formula::Not(inner) => *inner,
            other => Formula::Not(Box::new(other)),
        }
    }

    /// Whether it holds, given on which sides' inside a point is.
    pub fn holds(&self, inside: &impl Fn(usize) -> bool) -> bool {
        match self {
            Formula::Side(side) => inside(*side),
            Formula::All(terms) => terms.iter().all(|t| t.holds(inside)),
            Formula::Any(terms) => terms.iter().any(|t| t.holds(inside)),
            Formula::Not(term) => !term.holds(inside),
        }
    }

    /// Whether it may hold, where some sides cannot tell: `None` stands for either answer.
    pub fn may_hold(&self, inside: &impl Fn(usize) -> Option<bool>) -> bool {
        self.known(inside) != Some(false)
    }

    fn known(&self, inside: &impl Fn(usize) -> Option<bool>) -> Option<bool> {
        let fold = |terms: &[Formula], decisive: bool| {
            let mut known = Some(!decisive);
            for term in terms {
                match term.known(inside) {
                    Some(value) if value == decisive => return Some(decisive),
                    Some(_) => {}
                    None => known = None,
                }
            }
            known
        };
        match self {
            Formula::Side(side) => inside(*side),
            Formula::All(terms) => fold(terms, false),
            Formula::Any(terms) => fold(terms, true),
            Formula::Not(term) => term.known(inside).map(|value| !value),
        }
    }

    /// With a formula in place of every side.
    pub fn replaced(&self, sides: &[Formula]) -> Formula {
        let all = |terms: &[Formula]| terms.iter().map(|t| t.replaced(sides)).collect();
        match self {
            Formula::Side(side) => sides[*side].clone(),
            Formula::All(terms) => Formula::All(all(terms)),
            Formula::Any(terms) => Formula::Any(all(terms)),
            Formula::Not(term) => Formula::not(term.replaced(sides)),
        }
    }
}

/// One copy of a primitive.
#[derive(Debug, Clone)]
pub(super) struct Leaf {
    /// Of the feature it is a copy of.
    pub span: Span,
    /// `bore[2]`, `bore` when the feature is not a pattern, `mount[3].bore` in a group.
    pub name: String,
    pub sides: Vec<Side>,
    pub formula: Formula,
    pub bounds: Bounds,
    /// Whether it is material that was added, rather than cut or kept.
    pub adds: bool,
}

/// A box along the part's axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    pub low: Point3<f64>,
    pub high: Point3<f64>,
}

impl Bounds {
    pub fn empty() -> Self {
        let far = f64::INFINITY;
        Bounds { low: Point3::new(far, far, far), high: Point3::new(-far, -far, -far) }
    }

    pub fn include(&mut self, p: &Point3<f64>) {
        self.low = self.low.inf(p);
        self.high = self.high.sup(p);
    }

    pub fn widened(&self, by: f64) -> Self {
        let by = Vector3::repeat(by);
        Bounds { low: self.low - by, high: self.high + by }
    }

    pub fn common(&self, other: &Bounds) -> Option<Bounds> {
        let both = Bounds { low: self.low.sup(&other.low), high: self.high.inf(&other.high) };
        (0..3).all(|i| both.low[i] <= both.high[i]).then_some(both)
    }

    pub fn holds(&self, p: &Point3<f64>) -> bool {
        (0..3).all(|i| self.low[i] <= p[i] && p[i] <= self.high[i])
    }

    /// The stretch of the line `point + t along` inside the box.
    pub fn clip(&self, point: &Point3<f64>, along: &Vector3<f64>) -> Option<[f64; 2]> {
        let mut stretch = [f64::NEG_INFINITY, f64::INFINITY];
        for i in 0..3 {
            if along[i].abs() < tolerance::DIRECTION {
                if point[i] < self.low[i] || point[i] > self.high[i] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((self.low[i] - point[i]) / along[i], (self.high[i] - point[i]) / along[i]);
            stretch = [stretch[0].max(a.min(b)), stretch[1].min(a.max(b))];
        }
        (stretch[0] <= stretch[1]).then_some(stretch)
    }
}

/// One feature: what it does to the material above it, and the leaves that it is made of.
#[derive(Debug)]
struct Step {
    op: Op,
    leaves: Range<usize>,
    /// Of a group: the steps of each of its copies.
    groups: Vec<Vec<Step>>,
}

/// The part: features folded from first to last, each the union of its copies.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    pub part: &'a Part,
    pub surfaces: Vec<Surface>,
    pub leaves: Vec<Leaf>,
    steps: Vec<Step>,
    /// Surfaces by [`Tree::key`].
    index: BTreeMap<i64, Vec<usize>>,
    /// A point of no symmetry, so that few surfaces share a key.
    reference: Point3<f64>,
}

/// Width of a key's bin in mm.
const BIN: f64 = 1e-3;

impl<'a> Tree<'a> {
    /// Resolves the part at these values.
    pub fn build(part: &'a Part, values: &Values) -> Result<Self, Vec<Diagnostic>> {
        let mut listed = Listed { part, values, leaves: Vec::new(), faults: Vec::new() };
        let steps = listed.features(&part.features, &Isometry3::identity(), "", true, 0);
        if !listed.faults.is_empty() {
            return Err(listed.faults);
        }
        let mut leaves = listed.leaves;
        let material: Vec<Point3<f64>> =
            leaves.iter().filter(|l| l.adds && !l.solid.is_through()).flat_map(|l| l.solid.corners()).collect();
        leaves.iter_mut().filter(|l| l.solid.is_through()).for_each(|l| l.solid.reach_through(&material));
        let mut all = Bounds::empty();
        leaves.iter().flat_map(|l| l.solid.corners()).for_each(|p| all.include(&p));
        let reference = all.low + (all.high - all.low).component_mul(&Vector3::new(0.137, 0.291, 0.411));
        let index = BTreeMap::new();
        let mut tree = Tree { part, surfaces: Vec::new(), leaves: Vec::new(), steps, index, reference };
        leaves.into_iter().for_each(|leaf| tree.add_leaf(leaf));
        tree.check_apart()?;
        Ok(tree)
    }

    /// Refuses features with faces that almost coincide: whether they do is then a matter of rounding.
    fn check_apart(&self) -> Result<(), Vec<Diagnostic>> {
        for (i, first) in self.surfaces.iter().enumerate() {
            let close = |j: &usize| *j > i && coincide(first, &self.surfaces[*j], tolerance::APART).is_some();
            for j in self.near(first, tolerance::APART).into_iter().filter(close) {
                let on = |s: usize| self.leaves.iter().filter(move |l| l.sides.iter().any(|side| side.surface == s));
                let meets = |a: &&Leaf, b: &Leaf| a.bounds.widened(tolerance::CULL).common(&b.bounds).is_some();
                let pair = on(i).find_map(|a| on(j).find(|b| meets(b, a)).map(|b| (a, b)));
                if let Some((a, b)) = pair {
                    return Err(vec![self.almost_flush(a, b)]);
                }
            }
        }
        Ok(())
    }

    fn almost_flush(&self, a: &Leaf, b: &Leaf) -> Diagnostic {
        let message = format!("faces of `{}` and `{}` of `{}` almost coincide", a.name, b.name, self.part.name);
        Diagnostic::error("E0406", b.span, message)
            .label(format!("less than {} mm from the other, and not flush with it", tolerance::APART))
            .also(a.span, "this one")
            .note("make them flush, or leave a wall or a gap that can be made")
    }

    /// Whether a point is in the part, given the leaves it is in, ascending.
    pub fn inside(&self, leaves: impl Iterator<Item = usize>) -> bool {
        fold(&self.steps, &mut leaves.peekable())
    }

    /// A box round all material added: no face lies outside it.
    pub fn material(&self) -> Bounds {
        let mut all = Bounds::empty();
        let added = self.leaves.iter().filter(|l| l.adds);
        added.flat_map(|l| [l.bounds.low, l.bounds.high]).for_each(|p| all.include(&p));
        all
    }

    /// Whether `p` lies in the leaf or within `reach` of it, not asking the surface `but`.
    pub fn near_leaf(&self, leaf: &Leaf, p: &Point3<f64>, but: Option<usize>, reach: f64) -> bool {
        leaf.formula.may_hold(&|i| {
            let side = &leaf.sides[i];
            let distance = self.surfaces[side.surface].distance(p) * side.sense;
            (Some(side.surface) != but && distance.abs() > reach).then_some(distance < 0.0)
        })
    }

    fn add_leaf(&mut self, listed: ListedLeaf) {
        let (sides, formula) = listed.solid.sides();
        let sides = sides.into_iter().map(|(surface, sense, name)| {
            let (surface, same) = self.intern(surface);
            Side { surface, sense: if same { sense } else { -sense }, name }
        });
        let sides = sides.collect();
        let mut bounds = Bounds::empty();
        listed.solid.corners().iter().for_each(|p| bounds.include(p));
        let ListedLeaf { span, name, adds, .. } = listed;
        self.leaves.push(Leaf { span, name, sides, formula, bounds, adds });
    }

    /// Index of the surface, and whether its canonical normal points the same way.
    fn intern(&mut self, surface: Surface) -> (usize, bool) {
        let same = |i: usize| Some((i, coincide(&self.surfaces[i], &surface, tolerance::POINT)?));
        if let Some(known) = self.near(&surface, tolerance::POINT).into_iter().find_map(same) {
            return known;
        }
        self.index.entry((self.key(&surface) / BIN) as i64).or_default().push(self.surfaces.len());
        self.surfaces.push(surface);
        (self.surfaces.len() - 1, true)
    }

    /// Surfaces that may coincide with this one within a distance, ascending.
    fn near(&self, surface: &Surface, within: f64) -> Vec<usize> {
        let far = (surface.origin() - self.reference).norm() + self.reference.coords.norm();
        let (key, off) = (self.key(surface), 4.0 * within + 4.0 * tolerance::DIRECTION * far);
        let [low, high] = [key - off, key + off].map(|k| (k / BIN) as i64);
        let mut near: Vec<usize> = self.index.range(low..=high).flat_map(|bin| bin.1).copied().collect();
        near.sort_unstable();
        near
    }

    /// A length (mm) that surfaces which coincide share, but for their tolerance.
    fn key(&self, surface: &Surface) -> f64 {
        let p = &self.reference;
        match surface {
            Surface::Plane { .. } => surface.distance(p).abs(),
            Surface::Cylinder { point, axis, radius } => radial(point, axis, p).norm() + radius,
            Surface::Sphere { centre, radius, .. } => (p - centre).norm() + radius,
            Surface::Cone { apex: place, .. } | Surface::Torus { centre: place, .. } => (p - place).norm(),
        }
    }
}

fn fold(steps: &[Step], leaves: &mut Peekable<impl Iterator<Item = usize>>) -> bool {
    steps.iter().fold(false, |inside, step| {
        let mut within = false;
        for group in &step.groups {
            within |= fold(group, leaves);
        }
        while leaves.next_if(|l| *l < step.leaves.end).is_some() {
            within = true;
        }
        match step.op {
            Op::Add => inside || within,
            Op::Cut => inside && !within,
            Op::Keep => inside && within,
        }
    })
}

/// A leaf before its surfaces are interned.
struct ListedLeaf {
    span: Span,
    name: String,
    solid: Sized,
    adds: bool,
}

/// Groups in groups deeper than this are refused: nobody draws that.
const DEEPEST: usize = 32;

/// Walks features and groups in source order.
struct Listed<'a> {
    part: &'a Part,
    values: &'a Values,
    leaves: Vec<ListedLeaf>,
    faults: Vec<Diagnostic>,
}

impl Listed<'_> {
    fn features(
        &mut self,
        features: &[Feature],
        frame: &Isometry3<f64>,
        prefix: &str,
        adds: bool,
        depth: usize,
    ) -> Vec<Step> {
        let step = |feature: &Feature| {
            let start = self.leaves.len();
            let adds = adds && feature.op == Op::Add;
            let mut groups = Vec::new();
            for (i, copy) in feature.copies.iter().enumerate() {
                let number = if feature.patterned { format!("[{}]", i + 1) } else { String::new() };
                let name = format!("{prefix}{}{number}", feature.name);
                match self.copy(feature, copy, frame, name, adds, depth) {
                    Ok(group) => groups.extend(group),
                    Err(reason) => {
                        let message = format!("`{prefix}{}` of `{}` {reason}", feature.name, self.part.name);
                        self.faults.push(Diagnostic::error("E0408", feature.span, message));
                        break;
                    }
                }
            }
            Step { op: feature.op, leaves: start..self.leaves.len(), groups }
        };
        features.iter().map(step).collect()
    }

    /// The steps of a group, or a leaf more.
    fn copy(
        &mut self,
        feature: &Feature,
        copy: &FeatureCopy,
        frame: &Isometry3<f64>,
        name: String,
        adds: bool,
        depth: usize,
    ) -> Result<Option<Vec<Step>>, String> {
        let pose = frame * copy.pose.eval(self.values);
        if let Shape::Group { features } = &copy.shape {
            if depth >= DEEPEST {
                return Err(format!("is a group more than {DEEPEST} deep"));
            }
            return Ok(Some(self.features(features, &pose, &format!("{name}."), adds, depth + 1)));
        }
        let solid = Sized::new(&copy.shape, pose, self.values)?;
        self.leaves.push(ListedLeaf { span: feature.span, name, solid, adds });
        Ok(None)
    }
}

/// The surface of a face by its name; see [`super::side_at`].
pub(super) fn side_at(part: &Part, values: &Values, face: &str) -> Option<Surface> {
    let tree = Tree::build(part, values).ok()?;
    let (leaf, side) = face.rsplit_once('.')?;
    let leaf = tree.leaves.iter().find(|l| l.name == leaf)?;
    leaf.sides.iter().find(|s| s.name == side).map(|s| tree.surfaces[s.surface].clone())
}

/// Whether two surfaces are the same set of points, within a distance, and if so whether their canonical normals agree.
fn coincide(a: &Surface, b: &Surface, within: f64) -> Option<bool> {
    use Surface::{Cone, Cylinder, Plane, Sphere, Torus};
    let near = |x: f64, y: f64| (x - y).abs() < within;
    let along = |d: &Unit<Vector3<f64>>, e: &Unit<Vector3<f64>>| d.cross(e).norm() < tolerance::DIRECTION;
    match (a, b) {
        (Plane { normal: n, offset: d }, Plane { normal: m, offset: e }) => {
            let sign = n.dot(m).signum();
            (near(*d, e * sign) && along(n, m)).then_some(sign > 0.0)
        }
        (Cylinder { point: p, axis: n, radius: r }, Cylinder { point: q, axis: m, radius: s }) => {
            (near(*r, *s) && along(n, m) && radial(p, n, q).norm() < within).then_some(true)
        }
        (Cone { apex: p, axis: n, half_angle: r }, Cone { apex: q, axis: m, half_angle: s }) => {
            let turned = (n.into_inner() - m.into_inner()).norm();
            let same = (r - s).abs() < tolerance::DIRECTION && turned < tolerance::DIRECTION;
            (same && (p - q).norm() < within).then_some(true)
        }
        (Sphere { centre: p, radius: r, .. }, Sphere { centre: q, radius: s, .. }) => {
            (near(*r, *s) && (p - q).norm() < within).then_some(true)
        }
        (Torus { centre: p, axis: n, major: a, minor: r }, Torus { centre: q, axis: m, major: b, minor: s }) => {
            let same = near(*a, *b) && near(*r, *s) && along(n, m);
            (same && (p - q).norm() < within).then_some(true)
        }
        _ => None,
    }
}
