//! Stage 2: a parsed file becomes a design: names, units and limits resolved and checked.

pub mod model;
