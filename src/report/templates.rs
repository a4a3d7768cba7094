//! What the model expects to see at its nodes, under every hypothesis.

use super::html::escaped;
use super::{Trained, picture};
use crate::runtime::grid::Grid;
use crate::runtime::model::Node;

/// Templates of more nodes are left out of the gallery.
const MOST_NODES: usize = 60;

/// A row of pictures per node.
pub fn gallery(trained: &Trained) -> String {
    let nodes = &trained.model.nodes;
    let weights = weights(trained);
    let rows: String = nodes.iter().take(MOST_NODES).map(|node| row(node, &weights, trained)).collect();
    let more = nodes.len().saturating_sub(MOST_NODES);
    let more = if more > 0 { format!("<p>{more} more nodes are not shown.</p>\n") } else { String::new() };
    let light = if trained.calibration.is_some() { "the calibrated light" } else { "the light the spec describes" };
    format!(
        "<details class=\"gallery\"><summary>Templates: what the model expects to see</summary>\n<p>The mean of the rendered \
         draws under {light}, for the correct component and for each of its faults.</p>\n{rows}{more}</details>\n"
    )
}

fn row(node: &Node, weights: &[f64], trained: &Trained) -> String {
    let pictures: String = node
        .hypotheses
        .iter()
        .enumerate()
        .map(|(h, hypothesis)| {
            let sweep =
                if hypothesis.sweep.is_empty() { String::new() } else { format!("<br>{}", escaped(&hypothesis.sweep)) };
            let caption = format!("{}{sweep}", escaped(&hypothesis.fault));
            figure(&picture::light(&expected(node, h, weights), trained.model.station.tone), &caption)
        })
        .collect();
    format!("<h4>{}</h4><div class=\"crops\">{pictures}</div>\n", escaped(&node.name))
}

/// A small picture with its caption, which is HTML already.
pub fn figure(uri: &str, caption: &str) -> String {
    format!("<figure><img src=\"{uri}\" alt=\"\"><figcaption>{caption}</figcaption></figure>")
}

/// The lamps' weights: calibrated, else as described.
pub fn weights(trained: &Trained) -> Vec<f64> {
    match trained.calibration {
        Some(calibration) => calibration.lamps.clone(),
        None => trained.model.station.lamps.iter().map(|l| l.power).collect(),
    }
}

/// The mean image of a hypothesis under these weights, clipped as a sensor clips.
pub fn expected(node: &Node, hypothesis: usize, weights: &[f64]) -> Grid {
    let [width, height] = node.size.map(|s| s as usize);
    let mut sum = Grid::filled(width, height, 0.0);
    let images = node.hypotheses.get(hypothesis).map_or(&[][..], |h| &h.images);
    let draws = images.len() as f64 / weights.len().max(1) as f64;
    for image in images {
        let lamp = image.lamp as usize;
        let weight = weights.get(lamp).copied().unwrap_or(0.0) * node.steps.get(lamp).copied().unwrap_or(0.0) / draws;
        let values = image.rows.iter().flat_map(|row| &row.0).map(|v| f32::from(*v) * weight as f32);
        sum.values.iter_mut().zip(values).for_each(|(s, v)| *s += v);
    }
    sum.values.iter_mut().for_each(|v| *v = v.min(1.0));
    sum
}
