//! Reads the text of a `.csg` file into a tree of its nodes.
//!
//! In: text. Out: nodes with their arguments, children and places, or where the text is no such file.

use crate::diag::{Diagnostic, Span};

/// Larger files are no drawings (bytes).
const MAX_TEXT: usize = 1 << 24;
/// Nodes nested deeper than this are refused, which bounds all recursion over them.
const MAX_DEPTH: usize = 128;
/// More nodes than this are no part: what follows compares each with each.
const MAX_NODES: usize = 20_000;

/// `cylinder($fn = 0, h = 3, …) { … }`
#[derive(Debug, Clone)]
pub struct Node {
    pub name: String,
    pub args: Vec<(String, Value)>,
    pub children: Vec<Node>,
    /// With `%` in front: shown, but not part of the design.
    pub background: bool,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    Number(f64),
    Bool(bool),
    Text(String),
    List(Vec<Value>),
    Undefined,
}

impl Node {
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.args.iter().find(|(key, _)| key == name).map(|(_, value)| value)
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.get(name).and_then(Value::number)
    }

    pub fn flag(&self, name: &str) -> bool {
        self.get(name) == Some(&Value::Bool(true))
    }

    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        self.get(name)?.numbers()
    }
}

impl Value {
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub fn list(&self) -> Option<&[Value]> {
        match self {
            Value::List(list) => Some(list),
            _ => None,
        }
    }

    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.list()?.iter().map(Value::number).collect()
    }
}

/// The nodes of a file, or the first place where it is none.
pub fn parse(text: &str) -> Result<Vec<Node>, Vec<Diagnostic>> {
    if text.len() > MAX_TEXT {
        let message = format!("this file has {} bytes, the limit is {MAX_TEXT}", text.len());
        return Err(vec![Diagnostic::error("E0901", Span::default(), message)]);
    }
    let mut reader = Reader { text, at: 0, count: 0 };
    let nodes = reader.nodes(0).map_err(|fault| vec![*fault])?;
    match reader.rest() {
        "" => Ok(nodes),
        _ => Err(vec![*reader.expected("a node such as `cube(…);`")]),
    }
}

type Read<T> = Result<T, Box<Diagnostic>>;

struct Reader<'t> {
    text: &'t str,
    at: usize,
    /// Nodes so far.
    count: usize,
}

impl<'t> Reader<'t> {
    /// What follows, without blanks and comments.
    fn rest(&mut self) -> &'t str {
        loop {
            let rest = self.text[self.at..].trim_start();
            self.at = self.text.len() - rest.len();
            let skipped = if rest.starts_with("//") {
                rest.find('\n').unwrap_or(rest.len())
            } else if rest.starts_with("/*") {
                rest.find("*/").map_or(rest.len(), |end| end + 2)
            } else {
                return rest;
            };
            self.at += skipped;
        }
    }

    fn span(&self, start: usize) -> Span {
        Span { file: 0, start: start as u32, end: self.at as u32 }
    }

    fn expected(&mut self, what: &str) -> Box<Diagnostic> {
        let rest = self.rest();
        let found: String = rest.chars().take_while(|c| !c.is_whitespace()).take(20).collect();
        let said = if found.is_empty() { "the end of the file".to_string() } else { format!("`{found}`") };
        let start = self.at;
        let span = Span { file: 0, start: start as u32, end: (start + found.len()) as u32 };
        let diagnostic = Diagnostic::error("E0901", span, format!("expected {what}, found {said}"))
            .label("not the text of a `.csg` file")
            .help("make it with `openscad -o part.csg part.scad`");
        Box::new(diagnostic)
    }

    fn take(&mut self, token: char) -> bool {
        let found = self.rest().starts_with(token);
        self.at += if found { token.len_utf8() } else { 0 };
        found
    }

    fn need(&mut self, token: char) -> Read<()> {
        if self.take(token) { Ok(()) } else { Err(self.expected(&format!("`{token}`"))) }
    }

    fn word(&mut self) -> &'t str {
        let rest = self.rest();
        let word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '$';
        let end = rest.find(|c| !word(c)).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn nodes(&mut self, depth: usize) -> Read<Vec<Node>> {
        let mut nodes = Vec::new();
        while !matches!(self.rest().chars().next(), None | Some('}')) {
            // Lone semicolons and braces around nothing are left by modules that make nothing.
            if !self.take(';') {
                nodes.push(self.node(depth)?);
            }
        }
        Ok(nodes)
    }

    fn node(&mut self, depth: usize) -> Read<Node> {
        let mut background = false;
        while let Some(sign @ ('%' | '#' | '!' | '*')) = self.rest().chars().next() {
            background |= sign == '%' || sign == '*';
            self.at += 1;
        }
        self.rest();
        let start = self.at;
        let name = self.word().to_string();
        if name.is_empty() {
            return Err(self.expected("a node such as `cube(…);`"));
        }
        let span = self.span(start);
        if depth > MAX_DEPTH {
            let message = format!("nodes are nested more than {MAX_DEPTH} deep");
            return Err(Box::new(Diagnostic::error("E0901", span, message).label("too deep here")));
        }
        self.count += 1;
        if self.count > MAX_NODES {
            let message = format!("this design has more than {MAX_NODES} nodes");
            return Err(Box::new(Diagnostic::error("E0901", span, message).label("one too many")));
        }
        self.need('(')?;
        let args = self.args()?;
        let mut children = Vec::new();
        if self.take('{') {
            children = self.nodes(depth + 1)?;
            self.need('}')?;
        } else {
            self.need(';')?;
        }
        Ok(Node { name, args, children, background, span })
    }

    fn args(&mut self) -> Read<Vec<(String, Value)>> {
        let mut args = Vec::new();
        while !self.take(')') {
            let before = self.at;
            let key = self.word();
            if !key.is_empty() && self.take('=') {
                args.push((key.to_string(), self.value(0)?));
            } else {
                // `multmatrix([[…]])` and `color([…])` have no name.
                self.at = before;
                args.push((String::new(), self.value(0)?));
            }
            if !self.take(',') {
                self.need(')')?;
                break;
            }
        }
        Ok(args)
    }

    fn value(&mut self, depth: usize) -> Read<Value> {
        let rest = self.rest();
        match rest.chars().next() {
            Some('[') if depth < 8 => {
                self.at += 1;
                let mut list = Vec::new();
                while !self.take(']') {
                    list.push(self.value(depth + 1)?);
                    if !self.take(',') {
                        self.need(']')?;
                        break;
                    }
                }
                Ok(Value::List(list))
            }
            Some('"') => self.string(),
            Some(c) if c.is_ascii_alphabetic() => self.named(),
            _ => self.number(),
        }
    }

    fn named(&mut self) -> Read<Value> {
        let start = self.at;
        match self.word() {
            "true" => Ok(Value::Bool(true)),
            "false" => Ok(Value::Bool(false)),
            "undef" => Ok(Value::Undefined),
            "inf" | "nan" => Ok(Value::Number(f64::NAN)),
            _ => {
                self.at = start;
                Err(self.expected("a value"))
            }
        }
    }

    fn number(&mut self) -> Read<Value> {
        let rest = self.rest();
        let part = |c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E');
        let end = rest.find(|c| !part(c)).unwrap_or(rest.len());
        match rest[..end].parse() {
            Ok(number) => {
                self.at += end;
                Ok(Value::Number(number))
            }
            Err(_) => Err(self.expected("a value")),
        }
    }

    fn string(&mut self) -> Read<Value> {
        let rest = self.rest();
        let mut text = String::new();
        let mut chars = rest.char_indices().skip(1);
        while let Some((at, c)) = chars.next() {
            match c {
                '"' => {
                    self.at += at + 1;
                    return Ok(Value::Text(text));
                }
                '\\' => text.extend(chars.next().map(|(_, c)| c)),
                c => text.push(c),
            }
        }
        Err(self.expected("a string with its closing quote"))
    }
}
