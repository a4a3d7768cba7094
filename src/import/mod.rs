//! Brings what others have: an OpenSCAD design becomes a part of this language.
//!
//! In: the text of a `.csg` file, which is what `openscad -o part.csg part.scad` makes of any design: solids, booleans and
//! matrices, nothing else. Out: the text of a part that says the same in cylinders, boxes and outlines, with general
//! tolerances to refine; or what stands in the way, by line and name. Never a part that means something else: what has no
//! counterpart here is refused. It neither reads a file nor evaluates a solid.

mod csg;
mod feature;
mod flat;
mod flush;
mod lower;
mod pattern;
mod placement;
mod snap;
mod write;

use crate::diag::Diagnostic;

/// The part that `text`, the text of a `.csg` file called `file`, draws; `name` is what it is to be called. Bodies that stand
/// apart become a part each: `name_1`, `name_2`.
pub fn openscad(text: &str, file: &str, name: &str) -> Result<String, Vec<Diagnostic>> {
    let nodes = csg::parse(text)?;
    let parts = lower::parts(&nodes)?;
    let parts: Vec<_> = parts.into_iter().map(|steps| flush::marked(pattern::folded(snap::snapped(steps)))).collect();
    write::parts(&parts, file, name)
}
