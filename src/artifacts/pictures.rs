//! Diagrams, trees and views for people and for other programs, beside the RON of the same name.
//!
//! In: the outputs of the assembly stage. Out: files by name: `liaison.svg`, `liaison.dot`, `liaison.json`, and so on; a file
//! per watched component in `error_trees/`. Never read back by any stage.

use super::Artifact;
use crate::assembly::error_tree::ErrorTree;
use crate::assembly::{Analysis, liaison};
use crate::design::model::Design;
use crate::drawing::json::json;
use crate::drawing::tree::Source;
use crate::drawing::{self, tree, view};
use crate::solid::Solid;
use std::sync::Arc;

/// A file's name and its content.
pub type File = (String, Vec<u8>);

/// `liaison.json`, `liaison.svg`, `liaison.dot`. `solids` here and below: one per component, at nominal.
pub fn liaison(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> Vec<File> {
    let stem = Artifact::Liaison.stem();
    vec![
        file(&stem, "json", json(&liaison::summary(design, solids, &analysis.liaison))),
        file(&stem, "svg", drawing::liaison::svg(design, solids, analysis)),
        file(&stem, "dot", drawing::liaison::dot(design, solids, analysis)),
    ]
}

/// `error_trees.json`, and in `error_trees/` an SVG and a DOT file per watched component.
pub fn error_trees(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis, trees: &[ErrorTree]) -> Vec<File> {
    let source = Source { design, solids, liaison: &analysis.liaison };
    let stem = Artifact::ErrorTrees.stem();
    let data: Vec<_> = trees.iter().map(|t| tree::data(&source, t)).collect();
    let mut files = vec![file(&stem, "json", json(&data))];
    for tree in trees {
        let stem = format!("{stem}/{}", file_name(&design.components[tree.nodes[0].component].name));
        files.push(file(&stem, "svg", tree::svg(&source, tree)));
        files.push(file(&stem, "dot", tree::dot(&source, tree)));
    }
    files
}

/// `object_tree.json`, `object_tree.svg`, `object_tree.dot`.
pub fn object_tree(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis, trees: &[ErrorTree]) -> Vec<File> {
    let source = Source { design, solids, liaison: &analysis.liaison };
    let stem = Artifact::ObjectTree.stem();
    vec![
        file(&stem, "json", json(&tree::object_data(&source, trees))),
        file(&stem, "svg", tree::object_svg(design, trees)),
        file(&stem, "dot", tree::object_dot(design, trees)),
    ]
}

/// `exploded.svg` and `assembled.svg`.
pub fn exploded(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> Vec<File> {
    let exploded = view::exploded(design, solids, &analysis.liaison, &analysis.insertion);
    vec![file(&Artifact::Exploded.stem(), "svg", exploded), file("assembled", "svg", view::assembled(design, solids))]
}

fn file(stem: &str, ending: &str, text: String) -> File {
    (format!("{stem}.{ending}"), text.into_bytes())
}

/// `alignment_pin[2]` as `alignment_pin.2`: brackets mean something to shells, and no name has a point.
fn file_name(component: &str) -> String {
    component.replace('[', ".").replace(']', "")
}
