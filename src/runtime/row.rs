//! One row of an image as the model file writes it: a short text.
//!
//! Neighbouring pixels are much alike, so most values are written as one character, the step from the value to their left
//! (the first: from 0): `!` to `z` for -45 .. 44, with 0 at `N`. A larger step is `~` and the value itself in three digits of
//! base 64 from `0` on. The two characters that a RON string cannot hold as they are, `"` and `\`, are written `{` and `}`.
//! The writer of RON escapes one more without need, `'` as `\'`: a step of -39 costs two bytes in the file, and is read back
//! as the one character it is. Reading refuses anything else.

use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Character of the step 0, and the largest steps either way.
const ZERO: i32 = b'N' as i32;
const STEPS: std::ops::RangeInclusive<i32> = -45..=44;
/// Announces a value written out, and the character of its digit 0.
const WRITTEN_OUT: u8 = b'~';
const DIGIT: u8 = b'0';
/// What a RON string has to escape, and what stands for it.
const ESCAPED: [(u8, u8); 2] = [(b'"', b'{'), (b'\\', b'}')];

/// Grey values from left to right.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Row(pub Vec<u16>);

impl Row {
    fn to_text(&self) -> String {
        let mut text = String::with_capacity(self.0.len() + 8);
        let mut left = 0;
        for &value in &self.0 {
            let step = i32::from(value) - left;
            if STEPS.contains(&step) {
                text.push(char::from(plain((ZERO + step) as u8)));
            } else {
                text.push(char::from(WRITTEN_OUT));
                let digit = |shift: u32| char::from(plain(DIGIT + (value >> shift & 63) as u8));
                text.extend([digit(12), digit(6), digit(0)]);
            }
            left = i32::from(value);
        }
        text
    }

    fn from_text(text: &str) -> Option<Row> {
        let mut values = Vec::with_capacity(text.len());
        let mut bytes = text.bytes();
        let mut left = 0i32;
        if text.bytes().any(|b| ESCAPED.iter().any(|(escaped, _)| *escaped == b)) {
            return None;
        }
        while let Some(byte) = bytes.next() {
            left = if byte == WRITTEN_OUT {
                let mut value = 0i32;
                for _ in 0..3 {
                    let digit = i32::from(coded(bytes.next()?)) - i32::from(DIGIT);
                    value = value << 6 | Some(digit).filter(|d| (0..64).contains(d))?;
                }
                value
            } else {
                left + Some(i32::from(coded(byte)) - ZERO).filter(|step| STEPS.contains(step))?
            };
            values.push(u16::try_from(left).ok()?);
        }
        Some(Row(values))
    }
}

/// The byte that stands for a code in the text.
fn plain(code: u8) -> u8 {
    ESCAPED.iter().find(|(escaped, _)| *escaped == code).map_or(code, |(_, plain)| *plain)
}

/// The code that a byte of the text stands for.
fn coded(byte: u8) -> u8 {
    ESCAPED.iter().find(|(_, plain)| *plain == byte).map_or(byte, |(escaped, _)| *escaped)
}

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.to_text())
    }
}

impl<'de> Deserialize<'de> for Row {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Row, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Row;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a row of an image")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Row, E> {
                Row::from_text(text).ok_or_else(|| E::custom("not a row of an image"))
            }
        }
        deserializer.deserialize_str(Text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_and_every_value_comes_back() {
        let mut values: Vec<u16> = (0..=u16::MAX).step_by(37).chain([0, u16::MAX, 1]).collect();
        for step in -60..60 {
            values.extend([1000, (1000 + step) as u16]);
        }
        let row = Row(values);
        let text = row.to_text();
        assert!(text.bytes().all(|b| (b'!'..=b'~').contains(&b) && b != b'"' && b != b'\\'), "{text}");
        assert_eq!(Row::from_text(&text), Some(row));
    }

    #[test]
    fn every_step_comes_back_from_ron() {
        let mut values = vec![1000];
        for step in STEPS {
            values.extend([(1000 + step) as u16, 1000]);
        }
        let row = Row(values);
        let written = ron::to_string(&row).unwrap();
        // What the header says of the writer.
        assert!(written.contains("\\'") && !written.contains("\\\"") && !written.contains("\\\\"), "{written}");
        assert_eq!(ron::from_str::<Row>(&written).unwrap(), row);
    }

    #[test]
    fn smooth_rows_are_short() {
        let row = Row((0..200).map(|i| 400 + (i % 40)).collect());
        assert_eq!(row.to_text().len(), 200 + 3);
    }

    #[test]
    fn anything_else_is_refused() {
        for text in ["~", "~00", "~zzz", "N\u{1}", "é", "\"", "!!"] {
            assert_eq!(Row::from_text(text), None, "{text}");
        }
        assert_eq!(Row::from_text(""), Some(Row(Vec::new())));
    }
}
