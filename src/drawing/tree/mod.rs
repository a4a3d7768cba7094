//! Error trees and the object tree as pictures and as data (Figs. 3 and 9 of the paper).
//!
//! In: a design, its solids, its liaison diagram, its error trees. Out: SVG, DOT and JSON. Trees grow to the right, a column
//! per level; `tidy` finds the heights. A node of an error tree says by which surfaces the error comes in; contacts
//! that would close a loop are dashed. Trees too large to read are drawn down to a level, and say so.

mod data;
mod draw;
mod tidy;

use super::dot::quoted;
use crate::assembly::error_tree::ErrorTree;
use crate::assembly::liaison::Liaison;
use crate::design::model::Design;
use crate::solid::Solid;
use std::fmt::Write;
use std::sync::Arc;

pub use data::{ObjectData, TreeData, data, object_data};
pub use draw::{object_svg, svg};

/// What the pictures of trees are made from. `solids` holds one solid per component.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    pub design: &'a Design,
    pub solids: &'a [Arc<Solid>],
    pub liaison: &'a Liaison,
}

/// An error tree for graphviz; loops are dashed and do not pull on the layout.
pub fn dot(source: &Source, tree: &ErrorTree) -> String {
    let name = |node: usize| source.design.components[tree.nodes[node].component].name.as_str();
    let mut text = format!("digraph {} {{\n  rankdir=LR;\n  node [shape=box, style=rounded];\n", quoted(name(0)));
    for (i, node) in tree.nodes.iter().enumerate() {
        let ways: Vec<String> = data::ways(source, tree, i).into_iter().map(|w| w.to).collect();
        let label = std::iter::once(name(i).to_string()).chain(ways).collect::<Vec<_>>();
        let _ = writeln!(text, "  n{i} [label={}];", lines(&label));
        if let Some(parent) = node.parent {
            let _ = writeln!(text, "  n{parent} -> n{i};");
        }
    }
    for edge in &tree.dashed {
        let [a, b] = edge.nodes;
        let _ = writeln!(text, "  n{a} -> n{b} [style=dashed, dir=none, constraint=false];");
    }
    text.push_str("}\n");
    text
}

/// The object tree for graphviz.
pub fn object_dot(design: &Design, trees: &[ErrorTree]) -> String {
    let mut text = format!("digraph {} {{\n  rankdir=LR;\n  node [shape=box, style=rounded];\n", quoted(&design.name));
    let _ = writeln!(text, "  root [label={}];", quoted(&design.name));
    for (t, tree) in trees.iter().enumerate() {
        for (i, node) in tree.nodes.iter().enumerate() {
            let from = node.parent.map_or("root".into(), |p| format!("t{t}n{p}"));
            let label = quoted(&design.components[node.component].name);
            let _ = writeln!(text, "  t{t}n{i} [label={label}];\n  {from} -> t{t}n{i};");
        }
    }
    text.push_str("}\n");
    text
}

/// A label of several lines.
fn lines(lines: &[String]) -> String {
    let quoted: Vec<String> = lines.iter().map(|l| quoted(l)).collect();
    let inner: Vec<&str> = quoted.iter().map(|l| &l[1..l.len() - 1]).collect();
    format!("\"{}\"", inner.join("\\n"))
}
