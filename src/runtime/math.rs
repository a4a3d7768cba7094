//! Transcendental functions that give the same bytes on every machine.
//!
//! In: numbers. Out: numbers. The standard library takes these functions from each platform's own library, and their last digits
//! differ: one of them in a pose makes another float of an edge's direction, and a verdict that is not the same to the letter.
//! `libm` is one implementation in Rust, of additions and products that IEEE 754 fixes. Square roots are fixed too: they stay
//! the standard library's. Nothing else in the runtime calls what is here by its other name; tests/layers.rs holds that.

/// Sine and cosine of an angle (rad).
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// Natural logarithm.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `base` to the power of `exponent`.
pub fn power(base: f64, exponent: f64) -> f64 {
    libm::pow(base, exponent)
}

/// The same with f32, for a base that is not negative: by way of f64, so that it is rounded once.
pub fn power_f32(base: f32, exponent: f32) -> f32 {
    libm::exp(f64::from(exponent) * ln(f64::from(base))) as f32
}

/// Length of a vector whose squares are far from the ends of f64.
pub fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Length of a vector whose squares are far from the ends of f32.
pub fn length_f32(x: f32, y: f32) -> f32 {
    (x * x + y * y).sqrt()
}

/// Natural logarithm of a product of many factors above 0: exponents are added up, so that no product leaves the range of f64, and
/// one logarithm is taken.
pub fn ln_product(factors: impl Iterator<Item = f64>) -> f64 {
    /// So many mantissas below 2 stay below 2^512.
    const RUN: usize = 512;
    let (mut mantissa, mut exponent) = (1.0f64, 0i64);
    for (i, factor) in factors.enumerate() {
        let Some((m, e)) = parts(factor) else { return ln(factor) };
        mantissa *= m;
        exponent += e;
        if i % RUN == RUN - 1 {
            let (m, e) = parts(mantissa).unwrap_or((mantissa, 0));
            mantissa = m;
            exponent += e;
        }
    }
    ln(mantissa) + exponent as f64 * std::f64::consts::LN_2
}

/// A number as m · 2^e with 1 ≤ m < 2; `None` for what is not finite and above 0.
fn parts(x: f64) -> Option<(f64, i64)> {
    const MANTISSA_BITS: u32 = 52;
    const BIAS: i64 = 1023;
    if !(x > 0.0 && x.is_finite()) {
        return None;
    }
    if x.is_subnormal() {
        let scale = (1u64 << MANTISSA_BITS) as f64;
        return parts(x * scale).map(|(m, e)| (m, e - i64::from(MANTISSA_BITS)));
    }
    let bits = x.to_bits();
    let mantissa = bits & ((1 << MANTISSA_BITS) - 1) | (BIAS as u64) << MANTISSA_BITS;
    Some((f64::from_bits(mantissa), (bits >> MANTISSA_BITS) as i64 - BIAS))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both libraries err by less than two units of the last place.
    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() <= 2.0 * f64::EPSILON * b.abs().max(f64::MIN_POSITIVE)
    }

    #[test]
    fn they_are_the_functions_they_are_called() {
        for i in 1..2000 {
            let x = f64::from(i) * 0.0137;
            let (sin, cos) = sin_cos(x - 13.0);
            assert!((sin - (x - 13.0).sin()).abs() < 3e-16 && (cos - (x - 13.0).cos()).abs() < 3e-16, "{x}");
            assert!(near(ln(x), x.ln()) && near(power(x, 0.37), x.powf(0.37)), "{x}");
            assert!((power_f32(x as f32, 2.4) / (x as f32).powf(2.4) - 1.0).abs() < 3e-7, "{x}");
            assert!(near(length(x, 0.5 - x), x.hypot(0.5 - x)), "{x}");
        }
    }

    /// Bits that every machine must show: the nearest to the series' sums to 60 digits.
    #[test]
    fn bits_are_fixed() {
        let (sin, cos) = sin_cos(0.3);
        let bits = [sin, cos, ln(7.3), power(1.7, 0.37)].map(f64::to_bits);
        assert_eq!(bits, [0x3fd2_e9cd_95ba_ba33, 0x3fee_921d_d42f_09ba, 0x3fff_ce55_551e_156e, 0x3ff3_788d_1216_5aaa]);
    }

    #[test]
    fn a_logarithm_of_a_product_is_the_sum_of_logarithms() {
        for scale in [1e-310, 1e-200, 0.3, 1.0, 4.0, 1e250] {
            let factors: Vec<f64> = (0..3000).map(|i| scale * (1.0 + f64::from(i % 37) / 7.0)).collect();
            let sum: f64 = factors.iter().map(|f| f.ln()).sum();
            let product = ln_product(factors.into_iter());
            assert!((product - sum).abs() <= 1e-12 * sum.abs().max(1.0), "{scale}: {product} {sum}");
        }
        assert_eq!(ln_product(std::iter::empty()), 0.0);
        assert_eq!(ln_product([2.0, 0.0, 3.0].into_iter()), f64::NEG_INFINITY);
        assert_eq!(ln_product([2.0, f64::INFINITY].into_iter()), f64::INFINITY);
        assert!(ln_product([2.0, f64::NAN].into_iter()).is_nan());
    }
}
