//! Photos: a file's bytes become a linear grey image, or a clear error.
//!
//! In: bytes of a PNG, JPEG, BMP or TIFF file, or pixels in memory. Out: [`Photo`], linear in light, 1.0 at full scale. Never touches the file system.

use super::camera::let_through;
use super::grid::Grid;
use super::math::power_f32;
use super::parts::{Listener, Part, nobody};
use image::metadata::Orientation;
use image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::io::{self, Cursor};

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
    /// Decodes the bytes of an image file of 8 or 16 bits; colour becomes luminance (ITU-R BT.709) after linearisation, and
    /// alpha is passed over. A file that says how the camera was held (EXIF) is turned upright, as every viewer shows it. The size
    /// is compared before anything is allocated for the pixels.
    pub fn decode(bytes: &[u8], tone: Tone, size: [u32; 2]) -> Result<Photo, PhotoError> {
        Photo::decode_heard(bytes, tone, size, &nobody)
    }

    /// The same, with the parts of it told.
    pub fn decode_heard(bytes: &[u8], tone: Tone, size: [u32; 2], listener: &Listener) -> Result<Photo, PhotoError> {
        listener(Part::Decode);
        let unreadable = |e: ImageError| PhotoError::Unreadable(plain(&e));
        let mut limits = limits();
        let mut reader = ImageReader::new(Cursor::new(bytes));
        reader.limits(limits.clone());
        let reader = reader.with_guessed_format().map_err(|e| PhotoError::Unreadable(e.to_string()))?;
        if reader.format() == Some(ImageFormat::Jpeg) {
            match jpeg(bytes) {
                None => return Err(PhotoError::Unreadable(CUT_SHORT.into())),
                Some(INKS) => return Err(PhotoError::Unreadable(PRINT.into())),
                Some(_) => {}
            }
        }
        let mut decoder = reader.into_decoder().map_err(unreadable)?;
        if matches!(decoder.original_color_type(), ExtendedColorType::Cmyk8 | ExtendedColorType::Cmyk16) {
            return Err(PhotoError::Unreadable(PRINT.into()));
        }
        let held = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let mut is: [u32; 2] = decoder.dimensions().into();
        if lies_on_its_side(held) {
            is.reverse();
        }
        if is != size {
            return Err(PhotoError::WrongSize(is, size));
        }
        limits.reserve(decoder.total_bytes()).map_err(unreadable)?;
        decoder.set_limits(limits).map_err(unreadable)?;
        let mut decoded = DynamicImage::from_decoder(decoder).map_err(unreadable)?;
        decoded.apply_orientation(held);
        listener(Part::Light);
        let light = light(&decoded, tone).ok_or_else(|| {
            PhotoError::Unreadable("its pixels are floating-point numbers: 8 or 16 bits are expected".into())
        })?;
        Ok(Photo { light: Grid::new(is[0] as usize, is[1] as usize, light) })
    }

    /// Grey values for people, row by row, on the curve of the station: what an 8-bit file holds.
    pub fn grey(&self, tone: Tone) -> Vec<u8> {
        let byte = |&light: &f32| {
            let v = if tone == Tone::Srgb { linear_to_srgb(light) } else { light };
            (v.clamp(0.0, 1.0) * 255.0).round() as u8
        };
        self.light.values.iter().map(byte).collect()
    }

    /// A photo from pixels in memory, as a camera's driver gives them.
    pub fn from_pixels(pixels: &Pixels, tone: Tone, size: [u32; 2]) -> Result<Photo, PhotoError> {
        if pixels.size != size {
            return Err(PhotoError::WrongSize(pixels.size, size));
        }
        let [width, height] = size.map(|s| s as usize);
        let row = width * pixels.format.bytes();
        // Sizes are a model's: no product here comes near the end of usize, but for the stride.
        let needed = pixels.stride.checked_mul(height.saturating_sub(1)).and_then(|n| n.checked_add(row));
        if pixels.stride < row || needed.is_none_or(|needed| pixels.bytes.len() < needed) {
            let (stride, given) = (pixels.stride, pixels.bytes.len());
            return Err(PhotoError::Unreadable(format!(
                "{given} bytes in rows of {stride} are too few for {height} rows of {row} bytes"
            )));
        }
        let rows = (0..height).map(|y| &pixels.bytes[y * pixels.stride..][..row]);
        let curve = Curve::new(tone, pixels.format.deepest());
        let mut values = Vec::with_capacity(width * height);
        for row in rows {
            match pixels.format {
                PixelFormat::Grey8 => values.extend(row.iter().map(|&v| curve.at(v))),
                PixelFormat::Grey16 => {
                    values.extend(row.chunks_exact(2).map(|p| curve.at(u16::from_ne_bytes([p[0], p[1]]))));
                }
                PixelFormat::Rgb8 => values.extend(row.chunks_exact(3).map(|p| curve.luminance(p[0], p[1], p[2]))),
                PixelFormat::Bgr8 => values.extend(row.chunks_exact(3).map(|p| curve.luminance(p[2], p[1], p[0]))),
                PixelFormat::Rgba8 => values.extend(row.chunks_exact(4).map(|p| curve.luminance(p[0], p[1], p[2]))),
            }
        }
        Ok(Photo { light: Grid::new(width, height, values) })
    }

    /// The photo as a lens without vignetting would have taken it. What the sensor clipped stays at full scale or above.
    pub fn flattened(&self, vignetting: f64) -> Cow<'_, Photo> {
        if vignetting == 0.0 {
            return Cow::Borrowed(self);
        }
        let (width, size) = (self.light.width, [self.light.width as u32, self.light.height as u32]);
        let place = |i: usize| [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5];
        let flat = |(i, &v): (usize, &f32)| v / let_through(vignetting, size, place(i)) as f32;
        let values = self.light.values.iter().enumerate().map(flat).collect();
        Cow::Owned(Photo { light: Grid::new(width, self.light.height, values) })
    }

    /// A photo from linear values, row by row.
    pub fn from_light(light: Grid) -> Photo {
        Photo { light }
    }
}

/// How pixels lie in memory. Full scale is 255, or 65535 in the machine's byte order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PixelFormat {
    Grey8,
    Grey16,
    Rgb8,
    Bgr8,
    Rgba8,
}

impl PixelFormat {
    /// Bytes of a pixel.
    pub fn bytes(self) -> usize {
        match self {
            PixelFormat::Grey8 => 1,
            PixelFormat::Grey16 => 2,
            PixelFormat::Rgb8 | PixelFormat::Bgr8 => 3,
            PixelFormat::Rgba8 => 4,
        }
    }

    /// The largest value.
    fn deepest(self) -> u16 {
        if self == PixelFormat::Grey16 { u16::MAX } else { 255 }
    }
}

/// Pixels in memory, top row first.
#[derive(Debug, Clone, Copy)]
pub struct Pixels<'a> {
    pub bytes: &'a [u8],
    pub format: PixelFormat,
    /// Width and height in px.
    pub size: [u32; 2],
    /// Bytes from one row to the next.
    pub stride: usize,
}

/// What decoding may use.
fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(LARGEST_SIDE);
    limits.max_image_height = Some(LARGEST_SIDE);
    limits.max_alloc = Some(LARGEST_DECODE);
    limits
}

const CUT_SHORT: &str = "the file is cut short";
const PRINT: &str = "it is separated for print (CMYK) and holds amounts of ink, not light: grey or RGB is expected";
/// Components of a JPEG file that is separated for print.
const INKS: u8 = 4;

fn lies_on_its_side(held: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(held, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// The number of components of a JPEG file, if it goes on to its end marker (ITU-T T.81, annex B). The decoder paints what is
/// missing grey, and the inspector would judge that.
fn jpeg(bytes: &[u8]) -> Option<u8> {
    const END: u8 = 0xd9;
    /// From the marker of a frame to the number of its components.
    const COMPONENTS: usize = 8;
    let (mut at, mut components) = (0, 0);
    while let Some(found) = bytes.get(at..).and_then(|rest| rest.iter().position(|&b| b == 0xff)) {
        at += found + 1;
        match bytes.get(at) {
            Some(&END) => return Some(components),
            // Stuffed zeros and restarts within a scan, start of image, a marker without a segment, padding.
            Some(0x00 | 0x01 | 0xd0..=0xd8) => at += 1,
            Some(0xff) => {}
            // Segments are stepped over: what they hold, a preview with an end of its own, may look like markers.
            Some(marker) => {
                if matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc) {
                    components = *bytes.get(at + COMPONENTS)?;
                }
                let &[high, low] = bytes.get(at + 1..at + 3)? else { return None };
                at += 1 + usize::from(u16::from_be_bytes([high, low]));
            }
            None => return None,
        }
    }
    None
}

/// What is wrong with a file, for people.
fn plain(error: &ImageError) -> String {
    match error {
        ImageError::Unsupported(_) => format!("{error}; PNG, JPEG, TIFF and BMP are read"),
        ImageError::Limits(_) => format!("{error}: it would need more memory than any photo of a station"),
        ImageError::IoError(e) if e.kind() == io::ErrorKind::UnexpectedEof => CUT_SHORT.into(),
        _ => error.to_string(),
    }
}

/// Linear values of a decoded image; `None` for pixels that are no integers.
fn light(image: &DynamicImage, tone: Tone) -> Option<Vec<f32>> {
    let (narrow, wide) = (|| Curve::new(tone, 255), || Curve::new(tone, u16::MAX));
    fn grey<P: Copy + Into<u16>>(samples: &[P], step: usize, curve: Curve) -> Vec<f32> {
        samples.chunks_exact(step).map(|p| curve.at(p[0])).collect()
    }
    fn colour<P: Copy + Into<u16> + PartialEq>(samples: &[P], step: usize, curve: Curve) -> Vec<f32> {
        samples.chunks_exact(step).map(|p| curve.luminance(p[0], p[1], p[2])).collect()
    }
    Some(match image {
        DynamicImage::ImageLuma8(i) => grey(i.as_raw(), 1, narrow()),
        DynamicImage::ImageLumaA8(i) => grey(i.as_raw(), 2, narrow()),
        DynamicImage::ImageRgb8(i) => colour(i.as_raw(), 3, narrow()),
        DynamicImage::ImageRgba8(i) => colour(i.as_raw(), 4, narrow()),
        DynamicImage::ImageLuma16(i) => grey(i.as_raw(), 1, wide()),
        DynamicImage::ImageLumaA16(i) => grey(i.as_raw(), 2, wide()),
        DynamicImage::ImageRgb16(i) => colour(i.as_raw(), 3, wide()),
        DynamicImage::ImageRgba16(i) => colour(i.as_raw(), 4, wide()),
        _ => return None,
    })
}

/// Light by grey value: a table, so that no pixel costs a power.
struct Curve(Vec<f32>);

impl Curve {
    fn new(tone: Tone, deepest: u16) -> Curve {
        let linear = |v: f32| if tone == Tone::Srgb { srgb_to_linear(v) } else { v };
        Curve((0..=deepest).map(|v| linear(f32::from(v) / f32::from(deepest))).collect())
    }

    fn at(&self, value: impl Into<u16>) -> f32 {
        self.0[usize::from(value.into())]
    }

    fn luminance<P: Into<u16> + PartialEq>(&self, red: P, green: P, blue: P) -> f32 {
        // Grey is the same light in a file of any kind, to the last bit.
        if red == green && green == blue {
            return self.at(red);
        }
        0.2126 * self.at(red) + 0.7152 * self.at(green) + 0.0722 * self.at(blue)
    }
}

fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * power_f32(v, 1.0 / 2.4) - 0.055 }
}

fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { power_f32((v + 0.055) / 1.055, 2.4) }
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
    fn flattening_undoes_the_lens() {
        let dimmed = |i: usize| 0.6 * let_through(0.4, [64, 48], [(i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5]) as f32;
        let photo = Photo::from_light(Grid::new(64, 48, (0..64 * 48).map(dimmed).collect()));
        assert!(photo.light.values[0] < 0.62 * photo.light.values[24 * 64 + 32]);
        assert!(photo.flattened(0.4).light.values.iter().all(|v| (v - 0.6).abs() < 1e-6));
        assert!(matches!(photo.flattened(0.0), Cow::Borrowed(_)));
    }

    #[test]
    fn a_photo_shows_the_grey_values_it_was_decoded_from() {
        let ramp = image::GrayImage::from_fn(256, 1, |x, _| image::Luma([x as u8]));
        let mut png = Vec::new();
        ramp.write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png).unwrap();
        for tone in [Tone::Linear, Tone::Srgb] {
            assert_eq!(Photo::decode(&png, tone, [256, 1]).unwrap().grey(tone), ramp.as_raw()[..]);
        }
    }

    #[test]
    fn srgb_ends_meet() {
        assert_eq!(srgb_to_linear(0.0), 0.0);
        assert!((srgb_to_linear(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-5);
    }
}
