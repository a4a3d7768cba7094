//! The language of graphviz, as far as the diagrams need it.

/// A name or text in quotes, as DOT takes it: a backslash would start an escape of graphviz.
pub fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    #[test]
    fn quotes_and_backslashes_are_escaped() {
        assert_eq!(super::quoted("a \"b\" \\N\n"), "\"a \\\"b\\\" \\\\N \"");
    }
}
