//! The scanline rasteriser behind the item buffer.
//!
//! In: bodies and a camera's [`PixelGrid`]. Out: item and depth of every pixel, or the pixels of each body alone. Never shades.
//!
//! Homogeneous coordinates (Olano and Greer 1997, "Triangle scan conversion using 2D homogeneous coordinates"): with the
//! camera at the origin, the ray (u, v, 1) passes inside the edge a → b of a triangle when (b × a) · (u, v, 1) > 0. The
//! edge function needs no division by depth, so nothing is clipped at a near plane and a triangle may reach behind the
//! camera. It only changes sign when the edge is walked the other way, bit for bit, so triangles that share an edge
//! neither overlap nor leave a gap.
//!
//! Distortion is exact for any mesh: triangles stay straight and it is the pixel centres that are moved, once per lens.
//! Back faces are culled, which takes the coincident faces of mated parts out of each other's way; for the coincident
//! front faces of parts that overlap there is a rule that does not depend on the order of drawing.

use crate::runtime::camera::{Camera, Vec3, cross, dot};
use crate::scene::Body;
use nalgebra::{Matrix4, RowVector4};
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

/// The directions of a camera's pixel centres, distortion undone: shared by all cameras of the same lens and sensor.
#[derive(Debug, Clone)]
pub struct PixelGrid {
    pub(super) width: usize,
    pub(super) height: usize,
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

impl PixelGrid {
    /// The grid of a camera; only its focal length, centre, k1, k2 and size count.
    pub fn of(camera: &Camera) -> PixelGrid {
        let [width, height] = camera.size.map(|n| n as usize);
        let (u, v) = directions(camera, width, height);
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

/// Tangents of the rays through all pixel centres, to the right and down.
fn directions(camera: &Camera, width: usize, height: usize) -> (Vec<f64>, Vec<f64>) {
    let off = |k: usize, centre: f64| k as f64 + 0.5 - centre;
    let [across, down] = [(width, 0), (height, 1)].map(|(n, axis)| {
        let offs: Vec<f64> = (0..n).map(|k| off(k, camera.centre[axis])).collect();
        offs
    });
    let (mut u, mut v) = (vec![0.0; width * height], vec![0.0; width * height]);
    for y in 0..height {
        let (row, mirrored) = (y * width, height - 1 - y);
        // A lens bends alike above and below its axis, left and right of it: a quarter of the image tells all.
        if mirrored < y && down[y] == -down[mirrored] {
            let from = mirrored * width;
            u.copy_within(from..from + width, row);
            (0..width).for_each(|x| v[row + x] = -v[from + x]);
            continue;
        }
        for x in 0..width {
            let twin = width - 1 - x;
            (u[row + x], v[row + x]) = if twin < x && across[x] == -across[twin] {
                (-u[row + twin], v[row + twin])
            } else {
                tangents(camera, [across[x], down[y]])
            };
        }
    }
    (u, v)
}

/// Tangents of the ray through a place of the image, from its centre in px: the inverse of [`Camera::project`], by Newton's
/// method.
///
/// With the seen radius s, k = k1 s² and q = k2 s⁴, the undistorted radius is t s where t + k t³ + q t⁵ = 1.
fn tangents(camera: &Camera, seen: [f64; 2]) -> (f64, f64) {
    let k = (camera.k1 * (seen[0] * seen[0] + seen[1] * seen[1]) / camera.centre[0].powi(2)).max(FOLD);
    let mut t = 1.0;
    // Quadratic convergence from an error below 0.5: six rounds reach rounding for every lens short of folding.
    if camera.k2 != 0.0 {
        let s2 = (seen[0] * seen[0] + seen[1] * seen[1]) / camera.centre[0].powi(2);
        let t = undistorted(camera.k1 * s2, camera.k2 * s2 * s2);
        return (seen[0] * t / camera.focal, seen[1] * t / camera.focal);
    }
    for _ in 0..if k == 0.0 { 0 } else { 6 } {
        t -= (t + k * t * t * t - 1.0) / (1.0 + 3.0 * k * t * t);
    }
    (seen[0] * t / camera.focal, seen[1] * t / camera.focal)
}

/// The root of t + k t³ + q t⁵ = 1 next to 1. Where the lens folds the image over, which no spec may ask for but an
/// installation error might reach, the steps stay short.
fn undistorted(k: f64, q: f64) -> f64 {
    const STEEPEST: f64 = 0.1;
    let mut t: f64 = 1.0;
    for _ in 0..12 {
        let t2 = t * t;
        t -= (t * (1.0 + k * t2 + q * t2 * t2) - 1.0) / (1.0 + 3.0 * k * t2 + 5.0 * q * t2 * t2).max(STEEPEST);
    }
    t
}

/// A band of rows of the buffer while it is drawn, pixels counted from its first: items are (1 + component, face), depth in mm.
pub(super) struct Canvas<'a> {
    grid: &'a PixelGrid,
    band: Range<usize>,
    pub(super) id: Vec<u32>,
    pub(super) face: Vec<u32>,
    pub(super) depth: Vec<f64>,
}

impl<'a> Canvas<'a> {
    pub(super) fn new(grid: &'a PixelGrid, band: Range<usize>) -> Self {
        let pixels = grid.width * band.len();
        Canvas { grid, band, id: vec![0; pixels], face: vec![0; pixels], depth: vec![f64::INFINITY; pixels] }
    }

    /// Draws a body and calls `met` with every pixel (of the image) that a triangle of it meets, hidden or not, as often as
    /// one does.
    pub(super) fn draw(&mut self, body: &Body, camera: &Camera, mut met: impl FnMut(usize)) {
        let (id, first) = (1 + body.component as u32, self.band.start * self.grid.width);
        scan(self.grid, self.band.clone(), body, camera, |pixel, depth, face| {
            let i = pixel - first;
            if in_front((depth, [id, face]), (self.depth[i], [self.id[i], self.face[i]])) {
                (self.depth[i], self.id[i], self.face[i]) = (depth, id, face);
            }
            if depth.is_finite() {
                met(pixel);
            }
        });
    }
}

/// Which pixels of a band single bodies cover, one body after the other: a pixel is never cleared, it only remembers the last
/// body.
pub(super) struct Stamps {
    first: usize,
    last: Vec<u32>,
    bodies: u32,
}

impl Stamps {
    pub(super) fn new(grid: &PixelGrid, band: &Range<usize>) -> Self {
        Stamps { first: band.start * grid.width, last: vec![0; grid.width * band.len()], bodies: 0 }
    }

    /// From here on pixels are another body's.
    pub(super) fn next_body(&mut self) {
        self.bodies += 1;
    }

    /// Whether the body meets this pixel (of the image) for the first time.
    pub(super) fn is_new(&mut self, pixel: usize) -> bool {
        let last = &mut self.last[pixel - self.first];
        let is_new = *last != self.bodies;
        *last = self.bodies;
        is_new
    }
}

/// Calls `visit` with every pixel, depth and face where a triangle of the body faces the camera, in the rows of a band.
fn scan(grid: &PixelGrid, band: Range<usize>, body: &Body, camera: &Camera, mut visit: impl FnMut(usize, f64, u32)) {
    let to_camera = to_camera(camera) * body.pose.to_matrix();
    let seen: Vec<Vec3> = body.mesh.positions.iter().map(|p| to_camera.transform_point(p).into()).collect();
    for (corners, &face) in body.mesh.triangles.iter().zip(&body.mesh.faces) {
        let Some(triangle) = Triangle::new(corners.map(|i| seen[i as usize])) else { continue };
        let rows = grid.rows(triangle.v);
        for y in rows.start.max(band.start)..rows.end.min(band.end) {
            for i in grid.span(y, &triangle) {
                if let Some(depth) = triangle.depth(grid.u[i], grid.v[i]) {
                    visit(i, depth, face);
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
        let [mut low, mut high] = self.u;
        for ([p, q], [r, s]) in self.left.iter().zip(&self.right) {
            low = larger(low, p + smaller(q * v0, q * v1));
            high = smaller(high, r + larger(s * v0, s * v1));
        }
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

/// One instruction, where `f64::max` takes five to honour NaN: this is the innermost loop of the search for a camera.
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undistorted_pixel_centres_project_back() {
        for (k1, k2) in [(-0.09, 0.0), (-0.025, 0.0), (0.0, 0.0), (0.2, 0.0), (-0.09, 0.05), (0.0, -0.02), (0.1, 0.1)] {
            let camera = Camera {
                k1,
                k2,
                position: [0.0; 3],
                axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                ..Camera::look_at([90.0, -150.0, 260.0], [0.0, 0.0, 8.0], 540.0, [160, 120])
            };
            let grid = PixelGrid::of(&camera);
            for i in (0..grid.u.len()).step_by(97) {
                let [x, y] = camera.project([grid.u[i], grid.v[i], 1.0]).unwrap();
                assert!((x - (i % 160) as f64 - 0.5).abs() < 1e-9 && (y - (i / 160) as f64 - 0.5).abs() < 1e-9);
            }
        }
    }
}
