//! The liaison diagram written as SVG.
//!
//! In: the graph, the sorted columns, the layout. Out: the file. Wires lie under the boxes, each with a white edge, so that
//! at a crossing the eye keeps its wire.

use super::super::ink::{self, BLACK, Class, GREY, HEADING, NOTE, PAPER, TEXT};
use super::super::svg::{Anchor, Path, Svg};
use super::graph::{Graph, Row, Wire};
use super::order::{Hop, Net};
use super::place::{HEAD, INSET, Layout};

/// Control points of a wire's bends, as a share of the gutter.
const BEND: f64 = 0.5;
/// Width of the white under a wire (px).
const HALO: f64 = 4.5;
/// Corners of the boxes (px).
const CORNER: f64 = 7.0;
/// From the drawing to the title above and to the legend below (px).
const APART: f64 = 24.0;
/// A count stands this far beside and above the beginning of its wire (px).
const COUNT: [f64; 2] = [7.0, -4.0];
/// From the middle of a line of text to its base line, in sizes of the font.
const BASE: f64 = 0.36;

pub(super) fn draw(name: &str, graph: &Graph, net: &Net, layout: &Layout) -> String {
    let mut svg = Svg::default();
    for (wire, hops) in graph.wires.iter().zip(&net.hops) {
        svg.named(&wire.note, |svg| draw_wire(svg, wire, &course(net, layout, hops)));
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
    let column = |hop: &Hop| layout.columns[net.slots[hop.slot].layer];
    let mut path = Path::default();
    path.move_to([column(&hops[0])[1], layout.y(&hops[0])]);
    for pair in hops.windows(2) {
        let ([x0, x1], [y0, y1]) =
            ([column(&pair[0])[1], column(&pair[1])[0]], [&pair[0], &pair[1]].map(|h| layout.y(h)));
        let bend = (x1 - x0) * BEND;
        path.curve_to([[x0 + bend, y0], [x1 - bend, y1]], [x1, y1]);
        if net.slots[pair[1].slot].block.is_none() {
            path.line_to([column(&pair[1])[1], y1]);
        }
    }
    path
}

fn draw_wire(svg: &mut Svg, wire: &Wire, course: &Path) {
    svg.path(course, &format!("fill=\"none\" stroke=\"#fff\" stroke-width=\"{HALO}\""));
    svg.path(course, &ink::wire(wire.class));
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
    svg.text(
        [low[0], low[1] - APART],
        Anchor::Start,
        HEADING,
        &format!("Liaison diagram: {name}"),
        "font-weight=\"bold\"",
    );
    svg.text([low[0], low[1] - APART + 1.4 * HEADING], Anchor::Start, NOTE, &counts, &format!("fill=\"{GREY}\""));
    let mut classes: Vec<Class> = graph.wires.iter().map(|w| w.class).collect();
    classes.sort();
    classes.dedup();
    ink::legend(svg, [low[0], high[1] + APART], &ink::entries(&classes));
}
