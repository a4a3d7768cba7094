//! One line each: `file:line:column: error[E0301]: message`.

use super::place::Place;
use super::word;
use crate::diag::{Diagnostic, Sources, Span};

/// The lines; `_colour` is for the others of its kind.
pub fn short(sources: &Sources, diagnostics: &[Diagnostic], _colour: bool) -> String {
    let line = |d: &Diagnostic| {
        let place = Place::of(sources, d.labels.first().map_or(Span::default(), |label| label.span));
        format!("{}:{}:{}: {}[{}]: {}\n", place.file, place.line, place.column, word(d.severity), d.code, d.message)
    };
    diagnostics.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;

    #[test]
    fn columns_count_characters() {
        let (sources, diagnostics) = example();
        assert_eq!(
            short(&sources, &diagnostics, false),
            "plate.gng:3:5: error[E0202]: dimension `a` is defined twice\n"
        );
    }
}
