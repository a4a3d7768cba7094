//! Every part of the pattern wheel, at its limits and between them.

use super::*;
use crate::design::model::Design;
use crate::rng::Stream;

fn design() -> Design {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/specs/pattern_wheel.gng");
    let loaded = crate::design::load(path, &|name| std::fs::read_to_string(name), &[]);
    loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics))
}

fn evaluated(part: &Part, values: &[f64]) -> Solid {
    let solid = evaluate(part, values, &Quality::default()).unwrap_or_else(|faults| panic!("{faults:#?}"));
    check_mesh(&solid);
    solid
}

#[test]
fn least_material_is_less_than_most_with_the_same_faces() {
    let design = design();
    for part in &design.parts {
        let [lmc, nominal, mmc] = [design.lmc(), design.nominal(), design.mmc()].map(|v| evaluated(part, &v));
        assert!(lmc.volume < nominal.volume && nominal.volume < mmc.volume, "{}", part.name);
        assert!(lmc.counts() == nominal.counts() && nominal.counts() == mmc.counts(), "{}", part.name);
        let names = |s: &Solid| s.faces.iter().map(|f| f.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&lmc), names(&mmc));
    }
}

#[test]
fn wheel_has_its_closed_form() {
    let design = design();
    let part = design.parts.iter().find(|p| p.name == "wheel_a1").expect("the wheel");
    let half = |y: f64, r: f64| (y * (r * r - y * y).sqrt() + r * r * (y / r).asin()) / 2.0;
    let slot = 2.0 * half(0.5, 28.0) - 26.5;
    let round = [10.0, 2.25, 2.25, 2.25, 1.25, 1.75, 4.5, 4.5, 4.5].iter().map(|r: &f64| PI * r * r).sum::<f64>();
    let volume = 2.0 * (PI * 784.0 - round - 24.0 * slot);
    let solid = evaluated(part, &design.nominal());
    assert!((solid.volume - volume).abs() < 1e-8, "{} {volume}", solid.volume);
}

#[test]
fn draws_within_tolerance_all_make_solids() {
    let design = design();
    for index in 0..6 {
        let mut stream = Stream::new(1, "draws of the solid tests", index);
        let values: Vec<f64> = design.dims.iter().map(|d| d.range.at(stream.uniform())).collect();
        design.parts.iter().for_each(|part| drop(evaluated(part, &values)));
    }
}
