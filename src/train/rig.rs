//! Several cameras that look at one assembly become one model.
//!
//! In: a job a camera, all of one design and of stations that differ by the camera alone. Out: a [`Rig`] whose error rates are
//! those of the joint verdict, measured on renders of the same assemblies by all cameras. Each camera is trained like one
//! alone; what is added is how much each counts, and the thresholds of the sums. Never reads a photo.

use super::plan::{self, Plan};
use super::stats::{rate, rounded};
use super::synthesise::{Draws, Shots};
use super::thresholds::{self, at_share, most_shown};
use super::verify::{self, Customer, HeldOut, Judged};
use super::{CUSTOMERS, HELD_OUT_FAULTY, HELD_OUT_GOOD, Job, Observer, Step};
use super::{advised, blind, fit_model, overlaps, render, shots};
use crate::assembly::fault::ErrorMode;
use crate::design::model::{Design, Station};
use crate::diag::Diagnostic;
use crate::runtime::inspect::Verdict;
use crate::runtime::joint;
use crate::runtime::model::{FORMAT, ModeRate, Model, Promise};
use crate::runtime::rig::{Component, Mode, Rig, Seen, hypotheses};
use std::collections::{BTreeMap, BTreeSet};

/// No camera is believed more than this many standard deviations between good and faulty: renders are no photos.
const SUREST: f64 = 4.0;
/// Share of the lowest goods and the highest faults left out when asking whether they overlap: photos in which the pose went wrong,
/// which say nothing about the node.
const TRIM: f64 = 0.1;
/// The median distance of a normal variable from its mean is this share of a standard deviation.
const MEDIAN_DISTANCE: f64 = 0.6745;
/// Installations of different cameras are drawn this many customers apart.
const CAMERAS_APART: u64 = 1 << 32;

/// One customer's assemblies as every camera judged them; `None` where a camera could not be calibrated.
type Together = Option<Vec<Judged>>;

/// What all rates are measured on.
struct Trials<'a> {
    design: &'a Design,
    modes: &'a [ErrorMode],
    /// Per faulty scene the modes shown in it, and those of them that each camera sees.
    scenes: &'a [Vec<usize>],
    seen: &'a [Vec<Vec<usize>>],
    customers: &'a [Together],
}

/// Trains a rig.
pub fn train(jobs: &[Job], observer: &Observer) -> Result<(Rig, Vec<Diagnostic>), Vec<Diagnostic>> {
    let first = &jobs[0];
    observer(Step::Plan, 0, 1);
    let nominal = shots::nominal(first.design, first.station)?;
    let cameras: Vec<_> = jobs.iter().map(|job| job.camera).collect();
    let mut plans = plan::together(first.design, &cameras, &nominal, first.liaison, first.modes);
    let scenes = plans[0].scenes.clone();
    let (mut models, mut held_out) = (Vec::new(), Vec::new());
    for (camera, (job, plan)) in jobs.iter().zip(&mut plans).enumerate() {
        let (model, judged) = learn(job, plan, (camera, jobs.len()), observer)?;
        models.push(model);
        held_out.push(judged);
    }
    observer(Step::Verify, 0, 1);
    let seen: Vec<Vec<Vec<usize>>> = plans.iter().map(|plan| plan.scenes.clone()).collect();
    let customers = together(held_out);
    let trials =
        Trials { design: first.design, modes: first.modes, scenes: &scenes, seen: &seen, customers: &customers };
    let rig = assembled(first, models, &trials);
    let unseen: Vec<usize> =
        (0..first.modes.len()).filter(|m| plans.iter().all(|plan| plan.unseen.contains(m))).collect();
    let station = Station { name: first.station.place_name().to_string(), ..first.station.clone() };
    let whole = Job { station: &station, spec: first.spec.clone(), ..*first };
    let mut found = blind(&whole, &unseen);
    found.extend(overlaps(&whole, &rig.promise));
    let doubts = advised(&whole, found, &mut BTreeMap::new())?;
    Ok((rig, doubts))
}

/// One camera's model, and what it makes of the held-out assemblies. Afterwards the plan's scenes hold only what it sees.
fn learn(
    job: &Job,
    plan: &mut Plan,
    (camera, cameras): (usize, usize),
    observer: &Observer,
) -> Result<(Model, HeldOut), Vec<Diagnostic>> {
    let images = job.design.train.images.max(2);
    let draws = Draws { seed: job.design.train.seed, count: images, faulty: images };
    let part = |step: Step| move |i: usize, n: usize| observer(step, camera * n + i, cameras * n);
    let shots = render(job, plan, &job.camera, draws, &part(Step::Render))?;
    observer(Step::Fit, camera, cameras);
    let mut model = fit_model(job, plan, &shots);
    drop(shots);
    let taken = (0..CUSTOMERS).map(|index| {
        let draws = |seed: u64| Draws { seed, count: HELD_OUT_GOOD, faulty: HELD_OUT_FAULTY };
        let progress = |i, n| part(Step::HeldOut)(index as usize * n + i, CUSTOMERS as usize * n);
        photographed(job, plan, (&model, camera), index, &draws, &progress)
    });
    let taken: Vec<(Customer, Shots)> = taken.collect::<Result<_, _>>()?;
    plan.scenes.iter_mut().for_each(|scene| scene.retain(|m| !plan.unseen.contains(m)));
    observer(Step::Verify, camera, cameras);
    let judged = verify::judge_all(&mut model, job.design, plan, job.modes, &taken);
    verify::settle(&mut model, job.design, &plan.scenes, job.modes, &judged);
    Ok((model, judged))
}

/// A customer's assemblies by one of the cameras.
fn photographed(
    job: &Job,
    plan: &Plan,
    (model, camera): (&Model, usize),
    index: u64,
    draws: &dyn Fn(u64) -> Draws,
    progress: &dyn Fn(usize, usize),
) -> Result<(Customer, Shots), Vec<Diagnostic>> {
    let customer = customer(model, job.station, index, camera as u64);
    let hung = customer.installation.apply(&job.camera);
    let shots = render(job, plan, &hung, draws(customer.seed), progress)?;
    Ok((customer, shots))
}

/// Customer number `index` at one of the cameras: the same lamps and assemblies at all, but each camera hangs as it does.
fn customer(model: &Model, station: &Station, index: u64, camera: u64) -> Customer {
    let first = verify::customer(model, station, index);
    if camera == 0 {
        return first;
    }
    let own = verify::customer(model, station, index + CAMERAS_APART * camera);
    Customer { installation: own.installation, vignetting: own.vignetting, camera, ..first }
}

/// From what each camera judged of all customers to what all cameras judged of each.
fn together(cameras: Vec<HeldOut>) -> Vec<Together> {
    let customers = cameras.first().map_or(0, |held_out| held_out.fit.len());
    let mut each: Vec<_> = cameras.into_iter().map(|h| (h.fit, h.judged.into_iter())).collect();
    let of = |customer: usize| -> Together {
        let all: Vec<Option<Judged>> =
            each.iter_mut().map(|(fit, judged)| fit[customer].then(|| judged.next()).flatten()).collect();
        all.into_iter().collect()
    };
    (0..customers).map(of).collect()
}

impl Trials<'_> {
    /// Every good assembly as all cameras saw it.
    fn goods(&self) -> Vec<Vec<&Verdict>> {
        self.each(|judged| &judged.good)
    }

    /// Every assembly of a scene as all cameras saw it.
    fn faulty(&self, scene: usize) -> Vec<Vec<&Verdict>> {
        self.each(|judged| &judged.faulty[scene])
    }

    fn each(&self, pick: impl Fn(&Judged) -> &Vec<Verdict>) -> Vec<Vec<&Verdict>> {
        let mut all = Vec::new();
        for judged in self.customers.iter().flatten() {
            let count = judged.iter().map(|j| pick(j).len()).min().unwrap_or(0);
            all.extend((0..count).map(|i| judged.iter().map(|j| &pick(j)[i]).collect()));
        }
        all
    }

    fn is(&self, mode: usize, component: &str, fault: &str) -> bool {
        let mode = &self.modes[mode];
        self.design.components[mode.component].name == component && mode.kind.word() == fault
    }

    /// The assemblies with one fault among those of `scenes`.
    fn with(&self, scenes: &[Vec<usize>], component: &str, fault: &str) -> Vec<Vec<&Verdict>> {
        let shown = (0..scenes.len()).filter(|&s| scenes[s].iter().any(|&m| self.is(m, component, fault)));
        shown.flat_map(|scene| self.faulty(scene)).collect()
    }
}

/// Weights, thresholds and promise around the models.
fn assembled(job: &Job, models: Vec<Model>, trials: &Trials) -> Rig {
    let names = job.design.components.iter().map(|c| c.name.clone());
    let mut components: Vec<Component> =
        names.map(|name| Component { modes: modes(&name, &models, trials), name, ..Component::default() }).collect();
    components.retain(|c| !c.modes.is_empty());
    let mut rig = Rig {
        format: FORMAT,
        rig: job.station.place_name().to_string(),
        writer: format!("gonogo {}", env!("CARGO_PKG_VERSION")),
        assembly: job.design.name.clone(),
        spec: job.spec.clone(),
        seed: job.design.train.seed,
        promise: Promise {
            false_reject_asked: job.design.inspect.false_reject,
            false_reject: rate(0, 0),
            escape: rate(0, 0),
            modes: Vec::new(),
        },
        components,
        cameras: models,
    };
    set_thresholds(&mut rig, trials);
    rig.promise = promise(&rig, trials);
    rig
}

/// The ways in which a component may be faulty that any camera can tell.
fn modes(component: &str, models: &[Model], trials: &Trials) -> Vec<Mode> {
    let nodes = models.iter().flat_map(|m| &m.nodes).filter(|n| n.name == component);
    let faults: BTreeSet<String> = nodes.flat_map(|n| &n.hypotheses[1..]).map(|h| h.fault.clone()).collect();
    let mode = |fault: String| {
        let by = |(camera, model): (usize, &Model)| {
            let (index, members) = hypotheses(model, component, &fault);
            let least = |views: &Vec<&Verdict>| -> Option<f64> {
                let node = views[camera].nodes.get(index)?;
                members.iter().map(|&h| node.against[h]).reduce(f64::min)
            };
            let mut good: Vec<f64> = trials.goods().iter().filter_map(least).collect();
            let shown = trials.with(&trials.seen[camera], component, &fault);
            let mut faulty: Vec<f64> = shown.iter().filter_map(least).collect();
            good.sort_by(f64::total_cmp);
            faulty.sort_by(f64::total_cmp);
            discriminant(&good, most_shown(&faulty)).map(|[weight, offset, power]| Seen {
                camera: camera as u32,
                weight,
                offset,
                power,
            })
        };
        Mode { threshold: 0.0, seen: models.iter().enumerate().filter_map(by).collect(), fault }
    };
    faults.into_iter().map(mode).filter(|mode| !mode.seen.is_empty()).collect()
}

/// Weight, offset and power of one camera's log-likelihood ratios, ascending. The weight is the difference of good and faulty
/// over the variance of the good (Fisher 1936), the offset what decides in one camera alone: the sign, or the middle where
/// the good lie below it.
fn discriminant(good: &[f64], faulty: &[f64]) -> Option<[f64; 3]> {
    if good.is_empty() || faulty.is_empty() {
        return None;
    }
    let (middle, other) = (at_share(good, 0.5), at_share(faulty, 0.5));
    let apart = middle - other;
    let mut distances: Vec<f64> = good.iter().map(|g| (g - middle).abs()).collect();
    distances.sort_by(f64::total_cmp);
    let deviation = (at_share(&distances, 0.5) / MEDIAN_DISTANCE).max(apart / SUREST);
    let (lowest, highest) = (at_share(good, TRIM), at_share(faulty, 1.0 - TRIM));
    let offset = match lowest > highest {
        true if lowest > 0.0 => 0.0,
        true => (lowest + highest) / 2.0,
        false => ((middle + other) / 2.0).min(0.0),
    };
    let weight = apart / (deviation * deviation);
    (apart > 0.0 && weight.is_finite()).then(|| [weight, offset, weight * apart].map(rounded))
}

/// Thresholds of the sums, and the joint scores of the held-out renders.
fn set_thresholds(rig: &mut Rig, trials: &Trials) {
    let sorted = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values
    };
    let share = trials.design.inspect.false_reject / rig.components.len().max(1) as f64;
    let cameras = std::mem::take(&mut rig.cameras);
    for component in &mut rig.components {
        let allowed = share / component.modes.len() as f64;
        let name = component.name.clone();
        for mode in &mut component.modes {
            let sum = |views: &Vec<&Verdict>| joint::sum(mode, &name, &cameras, views);
            let good = sorted(trials.goods().iter().filter_map(sum).collect());
            let faulty = sorted(trials.with(trials.scenes, &name, &mode.fault).iter().filter_map(sum).collect());
            mode.threshold = rounded(thresholds::threshold(&good, &faulty, allowed, 1.0));
        }
        let score = |views: &Vec<&Verdict>| rounded(joint::score(component, &cameras, views));
        let faulty = component.modes.iter().flat_map(|mode| trials.with(trials.scenes, &name, &mode.fault));
        let scores = (trials.goods().iter().map(score).collect(), faulty.map(|views| score(&views)).collect());
        (component.good_scores, component.fault_scores) = (sorted(scores.0), sorted(scores.1));
    }
    rig.cameras = cameras;
}

/// Both rates of the joint verdict; a customer of whom one camera could not be calibrated counts as a false reject.
fn promise(rig: &Rig, trials: &Trials) -> Promise {
    let is_faulty = |score: &f64| score.is_nan() || *score < 0.0;
    let unfit = trials.customers.iter().filter(|c| c.is_none()).count() as u32;
    let (mut goods, mut rejects) = (unfit, unfit);
    for views in trials.goods() {
        let (scores, unsure) = joint::decide(rig, &views);
        goods += 1;
        rejects += u32::from(unsure || scores.iter().any(is_faulty));
    }
    let (mut escapes, mut all, mut rates) = (0, 0, Vec::new());
    for (scene, shown) in trials.scenes.iter().enumerate() {
        let verdicts: Vec<_> = trials.faulty(scene).iter().map(|views| joint::decide(rig, views)).collect();
        for &m in shown {
            let component = &trials.design.components[trials.modes[m].component].name;
            let at = rig.components.iter().position(|c| c.name == *component);
            // What cannot be judged is not passed: it does not escape.
            let passes = |(scores, unsure): &&(Vec<f64>, bool)| !unsure && !at.is_some_and(|i| is_faulty(&scores[i]));
            let (escaped, count) = (verdicts.iter().filter(passes).count() as u32, verdicts.len() as u32);
            escapes += escaped;
            all += count;
            let escape = rate(escaped, count);
            rates.push(ModeRate { component: component.clone(), fault: trials.modes[m].said().into(), escape });
        }
    }
    Promise {
        false_reject_asked: trials.design.inspect.false_reject,
        false_reject: rate(rejects, goods),
        escape: rate(escapes, all),
        modes: rates,
    }
}
