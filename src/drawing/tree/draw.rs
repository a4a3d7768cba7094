//! Error trees and the object tree written as SVG.
//!
//! In: trees. Out: files. Columns are levels; a node's box names its component and, in error trees, the surfaces by which
//! the error comes in, each with its circle. Dashed lines stay in the gutters: loops join nodes of one level or of two that
//! follow each other, because the trees are breadth-first.

use super::super::ink::{self, BLACK, Class, Entry, GREY, HEADING, NOTE, PAPER, Sample, TEXT, is_round};
use super::super::svg::{Anchor, Path, Svg, bold_width, text_width};
use super::tidy::{Gaps, tidy};
use super::{Source, data};
use crate::assembly::contact::{Contact, FaceRef};
use crate::assembly::error_tree::ErrorTree;
use crate::design::model::Design;

/// More nodes than this do not fit a page: an error tree is drawn down to the level that does.
const MOST_NODES: usize = 150;
/// The same for the object tree.
const MOST_IN_ALL: usize = 600;
/// More surfaces than this are counted, not listed.
const MOST_WAYS: usize = 6;

/// Of a box: above the rows, per row, below the rows, and from the border to the text (px).
const HEAD: f64 = 21.0;
const ROW: f64 = 15.0;
const FOOT: f64 = 4.0;
const INSET: f64 = 9.0;
const CORNER: f64 = 6.0;
/// Between the columns: room for the bends of edges and loops (px).
const GUTTER: f64 = 84.0;
/// Between nodes of error trees, and of the object tree, which has hundreds (px).
const ROOMY: Gaps = Gaps { siblings: 16.0, families: 26.0 };
const DENSE: Gaps = Gaps { siblings: 4.0, families: 14.0 };
/// A loop inside a level bends into the gutter by this share of its height, and at most this far (px).
const LOOP: [f64; 2] = [0.35, 72.0];
/// From the tree to the title above and to the legend below (px).
const APART: f64 = 26.0;
/// From the middle of a line of text to its base line, in sizes of the font.
const BASE: f64 = 0.36;

/// A box of a tree.
struct Node {
    name: String,
    parent: Option<usize>,
    level: usize,
    rows: Vec<Row>,
    middle: f64,
}

/// A line of text in a box; with the class of the contact where an error comes in by it.
struct Row {
    text: String,
    round: Option<bool>,
    class: Option<Class>,
}

/// An error tree (Fig. 9).
pub fn svg(source: &Source, tree: &ErrorTree) -> String {
    let shown = shown(tree);
    let mut nodes: Vec<Node> = (0..shown).map(|i| node(source, tree, i)).collect();
    arrange(&mut nodes, ROOMY);
    let name = nodes[0].name.clone();
    let loops: Vec<[usize; 2]> = tree.dashed.iter().map(|e| e.nodes).filter(|n| n.iter().all(|i| *i < shown)).collect();
    let sheet = Sheet::new(nodes);
    let mut svg = Svg::default();
    loops.iter().for_each(|pair| sheet.dashed(&mut svg, *pair));
    sheet.draw(&mut svg);
    sheet.levels(&mut svg, |level| if level == 0 { "root".into() } else { format!("level {level}") });
    let mut entries = ink::entries(&sheet.classes(), &sheet.rounds());
    if !loops.is_empty() {
        entries.push(Entry { sample: Sample::Dashed, word: "contact that would close a loop" });
    }
    surround(&mut svg, &format!("Error tree: {name}"), tree.nodes.len() - shown, &entries);
    svg.finish(&format!("Error tree of {name}"))
}

/// The object tree (Fig. 3): the assembly, its watched components, and under each its error tree.
pub fn object_svg(design: &Design, trees: &[ErrorTree]) -> String {
    let mut nodes = vec![Node { name: design.name.clone(), parent: None, level: 0, rows: Vec::new(), middle: 0.0 }];
    let total: usize = trees.iter().map(|t| t.nodes.len()).sum();
    let deepest = deepest(trees);
    for tree in trees.iter().take(MOST_IN_ALL) {
        let first = nodes.len();
        let cut = tree.nodes.iter().take_while(|n| n.level <= deepest);
        nodes.extend(cut.map(|n| Node {
            name: design.components[n.component].name.clone(),
            parent: Some(n.parent.map_or(0, |p| first + p)),
            level: n.level as usize + 1,
            rows: Vec::new(),
            middle: 0.0,
        }));
    }
    let missing = total + 1 - nodes.len();
    arrange(&mut nodes, DENSE);
    let sheet = Sheet::new(nodes);
    let mut svg = Svg::default();
    sheet.draw(&mut svg);
    sheet.levels(&mut svg, |level| match level {
        0 => "assembly".into(),
        1 => "watched".into(),
        _ => format!("level {}", level - 1),
    });
    surround(&mut svg, &format!("Object tree: {}", design.name), missing, &[]);
    svg.finish(&format!("Object tree of {}", design.name))
}

/// How many nodes of an error tree are drawn: whole levels, or of a very wide one the first.
fn shown(tree: &ErrorTree) -> usize {
    let whole = (1..=tree.nodes.len()).rev().find(|n| {
        let complete = tree.nodes.get(*n).is_none_or(|next| next.level > tree.nodes[n - 1].level);
        *n <= MOST_NODES && *n > 1 && complete
    });
    whole.unwrap_or(tree.nodes.len().min(MOST_NODES))
}

/// The deepest level down to which all trees together can be drawn.
fn deepest(trees: &[ErrorTree]) -> u32 {
    let most = trees.iter().flat_map(|t| &t.nodes).map(|n| n.level).max().unwrap_or(0);
    let count = |level: u32| trees.iter().flat_map(|t| &t.nodes).filter(|n| n.level <= level).count();
    (0..=most).rev().find(|level| count(*level) <= MOST_IN_ALL).unwrap_or(0)
}

fn node(source: &Source, tree: &ErrorTree, at: usize) -> Node {
    let node = &tree.nodes[at];
    let mut rows = if node.parent.is_none() { own_surfaces(source, tree) } else { ways(source, tree, at) };
    if rows.len() > MOST_WAYS {
        let more = rows.len() - (MOST_WAYS - 1);
        rows.truncate(MOST_WAYS - 1);
        rows.push(Row { text: format!("and {more} more"), round: None, class: None });
    }
    let name = source.design.components[node.component].name.clone();
    Node { name, parent: node.parent, level: node.level as usize, rows, middle: 0.0 }
}

/// The root's surfaces that touch something.
fn own_surfaces(source: &Source, tree: &ErrorTree) -> Vec<Row> {
    let root = &tree.nodes[0];
    let row = |face: &FaceRef| {
        let round = source.liaison.of(face.component).any(|c| c.on(face.component) == Some(*face) && is_round(c));
        let text = source.solids[face.component].faces[face.face].name.clone();
        Row { text, round: Some(round), class: None }
    };
    root.surfaces.iter().map(row).collect()
}

fn ways(source: &Source, tree: &ErrorTree, at: usize) -> Vec<Row> {
    let contacts = data::contacts(source, tree, at);
    let row = |(way, (contact, _)): (data::Way, (&Contact, _))| Row {
        text: format!("{} → {}", way.from, way.to),
        round: Some(is_round(contact)),
        class: Some(Class::of(contact)),
    };
    data::ways(source, tree, at).into_iter().zip(contacts).map(row).collect()
}

fn arrange(nodes: &mut [Node], gaps: Gaps) {
    let parents: Vec<Option<usize>> = nodes.iter().map(|n| n.parent).collect();
    let heights: Vec<f64> = nodes.iter().map(Node::height).collect();
    let middles = tidy(&parents, &heights, gaps);
    nodes.iter_mut().zip(middles).for_each(|(node, middle)| node.middle = middle);
}

impl Node {
    fn height(&self) -> f64 {
        if self.rows.is_empty() { HEAD } else { HEAD + ROW * self.rows.len() as f64 + FOOT }
    }

    fn width(&self) -> f64 {
        let rows = self.rows.iter().map(|r| text_width(&r.text, NOTE));
        rows.fold(bold_width(&self.name, TEXT), f64::max) + 2.0 * INSET
    }

    fn top(&self) -> f64 {
        self.middle - self.height() / 2.0
    }

    /// The height of the name.
    fn name_y(&self) -> f64 {
        self.top() + HEAD / 2.0
    }

    fn row_y(&self, row: usize) -> f64 {
        self.top() + HEAD + (row as f64 + 0.5) * ROW
    }
}

/// Nodes that stand, and their columns.
struct Sheet {
    nodes: Vec<Node>,
    /// Left and right border of every level.
    columns: Vec<[f64; 2]>,
}

impl Sheet {
    fn new(nodes: Vec<Node>) -> Sheet {
        let deepest = nodes.iter().map(|n| n.level).max().unwrap_or(0);
        let width = |level| nodes.iter().filter(|n| n.level == level).map(Node::width).fold(0.0, f64::max);
        let widths: Vec<f64> = (0..=deepest).map(width).collect();
        let columns = widths.iter().scan(0.0, |left, width| {
            let column = [*left, *left + width];
            *left += width + GUTTER;
            Some(column)
        });
        Sheet { columns: columns.collect(), nodes }
    }

    fn column(&self, node: &Node) -> [f64; 2] {
        self.columns[node.level]
    }

    fn classes(&self) -> Vec<Class> {
        let mut classes: Vec<Class> = self.nodes.iter().flat_map(|n| &n.rows).filter_map(|r| r.class).collect();
        classes.sort();
        classes.dedup();
        classes
    }

    /// Whether each surface is round.
    fn rounds(&self) -> Vec<bool> {
        self.nodes.iter().flat_map(|n| &n.rows).filter_map(|r| r.round).collect()
    }

    /// Edges, then boxes, circles and text over them.
    fn draw(&self, svg: &mut Svg) {
        self.nodes.iter().for_each(|node| self.edges(svg, node));
        svg.group(&format!("stroke=\"{BLACK}\""), |svg| {
            for node in &self.nodes {
                let [left, right] = self.column(node);
                let (low, high) = ([left, node.top()], [right, node.top() + node.height()]);
                svg.rect(low, high, CORNER, &format!("fill=\"{PAPER}\""));
                let rows = node.rows.iter().enumerate();
                rows.filter_map(|(i, r)| Some((i, r.round?)))
                    .for_each(|(i, round)| ink::dot(svg, [left, node.row_y(i)], round));
            }
        });
        svg.group(&format!("fill=\"{BLACK}\""), |svg| self.nodes.iter().for_each(|node| self.text(svg, node)));
    }

    fn text(&self, svg: &mut Svg, node: &Node) {
        let [left, right] = self.column(node);
        let at = [(left + right) / 2.0, node.name_y() + BASE * TEXT];
        svg.text(at, Anchor::Middle, TEXT, &node.name, "font-weight=\"bold\"");
        for (i, row) in node.rows.iter().enumerate() {
            svg.text([left + INSET, node.row_y(i) + BASE * NOTE], Anchor::Start, NOTE, &row.text, "");
        }
    }

    /// From the parent to every surface by which the error comes in; in the object tree to the name.
    fn edges(&self, svg: &mut Svg, node: &Node) {
        let Some(parent) = node.parent.map(|p| &self.nodes[p]) else { return };
        let from = [self.column(parent)[1], parent.middle];
        let left = self.column(node)[0];
        if node.rows.is_empty() {
            svg.path(&bend(from, [left, node.middle]), &ink::wire(Class::Seat));
        }
        for (i, class) in node.rows.iter().enumerate().filter_map(|(i, r)| Some((i, r.class?))) {
            svg.path(&bend(from, [left, node.row_y(i)]), &ink::wire(class));
        }
    }

    /// A contact that would close a loop.
    fn dashed(&self, svg: &mut Svg, pair: [usize; 2]) {
        let [a, b] = pair.map(|i| &self.nodes[i]);
        let (a, b) = if a.level <= b.level { (a, b) } else { (b, a) };
        let from = [self.column(a)[1], a.name_y()];
        let mut path = Path::default();
        if a.level == b.level {
            let to = [from[0], b.name_y()];
            let out = from[0] + ((to[1] - from[1]).abs() * LOOP[0]).min(LOOP[1]);
            path.move_to(from);
            path.curve_to([[out, from[1]], [out, to[1]]], to);
        } else {
            path = bend(from, [self.column(b)[0], b.name_y()]);
        }
        svg.path(&path, &ink::dashed());
    }

    /// A word above every column.
    fn levels(&self, svg: &mut Svg, word: impl Fn(usize) -> String) {
        let top = svg.extent().map_or(0.0, |[low, _]| low[1]) - NOTE;
        for (level, [left, right]) in self.columns.iter().enumerate() {
            svg.text([(left + right) / 2.0, top], Anchor::Middle, NOTE, &word(level), &format!("fill=\"{GREY}\""));
        }
    }
}

/// From left to right, level at both ends.
fn bend(from: [f64; 2], to: [f64; 2]) -> Path {
    let middle = (from[0] + to[0]) / 2.0;
    let mut path = Path::default();
    path.move_to(from);
    path.curve_to([[middle, from[1]], [middle, to[1]]], to);
    path
}

/// The title above, what is missing and the legend below.
fn surround(svg: &mut Svg, title: &str, missing: usize, entries: &[Entry]) {
    let [low, high] = svg.extent().unwrap_or([[0.0; 2]; 2]);
    svg.text([low[0], low[1] - APART / 2.0], Anchor::Start, HEADING, title, "font-weight=\"bold\"");
    if missing > 0 {
        let note = format!("{missing} more nodes on deeper levels are not drawn");
        svg.text([low[0], high[1] + APART], Anchor::Start, NOTE, &note, &format!("fill=\"{GREY}\""));
    }
    let line = if missing > 0 { 2.0 * NOTE } else { 0.0 };
    ink::legend(svg, [low[0], high[1] + APART + line], entries);
}
