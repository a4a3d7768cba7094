//! From OpenSCAD's tree to a feature list: what is added, cut and kept, one after the other.
//!
//! In: nodes. Out: steps, each with its shape and its place in the part's frame, matrices multiplied out; or every node
//! that has no counterpart, with the reason. A boolean of booleans becomes a group; extruding a flat drawing is extruding
//! its outlines one by one.

use super::csg::{Node, Value};
use super::feature::{Item, Op, Outline, Shape, Step};
use super::flat;
use super::placement::{Matrix, Parts};
use super::write::extent;
use crate::diag::{Diagnostic, Span};

/// With this many facets or fewer, asked for by `$fn`, a round shape is meant as a prism: a hexagon, an octagon.
pub const FACETED: f64 = 12.0;
/// Nothing reaches farther from the origin than this (mm): of six digits none is left for a millimetre there.
const LARGEST: f64 = 1e7;
/// More nodes than this without a counterpart need not be listed.
const MAX_FAULTS: usize = 50;
/// Least and greatest coordinates.
type Extent = [[f64; 3]; 2];

/// Boxes nearer than this touch (mm).
const TOUCH: f64 = 1e-3;
/// Groups in groups that the language's parser takes.
const MAX_GROUPS: usize = 24;
/// Factors that differ by more than this in two directions make an ellipse of a circle: OpenSCAD prints six digits.
const EVEN: f64 = 1e-4;

/// What a drawing in x and y becomes.
#[derive(Clone, Copy)]
pub enum Drawing {
    /// Solids, not a drawing.
    None,
    Extruded(f64),
    Revolved,
}

/// Where a node stands: in the part, and within a drawing in the drawing.
#[derive(Clone, Copy)]
pub struct Frame {
    pub outer: Matrix,
    pub inner: Matrix,
    pub drawing: Drawing,
}

/// A feature list for each body of a design that stands apart from the others, or why there is none.
pub fn parts(nodes: &[Node]) -> Result<Vec<Vec<Step>>, Vec<Diagnostic>> {
    let mut lower = Lower { faults: Vec::new() };
    let frame = Frame { outer: Matrix::IDENTITY, inner: Matrix::IDENTITY, drawing: Drawing::None };
    let mut bodies = lower.pieces(nodes, &frame);
    bodies.retain(|body| !body.is_empty());
    let parts: Vec<Vec<Step>> = apart(bodies).into_iter().map(sum).collect();
    if lower.faults.is_empty() && parts.is_empty() {
        let message = "this design is empty".to_string();
        lower.faults.push(Diagnostic::error("E0903", Span::default(), message).label("nothing is made here"));
    }
    if lower.faults.is_empty() && parts.iter().any(|steps| depth(steps) > MAX_GROUPS) {
        let message = format!("booleans are nested more than {MAX_GROUPS} deep");
        lower.faults.push(Diagnostic::error("E0902", Span::default(), message).label("too deep for one part"));
    }
    if lower.faults.is_empty() { Ok(parts) } else { Err(lower.faults) }
}

/// Bodies whose boxes meet, together; in the order of the first of each.
fn apart(bodies: Vec<Vec<Step>>) -> Vec<Vec<Vec<Step>>> {
    let mut found: Vec<(Extent, Vec<Vec<Step>>)> = Vec::new();
    for body in bodies {
        let (mut reach, mut together) = (extent(&body), Vec::new());
        // A body may join several that were apart, and their common box still more.
        while let Some(i) = found.iter().position(|(other, _)| meet(&reach, other)) {
            let (other, earlier) = found.remove(i);
            reach = [0, 1].map(|end| {
                [0, 1, 2].map(|k| if end == 0 { reach[0][k].min(other[0][k]) } else { reach[1][k].max(other[1][k]) })
            });
            together.splice(0..0, earlier);
        }
        together.push(body);
        found.push((reach, together));
    }
    found.into_iter().map(|(_, bodies)| bodies).collect()
}

/// Whether a feature reaches farther than numbers can be told apart, or nowhere.
fn is_immense(step: &Step) -> bool {
    match &step.item {
        // Refused already where it was made.
        Item::Group(_) => false,
        Item::Solid { shape, place } => {
            !shape.extent().map(|corner| place.point(corner)).iter().flatten().all(|v| v.abs() <= LARGEST)
        }
    }
}

fn meet(a: &Extent, b: &Extent) -> bool {
    (0..3).all(|k| a[0][k] <= b[1][k] + TOUCH && b[0][k] <= a[1][k] + TOUCH)
}

/// One feature list of all bodies.
fn sum(mut bodies: Vec<Vec<Step>>) -> Vec<Step> {
    bodies.retain(|body| !body.is_empty());
    // One body that is more than a sum may stand first, without a group.
    if let Some(first) = bodies.iter().position(|body| !is_sum(body)) {
        bodies[..=first].rotate_right(1);
    }
    let mut steps = Vec::new();
    bodies.into_iter().for_each(|body| append(&mut steps, Op::Add, body));
    steps
}

fn depth(steps: &[Step]) -> usize {
    let inner = |step: &Step| match &step.item {
        Item::Group(steps) => 1 + depth(steps),
        Item::Solid { .. } => 0,
    };
    steps.iter().map(inner).max().unwrap_or(0)
}

pub struct Lower {
    faults: Vec<Diagnostic>,
}

impl Lower {
    /// Reports a node without a counterpart.
    pub fn refuse(&mut self, node: &Node, reason: &str) -> Vec<Step> {
        if self.faults.len() < MAX_FAULTS {
            let message = format!("`{}` has no counterpart in this language", node.name);
            self.faults.push(Diagnostic::error("E0902", node.span, message).label(reason));
        }
        Vec::new()
    }

    fn node(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        let steps = self.lowered(node, frame);
        if steps.iter().any(is_immense) { self.refuse(node, "larger than anything that is made") } else { steps }
    }

    fn lowered(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        let flat = !matches!(frame.drawing, Drawing::None);
        match node.name.as_str() {
            "group" | "union" | "color" | "render" => self.union(&node.children, frame),
            "difference" => self.difference(&node.children, frame),
            "intersection" => self.intersection(&node.children, frame),
            "multmatrix" => self.moved(node, frame),
            "linear_extrude" if !flat => self.extruded(node, frame),
            "rotate_extrude" if !flat => self.revolved(node, frame),
            "cube" if !flat => self.cube(node, &frame.outer),
            "cylinder" if !flat => self.cylinder(node, &frame.outer),
            "sphere" if !flat => self.sphere(node, &frame.outer),
            "square" | "circle" | "polygon" | "offset" if flat => flat::leaf(self, node, frame),
            "hull" => self.hull(node, frame),
            "square" | "circle" | "polygon" | "offset" => self.refuse(node, "a flat drawing without a height"),
            "cube" | "cylinder" | "sphere" | "linear_extrude" | "rotate_extrude" => {
                self.refuse(node, "a solid inside a flat drawing")
            }
            "minkowski" => self.refuse(node, "a sum of shapes: draw its outline, or break the edges"),
            "polyhedron" | "import" | "surface" => {
                self.refuse(node, "a mesh: it has triangles, but no faces with a size")
            }
            "text" => self.refuse(node, "letters"),
            "projection" => self.refuse(node, "the shadow or cut of a solid"),
            "resize" => self.refuse(node, "its factors depend on what stands in it: use `scale`"),
            "roof" => self.refuse(node, "a roof over an outline"),
            _ => self.refuse(node, "an unknown node"),
        }
    }

    fn bodies(&mut self, nodes: &[Node], frame: &Frame) -> Vec<Vec<Step>> {
        nodes.iter().filter(|node| !node.background).map(|node| self.node(node, frame)).collect()
    }

    pub fn union(&mut self, nodes: &[Node], frame: &Frame) -> Vec<Step> {
        sum(self.bodies(nodes, frame))
    }

    /// What a union unites, through all unions in it.
    fn pieces(&mut self, nodes: &[Node], frame: &Frame) -> Vec<Vec<Step>> {
        let mut found = Vec::new();
        for node in nodes.iter().filter(|node| !node.background) {
            match node.name.as_str() {
                "group" | "union" | "color" | "render" => found.extend(self.pieces(&node.children, frame)),
                "multmatrix" => match matrix(node) {
                    Some(matrix) => found.extend(self.pieces(&node.children, &frame.then(&matrix))),
                    None => found.push(self.refuse(node, NO_MATRIX)),
                },
                _ => found.push(self.node(node, frame)),
            }
        }
        found
    }

    fn difference(&mut self, nodes: &[Node], frame: &Frame) -> Vec<Step> {
        let mut bodies = self.bodies(nodes, frame).into_iter();
        let mut steps = bodies.next().unwrap_or_default();
        if !steps.is_empty() {
            bodies.for_each(|body| append(&mut steps, Op::Cut, body));
        }
        steps
    }

    fn intersection(&mut self, nodes: &[Node], frame: &Frame) -> Vec<Step> {
        let bodies = self.bodies(nodes, frame);
        if bodies.iter().any(Vec::is_empty) {
            return Vec::new();
        }
        let mut bodies = bodies.into_iter();
        let mut steps = bodies.next().unwrap_or_default();
        bodies.for_each(|body| append(&mut steps, Op::Keep, body));
        steps
    }

    fn moved(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        match matrix(node) {
            Some(matrix) => self.union(&node.children, &frame.then(&matrix)),
            None => self.refuse(node, NO_MATRIX),
        }
    }

    fn extruded(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        let height = node.number("height").unwrap_or(100.0);
        let straight = node.numbers("scale").is_none_or(|scale| scale.iter().all(|s| *s == 1.0))
            && node.number("scale").is_none_or(|scale| scale == 1.0);
        if node.number("twist").is_some_and(|twist| twist != 0.0) {
            return self.refuse(node, "its `twist` makes a screw surface");
        }
        if !straight {
            return self.refuse(node, "its `scale` makes slanted sides");
        }
        if node.numbers("v").is_some_and(|v| v.len() == 3 && (v[0] != 0.0 || v[1] != 0.0)) {
            return self.refuse(node, "it is extruded aslant");
        }
        if !height.is_finite() || height <= 0.0 {
            return Vec::new();
        }
        let base = if node.flag("center") { -height / 2.0 } else { 0.0 };
        let outer = frame.outer.then(&Matrix::translation([0.0, 0.0, base]));
        self.union(&node.children, &Frame { outer, inner: Matrix::IDENTITY, drawing: Drawing::Extruded(height) })
    }

    fn revolved(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        if node.number("angle").is_some_and(|angle| angle.abs() < 360.0) {
            return self.refuse(node, "less than a whole turn");
        }
        if is_faceted(node) {
            return self.refuse(node, "its `$fn` makes it a polyhedron");
        }
        self.union(&node.children, &Frame { inner: Matrix::IDENTITY, drawing: Drawing::Revolved, ..*frame })
    }

    fn cube(&mut self, node: &Node, frame: &Matrix) -> Vec<Step> {
        let size = match node.get("size") {
            Some(Value::Number(side)) => vec![*side; 3],
            Some(value) => value.numbers().unwrap_or_default(),
            None => vec![1.0; 3],
        };
        let [x, y, z] = match size.as_slice() {
            [x, y, z] if size.iter().all(|s| s.is_finite()) => [*x, *y, *z],
            _ => return self.refuse(node, "no size of three numbers"),
        };
        if x <= 0.0 || y <= 0.0 || z <= 0.0 {
            return Vec::new();
        }
        let middle = if node.flag("center") { [0.0, 0.0, -z / 2.0] } else { [x / 2.0, y / 2.0, 0.0] };
        self.cuboid(node, [x, y, z], &frame.then(&Matrix::translation(middle)))
    }

    /// A box on its own z = 0, centred in x and y.
    pub fn cuboid(&mut self, node: &Node, [x, y, z]: [f64; 3], frame: &Matrix) -> Vec<Step> {
        let Some(parts) = frame.parts() else { return self.refuse(node, SHEARED) };
        let size = [x * parts.scale[0], y * parts.scale[1], z * parts.scale[2]];
        // Where its sides lie along the axes, no turn is needed, only the sizes in another order.
        let along = |row: [f64; 3]| row.iter().position(|v| v.abs() > 1.0 - 1e-6);
        let axes = parts.rotation.map(along);
        let (size, place) = match axes {
            [Some(a), Some(b), Some(c)] => {
                let size = [size[a], size[b], size[c]];
                let middle = frame.point([0.0, 0.0, z / 2.0]);
                let at = [middle[0], middle[1], middle[2] - size[2] / 2.0];
                (size, super::placement::Placement { at, turn: [0.0; 3] })
            }
            _ => (size, parts.placed()),
        };
        vec![Step::solid(Op::Add, Shape::Box { x: size[0], y: size[1], z: size[2] }, place)]
    }

    fn cylinder(&mut self, node: &Node, frame: &Matrix) -> Vec<Step> {
        let number = |name| node.number(name).filter(|v| v.is_finite()).unwrap_or(1.0);
        let (h, r1, r2) = (number("h"), number("r1"), number("r2"));
        if h <= 0.0 || r1 < 0.0 || r2 < 0.0 || (r1 == 0.0 && r2 == 0.0) {
            return Vec::new();
        }
        let base = if node.flag("center") { -h / 2.0 } else { 0.0 };
        let frame = frame.then(&Matrix::translation([0.0, 0.0, base]));
        if !is_faceted(node) {
            return self.round(node, [r1, r2], h, &frame);
        }
        if r1 != r2 {
            return self.refuse(node, "its `$fn` makes it a pyramid");
        }
        self.prism(node, flat::regular(node, r1), h, &frame)
    }

    /// A cylinder or frustum on its own z = 0.
    pub fn round(&mut self, node: &Node, [r1, r2]: [f64; 2], h: f64, frame: &Matrix) -> Vec<Step> {
        let Some(parts) = frame.parts() else { return self.refuse(node, SHEARED) };
        if !is_even(parts.scale[0], parts.scale[1]) {
            return self.refuse(node, ELLIPSE);
        }
        let (mut d1, mut d2, h) = (2.0 * r1 * parts.scale[0], 2.0 * r2 * parts.scale[0], h * parts.scale[2]);
        let mut parts = parts;
        if points_down(parts.axis()) {
            parts = parts.moved([0.0, 0.0, h]).flipped();
            (d1, d2) = (d2, d1);
        }
        let shape = if is_even(d1, d2) { Shape::Cylinder { d: d1, h } } else { Shape::Frustum { d1, d2, h } };
        vec![Step::solid(Op::Add, shape, parts.placed_axis())]
    }

    fn sphere(&mut self, node: &Node, frame: &Matrix) -> Vec<Step> {
        let r = node.number("r").filter(|r| r.is_finite()).unwrap_or(1.0);
        if r <= 0.0 {
            return Vec::new();
        }
        if is_faceted(node) {
            return self.refuse(node, "its `$fn` makes it a polyhedron");
        }
        let Some(parts) = frame.parts() else { return self.refuse(node, SHEARED) };
        if !is_even(parts.scale[0], parts.scale[1]) || !is_even(parts.scale[0], parts.scale[2]) {
            return self.refuse(node, "scaled to an ellipsoid");
        }
        let place = super::placement::Placement { at: parts.at, turn: [0.0; 3] };
        vec![Step::solid(Op::Add, Shape::Sphere { d: 2.0 * r * parts.scale[0] }, place)]
    }

    /// An outline in x and y, extruded from its own z = 0.
    pub fn prism(&mut self, node: &Node, outline: Outline, h: f64, frame: &Matrix) -> Vec<Step> {
        let Some(parts) = frame.parts() else { return self.refuse(node, SHEARED) };
        let Some(outline) = flat::scaled(&outline, &parts) else { return self.refuse(node, ELLIPSE) };
        let place = Parts { at: parts.at, ..parts }.placed();
        vec![Step::solid(Op::Add, Shape::Prism { outline, h: h * parts.scale[2] }, place)]
    }

    /// The hull of equal discs or cylinders side by side: a slot, or a plate with round corners.
    fn hull(&mut self, node: &Node, frame: &Frame) -> Vec<Step> {
        let steps = self.union(&node.children, frame);
        match flat::hull_of_discs(&steps) {
            Some(steps) => steps,
            None if steps.is_empty() => Vec::new(),
            None => self.refuse(node, "a hull of other shapes than equal cylinders side by side: draw its outline"),
        }
    }
}

impl Frame {
    fn then(&self, matrix: &Matrix) -> Frame {
        match self.drawing {
            Drawing::None => Frame { outer: self.outer.then(matrix), ..*self },
            _ => Frame { inner: self.inner.then(matrix), ..*self },
        }
    }
}

/// The matrix of a `multmatrix`.
fn matrix(node: &Node) -> Option<Matrix> {
    let rows: Vec<Vec<f64>> = node.get("")?.list()?.iter().map(Value::numbers).collect::<Option<_>>()?;
    let [x, y, z, ..] = rows.as_slice() else { return None };
    let good = [x, y, z].iter().all(|row| row.len() == 4 && row.iter().all(|v| v.is_finite()));
    good.then(|| Matrix([x, y, z].map(|row| [row[0], row[1], row[2], row[3]])).tidied())
}

const NO_MATRIX: &str = "no matrix of four by four numbers";
const SHEARED: &str = "sheared by its `multmatrix`";
const ELLIPSE: &str = "scaled to an ellipse";

/// A body that is nothing but additions, which may be added or cut one by one.
fn is_sum(body: &[Step]) -> bool {
    body.iter().all(|step| step.op == Op::Add)
}

fn append(steps: &mut Vec<Step>, op: Op, body: Vec<Step>) {
    match (op, body.as_slice()) {
        (_, []) => {}
        (Op::Add, _) if steps.is_empty() => *steps = body,
        (_, [_]) => steps.extend(body.into_iter().map(|step| Step { op, ..step })),
        (Op::Add | Op::Cut, _) if is_sum(&body) => steps.extend(body.into_iter().map(|step| Step { op, ..step })),
        _ => steps.push(Step { op, item: Item::Group(body), pattern: None, exact: Vec::new() }),
    }
}

/// Whether a round shape asks for so few facets that it is a prism.
pub fn is_faceted(node: &Node) -> bool {
    node.number("$fn").is_some_and(|n| (1.0..=FACETED).contains(&n))
}

pub fn is_even(a: f64, b: f64) -> bool {
    (a - b).abs() <= EVEN * a.abs().max(b.abs())
}

/// Of an axis and its opposite, one is the way one would write it: up, else towards +y, else towards +x.
fn points_down(axis: [f64; 3]) -> bool {
    let sign = |v: f64| if v.abs() < 1e-6 { 0.0 } else { v };
    [axis[2], axis[1], axis[0]].map(sign).into_iter().find(|v| *v != 0.0).is_some_and(|v| v < 0.0)
}
