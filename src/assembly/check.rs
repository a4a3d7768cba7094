//! What is wrong with how components stand to each other, as diagnostics in the user's names.
//!
//! In: contacts, clashes and bodies that enter each other. Out: E0501 (interference at nominal), W0502 (interference within
//! tolerance), E0503 (a component that touches nothing). Never moves anything.

use super::contact::{Clash, Contact, FaceRef, Fit};
use super::liaison::Liaison;
use super::limits::{Slip, Zones};
use super::meeting::Entering;
use super::place::place;
use crate::design::model::Design;
use crate::diag::Diagnostic;
use crate::solid::Solid;
use nalgebra::{Isometry3, Point3, Vector3};
use std::sync::Arc;

/// A deliberate press fit interferes by at most this share of the diameter (ISO 286 u6 on small sizes has 0.5 %).
const TIGHTEST_PRESS: f64 = 0.005;
/// Placement may use up this much (mm) more than the clearance before it is worth a warning.
const NEGLIGIBLE: f64 = 1e-4;

/// All findings, in the design's order.
pub(crate) fn check(
    design: &Design,
    solids: &[Arc<Solid>],
    liaison: &Liaison,
    clashes: &[Clash],
    entering: &[Entering],
) -> Vec<Diagnostic> {
    let mut found = interference(design, solids, liaison, clashes, entering);
    found.extend(tight_zones(design, solids, liaison));
    found.extend(untouched(design, solids, liaison));
    found
}

/// E0501, once per pair of components.
fn interference(
    design: &Design,
    solids: &[Arc<Solid>],
    liaison: &Liaison,
    clashes: &[Clash],
    entering: &[Entering],
) -> Vec<Diagnostic> {
    let name = |f: FaceRef| face_name(design, solids, f);
    let mut found: Vec<(usize, usize, Diagnostic)> = Vec::new();
    for clash in clashes {
        let entry = enters(design, clash.a.component, clash.b.component, clash.depth);
        let note =
            format!("the axes of `{}` and `{}` are that far apart, clearance deducted", name(clash.a), name(clash.b));
        found.push((clash.a.component, clash.b.component, entry.note(note)));
    }
    for c in liaison.contacts.iter().filter(|c| presses_too_hard(c, solids)) {
        let entry = enters(design, c.a.component, c.b.component, -c.gap);
        let note = format!(
            "`{}` is smaller than `{}`: no press fit is as tight",
            name(hollow(c, solids)),
            name(full(c, solids))
        );
        found.push((c.a.component, c.b.component, entry.note(note)));
    }
    found.extend(entering.iter().map(|e| (e.a, e.b, enters(design, e.a, e.b, e.depth))));
    found.sort_by_key(|(a, b, _)| (*a, *b));
    found.dedup_by_key(|(a, b, _)| (*a, *b));
    found.into_iter().map(|(.., d)| d).collect()
}

fn enters(design: &Design, a: usize, b: usize, depth: f64) -> Diagnostic {
    let [first, second] = [a, b].map(|c| &design.components[c]);
    let message = format!("`{}` enters `{}` by {depth:.3} mm at nominal", second.name, first.name);
    Diagnostic::error("E0501", second.span, message)
        .label(format!("stands {depth:.3} mm inside `{}`", first.name))
        .also(first.span, format!("`{}` is placed here", first.name))
}

fn hollow(c: &Contact, solids: &[Arc<Solid>]) -> FaceRef {
    if solids[c.a.component].faces[c.a.face].outward { c.b } else { c.a }
}

fn full(c: &Contact, solids: &[Arc<Solid>]) -> FaceRef {
    if hollow(c, solids) == c.a { c.b } else { c.a }
}

fn presses_too_hard(c: &Contact, solids: &[Arc<Solid>]) -> bool {
    use crate::solid::Surface::{Cylinder, Sphere};
    let f = full(c, solids);
    let solid = &solids[f.component];
    let (Cylinder { radius, .. } | Sphere { radius, .. }) = &solid.surfaces[solid.faces[f.face].surface] else {
        return false;
    };
    c.fit.is_some() && -c.gap > TIGHTEST_PRESS * 2.0 * radius
}

/// How far placement outruns the clearance of one contact.
struct Tight<'a> {
    contact: &'a Contact,
    /// Shifts across the axis, the largest first.
    slips: Vec<Slip>,
    /// Sum of the shifts (mm).
    reach: f64,
}

/// W0502, once per component: for the contact where its zone outruns the clearance most.
fn tight_zones(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> Vec<Diagnostic> {
    let zones = Zones::new(design);
    let mut worst: Vec<(usize, f64, Tight)> = Vec::new();
    let sized = liaison.contacts.iter().filter(|c| matches!(c.fit, Some(Fit::Clearance | Fit::Transition)));
    for contact in sized {
        let tight = Tight::new(contact, &zones);
        let excess = tight.reach - contact.gap_range[0] / 2.0;
        let owner = tight.slips.first().map_or(contact.b.component, |s| s.component);
        if excess > NEGLIGIBLE && worst.iter().all(|(c, e, _)| *c != owner || *e < excess) {
            worst.retain(|(c, ..)| *c != owner);
            worst.push((owner, excess, tight));
        }
    }
    worst.sort_by_key(|(owner, ..)| *owner);
    worst.iter().map(|(owner, _, tight)| tight.diagnostic(design, solids, *owner)).collect()
}

impl<'a> Tight<'a> {
    fn new(contact: &'a Contact, zones: &Zones) -> Self {
        let axis = contact.direction.into_inner();
        let middle =
            contact.point + axis * ((contact.span[0] + contact.span[1]) / 2.0 - contact.point.coords.dot(&axis));
        let mut slips = zones.slips(contact.a.component, contact.b.component, &middle);
        for slip in &mut slips {
            slip.shift -= axis * slip.shift.dot(&axis);
        }
        slips.retain(|s| s.shift.norm() > NEGLIGIBLE / 10.0);
        slips.sort_by(|p, q| q.shift.norm().total_cmp(&p.shift.norm()));
        let reach = slips.iter().map(|s| s.shift.norm()).sum();
        Tight { contact, slips, reach }
    }

    fn diagnostic(&self, design: &Design, solids: &[Arc<Solid>], owner: usize) -> Diagnostic {
        let c = self.contact;
        let component = &design.components[owner];
        let (hole, pin) = (face_name(design, solids, hollow(c, solids)), face_name(design, solids, full(c, solids)));
        let message = format!("`{pin}` can meet `{hole}` within tolerance");
        let label = if self.slips.is_empty() {
            format!("at MMC they interfere by {:.4} mm", -c.gap_range[0])
        } else {
            let left = c.gap_range[0];
            format!("at MMC {left:.4} mm of clearance is left, but placement allows ±{:.4} mm", self.reach)
        };
        let warning = Diagnostic::warning("W0502", component.span, message).label(label);
        match self.remedy(design) {
            Some(help) => warning.help(help),
            None => warning,
        }
    }

    /// The widest zone that keeps clear, where one axis alone is to blame.
    fn remedy(&self, design: &Design) -> Option<String> {
        let [slip] = self.slips.as_slice() else { return None };
        let share = self.contact.gap_range[0] / 2.0 / slip.shift.norm();
        let pose = &design.components[slip.component].pose;
        let (expr, scale, unit) = match slip.axis {
            axis @ 0..3 => (&pose.t[axis], 1.0, ""),
            axis => (&pose.r[axis - 3], 1f64.to_degrees(), " deg"),
        };
        let nominal = (expr.eval(&design.nominal()) * scale * 1e6).round() / 1e6 + 0.0;
        let axis = ["x", "y", "z", "rx", "ry", "rz"][slip.axis];
        (share > 0.0).then(|| format!("{axis} = {nominal} ±{}{unit}", rounded_down(slip.half_width * share * scale)))
    }
}

/// A positive number cut to two significant digits, so that what is pasted is never wider than what was worked out.
fn rounded_down(value: f64) -> String {
    let decimals = (1.0 - value.log10().floor()).max(0.0) as usize;
    let scale = 10f64.powi(decimals as i32);
    format!("{:.decimals$}", (value * scale + 1e-9).floor() / scale)
}

/// What is nearer than this (mm, the facets of curved faces) touches after all, if only along a line or in a point.
const LINE_CONTACT: f64 = 0.02;

/// E0503 for every component but the root that touches nothing.
fn untouched(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> Vec<Diagnostic> {
    let poses = place(design, &design.nominal());
    let lonely = (1..liaison.components).filter(|c| liaison.of(*c).next().is_none());
    let nearest = lonely.map(|c| (c, nearest_face(solids, &poses, c)));
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
fn nearest_face(solids: &[Arc<Solid>], poses: &[Isometry3<f64>], component: usize) -> Option<(FaceRef, f64)> {
    let own: Vec<Point3<f64>> = solids[component].mesh.positions.iter().map(|p| poses[component] * p).collect();
    let mut best: Option<(FaceRef, f64)> = None;
    for (other, solid) in solids.iter().enumerate().filter(|(o, _)| *o != component) {
        let local: Vec<Point3<f64>> = own.iter().map(|p| poses[other].inverse() * p).collect();
        for (triangle, face) in solid.mesh.triangles.iter().zip(&solid.mesh.faces) {
            let corners = triangle.map(|i| solid.mesh.positions[i as usize]);
            let limit = best.map_or(f64::INFINITY, |b| b.1);
            let distance = nearest_point(&local, &corners, limit);
            if distance < limit {
                best = Some((FaceRef { component: other, face: *face as usize }, distance));
            }
        }
    }
    best
}

/// The least distance (mm) of some points from a triangle, if below a limit.
fn nearest_point(points: &[Point3<f64>], corners: &[Point3<f64>; 3], limit: f64) -> f64 {
    let centre = Point3::from((corners[0].coords + corners[1].coords + corners[2].coords) / 3.0);
    let radius = corners.iter().map(|c| (c - centre).norm()).fold(0.0, f64::max);
    let close = points.iter().filter(|p| (*p - centre).norm() - radius < limit);
    close.map(|p| distance_to_triangle(p, corners)).fold(limit, f64::min)
}

fn distance_to_triangle(p: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let inside = [(a, b), (b, c), (c, a)].iter().all(|(s, t)| normal.dot(&(*t - *s).cross(&(p - *s))) >= 0.0);
    if inside && normal.norm() > 0.0 {
        return (normal.dot(&(p - a)) / normal.norm()).abs();
    }
    [(a, b), (b, c), (c, a)].iter().map(|(s, t)| distance_to_segment(p, s, t)).fold(f64::INFINITY, f64::min)
}

fn distance_to_segment(p: &Point3<f64>, s: &Point3<f64>, t: &Point3<f64>) -> f64 {
    let along: Vector3<f64> = t - s;
    let share = if along.norm_squared() > 0.0 { (p - s).dot(&along) / along.norm_squared() } else { 0.0 };
    (p - (s + along * share.clamp(0.0, 1.0))).norm()
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
        assert_eq!((thick[0].0, thick[0].1.as_str()), ("E0501", "`pin` enters `plate` by 0.500 mm at nominal"));
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
        assert_eq!(codes, ["W0502"; 3]);
        assert_eq!(
            found[0].message,
            "`alignment_pin[1].shank.side` can meet `locking_ring.pin_hole[1].side` within tolerance"
        );
        assert_eq!(found[0].help.as_deref(), Some("rz = 0 ±0.0063 deg"));
        assert!(found[0].labels[0].text.contains("0.0040 mm of clearance is left"), "{}", found[0].labels[0].text);
    }
}
