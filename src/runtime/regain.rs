//! The pose once more, from where the nodes fit.
//!
//! In: a pose, and how far from it every node fits best in whatever state it is likeliest in. Out: the pose that brings them
//! together, and how far it moves them. Edges can be had by a shadow, or by the grain of wood; what the nodes look like is a
//! second opinion. Never looks at an image, and never says whether the new pose is the better one.

use super::camera::{Camera, Vec3};
use super::linear;
use super::pose::Pose;
use super::settle::LEAST_OTHERS;

/// Steps of the robust fit.
const ROUNDS: usize = 5;
/// A node that is off by so many of its standard deviations counts half.
const ROBUST: f64 = 2.0;

/// Where one node fits best.
pub struct Fit {
    /// Its middle (mm, assembly frame).
    pub at: Vec3,
    /// How far from where the pose has it (px of the photo).
    pub off: [f64; 2],
    /// Standard deviation of that by its tolerances (px of the photo).
    pub spread: [f64; 2],
}

/// The pose within `standing` (ranges of x, y, z, rz) to which the nodes point, by robust least squares, and the root mean square
/// of what it moves them by (px). `None` where they are too few to outvote one that is misplaced, or say nothing.
pub fn corrected(pose: &Pose, camera: &Camera, standing: &[[f64; 2]; 4], fits: &[Fit]) -> Option<(Pose, f64)> {
    if fits.len() <= LEAST_OTHERS {
        return None;
    }
    let free: Vec<usize> = (0..4).filter(|&i| standing[i][1] - standing[i][0] > 1e-9).collect();
    let motions = fits.iter().map(|fit| motion(pose, camera, &free, fit.at)).collect::<Option<Vec<_>>>()?;
    let moved = |step: &[f64], node: usize, axis: usize| -> f64 {
        motions[node].iter().zip(step).map(|(per, by)| per[axis] * by).sum()
    };
    let mut step = vec![0.0; free.len()];
    for _ in 0..ROUNDS {
        let n = free.len();
        let (mut normal, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        for (i, &axis) in free.iter().enumerate() {
            // Anywhere in its range is as likely before the nodes are asked.
            normal[i * n + i] = (standing[axis][1] - standing[axis][0]).powi(-2);
        }
        for (node, fit) in fits.iter().enumerate() {
            let left = [0, 1].map(|axis| (fit.off[axis] - moved(&step, node, axis)) / fit.spread[axis]);
            let robust = 1.0 / (1.0 + (left[0].powi(2) + left[1].powi(2)) / (ROBUST * ROBUST));
            for axis in 0..2 {
                let weight = robust / fit.spread[axis].powi(2);
                for (i, a) in motions[node].iter().enumerate() {
                    right[i] += weight * a[axis] * fit.off[axis];
                    for (j, b) in motions[node].iter().enumerate() {
                        normal[i * n + j] += weight * a[axis] * b[axis];
                    }
                }
            }
        }
        step = linear::solve_spd(&normal, &right)?;
    }
    let mut array = pose.to_array();
    free.iter().zip(&step).for_each(|(&axis, by)| array[axis] += by);
    let squares = (0..fits.len()).flat_map(|node| [0, 1].map(|axis| moved(&step, node, axis).powi(2)));
    let motion = (squares.sum::<f64>() / fits.len() as f64).sqrt();
    motion.is_finite().then(|| (Pose::from_array(array).held(standing), motion))
}

/// By how many px a point moves in the photo per mm or rad of every free axis; `None` where the camera does not see it.
fn motion(pose: &Pose, camera: &Camera, free: &[usize], at: Vec3) -> Option<Vec<[f64; 2]>> {
    /// Small against every range, large against rounding (mm, rad).
    const STEP: f64 = 1e-5;
    let here = camera.project(pose.apply(at))?;
    let along = |&axis: &usize| {
        let mut array = pose.to_array();
        array[axis] += STEP;
        let there = camera.project(Pose::from_array(array).apply(at))?;
        Some([0, 1].map(|k| (there[k] - here[k]) / STEP))
    };
    free.iter().map(along).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STANDING: [[f64; 2]; 4] = [[-5.0, 5.0], [-5.0, 5.0], [0.0, 0.0], [-0.2, 0.2]];

    /// Six nodes seen from 200 mm above at 5 px per mm, as they would appear at `there` while they are looked for at `here`.
    fn seen(here: &Pose, there: &Pose) -> (Camera, Vec<Fit>) {
        let camera = Camera::look_at([0.0, 0.0, 200.0], [0.0, 0.0, 0.0], 1000.0, [640, 480]);
        let fit = |i: usize| {
            let at = [15.0 * (i % 3) as f64 - 15.0, 20.0 * (i / 3) as f64 - 10.0, 2.0 * i as f64];
            let [p, q] = [here, there].map(|pose| camera.project(pose.apply(at)).unwrap());
            Fit { at, off: [q[0] - p[0], q[1] - p[1]], spread: [1.5; 2] }
        };
        (camera, (0..6).map(fit).collect())
    }

    #[test]
    fn nodes_bring_the_pose_to_where_they_are() {
        let here = Pose { x: 0.5, y: -0.3, z: 0.0, rz: 0.02 };
        let there = Pose { x: 2.1, y: -1.4, z: 0.0, rz: 0.05 };
        let (camera, fits) = seen(&here, &there);
        let (found, motion) = corrected(&here, &camera, &STANDING, &fits).unwrap();
        assert!((found.x - there.x).abs() < 0.03 && (found.y - there.y).abs() < 0.03, "{found:?}");
        assert!((found.rz - there.rz).abs() < 2e-3 && found.z == 0.0, "{found:?}");
        assert!((motion - 9.8).abs() < 0.5, "5 px/mm and 1.94 mm: {motion}");
        assert!(corrected(&here, &camera, &STANDING, &fits[..3]).is_none(), "one of three may be misplaced");
    }

    #[test]
    fn one_misplaced_part_moves_nothing_much() {
        let here = Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 };
        let (camera, mut fits) = seen(&here, &here);
        fits[0].off = [12.0, 0.0];
        let (_, motion) = corrected(&here, &camera, &STANDING, &fits).unwrap();
        assert!(motion < 1.0, "{motion}");
    }

    #[test]
    fn what_cannot_stand_there_is_held_back() {
        let here = Pose { x: 4.9, y: 0.0, z: 0.0, rz: 0.0 };
        let (camera, fits) = seen(&here, &Pose { x: 9.0, ..here });
        let (found, _) = corrected(&here, &camera, &STANDING, &fits).unwrap();
        assert!((found.x - 6.0).abs() < 1e-9, "{found:?}");
    }
}
