//! Flat drawings: circles, squares and polygons, and what extruding or revolving makes of them.
//!
//! In: a node of a drawing and the frame it stands in. Out: the solid it becomes. Hulls of equal discs are outlines, too.

use super::csg::{Node, Value};
use super::feature::{Item, Op, Outline, Shape, Step};
use super::lower::{Drawing, FACETED, Frame, Lower, is_even, is_faceted};
use super::placement::{Matrix, Parts, Placement};
use std::f64::consts::TAU;

/// Corners nearer than this to the last one, or to the line between their neighbours, are none (mm).
const SAME: f64 = 1e-5;

/// A leaf of a drawing.
pub fn leaf(lower: &mut Lower, node: &Node, frame: &Frame) -> Vec<Step> {
    match node.name.as_str() {
        "circle" => {
            let r = node.number("r").filter(|r| r.is_finite()).unwrap_or(1.0);
            disc(lower, node, r, frame)
        }
        "square" => match square(node) {
            Some((size, middle)) => rectangle(lower, node, size, middle, 0.0, frame),
            None => Vec::new(),
        },
        "offset" => offset(lower, node, frame),
        _ => polygon(lower, node, frame),
    }
}

fn disc(lower: &mut Lower, node: &Node, r: f64, frame: &Frame) -> Vec<Step> {
    if r <= 0.0 {
        return Vec::new();
    }
    if is_faceted(node) {
        return outlined(lower, node, regular(node, r), frame);
    }
    match frame.drawing {
        Drawing::Extruded(h) => lower.round(node, [r, r], h, &frame.outer.then(&frame.inner)),
        _ => ring(lower, node, r, frame),
    }
}

/// A circle turned about the axis.
fn ring(lower: &mut Lower, node: &Node, r: f64, frame: &Frame) -> Vec<Step> {
    let (Some(inner), Some(outer)) = (frame.inner.parts(), frame.outer.parts()) else {
        return lower.refuse(node, "sheared by its `multmatrix`");
    };
    let [x, z, _] = inner.at;
    let (r, even) = (r * inner.scale[0], is_even(inner.scale[0], inner.scale[1]));
    let uniform = is_even(outer.scale[0], outer.scale[1]) && is_even(outer.scale[0], outer.scale[2]);
    if !even || !uniform {
        return lower.refuse(node, "scaled to an ellipse");
    }
    let (major, scale) = (x.abs(), outer.scale[0]);
    if major <= r {
        return lower.refuse(node, "a circle that reaches over the axis it is turned about");
    }
    let place = outer.moved([0.0, 0.0, z * scale]).placed_axis();
    vec![Step::solid(Op::Add, Shape::Torus { d: 2.0 * major * scale, tube: 2.0 * r * scale }, place)]
}

/// Sides and middle of a square; `None` when it is empty.
fn square(node: &Node) -> Option<([f64; 2], [f64; 2])> {
    let size = match node.get("size") {
        Some(Value::Number(side)) => [*side; 2],
        Some(value) => <[f64; 2]>::try_from(value.numbers()?).ok()?,
        None => [1.0; 2],
    };
    let middle = if node.flag("center") { [0.0; 2] } else { size.map(|s| s / 2.0) };
    size.iter().all(|s| s.is_finite() && *s > 0.0).then_some((size, middle))
}

fn rectangle(
    lower: &mut Lower,
    node: &Node,
    [x, y]: [f64; 2],
    middle: [f64; 2],
    round: f64,
    frame: &Frame,
) -> Vec<Step> {
    let place = Matrix::translation([middle[0], middle[1], 0.0]);
    let straight = frame.inner.parts().is_some();
    if let (Drawing::Extruded(h), true, 0.0) = (frame.drawing, straight, round) {
        return lower.cuboid(node, [x, y, h], &frame.outer.then(&frame.inner).then(&place));
    }
    let (a, b) = (x / 2.0, y / 2.0);
    let corners = [[-a, -b], [a, -b], [a, b], [-a, b]].map(|[x, y]| [x + middle[0], y + middle[1]]);
    outlined(lower, node, Outline { round, ..Outline::polygon(corners.to_vec()) }, frame)
}

/// `offset` of a circle or a square; of other drawings the outline is not known.
fn offset(lower: &mut Lower, node: &Node, frame: &Frame) -> Vec<Step> {
    let (round, by) = match (node.number("r"), node.number("delta")) {
        (Some(r), _) => (true, r),
        (None, Some(delta)) => (false, delta),
        _ => (true, 0.0),
    };
    let children: Vec<&Node> = node.children.iter().filter(|child| !child.background).collect();
    let child = match children.as_slice() {
        [] => return Vec::new(),
        [one] if !node.flag("chamfer") => *one,
        _ => return lower.refuse(node, "an offset of more than one circle or square"),
    };
    match (child.name.as_str(), square(child)) {
        ("circle", _) if !is_faceted(child) => disc(lower, child, child.number("r").unwrap_or(1.0) + by, frame),
        ("square", Some(([x, y], middle))) => {
            let size = [x + 2.0 * by, y + 2.0 * by];
            if size.iter().any(|s| *s <= 0.0) {
                return Vec::new();
            }
            let corner = if round && by > 0.0 { by } else { 0.0 };
            rectangle(lower, child, size, middle, corner, frame)
        }
        _ => lower.refuse(node, "an offset of another outline than a circle or a square"),
    }
}

fn polygon(lower: &mut Lower, node: &Node, frame: &Frame) -> Vec<Step> {
    let point = |value: &Value| value.numbers().filter(|p| p.len() >= 2).map(|p| [p[0], p[1]]);
    let points: Option<Vec<[f64; 2]>> =
        node.get("points").and_then(Value::list).and_then(|list| list.iter().map(point).collect());
    let Some(points) = points.filter(|p| p.iter().flatten().all(|v| v.is_finite())) else {
        return lower.refuse(node, "no list of points");
    };
    let paths = match node.get("paths").and_then(Value::list) {
        None => vec![points],
        Some(list) => {
            let path = |value: &Value| -> Option<Vec<[f64; 2]>> {
                value.numbers()?.iter().map(|i| points.get(*i as usize).copied()).collect()
            };
            match list.iter().map(path).collect::<Option<Vec<_>>>() {
                Some(paths) => paths,
                None => return lower.refuse(node, "a path of points that are not there"),
            }
        }
    };
    let mut paths: Vec<Vec<[f64; 2]>> = paths.into_iter().map(tidied).filter(|p| p.len() >= 3).collect();
    paths.sort_by(|a, b| area(b).abs().total_cmp(&area(a).abs()));
    let Some((outer, holes)) = paths.split_first() else { return Vec::new() };
    if !holes.iter().all(|hole| hole.iter().all(|p| inside(*p, outer))) {
        return lower.refuse(node, "several paths that are no holes of the first");
    }
    let mut steps = outlined(lower, node, Outline::polygon(outer.clone()), frame);
    for hole in holes {
        let cut = outlined(lower, node, Outline::polygon(hole.clone()), frame);
        steps.extend(cut.into_iter().map(|step| Step { op: Op::Cut, ..step }));
    }
    steps
}

/// An outline, extruded or revolved.
fn outlined(lower: &mut Lower, node: &Node, outline: Outline, frame: &Frame) -> Vec<Step> {
    let Some(inner) = frame.inner.parts().or_else(|| outline.arcs.is_empty().then(identity)) else {
        return lower.refuse(node, "sheared by its `multmatrix`");
    };
    let even = is_even(inner.scale[0], inner.scale[1]);
    if outline.round > 0.0 && !even {
        return lower.refuse(node, "scaled to an ellipse");
    }
    let moved = |[x, y]: [f64; 2]| {
        let [x, y, _] = frame.inner.point([x, y, 0.0]);
        [x, y]
    };
    let corners = outline.corners.iter().copied().map(moved).collect();
    let outline = Outline { corners: tidied(corners), round: outline.round * inner.scale[0], ..outline };
    match frame.drawing {
        Drawing::Extruded(h) => lower.prism(node, outline, h, &frame.outer),
        _ => revolved(lower, node, outline, frame),
    }
}

fn identity() -> Parts {
    Parts {
        scale: [1.0; 3],
        mirrored: false,
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        at: [0.0; 3],
    }
}

fn revolved(lower: &mut Lower, node: &Node, mut outline: Outline, frame: &Frame) -> Vec<Step> {
    let Some(outer) = frame.outer.parts() else { return lower.refuse(node, "sheared by its `multmatrix`") };
    if !is_even(outer.scale[0], outer.scale[1]) || (outline.round > 0.0 && !is_even(outer.scale[0], outer.scale[2])) {
        return lower.refuse(node, "scaled to an ellipse");
    }
    if outline.corners.iter().all(|p| p[0] <= SAME) {
        outline.corners.iter_mut().for_each(|p| p[0] = -p[0]);
    }
    if outline.corners.iter().any(|p| p[0] < -SAME) {
        return lower.refuse(node, "an outline on both sides of the axis it is turned about");
    }
    for p in &mut outline.corners {
        *p = [(p[0] * outer.scale[0]).max(0.0), p[1] * outer.scale[2]];
    }
    outline.round *= outer.scale[0];
    vec![Step::solid(Op::Add, Shape::Revolve { outline }, outer.placed_axis())]
}

/// The polygon that OpenSCAD draws for a circle of few facets.
pub fn regular(node: &Node, r: f64) -> Outline {
    let n = node.number("$fn").unwrap_or(FACETED).floor().max(3.0);
    let corner = |i: usize| {
        let angle = TAU * i as f64 / n;
        [r * angle.cos(), r * angle.sin()]
    };
    Outline::polygon((0..n as usize).map(corner).collect())
}

/// An outline after scaling and mirroring; `None` when that makes an ellipse of its arcs.
pub fn scaled(outline: &Outline, parts: &Parts) -> Option<Outline> {
    let [sx, sy, _] = parts.scale;
    let curved = outline.round > 0.0 || !outline.arcs.is_empty();
    if curved && !is_even(sx, sy) {
        return None;
    }
    let sign = if parts.mirrored { -1.0 } else { 1.0 };
    // Half circles turn the other way in a mirror: the hull of discs is never drawn there.
    let corners = outline.corners.iter().map(|[x, y]| [sign * x * sx, y * sy]).collect();
    let arcs = outline.arcs.iter().map(|(side, r)| (*side, r * sx)).collect();
    Some(Outline { corners, arcs, round: outline.round * sx })
}

/// Without corners that are none: doubles, and points on a straight side.
pub fn tidied(mut corners: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    loop {
        let n = corners.len();
        let needless = (0..n).find(|&i| {
            let (a, b, c) = (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
            let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
            let (lu, lv) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
            let cross = u[0] * v[1] - u[1] * v[0];
            lu < SAME || (cross.abs() < SAME * lu.max(lv) && u[0] * v[0] + u[1] * v[1] > 0.0)
        });
        match needless {
            Some(i) if n > 3 => drop(corners.remove(i)),
            Some(_) => return Vec::new(),
            None => return corners,
        }
    }
}

/// Twice the area, positive counter-clockwise.
fn area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

fn inside([x, y]: [f64; 2], corners: &[[f64; 2]]) -> bool {
    let next = corners.iter().cycle().skip(1);
    let crossings = corners
        .iter()
        .zip(next)
        .filter(|(a, b)| (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]);
    crossings.count() % 2 == 1
}

/// The hull of cylinders of one size that stand side by side on one plane.
pub fn hull_of_discs(steps: &[Step]) -> Option<Vec<Step>> {
    let disc = |step: &Step| match (&step.op, &step.item) {
        (Op::Add, Item::Solid { shape: Shape::Cylinder { d, h }, place }) => Some((*d, *h, *place)),
        _ => None,
    };
    let discs: Vec<(f64, f64, Placement)> = steps.iter().map(disc).collect::<Option<_>>()?;
    let &(d, h, first) = discs.first()?;
    let even = |a: f64, b: f64| (a - b).abs() < SAME;
    let mut centres = Vec::new();
    for (other_d, other_h, place) in &discs {
        let [x, y, z] = in_frame(&first, place.at);
        if !even(*other_d, d) || !even(*other_h, h) || place.turn != first.turn || z.abs() > SAME {
            return None;
        }
        centres.push([x, y]);
    }
    let shape = match convex(centres).as_slice() {
        [_] => Shape::Cylinder { d, h },
        [a, b] => Shape::Prism { outline: slot(*a, *b, d / 2.0), h },
        corners => Shape::Prism { outline: grown(corners, d / 2.0), h },
    };
    Some(vec![Step::solid(Op::Add, shape, first)])
}

/// A point of the part in a placement's own frame.
fn in_frame(place: &Placement, point: [f64; 3]) -> [f64; 3] {
    let offset = [0, 1, 2].map(|i| point[i] - place.at[i]);
    let origin = Placement { at: [0.0; 3], ..*place };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| origin.point(axis));
    axes.map(|axis| (0..3).map(|i| axis[i] * offset[i]).sum())
}

/// Two half circles and two lines.
fn slot(a: [f64; 2], b: [f64; 2], r: f64) -> Outline {
    let length = (b[0] - a[0]).hypot(b[1] - a[1]);
    // To the right of the way from a to b, so that the outline runs counter-clockwise.
    let n = [(b[1] - a[1]) / length * r, (a[0] - b[0]) / length * r];
    let corners = vec![
        [a[0] + n[0], a[1] + n[1]],
        [b[0] + n[0], b[1] + n[1]],
        [b[0] - n[0], b[1] - n[1]],
        [a[0] - n[0], a[1] - n[1]],
    ];
    Outline { corners, arcs: vec![(2, r), (0, r)], round: 0.0 }
}

/// A convex polygon grown by r, its corners rounded by r.
fn grown(corners: &[[f64; 2]], r: f64) -> Outline {
    let n = corners.len();
    let side = |i: usize| {
        let (a, b) = (corners[i % n], corners[(i + 1) % n]);
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let normal = [(b[1] - a[1]) / length, (a[0] - b[0]) / length];
        (normal, normal[0] * a[0] + normal[1] * a[1] + r)
    };
    let corner = |i: usize| {
        let ((n1, o1), (n2, o2)) = (side(i), side(i + 1));
        let cross = n1[0] * n2[1] - n1[1] * n2[0];
        [(o1 * n2[1] - o2 * n1[1]) / cross, (n1[0] * o2 - n2[0] * o1) / cross]
    };
    Outline { round: r, ..Outline::polygon((0..n).map(corner).collect()) }
}

/// The convex hull, counter-clockwise (Andrew's monotone chain).
fn convex(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup_by(|a, b| (a[0] - b[0]).hypot(a[1] - b[1]) < SAME);
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain.as_slice() {
                let turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                if turn > SAME {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}
