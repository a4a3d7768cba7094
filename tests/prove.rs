//! A model's promise is measured on as many fresh renders as asked for, the same on any number of threads.

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
    assert_eq!(proof.false_reject.trials, 6);
    assert!(!proof.modes.is_empty());
    assert_eq!(proof.modes.len(), model.promise.modes.len());
    for mode in &proof.modes {
        assert_eq!(mode.escape.trials, 4, "{} {}", mode.component, mode.fault);
    }
    assert_eq!(proof, measure(1));

    let changed = |path: &str| read(path).map(|text| text.replace("z = 4 ±0.05", "z = 4 ±0.06"));
    let other = prove(SPEC, &changed, &options(), &model, trials, &|_| ());
    assert!(other.proof.is_none(), "a model of another spec proves nothing");
}
