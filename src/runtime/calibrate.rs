//! One photo of a good assembly fits a model to its station: how the camera hangs, what the lamps give, how much the
//! sensor's values scatter.
//!
//! In: a model and photos of correct assemblies. Out: [`Calibration`], or the reason why the photo is refused. A part's
//! own reflectance is not calibrated: parts differ.

use super::grid::Grid;
use super::inspect::{Finding, Inspector, NodeReport, light, shows_mode};
use super::judge::{NodeImages, Prepared};
use super::light::{LightFit, fit_lamps};
use super::linear;
use super::locate::{Fields, Search};
use super::model::{self, Model, ModelError, Node};
use super::photo::Photo;
use super::pose::{Installation, Pose};
use super::row::Row;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// Weight of the spec's lamp powers against the photo, share of the photo's own evidence.
const PRIOR_PULL: f64 = 1e-3;
/// Sensor noise that every 8-bit photo has: the rounding (share of full scale).
const ROUNDING: f64 = 1.0 / (255.0 * 3.464);
/// The fault that comes in any size.
pub(super) const SLIGHT: &str = "not seated";
/// Format of the calibration file.
pub const FORMAT: u32 = 5;

/// What one photo tells about a station.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    pub format: u32,
    /// Digest of the model it belongs to.
    pub model: String,
    pub installation: Installation,
    /// Weight of each lamp: photo value = sum of weight times lamp image.
    pub lamps: Vec<f64>,
    /// Standard deviation of the sensor's noise, share of full scale.
    pub noise: f64,
    /// Where the assembly stood in each photo.
    pub poses: Vec<Pose>,
    /// Locator's score and correlation of the photo's gradients with the re-synthesis.
    pub score: f64,
    pub correlation: f64,
    /// Per photo what the nodes showed.
    pub references: Vec<Reference>,
}

/// What the nodes showed in one photo of a correct assembly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Per node of the model its window, row by row, in steps of 1/4000 of full scale.
    pub windows: Vec<Vec<Row>>,
    /// Per node of the model how far it was from where pose and camera have it (px).
    pub shifts: Vec<[f64; 2]>,
}

/// Steps of a reference's grey values.
const GREY_STEPS: f32 = 4000.0;

impl Reference {
    fn of(seen: &[(Grid, [f64; 2])]) -> Reference {
        let value = |v: &f32| (v * GREY_STEPS).round().clamp(0.0, f32::from(u16::MAX)) as u16;
        let rows = |g: &Grid| g.values.chunks(g.width).map(|row| Row(row.iter().map(value).collect())).collect();
        Reference {
            windows: seen.iter().map(|(w, _)| rows(w)).collect(),
            shifts: seen.iter().map(|(_, s)| *s).collect(),
        }
    }

    /// The window of a node.
    pub fn window(&self, node: usize) -> Grid {
        let rows = &self.windows[node];
        let values = rows.iter().flat_map(|row| &row.0).map(|&v| f32::from(v) / GREY_STEPS).collect();
        Grid::new(rows.first().map_or(0, |row| row.0.len()), rows.len(), values)
    }

    /// Whether the windows are those of the model's nodes.
    fn fits(&self, model: &Model) -> bool {
        let fits = |(rows, node): (&Vec<Row>, &Node)| {
            rows.len() == node.size[1] as usize && rows.iter().all(|row| row.0.len() == node.size[0] as usize)
        };
        let places = self.shifts.len() == model.nodes.len() && self.shifts.iter().flatten().all(|s| s.is_finite());
        places && self.windows.len() == model.nodes.len() && self.windows.iter().zip(&model.nodes).all(fits)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum CalibrationError {
    NoPhoto,
    /// The model's own numbers do not fit together.
    Unusable,
    NotFound {
        score: f64,
        least: f64,
    },
    PoorFit {
        correlation: f64,
        least: f64,
    },
    /// The photo shows a fault, so it would teach it.
    Faulty {
        component: String,
        fault: String,
    },
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CalibrationError::NoPhoto => write!(f, "E0806: a calibration needs at least one photo"),
            CalibrationError::Unusable => write!(f, "E0803: the model's camera cannot see its own nodes"),
            CalibrationError::NotFound { score, least } => {
                write!(f, "E0805: the assembly was not found in the photo (score {score:.2}, at least {least:.2}): ")?;
                write!(f, "is it the right station, and is the assembly where the spec says?")
            }
            CalibrationError::PoorFit { correlation, least } => {
                write!(f, "E0807: the photo does not look like the assembly under any mix of the station's lamps ")?;
                write!(f, "(correlation {correlation:.2}, at least {least:.2})")
            }
            CalibrationError::Faulty { component, fault } => {
                write!(f, "E0808: the photo itself shows a fault ({component}: {fault}); ")?;
                write!(f, "calibrate with a photo of a correct assembly")
            }
        }
    }
}

impl std::error::Error for CalibrationError {}

impl Calibration {
    /// The spec's word for everything: what is used before any photo was taken.
    pub fn nominal(model: &Model) -> Calibration {
        Calibration {
            format: FORMAT,
            model: model.digest(),
            installation: Installation::default(),
            lamps: model.station.lamps.iter().map(|l| l.power).collect(),
            noise: model.station.noise.max(ROUNDING),
            poses: Vec::new(),
            score: 0.0,
            correlation: 0.0,
            references: Vec::new(),
        }
    }

    pub fn write(&self) -> String {
        model::seal(&model::to_ron(self))
    }

    /// Reads a calibration and checks that it belongs to `model`.
    pub fn read(text: &str, model: &Model) -> Result<Calibration, ModelError> {
        let body = model::open(text, FORMAT)?;
        let calibration: Calibration =
            ron::from_str(body).map_err(|e| ModelError::Malformed(format!("not a calibration: {e}")))?;
        calibration.check(model)?;
        Ok(calibration)
    }

    pub(super) fn check(&self, model: &Model) -> Result<(), ModelError> {
        let malformed = |why: &str| ModelError::Malformed(why.into());
        let calibration = self;
        if calibration.model != model.digest() {
            return Err(malformed("the calibration belongs to another model: calibrate again"));
        }
        let finite = calibration.lamps.iter().chain(&calibration.installation.to_array()).all(|v| v.is_finite());
        let lamps = calibration.lamps.len() == model.station.lamps.len();
        let likely = calibration.installation.is_likely();
        let references = calibration.references.iter().all(|r| r.fits(model));
        if !finite || !likely || !lamps || !references || calibration.noise.is_nan() || calibration.noise <= 0.0 {
            return Err(malformed("the calibration's numbers are out of range"));
        }
        Ok(())
    }
}

/// Calibrates `model` by photos of correct assemblies; the first fixes light and noise, all fix the camera and show what
/// no render knows.
pub fn calibrate(model: &Model, photos: &[Photo]) -> Result<Calibration, CalibrationError> {
    let calibration = fit(model, photos)?;
    for (finding, proven) in suspicions(model, &calibration, photos)? {
        if proven {
            return Err(CalibrationError::Faulty { component: finding.component, fault: finding.fault });
        }
    }
    Ok(calibration)
}

/// What looks faulty in the photos of a calibration without being proven: whoever calibrates should look again.
pub fn doubts(model: &Model, calibration: &Calibration, photos: &[Photo]) -> Result<Vec<Finding>, CalibrationError> {
    let all = suspicions(model, calibration, photos)?;
    Ok(all.into_iter().filter(|(_, proven)| !proven).map(|(finding, _)| finding).collect())
}

/// Findings by the renders alone, and whether they are proven: what the photos show is not taken for granted yet.
fn suspicions(
    model: &Model,
    calibration: &Calibration,
    photos: &[Photo],
) -> Result<Vec<(Finding, bool)>, CalibrationError> {
    let naive = Calibration { references: Vec::new(), ..calibration.clone() };
    let inspector = Inspector::new(model, &naive).ok_or(CalibrationError::Unusable)?;
    let mut out = Vec::new();
    for verdict in photos.iter().map(|photo| inspector.inspect(photo)) {
        for finding in &verdict.findings {
            let own = |(n, r): (&Node, &NodeReport)| n.name == finding.component && proves(n, r);
            out.push((finding.clone(), model.nodes.iter().zip(&verdict.nodes).any(own)));
        }
    }
    Ok(out)
}

/// Whether a node's verdict by renders alone proves a fault. Under a light that is not quite the described one a sound part
/// can look a little raised; it must look as raised as half the held-out faults. It never looks like none. What no error mode
/// shows is no proof: which look of a sound part no render has is what the photo is there to tell.
fn proves(node: &Node, report: &NodeReport) -> bool {
    let typical = node.fault_scores.get(node.fault_scores.len() / 2).copied().unwrap_or(0.0);
    shows_mode(report.score) && (report.best_fault != SLIGHT || report.score < typical)
}

/// The calibration without the question whether the photos show a fault.
pub fn fit(model: &Model, photos: &[Photo]) -> Result<Calibration, CalibrationError> {
    fit_for(model, model.digest(), photos)
}

/// The same for who knows the model's digest, or needs none: to reckon it takes longer than all the rest.
pub(crate) fn fit_for(model: &Model, digest: String, photos: &[Photo]) -> Result<Calibration, CalibrationError> {
    let photos: Vec<Cow<Photo>> = photos.iter().map(|p| p.flattened(model.station.vignetting)).collect();
    let first = photos.first().ok_or(CalibrationError::NoPhoto)?;
    let prepared = Prepared::new(model).ok_or(CalibrationError::Unusable)?;
    let noise = noise_of(&first.light).max(ROUNDING);
    let search = Search::new(model);
    let fields: Vec<Fields> = photos.iter().map(|p| search.fields(&p.light, noise)).collect();
    let (installation, poses, score) = install(model, &search, &fields)?;
    let camera = installation.apply(&model.station.camera);
    let pyramid = prepared.pyramid(&first.light);
    let prior: Vec<f64> = model.station.lamps.iter().map(|l| l.power).collect();
    let good = vec![0; prepared.nodes.len()];
    let evidence = prepared.light_evidence(&pyramid, &camera, &poses[0], &good);
    let LightFit { weights, correlation } = fit_lamps(&evidence, &prior, PRIOR_PULL);
    let least = model.station.least_correlation;
    // Under open light no photo is like the mean of the renders, and the next one has other lamps.
    if correlation < least && !light(model, &weights).is_open() {
        return Err(CalibrationError::PoorFit { correlation, least });
    }
    let light = light(model, &weights);
    let reference = |(photo, pose): (&Cow<Photo>, &Pose)| {
        let pyramid = prepared.pyramid(&photo.light);
        let window =
            |node: &NodeImages| node.reference(&light, noise, pyramid.at(node.window.frame.factor), &camera, pose);
        Reference::of(&prepared.nodes.iter().map(window).collect::<Vec<_>>())
    };
    let references = photos.iter().zip(&poses).map(reference).collect();
    Ok(Calibration {
        format: FORMAT,
        model: digest,
        installation,
        lamps: weights,
        noise,
        poses,
        score,
        correlation,
        references,
    })
}

/// The camera as it hangs, from where the assemblies are found.
fn install(
    model: &Model,
    search: &Search,
    fields: &[Fields],
) -> Result<(Installation, Vec<Pose>, f64), CalibrationError> {
    let station = &model.station;
    let wide = widened(model);
    let mut starts = Vec::new();
    for fields in fields {
        let found = search.locate(fields, &station.camera, &wide);
        let least = model.locator.accept;
        let found = found.ok_or(CalibrationError::NotFound { score: 0.0, least })?;
        if found.score < least {
            return Err(CalibrationError::NotFound { score: found.score, least });
        }
        starts.push(found.pose);
    }
    let spread = Installation::spread(&station.install);
    let (installation, poses) = search.install(fields, &station.camera, &starts, &station.standing, &spread);
    let camera = installation.apply(&station.camera).reduced(model.locator.fine);
    let score = search.score(&fields[0].fine, &camera, &poses[0]);
    Ok((installation, poses, score))
}

/// The standing ranges, widened by what an installation error looks like on the plate. One photo cannot tell a turned camera
/// from a shifted assembly, so calibration leaves part of the one in the other and judging needs the margin too.
pub(super) fn widened(model: &Model) -> [[f64; 2]; 4] {
    let station = &model.station;
    let distance = station.camera.position.iter().map(|v| v * v).sum::<f64>().sqrt();
    let length = station.install.position_mm + station.install.angle_rad * distance;
    let margins = [length, length, 0.0, station.install.angle_rad * 2.0];
    let mut wide = station.standing;
    for (range, margin) in wide.iter_mut().zip(margins) {
        if range[1] > range[0] {
            *range = [range[0] - margin, range[1] + margin];
        }
    }
    wide
}

/// Standard deviation of the pixel noise from the diagonal Haar band of level 1, which edges hardly reach
/// (Donoho and Johnstone 1994): σ = 2 · median |D| / 0.6745 with D = (a + d - b - c) / 4.
pub fn noise_of(light: &Grid) -> f64 {
    let mut diagonal = Vec::with_capacity(light.values.len() / 4);
    for y in (0..light.height - 1).step_by(2) {
        for x in (0..light.width - 1).step_by(2) {
            let d = light.at(x, y) + light.at(x + 1, y + 1) - light.at(x + 1, y) - light.at(x, y + 1);
            diagonal.push((d / 4.0).abs());
        }
    }
    2.0 * f64::from(linear::median(&mut diagonal)) / 0.6745
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_measured_beside_strong_edges() {
        let mut state = 9u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut normal = || (0..12).map(|_| uniform()).sum::<f32>() - 6.0;
        let bars = |i: usize| if (i / 16).is_multiple_of(2) { 0.2 } else { 0.7 };
        let light = Grid::new(128, 128, (0..128 * 128).map(|i| bars(i % 128) + 0.02 * normal()).collect());
        let sigma = noise_of(&light);
        assert!((sigma / 0.02 - 1.0).abs() < 0.06, "{sigma}");
    }
}
