//! The surface of a named face at any draw of the dimensions, and how far placement zones move a component.
//!
//! In: a design and values. Out: surfaces and displacements from the spec's own expressions, exact at MMC and LMC, where no
//! solid has been evaluated. Never reads a mesh.

use super::place::place;
use crate::design::model::{Design, DimId, Extent, Feature, FeatureCopy, Part, Shape, Values};
use crate::solid::Surface;
use nalgebra::{Isometry3, Point3, Unit, Vector3};

/// The surface a face named `bore[2].side`, `slab.top` or `key.+x` lies on, in the part's frame; `None` for names that are
/// no feature's own side, and for the open ends of cuts that go through.
pub(crate) fn surface_at(part: &Part, face: &str, values: &Values) -> Option<Surface> {
    let (feature, side) = face.rsplit_once('.')?;
    let copy = find_copy(part, feature)?;
    let local = primitive_side(&copy.shape, side, values)?;
    Some(moved(&local, &copy.pose.eval(values)))
}

fn find_copy<'a>(part: &'a Part, name: &str) -> Option<&'a FeatureCopy> {
    let (name, index) = match name.split_once('[') {
        Some((name, rest)) => (name, rest.strip_suffix(']')?.parse::<usize>().ok()?.checked_sub(1)?),
        None => (name, 0),
    };
    feature(part, name)?.copies.get(index)
}

/// The feature of that name.
pub(crate) fn feature<'a>(part: &'a Part, name: &str) -> Option<&'a Feature> {
    part.features.iter().find(|f| f.name == name)
}

fn primitive_side(shape: &Shape, side: &str, values: &Values) -> Option<Surface> {
    match (shape, side) {
        (Shape::Cylinder { d, .. }, "side") => {
            let radius = d.eval(values) / 2.0;
            Some(Surface::Cylinder { point: Point3::origin(), axis: Vector3::z_axis(), radius })
        }
        (Shape::Cone { d1, d2, h: Extent::Length(h) }, "side") => {
            cone_side(d1.eval(values) / 2.0, d2.eval(values) / 2.0, h.eval(values))
        }
        (Shape::Sphere { d }, _) => {
            Some(Surface::Sphere { centre: Point3::origin(), radius: d.eval(values) / 2.0, axis: Vector3::z_axis() })
        }
        (Shape::Box { x, .. }, "+x" | "-x") => Some(wall(side, Vector3::x(), x.eval(values))),
        (Shape::Box { y, .. }, "+y" | "-y") => Some(wall(side, Vector3::y(), y.eval(values))),
        (_, "bottom") => Some(Surface::Plane { normal: -Vector3::z_axis(), offset: 0.0 }),
        (_, "top") => {
            let (Shape::Box { z: h, .. } | Shape::Cylinder { h, .. } | Shape::Cone { h, .. }) = shape else {
                return None;
            };
            let Extent::Length(h) = h else { return None };
            Some(Surface::Plane { normal: Vector3::z_axis(), offset: h.eval(values) })
        }
        _ => None,
    }
}

/// A box's side on the axis of its name.
fn wall(side: &str, axis: Vector3<f64>, width: f64) -> Surface {
    let normal = Unit::new_unchecked(if side.starts_with('-') { -axis } else { axis });
    Surface::Plane { normal, offset: width / 2.0 }
}

fn cone_side(r1: f64, r2: f64, h: f64) -> Option<Surface> {
    let slope = (r1 - r2) / h;
    if slope == 0.0 || !slope.is_finite() {
        return None;
    }
    let apex = Point3::new(0.0, 0.0, r1 / slope);
    let axis = if slope > 0.0 { -Vector3::z_axis() } else { Vector3::z_axis() };
    Some(Surface::Cone { apex, axis, half_angle: slope.abs().atan() })
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

/// One axis of a component's placement zone and the poses at its two ends.
struct Zone {
    component: usize,
    /// x, y, z, rx, ry, rz.
    axis: usize,
    half_width: f64,
    low: Vec<Isometry3<f64>>,
    high: Vec<Isometry3<f64>>,
}

/// The placement zones of a design; free axes are none.
pub(crate) struct Zones {
    nominal: Vec<Isometry3<f64>>,
    zones: Vec<Zone>,
}

/// What one axis of one zone does to the gap between two components.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Slip {
    pub component: usize,
    pub axis: usize,
    /// Half the zone's width (mm or rad).
    pub half_width: f64,
    /// Largest displacement of one component against the other (mm).
    pub shift: Vector3<f64>,
}

impl Zones {
    pub fn new(design: &Design) -> Self {
        let values = design.nominal();
        let mut zones = Vec::new();
        for (component, c) in design.components.iter().enumerate() {
            for (axis, expr) in c.pose.t.iter().chain(&c.pose.r).enumerate() {
                let mut dims = Vec::new();
                expr.dims(&mut dims);
                dims.retain(|d| !c.free[axis] && varies(design, *d));
                zones.extend(dims.into_iter().map(|dim| Zone::new(design, &values, component, axis, dim)));
            }
        }
        Zones { nominal: place(design, &values), zones }
    }

    /// How every zone shifts component `a` against `b` at a point of the assembly (mm).
    pub fn slips(&self, a: usize, b: usize, at: &Point3<f64>) -> Vec<Slip> {
        let slip = |z: &Zone| {
            let end = |poses: &[Isometry3<f64>]| self.travel(a, poses, at) - self.travel(b, poses, at);
            let (low, high) = (end(&z.low), end(&z.high));
            let shift = if low.norm() > high.norm() { low } else { high };
            Slip { component: z.component, axis: z.axis, half_width: z.half_width, shift }
        };
        self.zones.iter().map(slip).filter(|s| s.shift.norm() > 0.0).collect()
    }

    fn travel(&self, component: usize, poses: &[Isometry3<f64>], at: &Point3<f64>) -> Vector3<f64> {
        poses[component] * (self.nominal[component].inverse() * at) - at
    }
}

impl Zone {
    fn new(design: &Design, values: &Values, component: usize, axis: usize, dim: DimId) -> Self {
        let range = design.dims[dim.0 as usize].range;
        let at = |value: f64| {
            let mut values = values.to_vec();
            values[dim.0 as usize] = value;
            place(design, &values)
        };
        Zone { component, axis, half_width: range.half_width(), low: at(range.low), high: at(range.high) }
    }
}

fn varies(design: &Design, dim: DimId) -> bool {
    let range = design.dims[dim.0 as usize].range;
    range.high > range.low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample;

    #[test]
    fn expressions_give_the_surfaces_of_the_solids() {
        let a = sample::pattern_wheel();
        let values = a.design.nominal();
        let mut seen = 0;
        for (component, solid) in a.design.components.iter().zip(&a.solids) {
            let part = &a.design.parts[component.part];
            for face in &solid.faces {
                let Some(surface) = surface_at(part, &face.name, &values) else { continue };
                match (&surface, &solid.surfaces[face.surface]) {
                    (Surface::Cylinder { radius: r, .. }, Surface::Cylinder { radius: s, .. }) => {
                        assert!((r - s).abs() < 1e-9, "{}", face.name);
                    }
                    (Surface::Cone { half_angle: r, .. }, Surface::Cone { half_angle: s, .. }) => {
                        assert!((r - s).abs() < 1e-12);
                    }
                    (Surface::Plane { normal: n, offset: r }, Surface::Plane { normal: m, offset: s }) => {
                        let s = s * n.dot(m).signum();
                        assert!((r - s).abs() < 1e-9, "{} {r} {s}", face.name);
                    }
                    other => panic!("{} {other:?}", face.name),
                }
                seen += 1;
            }
        }
        assert!(seen > 50, "{seen}");
    }

    #[test]
    fn a_turn_moves_a_hole_by_its_arc() {
        let a = sample::pattern_wheel();
        let zones = Zones::new(&a.design);
        let slips = zones.slips(2, 5, &Point3::new(0.0, 18.0, 7.0));
        let turn = slips.iter().find(|s| s.component == 2 && s.axis == 5).expect("the ring may turn");
        assert!((turn.shift.norm() - 18.0 * 0.03f64.to_radians()).abs() < 1e-6, "{turn:?}");
        assert!(slips.iter().all(|s| s.component == 2 || s.component == 5));
    }
}
