//! A grey image: rows of linear values, with the few operations that judging needs.

/// Width times height values, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub width: usize,
    pub height: usize,
    pub values: Vec<f32>,
}

impl Grid {
    /// # Panics
    /// When the number of values is not width times height.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Grid {
        assert_eq!(values.len(), width * height, "a grid of {width} x {height}");
        Grid { width, height, values }
    }

    pub fn filled(width: usize, height: usize, value: f32) -> Grid {
        Grid { width, height, values: vec![value; width * height] }
    }

    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// The mean of every `factor` by `factor` block; incomplete blocks at the right and bottom are dropped.
    pub fn reduced(&self, factor: usize) -> Grid {
        if factor == 1 {
            return self.clone();
        }
        let (width, height) = (self.width / factor, self.height / factor);
        let share = 1.0 / (factor * factor) as f32;
        let mut values = Vec::with_capacity(width * height);
        // Down the columns first: that is where the work is, and it vectorises.
        let mut sums = vec![0.0f32; width * factor];
        for y in 0..height {
            sums.fill(0.0);
            for row in self.values[y * factor * self.width..].chunks(self.width.max(1)).take(factor) {
                sums.iter_mut().zip(row).for_each(|(sum, v)| *sum += v);
            }
            values.extend(sums.chunks_exact(factor).map(|block| block.iter().sum::<f32>() * share));
        }
        Grid { width, height, values }
    }

    /// A smooth image of `size` px whose means over `factor` by `factor` blocks are this one's px: what a finer sensor might
    /// have seen. Px beyond the last block continue it.
    pub fn magnified(&self, factor: usize, size: [usize; 2]) -> Grid {
        /// Bilinear interpolation loses a little of every block's mean; so many rounds give it back.
        const ROUNDS: usize = 3;
        let by = 1.0 / factor as f64;
        let smooth = |coarse: &Grid| {
            let mut values = Vec::with_capacity(size[0] * size[1]);
            let within = |v: usize, count: usize| ((v as f64 + 0.5) * by).clamp(0.5, count as f64 - 0.5);
            for y in 0..size[1] {
                let at = |x: usize| [within(x, coarse.width), within(y, coarse.height)];
                values.extend((0..size[0]).map(|x| coarse.sample(at(x)).unwrap_or(0.0)));
            }
            Grid::new(size[0], size[1], values)
        };
        let mut full = smooth(self);
        for _ in 0..if factor > 1 { ROUNDS } else { 0 } {
            let mut lost = self.clone();
            lost.values.iter_mut().zip(&full.reduced(factor).values).for_each(|(v, seen)| *v -= seen);
            full.values.iter_mut().zip(&smooth(&lost).values).for_each(|(v, back)| *v += back);
        }
        full
    }

    /// Bilinear value at a point in px (the centre of the first pixel is (0.5, 0.5)); `None` outside the pixel centres.
    // Windows are cut by this: as a call of its own it takes twice as long.
    #[inline(always)]
    pub fn sample(&self, point: [f64; 2]) -> Option<f32> {
        let (x, y) = (point[0] - 0.5, point[1] - 0.5);
        let inside = x >= 0.0 && y >= 0.0 && x <= (self.width - 1) as f64 && y <= (self.height - 1) as f64;
        if !inside {
            return None;
        }
        let (i, j) = ((x as usize).min(self.width.saturating_sub(2)), (y as usize).min(self.height.saturating_sub(2)));
        let (fx, fy) = ((x - i as f64) as f32, (y - j as f64) as f32);
        let (right, down) = (usize::from(self.width > 1), if self.height > 1 { self.width } else { 0 });
        let k = j * self.width + i;
        let v = &self.values;
        let top = v[k] + (v[k + right] - v[k]) * fx;
        let bottom = v[k + down] + (v[k + down + right] - v[k + down]) * fx;
        Some(top + (bottom - top) * fy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampling_a_ramp_is_exact_and_stops_at_the_border() {
        let grid = Grid::new(4, 3, (0..12).map(|i| (i % 4) as f32 + 10.0 * (i / 4) as f32).collect());
        assert_eq!(grid.sample([1.75, 1.0]), Some(1.25 + 5.0));
        assert_eq!(grid.sample([3.5, 2.5]), Some(23.0));
        assert_eq!(grid.sample([0.4, 1.0]), None);
        assert_eq!(grid.sample([3.6, 1.0]), None);
    }

    #[test]
    fn magnifying_keeps_the_mean_of_every_block() {
        let edge = |i: usize| if (i % 9) * 2 + i / 9 > 9 { 0.8 } else { 0.1 };
        let coarse = Grid::new(9, 7, (0..63).map(edge).collect());
        let full = coarse.magnified(4, [36, 28]);
        let back = full.reduced(4);
        let off = back.values.iter().zip(&coarse.values).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(off < 0.03, "{off}");
        // Smooth: nowhere does one px jump as the blocks do.
        let jump = full.values.windows(2).enumerate().filter(|(i, _)| i % 36 != 35).map(|(_, w)| (w[1] - w[0]).abs());
        assert!(jump.fold(0.0, f32::max) < 0.4);
        assert_eq!(coarse.magnified(1, [9, 7]), coarse);
    }

    #[test]
    fn reducing_averages_blocks() {
        let grid = Grid::new(4, 2, vec![1.0, 3.0, 0.0, 0.0, 5.0, 7.0, 0.0, 4.0]);
        assert_eq!(grid.reduced(2).values, vec![4.0, 1.0]);
    }
}
