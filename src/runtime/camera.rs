//! The camera: a pinhole with radial distortion and vignetting, the same struct for rendering, training and judging.
//!
//! World frame in mm, image frame in px with the origin at the outer corner of the top left pixel, so the centre of
//! that pixel is (0.5, 0.5). Camera frame: x right, y down, z along the view.

use serde::{Deserialize, Serialize};

/// A point or vector in mm.
pub type Vec3 = [f64; 3];

/// Distortion is undone in at most this many rounds, ...
const ROUNDS: usize = 30;
/// ... fewer where one moves less than this (share of the radius), ...
const NOTHING: f64 = 1e-15;
/// ... and never beyond these factors, which no camera of a spec reaches.
const STRETCH: [f64; 2] = [0.2, 5.0];

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Centre of projection in the world (mm).
    pub position: Vec3,
    /// Rows: the camera's x (right), y (down) and z (forward) axes in the world.
    pub axes: [Vec3; 3],
    /// Focal length in px (focal length in mm over pixel pitch).
    pub focal: f64,
    /// Principal point in px.
    pub centre: [f64; 2],
    /// Radial distortion: an undistorted point at r is seen at r (1 + k1 r²), r in units of half the image width.
    pub k1: f64,
    /// The next term: k2 r⁴ is added to k1 r². Left out of files where it is 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub k2: f64,
    /// Image width and height in px.
    pub size: [u32; 2],
}

impl Camera {
    /// A camera at `position` looking at `aim`, the world's z up in the image.
    pub fn look_at(position: Vec3, aim: Vec3, focal: f64, size: [u32; 2]) -> Camera {
        let forward = normalise(sub(aim, position));
        let up = if forward[2].abs() > 0.999_999 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let right = normalise(cross(forward, up));
        let down = cross(forward, right);
        let centre = size.map(|s| f64::from(s) / 2.0);
        Camera { position, axes: [right, down, forward], focal, centre, k1: 0.0, k2: 0.0, size }
    }

    /// Pixel where a world point is seen; `None` behind the camera.
    pub fn project(&self, p: Vec3) -> Option<[f64; 2]> {
        let d = sub(p, self.position);
        let z = dot(self.axes[2], d);
        if z <= 1e-6 {
            return None;
        }
        let scale = self.focal / z;
        let [u, v] = [dot(self.axes[0], d) * scale, dot(self.axes[1], d) * scale];
        let half = self.centre[0];
        let mut stretch = 1.0 + self.k1 * (u * u + v * v) / (half * half);
        if self.k2 != 0.0 {
            stretch += self.k2 * ((u * u + v * v) / (half * half)).powi(2);
        }
        Some([u * stretch + half, v * stretch + self.centre[1]])
    }

    /// Unit direction in the world of the ray through a pixel.
    pub fn ray(&self, pixel: [f64; 2]) -> Vec3 {
        let half = self.centre[0];
        let seen = [pixel[0] - half, pixel[1] - self.centre[1]];
        let stretch = self.stretch((seen[0].powi(2) + seen[1].powi(2)) / (half * half));
        let [u, v] = seen.map(|s| s / stretch / self.focal);
        let [right, down, forward] = self.axes;
        normalise([0, 1, 2].map(|i| right[i] * u + down[i] * v + forward[i]))
    }

    /// By what distortion has moved a place outwards that is seen at a squared radius of `seen` half widths: the root near 1
    /// of `s = 1 + k1 r² + k2 r⁴`, `r² = seen / s²`, by Newton's method.
    fn stretch(&self, seen: f64) -> f64 {
        let mut s = 1.0;
        for _ in 0..ROUNDS {
            let r2 = seen / (s * s);
            let bent = (self.k1 + self.k2 * r2) * r2;
            let steep = 1.0 + 2.0 * (self.k1 + 2.0 * self.k2 * r2) * r2 / s;
            let step = (1.0 + bent - s) / steep;
            // Where the lens folds the picture over there is no such place.
            if step.is_nan() || step.abs() <= NOTHING {
                break;
            }
            s = (s + step).clamp(STRETCH[0], STRETCH[1]);
        }
        s
    }

    /// Where the ray through a pixel meets the plane z = `z`; `None` if it never does.
    pub fn on_plane(&self, pixel: [f64; 2], z: f64) -> Option<Vec3> {
        let d = self.ray(pixel);
        let t = (z - self.position[2]) / d[2];
        (t.is_finite() && t > 0.0).then(|| [0, 1, 2].map(|i| self.position[i] + d[i] * t))
    }

    /// The camera of the same view with `factor` times fewer pixels each way.
    pub fn reduced(&self, factor: u32) -> Camera {
        let by = f64::from(factor);
        let (focal, centre) = (self.focal / by, self.centre.map(|c| c / by));
        Camera { focal, centre, size: self.size.map(|s| s / factor), ..*self }
    }
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// Share of light that a lens lets through to a place (px) of an image of this size: 1 in the middle, 1 - `vignetting` in the
/// corners, falling with the square of the radius.
pub fn let_through(vignetting: f64, size: [u32; 2], place: [f64; 2]) -> f64 {
    let half = size.map(|s| f64::from(s) / 2.0);
    let [x, y] = [place[0] - half[0], place[1] - half[1]];
    1.0 - vignetting * (x * x + y * y) / (half[0] * half[0] + half[1] * half[1])
}

pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn normalise(a: Vec3) -> Vec3 {
    let n = dot(a, a).sqrt();
    a.map(|v| v / n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ray_inverts_project_with_distortion() {
        let mut camera = Camera::look_at([0.0, -155.0, 303.0], [0.0, 0.0, 12.0], 2162.0, [640, 480]);
        camera.k1 = -0.05;
        for p in [[0.0, 0.0, 12.0], [30.0, -20.0, 3.0], [-40.0, 25.0, -4.0]] {
            let pixel = camera.project(p).unwrap();
            let back = camera.on_plane(pixel, p[2]).unwrap();
            assert!(sub(back, p).iter().all(|e| e.abs() < 1e-6), "{p:?} {back:?}");
        }
    }

    #[test]
    fn the_second_term_bends_and_is_undone() {
        let plain = Camera::look_at([0.0, -155.0, 303.0], [0.0, 0.0, 12.0], 2162.0, [640, 480]);
        for (k1, k2) in [(0.0, 0.04), (-0.05, 0.02), (0.03, -0.05), (0.25, 0.0), (-0.15, 0.0), (0.2, 0.2), (-0.2, 0.12)]
        {
            let camera = Camera { k1, k2, ..plain };
            let p = [-48.0, 33.0, 4.0];
            let (bent, straight) = (camera.project(p).unwrap(), plain.project(p).unwrap());
            let r2 = ((straight[0] - 320.0).powi(2) + (straight[1] - 240.0).powi(2)) / 320f64.powi(2);
            let grown = (bent[0] - 320.0) / (straight[0] - 320.0);
            assert!((grown - (1.0 + k1 * r2 + k2 * r2 * r2)).abs() < 1e-12 && r2 > 0.8, "{grown} {r2}");
            let back = camera.on_plane(bent, p[2]).unwrap();
            assert!(sub(back, p).iter().all(|e| e.abs() < 1e-6), "{back:?}");
        }
    }

    #[test]
    fn x_is_right_and_z_is_up_in_the_image() {
        let camera = Camera::look_at([0.0, -155.0, 303.0], [0.0, 0.0, 12.0], 2162.0, [640, 480]);
        let centre = camera.project([0.0, 0.0, 12.0]).unwrap();
        assert!((centre[0] - 320.0).abs() < 1e-9 && (centre[1] - 240.0).abs() < 1e-9);
        assert!(camera.project([1.0, 0.0, 12.0]).unwrap()[0] > centre[0]);
        assert!(camera.project([0.0, 0.0, 13.0]).unwrap()[1] < centre[1]);
    }
}
