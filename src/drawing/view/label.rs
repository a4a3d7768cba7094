//! Names beside a drawing, each with a leader to its part.
//!
//! In: for every name the best points of its part for a leader to the left and to the right. Out: on which side and how high each name
//! stands, so that names do not overlap and leaders of one side do not cross.

use super::super::spread::spread;
use super::super::svg::Point;
use super::anchor::Anchor;
use std::cmp::Ordering;

/// Between the base lines of two names (px).
const LINE: f64 = 17.0;
/// Parts whose middle is nearer to the drawing's middle than this share of its width may be named on either side.
const CENTRAL: f64 = 0.04;
/// Passes of exchanges against crossing leaders; each pass removes crossings or is the last.
const PASSES: usize = 50;

/// What is seen of a part.
pub(super) struct Seen<'a> {
    pub name: &'a str,
    pub left: Anchor,
    pub right: Anchor,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

/// A name that has its place.
#[derive(Debug, Clone)]
pub(super) struct Label<'a> {
    pub name: &'a str,
    pub side: Side,
    /// Where the leader touches the part.
    pub anchor: Point,
    /// The middle of the text.
    pub y: f64,
}

/// Places for all names; `borders` are the left and right end of the drawing, `away` how far beyond them names stand (px).
pub(super) fn labels<'a>(seen: &[Seen<'a>], borders: [f64; 2], away: f64) -> Vec<Label<'a>> {
    let mut labels = sides(seen, borders);
    for side in [Side::Left, Side::Right] {
        let mut own: Vec<&mut Label> = labels.iter_mut().filter(|l| l.side == side).collect();
        own.sort_by(|a, b| a.anchor[1].total_cmp(&b.anchor[1]));
        let wanted: Vec<f64> = own.iter().map(|l| l.anchor[1]).collect();
        let gaps = vec![LINE; own.len().saturating_sub(1)];
        let heights = spread(&wanted, &vec![1.0; own.len()], &gaps);
        own.iter_mut().zip(heights).for_each(|(label, y)| label.y = y);
        let x = if side == Side::Left { borders[0] - away } else { borders[1] + away };
        untangle(&mut own, x);
    }
    labels
}

/// A part is named on the side where less is in the way, else on its own side, else where fewer names stand.
fn sides<'a>(seen: &[Seen<'a>], borders: [f64; 2]) -> Vec<Label<'a>> {
    let (middle, width) = ((borders[0] + borders[1]) / 2.0, borders[1] - borders[0]);
    let fixed = |s: &Seen| {
        let off = ((s.left.at[0] + s.right.at[0]) / 2.0 - middle) / width.max(1.0);
        match s.left.crossed.cmp(&s.right.crossed) {
            Ordering::Less => Some(Side::Left),
            Ordering::Greater => Some(Side::Right),
            Ordering::Equal if off < -CENTRAL => Some(Side::Left),
            Ordering::Equal if off > CENTRAL => Some(Side::Right),
            Ordering::Equal => None,
        }
    };
    let count = |side| seen.iter().filter(|s| fixed(s) == Some(side)).count();
    let mut counts = [count(Side::Left), count(Side::Right)];
    let mut freely = || {
        let fewer = usize::from(counts[1] <= counts[0]);
        counts[fewer] += 1;
        [Side::Left, Side::Right][fewer]
    };
    let label = |s: &Seen<'a>| {
        let side = fixed(s).unwrap_or_else(&mut freely);
        Label { name: s.name, side, anchor: if side == Side::Left { s.left.at } else { s.right.at }, y: 0.0 }
    };
    seen.iter().map(label).collect()
}

/// Exchanges the places of neighbours whose leaders cross. `x` is where the leaders begin.
fn untangle(labels: &mut [&mut Label], x: f64) {
    for _ in 0..PASSES {
        let mut crossed = false;
        for i in 1..labels.len() {
            let [a, b] = [&labels[i - 1], &labels[i]].map(|l| [[x, l.y], l.anchor]);
            if cross(a, b) {
                let (above, below) = (labels[i - 1].y, labels[i].y);
                (labels[i - 1].y, labels[i].y) = (below, above);
                labels.swap(i - 1, i);
                crossed = true;
            }
        }
        if !crossed {
            return;
        }
    }
}

/// Whether two straight pieces share an inner point.
fn cross([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let turn = |p: Point, q: Point, r: Point| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    turn(a, b, c) * turn(a, b, d) < 0.0 && turn(c, d, a) * turn(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(name: &str, x: f64, y: f64) -> Seen<'_> {
        let at = |x: f64| Anchor { at: [x, y], crossed: 0 };
        Seen { name, left: at(x - 1.0), right: at(x + 1.0) }
    }

    #[test]
    fn names_stand_on_their_own_side_and_apart() {
        let parts = [seen("a", 10.0, 50.0), seen("b", 90.0, 50.0), seen("c", 80.0, 52.0), seen("d", 70.0, 51.0)];
        let labels = labels(&parts, [0.0, 100.0], 30.0);
        assert_eq!(labels[0].side, Side::Left);
        let mut right: Vec<f64> = labels.iter().filter(|l| l.side == Side::Right).map(|l| l.y).collect();
        right.sort_by(f64::total_cmp);
        assert_eq!(right.len(), 3);
        assert!(right.windows(2).all(|p| p[1] - p[0] >= LINE - 1e-9));
    }

    #[test]
    fn leaders_do_not_cross() {
        let parts: Vec<Seen> =
            (0..12).map(|i| seen("p", 60.0 + f64::from(i * 7 % 12) * 3.0, f64::from(i * 5 % 12))).collect();
        let labels = labels(&parts, [0.0, 100.0], 30.0);
        let leaders: Vec<[Point; 2]> =
            labels.iter().filter(|l| l.side == Side::Right).map(|l| [[130.0, l.y], l.anchor]).collect();
        let crossings = leaders.iter().flat_map(|a| leaders.iter().map(move |b| cross(*a, *b))).filter(|c| *c).count();
        assert_eq!(crossings, 0);
    }
}
