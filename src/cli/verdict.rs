//! Verdicts as text: for people and as JUnit. The JSON is the runtime's own.
//!
//! In: the name of a photo and what came of it. Out: text.

use crate::runtime::inspect::{Decision, Finding};
use crate::runtime::model::Model;
pub use crate::runtime::report::{Outcome, word};
use std::collections::BTreeSet;

/// One line for people.
pub fn human(outcome: &Outcome) -> String {
    human_of(outcome, &[])
}

/// The same with the camera that saw each finding.
pub fn human_of(outcome: &Outcome, seen_by: &[String]) -> String {
    let verdict = &outcome.verdict;
    let mut text = format!("{:<15} {}", word(verdict.decision), outcome.photo);
    if let Some(pose) = verdict.pose {
        text += &format!("  at ({:+.2}, {:+.2}) mm, {:+.2}°", pose.x, pose.y, pose.rz.to_degrees());
    }
    for (i, finding) in verdict.findings.iter().enumerate() {
        text += &format!("\n    {}", found(finding, seen_by.get(i)));
    }
    if verdict.decision == Decision::CannotInspect {
        text += &format!("\n    {}", verdict.reason);
    }
    text
}

/// `pin[2]: missing (p = 0.0004, px 1 2 3 4)`
fn found(finding: &Finding, camera: Option<&String>) -> String {
    /// No share is told finer.
    const FINEST: f64 = 1e-4;
    let at = finding.box_px.map(|v| format!("{v:.0}")).join(" ");
    let camera = camera.map(|camera| format!("{camera} ")).unwrap_or_default();
    let chance = if finding.p_value < FINEST { format!("< {FINEST}") } else { format!("= {:.4}", finding.p_value) };
    format!("{}: {} (p {chance}, {camera}px {at})", finding.component, finding.fault)
}

/// The components a model answers for: those it knows a fault of beside the good state.
pub fn watched(model: &Model) -> Vec<String> {
    let watched = model.nodes.iter().filter(|node| node.hypotheses.len() > 1);
    watched.map(|node| node.name.clone()).collect()
}

/// What became of one component in one photo.
enum Case {
    Passed,
    /// No-go, and why.
    Failed(String),
    /// Cannot be inspected, and why.
    Error(String),
    /// It looks faulty, but only beside a fault that explains it.
    Skipped,
}

/// The whole report: a suite a photo, in it a test case a component that the model answers for.
pub fn junit(name: &str, watched: &[String], outcomes: &[Outcome]) -> String {
    let suites: Vec<(&Outcome, Vec<(String, Case)>)> = outcomes.iter().map(|o| (o, cases(o, watched))).collect();
    let seconds: f64 = outcomes.iter().filter_map(|o| o.milliseconds).sum::<f64>() / 1e3;
    let all = suites.iter().flat_map(|(_, cases)| cases);
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    // The root element has no count of what was skipped.
    text += &format!("<testsuites name=\"{}\" {}>\n", escaped(name), &counts(all, seconds, false));
    suites.iter().for_each(|(outcome, cases)| text += &suite(outcome, cases));
    text + "</testsuites>"
}

fn suite(outcome: &Outcome, cases: &[(String, Case)]) -> String {
    let photo = escaped(&outcome.photo);
    let counts = counts(cases.iter(), outcome.milliseconds.unwrap_or(0.0) / 1e3, true);
    let mut text = format!("  <testsuite name=\"{photo}\" {counts}>\n");
    for (component, case) in cases {
        text += &format!("    <testcase classname=\"{photo}\" name=\"{}\"", escaped(component));
        text += &match case {
            Case::Passed => "/>\n".to_string(),
            Case::Failed(why) => format!("><failure type=\"no-go\" message=\"{}\"/></testcase>\n", escaped(why)),
            Case::Error(why) => format!("><error type=\"cannot-inspect\" message=\"{}\"/></testcase>\n", escaped(why)),
            Case::Skipped => "><skipped message=\"disturbed by the fault of another\"/></testcase>\n".to_string(),
        };
    }
    text + "  </testsuite>\n"
}

/// The attributes of a suite. Seconds have three decimals at most, as the schema of the Jenkins plug-in wants them.
fn counts<'a>(cases: impl Iterator<Item = &'a (String, Case)>, seconds: f64, with_skipped: bool) -> String {
    let (mut tests, mut failures, mut errors, mut skipped) = (0, 0, 0, 0);
    for (_, case) in cases {
        tests += 1;
        match case {
            Case::Passed => {}
            Case::Failed(_) => failures += 1,
            Case::Error(_) => errors += 1,
            Case::Skipped => skipped += 1,
        }
    }
    let skipped = if with_skipped { format!(" skipped=\"{skipped}\"") } else { String::new() };
    format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"{errors}\"{skipped} time=\"{seconds:.3}\"")
}

/// A case for every component watched, and for what else was found; trouble concerns them all.
fn cases(outcome: &Outcome, watched: &[String]) -> Vec<(String, Case)> {
    let verdict = &outcome.verdict;
    let mut names: Vec<&str> = watched.iter().map(String::as_str).collect();
    names.extend(verdict.findings.iter().map(|f| f.component.as_str()));
    // A photo without any case would count for nothing.
    if names.is_empty() {
        names.push("assembly");
    }
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    let explained = |name: &str| verdict.nodes.iter().any(|n| n.name == name && n.faulty && n.explained);
    let case = |name: &str| {
        let findings: Vec<String> =
            verdict.findings.iter().filter(|f| f.component == name).map(|f| found(f, None)).collect();
        match verdict.decision {
            Decision::CannotInspect => Case::Error(verdict.reason.clone()),
            Decision::NoGo if !findings.is_empty() => Case::Failed(findings.join("; ")),
            Decision::NoGo if verdict.findings.is_empty() => Case::Failed(verdict.reason.clone()),
            _ if explained(name) => Case::Skipped,
            _ => Case::Passed,
        }
    };
    names.into_iter().map(|name| (name.to_string(), case(name))).collect()
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
            '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::report::tests::faulty;

    #[test]
    fn junit_has_a_case_a_photo_and_component() {
        let watched = ["pin[1]".to_string(), "pin[2]".to_string()];
        let text = junit("wheel.A", &watched, &[faulty(), Outcome::unreadable("<x>".into(), "cut\u{0}".into())]);
        assert!(text.contains(r#"<testsuites name="wheel.A" tests="4" failures="1" errors="2" time="#), "{text}");
        assert!(text.contains(r#"classname="a &quot;b&quot;.png" name="pin[1]"/>"#), "{text}");
        assert!(text.contains(r#"name="pin[2]"><failure type="no-go" message="pin[2]: missing (p = 0.0004"#), "{text}");
        assert_eq!(text.matches(r#"message="cut ""#).count(), 2, "{text}");
    }

    #[test]
    fn a_photo_never_counts_for_nothing() {
        let text = junit("wheel.A", &[], &[Outcome::unreadable("x".into(), "cut".into())]);
        assert!(text.contains(r#"name="assembly"><error type="cannot-inspect" message="cut"/>"#), "{text}");
    }

    #[test]
    fn people_read_the_component_and_the_fault() {
        assert!(human(&faulty()).contains("\n    pin[2]: missing (p = 0.0004, px 1 2 3 4)"));
        let mut rare = faulty().verdict.findings[0].clone();
        rare.p_value = 4.5e-5;
        assert!(found(&rare, None).contains("(p < 0.0001, px"), "{}", found(&rare, None));
    }
}
