use super::*;
use crate::runtime::model::tests::tiny;

/// A node in which nothing is wrong.
pub(crate) fn correct() -> NodeReport {
    NodeReport {
        name: "pin".into(),
        level: 1,
        parent: None,
        outline: [[0.0; 2]; 4],
        crossed: [[0.0; 2]; 4],
        score: 0.1,
        against: vec![0.0, 0.1],
        best_fault: "missing".into(),
        inside: 1.0,
        unlike: Unlikeness::default(),
        strangeness: 0.0,
        lift: None,
        beyond: 0.0,
        faulty: false,
        explained: false,
    }
}

/// One of a hundred good photos may be rejected: for each of four nodes the square root of the ratio must be four hundred,
/// 2 ln 400 = 12 in a hundred independent coefficients.
#[test]
fn what_looks_right_beside_its_place_is_misplaced() {
    let mut model = tiny();
    model.nodes = vec![model.nodes[0].clone(); 4];
    let report = |beyond: f64| NodeReport { strangeness: 1.0, beyond, ..correct() };
    let found = |model: &Model, beyond: [f64; 4]| beside(model, &beyond.map(report));
    assert_eq!(found(&model, [0.0, 0.121, 0.0, 0.0]), Some((1, MISPLACED)));
    assert_eq!(found(&model, [0.0, 0.119, 0.0, 0.0]), None);
    assert_eq!(found(&model, [0.2, 0.3, 0.2, 0.0]), None, "the pose is wrong");
    assert_eq!(beside(&model, &[report(0.5)]), None, "nothing tells where the assembly is");
    let strange = [0.0, 0.0, 0.5, 0.0].map(|beyond| NodeReport { strangeness: 9.0 - beyond, ..report(beyond) });
    assert_eq!(beside(&model, &strange), Some((2, MISPLACED)));
    let mut moved = strange.to_vec();
    let (node, chance) = mark_beside(&model, &mut moved).unwrap();
    assert!(node == 2 && (chance / (-25.0f64).exp() - 1.0).abs() < 1e-9, "exp(-0.5 · 100 / 2): {chance}");
    model.nodes[2].hypotheses.truncate(1);
    assert_eq!(beside(&model, &strange), Some((3, strange::UNKNOWN)), "the root is where the assembly is");
    let mut marked = strange.to_vec();
    assert_eq!(mark_beside(&model, &mut marked), Some((3, 0.0025)), "a hundredth for four nodes");
    assert_eq!((marked[3].best_fault.as_str(), marked[3].faulty, marked[3].score), (strange::UNKNOWN, true, 0.1));
    assert!(!marked[2].faulty && !shows_mode(marked[3].score), "no mode shows: a calibration photo may look like that");
}
