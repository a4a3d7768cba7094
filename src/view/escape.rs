//! What a camera is for: the faults that would escape it from each view, predicted from geometry.
//!
//! In: a design, one of its stations, the bodies as they stand, the error modes. Out: a [`Choice`] as
//! [`choose`](super::choose::choose) makes it, with the views that the paper's score puts first weighed by what they are
//! predicted to let pass. The score still chooses: that the prediction chooses better has not been shown (benches/views.rs).
//! Never renders light: a view is an item buffer with rough shading.
//!
//! For each error mode the picture of the faulty assembly is held against that of the good one, as gradients, inside the
//! pixels that any fault of the component changes. What play, pose, reflectance and light may do to the good picture is
//! noise: the squared detectability is d'² = Dᵀ (S + N Nᵀ)⁻¹ D with the difference D, the independent noise S and the
//! nuisance directions N (the ideal linear observer; Barrett and Myers 2004, §13.2). At the asked rate of false rejects a
//! fault then escapes with Φ(z - d').

use super::choose::{self, Asks, Choice, Scored, Target, chosen, demands, first, paper_table, ranked};
use super::cover::fewest;
use super::item_buffer::{ItemBuffer, Mask, PixelGrid};
use super::lock::is_auto;
use super::nodes::{change_mask, dilate};
use super::shade::{Light, Shader, exposure};
use crate::assembly::fault::{self, ErrorMode, FaultKind, Motion};
use crate::assembly::place::place;
use crate::design::model::{Design, Expr, Material, Station};
use crate::runtime::camera::Camera;
use crate::scene::Body;
use crate::scene::build::{self, Placed};
use crate::solid::Solid;
use nalgebra::{DMatrix, DVector, Isometry3, Vector3};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Views of the shortlist.
pub const SHORTLIST: usize = 12;
/// Views of the shortlist look from directions at least this far apart (rad), or from distances that differ by this share;
/// where that leaves too few, they may be nearer.
const APART: [f64; 3] = [0.2, 0.1, 0.05];
const FARTHER: [f64; 3] = [0.1, 0.05, 0.025];
/// Width (px) that pictures are reduced to.
const WIDTH: u32 = 160;
/// Places in a fault's range of sizes that are looked at.
const LOOKS: [f64; 2] = [0.2, 0.7];
/// A change is widened by this much (px of the pictures): a gradient reaches over it.
const WIDEN: usize = 2;
/// Standard deviation of what the search leaves of the pose (px of the photo).
const POSE: f64 = 1.0;
/// Standard deviation of a gradient: a share of itself (what training allows a template), and a part of full scale for what
/// rough shading leaves out: shadows, texture, reflections.
const OF_ITSELF: f64 = 0.15;
const OF_SCALE: f64 = 0.02;
/// Standard deviation of the light's strength from photo to photo.
const OF_LIGHT: f64 = 0.2;
/// Neighbouring gradients err together: so many count as one.
const TOGETHER: f64 = 4.0;
/// Components whose brightness may vary on its own, at most, in one node.
const NEIGHBOURS: usize = 8;
/// Escapes that differ by less are the same: the prediction is no better.
pub const SAME: f64 = 1e-3;

/// What a view of the shortlist is predicted to let pass.
#[derive(Debug, Clone, PartialEq)]
pub struct Weighed {
    /// Index into [`Choice::table`].
    pub view: usize,
    /// One for each error mode, in their order.
    pub escapes: Vec<ModeEscape>,
}

/// How much of an error mode passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeEscape {
    /// Index into [`Design::components`].
    pub component: usize,
    pub kind: FaultKind,
    /// Predicted share of faulty assemblies that pass, over the mode's sizes.
    pub share: f64,
}

impl Weighed {
    /// The largest of the escapes; 0 where there is no mode.
    pub fn worst(&self) -> f64 {
        self.weakest().map_or(0.0, |mode| mode.share)
    }

    pub fn mean(&self) -> f64 {
        self.escapes.iter().map(|mode| mode.share).sum::<f64>() / self.escapes.len().max(1) as f64
    }

    /// The mode that escapes most; the first of equals.
    pub fn weakest(&self) -> Option<&ModeEscape> {
        self.escapes.iter().reduce(|worst, mode| if mode.share > worst.share { mode } else { worst })
    }
}

/// What a camera is to be chosen for.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    pub design: &'a Design,
    pub station: &'a Station,
    /// The nominal assembly in the middle of where it may stand.
    pub bodies: &'a [Body],
    /// What the paper's score counts.
    pub targets: &'a [Target],
    /// What may be wrong.
    pub modes: &'a [ErrorMode],
    /// One per component, at nominal.
    pub solids: &'a [Arc<Solid>],
    pub asks: Asks,
}

/// Chooses the station's camera by the paper's score and weighs the views that it puts first. A fixed camera is a choice of
/// one and is not weighed.
pub fn choose(task: &Task) -> Choice {
    let table = table(task);
    let best = first(&table);
    if !is_auto(task.station) {
        return chosen(task.design, task.station, task.bodies, (table, best), task.asks);
    }
    let weighed = weigh(task, &table, &shortlist(&table, SHORTLIST));
    finished(task, table, best, weighed)
}

/// A choice made before, with all that [`choose()`] would weigh now: to show what it buys.
pub fn keep(task: &Task, placing: Placed) -> Choice {
    let mut table = table(task);
    let best = table.iter().position(|view| view.placing == placing).unwrap_or(table.len());
    if best == table.len() {
        table.extend(choose::keep(task.design, task.station, task.bodies, task.targets, placing, Asks::Whether).table);
    }
    let mut views = shortlist(&table, SHORTLIST);
    if !views.contains(&best) {
        views.push(best);
    }
    let weighed = weigh(task, &table, &views);
    finished(task, table, best, weighed)
}

fn finished(task: &Task, table: Vec<Scored>, best: usize, shortlist: Vec<Weighed>) -> Choice {
    let first = shortlist.iter().position(|w| w.view == best).unwrap_or(0);
    let cameras = fewest(&shortlist, first).into_iter().map(|i| shortlist[i].view).collect();
    Choice { shortlist, cameras, ..chosen(task.design, task.station, task.bodies, (table, best), task.asks) }
}

fn table(task: &Task) -> Vec<Scored> {
    paper_table(task.design, task.station, task.bodies, task.targets)
}

/// Of two weighed views the better one first: the one whose worst mode escapes less; of equals, whose next worst does, and
/// so on, so that a mode which no view tells decides nothing. Last the paper's score.
pub fn compare(table: &[Scored], a: &Weighed, b: &Weighed) -> Ordering {
    let steps = |w: &Weighed| -> Vec<u64> {
        let mut steps: Vec<u64> = w.escapes.iter().map(|mode| (mode.share / SAME).round() as u64).collect();
        steps.sort_unstable_by(|a, b| b.cmp(a));
        steps
    };
    let score = |w: &Weighed| table[w.view].score;
    steps(a).cmp(&steps(b)).then(score(b).total_cmp(&score(a))).then(a.view.cmp(&b.view))
}

/// The views that the paper's score puts first, each looking another way than those before it. None that sees fewer of the
/// watched components, or frames them less, than the first of all.
pub fn shortlist(table: &[Scored], most: usize) -> Vec<usize> {
    let order = ranked(table);
    let fits = |&&i: &&usize| demands(&table[i]) == demands(&table[order[0]]);
    let mut taken: Vec<usize> = Vec::new();
    for apart in APART.into_iter().zip(FARTHER) {
        for &i in order.iter().filter(fits) {
            let differs = |&t: &usize| differ(table[t].placing, table[i].placing, apart);
            if taken.len() < most && taken.iter().all(differs) {
                taken.push(i);
            }
        }
    }
    taken
}

/// Whether two views look from other directions (rad apart) or distances (share).
fn differ(a: Placed, b: Placed, (apart, farther): (f64, f64)) -> bool {
    let towards = |p: Placed| {
        let ((sin_e, cos_e), (sin_a, cos_a)) = (p.elevation.sin_cos(), p.azimuth.sin_cos());
        Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e)
    };
    towards(a).angle(&towards(b)) > apart || (a.distance / b.distance).ln().abs() > farther
}

/// Predicts the escapes from some views of the table, in their order, at any number of threads.
pub fn weigh(task: &Task, table: &[Scored], views: &[usize]) -> Vec<Weighed> {
    let predictor = Predictor::new(task);
    let one = |&view: &usize| {
        let camera = build::camera(&task.station.camera, table[view].placing);
        Weighed { view, escapes: predictor.escapes(&camera) }
    };
    views.par_iter().map(one).collect()
}

/// A faulty assembly as it differs from the good one.
struct Variant {
    mode: usize,
    /// Components that stand otherwise or not at all.
    moved: BTreeSet<usize>,
    put: Vec<Body>,
}

struct Predictor<'a> {
    design: &'a Design,
    station: &'a Station,
    bodies: &'a [Body],
    modes: &'a [ErrorMode],
    variants: Vec<Variant>,
    /// Per component the standard deviations of its place (mm, station's frame) and from where.
    play: Vec<(Vector3<f64>, Vec<Vector3<f64>>)>,
    /// Escapes are those of detectabilities below this.
    z: f64,
    reduction: u32,
    grid: PixelGrid,
}

/// A picture in pixels of the reduced image.
struct Picture {
    buffer: ItemBuffer,
    grey: Vec<f64>,
}

impl<'a> Predictor<'a> {
    fn new(task: &Task<'a>) -> Predictor<'a> {
        let Task { design, station, bodies, modes, .. } = *task;
        let reduction = (station.camera.image[0] / WIDTH).max(1);
        let anywhere = Placed { distance: 1.0, elevation: 0.0, azimuth: 0.0 };
        let grid = PixelGrid::of(&build::camera(&station.camera, anywhere).reduced(reduction));
        let middle = [station.x, station.y, station.z, station.rz].map(|r| (r.low + r.high) / 2.0);
        let (stand, poses) = (build::stand(middle), place(design, &design.nominal()));
        let watched: BTreeSet<usize> = modes.iter().map(|m| m.component).collect();
        let rate = design.inspect.false_reject / watched.len().max(1) as f64;
        Predictor {
            design,
            station,
            bodies,
            modes,
            variants: variants(task, stand, &poses),
            play: (0..poses.len()).map(|c| play(design, c, stand, &poses)).collect(),
            z: normal_quantile(1.0 - rate),
            reduction,
            grid,
        }
    }

    /// Of every mode from a camera (full size): the mean over its sizes.
    fn escapes(&self, camera: &Camera) -> Vec<ModeEscape> {
        let (light, small) = (Light::new(self.station, camera), camera.reduced(self.reduction));
        let shader = Shader::new(&light, &small, self.bodies);
        let good = self.good(&shader);
        let scale = exposure(&good.grey);
        let mut rest: BTreeMap<&BTreeSet<usize>, ItemBuffer> = BTreeMap::new();
        let none = |m: &ErrorMode| ModeEscape { component: m.component, kind: m.kind, share: 0.0 };
        let mut escapes: Vec<ModeEscape> = self.modes.iter().map(none).collect();
        let mut from = 0;
        // The variants of one component stand together.
        while let Some(first) = self.variants.get(from) {
            let component = self.modes[first.mode].component;
            let own = self.variants[from..].iter().take_while(|v| self.modes[v.mode].component == component);
            let own: Vec<&Variant> = own.collect();
            from += own.len();
            for variant in &own {
                rest.entry(&variant.moved).or_insert_with(|| self.without(&variant.moved, &small));
            }
            let faulty: Vec<Faulty> = own.iter().map(|v| self.faulty(v, &rest[&v.moved], &good, &shader)).collect();
            rest.clear();
            let d = self.detectabilities(component, &good, &faulty, scale, camera);
            for (variant, d) in own.iter().zip(d) {
                let looks = own.iter().filter(|v| v.mode == variant.mode).count() as f64;
                escapes[variant.mode].share += normal(self.z - d) / looks;
            }
        }
        escapes
    }

    fn good(&self, shader: &Shader) -> Picture {
        let buffer = ItemBuffer::on_grid(self.bodies, shader.camera, &self.grid);
        let grey = (0..buffer.id.len()).map(|i| shader.grey(&buffer, i)).collect();
        Picture { buffer, grey }
    }

    fn without(&self, moved: &BTreeSet<usize>, camera: &Camera) -> ItemBuffer {
        let left: Vec<Body> = self.bodies.iter().filter(|b| !moved.contains(&b.component)).cloned().collect();
        ItemBuffer::on_grid(&left, camera, &self.grid)
    }

    fn faulty(&self, variant: &Variant, rest: &ItemBuffer, good: &Picture, shader: &Shader) -> Faulty {
        let mut buffer = rest.clone();
        if !variant.put.is_empty() {
            lay_over(&mut buffer, &ItemBuffer::on_grid(&variant.put, shader.camera, &self.grid));
        }
        let changed = change_mask(&good.buffer, &buffer);
        let mut finishes = shader.finishes.clone();
        finishes.extend(variant.put.iter().map(|b| (b.component as u32 + 1, &b.finish)));
        let own = Shader { light: shader.light, camera: shader.camera, finishes };
        let mut grey = good.grey.clone();
        // Normals come from neighbours, so those of a change are new as well.
        let near = dilate(&changed, 1);
        (0..grey.len()).filter(|&i| near.bits[i]).for_each(|i| grey[i] = own.grey(&buffer, i));
        Faulty { grey, changed }
    }

    /// d' of each faulty picture of a component.
    fn detectabilities(
        &self,
        component: usize,
        good: &Picture,
        faulty: &[Faulty],
        scale: f64,
        camera: &Camera,
    ) -> Vec<f64> {
        let (width, height) = (good.buffer.width, good.buffer.height);
        let mut any = Mask { width, height, bits: vec![false; width * height] };
        for one in faulty {
            any.bits.iter_mut().zip(&one.changed.bits).for_each(|(a, b)| *a |= b);
        }
        let node = dilate(&any, WIDEN);
        let inner = |i: usize| {
            (2..width.saturating_sub(2)).contains(&(i % width)) && (2..height.saturating_sub(2)).contains(&(i / width))
        };
        let pixels: Vec<usize> = (0..node.bits.len()).filter(|&i| node.bits[i] && inner(i)).collect();
        if pixels.is_empty() {
            return vec![0.0; faulty.len()];
        }
        let grey = |picture: &[f64]| -> Vec<f64> { picture.iter().map(|g| g * scale).collect() };
        let plain = grey(&good.grey);
        let template = gradients(&plain, width, &pixels);
        let deviations = template.map(|g| self.deviation(g));
        let noise = self.nuisances(component, good, &plain, (&pixels, &template), camera);
        let observer = Observer::new(deviations, noise);
        let difference = |one: &Faulty| gradients(&grey(&one.grey), width, &pixels) - &template;
        faulty.iter().map(|one| observer.detectability(&difference(one))).collect()
    }

    /// Of one gradient.
    fn deviation(&self, gradient: f64) -> f64 {
        let sensor = self.station.noise / f64::from(self.reduction);
        (sensor * sensor + (OF_ITSELF * gradient).powi(2) + OF_SCALE * OF_SCALE).sqrt()
    }

    /// What may happen to the good gradients, each as one standard deviation of it.
    fn nuisances(
        &self,
        component: usize,
        good: &Picture,
        plain: &[f64],
        (pixels, template): (&[usize], &DVector<f64>),
        camera: &Camera,
    ) -> Vec<DVector<f64>> {
        let width = good.buffer.width;
        let shifted = |by: isize| -> DVector<f64> {
            let at = |sign: isize| -> Vec<usize> { pixels.iter().map(|&i| i.wrapping_add_signed(sign * by)).collect() };
            (gradients(plain, width, &at(1)) - gradients(plain, width, &at(-1))) / 2.0
        };
        let (along, down) = (shifted(1), shifted(width as isize));
        let move_by = |[x, y]: [f64; 2]| &along * x + &down * y;
        let pose = POSE / f64::from(self.reduction);
        let mut found = vec![move_by([pose, 0.0]), move_by([0.0, pose]), template * OF_LIGHT];
        let (at, zones) = &self.play[component];
        let seen = |by: Vector3<f64>| camera.project((at + by).into());
        for zone in zones {
            if let (Some(a), Some(b)) = (seen(-zone), seen(*zone)) {
                found.push(move_by([0, 1].map(|k| (b[k] - a[k]) / 2.0 / f64::from(self.reduction))));
            }
        }
        found.extend(self.brightnesses(good, plain, pixels));
        found
    }

    /// Pieces differ in how much light they return.
    fn brightnesses(&self, good: &Picture, plain: &[f64], pixels: &[usize]) -> Vec<DVector<f64>> {
        let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
        pixels.iter().for_each(|&i| *counts.entry(good.buffer.id[i]).or_insert(0) += 1);
        counts.remove(&0);
        let mut seen: Vec<(u32, usize)> = counts.into_iter().collect();
        seen.sort_by_key(|&(id, count)| (std::cmp::Reverse(count), id));
        let one = |&(id, _): &(u32, usize)| {
            let own = |(i, &g): (usize, &f64)| if good.buffer.id[i] == id { g } else { 0.0 };
            let alone: Vec<f64> = plain.iter().enumerate().map(own).collect();
            let part = &self.design.parts[self.design.components[id as usize - 1].part];
            gradients(&alone, good.buffer.width, pixels) * spread(&self.design.materials[part.material])
        };
        seen.iter().take(NEIGHBOURS).map(one).collect()
    }
}

/// A faulty picture and where it differs from the good one.
struct Faulty {
    grey: Vec<f64>,
    changed: Mask,
}

/// The nearer of two pictures in every pixel; of surfaces at one depth the lower component's.
fn lay_over(under: &mut ItemBuffer, over: &ItemBuffer) {
    /// mm; what single precision keeps of a working distance.
    const COINCIDENT: f32 = 1e-3;
    for i in 0..under.id.len() {
        let nearer = over.depth[i] < under.depth[i] - COINCIDENT;
        let level = (over.depth[i] - under.depth[i]).abs() <= COINCIDENT && over.id[i] < under.id[i];
        if over.id[i] != 0 && (nearer || level) {
            (under.id[i], under.face[i], under.depth[i]) = (over.id[i], over.face[i], over.depth[i]);
        }
    }
}

/// Differences across and down, over two pixels, one after the other.
fn gradients(grey: &[f64], width: usize, pixels: &[usize]) -> DVector<f64> {
    let across = pixels.iter().map(|&i| grey[i + 1] - grey[i - 1]);
    let down = pixels.iter().map(|&i| grey[i + width] - grey[i - width]);
    DVector::from_iterator(2 * pixels.len(), across.chain(down))
}

/// The linear observer that knows the noise.
struct Observer {
    deviations: DVector<f64>,
    /// Nuisance directions in units of the noise, by column.
    noise: DMatrix<f64>,
    /// (1 + NᵀN)⁻¹.
    inverse: DMatrix<f64>,
}

impl Observer {
    fn new(deviations: DVector<f64>, nuisances: Vec<DVector<f64>>) -> Observer {
        let columns: Vec<DVector<f64>> = nuisances.iter().map(|n| n.component_div(&deviations)).collect();
        let noise = DMatrix::from_columns(&columns);
        let size = noise.ncols();
        let gram = DMatrix::identity(size, size) + noise.tr_mul(&noise);
        // The identity keeps it positive definite.
        let inverse = gram.cholesky().map_or_else(|| DMatrix::zeros(size, size), |c| c.inverse());
        Observer { deviations, noise, inverse }
    }

    fn detectability(&self, difference: &DVector<f64>) -> f64 {
        let signal = difference.component_div(&self.deviations);
        let explained = self.noise.tr_mul(&signal);
        let square = signal.norm_squared() - explained.dot(&(&self.inverse * &explained));
        (square.max(0.0) / TOGETHER).sqrt()
    }
}

fn variants(task: &Task, stand: Isometry3<f64>, poses: &[Isometry3<f64>]) -> Vec<Variant> {
    let of: BTreeMap<usize, &Body> = task.bodies.iter().map(|b| (b.component, b)).collect();
    let mut found = Vec::new();
    let mut order: Vec<usize> = (0..task.modes.len()).collect();
    order.sort_by_key(|&m| task.modes[m].component);
    for m in order {
        let mode = &task.modes[m];
        let has_size = mode.has_size();
        for &u in LOOKS.iter().take(if has_size { LOOKS.len() } else { 1 }) {
            let faulted = fault::apply(mode, [u, 0.5, 0.5], task.solids, poses);
            let mut put = Vec::new();
            let other = if let Motion::Replace { by, .. } = mode.motion { by } else { mode.component };
            if let (Some(pose), Some(body)) = (faulted.pose, of.get(&other)) {
                put.push(Body { pose: stand * pose, component: mode.component, ..(*body).clone() });
            }
            for (component, pose) in &faulted.pushed {
                put.extend(of.get(component).map(|body| Body { pose: stand * pose, ..(*body).clone() }));
            }
            let moved = faulted.pushed.iter().map(|p| p.0).chain([mode.component]).collect();
            found.push(Variant { mode: m, moved, put });
        }
    }
    found
}

/// Where a component stands, and a standard deviation of that for each axis of its zone and of those it stands on (mm).
fn play(
    design: &Design,
    component: usize,
    stand: Isometry3<f64>,
    poses: &[Isometry3<f64>],
) -> (Vector3<f64>, Vec<Vector3<f64>>) {
    let values = design.nominal();
    let mut zones = Vec::new();
    for index in std::iter::successors(Some(component), |&i| design.components[i].parent) {
        let placed = &design.components[index].pose;
        // The axes of a zone are those of the frame on which the component is placed.
        let frame = stand.rotation * poses[index].rotation * placed.eval(&values).rotation.inverse();
        for (axis, zone) in placed.t.iter().enumerate() {
            let Expr::Dim(id) = zone else { continue };
            let half = design.dims[id.0 as usize].range.half_width();
            if half > 0.0 {
                // A uniform error within ± h has the variance h² / 3.
                zones.push(frame * Vector3::ith(axis, half / 3f64.sqrt()));
            }
        }
    }
    ((stand * poses[component]).translation.vector, zones)
}

/// Standard deviation of a material's reflectance, as a share of it.
fn spread(material: &Material) -> f64 {
    let range = &material.reflectance;
    if range.nominal > 0.0 { range.half_width() / range.nominal / 3f64.sqrt() } else { 0.0 }
}

/// Share of a standard normal below `z` (Abramowitz and Stegun 26.2.17, error below 1e-7).
fn normal(z: f64) -> f64 {
    const TERMS: [f64; 5] = [0.319_381_530, -0.356_563_782, 1.781_477_937, -1.821_255_978, 1.330_274_429];
    if z < 0.0 {
        return 1.0 - normal(-z);
    }
    let t = 1.0 / (1.0 + 0.231_641_9 * z);
    let tail = TERMS.iter().rev().fold(0.0, |sum, term| (sum + term) * t);
    1.0 - (-z * z / 2.0).exp() / std::f64::consts::TAU.sqrt() * tail
}

/// The z below which a standard normal falls with probability `p`, by halving.
fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-8.0, 8.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if normal(middle) < p { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

#[cfg(test)]
mod tests;
