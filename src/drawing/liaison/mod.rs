//! The liaison diagram as a picture (Fig. 8 of the paper): components as boxes, their mating surfaces as circles on the
//! border, contacts as lines between circles.
//!
//! In: a design, its solids, its analysis. Out: SVG by our own layout, and DOT for graphviz. The base stands on the left and
//! what is removed first on the right, so the lines tell the order of assembly. Layout after Sugiyama, Tagawa and Toda
//! (1981): `graph` reduces the diagram to boxes and wires, `layers` gives every box a column, `order` sorts columns and
//! rows for few crossings, `place` finds heights, `draw` writes. Every surface is kept; alike ones share a row with a count.

mod draw;
mod graph;
mod layers;
mod order;
mod place;

use super::dot::quoted;
use super::ink::{Class, figures, is_round};
use crate::assembly::Analysis;
use crate::assembly::contact::FaceRef;
use crate::design::model::Design;
use crate::solid::Solid;
use std::fmt::Write;
use std::sync::Arc;

/// The diagram laid out for reading. `solids` holds one solid per component.
pub fn svg(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> String {
    let graph = graph::Graph::new(design, solids, &analysis.liaison);
    let columns = layers::layers(&graph, &analysis.insertion);
    let mut net = order::Net::new(&graph, &columns);
    order::sort(&mut net);
    let layout = place::place(&graph, &net);
    draw::draw(&design.name, &graph, &net, &layout)
}

/// How often wires cross in the diagram: what its layout is judged by.
pub fn crossings(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> usize {
    let graph = graph::Graph::new(design, solids, &analysis.liaison);
    let mut net = order::Net::new(&graph, &layers::layers(&graph, &analysis.insertion));
    order::sort(&mut net);
    net.crossings()
}

/// The diagram for graphviz: a cluster per component, a node per surface, an edge per contact. `solids` as in [`svg`].
pub fn dot(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> String {
    let liaison = &analysis.liaison;
    let mut text = format!("graph {} {{\n  rankdir=LR;\n  node [fontsize=10];\n", quoted(&design.name));
    for (c, component) in design.components.iter().enumerate() {
        let _ = writeln!(text, "  subgraph cluster_{c} {{\n    label={};", quoted(&component.name));
        for surface in liaison.surfaces(c) {
            let name = quoted(&solids[c].faces[surface.face].name);
            let round = liaison.of(c).any(|k| k.on(c) == Some(surface) && is_round(k));
            let shape = if round { "ellipse" } else { "box" };
            let _ = writeln!(text, "    {} [label={name}, shape={shape}];", node(surface));
        }
        text.push_str("  }\n");
    }
    for contact in &liaison.contacts {
        let (a, b, class) = (node(contact.a), node(contact.b), Class::of(contact));
        let (colour, note) = (quoted(class.colour()), quoted(&figures(contact)));
        let _ = writeln!(text, "  {a} -- {b} [color={colour}, tooltip={note}];");
    }
    text.push_str("}\n");
    text
}

fn node(face: FaceRef) -> String {
    format!("c{}f{}", face.component, face.face)
}
