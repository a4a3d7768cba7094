//! Samples beside corners where edges touch.
//!
//! In: the arrangement and the parameters at which its arcs are sampled. Out: the same with chords halved where, next to a
//! corner that two arcs leave in one direction, the chord of the flatter one would cut off the other's.
//!
//! Near the corner the arcs are parabolas of heights `bend x² / 2` over their common tangent. A first chord of length l runs
//! at a slope of `bend l / 2`, so the flatter arc keeps clear of the other's first chord when its own is the less steep. Its
//! k-th chord further on keeps clear of the other parabola, and of all chords above it, when `4 k (k + 1) (ratio - 1) > 1`
//! with the ratio of the bends; those before that are halved along with the first.

use super::arrange::Arrangement;
use super::corner::{Leaving, TIE};

/// Greatest slope of the flatter first chord, as a share of that of the other.
const CLEAR: f64 = 0.75;
/// Halvings of a chord at most, rounds over all corners (a chord that was halved may be too short for a third arc), and chords halved together.
const HALVINGS: usize = 8;
const ROUNDS: usize = 4;
const MOST_CHORDS: usize = 8;
/// Bends (1/mm) that differ by less are those of one curve.
const SAME_BEND: f64 = 1e-6;

/// An arc as it leaves one of its corners.
struct Tip {
    corner: usize,
    arc: usize,
    /// It leaves its start.
    forward: bool,
    leaving: Leaving,
}

/// Halves chords until no two that leave a corner in one direction cross.
pub(super) fn part_chords(arrangement: &Arrangement, parameters: &mut [Vec<f64>]) {
    let pairs = touching(&tips(arrangement));
    for _ in 0..ROUNDS {
        let halved: Vec<bool> = pairs.iter().map(|pair| pair.part(arrangement, parameters)).collect();
        if !halved.contains(&true) {
            return;
        }
    }
}

fn tips(arrangement: &Arrangement) -> Vec<Tip> {
    let mut tips = Vec::with_capacity(2 * arrangement.arcs.len());
    for (arc, corners) in arrangement.arcs.iter().enumerate().filter_map(|(i, a)| Some((i, a.ends?))) {
        for (corner, forward) in corners.into_iter().zip([true, false]) {
            tips.push(Tip { corner, arc, forward, leaving: Leaving::new(arrangement, (arc, forward)) });
        }
    }
    tips.sort_by_key(|t| t.corner);
    tips
}

/// Two arcs that touch at a corner and bend to the same side.
struct Touch {
    /// Arc, and whether it leaves its start.
    flat: (usize, bool),
    bent: (usize, bool),
    /// Bends away from their tangent (1/mm), the smaller first.
    bends: [f64; 2],
}

fn touching(tips: &[Tip]) -> Vec<Touch> {
    let mut pairs = Vec::new();
    for around in tips.chunk_by(|s, t| s.corner == t.corner) {
        for (i, s) in around.iter().enumerate() {
            pairs.extend(around[i + 1..].iter().filter_map(|t| Touch::of(s, t)));
        }
    }
    pairs
}

impl Touch {
    fn of(s: &Tip, t: &Tip) -> Option<Touch> {
        let [d, e] = [s, t].map(|tip| tip.leaving.direction);
        if d.dot(&e) < 0.0 || d.cross(&e).norm() > TIE {
            return None;
        }
        let aside = (s.leaving.bend - t.leaving.bend).try_normalize(SAME_BEND)?;
        let [b, c] = [s, t].map(|tip| tip.leaving.bend.dot(&aside));
        let [one, other] = [s, t].map(|tip| (tip.arc, tip.forward));
        let (flat, bent) = if b.abs() < c.abs() { (one, other) } else { (other, one) };
        (b * c > 0.0).then(|| Touch { flat, bent, bends: [b.abs().min(c.abs()), b.abs().max(c.abs())] })
    }

    /// Whether chords had to be halved.
    fn part(&self, arrangement: &Arrangement, parameters: &mut [Vec<f64>]) -> bool {
        let chord = |(arc, forward): (usize, bool), parameters: &[Vec<f64>]| {
            let (locus, t) = (&arrangement.curves[arrangement.arcs[arc].curve], &parameters[arc]);
            let last = t.len() - 1;
            let [from, to] = if forward { [t[0], t[1]] } else { [t[last], t[last - 1]] };
            (locus.at(to) - locus.at(from)).norm()
        };
        let steepest = self.bends[1] * chord(self.bent, parameters) * CLEAR;
        let mut count = 0;
        while count < HALVINGS && self.bends[0] * chord(self.flat, parameters) > steepest {
            halve(&mut parameters[self.flat.0], self.flat.1, self.chords());
            count += 1;
        }
        count > 0
    }

    /// How many chords of the flatter arc may come too near the other.
    fn chords(&self) -> usize {
        let over = self.bends[1] / self.bends[0] - 1.0;
        (1..MOST_CHORDS).find(|k| 4.0 * (k * (k + 1)) as f64 * over > 1.0).unwrap_or(MOST_CHORDS)
    }
}

/// Halves the first chords, or the last.
fn halve(parameters: &mut Vec<f64>, forward: bool, chords: usize) {
    let count = chords.min(parameters.len() - 1);
    let from = if forward { 0 } else { parameters.len() - 1 - count };
    let middles = (from..from + count).rev().map(|i| (i + 1, (parameters[i] + parameters[i + 1]) / 2.0));
    for (at, middle) in middles.collect::<Vec<_>>() {
        parameters.insert(at, middle);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::arrange::Arc;
    use crate::solid::locus::Locus;
    use nalgebra::{Point3, Unit, Vector3};
    use std::f64::consts::TAU;

    /// Circles of these radii that touch at the origin from the same side, each from there once round.
    fn nested(radii: &[f64], tilt: f64) -> Arrangement {
        let axis = Unit::new_normalize(Vector3::new(tilt.sin(), 0.0, tilt.cos()));
        let out = axis.cross(&Vector3::y());
        let circle = |r: &f64| Locus::circle(Point3::from(out * *r), axis, *r);
        let curves: Vec<Locus> = radii.iter().map(circle).collect();
        let arc = |(curve, locus): (usize, &Locus)| {
            let start = locus.parameter(&Point3::origin());
            Arc { curve, span: [start, start + TAU], ends: Some([0, 0]), uses: Vec::new() }
        };
        let arcs = curves.iter().enumerate().map(arc).collect();
        Arrangement { curves, corners: vec![Point3::origin()], arcs }
    }

    /// The same steps on every circle are the worst: all first chords lie on one line.
    #[test]
    fn chords_of_nested_circles_do_not_cross() {
        for (radii, steps) in
            [(vec![8.0, 3.0], 64), (vec![8.0, 6.0, 3.0], 64), (vec![5.0, 4.9], 96), (vec![1.0, 40.0], 16)]
        {
            let arrangement = nested(&radii, 0.7);
            let even = |arc: &Arc| (0..=steps).map(|k| arc.span[0] + TAU * f64::from(k) / f64::from(steps)).collect();
            let mut parameters: Vec<Vec<f64>> = arrangement.arcs.iter().map(even).collect();
            part_chords(&arrangement, &mut parameters);
            let polygon = |arc: usize| -> Vec<Point3<f64>> {
                parameters[arc].iter().map(|t| arrangement.curves[arrangement.arcs[arc].curve].at(*t)).collect()
            };
            let mut order: Vec<usize> = (0..radii.len()).collect();
            order.sort_by(|i, j| radii[*i].total_cmp(&radii[*j]));
            for pair in order.windows(2) {
                let (inner, outer) = (polygon(pair[0]), polygon(pair[1]));
                for p in &inner[1..inner.len() - 1] {
                    assert!(is_within(&outer, p, &arrangement.curves[0]), "{radii:?}: {p} lies outside");
                }
            }
        }
    }

    /// Left of every chord of a convex polygon round the circle's axis.
    fn is_within(polygon: &[Point3<f64>], p: &Point3<f64>, circle: &Locus) -> bool {
        let Locus::Circle { axis, .. } = circle else { return false };
        polygon.windows(2).all(|w| (w[1] - w[0]).cross(&(p - w[0])).dot(axis) > 0.0)
    }
}
