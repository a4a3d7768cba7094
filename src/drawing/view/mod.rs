//! Axonometric views with hidden lines removed: the assembled and the exploded assembly (Fig. 7 of the paper).
//!
//! In: solids, where they stand, their names. Out: SVG. `lines` takes edges from the B-rep and outlines of curved faces from
//! the triangles' exact normals; `hidden` splits them exactly where a triangle begins or ends to cover them; `label` names
//! the parts beside the drawing; `draw` writes. Wide lines are outlines (one of the two faces is seen), narrow ones edges
//! between two seen faces, as in technical illustration; the narrow chain lines of the exploded view are the paths of insertion.

mod anchor;
mod draw;
mod hidden;
mod label;
mod lines;
mod path;
mod projection;

use crate::assembly::insertion::{self, Insertion};
use crate::assembly::liaison::Liaison;
use crate::assembly::place::place;
use crate::design::model::Design;
use crate::solid::Solid;
use nalgebra::{Isometry3, Translation3};
use std::sync::Arc;

/// One component as it stands in a view.
pub(super) struct Item<'a> {
    pub name: &'a str,
    pub solid: &'a Solid,
    pub pose: Isometry3<f64>,
}

/// The nominal assembly. `solids` holds one solid per component, at nominal.
pub fn assembled(design: &Design, solids: &[Arc<Solid>]) -> String {
    let items = items(design, solids, &place(design, &design.nominal()));
    draw::draw(&format!("{}, assembled", design.name), &items, &[])
}

/// The nominal assembly taken apart along its removal directions, with the paths of insertion. `solids` as above.
pub fn exploded(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison, insertion: &Insertion) -> String {
    let poses = place(design, &design.nominal());
    let shifts = insertion::exploded(insertion, solids, &poses);
    let moved: Vec<Isometry3<f64>> = poses.iter().zip(&shifts).map(|(p, s)| Translation3::from(*s) * p).collect();
    let paths = path::paths(solids, &poses, &shifts, liaison);
    draw::draw(&format!("{}, exploded", design.name), &items(design, solids, &moved), &paths)
}

fn items<'a>(design: &'a Design, solids: &'a [Arc<Solid>], poses: &[Isometry3<f64>]) -> Vec<Item<'a>> {
    let item =
        |((component, solid), pose): ((&'a crate::design::model::Component, &'a Arc<Solid>), &Isometry3<f64>)| Item {
            name: &component.name,
            solid,
            pose: *pose,
        };
    design.components.iter().zip(solids).zip(poses).map(item).collect()
}
