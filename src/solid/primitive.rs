//! Primitives in numbers: sizes measured, sides as surfaces with a formula over them.
//!
//! In: a [`Shape`] with its pose and values. Out: [`Sized`]: bounding surfaces with their names, the formula that says where
//! the primitive is, corners of a box round it. Knows nothing of other features but for how far `through` has to reach.

use super::csg::Formula;
use super::outline::{Carrier, Profile};
use super::{Surface, tolerance};
use crate::design::model::{Expr, Extent, Shape, Values};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use std::borrow::Cow;

/// A primitive with its numbers, in the part's frame.
#[derive(Debug)]
pub(super) struct Sized {
    pose: Isometry3<f64>,
    kind: Kind,
    /// Reach along its own z; equal while `through` is not resolved.
    low: f64,
    high: f64,
}

#[derive(Debug)]
enum Kind {
    Box {
        x: f64,
        y: f64,
    },
    /// Radius at `low` and at `high`.
    Round {
        low: f64,
        high: f64,
    },
    Ball {
        radius: f64,
    },
    Ring {
        major: f64,
        minor: f64,
    },
    Prism(Profile),
    Revolve(Profile),
}

/// Bounding surface, sense as in `csg::Side`, name.
pub(super) type NamedSide = (Surface, f64, Cow<'static, str>);

/// Largest magnitude of a size or a place that the kernel's tolerances are made for, in mm.
pub(super) const LARGEST: f64 = 1e5;
/// A through feature reaches this share of the part's extent, and this many mm, beyond it at both ends.
const BEYOND: (f64, f64) = (0.05, 1.0);

impl Sized {
    /// Numbers of one shape; a `through` extent is left open. Errors say what is wrong, to follow the feature's name.
    pub fn new(shape: &Shape, pose: Isometry3<f64>, values: &Values) -> Result<Self, String> {
        let half = |e: &Expr| positive(e.eval(values)).map(|v| v / 2.0);
        let reach = |e: &Extent| match e {
            Extent::Length(e) => positive(e.eval(values)),
            Extent::Through => Ok(0.0),
        };
        let (kind, low, high) = match shape {
            Shape::Box { x, y, z } => (Kind::Box { x: half(x)?, y: half(y)? }, 0.0, reach(z)?),
            Shape::Cylinder { d, h } => {
                let radius = half(d)?;
                (Kind::Round { low: radius, high: radius }, 0.0, reach(h)?)
            }
            Shape::Cone { h: Extent::Through, .. } => {
                return Err("is a cone without a height: `through` says nothing of its slope".into());
            }
            Shape::Cone { d1, d2, h } => {
                let [low, high] = [d1, d2].map(|d| d.eval(values) / 2.0);
                positive(low.max(high))?;
                if low.is_nan() || high.is_nan() || low.min(high) < 0.0 {
                    return Err("has a negative diameter".into());
                }
                (Kind::Round { low, high }, 0.0, reach(h)?)
            }
            Shape::Sphere { d } => {
                let radius = half(d)?;
                (Kind::Ball { radius }, -radius, radius)
            }
            Shape::Torus { d, tube } => {
                let (major, minor) = (half(d)?, half(tube)?);
                if minor > major - tolerance::WELD {
                    return Err("has a tube as thick as its ring: it would close over the axis".into());
                }
                (Kind::Ring { major, minor }, -minor, minor)
            }
            Shape::Prism { outline, h } => (Kind::Prism(Profile::new(outline, values)?), 0.0, reach(h)?),
            Shape::Revolve { outline } => {
                let profile = Profile::new(outline, values)?;
                if profile.low[0] < -tolerance::POINT {
                    return Err("has an outline that reaches beyond its axis (x below zero)".into());
                }
                let (low, high) = (profile.low[1], profile.high[1]);
                (Kind::Revolve(profile), low, high)
            }
            Shape::Group { .. } => return Err("is a group inside a shape".into()),
        };
        let placed = pose.translation.vector.iter().all(|v| v.abs() <= LARGEST);
        let turned = pose.rotation.coords.iter().all(|v| v.is_finite());
        if placed && turned { Ok(Sized { pose, kind, low, high }) } else { Err("is placed out of reach".into()) }
    }

    /// Whether its height is still to be found.
    pub fn is_through(&self) -> bool {
        self.low >= self.high
    }

    /// Makes a `through` feature reach beyond these points at both ends.
    pub fn reach_through(&mut self, material: &[Point3<f64>]) {
        let back = self.pose.inverse();
        let heights = material.iter().map(|p| (back * p).z);
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), z| (a.min(z), b.max(z)));
        let (low, high) = if low < high { (low, high) } else { (0.0, 0.0) };
        let beyond = (high - low) * BEYOND.0 + BEYOND.1;
        (self.low, self.high) = (low - beyond, high + beyond);
    }

    /// Corners of a box round the primitive.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let square = |r: f64| ([-r, -r], [r, r]);
        let (low, high) = match &self.kind {
            Kind::Box { x, y } => ([-x, -y], [*x, *y]),
            Kind::Round { low, high } => square(low.max(*high)),
            Kind::Ball { radius } => square(*radius),
            Kind::Ring { major, minor } => square(major + minor),
            Kind::Prism(profile) => (profile.low, profile.high),
            Kind::Revolve(profile) => square(profile.high[0]),
        };
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
            self.pose * Point3::new(pick(0, low[0], high[0]), pick(1, low[1], high[1]), pick(2, self.low, self.high))
        })
    }

    /// Bounding surfaces, and where the primitive is in terms of them.
    pub fn sides(&self) -> (Vec<NamedSide>, Formula) {
        let z = Vector3::z();
        let ends =
            || vec![(self.flat(z, self.high), 1.0, "top".into()), (self.flat(-z, -self.low), 1.0, "bottom".into())];
        let sides: Vec<NamedSide> = match &self.kind {
            Kind::Box { x, y } => {
                let walls = [
                    ("+x", Vector3::x(), x),
                    ("-x", -Vector3::x(), x),
                    ("+y", Vector3::y(), y),
                    ("-y", -Vector3::y(), y),
                ];
                walls.iter().map(|(name, n, d)| (self.flat(*n, **d), 1.0, (*name).into())).chain(ends()).collect()
            }
            Kind::Round { low, high } => {
                // A pointed end has no face.
                let blunt = |name: &str| if name == "top" { *high > tolerance::WELD } else { *low > tolerance::WELD };
                let flank = (self.flank(*low, *high), 1.0, "side".into());
                std::iter::once(flank).chain(ends().into_iter().filter(|(_, _, name)| blunt(name))).collect()
            }
            Kind::Ball { radius } => {
                let axis = self.direction(Vector3::z());
                vec![(
                    Surface::Sphere { centre: self.pose * Point3::origin(), radius: *radius, axis },
                    1.0,
                    "side".into(),
                )]
            }
            Kind::Ring { major, minor } => vec![(self.tube(0.0, *major, *minor), 1.0, "side".into())],
            Kind::Prism(profile) => return self.prism(profile, ends()),
            Kind::Revolve(profile) => return self.revolve(profile),
        };
        let all = (0..sides.len()).map(Formula::Side).collect();
        (sides, Formula::All(all))
    }

    fn prism(&self, profile: &Profile, ends: Vec<NamedSide>) -> (Vec<NamedSide>, Formula) {
        let wall = |(carrier, name): &(Carrier, String)| {
            let surface = match carrier {
                Carrier::Line { normal, offset } => self.flat(Vector3::new(normal[0], normal[1], 0.0), *offset),
                Carrier::Circle { centre, radius } => Surface::Cylinder {
                    point: self.pose * Point3::new(centre[0], centre[1], 0.0),
                    axis: self.direction(Vector3::z()),
                    radius: *radius,
                },
            };
            (surface, 1.0, name.clone().into())
        };
        let walls = profile.carriers.len();
        let sides = profile.carriers.iter().map(wall).chain(ends).collect();
        (sides, Formula::All(vec![profile.formula.clone(), Formula::Side(walls), Formula::Side(walls + 1)]))
    }

    fn revolve(&self, profile: &Profile) -> (Vec<NamedSide>, Formula) {
        let mut sides: Vec<NamedSide> = Vec::new();
        let turned = profile.carriers.iter().map(|(carrier, name)| {
            let Some((surface, sense)) = self.turned(carrier) else { return Formula::All(Vec::new()) };
            sides.push((surface, sense, name.clone().into()));
            Formula::Side(sides.len() - 1)
        });
        let terms: Vec<Formula> = turned.collect();
        let formula = profile.formula.replaced(&terms);
        (sides, formula)
    }

    /// The surface that a line or circle of the half plane makes when it is turned, with the sense of its inside; `None`
    /// for the axis itself, beyond which there is nothing.
    fn turned(&self, carrier: &Carrier) -> Option<(Surface, f64)> {
        let axis = self.direction(Vector3::z());
        let on_axis = |z: f64| self.pose * Point3::new(0.0, 0.0, z);
        match carrier {
            Carrier::Circle { centre, radius } if centre[0].abs() < tolerance::POINT => {
                Some((Surface::Sphere { centre: on_axis(centre[1]), radius: *radius, axis }, 1.0))
            }
            Carrier::Circle { centre, radius } => Some((self.tube(centre[1], centre[0], *radius), 1.0)),
            Carrier::Line { normal: [_, n], offset } if n.abs() > 1.0 - LEVEL => {
                Some((self.flat(Vector3::z() * n.signum(), *offset), 1.0))
            }
            Carrier::Line { normal: [n, _], offset } if n.abs() > 1.0 - LEVEL => {
                let radius = offset * n.signum();
                let cylinder = Surface::Cylinder { point: on_axis(0.0), axis, radius };
                (radius > tolerance::WELD).then_some((cylinder, n.signum()))
            }
            Carrier::Line { normal: [n, m], offset } => {
                // rho n + z m < offset: a cone with its apex where rho vanishes, opening to where rho grows.
                let opens = -(m * n).signum();
                let direction = self.direction(Vector3::z() * opens);
                let half_angle = (m / n).abs().atan();
                Some((Surface::Cone { apex: on_axis(offset / m), axis: direction, half_angle }, n.signum()))
            }
        }
    }

    /// A tube about the circle of radius `major` at height `z`.
    fn tube(&self, z: f64, major: f64, minor: f64) -> Surface {
        let centre = self.pose * Point3::new(0.0, 0.0, z);
        Surface::Torus { centre, axis: self.direction(Vector3::z()), major, minor }
    }

    fn direction(&self, own: Vector3<f64>) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.pose.rotation * own)
    }

    /// The plane at `distance` from the primitive's origin along its own direction `n`.
    fn flat(&self, n: Vector3<f64>, distance: f64) -> Surface {
        let normal = self.direction(n);
        Surface::Plane { normal, offset: normal.dot(&self.pose.translation.vector) + distance }
    }

    /// The side of a cylinder or of a frustum with these end radii.
    fn flank(&self, low: f64, high: f64) -> Surface {
        let axis = self.direction(Vector3::z());
        let height = self.high - self.low;
        if (high - low).abs() < tolerance::POINT {
            return Surface::Cylinder { point: self.pose * Point3::origin(), axis, radius: low.max(high) };
        }
        let rise = self.low - height * low / (high - low);
        let half_angle = ((high - low).abs() / height).atan();
        let axis = if high > low { axis } else { -axis };
        Surface::Cone { apex: self.pose * Point3::new(0.0, 0.0, rise), axis, half_angle }
    }
}

/// A line of an outline whose normal is this near an axis (1 less its cosine) is square to it.
const LEVEL: f64 = 1e-15;

fn positive(v: f64) -> Result<f64, String> {
    if v > 10.0 * tolerance::WELD && v <= LARGEST {
        Ok(v)
    } else {
        Err("needs sizes above zero (and below 100 m)".into())
    }
}
