//! Blocking graphs, and how they come apart (Wilson and Latombe 1994).
//!
//! In: who is in whose way along some directions. Out: rounds of components that leave, groups that leave as a whole though
//! none of their members can, and what stays locked. Work and memory grow with the number of edges. Never looks at geometry.

use super::contact::Contact;
use super::meeting::Meetings;
use nalgebra::{Unit, Vector3};
use std::collections::BTreeSet;

/// Who blocks whom along one direction: `blocks[a]` lists the components in the way of `a`, ascending.
#[derive(Debug)]
pub(crate) struct Table {
    pub direction: Unit<Vector3<f64>>,
    pub blocks: Vec<Vec<usize>>,
}

impl Table {
    /// From what the bodies and what the contacts show: contacts see what is too thin for bodies.
    pub fn new(direction: Unit<Vector3<f64>>, meetings: &Meetings, contacts: &[Contact]) -> Self {
        let mut blocks = meetings.way.clone();
        for contact in contacts {
            let (a, b) = (contact.a.component, contact.b.component);
            if contact.stops(a, direction) {
                blocks[a].push(b);
            }
            if contact.stops(b, direction) {
                blocks[b].push(a);
            }
        }
        for list in &mut blocks {
            list.sort_unstable();
            list.dedup();
        }
        Table { direction, blocks }
    }

    /// The same for the opposite direction: what is in my way has me in its way when it moves back.
    pub fn reversed(&self) -> Table {
        Table { direction: -self.direction, blocks: turned(&self.blocks) }
    }
}

/// Every edge the other way round.
fn turned(edges: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut back = vec![Vec::new(); edges.len()];
    for (from, to) in edges.iter().enumerate() {
        to.iter().for_each(|t| back[*t].push(from));
    }
    back
}

/// A group that leaves as a whole.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Leaving {
    pub members: Vec<usize>,
    /// Index of the table it leaves along.
    pub along: usize,
    /// How many rounds of single components went before.
    pub after: usize,
}

/// The state of a disassembly.
#[derive(Debug)]
pub(crate) struct Peeled {
    pub rounds: Vec<Vec<usize>>,
    pub groups: Vec<Leaving>,
    /// Index of the table each component was removed along, by itself or with its group.
    pub along: Vec<Option<usize>>,
    /// What is left besides the base.
    pub rest: Vec<usize>,
}

/// Removes what is free along any of the tables, round after round, and, if asked for, groups where nothing is free;
/// `members` take part, of which the first is the base and stays.
pub(crate) fn peel(tables: &[Table], members: &[usize], groups: bool) -> Peeled {
    let mut state = State::new(tables, members);
    let mut peeled = Peeled { rounds: Vec::new(), groups: Vec::new(), along: vec![None; state.size], rest: Vec::new() };
    loop {
        while !state.ready.is_empty() {
            let round = state.round();
            round.iter().for_each(|(c, table)| peeled.along[*c] = Some(*table));
            peeled.rounds.push(round.into_iter().map(|(c, _)| c).collect());
        }
        let Some((members, along)) = state.group().filter(|_| groups) else { break };
        members.iter().for_each(|c| {
            peeled.along[*c] = Some(along);
            state.remove(*c);
        });
        state.ready.retain(|c| state.present[*c]);
        peeled.groups.push(Leaving { members, along, after: peeled.rounds.len() });
    }
    peeled.rest = state.left();
    peeled
}

struct State<'a> {
    tables: &'a [Table],
    /// Per table whom each component blocks.
    holds: Vec<Vec<Vec<usize>>>,
    /// Per table how many present components block each one.
    count: Vec<Vec<usize>>,
    present: Vec<bool>,
    ready: BTreeSet<usize>,
    base: usize,
    size: usize,
}

impl<'a> State<'a> {
    fn new(tables: &'a [Table], members: &[usize]) -> Self {
        let size = tables.iter().map(|t| t.blocks.len()).max().unwrap_or(0);
        let mut present = vec![false; size];
        members.iter().for_each(|c| present[*c] = true);
        let blockers = |t: &Table, c: usize| t.blocks[c].iter().filter(|b| present[**b]).count();
        let count: Vec<Vec<usize>> = tables.iter().map(|t| (0..size).map(|c| blockers(t, c)).collect()).collect();
        let holds = tables.iter().map(|t| turned(&t.blocks)).collect();
        let base = members.first().copied().unwrap_or(0);
        let free = |c: &usize| *c != base && count.iter().any(|n| n[*c] == 0);
        let ready = members.iter().copied().filter(free).collect();
        State { tables, holds, count, present, ready, base, size }
    }

    /// Takes out all that is free now; each with the first table along which it is.
    fn round(&mut self) -> Vec<(usize, usize)> {
        let ready = std::mem::take(&mut self.ready);
        let free = |c: usize| self.count.iter().position(|n| n[c] == 0).map(|table| (c, table));
        let round: Vec<(usize, usize)> = ready.into_iter().filter_map(free).collect();
        round.iter().for_each(|(c, _)| self.remove(*c));
        self.ready.retain(|c| self.present[*c]);
        round
    }

    fn remove(&mut self, component: usize) {
        self.present[component] = false;
        for (holds, count) in self.holds.iter().zip(&mut self.count) {
            for held in holds[component].iter().filter(|h| self.present[**h]) {
                count[*held] -= 1;
                if count[*held] == 0 && *held != self.base {
                    self.ready.insert(*held);
                }
            }
        }
    }

    /// The smallest group, without the base, that nothing outside it blocks along some table.
    fn group(&self) -> Option<(Vec<usize>, usize)> {
        let of_table = |(k, t): (usize, &Table)| {
            let sinks = strong_components(&t.blocks, &self.present).into_iter().filter(|(_, sink)| *sink);
            let groups = sinks.map(|(members, _)| members).filter(|m| !m.contains(&self.base));
            groups.map(|m| (m, k)).collect::<Vec<_>>()
        };
        let all = self.tables.iter().enumerate().flat_map(of_table);
        all.min_by(|a, b| (a.0.len(), &a.0, a.1).cmp(&(b.0.len(), &b.0, b.1)))
    }

    fn left(&self) -> Vec<usize> {
        (0..self.size).filter(|c| self.present[*c] && *c != self.base).collect()
    }
}

/// The strongly connected components among those present, each ascending, and whether nothing outside blocks it (Tarjan
/// 1972, with a stack of its own instead of recursion: chains may be long).
pub(crate) fn strong_components(blocks: &[Vec<usize>], present: &[bool]) -> Vec<(Vec<usize>, bool)> {
    const NEW: usize = usize::MAX;
    let n = blocks.len();
    let (mut number, mut low, mut group) = (vec![NEW; n], vec![0; n], vec![NEW; n]);
    let (mut stack, mut found, mut next) = (Vec::new(), Vec::<(Vec<usize>, bool)>::new(), 0);
    for root in (0..n).filter(|c| present[*c]) {
        if number[root] != NEW {
            continue;
        }
        let mut calls = vec![(root, 0)];
        while let Some((c, at)) = calls.pop() {
            if at == 0 {
                (number[c], low[c]) = (next, next);
                next += 1;
                stack.push(c);
            }
            if let Some(b) = blocks[c].get(at) {
                calls.push((c, at + 1));
                if present[*b] && number[*b] == NEW {
                    calls.push((*b, 0));
                } else if present[*b] && group[*b] == NEW {
                    low[c] = low[c].min(number[*b]);
                }
                continue;
            }
            if let Some((parent, _)) = calls.last() {
                low[*parent] = low[*parent].min(low[c]);
            }
            if low[c] == number[c] {
                let from = stack.iter().rposition(|s| *s == c).unwrap_or(0);
                let mut members = stack.split_off(from);
                members.iter().for_each(|m| group[*m] = found.len());
                members.sort_unstable();
                let outside = |b: &usize| present[*b] && group[*b] != found.len();
                let sink = !members.iter().any(|m| blocks[*m].iter().any(outside));
                found.push((members, sink));
            }
        }
    }
    found
}

/// All components that must go before this one, itself excluded, ascending.
pub(crate) fn closure(blocks: &[Vec<usize>], component: usize) -> Vec<usize> {
    let mut found = BTreeSet::new();
    let mut open = vec![component];
    while let Some(c) = open.pop() {
        open.extend(blocks[c].iter().copied().filter(|b| found.insert(*b)));
    }
    found.remove(&component);
    found.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(blocks: &[&[usize]]) -> Table {
        Table { direction: Vector3::z_axis(), blocks: blocks.iter().map(|b| b.to_vec()).collect() }
    }

    fn all(t: &Table) -> Vec<usize> {
        (0..t.blocks.len()).collect()
    }

    #[test]
    fn a_stack_leaves_from_the_top() {
        let t = table(&[&[1, 2, 3], &[2, 3], &[3], &[]]);
        let peeled = peel(std::slice::from_ref(&t), &all(&t), false);
        assert_eq!(peeled.rounds, [[3], [2], [1]]);
        assert!(peeled.rest.is_empty());
        assert_eq!(closure(&t.blocks, 1), [2, 3]);
    }

    #[test]
    fn a_locked_pair_leaves_as_a_group_and_frees_what_is_under_it() {
        let t = table(&[&[], &[2], &[1], &[1]]);
        let peeled = peel(std::slice::from_ref(&t), &all(&t), true);
        assert_eq!(peeled.groups, [Leaving { members: vec![1, 2], along: 0, after: 0 }]);
        assert_eq!(peeled.rounds, [[3]]);
        assert!(peeled.rest.is_empty());
    }

    #[test]
    fn what_the_base_holds_stays() {
        let t = table(&[&[1], &[0]]);
        let peeled = peel(std::slice::from_ref(&t), &all(&t), true);
        assert_eq!((peeled.rest, peeled.groups.len()), (vec![1], 0));
    }

    #[test]
    fn either_direction_frees() {
        let up = table(&[&[], &[0], &[]]);
        let peeled = peel(&[table(&[&[], &[2], &[1]]), up], &[0, 1, 2], false);
        assert_eq!(peeled.rounds, [[2], [1]]);
        assert_eq!(peeled.along, [None, Some(0), Some(1)]);
    }

    /// Against the definition: two are in one component when each reaches the other.
    #[test]
    fn components_are_those_that_reach_each_other() {
        let mut stream = crate::rng::Stream::new(3, "graph", 0);
        for _ in 0..40 {
            let n = 9;
            let blocks: Vec<Vec<usize>> =
                (0..n).map(|c| (0..n).filter(|b| *b != c && stream.uniform() < 0.16).collect()).collect();
            let reach: Vec<Vec<usize>> = (0..n).map(|c| closure(&blocks, c)).collect();
            for (members, sink) in strong_components(&blocks, &vec![true; n]) {
                let c = members[0];
                let same: Vec<usize> =
                    (0..n).filter(|b| *b == c || (reach[c].contains(b) && reach[*b].contains(&c))).collect();
                assert_eq!(members, same);
                assert_eq!(sink, reach[c].iter().all(|b| members.contains(b)));
            }
        }
    }

    #[test]
    fn long_chains_take_no_stack() {
        let n = 20_000;
        let blocks = (0..n).map(|c| if c + 1 < n { vec![c + 1] } else { vec![0] }).collect();
        let ring = Table { direction: Vector3::z_axis(), blocks };
        let members: Vec<usize> = (0..n).collect();
        assert_eq!(peel(&[ring], &members, true).rest.len(), n - 1);
    }
}
