//! An item buffer as a picture for people: a colour per component, a shade per face.
//!
//! In: an [`ItemBuffer`]. Out: an image. Never read back by any stage.

use super::item_buffer::ItemBuffer;
use image::{Rgb, RgbImage};

/// Turn of the hue from one component to the next: the golden ratio keeps any number of them apart.
const HUE_STEP: f64 = 0.618_033_988_749_895;

/// False colours: hue by component, brightness by face, black where there is nothing.
pub fn false_colour(buffer: &ItemBuffer) -> RgbImage {
    RgbImage::from_fn(buffer.width as u32, buffer.height as u32, |x, y| {
        let i = y as usize * buffer.width + x as usize;
        if buffer.id[i] == 0 { Rgb([0; 3]) } else { colour(buffer.id[i], buffer.face[i]) }
    })
}

fn colour(id: u32, face: u32) -> Rgb<u8> {
    let hue = (f64::from(id) * HUE_STEP).fract() * 6.0;
    let bright = 90.0 + 165.0 * (f64::from(face) * HUE_STEP).fract();
    let channel = |offset: f64| {
        let distance = ((hue + offset).rem_euclid(6.0) - 3.0).abs() - 1.0;
        (bright * (0.25 + 0.75 * distance.clamp(0.0, 1.0))) as u8
    };
    Rgb([channel(0.0), channel(4.0), channel(2.0)])
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{block, body, overhead, placed};
    use super::*;

    #[test]
    fn components_differ_and_nothing_is_black() {
        let bodies =
            [body(0, block([9.0; 3]), placed(-8.0, 0.0, 0.0)), body(1, block([9.0; 3]), placed(8.0, 0.0, 0.0))];
        let buffer = ItemBuffer::of(&bodies, &overhead([64, 48], 500.0, 400.0));
        let picture = false_colour(&buffer);
        assert_eq!(picture.get_pixel(0, 0), &Rgb([0; 3]));
        assert_ne!(picture.get_pixel(22, 24), picture.get_pixel(42, 24));
    }
}
