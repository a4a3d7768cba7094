//! Diagnostics with their piece of the source, for people. The only file that knows the snippet renderer, whose output is
//! held by tests.

use super::place::{bytes, text_of};
use crate::diag::{Diagnostic, Fix, Severity, Sources};
use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Patch, Renderer, Snippet};

/// Of a fix in more places than this, only the first are shown.
const MOST_SHOWN: usize = 6;
const FIRST_SHOWN: usize = 4;

/// Each diagnostic with its piece of the source, and a line that counts them. Empty when there are none.
pub fn human(sources: &Sources, diagnostics: &[Diagnostic], colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() }.decor_style(DecorStyle::Ascii);
    let mut text = String::new();
    for diagnostic in diagnostics {
        let fixes = diagnostic.fixes.iter().filter(|fix| can_be_shown(sources, fix));
        let groups: Vec<Group> =
            std::iter::once(group(sources, diagnostic)).chain(fixes.map(|fix| patched(sources, fix))).collect();
        text += &renderer.render(&groups);
        text += "\n\n";
    }
    text + &summary(diagnostics)
}

fn group<'a>(sources: &'a Sources, diagnostic: &'a Diagnostic) -> Group<'a> {
    let level = match diagnostic.severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
    };
    let mut group = Group::with_title(level.primary_title(&diagnostic.message).id(diagnostic.code));
    for (index, (name, text)) in sources.files.iter().enumerate() {
        let labels = diagnostic.labels.iter().filter(|label| label.span.file as usize == index);
        let annotations: Vec<_> = labels
            .map(|label| {
                let kind = if label.primary { AnnotationKind::Primary } else { AnnotationKind::Context };
                let text = (!label.text.is_empty()).then_some(label.text.as_str());
                kind.span(bytes(text_of(sources, label.span), label.span)).label(text)
            })
            .collect();
        if !annotations.is_empty() {
            group = group.element(Snippet::source(text.as_str()).path(name).annotations(annotations));
        }
    }
    for note in &diagnostic.notes {
        group = group.element(Level::NOTE.message(note));
    }
    // What a fix shows need not be said before.
    let shown = |help: &&String| !diagnostic.fixes.iter().any(|f| f.title == **help && can_be_shown(sources, f));
    match diagnostic.help.as_ref().filter(shown) {
        Some(help) => group.element(Level::HELP.message(help)),
        None => group,
    }
}

/// The lines a fix changes, as they would be.
fn patched<'a>(sources: &'a Sources, fix: &'a Fix) -> Group<'a> {
    let mut group = Group::with_title(Level::HELP.secondary_title(&fix.title));
    let shown = if fix.edits.len() > MOST_SHOWN { FIRST_SHOWN } else { fix.edits.len() };
    for (index, (name, text)) in sources.files.iter().enumerate() {
        let edits = fix.edits[..shown].iter().filter(|edit| edit.span.file as usize == index);
        let patches: Vec<Patch> = edits.map(|e| Patch::new(bytes(text, e.span), e.text.as_str())).collect();
        if !patches.is_empty() {
            group = group.element(Snippet::source(text.as_str()).path(name).patches(patches));
        }
    }
    match fix.edits.len() - shown {
        0 => group,
        rest => group.element(Level::NOTE.message(format!("and in {rest} more places"))),
    }
}

/// Whether all edits lie in texts that are there, in their order and apart.
fn can_be_shown(sources: &Sources, fix: &Fix) -> bool {
    let place = |e: &crate::diag::Edit| (e.span.file, e.span.start, e.span.end);
    let inside =
        |e: &crate::diag::Edit| text_of(sources, e.span).get(e.span.start as usize..e.span.end as usize).is_some();
    let apart = |pair: &[crate::diag::Edit]| {
        let ((file, _, end), (next_file, next, _)) = (place(&pair[0]), place(&pair[1]));
        file < next_file || (file == next_file && end < next)
    };
    !fix.edits.is_empty() && fix.edits.iter().all(inside) && fix.edits.windows(2).all(apart)
}

fn summary(diagnostics: &[Diagnostic]) -> String {
    let errors = diagnostics.iter().filter(|d| d.is_error()).count();
    let counted = |count: usize, word: &str| match count {
        0 => None,
        1 => Some(format!("1 {word}")),
        n => Some(format!("{n} {word}s")),
    };
    let counts = [counted(errors, "error"), counted(diagnostics.len() - errors, "warning")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    if counts.is_empty() { String::new() } else { format!("{}\n", counts.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;
    use crate::diag::{Applicability, Edit, Span};

    #[test]
    fn human_text() {
        let (sources, diagnostics) = example();
        let expected = "\
error[E0202]: dimension `a` is defined twice
 --> plate.gng:3:5
  |
2 | let a = 6 ±0.1
  |     - first defined here
3 | let a = 7
  |     ^ defined again
  |
  = note: names are unique in a file
help: name it `a_2`
  |
3 | let a_2 = 7
  |      ++

1 error
";
        assert_eq!(human(&sources, &diagnostics, false), expected);
        assert!(human(&sources, &diagnostics, true).contains("\u{1b}["));
        assert_eq!(human(&sources, &[], false), "");
    }

    #[test]
    fn of_a_fix_in_many_places_the_first_are_shown() {
        let text = "a;\n".repeat(9);
        let sources = Sources { files: vec![("x.gng".into(), text.clone())] };
        let place = |i: u32| Span { file: 0, start: 3 * i + 1, end: 3 * i + 2 };
        let edits = |count: u32| (0..count).map(|i| Edit { span: place(i), text: String::new() }).collect::<Vec<_>>();
        let shown = |count: u32| {
            let fix = Fix {
                title: "remove the `;`".into(),
                edits: edits(count),
                applicability: Applicability::MachineApplicable,
            };
            let diagnostic = Diagnostic { fixes: vec![fix], ..Diagnostic::error("E0101", place(0), "a `;`") };
            human(&sources, &[diagnostic], false)
        };
        assert!(!shown(6).contains("more places") && shown(6).contains("6 ~ a\n"));
        assert!(shown(9).contains("and in 5 more places") && !shown(9).contains("5 ~ a\n"), "{}", shown(9));
    }
}
