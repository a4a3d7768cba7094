//! The liaison diagram: a graph of surfaces grouped by component (section III and Fig. 8 of the paper).
//!
//! In: contacts. Out: [`Liaison`], which answers who touches whom and by which surfaces, and its readable summary. Order is
//! that of the design's components and the solids' faces, so equal designs give equal diagrams.

use super::contact::{Contact, ContactKind, FaceRef, Fit};
use crate::design::model::Design;
use crate::solid::Solid;
use nalgebra::{Unit, Vector3};
use serde::Serialize;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Which surfaces of which components touch.
#[derive(Debug, Clone, PartialEq)]
pub struct Liaison {
    /// Number of components in the design.
    pub components: usize,
    /// Ordered by (a, b). Contacts over an area; of components that have none, those in a line or a point.
    pub contacts: Vec<Contact>,
    /// All other contacts in a line or a point, ordered alike.
    pub tangents: Vec<Contact>,
    /// Per component the indices of its contacts, ascending.
    touching: Vec<Vec<usize>>,
    /// Per component those that touch it, ascending.
    beside: Vec<Vec<usize>>,
}

impl Liaison {
    pub fn new(components: usize, contacts: Vec<Contact>) -> Self {
        Self::with_tangents(components, contacts, Vec::new())
    }

    /// Contacts in a line or a point count as contacts of components that touch nothing over an area.
    pub fn with_tangents(components: usize, mut contacts: Vec<Contact>, tangents: Vec<Contact>) -> Self {
        let mut broad = vec![false; components];
        contacts.iter().for_each(|c| [c.a, c.b].iter().for_each(|f| broad[f.component] = true));
        let only = |c: &Contact| !broad[c.a.component] || !broad[c.b.component];
        let (own, mut tangents): (Vec<Contact>, Vec<Contact>) = tangents.into_iter().partition(only);
        contacts.extend(own);
        contacts.sort_by_key(order);
        tangents.sort_by_key(order);
        let mut touching = vec![Vec::new(); components];
        for (index, contact) in contacts.iter().enumerate() {
            [contact.a, contact.b].iter().for_each(|f| touching[f.component].push(index));
        }
        let others = |(component, touching): (usize, &Vec<usize>)| -> Vec<usize> {
            let mut others: Vec<usize> = touching.iter().map(|i| contacts[*i].other(component)).collect();
            others.sort_unstable();
            others.dedup();
            others
        };
        let beside = touching.iter().enumerate().map(others).collect();
        Liaison { components, contacts, tangents, touching, beside }
    }

    /// Contacts of one component.
    pub fn of(&self, component: usize) -> impl Iterator<Item = &Contact> {
        self.touching[component].iter().map(|index| &self.contacts[*index])
    }

    /// Contacts between two components, in either order.
    pub fn between(&self, a: usize, b: usize) -> impl Iterator<Item = &Contact> {
        let (few, many) = if self.touching[a].len() <= self.touching[b].len() { (a, b) } else { (b, a) };
        self.of(few).filter(move |c| c.on(many).is_some())
    }

    /// Components that touch this one, in the design's order.
    pub fn neighbours(&self, component: usize) -> &[usize] {
        &self.beside[component]
    }

    /// Surfaces of a component that touch something, each once.
    pub fn surfaces(&self, component: usize) -> Vec<FaceRef> {
        let set: BTreeSet<FaceRef> = self.of(component).filter_map(|c| c.on(component)).collect();
        set.into_iter().collect()
    }

    /// Whether a component stands on another, seen along its removal direction.
    pub fn rests(&self, component: usize, direction: Unit<Vector3<f64>>) -> bool {
        self.bearers(component, direction).next().is_some()
    }

    /// The components that it stands on, seen along its removal direction; one may come several times.
    pub fn bearers(&self, component: usize, direction: Unit<Vector3<f64>>) -> impl Iterator<Item = usize> {
        let bears = move |c: &&Contact| match c.kind {
            ContactKind::Cylinder => false,
            ContactKind::Plane | ContactKind::Tangent => {
                let out = if c.a.component == component { 1.0 } else { -1.0 };
                out * c.direction.dot(&direction) < -FACING
            }
            ContactKind::Cone | ContactKind::Sphere | ContactKind::Torus => true,
        };
        self.of(component).filter(bears).map(move |c| c.other(component))
    }
}

fn order(c: &Contact) -> (usize, usize, usize, usize) {
    (c.a.component, c.b.component, c.a.face, c.b.face)
}

/// A plane bears along a direction when the cosine between them exceeds this.
const FACING: f64 = 1e-3;

/// The diagram in the user's names, for goldens and `--emit liaison`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiaisonSummary {
    pub components: Vec<String>,
    pub liaisons: Vec<PairSummary>,
    /// Pairs that also touch in a line or a point.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tangents: Vec<PairSummary>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairSummary {
    pub a: String,
    pub b: String,
    pub contacts: Vec<ContactSummary>,
}

/// Lengths in mm to the nearest 0.1 µm, areas in mm² to the nearest 0.01.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ContactSummary {
    /// The surface of `a` and the surface of `b`.
    pub faces: [String; 2],
    pub kind: ContactKind,
    pub area: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<Fit>,
    /// The gap at MMC and at LMC.
    pub gap: [f64; 2],
}

/// The liaison diagram with names in place of indices.
pub fn summary(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison) -> LiaisonSummary {
    LiaisonSummary {
        components: design.components.iter().map(|c| c.name.clone()).collect(),
        liaisons: pairs(design, solids, &liaison.contacts),
        tangents: pairs(design, solids, &liaison.tangents),
    }
}

fn pairs(design: &Design, solids: &[Arc<Solid>], contacts: &[Contact]) -> Vec<PairSummary> {
    let name = |component: usize| design.components[component].name.clone();
    let mut pairs: Vec<PairSummary> = Vec::new();
    for contact in contacts {
        let (a, b) = (name(contact.a.component), name(contact.b.component));
        let entry = contact_summary(solids, contact);
        match pairs.last_mut().filter(|p| p.a == a && p.b == b) {
            Some(pair) => pair.contacts.push(entry),
            None => pairs.push(PairSummary { a, b, contacts: vec![entry] }),
        }
    }
    pairs
}

fn contact_summary(solids: &[Arc<Solid>], contact: &Contact) -> ContactSummary {
    let face = |f: FaceRef| solids[f.component].faces[f.face].name.clone();
    ContactSummary {
        faces: [face(contact.a), face(contact.b)],
        kind: contact.kind,
        area: rounded(contact.area, 1e2),
        fit: contact.fit,
        gap: contact.gap_range.map(|g| rounded(g, 1e4)),
    }
}

/// Rounded to 1/scale; never a negative zero, which would read as a change in a golden.
fn rounded(value: f64, scale: f64) -> f64 {
    (value * scale).round() / scale + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{contact::contacts, sample};
    use ContactKind::{Cylinder, Plane};

    /// Components by index: gear, shaft, locking_ring, wheel_a1, wheel_a2, alignment_pin[1..3], hd_pin, unlatch_pin.
    const GEAR: usize = 0;
    const SHAFT: usize = 1;
    const RING: usize = 2;
    const WHEEL_A1: usize = 3;
    const WHEEL_A2: usize = 4;
    const PINS: [usize; 3] = [5, 6, 7];
    const HD_PIN: usize = 8;
    const UNLATCH_PIN: usize = 9;

    fn diagram() -> (sample::Assembly, Liaison) {
        let a = sample::pattern_wheel();
        let liaison = Liaison::new(a.design.components.len(), contacts(&a.design, &a.solids));
        (a, liaison)
    }

    fn kinds(liaison: &Liaison, a: usize, b: usize) -> Vec<ContactKind> {
        liaison.between(a, b).map(|c| c.kind).collect()
    }

    /// "The single cylinder pins are inserted only into wheel-a1 and wheel-a2 … through their side surfaces."
    #[test]
    fn single_cylinder_pins_touch_only_the_wheels_by_their_sides() {
        let (a, liaison) = diagram();
        for pin in [HD_PIN, UNLATCH_PIN] {
            assert_eq!(liaison.neighbours(pin), [WHEEL_A1, WHEEL_A2]);
            let faces = liaison.surfaces(pin);
            assert_eq!(faces.len(), 1);
            assert_eq!(a.solids[pin].faces[faces[0].face].name, "body.side");
            assert!(liaison.of(pin).all(|c| c.kind == Cylinder));
        }
    }

    /// "The shaft is only inserted into the center hole of the gear."
    #[test]
    fn the_shaft_touches_only_the_gears_bore() {
        let (a, liaison) = diagram();
        let contacts: Vec<_> = liaison.of(SHAFT).collect();
        assert_eq!(contacts.len(), 1);
        assert_eq!(contacts[0].other(SHAFT), GEAR);
        assert_eq!(a.solids[GEAR].faces[contacts[0].a.face].name, "bore.side");
    }

    /// "The alignment pins are in contact with the holes in the gear, the locking ring, and the wheels and … maintain a
    /// precise separation between the two wheels as well as between wheel-a1 and the locking ring."
    #[test]
    fn alignment_pins_hold_the_wheels_apart() {
        let (_, liaison) = diagram();
        for pin in PINS {
            assert_eq!(liaison.neighbours(pin), [GEAR, RING, WHEEL_A1, WHEEL_A2]);
            assert_eq!(kinds(&liaison, pin, GEAR), [Cylinder]);
            for plate in [RING, WHEEL_A1, WHEEL_A2] {
                let mut found = kinds(&liaison, pin, plate);
                found.sort_by_key(|k| *k == Cylinder);
                assert_eq!(found, [Plane, Cylinder], "pin {pin} on plate {plate}");
            }
        }
        assert_eq!(liaison.between(RING, WHEEL_A1).count(), 0);
        assert_eq!(liaison.between(WHEEL_A1, WHEEL_A2).count(), 0);
    }

    /// "… the locking ring which rests on the gear."
    #[test]
    fn the_locking_ring_rests_on_the_gear() {
        let (_, liaison) = diagram();
        assert_eq!(kinds(&liaison, GEAR, RING), [Plane]);
        assert_eq!(liaison.neighbours(GEAR), [SHAFT, RING, PINS[0], PINS[1], PINS[2]]);
    }

    #[test]
    fn the_summary_is_readable_ron() {
        let (a, liaison) = diagram();
        let text = ron::ser::to_string_pretty(&summary(&a.design, &a.solids, &liaison), Default::default());
        let text = text.expect("plain data");
        assert!(text.contains("\"hd_hole.side\"") && text.contains("Clearance"), "{text}");
        assert!(text.len() < 20 * 1024, "{}", text.len());
    }
}
