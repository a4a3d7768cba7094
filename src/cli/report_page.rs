//! `gonogo report`: spec, model and photos from files, one page to a file.

use super::args::{Global, Report};
use super::compile::{self, Document};
use super::output::{self, Failure};
use super::{Exit, judge, keep};
use crate::report::{self, Assembly, Judge, Module, Shot, Trained, View};
use crate::runtime::calibrate::Calibration;
use crate::runtime::inspect::{Inspector, Verdict};
use crate::runtime::model::{Model, is_rig};
use crate::runtime::photo::Photo;
use crate::{Compiled, Options};
use image::GrayImage;
use std::path::Path;

/// Writes the page, also of a spec with errors, as far as they allow; exit code 1 then.
pub fn report(args: &Report, global: &Global) -> Result<Exit, Failure> {
    output::probe(&args.output)?;
    let spec = Document::read(&args.spec)?;
    let model = args.model.as_deref().map(one_camera).transpose()?;
    let calibration = match (&model, &args.calibration) {
        (Some(model), Some(path)) => Some(judge::calibration(Some(path), model)?),
        _ => None,
    };
    let station = args.station.clone().or(model.as_ref().map(|m| m.station.name.clone()));
    let options = Options {
        station,
        set: args.variant.set.clone(),
        keep: true,
        lock: keep::read_lock(&args.spec)?,
        ..Options::default()
    };
    let compiled = args.jobs.run(|| compile::run(&spec, &options, global))?;
    let fine = compile::report(&compiled, &args.variant, global)?;
    if model.as_ref().is_some_and(|m| m.spec != compiled.made.digest) {
        output::remark("warning: the model was compiled from another version of this spec");
    }
    let judged = match &model {
        Some(model) => judged(args, model, calibration.as_ref())?,
        None => Vec::new(),
    };
    let carried = carried(args)?;
    let page = with(&spec.name, &compiled, model.as_ref(), calibration.as_ref(), &judged, carried.as_ref());
    output::write(&args.output, page.as_bytes())?;
    Ok(if fine { Exit::Fine } else { Exit::Faults })
}

/// The files that a page carries which judges.
struct Carried {
    module: Vec<u8>,
    model: String,
    calibration: Option<String>,
}

fn carried(args: &Report) -> Result<Option<Carried>, Failure> {
    let (Some(path), Some(model)) = (&args.judge, &args.model) else { return Ok(None) };
    let module = output::read(path)?;
    Module::read(&module).map_err(|why| {
        let path = path.display();
        Failure(format!("`{path}`: {why}; `tools/wasm.sh gonogo.wasm` in the sources of this version makes one"))
    })?;
    let calibration = args.calibration.as_deref().map(output::read_text).transpose()?;
    Ok(Some(Carried { module, model: output::read_text(model)?, calibration }))
}

/// The model; that of several cameras is not shown yet.
fn one_camera(path: &Path) -> Result<Model, Failure> {
    let text = output::read_text(path)?;
    if is_rig(&text) {
        return Err(Failure(format!(
            "`{}` holds the models of several cameras: the page shows what they see without `--model`, or the model of one \
             camera (`gonogo compile --station STATION.CAMERA`)",
            path.display()
        )));
    }
    Model::read(&text).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// A photo as people see it and as it was judged.
pub struct Judged {
    name: String,
    grey: Option<GrayImage>,
    photo: Option<Photo>,
    verdict: Verdict,
}

fn judged(args: &Report, model: &Model, calibration: Option<&Calibration>) -> Result<Vec<Judged>, Failure> {
    if args.photos.is_empty() {
        return Ok(Vec::new());
    }
    let nominal = match calibration {
        Some(known) => known.clone(),
        None => judge::calibration(None, model)?,
    };
    let inspector = judge::inspector(model, &nominal)?;
    Ok(args.photos.iter().map(|path| judge_one(model, &inspector, path)).collect())
}

pub fn judge_one(model: &Model, inspector: &Inspector, path: &Path) -> Judged {
    let (outcome, bytes) = judge::judge(inspector, path);
    let bytes = bytes.unwrap_or_default();
    let station = &model.station;
    Judged {
        name: outcome.photo,
        grey: image::load_from_memory(&bytes).ok().map(|picture| picture.into_luma8()),
        photo: Photo::decode(&bytes, station.tone, station.camera.size).ok(),
        verdict: outcome.verdict,
    }
}

/// The page of what was compiled and judged.
pub fn page(
    spec: &str,
    compiled: &Compiled,
    model: Option<&Model>,
    calibration: Option<&Calibration>,
    judged: &[Judged],
) -> String {
    with(spec, compiled, model, calibration, judged, None)
}

fn with(
    spec: &str,
    compiled: &Compiled,
    model: Option<&Model>,
    calibration: Option<&Calibration>,
    judged: &[Judged],
    carried: Option<&Carried>,
) -> String {
    let judge = carried.and_then(|c| {
        let module = Module::read(&c.module).ok()?;
        Some(Judge { module, model: &c.model, calibration: c.calibration.as_deref() })
    });
    let made = &compiled.made;
    let assembly = made.design.as_ref().map(|design| Assembly {
        design,
        solids: &made.solids,
        analysis: made.analysis.as_ref(),
        trees: &made.trees,
        modes: &made.modes,
    });
    let view = made.design.as_ref().zip(made.choice.as_ref()).map(|(design, choice)| View {
        station: &design.stations[made.station],
        bodies: &made.bodies,
        choice,
    });
    let others: Vec<View> = made.design.as_ref().map_or_else(Vec::new, |design| {
        let view = |(station, choice)| View { station: &design.stations[station], bodies: &made.bodies, choice };
        made.others.iter().map(|(station, choice)| view((*station, choice))).collect()
    });
    let photos: Vec<Shot> = judged
        .iter()
        .map(|j| Shot { name: &j.name, grey: j.grey.as_ref(), photo: j.photo.as_ref(), verdict: &j.verdict })
        .collect();
    report::page(&report::Report {
        spec,
        diagnostics: &compiled.diagnostics,
        sources: &compiled.sources,
        assembly,
        view,
        others: &others,
        model: model.map(|model| Trained { model, calibration, fits: model.spec == made.digest }),
        photos: &photos,
        judge,
    })
}
