//! Stage 4: solids and poses become contacts, liaisons, error trees, an insertion order and error modes.
//!
//! In: a [`Design`] and one nominal solid per component. Out: an [`Analysis`] and diagnostics; from these the error trees,
//! the object tree and the error modes with the poses they lead to. Never renders, never decides what can be seen.

pub mod contact;
pub mod error_tree;
pub mod fault;
pub mod flip;
pub mod insertion;
pub mod liaison;
pub mod measure;
pub mod piece;
pub mod place;
pub mod shift;
pub mod sink;
pub mod tilt;
pub mod turn;

mod blocking;
mod body;
mod boxes;
mod check;
mod columns;
mod explode;
mod loose;
mod matching;
mod meeting;
mod overlap;
mod play;
mod rest;
mod room;
#[cfg(test)]
pub(crate) mod sample;
mod sides;
mod silhouette;
mod squeeze;
mod stack;
mod tangent;
mod tight;

pub(crate) use check::apart;

use crate::design::model::Design;
use crate::diag::Diagnostic;
use crate::solid::Solid;
use std::sync::Arc;

/// What the assembly is, as opposed to what its parts are.
#[derive(Debug, Clone, PartialEq)]
pub struct Analysis {
    pub liaison: liaison::Liaison,
    pub insertion: insertion::Insertion,
    /// In the order of [`Design::measures`], those left out that are wrong.
    pub measures: Vec<measure::Measured>,
}

/// Contacts, liaisons and insertion order at nominal, and what is wrong with them (E0501, W0502, E0503) or with its
/// measures (E0506, W0507, E0508, E0509).
/// `solids` holds one solid per component at nominal, in its part's frame.
pub fn analyse(design: &Design, solids: &[Arc<Solid>]) -> (Analysis, Vec<Diagnostic>) {
    let found = contact::find(design, solids);
    let liaison = liaison::Liaison::with_tangents(design.components.len(), found.contacts, found.tangents);
    let (insertion, entering) = insertion::take_apart(design, solids, &liaison);
    let (clashes, squeezed) = (&found.clashes, &found.squeezed);
    let seen = check::Seen { liaison: &liaison, clashes, squeezed, entering: &entering, tight: &found.tight };
    let mut diagnostics = check::check(design, solids, &seen);
    let (measures, faults) = measure::measures(design, solids);
    diagnostics.extend(faults);
    (Analysis { liaison, insertion, measures }, diagnostics)
}
