//! What may stand at a place: keywords by block, arguments, and names in scope of the right kind.

use super::context::{Context, context};
use super::index::{Index, Kind, SymbolId};
use super::project::Project;
use super::text::Text;
use super::words::{Argument, GENERAL, HOLES, KEYWORDS, OWNERS, Owner, Role, SHAFTS, Takes, UNITS};
use crate::syntax::ast::Stmt;
use crate::syntax::parse;
use lsp_types::{CompletionItem, CompletionItemKind, CompletionTextEdit, InsertTextFormat, TextEdit};
use std::borrow::Cow;

/// Proposals, the likely ones first. `files` are the names that `use` may take.
pub fn complete(project: &Project, text: &Text, file: u32, offset: usize, files: &[String]) -> Vec<CompletionItem> {
    let here = context(text.as_str(), offset);
    if here.in_comment {
        return Vec::new();
    }
    let index = names(project, text, file, offset);
    let index = index.as_ref();
    let mut desk = Proposals { project, index, part: index.part_at(file, offset), found: Vec::new() };
    match here.in_string {
        Some(_) if here.words.first() == Some(&"use") => files.iter().for_each(|name| desk.file(name)),
        Some(_) => {}
        None => desk.propose(&here),
    }
    // Paths are replaced as a whole, words as far as they were typed.
    let start = here.in_string.unwrap_or(here.start);
    let range = text.range(start, offset);
    let numbered = desk.found.into_iter().enumerate();
    numbered.map(|(i, p)| p.item(i, range)).collect()
}

/// The names in scope. A line that is being typed may hide those of its whole block: then it is read as if it were empty.
fn names<'p>(project: &'p Project, text: &Text, file: u32, offset: usize) -> Cow<'p, Index> {
    let parses = !project.survey.loaded.diagnostics.iter().any(|d| d.code.starts_with("E01"));
    let whole = text.as_str();
    let offset = whole.floor_char_boundary(offset);
    let start = whole[..offset].rfind('\n').map_or(0, |at| at + 1);
    let end = whole[offset..].find('\n').map_or(whole.len(), |at| offset + at);
    if parses || whole[start..end].contains(['{', '}']) {
        return Cow::Borrowed(project.index());
    }
    let emptied = format!("{}{}{}", &whole[..start], " ".repeat(end - start), &whole[end..]);
    let mut trees = project.survey.trees.clone();
    if let Some(tree) = trees.get_mut(file as usize) {
        *tree = parse(&emptied, file).0;
    }
    Cow::Owned(Index::new(&trees))
}

struct Proposal {
    label: String,
    kind: CompletionItemKind,
    detail: String,
    /// Snippet; the label if empty.
    snippet: String,
}

impl Proposal {
    fn item(self, number: usize, range: lsp_types::Range) -> CompletionItem {
        let is_snippet = self.snippet.contains('$');
        let new_text = if self.snippet.is_empty() { self.label.clone() } else { self.snippet };
        CompletionItem {
            sort_text: Some(format!("{number:04}")),
            filter_text: Some(self.label.clone()),
            label: self.label,
            kind: Some(self.kind),
            detail: (!self.detail.is_empty()).then_some(self.detail),
            insert_text_format: is_snippet.then_some(InsertTextFormat::SNIPPET),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit { range, new_text })),
            ..CompletionItem::default()
        }
    }
}

struct Proposals<'p> {
    project: &'p Project,
    index: &'p Index,
    /// The part that the place lies in.
    part: Option<SymbolId>,
    found: Vec<Proposal>,
}

impl Proposals<'_> {
    fn propose(&mut self, here: &Context) {
        let words = here.words.as_slice();
        if here.call.is_some() {
            return self.inside_parentheses(here, words);
        }
        match (here.block(), words) {
            ("states", _) => self.keywords("dimension", &["mmc", "nominal", "lmc"]),
            ("file", ["units", rest @ ..]) => {
                self.units(if rest.is_empty() { &["mm", "um", "cm", "m", "in"] } else { &["deg", "rad"] })
            }
            ("file", ["tolerances", ..]) => self.plain(GENERAL, CompletionItemKind::ENUM_MEMBER),
            ("file", ["inspect"]) => self.names(Kind::Assembly, None),
            (_, ["camera"] | ["camera", _]) => self.keywords("camera", &["fixed", "auto"]),
            ("file", ["part", _, "="]) => self.names(Kind::Family, None),
            (_, ["let", _, "=", value @ ..]) => self.dimension(value, Takes::Length, ""),
            (_, ["light", _, "="]) => self.calls(Role::Light),
            (_, ["add" | "cut" | "keep", _, "=", rest @ ..]) => self.feature(rest),
            ("assembly", ["root"] | ["root", _, "="] | ["place"]) => self.names(Kind::Part, None),
            ("assembly", ["place", rest @ ..]) => self.place(rest),
            ("assembly", ["measure", _, "=", rest @ ..]) => self.measure(rest),
            ("inspect", ["watch" | "ignore", ..]) => self.names(Kind::Component, None),
            ("outline", [_, ..]) => self.side(words),
            ("place", [key, "=", value @ ..]) if !self.borrowed(value) => {
                self.value(here.owner(), key, value);
                self.lenders(value);
            }
            ("place", [_, "=", ..]) => {}
            (_, [key, "=", value @ ..]) => self.value(here.owner(), key, value),
            (block, []) => self.statements(block, here),
            _ => {}
        }
    }

    fn inside_parentheses(&mut self, here: &Context, words: &[&str]) {
        match (here.owner(), words) {
            (Some(owner), []) => {
                let given = here.call.as_ref().map_or(&[][..], |call| &call.keys);
                owner.arguments.iter().filter(|a| !given.contains(&a.name)).for_each(|a| self.argument(a));
            }
            (Some(owner), [key, "=", value @ ..]) => {
                let op = here.statement.first().copied().unwrap_or_default();
                let takes = owner.argument(key).map_or(Takes::Length, |a| a.takes);
                self.value_of(takes, value, op);
            }
            (None, words) if here.statement.first() == Some(&"part") => self.member(here, words),
            (None, words) if here.block() == "place" => {
                if !self.borrowed(words) {
                    self.dimension(words, Takes::Length, "");
                    self.lenders(words);
                }
            }
            // Coordinates, or arithmetic.
            _ => self.dimension(words, Takes::Length, ""),
        }
    }

    /// `part pin = iso2338(d = 6, …`: the parameters of the family, and the sizes of their tables.
    fn member(&mut self, here: &Context, words: &[&str]) {
        let Some(call) = &here.call else { return };
        let family = self.index.find(Kind::Family, None, call.word).map(|id| self.index.symbols[id].span);
        let trees = self.project.survey.trees.iter().flat_map(|tree| &tree.lines);
        let mut drawn = trees.filter_map(|line| match &line.stmt {
            Stmt::Family { name, params, body } if Some(name.span) == family => Some((params, body)),
            _ => None,
        });
        let Some((params, body)) = drawn.next_back() else { return };
        match words {
            [] => {
                let open =
                    params.iter().map(|p| p.text.as_str()).chain(["material"]).filter(|p| !call.keys.contains(p));
                let found = open.map(|name| Proposal {
                    label: name.to_string(),
                    kind: CompletionItemKind::FIELD,
                    detail: format!("of the family {}", call.word),
                    snippet: format!("{name} = $0"),
                });
                self.found.extend(found);
            }
            ["material", "="] => self.names(Kind::Material, None),
            [param, "="] => {
                let tables = body.lines.iter().filter_map(|line| match &line.stmt {
                    Stmt::Table { name, body, .. } if name.text == *param => Some(body),
                    _ => None,
                });
                let rows = tables.flat_map(|table| &table.lines);
                for line in rows {
                    if let Stmt::Row { key, .. } = &line.stmt {
                        self.word(&key.text, self.project.slice(line.span).trim());
                    }
                }
            }
            _ => {}
        }
    }

    fn statements(&mut self, block: &str, here: &Context) {
        let keywords = KEYWORDS.iter().filter(|k| k.within == block && !k.snippet.is_empty());
        keywords.for_each(|k| {
            self.found.push(Proposal {
                label: k.word.to_string(),
                kind: CompletionItemKind::KEYWORD,
                detail: k.doc.to_string(),
                snippet: k.snippet.to_string(),
            });
        });
        here.owner().iter().flat_map(|o| o.arguments).for_each(|a| self.argument(a));
    }

    fn argument(&mut self, argument: &Argument) {
        self.found.push(Proposal {
            label: argument.name.to_string(),
            kind: CompletionItemKind::FIELD,
            detail: format!("{} ({})", argument.doc, argument.takes.unit()),
            snippet: format!("{} = $0", argument.name),
        });
    }

    fn value(&mut self, owner: Option<&'static Owner>, key: &str, value: &[&str]) {
        let takes = owner.and_then(|o| o.argument(key)).map_or(Takes::Length, |a| a.takes);
        self.value_of(takes, value, "");
    }

    fn value_of(&mut self, takes: Takes, value: &[&str], op: &str) {
        match (takes, value) {
            (Takes::Material, []) => self.names(Kind::Material, None),
            (Takes::Outline, []) => self.names(Kind::Outline, self.part),
            (Takes::OneOf(words), []) => words.iter().for_each(|word| self.word(word, "")),
            (Takes::Material | Takes::Outline | Takes::OneOf(_), _) => {}
            (Takes::Image, [.., "x", _]) => self.units(&["px"]),
            (Takes::Image, _) => {}
            (takes, []) => {
                match takes {
                    Takes::Depth if op == "cut" => self.keywords("dimension", &["through"]),
                    Takes::Turn => self.keywords("dimension", &["free"]),
                    _ => {}
                }
                self.dimension(value, takes, op);
            }
            (takes, value) => self.dimension(value, takes, op),
        }
    }

    /// What may go on in a dimension: a name at first, behind a number units and tolerances.
    fn dimension(&mut self, value: &[&str], takes: Takes, op: &str) {
        let last = value.last().copied().unwrap_or_default();
        let is_number = last.starts_with(|c: char| c.is_ascii_digit());
        let is_value = is_number || last == ")" || last.starts_with(|c: char| c.is_ascii_alphabetic());
        if value.is_empty() || ["(", "+", "-", "*", "/", "="].contains(&last) {
            if self.part.is_some() {
                self.names(Kind::Dimension, self.part);
            }
            self.names(Kind::Dimension, None);
        } else if is_value {
            if !value.iter().any(|w| ["±", "."].contains(w)) && takes != Takes::Whole {
                self.classes(takes, op);
                self.keywords("dimension", &["basic", "each"]);
            }
            if is_number {
                self.units(units_of(takes));
            }
        }
    }

    /// The components whose parts a placement may ask for a dimension, where a name may begin.
    fn lenders(&mut self, value: &[&str]) {
        if value.last().is_none_or(|last| ["(", "+", "-", "*", "/", "="].contains(last)) {
            self.names(Kind::Component, None);
        }
    }

    /// `washer.` in a placement: the dimensions of that component's part. Says whether it is that.
    fn borrowed(&mut self, value: &[&str]) -> bool {
        let Some(dot) = value.iter().rposition(|w| *w == ".").filter(|dot| *dot + 1 == value.len()) else {
            return false;
        };
        // An index stands between them: `washer[2].`
        let name = value[..dot].iter().rev().find(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()));
        let component = name.and_then(|name| self.index.find(Kind::Component, None, name));
        if let Some(part) = component.and_then(|id| self.index.part_of(id)) {
            self.names(Kind::Dimension, Some(part));
        }
        true
    }

    /// Classes for holes under a cut, for shafts elsewhere; both where nothing is known.
    fn classes(&mut self, takes: Takes, op: &str) {
        if !matches!(takes, Takes::Length | Takes::Depth) {
            return;
        }
        let shown: [&[&str]; 2] = match op {
            "cut" => [HOLES, &[]],
            "add" | "keep" => [SHAFTS, &[]],
            _ => [HOLES, SHAFTS],
        };
        for class in shown.into_iter().flatten() {
            let kind = if crate::iso::is_hole_class(class) { "hole" } else { "shaft" };
            self.word(class, &format!("ISO 286 {kind} class"));
        }
    }

    fn feature(&mut self, rest: &[&str]) {
        let counted = |w: &str| w.ends_with('x') && w.starts_with(|c: char| c.is_ascii_digit());
        match rest {
            [] => {
                self.calls(Role::Shape);
                self.keywords("feature", &["group"]);
            }
            [count] if counted(count) => {
                self.calls(Role::Shape);
                self.keywords("feature", &["group"]);
            }
            [.., "on"] => self.calls(Role::Pattern),
            [.., ")" | "group"] => self.keywords("feature", &["at", "turn", "on"]),
            _ => {}
        }
    }

    fn place(&mut self, rest: &[&str]) {
        let counted = |w: &str| w.ends_with('x') && w.starts_with(|c: char| c.is_ascii_digit());
        match rest.iter().position(|w| *w == "on") {
            Some(on) => self.path(&rest[on + 1..]),
            None => match rest {
                [_, "="] => self.names(Kind::Part, None),
                [_, "=", count] if counted(count) => self.names(Kind::Part, None),
                [_] | [_, "=", ..] => self.keywords("feature", &["on"]),
                _ => {}
            },
        }
    }

    fn measure(&mut self, rest: &[&str]) {
        let since = rest.iter().rposition(|w| ["from", "to", "within"].contains(w));
        match (since.map(|at| rest[at]), since.map_or(rest, |at| &rest[at + 1..])) {
            (None, _) => self.keywords("measure", &["from"]),
            (Some("within"), value) => self.dimension(value, Takes::Length, ""),
            (Some(word), path) => {
                let closed = path.last().is_some_and(|w| *w != "." && *w != "+" && *w != "-") && path.contains(&".");
                self.path(path);
                if closed {
                    self.keywords(
                        if word == "from" { "side" } else { "measure" },
                        if word == "from" { &["to"] } else { &["within"] },
                    );
                }
            }
        }
    }

    /// A component, then features of its part, as far as the path is written.
    fn path(&mut self, path: &[&str]) {
        let steps: Vec<&str> = path.split(|w| *w == ".").filter_map(|step| step.first().copied()).collect();
        match (path.last(), steps.split_first()) {
            (None, _) => self.names(Kind::Component, None),
            (Some(&"."), Some((component, features))) => {
                let index = self.index;
                let part = index.find(Kind::Component, None, component).and_then(|id| index.part_of(id));
                let owner = features
                    .iter()
                    .try_fold(part, |owner, name| owner.map(|within| index.find(Kind::Feature, Some(within), name)));
                if let Some(Some(owner)) = owner {
                    self.names(Kind::Feature, Some(owner));
                }
            }
            _ => {}
        }
    }

    fn side(&mut self, words: &[&str]) {
        match words {
            ["line" | "arc", .., "to"] | ["from", ..] if words.last() != Some(&")") => {}
            [.., "radius" | "round" | "chamfer"] => self.dimension(&[], Takes::Length, ""),
            ["arc", .., ")"] => self.keywords("side", &["radius"]),
            ["arc", .., number] if number.starts_with(|c: char| c.is_ascii_digit()) => {
                self.keywords("side", &["left", "right"])
            }
            ["arc", .., "left" | "right"] => self.keywords("side", &["long"]),
            ["line" | "from", .., ")"] => self.keywords("side", &["round", "chamfer"]),
            ["line" | "arc", ..] => self.keywords("side", &["to"]),
            _ => {}
        }
    }

    fn names(&mut self, kind: Kind, owner: Option<SymbolId>) {
        let item = match kind {
            Kind::Part => CompletionItemKind::CLASS,
            Kind::Material => CompletionItemKind::COLOR,
            Kind::Component => CompletionItemKind::VARIABLE,
            Kind::Dimension => CompletionItemKind::CONSTANT,
            _ => CompletionItemKind::REFERENCE,
        };
        let names: Vec<(String, String)> = self
            .index
            .of(kind, owner)
            .map(|s| {
                (s.name.clone(), self.project.slice(s.whole).lines().next().unwrap_or_default().trim().to_string())
            })
            .collect();
        for (label, detail) in names {
            self.found.push(Proposal { label, kind: item, detail, snippet: String::new() });
        }
    }

    fn calls(&mut self, role: Role) {
        for owner in OWNERS.iter().filter(|o| o.role == role) {
            self.found.push(Proposal {
                label: owner.name.to_string(),
                kind: CompletionItemKind::FUNCTION,
                detail: format!("{}: {}", owner.signature(), owner.doc),
                snippet: call_snippet(owner),
            });
        }
    }

    fn keywords(&mut self, within: &str, words: &[&str]) {
        for word in words {
            let known = KEYWORDS.iter().find(|k| k.word == *word && k.within == within);
            let snippet = known.map_or(String::new(), |k| k.snippet.to_string());
            let detail = known.map_or(String::new(), |k| k.doc.to_string());
            self.found.push(Proposal { label: word.to_string(), kind: CompletionItemKind::KEYWORD, detail, snippet });
        }
    }

    fn units(&mut self, names: &[&str]) {
        let known: Vec<(&str, &str)> = UNITS.iter().filter(|(name, _)| names.contains(name)).copied().collect();
        self.plain(&known, CompletionItemKind::UNIT);
    }

    fn plain(&mut self, words: &[(&str, &str)], kind: CompletionItemKind) {
        for (label, detail) in words {
            let (label, detail) = (label.to_string(), detail.to_string());
            self.found.push(Proposal { label, kind, detail, snippet: String::new() });
        }
    }

    fn word(&mut self, word: &str, detail: &str) {
        self.plain(&[(word, detail)], CompletionItemKind::ENUM_MEMBER);
    }

    fn file(&mut self, name: &str) {
        self.plain(&[(name, "")], CompletionItemKind::FILE);
    }
}

fn units_of(takes: Takes) -> &'static [&'static str] {
    match takes {
        Takes::Angle | Takes::Turn => &["deg", "rad"],
        Takes::Ratio => &["%"],
        Takes::Pixels => &["px"],
        Takes::Whole | Takes::Image => &[],
        _ => &["mm", "um", "cm", "m", "in"],
    }
}

/// The arguments that a call cannot do without, to be filled in.
fn call_snippet(owner: &Owner) -> String {
    let optional = |a: &&Argument| {
        !a.doc.contains(';') && !["chamfer", "chamfer_top", "chamfer_bottom", "tip", "r"].contains(&a.name)
    };
    let needed = owner.arguments.iter().filter(optional).enumerate();
    let needed: Vec<String> = needed.map(|(i, a)| format!("{} = ${}", a.name, i + 1)).collect();
    format!("{}({})$0", owner.name, needed.join(", "))
}
