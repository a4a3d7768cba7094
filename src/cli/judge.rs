//! `gonogo calibrate` and `gonogo inspect`: models, calibrations and photos from files, verdicts to standard output.

use super::Exit;
use super::args::{Calibrate, Inspect, VerdictFormat};
use super::output::{self, Failure};
use super::overlay;
use super::verdict::{self, Outcome};
use crate::runtime::calibrate::{self, Calibration};
use crate::runtime::inspect::{Decision, Inspector};
use crate::runtime::model::Model;
use crate::runtime::photo::Photo;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::time::Instant;

/// Fits a model to its station.
pub fn calibrate(args: &Calibrate) -> Result<Exit, Failure> {
    let model = read_model(&args.model)?;
    output::probe(&args.output)?;
    let photos = args.photos.iter().map(|p| photo(p, &model)).collect::<Result<Vec<Photo>, Failure>>()?;
    match calibrate::calibrate(&model, &photos) {
        Ok(calibration) => {
            for doubt in calibrate::doubts(&model, &calibration, &photos).unwrap_or_default() {
                output::remark(&format!(
                    "warning: by the renders alone {} looks {}; the photo counts as correct: make sure that it is",
                    doubt.component, doubt.fault
                ));
            }
            output::write(&args.output, calibration.write().as_bytes())?;
            Ok(Exit::Fine)
        }
        Err(refusal) => {
            output::remark(&coded(&refusal.to_string()));
            Ok(Exit::Faults)
        }
    }
}

/// Judges photos one after the other. A photo that cannot be read is a verdict of its own and stops nothing.
pub fn inspect(args: &Inspect) -> Result<Exit, Failure> {
    let model = read_model(&args.model)?;
    let calibration = calibration(args.calibration.as_deref(), &model)?;
    let inspector = inspector(&model, &calibration)?;
    if let Some(dir) = &args.overlay {
        output::make_dir(dir)?;
        distinct_stems(args)?;
    }
    let mut outcomes = Vec::new();
    for path in &args.photos {
        let (outcome, bytes) = judge(&model, &inspector, path);
        if let (Some(dir), Some(bytes)) = (&args.overlay, bytes) {
            write_overlay(dir, path, &bytes, &outcome)?;
        }
        match args.format {
            VerdictFormat::Human => output::line(&verdict::human(&outcome))?,
            VerdictFormat::Json => output::line(&verdict::json(&outcome))?,
            VerdictFormat::Junit => {}
        }
        outcomes.push(outcome);
    }
    if args.format == VerdictFormat::Junit {
        output::line(&verdict::junit(&format!("{}.{}", model.assembly, model.station.name), &outcomes))?;
    }
    Ok(exit(outcomes.iter().map(|o| o.verdict.decision)))
}

/// 0 all go, 1 any no-go, 2 any that could not be judged, whatever the others are.
pub fn exit(decisions: impl Iterator<Item = Decision>) -> Exit {
    let of_one = |decision| match decision {
        Decision::Go => Exit::Fine,
        Decision::NoGo => Exit::Faults,
        Decision::CannotInspect => Exit::Trouble,
    };
    decisions.map(of_one).max().unwrap_or(Exit::Trouble)
}

/// Judges the photo in a file; its bytes as well, if there are any.
pub fn judge(model: &Model, inspector: &Inspector, path: &Path) -> (Outcome, Option<Vec<u8>>) {
    let name = path.display().to_string();
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) => return (Outcome::unreadable(name, format!("cannot read the file: {e}")), None),
    };
    let start = Instant::now();
    let station = &model.station;
    let outcome = match Photo::decode(&bytes, station.tone, station.camera.size) {
        Ok(photo) => {
            let verdict = inspector.inspect(&photo);
            Outcome { photo: name, verdict, milliseconds: start.elapsed().as_secs_f64() * 1e3 }
        }
        Err(e) => Outcome::unreadable(name, e.to_string()),
    };
    (outcome, Some(bytes))
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

/// Two photos must not end in one overlay, and no overlay on its own photo.
fn distinct_stems(args: &Inspect) -> Result<(), Failure> {
    let Some(dir) = &args.overlay else { return Ok(()) };
    let mut seen: Vec<OsString> = Vec::new();
    for photo in &args.photos {
        let name = overlay_name(photo);
        let itself = fs::canonicalize(photo).ok().zip(fs::canonicalize(dir.join(&name)).ok());
        if itself.is_some_and(|(photo, overlay)| photo == overlay) {
            return Err(Failure(format!(
                "the overlay of `{}` would overwrite it: choose another folder",
                photo.display()
            )));
        }
        if seen.contains(&name) {
            let name = name.to_string_lossy();
            return Err(Failure(format!(
                "several photos would have the overlay `{name}`: judge them one folder at a time"
            )));
        }
        seen.push(name);
    }
    Ok(())
}

pub fn read_model(path: &Path) -> Result<Model, Failure> {
    let text = output::read_text(path)?;
    Model::read(&text).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// The model with its calibration, ready to judge.
pub fn inspector<'a>(model: &'a Model, calibration: &'a Calibration) -> Result<Inspector<'a>, Failure> {
    let unusable = || Failure("E0803: the model's camera cannot see its own nodes: compile the spec again".into());
    Inspector::new(model, calibration).ok_or_else(unusable)
}

/// The calibration in a file; without one the station as the spec describes it, and a warning.
pub fn calibration(path: Option<&Path>, model: &Model) -> Result<Calibration, Failure> {
    let Some(path) = path else {
        output::remark("warning: not calibrated: camera and lamps are taken to be as the spec says");
        output::remark("  help: gonogo calibrate MODEL PHOTO -o CALIBRATION, with one photo of a correct assembly");
        return Ok(Calibration::nominal(model));
    };
    let text = output::read_text(path)?;
    Calibration::read(&text, model).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

fn photo(path: &Path, model: &Model) -> Result<Photo, Failure> {
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
        let of = |decisions: &[Decision]| exit(decisions.iter().copied());
        assert_eq!(of(&[Decision::Go, Decision::Go]), Exit::Fine);
        assert_eq!(of(&[Decision::Go, Decision::NoGo]), Exit::Faults);
        assert_eq!(of(&[Decision::NoGo, Decision::CannotInspect, Decision::Go]), Exit::Trouble);
        assert_eq!(of(&[]), Exit::Trouble);
    }

    #[test]
    fn codes_move_into_brackets() {
        assert_eq!(coded("E0808: a fault"), "error[E0808]: a fault");
        assert_eq!(coded("`x`: no file"), "error: `x`: no file");
    }
}
