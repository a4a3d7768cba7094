//! A part with numbers, as far as asking where its material is: no surfaces are met, only points are judged.
//!
//! In: a [`Part`] and one value per dimension. Out: whether a point is in its material, and the faces of its primitives
//! with points on them. Every primitive is one of two: an outline extruded along z, or an outline turned about z.

use super::super::model::{Expr, Extent, Feature, FeatureCopy, Op, Outline, Part, PoseExpr, Shape, Values};
use super::super::profile::{self, Bend, Stretch};
use crate::diag::Span;
use nalgebra::{Isometry3, Point3, Vector3};
use std::f64::consts::TAU;

/// Steps of low-discrepancy sequences: the fractions of their multiples fill the unit interval evenly, and the points of
/// two of them the unit square (the golden ratio, and the plastic number's powers).
const GOLDEN: f64 = 0.618_033_988_749_895;
const PLASTIC: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// One copy of a primitive, with what it stands in.
pub struct Leaf<'a> {
    /// `mount[2].bore`
    pub name: String,
    pub span: Span,
    pub shape: &'a Shape,
    /// From the part's frame inwards.
    pub poses: Vec<&'a PoseExpr>,
    /// Under an odd number of cuts.
    pub void: bool,
}

enum Node {
    Leaf(usize),
    Group(Vec<Step>),
}

/// A feature: its operation and its copies.
struct Step {
    op: Op,
    copies: Vec<Node>,
}

/// A part as a tree over its primitives.
pub struct Body<'a> {
    pub leaves: Vec<Leaf<'a>>,
    steps: Vec<Step>,
}

impl<'a> Body<'a> {
    pub fn of(part: &'a Part) -> Self {
        let mut body = Body { leaves: Vec::new(), steps: Vec::new() };
        body.steps = body.steps_of(&part.features, "", &[], false);
        body
    }

    fn steps_of(&mut self, features: &'a [Feature], path: &str, poses: &[&'a PoseExpr], void: bool) -> Vec<Step> {
        let mut steps = Vec::new();
        for feature in features {
            let void = void != (feature.op == Op::Cut);
            let copies = feature.copies.iter().enumerate().map(|(i, copy)| {
                let index = if feature.patterned { format!("[{}]", i + 1) } else { String::new() };
                self.node(copy, format!("{path}{}{index}", feature.name), poses, void, feature.span)
            });
            let copies = copies.collect();
            steps.push(Step { op: feature.op, copies });
        }
        steps
    }

    fn node(&mut self, copy: &'a FeatureCopy, name: String, poses: &[&'a PoseExpr], void: bool, span: Span) -> Node {
        let poses: Vec<&PoseExpr> = poses.iter().copied().chain([&copy.pose]).collect();
        if let Shape::Group { features } = &copy.shape {
            return Node::Group(self.steps_of(features, &format!("{name}."), &poses, void));
        }
        self.leaves.push(Leaf { name, span, shape: &copy.shape, poses, void });
        Node::Leaf(self.leaves.len() - 1)
    }

    /// Every primitive at these values; `None` for one whose outline has no boundary there.
    pub fn at(&self, values: &Values) -> Vec<Option<Placed>> {
        self.leaves.iter().map(|leaf| leaf.at(values)).collect()
    }

    /// Whether a point of the part's frame is in its material.
    pub fn inside(&self, placed: &[Option<Placed>], p: &Point3<f64>) -> bool {
        inside(&self.steps, placed, p)
    }
}

fn inside(steps: &[Step], placed: &[Option<Placed>], p: &Point3<f64>) -> bool {
    let within = |node: &Node| match node {
        Node::Leaf(leaf) => placed[*leaf].as_ref().is_some_and(|leaf| leaf.holds(p)),
        Node::Group(steps) => inside(steps, placed, p),
    };
    steps.iter().fold(false, |inside, step| match step.op {
        Op::Add => inside || step.copies.iter().any(within),
        Op::Cut => inside && !step.copies.iter().any(within),
        Op::Keep => inside && step.copies.iter().any(within),
    })
}

impl Leaf<'_> {
    /// The primitive at these values.
    pub fn at(&self, values: &Values) -> Option<Placed> {
        let pose = self.poses.iter().fold(Isometry3::identity(), |pose, next| pose * next.eval(values));
        let (form, names) = form(self.shape, values)?;
        let stretches = form.stretches();
        let outwards = profile::area(stretches).signum();
        Some(Placed {
            to_local: pose.inverse(),
            pose,
            reach: form.reach(),
            radius: form.radius(),
            form,
            names,
            outwards,
        })
    }
}

/// A primitive with numbers, in the part's frame.
pub struct Placed {
    pose: Isometry3<f64>,
    to_local: Isometry3<f64>,
    form: Form,
    /// One per stretch, then those of the ends.
    names: Vec<String>,
    /// +1 when the outline runs counter-clockwise, so that its right hand is outside.
    outwards: f64,
    /// No point of it lies farther from its origin (mm); infinite when it goes through.
    reach: f64,
    /// Nor farther from its z axis (mm).
    radius: f64,
}

enum Form {
    /// Extruded from z = 0 to a height, or without end.
    Prism(Vec<Stretch>, Option<f64>),
    /// The outline's x is the distance from the axis, its y is z.
    Turned(Vec<Stretch>),
}

/// A point on a face and the direction out of the primitive there, in the part's frame.
pub struct Sample {
    pub point: Point3<f64>,
    pub normal: Vector3<f64>,
}

impl Placed {
    pub fn faces(&self) -> usize {
        self.names.len()
    }

    pub fn face_name(&self, face: usize) -> &str {
        &self.names[face]
    }

    /// Farthest point from the part's origin (mm); 0 for what goes through.
    pub fn extent(&self) -> f64 {
        if self.reach.is_finite() { self.pose.translation.vector.norm() + self.reach } else { 0.0 }
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        let p = self.to_local * p;
        let rho = p.x.hypot(p.y);
        if rho > self.radius {
            return false;
        }
        match &self.form {
            Form::Prism(outline, height) => {
                height.is_none_or(|h| (0.0..=h).contains(&p.z)) && profile::encloses(outline, [p.x, p.y])
            }
            Form::Turned(outline) => profile::encloses(outline, [rho, p.z]),
        }
    }

    /// Signed distance (mm) of a point from the surface of a face, positive outside.
    pub fn distance(&self, face: usize, p: &Point3<f64>) -> f64 {
        let p = self.to_local * p;
        match (&self.form, face.checked_sub(self.form.stretches().len())) {
            (Form::Prism(_, Some(h)), Some(0)) => p.z - h,
            (Form::Prism(..), Some(_)) => -p.z,
            (Form::Prism(outline, _), None) => self.outwards * outline[face].offset([p.x, p.y]),
            (Form::Turned(outline), _) => {
                self.outwards * outline[face.min(outline.len() - 1)].offset([p.x.hypot(p.y), p.z])
            }
        }
    }

    /// Up to `count` points of a face. What goes through is sampled within `radius` of the part's origin (mm).
    pub fn samples(&self, face: usize, count: usize, radius: f64) -> Vec<Sample> {
        let of = |(point, normal): (Point3<f64>, Vector3<f64>)| Sample {
            point: self.pose * point,
            normal: self.pose * normal,
        };
        (0..count).filter_map(|i| self.local_sample(face, i, radius)).map(of).collect()
    }

    fn local_sample(&self, face: usize, i: usize, radius: f64) -> Option<(Point3<f64>, Vector3<f64>)> {
        let share = |step: f64| (0.5 + i as f64 * step).fract();
        match &self.form {
            Form::Prism(outline, height) if face < outline.len() => {
                let ([x, y], [nx, ny]) = outline[face].at(share(PLASTIC[0]));
                let z = match height {
                    Some(h) => h * share(PLASTIC[1]),
                    None => (self.to_local * Point3::origin()).z + radius * (2.0 * share(PLASTIC[1]) - 1.0),
                };
                Some((Point3::new(x, y, z), Vector3::new(nx, ny, 0.0) * self.outwards))
            }
            Form::Prism(outline, height) => {
                let [low, high] = box_round(outline);
                let [x, y] = [0, 1].map(|k| low[k] + (high[k] - low[k]) * share(PLASTIC[k]));
                let top = face == outline.len();
                let z = if top { height.unwrap_or(0.0) } else { 0.0 };
                let normal = if top { Vector3::z() } else { -Vector3::z() };
                profile::encloses(outline, [x, y]).then(|| (Point3::new(x, y, z), normal))
            }
            Form::Turned(outline) => {
                let ([rho, z], [nr, nz]) = outline[face].at(share(PLASTIC[0]));
                let (sin, cos) = (TAU * share(GOLDEN)).sin_cos();
                let normal = Vector3::new(nr * cos, nr * sin, nz) * self.outwards;
                (rho > profile::SAME_POINT).then(|| (Point3::new(rho * cos, rho * sin, z), normal))
            }
        }
    }
}

impl Form {
    fn stretches(&self) -> &[Stretch] {
        let (Form::Prism(outline, _) | Form::Turned(outline)) = self;
        outline
    }

    fn reach(&self) -> f64 {
        match self {
            Form::Prism(_, None) => f64::INFINITY,
            Form::Prism(_, Some(h)) => self.radius().hypot(*h),
            Form::Turned(outline) => self.radius().hypot(farthest(outline, 1)),
        }
    }

    fn radius(&self) -> f64 {
        match self {
            Form::Prism(outline, _) => farthest(outline, 0).hypot(farthest(outline, 1)),
            Form::Turned(outline) => farthest(outline, 0),
        }
    }
}

/// No point of the stretches has a larger coordinate, x (0) or y (1), of either sign.
fn farthest(outline: &[Stretch], axis: usize) -> f64 {
    let [low, high] = box_round(outline);
    low[axis].abs().max(high[axis].abs())
}

/// Corners of a box round the stretches, arcs with their whole circles.
fn box_round(outline: &[Stretch]) -> [[f64; 2]; 2] {
    let mut corners = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    let mut include = |p: [f64; 2], by: f64| {
        for k in 0..2 {
            corners[0][k] = corners[0][k].min(p[k] - by);
            corners[1][k] = corners[1][k].max(p[k] + by);
        }
    };
    for s in outline {
        include(s.from, 0.0);
        if let Some(Bend { centre, radius, .. }) = s.bend {
            include(centre, radius);
        }
    }
    corners
}

/// The form of a primitive and the names of its faces.
fn form(shape: &Shape, values: &Values) -> Option<(Form, Vec<String>)> {
    let v = |e: &Expr| e.eval(values);
    let height = |h: &Extent| match h {
        Extent::Length(h) => Some(v(h)),
        Extent::Through => None,
    };
    Some(match shape {
        Shape::Box { x, y, z } => {
            let (x, y) = (v(x) / 2.0, v(y) / 2.0);
            prism(
                polygon(&[[-x, -y], [x, -y], [x, y], [-x, y]]),
                height(z),
                ["-y", "+x", "+y", "-x"].map(String::from).to_vec(),
            )
        }
        Shape::Cylinder { d, h } => prism(circle([0.0, 0.0], v(d) / 2.0), height(h), vec!["side".to_string(); 2]),
        Shape::Prism { outline, h } => {
            let stretches = profile::trace(outline, values).ok()?;
            let names = stretches.iter().map(|s| side_name(outline, s)).collect();
            prism(stretches, height(h), names)
        }
        Shape::Cone { d1, d2, h } => {
            let h = height(h)?;
            let corners = [[0.0, 0.0], [v(d1) / 2.0, 0.0], [v(d2) / 2.0, h], [0.0, h]];
            let mut named: Vec<([f64; 2], &str)> = corners.into_iter().zip(["bottom", "side", "top", "axis"]).collect();
            named.dedup_by(|b, a| b.0 == a.0);
            let outline = polygon(&named.iter().map(|(p, _)| *p).collect::<Vec<_>>());
            (Form::Turned(outline), named.iter().map(|(_, name)| name.to_string()).collect())
        }
        Shape::Sphere { d } => {
            let r = v(d) / 2.0;
            let bend = Some(Bend { centre: [0.0, 0.0], radius: r, left: true });
            let half = Stretch { side: 0, corner: false, from: [0.0, -r], to: [0.0, r], bend };
            let axis = Stretch { side: 1, corner: false, from: [0.0, r], to: [0.0, -r], bend: None };
            (Form::Turned(vec![half, axis]), ["side", "axis"].map(String::from).to_vec())
        }
        Shape::Torus { d, tube } => {
            (Form::Turned(circle([v(d) / 2.0, 0.0], v(tube) / 2.0)), vec!["side".to_string(); 2])
        }
        Shape::Revolve { outline } => {
            let stretches = profile::trace(outline, values).ok()?;
            let names = stretches.iter().map(|s| side_name(outline, s)).collect();
            (Form::Turned(stretches), names)
        }
        Shape::Group { .. } => return None,
    })
}

fn prism(outline: Vec<Stretch>, height: Option<f64>, mut names: Vec<String>) -> (Form, Vec<String>) {
    if height.is_some() {
        names.extend(["top", "bottom"].map(String::from));
    }
    (Form::Prism(outline, height), names)
}

/// A side by its name, the closing one by its number, a broken corner by the side before it.
fn side_name(outline: &Outline, stretch: &Stretch) -> String {
    let side = outline.sides.get(stretch.side).map_or_else(|| (stretch.side + 1).to_string(), |s| s.name.clone());
    if stretch.corner { format!("{side}_corner") } else { side }
}

fn polygon(corners: &[[f64; 2]]) -> Vec<Stretch> {
    let n = corners.len();
    (0..n)
        .map(|side| Stretch { side, corner: false, from: corners[side], to: corners[(side + 1) % n], bend: None })
        .collect()
}

/// Two halves of a circle, counter-clockwise.
fn circle(centre: [f64; 2], radius: f64) -> Vec<Stretch> {
    let [right, left] = [radius, -radius].map(|x| [centre[0] + x, centre[1]]);
    let bend = Some(Bend { centre, radius, left: true });
    vec![
        Stretch { side: 0, corner: false, from: right, to: left, bend },
        Stretch { side: 1, corner: false, from: left, to: right, bend },
    ]
}
