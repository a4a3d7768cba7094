//! Photos: a file's bytes become a linear grey image, or a clear error.
//!
//! In: bytes of a PNG, JPEG, BMP or TIFF file. Out: [`Photo`], linear in light, 1.0 at full scale. Never touches the file system.

use super::grid::Grid;
use image::{ImageReader, Limits};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::io::Cursor;

/// No photo of a station is larger than this many pixels on a side.
const LARGEST_SIDE: u32 = 20_000;
/// Nor needs more memory than this to decode (bytes).
const LARGEST_DECODE: u64 = 1 << 30;

/// How the camera's grey values follow light.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tone {
    /// Grey value proportional to light.
    Linear,
    /// The sRGB curve (IEC 61966-2-1).
    Srgb,
}

/// A photo, linear in light.
#[derive(Debug, Clone)]
pub struct Photo {
    /// One value per pixel, 1.0 at full scale.
    pub light: Grid,
}

/// Why a photo could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PhotoError {
    /// Not an image, or a damaged one.
    Unreadable(String),
    /// Another size than the model's camera takes: (photo, model) in px.
    WrongSize([u32; 2], [u32; 2]),
}

impl fmt::Display for PhotoError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PhotoError::Unreadable(why) => write!(f, "cannot read the image: {why}"),
            PhotoError::WrongSize(is, want) => {
                write!(f, "E0804: the image is {}x{} px, the model expects {}x{} px", is[0], is[1], want[0], want[1])
            }
        }
    }
}

impl std::error::Error for PhotoError {}

impl Photo {
    /// Decodes the bytes of an image file; colour becomes luminance (ITU-R BT.709) after linearisation.
    pub fn decode(bytes: &[u8], tone: Tone, size: [u32; 2]) -> Result<Photo, PhotoError> {
        let unreadable = |e: &dyn fmt::Display| PhotoError::Unreadable(e.to_string());
        let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| unreadable(&e))?;
        let mut limits = Limits::default();
        limits.max_image_width = Some(LARGEST_SIDE);
        limits.max_image_height = Some(LARGEST_SIDE);
        limits.max_alloc = Some(LARGEST_DECODE);
        reader.limits(limits);
        let decoded = reader.decode().map_err(|e| unreadable(&e))?;
        let is = [decoded.width(), decoded.height()];
        if is != size {
            return Err(PhotoError::WrongSize(is, size));
        }
        let rgb = decoded.into_rgb32f();
        let linear = |v: f32| if tone == Tone::Srgb { srgb_to_linear(v) } else { v };
        let values =
            rgb.pixels().map(|p| 0.2126 * linear(p[0]) + 0.7152 * linear(p[1]) + 0.0722 * linear(p[2])).collect();
        Ok(Photo { light: Grid::new(is[0] as usize, is[1] as usize, values) })
    }

    /// A photo from linear values, row by row.
    pub fn from_light(light: Grid) -> Photo {
        Photo { light }
    }
}

fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rubbish_and_wrong_sizes_are_errors() {
        assert!(matches!(Photo::decode(b"not an image", Tone::Linear, [1, 1]), Err(PhotoError::Unreadable(_))));
        let mut png = Vec::new();
        image::GrayImage::new(3, 2).write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        assert_eq!(Photo::decode(&png, Tone::Linear, [2, 2]).unwrap_err(), PhotoError::WrongSize([3, 2], [2, 2]));
        assert!(matches!(Photo::decode(&png[..40], Tone::Linear, [3, 2]), Err(PhotoError::Unreadable(_))));
        assert!(Photo::decode(&png, Tone::Linear, [3, 2]).is_ok());
    }

    #[test]
    fn srgb_ends_meet() {
        assert_eq!(srgb_to_linear(0.0), 0.0);
        assert!((srgb_to_linear(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-5);
    }
}
