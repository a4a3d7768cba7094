//! Stage 7: renders and nodes become a model.
//!
//! In: a design, one of its stations with the camera resolved, the error modes of the assembly. Out: a [`Model`] whose error
//! rates were measured on renders it had not seen. `train` searches and weighs with the runtime's own code, so what is
//! trained is what will judge. Never reads a photo.

mod edges;
mod fit;
mod other_views;
pub mod plan;
pub mod prove;
pub mod shots;
pub mod stats;
pub mod synthesise;
pub mod verify;

use crate::assembly::error_tree::ErrorTree;
use crate::assembly::fault::ErrorMode;
use crate::assembly::liaison::Liaison;
use crate::design::model::{Design, Response, Station};
use crate::diag::Diagnostic;
use crate::runtime::camera::Camera;
use crate::runtime::model::{self, FORMAT, Install, Lamp, ModeRate, Model, Node, Promise, Rate};
use crate::runtime::photo::Tone;
use crate::runtime::pose::Pose;
use crate::scene::build;
use fit::Context;
use other_views::Views;
use plan::Plan;
use rayon::prelude::*;
use shots::{Drawn, Setup};
use synthesise::{Draws, Shots, synthesise};

/// Customers imagined for the held-out renders.
const CUSTOMERS: u64 = 2;
/// Held-out draws of good assemblies per customer, the first of which calibrates, and of every error mode.
const HELD_OUT_GOOD: u32 = 13;
const HELD_OUT_FAULTY: u32 = 5;
/// Bright matt surfaces reach this grey value (share of full scale) under the described lamps.
const EXPOSED_TO: f64 = 0.6;
const EXPOSED_QUANTILE: f64 = 0.95;

/// A mode of which more than this share escapes is worth a warning.
pub const WEAK: f64 = 0.1;

/// What training starts from.
pub struct Job<'a> {
    pub design: &'a Design,
    pub station: &'a Station,
    /// The camera as designed (full resolution).
    pub camera: Camera,
    pub modes: &'a [ErrorMode],
    pub liaison: &'a Liaison,
    /// The tree of the whole assembly, from the component everything stands on.
    pub tree: &'a ErrorTree,
    /// Digest of the resolved spec.
    pub spec: String,
}

/// Steps of training, for whoever wants to show them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    Plan,
    Render,
    Fit,
    HeldOut,
    Verify,
}

/// Told about steps and, within them, units of work done of how many.
pub type Observer<'a> = dyn Fn(Step, usize, usize) + Sync + 'a;

/// Trains a model.
pub fn train(job: &Job, observer: &Observer) -> Result<(Model, Vec<Diagnostic>), Vec<Diagnostic>> {
    observer(Step::Plan, 0, 1);
    let nominal = shots::nominal(job.design, job.station)?;
    let plan = plan::plan(job.design, &job.camera, &nominal, job.liaison, job.modes);
    let mut doubts = doubts(job, &plan, &nominal);
    let images = job.design.train.images.max(2);
    let draws = Draws { seed: job.design.train.seed, count: images, faulty: images };
    let shots = render(job, &plan, &job.camera, draws, &|i, n| observer(Step::Render, i, n))?;
    observer(Step::Fit, 0, 1);
    let mut model = fit_model(job, &plan, &shots);
    let held_out = held_out(job, &plan, &model, observer)?;
    observer(Step::Verify, 0, 1);
    verify::verify(&mut model, job.design, &plan, job.modes, &held_out);
    doubts.extend(overlaps(job, &model, &nominal));
    Ok((model, doubts))
}

/// Components whose faults cannot be seen.
fn doubts(job: &Job, plan: &Plan, nominal: &Drawn) -> Vec<Diagnostic> {
    let blind = |&m: &usize| {
        let mode = &job.modes[m];
        let component = &job.design.components[mode.component];
        let message =
            format!("station `{}` cannot tell when `{}` is {}", job.station.name, component.name, mode.kind.word());
        Diagnostic::warning("W0602", component.span, message).label("nothing in the image changes")
    };
    let found: Vec<(&ErrorMode, Diagnostic)> = plan.unseen.iter().map(|m| (&job.modes[*m], blind(m))).collect();
    advised(job, nominal, found, "a go says nothing about this fault")
}

/// Faults that the model lets pass too often to rely on it.
fn overlaps(job: &Job, model: &Model, nominal: &Drawn) -> Vec<Diagnostic> {
    let weak = model.promise.modes.iter().filter(|m| f64::from(m.escape.events) > WEAK * f64::from(m.escape.trials));
    let doubt = |rate: &ModeRate| {
        let of =
            |m: &&ErrorMode| job.design.components[m.component].name == rate.component && m.kind.word() == rate.fault;
        let mode = job.modes.iter().find(of)?;
        let (escaped, trials) = (rate.escape.events, rate.escape.trials);
        let message =
            format!("station `{}` can hardly tell when `{}` is {}", job.station.name, rate.component, rate.fault);
        let fault = Diagnostic::warning("W0703", job.design.components[mode.component].span, message)
            .label(format!("{escaped} of {trials} synthetic photos with this fault pass"));
        Some((mode, fault))
    };
    advised(job, nominal, weak.filter_map(doubt).collect(), "a go says little about this fault")
}

/// With a note on where the fault would show, if there is such a place.
fn advised(job: &Job, nominal: &Drawn, found: Vec<(&ErrorMode, Diagnostic)>, what: &str) -> Vec<Diagnostic> {
    if found.is_empty() {
        return Vec::new();
    }
    let views = Views::new(job, nominal);
    let advise = |(mode, doubt): (&ErrorMode, Diagnostic)| match views.better(mode) {
        Some(view) => doubt.note(format!("{what}: {}", view.advice())),
        None => doubt.note(format!("{what}; no view at this distance shows it much better: another light may")),
    };
    found.into_iter().map(advise).collect()
}

/// Shots of all scenes of some draws by a camera.
fn render(
    job: &Job,
    plan: &Plan,
    camera: &Camera,
    draws: Draws,
    progress: &dyn Fn(usize, usize),
) -> Result<Shots, Vec<Diagnostic>> {
    let setup = Setup {
        station: job.station,
        camera: camera.reduced(plan.base),
        lamps: build::lamps(job.station, camera),
        samples: job.design.train.samples,
        blur: job.station.camera.blur.nominal / f64::from(plan.base),
    };
    let total = draws.shots(plan);
    let done = std::cell::Cell::new(0);
    progress(0, total);
    synthesise(job.design, &setup, plan, job.modes, draws, &|| {
        done.set(done.get() + 1);
        progress(done.get(), total);
    })
}

fn fit_model(job: &Job, plan: &Plan, shots: &Shots) -> Model {
    let lights = build::light_of_group(job.station);
    let names = build::lamps(job.station, &job.camera);
    let described: Vec<f64> = lights.iter().map(|&l| job.station.lights[l].power).collect();
    let drift: Vec<f64> = lights.iter().map(|&l| job.station.lights[l].drift).collect();
    let scale = exposure(plan, shots, &described);
    let powers: Vec<f64> = described.iter().map(|p| p * scale).collect();
    let lamp =
        |i: usize| Lamp { name: names[i].name.clone(), light: lights[i] as u32, power: powers[i], drift: drift[i] };
    let lamps: Vec<Lamp> = (0..powers.len()).map(lamp).collect();
    let station = station(job, lamps.clone());
    let home = Pose::home(&station);
    let context = Context {
        design: job.design,
        camera: &job.camera,
        home,
        plan,
        modes: job.modes,
        shots,
        powers: &powers,
        lamps: &lamps,
    };
    let mut nodes: Vec<Node> = plan.nodes.par_iter().filter_map(|node| fit::node(&context, node)).collect();
    hang(&mut nodes, job.design, job.tree);
    let unmeasured = Rate { events: 0, trials: 0, upper_95: 1.0 };
    Model {
        format: FORMAT,
        writer: format!("gonogo {}", env!("CARGO_PKG_VERSION")),
        assembly: job.design.name.clone(),
        spec: job.spec.clone(),
        seed: job.design.train.seed,
        station,
        promise: Promise {
            false_reject_asked: job.design.inspect.false_reject,
            false_reject: unmeasured,
            escape: unmeasured,
            modes: Vec::new(),
        },
        locator: fit::locator(&context),
        nodes,
    }
}

/// Hangs the nodes into the object tree: each below the nearest node on its way to the tree's root.
fn hang(nodes: &mut [Node], design: &Design, tree: &ErrorTree) {
    let place = |name: &str| tree.nodes.iter().position(|t| design.components[t.component].name == name);
    let names: Vec<String> = nodes.iter().map(|n| n.name.clone()).collect();
    let above = |at: usize| std::iter::successors(tree.nodes[at].parent, |&p| tree.nodes[p].parent);
    let node_at = |at: usize| names.iter().position(|n| *n == design.components[tree.nodes[at].component].name);
    for node in nodes {
        let ancestors: Vec<usize> = place(&node.name).into_iter().flat_map(above).filter_map(node_at).collect();
        node.parent = ancestors.first().map(|&p| p as u32);
        node.level = 1 + ancestors.len() as u32;
    }
}

/// The factor that brings bright surfaces of the assembly to a well exposed grey.
fn exposure(plan: &Plan, shots: &Shots, described: &[f64]) -> f64 {
    let lit = shots.good[0].lit(described);
    // Standing apart from home by a little does no harm to a quantile.
    let on_assembly = |i: usize| plan.good.id[i] != 0;
    let bright = edges::quantile(&lit, on_assembly, EXPOSED_QUANTILE);
    if bright > 0.0 { EXPOSED_TO / f64::from(bright) } else { 1.0 }
}

fn station(job: &Job, lamps: Vec<Lamp>) -> model::Station {
    let spec = &job.station.camera;
    let install = Install {
        position_mm: spec.install_mm,
        angle_rad: spec.install_rad,
        focal_share: spec.focal.half_width() / spec.focal.nominal,
        k1: [spec.k1.low, spec.k1.high],
    };
    let tone = match spec.response {
        Response::Linear => Tone::Linear,
        Response::Srgb => Tone::Srgb,
    };
    model::Station {
        name: job.station.name.clone(),
        camera: job.camera,
        tone,
        install,
        standing: shots::standing(job.station),
        noise: job.station.noise,
        lamps,
        // Measured with the held-out calibrations.
        least_correlation: 0.0,
    }
}

/// Fresh shots for each imagined customer, by the camera as he has it.
fn held_out(
    job: &Job,
    plan: &Plan,
    model: &Model,
    observer: &Observer,
) -> Result<Vec<(verify::Customer, Shots)>, Vec<Diagnostic>> {
    (0..CUSTOMERS)
        .map(|index| {
            let customer = verify::customer(model, index);
            let camera = customer.installation.apply(&job.camera);
            // Another seed than training's: these draws must be new.
            let draws = Draws { seed: customer.seed, count: HELD_OUT_GOOD, faulty: HELD_OUT_FAULTY };
            let progress = |i: usize, n: usize| observer(Step::HeldOut, index as usize * n + i, CUSTOMERS as usize * n);
            Ok((customer, render(job, plan, &camera, draws, &progress)?))
        })
        .collect()
}
