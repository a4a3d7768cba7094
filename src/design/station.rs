//! `station`: camera, lights, floor, and what varies from photo to photo.
//!
//! Every field has a default; docs/src/language.md lists them. A station with several named cameras (a rig) comes out as one
//! [`Station`] a camera, `line.top` and `line.side`, which share all but the camera.

use super::dimension::trim;
use super::elsewhere;
use super::fields::Fields;
use super::model::{CameraPlacing, CameraSpec, Colour, Floor, LightShape, LightSpec, PerPhoto, Response, Station};
use super::scope::Resolver;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{Body, Call, Name, Stmt, Value};
use crate::units::{Quantity, Range};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Images larger than this in either direction (px) are refused.
const MAX_SIDE: u64 = 8192;
const POSITIVE: [f64; 2] = [f64::MIN_POSITIVE, f64::MAX];
const ANY: [f64; 2] = [f64::MIN, f64::MAX];
/// Exposures beside the nominal one: beyond these a photo is black or white.
const EXPOSURES: [f64; 2] = [0.05, 20.0];

/// More cameras than this look at no one assembly.
const MOST_CAMERAS: usize = 8;

/// Steps (half image widths) in which a lens is searched for the radius from which on it folds the image over.
const FOLD_STEP: f64 = 0.05;
/// There the seen radius grows by less than this share of the true one.
const LEAST_GROWTH: f64 = 0.1;

/// A lens that loses more light than this share in the corners shows nothing there.
const MOST_VIGNETTING: f64 = 0.9;

/// Drift of a lamp whose spec does not say, ± this share.
const DRIFT: f64 = 0.1;

/// A sensor whose wells hold fewer electrons than this is a typing error; most hold some ten thousand.
const LEAST_WELL: f64 = 100.0;

const CAMERA_FIELDS: [&str; 16] = [
    "image",
    "focal",
    "pitch",
    "aim",
    "distance",
    "elevation",
    "azimuth",
    "k1",
    "k2",
    "vignetting",
    "offset",
    "tilt",
    "blur",
    "response",
    "full_well",
    "depth",
];

impl Resolver {
    /// One station a camera; one alone bears the station's name.
    pub fn station(&mut self, name: &Name, body: &Body, materials: &BTreeMap<&str, usize>) -> Vec<Station> {
        let cameras = self.cameras(name, body);
        let is_rig = cameras.len() > 1;
        let first = self.with_camera(cameras[0].1.clone(), name, body, materials);
        let of = |(own, camera): (Option<&Name>, CameraSpec)| {
            let full = own.filter(|_| is_rig).map(|own| format!("{}.{}", name.text, own.text));
            Station { name: full.unwrap_or_else(|| name.text.clone()), camera, ..first.clone() }
        };
        cameras.into_iter().map(of).collect()
    }

    /// The cameras of a station; several have a name each.
    fn cameras<'a>(&mut self, station: &Name, body: &'a Body) -> Vec<(Option<&'a Name>, CameraSpec)> {
        let mut cameras: Vec<(Option<&Name>, CameraSpec)> = Vec::new();
        let mut nameless = Vec::new();
        for line in &body.lines {
            let Stmt::Camera { name, mode, body } = &line.stmt else { continue };
            let first = |name: &Name| {
                cameras.iter().filter_map(|(n, _)| *n).find(|first| first.text == name.text).map(|first| first.span)
            };
            match name.as_ref().map(|name| (name, first(name))) {
                Some((name, Some(first))) => self.duplicate("camera", name, first),
                Some(_) => {}
                None => nameless.push((cameras.len(), line.span)),
            }
            let camera = self.camera(mode.as_ref(), body, line.span);
            cameras.push((name.as_ref(), camera));
        }
        if cameras.len() > 1 {
            nameless.into_iter().for_each(|(index, span)| self.nameless(station, &cameras, (index, span)));
        }
        if cameras.len() > MOST_CAMERAS {
            let message =
                format!("station `{}` has {} cameras, at most {MOST_CAMERAS} are allowed", station.text, cameras.len());
            self.report(Diagnostic::error("E0212", station.span, message).label("too many cameras"));
        }
        if cameras.is_empty() {
            cameras.push((None, self.camera(None, &Body::default(), station.span)));
        }
        cameras
    }

    /// A camera without a name beside others.
    fn nameless(&mut self, station: &Name, all: &[(Option<&Name>, CameraSpec)], (index, span): (usize, Span)) {
        const KEYWORD: u32 = 6;
        let taken = |name: &String| all.iter().any(|(n, _)| n.is_some_and(|n| n.text == *name));
        let free = (index + 1..).map(|i| format!("camera_{i}")).find(|name| !taken(name)).unwrap_or_default();
        let behind = span.start + KEYWORD;
        let message = format!("station `{}` has {} cameras: each needs a name", station.text, all.len());
        self.report(
            Diagnostic::error("E0207", Span { end: behind, ..span }, message)
                .label("a camera without a name")
                .note("photos are given by the names of the cameras: `gonogo inspect MODEL top=PHOTO side=PHOTO`")
                .suggest(
                    format!("write `camera {free}`"),
                    Span { start: behind, end: behind, ..span },
                    format!(" {free}"),
                ),
        );
    }

    /// The cameras of a station share all the rest.
    fn with_camera(
        &mut self,
        camera: CameraSpec,
        name: &Name,
        body: &Body,
        materials: &BTreeMap<&str, usize>,
    ) -> Station {
        let mut lights: Vec<LightSpec> = Vec::new();
        let mut floor = None;
        let mut vary = Fields::none("vary", name.span);
        for line in &body.lines {
            match &line.stmt {
                Stmt::Light { name, call } => {
                    if let Some(first) = lights.iter().find(|l| l.name == name.text) {
                        let first = first.span;
                        self.duplicate("light", name, first);
                    }
                    lights.extend(self.light(name, call));
                }
                Stmt::Floor(body) => floor = Some(self.floor(body, line.span, materials)),
                Stmt::Vary(body) => vary = Fields::of_body("vary", line.span, body),
                _ => {}
            }
        }
        if !body.lines.iter().any(|line| matches!(line.stmt, Stmt::Light { .. })) {
            self.dark(name);
        }
        self.check_fields(&vary, &["x", "y", "z", "rz", "exposure", "noise"]);
        let still = Range::exactly(0.0);
        Station {
            name: name.text.clone(),
            camera,
            lights,
            floor,
            x: self.range_or(&vary, "x", Quantity::Length, still),
            y: self.range_or(&vary, "y", Quantity::Length, still),
            z: self.range_or(&vary, "z", Quantity::Length, still),
            rz: self.range_or(&vary, "rz", Quantity::Angle, still),
            exposure: self.per_photo(&vary, "exposure", Quantity::Ratio, Range::symmetric(1.0, 0.05), EXPOSURES),
            noise: self.exact_or(&vary, "noise", Quantity::Ratio, 0.005, [0.0, 1.0]),
            span: name.span,
        }
    }

    /// A range that acts only where it is written.
    fn per_photo(&mut self, fields: &Fields, key: &str, want: Quantity, default: Range, limits: [f64; 2]) -> PerPhoto {
        let range = self.range_within(fields, key, want, default, limits);
        PerPhoto { range, varies: fields.get(key).is_some() && range.low < range.high }
    }

    fn dark(&mut self, name: &Name) {
        self.report(
            Diagnostic::error("E0207", name.span, format!("station `{}` has no light", name.text))
                .label("every photo would be black")
                .help("the light of a room: `light room = room(patches = 9)`"),
        );
    }

    fn camera(&mut self, mode: Option<&Name>, body: &Body, span: Span) -> CameraSpec {
        let fields = Fields::of_body("camera", head(span), body);
        self.check_fields(&fields, &CAMERA_FIELDS);
        let responses = [("linear", Response::Linear), ("srgb", Response::Srgb)];
        let image = self.image(&fields);
        let k1 = self.range_within(&fields, "k1", Quantity::Ratio, Range::exactly(0.0), [-0.3, 0.3]);
        CameraSpec {
            image,
            focal: self.range_within(&fields, "focal", Quantity::Length, Range::symmetric(16.0, 0.08), POSITIVE),
            pitch: self.exact_or(&fields, "pitch", Quantity::Length, 0.0074, POSITIVE),
            aim: self.point_or(&fields, "aim", [0.0; 3]),
            placing: self.placing(&fields, mode.is_some_and(|m| m.text == "auto")),
            k1,
            k2: self.second_term(&fields, &k1, image),
            vignetting: self.range_within(
                &fields,
                "vignetting",
                Quantity::Ratio,
                Range::exactly(0.0),
                [0.0, MOST_VIGNETTING],
            ),
            full_well: match fields.get("full_well") {
                Some(_) => self.exact_or(&fields, "full_well", Quantity::Ratio, LEAST_WELL, [LEAST_WELL, f64::MAX]),
                None => f64::INFINITY,
            },
            depth: self.whole_or(&fields, "depth", 8, [8, 16]) as u32,
            install_mm: self.error_of(&fields, "offset", Quantity::Length, 1.0),
            install_rad: self.error_of(&fields, "tilt", Quantity::Angle, 0.3f64.to_radians()),
            blur: self.per_photo(
                &fields,
                "blur",
                Quantity::Pixels,
                Range { low: 0.3, nominal: 0.5, high: 0.8 },
                [0.0, 20.0],
            ),
            response: self.word_or(&fields, "response", &responses, Response::Linear),
            span,
        }
    }

    /// `k2`, unless the lens would show one point in two places of the image.
    fn second_term(&mut self, fields: &Fields, k1: &Range, [width, height]: [u32; 2]) -> f64 {
        let k2 = self.exact_or(fields, "k2", Quantity::Ratio, 0.0, [-0.3, 0.3]);
        let corner = 1f64.hypot(f64::from(height) / f64::from(width));
        // From the middle outwards the seen radius has to grow with the true one until it reaches the corners.
        let grows = |k1: f64| {
            let mut radii = (0..).map(|i| f64::from(i) * FOLD_STEP);
            let bends = |r2: f64| 1.0 + 3.0 * k1 * r2 + 5.0 * k2 * r2 * r2 < LEAST_GROWTH;
            let end = radii.find(|r| bends(r * r) || r * (1.0 + k1 * r * r + k2 * r.powi(4)) > corner);
            end.is_some_and(|r| !bends(r * r))
        };
        match fields.get("k2") {
            Some(value) if k2 != 0.0 && !(grows(k1.low) && grows(k1.high)) => {
                let message = format!("with k2 = {k2} the lens folds the image over within its corners");
                self.report(
                    Diagnostic::error("E0211", value.span(), message)
                        .label("bends too much with this `k1`")
                        .help("radii are in half image widths, not in tangents: lenses have a k2 of some hundredths"),
                );
                0.0
            }
            _ => k2,
        }
    }

    fn image(&mut self, fields: &Fields) -> [u32; 2] {
        const USUAL: [u32; 2] = [640, 480];
        let Some(value) = fields.get("image") else { return USUAL };
        let Value::Extent { width, height, unit, span } = value else {
            self.wrong_form(value.span(), "a size in pixels: `640 x 480 px`");
            return USUAL;
        };
        if let Some(other) = unit.as_ref().filter(|u| u.text != "px") {
            self.report(
                Diagnostic::error("E0205", other.span, "an image is measured in pixels")
                    .label("not pixels")
                    .help(format!("write `{width} x {height} px`")),
            );
        }
        let sides = [*width, *height];
        if sides.iter().all(|side| (16..=MAX_SIDE).contains(side)) {
            return sides.map(|side| side as u32);
        }
        let message = format!("an image has 16 to {MAX_SIDE} pixels each way");
        self.report(Diagnostic::error("E0211", *span, message).label("out of range"));
        USUAL
    }

    fn placing(&mut self, fields: &Fields, auto: bool) -> CameraPlacing {
        const UPRIGHT: [f64; 2] = [0.0, FRAC_PI_2 + 1e-9];
        let (near, far) = (250.0, 400.0);
        if !auto {
            return CameraPlacing::Fixed {
                distance: self.exact_or(fields, "distance", Quantity::Length, 300.0, POSITIVE),
                elevation: self.exact_or(fields, "elevation", Quantity::Angle, FRAC_PI_2, UPRIGHT),
                azimuth: self.exact_or(fields, "azimuth", Quantity::Angle, -FRAC_PI_2, [-TAU, TAU]),
            };
        }
        let spread = |low: f64, high: f64| Range { low, nominal: (low + high) / 2.0, high };
        let steep = spread(40f64.to_radians(), FRAC_PI_2);
        CameraPlacing::Auto {
            distance: self.range_within(fields, "distance", Quantity::Length, spread(near, far), POSITIVE),
            elevation: self.range_within(fields, "elevation", Quantity::Angle, steep, UPRIGHT),
            azimuth: self.range_within(fields, "azimuth", Quantity::Angle, Range::exactly(-FRAC_PI_2), [-TAU, TAU]),
        }
    }

    /// An installation error, written `0 ±1.5`: half its width.
    fn error_of(&mut self, fields: &Fields, key: &str, want: Quantity, default: f64) -> f64 {
        let range = self.range_or(fields, key, want, Range::symmetric(0.0, default));
        if range.nominal == 0.0 && range.low == -range.high {
            return range.high;
        }
        let span = fields.get(key).map_or(fields.span, Value::span);
        let message = format!("`{key}` is an error about zero");
        self.report(
            Diagnostic::error("E0211", span, message)
                .label("not symmetric about zero")
                .help(format!("write `{key} = 0 ±{}`", trim(default / self.file_scale(want, span)))),
        );
        default
    }

    fn light(&mut self, name: &Name, call: &Call) -> Option<LightSpec> {
        let fields = Fields::of_args(&call.name, &call.args);
        let shape = match call.name.text.as_str() {
            "ring" => self.ring(&fields),
            "panel" | "bar" => self.panel(&fields),
            "room" => {
                self.check_fields(&fields, &["patches", "power", "colour"]);
                LightShape::Room { patches: self.whole_or(&fields, "patches", 9, [1, 64]) as u32 }
            }
            other => {
                let message = format!("no light is named `{other}`");
                let diagnostic = Diagnostic::error("E0201", call.name.span, message).label("unknown light");
                const LIGHTS: [&str; 4] = ["ring", "panel", "bar", "room"];
                let near = elsewhere::call(other, &LIGHTS).or_else(|| nearest(other, LIGHTS));
                self.report(match near {
                    Some(near) => diagnostic.meant(call.name.span, near).note("lights: ring, panel, bar, room"),
                    None => diagnostic.help("write `ring`, `panel`, `bar` or `room`"),
                });
                return None;
            }
        };
        let power = self.range_within(&fields, "power", Quantity::Ratio, Range::symmetric(1.0, DRIFT), [0.0, f64::MAX]);
        let drift = if power.nominal > 0.0 { power.half_width() / power.nominal } else { 0.0 };
        let colours = [
            ("white", Colour::White),
            ("blue", Colour::Blue),
            ("green", Colour::Green),
            ("red", Colour::Red),
            ("infrared", Colour::Infrared),
        ];
        let colour = self.word_or(&fields, "colour", &colours, Colour::White);
        Some(LightSpec { name: name.text.clone(), shape, colour, power: power.nominal, drift, span: name.span })
    }

    fn ring(&mut self, fields: &Fields) -> LightShape {
        self.check_fields(fields, &["inner", "outer", "setback", "power", "colour"]);
        let inner = self.exact_or(fields, "inner", Quantity::Length, 30.0, [0.0, f64::MAX]);
        let outer = self.exact_or(fields, "outer", Quantity::Length, inner + 20.0, POSITIVE);
        if outer <= inner {
            let span = fields.get("outer").map_or(fields.span, Value::span);
            let message = format!("the outer radius {outer} is not larger than the inner radius {inner}");
            self.report(Diagnostic::error("E0211", span, message).label("an empty ring"));
        }
        LightShape::Ring { inner, outer, setback: self.exact_or(fields, "setback", Quantity::Length, 0.0, ANY) }
    }

    fn panel(&mut self, fields: &Fields) -> LightShape {
        self.check_fields(fields, &["width", "height", "at", "aim", "power", "colour"]);
        for (key, example) in [("width", "100"), ("height", "100"), ("at", "(0, -100, 300)")] {
            if fields.get(key).is_none() {
                self.missing(fields, key, example);
            }
        }
        let (at, aim) = (self.point_or(fields, "at", [0.0, 0.0, 300.0]), self.point_or(fields, "aim", [0.0; 3]));
        if at == aim {
            let span = fields.get("at").map_or(fields.span, Value::span);
            self.report(
                Diagnostic::error("E0211", span, "the light is aimed at itself").label("`at` and `aim` are one point"),
            );
        }
        LightShape::Panel {
            width: self.exact_or(fields, "width", Quantity::Length, 100.0, POSITIVE),
            height: self.exact_or(fields, "height", Quantity::Length, 100.0, POSITIVE),
            at,
            aim,
        }
    }

    fn floor(&mut self, body: &Body, span: Span, materials: &BTreeMap<&str, usize>) -> Floor {
        let fields = Fields::of_body("floor", head(span), body);
        self.check_fields(&fields, &["z", "material"]);
        let z = self.exact_or(&fields, "z", Quantity::Length, 0.0, ANY);
        let material = match fields.get("material") {
            Some(value) => self.material_named(value, materials),
            None => {
                let example = materials.keys().next().copied().unwrap_or("paint");
                self.missing(&fields, "material", example);
                0
            }
        };
        Floor { z, material }
    }
}

/// The first word of a block, for labels.
fn head(span: Span) -> Span {
    const KEYWORD: u32 = 5;
    Span { end: span.end.min(span.start + KEYWORD), ..span }
}
