//! The runtime: a model and a photo become a verdict.
//!
//! An island: it knows nothing of the compiler and builds alone with `--no-default-features`.

pub mod camera;
