//! gonogo compiles a text file that describes a mechanical assembly into an inspector for it.
//!
//! The name is the go/no-go gauge: its GO side checks maximum material, its NO-GO side least material. [`compile`] runs the
//! line from a spec to a [`Model`](runtime::model::Model); [`runtime`] judges photos with the model and knows nothing of the
//! compiler. The modules stand below in running order, each using only those beneath it in the house: `cli` on the roof,
//! then this page, the stages from last to first, and `runtime`, `diag`, `units` and `rng` as the ground.
//!
//! Every stage is a pure function: no I/O, no clock, no globals, no printing. What is wrong with a spec is data.

#![cfg_attr(not(feature = "c"), forbid(unsafe_code))]

#[cfg(feature = "compile")]
pub mod cache;
#[cfg(feature = "compile")]
pub mod diag;
#[cfg(feature = "compile")]
pub mod iso;
#[cfg(feature = "compile")]
pub mod rng;
#[cfg(feature = "compile")]
pub mod units;

// The stages, in running order.
#[cfg(feature = "compile")]
pub mod assembly;
#[cfg(feature = "compile")]
pub mod design;
#[cfg(feature = "compile")]
pub mod drawing;
#[cfg(feature = "compile")]
pub mod exchange;
#[cfg(feature = "compile")]
pub mod render;
#[cfg(feature = "compile")]
pub mod report;
#[cfg(feature = "compile")]
pub mod scene;
#[cfg(feature = "compile")]
pub mod solid;
#[cfg(feature = "compile")]
pub mod syntax;
#[cfg(feature = "compile")]
pub mod train;
#[cfg(feature = "compile")]
pub mod variation;
#[cfg(feature = "compile")]
pub mod view;

// What the machine on the line needs.
#[cfg(feature = "c")]
mod ffi;
pub mod runtime;

#[cfg(feature = "compile")]
pub mod artifacts;
#[cfg(feature = "compile")]
pub mod build;
#[cfg(feature = "compile")]
pub mod golden;
#[cfg(feature = "compile")]
pub mod import;
#[cfg(feature = "compile")]
mod line;

#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "cli")]
pub mod lsp;

/// The Rust of the book is compiled and run as tests of rustdoc.
#[cfg(doctest)]
#[doc = include_str!("../docs/src/embedding.md")]
mod book {}

#[cfg(feature = "compile")]
pub use line::{Compiled, Made, Observer, Options, Progress, Stage};

#[cfg(feature = "compile")]
use artifacts::Artifact;

/// Compiles a spec, as far as `options` asks for.
///
/// `read` gives the text of a file by its name: the spec itself, and what it uses. Faults of the spec are in
/// [`Compiled::diagnostics`], and what could be made in spite of them in the rest. The same spec and the same options give
/// the same bytes at any number of threads.
#[cfg(feature = "compile")]
pub fn compile(spec: &str, read: design::Read, options: &Options, observer: &Observer) -> Compiled {
    let mut line = line::Line::new(options, observer);
    // A stage that cannot go on has said why in the diagnostics.
    let _ = run(spec, read, &mut line);
    line.out
}

/// Holds a model's promise against fresh renders of the spec it was compiled from: both error rates are in
/// [`Compiled::proof`]. `None` there, without a diagnostic, says that the model is of another spec.
#[cfg(feature = "compile")]
pub fn prove(
    spec: &str,
    read: design::Read,
    options: &Options,
    model: &runtime::model::Model,
    trials: train::prove::Trials,
    observer: &Observer,
) -> Compiled {
    let options = Options { wanted: [Artifact::Model].into(), ..options.clone() };
    let mut line = line::Line::new(&options, observer);
    if let Some(ready) = ready(spec, read, &mut line) {
        // Renders that are to be fresh are neither kept nor found.
        let jobs = ready.jobs(None);
        if let [job] = &jobs[..]
            && job.spec == model.spec
        {
            let proof = train::prove::prove(job, model, trials, &|step, i, n| line.tell(step.into(), i, n));
            line.out.proof = line.accept(proof);
        }
    }
    line.out
}

/// The line, stage by stage; `None` where it ends early, by fault or because no more was asked for.
#[cfg(feature = "compile")]
fn run(spec: &str, read: design::Read, line: &mut line::Line) -> Option<()> {
    let ready = ready(spec, read, line)?;
    let jobs = ready.jobs(line.options.cache.as_deref());
    let tell = |step: train::Step, done, total| line.tell(step.into(), done, total);
    let doubts = match &jobs[..] {
        [job] => {
            let trained = train::train(job, &tell);
            let (model, doubts) = line.accept(trained)?;
            line.out.model = Some(model);
            doubts
        }
        jobs => {
            let trained = train::rig::train(jobs, &tell);
            let (rig, doubts) = line.accept(trained)?;
            line.out.rig = Some(rig);
            doubts
        }
    };
    line.check(((), doubts))
}

/// The stages before training.
#[cfg(feature = "compile")]
fn ready(spec: &str, read: design::Read, line: &mut line::Line) -> Option<line::Ready> {
    line.enter(Stage::Design)?;
    let design = line.loaded(design::load(spec, read, &line.options.set))?;
    line.keep(|made| (made.digest, made.design) = (line::digest(&design), Some(design.clone())));
    let stations = line.accept(line::stations(&design, line.options.station.as_deref()))?;
    line.keep(|made| made.station = stations[0]);
    line.emit(Artifact::Design, || artifacts::design(&design));

    line.enter(Stage::Solid)?;
    let shapes = line.shapes(&design)?;
    line.check(((), line::idle_cuts(&design, &shapes)));
    line.check(((), line::upside_down(&design, &shapes)));
    let solids = line::per_component(&design, &shapes);
    line.keep(|made| made.solids = solids.clone());
    line.emit(Artifact::Brep, || artifacts::brep(&design, &shapes));
    line.emit_files(Artifact::Step, || artifacts::exchange::step(&design, &solids));

    line.enter(Stage::Assembly)?;
    let found = assembly::analyse(&design, &solids);
    line.keep(|made| made.analysis = Some(found.0.clone()));
    let analysis = line.check(found)?;
    line.check_screws(&design, &analysis);
    let modes = || assembly::fault::all(&design, &analysis.liaison, &analysis.insertion, &solids);
    let trees = || assembly::error_tree::object_tree(&design, &analysis.liaison).trees;
    line.keep(|made| (made.trees, made.modes) = (trees(), modes()));
    line.emit_assembly(&design, &solids, &analysis);

    line.enter(Stage::View)?;
    let bodies = line::bodies(&design, &design.stations[stations[0]], &solids);
    let targets = view::choose::targets(&assembly::error_tree::levels(&design, &analysis.liaison));
    line.keep(|made| made.bodies = bodies.clone());
    let (mut cameras, mut found) = (Vec::new(), Vec::new());
    for index in stations {
        let station = &design.stations[index];
        let kept = line.kept_choice(&design, station)?;
        let weighs = view::lock::is_auto(station) && (kept.is_none() || line.options.keep);
        let task = view::escape::Task {
            design: &design,
            station,
            bodies: &bodies,
            targets: &targets,
            modes: &if weighs { modes() } else { Vec::new() },
            solids: &solids,
            asks: line.asks(),
        };
        let choice = line::choice(line.options.keep, kept, &task);
        line.keep(|made| made.chosen(index, &choice));
        cameras.push((index, choice));
        found.push(cameras.last().map(|(_, choice)| choice.diagnostics.clone()).unwrap_or_default());
    }
    line.check(((), line::seen_by_none(found)))?;
    if line.options.wanted.contains(&Artifact::Images) {
        line.enter(Stage::Images)?;
    }
    for (index, choice) in &cameras {
        let station = &design.stations[*index];
        line.lock(&design, station, choice);
        line.emit_of_camera(station, |line| {
            line.emit(Artifact::View, || artifacts::view(&design, station, choice));
            line.emit_files(Artifact::Images, || {
                artifacts::images::pictures(&design, station, &choice.camera, &modes())
            });
        });
    }
    let cameras = cameras.into_iter().map(|(index, choice)| (index, choice.camera)).collect();

    line.enter(Stage::Plan)?;
    let modes = modes();
    let tree = assembly::error_tree::error_tree(&analysis.liaison, 0, None);
    Some(line::Ready { cameras, modes, liaison: analysis.liaison, tree, design })
}
