//! The sensor: linear light becomes a photo of 8 to 16 bits.
//!
//! In: [`LightImages`], a weight per light group, [`Sensor`]. Out: a grey image of the rendered pixels. The order is that of
//! light itself: sum of the lamps, point spread of the lens, vignetting, exposure, shot and read noise, saturation,
//! response, quantisation; noise after EMVA 1288. Never looks at the scene.

use super::LightImages;
use crate::design::model::Response;
use crate::rng::Stream;
use crate::runtime::camera::let_through;
use image::{GrayImage, ImageBuffer, Luma};

/// The point spread is cut off at this many standard deviations.
const SPREAD_REACH: f32 = 3.5;

/// How a camera turns light into grey levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    /// Standard deviation of the Gaussian point spread (px).
    pub blur: f64,
    /// Share of light lost in the corners of the image, falling with the square of the radius.
    pub vignetting: f64,
    /// Standard deviation of the noise in the dark, as a share of full scale.
    pub read_noise: f64,
    /// Electrons at full scale: the variance of shot noise is signal over this, in squares of full scale. Infinite for none.
    pub full_well: f64,
    pub response: Response,
    /// Bits of a grey value: 8 to 16.
    pub depth: u32,
}

impl Sensor {
    /// A camera without blur, noise or vignetting.
    pub fn ideal() -> Sensor {
        Sensor {
            blur: 0.0,
            vignetting: 0.0,
            read_noise: 0.0,
            full_well: f64::INFINITY,
            response: Response::Linear,
            depth: 8,
        }
    }

    /// The photo in 8 bits. `weights[g]` is the grey (share of full scale) that radiance 1 of light group `g` gives; groups without a
    /// weight are dark. `seed` names the noise.
    pub fn expose(&self, images: &LightImages, weights: &[f64], seed: u64) -> GrayImage {
        let [width, height] = images.size();
        let levels = self.levels(images, weights, seed);
        let grey = levels.iter().map(|level| (level * 255.0).round() as u8).collect();
        GrayImage::from_raw(width, height, grey).unwrap_or_default()
    }

    /// The photo in 16 bits, whose values are the `depth` bits of the sensor spread over the whole scale.
    pub fn expose_deep(&self, images: &LightImages, weights: &[f64], seed: u64) -> ImageBuffer<Luma<u16>, Vec<u16>> {
        let [width, height] = images.size();
        let deepest = f64::from((1_u32 << self.depth.clamp(8, 16)) - 1);
        let value = |level: &f64| ((level * deepest).round() / deepest * f64::from(u16::MAX)).round() as u16;
        let grey = self.levels(images, weights, seed).iter().map(value).collect();
        ImageBuffer::from_raw(width, height, grey).unwrap_or_default()
    }

    /// What the sensor answers before its values are rounded: 0 to 1, row by row.
    fn levels(&self, images: &LightImages, weights: &[f64], seed: u64) -> Vec<f64> {
        let [width, height] = images.size();
        let mut light = combine(images, weights);
        blur(&mut light, width as usize, height as usize, self.blur as f32);
        let mut levels = Vec::with_capacity(light.len());
        for (row, values) in light.chunks(width.max(1) as usize).enumerate() {
            let mut noise = Stream::new(seed, "sensor", row as u64);
            for (column, &value) in values.iter().enumerate() {
                let place =
                    [f64::from(images.crop[0]) + column as f64 + 0.5, f64::from(images.crop[1]) + row as f64 + 0.5];
                let signal = f64::from(value) * let_through(self.vignetting, [images.width, images.height], place);
                levels.push(self.answer(self.noisy(signal, &mut noise)));
            }
        }
        levels
    }

    /// Shot and read noise; a full well of some thousand electrons makes Poisson's distribution a normal one.
    fn noisy(&self, signal: f64, noise: &mut Stream) -> f64 {
        let variance = self.read_noise * self.read_noise + signal.clamp(0.0, 1.0) / self.full_well;
        if variance > 0.0 { signal + variance.sqrt() * noise.normal() } else { signal }
    }

    fn answer(&self, signal: f64) -> f64 {
        match self.response {
            Response::Linear => signal.clamp(0.0, 1.0),
            Response::Srgb => srgb(signal.clamp(0.0, 1.0)),
        }
    }
}

/// The weighted sum of the groups' images: linear light of the crop, row by row.
pub fn combine(images: &LightImages, weights: &[f64]) -> Vec<f32> {
    let [width, height] = images.size();
    let mut light = vec![0.0; width as usize * height as usize];
    for (group, &weight) in images.groups.iter().zip(weights) {
        for (sum, &value) in light.iter_mut().zip(group) {
            *sum += weight as f32 * value;
        }
    }
    light
}

/// Gaussian point spread of standard deviation `sigma` (px) on an image of `width` × `height`; the border is repeated.
pub fn blur(light: &mut Vec<f32>, width: usize, height: usize, sigma: f32) {
    if sigma <= 0.0 || light.is_empty() {
        return;
    }
    let kernel = spread(sigma);
    let across = convolved(light, &kernel, width, |x, y| y * width + x, [width, height]);
    *light = convolved(&across, &kernel, height, |y, x| y * width + x, [height, width]);
}

/// One pass of a separable filter along the first coordinate of `at`, over `size` (along, across).
fn convolved(
    light: &[f32],
    kernel: &[f32],
    length: usize,
    at: impl Fn(usize, usize) -> usize,
    size: [usize; 2],
) -> Vec<f32> {
    let reach = kernel.len() / 2;
    let mut out = vec![0.0; light.len()];
    for across in 0..size[1] {
        for along in 0..size[0] {
            let from = |i: usize| light[at((along + i).saturating_sub(reach).min(length - 1), across)];
            out[at(along, across)] = kernel.iter().enumerate().map(|(i, k)| k * from(i)).sum();
        }
    }
    out
}

/// A sampled Gaussian of odd length with sum 1.
fn spread(sigma: f32) -> Vec<f32> {
    let reach = (SPREAD_REACH * sigma).ceil().min(1000.0) as i32;
    let raw: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = raw.iter().sum();
    raw.iter().map(|v| v / sum).collect()
}

/// The transfer function of sRGB (IEC 61966-2-1).
fn srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32, size: u32) -> LightImages {
        let group = vec![value; (size * size) as usize];
        LightImages { width: size, height: size, crop: [0, 0, size, size], groups: vec![group.clone(), group] }
    }

    #[test]
    fn noise_has_the_variance_of_emva_1288() {
        let sensor = Sensor { read_noise: 0.01, full_well: 2000.0, ..Sensor::ideal() };
        let photo = sensor.expose(&flat(0.25, 128), &[1.0, 1.0], 3);
        let values: Vec<f64> = photo.pixels().map(|p| f64::from(p.0[0]) / 255.0).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        // Read noise, shot noise at half scale, and the quantisation's twelfth of a level.
        let expected = 0.01_f64.powi(2) + 0.5 / 2000.0 + 1.0 / (12.0 * 255.0_f64.powi(2));
        assert!((mean - 0.5).abs() < 1e-3 && (variance / expected - 1.0).abs() < 0.05, "{mean} {variance} {expected}");
        assert_eq!(photo, sensor.expose(&flat(0.25, 128), &[1.0, 1.0], 3));
        assert_ne!(photo, sensor.expose(&flat(0.25, 128), &[1.0, 1.0], 4));
    }

    #[test]
    fn an_ideal_sensor_is_linear_until_it_saturates() {
        let level = |weight| Sensor::ideal().expose(&flat(0.25, 4), &[weight], 0).get_pixel(2, 2).0[0];
        assert_eq!([0.0, 1.0, 2.0, 4.0, 8.0].map(level), [0, 64, 128, 255, 255]);
        let srgb = Sensor { response: Response::Srgb, ..Sensor::ideal() };
        assert_eq!(srgb.expose(&flat(0.2159, 4), &[1.0], 0).get_pixel(0, 0).0[0], 128);
    }

    #[test]
    fn deep_photos_have_the_levels_of_their_sensor() {
        for depth in [8, 10, 12, 16] {
            let steps = f64::from((1_u32 << depth) - 1);
            let photo = Sensor { depth, read_noise: 0.1, ..Sensor::ideal() }.expose_deep(&flat(0.25, 64), &[2.0], 1);
            let level = |v: u16| f64::from(v) / 65_535.0 * steps;
            assert!(
                photo.pixels().all(|p| (level(p.0[0]) - level(p.0[0]).round()).abs() < 0.5 * steps / 65_535.0 + 1e-6)
            );
            let distinct: std::collections::BTreeSet<u16> = photo.pixels().map(|p| p.0[0]).collect();
            assert!(distinct.len() as f64 > (steps / 4.0).min(1500.0), "{depth}: {}", distinct.len());
        }
        let (deep, shallow) = (Sensor { depth: 8, ..Sensor::ideal() }, flat(0.3, 4));
        assert_eq!(deep.expose_deep(&shallow, &[1.0], 0).get_pixel(1, 1).0[0] / 257, 77);
        assert_eq!(deep.expose(&shallow, &[1.0], 0).get_pixel(1, 1).0[0], 77);
    }

    #[test]
    fn a_point_spreads_to_its_standard_deviation_and_keeps_its_light() {
        let (width, height, sigma) = (41, 31, 1.7_f32);
        let mut light = vec![0.0; width * height];
        light[15 * width + 20] = 1.0;
        blur(&mut light, width, height, sigma);
        let sum: f32 = light.iter().sum();
        let moment = |f: &dyn Fn(usize) -> f32| light.iter().enumerate().map(|(i, v)| v * f(i).powi(2)).sum::<f32>();
        let (across, down) = (moment(&|i| (i % width) as f32 - 20.0), moment(&|i| (i / width) as f32 - 15.0));
        assert!((sum - 1.0).abs() < 1e-5);
        assert!((across - sigma * sigma).abs() < 0.05 && (down - across).abs() < 1e-3, "{across} {down}");
    }

    #[test]
    fn corners_are_darker_by_the_vignetting() {
        let photo = Sensor { vignetting: 0.4, ..Sensor::ideal() }.expose(&flat(0.8, 64), &[1.0], 0);
        let (corner, centre) = (f64::from(photo.get_pixel(0, 0).0[0]), f64::from(photo.get_pixel(32, 32).0[0]));
        assert!((corner / centre - 0.6).abs() < 0.03, "{corner} {centre}");
    }
}
