//! Contacts between placed components at nominal, and their fits over the limits (section III of the paper).
//!
//! In: the design and the nominal solids. Out: pairs of faces on matching surfaces with opposed senses whose regions
//! overlap, each with its area, its gap at nominal, and its gap at [MMC, LMC]. Meshes serve only to lay regions flat;
//! whether surfaces match, and how they fit, is decided on their parameters.

use super::limits::{Zones, moved, surface_at};
use super::overlap::{Chart, Flat, Overlap, overlap};
use super::place::place;
use crate::design::model::{Design, Values};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::Serialize;
use std::sync::Arc;

/// A face of a placed component: the surface the paper draws as a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct FaceRef {
    /// Index into [`Design::components`].
    pub component: usize,
    /// Index into [`Solid::faces`].
    pub face: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum ContactKind {
    Plane,
    Cylinder,
    Cone,
    Sphere,
}

/// What the limits allow between an internal and an external size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Fit {
    Clearance,
    Transition,
    Interference,
}

/// Two faces that touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// The face of the component that comes first in the design.
    pub a: FaceRef,
    pub b: FaceRef,
    pub kind: ContactKind,
    /// Planes: the normal out of `a` into `b`. Cylinders and cones: the axis.
    pub direction: Unit<Vector3<f64>>,
    /// A point of the plane within the contact's reach, a point on the axis, the centre of the sphere (mm).
    pub point: Point3<f64>,
    /// Common area (mm²).
    pub area: f64,
    /// From where to where it reaches along `direction`, measured from the assembly's origin (mm).
    pub span: [f64; 2],
    /// Nominal gap (mm): the distance of planes, the difference in diameter of cylinders and spheres. Cones: 0.
    pub gap: f64,
    /// The gap with every dimension at MMC and at LMC.
    pub gap_range: [f64; 2],
    /// Of cylinders and spheres.
    pub fit: Option<Fit>,
}

impl Contact {
    /// The face on the given component.
    pub fn on(&self, component: usize) -> Option<FaceRef> {
        [self.a, self.b].into_iter().find(|f| f.component == component)
    }

    /// The component on the other side.
    pub fn other(&self, component: usize) -> usize {
        if self.a.component == component { self.b.component } else { self.a.component }
    }

    /// From where to where along a direction the contact holds sideways (mm from the assembly's origin): cylinders with
    /// that axis only.
    pub fn sideways_span(&self, direction: Unit<Vector3<f64>>) -> Option<[f64; 2]> {
        let parallel = self.kind == ContactKind::Cylinder && self.direction.cross(&direction).norm() < ALONG;
        let [low, high] = self.span;
        parallel.then(|| if self.direction.dot(&direction) > 0.0 { [low, high] } else { [-high, -low] })
    }
}

/// An axis is along a direction when the sine of their angle is below this.
const ALONG: f64 = 1e-3;
/// Faces closer than this touch (mm), whatever the placement zones say.
const TOUCH: f64 = 1e-3;
/// Normals and axes are parallel when the sine of their angle is below this.
const PARALLEL: f64 = 1e-5;
/// The loosest pair of cylinders still called a fit: near ISO 286 H11/c11 (mm, and mm per mm of diameter).
const LOOSEST: [f64; 2] = [0.05, 0.02];
/// Regions that share less than this (mm²) touch in a line or a point only.
const LEAST_AREA: f64 = 0.01;
/// Sizes equal to this (mm) are equal: what is left after arithmetic on limits.
const ROUNDING: f64 = 1e-9;

/// A round face that enters another at nominal, because their axes miss each other by more than the clearance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clash {
    pub a: FaceRef,
    pub b: FaceRef,
    /// mm.
    pub depth: f64,
}

/// Contacts, and what only just fails to be one.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub contacts: Vec<Contact>,
    pub clashes: Vec<Clash>,
}

/// All contacts, ordered by components and faces. `solids` holds one solid per component at nominal, in its own frame.
pub fn contacts(design: &Design, solids: &[Arc<Solid>]) -> Vec<Contact> {
    find(design, solids).contacts
}

/// Contacts and clashes of round faces.
pub(crate) fn find(design: &Design, solids: &[Arc<Solid>]) -> Found {
    let zones = Zones::new(design);
    let limits = [Limit::new(design, design.mmc()), Limit::new(design, design.lmc())];
    let bodies = placed_bodies(design, solids);
    let mut found = Found::default();
    for a in 0..bodies.len() {
        for b in a + 1..bodies.len() {
            if bodies[a].bounds.meets(&bodies[b].bounds) {
                between(design, [a, b], &bodies, &zones, &limits, &mut found);
            }
        }
    }
    found
}

/// One end of the tolerance zones.
struct Limit {
    values: Vec<f64>,
    poses: Vec<Isometry3<f64>>,
}

impl Limit {
    fn new(design: &Design, values: Vec<f64>) -> Self {
        let poses = place(design, &values);
        Limit { values, poses }
    }
}

/// A component's faces in the assembly's frame.
struct Body {
    solid: Arc<Solid>,
    faces: Vec<PlacedFace>,
    bounds: Bounds,
}

struct PlacedFace {
    surface: Surface,
    outward: bool,
    triangles: Vec<[Point3<f64>; 3]>,
    bounds: Bounds,
}

#[derive(Clone, Copy)]
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Bounds {
    fn of<'a>(points: impl Iterator<Item = &'a Point3<f64>>) -> Self {
        let empty = Bounds { low: Vector3::repeat(f64::INFINITY), high: Vector3::repeat(f64::NEG_INFINITY) };
        points.fold(empty, |b, p| Bounds { low: b.low.inf(&p.coords), high: b.high.sup(&p.coords) })
    }

    /// Whether two boxes come within the largest gap that can still be a contact.
    fn meets(&self, other: &Bounds) -> bool {
        let reach = LARGEST_GAP;
        (0..3).all(|i| self.low[i] <= other.high[i] + reach && other.low[i] <= self.high[i] + reach)
    }
}

/// Faces farther apart than this (mm) are not compared at all: wider than any placement zone in use.
const LARGEST_GAP: f64 = 2.0;

fn placed_bodies(design: &Design, solids: &[Arc<Solid>]) -> Vec<Body> {
    place(design, &design.nominal()).iter().zip(solids).map(|(pose, solid)| placed_body(solid, pose)).collect()
}

fn placed_body(solid: &Arc<Solid>, pose: &Isometry3<f64>) -> Body {
    let points: Vec<Point3<f64>> = solid.mesh.positions.iter().map(|p| pose * p).collect();
    let mut triangles = vec![Vec::new(); solid.faces.len()];
    for (corners, face) in solid.mesh.triangles.iter().zip(&solid.mesh.faces) {
        triangles[*face as usize].push(corners.map(|i| points[i as usize]));
    }
    let place_face = |(face, triangles): (&crate::solid::Face, Vec<[Point3<f64>; 3]>)| PlacedFace {
        surface: moved(&solid.surfaces[face.surface], pose),
        outward: face.outward,
        bounds: Bounds::of(triangles.iter().flatten()),
        triangles,
    };
    let faces = solid.faces.iter().zip(triangles).map(place_face).collect();
    Body { solid: solid.clone(), faces, bounds: Bounds::of(points.iter()) }
}

fn between(design: &Design, pair: [usize; 2], bodies: &[Body], zones: &Zones, limits: &[Limit; 2], out: &mut Found) {
    let [a, b] = pair.map(|i| &bodies[i]);
    for (i, f) in a.faces.iter().enumerate().filter(|(_, f)| f.bounds.meets(&b.bounds)) {
        for (j, g) in b.faces.iter().enumerate() {
            if !f.bounds.meets(&g.bounds) {
                continue;
            }
            let Some(candidate) = candidate(f, g) else { continue };
            let faces = [FaceRef { component: pair[0], face: i }, FaceRef { component: pair[1], face: j }];
            match touch(faces, f, g, &candidate, zones) {
                Some(Touch::Contact(mut contact)) => {
                    contact.gap_range = gap_range(design, bodies, &contact, limits);
                    contact.fit = candidate.sized.then(|| classify(contact.gap_range));
                    out.contacts.push(contact);
                }
                Some(Touch::Clash(clash)) => out.clashes.push(clash),
                None => {}
            }
        }
    }
}

/// Two surfaces of one kind with opposed senses, and how they lie to each other.
struct Candidate {
    kind: ContactKind,
    direction: Unit<Vector3<f64>>,
    point: Point3<f64>,
    gap: f64,
    /// By how much their axes, apexes or centres miss each other (mm).
    offset: Vector3<f64>,
    /// Whether the gap is a difference of diameters.
    sized: bool,
}

fn candidate(f: &PlacedFace, g: &PlacedFace) -> Option<Candidate> {
    match (&f.surface, &g.surface) {
        (Surface::Plane { normal: n, offset: p }, Surface::Plane { normal: m, offset: q }) => {
            planes(if f.outward { (*n, *p) } else { (-*n, -p) }, if g.outward { (*m, *q) } else { (-*m, -q) })
        }
        (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: q, axis: m, radius: s }) => {
            let gap = clearance(f, g, *radius, *s)?;
            let offset = q - point - axis.into_inner() * (q - point).dot(axis);
            parallel(axis, m).then_some(Candidate { gap, offset, ..round(ContactKind::Cylinder, *axis, *point, true) })
        }
        (Surface::Cone { apex, axis, half_angle }, Surface::Cone { apex: q, axis: m, half_angle: t }) => {
            let same = parallel(axis, m) && axis.dot(m) > 0.0 && (half_angle - t).abs() < PARALLEL;
            let opposed = f.outward != g.outward;
            (same && opposed).then_some(Candidate { offset: q - apex, ..round(ContactKind::Cone, *axis, *apex, false) })
        }
        (Surface::Sphere { centre, radius, .. }, Surface::Sphere { centre: q, radius: s, .. }) => {
            let gap = clearance(f, g, *radius, *s)?;
            let shape = round(ContactKind::Sphere, Vector3::z_axis(), *centre, true);
            Some(Candidate { gap, offset: q - centre, ..shape })
        }
        _ => None,
    }
}

fn round(kind: ContactKind, direction: Unit<Vector3<f64>>, point: Point3<f64>, sized: bool) -> Candidate {
    Candidate { kind, direction, point, gap: 0.0, offset: Vector3::zeros(), sized }
}

/// Planes given by their outward normals and offsets.
fn planes((n, p): (Unit<Vector3<f64>>, f64), (m, q): (Unit<Vector3<f64>>, f64)) -> Option<Candidate> {
    let opposed = parallel(&n, &m) && n.dot(&m) < 0.0;
    let point = Point3::from(n.scale(p));
    opposed.then_some(Candidate { gap: -q - p, ..round(ContactKind::Plane, n, point, false) })
}

fn parallel(a: &Vector3<f64>, b: &Vector3<f64>) -> bool {
    a.cross(b).norm() < PARALLEL
}

/// Diameter of the hollow face less that of the full one, when there is one of each and they are of a size to fit.
fn clearance(f: &PlacedFace, g: &PlacedFace, r: f64, s: f64) -> Option<f64> {
    let gap = match (f.outward, g.outward) {
        (true, false) => 2.0 * (s - r),
        (false, true) => 2.0 * (r - s),
        _ => return None,
    };
    (gap.abs() <= LOOSEST[0] + LOOSEST[1] * 2.0 * r.min(s)).then_some(gap)
}

enum Touch {
    Contact(Contact),
    Clash(Clash),
}

/// What two candidate faces do to each other, if they are close enough and their regions overlap.
fn touch(faces: [FaceRef; 2], f: &PlacedFace, g: &PlacedFace, c: &Candidate, zones: &Zones) -> Option<Touch> {
    let at = Point3::from((f.bounds.low.sup(&g.bounds.low) + f.bounds.high.inf(&g.bounds.high)) / 2.0);
    let near = c.miss() <= TOUCH + slack(faces, c, zones, &at);
    let eccentric = c.kind == ContactKind::Cylinder && c.miss() < MOST_ECCENTRIC * radius(&f.surface);
    if !near && !eccentric {
        return None;
    }
    let chart = Chart::new(&f.surface);
    let lay = |face: &PlacedFace| -> Vec<Flat> { face.triangles.iter().map(|t| chart.lay(*t)).collect() };
    let common = overlap(&lay(f), &lay(g), chart.is_round()).filter(|o| o.area >= LEAST_AREA)?;
    let [a, b] = faces;
    if !near {
        return Some(Touch::Clash(Clash { a, b, depth: c.miss() }));
    }
    let span = span(&chart, c, &common);
    let on_plane = at - c.direction.into_inner() * (at - c.point).dot(&c.direction);
    let point = if c.kind == ContactKind::Plane { on_plane } else { c.point };
    let Candidate { kind, direction, gap, .. } = *c;
    Some(Touch::Contact(Contact {
        a,
        b,
        kind,
        direction,
        point,
        area: common.area,
        span,
        gap,
        gap_range: [gap; 2],
        fit: None,
    }))
}

/// Axes of cylinders that miss each other by less than this share of the radius were meant to be one.
const MOST_ECCENTRIC: f64 = 0.25;

impl Candidate {
    /// By how much the surfaces miss each other, beyond what their clearance allows (mm).
    fn miss(&self) -> f64 {
        match self.kind {
            ContactKind::Plane => self.gap.abs(),
            _ => self.offset.norm() - self.gap.abs() / 2.0,
        }
    }
}

fn radius(surface: &Surface) -> f64 {
    match surface {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => *radius,
        _ => 0.0,
    }
}

/// How much of a miss the placement zones can make up for at a point (mm).
fn slack(faces: [FaceRef; 2], c: &Candidate, zones: &Zones, at: &Point3<f64>) -> f64 {
    let slips = zones.slips(faces[0].component, faces[1].component, at);
    let counts = |shift: &Vector3<f64>| match c.kind {
        ContactKind::Plane => shift.dot(&c.direction).abs(),
        ContactKind::Cylinder => (shift - c.direction.into_inner() * shift.dot(&c.direction)).norm(),
        _ => shift.norm(),
    };
    slips.iter().map(|s| counts(&s.shift)).sum()
}

fn span(chart: &Chart, c: &Candidate, common: &Overlap) -> [f64; 2] {
    let base = chart.origin().coords.dot(&c.direction);
    common.reach.map(|h| base + chart.along_axis(h))
}

/// The gap at MMC and LMC, from the expressions of the two faces; the nominal gap where a face has none of its own.
fn gap_range(design: &Design, bodies: &[Body], contact: &Contact, limits: &[Limit; 2]) -> [f64; 2] {
    limits.each_ref().map(|limit| {
        let surface = |f: FaceRef| surface_of(design, &bodies[f.component], f, &limit.values);
        let (Some(s), Some(t)) = (surface(contact.a), surface(contact.b)) else { return contact.gap };
        let place = |surface: &Surface, f: FaceRef| moved(surface, &limit.poses[f.component]);
        gap(contact, &place(&s, contact.a), &place(&t, contact.b), bodies)
    })
}

fn surface_of(design: &Design, body: &Body, f: FaceRef, values: &Values) -> Option<Surface> {
    let part = &design.parts[design.components[f.component].part];
    surface_at(part, &body.solid.faces[f.face].name, values)
}

fn gap(contact: &Contact, s: &Surface, t: &Surface, bodies: &[Body]) -> f64 {
    let sign = if bodies[contact.a.component].faces[contact.a.face].outward { 1.0 } else { -1.0 };
    match (s, t) {
        (Surface::Plane { normal: n, offset: p }, Surface::Plane { normal: m, offset: q }) => {
            let along =
                |n: &Vector3<f64>, offset: f64| (offset - n.dot(&contact.point.coords)) / n.dot(&contact.direction);
            along(m, *q) - along(n, *p)
        }
        (Surface::Cylinder { radius: r, .. }, Surface::Cylinder { radius: s, .. })
        | (Surface::Sphere { radius: r, .. }, Surface::Sphere { radius: s, .. }) => sign * 2.0 * (s - r),
        _ => contact.gap,
    }
}

/// The fit from the gaps at MMC and LMC.
fn classify([mmc, lmc]: [f64; 2]) -> Fit {
    if mmc.min(lmc) >= -ROUNDING {
        Fit::Clearance
    } else if mmc.max(lmc) <= ROUNDING {
        Fit::Interference
    } else {
        Fit::Transition
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample;

    #[test]
    fn limits_decide_the_fit() {
        assert_eq!(classify([0.004, 0.024]), Fit::Clearance);
        assert_eq!(classify([-0.004, 0.012]), Fit::Transition);
        assert_eq!(classify([-0.02, -0.004]), Fit::Interference);
    }

    #[test]
    fn a_pin_in_a_hole_touches_by_its_side_over_the_plate_thickness() {
        let a = sample::pattern_wheel();
        let contacts = contacts(&a.design, &a.solids);
        let c = contacts.iter().find(|c| (c.a.component, c.b.component) == (3, 8)).expect("hd_pin in wheel_a1");
        assert_eq!((c.kind, c.fit), (ContactKind::Cylinder, Some(Fit::Clearance)));
        let exact = std::f64::consts::PI * 2.5 * 2.0;
        assert!((c.area / exact - 1.0).abs() < 1e-3, "{} {exact}", c.area);
        assert!((c.gap_range[0] - 0.003).abs() < 1e-9 && (c.gap_range[1] - 0.020).abs() < 1e-9, "{:?}", c.gap_range);
        assert!((c.span[0] - 12.0).abs() < 1e-9 && (c.span[1] - 14.0).abs() < 1e-9, "{:?}", c.span);
    }

    #[test]
    fn plates_a_little_apart_touch_only_within_their_zones() {
        for (z, zone, expected) in [(2.0, 0.0, 1), (2.05, 0.0, 0), (2.05, 0.06, 1), (1.95, 0.06, 1)] {
            let mut shop = sample::Shop::default();
            let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
            shop.place("lower", plate, [0.0; 3], 0.0, 0.0);
            shop.place("upper", plate, [5.0, 0.0, z], zone, 0.0);
            let a = shop.finish();
            assert_eq!(contacts(&a.design, &a.solids).len(), expected, "{z} {zone}");
        }
    }
}
