//! Dimensions: from what stands on the drawing to numbers with limits.
//!
//! In: a dimension as written, and the quantity its place wants. Out: an [`Expr`] (a constant, a row of the table of
//! dimensions, or arithmetic over rows) or a [`Range`]. A bare number has the unit of its file; a bare deviation that of
//! the size it belongs to; a deviation in % is a share of the nominal value.

use super::interval::bounds;
use super::model::Expr;
use super::scope::{Named, Remark, Resolver, Typed, Use};
use super::sum::scaled;
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Applicability, Diagnostic, Fix, Span};
use crate::syntax::ast::{self, Size};
use crate::units::{Quantity, Range};

/// Larger numbers (mm, rad, px) are slips of the pen or overflow.
const LARGEST: f64 = 1e9;
/// Longer lengths (mm) are, too: a kilometre, where a solid could no longer be told to a thousandth of a micrometre.
const LONGEST: f64 = 1e6;

/// The unit of a name, as quantity and factor to mm, rad, 1 or px.
pub fn unit(name: &str) -> Option<(Quantity, f64)> {
    Some(match name {
        "mm" => (Quantity::Length, 1.0),
        "um" => (Quantity::Length, 1e-3),
        "cm" => (Quantity::Length, 10.0),
        "m" => (Quantity::Length, 1000.0),
        "in" => (Quantity::Length, 25.4),
        "deg" => (Quantity::Angle, 1f64.to_radians()),
        "rad" => (Quantity::Angle, 1.0),
        "px" => (Quantity::Pixels, 1.0),
        "%" => (Quantity::Ratio, 0.01),
        _ => return None,
    })
}

/// What units are called in full, and abroad.
pub fn unit_meant(name: &str) -> Option<&'static str> {
    const NAMES: [(&str, &[&str]); 8] = [
        ("in", &["inch", "inches", "zoll"]),
        ("mm", &["millimeter", "millimetre", "millimeters", "millimetres"]),
        ("um", &["micron", "microns", "micrometer", "micrometre"]),
        ("cm", &["centimeter", "centimetre", "centimeters", "centimetres"]),
        ("m", &["meter", "metre", "meters", "metres"]),
        ("deg", &["degree", "degrees", "grad"]),
        ("rad", &["radian", "radians"]),
        ("px", &["pixel", "pixels"]),
    ];
    let name = name.to_ascii_lowercase();
    NAMES.iter().find(|(_, names)| names.contains(&name.as_str())).map(|(unit, _)| *unit)
}

impl Resolver {
    /// The value of a dimension in a place that wants `want`. Limits of its own make a row named `name`.
    pub fn dimension(&mut self, dim: &ast::Dim, want: Quantity, general: General, name: &str) -> Option<Expr> {
        let typed = self.value(dim, Use::Shared, general, name, Some(want))?;
        let expr = self.coerce(typed, want, dim.span)?;
        let expr = self.finite(expr, want, dim.span)?;
        self.note_reading(dim.span, want, &expr);
        Some(expr)
    }

    /// The range of a value that is not sampled with the parts: a material, a camera, a lamp.
    pub fn range(&mut self, dim: &ast::Dim, want: Quantity) -> Option<Range> {
        let limited = self.limited(dim, General::Basic, Some(want))?;
        let scale = self.bare_scale(limited.quantity, want, dim.span)?;
        let scaled = |v: f64| v * scale;
        let Range { low, nominal, high } = limited.range;
        let range = Range { low: scaled(low), nominal: scaled(nominal), high: scaled(high) };
        let range = self.in_bounds(range, want, dim.span)?;
        self.note_range(dim.span, want, range);
        Some(range)
    }

    /// A named dimension. Without a unit it is a length.
    pub fn named_value(&mut self, named: &Named, usage: Use) -> Option<Typed> {
        if named.dim.each {
            let message = "`each` belongs to a dimension of a feature, and a name is one dimension for all";
            self.report(Diagnostic::error("E0211", named.dim.span, message).label("not here"));
        }
        let typed = self.value(&named.dim, usage, General::Applies, &named.path, None)?;
        let quantity = typed.quantity.unwrap_or(Quantity::Length);
        let expr = self.coerce(typed, quantity, named.dim.span)?;
        let expr = self.finite(expr, quantity, named.dim.span)?;
        if usage == Use::Shared {
            self.note_reading(named.dim.span, quantity, &expr);
        }
        Some(Typed { expr, quantity: Some(quantity) })
    }

    fn value(
        &mut self,
        dim: &ast::Dim,
        usage: Use,
        general: General,
        name: &str,
        want: Option<Quantity>,
    ) -> Option<Typed> {
        match (&dim.size, &dim.tolerance) {
            (Size::Path(path), None) => return self.lookup(path, usage),
            (Size::Sum(sum), None) => return self.sum(sum, usage),
            _ => {}
        }
        let limited = self.limited(dim, general, want)?;
        let Range { low, nominal, high } = limited.range;
        if usage == Use::Nominal || low == high {
            return Some(Typed { expr: Expr::Const(nominal), quantity: limited.quantity });
        }
        // A row of the table is in mm or rad, so a bare number is settled here.
        let quantity = limited.quantity.or(want).unwrap_or(Quantity::Length);
        let scale = self.bare_scale(limited.quantity, quantity, dim.span)?;
        let range = Range { low: low * scale, nominal: nominal * scale, high: high * scale };
        let range = self.in_bounds(range, quantity, dim.span)?;
        let states = limited.remark.states.map(|s| s.map(|v| v * scale));
        let remark = Remark { states, each: dim.each, ..limited.remark };
        Some(Typed {
            expr: self.new_dim(name.to_string(), quantity, range, remark, dim.span),
            quantity: Some(quantity),
        })
    }

    /// A second number of a dimension in the terms of the first.
    pub fn same_scale(
        &mut self,
        other: Typed,
        first: Option<Quantity>,
        span: Span,
        want: Option<Quantity>,
    ) -> Option<f64> {
        let value = other.expr.eval(&[]);
        match (first, other.quantity) {
            (a, b) if a == b => Some(value),
            // The size is bare and will be scaled by its file's unit: divide by it beforehand.
            (None, Some(b)) => {
                let target = want.unwrap_or(b);
                if target != b {
                    self.wrong_quantity(target, b, span);
                    return None;
                }
                Some(value / self.file_scale(b, span))
            }
            (Some(a), None) => Some(value * self.file_scale(a, span)),
            (Some(a), Some(b)) => {
                self.wrong_quantity(a, b, span);
                None
            }
            (None, None) => Some(value),
        }
    }

    /// mm, rad, 1 or px in the file's unit.
    pub fn file_scale(&self, quantity: Quantity, span: Span) -> f64 {
        let title = self.title(span);
        match quantity {
            Quantity::Length => title.length,
            Quantity::Angle => title.angle,
            Quantity::Ratio | Quantity::Pixels => 1.0,
        }
    }

    pub fn quantity(&mut self, q: &ast::Quantity) -> Option<Typed> {
        let Some(name) = &q.unit else {
            return Some(Typed { expr: Expr::Const(q.number.value), quantity: None });
        };
        let Some((quantity, factor)) = unit(&name.text) else {
            // A slip of the pen seldom changes the first letter.
            let mut known = ["mm", "um", "cm", "m", "in", "deg", "rad", "px"];
            known.sort_by_key(|k| k.chars().next() != name.text.chars().next());
            let help = unit_meant(&name.text)
                .or_else(|| nearest(&name.text, known))
                .or_else(|| known.into_iter().find(|k| k.len() > 1 && name.text.starts_with(k)));
            let diagnostic = Diagnostic::error("E0204", name.span, format!("unknown unit `{}`", name.text))
                .label("not a unit")
                .note("lengths: mm um cm m in; angles: deg rad; pictures: px; shares: %");
            self.report(match help {
                Some(near) => diagnostic.suggest(format!("write `{} {near}`", q.number.text), name.span, near),
                None => diagnostic,
            });
            return None;
        };
        self.units.insert((name.span.file, name.span.start, name.span.end));
        Some(Typed { expr: Expr::Const(q.number.value * factor), quantity: Some(quantity) })
    }

    fn coerce(&mut self, typed: Typed, want: Quantity, span: Span) -> Option<Expr> {
        let scale = self.bare_scale(typed.quantity, want, span)?;
        Some(scaled(typed.expr, scale))
    }

    /// What a value of `quantity` is multiplied by where `want` is wanted.
    pub fn bare_scale(&mut self, quantity: Option<Quantity>, want: Quantity, span: Span) -> Option<f64> {
        match quantity {
            None => Some(self.file_scale(want, span)),
            Some(q) if q == want => Some(1.0),
            Some(q) => {
                self.wrong_quantity(want, q, span);
                None
            }
        }
    }

    pub fn wrong_quantity(&mut self, want: Quantity, got: Quantity, span: Span) {
        let message = format!("expected {}, this is {}", spoken(Some(want)), spoken(Some(got)));
        let unit = match want {
            Quantity::Length => "mm",
            Quantity::Angle => "deg",
            Quantity::Ratio => "%",
            Quantity::Pixels => "px",
        };
        let fault = Diagnostic::error("E0205", span, message).label(format!(
            "{}, not {}",
            spoken(Some(got)),
            spoken(Some(want))
        ));
        let inside = self.units.range((span.file, span.start, 0)..(span.file, span.end, 0));
        let places: Vec<Span> = inside.map(|&(file, start, end)| Span { file, start, end }).collect();
        let title = format!("its unit is `{unit}`");
        self.report(match places.is_empty() {
            true => fault.help(title),
            false => {
                let fix = Fix::new(title, Applicability::MaybeIncorrect);
                fault.with_fix(places.into_iter().fold(fix, |fix, place| fix.edit(place, unit)))
            }
        });
    }

    /// Refuses arithmetic that has no value at nominal or somewhere within the limits.
    fn finite(&mut self, expr: Expr, quantity: Quantity, span: Span) -> Option<Expr> {
        let range = bounds(&expr, &|id| self.dims[id.0 as usize].range);
        let nominal = expr.eval(&self.nominal);
        self.in_bounds(Range { nominal, ..range }, quantity, span).map(|_| expr)
    }

    fn in_bounds(&mut self, range: Range, quantity: Quantity, span: Span) -> Option<Range> {
        let (largest, unit) = if quantity == Quantity::Length { (LONGEST, " mm") } else { (LARGEST, "") };
        let good = [range.low, range.nominal, range.high].iter().all(|v| v.is_finite() && v.abs() <= largest);
        if good {
            return Some(range);
        }
        let message = match range {
            Range { nominal, .. } if !nominal.is_finite() => "this arithmetic has no value".to_string(),
            Range { low, high, .. } if !(low.is_finite() && high.is_finite()) => {
                "this arithmetic has no value at some limit of its dimensions".to_string()
            }
            Range { low, high, .. } => format!("{:e}{unit} is beyond every drawing", high.abs().max(low.abs())),
        };
        let help = format!("it may reach ±{largest:e}{unit}, and nothing may be divided by zero");
        self.report(Diagnostic::error("E0210", span, message).label("no usable number").help(help));
        None
    }
}

/// A number without the noise of its last bits.
pub fn trim(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// With its article, for messages.
pub fn spoken(quantity: Option<Quantity>) -> &'static str {
    match quantity {
        Some(Quantity::Length) => "a length",
        Some(Quantity::Angle) => "an angle",
        Some(Quantity::Ratio) => "a ratio",
        Some(Quantity::Pixels) => "a number of pixels",
        None => "a number",
    }
}
