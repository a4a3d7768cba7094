//! Inspectability: what the model promises, fault by fault, from renders it was not trained on.
//!
//! In: a model and, where the spec was analysed, its error modes. Out: a table with intervals, blind spots, and where scores
//! of good and faulty renders lie.

use super::html::{at, class, count, escaped, of, percent};
use super::strip::{Mark, strip};
use super::{Report, Trained};
use crate::runtime::model::{Hypothesis, ModeRate, Node, Rate};
use crate::train::{WEAK, stats::lower_95};

pub fn section(trained: &Trained, report: &Report) -> String {
    let promise = &trained.model.promise;
    let misfit = if trained.fits {
        ""
    } else {
        "<p class=\"doubt boxed\">The model was compiled from another version of this spec: what stands here may not hold for \
         it. Compile the spec again.</p>\n"
    };
    let overall = [("good assemblies rejected", &promise.false_reject), ("faults that escape", &promise.escape)];
    let overall: String = overall
        .into_iter()
        .map(|(name, rate)| line(&format!("<th scope=\"row\" colspan=\"3\">All {name}</th>"), rate, ""))
        .collect();
    let groups: String = components(&promise.modes).iter().map(|c| group(c, trained, report)).collect();
    format!(
        "{misfit}<p>The compiler rendered assemblies that it had not trained on, correct ones and ones with each fault, and \
         judged them with the whole detector. The spec asks for at most {} false rejects. Bars are 95 % intervals (Clopper \
         and Pearson): few renders tell little, and a bar that reaches far to the right promises little.</p>\n\
         <div class=\"scroll\"><table class=\"rates\">\n<thead><tr><th scope=\"col\">Component</th><th scope=\"col\">Fault</th>\
         <th scope=\"col\">Size</th><th scope=\"col\">Escaped</th><th scope=\"col\">Rate, 95 % interval{}</th>\
         <th scope=\"col\">Remark</th></tr></thead>\n<tbody>{overall}</tbody>\n{groups}</table></div>\n{}{}",
        percent(promise.false_reject_asked),
        ruler(),
        blind(trained, report),
        scores(trained, report)
    )
}

/// Names in their order, each once.
fn components(modes: &[ModeRate]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for mode in modes {
        if !names.contains(&mode.component.as_str()) {
            names.push(&mode.component);
        }
    }
    names
}

fn group(name: &str, trained: &Trained, report: &Report) -> String {
    let modes: Vec<&ModeRate> = trained.model.promise.modes.iter().filter(|m| m.component == name).collect();
    let node = trained.model.nodes.iter().find(|n| n.name == name);
    let index = report.assembly.and_then(|a| a.design.components.iter().position(|c| c.name == name));
    let row = |(i, mode): (usize, &&ModeRate)| {
        let head = format!("<th scope=\"rowgroup\" rowspan=\"{}\">{}</th>", modes.len(), escaped(name));
        let sweep = node.map(|n| sweep(n, &mode.fault)).unwrap_or_default();
        let cells = format!("{}<td>{}</td><td>{sweep}</td>", if i == 0 { &head } else { "" }, escaped(&mode.fault));
        line(&cells, &mode.escape, remark(&mode.escape))
    };
    let rows: String = modes.iter().enumerate().map(row).collect();
    let mark = index.map(|i| format!(" data-c=\"{i}\"")).unwrap_or_default();
    format!("<tbody{mark}>{rows}</tbody>\n")
}

/// The sizes a fault is looked for in; a part that is up at one side is so by any of them.
fn sweep(node: &Node, fault: &str) -> String {
    let of_fault = |h: &&Hypothesis| h.fault == fault && h.sweep.ends_with("mm");
    let mut sweeps: Vec<String> = node.hypotheses.iter().filter(of_fault).map(|h| escaped(&h.sweep)).collect();
    sweeps.dedup();
    sweeps.join("<br>")
}

fn remark(rate: &Rate) -> &'static str {
    let share = f64::from(rate.events);
    if rate.trials > 0 && rate.events == rate.trials {
        "blind spot: a go says nothing about it"
    } else if share > WEAK * f64::from(rate.trials) {
        "W0703: hardly told"
    } else {
        ""
    }
}

fn line(head: &str, rate: &Rate, remark: &str) -> String {
    let class = if remark.is_empty() { "" } else { " class=\"doubt\"" };
    format!("<tr{class}>{head}<td>{}</td><td>{}</td><td>{remark}</td></tr>\n", of(rate), bar(rate))
}

const BAR: f64 = 160.0;

/// The estimate as a dot on its interval.
fn bar(rate: &Rate) -> String {
    let (low, high) = (lower_95(rate), rate.upper_95);
    let share = f64::from(rate.events) / f64::from(rate.trials.max(1));
    let text = format!("{} ({} … {})", percent(share), percent(low), percent(high));
    format!(
        "<svg class=\"bar\" viewBox=\"-4 0 168 12\" aria-hidden=\"true\"><path class=\"axis\" d=\"M0 6H{BAR}\"/>\
         <path class=\"range\" d=\"M{0} 6H{1}M{0} 2V10M{1} 2V10\"/><circle cx=\"{2}\" cy=\"6\" r=\"3\"/></svg>\
         <span class=\"num\">{text}</span>",
        at(low * BAR),
        at(high * BAR),
        at(share * BAR)
    )
}

fn ruler() -> String {
    let tick = |p: u32| {
        let x = at(f64::from(p) / 100.0 * BAR);
        format!("<path d=\"M{x} 9V12\"/><text x=\"{x}\" y=\"7\">{p}</text>")
    };
    let ticks: String = [0, 25, 50, 75, 100].map(tick).concat();
    format!("<svg class=\"bar ruler\" viewBox=\"-8 0 176 12\" aria-hidden=\"true\">{ticks}</svg>")
}

/// Faults that nothing in the image shows, and watched components without a node.
fn blind(trained: &Trained, report: &Report) -> String {
    let Some(assembly) = report.assembly else { return String::new() };
    let promised = |component: &str, fault: &str| {
        trained.model.promise.modes.iter().any(|m| m.component == component && m.fault == fault)
    };
    let unseen: Vec<String> = assembly
        .modes
        .iter()
        .map(|m| (assembly.design.components[m.component].name.as_str(), m.said()))
        .filter(|(component, fault)| !promised(component, fault))
        .map(|(component, fault)| format!("<li>{}: {}</li>", escaped(component), escaped(fault)))
        .collect();
    if unseen.is_empty() || !trained.fits {
        return String::new();
    }
    format!(
        "<div class=\"doubt boxed\"><p>{} that this view does not show at all (W0602); a go says nothing about them:</p>\
         <ul>{}</ul></div>\n",
        count(unseen.len(), "fault"),
        unseen.concat()
    )
}

/// Where the scores of held-out renders lie, with the photos among them.
fn scores(trained: &Trained, report: &Report) -> String {
    let row = |(i, node): (usize, &Node)| {
        let marks = report.photos.iter().filter_map(|p| {
            let score = p.verdict.nodes.get(i).filter(|n| n.name == node.name)?.score;
            Some(Mark { score, class: class(p.verdict.decision), name: p.name.into() })
        });
        let marks: Vec<Mark> = marks.collect();
        format!("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", escaped(&node.name), strip(node, &marks))
    };
    let rows: String = trained.model.nodes.iter().enumerate().map(row).collect();
    let photos = if report.photos.is_empty() { "" } else { " Diamonds are the photos below." };
    format!(
        "<h3>Scores of held-out renders</h3>\n<p>Log-likelihood ratio per coefficient of the correct state against the likeliest \
         fault: <span class=\"key good\">correct renders</span> above the line, <span class=\"key fault\">faulty ones</span> below; a \
         score left of the <span class=\"key limit\">threshold</span> is a no-go.{photos}</p>\n\
         <div class=\"scroll\"><table class=\"strips\"><tbody>{rows}</tbody></table></div>\n"
    )
}
