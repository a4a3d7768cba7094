//! Diagnostics on their way out: to standard error for people, to standard output for programs that asked for them.
//!
//! In: diagnostics and the texts they point into. Out: text, by one small file a format.

mod github;
mod human;
mod json;
pub mod levels;
mod place;
mod sarif;
mod short;

pub use github::github;
pub use human::human;
pub use json::json;
pub use place::Place;
pub use sarif::sarif;
pub use short::short;

use super::args::{Colour, Global, MessageFormat};
use super::output::{self, Failure};
use crate::diag::{Diagnostic, Severity, Sources};
use std::io::{self, IsTerminal};

/// The diagnostics of one run. Most formats are printed as they come; SARIF is one log at the end.
pub struct Messages<'a> {
    global: &'a Global,
    kept: Vec<(Sources, Vec<Diagnostic>)>,
}

impl<'a> Messages<'a> {
    pub fn new(global: &'a Global) -> Self {
        Messages { global, kept: Vec::new() }
    }

    /// Prints the diagnostics of one spec, or keeps them for the log.
    pub fn add(&mut self, diagnostics: &[Diagnostic], sources: &Sources) -> Result<(), Failure> {
        let colour = has_colour(self.global, &io::stderr());
        match self.global.message_format {
            MessageFormat::Human => {
                remark(&(human(sources, diagnostics, colour) + &fixable(diagnostics)));
                Ok(())
            }
            MessageFormat::Short => {
                remark(&short(sources, diagnostics, colour));
                Ok(())
            }
            MessageFormat::Json => lines(&json(sources, diagnostics, false)),
            MessageFormat::Github => lines(&github(sources, diagnostics)),
            MessageFormat::Sarif => {
                self.kept.push((sources.clone(), diagnostics.to_vec()));
                Ok(())
            }
        }
    }

    /// Prints what had to wait for the last spec.
    pub fn finish(self) -> Result<(), Failure> {
        match self.global.message_format {
            MessageFormat::Sarif => lines(&sarif(self.kept.iter().map(|(s, d)| (s, d.as_slice())))),
            _ => Ok(()),
        }
    }
}

/// Prints the diagnostics of a run that has only one spec.
pub fn print(diagnostics: &[Diagnostic], sources: &Sources, global: &Global) -> Result<(), Failure> {
    let mut messages = Messages::new(global);
    messages.add(diagnostics, sources)?;
    messages.finish()
}

/// How many of them `--fix` would mend.
fn fixable(diagnostics: &[Diagnostic]) -> String {
    let is_fixable = |d: &&Diagnostic| d.fixes.iter().any(|f| f.is_machine_applicable());
    match diagnostics.iter().filter(is_fixable).count() {
        0 => String::new(),
        count => format!("{count} can be mended by `gonogo check --fix`\n"),
    }
}

fn remark(text: &str) {
    if !text.trim_end().is_empty() {
        output::remark(text.trim_end());
    }
}

fn lines(text: &str) -> Result<(), Failure> {
    if text.is_empty() { Ok(()) } else { output::line(text.trim_end()) }
}

/// Whether a stream takes colour.
pub fn has_colour(global: &Global, stream: &impl IsTerminal) -> bool {
    match global.color {
        Colour::Always => true,
        Colour::Never => false,
        Colour::Auto => {
            let refused = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
            let dumb = std::env::var_os("TERM").is_some_and(|v| v == "dumb");
            stream.is_terminal() && !refused && !dumb
        }
    }
}

fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Span;

    /// A fault with two places, a note and a fix.
    pub fn example() -> (Sources, Vec<Diagnostic>) {
        let text = "gonogo 1\nlet a = 6 ±0.1\nlet a = 7\n".to_string();
        let span = |start, end| Span { file: 0, start, end };
        let diagnostic = Diagnostic::error("E0202", span(29, 30), "dimension `a` is defined twice")
            .label("defined again")
            .also(span(13, 14), "first defined here")
            .note("names are unique in a file")
            .suggest("name it `a_2`", span(29, 30), "a_2");
        (Sources { files: vec![("plate.gng".to_string(), text)] }, vec![diagnostic])
    }

    #[test]
    fn spans_outside_their_text_are_harmless() {
        let (sources, _) = example();
        for span in [
            Span { file: 9, start: 3, end: 4 },
            Span { file: 0, start: 21, end: 22 },
            Span { file: 0, start: 900, end: 2 },
        ] {
            let diagnostics = [Diagnostic::error("E0101", span, "x").fix("y", span, "z")];
            human(&sources, &diagnostics, false);
            json(&sources, &diagnostics, false);
            github(&sources, &diagnostics);
            sarif([(&sources, diagnostics.as_slice())]);
        }
    }
}
