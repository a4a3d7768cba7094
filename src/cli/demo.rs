//! `gonogo demo`: the whole line on the pattern wheel, from its spec to verdicts on photos taken elsewhere.
//!
//! In: `specs/pattern_wheel.gng` and the photos beside it. Out: a table of verdicts against labels,
//! overlays, and the report.

use super::args::{Demo, Global};
use super::compile::{self, Document};
use super::judge;
use super::output::{self, Failure};
use super::report_page::{self, Judged};
use super::verdict::{Outcome, word};
use super::{Exit, messages};
use crate::artifacts::Artifact;
use crate::diag::Diagnostic;
use crate::runtime::calibrate;
use crate::runtime::inspect::{Decision, Inspector};
use crate::runtime::model::Model;
use crate::runtime::photo::Photo;
use crate::{Compiled, Options};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

const SPEC: &str = "specs/pattern_wheel.gng";
const STATION: &str = "C";
const PHOTOS: &str = "specs/pattern_wheel/photos";
const CALIBRATION: &str = "C_calibration.png";
const LABELS: &str = "labels.txt";

/// Exit code 0 when every verdict agrees with its label.
pub fn demo(args: &Demo, global: &Global) -> Result<Exit, Failure> {
    let home = home()?;
    output::make_dir(&args.out)?;
    let compiled = compiled(&home.join(SPEC), args, global)?;
    let Some(model) = &compiled.model else { return Ok(Exit::Faults) };
    let photos = home.join(PHOTOS);
    let calibration = calibrated(model, &photos.join(CALIBRATION))?;
    let inspector = judge::inspector(model, &calibration)?;
    keep(args, model, &calibration)?;
    output::line(&format!("\n{:<14} {:<36} {:<15} finding", "photo", "truth", "verdict"))?;
    let labels = labels(&photos.join(LABELS))?;
    let mut mistakes = 0;
    for label in &labels {
        let agrees = judge_one(args, model, &inspector, &photos, label)?;
        mistakes += usize::from(!agrees);
    }
    let total = labels.len();
    output::line(&format!("\n{} of {total} verdicts agree with the labels.", total - mistakes))?;
    let judged: Vec<Judged> =
        labels.iter().map(|l| report_page::judge_one(model, &inspector, &photos.join(&l.photo))).collect();
    let page = report_page::page(SPEC, &compiled, Some(model), Some(&calibration), &judged);
    output::write(&args.out.join("report.html"), page.as_bytes())?;
    output::line(&format!("Model, calibration, overlays and report.html are in {}.", args.out.display()))?;
    Ok(if mistakes == 0 { Exit::Fine } else { Exit::Faults })
}

/// The folder with the spec: the current one, or the one the program was built in.
fn home() -> Result<PathBuf, Failure> {
    let places = [Path::new("."), Path::new(env!("CARGO_MANIFEST_DIR"))];
    let found = places.into_iter().find(|p| p.join(SPEC).is_file());
    found
        .map(Path::to_path_buf)
        .ok_or_else(|| Failure(format!("there is no {SPEC} here: run the demo in a clone of gonogo")))
}

fn compiled(spec: &Path, args: &Demo, global: &Global) -> Result<Compiled, Failure> {
    let document = Document::read(spec)?;
    let wanted = BTreeSet::from([Artifact::Model]);
    let options = Options { station: Some(STATION.into()), wanted, keep: true, ..Options::default() };
    output::line(&format!("compiling {SPEC} for station {STATION} …"))?;
    let start = Instant::now();
    let compiled = args.jobs.run(|| compile::run(&document, &options, global))?;
    let (errors, warnings): (Vec<Diagnostic>, Vec<Diagnostic>) =
        compiled.diagnostics.iter().cloned().partition(Diagnostic::is_error);
    messages::print(&errors, &compiled.sources, global)?;
    if !warnings.is_empty() {
        output::line(&format!("{} warnings, which `gonogo check {SPEC}` shows", warnings.len()))?;
    }
    output::line(&format!("compiled in {:.1} s, without any photo", start.elapsed().as_secs_f64()))?;
    Ok(compiled)
}

fn calibrated(model: &Model, path: &Path) -> Result<calibrate::Calibration, Failure> {
    let station = &model.station;
    let photo = Photo::decode(&output::read(path)?, station.tone, station.camera.size);
    let photo = photo.map_err(|e| Failure(format!("`{}`: {e}", path.display())))?;
    let calibration = calibrate::calibrate(model, &[photo]).map_err(|e| Failure(e.to_string()))?;
    output::line(&format!("calibrated with one photo of a correct assembly ({CALIBRATION})"))?;
    Ok(calibration)
}

fn keep(args: &Demo, model: &Model, calibration: &calibrate::Calibration) -> Result<(), Failure> {
    output::write(&args.out.join("pattern_wheel.C.model.ron"), model.write().as_bytes())?;
    output::write(&args.out.join("pattern_wheel.C.calibration.ron"), calibration.write().as_bytes())
}

/// A photo and what it shows: nothing wrong, or a component and its fault.
struct Label {
    photo: String,
    fault: Option<(String, String)>,
}

/// Lines of `photo: good` or `photo: component, fault`; `#` begins a comment.
fn labels(path: &Path) -> Result<Vec<Label>, Failure> {
    let text = fs::read_to_string(path).map_err(|e| Failure::at(path, "read", &e))?;
    let lines = text.lines().map(|l| l.split('#').next().unwrap_or_default().trim()).filter(|l| !l.is_empty());
    lines
        .map(|line| label(line).ok_or_else(|| Failure(format!("`{}`: `{line}` is no label", path.display()))))
        .collect()
}

fn label(line: &str) -> Option<Label> {
    let (photo, truth) = line.split_once(": ")?;
    let fault = match truth.trim() {
        "good" => None,
        truth => truth.split_once(", ").map(|(c, f)| Some((c.into(), f.into())))?,
    };
    Some(Label { photo: photo.into(), fault })
}

/// Judges a photo, prints its line and writes its overlay; whether the verdict agrees with the label.
fn judge_one(args: &Demo, model: &Model, inspector: &Inspector, photos: &Path, label: &Label) -> Result<bool, Failure> {
    let path = photos.join(&label.photo);
    let (outcome, bytes) = judge::judge(model, inspector, &path);
    if let Some(bytes) = bytes {
        judge::write_overlay(&args.out, &path, &bytes, &outcome)?;
    }
    let agrees = agrees(label, &outcome);
    let truth = label.fault.as_ref().map_or("good".into(), |(component, fault)| format!("{component}: {fault}"));
    let reason = &outcome.verdict.reason;
    let mark = if agrees { "" } else { "   <-- wrong" };
    let decision = word(outcome.verdict.decision);
    output::line(format!("{:<14} {truth:<36} {decision:<15} {reason}{mark}", stem(&label.photo)).trim_end())?;
    Ok(agrees)
}

/// A fault must be found in the right component; how it is called is shown but not counted.
fn agrees(label: &Label, outcome: &Outcome) -> bool {
    let verdict = &outcome.verdict;
    match &label.fault {
        None => verdict.decision == Decision::Go,
        Some((component, _)) => {
            verdict.decision == Decision::NoGo && verdict.findings.iter().any(|f| &f.component == component)
        }
    }
}

fn stem(photo: &str) -> &str {
    photo.rsplit_once('.').map_or(photo, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_good_or_a_component_with_its_fault() {
        assert!(label("a.png: good").is_some_and(|l| l.fault.is_none()));
        let faulty = label("a.png: pin[2], raised 2 mm").unwrap();
        assert_eq!(faulty.fault, Some(("pin[2]".into(), "raised 2 mm".into())));
        assert!(label("a.png").is_none() && label("a.png: bad").is_none());
    }
}
