//! What lies anew in every photo, where the spec says so: exposure and blur.
//!
//! In: a range and whether the spec writes it. Out: a value per photo. What is not written keeps its nominal value, and
//! serialises as the bare range, as ever.

use crate::units::Range;
use serde::{Serialize, Serializer};

/// A range that acts only where the spec writes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PerPhoto {
    pub range: Range,
    /// Whether the spec writes it, and as more than one value.
    pub varies: bool,
}

impl PerPhoto {
    /// A value that does not vary.
    pub const fn exactly(nominal: f64) -> PerPhoto {
        PerPhoto { range: Range::exactly(nominal), varies: false }
    }

    /// The value of a photo whose draw is `u` in 0..=1.
    pub fn at(&self, u: f64) -> f64 {
        if self.varies { self.range.at(u) } else { self.range.nominal }
    }

    /// The half width as a share of the nominal value, which is positive; 0 where nothing varies.
    pub fn half_share(&self) -> f64 {
        if self.varies { self.range.half_width() / self.range.nominal } else { 0.0 }
    }
}

/// A written range is told from a bare one: who writes what is usual means it, and gets another model.
impl Serialize for PerPhoto {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.varies {
            serializer.serialize_newtype_variant("PerPhoto", 1, "PerPhoto", &self.range)
        } else {
            self.range.serialize(serializer)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL: Range = Range { low: 0.95, nominal: 1.0, high: 1.05 };

    #[test]
    fn only_what_is_written_acts_and_is_told_apart() {
        let usual = PerPhoto { range: USUAL, varies: false };
        let written = PerPhoto { range: USUAL, varies: true };
        assert_eq!((usual.at(0.0), usual.at(1.0), usual.half_share()), (1.0, 1.0, 0.0));
        assert_eq!((written.at(0.0), written.at(1.0)), (0.95, 1.05));
        assert!((written.half_share() - 0.05).abs() < 1e-12);
        let text = |of: &PerPhoto| ron::to_string(of).unwrap();
        assert_eq!(text(&usual), ron::to_string(&USUAL).unwrap());
        assert_eq!(text(&written), format!("PerPhoto({})", ron::to_string(&USUAL).unwrap()));
    }
}
