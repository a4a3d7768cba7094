//! The diagnostics of the spec, each with its piece of the text.

use super::Report;
use super::html::{escaped, prose};
use crate::diag::{Diagnostic, Label, Severity, Sources, explain};

pub fn section(report: &Report) -> String {
    if report.diagnostics.is_empty() {
        return "<p>None: nothing in the spec is wrong or doubtful.</p>\n".into();
    }
    report.diagnostics.iter().map(|d| finding(report.sources, d)).collect()
}

fn finding(sources: &Sources, diagnostic: &Diagnostic) -> String {
    let (class, word) = match diagnostic.severity {
        Severity::Error => ("nogo", "error"),
        Severity::Warning => ("doubt", "warning"),
    };
    let places: String = diagnostic.labels.iter().map(|l| place(sources, l)).collect();
    let notes: String = diagnostic.notes.iter().map(|n| format!("<p class=\"note\">{}</p>\n", prose(n))).collect();
    let help = diagnostic.help.as_ref().map(|h| format!("<p class=\"help\">Help: <code>{}</code></p>\n", escaped(h)));
    let page = explain(diagnostic.code).map(|page| {
        format!(
            "<details><summary>What {} means</summary><pre>{}</pre></details>\n",
            diagnostic.code,
            lines(page.trim())
        )
    });
    format!(
        "<article class=\"finding {class}\">\n<h3><span class=\"code\">{word} {}</span> {}</h3>\n{places}{notes}{}{}</article>\n",
        diagnostic.code,
        prose(&diagnostic.message),
        help.unwrap_or_default(),
        page.unwrap_or_default()
    )
}

/// The line with the label's words marked.
fn place(sources: &Sources, label: &Label) -> String {
    let Some((file, text)) = sources.files.get(label.span.file as usize) else { return String::new() };
    let start = text.floor_char_boundary((label.span.start as usize).min(text.len()));
    let end = text.ceil_char_boundary((label.span.end as usize).min(text.len())).max(start);
    let from = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let to = text[start..].find('\n').map_or(text.len(), |i| start + i);
    let end = end.min(to);
    let line = text[..start].matches('\n').count() + 1;
    format!(
        "<div class=\"place\"><p><code>{}:{line}</code></p><pre><span>{line}</span> {}<mark>{}</mark>{}</pre>{}</div>\n",
        escaped(file),
        escaped(text[from..start].trim_start()),
        escaped(&text[start..end]),
        escaped(&text[end..to]),
        if label.text.is_empty() { String::new() } else { format!("<p>{}</p>", prose(&label.text)) }
    )
}

/// Text whose line breaks stay.
fn lines(text: &str) -> String {
    text.lines().map(escaped).collect::<Vec<_>>().join("\n")
}
