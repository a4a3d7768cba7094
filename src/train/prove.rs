//! A model's promise held against fresh renders.
//!
//! In: a trained model and the job it was trained for. Out: both error rates, measured like the promise itself but on as
//! many renders as asked for, none of which the model has seen. Changes nothing in the model and never reads a photo.

use super::plan::{self, Plan};
use super::stats::{lower_95, rate};
use super::synthesise::{Draws, Shots};
use super::verify::Judged;
use super::{Job, Observer, Step, render, shots, verify};
use crate::assembly::fault::{Motion, swept};
use crate::diag::Diagnostic;
use crate::runtime::inspect::{Decision, Verdict};
use crate::runtime::model::{Model, Promise};
use std::collections::{BTreeMap, BTreeSet};

/// How much to render.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trials {
    /// Good assemblies in all.
    pub goods: u32,
    /// Assemblies with each error mode.
    pub faults: u32,
    /// Stations among which they are shared, each installed with an error of its own and calibrated with one photo.
    pub customers: u32,
}

/// What fresh renders showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Proof {
    /// Both rates, by the model's thresholds.
    pub rates: Promise,
    /// Per error mode of the rates, the smallest size (mm) from which on at least nine in ten are found, at 95 % confidence
    /// (a90/95); `None` for modes without a size, and where no size is found so surely.
    pub seen_from: Vec<Option<f64>>,
    /// Why good assemblies were not passed, most frequent first. A photo may have several reasons.
    pub blamed: Vec<Blamed>,
}

/// Good assemblies that were not passed for one reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Blamed {
    /// The component and its fault, or why a photo could not be inspected.
    pub reason: String,
    pub photos: u32,
}

/// Share of faults of a size and larger that must be found for the size to count as seen.
const SEEN: f64 = 0.9;

/// Customers from this number on are imagined for proofs alone; those below belong to training.
const FIRST_CUSTOMER: u64 = 1_000;

/// Measures both error rates. The thresholds are the model's.
pub fn prove(job: &Job, model: &Model, trials: Trials, observer: &Observer) -> Result<Proof, Vec<Diagnostic>> {
    observer(Step::Plan, 0, 1);
    let nominal = shots::nominal(job.design, job.station)?;
    let plan = plan::plan(job.design, &job.camera, &nominal, job.liaison, job.modes);
    let customers = trials.customers.max(1);
    // The first good shot of a customer calibrates.
    let goods = trials.goods.div_ceil(customers) + 1;
    let faults = trials.faults.div_ceil(customers).min(goods);
    let (mut judged, mut unfit) = (Vec::new(), 0);
    let mut sizes = Sizes::new(&plan);
    let mut blamed = BTreeMap::new();
    for index in 0..customers {
        let customer = verify::customer(model, job.station, FIRST_CUSTOMER + u64::from(index));
        let camera = customer.installation.apply(&job.camera);
        let draws = Draws { seed: customer.seed, count: goods, faulty: faults };
        let progress = |i: usize, n: usize| observer(Step::HeldOut, index as usize * n + i, customers as usize * n);
        let shots = render(job, &plan, &camera, draws, &progress)?;
        match verify::judge(model, &plan, &customer, &shots) {
            Some(verdicts) => {
                sizes.note(job, &plan, &shots, &verdicts);
                verdicts.good.iter().flat_map(reasons).for_each(|r| *blamed.entry(r).or_insert(0) += 1);
                judged.push(verdicts);
            }
            None => {
                unfit += 1;
                *blamed.entry("the calibration photo was refused".into()).or_insert(0) += 1;
            }
        }
    }
    observer(Step::Verify, 0, 1);
    let rates = verify::promise(model, job.design, &plan.scenes, job.modes, &judged, unfit);
    // The rates have a row for every mode whose component has a node.
    let name = |m: &usize| &job.design.components[job.modes[*m].component].name;
    let has_node = |m: &usize| model.nodes.iter().any(|n| n.name == *name(m));
    let rows = plan.scenes.iter().flatten().zip(sizes.0).filter(|(m, _)| has_node(m));
    let mut blamed: Vec<Blamed> = blamed.into_iter().map(|(reason, photos)| Blamed { reason, photos }).collect();
    blamed.sort_by_key(|b| std::cmp::Reverse(b.photos));
    Ok(Proof { rates, seen_from: rows.map(|(_, trials)| seen_from(trials)).collect(), blamed })
}

/// Why a photo was not passed.
fn reasons(verdict: &Verdict) -> BTreeSet<String> {
    match verdict.decision {
        Decision::Go => BTreeSet::new(),
        Decision::NoGo => verdict.findings.iter().map(|f| format!("{} {}", f.component, f.fault)).collect(),
        Decision::CannotInspect => [verdict.reason.clone()].into(),
    }
}

/// Per mode of every scene, in the order of the rates: the sizes rendered (mm) and whether the component was blamed.
struct Sizes(Vec<Vec<(f64, bool)>>);

impl Sizes {
    fn new(plan: &Plan) -> Sizes {
        Sizes(plan.scenes.iter().flatten().map(|_| Vec::new()).collect())
    }

    fn note(&mut self, job: &Job, plan: &Plan, shots: &Shots, verdicts: &Judged) {
        let mut row = self.0.iter_mut();
        for (scene, shown) in plan.scenes.iter().enumerate() {
            for (k, &m) in shown.iter().enumerate() {
                let Some(row) = row.next() else { return };
                let Motion::Slide { from, to, .. } = job.modes[m].motion else { continue };
                let component = &job.design.components[job.modes[m].component].name;
                for (taken, verdict) in shots.faulty[scene].iter().zip(&verdicts.faulty[scene]) {
                    let blamed = verdict.nodes.iter().any(|n| n.faulty && n.name == *component);
                    row.push((swept(from, to, taken.places[k]), blamed));
                }
            }
        }
    }
}

/// The smallest size from which on faults are found as surely as [`Proof::seen_from`] says.
fn seen_from(mut trials: Vec<(f64, bool)>) -> Option<f64> {
    trials.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut found, mut smallest) = (0, None);
    for (count, (size, blamed)) in (1..).zip(trials) {
        found += u32::from(blamed);
        if lower_95(&rate(found, count)) >= SEEN {
            smallest = Some(size);
        }
    }
    smallest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 100 faults from 0.04 to 4 mm, all from 1.5 mm on are found: 63 of 63. Smaller ones only dilute that: 63 of 65 still
    /// have a lower bound above 0.89, below 0.9.
    #[test]
    fn the_size_seen_is_where_finding_begins_to_be_sure() {
        let trials =
            |found_from: f64| (1..=100).map(|i| (0.04 * f64::from(i), 0.04 * f64::from(i) >= found_from)).collect();
        let seen = seen_from(trials(1.5)).expect("large ones are found");
        assert!((1.4..=1.52).contains(&seen), "{seen}");
        assert_eq!(seen_from(trials(3.5)), None, "too few to be sure of");
        assert_eq!(seen_from(Vec::new()), None);
    }
}
