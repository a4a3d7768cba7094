//! Stage 2: syntax trees become a design: names, units and limits resolved and checked.
//!
//! In: the name of a spec and a way to read texts. Out: [`model::Design`] with everything in mm and rad, or what is wrong
//! with the spec. Never builds a solid and never opens a file itself.

mod assemble;
mod beside;
mod borrowed;
mod dimension;
mod elsewhere;
pub mod essence;
mod family;
mod feature;
mod fields;
mod hole;
mod interval;
pub mod library;
mod load;
mod material;
mod measure;
pub mod model;
mod outline;
mod part;
mod pattern;
mod per_photo;
mod primitive;
mod profile;
mod resolve;
mod scope;
mod seat;
mod sense;
mod shape;
mod station;
mod sum;
mod survey;
mod task;
mod tolerance;

pub use load::{Loaded, Read, load, path_beside};
pub use survey::{Reading, Survey, survey};
