//! Stage 7: renders and nodes become a model.
//!
//! In: a design, one of its stations with the camera resolved, the error modes of the assembly. Out: a [`Model`] whose error
//! rates were measured on renders it had not seen. `train` searches and weighs with the runtime's own code, so what is
//! trained is what will judge. Never reads a photo.

mod edges;
mod exposing;
mod fit;
mod kept;
mod other_views;
pub mod plan;
pub mod prove;
pub mod rig;
pub mod shots;
pub mod stats;
pub mod synthesise;
mod thresholds;
pub mod verify;
mod white;

use crate::assembly::error_tree::ErrorTree;
use crate::assembly::fault::ErrorMode;
use crate::assembly::liaison::Liaison;
use crate::cache::Cache;
use crate::design::model::{Design, Response, Station};
use crate::diag::Diagnostic;
use crate::runtime::camera::Camera;
use crate::runtime::model::{self, FORMAT, Install, Lamp, ModeRate, Model, Node, Promise, Rate};
use crate::runtime::photo::Tone;
use crate::runtime::pose::Pose;
use crate::scene::build;
use fit::Context;
use kept::Kept;
use other_views::{OtherView, Views};
use plan::Plan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use shots::Setup;
use std::collections::BTreeMap;
use synthesise::{Draws, Shots, synthesise};

/// Customers imagined for the held-out renders.
const CUSTOMERS: u64 = 6;
/// Held-out draws of good assemblies per customer, the first of which calibrates, and of every error mode.
const HELD_OUT_GOOD: u32 = 7;
const HELD_OUT_FAULTY: u32 = 2;
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
    /// Where shots and what was learnt from them are kept for the next time.
    pub cache: Option<&'a dyn Cache>,
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
    let kept = kept::learnt(job);
    let is_new = kept.is_none();
    let mut learnt = kept.map_or_else(|| learn(job, observer), Ok)?;
    let mut model = learnt.model.clone();
    (model.assembly, model.spec) = (job.design.name.clone(), job.spec.clone());
    verify::settle(&mut model, job.design, &learnt.scenes, job.modes, &learnt.held_out);
    let mut found = blind(job, &learnt.unseen);
    found.extend(overlaps(job, &model.promise));
    let mut doubts = advised(job, found, &mut learnt.advice)?;
    doubts.extend(white::highlights(job, &model));
    if is_new {
        kept::keep_learnt(job, &learnt);
    }
    Ok((model, doubts))
}

/// All that takes time: what is left depends on the false rejects asked for and on names.
#[derive(Serialize, Deserialize)]
struct Learnt {
    /// Modes that change next to nothing in the image.
    unseen: Vec<usize>,
    /// Per faulty scene the modes shown in it.
    scenes: Vec<Vec<usize>>,
    /// Without thresholds and promise.
    model: Model,
    held_out: verify::HeldOut,
    /// By mode, where it would show better, as far as that was looked for.
    advice: BTreeMap<usize, Option<OtherView>>,
}

fn learn(job: &Job, observer: &Observer) -> Result<Learnt, Vec<Diagnostic>> {
    observer(Step::Plan, 0, 1);
    let nominal = shots::nominal(job.design, job.station)?;
    let plan = plan::plan(job.design, &job.camera, &nominal, job.liaison, job.modes);
    let images = job.design.train.images.max(2);
    let draws = Draws { seed: job.design.train.seed, count: images, faulty: images };
    let shots = render(job, &plan, &job.camera, draws, &|i, n| observer(Step::Render, i, n))?;
    observer(Step::Fit, 0, 1);
    let mut model = fit_model(job, &plan, &shots);
    let held_out = held_out(job, &plan, &model, observer)?;
    observer(Step::Verify, 0, 1);
    let held_out = verify::judge_all(&mut model, job.design, &plan, job.modes, &held_out);
    Ok(Learnt { unseen: plan.unseen, scenes: plan.scenes, model, held_out, advice: BTreeMap::new() })
}

/// A fault that the model does not, or hardly, show: its mode, what that means, and the warning.
type Doubt = (usize, &'static str, Diagnostic);

/// Components whose faults cannot be seen.
fn blind(job: &Job, unseen: &[usize]) -> Vec<Doubt> {
    let blind = |&m: &usize| {
        let mode = &job.modes[m];
        let component = &job.design.components[mode.component];
        let message =
            format!("station `{}` cannot tell when `{}` is {}", job.station.name, component.name, mode.said());
        Diagnostic::warning("W0602", component.span, message).label("nothing in the image changes")
    };
    unseen.iter().map(|m| (*m, "a go says nothing about this fault", blind(m))).collect()
}

/// Faults that the model lets pass too often to rely on it.
fn overlaps(job: &Job, promise: &Promise) -> Vec<Doubt> {
    let weak = promise.modes.iter().filter(|m| f64::from(m.escape.events) > WEAK * f64::from(m.escape.trials));
    let doubt = |rate: &ModeRate| {
        let of = |m: &ErrorMode| job.design.components[m.component].name == rate.component && m.said() == rate.fault;
        let mode = job.modes.iter().position(of)?;
        let (escaped, trials) = (rate.escape.events, rate.escape.trials);
        let message =
            format!("station `{}` can hardly tell when `{}` is {}", job.station.name, rate.component, rate.fault);
        let fault = Diagnostic::warning("W0703", job.design.components[job.modes[mode].component].span, message)
            .label(format!("{escaped} of {trials} synthetic photos with this fault pass"));
        Some((mode, "a go says little about this fault", fault))
    };
    weak.filter_map(doubt).collect()
}

/// With a note on where the fault would show, if there is such a place. What is not `known` yet is looked for.
fn advised(
    job: &Job,
    found: Vec<Doubt>,
    known: &mut BTreeMap<usize, Option<OtherView>>,
) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    if found.iter().any(|(mode, ..)| !known.contains_key(mode)) {
        let nominal = shots::nominal(job.design, job.station)?;
        let views = Views::new(job, &nominal);
        for (mode, ..) in &found {
            known.entry(*mode).or_insert_with(|| views.better(&job.modes[*mode]));
        }
    }
    let advise = |(mode, what, doubt): Doubt| match known.get(&mode).copied().flatten() {
        Some(view) => doubt.note(format!("{what}: {}", view.advice())),
        None => doubt.note(format!("{what}; no view at this distance shows it much better: another light may")),
    };
    Ok(found.into_iter().map(advise).collect())
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
        base: plan.base,
    };
    let kept = Kept::new(job, &setup, camera);
    let total = draws.shots(plan);
    let done = std::cell::Cell::new(0);
    progress(0, total);
    synthesise(job.design, &setup, plan, job.modes, draws, &kept, &|| {
        done.set(done.get() + 1);
        progress(done.get(), total);
    })
}

fn fit_model(job: &Job, plan: &Plan, shots: &Shots) -> Model {
    let lights = build::light_of_group(job.station);
    let names = build::lamps(job.station, &job.camera);
    let described: Vec<f64> = lights.iter().map(|&l| job.station.lights[l].power).collect();
    let drift: Vec<f64> = lights.iter().map(|&l| job.station.lights[l].drift).collect();
    let scale = exposure(plan, shots, &described) * job.station.exposure.range.nominal;
    let powers: Vec<f64> = described.iter().map(|p| p * scale).collect();
    let lamp =
        |i: usize| Lamp { name: names[i].name.clone(), light: lights[i] as u32, power: powers[i], drift: drift[i] };
    let lamps = exposing::widened((0..powers.len()).map(lamp).collect(), &job.station.exposure);
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
    // What stands on the root is not below the root's own node: that knows nothing of where it stands.
    let named = |at: usize| names.iter().position(|n| *n == design.components[tree.nodes[at].component].name);
    let node_at = |at: usize| named(at).filter(|_| tree.nodes[at].parent.is_some());
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
        vignetting: spec.vignetting.nominal,
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
            let customer = verify::customer(model, job.station, index);
            let camera = customer.installation.apply(&job.camera);
            // Another seed than training's: these draws must be new.
            let draws = Draws { seed: customer.seed, count: HELD_OUT_GOOD, faulty: HELD_OUT_FAULTY };
            let progress = |i: usize, n: usize| observer(Step::HeldOut, index as usize * n + i, CUSTOMERS as usize * n);
            Ok((customer, render(job, plan, &camera, draws, &progress)?))
        })
        .collect()
}
