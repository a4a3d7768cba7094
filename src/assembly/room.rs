//! The room that the others leave one component.
//!
//! In: a component, the solids in their places, the removal order. Out: whether it could stay at another pose: it enters
//! nothing that it does not enter in its place, lies on what is below, and looks different from where it is removed. All
//! others stay where they are. How it would get there is not asked.

use super::columns::{Columns, Extent, Frame, erode, project};
use super::insertion::Insertion;
use super::rest::{Bed, Landing, overlap};
use crate::solid::Solid;
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::sync::Arc;

/// Whose room is asked for, and among what.
#[derive(Clone, Copy)]
pub(crate) struct Among<'a> {
    pub component: usize,
    pub insertion: &'a Insertion,
    /// One per component, at nominal.
    pub solids: &'a [Arc<Solid>],
    pub poses: &'a [Isometry3<f64>],
}

/// Side of a cell (mm).
const CELL: f64 = 0.3;
/// Material that enters other material by more than this (mm) has no place there.
const ENTERS: f64 = 0.1;
/// Over so small an area (mm²) what enters may be the facets of round faces, and over so few cells always.
const FACETS: f64 = 0.4;
const FEW_CELLS: usize = 4;
/// It looks different where the assembly is higher or lower by more than this (mm).
const DIFFERENT: f64 = 0.3;
/// A part that lies no higher or lower than this (mm) over its seat, and leans by no more than this (rad), is on it.
const ON_SEAT: f64 = 0.1;
const LEVEL: f64 = 0.01;
/// Below this gap (mm) two surfaces touch.
const TOUCHES: f64 = 0.1;

/// The surroundings of one component.
pub(crate) struct Room<'a> {
    of: Among<'a>,
    pub frame: Frame,
    bed: Bed,
    others: Vec<Columns>,
    /// Per cell the top of the others, and of all in their places.
    roof: Vec<f64>,
    home: Vec<f64>,
    /// So many cells may be entered.
    entered: usize,
    /// Middle of the component's box in the frame, and how far it reaches from there square to the direction (mm).
    pub middle: [f64; 3],
    pub reach: f64,
    /// How high it is along the direction (mm).
    pub height: f64,
    /// Whether it lies on its seat in its place.
    pub seated: bool,
}

impl<'a> Room<'a> {
    /// The room within `margin` mm of where the component reaches.
    pub fn new(of: &Among<'a>, margin: f64) -> Self {
        let direction = of.insertion.direction(of.component);
        let frame = Frame::along(direction);
        let points = project(&of.solids[of.component].mesh, &of.poses[of.component], &frame);
        let extent = Extent::of(&points);
        let middle = [0, 1, 2].map(|i| (extent.low[i] + extent.high[i]) / 2.0);
        let reach = points.iter().map(|p| (p[0] - middle[0]).hypot(p[1] - middle[1])).fold(0.0, f64::max);
        let near = neighbours(of, &frame, middle, reach + margin);
        let below: Vec<(usize, bool)> =
            near.iter().filter(|c| !of.insertion.above[of.component].contains(c)).map(|c| (*c, true)).collect();
        let bed = Bed::new(direction, [middle[0], middle[1]], reach + margin, CELL, &below, of.solids, of.poses);
        let columns = |&c: &usize| {
            let mesh = &of.solids[c].mesh;
            Columns::new(mesh, &project(mesh, &of.poses[c], &frame), &bed.grid)
        };
        let others: Vec<Columns> = near.iter().map(columns).collect();
        let top = |cell: usize| others.iter().filter_map(|o| o.top(cell)).fold(f64::NEG_INFINITY, f64::max);
        let roof: Vec<f64> = (0..bed.grid.cells()).map(top).collect();
        let height = extent.high[2] - extent.low[2];
        let of = *of;
        let mut room =
            Room { of, frame, bed, others, roof, home: Vec::new(), entered: 0, middle, reach, height, seated: false };
        room.seated = room.bears(&of.poses[of.component]);
        room.home = room.seen(&of.poses[of.component]);
        let facets = (FACETS / room.bed.grid.cell.powi(2)) as usize;
        room.entered = room.entering(&of.poses[of.component]) + facets.max(FEW_CELLS);
        room
    }

    /// Its pose in its place.
    pub fn home(&self) -> Isometry3<f64> {
        self.of.poses[self.of.component]
    }

    pub fn direction(&self) -> Vector3<f64> {
        self.frame.d
    }

    /// The middle of the component's box.
    pub fn centre(&self) -> Point3<f64> {
        self.frame.point(self.middle)
    }

    /// Directions square to that of removal, evenly all round, from the component's own x axis on.
    pub fn around(&self, count: usize) -> Vec<Unit<Vector3<f64>>> {
        let square = |axis: Vector3<f64>| {
            let axis = self.home().rotation * axis;
            Unit::try_new(axis - self.frame.d * axis.dot(&self.frame.d), SQUARE)
        };
        let x = square(Vector3::x()).or_else(|| square(Vector3::y())).unwrap_or(Unit::new_unchecked(self.frame.u));
        let y = self.frame.d.cross(&x);
        let angle = |k: usize| (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        (0..count).map(|k| Unit::new_normalize(x.into_inner() * angle(k).1 + y * angle(k).0)).collect()
    }

    /// Whether the component there enters nothing, or no more than in its place.
    pub fn clears(&self, pose: &Isometry3<f64>) -> bool {
        self.entering(pose) <= self.entered
    }

    /// Whether the component there is borne as high as it is and level.
    pub fn bears(&self, pose: &Isometry3<f64>) -> bool {
        self.set_down(pose).lie(false).is_some_and(|l| l.height.abs() < ON_SEAT && l.tilt() < LEVEL)
    }

    /// Whether the assembly then looks different, seen along the direction. What is as narrow as facets does not count.
    pub fn shows(&self, pose: &Isometry3<f64>) -> bool {
        let differs = |(a, b): (f64, &f64)| a != *b && (a - b).abs() > DIFFERENT;
        let marked: Vec<bool> = self.seen(pose).into_iter().zip(&self.home).map(differs).collect();
        erode(&marked, &self.bed.grid).contains(&true)
    }

    /// The component set down from a pose on what stands below it.
    pub fn set_down(&self, pose: &Isometry3<f64>) -> Landing<'_> {
        self.bed.set_down(&self.of.solids[self.of.component].mesh, pose)
    }

    /// Where the component in its place touches what is below: points on a grid.
    pub fn seat(&self) -> Vec<Point3<f64>> {
        self.set_down(&self.home()).touching(TOUCHES).into_iter().map(|p| self.frame.point(p)).collect()
    }

    /// How far it reaches at a pose from the middle of its box in one direction (mm).
    pub fn reach_along(&self, direction: &Vector3<f64>, pose: &Isometry3<f64>) -> f64 {
        let along = |p: &Point3<f64>| (pose * p - self.centre()).dot(direction);
        self.of.solids[self.of.component].mesh.positions.iter().map(along).fold(f64::NEG_INFINITY, f64::max)
    }

    fn columns(&self, pose: &Isometry3<f64>) -> Columns {
        let mesh = &self.of.solids[self.of.component].mesh;
        Columns::new(mesh, &project(mesh, pose, &self.frame), &self.bed.grid)
    }

    /// Cells in which it enters others.
    fn entering(&self, pose: &Isometry3<f64>) -> usize {
        let own = self.columns(pose);
        let enters = |c: &usize| self.others.iter().any(|o| overlap(own.spans(*c), o.spans(*c)) > ENTERS);
        (0..self.bed.grid.cells()).filter(|c| !own.spans(*c).is_empty()).filter(enters).count()
    }

    fn seen(&self, pose: &Isometry3<f64>) -> Vec<f64> {
        let own = self.columns(pose);
        (0..self.roof.len()).map(|c| own.top(c).map_or(self.roof[c], |top| top.max(self.roof[c]))).collect()
    }
}

/// An axis shorter than this, seen along the direction, gives no direction square to it.
const SQUARE: f64 = 1e-3;

/// The other components that come within a radius of a point.
fn neighbours(of: &Among, frame: &Frame, middle: [f64; 3], radius: f64) -> Vec<usize> {
    let near = |c: &usize| {
        let extent = Extent::of(&project(&of.solids[*c].mesh, &of.poses[*c], frame));
        (0..2).all(|i| extent.low[i] < middle[i] + radius && extent.high[i] > middle[i] - radius)
    };
    (0..of.solids.len()).filter(|c| *c != of.component).filter(near).collect()
}
