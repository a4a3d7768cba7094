//! Curves of two surfaces that no formula covers: found by halving boxes, then followed step by step.
//!
//! In: two surfaces and where leaves on them come near each other. Out: traced curves, and the places where the surfaces touch
//! and curves may cross. Distances change by at most the way one goes, so a box dropped for its distance holds no point of
//! both; what is left is either met at a safe angle, and followed, or so small that only touching is in question.

use super::csg::{Bounds, Tree};
use super::locus::Locus;
use super::traced::{Traced, cubic, onto};
use super::{Surface, tolerance};
use nalgebra::{Matrix3, Point3, Vector3};
use std::sync::Arc;

/// Two leaves, and a box in which they come near each other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    pub leaves: [usize; 2],
    pub bounds: Bounds,
}

/// What two surfaces share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    pub loci: Vec<Locus>,
    /// Points where the surfaces touch, or have no normal: curves may cross or end there.
    pub nodes: Vec<Point3<f64>>,
}

/// The surfaces lie so close to each other that their curve cannot be told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tangled;

/// Boxes looked at before two surfaces count as tangled.
const MOST_CELLS: usize = 400_000;
/// Half the diagonal of the smallest boxes (mm).
const FINEST: f64 = 5e-4;
/// Half the diagonal of the largest boxes that curves are looked for in, as a share of the whole.
const COARSEST: f64 = 1.0 / 12.0;
/// Boxes of half this diagonal look for a touching point; what lies nearer to one holds no curve that does not lead out (mm).
const NODE_REACH: f64 = 0.03;
/// How far a curve is followed beyond the boxes: share of the box, and mm.
const BEYOND: (f64, f64) = (0.03, 0.02);
/// A known curve along which the surfaces touch is left out with this much round it (mm).
const TOUCHING: f64 = 0.05;

/// Traces all curves of surfaces `a` and `b` near the meetings; `touching` are curves known to be touched along.
pub(super) fn trace(
    tree: &Tree,
    [a, b]: [usize; 2],
    meetings: &[Meeting],
    touching: &[Locus],
) -> Result<Shared, Tangled> {
    let surfaces = [&tree.surfaces[a], &tree.surfaces[b]];
    let mut search = Search { tree, surfaces, touching, seeds: Vec::new(), nodes: Vec::new(), cells: 0 };
    for meeting in meetings {
        search.halve(meeting)?;
    }
    let room: Vec<Bounds> = meetings.iter().map(|m| m.bounds.widened(beyond(&m.bounds))).collect();
    let walk = Walk { surfaces, nodes: &search.nodes, room: &room };
    let mut curves: Vec<Traced> = Vec::new();
    for seed in &search.seeds {
        if known(&curves, seed) {
            continue;
        }
        let Some(curve) = walk.from(seed)? else { continue };
        // A seed outside the room may lie on a known curve behind the end of it.
        let inner = &curve.points[1..curve.points.len() - 1];
        let twice = !walk.holds(seed) && inner.iter().any(|p| walk.holds(p) && known(&curves, p));
        if !twice {
            curves.push(curve);
        }
    }
    let loci = curves.into_iter().map(|c| Locus::Traced(Arc::new(c))).collect();
    Ok(Shared { loci, nodes: search.nodes })
}

/// Whether a curve passes a point. Near a node the nearest chord may be another branch's.
fn known(curves: &[Traced], p: &Point3<f64>) -> bool {
    curves.iter().any(|c| c.passages(p).iter().any(|t| (c.at(*t) - p).norm() < tolerance::WELD))
}

fn beyond(bounds: &Bounds) -> f64 {
    (bounds.high - bounds.low).norm() * BEYOND.0 + BEYOND.1
}

struct Search<'a> {
    tree: &'a Tree<'a>,
    surfaces: [&'a Surface; 2],
    touching: &'a [Locus],
    seeds: Vec<Point3<f64>>,
    nodes: Vec<Point3<f64>>,
    cells: usize,
}

impl Search<'_> {
    fn halve(&mut self, meeting: &Meeting) -> Result<(), Tangled> {
        let [first, second] = meeting.leaves.map(|l| &self.tree.leaves[l]);
        let whole = (meeting.bounds.high - meeting.bounds.low).norm() / 2.0;
        let mut open = vec![meeting.bounds];
        while let Some(cell) = open.pop() {
            self.cells += 1;
            if self.cells > MOST_CELLS {
                return Err(Tangled);
            }
            let (middle, extent) = (nalgebra::center(&cell.low, &cell.high), cell.high - cell.low);
            let reach = extent.norm() / 2.0;
            let far = self.surfaces.iter().any(|s| s.distance(&middle).abs() > reach);
            if far
                || [first, second].iter().any(|l| !self.tree.near_leaf(l, &middle, None, reach))
                || self.touched(&middle, reach)
            {
                continue;
            }
            if reach <= whole * COARSEST && self.crosses_plainly(&middle, reach) {
                let seed = onto(self.surfaces, middle);
                // Where no point of both is near, Newton's steps may end by a touching point farther off.
                let plain = self.sine(&seed) > LEAST_SINE * self.sine(&middle);
                if (seed - middle).norm() < 2.0 * reach && self.on_both(&seed) && plain {
                    self.seeds.push(seed);
                }
                continue;
            }
            if reach < NODE_REACH {
                self.node_near(&middle, reach);
                if reach < FINEST || self.nodes.iter().any(|n| (n - middle).norm() < NODE_REACH) {
                    continue;
                }
            }
            let longest = extent.imax();
            let (mut low, mut high) = (cell, cell);
            low.high[longest] = middle[longest];
            high.low[longest] = middle[longest];
            open.extend([high, low]);
        }
        Ok(())
    }

    fn on_both(&self, p: &Point3<f64>) -> bool {
        self.surfaces.iter().all(|s| s.distance(p).abs() < ON)
    }

    fn touched(&self, middle: &Point3<f64>, reach: f64) -> bool {
        self.touching.iter().any(|curve| (curve.at(curve.parameter(middle)) - middle).norm() < reach + TOUCHING)
    }

    /// Whether the normals differ so much all over the box that the surfaces cannot touch in it.
    fn crosses_plainly(&self, middle: &Point3<f64>, reach: f64) -> bool {
        let bend: f64 = self.surfaces.iter().map(|s| sharpest_bend(s, middle, reach)).sum();
        self.sine(middle) > bend * reach * 1.5
    }

    /// Of the angle of the surfaces' normals.
    fn sine(&self, p: &Point3<f64>) -> f64 {
        let [n, m] = self.surfaces.map(|s| s.normal_at(p));
        n.cross(&m).norm()
    }

    /// Remembers the place near `p` where the surfaces touch or the apex of one lies on the other, if there is one.
    fn node_near(&mut self, p: &Point3<f64>, reach: f64) {
        // Looked for once at the first scale and once at the last: in between the answer would be the same.
        if (FINEST..NODE_REACH / 2.0).contains(&reach) {
            return;
        }
        let stray = 4.0 * reach.max(FINEST);
        let [a, b] = self.surfaces;
        let apex = |s: &Surface, t: &Surface| match s {
            Surface::Cone { apex, .. } if t.distance(apex).abs() < tolerance::TOUCH => Some(*apex),
            _ => None,
        };
        let found = apex(a, b).into_iter().chain(apex(b, a)).chain(touch_near(self.surfaces, p));
        for node in found.filter(|q| (q - p).norm() < stray) {
            if self.nodes.iter().all(|n| (n - node).norm() > SAME_NODE) {
                self.nodes.push(node);
            }
        }
    }
}

/// Share of the sine in the middle of a box that the sine at a point of both surfaces in it has at least.
const LEAST_SINE: f64 = 0.1;
/// A point this near both surfaces (mm) lies on them: Newton's steps end far below.
const ON: f64 = 1e-9;
/// Nodes nearer than this (mm) are one: a touch is found to about the root of the tolerance of distances.
const SAME_NODE: f64 = 2e-3;

/// Greatest curvature (1/mm) of a surface and those beside it inside a ball.
fn sharpest_bend(surface: &Surface, middle: &Point3<f64>, reach: f64) -> f64 {
    let round = |radius: f64| 1.0 / (radius - 2.0 * reach).max(f64::MIN_POSITIVE);
    let from_axis = |p: &Point3<f64>, axis: &Vector3<f64>| (middle - p).cross(axis).norm();
    match surface {
        Surface::Plane { .. } => 0.0,
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => round(*radius),
        Surface::Cone { apex, axis, half_angle } => half_angle.cos() * round(from_axis(apex, axis)),
        Surface::Torus { centre, axis, minor, .. } => round(*minor).max(round(from_axis(centre, axis))),
    }
}

/// The point near `p` where the surfaces have a common tangent plane, if they meet there (Newton's method on the distance
/// from one surface and the two slopes of the other along it).
fn touch_near([a, b]: [&Surface; 2], p: &Point3<f64>) -> Option<Point3<f64>> {
    let mut q = *p;
    for _ in 0..30 {
        let n = a.normal_at(&q);
        let (u, v) = super::surface::across(&nalgebra::Unit::new_normalize(n));
        let residual = |x: &Point3<f64>| Vector3::new(a.distance(x), b.normal_at(x).dot(&u), b.normal_at(x).dot(&v));
        let here = Vector3::new(a.distance(&q), b.normal_at(&q).dot(&u), b.normal_at(&q).dot(&v));
        // The slopes are taken along the tangent plane of the first surface, which turns with the point: differences see it.
        let slopes = |x: &Point3<f64>| {
            let m = a.normal_at(x);
            let slope = b.normal_at(x) - m * m.dot(&b.normal_at(x));
            Vector3::new(residual(x).x, slope.dot(&u), slope.dot(&v))
        };
        let columns = [Vector3::x(), Vector3::y(), Vector3::z()]
            .map(|d| (slopes(&(q + d * STEP)) - slopes(&(q - d * STEP))) / (2.0 * STEP));
        let step = Matrix3::from_columns(&columns).try_inverse()? * here;
        let step = if step.norm() > LONGEST_STEP { step.normalize() * LONGEST_STEP } else { step };
        q -= step;
        if step.norm() < 1e-12 {
            break;
        }
    }
    let touches = a.distance(&q).abs() < tolerance::TOUCH && b.distance(&q).abs() < tolerance::TOUCH;
    let level = a.normal_at(&q).cross(&b.normal_at(&q)).norm() < LEVEL;
    (touches && level).then_some(q)
}

/// Differences are taken over this step (mm).
const STEP: f64 = 1e-5;
/// Newton's steps to a node are no longer than this (mm).
const LONGEST_STEP: f64 = 0.01;
/// Sine of the angle of the surfaces at a node.
const LEVEL: f64 = 1e-6;

/// Follows curves.
struct Walk<'a> {
    surfaces: [&'a Surface; 2],
    nodes: &'a [Point3<f64>],
    room: &'a [Bounds],
}

/// A point of a curve with its unit tangent.
type Place = (Point3<f64>, Vector3<f64>);

/// Largest turn of a step (rad), and least and greatest distance (mm) of a step from its cubic for which
/// the step is taken and the next may be longer.
const LARGEST_TURN: f64 = 0.08;
const STRAIGHT: (f64, f64) = (1e-8, 1e-7);
/// Shortest step (mm), longest step as a share of the room, most steps.
const SHORTEST: f64 = 1e-6;
const LONGEST: f64 = 1.0 / 16.0;
const MOST_STEPS: usize = 20_000;

enum End {
    Out,
    Closed,
}

impl Walk<'_> {
    /// The curve through `seed`, both ways.
    fn from(&self, seed: &Point3<f64>) -> Result<Option<Traced>, Tangled> {
        let Some(tangent) = self.tangent(seed, None) else { return Ok(None) };
        let (mut places, end) = self.one_way((*seed, tangent))?;
        let closed = matches!(end, End::Closed);
        if !closed {
            let (back, end) = self.one_way((*seed, -tangent))?;
            if matches!(end, End::Closed) {
                return Err(Tangled);
            }
            let back = back.into_iter().skip(1).map(|(p, t)| (p, -t)).collect::<Vec<_>>();
            places = back.into_iter().rev().chain(places).collect();
        }
        if places.len() < 2 {
            return Ok(None);
        }
        let (points, tangents) = places.into_iter().unzip();
        Ok(Some(Traced { surfaces: self.surfaces.map(Surface::clone), points, tangents, closed }))
    }

    fn one_way(&self, start: Place) -> Result<(Vec<Place>, End), Tangled> {
        let size = self.room.iter().map(|b| (b.high - b.low).norm()).fold(0.0, f64::max);
        let longest = size * LONGEST;
        let mut step = longest / 4.0;
        let mut places = vec![start];
        for _ in 0..MOST_STEPS {
            let here = places[places.len() - 1];
            if let Some(node) = self.node_ahead(&here, step) {
                if let Some(last) = self.reach(&here, node) {
                    places.push(last);
                    return Ok((places, End::Out));
                }
                step = step.min((node - here.0).norm() / 2.0);
            }
            match self.step(&here, step) {
                Some((next, stray)) => {
                    if places.len() > 2 && self.returns(&here, &next, &start) {
                        return Ok((places, End::Closed));
                    }
                    places.push(next);
                    if !self.holds(&next.0) {
                        return Ok((places, End::Out));
                    }
                    if stray < STRAIGHT.0 {
                        step = (step * 1.6).min(longest);
                    }
                }
                None if step < SHORTEST => return Err(Tangled),
                None => step /= 2.0,
            }
        }
        Err(Tangled)
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        self.room.iter().any(|b| b.holds(p))
    }

    /// One step, with the distance of its middle from the cubic; `None` when it is too long.
    fn step(&self, here: &Place, step: f64) -> Option<(Place, f64)> {
        let p = onto(self.surfaces, here.0 + here.1 * step);
        let moved = (p - here.0).norm();
        if !(moved > 0.5 * step && moved < 1.5 * step && self.on_both(&p)) {
            return None;
        }
        let tangent = self.tangent(&p, Some(&(here.1 + (p - here.0) / moved)))?;
        let next = (p, tangent);
        let stray = self.stray(here, &next)?;
        Some((next, stray))
    }

    /// How far the middle of the cubic between two places is from the curve; `None` when too far, or the turn too sharp.
    fn stray(&self, here: &Place, next: &Place) -> Option<f64> {
        if here.1.dot(&next.1) < LARGEST_TURN.cos() {
            return None;
        }
        let stray = |share: f64| {
            let place = cubic((&here.0, &here.1), (&next.0, &next.1), share).0;
            (onto(self.surfaces, place) - place).norm()
        };
        // Off the middle too: a curve whose bend changes strays to both sides and crosses its cubic half way.
        let worst = [0.25, 0.6].into_iter().map(stray).fold(0.0, f64::max);
        (worst < STRAIGHT.1).then_some(worst)
    }

    fn on_both(&self, p: &Point3<f64>) -> bool {
        self.surfaces.iter().all(|s| s.distance(p).abs() < ON)
    }

    /// The direction both surfaces share, on the side of `ahead`; `None` where they touch.
    fn tangent(&self, p: &Point3<f64>, ahead: Option<&Vector3<f64>>) -> Option<Vector3<f64>> {
        let [n, m] = self.surfaces.map(|s| s.normal_at(p));
        let t = n.cross(&m).try_normalize(LEVEL * 1e-3)?;
        Some(ahead.map_or(t, |ahead| t * t.dot(ahead).signum()))
    }

    /// Whether the step from `here` to `next` passes the start, in its direction.
    fn returns(&self, here: &Place, next: &Place, start: &Place) -> bool {
        let (to, step) = (start.0 - here.0, next.0 - here.0);
        let share = to.dot(&step) / step.norm_squared();
        let aside = (to - step * share).norm();
        share > 0.0 && share <= 1.0 && aside < 0.2 * step.norm() && here.1.dot(&start.1) > 0.9
            // The start may lie on a neighbouring branch: only the same one can be stepped to.
            && self.stray(here, start).is_some()
    }

    /// A node at most two steps ahead that the curve runs towards.
    fn node_ahead(&self, here: &Place, step: f64) -> Option<&Point3<f64>> {
        let ahead = |node: &&Point3<f64>| {
            let to = *node - here.0;
            let far = to.norm();
            far > 0.0 && far <= 2.0 * step && to.dot(&here.1) > 0.97 * far
        };
        self.nodes.iter().find(ahead)
    }

    /// The last step, into a node; `None` when it is too long. The surfaces touch there and tell no direction: the tangent is
    /// what an arc through both places would have.
    fn reach(&self, here: &Place, node: &Point3<f64>) -> Option<Place> {
        let chord = (node - here.0).normalize();
        let tangent = chord * (2.0 * chord.dot(&here.1)) - here.1;
        let last = (*node, tangent);
        self.stray(here, &last).map(|_| last)
    }
}
