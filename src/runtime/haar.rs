//! The Haar transform's two gradient bands, undecimated, from an integral image.
//!
//! Level l has cells of side s = 2^l px; with the quadrant means a (top left), b (top right), c (bottom left), d (bottom
//! right) of side s/2, H = (b + d - a - c) / 4 and V = (c + d - a - b) / 4. White noise of variance v gives
//! coefficients of variance v / 4^l. The paper uses the same two bands of the decimated transform; undecimated, a part
//! may stand anywhere without its coefficients changing.

use super::grid::Grid;

/// Sums over all pixels above and left: (width + 1) times (height + 1), f64 so that no photo overflows it.
pub struct Integral {
    width: usize,
    sums: Vec<f64>,
}

impl Integral {
    pub fn new(grid: &Grid) -> Integral {
        let width = grid.width + 1;
        let mut sums = vec![0.0; width * (grid.height + 1)];
        for y in 0..grid.height {
            let mut row = 0.0;
            for x in 0..grid.width {
                row += f64::from(grid.at(x, y));
                sums[(y + 1) * width + x + 1] = sums[y * width + x + 1] + row;
            }
        }
        Integral { width, sums }
    }

    /// (H, V) of the cell of side `2 * half` centred on the pixel corner (x, y). The cell must lie inside the image.
    pub fn gradient(&self, x: usize, y: usize, half: usize) -> [f32; 2] {
        let at = |dx: usize, dy: usize| self.sums[(y + dy - half) * self.width + x + dx - half];
        let (m, e) = (half, 2 * half);
        let (s00, s10, s20) = (at(0, 0), at(m, 0), at(e, 0));
        let (s01, s11, s21) = (at(0, m), at(m, m), at(e, m));
        let (s02, s12, s22) = (at(0, e), at(m, e), at(e, e));
        let a = s11 - s10 - s01 + s00;
        let b = s21 - s20 - s11 + s10;
        let c = s12 - s11 - s02 + s01;
        let d = s22 - s21 - s12 + s11;
        let share = 0.25 / (half * half) as f64;
        [((b + d - a - c) * share) as f32, ((c + d - a - b) * share) as f32]
    }

    /// The same of the smallest cell, `half` = 1, straight from the image: most cells are of this size.
    pub fn smallest(grid: &Grid, x: usize, y: usize) -> [f32; 2] {
        let pair = |y: usize| -> [f32; 2] {
            let row = &grid.values[y * grid.width + x - 1..][..2];
            [row[0], row[1]]
        };
        let ([a, b], [c, d]) = (pair(y - 1), pair(y));
        [((b + d) - (a + c)) * 0.25, ((c + d) - (a + b)) * 0.25]
    }

    /// Sum over the pixels from a corner (inclusive) to another (exclusive).
    pub fn between(&self, [x0, y0]: [usize; 2], [x1, y1]: [usize; 2]) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * self.width + x];
        at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)
    }

    /// Sum over the cell of side `2 * half` centred on the pixel corner (x, y).
    pub fn sum(&self, x: usize, y: usize, half: usize) -> f64 {
        let at = |x: usize, y: usize| self.sums[y * self.width + x];
        at(x + half, y + half) - at(x - half, y + half) - at(x + half, y - half) + at(x - half, y - half)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_has_the_slope_times_half_the_cell() {
        let grid = Grid::new(16, 16, (0..256).map(|i| 0.25 * (i % 16) as f32 - 0.5 * (i / 16) as f32).collect());
        let integral = Integral::new(&grid);
        for half in [1, 2, 4] {
            let [h, v] = integral.gradient(8, 7, half);
            assert!((h - 0.25 * half as f32 / 2.0).abs() < 1e-6, "{h}");
            assert!((v + 0.5 * half as f32 / 2.0).abs() < 1e-6, "{v}");
        }
        assert_eq!(Integral::smallest(&grid, 8, 7), integral.gradient(8, 7, 1));
    }

    #[test]
    fn white_noise_of_variance_v_gives_v_over_4_to_the_level() {
        let mut state = 1u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 40) as f32 / (1u64 << 24) as f32 - 0.5) * 12f32.sqrt()
        };
        let n = 256;
        let integral = Integral::new(&Grid::new(n, n, (0..n * n).map(|_| noise()).collect()));
        for (level, half) in [(1, 1), (2, 2), (3, 4)] {
            let mut sum = 0.0;
            let mut count = 0;
            for y in (half..n - half).step_by(2 * half) {
                for x in (half..n - half).step_by(2 * half) {
                    sum += f64::from(integral.gradient(x, y, half)[0]).powi(2);
                    count += 1;
                }
            }
            let expected = 1.0 / 4f64.powi(level);
            let variance = sum / f64::from(count);
            assert!((variance / expected - 1.0).abs() < 4.0 * (2.0 / f64::from(count)).sqrt(), "{level}: {variance}");
        }
    }
}
