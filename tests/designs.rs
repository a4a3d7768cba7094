//! Designs that other people made: examples that come with OpenSCAD, in its own output (tests/data/openscad).
//!
//! The oracle is OpenSCAD's mesh of each, with 100 facets a turn: volumes agree to what the facets cut off, which is at
//! most 0.1 % of the box round the design; where there is a formula, it is the oracle. Of what has no counterpart here, the node is named.

#![cfg(feature = "compile")]

use gonogo::design::load;
use gonogo::import::openscad;
use gonogo::solid::{Quality, boundary};
use std::fs;
use std::path::Path;

/// Design, parts, volume of OpenSCAD's mesh (mm³), volume of the box round it.
const MESHES: [(&str, usize, f64, f64); 7] = [
    ("example001", 1, 18_686.217, 81_159.5),
    ("example002", 1, 12_312.541, 31_500.0),
    ("example003", 1, 23_750.0, 64_000.0),
    ("example004", 1, 2_142.882, 27_000.0),
    ("example005", 1, 2_250_200.516, 16_128_000.0),
    ("example014", 1, 5_936.760, 10_009.8),
    ("logo", 1, 18_686.217, 81_159.5),
];

fn design(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/openscad").join(format!("{name}.csg"));
    fs::read_to_string(path).unwrap()
}

/// The volumes of the parts at nominal (mm³).
fn volumes(name: &str) -> Vec<f64> {
    let text =
        openscad(&design(name), &format!("{name}.csg"), name).unwrap_or_else(|faults| panic!("{name}: {faults:#?}"));
    let names: Vec<&str> = text.lines().filter_map(|l| l.strip_prefix("part ")?.split(' ').next()).collect();
    let place = |part: &&str| format!("    place {part} on {}\n", names[0]);
    let places: String = names[1..].iter().map(place).collect();
    let rest = format!("assembly it {{\n    root {}\n{places}}}\nstation s {{\n    light l = room()\n}}\n", names[0]);
    let spec = format!("{text}\n{rest}");
    let loaded = load("x.gng", &|_| Ok(spec.clone()), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{text}\n{:#?}", loaded.diagnostics));
    let volume = |part| boundary(part, &design.nominal(), &Quality::default()).map(|solid| solid.volume);
    design.parts.iter().map(|part| volume(part).unwrap_or_else(|faults| panic!("{name}: {faults:#?}"))).collect()
}

#[test]
fn volumes_are_those_of_openscad() {
    for (name, parts, volume, whole) in MESHES {
        let own = volumes(name);
        assert_eq!(own.len(), parts, "{name}");
        let sum: f64 = own.iter().sum();
        assert!((sum - volume).abs() < 1e-3 * whole, "{name}: {sum}, OpenSCAD {volume}");
    }
}

/// A block with a ball, its common part, and the block without the ball: by hand.
#[test]
fn the_first_example_has_the_volumes_of_its_formulas() {
    let (block, ball) = (15f64.powi(3), 4.0 / 3.0 * std::f64::consts::PI * 1000.0);
    // Six caps of height 2.5 stand out of the block.
    let caps = 6.0 * std::f64::consts::PI * 2.5 * 2.5 * (30.0 - 2.5) / 3.0;
    for (own, exact) in volumes("CSG").into_iter().zip([block + caps, ball - caps, block - ball + caps]) {
        assert!((own - exact).abs() < 1e-6 * exact, "{own}, {exact}");
    }
}

/// Two boxes of 20 x 30 x 40, one rounded along z, one all round, by 5.
#[test]
fn rounded_boxes_have_the_volumes_of_their_formulas() {
    use std::f64::consts::PI;
    let along = 40.0 * (20.0 * 30.0 - (4.0 - PI) * 25.0);
    let core = 10.0 * 20.0 * 30.0;
    let slabs = 2.0 * 5.0 * (10.0 * 20.0 + 20.0 * 30.0 + 10.0 * 30.0);
    let round = core + slabs + PI * 25.0 * (10.0 + 20.0 + 30.0) + 4.0 / 3.0 * PI * 125.0;
    let own = volumes("example022");
    assert_eq!(own.len(), 2);
    for (own, exact) in own.into_iter().zip([along, round]) {
        assert!((own - exact).abs() < 1e-6 * exact, "{own}, {exact}");
    }
}

#[test]
fn each_of_many_small_bodies_has_its_volume() {
    let exact = [[8.0; 41], [4.0 / 3.0 * std::f64::consts::PI; 41]].concat();
    let own = volumes("functions");
    assert_eq!(own.len(), exact.len());
    for (own, exact) in own.into_iter().zip(exact) {
        assert!((own - exact).abs() < 1e-6 * exact, "{own}, {exact}");
    }
}

#[test]
fn what_has_no_counterpart_is_named() {
    let refused = [
        ("linear_extrude", "`linear_extrude`", "makes slanted sides"),
        ("linear_extrude", "`linear_extrude`", "makes a screw surface"),
        ("example006", "`hull`", "draw its outline"),
        ("example011", "`polyhedron`", "a mesh"),
    ];
    for (name, node, why) in refused {
        let faults = openscad(&design(name), &format!("{name}.csg"), name).unwrap_err();
        let told = |d: &gonogo::diag::Diagnostic| {
            d.code == "E0902" && d.message.contains(node) && d.labels[0].text.contains(why)
        };
        assert!(faults.iter().any(told), "{name}: {faults:#?}");
    }
}
