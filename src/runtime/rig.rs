//! The file of a rig: several cameras that look at one assembly and give one verdict.
//!
//! In: text. Out: [`Rig`]: the model of every camera, and for each component and error mode how their evidence is summed; and
//! [`RigCalibration`], one calibration a camera. Both begin with the format of model files and end with a digest, and reading
//! them is as safe on hostile input. A camera's model in it is what a file of that camera alone would hold.

use super::calibrate::Calibration;
use super::model::{self, FORMAT, Model, ModelError, Promise, ensure};
use serde::{Deserialize, Serialize};

/// Caps on counts, far above any real rig.
const MOST_CAMERAS: usize = 16;
const MOST_COMPONENTS: usize = 2_000;
const MOST_MODES: usize = 64;
/// Rig, cameras, and the depth of a model.
const DEPTH: usize = 10;

/// What a rig needs to judge the photos of one assembly together.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rig {
    pub format: u32,
    /// Name of the station.
    pub rig: String,
    /// Version of gonogo that wrote it.
    pub writer: String,
    /// Name of the assembly, and digest of the resolved spec.
    pub assembly: String,
    pub spec: String,
    pub seed: u64,
    /// Of the joint verdict.
    pub promise: Promise,
    pub components: Vec<Component>,
    /// One model a camera, its station named `rig.camera`; the promise in it is that of the camera alone.
    pub cameras: Vec<Model>,
}

/// What the cameras know of one component together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Component {
    pub name: String,
    pub modes: Vec<Mode>,
    /// Joint scores of held-out renders, ascending.
    pub good_scores: Vec<f64>,
    pub fault_scores: Vec<f64>,
}

/// One way in which a component may be faulty, and who can tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mode {
    /// `missing`, `not seated`, `misplaced` …
    pub fault: String,
    /// The component is faulty in this way when the sum over the cameras is below.
    pub threshold: f64,
    pub seen: Vec<Seen>,
}

/// How one camera tells a mode: it adds `weight * (log-likelihood ratio per coefficient - offset)` to the sum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Seen {
    /// Index into the rig's cameras.
    pub camera: u32,
    pub weight: f64,
    pub offset: f64,
    /// Squared distance of good and faulty renders in this camera, in standard deviations.
    pub power: f64,
}

impl Rig {
    /// The canonical text.
    pub fn write(&self) -> String {
        model::seal(&model::to_ron_down_to(DEPTH, self))
    }

    /// Reads a rig and checks it: format, digest, sizes, and that its parts belong together.
    pub fn read(text: &str) -> Result<Rig, ModelError> {
        let body = model::open(text, FORMAT)?;
        if !model::is_rig(body) {
            return Err(ModelError::Malformed("it holds the model of one camera, not of several".into()));
        }
        let rig: Rig = ron::from_str(body).map_err(|e| ModelError::Malformed(e.to_string()))?;
        rig.check().map_err(|why| ModelError::Malformed(why.into()))?;
        Ok(rig)
    }

    /// Digest of the canonical text; a calibration names the rig it belongs to by it.
    pub fn digest(&self) -> String {
        model::digest_of(&model::to_ron_down_to(DEPTH, self))
    }

    /// Names of the cameras, in their order.
    pub fn names(&self) -> Vec<&str> {
        self.cameras.iter().map(camera_name).collect()
    }

    fn check(&self) -> Result<(), &'static str> {
        ensure((1..=MOST_CAMERAS).contains(&self.cameras.len()), "no cameras, or too many")?;
        ensure(self.components.len() <= MOST_COMPONENTS, "too many components")?;
        let names = self.names();
        let is_new = |(i, name): (usize, &&str)| is_word(name) && !names[..i].contains(name);
        ensure(names.iter().enumerate().all(is_new), "names of cameras out of range")?;
        for camera in &self.cameras {
            let of_rig = camera.station.name.split_once('.').is_some_and(|(rig, _)| rig == self.rig);
            ensure(of_rig && camera.spec == self.spec, "a camera of another station")?;
            ensure(camera.format == FORMAT, "a camera of another format")?;
            camera.check()?;
        }
        self.components.iter().try_for_each(|component| component.check(&self.cameras))
    }
}

/// The camera's own name: what stands behind the rig's.
pub fn camera_name(model: &Model) -> &str {
    model.station.name.split_once('.').map_or(&model.station.name, |(_, camera)| camera)
}

/// Names are given on command lines, and name folders.
fn is_word(name: &str) -> bool {
    !name.is_empty() && name.len() <= 256 && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_')
}

impl Component {
    fn check(&self, cameras: &[Model]) -> Result<(), &'static str> {
        ensure(self.modes.len() <= MOST_MODES, "too many error modes")?;
        for mode in &self.modes {
            ensure(!mode.threshold.is_nan(), "threshold out of range")?;
            ensure((1..=MOST_CAMERAS).contains(&mode.seen.len()), "an error mode that no camera sees")?;
            for seen in &mode.seen {
                let numbers = seen.weight.is_finite() && seen.offset.is_finite() && seen.power.is_finite();
                ensure(numbers && seen.weight >= 0.0 && seen.power >= 0.0, "weights out of range")?;
                let camera = cameras.get(seen.camera as usize);
                let knows = camera.is_some_and(|camera| !hypotheses(camera, &self.name, &mode.fault).1.is_empty());
                ensure(knows, "an error mode that its camera does not know")?;
            }
        }
        Ok(())
    }
}

/// The node of a component in a camera's model, and its hypotheses of one fault.
pub fn hypotheses(camera: &Model, component: &str, fault: &str) -> (usize, Vec<usize>) {
    let Some(index) = camera.nodes.iter().position(|node| node.name == component) else { return (0, Vec::new()) };
    let all = &camera.nodes[index].hypotheses;
    (index, (1..all.len()).filter(|&h| all[h].fault == fault).collect())
}

/// One calibration for each camera of a rig, in their order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigCalibration {
    pub format: u32,
    /// Digest of the rig it belongs to.
    pub rig: String,
    pub cameras: Vec<Calibration>,
}

impl RigCalibration {
    pub fn of(rig: &Rig, cameras: Vec<Calibration>) -> RigCalibration {
        RigCalibration { format: super::calibrate::FORMAT, rig: rig.digest(), cameras }
    }

    /// The spec's word for everything: what is used before any photo was taken.
    pub fn nominal(rig: &Rig) -> RigCalibration {
        RigCalibration::of(rig, rig.cameras.iter().map(Calibration::nominal).collect())
    }

    pub fn write(&self) -> String {
        model::seal(&model::to_ron_down_to(DEPTH, self))
    }

    /// Reads a calibration and checks that it belongs to `rig`.
    pub fn read(text: &str, rig: &Rig) -> Result<RigCalibration, ModelError> {
        let body = model::open(text, super::calibrate::FORMAT)?;
        let malformed = |why: &str| ModelError::Malformed(why.into());
        if !model::is_rig(body) {
            return Err(malformed("the calibration is of one camera, the model of several: calibrate again"));
        }
        let calibration: RigCalibration =
            ron::from_str(body).map_err(|e| ModelError::Malformed(format!("not a calibration: {e}")))?;
        if calibration.rig != rig.digest() || calibration.cameras.len() != rig.cameras.len() {
            return Err(malformed("the calibration belongs to another model: calibrate again"));
        }
        calibration.cameras.iter().zip(&rig.cameras).try_for_each(|(own, model)| own.check(model))?;
        Ok(calibration)
    }
}
