//! Contacts between placed components at nominal, and their fits over the limits (section III of the paper).
//!
//! In: the design and the nominal solids. Out: pairs of faces on matching surfaces with opposed senses whose regions
//! overlap, each with its area, its gap at nominal, its gap at [MMC, LMC] and its range over all limits and placement zones.
//! Meshes serve only to lay regions flat; whether surfaces match, and how they fit, is decided on their parameters. Boxes
//! decide what is compared at all, so the work grows with the number of faces near each other.

use super::body::{Body, PlacedFace, middle, placed};
use super::boxes::BoxTree;
use super::matching::{Candidate, Gauge, candidate};
use super::overlap::{BINS, Chart, Flat, overlap, square_to};
use super::place::place;
use super::play::{Mating, Share};
use super::sides::{Joint, Side};
use super::squeeze::squeezed;
use super::tangent;
use crate::design::model::Design;
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3, Unit, Vector3};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;
use std::sync::Arc;

/// A face of a placed component: the surface the paper draws as a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct FaceRef {
    /// Index into [`Design::components`].
    pub component: usize,
    /// Index into [`Solid::faces`].
    pub face: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum ContactKind {
    Plane,
    Cylinder,
    Cone,
    Sphere,
    Torus,
    /// In a line or a point: a shaft on a plate, a ball in a cone.
    Tangent,
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
    /// Planes and tangents: the normal out of `a` into `b`. Cylinders, cones and tori: the axis.
    pub direction: Unit<Vector3<f64>>,
    /// A point of the plane within the contact's reach, a point on the axis, the centre of the sphere or torus, the apex of
    /// the cone, where a tangent touches (mm).
    pub point: Point3<f64>,
    /// Common area (mm²); 0 for tangents.
    pub area: f64,
    /// From where to where it reaches along `direction`, measured from the assembly's origin (mm).
    pub span: [f64; 2],
    /// Nominal gap (mm): the distance of planes, cones (square to the flank) and tangents, the difference in diameter of
    /// cylinders, spheres and tubes.
    pub gap: f64,
    /// The gap with every dimension at MMC and at LMC.
    pub gap_range: [f64; 2],
    /// The least and the largest distance of the faces (mm) over all limits and placement zones, where they come nearest;
    /// negative where they enter each other. Of round faces half a difference in diameter, less what the axes miss by.
    pub play: [f64; 2],
    /// Of cylinders, spheres and tori.
    pub fit: Option<Fit>,
    /// Which of 32 equal parts of the turn about `direction` the contact covers, one bit each.
    pub arc: u32,
    /// Half angle (rad) of cones; 0 of others.
    pub slope: f64,
    /// Whether `a` is the full one of two round faces, `b` the hollow one; true of others.
    pub full: bool,
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

    /// Whether the contact stops a component from moving in a direction: some normal out of it, into the other, points
    /// that way. Of spheres and tori only what their bodies show is known.
    pub fn stops(&self, component: usize, direction: Unit<Vector3<f64>>) -> bool {
        let out = if self.a.component == component { 1.0 } else { -1.0 };
        match self.kind {
            ContactKind::Plane | ContactKind::Tangent => out * self.direction.dot(&direction) > ALONG,
            ContactKind::Cylinder | ContactKind::Cone => self.normals().any(|n| out * n.dot(&direction) > ALONG),
            ContactKind::Sphere | ContactKind::Torus => false,
        }
    }

    /// Normals out of `a` over the arc of a cylinder or cone.
    fn normals(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let full = if self.full { 1.0 } else { -1.0 };
        let (sin, cos) = self.slope.sin_cos();
        rays(self.direction, self.arc).map(move |ray| (ray * cos - self.direction.into_inner() * sin) * full)
    }
}

/// Directions out of an axis over an arc.
fn rays(axis: Unit<Vector3<f64>>, arc: u32) -> impl Iterator<Item = Vector3<f64>> {
    let (u, v) = square_to(axis);
    (0..BINS).filter(move |k| arc >> k & 1 == 1).map(move |k| {
        let angle = (k as f64 + 0.5) * TAU / BINS as f64;
        u * angle.cos() + v * angle.sin()
    })
}

/// A direction lies along another, or in a plane, when the sine of their angle is below this.
const ALONG: f64 = 1e-3;
/// Faces closer than this touch (mm), whatever the placement zones say.
pub(crate) const TOUCH: f64 = 1e-3;
/// Regions that share less than this (mm²) touch in a line or a point only.
const LEAST_AREA: f64 = 0.01;
/// Sizes equal to this (mm) are equal: what is left after arithmetic on limits.
const ROUNDING: f64 = 1e-9;
/// Faces farther apart than this (mm) are not compared at all: wider than any placement zone in use.
const LARGEST_GAP: f64 = 2.0;
/// Axes of cylinders that miss each other by less than this share of the radius were meant to be one.
const MOST_ECCENTRIC: f64 = 0.25;
/// Faces that can enter each other by less than this (mm) over limits and zones do so by rounding.
pub(crate) const NEGLIGIBLE: f64 = 1e-4;

/// A round face that enters another at nominal, because their axes miss each other by more than the clearance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clash {
    pub a: FaceRef,
    pub b: FaceRef,
    /// mm.
    pub depth: f64,
}

/// A contact whose faces can enter each other, with what each dimension takes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tight {
    pub a: FaceRef,
    pub b: FaceRef,
    pub shares: Vec<Share>,
}

/// Contacts, and what only just fails to be one.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub contacts: Vec<Contact>,
    /// Contacts in a line or a point.
    pub tangents: Vec<Contact>,
    pub clashes: Vec<Clash>,
    /// Shafts much larger than the bores they stand in: the bore first.
    pub squeezed: Vec<Clash>,
    pub tight: Vec<Tight>,
}

/// All contacts over an area, ordered by components and faces. `solids` holds one solid per component at nominal, in its
/// own frame.
pub fn contacts(design: &Design, solids: &[Arc<Solid>]) -> Vec<Contact> {
    find(design, solids).contacts
}

/// Contacts, and clashes of round faces.
pub(crate) fn find(design: &Design, solids: &[Arc<Solid>]) -> Found {
    let mut survey = Survey::new(design, solids);
    let tree = BoxTree::new(survey.bodies.iter().map(|b| b.bounds).collect());
    for a in 0..survey.bodies.len() {
        let near = tree.meeting(&survey.bodies[a].bounds.widened(LARGEST_GAP));
        for b in near.into_iter().filter(|b| *b > a) {
            survey.between([a, b]);
        }
    }
    survey.found.drop_shared_tangents();
    survey.found
}

impl Found {
    /// Where a face touches a component over an area, that it also touches it along the rim says nothing new.
    fn drop_shared_tangents(&mut self) {
        let sides = |c: &Contact| [(c.a, c.b.component), (c.b, c.a.component)];
        let broad: BTreeSet<(FaceRef, usize)> = self.contacts.iter().flat_map(sides).collect();
        self.tangents.retain(|t| sides(t).iter().all(|side| !broad.contains(side)));
    }
}

/// The search under way.
struct Survey<'a> {
    design: &'a Design,
    poses: Vec<Isometry3<f64>>,
    bodies: Vec<Body>,
    /// Nominal; put to limits and back while a contact is looked at.
    values: Vec<f64>,
    /// MMC and LMC.
    limits: [Vec<f64>; 2],
    found: Found,
    /// Regions that broad faces share, in the first body's frame, by the faces and how the bodies stand to each other.
    known: BTreeMap<Alike, Option<Common>>,
}

/// Two solids by number with a face each, and the stance of the second.
type Alike = (usize, usize, usize, usize, [i64; 7]);

/// Two faces of two components.
type Pair<'a> = [(FaceRef, &'a PlacedFace); 2];

impl<'a> Survey<'a> {
    fn new(design: &'a Design, solids: &[Arc<Solid>]) -> Self {
        let values = design.nominal();
        let poses = place(design, &values);
        let bodies = placed(solids, &poses);
        Survey {
            design,
            bodies,
            poses,
            values,
            limits: [design.mmc(), design.lmc()],
            found: Found::default(),
            known: BTreeMap::new(),
        }
    }

    fn between(&mut self, pair: [usize; 2]) {
        let bodies = std::mem::take(&mut self.bodies);
        let joint = Joint::new(self.design, pair, &self.poses);
        let [a, b] = pair.map(|c| &bodies[c]);
        let near = |face: &(usize, &PlacedFace), other: &Body| face.1.bounds.widened(LARGEST_GAP).meets(&other.bounds);
        let theirs: Vec<(usize, &PlacedFace)> = b.faces.iter().enumerate().filter(|g| near(g, a)).collect();
        for f in a.faces.iter().enumerate().filter(|f| near(f, b)) {
            let reach = f.1.bounds.widened(LARGEST_GAP);
            for g in theirs.iter().filter(|g| g.1.bounds.meets(&reach)) {
                let face = |k: usize, (face, placed)| (FaceRef { component: pair[k], face }, placed);
                self.meet([face(0, f), face(1, *g)], [a, b], &joint);
            }
        }
        self.bodies = bodies;
    }

    /// What two faces do to each other, if they are close enough and their regions overlap.
    fn meet(&mut self, pair: Pair, bodies: [&Body; 2], joint: &Joint) {
        let Some(candidate) = candidate(pair[0].1, pair[1].1) else {
            let touch = tangent::tangent([pair[0].1, pair[1].1], bodies, pair.map(|(f, _)| f.face));
            self.found.tangents.extend(touch.map(|t| t.contact(pair.map(|(f, _)| f))));
            self.found.squeezed.extend(squeezed(pair, bodies));
            return;
        };
        let [(a, f), (b, g)] = pair;
        let near = self.is_near(&candidate, &middle(&f.bounds, &g.bounds), joint);
        let eccentric =
            candidate.kind == ContactKind::Cylinder && candidate.miss() < MOST_ECCENTRIC * radius(&f.surface);
        if !near && !eccentric {
            return;
        }
        let Some(common) = self.common(pair, bodies, &candidate) else { return };
        if near {
            self.contact(pair, bodies, &candidate, &common, joint);
        } else {
            let gap = candidate.gap.abs() / 2.0;
            let ways = common.ways(&candidate, f.outward);
            let towards = ways.iter().map(|way| way.dot(&candidate.offset) - gap).reduce(f64::max);
            let depth = towards.unwrap_or(candidate.miss());
            // Where a part of a cylinder stands off from a part of its hole there is air.
            if depth > TOUCH {
                self.found.clashes.push(Clash { a, b, depth });
            }
        }
    }

    /// The region two faces share; of broad planes that lie to each other as another pair did, what that pair shares.
    fn common(&mut self, pair: Pair, bodies: [&Body; 2], c: &Candidate) -> Option<Common> {
        let [a, b] = [0, 1].map(|k| (bodies[k], pair[k].0.face));
        let broad = c.kind == ContactKind::Plane && a.0.is_broad(a.1) && b.0.is_broad(b.1);
        if !broad {
            return Common::of(pair, bodies, c);
        }
        let key = (a.0.number, a.1, b.0.number, b.1, a.0.stance(b.0));
        let known = match self.known.get(&key) {
            Some(known) => known.clone(),
            None => Common::of(pair, bodies, c).map(|common| common.carried(&a.0.pose.inverse())),
        };
        self.known.insert(key, known.clone());
        known.map(|common| common.carried(&a.0.pose))
    }

    /// Whether the surfaces coincide, as nearly as the placement zones at that point can make up for.
    fn is_near(&mut self, c: &Candidate, at: &Point3<f64>, joint: &Joint) -> bool {
        let counts = |shift: &Vector3<f64>| match c.kind {
            ContactKind::Plane => shift.dot(&c.direction).abs(),
            ContactKind::Cylinder => (shift - c.direction.into_inner() * shift.dot(&c.direction)).norm(),
            _ => shift.norm(),
        };
        let mut slack = || joint.shifts(&mut self.values, at).iter().map(counts).sum::<f64>();
        c.miss() <= TOUCH || c.miss() <= TOUCH + slack()
    }

    fn contact(&mut self, pair: Pair, bodies: [&Body; 2], c: &Candidate, common: &Common, joint: &Joint) {
        let [(a, f), (b, g)] = pair;
        let at = middle(&f.bounds, &g.bounds);
        let on_plane = at - c.direction.into_inner() * (at - c.point).dot(&c.direction);
        let mut contact = Contact {
            a,
            b,
            kind: c.kind,
            direction: c.direction,
            point: if c.kind == ContactKind::Plane { on_plane } else { c.point },
            area: common.area,
            span: if c.kind == ContactKind::Plane { [on_plane.coords.dot(&c.direction); 2] } else { common.span },
            gap: c.gap,
            gap_range: [c.gap; 2],
            play: [c.gap; 2],
            fit: None,
            arc: common.arc,
            slope: slope(&f.surface),
            full: c.kind == ContactKind::Plane || f.outward,
        };
        let sign = if contact.full { 1.0 } else { -1.0 };
        let (probes, ways) = (common.probes(&contact), common.ways(c, contact.full));
        let gauge = Gauge { kind: c.kind, direction: c.direction, probes, sign, ways };
        let tight = self.measure(&mut contact, [(a, bodies[0]), (b, bodies[1])], &gauge, joint, [f, g]);
        self.found.tight.extend(tight);
        self.found.contacts.push(contact);
    }

    /// Gaps, fit and play, from the expressions of the two faces; nominal ones where a face has none of its own.
    fn measure(
        &mut self,
        contact: &mut Contact,
        faces: [(FaceRef, &Body); 2],
        gauge: &Gauge,
        joint: &Joint,
        placed: [&PlacedFace; 2],
    ) -> Option<Tight> {
        let nominal = gauge.drawn(&gauge.lies(&placed[0].surface, &placed[1].surface));
        contact.gap = nominal.filter(|_| contact.kind != ContactKind::Plane).unwrap_or(contact.gap);
        contact.gap_range = [contact.gap; 2];
        let side = |(f, body): (FaceRef, &Body)| {
            let part = &self.design.parts[self.design.components[f.component].part];
            Side::new(part, &body.solid.faces[f.face].name, &self.values)
        };
        let [Some(s), Some(t)] = faces.map(side) else {
            contact.fit = classify(contact);
            return None;
        };
        let mating = Mating { design: self.design, joint, sides: &[s, t], gauge };
        let at = |limit: &Vec<f64>| gauge.drawn(&mating.lies(limit)).unwrap_or(contact.gap);
        contact.gap_range = self.limits.each_ref().map(at);
        contact.fit = classify(contact);
        let play = mating.play(&mut self.values)?;
        contact.play = play.range;
        let enters = play.range[0] < -NEGLIGIBLE && contact.fit != Some(Fit::Interference);
        enters.then_some(Tight { a: contact.a, b: contact.b, shares: play.shares })
    }
}

fn radius(surface: &Surface) -> f64 {
    match surface {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => *radius,
        _ => 0.0,
    }
}

fn slope(surface: &Surface) -> f64 {
    if let Surface::Cone { half_angle, .. } = surface { *half_angle } else { 0.0 }
}

/// The region two faces share.
#[derive(Debug, Clone)]
struct Common {
    area: f64,
    /// Along the candidate's direction, from the assembly's origin (mm).
    span: [f64; 2],
    arc: u32,
    /// Of planes: points round the region.
    outline: Vec<Point3<f64>>,
}

impl Common {
    fn of([(a, f), (b, g)]: Pair, bodies: [&Body; 2], c: &Candidate) -> Option<Common> {
        if let (Some(own), Some(other)) = (f.ring, g.ring) {
            return Common::of_rings(f, own, g, other, c);
        }
        let near = f.bounds.widened(LARGEST_GAP).common(&g.bounds.widened(LARGEST_GAP));
        let chart = Chart::new(&f.surface);
        let lay = |body: &Body, face: FaceRef| -> Vec<Flat> {
            body.triangles(face.face, &near).into_iter().map(|t| chart.lay(t)).collect()
        };
        let common = overlap(&lay(bodies[0], a), &lay(bodies[1], b), chart.periods())?;
        let base = chart.origin().coords.dot(&c.direction);
        let outline = match c.kind {
            ContactKind::Plane => common.outline.map(|p| chart.on_plane(p)).to_vec(),
            _ => Vec::new(),
        };
        let span = common.reach.map(|h| base + chart.along_axis(h));
        (common.area >= LEAST_AREA).then_some(Common { area: common.area, span, arc: common.arc, outline })
    }

    /// The region of two planes after a motion.
    fn carried(&self, by: &Isometry3<f64>) -> Common {
        Common { outline: self.outline.iter().map(|p| by * p).collect(), ..self.clone() }
    }

    /// Cylinders whole all the way round share a stretch of the axis.
    fn of_rings(f: &PlacedFace, own: [f64; 2], g: &PlacedFace, other: [f64; 2], c: &Candidate) -> Option<Common> {
        let span = |face: &PlacedFace, [low, high]: [f64; 2]| {
            let base = face.surface.origin().coords.dot(&c.direction);
            if face.surface.axis().dot(&c.direction) > 0.0 {
                [base + low, base + high]
            } else {
                [base - high, base - low]
            }
        };
        let (p, q) = (span(f, own), span(g, other));
        let span = [p[0].max(q[0]), p[1].min(q[1])];
        let area = TAU * radius(&f.surface) * (span[1] - span[0]);
        (area >= LEAST_AREA).then_some(Common { area, span, arc: u32::MAX, outline: Vec::new() })
    }

    /// Of cylinders that share a part of the turn: the directions in which an offset of the second axis brings the faces nearer.
    /// `full` says that the first face is the full one.
    fn ways(&self, c: &Candidate, full: bool) -> Vec<Vector3<f64>> {
        if c.kind != ContactKind::Cylinder || self.arc == u32::MAX {
            return Vec::new();
        }
        rays(c.direction, self.arc).map(|ray| if full { -ray } else { ray }).collect()
    }

    /// Where a contact is gauged.
    fn probes(&self, contact: &Contact) -> Vec<Point3<f64>> {
        let d = contact.direction.into_inner();
        match contact.kind {
            ContactKind::Plane => self.outline.clone(),
            ContactKind::Cylinder | ContactKind::Cone => {
                self.span.map(|h| contact.point + d * (h - contact.point.coords.dot(&d))).to_vec()
            }
            _ => vec![contact.point],
        }
    }
}

/// The fit from the gaps at MMC and LMC, of faces with sizes.
fn classify(contact: &Contact) -> Option<Fit> {
    let sized = matches!(contact.kind, ContactKind::Cylinder | ContactKind::Sphere | ContactKind::Torus);
    sized.then(|| fit(contact.gap_range))
}

fn fit([mmc, lmc]: [f64; 2]) -> Fit {
    if mmc.min(lmc) >= -ROUNDING {
        Fit::Clearance
    } else if mmc.max(lmc) <= ROUNDING {
        Fit::Interference
    } else {
        Fit::Transition
    }
}

#[cfg(test)]
mod tests;
