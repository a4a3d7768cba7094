//! Directions: the vector type of the renderer, frames round a normal, and sines that are the same on every machine.
//!
//! The renderer works in `f32` millimetres of the station's frame. The system's `sin` and `cos` differ in the last bit
//! between processors; images have to be the same bytes everywhere, so what the renderer needs of them is here.

/// A point, direction or displacement of the renderer: mm or dimensionless.
pub(super) type Vec3 = nalgebra::Vector3<f32>;

/// A right-handed orthonormal frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl Frame {
    /// The frame round a unit normal (Duff et al. 2017, "Building an orthonormal basis, revisited").
    pub fn around(z: Vec3) -> Frame {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Frame {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// The frame round a unit normal whose x runs along `x` as far as the surface lets it; any where `x` has no direction in the
    /// surface.
    pub fn along(z: Vec3, x: Vec3) -> Frame {
        let x = x - z * z.dot(&x);
        let length = x.norm();
        if length.is_nan() || length <= 1e-6 {
            return Frame::around(z);
        }
        let x = x / length;
        Frame { x, y: z.cross(&x), z }
    }

    pub fn to_local(self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(&v), self.y.dot(&v), self.z.dot(&v))
    }

    pub fn to_world(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

/// (sine, cosine) of `turns` full turns, |turns| below a million; Taylor series on an eighth of a turn, error below 1e-6.
pub(super) fn sine_cosine(turns: f32) -> (f32, f32) {
    let quarter = (turns * 4.0).round();
    let r = (turns - quarter * 0.25) * std::f32::consts::TAU;
    let q = r * r;
    let sine = r * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0 - q / 362_880.0))));
    let cosine = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0 - q / 40_320.0)));
    match (quarter as i32).rem_euclid(4) {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// A direction about +z with density cos θ / π.
pub(super) fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (sine, cosine) = sine_cosine(u[1]);
    let radius = u[0].sqrt();
    Vec3::new(radius * cosine, radius * sine, (1.0 - u[0]).max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_agree_with_the_library() {
        for i in -400..400 {
            let turns = i as f32 * 0.012_345;
            let (s, c) = sine_cosine(turns);
            let angle = f64::from(turns) * std::f64::consts::TAU;
            assert!((f64::from(s) - angle.sin()).abs() < 2e-6 && (f64::from(c) - angle.cos()).abs() < 2e-6, "{turns}");
        }
    }

    #[test]
    fn frames_are_orthonormal_also_at_the_poles() {
        let normals = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.48, 0.6, 0.64]].map(Vec3::from);
        let along = Vec3::new(3.0, -7.0, 2.0);
        let frames = normals.map(|z| [Frame::around(z), Frame::along(z, along), Frame::along(z, z * 4.0)]);
        for frame in frames.into_iter().flatten() {
            assert!(frame.x.dot(&frame.y).abs() < 1e-6 && frame.x.dot(&frame.z).abs() < 1e-6);
            assert!((frame.x.cross(&frame.y) - frame.z).norm() < 1e-6);
            let v = Vec3::new(0.3, -0.2, 0.9);
            assert!((frame.to_world(frame.to_local(v)) - v).norm() < 1e-6);
        }
        assert!((Frame::along(normals[3], along).to_local(along).y).abs() < 1e-5);
    }
}
