//! Text to tree. Nothing outside this folder knows the parser generator.
//!
//! Each item is parsed by itself. When one does not parse, the fault is reported, the statement that holds it is blanked
//! out, and the item is tried again, so that one run reports several faults of one block.

mod build;
mod words;

use super::ast::{File, Gap, Line};
use super::faults::{self, Fault};
use super::lines::strip_comment;
use super::scan::{self, Chunk, Scanned, scan};
use super::{heads, letters};
use crate::diag::{self, Diagnostic, Fix, Span};
use build::Builder;
use pest::Parser;
use rayon::prelude::*;
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
        let lost = vec![Span { file, start: 0, end: text.len() as u32 }];
        let fault = Diagnostic::error("E0101", Span { file, start: 0, end: 0 }, message);
        return (File { lost, ..File::default() }, vec![fault]);
    }
    let letters::Cleaned { text: clean, mut diagnostics, lost } = letters::clean(text, file);
    let (clean, found) = with_heads(clean, file);
    diagnostics.extend(found);
    let scanned = scan(&clean, file, &reads);
    diagnostics.extend(checked(scanned.diagnostics.clone(), &clean));
    let clean = repaired(clean, &scanned);
    let mut tree = File { lost, ..File::default() };
    tree.lost.extend(scanned.lost.iter().map(|r| Span { file, start: r.start as u32, end: r.end as u32 }));
    let mut end = 0;
    for (chunk, sound) in scanned.chunks.iter().zip(sound_items(&clean, file, &scanned.chunks)) {
        let builder = Builder { file, offset: chunk.start };
        end = chunk.end;
        if chunk.broken || diagnostics.len() >= MAX_FAULTS {
            tree.lost.push(builder.whole(chunk.end - chunk.start));
            continue;
        }
        if let Some(line) = sound {
            tree.lines.push(line);
            continue;
        }
        tree.lines.extend(parse_chunk(&clean[chunk.start..chunk.end], &builder, &mut diagnostics, &mut tree.lost));
    }
    tree.end = parse_tail(&clean[end..]);
    diagnostics.sort_by_key(|d| d.labels[0].span.start);
    diagnostics.truncate(MAX_FAULTS);
    (tree, diagnostics)
}

/// The items that parse as they stand, on all threads where there are many; nothing in the place of the others.
fn sound_items(text: &str, file: u32, chunks: &[Chunk]) -> Vec<Option<Line>> {
    /// Fewer items than this are read sooner than threads are woken.
    const MANY: usize = 64;
    let read = |chunk: &Chunk| {
        let mut pairs = Grammar::parse(Rule::chunk, text.get(chunk.start..chunk.end)?).ok()?;
        Builder { file, offset: chunk.start }.lines(pairs.next()?).0.pop()
    };
    let sound = |chunk: &Chunk| if chunk.broken { None } else { read(chunk) };
    match chunks.len() {
        0..MANY => chunks.iter().map(sound).collect(),
        _ => chunks.par_iter().map(sound).collect(),
    }
}

/// Whether an item parses as it stands.
fn reads(item: &str) -> bool {
    Grammar::parse(Rule::chunk, item).is_ok()
}

/// The text with the heads of its blocks mended where it does not parse.
fn with_heads(text: String, file: u32) -> (String, Vec<Diagnostic>) {
    let (mended, found) = heads::mended(&text, file, &[]);
    if found.is_empty() {
        return (text, found);
    }
    let sound = scan::sound(&text, &found, &reads);
    if sound.is_empty() { (mended, found) } else { heads::mended(&text, file, &sound) }
}

/// Keeps the fix of each bracket that leaves fewer of them unpaired and a statement that can be read.
fn checked(mut diagnostics: Vec<Diagnostic>, text: &str) -> Vec<Diagnostic> {
    let count = diagnostics.len();
    // Nobody pastes the help of a text as broken as that.
    let hopeless = count > MAX_FAULTS_PER_ITEM && text.len() > 1 << 16 || count > MAX_FAULTS;
    for diagnostic in &mut diagnostics {
        if hopeless {
            diagnostic.fixes.clear();
        }
        let helps = |fix: &Fix| {
            let (mended, made) = diag::apply(text, fix.edits.first().map_or(0, |e| e.span.file), [fix]);
            let scanned = scan(&mended, 0, &reads);
            let pairs = !made.is_empty() && scanned.diagnostics.len() < count;
            pairs && is_readable(&repaired(mended, &scanned), &scanned, fix)
        };
        let best = diagnostic.fixes.iter().find(|fix| helps(fix)).cloned();
        diagnostic.help = best.as_ref().map(|fix| fix.title.clone()).or(diagnostic.help.take());
        diagnostic.fixes = best.into_iter().collect();
    }
    diagnostics
}

/// Whether the statement that a fix has changed parses, as far as its item does up to there.
fn is_readable(mended: &str, scanned: &Scanned, fix: &Fix) -> bool {
    let Some(at) = fix.edits.first().map(|edit| edit.span.start as usize) else { return false };
    let Some(chunk) = scanned.chunks.iter().find(|chunk| (chunk.start..=chunk.end).contains(&at)) else { return true };
    let text = &mended[chunk.start..chunk.end];
    match Grammar::parse(Rule::chunk, text) {
        Err(error) if !chunk.broken => {
            let (start, end) = statement_at(text, at.saturating_sub(chunk.start));
            !(start..end).contains(&fault(&error).at)
        }
        _ => true,
    }
}

fn repaired(text: String, scanned: &Scanned) -> String {
    let mut bytes = text.into_bytes();
    scanned.repairs.iter().for_each(|&(at, byte)| bytes[at] = byte);
    // Blanks may have been put over whole characters only.
    String::from_utf8(bytes).unwrap_or_else(|e| String::from_utf8_lossy(e.as_bytes()).into_owned())
}

fn parse_chunk(text: &str, builder: &Builder, diagnostics: &mut Vec<Diagnostic>, lost: &mut Vec<Span>) -> Option<Line> {
    let mut text = Cow::Borrowed(text);
    for _ in 0..MAX_FAULTS_PER_ITEM {
        let error = match Grammar::parse(Rule::chunk, &text) {
            Ok(mut pairs) => return builder.lines(pairs.next()?).0.pop(),
            Err(error) => error,
        };
        let fault = fault(&error);
        let mut diagnostic = faults::describe(&text, &fault, builder.file, builder.offset);
        diagnostic.fixes.retain(|fix| gets_further(&text, fix, &fault, builder));
        diagnostics.push(diagnostic);
        let (start, end) = statement_at(&text, fault.at);
        let Some(rest) = without_statement(&text, start, end) else {
            lost.push(builder.whole(text.len()));
            return None;
        };
        lost.push(builder.within(start, end));
        text = Cow::Owned(rest);
        if text.lines().all(|line| strip_comment(line).trim().is_empty()) {
            return None;
        }
    }
    lost.push(builder.whole(text.len()));
    None
}

/// Whether the parser comes further with a fix: its help has to compile when pasted.
fn gets_further(text: &str, fix: &Fix, fault: &Fault, builder: &Builder) -> bool {
    let shifted = |edit: &diag::Edit| {
        let span = Span {
            start: edit.span.start - builder.offset as u32,
            end: edit.span.end - builder.offset as u32,
            ..edit.span
        };
        diag::Edit { span, text: edit.text.clone() }
    };
    let local = Fix { edits: fix.edits.iter().map(shifted).collect(), ..fix.clone() };
    let (mended, made) = diag::apply(text, builder.file, [&local]);
    let behind = |edit: &diag::Edit| (edit.span.start as usize + edit.text.len()).max(fault.at);
    let least = local.edits.iter().map(behind).max().unwrap_or(fault.at);
    !made.is_empty()
        && match Grammar::parse(Rule::chunk, &mended) {
            Ok(_) => true,
            Err(error) => self::fault(&error).at > least,
        }
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

/// The text with a statement replaced by spaces; `None` if that would tear a block open.
fn without_statement(text: &str, start: usize, end: usize) -> Option<String> {
    let statement = &text[start..end];
    let code: String = statement.lines().map(strip_comment).collect();
    if code.trim().is_empty() || code.matches('{').count() != code.matches('}').count() {
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
