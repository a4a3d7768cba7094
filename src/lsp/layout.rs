//! Formatting: the difference between a text and its canonical layout.

use super::text::Text;
use crate::syntax::format;
use lsp_types::TextEdit;

/// The edits that lay a text out; `None` for one that does not parse. Lines that stay at both ends are left alone, so that
/// an editor keeps its place.
pub fn edits(text: &Text) -> Option<Vec<TextEdit>> {
    let old = text.as_str();
    let new = format(old).ok()?;
    if new == old {
        return Some(Vec::new());
    }
    Some(vec![difference(text, &new)])
}

/// One edit that makes `new` of a text.
pub fn difference(text: &Text, new: &str) -> TextEdit {
    let old = text.as_str();
    let head: usize = lines(old).zip(lines(new)).take_while(|(a, b)| a == b).map(|(a, _)| a.len()).sum();
    let (old_rest, new_rest) = (&old[head..], &new[head..]);
    let tail =
        backwards(old_rest).zip(backwards(new_rest)).take_while(|(a, b)| a == b).map(|(a, _)| a.len()).sum::<usize>();
    let range = text.range(head, old.len() - tail);
    TextEdit { range, new_text: new_rest[..new_rest.len() - tail].to_string() }
}

fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split_inclusive('\n')
}

fn backwards(text: &str) -> impl Iterator<Item = &str> {
    text.split_inclusive('\n').rev()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn applied(text: &str) -> String {
        let laid_out = Text::new(text.to_string());
        let mut text = text.to_string();
        for edit in edits(&laid_out).unwrap() {
            let (a, b) = (laid_out.offset(edit.range.start), laid_out.offset(edit.range.end));
            text.replace_range(a..b, &edit.new_text);
        }
        text
    }

    proptest! {
        #[test]
        fn edits_lead_to_the_layout(lines in proptest::collection::vec("(let a = 1|let  b=2|// ± 🔩|)?\r?", 0..8), end in "\n?") {
            let text = lines.join("\n") + &end;
            prop_assert_eq!(applied(&text), format(&text).unwrap());
        }
    }

    #[test]
    fn what_is_laid_out_stays_untouched() {
        let text = Text::new("gonogo 1\nlet a  = 1\n\nlet b = 2\n".to_string());
        let edits = edits(&text).unwrap();
        assert_eq!((edits.len(), edits[0].new_text.as_str()), (1, "let a = 1\n"));
    }
}
