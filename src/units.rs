//! Units and limits: the words every stage shares.
//!
//! Inside the compiler a length is a number of millimetres and an angle a number of radians; the language's
//! units end at the door of `design`. This file never knows a part, a feature or an image.

use serde::{Deserialize, Serialize};

/// What a dimension measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Quantity {
    /// Millimetres.
    Length,
    /// Radians.
    Angle,
    /// A plain number: a ratio, a count, a grey level.
    Ratio,
    /// Pixels.
    Pixels,
}

/// A range with its nominal value, in the unit of its quantity: `low <= nominal <= high`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    pub low: f64,
    pub nominal: f64,
    pub high: f64,
}

impl Range {
    /// A value that does not vary.
    pub const fn exactly(nominal: f64) -> Self {
        Range { low: nominal, nominal, high: nominal }
    }

    /// `nominal ± deviation`.
    pub fn symmetric(nominal: f64, deviation: f64) -> Self {
        Range { low: nominal - deviation, nominal, high: nominal + deviation }
    }

    /// The limits of a size called `basic` on the drawing. Where both deviations lie on one side of it (a shaft 6 g6 is
    /// never 6 mm), what the shop aims at is the middle of the limits.
    pub fn about(basic: f64, low: f64, high: f64) -> Self {
        let nominal = if (low..=high).contains(&basic) { basic } else { (low + high) / 2.0 };
        Range { low, nominal, high }
    }

    /// Half the width of the range.
    pub fn half_width(&self) -> f64 {
        (self.high - self.low) / 2.0
    }

    /// The value at `u` in 0..=1 between low and high.
    pub fn at(&self, u: f64) -> f64 {
        self.low + (self.high - self.low) * u
    }
}
