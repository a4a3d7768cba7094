//! The camera: the paper's criterion over the places the spec allows (its §IV), and the components no camera sees.
//!
//! In: a design, one of its stations, the bodies as they stand, the faces of the error trees. Out: a [`Choice`] with the
//! score of every view tried, and diagnostics. Never renders light: a view is an item buffer.
//!
//! The paper maximises "the number of visible pixels and surfaces" and leaves their exchange rate open. Here a surface
//! seen in p pixels is worth ln(1 + p / 16) of its weight: the first pixels of another surface count most, more of the
//! same surface always helps. Before the score come two demands: all that is watched stays inside the image wherever the
//! assembly may stand, and as many of the watched components as possible are seen at all.

use super::blocked;
use super::escape::{self, Weighed};
use super::item_buffer::{ItemBuffer, PixelGrid};
use super::nodes::{Seen, seen_on_grid};
use crate::assembly::contact::FaceRef;
use crate::design::model::{CameraPlacing, Design, Station};
use crate::diag::Diagnostic;
use crate::runtime::camera::Camera;
use crate::scene::Body;
use crate::scene::build::{self, Placed};
use crate::units::Range;
use nalgebra::Point3;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

/// A component or surface seen in fewer pixels than this is not seen: a 4 × 4 px patch is the least a gradient fits in.
pub const LEAST_PIXELS: u32 = 16;
/// Width (px) the views of the search are reduced to.
const SEARCH_WIDTH: u32 = 160;
/// Views along distance, elevation and azimuth in the coarse grid: 252 in all.
const COARSE: [u32; 3] = [3, 7, 12];
/// Rounds of refinement, each with half the step of the one before.
const ROUNDS: u32 = 3;
/// A component of which the search sees this many pixels is seen: at full size they cannot be fewer than [`LEAST_PIXELS`].
const NO_DOUBT: u32 = 8 * LEAST_PIXELS;

/// What is wanted of a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asks {
    /// Whether the camera will do: it is looked through at full size only where the search leaves a doubt.
    Whether,
    /// And what it sees of every component.
    What,
}

/// A face whose visible pixels count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    pub component: usize,
    /// Face of the component's solid.
    pub face: u32,
    pub weight: f64,
}

/// One view and what it is worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Scored {
    pub placing: Placed,
    /// All that is watched is inside the image wherever the assembly may stand.
    pub framed: bool,
    /// Visible pixels (of the full image, estimated at reduced size) of each watched component.
    pub watched: Vec<u32>,
    /// Targets seen in at least [`LEAST_PIXELS`], and visible pixels of all targets.
    pub surfaces: u32,
    pub pixels: u32,
    pub score: f64,
}

/// The chosen view among all that were tried.
#[derive(Debug, Clone)]
pub struct Choice {
    /// Index into `table`.
    pub best: usize,
    /// Every view tried, in the order of trying: the coarse grid, then the refinements.
    pub table: Vec<Scored>,
    /// The nominal camera of the chosen view.
    pub camera: Camera,
    /// What it sees, at full size; empty where nobody [`Asks`] and nothing is in doubt.
    pub seen: Vec<Seen>,
    /// E0601 for every watched component it does not see, E0603 for what stands inside of something.
    pub diagnostics: Vec<Diagnostic>,
    /// Views that the score put first, with what they are predicted to let pass ([`super::escape`]); none for a camera that
    /// is fixed, or chosen by the score alone.
    pub shortlist: Vec<Weighed>,
    /// The fewest of the views weighed that together tell every fault which any of them tells, the chosen one among them
    /// (indices into `table`); empty where none was weighed.
    pub cameras: Vec<usize>,
}

impl Choice {
    /// The views of the cameras that together tell every fault, where the chosen one alone does not; else none.
    pub fn several(&self) -> impl Iterator<Item = &Scored> {
        let several = if self.cameras.len() > 1 { &self.cameras[..] } else { &[] };
        several.iter().map(|&view| &self.table[view])
    }

    /// The shortlist, the chosen view first, then as predicted escape and score order them.
    pub fn weighed(&self) -> impl Iterator<Item = &Weighed> {
        let mut order: Vec<&Weighed> = self.shortlist.iter().collect();
        let is_other = |w: &Weighed| w.view != self.best;
        order.sort_by(|a, b| is_other(a).cmp(&is_other(b)).then(escape::compare(&self.table, a, b)));
        order.into_iter()
    }
}

/// The faces of the error trees, each once, from the highest level at which they stand
/// ([`levels`](crate::assembly::error_tree::levels)). A face of a root weighs 1, of every level below half of the one above,
/// because the further an error has to spread the less it shows.
pub fn targets(levels: &BTreeMap<FaceRef, u32>) -> Vec<Target> {
    let target = |(at, level): (&FaceRef, &u32)| Target {
        component: at.component,
        face: at.face as u32,
        weight: 0.5f64.powi(*level as i32),
    };
    levels.iter().map(target).collect()
}

/// Chooses the station's camera by the paper's score alone; a fixed one is scored and checked as a choice of one.
pub fn choose(design: &Design, station: &Station, bodies: &[Body], targets: &[Target]) -> Choice {
    let table = paper_table(design, station, bodies, targets);
    let best = first(&table);
    chosen(design, station, bodies, (table, best), Asks::What)
}

/// The scores of all views that are tried.
pub(super) fn paper_table(design: &Design, station: &Station, bodies: &[Body], targets: &[Target]) -> Vec<Scored> {
    let search = Search::new(design, station, bodies, targets);
    match &station.camera.placing {
        &CameraPlacing::Fixed { distance, elevation, azimuth } => {
            search.score_all(&[Placed { distance, elevation, azimuth }])
        }
        CameraPlacing::Auto { distance, elevation, azimuth } => search.run([distance, elevation, azimuth]),
    }
}

/// A choice made before: the view is scored and checked like a fixed one, and no other is tried.
pub fn keep(
    design: &Design,
    station: &Station,
    bodies: &[Body],
    targets: &[Target],
    placing: Placed,
    asks: Asks,
) -> Choice {
    let search = Search::new(design, station, bodies, targets);
    chosen(design, station, bodies, (search.score_all(&[placing]), 0), asks)
}

/// The view `best` of the table as the choice.
pub(super) fn chosen(
    design: &Design,
    station: &Station,
    bodies: &[Body],
    (table, best): (Vec<Scored>, usize),
    asks: Asks,
) -> Choice {
    let camera = build::camera(&station.camera, table[best].placing);
    let is_sure = asks == Asks::Whether && table[best].watched.iter().all(|&pixels| pixels >= NO_DOUBT);
    let seen = if is_sure { Vec::new() } else { seen_on_grid(bodies, &camera, &PixelGrid::of(&camera)) };
    // From inside of a part nothing is seen; one mistake is one diagnostic.
    let mut diagnostics = match blocked::camera(design, station, bodies, &camera) {
        Some(fault) => vec![fault],
        None => unseen(design, station, &table, &seen),
    };
    diagnostics.extend(blocked::lamps(design, station, bodies));
    Choice { best, table, camera, seen, diagnostics, shortlist: Vec::new(), cameras: Vec::new() }
}

struct Search<'a> {
    station: &'a Station,
    bodies: &'a [Body],
    targets: &'a [Target],
    watched: Vec<usize>,
    /// Corners of the boxes of all that is watched, at every extreme of where the assembly may stand (mm).
    extremes: Vec<Point3<f64>>,
    /// Image size is divided by this during the search.
    reduction: u32,
    grid: PixelGrid,
}

impl<'a> Search<'a> {
    fn new(design: &Design, station: &'a Station, bodies: &'a [Body], targets: &'a [Target]) -> Self {
        let watched: Vec<usize> = design.inspect.watch.iter().map(|w| w.component).collect();
        let reduction = (station.camera.image[0] / SEARCH_WIDTH).max(1);
        let anywhere = Placed { distance: 1.0, elevation: 0.0, azimuth: 0.0 };
        let grid = PixelGrid::of(&build::camera(&station.camera, anywhere).reduced(reduction));
        let set: BTreeSet<usize> = watched.iter().copied().collect();
        let extremes = extremes(station, bodies.iter().filter(|body| set.contains(&body.component)));
        Search { station, bodies, targets, watched, extremes, reduction, grid }
    }

    /// A coarse grid over the ranges, then ever finer steps round the best.
    fn run(&self, ranges: [&Range; 3]) -> Vec<Scored> {
        let axes = [0, 1, 2].map(|i| Axis::new(ranges[i], COARSE[i], i == 2));
        let mut table = self.score_all(&product(axes.each_ref().map(Axis::coarse)));
        for round in 1..=ROUNDS {
            let Placed { distance, elevation, azimuth } = table[first(&table)].placing;
            let centre = [distance, elevation, azimuth];
            let near = [0, 1, 2].map(|i| axes[i].near(centre[i], 0.5f64.powi(round as i32)));
            let tried = |placing: &Placed| table.iter().any(|scored| scored.placing == *placing);
            let fresh: Vec<Placed> = product(near).into_iter().filter(|placing| !tried(placing)).collect();
            table.extend(self.score_all(&fresh));
        }
        table
    }

    /// Scores in the order of the places, at any number of threads.
    fn score_all(&self, places: &[Placed]) -> Vec<Scored> {
        places.par_iter().map(|&placing| self.score(placing)).collect()
    }

    fn score(&self, placing: Placed) -> Scored {
        let camera = build::camera(&self.station.camera, placing);
        let buffer = ItemBuffer::on_grid(self.bodies, &camera.reduced(self.reduction), &self.grid);
        let counts = buffer.counts();
        let area = self.reduction * self.reduction;
        let of_target = |t: &Target| area * counts.get(&(t.component, t.face)).copied().unwrap_or(0);
        let of_component =
            |component: usize| counts.range((component, 0)..=(component, u32::MAX)).map(|c| c.1).sum::<u32>();
        let worth = |t: &Target| t.weight * (f64::from(of_target(t)) / f64::from(LEAST_PIXELS)).ln_1p();
        Scored {
            placing,
            framed: self.extremes.iter().all(|p| inside(&camera, p)),
            watched: self.watched.iter().map(|&component| area * of_component(component)).collect(),
            surfaces: self.targets.iter().filter(|t| of_target(t) >= LEAST_PIXELS).count() as u32,
            pixels: self.targets.iter().map(of_target).sum(),
            score: self.targets.iter().map(worth).sum(),
        }
    }
}

/// One axis of the search.
struct Axis {
    low: f64,
    high: f64,
    steps: u32,
    /// A whole turn: its ends are the same view.
    around: bool,
}

impl Axis {
    fn new(range: &Range, steps: u32, is_azimuth: bool) -> Axis {
        let around = is_azimuth && range.high - range.low > TAU - 1e-9;
        Axis { low: range.low, high: range.high, steps: if range.high > range.low { steps } else { 1 }, around }
    }

    fn step(&self) -> f64 {
        let gaps = if self.around { self.steps } else { self.steps.saturating_sub(1).max(1) };
        (self.high - self.low) / f64::from(gaps)
    }

    fn coarse(&self) -> Vec<f64> {
        (0..self.steps).map(|i| (self.low + f64::from(i) * self.step()).min(self.high)).collect()
    }

    /// The centre and its neighbours at `share` of the coarse step, inside the range.
    fn near(&self, centre: f64, share: f64) -> Vec<f64> {
        let step = self.step() * share;
        let mut values: Vec<f64> = [-step, 0.0, step].into_iter().map(|d| self.clamp(centre + d)).collect();
        values.dedup();
        values
    }

    fn clamp(&self, value: f64) -> f64 {
        if self.around { value } else { value.clamp(self.low, self.high) }
    }
}

fn product([distances, elevations, azimuths]: [Vec<f64>; 3]) -> Vec<Placed> {
    let mut places = Vec::with_capacity(distances.len() * elevations.len() * azimuths.len());
    for &distance in &distances {
        for &elevation in &elevations {
            places.extend(azimuths.iter().map(|&azimuth| Placed { distance, elevation, azimuth }));
        }
    }
    places
}

/// Index of the best view; the first of equals.
pub(super) fn first(table: &[Scored]) -> usize {
    (1..table.len()).fold(0, |best, i| if compare(&table[i], &table[best]).is_gt() { i } else { best })
}

/// All views from the best down; of equals the one tried first.
pub(super) fn ranked(table: &[Scored]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..table.len()).collect();
    order.sort_by(|&a, &b| compare(&table[b], &table[a]).then(a.cmp(&b)));
    order
}

fn compare(a: &Scored, b: &Scored) -> Ordering {
    demands(a).cmp(&demands(b)).then(a.score.total_cmp(&b.score))
}

/// What comes before the score: whether all that is watched stays inside the image, and how much of it is seen.
pub(super) fn demands(view: &Scored) -> (bool, usize) {
    (view.framed, view.watched.iter().filter(|&&pixels| pixels >= LEAST_PIXELS).count())
}

fn extremes<'a>(station: &Station, bodies: impl Iterator<Item = &'a Body>) -> Vec<Point3<f64>> {
    let corners: Vec<Point3<f64>> = bodies.flat_map(box_corners).collect();
    let off = |range: &Range| [range.low - range.nominal, range.high - range.nominal];
    let mut points = Vec::with_capacity(8 * corners.len());
    for x in off(&station.x) {
        for y in off(&station.y) {
            for turn in off(&station.rz) {
                let moved = build::stand([x, y, 0.0, turn]);
                points.extend(corners.iter().map(|p| moved * p));
            }
        }
    }
    points
}

/// Corners of the box round a body, along the axes of its part, in the station's frame.
fn box_corners(body: &Body) -> Vec<Point3<f64>> {
    let Some(&first) = body.mesh.positions.first() else { return Vec::new() };
    let (low, high) = body.mesh.positions.iter().fold((first, first), |(l, h), p| (l.inf(p), h.sup(p)));
    let pick = |i: usize, axis: usize| if i >> axis & 1 == 1 { high[axis] } else { low[axis] };
    (0..8).map(|i| body.pose * Point3::new(pick(i, 0), pick(i, 1), pick(i, 2))).collect()
}

fn inside(camera: &Camera, p: &Point3<f64>) -> bool {
    let [width, height] = camera.size.map(f64::from);
    camera.project((*p).into()).is_some_and(|[x, y]| (0.0..=width).contains(&x) && (0.0..=height).contains(&y))
}

/// E0601: a watched component that the chosen camera, at full size, does not see.
fn unseen(design: &Design, station: &Station, table: &[Scored], seen: &[Seen]) -> Vec<Diagnostic> {
    let of_component: BTreeMap<usize, &Seen> = seen.iter().map(|s| (s.component, s)).collect();
    let watch = design.inspect.watch.iter().enumerate();
    let hidden = watch.filter_map(|(i, watch)| {
        let found = of_component.get(&watch.component)?;
        (found.visible_pixels < LEAST_PIXELS).then_some((i, *found))
    });
    hidden.map(|(i, found)| report(design, station, table, (i, found))).collect()
}

fn report(design: &Design, station: &Station, table: &[Scored], (watch, found): (usize, &Seen)) -> Diagnostic {
    let component = &design.components[found.component];
    let (name, visible, full) = (&component.name, found.visible_pixels, found.full_pixels);
    // Of one view alone nothing can be said about the others.
    let is_auto = matches!(station.camera.placing, CameraPlacing::Auto { .. }) && table.len() > 1;
    let most = table.iter().max_by_key(|scored| scored.watched[watch]);
    let elsewhere = most.filter(|scored| scored.watched[watch] >= LEAST_PIXELS);
    let subject = match (is_auto, elsewhere) {
        (true, None) => format!("no allowed camera of station `{}` sees", station.name),
        (true, Some(_)) => format!("the camera chosen for station `{}` does not see", station.name),
        (false, _) => format!("the camera of station `{}` does not see", station.name),
    };
    let message = format!("{subject} component `{name}`: {visible} of {full} px");
    let mut fault = Diagnostic::error("E0601", station.camera.span, message)
        .label(format!("sees {visible} px of it; at least {LEAST_PIXELS} are needed"))
        .also(component.span, if full == 0 { "outside the image" } else { "hidden behind other components" });
    let other = if is_auto { "other ranges of `elevation` and `azimuth`" } else { "another place of the camera" };
    let way = if full == 0 { "a larger `distance`, or an `aim` nearer to it" } else { other };
    fault = fault.help(format!("{way}, or `ignore {name}` in `inspect`: then no photo is asked about it"));
    if let (true, Some(view)) = (is_auto, elsewhere) {
        fault = fault.note(format!("{}, a view that loses more than it gains", describe(view, watch)));
    }
    fault
}

fn describe(view: &Scored, watch: usize) -> String {
    let Placed { distance, elevation, azimuth } = view.placing;
    let [elevation, azimuth] = [elevation, azimuth].map(f64::to_degrees);
    format!(
        "{} px are seen from {distance:.0} mm, {elevation:.0} deg up, azimuth {azimuth:.0} deg",
        view.watched[watch]
    )
}

#[cfg(test)]
mod tests;
