//! A design without what its geometry does not depend on: what digests of later stages are taken of.
//!
//! In: a design. Out: the same design with names, stations, measures and training left out, so that renaming a part or a
//! `let`, or another station, changes no digest. Spans never count: they are not serialised.

use super::model::{Design, Inspect};
use crate::units::Range;

/// Parts, components, dimensions, materials and watched components; nothing else, and no name that carries no meaning.
pub fn essence(design: &Design) -> Design {
    let mut bare = design.clone();
    bare.name.clear();
    bare.measures.clear();
    bare.stations.clear();
    bare.train.images = 0;
    bare.train.seed = 0;
    bare.train.levels = 0;
    bare.train.samples = 0;
    bare.inspect = Inspect { false_reject: 0.0, ..bare.inspect };
    bare.parts.iter_mut().for_each(|part| part.name.clear());
    bare.materials.iter_mut().for_each(|material| material.name.clear());
    bare.components.iter_mut().for_each(|component| component.name.clear());
    bare.dims.iter_mut().for_each(|dim| dim.name.clear());
    bare
}

/// Whether a dimension is the same in every draw, so that its name (which names the stream of its draws) counts for nothing.
pub fn is_exact(range: &Range) -> bool {
    range.low == range.high
}
