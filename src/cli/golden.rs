//! `gonogo golden`: the outputs of the stages against blessed ones.
//!
//! In: specs, and a folder with a folder of goldens for each. Out: what differs, what is missing and what is not made any
//! more; with `bless`, new goldens. What counts as different is decided in [`crate::golden`].

mod case;
mod change;
mod json;
mod tell;

use self::case::{Verdict, cases, stage_of};
use self::change::{Change, Tally};
use self::json::Counts;
use self::tell::told;
use super::Exit;
use super::args::{Global, GoldenBless, GoldenCheck, MessageFormat};
use super::output::{self, Failure};
use serde_json::json;
use std::collections::BTreeSet;

/// Compares. What differs is kept, named and told apart from what is missing.
pub fn check(args: &GoldenCheck, global: &Global) -> Result<Exit, Failure> {
    let mut exit = Exit::Fine;
    let mut counts = Counts::default();
    let (mut faulty_specs, mut commands) = (0, Vec::new());
    for case in cases(&args.golden, global)? {
        let Some(case) = case else {
            exit = Exit::Faults;
            faulty_specs += 1;
            continue;
        };
        let verdicts = case.verdicts();
        let keep = (!args.beside).then(|| args.keep.join(&case.name));
        let mut faulty = BTreeSet::new();
        for (file, verdict) in &verdicts {
            if told(&case, file, verdict, &args.golden, keep.as_deref(), global, &mut counts)? {
                faulty.extend(stage_of(file));
            }
        }
        case.tell_strangers(global, &mut counts)?;
        if is_json(global) {
            commands.extend((!faulty.is_empty()).then(|| case.command(&faulty, &args.golden.dir)));
        } else if faulty.is_empty() {
            let agree = if verdicts.len() == 1 {
                "1 golden agrees".into()
            } else {
                format!("{} goldens agree", verdicts.len())
            };
            output::line(&format!("{}: {agree}", case.folder.display()))?;
        } else {
            output::remark(&format!("  to bless what is right: {}", case.command(&faulty, &args.golden.dir)));
        }
        if !faulty.is_empty() {
            exit = Exit::Faults;
        }
    }
    if is_json(global) {
        counts.finish(&[("faulty_specs", json!(faulty_specs)), ("bless", json!(commands))])?;
    }
    Ok(exit)
}

fn is_json(global: &Global) -> bool {
    global.message_format == MessageFormat::Json
}

/// Rewrites the blessed outputs that differ, all of them or none.
pub fn bless(args: &GoldenBless, global: &Global) -> Result<Exit, Failure> {
    if !args.dry_run && std::env::var_os("CI").is_some_and(|v| !v.is_empty()) {
        return Err(Failure("goldens are not blessed where CI is set: people review them".into()));
    }
    let cases = cases(&args.golden, global)?;
    let mut exit = Exit::Fine;
    let (mut changes, mut counts) = (Vec::new(), Counts::default());
    for case in &cases {
        let Some(case) = case else {
            exit = Exit::Faults;
            continue;
        };
        for (file, verdict) in case.verdicts() {
            if let Verdict::Unclear(why) = &verdict {
                output::remark(&format!("error: {}: {why}", case.folder.join(&file).display()));
                exit = Exit::Faults;
            }
            changes.push(Change { path: case.folder.join(&file), file, case, verdict });
        }
        case.tell_strangers(global, &mut counts)?;
    }
    if exit != Exit::Fine {
        output::remark("nothing was blessed");
        return Ok(exit);
    }
    let contents = changes.iter().map(Change::content).collect::<Result<Vec<_>, Failure>>()?;
    let mut tally = Tally::default();
    for (change, content) in changes.iter().zip(contents) {
        if is_json(global) {
            counts.say(&change.said(&mut tally, &args.golden))?;
        } else {
            change.tell(&mut tally, &args.golden, global)?;
        }
        if !args.dry_run {
            change.make(content)?;
        }
    }
    if is_json(global) {
        let Tally { blessed, removed, unchanged } = tally;
        let done = [("blessed", blessed), ("removed", removed), ("unchanged", unchanged)];
        let mut more: Vec<_> = done.map(|(key, count)| (key, json!(count))).into();
        more.push(("dry_run", json!(args.dry_run)));
        counts.finish(&more)?;
    } else {
        output::line(&tally.line(args.dry_run))?;
    }
    Ok(Exit::Fine)
}
