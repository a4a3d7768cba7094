//! Photos in every format the runtime reads, whole and damaged.

use gonogo::runtime::photo::{Photo, PhotoError, PixelFormat, Pixels, Tone};
use image::{DynamicImage, ImageFormat, Luma};
use std::io::Cursor;

const SIZE: [u32; 2] = [45, 31];

/// 16-bit grey values with edges and a ramp.
fn scene() -> DynamicImage {
    let value = |x: u32, y: u32| if (x / 9 + y / 7).is_multiple_of(2) { 6_000 + 900 * x } else { 61_000 - 1_100 * y };
    image::ImageBuffer::from_fn(SIZE[0], SIZE[1], |x, y| Luma([value(x, y) as u16])).into()
}

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// Every format with every kind of pixel it holds, and how far its values may be from the scene's (share of full scale).
fn files() -> Vec<(String, Vec<u8>, f32)> {
    let scene = scene();
    let (eight, sixteen) = (0.5 / 255.0 + 1e-6, 0.5 / 65535.0 + 1e-6);
    let kinds: [(&str, DynamicImage, f32); 8] = [
        ("grey 8", scene.to_luma8().into(), eight),
        ("grey 8 alpha", scene.to_luma_alpha8().into(), eight),
        ("colour 8", scene.to_rgb8().into(), eight),
        ("colour 8 alpha", scene.to_rgba8().into(), eight),
        ("grey 16", scene.to_luma16().into(), sixteen),
        ("grey 16 alpha", scene.to_luma_alpha16().into(), sixteen),
        ("colour 16", scene.to_rgb16().into(), sixteen),
        ("colour 16 alpha", scene.to_rgba16().into(), sixteen),
    ];
    let formats = [
        (ImageFormat::Png, &[0, 1, 2, 3, 4, 5, 6, 7][..], 0.0),
        (ImageFormat::Tiff, &[0, 2, 3, 4, 6, 7], 0.0),
        (ImageFormat::Bmp, &[0, 2, 3], 0.0),
        (ImageFormat::Jpeg, &[0, 2], 0.25),
    ];
    let mut files = Vec::new();
    for (format, held, loss) in formats {
        for (name, image, exact) in held.iter().map(|&k| &kinds[k]) {
            files.push((format!("{format:?}, {name}"), encoded(image, format), exact + loss));
        }
    }
    files
}

fn expected(tone: Tone) -> Vec<f32> {
    let linear = |v: f32| match tone {
        Tone::Linear => v,
        Tone::Srgb if v <= 0.04045 => v / 12.92,
        Tone::Srgb => ((v + 0.055) / 1.055).powf(2.4),
    };
    scene().to_luma16().pixels().map(|p| linear(f32::from(p[0]) / 65535.0)).collect()
}

fn furthest(light: &[f32], expected: &[f32]) -> f32 {
    assert_eq!(light.len(), expected.len());
    light.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

#[test]
fn every_format_and_depth_gives_the_same_light() {
    for (name, bytes, within) in files() {
        for (tone, steepest) in [(Tone::Linear, 1.0), (Tone::Srgb, 2.4)] {
            let photo = Photo::decode(&bytes, tone, SIZE).unwrap_or_else(|e| panic!("{name}: {e}"));
            let off = furthest(&photo.light.values, &expected(tone));
            assert!(off <= within * steepest, "{name}, {tone:?}: {off}");
        }
    }
}

#[test]
fn colours_weigh_as_bt_709_says_after_linearisation() {
    let image = image::RgbImage::from_pixel(SIZE[0], SIZE[1], image::Rgb([200, 100, 50]));
    let photo = Photo::decode(&encoded(&image.into(), ImageFormat::Png), Tone::Srgb, SIZE).unwrap();
    let linear = |v: f32| ((v / 255.0 + 0.055) / 1.055).powf(2.4);
    let expected = 0.2126 * linear(200.0) + 0.7152 * linear(100.0) + 0.0722 * linear(50.0);
    assert!((photo.light.values[0] - expected).abs() < 1e-6);
}

#[test]
fn pixels_in_memory_are_the_file_without_its_coat() {
    let scene = scene();
    let wide: Vec<u8> = scene.to_luma16().iter().flat_map(|v| v.to_ne_bytes()).collect();
    let swapped: Vec<u8> = scene.to_rgb8().chunks_exact(3).flat_map(|p| [p[2], p[1], p[0]]).collect();
    let cases: [(PixelFormat, Vec<u8>, DynamicImage); 5] = [
        (PixelFormat::Grey8, scene.to_luma8().into_raw(), scene.to_luma8().into()),
        (PixelFormat::Grey16, wide, scene.to_luma16().into()),
        (PixelFormat::Rgb8, scene.to_rgb8().into_raw(), scene.to_rgb8().into()),
        (PixelFormat::Bgr8, swapped, scene.to_rgb8().into()),
        (PixelFormat::Rgba8, scene.to_rgba8().into_raw(), scene.to_rgba8().into()),
    ];
    for (format, packed, image) in cases {
        let file = Photo::decode(&encoded(&image, ImageFormat::Png), Tone::Srgb, SIZE).unwrap();
        let row = SIZE[0] as usize * format.bytes();
        for spare in [0, 1, 19] {
            let mut bytes: Vec<u8> = packed.chunks_exact(row).flat_map(|r| [r, &[7; 19][..spare]].concat()).collect();
            bytes.truncate(bytes.len() - spare);
            let pixels = Pixels { bytes: &bytes, format, size: SIZE, stride: row + spare };
            assert_eq!(Photo::from_pixels(&pixels, Tone::Srgb, SIZE).unwrap().light, file.light, "{format:?} {spare}");
            let short = Pixels { bytes: &bytes[1..], ..pixels };
            assert!(matches!(Photo::from_pixels(&short, Tone::Srgb, SIZE), Err(PhotoError::Unreadable(_))));
            let narrow = Pixels { stride: row - 1, ..pixels };
            assert!(matches!(Photo::from_pixels(&narrow, Tone::Srgb, SIZE), Err(PhotoError::Unreadable(_))));
        }
    }
}

#[test]
fn a_file_cut_short_is_an_error_or_the_whole_photo() {
    for (name, bytes, _) in files() {
        let whole = Photo::decode(&bytes, Tone::Linear, SIZE).unwrap().light;
        let mut read = 0;
        // Every cut near the ends, some in between.
        let last = bytes.len().saturating_sub(60);
        for cut in (0..bytes.len()).filter(|c| *c < 60 || *c > last || c % 41 == 0) {
            match Photo::decode(&bytes[..cut], Tone::Linear, SIZE) {
                Err(e) => assert!(!e.to_string().is_empty()),
                Ok(photo) => {
                    assert!(photo.light == whole, "{name} cut at {cut} of {} is taken for a photo", bytes.len());
                    read += 1;
                }
            }
        }
        // What may be missing is what follows the pixels: checksums, directories, ends.
        assert!(read < 24, "{name}: {read}");
    }
}

#[test]
fn giants_are_refused_before_anything_is_allocated() {
    // Headers that promise 65,535 x 65,535 px or more; each would need gigabytes.
    let mut png = encoded(&scene(), ImageFormat::Png);
    png[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = {
        let mut crc = u32::MAX;
        for byte in &png[12..29] {
            crc = (0..8).fold(crc ^ u32::from(*byte), |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 });
        }
        !crc
    };
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    let mut bmp = encoded(&scene().to_rgb8().into(), ImageFormat::Bmp);
    bmp[18..26].copy_from_slice(&[0xff, 0xff, 0, 0, 0xff, 0xff, 0, 0]);
    let mut jpeg = encoded(&scene().to_rgb8().into(), ImageFormat::Jpeg);
    let frame = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].fill(0xff);
    for bytes in [png, bmp, jpeg] {
        assert!(Photo::decode(&bytes, Tone::Linear, SIZE).is_err());
        // Also where the model asks for such a photo.
        let error = Photo::decode(&bytes, Tone::Linear, [65_535, 65_535]).unwrap_err();
        assert!(matches!(error, PhotoError::Unreadable(_) | PhotoError::WrongSize(..)), "{error}");
    }
}

#[test]
fn what_is_no_photo_is_told_in_words() {
    let told = |bytes: &[u8]| Photo::decode(bytes, Tone::Linear, SIZE).unwrap_err().to_string();
    assert!(told(b"").contains("PNG, JPEG, TIFF and BMP"), "{}", told(b""));
    assert!(told(b"GIF89a........................").contains("PNG, JPEG, TIFF and BMP"));
    let png = encoded(&scene(), ImageFormat::Png);
    assert!(told(&png[..png.len() / 2]).contains("cut short"), "{}", told(&png[..png.len() / 2]));
    let float = encoded(&scene().to_rgb32f().into(), ImageFormat::Tiff);
    assert!(told(&float).contains("floating-point"), "{}", told(&float));
}
