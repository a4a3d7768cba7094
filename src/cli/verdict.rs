//! Verdicts as text: for people, as JSON lines, as JUnit.
//!
//! In: the name of a photo and what came of it. Out: text. The keys of the JSON are a contract; scripts depend on them.

use crate::runtime::inspect::{Decision, Finding, Verdict};
use serde::Serialize;

/// What came of one photo.
pub struct Outcome {
    pub photo: String,
    pub verdict: Verdict,
    /// Time of judging, the model being loaded.
    pub milliseconds: f64,
}

impl Outcome {
    /// A photo that never reached the inspector.
    pub fn unreadable(photo: String, reason: String) -> Outcome {
        let verdict = Verdict {
            decision: Decision::CannotInspect,
            reason,
            pose: None,
            scale: 1.0,
            locator_score: 0.0,
            findings: Vec::new(),
            nodes: Vec::new(),
            outline: None,
        };
        Outcome { photo, verdict, milliseconds: 0.0 }
    }
}

/// The word in reports.
pub fn word(decision: Decision) -> &'static str {
    match decision {
        Decision::Go => "go",
        Decision::NoGo => "no-go",
        Decision::CannotInspect => "cannot-inspect",
    }
}

#[derive(Serialize)]
struct JsonLine<'a> {
    photo: &'a str,
    verdict: Decision,
    reason: &'a str,
    pose: Option<JsonPose>,
    findings: Vec<Finding>,
    milliseconds: f64,
}

/// Where the assembly stands on the station: mm and degrees; size relative to the nominal photo.
#[derive(Serialize)]
struct JsonPose {
    x: f64,
    y: f64,
    scale: f64,
    rotation_deg: f64,
}

/// One JSON object, without the line break.
pub fn json(outcome: &Outcome) -> String {
    let verdict = &outcome.verdict;
    let pose = verdict.pose.map(|p| JsonPose {
        x: rounded(p.x, 4),
        y: rounded(p.y, 4),
        scale: rounded(verdict.scale, 5),
        rotation_deg: rounded(p.rz.to_degrees(), 4),
    });
    let line = JsonLine {
        photo: &outcome.photo,
        verdict: verdict.decision,
        reason: &verdict.reason,
        pose,
        findings: verdict.findings.iter().map(finding).collect(),
        milliseconds: rounded(outcome.milliseconds, 3),
    };
    serde_json::to_string(&line).unwrap_or_else(|e| format!("{{\"verdict\":\"cannot-inspect\",\"reason\":\"{e}\"}}"))
}

fn finding(finding: &Finding) -> Finding {
    let box_px = finding.box_px.map(|v| rounded(v, 1));
    Finding { p_value: rounded(finding.p_value, 6), box_px, ..finding.clone() }
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale + 0.0
}

/// One line for people.
pub fn human(outcome: &Outcome) -> String {
    let verdict = &outcome.verdict;
    let mut text = format!("{:<15} {}", word(verdict.decision), outcome.photo);
    if let Some(pose) = verdict.pose {
        text += &format!("  at ({:+.2}, {:+.2}) mm, {:+.2}°", pose.x, pose.y, pose.rz.to_degrees());
    }
    for finding in &verdict.findings {
        let at = finding.box_px.map(|v| format!("{v:.0}")).join(" ");
        text += &format!("\n    {}: {} (p = {:.4}, px {at})", finding.component, finding.fault, finding.p_value);
    }
    if verdict.decision == Decision::CannotInspect {
        text += &format!("\n    {}", verdict.reason);
    }
    text
}

/// The whole report: one test case a photo; no-go is a failure, cannot-inspect an error.
pub fn junit(station: &str, outcomes: &[Outcome]) -> String {
    let count = |decision| outcomes.iter().filter(|o| o.verdict.decision == decision).count();
    let seconds = |ms: f64| format!("{:.6}", ms / 1000.0);
    let total: f64 = outcomes.iter().map(|o| o.milliseconds).sum();
    let name = escaped(station);
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    text += &format!(
        "<testsuites><testsuite name=\"{name}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{}\">\n",
        outcomes.len(),
        count(Decision::NoGo),
        count(Decision::CannotInspect),
        seconds(total)
    );
    for outcome in outcomes {
        let (photo, reason) = (escaped(&outcome.photo), escaped(&outcome.verdict.reason));
        text += &format!("<testcase classname=\"{name}\" name=\"{photo}\" time=\"{}\"", seconds(outcome.milliseconds));
        text += &match outcome.verdict.decision {
            Decision::Go => "/>\n".to_string(),
            Decision::NoGo => format!("><failure message=\"{reason}\"/></testcase>\n"),
            Decision::CannotInspect => format!("><error message=\"{reason}\"/></testcase>\n"),
        };
    }
    text + "</testsuite></testsuites>"
}

/// For XML attributes; characters XML 1.0 cannot hold become spaces.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::pose::Pose;

    fn faulty() -> Outcome {
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
        outcome.milliseconds = 12.3;
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
        assert_eq!(json(&faulty()), expected);
    }

    #[test]
    fn a_photo_that_cannot_be_read_has_all_keys_too() {
        let line = json(&Outcome::unreadable("x.png".into(), "no".into()));
        let expected = r#"{"photo":"x.png","verdict":"cannot-inspect","reason":"no","pose":null,"findings":[],"milliseconds":0.0}"#;
        assert_eq!(line, expected);
    }

    #[test]
    fn junit_counts_and_escapes() {
        let text = junit("A", &[faulty(), Outcome::unreadable("<x>".into(), "cut\u{0}".into())]);
        assert!(text.contains(r#"tests="2" failures="1" errors="1""#), "{text}");
        assert!(text.contains(r#"name="a &quot;b&quot;.png""#) && text.contains(r#"message="cut ""#), "{text}");
    }

    #[test]
    fn people_read_the_component_and_the_fault() {
        assert!(human(&faulty()).contains("\n    pin[2]: missing (p = 0.0004, px 1 2 3 4)"));
    }
}
