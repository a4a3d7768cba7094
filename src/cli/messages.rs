//! Diagnostics on their way out: to standard error for people, to standard output for programs that asked for them.

use super::args::{Colour, Global, MessageFormat};
use super::output::{self, Failure};
use super::report;
use crate::diag::{Diagnostic, Sources};
use std::io::IsTerminal;

/// Says at once what cannot be had, before any work is done.
pub fn refuse_unavailable(global: &Global) -> Result<(), Failure> {
    match global.message_format {
        MessageFormat::Sarif => Err(Failure("`--message-format sarif` is not available yet".into())),
        _ => Ok(()),
    }
}

/// Prints diagnostics in the format asked for.
pub fn print(diagnostics: &[Diagnostic], sources: &Sources, global: &Global) -> Result<(), Failure> {
    let text = match global.message_format {
        MessageFormat::Human => report::human(sources, diagnostics, has_colour(global)),
        MessageFormat::Short => report::short(sources, diagnostics, has_colour(global)),
        MessageFormat::Json => report::json(sources, diagnostics, false),
        MessageFormat::Github => diagnostics.iter().map(|d| github(d, sources) + "\n").collect(),
        MessageFormat::Sarif => return refuse_unavailable(global),
    };
    match (text.trim_end(), global.message_format) {
        ("", _) => Ok(()),
        (text, MessageFormat::Human | MessageFormat::Short) => {
            output::remark(text);
            Ok(())
        }
        (text, _) => output::line(text),
    }
}

/// Whether standard error takes colour.
fn has_colour(global: &Global) -> bool {
    match global.color {
        Colour::Always => true,
        Colour::Never => false,
        Colour::Auto => {
            let refused = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
            let dumb = std::env::var_os("TERM").is_some_and(|v| v == "dumb");
            std::io::stderr().is_terminal() && !refused && !dumb
        }
    }
}

/// An annotation of a line in GitHub Actions: `::error file=…,line=…,col=…,title=…::…`.
fn github(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let kind = if diagnostic.is_error() { "error" } else { "warning" };
    let span = diagnostic.labels.first().map(|l| l.span).unwrap_or_default();
    let (name, text) = sources.files.get(span.file as usize).map_or(("", ""), |(name, text)| (name, text));
    let before = text.get(..span.start as usize).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let property = |v: &str| v.replace('%', "%25").replace('\n', "%0A").replace(':', "%3A").replace(',', "%2C");
    let message = match &diagnostic.help {
        Some(help) => format!("{}\nhelp: {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    let message = message.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A");
    format!("::{kind} file={},line={line},col={column},title={}::{message}", property(name), diagnostic.code)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Span;

    #[test]
    fn an_annotation_counts_lines_and_letters_from_one() {
        let sources = Sources { files: vec![("a,b.gng".into(), "gonogo 1\nlet ± = x\n".into())] };
        let fault = Diagnostic::error("E0201", Span { file: 0, start: 18, end: 19 }, "no `x`").help("100 %");
        let expected = "::error file=a%2Cb.gng,line=2,col=9,title=E0201::no `x`%0Ahelp: 100 %25";
        assert_eq!(github(&fault, &sources), expected);
    }
}
