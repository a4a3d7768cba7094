//! `gonogo golden`: the outputs of the stages against blessed ones.

use super::args::{Global, GoldenArgs};
use super::compile::{self, Document};
use super::output::{self, Failure};
use super::{Exit, messages};
use crate::artifacts::{self, Artifact};
use crate::golden::{self, LARGEST};
use crate::{Compiled, Options};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Compares. What differs is kept, named and told apart from what is missing.
pub fn check(args: &GoldenArgs, global: &Global) -> Result<Exit, Failure> {
    let mut exit = Exit::Fine;
    for spec in &args.specs {
        let Some(actual) = outputs(spec, args, global)? else { return Ok(Exit::Faults) };
        let name = spec.file_stem().unwrap_or_default();
        let (blessed, keep) = (args.dir.join(name), args.keep.join(name));
        for (file, text) in &actual {
            if let Some(complaint) = complaint(&blessed.join(file), text) {
                output::make_dir(&keep)?;
                output::write(&keep.join(file), text.as_bytes())?;
                let (golden, kept) = (blessed.join(file), keep.join(file));
                output::remark(&format!("error: {}: {complaint}", golden.display()));
                output::remark(&format!("  the new output is {}", kept.display()));
                exit = Exit::Faults;
            }
        }
        if exit != Exit::Fine {
            let dir = args.dir.display();
            output::remark(&format!("  to bless it: gonogo golden bless {} --dir {dir}", spec.display()));
        }
    }
    Ok(exit)
}

/// Rewrites the blessed outputs.
pub fn bless(args: &GoldenArgs, global: &Global) -> Result<Exit, Failure> {
    if std::env::var_os("CI").is_some_and(|v| !v.is_empty()) {
        return Err(Failure("goldens are not blessed where CI is set: people review them".into()));
    }
    for spec in &args.specs {
        let Some(actual) = outputs(spec, args, global)? else { return Ok(Exit::Faults) };
        let folder = args.dir.join(spec.file_stem().unwrap_or_default());
        output::make_dir(&folder)?;
        for (file, text) in &actual {
            if text.len() > LARGEST {
                return Err(Failure(format!("{file} has {} bytes, more than anybody reviews ({LARGEST})", text.len())));
            }
            output::write(&folder.join(file), text.as_bytes())?;
        }
    }
    Ok(Exit::Fine)
}

/// File name and text of every stage asked for; `None` when the spec does not compile.
fn outputs(spec: &Path, args: &GoldenArgs, global: &Global) -> Result<Option<BTreeMap<String, String>>, Failure> {
    let document = Document::read(spec)?;
    let options = Options { wanted: args.stages.iter().copied().collect(), ..Options::default() };
    let compiled = args.jobs.run(|| compile::run(&document, &options, global))?;
    if compiled.diagnostics.iter().any(|d| d.is_error()) {
        messages::print(&compiled.diagnostics, &compiled.sources, global)?;
        return Ok(None);
    }
    Ok(Some(texts(&compiled)))
}

/// The RON of every stage; pictures and data for other programs say the same in another form.
fn texts(compiled: &Compiled) -> BTreeMap<String, String> {
    let text = |bytes: &Vec<u8>| String::from_utf8(bytes.clone()).ok();
    let reviewed = compiled.artifacts.iter().filter(|(name, _)| name.ends_with(".ron"));
    let artifacts = reviewed.filter_map(|(name, bytes)| Some((name.clone(), text(bytes)?)));
    let model = compiled.model.iter().map(|m| (Artifact::Model.file(), artifacts::model_summary(m)));
    artifacts.chain(model).collect()
}

fn complaint(golden: &Path, actual: &str) -> Option<String> {
    match fs::read_to_string(golden) {
        Ok(expected) => golden::first_difference(&expected, actual).map(|d| d.to_string()),
        Err(e) => Some(format!("no blessed output to compare with ({e})")),
    }
}
