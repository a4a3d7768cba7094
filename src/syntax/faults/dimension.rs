//! Slips in a dimension: what is written on paper and means something else here.

use super::super::lines::strip_comment;
use super::{Slip, line_start};

/// Recognises the usual slips in the dimension around `at`.
pub fn slip(text: &str, at: usize) -> Option<Slip> {
    number_slip(text, at).or_else(|| tolerance_slip(text, at))
}

fn tolerance_slip(text: &str, at: usize) -> Option<Slip> {
    let (start, dim) = dimension_around(text, at)?;
    let words: Vec<&str> = dim.split_whitespace().collect();
    let slip = |code, message: String, label| Slip::new(code, start, dim.len(), message, label);
    let whole = |slip: Slip, text: String| slip.fix(format!("write `{text}`"), start, dim.len(), text);
    let maybe =
        |slip: Slip, why: &str, text: String| slip.suggest(format!("write `{text}` {why}"), start, dim.len(), text);
    if let Some((deviations, unit)) = deviations_with_units(dim) {
        let text = format!("{deviations} {unit}");
        return Some(whole(
            slip("E0104", "the unit of two deviations stands behind both".into(), "a unit between them"),
            text,
        ));
    }
    match words.as_slice() {
        [size, pair] if is_fit_pair(pair) => {
            let (hole, shaft) = pair.split_once('/')?;
            let slip = slip("E0309", format!("`{pair}` names the fits of two parts"), "one size has one fit");
            let [hole, shaft] = [format!("{size} {hole}"), format!("{size} {shaft}")];
            let (in_hole, in_shaft) = ("in the part with the hole", "in the part with the shaft");
            let is_cut = text[line_start(text, at)..].trim_start().starts_with("cut");
            Some(match is_cut {
                true => maybe(maybe(slip, in_hole, hole), in_shaft, shaft),
                false => maybe(maybe(slip, in_shaft, shaft), in_hole, hole),
            })
        }
        [size, tolerance] if tolerance.starts_with('±') && tolerance.contains('/') => {
            let (upper, lower) = tolerance.trim_start_matches('±').split_once('/')?;
            let signed = |d: &str, sign: &str| match d.starts_with(['+', '-']) {
                true => d.to_string(),
                false => format!("{sign}{d}"),
            };
            let text = format!("{size} {}/{}", signed(upper, "+"), signed(lower, "-"));
            Some(whole(slip("E0104", "`±` takes one deviation".into(), "two deviations"), text))
        }
        [size, tolerance] if tolerance.starts_with("+-") || tolerance.starts_with("-+") => {
            let text = format!("{size} ±{}", &tolerance[2..]);
            Some(whole(slip("E0104", format!("`{}` is no sign", &tolerance[..2]), "not a tolerance"), text))
        }
        [size, upper, lower] if is_signed(upper) && (is_signed(lower) || *lower == "0") => {
            let (upper, lower) =
                if upper.starts_with('-') && lower.starts_with('+') { (lower, upper) } else { (upper, lower) };
            let text = format!("{size} {upper}/{lower}");
            Some(whole(
                slip("E0104", "a two-sided tolerance needs a slash".into(), "two deviations without a slash"),
                text,
            ))
        }
        [size, deviation] if is_signed(deviation) => {
            let sum = format!("({size} {} {})", &deviation[..1], &deviation[1..]);
            let both = if deviation.starts_with('+') { format!("{deviation}/0") } else { format!("0/{deviation}") };
            let slip = slip("E0104", "a deviation stands alone".into(), "one deviation");
            Some(maybe(maybe(slip, "for a tolerance", format!("{size} {both}")), "for a sum", sum))
        }
        [low, "to" | "-" | "bis", high] if is_between(low, high) => {
            let slip = slip("E0103", "limits are joined by `..`".into(), "neither limits nor a sum");
            let slip = maybe(slip, "for limits", format!("{low} .. {high}"));
            Some(if words[1] == "-" { maybe(slip, "for a sum", format!("({dim})")) } else { slip })
        }
        _ if is_bare_sum(dim) => Some(whole(
            slip("E0103", "sums need parentheses".into(), "arithmetic outside parentheses"),
            format!("({dim})"),
        )),
        _ => None,
    }
}

/// `6 +0.1 mm/-0.2 mm`: the dimension without its units, and the unit.
fn deviations_with_units(dim: &str) -> Option<(String, &str)> {
    let (left, right) = dim.split_once('/')?;
    let (left, right): (Vec<&str>, Vec<&str>) = (left.split_whitespace().collect(), right.split_whitespace().collect());
    let [size @ .., upper, unit] = left.as_slice() else { return None };
    let is_unit = |word: &str| ["mm", "um", "cm", "in", "deg"].contains(&word);
    let (lower, other) = (right.first()?, right.get(1).copied().unwrap_or(unit));
    let plain = |word: &str| is_signed(word) || word == "0";
    let good = plain(upper) && plain(lower) && is_unit(unit) && other == *unit && right.len() <= 2 && !size.is_empty();
    good.then(|| (format!("{} {upper}/{lower}", size.join(" ")), *unit))
}

/// A number as it is written elsewhere: `80,5`, `.2`, `5.`, `8.1...8.2`, `1 080`, `H 7`.
fn number_slip(text: &str, at: usize) -> Option<Slip> {
    let (before, rest) = (&text[..at], &text[at..]);
    let digit = |c: char| c.is_ascii_digit();
    let digits = rest.len() - rest.trim_start_matches(digit).len();
    if before.strip_suffix(',').is_some_and(|b| b.ends_with(digit)) && digits > 0 {
        return Some(decimal_comma(text, at));
    }
    let dots = before.trim_end_matches('.').len();
    if text[dots..].starts_with("...") {
        let slip = Slip::new("E0101", dots, 3, "limits are joined by two dots", "three dots");
        return Some(slip.fix("write `..`", dots, 3, ".."));
    }
    if rest.starts_with('.') && rest[1..].starts_with(digit) && !before.ends_with(digit) {
        let slip = Slip::new("E0101", at, 1, "a number begins with a digit", "a point alone");
        return Some(slip.fix("write the zero", at, 0, "0"));
    }
    if rest.starts_with('.')
        && before.ends_with(digit)
        && !rest[1..].starts_with(|c: char| c == '.' || c.is_alphanumeric())
    {
        let slip = Slip::new("E0101", at, 1, "a number ends with a digit", "a point alone");
        return Some(slip.fix("remove the point", at, 1, ""));
    }
    class_apart(text, at).or_else(|| digits_apart(text, at, digits))
}

/// Every comma between two digits of the value around `at`.
fn decimal_comma(text: &str, at: usize) -> Slip {
    let start = text[..at - 1].rfind(['=', '(', '\n']).map_or(0, |i| i + 1);
    let start = text[..at - 1].rfind(", ").map_or(start, |i| start.max(i + 1));
    let end = text[at..].find([')', '\n', '=']).map_or(text.len(), |i| at + i);
    let end = text[at..end].find(", ").map_or(end, |i| at + i);
    let digit = |i: usize| text.as_bytes().get(i).is_some_and(u8::is_ascii_digit);
    let commas = text[start..end].match_indices(',').map(|(i, _)| start + i).filter(|&i| digit(i - 1) && digit(i + 1));
    let edits: Vec<(usize, usize, String)> = commas.map(|i| (i, 1, ".".to_string())).collect();
    let value = text[start..end].trim();
    let point: String = edits.iter().rev().fold(text[start..end].to_string(), |mut value, (i, _, _)| {
        value.replace_range(i - start..i - start + 1, ".");
        value
    });
    let from = start + text[start..end].len() - text[start..end].trim_start().len();
    let slip = Slip::new("E0101", from, value.len(), "decimals stand behind a point", "a comma separates values");
    slip.change(format!("write `{}`", point.trim()), true, edits)
}

/// `H 7`, with the fault at either of the two.
fn class_apart(text: &str, at: usize) -> Option<Slip> {
    let letter = |c: char| c.is_ascii_alphabetic();
    let start = match text[at..].starts_with(letter) {
        true => at,
        false => text[..at].trim_end_matches(' ').trim_end_matches(letter).len(),
    };
    let word: &str = &text[start..start + text[start..].find(|c| !letter(c)).unwrap_or(text.len() - start)];
    let gap = &text[start + word.len()..];
    let grade = gap.trim_start_matches(' ');
    let blanks = gap.len() - grade.len();
    let digits = grade.len() - grade.trim_start_matches(|c: char| c.is_ascii_digit()).len();
    let size = text[..start].trim_end().ends_with(|c: char| c.is_ascii_digit() || c == ')');
    let whole = !grade[digits..].starts_with(|c: char| c.is_alphanumeric() || c == '.');
    let plausible = (1..=2).contains(&word.len()) && (1..=2).contains(&digits) && blanks > 0 && size && whole;
    plausible.then(|| {
        let class = format!("{word}{}", &grade[..digits]);
        Slip::new("E0101", start, word.len() + blanks + digits, "a fit is one word", "a blank in a fit").fix(
            format!("write `{class}`"),
            start + word.len(),
            blanks,
            "",
        )
    })
}

/// `1 080`: one number, unless it stands in a point.
fn digits_apart(text: &str, at: usize, digits: usize) -> Option<Slip> {
    let before = text[..at].trim_end_matches(' ');
    let inner = text[..at].rfind(['(', '=']).map(|i| &text[i..=i]);
    let first = before.trim_end_matches(|c: char| c.is_ascii_digit()).len();
    let (count, blanks) = (before.len() - first, at - before.len());
    let thousands = digits == 3 && (1..=3).contains(&count) && blanks > 0 && inner == Some("=");
    thousands.then(|| {
        Slip::new("E0101", first, at + digits - first, "a number has no blanks", "two numbers").suggest(
            format!("write `{}{}`", &before[first..], &text[at..at + digits]),
            before.len(),
            blanks,
            "",
        )
    })
}

/// The text between the `=`, `(` or `,` before `at` and the `,`, `)` or line end behind it, with its offset.
fn dimension_around(text: &str, at: usize) -> Option<(usize, &str)> {
    let line_start = line_start(text, at);
    let line_end = text[at..].find('\n').map_or(text.len(), |i| at + i);
    let line_end = line_start + strip_comment(&text[line_start..line_end]).len();
    let start = line_start + text[line_start..at.min(line_end)].rfind(['=', '(', ','])? + 1;
    let end = text[at.min(line_end)..line_end].find([',', ')']).map_or(line_end, |i| at + i);
    let dim = &text[start..end];
    let indent = dim.len() - dim.trim_start().len();
    Some((start + indent, dim.trim()))
}

fn is_signed(word: &str) -> bool {
    let number = word.strip_prefix(['+', '-']).unwrap_or_default();
    number.starts_with(|c: char| c.is_ascii_digit()) && number.parse::<f64>().is_ok()
}

/// Two numbers, the smaller first.
fn is_between(low: &str, high: &str) -> bool {
    let (low, high) = (low.parse::<f64>(), high.parse::<f64>());
    low.is_ok_and(|low| high.is_ok_and(|high| low < high))
}

fn is_fit_pair(word: &str) -> bool {
    let class = |s: &str| {
        let digits = s.trim_start_matches(|c: char| c.is_ascii_alphabetic());
        !digits.is_empty() && digits.len() < s.len() && digits.bytes().all(|b| b.is_ascii_digit())
    };
    word.split_once('/').is_some_and(|(hole, shaft)| class(hole) && class(shaft))
}

/// Operands joined by operators, and nothing else.
fn is_bare_sum(dim: &str) -> bool {
    let operator = |c: char| matches!(c, '+' | '-' | '*' | '/');
    // A number or a name, and perhaps a unit.
    let operand = |s: &str| {
        let mut words = s.split_whitespace();
        let plain = |w: &str| w.chars().all(|c| c.is_alphanumeric() || matches!(c, '_' | '.'));
        let unit = |w: &str| w.chars().all(char::is_alphabetic);
        words.next().is_some_and(plain) && words.next().is_none_or(unit) && words.next().is_none()
    };
    let dim = dim.strip_prefix('-').unwrap_or(dim);
    dim.contains(operator) && dim.split(operator).all(operand)
}
