//! Loops of a face in the chart of its surface, and the plane outline they make.
//!
//! In: a surface, edges with their samples, loops. Out: [`Ring`]s, unrolled so that u is continuous, and [`Outline`]s:
//! one closed polygon round the face and its holes, a face that goes all the way round being cut along a seam.

use super::surface::radial;
use super::{Edge, Surface, tolerance};
use nalgebra::Point3;

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
    period: f64,
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
    /// The loop of (edge, runs forward), which has its face on the left seen from outside.
    pub fn new(surface: &Surface, outward: bool, edges: &[Edge], offsets: &[u32], halves: &[(usize, bool)]) -> Self {
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
        let period = surface.period().unwrap_or(0.0);
        let mut ring = Ring { nodes: unroll(surface, period, &points), winding: 0, period };
        if period > 0.0 && !ring.nodes.is_empty() {
            let (first, last) = (ring.nodes[0].uv[0], ring.nodes[ring.nodes.len() - 1].uv[0]);
            ring.winding = ((nearest(first, last, period) - first) / period).round() as i32;
        }
        ring
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
            (low <= u && u < high && v < p[1]).then_some(v)
        };
        self.segments().filter_map(crossing).max_by(f64::total_cmp)
    }

    /// The ring moved by whole periods.
    fn shifted(&self, by: f64) -> Vec<Node> {
        self.nodes.iter().map(|n| Node { uv: [n.uv[0] + by, n.uv[1]], id: n.id }).collect()
    }
}

/// How far from the lowest node a ray starts, as a share of the segment.
const BESIDE: f64 = 0.0137;

/// `u` moved by whole periods to within half a period of `to`.
fn nearest(u: f64, to: f64, period: f64) -> f64 {
    if period > 0.0 { u + ((to - u) / period).round() * period } else { u }
}

/// Chart coordinates with continuous u. An apex or a pole, where u is undefined, becomes two nodes with its neighbours' u.
fn unroll(surface: &Surface, period: f64, points: &[(Point3<f64>, u32)]) -> Vec<Node> {
    let charted: Vec<([f64; 2], bool, u32)> =
        points.iter().map(|(p, id)| (surface.chart(p), singular(surface, p), *id)).collect();
    let start = charted.iter().position(|c| !c.1).unwrap_or(0);
    let mut nodes: Vec<Node> = Vec::with_capacity(charted.len());
    for i in 0..charted.len() {
        let (uv, is_singular, id) = charted[(start + i) % charted.len()];
        let last = nodes.last().map_or(uv[0], |n: &Node| n.uv[0]);
        if is_singular {
            let after = charted[(start + i + 1) % charted.len()].0[0];
            nodes.push(Node { uv: [last, uv[1]], id });
            nodes.push(Node { uv: [nearest(after, last, period), uv[1]], id });
        } else {
            nodes.push(Node { uv: [nearest(uv[0], last, period), uv[1]], id });
        }
    }
    nodes
}

/// True at an apex or a pole.
fn singular(surface: &Surface, p: &Point3<f64>) -> bool {
    match surface {
        Surface::Cone { apex, .. } => (p - apex).norm() < tolerance::WELD,
        Surface::Sphere { centre, .. } => radial(centre, &surface.axis(), p).norm() < tolerance::WELD,
        _ => false,
    }
}

/// A face as a polygon, counter-clockwise in the chart, with holes.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub outer: Vec<Node>,
    pub holes: Vec<Vec<Node>>,
}

/// Where nodes that lie on no edge get their mesh vertices: the rows of a pole or an apex, and a seam over a sphere.
pub(super) struct Grid<'a> {
    /// Steps for a whole turn.
    pub steps: usize,
    pub fresh: &'a mut dyn FnMut([f64; 2]) -> u32,
}

impl Outline {
    /// Makes one polygon of the rings of a face; `None` when they cannot bound one.
    pub fn new(surface: &Surface, rings: &[Ring], grid: &mut Grid) -> Option<Self> {
        let outer = match rings.iter().find(|r| r.is_outer()) {
            Some(ring) => ring.nodes.clone(),
            None => band(surface, rings, grid)?,
        };
        let period = surface.period().unwrap_or(0.0);
        let holes = rings.iter().filter(|r| r.winding == 0 && !r.is_outer());
        let placed = holes.map(|hole| {
            let fits = |turn: &f64| encloses(&outer, hole.nodes[0].uv, turn * period);
            let turn = [0.0, 1.0, -1.0, 2.0, -2.0].into_iter().find(fits)?;
            Some(hole.shifted(turn * period))
        });
        let holes = placed.collect::<Option<Vec<_>>>()?;
        Some(Outline { outer, holes })
    }

    /// True for chart coordinates inside the outer polygon and in no hole.
    pub fn holds(&self, uv: [f64; 2]) -> bool {
        encloses(&self.outer, uv, 0.0) && !self.holes.iter().any(|h| encloses(h, uv, 0.0))
    }
}

/// Even-odd test of `p` moved by `shift` along u.
fn encloses(polygon: &[Node], p: [f64; 2], shift: f64) -> bool {
    let p = [p[0] + shift, p[1]];
    let mut inside = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()].uv;
        let a = a.uv;
        if (a[0] > p[0]) != (b[0] > p[0]) {
            let v = a[1] + (b[1] - a[1]) * (p[0] - a[0]) / (b[0] - a[0]);
            inside ^= v < p[1];
        }
    }
    inside
}

/// The polygon of a face that goes all the way round: along its lower ring, up a seam, back along its upper ring, down
/// the seam.
fn band(surface: &Surface, rings: &[Ring], grid: &mut Grid) -> Option<Vec<Node>> {
    let period = surface.period()?;
    let top = match surface {
        Surface::Sphere { radius, .. } => Some(2.0 * radius),
        _ => None,
    };
    let low = rings.iter().find(|r| r.winding == 1);
    let high = rings.iter().find(|r| r.winding == -1);
    let (low, high) = match (low, high) {
        (Some(low), Some(high)) => (low.clone(), high.clone()),
        (Some(low), None) => (low.clone(), pole(low.nodes[0].uv[0], top?, period, -1, grid)),
        (None, Some(high)) => (pole(high.nodes[0].uv[0] - period, 0.0, period, 1, grid), high.clone()),
        (None, None) => (pole(0.0, 0.0, period, 1, grid), pole(period, top?, period, -1, grid)),
    };
    let (b, t) = seam(rings, &low, &high);
    let (low, high) = (opened(&low, b), opened(&high, t));
    let shift = nearest(high[0].uv[0], low[low.len() - 1].uv[0], period) - high[0].uv[0];
    let high: Vec<Node> = high.iter().map(|n| Node { uv: [n.uv[0] + shift, n.uv[1]], id: n.id }).collect();
    let up = seam_nodes(surface, low[low.len() - 1], high[0], grid);
    let down = up.iter().rev().map(|n| Node { uv: [n.uv[0] - period, n.uv[1]], id: n.id });
    Some(low.iter().chain(&up).chain(&high).copied().chain(down).collect())
}

/// A pole or an apex drawn as a ring of nodes at height `v`, all one vertex.
fn pole(start: f64, v: f64, period: f64, winding: i32, grid: &mut Grid) -> Ring {
    let step = period / grid.steps as f64 * f64::from(winding);
    let id = (grid.fresh)([start, v]);
    let nodes = (0..grid.steps).map(|k| Node { uv: [start + step * k as f64, v], id }).collect();
    Ring { nodes, winding, period }
}

/// Nodes of the lower and upper ring that a straight seam can join: the steepest that crosses no ring.
fn seam(rings: &[Ring], low: &Ring, high: &Ring) -> (usize, usize) {
    let period = low.period;
    let upper = |b: usize| {
        let u = low.nodes[b].uv[0];
        let off = |t: &usize| (nearest(high.nodes[*t].uv[0], u, period) - u).abs();
        (0..high.nodes.len()).map(|t| (off(&t), b, t)).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let mut pairs: Vec<(f64, usize, usize)> = (0..low.nodes.len()).filter_map(upper).collect();
    // A whole tolerance counts as no slant at all, so that rounding does not choose.
    pairs.sort_by_key(|p| ((p.0 / tolerance::WELD) as i64, p.1));
    let clear = |&&(_, b, t): &&(f64, usize, usize)| {
        let a = low.nodes[b].uv;
        let c = [nearest(high.nodes[t].uv[0], a[0], period), high.nodes[t].uv[1]];
        rings.iter().all(|r| r.segments().all(|s| !crosses(a, c, s, period)))
    };
    pairs.iter().find(clear).or(pairs.first()).map_or((0, 0), |p| (p.1, p.2))
}

/// Whether segment `s`, moved by whole periods, meets the segment from `a` to `c` other than at its ends.
fn crosses(a: [f64; 2], c: [f64; 2], s: ([f64; 2], [f64; 2]), period: f64) -> bool {
    let shift = nearest(s.0[0], a[0], period) - s.0[0];
    let (p, q) = ([s.0[0] + shift, s.0[1]], [s.1[0] + shift, s.1[1]]);
    let same = |x: [f64; 2], y: [f64; 2]| (x[0] - y[0]).hypot(x[1] - y[1]) < tolerance::WELD;
    if [a, c].iter().any(|e| same(*e, p) || same(*e, q)) {
        return false;
    }
    let side = |o: [f64; 2], d: [f64; 2], x: [f64; 2]| {
        let length = (d[0] - o[0]).hypot(d[1] - o[1]).max(tolerance::WELD);
        let off = ((d[0] - o[0]) * (x[1] - o[1]) - (d[1] - o[1]) * (x[0] - o[0])) / length;
        if off.abs() < tolerance::WELD { 0.0 } else { off.signum() }
    };
    side(a, c, p) * side(a, c, q) <= 0.0 && side(p, q, a) * side(p, q, c) <= 0.0
}

/// The ring from node `start` once round to `start` again.
fn opened(ring: &Ring, start: usize) -> Vec<Node> {
    let turn = f64::from(ring.winding) * ring.period;
    let count = ring.nodes.len();
    let node = |k: usize| {
        let n = ring.nodes[k % count];
        Node { uv: [n.uv[0] + if k >= count { turn } else { 0.0 }, n.uv[1]], id: n.id }
    };
    (start..=start + count).map(node).collect()
}

/// Nodes between the ends of a seam: none on a straight ruling, one per step of latitude on a sphere.
fn seam_nodes(surface: &Surface, from: Node, to: Node, grid: &mut Grid) -> Vec<Node> {
    let Surface::Sphere { radius, .. } = surface else { return Vec::new() };
    let latitude = |v: f64| (v / radius - 1.0).clamp(-1.0, 1.0).asin();
    let (low, high) = (latitude(from.uv[1]), latitude(to.uv[1]));
    let steps = ((high - low).abs() / (std::f64::consts::TAU / grid.steps as f64)).ceil().max(1.0) as usize;
    let mut nodes = Vec::new();
    for k in 1..steps {
        let share = k as f64 / steps as f64;
        let v = radius * (1.0 + (low + (high - low) * share).sin());
        let uv = [from.uv[0] + (to.uv[0] - from.uv[0]) * share, v];
        nodes.push(Node { uv, id: (grid.fresh)(uv) });
    }
    nodes
}
