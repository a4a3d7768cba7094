//! The direction of view.
//!
//! In: points of the assembly (mm). Out: points of the view: x to the right, y up, z towards the viewer, all in mm, since
//! the projection is parallel and square to the paper.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

/// From where the viewer looks: the angle about z from the x axis, and the height above the xy plane (degrees). A dimetric
/// view, turned a little from the front, so that no pattern of holes lines up with the paper, and flat enough that a tall
/// stack stays readable.
const AZIMUTH: f64 = -68.0;
const ELEVATION: f64 = 28.0;

/// A parallel projection.
pub(super) struct Projection {
    turn: Rotation3<f64>,
}

impl Default for Projection {
    fn default() -> Self {
        let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());
        let towards = Vector3::new(azimuth.cos() * elevation.cos(), azimuth.sin() * elevation.cos(), elevation.sin());
        let right = Vector3::z().cross(&towards).normalize();
        let rows = Matrix3::from_columns(&[right, towards.cross(&right), towards]).transpose();
        Projection { turn: Rotation3::from_matrix_unchecked(rows) }
    }
}

impl Projection {
    pub fn point(&self, p: &Point3<f64>) -> Point3<f64> {
        self.turn * p
    }

    pub fn vector(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.turn * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn up_stays_up_and_lengths_stay() {
        let projection = Projection::default();
        let up = projection.vector(&Vector3::z());
        assert!(up.x.abs() < 1e-12 && up.y > 0.5 && up.z > 0.0);
        let v = projection.vector(&Vector3::new(1.0, 2.0, 3.0));
        assert!((v.norm_squared() - 14.0).abs() < 1e-12);
    }
}
