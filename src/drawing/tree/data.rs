//! Error trees and the object tree as flat lists in the user's names, for programs.

use super::Source;
use crate::assembly::contact::{Contact, FaceRef};
use crate::assembly::error_tree::{ErrorTree, TreeNode};
use crate::design::model::Design;
use serde::Serialize;

/// An error tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TreeData {
    pub component: String,
    /// The root first, then by level; parents before their children.
    pub nodes: Vec<NodeData>,
    /// Pairs of indices into `nodes`: components that touch without being parent and child.
    pub loops: Vec<[usize; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NodeData {
    pub component: String,
    /// 0 for the root.
    pub level: u32,
    /// Index into `nodes`.
    pub parent: Option<usize>,
    /// Contacts by which the error comes in; for the root none.
    pub through: Vec<Way>,
}

/// One way by which an error spreads: a contact, seen from the parent.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Way {
    /// The parent's surface.
    pub from: String,
    /// The node's own.
    pub to: String,
}

/// The object tree: under the assembly, each watched component with its error tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectData {
    pub assembly: String,
    pub trees: Vec<TreeData>,
}

/// One error tree with names in place of indices.
pub fn data(source: &Source, tree: &ErrorTree) -> TreeData {
    let name = |component: usize| source.design.components[component].name.clone();
    let node = |(i, node): (usize, &TreeNode)| NodeData {
        component: name(node.component),
        level: node.level,
        parent: node.parent,
        through: ways(source, tree, i),
    };
    TreeData {
        component: name(tree.nodes[0].component),
        nodes: tree.nodes.iter().enumerate().map(node).collect(),
        loops: tree.dashed.iter().map(|e| e.nodes).collect(),
    }
}

/// The object tree with names in place of indices; `trees` in the order of `inspect`.
pub fn object_data(source: &Source, trees: &[ErrorTree]) -> ObjectData {
    let Design { name, .. } = source.design;
    ObjectData { assembly: name.clone(), trees: trees.iter().map(|t| data(source, t)).collect() }
}

/// How an error comes to a node from its parent.
pub(super) fn ways(source: &Source, tree: &ErrorTree, node: usize) -> Vec<Way> {
    let face = |f: FaceRef| source.solids[f.component].faces[f.face].name.clone();
    let way = |(own, other): (FaceRef, FaceRef)| Way { from: face(other), to: face(own) };
    contacts(source, tree, node).map(|(c, own)| way((own, if c.a == own { c.b } else { c.a }))).collect()
}

/// The contacts of a node with its parent, each with the node's own surface.
pub(super) fn contacts<'a>(
    source: &'a Source,
    tree: &'a ErrorTree,
    node: usize,
) -> impl Iterator<Item = (&'a Contact, FaceRef)> {
    let own = tree.nodes[node].component;
    let parent = tree.nodes[node].parent.map(|p| tree.nodes[p].component);
    let between = parent.into_iter().flat_map(move |p| source.liaison.between(p, own));
    between.filter_map(move |c| Some((c, c.on(own)?)))
}
