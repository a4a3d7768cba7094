//! Files for other programs, by the names they get beside the model: `NAME.step`, `NAME.parts/PART.step`, `NAME.glb`.
//!
//! In: the nominal assembly. Out: names and bytes. What is in the files is the business of [`crate::exchange`].

use crate::assembly::Analysis;
use crate::assembly::insertion;
use crate::design::model::Design;
use crate::exchange::{Kit, KitPart, gltf, step};
use crate::solid::Solid;
use std::sync::Arc;

/// A file by the last part of its name.
type Named = (String, Vec<u8>);

/// The assembly and, in a folder, each of its parts as STEP.
pub fn step(design: &Design, solids: &[Arc<Solid>]) -> Vec<Named> {
    let kit = Kit::new(design, solids);
    let part = |p: &KitPart| (format!("parts/{}.step", p.name), step::part(p).into_bytes());
    let whole = ("step".to_string(), step::assembly(&kit).into_bytes());
    std::iter::once(whole).chain(kit.parts.iter().map(part)).collect()
}

/// The assembly as it stands and as the exploded view shows it, as binary glTF.
pub fn gltf(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> Vec<Named> {
    let kit = Kit::new(design, solids);
    let poses: Vec<_> = kit.placed.iter().map(|c| c.pose).collect();
    let shifts = insertion::exploded(&analysis.insertion, solids, &poses);
    vec![("glb".into(), gltf::assembly(&kit, &[])), ("exploded.glb".into(), gltf::assembly(&kit, &shifts))]
}
