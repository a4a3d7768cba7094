//! What a window of a photo looks like wherever in it that is.
//!
//! In: the coefficients of windows in some places of one photo. Out: log-likelihoods of such windows where nothing in particular is.
//! Poses are compared by it: each cuts other windows from the photo, and a smooth one fits any template well, so what tells where
//! the assembly stands is by how much its nodes explain their windows better than this does. Never knows a template.

use super::density;
use super::linear;
use super::math;
use std::collections::BTreeMap;
use std::ops::Range;

/// Ratio of a normal variable's median magnitude to its standard deviation.
const MEDIAN_MAGNITUDE: f64 = 0.6745;
/// No photo is smoother (share of full scale).
const SMOOTHEST: f64 = 1e-6;

/// The coefficients of one window.
pub struct Seen<'a> {
    /// Px of the photo in each of the window's.
    pub factor: u32,
    /// Which coefficients belong to each level.
    pub levels: &'a [Range<usize>],
    pub coefficients: &'a [f32],
}

/// By factor and level, the scale of the photo's coefficients.
pub struct Anywhere(BTreeMap<(u32, usize), f64>);

impl Anywhere {
    pub fn of<'a>(windows: impl Iterator<Item = &'a Seen<'a>>) -> Anywhere {
        let mut magnitudes: BTreeMap<(u32, usize), Vec<f32>> = BTreeMap::new();
        for seen in windows {
            for (level, range) in seen.levels.iter().enumerate() {
                let own = magnitudes.entry((seen.factor, level)).or_default();
                own.extend(seen.coefficients[range.clone()].iter().map(|v| v.abs()));
            }
        }
        let scale = |mut all: Vec<f32>| (f64::from(linear::median(&mut all)) / MEDIAN_MAGNITUDE).max(SMOOTHEST);
        Anywhere(magnitudes.into_iter().map(|(key, all)| (key, scale(all))).collect())
    }

    /// Log density of a window's coefficients, up to the constant that a node's densities leave out as well.
    pub fn log_likelihood(&self, seen: &Seen) -> f64 {
        let of = |(level, range): (usize, &Range<usize>)| {
            let scale = self.0.get(&(seen.factor, level)).copied().unwrap_or(SMOOTHEST);
            density::of_scale(&seen.coefficients[range.clone()], scale) - range.len() as f64 * math::ln(scale)
        };
        seen.levels.iter().enumerate().map(of).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An edge that its template explains says more for a place than a smooth window that fits as well as any.
    #[test]
    fn a_smooth_window_proves_nothing() {
        let smooth = [0.004f32, -0.003, 0.002, -0.005, 0.003, 0.004];
        let edge = [0.2f32, -0.003, 0.19, -0.005, 0.21, 0.004];
        let levels = [0..4, 4..6];
        let [smooth, edge, black] =
            [&smooth, &edge, &[0.0; 6]].map(|coefficients| Seen { factor: 1, levels: &levels, coefficients });
        let anywhere = Anywhere::of([&smooth, &edge, &smooth].into_iter());
        let [of_smooth, of_edge] = [&smooth, &edge].map(|seen| anywhere.log_likelihood(seen));
        assert!(of_edge < of_smooth - 10.0, "{of_edge} {of_smooth}");
        let other = Seen { factor: 2, ..edge };
        assert!(anywhere.log_likelihood(&other).is_finite(), "a factor that no window had");
        assert!(Anywhere::of([&black].into_iter()).log_likelihood(&black).is_finite());
    }
}
