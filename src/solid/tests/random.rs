//! Random parts on a coarse lattice, where faces coincide all the time, against brute force and set algebra.

use super::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Edge of the cube of unit cells that the boxes lie in.
const CELLS: i32 = 6;

/// An operation and a box from one lattice corner to another.
type Lattice = (Op, [i32; 3], [i32; 3]);

fn lattice_box() -> impl Strategy<Value = Lattice> {
    let op = prop_oneof![4 => Just(Op::Add), 3 => Just(Op::Cut), 1 => Just(Op::Keep)];
    let span = || (0..CELLS, 1..CELLS).prop_map(|(low, size)| (low, (low + size).min(CELLS)));
    (op, span(), span(), span()).prop_map(|(op, x, y, z)| (op, [x.0, y.0, z.0], [x.1, y.1, z.1]))
}

fn lattice_feature((i, (op, low, high)): (usize, &Lattice)) -> Feature {
    let [x, y, z] = [0, 1, 2].map(|k| f64::from(high[k] - low[k]));
    let [cx, cy] = [0, 1].map(|k| f64::from(high[k] + low[k]) / 2.0);
    feature(&format!("f{i}"), *op, vec![(block(x, y, z), pose([cx, cy, f64::from(low[2])], 0.0))])
}

/// Unit cells of the part.
fn cells(boxes: &[Lattice]) -> i32 {
    let holds = |(_, low, high): &Lattice, p: [i32; 3]| (0..3).all(|k| low[k] <= p[k] && p[k] < high[k]);
    let inside = |p: [i32; 3]| {
        boxes.iter().fold(false, |inside, b| match b.0 {
            Op::Add => inside || holds(b, p),
            Op::Cut => inside && !holds(b, p),
            Op::Keep => inside && holds(b, p),
        })
    };
    let all = (0..CELLS.pow(3)).map(|i| [i % CELLS, i / CELLS % CELLS, i / CELLS.pow(2)]);
    all.filter(|p| inside(*p)).count() as i32
}

/// Volume of the part, checked; `None` when it is rightly refused: in pieces, or touching along a line.
fn volume(features: Vec<Feature>) -> Result<Option<f64>, String> {
    match evaluate(&part(features), &[], &Quality::default()) {
        Ok(solid) => {
            check_mesh(&solid);
            Ok(Some(solid.volume))
        }
        Err(faults) => match faults[0].code {
            "E0401" => Ok(Some(0.0)),
            "E0405" | "E0407" => Ok(None),
            _ => Err(format!("{faults:?}")),
        },
    }
}

fn round_or_square() -> impl Strategy<Value = (Shape, PoseExpr)> {
    let size = || (1..9_i32).prop_map(|v| f64::from(v) * 2.0);
    let shape = prop_oneof![
        (size(), 1..6_i32).prop_map(|(d, h)| cylinder(d, f64::from(h))),
        (size(), size(), 1..6_i32).prop_map(|(x, y, h)| block(x, y, f64::from(h))),
        (size(), size(), 1..6_i32).prop_map(|(d1, d2, h)| cone(d1, d2, f64::from(h))),
    ];
    (shape, 0..6_i32).prop_map(|(shape, z)| (shape, pose([0.0, 0.0, f64::from(z)], 0.0)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn boxes_on_a_lattice_have_the_volume_of_their_cells(boxes in prop::collection::vec(lattice_box(), 1..7)) {
        let mut boxes = boxes;
        boxes[0].0 = Op::Add;
        let features: Vec<Feature> = boxes.iter().enumerate().map(lattice_feature).collect();
        let expected = f64::from(cells(&boxes));
        for features in [features.clone(), moved(&features)] {
            if let Some(v) = volume(features).map_err(TestCaseError::fail)? {
                prop_assert!((v - expected).abs() < 1e-8, "{v} {expected}");
            }
        }
    }

    #[test]
    fn union_and_intersection_share_out_the_volume(a in round_or_square(), b in round_or_square()) {
        let pair = |op| vec![feature("a", Op::Add, vec![a.clone()]), feature("b", op, vec![b.clone()])];
        for turn in [false, true] {
            let volume = |f: Vec<Feature>| volume(if turn { moved(&f) } else { f }).map_err(TestCaseError::fail);
            let alone = |x: &(Shape, PoseExpr)| volume(vec![feature("x", Op::Add, vec![x.clone()])]);
            let (a, b) = (alone(&a)?.unwrap_or(f64::NAN), alone(&b)?.unwrap_or(f64::NAN));
            let (sum, cut, common) = (volume(pair(Op::Add))?, volume(pair(Op::Cut))?, volume(pair(Op::Keep))?);
            if let (Some(sum), Some(common)) = (sum, common) {
                prop_assert!((sum + common - a - b).abs() < 1e-8, "{sum} + {common} != {a} + {b}");
            }
            if let (Some(cut), Some(common)) = (cut, common) {
                prop_assert!((cut + common - a).abs() < 1e-8, "{cut} + {common} != {a}");
            }
        }
    }
}
