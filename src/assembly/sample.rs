//! Assemblies for this stage's tests: plates with holes and turned pins, and the whole pattern wheel of the paper.

use crate::design::model::*;
use crate::diag::Span;
use crate::solid::{Quality, Solid, evaluate};
use crate::units::{Quantity, Range};
use std::sync::Arc;

pub(crate) struct Assembly {
    pub design: Design,
    /// One per component, at nominal.
    pub solids: Vec<Arc<Solid>>,
}

/// A round plate with round holes through it: (name, x, y, diameter).
pub(crate) fn plate(name: &str, h: f64, d: f64, holes: &[(&str, f64, f64, f64)]) -> Arc<Solid> {
    let mut shop = Shop::default();
    let cuts: Vec<Cut> = holes.iter().map(|(n, x, y, d)| Cut::hole(n, *x, *y, *d, 0.0)).collect();
    let part = shop.plate(name, [h, 0.0], [d, 0.0], &cuts);
    shop.place(name, part, [0.0; 3], 0.0, 0.0);
    shop.finish().solids.remove(0)
}

/// One copy of what is cut through a plate: a hole, or a slot of a tangential width and a radial length.
#[derive(Clone)]
pub(crate) struct Cut {
    name: String,
    at: [f64; 2],
    /// Diameter or width, and its deviations.
    size: f64,
    deviations: [f64; 2],
    /// Length and direction (rad) of a slot.
    slot: Option<[f64; 2]>,
}

impl Cut {
    pub fn hole(name: &str, x: f64, y: f64, d: f64, plus: f64) -> Self {
        Cut { name: name.into(), at: [x, y], size: d, deviations: [0.0, plus], slot: None }
    }

    /// Copies of a hole at a radius and given angles (degrees).
    pub fn holes(name: &str, r: f64, angles: &[f64], d: f64, plus: f64) -> Vec<Self> {
        angles.iter().map(|a| a.to_radians()).map(|a| Cut::hole(name, r * a.cos(), r * a.sin(), d, plus)).collect()
    }

    /// Slots at a radius: how many, the angle of the first (degrees), width with its symmetric deviation, length.
    pub fn slots(name: &str, r: f64, count: usize, from: f64, [width, dev]: [f64; 2], length: f64) -> Vec<Self> {
        let angle = |k: usize| (from + 360.0 * k as f64 / count as f64).to_radians();
        let slot = |a: f64| Cut {
            slot: Some([length, a]),
            deviations: [-dev, dev],
            ..Cut::hole(name, r * a.cos(), r * a.sin(), width, 0.0)
        };
        (0..count).map(angle).map(slot).collect()
    }
}

/// One stage of a turned pin: name, lower and upper diameter, limits of the diameter, height.
pub(crate) type Stage<'a> = (&'a str, f64, f64, [f64; 2], f64);

#[derive(Default)]
pub(crate) struct Shop {
    dims: Vec<Dimension>,
    parts: Vec<Part>,
    pub components: Vec<Component>,
}

impl Shop {
    /// A dimension with its deviations; sized ones have their material limits.
    fn dim(&mut self, name: String, nominal: f64, [minus, plus]: [f64; 2], sense: Sense) -> Expr {
        let (low, high) = (nominal + minus, nominal + plus);
        let range = Range { low, nominal: nominal.clamp(low, high), high };
        let (mmc, lmc) = match sense {
            Sense::External => (range.high, range.low),
            Sense::Internal => (range.low, range.high),
            Sense::Neutral => (range.nominal, range.nominal),
        };
        self.dims.push(Dimension { name, quantity: Quantity::Length, range, sense, mmc, lmc, span: Span::default() });
        Expr::Dim(DimId(self.dims.len() as u32 - 1))
    }

    fn part(&mut self, name: &str, features: Vec<Feature>) -> usize {
        self.parts.push(Part { name: name.into(), material: 0, features, span: Span::default() });
        self.parts.len() - 1
    }

    /// Height and diameter with their symmetric deviations; returns the part's index.
    pub fn plate(&mut self, name: &str, [h, dh]: [f64; 2], [d, dd]: [f64; 2], cuts: &[Cut]) -> usize {
        let diameter = self.dim(format!("{name}.body.d"), d, [-dd, dd], Sense::External);
        let height = self.dim(format!("{name}.body.h"), h, [-dh, dh], Sense::External);
        let body = Shape::Cylinder { d: diameter, h: Extent::Length(height) };
        let mut features = vec![feature("body", Op::Add, copy(body, [0.0; 3], 0.0))];
        for cut in cuts {
            let size = self.dim(format!("{name}.{}", cut.name), cut.size, cut.deviations, Sense::Internal);
            let made = match cut.slot {
                Some([x, turn]) => (Shape::Box { x: Expr::Const(x), y: size, z: Extent::Through }, turn),
                None => (Shape::Cylinder { d: size, h: Extent::Through }, 0.0),
            };
            let made = copy(made.0, [cut.at[0], cut.at[1], 0.0], made.1);
            match features.iter_mut().find(|f| f.name == cut.name) {
                Some(f) => {
                    f.patterned = true;
                    f.copies.push(made);
                }
                None => features.push(feature(&cut.name, Op::Cut, made)),
            }
        }
        self.part(name, features)
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
            features.push(feature(stage, Op::Add, copy(shape, [0.0, 0.0, z], 0.0)));
            z += h;
        }
        self.part(name, features)
    }

    /// A part of primitives: name, operation, shape, place; returns the part's index.
    pub fn made_of(&mut self, name: &str, features: Vec<(&str, Op, Shape, [f64; 3])>) -> usize {
        let feature = |(name, op, shape, at): (&str, Op, Shape, [f64; 3])| feature(name, op, copy(shape, at, 0.0));
        let features = features.into_iter().map(feature).collect();
        self.part(name, features)
    }

    /// A zone (mm or rad, both ways) on an axis of a placed component that has none: x, y, z, rx, ry, rz.
    pub fn vary(&mut self, component: usize, axis: usize, zone: f64) {
        let name = format!("{}.{}", self.components[component].name, ["x", "y", "z", "rx", "ry", "rz"][axis]);
        let pose = &self.components[component].pose;
        let nominal = if axis < 3 { pose.t[axis].eval(&[]) } else { pose.r[axis - 3].eval(&[]) };
        let expr = self.dim(name, nominal, [-zone, zone], Sense::Neutral);
        let pose = &mut self.components[component].pose;
        if axis < 3 { pose.t[axis] = expr } else { pose.r[axis - 3] = expr }
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
        let nominal: Vec<f64> = self.dims.iter().map(|d| d.range.nominal).collect();
        let solid = |p: &Part| evaluate(p, &nominal, &Quality::default()).map(Arc::new);
        let solids: Vec<Arc<Solid>> = self.parts.iter().map(|p| solid(p).expect("a sound part")).collect();
        let watch = (1..self.components.len()).map(|component| Watch { component, depth: None }).collect();
        Assembly {
            solids: self.components.iter().map(|c| solids[c.part].clone()).collect(),
            design: Design {
                name: "sample".into(),
                dims: self.dims,
                materials: Vec::new(),
                parts: self.parts,
                components: self.components,
                measures: Vec::new(),
                stations: Vec::new(),
                inspect: Inspect { watch, root: false, false_reject: 0.01, span: Span::default() },
                train: Train { images: 1, seed: 1, levels: 3, samples: 1, uniform: true },
            },
        }
    }
}

fn copy(shape: Shape, at: [f64; 3], turn: f64) -> FeatureCopy {
    let r = [0.0, 0.0, turn].map(Expr::Const);
    FeatureCopy { shape, pose: PoseExpr { t: at.map(Expr::Const), r } }
}

fn feature(name: &str, op: Op, copy: FeatureCopy) -> Feature {
    Feature { name: name.into(), op, patterned: false, copies: vec![copy], span: Span::default() }
}

/// The pattern wheel with the development set's dimensions.
pub(crate) fn pattern_wheel() -> Assembly {
    let mut shop = Shop::default();
    let third = [90.0, 210.0, 330.0];
    let mut holes = vec![Cut::hole("bore", 0.0, 0.0, 10.0, 0.015)];
    holes.extend(Cut::holes("pin_hole", 18.0, &third, 4.0, 0.012));
    holes.extend(Cut::slots("gap", 26.0, 36, 0.0, [2.2, 0.05], 8.0));
    let gear = shop.plate("gear", [6.0, 0.05], [50.0, 0.1], &holes);
    let shaft = shop.pin("shaft", &[("body", 10.0, 10.0, [-0.014, -0.005], 33.2), ("nose", 10.0, 8.4, [0.0; 2], 0.8)]);
    let mut holes = vec![Cut::hole("bore", 0.0, 0.0, 26.0, 0.1)];
    holes.extend(Cut::holes("pin_hole", 18.0, &third, 4.0, 0.012));
    holes.extend(Cut::slots("notch", 18.0, 1, 270.0, [5.0, 0.05], 14.0));
    let locking_ring = shop.plate("locking_ring", [3.0, 0.03], [46.0, 0.1], &holes);
    let wheel = |shop: &mut Shop, name: &str, d: f64, hole: f64| {
        let mut holes = vec![Cut::hole("bore", 0.0, 0.0, 20.0, 0.05)];
        holes.extend(Cut::holes("pin_hole", 18.0, &third, hole, 0.012));
        holes.extend(Cut::holes("hd_hole", 23.5, &[30.0], 2.5, 0.010));
        holes.extend(Cut::holes("unlatch_hole", 23.5, &[150.0], 3.5, 0.012));
        holes.extend(Cut::holes("window", 16.0, &[30.0, 150.0, 270.0], 9.0, 0.05));
        holes.extend(Cut::slots("slot", d / 2.0, 24, 7.5, [1.0, 0.03], 3.0));
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
