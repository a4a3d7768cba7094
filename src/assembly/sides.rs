//! The surface of a named face, and how two components stand to each other, at any draw of the dimensions.
//!
//! In: a design and values. Out: surfaces and poses from the spec's own expressions, exact at MMC and LMC, where no solid
//! has been evaluated, and the dimensions they depend on. Never reads a mesh.

use crate::design::model::*;
use crate::solid::{Surface, side_at};
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// A named face of a part, with no more of the part than the face depends on: asking for it takes the same time in a part
/// of one feature and in a part of a thousand.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    part: Part,
    face: String,
}

impl Side {
    /// The face named `bore[2].side`, `slab.top` or `key.+x`; `None` for a name that is no feature's own side, and for
    /// the open ends of cuts that go through.
    pub fn new(part: &Part, face: &str, nominal: &Values) -> Option<Side> {
        let own = own_feature(part, face);
        let whole = || Side { part: part.clone(), face: face.to_string() };
        own.into_iter().chain(std::iter::once_with(whole)).find(|side| side.at(nominal).is_some())
    }

    /// The surface at these dimensions, in the part's frame.
    pub fn at(&self, values: &Values) -> Option<Surface> {
        side_at(&self.part, values, &self.face)
    }

    /// Every dimension the face depends on.
    pub fn dims(&self, out: &mut Vec<DimId>) {
        self.part.features.iter().for_each(|f| feature_dims(f, out));
    }
}

/// The part reduced to the one copy of the one feature that a face belongs to.
fn own_feature(part: &Part, face: &str) -> Option<Side> {
    let end = face.find(['.', '['])?;
    let (name, rest) = face.split_at(end);
    let feature = part.features.iter().find(|f| f.name == name)?;
    let (copy, rest) = match rest.strip_prefix('[').filter(|_| feature.patterned) {
        Some(rest) => {
            let (index, rest) = rest.split_once(']')?;
            (index.parse::<usize>().ok()?.checked_sub(1)?, rest)
        }
        None => (0, rest),
    };
    let own = Feature {
        name: feature.name.clone(),
        op: Op::Add,
        patterned: false,
        copies: vec![feature.copies.get(copy)?.clone()],
        span: feature.span,
    };
    let part = Part { name: part.name.clone(), material: part.material, features: vec![own], span: part.span };
    Some(Side { part, face: format!("{name}{rest}") })
}

fn feature_dims(feature: &Feature, out: &mut Vec<DimId>) {
    for copy in &feature.copies {
        pose_dims(&copy.pose, out);
        copy.shape.exprs().into_iter().for_each(|e| e.dims(out));
        if let Shape::Group { features } = &copy.shape {
            features.iter().for_each(|f| feature_dims(f, out));
        }
    }
}

fn pose_dims(pose: &PoseExpr, out: &mut Vec<DimId>) {
    pose.t.iter().chain(&pose.r).for_each(|e| e.dims(out));
}

/// A surface carried along by a rigid motion.
pub(crate) fn moved(surface: &Surface, pose: &Isometry3<f64>) -> Surface {
    let turn = |v: &Unit<Vector3<f64>>| Unit::new_unchecked(pose.rotation * v.into_inner());
    match surface {
        Surface::Plane { normal, offset } => {
            let normal = turn(normal);
            Surface::Plane { normal, offset: offset + normal.dot(&pose.translation.vector) }
        }
        Surface::Cylinder { point, axis, radius } => {
            Surface::Cylinder { point: pose * point, axis: turn(axis), radius: *radius }
        }
        Surface::Cone { apex, axis, half_angle } => {
            Surface::Cone { apex: pose * apex, axis: turn(axis), half_angle: *half_angle }
        }
        Surface::Sphere { centre, radius, axis } => {
            Surface::Sphere { centre: pose * centre, radius: *radius, axis: turn(axis) }
        }
        Surface::Torus { centre, axis, major, minor } => {
            Surface::Torus { centre: pose * centre, axis: turn(axis), major: *major, minor: *minor }
        }
    }
}

/// Two components and the chain of placements between them: up from each to the one that carries both.
#[derive(Debug, Clone)]
pub(crate) struct Joint<'a> {
    design: &'a Design,
    /// Components of each branch, from the lowest up, without the one that carries both.
    branches: [Vec<usize>; 2],
    /// Nominal pose of the component that carries both.
    base: Isometry3<f64>,
}

impl<'a> Joint<'a> {
    /// `poses` holds every component's nominal pose.
    pub fn new(design: &'a Design, pair: [usize; 2], poses: &[Isometry3<f64>]) -> Self {
        let (mut branches, mut at) = ([Vec::new(), Vec::new()], pair.map(Some));
        // A parent stands before its children, so the later of the two is never above the other.
        while at[0] != at[1] {
            let lower = usize::from(at[1] > at[0]);
            let Some(component) = at[lower] else { break };
            branches[lower].push(component);
            at[lower] = design.components[component].parent.filter(|p| *p < component);
        }
        let base = at[0].map_or_else(Isometry3::identity, |c| poses[c]);
        Joint { design, branches, base }
    }

    /// The poses of both components at these dimensions, with what carries both at its nominal pose.
    pub fn poses(&self, values: &Values) -> [Isometry3<f64>; 2] {
        let up = |branch: &Vec<usize>| {
            branch.iter().rev().fold(self.base, |pose, c| {
                let component = &self.design.components[*c];
                pose * component.frame.eval(values) * component.pose.eval(values)
            })
        };
        self.branches.each_ref().map(up)
    }

    /// The placement zones between the two: dimensions of poses, free axes left out.
    pub fn zones(&self) -> Vec<DimId> {
        let mut dims = Vec::new();
        for c in self.branches.iter().flatten() {
            let component = &self.design.components[*c];
            let axes = component.pose.t.iter().chain(&component.pose.r).zip(component.free);
            axes.filter(|(_, free)| !free).for_each(|(e, _)| e.dims(&mut dims));
        }
        self.varying(dims)
    }

    /// Every dimension the relative pose depends on: zones, and where the features stand that components are placed on.
    pub fn dims(&self) -> Vec<DimId> {
        let mut dims = self.zones();
        self.branches.iter().flatten().for_each(|c| pose_dims(&self.design.components[*c].frame, &mut dims));
        self.varying(dims)
    }

    /// As [`Joint::dims`], free axes too.
    pub fn dims_with_free(&self) -> Vec<DimId> {
        let mut dims = self.dims();
        self.branches.iter().flatten().for_each(|c| pose_dims(&self.design.components[*c].pose, &mut dims));
        self.varying(dims)
    }

    /// Those that vary, each once, in the design's order.
    pub fn varying(&self, mut dims: Vec<DimId>) -> Vec<DimId> {
        dims.retain(|d| varies(self.design, *d));
        dims.sort_unstable();
        dims.dedup();
        dims
    }

    /// By how much each zone shifts the first component against the second at a point of the assembly, at most (mm).
    /// `values` are nominal, before and after.
    pub fn shifts(&self, values: &mut Values, at: &Point3<f64>) -> Vec<Vector3<f64>> {
        let still = self.poses(values).map(|p| p.inverse() * at);
        let mut shift = |dim: DimId| {
            let (slot, range) = (dim.0 as usize, self.design.dims[dim.0 as usize].range);
            let ends = [range.low, range.high].map(|value| {
                values[slot] = value;
                let [a, b] = self.poses(values);
                a * still[0] - b * still[1]
            });
            values[slot] = range.nominal;
            if ends[0].norm() > ends[1].norm() { ends[0] } else { ends[1] }
        };
        self.zones().into_iter().map(&mut shift).filter(|s| s.norm() > 0.0).collect()
    }
}

pub(crate) fn varies(design: &Design, dim: DimId) -> bool {
    let range = design.dims[dim.0 as usize].range;
    range.high > range.low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{place::place, sample};

    #[test]
    fn expressions_give_the_surfaces_of_the_solids() {
        let a = sample::pattern_wheel();
        let values = a.design.nominal();
        let mut seen = 0;
        for (component, solid) in a.design.components.iter().zip(&a.solids) {
            let part = &a.design.parts[component.part];
            for face in &solid.faces {
                let side = Side::new(part, &face.name, &values).unwrap_or_else(|| panic!("{}", face.name));
                let p = solid.edges[face.loops[0][0].0].samples[0];
                assert!(side.at(&values).expect("at nominal").distance(&p).abs() < 1e-6, "{}", face.name);
                seen += 1;
            }
        }
        assert!(seen > 50, "{seen}");
    }

    #[test]
    fn a_face_depends_on_its_own_feature_only() {
        let a = sample::pattern_wheel();
        let side = Side::new(&a.design.parts[0], "pin_hole[2].side", &a.design.nominal()).expect("a hole");
        let mut dims = Vec::new();
        side.dims(&mut dims);
        let names: Vec<&str> = dims.iter().map(|d| a.design.dims[d.0 as usize].name.as_str()).collect();
        assert_eq!(names, ["gear.pin_hole"]);
        assert!(Side::new(&a.design.parts[0], "pin_hole[9].side", &a.design.nominal()).is_none());
        assert!(Side::new(&a.design.parts[0], "nothing", &a.design.nominal()).is_none());
    }

    #[test]
    fn a_turn_moves_a_hole_by_its_arc() {
        let a = sample::pattern_wheel();
        let mut nominal = a.design.nominal();
        let poses = place(&a.design, &nominal);
        let joint = Joint::new(&a.design, [2, 5], &poses);
        let shifts = joint.shifts(&mut nominal, &Point3::new(0.0, 18.0, 7.0));
        assert!(shifts.iter().any(|s| (s.norm() - 18.0 * 0.03f64.to_radians()).abs() < 1e-6), "{shifts:?}");
        assert_eq!(joint.zones().len(), 2, "the ring's turn and the pin's height");
        for (pose, c) in joint.poses(&nominal).iter().zip([2, 5]) {
            assert!((pose.translation.vector - poses[c].translation.vector).norm() < 1e-12);
        }
    }
}
