//! Blotches: smooth noise in the part's own coordinates, for dirt, oxide and grain.
//!
//! Value noise on a lattice, two octaves, quintic interpolation. In: a point in units of the blotch size, a seed. Out: two
//! unrelated values in -1..1 from the same lattice. Never larger than 1 in amount.

use super::vector::Vec3;

/// Share of the first octave; the second has half its size and the rest of its weight.
const FIRST_OCTAVE: f32 = 2.0 / 3.0;

/// Two unrelated smooth fields at `p`.
pub(super) fn blotches(p: Vec3, seed: u32) -> [f32; 2] {
    let first = value_noise(p, seed);
    let second = value_noise(p * 2.0, seed ^ 0x5bd1_e995);
    [0, 1].map(|i| FIRST_OCTAVE * first[i] + (1.0 - FIRST_OCTAVE) * second[i])
}

fn value_noise(p: Vec3, seed: u32) -> [f32; 2] {
    let cell = p.map(f32::floor);
    let along = (p - cell).map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let base = cell.map(|c| c as i32 as u32);
    let mut sum = [0.0; 2];
    for corner in 0..8_u32 {
        let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
        let weight = (0..3).map(|i| if bits[i] == 1 { along[i] } else { 1.0 - along[i] }).product::<f32>();
        let values = lattice([0, 1, 2].map(|i| base[i].wrapping_add(bits[i])), seed);
        sum = [sum[0] + weight * values[0], sum[1] + weight * values[1]];
    }
    sum
}

/// Two values in -1..1 at a point of the lattice (finaliser of MurmurHash3).
fn lattice(at: [u32; 3], seed: u32) -> [f32; 2] {
    let mut h = seed;
    for c in at {
        h = (h ^ c.wrapping_mul(0xcc9e_2d51)).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64);
    }
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^= h >> 16;
    [h & 0xffff, h >> 16].map(|v| v as f32 / 32_767.5 - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blotches_are_bounded_smooth_centred_and_unrelated() {
        let (mut sums, mut product, mut steps) = ([0.0_f64; 2], 0.0_f64, 0.0_f32);
        let n = 20_000;
        for i in 0..n {
            let p = Vec3::new((i % 100) as f32 * 0.37, (i / 100) as f32 * 0.41, 0.3);
            let a = blotches(p, 9);
            assert!(a.iter().all(|v| v.abs() <= 1.0));
            sums = [sums[0] + f64::from(a[0]), sums[1] + f64::from(a[1])];
            product += f64::from(a[0] * a[1]);
            steps = steps.max((blotches(p + Vec3::new(1e-3, 0.0, 0.0), 9)[0] - a[0]).abs());
        }
        assert!(sums.iter().all(|s| (s / f64::from(n)).abs() < 0.03), "{sums:?}");
        assert!((product / f64::from(n)).abs() < 0.02 && steps < 0.01, "{product} {steps}");
        assert_ne!(blotches(Vec3::new(0.2, 0.3, 0.4), 1), blotches(Vec3::new(0.2, 0.3, 0.4), 2));
    }
}
