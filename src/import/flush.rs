//! Finds the sizes that general tolerances would tear apart.
//!
//! In: a feature list. Out: the same, with the sizes marked that make a face lie in a face of another feature, or touch it.
//! A post that stands on a block stands in the air when the block is made a tenth lower: OpenSCAD writes both places as
//! numbers, and nothing says that one follows the other. Marked sizes are written `basic`; a person gives both one name.

use super::feature::{Item, Shape, Step};
use super::placement::Placement;
use super::write::places;
use std::collections::BTreeSet;

/// Faces nearer than this lie in one another (mm).
const SAME: f64 = 2e-4;
/// With more faces than this all sizes are marked: comparing each with each would take long.
const MAX_FACES: usize = 3000;

type Vector = [f64; 3];

/// A face, with the size it moves with; sizes of outlines are exact anyway.
struct Face {
    solid: usize,
    copy: usize,
    size: Option<&'static str>,
    form: Form,
}

enum Form {
    /// Points p with n · p = offset; n points out of the shape.
    Plane {
        n: Vector,
        offset: f64,
    },
    /// Also the rim of a cone.
    Cylinder {
        on: Vector,
        axis: Vector,
        r: f64,
    },
    Sphere {
        centre: Vector,
        r: f64,
    },
}

/// The steps with their touching sizes marked.
pub fn marked(mut steps: Vec<Step>) -> Vec<Step> {
    let (mut faces, mut solids) = (Vec::new(), 0);
    collect(&steps, &mut solids, &mut faces);
    let mut touching: BTreeSet<(usize, &'static str)> = BTreeSet::new();
    let all = faces.len() > MAX_FACES;
    for (i, a) in faces.iter().enumerate() {
        let others = if all { &[] } else { &faces[i + 1..] };
        for b in others.iter().filter(|b| (a.solid, a.copy) != (b.solid, b.copy)) {
            let sized = a.size.is_some() || b.size.is_some();
            if sized && !together(a, b) && touches(&a.form, &b.form) {
                touching.extend([a, b].into_iter().filter_map(|f| f.size.map(|size| (f.solid, size))));
            }
        }
        touching.extend(a.size.filter(|_| all).map(|size| (a.solid, size)));
    }
    mark(&mut steps, &mut 0, &touching);
    steps
}

fn mark(steps: &mut [Step], solid: &mut usize, touching: &BTreeSet<(usize, &'static str)>) {
    for step in steps {
        match &mut step.item {
            Item::Group(inner) => mark(inner, solid, touching),
            Item::Solid { .. } => {
                step.exact = touching.range((*solid, "")..(*solid + 1, "")).map(|(_, size)| *size).collect();
                *solid += 1;
            }
        }
    }
}

fn collect(steps: &[Step], solids: &mut usize, faces: &mut Vec<Face>) {
    for step in steps {
        match &step.item {
            Item::Group(inner) => collect(inner, solids, faces),
            Item::Solid { shape, place } => {
                for (copy, place) in places(place, &step.pattern).iter().enumerate() {
                    let face = |(size, form)| Face { solid: *solids, copy, size, form };
                    faces.extend(forms(shape, place).into_iter().map(face));
                }
                *solids += 1;
            }
        }
    }
}

/// The faces of a shape in the part's frame.
fn forms(shape: &Shape, place: &Placement) -> Vec<(Option<&'static str>, Form)> {
    let origin = place.point([0.0; 3]);
    let direction = |v: Vector| minus(place.point(v), origin);
    let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(direction);
    let plane = |n: Vector, p: Vector| Form::Plane { n, offset: dot(n, place.point(p)) };
    let ends = |h: f64, size| vec![(None, plane(z.map(|v| -v), [0.0; 3])), (Some(size), plane(z, [0.0, 0.0, h]))];
    let side = |size, d: f64| (Some(size), Form::Cylinder { on: origin, axis: z, r: d / 2.0 });
    match shape {
        Shape::Box { x: a, y: b, z: h } => {
            let across = [(x, [*a, 0.0, 0.0], "x"), (y, [0.0, *b, 0.0], "y")];
            let sides = across.into_iter().flat_map(|(n, p, size)| {
                [1.0, -1.0].map(|side| (Some(size), plane(n.map(|v| v * side), p.map(|v| v * side / 2.0))))
            });
            ends(*h, "z").into_iter().chain(sides).collect()
        }
        Shape::Cylinder { d, h } => ends(*h, "h").into_iter().chain([side("d", *d)]).collect(),
        Shape::Frustum { d1, d2, h } => ends(*h, "h").into_iter().chain([side("d1", *d1), side("d2", *d2)]).collect(),
        Shape::Sphere { d } => vec![(Some("d"), Form::Sphere { centre: origin, r: d / 2.0 })],
        Shape::Torus { .. } => Vec::new(),
        Shape::Prism { outline, h } => {
            let next = outline.corners.iter().cycle().skip(1);
            let sides = outline.corners.iter().zip(next).map(|(p, q)| {
                let n = direction([q[1] - p[1], p[0] - q[0], 0.0]);
                let length = dot(n, n).sqrt().max(1e-12);
                (None, plane(n.map(|v| v / length), [p[0], p[1], 0.0]))
            });
            ends(*h, "h").into_iter().chain(sides).collect()
        }
        Shape::Revolve { outline } => {
            let rims = outline.corners.iter().flat_map(|p| {
                let rim = Form::Cylinder { on: origin, axis: z, r: p[0] };
                [(None, plane(z, [0.0, 0.0, p[1]])), (None, rim)]
            });
            rims.collect()
        }
    }
}

/// Whether two faces are the same side of two copies: they share their size, and move alike.
fn together(a: &Face, b: &Face) -> bool {
    let same = (a.solid, a.size) == (b.solid, b.size);
    same && matches!((&a.form, &b.form), (Form::Plane { n, .. }, Form::Plane { n: m, .. }) if dot(*n, *m) > 0.0)
}

/// Whether one lies in the other, or along it.
fn touches(a: &Form, b: &Form) -> bool {
    let near = |v: f64| v.abs() < SAME;
    let parallel = |a: Vector, b: Vector| dot(a, b).abs() > 1.0 - 1e-6;
    match (a, b) {
        (Form::Plane { n, offset }, Form::Plane { n: m, offset: other }) => {
            parallel(*n, *m) && near(offset - other * dot(*n, *m).signum())
        }
        (Form::Plane { n, offset }, Form::Cylinder { on, axis, r })
        | (Form::Cylinder { on, axis, r }, Form::Plane { n, offset }) => {
            near(dot(*n, *axis)) && near((dot(*n, *on) - offset).abs() - r)
        }
        (Form::Plane { n, offset }, Form::Sphere { centre, r })
        | (Form::Sphere { centre, r }, Form::Plane { n, offset }) => near((dot(*n, *centre) - offset).abs() - r),
        (Form::Cylinder { on, axis, r }, Form::Cylinder { on: at, axis: other, r: s }) => {
            let apart = from_axis(*at, *on, *axis);
            parallel(*axis, *other) && (near(apart - (r - s).abs()) || near(apart - (r + s)))
        }
        (Form::Cylinder { on, axis, r }, Form::Sphere { centre, r: s })
        | (Form::Sphere { centre, r: s }, Form::Cylinder { on, axis, r }) => {
            let apart = from_axis(*centre, *on, *axis);
            near(apart - (r - s).abs()) || near(apart - (r + s))
        }
        (Form::Sphere { centre, r }, Form::Sphere { centre: other, r: s }) => {
            let way = minus(*centre, *other);
            let apart = dot(way, way).sqrt();
            near(apart - (r - s).abs()) || near(apart - (r + s))
        }
    }
}

fn from_axis(point: Vector, on: Vector, axis: Vector) -> f64 {
    let way = minus(point, on);
    (dot(way, way) - dot(way, axis).powi(2)).max(0.0).sqrt()
}

fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn dot(a: Vector, b: Vector) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}
