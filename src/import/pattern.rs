//! Finds equal features that stand in a row, a grid or a circle.
//!
//! In: a feature list. Out: the same with patterns, as a drawing would call them out. Only neighbours with the same
//! operation are drawn together, for among them the order does not matter.

use super::feature::{Item, Op, Pattern, Shape, Step};
use super::placement::Placement;

/// Places and sizes nearer than this are the same (mm): OpenSCAD prints six digits.
const SAME: f64 = 2e-4;

/// The steps with patterns in place of equal neighbours, in groups, too.
pub fn folded(steps: Vec<Step>) -> Vec<Step> {
    let mut out: Vec<Step> = Vec::new();
    let mut run: Vec<Step> = Vec::new();
    for step in steps {
        let step = match step.item {
            Item::Group(inner) => Step { item: Item::Group(folded(inner)), ..step },
            Item::Solid { .. } => step,
        };
        // The first feature stays alone: the part begins with it.
        let joins = run.first().is_some_and(|first| first.op == step.op && step.op != Op::Keep);
        if !joins {
            out.extend(folded_run(std::mem::take(&mut run)));
        }
        run.push(step);
    }
    out.extend(folded_run(run));
    out
}

fn folded_run(run: Vec<Step>) -> Vec<Step> {
    let mut waiting: Vec<Option<Step>> = run.into_iter().map(Some).collect();
    let mut out = Vec::new();
    for i in 0..waiting.len() {
        let Some(step) = waiting[i].take() else { continue };
        let like = |other: &Option<Step>| other.as_ref().is_some_and(|other| alike(&step, other));
        let same: Vec<usize> = (i + 1..waiting.len()).filter(|&k| like(&waiting[k])).collect();
        let places: Vec<Placement> =
            std::iter::once(&step).chain(same.iter().filter_map(|&k| waiting[k].as_ref())).filter_map(place).collect();
        match pattern(&step, &places) {
            Some((place, pattern)) => {
                same.iter().for_each(|&k| waiting[k] = None);
                let Item::Solid { shape, .. } = step.item else { continue };
                out.push(Step { pattern: Some(pattern), ..Step::solid(step.op, shape, place) });
            }
            None => out.push(step),
        }
    }
    out
}

fn place(step: &Step) -> Option<Placement> {
    match &step.item {
        Item::Solid { place, .. } => Some(*place),
        Item::Group(_) => None,
    }
}

/// The same shape at the same height, turned alike but for the turn about z.
fn alike(a: &Step, b: &Step) -> bool {
    let (Item::Solid { shape, place }, Item::Solid { shape: other, place: at }) = (&a.item, &b.item) else {
        return false;
    };
    let turned = near(place.turn[0], at.turn[0]) && near(place.turn[1], at.turn[1]);
    shape == other && near(place.at[2], at.at[2]) && turned && b.pattern.is_none()
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < SAME
}

fn pattern(step: &Step, places: &[Placement]) -> Option<(Placement, Pattern)> {
    if places.len() < 2 {
        return None;
    }
    let straight = places.iter().all(|p| near(p.turn[2], places[0].turn[2]));
    let rows = || straight.then(|| row(places).or_else(|| grid(places))).flatten();
    let Item::Solid { shape, .. } = &step.item else { return None };
    rows().or_else(|| circle(shape, places))
}

/// Equal steps along one line.
fn row(places: &[Placement]) -> Option<(Placement, Pattern)> {
    let mut places = places.to_vec();
    places.sort_by(|a, b| {
        let key = |p: &Placement| [p.at[0], p.at[1]].map(|v| (v / SAME).round());
        key(a).map(|v| v as i64).cmp(&key(b).map(|v| v as i64))
    });
    let (first, second) = (places[0], places[1]);
    let step = [0, 1].map(|i| second.at[i] - first.at[i]);
    let even = |(i, p): (usize, &Placement)| (0..2).all(|k| near(p.at[k], first.at[k] + step[k] * i as f64));
    let pitch = step[0].hypot(step[1]);
    if pitch < SAME || !places.iter().enumerate().all(even) {
        return None;
    }
    let angle = step[1].atan2(step[0]).to_degrees();
    Some((first, Pattern::Line { count: places.len(), pitch, angle }))
}

/// Rows and columns along x and y, none missing.
fn grid(places: &[Placement]) -> Option<(Placement, Pattern)> {
    let [xs, ys] = [0, 1].map(|axis| levels(places, axis));
    let (xs, ys) = (xs?, ys?);
    if xs.len() < 2 || ys.len() < 2 || xs.len() * ys.len() != places.len() {
        return None;
    }
    let taken = |x: f64, y: f64| places.iter().filter(|p| near(p.at[0], x) && near(p.at[1], y)).count() == 1;
    if !xs.iter().all(|x| ys.iter().all(|y| taken(*x, *y))) {
        return None;
    }
    let middle = |v: &[f64]| (v[0] + v[v.len() - 1]) / 2.0;
    let at = [middle(&xs), middle(&ys), places[0].at[2]];
    let pattern = Pattern::Grid { count: places.len(), columns: xs.len(), x: xs[1] - xs[0], y: ys[1] - ys[0] };
    Some((Placement { at, ..places[0] }, pattern))
}

/// The different coordinates along an axis, if they are evenly spaced.
fn levels(places: &[Placement], axis: usize) -> Option<Vec<f64>> {
    let mut found: Vec<f64> = places.iter().map(|p| p.at[axis]).collect();
    found.sort_by(f64::total_cmp);
    found.dedup_by(|a, b| near(*a, *b));
    let step = found.get(1).map_or(0.0, |second| second - found[0]);
    let even = found.iter().enumerate().all(|(i, v)| near(*v, found[0] + step * i as f64));
    even.then_some(found)
}

/// A whole circle about z, each copy turned with its place.
fn circle(shape: &Shape, places: &[Placement]) -> Option<(Placement, Pattern)> {
    let n = places.len();
    if n < 3 {
        return None;
    }
    let middle = [0, 1].map(|axis| places.iter().map(|p| p.at[axis]).sum::<f64>() / n as f64);
    let arm = |p: &Placement| [p.at[0] - middle[0], p.at[1] - middle[1]];
    let radius = places.iter().map(|p| arm(p)[0].hypot(arm(p)[1])).sum::<f64>() / n as f64;
    if radius < SAME || !places.iter().all(|p| near(arm(p)[0].hypot(arm(p)[1]), radius)) {
        return None;
    }
    // A hundredth of a degree of six printed digits, more on small circles.
    let slack = (SAME / radius).to_degrees().max(1e-3);
    let degrees = |p: &Placement| {
        let turn = arm(p)[1].atan2(arm(p)[0]).to_degrees().rem_euclid(360.0);
        // A hair before a whole turn is the beginning.
        if turn > 360.0 - slack { turn - 360.0 } else { turn }
    };
    let step = 360.0 / n as f64;
    let mut sorted = places.to_vec();
    sorted.sort_by(|a, b| degrees(a).total_cmp(&degrees(b)));
    let from = degrees(&sorted[0]);
    let even = sorted.iter().enumerate().all(|(i, p)| (degrees(p) - from - step * i as f64).abs() < slack);
    let round =
        matches!(shape, Shape::Cylinder { .. } | Shape::Frustum { .. } | Shape::Torus { .. } | Shape::Revolve { .. })
            && sorted[0].turn == [0.0; 3]
            || matches!(shape, Shape::Sphere { .. });
    let own = |p: &Placement| (p.turn[2] - degrees(p)).rem_euclid(360.0);
    let apart = |a: f64, b: f64| ((a - b + 180.0).rem_euclid(360.0) - 180.0).abs();
    let follows = round || sorted.iter().all(|p| apart(own(p), own(&sorted[0])) < slack);
    if !even || !follows {
        return None;
    }
    let about_z = if round { 0.0 } else { signed(own(&sorted[0])) };
    let turn = [sorted[0].turn[0], sorted[0].turn[1], about_z];
    let place = Placement { at: [middle[0], middle[1], sorted[0].at[2]], turn };
    Some((place, Pattern::Circle { count: n, d: 2.0 * radius, from }))
}

/// -180 to 180 degrees.
fn signed(angle: f64) -> f64 {
    if angle > 180.0 { angle - 360.0 } else { angle }
}
