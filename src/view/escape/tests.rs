//! Raised parts escape from above, play is no evidence, and threads change nothing.

use super::*;
use crate::assembly::error_tree::levels;
use crate::design::model::CameraPlacing;
use crate::scene::build::Instance;
use crate::solid::{Quality, evaluate};
use crate::units::Range;

/// The plate with two pins that stand through it, seen by a camera that may stand anywhere above 30 degrees.
struct Bench {
    design: Design,
    solids: Vec<Arc<Solid>>,
    bodies: Vec<Body>,
    modes: Vec<ErrorMode>,
    targets: Vec<Target>,
}

impl Bench {
    fn new() -> Bench {
        let text = include_str!("../../../tests/data/two_pins.gng");
        let mut design = crate::design::load("two_pins.gng", &|_| Ok(text.into()), &[]).design.expect("a fine spec");
        let nominal = design.nominal();
        let part = |c: usize| &design.parts[design.components[c].part];
        let solid = |c: usize| Arc::new(evaluate(part(c), &nominal, &Quality::default()).expect("a solid"));
        let solids: Vec<Arc<Solid>> = (0..design.components.len()).map(solid).collect();
        let (found, _) = crate::assembly::analyse(&design, &solids);
        let modes = fault::all(&design, &found.liaison, &found.insertion, &solids);
        let targets = choose::targets(&levels(&design, &found.liaison));
        let finish = |c: usize| build::finish_nominal(&design.materials[part(c).material]);
        let instance = Instance {
            solids: solids.iter().cloned().map(Some).collect(),
            poses: place(&design, &nominal),
            finishes: (0..solids.len()).map(finish).collect(),
        };
        let bodies = build::bodies(&instance, [0.0; 4]);
        let degrees = |low: f64, high: f64| {
            let [low, high] = [low, high].map(f64::to_radians);
            Range { low, nominal: low, high }
        };
        design.stations[0].camera.placing = CameraPlacing::Auto {
            distance: Range::exactly(250.0),
            elevation: degrees(30.0, 90.0),
            azimuth: degrees(-180.0, 180.0),
        };
        Bench { design, solids, bodies, modes, targets }
    }

    fn task(&self) -> Task<'_> {
        Task {
            design: &self.design,
            station: &self.design.stations[0],
            bodies: &self.bodies,
            targets: &self.targets,
            modes: &self.modes,
            solids: &self.solids,
            asks: Asks::What,
        }
    }

    fn escapes(&self, elevation_deg: f64) -> Vec<ModeEscape> {
        let placing = Placed { distance: 250.0, elevation: elevation_deg.to_radians(), azimuth: -1.57 };
        Predictor::new(&self.task()).escapes(&build::camera(&self.task().station.camera, placing))
    }
}

#[test]
fn the_normal_distribution_is_that_of_the_tables() {
    for (z, p) in [(0.0, 0.5), (1.0, 0.841_344_7), (1.959_964, 0.975), (-3.0, 0.001_349_9)] {
        assert!((normal(z) - p).abs() < 2e-7, "{z}");
        assert!((normal_quantile(p) - z).abs() < 1e-4, "{p}");
    }
}

/// A signal along a nuisance of n standard deviations keeps 1 / (1 + n²) of its square; one across it keeps all.
#[test]
fn what_play_may_do_is_no_evidence() {
    let vector = |values: &[f64]| DVector::from_column_slice(values);
    let observer = Observer::new(vector(&[0.5; 4]), vec![vector(&[1.5, 0.0, 0.0, 0.0])]);
    let along = observer.detectability(&vector(&[1.0, 0.0, 0.0, 0.0]));
    let across = observer.detectability(&vector(&[0.0, 1.0, 0.0, 0.0]));
    assert!((along - (4.0 / 10.0 / TOGETHER).sqrt()).abs() < 1e-12, "{along}");
    assert!((across - (4.0 / TOGETHER).sqrt()).abs() < 1e-12, "{across}");
}

#[test]
fn a_picture_put_together_is_the_picture_of_all() {
    let bench = Bench::new();
    let placing = Placed { distance: 250.0, elevation: 1.0, azimuth: 0.4 };
    let camera = build::camera(&bench.task().station.camera, placing);
    let predictor = Predictor::new(&bench.task());
    for variant in predictor.variants.iter().filter(|v| !v.put.is_empty()) {
        let mut together = predictor.without(&variant.moved, &camera);
        lay_over(&mut together, &ItemBuffer::of(&variant.put, &camera));
        let mut all: Vec<Body> =
            bench.bodies.iter().filter(|b| !variant.moved.contains(&b.component)).cloned().collect();
        all.extend(variant.put.iter().cloned());
        assert_eq!(together.id, ItemBuffer::of(&all, &camera).id);
    }
}

#[test]
fn a_raised_pin_escapes_from_above_and_not_from_the_side() {
    let bench = Bench::new();
    let raised = |escapes: Vec<ModeEscape>| {
        let own = escapes.iter().filter(|m| m.kind == FaultKind::NotSeated).map(|m| m.share);
        own.fold(0.0, f64::max)
    };
    let (above, side) = (raised(bench.escapes(90.0)), raised(bench.escapes(50.0)));
    assert!(above > side + 0.2, "{above} {side}");
    let missing = bench.escapes(90.0);
    let gone = missing.iter().filter(|m| m.kind == FaultKind::Missing).map(|m| m.share).fold(0.0, f64::max);
    assert!(gone < above, "{gone}");
}

#[test]
fn the_shortlist_is_weighed_alike_on_any_number_of_threads() {
    let bench = Bench::new();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| choose(&bench.task()))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!((one.best, &one.table, &one.shortlist), (three.best, &three.table, &three.shortlist));
    let order: Vec<&Weighed> = one.weighed().collect();
    assert_eq!((order[0].view, one.shortlist[0].view, one.best), (one.best, one.best, first(&one.table)));
    // After the chosen view the others, from the least worst escape up.
    assert!(order.len() > 3 && order[1..].is_sorted_by(|a, b| a.worst() <= b.worst() + SAME));
    assert!(one.shortlist.iter().all(|w| w.escapes.len() == bench.modes.len()));
    assert!(one.cameras.contains(&one.best));
    let kept = keep(&bench.task(), one.table[7].placing);
    assert_eq!(kept.best, 7);
    assert_eq!(kept.weighed().next().unwrap().view, 7);
}
