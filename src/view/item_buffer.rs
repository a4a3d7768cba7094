//! The item buffer: which component, which face and how far, for every pixel of a camera.
//!
//! In: bodies in the station's frame and a [`Camera`]. Out: an [`ItemBuffer`]: identities, counts, boxes, masks. Never
//! shades, never knows a design. How it is drawn: `raster`.

use super::raster::Canvas;
pub use super::raster::PixelGrid;
use super::raster::Stamps;
use crate::runtime::camera::{Camera, Vec3, dot};
use crate::scene::Body;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::Range;

/// What a camera sees, row by row from the top left pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct ItemBuffer {
    pub width: usize,
    pub height: usize,
    /// 0 for nothing, else 1 + component.
    pub id: Vec<u32>,
    /// Face of the component's solid; 0 where there is nothing.
    pub face: Vec<u32>,
    /// Distance along the view axis in mm; infinite where there is nothing.
    pub depth: Vec<f32>,
}

/// A set of pixels of an image, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    pub width: usize,
    pub height: usize,
    pub bits: Vec<bool>,
}

/// A rectangle of pixels, half open: x0 <= x < x1, y0 <= y < y1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PixelBox {
    pub x0: u32,
    pub y0: u32,
    pub x1: u32,
    pub y1: u32,
}

impl PixelBox {
    /// The smallest rectangle round both.
    pub(crate) fn around(&self, other: &PixelBox) -> PixelBox {
        PixelBox {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }
}

/// A stretch of a row in which one face is seen.
struct Run {
    component: usize,
    face: u32,
    y: u32,
    x0: u32,
    x1: u32,
}

impl Run {
    fn stretch(&self) -> PixelBox {
        PixelBox { x0: self.x0, y0: self.y, x1: self.x1, y1: self.y + 1 }
    }
}

/// What a body covers of the image as if it stood alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Footprint {
    /// The smallest rectangle round it; `None` outside the image.
    pub frame: Option<PixelBox>,
    pub pixels: u32,
}

impl Footprint {
    fn add(&mut self, pixel: usize, width: usize) {
        let (x, y) = ((pixel % width) as u32, (pixel / width) as u32);
        *self = self.and(&Footprint { frame: Some(PixelBox { x0: x, y0: y, x1: x + 1, y1: y + 1 }), pixels: 1 });
    }

    /// Of both, which have no pixel in common.
    fn and(&self, other: &Footprint) -> Footprint {
        let frame = match (self.frame, other.frame) {
            (Some(a), Some(b)) => Some(a.around(&b)),
            (a, b) => a.or(b),
        };
        Footprint { frame, pixels: self.pixels + other.pixels }
    }
}

/// A band of rows, drawn, with what each body covers of it.
struct Band {
    id: Vec<u32>,
    face: Vec<u32>,
    depth: Vec<f32>,
    alone: Vec<Footprint>,
}

impl Band {
    fn of(bodies: &[Body], camera: &Camera, grid: &PixelGrid, rows: Range<usize>) -> Band {
        let mut stamps = Stamps::new(grid, &rows);
        let mut canvas = Canvas::new(grid, rows);
        let mut look = |body: &Body| {
            let mut alone = Footprint::default();
            stamps.next_body();
            canvas.draw(body, camera, |pixel| {
                if stamps.is_new(pixel) {
                    alone.add(pixel, grid.width);
                }
            });
            alone
        };
        let alone = bodies.iter().map(&mut look).collect();
        let depth = canvas.depth.iter().map(|&z| z as f32).collect();
        Band { id: canvas.id, face: canvas.face, depth, alone }
    }
}

impl ItemBuffer {
    /// What `camera` sees of the bodies.
    pub fn of(bodies: &[Body], camera: &Camera) -> ItemBuffer {
        Self::on_grid(bodies, camera, &PixelGrid::of(camera))
    }

    /// The same with a grid made before by [`PixelGrid::of`] a camera of the same focal length, centre, k1, k2 and size.
    pub fn on_grid(bodies: &[Body], camera: &Camera, grid: &PixelGrid) -> ItemBuffer {
        let mut canvas = Canvas::new(grid, 0..grid.height);
        for body in bodies {
            canvas.draw(body, camera, |_| {});
        }
        ItemBuffer {
            width: grid.width,
            height: grid.height,
            depth: canvas.depth.iter().map(|&z| z as f32).collect(),
            id: canvas.id,
            face: canvas.face,
        }
    }

    /// The same, with what each body covers as if it stood alone. Bands of rows are drawn on all threads; what is seen in a row
    /// does not depend on how the rows are shared.
    pub(super) fn with_footprints(bodies: &[Body], camera: &Camera, grid: &PixelGrid) -> (ItemBuffer, Vec<Footprint>) {
        /// More bands than this cost more in triangles that are set up once in each than they share.
        const MOST_BANDS: usize = 4;
        let count = rayon::current_num_threads().clamp(1, MOST_BANDS);
        let row = |k: usize| grid.height * k / count;
        let bands: Vec<Band> =
            (0..count).into_par_iter().map(|k| Band::of(bodies, camera, grid, row(k)..row(k + 1))).collect();
        let covered = |i: usize| bands.iter().fold(Footprint::default(), |all, band| all.and(&band.alone[i]));
        let alone = (0..bodies.len()).map(covered).collect();
        let buffer = ItemBuffer {
            width: grid.width,
            height: grid.height,
            id: bands.iter().flat_map(|band| &band.id).copied().collect(),
            face: bands.iter().flat_map(|band| &band.face).copied().collect(),
            depth: bands.iter().flat_map(|band| &band.depth).copied().collect(),
        };
        (buffer, alone)
    }

    /// Pixels of every (component, face) that is seen at all.
    pub fn counts(&self) -> BTreeMap<(usize, u32), u32> {
        let mut counts = BTreeMap::new();
        self.runs().for_each(|run| *counts.entry((run.component, run.face)).or_insert(0) += run.x1 - run.x0);
        counts
    }

    /// The smallest rectangles round the visible parts of all components that are seen at all.
    pub fn boxes(&self) -> BTreeMap<usize, PixelBox> {
        let mut boxes: BTreeMap<usize, PixelBox> = BTreeMap::new();
        for run in self.runs() {
            let stretch = run.stretch();
            boxes.entry(run.component).and_modify(|b| *b = b.around(&stretch)).or_insert(stretch);
        }
        boxes
    }

    /// Number of pixels in which the component is seen.
    pub fn pixels(&self, component: usize) -> u32 {
        self.runs().filter(|run| run.component == component).map(|run| run.x1 - run.x0).sum()
    }

    /// The smallest rectangle round the visible part of the component; `None` where it is not seen.
    pub fn bbox(&self, component: usize) -> Option<PixelBox> {
        let own = self.runs().filter(|run| run.component == component).map(|run| run.stretch());
        own.reduce(|all, stretch| all.around(&stretch))
    }

    /// Row by row the stretches in which one face is seen: neighbours along a row mostly see the same one.
    fn runs(&self) -> impl Iterator<Item = Run> + '_ {
        (0..self.height).flat_map(|y| {
            let row = y * self.width..(y + 1) * self.width;
            let (id, face) = (&self.id[row.clone()], &self.face[row]);
            let mut x = 0;
            std::iter::from_fn(move || {
                while id.get(x) == Some(&0) {
                    x += 1;
                }
                let item = (*id.get(x)?, face[x]);
                let start = x;
                while x < id.len() && (id[x], face[x]) == item {
                    x += 1;
                }
                Some(Run { component: item.0 as usize - 1, face: item.1, y: y as u32, x0: start as u32, x1: x as u32 })
            })
        })
    }

    /// The pixels in which the component is seen.
    pub fn mask(&self, component: usize) -> Mask {
        let bits = self.id.iter().map(|&id| id as usize == component + 1).collect();
        Mask { width: self.width, height: self.height, bits }
    }

    /// The world position (mm) seen in the centre of pixel (x, y) of `camera`, the camera the buffer was made for.
    pub fn point(&self, [x, y]: [usize; 2], camera: &Camera) -> Option<Vec3> {
        let depth = f64::from(*self.depth.get(y * self.width + x)?);
        if x >= self.width || !depth.is_finite() {
            return None;
        }
        let ray = camera.ray([x as f64 + 0.5, y as f64 + 0.5]);
        let along = depth / dot(ray, camera.axes[2]);
        Some([0, 1, 2].map(|i| camera.position[i] + along * ray[i]))
    }
}

impl Mask {
    /// Number of pixels set.
    pub fn count(&self) -> usize {
        self.bits.iter().filter(|&&bit| bit).count()
    }

    /// The smallest rectangle round the set pixels.
    pub fn bbox(&self) -> Option<PixelBox> {
        let set = self.bits.iter().enumerate().filter(|&(_, &bit)| bit);
        let at = set.map(|(i, _)| ((i % self.width) as u32, (i / self.width) as u32));
        at.fold(None, |found: Option<PixelBox>, (x, y)| {
            let b = found.unwrap_or(PixelBox { x0: x, y0: y, x1: x, y1: y });
            Some(PixelBox { x0: b.x0.min(x), y0: b.y0, x1: b.x1.max(x + 1), y1: y + 1 })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{block, body, cylinder, overhead, placed};
    use super::*;
    use nalgebra::{Isometry3, UnitQuaternion, Vector3};
    use std::f64::consts::FRAC_PI_2;

    /// What the ray through each pixel centre meets first, by trying every triangle.
    fn by_rays(bodies: &[Body], camera: &Camera) -> ItemBuffer {
        let [width, height] = camera.size.map(|n| n as usize);
        let pixels = width * height;
        let mut buffer = ItemBuffer {
            width,
            height,
            id: vec![0; pixels],
            face: vec![0; pixels],
            depth: vec![f32::INFINITY; pixels],
        };
        for i in 0..pixels {
            let ray = camera.ray([(i % width) as f64 + 0.5, (i / width) as f64 + 0.5]);
            let hits = bodies.iter().flat_map(|body| hits(body, camera.position, ray));
            if let Some((t, id, face)) = hits.min_by(|a, b| a.0.total_cmp(&b.0)) {
                (buffer.id[i], buffer.face[i]) = (id, face);
                buffer.depth[i] = (t * dot(ray, camera.axes[2])) as f32;
            }
        }
        buffer
    }

    /// Front faces of a body along a ray, after Möller and Trumbore (1997).
    fn hits(body: &Body, origin: Vec3, ray: Vec3) -> Vec<(f64, u32, u32)> {
        let (origin, ray) = (Vector3::from(origin), Vector3::from(ray));
        let meet = |(corners, &face): (&[u32; 3], &u32)| {
            let [a, b, c] = corners.map(|i| (body.pose * body.mesh.positions[i as usize]).coords);
            let (ab, ac, to) = (b - a, c - a, origin - a);
            let det = ab.dot(&ray.cross(&ac));
            let (u, v) = (to.dot(&ray.cross(&ac)) / det, ray.dot(&to.cross(&ab)) / det);
            let t = ac.dot(&to.cross(&ab)) / det;
            (det > 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((
                t,
                1 + body.component as u32,
                face,
            ))
        };
        body.mesh.triangles.iter().zip(&body.mesh.faces).filter_map(meet).collect()
    }

    /// Pins through a tilted plate on a base: overlaps, slivers, mated faces.
    fn assembly() -> Vec<Body> {
        let tilt = Isometry3::rotation(Vector3::new(0.05, 0.1, 0.3));
        vec![
            body(0, block([60.0, 50.0, 6.0]), tilt),
            body(1, cylinder(40.0, 5.0, 90), tilt * placed(0.0, 0.0, 6.0)),
            body(2, cylinder(6.0, 20.0, 40), tilt * placed(12.0, 3.0, 6.0)),
            body(3, cylinder(3.0, 25.0, 24), tilt * placed(-9.0, -11.0, 2.0)),
            body(4, block([7.0, 9.0, 11.0]), tilt * placed(-8.0, 9.0, 11.0)),
        ]
    }

    fn oblique(k1: f64) -> Camera {
        let camera = Camera::look_at([90.0, -150.0, 260.0], [0.0, 0.0, 8.0], 540.0, [160, 120]);
        Camera { k1, ..camera }
    }

    fn disagreement(a: &ItemBuffer, b: &ItemBuffer) -> f64 {
        let differs = |&i: &usize| a.id[i] != b.id[i] || a.face[i] != b.face[i];
        (0..a.id.len()).filter(differs).count() as f64 / a.id.len() as f64
    }

    #[test]
    fn agrees_with_rays_at_any_distortion() {
        for k1 in [0.0, -0.05, 0.08] {
            let (camera, bodies) = (oblique(k1), assembly());
            let (drawn, traced) = (ItemBuffer::of(&bodies, &camera), by_rays(&bodies, &camera));
            assert!(drawn.counts().keys().map(|k| k.0).collect::<Vec<_>>().contains(&3));
            assert!(disagreement(&drawn, &traced) <= 1e-3, "k1 {k1}: {}", disagreement(&drawn, &traced));
            for i in (0..drawn.id.len()).filter(|&i| drawn.face[i] == traced.face[i] && drawn.id[i] == traced.id[i]) {
                assert!(drawn.depth[i] == traced.depth[i] || (drawn.depth[i] - traced.depth[i]).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn a_floor_that_reaches_behind_the_camera_is_not_clipped_wrongly() {
        let floor = body(0, block([3000.0, 3000.0, 10.0]), placed(3.0, 4.0, -10.0));
        let camera = Camera::look_at([0.0, 0.0, 30.0], [200.0, 10.0, 20.0], 100.0, [160, 120]);
        let bodies = [floor];
        let drawn = ItemBuffer::of(&bodies, &camera);
        assert!(drawn.pixels(0) > 5000);
        assert!(disagreement(&drawn, &by_rays(&bodies, &camera)) <= 1e-3);
    }

    #[test]
    fn edges_through_pixel_centres_belong_to_one_side_only() {
        // One mm is one pixel on the top face, and corners lie on pixel centres: 20 × 14 centres, each counted once
        // though the diagonal of the square part runs through centres as well.
        let camera = overhead([64, 64], 400.0, 410.0);
        let left = body(0, block([14.0, 14.0, 10.0]), placed(-6.5, 0.5, 0.0));
        let right = body(1, block([6.0, 14.0, 10.0]), placed(3.5, 0.5, 0.0));
        let buffer = ItemBuffer::of(&[left, right], &camera);
        assert_eq!(buffer.counts().into_iter().collect::<Vec<_>>(), [((0, 1), 14 * 14), ((1, 1), 6 * 14)]);
    }

    #[test]
    fn a_quarter_turn_permutes_the_picture() {
        let camera = Camera { k1: -0.03, ..overhead([100, 100], 500.0, 330.0) };
        let turned: Vec<Body> = assembly()
            .into_iter()
            .map(|b| Body { pose: Isometry3::rotation(Vector3::z() * FRAC_PI_2) * b.pose, ..b })
            .collect();
        let (before, after) = (ItemBuffer::of(&assembly(), &camera), ItemBuffer::of(&turned, &camera));
        assert_eq!(before.counts(), after.counts());
        // A turn from +x to +y is counter-clockwise in an image whose y runs down.
        let same = |(x, y): (usize, usize)| before.id[y * 100 + x] == after.id[(99 - x) * 100 + y];
        assert!((0..10_000).all(|i| same((i % 100, i / 100))));
    }

    #[test]
    fn flush_faces_show_the_lower_component_in_any_order() {
        let turn =
            Isometry3::from_parts(placed(1.0, 2.0, 3.0).translation, UnitQuaternion::from_euler_angles(0.2, 0.1, 0.7));
        let plate = body(2, block([40.0, 40.0, 6.0]), turn);
        let pin = body(5, cylinder(10.0, 6.0, 48), turn * placed(5.0, 0.0, 0.0));
        let camera = oblique(-0.02);
        let buffer = ItemBuffer::of(&[plate.clone(), pin.clone()], &camera);
        assert_eq!(buffer.pixels(5), 0);
        assert_eq!(buffer, ItemBuffer::of(&[pin, plate], &camera));
    }

    #[test]
    fn counts_boxes_and_masks_tell_the_same() {
        let (camera, bodies) = (oblique(-0.05), assembly());
        let buffer = ItemBuffer::of(&bodies, &camera);
        let covered = buffer.id.iter().filter(|&&id| id != 0).count();
        assert_eq!(buffer.counts().values().sum::<u32>() as usize, covered);
        for component in 0..5 {
            let (mask, frame) = (buffer.mask(component), buffer.bbox(component).unwrap());
            assert_eq!(mask.count() as u32, buffer.pixels(component));
            let inside = |i: usize| {
                let (x, y) = ((i % 160) as u32, (i / 160) as u32);
                (frame.x0..frame.x1).contains(&x) && (frame.y0..frame.y1).contains(&y)
            };
            assert!((0..mask.bits.len()).all(|i| !mask.bits[i] || inside(i)));
        }
        assert_eq!(buffer.bbox(9), None);
    }

    #[test]
    fn bands_of_rows_are_the_whole_on_any_number_of_threads() {
        let (camera, bodies) = (oblique(-0.05), assembly());
        let whole = ItemBuffer::of(&bodies, &camera);
        let alone = |body: &Body| {
            let buffer = ItemBuffer::of(std::slice::from_ref(body), &camera);
            Footprint { frame: buffer.bbox(body.component), pixels: buffer.pixels(body.component) }
        };
        let footprints: Vec<Footprint> = bodies.iter().map(alone).collect();
        assert!(footprints.iter().any(|f| f.frame.is_some_and(|frame| frame.y1 - frame.y0 > 60)), "across the bands");
        let grid = PixelGrid::of(&camera);
        for threads in [1, 2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (buffer, found) = pool.install(|| ItemBuffer::with_footprints(&bodies, &camera, &grid));
            assert!(buffer == whole && found == footprints, "{threads} threads");
        }
    }

    #[test]
    fn a_pixel_leads_back_to_the_surface() {
        let camera = oblique(-0.05);
        let bodies = [body(0, block([80.0, 80.0, 6.0]), placed(0.0, 0.0, 2.0))];
        let buffer = ItemBuffer::of(&bodies, &camera);
        let tops = (0..buffer.id.len()).filter(|&i| buffer.id[i] == 1 && buffer.face[i] == 1);
        let mut seen = 0;
        for i in tops {
            let p = buffer.point([i % 160, i / 160], &camera).unwrap();
            assert!((p[2] - 8.0).abs() < 1e-4 && p[0].abs() < 40.001, "{p:?}");
            seen += 1;
        }
        assert!(seen > 3000);
        assert_eq!(buffer.point([0, 0], &camera), None);
        assert_eq!(buffer.point([160, 119], &camera), None);
    }
}
