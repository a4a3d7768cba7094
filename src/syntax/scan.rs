//! Cuts a file into items before anything is parsed, and finds the block that lost its brace.
//!
//! In: text. Out: the stretches of text that hold one item each, diagnostics for braces and parentheses that do not pair
//! up, and the repairs with which the parser can read on. A parser alone would report a lost `}` at the next item;
//! indentation tells where it was meant to be.

use super::lines::{
    line_end, line_number, outside_strings, owner, starts_block_item, starts_statement, strip_comment, trailing_gap,
};
use crate::diag::{Diagnostic, Span};
use std::collections::BTreeMap;
use std::ops::Range;

/// Parentheses nested deeper than this are refused, which bounds the parser's recursion.
pub const MAX_NESTING: usize = 32;

/// More operators than this inside one pair of parentheses are refused: a sum is as deep as it is long.
const MAX_OPERATORS: usize = 300;

/// Faults of brackets after which the rest is not looked into: they cost time, and nobody reads them.
const ENOUGH: usize = 100;

/// A stretch of the text that holds one item and the comments above it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk {
    pub start: usize,
    pub end: usize,
    /// Its brackets do not pair up: reported already, not worth parsing.
    pub broken: bool,
}

/// What a text is made of.
pub struct Scanned {
    pub chunks: Vec<Chunk>,
    pub diagnostics: Vec<Diagnostic>,
    /// Bytes to be put in the place of others, so that the brackets pair up.
    pub repairs: Vec<(usize, u8)>,
    /// Statements that cannot be read.
    pub lost: Vec<Range<usize>>,
}

/// Cuts `text` at the lines that begin outside all brackets. `reads` tells whether an item parses.
///
/// Where brackets seem not to pair up, the lines tell where they were meant to; but that is a guess, and an item that parses
/// as it stands is right, however it is laid out.
///
/// Where braces do not pair up, indentation is asked a second time: a line that stands no deeper than the head of the block
/// it would be in does not belong to it. A text whose braces pair up may be indented as it likes.
pub fn scan(text: &str, file: u32, reads: &dyn Fn(&str) -> bool) -> Scanned {
    let plain = scan_once(text, file, Guess::BySlips, &[]);
    if plain.diagnostics.is_empty() {
        return plain;
    }
    let sound = sound(text, &plain.diagnostics, reads);
    let plain = if sound.is_empty() { plain } else { scan_once(text, file, Guess::BySlips, &sound) };
    if !plain.diagnostics.iter().any(|d| d.code == "E0102") {
        return plain;
    }
    let strict = scan_once(text, file, Guess::ByIndent, &sound);
    if strict.diagnostics.len() <= plain.diagnostics.len() { strict } else { plain }
}

/// The items that parse as they stand, of those that guesses have found fault with.
pub fn sound(text: &str, faults: &[Diagnostic], reads: &dyn Fn(&str) -> bool) -> Vec<Chunk> {
    let mut scanner = Scanner::new(text, 0, Guess::Nothing, &[]);
    scanner.run();
    if scanner.unpaired {
        return Vec::new();
    }
    let blamed = |chunk: &Chunk| {
        let place = |d: &Diagnostic| d.labels[0].span.start as usize;
        faults.iter().any(|d| (chunk.start..=chunk.end).contains(&place(d)))
    };
    scanner.chunks.retain(|chunk| !chunk.broken && blamed(chunk) && reads(&text[chunk.start..chunk.end]));
    scanner.chunks
}

fn scan_once(text: &str, file: u32, guess: Guess, sound: &[Chunk]) -> Scanned {
    let mut scanner = Scanner::new(text, file, guess, sound);
    scanner.run();
    let Scanner { chunks, diagnostics, repairs, lost, .. } = scanner;
    Scanned { chunks, diagnostics, repairs, lost }
}

/// What is taken for a sign that a bracket was forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Guess {
    Nothing,
    /// Statements inside parentheses, blocks inside blocks, a `}` below that of an outer block.
    BySlips,
    /// And every line that stands too far left.
    ByIndent,
}

/// Where a lost bracket belongs, for people. A line is counted out only when it is told.
#[derive(Clone, Copy)]
enum Before {
    ThisLine,
    /// The line of this byte.
    Line(usize),
    End,
}

/// An opening bracket that still waits for its partner.
struct Open {
    bracket: u8,
    at: usize,
    indent: usize,
    /// Of the first line inside; a block's lines say where it ends.
    inner: Option<usize>,
    /// Its statements begin on its own line: `{ z = 3`.
    filled: bool,
    operators: usize,
}

struct Scanner<'a> {
    text: &'a str,
    file: u32,
    guess: Guess,
    /// Items that are known to be right, in their order.
    sound: &'a [Chunk],
    open: Vec<Open>,
    /// How many of the open blocks begin at each indent.
    blocks_at: BTreeMap<usize, usize>,
    chunks: Vec<Chunk>,
    diagnostics: Vec<Diagnostic>,
    repairs: Vec<(usize, u8)>,
    lost: Vec<Range<usize>>,
    broken: bool,
    /// Some bracket has no partner.
    unpaired: bool,
    early: Option<Early>,
    /// The end of the last code before the line at hand.
    code_end: usize,
    line_start: usize,
}

/// A `}` that ends an item but does not line up with it: if one is left over below, this one came too early.
struct Early {
    at: usize,
    /// Of the `{` that it closed.
    open: usize,
    /// The chunk it ended.
    chunk: usize,
}

impl<'a> Scanner<'a> {
    fn new(text: &'a str, file: u32, guess: Guess, sound: &'a [Chunk]) -> Self {
        Scanner {
            text,
            file,
            guess,
            sound,
            open: Vec::new(),
            blocks_at: BTreeMap::new(),
            chunks: Vec::new(),
            diagnostics: Vec::new(),
            repairs: Vec::new(),
            lost: Vec::new(),
            broken: false,
            unpaired: false,
            early: None,
            code_end: 0,
            line_start: 0,
        }
    }

    fn run(&mut self) {
        let mut start = 0;
        for line in self.text.split_inclusive('\n') {
            if !self.take_sound(start) {
                self.line(start, line);
            }
            start += line.len();
        }
        self.take_sound(self.text.len());
        self.lose_all_open(Before::End);
        self.finish_chunk(self.text.len());
    }

    /// Whether the line at `start` belongs to an item that is known to be right. Such an item is taken whole.
    fn take_sound(&mut self, start: usize) -> bool {
        while let Some((chunk, later)) = self.sound.split_first().filter(|(chunk, _)| chunk.end <= start) {
            if !self.open.is_empty() {
                self.lose_all_open(Before::Line(chunk.start));
            }
            self.finish_chunk(chunk.start);
            self.chunks.push(chunk.clone());
            self.sound = later;
            self.code_end = chunk.end;
        }
        self.sound.first().is_some_and(|chunk| chunk.start <= start)
    }

    fn line(&mut self, start: usize, line: &str) {
        let code = strip_comment(line);
        self.line_start = start;
        let words = code.trim_start();
        if words.trim_end().is_empty() {
            return;
        }
        let indent = code.len() - words.len();
        self.lose_parentheses_before(words);
        if self.guess == Guess::ByIndent && !words.starts_with('}') {
            self.lose_blocks_left_by(indent);
        }
        if let Some(open) = self.open.last_mut().filter(|o| o.bracket == b'{') {
            open.inner.get_or_insert(indent);
        }
        if self.guess != Guess::Nothing && indent == 0 && !self.open.is_empty() && starts_block_item(words) {
            self.lose_all_open(Before::Line(start));
        }
        if self.open.is_empty() && !words.starts_with('}') {
            self.finish_chunk(start);
            // Comments above an item belong to it.
            let start = self.chunks.last().map_or(0, |chunk| chunk.end);
            self.chunks.push(Chunk { start, end: start, broken: false });
        }
        if indent == 0 && starts_block_item(words) {
            self.early = None;
        }
        self.brackets(start, code, indent);
        self.code_end = start + code.trim_end().len();
    }

    fn brackets(&mut self, start: usize, code: &str, indent: usize) {
        for (at, byte) in outside_strings(code) {
            match byte {
                b'(' | b'{' => {
                    let filled = !code.as_bytes()[at + 1..].trim_ascii().is_empty();
                    self.open(Open { bracket: byte, at: start + at, indent, inner: None, filled, operators: 0 });
                }
                b')' => self.close(b'(', start + at, None),
                b'}' => self.close(b'{', start + at, code[..at].trim().is_empty().then_some(indent)),
                b'+' | b'-' | b'*' | b'/' => self.operator(),
                _ => {}
            }
        }
    }

    fn operator(&mut self) {
        let Some(open) = self.open.last_mut() else { return };
        open.operators += 1;
        if open.bracket == b'(' && open.operators == MAX_OPERATORS {
            let at = open.at;
            let message = format!("more than {MAX_OPERATORS} operators stand in these parentheses");
            let help = "name parts of the sum with `let`";
            self.report(Diagnostic::error("E0212", self.span(at, 1), message).label("opened here").help(help));
        }
    }

    fn open(&mut self, open: Open) {
        if self.open.len() == MAX_NESTING && !self.broken {
            let message = format!("brackets are nested more than {MAX_NESTING} deep");
            let help = "name an intermediate result with `let`";
            self.report(Diagnostic::error("E0101", self.span(open.at, 1), message).label("too deep here").help(help));
        }
        if open.bracket == b'{' {
            *self.blocks_at.entry(open.indent).or_default() += 1;
        }
        self.open.push(open);
    }

    fn pop(&mut self) -> Option<Open> {
        let open = self.open.pop()?;
        if let Some(blocks) = self.blocks_at.get_mut(&open.indent).filter(|_| open.bracket == b'{') {
            *blocks -= 1;
        }
        Some(open)
    }

    /// `indent` is where a `}` stands when it begins its line.
    fn close(&mut self, bracket: u8, at: usize, indent: Option<usize>) {
        if bracket == b'{' {
            if let Some(indent) = indent {
                self.lose_blocks_deeper_than(indent, at);
            }
            while self.open.last().is_some_and(|o| o.bracket == b'(') {
                self.lose_last(Before::Line(at), at);
            }
        }
        match self.open.last() {
            Some(open) if open.bracket == bracket => {
                let (from, lines_up) = (open.at, indent == Some(open.indent));
                self.pop();
                // The text between is looked at for an outermost block only: nested ones would be read once for each around them.
                if self.open.is_empty() && bracket == b'{' && !lines_up && self.text[from..at].contains('\n') {
                    let chunk = self.chunks.len().saturating_sub(1);
                    self.early = Some(Early { at, open: from, chunk });
                }
            }
            _ if bracket == b'(' => self.closes_no_parenthesis(at),
            _ => self.closes_no_block(at),
        }
    }

    /// A `)` too many, or a `(` too few: `cylinder d = 9)`.
    fn closes_no_parenthesis(&mut self, at: usize) {
        self.unpaired = true;
        if self.has_enough() {
            return;
        }
        let fault = Diagnostic::error("E0101", self.span(at, 1), "this `)` closes nothing");
        let fault = fault.label("no parenthesis is open here");
        self.repairs.push((at, b' '));
        let Some((from, to)) = self.opening_place(at) else {
            return self.diagnostics.push(fault.fix("remove it", self.span(at, 1), ""));
        };
        let span = self.span(from, to - from);
        self.diagnostics.push(fault.also(span, "a `(` is missing here").fix("write the `(`", span, "("));
        let end = line_end(self.text, at);
        self.lost.push(self.line_start..end);
        self.blank(self.line_start, end);
    }

    /// The blank between a word and an argument, `cylinder d = …`, on the line up to `at`.
    fn opening_place(&self, at: usize) -> Option<(usize, usize)> {
        let line = &self.text[self.line_start..at];
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        for (i, _) in line.match_indices('=').skip(1) {
            let key = line[..i].trim_end();
            let before = key.trim_end_matches(word);
            let owner = before.trim_end();
            if key.len() > before.len() && before.len() > owner.len() && owner.ends_with(word) {
                return Some((self.line_start + owner.len(), self.line_start + before.len()));
            }
            if line[..i].contains('(') {
                return None;
            }
        }
        None
    }

    /// A `}` too many: the one that came too early, if there is one, else this.
    fn closes_no_block(&mut self, at: usize) {
        self.unpaired = true;
        if self.has_enough() {
            return;
        }
        let Some(Early { at: early, open, chunk }) = self.early.take() else {
            let fault = Diagnostic::error("E0102", self.span(at, 1), "this `}` closes nothing");
            self.repairs.push((at, b' '));
            self.diagnostics.push(fault.label("no block is open here").fix("remove it", self.span(at, 1), ""));
            return;
        };
        let message = format!("this `}}` closes the block{} too early", owner(self.text, open));
        let fault = Diagnostic::error("E0102", self.span(early, 1), message)
            .label("not at its end")
            .also(self.span(open, 1), "opened here")
            .also(self.span(at, 1), "this one is left over");
        self.diagnostics.push(fault.fix("remove it", self.span(early, 1), ""));
        self.repairs.push((early, b' '));
        // What seemed to be items of their own belongs to the block.
        self.chunks.truncate(chunk + 1);
    }

    fn blank(&mut self, from: usize, to: usize) {
        let bytes = self.text.as_bytes();
        self.repairs.extend((from..to).filter(|&i| bytes[i] != b'\n' && bytes[i] != b'\r').map(|i| (i, b' ')));
    }

    /// A line no deeper than the head of a block whose lines stand deeper, or that has some on its own line.
    fn lose_blocks_left_by(&mut self, indent: usize) {
        let left =
            |o: &Open| o.bracket == b'{' && indent <= o.indent && o.inner.map_or(o.filled, |inner| inner > o.indent);
        while self.open.last().is_some_and(left) {
            self.lose_last(Before::Line(self.line_start), self.line_start);
        }
    }

    /// A `}` that lines up with an outer block shows that the inner ones lost theirs.
    fn lose_blocks_deeper_than(&mut self, indent: usize, at: usize) {
        let aligned = |o: &Open| o.bracket == b'{' && o.indent == indent;
        let guess = self.guess != Guess::Nothing && self.blocks_at.get(&indent).is_some_and(|&blocks| blocks > 0);
        if self.open.last().is_some_and(aligned) || !guess {
            return;
        }
        while !self.open.last().is_some_and(aligned) {
            self.lose_last(Before::Line(at), self.line_start);
        }
    }

    /// A statement cannot begin inside parentheses: they were left open above.
    fn lose_parentheses_before(&mut self, words: &str) {
        let guess = self.guess != Guess::Nothing && starts_statement(words);
        while guess && self.open.last().is_some_and(|o| o.bracket == b'(') {
            self.lose_last(Before::ThisLine, self.line_start);
        }
    }

    /// What hangs open around the innermost bracket would be noise: only that one is reported.
    fn lose_all_open(&mut self, before: Before) {
        let alone = self.open.len() <= 1;
        self.lose_last(before, self.line_start);
        self.broken |= !alone;
        self.open.clear();
        self.blocks_at.clear();
    }

    fn lose_last(&mut self, before: Before, limit: usize) {
        let Some(open) = self.pop() else { return };
        self.unpaired = true;
        if self.has_enough() {
            return;
        }
        if open.bracket == b'{' { self.lose_block(&open, before) } else { self.lose_parenthesis(&open, limit) }
    }

    /// The `}` belongs behind the last line of code.
    fn lose_block(&mut self, open: &Open, before: Before) {
        let end = self.code_end;
        let message = format!("this `{{`{} is never closed", owner(self.text, open.at));
        let indent = " ".repeat(open.indent);
        let fault = Diagnostic::error("E0102", self.span(open.at, 1), message).label("opened here");
        let help = match before {
            Before::ThisLine => "a `}` is missing before this line".to_string(),
            Before::Line(at) => format!("a `}}` is missing before line {}", line_number(self.text, at)),
            Before::End => "a `}` is missing before the end of the file".to_string(),
        };
        let one_line = !self.text[open.at..end.max(open.at)].contains('\n');
        self.diagnostics.push(match one_line {
            true => fault.fix(help, self.span(end, 0), " }"),
            false => fault.fix(help, self.span(line_end(self.text, end), 0), format!("\n{indent}}}")),
        });
        match self.text.as_bytes().get(end..) {
            // The next line goes on being one.
            Some([b'\n', b' ' | b'\t', ..]) => self.repairs.extend([(end, b'}'), (end + 1, b'\n')]),
            Some([byte, ..]) if byte.is_ascii_whitespace() => self.repairs.push((end, b'}')),
            _ => self.broken = true,
        }
    }

    /// The `)` belongs behind the last code before `limit`, and the statement is given up.
    fn lose_parenthesis(&mut self, open: &Open, limit: usize) {
        let at = if limit == self.line_start { self.code_end } else { self.text[..limit].trim_end().len() };
        let start = self.text[..open.at].rfind('\n').map_or(0, |i| i + 1);
        // A group is open behind its pattern.
        let group = self.text[start..at].ends_with('{');
        let at = if group { self.text[..at - 1].trim_end().len() } else { at };
        let line = line_number(self.text, at);
        let help = match group {
            false if limit == self.line_start => format!("a `)` is missing before the end of line {line}"),
            _ => "write the `)`".to_string(),
        };
        let mut fault =
            Diagnostic::error("E0101", self.span(open.at, 1), "this `(` is never closed").label("opened here");
        // What places a shape stands behind its arguments. Which of the fixes it is, the parser finds out.
        for word in ["on", "at", "turn"] {
            for (i, _) in self.text[open.at..at].match_indices(&format!(" {word} ")) {
                fault = fault.fix(format!("a `)` is missing before `{word}`"), self.span(open.at + i, 0), ")");
            }
        }
        self.diagnostics.push(fault.fix(help, self.span(at, 0), ")"));
        let end = line_end(self.text, at);
        self.broken |= group || limit != self.line_start;
        self.lost.push(start..end);
        self.blank(start, end);
    }

    fn has_enough(&mut self) -> bool {
        let enough = self.diagnostics.len() >= ENOUGH;
        self.broken |= enough;
        enough
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.broken = true;
        self.diagnostics.push(diagnostic);
    }

    fn span(&self, at: usize, len: usize) -> Span {
        Span { file: self.file, start: at as u32, end: (at + len) as u32 }
    }

    /// Ends the chunk that is open behind its last line of code.
    fn finish_chunk(&mut self, next: usize) {
        let broken = std::mem::take(&mut self.broken);
        let Some(chunk) = self.chunks.last_mut() else { return };
        let body = &self.text[chunk.start..next];
        chunk.end = chunk.start + body.len() - trailing_gap(body);
        chunk.broken = broken;
    }
}
