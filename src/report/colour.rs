//! A colour for every component: the same in 3-D, in lists and in pictures.

use std::f64::consts::TAU;

/// Lightness and chroma of components, and of the base, which stays grey.
const LIGHT: f64 = 0.76;
const CHROMA: f64 = 0.085;
const BASE_CHROMA: f64 = 0.008;
/// Turn of the hue from one component to the next: the golden ratio keeps any number of them apart.
const HUE_STEP: f64 = 0.618_033_988_749_895;
/// Hue of the base and of the first after it (share of a turn).
const FIRST_HUE: f64 = 0.69;

/// sRGB of a component.
pub fn component(index: usize) -> [u8; 3] {
    let chroma = if index == 0 { BASE_CHROMA } else { CHROMA };
    oklch(LIGHT, chroma, (FIRST_HUE + index.saturating_sub(1) as f64 * HUE_STEP).fract())
}

/// `#a1b2c3`
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Björn Ottosson's perceptual colour space; the hue as a share of a turn.
fn oklch(l: f64, chroma: f64, hue: f64) -> [u8; 3] {
    let (b, a) = (hue * TAU).sin_cos();
    let (a, b) = (a * chroma, b * chroma);
    let long = (l + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let middle = (l - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let short = (l - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    let linear = [
        4.076_741_662_1 * long - 3.307_711_591_3 * middle + 0.230_969_929_2 * short,
        -1.268_438_004_6 * long + 2.609_757_401_1 * middle - 0.341_319_396_5 * short,
        -0.004_196_086_3 * long - 0.703_418_614_7 * middle + 1.707_614_701_0 * short,
    ];
    linear.map(srgb)
}

/// A linear value as an sRGB byte.
pub fn srgb(linear: f64) -> u8 {
    let v = linear.clamp(0.0, 1.0);
    let curved = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (curved * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_lie_apart_and_the_base_is_grey() {
        let [r, g, b] = component(0);
        assert!(r.abs_diff(g) < 12 && g.abs_diff(b) < 12);
        let apart = |a: [u8; 3], b: [u8; 3]| (0..3).map(|i| a[i].abs_diff(b[i])).max().unwrap();
        for i in 0..8 {
            for j in i + 1..8 {
                assert!(apart(component(i), component(j)) > 12, "{i} {j}");
            }
        }
        assert_eq!(hex([255, 0, 16]), "#ff0010");
    }
}
