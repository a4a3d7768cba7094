//! Dimensions: from what stands on the drawing to numbers with limits.
//!
//! In: a dimension as written, and the quantity its place wants. Out: an [`Expr`] (a constant, a row of the table of
//! dimensions, or arithmetic over rows) or a [`Range`]. A bare number has the unit of its file; a bare deviation that of
//! the size it belongs to; a deviation in % is a share of the nominal value.

use super::interval::bounds;
use super::model::Expr;
use super::scope::{Named, Remark, Resolver, Typed, Use};
use super::sum::scaled;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::iso::{self, FitError};
use crate::syntax::ast::{self, Size, Tolerance};
use crate::units::{Quantity, Range};

/// Larger numbers (mm, rad, px) are slips of the pen or overflow.
const LARGEST: f64 = 1e9;
/// Longer lengths (mm) are, too: a kilometre, where a solid could no longer be told to a thousandth of a micrometre.
const LONGEST: f64 = 1e6;

/// Deviations above this share of the size are probably in the wrong unit.
const DOUBTFUL_SHARE: f64 = 0.1;

/// An angle in a `let` does not know its legs: the general tolerance is that of the shortest (mm).
const UNKNOWN_LEG: f64 = 10.0;

/// What becomes of a number without a tolerance of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum General {
    /// The file's general tolerance: sizes.
    Applies,
    /// That of broken edges: radii of rounded corners, chamfers.
    Edge,
    /// Exact: positions, patterns, stations.
    Basic,
}

/// A dimension with limits of its own.
struct Limited {
    range: Range,
    quantity: Option<Quantity>,
    remark: Remark,
}

/// The unit of a name, as quantity and factor to mm, rad, 1 or px.
fn unit(name: &str) -> Option<(Quantity, f64)> {
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

impl Resolver {
    /// The value of a dimension in a place that wants `want`. Limits of its own make a row named `name`.
    pub fn dimension(&mut self, dim: &ast::Dim, want: Quantity, general: General, name: &str) -> Option<Expr> {
        let typed = self.value(dim, Use::Shared, general, name, Some(want))?;
        let expr = self.coerce(typed, want, dim.span)?;
        self.finite(expr, want, dim.span)
    }

    /// The range of a value that is not sampled with the parts: a material, a camera, a lamp.
    pub fn range(&mut self, dim: &ast::Dim, want: Quantity) -> Option<Range> {
        let limited = self.limited(dim, General::Basic, Some(want))?;
        let scale = self.bare_scale(limited.quantity, want, dim.span)?;
        let scaled = |v: f64| v * scale;
        let Range { low, nominal, high } = limited.range;
        let range = Range { low: scaled(low), nominal: scaled(nominal), high: scaled(high) };
        self.in_bounds(range, want, dim.span)
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
        Some(Typed { expr: self.finite(expr, quantity, named.dim.span)?, quantity: Some(quantity) })
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

    /// The limits a dimension states, or those that general tolerances give it.
    fn limited(&mut self, dim: &ast::Dim, general: General, want: Option<Quantity>) -> Option<Limited> {
        if let Size::States { states, unit } = &dim.size {
            return self.states(states, unit.as_ref(), dim.span);
        }
        let size = match (&dim.size, &dim.tolerance) {
            (Size::Quantity(q), Some(Tolerance::Limits(other))) if q.unit.is_none() => {
                self.quantity(&ast::Quantity { unit: other.unit.clone(), ..q.clone() })?
            }
            (Size::Quantity(q), _) => self.quantity(q)?,
            (Size::Sum(sum), _) => self.sum(sum, Use::Nominal)?,
            (Size::Path(path), _) => self.lookup(path, Use::Nominal)?,
            (Size::States { .. }, _) => return None,
        };
        // Nominal expressions hold constants only.
        let (nominal, quantity) = (size.expr.eval(&[]), size.quantity);
        let limited = |range| Some(Limited { range, quantity, remark: Remark::default() });
        match &dim.tolerance {
            Some(Tolerance::Basic) => limited(Range::exactly(nominal)),
            Some(tolerance) => self.toleranced(dim, nominal, quantity, tolerance, want),
            None => limited(self.general_range(dim, nominal, quantity.or(want), general)?),
        }
    }

    fn toleranced(
        &mut self,
        dim: &ast::Dim,
        nominal: f64,
        quantity: Option<Quantity>,
        tolerance: &Tolerance,
        want: Option<Quantity>,
    ) -> Option<Limited> {
        let limited = |range| Some(Limited { range, quantity, remark: Remark::default() });
        match tolerance {
            Tolerance::PlusMinus(q) => {
                let inherited = self.size_scale(dim, quantity);
                let deviation = self.deviation(q, nominal, quantity, want, inherited)?.abs();
                limited(Range::symmetric(nominal, deviation))
            }
            Tolerance::Deviations { upper, lower, unit } => {
                let [high, low] = [upper, lower].map(|number| {
                    let q = ast::Quantity { number: number.clone(), unit: unit.clone(), span: dim.span };
                    let inherited = self.size_scale(dim, quantity);
                    self.deviation(&q, nominal, quantity, want, inherited)
                });
                let (high, low) = (high?, low?);
                if high < low {
                    self.reversed(dim.span, &upper.text, &lower.text);
                    return None;
                }
                limited(Range::about(nominal, nominal + low, nominal + high))
            }
            Tolerance::Limits(q) => {
                let own = match &dim.size {
                    Size::Quantity(size) => q.unit.clone().or_else(|| size.unit.clone()),
                    _ => q.unit.clone(),
                };
                let other = self.quantity(&ast::Quantity { unit: own, ..q.clone() })?;
                let high = self.same_scale(other, quantity, q.span, want)?;
                if high < nominal {
                    let message = format!("the upper limit {} is below the lower limit", q.number.text);
                    self.report(
                        Diagnostic::error("E0301", dim.span, message)
                            .label("limits reversed")
                            .help(format!("write the smaller limit first: `{} .. …`", q.number.text)),
                    );
                    return None;
                }
                limited(Range { low: nominal, nominal: (nominal + high) / 2.0, high })
            }
            Tolerance::Fit(class) => self.fit(dim, nominal, quantity.or(want), class),
            Tolerance::Basic => limited(Range::exactly(nominal)),
        }
    }

    /// A fit makes a length in mm of its size.
    fn fit(&mut self, dim: &ast::Dim, nominal: f64, quantity: Option<Quantity>, class: &ast::Name) -> Option<Limited> {
        if quantity.is_some_and(|q| q != Quantity::Length) {
            let message = format!("`{}` is a fit, and only lengths have fits", class.text);
            self.report(Diagnostic::error("E0205", dim.span, message).label("not a length"));
            return None;
        }
        let bare = matches!(&dim.size, Size::Quantity(q) if q.unit.is_none());
        let nominal = if bare { nominal * self.title(dim.span).length } else { nominal };
        let [low, high] = match iso::fit(&class.text, nominal) {
            Ok(deviations) => deviations,
            Err(error) => {
                self.no_fit(error, class, nominal);
                return None;
            }
        };
        let range = Range::about(nominal, nominal + low, nominal + high);
        let remark = Remark { fit: Some((class.text.clone(), class.span)), ..Remark::default() };
        Some(Limited { range, quantity: Some(Quantity::Length), remark })
    }

    fn no_fit(&mut self, error: FitError, class: &ast::Name, nominal: f64) {
        let diagnostic = match error {
            FitError::UnknownClass => {
                Diagnostic::error("E0302", class.span, format!("no ISO 286 class `{}`", class.text))
                    .label("unknown class")
                    .help("a class is a letter and a grade, such as `H7` for a hole or `g6` for a shaft")
                    .note("known: d e f g h js k m n p and D to P, grades 4 to 12")
            }
            FitError::OutsideTable => {
                let message = format!("fits cover sizes over 0 up to {} mm, this is {nominal} mm", iso::LARGEST);
                Diagnostic::error("E0303", class.span, message)
                    .label("no deviations for this size")
                    .help("give the deviations: `+0.07/0`")
            }
        };
        self.report(diagnostic);
    }

    fn states(
        &mut self,
        states: &[(ast::Name, ast::Quantity)],
        unit: Option<&ast::Name>,
        span: Span,
    ) -> Option<Limited> {
        let mut values: [Option<f64>; 3] = [None; 3];
        let mut quantity = None;
        for (name, written) in states {
            let own = written.unit.clone().or(unit.cloned());
            let typed = self.quantity(&ast::Quantity { unit: own, ..written.clone() })?;
            let slot = ["mmc", "nominal", "lmc"].iter().position(|s| *s == name.text)?;
            if values[slot].replace(typed.expr.eval(&[])).is_some() {
                let message = format!("`{}` is given twice", name.text);
                self.report(Diagnostic::error("E0202", name.span, message).label("given again"));
                return None;
            }
            quantity = typed.quantity;
        }
        let [Some(mmc), nominal, Some(lmc)] = values else {
            let message = "`mmc` and `lmc` are both needed";
            self.report(Diagnostic::error("E0207", span, message).help("write `{ mmc 19.8, nominal 20.0, lmc 20.3 }`"));
            return None;
        };
        let nominal = nominal.unwrap_or((mmc + lmc) / 2.0);
        let (low, high) = (mmc.min(lmc), mmc.max(lmc));
        if !(low..=high).contains(&nominal) {
            let message = format!("the nominal size {nominal} lies outside {low} .. {high}");
            self.report(
                Diagnostic::error("E0306", span, message)
                    .label("nominal outside its limits")
                    .help(format!("write `{{ mmc {mmc}, nominal {}, lmc {lmc} }}`", trim((mmc + lmc) / 2.0))),
            );
            return None;
        }
        let remark = Remark { states: Some([mmc, lmc]), ..Remark::default() };
        Some(Limited { range: Range { low, nominal, high }, quantity, remark })
    }

    fn general_range(
        &mut self,
        dim: &ast::Dim,
        nominal: f64,
        quantity: Option<Quantity>,
        general: General,
    ) -> Option<Range> {
        let title = self.title(dim.span);
        let bare = matches!(&dim.size, Size::Quantity(q) if q.unit.is_none());
        let Some(class) = title.general.filter(|_| general != General::Basic) else {
            return Some(Range::exactly(nominal));
        };
        match quantity.unwrap_or(Quantity::Length) {
            Quantity::Length => {
                let scale = if bare { title.length } else { 1.0 };
                let table = if general == General::Edge { iso::general_edge } else { iso::general_linear };
                let Some(deviation) = table(class, nominal.abs() * scale) else {
                    let message = format!("ISO 2768 has no general tolerance for {} mm", nominal * scale);
                    self.report(
                        Diagnostic::error("E0303", dim.span, message)
                            .label("needs a tolerance of its own")
                            .help(format!("write `{nominal} ±0.1`, or `{nominal} basic` for exactly this size")),
                    );
                    return None;
                };
                Some(Range::symmetric(nominal, deviation / scale))
            }
            Quantity::Angle => {
                let scale = if bare { title.angle } else { 1.0 };
                Some(Range::symmetric(nominal, iso::general_angular(class, UNKNOWN_LEG) / scale))
            }
            _ => Some(Range::exactly(nominal)),
        }
    }

    /// What a bare deviation is multiplied by to be in the terms of the size: the size's own unit, or its file's.
    fn size_scale(&self, dim: &ast::Dim, quantity: Option<Quantity>) -> f64 {
        match (&dim.size, quantity) {
            (Size::Quantity(q), Some(_)) => {
                q.unit.as_ref().and_then(|u| unit(&u.text)).map_or(1.0, |(_, factor)| factor)
            }
            (_, Some(q)) => self.file_scale(q, dim.span),
            (_, None) => 1.0,
        }
    }

    /// A deviation in the terms of the size: mm or rad when the size has a quantity, else bare.
    fn deviation(
        &mut self,
        q: &ast::Quantity,
        nominal: f64,
        quantity: Option<Quantity>,
        want: Option<Quantity>,
        inherited: f64,
    ) -> Option<f64> {
        if q.unit.as_ref().is_some_and(|u| u.text == "%") {
            return Some(q.number.value / 100.0 * nominal.abs());
        }
        if q.unit.is_none() {
            return Some(q.number.value * inherited);
        }
        let typed = self.quantity(q)?;
        self.same_scale(typed, quantity, q.span, want)
    }

    /// A second number of a dimension in the terms of the first.
    fn same_scale(&mut self, other: Typed, first: Option<Quantity>, span: Span, want: Option<Quantity>) -> Option<f64> {
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
            let known = ["mm", "um", "cm", "m", "in", "deg", "rad", "px"];
            let help = nearest(&name.text, known)
                .or_else(|| known.into_iter().find(|k| k.len() > 1 && name.text.starts_with(k)));
            let diagnostic = Diagnostic::error("E0204", name.span, format!("unknown unit `{}`", name.text))
                .label("not a unit")
                .note("lengths: mm um cm m in; angles: deg rad; pictures: px; shares: %");
            self.report(match help {
                Some(near) => diagnostic.help(format!("write `{} {near}`", q.number.text)),
                None => diagnostic,
            });
            return None;
        };
        Some(Typed { expr: Expr::Const(q.number.value * factor), quantity: Some(quantity) })
    }

    fn coerce(&mut self, typed: Typed, want: Quantity, span: Span) -> Option<Expr> {
        let scale = self.bare_scale(typed.quantity, want, span)?;
        Some(scaled(typed.expr, scale))
    }

    /// What a value of `quantity` is multiplied by where `want` is wanted.
    fn bare_scale(&mut self, quantity: Option<Quantity>, want: Quantity, span: Span) -> Option<f64> {
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
        self.report(
            Diagnostic::error("E0205", span, message)
                .label(format!("{}, not {}", spoken(Some(got)), spoken(Some(want))))
                .help(format!("its unit is `{unit}`")),
        );
    }

    fn reversed(&mut self, span: Span, upper: &str, lower: &str) {
        self.report(
            Diagnostic::error(
                "E0301",
                span,
                format!("the upper deviation {upper} is below the lower deviation {lower}"),
            )
            .label("deviations reversed")
            .help(format!("swap them: `{lower}/{upper}`")),
        );
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

    /// Warns of a deviation so large that its unit is probably wrong.
    pub fn doubt_tolerance(&mut self, dim: &ast::Dim, owner: &str) {
        let (Size::Quantity(q), Some(tolerance)) = (&dim.size, &dim.tolerance) else { return };
        let (deviation, text, own) = match tolerance {
            Tolerance::PlusMinus(d) => (d.number.value.abs(), format!("±{}", d.number.text), d.unit.as_ref()),
            Tolerance::Deviations { upper, lower, unit } => {
                (upper.value.abs().max(lower.value.abs()), format!("{}/{}", upper.text, lower.text), unit.as_ref())
            }
            _ => return,
        };
        if own.is_some_and(|u| u.text == "%") {
            return;
        }
        let factor = |u: Option<&ast::Name>| u.and_then(|u| unit(&u.text)).map(|(_, f)| f);
        let size = q.number.value * factor(q.unit.as_ref()).unwrap_or(self.title(dim.span).length);
        let deviation = deviation * factor(own.or(q.unit.as_ref())).unwrap_or(self.title(dim.span).length);
        if deviation <= DOUBTFUL_SHARE * size.abs() {
            return;
        }
        let share = 100.0 * deviation / size.abs();
        let message = format!("the tolerance of {owner} is {share:.0} % of its size");
        self.report(Diagnostic::warning("W0310", dim.span, message).label("a wide tolerance").help(format!(
            "did you mean `{text} um`? Limits say that it is meant: `{} .. {}`",
            trim(size - deviation),
            trim(size + deviation)
        )));
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
