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

/// CRC-32 of a PNG chunk.
fn crc(bytes: &[u8]) -> u32 {
    let bit = |c: u32| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |c, _| bit(c)))
}

fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let named = [kind, data].concat();
    [&(data.len() as u32).to_be_bytes()[..], &named, &crc(&named).to_be_bytes()].concat()
}

/// A zlib stream of stored blocks (RFC 1950, RFC 1951).
fn stored(data: &[u8]) -> Vec<u8> {
    let mut out = vec![0x78, 0x01];
    let pieces = data.chunks(0xffff).count();
    for (i, piece) in data.chunks(0xffff).enumerate() {
        let length = piece.len() as u16;
        out.push(u8::from(i + 1 == pieces));
        out.extend([length.to_le_bytes(), (!length).to_le_bytes()].concat());
        out.extend(piece);
    }
    let (a, b) = data.iter().fold((1u32, 0u32), |(a, b), &v| {
        let a = (a + u32::from(v)) % 65_521;
        (a, (b + a) % 65_521)
    });
    out.extend((b << 16 | a).to_be_bytes());
    out
}

/// A PNG file of rows that are packed already.
fn png(depth: u8, kind: u8, between: &[Vec<u8>], rows: impl Iterator<Item = Vec<u8>>) -> Vec<u8> {
    let head = [&SIZE[0].to_be_bytes()[..], &SIZE[1].to_be_bytes(), &[depth, kind, 0, 0, 0]].concat();
    let data: Vec<u8> = rows.flat_map(|row| [&[0][..], &row].concat()).collect();
    let parts = [chunk(b"IHDR", &head), between.concat(), chunk(b"IDAT", &stored(&data)), chunk(b"IEND", &[])];
    [b"\x89PNG\r\n\x1a\n".to_vec(), parts.concat()].concat()
}

fn grey_rows() -> Vec<Vec<u8>> {
    scene().to_luma8().into_raw().chunks_exact(SIZE[0] as usize).map(<[u8]>::to_vec).collect()
}

/// The scene in 8 bits, written by hand in ways that no encoder at hand writes.
#[test]
fn palettes_odd_depths_and_rows_either_way_up_are_read() {
    let expected =
        Photo::decode(&encoded(&scene().to_luma8().into(), ImageFormat::Png), Tone::Linear, SIZE).unwrap().light;
    // A palette that holds its greys backwards.
    let palette: Vec<u8> = (0..=255u8).rev().flat_map(|v| [v; 3]).collect();
    let turned = grey_rows().into_iter().map(|row| row.into_iter().map(|v| 255 - v).collect());
    let indexed = png(8, 3, &[chunk(b"PLTE", &palette)], turned);
    // A bitmap with its rows from the top down: height is negative.
    let upward = encoded(&scene().to_rgb8().into(), ImageFormat::Bmp);
    let start = u32::from_le_bytes(upward[10..14].try_into().unwrap()) as usize;
    let row = (SIZE[0] as usize * 3).next_multiple_of(4);
    let mut downward = upward[..start].to_vec();
    downward[22..26].copy_from_slice(&(-(SIZE[1] as i32)).to_le_bytes());
    downward.extend(upward[start..].chunks_exact(row).rev().flatten());
    assert_ne!(upward, downward);
    for (name, file) in [("palette", indexed), ("bottom up", upward), ("top down", downward)] {
        let photo = Photo::decode(&file, Tone::Linear, SIZE).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(photo.light, expected, "{name}");
    }
    // One, two and four bits of grey.
    for depth in [1u8, 2, 4] {
        let deepest = (1u16 << depth) - 1;
        let level = |v: &u8| (u16::from(*v) * deepest + 127) / 255;
        let packed = |row: Vec<u8>| {
            let per_byte = 8 / usize::from(depth);
            let byte = |values: &[u8]| {
                let bits = values.iter().fold(0u16, |bits, v| bits << depth | level(v));
                (bits << (usize::from(depth) * (per_byte - values.len()))) as u8
            };
            row.chunks(per_byte).map(byte).collect::<Vec<u8>>()
        };
        let photo =
            Photo::decode(&png(depth, 0, &[], grey_rows().into_iter().map(packed)), Tone::Linear, SIZE).unwrap();
        let wanted: Vec<f32> = grey_rows().concat().iter().map(|v| f32::from(level(v)) / f32::from(deepest)).collect();
        assert!(furthest(&photo.light.values, &wanted) < 1e-6, "{depth} bits");
    }
}

/// EXIF with an orientation and nothing else.
fn exif(orientation: u8) -> Vec<u8> {
    let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
    [&b"II*\0"[..], &[8, 0, 0, 0, 1, 0], &entry, &[0; 4]].concat()
}

#[test]
fn photos_are_turned_the_way_the_camera_was_held() {
    let upright = scene().to_luma8();
    let size = [SIZE[1], SIZE[0]];
    // What a camera stores that was held so: the upright picture after the inverse of what a viewer does.
    let cases: [(u8, DynamicImage, [u32; 2]); 4] = [
        (1, upright.clone().into(), SIZE),
        (3, image::imageops::rotate180(&upright).into(), SIZE),
        (6, image::imageops::rotate270(&upright).into(), size),
        (8, image::imageops::rotate90(&upright).into(), size),
    ];
    let expected = Photo::decode(&encoded(&upright.into(), ImageFormat::Png), Tone::Linear, SIZE).unwrap().light;
    for (orientation, stored, stored_size) in cases {
        let mut file = encoded(&stored, ImageFormat::Png);
        assert!(Photo::decode(&file, Tone::Linear, stored_size).is_ok());
        // Behind the header of 8 bytes and the IHDR chunk of 25.
        file.splice(33..33, chunk(b"eXIf", &exif(orientation)));
        let photo = Photo::decode(&file, Tone::Linear, SIZE).unwrap_or_else(|e| panic!("{orientation}: {e}"));
        assert_eq!(photo.light, expected, "PNG, orientation {orientation}");

        let mut file = encoded(&stored, ImageFormat::Jpeg);
        let data = [&b"Exif\0\0"[..], &exif(orientation)].concat();
        let segment = [&[0xff, 0xe1][..], &(data.len() as u16 + 2).to_be_bytes(), &data].concat();
        file.splice(2..2, segment);
        let photo = Photo::decode(&file, Tone::Linear, SIZE).unwrap_or_else(|e| panic!("{orientation}: {e}"));
        assert!(furthest(&photo.light.values, &expected.values) < 0.25, "JPEG, orientation {orientation}");
    }
}

#[test]
fn a_photo_for_print_is_refused_in_words() {
    let error = Photo::decode(include_bytes!("data/cmyk.jpg"), Tone::Linear, SIZE).unwrap_err().to_string();
    assert!(error.contains("CMYK") && error.contains("grey or RGB"), "{error}");
}

#[test]
fn grey_is_the_same_light_in_every_lossless_file() {
    for tone in [Tone::Linear, Tone::Srgb] {
        let light = |image: DynamicImage, format| Photo::decode(&encoded(&image, format), tone, SIZE).unwrap().light;
        let grey = DynamicImage::from(scene().to_luma8());
        let deep = DynamicImage::from(grey.to_luma16());
        let expected = light(grey.clone(), ImageFormat::Png);
        for format in [ImageFormat::Png, ImageFormat::Tiff, ImageFormat::Bmp] {
            assert_eq!(light(grey.clone(), format), expected, "{format:?} grey");
            assert_eq!(light(grey.to_rgb8().into(), format), expected, "{format:?} colour");
            assert_eq!(light(grey.to_rgba8().into(), format), expected, "{format:?} colour with alpha");
        }
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            assert_eq!(light(deep.clone(), format), expected, "{format:?} grey, 16 bits");
            assert_eq!(light(deep.to_rgb16().into(), format), expected, "{format:?} colour, 16 bits");
        }
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
