//! The model file: everything a station needs to judge photos, in one canonical text.
//!
//! `format` comes first and the digest last; between them a person can read what the model is for. Grey values are
//! quantised integers, one image row a line. Same spec and same version give the same bytes; nothing here knows the
//! time. Reading is safe on hostile input: sizes are capped, everything is checked, nothing panics.

use super::camera::Camera;
use super::photo::Tone;
use super::rise::Rise;
use super::row::Row;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The format this version writes, and the only one it reads so far.
pub const FORMAT: u32 = 7;
/// Sizes of squares in which a node is held against its good state: the cells of its coarsest level and of the one before.
pub const SCALES: usize = 3;
/// Larger files are not written, and refused before they are parsed (bytes): ten times what an assembly of twenty components takes.
const LARGEST_FILE: usize = 1 << 30;
/// Caps on counts, far above any real station.
const MOST_NODES: usize = 2_000;
const MOST_LAMPS: usize = 256;
const MOST_POINTS: usize = 200_000;
const LARGEST_PATCH: u32 = 4_096;
const LARGEST_IMAGE: u32 = 20_000;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    pub format: u32,
    /// Version of gonogo that wrote it.
    pub writer: String,
    /// Name of the assembly, and digest of the resolved spec.
    pub assembly: String,
    pub spec: String,
    pub seed: u64,
    pub station: Station,
    pub promise: Promise,
    pub locator: Locator,
    pub nodes: Vec<Node>,
}

/// The station as resolved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    pub name: String,
    /// Where the spec says the camera is.
    pub camera: Camera,
    pub tone: Tone,
    /// Share of light that the lens loses in the corners of the image, falling with the square of the radius. Left out of files
    /// where it is 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub vignetting: f64,
    pub install: Install,
    /// Ranges in which the assembly may stand: x, y, z (mm) and turn about z (rad).
    pub standing: [[f64; 2]; 4],
    /// Sensor noise, share of full scale.
    pub noise: f64,
    pub lamps: Vec<Lamp>,
    /// A calibration photo whose gradients correlate less with their re-synthesis does not show this assembly.
    pub least_correlation: f64,
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// How far the camera may be from where the spec says: half-widths.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Install {
    pub position_mm: f64,
    pub angle_rad: f64,
    pub focal_share: f64,
    pub k1: [f64; 2],
}

/// A light group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    pub name: String,
    /// The light of the station (index) that it is part of.
    pub light: u32,
    /// Weight before calibration: photo value = sum of weight times group image.
    pub power: f64,
    /// Drift between photos: ± this share.
    pub drift: f64,
}

/// What the compiler measured on renders it had not trained on, with the whole detector.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Promise {
    /// Rate the spec asks for.
    pub false_reject_asked: f64,
    pub false_reject: Rate,
    pub escape: Rate,
    pub modes: Vec<ModeRate>,
}

/// Events among trials, with the upper end of the 95 % interval (Clopper and Pearson).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rate {
    pub events: u32,
    pub trials: u32,
    pub upper_95: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ModeRate {
    pub component: String,
    pub fault: String,
    pub escape: Rate,
}

/// Edge points that tell where the assembly stands, coarse and fine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Locator {
    /// px of the photo per px of the coarse and of the fine search.
    pub coarse: u32,
    pub fine: u32,
    /// Edges count whichever of their sides is the brighter: where the light decides that, an edge has a place but no sign.
    #[serde(default)]
    pub unsigned: bool,
    /// Each group contributes the best of its alternatives.
    pub groups: Vec<PointGroup>,
    /// Below this score the assembly counts as not found.
    pub accept: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointGroup {
    /// The component or components the points are on.
    pub name: String,
    pub alternatives: Vec<PointSet>,
}

/// Points in µm of the assembly's frame with the edge's direction (1/1000): x, y, z, dx, dy, dz. In the image, light
/// grows to the right of the edge's direction turned by a quarter turn from x to y.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointSet {
    pub fault: String,
    pub coarse: Vec<[i32; 6]>,
    pub fine: Vec<[i32; 6]>,
}

/// A place where errors of one component show.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Node {
    /// The component.
    pub name: String,
    /// The node above it in the object tree; the root is the assembly itself.
    pub parent: Option<u32>,
    /// Level in the tree: 1 below the root.
    pub level: u32,
    /// Height of the plane through which the node's image is carried to the photo (mm, assembly frame).
    pub plane: f64,
    /// px of the photo per px of the node.
    pub factor: u32,
    /// Resolutions at which its gradients are compared, each half as fine as the one before.
    pub levels: u32,
    /// Top left corner in the nominal photo, in node px, and size in node px.
    pub origin: [i32; 2],
    pub size: [u32; 2],
    /// Box of the visible component in the nominal photo (px): x0, y0, x1, y1.
    pub visible: [f64; 4],
    /// Mask: per row, alternately the first column and the number of columns.
    pub mask: Vec<Vec<u32>>,
    /// Standard deviation of the node's own shift given the pose, before calibration (px of the photo).
    pub spread: [f64; 2],
    /// Nodes whose image this component disturbs when it is faulty.
    pub disturbs: Vec<u32>,
    /// Per lamp, the radiance of one step of the integers below.
    pub steps: Vec<f64>,
    /// Scores of held-out renders, ascending: log-likelihood ratios per coefficient, less the error mode's threshold.
    pub good_scores: Vec<f64>,
    pub fault_scores: Vec<f64>,
    /// What held-out good renders show of what this model does not know: for the squares of the coarsest level, then for those of
    /// the levels before; all of them, or none in a model that was not held against renders.
    pub usual: Vec<Usual>,
    /// How the part rises from its seat, where its place in the image can tell.
    pub rise: Option<Rise>,
    /// The first is the good state.
    pub hypotheses: Vec<Hypothesis>,
    /// What the good state looks like beside the faults of other components.
    pub disturbed: Vec<Disturbed>,
}

/// How unlike its good state a node may be in the squares of one level (see [`super::strange`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Usual {
    /// Per square what the second highest of held-out good renders shows, in steps.
    pub high: Row,
    /// Of the largest excess over that in a good render, held against the others: its middle, and its standard deviation upwards beyond what the nodes of
    /// a photo have in common (logarithms).
    pub excess: [f64; 2],
}

/// The good state of a component while another is faulty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Disturbed {
    /// The node of the faulty component.
    pub by: u32,
    /// Its fault.
    pub fault: String,
    /// How this node looks then: one image per draw and light group.
    pub images: Vec<Image>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hypothesis {
    /// `good`, `missing`, `not seated`, `misplaced`.
    pub fault: String,
    /// What the sweep covers, for people: `0.8 .. 4.0 mm`.
    pub sweep: String,
    /// The component is faulty when the log-likelihood ratio per coefficient of the good state against this is below.
    pub threshold: f64,
    /// One image per draw and light group.
    pub images: Vec<Image>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Image {
    pub draw: u32,
    pub lamp: u32,
    pub rows: Vec<Row>,
}

/// Why a model could not be read.
#[derive(Debug, Clone, PartialEq)]
pub enum ModelError {
    Newer { format: u32 },
    Older { format: u32 },
    Digest { expected: String, actual: String },
    Malformed(String),
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ModelError::Newer { format } => {
                write!(f, "E0801: this is model format {format}, this gonogo reads format {FORMAT}: ")?;
                write!(f, "take a newer gonogo, or compile the spec again with this one")
            }
            ModelError::Older { format } => {
                write!(f, "E0801: this is model format {format}, this gonogo reads format {FORMAT}: ")?;
                write!(f, "compile the spec again")
            }
            ModelError::Digest { expected, actual } => {
                write!(f, "E0802: the model was changed or cut short after it was written ")?;
                write!(f, "(its digest says {expected}, its content {actual}): compile the spec again")
            }
            ModelError::Malformed(why) => write!(f, "E0803: this is not a model file: {why}"),
        }
    }
}

impl std::error::Error for ModelError {}

/// The line the file ends with, up to the digest itself.
const DIGEST_LINE: &str = "// digest: blake3:";

impl Model {
    /// The canonical text.
    pub fn write(&self) -> String {
        seal(&to_ron(self))
    }

    /// Reads a model and checks it: format, digest, sizes.
    pub fn read(text: &str) -> Result<Model, ModelError> {
        let body = open(text, FORMAT)?;
        if is_rig(body) {
            let why = "it holds the models of several cameras that judge together, not that of one";
            return Err(ModelError::Malformed(why.into()));
        }
        let model: Model = ron::from_str(body).map_err(|e| ModelError::Malformed(e.to_string()))?;
        model.check().map_err(|why| ModelError::Malformed(why.into()))?;
        Ok(model)
    }

    /// Digest of the canonical text; a calibration names the model it belongs to by it.
    pub fn digest(&self) -> String {
        digest_of(&to_ron(self))
    }

    pub(super) fn check(&self) -> Result<(), &'static str> {
        ensure(self.nodes.len() <= MOST_NODES, "too many nodes")?;
        ensure((1..=MOST_LAMPS).contains(&self.station.lamps.len()), "no lamps, or too many")?;
        ensure(self.station.camera.size.iter().all(|s| (8..=LARGEST_IMAGE).contains(s)), "image size out of range")?;
        ensure(self.station.is_finite(), "a number of the station is not finite")?;
        ensure(self.station.lamps.iter().all(|l| (l.light as usize) < MOST_LAMPS), "light out of range")?;
        self.locator.check(self.station.camera.size)?;
        self.nodes.iter().try_for_each(|node| node.check(self.nodes.len(), self.station.lamps.len()))
    }
}

impl Station {
    fn is_finite(&self) -> bool {
        let camera = &self.camera;
        let numbers =
            [camera.focal, camera.k1, camera.k2, self.noise, self.install.position_mm, self.install.angle_rad];
        let lamps = self.lamps.iter().all(|l| l.power.is_finite() && l.drift.is_finite() && l.power >= 0.0);
        numbers.iter().chain(&camera.position).chain(camera.axes.as_flattened()).all(|v| v.is_finite())
            && self.standing.as_flattened().iter().all(|v| v.is_finite() && v.abs() < 1e6)
            && self.standing.iter().all(|[low, high]| low <= high)
            && camera.position.iter().all(|v| v.abs() < 1e9)
            && (0.0..1e6).contains(&self.install.position_mm)
            && (0.0..7.0).contains(&self.install.angle_rad)
            && self.install.focal_share.is_finite()
            && self.least_correlation.is_finite()
            && self.install.k1.iter().all(|v| v.is_finite())
            && camera.focal > 0.0
            && (0.0..=0.9).contains(&self.vignetting)
            && lamps
    }
}

impl Locator {
    fn check(&self, size: [u32; 2]) -> Result<(), &'static str> {
        let factor = |f: u32| f >= 1 && f <= size[0].min(size[1]) / 4;
        ensure(factor(self.coarse) && factor(self.fine), "locator factors out of range")?;
        ensure(self.groups.len() <= MOST_NODES, "too many point groups")?;
        for group in &self.groups {
            ensure(
                !group.alternatives.is_empty() && group.alternatives.len() <= 16,
                "point alternatives out of range",
            )?;
            let small = |s: &PointSet| s.coarse.len() <= MOST_POINTS && s.fine.len() <= MOST_POINTS;
            ensure(group.alternatives.iter().all(small), "too many edge points")?;
        }
        Ok(())
    }
}

impl Node {
    fn check(&self, nodes: usize, lamps: usize) -> Result<(), &'static str> {
        let [width, height] = self.size;
        ensure(
            (4..=LARGEST_PATCH).contains(&width) && (4..=LARGEST_PATCH).contains(&height),
            "node size out of range",
        )?;
        ensure((1..=1024).contains(&self.factor), "node factor out of range")?;
        ensure((1..=12).contains(&self.levels), "node levels out of range")?;
        ensure(self.origin.iter().all(|o| o.abs() < 1 << 20), "node origin out of range")?;
        let steps = self.steps.len() == lamps && self.steps.iter().all(|s| s.is_finite() && *s > 0.0);
        ensure(self.plane.is_finite() && steps, "node numbers out of range")?;
        ensure(self.spread.iter().all(|s| s.is_finite() && *s > 0.0), "node spread out of range")?;
        ensure(self.hypotheses.iter().all(|h| !h.threshold.is_nan()), "threshold out of range")?;
        ensure(matches!(self.usual.len(), 0 | SCALES), "node usual sizes")?;
        let in_range = |u: &Usual| u.excess.iter().all(|v| v.is_finite()) && u.excess[1] > 0.0;
        ensure(self.usual.iter().all(in_range), "node usual out of range")?;
        ensure(self.rise.iter().all(Rise::is_sound), "node rise out of range")?;
        ensure(self.parent.is_none_or(|p| (p as usize) < nodes), "node parent out of range")?;
        ensure(self.disturbs.iter().all(|&d| (d as usize) < nodes), "disturbed node out of range")?;
        ensure(self.mask.len() == height as usize, "mask rows")?;
        for row in &self.mask {
            let runs =
                row.chunks(2).all(|run| run.len() == 2 && run[0].checked_add(run[1]).is_some_and(|e| e <= width));
            ensure(runs, "mask runs")?;
        }
        ensure(!self.hypotheses.is_empty() && self.hypotheses.len() <= 64, "number of hypotheses")?;
        ensure(self.disturbed.len() <= 256, "number of disturbances")?;
        ensure(self.disturbed.iter().all(|d| (d.by as usize) < nodes), "disturbing node out of range")?;
        let states = self.disturbed.iter().map(|d| &d.images);
        let mut all = self.hypotheses.iter().map(|h| &h.images).chain(states);
        all.try_for_each(|images| check_images(images, lamps, width as usize, height as usize))
    }
}

/// The images of a state are all draws of all lamps, in order.
fn check_images(images: &[Image], lamps: usize, width: usize, height: usize) -> Result<(), &'static str> {
    ensure(images.len().is_multiple_of(lamps) && images.len() >= 2 * lamps, "number of images of a hypothesis")?;
    ensure(images.len() <= 10_000, "too many images")?;
    for (i, image) in images.iter().enumerate() {
        let place = image.draw as usize == i / lamps && image.lamp as usize == i % lamps;
        ensure(place, "images out of order")?;
        ensure(image.rows.len() == height && image.rows.iter().all(|r| r.0.len() == width), "image size")?;
    }
    Ok(())
}

pub(super) fn ensure(holds: bool, otherwise: &'static str) -> Result<(), &'static str> {
    if holds { Ok(()) } else { Err(otherwise) }
}

/// Pretty RON down to rows: an image row stands on one line.
pub(super) fn to_ron<T: Serialize>(value: &T) -> String {
    /// Model, nodes, node, hypotheses, hypothesis, images, image, rows.
    const DEPTH: usize = 8;
    to_ron_down_to(DEPTH, value)
}

/// Pretty RON down to a depth.
pub(super) fn to_ron_down_to<T: Serialize>(depth: usize, value: &T) -> String {
    let config = ron::ser::PrettyConfig::new().depth_limit(depth).new_line("\n").indentor(" ");
    let mut text = ron::ser::to_string_pretty(value, config).expect("plain data always serialises");
    text.push('\n');
    text
}

/// Adds the digest line.
pub(super) fn seal(body: &str) -> String {
    format!("{body}{DIGEST_LINE}{}\n", digest_of(body))
}

/// Why a model of this many bytes is not written, if it is too large to be read again.
pub fn too_large(bytes: usize) -> Option<String> {
    let (has, most) = (bytes >> 20, LARGEST_FILE >> 20);
    let less = "`train { images }` and watch fewer components: it grows with both";
    (bytes > LARGEST_FILE).then(|| format!("the model takes {has} MiB, and no more than {most} are read: lower {less}"))
}

/// Checks size, format and digest; the text without its digest line.
pub(super) fn open(text: &str, known: u32) -> Result<&str, ModelError> {
    if text.len() > LARGEST_FILE {
        return Err(ModelError::Malformed(format!("{} bytes are more than any model has", text.len())));
    }
    match format_of(text) {
        Some(format) if format > known => return Err(ModelError::Newer { format }),
        Some(format) if format < known => return Err(ModelError::Older { format }),
        Some(_) => {}
        None => return Err(ModelError::Malformed("it does not begin with a format number".into())),
    }
    let cut = || ModelError::Digest { expected: "nothing (the last line is missing)".into(), actual: digest_of(text) };
    let start = text.rfind(DIGEST_LINE).ok_or_else(cut)?;
    let (body, line) = text.split_at(start);
    let expected = line[DIGEST_LINE.len()..].trim_end();
    let actual = digest_of(body);
    if expected != actual {
        return Err(ModelError::Digest { expected: expected.chars().take(64).collect(), actual });
    }
    Ok(body)
}

/// The integer after the leading `(format:`, read before anything else so that other formats get a clear answer.
fn format_of(text: &str) -> Option<u32> {
    let rest = text.trim_start().strip_prefix('(')?.trim_start().strip_prefix("format")?;
    let rest = rest.trim_start().strip_prefix(':')?.trim_start();
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[..digits].parse().ok()
}

/// Whether a text is of several cameras ([`super::rig`]): `rig` stands behind its format.
pub fn is_rig(text: &str) -> bool {
    let behind = |text: &str| Some(text.trim_start().split_once(',')?.1.trim_start().starts_with("rig:"));
    format_of(text).is_some() && behind(text).unwrap_or(false)
}

pub(super) fn digest_of(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex().to_string()
}

#[cfg(test)]
pub(crate) mod tests;
