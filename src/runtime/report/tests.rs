//! The JSON line: its keys, its numbers, its strings.

use super::*;
use crate::runtime::pose::Pose;

/// A missing pin.
pub(crate) fn faulty() -> Outcome {
    let finding = Finding {
        component: "pin[2]".into(),
        fault: "missing".into(),
        error_tree: "pin[2]".into(),
        node: "pin[2]".into(),
        p_value: 0.0004,
        box_px: [1.0, 2.0, 3.25, 4.0],
    };
    let mut outcome = Outcome::unreadable("a \"b\".png".into(), "pin[2]: missing".into());
    outcome.verdict.decision = Decision::NoGo;
    outcome.verdict.pose = Some(Pose { x: 1.0, y: -2.0, z: 0.0, rz: 0.1 });
    outcome.verdict.findings.push(finding);
    outcome.milliseconds = Some(12.3);
    outcome
}

#[test]
fn the_json_line_keeps_its_keys_in_order() {
    let expected = concat!(
        r#"{"photo":"a \"b\".png","verdict":"no-go","reason":"pin[2]: missing","#,
        r#""pose":{"x":1.0,"y":-2.0,"scale":1.0,"rotation_deg":5.7296},"#,
        r#""findings":[{"component":"pin[2]","fault":"missing","error_tree":"pin[2]","node":"pin[2]","#,
        r#""p_value":0.0004,"box":[1.0,2.0,3.3,4.0]}],"milliseconds":12.3}"#
    );
    assert_eq!(faulty().json(), expected);
}

#[test]
fn a_photo_that_cannot_be_read_has_all_keys_too() {
    let line = Outcome::unreadable("x.png".into(), "no".into()).json();
    let expected =
        r#"{"photo":"x.png","verdict":"cannot-inspect","reason":"no","pose":null,"findings":[],"milliseconds":0.0}"#;
    assert_eq!(line, expected);
}

#[test]
fn in_full_the_line_goes_on_with_boxes_and_scores() {
    let mut outcome = faulty();
    outcome.verdict.outline = Some([[1.0, 2.0], [3.0, 2.0], [3.0, 4.04], [1.0, f64::NAN]]);
    outcome.verdict.nodes.push(NodeReport {
        name: "pin[2] \"x\"".into(),
        level: 1,
        parent: None,
        outline: [[0.0; 2]; 4],
        crossed: [[1.0, 0.0]; 4],
        score: -0.1234567,
        against: Vec::new(),
        best_fault: "missing".into(),
        inside: 1.0,
        unlike: Default::default(),
        strangeness: 0.0,
        lift: None,
        beyond: 0.0,
        faulty: true,
        explained: false,
    });
    let (line, full) = (outcome.json(), outcome.json_in_full(true));
    assert!(full.starts_with(&line[..line.len() - 1]), "{full}");
    let read: serde_json::Value = serde_json::from_str(&full).unwrap();
    assert_eq!(read["decoded"], true);
    assert_eq!(read["outline"], serde_json::json!([[1.0, 2.0], [3.0, 2.0], [3.0, 4.0], [1.0, null]]));
    let node = serde_json::json!({
        "node": "pin[2] \"x\"", "level": 1, "faulty": true, "explained": false, "fault": "missing", "score": -0.123457,
        "outline": [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]],
        "crossed": [[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0]],
    });
    assert_eq!(read["nodes"], serde_json::json!([node]));
    let unread = Outcome::unreadable("x".into(), "no".into()).json_in_full(false);
    assert!(unread.ends_with(r#","decoded":false,"locator_score":0.0,"outline":null,"nodes":[]}"#), "{unread}");
}

#[test]
fn without_a_clock_the_time_is_null() {
    let outcome = Outcome { milliseconds: None, ..Outcome::unreadable(String::new(), String::new()) };
    assert!(outcome.json().ends_with(r#""milliseconds":null}"#));
}

#[test]
fn strings_and_numbers_are_those_of_a_json_crate() {
    for value in ["", "a\"b\\c/", "\u{0}\u{1f}\u{7f}\n\r\t", "µm 🔩"] {
        let mut text = String::new();
        string(&mut text, value);
        assert_eq!(serde_json::from_str::<String>(&text).unwrap(), value);
    }
    for value in [0.0, -0.0, 1.0, -1.5, 1e-6, 123456.7, 1e17, 1e300, f64::MAX, f64::NAN, f64::INFINITY] {
        let mut text = String::new();
        number(&mut text, value, 6);
        let read: serde_json::Value = serde_json::from_str(&text).unwrap();
        let expected = value.is_finite().then_some(value + 0.0);
        assert_eq!(read.as_f64(), expected, "{text}");
    }
}
