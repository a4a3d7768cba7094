//! What is seen of each component: the boxes and counts behind the nodes of the object tree (the paper's Fig. 10), and
//! the pixels that tell a faulty assembly from a good one.
//!
//! In: bodies, a camera and its [`ItemBuffer`]. Out: one [`Seen`] per body; masks. Never decides what a node is.

use super::item_buffer::{Footprint, ItemBuffer, Mask, PixelBox, PixelGrid};
use crate::runtime::camera::Camera;
use crate::scene::Body;

/// Difference in depth (mm) from which a pixel counts as changed: below what a step of a face would have to be to be
/// seen at all, above the play of a good fit.
pub const CHANGED_DEPTH: f64 = 0.1;

/// What a camera sees of one component.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    pub component: usize,
    /// Box of its whole projection, as if it stood alone (the paper's outer rectangle); `None` outside the image.
    pub full: Option<PixelBox>,
    /// Box of its visible part (the inner rectangle); `None` where all of it is hidden.
    pub visible: Option<PixelBox>,
    pub full_pixels: u32,
    pub visible_pixels: u32,
    /// Visible pixels of its faces that are seen at all, by face.
    pub faces: Vec<(u32, u32)>,
}

/// What `camera` sees of each body.
pub fn seen(bodies: &[Body], camera: &Camera) -> Vec<Seen> {
    seen_on_grid(bodies, camera, &PixelGrid::of(camera))
}

/// The same with a grid made before by [`PixelGrid::of`] the camera.
pub(super) fn seen_on_grid(bodies: &[Body], camera: &Camera, grid: &PixelGrid) -> Vec<Seen> {
    let (buffer, alone) = ItemBuffer::with_footprints(bodies, camera, grid);
    let (counts, boxes) = (buffer.counts(), buffer.boxes());
    let look = |(body, alone): (&Body, Footprint)| {
        let own = counts.range((body.component, 0)..=(body.component, u32::MAX));
        let faces: Vec<(u32, u32)> = own.map(|(&(_, face), &pixels)| (face, pixels)).collect();
        Seen {
            component: body.component,
            full: alone.frame,
            visible: boxes.get(&body.component).copied(),
            full_pixels: alone.pixels,
            visible_pixels: faces.iter().map(|&(_, pixels)| pixels).sum(),
            faces,
        }
    };
    bodies.iter().zip(alone).map(look).collect()
}

/// Visible pixels of the components asked for; 0 for one that has no body.
pub fn visible_pixels(seen: &[Seen], components: &[usize]) -> Vec<u32> {
    let pixels = |&component: &usize| seen.iter().filter(|s| s.component == component).map(|s| s.visible_pixels).sum();
    components.iter().map(pixels).collect()
}

/// The pixels in which two buffers of one camera differ: another component, another face, or the same face at another
/// depth (by more than [`CHANGED_DEPTH`]). Buffers of different sizes have nothing in common: the mask is empty.
pub fn change_mask(good: &ItemBuffer, faulty: &ItemBuffer) -> Mask {
    let (width, height) = (good.width, good.height);
    if (width, height) != (faulty.width, faulty.height) {
        return Mask { width: 0, height: 0, bits: Vec::new() };
    }
    let differs = |i: usize| {
        let depth_apart = f64::from((good.depth[i] - faulty.depth[i]).abs());
        good.id[i] != faulty.id[i] || good.face[i] != faulty.face[i] || depth_apart > CHANGED_DEPTH
    };
    Mask { width, height, bits: (0..width * height).map(differs).collect() }
}

/// The mask grown by `radius` px to every side: a square neighbourhood, one axis after the other.
pub fn dilate(mask: &Mask, radius: usize) -> Mask {
    let (width, height) = (mask.width, mask.height);
    let across = grow(&mask.bits, radius, (height, width), (width, 1));
    Mask { width, height, bits: grow(&across, radius, (width, height), (1, width)) }
}

/// Grows along lines: `lines` of them, `line_step` apart, each of `length` pixels `step` apart.
fn grow(bits: &[bool], radius: usize, (lines, length): (usize, usize), (line_step, step): (usize, usize)) -> Vec<bool> {
    let mut grown = vec![false; bits.len()];
    for line in 0..lines {
        let at = |k: usize| line * line_step + k * step;
        // Pixels up to `filled` are set already: every pixel is written once, whatever the radius.
        let mut filled = 0;
        for k in (0..length).filter(|&k| bits[at(k)]) {
            let end = (k + radius + 1).min(length);
            (k.saturating_sub(radius).max(filled)..end).for_each(|j| grown[at(j)] = true);
            filled = end;
        }
    }
    grown
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{block, body, overhead, placed};
    use super::*;

    /// A 10 mm cube with a 4 mm post on it, and a 40 mm roof hiding the right half of both.
    fn half_hidden() -> (Vec<Body>, Camera) {
        let cube = body(0, block([10.0, 10.0, 10.0]), placed(0.0, 0.0, 0.0));
        let post = body(1, block([4.0, 4.0, 5.0]), placed(0.0, 0.0, 10.0));
        let roof = body(2, block([40.0, 40.0, 1.0]), placed(20.0, 0.0, 30.0));
        (vec![cube, post, roof], overhead([160, 120], 1000.0, 400.0))
    }

    #[test]
    fn the_full_box_ignores_what_hides_the_part_and_the_visible_box_does_not() {
        let (bodies, camera) = half_hidden();
        let post = &seen(&bodies, &camera)[1];
        let (full, visible) = (post.full.unwrap(), post.visible.unwrap());
        // The post's top, 4 mm at 385 mm, is 10.4 px wide: 10 pixel centres.
        assert_eq!([full.x0, full.x1, full.y0, full.y1], [75, 85, 55, 65]);
        assert_eq!([visible.x0, visible.x1], [75, 80]);
        assert_eq!((post.full_pixels, post.visible_pixels), (100, 50));
        assert_eq!(post.faces.iter().map(|f| f.1).sum::<u32>(), 50);
    }

    #[test]
    fn counts_are_reported_for_the_components_asked_for() {
        let (bodies, camera) = half_hidden();
        let seen = seen(&bodies, &camera);
        let pixels = visible_pixels(&seen, &[1, 7, 2]);
        assert_eq!(pixels[..2], [50, 0]);
        assert_eq!(pixels[2], seen[2].full_pixels);
    }

    #[test]
    fn a_missing_post_changes_its_own_pixels_and_a_raised_one_too() {
        let (mut bodies, camera) = half_hidden();
        let good = ItemBuffer::of(&bodies, &camera);
        bodies[1].pose = placed(0.0, 0.0, 9.95);
        assert_eq!(change_mask(&good, &ItemBuffer::of(&bodies, &camera)).count(), 0);
        bodies[1].pose = placed(0.0, 0.0, 9.5);
        assert_eq!(change_mask(&good, &ItemBuffer::of(&bodies, &camera)), good.mask(1));
        bodies.remove(1);
        assert_eq!(change_mask(&good, &ItemBuffer::of(&bodies, &camera)), good.mask(1));
        assert_eq!(change_mask(&good, &good).count(), 0);
    }

    #[test]
    fn dilation_is_the_union_of_squares() {
        let (width, height) = (17, 9);
        let bits: Vec<bool> = (0..width * height).map(|i| i % 23 == 5 || i == 0).collect();
        let mask = Mask { width, height, bits };
        for radius in 0..5 {
            let grown = dilate(&mask, radius);
            for i in 0..width * height {
                let near = |j: usize| (j % width).abs_diff(i % width).max((j / width).abs_diff(i / width)) <= radius;
                let expected = (0..width * height).any(|j| mask.bits[j] && near(j));
                assert_eq!(grown.bits[i], expected, "{radius} {i}");
            }
        }
    }
}
