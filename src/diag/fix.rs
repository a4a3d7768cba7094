//! Fixes: changes of the text that mend what a diagnostic found.
//!
//! In: a text and the fixes for it. Out: the changed text. Never reads or writes a file, and never lets two changes meet.

use super::Span;
use serde::Serialize;

/// Whether a fix may be made without asking. The words are those of rustc.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Applicability {
    /// It can mean nothing else: `gonogo check --fix` makes it.
    MachineApplicable,
    /// Probably meant, but somebody has to look: an editor offers it.
    MaybeIncorrect,
}

/// One stretch of a file and what is to stand in its place; an empty stretch is an insertion.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Edit {
    pub span: Span,
    pub text: String,
}

/// A change that mends a fault: all its edits together, or none.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Fix {
    /// What it does, as a help says it: ``write `(size * 2)` ``.
    pub title: String,
    pub edits: Vec<Edit>,
    pub applicability: Applicability,
}

impl Fix {
    /// A fix that changes nothing yet.
    pub fn new(title: impl Into<String>, applicability: Applicability) -> Self {
        Fix { title: title.into(), edits: Vec::new(), applicability }
    }

    /// Puts `text` in the place of `span` as well.
    pub fn edit(mut self, span: Span, text: impl Into<String>) -> Self {
        self.edits.push(Edit { span, text: text.into() });
        self
    }

    pub fn is_machine_applicable(&self) -> bool {
        self.applicability == Applicability::MachineApplicable
    }
}

/// `text`, which is that of `file`, with the edits of `fixes`, and which of the fixes were made.
///
/// A fix is left out whole when it touches another file, reaches beyond the text, cuts a character in two, or touches
/// the place of one made before: the earlier in the list wins.
pub fn apply<'a>(text: &str, file: u32, fixes: impl IntoIterator<Item = &'a Fix>) -> (String, Vec<usize>) {
    let mut edits: Vec<&Edit> = Vec::new();
    let mut made = Vec::new();
    for (index, fix) in fixes.into_iter().enumerate() {
        let fits = |edit: &Edit| edit.span.file == file && text.get(range(edit)).is_some();
        let mut all = edits.clone();
        all.extend(&fix.edits);
        all.sort_by_key(|edit| (edit.span.start, edit.span.end));
        if !fix.edits.is_empty() && fix.edits.iter().all(fits) && all.windows(2).all(|pair| are_apart(pair[0], pair[1]))
        {
            edits = all;
            made.push(index);
        }
    }
    (edited(text, &edits), made)
}

/// Two edits that even touch could depend on each other.
fn are_apart(first: &Edit, second: &Edit) -> bool {
    first.span.end < second.span.start
}

fn range(edit: &Edit) -> std::ops::Range<usize> {
    edit.span.start as usize..edit.span.end as usize
}

fn edited(text: &str, edits: &[&Edit]) -> String {
    let (mut out, mut at) = (String::with_capacity(text.len()), 0);
    for edit in edits {
        out += &text[at..range(edit).start];
        out += &edit.text;
        at = range(edit).end;
    }
    out + &text[at..]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fix(start: u32, end: u32, text: &str) -> Fix {
        Fix::new("", Applicability::MachineApplicable).edit(Span { file: 0, start, end }, text)
    }

    #[test]
    fn edits_are_made_whatever_their_order() {
        assert_eq!(apply("a b c", 0, &[fix(4, 5, "z"), fix(0, 1, "xy")]), ("xy b z".to_string(), vec![0, 1]));
        assert_eq!(apply("a b c", 0, &[fix(2, 2, "± ")]), ("a ± b c".to_string(), vec![0]));
    }

    #[test]
    fn what_meets_another_or_does_not_fit_is_left_out_whole() {
        assert_eq!(
            apply("abcdef", 0, &[fix(1, 3, "-"), fix(2, 4, "+"), fix(3, 4, "*")]),
            ("a-def".to_string(), vec![0])
        );
        assert_eq!(apply("a±b", 0, &[fix(2, 3, "x"), fix(9, 9, "x"), fix(3, 2, "x")]), ("a±b".to_string(), vec![]));
        let mut two = fix(0, 1, "x");
        two.edits.push(Edit { span: Span { file: 1, start: 0, end: 0 }, text: "y".into() });
        assert_eq!(apply("abc", 0, &[two]), ("abc".to_string(), vec![]));
        assert_eq!(apply("abc", 0, &[Fix::new("", Applicability::MaybeIncorrect)]), ("abc".to_string(), vec![]));
    }
}
