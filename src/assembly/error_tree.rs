//! Error trees and the object tree (section III, Figs. 3 and 9 of the paper).
//!
//! In: the liaison diagram. Out: for a component the tree of those an error in it can spread to, breadth-first over the
//! contacts; a contact that would close a loop is kept as a dashed edge. The trees of all watched components combine into
//! the object tree. How many levels are used is settled later, by visibility.

use super::contact::FaceRef;
use super::liaison::Liaison;
use crate::design::model::Design;
use serde::Serialize;
use std::collections::BTreeMap;

/// What an error in one component can do to the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorTree {
    /// The root first, then by level; parents before their children.
    pub nodes: Vec<TreeNode>,
    /// Contacts between components of the tree that are not in it: they would close a loop.
    pub dashed: Vec<Edge>,
}

/// A component in an error tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TreeNode {
    /// Index into [`Design::components`].
    pub component: usize,
    /// Index into [`ErrorTree::nodes`]; `None` for the root.
    pub parent: Option<usize>,
    /// 0 for the root.
    pub level: u32,
    /// The root: all its surfaces that touch something. Others: those that touch the parent.
    pub surfaces: Vec<FaceRef>,
}

/// Two nodes of a tree that touch without being parent and child.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Edge {
    /// Indices into [`ErrorTree::nodes`], the smaller first.
    pub nodes: [usize; 2],
}

/// The error tree of a component, down to `depth` levels below it (`None`: all that can be reached).
pub fn error_tree(liaison: &Liaison, root: usize, depth: Option<u32>) -> ErrorTree {
    let reached = spread(liaison, root, depth, &mut vec![false; liaison.components]);
    let nodes: Vec<TreeNode> = reached.iter().map(|r| node(liaison, &reached, r)).collect();
    let dashed = dashed(liaison, &nodes);
    ErrorTree { nodes, dashed }
}

/// A component that an error spreads to.
#[derive(Clone, Copy)]
struct Reached {
    component: usize,
    /// Place in the order of reaching; `None` for the root.
    parent: Option<usize>,
    level: u32,
}

/// Who is reached from a root, breadth-first. `known` holds a mark per component, all clear before and after.
fn spread(liaison: &Liaison, root: usize, depth: Option<u32>, known: &mut [bool]) -> Vec<Reached> {
    let mut reached = vec![Reached { component: root, parent: None, level: 0 }];
    known[root] = true;
    let mut at = 0;
    while let Some(&Reached { component, level, .. }) = reached.get(at) {
        let onwards = if depth.is_none_or(|d| level < d) { liaison.neighbours(component) } else { &[] };
        for &neighbour in onwards {
            if !std::mem::replace(&mut known[neighbour], true) {
                reached.push(Reached { component: neighbour, parent: Some(at), level: level + 1 });
            }
        }
        at += 1;
    }
    reached.iter().for_each(|r| known[r.component] = false);
    reached
}

fn node(liaison: &Liaison, reached: &[Reached], &Reached { component, parent, level }: &Reached) -> TreeNode {
    let surfaces = match parent {
        Some(parent) => between(liaison, reached[parent].component, component),
        None => liaison.surfaces(component),
    };
    TreeNode { component, parent, level, surfaces }
}

/// Surfaces of `component` that touch `parent`, each once.
fn between(liaison: &Liaison, parent: usize, component: usize) -> Vec<FaceRef> {
    let mut surfaces: Vec<FaceRef> = liaison.between(parent, component).filter_map(|c| c.on(component)).collect();
    surfaces.sort();
    surfaces.dedup();
    surfaces
}

fn dashed(liaison: &Liaison, nodes: &[TreeNode]) -> Vec<Edge> {
    let place: BTreeMap<usize, usize> = nodes.iter().enumerate().map(|(i, n)| (n.component, i)).collect();
    let later = |i: usize| {
        let others = liaison.neighbours(nodes[i].component);
        let mut later: Vec<usize> = others.iter().filter_map(|c| place.get(c).copied()).filter(|j| *j > i).collect();
        later.sort_unstable();
        later.into_iter().filter(move |j| nodes[*j].parent != Some(i)).map(move |j| Edge { nodes: [i, j] })
    };
    (0..nodes.len()).flat_map(later).collect()
}

/// The least level at which each surface stands in the error trees of the watched components.
///
/// The same as asking all trees of [`object_tree`], but with one of them in memory at a time: a thousand trees of a thousand
/// components are a million nodes.
pub fn levels(design: &Design, liaison: &Liaison) -> BTreeMap<FaceRef, u32> {
    let mut watched = vec![false; liaison.components];
    design.inspect.watch.iter().for_each(|w| watched[w.component] = true);
    // All surfaces of a watched component are at level 0 in its own tree, and no other tree can better that.
    let roots = (0..liaison.components).filter(|c| watched[*c]).flat_map(|c| liaison.surfaces(c));
    let mut levels: BTreeMap<FaceRef, u32> = roots.map(|face| (face, 0)).collect();
    let mut pairs: BTreeMap<(usize, usize), u32> = BTreeMap::new();
    let mut known = vec![false; liaison.components];
    for watch in &design.inspect.watch {
        let reached = spread(liaison, watch.component, watch.depth, &mut known);
        for r in reached.iter().filter(|r| !watched[r.component]) {
            let Some(parent) = r.parent else { continue };
            let level = pairs.entry((reached[parent].component, r.component)).or_insert(r.level);
            *level = r.level.min(*level);
        }
    }
    for ((parent, component), found) in pairs {
        for face in between(liaison, parent, component) {
            let level = levels.entry(face).or_insert(found);
            *level = found.min(*level);
        }
    }
    levels
}

/// The error trees of all watched components under one root, the assembly as a whole.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectTree {
    /// In the order of `inspect`.
    pub trees: Vec<ErrorTree>,
}

/// The object tree of a design; a watch without a depth of its own has its tree in full.
pub fn object_tree(design: &Design, liaison: &Liaison) -> ObjectTree {
    let trees = design.inspect.watch.iter().map(|w| error_tree(liaison, w.component, w.depth)).collect();
    ObjectTree { trees }
}

/// An error tree in the user's names, for goldens and `--emit error-trees`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TreeSummary {
    pub component: String,
    pub spreads_to: Vec<TreeSummary>,
    /// Components touched that stand elsewhere in the tree.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also_touches: Vec<String>,
}

/// An error tree with names in place of indices.
pub fn summary(design: &Design, tree: &ErrorTree) -> TreeSummary {
    let mut children = vec![Vec::new(); tree.nodes.len()];
    for (index, node) in tree.nodes.iter().enumerate() {
        node.parent.into_iter().for_each(|p| children[p].push(index));
    }
    summarise(design, tree, &children, 0)
}

fn summarise(design: &Design, tree: &ErrorTree, children: &[Vec<usize>], node: usize) -> TreeSummary {
    let name = |n: usize| design.components[tree.nodes[n].component].name.clone();
    TreeSummary {
        component: name(node),
        spreads_to: children[node].iter().map(|n| summarise(design, tree, children, *n)).collect(),
        also_touches: tree.dashed.iter().filter(|e| e.nodes[0] == node).map(|e| name(e.nodes[1])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{contact::contacts, sample};
    use crate::design::model::Watch;

    fn liaison() -> (sample::Assembly, Liaison) {
        let a = sample::pattern_wheel();
        let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
        (a, liaison)
    }

    /// Fig. 9: hd_pin, then both wheels, then the alignment pins (and here the unlatch pin), then ring and gear.
    #[test]
    fn the_error_tree_of_the_high_density_pin_is_the_papers() {
        let (_, liaison) = liaison();
        let tree = error_tree(&liaison, 8, None);
        let level =
            |l: u32| -> Vec<usize> { tree.nodes.iter().filter(|n| n.level == l).map(|n| n.component).collect() };
        assert_eq!(level(0), [8]);
        assert_eq!(level(1), [3, 4]);
        assert_eq!(level(2), [5, 6, 7, 9]);
        assert_eq!(level(3), [0, 2]);
        assert_eq!(level(4), [1]);
        let dashed: Vec<_> = tree.dashed.iter().map(|e| e.nodes.map(|n| tree.nodes[n].component)).collect();
        for pin in [5, 6, 7, 9] {
            assert!(dashed.contains(&[4, pin]), "wheel_a2 touches pin {pin} outside the tree");
        }
    }

    #[test]
    fn every_contact_is_a_tree_edge_or_a_dashed_one() {
        let (_, liaison) = liaison();
        for root in 0..liaison.components {
            let tree = error_tree(&liaison, root, None);
            let pairs: usize = (0..liaison.components).map(|c| liaison.neighbours(c).len()).sum::<usize>() / 2;
            assert_eq!(tree.nodes.len(), liaison.components);
            assert_eq!(tree.nodes.len() - 1 + tree.dashed.len(), pairs);
        }
    }

    /// Of the watched components by themselves, of one, of some with and without a depth.
    #[test]
    fn the_levels_of_all_trees_are_the_least_of_each() {
        let (mut a, liaison) = liaison();
        let watches: [&[(usize, Option<u32>)]; 4] =
            [&[], &[(8, None)], &[(5, None), (9, Some(1)), (1, Some(2))], &[(2, Some(0))]];
        for watch in watches {
            if !watch.is_empty() {
                a.design.inspect.watch = watch.iter().map(|&(component, depth)| Watch { component, depth }).collect();
            }
            let mut least: BTreeMap<FaceRef, u32> = BTreeMap::new();
            for node in object_tree(&a.design, &liaison).trees.iter().flat_map(|t| &t.nodes) {
                for face in &node.surfaces {
                    let level = least.entry(*face).or_insert(node.level);
                    *level = node.level.min(*level);
                }
            }
            assert_eq!(levels(&a.design, &liaison), least);
        }
    }

    #[test]
    fn depth_cuts_the_tree_and_its_dashed_edges() {
        let (a, liaison) = liaison();
        let tree = error_tree(&liaison, 8, Some(1));
        assert_eq!(tree.nodes.len(), 3);
        assert!(tree.dashed.is_empty());
        assert_eq!(object_tree(&a.design, &liaison).trees.len(), 9);
        assert_eq!(summary(&a.design, &tree).spreads_to[1].component, "wheel_a2");
    }
}
