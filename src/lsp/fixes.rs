//! Code actions: the fixes that diagnostics carry, at the place of the cursor or all at once.

use super::layout;
use super::report;
use super::requests::edit_of;
use super::server::Server;
use super::text::Text;
use super::uri;
use crate::diag::{Diagnostic, Fix, Sources, Span, apply};
use lsp_types::{CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, TextEdit};
use std::collections::BTreeMap;

/// All machine-applicable fixes of a file at once.
const FIX_ALL: CodeActionKind = CodeActionKind::SOURCE_FIX_ALL;

/// What can be mended in a range.
pub fn actions(server: &mut Server, params: &CodeActionParams) -> Vec<CodeActionOrCommand> {
    let name = uri::name(&params.text_document.uri);
    let wants = |kind: &CodeActionKind| {
        let only = params.context.only.as_ref();
        only.is_none_or(|list| {
            list.iter().any(|k| kind.as_str() == k.as_str() || kind.as_str().starts_with(&format!("{}.", k.as_str())))
        })
    };
    let mut actions = Vec::new();
    for (diagnostics, sources) in server.found(&name) {
        let Some(file) = sources.files.iter().position(|(n, _)| *n == name) else { continue };
        let text = Text::new(sources.files[file].1.clone());
        let (start, end) = (text.offset(params.range.start) as u32, text.offset(params.range.end) as u32);
        let touches = |span: Span| span.file == file as u32 && span.start <= end && span.end >= start;
        if wants(&CodeActionKind::QUICKFIX) {
            let here = diagnostics.iter().filter(|d| d.labels.first().is_some_and(|label| touches(label.span)));
            for diagnostic in here {
                let shown = report::of(std::slice::from_ref(diagnostic), &sources, server.frame());
                let shown: Vec<_> = shown.into_values().flatten().collect();
                actions.extend(diagnostic.fixes.iter().map(|fix| CodeAction {
                    title: fix.title.clone(),
                    kind: Some(CodeActionKind::QUICKFIX),
                    diagnostics: Some(shown.clone()),
                    edit: Some(edit_of(edits(fix, &sources))),
                    is_preferred: Some(fix.is_machine_applicable()),
                    ..CodeAction::default()
                }));
            }
        }
        if wants(&FIX_ALL) {
            actions.extend(fix_all(&diagnostics, &name, file as u32, &text));
        }
    }
    actions.into_iter().map(CodeActionOrCommand::CodeAction).collect()
}

fn edits(fix: &Fix, sources: &Sources) -> BTreeMap<String, Vec<TextEdit>> {
    let mut by_file: BTreeMap<String, Vec<TextEdit>> = BTreeMap::new();
    for edit in &fix.edits {
        let Some((name, text)) = sources.files.get(edit.span.file as usize) else { continue };
        let range = Text::new(text.clone()).range_of(edit.span);
        by_file.entry(name.clone()).or_default().push(TextEdit { range, new_text: edit.text.clone() });
    }
    by_file
}

fn fix_all(diagnostics: &[Diagnostic], name: &str, file: u32, text: &Text) -> Option<CodeAction> {
    let safe = diagnostics.iter().flat_map(|d| &d.fixes).filter(|fix| fix.is_machine_applicable());
    let (mended, _) = apply(text.as_str(), file, safe);
    if mended == text.as_str() {
        return None;
    }
    let edit = layout::difference(text, &mended);
    Some(CodeAction {
        title: "fix all that is safe to fix".to_string(),
        kind: Some(FIX_ALL),
        edit: Some(edit_of(BTreeMap::from([(name.to_string(), vec![edit])]))),
        ..CodeAction::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Applicability;
    use lsp_types::{Position, Range};

    fn span(start: u32, end: u32) -> Span {
        Span { file: 0, start, end }
    }

    /// `let ø = 1 + 2`: two faults, of which one mends itself.
    fn faults() -> (Vec<Diagnostic>, Sources) {
        let sources = Sources { files: vec![("/w/a.gng".into(), "let ø = 1 + 2\nlet b = pinn\n".into())] };
        let sum = Fix::new("write `(1 + 2)`", Applicability::MachineApplicable);
        let sum = sum.edit(span(9, 9), "(").edit(span(14, 14), ")");
        let name = Fix::new("write `pin`", Applicability::MaybeIncorrect).edit(span(23, 27), "pin");
        let mut diagnostics = vec![
            Diagnostic::error("E0103", span(9, 14), "sums need parentheses"),
            Diagnostic::error("E0201", span(23, 27), "no `pinn`"),
        ];
        diagnostics[0].fixes.push(sum);
        diagnostics[1].fixes.push(name);
        (diagnostics, sources)
    }

    #[test]
    fn edits_count_as_editors_do() {
        let (diagnostics, sources) = faults();
        let edits = edits(&diagnostics[0].fixes[0], &sources);
        let at = |character| Range::new(Position::new(0, character), Position::new(0, character));
        let ranges: Vec<Range> = edits["/w/a.gng"].iter().map(|e| e.range).collect();
        assert_eq!(ranges, [at(8), at(13)]);
    }

    #[test]
    fn only_what_is_safe_is_mended_without_asking() {
        let (diagnostics, sources) = faults();
        let text = Text::new(sources.files[0].1.clone());
        let action = fix_all(&diagnostics, "/w/a.gng", 0, &text).unwrap();
        let edits: Vec<TextEdit> = action.edit.unwrap().changes.unwrap().into_values().flatten().collect();
        assert_eq!((edits.len(), edits[0].new_text.as_str()), (1, "let ø = (1 + 2)\n"));
        assert!(fix_all(&diagnostics[1..], "/w/a.gng", 0, &text).is_none());
    }
}
