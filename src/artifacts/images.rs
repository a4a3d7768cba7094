//! Synthetic photos of the nominal assembly, correct and with every error mode, and a map of its components.
//!
//! In: a design, its station, the camera, the error modes. Out: PNG files by name. The photos have the size and the tone of
//! the station's own, with its noise, so they can be judged as those are. Never read back by any stage.

use crate::assembly::fault::ErrorMode;
use crate::design::model::{Design, Station};
use crate::render::sensor::{self, Sensor};
use crate::render::{self, LightImages, Settings};
use crate::runtime::camera::Camera;
use crate::scene::build;
use crate::train::shots::{self, Drawn};
use crate::view::item_buffer::ItemBuffer;
use crate::view::picture::false_colour;
use image::{GrayImage, ImageFormat, RgbImage};
use std::io::Cursor;

/// Faults are shown in the middle of their range.
const MIDDLE: [f64; 3] = [0.5; 3];
/// This share of the pixels is brighter than [`EXPOSED_TO`] of full scale: a well exposed photo.
const HIGHLIGHTS: f64 = 0.05;
const EXPOSED_TO: f32 = 0.6;

/// `images/good.png`, `images/components.png`, and `images/NN <component> <fault>.png` for every error mode.
pub fn pictures(design: &Design, station: &Station, camera: &Camera, modes: &[ErrorMode]) -> Vec<(String, Vec<u8>)> {
    let Ok(drawn) = shots::nominal(design, station) else { return Vec::new() };
    let studio = Studio { design, station, camera, drawn };
    let good = studio.take(&[], 0);
    let weights = studio.weights(&good);
    let mut files = vec![
        ("images/good.png".into(), grey(&studio.expose(&good, &weights, 0))),
        ("images/components.png".into(), colour(&false_colour(&studio.items()))),
    ];
    for (mode, number) in modes.iter().zip(1..) {
        let name = &design.components[mode.component].name;
        let file = format!("images/{number:02} {name} {}.png", mode.kind.word());
        let shot = studio.take(&[(mode, MIDDLE)], number);
        files.push((file, grey(&studio.expose(&shot, &weights, number))));
    }
    files
}

struct Studio<'a> {
    design: &'a Design,
    station: &'a Station,
    camera: &'a Camera,
    drawn: Drawn,
}

impl Studio<'_> {
    fn take(&self, faults: &[(&ErrorMode, [f64; 3])], number: u64) -> LightImages {
        let lamps = build::lamps(self.station, self.camera);
        let instance = self.drawn.instance(faults);
        let ground = self.drawn.ground.clone();
        let scene = build::scene(self.station, &instance, self.drawn.standing.to_array(), lamps, ground);
        let seed = self.design.train.seed ^ number;
        render::render(
            &scene,
            self.camera,
            &Settings { samples: self.design.train.samples, seed, ..Settings::default() },
        )
    }

    /// The lamps as the spec describes them, exposed for the good assembly.
    fn weights(&self, good: &LightImages) -> Vec<f64> {
        let lights = build::light_of_group(self.station);
        let powers: Vec<f64> = lights.iter().map(|&l| self.station.lights[l].power).collect();
        let mut light = sensor::combine(good, &powers);
        light.sort_by(f32::total_cmp);
        let bright = light.get((light.len() as f64 * (1.0 - HIGHLIGHTS)) as usize).copied().unwrap_or(0.0);
        let gain = if bright > 0.0 { f64::from(EXPOSED_TO / bright) } else { 1.0 };
        powers.iter().map(|p| p * gain).collect()
    }

    fn expose(&self, shot: &LightImages, weights: &[f64], number: u64) -> GrayImage {
        let camera = &self.station.camera;
        let (blur, read_noise, response) = (camera.blur.nominal, self.station.noise, camera.response);
        let sensor = Sensor { blur, read_noise, response, ..Sensor::ideal() };
        sensor.expose(shot, weights, self.design.train.seed ^ number)
    }

    fn items(&self) -> ItemBuffer {
        let bodies = build::bodies(&self.drawn.instance(&[]), self.drawn.standing.to_array());
        ItemBuffer::of(&bodies, self.camera)
    }
}

fn grey(photo: &GrayImage) -> Vec<u8> {
    encoded(|out| photo.write_to(out, ImageFormat::Png))
}

fn colour(picture: &RgbImage) -> Vec<u8> {
    encoded(|out| picture.write_to(out, ImageFormat::Png))
}

/// Writing to memory does not fail; an empty file would show it if it did.
fn encoded(write: impl FnOnce(&mut Cursor<&mut Vec<u8>>) -> image::ImageResult<()>) -> Vec<u8> {
    let mut bytes = Vec::new();
    if write(&mut Cursor::new(&mut bytes)).is_err() {
        bytes.clear();
    }
    bytes
}
