//! What a model file promises: measured on as many fresh renders as asked for, the same on any number of threads; and what
//! it makes of faults that it was never taught.

use gonogo::runtime::calibrate;
use gonogo::runtime::inspect::{Decision, Inspector};
use gonogo::runtime::photo::Photo;
use gonogo::train::prove::Trials;
use gonogo::{Options, artifacts::Artifact, compile, prove};

const SPEC: &str = "tests/data/two_pins.gng";

fn options() -> Options {
    Options { wanted: [Artifact::Model].into(), ..Options::default() }
}

#[test]
fn a_proof_counts_every_good_and_every_fault() {
    let read = |path: &str| std::fs::read_to_string(path);
    let compiled = compile(SPEC, &read, &options(), &|_| ());
    let model = compiled.model.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics));
    let trials = Trials { goods: 6, faults: 4, customers: 2 };
    let measure = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| prove(SPEC, &read, &options(), &model, trials, &|_| ())).proof.unwrap()
    };
    let proof = measure(2);
    assert_eq!(proof.rates.false_reject.trials, 6);
    assert!(!proof.rates.modes.is_empty());
    assert_eq!(proof.rates.modes.len(), model.promise.modes.len());
    assert_eq!(proof.seen_from.len(), proof.rates.modes.len());
    for mode in &proof.rates.modes {
        assert_eq!(mode.escape.trials, 4, "{} {}", mode.component, mode.fault);
    }
    let rejected = proof.rates.false_reject.events;
    assert!(proof.blamed.iter().map(|b| b.photos).sum::<u32>() >= rejected, "{:?}", proof.blamed);
    assert_eq!(proof, measure(1));

    let changed = |path: &str| read(path).map(|text| text.replace("z = 4 ±0.05", "z = 4 ±0.06"));
    let other = prove(SPEC, &changed, &options(), &model, trials, &|_| ());
    assert!(other.proof.is_none(), "a model of another spec proves nothing");
}

/// A foreign object on a part is no modelled fault. It must not pass, wherever on the part it lies.
#[test]
fn what_nobody_modelled_does_not_pass() {
    // Four draws hardly tell what is strange.
    let read = |path: &str| std::fs::read_to_string(path).map(|text| text.replace("images  = 4", "images  = 12"));
    let wanted = [Artifact::Model, Artifact::Images].into();
    let compiled = compile(SPEC, &read, &Options { wanted, ..Options::default() }, &|_| ());
    let model = compiled.model.unwrap_or_else(|| panic!("{:?}", compiled.diagnostics));
    let good = image::load_from_memory(&compiled.artifacts["images/good.png"]).unwrap().to_luma8();
    let photo = |image: &image::GrayImage| {
        let mut png = std::io::Cursor::new(Vec::new());
        image.write_to(&mut png, image::ImageFormat::Png).unwrap();
        Photo::decode(&png.into_inner(), model.station.tone, model.station.camera.size).unwrap()
    };
    let calibration = calibrate::fit(&model, &[photo(&good)]).unwrap();
    let inspector = Inspector::new(&model, &calibration).unwrap();
    let verdict = inspector.inspect(&photo(&good));
    assert_eq!(verdict.decision, Decision::Go, "{}", verdict.reason);
    for node in &model.nodes {
        let [x0, y0, x1, y1] = node.visible.map(|v| v as u32);
        // Stripes: neither the bright pin nor the dark hole.
        let mut covered = good.clone();
        let inside = |x: u32, y: u32| (x0..x1).contains(&x) && (y0..y1).contains(&y);
        for (x, y, pixel) in covered.enumerate_pixels_mut().filter(|(x, y, _)| inside(*x, *y)) {
            pixel.0 = [if (x / 4 + y / 4) % 2 == 0 { 250 } else { 5 }];
        }
        let verdict = inspector.inspect(&photo(&covered));
        assert_ne!(verdict.decision, Decision::Go, "{}", node.name);
        if verdict.decision == Decision::CannotInspect {
            assert!(verdict.reason.starts_with(&node.name), "{}", verdict.reason);
        }
    }
}
