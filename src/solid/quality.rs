//! How finely curved edges and faces are sampled.

use super::locus::Locus;
use super::traced::Traced;
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

    /// Parameters of the samples of an arc, both ends included. Inner samples of circles and ellipses lie on whole steps from
    /// parameter 0, so that arcs about one axis agree wherever they start.
    pub(super) fn parameters(&self, locus: &Locus, [a, b]: [f64; 2]) -> Vec<f64> {
        let step = match locus {
            Locus::Line { .. } => return vec![a, b],
            Locus::Traced(curve) => return self.along(curve, a, b),
            Locus::Circle { radius, .. } => TAU / self.steps(*radius) as f64,
            // An ellipse turns fastest at its tips, where its radius is b²/a.
            Locus::Ellipse { major, minor, .. } => {
                let (long, short) = (major.norm().max(minor.norm()), major.norm().min(minor.norm()));
                TAU / (self.steps(long) as f64 * (long / short).sqrt().clamp(1.0, 8.0)).round()
            }
        };
        let first = (a / step + CROWDED).ceil() as i64;
        let last = (b / step - CROWDED).floor() as i64;
        let inner = (first..=last).map(|k| k as f64 * step);
        let mut all: Vec<f64> = std::iter::once(a).chain(inner).chain(std::iter::once(b)).collect();
        if all.len() == 2 && b - a > step {
            all.insert(1, (a + b) / 2.0);
        }
        all
    }

    /// Samples of a traced curve: quarters of its segments, as few as both limits allow.
    fn along(&self, curve: &Traced, a: f64, b: f64) -> Vec<f64> {
        let steps = ((b - a) * QUARTERS).ceil().max(QUARTERS) as usize;
        let place = |k: usize| a + (b - a) * k as f64 / steps as f64;
        let mut all = vec![a];
        let mut from = curve.cubic(a);
        let mut last = from.1;
        for k in 1..steps {
            let here = curve.cubic(place(k + 1));
            let turn = from.1.angle(&here.1).max(last.angle(&here.1));
            let chord = (here.0 - from.0).norm();
            // The height of an arc over its chord is an eighth of chord times turn.
            if turn > self.angle * SPARE || chord * turn / 8.0 > self.chord * SPARE {
                all.push(place(k));
                from = curve.cubic(place(k));
            }
            last = here.1;
        }
        if all.len() == 1 {
            all.push((a + b) / 2.0);
        }
        all.push(b);
        all
    }
}

/// Share of the limits that is used up: what rounding up to powers of two leaves on circles, on average.
const SPARE: f64 = 0.6;
/// Places per segment of a traced curve among which its samples are chosen.
const QUARTERS: f64 = 4.0;

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
