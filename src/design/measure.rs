//! `measure`: a distance between two faces of the assembly, with the limits it has to stay within.
//!
//! In: the statements, and the components as placed. Out: [`Measure`]s whose components and features exist. Whether a
//! feature still shows the face that is named is known only on its solid, so that is not asked here.

use super::assemble::Assembled;
use super::model::{FacePath, Feature, Measure, Shape};
use super::scope::Resolver;
use super::seat::copies;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Stmt};
use crate::units::{Quantity, Range};
use std::collections::BTreeMap;

impl Resolver {
    /// The distances that the assembly's lines ask for, in their order.
    pub fn measures(&mut self, body: &ast::Body, built: &Assembled) -> Vec<Measure> {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        let mut found = Vec::new();
        for line in &body.lines {
            let Stmt::Measure(measure) = &line.stmt else { continue };
            match seen.get(measure.name.text.as_str()) {
                Some(first) => self.duplicate("measure", &measure.name, *first),
                None => {
                    seen.insert(&measure.name.text, measure.name.span);
                }
            }
            found.extend(self.measure(measure, line.span, built));
        }
        found
    }

    fn measure(&mut self, measure: &ast::Measure, span: Span, built: &Assembled) -> Option<Measure> {
        let (from, to) = (self.face(&measure.from, built), self.face(&measure.to, built));
        let limits = measure.within.as_ref().map(|dim| self.limits(dim));
        let (from, to) = (from?, to?);
        if (from.component, &from.face) == (to.component, &to.face) {
            let message = format!("`{}` measures from a face to itself", measure.name.text);
            self.report(
                Diagnostic::error("E0211", to.span, message)
                    .label("the same face")
                    .also(from.span, "measured from here"),
            );
            return None;
        }
        Some(Measure { name: measure.name.text.clone(), from, to, limits: limits.unwrap_or(None), span })
    }

    /// The limits behind `within`: one number would be a limit that nothing keeps.
    fn limits(&mut self, dim: &ast::Dim) -> Option<Range> {
        let range = self.range(dim, Quantity::Length)?;
        if range.low < range.high {
            return Some(range);
        }
        self.report(
            Diagnostic::error("E0211", dim.span, "a measure needs two limits").label("one number").help(format!(
                "write `{} .. {}`, or `{} ±0.1`",
                range.low,
                range.low + 0.1,
                range.low
            )),
        );
        None
    }

    fn face(&mut self, face: &ast::Face, built: &Assembled) -> Option<FacePath> {
        let component = self.one_component(&face.component, built)?;
        let part = &built.parts[built.components[component].part];
        self.face_of(&format!("part `{}`", part.name), &part.features, &face.face.text, face.face.span)?;
        Some(FacePath { component, face: face.face.text.clone(), span: face.span })
    }

    /// Follows a face's name through features and groups, as far as they are known: to the name of the side.
    fn face_of(&mut self, owner: &str, features: &[Feature], path: &str, span: Span) -> Option<()> {
        let (step, rest) = path.split_once('.').map_or((path, None), |(step, rest)| (step, Some(rest)));
        let (name, index) = step.split_once('[').map_or((step, None), |(name, index)| (name, Some(index)));
        let Some(feature) = features.iter().find(|f| f.name == name) else {
            if self.failed.contains(name) {
                return None;
            }
            let message = format!("{owner} has no feature `{name}`");
            let diagnostic = Diagnostic::error("E0201", span, message).label("unknown feature");
            let names = features.iter().map(|f| f.name.as_str());
            self.report(match nearest(name, names.clone()) {
                Some(near) => diagnostic.suggest(
                    format!("did you mean `{near}{}`?", &path[name.len()..]),
                    face_end(span, path.len()),
                    format!("{near}{}", &path[name.len()..]),
                ),
                None => diagnostic.help(format!("its features: {}", names.collect::<Vec<_>>().join(", "))),
            });
            return None;
        };
        let count = feature.copies.len();
        let number = index.map(|i| i.trim_end_matches(']').parse().unwrap_or(usize::MAX));
        if number.is_some() != feature.patterned || !(1..=count).contains(&number.unwrap_or(1)) {
            let label = if number.is_none() { "which one?" } else { "no such copy" };
            self.no_such_copy(feature, label, span);
            return None;
        }
        match (&feature.copies.first()?.shape, rest) {
            (Shape::Group { features }, Some(rest)) => self.face_of(&format!("group `{name}`"), features, rest, span),
            (_, Some(_)) => Some(()),
            (shape, None) => {
                let what = if matches!(shape, Shape::Group { .. }) { "a group" } else { "a feature" };
                let message = format!("expected a face, `{name}` is {what}");
                let help =
                    "a face ends with its side: `slab.top`, `bore[2].side`, `block.+x`, `mount.screw.head.bottom`";
                self.report(Diagnostic::error("E0203", span, message).label("its side is missing").help(help));
                None
            }
        }
    }

    fn no_such_copy(&mut self, feature: &Feature, label: &str, span: Span) {
        let name = &feature.name;
        let (message, help) = match feature.patterned {
            true => (format!("`{name}` has {}", copies(feature.copies.len())), format!("write `{name}[1]`")),
            false => (format!("`{name}` is no pattern"), format!("write `{name}`")),
        };
        self.report(Diagnostic::error("E0505", span, message).label(label).help(help));
    }

    /// The one component that a segment such as `pin[2]` names.
    fn one_component(&mut self, segment: &ast::Segment, built: &Assembled) -> Option<usize> {
        let name = &segment.name.text;
        let Some(group) = built.groups.get(name) else {
            if self.written.contains(name) {
                return None;
            }
            let message = format!("no component is named `{name}`");
            let diagnostic = Diagnostic::error("E0201", segment.name.span, message).label("unknown component");
            let known = built.groups.keys().map(String::as_str);
            self.report(match nearest(name, known.clone()) {
                Some(near) => diagnostic.meant(segment.name.span, near),
                None => diagnostic.help(format!("components: {}", known.collect::<Vec<_>>().join(", "))),
            });
            return None;
        };
        let chosen = self.chosen(segment, group.len())?;
        if let [one] = chosen.as_slice() {
            return Some(group[*one]);
        }
        let message = format!("`{name}` names {} components, and a measure starts and ends at one", chosen.len());
        let first = chosen.first().map_or(1, |i| i + 1);
        self.report(Diagnostic::error("E0505", segment.name.span, message).label("which one?").suggest(
            format!("write `{name}[{first}]`"),
            segment_span(segment),
            format!("{name}[{first}]"),
        ));
        None
    }
}

/// The last `len` bytes of a face: its path in the part.
fn face_end(span: Span, len: usize) -> Span {
    Span { start: span.end - len as u32, ..span }
}

/// A segment with its index.
fn segment_span(segment: &ast::Segment) -> Span {
    Span { end: segment.index.as_ref().map_or(segment.name.span.end, |i| i.span.end), ..segment.name.span }
}
