//! What a model holds, for people: its station, its promise, its nodes; every image reduced to its mean and spread.
//!
//! In: a model. Out: RON of a few hundred lines, lengths in mm, angles in degrees. Never the model itself, which is long and
//! has a file of its own.

use super::{Named, ron, rounded};
use crate::runtime::model::{Hypothesis, Model, Node, Promise, Rate, Station};
use crate::runtime::window::{Stencil, mask_of};
use serde::Serialize;

#[derive(Serialize)]
struct ModelSummary<'a> {
    writer: &'a str,
    assembly: &'a str,
    seed: u64,
    station: StationSummary<'a>,
    promise: PromiseSummary,
    /// Groups of the locator: alternatives, fine points.
    locator: Named<(usize, usize)>,
    nodes: Named<NodeSummary<'a>>,
}

#[derive(Serialize)]
struct StationSummary<'a> {
    name: &'a str,
    position: [f64; 3],
    /// px
    focal: f64,
    size: [u32; 2],
    /// Half-widths of what is not known of the camera: mm, degrees, share of the focal length.
    install: (f64, f64, f64),
    /// x, y, z in mm, turn in degrees.
    standing: [[f64; 2]; 4],
    noise: f64,
    /// Power and drift.
    lamps: Named<(f64, f64)>,
    least_correlation: f64,
}

#[derive(Serialize)]
struct PromiseSummary {
    false_reject_asked: f64,
    false_reject: RateSummary,
    escape: RateSummary,
    modes: Named<RateSummary>,
}

#[derive(Serialize)]
struct RateSummary {
    events: u32,
    trials: u32,
    upper_95: f64,
}

#[derive(Serialize)]
struct NodeSummary<'a> {
    level: u32,
    /// Height of the plane (mm).
    plane: f64,
    /// px of the photo per px of the window, and the window in its own px.
    factor: u32,
    origin: [i32; 2],
    window: [u32; 2],
    mask_pixels: u32,
    /// Coefficients of each resolution: together the dimensions of the density.
    coefficients: Vec<usize>,
    /// Number of held-out renders, good and faulty, and the scores that come nearest to the other side.
    held_out: (usize, usize),
    lowest_good: Option<f64>,
    highest_fault: Option<f64>,
    hypotheses: Vec<HypothesisSummary<'a>>,
}

#[derive(Serialize)]
struct HypothesisSummary<'a> {
    fault: &'a str,
    #[serde(skip_serializing_if = "str::is_empty")]
    sweep: &'a str,
    threshold: f64,
    images: usize,
    /// Of the integers.
    mean: f64,
    spread: f64,
}

/// The model in short.
pub fn model_summary(model: &Model) -> String {
    let groups = model.locator.groups.iter().map(|g| {
        let points = g.alternatives.iter().map(|a| a.fine.len()).sum();
        (g.name.clone(), (g.alternatives.len(), points))
    });
    let summary = ModelSummary {
        writer: &model.writer,
        assembly: &model.assembly,
        seed: model.seed,
        station: station(&model.station),
        promise: promise(&model.promise),
        locator: Named(groups.collect()),
        nodes: Named(model.nodes.iter().map(|n| (n.name.clone(), node(n))).collect()),
    };
    ron(4, &summary)
}

fn station(station: &Station) -> StationSummary<'_> {
    let degrees = |rad: f64| rounded(rad.to_degrees(), 4);
    let install = &station.install;
    let [x, y, z, rz] = station.standing;
    StationSummary {
        name: &station.name,
        position: station.camera.position.map(|v| rounded(v, 3)),
        focal: rounded(station.camera.focal, 3),
        size: station.camera.size,
        install: (rounded(install.position_mm, 4), degrees(install.angle_rad), rounded(install.focal_share, 5)),
        standing: [x, y, z, rz.map(degrees)],
        noise: rounded(station.noise, 5),
        lamps: Named(
            station.lamps.iter().map(|l| (l.name.clone(), (rounded(l.power, 4), rounded(l.drift, 4)))).collect(),
        ),
        least_correlation: rounded(station.least_correlation, 3),
    }
}

fn promise(promise: &Promise) -> PromiseSummary {
    let modes = promise.modes.iter().map(|m| (format!("{} {}", m.component, m.fault), rate(&m.escape)));
    PromiseSummary {
        false_reject_asked: promise.false_reject_asked,
        false_reject: rate(&promise.false_reject),
        escape: rate(&promise.escape),
        modes: Named(modes.collect()),
    }
}

fn rate(rate: &Rate) -> RateSummary {
    RateSummary { events: rate.events, trials: rate.trials, upper_95: rounded(rate.upper_95, 4) }
}

fn node(node: &Node) -> NodeSummary<'_> {
    let stencil = Stencil::new(&mask_of(node), node.levels);
    NodeSummary {
        level: node.level,
        plane: rounded(node.plane, 3),
        factor: node.factor,
        origin: node.origin,
        window: node.size,
        mask_pixels: node.mask.iter().flat_map(|row| row.chunks(2)).map(|run| run[1]).sum(),
        coefficients: stencil.levels.iter().map(|l| l.len()).collect(),
        held_out: (node.good_scores.len(), node.fault_scores.len()),
        lowest_good: node.good_scores.first().map(|&s| rounded(s, 3)),
        highest_fault: node.fault_scores.last().map(|&s| rounded(s, 3)),
        hypotheses: node.hypotheses.iter().map(hypothesis).collect(),
    }
}

fn hypothesis(hypothesis: &Hypothesis) -> HypothesisSummary<'_> {
    let values = || hypothesis.images.iter().flat_map(|i| i.rows.iter().flat_map(|row| &row.0)).map(|&v| f64::from(v));
    let count = values().count().max(1) as f64;
    let mean = values().sum::<f64>() / count;
    let spread = (values().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt();
    HypothesisSummary {
        fault: &hypothesis.fault,
        sweep: &hypothesis.sweep,
        threshold: rounded(hypothesis.threshold, 4),
        images: hypothesis.images.len(),
        mean: rounded(mean, 2),
        spread: rounded(spread, 2),
    }
}
