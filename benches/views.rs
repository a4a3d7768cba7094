//! What the choice of the camera buys: `cargo bench --bench views`.
//!
//! One small spec whose camera may stand anywhere over it. A model is trained for the view of least predicted escape, for
//! the view of the paper's score and for random views, and each is held against fresh renders (`gonogo prove`): of every
//! error mode the share of faulty assemblies that pass. A mode that changes nothing in the image passes always; so does all
//! of a view from which a watched component is not seen. `--spec FILE`, `--random N` and `--faults N` change the defaults.

use gonogo::artifacts::Artifact;
use gonogo::assembly::fault::{ErrorMode, Motion};
use gonogo::design::model::CameraPlacing;
use gonogo::rng::Stream;
use gonogo::scene::build::Placed;
use gonogo::train::prove::Trials;
use gonogo::units::Range;
use gonogo::view::escape::compare;
use gonogo::{Compiled, Options, compile, prove};
use std::collections::BTreeMap;

/// Random views unless told, and assemblies rendered with each error mode.
const RANDOM: u32 = 5;
const FAULTS: u32 = 40;
const SEED: u64 = 20;

fn main() {
    let said: Vec<String> = std::env::args().collect();
    let option = |name: &str| said.iter().position(|a| a == name).and_then(|i| said.get(i + 1));
    let count = |name: &str, usual: u32| option(name).and_then(|v| v.parse().ok()).unwrap_or(usual);
    let own = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/views/pegs.gng");
    let spec = option("--spec").map_or(own, String::as_str);
    let (random, faults) = (count("--random", RANDOM), count("--faults", FAULTS));

    let kept = Options { keep: true, wanted: [Artifact::View].into(), ..Options::default() };
    let made = run(spec, None, &kept).made;
    let (Some(design), Some(choice)) = (made.design, made.choice) else { panic!("`{spec}` has faults") };
    let predicted = |view: usize| choice.shortlist.iter().find(|w| w.view == view).map(|w| [w.worst(), w.mean()]);
    let by_escape = choice.shortlist.iter().min_by(|a, b| compare(&choice.table, a, b)).map_or(choice.best, |w| w.view);
    println!("{spec}: {} views tried, {} weighed", choice.table.len(), choice.shortlist.len());
    println!("{:<18} {:>5} {:>6} {:>6} {:>6}  predicted      measured", "view", "mm", "elev", "azim", "score");
    let mut done: Vec<(Placed, [f64; 2])> = Vec::new();
    for (name, view) in [("predicted escape", by_escape), ("paper's score", choice.best)] {
        let scored = &choice.table[view];
        let known = done.iter().find(|(placing, _)| *placing == scored.placing).map(|d| d.1);
        let measured = known.unwrap_or_else(|| measure(spec, scored.placing, faults));
        done.push((scored.placing, measured));
        line(name, scored.placing, Some(scored.score), predicted(view), measured);
    }
    let CameraPlacing::Auto { distance, elevation, azimuth } = &design.stations[made.station].camera.placing else {
        panic!("the camera of `{spec}` is fixed")
    };
    for i in 0..random {
        let mut stream = Stream::new(SEED, "random view", u64::from(i));
        let mut within = |range: &Range| stream.between(range.low, range.high);
        let placing = Placed { distance: within(distance), elevation: within(elevation), azimuth: within(azimuth) };
        line(&format!("random {}", i + 1), placing, None, None, measure(spec, placing, faults));
    }
}

fn line(name: &str, p: Placed, score: Option<f64>, predicted: Option<[f64; 2]>, measured: [f64; 2]) {
    let pair = |[worst, mean]: [f64; 2]| format!("{:5.1} % {:5.1} %", 100.0 * worst, 100.0 * mean);
    println!(
        "{name:<18} {:>5.0} {:>6.1} {:>6.1} {:>6}  {:<15} {}",
        p.distance,
        p.elevation.to_degrees(),
        p.azimuth.to_degrees(),
        score.map_or_else(|| "-".into(), |s| format!("{s:.1}")),
        predicted.map_or_else(|| "-".into(), pair),
        pair(measured)
    );
}

/// The worst and the mean measured escape of the error modes from a view.
fn measure(spec: &str, placing: Placed, faults: u32) -> [f64; 2] {
    let options = Options { wanted: [Artifact::Model].into(), ..Options::default() };
    let modes = run(spec, Some(placing), &Options { keep: true, ..options.clone() });
    // What no view shows has no row: it passes.
    let mut escapes: BTreeMap<(String, String), f64> = BTreeMap::new();
    let design = modes.made.design.as_ref().expect("a spec without faults");
    // Another piece of the same part is no wrong part: it looks the same from everywhere.
    let part = |component: usize| &design.parts[design.components[component].part].name;
    let is_twin =
        |mode: &&ErrorMode| matches!(mode.motion, Motion::Replace { by, .. } if part(by) == part(mode.component));
    for mode in modes.made.modes.iter().filter(|m| !is_twin(m)) {
        escapes.insert((design.components[mode.component].name.clone(), mode.kind.word().into()), 1.0);
    }
    if let Some(model) = &modes.model {
        // As many faults as goods are rendered at most.
        let trials = Trials { goods: faults, faults, customers: 2 };
        let read = |name: &str| text(name, spec, Some(placing));
        if let Some(proof) = prove(spec, &read, &options, model, trials, &|_| ()).proof {
            let mut shown: BTreeMap<(String, String), f64> = BTreeMap::new();
            for mode in &proof.rates.modes {
                let share = f64::from(mode.escape.events) / f64::from(mode.escape.trials.max(1));
                let worst = shown.entry((mode.component.clone(), mode.fault.clone())).or_insert(0.0);
                *worst = worst.max(share);
            }
            escapes.iter_mut().for_each(|(mode, share)| *share = shown.get(mode).copied().unwrap_or(*share));
        }
    }
    [escapes.values().copied().fold(0.0, f64::max), escapes.values().sum::<f64>() / escapes.len().max(1) as f64]
}

fn run(spec: &str, placing: Option<Placed>, options: &Options) -> Compiled {
    compile(spec, &|name| text(name, spec, placing), options, &|_| ())
}

/// The spec with its camera fixed at a place; other files as they are.
fn text(name: &str, spec: &str, placing: Option<Placed>) -> std::io::Result<String> {
    let text = std::fs::read_to_string(name)?;
    let Some(Placed { distance, elevation, azimuth }) = placing.filter(|_| name == spec) else { return Ok(text) };
    let is_place = |line: &&str| ["distance", "elevation", "azimuth"].iter().any(|k| line.trim_start().starts_with(k));
    let fixed: Vec<&str> = text.lines().filter(|line| !is_place(line)).collect();
    let [elevation, azimuth] = [elevation, azimuth].map(f64::to_degrees);
    let place = format!(
        "camera fixed {{\n        distance = {distance}\n        elevation = {elevation} deg\n        azimuth = {azimuth} deg"
    );
    Ok(fixed.join("\n").replace("camera auto {", &place))
}
