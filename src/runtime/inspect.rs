//! From a photo to a verdict: go, no-go, or cannot inspect.
//!
//! In: a model with its calibration, a photo. Out: [`Verdict`]: what is wrong with which component, where, and how sure.
//! The assembly is located first; then every node of the object tree weighs the good state against each error mode, and the
//! tree explains away what one fault does to its neighbours. Trouble never looks like go.

use super::calibrate::{Calibration, widened};
use super::camera::Camera;
use super::density::Density;
use super::judge::{Evidence, Prepared, fit_lamps};
use super::locate::{Located, Search};
use super::model::{Model, Node};
use super::photo::Photo;
use super::pose::Pose;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A node of which less is inside the photo cannot be judged.
const LEAST_INSIDE: f64 = 0.6;
/// Lamps that drift by more than this share are weighed anew in every photo.
const RELIGHT: f64 = 0.3;
/// Weight of the calibrated light against one photo's own, where the lamps drift that much.
const RELIGHT_PULL: f64 = 0.02;
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    pub component: String,
    /// `missing`, `not seated`, `misplaced` …
    pub fault: String,
    /// The error tree in which it showed.
    pub error_tree: String,
    /// The node in which it showed.
    pub node: String,
    /// Share of held-out good renders that score as low.
    pub p_value: f64,
    /// Box in the photo (px): x0, y0, x1, y1.
    #[serde(rename = "box")]
    pub box_px: [f64; 4],
}

/// One node of the object tree in this photo.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeReport {
    pub name: String,
    pub level: u32,
    pub parent: Option<usize>,
    /// Corners of the visible component's box as carried to the photo (px).
    pub outline: [[f64; 2]; 4],
    /// Log-likelihood ratio of the good state against the best error mode, per coefficient.
    pub score: f64,
    pub threshold: f64,
    /// Per hypothesis, log-likelihood ratio of the good state against it, per coefficient.
    pub against: Vec<f64>,
    /// The error mode that fits best.
    pub best_fault: String,
    pub inside: f64,
    pub faulty: bool,
    /// Faulty by itself, but explained by another component's fault.
    pub explained: bool,
}

#[derive(Debug, Clone, PartialEq)]
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
    densities: Vec<Vec<Density>>,
    relight: bool,
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
        let drift = drifts(&model);
        let relight = drift.iter().any(|&d| d > RELIGHT);
        let densities =
            |weights: &[f64]| prepared.nodes.iter().map(|n| n.densities(weights, &drift, calibration.noise)).collect();
        let densities = densities(&calibration.lamps);
        let camera = calibration.installation.apply(&model.station.camera);
        let search = Search::new(&model.locator);
        Some(Inspector { model, calibration, camera, search, prepared, densities, relight })
    }

    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Judges one photo.
    pub fn inspect(&self, photo: &Photo) -> Verdict {
        let fields = self.search.fields(&photo.light, self.calibration.noise);
        let located = self.search.locate(&fields, &self.camera, &widened(&self.model));
        let least = self.least_score();
        match located {
            Some(found) if found.score >= least => self.judge(photo, found),
            found => not_found(found, least),
        }
    }

    /// Where the components themselves locate, a photo of other states than the calibration's scores lower by right.
    fn least_score(&self) -> f64 {
        let locator = &self.model.locator;
        if locator.unsigned { locator.accept } else { locator.accept.max(LEAST_SCORE * self.calibration.score) }
    }

    fn judge(&self, photo: &Photo, found: Located) -> Verdict {
        let evidence = self.evidence(photo, &found.pose);
        let mut nodes: Vec<NodeReport> =
            (0..evidence.len()).map(|i| self.report(i, &evidence[i], &found.pose)).collect();
        let order = self.blame(&mut nodes, &evidence);
        let findings: Vec<Finding> = order.iter().map(|&i| self.finding(i, &nodes[i])).collect();
        let hidden = nodes.iter().find(|n| n.inside < LEAST_INSIDE);
        let (decision, reason) = match (&findings[..], hidden) {
            ([], None) => (Decision::Go, String::new()),
            ([], Some(node)) => {
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

    /// Log-likelihoods of all nodes, under the calibrated light or, where lamps drift far, this photo's own.
    pub fn evidence(&self, photo: &Photo, pose: &Pose) -> Vec<Evidence> {
        let pyramid = self.prepared.pyramid(&photo.light);
        let own = self.relight.then(|| self.relit(&pyramid, pose));
        let densities = own.as_ref().unwrap_or(&self.densities);
        let of = |(node, densities): (&super::judge::NodeImages, &Vec<Density>)| {
            node.evidence(densities, pyramid.at(node.window.frame.factor), &self.camera, pose)
        };
        self.prepared.nodes.iter().zip(densities).map(of).collect()
    }

    /// Densities under this photo's light. Light and hypotheses take turns, each making the best of the other; they may
    /// settle on a wrong pair, so they start once from all that is good and once from all that is faulty alike.
    fn relit(&self, pyramid: &super::judge::Pyramid, pose: &Pose) -> Vec<Vec<Density>> {
        let most = self.prepared.nodes.iter().map(|n| n.hypotheses()).max().unwrap_or(1);
        let starts = (0..most).map(|h| self.relit_from(pyramid, pose, h));
        let best = starts.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or_else(Vec::new, |(densities, _)| densities)
    }

    /// The same from one start, with the log-likelihood of the whole photo.
    fn relit_from(&self, pyramid: &super::judge::Pyramid, pose: &Pose, start: usize) -> (Vec<Vec<Density>>, f64) {
        const ROUNDS: usize = 2;
        let drift = vec![0.0; self.calibration.lamps.len()];
        let nodes = &self.prepared.nodes;
        let mut hypotheses: Vec<usize> = nodes.iter().map(|n| start.min(n.hypotheses() - 1)).collect();
        let (mut densities, mut total) = (Vec::new(), 0.0);
        for _ in 0..ROUNDS {
            let evidence = self.prepared.light_evidence(pyramid, &self.camera, pose, &hypotheses);
            let fit = fit_lamps(&evidence, &self.calibration.lamps, RELIGHT_PULL);
            (densities, total) = (Vec::new(), 0.0);
            for (node, chosen) in nodes.iter().zip(&mut hypotheses) {
                let own = node.densities(&fit.weights, &drift, self.calibration.noise);
                let reduced = pyramid.at(node.window.frame.factor);
                let evidence = node.evidence(&own, reduced, &self.camera, pose);
                *chosen = best(&evidence.log_likelihoods);
                total += evidence.log_likelihoods[*chosen];
                densities.push(own);
            }
        }
        (densities, total)
    }

    fn report(&self, index: usize, evidence: &Evidence, pose: &Pose) -> NodeReport {
        let node = &self.model.nodes[index];
        let (fault, score) = score(evidence, self.coefficients(index));
        NodeReport {
            name: node.name.clone(),
            level: node.level,
            parent: node.parent.map(|p| p as usize),
            outline: self.carried(node.visible, node.plane, pose),
            score,
            threshold: node.threshold,
            against: against(evidence, self.coefficients(index)),
            best_fault: fault.map_or_else(String::new, |h| node.hypotheses[h].fault.clone()),
            inside: evidence.inside,
            // What is no number is no proof of anything.
            faulty: score.is_nan() || score < node.threshold,
            explained: false,
        }
    }

    /// Number of coefficients of a node.
    pub fn coefficients(&self, node: usize) -> usize {
        self.prepared.nodes[node].stencil.len()
    }

    /// Orders the faulty nodes by their evidence and drops those that a stronger fault explains.
    fn blame(&self, nodes: &mut [NodeReport], evidence: &[Evidence]) -> Vec<usize> {
        let mut faulty: Vec<usize> = (0..nodes.len()).filter(|&i| nodes[i].faulty).collect();
        let against = |i: usize| -> f64 {
            let l = &evidence[i].log_likelihoods;
            l[0] - l[1..].iter().copied().fold(f64::NEG_INFINITY, f64::max)
        };
        faulty.sort_by(|&a, &b| against(a).total_cmp(&against(b)).then(a.cmp(&b)));
        let mut blamed: Vec<usize> = Vec::new();
        for i in faulty {
            let explained = blamed.iter().any(|&b| self.model.nodes[b].disturbs.contains(&(i as u32)));
            nodes[i].explained = explained;
            if !explained {
                blamed.push(i);
            }
        }
        blamed
    }

    fn finding(&self, index: usize, report: &NodeReport) -> Finding {
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
            p_value: p_value(node, report.score),
            box_px: [min(xs), min(ys), max(xs), max(ys)],
        }
    }

    /// Corners of a box of the nominal photo as they lie in this one.
    fn carried(&self, [x0, y0, x1, y1]: [f64; 4], plane: f64, pose: &Pose) -> [[f64; 2]; 4] {
        let home = self.prepared.home;
        [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|corner| {
            let nominal = &self.model.station.camera;
            let point = nominal.on_plane(corner, plane + home.z).map(|p| pose.apply(home.invert(p)));
            point.and_then(|p| self.camera.project(p)).unwrap_or(corner)
        })
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

fn drifts(model: &Model) -> Vec<f64> {
    model.station.lamps.iter().map(|l| l.drift).collect()
}

/// The error mode that fits best and the log-likelihood ratio per coefficient of the good state against it.
pub fn score(evidence: &Evidence, coefficients: usize) -> (Option<usize>, f64) {
    let l = &evidence.log_likelihoods;
    let fault = (1..l.len()).max_by(|&a, &b| l[a].total_cmp(&l[b]));
    (fault, fault.map_or(f64::INFINITY, |h| (l[0] - l[h]) / coefficients.max(1) as f64))
}

fn against(evidence: &Evidence, coefficients: usize) -> Vec<f64> {
    let l = &evidence.log_likelihoods;
    l.iter().map(|other| (l[0] - other) / coefficients.max(1) as f64).collect()
}

fn best(log_likelihoods: &[f64]) -> usize {
    (0..log_likelihoods.len()).max_by(|&a, &b| log_likelihoods[a].total_cmp(&log_likelihoods[b])).unwrap_or(0)
}

/// (1 + held-out goods that score no higher) / (1 + held-out goods).
fn p_value(node: &Node, score: f64) -> f64 {
    let lower = node.good_scores.iter().filter(|&&s| s <= score).count();
    (1 + lower) as f64 / (1 + node.good_scores.len()) as f64
}

fn summary(findings: &[Finding]) -> String {
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
