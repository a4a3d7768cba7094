//! Statements in the wrong block, and words in the wrong order.

use super::super::lines::{outside_strings, strip_comment};
use super::{Slip, is_word, line_start, token_at};

/// Where a statement that stands in the wrong block belongs: first words, block.
const BLOCKS: [(&[&str], &str); 6] = [
    (&["add", "cut", "keep", "outline"], "a `part`"),
    (&["root", "place", "measure"], "an `assembly`"),
    (&["camera", "light", "floor", "vary"], "a `station`"),
    (&["watch", "ignore"], "an `inspect`"),
    (&["from", "line", "arc"], "an `outline`"),
    (&["let"], "a `part`, or out of all braces"),
];

/// Recognises a statement in the wrong block, a feature without `=`, a group placed behind its brace, and the words of an
/// outline in the manner of arguments.
pub fn slip(text: &str, at: usize) -> Option<Slip> {
    let found = token_at(text, at);
    let before = text[line_start(text, at)..at].trim();
    let line = text[at..].lines().next().unwrap_or_default();
    let slip = |message: String, label| Slip::new("E0101", at, found.len().max(1), message, label);
    let behind = before.rsplit(' ').next().unwrap_or_default();
    match found {
        "on" | "at" | "turn" if before == "}" => Some(
            slip("a group is placed before its brace".to_string(), "too late")
                .help(format!("write `group {} {{`", line.trim_end())),
        ),
        "group" if before.is_empty() => {
            let name = line["group".len()..].trim().trim_end_matches('{').trim();
            let slip = slip("a group is added, cut or kept".to_string(), "how?");
            Some(match is_word(name) && line.trim_end().ends_with('{') {
                true => {
                    let text = format!("cut {name} = group {{");
                    slip.suggest(format!("write `{text}`"), at, line.trim_end().len(), text)
                }
                false => slip.help("write `cut mount = group {`"),
            })
        }
        "=" if ["radius", "round", "chamfer", "to", "within", "from"].contains(&behind) => {
            let blanks = line[1..].len() - line[1..].trim_start().len();
            let title = format!("write `{behind} {}`", line[1..].trim());
            Some(slip(format!("`{behind}` takes no `=`"), "not expected here").fix(title, at, 1 + blanks, ""))
        }
        "left" | "right" if before.ends_with(')') => radius_behind(text, at, found),
        _ if before.is_empty() => {
            let (_, block) = BLOCKS.iter().find(|(words, _)| words.contains(&found))?;
            if let ("a `part`", Some(slip)) = (*block, bare_name(text, at)) {
                return Some(slip);
            }
            // Features stand in groups, too.
            let around = enclosing(text, at)
                .map(|around| if ["add", "cut", "keep"].contains(&around) { "part" } else { around });
            if around.is_some_and(|around| block.split('`').nth(1) == Some(around)) {
                return Some(malformed(text, at, found));
            }
            let help = format!("move it into the braces of {block}");
            Some(slip(format!("`{found}` cannot stand here"), "not in this block").help(help))
        }
        _ => None,
    }
}

/// The first word of the line whose `{` is open at `at`.
fn enclosing(text: &str, at: usize) -> Option<&str> {
    let mut open = Vec::new();
    let mut start = 0;
    for line in text[..at].split_inclusive('\n') {
        for (i, byte) in outside_strings(strip_comment(line)) {
            match byte {
                b'{' => open.push(start + i),
                b'}' => drop(open.pop()),
                _ => {}
            }
        }
        start += line.len();
    }
    let open = open.pop()?;
    text[line_start(text, open)..open].split_whitespace().next()
}

/// How the statements of blocks are written.
const FORMS: [(&str, &str); 15] = [
    ("add", "add slab = box(x = 40, y = 30, z = 10)"),
    ("cut", "cut bore = cylinder(d = 6 H7, h = through)"),
    ("keep", "keep disc = cylinder(d = 40, h = 10)"),
    ("outline", "outline profile {"),
    ("root", "root plate"),
    ("place", "place pin on plate.bore"),
    ("measure", "measure gap = from plate.slab.top to lid.slab.bottom"),
    ("camera", "camera fixed {"),
    ("light", "light room = room(patches = 9)"),
    ("floor", "floor {"),
    ("vary", "vary {"),
    ("watch", "watch pin"),
    ("from", "from (0, 0)"),
    ("line", "line to (10, 0)"),
    ("arc", "arc to (10, 0) radius 5 left"),
];

/// A statement that stands where it may, and is written otherwise.
fn malformed(text: &str, at: usize, word: &str) -> Slip {
    let line = strip_comment(text[at..].lines().next().unwrap_or_default()).trim_end();
    let slip = Slip::new("E0101", at, line.len(), format!("this `{word}` cannot be read"), "not of its form");
    let rest = line[word.len()..].trim_start();
    // `light ring(inner = 30)`
    let call = rest.split('(').next().unwrap_or_default().trim_end();
    if let ("light", true, true) = (word, rest.contains('('), is_word(call)) {
        let slip = Slip::new("E0101", at, line.len(), "a light has a name", "one without");
        let text = format!("{call} = ");
        return slip.suggest(format!("write `light {text}{rest}`"), at + line.len() - rest.len(), 0, text);
    }
    match FORMS.iter().find(|(of, _)| *of == word) {
        Some((_, form)) => slip.help(format!("it is written as `{form}`")),
        None => slip,
    }
}

/// `left radius 10`
fn radius_behind(text: &str, at: usize, hand: &str) -> Option<Slip> {
    let message = format!("the radius stands before `{hand}`");
    let slip = Slip::new("E0101", at, hand.len(), message, "not expected here");
    let mut words = text[at..].lines().next()?.split_whitespace().skip(1);
    let size = words.next().filter(|w| *w == "radius").and_then(|_| words.next());
    let Some(size) = size.filter(|_| words.next().is_none_or(|w| w == "long")) else {
        return Some(slip.help(format!("write `radius 10 {hand}`")));
    };
    let len = text[at..].find(size)? + size.len();
    let text = format!("radius {size} {hand}");
    Some(slip.fix(format!("write `{text}`"), at, len, text))
}

/// The fault of `add mount group {`, whose operation at `at` is well placed: the sign behind the name is missing; or of
/// `add pin head = …`, a name of two words.
fn bare_name(text: &str, at: usize) -> Option<Slip> {
    let line = text[at..].lines().next()?;
    let mut words = line.split_whitespace();
    let (op, name, next) = (words.next()?, words.next()?, words.next()?);
    if name.contains('-') && is_word(&name.replace('-', "_")) {
        return super::fields::dash_in_name(text, at + line.find('-')?);
    }
    if !is_word(name) || next.starts_with('=') || op == "outline" {
        return None;
    }
    let name_end = line.find(op)? + op.len();
    let name_end = name_end + line[name_end..].find(name)? + name.len();
    let offset = name_end + line[name_end..].find(next)?;
    if is_word(next) && words.next().is_some_and(|sign| sign.starts_with('=')) {
        let joined = format!("{name}_{next}");
        let start = at + name_end - name.len();
        let slip = Slip::new("E0101", start, at + offset + next.len() - start, "a name is one word", "two words");
        return Some(slip.suggest(format!("write `{joined}`"), at + name_end, offset - name_end, "_"));
    }
    let len = token_at(text, at + offset).len().max(1);
    let slip = Slip::new("E0101", at + offset, len, format!("expected `=` behind `{op} {name}`"), "not expected here");
    Some(slip.fix(format!("write `{op} {name} = {}`", line[offset..].trim()), at + name_end, 0, " ="))
}
