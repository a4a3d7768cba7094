//! Makes one number of coordinates that are only printed differently.
//!
//! In: a feature list. Out: the same, with coordinates moved onto each other that OpenSCAD cannot tell apart. It prints six
//! digits, so a corner that it computed for a polygon stands at 0.866025 where the hexagon drawn here has it at 0.8660254:
//! meant as one corner, and two to solids, which then have a sliver between them. Never moves anything by more than half of
//! the sixth digit.

use super::feature::{Item, Shape, Step};
use super::flat::tidied;
use super::placement::Placement;

/// Numbers that differ by this share of a unit of the sixth digit may be printed alike: rounding, and a little more for what
/// was added to it.
const OF_A_DIGIT: f64 = 0.6;
/// Digits that OpenSCAD prints.
const PRINTED: i32 = 6;
/// Numbers that differ by less than this are one wherever they are (mm): sines and cosines of nothing are printed as 1e-17.
const NOTHING: f64 = 1e-6;
/// Coordinates that differ by no more than this are written alike anyway (mm).
const WRITTEN: f64 = 1e-8;
/// How far an axis may lie off an axis of the part (sine of the angle).
const STRAIGHT: f64 = 1e-9;

/// The steps with their nearly equal coordinates made equal.
pub fn snapped(mut steps: Vec<Step>) -> Vec<Step> {
    let mut found: [Vec<f64>; 3] = Default::default();
    each(&mut steps, &mut |axis, value| {
        found[axis].push(value);
        value
    });
    let clusters = found.map(clusters);
    if clusters.iter().any(|all| !all.is_empty()) {
        each(&mut steps, &mut |axis, value| one_of(&clusters[axis], value));
    }
    steps
}

/// Numbers that mean one: all from the first to the second mean the third.
type Cluster = (f64, f64, f64);

fn clusters(mut values: Vec<f64>) -> Vec<Cluster> {
    values.retain(|v| v.is_finite());
    values.sort_by(f64::total_cmp);
    let mut found = Vec::new();
    let mut rest = values.as_slice();
    while let Some(&low) = rest.first() {
        let count = rest.partition_point(|v| v - low <= reach(low));
        let (own, others) = rest.split_at(count.max(1));
        rest = others;
        let high = own[own.len() - 1];
        if high - low > WRITTEN {
            // What was printed, as it was printed.
            let meant = own.iter().copied().min_by_key(|v| decimals(*v)).unwrap_or(low);
            found.push((low, high, meant));
        }
    }
    found
}

/// How far another number may lie that is printed like this one.
fn reach(value: f64) -> f64 {
    let digit = 10f64.powi(value.abs().max(f64::MIN_POSITIVE).log10().floor() as i32 + 1 - PRINTED);
    (OF_A_DIGIT * digit).max(NOTHING)
}

/// Decimals that a number needs, eight at most.
fn decimals(value: f64) -> i32 {
    const MOST: i32 = 8;
    (0..MOST)
        .find(|n| (value - (value * 10f64.powi(*n)).round() / 10f64.powi(*n)).abs() < WRITTEN / 2.0)
        .unwrap_or(MOST)
}

fn one_of(clusters: &[Cluster], value: f64) -> f64 {
    let next = clusters.partition_point(|(low, ..)| *low <= value);
    let own = clusters[..next].last().filter(|(_, high, _)| value <= *high);
    own.map_or(value, |(.., meant)| *meant)
}

/// Calls `moved` with every coordinate, by axis of the part, and puts what it answers in its place.
fn each(steps: &mut [Step], moved: &mut dyn FnMut(usize, f64) -> f64) {
    for step in steps {
        match &mut step.item {
            Item::Group(inner) => each(inner, moved),
            Item::Solid { shape, place } => solid(shape, place, moved),
        }
    }
}

fn solid(shape: &mut Shape, place: &mut Placement, moved: &mut dyn FnMut(usize, f64) -> f64) {
    match shape {
        Shape::Box { x, y, z } => {
            stretch(place, 0, x, 0.5, moved);
            stretch(place, 1, y, 0.5, moved);
            stretch(place, 2, z, 0.0, moved);
        }
        Shape::Cylinder { h, .. } | Shape::Frustum { h, .. } => stretch(place, 2, h, 0.0, moved),
        Shape::Prism { outline, h } => {
            // Half circles fit between two corners as they are.
            if outline.arcs.is_empty() {
                let corners: Vec<[f64; 2]> = outline.corners.iter().map(|p| corner(place, *p, moved)).collect();
                let corners = if corners == outline.corners { corners } else { tidied(corners) };
                outline.corners = if corners.is_empty() { std::mem::take(&mut outline.corners) } else { corners };
            }
            stretch(place, 2, h, 0.0, moved);
        }
        Shape::Sphere { .. } | Shape::Torus { .. } | Shape::Revolve { .. } => {}
    }
}

/// Moves both ends of a size along an axis of the shape, where that lies along one of the part; `before` is the share of the
/// size that lies before the shape's origin.
fn stretch(place: &mut Placement, own: usize, size: &mut f64, before: f64, moved: &mut dyn FnMut(usize, f64) -> f64) {
    let direction = axis(place, own);
    let Some(along) = (0..3).find(|k| direction[*k].abs() > 1.0 - STRAIGHT) else { return };
    let sign = direction[along].signum();
    let [low, high] = [-before, 1.0 - before].map(|share| place.at[along] + sign * share * *size);
    let (new_low, new_high) = (moved(along, low), moved(along, high));
    let new_size = (new_high - new_low) * sign;
    if (new_low, new_high) != (low, high) && new_size > 0.0 {
        place.at[along] = new_low + before * (new_high - new_low);
        *size = new_size;
    }
}

/// A corner of an outline, moved in its plane.
fn corner(place: &Placement, [x, y]: [f64; 2], moved: &mut dyn FnMut(usize, f64) -> f64) -> [f64; 2] {
    let point = place.point([x, y, 0.0]);
    let by = [0, 1, 2].map(|k| moved(k, point[k]) - point[k]);
    let along = |own: usize| axis(place, own).iter().zip(&by).map(|(a, b)| a * b).sum::<f64>();
    [x + along(0), y + along(1)]
}

/// Where an axis of the shape points in the part.
fn axis(place: &Placement, own: usize) -> [f64; 3] {
    let mut unit = [0.0; 3];
    unit[own] = 1.0;
    Placement { at: [0.0; 3], turn: place.turn }.point(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_printed_alike_are_one_and_others_are_not() {
        let found = clusters(vec![0.866025, 0.866_025_4, 0.866_03, 86.6025, 86.602_54, 86.6027, -6.1e-17, 3e-9, 0.0]);
        assert_eq!(found, [(0.866025, 0.866_025_4, 0.866025), (86.6025, 86.602_54, 86.6025)]);
        let all: Vec<f64> = [0.866_025_4, 0.8661, 86.602_53, 86.6027, 0.0].map(|v| one_of(&found, v)).into();
        assert_eq!(all, [0.866025, 0.8661, 86.6025, 86.6027, 0.0]);
    }
}
