//! Definitions, uses, and new names for both.
//!
//! A new name is written wherever the old one stands, in every spec that knows it. It is refused when a name cannot be
//! spelled so, when it is taken, and when any word would mean something else than before: the specs are read again with the
//! new name, and every word has to name what it named.

use super::index::{Index, Kind, Mention, Mentioned, Symbol, SymbolId};
use super::project::Project;
use super::uri::library_address;
use crate::design::Read;
use crate::diag::Span;
use lsp_types::{Location, TextEdit};
use std::collections::BTreeMap;

/// The place of a definition, the same in every project that reads its file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    file: String,
    start: u32,
    end: u32,
}

impl Target {
    pub fn of(project: &Project, symbol: SymbolId) -> Target {
        let span = project.index().symbols[symbol].span;
        Target { file: project.name(span.file).to_string(), start: span.start, end: span.end }
    }

    pub fn file(&self) -> &str {
        &self.file
    }

    fn symbol(&self, project: &Project) -> Option<SymbolId> {
        let file = project.file(&self.file)?;
        let span = Span { file, start: self.start, end: self.end };
        project.index().symbols.iter().position(|s| s.span == span)
    }
}

/// Where what is named at a place is defined; in the parts library only for a client that can open it.
pub fn definition(project: &Project, file: u32, offset: usize, library: bool) -> Option<Location> {
    let mention = project.named_at(file, offset).into_iter().next()?;
    let span = project.index().symbols[mention.symbol].span;
    let read_only = || {
        let uri = library_address(project.name(span.file)).filter(|_| library)?;
        Some(Location::new(uri, project.text(span.file)?.range_of(span)))
    };
    project.location(span).or_else(read_only)
}

/// Where a target is named in a project; its definition only if asked for.
pub fn references(project: &Project, target: &Target, definition: bool) -> Vec<Location> {
    let Some(symbol) = target.symbol(project) else { return Vec::new() };
    let wanted = project.index().mentions_of(symbol).filter(|m| definition || m.role != Mentioned::Definition);
    wanted.filter_map(|m| project.location(m.span)).collect()
}

/// The symbol that a rename at a place is about, and the word that stands there: of `place shaft on gear` the component.
pub fn subject(project: &Project, file: u32, offset: usize) -> Option<(SymbolId, Span)> {
    let found: Vec<Mention> = project.index().at(file, offset).copied().collect();
    let chosen = found.iter().min_by_key(|m| m.role)?;
    Some((chosen.symbol, chosen.span))
}

/// The edits of one project that give a target a new name, by file name; or why it cannot have it.
pub fn rename(
    project: &Project,
    root: &str,
    target: &Target,
    new: &str,
    read: Read,
) -> Result<BTreeMap<String, Vec<TextEdit>>, String> {
    let Some(symbol) = target.symbol(project) else { return Ok(BTreeMap::new()) };
    let index = project.index();
    spelled(index.symbols[symbol].kind, new)?;
    untaken(project, symbol, new)?;
    let edits = written(project, symbol, new);
    let changed = Project::new(root, &|name| match (project.file(name), edits.keys().any(|n| n == name)) {
        (Some(file), true) => Ok(applied(project, file, &edits[name])),
        (Some(file), false) => Ok(project.text(file).map(|t| t.as_str().to_string()).unwrap_or_default()),
        (None, _) => read(name),
    });
    means_the_same(index, changed.index(), new)?;
    if changed.survey.loaded.diagnostics.len() > project.survey.loaded.diagnostics.len() {
        let why = changed.survey.loaded.diagnostics.iter().find(|d| d.is_error());
        return Err(why.map_or_else(|| format!("`{new}` cannot stand there"), |d| d.message.clone()));
    }
    let by_file = edits.into_iter().map(|(name, edits)| {
        let text = project.file(&name).and_then(|file| project.text(file));
        let edits =
            edits.into_iter().filter_map(|(at, new_text)| Some(TextEdit { range: text?.range_of(at), new_text }));
        (name.clone(), edits.collect())
    });
    Ok(by_file.collect())
}

/// Edits by file name, in the order of the text.
type Edits = BTreeMap<String, Vec<(Span, String)>>;

fn written(project: &Project, symbol: SymbolId, new: &str) -> Edits {
    let index = project.index();
    let mut edits = Edits::new();
    for mention in index.mentions_of(symbol) {
        let shares = |m: &&Mention| m.span == mention.span && m.symbol != symbol;
        let short = index.mentions.iter().any(|m| shares(&m));
        let old = project.slice(mention.span);
        let text = match mention.role {
            // `place shaft on gear`: component and part have one word, from now on two.
            Mentioned::Shorthand => format!("{old} = {new}"),
            Mentioned::Definition if short => format!("{new} = {old}"),
            _ => new.to_string(),
        };
        edits.entry(project.name(mention.span.file).to_string()).or_default().push((mention.span, text));
    }
    edits
}

fn applied(project: &Project, file: u32, edits: &[(Span, String)]) -> String {
    let mut text = project.text(file).map(|t| t.as_str().to_string()).unwrap_or_default();
    for (span, new) in edits.iter().rev() {
        text.replace_range(span.start as usize..span.end as usize, new);
    }
    text
}

/// Whether a name can be spelled so.
fn spelled(kind: Kind, new: &str) -> Result<(), String> {
    let letters = new.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !letters || !new.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        return Err(format!("`{new}` is not a name: a letter or `_`, then letters, digits or `_`"));
    }
    let words: &[&str] = match kind {
        Kind::Dimension => &["on", "at", "turn", "basic", "each", "free", "through", "exact"],
        Kind::Side => &["on", "at", "turn", "basic", "each", "to"],
        _ => &["on", "at", "turn", "basic", "each"],
    };
    if words.contains(&new) { Err(format!("`{new}` is a word of the language")) } else { Ok(()) }
}

fn untaken(project: &Project, symbol: SymbolId, new: &str) -> Result<(), String> {
    let index = project.index();
    let Symbol { kind, owner, .. } = &index.symbols[symbol];
    // A part and a family of parts have one kind of name.
    let other = if *kind == Kind::Family { Kind::Part } else { Kind::Family };
    let others = [Kind::Part, Kind::Family].contains(kind).then(|| index.find(other, None, new)).flatten();
    let taken = index.find(*kind, *owner, new).or(others);
    let Some(taken) = taken.filter(|taken| *taken != symbol) else { return Ok(()) };
    let span = index.symbols[taken].span;
    let line = project.text(span.file).map_or(0, |text| text.position(span.start as usize).line + 1);
    Err(format!("there is a {} `{new}` already: {}, line {line}", kind.word(), project.name(span.file)))
}

/// Every word names what it named; symbols keep their numbers, for the text has the same statements.
fn means_the_same(before: &Index, after: &Index, new: &str) -> Result<(), String> {
    let meaning = |index: &Index| index.mentions.iter().map(|m| (m.symbol, m.role)).collect::<Vec<_>>();
    let plain = |all: Vec<(SymbolId, Mentioned)>| {
        // A word that named two things is two words now.
        let one_word = |(s, role)| (s, if role == Mentioned::Shorthand { Mentioned::Use } else { role });
        all.into_iter().map(one_word).collect::<Vec<_>>()
    };
    let (before, after) = (plain(meaning(before)), plain(meaning(after)));
    if before == after {
        return Ok(());
    }
    Err(format!("with the name `{new}` some words would mean something else than before"))
}
