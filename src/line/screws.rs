//! W0510: screws whose thread is in nothing.
//!
//! In: the design, its sources and its liaisons. Out: a warning for each placement of a screw of the parts library that no
//! hole of its thread, no nut and no bore holds. Screws that are drawn by hand are parts like any other, and not asked.

use crate::assembly::Analysis;
use crate::assembly::contact::ContactKind;
use crate::design::model::Design;
use crate::diag::{Diagnostic, Sources};
use std::collections::BTreeMap;

/// Files of the parts library with screws.
const SCREWS: [&str; 4] = ["std/iso4762", "std/iso10642", "std/iso4014", "std/iso4017"];
/// Copies named in a note.
const NAMED: usize = 4;

pub(crate) fn loose(design: &Design, sources: &Sources, analysis: &Analysis) -> Vec<Diagnostic> {
    let liaison = &analysis.liaison;
    let is_screw = |component: usize| {
        let part = &design.parts[design.components[component].part];
        let drawn_in = part.features.first().and_then(|f| sources.files.get(f.span.file as usize));
        drawn_in.is_some_and(|(name, _)| SCREWS.contains(&name.as_str()))
    };
    let is_held = |component: usize| liaison.of(component).any(|c| c.kind == ContactKind::Cylinder);
    // One of each placement, and the others.
    let mut found: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
    for component in (0..design.components.len()).filter(|&c| is_screw(c) && !is_held(c)) {
        let span = design.components[component].span;
        found.entry((span.file, span.start)).or_default().push(component);
    }
    let mut placements: Vec<Vec<usize>> = found.into_values().collect();
    placements.sort();
    placements.iter().map(|alike| told(design, analysis, alike)).collect()
}

fn told(design: &Design, analysis: &Analysis, alike: &[usize]) -> Diagnostic {
    let name = |c: usize| format!("`{}`", design.components[c].name);
    let mut beside: Vec<usize> = analysis.liaison.of(alike[0]).map(|c| c.other(alike[0])).collect();
    beside.dedup();
    let beside: Vec<String> = beside.into_iter().map(name).collect();
    let span = design.components[alike[0]].span;
    let others: Vec<String> = alike[1..].iter().map(|&c| name(c)).collect();
    let warning = Diagnostic::warning(
        "W0510",
        span,
        format!("{} holds nothing: its thread is in no part", name(alike[0])),
    )
    .label(match beside.as_slice() {
        [] => "touches nothing".to_string(),
        beside => format!("touches {} only", beside.join(" and ")),
    })
    .help(
        "take a longer one, or give the hole of its thread the major diameter: `cylinder(d = 6 basic, h = 10)` for M6",
    );
    match others.len() {
        0 => warning,
        n if n > NAMED => warning.note(format!("so do {} and {} others", others[..NAMED].join(", "), n - NAMED)),
        1 => warning.note(format!("so does {}", others[0])),
        _ => warning.note(format!("so do {}", others.join(", "))),
    }
}
