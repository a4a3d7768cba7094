//! Where the boxes stand and where the wires run.
//!
//! In: the graph and the sorted columns. Out: a [`Layout`] in px. Boxes of a column are equally wide. Each is as high as its
//! rows need and stands where its wires are straightest, found by sweeps of exact least squares over one column at a time.

use super::super::ink::{HEADING, TEXT};
use super::super::spread::spread;
use super::super::svg::{Point, bold_width, text_width};
use super::graph::Graph;
use super::order::{Hop, Net};

/// Of a row and of the name above the rows (px).
pub(super) const ROW: f64 = 17.0;
pub(super) const HEAD: f64 = 22.0;
/// Below the last row.
const FOOT: f64 = 5.0;
/// From the border of a box to its text.
pub(super) const INSET: f64 = 10.0;
/// Between wires that pass a column side by side.
const LANE: f64 = 6.0;
/// Between boxes, and between a box and a lane.
const BETWEEN: [f64; 2] = [22.0, 14.0];
/// Between columns: least, most, and how much a wire adds.
const GUTTER: [f64; 3] = [90.0, 190.0, 4.0];
/// Sweeps over all columns; later ones move nothing that can be seen.
const SWEEPS: usize = 16;
/// How strongly a box without wires holds its place.
const FAINT: f64 = 1e-3;

pub(super) struct Layout {
    /// Left and right border of every column.
    pub columns: Vec<[f64; 2]>,
    /// Upper border of every slot.
    pub tops: Vec<f64>,
    pub heights: Vec<f64>,
    /// Per slot the middle of every item below the slot's upper border.
    offsets: Vec<Vec<f64>>,
}

impl Layout {
    /// Height at which a wire passes.
    pub fn y(&self, hop: &Hop) -> f64 {
        self.tops[hop.slot] + self.offsets[hop.slot][hop.item]
    }

    /// The two corners of a slot.
    pub fn frame(&self, net: &Net, slot: usize) -> [Point; 2] {
        let ([left, right], top) = (self.columns[net.slots[slot].layer], self.tops[slot]);
        [[left, top], [right, top + self.heights[slot]]]
    }
}

pub(super) fn place(graph: &Graph, net: &Net) -> Layout {
    let (offsets, heights): (Vec<_>, Vec<_>) = (0..net.slots.len()).map(|s| measure(net, s)).unzip();
    let mut layout = Layout { columns: columns(graph, net), tops: vec![0.0; net.slots.len()], heights, offsets };
    for column in &net.layers {
        stack(net, &mut layout, column);
    }
    for _ in 0..SWEEPS {
        (0..net.layers.len()).for_each(|l| settle(net, &mut layout, l));
        (0..net.layers.len()).rev().for_each(|l| settle(net, &mut layout, l));
    }
    layout
}

/// The middles of a slot's items, and its height.
fn measure(net: &Net, slot: usize) -> (Vec<f64>, f64) {
    let items = &net.slots[slot].items;
    let (head, step, foot) = if net.slots[slot].block.is_some() { (HEAD, ROW, FOOT) } else { (0.0, LANE, 0.0) };
    let mut middles = vec![0.0; items.len()];
    items.iter().enumerate().for_each(|(i, item)| middles[*item] = head + (i as f64 + 0.5) * step);
    (middles, head + step * items.len() as f64 + foot)
}

fn columns(graph: &Graph, net: &Net) -> Vec<[f64; 2]> {
    let mut wires = vec![0usize; net.layers.len()];
    net.hops.iter().flat_map(|h| h.windows(2)).for_each(|pair| wires[net.slots[pair[0].slot].layer] += 1);
    let [least, most, each] = GUTTER;
    let mut left = 0.0;
    let mut columns = Vec::new();
    for (layer, wires) in net.layers.iter().zip(wires) {
        let blocks = layer.iter().filter_map(|s| net.slots[*s].block);
        let right = left + blocks.map(|b| width(graph, b)).fold(0.0, f64::max);
        columns.push([left, right]);
        left = right + (least + each * wires as f64).min(most);
    }
    columns
}

/// What the name and the rows of a box need.
fn width(graph: &Graph, block: usize) -> f64 {
    let block = &graph.boxes[block];
    let rows = block.rows.iter().map(|r| text_width(&r.label, TEXT));
    rows.fold(bold_width(&block.name, HEADING), f64::max) + 2.0 * INSET
}

/// Least distance between the upper borders of slots that follow each other.
fn gaps(net: &Net, layout: &Layout, column: &[usize]) -> Vec<f64> {
    let is_lane = |s: usize| net.slots[s].block.is_none();
    let between = |a: usize, b: usize| match (is_lane(a), is_lane(b)) {
        (false, false) => BETWEEN[0],
        (true, true) => LANE,
        _ => BETWEEN[1],
    };
    column.windows(2).map(|p| layout.heights[p[0]] + between(p[0], p[1])).collect()
}

/// One slot below the other, about the height 0.
fn stack(net: &Net, layout: &mut Layout, column: &[usize]) {
    let wanted: Vec<f64> = column.iter().map(|s| -layout.heights[*s] / 2.0).collect();
    assign(net, layout, column, &wanted, &vec![1.0; column.len()]);
}

/// Moves the slots of a column to where their wires are straightest.
fn settle(net: &Net, layout: &mut Layout, layer: usize) {
    let column = &net.layers[layer];
    let wish = |slot: &usize| {
        let pulls = net.near[*slot].iter().map(|(item, hop)| layout.y(hop) - layout.offsets[*slot][*item]);
        let (sum, count) = pulls.fold((0.0, 0.0), |(s, n), y| (s + y, n + 1.0));
        if count > 0.0 { (sum / count, count) } else { (layout.tops[*slot], FAINT) }
    };
    let (wanted, weights): (Vec<f64>, Vec<f64>) = column.iter().map(wish).unzip();
    assign(net, layout, column, &wanted, &weights);
}

fn assign(net: &Net, layout: &mut Layout, column: &[usize], wanted: &[f64], weights: &[f64]) {
    let tops = spread(wanted, weights, &gaps(net, layout, column));
    column.iter().zip(tops).for_each(|(slot, top)| layout.tops[*slot] = top);
}
