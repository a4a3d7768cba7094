//! Numbers with their limits, in words: `6.000 … 6.012 mm`.

use crate::design::Reading;
use crate::units::Quantity;

/// Digits behind the point: micrometres, or tenths of them where they matter.
const DIGITS: usize = 3;

/// A value (mm, rad, px, or a ratio) in the unit that people read.
pub fn value(value: f64, quantity: Quantity) -> String {
    match quantity {
        Quantity::Length => length(value),
        Quantity::Angle => trimmed(value.to_degrees()),
        Quantity::Ratio | Quantity::Pixels => trimmed(value),
    }
}

/// ` mm`, with the blank in front.
pub fn unit(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Length => " mm",
        Quantity::Angle => " deg",
        Quantity::Ratio => "",
        Quantity::Pixels => " px",
    }
}

/// `6.000 … 6.012`, or one number where there is nothing to choose.
pub fn limits(reading: &Reading) -> String {
    let [low, high] = [reading.range.low, reading.range.high].map(|v| value(v, reading.quantity));
    if low == high { low } else { format!("{low} … {high}") }
}

/// A deviation with its sign: `+0.012`, `0`, `-0.1`.
pub fn deviation(value: f64) -> String {
    let text = trimmed(value);
    if value > 0.0 && text != "0" { format!("+{text}") } else { text }
}

fn length(value: f64) -> String {
    let coarse = format!("{value:.DIGITS$}");
    let rounded = (value * 1e3).round() / 1e3;
    // Beyond a tenth of a micrometre there is only the noise of the arithmetic.
    let text = if (value - rounded).abs() < 5e-5 { coarse } else { format!("{value:.4}") };
    without_minus_zero(text)
}

fn trimmed(value: f64) -> String {
    let text = format!("{value:.4}");
    without_minus_zero(text.trim_end_matches('0').trim_end_matches('.').to_string())
}

fn without_minus_zero(text: String) -> String {
    let is_zero = text.bytes().all(|b| b"-0.".contains(&b));
    if is_zero { text.trim_start_matches('-').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_show_micrometres_and_more_where_it_matters() {
        for (v, text) in [(6.0, "6.000"), (6.012, "6.012"), (0.0074, "0.0074"), (-1e-12, "0.000"), (24.9935, "24.9935")]
        {
            assert_eq!(value(v, Quantity::Length), text);
        }
        assert_eq!(value(1f64.to_radians(), Quantity::Angle), "1");
        assert_eq!((deviation(0.012), deviation(0.0), deviation(-0.1)), ("+0.012".into(), "0".into(), "-0.1".into()));
    }
}
