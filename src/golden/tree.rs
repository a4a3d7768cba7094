//! RON without its layout: names, brackets and values, each value with its place in the text.
//!
//! In: a text. Out: its [`Tree`], or nothing if it is not RON. Whatever a serialiser of ours writes is read; that every
//! bracket closes with its own kind is not checked.

/// Deeper nesting than this is refused: no summary has it, and reading is recursive.
const DEEPEST: usize = 256;

#[derive(Debug, PartialEq)]
pub enum Tree<'a> {
    Leaf(Token<'a>),
    /// The name before the bracket (often empty) and what is inside, each with its field name, its key or nothing.
    Branch(&'a str, Vec<(String, Tree<'a>)>),
}

/// A word and where it begins (bytes).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Token<'a> {
    pub text: &'a str,
    pub at: usize,
}

impl<'a> Tree<'a> {
    pub fn parse(text: &'a str) -> Option<Tree<'a>> {
        let mut tokens = tokens(text)?;
        tokens.reverse();
        let tree = value(&mut tokens, 0)?;
        tokens.is_empty().then_some(tree)
    }

    /// A value as it stands, or how much there is of it.
    pub fn show(&self) -> String {
        match self {
            Tree::Leaf(token) => token.text.into(),
            Tree::Branch(head, items) if items.len() == 1 => match &items[0] {
                (key, Tree::Leaf(only)) if key.is_empty() => format!("{head}({})", only.text),
                _ => format!("{head}(… 1 entry)"),
            },
            Tree::Branch(head, items) => format!("{head}(… {} entries)", items.len()),
        }
    }
}

/// `tokens` has the last first, so that `pop` is next.
fn value<'a>(tokens: &mut Vec<Token<'a>>, depth: usize) -> Option<Tree<'a>> {
    let token = tokens.pop().filter(|_| depth < DEEPEST)?;
    match token.text {
        "(" | "[" | "{" => branch(tokens, "", depth),
        ")" | "]" | "}" | "," | ":" => None,
        name if tokens.last().is_some_and(|t| t.text == "(") => {
            tokens.pop();
            branch(tokens, name, depth)
        }
        _ => Some(Tree::Leaf(token)),
    }
}

fn branch<'a>(tokens: &mut Vec<Token<'a>>, head: &'a str, depth: usize) -> Option<Tree<'a>> {
    let mut items = Vec::new();
    loop {
        if matches!(tokens.last()?.text, ")" | "]" | "}") {
            tokens.pop();
            return Some(Tree::Branch(head, items));
        }
        let first = value(tokens, depth + 1)?;
        let item = if tokens.last().is_some_and(|t| t.text == ":") {
            tokens.pop();
            (first.show().trim_matches('"').to_string(), value(tokens, depth + 1)?)
        } else {
            (String::new(), first)
        };
        items.push(item);
        if tokens.last().is_some_and(|t| t.text == ",") {
            tokens.pop();
        }
    }
}

/// Brackets, commas and colons by themselves; numbers, names and strings whole; no comments.
fn tokens(text: &str) -> Option<Vec<Token<'_>>> {
    const ALONE: &[char] = &['(', ')', '[', ']', '{', '}', ',', ':'];
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let (length, counts) = if first.is_whitespace() {
            (first.len_utf8(), false)
        } else if rest.starts_with("//") {
            (rest.find('\n').unwrap_or(rest.len()), false)
        } else if ALONE.contains(&first) {
            (1, true)
        } else if first == '"' {
            (string_length(rest)?, true)
        } else {
            (rest.find(|c: char| c.is_whitespace() || ALONE.contains(&c)).unwrap_or(rest.len()), true)
        };
        if counts {
            found.push(Token { text: &rest[..length], at });
        }
        at += length;
    }
    Some(found)
}

fn string_length(text: &str) -> Option<usize> {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            '"' if !escaped => return Some(at + 1),
            '\\' => escaped = !escaped,
            _ => escaped = false,
        }
    }
    None
}
