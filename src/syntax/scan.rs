//! Cuts a file into items before anything is parsed, and finds the block that lost its brace.
//!
//! In: text. Out: the stretches of text that hold one item each, and diagnostics for braces and parentheses that do not
//! pair up. A parser alone would report a lost `}` at the next item; indentation tells where it was meant to be.

use crate::diag::{Diagnostic, Span};

/// Parentheses nested deeper than this are refused, which bounds the parser's recursion.
pub const MAX_NESTING: usize = 32;

/// More operators than this inside one pair of parentheses are refused: a sum is as deep as it is long.
const MAX_OPERATORS: usize = 300;

/// A stretch of the text that holds one item and the comments above it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk {
    pub start: usize,
    pub end: usize,
    /// Its brackets do not pair up: reported already, not worth parsing.
    pub broken: bool,
}

/// Cuts `text` at the lines that begin outside all brackets.
pub fn scan(text: &str, file: u32) -> (Vec<Chunk>, Vec<Diagnostic>) {
    let mut scanner =
        Scanner { text, file, open: Vec::new(), chunks: Vec::new(), diagnostics: Vec::new(), broken: false };
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        scanner.line(start, line);
        start += line.len();
    }
    scanner.lose_all_open("the end of the file");
    scanner.finish_chunk(text.len());
    (scanner.chunks, scanner.diagnostics)
}

/// An opening bracket that still waits for its partner.
struct Open {
    bracket: u8,
    at: usize,
    indent: usize,
    operators: usize,
}

struct Scanner<'a> {
    text: &'a str,
    file: u32,
    open: Vec<Open>,
    chunks: Vec<Chunk>,
    diagnostics: Vec<Diagnostic>,
    broken: bool,
}

impl Scanner<'_> {
    fn line(&mut self, start: usize, line: &str) {
        let code = strip_comment(line);
        let words = code.trim_start();
        if words.trim_end().is_empty() {
            return;
        }
        let indent = code.len() - words.len();
        self.lose_parentheses_before(words);
        if indent == 0 && !self.open.is_empty() && starts_block_item(words) {
            self.lose_all_open(&format!("line {}", line_number(self.text, start)));
        }
        if self.open.is_empty() && !words.starts_with('}') {
            self.finish_chunk(start);
            // Comments above an item belong to it.
            let start = self.chunks.last().map_or(0, |chunk| chunk.end);
            self.chunks.push(Chunk { start, end: start, broken: false });
        }
        self.brackets(start, code, indent);
    }

    fn brackets(&mut self, start: usize, code: &str, indent: usize) {
        for (at, byte) in outside_strings(code) {
            match byte {
                b'(' | b'{' => self.open(Open { bracket: byte, at: start + at, indent, operators: 0 }),
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
        self.open.push(open);
    }

    /// `indent` is where a `}` stands when it begins its line.
    fn close(&mut self, bracket: u8, at: usize, indent: Option<usize>) {
        if bracket == b'{' {
            if let Some(indent) = indent {
                self.lose_blocks_deeper_than(indent, at);
            }
            while self.open.last().is_some_and(|o| o.bracket == b'(') {
                self.lose_last(&format!("line {}", line_number(self.text, at)));
            }
        }
        match self.open.last() {
            Some(open) if open.bracket == bracket => {
                self.open.pop();
            }
            _ => self.closes_nothing(bracket, at),
        }
    }

    fn closes_nothing(&mut self, bracket: u8, at: usize) {
        let (code, sign) = if bracket == b'{' { ("E0102", '}') } else { ("E0101", ')') };
        let message = format!("this `{sign}` closes nothing");
        self.report(Diagnostic::error(code, self.span(at, 1), message).label("no bracket is open here"));
    }

    /// A `}` that lines up with an outer block shows that the inner ones lost theirs.
    fn lose_blocks_deeper_than(&mut self, indent: usize, at: usize) {
        let aligned = |o: &Open| o.bracket == b'{' && o.indent == indent;
        if self.open.last().is_some_and(aligned) || !self.open.iter().any(aligned) {
            return;
        }
        while !self.open.last().is_some_and(aligned) {
            self.lose_last(&format!("line {}", line_number(self.text, at)));
        }
    }

    /// A statement cannot begin inside parentheses: they were left open above.
    fn lose_parentheses_before(&mut self, words: &str) {
        while self.open.last().is_some_and(|o| o.bracket == b'(') && starts_statement(words) {
            let last = self.open.last().map_or(0, |o| o.at);
            self.lose_last(&format!("the end of line {}", line_number(self.text, last)));
        }
    }

    /// What hangs open around the innermost bracket would be noise: only that one is reported.
    fn lose_all_open(&mut self, before: &str) {
        self.lose_last(before);
        self.open.clear();
    }

    fn lose_last(&mut self, before: &str) {
        let Some(open) = self.open.pop() else { return };
        let (code, sign, partner) = if open.bracket == b'{' { ("E0102", '{', '}') } else { ("E0101", '(', ')') };
        let owner = if open.bracket == b'{' { owner(self.text, open.at) } else { String::new() };
        let message = format!("this `{sign}`{owner} is never closed");
        let help = format!("a `{partner}` is missing before {before}");
        self.report(Diagnostic::error(code, self.span(open.at, 1), message).label("opened here").help(help));
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

/// Bytes of the blank and comment-only lines at the end of `body`.
fn trailing_gap(body: &str) -> usize {
    let gap = |line: &&str| strip_comment(line).trim().is_empty();
    body.split_inclusive('\n').rev().take_while(gap).map(str::len).sum()
}

/// The line without its comment; a `//` inside a string is no comment.
pub fn strip_comment(line: &str) -> &str {
    let slashes = outside_strings(line).find(|&(at, b)| b == b'/' && line[at..].starts_with("//"));
    slashes.map_or(line, |(at, _)| &line[..at])
}

/// The bytes of a line that are not inside a string.
pub fn outside_strings(line: &str) -> impl Iterator<Item = (usize, u8)> {
    let mut inside = false;
    line.bytes().enumerate().filter(move |&(_, b)| {
        inside ^= b == b'"';
        !inside && b != b'"'
    })
}

/// `part pin {`: an item that cannot stand inside another.
fn starts_block_item(words: &str) -> bool {
    let end = words.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(words.len());
    let (first, rest) = words.split_at(end);
    let block = ["material", "part", "assembly", "station", "inspect", "train"];
    block.contains(&first) && !rest.trim_start().starts_with('=')
}

fn starts_statement(words: &str) -> bool {
    let first = words.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next().unwrap_or("");
    let rest = words[first.len()..].trim_start();
    let keyword = [
        "add", "cut", "keep", "let", "place", "root", "measure", "outline", "line", "arc", "light", "camera", "vary",
        "floor", "watch", "ignore",
    ];
    (keyword.contains(&first) && rest.starts_with(|c: char| c.is_ascii_alphabetic() || c == '{'))
        || starts_block_item(words)
        || words.starts_with('}')
}

/// `of material `steel``, from the words in front of a brace.
fn owner(text: &str, brace: usize) -> String {
    let line = text[..brace].rsplit('\n').next().unwrap_or("").trim();
    let mut words = line.split_whitespace();
    match (words.next(), words.next()) {
        (Some(kind), Some(name)) => format!(" of {kind} `{name}`"),
        (Some(kind), None) => format!(" of `{kind}`"),
        _ => String::new(),
    }
}

/// Line of a byte offset, counted from 1.
pub fn line_number(text: &str, at: usize) -> usize {
    text.as_bytes()[..at].iter().filter(|&&b| b == b'\n').count() + 1
}
