//! Dimensions that a placement borrows from other pieces: `z = washer.h`.
//!
//! In: a path such as `washer.h` or `washer[2].h`, while a component is being placed. Out: that piece's own row of the
//! table, so that what rests on a part follows its true thickness. Never reaches into features, and never into a piece that
//! is placed later: `assemble` places what is asked before what asks. Its own piece it may ask as well: `z = oring.tube`.

use super::scope::{Named, Resolver, Typed, Use};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Segment, Size, Sum, Value};
use std::collections::BTreeMap;

/// The components that stand so far, with the named dimensions of their pieces.
#[derive(Debug, Clone, Default)]
pub struct Standing {
    /// One per component, in the order of their placement.
    stood: Vec<Stood>,
    /// Components by the name they were placed under.
    groups: BTreeMap<String, Vec<usize>>,
    asking: Option<Asking>,
}

#[derive(Debug, Clone)]
struct Stood {
    names: BTreeMap<String, Named>,
    below: Option<usize>,
}

/// The copy that is being placed.
#[derive(Debug, Clone, Copy)]
pub struct Asking {
    /// Its own place among the components, and that of the one it stands on.
    pub own: usize,
    pub below: usize,
    /// Which of how many, counted from 0.
    pub copy: usize,
    pub copies: usize,
}

impl Standing {
    /// Notes the next component, which takes the named dimensions of its piece. Its place among all.
    pub fn add(&mut self, group: &str, names: BTreeMap<String, Named>, below: Option<usize>) -> usize {
        let own = self.stood.len();
        self.groups.entry(group.to_string()).or_default().push(own);
        self.stood.push(Stood { names, below });
        own
    }

    pub fn ask(&mut self, asking: Option<Asking>) {
        self.asking = asking;
    }

    /// The pieces of `group` that a path without an index means: the own one, the one below, that of the same number, or all.
    fn meant(&self, group: &[usize], asking: Asking) -> Vec<usize> {
        if group.contains(&asking.own) {
            return vec![asking.own];
        }
        let below = std::iter::successors(Some(asking.below), |at| self.stood.get(*at)?.below);
        if let Some(under) = below.into_iter().find(|at| group.contains(at)) {
            return vec![under];
        }
        if asking.copies == group.len() { vec![group[asking.copy]] } else { group.to_vec() }
    }
}

impl Resolver {
    /// The value of a path of several words.
    pub fn borrowed(&mut self, path: &ast::Path, usage: Use) -> Option<Typed> {
        let (component, name) = match (self.standing.asking, path.segments.as_slice()) {
            (Some(asking), [component, Segment { name, index: None }]) => (self.lender(component, name, asking)?, name),
            _ => {
                self.no_dimension(path);
                return None;
            }
        };
        let known = std::mem::take(&mut self.standing.stood[component].names);
        if !known.contains_key(&name.text) {
            self.nothing_to_lend(path, &known);
            self.standing.stood[component].names = known;
            return None;
        }
        let own = std::mem::replace(&mut self.locals, known);
        let word = ast::Path { segments: vec![path.segments[1].clone()], span: path.span };
        let value = self.lookup(&word, usage);
        self.standing.stood[component].names = std::mem::replace(&mut self.locals, own);
        value
    }

    /// The component whose piece is asked.
    fn lender(&mut self, segment: &Segment, name: &ast::Name, asking: Asking) -> Option<usize> {
        let group = self.standing.groups.get(&segment.name.text).cloned().unwrap_or_default();
        if group.is_empty() {
            // One that is written could not be placed, and why has been said.
            if !self.written.contains(&segment.name.text) {
                let known: Vec<String> = self.standing.groups.keys().cloned().collect();
                let fault = format!("no component is named `{}`", segment.name.text);
                let fault = Diagnostic::error("E0201", segment.name.span, fault).label("unknown component");
                let near = nearest(&segment.name.text, known.iter().map(String::as_str));
                self.report(match near {
                    Some(near) => fault.meant(segment.name.span, near),
                    None => fault.help(format!("components: {}", known.join(", "))),
                });
            }
            return None;
        }
        let pieces = match segment.index {
            Some(_) => self.chosen(segment, group.len())?.into_iter().map(|i| group[i]).collect(),
            None => self.standing.meant(&group, asking),
        };
        if let [piece] = pieces.as_slice() {
            return Some(*piece);
        }
        let (group, end) = (&segment.name, segment.index.as_ref().map_or(segment.name.span.end, |i| i.span.end));
        let message = format!("`{}.{}` is a dimension of each of {} pieces", group.text, name.text, pieces.len());
        let span = Span { end, ..group.span };
        self.report(Diagnostic::error("E0203", span, message).label("of which one?").suggest(
            format!("write `{}[1].{}`", group.text, name.text),
            span,
            format!("{}[1]", group.text),
        ));
        None
    }

    fn nothing_to_lend(&mut self, path: &ast::Path, known: &BTreeMap<String, Named>) {
        let (component, name) = (&path.segments[0].name, &path.segments[1].name);
        let message = format!("the part of `{}` has no dimension named `{}`", component.text, name.text);
        let fault = Diagnostic::error("E0201", name.span, message).label("unknown dimension");
        self.report(match nearest(&name.text, known.keys().map(String::as_str)) {
            Some(near) => fault.meant(name.span, near),
            None if known.is_empty() => fault.help(format!("name one in the part: `let {} = 10`", name.text)),
            None => fault
                .help(format!("its dimensions: {}", known.keys().map(String::as_str).collect::<Vec<_>>().join(", "))),
        });
    }

    /// A dimension that a component has to lend: `washer.h`.
    fn example(&self, component: &str) -> Option<String> {
        let first = *self.standing.groups.get(component)?.first()?;
        let name = self.standing.stood[first].names.keys().next()?;
        Some(format!("{component}.{name}"))
    }

    fn no_dimension(&mut self, path: &ast::Path) {
        let fault = Diagnostic::error("E0203", path.span, "expected a named dimension, this is a path");
        if let (Some(_), Some(example)) = (self.standing.asking, self.example(&path.segments[0].name.text)) {
            let help = format!("a placement may ask a piece for what its part defines with `let`: `{example}`");
            return self.report(fault.label("not a dimension").help(help));
        }
        let help = "define it above all parts with `let`, and use that name in both places";
        let fault = fault.label("not a dimension here").help(help);
        self.report(match self.standing.asking {
            Some(_) => fault,
            None => fault.note("only a placement may ask another piece"),
        });
    }
}

/// The components whose dimensions a placement asks for.
pub fn asked(place: &ast::Place) -> Vec<&ast::Path> {
    let mut paths = Vec::new();
    for line in place.body.iter().flat_map(|body| &body.lines) {
        if let ast::Stmt::Field { value: Value::Dim(dim), .. } = &line.stmt {
            match &dim.size {
                Size::Path(path) => paths.push(path),
                Size::Sum(sum) => within(sum, &mut paths),
                Size::Quantity(_) | Size::States { .. } => {}
            }
        }
    }
    paths.retain(|path| path.segments.len() > 1);
    paths
}

fn within<'a>(sum: &'a Sum, paths: &mut Vec<&'a ast::Path>) {
    match sum {
        Sum::Quantity(_) => {}
        Sum::Path(path) => paths.push(path),
        Sum::Negative(a) | Sum::Group(a) => within(a, paths),
        Sum::Binary(_, a, b) => {
            within(a, paths);
            within(b, paths);
        }
    }
}
