//! Loops of a face in the chart of its surface.
//!
//! In: a surface, edges with their samples, loops. Out: the [`Chart`] that a face is laid out in and its [`Ring`]s, unrolled so
//! that u and v are continuous. What polygon they make is for `border` to say.

use super::surface::{is_ring, pole_angle, radial};
use super::{Edge, Quality, Surface, tolerance};
use nalgebra::{Point3, Vector3};
use std::f64::consts::TAU;

/// The chart that a face is laid out in: its surface's own, or that turned by a right angle for a face that goes round the
/// tube of a torus, so that a face goes round along u only.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart<'a> {
    pub surface: &'a Surface,
    pub turned: bool,
}

impl Chart<'_> {
    pub fn uv(&self, p: &Point3<f64>) -> [f64; 2] {
        let [u, v] = self.surface.chart(p);
        if self.turned { [v, -u] } else { [u, v] }
    }

    /// Coordinates in the surface's own chart.
    pub fn own(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        if self.turned { [-v, u] } else { [u, v] }
    }

    pub fn at(&self, uv: [f64; 2]) -> Point3<f64> {
        self.surface.at(self.own(uv))
    }

    pub fn normal(&self, uv: [f64; 2]) -> Vector3<f64> {
        self.surface.chart_normal(self.own(uv))
    }

    /// After how much u and v start again.
    pub fn periods(&self) -> [Option<f64>; 2] {
        let own = [self.surface.period(), self.surface.period_across()];
        if self.turned { [own[1], own[0]] } else { own }
    }

    /// Steps along u and v for a curve once round, fine enough for `quality`.
    pub fn steps(&self, quality: &Quality) -> [usize; 2] {
        let own = match self.surface {
            Surface::Sphere { radius, .. } => [quality.steps(*radius); 2],
            Surface::Torus { major, minor, .. } => [quality.steps(major.abs() + minor), quality.steps(*minor)],
            _ => [1, 1],
        };
        if self.turned { [own[1], own[0]] } else { own }
    }

    /// Places along u (0) or v (1) at whole steps, in a range: evenly spaced in angle on spheres and tori.
    pub fn places(&self, along: usize, [low, high]: [f64; 2], steps: usize) -> Vec<f64> {
        let angle = |k: i64| k as f64 * TAU / steps as f64;
        match (self.surface, (along == 1) != self.turned) {
            (Surface::Sphere { radius, .. }, true) => {
                let rows = (1..steps as i64 / 2).map(|k| radius * (1.0 - angle(k).cos()));
                rows.filter(|v| low < *v && *v < high).collect()
            }
            (Surface::Torus { major, minor, .. }, true) => {
                let turns = self.surface.period_across().map_or([0.0, 0.0], |p| [low / p - 0.5, high / p + 0.5]);
                let (first, last) =
                    ((turns[0].floor() as i64 - 1) * steps as i64, (turns[1].ceil() as i64 + 1) * steps as i64);
                let reach = if is_ring(*major, *minor) { f64::INFINITY } else { pole_angle(*major, *minor) };
                let within = (first..=last).map(angle).filter(|a| a.abs() < reach);
                within.map(|a| major * a + minor * a.sin()).filter(|v| low < *v && *v < high).collect()
            }
            _ => {
                let step = self.periods()[along].unwrap_or(1.0) / steps as f64;
                ((low / step).ceil() as i64..=(high / step).floor() as i64).map(|k| k as f64 * step).collect()
            }
        }
    }
}

/// A sampled point of a face: chart coordinates, and which vertex of the mesh it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Node {
    pub uv: [f64; 2],
    pub id: u32,
}

/// A loop in the chart, the face on its left; it closes after `winding` periods of u.
#[derive(Debug, Clone)]
pub(super) struct Ring {
    pub nodes: Vec<Node>,
    pub winding: i32,
    /// Zero where there is none.
    pub period: f64,
    /// Of v; zero where there is none.
    pub height: f64,
}

/// The loops of a face, or of all faces on one surface, and the chart they are laid out in; `None` when a loop goes round
/// both ways at once.
pub(super) fn lay_out<'a>(
    surface: &'a Surface,
    outward: bool,
    edges: &[Edge],
    offsets: &[u32],
    loops: &[Vec<(usize, bool)>],
) -> Option<(Chart<'a>, Vec<Ring>)> {
    let chart = Chart { surface, turned: false };
    let rings = |chart: &Chart| -> Vec<(Ring, i32)> {
        loops.iter().map(|l| Ring::new(chart, outward, edges, offsets, l)).collect()
    };
    let straight = rings(&chart);
    if straight.iter().all(|r| r.1 == 0) {
        return Some((chart, straight.into_iter().map(|r| r.0).collect()));
    }
    let chart = Chart { surface, turned: true };
    let turned = rings(&chart);
    turned.iter().all(|r| r.1 == 0).then(|| (chart, turned.into_iter().map(|r| r.0).collect()))
}

/// First mesh vertex of each edge's inner samples: the solid's corners come first, then the samples edge by edge. One
/// more entry holds the total.
pub(super) fn offsets(corners: usize, edges: &[Edge]) -> Vec<u32> {
    let mut next = corners;
    let mut offsets = vec![next as u32];
    for edge in edges {
        next += inner(edge);
        offsets.push(next as u32);
    }
    offsets
}

/// Samples of an edge that are no corner, the closing one of a closed edge counted once.
fn inner(edge: &Edge) -> usize {
    edge.samples.len() - if edge.ends[0].is_some() { 2 } else { 1 }
}

/// Mesh vertex of sample `k` of edge `e`.
fn vertex(edges: &[Edge], offsets: &[u32], e: usize, k: usize) -> u32 {
    let edge = &edges[e];
    let last = edge.samples.len() - 1;
    match edge.ends {
        [Some(a), _] if k == 0 => a as u32,
        [_, Some(b)] if k == last => b as u32,
        [Some(_), _] => offsets[e] + k as u32 - 1,
        _ => offsets[e] + (k % last) as u32,
    }
}

impl Ring {
    /// The loop of (edge, runs forward), which has its face on the left seen from outside; and how often it goes round along
    /// v.
    fn new(chart: &Chart, outward: bool, edges: &[Edge], offsets: &[u32], halves: &[(usize, bool)]) -> (Self, i32) {
        let mut points: Vec<(Point3<f64>, u32)> = Vec::new();
        for &(e, forward) in halves {
            let last = edges[e].samples.len() - 1;
            let steps = (0..last).map(|k| if forward { k } else { last - k });
            points.extend(steps.map(|k| (edges[e].samples[k], vertex(edges, offsets, e, k))));
        }
        // Seen along the chart's normal instead of from outside, a loop of an inward face runs the other way.
        if !outward {
            points.reverse();
        }
        let [period, height] = chart.periods().map(|p| p.unwrap_or(0.0));
        let nodes = unroll(chart, [period, height], &points);
        let round = |k: usize, period: f64| match (nodes.first(), nodes.last()) {
            (Some(first), Some(last)) if period > 0.0 => {
                ((nearest(first.uv[k], last.uv[k], period) - first.uv[k]) / period).round() as i32
            }
            _ => 0,
        };
        let (winding, across) = (round(0, period), round(1, height));
        (Ring { nodes, winding, period, height }, across)
    }

    /// Neighbouring nodes, the last with the first a winding further on.
    pub fn segments(&self) -> impl Iterator<Item = ([f64; 2], [f64; 2])> + '_ {
        let turn = f64::from(self.winding) * self.period;
        (0..self.nodes.len()).map(move |i| match self.nodes.get(i + 1) {
            Some(next) => (self.nodes[i].uv, next.uv),
            None => (self.nodes[i].uv, [self.nodes[0].uv[0] + turn, self.nodes[0].uv[1]]),
        })
    }

    /// Area enclosed by a ring that does not wind; negative for a hole.
    pub fn area(&self) -> f64 {
        self.segments().map(|(a, b)| (a[0] * b[1] - b[0] * a[1]) / 2.0).sum()
    }

    pub fn is_outer(&self) -> bool {
        self.winding == 0 && self.area() > 0.0
    }

    /// A point beside the node with the least v, on a segment with the face right below it. Not the node itself: nodes of
    /// different rings share their u, and which of two neighbours a ray through a node meets is a matter of rounding.
    pub fn lowest(&self) -> [f64; 2] {
        let segments: Vec<_> = self.segments().collect();
        let low = (0..segments.len()).min_by(|i, j| segments[*i].0[1].total_cmp(&segments[*j].0[1])).unwrap_or(0);
        let Some((from, to)) = segments.get(low) else { return [0.0, 0.0] };
        let (before, at) = segments[(low + segments.len() - 1) % segments.len()];
        // With the face on the left, it lies below a segment that runs towards smaller u.
        let (start, end) = if to[0] < from[0] { (*from, *to) } else { (at, before) };
        [0, 1].map(|k| start[k] + (end[k] - start[k]) * BESIDE)
    }

    /// Greatest v below `p` at which the ring crosses p's u.
    pub fn below(&self, p: [f64; 2]) -> Option<f64> {
        let crossing = |(a, b): ([f64; 2], [f64; 2])| {
            let (low, high) = (a[0].min(b[0]), a[0].max(b[0]));
            let u = if self.period > 0.0 { low + (p[0] - low).rem_euclid(self.period) } else { p[0] };
            let v = a[1] + (b[1] - a[1]) * (u - a[0]) / (b[0] - a[0]);
            let v = if self.height > 0.0 { p[1] - (p[1] - v).rem_euclid(self.height) } else { v };
            (low <= u && u < high && v < p[1]).then_some(v)
        };
        self.segments().filter_map(crossing).max_by(f64::total_cmp)
    }

    /// Where a ring can be crossed at all.
    pub fn reach(&self) -> Reach {
        let mut reach = Reach { u: [f64::INFINITY, f64::NEG_INFINITY], lowest: f64::INFINITY, period: self.period };
        for (a, b) in self.segments() {
            reach.u = [reach.u[0].min(a[0]).min(b[0]), reach.u[1].max(a[0]).max(b[0])];
            reach.lowest = reach.lowest.min(a[1]).min(b[1]);
        }
        if self.height > 0.0 {
            reach.lowest = f64::NEG_INFINITY;
        }
        reach
    }

    /// The ring moved along v, where that is periodic, to the first place above `low`.
    pub fn above(&self, low: &Ring) -> Ring {
        let mut ring = self.clone();
        if self.height > 0.0 {
            let from = low.nodes[0].uv;
            let off = |n: &&Node| (nearest(n.uv[0], from[0], self.period) - from[0]).abs();
            let there = self.nodes.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map_or(from[1], |n| n.uv[1]);
            let shift = (there - from[1]).rem_euclid(self.height) - (there - from[1]);
            ring.nodes.iter_mut().for_each(|n| n.uv[1] += shift);
        }
        ring
    }

    /// The ring moved by whole periods.
    pub fn shifted(&self, by: [f64; 2]) -> Vec<Node> {
        self.nodes.iter().map(|n| Node { uv: [n.uv[0] + by[0], n.uv[1] + by[1]], id: n.id }).collect()
    }
}

/// The stretch of u a ring lies over, and its least v, so that rays need not be tried on rings far away.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    u: [f64; 2],
    lowest: f64,
    period: f64,
}

impl Reach {
    /// Whether a ray down from `p` may cross the ring.
    pub fn may_cross(&self, p: [f64; 2]) -> bool {
        let off = p[0] - self.u[0];
        let off =
            if self.period > 0.0 { (off + tolerance::WELD).rem_euclid(self.period) } else { off + tolerance::WELD };
        (0.0..=self.u[1] - self.u[0] + 2.0 * tolerance::WELD).contains(&off) && self.lowest <= p[1] + tolerance::WELD
    }
}

/// How far from the lowest node a ray starts, as a share of the segment.
const BESIDE: f64 = 0.0137;

/// `u` moved by whole periods to within half a period of `to`.
pub(super) fn nearest(u: f64, to: f64, period: f64) -> f64 {
    if period > 0.0 { u + ((to - u) / period).round() * period } else { u }
}

/// Chart coordinates with continuous u and v. An apex or a pole, where u is undefined, becomes a row of
/// nodes from the u of the one neighbour to that of the other.
fn unroll(chart: &Chart, periods: [f64; 2], points: &[(Point3<f64>, u32)]) -> Vec<Node> {
    let charted: Vec<([f64; 2], bool, u32)> =
        points.iter().map(|(p, id)| (chart.uv(p), singular(chart.surface, p), *id)).collect();
    let start = charted.iter().position(|c| !c.1).unwrap_or(0);
    let mut nodes: Vec<Node> = Vec::with_capacity(charted.len());
    for i in 0..charted.len() {
        let (uv, is_singular, id) = charted[(start + i) % charted.len()];
        let last = nodes.last().map_or(uv, |n: &Node| n.uv);
        let v = nearest(uv[1], last[1], periods[1]);
        if is_singular {
            let after = charted[(start + i + 1) % charted.len()].0[0];
            // With the face on the left, a lower pole is passed towards larger u, an upper one towards smaller.
            let lower = chart.surface.poles()[0].is_some_and(|low| (v - low).abs() < tolerance::WELD);
            let onward = (after - last[0]).rem_euclid(periods[0]);
            let turn = if lower { onward } else { onward - periods[0] };
            let steps = (turn.abs() / periods[0] * POLE_STEPS).ceil().max(1.0);
            // One point, but with a normal of its own for every direction.
            nodes.extend((0..=steps as usize).map(|k| Node { uv: [last[0] + turn * k as f64 / steps, v], id }));
        } else {
            nodes.push(Node { uv: [nearest(uv[0], last[0], periods[0]), v], id });
        }
    }
    nodes
}

/// Nodes for a whole turn about an apex or a pole.
const POLE_STEPS: f64 = 64.0;

/// True at an apex or a pole.
fn singular(surface: &Surface, p: &Point3<f64>) -> bool {
    match surface {
        Surface::Cone { apex, .. } => (p - apex).norm() < tolerance::WELD,
        Surface::Sphere { centre, .. } | Surface::Torus { centre, .. } => {
            radial(centre, &surface.axis(), p).norm() < tolerance::WELD
        }
        _ => false,
    }
}
