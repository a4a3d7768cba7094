//! What to render and where to look: the nodes of the object tree and the scenes that teach them.
//!
//! In: error modes, the nominal view. Out: a node per watched component whose errors show, with its frame and mask, and
//! the error modes gathered into scenes. A node's mask is where the component itself comes, goes or moves in the item buffer
//! under any of its error modes: what no fault of it can touch has no say, and what moves with it has a node of its own.

use super::shots::Drawn;
use crate::assembly::fault::{ErrorMode, Motion};
use crate::assembly::liaison::Liaison;
use crate::design::model::{Design, Expr};
use crate::runtime::camera::Camera;
use crate::runtime::settle::POSE_RESIDUAL;
use crate::runtime::window::Frame;
use crate::scene::build::bodies;
use crate::view::item_buffer::{ItemBuffer, Mask, PixelBox};
use crate::view::nodes::{change_mask, dilate};
use nalgebra::Vector3;
use std::collections::{BTreeMap, BTreeSet};

/// Places in a sweep at which the change of the image is looked at.
const LOOKS: [f64; 3] = [0.05, 0.5, 0.95];
/// A change is widened by this much (px of the shots): shadows, reflections and the sensor's point spread.
const WIDEN: usize = 2;
/// Fewer changed pixels than this (px of the shots) cannot be judged.
const LEAST_PIXELS: usize = 8;
/// A component that shows in fewer changed pixels than this (px of the shots) is told by what else its faults change.
const LEAST_OWN: usize = 100;
/// A node has at most this many pixels in its mask, and this many times as many in its window; larger ones are taken at a
/// coarser resolution. What shows through windows only is sparse: its mask is small in a large window.
const MOST_NODE_PIXELS: u32 = 12_000;
const SPARSE: u32 = 2;
/// A component disturbs a node when its own change covers this share of the node's.
const DISTURBS: f64 = 0.3;
/// A fault shows in another's node when its change covers this share of the node's.
const TOUCHES: f64 = 0.03;
/// A misplaced part hides a component of which it changes more than this share.
const HIDES: f64 = 0.5;
/// The smallest watched component should have this many px of the shots across.
const SMALLEST_ACROSS: u32 = 8;
/// Coarsest resolution of the shots.
const COARSEST: u32 = 4;
/// As long as the assembly's box has no more px of the shots than this, finer ones cost little and show smaller faults.
const AFFORDABLE: u32 = 80_000;

/// The component that everything stands on.
const ROOT: usize = 0;

/// One node to be trained.
pub struct NodePlan {
    pub component: usize,
    pub frame: Frame,
    /// In node px.
    pub mask: Vec<Vec<bool>>,
    /// Box of the visible component in the nominal photo (px).
    pub visible: [f64; 4],
    /// Error modes that show here.
    pub modes: Vec<usize>,
    /// Where the component itself changes the image under any of them (px of the shots); all that they change where that is too little.
    pub changed: Mask,
    /// All that they change.
    reach: Mask,
    /// Standard deviation of the node's shift along x and y of the photo (px).
    pub spread: [f64; 2],
    /// Nodes whose image this one's faults disturb.
    pub disturbs: Vec<u32>,
    /// Nodes and error modes of other components that change what this node shows in its good state.
    pub disturbed: Vec<(u32, usize)>,
}

pub struct Plan {
    /// px of the photo per px of the shots.
    pub base: u32,
    /// The nominal view at the resolution of the shots.
    pub good: ItemBuffer,
    pub nodes: Vec<NodePlan>,
    /// Per faulty scene the modes shown in it: their changes do not meet.
    pub scenes: Vec<Vec<usize>>,
    /// Modes that change next to nothing in the image.
    pub unseen: Vec<usize>,
    /// Per px of the shots: no misplaced part carries or covers the component seen there, itself or one it touches, so it may serve to locate the
    /// assembly. A part that is missing or stands too high does not mislead: its edges are few among many.
    pub datum: Vec<bool>,
}

/// Plans nodes and scenes for the watched components.
pub fn plan(design: &Design, camera: &Camera, nominal: &Drawn, liaison: &Liaison, modes: &[ErrorMode]) -> Plan {
    let draft = draft(design, camera, nominal, modes);
    let scenes = gather(modes, &[&draft.changes]);
    let mut plan = finished(design, camera, nominal, liaison, modes, draft, &scenes);
    if design.inspect.root {
        plan.nodes.extend(ground(design, camera, nominal, &plan));
    }
    plan
}

/// The root's node: what shows of it beside the other nodes. It has no error modes, but something may lie on it.
fn ground(design: &Design, camera: &Camera, nominal: &Drawn, plan: &Plan) -> Option<NodePlan> {
    let reach = plan.nodes.iter().map(|node| node.reach.clone()).reduce(united)?;
    let own = plan.good.mask(ROOT);
    // Not where the root ends: beyond it the floor shows, and what stands on it casts its shadow.
    let not_own = Mask { bits: own.bits.iter().map(|own| !own).collect(), ..own };
    let beside = dilate(&united(not_own, reach.clone()), 2 * WIDEN);
    let changed = Mask { bits: beside.bits.iter().map(|beside| !beside).collect(), ..reach };
    if changed.count() < LEAST_OWN {
        return None;
    }
    let view = View { drawn: nominal, camera: &camera.reduced(plan.base), good: plan.good.clone() };
    let none = Mask { bits: vec![false; changed.bits.len()], ..changed };
    let area = NodeArea { component: ROOT, modes: Vec::new(), changed, reach: none };
    node(design, camera, &view, plan.base, area)
}

/// Plans for several cameras that look at the same assemblies: the scenes are common to all, so that in each of them every
/// camera takes its photo of the same faults. A scene of a plan may show modes that its camera does not see.
pub fn together(
    design: &Design,
    cameras: &[Camera],
    nominal: &Drawn,
    liaison: &Liaison,
    modes: &[ErrorMode],
) -> Vec<Plan> {
    let drafts: Vec<Draft> = cameras.iter().map(|camera| draft(design, camera, nominal, modes)).collect();
    let scenes = gather(modes, &drafts.iter().map(|d| d.changes.as_slice()).collect::<Vec<_>>());
    let finish = |(camera, draft): (&Camera, Draft)| finished(design, camera, nominal, liaison, modes, draft, &scenes);
    cameras.iter().zip(drafts).map(finish).collect()
}

/// What one camera sees, before it is known which modes are shown together.
struct Draft {
    base: u32,
    good: ItemBuffer,
    /// Per mode, where the image changes; `None` where next to nothing does, or nobody watches.
    changes: Vec<Option<Mask>>,
    /// The part of it in which the mode's own component shows, before or after.
    own: Vec<Option<Mask>>,
    unseen: Vec<usize>,
}

fn draft(design: &Design, camera: &Camera, nominal: &Drawn, modes: &[ErrorMode]) -> Draft {
    let base = resolution(design, camera, nominal);
    let small = camera.reduced(base);
    let view = View { drawn: nominal, camera: &small, good: seen(nominal, &[], &small) };
    let watched = |component: usize| design.inspect.watch.iter().any(|w| w.component == component);
    let (mut changes, mut own) = (Vec::new(), Vec::new());
    for mode in modes {
        let changed = watched(mode.component).then(|| view.changed(mode));
        let (all, of_component) = changed.filter(|(all, _)| all.count() >= LEAST_PIXELS).unzip();
        changes.push(all);
        own.push(of_component);
    }
    let unseen = (0..modes.len()).filter(|&m| watched(modes[m].component) && changes[m].is_none()).collect();
    Draft { base, good: view.good, changes, own, unseen }
}

fn finished(
    design: &Design,
    camera: &Camera,
    nominal: &Drawn,
    liaison: &Liaison,
    modes: &[ErrorMode],
    Draft { base, good, changes, own, unseen }: Draft,
    scenes: &[Vec<usize>],
) -> Plan {
    let small = camera.reduced(base);
    let view = View { drawn: nominal, camera: &small, good };
    let mut nodes: Vec<NodePlan> = (0..design.components.len())
        .filter_map(|component| {
            let shown: Vec<usize> =
                (0..modes.len()).filter(|&m| modes[m].component == component && changes[m].is_some()).collect();
            let all = |masks: &[Option<Mask>]| shown.iter().filter_map(|&m| masks[m].clone()).reduce(united);
            let reach = all(&changes)?;
            let changed = all(&own).filter(|own| own.count() >= LEAST_OWN).unwrap_or_else(|| reach.clone());
            node(design, camera, &view, base, NodeArea { component, modes: shown, changed, reach })
        })
        .collect();
    link(&mut nodes);
    disturb(&mut nodes, scenes, &changes);
    let datum = datum(&view.good, liaison, modes, &changes);
    Plan { base, good: view.good, nodes, scenes: scenes.to_vec(), unseen, datum }
}

/// See [`Plan::datum`].
fn datum(good: &ItemBuffer, liaison: &Liaison, modes: &[ErrorMode], changes: &[Option<Mask>]) -> Vec<bool> {
    // A part in another seat stays where it is: it does not mislead.
    let misplaced = || (0..modes.len()).filter(|&m| matches!(&modes[m].motion, Motion::Turn(turn) if !turn.seated));
    let hidden = |id: u32, change: &Mask| {
        let own = || (0..good.id.len()).filter(|&i| good.id[i] == id);
        own().filter(|&i| change.bits[i]).count() as f64 > HIDES * own().count() as f64
    };
    // What does not touch the misplaced part shows through or beside it, wherever that lies.
    let near = |m: usize, id: u32| {
        let (of, component) = (modes[m].component, id as usize - 1);
        component == of || liaison.neighbours(of).contains(&component)
    };
    let carried = |m: usize, id: u32| near(m, id) && changes[m].as_ref().is_some_and(|change| hidden(id, change));
    let firm = |id: u32| id != 0 && !misplaced().any(|m| carried(m, id));
    let components: BTreeMap<u32, bool> =
        good.id.iter().copied().collect::<BTreeSet<u32>>().into_iter().map(|id| (id, firm(id))).collect();
    good.id.iter().map(|id| components[id]).collect()
}

struct View<'a> {
    drawn: &'a Drawn,
    camera: &'a Camera,
    good: ItemBuffer,
}

impl View<'_> {
    /// Where the image changes under a mode, over its sweep, and the part of it in which its component shows.
    fn changed(&self, mode: &ErrorMode) -> (Mask, Mask) {
        let (width, height) = (self.good.width, self.good.height);
        let none = Mask { width, height, bits: vec![false; width * height] };
        let (mut all, mut own) = (none.clone(), none);
        let id = mode.component as u32 + 1;
        for u in mode.looks(&LOOKS) {
            let faulty = seen(self.drawn, &[(mode, u)], self.camera);
            for (i, change) in change_mask(&self.good, &faulty).bits.into_iter().enumerate() {
                all.bits[i] |= change;
                own.bits[i] |= change && (self.good.id[i] == id || faulty.id[i] == id);
            }
        }
        (all, own)
    }
}

fn seen(drawn: &Drawn, faults: &[(&ErrorMode, [f64; 3])], camera: &Camera) -> ItemBuffer {
    ItemBuffer::of(&bodies(&drawn.instance(faults), drawn.standing.to_array()), camera)
}

/// The finest resolution that is affordable, or a finer one at which the smallest watched component has enough pixels across.
fn resolution(design: &Design, camera: &Camera, nominal: &Drawn) -> u32 {
    let full = seen(nominal, &[], camera);
    let across = |w: &crate::design::model::Watch| full.bbox(w.component).map(|b| (b.x1 - b.x0).min(b.y1 - b.y0));
    let smallest = design.inspect.watch.iter().filter_map(across).filter(|&a| a >= SMALLEST_ACROSS).min();
    let boxes = (0..design.components.len()).filter_map(|c| full.bbox(c));
    let hull = boxes.reduce(|a, b| a.around(&b));
    let area = hull.map_or(0, |b| (b.x1 - b.x0) * (b.y1 - b.y0));
    let mut base = 1;
    while base < COARSEST
        && area / (base * base) > AFFORDABLE
        && smallest.is_some_and(|s| s / (base * 2) >= SMALLEST_ACROSS)
    {
        base *= 2;
    }
    base
}

/// Where a component's error modes show.
struct NodeArea {
    component: usize,
    modes: Vec<usize>,
    changed: Mask,
    reach: Mask,
}

fn node(design: &Design, camera: &Camera, view: &View, base: u32, area: NodeArea) -> Option<NodePlan> {
    let NodeArea { component, modes, changed, reach } = area;
    let wide = dilate(&changed, WIDEN);
    let area = wide.bbox()?;
    let factor = factor(&area, wide.count() as u32, base);
    let (frame, mask) = framed(&wide, &area, base, factor, plane(view, component, &changed));
    let shown = view.good.bbox(component).or_else(|| changed.bbox())?;
    let visible = [shown.x0, shown.y0, shown.x1, shown.y1].map(|v| f64::from(v * base));
    let spread = spread(component, design, camera, view.drawn);
    Some(NodePlan {
        component,
        frame,
        mask,
        visible,
        modes,
        changed,
        reach,
        spread,
        disturbs: Vec::new(),
        disturbed: Vec::new(),
    })
}

/// px of the photo per px of the node.
fn factor(area: &PixelBox, count: u32, base: u32) -> u32 {
    let mut factor = base;
    let window = (area.x1 - area.x0) * (area.y1 - area.y0);
    while count.max(window / SPARSE) * base * base / (factor * factor) > MOST_NODE_PIXELS {
        factor *= 2;
    }
    factor
}

/// Frame and mask in node px, from a mask in px of the shots. One node px of margin holds the Haar cells of the border.
fn framed(wide: &Mask, area: &PixelBox, base: u32, factor: u32, plane: f64) -> (Frame, Vec<Vec<bool>>) {
    const BORDER: u32 = 2;
    let by = factor / base;
    let low = [area.x0 / by, area.y0 / by];
    let high = [area.x1.div_ceil(by), area.y1.div_ceil(by)];
    let size = [0, 1].map(|i| high[i] - low[i] + 2 * BORDER);
    let origin = [0, 1].map(|i| low[i] as i32 - BORDER as i32);
    let set = |x: u32, y: u32| -> bool {
        let Some((x, y)) = (x + low[0]).checked_sub(BORDER).zip((y + low[1]).checked_sub(BORDER)) else { return false };
        (y * by..(y + 1) * by).any(|j| (x * by..(x + 1) * by).any(|i| bit(wide, i as usize, j as usize)))
    };
    let mask = (0..size[1]).map(|y| (0..size[0]).map(|x| set(x, y)).collect()).collect();
    (Frame { plane, factor, origin, size }, mask)
}

fn bit(mask: &Mask, x: usize, y: usize) -> bool {
    x < mask.width && y < mask.height && mask.bits[y * mask.width + x]
}

/// Height of the node's plane: the middle height of the component's visible surface, or of what shows in its place (mm,
/// assembly frame).
fn plane(view: &View, component: usize, changed: &Mask) -> f64 {
    let heights = |mask: &Mask| -> Vec<f64> {
        let pixels = (0..mask.bits.len()).filter(|&i| mask.bits[i]);
        let point = |i: usize| view.good.point([i % mask.width, i / mask.width], view.camera);
        pixels.filter_map(point).map(|p| view.drawn.standing.invert(p)[2]).collect()
    };
    let own = heights(&view.good.mask(component));
    let mut all = if own.is_empty() { heights(changed) } else { own };
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// Standard deviation of the component's place in the photo (px): its zone along x, y and z as seen, its parents' too,
/// and what the pose leaves.
fn spread(component: usize, design: &Design, camera: &Camera, drawn: &Drawn) -> [f64; 2] {
    let values = design.nominal();
    let at = drawn.poses[component].translation.vector;
    let seen = |by: Vector3<f64>| camera.project(drawn.standing.apply((at + by).into()));
    let mut variance = [POSE_RESIDUAL * POSE_RESIDUAL; 2];
    for index in std::iter::successors(Some(component), |&i| design.components[i].parent) {
        let placed = &design.components[index].pose;
        // The axes of a zone are those of the frame on which the component is placed.
        let frame = drawn.poses[index].rotation * placed.eval(&values).rotation.inverse();
        for (axis, half) in placed.t.iter().map(|axis| half_zone(axis, design)).enumerate() {
            let by = frame * Vector3::ith(axis, half);
            if let (Some(a), Some(b)) = (seen(-by), seen(by)) {
                // A uniform error within ± h has the variance h² / 3.
                (0..2).for_each(|k| variance[k] += ((b[k] - a[k]) / 2.0).powi(2) / 3.0);
            }
        }
    }
    variance.map(f64::sqrt)
}

fn half_zone(axis: &Expr, design: &Design) -> f64 {
    match axis {
        Expr::Dim(id) => design.dims[id.0 as usize].range.half_width(),
        _ => 0.0,
    }
}

/// Notes which nodes lie where another's faults change the image.
fn link(nodes: &mut [NodePlan]) {
    let covers = |a: &NodePlan, b: &NodePlan| {
        let common = a.reach.bits.iter().zip(&b.changed.bits).filter(|(a, b)| **a && **b).count();
        common as f64 >= DISTURBS * b.changed.count() as f64
    };
    for i in 0..nodes.len() {
        let disturbed = (0..nodes.len()).filter(|&j| j != i && covers(&nodes[i], &nodes[j]));
        nodes[i].disturbs = disturbed.map(|j| j as u32).collect();
    }
}

/// Notes which error modes of other components show in a node, where a scene shows them alone.
fn disturb(nodes: &mut [NodePlan], scenes: &[Vec<usize>], changes: &[Option<Mask>]) {
    let mut found = vec![Vec::new(); nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        let least = (TOUCHES * node.changed.count() as f64).max(LEAST_PIXELS as f64);
        let touches = |m: usize| {
            let change = changes[m].as_ref();
            change.is_some_and(|c| {
                c.bits.iter().zip(&node.changed.bits).filter(|(a, b)| **a && **b).count() as f64 >= least
            })
        };
        for scene in scenes {
            let touching: Vec<usize> = scene.iter().copied().filter(|&m| touches(m)).collect();
            if let [alone] = touching[..] {
                let by = nodes.iter().position(|other| other.modes.contains(&alone)).filter(|&by| by != index);
                // What is covered for the most part is explained without being looked at.
                let by = by.filter(|&by| !nodes[by].disturbs.contains(&(index as u32)));
                found[index].extend(by.map(|by| (by as u32, alone)));
            }
        }
    }
    nodes.iter_mut().zip(found).for_each(|(node, disturbed)| node.disturbed = disturbed);
}

/// Puts every visible mode into the first scene in which, in any camera, it changes nothing in another's node and no other
/// changes anything in its own. A node is where any mode of its component shows: a neighbour's fault there would be learnt
/// as part of this one's.
fn gather(modes: &[ErrorMode], cameras: &[&[Option<Mask>]]) -> Vec<Vec<usize>> {
    let mut scenes: Vec<Scene> = Vec::new();
    for (m, mode) in modes.iter().enumerate() {
        let wide = |change: &Option<Mask>| change.as_ref().map(|mask| dilate(mask, 2 * WIDEN));
        let changes: Vec<Option<Mask>> = cameras.iter().map(|all| wide(&all[m])).collect();
        if changes.iter().all(Option::is_none) {
            continue;
        }
        let of_component: Vec<usize> = (0..modes.len()).filter(|&o| modes[o].component == mode.component).collect();
        let area = |all: &&[Option<Mask>]| of_component.iter().filter_map(|&o| all[o].clone()).reduce(united);
        let areas: Vec<Option<Mask>> = cameras.iter().map(area).collect();
        let alone = |s: &Scene| s.taken.iter().all(|&t| modes[t].component != mode.component);
        let fits = |s: &Scene| alone(s) && !any_meet(&s.changes, &areas) && !any_meet(&s.areas, &changes);
        let unite = |old: &mut Vec<Option<Mask>>, new: Vec<Option<Mask>>| {
            let pairs = std::mem::take(old).into_iter().zip(new);
            *old = pairs.map(|(old, new)| old.into_iter().chain(new).reduce(united)).collect();
        };
        match scenes.iter_mut().find(|s| fits(s)) {
            Some(scene) => {
                scene.taken.push(m);
                unite(&mut scene.changes, changes);
                unite(&mut scene.areas, areas);
            }
            None => scenes.push(Scene { taken: vec![m], changes, areas }),
        }
    }
    scenes.into_iter().map(|scene| scene.taken).collect()
}

/// Modes shown together, with what they change (widened) and the nodes of their components, per camera.
struct Scene {
    taken: Vec<usize>,
    changes: Vec<Option<Mask>>,
    areas: Vec<Option<Mask>>,
}

fn any_meet(some: &[Option<Mask>], others: &[Option<Mask>]) -> bool {
    let pairs = some.iter().zip(others).filter_map(|(a, b)| a.as_ref().zip(b.as_ref()));
    pairs.into_iter().any(|(a, b)| a.bits.iter().zip(&b.bits).any(|(a, b)| *a && *b))
}

fn united(mut one: Mask, other: Mask) -> Mask {
    one.bits.iter_mut().zip(&other.bits).for_each(|(a, b)| *a |= b);
    one
}

#[cfg(test)]
mod tests;
