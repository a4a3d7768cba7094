//! Distances between named faces over all limits and placement zones (`measure` in the spec).
//!
//! In: the design's measures and the nominal solids. Out: per measure its nominal value, worst case, distribution and
//! contributors, and diagnostics: E0506 (nominal outside its limits), W0507 (worst case outside), E0508 (no distance between
//! such faces), E0509 (no such face). The distance is worked out from the expressions of the faces and placements.
//!
//! What is measured: between two planes, along the normal of the first, at the middle of the second face; from and to a
//! cylinder or cone, its axis, at the middle of that face; from and to a sphere or a torus, its centre. Planes and axes have
//! to be parallel. Distances to a plane change their sign when the faces change sides; others are never negative.

use super::place::place;
use super::sides::{Joint, Side, moved};
use super::stack::{Effect, Spread, Stack};
use crate::design::model::{Design, FacePath, Measure, Values};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::Serialize;
use std::sync::Arc;

/// A distance over all limits and zones. Lengths in mm, rounded to the nearest 0.1 µm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    pub name: String,
    pub from: String,
    pub to: String,
    pub nominal: f64,
    /// What it has to stay within.
    pub limits: Option<[f64; 2]>,
    /// The least and the largest it can be.
    pub worst: [f64; 2],
    /// Of the draws that images are made from.
    pub mean: f64,
    pub deviation: f64,
    /// Below which 0.135 % and 99.865 % of the draws lie.
    pub quantiles: [f64; 2],
    /// Share of the draws outside the limits.
    pub outside: f64,
    /// Who changes it, most first.
    pub contributors: Vec<Contributor>,
}

/// What one dimension does to a distance by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contributor {
    pub dimension: String,
    /// mm per mm, or mm per rad.
    pub sensitivity: f64,
    /// Over its limits (mm).
    pub range: f64,
    /// Share of the variance.
    pub variance: f64,
}

/// Every measure of the design, and what is wrong with them. `solids` holds one solid per component at nominal.
pub fn measures(design: &Design, solids: &[Arc<Solid>]) -> (Vec<Measured>, Vec<Diagnostic>) {
    let poses = place(design, &design.nominal());
    let (mut found, mut faults) = (Vec::new(), Vec::new());
    for measure in &design.measures {
        match Distance::new(design, solids, &poses, measure) {
            Ok(distance) => {
                let (measured, fault) = distance.measured(measure);
                found.push(measured);
                faults.extend(fault);
            }
            Err(fault) => faults.push(*fault),
        }
    }
    (found, faults)
}

/// Faces are parallel when the sine of their angle is below this.
const PARALLEL: f64 = 1e-4;
/// A distance may miss its limits by this much (mm): what arithmetic leaves.
const ROUNDING: f64 = 1e-9;
/// Nearer than this (mm) to a surface a point lies on it.
const ON_SURFACE: f64 = 1e-6;
/// Contributors named in a note.
const NAMED: usize = 4;

/// What of a face is measured from.
#[derive(Debug, Clone, Copy)]
enum Datum {
    /// Points p with `normal · p = offset`.
    Plane {
        normal: Unit<Vector3<f64>>,
        offset: f64,
    },
    Axis {
        point: Point3<f64>,
        direction: Unit<Vector3<f64>>,
    },
    Point(Point3<f64>),
}

impl Datum {
    fn of(surface: &Surface) -> Datum {
        match surface {
            Surface::Plane { normal, offset } => Datum::Plane { normal: *normal, offset: *offset },
            Surface::Cylinder { point, axis, .. } => Datum::Axis { point: *point, direction: *axis },
            Surface::Cone { apex, axis, .. } => Datum::Axis { point: *apex, direction: *axis },
            Surface::Sphere { centre, .. } | Surface::Torus { centre, .. } => Datum::Point(*centre),
        }
    }

    fn word(&self) -> &'static str {
        match self {
            Datum::Plane { .. } => "a plane",
            Datum::Axis { .. } => "an axis",
            Datum::Point(_) => "a centre",
        }
    }

    /// The point of it nearest to another.
    fn foot(&self, p: &Point3<f64>) -> Point3<f64> {
        match self {
            Datum::Plane { normal, offset } => p - normal.into_inner() * (normal.dot(&p.coords) - offset),
            Datum::Axis { point, direction } => point + direction.into_inner() * (p - point).dot(direction),
            Datum::Point(centre) => *centre,
        }
    }

    /// The distance of two, at a point near the second.
    fn distance(&self, to: &Datum, at: &Point3<f64>) -> f64 {
        match (self, to) {
            (Datum::Plane { normal, offset }, _) => normal.dot(&to.foot(at).coords) - offset,
            (_, Datum::Plane { normal, offset }) => offset - normal.dot(&self.foot(at).coords),
            (Datum::Axis { .. }, _) => {
                let point = to.foot(at);
                (point - self.foot(&point)).norm()
            }
            (Datum::Point(from), _) => (to.foot(from) - from).norm(),
        }
    }

    fn is_parallel(&self, to: &Datum) -> bool {
        match (self, to) {
            (Datum::Plane { normal: n, .. }, Datum::Plane { normal: m, .. }) => n.cross(m).norm() < PARALLEL,
            (Datum::Axis { direction: d, .. }, Datum::Axis { direction: e, .. }) => d.cross(e).norm() < PARALLEL,
            (Datum::Plane { normal: n, .. }, Datum::Axis { direction: d, .. })
            | (Datum::Axis { direction: d, .. }, Datum::Plane { normal: n, .. }) => n.dot(d).abs() < PARALLEL,
            _ => true,
        }
    }
}

/// Two faces whose distance can be asked for at any draw.
struct Distance<'a> {
    design: &'a Design,
    joint: Joint<'a>,
    sides: [Side; 2],
    /// The middle of the second face, in its component's frame.
    middle: Point3<f64>,
    /// Turns the nominal distance positive.
    sign: f64,
}

impl<'a> Distance<'a> {
    fn new(
        design: &'a Design,
        solids: &[Arc<Solid>],
        poses: &[Isometry3<f64>],
        measure: &Measure,
    ) -> Result<Self, Box<Diagnostic>> {
        let side = |path: &FacePath| side(design, &solids[path.component], path);
        let sides = [side(&measure.from)?, side(&measure.to)?];
        let joint = Joint::new(design, [measure.from.component, measure.to.component], poses);
        let middle = middle(&solids[measure.to.component], &measure.to.face);
        let mut distance = Distance { design, joint, sides, middle, sign: 1.0 };
        let nominal = design.nominal();
        let no_distance = || Box::new(no_distance(measure, "one of them is no surface at nominal size"));
        let (from, to, _) = distance.data(&nominal).ok_or_else(no_distance)?;
        if !from.is_parallel(&to) {
            return Err(Box::new(no_distance_between(measure, &from, &to)));
        }
        if distance.at(&nominal) < 0.0 {
            distance.sign = -1.0;
        }
        Ok(distance)
    }

    /// Both data at these dimensions, and the middle of the second face.
    fn data(&self, values: &Values) -> Option<(Datum, Datum, Point3<f64>)> {
        let poses = self.joint.poses(values);
        let datum = |k: usize| Some(Datum::of(&moved(&self.sides[k].at(values)?, &poses[k])));
        Some((datum(0)?, datum(1)?, poses[1] * self.middle))
    }

    /// Not a number where a face is no surface at these dimensions.
    fn at(&self, values: &Values) -> f64 {
        self.data(values).map_or(f64::NAN, |(from, to, at)| self.sign * from.distance(&to, &at))
    }

    fn measured(&self, measure: &Measure) -> (Measured, Option<Diagnostic>) {
        let mut dims = self.joint.dims_with_free();
        self.sides.iter().for_each(|s| s.dims(&mut dims));
        let stack = Stack { design: self.design, dims: self.joint.varying(dims), of: &|values| self.at(values) };
        let limits = measure.limits.map(|l| [l.low, l.high]);
        let spread = stack.spread(limits);
        let name = |path: &FacePath| format!("{}.{}", self.design.components[path.component].name, path.face);
        let contributor = |e: &Effect| Contributor {
            dimension: self.design.dims[e.dim.0 as usize].name.clone(),
            sensitivity: rounded(e.sensitivity),
            range: rounded(e.range),
            variance: rounded(e.variance),
        };
        let measured = Measured {
            name: measure.name.clone(),
            from: name(&measure.from),
            to: name(&measure.to),
            nominal: rounded(spread.nominal),
            limits,
            worst: spread.worst.map(rounded),
            mean: rounded(spread.mean),
            deviation: rounded(spread.deviation),
            quantiles: spread.quantiles.map(rounded),
            outside: spread.outside,
            contributors: spread.effects.iter().map(contributor).collect(),
        };
        let fault = limits.and_then(|limits| self.fault(measure, limits, &spread));
        (measured, fault)
    }

    /// E0506 or W0507.
    fn fault(&self, measure: &Measure, [low, high]: [f64; 2], spread: &Spread) -> Option<Diagnostic> {
        let beyond = |v: f64| (low - v).max(v - high);
        let [least, most] = spread.worst;
        if beyond(spread.nominal) > ROUNDING {
            let message = format!("`{}` is {:.4} at nominal, outside {low} .. {high}", measure.name, spread.nominal);
            let label =
                format!("{:.4} mm {}", beyond(spread.nominal), if spread.nominal < low { "short" } else { "too much" });
            return Some(Diagnostic::error("E0506", measure.span, message).label(label));
        }
        if beyond(least).max(beyond(most)) <= ROUNDING {
            return None;
        }
        let message = format!("`{}` can be {least:.4} to {most:.4}, outside {low} .. {high}", measure.name);
        let share = |e: &Effect| {
            let name = &self.design.dims[e.dim.0 as usize].name;
            format!("`{name}` {:.4} mm ({:.0} % of the variance)", e.range, e.variance * 100.0)
        };
        let named: Vec<String> = spread.effects.iter().take(NAMED).map(share).collect();
        let label = match spread.outside {
            0.0 => format!("at the worst; 99.73 % lie within {:.4} .. {:.4}", spread.quantiles[0], spread.quantiles[1]),
            outside => format!("at the worst; {:.2} % of the assemblies are outside", outside * 100.0),
        };
        let warning = Diagnostic::warning("W0507", measure.span, message).label(label);
        let warning = warning.note(format!("most comes from {}", named.join(", ")));
        Some(match self.cure([low, high], spread) {
            Some(help) => warning.help(help),
            None => warning,
        })
    }

    /// The share of their tolerances that all contributors may keep.
    fn cure(&self, [low, high]: [f64; 2], spread: &Spread) -> Option<String> {
        let keep = |reach: f64, room: f64| if reach > ROUNDING { (room / reach).max(0.0) } else { 1.0 };
        let below = keep(spread.nominal - spread.worst[0], spread.nominal - low);
        let above = keep(spread.worst[1] - spread.nominal, high - spread.nominal);
        let (share, top) = (below.min(above).min(1.0), spread.effects.first()?);
        let dim = &self.design.dims[top.dim.0 as usize];
        // What the others take stays; the first gives up all that is missing, if it has as much.
        let missing = (low - spread.worst[0]).max(spread.worst[1] - high);
        let half = top.range / 2.0;
        Some(if half > missing + ROUNDING && top.sensitivity != 0.0 {
            let kept = dim.range.half_width() * (half - missing) / half;
            format!("`{}` within ±{kept:.4}, or all to {:.0} % of their tolerances", dim.name, (share * 100.0).floor())
        } else {
            format!("tighten all to {:.0} % of their tolerances", (share * 100.0).floor())
        })
    }
}

/// To the nearest 0.1 µm; never a negative zero.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4 + 0.0
}

/// The face a path names; E0509 if the solid shows none on that surface.
fn side(design: &Design, solid: &Solid, path: &FacePath) -> Result<Side, Box<Diagnostic>> {
    let part = &design.parts[design.components[path.component].part];
    let nominal = design.nominal();
    let side = Side::new(part, &path.face, &nominal);
    let shown = side.as_ref().and_then(|s| s.at(&nominal)).is_some_and(|surface| shows(solid, &path.face, &surface));
    match side {
        Some(side) if shown => Ok(side),
        _ => Err(Box::new(no_face(&part.name, solid, path))),
    }
}

/// Whether a solid has a face of that name, or one that another feature's face there became one with.
fn shows(solid: &Solid, name: &str, surface: &Surface) -> bool {
    solid.faces.iter().any(|f| {
        let mut samples = f.loops.iter().flatten().flat_map(|(e, _)| &solid.edges[*e].samples).peekable();
        let lies_on = samples.peek().is_some() && samples.all(|p| surface.distance(p).abs() < ON_SURFACE);
        let alike = std::mem::discriminant(&solid.surfaces[f.surface]) == std::mem::discriminant(surface);
        f.name == name || (alike && lies_on)
    })
}

/// The middle of a face's box in the solid's frame.
fn middle(solid: &Solid, name: &str) -> Point3<f64> {
    let corners = |index: usize| solid.mesh.triangles[index].map(|i| solid.mesh.positions[i as usize]);
    let own = solid.faces.iter().position(|f| f.name == name);
    let triangles = (0..solid.mesh.triangles.len()).filter(|t| own.is_none_or(|f| solid.mesh.faces[*t] as usize == f));
    let points: Vec<Point3<f64>> = triangles.flat_map(corners).collect();
    Point3::from(super::boxes::Bounds::of(&points).centre())
}

fn no_face(part: &str, solid: &Solid, path: &FacePath) -> Diagnostic {
    let message = format!("part `{part}` shows no face `{}`", path.face);
    let fault = Diagnostic::error("E0509", path.span, message).label("no such face");
    let face = Span { start: path.span.end.saturating_sub(path.face.len() as u32), ..path.span };
    let names = || solid.faces.iter().map(|f| f.name.as_str());
    let feature = path.face.rsplit_once('.').map_or(path.face.as_str(), |(feature, _)| feature);
    let own: Vec<&str> = names().filter(|n| n.rsplit_once('.').is_some_and(|(f, _)| f == feature)).collect();
    if own.is_empty() {
        return match nearest(&path.face, names()) {
            Some(near) => fault.meant(face, near),
            None => fault.note(format!("no face of `{feature}` is left: other features took them all")),
        };
    }
    match nearest(&path.face, own.iter().copied()) {
        Some(near) => fault.meant(face, near),
        None => fault.help(format!("faces of `{feature}`: {}", own.join(", "))),
    }
}

fn no_distance(measure: &Measure, why: &str) -> Diagnostic {
    let message = format!("`{}` has no distance to measure", measure.name);
    Diagnostic::error("E0508", measure.to.span, message).label(why).also(measure.from.span, "measured from here")
}

fn no_distance_between(measure: &Measure, from: &Datum, to: &Datum) -> Diagnostic {
    no_distance(measure, &format!("{}, not parallel to the first", to.word())).note(format!(
        "from {} to {}: they have to be parallel",
        from.word(),
        to.word()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample::{Assembly, Cut, Shop};
    use crate::diag::Span;
    use crate::units::Range;

    /// Two plates 2 ±0.1 thick with a hole of 4 at (10, 0), the upper at z = 2 ±0.05 and turned by up to 0.1 rad.
    fn plates(turn: f64) -> Assembly {
        let mut shop = Shop::default();
        let mut plate =
            |name: &str| shop.plate(name, [2.0, 0.1], [30.0, 0.2], &[Cut::hole("hole", 10.0, 0.0, 4.0, 0.1)]);
        let (lower, upper) = (plate("lower"), plate("upper"));
        shop.place("lower", lower, [0.0; 3], 0.0, 0.0);
        shop.place("upper", upper, [0.0, 0.0, 2.0], 0.05, turn);
        shop.finish()
    }

    fn measure(a: &mut Assembly, from: &str, to: &str, limits: Option<Range>) -> (Option<Measured>, Vec<Diagnostic>) {
        let path = |component: usize, face: &str| FacePath { component, face: face.into(), span: Span::default() };
        let (from, to) = (path(0, from), path(1, to));
        a.design.measures = vec![Measure { name: "it".into(), from, to, limits, span: Span::default() }];
        let (mut found, faults) = measures(&a.design, &a.solids);
        (found.pop(), faults)
    }

    #[test]
    fn a_stack_of_plates_adds_up() {
        let mut a = plates(0.0);
        let (found, faults) = measure(&mut a, "body.bottom", "body.top", Some(Range::symmetric(4.0, 0.1)));
        let found = found.expect("parallel planes");
        assert_eq!((found.nominal, found.worst), (4.0, [3.85, 4.15]));
        // Uniform draws: variances of width²/12.
        let exact = ((0.2f64.powi(2) + 0.1f64.powi(2)) / 12.0).sqrt();
        assert!((found.deviation / exact - 1.0).abs() < 0.02, "{found:?}");
        assert!((found.mean - 4.0).abs() < 3e-3);
        let names: Vec<_> = found.contributors.iter().map(|c| (c.dimension.as_str(), c.range, c.sensitivity)).collect();
        assert_eq!(names, [("upper.body.h", 0.2, 1.0), ("upper.z", 0.1, 1.0)]);
        assert!((found.contributors[0].variance - 0.8).abs() < 0.01);
        // P(|x + y| > 0.1), x uniform on ±0.1 and y on ±0.05, is 1/8.
        assert!((found.outside - 0.125).abs() < 0.01, "{}", found.outside);
        assert_eq!(faults.iter().map(|d| d.code).collect::<Vec<_>>(), ["W0507"]);
        assert_eq!(faults[0].message, "`it` can be 3.8500 to 4.1500, outside 3.9 .. 4.1");
        assert_eq!(
            faults[0].help.as_deref(),
            Some("`upper.body.h` within ±0.0500, or all to 66 % of their tolerances")
        );
    }

    #[test]
    fn a_nominal_outside_its_limits_is_an_error() {
        let (_, faults) = measure(&mut plates(0.0), "body.bottom", "body.top", Some(Range::symmetric(4.2, 0.1)));
        assert_eq!((faults[0].code, faults[0].labels[0].text.as_str()), ("E0506", "0.1000 mm short"));
    }

    /// The axes of two holes at r = 10 turned against each other by 0.1 rad are a chord apart.
    #[test]
    fn a_turn_parts_axes_by_a_chord() {
        let (found, _) = measure(&mut plates(0.1), "hole.side", "hole.side", None);
        let found = found.expect("parallel axes");
        let chord = 20.0 * 0.05f64.sin();
        assert_eq!((found.nominal, found.worst[0]), (0.0, 0.0));
        assert!((found.worst[1] - chord).abs() < 1e-4, "{found:?} {chord}");
        assert_eq!(found.contributors.len(), 1);
        assert!((found.contributors[0].range - chord).abs() < 1e-4);
    }

    #[test]
    fn what_has_no_distance_says_so() {
        let (_, faults) = measure(&mut plates(0.0), "body.top", "hole.side", None);
        assert_eq!(
            (faults[0].code, faults[0].labels[0].text.as_str()),
            ("E0508", "an axis, not parallel to the first")
        );
    }

    #[test]
    fn a_face_that_is_not_there_is_looked_up() {
        let (_, faults) = measure(&mut plates(0.0), "body.tpo", "body.top", None);
        assert_eq!((faults[0].code, faults[0].help.as_deref()), ("E0509", Some("did you mean `body.top`?")));
        let (_, faults) = measure(&mut plates(0.0), "hole.bottom", "body.top", None);
        assert_eq!((faults[0].code, faults[0].help.as_deref()), ("E0509", Some("faces of `hole`: hole.side")));
    }
}
