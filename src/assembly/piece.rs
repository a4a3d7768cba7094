//! Which pieces are the same solid.
//!
//! In: parts and values. Out: a key that is equal for two pieces exactly when they have the same features with the same
//! names and numbers, whatever dimensions the numbers come from; and one solid per distinct key. A part placed a hundred
//! times has a hundred entries in the design, because pieces may differ; at nominal they are one solid.

use crate::design::model::{Corner, Extent, Feature, Outline, OutlinePath, Part, PoseExpr, Shape, Values};
use crate::diag::Diagnostic;
use crate::solid::{Quality, Solid, boundary, evaluate};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

/// Solids by what they are made of, all of one quality.
#[derive(Debug, Default)]
pub struct Workshop {
    made: Solids,
    /// From an earlier design: whoever asks for one again has it without work.
    spare: Solids,
}

#[derive(Debug, Default)]
struct Solids {
    known: BTreeMap<Vec<u64>, Arc<Solid>>,
    /// Those without triangles.
    bare: BTreeMap<Vec<u64>, Arc<Solid>>,
}

/// Where a workshop's solids wait for the next design: of a spec that is being written most parts stay as they are.
#[derive(Debug, Default)]
pub struct Shelf(Mutex<Solids>);

impl Shelf {
    /// A workshop that begins with what the last one made.
    pub fn workshop(&self) -> Workshop {
        let spare = self.0.lock().map(|mut solids| std::mem::take(&mut *solids)).unwrap_or_default();
        Workshop { made: Solids::default(), spare }
    }

    /// Keeps what was asked for, and nothing else.
    pub fn put_back(&self, workshop: Workshop) {
        if let Ok(mut solids) = self.0.lock() {
            *solids = workshop.made;
        }
    }
}

impl Workshop {
    /// The solid of a part at these dimensions, made once for all pieces that are alike.
    pub fn solid(&mut self, part: &Part, values: &Values, quality: &Quality) -> Result<Arc<Solid>, Vec<Diagnostic>> {
        let key = key(part, values);
        if let Some(known) = self.found(&key, true) {
            return Ok(known);
        }
        let solid = Arc::new(evaluate(part, values, quality)?);
        self.made.known.insert(key, solid.clone());
        Ok(solid)
    }

    /// The same where nobody asks for triangles: then there may be none.
    pub fn boundary(&mut self, part: &Part, values: &Values, quality: &Quality) -> Result<Arc<Solid>, Vec<Diagnostic>> {
        let key = key(part, values);
        if let Some(known) = self.found(&key, false) {
            return Ok(known);
        }
        let solid = Arc::new(boundary(part, values, quality)?);
        self.made.bare.insert(key, solid.clone());
        Ok(solid)
    }

    /// Makes the solids of these pieces that are not there yet, on all threads; of those `at_limits` the boundaries alone. What
    /// cannot be made is left out: [`Workshop::solid`] and [`Workshop::boundary`] say why.
    pub fn prepare(&mut self, pieces: &[(&Part, &Values)], at_limits: &[(&Part, &Values)], quality: &Quality) {
        let mut wanted: BTreeMap<Vec<u64>, (&Part, &Values, bool)> = BTreeMap::new();
        let with_triangles = pieces.iter().map(|piece| (piece, true));
        for (&(part, values), filled) in with_triangles.chain(at_limits.iter().map(|piece| (piece, false))) {
            let key = key(part, values);
            if self.found(&key, filled).is_none() {
                wanted.entry(key).or_insert((part, values, filled));
            }
        }
        let make = |(key, (part, values, filled)): (_, (&Part, &Values, bool))| {
            let make = if filled { evaluate } else { boundary };
            Some((key, filled, Arc::new(make(part, values, quality).ok()?)))
        };
        let made: Vec<(Vec<u64>, bool, Arc<Solid>)> = wanted.into_par_iter().filter_map(make).collect();
        for (key, filled, solid) in made {
            self.made.of(filled).insert(key, solid);
        }
    }

    /// A solid that was made before, with triangles or not.
    fn found(&mut self, key: &[u64], filled: bool) -> Option<Arc<Solid>> {
        let Solids { known, bare } = &self.made;
        if let Some(known) = known.get(key).or_else(|| bare.get(key).filter(|_| !filled)) {
            return Some(known.clone());
        }
        let kinds: &[bool] = if filled { &[true] } else { &[true, false] };
        let (kind, (key, solid)) =
            kinds.iter().find_map(|kind| Some((*kind, self.spare.of(*kind).remove_entry(key)?)))?;
        self.made.of(kind).insert(key, solid.clone());
        Some(solid)
    }

    /// How many distinct solids were made or asked for again.
    pub fn made(&self) -> usize {
        self.made.known.len() + self.made.bare.len()
    }
}

impl Solids {
    fn of(&mut self, filled: bool) -> &mut BTreeMap<Vec<u64>, Arc<Solid>> {
        if filled { &mut self.known } else { &mut self.bare }
    }
}

/// Whether two pieces are the same at these dimensions: the same features with the same names and numbers, of one material.
pub fn alike(a: &Part, b: &Part, values: &Values) -> bool {
    a.material == b.material && key(a, values) == key(b, values)
}

/// What a piece is made of, as numbers.
fn key(part: &Part, values: &Values) -> Vec<u64> {
    let mut key = Key { values, words: Vec::new() };
    key.features(&part.features);
    key.words
}

struct Key<'a> {
    values: &'a Values,
    words: Vec<u64>,
}

impl Key<'_> {
    fn features(&mut self, features: &[Feature]) {
        self.words.push(features.len() as u64);
        for feature in features {
            self.name(&feature.name);
            self.words.extend([feature.op as u64, u64::from(feature.patterned), feature.copies.len() as u64]);
            for copy in &feature.copies {
                self.shape(&copy.shape);
                self.pose(&copy.pose);
            }
        }
    }

    fn name(&mut self, name: &str) {
        self.words.push(name.len() as u64);
        self.words.extend(name.bytes().map(u64::from));
    }

    /// The kind of shape and how it is built, then its numbers.
    fn shape(&mut self, shape: &Shape) {
        match shape {
            Shape::Box { z, .. } => self.kind(0, Some(z)),
            Shape::Cylinder { h, .. } => self.kind(1, Some(h)),
            Shape::Cone { h, .. } => self.kind(2, Some(h)),
            Shape::Sphere { .. } => self.kind(3, None),
            Shape::Torus { .. } => self.kind(4, None),
            Shape::Prism { outline, h } => {
                self.kind(5, Some(h));
                self.outline(outline);
            }
            Shape::Revolve { outline } => {
                self.kind(6, None);
                self.outline(outline);
            }
            Shape::Group { features } => {
                self.kind(7, None);
                self.features(features);
            }
        }
        let numbers: Vec<u64> = shape.exprs().into_iter().map(|e| e.eval(self.values).to_bits()).collect();
        self.words.push(numbers.len() as u64);
        self.words.extend(numbers);
    }

    fn kind(&mut self, kind: u64, extent: Option<&Extent>) {
        let through = matches!(extent, Some(Extent::Through));
        self.words.extend([kind, u64::from(through)]);
    }

    fn outline(&mut self, outline: &Outline) {
        self.words.extend([outline.sides.len() as u64, corner(&outline.start_corner)]);
        for side in &outline.sides {
            self.name(&side.name);
            let path = match side.path {
                OutlinePath::Line => 0,
                OutlinePath::Arc { left, long, .. } => 1 + 2 * u64::from(left) + 4 * u64::from(long),
            };
            self.words.extend([path, corner(&side.corner)]);
        }
    }

    fn pose(&mut self, pose: &PoseExpr) {
        let values = self.values;
        self.words.extend(pose.t.iter().chain(&pose.r).map(|e| e.eval(values).to_bits()));
    }
}

fn corner(corner: &Corner) -> u64 {
    match corner {
        Corner::Sharp => 0,
        Corner::Round(_) => 1,
        Corner::Chamfer(_) => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample::{Cut, Shop};

    #[test]
    fn pieces_with_equal_numbers_are_one_solid_and_others_are_not() {
        let mut shop = Shop::default();
        let hole = |d: f64| [Cut::hole("hole", 1.0, 0.0, d, 0.01)];
        let parts = [hole(4.0), hole(4.0), hole(5.0)].map(|cuts| shop.plate("plate", [2.0, 0.1], [20.0, 0.1], &cuts));
        parts.iter().for_each(|p| {
            shop.place("plate", *p, [0.0; 3], 0.0, 0.0);
        });
        let design = shop.finish().design;
        let mut workshop = Workshop::default();
        let quality = Quality::default();
        let mut make =
            |part: usize, values: &[f64]| workshop.solid(&design.parts[part], values, &quality).expect("a plate");
        let nominal = parts.map(|p| make(p, &design.nominal()));
        assert!(Arc::ptr_eq(&nominal[0], &nominal[1]) && !Arc::ptr_eq(&nominal[0], &nominal[2]));
        assert!(!Arc::ptr_eq(&nominal[0], &make(0, &design.mmc())));
        assert_eq!(workshop.made(), 3);
    }

    #[test]
    fn what_stays_as_it_is_waits_on_the_shelf() {
        let mut shop = Shop::default();
        let plate = |shop: &mut Shop, d: f64| {
            shop.plate("plate", [2.0, 0.1], [20.0, 0.1], &[Cut::hole("hole", 1.0, 0.0, d, 0.01)])
        };
        let parts = [plate(&mut shop, 4.0), plate(&mut shop, 5.0)];
        let design = shop.finish().design;
        let (values, quality) = (design.nominal(), Quality::default());
        let shelf = Shelf::default();
        let solids = |asked: &[usize]| -> Vec<Arc<Solid>> {
            let mut workshop = shelf.workshop();
            let pieces: Vec<_> = asked.iter().map(|i| (&design.parts[parts[*i]], values.as_slice())).collect();
            workshop.prepare(&pieces[..1], &pieces, &quality);
            let made = pieces.iter().map(|(p, v)| workshop.boundary(p, v, &quality).expect("a plate")).collect();
            shelf.put_back(workshop);
            made
        };
        let (first, second) = (solids(&[0, 1]), solids(&[0, 1]));
        assert!(first.iter().zip(&second).all(|(a, b)| Arc::ptr_eq(a, b)));
        assert!(!first[0].mesh.triangles.is_empty() && first[1].mesh.triangles.is_empty());
        // A boundary is no solid with triangles; and what nobody asked for is gone.
        let third = solids(&[1]);
        assert!(!Arc::ptr_eq(&third[0], &first[1]) && !third[0].mesh.triangles.is_empty());
        assert!(!Arc::ptr_eq(&solids(&[0])[0], &first[0]));
    }
}
