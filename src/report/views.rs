//! The views that were tried: a map of the sky over the assembly, and the best of them.
//!
//! In: a choice among several views. Out: an SVG in which a dot's angle is the camera's azimuth, its distance from the middle
//! how far the camera leans from overhead, its tint the score; and a short table. Nothing for a camera that is fixed.

use super::html::{at, escaped, number, percent};
use crate::design::model::Design;
use crate::view::choose::{Choice, Scored};
use crate::view::escape::Weighed;

/// Radius of the map (px).
const RADIUS: f64 = 110.0;
/// Views told in figures.
const TOLD: usize = 5;

pub fn section(design: &Design, choice: &Choice) -> String {
    if choice.table.len() < 2 {
        return String::new();
    }
    let best = &choice.table[choice.best];
    let rows: String = ranked(choice).iter().take(TOLD).map(|s| row(s)).collect();
    format!(
        "<h3>Views tried</h3>\n<div class=\"pair views\">{}<div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">Azimuth</th>\
         <th scope=\"col\">Elevation</th><th scope=\"col\">Distance</th><th scope=\"col\">All inside</th>\
         <th scope=\"col\">Surfaces</th><th scope=\"col\">px</th><th scope=\"col\">Score</th></tr></thead>\n\
         <tbody>{rows}</tbody></table></div></div>\n{}",
        map(&choice.table, best),
        shortlist(design, choice)
    )
}

/// What each view of the shortlist buys: both scores, the chosen view first. Nothing where none was weighed.
fn shortlist(design: &Design, choice: &Choice) -> String {
    let rows: String = choice.weighed().map(|w| weighed(design, choice, w)).collect();
    if rows.is_empty() {
        return rows;
    }
    format!(
        "<h3>What each view lets pass</h3>\n<p>The views that score highest, each from another direction, the chosen one first. What \
         escapes is predicted from geometry: it compares views and promises nothing.</p>\n<div class=\"scroll\"><table>\n<thead><tr>\
         <th scope=\"col\">Azimuth</th><th scope=\"col\">Elevation</th><th scope=\"col\">Distance</th>\
         <th scope=\"col\">Score</th><th scope=\"col\">Worst escape</th><th scope=\"col\">Mean escape</th>\
         <th scope=\"col\">Escapes most</th></tr></thead>\n<tbody>{rows}</tbody></table></div>\n{}",
        several(choice)
    )
}

/// Where more cameras would have to stand, if one does not tell all.
fn several(choice: &Choice) -> String {
    let place = |view: &Scored| {
        let [azimuth, elevation] = [view.placing.azimuth, view.placing.elevation].map(|v| number(v.to_degrees(), 1));
        format!("azimuth {azimuth}°, elevation {elevation}°, {} mm", number(view.placing.distance, 0))
    };
    let places: Vec<String> = choice.several().map(place).collect();
    if places.is_empty() {
        return String::new();
    }
    format!(
        "<p>By this prediction no view tells every fault that some view tells. It takes {} cameras, each a station of its own: {}.</p>\n",
        places.len(),
        places.join("; ")
    )
}

fn weighed(design: &Design, choice: &Choice, weighed: &Weighed) -> String {
    let view = &choice.table[weighed.view];
    let weakest = weighed.weakest().filter(|mode| mode.share > 0.0);
    let weakest =
        weakest.map(|mode| format!("{} {}", escaped(&design.components[mode.component].name), mode.kind.word()));
    format!(
        "<tr><td>{}°</td><td>{}°</td><td>{} mm</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        number(view.placing.azimuth.to_degrees(), 1),
        number(view.placing.elevation.to_degrees(), 1),
        number(view.placing.distance, 0),
        number(view.score, 2),
        percent(weighed.worst()),
        percent(weighed.mean()),
        weakest.unwrap_or_default()
    )
}

/// The chosen view first, then the others by score.
fn ranked(choice: &Choice) -> Vec<&Scored> {
    let mut order: Vec<usize> = (0..choice.table.len()).filter(|i| *i != choice.best).collect();
    let of = |i: &usize| &choice.table[*i];
    order.sort_by(|a, b| of(b).framed.cmp(&of(a).framed).then(of(b).score.total_cmp(&of(a).score)).then(a.cmp(b)));
    [choice.best].iter().chain(&order).map(of).collect()
}

fn row(scored: &Scored) -> String {
    let place = &scored.placing;
    format!(
        "<tr><td>{}°</td><td>{}°</td><td>{} mm</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        number(place.azimuth.to_degrees(), 1),
        number(place.elevation.to_degrees(), 1),
        number(place.distance, 0),
        if scored.framed { "yes" } else { "no" },
        scored.surfaces,
        scored.pixels,
        number(scored.score, 2)
    )
}

fn map(table: &[Scored], best: &Scored) -> String {
    let scores = || table.iter().map(|s| s.score).filter(|s| s.is_finite());
    let (low, high) = (scores().fold(f64::INFINITY, f64::min), scores().fold(f64::NEG_INFINITY, f64::max));
    // The best on top.
    let mut order: Vec<&Scored> = table.iter().collect();
    order.sort_by(|a, b| a.score.total_cmp(&b.score));
    let dot = |s: &&Scored| {
        let [x, y] = place(s);
        let tint = ((s.score - low) / (high - low).max(1e-12)).clamp(0.0, 1.0);
        let class = if s.framed { "" } else { " class=\"outside\"" };
        let (x, y, tint) = (at(x), at(y), number(100.0 * tint, 0));
        format!("<circle{class} cx=\"{x}\" cy=\"{y}\" r=\"4.5\" style=\"--t:{tint}%\"/>")
    };
    let dots: String = order.iter().map(dot).collect();
    let [x, y] = place(best).map(at);
    let rings: String = [30.0f64, 60.0, 90.0]
        .map(|lean| format!("<circle class=\"ring\" r=\"{}\"/>", at(RADIUS * lean / 90.0)))
        .concat();
    let edge = RADIUS + 12.0;
    format!(
        "<figure><svg class=\"sky\" viewBox=\"-130 -130 260 260\" role=\"img\" aria-label=\"Map of the views tried, seen from above; \
         the chosen one is ringed\">{rings}<path class=\"ring\" d=\"M-{RADIUS} 0H{RADIUS}M0 -{RADIUS}V{RADIUS}\"/>\
         <text x=\"{edge}\" y=\"4\">+x</text><text x=\"0\" y=\"-{edge}\">+y</text>{dots}\
         <circle class=\"best\" cx=\"{x}\" cy=\"{y}\" r=\"7.5\"/></svg><figcaption><small>From above: rings are 30°, 60° and 90° from \
         overhead. Darker dots score higher; from hollow ones not all that \
         is watched lies in the picture.</small></figcaption></figure>"
    )
}

/// Overhead in the middle, the horizon at the rim, +y upwards.
fn place(scored: &Scored) -> [f64; 2] {
    let lean = (90.0 - scored.placing.elevation.to_degrees()) / 90.0 * RADIUS;
    let (sin, cos) = scored.placing.azimuth.sin_cos();
    [lean * cos, -lean * sin]
}
