//! Flats along shafts: the commonest cut whose edge on a chamfer is a hyperbola.

use gonogo::design::load;
use gonogo::solid::{Quality, evaluate};

/// Area of what a flat at distance `flat` from the axis leaves of a round section.
fn section(radius: f64, flat: f64) -> f64 {
    let round = std::f64::consts::PI * radius * radius;
    if flat >= radius {
        return round;
    }
    round - (radius * radius * (flat / radius).acos() - flat * (radius * radius - flat * flat).sqrt())
}

/// Simpson's rule.
fn integral(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let count = 20_000;
    let step = (to - from) / f64::from(count);
    let weight = |i: i32| if i == 0 || i == count { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
    (0..=count).map(|i| weight(i) * f(from + step * f64::from(i))).sum::<f64>() * step / 3.0
}

#[test]
fn a_flat_runs_out_through_a_chamfer_at_any_size() {
    for (d, h) in [15.0_f64, 14.966, 14.984, 14.9].iter().flat_map(|d| [29.8, 30.0, 30.2].map(|h| (*d, h))) {
        for (chamfer, flat) in [0.5, 1.0, 1.2, 1.6].iter().flat_map(|c| [5.5, 6.3].map(|f| (*c, f))) {
            let spec = format!(
                "gonogo 1\ntolerances exact\nmaterial steel {{\n    metal = steel\n}}\npart shaft {{\n    material = steel\n    add journal = cylinder(d = {d}, h = {h}, chamfer_top = {chamfer})\n    cut flat = box(x = 4, y = 20, z = 16) at ({}, 0, 16)\n}}\nassembly a {{\n    root shaft\n}}\nstation s {{\n    light room = room()\n}}\n",
                flat + 2.0
            );
            let design = load("flat.gng", &|_| Ok(spec.clone()), &[]).design.unwrap();
            let solid = evaluate(&design.parts[0], &design.nominal(), &Quality::default());
            let solid = solid.unwrap_or_else(|faults| panic!("{d} {h} {chamfer} {flat}: {faults:?}"));
            let (radius, shoulder) = (d / 2.0, h - chamfer);
            // The square root at the end of the flat is split off, so that Simpson's rule meets it at an end only.
            let end = (radius - flat).clamp(0.0, chamfer);
            let on_chamfer = |z: f64| section(radius - z, flat);
            let expected = section(radius, f64::INFINITY) * 16.0
                + section(radius, flat) * (shoulder - 16.0)
                + integral(on_chamfer, 0.0, end)
                + integral(on_chamfer, end, chamfer);
            assert!((solid.volume - expected).abs() < 1e-5, "{d} {h} {chamfer} {flat}: {} {expected}", solid.volume);
        }
    }
}
