//! What travels down the line beside the work itself: options, diagnostics, artifacts, progress; and the small joints
//! between one stage's output and the next one's input.

mod holes;
mod limits;
mod screws;

pub(crate) use holes::upside_down;
pub(crate) use limits::idle_cuts;

use crate::artifacts::{self, Artifact, pictures};
use crate::assembly::Analysis;
use crate::assembly::error_tree::{ErrorTree, object_tree};
use crate::assembly::fault::ErrorMode;
use crate::assembly::liaison::Liaison;
use crate::assembly::piece::Shelf;
use crate::assembly::place::place;
use crate::cache::Cache;
use crate::design::Loaded;
use crate::design::model::{Design, Station};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Sources};
use crate::runtime::camera::Camera;
use crate::runtime::model::Model;
use crate::runtime::rig::Rig;
use crate::scene::Body;
use crate::scene::build::{self, Instance, Placed};
use crate::solid::Solid;
use crate::train::prove::Proof;
use crate::train::{Job, Step, shots};
use crate::view::choose::{self, Asks, Choice};
use crate::view::escape;
use crate::view::lock::{self, Lock, Locked};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What to make of a spec.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// The station the model is for; the first one unless given.
    pub station: Option<String>,
    /// Replaced values of `let`s; the last of equal names wins.
    pub set: Vec<(String, String)>,
    /// What is asked for; the line stops after the last stage it takes.
    pub wanted: BTreeSet<Artifact>,
    /// Keep what the stages make on the way, for a report.
    pub keep: bool,
    /// Set from outside when nobody waits for the result any more: no further stage begins.
    pub stop: Option<Arc<AtomicBool>>,
    /// Where results are kept for the next time; what is made is the same with and without.
    pub cache: Option<Arc<dyn Cache>>,
    /// Where solids are kept from one spec to the next that is much like it; what is made is the same with and without.
    pub shelf: Option<Arc<Shelf>>,
    /// What was chosen before; it stands while what it depended on does.
    pub lock: Option<Lock>,
    /// Choose nothing anew: E0605 where the lock has no answer.
    pub locked: bool,
}

/// What came of a spec.
#[derive(Debug, Default)]
pub struct Compiled {
    /// Only if it was asked for and nothing is wrong.
    pub model: Option<Model>,
    /// The same of a station with several cameras; then there is no `model`.
    pub rig: Option<Rig>,
    /// Files by name: `view.ron`, `images/good.png`.
    pub artifacts: BTreeMap<String, Vec<u8>>,
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that the diagnostics point into.
    pub sources: Sources,
    /// The files that were read.
    pub inputs: Vec<String>,
    /// The lock with what was chosen this time; `None` where the spec leaves no choice.
    pub lock: Option<Lock>,
    /// What the stages made on the way, if [`Options::keep`] asked for it.
    pub made: Made,
    /// What [`crate::prove`] measured.
    pub proof: Option<Proof>,
}

/// What the stages made, each as far as the line came.
#[derive(Debug, Default)]
pub struct Made {
    pub design: Option<Design>,
    /// Digest of the design, as models carry it.
    pub digest: String,
    /// The station asked for: an index into [`Design::stations`].
    pub station: usize,
    /// One solid per component, at nominal.
    pub solids: Vec<Arc<Solid>>,
    pub analysis: Option<Analysis>,
    pub trees: Vec<ErrorTree>,
    /// The nominal assembly in the middle of where it may stand.
    pub bodies: Vec<Body>,
    pub choice: Option<Choice>,
    /// Where the station has several cameras, the stations and choices of the others.
    pub others: Vec<(usize, Choice)>,
    pub modes: Vec<ErrorMode>,
}

impl Made {
    /// Keeps the choice of one camera.
    pub(crate) fn chosen(&mut self, station: usize, choice: &Choice) {
        match self.choice {
            None => self.choice = Some(choice.clone()),
            Some(_) => self.others.push((station, choice.clone())),
        }
    }
}

/// The stages as progress tells them, in running order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    Design,
    Solid,
    Assembly,
    View,
    /// Pictures of the correct assembly and of every fault, where they are wanted.
    Images,
    Plan,
    Render,
    Fit,
    HeldOut,
    Verify,
}

impl Stage {
    /// In running order.
    pub const ALL: [Stage; 10] = [
        Stage::Design,
        Stage::Solid,
        Stage::Assembly,
        Stage::View,
        Stage::Images,
        Stage::Plan,
        Stage::Render,
        Stage::Fit,
        Stage::HeldOut,
        Stage::Verify,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Stage::Design => "design",
            Stage::Solid => "solid",
            Stage::Assembly => "assembly",
            Stage::View => "view",
            Stage::Images => "images",
            Stage::Plan => "plan",
            Stage::Render => "render",
            Stage::Fit => "fit",
            Stage::HeldOut => "held out",
            Stage::Verify => "verify",
        }
    }
}

impl From<Step> for Stage {
    fn from(step: Step) -> Stage {
        match step {
            Step::Plan => Stage::Plan,
            Step::Render => Stage::Render,
            Step::Fit => Stage::Fit,
            Step::HeldOut => Stage::HeldOut,
            Step::Verify => Stage::Verify,
        }
    }
}

/// Units of work done of how many in a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    pub stage: Stage,
    pub done: usize,
    pub total: usize,
}

/// Told about progress.
pub type Observer<'a> = dyn Fn(Progress) + Sync + 'a;

/// All that training or a proof starts from.
pub(crate) struct Ready {
    pub design: Design,
    /// For each camera its station, an index into [`Design::stations`].
    pub cameras: Vec<(usize, Camera)>,
    pub modes: Vec<ErrorMode>,
    pub liaison: Liaison,
    pub tree: ErrorTree,
}

impl Ready {
    /// One job a camera.
    pub fn jobs<'a>(&'a self, cache: Option<&'a dyn Cache>) -> Vec<Job<'a>> {
        let spec = digest(&self.design);
        let job = |&(station, camera): &(usize, Camera)| Job {
            design: &self.design,
            station: &self.design.stations[station],
            camera,
            modes: &self.modes,
            liaison: &self.liaison,
            tree: &self.tree,
            spec: spec.clone(),
            cache,
        };
        self.cameras.iter().map(job).collect()
    }
}

/// The conveyor.
pub(crate) struct Line<'a> {
    pub options: &'a Options,
    observer: &'a Observer<'a>,
    pub out: Compiled,
    last: Stage,
}

impl<'a> Line<'a> {
    pub fn new(options: &'a Options, observer: &'a Observer<'a>) -> Line<'a> {
        let last = options.wanted.iter().map(|a| a.stage()).max().unwrap_or(Stage::View);
        Line { options, observer, out: Compiled::default(), last }
    }

    /// Begins a stage, unless nothing from here on was asked for or nobody waits for it any more.
    pub fn enter(&mut self, stage: Stage) -> Option<()> {
        let stopped = self.options.stop.as_ref().is_some_and(|stop| stop.load(Ordering::Relaxed));
        (stage <= self.last && !stopped).then(|| self.tell(stage, 0, 1))
    }

    pub fn tell(&self, stage: Stage, done: usize, total: usize) {
        (self.observer)(Progress { stage, done, total });
    }

    /// What `design` read and found.
    pub fn loaded(&mut self, loaded: Loaded) -> Option<Design> {
        self.out.sources = loaded.sources;
        self.out.inputs = loaded.inputs;
        self.out.diagnostics.extend(loaded.diagnostics);
        loaded.design
    }

    /// The output of a stage that makes nothing when something is wrong.
    pub fn accept<T>(&mut self, outcome: Result<T, Vec<Diagnostic>>) -> Option<T> {
        outcome.map_err(|faults| self.out.diagnostics.extend(faults)).ok()
    }

    /// Every part at its limits.
    pub fn shapes(&mut self, design: &Design) -> Option<limits::Shapes> {
        let shelf = self.options.shelf.as_deref();
        let mut workshop = shelf.map(Shelf::workshop).unwrap_or_default();
        let shapes = limits::shapes(design, &mut workshop);
        if let Some(shelf) = shelf {
            shelf.put_back(workshop);
        }
        self.accept(shapes)
    }

    /// The output of a stage that goes on in spite of warnings.
    pub fn check<T>(&mut self, (output, found): (T, Vec<Diagnostic>)) -> Option<T> {
        let stops = found.iter().any(Diagnostic::is_error);
        self.out.diagnostics.extend(found);
        (!stops).then_some(output)
    }

    /// Screws whose thread is in nothing.
    pub fn check_screws(&mut self, design: &Design, analysis: &Analysis) {
        let found = screws::loose(design, &self.out.sources, analysis);
        self.out.diagnostics.extend(found);
    }

    /// The camera's place as it was chosen before; `None` within where it is to be chosen.
    pub fn kept_choice(&mut self, design: &Design, station: &Station) -> Option<Option<Placed>> {
        let Options { lock, locked, set, .. } = self.options;
        self.accept(lock::kept(lock.as_ref(), *locked, design, (station, &lock::entry(station, set))))
    }

    /// Locks what was chosen where the spec leaves a choice.
    pub fn lock(&mut self, design: &Design, station: &Station, choice: &Choice) {
        if lock::is_auto(station) {
            let locked = Locked::new(design, station, choice.table[choice.best].placing);
            let entry = lock::entry(station, &self.options.set);
            let before = self.out.lock.take().or_else(|| self.options.lock.clone());
            self.out.lock = Some(before.unwrap_or_default().with(design, entry, locked));
        }
    }

    /// Whether anybody will read what the camera sees.
    pub fn asks(&self) -> Asks {
        let is_read = self.options.keep || self.options.wanted.contains(&Artifact::View);
        if is_read { Asks::What } else { Asks::Whether }
    }

    /// Keeps what a stage made if that is asked for.
    pub fn keep(&mut self, put: impl FnOnce(&mut Made)) {
        if self.options.keep {
            put(&mut self.out.made);
        }
    }

    /// Keeps an artifact if it is wanted.
    pub fn emit(&mut self, artifact: Artifact, text: impl FnOnce() -> String) {
        if self.options.wanted.contains(&artifact) {
            self.out.artifacts.insert(artifact.file(), text().into_bytes());
        }
    }

    /// Names what the camera of a rig gave after it: `view.ron` becomes `top.view.ron`, `images/good.png` `images/top/good.png`.
    pub fn emit_of_camera(&mut self, station: &Station, emit: impl FnOnce(&mut Self)) {
        let Some((_, camera)) = station.in_rig() else { return emit(self) };
        let before = std::mem::take(&mut self.out.artifacts);
        emit(self);
        let own = std::mem::replace(&mut self.out.artifacts, before);
        self.out.artifacts.extend(own.into_iter().map(|(name, bytes)| {
            let named = name.split_once('/').map(|(folder, file)| format!("{folder}/{camera}/{file}"));
            (named.unwrap_or_else(|| format!("{camera}.{name}")), bytes)
        }));
    }

    pub fn emit_assembly(&mut self, design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) {
        self.emit(Artifact::Contacts, || artifacts::contacts(design, solids, analysis));
        self.emit(Artifact::Liaison, || artifacts::liaison(design, solids, analysis));
        // Trees of all watched components in full are a lot of data where there are a thousand.
        let shows_trees = [Artifact::ErrorTrees, Artifact::ObjectTree].iter().any(|a| self.options.wanted.contains(a));
        let trees = if shows_trees { object_tree(design, &analysis.liaison).trees } else { Vec::new() };
        self.emit(Artifact::ErrorTrees, || artifacts::error_trees(design, &trees));
        self.emit(Artifact::ObjectTree, || artifacts::object_tree(design, &trees));
        self.emit(Artifact::Insertion, || artifacts::insertion(design, solids, analysis));
        self.emit(Artifact::Measures, || artifacts::measures(analysis));
        self.emit_files(Artifact::Gltf, || artifacts::exchange::gltf(design, solids, analysis));
        self.emit_files(Artifact::Liaison, || pictures::liaison(design, solids, analysis));
        self.emit_files(Artifact::ErrorTrees, || pictures::error_trees(design, solids, analysis, &trees));
        self.emit_files(Artifact::ObjectTree, || pictures::object_tree(design, solids, analysis, &trees));
        self.emit_files(Artifact::Exploded, || pictures::exploded(design, solids, analysis));
    }

    /// Keeps an artifact of several files, or of other than text, if it is wanted.
    pub fn emit_files(&mut self, artifact: Artifact, files: impl FnOnce() -> Vec<(String, Vec<u8>)>) {
        if self.options.wanted.contains(&artifact) {
            self.out.artifacts.extend(files());
        }
    }
}

/// The camera as it was chosen before, for a report beside all that it was chosen from; or as it is chosen now.
pub(crate) fn choice(shows_all: bool, kept: Option<Placed>, task: &escape::Task) -> Choice {
    match kept {
        Some(placing) if shows_all => escape::keep(task, placing),
        Some(placing) => choose::keep(task.design, task.station, task.bodies, task.targets, placing, task.asks),
        None => escape::choose(task),
    }
}

/// The cameras of the station of that name, or of the first: indices into [`Design::stations`]. `line.top` names one camera
/// of several.
pub(crate) fn stations(design: &Design, name: Option<&str>) -> Result<Vec<usize>, Vec<Diagnostic>> {
    let first = design.stations.first().map(Station::place_name);
    let name = name.or(first).unwrap_or_default();
    let all = |wanted: &dyn Fn(&Station) -> bool| -> Vec<usize> {
        (0..design.stations.len()).filter(|&i| wanted(&design.stations[i])).collect()
    };
    let found = all(&|s| s.place_name() == name);
    let found = if found.is_empty() { all(&|s| s.name == name) } else { found };
    if found.is_empty() { Err(vec![no_station(design, name)]) } else { Ok(found) }
}

/// A component that one camera does not see is no fault where another does.
pub(crate) fn seen_by_none(mut cameras: Vec<Vec<Diagnostic>>) -> Vec<Diagnostic> {
    const UNSEEN: &str = "E0601";
    let component = |d: &Diagnostic| (d.code == UNSEEN).then(|| d.labels.get(1).map(|l| l.span)).flatten();
    let unseen = |of: &Vec<Diagnostic>| -> Vec<_> { of.iter().filter_map(component).collect() };
    let by_camera: Vec<_> = cameras.iter().map(unseen).collect();
    let by_all = |d: &Diagnostic| component(d).is_none_or(|c| by_camera.iter().all(|unseen| unseen.contains(&c)));
    cameras.iter_mut().for_each(|found| found.retain(by_all));
    cameras.into_iter().flatten().collect()
}

fn no_station(design: &Design, name: &str) -> Diagnostic {
    let mut names: Vec<&str> = design.stations.iter().map(Station::place_name).collect();
    names.dedup();
    let span = design.stations.first().map(|s| s.span).unwrap_or_default();
    let fault = Diagnostic::error("E0201", span, format!("no station `{name}`"))
        .label("the stations begin here")
        .note(format!("this spec has: {}", names.join(", ")));
    match nearest(name, names.iter().copied()) {
        Some(near) => fault.help(format!("did you mean `--station {near}`?")),
        None => fault,
    }
}

/// One solid per component at nominal.
pub(crate) fn per_component(design: &Design, shapes: &[[Arc<Solid>; 3]]) -> Vec<Arc<Solid>> {
    design.components.iter().map(|c| shapes[c.part][0].clone()).collect()
}

/// The nominal assembly in the middle of where it may stand.
pub(crate) fn bodies(design: &Design, station: &Station, solids: &[Arc<Solid>]) -> Vec<Body> {
    let finish = |part: usize| build::finish_nominal(&design.materials[design.parts[part].material]);
    let instance = Instance {
        solids: solids.iter().cloned().map(Some).collect(),
        poses: place(design, &design.nominal()),
        finishes: design.components.iter().map(|c| finish(c.part)).collect(),
    };
    build::bodies(&instance, shots::standing(station).map(|[low, high]| (low + high) / 2.0))
}

/// Digest of the design as resolved: layout and comments of the spec do not count, overridden values do.
pub(crate) fn digest(design: &Design) -> String {
    let text = ron::to_string(design).expect("plain data always serialises");
    format!("blake3:{}", blake3::hash(text.as_bytes()).to_hex())
}
