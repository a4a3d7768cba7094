//! Annotations of lines in GitHub Actions: `::error file=…,line=…,col=…,title=…::…`.

use super::place::Place;
use super::word;
use crate::diag::{Diagnostic, Sources};

/// One annotation a line.
pub fn github(sources: &Sources, diagnostics: &[Diagnostic]) -> String {
    diagnostics.iter().map(|d| annotation(sources, d) + "\n").collect()
}

fn annotation(sources: &Sources, diagnostic: &Diagnostic) -> String {
    let span = diagnostic.labels.first().map(|l| l.span).unwrap_or_default();
    let Place { file, line, column, end_line, end_column } = Place::of(sources, span);
    // Columns of an end are only understood on the same line.
    let end = if end_line == line { format!("endColumn={end_column}") } else { format!("endLine={end_line}") };
    let property = |v: &str| escaped(v).replace(':', "%3A").replace(',', "%2C");
    let message = match &diagnostic.help {
        Some(help) => format!("{}\nhelp: {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    format!(
        "::{} file={},line={line},col={column},{end},title={}::{}",
        word(diagnostic.severity),
        property(file),
        diagnostic.code,
        escaped(&message)
    )
}

fn escaped(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Span;

    #[test]
    fn an_annotation_counts_lines_and_letters_from_one() {
        let sources = Sources { files: vec![("a,b.gng".into(), "gonogo 1\nlet ± = x\n".into())] };
        let fault = Diagnostic::error("E0201", Span { file: 0, start: 18, end: 19 }, "no `x`").help("100 %");
        let expected = "::error file=a%2Cb.gng,line=2,col=9,endColumn=10,title=E0201::no `x`%0Ahelp: 100 %25\n";
        assert_eq!(github(&sources, &[fault]), expected);
    }
}
