//! Synthetic photos, before any light level is chosen: one linear image per lamp.
//!
//! In: a design, a station, the number of a draw and the faults to show. Out: [`Shot`]s, all of one draw of dimensions,
//! finishes and standing pose, so that a faulty shot differs from the good one by the fault alone.

use crate::assembly::fault::{self, ErrorMode, Motion};
use crate::assembly::place::place;
use crate::design::model::{Design, Station};
use crate::diag::Diagnostic;
use crate::render::{self, LightImages, Settings};
use crate::rng::Stream;
use crate::runtime::camera::Camera;
use crate::runtime::grid::Grid;
use crate::runtime::pose::Pose;
use crate::scene::build::{self, FLOOR, Instance};
use crate::scene::{Finish, Lamp};
use crate::solid::{Quality, Solid, evaluate};
use crate::variation;
use crate::view::item_buffer::ItemBuffer;
use crate::view::nodes::{change_mask, dilate};
use nalgebra::Isometry3;
use std::sync::Arc;

/// Margin round the assembly's image (px of the shot).
const MARGIN: f64 = 12.0;
/// How far round a change its shade and mirror image are rendered anew (px of the shot).
const NEAR: usize = 6;

/// A draw of the assembly: pieces within tolerance, standing somewhere on the station.
pub struct Drawn {
    pub solids: Vec<Arc<Solid>>,
    pub poses: Vec<Isometry3<f64>>,
    pub finishes: Vec<Finish>,
    pub ground: Option<Finish>,
    pub standing: Pose,
    /// Standard deviation of the photo's point spread (px of the photo).
    pub blur: f64,
}

/// The assembly at nominal, in the middle of its standing ranges.
pub fn nominal(design: &Design, station: &Station) -> Result<Drawn, Vec<Diagnostic>> {
    let values = design.nominal();
    let finish = |m: usize| build::finish_nominal(&design.materials[m]);
    Ok(Drawn {
        solids: solids(design, &values)?,
        poses: place(design, &values),
        finishes: design.components.iter().map(|c| finish(design.parts[c.part].material)).collect(),
        ground: station.floor.as_ref().map(|f| finish(f.material)),
        standing: Pose::from_array(standing(station).map(|[low, high]| (low + high) / 2.0)),
        blur: station.camera.blur.range.nominal,
    })
}

/// Draw number `image` of the stream `seed`.
pub fn draw(design: &Design, station: &Station, seed: u64, image: u64) -> Result<Drawn, Vec<Diagnostic>> {
    let values = variation::draw(design, seed, image);
    let finish = |component: usize, m: usize| build::finish(&design.materials[m], seed, image, component);
    let mut stream = Stream::new(seed, "standing", image);
    Ok(Drawn {
        solids: solids(design, &values)?,
        poses: place(design, &values),
        finishes: design.components.iter().enumerate().map(|(i, c)| finish(i, design.parts[c.part].material)).collect(),
        ground: station.floor.as_ref().map(|f| finish(FLOOR, f.material)),
        standing: Pose::from_array(standing(station).map(|[low, high]| stream.between(low, high))),
        blur: station.camera.blur.at(Stream::new(seed, "blur", image).uniform()),
    })
}

/// Ranges of x, y, z (mm) and rz (rad) in which the assembly may stand.
pub fn standing(station: &Station) -> [[f64; 2]; 4] {
    [station.x, station.y, station.z, station.rz].map(|r| [r.low, r.high])
}

fn solids(design: &Design, values: &[f64]) -> Result<Vec<Arc<Solid>>, Vec<Diagnostic>> {
    let quality = Quality::default();
    // Components of one part share their solid; parts are few, so each is evaluated once.
    let parts: Vec<Result<Arc<Solid>, Vec<Diagnostic>>> =
        design.parts.iter().map(|part| evaluate(part, values, &quality).map(Arc::new)).collect();
    design.components.iter().map(|c| parts[c.part].clone()).collect()
}

impl Drawn {
    /// The instance with some error modes applied, each with its own place in its sweep.
    pub fn instance(&self, faults: &[(&ErrorMode, [f64; 3])]) -> Instance {
        let mut instance = Instance {
            solids: self.solids.iter().cloned().map(Some).collect(),
            poses: self.poses.clone(),
            finishes: self.finishes.clone(),
        };
        for (mode, u) in faults {
            let faulted = fault::apply(mode, *u, &self.solids, &self.poses);
            match faulted.pose {
                Some(pose) => instance.poses[mode.component] = pose,
                None => instance.solids[mode.component] = None,
            }
            if let Some(other) = faulted.solid {
                instance.solids[mode.component] = Some(other);
            }
            if let Motion::Replace { by, .. } = mode.motion {
                instance.finishes[mode.component] = self.finishes[by].clone();
            }
            for (component, pose) in faulted.pushed {
                instance.poses[component] = pose;
            }
        }
        instance
    }
}

/// One image per lamp, in the full frame of the reduced camera.
pub struct Shot {
    pub pose: Pose,
    pub lamps: Vec<Grid>,
}

impl Shot {
    /// The sum under the given lamp weights, unclipped.
    pub fn lit(&self, weights: &[f64]) -> Grid {
        let mut sum = Grid::filled(self.lamps[0].width, self.lamps[0].height, 0.0);
        for (lamp, &weight) in self.lamps.iter().zip(weights) {
            sum.values.iter_mut().zip(&lamp.values).for_each(|(s, v)| *s += v * weight as f32);
        }
        sum
    }
}

/// How shots are taken.
pub struct Setup<'a> {
    pub station: &'a Station,
    /// At the resolution of the shots.
    pub camera: Camera,
    pub lamps: Vec<Lamp>,
    pub samples: u32,
    /// px of the photo per px of the shots.
    pub base: u32,
}

/// A correct shot before the lens blurs it, with what the camera sees: what faulty shots of the same draw are made from.
pub struct Base {
    images: LightImages,
    seen: ItemBuffer,
}

/// Takes a shot of a correct assembly; `seed` keys the renderer's own randomness.
pub fn take_good(setup: &Setup, drawn: &Drawn, seed: u64) -> (Shot, Base) {
    let instance = drawn.instance(&[]);
    let settings = settings(setup, drawn, &instance, seed);
    let images = trace(setup, drawn, &instance, &settings);
    let shot = develop(setup, drawn, &images);
    (shot, Base { images, seen: see(setup, drawn, &instance) })
}

/// Takes a shot of a faulty assembly. Only what the fault changes, and what lies near enough to be shaded or mirrored by it,
/// is rendered; the rest is the correct shot's.
pub fn take_faulty(setup: &Setup, drawn: &Drawn, instance: &Instance, seed: u64, base: &Base) -> Shot {
    let changed = dilate(&change_mask(&base.seen, &see(setup, drawn, instance)), NEAR);
    let settings = Settings { only: Some(changed.bits), ..settings(setup, drawn, instance, seed) };
    let mut images = trace(setup, drawn, instance, &settings);
    let only = settings.only.unwrap_or_default();
    overlay(&mut images, &base.images, &only);
    develop(setup, drawn, &images)
}

fn settings(setup: &Setup, drawn: &Drawn, instance: &Instance, seed: u64) -> Settings {
    let crop = crop(&setup.camera, instance, &drawn.standing);
    Settings { samples: setup.samples, seed, crop: Some(crop), ..Settings::default() }
}

fn see(setup: &Setup, drawn: &Drawn, instance: &Instance) -> ItemBuffer {
    ItemBuffer::of(&build::bodies(instance, drawn.standing.to_array()), &setup.camera)
}

fn trace(setup: &Setup, drawn: &Drawn, instance: &Instance, settings: &Settings) -> LightImages {
    let standing = drawn.standing.to_array();
    let scene = build::scene(setup.station, instance, standing, setup.lamps.clone(), drawn.ground.clone());
    render::render(&scene, &setup.camera, settings)
}

/// Fills the pixels that were not rendered from another shot; beyond its crop its border goes on.
fn overlay(images: &mut LightImages, base: &LightImages, only: &[bool]) {
    let [x0, y0, x1, y1] = images.crop;
    let [bx0, by0, bx1, by1] = base.crop;
    let width = (bx1 - bx0) as usize;
    for y in y0..y1 {
        let row = (y.clamp(by0, by1 - 1) - by0) as usize * width;
        for x in x0..x1 {
            if !only[(y * images.width + x) as usize] {
                let from = row + (x.clamp(bx0, bx1 - 1) - bx0) as usize;
                let to = ((y - y0) * (x1 - x0) + x - x0) as usize;
                for (group, good) in images.groups.iter_mut().zip(&base.groups) {
                    group[to] = good[from];
                }
            }
        }
    }
}

/// Lens and frame: from rendered pixels to the full image.
fn develop(setup: &Setup, drawn: &Drawn, images: &LightImages) -> Shot {
    let [width, height] = images.size().map(|s| s as usize);
    let blur = drawn.blur / f64::from(setup.base);
    let grid = |group: &Vec<f32>| {
        let mut values = group.clone();
        render::sensor::blur(&mut values, width, height, blur as f32);
        framed(Grid::new(width, height, values), images.crop, setup.camera.size)
    };
    Shot { pose: drawn.standing, lamps: images.groups.iter().map(grid).collect() }
}

/// Pixels that hold the image of the instance, with a margin.
fn crop(camera: &Camera, instance: &Instance, standing: &Pose) -> [u32; 4] {
    let mut hull = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for (solid, pose) in instance.solids.iter().zip(&instance.poses) {
        for point in solid.iter().flat_map(|s| &s.mesh.positions) {
            let p = standing.apply((pose * point).coords.into());
            if let Some([u, v]) = camera.project(p) {
                hull = [hull[0].min(u), hull[1].min(v), hull[2].max(u), hull[3].max(v)];
            }
        }
    }
    let [width, height] = camera.size.map(f64::from);
    let low = |v: f64, size: f64| (v - MARGIN).floor().clamp(0.0, size - 1.0) as u32;
    let high = |v: f64, size: f64| (v + MARGIN).ceil().clamp(1.0, size) as u32;
    let [x0, y0] = [low(hull[0], width), low(hull[1], height)];
    [x0, y0, high(hull[2], width).max(x0 + 1), high(hull[3], height).max(y0 + 1)]
}

/// A crop in its full frame; outside, the border goes on, so that no edge appears that is none.
fn framed(crop: Grid, [x0, y0, _, _]: [u32; 4], size: [u32; 2]) -> Grid {
    let [width, height] = size.map(|s| s as usize);
    let mut values = Vec::with_capacity(width * height);
    for y in 0..height {
        let row = y.saturating_sub(y0 as usize).min(crop.height - 1) * crop.width;
        values.extend((0..width).map(|x| crop.values[row + x.saturating_sub(x0 as usize).min(crop.width - 1)]));
    }
    Grid::new(width, height, values)
}
