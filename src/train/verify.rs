//! Both error rates, measured with the whole detector on renders it was not trained on.
//!
//! In: a trained model, fresh shots. Out: thresholds, scores and the promise that the model file makes. The station is
//! imagined installed with an error, lit by lamps of other powers, and calibrated with one photo, as a customer would.

use super::edges;
use super::exposing::Exposing;
use super::plan::Plan;
use super::shots::Shot;
use super::stats::{rate, rounded};
use super::synthesise::{FaultyShot, Shots};
use super::thresholds;
use crate::assembly::fault::{ErrorMode, Motion};
use crate::design::model::{Design, Station};
use crate::rng::Stream;
use crate::runtime::calibrate;
use crate::runtime::camera::let_through;
use crate::runtime::grid::Grid;
use crate::runtime::inspect::{self, Decision, Inspector, Verdict};
use crate::runtime::light::{range, within};
use crate::runtime::model::{Lamp, ModeRate, Model, Promise, Usual};
use crate::runtime::photo::Photo;
use crate::runtime::pose::{Installation, Pose};
use crate::runtime::rise::{self, Lift};
use crate::runtime::strange::{self, Unlikeness};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Lamps of a customer's station give between these shares of the described power.
const LAMP_POWERS: [f64; 2] = [0.3, 1.7];
/// Grey value (share of full scale) that bright matt surfaces reach in a well exposed photo: least and most.
const EXPOSURES: [f64; 2] = [0.35, 0.75];
/// Share of a photo's pixels that are darker than those that the exposure goes by.
const EXPOSED_QUANTILE: f64 = 0.95;
/// Share of the held-out goods' lowest locator score below which an assembly counts as not found.
const ACCEPT_SHARE: f64 = 0.5;

/// Share of the held-out calibrations' lowest correlation below which a photo is refused.
const POOREST_FIT: f64 = 0.4;

/// An error mode is not told apart if, of its faulty renders, the half that shows most scores lower than good ones in fewer pairs
/// than this: that of two normal distributions one standard deviation apart. Only half, because a sweep begins with sizes that
/// nobody could tell.
const LEAST_POWER: f64 = 0.93;

/// A station as some customer might have it.
#[derive(Clone)]
pub struct Customer {
    pub installation: Installation,
    /// Before he exposes his camera.
    pub powers: Vec<f64>,
    /// Grey value (share of full scale) that bright matt surfaces reach in his photos.
    pub exposure: f64,
    pub noise: f64,
    pub seed: u64,
    /// Share of light that his lens loses in the corners.
    pub vignetting: f64,
    /// Electrons at full scale.
    pub full_well: f64,
    /// The largest grey value.
    pub deepest: f64,
    pub(super) exposing: Exposing,
    /// Number of the camera where the station has several: it scatters on its own.
    pub camera: u64,
}

/// Customer number `index`.
pub fn customer(model: &Model, station: &Station, index: u64) -> Customer {
    let spec = &station.camera;
    let mut stream = Stream::new(model.seed, "customer", index);
    let install = &model.station.install;
    let mut within = |half: f64| stream.between(-half, half);
    let offset = [(); 3].map(|()| within(install.position_mm));
    let turn = [(); 3].map(|()| within(install.angle_rad));
    let focal = within(install.focal_share);
    let k1 = within((install.k1[1] - install.k1[0]) / 2.0);
    let exposure = stream.between(EXPOSURES[0], EXPOSURES[1]);
    let powers = model.station.lamps.iter().map(|l| l.power * stream.between(LAMP_POWERS[0], LAMP_POWERS[1]));
    let powers = powers.collect();
    let installation = Installation { offset, turn, focal, k1 };
    Customer {
        installation,
        powers,
        exposure,
        noise: model.station.noise.max(0.002),
        seed: stream.bits(),
        vignetting: spec.vignetting.at(Stream::new(model.seed, "lens", index).uniform()),
        full_well: spec.full_well,
        deepest: f64::from((1_u32 << spec.depth.min(16)) - 1),
        exposing: Exposing::new(station),
        camera: 0,
    }
}

impl Customer {
    /// Sets his camera's exposure by a shot of an assembly.
    fn expose(&self, shot: &Shot) -> Customer {
        let bright = edges::quantile(&shot.lit(&self.powers), |_| true, EXPOSED_QUANTILE).max(f32::MIN_POSITIVE);
        let gain = self.exposure / f64::from(bright);
        Customer { powers: self.powers.iter().map(|p| p * gain).collect(), ..self.clone() }
    }
}

/// A photo: lamps drift, the lens dims the corners, the sensor adds its noise, clips and rounds. Where the light is open the
/// camera exposes by itself.
pub fn photo(model: &Model, customer: &Customer, lamps: &[Grid], base: u32, index: u64) -> Photo {
    let mut stream = Stream::new(customer.seed, "photo", index);
    let open = inspect::light(model, &customer.powers).is_open();
    let exposing = &customer.exposing;
    let factor = exposing.factor(customer.seed, index);
    let mut drifted = |(&power, lamp): (&f64, &Lamp)| {
        let (u, drift) = (stream.uniform(), exposing.drift_of(lamp));
        if open { within(&range(power, drift), u) } else { (power * factor * (1.0 + drift * (2.0 * u - 1.0))).max(0.0) }
    };
    let weights: Vec<f64> = customer.powers.iter().zip(&model.station.lamps).map(&mut drifted).collect();
    let mut light = Grid::filled(lamps[0].width, lamps[0].height, 0.0);
    for (lamp, &weight) in lamps.iter().zip(&weights) {
        light.values.iter_mut().zip(&lamp.values).for_each(|(s, v)| *s += v * weight as f32);
    }
    if open {
        let bright = edges::quantile(&light, |_| true, EXPOSED_QUANTILE).max(f32::MIN_POSITIVE);
        let usual = stream.between(EXPOSURES[0], EXPOSURES[1]);
        let exposed_to = exposing.metered((EXPOSURES[0] + EXPOSURES[1]) / 2.0, factor).unwrap_or(usual);
        let gain = exposed_to as f32 / bright;
        light.values.iter_mut().for_each(|v| *v *= gain);
    }
    let size = model.station.camera.size;
    let mut full = light.magnified(base as usize, size.map(|s| s as usize));
    let width = full.width;
    if customer.camera > 0 {
        stream = Stream::new(customer.seed, &format!("sensor {}", customer.camera), index);
    }
    for (i, value) in full.values.iter_mut().enumerate() {
        let mut v = f64::from(*value).max(0.0);
        if customer.vignetting > 0.0 {
            v *= let_through(customer.vignetting, size, [(i % width) as f64 + 0.5, (i / width) as f64 + 0.5]);
        }
        // Shot and read noise (EMVA 1288).
        let scatter = (customer.noise * customer.noise + v.min(1.0) / customer.full_well).sqrt();
        let noisy = (v + scatter * stream.normal()).clamp(0.0, 1.0);
        *value = ((noisy * customer.deepest).round() / customer.deepest) as f32;
    }
    Photo::from_light(full)
}

/// One customer's photos, judged.
#[derive(Serialize, Deserialize)]
pub(super) struct Judged {
    /// How well the calibration photo was re-synthesised.
    correlation: f64,
    /// Per node how unlike its rendered good state it was in the calibration photo.
    calibrated: Vec<Option<Unlikeness>>,
    pub good: Vec<Verdict>,
    /// Per scene, per draw.
    pub faulty: Vec<Vec<Verdict>>,
}

/// What the held-out shots of all customers were taken for.
#[derive(Serialize, Deserialize)]
pub struct HeldOut {
    pub(super) judged: Vec<Judged>,
    /// Customers whose calibration photo was refused.
    unfit: usize,
    /// Per customer, whether it was not.
    pub(super) fit: Vec<bool>,
}

/// Judges the held-out shots of each customer, without thresholds yet. The first good shot of each customer calibrates.
/// Takes from the model what cannot be told by it.
pub fn judge_all(
    model: &mut Model,
    design: &Design,
    plan: &Plan,
    modes: &[ErrorMode],
    held_out: &[(Customer, Shots)],
) -> HeldOut {
    let all = |model: &Model| -> (Vec<bool>, Vec<Judged>) {
        let each: Vec<Option<Judged>> = held_out.par_iter().map(|(c, shots)| judge(model, plan, c, shots)).collect();
        (each.iter().map(Option::is_some).collect(), each.into_iter().flatten().collect())
    };
    let (mut fit, mut judged) = all(model);
    if forget_blind(model, design, plan, modes, &judged) {
        (fit, judged) = all(model);
    }
    let unfit = held_out.len() - judged.len();
    HeldOut { judged, unfit, fit }
}

/// Writes thresholds and promise into the model.
pub fn settle(model: &mut Model, design: &Design, scenes: &[Vec<usize>], modes: &[ErrorMode], held_out: &HeldOut) {
    let HeldOut { judged, unfit, .. } = held_out;
    model.promise.false_reject_asked = design.inspect.false_reject;
    set_rises(model, design, scenes, modes, judged);
    set_thresholds(model, design, scenes, modes, judged);
    set_usual(model, design.inspect.false_reject, judged);
    model.locator.accept = accept(judged, model.locator.unsigned);
    model.station.least_correlation = least_correlation(judged);
    model.promise = promise(model, design, scenes, modes, judged, *unfit);
}

/// `None` when the calibration photo does not do.
pub(super) fn judge(model: &Model, plan: &Plan, customer: &Customer, shots: &Shots) -> Option<Judged> {
    let (first, rest) = shots.good.split_first()?;
    let customer = customer.expose(first);
    let take = |lamps: &[Grid], index: u64| photo(model, &customer, lamps, plan.base, index);
    let calibration = calibrate::fit_for(model, String::new(), &[take(&first.lamps, 0)]).ok()?;
    let inspector = Inspector::new(model, &calibration)?;
    let good = rest.par_iter().enumerate().map(|(i, s)| inspector.inspect(&take(&s.lamps, 1 + i as u64))).collect();
    let scene = |(scene, taken): (usize, &Vec<FaultyShot>)| {
        let index = |i: usize| ((scene as u64 + 1) << 20) + i as u64;
        taken.par_iter().enumerate().map(|(i, f)| inspector.inspect(&take(&f.shot.lamps, index(i)))).collect()
    };
    Some(Judged {
        correlation: calibration.correlation,
        calibrated: inspector.calibrated().to_vec(),
        good,
        faulty: shots.faulty.iter().enumerate().map(scene).collect(),
    })
}

/// Takes from the nodes the error modes that they cannot tell from the good state: against such a mode the likelihood
/// ratio is a coin's toss, which would only drown the modes that show. True when any was taken; the promise counts them as
/// escapes all the same.
fn forget_blind(model: &mut Model, design: &Design, plan: &Plan, modes: &[ErrorMode], judged: &[Judged]) -> bool {
    let mut any = false;
    for (index, node) in model.nodes.iter_mut().enumerate() {
        let power = |kind: &str| -> f64 {
            let member: Vec<usize> = (1..node.hypotheses.len()).filter(|&h| node.hypotheses[h].fault == kind).collect();
            let of = |v: &Verdict| {
                let against = &v.nodes.get(index)?.against;
                member.iter().map(|&h| against[h]).reduce(f64::min)
            };
            let good: Vec<f64> = judged.iter().flat_map(|j| &j.good).filter_map(of).collect();
            let own =
                |m: &usize| design.components[modes[*m].component].name == node.name && modes[*m].kind.word() == kind;
            let scenes = judged.iter().flat_map(|j| j.faulty.iter().zip(&plan.scenes));
            let shown = scenes.filter(|(_, scene)| scene.iter().any(own));
            let mut faulty: Vec<f64> = shown.flat_map(|(verdicts, _)| verdicts).filter_map(of).collect();
            faulty.sort_by(f64::total_cmp);
            order(&good, thresholds::most_shown(&faulty))
        };
        let powers: Vec<f64> =
            node.hypotheses.iter().enumerate().map(|(h, hyp)| if h == 0 { 1.0 } else { power(&hyp.fault) }).collect();
        // A node keeps its surest mode, however weak.
        let surest = powers[1..].iter().copied().fold(0.0, f64::max);
        let mut keep = powers.iter().map(|&p| p >= LEAST_POWER.min(surest));
        let before = node.hypotheses.len();
        node.hypotheses.retain(|_| keep.next().unwrap_or(true));
        any |= node.hypotheses.len() < before;
    }
    any
}

/// Share of pairs in which the good one scores higher (the area under the receiver's curve); 1 where there is no pair.
fn order(good: &[f64], fault: &[f64]) -> f64 {
    let pairs = (good.len() * fault.len()) as f64;
    let higher = good.iter().flat_map(|g| fault.iter().map(move |f| g > f)).filter(|h| *h).count() as f64;
    if pairs > 0.0 { higher / pairs } else { 1.0 }
}

/// Thresholds of every node's error modes, and its scores on goods and on its own faults.
fn set_thresholds(model: &mut Model, design: &Design, scenes: &[Vec<usize>], modes: &[ErrorMode], judged: &[Judged]) {
    let nodes = model.nodes.len() as f64;
    for (index, node) in model.nodes.iter_mut().enumerate() {
        let against = |verdict: &Verdict| verdict.nodes.get(index).map(|n| rise::weighed(node, &n.against, n.lift));
        let of = |kind: &str| {
            let own =
                |m: &usize| design.components[modes[*m].component].name == node.name && modes[*m].kind.word() == kind;
            let faulty = judged.iter().flat_map(|j| j.faulty.iter().zip(scenes));
            let shown = faulty.filter(|(_, scene)| scene.iter().any(own));
            shown.flat_map(|(verdicts, _)| verdicts).filter_map(against).collect()
        };
        let good = judged.iter().flat_map(|j| &j.good).filter_map(against).collect();
        // A mode that the node gave up is none of its hypotheses and has no say.
        let kinds: BTreeSet<String> = node.hypotheses[1..].iter().map(|h| h.fault.clone()).collect();
        let faulty = kinds.into_iter().map(|kind| (kind.clone(), of(&kind))).collect();
        thresholds::set(node, &thresholds::Seen { good, faulty }, design.inspect.false_reject / nodes);
    }
}

/// What the nodes of correct assemblies show of what their model does not know.
fn set_usual(model: &mut Model, false_reject: f64, judged: &[Judged]) {
    let mut photos: Vec<(Vec<Unlikeness>, &[Option<Unlikeness>])> = Vec::new();
    for j in judged {
        for verdict in j.good.iter().filter(|v| v.nodes.len() == model.nodes.len()) {
            photos.push((verdict.nodes.iter().map(|n| n.unlike.clone()).collect(), &j.calibrated));
        }
    }
    for (node, usual) in model.nodes.iter_mut().zip(strange::usual(&photos, false_reject)) {
        node.usual = usual.into_iter().map(|of| Usual { excess: of.excess.map(rounded), ..of }).collect();
    }
}

/// How high the components appear to stand, seated and not.
fn set_rises(model: &mut Model, design: &Design, scenes: &[Vec<usize>], modes: &[ErrorMode], judged: &[Judged]) {
    let (camera, home) = (model.station.camera, Pose::home(&model.station));
    for (index, node) in model.nodes.iter_mut().enumerate() {
        let Some(along) = node.rise.as_ref().and_then(|rise| rise.seen(&camera, &home)) else { continue };
        let lift = |verdict: &Verdict| verdict.nodes.get(index)?.lift;
        let good: Vec<Lift> = judged.iter().flat_map(|j| &j.good).filter_map(lift).collect();
        let own = |m: &usize| {
            design.components[modes[*m].component].name == node.name && matches!(modes[*m].motion, Motion::Slide { .. })
        };
        let scenes = judged.iter().flat_map(|j| j.faulty.iter().zip(scenes));
        let shown = scenes.filter(|(_, scene)| scene.iter().any(own));
        let faulty: Vec<Lift> = shown.flat_map(|(verdicts, _)| verdicts).filter_map(lift).collect();
        if let Some(rise) = node.rise.as_mut() {
            rise.shown = thresholds::shown(&good, &faulty, along[0].hypot(along[1]));
        }
    }
}

/// Renders are re-synthesised by what rendered them, photos are not: a photo may fall this far behind. What correlates less
/// than [`POOREST_FIT`] of a fit that renders reach shows something else.
fn least_correlation(judged: &[Judged]) -> f64 {
    let lowest = judged.iter().map(|j| j.correlation).fold(f64::INFINITY, f64::min);
    if lowest.is_finite() { rounded((lowest * POOREST_FIT).max(0.0)) } else { 0.0 }
}

/// A share of the lowest score that a held-out photo got: a good one, or any where faults take edges from the locator.
fn accept(judged: &[Judged], unsigned: bool) -> f64 {
    let good = judged.iter().flat_map(|j| &j.good);
    let faulty = judged.iter().flat_map(|j| j.faulty.iter().flatten()).filter(|_| unsigned);
    let lowest = good.chain(faulty).map(|v| v.locator_score).fold(f64::INFINITY, f64::min);
    if lowest.is_finite() { rounded((lowest * ACCEPT_SHARE).max(0.0)) } else { 0.0 }
}

/// Both rates, by the model's thresholds; a customer who could not calibrate counts as a false reject.
pub(super) fn promise(
    model: &Model,
    design: &Design,
    scenes: &[Vec<usize>],
    modes: &[ErrorMode],
    judged: &[Judged],
    unfit: usize,
) -> Promise {
    // The verdicts were taken before the thresholds were known.
    let faulty = |v: &Verdict, node: usize| {
        let (of, seen) = (&model.nodes[node], &v.nodes[node]);
        inspect::score(of, &rise::weighed(of, &seen.against, seen.lift)).1 < 0.0
    };
    let beside = |j: &Judged, v: &Verdict| {
        let mut nodes = v.nodes.clone();
        strange::weigh(&mut nodes, &model.nodes, &j.calibrated);
        inspect::beside(model, &nodes).map(|(node, _)| node)
    };
    // Neither does a photo that cannot be judged pass.
    let unsure = |v: &Verdict| v.decision == Decision::CannotInspect;
    let rejected =
        |(j, v): &(&Judged, &Verdict)| unsure(v) || (0..v.nodes.len()).any(|n| faulty(v, n)) || beside(j, v).is_some();
    let goods: Vec<(&Judged, &Verdict)> = judged.iter().flat_map(|j| j.good.iter().map(move |v| (j, v))).collect();
    let false_rejects = goods.iter().filter(|of| rejected(of)).count() + unfit;
    let mut rates = Vec::new();
    let (mut escapes, mut trials) = (0, 0);
    for (scene, shown) in scenes.iter().enumerate() {
        for &m in shown {
            let component = &design.components[modes[m].component].name;
            let Some(node) = model.nodes.iter().position(|n| &n.name == component) else { continue };
            let verdicts: Vec<(&Judged, &Verdict)> =
                judged.iter().flat_map(|j| j.faulty[scene].iter().map(move |v| (j, v))).collect();
            // A photo in which the assembly is not found is not passed: it does not escape.
            let passed = |(j, v): &&(&Judged, &Verdict)| !unsure(v) && !faulty(v, node) && beside(j, v) != Some(node);
            let escaped = verdicts.iter().filter(passed).count() as u32;
            escapes += escaped;
            trials += verdicts.len() as u32;
            let escape = rate(escaped, verdicts.len() as u32);
            rates.push(ModeRate { component: component.clone(), fault: modes[m].said().into(), escape });
        }
    }
    Promise {
        false_reject_asked: design.inspect.false_reject,
        false_reject: rate(false_rejects as u32, (goods.len() + unfit) as u32),
        escape: rate(escapes, trials),
        modes: rates,
    }
}
