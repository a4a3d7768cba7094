//! Blessed stage outputs and how new ones are compared with them.
//!
//! In: what was blessed and what the compiler makes now, texts in RON and small pictures. Out: where they differ, by path and
//! with both values. Numbers may differ by the tolerances that the blessed text states, everything else must be equal;
//! layout and comments count for nothing. Never touches the file system.

mod compare;
mod lines;
pub mod pictures;
mod tolerance;
mod tree;

pub use compare::{Allowed, Difference, Settled, settle};
pub use lines::unified;
pub use tolerance::{PictureTolerance, Tolerance, Tolerances, Unclear, head, usual};

/// Larger goldens are refused: nobody would review them (bytes).
pub const LARGEST: usize = 20 << 10;
