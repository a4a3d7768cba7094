//! Following edges: robust least squares from edge points to the parameters that move them.
//!
//! In: an orientation field, edge points and how they move with the parameters. Out: the parameters, to a fraction of a px.
//! Never decides which edges to follow.

use super::camera::Camera;
use super::field::Field;
use super::linear;
use super::locate::EdgePoint;
use super::pose::Pose;

/// Search along the edge normal in the fine field's px: first and last reach.
const FIRST_REACH: f64 = 3.0;
const LAST_REACH: f64 = 1.25;
/// Scale of the robust weight on the distance to an edge (fine px).
const ROBUST_SCALE: f64 = 0.5;
/// Standard deviation of one edge point's position (fine px): measurement noise of the calibration's least squares.
pub(super) const EDGE_SIGMA: f64 = 0.7;
/// Agreement an edge must have to count.
const LEAST_AGREEMENT: f32 = 0.5;

/// One edge point's wish: how far the image of the point should move along its normal, how that motion depends on the
/// parameters, and how much the wish counts.
pub(super) struct Pull {
    distance: f64,
    gradient: Vec<f64>,
    weight: f64,
}

pub(super) struct View<'a> {
    pub(super) field: &'a Field,
    pub(super) camera: &'a Camera,
}

impl View<'_> {
    /// `seen_at` tells for parameters where points are seen.
    pub(super) fn pulls<Seen: Fn(&EdgePoint) -> Option<[f64; 2]>>(
        &self,
        points: &[(EdgePoint, f64)],
        reach: f64,
        parameters: &[f64],
        seen_at: impl Fn(&[f64]) -> Seen,
        pose: &Pose,
    ) -> Vec<Pull> {
        /// Small against every parameter's range, large against rounding: mm, rad or shares.
        const STEP: f64 = 1e-5;
        let stood = pose.stood();
        let seen = seen_at(parameters);
        let step = |i: usize| {
            let mut moved = parameters.to_vec();
            moved[i] += STEP;
            seen_at(&moved)
        };
        let seen_moved: Vec<Seen> = (0..parameters.len()).map(step).collect();
        points
            .iter()
            .filter_map(|(point, trust)| {
                let (at, direction) = point.seen_as(self.camera, &stood)?;
                let (distance, agreement) = self.field.nearest_edge(at, direction, reach)?;
                if agreement <= LEAST_AGREEMENT {
                    return None;
                }
                let along = |p: [f64; 2]| p[0] * f64::from(direction[0]) + p[1] * f64::from(direction[1]);
                let here = along(seen(point)?);
                let slope = |moved: &Seen| Some((along(moved(point)?) - here) / STEP);
                let gradient = seen_moved.iter().map(slope).collect::<Option<Vec<f64>>>()?;
                let robust = 1.0 / (1.0 + (distance / ROBUST_SCALE).powi(2));
                Some(Pull { distance, gradient, weight: f64::from(agreement) * robust * trust })
            })
            .collect()
    }
}

/// Gauss and Newton with priors: `rounds` steps from `start`, pulled back to 0 with their `spread`.
pub(super) fn follow(
    start: Vec<f64>,
    spread: &[f64],
    rounds: usize,
    pulls: impl Fn(&[f64], f64) -> Vec<Pull>,
) -> Vec<f64> {
    let n = spread.len();
    let mut parameters = start;
    for round in 0..rounds {
        let t = round as f64 / rounds.saturating_sub(1).max(1) as f64;
        let pulls = pulls(&parameters, FIRST_REACH + (LAST_REACH - FIRST_REACH) * t);
        let mut a = vec![0.0; n * n];
        let mut b = vec![0.0; n];
        let scale = 1.0 / (EDGE_SIGMA * EDGE_SIGMA);
        for pull in &pulls {
            for i in 0..n {
                let gi = pull.gradient[i] * pull.weight * scale;
                b[i] += gi * pull.distance;
                for j in 0..n {
                    a[i * n + j] += gi * pull.gradient[j];
                }
            }
        }
        for i in 0..n {
            let precision = 1.0 / (spread[i] * spread[i]);
            a[i * n + i] += precision;
            b[i] -= parameters[i] * precision;
        }
        let Some(step) = linear::solve_spd(&a, &b) else { break };
        parameters.iter_mut().zip(&step).for_each(|(p, s)| *p += s);
    }
    parameters
}
