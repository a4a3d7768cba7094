//! Families: a part drawn once with tables of its sizes, and the members taken from it.
//!
//! In: `part screw = iso4762(d = M6, l = 20)` and the family it names. Out: the names that its drawing knows for this
//! member: its parameters, and the columns of the chosen rows. A parameter with a table takes a size of that table,
//! another takes any length. Nothing else of a family is evaluated: sizes that nobody asks for cost nothing.

use super::dimension::trim;
use super::fields::Fields;
use super::library;
use super::model::Expr;
use super::part::PartSource;
use super::scope::{Named, Resolver, Typed};
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Name, Size, Stmt, Value};
use crate::units::Quantity;
use std::collections::BTreeMap;

/// A part with parameters, as written.
#[derive(Debug, Clone, Copy)]
pub struct Family<'a> {
    pub name: &'a Name,
    pub params: &'a [Name],
    pub body: &'a ast::Body,
}

/// Which member of a family a part is.
#[derive(Debug, Clone, Copy)]
pub struct Member<'a> {
    /// `None` when there is no such family.
    pub family: Option<Family<'a>>,
    pub call: &'a ast::Call,
}

/// A table of a family: what each size of one parameter means.
struct Table<'a> {
    name: &'a Name,
    columns: &'a [Name],
    rows: Vec<(&'a Name, &'a [ast::Dim])>,
}

impl<'a> Table<'a> {
    fn all(body: &'a ast::Body) -> impl Iterator<Item = Table<'a>> {
        body.lines.iter().filter_map(|line| match &line.stmt {
            Stmt::Table { name, columns, body } => Some(Table { name, columns, rows: rows(body) }),
            _ => None,
        })
    }

    fn of(family: Family<'a>, param: &str) -> Option<Table<'a>> {
        Table::all(family.body).find(|table| table.name.text == param)
    }
}

fn rows(body: &ast::Body) -> Vec<(&Name, &[ast::Dim])> {
    let row = body.lines.iter().filter_map(|line| match &line.stmt {
        Stmt::Row { key, cells } => Some((key, cells.as_slice())),
        _ => None,
    });
    row.collect()
}

impl Resolver {
    /// The part that a member is; one without features when there is no such family, which is reported.
    pub fn member<'a>(
        &mut self,
        name: &'a Name,
        call: &'a ast::Call,
        families: &BTreeMap<&'a str, Family<'a>>,
    ) -> PartSource<'a> {
        const NOTHING: &ast::Body = &ast::Body { open: None, lines: Vec::new(), end: Vec::new() };
        let family = families.get(call.name.text.as_str()).copied();
        match family {
            Some(_) => drop(self.used_families.insert(call.name.text.clone())),
            None => self.unknown_family(&call.name, families),
        }
        PartSource { name, body: family.map_or(NOTHING, |f| f.body), member: Some(Member { family, call }) }
    }

    fn unknown_family(&mut self, name: &Name, families: &BTreeMap<&str, Family>) {
        if let Some(kind) = self.kinds.get(&name.text).copied() {
            let message = format!("expected a family of parts, `{}` is a {kind}", name.text);
            let diagnostic = Diagnostic::error("E0203", name.span, message).label(format!("a {kind} without sizes"));
            return self.report(diagnostic.help(format!("place `{}` as it is", name.text)));
        }
        let diagnostic = Diagnostic::error("E0201", name.span, format!("no family of parts is named `{}`", name.text))
            .label("unknown family");
        let known = families.keys().copied();
        self.report(match (library::home_of(&name.text), nearest(&name.text, known)) {
            (Some(file), _) => diagnostic.help(format!("write `use \"{file}\"` in the title block")),
            (None, Some(near)) => diagnostic.help(format!("did you mean `{near}`?")),
            (None, None) => match library::nearest_family(&name.text) {
                Some((near, file)) => diagnostic.help(format!("did you mean `{near}`, of `use \"{file}\"`?")),
                None => diagnostic.help(format!("draw it: `part {}(d) {{ … }}`", name.text)),
            },
        });
    }

    /// What the names of a family's drawing stand for in one member; `None` where a size is not to be had.
    pub fn member_names(&mut self, member: Member, path: &str) -> Option<BTreeMap<String, Named>> {
        let Member { family: Some(family), call } = member else { return None };
        let fields = Fields::of_args(&call.name, &call.args);
        let known: Vec<&str> = family.params.iter().map(|p| p.text.as_str()).chain(["material"]).collect();
        let faults = self.diagnostics.len();
        self.check_fields(&fields, &known);
        self.check_tables(family);
        let mut names = BTreeMap::new();
        for param in family.params {
            let Some(value) = fields.get(&param.text) else {
                self.missing(&fields, &param.text, &example(family, &param.text));
                continue;
            };
            match Table::of(family, &param.text) {
                Some(table) => self.sized(&table, param, value, family, path, &mut names),
                None => self.measured(param, value, path, &mut names),
            }
        }
        (!self.diagnostics[faults..].iter().any(Diagnostic::is_error)).then_some(names)
    }

    /// A parameter without a table: a length, exact unless it says otherwise, drawn for each piece.
    fn measured(&mut self, param: &Name, value: &Value, path: &str, names: &mut BTreeMap<String, Named>) {
        let Some(dim) = self.dim_of(value) else { return };
        let own = format!("{path}.{}", param.text);
        let Some(shared) = self.dimension(dim, Quantity::Length, General::Basic, &own) else { return };
        let nominal = Expr::Const(shared.eval(&self.nominal));
        let typed = |expr| Typed { expr, quantity: Some(Quantity::Length) };
        self.named_once(names, param, Named::given(param, dim, own, typed(shared), typed(nominal)));
    }

    /// A parameter with a table: its size, and the cells of that row under the names of their columns.
    fn sized(
        &mut self,
        table: &Table,
        param: &Name,
        value: &Value,
        family: Family,
        path: &str,
        names: &mut BTreeMap<String, Named>,
    ) {
        self.mark_used(param.span);
        let Some(wanted) = self.designation(value) else { return };
        let Some((key, cells)) = table.rows.iter().find(|(key, _)| wanted.is(&key.text)) else {
            return self.no_size(table, &wanted, family, value.span());
        };
        if let Some(pitch) = wanted.pitch {
            self.check_pitch(table, (*key, *cells), pitch, family, value.span());
        }
        let size = number_of(&key.text) * self.file_scale(Quantity::Length, key.span);
        let typed = || Typed { expr: Expr::Const(size), quantity: Some(Quantity::Length) };
        let Value::Dim(dim) = value else { return };
        let own = format!("{path}.{}", param.text);
        self.named_once(names, param, Named::given(param, dim, own, typed(), typed()));
        for (column, cell) in table.columns.iter().zip(*cells) {
            let own = format!("{path}.{}", column.text);
            self.named_once(names, column, Named::new(column, cell, own));
        }
    }

    fn named_once(&mut self, names: &mut BTreeMap<String, Named>, name: &Name, named: Named) {
        match names.get(&name.text) {
            Some(first) => {
                let first = first.span;
                self.duplicate("dimension", name, first);
            }
            None => {
                names.insert(name.text.clone(), named);
            }
        }
    }

    /// What a size is called: `6`, `M6`, or the value of a named dimension.
    fn designation(&mut self, value: &Value) -> Option<Wanted> {
        let dim = self.dim_of(value)?;
        if dim.tolerance.is_some() || dim.each {
            let message = "a size of a table takes no tolerance: its tolerances stand in the table";
            self.report(Diagnostic::error("E0211", dim.span, message).label("choose a size"));
            return None;
        }
        match &dim.size {
            Size::Quantity(q) if q.unit.is_none() => {
                Some(Wanted { text: q.number.text.clone(), value: q.number.value, thread: false, pitch: None })
            }
            Size::Path(path) if path.word().and_then(thread_of).is_some() => {
                let (value, pitch) = path.word().and_then(thread_of)?;
                Some(Wanted { value, text: path.word()?.to_string(), thread: true, pitch })
            }
            _ => {
                let expr = self.dimension(dim, Quantity::Length, General::Basic, "size")?;
                let value = trim(expr.eval(&self.nominal));
                Some(Wanted { text: value.to_string(), value, thread: false, pitch: None })
            }
        }
    }

    /// Reports a thread of another pitch than the one its row holds: its limits stand in no table here.
    fn check_pitch(
        &mut self,
        table: &Table,
        (key, cells): (&Name, &[ast::Dim]),
        pitch: f64,
        family: Family,
        span: Span,
    ) {
        let column = table.columns.iter().position(|column| column.text == "pitch");
        let own = column.and_then(|at| match &cells.get(at)?.size {
            Size::Quantity(q) => Some((q.number.value, q.number.text.as_str())),
            _ => None,
        });
        let label = match own {
            Some((own, _)) if own == pitch => return,
            Some((_, text)) => format!("the pitch of its `{}` is {text}", key.text),
            None => format!("its `{}` has no pitch of its own", key.text),
        };
        let message = format!("`{}` has no `{}` with a pitch of {}", family.name.text, key.text, trim(pitch));
        self.report(Diagnostic::error("E0214", span, message).label(label).meant(span, &key.text));
    }

    fn no_size(&mut self, table: &Table, wanted: &Wanted, family: Family, span: Span) {
        let message = format!("`{}` has no `{} = {}`", family.name.text, table.name.text, wanted.text);
        let distance = |key: &Name| (number_of(&key.text) - wanted.value).abs();
        let near = table.rows.iter().map(|(key, _)| *key).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let sizes: Vec<&str> = table.rows.iter().map(|(key, _)| key.text.as_str()).collect();
        let diagnostic = Diagnostic::error("E0214", span, message).label("not in its table");
        self.report(match near {
            Some(near) => diagnostic.help(format!("did you mean `{}`?", near.text)).note(format!(
                "`{}` is one of {}",
                table.name.text,
                sizes.join(", ")
            )),
            None => diagnostic,
        });
    }

    /// Reports tables that belong to no parameter, rows that are too short or too long, and sizes that stand there twice.
    fn check_tables(&mut self, family: Family) {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        for table in Table::all(family.body) {
            match seen.get(table.name.text.as_str()) {
                Some(first) => {
                    let first = *first;
                    self.duplicate("table", table.name, first);
                }
                None if !family.params.iter().any(|p| p.text == table.name.text) => self.no_param(&table, family),
                None => {}
            }
            seen.insert(&table.name.text, table.name.span);
            self.check_rows(&table);
        }
    }

    fn no_param(&mut self, table: &Table, family: Family) {
        let params = family.params.iter().map(|p| p.text.as_str());
        let message = format!("`{}` has no parameter `{}`", family.name.text, table.name.text);
        let diagnostic = Diagnostic::error("E0201", table.name.span, message).label("a table of nothing");
        let near = nearest(&table.name.text, params.clone()).or(params.clone().next());
        self.report(match near {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
            None => diagnostic,
        });
    }

    fn check_rows(&mut self, table: &Table) {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        for (key, cells) in &table.rows {
            if let Some(first) = seen.insert(key.text.trim_start_matches('M'), key.span) {
                let message = format!("size `{}` stands twice in table `{}`", key.text, table.name.text);
                self.report(
                    Diagnostic::error("E0202", key.span, message).label("again").also(first, "first stands here"),
                );
            }
            if cells.len() != table.columns.len() {
                let count = |n: usize| format!("{n} {}", if n == 1 { "cell" } else { "cells" });
                let columns: Vec<&str> = table.columns.iter().map(|c| c.text.as_str()).collect();
                let message =
                    format!("row `{}` has {}, the table has {} columns", key.text, count(cells.len()), columns.len());
                let first = table.columns.first().map_or(table.name.span, |c| c.span);
                self.report(
                    Diagnostic::error("E0211", key.span, message)
                        .label(count(cells.len()))
                        .also(first, format!("columns: {}", columns.join(", "))),
                );
            }
        }
    }

    /// Reports a family where a part was expected.
    pub fn family_placed(&mut self, wanted: &Name, family: Family) {
        let args: Vec<String> =
            family.params.iter().map(|p| format!("{} = {}", p.text, example(family, &p.text))).collect();
        let message = format!("expected a part, `{}` is a family of parts", wanted.text);
        let help = format!("take one of its sizes: `part member = {}({})`", wanted.text, args.join(", "));
        self.report(Diagnostic::error("E0203", wanted.span, message).label("in which size?").help(help));
    }
}

/// A size as asked for.
struct Wanted {
    text: String,
    value: f64,
    /// With the M of a thread, which only such a size answers to.
    thread: bool,
    /// Of a thread that is written with it: `M36x3`.
    pitch: Option<f64>,
}

impl Wanted {
    fn is(&self, key: &str) -> bool {
        number_of(key) == self.value && (key.starts_with('M') || !self.thread)
    }
}

/// `M6`, `M2.5`, `M36x3`: diameter and pitch.
fn thread_of(word: &str) -> Option<(f64, Option<f64>)> {
    let digits = |text: &str| text.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    let number = |text: &str| text.parse::<f64>().ok().filter(|_| digits(text));
    match word.strip_prefix('M')?.split_once('x') {
        Some((d, pitch)) => Some((number(d)?, Some(number(pitch)?))),
        None => Some((number(&word[1..])?, None)),
    }
}

/// The number of a size, in the unit of its file.
fn number_of(key: &str) -> f64 {
    key.trim_start_matches('M').parse().unwrap_or(f64::NAN)
}

/// A value that the parameter takes: the middle size of its table.
fn example(family: Family, param: &str) -> String {
    let table = Table::of(family, param);
    let middle = table.as_ref().and_then(|table| table.rows.get(table.rows.len() / 2));
    middle.map_or("10".to_string(), |(key, _)| key.text.clone())
}
