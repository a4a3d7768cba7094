//! Verdicts as text: for people and as JUnit. The JSON is the runtime's own.
//!
//! In: the name of a photo and what came of it. Out: text.

use crate::runtime::inspect::Decision;
pub use crate::runtime::report::{Outcome, word};

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
    let total: f64 = outcomes.iter().filter_map(|o| o.milliseconds).sum();
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
        text += &format!(
            "<testcase classname=\"{name}\" name=\"{photo}\" time=\"{}\"",
            seconds(outcome.milliseconds.unwrap_or(0.0))
        );
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
    use crate::runtime::report::tests::faulty;

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
