//! One verdict from several cameras.
//!
//! In: a rig with its calibrations, one photo a camera, all of one assembly. Out: [`RigVerdict`].
//!
//! Every camera locates the assembly and weighs its nodes by itself. Given the state of a component its images are
//! independent, so log-likelihood ratios add up: for each error mode the sum over the cameras of their ratio less its offset,
//! each weighed by how well that camera tells good from faulty renders. That weight makes of a tempered ratio one in nats,
//! and is Fisher's linear discriminant of the cameras' scores. A mode that a camera does not show adds nothing, and neither
//! does a component outside its photo. A mode that the cameras left cannot tell is not guessed: the verdict is cannot-inspect.
//! So is it when a camera does not find the assembly at all, unless the others find it faulty: trouble never looks like go.

use super::calibrate::{self, Calibration, CalibrationError, SLIGHT};
use super::inspect::{self, Decision, Finding, Inspector, LEAST_INSIDE, NodeReport, Verdict};
use super::judge::Evidence;
use super::model::Model;
use super::parts::{Listener, Part, nobody};
use super::photo::{Photo, PhotoError};
use super::report::Outcome;
use super::rig::{Component, Mode, Rig, RigCalibration, Seen, camera_name, hypotheses};
use super::strange;
use std::borrow::Cow;
use std::fmt;

/// Cameras of this power together tell a mode, even if that is less than half of what all could: three standard deviations.
const ENOUGH: f64 = 9.0;

/// What the cameras say together.
#[derive(Debug, Clone, PartialEq)]
pub struct RigVerdict {
    /// The joint verdict: a node a component, each finding with its box in the photo of the camera that saw it best. The
    /// pose is the first camera's.
    pub joint: Verdict,
    /// For each finding the name of that camera.
    pub seen_by: Vec<String>,
    /// What each camera saw, its nodes marked as the joint verdict has them.
    pub views: Vec<Verdict>,
}

/// A rig and its calibrations, ready to judge assembly after assembly.
pub struct RigInspector<'a> {
    rig: Cow<'a, Rig>,
    inspectors: Vec<Inspector<'a>>,
    listener: &'a Listener<'a>,
}

/// A component by all that is left of the cameras.
struct Weighed {
    /// The mode that fits best, and what it leaves to its threshold: faulty below zero.
    best: usize,
    score: f64,
    /// Per mode, what each camera added to the sum; `None` where it shows nothing of it.
    shares: Vec<Vec<Option<f64>>>,
    /// The first mode that the cameras left cannot tell.
    untold: Option<usize>,
}

impl Weighed {
    fn is_faulty(&self) -> bool {
        // What is no number is no proof of anything.
        self.score.is_nan() || self.score < 0.0
    }
}

/// Per camera, what a mode adds to the sum: of the cameras for which `counts` holds.
fn shares(
    mode: &Mode,
    name: &str,
    cameras: &[Model],
    views: &[&Verdict],
    counts: &dyn Fn(usize) -> bool,
) -> Vec<Option<f64>> {
    let mut shares = vec![None; cameras.len()];
    for Seen { camera, weight, offset, .. } in mode.seen.iter().filter(|s| counts(s.camera as usize)) {
        let at = *camera as usize;
        let (index, members) = hypotheses(&cameras[at], name, &mode.fault);
        let node = views.get(at).and_then(|view| view.nodes.get(index)).filter(|n| n.inside >= LEAST_INSIDE);
        let ratios = node.into_iter().flat_map(|node| members.iter().filter_map(|&h| node.against.get(h)));
        // One that is no number stays so.
        let least = ratios.copied().reduce(|a, b| if a.is_nan() || a < b { a } else { b });
        shares[at] = least.map(|least| weight * (least - offset));
    }
    shares
}

fn weigh(component: &Component, cameras: &[Model], views: &[&Verdict], counts: &dyn Fn(usize) -> bool) -> Weighed {
    let shares: Vec<Vec<Option<f64>>> =
        component.modes.iter().map(|mode| self::shares(mode, &component.name, cameras, views, counts)).collect();
    let told = |m: usize| shares[m].iter().any(Option::is_some);
    let sum = |m: usize| shares[m].iter().flatten().sum::<f64>();
    let left = |m: usize| sum(m) - component.modes[m].threshold;
    let modes = || (0..component.modes.len()).filter(|&m| told(m));
    let unknown = modes().find(|&m| left(m).is_nan());
    let closest = modes().min_by(|&a, &b| left(a).total_cmp(&left(b)));
    // Of the modes beyond their threshold the likeliest, else the one that comes closest.
    let likeliest = modes().filter(|&m| left(m) < 0.0).min_by(|&a, &b| sum(a).total_cmp(&sum(b)));
    let untold = (0..component.modes.len()).find(|&m| {
        let power = |s: &&Seen| shares[m][s.camera as usize].is_some();
        let kept: f64 = component.modes[m].seen.iter().filter(power).map(|s| s.power).sum();
        let all: f64 = component.modes[m].seen.iter().map(|s| s.power).sum();
        !told(m) || kept < (all / 2.0).min(ENOUGH)
    });
    Weighed {
        best: unknown.or(likeliest).or(closest).unwrap_or(0),
        score: unknown.or(closest).map_or(f64::INFINITY, left),
        shares,
        untold,
    }
}

/// The sum of a mode over the cameras; `None` where none shows anything of it.
pub fn sum(mode: &Mode, component: &str, cameras: &[Model], views: &[&Verdict]) -> Option<f64> {
    shares(mode, component, cameras, views, &|_| true).into_iter().flatten().reduce(|a, b| a + b)
}

/// What a component leaves to the threshold of the mode that comes closest, faulty below zero.
pub fn score(component: &Component, cameras: &[Model], views: &[&Verdict]) -> f64 {
    weigh(component, cameras, views, &|_| true).score
}

/// What each component leaves to the threshold of the mode that comes closest, faulty below zero; and whether the assembly
/// cannot be inspected: no component is faulty and there is trouble.
pub fn decide(rig: &Rig, views: &[&Verdict]) -> (Vec<f64>, bool) {
    let components: Vec<Weighed> =
        rig.components.iter().map(|component| weigh(component, &rig.cameras, views, &|_| true)).collect();
    let unsure = !components.iter().any(Weighed::is_faulty) && trouble(rig, &components, views).is_some();
    (components.iter().map(|w| w.score).collect(), unsure)
}

/// Why an assembly without a finding is no go, if it is none.
fn trouble(rig: &Rig, components: &[Weighed], views: &[&Verdict]) -> Option<String> {
    let names = rig.names();
    let lost = views.iter().zip(&names).find(|(view, _)| view.pose.is_none());
    if let Some((view, name)) = lost {
        return Some(of_camera(name, &view.reason));
    }
    let untold = |(of, weighed): (&Component, &Weighed)| {
        let mode = of.modes.get(weighed.untold?)?;
        let inside = |c: usize| views[c].nodes.iter().find(|n| n.name == of.name).map_or(0.0, |n| n.inside);
        let out = mode.seen.iter().map(|s| s.camera as usize).min_by(|&a, &b| inside(a).total_cmp(&inside(b)))?;
        let share = 100.0 * inside(out);
        let what = format!("only {share:.0} % of {} lies inside the photo, too little to tell", of.name);
        Some(format!("camera {}: {what} whether it is {}", names[out], mode.fault))
    };
    let odd = |(view, name): (&&Verdict, &&str)| {
        let inside: Vec<NodeReport> = view.nodes.iter().filter(|n| n.inside >= LEAST_INSIDE).cloned().collect();
        let node = &inside[strange::strangest(&inside)?];
        let what = "looks like nothing the model knows: neither as it should nor as when faulty";
        Some(format!("camera {name}: {} {what}", node.name))
    };
    let untold = rig.components.iter().zip(components).find_map(untold);
    untold.or_else(|| views.iter().zip(&names).find_map(odd))
}

impl<'a> RigInspector<'a> {
    /// `None` when a camera cannot see the nodes of its own model.
    pub fn new(rig: &'a Rig, calibration: &'a RigCalibration) -> Option<RigInspector<'a>> {
        RigInspector::of(Cow::Borrowed(rig), rig.cameras.iter().zip(&calibration.cameras))
    }

    /// The same, keeping all for itself.
    pub fn owned(rig: Rig, calibration: RigCalibration) -> Option<RigInspector<'static>> {
        let pairs = rig.cameras.iter().cloned().zip(calibration.cameras);
        let inspectors = pairs.map(|(model, own)| Inspector::owned(model, own)).collect::<Option<_>>()?;
        Some(RigInspector { rig: Cow::Owned(rig), inspectors, listener: &nobody })
    }

    fn of<'b>(
        rig: Cow<'b, Rig>,
        pairs: impl Iterator<Item = (&'b Model, &'b Calibration)>,
    ) -> Option<RigInspector<'b>> {
        let inspectors = pairs.map(|(model, own)| Inspector::new(model, own)).collect::<Option<_>>()?;
        Some(RigInspector { rig, inspectors, listener: &nobody })
    }

    /// The same, telling the parts of its work.
    #[must_use]
    pub fn heard_by(self, listener: &'a Listener<'a>) -> RigInspector<'a> {
        let inspectors = self.inspectors.into_iter().map(|inspector| inspector.heard_by(listener)).collect();
        RigInspector { inspectors, listener, ..self }
    }

    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Decodes a photo by a camera (its number in [`Rig::names`]).
    ///
    /// # Panics
    /// When there is no such camera.
    pub fn photo(&self, camera: usize, bytes: &[u8]) -> Result<Photo, PhotoError> {
        self.inspectors[camera].photo(bytes)
    }

    /// Judges one assembly by one photo a camera, in the order of [`Rig::names`]; where there is none, why not.
    pub fn inspect(&self, photos: &[Result<Photo, String>]) -> RigVerdict {
        let no_photo = Err("there is no photo".to_string());
        let photos: Vec<&Result<Photo, String>> =
            (0..self.inspectors.len()).map(|c| photos.get(c).unwrap_or(&no_photo)).collect();
        let look = |(inspector, photo): (&Inspector, &&Result<Photo, String>)| match photo {
            Ok(photo) => inspector.inspect(photo),
            Err(why) => Outcome::unreadable(String::new(), why.clone()).verdict,
        };
        let mut views: Vec<Verdict> = self.inspectors.iter().zip(&photos).map(look).collect();
        (self.listener)(Part::Explain);
        let seen: Vec<&Verdict> = views.iter().collect();
        let weighed = |c: &Component| weigh(c, &self.rig.cameras, &seen, &|_| true);
        let components: Vec<Weighed> = self.rig.components.iter().map(weighed).collect();
        let blamed = self.blame(&components, &seen, &photos);
        (self.listener)(Part::Verdict);
        let (findings, seen_by) = blamed.iter().map(|&i| self.finding(i, &components[i], &seen)).unzip();
        let joint = self.joint(&components, &seen, &blamed, findings);
        views.iter_mut().enumerate().for_each(|(camera, view)| self.mark(camera, view, &components, &joint));
        RigVerdict { joint, seen_by, views }
    }

    /// The faulty components that no stronger fault explains, by their evidence. Of what a component shows, the cameras in which
    /// a fault already blamed explains it have no say; what the others show has to be faulty still.
    fn blame(&self, components: &[Weighed], views: &[&Verdict], photos: &[&Result<Photo, String>]) -> Vec<usize> {
        let mut faulty: Vec<usize> = (0..components.len()).filter(|&i| components[i].is_faulty()).collect();
        faulty.sort_by(|&a, &b| components[a].score.total_cmp(&components[b].score).then(a.cmp(&b)));
        if faulty.len() < 2 {
            return faulty;
        }
        let names: Vec<&str> = faulty.iter().map(|&i| self.rig.components[i].name.as_str()).collect();
        let accounts: Vec<Option<Account>> =
            (0..views.len()).map(|c| Account::of(&self.inspectors[c], views[c], photos[c], &names)).collect();
        let mut blamed: Vec<usize> = Vec::new();
        for i in faulty {
            let explained_in = |camera: usize| {
                let by = |&b: &usize| {
                    let fault = self.rig.components[b].modes.get(components[b].best).map_or("", |m| &m.fault);
                    let [b, i] = [b, i].map(|k| self.rig.components[k].name.as_str());
                    accounts[camera].as_ref().is_some_and(|a| a.explains(&self.inspectors[camera], b, fault, i))
                };
                blamed.iter().any(by)
            };
            let explained: Vec<bool> = (0..views.len()).map(explained_in).collect();
            let rest = |camera: usize| !explained[camera];
            let is_faulty = !explained.contains(&true)
                || weigh(&self.rig.components[i], &self.rig.cameras, views, &rest).is_faulty();
            if is_faulty {
                blamed.push(i);
            }
        }
        blamed
    }

    /// A finding, and the camera in which it shows most.
    fn finding(&self, index: usize, weighed: &Weighed, views: &[&Verdict]) -> (Finding, String) {
        let component = &self.rig.components[index];
        let shares = weighed.shares.get(weighed.best);
        let most = shares.into_iter().flatten().enumerate().filter_map(|(c, share)| share.map(|s| (c, s)));
        let camera = most.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(camera, _)| camera);
        let node = views[camera].nodes.iter().find(|n| n.name == component.name);
        let corners = node.map_or([[0.0; 2]; 4], |n| n.outline);
        let side = |axis: usize, pick: fn(f64, f64) -> f64| corners.iter().map(|p| p[axis]).reduce(pick).unwrap_or(0.0);
        let lower = component.good_scores.iter().filter(|&&s| s <= weighed.score).count();
        let finding = Finding {
            component: component.name.clone(),
            fault: component.modes.get(weighed.best).map_or_else(String::new, |m| m.fault.clone()),
            error_tree: component.name.clone(),
            node: component.name.clone(),
            p_value: (1 + lower) as f64 / (1 + component.good_scores.len()) as f64,
            box_px: [side(0, f64::min), side(1, f64::min), side(0, f64::max), side(1, f64::max)],
        };
        (finding, self.rig.names()[camera].to_string())
    }

    fn joint(&self, components: &[Weighed], views: &[&Verdict], blamed: &[usize], findings: Vec<Finding>) -> Verdict {
        let (decision, reason) = match trouble(&self.rig, components, views) {
            _ if !findings.is_empty() => (Decision::NoGo, inspect::summary(&findings)),
            Some(why) => (Decision::CannotInspect, why),
            None => (Decision::Go, String::new()),
        };
        let report = |(i, weighed): (usize, &Weighed)| {
            let of = &self.rig.components[i];
            let nodes = || views.iter().flat_map(|v| &v.nodes).filter(|n| n.name == of.name);
            NodeReport {
                name: of.name.clone(),
                level: nodes().map(|n| n.level).min().unwrap_or(1),
                parent: None,
                outline: [[0.0; 2]; 4],
                crossed: [[0.0; 2]; 4],
                score: weighed.score,
                against: Vec::new(),
                best_fault: of.modes.get(weighed.best).map_or_else(String::new, |m| m.fault.clone()),
                inside: nodes().map(|n| n.inside).fold(0.0, f64::max),
                unlike: Default::default(),
                strangeness: nodes().map(|n| n.strangeness).fold(0.0, f64::max),
                lift: None,
                beyond: 0.0,
                faulty: weighed.is_faulty(),
                explained: weighed.is_faulty() && !blamed.contains(&i),
            }
        };
        let located = views.iter().find(|v| v.pose.is_some());
        Verdict {
            decision,
            reason,
            pose: located.and_then(|v| v.pose),
            scale: located.map_or(1.0, |v| v.scale),
            locator_score: views.iter().map(|v| v.locator_score).reduce(f64::min).unwrap_or(0.0),
            findings,
            nodes: components.iter().enumerate().map(report).collect(),
            outline: None,
        }
    }

    /// Writes the joint verdict into what one camera saw: its boxes, a cross where it shows a fault.
    fn mark(&self, camera: usize, view: &mut Verdict, components: &[Weighed], joint: &Verdict) {
        for node in &mut view.nodes {
            let index = self.rig.components.iter().position(|c| c.name == node.name);
            let shows = index.is_some_and(|i| {
                let of = &components[i];
                of.is_faulty()
                    && of
                        .shares
                        .get(of.best)
                        .and_then(|s| s[camera])
                        .is_some_and(|share| share.is_nan() || share <= 0.0)
            });
            node.faulty = shows;
            node.explained = shows && index.is_some_and(|i| joint.nodes[i].explained);
        }
        (view.decision, view.reason, view.findings) = (joint.decision, joint.reason.clone(), joint.findings.clone());
    }
}

/// `E0805: camera side: …`: the code of a reason stays in front.
fn of_camera(camera: &str, reason: &str) -> String {
    let is_code =
        |code: &str| code.len() == 5 && code.starts_with('E') && code[1..].bytes().all(|b| b.is_ascii_digit());
    match reason.split_once(": ") {
        Some((code, rest)) if is_code(code) => format!("{code}: camera {camera}: {rest}"),
        _ => format!("camera {camera}: {reason}"),
    }
}

/// What one camera knows of faults beside faults.
struct Account {
    names: Vec<String>,
    evidence: Vec<Evidence>,
    disturbed: Vec<Vec<f64>>,
}

impl Account {
    /// `None` for a camera that did not find the assembly.
    fn of(inspector: &Inspector, view: &Verdict, photo: &Result<Photo, String>, faulty: &[&str]) -> Option<Account> {
        let (Ok(photo), Some(pose)) = (photo, view.pose) else { return None };
        let photo = &*photo.flattened(inspector.model().station.vignetting);
        let mut nodes = view.nodes.clone();
        nodes.iter_mut().for_each(|n| n.faulty = faulty.contains(&n.name.as_str()));
        Some(Account {
            evidence: inspector.evidence(photo, &pose),
            disturbed: inspector.disturbed(&nodes, photo, &pose),
            names: nodes.into_iter().map(|n| n.name).collect(),
        })
    }

    /// Whether in this camera a fault of one component explains what another shows.
    fn explains(&self, inspector: &Inspector, blamed: &str, fault: &str, other: &str) -> bool {
        let at = |name: &str| self.names.iter().position(|n| n == name);
        let (Some(blamed), Some(other)) = (at(blamed), at(other)) else { return false };
        inspector.explains(blamed, fault, other, &self.evidence[other], &self.disturbed[other])
    }
}

/// Why photos do not calibrate a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Whose photo it is; `None` where the cameras refuse together.
    pub camera: Option<String>,
    pub why: CalibrationError,
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.camera {
            Some(camera) => f.write_str(&of_camera(camera, &self.why.to_string())),
            None => self.why.fmt(f),
        }
    }
}

impl std::error::Error for Refused {}

/// Calibrates every camera of a rig by photos of correct assemblies: for each assembly one photo a camera, in the order of
/// [`Rig::names`]. Whether they show a fault is asked of all cameras together.
pub fn calibrate(rig: &Rig, assemblies: &[Vec<Photo>]) -> Result<RigCalibration, Refused> {
    let fit = |(camera, model): (usize, &Model)| {
        let photos: Vec<Photo> = assemblies.iter().filter_map(|photos| photos.get(camera).cloned()).collect();
        calibrate::fit(model, &photos).map_err(|why| Refused { camera: Some(camera_name(model).to_string()), why })
    };
    let cameras = rig.cameras.iter().enumerate().map(fit).collect::<Result<_, _>>()?;
    let calibration = RigCalibration::of(rig, cameras);
    match suspicions(rig, &calibration, assemblies)?.into_iter().find(|(_, proven)| *proven) {
        Some((Finding { component, fault, .. }, _)) => {
            Err(Refused { camera: None, why: CalibrationError::Faulty { component, fault } })
        }
        None => Ok(calibration),
    }
}

/// What looks faulty in the photos of a calibration without being proven: whoever calibrates should look again.
pub fn doubts(rig: &Rig, calibration: &RigCalibration, assemblies: &[Vec<Photo>]) -> Result<Vec<Finding>, Refused> {
    let all = suspicions(rig, calibration, assemblies)?;
    Ok(all.into_iter().filter(|(_, proven)| !proven).map(|(finding, _)| finding).collect())
}

/// Findings by the renders alone, and whether they are proven, as for one camera.
fn suspicions(
    rig: &Rig,
    calibration: &RigCalibration,
    assemblies: &[Vec<Photo>],
) -> Result<Vec<(Finding, bool)>, Refused> {
    let naive = |own: &Calibration| Calibration { references: Vec::new(), ..own.clone() };
    let naive = RigCalibration { cameras: calibration.cameras.iter().map(naive).collect(), ..calibration.clone() };
    let unusable = || Refused { camera: None, why: CalibrationError::Unusable };
    let inspector = RigInspector::new(rig, &naive).ok_or_else(unusable)?;
    let mut out = Vec::new();
    for photos in assemblies {
        let verdict = inspector.inspect(&photos.iter().cloned().map(Ok).collect::<Vec<_>>());
        for finding in verdict.joint.findings {
            let of = rig.components.iter().zip(&verdict.joint.nodes).find(|(c, _)| c.name == finding.component);
            let proven = of.is_some_and(|(component, node)| {
                let typical = component.fault_scores.get(component.fault_scores.len() / 2).copied().unwrap_or(0.0);
                finding.fault != SLIGHT || node.score < typical
            });
            out.push((finding, proven));
        }
    }
    Ok(out)
}

/// What came of one assembly.
pub struct RigOutcome {
    /// Name and photo of each camera.
    pub photos: Vec<(String, String)>,
    pub verdict: RigVerdict,
    /// Time of judging, the model being loaded; `None` where nobody looked at a clock.
    pub milliseconds: Option<f64>,
}

impl RigOutcome {
    /// The joint verdict under the name of the first camera's photo.
    pub fn joint(&self) -> Outcome {
        Outcome {
            photo: self.photos.first().map_or_else(String::new, |(_, photo)| photo.clone()),
            verdict: self.verdict.joint.clone(),
            milliseconds: self.milliseconds,
        }
    }

    /// One JSON object, without the line break: that of one photo, with `photos` and each finding's `camera` added.
    pub fn json(&self) -> String {
        let photos: Vec<(&str, &str)> = self.photos.iter().map(|(c, p)| (c.as_str(), p.as_str())).collect();
        self.joint().json_of(&photos, &self.verdict.seen_by)
    }
}
