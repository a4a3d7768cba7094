//! Diagnostics as text: for people, for editors, for programs.
//!
//! In: diagnostics and the texts they point into. Out: strings; whoever calls decides where they go. The only file that
//! knows the snippet renderer, whose output is held by tests.

use crate::diag::{Diagnostic, Severity, Sources, Span};
use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use std::ops::Range;

/// Each diagnostic with its piece of the source, and a line that counts them. Empty when there are none.
pub fn human(sources: &Sources, diagnostics: &[Diagnostic], colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() }.decor_style(DecorStyle::Ascii);
    let mut text = String::new();
    for diagnostic in diagnostics {
        text += &renderer.render(&[group(sources, diagnostic)]);
        text += "\n\n";
    }
    text + &summary(diagnostics)
}

/// One line each: `file:line:column: error[E0301]: message`.
pub fn short(sources: &Sources, diagnostics: &[Diagnostic], _colour: bool) -> String {
    let line = |d: &Diagnostic| {
        let place = place(sources, d.labels.first().map_or(Span::default(), |label| label.span));
        format!("{}:{}:{}: {}[{}]: {}\n", place.file, place.line, place.column, word(d.severity), d.code, d.message)
    };
    diagnostics.iter().map(line).collect()
}

/// One JSON object a line: code, severity, message, labels with byte offsets and 1-based lines and columns, help, notes.
pub fn json(sources: &Sources, diagnostics: &[Diagnostic], _colour: bool) -> String {
    let label = |label: &crate::diag::Label| {
        let (start, end) = (place(sources, label.span), place(sources, Span { start: label.span.end, ..label.span }));
        serde_json::json!({
            "file": start.file, "start": label.span.start, "end": label.span.end,
            "line": start.line, "column": start.column, "end_line": end.line, "end_column": end.column,
            "text": label.text, "primary": label.primary,
        })
    };
    let line = |d: &Diagnostic| {
        let labels: Vec<_> = d.labels.iter().map(label).collect();
        let value = serde_json::json!({
            "code": d.code, "severity": word(d.severity), "message": d.message,
            "labels": labels, "help": d.help, "notes": d.notes,
        });
        format!("{value}\n")
    };
    diagnostics.iter().map(line).collect()
}

fn group<'a>(sources: &'a Sources, diagnostic: &'a Diagnostic) -> Group<'a> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group = Group::with_title(level.primary_title(&diagnostic.message).id(diagnostic.code));
    for (index, (name, text)) in sources.files.iter().enumerate() {
        let labels = diagnostic.labels.iter().filter(|label| label.span.file as usize == index);
        let annotations: Vec<_> = labels
            .map(|label| {
                let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
                let text = (!label.text.is_empty()).then_some(label.text.as_str());
                kind.span(bytes(text_of(sources, label.span), label.span)).label(text)
            })
            .collect();
        if !annotations.is_empty() {
            group = group.element(Snippet::source(text.as_str()).path(name).annotations(annotations));
        }
    }
    for note in &diagnostic.notes {
        group = group.element(Level::NOTE.message(note));
    }
    match &diagnostic.help {
        Some(help) => group.element(Level::HELP.message(help)),
        None => group,
    }
}

fn summary(diagnostics: &[Diagnostic]) -> String {
    let errors = diagnostics.iter().filter(|d| d.is_error()).count();
    let counted = |count: usize, word: &str| match count {
        0 => None,
        1 => Some(format!("1 {word}")),
        n => Some(format!("{n} {word}s")),
    };
    let counts = [counted(errors, "error"), counted(diagnostics.len() - errors, "warning")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    if counts.is_empty() { String::new() } else { format!("{}\n", counts.join(", ")) }
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

struct Place<'a> {
    file: &'a str,
    line: usize,
    column: usize,
}

/// Line and column of a span's start, both from 1; columns count characters.
fn place(sources: &Sources, span: Span) -> Place<'_> {
    let file = sources.files.get(span.file as usize).map_or("", |(name, _)| name.as_str());
    let text = text_of(sources, span);
    let before = &text[..bytes(text, span).start];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    Place { file, line: before.matches('\n').count() + 1, column: before[line_start..].chars().count() + 1 }
}

fn text_of(sources: &Sources, span: Span) -> &str {
    sources.files.get(span.file as usize).map_or("", |(_, text)| text.as_str())
}

/// The span as a range inside the text and on character boundaries.
fn bytes(text: &str, span: Span) -> Range<usize> {
    let start = text.floor_char_boundary((span.start as usize).min(text.len()));
    let end = text.ceil_char_boundary((span.end as usize).min(text.len()));
    start..end.max(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn example() -> (Sources, Vec<Diagnostic>) {
        let text = "gonogo 1\nlet a = 6 ±0.1\nlet a = 7\n".to_string();
        let span = |start, end| Span { file: 0, start, end };
        let diagnostic = Diagnostic::error("E0202", span(29, 30), "dimension `a` is defined twice")
            .label("defined again")
            .also(span(13, 14), "first defined here")
            .note("names are unique in a file")
            .help("name it `a_2`");
        (Sources { files: vec![("plate.gng".to_string(), text)] }, vec![diagnostic])
    }

    #[test]
    fn human_text() {
        let (sources, diagnostics) = example();
        let expected = "\
error[E0202]: dimension `a` is defined twice
 --> plate.gng:3:5
  |
2 | let a = 6 ±0.1
  |     - first defined here
3 | let a = 7
  |     ^ defined again
  |
  = note: names are unique in a file
  = help: name it `a_2`

1 error
";
        assert_eq!(human(&sources, &diagnostics, false), expected);
        assert!(human(&sources, &diagnostics, true).contains("\u{1b}["));
        assert_eq!(human(&sources, &[], false), "");
    }

    #[test]
    fn short_text_counts_characters() {
        let (sources, diagnostics) = example();
        assert_eq!(
            short(&sources, &diagnostics, false),
            "plate.gng:3:5: error[E0202]: dimension `a` is defined twice\n"
        );
    }

    #[test]
    fn json_has_one_object_a_line() {
        let (sources, diagnostics) = example();
        let value: serde_json::Value = serde_json::from_str(&json(&sources, &diagnostics, false)).unwrap();
        assert_eq!(value["code"], "E0202");
        assert_eq!(value["labels"][1]["line"], 2);
        assert_eq!(value["labels"][0]["primary"], true);
    }

    #[test]
    fn spans_outside_their_text_are_harmless() {
        let (sources, _) = example();
        for span in [
            Span { file: 9, start: 3, end: 4 },
            Span { file: 0, start: 21, end: 22 },
            Span { file: 0, start: 900, end: 2 },
        ] {
            let diagnostics = [Diagnostic::error("E0101", span, "x")];
            human(&sources, &diagnostics, false);
            json(&sources, &diagnostics, false);
        }
    }
}
