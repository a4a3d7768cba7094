//! `part`: a feature list becomes primitives with expressions for sizes and poses.

use super::dimension::{General, trim};
use super::fields::Fields;
use super::model::{DimId, Expr, Extent, Feature, FeatureCopy, Op, Part, PoseExpr, Shape};
use super::scope::{Named, Resolver};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Stmt, Value};
use crate::units::{Quantity, Range};
use std::collections::BTreeMap;

/// More copies than this in one pattern are a slip of the pen.
pub const MAX_COPIES: u64 = 1000;

/// A part as written.
#[derive(Debug, Clone, Copy)]
pub struct PartSource<'a> {
    pub name: &'a ast::Name,
    pub body: &'a ast::Body,
}

impl Resolver {
    /// One piece of a part. Its dimensions are named under `path`: the part's name, or the component's when the part
    /// is placed more than once, so that every piece has draws of its own.
    pub fn part(&mut self, source: PartSource, path: &str, materials: &BTreeMap<&str, usize>) -> Part {
        self.locals = self.part_names(source.body, path);
        let mut features: Vec<Feature> = Vec::new();
        for line in &source.body.lines {
            if let Stmt::Feature(feature) = &line.stmt {
                self.unique_feature(&features, feature);
                features.extend(self.feature(feature, path, line.span));
            }
        }
        self.check_features(source, &features);
        self.warn_unused_locals();
        let material = self.part_material(source, materials);
        Part { name: source.name.text.clone(), material, features, span: source.name.span }
    }

    fn part_names(&mut self, body: &ast::Body, path: &str) -> BTreeMap<String, Named> {
        let mut names: BTreeMap<String, Named> = BTreeMap::new();
        for line in &body.lines {
            if let Stmt::Let { name, dim } = &line.stmt {
                self.define(&mut names, name, dim, format!("{path}.{}", name.text));
            }
        }
        names
    }

    /// Adds a `let` to a table, unless its name is taken or is a word of the language.
    pub fn define(&mut self, names: &mut BTreeMap<String, Named>, name: &ast::Name, dim: &ast::Dim, path: String) {
        if ["free", "through", "exact"].contains(&name.text.as_str()) {
            let message = format!("`{}` is a word of the language", name.text);
            self.report(Diagnostic::error("E0202", name.span, message).label("choose another name"));
        } else if let Some(first) = names.get(&name.text) {
            let first = first.span;
            self.duplicate("dimension", name, first);
        } else {
            names.insert(name.text.clone(), Named::new(name, dim, path));
        }
    }

    pub fn duplicate(&mut self, kind: &str, name: &ast::Name, first: Span) {
        let message = format!("{kind} `{}` is defined twice", name.text);
        self.report(
            Diagnostic::error("E0202", name.span, message)
                .label("defined again")
                .also(first, "first defined here")
                .help(format!("name it `{}_2`", name.text)),
        );
    }

    fn warn_unused_locals(&mut self) {
        let unused: Vec<(String, Span)> = self
            .locals
            .iter()
            .filter(|(_, named)| !self.is_used(named.span))
            .map(|(n, d)| (n.clone(), d.span))
            .collect();
        for (name, span) in unused {
            self.unused("dimension", &name, span);
        }
    }

    pub fn unused(&mut self, kind: &str, name: &str, span: Span) {
        let message = format!("{kind} `{name}` is never used");
        self.report(Diagnostic::warning("W0209", span, message).label("not used").help("use it or remove it"));
    }

    fn unique_feature(&mut self, features: &[Feature], feature: &ast::Feature) {
        if let Some(first) = features.iter().find(|f| f.name == feature.name.text) {
            self.duplicate("feature", &feature.name, first.span);
        }
    }

    fn check_features(&mut self, source: PartSource, features: &[Feature]) {
        let name = &source.name.text;
        let written = source.body.lines.iter().find(|l| matches!(l.stmt, Stmt::Feature(_)));
        match written.map(|line| &line.stmt) {
            None => self.report(
                Diagnostic::error("E0207", source.name.span, format!("part `{name}` has no features"))
                    .label("an empty part")
                    .help("begin with a body: `add body = box(x = 10, y = 10, z = 10)`"),
            ),
            Some(Stmt::Feature(first)) if first.op.text != "add" => self.report(
                Diagnostic::error("E0207", first.op.span, format!("part `{name}` begins with `{}`", first.op.text))
                    .label("there is nothing to take from yet")
                    .help("begin with a body: `add body = box(x = 10, y = 10, z = 10)`"),
            ),
            _ => {}
        }
        let total: usize = features.iter().map(|f| f.copies.len()).sum();
        if total as u64 > 4 * MAX_COPIES {
            let message = format!("part `{name}` has {total} features, the limit is {}", 4 * MAX_COPIES);
            self.report(Diagnostic::error("E0212", source.name.span, message).label("too many features"));
        }
    }

    fn part_material(&mut self, source: PartSource, materials: &BTreeMap<&str, usize>) -> usize {
        let fields = Fields::of_body(&format!("part {}", source.name.text), source.name.span, source.body);
        self.check_fields(&fields, &["material"]);
        match fields.get("material") {
            None => {
                let example = materials.keys().next().copied().unwrap_or("steel");
                self.missing(&fields, "material", example);
                0
            }
            Some(value) => self.material_named(value, materials),
        }
    }

    /// Index of the material a field names.
    pub fn material_named(&mut self, value: &Value, materials: &BTreeMap<&str, usize>) -> usize {
        let Value::Dim(dim) = value else {
            self.wrong_form(value.span(), "the name of a material");
            return 0;
        };
        let Some(name) = dim.word() else {
            self.wrong_form(value.span(), "the name of a material");
            return 0;
        };
        if let Some(index) = materials.get(name) {
            self.used_materials.insert(*index);
            return *index;
        }
        let known_as = self.kinds.get(name).copied();
        let diagnostic = match known_as {
            Some(kind) => Diagnostic::error("E0203", dim.span, format!("expected a material, `{name}` is a {kind}"))
                .label(format!("a {kind}")),
            None => {
                Diagnostic::error("E0201", dim.span, format!("no material is named `{name}`")).label("unknown material")
            }
        };
        self.report(match nearest(name, materials.keys().copied()) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None if known_as.is_some() => {
                diagnostic.help(format!("materials: {}", materials.keys().copied().collect::<Vec<_>>().join(", ")))
            }
            None => diagnostic.help(format!("define it: `material {name} {{ kind = matt }}`")),
        });
        0
    }

    fn feature(&mut self, feature: &ast::Feature, path: &str, span: Span) -> Option<Feature> {
        let op = match feature.op.text.as_str() {
            "add" => Op::Add,
            "cut" => Op::Cut,
            _ => Op::Keep,
        };
        let count = self.copies(feature)?;
        let path = format!("{path}.{}", feature.name.text);
        let shape = self.shape(feature, op, &path);
        let place = self.feature_pose(feature, &path);
        let frames = self.pattern(feature, count, &path);
        let (shape, place, frames) = (shape?, place?, frames?);
        let copies = frames.into_iter().enumerate().map(|(i, frame)| FeatureCopy {
            shape: self.copy_of_shape(&shape, feature, i),
            pose: frame.compose(&place),
        });
        let copies = copies.collect();
        Some(Feature { name: feature.name.text.clone(), op, patterned: feature.count.is_some(), copies, span })
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

    fn shape(&mut self, feature: &ast::Feature, op: Op, path: &str) -> Option<Shape> {
        let fields = Fields::of_args(&feature.shape.name, &feature.shape.args);
        let mut reader = Sizes { resolver: self, fields: &fields, path, op };
        match feature.shape.name.text.as_str() {
            "box" => {
                reader.known(&["x", "y", "z"]);
                let (x, y, z) = (reader.size("x", "20"), reader.size("y", "10"), reader.extent("z"));
                Some(Shape::Box { x: x?, y: y?, z: z? })
            }
            "cylinder" => {
                reader.known(&["d", "h"]);
                let (d, h) = (reader.size("d", "10"), reader.extent("h"));
                Some(Shape::Cylinder { d: d?, h: h? })
            }
            "cone" | "frustum" => {
                reader.known(&["d1", "d2", "h"]);
                let (d1, d2, h) = (reader.end("d1"), reader.end("d2"), reader.extent("h"));
                let (d1, d2) = (d1?, d2?);
                reader.not_both_points(&d1, &d2);
                Some(Shape::Cone { d1, d2, h: h? })
            }
            "sphere" => {
                reader.known(&["d"]);
                Some(Shape::Sphere { d: reader.size("d", "10")? })
            }
            other => {
                self.unknown_shape(&feature.shape.name, other);
                None
            }
        }
    }

    fn unknown_shape(&mut self, name: &ast::Name, word: &str) {
        let shapes = ["box", "cylinder", "cone", "frustum", "sphere"];
        let diagnostic = Diagnostic::error("E0201", name.span, format!("no shape is named `{word}`"))
            .label("unknown shape")
            .note("shapes: box, cylinder, cone (or frustum), sphere");
        self.report(match nearest(word, shapes) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic,
        });
    }

    fn feature_pose(&mut self, feature: &ast::Feature, path: &str) -> Option<Placed> {
        let zero = || Some([Expr::Const(0.0), Expr::Const(0.0), Expr::Const(0.0)]);
        let at =
            feature.at.as_ref().map_or_else(zero, |p| self.point_exprs(p, Quantity::Length, &format!("{path}.at")));
        let turn =
            feature.turn.as_ref().map_or_else(zero, |p| self.point_exprs(p, Quantity::Angle, &format!("{path}.turn")));
        Some(Placed { at: at?, turn: turn? })
    }

    /// Copies share their dimensions but for those marked `each`.
    fn copy_of_shape(&mut self, shape: &Shape, feature: &ast::Feature, index: usize) -> Shape {
        if index == 0 {
            return shape.clone();
        }
        let own: Vec<(Span, &str)> = feature.shape.args.list.iter().filter_map(each_span).collect();
        let mut copy = shape.clone();
        for expr in shape_exprs(&mut copy) {
            self.renew(expr, &own, index);
        }
        copy
    }

    fn renew(&mut self, expr: &mut Expr, own: &[(Span, &str)], index: usize) {
        let Expr::Dim(DimId(id)) = *expr else { return };
        let (dim, remark) = (self.dims[id as usize].clone(), self.remarks[id as usize].clone());
        if own.iter().any(|(span, _)| *span == dim.span) {
            let (head, tail) = dim.name.rsplit_once("[1]").unwrap_or((&dim.name, ""));
            let name = format!("{head}[{}]{tail}", index + 1);
            *expr = self.new_dim(name, dim.quantity, dim.range, remark, dim.span);
        }
    }
}

/// Where the copies of a feature stand and how each is turned.
struct Placed {
    at: [Expr; 3],
    turn: [Expr; 3],
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

/// A sum, with constants folded.
pub fn plus(a: Expr, b: Expr) -> Expr {
    match (a, b) {
        (Expr::Const(a), Expr::Const(b)) => Expr::Const(a + b),
        (a, Expr::Const(0.0)) => a,
        (Expr::Const(0.0), b) => b,
        (a, b) => Expr::Add(Box::new(a), Box::new(b)),
    }
}

/// Every size of a shape.
pub fn shape_exprs(shape: &mut Shape) -> Vec<&mut Expr> {
    let (mut sizes, extent) = match shape {
        Shape::Box { x, y, z } => (vec![x, y], Some(z)),
        Shape::Cylinder { d, h } => (vec![d], Some(h)),
        Shape::Cone { d1, d2, h } => (vec![d1, d2], Some(h)),
        Shape::Sphere { d } => (vec![d], None),
        Shape::Torus { d, tube } => (vec![d, tube], None),
        Shape::Prism { h, .. } => (vec![], Some(h)),
        Shape::Revolve { .. } | Shape::Group { .. } => (vec![], None),
    };
    if let Some(Extent::Length(length)) = extent {
        sizes.push(length);
    }
    sizes
}

fn each_span(arg: &ast::Arg) -> Option<(Span, &str)> {
    match &arg.value {
        Value::Dim(dim) if dim.each => Some((dim.span, &arg.key.text)),
        _ => None,
    }
}

/// Reads the sizes of one shape.
struct Sizes<'r, 'a> {
    resolver: &'r mut Resolver,
    fields: &'r Fields<'a>,
    path: &'r str,
    op: Op,
}

impl Sizes<'_, '_> {
    fn known(&mut self, known: &[&str]) {
        self.resolver.check_fields(self.fields, known);
    }

    /// A size that is positive at every limit.
    fn size(&mut self, key: &str, example: &str) -> Option<Expr> {
        self.bounded(key, example, false)
    }

    /// A diameter of a cone, which may be zero.
    fn end(&mut self, key: &str) -> Option<Expr> {
        self.bounded(key, "10", true)
    }

    fn bounded(&mut self, key: &str, example: &str, may_be_zero: bool) -> Option<Expr> {
        let Some(value) = self.fields.get(key) else {
            self.resolver.missing(self.fields, key, example);
            return None;
        };
        let dim = self.resolver.dim_of(value)?;
        let owner = format!("{}.{key}", self.path);
        let name = if dim.each { format!("{}[1].{key}", self.path) } else { owner.clone() };
        if dim.word() == Some("through") {
            let message = format!("`{key}` cannot be `through`: only the height of a cut can");
            self.resolver.report(
                Diagnostic::error("E0211", dim.span, message)
                    .label("needs a size")
                    .help(format!("write `{key} = {example}`")),
            );
            return None;
        }
        let expr = self.resolver.dimension(dim, Quantity::Length, General::Applies, &name)?;
        self.resolver.doubt_tolerance(dim, &format!("`{owner}`"));
        self.positive(&expr, &owner, dim.span, may_be_zero).then_some(expr)
    }

    fn positive(&mut self, expr: &Expr, owner: &str, span: Span, may_be_zero: bool) -> bool {
        let low = bounds(expr, &|id| self.resolver.dims[id.0 as usize].range).low;
        if low > 0.0 || (may_be_zero && low == 0.0) {
            return true;
        }
        let message = format!("`{owner}` may reach {} mm", trim(low));
        self.resolver.report(
            Diagnostic::error("E0307", span, message)
                .label("a size must be positive at every limit")
                .help("make the size larger or its tolerance smaller"),
        );
        false
    }

    fn not_both_points(&mut self, d1: &Expr, d2: &Expr) {
        let zero = |e: &Expr| *e == Expr::Const(0.0);
        if zero(d1) && zero(d2) {
            let message = "a cone needs a diameter at one end";
            self.resolver.report(Diagnostic::error("E0307", self.fields.span, message).label("both ends are points"));
        }
    }

    fn extent(&mut self, key: &str) -> Option<Extent> {
        let through = matches!(self.fields.get(key), Some(Value::Dim(dim)) if dim.word() == Some("through"));
        if !through {
            let example = if self.op == Op::Cut { "through" } else { "10" };
            return self.size(key, example).map(Extent::Length);
        }
        if self.op == Op::Cut && self.fields.owner != "cone" && self.fields.owner != "frustum" {
            return Some(Extent::Through);
        }
        let span = self.fields.get(key).map_or(self.fields.span, Value::span);
        let message = if self.op == Op::Cut { "a cone cannot be `through`" } else { "only a cut can be `through`" };
        self.resolver.report(
            Diagnostic::error("E0211", span, message).label("needs a length").help(format!("write `{key} = 10`")),
        );
        None
    }
}

/// The range of an expression over the ranges of its dimensions, by interval arithmetic.
pub fn bounds(expr: &Expr, range: &dyn Fn(DimId) -> Range) -> Range {
    let of = |low: f64, high: f64| Range { low, nominal: f64::NAN, high };
    let corners = |a: Range, b: Range, f: fn(f64, f64) -> f64| {
        let all = [f(a.low, b.low), f(a.low, b.high), f(a.high, b.low), f(a.high, b.high)];
        // `min` and `max` skip NaN; a quotient without value is refused at its nominal.
        of(all.iter().copied().fold(f64::INFINITY, f64::min), all.iter().copied().fold(f64::NEG_INFINITY, f64::max))
    };
    match expr {
        Expr::Const(v) => of(*v, *v),
        Expr::Dim(id) => range(*id),
        Expr::Neg(a) => {
            let a = bounds(a, range);
            of(-a.high, -a.low)
        }
        Expr::Add(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a + b),
        Expr::Sub(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a - b),
        Expr::Mul(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a * b),
        Expr::Div(a, b) => {
            let divisor = bounds(b, range);
            if divisor.low <= 0.0 && divisor.high >= 0.0 {
                return of(f64::NEG_INFINITY, f64::INFINITY);
            }
            corners(bounds(a, range), divisor, |a, b| a / b)
        }
    }
}
