//! gonogo compiles a text file that describes a mechanical assembly into an inspector for it.

#[cfg(feature = "compile")]
pub mod diag;
#[cfg(feature = "compile")]
pub mod iso;
#[cfg(feature = "compile")]
pub mod rng;
#[cfg(feature = "compile")]
pub mod units;

#[cfg(feature = "compile")]
pub mod assembly;
#[cfg(feature = "compile")]
pub mod design;
#[cfg(feature = "compile")]
pub mod render;
#[cfg(feature = "compile")]
pub mod scene;
#[cfg(feature = "compile")]
pub mod solid;
#[cfg(feature = "compile")]
pub mod syntax;
#[cfg(feature = "compile")]
pub mod variation;
#[cfg(feature = "compile")]
pub mod view;

#[cfg(feature = "compile")]
pub mod train;

pub mod runtime;
