//! Shapes as written, with the checks that hold for every draw of their dimensions.
//!
//! In: a call such as `cylinder(d = 6 H7, h = through)`. Out: a [`Shape`] whose sizes are positive at every limit. What a
//! workshop has its own word for (a hole, a countersink) is put together from the primitives in `hole`.

use super::dimension::trim;
use super::feature::Context;
use super::fields::Fields;
use super::interval::bounds;
use super::model::{Expr, Extent, Outline, Shape};
use super::scope::Resolver;
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Value};
use crate::units::Quantity;

/// Smaller sizes (mm) are none: a tenth of a micrometre is less than any surface is rough.
const SMALLEST: f64 = 1e-4;

/// The words a feature may be made with, for messages.
const WORDS: [&str; 11] =
    ["box", "cylinder", "cone", "frustum", "sphere", "torus", "prism", "revolve", "hole", "counterbore", "countersink"];

impl Resolver {
    pub fn shape(&mut self, call: &ast::Call, context: &Context) -> Option<Shape> {
        let fields = Fields::of_args(&call.name, &call.args);
        let mut reader = Sizes { resolver: self, fields: &fields, context };
        match call.name.text.as_str() {
            "box" => reader.cuboid(),
            "cylinder" => reader.cylinder(),
            "cone" | "frustum" => reader.cone(),
            "sphere" => {
                reader.known(&["d"]);
                Some(Shape::Sphere { d: reader.size("d", "10")? })
            }
            "torus" => reader.torus(),
            "prism" => {
                reader.known(&["outline", "h"]);
                let (outline, h) = (reader.outline(), reader.extent("h"));
                let (outline, h, span) = (outline?, h?, reader.span_of("outline"));
                self.ends_are_free(&outline, span).then_some(Shape::Prism { outline, h })
            }
            "revolve" => reader.revolve(),
            "hole" => reader.hole(),
            "counterbore" => reader.counterbore(),
            "countersink" => reader.countersink(),
            other => {
                self.unknown_shape(&call.name, other);
                None
            }
        }
    }

    fn unknown_shape(&mut self, name: &ast::Name, word: &str) {
        let diagnostic = Diagnostic::error("E0201", name.span, format!("no shape is named `{word}`"))
            .label("unknown shape")
            .note(format!("shapes: {}; and `group {{ … }}`", WORDS.join(", ")));
        let near = super::elsewhere::call(word, &WORDS).or_else(|| nearest(word, WORDS));
        self.report(match near {
            _ if word == "group" => {
                diagnostic.help("a group has braces: `group { add body = box(x = 1, y = 1, z = 1) }`")
            }
            Some(near) => diagnostic.meant(name.span, near),
            None => diagnostic,
        });
    }
}

/// Reads the sizes of one shape.
pub struct Sizes<'r, 'a> {
    pub resolver: &'r mut Resolver,
    pub fields: &'r Fields<'a>,
    pub context: &'r Context,
}

impl Sizes<'_, '_> {
    fn cuboid(&mut self) -> Option<Shape> {
        self.known(&["x", "y", "z"]);
        let (x, y, z) = (self.size("x", "20"), self.size("y", "10"), self.extent("z"));
        Some(Shape::Box { x: x?, y: y?, z: z? })
    }

    fn cone(&mut self) -> Option<Shape> {
        self.known(&["d1", "d2", "h"]);
        let (d1, d2, h) = (self.end("d1"), self.end("d2"), self.extent("h"));
        let (d1, d2) = (d1?, d2?);
        self.not_both_points(&d1, &d2);
        Some(Shape::Cone { d1, d2, h: h? })
    }

    fn torus(&mut self) -> Option<Shape> {
        self.known(&["d", "tube"]);
        let (d, tube) = (self.size("d", "20"), self.size("tube", "4"));
        let (d, tube) = (d?, tube?);
        self.larger(&d, "d", &tube, "tube").then_some(Shape::Torus { d, tube })
    }

    fn revolve(&mut self) -> Option<Shape> {
        self.known(&["outline"]);
        let outline = self.outline()?;
        self.resolver.right_of_axis(&outline, self.span_of("outline")).then_some(Shape::Revolve { outline })
    }

    /// The outline that the argument of that name names.
    fn outline(&mut self) -> Option<Outline> {
        let Some(value) = self.fields.get("outline") else {
            let example = self.resolver.outlines.keys().next().cloned().unwrap_or("profile".to_string());
            self.resolver.missing(self.fields, "outline", &example);
            return None;
        };
        match value {
            Value::Dim(dim) if dim.word().is_some() => self.resolver.outline_named(dim.word()?, dim.span),
            other => {
                self.resolver.wrong_form(other.span(), "the name of an outline");
                None
            }
        }
    }

    pub fn known(&mut self, known: &[&str]) {
        self.resolver.check_fields(self.fields, known);
    }

    pub fn has(&self, key: &str) -> bool {
        self.fields.get(key).is_some()
    }

    /// Where an argument stands, or its shape if it is left out.
    pub fn span_of(&self, key: &str) -> Span {
        self.fields.get(key).map_or(self.fields.span, Value::span)
    }

    /// A size that is positive at every limit.
    pub fn size(&mut self, key: &str, example: &str) -> Option<Expr> {
        self.bounded(key, example, General::Applies, false)
    }

    /// The size of a broken edge, for which ISO 2768 has tolerances of its own.
    pub fn edge(&mut self, key: &str) -> Option<Expr> {
        self.bounded(key, "1", General::Edge, false)
    }

    /// A diameter of a cone, which may be zero.
    fn end(&mut self, key: &str) -> Option<Expr> {
        self.bounded(key, "10", General::Applies, true)
    }

    fn bounded(&mut self, key: &str, example: &str, general: General, may_be_zero: bool) -> Option<Expr> {
        let Some(value) = self.fields.get(key) else {
            self.resolver.missing(self.fields, key, example);
            return None;
        };
        let dim = self.resolver.dim_of(value)?;
        let owner = self.context.names.of(key, false);
        if dim.word() == Some("through") {
            let message = format!("`{key}` cannot be `through`: only the height of a cut can");
            self.resolver.report(Diagnostic::error("E0211", dim.span, message).label("needs a size").suggest(
                format!("write `{key} = {example}`"),
                dim.span,
                example,
            ));
            return None;
        }
        let expr = self.resolver.dimension(dim, Quantity::Length, general, &self.context.names.of(key, dim.each))?;
        if general == General::Applies {
            self.resolver.doubt_tolerance(dim, &format!("`{owner}`"));
        }
        self.resolver.positive(&expr, &owner, dim.span, may_be_zero).then_some(expr)
    }

    /// Whether one size stays larger than another at every limit; reports if not.
    pub fn larger(&mut self, large: &Expr, large_key: &str, small: &Expr, small_key: &str) -> bool {
        let least = self.resolver.lowest(&super::interval::minus(large.clone(), small.clone()));
        if least > 0.0 {
            return true;
        }
        let message = format!("`{large_key}` must be larger than `{small_key}` at every limit");
        let text = match least {
            0.0 => format!("may be equal to `{small_key}`"),
            less => format!("may be {} mm smaller than `{small_key}`", trim(-less)),
        };
        self.resolver.report(
            Diagnostic::error("E0307", self.span_of(large_key), message)
                .label(text)
                .also(self.span_of(small_key), "to be the smaller one")
                .help(format!("make `{large_key}` larger or `{small_key}` smaller")),
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

    pub fn extent(&mut self, key: &str) -> Option<Extent> {
        let through = matches!(self.fields.get(key), Some(Value::Dim(dim)) if dim.word() == Some("through"));
        if !through {
            let example = if self.context.in_cut { "through" } else { "10" };
            return self.size(key, example).map(Extent::Length);
        }
        if self.context.in_cut && self.fields.owner != "cone" && self.fields.owner != "frustum" {
            return Some(Extent::Through);
        }
        let message = if self.context.in_cut { "a cone cannot be `through`" } else { "only a cut can be `through`" };
        self.resolver.report(Diagnostic::error("E0211", self.span_of(key), message).label("needs a length").suggest(
            format!("write `{key} = 10`"),
            self.span_of(key),
            "10",
        ));
        None
    }
}

impl Resolver {
    /// The least value of an expression within the limits of its dimensions.
    pub fn lowest(&self, expr: &Expr) -> f64 {
        bounds(expr, &|id| self.dims[id.0 as usize].range).low
    }

    /// Whether a size is positive at every limit; reports if not.
    pub fn positive(&mut self, expr: &Expr, owner: &str, span: Span, may_be_zero: bool) -> bool {
        let low = self.lowest(expr);
        if low >= SMALLEST || (may_be_zero && low == 0.0) {
            return true;
        }
        let shown = if low.abs() < SMALLEST && low != 0.0 { format!("{low:e}") } else { trim(low).to_string() };
        let message = format!("`{owner}` may reach {shown} mm");
        self.report(
            Diagnostic::error("E0307", span, message)
                .label("a size must be positive at every limit")
                .help("make the size larger or its tolerance smaller"),
        );
        false
    }
}
