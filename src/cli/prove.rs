//! `gonogo prove`: what a model file promises beside what fresh renders show.

use super::args::{Global, Prove};
use super::compile::{self, Document};
use super::output::{self, Failure};
use super::{Exit, judge, keep};
use crate::Options;
use crate::runtime::model::{Promise, Rate};
use crate::train::prove::{Proof, Trials};
use crate::train::stats::lower_95;

/// Prints promise and proof; exit code 1 if good assemblies are surely rejected more often than the spec allows.
pub fn prove(args: &Prove, global: &Global) -> Result<Exit, Failure> {
    let spec = Document::read(&args.spec)?;
    let model = judge::read_model(&args.model)?;
    let options = Options {
        station: Some(model.station.name.clone()),
        set: args.variant.set.clone(),
        lock: keep::read_lock(&args.spec)?,
        ..Options::default()
    };
    let trials = Trials { goods: args.goods, faults: args.faults, customers: args.customers };
    let work = || {
        compile::watched(&spec, global, |read, observer| {
            crate::prove(&spec.name, read, &options, &model, trials, observer)
        })
    };
    let proven = args.jobs.run(work)?;
    if !compile::report(&proven, &args.variant, global)? {
        return Ok(Exit::Faults);
    }
    let Some(proof) = proven.proof else {
        let (model, spec) = (args.model.display(), &spec.name);
        return Err(Failure(format!("{model} was compiled from another version of {spec}: compile it again")));
    };
    for line in table(&model.promise, &proof) {
        output::line(&line)?;
    }
    Ok(if broken(&proof.rates) { Exit::Faults } else { Exit::Fine })
}

/// Whether more good assemblies are rejected than the spec allows, at 95 % confidence.
fn broken(proof: &Promise) -> bool {
    lower_95(&proof.false_reject) > proof.false_reject_asked
}

fn table(promise: &Promise, Proof { rates: proof, seen_from, blamed }: &Proof) -> Vec<String> {
    let mut lines = vec![
        format!("false rejects: asked {:.2} % at most", 100.0 * proof.false_reject_asked),
        row("", &promise.false_reject, &proof.false_reject),
    ];
    lines.extend(blamed.iter().map(|b| format!("    {:>4} x {}", b.photos, b.reason)));
    lines.extend(["escapes:".into(), row("all error modes", &promise.escape, &proof.escape)]);
    for (i, mode) in proof.modes.iter().enumerate() {
        let name = format!("{} {}", mode.component, mode.fault);
        // Modes stand in the same order in both: the same spec gives the same plan.
        let promised = promise.modes.get(i).filter(|m| m.component == mode.component && m.fault == mode.fault);
        let line = promised.map_or_else(
            || format!("    {name}: {}", compile::rate(&mode.escape)),
            |m| row(&name, &m.escape, &mode.escape),
        );
        let seen = seen_from.get(i).copied().flatten().map(|mm| format!(", 9 in 10 from {mm:.1} mm on"));
        lines.push(line + &seen.unwrap_or_default());
    }
    if broken(proof) {
        lines.push("the promised rate of false rejects is not kept".into());
    }
    lines
}

fn row(name: &str, promised: &Rate, proven: &Rate) -> String {
    let share = |r: &Rate| if r.trials > 0 { 100.0 * f64::from(r.events) / f64::from(r.trials) } else { 0.0 };
    format!(
        "    {name:<34} promised {:>4} of {:<5} ({:>5.1} %)   measured {:>4} of {:<5} ({:>5.1} %, {:.1} .. {:.1} %)",
        promised.events,
        promised.trials,
        share(promised),
        proven.events,
        proven.trials,
        share(proven),
        100.0 * lower_95(proven),
        100.0 * proven.upper_95,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::model::ModeRate;
    use crate::train::prove::Blamed;
    use crate::train::stats::rate;

    fn proof(rejected: u32) -> Promise {
        let escape = rate(0, 10);
        let modes = vec![ModeRate { component: "pin".into(), fault: "not seated".into(), escape }];
        Promise { false_reject_asked: 0.001, false_reject: rate(rejected, 1000), escape, modes }
    }

    #[test]
    fn a_promise_is_broken_only_when_chance_cannot_explain_it() {
        assert!(!broken(&proof(0)) && !broken(&proof(1)) && !broken(&proof(3)));
        assert!(broken(&proof(5)), "five of a thousand at one per mille");
    }

    #[test]
    fn the_table_shows_both_rates_of_every_mode() {
        let blamed = vec![Blamed { reason: "pin missing".into(), photos: 5 }];
        let lines = table(&proof(0), &Proof { rates: proof(5), seen_from: vec![Some(1.26)], blamed });
        assert_eq!(lines[2], "       5 x pin missing");
        assert!(lines[5].contains("pin not seated") && lines[5].ends_with("9 in 10 from 1.3 mm on"), "{lines:?}");
        assert!(lines[1].contains("promised    0 of 1000") && lines[1].contains("measured    5 of 1000"), "{lines:?}");
        assert!(lines.last().is_some_and(|l| l.contains("not kept")));
    }
}
