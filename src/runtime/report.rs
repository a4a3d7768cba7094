//! A verdict as one line of JSON: the same on the command line, behind the C interface and in a browser.
//!
//! In: the name of a photo and what came of it. Out: text. The keys and their order are a contract; scripts depend on them.
//! Written by hand because the runtime has no JSON crate; the tests hold it against one.

use super::inspect::{Decision, Finding, NodeReport, Verdict};
use std::fmt::Write;

/// What came of one photo.
pub struct Outcome {
    pub photo: String,
    pub verdict: Verdict,
    /// Time of judging, the model being loaded; `None` where nobody looked at a clock.
    pub milliseconds: Option<f64>,
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
        Outcome { photo, verdict, milliseconds: Some(0.0) }
    }

    /// One JSON object, without the line break.
    pub fn json(&self) -> String {
        self.json_of(&[], &[])
    }

    /// The same with what a picture of it needs: `decoded` (whether the photo is an image of the right size), the locator's
    /// score, the corners of the assembly's box (px), and per node its score, corners, those of what is crossed out, level and fault.
    pub fn json_in_full(&self, decoded: bool) -> String {
        let mut text = self.json();
        text.pop();
        text += if decoded { ",\"decoded\":true" } else { ",\"decoded\":false" };
        text += ",\"locator_score\":";
        number(&mut text, self.verdict.locator_score, 4);
        text += ",\"outline\":";
        match &self.verdict.outline {
            Some(outline) => corners(&mut text, outline),
            None => text += "null",
        }
        text += ",\"nodes\":[";
        for (i, one) in self.verdict.nodes.iter().enumerate() {
            text += if i > 0 { "," } else { "" };
            node(&mut text, one);
        }
        text + "]}"
    }

    /// The same for several cameras: their names and photos, and for each finding the camera that saw it.
    pub(super) fn json_of(&self, photos: &[(&str, &str)], seen_by: &[String]) -> String {
        let verdict = &self.verdict;
        let mut text = String::from("{\"photo\":");
        string(&mut text, &self.photo);
        for (i, (camera, photo)) in photos.iter().enumerate() {
            text += if i > 0 { "," } else { ",\"photos\":{" };
            string(&mut text, camera);
            text += ":";
            string(&mut text, photo);
            text += if i + 1 == photos.len() { "}" } else { "" };
        }
        text += ",\"verdict\":";
        string(&mut text, word(verdict.decision));
        text += ",\"reason\":";
        string(&mut text, &verdict.reason);
        text += ",\"pose\":";
        match &verdict.pose {
            // mm and degrees; size relative to the nominal photo.
            Some(pose) => {
                let numbers = [
                    ("{\"x\":", pose.x, 4),
                    (",\"y\":", pose.y, 4),
                    (",\"scale\":", verdict.scale, 5),
                    (",\"rotation_deg\":", pose.rz.to_degrees(), 4),
                ];
                for (key, value, decimals) in numbers {
                    text += key;
                    number(&mut text, value, decimals);
                }
                text += "}";
            }
            None => text += "null",
        }
        text += ",\"findings\":[";
        for (i, found) in verdict.findings.iter().enumerate() {
            text += if i > 0 { "," } else { "" };
            finding(&mut text, found, seen_by.get(i));
        }
        text += "],\"milliseconds\":";
        match self.milliseconds {
            Some(milliseconds) => number(&mut text, milliseconds, 3),
            None => text += "null",
        }
        text + "}"
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

fn finding(text: &mut String, finding: &Finding, camera: Option<&String>) {
    let names = [
        ("{\"component\":", &finding.component),
        (",\"fault\":", &finding.fault),
        (",\"error_tree\":", &finding.error_tree),
        (",\"node\":", &finding.node),
    ];
    for (key, name) in names {
        *text += key;
        string(text, name);
    }
    if let Some(camera) = camera {
        *text += ",\"camera\":";
        string(text, camera);
    }
    *text += ",\"p_value\":";
    number(text, finding.p_value, 6);
    *text += ",\"box\":[";
    for (i, side) in finding.box_px.into_iter().enumerate() {
        *text += if i > 0 { "," } else { "" };
        number(text, side, 1);
    }
    *text += "]}";
}

fn node(text: &mut String, node: &NodeReport) {
    *text += "{\"node\":";
    string(text, &node.name);
    // Writing to a string cannot fail.
    let _ = write!(text, ",\"level\":{},\"faulty\":{},\"explained\":{}", node.level, node.faulty, node.explained);
    *text += ",\"fault\":";
    string(text, &node.best_fault);
    *text += ",\"score\":";
    number(text, node.score, 6);
    *text += ",\"outline\":";
    corners(text, &node.outline);
    *text += ",\"crossed\":";
    corners(text, &node.crossed);
    *text += "}";
}

fn corners(text: &mut String, corners: &[[f64; 2]; 4]) {
    for (i, [x, y]) in corners.iter().enumerate() {
        *text += if i > 0 { ",[" } else { "[[" };
        number(text, *x, 1);
        *text += ",";
        number(text, *y, 1);
        *text += "]";
    }
    *text += "]";
}

/// A number with at most `decimals` decimals; what is no number is null.
fn number(text: &mut String, value: f64, decimals: i32) {
    let scale = 10f64.powi(decimals);
    // Beyond 2^52 steps a number has no decimals to lose. Adding zero turns -0.0 into 0.0.
    let whole = (value * scale).abs() >= 4_503_599_627_370_496.0;
    let rounded = if whole { value } else { (value * scale).round() / scale + 0.0 };
    // Writing to a string cannot fail.
    let _ = if rounded.is_finite() { write!(text, "{rounded:?}") } else { write!(text, "null") };
}

/// A string in quotation marks (RFC 8259, section 7).
fn string(text: &mut String, value: &str) {
    text.push('"');
    for c in value.chars() {
        match c {
            '"' => *text += "\\\"",
            '\\' => *text += "\\\\",
            '\n' => *text += "\\n",
            '\r' => *text += "\\r",
            '\t' => *text += "\\t",
            c if c < ' ' => {
                let _ = write!(text, "\\u{:04x}", u32::from(c));
            }
            c => text.push(c),
        }
    }
    text.push('"');
}

#[cfg(test)]
pub(crate) mod tests;
