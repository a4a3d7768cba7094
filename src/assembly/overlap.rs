//! The area two faces on the same surface share.
//!
//! In: the triangles of two faces, in the assembly's frame. Out: the area common to both (mm²) and how far it reaches along
//! the axis. Both faces are laid flat by one area-preserving map (a plane's own coordinates; a cylinder unrolled; for cones
//! and spheres Lambert's cylindrical equal-area map and its like), where the triangles of a face do not overlap each
//! other: so the common area is the plain sum over pairs of triangles. Exact for planes and cylinders up to the facets.

use super::boxes::{Bounds, BoxTree};
use crate::solid::Surface;
use nalgebra::{Point3, Unit, Vector3};
use std::f64::consts::{PI, TAU};

/// A triangle laid flat. On round surfaces the first coordinate is an angle (rad), the second area per angle.
pub(crate) type Flat = [[f64; 2]; 3];

/// Where two faces coincide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Overlap {
    /// mm².
    pub area: f64,
    /// Lowest and highest second coordinate of the common region.
    pub reach: [f64; 2],
    /// Which of the [`BINS`] equal parts of a turn the first coordinate covers, one bit each.
    pub arc: u32,
    /// The outermost points of the common region in [`ways`].
    pub outline: [[f64; 2]; 8],
}

/// Parts of a turn that a contact's arc is told in.
pub(crate) const BINS: usize = 32;

/// Eight directions in a plane, evenly round.
fn ways() -> [[f64; 2]; 8] {
    std::array::from_fn(|k| [(k as f64 * TAU / 8.0).cos(), (k as f64 * TAU / 8.0).sin()])
}

/// A surface's parameter plane.
pub(crate) struct Chart<'a> {
    surface: &'a Surface,
    origin: Point3<f64>,
    u: Vector3<f64>,
    v: Vector3<f64>,
    w: Vector3<f64>,
}

impl<'a> Chart<'a> {
    pub fn new(surface: &'a Surface) -> Self {
        let (origin, w) = match surface {
            Surface::Plane { normal, offset } => (Point3::from(normal.scale(*offset)), *normal),
            Surface::Cylinder { point, axis, .. } => (*point, *axis),
            Surface::Cone { apex, axis, .. } => (*apex, *axis),
            Surface::Sphere { centre, .. } => (*centre, Vector3::z_axis()),
            Surface::Torus { centre, axis, .. } => (*centre, *axis),
        };
        let (u, v) = square_to(w);
        Chart { surface, origin, u, v, w: w.into_inner() }
    }

    /// Whether the first coordinate is an angle.
    pub fn is_round(&self) -> bool {
        !matches!(self.surface, Surface::Plane { .. })
    }

    /// Lays a triangle flat, its angles in one piece and its mean angle in 0..2π.
    pub fn lay(&self, corners: [Point3<f64>; 3]) -> Flat {
        let mut flat = corners.map(|p| self.coordinates(&p));
        if self.is_round() {
            self.unwrap(&mut flat, &corners);
        }
        flat
    }

    /// The position along the axis (mm from the chart's origin) of a second coordinate.
    pub fn along_axis(&self, h: f64) -> f64 {
        match self.surface {
            Surface::Plane { .. } => 0.0,
            Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => h / radius,
            Surface::Torus { .. } => h,
            Surface::Cone { half_angle, .. } => (2.0 * h.max(0.0) / half_angle.tan() * half_angle.cos()).sqrt(),
        }
    }

    /// The chart's origin.
    pub fn origin(&self) -> Point3<f64> {
        self.origin
    }

    /// The point of a plane at these coordinates.
    pub fn on_plane(&self, [x, y]: [f64; 2]) -> Point3<f64> {
        self.origin + self.u * x + self.v * y
    }

    /// After how much the coordinates start again: nothing for an endless axis.
    pub fn periods(&self) -> [Option<f64>; 2] {
        let tube = match self.surface {
            Surface::Torus { major, minor, .. } if major > minor => Some(TAU * major * minor),
            _ => None,
        };
        [self.is_round().then_some(TAU), tube]
    }

    fn coordinates(&self, p: &Point3<f64>) -> [f64; 2] {
        let r = p - self.origin;
        let (x, y, z) = (r.dot(&self.u), r.dot(&self.v), r.dot(&self.w));
        match self.surface {
            Surface::Plane { .. } => [x, y],
            Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => [y.atan2(x), radius * z],
            Surface::Torus { minor, .. } => [y.atan2(x), minor * self.surface.chart(p)[1]],
            // dA = s sin(a) ds dθ with s = z / cos(a): the second coordinate is s² sin(a) / 2.
            Surface::Cone { half_angle, .. } => [y.atan2(x), z * z * half_angle.tan() / half_angle.cos() / 2.0],
        }
    }

    fn unwrap(&self, flat: &mut Flat, corners: &[Point3<f64>; 3]) {
        let pole = |p: &Point3<f64>| (p - self.origin).cross(&self.w).norm() < POLE;
        let poles = corners.each_ref().map(pole);
        let Some(first) = (0..3).find(|k| !poles[*k]) else { return };
        let reference = flat[first][0];
        for corner in flat.iter_mut() {
            corner[0] = reference + wrap(corner[0] - reference);
        }
        let proper = (0..3).filter(|k| !poles[*k]);
        let mean = proper.clone().map(|k| flat[k][0]).sum::<f64>() / proper.count() as f64;
        let shift = mean.rem_euclid(TAU) - mean;
        for k in 0..3 {
            flat[k][0] = if poles[k] { mean } else { flat[k][0] } + shift;
        }
        if let [_, Some(period)] = self.periods() {
            let reference = flat[0][1];
            flat.iter_mut().for_each(|c| c[1] -= period * ((c[1] - reference) / period).round());
        }
    }
}

/// Closer to the axis than this (mm) a point has no angle.
const POLE: f64 = 1e-6;

fn wrap(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

/// Two unit vectors that complete a right-handed frame.
pub(crate) fn square_to(w: Unit<Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    let helper = if w.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let u = (helper - w.into_inner() * w.dot(&helper)).normalize();
    (u, w.cross(&u))
}

/// The common region of two faces laid flat in the same chart, whose coordinates start again after these periods; `None`
/// where they do not meet.
pub(crate) fn overlap(a: &[Flat], b: &[Flat], periods: [Option<f64>; 2]) -> Option<Overlap> {
    let turns = periods.map(|p| p.map_or(vec![0.0], |p| vec![-p, 0.0, p]));
    let mut total = Overlap::NONE;
    let boxed = |t: &Flat| Bounds {
        low: Vector3::new(low(t, 0), low(t, 1), 0.0),
        high: Vector3::new(high(t, 0), high(t, 1), 0.0),
    };
    let tree = BoxTree::new(b.iter().map(boxed).collect());
    let ways = ways();
    for (turn, s) in turns[0].iter().flat_map(|turn| a.iter().map(move |s| (turn, s))) {
        for rise in &turns[1] {
            let shifted = s.map(|[x, y]| [x + turn, y + rise]);
            for t in tree.meeting(&boxed(&shifted)) {
                total.add(&shifted, &b[t], &ways);
            }
        }
    }
    (total.area > 0.0).then_some(total)
}

impl Overlap {
    const NONE: Overlap =
        Overlap { area: 0.0, reach: [f64::INFINITY, f64::NEG_INFINITY], arc: 0, outline: [[f64::NAN; 2]; 8] };

    fn add(&mut self, s: &Flat, t: &Flat, ways: &[[f64; 2]; 8]) {
        if low(s, 1) >= high(t, 1) || low(t, 1) >= high(s, 1) || low(s, 0) >= high(t, 0) {
            return;
        }
        let common = clip(s, t);
        let area = area(&common);
        if area > 0.0 {
            self.area += area;
            self.reach_to(&common, ways);
        }
    }

    fn reach_to(&mut self, polygon: &[[f64; 2]], ways: &[[f64; 2]; 8]) {
        let along = |p: &[f64; 2], way: &[f64; 2]| p[0] * way[0] + p[1] * way[1];
        let mut turn = [f64::INFINITY, f64::NEG_INFINITY];
        for p in polygon {
            self.reach = [self.reach[0].min(p[1]), self.reach[1].max(p[1])];
            turn = [turn[0].min(p[0]), turn[1].max(p[0])];
            for (outermost, way) in self.outline.iter_mut().zip(ways) {
                let nearer = along(p, way) <= along(outermost, way);
                if !nearer {
                    *outermost = *p;
                }
            }
        }
        self.arc |= bins(turn);
    }
}

/// The bins that an interval of angles (rad) covers by their middles.
fn bins([low, high]: [f64; 2]) -> u32 {
    let width = TAU / BINS as f64;
    let (first, last) = ((low / width - 0.5).ceil(), (high / width - 0.5).floor());
    if last - first >= BINS as f64 {
        return u32::MAX;
    }
    (first as i64..=last as i64).fold(0, |set, k| set | 1 << k.rem_euclid(BINS as i64))
}

fn low(t: &Flat, axis: usize) -> f64 {
    t[0][axis].min(t[1][axis]).min(t[2][axis])
}

fn high(t: &Flat, axis: usize) -> f64 {
    t[0][axis].max(t[1][axis]).max(t[2][axis])
}

fn side(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// A triangle cut down to another (Sutherland and Hodgman 1974).
fn clip(subject: &Flat, window: &Flat) -> Vec<[f64; 2]> {
    let sense = side(window[0], window[1], window[2]).signum();
    let mut polygon = subject.to_vec();
    for k in 0..3 {
        let (a, b) = (window[k], window[(k + 1) % 3]);
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, p) in polygon.iter().enumerate() {
            let q = polygon[(i + 1) % polygon.len()];
            let (sp, sq) = (sense * side(a, b, *p), sense * side(a, b, q));
            if sp >= 0.0 {
                kept.push(*p);
            }
            if (sp < 0.0) != (sq < 0.0) {
                let f = sp / (sp - sq);
                kept.push([p[0] + f * (q[0] - p[0]), p[1] + f * (q[1] - p[1])]);
            }
        }
        polygon = kept;
    }
    polygon
}

/// What two triangles share, and its area.
pub(crate) fn clipped(subject: &Flat, window: &Flat) -> (Vec<[f64; 2]>, f64) {
    let common = clip(subject, window);
    let size = area(&common);
    (common, size)
}

fn area(polygon: &[[f64; 2]]) -> f64 {
    let twice: f64 = (0..polygon.len())
        .map(|i| {
            let (p, q) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            p[0] * q[1] - q[0] * p[1]
        })
        .sum();
    twice.abs() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64, y: f64, side: f64) -> Vec<Flat> {
        let (a, b, c, d) = ([x, y], [x + side, y], [x + side, y + side], [x, y + side]);
        vec![[a, b, c], [a, c, d]]
    }

    #[test]
    fn two_squares_share_a_rectangle() {
        let o = overlap(&square(0.0, 0.0, 2.0), &square(1.0, 0.5, 4.0), [None; 2]).expect("they overlap");
        assert!((o.area - 1.5).abs() < 1e-12);
        assert_eq!(o.reach, [0.5, 2.0]);
        assert_eq!(overlap(&square(0.0, 0.0, 1.0), &square(1.0, 0.0, 1.0), [None; 2]), None);
    }

    #[test]
    fn an_angle_past_a_whole_turn_is_the_same_angle() {
        let o =
            overlap(&square(-0.5, 0.0, 1.0), &square(TAU - 0.25, 0.0, 1.0), [Some(TAU), None]).expect("they overlap");
        assert!((o.area - 0.75).abs() < 1e-12, "{o:?}");
    }

    #[test]
    fn round_charts_keep_areas() {
        let cone = Surface::Cone { apex: Point3::origin(), axis: Vector3::z_axis(), half_angle: 0.5 };
        let chart = Chart::new(&cone);
        let on = |t: f64, z: f64| Point3::new(z * 0.5f64.tan() * t.cos(), z * 0.5f64.tan() * t.sin(), z);
        let (n, z0, z1) = (400, 1.0, 1.001);
        let mut sum = 0.0;
        for k in 0..n {
            let (s, t) = (TAU * k as f64 / n as f64, TAU * (k + 1) as f64 / n as f64);
            for corners in [[on(s, z0), on(t, z0), on(t, z1)], [on(s, z0), on(t, z1), on(s, z1)]] {
                sum += area(&chart.lay(corners));
            }
        }
        let exact = PI * 0.5f64.tan() / 0.5f64.cos() * (z1 * z1 - z0 * z0);
        assert!((sum / exact - 1.0).abs() < 1e-9, "{sum} {exact}");
        let h = 1.7 * 1.7 * 0.5f64.tan() / 0.5f64.cos() / 2.0;
        assert!((chart.along_axis(h) - 1.7).abs() < 1e-12);
    }
}
