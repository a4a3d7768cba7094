//! A part and its values as a tree of half-spaces over interned surfaces.
//!
//! In: [`Part`] and one value per dimension. Out: [`Tree`]: every copy of every feature as a leaf, an intersection of
//! half-spaces. Surfaces that coincide are one from here on: coincidence is decided here, once, on their parameters.

use super::surface::radial;
use super::{Surface, tolerance};
use crate::design::model::{Extent, FeatureCopy, Op, Part, Shape, Values};
use crate::diag::Diagnostic;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::ops::Range;

/// One bounding side of a leaf.
#[derive(Debug, Clone)]
pub(super) struct Side {
    pub surface: usize,
    /// +1 when the leaf lies where the surface's distance is negative, -1 when where it is positive.
    pub sense: f64,
    pub name: &'static str,
}

/// One copy of a feature: the points inside all its sides.
#[derive(Debug, Clone)]
pub(super) struct Leaf {
    pub feature: usize,
    /// `bore[2]`, or `bore` when the feature is not a pattern.
    pub name: String,
    pub sides: Vec<Side>,
    pub bounds: Bounds,
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

/// The part: features folded from first to last, each the union of its leaves.
#[derive(Debug)]
pub(super) struct Tree<'a> {
    pub part: &'a Part,
    pub surfaces: Vec<Surface>,
    pub leaves: Vec<Leaf>,
    /// Operation and leaves of every feature.
    pub features: Vec<(Op, Range<usize>)>,
}

impl<'a> Tree<'a> {
    /// Resolves the part at these values.
    pub fn build(part: &'a Part, values: &Values) -> Result<Self, Vec<Diagnostic>> {
        let sizes = measure(part, values)?;
        let mut tree = Tree { part, surfaces: Vec::new(), leaves: Vec::new(), features: Vec::new() };
        for (index, feature) in part.features.iter().enumerate() {
            let start = tree.leaves.len();
            for (copy, solid) in sizes[index].iter().enumerate() {
                let name = match feature.patterned {
                    true => format!("{}[{}]", feature.name, copy + 1),
                    false => feature.name.clone(),
                };
                tree.add_leaf(index, name, solid);
            }
            tree.features.push((feature.op, start..tree.leaves.len()));
        }
        Ok(tree)
    }

    /// Whether a point is in the part, given the leaves it is in, ascending.
    pub fn inside(&self, leaves: impl Iterator<Item = usize>) -> bool {
        let mut leaves = leaves.peekable();
        self.features.iter().fold(false, |inside, (op, range)| {
            let mut within = false;
            while leaves.next_if(|l| *l < range.end).is_some() {
                within = true;
            }
            match op {
                Op::Add => inside || within,
                Op::Cut => inside && !within,
                Op::Keep => inside && within,
            }
        })
    }

    /// A box round all material added: no face lies outside it.
    pub fn material(&self) -> Bounds {
        let mut all = Bounds::empty();
        let added = self.features.iter().filter(|f| f.0 == Op::Add).flat_map(|f| f.1.clone());
        added.flat_map(|l| [self.leaves[l].bounds.low, self.leaves[l].bounds.high]).for_each(|p| all.include(&p));
        all
    }

    /// Whether `p` lies in the leaf or within tolerance of it, not asking the surface `but`.
    pub fn near_leaf(&self, leaf: &Leaf, p: &Point3<f64>, but: usize) -> bool {
        let within = |s: &Side| s.surface == but || self.surfaces[s.surface].distance(p) * s.sense <= tolerance::WELD;
        leaf.sides.iter().all(within)
    }

    fn add_leaf(&mut self, feature: usize, name: String, solid: &Sized) {
        let sides = solid.sides().into_iter().map(|(surface, sense, name)| {
            let (surface, same) = self.intern(surface);
            Side { surface, sense: if same { sense } else { -sense }, name }
        });
        let sides = sides.collect();
        let mut bounds = Bounds::empty();
        solid.corners().iter().for_each(|p| bounds.include(p));
        self.leaves.push(Leaf { feature, name, sides, bounds });
    }

    /// Index of the surface, and whether its canonical normal points the same way.
    fn intern(&mut self, surface: Surface) -> (usize, bool) {
        for (i, known) in self.surfaces.iter().enumerate() {
            if let Some(same) = coincide(known, &surface) {
                return (i, same);
            }
        }
        self.surfaces.push(surface);
        (self.surfaces.len() - 1, true)
    }
}

/// Whether two surfaces are the same set of points, and if so whether their canonical normals agree.
pub(super) fn coincide(a: &Surface, b: &Surface) -> Option<bool> {
    use Surface::{Cone, Cylinder, Plane, Sphere, Torus};
    let near = |x: f64, y: f64| (x - y).abs() < tolerance::POINT;
    let along = |d: &Unit<Vector3<f64>>, e: &Unit<Vector3<f64>>| d.cross(e).norm() < tolerance::DIRECTION;
    match (a, b) {
        (Plane { normal: n, offset: d }, Plane { normal: m, offset: e }) => {
            let sign = n.dot(m).signum();
            (near(*d, e * sign) && along(n, m)).then_some(sign > 0.0)
        }
        (Cylinder { point: p, axis: n, radius: r }, Cylinder { point: q, axis: m, radius: s }) => {
            (near(*r, *s) && along(n, m) && radial(p, n, q).norm() < tolerance::POINT).then_some(true)
        }
        (Cone { apex: p, axis: n, half_angle: r }, Cone { apex: q, axis: m, half_angle: s }) => {
            let turned = (n.into_inner() - m.into_inner()).norm();
            let same = (r - s).abs() < tolerance::DIRECTION && turned < tolerance::DIRECTION;
            (same && (p - q).norm() < tolerance::POINT).then_some(true)
        }
        (Sphere { centre: p, radius: r, .. }, Sphere { centre: q, radius: s, .. }) => {
            (near(*r, *s) && (p - q).norm() < tolerance::POINT).then_some(true)
        }
        (Torus { centre: p, axis: n, major: a, minor: r }, Torus { centre: q, axis: m, major: b, minor: s }) => {
            let same = near(*a, *b) && near(*r, *s) && along(n, m);
            (same && (p - q).norm() < tolerance::POINT).then_some(true)
        }
        _ => None,
    }
}

/// A primitive with its numbers, in the part's frame.
struct Sized {
    pose: Isometry3<f64>,
    kind: Kind,
    /// Reach along its own z.
    low: f64,
    high: f64,
}

enum Kind {
    Box {
        x: f64,
        y: f64,
    },
    /// Radius at `low` and at `high`.
    Round {
        low: f64,
        high: f64,
    },
    Ball {
        radius: f64,
    },
}

/// Largest magnitude of a size or a place that the kernel's tolerances are made for, in mm.
const LARGEST: f64 = 1e5;
/// A through feature reaches this share of the part's extent, and this many mm, beyond it at both ends.
const BEYOND: (f64, f64) = (0.05, 1.0);

/// Every feature's copies with numbers in place of expressions; `through` resolved against the material added.
fn measure(part: &Part, values: &Values) -> Result<Vec<Vec<Sized>>, Vec<Diagnostic>> {
    let mut faults = Vec::new();
    let mut sized: Vec<Vec<Sized>> = Vec::new();
    let mut material: Vec<Point3<f64>> = Vec::new();
    for feature in &part.features {
        let mut copies = Vec::new();
        for copy in &feature.copies {
            match size(copy, values) {
                Ok(solid) => copies.push(solid),
                Err(reason) => {
                    let message = format!("`{}` of `{}` {reason}", feature.name, part.name);
                    faults.push(Diagnostic::error("E0408", feature.span, message));
                    break;
                }
            }
        }
        if feature.op == Op::Add {
            copies.iter().filter(|c| c.low < c.high).for_each(|c| material.extend(c.corners()));
        }
        sized.push(copies);
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    sized.iter_mut().flatten().filter(|c| c.low >= c.high).for_each(|c| c.reach_through(&material));
    Ok(sized)
}

/// The surface of a face by its name; see [`super::side_at`].
pub(super) fn side_at(part: &Part, values: &Values, face: &str) -> Option<Surface> {
    let tree = Tree::build(part, values).ok()?;
    let (leaf, side) = face.rsplit_once('.')?;
    let leaf = tree.leaves.iter().find(|l| l.name == leaf)?;
    leaf.sides.iter().find(|s| s.name == side).map(|s| tree.surfaces[s.surface].clone())
}

/// Numbers of one copy; a `through` extent is left empty (`low == high`).
fn size(copy: &FeatureCopy, values: &Values) -> Result<Sized, &'static str> {
    let pose = copy.pose.eval(values);
    let half = |e: &crate::design::model::Expr| positive(e.eval(values)).map(|v| v / 2.0);
    let reach = |e: &Extent| match e {
        Extent::Length(e) => positive(e.eval(values)),
        Extent::Through => Ok(0.0),
    };
    let (kind, low, high) = match &copy.shape {
        Shape::Box { x, y, z } => (Kind::Box { x: half(x)?, y: half(y)? }, 0.0, reach(z)?),
        Shape::Cylinder { d, h } => {
            let radius = half(d)?;
            (Kind::Round { low: radius, high: radius }, 0.0, reach(h)?)
        }
        Shape::Cone { h: Extent::Through, .. } => {
            return Err("is a cone without a height: `through` says nothing of its slope");
        }
        Shape::Cone { d1, d2, h } => {
            let [low, high] = [d1, d2].map(|d| d.eval(values) / 2.0);
            positive(low.max(high))?;
            if low.min(high) < 0.0 {
                return Err("has a negative diameter");
            }
            (Kind::Round { low, high }, 0.0, reach(h)?)
        }
        Shape::Sphere { d } => {
            let radius = half(d)?;
            (Kind::Ball { radius }, -radius, radius)
        }
        _ => return Err("is of a shape that is not built yet"),
    };
    let placed = pose.translation.vector.iter().all(|v| v.abs() <= LARGEST);
    let turned = pose.rotation.coords.iter().all(|v| v.is_finite());
    if placed && turned { Ok(Sized { pose, kind, low, high }) } else { Err("is placed out of reach") }
}

fn positive(v: f64) -> Result<f64, &'static str> {
    if v > 10.0 * tolerance::WELD && v <= LARGEST { Ok(v) } else { Err("needs sizes above zero (and below 100 m)") }
}

impl Sized {
    fn reach_through(&mut self, material: &[Point3<f64>]) {
        let back = self.pose.inverse();
        let heights = material.iter().map(|p| (back * p).z);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        let (low, high) = if low < high { (low, high) } else { (0.0, 0.0) };
        let beyond = (high - low) * BEYOND.0 + BEYOND.1;
        (self.low, self.high) = (low - beyond, high + beyond);
    }

    /// Corners of a box round the primitive.
    fn corners(&self) -> [Point3<f64>; 8] {
        let (x, y) = match self.kind {
            Kind::Box { x, y } => (x, y),
            Kind::Round { low, high } => (low.max(high), low.max(high)),
            Kind::Ball { radius } => (radius, radius),
        };
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            self.pose * Point3::new(pick(0, -x, x), pick(1, -y, y), pick(2, self.low, self.high))
        })
    }

    /// Bounding surfaces with the sense of [`Side`] and the name of the side.
    fn sides(&self) -> Vec<(Surface, f64, &'static str)> {
        let z = Vector3::z();
        let ends = || vec![(self.flat(z, self.high), 1.0, "top"), (self.flat(-z, -self.low), 1.0, "bottom")];
        match self.kind {
            Kind::Box { x, y } => {
                let walls = [
                    ("+x", Vector3::x(), x),
                    ("-x", -Vector3::x(), x),
                    ("+y", Vector3::y(), y),
                    ("-y", -Vector3::y(), y),
                ];
                let mut sides: Vec<_> = walls.iter().map(|(name, n, d)| (self.flat(*n, *d), 1.0, *name)).collect();
                sides.extend(ends());
                sides
            }
            Kind::Round { low, high } => {
                let mut sides = vec![(self.flank(low, high), 1.0, "side")];
                // A pointed end has no face.
                let blunt = |name: &str| if name == "top" { high > tolerance::WELD } else { low > tolerance::WELD };
                sides.extend(ends().into_iter().filter(|(_, _, name)| blunt(name)));
                sides
            }
            Kind::Ball { radius } => {
                let axis = Unit::new_normalize(Vector3::new(0.3285, 0.4871, 0.8093));
                vec![(Surface::Sphere { centre: self.pose * Point3::origin(), radius, axis }, 1.0, "side")]
            }
        }
    }

    /// The plane at `distance` from the primitive's origin along its own direction `n`.
    fn flat(&self, n: Vector3<f64>, distance: f64) -> Surface {
        let normal = Unit::new_normalize(self.pose.rotation * n);
        Surface::Plane { normal, offset: normal.dot(&self.pose.translation.vector) + distance }
    }

    /// The side of a cylinder or of a frustum with these end radii.
    fn flank(&self, low: f64, high: f64) -> Surface {
        let axis = Unit::new_normalize(self.pose.rotation * Vector3::z());
        let height = self.high - self.low;
        if (high - low).abs() < tolerance::POINT {
            return Surface::Cylinder { point: self.pose * Point3::origin(), axis, radius: low.max(high) };
        }
        let rise = self.low - height * low / (high - low);
        let half_angle = ((high - low).abs() / height).atan();
        let axis = if high > low { axis } else { -axis };
        Surface::Cone { apex: self.pose * Point3::new(0.0, 0.0, rise), axis, half_angle }
    }
}
