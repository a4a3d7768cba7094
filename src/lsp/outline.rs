//! The symbols of a document as a tree, its colours, and what folds.

use super::index::{Kind, Mentioned, SymbolId};
use super::project::Project;
use lsp_types::{DocumentSymbol, SemanticToken, SemanticTokenType, SymbolKind};
use std::collections::BTreeMap;

/// The colours of names, in the order of the legend.
pub const COLOURS: [SemanticTokenType; 6] = [
    SemanticTokenType::VARIABLE,
    SemanticTokenType::TYPE,
    SemanticTokenType::CLASS,
    SemanticTokenType::PROPERTY,
    SemanticTokenType::NAMESPACE,
    SemanticTokenType::FUNCTION,
];

/// The symbols of a file, in the order of the text.
pub fn symbols(project: &Project, file: u32) -> Vec<DocumentSymbol> {
    let index = project.index();
    let here = index.symbols.iter().enumerate().filter(|(_, s)| s.span.file == file);
    let mut inside: BTreeMap<Option<SymbolId>, Vec<SymbolId>> = BTreeMap::new();
    let mut assembly = None;
    for (id, symbol) in here {
        if symbol.kind == Kind::Assembly {
            assembly = Some(id);
        }
        // Components belong to no symbol by name, but stand in the assembly's braces.
        let stands = [Kind::Component, Kind::Measure].contains(&symbol.kind);
        let owner = if stands { assembly } else { symbol.owner };
        inside.entry(owner).or_default().push(id);
    }
    nested(project, &inside, None)
}

fn nested(
    project: &Project,
    inside: &BTreeMap<Option<SymbolId>, Vec<SymbolId>>,
    owner: Option<SymbolId>,
) -> Vec<DocumentSymbol> {
    let ids = inside.get(&owner).map_or(&[][..], Vec::as_slice);
    ids.iter().filter_map(|id| symbol(project, *id, nested(project, inside, Some(*id)))).collect()
}

// The protocol's structure still has a field that it has taken back.
#[allow(deprecated)]
fn symbol(project: &Project, id: SymbolId, children: Vec<DocumentSymbol>) -> Option<DocumentSymbol> {
    let symbol = &project.index().symbols[id];
    let text = project.text(symbol.span.file)?;
    let part = symbol.part.map(|p| project.index().symbols[p].name.clone());
    Some(DocumentSymbol {
        name: symbol.name.clone(),
        detail: Some(part.map_or(symbol.kind.word().to_string(), |part| format!("{} {part}", symbol.kind.word()))),
        kind: kind(symbol.kind),
        tags: None,
        deprecated: None,
        range: text.range_of(symbol.whole),
        selection_range: text.range_of(symbol.span),
        children: (!children.is_empty()).then_some(children),
    })
}

/// What the protocol calls our kinds.
pub fn kind(kind: Kind) -> SymbolKind {
    match kind {
        Kind::Dimension => SymbolKind::CONSTANT,
        Kind::Material => SymbolKind::STRUCT,
        Kind::Part | Kind::Family => SymbolKind::CLASS,
        Kind::Outline => SymbolKind::INTERFACE,
        Kind::Side | Kind::Measure => SymbolKind::FIELD,
        Kind::Feature => SymbolKind::PROPERTY,
        Kind::Assembly => SymbolKind::MODULE,
        Kind::Component => SymbolKind::VARIABLE,
        Kind::Station => SymbolKind::NAMESPACE,
        Kind::Light => SymbolKind::OBJECT,
    }
}

/// The colours of the names in a file, as the protocol packs them: each beside the one before.
pub fn colours(project: &Project, file: u32) -> Vec<SemanticToken> {
    let index = project.index();
    let Some(text) = project.text(file) else { return Vec::new() };
    let (mut tokens, mut last) = (Vec::new(), lsp_types::Position::default());
    for mention in index.mentions.iter().filter(|m| m.span.file == file && m.role != Mentioned::Shorthand) {
        let range = text.range_of(mention.span);
        let (line, column) = (range.start.line, range.start.character);
        let delta_line = line.saturating_sub(last.line);
        let delta_start = if delta_line == 0 { column.saturating_sub(last.character) } else { column };
        tokens.push(SemanticToken {
            delta_line,
            delta_start,
            length: range.end.character.saturating_sub(column),
            token_type: colour(index.symbols[mention.symbol].kind),
            token_modifiers_bitset: u32::from(mention.role == Mentioned::Definition),
        });
        last = range.start;
    }
    tokens
}

/// Index into [`COLOURS`].
fn colour(kind: Kind) -> u32 {
    match kind {
        Kind::Dimension => 0,
        Kind::Material | Kind::Outline => 1,
        Kind::Part | Kind::Family => 2,
        Kind::Feature | Kind::Side | Kind::Measure => 3,
        Kind::Assembly | Kind::Station => 4,
        Kind::Component | Kind::Light => 5,
    }
}
