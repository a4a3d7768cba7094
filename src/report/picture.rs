//! Grey and false-colour pictures as PNG.

use super::colour;
use super::html::png_uri;
use crate::runtime::grid::Grid;
use crate::runtime::photo::Tone;
use crate::view::item_buffer::ItemBuffer;
use image::{DynamicImage, GrayImage, Luma, Rgba, RgbaImage};

/// No picture in the page is wider or higher than this (px): a screen shows no more.
pub const LARGEST: u32 = 1280;
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// By how much a picture is reduced to fit.
pub fn reduction(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).div_ceil(LARGEST).max(1)
}

/// The mean of square blocks, for pictures that are too large.
pub fn grey(photo: &GrayImage) -> String {
    let by = reduction([photo.width(), photo.height()]);
    if by == 1 {
        return png_uri(&DynamicImage::ImageLuma8(photo.clone()));
    }
    let mean = |x: u32, y: u32| {
        let block = (0..by * by).map(|k| u32::from(photo.get_pixel(x * by + k % by, y * by + k / by).0[0]));
        Luma([(block.sum::<u32>() / (by * by)) as u8])
    };
    png_uri(&DynamicImage::ImageLuma8(GrayImage::from_fn(photo.width() / by, photo.height() / by, mean)))
}

/// Linear light as the station's camera would write it.
pub fn light(grid: &Grid, tone: Tone) -> String {
    let byte = |v: f32| match tone {
        Tone::Linear => (v.clamp(0.0, 1.0) * 255.0).round() as u8,
        Tone::Srgb => colour::srgb(f64::from(v)),
    };
    let picture =
        GrayImage::from_fn(grid.width as u32, grid.height as u32, |x, y| Luma([byte(grid.at(x as usize, y as usize))]));
    png_uri(&DynamicImage::ImageLuma8(picture))
}

/// Components in their colours, each face in a shade of its own; nothing where there is nothing.
pub fn items(buffer: &ItemBuffer) -> String {
    let picture = RgbaImage::from_fn(buffer.width as u32, buffer.height as u32, |x, y| {
        let i = y as usize * buffer.width + x as usize;
        match buffer.id[i] {
            0 => Rgba([0; 4]),
            id => {
                let ends = |j: usize| buffer.id.get(j).is_some_and(|o| *o != id);
                let turns = |j: usize| buffer.face.get(j).is_some_and(|f| *f != buffer.face[i]);
                let (right, down) = (i + 1, i + buffer.width);
                // Lines where components and faces end.
                let line = match () {
                    () if ends(right) || ends(down) => 0.3,
                    () if turns(right) || turns(down) => 0.7,
                    () => 1.0,
                };
                let shade = line * (0.7 + 0.3 * (f64::from(buffer.face[i]) * HUE_STEP).fract());
                let [r, g, b] = colour::component(id as usize - 1).map(|v| (f64::from(v) * shade) as u8);
                Rgba([r, g, b, 255])
            }
        }
    });
    png_uri(&DynamicImage::ImageRgba8(picture))
}

/// A mask in one colour.
pub fn mask(mask: &[Vec<bool>], [r, g, b]: [u8; 3]) -> String {
    const VEIL: u8 = 150;
    let width = mask.first().map_or(0, Vec::len) as u32;
    let picture = RgbaImage::from_fn(width, mask.len() as u32, |x, y| {
        let set = mask[y as usize].get(x as usize).copied().unwrap_or(false);
        Rgba([r, g, b, if set { VEIL } else { 0 }])
    });
    png_uri(&DynamicImage::ImageRgba8(picture))
}
