//! Patterns: where the copies of a feature stand, as a drawing calls them out.
//!
//! `circle` turns each copy with its place; `line` runs from the feature's place along x; `grid` is centred on it and
//! numbered in reading order, from -x to +x and from +y down to -y.

use super::feature::{Frame, Names};
use super::fields::Fields;
use super::interval::{half, times};
use super::model::Expr;
use super::scope::Resolver;
use super::tolerance::General;
use crate::diag::Diagnostic;
use crate::syntax::ast::{self, Value};
use crate::units::Quantity;
use std::f64::consts::TAU;

impl Resolver {
    /// A frame per copy; `None` when the pattern is wrong.
    pub fn pattern(&mut self, feature: &ast::Feature, count: u64, names: &Names) -> Option<Vec<Frame>> {
        match (&feature.on, &feature.count) {
            (None, None) => Some(vec![Frame { offset: [Expr::Const(0.0), Expr::Const(0.0)], angle: 0.0 }]),
            (None, Some(times)) => {
                let message = format!("{count} copies of `{}` would coincide", feature.name.text);
                self.report(
                    Diagnostic::error("E0207", times.span, message).label("copies need a pattern").help(
                        "add `on circle(d = 36)`, `on line(pitch = 10)` or `on grid(columns = 2, x = 10, y = 10)`",
                    ),
                );
                None
            }
            (Some(call), _) => self.frames(call, count, &names.child(&call.name.text)),
        }
    }

    fn frames(&mut self, call: &ast::Call, count: u64, names: &Names) -> Option<Vec<Frame>> {
        let fields = Fields::of_args(&call.name, &call.args);
        match call.name.text.as_str() {
            "circle" => self.circle(&fields, count, names),
            "line" => self.line(&fields, count, names),
            "grid" => self.grid(&fields, count, names),
            other => {
                let message = format!("no pattern is named `{other}`");
                self.report(
                    Diagnostic::error("E0201", call.name.span, message)
                        .label("unknown pattern")
                        .help("write `circle`, `line` or `grid`"),
                );
                None
            }
        }
    }

    fn circle(&mut self, fields: &Fields, count: u64, names: &Names) -> Option<Vec<Frame>> {
        self.check_fields(fields, &["d", "r", "from", "step"]);
        let radius = match (fields.get("r"), fields.get("d")) {
            (Some(_), _) => self.location(fields, "r", names)?,
            (None, Some(_)) => half(&self.location(fields, "d", names)?),
            (None, None) => {
                self.missing(fields, "d", "36 basic");
                return None;
            }
        };
        let any = [f64::MIN, f64::MAX];
        let from = self.exact_or(fields, "from", Quantity::Angle, 0.0, any);
        let step = self.exact_or(fields, "step", Quantity::Angle, TAU / count as f64, any);
        let frame = |i: u64| {
            let angle = from + step * i as f64;
            Frame { offset: [times(&radius, angle.cos()), times(&radius, angle.sin())], angle }
        };
        Some((0..count).map(frame).collect())
    }

    fn line(&mut self, fields: &Fields, count: u64, names: &Names) -> Option<Vec<Frame>> {
        self.check_fields(fields, &["pitch", "angle"]);
        if fields.get("pitch").is_none() {
            self.missing(fields, "pitch", "10");
            return None;
        }
        let pitch = self.location(fields, "pitch", names)?;
        let angle = self.exact_or(fields, "angle", Quantity::Angle, 0.0, [f64::MIN, f64::MAX]);
        let frame = |i: u64| {
            let [x, y] = [angle.cos() * i as f64, angle.sin() * i as f64];
            Frame { offset: [times(&pitch, x), times(&pitch, y)], angle: 0.0 }
        };
        Some((0..count).map(frame).collect())
    }

    fn grid(&mut self, fields: &Fields, count: u64, names: &Names) -> Option<Vec<Frame>> {
        self.check_fields(fields, &["columns", "x", "y"]);
        for (key, example) in [("columns", "2"), ("x", "10"), ("y", "10")] {
            if fields.get(key).is_none() {
                self.missing(fields, key, example);
                return None;
            }
        }
        let columns = self.whole_or(fields, "columns", count, [1, count]);
        let rows = count.div_ceil(columns);
        let (x, y) = (self.location(fields, "x", names)?, self.location(fields, "y", names)?);
        let frame = |i: u64| {
            let across = (i % columns) as f64 - (columns - 1) as f64 / 2.0;
            let down = (i / columns) as f64 - (rows - 1) as f64 / 2.0;
            Frame { offset: [times(&x, across), times(&y, -down)], angle: 0.0 }
        };
        Some((0..count).map(frame).collect())
    }

    fn location(&mut self, fields: &Fields, key: &str, names: &Names) -> Option<Expr> {
        let dim = match fields.get(key)? {
            Value::Dim(dim) => dim,
            other => {
                self.wrong_form(other.span(), "a length");
                return None;
            }
        };
        self.dimension(dim, Quantity::Length, General::Basic, &names.of(key, dim.each))
    }
}
