//! What the chosen camera sees: the item buffer with the boxes and masks of the nodes (the paper's Fig. 10), and what the
//! model expects to see there.

use super::html::{at, escaped, number, percent};
use super::{Assembly, Report, View, colour, picture, templates, views};
use crate::runtime::model::Node;
use crate::runtime::window::mask_of;
use crate::view::item_buffer::{ItemBuffer, PixelBox};
use crate::view::nodes::Seen;

pub fn section(assembly: &Assembly, view: &View, report: &Report) -> String {
    let [width, height] = view.choice.camera.size;
    let buffer = ItemBuffer::of(view.bodies, &view.choice.camera.reduced(picture::reduction(view.choice.camera.size)));
    let name = |s: &Seen| escaped(&assembly.design.components[s.component].name);
    let boxes: String = view.choice.seen.iter().map(|s| boxes(s, &name(s), view.choice.camera.size)).collect();
    let nodes = report.model.filter(|m| m.model.station.camera.size == view.choice.camera.size).map(|m| &m.model.nodes);
    let veils: String = nodes.into_iter().flatten().map(|n| veil(assembly, n)).collect();
    let masks = if veils.is_empty() {
        ""
    } else {
        "<label><input type=\"checkbox\" data-layer=\"mask\"> masks of the nodes</label>"
    };
    let rows: String = view.choice.seen.iter().map(|s| row(s, &name(s))).collect();
    let templates = report.model.map(|m| templates::gallery(&m)).unwrap_or_default();
    format!(
        "<p>{}</p>\n<div class=\"pair\">\n<figure class=\"layers\" data-show=\"visible\">\n\
         <svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"The assembly as the camera sees it, a colour per \
         component, with boxes\">\n<image href=\"{}\" width=\"{width}\" height=\"{height}\"/>\n\
         <g class=\"mask\">{veils}</g>\n{boxes}</svg>\n\
         <figcaption class=\"row\"><label><input type=\"checkbox\" data-layer=\"visible\" checked> visible parts</label>\
         <label><input type=\"checkbox\" data-layer=\"full\"> whole components</label>{masks}</figcaption>\n</figure>\n\
         <div class=\"scroll\"><table>\n<thead><tr><th scope=\"col\">Component</th><th scope=\"col\">px seen</th>\
         <th scope=\"col\">of its own</th><th scope=\"col\">faces</th></tr></thead>\n<tbody>{rows}</tbody></table></div>\n\
         </div>\n{}{templates}",
        camera(view),
        picture::items(&buffer),
        views::section(assembly.design, view.choice)
    )
}

fn camera(view: &View) -> String {
    let place = view.choice.camera.position.map(|v| number(v, 1)).join(", ");
    let [width, height] = view.choice.camera.size;
    let lights: Vec<String> = view.station.lights.iter().map(|l| escaped(&l.name)).collect();
    format!(
        "Station {}: camera at ({place}) mm, {width} × {height} px, focal length {} px; lights: {}.",
        escaped(&view.station.name),
        number(view.choice.camera.focal, 0),
        lights.join(", ")
    )
}

/// Of the whole component and of what is seen of it, with its number.
fn boxes(seen: &Seen, name: &str, size: [u32; 2]) -> String {
    /// Radius of a balloon (px), and how near its middle comes to the border.
    const BALLOON: f64 = 9.0;
    let rect = |b: &PixelBox, class: &str| {
        format!(
            "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/>",
            b.x0,
            b.y0,
            b.x1.saturating_sub(b.x0),
            b.y1.saturating_sub(b.y0)
        )
    };
    let full = seen.full.as_ref().map(|b| rect(b, "full")).unwrap_or_default();
    let visible = seen.visible.as_ref().map(|b| rect(b, "visible")).unwrap_or_default();
    let tag = seen.visible.as_ref().map(|b| {
        let inside = |v: u32, size: u32| f64::from(v).min(f64::from(size) - BALLOON - 1.0).max(BALLOON + 1.0);
        let (x, y) = (inside(b.x0, size[0]), inside(b.y0, size[1]));
        format!(
            "<g class=\"balloon visible\"><circle cx=\"{0}\" cy=\"{1}\" r=\"{BALLOON}\"/><text x=\"{0}\" y=\"{2}\">{3}</text></g>",
            at(x),
            at(y),
            at(y + 3.6),
            seen.component + 1
        )
    });
    format!("<g data-c=\"{}\"><title>{name}</title>{full}{visible}{}</g>\n", seen.component, tag.unwrap_or_default())
}

/// The mask of a node of the model.
fn veil(assembly: &Assembly, node: &Node) -> String {
    let index = assembly.design.components.iter().position(|c| c.name == node.name);
    let factor = f64::from(node.factor);
    let [x, y] = node.origin.map(|o| at(f64::from(o) * factor));
    let [width, height] = node.size.map(|s| at(f64::from(s) * factor));
    let uri = picture::mask(&mask_of(node), colour::component(index.unwrap_or(0)));
    format!(
        "<image href=\"{uri}\" x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"><title>{}</title></image>\n",
        escaped(&node.name)
    )
}

fn row(seen: &Seen, name: &str) -> String {
    let share = f64::from(seen.visible_pixels) / f64::from(seen.full_pixels.max(1));
    let class = if seen.visible_pixels == 0 { " class=\"doubt\"" } else { "" };
    format!(
        "<tr data-c=\"{}\"{class}><th scope=\"row\"><i style=\"background:{}\">{}</i> {name}</th><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        seen.component,
        colour::hex(colour::component(seen.component)),
        seen.component + 1,
        seen.visible_pixels,
        percent(share),
        seen.faces.len()
    )
}
