//! Where faces that go all the way round are cut open, so that each is bounded by one outer loop.
//!
//! In: a face with its loops, and the places already marked on its edges. Out: a [`Plan`]: seams along meridians, or along
//! circles of a torus, from loop to loop, to an apex or a pole. Seams prefer corners and places that a neighbour has
//! marked, then the longitude zero of the axis, so that coaxial faces share their vertices. Never changes a face's shape.

use super::polar::{Polar, directions};
use super::track::Track;
use crate::solid::{Curve, Edge, Solid, Surface};
use nalgebra::{Point3, UnitVector3, Vector3};
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// A point nearer to a cut than this (mm) lies on it: the kernel's own measure for points on surfaces.
const ON_CUT: f64 = 1e-7;
/// Halvings that use up the precision of a double.
const HALVINGS: usize = 60;
/// Longitudes tried besides those that corners, marks and zero suggest.
const SPREAD: usize = 37;
/// Corners and marks of a loop tried at most: a gear has hundreds, and any will do.
const CORNERS: usize = 48;
/// Axes tried for a sphere whose loops suggest none.
const AXES: usize = 24;
/// Share of the radius that a sphere's boundary keeps from its poles, else the longitude tells nothing there.
const CLEAR: f64 = 0.1;

/// What a seam costs: one more vertex on an edge, a hole that becomes part of the outer loop, the seam itself.
const COST_SPLIT: usize = 10;
const COST_HOLE: usize = 100;
const COST_SEAM: usize = 5;
/// What an edge costs that is neither a meridian nor a parallel of its sphere.
const COST_SLANTED: usize = 1000;
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
        let axes =
            circles.iter().map(|c| c.1).take(CIRCLES).chain([surface.axis()]).chain(upright).chain(directions(AXES));
        let plan = |axis: UnitVector3<f64>| {
            let polar = Polar::new(surface, Some(axis))?;
            let slanted =
                arcs().count() - circles.iter().filter(|(c, a)| is_straight(&axis, &surface.origin(), c, a)).count();
            let plan = self.plan_about(face, polar.clone());
            let clear = match plan.turns_back {
                true => self.stays_about_a_pole(face, &polar),
                false => self.clearance(face, &polar) > CLEAR * polar.radius(),
            };
            clear.then_some((slanted * COST_SLANTED + plan.cost, plan))
        };
        let last = || Polar::new(surface, None).map(|p| self.plan_about(face, p));
        axes.filter_map(plan).min_by_key(|p| p.0).map(|p| p.1).or_else(last).unwrap_or_default()
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
                nodes.push(Node { p, uv: polar.uv(&p), edge, t: [pair[0], pair[1]] });
            }
        }
        let wraps = [true, polar.is_ring()];
        Some(Ring { winding: winding(&nodes, wraps), nodes, wraps })
    }

    /// What a foot is at parameter `t` of an edge.
    fn foot(&self, edge: usize, t: f64) -> Foot {
        match self.solid.edges[edge].ends {
            [Some(a), _] if t <= 0.0 => Foot::Corner(a),
            [_, Some(b)] if t >= 1.0 => Foot::Corner(b),
            _ => Foot::On(edge, t.rem_euclid(1.0)),
        }
    }

    fn cost_of(&self, foot: Foot) -> usize {
        let Foot::On(edge, t) = foot else { return 0 };
        let unmarked_closed = self.solid.edges[edge].ends[0].is_none() && self.marks[edge].is_empty();
        if unmarked_closed || self.marked(edge, t).is_some() { 0 } else { COST_SPLIT }
    }
}

/// Whether a circle on a sphere about `middle` is a parallel or a meridian of its map about `axis`.
fn is_straight(axis: &UnitVector3<f64>, middle: &Point3<f64>, centre: &Point3<f64>, about: &UnitVector3<f64>) -> bool {
    let parallel = axis.cross(about).norm() < STRAIGHT;
    parallel || (axis.dot(about).abs() < STRAIGHT && (centre - middle).norm() < ON_CUT)
}

/// A sampled point of a loop and the step of the edge that starts there.
#[derive(Debug, Clone)]
struct Node {
    p: Point3<f64>,
    uv: [f64; 2],
    edge: usize,
    t: [f64; 2],
}

/// A loop on the map, as the face's boundary runs.
#[derive(Debug, Clone)]
struct Ring {
    nodes: Vec<Node>,
    /// Turns round the axis and, on a torus, round the tube.
    winding: [i32; 2],
    wraps: [bool; 2],
}

/// The difference of two angles, in -π..=π.
fn wrapped(angle: f64) -> f64 {
    angle - (angle / TAU).round() * TAU
}

/// How far a coordinate goes on from one node to the next.
fn step(from: f64, to: f64, wraps: bool) -> f64 {
    if wraps { wrapped(to - from) } else { to - from }
}

fn winding(nodes: &[Node], wraps: [bool; 2]) -> [i32; 2] {
    [0, 1].map(|k| {
        let step = |i: usize| step(nodes[i].uv[k], nodes[(i + 1) % nodes.len()].uv[k], wraps[k]);
        let sum: f64 = (0..nodes.len()).map(step).sum();
        if wraps[k] { (sum / TAU).round() as i32 } else { 0 }
    })
}

impl Ring {
    fn winds(&self) -> bool {
        self.winding != [0, 0]
    }

    /// True for a loop that bounds all of its face from outside: it closes without going round, the face within.
    fn is_outer(&self, outward: bool) -> bool {
        let mut at = self.nodes[0].uv;
        let mut area = 0.0;
        for (i, node) in self.nodes.iter().enumerate() {
            let next = self.nodes[(i + 1) % self.nodes.len()].uv;
            let to = [0, 1].map(|k| at[k] + step(node.uv[k], next[k], self.wraps[k]));
            area += at[0] * to[1] - to[0] * at[1];
            at = to;
        }
        !self.winds() && (area > 0.0) == outward
    }
}

/// Longitude and height of a torus that no loop comes near: the middles of the widest gaps.
fn clear_of(rings: &[Ring]) -> Option<[f64; 2]> {
    let widest = |k: usize| {
        let mut angles: Vec<f64> = rings.iter().flat_map(|r| &r.nodes).map(|n| n.uv[k]).collect();
        angles.sort_by(f64::total_cmp);
        let gap = |i: usize| match angles.get(i + 1) {
            Some(next) => (next - angles[i], angles[i]),
            None => (angles[0] + TAU - angles[i], angles[i]),
        };
        let best = (0..angles.len()).map(gap).max_by(|a, b| a.0.total_cmp(&b.0));
        best.map_or(0.0, |(width, from)| from + width / 2.0)
    };
    Some([widest(0), widest(1)])
}

/// Where a loop crosses a cut.
#[derive(Debug, Clone, Copy)]
struct Crossing {
    ring: usize,
    foot: Foot,
    p: Point3<f64>,
    /// Height along the cut.
    h: f64,
    /// Whether the face lies above it.
    above: bool,
}

/// A loop, or an end of the meridians.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shore {
    Ring(usize),
    Pole(usize),
}

/// A piece of a cut inside the face.
#[derive(Debug, Clone, Copy)]
struct Bridge {
    shores: [Shore; 2],
    feet: [(Foot, Point3<f64>); 2],
}

/// The search for the best cut of one face.
struct Cut<'a> {
    sewing: &'a Seamstress<'a>,
    polar: &'a Polar,
    rings: &'a [Ring],
    /// Cuts at constant longitude (0) or, on a torus, at constant height (1).
    along: usize,
    sense: bool,
}

impl Cut<'_> {
    fn best(&self) -> Option<(Vec<Seam>, usize)> {
        let tried = self.candidates().into_iter().filter_map(|s| self.at(s));
        tried.min_by_key(|(_, cost)| *cost)
    }

    /// Longitudes (or heights) worth trying, the best ones first.
    fn candidates(&self) -> Vec<f64> {
        let place = |n: &&Node| matches!(self.sewing.foot(n.edge, n.t[0]), Foot::Corner(_)) || self.is_mark(n);
        let places =
            |r: &Ring| r.nodes.iter().filter(place).take(CORNERS).map(|n| n.uv[self.along]).collect::<Vec<_>>();
        let spread = (0..SPREAD).map(|i| (i as f64 + 0.5) * TAU / SPREAD as f64);
        let winds = self.rings.iter().filter(|r| r.winds());
        std::iter::once(0.0).chain(winds.flat_map(places)).chain(spread).collect()
    }

    fn is_mark(&self, node: &Node) -> bool {
        self.sewing.marks[node.edge].contains(&node.t[0])
    }

    /// The seams of the cut at `s` and what they cost; `None` if it runs along an edge or touches one.
    fn at(&self, s: f64) -> Option<(Vec<Seam>, usize)> {
        let mut crossings = Vec::new();
        for ring in 0..self.rings.len() {
            self.cross(ring, s, &mut crossings)?;
        }
        crossings.sort_by(|a, b| a.h.total_cmp(&b.h));
        let bridges = self.bridges(&crossings)?;
        let shores = self.shores(&bridges)?;
        let path = path(&bridges, shores)?;
        let feet = path.iter().flat_map(|b| b.feet).map(|f| self.sewing.cost_of(f.0)).sum::<usize>();
        let cost = feet + path.len() * COST_SEAM + (path.len() - 1) * COST_HOLE;
        let seam = |b: &Bridge| Seam { feet: b.feet.map(|f| f.0), track: self.track(s, b) };
        Some((path.iter().map(seam).collect(), cost))
    }

    fn track(&self, s: f64, bridge: &Bridge) -> Track {
        let [(_, from), (_, to)] = bridge.feet;
        match self.along {
            0 => self.polar.meridian(s, from, to),
            _ => {
                let [u, w] = [from, to].map(|p| self.polar.uv(&p)[0]);
                let share = (w - u).rem_euclid(TAU) / TAU;
                self.polar.parallel(u, s).map_or(Track::Line { from, to }, |whole| whole.part(0.0, share))
            }
        }
    }

    /// How far past the cut at `s` a place is, mm and signed; very far on the other side of the axis.
    fn past(&self, p: &Point3<f64>, s: f64) -> f64 {
        let uv = self.polar.uv(p);
        let angle = wrapped(uv[self.along] - s);
        let arm = if self.along == 0 { self.polar.distance_from_axis(p) } else { self.polar.tube() };
        angle * arm
    }

    /// Adds the crossings of one loop with the cut at `s`.
    fn cross(&self, ring: usize, s: f64, out: &mut Vec<Crossing>) -> Option<()> {
        let nodes = &self.rings[ring].nodes;
        let sides: Vec<f64> = nodes.iter().map(|n| self.past(&n.p, s)).collect();
        let far = |n: &Node| wrapped(n.uv[self.along] - s).abs() > PI / 2.0;
        let on = |i: usize| sides[i % nodes.len()].abs() < ON_CUT;
        for i in 0..nodes.len() {
            let (j, before) = ((i + 1) % nodes.len(), (i + nodes.len() - 1) % nodes.len());
            if on(i) {
                if on(j) || on(before) || sides[before] * sides[j] > 0.0 {
                    return None;
                }
                self.push(ring, nodes[i].edge, nodes[i].t[0], sides[j] > 0.0, out);
            } else if !on(j) && sides[i] * sides[j] < 0.0 && !(far(&nodes[i]) && far(&nodes[j])) {
                let t = self.crossing(&nodes[i], s);
                self.push(ring, nodes[i].edge, t, sides[j] > 0.0, out);
            }
        }
        Some(())
    }

    fn push(&self, ring: usize, edge: usize, t: f64, rises: bool, out: &mut Vec<Crossing>) {
        let p = self.sewing.tracks[edge].at(t);
        let h = self.polar.uv(&p)[1 - self.along];
        // With the face on the left, it lies above a step towards greater u; the map of heights is its mirror image.
        let above = rises == (self.sense == (self.along == 0));
        out.push(Crossing { ring, foot: self.sewing.foot(edge, t), p, h, above });
    }

    /// The parameter at which a step crosses the cut.
    fn crossing(&self, node: &Node, s: f64) -> f64 {
        let track = &self.sewing.tracks[node.edge];
        let [mut low, mut high] = node.t;
        let start = self.past(&node.p, s);
        for _ in 0..HALVINGS {
            let middle = (low + high) / 2.0;
            if self.past(&track.at(middle), s) * start > 0.0 { low = middle } else { high = middle }
        }
        (low + high) / 2.0
    }

    /// The pieces of the cut inside the face, from bottom to top; `None` if sides do not alternate.
    fn bridges(&self, crossings: &[Crossing]) -> Option<Vec<Bridge>> {
        let end = |c: &Crossing| (Shore::Ring(c.ring), (c.foot, c.p));
        let pole = |k: usize| self.polar.pole(k).map(|p| (Shore::Pole(k), (Foot::Pole(k), p)));
        let bridge = |a: (Shore, (Foot, Point3<f64>)), b: (Shore, (Foot, Point3<f64>))| Bridge {
            shores: [a.0, b.0],
            feet: [a.1, b.1],
        };
        let mut bridges = Vec::new();
        let (Some(first), Some(last)) = (crossings.first(), crossings.last()) else {
            return Some(vec![bridge(pole(0)?, pole(1)?)]);
        };
        let cyclic = self.polar.is_ring();
        if !first.above && !cyclic {
            bridges.push(bridge(pole(0)?, end(first)));
        }
        for pair in crossings.windows(2) {
            if pair[0].above == pair[1].above {
                return None;
            }
            if pair[0].above {
                bridges.push(bridge(end(&pair[0]), end(&pair[1])));
            }
        }
        if last.above {
            bridges.push(bridge(end(last), if cyclic { end(first) } else { pole(1)? }));
        }
        Some(bridges)
    }

    /// The two shores that must be joined: the loops that go round, and poles inside the face.
    fn shores(&self, bridges: &[Bridge]) -> Option<[Shore; 2]> {
        let winds = |r: &usize| self.rings[*r].winds();
        let rings = (0..self.rings.len()).filter(winds).map(Shore::Ring);
        let poles = bridges.iter().flat_map(|b| b.shores).filter(|s| matches!(s, Shore::Pole(_)));
        let all: Vec<Shore> = rings.chain(poles).collect();
        if let [a, b] = all[..] { Some([a, b]) } else { None }
    }
}

/// The fewest bridges that lead from one shore to the other (breadth first).
fn path(bridges: &[Bridge], [from, to]: [Shore; 2]) -> Option<Vec<Bridge>> {
    let mut reached: Vec<(Shore, Vec<Bridge>)> = vec![(from, Vec::new())];
    let mut open = VecDeque::from([0]);
    while let Some(at) = open.pop_front() {
        let (shore, way) = reached[at].clone();
        if shore == to {
            return Some(way);
        }
        for b in bridges.iter().filter(|b| b.shores.contains(&shore)) {
            let next = if b.shores[0] == shore { b.shores[1] } else { b.shores[0] };
            if reached.iter().all(|r| r.0 != next) {
                reached.push((next, way.iter().copied().chain([*b]).collect()));
                open.push_back(reached.len() - 1);
            }
        }
    }
    None
}
