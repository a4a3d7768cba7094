//! Columns and rows in an order with few crossings.
//!
//! In: the graph and its columns. Out: a [`Net`] whose columns, and the rows inside their boxes, are sorted. A wire that
//! passes a column runs in a lane there, shared by all wires between the same two boxes. Barycentre sweeps both ways
//! (Sugiyama), then exchanges of neighbours as long as they pay. Deterministic: ties keep the design's order.

use super::graph::Graph;
use std::collections::BTreeMap;

/// Sweeps to the right and back; crossings hardly ever fall after the first few.
const SWEEPS: usize = 12;
/// Exchanges are tried where a trial of all of them looks at no more wires than this.
const MOST_TRIALS: usize = 400_000;
/// Wires between boxes further apart than this pass behind the boxes without a lane: a bound on the lanes.
const LONGEST: usize = 12;

/// Per slot and item its place in its column, from 0 at the top.
type Ranks = Vec<Vec<usize>>;

/// What stands in the columns and how the wires pass.
pub(super) struct Net {
    /// Slots from the top, per column.
    pub layers: Vec<Vec<usize>>,
    pub slots: Vec<Slot>,
    /// Per wire, where it is in column after column, from left to right.
    pub hops: Vec<Vec<Hop>>,
    /// Per slot: (own item, where the wire goes on).
    pub near: Vec<Vec<(usize, Hop)>>,
}

pub(super) struct Slot {
    /// The box; `None` for a lane.
    pub block: Option<usize>,
    pub layer: usize,
    /// Numbers of the rows of the box, or of the wires of the lane, from the top.
    pub items: Vec<usize>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Hop {
    pub slot: usize,
    /// Number of a row or wire: a value in [`Slot::items`].
    pub item: usize,
}

impl Net {
    pub fn new(graph: &Graph, columns: &[usize]) -> Net {
        let block = |(b, layer): (usize, &usize)| Slot {
            block: Some(b),
            layer: *layer,
            items: (0..graph.boxes[b].rows.len()).collect(),
        };
        let slots: Vec<Slot> = columns.iter().enumerate().map(block).collect();
        let depth = columns.iter().max().map_or(0, |m| m + 1);
        let mut net = Net { layers: vec![Vec::new(); depth], slots, hops: Vec::new(), near: Vec::new() };
        let mut lanes = BTreeMap::new();
        net.hops = (0..graph.wires.len()).map(|w| net.route(graph, columns, w, &mut lanes)).collect();
        (0..net.slots.len()).for_each(|s| net.layers[net.slots[s].layer].push(s));
        net.near = vec![Vec::new(); net.slots.len()];
        for pair in net.hops.iter().flat_map(|hops| hops.windows(2)) {
            net.near[pair[0].slot].push((pair[0].item, pair[1]));
            net.near[pair[1].slot].push((pair[1].item, pair[0]));
        }
        net
    }

    /// The hops of a wire, and lanes for it where it passes columns.
    fn route(
        &mut self,
        graph: &Graph,
        columns: &[usize],
        wire: usize,
        lanes: &mut BTreeMap<(usize, usize, usize), usize>,
    ) -> Vec<Hop> {
        let mut ends = graph.wires[wire].ends;
        ends.sort_by_key(|e| columns[e.block]);
        let [from, to] = ends.map(|e| Hop { slot: e.block, item: e.row });
        let (first, last) = (columns[from.slot] + 1, columns[to.slot]);
        let mut hops = vec![from];
        if last - first.min(last) <= LONGEST {
            for layer in first..last {
                let slot = *lanes.entry((layer, from.slot, to.slot)).or_insert_with(|| {
                    self.slots.push(Slot { block: None, layer, items: Vec::new() });
                    self.slots.len() - 1
                });
                let item = self.slots[slot].items.len();
                self.slots[slot].items.push(item);
                hops.push(Hop { slot, item });
            }
        }
        hops.push(to);
        hops
    }

    /// The place of every item in its column, from 0 at the top: per slot, per item.
    fn ranks(&self) -> Ranks {
        let mut ranks: Ranks = self.slots.iter().map(|s| vec![0; s.items.len()]).collect();
        (0..self.layers.len()).for_each(|layer| self.rank(layer, &mut ranks));
        ranks
    }

    /// The same for one column.
    fn rank(&self, layer: usize, ranks: &mut Ranks) {
        let items = self.layers[layer].iter().flat_map(|s| self.slots[*s].items.iter().map(move |i| (*s, *i)));
        items.enumerate().for_each(|(rank, (slot, item))| ranks[slot][item] = rank);
    }

    /// How often wires cross between columns.
    pub fn crossings(&self) -> usize {
        let ranks = self.ranks();
        let mut gutters: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.layers.len()];
        for pair in self.hops.iter().flat_map(|h| h.windows(2)) {
            let [a, b] = [pair[0], pair[1]].map(|h| ranks[h.slot][h.item]);
            gutters[self.slots[pair[0].slot].layer].push((a, b));
        }
        gutters.into_iter().map(inversions).sum()
    }
}

/// Pairs of wires in a gutter that change sides: counted while sorting by the right end (merge sort).
fn inversions(mut wires: Vec<(usize, usize)>) -> usize {
    wires.sort_unstable();
    let mut ends: Vec<usize> = wires.iter().map(|w| w.1).collect();
    // Wires from one circle do not cross: among equal left ends the right ends are sorted already.
    let mut buffer = ends.clone();
    sorted(&mut ends, &mut buffer)
}

fn sorted(list: &mut [usize], buffer: &mut [usize]) -> usize {
    if list.len() < 2 {
        return 0;
    }
    let middle = list.len() / 2;
    let (low, high) = buffer.split_at_mut(middle);
    let mut count = sorted(&mut list[..middle], low) + sorted(&mut list[middle..], high);
    buffer.copy_from_slice(list);
    let (mut left, mut right) = (0, middle);
    for place in list.iter_mut() {
        let takes_left = right == buffer.len() || (left < middle && buffer[left] <= buffer[right]);
        if takes_left {
            *place = buffer[left];
            left += 1;
        } else {
            *place = buffer[right];
            right += 1;
            count += middle - left;
        }
    }
    count
}

/// Sorts columns and rows.
pub(super) fn sort(net: &mut Net) {
    let mut best = (net.crossings(), net.layers.clone(), items(net));
    let mut ranks = net.ranks();
    for _ in 0..SWEEPS {
        (1..net.layers.len()).for_each(|layer| settle(net, &mut ranks, layer, true));
        keep_better(net, &mut best);
        (0..net.layers.len().saturating_sub(1)).rev().for_each(|layer| settle(net, &mut ranks, layer, false));
        keep_better(net, &mut best);
    }
    let (crossings, layers, items) = best;
    net.layers = layers;
    net.slots.iter_mut().zip(items).for_each(|(s, i)| s.items = i);
    exchange(net, crossings);
}

fn items(net: &Net) -> Vec<Vec<usize>> {
    net.slots.iter().map(|s| s.items.clone()).collect()
}

type Best = (usize, Vec<Vec<usize>>, Vec<Vec<usize>>);

fn keep_better(net: &Net, best: &mut Best) {
    let crossings = net.crossings();
    if crossings < best.0 {
        *best = (crossings, net.layers.clone(), items(net));
    }
}

/// Sorts a column by where the wires to its left (or right) neighbours come from, and the rows by both sides.
fn settle(net: &mut Net, ranks: &mut Ranks, layer: usize, from_left: bool) {
    let size = |layer: &Vec<usize>| layer.iter().map(|s| net.slots[*s].items.len()).sum::<usize>().max(1) as f64;
    let sizes = [layer.checked_sub(1), Some(layer), Some(layer + 1)]
        .map(|l| l.and_then(|l| net.layers.get(l)).map_or(1.0, size));
    // Wires without lanes come from further away: their ends count as if they stood in the next column.
    let side =
        |hop: &Hop| 1 + usize::from(net.slots[hop.slot].layer > layer) - usize::from(net.slots[hop.slot].layer < layer);
    let height = |hop: &Hop| ((ranks[hop.slot][hop.item] as f64 + 0.5) / sizes[side(hop)]).min(1.0);
    let mut keys: BTreeMap<usize, f64> = BTreeMap::new();
    let mut orders: Vec<(usize, Vec<usize>)> = Vec::new();
    for slot in &net.layers[layer] {
        let near = &net.near[*slot];
        let fixed = |hop: &&(usize, Hop)| (net.slots[hop.1.slot].layer < layer) == from_left;
        let own = net.slots[*slot].items.iter().map(|i| height(&Hop { slot: *slot, item: *i }));
        let seen = mean(near.iter().filter(fixed).map(|(_, hop)| height(hop)));
        keys.insert(*slot, seen.or_else(|| mean(own)).unwrap_or(0.5));
        let mut wishes: Vec<(f64, f64)> = vec![(0.0, 0.0); net.slots[*slot].items.len()];
        near.iter().for_each(|(item, hop)| wishes[*item] = (wishes[*item].0 + height(hop), wishes[*item].1 + 1.0));
        let mut order = net.slots[*slot].items.clone();
        order.sort_by(|a, b| (wishes[*a].0 / wishes[*a].1).total_cmp(&(wishes[*b].0 / wishes[*b].1)));
        orders.push((*slot, order));
    }
    orders.into_iter().for_each(|(slot, order)| net.slots[slot].items = order);
    net.layers[layer].sort_by(|a, b| keys[a].total_cmp(&keys[b]));
    net.rank(layer, ranks);
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), v| (sum + v, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// Exchanges neighbours in columns and in boxes as long as crossings fall.
fn exchange(net: &mut Net, mut crossings: usize) {
    let places: usize = net.slots.iter().map(|s| s.items.len() + 1).sum();
    let cost = places * net.hops.iter().map(Vec::len).sum::<usize>();
    if cost > MOST_TRIALS {
        return;
    }
    loop {
        let before = crossings;
        for layer in 0..net.layers.len() {
            for i in 1..net.layers[layer].len() {
                net.layers[layer].swap(i - 1, i);
                crossings = net.keep_if_fewer(crossings, |net| net.layers[layer].swap(i - 1, i));
            }
        }
        for slot in 0..net.slots.len() {
            for i in 1..net.slots[slot].items.len() {
                net.slots[slot].items.swap(i - 1, i);
                crossings = net.keep_if_fewer(crossings, |net| net.slots[slot].items.swap(i - 1, i));
            }
        }
        if crossings == before {
            return;
        }
    }
}

impl Net {
    fn keep_if_fewer(&mut self, before: usize, undo: impl FnOnce(&mut Net)) -> usize {
        let after = self.crossings();
        if after < before {
            return after;
        }
        undo(self);
        before
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::ink::Class;
    use super::super::graph::{Block, End, Graph, Row, Wire};
    use super::super::place::place;
    use super::*;

    /// A thousand boxes in forty columns, each with ten wires to boxes one to three columns on.
    fn large() -> (Graph, Vec<usize>) {
        const BOXES: usize = 1000;
        let row = || Row { label: "side".into(), round: true, faces: Vec::new() };
        let mut boxes: Vec<Block> = (0..BOXES).map(|i| Block { name: format!("b{i}"), rows: Vec::new() }).collect();
        let mut end = |block: usize| {
            boxes[block].rows.push(row());
            End { block, row: boxes[block].rows.len() - 1 }
        };
        let pairs = (0..10 * BOXES).map(|i| (i % BOXES, i % BOXES + 25 + i * 7919 % 50)).filter(|p| p.1 < BOXES);
        let wire =
            |(a, b): (usize, usize)| Wire { ends: [end(a), end(b)], class: Class::Seat, count: 1, note: String::new() };
        let wires: Vec<Wire> = pairs.map(wire).collect();
        (Graph { contacts: wires.len(), boxes, wires }, (0..BOXES).map(|i| i / 25).collect())
    }

    #[test]
    fn a_large_diagram_is_sorted_and_placed_without_overlaps() {
        let (graph, columns) = large();
        let mut net = Net::new(&graph, &columns);
        let before = net.crossings();
        sort(&mut net);
        assert!(net.crossings() < before / 2, "{} of {before}", net.crossings());
        let layout = place(&graph, &net);
        for pair in net.layers.iter().flat_map(|l| l.windows(2)) {
            assert!(layout.tops[pair[1]] > layout.tops[pair[0]] + layout.heights[pair[0]]);
        }
    }

    #[test]
    fn crossings_are_counted_as_by_hand() {
        assert_eq!(inversions(vec![(0, 0), (1, 1), (2, 2)]), 0);
        assert_eq!(inversions(vec![(0, 2), (1, 1), (2, 0)]), 3);
        assert_eq!(inversions(vec![(0, 1), (0, 0), (0, 2)]), 0);
        assert_eq!(inversions(vec![(1, 0), (0, 1), (0, 0), (2, 0)]), 2);
    }

    #[test]
    fn crossings_are_those_of_all_pairs() {
        let wires: Vec<(usize, usize)> = (0..40).map(|i| ((i * 17) % 13, (i * 29) % 11)).collect();
        let cross = |a: &(usize, usize), b: &(usize, usize)| a.0 < b.0 && a.1 > b.1;
        let pairs = wires.iter().map(|a| wires.iter().filter(|b| cross(a, b)).count()).sum::<usize>();
        assert_eq!(inversions(wires), pairs);
    }
}
