//! The polygon of a face in its chart.
//!
//! In: the [`Ring`]s of a face. Out: an [`Outline`]: one closed polygon round the face, and its holes. A face that goes all the
//! way round is cut along a seam, which leads from hole to hole where none is straight. Makes mesh vertices only for nodes
//! that lie on no edge: poles, apexes, seams.

use super::ring::{Chart, Node, Ring, nearest};
use super::{Surface, tolerance};
use nalgebra::Point3;

/// A face as a polygon, counter-clockwise in the chart, with holes.
#[derive(Debug, Clone)]
pub(super) struct Outline {
    pub outer: Vec<Node>,
    pub holes: Vec<Vec<Node>>,
}

/// Where nodes that lie on no edge get their mesh vertices: the rows of a pole or an apex, and a seam over a curved face.
pub(super) struct Grid<'a> {
    /// Steps for a whole turn along u, and along v on spheres and tori.
    pub steps: [usize; 2],
    pub fresh: &'a mut dyn FnMut([f64; 2]) -> u32,
}

impl Outline {
    /// Makes one polygon of the rings of a face; `None` when they cannot bound one.
    pub fn new(chart: &Chart, rings: &[Ring], grid: &mut Grid) -> Option<Self> {
        let periods = chart.periods();
        let (outer, used) = match rings.iter().find(|r| r.is_outer()) {
            Some(ring) => (ring.nodes.clone(), Vec::new()),
            None if periods[1].is_some() && rings.iter().all(|r| r.winding == 0) => {
                (whole(chart, rings, grid)?, Vec::new())
            }
            None => band(chart, rings, grid)?,
        };
        let holes = rings.iter().enumerate().filter(|(i, r)| r.winding == 0 && !r.is_outer() && !used.contains(i));
        let placed = holes.map(|(_, hole)| {
            let turns: &[f64] = &[0.0, 1.0, -1.0, 2.0, -2.0];
            let shifts = turns.iter().flat_map(|v| turns.iter().map(move |u| [*u, *v]));
            let mut shifts = shifts.map(|s| [s[0] * periods[0].unwrap_or(0.0), s[1] * periods[1].unwrap_or(0.0)]);
            let at = hole.nodes[0].uv;
            let shift = shifts.find(|s| encloses(&outer, [at[0] + s[0], at[1] + s[1]]))?;
            Some(hole.shifted(shift))
        });
        let holes = placed.collect::<Option<Vec<_>>>()?;
        Some(Outline { outer, holes })
    }

    /// Chart coordinates of a point, moved by whole periods into the outline; `None` when it lies in no period of it.
    pub fn inside(&self, chart: &Chart, p: &Point3<f64>) -> Option<[f64; 2]> {
        let [u, v] = chart.uv(p);
        let [width, height] = chart.periods().map(|p| p.unwrap_or(0.0));
        let turns = [0.0, 1.0, -1.0, 2.0, -2.0];
        let mut places = turns.iter().flat_map(|k| turns.iter().map(move |l| [u + k * width, v + l * height]));
        places.find(|[u, v]| self.crossings(*v).partition_point(|c| c < u) % 2 == 1)
    }

    /// The u, ascending, at which the outline crosses the height v: what lies after an odd number of them is inside.
    pub fn crossings(&self, v: f64) -> Vec<f64> {
        let mut found = Vec::new();
        for ring in std::iter::once(&self.outer).chain(&self.holes) {
            for (i, a) in ring.iter().enumerate() {
                let (a, b) = (a.uv, ring[(i + 1) % ring.len()].uv);
                if (a[1] > v) != (b[1] > v) {
                    found.push(a[0] + (b[0] - a[0]) * (v - a[1]) / (b[1] - a[1]));
                }
            }
        }
        found.sort_by(f64::total_cmp);
        found
    }
}

/// Even-odd test.
fn encloses(polygon: &[Node], p: [f64; 2]) -> bool {
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
/// the seam; and the holes that the seam passes.
fn band(chart: &Chart, rings: &[Ring], grid: &mut Grid) -> Option<(Vec<Node>, Vec<usize>)> {
    let period = chart.periods()[0]?;
    let [bottom, top] = chart.surface.poles();
    let low = rings.iter().find(|r| r.winding == 1);
    let high = rings.iter().find(|r| r.winding == -1);
    let (low, high) = match (low, high) {
        (Some(low), Some(high)) => (low.clone(), high.above(low)),
        (Some(low), None) => (low.clone(), pole(low.nodes[0].uv[0], top?, period, -1, grid)),
        (None, Some(high)) => (pole(high.nodes[0].uv[0] - period, bottom?, period, 1, grid), high.clone()),
        (None, None) => (pole(0.0, bottom?, period, 1, grid), pole(period, top?, period, -1, grid)),
    };
    let (b, t, way) = match seam(rings, &low, &high) {
        Some((b, t)) => (b, t, Vec::new()),
        None => detour(rings, &low, &high)?,
    };
    let (low, high) = (opened(&low, b), opened(&high, t));
    // Up the seam, round one side of each hole on its way.
    let mut up: Vec<Node> = Vec::new();
    let mut down: Vec<Node> = Vec::new();
    let mut last = low[low.len() - 1];
    for stop in &way {
        let ring = opened(&rings[stop.ring], stop.entry);
        let (du, dv) = (last.uv[0] - ring[0].uv[0], last.uv[1] - ring[0].uv[1]);
        let shift = [nearest(0.0, du, period), nearest(0.0, dv, chart.periods()[1].unwrap_or(0.0))];
        let ring: Vec<Node> =
            ring.iter().map(|n| Node { uv: [n.uv[0] + shift[0], n.uv[1] + shift[1]], id: n.id }).collect();
        let bridge = seam_nodes(chart, last, ring[0], grid);
        let turn = (stop.exit + ring.len() - 1 - stop.entry) % (ring.len() - 1);
        // Down the seam again, round its other side.
        let other: Vec<Node> = ring[turn..].iter().chain(bridge.iter().rev()).copied().collect();
        down.splice(0..0, other);
        up.extend(bridge.iter().chain(&ring[..=turn]));
        last = ring[turn];
    }
    let shift = nearest(high[0].uv[0], last.uv[0], period) - high[0].uv[0];
    let high: Vec<Node> = high.iter().map(|n| Node { uv: [n.uv[0] + shift, n.uv[1]], id: n.id }).collect();
    let bridge = seam_nodes(chart, last, high[0], grid);
    down.splice(0..0, bridge.iter().rev().copied());
    up.extend(bridge);
    let down = down.iter().map(|n| Node { uv: [n.uv[0] - period, n.uv[1]], id: n.id });
    let outer = low.iter().chain(&up).chain(&high).copied().chain(down).collect();
    Some((outer, way.iter().map(|s| s.ring).collect()))
}

/// A hole that the seam leads to, and on from.
struct Stop {
    ring: usize,
    /// Nodes of the ring where the seam comes and where it goes on.
    entry: usize,
    exit: usize,
}

/// Pairs of nodes that are tried between two rings, the nearest first.
const BRIDGES: usize = 64;

/// A seam from hole to hole, where holes leave no straight way from the lower ring to the upper: by breadth first search over
/// the bridges that cross no ring.
fn detour(rings: &[Ring], low: &Ring, high: &Ring) -> Option<(usize, usize, Vec<Stop>)> {
    let holes: Vec<usize> = (0..rings.len()).filter(|i| rings[*i].winding == 0 && !rings[*i].is_outer()).collect();
    let end = holes.len() + 1;
    let place = |k: usize| {
        if k == 0 {
            low
        } else if k == end {
            high
        } else {
            &rings[holes[k - 1]]
        }
    };
    let mut from: Vec<Option<(usize, usize, usize)>> = vec![None; end + 1];
    let mut open = std::collections::VecDeque::from([0]);
    while let Some(here) = open.pop_front() {
        for next in (1..=end).rev() {
            if next == here || from[next].is_some() {
                continue;
            }
            if let Some((a, b)) = bridge(rings, place(here), place(next)) {
                from[next] = Some((here, a, b));
                open.push_back(next);
            }
        }
        if from[end].is_some() {
            break;
        }
    }
    let (mut here, mut exit, last) = from[end]?;
    let mut way = Vec::new();
    while here != 0 {
        let (before, leaves, entry) = from[here]?;
        way.push(Stop { ring: holes[here - 1], entry, exit });
        (here, exit) = (before, leaves);
    }
    way.reverse();
    Some((exit, last, way))
}

/// The nearest nodes of two rings that a straight line joins without crossing a ring.
fn bridge(rings: &[Ring], a: &Ring, b: &Ring) -> Option<(usize, usize)> {
    let apart = |i: usize, j: usize| {
        let (p, q) = (a.nodes[i].uv, b.nodes[j].uv);
        (nearest(q[0], p[0], a.period) - p[0]).hypot(nearest(q[1], p[1], a.height) - p[1])
    };
    let mut pairs: Vec<(f64, usize, usize)> = (0..a.nodes.len())
        .flat_map(|i| (0..b.nodes.len()).map(move |j| (i, j)))
        .map(|(i, j)| (apart(i, j), i, j))
        .collect();
    pairs.sort_by(|p, q| p.0.total_cmp(&q.0).then((p.1, p.2).cmp(&(q.1, q.2))));
    let clear = |&&(_, i, j): &&(f64, usize, usize)| {
        let p = a.nodes[i].uv;
        let q = [nearest(b.nodes[j].uv[0], p[0], a.period), nearest(b.nodes[j].uv[1], p[1], a.height)];
        rings.iter().chain([a, b]).all(|r| r.segments().all(|s| !crosses(p, q, s, [a.period, a.height])))
    };
    pairs.iter().take(BRIDGES).find(clear).map(|p| (p.1, p.2))
}

/// The polygon of a face that is all of a torus but for holes: a rectangle between seams that keep off the holes.
fn whole(chart: &Chart, rings: &[Ring], grid: &mut Grid) -> Option<Vec<Node>> {
    let (width, height) = (chart.periods()[0]?, chart.periods()[1]?);
    let [left, bottom] = [widest_gap(rings, 0, width)?, widest_gap(rings, 1, height)?];
    let corner = Node { uv: [left, bottom], id: (grid.fresh)([left, bottom]) };
    let moved = |n: &Node, by: [f64; 2]| Node { uv: [n.uv[0] + by[0], n.uv[1] + by[1]], id: n.id };
    let along = |k: usize, from: f64, size: f64| {
        let places = chart.places(k, [from + size * CLOSE, from + size * (1.0 - CLOSE)], grid.steps[k]);
        places.into_iter().map(|x| if k == 0 { [x, bottom] } else { [left, x] }).collect::<Vec<_>>()
    };
    let (row, column) = (along(0, left, width), along(1, bottom, height));
    let mut fresh =
        |uvs: Vec<[f64; 2]>| -> Vec<Node> { uvs.into_iter().map(|uv| Node { uv, id: (grid.fresh)(uv) }).collect() };
    let (row, column) = (fresh(row), fresh(column));
    let mut polygon = vec![corner];
    polygon.extend_from_slice(&row);
    polygon.push(moved(&corner, [width, 0.0]));
    polygon.extend(column.iter().map(|n| moved(n, [width, 0.0])));
    polygon.push(moved(&corner, [width, height]));
    polygon.extend(row.iter().rev().map(|n| moved(n, [0.0, height])));
    polygon.push(moved(&corner, [0.0, height]));
    polygon.extend(column.iter().rev());
    Some(polygon)
}

/// Nodes of a seam keep this share of its length from its ends.
const CLOSE: f64 = 0.004;

/// The middle of the widest stretch along u (0) or v (1) that no ring lies over.
fn widest_gap(rings: &[Ring], along: usize, period: f64) -> Option<f64> {
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for ring in rings {
        let all = ring.nodes.iter().map(|n| n.uv[along]);
        let [low, high] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |r, x| [r[0].min(x), r[1].max(x)]);
        let low_in = low.rem_euclid(period);
        taken.push([low_in, low_in + high - low]);
    }
    taken.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let Some(first) = taken.first().copied() else { return Some(0.0) };
    let mut reach = first[1];
    let mut best: Option<[f64; 2]> = None;
    for next in taken[1..].iter().chain(&[[first[0] + period, 0.0]]) {
        let gap = next[0] - reach;
        if gap > 0.0 && best.is_none_or(|b| gap > b[1] - b[0]) {
            best = Some([reach, next[0]]);
        }
        reach = reach.max(next[1]);
    }
    best.map(|[a, b]| (a + b) / 2.0)
}

/// A pole or an apex drawn as a ring of nodes at height `v`, all one vertex.
fn pole(start: f64, v: f64, period: f64, winding: i32, grid: &mut Grid) -> Ring {
    let step = period / grid.steps[0] as f64 * f64::from(winding);
    let id = (grid.fresh)([start, v]);
    let nodes = (0..grid.steps[0]).map(|k| Node { uv: [start + step * k as f64, v], id }).collect();
    Ring { nodes, winding, period, height: 0.0 }
}

/// Nodes of the lower and upper ring that a straight seam can join: the steepest that crosses no ring.
fn seam(rings: &[Ring], low: &Ring, high: &Ring) -> Option<(usize, usize)> {
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
        rings.iter().all(|r| r.segments().all(|s| !crosses(a, c, s, [period, r.height])))
    };
    pairs.iter().find(clear).map(|p| (p.1, p.2))
}

/// Whether segment `s`, moved by whole periods, meets the segment from `a` to `c` other than at its ends.
fn crosses(a: [f64; 2], c: [f64; 2], s: ([f64; 2], [f64; 2]), [period, height]: [f64; 2]) -> bool {
    let shift = nearest(s.0[0], a[0], period) - s.0[0];
    let rise = nearest(s.0[1], a[1], height) - s.0[1];
    let places: &[f64] = if height > 0.0 { &[-1.0, 0.0, 1.0] } else { &[0.0] };
    places.iter().any(|k| {
        let moved = |p: [f64; 2]| [p[0] + shift, p[1] + rise + k * height];
        meets(a, c, moved(s.0), moved(s.1))
    })
}

/// Whether two segments meet other than at the ends of the first.
fn meets(a: [f64; 2], c: [f64; 2], p: [f64; 2], q: [f64; 2]) -> bool {
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

/// Nodes between the ends of a seam: none on a straight ruling, one per step on a sphere or a torus.
fn seam_nodes(chart: &Chart, from: Node, to: Node, grid: &mut Grid) -> Vec<Node> {
    if !matches!(chart.surface, Surface::Sphere { .. } | Surface::Torus { .. }) {
        return Vec::new();
    }
    let rise = to.uv[1] - from.uv[1];
    let (low, high) = (from.uv[1].min(to.uv[1]), from.uv[1].max(to.uv[1]));
    let range = [low + rise.abs() * CLOSE, high - rise.abs() * CLOSE];
    let mut places = chart.places(1, range, grid.steps[1]);
    if rise < 0.0 {
        places.reverse();
    }
    let mut nodes = Vec::new();
    for v in places {
        let share = (v - from.uv[1]) / rise;
        let uv = [from.uv[0] + (to.uv[0] - from.uv[0]) * share, v];
        nodes.push(Node { uv, id: (grid.fresh)(uv) });
    }
    nodes
}
