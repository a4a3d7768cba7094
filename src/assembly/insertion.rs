//! In which direction and order the assembly comes apart (section III and Fig. 7 of the paper).
//!
//! In: contacts and the nominal solids. Out: a removal direction and order, groups that only leave as a whole, or the group
//! of components that lock each other and who holds whom. Contacts propose the directions; whether one component
//! stands in another's way is tested over the whole path, by columns of material and by the contacts' normals. After
//! Wilson and Latombe, "Geometric reasoning about mechanical assembly" (1994). The root is the base: it stays. Rotations and
//! paths with bends are not considered.

use super::blocking::{Leaving, Peeled, Table, closure, peel, strong_components};
use super::contact::{Contact, ContactKind};
use super::liaison::Liaison;
use super::meeting::{Entering, Meetings};
use super::place::place;
use crate::design::model::Design;
use crate::solid::Solid;
use nalgebra::{Unit, Vector3};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

pub use super::explode::exploded;

/// How the assembly comes apart; assembling is the reverse.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Insertion {
    /// The common removal direction (unit vector in the assembly's frame), if one empties the assembly.
    pub common: Option<[f64; 3]>,
    /// Components that can be removed together, round after round; the root is not among them.
    pub rounds: Vec<Vec<usize>>,
    /// Each component's removal direction (the root and locked ones: the common one, else +z).
    pub directions: Vec<[f64; 3]>,
    /// Components that hold this one in its removal direction, directly or through others.
    pub above: Vec<Vec<usize>>,
    /// Components that leave as a whole, because none of them can leave alone.
    pub groups: Vec<Group>,
    /// Components that cannot be parted from others by straight moves, because they lock each other.
    pub locked: Vec<usize>,
    /// Of locked components, who holds them along each direction tried.
    pub held: Vec<Held>,
    /// Along the common direction, or the first tried: who is in whose way at once.
    pub blocks: Vec<Vec<usize>>,
}

/// A sub-assembly.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    pub members: Vec<usize>,
    pub direction: [f64; 3],
    /// How many rounds go before it.
    pub after: usize,
    /// How its members come apart once it is out; the first member is its base.
    pub rounds: Vec<Vec<usize>>,
}

/// Who holds a locked component along a direction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Held {
    pub component: usize,
    pub direction: [f64; 3],
    pub by: Vec<usize>,
}

impl Insertion {
    /// A component's removal direction.
    pub fn direction(&self, component: usize) -> Unit<Vector3<f64>> {
        Unit::new_normalize(Vector3::from(self.directions[component]))
    }

    /// Whether nothing else has to go before this component.
    pub fn is_free(&self, component: usize) -> bool {
        self.rounds.first().is_some_and(|r| r.contains(&component))
    }
}

/// Axes taken from contacts, those with the largest first, and axes tried in all: bounds on the time spent.
const MOST_AXES: [usize; 2] = [6, 12];
/// Directions closer than this (sine of the angle) are one.
const SAME_AXIS: f64 = 1e-3;

/// Finds the removal order. `solids` holds one solid per component at nominal.
pub fn insertion(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> Insertion {
    take_apart(design, solids, liaison).0
}

/// The removal order, and which bodies enter each other along the first direction tried.
pub(crate) fn take_apart(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> (Insertion, Vec<Entering>) {
    let poses = place(design, &design.nominal());
    let everyone: Vec<usize> = (0..liaison.components).collect();
    let mut tables: Vec<Table> = Vec::new();
    let mut entering = None;
    for axis in candidate_axes(&liaison.contacts) {
        let meetings = Meetings::new(axis, solids, &poses);
        let up = Table::new(axis, &meetings, &liaison.contacts);
        entering.get_or_insert(meetings.entering);
        for table in [up.reversed(), up] {
            tables.push(table);
        }
        for k in [tables.len() - 1, tables.len() - 2] {
            let peeled = peel(&tables[k..=k], &everyone, false);
            if peeled.rest.is_empty() {
                return (finish(peeled, &tables[k..=k], true), entering.unwrap_or_default());
            }
        }
    }
    (finish(peel(&tables, &everyone, true), &tables, false), entering.unwrap_or_default())
}

/// The axes and normals of the contacts, those with most contact area first, then what is square to two of them.
pub(crate) fn candidate_axes(contacts: &[Contact]) -> Vec<Unit<Vector3<f64>>> {
    let mut axes: Vec<(Unit<Vector3<f64>>, f64)> = Vec::new();
    for contact in contacts.iter().filter(|c| c.kind != ContactKind::Sphere) {
        let axis = upward(contact.direction);
        match axes.iter().position(|(a, _)| same(a, &axis)) {
            Some(known) => axes[known].1 += contact.area,
            None if axes.len() < MOST_KNOWN => axes.push((axis, contact.area)),
            None => {}
        }
    }
    if axes.is_empty() {
        axes.push((Vector3::z_axis(), 0.0));
    }
    axes.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut found: Vec<Unit<Vector3<f64>>> = axes.into_iter().take(MOST_AXES[0]).map(|(a, _)| a).collect();
    let direct = found.len();
    for (i, j) in (0..direct).flat_map(|i| (i + 1..direct).map(move |j| (i, j))) {
        let square = upward(Unit::new_normalize(found[i].cross(&found[j])));
        if found.len() < MOST_AXES[1] && found.iter().all(|a| !same(a, &square)) {
            found.push(square);
        }
    }
    found
}

/// Axes told apart at all: in an assembly of a thousand turned parts each could have its own.
const MOST_KNOWN: usize = 64;

fn same(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    a.cross(b).norm() < SAME_AXIS
}

/// Of an axis and its opposite the one that points up (then along y, then along x).
fn upward(axis: Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let leading = [axis.z, axis.y, axis.x].into_iter().find(|c| c.abs() > SAME_AXIS).unwrap_or(1.0);
    if leading < 0.0 { -axis } else { axis }
}

/// The outcome in the assembly's terms; `tables` are those peeled along.
fn finish(peeled: Peeled, tables: &[Table], common: bool) -> Insertion {
    let n = peeled.along.len();
    let table = |c: usize| &tables[peeled.along[c].unwrap_or(FIRST.min(tables.len() - 1))];
    let above = (0..n).map(|c| closure(&table(c).blocks, c).into_iter().filter(|b| *b != 0).collect());
    let groups: Vec<Group> = peeled.groups.iter().map(|g| group(g, tables)).collect();
    let inside = |g: &Group| {
        let parted: Vec<usize> = g.rounds.iter().flatten().copied().collect();
        // The base of a group whose other members all leave it is free too.
        let free = parted.len() + 1 == g.members.len();
        g.members.iter().copied().filter(move |m| !free && !parted.contains(m)).collect::<Vec<_>>()
    };
    let mut locked: Vec<usize> = groups.iter().flat_map(inside).chain(stuck(&peeled.rest, tables)).collect();
    locked.sort_unstable();
    Insertion {
        common: common.then(|| coordinates(tables[0].direction)),
        above: above.collect(),
        directions: (0..n).map(|c| coordinates(table(c).direction)).collect(),
        held: held(&locked, tables),
        blocks: tables[FIRST.min(tables.len() - 1)].blocks.clone(),
        rounds: peeled.rounds,
        groups,
        locked,
    }
}

/// Index of the first direction tried: tables come in pairs, the opposite one before it.
const FIRST: usize = 1;

fn coordinates(d: Unit<Vector3<f64>>) -> [f64; 3] {
    [d.x + 0.0, d.y + 0.0, d.z + 0.0]
}

fn group(leaving: &Leaving, tables: &[Table]) -> Group {
    let inner = peel(tables, &leaving.members, false);
    Group {
        members: leaving.members.clone(),
        direction: coordinates(tables[leaving.along].direction),
        after: leaving.after,
        rounds: inner.rounds,
    }
}

/// Of those that remain, the ones that hold each other or are held by the base; the others only wait for them.
fn stuck(rest: &[usize], tables: &[Table]) -> Vec<usize> {
    let blocks = &tables[FIRST.min(tables.len() - 1)].blocks;
    let mut present = vec![false; blocks.len()];
    rest.iter().for_each(|c| present[*c] = true);
    let rings = strong_components(blocks, &present).into_iter().map(|(members, _)| members).filter(|m| m.len() > 1);
    let ringed: BTreeSet<usize> = rings.flatten().collect();
    let cyclic: Vec<usize> = rest.iter().copied().filter(|c| ringed.contains(c) || blocks[*c].contains(&0)).collect();
    if cyclic.is_empty() { rest.to_vec() } else { cyclic }
}

/// Who holds whom: for every locked component and every direction tried.
fn held(locked: &[usize], tables: &[Table]) -> Vec<Held> {
    let along = |component: usize| {
        let holds =
            move |t: &Table| Held { component, direction: coordinates(t.direction), by: t.blocks[component].clone() };
        tables.iter().map(holds)
    };
    locked.iter().flat_map(|c| along(*c)).collect()
}

/// The removal order in the user's names, for goldens and `--emit insertion`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InsertionSummary {
    /// The common removal direction.
    pub common: Option<[f64; 3]>,
    /// Removed together, round after round.
    pub rounds: Vec<Vec<String>>,
    pub base: String,
    /// Sub-assemblies: what leaves as a whole, along which direction, after how many rounds, and how it then comes apart.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<GroupSummary>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub locked: Vec<String>,
    /// Of locked components: along which direction who holds them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<(String, [f64; 3], Vec<String>)>,
    /// Who is in whose way along the common direction.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub blocked_by: Vec<(String, Vec<String>)>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GroupSummary {
    pub members: Vec<String>,
    pub direction: [f64; 3],
    pub after: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rounds: Vec<Vec<String>>,
}

/// The removal order with names in place of indices.
pub fn summary(design: &Design, insertion: &Insertion) -> InsertionSummary {
    let name = |c: usize| design.components[c].name.clone();
    let names = |list: &[usize]| -> Vec<String> { list.iter().map(|c| name(*c)).collect() };
    let rounded = |d: [f64; 3]| d.map(|c| (c * 1e6).round() / 1e6 + 0.0);
    let group = |g: &Group| GroupSummary {
        members: names(&g.members),
        direction: rounded(g.direction),
        after: g.after,
        rounds: g.rounds.iter().map(|r| names(r)).collect(),
    };
    let blocked = insertion.blocks.iter().enumerate().filter(|(_, by)| !by.is_empty());
    InsertionSummary {
        common: insertion.common.map(rounded),
        rounds: insertion.rounds.iter().map(|r| names(r)).collect(),
        base: name(0),
        groups: insertion.groups.iter().map(group).collect(),
        locked: names(&insertion.locked),
        held: insertion.held.iter().map(|h| (name(h.component), rounded(h.direction), names(&h.by))).collect(),
        blocked_by: blocked.map(|(c, by)| (name(c), names(by))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{contact::contacts, sample};

    fn analyse(a: &sample::Assembly) -> Insertion {
        let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
        insertion(&a.design, &a.solids, &liaison)
    }

    /// Fig. 7: one common axis of insertion; the gear is the base.
    #[test]
    fn the_pattern_wheel_comes_apart_upwards() {
        let a = sample::pattern_wheel();
        let found = analyse(&a);
        assert_eq!(found.common, Some([0.0, 0.0, 1.0]));
        assert_eq!(found.rounds, [vec![1, 4, 8, 9], vec![3], vec![5, 6, 7], vec![2]]);
        assert!(found.locked.is_empty());
        assert_eq!(found.above[5], [3, 4]);
        assert_eq!(found.above[2], [3, 4, 5, 6, 7, 8, 9]);
        assert!(found.above[4].is_empty() && found.is_free(4));
    }

    #[test]
    fn a_pin_with_two_heads_is_locked_to_its_plate() {
        let mut shop = sample::Shop::default();
        let base = shop.plate("base", [1.0, 0.0], [30.0, 0.0], &[]);
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[sample::Cut::hole("hole", 0.0, 0.0, 4.0, 0.0)]);
        let heads =
            [("foot", 6.0, 6.0, [0.0; 2], 2.0), ("shank", 4.0, 4.0, [0.0; 2], 2.0), ("head", 6.0, 6.0, [0.0; 2], 2.0)];
        let rivet = shop.pin("rivet", &heads);
        shop.place("base", base, [0.0; 3], 0.0, 0.0);
        shop.place("plate", plate, [0.0, 0.0, 3.0], 0.0, 0.0);
        shop.place("rivet", rivet, [0.0, 0.0, 1.0], 0.0, 0.0);
        let found = analyse(&shop.finish());
        assert_eq!((found.common, &found.locked), (None, &vec![1, 2]));
        assert_eq!(found.groups.len(), 1, "both leave together");
        assert_eq!((&found.groups[0].members, found.groups[0].rounds.len()), (&vec![1, 2], 0));
        let along = |d: [f64; 3]| found.held.iter().filter(move |h| h.direction == d).map(|h| h.by.clone());
        assert_eq!(along([0.0, 0.0, 1.0]).collect::<Vec<_>>(), [[2], [1]]);
    }
}
