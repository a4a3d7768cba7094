//! Text to tree. Nothing outside this folder knows the parser generator.
//!
//! Each item is parsed by itself. When one does not parse, the fault is reported, the statement that holds it is blanked
//! out, and the item is tried again, so that one run reports several faults of one block.

mod build;
mod words;

use super::ast::{File, Gap, Line};
use super::faults::{self, Fault};
use super::scan::{scan, strip_comment};
use crate::diag::{Diagnostic, Span};
use build::Builder;
use pest::Parser;
use std::borrow::Cow;
use words::words;

/// A spec longer than this is a mistake (bytes).
const MAX_TEXT: usize = 1 << 20;
/// Faults reported per item, and per file.
const MAX_FAULTS_PER_ITEM: usize = 8;
const MAX_FAULTS: usize = 40;

#[derive(pest_derive::Parser)]
#[grammar = "grammar/gonogo.pest"]
struct Grammar;

/// The tree of `text`, without what could not be read, and why that could not be read. `file` is the text's index in
/// [`crate::diag::Sources`].
pub fn parse(text: &str, file: u32) -> (File, Vec<Diagnostic>) {
    if text.len() > MAX_TEXT {
        let message = format!("this file has {} bytes, the limit is {MAX_TEXT}", text.len());
        return (File::default(), vec![Diagnostic::error("E0101", Span { file, start: 0, end: 0 }, message)]);
    }
    let (chunks, mut diagnostics) = scan(text, file);
    let mut tree = File::default();
    for chunk in chunks.iter().filter(|chunk| !chunk.broken) {
        let builder = Builder { file, offset: chunk.start };
        tree.lines.extend(parse_chunk(&text[chunk.start..chunk.end], &builder, &mut diagnostics));
    }
    tree.end = parse_tail(&text[chunks.last().map_or(0, |chunk| chunk.end)..]);
    diagnostics.sort_by_key(|d| d.labels[0].span.start);
    diagnostics.truncate(MAX_FAULTS);
    (tree, diagnostics)
}

fn parse_chunk(text: &str, builder: &Builder, diagnostics: &mut Vec<Diagnostic>) -> Option<Line> {
    let mut text = Cow::Borrowed(text.strip_prefix('\u{feff}').unwrap_or(text));
    for _ in 0..MAX_FAULTS_PER_ITEM {
        let error = match Grammar::parse(Rule::chunk, &text) {
            Ok(mut pairs) => return builder.lines(pairs.next()?).0.pop(),
            Err(error) => error,
        };
        let fault = fault(&error);
        diagnostics.push(faults::describe(&text, &fault, builder.file, builder.offset));
        text = Cow::Owned(without_statement(&text, fault.at)?);
        if text.lines().all(|line| strip_comment(line).trim().is_empty()) {
            return None;
        }
    }
    None
}

/// The comments and blank lines behind the last item.
fn parse_tail(text: &str) -> Vec<Gap> {
    let comment = |line: &str| match line.trim() {
        "" => Gap::Blank,
        words => Gap::Comment(words.to_string()),
    };
    // The first line is the rest of the line of the last item.
    text.lines().skip(usize::from(text.starts_with(['\n', '\r']))).map(comment).collect()
}

fn fault(error: &pest::error::Error<Rule>) -> Fault {
    let at = match error.location {
        pest::error::InputLocation::Pos(at) | pest::error::InputLocation::Span((at, _)) => at,
    };
    let mut expected: Vec<&'static str> = match &error.variant {
        pest::error::ErrorVariant::ParsingError { positives, .. } => {
            positives.iter().flat_map(|r| words(*r)).copied().collect()
        }
        pest::error::ErrorVariant::CustomError { .. } => Vec::new(),
    };
    let mut seen = std::collections::BTreeSet::new();
    expected.retain(|word| seen.insert(*word));
    Fault { at, expected }
}

/// The text with the statement at `at` replaced by spaces; `None` if that would tear a block open.
fn without_statement(text: &str, at: usize) -> Option<String> {
    let (start, end) = statement_at(text, at);
    let statement = &text[start..end];
    let code: String = statement.lines().map(strip_comment).collect();
    if code.trim().is_empty() || code.matches('{').count() != code.matches('}').count() || code.contains('"') {
        return None;
    }
    let blank: String = statement.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }).collect();
    Some(format!("{}{blank}{}", &text[..start], &text[end..]))
}

/// Start and end of the lines of the statement at `at`: lines joined by open parentheses are one statement.
fn statement_at(text: &str, at: usize) -> (usize, usize) {
    let (mut start, mut end, mut depth) = (0, 0, 0i32);
    for line in text.split_inclusive('\n') {
        if depth <= 0 {
            (start, depth) = (end, 0);
        }
        end += line.len();
        let code = strip_comment(line);
        depth += code.matches('(').count() as i32 - code.matches(')').count() as i32;
        if at < end && depth <= 0 {
            break;
        }
    }
    (start, end)
}
