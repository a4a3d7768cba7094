//! Where faces that go all the way round are cut open, so that each is bounded by one outer loop.
//!
//! In: a face with its loops, and the places already marked on its edges. Out: a [`Plan`]: seams along meridians, or along
//! circles of a torus, from loop to loop, to an apex or a pole. Seams prefer corners and places that a neighbour has
//! marked, then the longitude zero of the axis, so that coaxial faces share their vertices. Never changes a face's shape.

use super::cut::{Cut, Node, Ring, clear_of};
use super::polar::{Polar, directions};
use super::track::Track;
use crate::solid::{Curve, Edge, Solid, Surface};
use nalgebra::{Point3, UnitVector3, Vector3};
use std::f64::consts::TAU;

/// A point nearer to a cut than this (mm) lies on it: the kernel's own measure for points on surfaces.
pub(super) const ON_CUT: f64 = 1e-7;
/// Axes tried for a sphere whose loops suggest none.
const AXES: usize = 24;
/// Share of the radius that a sphere's boundary keeps from its poles, else the longitude tells nothing there.
const CLEAR: f64 = 0.1;

/// What a seam costs: one more vertex on an edge, a hole that becomes part of the outer loop, the seam itself.
pub(super) const COST_SPLIT: usize = 10;
pub(super) const COST_HOLE: usize = 100;
pub(super) const COST_SEAM: usize = 5;
/// Circles of a sphere's loops tried for its axis.
const CIRCLES: usize = 16;
/// Longest arc that is curved on a map (rad).
const QUARTER: f64 = TAU / 4.0;
/// Directions are parallel or square to this cosine, beyond the rounding of turned parts.
const STRAIGHT: f64 = 1e-9;

/// The end of a seam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Foot {
    /// A corner of the solid.
    Corner(usize),
    /// A place on an edge: (edge, parameter of its track).
    On(usize, f64),
    /// The apex or a pole: (0 the lower, 1 the upper end of the meridians).
    Pole(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Seam {
    pub feet: [Foot; 2],
    pub track: Track,
}

/// How a face is opened.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Plan {
    /// The surface's map; `None` for a plane.
    pub polar: Option<Polar>,
    pub seams: Vec<Seam>,
    /// A torus that goes round both ways: (longitude, height) of its two seams.
    pub square: Option<[f64; 2]>,
    /// The loop that is the outer one already.
    pub outer: Option<usize>,
    /// A loop passes through a pole or an apex.
    turns_back: bool,
    cost: usize,
}

/// The solid with the tracks of its edges and the places marked on them so far.
pub(super) struct Seamstress<'a> {
    pub solid: &'a Solid,
    pub tracks: Vec<Track>,
    pub marks: Vec<Vec<f64>>,
}

impl<'a> Seamstress<'a> {
    /// `None` for an edge without geometry.
    pub fn new(solid: &'a Solid) -> Option<Self> {
        let tracks = solid.edges.iter().map(|e| Track::new(e, &solid.vertices)).collect::<Option<Vec<_>>>()?;
        // A closed spline cannot be turned: its vertex is where it starts.
        let closed = |e: &Edge| e.ends[0].is_none() && matches!(e.curve, Curve::Spline { .. });
        let marks = solid.edges.iter().map(|e| if closed(e) { vec![0.0] } else { Vec::new() }).collect();
        Some(Seamstress { solid, tracks, marks })
    }

    /// Plans the seams of a face and marks their feet. A face that no seam was found for stays whole.
    pub fn open(&mut self, face: usize) -> Plan {
        let plan = self.plan(face);
        let feet: Vec<Foot> = plan.seams.iter().flat_map(|s| s.feet).collect();
        for foot in feet {
            if let Foot::On(edge, t) = foot {
                self.mark(edge, t);
            }
        }
        plan
    }

    fn mark(&mut self, edge: usize, t: f64) {
        if self.marked(edge, t).is_none() {
            self.marks[edge].push(t);
            self.marks[edge].sort_by(f64::total_cmp);
        }
    }

    /// Marks the quarters of arcs that are curved on the map of a face. Readers of the kind of Open CASCADE draw an edge on the
    /// map through a few points, the same number for every arc; in quarters that is right to 1e-7 of its size, and in one
    /// piece it would not be.
    pub fn quarter(&mut self, plans: &[Plan]) {
        for (face, plan) in self.solid.faces.iter().zip(plans) {
            let Some(polar) = &plan.polar else { continue };
            for (edge, _) in face.loops.iter().flatten() {
                self.quarters(*edge, polar).into_iter().for_each(|t| self.mark(*edge, t));
            }
        }
    }

    fn quarters(&self, edge: usize, polar: &Polar) -> Vec<f64> {
        let track = &self.tracks[edge];
        let Track::Arc { sweep, .. } = track else { return Vec::new() };
        let count = (sweep / QUARTER - STRAIGHT).ceil().max(1.0);
        if count < 2.0 || polar.is_straight(track) {
            return Vec::new();
        }
        let closed = self.solid.edges[edge].ends[0].is_none();
        let (first, from) = if closed { (0, self.marks[edge].first().copied().unwrap_or(0.0)) } else { (1, 0.0) };
        (first..count as usize).map(|k| (from + k as f64 / count).rem_euclid(1.0)).collect()
    }

    /// The mark at this place of an edge, if there is one.
    pub fn marked(&self, edge: usize, t: f64) -> Option<usize> {
        let at = self.tracks[edge].at(t);
        self.marks[edge].iter().position(|m| (self.tracks[edge].at(*m) - at).norm() < ON_CUT)
    }

    fn plan(&self, face: usize) -> Plan {
        match self.solid.surface(face) {
            Surface::Plane { .. } => Plan { outer: Some(0), ..Plan::default() },
            surface @ Surface::Sphere { .. } => self.plan_sphere(face, surface),
            surface => Polar::new(surface, None).map(|p| self.plan_about(face, p)).unwrap_or_default(),
        }
    }

    /// A sphere has no axis of its own: the best is one that its circles run about or along, for those are straight on the
    /// map, and readers draw what is not straight there only nearly right.
    fn plan_sphere(&self, face: usize, surface: &Surface) -> Plan {
        let arcs = || self.solid.faces[face].loops.iter().flatten().map(|(e, _)| &self.solid.edges[*e]);
        let circle =
            |edge: &Edge| if let Curve::Circle { centre, axis, .. } = edge.curve { Some((centre, axis)) } else { None };
        let circles: Vec<(Point3<f64>, UnitVector3<f64>)> = arcs().filter_map(circle).collect();
        let upright = [Vector3::z_axis(), Vector3::x_axis(), Vector3::y_axis()];
        let natural = circles.iter().map(|c| c.1).take(CIRCLES).chain([surface.axis()]);
        let mut axes: Vec<UnitVector3<f64>> = natural.chain(upright).chain(directions(AXES)).collect();
        let slanted = |axis: &UnitVector3<f64>| {
            circles.iter().filter(|(c, about)| !is_straight(axis, &surface.origin(), c, about)).count()
        };
        axes.sort_by_cached_key(slanted);
        let mut plans = axes.into_iter().filter_map(|axis| self.plan_clear(face, Polar::new(surface, Some(axis))?));
        let first = plans.next();
        let better = |best: Plan| if best.cost < COST_HOLE { best } else { plans.fold(best, cheaper) };
        let last = || Polar::new(surface, None).map(|p| self.plan_about(face, p));
        first.map(better).or_else(last).unwrap_or_default()
    }

    /// The plan of a sphere about an axis; `None` where its border comes too near to a pole to have a longitude.
    fn plan_clear(&self, face: usize, polar: Polar) -> Option<Plan> {
        let plan = self.plan_about(face, polar.clone());
        let clear = match plan.turns_back {
            true => self.stays_about_a_pole(face, &polar),
            false => self.clearance(face, &polar) > CLEAR * polar.radius(),
        };
        clear.then_some(plan)
    }

    /// Whether a face with a corner at a pole stays in that pole's half of the sphere: its border does, and it is not what
    /// lies outside. The other pole, which a reader would not find in it, is then no part of it.
    fn stays_about_a_pole(&self, face: usize, polar: &Polar) -> bool {
        let face = &self.solid.faces[face];
        let tracks = face.loops.iter().flatten().map(|h| &self.tracks[h.0]);
        let heights: Vec<f64> = tracks.flat_map(|t| t.steps().into_iter().map(|s| polar.uv(&t.at(s))[1])).collect();
        let half = |sign: f64| heights.iter().all(|v| v * sign > -STRAIGHT);
        face.area < TAU * polar.radius().powi(2) && (half(1.0) || half(-1.0))
    }

    /// Least distance of a face's edges from the axis, mm.
    fn clearance(&self, face: usize, polar: &Polar) -> f64 {
        let edges = self.solid.faces[face].loops.iter().flatten().map(|h| &self.tracks[h.0]);
        let points = edges.flat_map(|t| t.steps().into_iter().map(|s| t.at(s)));
        points.map(|p| polar.distance_from_axis(&p)).fold(f64::INFINITY, f64::min)
    }

    fn plan_about(&self, face: usize, polar: Polar) -> Plan {
        let whole = Plan { polar: Some(polar.clone()), ..Plan::default() };
        let Some(rings) = self.rings(face, &polar) else {
            return Plan { outer: Some(0), turns_back: true, ..whole };
        };
        let sense = self.solid.faces[face].outward;
        if let Some(outer) = rings.iter().position(|r| r.is_outer(sense)) {
            return Plan { outer: Some(outer), ..whole };
        }
        if polar.is_ring() && !rings.iter().any(Ring::winds) {
            return Plan { square: clear_of(&rings), ..whole };
        }
        // Rings that close round the tube only are joined along circles about the axis, all others along meridians.
        let along = if polar.is_ring() && rings.iter().all(|r| r.winding[0] == 0) { 1 } else { 0 };
        let cut = Cut { sewing: self, polar: &polar, rings: &rings, along, sense };
        let (seams, cost) = cut.best().unwrap_or((Vec::new(), COST_HOLE * COST_HOLE));
        Plan { seams, cost, ..whole }
    }

    /// The loops of a face on the map; `None` if one passes through a pole or apex, where it turns back by itself.
    fn rings(&self, face: usize, polar: &Polar) -> Option<Vec<Ring>> {
        self.solid.faces[face].loops.iter().map(|l| self.ring(polar, l)).collect()
    }

    fn ring(&self, polar: &Polar, halves: &[(usize, bool)]) -> Option<Ring> {
        let mut nodes: Vec<Node> = Vec::new();
        for &(edge, forward) in halves {
            let mut steps = self.tracks[edge].steps();
            steps.extend(&self.marks[edge]);
            steps.sort_by(f64::total_cmp);
            steps.dedup();
            if !forward {
                steps.reverse();
            }
            for pair in steps.windows(2) {
                let p = self.tracks[edge].at(pair[0]);
                if !polar.has_longitude(&p) {
                    return None;
                }
                let arm = [polar.distance_from_axis(&p), polar.tube()];
                nodes.push(Node { p, uv: polar.uv(&p), arm, edge, t: [pair[0], pair[1]] });
            }
        }
        Some(Ring::new(nodes, [true, polar.is_ring()]))
    }

    /// What a foot is at parameter `t` of an edge.
    pub fn foot(&self, edge: usize, t: f64) -> Foot {
        match self.solid.edges[edge].ends {
            [Some(a), _] if t <= 0.0 => Foot::Corner(a),
            [_, Some(b)] if t >= 1.0 => Foot::Corner(b),
            _ => Foot::On(edge, t.rem_euclid(1.0)),
        }
    }

    pub fn cost_of(&self, foot: Foot) -> usize {
        let Foot::On(edge, t) = foot else { return 0 };
        let unmarked_closed = self.solid.edges[edge].ends[0].is_none() && self.marks[edge].is_empty();
        if unmarked_closed || self.marked(edge, t).is_some() { 0 } else { COST_SPLIT }
    }
}

/// Of two plans the one that costs less, the first one where they cost the same.
fn cheaper(a: Plan, b: Plan) -> Plan {
    if b.cost < a.cost { b } else { a }
}

/// Whether a circle on a sphere about `middle` is a parallel or a meridian of its map about `axis`.
fn is_straight(axis: &UnitVector3<f64>, middle: &Point3<f64>, centre: &Point3<f64>, about: &UnitVector3<f64>) -> bool {
    let parallel = axis.cross(about).norm() < STRAIGHT;
    parallel || (axis.dot(about).abs() < STRAIGHT && (centre - middle).norm() < ON_CUT)
}
