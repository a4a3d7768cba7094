//! The assembly in 3-D with the list of its components; the drawing itself is the viewer's.

use super::body::steps;
use super::html::{count, escaped};
use super::{Assembly, colour};

pub fn section(assembly: &Assembly) -> String {
    format!(
        "<div class=\"viewer\">\n<div class=\"tree\">\n<h3>Components</h3>\n<ol class=\"parts\">{}</ol>\n{}</div>\n\
         <div class=\"stage\">\n<canvas id=\"canvas\" tabindex=\"0\" role=\"application\" \
         aria-label=\"The assembly in three dimensions. Arrow keys turn it, plus and minus zoom, Escape deselects.\">\
         This needs a browser that draws on a canvas.</canvas>\n\
         <p id=\"tip\" class=\"tip\" hidden></p>\n{CONTROLS}</div>\n\
         <div class=\"about\" id=\"about\" aria-live=\"polite\"><h3>Nothing selected</h3>\
         <p>Click a face to see its name, its component and what it touches. Drag to turn, \
         pinch or, once clicked, use the wheel to zoom, Shift and drag to move.</p></div>\n</div>\n",
        list(assembly),
        order(assembly)
    )
}

const CONTROLS: &str = "<div class=\"controls\">\n\
<label class=\"wide\">Explode <input type=\"range\" id=\"explode\" min=\"0\" max=\"100\" value=\"0\"></label>\n\
<div class=\"row\" role=\"group\" aria-label=\"Views\"><button type=\"button\" data-view=\"iso\">Iso</button>\
<button type=\"button\" data-view=\"front\">Front</button><button type=\"button\" data-view=\"right\">Right</button>\
<button type=\"button\" data-view=\"top\">Top</button>\
<button type=\"button\" data-view=\"camera\" hidden>Camera</button></div>\n\
<div class=\"row\" role=\"group\" aria-label=\"Zoom\"><button type=\"button\" data-zoom=\"0.8\" \
aria-label=\"Zoom out\">−</button><button type=\"button\" data-zoom=\"1.25\" aria-label=\"Zoom in\">+</button></div>\n\
<label><input type=\"checkbox\" id=\"through\" checked> see through the rest</label>\n\
<label>Colour by <select id=\"colours\"><option value=\"component\">component</option>\
<option value=\"material\">material</option><option value=\"risk\" hidden>chance that a fault escapes</option></select>\
</label>\n<p id=\"legend\" class=\"legend\" hidden>0 % <i></i> 100 % of the worst fault, upper end of 95 %; grey: not watched</p>\n</div>\n";

fn list(assembly: &Assembly) -> String {
    let design = assembly.design;
    let item = |(i, component): (usize, &crate::design::model::Component)| {
        let part = &design.parts[component.part];
        let material = &design.materials[part.material].name;
        let touches = assembly.analysis.map(|a| format!(" · {}", count(a.liaison.of(i).count(), "contact")));
        let watched = match design.inspect.watch.iter().any(|w| w.component == i) {
            true => "",
            false if i == 0 && design.inspect.root => " · watched for what lies on it",
            false => " · not watched",
        };
        format!(
            "<li><button type=\"button\" data-c=\"{i}\"><i style=\"background:{}\">{}</i><span>{}\
             <small>{}{}{watched}</small></span></button></li>\n",
            colour::hex(colour::component(i)),
            i + 1,
            escaped(&component.name),
            escaped(material),
            touches.unwrap_or_default()
        )
    };
    design.components.iter().enumerate().map(item).collect()
}

/// The order of assembly as steps to click.
fn order(assembly: &Assembly) -> String {
    let Some(analysis) = assembly.analysis else { return String::new() };
    let components = &assembly.design.components;
    let steps = steps(&analysis.insertion, components.len());
    let last = steps.iter().copied().max().unwrap_or(0);
    let item = |step: usize| {
        let own = components.iter().zip(&steps).filter(|(_, s)| **s == step);
        let names: Vec<String> = own.map(|(c, _)| escaped(&c.name)).collect();
        format!("<li><button type=\"button\" data-step=\"{step}\">{}</button></li>\n", names.join(", "))
    };
    let items: String = (0..=last).map(item).collect();
    let along = match analysis.insertion.common {
        Some(direction) => format!("<p>All come off along {}.</p>\n", axis(direction)),
        None => "<p>There is no one direction along which all come off.</p>\n".into(),
    };
    let locked: Vec<String> = analysis.insertion.locked.iter().map(|c| escaped(&components[*c].name)).collect();
    let locked = if locked.is_empty() {
        String::new()
    } else {
        format!("<p class=\"doubt\">Locked in each other: {}.</p>\n", locked.join(", "))
    };
    format!("<h3>Order of assembly</h3>\n<ol class=\"steps\" start=\"0\">{items}</ol>\n{along}{locked}")
}

/// `+z`, or the vector.
fn axis(direction: [f64; 3]) -> String {
    const NEAR: f64 = 1e-6;
    let names = ["x", "y", "z"];
    let main = (0..3).find(|&i| (direction[i].abs() - 1.0).abs() < NEAR);
    match main {
        Some(i) => format!("{}{}", if direction[i] > 0.0 { "+" } else { "−" }, names[i]),
        None => format!("({})", direction.map(|v| super::html::number(v, 3)).join(", ")),
    }
}
