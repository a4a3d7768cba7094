//! Highlights that leave a node nothing to see (W0604).
//!
//! In: a trained model with its promise. Out: a warning for every component whose faults often pass and whose surface is
//! white in most of the training images, with the exposure that would spare it. A white surface has no gradients. Where
//! every fault shows all the same, highlights do no harm and nothing is said.

use super::{Job, WEAK};
use crate::diag::Diagnostic;
use crate::runtime::light::Light;
use crate::runtime::model::{Model, Node};
use crate::runtime::window;

/// Share of a node's pixels from which on too much of it is white.
const TOO_WHITE: f64 = 0.2;
/// What spares the highlights leaves this share of the pixels at most above [`SPARED`] of full scale.
const LEFT: f64 = 0.05;
const SPARED: f64 = 0.95;
/// The language's least exposure.
const DARKEST: f64 = 0.05;

/// How white a node's images are.
#[derive(Debug, Clone, Copy, PartialEq)]
struct White {
    /// Mean share of white pixels in the images that have too many.
    share: f64,
    /// Of how many images.
    images: usize,
    of: usize,
    /// The factor on the light that would spare the highlights.
    factor: f64,
}

/// One warning for every component, in the order of the nodes.
pub(super) fn highlights(job: &Job, model: &Model) -> Vec<Diagnostic> {
    let powers: Vec<f64> = model.station.lamps.iter().map(|lamp| lamp.power).collect();
    // Photos under open light are exposed for themselves.
    if Light::new(&powers, &model.station.lamps).is_open() {
        return Vec::new();
    }
    let weak = |name: &str| {
        let often = |events: u32, trials: u32| f64::from(events) > WEAK * f64::from(trials);
        model.promise.modes.iter().any(|m| m.component == name && often(m.escape.events, m.escape.trials))
    };
    let warn = |node: &Node| {
        let found = white(node, &powers)?;
        let component = job.design.components.iter().find(|c| c.name == node.name)?;
        Some(warning(&job.station.name, component.span, node, found, job.station.exposure.range.nominal))
    };
    model.nodes.iter().filter(|node| weak(&node.name)).filter_map(warn).collect()
}

fn warning(station: &str, span: crate::diag::Span, node: &Node, found: White, exposure: f64) -> Diagnostic {
    let White { share, images, of, factor } = found;
    // Rounded down: two decimals are as much as anybody sets.
    let spared = ((exposure * factor * 100.0).floor() / 100.0).max(DARKEST);
    Diagnostic::warning("W0604", span, format!("station `{station}` sees highlights in place of `{}`", node.name))
        .label(format!("{:.0} % of it is white in {images} of {of} images", share * 100.0))
        .help(format!("write `exposure = {spared}` in `vary`"))
        .note("white surfaces show no gradients; a larger light, or one elsewhere, spreads highlights as well")
}

/// `None` unless too much is white in more than half of the images of the good state.
fn white(node: &Node, powers: &[f64]) -> Option<White> {
    let draws = greys(node, powers);
    let share = |draw: &Vec<f64>| draw.iter().filter(|&&grey| grey >= 1.0).count() as f64 / draw.len().max(1) as f64;
    let shares: Vec<f64> = draws.iter().map(share).filter(|&share| share >= TOO_WHITE).collect();
    if 2 * shares.len() <= draws.len() {
        return None;
    }
    let mut all: Vec<f64> = draws.concat();
    all.sort_by(f64::total_cmp);
    let bright = all.get((all.len() as f64 * (1.0 - LEFT)) as usize)?;
    Some(White {
        share: shares.iter().sum::<f64>() / shares.len() as f64,
        images: shares.len(),
        of: draws.len(),
        factor: SPARED / bright.max(1.0),
    })
}

/// Of each draw of the good state, the light (share of full scale, unclipped) of the node's pixels.
fn greys(node: &Node, powers: &[f64]) -> Vec<Vec<f64>> {
    let Some(good) = node.hypotheses.first() else { return Vec::new() };
    let mask = window::mask_of(node);
    let inside: Vec<(usize, usize)> =
        (0..mask.len()).flat_map(|y| (0..mask[y].len()).map(move |x| (y, x))).filter(|&(y, x)| mask[y][x]).collect();
    let mut draws: Vec<Vec<f64>> = Vec::new();
    for image in &good.images {
        let draw = image.draw as usize;
        if draws.len() <= draw {
            draws.resize(draw + 1, vec![0.0; inside.len()]);
        }
        let lamp = image.lamp as usize;
        let step = powers.get(lamp).zip(node.steps.get(lamp)).map_or(0.0, |(power, step)| power * step);
        for (grey, &(y, x)) in draws[draw].iter_mut().zip(&inside) {
            *grey += step * f64::from(image.rows[y].0[x]);
        }
    }
    draws
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::load;
    use crate::diag::Span;
    use crate::runtime::model::tests::tiny;
    use crate::runtime::row::Row;

    /// Of 16 pixels, `white` give the light 2 and the others 0.5, in `images` of 3 draws.
    fn node(white: usize, images: usize) -> Node {
        let mut node = tiny().nodes.remove(0);
        for image in &mut node.hypotheses[0].images {
            let bright = if (image.draw as usize) < images { white } else { 0 };
            let value = |i: usize| if i < bright { 200 } else { 50 };
            image.rows = (0..4).map(|y| Row((0..4).map(|x| value(4 * y + x)).collect())).collect();
        }
        node
    }

    #[test]
    fn a_node_is_white_where_much_of_it_is_in_most_images() {
        let found = white(&node(8, 2), &[1.0]).expect("half of it in two of three");
        assert_eq!((found.share, found.images, found.of), (0.5, 2, 3));
        assert!((found.factor - 0.475).abs() < 1e-12, "{found:?}");
        assert_eq!(white(&node(8, 1), &[1.0]), None, "in one image");
        assert_eq!(white(&node(3, 3), &[1.0]), None, "less than a fifth");
        assert_eq!(white(&node(8, 3), &[0.475]), None, "under the light that is advised");
    }

    #[test]
    fn the_help_compiles_and_says_what_spares_the_highlights() {
        let found = white(&node(8, 3), &[1.0]).unwrap();
        let warning = warning("bench", Span::default(), &node(8, 3), found, 1.0);
        assert_eq!(warning.labels[0].text, "50 % of it is white in 3 of 3 images");
        let help = warning.help.expect("a help");
        let pasted = help.split('`').nth(1).expect("something to paste");
        let spec = include_str!("../../tests/data/two_pins.gng");
        assert!(spec.contains("    vary {\n"));
        let spec = spec.replace("    vary {\n", &format!("    vary {{\n        {pasted}\n"));
        let loaded = load("spec.gng", &|_| Ok(spec.clone()), &[]);
        let design = loaded.design.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
        assert_eq!((design.stations[0].exposure.range.nominal, pasted), (0.47, "exposure = 0.47"));
    }
}
