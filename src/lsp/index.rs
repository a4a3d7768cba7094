//! Names: where each is defined, and where it is used.
//!
//! In: the syntax trees of a spec and of the files it uses. Out: [`Index`], names by place. What a name means is decided as
//! `design` decides it: the first of equal names counts, and a name of a part goes before one of the file.

use super::sites::{Dims, body_of, dims_of};
use super::words::Takes;
use crate::diag::Span;
use crate::syntax::ast::{Body, Dim, Face, File, Line, Name, Path, Segment, Shape, Size, Stmt, Sum, Value};
use std::collections::BTreeMap;

/// Index into [`Index::symbols`].
pub type SymbolId = usize;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Dimension,
    Material,
    Part,
    Family,
    Outline,
    Side,
    Feature,
    Assembly,
    Component,
    Measure,
    Station,
    Light,
}

impl Kind {
    pub fn word(self) -> &'static str {
        match self {
            Kind::Dimension => "dimension",
            Kind::Material => "material",
            Kind::Part => "part",
            Kind::Family => "family",
            Kind::Outline => "outline",
            Kind::Side => "side",
            Kind::Feature => "feature",
            Kind::Assembly => "assembly",
            Kind::Component => "component",
            Kind::Measure => "measure",
            Kind::Station => "station",
            Kind::Light => "light",
        }
    }
}

/// Something with a name.
#[derive(Debug, Clone)]
pub struct Symbol {
    pub kind: Kind,
    pub name: String,
    /// Of the name.
    pub span: Span,
    /// Of the whole statement.
    pub whole: Span,
    /// The part of a dimension, an outline or a feature; the group of a feature in it; the outline of a side.
    pub owner: Option<SymbolId>,
    /// The part of a component; the family of a part that is a member of one.
    pub part: Option<SymbolId>,
}

/// A place where a name stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mention {
    pub span: Span,
    pub symbol: SymbolId,
    pub role: Mentioned,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mentioned {
    Definition,
    Use,
    /// `place shaft on gear` names a component and, by the same word, its part.
    Shorthand,
}

/// All names of a spec.
#[derive(Debug, Clone, Default)]
pub struct Index {
    pub symbols: Vec<Symbol>,
    /// In the order of their places.
    pub mentions: Vec<Mention>,
    /// First of equal names, by kind and owner.
    names: BTreeMap<(Kind, Option<SymbolId>, String), SymbolId>,
    /// The names of the parts of components and of the families of parts, until all are known.
    parts: Vec<(SymbolId, Kind, String)>,
    /// The name of the outline that a feature is made from.
    outlines: BTreeMap<SymbolId, String>,
}

impl Index {
    pub fn new(files: &[File]) -> Index {
        let mut index = Index::default();
        for file in files {
            file.lines.iter().for_each(|line| index.define(line, None));
        }
        for (symbol, kind, name) in std::mem::take(&mut index.parts) {
            index.symbols[symbol].part = index.find(kind, None, &name);
        }
        for file in files {
            file.lines.iter().for_each(|line| index.uses(line, "file", None));
        }
        index.mentions.sort_by_key(|m| (m.span.file, m.span.start, m.span.end, m.role));
        index
    }

    pub fn find(&self, kind: Kind, owner: Option<SymbolId>, name: &str) -> Option<SymbolId> {
        self.names.get(&(kind, owner, name.to_string())).copied()
    }

    /// The symbols of a kind and owner, in the order of their names.
    pub fn of(&self, kind: Kind, owner: Option<SymbolId>) -> impl Iterator<Item = &Symbol> {
        let from = (kind, owner, String::new());
        let here = self.names.range(from..).take_while(move |((k, o, _), _)| *k == kind && *o == owner);
        here.map(|(_, id)| &self.symbols[*id])
    }

    /// What is named at a place: of a word that names two things, the definition first.
    pub fn at(&self, file: u32, offset: usize) -> impl Iterator<Item = &Mention> {
        let holds = move |s: Span| s.start as usize <= offset && offset <= s.end as usize;
        let end = self.mentions.partition_point(|m| (m.span.file, m.span.start as usize) <= (file, offset));
        let before = self.mentions[..end].iter().rev();
        let near: Vec<&Mention> = before.take_while(|m| m.span.file == file && holds(m.span)).collect();
        near.into_iter().rev()
    }

    /// The part or family in whose braces a place lies.
    pub fn part_at(&self, file: u32, offset: usize) -> Option<SymbolId> {
        let within = |s: Span| s.file == file && (s.start as usize..=s.end as usize).contains(&offset);
        self.symbols.iter().position(|s| [Kind::Part, Kind::Family].contains(&s.kind) && within(s.whole))
    }

    pub fn mentions_of(&self, symbol: SymbolId) -> impl Iterator<Item = &Mention> {
        self.mentions.iter().filter(move |m| m.symbol == symbol)
    }

    fn define(&mut self, line: &Line, owner: Option<SymbolId>) {
        match &line.stmt {
            Stmt::Let { name, .. } => {
                self.add(Kind::Dimension, name, line, owner);
            }
            Stmt::Material { name, .. } => {
                self.add(Kind::Material, name, line, None);
            }
            Stmt::Part { name, body } => self.block(Kind::Part, name, body, line, None),
            Stmt::Family { name, params, body } => self.family(name, params, body, line),
            Stmt::Member { name, call } => {
                let id = self.add(Kind::Part, name, line, None);
                self.parts.push((id, Kind::Family, call.name.text.clone()));
            }
            // The columns of a table are dimensions of its family.
            Stmt::Table { columns, .. } => columns.iter().for_each(|name| {
                self.add(Kind::Dimension, name, line, owner);
            }),
            Stmt::Outline { name, body } => self.block(Kind::Outline, name, body, line, owner),
            Stmt::Side(side) => {
                if let Some(name) = &side.name {
                    self.add(Kind::Side, name, line, owner);
                }
            }
            Stmt::Feature(feature) => match &feature.shape {
                Shape::Call(call) => {
                    let id = self.add(Kind::Feature, &feature.name, line, owner);
                    let drawn = call.args.list.iter().find(|arg| arg.key.text == "outline");
                    if let Some(Value::Dim(dim)) = drawn.map(|arg| &arg.value) {
                        self.outlines.extend(dim.word().map(|word| (id, word.to_string())));
                    }
                }
                Shape::Group { body, .. } => self.block(Kind::Feature, &feature.name, body, line, owner),
            },
            Stmt::Assembly { name, body } => self.block(Kind::Assembly, name, body, line, None),
            // Components and measures are the spec's, whichever assembly they stand in.
            Stmt::Root { name, part } => self.component(name, part.as_ref(), line),
            Stmt::Place(place) => self.component(&place.name, place.part.as_ref(), line),
            Stmt::Measure(measure) => {
                self.add(Kind::Measure, &measure.name, line, None);
            }
            Stmt::Station { name, body } => self.block(Kind::Station, name, body, line, None),
            Stmt::Light { name, .. } => {
                self.add(Kind::Light, name, line, owner);
            }
            _ => {}
        }
    }

    fn block(&mut self, kind: Kind, name: &Name, body: &Body, line: &Line, owner: Option<SymbolId>) {
        let id = self.add(kind, name, line, owner);
        body.lines.iter().for_each(|inner| self.define(inner, Some(id)));
    }

    fn family(&mut self, name: &Name, params: &[Name], body: &Body, line: &Line) {
        let id = self.add(Kind::Family, name, line, None);
        for param in params {
            self.add(Kind::Dimension, param, line, Some(id));
        }
        body.lines.iter().for_each(|inner| self.define(inner, Some(id)));
    }

    fn component(&mut self, name: &Name, part: Option<&Name>, line: &Line) {
        let id = self.add(Kind::Component, name, line, None);
        self.parts.push((id, Kind::Part, part.unwrap_or(name).text.clone()));
    }

    fn add(&mut self, kind: Kind, name: &Name, line: &Line, owner: Option<SymbolId>) -> SymbolId {
        let id = self.symbols.len();
        let (text, span) = (name.text.clone(), name.span);
        self.names.entry((kind, owner, text.clone())).or_insert(id);
        self.symbols.push(Symbol { kind, name: text, span, whole: line.span, owner, part: None });
        self.mentions.push(Mention { span, symbol: id, role: Mentioned::Definition });
        id
    }

    fn uses(&mut self, line: &Line, block: &'static str, part: Option<SymbolId>) {
        match &line.stmt {
            Stmt::Root { name, part } => self.part_name(name, part.as_ref()),
            Stmt::Place(place) => {
                self.part_name(&place.name, place.part.as_ref());
                self.path(&place.on);
            }
            Stmt::Measure(measure) => [&measure.from, &measure.to].into_iter().for_each(|face| self.face(face)),
            Stmt::Watch { path, .. } | Stmt::Ignore(path) => self.path(path),
            Stmt::Table { name, .. } => {
                self.mention(Kind::Dimension, part, name);
            }
            Stmt::Member { call, .. } => {
                if let Some(family) = self.mention(Kind::Family, None, &call.name) {
                    call.args.list.iter().for_each(|arg| {
                        self.mention(Kind::Dimension, Some(family), &arg.key);
                    });
                }
            }
            Stmt::Inspect { name: Some(name), .. } => {
                self.mention(Kind::Assembly, None, name);
            }
            _ => {}
        }
        let mut dims = Vec::new();
        dims_of(&line.stmt, block, &mut dims);
        dims.iter().for_each(|site| self.dim(site, part));
        let Some((inner, body)) = body_of(&line.stmt) else { return };
        let part = match &line.stmt {
            Stmt::Part { name, .. } => self.find(Kind::Part, None, &name.text),
            Stmt::Family { name, .. } => self.find(Kind::Family, None, &name.text),
            _ => part,
        };
        body.lines.iter().for_each(|line| self.uses(line, inner, part));
    }

    fn dim(&mut self, site: &Dims, part: Option<SymbolId>) {
        let word = match &site.dim.size {
            Size::Path(path) if path.word().is_some() => Some(&path.segments[0].name),
            _ => None,
        };
        match (site.takes, word) {
            (Some(Takes::Material), Some(name)) => {
                self.mention(Kind::Material, None, name);
            }
            (Some(Takes::Outline), Some(name)) => {
                self.mention(Kind::Outline, part, name);
            }
            (Some(Takes::OneOf(_)), _) => {}
            _ => self.dimension(site.dim, part),
        }
    }

    fn dimension(&mut self, dim: &Dim, part: Option<SymbolId>) {
        match &dim.size {
            Size::Path(path) => self.named(path, part),
            Size::Sum(sum) => self.sum(sum, part),
            Size::Quantity(_) | Size::States { .. } => {}
        }
    }

    fn sum(&mut self, sum: &Sum, part: Option<SymbolId>) {
        match sum {
            Sum::Quantity(_) => {}
            Sum::Path(path) => self.named(path, part),
            Sum::Negative(a) | Sum::Group(a) => self.sum(a, part),
            Sum::Binary(_, a, b) => {
                self.sum(a, part);
                self.sum(b, part);
            }
        }
    }

    fn named(&mut self, path: &Path, part: Option<SymbolId>) {
        let Some(word) = path.word() else { return self.borrowed(path) };
        let local = part.and_then(|_| self.find(Kind::Dimension, part, word));
        if let Some(symbol) = local.or_else(|| self.find(Kind::Dimension, None, word)) {
            self.mentions.push(Mention { span: path.segments[0].name.span, symbol, role: Mentioned::Use });
        }
    }

    /// `washer[2].h`: a component, and a dimension of its part.
    fn borrowed(&mut self, path: &Path) {
        let [component, Segment { name, index: None }] = path.segments.as_slice() else { return };
        let component = self.mention(Kind::Component, None, &component.name);
        if let Some(part) = component.and_then(|id| self.part_of(id)) {
            self.mention(Kind::Dimension, Some(part), name);
        }
    }

    fn mention(&mut self, kind: Kind, owner: Option<SymbolId>, name: &Name) -> Option<SymbolId> {
        let symbol = self.find(kind, owner, &name.text)?;
        self.mentions.push(Mention { span: name.span, symbol, role: Mentioned::Use });
        Some(symbol)
    }

    fn part_name(&mut self, component: &Name, part: Option<&Name>) {
        let written = part.unwrap_or(component);
        let Some(symbol) = self.find(Kind::Part, None, &written.text) else { return };
        let role = if part.is_some() { Mentioned::Use } else { Mentioned::Shorthand };
        self.mentions.push(Mention { span: written.span, symbol, role });
    }

    /// `plate.mount.dowel[2]`
    fn path(&mut self, path: &Path) {
        let mut segments = path.segments.iter();
        let component = segments.next().and_then(|first| self.mention(Kind::Component, None, &first.name));
        let mut owner = component.and_then(|id| self.part_of(id));
        for Segment { name, .. } in segments {
            let Some(within) = owner else { return };
            owner = self.mention(Kind::Feature, Some(within), name);
        }
    }

    /// What draws a component: its part, or the family that its part is a member of.
    pub fn part_of(&self, component: SymbolId) -> Option<SymbolId> {
        let part = self.symbols.get(component)?.part?;
        self.symbols[part].part.or(Some(part))
    }

    /// `mount[2].rail.base`: a component, features of its part, and at last perhaps the side of an outline.
    fn face(&mut self, face: &Face) {
        let component = self.mention(Kind::Component, None, &face.component.name);
        let mut owner = component.and_then(|id| self.part_of(id));
        let (part, mut start) = (owner, face.face.span.start);
        for step in face.face.text.split('.') {
            let name = step.split('[').next().unwrap_or_default();
            let Some(within) = owner else { return };
            let named = |text: &str| {
                let span = Span { start, end: start + text.len() as u32, ..face.face.span };
                Name { text: text.to_string(), span }
            };
            owner = self.mention(Kind::Feature, Some(within), &named(name));
            if let (None, Some(outline)) = (owner, self.outlines.get(&within)) {
                let outline = self.find(Kind::Outline, part, outline);
                let side = name.strip_suffix("_corner").filter(|_| self.find(Kind::Side, outline, name).is_none());
                self.mention(Kind::Side, outline, &named(side.unwrap_or(name)));
            }
            start += step.len() as u32 + 1;
        }
    }
}
