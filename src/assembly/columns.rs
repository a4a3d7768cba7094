//! Solids as columns of material along one direction.
//!
//! In: a watertight mesh, its pose and a grid square to a direction. Out: for every cell the intervals of material along
//! that direction. Whether one body stands in another's way, how deep two bodies enter each other and where a part comes
//! to rest are all read from such columns. Never used for fits: those come from the dimensions' limits.

use crate::solid::TriMesh;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// A right-handed frame with its third axis along the direction of interest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub u: Vector3<f64>,
    pub v: Vector3<f64>,
    pub d: Vector3<f64>,
}

impl Frame {
    /// For +z the frame is the world's own.
    pub fn along(direction: Unit<Vector3<f64>>) -> Self {
        let d = direction.into_inner();
        let helper = if d.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let u = (helper - d * d.dot(&helper)).normalize();
        Frame { u, v: d.cross(&u), d }
    }

    pub fn coordinates(&self, p: &Point3<f64>) -> [f64; 3] {
        [self.u.dot(&p.coords), self.v.dot(&p.coords), self.d.dot(&p.coords)]
    }

    pub fn point(&self, [u, v, d]: [f64; 3]) -> Point3<f64> {
        Point3::from(self.u * u + self.v * v + self.d * d)
    }
}

/// A box in the coordinates of a [`Frame`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    pub low: [f64; 3],
    pub high: [f64; 3],
}

impl Extent {
    pub fn of(points: &[[f64; 3]]) -> Self {
        let mut extent = Extent { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };
        for p in points {
            extent.low = [0, 1, 2].map(|i| extent.low[i].min(p[i]));
            extent.high = [0, 1, 2].map(|i| extent.high[i].max(p[i]));
        }
        extent
    }

    /// What both boxes cover; empty where low exceeds high.
    pub fn common(&self, other: &Extent) -> Extent {
        Extent {
            low: [0, 1, 2].map(|i| self.low[i].max(other.low[i])),
            high: [0, 1, 2].map(|i| self.high[i].min(other.high[i])),
        }
    }
}

/// Square cells in the u-v plane; a cell stands for its centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Grid {
    /// Centre of the first cell (mm).
    pub first: [f64; 2],
    /// Side of a cell (mm).
    pub cell: f64,
    /// Number of cells along u and v.
    pub size: [usize; 2],
}

impl Grid {
    /// Covers the u-v extent of a box.
    pub fn over(extent: &Extent, cell: f64) -> Self {
        let count = |axis: usize| (((extent.high[axis] - extent.low[axis]) / cell).ceil() as usize).max(1);
        Grid { first: [extent.low[0] + cell / 2.0, extent.low[1] + cell / 2.0], cell, size: [count(0), count(1)] }
    }

    pub fn cells(&self) -> usize {
        self.size[0] * self.size[1]
    }

    pub fn centre(&self, cell: usize) -> [f64; 2] {
        let (i, j) = (cell % self.size[0], cell / self.size[0]);
        [self.first[0] + i as f64 * self.cell, self.first[1] + j as f64 * self.cell]
    }

    /// Indices of the cells along one axis whose centres lie in low..high (half open).
    fn between(&self, axis: usize, low: f64, high: f64) -> std::ops::Range<usize> {
        let index = |x: f64| (((x - self.first[axis]) / self.cell).ceil()).clamp(0.0, self.size[axis] as f64) as usize;
        index(low)..index(high)
    }
}

/// Per cell the intervals of material along the direction, in rising order.
#[derive(Debug, Clone)]
pub(crate) struct Columns {
    starts: Vec<usize>,
    spans: Vec<[f64; 2]>,
}

/// A surface crossed along the direction: entering the material (+1) or leaving it (-1).
#[derive(Debug, Clone, Copy, Default)]
struct Crossing {
    cell: u32,
    winding: i32,
    depth: f64,
}

/// Triangles seen edge-on cover less than this (mm²) and cross no column.
pub(crate) const EDGE_ON: f64 = 1e-10;

/// Mesh vertices in the coordinates of a frame.
pub(crate) fn project(mesh: &TriMesh, pose: &Isometry3<f64>, frame: &Frame) -> Vec<[f64; 3]> {
    mesh.positions.iter().map(|p| frame.coordinates(&(pose * p))).collect()
}

impl Columns {
    /// Rasterises a mesh whose vertices are given in the grid's frame (see [`project`]).
    pub fn new(mesh: &TriMesh, points: &[[f64; 3]], grid: &Grid) -> Self {
        Self::of(mesh.triangles.iter().map(|t| t.map(|i| points[i as usize])), grid)
    }

    /// Rasterises those triangles of a watertight mesh that cover any cell of the grid.
    pub fn of(triangles: impl Iterator<Item = [[f64; 3]; 3]>, grid: &Grid) -> Self {
        let mut crossings = Vec::new();
        triangles.for_each(|t| cross(t, grid, &mut crossings));
        Self::pair(crossings, grid)
    }

    /// Intervals of material in a cell.
    pub fn spans(&self, cell: usize) -> &[[f64; 2]] {
        &self.spans[self.starts[cell]..self.starts[cell + 1]]
    }

    /// Where material begins, if there is any.
    pub fn bottom(&self, cell: usize) -> Option<f64> {
        self.spans(cell).first().map(|s| s[0])
    }

    /// Where material ends.
    pub fn top(&self, cell: usize) -> Option<f64> {
        self.spans(cell).last().map(|s| s[1])
    }

    fn pair(crossings: Vec<Crossing>, grid: &Grid) -> Self {
        let (firsts, mut sorted) = by_cell(&crossings, grid.cells());
        let mut columns = Columns { starts: Vec::with_capacity(grid.cells() + 1), spans: Vec::new() };
        for cell in 0..grid.cells() {
            columns.starts.push(columns.spans.len());
            let here = &mut sorted[firsts[cell]..firsts[cell + 1]];
            here.sort_unstable_by(|a, b| a.depth.total_cmp(&b.depth).then(b.winding.cmp(&a.winding)));
            columns.close(here);
        }
        columns.starts.push(columns.spans.len());
        columns
    }

    /// Turns one cell's crossings into intervals; what a crack in the mesh leaves open is dropped.
    fn close(&mut self, crossings: &[Crossing]) {
        let (mut inside, mut entry) = (0, 0.0);
        for c in crossings {
            if inside == 0 && c.winding > 0 {
                entry = c.depth;
            }
            if inside == 1 && c.winding < 0 {
                self.spans.push([entry, c.depth]);
            }
            inside = (inside + c.winding).max(0);
        }
    }
}

/// Crossings ordered by cell (a counting sort), and where each cell's begin.
fn by_cell(crossings: &[Crossing], cells: usize) -> (Vec<usize>, Vec<Crossing>) {
    let mut firsts = vec![0; cells + 1];
    for c in crossings {
        firsts[c.cell as usize + 1] += 1;
    }
    for cell in 0..cells {
        firsts[cell + 1] += firsts[cell];
    }
    let mut next = firsts.clone();
    let mut sorted = vec![Crossing::default(); crossings.len()];
    for c in crossings {
        let slot = &mut next[c.cell as usize];
        sorted[*slot] = *c;
        *slot += 1;
    }
    (firsts, sorted)
}

/// Collects the cells a triangle covers. Shared edges are cut by the same arithmetic from both sides, so that triangles
/// of a watertight mesh neither leave a cell out nor count it twice.
fn cross(triangle: [[f64; 3]; 3], grid: &Grid, out: &mut Vec<Crossing>) {
    let [a, b, c] = triangle;
    let (p, q) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
    let area = p[0] * q[1] - p[1] * q[0];
    if area.abs() < EDGE_ON {
        return;
    }
    let slope = [(p[2] * q[1] - p[1] * q[2]) / area, (p[0] * q[2] - p[2] * q[0]) / area];
    let winding = if area > 0.0 { -1 } else { 1 };
    let low = a[1].min(b[1]).min(c[1]);
    let high = a[1].max(b[1]).max(c[1]);
    for row in grid.between(1, low, high) {
        let v = grid.first[1] + row as f64 * grid.cell;
        let Some([left, right]) = cut(&triangle, v) else { continue };
        for column in grid.between(0, left, right) {
            let u = grid.first[0] + column as f64 * grid.cell;
            let depth = a[2] + slope[0] * (u - a[0]) + slope[1] * (v - a[1]);
            out.push(Crossing { cell: (row * grid.size[0] + column) as u32, depth, winding });
        }
    }
}

/// Where the line at height v enters and leaves a triangle.
fn cut(triangle: &[[f64; 3]; 3], v: f64) -> Option<[f64; 2]> {
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    for k in 0..3 {
        let (mut p, mut q) = (triangle[k], triangle[(k + 1) % 3]);
        if (p[1] <= v) == (q[1] <= v) {
            continue;
        }
        if p[1] > q[1] {
            std::mem::swap(&mut p, &mut q);
        }
        let u = p[0] + (v - p[1]) * (q[0] - p[0]) / (q[1] - p[1]);
        ends = [ends[0].min(u), ends[1].max(u)];
    }
    (ends[0] <= ends[1]).then_some(ends)
}

/// Cells whose eight neighbours are all marked too: what is left is wider than the facets of a curved face.
pub(crate) fn erode(marked: &[bool], grid: &Grid) -> Vec<bool> {
    let [w, h] = grid.size;
    let mut kept = vec![false; marked.len()];
    for j in 1..h.saturating_sub(1) {
        for i in 1..w.saturating_sub(1) {
            let row = |k: usize| &marked[k * w + i - 1..k * w + i + 2];
            kept[j * w + i] = (j - 1..=j + 1).all(|k| row(k).iter().all(|m| *m));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample;

    #[test]
    fn columns_hold_the_volume_of_a_plate_with_holes() {
        let plate = sample::plate("plate", 2.0, 20.0, &[("bore", 0.0, 0.0, 8.0), ("hole", 7.0, 1.0, 3.0)]);
        let frame = Frame::along(Vector3::z_axis());
        let points = project(&plate.mesh, &Isometry3::translation(0.3, 0.1, 5.0), &frame);
        let grid = Grid::over(&Extent::of(&points), 0.05);
        let columns = Columns::new(&plate.mesh, &points, &grid);
        let length: f64 = (0..grid.cells()).flat_map(|c| columns.spans(c)).map(|s| s[1] - s[0]).sum();
        let exact = std::f64::consts::PI * (100.0 - 16.0 - 2.25) * 2.0;
        assert!((length * 0.05 * 0.05 / exact - 1.0).abs() < 2e-3, "{length}");
        assert!((0..grid.cells()).all(|c| columns.spans(c).len() <= 1));
    }

    #[test]
    fn a_bore_seen_across_leaves_two_walls() {
        let tube = sample::plate("tube", 10.0, 20.0, &[("bore", 0.0, 0.0, 8.0)]);
        let frame = Frame::along(Vector3::x_axis());
        let points = project(&tube.mesh, &Isometry3::identity(), &frame);
        let grid = Grid::over(&Extent::of(&points), 0.21);
        let columns = Columns::new(&tube.mesh, &points, &grid);
        let hollow = |c: usize| match columns.spans(c) {
            [near, far] => Some([near[0], far[0] - near[1]]),
            _ => None,
        };
        let widest = (0..grid.cells()).filter_map(hollow).max_by(|a, b| a[1].total_cmp(&b[1]));
        let [near, gap] = widest.expect("columns through the bore");
        assert!((near + 10.0).abs() < 0.05 && (gap - 8.0).abs() < 0.05, "{near} {gap}");
    }
}
