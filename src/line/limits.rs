//! The parts at their limits: between reading a design and putting it together.
//!
//! In: a design. Out: each part's solids at nominal, MMC and LMC; or what is wrong with them: E0403 where a part has another
//! shape at a limit, W0402 where a cut takes nothing away.

use crate::assembly::piece::Workshop;
use crate::design::model::{Design, Extent, Feature, Op, Part, Shape};
use crate::diag::Diagnostic;
use crate::solid::{Quality, Solid};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Of every part its solids at nominal, MMC and LMC.
pub(crate) type Shapes = Vec<[Arc<Solid>; 3]>;

/// Every part at nominal, with triangles, and its boundary at MMC and LMC. A part that has other faces at its limits than at nominal is an error: it would be
/// another part (E0403).
pub(super) fn shapes(design: &Design, workshop: &mut Workshop) -> Result<Shapes, Vec<Diagnostic>> {
    let limits @ [nominal, mmc, lmc] = &[design.nominal(), design.mmc(), design.lmc()];
    let (mut shapes, mut faults) = (Vec::new(), Vec::new());
    let mut compared = BTreeSet::new();
    let pieces: Vec<_> = design.parts.iter().map(|part| (part, nominal.as_slice())).collect();
    let bare: Vec<_> = design.parts.iter().flat_map(|part| [(part, mmc.as_slice()), (part, lmc)]).collect();
    workshop.prepare(&pieces, &bare, &Quality::default());
    for part in &design.parts {
        match at_limits(part, limits, workshop) {
            Ok(solids) => {
                // Pieces that are alike are compared once.
                if compared.insert(solids.each_ref().map(Arc::as_ptr)) {
                    faults.extend(changed(part, &solids));
                }
                shapes.push(solids);
            }
            // Pieces of one part have its faults in common.
            Err(found) => found.into_iter().for_each(|fault| {
                if !faults.contains(&fault) {
                    faults.push(fault);
                }
            }),
        }
    }
    if faults.is_empty() { Ok(shapes) } else { Err(faults) }
}

fn at_limits(
    part: &Part,
    [nominal, mmc, lmc]: &[Vec<f64>; 3],
    workshop: &mut Workshop,
) -> Result<[Arc<Solid>; 3], Vec<Diagnostic>> {
    let quality = Quality::default();
    let limit = |faults: Vec<Diagnostic>, name: &str| -> Vec<Diagnostic> {
        faults.into_iter().map(|fault| fault.note(format!("at {name}, not at nominal"))).collect()
    };
    let solid = workshop.solid(part, nominal, &quality)?;
    let mut at = |values: &[f64], name: &str| workshop.boundary(part, values, &quality).map_err(|f| limit(f, name));
    Ok([solid, at(mmc, "MMC")?, at(lmc, "LMC")?])
}

/// W0402: cuts that take nothing away. A cut that leaves no face is tried without, as long as there are few of them.
pub(crate) fn idle_cuts(design: &Design, shapes: &[[Arc<Solid>; 3]]) -> Vec<Diagnostic> {
    /// Parts that are made once more, at most.
    const TRIALS: usize = 20;
    let (nominal, mut trials) = (design.nominal(), 0);
    let (mut seen, mut found) = (BTreeSet::new(), Vec::new());
    for (part, [solid, ..]) in design.parts.iter().zip(shapes).filter(|(part, _)| seen.insert(&part.name)) {
        let shown: BTreeSet<&str> = solid.faces.iter().filter_map(|f| f.name.split('.').next()).collect();
        for (i, feature) in part.features.iter().enumerate().filter(|(_, f)| f.op == Op::Cut) {
            let mut idle = |copy: &usize| {
                let suspect = !shown.contains(copy_name(feature, *copy).as_str()) && trials < TRIALS;
                trials += usize::from(suspect);
                suspect && is_idle(part, i, *copy, &nominal, solid.volume)
            };
            let copies: Vec<usize> = (0..feature.copies.len()).filter(|copy| idle(copy)).collect();
            found.extend(takes_nothing(part, feature, &copies, &nominal, solid));
        }
    }
    found
}

/// Whether a part is the same without one copy of a cut.
fn is_idle(part: &Part, feature: usize, copy: usize, nominal: &[f64], volume: f64) -> bool {
    /// Of the volume: below it is rounding.
    const NOTHING: f64 = 1e-9;
    let mut without = part.clone();
    without.features[feature].copies.remove(copy);
    if without.features[feature].copies.is_empty() {
        without.features.remove(feature);
    }
    let solid = crate::solid::boundary(&without, nominal, &Quality::default());
    solid.is_ok_and(|solid| (solid.volume - volume).abs() <= NOTHING * volume)
}

fn copy_name(feature: &Feature, copy: usize) -> String {
    if feature.patterned { format!("{}[{}]", feature.name, copy + 1) } else { feature.name.clone() }
}

fn takes_nothing(
    part: &Part,
    feature: &Feature,
    copies: &[usize],
    nominal: &[f64],
    solid: &Solid,
) -> Option<Diagnostic> {
    let (&copy, others) = copies.split_first()?;
    let first = copy_name(feature, copy);
    let message = match others.len() {
        0 => format!("`{first}` takes nothing from `{}`", part.name),
        n => format!("`{first}` and {n} more of `{}` take nothing from `{}`", feature.name, part.name),
    };
    let off = off_by(part, feature, copy, nominal, solid).unwrap_or_default();
    let warning = Diagnostic::warning("W0402", feature.span, message);
    Some(warning.label(format!("meets no material at nominal{off}")).help("check where it stands, or remove it"))
}

/// `: it stands 3.00 mm from `slab.top``, of a cut that is a body by itself.
fn off_by(part: &Part, feature: &Feature, copy: usize, nominal: &[f64], solid: &Solid) -> Option<String> {
    /// Of what is nearer it is said that it touches (mm).
    const TOUCHING: f64 = 0.005;
    fn is_endless(shape: &Shape) -> bool {
        match shape {
            Shape::Box { z: h, .. } | Shape::Cylinder { h, .. } | Shape::Cone { h, .. } | Shape::Prism { h, .. } => {
                matches!(h, Extent::Through)
            }
            Shape::Group { features } => {
                features.iter().flat_map(|feature| &feature.copies).any(|copy| is_endless(&copy.shape))
            }
            Shape::Sphere { .. } | Shape::Torus { .. } | Shape::Revolve { .. } => false,
        }
    }
    let copy = feature.copies[copy].clone();
    if is_endless(&copy.shape) {
        return None;
    }
    let alone = Feature { op: Op::Add, patterned: false, copies: vec![copy], ..feature.clone() };
    let alone = Part { features: vec![alone], ..part.clone() };
    let tool = crate::solid::evaluate(&alone, nominal, &Quality::default()).ok()?;
    let (distance, face) = crate::assembly::apart(&tool, solid)?;
    let near = face.unwrap_or(&part.name);
    Some(match distance < TOUCHING {
        true => format!(": it only touches `{near}`"),
        false => format!(": it stands {distance:.2} mm from `{near}`"),
    })
}

/// E0403: which face comes or goes within tolerance.
fn changed(part: &Part, [nominal, mmc, lmc]: &[Arc<Solid>; 3]) -> Option<Diagnostic> {
    let names = |solid: &Solid| -> BTreeSet<String> { solid.faces.iter().map(|f| f.name.clone()).collect() };
    let own = names(nominal);
    let at = |limit: &str, solid: &Solid| -> Option<(String, Option<String>)> {
        let there = names(solid);
        let named = |face: Option<&String>, text: &dyn Fn(&str) -> String| face.map(|f| (text(f), Some(f.clone())));
        let gone = named(own.difference(&there).next(), &|f| format!("at {limit} the face `{f}` is gone"));
        let came =
            named(there.difference(&own).next(), &|f| format!("at {limit} there is a face `{f}` that nominal has not"));
        let count = (nominal.faces.len(), solid.faces.len());
        let more = (count.0 != count.1).then(|| format!("nominal has {} faces, {limit} has {}", count.0, count.1));
        gone.or(came).or(more.map(|more| (more, None)))
    };
    let (what, face) = at("MMC", mmc).or_else(|| at("LMC", lmc))?;
    let message = format!("`{}` changes its shape within tolerance: {what}", part.name);
    let fault = Diagnostic::error("E0403", part.span, message).label("not one shape but several").note(
        "an inspector is trained on one shape; keep walls and steps wider than their tolerances, or tighten these",
    );
    let owner = |f: &&Feature| face.as_ref().is_some_and(|face| face.split(['.', '[']).next() == Some(&f.name));
    Some(match part.features.iter().find(owner) {
        Some(feature) => fault.also(feature.span, format!("`{}` comes or goes", face.as_deref().unwrap_or_default())),
        None => fault,
    })
}
