//! From shots to a model: node images, their alignment by expectation maximisation, the locator's points.

use super::edges::{self, Ground};
use super::plan::{NodePlan, Plan};
use super::shots::Shot;
use super::stats::rounded;
use super::synthesise::Shots;
use crate::assembly::fault::{ErrorMode, FaultKind, Motion, swept};
use crate::design::model::Design;
use crate::runtime::camera::{Camera, Vec3};
use crate::runtime::grid::Grid;
use crate::runtime::judge::NodeImages;
use crate::runtime::light::Light;
use crate::runtime::locate::EdgePoint;
use crate::runtime::model::{Disturbed, Hypothesis, Image, Lamp, Locator, Node, PointGroup, PointSet};
use crate::runtime::pose::Pose;
use crate::runtime::rise::Rise;
use crate::runtime::row::Row;
use crate::runtime::sight::Reduced;
use crate::runtime::window::{Window, runs_of};
use crate::view::item_buffer::Mask;
use crate::view::nodes::dilate;

/// Quantisation: the ninth decile of a lamp's image has this many steps.
const STEPS_AT_NINTH_DECILE: f64 = 400.0;
/// Rounds of alignment.
const EM_ROUNDS: usize = 2;
/// A sweep is cut into hypotheses of at least this many draws.
const DRAWS_PER_HYPOTHESIS: usize = 7;
/// Points of the locator, fine and coarse.
const FINE_POINTS: usize = 900;
const COARSE_POINTS: usize = 300;
/// With fewer datum points than this the watched components help to locate.
const ENOUGH_DATUM_POINTS: usize = 150;
/// A component's outline lies within this much of its own change (px of the shots).
const OUTLINE: usize = 2;
/// Noise assumed while aligning, share of full scale.
const ALIGN_NOISE: f64 = 0.01;

/// What node training needs besides the shots.
pub struct Context<'a> {
    pub design: &'a Design,
    pub camera: &'a Camera,
    pub home: Pose,
    pub plan: &'a Plan,
    pub modes: &'a [ErrorMode],
    pub shots: &'a Shots,
    /// Lamp powers before calibration, in photo units.
    pub powers: &'a [f64],
    pub lamps: &'a [Lamp],
}

/// The draws of one hypothesis: shots with the shift of the node in each (node px).
struct Sample<'a> {
    /// The node whose fault it is, if not this one's own.
    by: Option<u32>,
    fault: &'static str,
    sweep: String,
    shots: Vec<&'a Shot>,
    shifts: Vec<[f64; 2]>,
}

/// Trains one node.
pub fn node(context: &Context, plan: &NodePlan) -> Option<Node> {
    let window = Window::new(plan.frame, context.camera, &context.home)?;
    let mut samples = samples(context, plan);
    let cutter = Cutter { context, plan, window };
    let mut node = cutter.node(&samples);
    for _ in 0..EM_ROUNDS {
        cutter.align(&node, &mut samples)?;
        node = cutter.node(&samples);
    }
    Some(node)
}

/// The good state, every mode, and the good state beside the faults of others; long sweeps in pieces.
fn samples<'a>(context: &'a Context, plan: &NodePlan) -> Vec<Sample<'a>> {
    let sample = |fault, sweep, shots: Vec<&'a Shot>| Sample {
        by: None,
        fault,
        sweep,
        shifts: vec![[0.0; 2]; shots.len()],
        shots,
    };
    let mut out = vec![sample("good", String::new(), context.shots.good.iter().collect())];
    for &m in &plan.modes {
        let mode = &context.modes[m];
        for (low, high, shots) in pieces(context, m) {
            out.push(sample(mode.kind.word(), sweep(&mode.motion, low, high), shots));
        }
    }
    for &(by, m) in &plan.disturbed {
        let mode = &context.modes[m];
        let shots = pieces(context, m).into_iter().flat_map(|(_, _, shots)| shots).collect();
        out.push(Sample { by: Some(by), ..sample(mode.kind.word(), sweep(&mode.motion, 0.0, 1.0), shots) });
    }
    out
}

/// What part of a sweep a hypothesis covers, for people.
fn sweep(motion: &Motion, low: f64, high: f64) -> String {
    match motion {
        Motion::Slide { from, to, .. } => {
            format!("{:.1} .. {:.1} mm", swept(*from, *to, low), swept(*from, *to, high))
        }
        Motion::Tilt(_) => "one side up".into(),
        _ => String::new(),
    }
}

/// The shots of a mode, in pieces of its sweep: (from, to, shots).
fn pieces<'a>(context: &'a Context, mode: usize) -> Vec<(f64, f64, Vec<&'a Shot>)> {
    let Some(scene) = context.plan.scenes.iter().position(|s| s.contains(&mode)) else { return Vec::new() };
    let place = context.plan.scenes[scene].iter().position(|&m| m == mode).unwrap_or(0);
    let mut all: Vec<(f64, &Shot)> = context.shots.faulty[scene].iter().map(|f| (f.places[place], &f.shot)).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let swept = context.modes[mode].kind == FaultKind::NotSeated;
    let count = if swept { (all.len() / DRAWS_PER_HYPOTHESIS).max(1) } else { 1 };
    let size = all.len().div_ceil(count);
    let bounds = |i: usize| i as f64 / count as f64;
    let piece = |(i, part): (usize, &[(f64, &'a Shot)])| {
        (bounds(i), bounds(i + 1), part.iter().map(|(_, shot)| *shot).collect())
    };
    all.chunks(size.max(1)).enumerate().map(piece).collect()
}

struct Cutter<'a> {
    context: &'a Context<'a>,
    plan: &'a NodePlan,
    window: Window,
}

impl Cutter<'_> {
    /// The node as the model file holds it.
    fn node(&self, samples: &[Sample]) -> Node {
        let cut: Vec<Vec<Vec<Grid>>> = samples.iter().map(|s| self.images(s)).collect();
        let steps: Vec<f64> = (0..self.context.powers.len()).map(|lamp| step(&cut, lamp)).collect();
        let (mut hypotheses, mut disturbed) = (Vec::new(), Vec::new());
        for (sample, draws) in samples.iter().zip(&cut) {
            let images = quantised(draws, &steps);
            let fault = sample.fault.into();
            match sample.by {
                None => hypotheses.push(Hypothesis { fault, sweep: sample.sweep.clone(), threshold: 0.0, images }),
                Some(by) => disturbed.push(Disturbed { by, fault, images }),
            }
        }
        let (plan, frame) = (self.plan, self.plan.frame);
        Node {
            name: self.context.design.components[plan.component].name.clone(),
            parent: None,
            level: 1,
            plane: frame.plane,
            factor: frame.factor,
            levels: self.context.design.train.levels,
            origin: frame.origin,
            size: frame.size,
            visible: plan.visible,
            mask: runs_of(&plan.mask),
            spread: plan.spread,
            disturbs: plan.disturbs.clone(),
            usual: Vec::new(),
            rise: self.rise(),
            good_scores: Vec::new(),
            fault_scores: Vec::new(),
            hypotheses,
            disturbed,
            steps,
        }
    }

    /// The way out of the seat that the component may have stopped short on.
    fn rise(&self) -> Option<Rise> {
        let (context, plan) = (self.context, self.plan);
        let direction = plan.modes.iter().find_map(|&m| match context.modes[m].motion {
            Motion::Slide { direction, .. } => Some(direction),
            _ => None,
        })?;
        let [x0, y0, x1, y1] = plan.visible;
        let middle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0];
        let at = context.home.invert(context.camera.on_plane(middle, plan.frame.plane + context.home.z)?);
        // Measured with held-out renders.
        Some(Rise { direction, at: at.map(rounded), shown: None })
    }

    /// The node's window in every shot and lamp of a sample.
    fn images(&self, sample: &Sample) -> Vec<Vec<Grid>> {
        let factor = (self.plan.frame.factor / self.context.plan.base) as usize;
        let of = |(shot, shift): (&&Shot, &[f64; 2])| {
            let placed = self.window.place(self.context.camera, &shot.pose);
            shot.lamps.iter().map(|lamp| self.window.cut(&lamp.reduced(factor), &placed, *shift)).collect()
        };
        sample.shots.iter().zip(&sample.shifts).map(of).collect()
    }

    /// One round of expectation maximisation with the search in the loop: every draw moves to its most likely place.
    fn align(&self, node: &Node, samples: &mut [Sample]) -> Option<()> {
        let context = self.context;
        let images = NodeImages::new(node, context.camera, &context.home, context.powers.len(), true)?;
        let powers = Light::new(context.powers, context.lamps);
        let densities = images.densities(&powers, ALIGN_NOISE, &[]).0;
        let factor = (self.plan.frame.factor / context.plan.base) as usize;
        for (sample, density) in samples.iter_mut().zip(&densities) {
            for (shot, shift) in sample.shots.iter().zip(&mut sample.shifts) {
                let mut light = shot.lit(context.powers).reduced(factor);
                light.values.iter_mut().for_each(|v| *v = v.min(1.0));
                *shift = images.best_shift(density, &powers, &Reduced::new(light), context.camera, &shot.pose);
            }
        }
        Some(())
    }
}

/// Radiance of one integer step for a lamp.
fn step(cut: &[Vec<Vec<Grid>>], lamp: usize) -> f64 {
    let mut values: Vec<f32> = cut.iter().flatten().flat_map(|draw| draw[lamp].values.iter().copied()).collect();
    values.sort_by(f32::total_cmp);
    let decile = values.get(values.len() * 9 / 10).copied().unwrap_or(0.0);
    (f64::from(decile) / STEPS_AT_NINTH_DECILE).max(1e-9)
}

fn quantised(draws: &[Vec<Grid>], steps: &[f64]) -> Vec<Image> {
    let row = |row: &[f32], step: f64| -> Row {
        Row(row.iter().map(|&v| (f64::from(v) / step).round().clamp(0.0, f64::from(u16::MAX)) as u16).collect())
    };
    let mut out = Vec::new();
    for (draw, lamps) in draws.iter().enumerate() {
        for (lamp, grid) in lamps.iter().enumerate() {
            let rows = grid.values.chunks(grid.width).map(|r| row(r, steps[lamp])).collect();
            out.push(Image { draw: draw as u32, lamp: lamp as u32, rows });
        }
    }
    out
}

/// The locator: points on what no misplaced part takes along or hides. Where those show too few edges, the watched
/// components' own in every state, and of those the light may decide which side is the brighter: a bare part is darker
/// than its ground in one room and brighter in the next.
pub fn locator(context: &Context) -> Locator {
    let plan = context.plan;
    let good: Vec<&Shot> = context.shots.good.iter().collect();
    let on_datum = |x: usize, y: usize| plan.datum[nearest(context, x, y)?].then_some(());
    let found = points(context, &good, "good", &on_datum, 1.0, None, false);
    let unsigned = found.fine.len() < ENOUGH_DATUM_POINTS;
    let mut groups = if unsigned {
        plan.nodes.iter().filter(|n| !n.modes.is_empty()).map(|node| component_group(context, node)).collect()
    } else {
        by_component(context, &found)
    };
    groups.retain(|g| g.alternatives.iter().any(|a| !a.fine.is_empty()));
    Locator { coarse: plan.base * 2, fine: plan.base, unsigned, groups, accept: 0.0 }
}

/// Points of the good state, a group per component they lie on: where one is missing, the others still tell the place.
fn by_component(context: &Context, all: &PointSet) -> Vec<PointGroup> {
    let camera = context.camera.reduced(context.plan.base);
    let component = |row: &[i32; 6]| -> Option<usize> {
        let at = [0, 1, 2].map(|i| f64::from(row[i]) * 1e-3);
        let [x, y] = camera.project(context.home.apply(at))?.map(|v| v.round().max(0.0) as usize);
        component_near(context, x, y)
    };
    let of = |rows: &[[i32; 6]], c: usize| rows.iter().copied().filter(|row| component(row) == Some(c)).collect();
    let group = |c: usize| {
        let points = PointSet { fault: all.fault.clone(), coarse: of(&all.coarse, c), fine: of(&all.fine, c) };
        PointGroup { name: context.design.components[c].name.clone(), alternatives: vec![points] }
    };
    (0..context.design.components.len()).map(group).collect()
}

/// A component's edges in its good state and where it is missing.
fn component_group(context: &Context, node: &NodePlan) -> PointGroup {
    let wide = dilate(&node.changed, OUTLINE);
    let inside =
        |x: usize, y: usize| (x < wide.width && y < wide.height && wide.bits[y * wide.width + x]).then_some(());
    let share = 1.0 / context.plan.nodes.len() as f64;
    let good: Vec<&Shot> = context.shots.good.iter().collect();
    let mut alternatives = vec![points(context, &good, "good", &inside, share, None, true)];
    for &m in node.modes.iter().filter(|&&m| context.modes[m].kind == FaultKind::Missing) {
        for (_, _, shots) in pieces(context, m) {
            let below = ground_height(context, &wide);
            alternatives.push(points(context, &shots, "missing", &inside, share, below, true));
        }
    }
    PointGroup { name: context.design.components[node.component].name.clone(), alternatives }
}

/// Middle height (mm, station frame) of what surrounds a mask: there the edges lie that a missing component bares.
fn ground_height(context: &Context, mask: &Mask) -> Option<f64> {
    let camera = context.camera.reduced(context.plan.base);
    let around = dilate(mask, OUTLINE);
    let beside = (0..mask.bits.len()).filter(|&i| around.bits[i] && !mask.bits[i]);
    let point = |i: usize| context.plan.good.point([i % mask.width, i / mask.width], &camera);
    let mut heights: Vec<f64> = beside.filter_map(point).map(|p| p[2]).collect();
    heights.sort_by(f64::total_cmp);
    heights.get(heights.len() / 2).copied()
}

/// Fine and coarse points where `admitted` (px of the shots) says so; at `height` (mm, station frame) instead
/// of on the good assembly's surface, if given.
fn points(
    context: &Context,
    shots: &[&Shot],
    fault: &str,
    admitted: &dyn Fn(usize, usize) -> Option<()>,
    share: f64,
    height: Option<f64>,
    unsigned: bool,
) -> PointSet {
    let base = context.plan.base;
    let rows = |factor: u32, count: usize| -> Vec<[i32; 6]> {
        let ground = Ground {
            shots,
            camera: *context.camera,
            home: context.home,
            factor,
            base,
            powers: context.powers,
            seed: context.design.train.seed,
            unsigned,
        };
        let by = (factor / base) as usize;
        let surface = |x: usize, y: usize| {
            admitted(x * by, y * by)?;
            let Some(z) = height else { return surface_point(context, x * by, y * by) };
            let at = [x, y].map(|v| (v as u32 * factor) as f64);
            context.camera.on_plane(at, z).map(|p| context.home.invert(p))
        };
        let count = (count as f64 * share).ceil() as usize;
        edges::find(&ground, &surface, count).into_iter().map(EdgePoint::to_row).collect()
    };
    PointSet { fault: fault.into(), coarse: rows(base * 2, COARSE_POINTS), fine: rows(base, FINE_POINTS) }
}

/// The nearest of the four pixels that meet at a corner (px of the shots) with its depth.
fn nearest(context: &Context, x: usize, y: usize) -> Option<usize> {
    let good = &context.plan.good;
    if x == 0 || y == 0 || x >= good.width || y >= good.height {
        return None;
    }
    let corner = [(x - 1, y - 1), (x, y - 1), (x - 1, y), (x, y)].map(|(i, j)| j * good.width + i);
    corner.into_iter().filter(|&i| good.id[i] != 0).min_by(|&a, &b| good.depth[a].total_cmp(&good.depth[b]))
}

fn component_near(context: &Context, x: usize, y: usize) -> Option<usize> {
    nearest(context, x, y).map(|i| context.plan.good.id[i] as usize - 1)
}

fn surface_point(context: &Context, x: usize, y: usize) -> Option<Vec3> {
    let good = &context.plan.good;
    let index = nearest(context, x, y)?;
    let camera = context.camera.reduced(context.plan.base);
    let point = good.point([index % good.width, index / good.width], &camera)?;
    Some(context.home.invert(point))
}
