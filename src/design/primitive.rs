//! Shapes in their own frames, part of the [model](super::model): primitives, outlines and groups.
//!
//! Lengths are millimetres; every size is an expression over the design's dimensions.

use super::model::{Expr, Feature};
use serde::Serialize;

/// How far a feature reaches along its own z.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Extent {
    Length(Expr),
    /// Beyond the part at both ends, whatever its draw (cuts only).
    Through,
}

/// A primitive in its own frame. Boxes, cylinders, cones and prisms stand on z = 0; a box is centred in x and y; a sphere
/// and a torus are centred on the origin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Shape {
    Box {
        x: Expr,
        y: Expr,
        z: Extent,
    },
    /// Diameter and height.
    Cylinder {
        d: Expr,
        h: Extent,
    },
    /// A frustum: diameter at z = 0, diameter at z = h (0 makes a point), height.
    Cone {
        d1: Expr,
        d2: Expr,
        h: Extent,
    },
    Sphere {
        d: Expr,
    },
    /// Diameter of the circle in z = 0 that the tube is centred on, and of the tube.
    Torus {
        d: Expr,
        tube: Expr,
    },
    /// An outline in x and y, extruded along z.
    Prism {
        outline: Outline,
        h: Extent,
    },
    /// An outline in x (the distance from the axis, nowhere negative) and z, turned a whole turn about z.
    Revolve {
        outline: Outline,
    },
    /// Features folded among themselves, in the group's frame. The group has material where its features leave some.
    Group {
        features: Vec<Feature>,
    },
}

impl Shape {
    /// Every expression of a primitive; none of a group, whose features have their own.
    pub fn exprs(&self) -> Vec<&Expr> {
        let (mut sizes, outline, extent) = match self {
            Shape::Box { x, y, z } => (vec![x, y], None, Some(z)),
            Shape::Cylinder { d, h } => (vec![d], None, Some(h)),
            Shape::Cone { d1, d2, h } => (vec![d1, d2], None, Some(h)),
            Shape::Sphere { d } => (vec![d], None, None),
            Shape::Torus { d, tube } => (vec![d, tube], None, None),
            Shape::Prism { outline, h } => (vec![], Some(outline), Some(h)),
            Shape::Revolve { outline } => (vec![], Some(outline), None),
            Shape::Group { .. } => (vec![], None, None),
        };
        sizes.extend(outline.into_iter().flat_map(Outline::exprs));
        if let Some(Extent::Length(length)) = extent {
            sizes.push(length);
        }
        sizes
    }
}

/// A closed outline in a plane, mm: from `start` along its sides; a straight side leads back to `start` where the last
/// side does not end there. Either way round; it may not cross or touch itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outline {
    pub start: [Expr; 2],
    pub start_corner: Corner,
    pub sides: Vec<OutlineSide>,
}

impl Outline {
    /// Every coordinate, radius and size of a corner.
    pub fn exprs(&self) -> Vec<&Expr> {
        let mut exprs: Vec<&Expr> = self.start.iter().chain(self.start_corner.size()).collect();
        for side in &self.sides {
            exprs.extend(side.to.iter().chain(side.corner.size()));
            if let OutlinePath::Arc { radius, .. } = &side.path {
                exprs.push(radius);
            }
        }
        exprs
    }
}

/// One side of an outline, from where the one before it ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutlineSide {
    /// Names the face it makes: `rail.flank`, or `rail.2` for the second side of an outline without names.
    pub name: String,
    pub to: [Expr; 2],
    pub path: OutlinePath,
    /// What becomes of the corner at `to`.
    pub corner: Corner,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum OutlinePath {
    Line,
    /// An arc of this radius; counter-clockwise when `left`; more than half a turn when `long`.
    Arc {
        radius: Expr,
        left: bool,
        long: bool,
    },
}

/// The corner between two straight sides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Corner {
    Sharp,
    /// Rounded with this radius.
    Round(Expr),
    /// Cut off at this distance from the corner on both sides.
    Chamfer(Expr),
}

impl Corner {
    pub fn size(&self) -> Option<&Expr> {
        match self {
            Corner::Sharp => None,
            Corner::Round(size) | Corner::Chamfer(size) => Some(size),
        }
    }
}
