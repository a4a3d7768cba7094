//! Where a span is: file, line and column as people count them.

use crate::diag::{Sources, Span};
use std::ops::Range;

/// A span with its ends in lines and columns, both from 1; columns count characters.
pub struct Place<'a> {
    pub file: &'a str,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
}

impl<'a> Place<'a> {
    pub fn of(sources: &'a Sources, span: Span) -> Place<'a> {
        let file = sources.files.get(span.file as usize).map_or("", |(name, _)| name.as_str());
        let text = text_of(sources, span);
        let Range { start, end } = bytes(text, span);
        let ((line, column), (end_line, end_column)) = (line_and_column(text, start), line_and_column(text, end));
        Place { file, line, column, end_line, end_column }
    }
}

fn line_and_column(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let line_start = before.rfind('\n').map_or(0, |i| i + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

/// The text that a span points into.
pub fn text_of(sources: &Sources, span: Span) -> &str {
    sources.files.get(span.file as usize).map_or("", |(_, text)| text.as_str())
}

/// The span as a range inside the text and on character boundaries.
pub fn bytes(text: &str, span: Span) -> Range<usize> {
    let start = text.floor_char_boundary((span.start as usize).min(text.len()));
    let end = text.ceil_char_boundary((span.end as usize).min(text.len()));
    start..end.max(start)
}
