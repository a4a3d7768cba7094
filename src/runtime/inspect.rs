//! From a photo to a verdict: go, no-go, or cannot inspect.
//!
//! In: a model with its calibration, a photo. Out: [`Verdict`]: what is wrong with which component, where, and how sure.
//! The assembly is located first; then every node of the object tree weighs the good state against each error mode, and the
//! tree explains away what one fault does to its neighbours. Trouble never looks like go.

mod evidence;

use super::calibrate::{Calibration, widened};
use super::camera::{Camera, Vec3};
use super::density::Density;
use super::judge::{Evidence, INDEPENDENT, NodeImages, Prepared};
use super::light::Light;
use super::locate::{Located, Search};
use super::math;
use super::model::{Model, Node};
use super::parts::{Listener, Part, nobody};
use super::photo::{Photo, PhotoError};
use super::pose::Pose;
use super::rise::{self, Lift};
use super::settle::{self, Expected, LEAST_OTHERS};
use super::strange::{self, Square, Unlikeness};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A node of which less is inside the photo cannot be judged.
pub(super) const LEAST_INSIDE: f64 = 0.6;
/// The fault of a part that is found beside its place.
pub const MISPLACED: &str = "misplaced";
/// Below this share of the calibration's score the assembly counts as not found.
const LEAST_SCORE: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decision {
    #[serde(rename = "go")]
    Go,
    #[serde(rename = "no-go")]
    NoGo,
    #[serde(rename = "cannot-inspect")]
    CannotInspect,
}

/// A faulty component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    pub component: String,
    /// `missing`, `not seated`, `misplaced` …
    pub fault: String,
    /// The error tree in which it showed.
    pub error_tree: String,
    /// The node in which it showed.
    pub node: String,
    /// At most such a share of correct assemblies looks as wrong: of held-out good renders where an error mode shows.
    pub p_value: f64,
    /// Box in the photo (px): x0, y0, x1, y1.
    #[serde(rename = "box")]
    pub box_px: [f64; 4],
}

/// One node of the object tree in this photo.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NodeReport {
    pub name: String,
    pub level: u32,
    pub parent: Option<usize>,
    /// Corners of the visible component's box as carried to the photo (px).
    pub outline: [[f64; 2]; 4],
    /// Corners of what is crossed out if the node is faulty (px): its outline, or the square that looks like nothing the model knows.
    pub crossed: [[f64; 2]; 4],
    /// Log-likelihood ratio per coefficient of the good state against the error mode that comes closest, less that mode's
    /// threshold: faulty below zero.
    pub score: f64,
    /// Per hypothesis, log-likelihood ratio of the good state against it, per coefficient, by the image alone: [`rise::weighed`] adds
    /// what the node's place says.
    pub against: Vec<f64>,
    /// The error mode that fits best; what else is wrong where no mode shows.
    pub best_fault: String,
    pub inside: f64,
    /// How unlike its good state the node is (see [`Evidence::unlike`]).
    pub unlike: Unlikeness,
    /// By how many standard deviations that is more than correct assemblies show (see [`strange::weigh`]).
    pub strangeness: f64,
    /// How high the component appears to stand above its place, where that can be told.
    pub lift: Option<Lift>,
    /// By how much the good state fits better beyond where it is looked for: log-likelihood ratio per coefficient.
    pub beyond: f64,
    /// By an error mode, or by what no mode shows; the score is below zero for the first alone.
    pub faulty: bool,
    /// Faulty by itself, but explained by another component's fault.
    pub explained: bool,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    pub decision: Decision,
    /// Why the photo cannot be inspected, or a summary of the findings; empty for go.
    pub reason: String,
    pub pose: Option<Pose>,
    /// Size in the photo relative to nominal.
    pub scale: f64,
    pub locator_score: f64,
    pub findings: Vec<Finding>,
    pub nodes: Vec<NodeReport>,
    /// Corners of the whole assembly's box in the photo (px).
    pub outline: Option<[[f64; 2]; 4]>,
}

/// A model and its calibration, ready to judge photo after photo.
pub struct Inspector<'a> {
    model: Cow<'a, Model>,
    calibration: Cow<'a, Calibration>,
    camera: Camera,
    search: Search,
    prepared: Prepared,
    light: Light,
    densities: Vec<Vec<Density>>,
    /// How unlike their rendered good state the nodes were in the calibration photos, the mean of these.
    calibrated: Vec<Option<Unlikeness>>,
    /// Where calibration expects the nodes; `None` before there is any.
    expected: Option<Vec<Expected>>,
    listener: &'a Listener<'a>,
}

impl<'a> Inspector<'a> {
    /// `None` when the model's camera cannot see its own nodes.
    pub fn new(model: &'a Model, calibration: &'a Calibration) -> Option<Inspector<'a>> {
        Inspector::of(Cow::Borrowed(model), Cow::Borrowed(calibration))
    }

    /// The same, keeping model and calibration for itself.
    pub fn owned(model: Model, calibration: Calibration) -> Option<Inspector<'static>> {
        Inspector::of(Cow::Owned(model), Cow::Owned(calibration))
    }

    fn of<'m>(model: Cow<'m, Model>, calibration: Cow<'m, Calibration>) -> Option<Inspector<'m>> {
        let prepared = Prepared::new(&model)?;
        let light = light(&model, &calibration.lamps);
        let references = |node: usize| calibration.references.iter().map(|r| r.window(node)).collect::<Vec<_>>();
        let densities = |(i, n): (usize, &NodeImages)| n.densities(&light, calibration.noise, &references(i));
        let (densities, unlike): (_, Vec<Vec<Unlikeness>>) = prepared.nodes.iter().enumerate().map(densities).unzip();
        let calibrated = unlike.iter().map(|all| strange::mean(all)).collect();
        let camera = calibration.installation.apply(&model.station.camera);
        let search = Search::new(&model);
        let expected = expected(&model, &calibration);
        let listener = &nobody;
        Some(Inspector {
            model,
            calibration,
            camera,
            search,
            prepared,
            light,
            densities,
            calibrated,
            expected,
            listener,
        })
    }

    /// The same, telling the parts of its work.
    #[must_use]
    pub fn heard_by(self, listener: &'a Listener<'a>) -> Inspector<'a> {
        Inspector { listener, ..self }
    }

    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Per node how unlike its rendered good state it was in the calibration photos; `None` before there is any.
    pub fn calibrated(&self) -> &[Option<Unlikeness>] {
        &self.calibrated
    }

    /// Decodes a photo of the station.
    pub fn photo(&self, bytes: &[u8]) -> Result<Photo, PhotoError> {
        let station = &self.model.station;
        Photo::decode_heard(bytes, station.tone, station.camera.size, self.listener)
    }

    /// Judges one photo.
    pub fn inspect(&self, photo: &Photo) -> Verdict {
        (self.listener)(Part::Light);
        let photo = &*photo.flattened(self.model.station.vignetting);
        let located = self.locate(&self.search, photo);
        let least = self.least_score();
        match located.first() {
            Some(found) if found.score >= least => self.judge(photo, &located),
            found => self.judge_without(photo, least).unwrap_or_else(|| not_found(found.copied(), least)),
        }
    }

    /// The poses of which the edges speak, best first.
    fn locate(&self, search: &Search, photo: &Photo) -> Vec<Located> {
        (self.listener)(Part::Fields);
        let fields = search.fields(&photo.light, self.calibration.noise);
        search.rivals(&fields, &self.camera, &widened(&self.model), self.listener)
    }

    /// The verdict on an assembly that is found only when the edges of one component are not looked for, if that
    /// component proves to be at fault. Never a go.
    fn judge_without(&self, photo: &Photo, least: f64) -> Option<Verdict> {
        let locator = &self.model.locator;
        if locator.unsigned || locator.groups.len() < 2 {
            return None;
        }
        let attempt = |group: usize| -> Option<Verdict> {
            let search = Search::without(&self.model, Some(group));
            let found = self.locate(&search, photo);
            let verdict = (found.first()?.score >= least).then(|| self.judge(photo, &found))?;
            let blamed = verdict.findings.iter().any(|f| f.component == locator.groups[group].name);
            blamed.then_some(verdict)
        };
        let verdicts = (0..locator.groups.len()).filter_map(attempt);
        verdicts.max_by(|a, b| a.locator_score.total_cmp(&b.locator_score))
    }

    /// Where the components themselves locate, a photo of other states than the calibration's scores lower by right.
    fn least_score(&self) -> f64 {
        let locator = &self.model.locator;
        if locator.unsigned { locator.accept } else { locator.accept.max(LEAST_SCORE * self.calibration.score) }
    }

    /// Judges the assembly where it most likely stands, of the poses of which the edges speak.
    fn judge(&self, photo: &Photo, located: &[Located]) -> Verdict {
        let (evidence, found) = self.settled(photo, located);
        (self.listener)(Part::Verdict);
        let mut nodes: Vec<NodeReport> =
            (0..evidence.len()).map(|i| self.report(i, &evidence[i], &found.pose)).collect();
        (self.listener)(Part::Unknown);
        let odd = strange::weigh(&mut nodes, &self.model.nodes, &self.calibrated);
        (self.listener)(Part::Explain);
        let disturbed = self.disturbed(&nodes, photo, &found.pose);
        let order = self.blame(&mut nodes, &evidence, &disturbed);
        (self.listener)(Part::Verdict);
        let of_mode = |&i: &usize| self.finding(i, &nodes[i], p_value(&self.model.nodes[i], nodes[i].score));
        let mut findings: Vec<Finding> = order.iter().map(of_mode).collect();
        let hidden = nodes.iter().position(|n| n.inside < LEAST_INSIDE);
        let asked = findings.is_empty() && hidden.is_none();
        if let Some((i, p_value)) = asked.then(|| mark_beside(&self.model, &mut nodes)).flatten() {
            findings.push(self.finding(i, &nodes[i], p_value));
            let odd = odd[i].filter(|_| nodes[i].best_fault == strange::UNKNOWN);
            nodes[i].crossed = odd.and_then(|s| self.square(i, s, &found.pose)).unwrap_or(nodes[i].outline);
        }
        let (decision, reason) = match (&findings[..], hidden) {
            ([], None) => (Decision::Go, String::new()),
            ([], Some(hidden)) => {
                let node = &nodes[hidden];
                let share = 100.0 * node.inside;
                (Decision::CannotInspect, format!("only {share:.0} % of {} lies inside the photo", node.name))
            }
            (findings, _) => (Decision::NoGo, summary(findings)),
        };
        Verdict {
            decision,
            reason,
            pose: Some(found.pose),
            scale: self.scale(&found.pose),
            locator_score: found.score,
            findings,
            nodes,
            outline: Some(self.outline(&found.pose)),
        }
    }

    fn report(&self, index: usize, evidence: &Evidence, pose: &Pose) -> NodeReport {
        let node = &self.model.nodes[index];
        let against = against(evidence, self.coefficients(index));
        let (fault, score) = score(node, &rise::weighed(node, &against, evidence.lift));
        let outline = self.carried(node.visible, node.plane, pose);
        NodeReport {
            name: node.name.clone(),
            level: node.level,
            parent: node.parent.map(|p| p as usize),
            outline,
            crossed: outline,
            score,
            against,
            best_fault: fault.map_or_else(String::new, |h| node.hypotheses[h].fault.clone()),
            inside: evidence.inside,
            unlike: evidence.unlike.clone(),
            strangeness: 0.0,
            lift: evidence.lift,
            beyond: evidence.beyond / self.coefficients(index).max(1) as f64,
            faulty: shows_mode(score),
            explained: false,
        }
    }

    /// Number of coefficients of a node.
    pub fn coefficients(&self, node: usize) -> usize {
        self.prepared.nodes[node].stencil.len()
    }

    /// Orders the faulty nodes by their evidence and drops those that a stronger fault explains.
    fn blame(&self, nodes: &mut [NodeReport], evidence: &[Evidence], disturbed: &[Vec<f64>]) -> Vec<usize> {
        let mut faulty: Vec<usize> = (0..nodes.len()).filter(|&i| nodes[i].faulty).collect();
        let against = |i: usize| -> f64 {
            let l = &evidence[i].log_likelihoods;
            l[0] - l[1..].iter().copied().fold(f64::NEG_INFINITY, f64::max)
        };
        faulty.sort_by(|&a, &b| against(a).total_cmp(&against(b)).then(a.cmp(&b)));
        let mut blamed: Vec<usize> = Vec::new();
        for i in faulty {
            let by = |&b: &usize| self.explains(b, &nodes[b].best_fault, i, &evidence[i], &disturbed[i]);
            let explained = blamed.iter().any(by);
            nodes[i].explained = explained;
            if !explained {
                blamed.push(i);
            }
        }
        blamed
    }

    /// Whether a fault of one node explains what another shows: it covers most of it, or the other looks rather like its
    /// own good state beside that fault than like any fault of its own.
    pub(super) fn explains(
        &self,
        blamed: usize,
        fault: &str,
        node: usize,
        evidence: &Evidence,
        disturbed: &[f64],
    ) -> bool {
        if self.model.nodes[blamed].disturbs.contains(&(node as u32)) {
            return true;
        }
        let states = self.model.nodes[node].disturbed.iter().zip(disturbed);
        let beside = states.filter(|(d, _)| d.by as usize == blamed && d.fault == fault).map(|(_, l)| *l);
        let own = evidence.log_likelihoods[1..].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        beside.fold(f64::NEG_INFINITY, f64::max) > own
    }

    fn finding(&self, index: usize, report: &NodeReport, p_value: f64) -> Finding {
        let node = &self.model.nodes[index];
        let xs = report.outline.map(|p| p[0]);
        let ys = report.outline.map(|p| p[1]);
        let min = |v: [f64; 4]| v.into_iter().fold(f64::INFINITY, f64::min);
        let max = |v: [f64; 4]| v.into_iter().fold(f64::NEG_INFINITY, f64::max);
        Finding {
            component: node.name.clone(),
            fault: report.best_fault.clone(),
            error_tree: node.name.clone(),
            node: node.name.clone(),
            p_value,
            box_px: [min(xs), min(ys), max(xs), max(ys)],
        }
    }

    /// Corners of a box of the nominal photo as they lie in this one.
    fn carried(&self, [x0, y0, x1, y1]: [f64; 4], plane: f64, pose: &Pose) -> [[f64; 2]; 4] {
        [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|corner| {
            let point = self.on_plane(corner, plane).map(|p| pose.apply(self.prepared.home.invert(p)));
            point.and_then(|p| self.camera.project(p)).unwrap_or(corner)
        })
    }

    /// Corners of a square of a node as they lie in this photo.
    fn square(&self, node: usize, square: Square, pose: &Pose) -> Option<[[f64; 2]; 4]> {
        let NodeImages { window, stencil, .. } = &self.prepared.nodes[node];
        let [x0, y0, x1, y1] = stencil.square(square.scale, square.index)?;
        let frame = window.frame;
        let at = |i: usize, v: usize| (f64::from(frame.origin[i]) + v as f64) * f64::from(frame.factor);
        Some(self.carried([at(0, x0), at(1, y0), at(0, x1), at(1, y1)], frame.plane, pose))
    }

    /// The point at this height (mm, assembly frame) that the nominal photo shows there (px), in the station's frame.
    fn on_plane(&self, at: [f64; 2], plane: f64) -> Option<Vec3> {
        self.model.station.camera.on_plane(at, plane + self.prepared.home.z)
    }

    /// The box round all nodes, turned with the assembly.
    fn outline(&self, pose: &Pose) -> [[f64; 2]; 4] {
        let all = self.model.nodes.iter().map(|n| n.visible);
        let hull = all.reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]);
        let planes = self.model.nodes.iter().map(|n| n.plane);
        let plane = planes.sum::<f64>() / self.model.nodes.len().max(1) as f64;
        self.carried(hull.unwrap_or([0.0; 4]), plane, pose)
    }

    /// Size in the photo relative to the nominal photo: the ratio of distances along the view.
    fn scale(&self, pose: &Pose) -> f64 {
        let nominal = &self.model.station.camera;
        let depth = |camera: &Camera, pose: &Pose| {
            let p = pose.apply([0.0; 3]);
            let d = super::camera::sub(p, camera.position);
            super::camera::dot(camera.axes[2], d)
        };
        depth(nominal, &self.prepared.home) / depth(&self.camera, pose) * self.camera.focal / nominal.focal
    }
}

fn expected(model: &Model, calibration: &Calibration) -> Option<Vec<Expected>> {
    let seen = |i: usize| calibration.references.iter().map(|r| r.shifts[i]).collect::<Vec<_>>();
    let after = |(i, node): (usize, &Node)| settle::after(node, &seen(i));
    (!calibration.references.is_empty()).then(|| model.nodes.iter().enumerate().map(after).collect())
}

/// What is wrong although no node's error mode shows: a part looks as it should beside its place, or like nothing the model knows.
pub fn beside(model: &Model, nodes: &[NodeReport]) -> Option<(usize, &'static str)> {
    elsewhere(model, nodes).map(|i| (i, MISPLACED)).or_else(|| strange::strangest(nodes).map(|i| (i, strange::UNKNOWN)))
}

/// Marks the node in which something is wrong although no error mode shows, if there is one, and says how rarely a correct
/// assembly looks so.
fn mark_beside(model: &Model, nodes: &mut [NodeReport]) -> Option<(usize, f64)> {
    let (index, fault) = beside(model, nodes)?;
    (nodes[index].faulty, nodes[index].best_fault) = (true, fault.into());
    let usual = asked_of_node(model, nodes);
    // Strangeness decides at the share that was asked for, and says no more beyond.
    let p_value = if fault == MISPLACED { chance_beyond(nodes[index].beyond).min(usual) } else { usual };
    Some((index, p_value))
}

/// The share of correct assemblies that may be rejected for one node without an error mode.
fn asked_of_node(model: &Model, nodes: &[NodeReport]) -> f64 {
    model.promise.false_reject_asked / nodes.len().max(1) as f64
}

/// How rarely a part in its place looks so much better beside it (log-likelihood ratio per coefficient). Of renders of correct
/// assemblies none does, so nothing is learnt from them: a likelihood ratio of Λ is at most 1 / Λ as likely, and that holds here
/// for its square root.
fn chance_beyond(beyond: f64) -> f64 {
    math::exp(-beyond * INDEPENDENT / 2.0)
}

/// The node that most surely looks as it should, but beyond the reach of its search. Where many nodes do, or there are few, it may
/// be the pose that is wrong.
fn elsewhere(model: &Model, nodes: &[NodeReport]) -> Option<usize> {
    let together = nodes.iter().filter(|n| n.beyond > 0.0).count();
    if nodes.len() <= LEAST_OTHERS || 2 * together > nodes.len() {
        return None;
    }
    let asked = asked_of_node(model, nodes);
    // The root is where the assembly is.
    let own = |i: &usize| model.nodes[*i].hypotheses.len() > 1 && chance_beyond(nodes[*i].beyond) < asked;
    (0..nodes.len()).filter(own).max_by(|&a, &b| nodes[a].beyond.total_cmp(&nodes[b].beyond))
}

/// Whether a score says that an error mode shows. What is no number is no proof of anything.
pub(super) fn shows_mode(score: f64) -> bool {
    score.is_nan() || score < 0.0
}

/// The light of a station whose lamps were calibrated to these weights.
pub fn light(model: &Model, weights: &[f64]) -> Light {
    Light::new(weights, &model.station.lamps)
}

/// The likeliest error mode beyond its threshold, else the one that comes closest to it, and the least that any mode leaves to
/// its threshold; 0 where there is none.
pub fn score(node: &Node, against: &[f64]) -> (Option<usize>, f64) {
    let left = |h: usize| against[h] - node.hypotheses[h].threshold;
    let modes = || 1..node.hypotheses.len();
    if let Some(unknown) = modes().find(|&h| left(h).is_nan()) {
        return (Some(unknown), f64::NAN);
    }
    let likeliest = modes().filter(|&h| left(h) < 0.0).min_by(|&a, &b| against[a].total_cmp(&against[b]));
    let closest = modes().min_by(|&a, &b| left(a).total_cmp(&left(b)));
    (likeliest.or(closest), closest.map_or(0.0, left))
}

fn against(evidence: &Evidence, coefficients: usize) -> Vec<f64> {
    let l = &evidence.log_likelihoods;
    l.iter().map(|other| (l[0] - other) / coefficients.max(1) as f64).collect()
}

/// (1 + held-out goods that score no higher) / (1 + held-out goods).
fn p_value(node: &Node, score: f64) -> f64 {
    let lower = node.good_scores.iter().filter(|&&s| s <= score).count();
    (1 + lower) as f64 / (1 + node.good_scores.len()) as f64
}

pub(super) fn summary(findings: &[Finding]) -> String {
    let each: Vec<String> = findings.iter().map(|f| format!("{}: {}", f.component, f.fault)).collect();
    each.join(", ")
}

fn not_found(found: Option<Located>, least: f64) -> Verdict {
    let score = found.map_or(0.0, |f| f.score);
    Verdict {
        decision: Decision::CannotInspect,
        reason: format!("E0805: the assembly was not found (score {score:.2}, at least {least:.2})"),
        pose: None,
        scale: 1.0,
        locator_score: score,
        findings: Vec::new(),
        nodes: Vec::new(),
        outline: None,
    }
}

#[cfg(test)]
pub(crate) mod tests;
