//! A column for every box: what is removed last stands on the left.
//!
//! In: the graph and the removal order. Out: a column per box, such that boxes with a wire between them never share one.

use super::graph::Graph;
use crate::assembly::insertion::Insertion;
use std::collections::BTreeSet;

/// The column of every box, counted from 0 on the left: one more than the highest column among those it touches that are
/// removed after it (of those removed together, the first in the design counts as removed last).
pub(super) fn layers(graph: &Graph, insertion: &Insertion) -> Vec<usize> {
    let n = graph.boxes.len();
    let mut near = vec![BTreeSet::new(); n];
    for wire in &graph.wires {
        let [a, b] = wire.ends.map(|e| e.block);
        near[a].insert(b);
        near[b].insert(a);
    }
    let stays = stays(n, insertion);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|c| stays[*c]);
    let mut place = vec![0; n];
    order.iter().enumerate().for_each(|(at, c)| place[*c] = at);
    let mut layer = vec![0; n];
    for c in &order {
        let before = near[*c].iter().filter(|b| place[**b] < place[*c]);
        layer[*c] = before.map(|b| layer[*b] + 1).max().unwrap_or(0);
    }
    draw_near(&order, &near, &mut layer);
    layer
}

/// How long each box stays, by the rounds of the whole and, in a group that leaves as one, by the group's own.
fn stays(boxes: usize, insertion: &Insertion) -> Vec<(usize, usize)> {
    let mut stays = vec![(0, 0); boxes];
    let from_last = |rounds: &[Vec<usize>]| -> Vec<(usize, usize)> {
        let numbered = rounds.iter().rev().zip(1..).flat_map(|(r, i)| r.iter().map(move |c| (*c, i)));
        numbered.collect()
    };
    from_last(&insertion.rounds).into_iter().for_each(|(c, i)| stays[c] = (i, 0));
    for group in &insertion.groups {
        let own = insertion.rounds.len() - group.after.min(insertion.rounds.len());
        group.members.iter().for_each(|c| stays[*c] = (own, 1));
        from_last(&group.rounds).into_iter().for_each(|(c, i)| stays[c] = (own, 1 + i));
    }
    stays
}

/// What begins a chain of its own moves as far to the right as what stands on it allows.
fn draw_near(order: &[usize], near: &[BTreeSet<usize>], layer: &mut [usize]) {
    for c in order.iter().skip(1).filter(|c| !near[**c].is_empty()) {
        let next = near[*c].iter().map(|b| layer[*b]).min().unwrap_or(0);
        if next > layer[*c] {
            layer[*c] = next - 1;
        }
    }
}
