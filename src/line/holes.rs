//! W0411: holes that go the wrong way, or begin below the face they are drilled into.
//!
//! In: the design and its parts at nominal. Out: a warning for each hole whose clearance above its mouth ends in material.
//! Only what is written as a hole is looked at: a cylinder that is cut stands as it is drawn.

use crate::design::model::{Design, Feature, Op, Shape};
use crate::diag::Diagnostic;
use crate::solid::Solid;
use std::collections::BTreeSet;
use std::sync::Arc;

pub(crate) fn upside_down(design: &Design, shapes: &[[Arc<Solid>; 3]]) -> Vec<Diagnostic> {
    let (mut seen, mut found) = (BTreeSet::new(), Vec::new());
    for (part, [solid, ..]) in design.parts.iter().zip(shapes).filter(|(part, _)| seen.insert(&part.name)) {
        let faces: BTreeSet<&str> = solid.faces.iter().map(|f| f.name.as_str()).collect();
        for feature in part.features.iter().filter(|f| f.op == Op::Cut && is_hole(f)) {
            let name = |copy: usize| match feature.patterned {
                true => format!("{}[{}]", feature.name, copy + 1),
                false => feature.name.clone(),
            };
            // The end of its clearance is a face of the part.
            let capped =
                |name: &String| ["bore", "head"].iter().any(|of| faces.contains(format!("{name}.{of}.top").as_str()));
            let copies: Vec<String> = (0..feature.copies.len()).map(name).filter(capped).collect();
            found.extend(told(&part.name, feature, &copies));
        }
    }
    found
}

/// A hole is a group whose features stand in one statement.
fn is_hole(feature: &Feature) -> bool {
    feature.copies.iter().all(|copy| match &copy.shape {
        Shape::Group { features } => {
            features.first().is_some_and(|f| f.name == "bore") && features.iter().all(|f| f.span == feature.span)
        }
        _ => false,
    })
}

fn told(part: &str, feature: &Feature, copies: &[String]) -> Option<Diagnostic> {
    let (first, others) = copies.split_first()?;
    let message = match others.len() {
        0 => format!("`{first}` cuts into `{part}` above its mouth"),
        n => format!("`{first}` and {n} more of `{}` cut into `{part}` above their mouths", feature.name),
    };
    let warning = Diagnostic::warning("W0411", feature.span, message).label("goes down from its place");
    Some(warning.help("`at` is the place of its mouth, on the face it is drilled into"))
}
