//! Parts built feature by feature, their solids, and what is asked of these.

use gonogo::design::model::{
    Corner, Expr, Extent, Feature, FeatureCopy, Op, Outline, OutlinePath, OutlineSide, Part, PoseExpr, Shape,
};
use gonogo::diag::{Diagnostic, Span};
use gonogo::solid::{Quality, Solid, Surface, evaluate};
use std::collections::BTreeMap;

pub fn number(v: f64) -> Expr {
    Expr::Const(v)
}

pub fn length(v: f64) -> Extent {
    Extent::Length(number(v))
}

pub fn block(x: f64, y: f64, z: f64) -> Shape {
    Shape::Box { x: number(x), y: number(y), z: length(z) }
}

pub fn cylinder(d: f64, h: f64) -> Shape {
    Shape::Cylinder { d: number(d), h: length(h) }
}

pub fn cone(d1: f64, d2: f64, h: f64) -> Shape {
    Shape::Cone { d1: number(d1), d2: number(d2), h: length(h) }
}

pub fn ball(d: f64) -> Shape {
    Shape::Sphere { d: number(d) }
}

pub fn torus(d: f64, tube: f64) -> Shape {
    Shape::Torus { d: number(d), tube: number(tube) }
}

/// A rectangle with its first side bent outwards by an arc, and its third corner rounded.
pub fn outline(x: f64, y: f64, left: f64) -> Outline {
    let side = |to: [f64; 2], path, corner| OutlineSide { name: String::new(), to: to.map(number), path, corner };
    let named = |(i, side): (usize, OutlineSide)| OutlineSide { name: (i + 1).to_string(), ..side };
    let bent = OutlinePath::Arc { radius: number(y), left: true, long: false };
    let sides = vec![
        side([left + x, 0.0], OutlinePath::Line, Corner::Sharp),
        side([left + x, y], bent, Corner::Sharp),
        side([left, y], OutlinePath::Line, Corner::Round(number(0.5))),
        side([left, 0.0], OutlinePath::Line, Corner::Sharp),
    ];
    Outline {
        start: [left, 0.0].map(number),
        start_corner: Corner::Sharp,
        sides: sides.into_iter().enumerate().map(named).collect(),
    }
}

pub fn pose(t: [f64; 3], r: [f64; 3]) -> PoseExpr {
    PoseExpr { t: t.map(number), r: r.map(number) }
}

pub fn at(x: f64, y: f64, z: f64) -> PoseExpr {
    pose([x, y, z], [0.0; 3])
}

pub fn feature(name: &str, op: Op, shape: Shape, pose: PoseExpr) -> Feature {
    let copies = vec![FeatureCopy { shape, pose }];
    Feature { name: name.into(), op, patterned: false, copies, span: Span::default() }
}

pub fn part(features: Vec<Feature>) -> Part {
    Part { name: "piece".into(), material: 0, features, span: Span::default() }
}

/// The features' solid, its triangles checked, or the diagnostics.
pub fn solid(features: Vec<Feature>) -> Result<Solid, Vec<Diagnostic>> {
    let solid = evaluate(&part(features), &[], &Quality::default())?;
    assert_eq!(mesh_fault(&solid), None);
    Ok(solid)
}

/// What is wrong with the triangles: they are open, or farther from the solid than their chords.
pub fn mesh_fault(solid: &Solid) -> Option<String> {
    let mut sides: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut volume = 0.0;
    for t in &solid.mesh.triangles {
        (0..3).for_each(|k| *sides.entry((t[k], t[(k + 1) % 3])).or_default() += 1);
        let [a, b, c] = t.map(|v| solid.mesh.positions[v as usize].coords);
        volume += a.dot(&b.cross(&c)) / 6.0;
    }
    let open = sides.iter().filter(|((a, b), n)| **n != 1 || sides.get(&(*b, *a)) != Some(&1)).count();
    let chords = Quality::default().chord * solid.area;
    let far = (volume - solid.volume).abs() > chords;
    let hold = || format!("the triangles hold {volume}, the solid {}", solid.volume);
    (open > 0).then(|| format!("{open} sides of triangles do not pair off")).or_else(|| far.then(hold))
}

/// Faces by kind of surface, edges and corners.
pub fn counts(solid: &Solid) -> [usize; 7] {
    let mut counts = [0, 0, 0, 0, 0, solid.edges.len(), solid.vertices.len()];
    for face in &solid.faces {
        let kind = match solid.surfaces[face.surface] {
            Surface::Plane { .. } => 0,
            Surface::Cylinder { .. } => 1,
            Surface::Cone { .. } => 2,
            Surface::Sphere { .. } => 3,
            Surface::Torus { .. } => 4,
        };
        counts[kind] += 1;
    }
    counts
}

/// All features moved together, by a motion that is no multiple of anything.
pub fn moved(features: &[Feature]) -> Vec<Feature> {
    let common = pose([13.0, -7.0, 29.0], [0.7, -0.4, 1.1]).eval(&[]);
    let mut features = features.to_vec();
    for copy in features.iter_mut().flat_map(|f| &mut f.copies) {
        let placed = common * copy.pose.eval(&[]);
        let (rx, ry, rz) = placed.rotation.euler_angles();
        let t = placed.translation.vector;
        copy.pose = pose([t.x, t.y, t.z], [rx, ry, rz]);
    }
    features
}
