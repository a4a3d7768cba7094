//! The lock file of a spec: what the compiler chose where the spec leaves it the choice.
//!
//! In: the text of `NAME.lock.ron`, a design and one of its stations. Out: the choice made before, if it still answers the
//! question it was made for, and the text with a choice added. A choice is kept with a digest of what it depended on, so
//! that it stands through every change that has nothing to do with it, and through new versions of the compiler. The digest is
//! taken of the numbers of the spec and never of meshes, so it is the same on every machine.

use crate::design::essence::essence;
use crate::design::model::{CameraPlacing, Design, Station};
use crate::diag::Diagnostic;
use crate::scene::build::Placed;
use crate::units::Range;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// The layout of the file.
const FORMAT: u32 = 1;
/// More stations than this (and a longer text, in bytes) are not a lock of ours.
const MOST_STATIONS: usize = 4096;
const LONGEST: usize = 4 << 20;

const HEADER: &str = "\
// What gonogo chose where the spec says `auto`. Keep it with the spec; `gonogo compile --locked` insists on it.
// Written by the compiler: distance in mm, elevation and azimuth in rad.
";

/// What was chosen, by [`entry`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lock {
    format: u32,
    pub stations: BTreeMap<String, Locked>,
}

/// What was chosen for one station.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Locked {
    /// Digest of what the choice depended on.
    of: String,
    camera: Camera,
    /// Seed of all draws: the compiler's own, unless the spec names one.
    seed: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Camera {
    /// mm.
    distance: f64,
    /// rad.
    elevation: f64,
    azimuth: f64,
}

impl Locked {
    pub fn new(design: &Design, station: &Station, Placed { distance, elevation, azimuth }: Placed) -> Locked {
        let camera = Camera { distance, elevation, azimuth };
        Locked { of: digest(design, station), camera, seed: design.train.seed }
    }

    /// The place chosen, if it was chosen for this question and is one of those that the spec allows.
    pub fn placing(&self, design: &Design, station: &Station) -> Option<Placed> {
        let Camera { distance, elevation, azimuth } = self.camera;
        let CameraPlacing::Auto { distance: d, elevation: e, azimuth: a } = &station.camera.placing else {
            return None;
        };
        let within = |range: &Range, value: f64| (range.low - 1e-9..=range.high + 1e-9).contains(&value);
        // Where it may be anything the search goes on round.
        let anywhere = a.high - a.low > TAU - 1e-9 && azimuth.is_finite();
        let allowed = within(d, distance) && within(e, elevation) && (anywhere || within(a, azimuth));
        (allowed && self.of == digest(design, station)).then_some(Placed { distance, elevation, azimuth })
    }
}

impl Lock {
    /// The lock that a file holds.
    pub fn read(text: &str) -> Result<Lock, String> {
        if text.len() > LONGEST {
            return Err(format!("it is longer than {LONGEST} bytes"));
        }
        let lock: Lock = ron::from_str(text).map_err(|e| e.to_string())?;
        if lock.format != FORMAT {
            return Err(format!("it has format {}, this compiler reads {FORMAT}", lock.format));
        }
        if lock.stations.len() > MOST_STATIONS {
            return Err(format!("it has more than {MOST_STATIONS} stations"));
        }
        Ok(lock)
    }

    /// The text of the file.
    pub fn write(&self) -> String {
        let lock = Lock { format: FORMAT, stations: self.stations.clone() };
        let layout = ron::ser::PrettyConfig::new().new_line("\n");
        let text = ron::ser::to_string_pretty(&lock, layout).expect("plain data always serialises");
        format!("{HEADER}{text}\n")
    }

    /// The lock with this choice, and without those of stations that leave none.
    pub fn with(mut self, design: &Design, entry: String, locked: Locked) -> Lock {
        let station = |entry: &str| entry.split(SET).next().map(str::to_string);
        let leaves_choice =
            |entry: &str| design.stations.iter().any(|s| station(entry).as_ref() == Some(&s.name) && is_auto(s));
        self.stations.insert(entry, locked);
        self.stations.retain(|entry, _| leaves_choice(entry));
        Lock { format: FORMAT, ..self }
    }
}

/// Between a station and what is replaced in the spec.
const SET: &str = " --set ";

/// The name under which a choice is kept: the station's, with the values that `--set` replaces, for they make another
/// assembly.
pub fn entry(station: &Station, set: &[(String, String)]) -> String {
    let last: BTreeMap<&String, &String> = set.iter().map(|(name, value)| (name, value)).collect();
    last.iter().fold(station.name.clone(), |entry, (name, value)| format!("{entry}{SET}{name}={value}"))
}

/// Whether the compiler has a choice at this station.
pub fn is_auto(station: &Station) -> bool {
    matches!(station.camera.placing, CameraPlacing::Auto { .. })
}

/// The choice made before for a station, kept under `name`. E0605 where `insist` demands one, with the seed it was made for, and there
/// is none.
pub fn kept(
    lock: Option<&Lock>,
    insist: bool,
    design: &Design,
    (station, name): (&Station, &str),
) -> Result<Option<Placed>, Vec<Diagnostic>> {
    let entry = lock.and_then(|lock| lock.stations.get(name));
    let placing = entry.and_then(|entry| entry.placing(design, station));
    let why = match (entry, placing) {
        _ if !insist || !is_auto(station) => return Ok(placing),
        (Some(entry), Some(_)) if entry.seed == design.train.seed => return Ok(placing),
        (Some(entry), Some(_)) => format!("the lock has seed {}, the spec has seed {}", entry.seed, design.train.seed),
        (Some(_), None) => "the lock's choice was made for other parts, another camera or other ranges".to_string(),
        (None, _) if lock.is_some() => format!("the lock has no `{name}`"),
        (None, _) => "there is no lock".to_string(),
    };
    let message = format!("the camera of station `{}` would be chosen anew", station.name);
    Err(vec![
        Diagnostic::error("E0605", station.camera.span, message)
            .label("`--locked` allows no new choice")
            .note(why)
            .help("compile once without `--locked`, and keep the lock file with the spec"),
    ])
}

/// Of all that the choice of the camera depends on: parts, placements and watched components, the camera, and where the
/// assembly may stand.
fn digest(design: &Design, station: &Station) -> String {
    let mut bare = essence(design);
    bare.materials.clear();
    bare.parts.iter_mut().for_each(|part| part.material = 0);
    let ranges = [station.x, station.y, station.z, station.rz];
    let text = ron::to_string(&(bare, &station.camera, ranges)).expect("plain data always serialises");
    format!("blake3:{}", blake3::hash(text.as_bytes()).to_hex())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled() -> (Design, Station) {
        let loaded = crate::design::load("tests/data/two_pins.gng", &|path| std::fs::read_to_string(path), &[]);
        let mut design = loaded.design.unwrap();
        let spread = |low: f64, high: f64| Range { low, nominal: (low + high) / 2.0, high };
        design.stations[0].camera.placing = CameraPlacing::Auto {
            distance: spread(250.0, 400.0),
            elevation: spread(0.7, 1.5),
            azimuth: spread(-2.0, 2.0),
        };
        let station = design.stations[0].clone();
        (design, station)
    }

    const CHOSEN: Placed = Placed { distance: 312.5, elevation: 1.123_456_789_012_345_6, azimuth: -0.1 };

    #[test]
    fn a_lock_comes_back_from_its_text_to_the_last_bit() {
        let (design, station) = sampled();
        let lock = Lock::default().with(&design, "bench".into(), Locked::new(&design, &station, CHOSEN));
        let back = Lock::read(&lock.write()).unwrap();
        assert_eq!(back, lock);
        assert_eq!(kept(Some(&back), true, &design, (&station, "bench")).unwrap(), Some(CHOSEN));
        for text in ["", "()", "(format: 2, stations: {})", "(format: 1, stations: {}, more: 1)"] {
            assert!(Lock::read(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_choice_stands_until_what_it_depended_on_changes() {
        let (design, station) = sampled();
        let lock = Lock::default().with(&design, "bench".into(), Locked::new(&design, &station, CHOSEN));
        let stands = |change: &dyn Fn(&mut Design, &mut Station)| {
            let (mut design, mut station) = (design.clone(), station.clone());
            change(&mut design, &mut station);
            kept(Some(&lock), false, &design, (&station, "bench")).unwrap().is_some()
        };
        assert!(stands(&|d, _| d.train.images += 1));
        assert!(stands(&|d, _| d.inspect.false_reject /= 2.0));
        assert!(stands(&|d, _| d.materials[0].reflectance = Range::exactly(0.3)));
        assert!(stands(&|_, s| s.lights[0].power *= 2.0));
        assert!(stands(&|d, _| d.parts[0].name.push('x')));
        assert!(!stands(&|d, _| d.dims[0].range.nominal += 0.1));
        assert!(!stands(&|d, _| d.inspect.watch.truncate(1)));
        assert!(!stands(&|_, s| s.camera.image = [320, 240]));
        assert!(!stands(&|_, s| s.x = Range::symmetric(0.0, 9.0)));
        assert!(!stands(
            &|_, s| s.camera.placing = CameraPlacing::Fixed { distance: 300.0, elevation: 1.0, azimuth: 0.0 }
        ));
    }

    #[test]
    fn only_places_that_the_spec_allows_are_kept() {
        let (design, station) = sampled();
        for placing in [Placed { distance: 1.0, ..CHOSEN }, Placed { elevation: f64::NAN, ..CHOSEN }] {
            let lock = Lock::default().with(&design, "bench".into(), Locked::new(&design, &station, placing));
            assert_eq!(kept(Some(&lock), false, &design, (&station, "bench")).unwrap(), None);
        }
    }

    #[test]
    fn a_variant_has_an_entry_of_its_own() {
        let (design, station) = sampled();
        let set = |pairs: &[(&str, &str)]| {
            let pairs: Vec<(String, String)> = pairs.iter().map(|(n, v)| (n.to_string(), v.to_string())).collect();
            entry(&station, &pairs)
        };
        assert_eq!(set(&[]), "bench");
        let variant = set(&[("b", "1"), ("a", "2"), ("b", "3")]);
        assert_eq!(variant, "bench --set a=2 --set b=3");
        let locked = || Locked::new(&design, &station, CHOSEN);
        let lock = Lock::default().with(&design, "bench".into(), locked()).with(&design, variant.clone(), locked());
        assert_eq!(lock.stations.keys().collect::<Vec<_>>(), ["bench", &variant]);
        // The other station has a fixed camera.
        assert_eq!(lock.with(&design, "second".into(), locked()).stations.len(), 2);
    }

    #[test]
    fn locked_says_why_it_refuses() {
        let (mut design, station) = sampled();
        let lock = Lock::default().with(&design, "bench".into(), Locked::new(&design, &station, CHOSEN));
        let why = |lock: Option<&Lock>, design: &Design| {
            kept(lock, true, design, (&station, "bench")).unwrap_err()[0].notes[0].clone()
        };
        assert_eq!(why(None, &design), "there is no lock");
        assert_eq!(why(Some(&Lock::default()), &design), "the lock has no `bench`");
        design.train.seed += 1;
        assert!(why(Some(&lock), &design).starts_with("the lock has seed"));
        design.dims[0].range.nominal += 0.1;
        assert!(why(Some(&lock), &design).contains("other parts"));
    }
}
