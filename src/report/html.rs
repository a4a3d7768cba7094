//! Small pieces of HTML: escaping, numbers, pictures as text.

pub use crate::drawing::svg::escaped;
use crate::runtime::inspect::Decision;
use crate::runtime::model::Rate;
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;

/// A number with so many decimals, trailing zeros cut; a dash for what is no number, and never a negative zero.
pub fn number(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return "–".into();
    }
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let text = if text == "-0" { "0" } else { text };
    text.replacen('-', "−", 1)
}

/// Text of a diagnostic: what stands between backticks is code.
pub fn prose(text: &str) -> String {
    let mut out = String::new();
    let mut pieces = text.split('`').peekable();
    let mut code = false;
    while let Some(piece) = pieces.next() {
        // A backtick without a partner is one.
        match (code, pieces.peek().is_some()) {
            (true, true) => out += &format!("<code>{}</code>", escaped(piece)),
            (true, false) => out += &format!("`{}", escaped(piece)),
            (false, _) => out += &escaped(piece),
        }
        code = !code;
    }
    out
}

/// A coordinate for SVG: a plain finite number.
pub fn at(value: f64) -> String {
    let value = if value.is_finite() { value.clamp(-1e6, 1e6) } else { 0.0 };
    let text = format!("{value:.1}");
    let text = text.strip_suffix(".0").unwrap_or(&text);
    if text == "-0" { "0".into() } else { text.into() }
}

/// `8.4 %`, or `0 %`.
pub fn percent(share: f64) -> String {
    format!("{} %", number(100.0 * share, 1))
}

/// `16 of 190`
pub fn of(rate: &Rate) -> String {
    format!("{} of {}", rate.events, rate.trials)
}

/// `one pin`, `3 pins`.
pub fn count(number: usize, word: &str) -> String {
    if number == 1 { format!("1 {word}") } else { format!("{number} {word}s") }
}

/// The word for people.
pub fn word(decision: Decision) -> &'static str {
    match decision {
        Decision::Go => "go",
        Decision::NoGo => "no-go",
        Decision::CannotInspect => "cannot inspect",
    }
}

/// The class of a verdict in the style sheet.
pub fn class(decision: Decision) -> &'static str {
    match decision {
        Decision::Go => "go",
        Decision::NoGo => "nogo",
        Decision::CannotInspect => "cannot",
    }
}

/// A picture as the address of itself.
pub fn png_uri(picture: &DynamicImage) -> String {
    let mut bytes = Vec::new();
    // Writing to memory does not fail; an empty picture would show it if it did.
    if picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).is_err() {
        bytes.clear();
    }
    format!("data:image/png;base64,{}", base64(&bytes))
}

/// RFC 4648, with padding.
pub fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group.iter().fold(0u32, |w, b| w << 8 | u32::from(*b)) << (8 * (3 - group.len()));
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_in_the_rfc() {
        let pairs =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn backticks_make_code() {
        assert_eq!(prose("`a<b` can meet `c`"), "<code>a&lt;b</code> can meet <code>c</code>");
        assert_eq!(prose("one ` alone"), "one ` alone");
        assert_eq!(prose("``"), "<code></code>");
    }

    #[test]
    fn numbers_are_short_and_finite() {
        assert_eq!(number(1.50, 3), "1.5");
        assert_eq!(number(-0.0001, 3), "0");
        assert_eq!(number(-2.25, 2), "−2.25");
        assert_eq!(number(f64::NAN, 2), "–");
        assert_eq!(number(120.0, 0), "120");
        assert_eq!((at(f64::INFINITY), at(2.04)), ("0".into(), "2".into()));
    }
}
