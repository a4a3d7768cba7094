//! What a word or a number is, in a few lines of Markdown.

use super::context::{Context, context};
use super::index::{Kind, SymbolId};
use super::numbers::{deviation, limits, unit, value};
use super::project::Project;
use super::text::Text;
use super::words::{GENERAL, KEYWORDS, OWNERS, Role, UNITS, owner};
use crate::design::Reading;
use crate::design::model::Sense;
use crate::diag::{Span, explain};
use crate::syntax::ast::{Dim, Size, Stmt, Tolerance};
use crate::units::Quantity;
use lsp_types::{Hover, HoverContents, MarkupContent, MarkupKind};

/// What to say about a place, if there is anything.
pub fn hover(project: &Project, file: u32, offset: usize) -> Option<Hover> {
    let text = project.text(file)?;
    let word = word_at(text.as_str(), offset);
    let mut said: Vec<String> = Vec::new();
    let named = project.named_at(file, offset);
    said.extend(named.iter().map(|m| of_symbol(project, m.symbol)));
    let dim = project.dim_at(file, offset);
    if let (Some(dim), false) = (dim, named.iter().any(|m| is_definition(project, m.symbol, file, offset))) {
        said.extend(of_dim(project, dim));
    }
    let mut span = dim.map(|d| d.span).or(named.first().map(|m| m.span));
    if let (true, Some(word)) = (named.is_empty(), word) {
        let here = context(text.as_str(), word.start as usize);
        let name = text.slice(Span { file, ..word });
        let doc = of_word(name, &here);
        if doc.is_some() && dim.is_none() {
            span = Some(word);
        }
        said.extend(doc);
    }
    let range = span.map(|span| text.range_of(span));
    let value = said.join("\n\n---\n\n");
    let contents = HoverContents::Markup(MarkupContent { kind: MarkupKind::Markdown, value });
    (!said.is_empty()).then_some(Hover { contents, range })
}

/// The page of a diagnostic.
pub fn page(code: &str) -> Option<&'static str> {
    explain(&code.to_ascii_uppercase())
}

fn is_definition(project: &Project, symbol: SymbolId, file: u32, offset: usize) -> bool {
    let span = project.index().symbols[symbol].span;
    span.file == file && (span.start as usize..=span.end as usize).contains(&offset)
}

/// The word round an offset: letters, digits and `_`, or `%`.
fn word_at(text: &str, offset: usize) -> Option<Span> {
    let offset = text.floor_char_boundary(offset);
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '%');
    let start = offset - text[..offset].chars().rev().take_while(|c| part(*c)).count();
    let end = offset + text[offset..].chars().take_while(|c| part(*c)).count();
    (start < end).then_some(Span { file: 0, start: start as u32, end: end as u32 })
}

fn of_symbol(project: &Project, id: SymbolId) -> String {
    let index = project.index();
    let symbol = &index.symbols[id];
    let line = first_line(project.slice(symbol.whole));
    let code = format!("```gng\n{line}\n```");
    let owner = symbol.owner.map(|o| &index.symbols[o]);
    let of = owner.map_or(String::new(), |o| format!(" of {} `{}`", o.kind.word(), o.name));
    let mut said = format!("{code}\n\n{} `{}`{of}", symbol.kind.word(), symbol.name);
    match symbol.kind {
        Kind::Component => {
            let part = symbol.part.map(|p| &index.symbols[p].name);
            said += &part.map_or(String::new(), |part| format!(": part `{part}`"));
            said += &pieces(project, &symbol.name);
        }
        Kind::Part => said += &made(project, id),
        Kind::Dimension => said += &dimension_of(project, symbol.span).unwrap_or_default(),
        _ => {}
    }
    let above = comment_above(project, symbol.whole);
    if !above.is_empty() {
        said += &format!("\n\n{above}");
    }
    said
}

/// ` (3 pieces)`
fn pieces(project: &Project, name: &str) -> String {
    let Some(design) = &project.survey.loaded.design else { return String::new() };
    let copy = |component: &str| component.strip_prefix(name).is_some_and(|rest| rest.starts_with('['));
    match design.components.iter().filter(|c| copy(&c.name)).count() {
        0 => String::new(),
        1 => " (1 piece)".to_string(),
        count => format!(" ({count} pieces)"),
    }
}

fn made(project: &Project, id: SymbolId) -> String {
    let index = project.index();
    let features = index.of(Kind::Feature, Some(id)).count();
    let placed = index.symbols.iter().filter(|s| s.kind == Kind::Component && s.part == Some(id));
    let placed: Vec<String> = placed.map(|s| format!("`{}`", s.name)).collect();
    let features = if features == 1 { "1 feature".to_string() } else { format!("{features} features") };
    let placed = if placed.is_empty() { "placed nowhere".into() } else { format!("placed as {}", placed.join(", ")) };
    format!(": {features}, {placed}")
}

/// The limits of the `let` whose name stands at `span`.
fn dimension_of(project: &Project, span: Span) -> Option<String> {
    let mut found = None;
    let tree = project.survey.trees.get(span.file as usize)?;
    super::sites::each_line(&tree.lines, "file", &mut |line, _| {
        if let Stmt::Let { name, dim } = &line.stmt
            && name.span == span
        {
            found = Some(dim);
        }
    });
    Some(format!("\n\n{}", of_dim(project, found?)?))
}

fn of_dim(project: &Project, dim: &Dim) -> Option<String> {
    let reading = project.reading(dim.span)?;
    let exact = reading.range.low == reading.range.high;
    let unit = unit(reading.quantity);
    let mut said = format!("**{}{unit}**", limits(reading));
    if !exact {
        said += &format!(", nominal {}", value(reading.range.nominal, reading.quantity));
    }
    if let (Some(conditions), false) = (conditions(reading), exact) {
        said += &format!("\n\n{conditions}");
    }
    said += &format!("\n\n{}", origin(project, dim, reading));
    if let Some(name) = &reading.name {
        said += &format!("\n\n`{name}`");
    }
    Some(said)
}

/// `MMC 6.000, LMC 6.012`, where the number has a sense.
fn conditions(reading: &Reading) -> Option<String> {
    let why = match reading.sense {
        Some(Sense::External) => " (external: most material when large)",
        Some(Sense::Internal) => " (internal: most material when small)",
        Some(Sense::Neutral) => return None,
        None if reading.mmc == reading.lmc => return None,
        None => "",
    };
    let [mmc, lmc] = [reading.mmc, reading.lmc].map(|v| value(v, reading.quantity));
    Some(format!("MMC {mmc}, LMC {lmc}{why}"))
}

/// Where the limits come from.
fn origin(project: &Project, dim: &Dim, reading: &Reading) -> String {
    let exact = reading.range.low == reading.range.high;
    let scale = if reading.quantity == Quantity::Angle { 1f64.to_degrees() } else { 1.0 };
    match (&dim.tolerance, &dim.size) {
        (Some(Tolerance::Fit(class)), size) => {
            let basic = basic(project, size, reading);
            let deviations = basic.map(|basic| {
                let [low, high] = [reading.range.low, reading.range.high].map(|v| deviation((v - basic) * scale));
                format!(": {high}/{low}{}", unit(reading.quantity))
            });
            let kind = if crate::iso::is_hole_class(&class.text) { "hole" } else { "shaft" };
            format!("ISO 286 {kind} class {}{}", class.text, deviations.unwrap_or_default())
        }
        (Some(Tolerance::Basic), _) => "exact: `basic`".to_string(),
        (Some(_), _) => "tolerance as written".to_string(),
        (None, Size::States { .. }) => "limits as written".to_string(),
        (None, Size::Path(_)) => "a named dimension".to_string(),
        (None, Size::Sum(_)) if exact => "arithmetic".to_string(),
        (None, Size::Sum(_)) => "arithmetic: limits from those of its names".to_string(),
        (None, Size::Quantity(_)) if exact => "exact: no tolerance here".to_string(),
        (None, Size::Quantity(_)) => {
            let deviation = deviation((reading.range.high - reading.range.nominal) * scale);
            let class = general_class(project, dim.span.file).unwrap_or("ISO 2768");
            format!("general tolerance {class}: ±{}{}", deviation.trim_start_matches('+'), unit(reading.quantity))
        }
    }
}

/// The size that a fit class belongs to: `6` of `6 H7`, in mm.
fn basic(project: &Project, size: &Size, reading: &Reading) -> Option<f64> {
    match size {
        Size::Quantity(q) => {
            let unit = q.unit.as_ref().map_or_else(|| file_unit(project, q.span.file), |u| u.text.clone());
            let factor = [("mm", 1.0), ("um", 1e-3), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)];
            Some(q.number.value * factor.iter().find(|(name, _)| *name == unit)?.1)
        }
        _ if (reading.range.low..=reading.range.high).contains(&reading.range.nominal) => None,
        _ => Some(reading.range.nominal),
    }
}

fn file_unit(project: &Project, file: u32) -> String {
    let lines = project.survey.trees.get(file as usize).map_or(&[][..], |tree| &tree.lines);
    let unit = lines.iter().find_map(|line| match &line.stmt {
        Stmt::Units(length, _) => Some(length.text.clone()),
        _ => None,
    });
    unit.unwrap_or("mm".to_string())
}

fn general_class(project: &Project, file: u32) -> Option<&str> {
    let lines = &project.survey.trees.get(file as usize)?.lines;
    lines.iter().find_map(|line| match &line.stmt {
        Stmt::Tolerances(class) => Some(class.text.as_str()),
        _ => None,
    })
}

/// A word of the language: an argument before a keyword, for `d` is more here than anywhere else.
fn of_word(word: &str, here: &Context) -> Option<String> {
    if let Some(argument) = here.owner().and_then(|o| o.argument(word)) {
        return Some(format!("`{word}`: {} ({})", argument.doc, argument.takes.unit()));
    }
    if let Some(shape) = owner(word, &[Role::Shape, Role::Pattern, Role::Light]).filter(|_| here.is_call) {
        let arguments = shape.arguments.iter().map(|a| format!("- `{}`: {} ({})", a.name, a.doc, a.takes.unit()));
        let arguments: Vec<String> = arguments.collect();
        return Some(format!("`{}`\n\n{}\n\n{}", shape.signature(), shape.doc, arguments.join("\n")));
    }
    let block = here.block();
    let keyword = KEYWORDS.iter().filter(|k| k.word == word);
    let best = keyword.min_by_key(|k| if k.within == block { 0 } else { 1 });
    if let Some(keyword) = best {
        return Some(format!("`{word}`: {}", keyword.doc));
    }
    let general = GENERAL.iter().find(|(name, _)| name.ends_with(word) && name.len() == word.len());
    let unit = UNITS.iter().find(|(name, _)| *name == word).or(general);
    unit.map(|(name, doc)| format!("`{name}`: {doc}")).or_else(|| {
        let block = OWNERS.iter().find(|o| o.name == word && o.role == Role::Block)?;
        Some(format!("`{word}`: {}", block.doc))
    })
}

fn first_line(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim()
}

/// The comments right above a statement, as text.
fn comment_above(project: &Project, whole: Span) -> String {
    let Some(text) = project.text(whole.file).map(Text::as_str) else { return String::new() };
    let above = text.get(..whole.start as usize).unwrap_or_default();
    let above = above.rsplit_once('\n').map_or("", |(above, _)| above);
    let mut lines: Vec<&str> = above.lines().rev().map_while(|line| line.trim().strip_prefix("//")).collect();
    lines.reverse();
    lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join("\n")
}
