//! Faults of meaning beside faults of the text.
//!
//! In: what is wrong with the meaning of a spec of which some statements could not be read. Out: what of it cannot come from
//! those statements: one mistake is one diagnostic. A name that stands in a statement that was not read is not unknown, and
//! what seems to be missing may stand there.

use super::load::Tree;
use crate::diag::{Diagnostic, Sources, Span};
use std::collections::BTreeSet;

/// Faults of meaning that one statement has by itself.
const OWN: [&str; 12] =
    ["E0201", "E0202", "E0203", "E0204", "E0205", "E0206", "E0210", "E0211", "E0301", "E0302", "E0306", "E0208"];

/// Whether the meaning is worth looking at: every file is there and is of this language.
pub fn is_worth_resolving(diagnostics: &[Diagnostic], trees: &[Tree], sources: &Sources) -> bool {
    let of_text = |d: &Diagnostic| d.code.starts_with("E01") && d.code != "E0105" || d.code == "E0309";
    let readable = diagnostics.iter().filter(|d| d.is_error()).all(of_text);
    // Without its title block a number means anything, and what a file uses may define anything.
    let head = ["gonogo", "units", "tolerances", "use"];
    readable && !lost(trees, sources).any(|text| words(text).any(|w| head.contains(&w)))
}

/// The diagnostics that hold whatever the lost statements say.
pub fn independent(found: Vec<Diagnostic>, trees: &[Tree], sources: &Sources) -> Vec<Diagnostic> {
    if trees.iter().all(|tree| tree.tree.lost.is_empty()) {
        return found;
    }
    let lost: BTreeSet<&str> = lost(trees, sources).flat_map(words).collect();
    let named = |d: &Diagnostic| words(text_at(sources, d.labels[0].span)).any(|word| lost.contains(word));
    found.into_iter().filter(|d| OWN.contains(&d.code) && !named(d)).collect()
}

fn lost<'a>(trees: &'a [Tree], sources: &'a Sources) -> impl Iterator<Item = &'a str> {
    trees.iter().flat_map(|tree| &tree.tree.lost).map(|span| text_at(sources, *span))
}

fn text_at(sources: &Sources, span: Span) -> &str {
    let text = sources.files.get(span.file as usize).map_or("", |(_, text)| text.as_str());
    text.get(span.start as usize..span.end as usize).unwrap_or_default()
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}
