//! Pictures of the nominal assembly for people: what the camera sees, which component is where, and every error mode.
//!
//! In: a design, its station, the camera, the error modes. Out: PNG files by name. Never read back by any stage.

use crate::assembly::fault::ErrorMode;
use crate::design::model::{Design, Station};
use crate::runtime::camera::Camera;
use crate::runtime::grid::Grid;
use crate::scene::build;
use crate::train::shots::{self, Drawn, Setup, Shot};
use crate::view::item_buffer::ItemBuffer;
use crate::view::picture::false_colour;
use image::{GrayImage, ImageFormat, Luma, RgbImage};
use std::io::Cursor;

/// Faults are shown in the middle of their range.
const MIDDLE: [f64; 3] = [0.5; 3];
/// Pictures of faults have this many times fewer pixels each way.
const FAULT_REDUCTION: u32 = 2;
/// The brightest pixels but this share of all stay below full scale.
const HIGHLIGHTS: f64 = 0.02;

/// `images/good.png`, `images/components.png`, and `images/<component> <fault>.png` for every error mode.
pub fn pictures(design: &Design, station: &Station, camera: &Camera, modes: &[ErrorMode]) -> Vec<(String, Vec<u8>)> {
    let Ok(drawn) = shots::nominal(design, station) else { return Vec::new() };
    let take = |camera: Camera, reduction: u32, faults: &[(&ErrorMode, [f64; 3])]| {
        let setup = Setup {
            station,
            lamps: build::lamps(station, &camera),
            camera: camera.reduced(reduction),
            samples: design.train.samples,
            blur: station.camera.blur.nominal / f64::from(reduction),
        };
        lit(station, &shots::take(&setup, &drawn, &drawn.instance(faults), design.train.seed))
    };
    let good = take(*camera, 1, &[]);
    let white = exposure(&good);
    let mut files = vec![
        ("images/good.png".into(), png_grey(&good, white)),
        ("images/components.png".into(), png(&false_colour(&items(&drawn, camera)))),
    ];
    for (number, mode) in modes.iter().enumerate() {
        let name = &design.components[mode.component].name;
        let file = format!("images/{:02} {name} {}.png", number + 1, mode.kind.word());
        files.push((file, png_grey(&take(*camera, FAULT_REDUCTION, &[(mode, MIDDLE)]), white)));
    }
    files
}

fn items(drawn: &Drawn, camera: &Camera) -> ItemBuffer {
    ItemBuffer::of(&build::bodies(&drawn.instance(&[]), drawn.standing.to_array()), camera)
}

/// Under the lamps as the spec describes them.
fn lit(station: &Station, shot: &Shot) -> Grid {
    let lights = build::light_of_group(station);
    let powers: Vec<f64> = lights.iter().map(|&l| station.lights[l].power).collect();
    shot.lit(&powers)
}

/// The value that becomes white.
fn exposure(grid: &Grid) -> f32 {
    let mut values = grid.values.clone();
    values.sort_by(f32::total_cmp);
    let at = ((values.len() as f64) * (1.0 - HIGHLIGHTS)) as usize;
    values.get(at).copied().filter(|v| *v > 0.0).unwrap_or(1.0)
}

fn png_grey(grid: &Grid, white: f32) -> Vec<u8> {
    let grey = GrayImage::from_fn(grid.width as u32, grid.height as u32, |x, y| {
        let value = grid.at(x as usize, y as usize) / white;
        // The eye's curve; 2.2 is close enough for pictures nobody measures in.
        Luma([(value.clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0).round() as u8])
    });
    encoded(|out| grey.write_to(out, ImageFormat::Png))
}

fn png(picture: &RgbImage) -> Vec<u8> {
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
