//! Where the assembly stands, and how the camera really hangs.

use super::camera::{Camera, Vec3, cross, dot, normalise};
use super::math::sin_cos;
use super::model::{Install, Station};
use serde::{Deserialize, Serialize};

/// Part of a standing range beyond its ends that a pose may lie: the ranges are a promise, not a law.
const MARGIN: f64 = 0.1;

/// The assembly on the station: x, y, z in mm, turn about the plate's normal in rad.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub rz: f64,
}

impl Pose {
    pub fn from_array([x, y, z, rz]: [f64; 4]) -> Pose {
        Pose { x, y, z, rz }
    }

    pub fn to_array(self) -> [f64; 4] {
        [self.x, self.y, self.z, self.rz]
    }

    /// The middle of the ranges in which the assembly may stand.
    pub fn home(station: &Station) -> Pose {
        Pose::from_array(station.standing.map(|[low, high]| (low + high) / 2.0))
    }

    /// The nearest pose at which the assembly can stand: a little beyond the ranges (of x, y, z, rz) at most.
    #[must_use]
    pub fn held(self, standing: &[[f64; 2]; 4]) -> Pose {
        let mut array = self.to_array();
        for (value, [low, high]) in array.iter_mut().zip(standing) {
            let margin = (high - low) * MARGIN;
            *value = value.clamp(low - margin, high + margin);
        }
        Pose::from_array(array)
    }

    /// Assembly frame to station frame.
    pub fn apply(&self, p: Vec3) -> Vec3 {
        self.stood().apply(p)
    }

    /// The pose with its turn worked out, for many points.
    pub fn stood(&self) -> Stood {
        Stood { pose: *self, turn: sin_cos(self.rz) }
    }

    /// Station frame to assembly frame.
    pub fn invert(&self, p: Vec3) -> Vec3 {
        let (s, c) = sin_cos(self.rz);
        let [x, y] = [p[0] - self.x, p[1] - self.y];
        [c * x + s * y, -s * x + c * y, p[2] - self.z]
    }
}

/// An assembly that stands somewhere.
#[derive(Debug, Clone, Copy)]
pub struct Stood {
    pose: Pose,
    /// Sine and cosine.
    turn: (f64, f64),
}

impl Stood {
    /// Assembly frame to station frame.
    pub fn apply(&self, p: Vec3) -> Vec3 {
        let (Pose { x, y, z, .. }, (s, c)) = (self.pose, self.turn);
        [c * p[0] - s * p[1] + x, s * p[0] + c * p[1] + y, p[2] + z]
    }
}

/// How the camera differs from where the spec says: offset (mm), small turns about its own axes (rad), focal length (share)
/// and distortion.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Installation {
    pub offset: Vec3,
    pub turn: Vec3,
    pub focal: f64,
    pub k1: f64,
}

impl Installation {
    /// Numbers in the order of [`Installation::from_array`].
    pub fn to_array(self) -> [f64; 8] {
        let ([a, b, c], [d, e, f]) = (self.offset, self.turn);
        [a, b, c, d, e, f, self.focal, self.k1]
    }

    pub fn from_array([a, b, c, d, e, f, focal, k1]: [f64; 8]) -> Installation {
        Installation { offset: [a, b, c], turn: [d, e, f], focal, k1 }
    }

    /// The camera as it really is.
    pub fn apply(&self, camera: &Camera) -> Camera {
        let position = [0, 1, 2].map(|i| camera.position[i] + self.offset[i]);
        let [right, down, forward] = camera.axes;
        let turned = |v: Vec3| -> Vec3 {
            let w = [0, 1, 2].map(|i| self.turn[0] * right[i] + self.turn[1] * down[i] + self.turn[2] * forward[i]);
            let d = cross(w, v);
            [0, 1, 2].map(|i| v[i] + d[i])
        };
        let forward = normalise(turned(forward));
        let right = turned(right);
        let along = dot(right, forward);
        let right = normalise([0, 1, 2].map(|i| right[i] - along * forward[i]));
        let axes = [right, cross(forward, right), forward];
        Camera { position, axes, focal: camera.focal * (1.0 + self.focal), k1: camera.k1 + self.k1, ..*camera }
    }

    /// Whether a camera could hang like this; what is read from a file may be anything.
    pub fn is_likely(&self) -> bool {
        let within = |values: &[f64], most: f64| values.iter().all(|v| v.abs() <= most);
        within(&self.offset, 1e4) && within(&self.turn, 1.0) && within(&[self.focal], 0.5) && within(&[self.k1], 10.0)
    }

    /// Standard deviations of the numbers of [`Installation::to_array`] for uniform errors within the stated half-widths.
    pub fn spread(install: &Install) -> [f64; 8] {
        let uniform = |half: f64| half.max(1e-9) / 3f64.sqrt();
        let (p, a) = (uniform(install.position_mm), uniform(install.angle_rad));
        let k1 = uniform((install.k1[1] - install.k1[0]) / 2.0);
        [p, p, p, a, a, a, uniform(install.focal_share), k1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_invert() {
        let pose = Pose { x: 3.0, y: -1.0, z: 0.5, rz: 0.3 };
        let p = [10.0, -4.0, 7.0];
        let back = pose.invert(pose.apply(p));
        assert!((0..3).all(|i| (back[i] - p[i]).abs() < 1e-12));
    }

    #[test]
    fn a_pose_is_held_near_where_it_may_stand() {
        let standing = [[-5.0, 5.0], [0.0, 1.0], [2.0, 2.0], [-0.2, 0.2]];
        let held = Pose { x: 7.0, y: -0.05, z: 3.0, rz: -0.1 }.held(&standing);
        assert_eq!(held, Pose { x: 6.0, y: -0.05, z: 2.0, rz: -0.1 });
    }

    #[test]
    fn an_installed_camera_keeps_square_axes() {
        let camera = Camera::look_at([0.0, -155.0, 303.0], [0.0, 0.0, 12.0], 2162.0, [640, 480]);
        let error = Installation { offset: [1.0, -1.0, 0.5], turn: [0.004, -0.006, 0.005], focal: 0.004, k1: -0.01 };
        let moved = error.apply(&camera);
        for i in 0..3 {
            for j in 0..3 {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((dot(moved.axes[i], moved.axes[j]) - expected).abs() < 1e-12);
            }
        }
        assert_eq!(Installation::default().apply(&camera).project([3.0, 4.0, 5.0]), camera.project([3.0, 4.0, 5.0]));
    }
}
