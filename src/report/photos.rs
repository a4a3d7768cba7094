//! Photos with what was found drawn over them, in the manner of the paper's Figs. 11 to 13: the tilted box of the assembly, a
//! box per node drawn as many times as its level, crossed out where it is faulty; beside them findings, scores, templates.

use super::html::{at, class, count, escaped, number, percent, word};
use super::strip::{Mark, strip};
use super::{Report, Shot, Trained, picture, templates};
use crate::runtime::inspect::{Finding, NodeReport};
use crate::runtime::model::Node;
use crate::runtime::pose::Pose;
use crate::runtime::window::{Frame, Window};

/// Boxes of one node lie this far inside one another (px).
const GAP: f64 = 3.0;

pub fn section(report: &Report) -> Option<String> {
    (!report.photos.is_empty()).then(|| {
        let cards: String = report.photos.iter().enumerate().map(|(i, shot)| card(i, shot, report)).collect();
        let index: String = report.photos.iter().enumerate().map(entry).collect();
        format!(
            "<p>Every photo as it was judged. A box per component, green where it is correct, crossed out in red where it is \
             faulty, orange where another fault explains it. Pointing at a component above shows it here too.</p>\n\
             <p class=\"row\"><label><input type=\"checkbox\" id=\"overlays\" checked> draw verdicts over the photos</label></p>\n\
             <ul class=\"index\">{index}</ul>\n{cards}"
        )
    })
}

/// A line of the list of photos.
fn entry((index, shot): (usize, &Shot)) -> String {
    let verdict = shot.verdict;
    let base = shot.name.rsplit(['/', '\\']).next().unwrap_or(shot.name);
    let reason =
        if verdict.reason.is_empty() { String::new() } else { format!("<small>{}</small>", escaped(&verdict.reason)) };
    format!(
        "<li><span class=\"verdict {}\">{}</span><span><a href=\"#photo-{index}\">{}</a> {reason}</span></li>\n",
        class(verdict.decision),
        word(verdict.decision),
        escaped(base)
    )
}

fn card(index: usize, shot: &Shot, report: &Report) -> String {
    let verdict = shot.verdict;
    let (class, word) = (class(verdict.decision), word(verdict.decision));
    let picture = shot
        .grey
        .map_or_else(|| "<p class=\"nopicture\">No picture could be read.</p>".into(), |_| figure(shot, report));
    let findings: String = verdict.findings.iter().map(finding).collect();
    let findings = if findings.is_empty() { String::new() } else { format!("<ul class=\"list\">{findings}</ul>") };
    let reason = match verdict.decision {
        crate::runtime::inspect::Decision::CannotInspect => format!("<p>{}</p>", escaped(&verdict.reason)),
        _ => String::new(),
    };
    let pose = verdict.pose.map(|p| {
        format!(
            "<p class=\"num\">Found at ({}, {}) mm, turned {}°, locator's score {}.</p>",
            number(p.x, 2),
            number(p.y, 2),
            number(p.rz.to_degrees(), 2),
            number(verdict.locator_score, 2)
        )
    });
    let more = report.model.map(|trained| details(shot, &trained)).unwrap_or_default();
    format!(
        "<article class=\"photo\" id=\"photo-{index}\">\n<h3><span class=\"verdict {class}\">{word}</span> {}</h3>\n\
         <div class=\"pair\">{picture}<div>{reason}{findings}{}{more}</div></div>\n</article>\n",
        escaped(shot.name),
        pose.unwrap_or_default()
    )
}

fn finding(finding: &Finding) -> String {
    format!(
        "<li><b>{}</b>: {} <small>({} of correct assemblies look as bad)</small></li>",
        escaped(&finding.component),
        escaped(&finding.fault),
        if finding.p_value.is_finite() { format!("at most {}", percent(up(finding.p_value))) } else { "–".into() }
    )
}

/// A share that is told as a bound is rounded up to what [`percent`] shows.
fn up(share: f64) -> f64 {
    (1000.0 * share).ceil() / 1000.0
}

fn figure(shot: &Shot, report: &Report) -> String {
    let Some(grey) = shot.grey else { return String::new() };
    let (width, height) = grey.dimensions();
    let verdict = shot.verdict;
    let number =
        |node: &NodeReport| report.assembly.and_then(|a| a.design.components.iter().position(|c| c.name == node.name));
    let whole = verdict.outline.map(|o| quad(shrunk(o, -GAP), "whole")).unwrap_or_default();
    let nodes: String = verdict.nodes.iter().map(|n| node(n, number(n))).collect();
    let label = format!("{}: {}", shot.name, word(verdict.decision));
    format!(
        "<figure class=\"overlay\"><svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\">\
         <image href=\"{}\" width=\"{width}\" height=\"{height}\"/><g class=\"drawn\">{whole}{nodes}</g></svg></figure>",
        escaped(&label),
        picture::grey(grey)
    )
}

fn node(node: &NodeReport, index: Option<usize>) -> String {
    let class = match (node.faulty, node.explained) {
        (false, _) => "good",
        (true, true) => "explained",
        (true, false) => "faulty",
    };
    /// Deeper trees are not drawn with more boxes than this.
    const MOST_BOXES: u32 = 6;
    let rings: String =
        (0..=node.level.min(MOST_BOXES)).map(|r| quad(shrunk(node.outline, GAP * f64::from(r)), "")).collect();
    let cross = if node.faulty {
        let [a, b, c, d] = node.crossed.map(|p| p.map(at).join(" "));
        format!("<path d=\"M{a}L{c}M{b}L{d}\"/>")
    } else {
        String::new()
    };
    let mark = index.map(|i| format!(" data-c=\"{i}\"")).unwrap_or_default();
    let fault = if node.faulty { format!(": {}", node.best_fault) } else { String::new() };
    format!("<g class=\"{class}\"{mark}><title>{}</title>{rings}{cross}</g>", escaped(&format!("{}{fault}", node.name)))
}

fn quad(corners: [[f64; 2]; 4], class: &str) -> String {
    let points: Vec<String> = corners.iter().map(|p| p.map(at).join(",")).collect();
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    format!("<polygon{class} points=\"{}\"/>", points.join(" "))
}

/// The corners moved towards the centre so that the sides come closer by about `by` px (apart if negative), but never
/// past it.
pub(crate) fn shrunk(corners: [[f64; 2]; 4], by: f64) -> [[f64; 2]; 4] {
    let centre = [0, 1].map(|i| corners.iter().map(|c| c[i]).sum::<f64>() / 4.0);
    corners.map(|corner| {
        let arm = [corner[0] - centre[0], corner[1] - centre[1]];
        let reach = arm[0].abs().min(arm[1].abs());
        // What is smaller than the step keeps a fifth of its size, so that it stays in sight.
        let share = if reach > by.abs() { 1.0 - by / reach } else { 0.2 };
        [centre[0] + arm[0] * share, centre[1] + arm[1] * share]
    })
}

/// Scores of all nodes, and what was expected beside what was seen.
fn details(shot: &Shot, trained: &Trained) -> String {
    let nodes: Vec<(&Node, &NodeReport)> =
        trained.model.nodes.iter().zip(&shot.verdict.nodes).filter(|(n, r)| n.name == r.name).collect();
    if nodes.is_empty() {
        return String::new();
    }
    let row = |(node, report): &(&Node, &NodeReport)| {
        let class = if report.faulty { "nogo" } else { "go" };
        let mark = Mark { score: report.score, class, name: shot.name.into() };
        let bold = if report.faulty { " class=\"faulty\"" } else { "" };
        format!(
            "<tr{bold}><th scope=\"row\">{}</th><td>{}</td><td class=\"num\">{}</td></tr>\n",
            escaped(&node.name),
            strip(node, &[mark]),
            number(report.score, 3)
        )
    };
    let rows: String = nodes.iter().map(row).collect();
    let (faulty, sound): (Vec<_>, Vec<_>) = nodes.iter().partition(|(_, r)| r.faulty);
    let crops = |nodes: &[&(&Node, &NodeReport)]| -> String {
        nodes.iter().filter_map(|(node, report)| crops(shot, trained, node, report)).collect()
    };
    let correct = match crops(&sound) {
        pictures if pictures.is_empty() => pictures,
        pictures => {
            format!("<details><summary>{} seen as correct</summary>{pictures}</details>", count(sound.len(), "node"))
        }
    };
    format!(
        "{}<details open><summary>Scores of all nodes</summary><table class=\"strips\"><tbody>{rows}</tbody></table></details>\
         {correct}",
        crops(&faulty)
    )
}

/// The node in the photo beside the good template and the likeliest fault's.
fn crops(shot: &Shot, trained: &Trained, node: &Node, report: &NodeReport) -> Option<String> {
    let model = trained.model;
    let station = &model.station;
    let (photo, pose) = (shot.photo?, shot.verdict.pose?);
    let camera = trained.calibration.map_or(station.camera, |c| c.installation.apply(&station.camera));
    let window = Window::new(Frame::of(node), &station.camera, &Pose::home(station))?;
    let reduced = photo.light.reduced(node.factor as usize);
    let seen = window.cut(&reduced, &window.place(&camera, &pose), [0.0; 2]);
    let weights = templates::weights(trained);
    let expected = |h: usize| picture::light(&templates::expected(node, h, &weights), station.tone);
    // Of several sizes of one fault, that which the photo speaks for most.
    let against = |h: &usize| report.against.get(*h).copied().unwrap_or(f64::INFINITY);
    let likeliest = (1..node.hypotheses.len()).min_by(|a, b| against(a).total_cmp(&against(b)));
    let fault = likeliest.map(|h| templates::figure(&expected(h), &escaped(&node.hypotheses[h].fault)));
    Some(format!(
        "<h4>{}</h4><div class=\"crops\">{}{}{}</div>\n",
        escaped(&node.name),
        templates::figure(&picture::light(&seen, station.tone), "photo"),
        templates::figure(&expected(0), "expected"),
        fault.unwrap_or_default()
    ))
}
