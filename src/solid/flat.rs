//! Triangles of the commonest flat faces: a convex outline, and one with a single hole in it.
//!
//! In: points of the plane, rings of them. Out: triangles, or `None` for what takes a triangulation by Delaunay's rule
//! (`mesh`). Nothing is trusted: triangles count only if every one of them is counter-clockwise, for then they neither overlap
//! nor leave anything out between closed rings.

/// Twice the area of a triangle; positive when it is counter-clockwise.
fn doubled([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// A triangle thinner than this share of its longest sides' product may be turned round by rounding.
const FLAT: f64 = 1e-9;

fn is_left([a, b, c]: [[f64; 2]; 3]) -> bool {
    let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).abs() + (p[1] - q[1]).abs();
    doubled([a, b, c]) > FLAT * length(a, b) * length(a, c).max(length(b, c))
}

/// Triangles of the outline `points[..outer]`, less the clockwise hole that the other points are, if there are any.
pub(super) fn triangles(points: &[[f64; 2]], outer: usize) -> Option<Vec<[usize; 3]>> {
    if outer < 3 || !is_convex(&points[..outer], 1.0) {
        return None;
    }
    if points.len() == outer {
        let mut found = Vec::with_capacity(outer - 2);
        halve(0, outer - 1, &mut found);
        return found.iter().all(|t| is_left(t.map(|i| points[i]))).then_some(found);
    }
    let found = between(points, outer)?;
    found.iter().all(|t| is_left(t.map(|i| points[i]))).then_some(found)
}

/// Whether every corner turns left (1) or right (-1), and the ring goes round once.
fn is_convex(ring: &[[f64; 2]], way: f64) -> bool {
    let at = |i: usize| ring[i % ring.len()];
    let mut turns = 0;
    for i in 0..ring.len() {
        let [a, b, c] = [at(i), at(i + 1), at(i + 2)];
        if doubled([a, b, c]) * way <= 0.0 {
            return false;
        }
        // Once round, u falls once and rises once.
        turns += usize::from((a[0] < b[0]) != (b[0] < c[0]));
    }
    turns == 2
}

/// Triangles of a convex polygon's stretch from `low` to `high`: the two ends and the corner half way, then either half.
fn halve(low: usize, high: usize, found: &mut Vec<[usize; 3]>) {
    if high - low < 2 {
        return;
    }
    let middle = (low + high) / 2;
    found.push([low, middle, high]);
    halve(low, middle, found);
    halve(middle, high, found);
}

/// Triangles between the outline and a hole, both convex: going round the middle of the hole, the ring that lags is advanced.
fn between(points: &[[f64; 2]], outer: usize) -> Option<Vec<[usize; 3]>> {
    let inner = points.len() - outer;
    if inner < 3 || !is_convex(&points[outer..], -1.0) {
        return None;
    }
    let sum = points[outer..].iter().fold([0.0, 0.0], |s, p| [s[0] + p[0], s[1] + p[1]]);
    let middle = sum.map(|s| s / inner as f64);
    // The hole is clockwise: from its last point backwards it goes round with the outline.
    let hole = |k: usize| outer + (2 * inner - 1 - k) % inner;
    let off = |i: usize| [points[i][0] - middle[0], points[i][1] - middle[1]];
    // Where the outline is nearest to the direction of the hole's first point.
    let ahead = off(hole(0));
    let length = ahead[0].hypot(ahead[1]);
    let along = |i: usize| {
        let p = off(i);
        (p[0] * ahead[0] + p[1] * ahead[1]) / (p[0].hypot(p[1]) * length)
    };
    let start = (0..outer).max_by(|i, j| along(*i).total_cmp(&along(*j)))?;
    let rim = |k: usize| (start + k) % outer;
    let mut found = Vec::with_capacity(outer + inner);
    let (mut i, mut j) = (0, 0);
    while i < outer || j < inner {
        let (a, b) = (off(rim(i + 1)), off(hole(j + 1)));
        // The next point of the outline comes first when the hole's lies to its left.
        let outline_lags = a[0] * b[1] - a[1] * b[0] >= 0.0;
        if j == inner || i < outer && outline_lags {
            found.push([rim(i), rim(i + 1), hole(j)]);
            i += 1;
        } else {
            found.push([rim(i), hole(j + 1), hole(j)]);
            j += 1;
        }
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn circle(centre: [f64; 2], r: f64, count: usize, from: f64) -> Vec<[f64; 2]> {
        let place = |k: usize| {
            let (sin, cos) = (from + TAU * k as f64 / count as f64).sin_cos();
            [centre[0] + r * cos, centre[1] + r * sin]
        };
        (0..count).map(place).collect()
    }

    fn area(points: &[[f64; 2]]) -> f64 {
        let side = |i: usize| {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            (a[0] * b[1] - a[1] * b[0]) / 2.0
        };
        (0..points.len()).map(side).sum()
    }

    #[test]
    fn triangles_fill_discs_and_rings() {
        let holes = [None, Some(([0.0, 0.0], 1.0, 16)), Some(([0.0, 0.0], 2.9, 64)), Some(([1.2, -0.4], 1.5, 128))];
        for (hole, count) in holes.into_iter().flat_map(|hole| [3, 4, 16, 128].map(|count| (hole, count))) {
            let outer = circle([0.0, 0.0], 3.0, count, 0.3);
            let inner: Vec<[f64; 2]> =
                hole.map_or(Vec::new(), |(centre, r, n)| circle(centre, r, n, 2.0).into_iter().rev().collect());
            let all: Vec<[f64; 2]> = outer.iter().chain(&inner).copied().collect();
            let Some(found) = triangles(&all, count) else {
                assert!(hole.is_some(), "a convex outline of {count}");
                continue;
            };
            assert_eq!(found.len(), if hole.is_some() { all.len() } else { count - 2 });
            let sum: f64 = found.iter().map(|t| doubled(t.map(|i| all[i])) / 2.0).sum();
            assert!((sum - area(&outer) - if hole.is_some() { area(&inner) } else { 0.0 }).abs() < 1e-9);
        }
    }

    #[test]
    fn what_is_not_convex_or_has_its_hole_outside_is_left_alone() {
        let notched = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        assert_eq!(triangles(&notched, 5), None);
        let twice: Vec<[f64; 2]> = circle([0.0; 2], 1.0, 16, 0.0).into_iter().step_by(3).cycle().take(12).collect();
        assert_eq!(triangles(&twice, 12), None);
        let mut beside = circle([0.0; 2], 1.0, 16, 0.0);
        beside.extend(circle([5.0, 0.0], 1.0, 16, 0.0).into_iter().rev());
        assert_eq!(triangles(&beside, 16), None);
        let mut crossing = circle([0.0; 2], 1.0, 16, 0.0);
        crossing.extend(circle([0.5, 0.0], 0.7, 16, 0.0).into_iter().rev());
        assert_eq!(triangles(&crossing, 16), None);
    }
}
