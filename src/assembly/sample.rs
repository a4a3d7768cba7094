//! Assemblies for this stage's tests: plates with holes and turned pins, built without the kernel.
//!
//! The pattern wheel here is the one of the development set without its teeth, slots and windows, which touch nothing.

use crate::design::model::*;
use crate::diag::Span;
use crate::solid::{Face, Solid, Surface, TriMesh};
use crate::units::{Quantity, Range};
use nalgebra::{Point3, Unit, Vector3};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Facets around a full cylinder.
const FACETS: usize = 64;

pub(crate) struct Assembly {
    pub design: Design,
    /// One per component, at nominal.
    pub solids: Vec<Arc<Solid>>,
}

/// A round plate with round holes through it: (name, x, y, diameter).
pub(crate) fn plate(name: &str, h: f64, d: f64, holes: &[(&str, f64, f64, f64)]) -> Solid {
    let mut shop = Shop::default();
    let holes: Vec<Hole> = holes.iter().map(|(n, x, y, d)| Hole::new(n, *x, *y, *d, 0.0)).collect();
    shop.plate(name, [h, 0.0], [d, 0.0], &holes);
    shop.solids.remove(0)
}

#[derive(Clone)]
pub(crate) struct Hole {
    name: String,
    at: [f64; 2],
    d: f64,
    plus: f64,
}

impl Hole {
    pub fn new(name: &str, x: f64, y: f64, d: f64, plus: f64) -> Self {
        Hole { name: name.into(), at: [x, y], d, plus }
    }

    /// Copies of a hole at a radius and given angles (degrees).
    pub fn round(name: &str, r: f64, angles: &[f64], d: f64, plus: f64) -> Vec<Self> {
        angles.iter().map(|a| a.to_radians()).map(|a| Hole::new(name, r * a.cos(), r * a.sin(), d, plus)).collect()
    }
}

/// One stage of a turned pin: name, lower and upper diameter, limits of the diameter, height.
pub(crate) type Stage<'a> = (&'a str, f64, f64, [f64; 2], f64);

#[derive(Default)]
pub(crate) struct Shop {
    pub dims: Vec<Dimension>,
    pub parts: Vec<Part>,
    pub solids: Vec<Solid>,
    pub components: Vec<Component>,
}

impl Shop {
    /// A dimension with its deviations; sized ones have their material limits.
    pub fn dim(&mut self, name: String, nominal: f64, [minus, plus]: [f64; 2], sense: Sense) -> Expr {
        let range = Range {
            low: nominal + minus,
            nominal: nominal.clamp(nominal + minus, nominal + plus),
            high: nominal + plus,
        };
        let (mmc, lmc) = match sense {
            Sense::External => (range.high, range.low),
            Sense::Internal => (range.low, range.high),
            Sense::Neutral => (range.nominal, range.nominal),
        };
        self.dims.push(Dimension { name, quantity: Quantity::Length, range, sense, mmc, lmc, span: Span::default() });
        Expr::Dim(DimId(self.dims.len() as u32 - 1))
    }

    fn part(&mut self, name: &str, features: Vec<Feature>, solid: Solid) -> usize {
        self.parts.push(Part { name: name.into(), material: 0, features, span: Span::default() });
        self.solids.push(solid);
        self.parts.len() - 1
    }

    /// Height and diameter with their symmetric deviations; returns the part's index.
    pub fn plate(&mut self, name: &str, [h, dh]: [f64; 2], [d, dd]: [f64; 2], holes: &[Hole]) -> usize {
        let diameter = self.dim(format!("{name}.body.d"), d, [-dd, dd], Sense::External);
        let height = self.dim(format!("{name}.body.h"), h, [-dh, dh], Sense::External);
        let body = Shape::Cylinder { d: diameter, h: Extent::Length(height) };
        let mut features = vec![feature("body", Op::Add, vec![(body, [0.0; 3])])];
        for hole in holes {
            let size = self.dim(format!("{name}.{}.d", hole.name), hole.d, [0.0, hole.plus], Sense::Internal);
            let shape = Shape::Cylinder { d: size, h: Extent::Through };
            let at = [hole.at[0], hole.at[1], 0.0];
            match features.iter_mut().find(|f| f.name == hole.name) {
                Some(f) => {
                    f.patterned = true;
                    f.copies.push(copy(shape, at));
                }
                None => features.push(feature(&hole.name, Op::Cut, vec![(shape, at)])),
            }
        }
        let solid = plate_solid(h, d, &features, &self.dims);
        self.part(name, features, solid)
    }

    /// A stack of stages from z = 0 upwards; returns the part's index.
    pub fn pin(&mut self, name: &str, stages: &[Stage]) -> usize {
        let (mut features, mut z) = (Vec::new(), 0.0);
        for (stage, d1, d2, limits, h) in stages {
            let d = self.dim(format!("{name}.{stage}.d"), *d1, *limits, Sense::External);
            let shape = if d1 == d2 {
                Shape::Cylinder { d, h: Extent::Length(Expr::Const(*h)) }
            } else {
                Shape::Cone { d1: d, d2: Expr::Const(*d2), h: Extent::Length(Expr::Const(*h)) }
            };
            features.push(feature(stage, Op::Add, vec![(shape, [0.0, 0.0, z])]));
            z += h;
        }
        let solid = turned_solid(stages);
        self.part(name, features, solid)
    }

    /// A component at x, y, z of the root's frame with zones on z (mm) and about z (rad).
    pub fn place(&mut self, name: &str, part: usize, at: [f64; 3], z_zone: f64, rz_zone: f64) -> usize {
        let mut pose = PoseExpr { t: at.map(Expr::Const), ..PoseExpr::identity() };
        if z_zone > 0.0 {
            pose.t[2] = self.dim(format!("{name}.z"), at[2], [-z_zone, z_zone], Sense::Neutral);
        }
        if rz_zone > 0.0 {
            pose.r[2] = self.dim(format!("{name}.rz"), 0.0, [-rz_zone, rz_zone], Sense::Neutral);
        }
        let parent = (!self.components.is_empty()).then_some(0);
        let frame = PoseExpr::identity();
        let component =
            Component { name: name.into(), part, parent, frame, pose, free: [false; 6], span: Span::default() };
        self.components.push(component);
        self.components.len() - 1
    }

    /// Watches every component but the root.
    pub fn finish(self) -> Assembly {
        let solids: Vec<Arc<Solid>> = self.solids.into_iter().map(Arc::new).collect();
        let watch = (1..self.components.len()).map(|component| Watch { component, depth: None }).collect();
        Assembly {
            solids: self.components.iter().map(|c| solids[c.part].clone()).collect(),
            design: Design {
                name: "sample".into(),
                dims: self.dims,
                materials: Vec::new(),
                parts: self.parts,
                components: self.components,
                stations: Vec::new(),
                inspect: Inspect { watch, false_reject: 0.01, span: Span::default() },
                train: Train { images: 1, seed: 1, levels: 3, samples: 1, uniform: true },
            },
        }
    }
}

fn copy(shape: Shape, at: [f64; 3]) -> FeatureCopy {
    FeatureCopy { shape, pose: PoseExpr { t: at.map(Expr::Const), ..PoseExpr::identity() } }
}

fn feature(name: &str, op: Op, copies: Vec<(Shape, [f64; 3])>) -> Feature {
    let copies = copies.into_iter().map(|(s, at)| copy(s, at)).collect();
    Feature { name: name.into(), op, patterned: false, copies, span: Span::default() }
}

fn z_up() -> Unit<Vector3<f64>> {
    Vector3::z_axis()
}

/// Collects faces and their triangles.
#[derive(Default)]
struct Draft {
    surfaces: Vec<Surface>,
    faces: Vec<Face>,
    mesh: TriMesh,
}

impl Draft {
    fn face(&mut self, surface: Surface, outward: bool, name: String, triangles: &[[Point3<f64>; 3]]) {
        let area = triangles.iter().map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).sum();
        for corners in triangles {
            let base = self.mesh.positions.len() as u32;
            let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0])).normalize();
            self.mesh.positions.extend(corners);
            self.mesh.triangles.push([base, base + 1, base + 2]);
            self.mesh.normals.push([normal; 3]);
            self.mesh.faces.push(self.faces.len() as u32);
        }
        self.surfaces.push(surface);
        self.faces.push(Face { surface: self.surfaces.len() - 1, outward, loops: Vec::new(), area, name });
    }

    fn solid(self) -> Solid {
        let area = self.faces.iter().map(|f| f.area).sum();
        let Draft { surfaces, faces, mesh } = self;
        Solid { surfaces, faces, edges: Vec::new(), vertices: Vec::new(), volume: 0.0, area, mesh }
    }
}

fn ring(centre: [f64; 2], r: f64, z: f64) -> Vec<Point3<f64>> {
    let angle = |k: usize| TAU * k as f64 / FACETS as f64;
    (0..FACETS).map(|k| Point3::new(centre[0] + r * angle(k).cos(), centre[1] + r * angle(k).sin(), z)).collect()
}

/// Facets between two rings, seen from outside (or from the axis when `inward`).
fn wall(low: &[Point3<f64>], high: &[Point3<f64>], inward: bool) -> Vec<[Point3<f64>; 3]> {
    let n = low.len();
    let quad = |k: usize| {
        let (a, b, c, d) = (low[k], low[(k + 1) % n], high[(k + 1) % n], high[k]);
        if inward { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
    };
    (0..n).flat_map(quad).collect()
}

fn plate_solid(h: f64, d: f64, features: &[Feature], dims: &[Dimension]) -> Solid {
    let nominal: Vec<f64> = dims.iter().map(|d| d.range.nominal).collect();
    let mut draft = Draft::default();
    let mut outlines = vec![([0.0; 2], d / 2.0)];
    for f in &features[1..] {
        for c in &f.copies {
            if let Shape::Cylinder { d, .. } = &c.shape {
                outlines.push(([c.pose.t[0].eval(&nominal), c.pose.t[1].eval(&nominal)], d.eval(&nominal) / 2.0));
            }
        }
    }
    let cap = triangulate(&outlines);
    let at = |z: f64, flip: bool| -> Vec<[Point3<f64>; 3]> {
        let lift = |t: &[[f64; 2]; 3]| {
            let [a, b, c] = t.map(|p| Point3::new(p[0], p[1], z));
            if flip { [a, c, b] } else { [a, b, c] }
        };
        cap.iter().map(lift).collect()
    };
    draft.face(Surface::Plane { normal: -z_up(), offset: 0.0 }, true, "body.bottom".into(), &at(0.0, true));
    draft.face(Surface::Plane { normal: z_up(), offset: h }, true, "body.top".into(), &at(h, false));
    let names = features.iter().flat_map(|f| (0..f.copies.len()).map(move |k| (f, k)));
    for ((centre, radius), (f, k)) in outlines.iter().zip(names) {
        let outward = f.op == Op::Add;
        let name = if f.patterned { format!("{}[{}].side", f.name, k + 1) } else { format!("{}.side", f.name) };
        let point = Point3::new(centre[0], centre[1], 0.0);
        let facets = wall(&ring(*centre, *radius, 0.0), &ring(*centre, *radius, h), !outward);
        draft.face(Surface::Cylinder { point, axis: z_up(), radius: *radius }, outward, name, &facets);
    }
    draft.solid()
}

/// Triangles of a disc (the first outline) without the others, counter-clockwise.
fn triangulate(outlines: &[([f64; 2], f64)]) -> Vec<[[f64; 2]; 3]> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    for (centre, r) in outlines {
        let points = ring(*centre, *r, 0.0).into_iter().map(|p| Point2::new(p.x, p.y));
        cdt.add_constraint_edges(points, true).expect("finite coordinates");
    }
    let inside = |p: [f64; 2], k: usize| {
        let polygon = ring(outlines[k].0, outlines[k].1, 0.0);
        (0..FACETS).all(|i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % FACETS]);
            (b.x - a.x) * (p[1] - a.y) - (b.y - a.y) * (p[0] - a.x) > 0.0
        })
    };
    let triangles = cdt.inner_faces().map(|f| f.positions().map(|p| [p.x, p.y]));
    triangles
        .filter(|t| {
            let centroid = [0, 1].map(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0);
            inside(centroid, 0) && !(1..outlines.len()).any(|k| inside(centroid, k))
        })
        .collect()
}

fn turned_solid(stages: &[Stage]) -> Solid {
    let mut draft = Draft::default();
    let (mut z, mut below) = (0.0, 0.0);
    for (k, (name, d1, d2, _, h)) in stages.iter().enumerate() {
        step(
            &mut draft,
            below,
            d1 / 2.0,
            z,
            [&format!("{}.top", stages[k.saturating_sub(1)].0), &format!("{name}.bottom")],
        );
        let facets = wall(&ring([0.0; 2], d1 / 2.0, z), &ring([0.0; 2], d2 / 2.0, z + h), false);
        let surface = if d1 == d2 {
            Surface::Cylinder { point: Point3::origin(), axis: z_up(), radius: d1 / 2.0 }
        } else {
            let slope = (d1 - d2) / 2.0 / h;
            Surface::Cone { apex: Point3::new(0.0, 0.0, z + d1 / 2.0 / slope), axis: -z_up(), half_angle: slope.atan() }
        };
        draft.face(surface, true, format!("{name}.side"), &facets);
        z += h;
        below = d2 / 2.0;
    }
    let last = stages.last().map_or("", |s| s.0);
    step(&mut draft, below, 0.0, z, [&format!("{last}.top"), ""]);
    draft.solid()
}

/// The level ring where the radius changes: a shoulder that faces up or down.
fn step(draft: &mut Draft, below: f64, above: f64, z: f64, [up, down]: [&str; 2]) {
    if (below - above).abs() < 1e-9 {
        return;
    }
    let (inner, outer) = (ring([0.0; 2], below.min(above), z), ring([0.0; 2], below.max(above), z));
    let faces_up = below > above;
    let facets: Vec<_> = wall(&outer, &inner, !faces_up)
        .into_iter()
        .filter(|t| (t[1] - t[0]).cross(&(t[2] - t[0])).norm() > 1e-12)
        .collect();
    let (normal, offset) = if faces_up { (z_up(), z) } else { (-z_up(), -z) };
    let name = if faces_up { up } else { down };
    draft.face(Surface::Plane { normal, offset }, true, name.to_string(), &facets);
}

/// The pattern wheel without what touches nothing.
pub(crate) fn pattern_wheel() -> Assembly {
    let mut shop = Shop::default();
    let third = [90.0, 210.0, 330.0];
    let mut holes = vec![Hole::new("bore", 0.0, 0.0, 10.0, 0.015)];
    holes.extend(Hole::round("pin_hole", 18.0, &third, 4.0, 0.012));
    let gear = shop.plate("gear", [6.0, 0.05], [50.0, 0.1], &holes);
    let shaft = shop.pin("shaft", &[("body", 10.0, 10.0, [-0.014, -0.005], 33.2), ("nose", 10.0, 8.4, [0.0; 2], 0.8)]);
    let mut holes = vec![Hole::new("bore", 0.0, 0.0, 26.0, 0.1)];
    holes.extend(Hole::round("pin_hole", 18.0, &third, 4.0, 0.012));
    let locking_ring = shop.plate("locking_ring", [3.0, 0.03], [46.0, 0.1], &holes);
    let wheel = |shop: &mut Shop, name: &str, d: f64, hole: f64| {
        let mut holes = vec![Hole::new("bore", 0.0, 0.0, 20.0, 0.05)];
        holes.extend(Hole::round("pin_hole", 18.0, &third, hole, 0.012));
        holes.extend(Hole::round("hd_hole", 23.5, &[30.0], 2.5, 0.010));
        holes.extend(Hole::round("unlatch_hole", 23.5, &[150.0], 3.5, 0.012));
        shop.plate(name, [2.0, 0.03], [d, 0.1], &holes)
    };
    let wheel_a1 = wheel(&mut shop, "wheel_a1", 56.0, 4.5);
    let wheel_a2 = wheel(&mut shop, "wheel_a2", 52.0, 3.0);
    let alignment_pin = shop.pin(
        "alignment_pin",
        &[
            ("shank", 4.0, 4.0, [-0.012, -0.004], 8.5),
            ("collar", 6.0, 6.0, [-0.03, 0.03], 3.0),
            ("guide", 4.5, 4.5, [-0.012, -0.004], 6.0),
            ("tip", 3.0, 3.0, [-0.010, -0.003], 2.2),
            ("nose", 3.0, 2.2, [0.0; 2], 0.4),
        ],
    );
    let hd_pin = shop.pin("hd_pin", &[("body", 2.5, 2.5, [-0.010, -0.003], 10.5)]);
    let unlatch_pin = shop.pin("unlatch_pin", &[("body", 3.5, 3.5, [-0.010, -0.003], 12.0)]);

    let turn = 0.03_f64.to_radians();
    let polar = |r: f64, a: f64, z: f64| [r * a.to_radians().cos(), r * a.to_radians().sin(), z];
    shop.place("gear", gear, [0.0; 3], 0.0, 0.0);
    let s = shop.place("shaft", shaft, [0.0, 0.0, -4.0], 0.2, std::f64::consts::PI);
    shop.components[s].free[5] = true;
    shop.place("locking_ring", locking_ring, [0.0, 0.0, 6.0], 0.0, turn);
    shop.place("wheel_a1", wheel_a1, [0.0, 0.0, 12.0], 0.02, turn);
    shop.place("wheel_a2", wheel_a2, [0.0, 0.0, 18.0], 0.02, turn);
    for (k, a) in third.iter().enumerate() {
        shop.place(&format!("alignment_pin[{}]", k + 1), alignment_pin, polar(18.0, *a, 0.5), 0.05, 0.0);
    }
    shop.place("hd_pin", hd_pin, polar(23.5, 30.0, 11.0), 0.05, 0.0);
    shop.place("unlatch_pin", unlatch_pin, polar(23.5, 150.0, 11.0), 0.05, 0.0);
    shop.finish()
}
