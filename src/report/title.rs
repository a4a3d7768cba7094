//! The title block: what this is a report of, and what it comes to, as in the corner of a drawing.

use super::html::{count, escaped, of, percent};
use super::{Report, Trained};
use crate::runtime::inspect::Decision;

pub fn title(report: &Report) -> String {
    let name = report.assembly.map_or(report.spec, |a| a.design.name.as_str());
    let fields: String =
        fields(report).into_iter().map(|(k, v)| format!("<div><dt>{k}</dt><dd>{v}</dd></div>")).collect();
    let tiles: String = tiles(report).into_iter().map(tile).collect();
    format!(
        "<header class=\"title\">\n<div class=\"block\"><div class=\"name\"><p class=\"mark\">gonogo report</p>\
         <h1>{}</h1></div><dl>{fields}</dl></div>\n<ul class=\"tiles\">{tiles}</ul>\n</header>\n",
        escaped(name)
    )
}

fn fields(report: &Report) -> Vec<(&'static str, String)> {
    let mut fields = vec![("Spec", escaped(report.spec).replace('/', "/<wbr>"))];
    let station = report.view.map(|v| v.station.name.as_str());
    let station = station.or(report.model.map(|m| m.model.station.name.as_str()));
    fields.extend(station.map(|s| ("Station", escaped(s))));
    if let Some(trained) = report.model {
        fields.push(("Model", escaped(&trained.model.writer)));
        fields.push(("Digest", escaped(&short(&trained.model.spec))));
        fields.push(("Calibrated", if trained.calibration.is_some() { "yes" } else { "no" }.into()));
    }
    fields.push(("Units", "mm, degrees".into()));
    fields
}

/// The first digits, after the name of the method.
fn short(digest: &str) -> String {
    digest.rsplit(':').next().unwrap_or_default().chars().take(10).collect()
}

/// A figure with its name, where more about it stands, and how it is coloured.
struct Tile {
    figure: String,
    name: String,
    to: &'static str,
    class: &'static str,
}

fn tile(tile: Tile) -> String {
    let Tile { figure, name, to, class } = tile;
    format!("<li class=\"{class}\"><a href=\"#{to}\"><b>{figure}</b><span>{name}</span></a></li>")
}

fn tiles(report: &Report) -> Vec<Tile> {
    let mut tiles = Vec::new();
    let mut add = |figure: String, name: &str, to, class| tiles.push(Tile { figure, name: name.into(), to, class });
    if let Some(assembly) = report.assembly {
        add(assembly.design.components.len().to_string(), "components", "assembly", "");
        if let Some(analysis) = assembly.analysis {
            add(analysis.liaison.contacts.len().to_string(), "contacts", "assembly", "");
        }
    }
    if let Some(Trained { model, .. }) = report.model {
        let promise = &model.promise;
        add(of(&promise.false_reject), "held-out goods rejected", "promise", grade(promise.false_reject.events));
        let most = format!("held-out faults missed, ≤ {}", percent(promise.escape.upper_95));
        add(of(&promise.escape), &most, "promise", grade(promise.escape.events));
    }
    let photos = |wanted| report.photos.iter().filter(|p| p.verdict.decision == wanted).count();
    let kinds = [(Decision::Go, "go"), (Decision::NoGo, "no-go"), (Decision::CannotInspect, "cannot inspect")];
    for (decision, name) in kinds.into_iter().filter(|(d, _)| photos(*d) > 0) {
        let class = super::html::class(decision);
        add(photos(decision).to_string(), &format!("photos {name}"), "photos", class);
    }
    let errors = report.diagnostics.iter().filter(|d| d.is_error()).count();
    let warnings = report.diagnostics.len() - errors;
    if errors > 0 {
        add(
            errors.to_string(),
            if errors == 1 { "error in the spec" } else { "errors in the spec" },
            "findings",
            "nogo",
        );
    }
    let name = count(warnings, "warning");
    let word = name.split_once(' ').map_or("", |(_, w)| w);
    add(warnings.to_string(), word, "findings", if warnings > 0 { "doubt" } else { "go" });
    tiles
}

fn grade(events: u32) -> &'static str {
    if events == 0 { "go" } else { "doubt" }
}

pub fn colophon(report: &Report) -> String {
    let digest = report.model.map(|m| format!(" Spec digest of the model: <code>{}</code>.", escaped(&m.model.spec)));
    format!(
        "<footer><p>Written by gonogo {}. This page needs nothing but itself: it asks no network for anything.{}</p>\
         </footer>\n",
        env!("CARGO_PKG_VERSION"),
        digest.unwrap_or_default()
    )
}
