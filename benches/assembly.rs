//! How the analysis of an assembly grows with its size: `cargo bench --bench assembly`.

mod towers;

use gonogo::assembly::{analyse, contact::contacts};
use towers::{Size, build};

fn main() {
    divan::main();
}

/// From about a hundred components to a thousand, with 10,800 contacts.
const SIZES: [usize; 4] = [1, 2, 5, 10];

fn size(towers: usize) -> Size {
    Size { towers, plates: 11, columns: 9, rows: 10 }
}

#[divan::bench(args = SIZES, sample_count = 5)]
fn contact_finding(bencher: divan::Bencher, towers: usize) {
    let (design, solids) = build(size(towers));
    bencher
        .counter(divan::counter::ItemsCount::new(size(towers).contacts()))
        .bench(|| contacts(&design, &solids).len());
}

#[divan::bench(args = SIZES, sample_count = 5)]
fn whole_analysis(bencher: divan::Bencher, towers: usize) {
    let (design, solids) = build(size(towers));
    bencher
        .counter(divan::counter::ItemsCount::new(size(towers).contacts()))
        .bench(|| analyse(&design, &solids).1.len());
}
