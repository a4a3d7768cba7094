//! Where a leader may touch its part with the least in its way.
//!
//! In: what is seen of every part, in px. Out: per part, for a leader to the left and for one to the right, the best point:
//! the level line from there outwards crosses the fewest lines of other parts, and is short.

use super::super::svg::Point;

/// Height of the strips in which crossings are counted (px).
const STRIP: f64 = 3.0;
/// Points of a line that are tried lie this far apart (px).
const STEP: f64 = 9.0;
/// Lengths of leaders that differ by less than this are equal (px).
const EQUAL: f64 = 6.0;

/// A straight piece of what is seen of a part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub part: usize,
    pub ends: [Point; 2],
}

/// A point on a part, and how many lines of other parts the level line from there crosses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Anchor {
    pub at: Point,
    pub crossed: usize,
}

/// Best points for leaders to the left and to the right, per part; `None` for a part of which nothing is seen.
pub(super) fn anchors(pieces: &[Piece], parts: usize) -> Vec<Option<[Anchor; 2]>> {
    let strips = Strips::new(pieces);
    let mut own: Vec<Vec<Point>> = vec![Vec::new(); parts];
    pieces.iter().for_each(|piece| own[piece.part].extend(along(&piece.ends)));
    let best = |(part, points): (usize, &Vec<Point>)| {
        let middle = points.iter().map(|p| p[1]).sum::<f64>() / points.len() as f64;
        let side = |right: bool| {
            let edge = |p: &Point| if right { -p[0] } else { p[0] };
            let worth = |p: &Point| {
                let crossed = strips.crossed(part, p, right);
                (crossed, (edge(p) / EQUAL).round(), (p[1] - middle).abs())
            };
            let ranked = points.iter().map(|p| (worth(p), p));
            let least =
                ranked.min_by(|(a, _), (b, _)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.total_cmp(&b.2)));
            least.map(|((crossed, ..), at)| Anchor { at: *at, crossed })
        };
        Some([side(false)?, side(true)?])
    };
    own.iter().enumerate().map(best).collect()
}

/// Points along a piece, both ends included.
fn along([a, b]: &[Point; 2]) -> impl Iterator<Item = Point> + use<> {
    let ([ax, ay], [bx, by]) = (*a, *b);
    let count = ((bx - ax).hypot(by - ay) / STEP).ceil().max(1.0) as usize;
    (0..=count).map(move |i| i as f64 / count as f64).map(move |s| [ax + (bx - ax) * s, ay + (by - ay) * s])
}

/// Level strips over the drawing, each with the lines that pass its middle.
struct Strips {
    low: f64,
    /// Sorted by x: where a line passes, and whose it is.
    lines: Vec<Vec<(f64, usize)>>,
}

impl Strips {
    fn new(pieces: &[Piece]) -> Strips {
        let heights = || pieces.iter().flat_map(|p| p.ends).map(|e| e[1]);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(low, f64::max);
        let count = if low.is_finite() { ((high - low) / STRIP) as usize + 1 } else { 0 };
        let mut strips = Strips { low, lines: vec![Vec::new(); count] };
        pieces.iter().for_each(|p| strips.add(p));
        strips.lines.iter_mut().for_each(|l| l.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))));
        strips
    }

    fn add(&mut self, piece: &Piece) {
        let [a, b] = piece.ends;
        let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        for strip in self.strip(a[1])..=self.strip(b[1]) {
            let y = self.low + (strip as f64 + 0.5) * STRIP;
            if a[1] <= y && y < b[1] {
                self.lines[strip].push((a[0] + (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]), piece.part));
            }
        }
    }

    fn strip(&self, y: f64) -> usize {
        (((y - self.low) / STRIP).max(0.0) as usize).min(self.lines.len().saturating_sub(1))
    }

    /// Lines of other parts beside a point: the most in its own strip and the two next to it, since a leader that grazes an
    /// outline is as hard to read as one that crosses it.
    fn crossed(&self, part: usize, at: &Point, right: bool) -> usize {
        let own = self.strip(at[1]);
        let near = own.saturating_sub(1)..=(own + 1).min(self.lines.len() - 1);
        near.map(|strip| self.crossed_in(strip, part, at[0], right)).max().unwrap_or(0)
    }

    fn crossed_in(&self, strip: usize, part: usize, x: f64, right: bool) -> usize {
        let lines = &self.lines[strip];
        let cut = lines.partition_point(|l| l.0 < x);
        let beside = if right { &lines[cut..] } else { &lines[..cut] };
        beside.iter().filter(|l| l.1 != part).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A low wall of part 1 stands to the right of a high mast of part 0.
    #[test]
    fn a_leader_leaves_where_nothing_is_in_its_way() {
        let mast = Piece { part: 0, ends: [[0.0, 0.0], [0.0, 90.0]] };
        let wall = Piece { part: 1, ends: [[20.0, 30.0], [20.0, 90.0]] };
        let [left, right] = anchors(&[mast, wall], 3)[0].unwrap();
        assert_eq!((left.crossed, right.crossed), (0, 0));
        assert!(right.at[1] < 31.0 && left.at[1] == 45.0, "{right:?} {left:?}");
        assert_eq!(anchors(&[mast, wall], 3)[2], None);
    }
}
