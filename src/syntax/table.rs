//! The layout of a table of sizes: one row a line, its columns aligned.
//!
//! In: the statements of a table's body. Out: their text without the indentation. Part of the one canonical layout.

use super::ast::{Line, Name, Stmt};
use super::format::dim;

/// Widths of the keys and of each column of cells, over all rows; empty where no rows stand.
pub fn widths(lines: &[Line]) -> Vec<usize> {
    let mut widths = Vec::new();
    for line in lines {
        for (i, text) in texts(&line.stmt).iter().flatten().enumerate() {
            let width = text.chars().count();
            match widths.get_mut(i) {
                Some(widest) => *widest = width.max(*widest),
                None => widths.push(width),
            }
        }
    }
    widths
}

/// A row with its note, padded to `widths`; `None` for other statements.
pub fn row(line: &Line, widths: &[usize]) -> Option<String> {
    let texts = texts(&line.stmt)?;
    let (key, cells) = texts.split_first()?;
    let mut text = format!("row {key:width$} = (", width = widths.first().copied().unwrap_or(0));
    for (i, cell) in cells.iter().enumerate() {
        let last = i + 1 == cells.len();
        text += cell;
        if !last {
            let width = widths.get(i + 1).copied().unwrap_or(0);
            text += &format!(",{:pad$} ", "", pad = width.saturating_sub(cell.chars().count()));
        }
    }
    text.push(')');
    Some(line.after.iter().fold(text, |text, note| format!("{text}  {note}")))
}

/// `(d, l)`
pub fn names(names: &[Name]) -> String {
    format!("({})", names.iter().map(|n| n.text.as_str()).collect::<Vec<_>>().join(", "))
}

/// The key and the cells of a row.
fn texts(stmt: &Stmt) -> Option<Vec<String>> {
    let Stmt::Row { key, cells } = stmt else { return None };
    Some(std::iter::once(key.text.clone()).chain(cells.iter().map(dim)).collect())
}
