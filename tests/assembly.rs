//! What the paper says of its pattern wheel (section III), asked of the spec a user would write.

use gonogo::assembly::contact::ContactKind::{Cylinder, Plane};
use gonogo::assembly::fault::{self, ErrorMode, FaultKind, Motion};
use gonogo::assembly::{Analysis, analyse, liaison, place::place};
use gonogo::design::{load, model::Design};
use gonogo::diag::Diagnostic;
use gonogo::solid::{Quality, Solid, evaluate};
use nalgebra::{Point3, Vector3};
use std::sync::Arc;

#[path = "../benches/towers/mod.rs"]
mod towers;

struct Wheel {
    design: Design,
    solids: Vec<Arc<Solid>>,
    analysis: Analysis,
    diagnostics: Vec<Diagnostic>,
}

impl Wheel {
    fn new() -> Self {
        let design = load("specs/pattern_wheel.gng", &|path| std::fs::read_to_string(path), &[]).design.unwrap();
        let nominal = design.nominal();
        let part = |p| Arc::new(evaluate(p, &nominal, &Quality::default()).unwrap());
        let parts: Vec<Arc<Solid>> = design.parts.iter().map(part).collect();
        let solids: Vec<Arc<Solid>> = design.components.iter().map(|c| parts[c.part].clone()).collect();
        let (analysis, diagnostics) = analyse(&design, &solids);
        Wheel { design, solids, analysis, diagnostics }
    }

    fn index(&self, name: &str) -> usize {
        self.design.components.iter().position(|c| c.name == name).unwrap()
    }

    fn name(&self, component: usize) -> &str {
        &self.design.components[component].name
    }

    fn touching(&self, name: &str) -> Vec<&str> {
        self.analysis.liaison.neighbours(self.index(name)).iter().map(|c| self.name(*c)).collect()
    }

    fn modes(&self) -> Vec<ErrorMode> {
        fault::modes(&self.design, &self.analysis.liaison, &self.analysis.insertion, &self.solids)
    }
}

#[test]
fn the_liaison_diagram_is_the_papers() {
    let wheel = Wheel::new();
    let pins = ["alignment_pin[1]", "alignment_pin[2]", "alignment_pin[3]"];
    assert_eq!(wheel.touching("shaft"), ["gear"]);
    assert_eq!(wheel.touching("hd_pin"), ["wheel_a1", "wheel_a2"]);
    assert_eq!(wheel.touching("unlatch_pin"), ["wheel_a1", "wheel_a2"]);
    for pin in pins {
        assert_eq!(wheel.touching(pin), ["gear", "locking_ring", "wheel_a1", "wheel_a2"]);
    }
    assert_eq!(wheel.touching("locking_ring"), ["gear", pins[0], pins[1], pins[2]]);
    let liaison = &wheel.analysis.liaison;
    let kinds =
        |a: &str, b: &str| -> Vec<_> { liaison.between(wheel.index(a), wheel.index(b)).map(|c| c.kind).collect() };
    assert_eq!(kinds("gear", "locking_ring"), [Plane]);
    assert_eq!(kinds("hd_pin", "wheel_a1"), [Cylinder]);
    assert_eq!(kinds("shaft", "gear"), [Cylinder]);
}

#[test]
fn the_summary_names_surfaces_as_the_spec_does() {
    let wheel = Wheel::new();
    let summary = liaison::summary(&wheel.design, &wheel.solids, &wheel.analysis.liaison);
    let pair = summary.liaisons.iter().find(|p| p.a == "gear" && p.b == "shaft").unwrap();
    assert_eq!(pair.contacts[0].faces, ["bore.side", "stem.side"]);
    assert_eq!(pair.contacts[0].gap, [0.005, 0.029]);
    let rests = summary.liaisons.iter().find(|p| p.a == "gear" && p.b == "locking_ring").unwrap();
    assert_eq!((rests.contacts[0].gap, rests.contacts[0].fit), ([0.0, 0.0], None));
}

#[test]
fn everything_is_inserted_along_one_axis_and_nothing_interferes() {
    let wheel = Wheel::new();
    let insertion = &wheel.analysis.insertion;
    assert_eq!(insertion.common, Some([0.0, 0.0, 1.0]));
    let rounds: Vec<Vec<&str>> = insertion.rounds.iter().map(|r| r.iter().map(|c| wheel.name(*c)).collect()).collect();
    assert_eq!(rounds[0], ["shaft", "wheel_a2", "hd_pin", "unlatch_pin"]);
    assert_eq!(rounds[1], ["wheel_a1"]);
    assert_eq!(rounds[3], ["locking_ring"]);
    assert!(wheel.diagnostics.iter().all(|d| d.code == "W0502"), "{:#?}", wheel.diagnostics);
}

/// The wheel on top lies on the pins; the ring, which hangs on three pins, also fits by a third of a turn, but its notch is
/// then elsewhere. All other parts are held down or look alike at any angle.
#[test]
fn the_top_wheel_can_lie_on_the_pins_and_the_ring_fits_at_thirds_of_a_turn() {
    let wheel = Wheel::new();
    let modes = wheel.modes();
    let misplaced: Vec<&ErrorMode> = modes.iter().filter(|m| m.kind == FaultKind::Misplaced).collect();
    assert_eq!(misplaced.iter().map(|m| wheel.name(m.component)).collect::<Vec<_>>(), ["locking_ring", "wheel_a2"]);
    let [Motion::Turn(ring), Motion::Turn(turn)] = [0, 1].map(|i| &misplaced[i].motion) else {
        panic!("{misplaced:?}")
    };
    let middles: Vec<f64> = ring.ranges.iter().map(|r| ((r[0] + r[1]) / 2.0).to_degrees()).collect();
    assert!(ring.seated && middles.len() == 2, "{ring:?}");
    assert!((middles[0] - 120.0).abs() < 0.1 && (middles[1] + 120.0).abs() < 0.1, "{middles:?}");
    let mode = misplaced[1];
    assert!(!turn.seated && turn.ranges.len() == 2, "both ways: {turn:?}");
    let poses = place(&wheel.design, &wheel.design.nominal());
    for u in [[0.1, 0.0, 0.0], [0.8, 0.4, 0.0], [0.9, 1.0, 0.0]] {
        let pose = fault::apply(mode, u, &wheel.solids, &poses).pose.unwrap();
        let lift = (pose * Point3::origin()).z - 18.0;
        let tilt = (pose.rotation * Vector3::z()).angle(&Vector3::z()).to_degrees();
        assert!((2.59..4.0).contains(&lift) && tilt < 6.0, "{u:?}: lift {lift}, tilt {tilt}");
    }
}

#[test]
fn every_watched_component_can_be_missing_or_not_seated() {
    let wheel = Wheel::new();
    let modes = wheel.modes();
    for watch in &wheel.design.inspect.watch {
        let kinds: Vec<FaultKind> = modes.iter().filter(|m| m.component == watch.component).map(|m| m.kind).collect();
        assert_eq!(kinds[..2], [FaultKind::Missing, FaultKind::NotSeated], "{}", wheel.name(watch.component));
    }
}

/// What every generated size has to show; the figures of a thousand components are in `benches/assembly.rs`.
#[test]
fn towers_of_plates_and_pins_are_analysed_in_full() {
    for (towers, plates, columns, rows) in [(1, 2, 2, 1), (3, 4, 3, 2)] {
        let size = towers::Size { towers, plates, columns, rows };
        let (design, solids) = towers::build(size);
        let (analysis, diagnostics) = analyse(&design, &solids);
        assert_eq!(design.components.len(), size.components());
        assert_eq!(analysis.liaison.contacts.len(), size.contacts());
        assert_eq!(diagnostics, []);
        assert_eq!(analysis.insertion.common, Some([0.0, 0.0, 1.0]));
        assert_eq!(analysis.insertion.rounds.len(), plates, "{:?}", analysis.insertion.rounds);
        assert_eq!(analysis.insertion.rounds[0].len(), towers * (columns * rows + 1), "pins and the highest plates");
    }
}

/// A clip on two pegs that are too loose to be a fit; its outline tells which way round it is.
const CLIP: &str = "gonogo 1
units mm deg
tolerances exact
material plastic {
    kind        = plastic
    reflectance = 0.3
}
part plate {
    material = plastic
    add body     = box(x = 60, y = 30, z = 10)
    cut peg_hole = 2x hole(d = 3.3, h = 6) at (-8, 0, 10) on line(pitch = 16)
}
part clip {
    material = plastic
    add body = box(x = 24, y = 8, z = 3)
    add ear  = box(x = 6, y = 5, z = 3) at (-9, 5.5)
    add peg  = 2x cylinder(d = 3, h = 4) at (-8, 0, -4) on line(pitch = 16)
}
part label {
    material = plastic
    add body = box(x = 9, y = 5, z = 1)
}
part ring {
    material = plastic
    add body = cylinder(d = 8, h = 2)
    cut bore = cylinder(d = 4, h = through)
}
assembly block {
    root plate
    place clip on plate {
        z  = 10
        rz = 0 ±0.5
    }
    place label on plate {
        x  = -22
        z  = 10
        rz = 0 ±0.5
    }
    place ring on plate {
        x  = 20
        z  = 10
        rz = 0 ±0.5
    }
}
station bench {
    light room = room(patches = 9)
}
inspect block { }
";

#[test]
fn a_clip_on_loose_pegs_can_stand_on_them_or_be_the_wrong_way_round() {
    let design = load("clip.gng", &|_| Ok(CLIP.into()), &[]);
    let design = design.design.unwrap_or_else(|| panic!("{:?}", design.diagnostics));
    let nominal = design.nominal();
    let solid = |c: usize| evaluate(&design.parts[design.components[c].part], &nominal, &Quality::default());
    let solids: Vec<Arc<Solid>> = (0..design.components.len()).map(|c| Arc::new(solid(c).unwrap())).collect();
    let (analysis, _) = analyse(&design, &solids);
    let modes = fault::modes(&design, &analysis.liaison, &analysis.insertion, &solids);
    let misplaced: Vec<&ErrorMode> = modes.iter().filter(|m| m.kind == FaultKind::Misplaced).collect();
    let names: Vec<&str> = misplaced.iter().map(|m| design.components[m.component].name.as_str()).collect();
    assert_eq!(names, ["clip", "clip", "label", "label", "ring"], "the ring looks alike at any angle");
    let beside = |m: &&&ErrorMode| matches!(m.motion, Motion::Shift(_));
    let beside: Vec<&str> =
        misplaced.iter().filter(beside).map(|m| design.components[m.component].name.as_str()).collect();
    assert_eq!(beside, ["label", "ring"], "pegs hold the clip");
    let poses = place(&design, &nominal);
    let standing = fault::apply(misplaced[0], [0.9, 0.0, 0.0], &solids, &poses);
    let up = standing.pose.unwrap().translation.z - 10.0;
    assert!((up - 4.0).abs() < 0.05, "on its pegs: {up}");
    let reversed = fault::apply(misplaced[1], [0.5, 0.0, 0.0], &solids, &poses);
    assert!(reversed.size.abs().to_degrees() > 179.0, "{}", reversed.text);
    let pegs = reversed.pose.unwrap() * Point3::new(8.0, 0.0, -4.0);
    assert!((pegs - Point3::new(-8.0, 0.0, 6.0)).norm() < 0.2, "{pegs}");
    let askew = fault::apply(misplaced[2], [1.0, 0.0, 0.0], &solids, &poses);
    assert_eq!(askew.text, "turned 40.0 deg", "nothing keeps it from turning");
}

/// A screw on a washer of the library follows that washer: their faces stay together at every draw.
#[test]
fn what_rests_on_a_piece_follows_its_true_thickness() {
    let spec = "gonogo 1\ntolerances ISO2768-m\nuse \"std/iso4762\"\nuse \"std/iso7089\"\nmaterial steel {\n    metal = steel\n}\npart plate {\n    material = steel\n    let t = 16\n    add slab = box(x = 80, y = 50, z = t)\n    cut bore = 2x cylinder(d = 5 basic, h = through) on line(pitch = 40)\n}\npart washer = iso7089(d = M5)\npart screw = iso4762(d = M5, l = 16)\nassembly stack {\n    root plate\n    place screw = 2x screw on plate.bore {\n        z = (plate.t + washer.h + 0 * screw.k)\n    }\n    place washer = 2x washer on plate.bore {\n        z = plate.t\n    }\n}\nstation bench {\n    light room = room()\n}\n";
    let loaded = load("spec.gng", &|_| Ok(spec.to_string()), &[]);
    assert!(loaded.diagnostics.is_empty(), "{:?}", loaded.diagnostics);
    let design = loaded.design.unwrap();
    let at = |name: &str| design.components.iter().find(|c| c.name == name).unwrap();
    let row = |name: &str| design.dims.iter().position(|d| d.name == name).unwrap_or_else(|| panic!("no {name}"));
    let (t, first, second) = (row("plate.t"), row("washer[1].h"), row("washer[2].h"));
    let mut values = design.nominal();
    (values[t], values[first], values[second]) = (16.1, 0.93, 1.07);
    for (screw, h) in [("screw[1]", 0.93), ("screw[2]", 1.07)] {
        let z = at(screw).pose.t[2].eval(&values);
        assert!((z - (16.1 + h)).abs() < 1e-12, "{screw}: {z}");
    }
    assert!(design.dims.iter().all(|d| !d.name.starts_with("screw[1].z")), "its place has limits of its own");
    let solid = |c: &gonogo::design::model::Component| {
        Arc::new(evaluate(&design.parts[c.part], &design.nominal(), &Quality::default()).unwrap())
    };
    let solids: Vec<Arc<Solid>> = design.components.iter().map(solid).collect();
    let (_, found) = analyse(&design, &solids);
    assert!(found.iter().all(|d| !d.message.contains("can enter")), "{found:?}");
}
