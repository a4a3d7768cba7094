//! The resolved design: what every later stage reads.
//!
//! Lengths are millimetres and angles radians. Every number that can vary is a [`Dimension`] in one table, sampled once
//! per draw and used wherever its name stands, so faces that are flush on the drawing stay flush in every instance.
//! Nothing here refers to the syntax tree but for spans.

pub use super::per_photo::PerPhoto;
pub use super::primitive::{Corner, Extent, Outline, OutlinePath, OutlineSide, Shape};
use crate::diag::Span;
use crate::units::{Quantity, Range};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

/// Index into [`Design::dims`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub struct DimId(pub u32);

/// Which way material goes when a dimension grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Sense {
    /// A shaft-like size: the largest value has most material.
    External,
    /// A hole-like size: the smallest value has most material.
    Internal,
    /// A position, an angle, a pattern radius, a size used both ways: MMC and LMC are its nominal value
    /// unless the spec states them.
    Neutral,
}

/// One number of the drawing with its limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Dimension {
    /// The path that names it to the user: `gear.bore.d`, `alignment_pin[2].z`, `pin_size`.
    pub name: String,
    pub quantity: Quantity,
    pub range: Range,
    pub sense: Sense,
    /// Maximum and least material conditions.
    pub mmc: f64,
    pub lmc: f64,
    #[serde(skip)]
    pub span: Span,
}

/// Arithmetic over dimensions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Expr {
    Const(f64),
    Dim(DimId),
    Neg(Box<Expr>),
    Add(Box<Expr>, Box<Expr>),
    Sub(Box<Expr>, Box<Expr>),
    Mul(Box<Expr>, Box<Expr>),
    Div(Box<Expr>, Box<Expr>),
}

/// One value per dimension, indexed by [`DimId`]: nominal, MMC, LMC or a random draw (see `variation`).
pub type Values = [f64];

impl Expr {
    pub fn eval(&self, values: &Values) -> f64 {
        match self {
            Expr::Const(v) => *v,
            Expr::Dim(id) => values[id.0 as usize],
            Expr::Neg(a) => -a.eval(values),
            Expr::Add(a, b) => a.eval(values) + b.eval(values),
            Expr::Sub(a, b) => a.eval(values) - b.eval(values),
            Expr::Mul(a, b) => a.eval(values) * b.eval(values),
            Expr::Div(a, b) => a.eval(values) / b.eval(values),
        }
    }

    /// Every dimension the expression reads.
    pub fn dims(&self, out: &mut Vec<DimId>) {
        match self {
            Expr::Const(_) => {}
            Expr::Dim(id) => out.push(*id),
            Expr::Neg(a) => a.dims(out),
            Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) | Expr::Div(a, b) => {
                a.dims(out);
                b.dims(out);
            }
        }
    }
}

/// A rigid transform `T · Rz · Ry · Rx`: translation in mm, rotations in rad.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoseExpr {
    pub t: [Expr; 3],
    pub r: [Expr; 3],
}

impl PoseExpr {
    pub fn identity() -> Self {
        let zero = || [Expr::Const(0.0), Expr::Const(0.0), Expr::Const(0.0)];
        PoseExpr { t: zero(), r: zero() }
    }

    pub fn eval(&self, values: &Values) -> Isometry3<f64> {
        let [x, y, z] = [0, 1, 2].map(|i| self.t[i].eval(values));
        let [a, b, c] = [0, 1, 2].map(|i| self.r[i].eval(values));
        let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        let rotation = turn(Vector3::z_axis(), c) * turn(Vector3::y_axis(), b) * turn(Vector3::x_axis(), a);
        Isometry3::from_parts(Translation3::new(x, y, z), rotation)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Op {
    Add,
    Cut,
    /// Keep only what lies inside.
    Keep,
}

/// One line of a part: one or several copies of a primitive, added to, cut from or intersected with what stands above.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Feature {
    pub name: String,
    pub op: Op,
    /// Written as a pattern (`3x`): its copies are named `bore[1]`, `bore[2]` …, otherwise plain `bore`.
    pub patterned: bool,
    pub copies: Vec<FeatureCopy>,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureCopy {
    pub shape: Shape,
    /// In the part's frame.
    pub pose: PoseExpr,
}

/// One piece of a part. A part placed several times has an entry here for every piece, because pieces differ: the entries
/// share a name, and the dimensions of each carry the component's (`alignment_pin[2].foot_step.d`). The dimensions of a part
/// placed once carry the part's (`gear.bore.d`). A `let` outside all parts stays one dimension, shared by whatever uses it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Part {
    /// As in the spec; the same for all pieces of a part.
    pub name: String,
    /// Index into [`Design::materials`].
    pub material: usize,
    pub features: Vec<Feature>,
    #[serde(skip)]
    pub span: Span,
}

/// A placed part. Parents come before their children in [`Design::components`]; component 0 is the root.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Component {
    /// `gear`, `alignment_pin[2]`.
    pub name: String,
    /// Index into [`Design::parts`].
    pub part: usize,
    /// The component in whose frame it is placed; `None` for the root.
    pub parent: Option<usize>,
    /// Frame of the parent's feature it is placed on (`on gear.pin_hole[2]`), in the parent's frame.
    pub frame: PoseExpr,
    /// Placement in that frame, with its tolerance zone.
    pub pose: PoseExpr,
    /// Axes (x, y, z, rx, ry, rz) the spec calls `free`. A free turn is drawn over a whole turn.
    pub free: [bool; 6],
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum MaterialKind {
    /// GGX conductor.
    Metal,
    /// Diffuse body under a dielectric coat.
    Plastic,
    /// Lambertian: wood, black oxide, anodised or painted matt surfaces, fixtures.
    Matt,
}

/// Which way the grooves of machining run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Grooves {
    /// Circles about the axis that a face was turned about.
    Circular,
    /// Straight along x (0), y (1) or z (2) of the part's frame.
    Straight(usize),
}

/// The lay of a surface (ISO 1302): it is smoother along its grooves than across them, which draws highlights out into
/// streaks across the grooves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lay {
    pub grooves: Grooves,
    /// GGX alpha along the grooves, as a share of that across them.
    pub along: f64,
}

/// How a surface answers light. Ranges are drawn once per component and image: parts differ from one another.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Material {
    pub name: String,
    pub kind: MaterialKind,
    /// Complex refractive index (metals), as seen by a monochrome camera under white light.
    pub n: f64,
    pub k: f64,
    /// The same under light of the colours that the spec's stations use; left out where they use none, so that a design under
    /// white light serialises as ever.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tints: Vec<Tint>,
    /// Share of light returned: scales the Fresnel term of a metal; albedo of the body of plastics and matt surfaces.
    pub reflectance: Range,
    /// GGX alpha (metals, coat of plastics); across the grooves where there is a lay.
    pub roughness: Range,
    /// Width (mm) of the rounding of convex edges on each of the two faces: no real edge is sharp.
    pub edge_break: Range,
    /// Relative amplitude of the blotches on the surface (dirt, oxide, grain), 0 for none.
    pub mottle: f64,
    /// Size of the blotches in mm along x, y and z of the part's frame (unequal: grain).
    pub mottle_size: [f64; 3],
    /// The grooves that machining left. Left out where there are none, so that a design without them serialises as ever.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lay: Option<Lay>,
    #[serde(skip)]
    pub span: Span,
}

/// What a lamp's light is made of.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Colour {
    #[default]
    White,
    /// Light-emitting diodes of 450, 530, 625 and 850 nm.
    Blue,
    Green,
    Red,
    Infrared,
}

impl Colour {
    pub fn is_white(&self) -> bool {
        *self == Colour::White
    }
}

/// Complex refractive index of a metal under light of one colour.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tint {
    pub colour: Colour,
    pub n: f64,
    pub k: f64,
}

/// A camera as installed, or as the compiler may choose it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraSpec {
    /// Image width and height in px.
    pub image: [u32; 2],
    /// Focal length in mm; its range is the installation's uncertainty.
    pub focal: Range,
    /// Pixel pitch in mm.
    pub pitch: f64,
    /// Point looked at, in the assembly's frame (mm).
    pub aim: [f64; 3],
    pub placing: CameraPlacing,
    /// Radial distortion, radius normalised by half the image width.
    pub k1: Range,
    /// Its next term, of the fourth power of the radius. This and the next three are left out where they are usual, so that a design
    /// without them serialises as ever.
    #[serde(skip_serializing_if = "is_zero")]
    pub k2: f64,
    /// Share of light that the lens loses in the corners, falling with the square of the radius.
    #[serde(skip_serializing_if = "is_none")]
    pub vignetting: Range,
    /// Electrons at full scale, which the shot noise follows; infinite where that noise is not asked for.
    #[serde(skip_serializing_if = "is_endless")]
    pub full_well: f64,
    /// Bits of a grey value.
    #[serde(skip_serializing_if = "is_a_byte")]
    pub depth: u32,
    /// Installation error: ± mm on each axis of the position, ± rad about each axis.
    pub install_mm: f64,
    pub install_rad: f64,
    /// Standard deviation of the point spread in px.
    pub blur: PerPhoto,
    pub response: Response,
    #[serde(skip)]
    pub span: Span,
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

fn is_none(range: &Range) -> bool {
    *range == Range::exactly(0.0)
}

fn is_endless(number: &f64) -> bool {
    number.is_infinite()
}

fn is_a_byte(bits: &u32) -> bool {
    *bits == 8
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum CameraPlacing {
    /// Distance from the aim in mm; elevation above the horizon and azimuth (where the camera stands, from +x
    /// towards +y) in rad. +x of the world is to the right when it stands at -y (azimuth -90 degrees).
    Fixed { distance: f64, elevation: f64, azimuth: f64 },
    /// Ranges among which the compiler chooses.
    Auto { distance: Range, elevation: Range, azimuth: Range },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Response {
    Linear,
    Srgb,
}

/// A lamp, or the light of the room.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LightSpec {
    pub name: String,
    pub shape: LightShape,
    #[serde(skip_serializing_if = "Colour::is_white")]
    pub colour: Colour,
    /// Radiance relative to the other lights; a prior, calibration replaces it.
    pub power: f64,
    /// How far the lamp drifts between photos: ± this share.
    pub drift: f64,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum LightShape {
    /// Round the lens: inner and outer radius, and how far behind the front of the lens (mm). The front of the lens is
    /// the camera's position.
    Ring { inner: f64, outer: f64, setback: f64 },
    /// A flat panel or bar: size in mm across (horizontal) and upright, its centre and the point it is aimed at.
    Panel { width: f64, height: f64, at: [f64; 3], aim: [f64; 3] },
    /// The room: light from the whole upper hemisphere, in this many patches of equal solid angle (1: uniform).
    Room { patches: u32 },
}

/// The surface the assembly stands on: an endless plane z = `z` of the assembly's frame (mm).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Floor {
    pub z: f64,
    pub material: usize,
}

/// A camera with what it stands in. The cameras of a rig are stations of their own that share all but the camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Station {
    /// Of a camera of a rig `line.top`: names that are written have no dot.
    pub name: String,
    pub camera: CameraSpec,
    pub lights: Vec<LightSpec>,
    pub floor: Option<Floor>,
    /// Where the assembly may stand: x, y, z in mm and turn about z in rad.
    pub x: Range,
    pub y: Range,
    pub z: Range,
    pub rz: Range,
    /// Exposure relative to the nominal one; its nominal value is how much brighter or darker than usual photos are.
    pub exposure: PerPhoto,
    /// Standard deviation of the sensor's noise, share of full scale.
    pub noise: f64,
    #[serde(skip)]
    pub span: Span,
}

impl Station {
    /// The names of the rig and of this camera in it; `None` for the camera of a station that has but one.
    pub fn in_rig(&self) -> Option<(&str, &str)> {
        self.name.split_once('.')
    }

    /// The name of the station as the spec has it.
    pub fn place_name(&self) -> &str {
        self.in_rig().map_or(&self.name, |(rig, _)| rig)
    }
}

/// What the inspector answers for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Inspect {
    /// Watched components (indices), in the order of [`Design::components`].
    pub watch: Vec<Watch>,
    /// Whether what lies on the root counts too. It stands where it stands: no error mode is its own.
    pub root: bool,
    /// Share of good assemblies that may be rejected.
    pub false_reject: f64,
    #[serde(skip)]
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Watch {
    pub component: usize,
    /// Levels of the error tree in use; `None` lets visibility decide.
    pub depth: Option<u32>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Train {
    /// Draws of the assembly per scene.
    pub images: u32,
    pub seed: u64,
    /// Resolution levels per node.
    pub levels: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// Draw dimensions uniformly between the limits, or with the mode at nominal.
    pub uniform: bool,
}

/// A face of a component, by name.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FacePath {
    /// Index into [`Design::components`].
    pub component: usize,
    /// The face in its part, as the solid names it: `slab.top`, `bore[2].side`.
    pub face: String,
    #[serde(skip)]
    pub span: Span,
}

/// A distance (mm) between two faces of the assembly that the drawing asks for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measure {
    pub name: String,
    pub from: FacePath,
    pub to: FacePath,
    /// What it has to stay within, if the spec says so.
    pub limits: Option<Range>,
    #[serde(skip)]
    pub span: Span,
}

/// The whole spec, resolved.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Design {
    /// Name of the assembly.
    pub name: String,
    pub dims: Vec<Dimension>,
    pub materials: Vec<Material>,
    pub parts: Vec<Part>,
    pub components: Vec<Component>,
    /// In the order of the spec. Left out where there are none, so that a design without them serialises as ever.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measures: Vec<Measure>,
    pub stations: Vec<Station>,
    pub inspect: Inspect,
    pub train: Train,
}

impl Design {
    /// Every dimension at its nominal value.
    pub fn nominal(&self) -> Vec<f64> {
        self.dims.iter().map(|d| d.range.nominal).collect()
    }

    /// Every dimension at maximum material.
    pub fn mmc(&self) -> Vec<f64> {
        self.dims.iter().map(|d| d.mmc).collect()
    }

    /// Every dimension at least material.
    pub fn lmc(&self) -> Vec<f64> {
        self.dims.iter().map(|d| d.lmc).collect()
    }
}
