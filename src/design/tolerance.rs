//! Tolerances: from what stands behind a size to its limits.
//!
//! In: a dimension as written. Out: [`Limited`], a range in the size's own terms: a bare size stays bare, and whoever asked
//! scales it. Deviations, limits, fits, stated conditions and the general tolerances of the title block.

use super::dimension::{trim, unit};
use super::scope::{Remark, Resolver, Use};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::iso::{self, FitError};
use crate::syntax::ast::{self, Size, Tolerance};
use crate::units::{Quantity, Range};

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
pub struct Limited {
    pub range: Range,
    /// `None` for a bare number, which takes the quantity of its place.
    pub quantity: Option<Quantity>,
    pub remark: Remark,
}

impl Resolver {
    /// The limits a dimension states, or those that general tolerances give it.
    pub fn limited(&mut self, dim: &ast::Dim, general: General, want: Option<Quantity>) -> Option<Limited> {
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
                    self.reversed(dim, [upper, lower], unit.as_ref());
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
                    let fault = Diagnostic::error("E0301", dim.span, message).label("limits reversed");
                    self.report(match &dim.size {
                        Size::Quantity(first) => {
                            let limits = format!("{} .. {}", written(q), written(first));
                            let each = if dim.each { " each" } else { "" };
                            fault.fix(format!("write `{limits}`"), dim.span, limits + each)
                        }
                        _ => fault.help("write the smaller limit first"),
                    });
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
                let fault = Diagnostic::error("E0302", class.span, format!("no ISO 286 class `{}`", class.text))
                    .label("unknown class")
                    .note("a class is a letter and a grade, such as `H7` for a hole or `g6` for a shaft")
                    .note("known: d e f g h js k m n p and D to P, grades 4 to 12");
                match nearest_class(&class.text, nominal) {
                    Some(near) => fault.meant(class.span, &near),
                    None => fault,
                }
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
        let mut spans = [(span, span); 3];
        for (name, written) in states {
            let own = written.unit.clone().or(unit.cloned());
            let typed = self.quantity(&ast::Quantity { unit: own, ..written.clone() })?;
            let slot = ["mmc", "nominal", "lmc"].iter().position(|s| *s == name.text)?;
            if values[slot].replace(typed.expr.eval(&[])).is_some() {
                let message = format!("`{}` is given twice", name.text);
                self.report(Diagnostic::error("E0202", name.span, message).label("given again"));
                return None;
            }
            spans[slot] = (name.span, written.span);
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
            let fault = Diagnostic::error("E0306", span, message).label("nominal outside its limits");
            let middle = trim((mmc + lmc) / 2.0).to_string();
            // With units of their own the limits are in mm already, and the text is not.
            self.report(match quantity {
                None => fault.suggest(format!("write `nominal {middle}`, their middle"), spans[1].1, middle),
                Some(_) => fault.help("give a nominal size between them"),
            });
            return None;
        }
        let words = [spans[0].0, spans[2].0];
        let remark = Remark { states: Some([mmc, lmc]), state_words: Some(words), ..Remark::default() };
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
                            .suggest("`basic` for exactly this size", behind(dim), " basic")
                            .suggest("limits of its own", behind(dim), " ±0.1"),
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

    fn reversed(&mut self, dim: &ast::Dim, [upper, lower]: [&ast::Number; 2], unit: Option<&ast::Name>) {
        let [upper, lower] = [&upper.text, &lower.text];
        let message = format!("the upper deviation {upper} is below the lower deviation {lower}");
        let fault = Diagnostic::error("E0301", dim.span, message).label("deviations reversed");
        let title = format!("swap them: `{lower}/{upper}`");
        self.report(match &dim.size {
            Size::Quantity(size) => {
                let unit = unit.map(|u| format!(" {}", u.text)).unwrap_or_default();
                let each = if dim.each { " each" } else { "" };
                fault.fix(title, dim.span, format!("{} {lower}/{upper}{unit}{each}", written(size)))
            }
            _ => fault.help(title),
        });
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
        let number = deviation;
        let deviation = deviation * factor(own.or(q.unit.as_ref())).unwrap_or(self.title(dim.span).length);
        if deviation <= DOUBTFUL_SHARE * size.abs() {
            return;
        }
        let share = 100.0 * deviation / size.abs();
        let message = format!("the tolerance of {owner} is {share:.0} % of its size");
        let warning = Diagnostic::warning("W0310", dim.span, message).label("a wide tolerance").note(format!(
            "limits say that it is meant: `{} .. {}`",
            trim(size - deviation),
            trim(size + deviation)
        ));
        let (title, in_um) = (format!("did you mean `{text} um`?"), 1e-3 * number <= DOUBTFUL_SHARE * size.abs());
        self.report(match own {
            _ if !in_um => warning,
            None if !dim.each => warning.suggest(title, Span { start: dim.span.end, ..dim.span }, " um"),
            None => warning.help(title),
            Some(unit) => warning.suggest(title, unit.span, "um"),
        });
    }
}

/// A quantity as it is written.
fn written(q: &ast::Quantity) -> String {
    match &q.unit {
        Some(unit) => format!("{} {}", q.number.text, unit.text),
        None => q.number.text.clone(),
    }
}

/// The place of a tolerance behind a size without one.
fn behind(dim: &ast::Dim) -> Span {
    let each = if dim.each { " each".len() as u32 } else { 0 };
    Span { start: dim.span.end - each, end: dim.span.end - each, ..dim.span }
}

/// The class that is nearest to a word, of those that exist for the size.
fn nearest_class(word: &str, size: f64) -> Option<String> {
    let letters = ["d", "e", "f", "g", "h", "js", "k", "m", "n", "p"];
    let classes = letters.iter().flat_map(|l| (4..=12).map(move |grade| format!("{l}{grade}")));
    let classes: Vec<String> = classes.flat_map(|c| [c.to_uppercase(), c]).collect();
    let known = classes.iter().filter(|class| iso::fit(class, size).is_ok()).map(String::as_str);
    nearest(word, known).map(str::to_string)
}
