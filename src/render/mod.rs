//! Stage 6: a scene and a camera become linear images, one per light group.
//!
//! In: [`Scene`], [`Camera`], [`Settings`]. Out: [`LightImages`], the radiance of every pixel when only the lamps of one
//! group burn, each at radiance 1; [`sensor`] makes a photo of them. Global illumination by path tracing in the
//! station's frame, mm. The same scene, camera and settings give the same bytes at any number of threads.
//! Never denoises: the variance of the images is part of what is learnt from them.

mod accel;
mod bsdf;
mod edge_break;
mod lamp;
mod mottle;
pub mod sensor;
mod trace;
mod vector;
mod world;

#[cfg(test)]
mod tests;

use crate::design::model::Colour;
use crate::rng::Stream;
use crate::runtime::camera::Camera;
use crate::scene::Scene;
use accel::Ray;
use rayon::prelude::*;
use std::collections::BTreeSet;
use trace::{Dice, Strategy, Tracer};
use vector::Vec3;
use world::World;

/// Most samples per pixel: the Sobol sequence has 65536 points, and some draws use two per sample.
const MOST_SAMPLES: u32 = 1 << 15;

/// How a scene is rendered.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Samples per pixel; powers of two spread best.
    pub samples: u32,
    pub seed: u64,
    /// Longest path in segments: 1 sees lamps only, 2 adds direct light, 3 one interreflection.
    pub segments: u32,
    /// Render only these pixels: x0, y0, x1, y1 (px, x1 and y1 excluded), cut to the image.
    pub crop: Option<[u32; 4]>,
    /// Render only the pixels that are true here, row by row of the whole image; the others stay black.
    pub only: Option<Vec<bool>>,
    /// Greatest light that one path may bring by way of two or more surfaces, in units of the radiance of a white
    /// matt surface that faces the lamp from the middle of the scene. Dims what is brighter: `None` is exact.
    pub clamp: Option<f64>,
    /// Least GGX alpha of a surface that is seen by way of another: 0 is exact.
    pub secondary_roughness: f64,
}

impl Default for Settings {
    /// For training images: 16 samples, 4 segments, bright specks held down.
    fn default() -> Self {
        Settings {
            samples: 16,
            seed: 0,
            segments: 4,
            crop: None,
            only: None,
            clamp: Some(20.0),
            secondary_roughness: 0.15,
        }
    }
}

impl Settings {
    /// Nothing clamped, nothing roughened: converges to the solution of the rendering equation up to its last segment.
    pub fn exact(samples: u32, segments: u32) -> Self {
        Settings { samples, segments, clamp: None, secondary_roughness: 0.0, ..Settings::default() }
    }
}

/// Linear radiance, one image per light group.
#[derive(Debug, Clone, PartialEq)]
pub struct LightImages {
    /// Size of the camera's image in px.
    pub width: u32,
    pub height: u32,
    /// The pixels that were rendered: x0, y0, x1, y1, x1 and y1 excluded.
    pub crop: [u32; 4],
    /// Per group the radiance of every pixel of the crop, row by row.
    pub groups: Vec<Vec<f32>>,
}

impl LightImages {
    /// Width and height in px of what was rendered: of the crop.
    pub fn size(&self) -> [u32; 2] {
        let [x0, y0, x1, y1] = self.crop;
        [x1 - x0, y1 - y0]
    }
}

/// Renders a scene. Threads are those of the rayon pool it is called in.
pub fn render(scene: &Scene, camera: &Camera, settings: &Settings) -> LightImages {
    render_with(scene, camera, settings, Strategy::Both)
}

/// Surfaces answer light of every colour in their own way, so each colour has a pass of its own. All lamps stand in all of
/// them, because they hide what is behind them.
fn render_with(scene: &Scene, camera: &Camera, settings: &Settings, strategy: Strategy) -> LightImages {
    let colours: BTreeSet<Colour> = scene.lamps.iter().map(|lamp| lamp.colour).collect();
    let mut passes = colours.iter().map(|&colour| (colour, pass(scene, colour, camera, settings, strategy)));
    let Some((_, mut images)) = passes.next() else { return pass(scene, Colour::White, camera, settings, strategy) };
    for (colour, mut of_colour) in passes {
        for lamp in scene.lamps.iter().filter(|lamp| lamp.colour == colour) {
            images.groups[lamp.group] = std::mem::take(&mut of_colour.groups[lamp.group]);
        }
    }
    images
}

/// All surfaces as they are under light of one colour.
fn pass(scene: &Scene, colour: Colour, camera: &Camera, settings: &Settings, strategy: Strategy) -> LightImages {
    let world = World::new(scene, colour);
    let tracer = Tracer::new(&world, settings, strategy);
    let film = Film { camera, settings, tracer, groups: scene.groups, crop: inside(settings.crop, camera.size) };
    let [_, y0, _, y1] = film.crop;
    let rows: Vec<Vec<f32>> = (y0..y1).into_par_iter().map(|y| film.row(y)).collect();
    let groups = (0..scene.groups)
        .map(|group| rows.iter().flat_map(|row| row.iter().skip(group).step_by(scene.groups).copied()).collect())
        .collect();
    LightImages { width: camera.size[0], height: camera.size[1], crop: film.crop, groups }
}

/// The crop cut to the image; the whole image without one.
fn inside(crop: Option<[u32; 4]>, [width, height]: [u32; 2]) -> [u32; 4] {
    let [x0, y0, x1, y1] = crop.unwrap_or([0, 0, width, height]);
    let (x1, y1) = (x1.min(width), y1.min(height));
    [x0.min(x1), y0.min(y1), x1, y1]
}

/// Pixels: each is the mean of its samples over the pixel's square.
struct Film<'a> {
    camera: &'a Camera,
    settings: &'a Settings,
    tracer: Tracer<'a>,
    groups: usize,
    crop: [u32; 4],
}

impl Film<'_> {
    /// One row of pixels, the groups of a pixel side by side.
    fn row(&self, y: u32) -> Vec<f32> {
        let [above, below] = [y, y + 1].map(|y| self.corner_directions(y));
        let mut row = Vec::with_capacity(above.len() * self.groups);
        for (i, x) in (self.crop[0]..self.crop[2]).enumerate() {
            let corners = [above[i], above[i + 1], below[i], below[i + 1]];
            let number = u64::from(y) * u64::from(self.camera.size[0]) + u64::from(x);
            if self.settings.only.as_ref().is_none_or(|only| only.get(number as usize).is_some_and(|&o| o)) {
                row.extend(self.pixel(corners, number));
            } else {
                row.extend(std::iter::repeat_n(0.0, self.groups));
            }
        }
        row
    }

    /// Directions through the corners of pixels along the upper edge of row `y`.
    fn corner_directions(&self, y: u32) -> Vec<Vec3> {
        let direction = |x| Vec3::from(self.camera.ray([f64::from(x), f64::from(y)]).map(|c| c as f32));
        (self.crop[0]..=self.crop[2]).map(direction).collect()
    }

    /// Mean radiance per group. Within a pixel directions are interpolated between its corners: the distortion of the
    /// lens is straight at that scale.
    fn pixel(&self, [a, b, c, d]: [Vec3; 4], number: u64) -> Vec<f32> {
        let samples = self.settings.samples.clamp(1, MOST_SAMPLES);
        let key = Stream::new(self.settings.seed, "pixel", number).bits() as u32;
        let origin = Vec3::from(self.camera.position.map(|c| c as f32));
        let mut light = vec![0.0; self.groups];
        for index in 0..samples {
            let dice = Dice { index, samples, key };
            let [u, v, ..] = dice.roll(0);
            let direction = a.lerp(&b, u).lerp(&c.lerp(&d, u), v).normalize();
            self.tracer.trace(Ray { origin, direction, reach: f32::INFINITY }, &dice, &mut light);
        }
        light.iter_mut().for_each(|sum| *sum /= samples as f32);
        light
    }
}
