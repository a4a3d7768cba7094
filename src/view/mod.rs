//! Stage 5b: what a camera sees of each component and face, and the boxes and masks of the nodes.
//!
//! In: bodies in the station's frame, cameras, the faces that matter. Out: item buffers, what is seen of each component,
//! masks of change, the chosen camera. Never shades and never traces a ray: geometry and counting only.

mod blocked;
pub mod choose;
pub mod cover;
pub mod escape;
pub mod item_buffer;
pub mod lock;
pub mod nodes;
pub mod picture;
mod raster;
mod shade;

#[cfg(test)]
mod shapes;
