//! Boxes along the axes, and a tree of them: what is near what, without asking everything.
//!
//! In: boxes (mm, in whatever frame). Out: the indices of those that meet a given box, ascending. Building takes
//! O(n log n) and O(n) memory. Never knows what the boxes stand for.

use nalgebra::{Point3, Vector3};

/// A box along the axes; empty where `low` exceeds `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub low: Vector3<f64>,
    pub high: Vector3<f64>,
}

impl Bounds {
    pub const EMPTY: Bounds = Bounds {
        low: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        high: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Bounds { low: b.low.inf(&p.coords), high: b.high.sup(&p.coords) })
    }

    pub fn around(&self, other: &Bounds) -> Self {
        Bounds { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    pub fn common(&self, other: &Bounds) -> Self {
        Bounds { low: self.low.sup(&other.low), high: self.high.inf(&other.high) }
    }

    pub fn widened(&self, by: f64) -> Self {
        Bounds { low: self.low.add_scalar(-by), high: self.high.add_scalar(by) }
    }

    /// Whether two boxes share a point; never true of a box with a coordinate that is no number.
    pub fn meets(&self, other: &Bounds) -> bool {
        (0..3).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }

    pub fn centre(&self) -> Vector3<f64> {
        (self.low + self.high) / 2.0
    }

    /// The least distance of two boxes (mm); 0 where they meet.
    pub fn distance(&self, other: &Bounds) -> f64 {
        let apart = (other.low - self.high).sup(&(self.low - other.high)).sup(&Vector3::zeros());
        apart.norm()
    }
}

/// A binary tree of boxes, split at the median of the widest side.
#[derive(Debug, Default)]
pub(crate) struct BoxTree {
    nodes: Vec<Node>,
    /// Indices of the boxes, grouped by leaf.
    order: Vec<u32>,
    boxes: Vec<Bounds>,
}

#[derive(Debug)]
struct Node {
    bounds: Bounds,
    /// Of a leaf: its stretch of `order`. Of an inner node: empty.
    members: [u32; 2],
    /// The second child; the first follows its parent.
    second: u32,
}

/// Boxes in a leaf.
const LEAF: usize = 8;

impl BoxTree {
    pub fn new(boxes: Vec<Bounds>) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::new();
        if !boxes.is_empty() {
            build(&boxes, &mut order, 0, &mut nodes);
        }
        BoxTree { nodes, order, boxes }
    }

    /// Indices of the boxes that meet this one, ascending.
    pub fn meeting(&self, query: &Bounds) -> Vec<usize> {
        let mut found = Vec::new();
        let mut open = if self.nodes.is_empty() { Vec::new() } else { vec![0usize] };
        while let Some(at) = open.pop() {
            let node = &self.nodes[at];
            if !node.bounds.meets(query) {
                continue;
            }
            if node.second > 0 {
                open.extend([at + 1, node.second as usize]);
                continue;
            }
            let [from, to] = node.members.map(|i| i as usize);
            found.extend(self.order[from..to].iter().map(|i| *i as usize).filter(|i| self.boxes[*i].meets(query)));
        }
        found.sort_unstable();
        found
    }

    /// Boxes by rising distance from a query: for each, `visit` is told its index and its distance, and answers how far
    /// to look from now on (mm).
    pub fn nearest(&self, query: &Bounds, mut reach: f64, visit: &mut dyn FnMut(usize, f64) -> f64) {
        let mut open: Vec<(f64, usize)> = Vec::new();
        open.extend(self.nodes.first().map(|n| (n.bounds.distance(query), 0)));
        while let Some(k) = (0..open.len()).min_by(|i, j| open[*i].0.total_cmp(&open[*j].0)) {
            let (distance, at) = open.swap_remove(k);
            if distance > reach {
                return;
            }
            let node = &self.nodes[at];
            if node.second > 0 {
                open.extend([at + 1, node.second as usize].map(|n| (self.nodes[n].bounds.distance(query), n)));
                continue;
            }
            let [from, to] = node.members.map(|i| i as usize);
            for i in self.order[from..to].iter().map(|i| *i as usize) {
                let distance = self.boxes[i].distance(query);
                if distance <= reach {
                    reach = visit(i, distance).min(reach);
                }
            }
        }
    }
}

fn build(boxes: &[Bounds], order: &mut [u32], first: usize, nodes: &mut Vec<Node>) {
    let bounds = order.iter().fold(Bounds::EMPTY, |b, i| b.around(&boxes[*i as usize]));
    let at = nodes.len();
    nodes.push(Node { bounds, members: [first as u32, (first + order.len()) as u32], second: 0 });
    if order.len() <= LEAF {
        return;
    }
    let axis = (bounds.high - bounds.low).imax();
    let key = |i: &u32| boxes[*i as usize].centre()[axis];
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |i, j| key(i).total_cmp(&key(j)).then(i.cmp(j)));
    let (left, right) = order.split_at_mut(middle);
    build(boxes, left, first, nodes);
    nodes[at].second = nodes.len() as u32;
    build(boxes, right, first + middle, nodes);
}

/// The distance of a point from a triangle (mm).
pub(crate) fn distance_to_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, t)| normal.dot(&(*t - *s).cross(&(p - *s))) >= 0.0);
    if inside && normal.norm() > 0.0 {
        return (normal.dot(&(p - a)) / normal.norm()).abs();
    }
    [(a, b), (b, c), (c, a)].iter().map(|(s, t)| distance_to_segment(p, s, t)).fold(f64::INFINITY, f64::min)
}

fn distance_to_segment(p: &Point3<f64>, s: &Point3<f64>, t: &Point3<f64>) -> f64 {
    let along: Vector3<f64> = t - s;
    let share = if along.norm_squared() > 0.0 { (p - s).dot(&along) / along.norm_squared() } else { 0.0 };
    (p - (s + along * share.clamp(0.0, 1.0))).norm()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    fn some_boxes(count: usize) -> Vec<Bounds> {
        let mut stream = Stream::new(1, "boxes", 0);
        let mut point = |scale: f64| Vector3::from_fn(|_, _| stream.between(0.0, scale));
        (0..count)
            .map(|_| point(50.0))
            .collect::<Vec<_>>()
            .into_iter()
            .map(|low| Bounds { low, high: low + point(6.0) })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_asking_everything_finds() {
        let boxes = some_boxes(300);
        let tree = BoxTree::new(boxes.clone());
        for query in &boxes {
            let all: Vec<usize> = (0..boxes.len()).filter(|i| boxes[*i].meets(query)).collect();
            assert_eq!(tree.meeting(query), all);
        }
        assert!(BoxTree::new(Vec::new()).meeting(&boxes[0]).is_empty());
    }

    #[test]
    fn the_nearest_box_is_found() {
        let boxes = some_boxes(200);
        let tree = BoxTree::new(boxes.clone());
        let query = Bounds { low: Vector3::repeat(-40.0), high: Vector3::repeat(-30.0) };
        let mut found = f64::INFINITY;
        tree.nearest(&query, f64::INFINITY, &mut |_, distance| {
            found = found.min(distance);
            found
        });
        let least = boxes.iter().map(|b| b.distance(&query)).fold(f64::INFINITY, f64::min);
        assert_eq!(found, least);
    }

    #[test]
    fn boxes_that_are_no_numbers_meet_nothing() {
        let broken = Bounds { low: Vector3::repeat(f64::NAN), high: Vector3::repeat(f64::NAN) };
        let mut boxes = some_boxes(20);
        boxes.push(broken);
        let tree = BoxTree::new(boxes.clone());
        assert!(tree.meeting(&broken).is_empty());
        assert!(!tree.meeting(&boxes[3]).contains(&20));
    }
}
