//! In which direction and order the assembly comes apart (section III and Fig. 7 of the paper).
//!
//! In: contacts and the nominal solids. Out: a removal direction and order, or the group of components that lock each
//! other. Contacts propose the directions; whether one component stands in another's way is tested over the whole path, by
//! columns of material along the direction. After Wilson and Latombe, "Geometric reasoning about mechanical assembly" (1994).
//! The root is the base: it stays. Rotations and paths with bends are not considered.

use super::contact::{Contact, ContactKind};
use super::liaison::Liaison;
use super::meeting::{Entering, Meetings};
use super::place::place;
use crate::design::model::Design;
use crate::solid::Solid;
use nalgebra::{Isometry3, Unit, Vector3};
use serde::Serialize;
use std::sync::Arc;

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
    /// Components that cannot be removed by straight moves, because they lock each other.
    pub locked: Vec<usize>,
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

/// Directions tried, those with the largest contacts first: a bound on the time spent.
const MOST_AXES: usize = 6;
/// Directions closer than this (sine of the angle) are one.
const SAME_AXIS: f64 = 1e-3;

/// Finds the removal order. `solids` holds one solid per component at nominal.
pub fn insertion(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> Insertion {
    take_apart(design, solids, liaison).0
}

/// The removal order, and which bodies enter each other along the first direction tried.
pub(crate) fn take_apart(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> (Insertion, Vec<Entering>) {
    let poses = place(design, &design.nominal());
    let mut tables: Vec<Table> = Vec::new();
    let mut entering = None;
    for pair in candidate_directions(&liaison.contacts).chunks(2) {
        let meetings = Meetings::new(pair[0], solids, &poses);
        let up = Table::new(pair[0], &meetings, liaison);
        tables.extend([up.reversed(), up]);
        entering.get_or_insert(meetings.entering);
        for table in tables[tables.len() - 2..].iter().rev() {
            let peeled = peel(std::slice::from_ref(table));
            if peeled.locked.is_empty() {
                return (peeled.finish(&tables, Some(table)), entering.unwrap_or_default());
            }
        }
    }
    (peel(&tables).finish(&tables, None), entering.unwrap_or_default())
}

/// The axes and normals of the contacts, both ways, those with most contact area first; +z before -z and so on.
pub(crate) fn candidate_directions(contacts: &[Contact]) -> Vec<Unit<Vector3<f64>>> {
    let mut axes: Vec<(Unit<Vector3<f64>>, f64)> = Vec::new();
    for contact in contacts.iter().filter(|c| c.kind != ContactKind::Sphere) {
        let axis = upward(contact.direction);
        match axes.iter_mut().find(|(a, _)| a.cross(&axis).norm() < SAME_AXIS) {
            Some((_, area)) => *area += contact.area,
            None => axes.push((axis, contact.area)),
        }
    }
    if axes.is_empty() {
        axes.push((Vector3::z_axis(), 0.0));
    }
    axes.sort_by(|a, b| b.1.total_cmp(&a.1));
    axes.into_iter().take(MOST_AXES).flat_map(|(a, _)| [a, -a]).collect()
}

/// Of an axis and its opposite the one that points up (then along y, then along x).
fn upward(axis: Unit<Vector3<f64>>) -> Unit<Vector3<f64>> {
    let leading = [axis.z, axis.y, axis.x].into_iter().find(|c| c.abs() > SAME_AXIS).unwrap_or(1.0);
    if leading < 0.0 { -axis } else { axis }
}

/// Who blocks whom along one direction: `blocks[a]` lists the components in the way of `a`.
struct Table {
    direction: Unit<Vector3<f64>>,
    blocks: Vec<Vec<usize>>,
}

impl Table {
    fn new(direction: Unit<Vector3<f64>>, meetings: &Meetings, liaison: &Liaison) -> Self {
        let n = liaison.components;
        let blocked = |a: usize, b: usize| a != b && (meetings.way[a][b] || holds(liaison, direction, a, b));
        let blocks = (0..n).map(|a| (0..n).filter(|b| blocked(a, *b)).collect()).collect();
        Table { direction, blocks }
    }

    /// The same for the opposite direction: what is in my way has me in its way when it moves back.
    fn reversed(&self) -> Table {
        let n = self.blocks.len();
        let blocks = (0..n).map(|a| (0..n).filter(|b| self.blocks[*b].contains(&a)).collect()).collect();
        Table { direction: -self.direction, blocks }
    }
}

/// Whether a plane contact with `b` stops `a` from moving in this direction.
fn holds(liaison: &Liaison, direction: Unit<Vector3<f64>>, a: usize, b: usize) -> bool {
    liaison.between(a, b).filter(|c| c.kind == ContactKind::Plane).any(|c| {
        let out_of_a = if c.a.component == a { c.direction } else { -c.direction };
        out_of_a.dot(&direction) > SAME_AXIS
    })
}

/// The state of a disassembly.
struct Peeled {
    rounds: Vec<Vec<usize>>,
    /// Index of the table each component was removed along.
    along: Vec<Option<usize>>,
    locked: Vec<usize>,
}

/// Removes what is free along any of the tables, round after round; component 0 stays.
fn peel(tables: &[Table]) -> Peeled {
    let n = tables[0].blocks.len();
    let mut present = vec![true; n];
    let mut peeled = Peeled { rounds: Vec::new(), along: vec![None; n], locked: Vec::new() };
    loop {
        let exit = |c: usize| tables.iter().position(|t| t.blocks[c].iter().all(|b| !present[*b]));
        let round: Vec<(usize, usize)> =
            (1..n).filter(|c| present[*c]).filter_map(|c| exit(c).map(|t| (c, t))).collect();
        if round.is_empty() {
            break;
        }
        for (component, table) in &round {
            present[*component] = false;
            peeled.along[*component] = Some(*table);
        }
        peeled.rounds.push(round.into_iter().map(|(c, _)| c).collect());
    }
    let rest: Vec<usize> = (1..n).filter(|c| present[*c]).collect();
    peeled.locked = locked_group(&tables[0], &rest, &present);
    peeled
}

/// Of the components that remain, those that hold each other (a cycle of the blocking graph) or are held by the root.
fn locked_group(table: &Table, rest: &[usize], present: &[bool]) -> Vec<usize> {
    let reaches = |from: usize, to: usize| closure(table, from, present).contains(&to);
    let cyclic: Vec<usize> =
        rest.iter().copied().filter(|c| reaches(*c, *c) || table.blocks[*c].contains(&0)).collect();
    if cyclic.is_empty() { rest.to_vec() } else { cyclic }
}

/// All components that must go before this one, among those present.
fn closure(table: &Table, component: usize, present: &[bool]) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    let mut open = vec![component];
    while let Some(c) = open.pop() {
        for b in &table.blocks[c] {
            if present[*b] && !found.contains(b) {
                found.push(*b);
                open.push(*b);
            }
        }
    }
    found.sort_unstable();
    found
}

impl Peeled {
    fn finish(self, tables: &[Table], common: Option<&Table>) -> Insertion {
        let n = self.along.len();
        let everything = vec![true; n];
        let table = |c: usize| common.unwrap_or(&tables[self.along[c].unwrap_or(0)]);
        let coordinates = |d: Unit<Vector3<f64>>| [d.x + 0.0, d.y + 0.0, d.z + 0.0];
        let above = (0..n).map(|c| {
            let mut above = closure(table(c), c, &everything);
            above.retain(|b| *b != c && *b != 0);
            above
        });
        Insertion {
            common: common.map(|t| coordinates(t.direction)),
            above: above.collect(),
            directions: (0..n).map(|c| coordinates(table(c).direction)).collect(),
            rounds: self.rounds,
            locked: self.locked,
        }
    }
}

/// How far apart the exploded view sets what is removed round after round (mm).
const EXPLODED_GAP: f64 = 5.0;

/// The exploded view (Fig. 7): how far each component moves (mm), so that every round clears those that stay longer.
/// `poses` as the solids: one per component.
pub fn exploded(insertion: &Insertion, solids: &[Arc<Solid>], poses: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
    let mut shifts = vec![Vector3::zeros(); solids.len()];
    let reach = |c: usize, along: &Vector3<f64>, shift: &Vector3<f64>| {
        let heights = solids[c].mesh.positions.iter().map(|p| ((poses[c] * p).coords + shift).dot(along));
        heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], h| [low.min(h), high.max(h)])
    };
    let mut placed: Vec<usize> =
        (0..solids.len()).filter(|c| insertion.rounds.iter().all(|r| !r.contains(c))).collect();
    for round in insertion.rounds.iter().rev() {
        for c in round {
            let along = insertion.direction(*c).into_inner();
            let tops = placed.iter().map(|p| reach(*p, &along, &shifts[*p])[1]);
            let lift = tops.fold(f64::NEG_INFINITY, f64::max) + EXPLODED_GAP - reach(*c, &along, &shifts[*c])[0];
            shifts[*c] = along * lift.max(0.0);
        }
        placed.extend(round);
    }
    shifts
}

/// The removal order in the user's names, for goldens and `--emit insertion`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InsertionSummary {
    /// The common removal direction.
    pub common: Option<[f64; 3]>,
    /// Removed together, round after round.
    pub rounds: Vec<Vec<String>>,
    pub base: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub locked: Vec<String>,
}

/// The removal order with names in place of indices.
pub fn summary(design: &Design, insertion: &Insertion) -> InsertionSummary {
    let names = |list: &[usize]| list.iter().map(|c| design.components[*c].name.clone()).collect();
    InsertionSummary {
        common: insertion.common.map(|d| d.map(|c| (c * 1e6).round() / 1e6 + 0.0)),
        rounds: insertion.rounds.iter().map(|r| names(r)).collect(),
        base: design.components[0].name.clone(),
        locked: names(&insertion.locked),
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
    fn the_exploded_view_sets_round_above_round() {
        let a = sample::pattern_wheel();
        let found = analyse(&a);
        let poses = place(&a.design, &a.design.nominal());
        let shifts = exploded(&found, &a.solids, &poses);
        assert_eq!(shifts[0], Vector3::zeros());
        let ends = |c: usize| {
            let z = a.solids[c].mesh.positions.iter().map(|p| (poses[c] * p).z + shifts[c].z);
            z.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
        };
        for pair in found.rounds.windows(2) {
            assert!(pair[0].iter().all(|c| pair[1].iter().all(|below| ends(*c)[0] > ends(*below)[1] + 4.9)));
        }
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
        assert_eq!((found.common, found.locked), (None, vec![1, 2]));
    }
}
