//! What a place in a text lies in, found from its words alone: texts that are being typed do not parse.
//!
//! In: a text and an offset. Out: the blocks and parentheses that are open there, and the words of the statement so far.

use super::words::{Owner, Role, owner};

/// What is open at a place.
#[derive(Debug, Clone, Default)]
pub struct Context<'a> {
    /// The words in front of every open brace, outermost first.
    pub blocks: Vec<Vec<&'a str>>,
    /// The innermost open parentheses.
    pub call: Option<Call<'a>>,
    /// The statement so far; inside parentheses what stands in front of them, too.
    pub statement: Vec<&'a str>,
    /// Since the last comma or opening parenthesis, or since the statement began.
    pub words: Vec<&'a str>,
    /// Where the word begins that ends at the place.
    pub start: usize,
    /// A parenthesis follows the word.
    pub is_call: bool,
    /// The place lies in a comment.
    pub in_comment: bool,
    /// The place lies in a string, which begins behind this offset.
    pub in_string: Option<usize>,
}

/// Parentheses with arguments.
#[derive(Debug, Clone, Default)]
pub struct Call<'a> {
    /// The word in front.
    pub word: &'a str,
    /// The keys given so far.
    pub keys: Vec<&'a str>,
}

impl Context<'_> {
    /// What kind of block the place lies in: `file`, `part`, `place` …; `states` in `{ mmc …`.
    pub fn block(&self) -> &str {
        let Some(head) = self.blocks.last() else { return "file" };
        match head.first().copied().unwrap_or_default() {
            _ if head.last().is_some_and(|word| ["=", ",", "("].contains(word)) => "states",
            "add" | "cut" | "keep" => "part",
            word => word,
        }
    }

    /// What takes the arguments or fields of this place.
    pub fn owner(&self) -> Option<&'static Owner> {
        match &self.call {
            Some(_) if self.statement.first() == Some(&"watch") => owner("watch", &[Role::Options]),
            Some(call) => owner(call.word, &[Role::Shape, Role::Pattern, Role::Light]),
            None => owner(self.block(), &[Role::Block]),
        }
    }
}

/// What is open at `offset`, the word that ends there left out.
pub fn context(text: &str, offset: usize) -> Context<'_> {
    let offset = text.floor_char_boundary(offset);
    let typed = text[..offset].bytes().rev().take_while(|b| is_word(*b)).count();
    let start = offset - typed;
    let mut reader = Reader { open: vec![Open::default()] };
    let mut context = Context { start, ..Context::default() };
    let mut at = 0;
    for line in text.split_inclusive('\n') {
        if at > start {
            break;
        }
        reader.begin_line(line);
        let seen = &line[..line.len().min(start - at)];
        let whole = seen.len() == line.len();
        let rest = reader.line(seen);
        if !whole || at + line.len() >= start {
            match rest {
                Rest::Code => {}
                Rest::Comment => context.in_comment = !whole || !line.ends_with('\n'),
                Rest::String(quote) => context.in_string = (!whole || !line.ends_with('\n')).then_some(at + quote + 1),
            }
        }
        at += line.len();
    }
    let after = text[offset..].trim_start_matches(|c: char| c.is_ascii_alphanumeric() || c == '_');
    context.is_call = after.trim_start_matches([' ', '\t']).starts_with('(');
    reader.finish(context)
}

fn is_word(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// What a line ends in.
enum Rest {
    Code,
    Comment,
    /// An open string, from this quotation mark on.
    String(usize),
}

/// An open bracket with the words behind it.
#[derive(Debug, Default)]
struct Open<'a> {
    /// `None` for the file itself.
    bracket: Option<u8>,
    /// The statement in front of it.
    head: Vec<&'a str>,
    words: Vec<&'a str>,
    keys: Vec<&'a str>,
}

struct Reader<'a> {
    /// The file first, the innermost bracket last; never empty.
    open: Vec<Open<'a>>,
}

impl<'a> Reader<'a> {
    /// Brackets that were left open end where a line can only begin something new.
    fn begin_line(&mut self, line: &str) {
        let word = line.trim_start();
        let end = word.bytes().take_while(|b| is_word(*b)).count();
        let (first, rest) = word.split_at(end);
        let names = rest.starts_with([' ', '\t'])
            && rest.trim_start().starts_with(|c: char| c.is_ascii_alphabetic() || c == '{');
        let item = ["material", "part", "assembly", "station", "inspect", "train"];
        let statement =
            ["add", "cut", "keep", "let", "place", "root", "measure", "outline", "light", "camera", "watch"];
        if names && line.starts_with(first) && item.contains(&first) {
            self.open.truncate(1);
            self.open[0].words.clear();
        }
        if word.starts_with('}') || (names && (item.contains(&first) || statement.contains(&first))) {
            while self.open.last().is_some_and(|o| o.bracket == Some(b'(')) {
                self.open.pop();
            }
        }
        if let Some(open) = self.open.last_mut().filter(|o| o.bracket != Some(b'(')) {
            open.words.clear();
        }
    }

    fn line(&mut self, line: &'a str) -> Rest {
        let bytes = line.as_bytes();
        let mut at = 0;
        while at < bytes.len() {
            let rest = &line[at..];
            let length = match bytes[at] {
                b'/' if rest.starts_with("//") => return Rest::Comment,
                b'"' => match rest[1..].find('"') {
                    Some(end) => end + 2,
                    None => return Rest::String(at),
                },
                b if is_word(b) => rest.bytes().take_while(|b| is_word(*b)).count(),
                _ => rest.chars().next().map_or(1, char::len_utf8),
            };
            self.token(&line[at..at + length]);
            at += length;
        }
        Rest::Code
    }

    fn token(&mut self, token: &'a str) {
        match token {
            "(" | "{" => {
                let head = self.statement();
                self.open.push(Open { bracket: token.bytes().next(), head, ..Open::default() });
            }
            ")" | "}" => {
                let partner = if token == ")" { b'(' } else { b'{' };
                if let Some(found) = self.open.iter().rposition(|o| o.bracket == Some(partner)) {
                    self.open.truncate(found);
                }
                if token == "}" {
                    self.open.last_mut().into_iter().for_each(|o| o.words.clear());
                } else {
                    self.push(token);
                }
            }
            _ if token.trim().is_empty() => {}
            _ => self.push(token),
        }
    }

    fn push(&mut self, token: &'a str) {
        let Some(open) = self.open.last_mut() else { return };
        match token {
            "," if open.bracket == Some(b'(') => open.words.clear(),
            _ => {
                if token == "=" && open.bracket == Some(b'(') {
                    open.keys.extend(open.words.last());
                }
                open.words.push(token);
            }
        }
    }

    /// The words of the statement so far.
    fn statement(&self) -> Vec<&'a str> {
        let Some(open) = self.open.last() else { return Vec::new() };
        let inside = if open.bracket == Some(b'(') { open.head.as_slice() } else { &[] };
        inside.iter().chain(&open.words).copied().collect()
    }

    fn finish(self, context: Context<'a>) -> Context<'a> {
        let statement = self.statement();
        let blocks = self.open.iter().filter(|o| o.bracket == Some(b'{')).map(|o| o.head.clone()).collect();
        let last = self.open.into_iter().next_back().unwrap_or_default();
        let call = (last.bracket == Some(b'('))
            .then(|| Call { word: last.head.last().copied().unwrap_or_default(), keys: last.keys });
        Context { blocks, call, statement, words: last.words, ..context }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The context at `|`.
    fn at(text: &str) -> (String, String, Vec<String>) {
        let offset = text.find('|').unwrap();
        let text = text.replacen('|', "", 1);
        let here = context(&text, offset);
        let call = here.call.as_ref().map_or("", |c| c.word).to_string();
        (here.block().to_string(), call, here.words.iter().map(|w| w.to_string()).collect())
    }

    fn expect(text: &str, block: &str, call: &str, words: &[&str]) {
        assert_eq!(at(text), (block.into(), call.into(), words.iter().map(|w| w.to_string()).collect()), "{text}");
    }

    #[test]
    fn blocks_calls_and_words_are_found() {
        expect("gonogo 1\npa|", "file", "", &[]);
        expect("part a {\n  add b = cyl|", "part", "", &["add", "b", "="]);
        expect("part a {\n  add b = cylinder(d = 6 H7, h|", "part", "cylinder", &[]);
        expect("part a {\n  add b = cylinder(d = 6 |", "part", "cylinder", &["d", "=", "6"]);
        expect("part a {\n  cut b = group at (0, 0, 1) {\n    add |", "part", "", &["add"]);
        expect("part a {\n  outline o {\n    from (0, 0)\n    li|", "outline", "", &[]);
        expect("assembly a {\n place p on q {\n  z = 1\n }\n pl|", "assembly", "", &[]);
        expect("part a { // {\n  add b = { mmc 1, |", "states", "", &["mmc", "1", ","]);
    }

    #[test]
    fn what_was_left_open_ends_where_something_new_begins() {
        expect("part a {\n  add b = cylinder(d = 6\n  cut c = |", "part", "", &["cut", "c", "="]);
        expect("part a {\n  add b = cylinder(d = 6\npart c {\n  |", "part", "", &[]);
    }

    #[test]
    fn comments_and_strings_are_known() {
        assert!(context("let a = 1 // no", 15).in_comment);
        assert!(!context("let a = 1 // no\n", 16).in_comment);
        assert_eq!(context("use \"std/", 9).in_string, Some(5));
        assert_eq!(context("use \"std/x\"\n", 12).in_string, None);
    }

    proptest! {
        #[test]
        fn any_text_has_a_context(text in "[a-c ={}()\",/\n±]{0,60}", at in 0usize..70) {
            let here = context(&text, at.min(text.len()));
            prop_assert!(here.start <= text.len());
            here.owner();
        }
    }
}
