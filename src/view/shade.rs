//! The brightness of what an item buffer shows, roughly: enough to say where an edge would stand out, in microseconds.
//!
//! In: bodies, a station's lamps, an item buffer. Out: a grey value per pixel, bright surfaces near [`BRIGHT`]. No shadow is
//! cast and nothing is mirrored but lamps: whoever needs light as it is asks the renderer.

use super::item_buffer::ItemBuffer;
use crate::design::model::{MaterialKind, Station};
use crate::runtime::camera::Camera;
use crate::scene::build;
use crate::scene::{Body, Emitter, Finish};
use nalgebra::{Point3, Vector3};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Grey value (share of full scale) of bright surfaces, as a camera exposes itself.
const BRIGHT: f64 = 0.6;
const BRIGHT_QUANTILE: f64 = 0.95;
/// Share of light that a coat mirrors.
const COAT: f64 = 0.05;
/// Points that stand for a ring, and for either side of a panel.
const RING_POINTS: u32 = 8;
const PANEL_POINTS: i32 = 3;

/// A small piece of a lamp.
enum Glow {
    /// At a place (mm), shining along `facing`; mm² times radiance.
    Near { at: Point3<f64>, facing: Vector3<f64>, power: f64 },
    /// From a direction; sr, radiance.
    Far { from: Vector3<f64>, angle: f64, radiance: f64 },
}

/// The lamps of a station as one of its cameras has them.
pub(super) struct Light(Vec<Glow>);

impl Light {
    /// `camera` at full size: a ring rides on it.
    pub(super) fn new(station: &Station, camera: &Camera) -> Light {
        let of = build::light_of_group(station);
        let lamps = build::lamps(station, camera);
        Light(lamps.iter().zip(of).flat_map(|(lamp, of)| glows(&lamp.emitter, station.lights[of].power)).collect())
    }

    /// Light that leaves a surface towards `to`; `normal` and `to` are unit vectors.
    fn leaving(&self, finish: &Finish, at: Point3<f64>, normal: Vector3<f64>, to: Vector3<f64>) -> f64 {
        let mirrored = normal * (2.0 * normal.dot(&to)) - to;
        let (body, coat) = match finish.kind {
            MaterialKind::Matt => (finish.reflectance, 0.0),
            MaterialKind::Metal => (0.0, finish.reflectance.min(1.0)),
            MaterialKind::Plastic => (finish.reflectance, COAT),
        };
        let one = |glow: &Glow| {
            let (from, angle, radiance) = glow.seen_from(at);
            let diffuse = body / PI * normal.dot(&from).max(0.0);
            let sharp = if coat > 0.0 { coat * lobe(finish.roughness, angle, mirrored.dot(&from)) } else { 0.0 };
            radiance * angle * (diffuse + sharp)
        };
        self.0.iter().map(one).sum()
    }
}

impl Glow {
    /// Direction to it, solid angle (sr) and radiance.
    fn seen_from(&self, p: Point3<f64>) -> (Vector3<f64>, f64, f64) {
        match self {
            Glow::Far { from, angle, radiance } => (*from, *angle, *radiance),
            Glow::Near { at, facing, power } => {
                let to = at - p;
                let d2 = to.norm_squared().max(1.0);
                let from = to / d2.sqrt();
                // Solid angle times radiance is what counts; a lamp of radiance 1 is as good as any.
                (from, power * (-facing.dot(&from)).max(0.0) / d2, 1.0)
            }
        }
    }
}

/// A mirror lobe (1/sr) as wide as roughness and the lamp's own extent make it.
fn lobe(roughness: f64, angle: f64, cosine: f64) -> f64 {
    const LEAST: f64 = 2e-3;
    let width2 = 2.0 * roughness * roughness + angle / PI + LEAST;
    let power = 2.0 / width2;
    (power + 1.0) / TAU * cosine.max(0.0).powf(power)
}

fn glows(emitter: &Emitter, power: f64) -> Vec<Glow> {
    match emitter {
        Emitter::Ring { frame, inner, outer } => {
            let (radius, area) = ((inner + outer) / 2.0, PI * (outer * outer - inner * inner) / f64::from(RING_POINTS));
            let at = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(RING_POINTS)).sin_cos();
                frame * Point3::new(radius * cos, radius * sin, 0.0)
            };
            let facing = frame * Vector3::z();
            (0..RING_POINTS).map(|k| Glow::Near { at: at(k), facing, power: power * area }).collect()
        }
        Emitter::Panel { frame, width, height } => {
            let area = width * height / f64::from(PANEL_POINTS * PANEL_POINTS);
            let (half, facing) = (PANEL_POINTS / 2, frame * Vector3::z());
            let off = |k: i32, side: f64| side * f64::from(k) / f64::from(PANEL_POINTS);
            let point = |i, j| frame * Point3::new(off(i, *width), off(j, *height), 0.0);
            let places = (-half..=half).flat_map(|i| (-half..=half).map(move |j| (i, j)));
            places.map(|(i, j)| Glow::Near { at: point(i, j), facing, power: power * area }).collect()
        }
        &Emitter::Sky { sin_low, sin_high, azimuth_low, azimuth_high } => {
            let round = azimuth_high - azimuth_low;
            // A cap at the zenith is one piece; what reaches far round is several.
            let pieces = if sin_low > 0.5 && sin_high >= 1.0 { 1 } else { (round / FRAC_PI_4).ceil().max(1.0) as u32 };
            let sin: f64 = if pieces == 1 && round > TAU - 1e-9 { 1.0 } else { (sin_low + sin_high) / 2.0 };
            let cos = (1.0 - sin * sin).max(0.0).sqrt();
            let angle = (sin_high - sin_low) * round / f64::from(pieces);
            let from = |k: u32| {
                let azimuth = azimuth_low + round * (f64::from(k) + 0.5) / f64::from(pieces);
                Vector3::new(cos * azimuth.cos(), cos * azimuth.sin(), sin)
            };
            (0..pieces).map(|k| Glow::Far { from: from(k), angle, radiance: power }).collect()
        }
    }
}

/// Brightness of every pixel, not yet exposed; 0 where there is nothing.
pub(super) struct Shader<'a> {
    pub light: &'a Light,
    pub camera: &'a Camera,
    /// By component.
    pub finishes: BTreeMap<u32, &'a Finish>,
}

impl<'a> Shader<'a> {
    pub(super) fn new(light: &'a Light, camera: &'a Camera, bodies: &'a [Body]) -> Shader<'a> {
        let finishes = bodies.iter().map(|b| (b.component as u32 + 1, &b.finish)).collect();
        Shader { light, camera, finishes }
    }

    /// The pixel `i` of a buffer, with the finish that `id` stands for here.
    pub(super) fn grey(&self, buffer: &ItemBuffer, i: usize) -> f64 {
        let Some(finish) = self.finishes.get(&buffer.id[i]) else { return 0.0 };
        let at = [i % buffer.width, i / buffer.width];
        let Some(p) = buffer.point(at, self.camera).map(Point3::from) else { return 0.0 };
        let to = (Point3::from(self.camera.position) - p).normalize();
        self.light.leaving(finish, p, self.normal(buffer, at, p, to), to)
    }

    /// From the depth of neighbours on the same face; where there are none the surface is taken to face the camera.
    fn normal(&self, buffer: &ItemBuffer, [x, y]: [usize; 2], p: Point3<f64>, to: Vector3<f64>) -> Vector3<f64> {
        let own = y * buffer.width + x;
        let along = |step: [i64; 2]| -> Option<Vector3<f64>> {
            [1i64, -1].into_iter().find_map(|way| {
                let [u, v] = [x as i64 + way * step[0], y as i64 + way * step[1]];
                let inside = (0..buffer.width as i64).contains(&u) && (0..buffer.height as i64).contains(&v);
                let at = inside.then_some([u as usize, v as usize])?;
                let other = at[1] * buffer.width + at[0];
                let same = (buffer.id[own], buffer.face[own]) == (buffer.id[other], buffer.face[other]);
                let q = buffer.point(at, self.camera).filter(|_| same)?;
                Some((Point3::from(q) - p) * way as f64)
            })
        };
        let across = along([1, 0]).zip(along([0, 1])).and_then(|(u, v)| u.cross(&v).try_normalize(1e-12));
        across.map_or(to, |n| if n.dot(&to) < 0.0 { -n } else { n })
    }
}

/// The factor that brings the bright pixels of a picture to [`BRIGHT`].
pub(super) fn exposure(grey: &[f64]) -> f64 {
    let mut lit: Vec<f64> = grey.iter().copied().filter(|&g| g > 0.0).collect();
    lit.sort_by(f64::total_cmp);
    let bright = lit.get((lit.len() as f64 * BRIGHT_QUANTILE) as usize).copied().unwrap_or(0.0);
    if bright > 0.0 { BRIGHT / bright } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{block, body, overhead, placed};
    use super::*;
    use crate::design::model::{Colour, LightShape, LightSpec};
    use crate::diag::Span;

    fn lit_by(shape: LightShape) -> Vec<LightSpec> {
        vec![LightSpec {
            name: "lamp".into(),
            shape,
            colour: Colour::White,
            power: 1.0,
            drift: 0.0,
            span: Span::default(),
        }]
    }

    /// A cube under an even sky: its top is a white-furnace surface and returns its reflectance times the sky.
    #[test]
    fn an_even_sky_lights_a_level_face_fully() {
        let loaded = crate::design::load("tests/data/two_pins.gng", &|path| std::fs::read_to_string(path), &[]);
        let mut station = loaded.design.unwrap().stations.remove(0);
        station.lights = lit_by(LightShape::Room { patches: 64 });
        let (camera, bodies) = (overhead([64, 48], 500.0, 400.0), [body(0, block([20.0; 3]), placed(0.0, 0.0, 0.0))]);
        let light = Light::new(&station, &camera);
        let buffer = ItemBuffer::of(&bodies, &camera);
        let grey = Shader::new(&light, &camera, &bodies).grey(&buffer, 24 * 64 + 32);
        assert!((grey - 0.5).abs() < 0.02, "{grey}");
    }

    /// A lamp low at +x lights the face that looks there and not the one that looks away.
    #[test]
    fn a_face_is_as_bright_as_it_looks_at_the_lamp() {
        let loaded = crate::design::load("tests/data/two_pins.gng", &|path| std::fs::read_to_string(path), &[]);
        let mut station = loaded.design.unwrap().stations.remove(0);
        let at = [400.0, 0.0, 10.0];
        station.lights = lit_by(LightShape::Panel { width: 50.0, height: 50.0, at, aim: [0.0, 0.0, 10.0] });
        let bodies = [body(0, block([20.0; 3]), placed(0.0, 0.0, 0.0))];
        let seen = |from: [f64; 3]| {
            let camera = Camera::look_at(from, [0.0, 0.0, 10.0], 500.0, [64, 48]);
            let light = Light::new(&station, &camera);
            let buffer = ItemBuffer::of(&bodies, &camera);
            Shader::new(&light, &camera, &bodies).grey(&buffer, 24 * 64 + 32)
        };
        let (towards, away) = (seen([300.0, 0.0, 10.0]), seen([-300.0, 0.0, 10.0]));
        assert!(towards > 1e-4 && away == 0.0, "{towards} {away}");
    }
}
