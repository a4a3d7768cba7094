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
use image::{ImageFormat, RgbImage};
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
        ("images/good.png".into(), studio.expose(&good, &weights, 0)),
        ("images/components.png".into(), colour(&false_colour(&studio.items()))),
    ];
    for (mode, number) in modes.iter().zip(1..) {
        let name = &design.components[mode.component].name;
        let file = format!("images/{number:02} {name} {}.png", mode.kind.word());
        let shot = studio.take(&[(mode, MIDDLE)], number);
        files.push((file, studio.expose(&shot, &weights, number)));
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
        let gain = gain * self.station.exposure.range.nominal;
        powers.iter().map(|p| p * gain).collect()
    }

    /// The photo as a file: of 16 bits where the camera gives more than 8.
    fn expose(&self, shot: &LightImages, weights: &[f64], number: u64) -> Vec<u8> {
        let camera = &self.station.camera;
        let sensor = Sensor {
            blur: camera.blur.range.nominal,
            vignetting: camera.vignetting.nominal,
            read_noise: self.station.noise,
            full_well: camera.full_well,
            response: camera.response,
            depth: camera.depth,
        };
        let seed = self.design.train.seed ^ number;
        if camera.depth > 8 {
            let photo = sensor.expose_deep(shot, weights, seed);
            return encoded(|out| photo.write_to(out, ImageFormat::Png));
        }
        let photo = sensor.expose(shot, weights, seed);
        encoded(|out| photo.write_to(out, ImageFormat::Png))
    }

    fn items(&self) -> ItemBuffer {
        let bodies = build::bodies(&self.drawn.instance(&[]), self.drawn.standing.to_array());
        ItemBuffer::of(&bodies, self.camera)
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::camera::let_through;
    use crate::runtime::photo::{Photo, Tone};
    use crate::scene::build::{Placed, camera as build_camera};

    /// The good photo of a plate that fills the image, linear, and its file; `lens` and `vary` go into the spec.
    fn photo(lens: &str, vary: &str) -> (Photo, Vec<u8>, Camera) {
        let text = format!(
            "gonogo 1
material paint {{
    kind        = matt
    reflectance = 0.6
}}
part plate {{
    material = paint
    add slab = box(x = 60, y = 60, z = 2)
}}
assembly single {{
    root plate
}}
station bench {{
    camera fixed {{
        image    = 64 x 48 px
        focal    = 16
        pitch    = 0.1
        distance = 100
        blur     = 0
        {lens}
    }}
    light room = room(patches = 1)
    vary {{
        {vary}
    }}
}}
train {{
    samples = 4
}}
"
        );
        let loaded = crate::design::load("plate.gng", &|_| Ok(text.clone()), &[]);
        let design = loaded.design.unwrap_or_else(|| panic!("{:#?}", loaded.diagnostics));
        let station = &design.stations[0];
        let upright = Placed { distance: 100.0, elevation: std::f64::consts::FRAC_PI_2, azimuth: 0.0 };
        let camera = build_camera(&station.camera, upright);
        let (_, file) = pictures(&design, station, &camera, &[]).swap_remove(0);
        (Photo::decode(&file, Tone::Linear, [64, 48]).unwrap(), file, camera)
    }

    fn scatter(photo: &Photo) -> f64 {
        let values = &photo.light.values;
        let n = values.len() as f64;
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / n;
        values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum::<f64>() / n
    }

    #[test]
    fn every_trait_of_the_camera_is_in_the_photo() {
        const QUIET: &str = "noise = 0";
        let (plain, file, camera) = photo("", QUIET);
        assert_eq!(file[24], 8, "bits of the PNG");
        assert!(scatter(&plain) < 1e-5, "a plate under an even sky is even: {}", scatter(&plain));

        let (dimmed, ..) = photo("vignetting = 0.4", QUIET);
        for place in [[0, 0], [63, 47], [5, 30], [32, 24]] {
            let share = f64::from(dimmed.light.at(place[0], place[1]) / plain.light.at(place[0], place[1]));
            let expected = let_through(0.4, [64, 48], place.map(|p| p as f64 + 0.5));
            assert!((share - expected).abs() < 0.02, "{place:?}: {share} {expected}");
        }

        // Shot noise: grey is near 0.6 of full scale.
        let (noisy, ..) = photo("full_well = 500", QUIET);
        let expected = 0.6 / 500.0;
        assert!((scatter(&noisy) / expected - 1.0).abs() < 0.15, "{} {expected}", scatter(&noisy));
        let (dark, ..) = photo("", "noise = 0.03");
        assert!((scatter(&dark) / 9e-4 - 1.0).abs() < 0.15, "{}", scatter(&dark));

        let (deep, file, _) = photo("depth = 12", "noise = 0.01");
        let levels: std::collections::BTreeSet<u32> = deep.light.values.iter().map(|v| (v * 65_535.0) as u32).collect();
        assert!(file[24] == 16 && levels.len() > 60, "{}", levels.len());

        let (_, _, bent) = photo("k2 = 0.05", QUIET);
        let corner = [18.0, 14.0, 2.0];
        let [a, b] = [camera, bent].map(|c| c.project(corner).unwrap()[0] - 32.0);
        let (_, _, other) = photo("k1 = 0.05", QUIET);
        assert!(b / a > 1.02 && other.project(corner).unwrap()[0] - 32.0 != b, "{a} {b}");
    }
}
