//! The runtime: a model and a photo become a verdict.
//!
//! An island: it knows nothing of the compiler and builds alone with `--no-default-features`.

mod anywhere;
pub mod calibrate;
pub mod camera;
pub mod density;
pub mod embed;
pub mod field;
mod follow;
pub mod grid;
mod haar;
pub mod inspect;
pub mod joint;
pub mod judge;
pub mod light;
pub mod linear;
pub mod locate;
mod look;
mod math;
pub mod model;
pub mod parts;
pub mod photo;
pub mod pose;
mod regain;
pub mod report;
pub mod rig;
pub mod rise;
pub mod row;
pub mod settle;
pub mod sight;
pub mod strange;
pub mod window;
