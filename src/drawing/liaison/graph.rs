//! The liaison diagram reduced to what is drawn: boxes with rows, and wires between rows.
//!
//! In: the liaison diagram. Out: [`Graph`]. Copies of one feature that touch the same in the same way share a row, and their
//! contacts a wire with a count; three or fewer stay apart. Never drops a surface or a contact.

use super::super::ink::{Class, figures, is_round};
use crate::assembly::contact::{Contact, FaceRef};
use crate::assembly::liaison::Liaison;
use crate::design::model::Design;
use crate::solid::Solid;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Up to this many like surfaces have a row each.
const FEW: usize = 3;

pub(super) struct Graph {
    /// One per component, in the design's order.
    pub boxes: Vec<Block>,
    pub wires: Vec<Wire>,
    pub contacts: usize,
}

pub(super) struct Block {
    pub name: String,
    pub rows: Vec<Row>,
}

/// One surface, or several that are alike.
pub(super) struct Row {
    pub label: String,
    pub round: bool,
    pub faces: Vec<FaceRef>,
}

/// A contact between two rows, or several that are alike.
pub(super) struct Wire {
    pub ends: [End; 2],
    pub class: Class,
    pub count: usize,
    /// What touches, and how it fits.
    pub note: String,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct End {
    /// Index into [`Graph::boxes`].
    pub block: usize,
    /// Index into [`Block::rows`].
    pub row: usize,
}

impl Graph {
    pub fn new(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> Graph {
        let namer = Namer { design, solids };
        let mut touching: BTreeMap<FaceRef, Vec<&Contact>> = BTreeMap::new();
        for contact in &liaison.contacts {
            touching.entry(contact.a).or_default().push(contact);
            touching.entry(contact.b).or_default().push(contact);
        }
        let mut boxes: Vec<Block> =
            design.components.iter().map(|c| Block { name: c.name.clone(), rows: Vec::new() }).collect();
        let mut ends: BTreeMap<FaceRef, End> = BTreeMap::new();
        for faces in namer.alike(&touching) {
            let block = faces[0].component;
            let round = touching[&faces[0]].iter().any(|c| is_round(c));
            faces.iter().for_each(|f| {
                ends.insert(*f, End { block, row: boxes[block].rows.len() });
            });
            boxes[block].rows.push(Row { label: namer.label(&faces), round, faces });
        }
        let wires = wires(&namer, liaison, &ends);
        Graph { boxes, wires, contacts: liaison.contacts.len() }
    }
}

struct Namer<'a> {
    design: &'a Design,
    solids: &'a [Arc<Solid>],
}

/// Of a face: its component, its name without numbers, and what it touches, by name without numbers.
type Likeness = (usize, String, BTreeSet<(usize, String, Class)>);

impl Namer<'_> {
    fn name(&self, face: FaceRef) -> &str {
        &self.solids[face.component].faces[face.face].name
    }

    /// Faces that share a row, in the order of their first ones.
    fn alike(&self, touching: &BTreeMap<FaceRef, Vec<&Contact>>) -> Vec<Vec<FaceRef>> {
        let mut groups: BTreeMap<Likeness, Vec<FaceRef>> = BTreeMap::new();
        for (face, contacts) in touching {
            let other = |c: &Contact| if c.a == *face { c.b } else { c.a };
            let touched = |c: &&Contact| {
                let other = other(c);
                (other.component, without_numbers(self.name(other)), Class::of(c))
            };
            let likeness = (face.component, without_numbers(self.name(*face)), contacts.iter().map(touched).collect());
            groups.entry(likeness).or_default().push(*face);
        }
        let apart = |faces: Vec<FaceRef>| match faces.len() {
            0..=FEW => faces.into_iter().map(|f| vec![f]).collect(),
            _ => vec![faces],
        };
        let mut rows: Vec<Vec<FaceRef>> = groups.into_values().flat_map(apart).collect();
        rows.sort();
        rows
    }

    /// `bore.side`, or `gap[1…36].side` for many.
    fn label(&self, faces: &[FaceRef]) -> String {
        let names: Vec<Vec<&str>> = faces.iter().map(|f| pieces(self.name(*f)).collect()).collect();
        let range = |i: usize| {
            let piece = |name: &Vec<&str>| name.get(i).and_then(|p| p.parse::<u32>().ok());
            let (low, high) = (names.iter().filter_map(piece).min(), names.iter().filter_map(piece).max());
            match (low, high) {
                (Some(low), Some(high)) if low < high => format!("{low}…{high}"),
                _ => names[0][i].into(),
            }
        };
        (0..names[0].len()).map(range).collect()
    }

    fn note(&self, contact: &Contact, count: usize) -> String {
        let full = |f: FaceRef| format!("{}.{}", self.design.components[f.component].name, self.name(f));
        let times = if count > 1 { format!(" ({count} alike)") } else { String::new() };
        format!("{} on {}: {}{times}", full(contact.a), full(contact.b), figures(contact))
    }
}

/// A name cut where runs of digits begin and end.
fn pieces(name: &str) -> impl Iterator<Item = &str> {
    let bytes = name.as_bytes();
    let cuts = (1..name.len()).filter(|&i| bytes[i].is_ascii_digit() != bytes[i - 1].is_ascii_digit());
    let mut ends: Vec<usize> = cuts.filter(|i| name.is_char_boundary(*i)).collect();
    ends.push(name.len());
    let starts: Vec<usize> = std::iter::once(0).chain(ends.iter().copied()).collect();
    starts.into_iter().zip(ends).map(|(a, b)| &name[a..b])
}

/// The name with `[]` for every number in brackets: equal for all copies of a pattern.
fn without_numbers(name: &str) -> String {
    let mut inside = false;
    name.chars()
        .filter(|c| {
            inside = (inside || *c == '[') && *c != ']';
            !inside || *c == '['
        })
        .collect()
}

fn wires(namer: &Namer, liaison: &Liaison, ends: &BTreeMap<FaceRef, End>) -> Vec<Wire> {
    let mut groups: BTreeMap<([End; 2], Class), Vec<&Contact>> = BTreeMap::new();
    for contact in &liaison.contacts {
        let pair = [ends[&contact.a], ends[&contact.b]];
        groups.entry((pair, Class::of(contact))).or_default().push(contact);
    }
    let wire = |((ends, class), contacts): (([End; 2], Class), Vec<&Contact>)| Wire {
        ends,
        class,
        count: contacts.len(),
        note: namer.note(contacts[0], contacts.len()),
    };
    groups.into_iter().map(wire).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_are_alike_but_for_their_numbers() {
        assert_eq!(without_numbers("pin_hole[12].side"), "pin_hole[].side");
        assert_eq!(without_numbers("step2.side"), "step2.side");
    }

    #[test]
    fn pieces_are_the_whole_name() {
        assert_eq!(pieces("gap[12].side").collect::<Vec<_>>(), ["gap[", "12", "].side"]);
        assert_eq!(pieces("größe2").collect::<String>(), "größe2");
    }
}
