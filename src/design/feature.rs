//! One line of a part: an operation, a shape or a group, where it stands and how often.
//!
//! In: a feature as written, and what it stands in. Out: a [`Feature`] with an entry per copy, sizes and poses as
//! expressions. Copies share their dimensions but for those marked `each`.

use super::interval::plus;
use super::model::{Corner, DimId, Expr, Extent, Feature, FeatureCopy, Op, OutlinePath, PoseExpr, Shape};
use super::part::as_feature;
use super::scope::Resolver;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Stmt};
use crate::units::Quantity;
use std::collections::BTreeMap;

/// More copies than this in one pattern are a slip of the pen.
pub const MAX_COPIES: u64 = 1000;

/// What the dimensions of a feature are called: `gear.bore.d` where its copies share them, `gear.bore[1].d` in the first
/// copy where every copy has its own.
#[derive(Debug, Clone)]
pub struct Names {
    shared: String,
    own: String,
}

impl Names {
    /// Below a name that has no copies.
    pub fn plain(path: &str) -> Self {
        Names { shared: path.to_string(), own: path.to_string() }
    }

    pub fn child(&self, name: &str) -> Self {
        Names { shared: format!("{}.{name}", self.shared), own: format!("{}.{name}", self.own) }
    }

    /// The name of one dimension; `each` when every copy has its own.
    pub fn of(&self, key: &str, each: bool) -> String {
        format!("{}.{key}", if each { &self.own } else { &self.shared })
    }

    fn copy(&self, number: usize) -> String {
        format!("{}[{number}]", self.own)
    }
}

/// What a feature stands in.
#[derive(Debug, Clone)]
pub struct Context {
    pub names: Names,
    /// Under an odd number of cuts: what is added here takes material from the part.
    pub void: bool,
    /// Under a cut, so that it may reach beyond the part.
    pub in_cut: bool,
    /// The statement that is being read.
    pub span: Span,
}

impl Context {
    /// A part whose dimensions are named under `path`.
    pub fn part(path: &str) -> Self {
        Context { names: Names::plain(path), void: false, in_cut: false, span: Span::default() }
    }

    fn feature(&self, name: &str, op: Op, span: Span) -> Self {
        let cut = op == Op::Cut;
        Context { names: self.names.child(name), void: self.void != cut, in_cut: self.in_cut || cut, span }
    }

    /// The same with the copies of its feature told apart.
    fn copied(&self, patterned: bool) -> Self {
        let own = if patterned { self.names.copy(1) } else { self.names.own.clone() };
        Context { names: Names { own, ..self.names.clone() }, ..self.clone() }
    }
}

/// The place of one copy in its pattern: an offset, and a turn about z.
pub struct Frame {
    pub offset: [Expr; 2],
    pub angle: f64,
}

impl Frame {
    /// `T(at) · T(offset) · Rz(angle) · R(turn)`: the pattern is centred on `at`.
    fn compose(&self, placed: &Placed) -> PoseExpr {
        let [x, y, z] = placed.at.clone();
        let [a, b, c] = placed.turn.clone();
        let [dx, dy] = self.offset.clone();
        PoseExpr { t: [plus(x, dx), plus(y, dy), z], r: [a, b, plus(c, Expr::Const(self.angle))] }
    }
}

/// Where the copies of a feature stand and how each is turned.
struct Placed {
    at: [Expr; 3],
    turn: [Expr; 3],
}

impl Resolver {
    /// The features of a part or of a group, those without faults.
    pub fn features(&mut self, body: &ast::Body, within: &Context) -> Vec<Feature> {
        let mut features: Vec<Feature> = Vec::new();
        for line in &body.lines {
            let Some(feature) = as_feature(line) else { continue };
            if let Some(first) = features.iter().find(|f| f.name == feature.name.text) {
                let first = first.span;
                self.duplicate("feature", &feature.name, first);
            }
            match self.feature(feature, within, line.span) {
                Some(made) => features.push(made),
                None => {
                    self.failed.insert(feature.name.text.clone());
                }
            }
        }
        features
    }

    fn feature(&mut self, feature: &ast::Feature, within: &Context, line: Span) -> Option<Feature> {
        let op = match feature.op.text.as_str() {
            "add" => Op::Add,
            "cut" => Op::Cut,
            _ => Op::Keep,
        };
        let count = self.copies(feature)?;
        let patterned = feature.count.is_some();
        // A group's line is as long as all it holds: its head says enough.
        let span = match &feature.shape {
            ast::Shape::Call(_) => line,
            ast::Shape::Group { word, .. } => Span { end: word.span.end, ..line },
        };
        let own = within.feature(&feature.name.text, op, span);
        let context = own.copied(patterned);
        let shape = match &feature.shape {
            ast::Shape::Call(call) => self.shape(call, &context),
            ast::Shape::Group { body, .. } => self.group(feature, body, &context),
        };
        let place = self.feature_pose(feature, &context.names);
        let frames = self.pattern(feature, count, &context.names);
        let (shape, place, frames) = (shape?, place?, frames?);
        let copies = frames.into_iter().enumerate().map(|(i, frame)| {
            let copy = FeatureCopy { shape: shape.clone(), pose: frame.compose(&place) };
            self.with_own_dimensions(copy, &own.names, i)
        });
        let copies = copies.collect();
        Some(Feature { name: feature.name.text.clone(), op, patterned, copies, span })
    }

    fn copies(&mut self, feature: &ast::Feature) -> Option<u64> {
        let Some(count) = &feature.count else { return Some(1) };
        if (1..=MAX_COPIES).contains(&count.value) {
            return Some(count.value);
        }
        let message = format!("a pattern has 1 to {MAX_COPIES} copies");
        self.report(Diagnostic::error("E0212", count.span, message).label("not a number of copies"));
        None
    }

    fn group(&mut self, feature: &ast::Feature, body: &ast::Body, context: &Context) -> Option<Shape> {
        let word = feature.shape.word();
        self.check_features(&format!("group `{}`", feature.name.text), word.span, body);
        for line in &body.lines {
            let (what, span) = match &line.stmt {
                Stmt::Let { name, .. } => ("a named dimension", name.span),
                Stmt::Outline { name, .. } => ("an outline", name.span),
                Stmt::Field { key, .. } => ("a field", key.span),
                _ => continue,
            };
            let message = format!("{what} belongs to the part, not to a group in it");
            self.report(
                Diagnostic::error("E0203", span, message)
                    .label("not in a group")
                    .help(format!("move this line above `{} {}`", feature.op.text, feature.name.text)),
            );
        }
        let features = self.features(body, context);
        (!features.is_empty()).then_some(Shape::Group { features })
    }

    fn feature_pose(&mut self, feature: &ast::Feature, names: &Names) -> Option<Placed> {
        let zero = || Some([Expr::Const(0.0), Expr::Const(0.0), Expr::Const(0.0)]);
        let at = feature.at.as_ref();
        let at = at.map_or_else(zero, |p| self.point_exprs(p, Quantity::Length, &names.child("at")));
        let turn = feature.turn.as_ref();
        let turn = turn.map_or_else(zero, |p| self.point_exprs(p, Quantity::Angle, &names.child("turn")));
        Some(Placed { at: at?, turn: turn? })
    }

    /// The copy at `index` of a feature called `names`, with new rows for the dimensions that every copy has for itself.
    fn with_own_dimensions(&mut self, mut copy: FeatureCopy, names: &Names, index: usize) -> FeatureCopy {
        if index == 0 {
            return copy;
        }
        let (first, this) = (names.copy(1), names.copy(index + 1));
        let mut renewed: BTreeMap<DimId, DimId> = BTreeMap::new();
        copy.each_dim(&mut |id| {
            if self.remarks[id.0 as usize].each {
                *id = *renewed.entry(*id).or_insert_with(|| self.renewed(*id, &first, &this));
            }
        });
        copy
    }

    fn renewed(&mut self, id: DimId, first: &str, this: &str) -> DimId {
        let (dim, remark) = (self.dims[id.0 as usize].clone(), self.remarks[id.0 as usize].clone());
        let name = dim.name.strip_prefix(first).map_or_else(|| dim.name.clone(), |rest| format!("{this}{rest}"));
        let id = DimId(self.dims.len() as u32);
        self.new_dim(name, dim.quantity, dim.range, remark, dim.span);
        id
    }
}

impl FeatureCopy {
    /// Shows every dimension of the shape and the pose to `change`, groups included.
    fn each_dim(&mut self, change: &mut dyn FnMut(&mut DimId)) {
        let PoseExpr { t, r } = &mut self.pose;
        t.iter_mut().chain(r).for_each(|e| expr_dims(e, change));
        match &mut self.shape {
            Shape::Group { features } => {
                features.iter_mut().flat_map(|f| &mut f.copies).for_each(|copy| copy.each_dim(change));
            }
            shape => shape_exprs(shape).into_iter().for_each(|e| expr_dims(e, change)),
        }
    }
}

fn expr_dims(expr: &mut Expr, change: &mut dyn FnMut(&mut DimId)) {
    match expr {
        Expr::Const(_) => {}
        Expr::Dim(id) => change(id),
        Expr::Neg(a) => expr_dims(a, change),
        Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) | Expr::Div(a, b) => {
            expr_dims(a, change);
            expr_dims(b, change);
        }
    }
}

/// Every expression of a primitive; none of a group, whose features have their own.
fn shape_exprs(shape: &mut Shape) -> Vec<&mut Expr> {
    let (mut sizes, outline, extent) = match shape {
        Shape::Box { x, y, z } => (vec![x, y], None, Some(z)),
        Shape::Cylinder { d, h } => (vec![d], None, Some(h)),
        Shape::Cone { d1, d2, h } => (vec![d1, d2], None, Some(h)),
        Shape::Sphere { d } => (vec![d], None, None),
        Shape::Torus { d, tube } => (vec![d, tube], None, None),
        Shape::Prism { outline, h } => (vec![], Some(outline), Some(h)),
        Shape::Revolve { outline } => (vec![], Some(outline), None),
        Shape::Group { .. } => (vec![], None, None),
    };
    if let Some(outline) = outline {
        sizes.extend(&mut outline.start);
        sizes.extend(corner(&mut outline.start_corner));
        for side in &mut outline.sides {
            sizes.extend(&mut side.to);
            sizes.extend(corner(&mut side.corner));
            if let OutlinePath::Arc { radius, .. } = &mut side.path {
                sizes.push(radius);
            }
        }
    }
    if let Some(Extent::Length(length)) = extent {
        sizes.push(length);
    }
    sizes
}

fn corner(corner: &mut Corner) -> Option<&mut Expr> {
    match corner {
        Corner::Sharp => None,
        Corner::Round(size) | Corner::Chamfer(size) => Some(size),
    }
}
