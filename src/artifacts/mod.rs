//! What every stage made, as text that people review: for `--emit` and for goldens.
//!
//! In: the outputs of the stages. Out: RON in the user's names, lengths in mm, angles in degrees, numbers rounded to what
//! matters. Summaries, not dumps: a golden of more than 20 KiB is a golden nobody reads. Never changes what it is shown.

pub mod exchange;
pub mod images;
mod model;
pub mod pictures;

pub use model::model_summary;

use crate::assembly::Analysis;
use crate::assembly::contact::{Contact, ContactKind, FaceRef, Fit};
use crate::assembly::error_tree::{self, ErrorTree};
use crate::assembly::place::place;
use crate::assembly::{insertion, liaison};
use crate::design::model::{
    Component, Design, Dimension, FacePath, Feature, LightShape, Measure, Op, Part, Shape, Station, Train,
};
use crate::line::Stage;
use crate::runtime::camera::Camera;
use crate::scene::build::Placed;
use crate::solid::{Solid, Surface};
use crate::units::{Quantity, Range};
use crate::view::choose::Choice;
use crate::view::escape::Weighed;
use crate::view::item_buffer::PixelBox;
use nalgebra::Vector3;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use std::sync::Arc;

/// What can be asked for with `--emit`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Artifact {
    Design,
    Brep,
    Step,
    Contacts,
    Liaison,
    ErrorTrees,
    ObjectTree,
    Insertion,
    Measures,
    Gltf,
    Exploded,
    View,
    Images,
    Model,
}

impl Artifact {
    pub const ALL: [Artifact; 14] = [
        Artifact::Design,
        Artifact::Brep,
        Artifact::Step,
        Artifact::Contacts,
        Artifact::Liaison,
        Artifact::ErrorTrees,
        Artifact::ObjectTree,
        Artifact::Insertion,
        Artifact::Measures,
        Artifact::Gltf,
        Artifact::Exploded,
        Artifact::View,
        Artifact::Images,
        Artifact::Model,
    ];

    /// The word on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Artifact::Design => "design",
            Artifact::Brep => "brep",
            Artifact::Step => "step",
            Artifact::Contacts => "contacts",
            Artifact::Liaison => "liaison",
            Artifact::ErrorTrees => "error-trees",
            Artifact::ObjectTree => "object-tree",
            Artifact::Insertion => "insertion",
            Artifact::Measures => "measures",
            Artifact::Gltf => "gltf",
            Artifact::Exploded => "exploded",
            Artifact::View => "view",
            Artifact::Images => "images",
            Artifact::Model => "model",
        }
    }

    pub fn named(name: &str) -> Option<Artifact> {
        Artifact::ALL.into_iter().find(|a| a.name() == name)
    }

    /// The stage that makes it.
    pub fn stage(self) -> Stage {
        match self {
            Artifact::Design => Stage::Design,
            Artifact::Brep | Artifact::Step => Stage::Solid,
            Artifact::Contacts
            | Artifact::Liaison
            | Artifact::ErrorTrees
            | Artifact::ObjectTree
            | Artifact::Insertion
            | Artifact::Measures
            | Artifact::Gltf
            | Artifact::Exploded => Stage::Assembly,
            Artifact::View => Stage::View,
            Artifact::Images => Stage::Images,
            Artifact::Model => Stage::Verify,
        }
    }

    /// Whether it has a text for people, to be blessed; the others are the same in the formats of other programs.
    pub fn is_reviewed(self) -> bool {
        !matches!(self, Artifact::Step | Artifact::Gltf | Artifact::Exploded)
    }

    /// `error_trees`
    pub fn stem(self) -> String {
        self.name().replace('-', "_")
    }

    /// `error_trees.ron`
    pub fn file(self) -> String {
        format!("{}.ron", self.stem())
    }
}

/// A list that reads as a map, in its own order.
struct Named<T>(Vec<(String, T)>);

impl<T> Named<T> {
    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        self.0.iter().try_for_each(|(k, v)| map.serialize_entry(k, v))?;
        map.end()
    }
}

/// Pretty RON down to `depth` levels; what lies deeper stands on one line.
fn ron(depth: usize, value: &impl Serialize) -> String {
    let config = ron::ser::PrettyConfig::new().depth_limit(depth).new_line("\n").indentor("  ");
    let mut text = ron::ser::to_string_pretty(value, config).expect("plain data always serialises");
    text.push('\n');
    text
}

/// Rounded to `decimals`; never a negative zero, which would read as a change.
fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    (value * scale).round() / scale + 0.0
}

// --- Design ----------------------------------------------------------------------------------------------------------

#[derive(Serialize)]
struct DesignSummary<'a> {
    name: &'a str,
    /// Low, nominal, high, MMC, LMC.
    dimensions: Named<[f64; 5]>,
    parts: Named<PartSummary<'a>>,
    /// Part, parent and nominal place in the parent's frame: x, y, z, rx, ry, rz.
    components: Named<(&'a str, Option<&'a str>, [f64; 6])>,
    /// From which face to which, and the limits in mm.
    #[serde(skip_serializing_if = "Named::is_empty")]
    measures: Named<(String, String, Option<[f64; 2]>)>,
    stations: Named<StationSummary<'a>>,
    watch: Vec<(&'a str, Option<u32>)>,
    false_reject: f64,
    train: &'a Train,
}

#[derive(Serialize)]
struct PartSummary<'a> {
    /// The part that the piece is one of.
    of: &'a str,
    material: &'a str,
    /// Operation, shape, number of copies.
    features: Named<(Op, &'static str, usize)>,
}

#[derive(Serialize)]
struct StationSummary<'a> {
    image: [u32; 2],
    lights: Named<&'static str>,
    floor: Option<&'a str>,
    standing: [[f64; 2]; 4],
}

/// The resolved design: every limit in mm or degrees, every name.
pub fn design(design: &Design) -> String {
    let summary = DesignSummary {
        name: &design.name,
        dimensions: Named(design.dims.iter().map(|d| (d.name.clone(), limits(d))).collect()),
        parts: Named(design.parts.iter().enumerate().map(|(i, p)| (piece(design, i), part(design, p))).collect()),
        components: Named(design.components.iter().map(|c| component(design, c)).collect()),
        measures: Named(design.measures.iter().map(|m| (m.name.clone(), measure(design, m))).collect()),
        stations: Named(design.stations.iter().map(|s| (s.name.clone(), station(design, s))).collect()),
        watch: design.inspect.watch.iter().map(|w| (design.components[w.component].name.as_str(), w.depth)).collect(),
        false_reject: design.inspect.false_reject,
        train: &design.train,
    };
    format!("// dimensions: (low, nominal, high, MMC, LMC) in mm and degrees\n{}", ron(2, &summary))
}

fn limits(dim: &Dimension) -> [f64; 5] {
    let unit = |v: f64| if dim.quantity == Quantity::Angle { v.to_degrees() } else { v };
    let Range { low, nominal, high } = dim.range;
    [low, nominal, high, dim.mmc, dim.lmc].map(|v| rounded(unit(v), 5))
}

/// A piece of a part by the component it is, since every component has draws of its own.
fn piece(design: &Design, part: usize) -> String {
    let component = design.components.iter().find(|c| c.part == part);
    component.map_or(&design.parts[part].name, |c| &c.name).clone()
}

fn part<'a>(design: &'a Design, part: &'a Part) -> PartSummary<'a> {
    let feature = |f: &Feature| (f.name.clone(), (f.op, shape(f), f.copies.len()));
    PartSummary {
        of: &part.name,
        material: &design.materials[part.material].name,
        features: Named(part.features.iter().map(feature).collect()),
    }
}

fn shape(feature: &Feature) -> &'static str {
    match feature.copies.first().map(|c| &c.shape) {
        Some(Shape::Box { .. }) => "box",
        Some(Shape::Cylinder { .. }) => "cylinder",
        Some(Shape::Cone { .. }) => "cone",
        Some(Shape::Sphere { .. }) => "sphere",
        Some(Shape::Torus { .. }) => "torus",
        Some(Shape::Prism { .. }) => "prism",
        Some(Shape::Revolve { .. }) => "revolve",
        Some(Shape::Group { .. }) => "group",
        None => "nothing",
    }
}

type ComponentSummary<'a> = (&'a str, Option<&'a str>, [f64; 6]);

fn component<'a>(design: &'a Design, component: &'a Component) -> (String, ComponentSummary<'a>) {
    let values = design.nominal();
    let pose = component.frame.eval(&values) * component.pose.eval(&values);
    let (rx, ry, rz) = pose.rotation.euler_angles();
    let [x, y, z] = pose.translation.vector.into();
    let place = [x, y, z, rx.to_degrees(), ry.to_degrees(), rz.to_degrees()].map(|v| rounded(v, 5));
    let parent = component.parent.map(|p| design.components[p].name.as_str());
    (component.name.clone(), (design.parts[component.part].name.as_str(), parent, place))
}

fn measure(design: &Design, measure: &Measure) -> (String, String, Option<[f64; 2]>) {
    let face = |path: &FacePath| format!("{}.{}", design.components[path.component].name, path.face);
    let limits = measure.limits.map(|r| [r.low, r.high].map(|v| rounded(v, 5)));
    (face(&measure.from), face(&measure.to), limits)
}

fn station<'a>(design: &'a Design, station: &'a Station) -> StationSummary<'a> {
    let light = |shape: &LightShape| match shape {
        LightShape::Ring { .. } => "ring",
        LightShape::Panel { .. } => "panel",
        LightShape::Room { .. } => "room",
    };
    let range = |r: &Range, scale: f64| [r.low, r.high].map(|v| rounded(v * scale, 5));
    let degrees = 1f64.to_degrees();
    StationSummary {
        image: station.camera.image,
        lights: Named(station.lights.iter().map(|l| (l.name.clone(), light(&l.shape))).collect()),
        floor: station.floor.as_ref().map(|f| design.materials[f.material].name.as_str()),
        standing: [range(&station.x, 1.0), range(&station.y, 1.0), range(&station.z, 1.0), range(&station.rz, degrees)],
    }
}

// --- Solids ----------------------------------------------------------------------------------------------------------

/// A part at one limit.
#[derive(Serialize)]
struct SolidSummary {
    planes: usize,
    cylinders: usize,
    cones: usize,
    spheres: usize,
    tori: usize,
    edges: usize,
    vertices: usize,
    /// mm² and mm³.
    area: f64,
    volume: f64,
}

/// Per part its solid at nominal, MMC and LMC, in that order.
pub fn brep(design: &Design, limits: &[[Arc<Solid>; 3]]) -> String {
    let of_part = |solids: &[Arc<Solid>; 3]| {
        let names = ["nominal", "mmc", "lmc"].map(String::from);
        Named(names.into_iter().zip(solids.iter().map(|s| solid(s))).collect())
    };
    let parts = limits.iter().enumerate().map(|(part, solids)| (piece(design, part), of_part(solids)));
    ron(2, &Named(parts.collect()))
}

fn solid(solid: &Solid) -> SolidSummary {
    let count = |is: fn(&Surface) -> bool| solid.faces.iter().filter(|f| is(&solid.surfaces[f.surface])).count();
    SolidSummary {
        planes: count(|s| matches!(s, Surface::Plane { .. })),
        cylinders: count(|s| matches!(s, Surface::Cylinder { .. })),
        cones: count(|s| matches!(s, Surface::Cone { .. })),
        spheres: count(|s| matches!(s, Surface::Sphere { .. })),
        tori: count(|s| matches!(s, Surface::Torus { .. })),
        edges: solid.edges.len(),
        vertices: solid.vertices.len(),
        area: rounded(solid.area, 3),
        volume: rounded(solid.volume, 3),
    }
}

// --- The assembly ----------------------------------------------------------------------------------------------------

#[derive(Serialize)]
struct ContactSummary {
    faces: [String; 2],
    kind: ContactKind,
    /// mm²
    area: f64,
    gap: GapSummary,
    #[serde(skip_serializing_if = "Option::is_none")]
    fit: Option<Fit>,
}

/// mm
#[derive(Serialize)]
struct GapSummary {
    nominal: f64,
    mmc: f64,
    lmc: f64,
}

/// Every pair of faces that touch.
pub fn contacts(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> String {
    let gap = |c: &Contact| {
        let [nominal, mmc, lmc] = [c.gap, c.gap_range[0], c.gap_range[1]].map(|g| rounded(g, 4));
        GapSummary { nominal, mmc, lmc }
    };
    let line = |c: &Contact| ContactSummary {
        faces: [c.a, c.b].map(|f| face(design, solids, f)),
        kind: c.kind,
        area: rounded(c.area, 2),
        gap: gap(c),
        fit: c.fit,
    };
    let list: Vec<_> = analysis.liaison.contacts.iter().map(line).collect();
    format!("// area in mm², gap in mm\n{}", ron(1, &list))
}

/// `gear.bore.side`
fn face(design: &Design, solids: &[Arc<Solid>], face: FaceRef) -> String {
    format!("{}.{}", design.components[face.component].name, solids[face.component].faces[face.face].name)
}

pub fn liaison(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> String {
    ron(4, &liaison::summary(design, solids, &analysis.liaison))
}

pub fn error_trees(design: &Design, trees: &[ErrorTree]) -> String {
    const DEPTH: usize = 64;
    let summaries: Vec<_> = trees.iter().map(|tree| error_tree::summary(design, tree)).collect();
    ron(DEPTH, &summaries)
}

/// The object tree: under the assembly, per watched component, who is reached at which level.
pub fn object_tree(design: &Design, trees: &[ErrorTree]) -> String {
    let name = |component: usize| design.components[component].name.as_str();
    let levels = |tree: &ErrorTree| -> Vec<Vec<&str>> {
        let deepest = tree.nodes.iter().map(|n| n.level).max().unwrap_or(0);
        let at = |level| tree.nodes.iter().filter(|n| n.level == level).map(|n| name(n.component)).collect();
        (0..=deepest).map(at).collect()
    };
    let trees = trees.iter().map(|t| (name(t.nodes[0].component).to_string(), levels(t))).collect();
    ron(2, &Named(vec![(design.name.clone(), Named(trees))]))
}

/// Every measured distance: nominal, worst case, distribution, contributors.
pub fn measures(analysis: &Analysis) -> String {
    format!("// lengths in mm; sensitivity in mm per mm or per rad\n{}", ron(4, &analysis.measures))
}

#[derive(Serialize)]
struct InsertionOutput {
    removal: insertion::InsertionSummary,
    /// How far each component moves in the exploded view (mm).
    exploded: Named<[f64; 3]>,
}

pub fn insertion(design: &Design, solids: &[Arc<Solid>], analysis: &Analysis) -> String {
    let poses = place(design, &design.nominal());
    let shifts = insertion::exploded(&analysis.insertion, solids, &poses);
    let shift = |(component, by): (&Component, &Vector3<f64>)| {
        (component.name.clone(), [by.x, by.y, by.z].map(|v| rounded(v, 3)))
    };
    let exploded = Named(design.components.iter().zip(&shifts).map(shift).collect());
    ron(3, &InsertionOutput { removal: insertion::summary(design, &analysis.insertion), exploded })
}

// --- The view --------------------------------------------------------------------------------------------------------

#[derive(Serialize)]
struct ViewSummary<'a> {
    station: &'a str,
    position: [f64; 3],
    forward: [f64; 3],
    /// px
    focal: f64,
    size: [u32; 2],
    views_tried: usize,
    score: f64,
    /// Best first: distance, elevation, azimuth, score, worst and mean predicted escape, and the mode that escapes most.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    shortlist: Vec<ShortlistSummary>,
    /// Where cameras would have to stand that together tell what one alone does not: distance, elevation, azimuth.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    cameras: Vec<[f64; 3]>,
    lamps: Vec<String>,
    seen: Named<SeenSummary>,
}

/// What the camera sees of a component: boxes of the whole and of the visible part, px in all and visible, and the
/// visible px of each face.
#[derive(Serialize)]
struct SeenSummary {
    full: Option<[u32; 4]>,
    visible: Option<[u32; 4]>,
    pixels: [u32; 2],
    faces: usize,
}

type ShortlistSummary = (f64, f64, f64, f64, f64, f64, Option<String>);

fn shortlisted(design: &Design, choice: &Choice, weighed: &Weighed) -> ShortlistSummary {
    let view = &choice.table[weighed.view];
    let weakest = weighed.weakest().filter(|mode| mode.share > 0.0);
    let [distance, elevation, azimuth] = stands(view.placing);
    let [worst, mean] = [weighed.worst(), weighed.mean()].map(|v| rounded(v, 3));
    let weakest = weakest.map(|mode| format!("{} {}", design.components[mode.component].name, mode.kind.word()));
    (distance, elevation, azimuth, rounded(view.score, 2), worst, mean, weakest)
}

/// mm and degrees.
fn stands(Placed { distance, elevation, azimuth }: Placed) -> [f64; 3] {
    [rounded(distance, 1), rounded(elevation.to_degrees(), 2), rounded(azimuth.to_degrees(), 2)]
}

/// Camera, lamps, and what is seen of every component.
pub fn view(design: &Design, station: &Station, choice: &Choice) -> String {
    let Camera { position, axes, focal, size, .. } = choice.camera;
    let corners = |b: &PixelBox| [b.x0, b.y0, b.x1, b.y1];
    let seen = choice.seen.iter().map(|s| {
        let summary = SeenSummary {
            full: s.full.as_ref().map(corners),
            visible: s.visible.as_ref().map(corners),
            pixels: [s.full_pixels, s.visible_pixels],
            faces: s.faces.len(),
        };
        (design.components[s.component].name.clone(), summary)
    });
    let summary = ViewSummary {
        station: &station.name,
        position: position.map(|v| rounded(v, 3)),
        forward: axes[2].map(|v| rounded(v, 5)),
        focal: rounded(focal, 3),
        size,
        views_tried: choice.table.len(),
        score: rounded(choice.table[choice.best].score, 2),
        shortlist: choice.weighed().map(|w| shortlisted(design, choice, w)).collect(),
        cameras: choice.several().map(|view| stands(view.placing)).collect(),
        lamps: crate::scene::build::lamps(station, &choice.camera).into_iter().map(|l| l.name).collect(),
        seen: Named(seen.collect()),
    };
    ron(2, &summary)
}
