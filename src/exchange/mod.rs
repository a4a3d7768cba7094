//! What other programs read: the parts and the assembly as STEP (exact) and as glTF (triangles).
//!
//! In: a [`Kit`]: solids with names and colours, and where they stand. Out: the bytes of files. Never changes a solid,
//! never writes a file itself; the same kit gives the same bytes.

pub mod gltf;
pub mod step;

mod colour;
mod cut;
mod json;
mod part21;
mod polar;
mod seam;
mod skin;
mod track;

use crate::assembly::place::place;
use crate::design::model::Design;
use crate::solid::Solid;
use nalgebra::Isometry3;
use std::sync::Arc;

pub use colour::Paint;

/// A part as drawn.
#[derive(Debug, Clone)]
pub struct KitPart {
    /// As in the spec; one of several that differ at nominal is numbered: `pin_2`.
    pub name: String,
    pub solid: Arc<Solid>,
    pub paint: Paint,
}

/// A component: a part at its place.
#[derive(Debug, Clone)]
pub struct Placed {
    /// `alignment_pin[2]`
    pub name: String,
    /// Index into [`Kit::parts`].
    pub part: usize,
    /// From the part's frame to the assembly's, mm.
    pub pose: Isometry3<f64>,
}

/// An assembly with its parts, each part once.
#[derive(Debug, Clone)]
pub struct Kit {
    pub name: String,
    pub parts: Vec<KitPart>,
    pub placed: Vec<Placed>,
}

impl Kit {
    /// The nominal assembly. `solids` has one nominal solid per component; components whose part has the same name and
    /// the same shape share one entry of [`Kit::parts`].
    pub fn new(design: &Design, solids: &[Arc<Solid>]) -> Kit {
        let mut kit = Kit { name: design.name.clone(), parts: Vec::new(), placed: Vec::new() };
        let poses = place(design, &design.nominal());
        for ((component, solid), pose) in design.components.iter().zip(solids).zip(poses) {
            let part = &design.parts[component.part];
            let paint = Paint::of(&design.materials[part.material]);
            let part = kit.shelve(&part.name, solid, paint);
            kit.placed.push(Placed { name: component.name.clone(), part, pose });
        }
        kit
    }

    /// The entry of a part, a new one if there is none like it.
    fn shelve(&mut self, name: &str, solid: &Arc<Solid>, paint: Paint) -> usize {
        let same = |p: &KitPart| is_piece_of(&p.name, name) && p.paint == paint && alike(&p.solid, solid);
        if let Some(found) = self.parts.iter().position(same) {
            return found;
        }
        let namesakes = self.parts.iter().filter(|p| is_piece_of(&p.name, name)).count();
        let name = if namesakes == 0 { name.into() } else { format!("{name}_{}", namesakes + 1) };
        self.parts.push(KitPart { name, solid: solid.clone(), paint });
        self.parts.len() - 1
    }
}

/// Whether an entry is of the part `name`: named so, or so with a number.
fn is_piece_of(entry: &str, name: &str) -> bool {
    let rest = entry.strip_prefix(name);
    rest.is_some_and(|r| r.is_empty() || r.strip_prefix('_').is_some_and(|n| n.parse::<u32>().is_ok()))
}

fn alike(a: &Arc<Solid>, b: &Arc<Solid>) -> bool {
    Arc::ptr_eq(a, b) || (a.surfaces == b.surfaces && a.vertices == b.vertices && a.volume == b.volume)
}
