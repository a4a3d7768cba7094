//! Blessed pictures: small PNG files, compared by how much their grey values differ.
//!
//! In: PNG files. Out: PNG files small enough to be kept, a difference, or both pictures beside their difference. A picture
//! that is too large is reduced by a whole number: every pixel is then the mean of a block, and less noisy.

use super::LARGEST;
use super::compare::{Allowed, Difference};
use super::tolerance::PictureTolerance;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageFormat, Limits, Rgb, RgbImage};
use std::fmt::Write;

/// No picture of ours is wider or higher (px).
const LARGEST_SIDE: u32 = 20_000;
/// Differences are shown this many times as strong.
const STRENGTH: u16 = 8;
/// Between the pictures that stand beside each other (px).
const GAP: u32 = 4;

/// Pixels in rows, one or three bytes each.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Picture {
    size: [u32; 2],
    channels: usize,
    values: Vec<u8>,
}

/// The size and the mean grey level of every picture, as the file that stands for all of them.
pub fn summary(pictures: &[(String, Vec<u8>)]) -> String {
    let mut text = String::from("// width and height in px, mean grey level of 255\n{\n");
    for (name, png) in pictures {
        let Some(picture) = Picture::read(png) else { continue };
        let sum: u64 = picture.values.iter().map(|&v| u64::from(v)).sum();
        let mean = sum as f64 / picture.values.len() as f64;
        let [width, height] = picture.size;
        let _ = writeln!(text, "  {name:?}: (size: ({width}, {height}), mean: {mean:.2}),");
    }
    text.push_str("}\n");
    text
}

/// The picture, reduced until it has no more than [`LARGEST`] bytes; `None` if it is none.
pub fn reduced(png: &[u8]) -> Option<Vec<u8>> {
    let picture = Picture::read(png)?;
    (1..=picture.size[0].max(picture.size[1])).map(|factor| picture.reduced(factor).png()).find(|p| p.len() <= LARGEST)
}

/// How a new picture of any size departs from a blessed one.
pub fn difference(blessed: &[u8], now: &[u8], allowed: &PictureTolerance) -> Option<Difference> {
    let differ =
        |blessed: String, now: String| Some(Difference { path: "the picture".into(), blessed, now, allowed: None });
    let Some(blessed) = Picture::read(blessed) else { return differ("none".into(), "one".into()) };
    let Some(now) = Picture::read(now) else { return differ("one".into(), "none".into()) };
    let Some(now) = now.like(&blessed) else { return differ(blessed.form(), now.form()) };
    let (mut sum, mut most, mut place) = (0u64, 0, 0);
    for (i, (b, n)) in blessed.values.iter().zip(&now.values).enumerate() {
        let apart = b.abs_diff(*n);
        sum += u64::from(apart);
        if apart > most {
            (most, place) = (apart, i);
        }
    }
    let mean = sum as f64 / blessed.values.len() as f64;
    if mean <= allowed.mean && f64::from(most) <= allowed.most {
        return None;
    }
    let pixel = place / blessed.channels;
    let (x, y) = (pixel % blessed.size[0] as usize, pixel / blessed.size[0] as usize);
    let path = format!("mean difference {mean:.2}, most at pixel ({x}, {y})");
    let [blessed, now] = [&blessed, &now].map(|picture| picture.values[place].to_string());
    Some(Difference { path, blessed, now, allowed: Some(Allowed::Picture(*allowed)) })
}

/// Blessed, now, and eight times their difference, from left to right; `None` unless both are pictures.
pub fn beside(blessed: &[u8], now: &[u8]) -> Option<Vec<u8>> {
    let (blessed, now) = (Picture::read(blessed)?, Picture::read(now)?);
    let now = now.like(&blessed).unwrap_or(now);
    let [width, height] = [blessed.size[0].max(now.size[0]), blessed.size[1].max(now.size[1])];
    let white = Rgb([255; 3]);
    let mut sheet = RgbImage::from_pixel(3 * width + 2 * GAP, height, white);
    for y in 0..height {
        for x in 0..width {
            let (b, n) = (blessed.at(x, y), now.at(x, y));
            let apart = |i: usize| (u16::from(b?[i].abs_diff(n?[i])) * STRENGTH).min(255).try_into().ok();
            let difference = [apart(0), apart(1), apart(2)];
            let [r, g, bl] = difference.map(|d| d.unwrap_or(255));
            sheet.put_pixel(x, y, Rgb(b.unwrap_or([255; 3])));
            sheet.put_pixel(width + GAP + x, y, Rgb(n.unwrap_or([255; 3])));
            sheet.put_pixel(2 * (width + GAP) + x, y, Rgb([r, g, bl]));
        }
    }
    Some(Picture { size: sheet.dimensions().into(), channels: 3, values: sheet.into_raw() }.png())
}

impl Picture {
    /// Pictures of 8 bits, grey or RGB; what else there may be becomes RGB.
    fn read(png: &[u8]) -> Option<Picture> {
        let mut reader = image::ImageReader::with_format(std::io::Cursor::new(png), ImageFormat::Png);
        let mut limits = Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(LARGEST_SIDE), Some(LARGEST_SIDE));
        reader.limits(limits);
        let decoded = reader.decode().ok()?;
        let size = [decoded.width(), decoded.height()];
        if size.contains(&0) {
            return None;
        }
        Some(match decoded {
            image::DynamicImage::ImageLuma8(grey) => Picture { size, channels: 1, values: grey.into_raw() },
            other => Picture { size, channels: 3, values: other.into_rgb8().into_raw() },
        })
    }

    /// This picture as small as `other`, if a whole factor makes it so.
    fn like(&self, other: &Picture) -> Option<Picture> {
        let factor = self.size[0].div_ceil(other.size[0]).max(1);
        let reduced = (self.channels == other.channels).then(|| self.reduced(factor))?;
        (reduced.size == other.size).then_some(reduced)
    }

    /// Every pixel the mean of a block; at the right and at the bottom of what is left of one.
    fn reduced(&self, factor: u32) -> Picture {
        if factor <= 1 {
            return self.clone();
        }
        let [width, height] = self.size.map(|s| s as usize);
        let block = factor as usize;
        let size = self.size.map(|s| s.div_ceil(factor));
        let mut values = Vec::with_capacity(size[0] as usize * size[1] as usize * self.channels);
        for top in (0..height).step_by(block) {
            for left in (0..width).step_by(block) {
                let (bottom, right) = ((top + block).min(height), (left + block).min(width));
                let count = ((bottom - top) * (right - left)) as u64;
                for channel in 0..self.channels {
                    let row = |y: usize| (left..right).map(move |x| (y * width + x) * self.channels + channel);
                    let sum: u64 = (top..bottom).flat_map(row).map(|i| u64::from(self.values[i])).sum();
                    values.push(((sum + count / 2) / count).min(255) as u8);
                }
            }
        }
        Picture { size, channels: self.channels, values }
    }

    fn at(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        if x >= self.size[0] || y >= self.size[1] {
            return None;
        }
        let start = (y as usize * self.size[0] as usize + x as usize) * self.channels;
        let pixel = &self.values[start..start + self.channels];
        Some([pixel[0], pixel[pixel.len() / 2], pixel[pixel.len() - 1]])
    }

    fn form(&self) -> String {
        let [width, height] = self.size;
        format!("{width}x{height} px {}", if self.channels == 1 { "grey" } else { "colour" })
    }

    /// Writing to memory does not fail; an empty file would show it if it did.
    fn png(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let colour = if self.channels == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
        let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive);
        if encoder.write_image(&self.values, self.size[0], self.size[1], colour).is_err() {
            bytes.clear();
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: u32, height: u32) -> Picture {
        let mut state = 1u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        Picture { size: [width, height], channels: 1, values: (0..width * height).map(|_| next()).collect() }
    }

    const ALLOWED: PictureTolerance = PictureTolerance { mean: 0.5, most: 12.0 };

    #[test]
    fn large_pictures_are_reduced_to_means_of_blocks() {
        let picture = noise(330, 250);
        let small = reduced(&picture.png()).unwrap();
        assert!(small.len() <= LARGEST);
        let small_picture = Picture::read(&small).unwrap();
        assert_eq!(small_picture.size, [165, 125]);
        let block = [0, 1, 330, 331].map(|i| u32::from(picture.values[i]));
        assert_eq!(u32::from(small_picture.values[0]), (block.iter().sum::<u32>() + 2) / 4);
        assert_eq!(difference(&small, &picture.png(), &ALLOWED), None);
        let tiny = noise(30, 20);
        assert_eq!(Picture::read(&reduced(&tiny.png()).unwrap()), Some(tiny));
    }

    #[test]
    fn one_bright_pixel_and_a_slight_haze_are_both_told() {
        let picture = noise(64, 48);
        let said = |change: fn(usize, u8) -> u8| {
            let values = picture.values.iter().enumerate().map(|(i, &v)| change(i, v)).collect();
            let now = Picture { values, ..picture.clone() };
            difference(&picture.png(), &now.png(), &ALLOWED).map(|d| d.to_string())
        };
        assert_eq!(said(|_, v| v), None);
        assert_eq!(said(|i, v| if i == 70 { v ^ 8 } else { v }), None);
        let value = picture.values[70];
        let bright = said(|i, v| if i == 70 { v ^ 64 } else { v }).unwrap();
        assert_eq!(bright, format!("mean difference 0.02, most at pixel (6, 1): {value} blessed, {} now", value ^ 64));
        assert!(said(|_, v| v ^ 1).unwrap().contains("mean difference 1.00"));
    }

    #[test]
    fn another_size_another_kind_and_no_picture_are_differences() {
        let (a, b) = (noise(64, 48).png(), noise(48, 64).png());
        let said = |x: &[u8], y: &[u8]| difference(x, y, &ALLOWED).unwrap().to_string();
        assert_eq!(said(&a, &b), "the picture: 64x48 px grey blessed, 48x64 px grey now");
        assert_eq!(said(&a, b"x"), "the picture: one blessed, none now");
        assert_eq!(said(b"", &a), "the picture: none blessed, one now");
        let colour = Picture { size: [2, 2], channels: 3, values: vec![9; 12] }.png();
        assert_eq!(said(&noise(2, 2).png(), &colour), "the picture: 2x2 px grey blessed, 2x2 px colour now");
        assert_eq!(reduced(b"x"), None);
    }

    #[test]
    fn a_difference_is_shown_beside_what_differs() {
        let blessed = noise(8, 6);
        let mut now = blessed.clone();
        now.values[9] ^= 16;
        let sheet = Picture::read(&beside(&blessed.png(), &now.png()).unwrap()).unwrap();
        assert_eq!(sheet.size, [3 * 8 + 2 * GAP, 6]);
        assert_eq!(sheet.at(1, 1), Some([blessed.values[9]; 3]));
        assert_eq!(sheet.at(8 + GAP + 1, 1), Some([now.values[9]; 3]));
        assert_eq!(sheet.at(2 * (8 + GAP) + 1, 1), Some([16 * STRENGTH as u8; 3]));
        assert_eq!(sheet.at(2 * (8 + GAP), 0), Some([0; 3]));
    }

    #[test]
    fn the_summary_is_ron_with_sizes_and_means() {
        let picture = Picture { size: [2, 1], channels: 1, values: vec![10, 15] };
        let text = summary(&[("good.png".into(), picture.png()), ("rubbish".into(), vec![1])]);
        assert!(text.ends_with("{\n  \"good.png\": (size: (2, 1), mean: 12.50),\n}\n"), "{text}");
    }
}
