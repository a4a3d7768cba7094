//! Matrices: from what `multmatrix` says to where and how a shape of this language stands.
//!
//! In: products of 4 × 4 matrices. Out: a rigid placement, and what the matrix does to the sizes before it. Every rigid
//! motion, any mirror, and scaling along a shape's own axes have a counterpart; shear has none.

/// A rigid motion: `T · Rz · Ry · Rx`, in mm and degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    pub at: [f64; 3],
    pub turn: [f64; 3],
}

/// An affine map, its last row (0, 0, 0, 1) left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Matrix(pub [[f64; 4]; 3]);

/// A matrix taken apart: first the sizes are scaled, and mirrored in x if so, then the shape is turned and moved.
pub struct Parts {
    pub scale: [f64; 3],
    pub mirrored: bool,
    pub rotation: [[f64; 3]; 3],
    pub at: [f64; 3],
}

/// Columns whose cosine is larger than this are not square to each other: OpenSCAD prints six digits.
const SQUARE: f64 = 1e-4;
/// What six printed digits may be off by, as a share of the largest entry.
const PRINTED: f64 = 1e-6;
/// Angles nearer than this (degrees) to a round one are meant to be round.
const ROUND_ANGLE: f64 = 1e-3;

impl Matrix {
    pub const IDENTITY: Matrix = Matrix([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]);

    pub fn translation([x, y, z]: [f64; 3]) -> Matrix {
        Matrix([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]])
    }

    /// `self · inner`
    pub fn then(&self, inner: &Matrix) -> Matrix {
        let cell = |row: usize, column: usize| {
            let sum: f64 = (0..3).map(|k| self.0[row][k] * inner.0[k][column]).sum();
            sum + if column == 3 { self.0[row][3] } else { 0.0 }
        };
        Matrix([0, 1, 2].map(|row| [0, 1, 2, 3].map(|column| cell(row, column))))
    }

    /// The matrix that was meant, where six printed digits are all that keeps it from turning by round angles: corners that
    /// coincide in the design coincide then.
    pub fn tidied(self) -> Matrix {
        let meant = self.parts().map(|parts| {
            let turned = Placement { at: [0.0; 3], ..parts.placed() };
            let signs = [if parts.mirrored { -1.0 } else { 1.0 }, 1.0, 1.0];
            let column = |i: usize| {
                let mut axis = [0.0; 3];
                axis[i] = parts.scale[i] * signs[i];
                turned.point(axis)
            };
            let columns = [0, 1, 2].map(column);
            Matrix([0, 1, 2].map(|row| [columns[0][row], columns[1][row], columns[2][row], self.0[row][3]]))
        });
        let near = |meant: &Matrix| {
            let size = self.0.iter().flat_map(|row| &row[..3]).fold(0.0, |size: f64, v| size.max(v.abs()));
            let apart = self.0.iter().zip(&meant.0).flat_map(|(a, b)| a.iter().zip(b));
            apart.fold(0.0, |most: f64, (a, b)| most.max((a - b).abs())) <= PRINTED * size
        };
        meant.filter(near).unwrap_or(self)
    }

    pub fn point(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        self.0.map(|row| row[0] * x + row[1] * y + row[2] * z + row[3])
    }

    fn column(&self, column: usize) -> [f64; 3] {
        self.0.map(|row| row[column])
    }

    /// Scale, mirror, turn and place; `None` when it shears or flattens.
    pub fn parts(&self) -> Option<Parts> {
        let columns = [0, 1, 2].map(|i| self.column(i));
        let scale = columns.map(|c| dot(c, c).sqrt());
        if scale.iter().any(|s| !s.is_finite() || *s < 1e-9) || self.column(3).iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut unit = [0, 1, 2].map(|i| columns[i].map(|v| v / scale[i]));
        if [(0, 1), (0, 2), (1, 2)].iter().any(|&(a, b)| dot(unit[a], unit[b]).abs() > SQUARE) {
            return None;
        }
        let mirrored = dot(cross(unit[0], unit[1]), unit[2]) < 0.0;
        if mirrored {
            unit[0] = unit[0].map(|v| -v);
        }
        let rotation = [0, 1, 2].map(|row| [unit[0][row], unit[1][row], unit[2][row]]);
        Some(Parts { scale: scale.map(tidy_ratio), mirrored, rotation, at: self.column(3) })
    }
}

impl Parts {
    /// Where a shape stands whose own frame is turned by this rotation and whose origin is at `at`.
    pub fn placed(&self) -> Placement {
        let r = &self.rotation;
        // R = Rz · Ry · Rx: its last row is (-sin y, cos y sin x, cos y cos x).
        let y = (-r[2][0]).clamp(-1.0, 1.0).asin();
        let level = y.cos().abs() > 1e-6;
        let (x, z) = match level {
            true => (r[2][1].atan2(r[2][2]), r[1][0].atan2(r[0][0])),
            false => ((-r[1][2]).atan2(r[1][1]), 0.0),
        };
        Placement { at: self.at, turn: [x, y, z].map(|a| round_angle(a.to_degrees())) }
    }

    /// The same for a shape that is round about its z: no turn about its own axis is needed.
    pub fn placed_axis(&self) -> Placement {
        let axis = self.axis();
        let level = axis[0].hypot(axis[1]);
        let polar = round_angle(level.atan2(axis[2]).to_degrees());
        let azimuth = round_angle(axis[1].atan2(axis[0]).to_degrees());
        let turn = match azimuth {
            _ if polar == 0.0 => [0.0; 3],
            // Over the x axis, as one would turn it by hand.
            90.0 => [-polar, 0.0, 0.0],
            -90.0 => [polar, 0.0, 0.0],
            180.0 | -180.0 => [0.0, -polar, 0.0],
            azimuth => [0.0, polar, azimuth],
        };
        Placement { at: self.at, turn }
    }

    /// The direction of the shape's own z.
    pub fn axis(&self) -> [f64; 3] {
        self.rotation.map(|row| row[2])
    }

    /// The same with the origin moved in the turned frame.
    pub fn moved(&self, by: [f64; 3]) -> Parts {
        let offset = self.rotation.map(|row| dot(row, by));
        Parts { at: [0, 1, 2].map(|i| self.at[i] + offset[i]), rotation: self.rotation, ..*self }
    }

    /// The same turned by half a turn about its own x, so that z points the other way.
    pub fn flipped(&self) -> Parts {
        let rotation = self.rotation.map(|[a, b, c]| [a, -b, -c]);
        Parts { rotation, at: self.at, ..*self }
    }
}

impl Placement {
    /// A point of the shape's own frame.
    pub fn point(&self, p: [f64; 3]) -> [f64; 3] {
        let [a, b, c] = self.turn.map(f64::to_radians);
        let turn = |p: [f64; 3], i: usize, j: usize, angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let mut q = p;
            (q[i], q[j]) = (p[i] * cos - p[j] * sin, p[i] * sin + p[j] * cos);
            q
        };
        let p = turn(turn(turn(p, 1, 2, a), 2, 0, b), 0, 1, c);
        [0, 1, 2].map(|i| p[i] + self.at[i])
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A factor that six printed digits made uneven.
fn tidy_ratio(factor: f64) -> f64 {
    let round = (factor * 1e5).round() / 1e5;
    if (factor - round).abs() < 2e-6 { round } else { factor }
}

fn round_angle(degrees: f64) -> f64 {
    let round = (degrees * 10.0).round() / 10.0;
    let angle = if (degrees - round).abs() < ROUND_ANGLE { round } else { degrees };
    if angle == 0.0 { 0.0 } else { angle }
}
