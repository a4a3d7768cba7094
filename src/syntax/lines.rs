//! What can be told of a line before anything is parsed.
//!
//! In: a line, or a text and a place in it. Out: its code without its comment, what kind of statement it begins, where it
//! ends. Knows words and quotes, no grammar.

/// Bytes of the blank and comment-only lines at the end of `body`.
pub fn trailing_gap(body: &str) -> usize {
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
pub fn starts_block_item(words: &str) -> bool {
    let end = words.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(words.len());
    let (first, rest) = words.split_at(end);
    let block = ["material", "part", "assembly", "station", "inspect", "train"];
    // A name of that kind may begin a line inside parentheses.
    let goes_on = ['=', '.', ',', ')', '+', '-', '*', '/'];
    block.contains(&first) && !rest.trim_start().starts_with(goes_on)
}

pub fn starts_statement(words: &str) -> bool {
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

/// The end of the line that `at` stands on, without its line break.
pub fn line_end(text: &str, at: usize) -> usize {
    let rest = &text[at..];
    at + rest.find('\n').map_or(rest.len(), |i| rest[..i].trim_end_matches('\r').len())
}

/// `of material `steel``, from the words in front of a brace.
pub fn owner(text: &str, brace: usize) -> String {
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
