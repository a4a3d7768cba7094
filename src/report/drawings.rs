//! The diagrams and trees of `drawing`, one shown at a time.

use super::Assembly;
use super::html::escaped;
use crate::drawing::tree::{self, Source};
use crate::drawing::{liaison, view};

/// Error trees beyond this many are left out: a page that size is no longer read, and `--emit error-trees` has them all.
const MOST_TREES: usize = 60;

pub fn section(assembly: &Assembly) -> Option<String> {
    let &Assembly { design, solids, trees, .. } = assembly;
    let analysis = assembly.analysis?;
    let source = Source { design, solids, liaison: &analysis.liaison };
    let mut sheets = vec![
        ("Exploded view".to_string(), view::exploded(design, solids, &analysis.liaison, &analysis.insertion)),
        ("Liaison diagram".into(), liaison::svg(design, solids, analysis)),
    ];
    if !trees.is_empty() {
        sheets.push(("Object tree".into(), tree::object_svg(design, trees)));
    }
    for one in trees.iter().take(MOST_TREES) {
        let name = &design.components[one.nodes[0].component].name;
        sheets.push((format!("Error tree of {name}"), tree::svg(&source, one)));
    }
    let options: String = sheets
        .iter()
        .enumerate()
        .map(|(i, (name, _))| format!("<option value=\"{i}\">{}</option>", escaped(name)))
        .collect();
    let more = trees.len().saturating_sub(MOST_TREES);
    let more = if more > 0 { format!("<p>{more} more error trees are not shown.</p>\n") } else { String::new() };
    let sheets: String = sheets.iter().enumerate().map(sheet).collect();
    Some(format!(
        "<p>Which surfaces touch and with which fit, in which order the assembly is put together, and how far an error in \
         one component spreads to others. Pointing at a name shows it above.</p>\n\
         <p><label>Drawing <select id=\"sheets\">{options}</select></label></p>\n{sheets}{more}"
    ))
}

fn sheet((index, (name, svg)): (usize, &(String, String))) -> String {
    let hidden = if index == 0 { "" } else { " hidden" };
    format!(
        "<figure class=\"sheet\" data-sheet=\"{index}\"{hidden}><div class=\"scroll\" tabindex=\"0\" role=\"img\" aria-label=\"{}\">{svg}</div></figure>\n",
        escaped(name)
    )
}
