//! A text as editors count it: lines and UTF-16 units.
//!
//! In: texts and edits. Out: positions for byte offsets and back. A position outside the text is the nearest inside it, so
//! that no message can ask for what is not there.

use crate::diag::Span;
use lsp_types::{Position, Range, TextDocumentContentChangeEvent};

/// A text with the places where its lines begin.
#[derive(Debug, Clone, Default)]
pub struct Text {
    text: String,
    /// Byte offset of every line; the first is 0.
    starts: Vec<usize>,
}

impl Text {
    pub fn new(text: String) -> Text {
        let starts = line_starts(&text);
        Text { text, starts }
    }

    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Where a byte offset stands. Inside a letter, where that letter begins.
    pub fn position(&self, offset: usize) -> Position {
        let offset = self.text.floor_char_boundary(offset);
        let line = self.starts.partition_point(|&start| start <= offset).saturating_sub(1);
        let before = &self.text[self.starts[line]..offset];
        Position::new(line as u32, before.chars().map(char::len_utf16).sum::<usize>() as u32)
    }

    /// The byte offset of a position. Beyond its line, the end of that line; beyond the text, its end.
    pub fn offset(&self, position: Position) -> usize {
        let Some(&start) = self.starts.get(position.line as usize) else { return self.text.len() };
        let end = self.starts.get(position.line as usize + 1).copied().unwrap_or(self.text.len());
        let line = self.text[start..end].trim_end_matches(['\r', '\n']);
        let mut units = 0;
        for (at, c) in line.char_indices() {
            if units >= position.character as usize {
                return start + at;
            }
            units += c.len_utf16();
        }
        start + line.len()
    }

    pub fn range(&self, start: usize, end: usize) -> Range {
        Range::new(self.position(start), self.position(end))
    }

    pub fn range_of(&self, span: Span) -> Range {
        self.range(span.start as usize, span.end as usize)
    }

    /// The stretch of a span, or nothing where it does not fit this text.
    pub fn slice(&self, span: Span) -> &str {
        self.text.get(span.start as usize..span.end as usize).unwrap_or_default()
    }

    /// The text after an edit as a client sends it.
    pub fn change(&mut self, change: &TextDocumentContentChangeEvent) {
        let Some(range) = change.range else { return *self = Text::new(change.text.clone()) };
        let (a, b) = (self.offset(range.start), self.offset(range.end));
        self.text.replace_range(a.min(b)..a.max(b), &change.text);
        self.starts = line_starts(&self.text);
    }
}

/// A line ends with `\n`, `\r\n` or `\r`.
fn line_starts(text: &str) -> Vec<usize> {
    let bytes = text.as_bytes();
    let ends = |at: usize| bytes[at] == b'\n' || (bytes[at] == b'\r' && bytes.get(at + 1) != Some(&b'\n'));
    std::iter::once(0).chain((0..bytes.len()).filter(|&at| ends(at)).map(|at| at + 1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn letters_count_as_utf16_does() {
        let text = Text::new("let ø = 1 // ± 🔩 µ x\r\nlet b = 2\rlet c = 3\n".to_string());
        for (needle, line, character) in
            [("ø", 0, 4), ("±", 0, 13), ("🔩", 0, 15), ("µ", 0, 18), ("x", 0, 20), ("b", 1, 4), ("c", 2, 4)]
        {
            let at = text.as_str().find(needle).unwrap();
            assert_eq!(text.position(at), Position::new(line, character), "{needle}");
            assert_eq!(text.offset(Position::new(line, character)), at, "{needle}");
        }
        assert_eq!(text.position(text.as_str().len()), Position::new(3, 0));
    }

    #[test]
    fn positions_outside_are_the_nearest_inside() {
        let text = Text::new("ab\ncd".to_string());
        assert_eq!(text.offset(Position::new(0, 99)), 2);
        assert_eq!(text.offset(Position::new(7, 0)), 5);
        assert_eq!(text.offset(Position::new(u32::MAX, u32::MAX)), 5);
        assert_eq!(text.position(usize::MAX), Position::new(1, 2));
        // The middle of a letter of four bytes and two units.
        let wide = Text::new("🔩".to_string());
        assert_eq!((wide.position(2), wide.offset(Position::new(0, 1))), (Position::new(0, 0), 4));
    }

    #[test]
    fn edits_replace_what_they_name() {
        let mut text = Text::new("let a = 6 ±0.1\nlet b = 2\n".to_string());
        let change =
            |range, text: &str| TextDocumentContentChangeEvent { range, range_length: None, text: text.into() };
        text.change(&change(Some(Range::new(Position::new(0, 10), Position::new(0, 14))), "H7"));
        assert_eq!(text.as_str(), "let a = 6 H7\nlet b = 2\n");
        text.change(&change(Some(Range::new(Position::new(1, 5), Position::new(1, 0))), ""));
        assert_eq!(text.as_str(), "let a = 6 H7\n = 2\n");
        text.change(&change(None, "gonogo 1\n"));
        assert_eq!(text.as_str(), "gonogo 1\n");
    }

    proptest! {
        #[test]
        fn offsets_come_back(text in "[a±🔩µ\r\n]{0,40}") {
            let text = Text::new(text);
            for (at, _) in text.as_str().char_indices() {
                let inside_end = text.as_str()[..at].ends_with('\r') && text.as_str()[at..].starts_with('\n');
                prop_assert!(inside_end || text.offset(text.position(at)) == at);
            }
        }

        #[test]
        fn any_edit_is_taken(text in "[a±🔩\n]{0,20}", a in 0u32..5, b in 0u32..9, c in 0u32..5, d in 0u32..9) {
            let mut text = Text::new(text);
            let range = Some(Range::new(Position::new(a, b), Position::new(c, d)));
            text.change(&TextDocumentContentChangeEvent { range, range_length: None, text: "µ".into() });
            prop_assert!(text.as_str().contains('µ'));
        }
    }
}
