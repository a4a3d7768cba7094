//! Where a part comes to rest when it is set down on what stands below it.
//!
//! In: the part at some pose, the other bodies, the direction from which it is set down. Out: the plane on which it lies: its
//! lift over that pose and its tilt. The part sinks until it touches, then tilts until three contacts enclose its centre of
//! mass: the facet above that centre of the upper convex hull of D(u, v), the top of what stands below less the underside
//! of the part. The tilt is taken as small: D is that of the part before it tilts.

use super::columns::{Columns, Extent, Frame, Grid, erode, project};
use crate::solid::{Solid, TriMesh};
use nalgebra::{Isometry3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::sync::Arc;

/// Lift over the pose that was set down: `height + slope · (uv - centre)` (mm).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Lie {
    pub centre: [f64; 2],
    pub height: f64,
    pub slope: [f64; 2],
}

impl Lie {
    pub fn at(&self, [u, v]: [f64; 2]) -> f64 {
        self.height + self.slope[0] * (u - self.centre[0]) + self.slope[1] * (v - self.centre[1])
    }

    /// The lie `share` of the way from this one to another about the same centre.
    pub fn towards(&self, other: &Lie, share: f64) -> Lie {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Lie {
            centre: self.centre,
            height: mix(self.height, other.height),
            slope: [0, 1].map(|i| mix(self.slope[i], other.slope[i])),
        }
    }

    /// Angle between the lie and the plane square to the direction (rad).
    pub fn tilt(&self) -> f64 {
        self.slope[0].hypot(self.slope[1]).atan()
    }

    /// The motion that brings the part from the pose it was set down at to this lie; `level` is the height of its
    /// underside, about which it tilts.
    pub fn motion(&self, frame: &Frame, level: f64) -> Isometry3<f64> {
        let normal = frame.d - frame.u * self.slope[0] - frame.v * self.slope[1];
        let turn = Rotation3::rotation_between(&frame.d, &normal).unwrap_or_else(Rotation3::identity);
        let pivot = frame.point([self.centre[0], self.centre[1], level]).coords;
        let tilt = Translation3::from(pivot) * UnitQuaternion::from(turn) * Translation3::from(-pivot);
        Translation3::from(frame.d * self.height) * tilt
    }
}

/// What a part is set down on: the tops of all other bodies over the region it may cover.
pub(crate) struct Bed {
    pub frame: Frame,
    pub grid: Grid,
    /// Per cell the top of everything and of what stands firm; -infinity where there is nothing.
    all: Vec<f64>,
    firm: Vec<f64>,
    /// Per loose body its component and its top per cell.
    loose: Vec<(usize, Vec<f64>)>,
}

/// Material that enters other material by more than this (mm) has no place there.
const ENTERS: f64 = 0.1;
/// Most cells across a bed, whatever the side of a cell that is asked for.
const MOST_CELLS: f64 = 400.0;
/// A part that would have to tilt more than this (rad) slides off.
const STEEPEST: f64 = 0.35;

impl Bed {
    /// The bed for a part that stays within `radius` of `centre`, in cells of side `cell` (mm). Each body: its component,
    /// whether it stands firm.
    pub fn new(
        direction: Unit<Vector3<f64>>,
        centre: [f64; 2],
        radius: f64,
        cell: f64,
        bodies: &[(usize, bool)],
        solids: &[Arc<Solid>],
        poses: &[Isometry3<f64>],
    ) -> Self {
        let frame = Frame::along(direction);
        let low = [centre[0] - radius, centre[1] - radius, 0.0];
        let high = [centre[0] + radius, centre[1] + radius, 0.0];
        let grid = Grid::over(&Extent { low, high }, (2.0 * radius / MOST_CELLS).max(cell));
        let nothing = vec![f64::NEG_INFINITY; grid.cells()];
        let mut bed = Bed { frame, grid, all: nothing.clone(), firm: nothing, loose: Vec::new() };
        for (component, firm) in bodies {
            bed.add(*component, *firm, &solids[*component].mesh, &poses[*component]);
        }
        bed
    }

    fn add(&mut self, component: usize, firm: bool, mesh: &TriMesh, pose: &Isometry3<f64>) {
        let columns = Columns::new(mesh, &project(mesh, pose, &self.frame), &self.grid);
        let tops: Vec<f64> = (0..self.grid.cells()).map(|c| columns.top(c).unwrap_or(f64::NEG_INFINITY)).collect();
        raise(&mut self.all, &tops);
        if firm {
            raise(&mut self.firm, &tops);
        } else {
            self.loose.push((component, tops));
        }
    }

    /// Sets the part down from the given pose.
    pub fn set_down(&self, mesh: &TriMesh, pose: &Isometry3<f64>) -> Landing<'_> {
        let points = project(mesh, pose, &self.frame);
        let columns = Columns::new(mesh, &points, &self.grid);
        let undersides = (0..self.grid.cells()).map(|c| columns.bottom(c).unwrap_or(f64::INFINITY)).collect();
        let tops = (0..self.grid.cells()).map(|c| columns.top(c).unwrap_or(f64::NEG_INFINITY)).collect();
        let level = points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        Landing { bed: self, undersides, tops, centre: centre_of_mass(&columns, &self.grid), level }
    }

    /// Whether two placed meshes keep out of each other, but for what is as narrow as facets.
    pub fn clear(&self, a: &TriMesh, at: &Isometry3<f64>, b: &TriMesh, there: &Isometry3<f64>) -> bool {
        let columns = |mesh: &TriMesh, pose| Columns::new(mesh, &project(mesh, pose, &self.frame), &self.grid);
        let (p, q) = (columns(a, at), columns(b, there));
        let enters = |cell: usize| overlap(p.spans(cell), q.spans(cell)) > ENTERS;
        let marked: Vec<bool> = (0..self.grid.cells()).map(enters).collect();
        !erode(&marked, &self.grid).contains(&true)
    }
}

/// How deep two intervals of material enter each other at most (mm).
pub(crate) fn overlap(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let pairs = a.iter().flat_map(|p| b.iter().map(move |q| p[1].min(q[1]) - p[0].max(q[0])));
    pairs.fold(0.0, f64::max)
}

fn raise(heights: &mut [f64], tops: &[f64]) {
    heights.iter_mut().zip(tops).for_each(|(h, t)| *h = h.max(*t));
}

fn centre_of_mass(columns: &Columns, grid: &Grid) -> [f64; 2] {
    let mut sum = [0.0; 3];
    for cell in 0..grid.cells() {
        let mass: f64 = columns.spans(cell).iter().map(|s| s[1] - s[0]).sum();
        let [u, v] = grid.centre(cell);
        sum = [sum[0] + mass * u, sum[1] + mass * v, sum[2] + mass];
    }
    if sum[2] > 0.0 { [sum[0] / sum[2], sum[1] / sum[2]] } else { [0.0; 2] }
}

/// A part above its bed.
pub(crate) struct Landing<'a> {
    bed: &'a Bed,
    /// Per cell; infinity where the part has no material.
    undersides: Vec<f64>,
    /// Per cell; -infinity where the part has no material.
    tops: Vec<f64>,
    centre: [f64; 2],
    /// Height of the part's lowest point.
    pub level: f64,
}

impl Landing<'_> {
    /// Where the part lies on everything, or only on what stands firm; `None` if it would slide off.
    pub fn lie(&self, firm_only: bool) -> Option<Lie> {
        let tops = if firm_only { &self.bed.firm } else { &self.bed.all };
        let gaps = tops.iter().zip(&self.undersides).map(|(top, underside)| top - underside).enumerate();
        let over_something = gaps.filter(|(_, gap)| *gap > f64::NEG_INFINITY);
        let point = |(cell, gap)| {
            let [u, v] = self.bed.grid.centre(cell);
            [u, v, gap]
        };
        let points: Vec<[f64; 3]> = over_something.map(point).collect();
        supporting_plane(&points, self.centre).filter(|lie| lie.tilt() <= STEEPEST)
    }

    /// Whether another pose of the part, set down on the same bed, shows a surface higher or lower by more than `step`
    /// (mm) somewhere, seen along the direction. What is as narrow as facets does not count.
    pub fn looks_unlike(&self, other: &Landing, step: f64) -> bool {
        let differs = |(a, b): (&f64, &f64)| a != b && (a - b).abs() > step;
        let marked: Vec<bool> = self.tops.iter().zip(&other.tops).map(differs).collect();
        erode(&marked, &self.bed.grid).contains(&true)
    }

    /// Where the part as it was set down is within `gap` mm of what is below it: middles of cells on its underside.
    pub fn touching(&self, gap: f64) -> Vec<[f64; 3]> {
        let near = |c: &usize| (self.undersides[*c] - self.bed.all[*c]).abs() < gap;
        let point = |c: usize| {
            let [u, v] = self.bed.grid.centre(c);
            [u, v, self.undersides[c]]
        };
        (0..self.undersides.len()).filter(near).map(point).collect()
    }

    /// How far each loose body is pushed down by the part at a lie: (component, mm).
    pub fn pushed(&self, lie: &Lie) -> Vec<(usize, f64)> {
        let push = |tops: &[f64]| {
            let gaps = tops.iter().zip(&self.undersides).map(|(top, underside)| top - underside).enumerate();
            let over = gaps.filter(|(_, gap)| *gap > f64::NEG_INFINITY);
            over.map(|(cell, gap)| gap - lie.at(self.bed.grid.centre(cell))).fold(0.0, f64::max)
        };
        let depths = self.bed.loose.iter().map(|(c, tops)| (*c, push(tops)));
        depths.filter(|(_, depth)| *depth > TOUCHING).collect()
    }
}

/// Pushed less than this (mm), a body only touches.
const TOUCHING: f64 = 0.01;
/// A point above the plane by less than this (mm) lies on it.
const ON_PLANE: f64 = 1e-9;
/// The far points from which the search starts lie this many times the points' spread away and as far below.
const FAR: f64 = 1e3;

/// The plane of the upper convex hull's facet above `centre`: a pivoting search from three far points that enclose it.
/// At each step the point highest above the plane replaces a corner, so that the corners still enclose the centre; the
/// plane's height there rises, so no corner set comes back. `None` if a far point stays: the part is not supported.
pub(crate) fn supporting_plane(points: &[[f64; 3]], centre: [f64; 2]) -> Option<Lie> {
    let reach = |p: &[f64; 3]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
    let spread = FAR * points.iter().map(reach).fold(1.0, f64::max);
    let lowest = points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let far = |k: usize| {
        let angle = std::f64::consts::TAU * k as f64 / 3.0;
        [centre[0] + spread * angle.cos(), centre[1] + spread * angle.sin(), lowest - FAR * spread]
    };
    let mut corners = [far(0), far(1), far(2)];
    for _ in 0..points.len() {
        let lie = plane_through(&corners, centre)?;
        let above = |p: &[f64; 3]| p[2] - lie.at([p[0], p[1]]);
        let highest = points.iter().max_by(|p, q| above(p).total_cmp(&above(q)))?;
        if above(highest) <= ON_PLANE {
            let supported = corners.iter().all(|c| reach(c) < spread / 2.0);
            return supported.then_some(lie);
        }
        corners = exchange(&corners, *highest, centre);
    }
    None
}

fn plane_through(c: &[[f64; 3]; 3], centre: [f64; 2]) -> Option<Lie> {
    let (p, q) = ([0, 1, 2].map(|i| c[1][i] - c[0][i]), [0, 1, 2].map(|i| c[2][i] - c[0][i]));
    let area = p[0] * q[1] - p[1] * q[0];
    if area == 0.0 {
        return None;
    }
    let slope = [(p[2] * q[1] - p[1] * q[2]) / area, (p[0] * q[2] - p[2] * q[0]) / area];
    let height = c[0][2] + slope[0] * (centre[0] - c[0][0]) + slope[1] * (centre[1] - c[0][1]);
    Some(Lie { centre, height, slope })
}

/// Replaces the corner without which the new point and the other two enclose the centre best.
fn exchange(corners: &[[f64; 3]; 3], new: [f64; 3], centre: [f64; 2]) -> [[f64; 3]; 3] {
    let with = |k: usize| {
        let mut c = *corners;
        c[k] = new;
        c
    };
    let best = (0..3).max_by(|i, j| enclosure(&with(*i), centre).total_cmp(&enclosure(&with(*j), centre)));
    with(best.unwrap_or(0))
}

/// The least barycentric coordinate of the centre: negative outside the triangle.
fn enclosure(c: &[[f64; 3]; 3], centre: [f64; 2]) -> f64 {
    let cross = |a: [f64; 2], b: [f64; 2], p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
    let [p, q, r] = c.map(|c| [c[0], c[1]]);
    let total = cross(p, q, r);
    if total == 0.0 {
        return f64::NEG_INFINITY;
    }
    [cross(q, r, centre), cross(r, p, centre), cross(p, q, centre)].map(|a| a / total).into_iter().fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    #[test]
    fn the_supporting_plane_lies_above_all_points_and_touches_three() {
        let mut stream = Stream::new(5, "points", 0);
        for _ in 0..50 {
            let points: Vec<[f64; 3]> =
                (0..300).map(|_| [stream.between(-9.0, 9.0), stream.between(-9.0, 9.0), stream.uniform()]).collect();
            let lie = supporting_plane(&points, [0.3, -0.2]).expect("the centre is among the points");
            let gaps: Vec<f64> = points.iter().map(|p| lie.at([p[0], p[1]]) - p[2]).collect();
            assert!(gaps.iter().all(|g| *g > -1e-6));
            assert!(gaps.iter().filter(|g| **g < 1e-6).count() >= 3);
        }
    }

    #[test]
    fn what_is_supported_on_one_side_only_falls() {
        let points = [[1.0, 0.0, 2.0], [2.0, 1.0, 2.0], [2.0, -1.0, 2.0]];
        assert_eq!(supporting_plane(&points, [0.0, 0.0]), None);
    }

    #[test]
    fn a_lie_moves_the_underside_onto_its_plane() {
        let frame = Frame::along(Vector3::z_axis());
        let lie = Lie { centre: [1.0, 2.0], height: 3.0, slope: [0.02, -0.01] };
        let moved = lie.motion(&frame, 18.0) * nalgebra::Point3::new(11.0, 7.0, 18.0);
        assert!((moved.z - 18.0 - lie.at([moved.x, moved.y])).abs() < 1e-9, "{moved}");
    }
}
