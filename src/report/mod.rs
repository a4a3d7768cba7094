//! The report that a person looks at: one HTML file with everything in it.
//!
//! In: what the stages made of a spec and, where there are any, a model, photos and their verdicts. Out: the text of a page
//! that asks for nothing: no network, no fonts, no script but its own, which its policy holds by a nonce. Every name and text
//! from outside is escaped. The same input gives the same bytes. Never reads or writes a file, never judges.

mod body;
mod colour;
mod drawings;
mod findings;
mod html;
mod judge;
mod measures;
mod module;
mod parts;
mod photos;
mod picture;
mod promise;
mod station;
mod strip;
mod templates;
mod title;
mod views;

pub use judge::Judge;
pub use module::Module;
#[cfg(feature = "cli")]
pub(crate) use photos::shrunk;

#[cfg(test)]
mod tests;

use crate::assembly::Analysis;
use crate::assembly::error_tree::ErrorTree;
use crate::assembly::fault::ErrorMode;
use crate::design::model::{Design, Station};
use crate::diag::{Diagnostic, Sources};
use crate::runtime::calibrate::Calibration;
use crate::runtime::inspect::Verdict;
use crate::runtime::model::Model;
use crate::runtime::photo::Photo;
use crate::scene::Body;
use crate::solid::Solid;
use crate::view::choose::Choice;
use html::escaped;
use std::sync::Arc;

/// What a page tells; what is missing is left out of it.
#[derive(Clone, Copy)]
pub struct Report<'a> {
    /// Name of the spec's file.
    pub spec: &'a str,
    pub diagnostics: &'a [Diagnostic],
    pub sources: &'a Sources,
    pub assembly: Option<Assembly<'a>>,
    pub view: Option<View<'a>>,
    /// From the other cameras, where the station has several.
    pub others: &'a [View<'a>],
    pub model: Option<Trained<'a>>,
    pub photos: &'a [Shot<'a>],
    /// What lets the page judge photos itself.
    pub judge: Option<Judge<'a>>,
}

/// What the spec describes.
#[derive(Clone, Copy)]
pub struct Assembly<'a> {
    pub design: &'a Design,
    /// One per component, at nominal.
    pub solids: &'a [Arc<Solid>],
    pub analysis: Option<&'a Analysis>,
    pub trees: &'a [ErrorTree],
    pub modes: &'a [ErrorMode],
}

/// Where it is looked at.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub station: &'a Station,
    pub bodies: &'a [Body],
    pub choice: &'a Choice,
}

/// What will judge it.
#[derive(Clone, Copy)]
pub struct Trained<'a> {
    pub model: &'a Model,
    pub calibration: Option<&'a Calibration>,
    /// Whether the model is of this very spec.
    pub fits: bool,
}

/// A photo and what came of it.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    pub name: &'a str,
    /// Grey values for people: width, height, one byte a pixel. `None` for what is no image.
    pub grey: Option<&'a image::GrayImage>,
    /// Linear in light, as it was judged.
    pub photo: Option<&'a Photo>,
    pub verdict: &'a Verdict,
}

const STYLE: &str = include_str!("page.css");
const VIEWER: &str = include_str!("viewer.js");
const PAGE: &str = include_str!("page.js");

/// The page.
pub fn page(report: &Report) -> String {
    let sections = sections(report);
    let (links, sections): (String, String) = sections.iter().map(|s| (link(s), section(s))).collect();
    let payload = report.assembly.map_or_else(|| "{}".into(), |a| body::payload(&a, report));
    let content = format!(
        "{}<nav aria-label=\"Sections\">{links}</nav>\n<main>\n{sections}</main>\n{}",
        title::title(report),
        title::colophon(report)
    );
    let judge = report.judge.filter(|_| report.model.is_some()).map(|judge| judge::payload(&judge));
    let nonce = nonce(&[&content, &payload, judge.as_deref().unwrap_or_default(), VIEWER, PAGE]);
    // A module may be compiled where the page carries one; there is nowhere to load another from.
    let compiling = if judge.is_some() { " 'wasm-unsafe-eval'" } else { "" };
    let policy = format!(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'nonce-{nonce}'{compiling}; \
         base-uri 'none'; form-action 'none'"
    );
    let name = report.assembly.map_or(report.spec, |a| a.design.name.as_str());
    let script = |kind: &str, text: &str| format!("<script{kind} nonce=\"{nonce}\">\n{text}</script>\n");
    let judge = judge.map(|blocks| blocks + &script(" type=\"module\"", judge::SCRIPT)).unwrap_or_default();
    let scripts = [script("", VIEWER), script("", PAGE), judge].concat();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<meta name=\"generator\" content=\"gonogo {}\">\n\
         <link rel=\"icon\" href=\"data:,\">\n<title>{} – gonogo report</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         {content}<script type=\"application/json\" id=\"data\">{payload}</script>\n{scripts}</body>\n</html>\n",
        env!("CARGO_PKG_VERSION"),
        escaped(name)
    )
}

/// A word that what is inside the page cannot know: script smuggled in by a name would need it to run.
fn nonce(texts: &[&str]) -> String {
    let mut hasher = blake3::Hasher::new();
    texts.iter().for_each(|t| {
        hasher.update(t.as_bytes());
    });
    hasher.finalize().to_hex()[..32].into()
}

/// A part of the page.
struct Section {
    id: &'static str,
    heading: &'static str,
    html: String,
}

/// All that have something to tell, in reading order.
fn sections(report: &Report) -> Vec<Section> {
    let mut all = Vec::new();
    let mut add = |id, heading, html: Option<String>| {
        all.extend(html.map(|html| Section { id, heading, html }));
    };
    let analysed = report.assembly.filter(|a| a.analysis.is_some());
    add("assembly", "Assembly", report.assembly.filter(|a| !a.solids.is_empty()).map(|a| parts::section(&a)));
    add("structure", "How it goes together", analysed.and_then(|a| drawings::section(&a)));
    add("measures", "Measured distances", analysed.and_then(|a| measures::section(&a)));
    add(
        "view",
        if report.others.is_empty() { "What the camera sees" } else { "What the cameras see" },
        report.assembly.zip(report.view).map(|(a, v)| {
            let views = std::iter::once(&v).chain(report.others);
            views.map(|view| station::section(&a, view, report)).collect::<Vec<_>>().join("\n")
        }),
    );
    add("promise", "What can be told", report.model.map(|m| promise::section(&m, report)));
    add("photos", "Photos", photos::section(report));
    add("judge", "Judge a photo", judge::section(report));
    add("findings", "Findings in the spec", Some(findings::section(report)));
    all
}

fn section(section: &Section) -> String {
    let Section { id, heading, html } = section;
    format!("<section id=\"{id}\" aria-labelledby=\"{id}-h\">\n<h2 id=\"{id}-h\">{heading}</h2>\n{html}</section>\n")
}

fn link(section: &Section) -> String {
    format!("<a href=\"#{}\">{}</a>", section.id, section.heading)
}
