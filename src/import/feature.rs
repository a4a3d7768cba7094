//! What a design is made of, between OpenSCAD's nodes and this language's lines.

use super::placement::Placement;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Op {
    Add,
    Cut,
    Keep,
}

/// One feature: an operation on what stands before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    pub op: Op,
    pub item: Item,
    /// Copies after the first, where several alike make a pattern.
    pub pattern: Option<Pattern>,
    /// Names of the sizes that no general tolerance may change.
    pub exact: Vec<&'static str>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    Solid { shape: Shape, place: Placement },
    Group(Vec<Step>),
}

/// Shapes in the frames of this language: sizes in mm, on z = 0 unless said otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    Box {
        x: f64,
        y: f64,
        z: f64,
    },
    Cylinder {
        d: f64,
        h: f64,
    },
    Frustum {
        d1: f64,
        d2: f64,
        h: f64,
    },
    /// About its centre.
    Sphere {
        d: f64,
    },
    /// About its centre, `d` of the middle circle.
    Torus {
        d: f64,
        tube: f64,
    },
    Prism {
        outline: Outline,
        h: f64,
    },
    Revolve {
        outline: Outline,
    },
}

/// A closed outline, from corner to corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    pub corners: Vec<[f64; 2]>,
    /// Sides that are half circles to the left: the side that ends in the corner of that number.
    pub arcs: Vec<(usize, f64)>,
    /// The radius at every corner.
    pub round: f64,
}

impl Outline {
    pub fn polygon(corners: Vec<[f64; 2]>) -> Outline {
        Outline { corners, arcs: Vec::new(), round: 0.0 }
    }
}

/// Where the copies stand, as the language says it.
#[derive(Debug, Clone, PartialEq)]
pub enum Pattern {
    Line { count: usize, pitch: f64, angle: f64 },
    Grid { count: usize, columns: usize, x: f64, y: f64 },
    Circle { count: usize, d: f64, from: f64 },
}

impl Step {
    pub fn solid(op: Op, shape: Shape, place: Placement) -> Step {
        Step { op, item: Item::Solid { shape, place }, pattern: None, exact: Vec::new() }
    }
}

impl Shape {
    /// The corners of a box around it in its own frame.
    pub fn extent(&self) -> [[f64; 3]; 2] {
        let upright = |r: f64, h: f64| [[-r, -r, 0.0], [r, r, h]];
        match self {
            Shape::Box { x, y, z } => [[-x / 2.0, -y / 2.0, 0.0], [x / 2.0, y / 2.0, *z]],
            Shape::Cylinder { d, h } => upright(d / 2.0, *h),
            Shape::Frustum { d1, d2, h } => upright(d1.max(*d2) / 2.0, *h),
            Shape::Sphere { d } => [[-d / 2.0; 3], [d / 2.0; 3]],
            Shape::Torus { d, tube } => {
                let r = (d + tube) / 2.0;
                [[-r, -r, -tube / 2.0], [r, r, tube / 2.0]]
            }
            Shape::Prism { outline, h } => {
                let [low, high] = outline.extent();
                [[low[0], low[1], 0.0], [high[0], high[1], *h]]
            }
            Shape::Revolve { outline } => {
                let [low, high] = outline.extent();
                [[-high[0], -high[0], low[1]], [high[0], high[0], high[1]]]
            }
        }
    }
}

impl Outline {
    fn extent(&self) -> [[f64; 2]; 2] {
        let reach = self.arcs.iter().fold(0.0, |most: f64, (_, r)| most.max(*r));
        let mut found = [[f64::MAX; 2], [f64::MIN; 2]];
        for corner in &self.corners {
            for axis in 0..2 {
                found[0][axis] = found[0][axis].min(corner[axis] - reach);
                found[1][axis] = found[1][axis].max(corner[axis] + reach);
            }
        }
        found
    }
}
