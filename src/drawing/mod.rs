//! Pictures of what the assembly stage found: diagrams, trees and views, as text in SVG, DOT and JSON.
//!
//! In: a design, its solids, its analysis and its error trees. Out: self-contained files that a report takes as they are:
//! black on white, colour only for the class of a fit, nothing drawn outside the `viewBox`. The same input gives the same
//! bytes. Never decides anything about the assembly, and never reads a picture back.

pub mod dot;
pub mod json;
pub mod liaison;
pub mod svg;
pub mod tree;
pub mod view;

mod ink;
mod spread;

#[cfg(test)]
mod tests;
