//! Strip plots: where scores lie among those of held-out renders.
//!
//! In: a node with its held-out scores, and scores to mark. Out: a small SVG. Good renders stand above the line, faulty ones
//! below, the threshold across; a mark beyond the scale becomes an arrow at its end.

use super::html::{at, escaped, number};
use crate::runtime::model::Node;

const WIDTH: f64 = 300.0;
const HEIGHT: f64 = 30.0;
/// Height of the line (px) and length of the ticks.
const MIDDLE: f64 = 15.0;
const TICK: f64 = 9.0;
/// Beyond the held-out scores on each side (share of their range).
const MARGIN: f64 = 0.25;

/// A score to mark: its value, its class, what a pointer is told.
pub struct Mark {
    pub score: f64,
    pub class: &'static str,
    pub name: String,
}

/// Both ends of a node's strip; `None` without held-out scores.
pub fn scale(node: &Node) -> Option<[f64; 2]> {
    Scale::of(node).map(|scale| [scale.low, scale.high])
}

pub fn strip(node: &Node, marks: &[Mark]) -> String {
    let Some(scale) = Scale::of(node) else { return marks.iter().map(|m| number(m.score, 3)).collect() };
    let ticks = |scores: &[f64], from: f64, to: f64| -> String {
        scores
            .iter()
            .filter(|s| s.is_finite())
            .map(|s| format!("M{} {}V{}", at(scale.x(*s)), at(from), at(to)))
            .collect()
    };
    let good = ticks(&node.good_scores, MIDDLE - 1.0, MIDDLE - 1.0 - TICK);
    let fault = ticks(&node.fault_scores, MIDDLE + 1.0, MIDDLE + 1.0 + TICK);
    let threshold = at(scale.x(0.0));
    let marks: String = marks.iter().map(|m| mark(m, &scale)).collect();
    let label = format!(
        "{}: held-out good renders {} to {}, faulty {} to {}, threshold 0",
        node.name,
        ends(&node.good_scores)[0],
        ends(&node.good_scores)[1],
        ends(&node.fault_scores)[0],
        ends(&node.fault_scores)[1]
    );
    format!(
        "<svg class=\"strip\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\"><path class=\"axis\" \
         d=\"M0 {MIDDLE}H{WIDTH}\"/><path class=\"good\" d=\"{good}\"/><path class=\"fault\" d=\"{fault}\"/>\
         <path class=\"limit\" d=\"M{threshold} 1V29\"/>{marks}</svg>",
        escaped(&label)
    )
}

fn ends(scores: &[f64]) -> [String; 2] {
    [scores.first(), scores.last()].map(|s| s.map_or("–".into(), |s| number(*s, 3)))
}

fn mark(mark: &Mark, scale: &Scale) -> String {
    let x = scale.x(mark.score);
    let title = escaped(&format!("{}: {}", mark.name, number(mark.score, 3)));
    let shape = if x < 4.0 && mark.score < scale.low {
        format!("M1 {MIDDLE}l8 -5v10z")
    } else if x > WIDTH - 4.0 && mark.score > scale.high {
        format!("M{} {MIDDLE}l-8 -5v10z", at(WIDTH - 1.0))
    } else {
        format!("M{} {}l4.5 5 -4.5 5 -4.5 -5z", at(x), at(MIDDLE - 5.0))
    };
    format!("<path class=\"mark {}\" d=\"{shape}\"><title>{title}</title></path>", mark.class)
}

struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    /// Of all held-out scores and the threshold; `None` without any.
    fn of(node: &Node) -> Option<Scale> {
        let all = node.good_scores.iter().chain(&node.fault_scores).chain([&0.0]);
        let all: Vec<f64> = all.copied().filter(|v| v.is_finite()).collect();
        if node.good_scores.is_empty() && node.fault_scores.is_empty() {
            return None;
        }
        let low = all.iter().copied().fold(f64::INFINITY, f64::min);
        let high = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let margin = (MARGIN * (high - low)).max(1e-3);
        Some(Scale { low: low - margin, high: high + margin })
    }

    fn x(&self, score: f64) -> f64 {
        ((score - self.low) / (self.high - self.low) * WIDTH).clamp(1.0, WIDTH - 1.0)
    }
}
