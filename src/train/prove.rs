//! A model's promise held against fresh renders.
//!
//! In: a trained model and the job it was trained for. Out: both error rates, measured like the promise itself but on as
//! many renders as asked for, none of which the model has seen. Changes nothing in the model and never reads a photo.

use super::plan;
use super::synthesise::Draws;
use super::{Job, Observer, Step, render, shots, verify};
use crate::diag::Diagnostic;
use crate::runtime::model::{Model, Promise};

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

/// Customers from this number on are imagined for proofs alone; those below belong to training.
const FIRST_CUSTOMER: u64 = 1_000;

/// Measures both error rates. The thresholds are the model's.
pub fn prove(job: &Job, model: &Model, trials: Trials, observer: &Observer) -> Result<Promise, Vec<Diagnostic>> {
    observer(Step::Plan, 0, 1);
    let nominal = shots::nominal(job.design, job.station)?;
    let plan = plan::plan(job.design, &job.camera, &nominal, job.modes);
    let customers = trials.customers.max(1);
    // The first good shot of a customer calibrates.
    let goods = trials.goods.div_ceil(customers) + 1;
    let faults = trials.faults.div_ceil(customers).min(goods);
    let (mut judged, mut unfit) = (Vec::new(), 0);
    for index in 0..customers {
        let customer = verify::customer(model, FIRST_CUSTOMER + u64::from(index));
        let camera = customer.installation.apply(&job.camera);
        let draws = Draws { seed: customer.seed, count: goods, faulty: faults };
        let progress = |i: usize, n: usize| observer(Step::HeldOut, index as usize * n + i, customers as usize * n);
        let shots = render(job, &plan, &camera, draws, &progress)?;
        match verify::judge(model, &plan, &customer, &shots) {
            Some(verdicts) => judged.push(verdicts),
            None => unfit += 1,
        }
    }
    observer(Step::Verify, 0, 1);
    Ok(verify::promise(model, job.design, &plan, job.modes, &judged, unfit))
}
