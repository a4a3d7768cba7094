//! The search for a cut of a round face: a meridian (or a circle of a torus) and the pieces of it inside the face.
//!
//! In: the loops of a face on the map of its surface. Out: seams that join what must be joined, cheapest first. Positions are
//! exact: where a cut crosses an edge is found on the edge's own curve.

use super::polar::Polar;
use super::seam::{COST_HOLE, COST_SEAM, Foot, ON_CUT, Seam, Seamstress};
use super::track::Track;
use nalgebra::Point3;
use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};

/// Halvings that use up the precision of a double.
const HALVINGS: usize = 60;
/// Longitudes tried besides those that corners, marks and zero suggest.
const SPREAD: usize = 37;
/// Corners and marks of a loop tried at most: a gear has hundreds, and any will do.
const CORNERS: usize = 48;

/// A sampled point of a loop and the step of the edge that starts there.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub p: Point3<f64>,
    pub uv: [f64; 2],
    /// What a radian of longitude and, on a torus, of height is worth here, mm.
    pub arm: [f64; 2],
    pub edge: usize,
    pub t: [f64; 2],
}

/// A loop on the map, as the face's boundary runs.
#[derive(Debug, Clone)]
pub(super) struct Ring {
    nodes: Vec<Node>,
    /// Turns round the axis and, on a torus, round the tube.
    pub winding: [i32; 2],
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
    /// `wraps` tells which coordinates are angles that start again.
    pub fn new(nodes: Vec<Node>, wraps: [bool; 2]) -> Ring {
        Ring { winding: winding(&nodes, wraps), nodes, wraps }
    }

    pub fn winds(&self) -> bool {
        self.winding != [0, 0]
    }

    /// True for a loop that bounds all of its face from outside: it closes without going round, the face within.
    pub fn is_outer(&self, outward: bool) -> bool {
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
pub(super) fn clear_of(rings: &[Ring]) -> Option<[f64; 2]> {
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
pub(super) struct Cut<'a> {
    pub sewing: &'a Seamstress<'a>,
    pub polar: &'a Polar,
    pub rings: &'a [Ring],
    /// Cuts at constant longitude (0) or, on a torus, at constant height (1).
    pub along: usize,
    /// Whether the face looks away from the axis.
    pub sense: bool,
}

impl Cut<'_> {
    /// The cheapest seams found, and what they cost.
    pub fn best(&self) -> Option<(Vec<Seam>, usize)> {
        let mut best: Option<(Vec<Seam>, usize)> = None;
        for found in self.candidates().into_iter().filter_map(|s| self.at(s)) {
            if best.as_ref().is_none_or(|b| found.1 < b.1) {
                best = Some(found);
            }
            // Nothing is cheaper than one seam between places that are there.
            if best.as_ref().is_some_and(|b| b.1 <= COST_SEAM) {
                break;
            }
        }
        best
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
        let sides: Vec<f64> = nodes.iter().map(|n| wrapped(n.uv[self.along] - s) * n.arm[self.along]).collect();
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
