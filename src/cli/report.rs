//! Diagnostics as text.

use crate::diag::{Diagnostic, Sources};

/// With place, notes and help, for people.
pub fn human(diagnostic: &Diagnostic, sources: &Sources, _colour: bool) -> String {
    let mut text = short(diagnostic, sources);
    for note in &diagnostic.notes {
        text += &format!("\n  note: {note}");
    }
    if let Some(help) = &diagnostic.help {
        text += &format!("\n  help: {help}");
    }
    text
}

/// `file:line:column: error[E0201]: message`
pub fn short(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let kind = if diagnostic.is_error() { "error" } else { "warning" };
    let span = diagnostic.labels.first().map(|l| l.span).unwrap_or_default();
    let (name, text) = sources.files.get(span.file as usize).map_or(("", ""), |(name, text)| (name, text));
    let before = text.get(..span.start as usize).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    format!("{name}:{line}:{column}: {kind}[{}]: {}", diagnostic.code, diagnostic.message)
}

/// One JSON object.
pub fn json(diagnostic: &Diagnostic, _sources: &Sources) -> String {
    serde_json::to_string(diagnostic).unwrap_or_default()
}
