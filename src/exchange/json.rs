//! Minimal JSON text: what a glTF file needs of it.
//!
//! In: names, numbers, finished members. Out: compact text. Never reads JSON; `serde_json` belongs to the command line alone.

use std::fmt::Write;

/// An object of members in the order given, values already being JSON.
pub(super) fn object(members: &[(&str, String)]) -> String {
    let members: Vec<String> = members.iter().map(|(k, v)| format!("{}:{v}", string(k))).collect();
    format!("{{{}}}", members.join(","))
}

/// An array of values that are already JSON.
pub(super) fn array(values: impl IntoIterator<Item = String>) -> String {
    format!("[{}]", values.into_iter().collect::<Vec<_>>().join(","))
}

/// An array of finite numbers.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    // JSON has no word for what is not a number, and a viewer could do nothing with it.
    array(values.into_iter().map(|v| if v.is_finite() { (v + 0.0).to_string() } else { "0".into() }))
}

/// A string in quotes, escaped.
pub(super) fn string(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        let _ = match c {
            '"' | '\\' => write!(out, "\\{c}"),
            c if u32::from(c) < 0x20 => write!(out, "\\u{:04x}", u32::from(c)),
            c => out.write_char(c),
        };
    }
    out.push('"');
    out
}
