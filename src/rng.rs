//! Random streams keyed by purpose.
//!
//! A stream is named by (seed, purpose, index) and yields the same numbers on every machine and at any thread
//! count; an edit in one place of a spec does not reshuffle the draws of another. Counter-based: the n-th number is
//! a strong mix of the key and n, so neighbouring streams are not shifted copies of each other.

/// A stream of random numbers.
#[derive(Debug, Clone)]
pub struct Stream {
    key: u64,
    counter: u64,
}

impl Stream {
    /// The stream of `purpose` number `index` under `seed`.
    pub fn new(seed: u64, purpose: &str, index: u64) -> Self {
        let mut key = mix(seed ^ 0x9e37_79b9_7f4a_7c15);
        for byte in purpose.bytes() {
            key = mix(key ^ u64::from(byte).wrapping_mul(0x0100_0000_01b3));
        }
        Stream { key: mix(key ^ mix(index)), counter: 0 }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.counter = self.counter.wrapping_add(1);
        mix(self.key ^ mix(self.counter))
    }

    /// Uniform in 0..1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in low..high.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let u = 1.0 - self.uniform();
        let v = self.uniform();
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Triangular on low..high with its mode at `mode`.
    pub fn triangular(&mut self, low: f64, mode: f64, high: f64) -> f64 {
        if high <= low {
            return low;
        }
        let u = self.uniform();
        let split = (mode - low) / (high - low);
        if u < split {
            low + ((high - low) * (mode - low) * u).sqrt()
        } else {
            high - ((high - low) * (high - mode) * (1.0 - u)).sqrt()
        }
    }
}

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014).
fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_with_different_names_are_unrelated() {
        let n = 4000;
        let mut a = Stream::new(1, "pose", 0);
        let mut b = Stream::new(1, "pose", 1);
        let product: f64 = (0..n).map(|_| (a.uniform() - 0.5) * (b.uniform() - 0.5)).sum::<f64>() / n as f64;
        assert!(product.abs() < 4.0 / 12.0 / (n as f64).sqrt());
    }

    #[test]
    fn normal_has_unit_variance() {
        let mut s = Stream::new(7, "normal", 0);
        let n = 20_000;
        let v: f64 = (0..n).map(|_| s.normal().powi(2)).sum::<f64>() / n as f64;
        assert!((v - 1.0).abs() < 0.05, "{v}");
    }

    #[test]
    fn triangular_stays_inside_and_peaks_at_its_mode() {
        let mut s = Stream::new(7, "triangular", 0);
        let draws: Vec<f64> = (0..20_000).map(|_| s.triangular(-1.0, 0.0, 3.0)).collect();
        assert!(draws.iter().all(|v| (-1.0..=3.0).contains(v)));
        let mean = draws.iter().sum::<f64>() / draws.len() as f64;
        assert!((mean - 2.0 / 3.0).abs() < 0.03, "{mean}");
    }
}
