//! Boundary evaluation of the reference parts, with triangles: least and median of many runs, in ms.
//!
//! `cargo bench --bench kernel`, or `benches/open_cascade.py`, which times Open CASCADE on the same parts in the same run and
//! prints the ratio. The lines are meant for both: a name, two numbers.

#[path = "../tests/exchange/collection.rs"]
#[allow(dead_code)]
mod collection;

use gonogo::solid::{Quality, evaluate};
use std::hint::black_box;
use std::time::Instant;

/// Runs per part.
const RUNS: usize = 30;

fn main() {
    for (name, features) in collection::reference() {
        let part = collection::part(name, features);
        let quality = Quality::default();
        let mut times: Vec<f64> = (0..RUNS)
            .map(|_| {
                let started = Instant::now();
                let solid = evaluate(black_box(&part), &[], &quality);
                assert!(black_box(solid).is_ok(), "{name}");
                started.elapsed().as_secs_f64() * 1e3
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{name} {:.4} {:.4}", times[0], times[RUNS / 2]);
    }
}
