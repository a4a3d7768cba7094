//! Orientation fields: the direction of every edge of a photo, at one resolution.
//!
//! In: a grey image and its noise. Out: gradients and their directions at every pixel corner, the Haar bands of level 1. They
//! are worked out where they are asked for: a search asks for few of them. Never knows what it looks for.

use super::grid::Grid;
use super::math::length_f32;

/// Gradient directions of a photo at one resolution.
pub struct Field {
    light: Grid,
    /// What is added to a gradient's length before it is divided by it: the noise level.
    floor: f32,
    /// Orientations averaged over 3 x 3 corners, where the field is smooth.
    smooth: Option<Vec<[f32; 2]>>,
    unsigned: bool,
}

/// A vector of the same length at twice the angle: the same for both polarities of an edge.
pub fn doubled([x, y]: [f32; 2]) -> [f32; 2] {
    let length = length_f32(x, y).max(f32::MIN_POSITIVE);
    [(x * x - y * y) / length, 2.0 * x * y / length]
}

/// A vector of the same length at half the angle.
pub fn halved([x, y]: [f32; 2]) -> [f32; 2] {
    // The square root of a complex number, brought to length: its larger part from the length, the other from the product.
    let length = length_f32(x, y);
    let large = ((length + x.abs()) / 2.0).sqrt();
    let small = if large > 0.0 { y.abs() / (2.0 * large) } else { 0.0 };
    let (cos, sin) = if x < 0.0 { (small, large) } else { (large, small) };
    [cos, sin.copysign(y)].map(|v| v * length.sqrt())
}

impl Field {
    /// Orientations of `light`, whose noise has standard deviation `noise`; `smooth` averages orientations over 3 x 3 px so
    /// that a coarse grid of poses cannot step over an edge; of `unsigned` edges only the line counts, not its sign.
    pub fn new(light: Grid, noise: f64, smooth: bool, unsigned: bool) -> Field {
        let floor = (3.0 * noise / 2.0).max(1e-6) as f32;
        let mut field = Field { light, floor, smooth: None, unsigned };
        if smooth {
            let (width, height) = (field.width(), field.height());
            let all: Vec<[f32; 2]> = (0..width * height).map(|i| field.sharp(i % width, i / width)).collect();
            field.smooth = Some(smoothed(&all, width, height));
        }
        field
    }

    /// Number of pixel corners in a row.
    fn width(&self) -> usize {
        self.light.width + 1
    }

    fn height(&self) -> usize {
        self.light.height + 1
    }

    /// H and V of the cell of side 2 round a pixel corner; zero on the border.
    fn gradient(&self, x: usize, y: usize) -> [f32; 2] {
        if x == 0 || y == 0 || x >= self.light.width || y >= self.light.height {
            return [0.0; 2];
        }
        let k = (y - 1) * self.light.width + x - 1;
        let (above, below) = (&self.light.values[k..k + 2], &self.light.values[k + self.light.width..][..2]);
        let (falling, rising) = (below[1] - above[0], above[1] - below[0]);
        [0.25 * (falling + rising), 0.25 * (falling - rising)]
    }

    /// Gradient at a corner, divided by its length plus the noise level; of unsigned edges at twice its angle.
    fn sharp(&self, x: usize, y: usize) -> [f32; 2] {
        let g = self.gradient(x, y);
        let length = (g[0] * g[0] + g[1] * g[1]).sqrt() + self.floor;
        let unit = [g[0] / length, g[1] / length];
        if self.unsigned { doubled(unit) } else { unit }
    }

    /// The corner nearest to a point (field px); `None` outside the image.
    fn nearest(&self, at: [f64; 2]) -> Option<[usize; 2]> {
        let (x, y) = (at[0] + 0.5, at[1] + 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width() as f64 && y < self.height() as f64;
        inside.then_some([x as usize, y as usize])
    }

    /// Agreement of a unit direction with the orientation at a point (field px); 0 outside the image.
    pub(super) fn agreement(&self, at: [f64; 2], direction: [f32; 2]) -> f32 {
        let Some([x, y]) = self.nearest(at) else { return 0.0 };
        let o = self.smooth.as_ref().map_or_else(|| self.sharp(x, y), |all| all[y * self.width() + x]);
        let direction = if self.unsigned { doubled(direction) } else { direction };
        o[0] * direction[0] + o[1] * direction[1]
    }

    /// Gradient at the pixel corner nearest to a point; `None` outside.
    pub fn gradient_at(&self, at: [f64; 2]) -> Option<[f32; 2]> {
        self.nearest(at).map(|[x, y]| self.gradient(x, y))
    }

    /// Distance along the normal to the steepest edge of the right polarity within reach, sub-pixel, and its agreement.
    pub fn nearest_edge(&self, at: [f64; 2], direction: [f32; 2], reach: f64) -> Option<(f64, f32)> {
        const STEP: f64 = 0.5;
        let steps = (reach / STEP).round() as i32;
        let point = |t: f64| [at[0] + t * f64::from(direction[0]), at[1] + t * f64::from(direction[1])];
        let slopes: Option<Vec<f32>> =
            (-steps..=steps).map(|i| self.slope(point(f64::from(i) * STEP), direction)).collect();
        let slopes = slopes?;
        let best = (0..slopes.len()).max_by(|&a, &b| slopes[a].total_cmp(&slopes[b]))?;
        if best == 0 || best + 1 == slopes.len() {
            return None;
        }
        let [a, b, c] = [slopes[best - 1], slopes[best], slopes[best + 1]].map(f64::from);
        let bend = a - 2.0 * b + c;
        let shift = if bend < 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
        let distance = (best as f64 - f64::from(steps) + shift) * STEP;
        let agreement = self.agreement(point(distance), direction);
        Some((distance, agreement))
    }

    /// Gradient across an edge, bilinear, without its sign where edges have none; `None` outside.
    pub(super) fn slope(&self, at: [f64; 2], direction: [f32; 2]) -> Option<f32> {
        let (x, y) = (at[0], at[1]);
        if !(x >= 0.0 && y >= 0.0 && x < self.light.width as f64 && y < self.light.height as f64) {
            return None;
        }
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let across = |x: usize, y: usize| {
            let g = self.gradient(x, y);
            g[0] * direction[0] + g[1] * direction[1]
        };
        let along = |y: usize| {
            let left = across(i, y);
            left + (across(i + 1, y) - left) * fx
        };
        let (top, bottom) = (along(j), along(j + 1));
        let slope = top + (bottom - top) * fy;
        Some(if self.unsigned { slope.abs() } else { slope })
    }
}

fn smoothed(field: &[[f32; 2]], width: usize, height: usize) -> Vec<[f32; 2]> {
    let mut out = vec![[0.0; 2]; field.len()];
    for y in 1..height.saturating_sub(1) {
        for x in 1..width - 1 {
            let mut sum = [0.0f32; 2];
            for k in [y - 1, y, y + 1].map(|j| j * width + x - 1) {
                for o in &field[k..k + 3] {
                    sum = [sum[0] + o[0], sum[1] + o[1]];
                }
            }
            out[y * width + x] = sum.map(|s| s / 9.0);
        }
    }
    out
}
