//! How finely curved edges and faces are sampled.

use super::locus::Locus;
use std::f64::consts::{PI, TAU};

/// Limits on the samples of circles; both hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Largest distance of a chord from its arc, in mm.
    pub chord: f64,
    /// Largest angle of a chord, in rad.
    pub angle: f64,
}

impl Default for Quality {
    /// Good for pictures of 50 mm parts: 128 chords round a ø50 rim, 64 round a pin.
    fn default() -> Self {
        Quality { chord: 0.01, angle: TAU / 64.0 }
    }
}

/// Fewest and most chords of a whole circle.
const STEPS: (usize, usize) = (16, 4096);
/// A regular sample nearer than this share of a step to an arc's end is left out.
const CROWDED: f64 = 0.25;

impl Quality {
    /// Chords of a whole circle: 16 times a power of two, so that concentric circles have their samples at common angles.
    pub(super) fn steps(&self, radius: f64) -> usize {
        let sagitta = PI / (1.0 - (self.chord / radius).clamp(0.0, 1.0)).acos();
        let wanted = sagitta.max(TAU / self.angle).ceil();
        // A zero or senseless limit asks for more than the most.
        let wanted = if wanted < STEPS.1 as f64 { wanted as usize } else { STEPS.1 };
        let mut steps = STEPS.0;
        while steps < wanted {
            steps *= 2;
        }
        steps
    }

    /// Parameters of the samples of an arc, both ends included. Inner samples lie on whole steps from parameter 0, so
    /// that arcs about one axis agree wherever they start.
    pub(super) fn parameters(&self, locus: &Locus, [a, b]: [f64; 2]) -> Vec<f64> {
        let Locus::Circle { radius, .. } = locus else { return vec![a, b] };
        let step = TAU / self.steps(*radius) as f64;
        let first = (a / step + CROWDED).ceil() as i64;
        let last = (b / step - CROWDED).floor() as i64;
        let inner = (first..=last).map(|k| k as f64 * step);
        let mut all: Vec<f64> = std::iter::once(a).chain(inner).chain(std::iter::once(b)).collect();
        if all.len() == 2 && b - a > step {
            all.insert(1, (a + b) / 2.0);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn chords_stay_within_both_limits() {
        let q = Quality::default();
        for radius in [0.5, 2.0, 10.0, 28.0, 200.0] {
            let turn = TAU / q.steps(radius) as f64;
            assert!(turn <= q.angle + 1e-12 && radius * (1.0 - (turn / 2.0).cos()) <= q.chord, "{radius}");
        }
    }

    #[test]
    fn samples_ascend_and_keep_their_distance_from_the_ends() {
        let circle = Locus::circle(Point3::origin(), Vector3::z_axis(), 10.0);
        let q = Quality::default();
        let step = TAU / q.steps(10.0) as f64;
        for [a, b] in [[0.0, TAU], [0.3, 0.31], [6.1, 6.9], [0.0999 * step, 3.9 * step]] {
            let t = q.parameters(&circle, [a, b]);
            assert_eq!((t[0], t[t.len() - 1]), (a, b));
            assert!(t.windows(2).all(|w| w[1] - w[0] > 0.2 * step.min(b - a) && w[1] - w[0] < 1.3 * step), "{t:?}");
        }
    }
}
