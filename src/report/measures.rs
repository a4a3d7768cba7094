//! Distances that the spec asks for: worst case, distribution, and who changes them.

use super::Assembly;
use super::html::{escaped, number, percent};
use crate::assembly::measure::{Contributor, Measured};

/// Contributors told by name.
const MOST: usize = 4;

pub fn section(assembly: &Assembly) -> Option<String> {
    let measures = &assembly.analysis?.measures;
    let rows: String = measures.iter().map(row).collect();
    (!measures.is_empty()).then(|| {
        format!(
            "<div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">Distance</th><th scope=\"col\">From, to</th>\
             <th scope=\"col\">Nominal</th><th scope=\"col\">Worst case</th><th scope=\"col\">99.73 % of draws</th>\
             <th scope=\"col\">Limits</th><th scope=\"col\">Outside</th><th scope=\"col\">Share of the variance</th></tr></thead>\n\
             <tbody>{rows}</tbody></table></div>\n"
        )
    })
}

fn row(measure: &Measured) -> String {
    let span = |[low, high]: [f64; 2]| format!("{} … {}", number(low, 4), number(high, 4));
    let class = if measure.outside > 0.0 { " class=\"doubt\"" } else { "" };
    let contributors: Vec<String> = measure.contributors.iter().take(MOST).map(contributor).collect();
    format!(
        "<tr{class}><th scope=\"row\">{}</th><td>{}<br>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escaped(&measure.name),
        escaped(&measure.from),
        escaped(&measure.to),
        number(measure.nominal, 4),
        span(measure.worst),
        span(measure.quantiles),
        measure.limits.map_or("–".into(), span),
        if measure.limits.is_some() { percent(measure.outside) } else { "–".into() },
        contributors.join("<br>")
    )
}

fn contributor(contributor: &Contributor) -> String {
    format!("{} {}", percent(contributor.variance), escaped(&contributor.dimension))
}
