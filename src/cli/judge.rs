//! `gonogo calibrate` and `gonogo inspect`: models, calibrations and photos from files, verdicts to standard output.

use super::Exit;
use super::args::{Calibrate, Global, Inspect, VerdictFormat};
use super::output::{self, DASH, Failure};
use super::overlay;
use super::photos::{self, End, Watch};
use super::rig;
use super::timings::Stopwatch;
use super::verdict::{self, Outcome};
use crate::runtime::calibrate::{self, Calibration};
use crate::runtime::inspect::{Decision, Finding, Inspector};
use crate::runtime::model::{Model, is_rig};
use crate::runtime::photo::{Photo, PhotoError};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Fits a model to its station.
pub fn calibrate(args: &Calibrate) -> Result<Exit, Failure> {
    let text = output::read_text(&args.model)?;
    if is_rig(&text) {
        return rig::calibrate(args, &text);
    }
    let model = model_of(&args.model, &text)?;
    output::probe(&args.output)?;
    let photos = args.photos.iter().map(|p| photo(p, &model)).collect::<Result<Vec<Photo>, Failure>>()?;
    match calibrate::calibrate(&model, &photos) {
        Ok(calibration) => {
            calibrate::doubts(&model, &calibration, &photos).unwrap_or_default().iter().for_each(warn_of);
            output::write(&args.output, calibration.write().as_bytes())?;
            Ok(Exit::Fine)
        }
        Err(refusal) => {
            output::remark(&coded(&refusal.to_string()));
            Ok(Exit::Faults)
        }
    }
}

/// A photo for calibration that may show a fault.
pub fn warn_of(doubt: &Finding) {
    output::remark(&format!(
        "warning: by the renders alone {} looks {}; the photo counts as correct: make sure that it is",
        doubt.component, doubt.fault
    ));
}

/// Judges photos one after the other. A photo that cannot be read is a verdict of its own and stops nothing.
pub fn inspect(args: &Inspect, global: &Global) -> Result<Exit, Failure> {
    let text = output::read_text(&args.model)?;
    if is_rig(&text) {
        return rig::inspect(args, &text, global);
    }
    let model = model_of(&args.model, &text)?;
    let calibration = calibration(args.calibration.as_deref(), &model)?;
    let listed = photos::listed(&args.photos)?;
    let overlays = args.overlay.as_deref().map(|dir| Overlays::new(dir, &listed)).transpose()?;
    let watch = args.watch.as_deref().map(Watch::new).transpose()?;
    let stopwatch = Stopwatch::new(global);
    let listener = |part| stopwatch.note(part);
    let mut inspector = inspector(&model, &calibration)?;
    if stopwatch.is_on {
        inspector = inspector.heard_by(&listener);
    }
    let stopwatch = &stopwatch;
    let mut desk = Desk { inspector, stopwatch, format: args.format, overlays, outcomes: Vec::new(), worst: None };
    for path in &listed {
        if path == Path::new(DASH) {
            photos::standard_input(|name, bytes| desk.take(name, bytes.map_or_else(|| output::read_file(name), Ok)))?;
        } else {
            desk.take(path, output::read_file(path))?;
        }
    }
    if let Some(mut watch) = watch {
        let end = End { after: args.for_count, once_there: args.until.as_deref() };
        watch.run(&end, |path, bytes, patient| desk.take_if_complete(path, bytes, patient))?;
    }
    if args.format == VerdictFormat::Junit {
        let name = format!("{}.{}", model.assembly, model.station.name);
        output::line(&verdict::junit(&name, &verdict::watched(&model), &desk.outcomes))?;
    }
    stopwatch.finish();
    Ok(desk.worst.unwrap_or(Exit::Trouble))
}

/// Where photos are judged and verdicts written.
struct Desk<'a> {
    inspector: Inspector<'a>,
    stopwatch: &'a Stopwatch,
    format: VerdictFormat,
    overlays: Option<Overlays>,
    /// For the one report at the end.
    outcomes: Vec<Outcome>,
    worst: Option<Exit>,
}

impl Desk<'_> {
    fn take(&mut self, path: &Path, bytes: io::Result<Vec<u8>>) -> Result<(), Failure> {
        let name = path.display().to_string();
        match bytes {
            Ok(bytes) => {
                let outcome = judge_bytes(&self.inspector, name, &bytes);
                self.put(path, outcome, Some(&bytes))
            }
            Err(e) => self.put(path, Outcome::unreadable(name, format!("cannot read the file: {e}")), None),
        }
    }

    /// Judges a photo, unless it is none yet and there is time to wait.
    fn take_if_complete(&mut self, path: &Path, bytes: Vec<u8>, patient: bool) -> Result<bool, Failure> {
        let (start, photo) = (Instant::now(), self.inspector.photo(&bytes));
        if patient && matches!(photo, Err(PhotoError::Unreadable(_))) {
            self.stopwatch.lap();
            return Ok(false);
        }
        let outcome = judged(&self.inspector, path.display().to_string(), photo, start);
        self.put(path, outcome, Some(&bytes))?;
        Ok(true)
    }

    fn put(&mut self, path: &Path, outcome: Outcome, bytes: Option<&[u8]>) -> Result<(), Failure> {
        let (spent, name) = (self.stopwatch.lap(), outcome.photo.clone());
        if let (Some(overlays), Some(bytes)) = (&mut self.overlays, bytes) {
            overlays.admit(path)?;
            write_overlay(&overlays.dir, path, bytes, &outcome)?;
        }
        self.worst = self.worst.max(Some(exit_of(outcome.verdict.decision)));
        match self.format {
            VerdictFormat::Human => output::line(&verdict::human(&outcome)),
            VerdictFormat::Json => output::line(&outcome.json()),
            VerdictFormat::Junit => {
                self.outcomes.push(outcome);
                Ok(())
            }
        }?;
        self.stopwatch.tell(&name, spent)
    }
}

/// 0 all go, 1 any no-go, 2 any that could not be judged, whatever the others are.
pub fn exit_of(decision: Decision) -> Exit {
    match decision {
        Decision::Go => Exit::Fine,
        Decision::NoGo => Exit::Faults,
        Decision::CannotInspect => Exit::Trouble,
    }
}

/// Judges the photo in a file; its bytes as well, if there are any.
pub fn judge(inspector: &Inspector, path: &Path) -> (Outcome, Option<Vec<u8>>) {
    let name = path.display().to_string();
    match output::read_file(path) {
        Ok(bytes) => (judge_bytes(inspector, name, &bytes), Some(bytes)),
        Err(e) => (Outcome::unreadable(name, format!("cannot read the file: {e}")), None),
    }
}

fn judge_bytes(inspector: &Inspector, name: String, bytes: &[u8]) -> Outcome {
    let start = Instant::now();
    judged(inspector, name, inspector.photo(bytes), start)
}

fn judged(inspector: &Inspector, name: String, photo: Result<Photo, PhotoError>, start: Instant) -> Outcome {
    match photo {
        Ok(photo) => {
            let verdict = inspector.inspect(&photo);
            Outcome { photo: name, verdict, milliseconds: Some(start.elapsed().as_secs_f64() * 1e3) }
        }
        Err(e) => Outcome::unreadable(name, e.to_string()),
    }
}

/// The overlay of a judged photo as `DIR/<stem>.png`; a photo that cannot be decoded has none.
pub fn write_overlay(dir: &Path, photo: &Path, bytes: &[u8], outcome: &Outcome) -> Result<(), Failure> {
    match overlay::png(bytes, &outcome.verdict) {
        Ok(png) => output::write(&dir.join(overlay_name(photo)), &png),
        Err(_) => Ok(()),
    }
}

fn overlay_name(photo: &Path) -> OsString {
    let mut name = photo.file_stem().unwrap_or(OsStr::new("photo")).to_os_string();
    name.push(".png");
    name
}

/// A folder of overlays. Two photos must not end in one overlay, and no overlay on its own photo.
pub struct Overlays {
    pub dir: PathBuf,
    /// By name of the overlay, the photo under it.
    photos: BTreeMap<OsString, PathBuf>,
}

impl Overlays {
    /// What is known to go wrong goes wrong before the first photo is judged.
    pub fn new(dir: &Path, photos: &[PathBuf]) -> Result<Overlays, Failure> {
        output::make_dir(dir)?;
        let mut overlays = Overlays { dir: dir.to_path_buf(), photos: BTreeMap::new() };
        photos.iter().filter(|p| *p != Path::new(DASH)).try_for_each(|photo| overlays.admit(photo))?;
        overlays.photos.clear();
        Ok(overlays)
    }

    pub fn admit(&mut self, photo: &Path) -> Result<(), Failure> {
        let name = overlay_name(photo);
        let itself = fs::canonicalize(photo).ok().zip(fs::canonicalize(self.dir.join(&name)).ok());
        if itself.is_some_and(|(photo, overlay)| photo == overlay) {
            return Err(Failure(format!(
                "the overlay of `{}` would overwrite it: choose another folder",
                photo.display()
            )));
        }
        let before = self.photos.insert(name.clone(), photo.to_path_buf());
        if before.is_some_and(|before| before != photo) {
            let name = name.to_string_lossy();
            return Err(Failure(format!(
                "several photos would have the overlay `{name}`: judge them one folder at a time"
            )));
        }
        Ok(())
    }
}

pub fn read_model(path: &Path) -> Result<Model, Failure> {
    model_of(path, &output::read_text(path)?)
}

fn model_of(path: &Path, text: &str) -> Result<Model, Failure> {
    Model::read(text).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// The model with its calibration, ready to judge.
pub fn inspector<'a>(model: &'a Model, calibration: &'a Calibration) -> Result<Inspector<'a>, Failure> {
    let unusable = || Failure("E0803: the model's camera cannot see its own nodes: compile the spec again".into());
    Inspector::new(model, calibration).ok_or_else(unusable)
}

/// The calibration in a file; without one the station as the spec describes it, and a warning.
pub fn calibration(path: Option<&Path>, model: &Model) -> Result<Calibration, Failure> {
    let Some(path) = path else {
        warn_uncalibrated("PHOTO");
        return Ok(Calibration::nominal(model));
    };
    let text = output::read_text(path)?;
    Calibration::read(&text, model).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// `photos` is what `calibrate` takes.
pub fn warn_uncalibrated(photos: &str) {
    output::remark("warning: not calibrated: camera and lamps are taken to be as the spec says");
    output::remark(&format!(
        "  help: gonogo calibrate MODEL {photos} -o CALIBRATION, with one photo of a correct assembly"
    ));
}

pub fn photo(path: &Path, model: &Model) -> Result<Photo, Failure> {
    let bytes = output::read(path)?;
    let station = &model.station;
    Photo::decode(&bytes, station.tone, station.camera.size).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// `E0808: text` as diagnostics have it: `error[E0808]: text`.
pub fn coded(message: &str) -> String {
    match message.split_once(": ") {
        Some((code, rest)) if code.starts_with('E') && code[1..].bytes().all(|b| b.is_ascii_digit()) => {
            format!("error[{code}]: {rest}")
        }
        _ => format!("error: {message}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trouble_outweighs_faults_and_faults_outweigh_go() {
        let of = |decisions: &[Decision]| decisions.iter().copied().map(exit_of).max();
        assert_eq!(of(&[Decision::Go, Decision::Go]), Some(Exit::Fine));
        assert_eq!(of(&[Decision::Go, Decision::NoGo]), Some(Exit::Faults));
        assert_eq!(of(&[Decision::NoGo, Decision::CannotInspect, Decision::Go]), Some(Exit::Trouble));
    }

    #[test]
    fn codes_move_into_brackets() {
        assert_eq!(coded("E0808: a fault"), "error[E0808]: a fault");
        assert_eq!(coded("`x`: no file"), "error: `x`: no file");
    }
}
