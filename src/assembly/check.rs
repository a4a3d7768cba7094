//! What is wrong with how components stand to each other, as diagnostics in the user's names.
//!
//! In: contacts, clashes and bodies that enter each other. Out: E0501 (interference at nominal), W0502 (interference within
//! tolerance), E0503 (a component that touches nothing). Never moves anything.

use super::boxes::{Bounds, BoxTree, distance_to_triangle};
use super::contact::{Clash, Contact, FaceRef, Tight};
use super::liaison::Liaison;
use super::meeting::Entering;
use super::place::place;
use super::tight;
use crate::design::model::Design;
use crate::diag::{Diagnostic, Span};
use crate::solid::{Solid, Surface};
use nalgebra::{Isometry3, Point3};
use std::sync::Arc;

/// A deliberate press fit interferes by at most this share of the diameter (ISO 286 u6 on small sizes has 0.5 %).
const TIGHTEST_PRESS: f64 = 0.005;

/// Copies named in a note.
const NAMED: usize = 4;

/// What the analysis saw.
#[derive(Clone, Copy)]
pub(crate) struct Seen<'a> {
    pub liaison: &'a Liaison,
    pub clashes: &'a [Clash],
    pub squeezed: &'a [Clash],
    pub entering: &'a [Entering],
    pub tight: &'a [Tight],
}

/// All findings, in the design's order.
pub(crate) fn check(design: &Design, solids: &[Arc<Solid>], seen: &Seen) -> Vec<Diagnostic> {
    let mut found = interference(design, solids, seen);
    found.extend(tight::warnings(design, solids, seen.liaison, seen.tight));
    found.extend(untouched(design, solids, seen));
    found
}

/// E0501, once per pair of components.
fn interference(design: &Design, solids: &[Arc<Solid>], seen: &Seen) -> Vec<Diagnostic> {
    let clashes = seen.clashes.iter().map(|c| (c.a.component, c.b.component, clash(design, solids, c)));
    let pressed = seen.liaison.contacts.iter().filter(|c| presses_too_hard(c, solids));
    let pressed = pressed.map(|c| (c.a.component, c.b.component, press(design, solids, c)));
    let entering = seen.entering.iter().map(|e| (e.a, e.b, enters(design, e.a, e.b, e.depth)));
    let squeezed = seen.squeezed.iter().map(|s| {
        let pair = [s.a.component, s.b.component];
        (pair[0].min(pair[1]), pair[0].max(pair[1]), too_large(design, solids, s.a, s.b, s.depth))
    });
    let mut found: Vec<(usize, usize, Diagnostic)> = clashes.chain(pressed).chain(squeezed).chain(entering).collect();
    found.sort_by_key(|(a, b, _)| (*a, *b));
    found.dedup_by_key(|(a, b, _)| (*a, *b));
    once_per_placement(design, found)
}

/// What is told of the copies of one placement.
struct Told {
    /// Where the two are placed, and what is said of them.
    about: (Span, Span, String),
    diagnostic: Diagnostic,
    others: Vec<String>,
}

/// Copies of one placement that enter the same component alike are told of once.
fn once_per_placement(design: &Design, found: Vec<(usize, usize, Diagnostic)>) -> Vec<Diagnostic> {
    let mut all: Vec<Told> = Vec::new();
    for (a, b, diagnostic) in found {
        let [first, second] = [a, b].map(|c| &design.components[c]);
        let about = (first.span, second.span, diagnostic.labels[0].text.replace(&first.name, ""));
        match all.iter_mut().find(|told| told.about == about) {
            Some(told) => told.others.push(format!("`{}`", second.name)),
            None => all.push(Told { about, diagnostic, others: Vec::new() }),
        }
    }
    all.into_iter().map(Told::whole).collect()
}

impl Told {
    fn whole(self) -> Diagnostic {
        match self.others.as_slice() {
            [] => self.diagnostic,
            [one] => self.diagnostic.note(format!("so does {one}")),
            others if others.len() > NAMED => {
                let named = others[..NAMED].join(", ");
                self.diagnostic.note(format!("so do {named} and {} others", others.len() - NAMED))
            }
            others => self.diagnostic.note(format!("so do {}", others.join(", "))),
        }
    }
}

fn clash(design: &Design, solids: &[Arc<Solid>], clash: &Clash) -> Diagnostic {
    let [a, b] = [clash.a, clash.b].map(|f| face_name(design, solids, f));
    enters(design, clash.a.component, clash.b.component, clash.depth)
        .note(format!("the axes of `{a}` and `{b}` are that far apart, clearance deducted"))
}

fn press(design: &Design, solids: &[Arc<Solid>], c: &Contact) -> Diagnostic {
    too_large(design, solids, hollow(c), full(c), -c.gap)
}

/// A pin that is thicker than its hole by `depth` mm.
fn too_large(design: &Design, solids: &[Arc<Solid>], hole: FaceRef, pin: FaceRef, depth: f64) -> Diagnostic {
    let [hole_name, pin_name] = [hole, pin].map(|f| face_name(design, solids, f));
    let [hole_d, pin_d] = [hole, pin].map(|f| diameter(solids, f).unwrap_or_default());
    let [a, b] = [hole.component.min(pin.component), hole.component.max(pin.component)];
    enters(design, a, b, depth)
        .note(format!("`{hole_name}` is smaller than `{pin_name}`: no press fit is as tight"))
        .help(format!("`{pin_name}` at most {hole_d:.3} across, or `{hole_name}` at least {pin_d:.3}"))
}

fn enters(design: &Design, a: usize, b: usize, depth: f64) -> Diagnostic {
    let [first, second] = [a, b].map(|c| &design.components[c]);
    let message = format!("`{}` enters `{}` by {depth:.3} mm at nominal", second.name, first.name);
    Diagnostic::error("E0501", second.span, message)
        .label(format!("stands {depth:.3} mm inside `{}`", first.name))
        .also(first.span, format!("`{}` is placed here", first.name))
}

/// The hollow and the full face of a round contact.
pub(crate) fn hollow(c: &Contact) -> FaceRef {
    if c.full { c.b } else { c.a }
}

pub(crate) fn full(c: &Contact) -> FaceRef {
    if c.full { c.a } else { c.b }
}

fn presses_too_hard(c: &Contact, solids: &[Arc<Solid>]) -> bool {
    c.fit.is_some() && diameter(solids, full(c)).is_some_and(|d| -c.gap > TIGHTEST_PRESS * d)
}

fn diameter(solids: &[Arc<Solid>], f: FaceRef) -> Option<f64> {
    let solid = &solids[f.component];
    match &solid.surfaces[solid.faces[f.face].surface] {
        Surface::Cylinder { radius, .. } | Surface::Sphere { radius, .. } => Some(2.0 * radius),
        Surface::Torus { minor, .. } => Some(2.0 * minor),
        _ => None,
    }
}

/// What is nearer than this (mm, the facets of curved faces) touches after all, if only along a line or in a point.
const LINE_CONTACT: f64 = 0.02;

/// E0503 for every component but the root that touches nothing; one that stands inside another has been told of.
fn untouched(design: &Design, solids: &[Arc<Solid>], seen: &Seen) -> Vec<Diagnostic> {
    let (liaison, mut inside) = (seen.liaison, vec![false; seen.liaison.components]);
    seen.entering.iter().for_each(|e| (inside[e.a], inside[e.b]) = (true, true));
    let crossed = seen.clashes.iter().chain(seen.squeezed);
    crossed.for_each(|c| (inside[c.a.component], inside[c.b.component]) = (true, true));
    let alone = |c: &usize| liaison.of(*c).next().is_none() && !inside[*c];
    let lonely: Vec<usize> = (1..liaison.components).filter(alone).collect();
    if lonely.is_empty() {
        return Vec::new();
    }
    let poses = place(design, &design.nominal());
    let bounds = |(s, pose): (&Arc<Solid>, &Isometry3<f64>)| {
        Bounds::of(&s.mesh.positions.iter().map(|p| pose * p).collect::<Vec<_>>())
    };
    let tree = BoxTree::new(solids.iter().zip(&poses).map(bounds).collect());
    let nearest = lonely.into_iter().map(|c| (c, nearest_face(solids, &poses, &tree, c)));
    let apart = nearest.filter(|(_, nearest)| nearest.is_none_or(|(_, distance)| distance > LINE_CONTACT));
    apart.map(|(c, nearest)| touches_nothing(design, solids, c, nearest)).collect()
}

fn touches_nothing(
    design: &Design,
    solids: &[Arc<Solid>],
    component: usize,
    nearest: Option<(FaceRef, f64)>,
) -> Diagnostic {
    let this = &design.components[component];
    let message = format!("`{}` touches nothing", this.name);
    let found = Diagnostic::error("E0503", this.span, message).note("without a contact it has no error tree");
    match nearest {
        Some((face, distance)) => {
            let name = face_name(design, solids, face);
            found.label(format!("nearest is `{name}`, {distance:.2} mm away")).help("check where it is placed")
        }
        None => found.label("there is nothing else to touch"),
    }
}

/// The face of another component nearest to this one's vertices (mm).
fn nearest_face(
    solids: &[Arc<Solid>],
    poses: &[Isometry3<f64>],
    tree: &BoxTree,
    component: usize,
) -> Option<(FaceRef, f64)> {
    let own: Vec<Point3<f64>> = solids[component].mesh.positions.iter().map(|p| poses[component] * p).collect();
    let mut best: Option<(FaceRef, f64)> = None;
    tree.nearest(&Bounds::of(&own), f64::INFINITY, &mut |other, _| {
        if other != component {
            let limit = best.map_or(f64::INFINITY, |b| b.1);
            let local: Vec<Point3<f64>> = own.iter().map(|p| poses[other].inverse() * p).collect();
            let found = nearest_on(&solids[other], &local, limit);
            best = found.map(|(face, distance)| (FaceRef { component: other, face }, distance)).or(best);
        }
        best.map_or(f64::INFINITY, |b| b.1)
    });
    best
}

/// How far two solids in one frame stand apart (mm, by their triangles), and the face of the second that is nearest, where
/// that is plain to say.
pub(crate) fn apart<'a>(a: &Solid, b: &'a Solid) -> Option<(f64, Option<&'a str>)> {
    let (face, distance) = nearest_on(b, &a.mesh.positions, f64::INFINITY)?;
    /// Nearer by less than this (mm) is as far.
    const SLACK: f64 = 1e-6;
    // A corner of the second may be nearer to a face of the first.
    Some(match nearest_on(a, &b.mesh.positions, distance - SLACK) {
        Some((_, nearer)) => (nearer, None),
        None => (distance, Some(b.faces[face].name.as_str())),
    })
}

/// The face of a solid nearest to some points in its frame, if nearer than a limit (mm).
fn nearest_on(solid: &Solid, points: &[Point3<f64>], limit: f64) -> Option<(usize, f64)> {
    let near = Bounds::of(points);
    let (mut best, mut limit) = (None, limit);
    for (triangle, face) in solid.mesh.triangles.iter().zip(&solid.mesh.faces) {
        let corners = triangle.map(|i| solid.mesh.positions[i as usize]);
        if Bounds::of(&corners).distance(&near) >= limit {
            continue;
        }
        let distance = points.iter().map(|p| distance_to_triangle(p, &corners)).fold(f64::INFINITY, f64::min);
        if distance < limit {
            (best, limit) = (Some((*face as usize, distance)), distance);
        }
    }
    best
}

/// `wheel_a1.hd_hole.side`.
pub(crate) fn face_name(design: &Design, solids: &[Arc<Solid>], f: FaceRef) -> String {
    format!("{}.{}", design.components[f.component].name, solids[f.component].faces[f.face].name)
}

#[cfg(test)]
mod tests {
    use crate::assembly::{analyse, sample};

    fn findings(a: &sample::Assembly) -> Vec<(&'static str, String, String)> {
        let (_, found) = analyse(&a.design, &a.solids);
        found.into_iter().map(|d| (d.code, d.message, d.labels[0].text.clone())).collect()
    }

    /// A plate with a hole and a pin in it: pin diameter with its limits, offset, height.
    fn pinned(d: f64, limits: [f64; 2], x: f64, z: f64) -> sample::Assembly {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [5.0, 0.0], [20.0, 0.0], &[sample::Cut::hole("hole", 0.0, 0.0, 6.0, 0.012)]);
        let pin = shop.pin("pin", &[("shank", d, d, limits, 10.0)]);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        shop.place("pin", pin, [x, 0.0, z], 0.0, 0.0);
        shop.finish()
    }

    #[test]
    fn a_pin_that_fits_is_fine() {
        assert_eq!(findings(&pinned(6.0, [-0.012, -0.004], 0.0, -1.0)), []);
        assert_eq!(findings(&pinned(6.0, [0.015, 0.02], 0.0, -1.0)), [], "a press fit is deliberate");
    }

    #[test]
    fn interference_at_nominal_is_measured() {
        let expected = "`pin` enters `plate` by 0.100 mm at nominal";
        assert_eq!(findings(&pinned(6.1, [0.0; 2], 0.0, -1.0))[0].1, expected);
        let beside = findings(&pinned(6.0, [0.0; 2], 0.05, -1.0));
        assert_eq!((beside[0].0, beside[0].1.as_str()), ("E0501", "`pin` enters `plate` by 0.050 mm at nominal"));
        let thick = findings(&pinned(8.0, [0.0; 2], 0.0, 4.5));
        assert_eq!((thick[0].0, thick[0].1.as_str()), ("E0501", "`pin` enters `plate` by 2.000 mm at nominal"));
    }

    #[test]
    fn a_part_in_the_air_is_told_how_far_it_is_off() {
        let found = findings(&pinned(6.0, [0.0; 2], 0.0, 5.31));
        assert_eq!((found[0].0, found[0].1.as_str()), ("E0503", "`pin` touches nothing"));
        assert!(found[0].2.contains("0.31 mm away"), "{}", found[0].2);
    }

    #[test]
    fn a_part_on_its_edge_is_not_in_the_air() {
        let mut shop = sample::Shop::default();
        let plate = shop.plate("plate", [2.0, 0.0], [20.0, 0.0], &[]);
        let cone = shop.pin("cone", &[("point", 1e-3, 6.0, [0.0; 2], 4.0)]);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        shop.place("cone", cone, [0.0, 0.0, 2.0], 0.0, 0.0);
        assert_eq!(findings(&shop.finish()), []);
    }

    #[test]
    fn a_transition_fit_is_a_warning() {
        let found = findings(&pinned(6.0, [-0.01, 0.01], 0.0, -1.0));
        assert_eq!((found[0].0, found[0].2.as_str()), ("W0502", "at MMC they interfere by 0.0100 mm"));
    }

    /// A turn of 0.03 degrees at r = 18 is 9.4 µm; the pins have 4 µm in diameter to spare.
    #[test]
    fn zones_wider_than_the_clearance_are_warned_of_with_the_zone_that_fits() {
        let a = sample::pattern_wheel();
        let (_, found) = analyse(&a.design, &a.solids);
        let codes: Vec<_> = found.iter().map(|d| d.code).collect();
        assert_eq!(codes, ["W0502"; 5]);
        assert_eq!(
            found[0].message,
            "`alignment_pin[1].shank.side` can meet `locking_ring.pin_hole[1].side` within tolerance"
        );
        assert_eq!(found[0].help.as_deref(), Some("rz = 0 deg ±0.0063 deg"));
        assert!(
            found[0].labels[0].text.contains("0.0020 mm of clearance is left to every side"),
            "{}",
            found[0].labels[0].text
        );
    }

    #[test]
    fn pieces_of_one_part_are_told_of_once() {
        let mut shop = sample::Shop::default();
        let holes = [-6.0, 0.0, 6.0].map(|x| sample::Cut::hole("hole", x, 0.0, 4.0, 0.0));
        let plate = shop.plate("plate", [5.0, 0.0], [30.0, 0.0], &holes);
        shop.place("plate", plate, [0.0; 3], 0.0, 0.0);
        for (k, x) in [-6.0, 0.0, 6.0].into_iter().enumerate() {
            let pin = shop.pin("pin", &[("shank", 4.0, 4.0, [-0.01, 0.01], 10.0)]);
            shop.place(&format!("pin[{}]", k + 1), pin, [x, 0.0, 0.0], 0.0, 0.0);
        }
        let a = shop.finish();
        let (_, found) = analyse(&a.design, &a.solids);
        let codes: Vec<_> = found.iter().map(|d| d.code).collect();
        assert_eq!(codes, ["W0502"], "{found:?}");
        assert_eq!(found[0].notes, ["so can `pin[2]`, `pin[3]`"]);
    }
}
