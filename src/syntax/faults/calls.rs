//! Slips in the arguments of shapes, patterns and lights, in points, and in what a `place` puts there.

use super::super::lines::{line_end, outside_strings};
use super::{Slip, is_word, is_word_letter, line_start, token_at};

/// What is called with arguments, and their names in the order in which people give them elsewhere.
const ARGUMENTS: [(&str, &[&str]); 16] = [
    ("box", &["x", "y", "z"]),
    ("cylinder", &["d", "h"]),
    ("cone", &["d1", "d2", "h"]),
    ("frustum", &["d1", "d2", "h"]),
    ("sphere", &["d"]),
    ("torus", &["d", "tube"]),
    ("prism", &["outline", "h"]),
    ("revolve", &["outline"]),
    ("hole", &["d", "h"]),
    ("counterbore", &["d", "h", "head_d", "head_h"]),
    ("countersink", &["d", "h", "head_d"]),
    ("circle", &["d"]),
    ("line", &["pitch"]),
    ("grid", &["columns", "x", "y"]),
    ("ring", &["inner", "outer"]),
    ("panel", &["width", "height", "at"]),
];

/// Words before a point.
const PLACES: [&str; 4] = ["at", "turn", "to", "from"];

/// Recognises a slip at `at`, where one of `expected` was expected.
pub fn slip(text: &str, at: usize, expected: &[&'static str]) -> Option<Slip> {
    let expects = |what: &str| expected.contains(&what);
    coordinates(text, at)
        .or_else(|| nameless(text, at))
        .or_else(|| if expects("arguments in parentheses") { no_arguments(text, at) } else { None })
        .or_else(|| if text[at..].starts_with('(') { member(text, at) } else { None })
        .or_else(|| empty_parentheses(text, at))
}

/// The text inside the parenthesis at `open`, up to its partner or the end of the line.
fn inside(text: &str, open: usize) -> &str {
    let end = line_end(text, open);
    let mut depth = 0;
    for (i, byte) in outside_strings(&text[open..end]) {
        match byte {
            b'(' => depth += 1,
            b')' if depth == 1 => return &text[open + 1..open + i],
            b')' => depth -= 1,
            _ => {}
        }
    }
    &text[open + 1..end]
}

/// The parenthesis on the line of `at` that is open there.
fn open_at(text: &str, at: usize) -> Option<usize> {
    let line = line_start(text, at);
    let mut open = Vec::new();
    for (i, byte) in outside_strings(&text[line..at]) {
        match byte {
            b'(' => open.push(line + i),
            b')' => drop(open.pop()),
            _ => {}
        }
    }
    open.pop()
}

/// Where the values between commas begin, outside of inner parentheses, and what they are.
fn values(list: &str) -> Vec<(usize, &str)> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    for (i, byte) in outside_strings(list) {
        match byte {
            b'(' | b'{' => depth += 1,
            b')' | b'}' => depth -= 1,
            b',' if depth == 0 => {
                found.push((start, &list[start..i]));
                start = i + 1;
            }
            _ => {}
        }
    }
    found.push((start, &list[start..]));
    let trimmed = |(start, value): (usize, &'_ str)| start + value.len() - value.trim_start().len();
    found.iter().map(|&v| (trimmed(v), v.1.trim())).collect()
}

/// The word before a parenthesis.
fn word_before(text: &str, open: usize) -> &str {
    let before = text[..open].trim_end_matches(' ');
    &before[before.trim_end_matches(is_word_letter).len()..]
}

/// `at (5)`, `at (1, 2, 3, 4)`.
fn coordinates(text: &str, at: usize) -> Option<Slip> {
    let open = open_at(text, at)?;
    let word = PLACES.into_iter().find(|word| *word == word_before(text, open))?;
    let list = inside(text, open);
    let values = values(list);
    let flat = matches!(word, "to" | "from");
    let (message, most) = match flat {
        true => ("a corner has two coordinates", 2),
        false => ("a point has three coordinates, or two with z = 0", 3),
    };
    let given = values.iter().filter(|(_, v)| !v.is_empty()).count();
    if (2..=most).contains(&given) || values.iter().any(|(_, v)| v.contains('=')) {
        return None;
    }
    let label = if given < 2 { "too few" } else { "too many" };
    let slip = Slip::new("E0101", open, list.len() + 2, message, label);
    Some(match (given, flat) {
        (1, false) => {
            let zeros = format!("({}, 0, 0)", list.trim());
            slip.suggest(format!("write `{word} {zeros}`"), open, list.len() + 2, zeros)
        }
        _ => slip,
    })
}

/// `box(60, 60, 20)`: each value gets the name of its place.
fn nameless(text: &str, at: usize) -> Option<Slip> {
    let open = open_at(text, at)?;
    let owner = word_before(text, open);
    let list = inside(text, open);
    let all = values(list);
    let begins = |(start, _): &&(usize, &str)| open + 1 + start == at;
    let named = |v: &str| v.split_once('=').is_some_and(|(key, _)| is_word(key.trim()));
    all.iter().find(begins).filter(|(_, v)| !v.is_empty() && !named(v))?;
    if !is_word(owner) || PLACES.contains(&owner) {
        return None;
    }
    let slip = Slip::new("E0101", at, token_at(text, at).len().max(1), "every argument has a name", "whose value?");
    let keys = ARGUMENTS.iter().find(|(word, _)| *word == owner).map(|(_, keys)| *keys);
    let line = &text[line_start(text, at)..at];
    let keys = match keys {
        Some(keys) => keys,
        // A member of a family from the library: its size comes first, then its length.
        None if line.trim_start().starts_with("part ") => &["d", "l"],
        None => return Some(slip.help(format!("write `{owner}(name = value)`"))),
    };
    if all.len() > keys.len() {
        return Some(slip.help(format!("`{owner}` takes `{}`", keys.join("`, `"))));
    }
    let taken = |key: &str| all.iter().any(|(_, v)| named(v) && v.split('=').next().is_some_and(|k| k.trim() == key));
    let lacking = all.iter().zip(keys).filter(|((_, v), _)| !named(v));
    let edits: Vec<(usize, usize, String)> =
        lacking.filter(|(_, key)| !taken(key)).map(|((i, _), key)| (open + 1 + i, 0, format!("{key} = "))).collect();
    let write = all.iter().zip(keys).map(|((_, v), key)| if named(v) { v.to_string() } else { format!("{key} = {v}") });
    let title = format!("write `{owner}({})`", write.collect::<Vec<_>>().join(", "));
    Some(slip.change(title, false, edits))
}

/// `light lamp = room`
fn no_arguments(text: &str, at: usize) -> Option<Slip> {
    let before = text[..at].trim_end_matches(' ');
    let start = before.trim_end_matches(is_word_letter).len();
    let word = &before[start..];
    let ends = token_at(text, at).is_empty() || text[at..].starts_with(['}', '/']);
    (ends && is_word(word) && before[..start].trim_end().ends_with(['=', 'x'])).then(|| {
        let message = format!("expected arguments in parentheses behind `{word}`");
        let slip = Slip::new("E0101", start, word.len(), message, "without them");
        slip.suggest(format!("write `{word}()`"), before.len(), 0, "()")
    })
}

/// `place screw = 2x iso4762(d = M6, l = 20) on plate.bore`
fn member(text: &str, at: usize) -> Option<Slip> {
    let line = text[line_start(text, at)..].lines().next()?.trim_start();
    let (name, _) = line.strip_prefix("place ")?.split_once('=')?;
    let family = word_before(text, at);
    let call = format!("{family}({})", inside(text, at));
    let start = at - family.len();
    let slip = Slip::new("E0101", start, call.len(), "only a part that has a name is placed", "a member of a family");
    let name = if is_word(name.trim()) { name.trim() } else { "piece" };
    Some(slip.help(format!("outside of the assembly write `part {name} = {call}`, and `{name}` here")))
}

/// `part pin() {`
fn empty_parentheses(text: &str, at: usize) -> Option<Slip> {
    let line = line_start(text, at);
    let open = text[line..at].trim_end().strip_suffix('(').map(|before| line + before.len())?;
    let head = text[line..open].trim_end();
    let mut words = head.split_whitespace();
    let (kind, name) = (words.next()?, words.next()?);
    let is_head =
        ["material", "part", "assembly", "station"].contains(&kind) && is_word(name) && words.next().is_none();
    (is_head && text[at..].starts_with(')')).then(|| {
        let slip =
            Slip::new("E0101", open, at + 1 - open, format!("{kind} `{name}` has no parameters"), "nothing in it");
        let from = line + head.len();
        slip.fix(format!("write `{kind} {name}`"), from, at + 1 - from, "")
    })
}
