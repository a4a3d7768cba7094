//! Named values: the arguments of a call and the lines of a block, read alike.
//!
//! In: `name = value` pairs. Out: single values in mm, rad and plain numbers, with a diagnostic for every name that is
//! unknown, given twice or missing.

use super::dimension::trim;
use super::elsewhere;
use super::feature::Names;
use super::model::Expr;
use super::scope::Resolver;
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{Args, Body, Dim, Name, Point, Size, Stmt, Tolerance, Value};
use crate::units::{Quantity, Range};

/// The fields of one call or block.
pub struct Fields<'a> {
    /// `cylinder`, `camera`: what takes the fields.
    pub owner: String,
    pub span: Span,
    /// Where one more field can be written, and what comes before it.
    end: Option<(Span, &'static str)>,
    list: Vec<(&'a Name, &'a Value)>,
}

impl<'a> Fields<'a> {
    pub fn of_args(owner: &Name, args: &'a Args) -> Self {
        let list: Vec<_> = args.list.iter().map(|arg| (&arg.key, &arg.value)).collect();
        let end = list.last().map(|(_, value)| (behind(value.span()), ", "));
        Fields { owner: owner.text.clone(), span: owner.span, end, list }
    }

    pub fn of_body(owner: &str, span: Span, body: &'a Body) -> Self {
        let field = |line: &'a crate::syntax::ast::Line| match &line.stmt {
            Stmt::Field { key, value } => Some((key, value)),
            _ => None,
        };
        let list: Vec<_> = body.lines.iter().filter_map(field).collect();
        let end = list.last().map(|(_, value)| (behind(value.span()), "\n    "));
        Fields { owner: owner.to_string(), span, end, list }
    }

    pub fn none(owner: &str, span: Span) -> Self {
        Fields { owner: owner.to_string(), span, end: None, list: Vec::new() }
    }

    pub fn get(&self, key: &str) -> Option<&'a Value> {
        self.list.iter().find(|(name, _)| name.text == key).map(|(_, value)| *value)
    }
}

/// The empty span behind another.
fn behind(span: Span) -> Span {
    Span { start: span.end, ..span }
}

/// A word a field may hold, and what it means.
pub type Words<'w, T> = &'w [(&'w str, T)];

impl Resolver {
    /// Reports fields that are not in `known` and fields given twice.
    pub fn check_fields(&mut self, fields: &Fields, known: &[&str]) {
        for (i, (name, _)) in fields.list.iter().enumerate() {
            if let Some((first, _)) = fields.list[..i].iter().find(|(other, _)| other.text == name.text) {
                let message = format!("`{}` is given twice", name.text);
                self.report(
                    Diagnostic::error("E0202", name.span, message).label("given again").also(first.span, "given here"),
                );
            }
            if !known.contains(&name.text.as_str()) {
                self.unknown_field(fields, name, known);
            }
        }
    }

    fn unknown_field(&mut self, fields: &Fields, name: &Name, known: &[&str]) {
        let takes = known.iter().map(|k| format!("`{k}`")).collect::<Vec<_>>().join(", ");
        let message = format!("`{}` has no `{}`", fields.owner, name.text);
        let diagnostic = Diagnostic::error("E0206", name.span, message).label("unknown here");
        let taken = |key: &str| self.meant.iter().any(|(owner, meant)| *owner == fields.span && meant == key);
        let free: Vec<&str> = known.iter().copied().filter(|k| fields.get(k).is_none() && !taken(k)).collect();
        let is_radius = ["r", "radius", "rad"].contains(&name.text.as_str());
        if is_radius && free.contains(&"d") && !free.contains(&"r") {
            self.meant.push((fields.span, "d".to_string()));
            let diagnostic = diagnostic.note(format!("it takes {takes}"));
            return self.report(match fields.get(&name.text).and_then(doubled) {
                Some(text) => diagnostic.suggest(
                    format!("a diameter is twice the radius: write `d = {text}`"),
                    Span { end: fields.get(&name.text).map_or(name.span, Value::span).end, ..name.span },
                    format!("d = {text}"),
                ),
                None => diagnostic.help("a diameter is twice the radius: write it as `d`"),
            });
        }
        let near = elsewhere::field(&name.text, &free).first().copied();
        let near = near.or_else(|| nearest(&name.text, free.iter().copied()));
        self.meant.extend(near.map(|near| (fields.span, near.to_string())));
        if is_radius && near == Some("r") {
            // A circle has one of the two.
            self.meant.push((fields.span, "d".to_string()));
        }
        self.report(match (near, elsewhere::instead(&fields.owner, &name.text)) {
            (_, Some(instead)) => diagnostic.help(instead).note(format!("it takes {takes}")),
            (Some(near), None) => diagnostic.meant(name.span, near).note(format!("it takes {takes}")),
            (None, None) => diagnostic.help(format!("it takes {takes}")),
        });
    }

    /// Reports that a field is missing, with the line that would mend it.
    pub fn missing(&mut self, fields: &Fields, key: &str, example: &str) {
        // Given, but under a wrong name that is reported.
        if self.meant.iter().any(|(owner, meant)| *owner == fields.span && meant == key) {
            return;
        }
        let message = format!("`{}` needs `{key}`", fields.owner);
        let diagnostic = Diagnostic::error("E0207", fields.span, message).label(format!("`{key}` is missing"));
        let title = format!("write `{key} = {example}`");
        self.report(match fields.end {
            Some((at, separator)) => diagnostic.suggest(title, at, format!("{separator}{key} = {example}")),
            None => diagnostic.help(title),
        });
    }

    /// The dimension a field holds, or a diagnostic for what else it is.
    pub fn dim_of<'a>(&mut self, value: &'a Value) -> Option<&'a Dim> {
        match value {
            Value::Dim(dim) => Some(dim),
            other => {
                self.wrong_form(other.span(), "a number");
                None
            }
        }
    }

    /// Reports a value of another form than its field takes.
    pub fn wrong_form(&mut self, span: Span, wanted: &str) {
        let message = format!("expected {wanted}");
        self.report(Diagnostic::error("E0211", span, message).label(format!("not {wanted}")));
    }

    /// A range, or `default` when the field is not there.
    pub fn range_or(&mut self, fields: &Fields, key: &str, want: Quantity, default: Range) -> Range {
        let Some(value) = fields.get(key) else { return default };
        let Some(dim) = self.dim_of(value) else { return default };
        self.range(dim, want).unwrap_or(default)
    }

    /// A range whose limits lie in `low ..= high`.
    pub fn range_within(
        &mut self,
        fields: &Fields,
        key: &str,
        want: Quantity,
        default: Range,
        [low, high]: [f64; 2],
    ) -> Range {
        let range = self.range_or(fields, key, want, default);
        if range.low < low || range.high > high {
            self.out_of_range(fields, key, want, range, [low, high]);
            return default;
        }
        range
    }

    /// Reports a range beyond its bounds, in the unit of its file.
    fn out_of_range(&mut self, fields: &Fields, key: &str, want: Quantity, range: Range, [low, high]: [f64; 2]) {
        let span = fields.get(key).map_or(fields.span, Value::span);
        let scale = self.file_scale(want, span);
        let shown = |value: f64| trim(value / scale);
        let between = |low: f64, high: f64| match shown(low) == shown(high) {
            true => shown(low).to_string(),
            false => format!("{} .. {}", shown(low), shown(high)),
        };
        let most = match (shown(low) == 0.0 && low > 0.0, high < f64::MAX) {
            (true, false) => "more than 0".to_string(),
            (false, false) => format!("{} or more", shown(low)),
            (_, true) => between(low, high),
        };
        let message = format!("`{key}` must be {most}, this is {}", between(range.low, range.high));
        let fault = Diagnostic::error("E0211", span, message).label("out of range");
        // What of it lies within, where something does.
        let within = [range.low.max(low), range.high.min(high)];
        // Not where the bound itself is excluded.
        let good = shown(within[0]) * scale >= low && within[0] < within[1] && range.low < range.high;
        self.report(match good {
            true => {
                let text = between(within[0], within[1]);
                fault.suggest(format!("write `{key} = {text}`"), span, text)
            }
            false => fault,
        });
    }

    /// A number without limits, or `default`.
    pub fn exact_or(&mut self, fields: &Fields, key: &str, want: Quantity, default: f64, bounds: [f64; 2]) -> f64 {
        let range = self.range_within(fields, key, want, Range::exactly(default), bounds);
        if range.low < range.high {
            let span = fields.get(key).map_or(fields.span, Value::span);
            let message = format!("`{key}` is exact and takes no tolerance");
            let number = trim(range.nominal / self.file_scale(want, span));
            self.report(Diagnostic::error("E0211", span, message).label("one number").suggest(
                format!("write `{key} = {number}`"),
                span,
                number.to_string(),
            ));
        }
        range.nominal
    }

    /// A whole number in `low ..= high`, or `default`.
    pub fn whole_or(&mut self, fields: &Fields, key: &str, default: u64, [low, high]: [u64; 2]) -> u64 {
        let value = self.exact_or(fields, key, Quantity::Ratio, default as f64, [0.0, f64::MAX]);
        if value.fract() == 0.0 && (low as f64..=high as f64).contains(&value) {
            return value as u64;
        }
        let span = fields.get(key).map_or(fields.span, Value::span);
        let message = format!("`{key}` is a whole number from {low} to {high}, this is {value}");
        self.report(Diagnostic::error("E0211", span, message).label("out of range"));
        default
    }

    /// One of the words, or `default`.
    pub fn word_or<T: Copy>(&mut self, fields: &Fields, key: &str, words: Words<T>, default: T) -> T {
        let Some(value) = fields.get(key) else { return default };
        let text = match value {
            Value::Text(name) => Some(name.text.as_str()),
            Value::Dim(dim) => dim.word(),
            _ => None,
        };
        if let Some((_, meaning)) = words.iter().find(|(word, _)| Some(*word) == text) {
            return *meaning;
        }
        let list = words.iter().map(|(w, _)| format!("`{w}`")).collect::<Vec<_>>().join(", ");
        let diagnostic =
            Diagnostic::error("E0211", value.span(), format!("`{key}` is one of {list}")).label("not one of them");
        self.report(match text.and_then(|t| nearest(t, words.iter().map(|(w, _)| *w))) {
            Some(near) => diagnostic.meant(value.span(), near),
            None => diagnostic,
        });
        default
    }

    /// A point in mm without tolerances, or `default`.
    pub fn point_or(&mut self, fields: &Fields, key: &str, default: [f64; 3]) -> [f64; 3] {
        let Some(value) = fields.get(key) else { return default };
        let Value::Point(point) = value else {
            self.wrong_form(value.span(), "a point `(x, y, z)`");
            return default;
        };
        let ranges: Vec<Range> = point_dims(point).iter().filter_map(|dim| self.range(dim, Quantity::Length)).collect();
        match ranges.as_slice() {
            [x, y, z] if ranges.iter().all(|r| r.low == r.high) => [x.nominal, y.nominal, z.nominal],
            [_, _] => {
                self.wrong_form(value.span(), "three coordinates `(x, y, z)`");
                default
            }
            [_, _, _] => {
                self.wrong_form(value.span(), "coordinates without tolerance");
                default
            }
            _ => default,
        }
    }

    /// Three expressions; two coordinates have z = 0.
    pub fn point_exprs(&mut self, point: &Point, want: Quantity, names: &Names) -> Option<[Expr; 3]> {
        let mut exprs = Vec::new();
        for (dim, axis) in point_dims(point).iter().zip(["x", "y", "z"]) {
            exprs.push(self.dimension(dim, want, General::Basic, &names.of(axis, dim.each)));
        }
        let mut exprs = exprs.into_iter();
        let [x, y] = [exprs.next()??, exprs.next()??];
        let z = exprs.next().unwrap_or(Some(Expr::Const(0.0)))?;
        Some([x, y, z])
    }
}

/// A size without limits, or with a fit, twice as large.
fn doubled(value: &Value) -> Option<String> {
    let Value::Dim(Dim { size: Size::Quantity(q), tolerance, .. }) = value else { return None };
    let unit = q.unit.as_ref().map_or(String::new(), |unit| format!(" {}", unit.text));
    let fit = match tolerance {
        None => String::new(),
        Some(Tolerance::Fit(class)) => format!(" {}", class.text),
        Some(_) => return None,
    };
    Some(format!("{}{unit}{fit}", trim(2.0 * q.number.value)))
}

/// The coordinates, each with the unit behind the parentheses unless it has its own.
pub fn point_dims(point: &Point) -> Vec<Dim> {
    let with_unit = |dim: &Dim| {
        let mut dim = dim.clone();
        if let (crate::syntax::ast::Size::Quantity(q), Some(unit)) = (&mut dim.size, &point.unit)
            && q.unit.is_none()
        {
            q.unit = Some(unit.clone());
        }
        dim
    };
    point.dims.iter().map(with_unit).collect()
}
