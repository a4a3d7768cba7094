//! The item buffer: which component, which face and how far, for every pixel of a camera.
//!
//! In: bodies in the station's frame and a [`Camera`]. Out: an [`ItemBuffer`]. Never shades, never knows a design.
//!
//! A scanline rasteriser in homogeneous coordinates (Olano and Greer 1997, "Triangle scan conversion using 2D homogeneous
//! coordinates"): with the camera at the origin, the ray (u, v, 1) passes inside the edge a → b of a triangle when
//! (b × a) · (u, v, 1) > 0. The edge function needs no division by depth, so nothing is clipped at a near plane and a
//! triangle may reach behind the camera. Its value only changes sign when the edge is walked the other way, bit for
//! bit, so triangles that share an edge neither overlap nor leave a gap.
//!
//! Distortion is exact for any mesh: triangles stay straight and it is the pixel centres that are moved, once per lens
//! ([`PixelGrid`]). Back faces are culled, which takes the coincident faces of mated parts out of each other's way.

use crate::runtime::camera::{Camera, Vec3, cross, dot};
use crate::scene::Body;
use nalgebra::{Matrix4, RowVector4};
use std::collections::BTreeMap;
use std::ops::Range;

/// Depths (mm) closer than this are the same surface, and the lower (component, face) is seen. Well above rounding at
/// any working distance (1e-10 mm at 1 m), well below any fit.
const COINCIDENT: f64 = 1e-6;
/// Depth (mm) below which a vertex has no useful projection: the triangle is then bounded by its edges alone.
const NEAR: f64 = 1e-3;
/// How far (tangent of the angle) a span is widened before the exact test: a millionth of a pixel, far above rounding.
const SLACK: f64 = 1e-9;
/// Relative rounding error of an edge function, generously.
const ROUNDING: f64 = 1e-14;
/// The strongest inward distortion (k1 r² of the seen radius) that can be undone: at -4/27 the image folds over.
const FOLD: f64 = -0.148;

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

/// The directions of a camera's pixel centres, distortion undone: shared by all cameras of the same lens and sensor.
#[derive(Debug, Clone)]
pub struct PixelGrid {
    width: usize,
    height: usize,
    /// In px.
    focal: f64,
    centre: [f64; 2],
    /// k1 for radii in tangents.
    bend: f64,
    /// Tangents to the right and down of the ray through each pixel centre; `u` grows along every row.
    u: Vec<f64>,
    v: Vec<f64>,
    /// Least and greatest `v` of each row.
    row_v: Vec<[f64; 2]>,
}

impl ItemBuffer {
    /// What `camera` sees of the bodies.
    pub fn of(bodies: &[Body], camera: &Camera) -> ItemBuffer {
        Self::on_grid(bodies, camera, &PixelGrid::of(camera))
    }

    /// The same with a grid made before by [`PixelGrid::of`] a camera of the same focal length, centre, k1 and size.
    pub fn on_grid(bodies: &[Body], camera: &Camera, grid: &PixelGrid) -> ItemBuffer {
        let mut canvas = Canvas::new(grid);
        for body in bodies {
            canvas.draw(body, camera);
        }
        ItemBuffer {
            width: grid.width,
            height: grid.height,
            id: canvas.item.iter().map(|item| item[0]).collect(),
            face: canvas.item.iter().map(|item| item[1]).collect(),
            depth: canvas.depth.iter().map(|&z| z as f32).collect(),
        }
    }

    /// Pixels of every (component, face) that is seen at all.
    pub fn counts(&self) -> BTreeMap<(usize, u32), u32> {
        let mut counts = BTreeMap::new();
        let mut start = 0;
        // Neighbours along a row mostly see the same face: one entry per run, not per pixel.
        for end in 1..=self.id.len() {
            if end < self.id.len() && self.id[end] == self.id[start] && self.face[end] == self.face[start] {
                continue;
            }
            if self.id[start] != 0 {
                *counts.entry((self.id[start] as usize - 1, self.face[start])).or_insert(0) += (end - start) as u32;
            }
            start = end;
        }
        counts
    }

    /// Number of pixels in which the component is seen.
    pub fn pixels(&self, component: usize) -> u32 {
        self.id.iter().filter(|&&id| id as usize == component + 1).count() as u32
    }

    /// The smallest rectangle round the visible part of the component; `None` where it is not seen.
    pub fn bbox(&self, component: usize) -> Option<PixelBox> {
        self.mask(component).bbox()
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

impl PixelGrid {
    /// The grid of a camera; only its focal length, centre, k1 and size count.
    pub fn of(camera: &Camera) -> PixelGrid {
        let [width, height] = camera.size.map(|n| n as usize);
        let centres = (0..height).flat_map(|y| (0..width).map(move |x| [x as f64 + 0.5, y as f64 + 0.5]));
        let (u, v): (Vec<f64>, Vec<f64>) = centres.map(|pixel| tangents(camera, pixel)).unzip();
        let ends = |row: &[f64]| row.iter().fold([f64::MAX, f64::MIN], |[l, h], &v| [l.min(v), h.max(v)]);
        let row_v = v.chunks(width.max(1)).map(ends).collect();
        let bend = camera.k1 * (camera.focal / camera.centre[0]).powi(2);
        PixelGrid { width, height, focal: camera.focal, centre: camera.centre, bend, u, v, row_v }
    }

    /// The rows that may hold directions with `v` between `low` and `high`.
    fn rows(&self, [low, high]: [f64; 2]) -> Range<usize> {
        let guess = |v: f64| self.guess(v, 0.0, self.centre[1]);
        let first = seek(self.height, guess(low), |y| self.row_v[y][1] < low - SLACK);
        first..seek(self.height, guess(high), |y| self.row_v[y][0] <= high + SLACK).max(first)
    }

    /// The pixels (indices into the image) of row `y` that may lie in the triangle.
    fn span(&self, y: usize, triangle: &Triangle) -> Range<usize> {
        let limits @ [low, high] = self.row_v[y];
        let across = (low + high) / 2.0;
        let [low, high] = triangle.across(limits);
        let start = y * self.width;
        let row = &self.u[start..start + self.width];
        let guess = |u: f64| self.guess(u, across, self.centre[0]);
        let first = seek(row.len(), guess(low), |x| row[x] < low - SLACK);
        start + first..start + seek(row.len(), guess(high), |x| row[x] <= high + SLACK).max(first)
    }

    /// About where along its axis a direction is seen: tangents along and across the axis, principal point along it.
    fn guess(&self, along: f64, across: f64, centre: f64) -> usize {
        (centre + self.focal * along * (1.0 + self.bend * (along * along + across * across))) as usize
    }
}

/// The first index from which `before` is false (it is true, then false, over 0..length), sought from a good guess.
fn seek(length: usize, guess: usize, before: impl Fn(usize) -> bool) -> usize {
    let mut at = guess.min(length);
    while at > 0 && !before(at - 1) {
        at -= 1;
    }
    while at < length && before(at) {
        at += 1;
    }
    at
}

/// Tangents of the ray through a pixel: the inverse of [`Camera::project`], by Newton's method.
///
/// With the seen radius s and k = k1 s², the undistorted radius is t s where t + k t³ = 1.
fn tangents(camera: &Camera, pixel: [f64; 2]) -> (f64, f64) {
    let seen = [pixel[0] - camera.centre[0], pixel[1] - camera.centre[1]];
    let k = (camera.k1 * (seen[0] * seen[0] + seen[1] * seen[1]) / camera.centre[0].powi(2)).max(FOLD);
    let mut t = 1.0;
    // Quadratic convergence from an error below 0.5: six rounds reach rounding for every lens short of folding.
    for _ in 0..if k == 0.0 { 0 } else { 6 } {
        t -= (t + k * t * t * t - 1.0) / (1.0 + 3.0 * k * t * t);
    }
    (seen[0] * t / camera.focal, seen[1] * t / camera.focal)
}

/// The buffer while it is drawn: items are (1 + component, face), depth in mm.
struct Canvas<'a> {
    grid: &'a PixelGrid,
    item: Vec<[u32; 2]>,
    depth: Vec<f64>,
}

impl<'a> Canvas<'a> {
    fn new(grid: &'a PixelGrid) -> Self {
        let pixels = grid.width * grid.height;
        Canvas { grid, item: vec![[0; 2]; pixels], depth: vec![f64::INFINITY; pixels] }
    }

    fn draw(&mut self, body: &Body, camera: &Camera) {
        let to_camera = to_camera(camera) * body.pose.to_matrix();
        let seen: Vec<Vec3> = body.mesh.positions.iter().map(|p| to_camera.transform_point(p).into()).collect();
        for (corners, &face) in body.mesh.triangles.iter().zip(&body.mesh.faces) {
            if let Some(triangle) = Triangle::new(corners.map(|i| seen[i as usize])) {
                self.fill(&triangle, [1 + body.component as u32, face]);
            }
        }
    }

    fn fill(&mut self, triangle: &Triangle, item: [u32; 2]) {
        for y in self.grid.rows(triangle.v) {
            for i in self.grid.span(y, triangle) {
                if let Some(depth) = triangle.depth(self.grid.u[i], self.grid.v[i])
                    && in_front((depth, item), (self.depth[i], self.item[i]))
                {
                    self.depth[i] = depth;
                    self.item[i] = item;
                }
            }
        }
    }
}

/// Nearer wins; at the same depth the lower (component, face) does.
fn in_front((depth, item): (f64, [u32; 2]), (old_depth, old_item): (f64, [u32; 2])) -> bool {
    depth < old_depth - COINCIDENT || (depth <= old_depth + COINCIDENT && item < old_item)
}

/// World frame to camera frame.
fn to_camera(camera: &Camera) -> Matrix4<f64> {
    let rows = camera.axes.map(|[x, y, z]| RowVector4::new(x, y, z, -dot([x, y, z], camera.position)));
    Matrix4::from_rows(&[rows[0], rows[1], rows[2], RowVector4::new(0.0, 0.0, 0.0, 1.0)])
}

/// A triangle that faces the camera, in the camera's frame.
struct Triangle {
    /// Edge functions: e · (u, v, 1) is positive inside.
    edges: [Vec3; 3],
    /// Six times the volume of the tetrahedron with the camera; the depth is this over the sum of the edge functions.
    volume: f64,
    /// Lines u = p + q v that bound it to the left and to the right, widened by rounding.
    left: [[f64; 2]; 3],
    right: [[f64; 2]; 3],
    /// Bounds of its directions.
    u: [f64; 2],
    v: [f64; 2],
}

impl Triangle {
    /// `None` for triangles that show their back or lie behind the camera.
    fn new([a, b, c]: [Vec3; 3]) -> Option<Triangle> {
        let volume = -dot(a, cross(b, c));
        if volume <= 0.0 || a[2].max(b[2]).max(c[2]) <= 0.0 {
            return None;
        }
        let edges = [cross(b, a), cross(c, b), cross(a, c)];
        let is_near = a[2].min(b[2]).min(c[2]) < NEAR;
        let bounds = |axis: usize| {
            if is_near {
                return [f64::MIN, f64::MAX];
            }
            let [p, q, r] = [a, b, c].map(|corner| corner[axis] / corner[2]);
            [p.min(q).min(r), p.max(q).max(r)]
        };
        let left = edges.map(|e| if e[0] > 0.0 { line(e, 1.0) } else { [f64::MIN, 0.0] });
        let right = edges.map(|e| if e[0] < 0.0 { line(e, -1.0) } else { [f64::MAX, 0.0] });
        Some(Triangle { edges, volume, left, right, u: bounds(0), v: bounds(1) })
    }

    /// Bounds of `u` in the triangle over all `v` between the two given; low above high where there are none.
    fn across(&self, [v0, v1]: [f64; 2]) -> [f64; 2] {
        let low = self.left.iter().fold(self.u[0], |low, [p, q]| low.max(p + (q * v0).min(q * v1)));
        let high = self.right.iter().fold(self.u[1], |high, [p, q]| high.min(p + (q * v0).max(q * v1)));
        [low, high]
    }

    /// Depth (mm along the view axis) of the point seen in direction (u, v, 1); `None` outside.
    ///
    /// A direction exactly on an edge belongs to the triangle for which it is a left edge, or a top edge if level.
    fn depth(&self, u: f64, v: f64) -> Option<f64> {
        let mut sum = 0.0;
        for [a, b, c] in self.edges {
            let inside = a * u + b * v + c;
            let owned = a > 0.0 || (a == 0.0 && b > 0.0);
            if inside < 0.0 || (inside == 0.0 && !owned) {
                return None;
            }
            sum += inside;
        }
        (sum > 0.0).then(|| self.volume / sum)
    }
}

/// The line u = p + q v on which an edge function vanishes, moved outwards (`side`: 1 left, -1 right) by its rounding.
fn line([a, b, c]: Vec3, side: f64) -> [f64; 2] {
    [-c / a - side * ROUNDING * (c.abs() + b.abs()) / a.abs(), -b / a]
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

    #[test]
    fn undistorted_pixel_centres_project_back() {
        for k1 in [-0.09, -0.025, 0.0, 0.2] {
            let camera =
                Camera { position: [0.0; 3], axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], ..oblique(k1) };
            let grid = PixelGrid::of(&camera);
            for i in (0..grid.u.len()).step_by(97) {
                let [x, y] = camera.project([grid.u[i], grid.v[i], 1.0]).unwrap();
                assert!((x - (i % 160) as f64 - 0.5).abs() < 1e-9 && (y - (i / 160) as f64 - 0.5).abs() < 1e-9);
            }
        }
    }
}
