//! Faces, edges and corners from the arrangement, with the checks that stand between a slip and a wrong solid.
//!
//! In: [`Tree`], [`Arrangement`], [`Quality`]. Out: a [`Solid`] without triangles, or diagnostics.
//! Checked here: two faces on every edge with opposite senses, every loop closed, Euler's number of every shell, one
//! body. Nothing is repaired.

use super::arrange::{Arc, Arrangement, Use};
use super::corner::sharpest;
use super::csg::{Leaf, Side, Tree};
use super::locus::Locus;
use super::measure::{self, Flux, Run};
use super::ring::{Reach, Ring, lay_out, offsets};
use super::touching::part_chords;
use super::{Edge, Face, Quality, Solid, Surface, TriMesh};
use crate::diag::Diagnostic;
use nalgebra::{Point3, Unit, Vector3};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

type Faults = Vec<Diagnostic>;

/// Why there is no solid.
#[derive(Debug)]
pub(super) enum Failure {
    /// Whatever the chords.
    Certain(Faults),
    /// Chords may cross where their curves do not: shorter ones may help.
    Coarse(Faults),
}

impl From<Faults> for Failure {
    fn from(faults: Faults) -> Self {
        Failure::Certain(faults)
    }
}
/// A surface with the sense of its faces: (surface, outward).
type Sheet = (usize, bool);
/// A loop of (edge, runs forward).
type Loop = Vec<(usize, bool)>;

/// Traces, groups, measures and checks.
pub(super) fn build(tree: &mut Tree, mut arrangement: Arrangement, quality: &Quality) -> Result<Solid, Failure> {
    check_manifold(tree, &arrangement)?;
    let vertices = compact(&mut arrangement);
    let mut edges = edges(tree, &arrangement, &vertices, quality);
    turn_spheres(tree, &arrangement, &edges);
    let tree = &*tree;
    let mut drafts = Vec::new();
    for (sheet, halves) in sheets(&arrangement.arcs) {
        let loops = trace(tree, &arrangement, sheet, &halves)?;
        drafts.extend(group(tree, sheet, loops, &edges, vertices.len()).map_err(Failure::Coarse)?);
    }
    drafts.extend(whole_surfaces(tree, &drafts));
    if drafts.is_empty() {
        return Err(vec![empty(tree)].into());
    }
    drafts.iter_mut().for_each(|d| d.owner = owner(tree, &arrangement, d));
    drafts.sort_by_key(|d| (d.owner, d.sheet, d.loops.first().and_then(|l| l.first().copied())));
    link(&mut edges, &drafts);
    check_corners(tree, &drafts, &edges, &vertices)?;
    let fluxes = fluxes(tree, &arrangement, &drafts);
    let shells = check_shells(tree, &drafts, &edges, &fluxes, &vertices)?;
    let faces = drafts.iter().zip(&fluxes).map(|(d, f)| d.face(tree, f.area)).collect();
    let (area, volume) = (fluxes.iter().map(|f| f.area).sum(), shells.iter().sum());
    let surfaces = tree.surfaces.clone();
    let solid = Solid { surfaces, faces, edges, vertices, volume, area, mesh: TriMesh::default() };
    Ok(drop_unused_surfaces(solid))
}

/// A face before it is measured.
struct Draft {
    sheet: Sheet,
    loops: Vec<Loop>,
    /// Euler's number of the face: 2 less its loops where it could lie in a plane, 0 less them where it goes round both ways
    /// of a torus.
    euler: i64,
    /// Leaf and side that name it.
    owner: (usize, usize),
}

impl Draft {
    fn face(&self, tree: &Tree, area: f64) -> Face {
        let leaf = &tree.leaves[self.owner.0];
        let name = format!("{}.{}", leaf.name, leaf.sides[self.owner.1].name);
        Face { surface: self.sheet.0, outward: self.sheet.1, loops: self.loops.clone(), area, name }
    }
}

fn empty(tree: &Tree) -> Diagnostic {
    let message = format!("nothing of `{}` is left", tree.part.name);
    let at = tree.part.features.last().map_or(tree.part.span, |f| f.span);
    Diagnostic::error("E0401", at, message).label("nothing remains after this")
}

/// An error of the kernel, not of the spec: said so, with the part's name. Tested with boundaries that were tampered with.
pub(super) fn internal(tree: &Tree, what: &str) -> Diagnostic {
    let message = format!("the boundary of `{}` cannot be closed: {what}", tree.part.name);
    Diagnostic::error("E0410", tree.part.span, message)
        .label("no solid was made of it")
        .note("a fault of the compiler, not of the spec; features that almost touch are the usual cause")
}

/// Every arc must have two faces, one on each side of its direction.
fn check_manifold(tree: &Tree, arrangement: &Arrangement) -> Result<(), Faults> {
    for arc in &arrangement.arcs {
        let forward = arc.uses.iter().filter(|u| u.forward).count();
        if arc.uses.len() == 2 && forward == 1 {
            continue;
        }
        if arc.uses.len() >= 4 {
            return Err(vec![non_manifold(tree, arrangement, arc)]);
        }
        return Err(vec![internal(tree, &format!("an edge has not two faces but {}", arc.uses.len()))]);
    }
    Ok(())
}

fn non_manifold(tree: &Tree, arrangement: &Arrangement, arc: &Arc) -> Diagnostic {
    let mut leaves: Vec<usize> = arc.uses.iter().map(|u| u.leaf).collect();
    leaves.sort_unstable();
    leaves.dedup();
    let names: Vec<String> = leaves.iter().map(|l| format!("`{}`", tree.leaves[*l].name)).collect();
    let p = arrangement.curves[arc.curve].at((arc.span[0] + arc.span[1]) / 2.0);
    let message = format!("{} of `{}` touch along a line only", names.join(" and "), tree.part.name);
    let spans = leaves.iter().map(|l| tree.leaves[*l].span);
    let last = spans.clone().next_back().unwrap_or(tree.part.span);
    let fault = Diagnostic::error("E0407", last, message)
        .note(format!("near ({:.3}, {:.3}, {:.3}) mm; let them overlap or keep them apart", p.x, p.y, p.z));
    spans.take(leaves.len().saturating_sub(1)).fold(fault, |f, span| f.also(span, "touches it"))
}

/// Keeps the corners that arcs end at, in order.
fn compact(arrangement: &mut Arrangement) -> Vec<Point3<f64>> {
    let mut place: Vec<Option<usize>> = vec![None; arrangement.corners.len()];
    arrangement.arcs.iter().flat_map(|a| a.ends).flatten().for_each(|c| place[c] = Some(0));
    let mut vertices = Vec::new();
    for (slot, p) in place.iter_mut().zip(&arrangement.corners).filter(|(s, _)| s.is_some()) {
        *slot = Some(vertices.len());
        vertices.push(*p);
    }
    for end in arrangement.arcs.iter_mut().filter_map(|a| a.ends.as_mut()).flatten() {
        *end = place[*end].unwrap_or(0);
    }
    vertices
}

fn edges(tree: &Tree, arrangement: &Arrangement, vertices: &[Point3<f64>], quality: &Quality) -> Vec<Edge> {
    let sampled = |arc: &Arc| {
        let locus = &arrangement.curves[arc.curve];
        let surfaces: Vec<&Surface> = arc.uses.iter().map(|u| &tree.surfaces[u.surface]).collect();
        finer(locus, &surfaces, quality.parameters(locus, arc.span), quality)
    };
    let mut parameters: Vec<Vec<f64>> = arrangement.arcs.iter().map(sampled).collect();
    part_chords(arrangement, &mut parameters);
    arrangement.arcs.iter().zip(&parameters).map(|(arc, at)| edge(arrangement, arc, vertices, at)).collect()
}

fn edge(arrangement: &Arrangement, arc: &Arc, vertices: &[Point3<f64>], parameters: &[f64]) -> Edge {
    let locus = &arrangement.curves[arc.curve];
    let mut samples: Vec<Point3<f64>> = parameters.iter().map(|t| locus.at(*t)).collect();
    let last = samples.len() - 1;
    match arc.ends {
        Some([a, b]) => (samples[0], samples[last]) = (vertices[a], vertices[b]),
        None => samples[last] = samples[0],
    }
    let ends = arc.ends.map_or([None, None], |e| e.map(Some));
    Edge { curve: locus.curve(arc.span), ends, faces: [usize::MAX; 2], samples }
}

/// Samples halved until between two of them the curve is as straight in the chart of either surface as it is in space: what
/// is a chord in space may be a bow in the chart, where faces are filled.
fn finer(locus: &Locus, surfaces: &[&Surface], mut parameters: Vec<f64>, quality: &Quality) -> Vec<f64> {
    let straight = |s: &&Surface| s.period().is_none() || measure::is_about(locus, s);
    let steps = parameters.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    if matches!(locus, Locus::Line { .. }) || steps < WIDEST * TAU && surfaces.iter().all(straight) {
        return parameters;
    }
    let wide = |a: f64, b: f64| {
        let places = [a, (a + b) / 2.0, b].map(|t| locus.at(t));
        surfaces.iter().any(|s| {
            let Some(period) = s.period() else { return false };
            let [from, _, to] = places.each_ref().map(|p| s.chart(p));
            let turn = to[0] - from[0];
            let turn = turn - (turn / period).round() * period;
            let middle = s.at([from[0] + turn / 2.0, (from[1] + to[1]) / 2.0]);
            turn.abs() > WIDEST * period || s.period_across().is_none() && (middle - places[1]).norm() > quality.chord
        })
    };
    for _ in 0..FINEST_HALVINGS {
        let mut next = vec![parameters[0]];
        for w in parameters.windows(2) {
            if wide(w[0], w[1]) {
                next.push((w[0] + w[1]) / 2.0);
            }
            next.push(w[1]);
        }
        if next.len() == parameters.len() {
            break;
        }
        parameters = next;
    }
    parameters
}

/// Widest turn round a surface's axis between two samples, as a share of a whole turn.
const WIDEST: f64 = 1.0 / 14.0;
/// How often a chord is halved at most: near an apex no chord is short enough.
const FINEST_HALVINGS: usize = 6;

/// Half-edges by sheet.
fn sheets(arcs: &[Arc]) -> BTreeMap<Sheet, Vec<(usize, bool)>> {
    let mut sheets: BTreeMap<Sheet, Vec<(usize, bool)>> = BTreeMap::new();
    for (i, arc) in arcs.iter().enumerate() {
        for &Use { surface, outward, forward, .. } in &arc.uses {
            sheets.entry((surface, outward)).or_default().push((i, forward));
        }
    }
    sheets
}

/// Links half-edges to loops: at each corner, the next is the first met turning clockwise from the way one came.
fn trace(tree: &Tree, arrangement: &Arrangement, sheet: Sheet, halves: &[(usize, bool)]) -> Result<Vec<Loop>, Faults> {
    let mut leaving: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (h, &(arc, forward)) in halves.iter().enumerate() {
        if let Some(ends) = arrangement.arcs[arc].ends {
            leaving.entry(ends[usize::from(!forward)]).or_default().push(h);
        }
    }
    let mut used = vec![false; halves.len()];
    let mut loops = Vec::new();
    for start in 0..halves.len() {
        let (mut here, mut path) = (start, Vec::new());
        while !used[here] {
            used[here] = true;
            path.push(halves[here]);
            let (arc, forward) = halves[here];
            let Some(ends) = arrangement.arcs[arc].ends else { break };
            let next = leaving
                .get(&ends[usize::from(forward)])
                .and_then(|choices| sharpest(tree, arrangement, sheet, halves, halves[here], choices));
            here = next.ok_or_else(|| vec![internal(tree, "a loop of edges breaks off")])?;
        }
        if !path.is_empty() {
            if here != start {
                return Err(vec![internal(tree, "a loop of edges does not return to its start")]);
            }
            loops.push(path);
        }
    }
    Ok(loops)
}

/// Sorts the loops of a sheet into faces: from the lowest point of each hole, the first loop met straight below bounds
/// the same face.
fn group(tree: &Tree, sheet: Sheet, loops: Vec<Loop>, edges: &[Edge], corners: usize) -> Result<Vec<Draft>, Faults> {
    let surface = &tree.surfaces[sheet.0];
    let offsets = offsets(corners, edges);
    let Some((_, rings)) = lay_out(surface, sheet.1, edges, &offsets, &loops) else {
        return Err(vec![internal(tree, "an edge goes round a torus both ways at once")]);
    };
    // The last place stands for the south pole or apex, and for what goes round a torus both ways.
    let south = rings.len();
    let bottomless = surface.poles()[0].is_some() || surface.period_across().is_some();
    let mut parent: Vec<usize> = (0..=south).collect();
    let reaches: Vec<Reach> = rings.iter().map(Ring::reach).collect();
    for (i, ring) in rings.iter().enumerate().filter(|(_, r)| !r.is_outer() && r.winding != 1) {
        let low = ring.lowest();
        let hit = |j: usize| rings[j].below(low).map(|v| (v, j));
        let near = (0..rings.len()).filter(|j| *j != i && reaches[*j].may_cross(low));
        let below = near.filter_map(hit).max_by(|a, b| a.0.total_cmp(&b.0));
        if below.is_none() && !bottomless {
            return Err(vec![internal(tree, "a hole lies in no face")]);
        }
        let (a, b) = (root(&parent, i), root(&parent, below.map_or(south, |b| b.1)));
        parent[a.min(b)] = a.max(b);
    }
    // What is left of a torus all round is one face: rays from one of its holes to another may go in circles.
    if surface.period_across().is_some() && rings.iter().all(|r| !r.is_outer() && r.winding == 0) {
        parent.iter_mut().for_each(|p| *p = south);
    }
    let mut faces: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    (0..south).for_each(|i| faces.entry(root(&parent, i)).or_default().push(i));
    faces.into_values().map(|members| draft(tree, sheet, &members, &rings, &loops)).collect()
}

fn root(parent: &[usize], mut i: usize) -> usize {
    while parent[i] != i {
        i = parent[i];
    }
    i
}

fn draft(tree: &Tree, sheet: Sheet, members: &[usize], rings: &[Ring], loops: &[Loop]) -> Result<Draft, Faults> {
    let surface = &tree.surfaces[sheet.0];
    let winding: i32 = members.iter().map(|i| rings[*i].winding).sum();
    let outers = members.iter().filter(|i| rings[**i].is_outer()).count();
    let winds = members.iter().filter(|i| rings[**i].winding != 0).count();
    let [south, north] = surface.poles().map(|p| p.is_some());
    let torus = surface.period_across().is_some();
    let sound = match (outers, winds, winding) {
        (1, 0, _) => true,
        (0, 2, 0) => true,
        (0, 1, -1) => south,
        (0, 1, 1) => north,
        (0, 0, _) => south && north || torus,
        _ => false,
    };
    if !sound {
        return Err(vec![internal(tree, "loops of edges do not bound a face")]);
    }
    let mut order = members.to_vec();
    order.sort_by_key(|i| (!rings[*i].is_outer() && rings[*i].winding != 1, *i));
    let loops: Vec<Loop> = order.iter().map(|i| loops[*i].clone()).collect();
    let euler = if torus && outers + winds == 0 { 0 } else { 2 } - loops.len() as i64;
    Ok(Draft { sheet, loops, euler, owner: (0, 0) })
}

/// Spheres and tori that nothing cuts have no edge to be found by: one point decides.
fn whole_surfaces(tree: &Tree, drafts: &[Draft]) -> Vec<Draft> {
    let whole = |(i, surface): (usize, &Surface)| {
        let p = match surface {
            Surface::Sphere { centre, radius, .. } => centre + Vector3::new(0.48, 0.6, 0.64) * *radius,
            Surface::Torus { major, minor, .. } => surface.at([0.37 * minor, 0.53 * (major + minor)]),
            _ => return None,
        };
        if drafts.iter().any(|d| d.sheet.0 == i) {
            return None;
        }
        let holds = |leaf: usize, side: f64| {
            let Leaf { sides, formula, .. } = &tree.leaves[leaf];
            formula.holds(&|k| {
                let s = &sides[k];
                let d = if s.surface == i { side } else { tree.surfaces[s.surface].distance(&p) };
                d * s.sense < 0.0
            })
        };
        let inside = |side: f64| tree.inside((0..tree.leaves.len()).filter(|l| holds(*l, side)));
        let (below, above) = (inside(-1.0), inside(1.0));
        let euler = if surface.period_across().is_some() { 0 } else { 2 };
        let draft = Draft { sheet: (i, below), loops: Vec::new(), euler, owner: (0, 0) };
        (below != above).then_some(draft)
    };
    tree.surfaces.iter().enumerate().filter_map(whole).collect()
}

/// Directions that the axis of a sphere's chart is chosen from.
const AXES: usize = 48;

/// Turns the chart of every sphere so that its poles lie as far from its edges as can be.
fn turn_spheres(tree: &mut Tree, arrangement: &Arrangement, edges: &[Edge]) {
    for (i, surface) in tree.surfaces.iter_mut().enumerate() {
        let Surface::Sphere { centre, axis, .. } = surface else { continue };
        let own = arrangement.arcs.iter().zip(edges).filter(|(arc, _)| arc.uses.iter().any(|u| u.surface == i));
        let points: Vec<Vector3<f64>> = own.flat_map(|(_, e)| &e.samples).map(|p| (p - *centre).normalize()).collect();
        let nearest = |d: &Vector3<f64>| points.iter().map(|p| p.dot(d).abs()).fold(0.0, f64::max);
        // The axis it has is kept unless another is clearly better.
        let mut best = (nearest(axis) - 0.05, *axis);
        for k in 0..AXES {
            let (z, turn) = ((k as f64 + 0.5) / AXES as f64, k as f64 * GOLDEN_ANGLE);
            let flat = (1.0 - z * z).sqrt();
            let d = Unit::new_normalize(Vector3::new(flat * turn.cos(), flat * turn.sin(), z));
            let near = nearest(&d);
            if near < best.0 {
                best = (near, d);
            }
        }
        *axis = best.1;
    }
}

/// Turn from one direction to the next on a spiral that covers a sphere evenly (rad).
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Leaf and side that a face is named after: the first in source order.
fn owner(tree: &Tree, arrangement: &Arrangement, draft: &Draft) -> (usize, usize) {
    let of_half = |&(arc, forward): &(usize, bool)| {
        let mine = |u: &&Use| (u.surface, u.outward) == draft.sheet && u.forward == forward;
        arrangement.arcs[arc].uses.iter().find(mine).map(|u| u.leaf)
    };
    let named = |s: &Side| s.surface == draft.sheet.0 && !s.name.is_empty();
    let side = |leaf: usize| tree.leaves[leaf].sides.iter().position(named);
    let first = draft.loops.iter().flatten().filter_map(of_half).min();
    let leaf = first.or_else(|| (0..tree.leaves.len()).find(|l| side(*l).is_some())).unwrap_or(0);
    (leaf, side(leaf).unwrap_or(0))
}

/// Tells every edge its faces, the one it runs forward along first.
fn link(edges: &mut [Edge], drafts: &[Draft]) {
    for (face, draft) in drafts.iter().enumerate() {
        for &(edge, forward) in draft.loops.iter().flatten() {
            edges[edge].faces[usize::from(!forward)] = face;
        }
    }
}

/// Round every corner, faces and edges must follow each other in one ring.
fn check_corners(tree: &Tree, drafts: &[Draft], edges: &[Edge], vertices: &[Point3<f64>]) -> Result<(), Faults> {
    // The ends of edges: twice the edge, one more for its far end.
    let mut parent: Vec<usize> = (0..2 * edges.len()).collect();
    for path in drafts.iter().flat_map(|d| &d.loops) {
        for (i, &(edge, forward)) in path.iter().enumerate() {
            let (next, next_forward) = path[(i + 1) % path.len()];
            let (a, b) = (2 * edge + usize::from(forward), 2 * next + usize::from(!next_forward));
            let (a, b) = (root(&parent, a), root(&parent, b));
            parent[a.max(b)] = a.min(b);
        }
    }
    let mut ring_at: Vec<Option<usize>> = vec![None; vertices.len()];
    for end in 0..2 * edges.len() {
        let Some(corner) = edges[end / 2].ends[end % 2] else { continue };
        let ring = root(&parent, end);
        if *ring_at[corner].get_or_insert(ring) != ring {
            let p = vertices[corner];
            let message = format!("`{}` touches itself in a point only", tree.part.name);
            let fault = Diagnostic::error("E0407", tree.part.span, message);
            return Err(vec![fault.note(format!("at ({:.3}, {:.3}, {:.3}) mm", p.x, p.y, p.z))]);
        }
    }
    Ok(())
}

fn fluxes(tree: &Tree, arrangement: &Arrangement, drafts: &[Draft]) -> Vec<Flux> {
    // Seen from the middle of the part, the cones from the faces nearly cancel less.
    let all = tree.leaves.iter().fold(Vector3::zeros(), |s, l| s + l.bounds.low.coords + l.bounds.high.coords);
    let from = Point3::from(all / (2.0 * tree.leaves.len().max(1) as f64));
    let run = |&(arc, forward): &(usize, bool)| {
        let arc = &arrangement.arcs[arc];
        Run { locus: &arrangement.curves[arc.curve], span: arc.span, forward }
    };
    let flux = |draft: &Draft| {
        let loops: Vec<Vec<Run>> = draft.loops.iter().map(|l| l.iter().map(run).collect()).collect();
        measure::flux(&tree.surfaces[draft.sheet.0], draft.sheet.1, &loops, &from)
    };
    drafts.iter().map(flux).collect()
}

/// Volumes of the shells, voids negative, after checking Euler's number of each and that there is one body.
fn check_shells(
    tree: &Tree,
    drafts: &[Draft],
    edges: &[Edge],
    fluxes: &[Flux],
    vertices: &[Point3<f64>],
) -> Result<Vec<f64>, Faults> {
    let mut parent: Vec<usize> = (0..drafts.len()).collect();
    for edge in edges {
        let (a, b) = (root(&parent, edge.faces[0]), root(&parent, edge.faces[1]));
        parent[a.min(b)] = a.max(b);
    }
    let mut shells: BTreeMap<usize, (f64, i64)> = BTreeMap::new();
    let mut leaves: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for (i, draft) in drafts.iter().enumerate() {
        let shell = shells.entry(root(&parent, i)).or_default();
        shell.0 += fluxes[i].volume;
        shell.1 += draft.euler;
        leaves.entry(root(&parent, i)).or_default().insert(draft.owner.0);
    }
    let mut seen = vec![false; vertices.len()];
    for edge in edges {
        let shell = shells.entry(root(&parent, edge.faces[0])).or_default();
        for corner in edge.ends.iter().flatten() {
            shell.1 += i64::from(!std::mem::replace(&mut seen[*corner], true));
        }
        shell.1 -= i64::from(edge.ends[0].is_some());
    }
    if let Some((_, euler)) = shells.values().find(|(_, euler)| euler % 2 != 0 || *euler > 2) {
        return Err(vec![internal(tree, &format!("a shell has Euler number {euler}"))]);
    }
    let shells: Vec<(f64, BTreeSet<usize>)> = shells.values().map(|s| s.0).zip(leaves.into_values()).collect();
    in_one_piece(tree, &shells)?;
    Ok(shells.into_iter().map(|(volume, _)| volume).collect())
}

/// Of every shell its volume and the features that its faces come from.
fn in_one_piece(tree: &Tree, shells: &[(f64, BTreeSet<usize>)]) -> Result<(), Faults> {
    let mut bodies: Vec<&(f64, BTreeSet<usize>)> = shells.iter().filter(|(volume, _)| *volume > 0.0).collect();
    bodies.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(((volume, own), others)) = bodies.split_first() else {
        return Err(vec![internal(tree, "it encloses no volume")]);
    };
    if others.is_empty() {
        return Ok(());
    }
    let message =
        format!("`{}` falls into {} bodies; the smallest is {volume:.3} mm³", tree.part.name, others.len() + 1);
    let fault = Diagnostic::error("E0405", tree.part.span, message);
    let elsewhere = |leaf: &usize| others.iter().any(|(_, leaves)| leaves.contains(leaf));
    let named = |adds: bool, shared: bool, text: &'static str| {
        let mut fit = own.iter().filter(move |l| tree.leaves[**l].adds == adds && elsewhere(l) == shared);
        fit.next().map(|l| (tree.leaves[*l].span, format!("`{}` {text}", tree.leaves[*l].name)))
    };
    // A feature of its own floats beside the rest, or a cut that both sides show goes all the way across.
    let culprit = named(true, false, "touches none of the others").or_else(|| named(false, true, "cuts it off"));
    Err(vec![match culprit {
        Some((span, text)) => fault.also(span, text),
        None => fault,
    }])
}

/// Forgets surfaces without a face.
fn drop_unused_surfaces(mut solid: Solid) -> Solid {
    let mut place = vec![None; solid.surfaces.len()];
    let mut kept = Vec::new();
    for face in &mut solid.faces {
        let slot = &mut place[face.surface];
        face.surface = *slot.get_or_insert_with(|| {
            kept.push(solid.surfaces[face.surface].clone());
            kept.len() - 1
        });
    }
    solid.surfaces = kept;
    solid
}
