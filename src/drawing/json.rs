//! JSON for programs that read what others look at.

use serde::Serialize;

/// Plain data as JSON of two-space indents, with a line break at its end.
pub fn json(value: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(value).expect("plain data always serialises");
    text.push('\n');
    text
}

/// The same on one line.
pub fn compact(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("plain data always serialises")
}
