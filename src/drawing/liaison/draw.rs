//! The liaison diagram written as SVG.
//!
//! In: the graph, the sorted columns, the layout. Out: the file. Wires lie under the boxes, each with a white edge, so that
//! at a crossing the eye keeps its wire.

use super::super::ink::{self, BLACK, Class, GREY, HEADING, NOTE, PAPER, TEXT};
use super::super::svg::{Anchor, Path, Point, Svg};
use super::graph::{Graph, Row, Wire};
use super::order::{Hop, Net};
use super::place::{HEAD, INSET, Layout};

/// Control points of a wire's bends, as a share of the gutter.
const BEND: f64 = 0.5;
/// Width of the white under a wire (px), and the share of a gutter at its ends that goes without.
const HALO: f64 = 4.5;
const MEETING: f64 = 0.2;
/// Corners of the boxes (px).
const CORNER: f64 = 7.0;
/// From the drawing to the title above and to the legend below (px).
const APART: f64 = 20.0;
/// From the base line of the title to that of the line below it (px).
const LEADING: f64 = 17.0;
/// A count stands this far beside and above the beginning of its wire (px).
const COUNT: [f64; 2] = [7.0, -4.0];
/// From the middle of a line of text to its base line, in sizes of the font.
const BASE: f64 = 0.36;

pub(super) fn draw(name: &str, graph: &Graph, net: &Net, layout: &Layout) -> String {
    let mut svg = Svg::default();
    for (wire, hops) in graph.wires.iter().zip(&net.hops) {
        svg.path(&halo(net, layout, hops), &format!("fill=\"none\" stroke=\"#fff\" stroke-width=\"{HALO}\""));
        svg.named(&wire.note, |svg| svg.path(&course(net, layout, hops), &ink::wire(wire.class)));
    }
    let boxes = || (0..net.slots.len()).filter_map(|s| Some((s, net.slots[s].block?)));
    svg.group(&format!("stroke=\"{BLACK}\""), |svg| {
        for (slot, block) in boxes() {
            let [low, high] = layout.frame(net, slot);
            svg.rect(low, high, CORNER, &format!("fill=\"{PAPER}\""));
            circles(svg, &graph.boxes[block].rows, net, layout, slot);
        }
    });
    svg.group(&format!("fill=\"{BLACK}\""), |svg| {
        boxes().for_each(|(slot, block)| label(svg, graph, net, layout, [slot, block]));
        graph.wires.iter().zip(&net.hops).for_each(|(wire, hops)| count(svg, wire, net, layout, hops));
    });
    surround(&mut svg, name, graph);
    svg.finish(&format!("Liaison diagram of {name}"))
}

/// The wire from circle to circle, straight where it passes a column.
fn course(net: &Net, layout: &Layout, hops: &[Hop]) -> Path {
    let mut path = Path::default();
    for (i, pair) in hops.windows(2).enumerate() {
        let [from, a, b, to] = gutter(net, layout, pair);
        if i == 0 {
            path.move_to(from)
        } else {
            path.line_to(from)
        }
        path.curve_to([a, b], to);
    }
    path
}

/// The white under a wire: not near the circles, where wires meet on purpose.
fn halo(net: &Net, layout: &Layout, hops: &[Hop]) -> Path {
    let mut path = Path::default();
    for pair in hops.windows(2) {
        let [from, a, b, to] = part(gutter(net, layout, pair), MEETING, 1.0 - MEETING);
        path.move_to(from);
        path.curve_to([a, b], to);
    }
    path
}

/// A wire between two columns, as a cubic curve: its ends and what is between.
fn gutter(net: &Net, layout: &Layout, pair: &[Hop]) -> [Point; 4] {
    let column = |hop: &Hop| layout.columns[net.slots[hop.slot].layer];
    let [x0, x1] = [column(&pair[0])[1], column(&pair[1])[0]];
    let [y0, y1] = [layout.y(&pair[0]), layout.y(&pair[1])];
    let bend = (x1 - x0) * BEND;
    [[x0, y0], [x0 + bend, y0], [x1 - bend, y1], [x1, y1]]
}

/// The part of a cubic curve between two parameters (its blossom, by de Casteljau).
fn part(curve: [Point; 4], from: f64, to: f64) -> [Point; 4] {
    let mix = |a: Point, b: Point, t: f64| [0, 1].map(|i| a[i] + (b[i] - a[i]) * t);
    let blossom = |[r, s, t]: [f64; 3]| {
        let [a, b, c] = [0, 1, 2].map(|i| mix(curve[i], curve[i + 1], r));
        let [a, b] = [mix(a, b, s), mix(b, c, s)];
        mix(a, b, t)
    };
    [[from; 3], [from, from, to], [from, to, to], [to; 3]].map(blossom)
}

/// How many contacts a wire stands for, where it begins.
fn count(svg: &mut Svg, wire: &Wire, net: &Net, layout: &Layout, hops: &[Hop]) {
    if wire.count > 1 {
        let at = [layout.columns[net.slots[hops[0].slot].layer][1] + COUNT[0], layout.y(&hops[0]) + COUNT[1]];
        svg.text(at, Anchor::Start, NOTE, &format!("{}×", wire.count), "");
    }
}

/// Whether wires leave a row to the left and to the right.
fn sides(net: &Net, slot: usize, item: usize) -> [bool; 2] {
    let layer = net.slots[slot].layer;
    let leaves =
        |left: bool| net.near[slot].iter().any(|(i, hop)| *i == item && (net.slots[hop.slot].layer < layer) == left);
    [leaves(true), leaves(false)]
}

fn circles(svg: &mut Svg, rows: &[Row], net: &Net, layout: &Layout, slot: usize) {
    let borders = layout.columns[net.slots[slot].layer];
    for item in &net.slots[slot].items {
        let y = layout.y(&Hop { slot, item: *item });
        let sides = sides(net, slot, *item);
        borders
            .into_iter()
            .zip(sides)
            .filter(|(_, leaves)| *leaves)
            .for_each(|(x, _)| ink::dot(svg, [x, y], rows[*item].round));
    }
}

/// The name of the box, and of its surfaces at the side where they touch.
fn label(svg: &mut Svg, graph: &Graph, net: &Net, layout: &Layout, [slot, block]: [usize; 2]) {
    let ([left, right], top) = (layout.columns[net.slots[slot].layer], layout.tops[slot]);
    let block = &graph.boxes[block];
    let at = [(left + right) / 2.0, top + HEAD / 2.0 + BASE * HEADING];
    svg.text(at, Anchor::Middle, HEADING, &block.name, "font-weight=\"bold\"");
    for item in &net.slots[slot].items {
        let y = layout.y(&Hop { slot, item: *item }) + BASE * TEXT;
        let (x, anchor) = match sides(net, slot, *item) {
            [true, false] => (left + INSET, Anchor::Start),
            [false, true] => (right - INSET, Anchor::End),
            _ => ((left + right) / 2.0, Anchor::Middle),
        };
        svg.text([x, y], anchor, TEXT, &block.rows[*item].label, "");
    }
}

/// The title above and the legend below.
fn surround(svg: &mut Svg, name: &str, graph: &Graph) {
    let [low, high] = svg.extent().unwrap_or([[0.0; 2]; 2]);
    let surfaces: usize = graph.boxes.iter().flat_map(|b| &b.rows).map(|r| r.faces.len()).sum();
    let counts = format!("{} components, {surfaces} mating surfaces, {} contacts", graph.boxes.len(), graph.contacts);
    let (title, line) = (format!("Liaison diagram: {name}"), low[1] - APART);
    svg.text([low[0], line - LEADING], Anchor::Start, HEADING, &title, "font-weight=\"bold\"");
    svg.text([low[0], line], Anchor::Start, NOTE, &counts, &format!("fill=\"{GREY}\""));
    let mut classes: Vec<Class> = graph.wires.iter().map(|w| w.class).collect();
    classes.sort();
    classes.dedup();
    let rounds: Vec<bool> = graph.boxes.iter().flat_map(|b| &b.rows).map(|r| r.round).collect();
    ink::legend(svg, [low[0], high[1] + APART], &ink::entries(&classes, &rounds));
}
