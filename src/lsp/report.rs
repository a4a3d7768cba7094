//! Diagnostics as editors show them: by file, other places as related information, help in the message.

use super::project::Project;
use super::text::Text;
use super::uri::address;
use crate::diag::{Diagnostic, Severity, Sources, Span};
use lsp_types::{
    CodeDescription, Diagnostic as Shown, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag, Location,
    NumberOrString, Uri,
};
use std::collections::BTreeMap;
use std::str::FromStr;

/// Diagnostics by the name of their file.
pub type Board = BTreeMap<String, Vec<Shown>>;

/// What the client can show.
#[derive(Debug, Clone, Copy, Default)]
pub struct Frame {
    /// It opens `gonogo:/E0305.md` from the code of a diagnostic.
    pub explains: bool,
}

/// The diagnostics of a project, whose files have an entry each even where nothing is wrong. A file without an assembly is
/// for others to use: that it makes nothing by itself is no error in an editor.
pub fn of_project(project: &Project, frame: Frame) -> Board {
    let loaded = &project.survey.loaded;
    let mut board = of(&loaded.diagnostics, &loaded.sources, frame);
    if !project.survey.has_assembly {
        for shown in board.values_mut().flatten() {
            if shown.message.starts_with("this spec has no assembly") {
                shown.severity = Some(DiagnosticSeverity::HINT);
            }
        }
    }
    board
}

/// The diagnostics of a run of the compiler.
pub fn of(diagnostics: &[Diagnostic], sources: &Sources, frame: Frame) -> Board {
    let texts: Vec<Text> = sources.files.iter().map(|(_, text)| Text::new(text.clone())).collect();
    let mut board: Board = sources.files.iter().map(|(name, _)| (name.clone(), Vec::new())).collect();
    for diagnostic in diagnostics {
        let Some(primary) = diagnostic.labels.first() else { continue };
        let Some((name, _)) = sources.files.get(primary.span.file as usize) else { continue };
        let shown = show(diagnostic, sources, &texts, frame);
        board.entry(name.clone()).or_default().push(shown);
    }
    board
}

fn show(diagnostic: &Diagnostic, sources: &Sources, texts: &[Text], frame: Frame) -> Shown {
    let range = |span: Span| texts.get(span.file as usize).map(|text| text.range_of(span)).unwrap_or_default();
    let (primary, others) = diagnostic.labels.split_first().map_or((None, &[][..]), |(p, o)| (Some(p), o));
    let related = others.iter().filter_map(|label| {
        let uri = address(&sources.files.get(label.span.file as usize)?.0)?;
        let message = label.text.clone();
        Some(DiagnosticRelatedInformation { location: Location::new(uri, range(label.span)), message })
    });
    let related: Vec<DiagnosticRelatedInformation> = related.collect();
    let page = frame.explains.then(|| Uri::from_str(&format!("gonogo:/{}.md", diagnostic.code)).ok()).flatten();
    Shown {
        range: primary.map(|label| range(label.span)).unwrap_or_default(),
        severity: Some(match diagnostic.severity {
            Severity::Error => DiagnosticSeverity::ERROR,
            Severity::Warning => DiagnosticSeverity::WARNING,
        }),
        code: Some(NumberOrString::String(diagnostic.code.to_string())),
        code_description: page.map(|href| CodeDescription { href }),
        source: Some("gonogo".to_string()),
        message: message(diagnostic),
        related_information: (!related.is_empty()).then_some(related),
        tags: (diagnostic.code == "W0209").then(|| vec![DiagnosticTag::UNNECESSARY]),
        data: None,
    }
}

/// What is wrong, what the label says, the numbers, and the way out.
fn message(diagnostic: &Diagnostic) -> String {
    let mut text = diagnostic.message.clone();
    let label = diagnostic.labels.first().map_or("", |label| label.text.as_str());
    if !label.is_empty() {
        text += &format!("\n{label}");
    }
    diagnostic.notes.iter().for_each(|note| text += &format!("\nnote: {note}"));
    diagnostic.help.iter().for_each(|help| text += &format!("\nhelp: {help}"));
    text
}
