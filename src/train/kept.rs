//! What training keeps for the next time: the shots of a draw, and all that was learnt from them.
//!
//! In: a job and its cache. Out: what was kept under a digest of everything it depends on, or nothing. Whatever is left out
//! of a digest is something the kept result is the same without; that is the whole art of this file. What comes out of the
//! cache is what went in, bit for bit, so a model is the same with and without.

use super::shots::{Setup, Shot};
use super::synthesise::{FaultyShot, Taken};
use super::{Job, Learnt};
use crate::assembly::fault::ErrorMode;
use crate::cache::bytes::{Reader, Writer};
use crate::cache::{Cache, Key};
use crate::design::essence::{essence, is_exact};
use crate::design::model::{Colour, Design, LightShape, LightSpec};
use crate::runtime::camera::Camera;
use crate::runtime::grid::Grid;
use crate::runtime::pose::Pose;
use crate::variation;
use serde::Serialize;

/// What an image knows of a light.
#[derive(Serialize)]
#[serde(untagged)]
enum Shining<'a> {
    White(&'a LightShape),
    Coloured(&'a LightShape, Colour),
}

impl Shining<'_> {
    fn of(light: &LightSpec) -> Shining<'_> {
        match light.colour {
            Colour::White => Shining::White(&light.shape),
            colour => Shining::Coloured(&light.shape, colour),
        }
    }
}

/// The draws that one camera takes.
pub struct Kept<'a> {
    cache: Option<&'a dyn Cache>,
    design: &'a Design,
    modes: &'a [ErrorMode],
    /// Of all that the draws have in common.
    common: Key,
    /// Of every image (px), and how many there are to a shot.
    size: [usize; 2],
    lamps: usize,
}

impl<'a> Kept<'a> {
    /// `camera` at full resolution.
    pub fn new(job: &Job<'a>, setup: &Setup, camera: &Camera) -> Kept<'a> {
        let station = job.station;
        // The values of its dimensions are what a draw sees of them; powers, drifts and noise come after the images.
        let mut design = essence(job.design);
        design.dims.clear();
        design.inspect.watch.clear();
        let lights: Vec<Shining> = station.lights.iter().map(Shining::of).collect();
        let ranges = [station.x, station.y, station.z, station.rz];
        let taken = (&setup.camera, camera, setup.samples, setup.base, &station.camera.blur);
        Kept {
            cache: job.cache,
            design: job.design,
            modes: job.modes,
            common: Key::new("shots", &(design, lights, &station.floor, ranges, taken)),
            size: setup.camera.size.map(|s| s as usize),
            lamps: setup.lamps.len(),
        }
    }

    /// The shots of a draw in these scenes, if they were kept.
    pub fn draw(&self, seed: u64, image: u64, scenes: &[Vec<usize>]) -> Option<Taken> {
        let bytes = self.cache?.get(&self.key(seed, image, scenes))?;
        let mut reader = Reader::new(&bytes);
        let good = self.read_shot(&mut reader, None)?;
        let mut faulty = Vec::new();
        for scene in scenes {
            let places = scene.iter().map(|_| reader.number()).collect::<Option<Vec<f64>>>()?;
            faulty.push(FaultyShot { shot: self.read_shot(&mut reader, Some(&good))?, places });
        }
        reader.is_empty().then_some(Taken { good, faulty })
    }

    pub fn keep_draw(&self, seed: u64, image: u64, scenes: &[Vec<usize>], taken: &Taken) {
        let Some(cache) = self.cache else { return };
        let mut writer = Writer::default();
        self.write_shot(&mut writer, &taken.good, None);
        for faulty in &taken.faulty {
            faulty.places.iter().for_each(|place| writer.number(*place));
            self.write_shot(&mut writer, &faulty.shot, Some(&taken.good));
        }
        cache.put(&self.key(seed, image, scenes), &writer.finish());
    }

    fn key(&self, seed: u64, image: u64, scenes: &[Vec<usize>]) -> Key {
        let values = variation::draw(self.design, seed, image);
        // A mode's number names the streams of its sweep.
        let scene = |scene: &Vec<usize>| scene.iter().map(|&m| (m, &self.modes[m])).collect::<Vec<_>>();
        self.common.with(&(seed, image, values, scenes.iter().map(scene).collect::<Vec<_>>()))
    }

    /// A faulty shot is written as what it has other than the good one, a good one as what it has other than the row above:
    /// beyond the assembly the border of an image goes on.
    fn write_shot(&self, writer: &mut Writer, shot: &Shot, good: Option<&Shot>) {
        shot.pose.to_array().into_iter().for_each(|v| writer.number(v));
        for (lamp, grid) in shot.lamps.iter().enumerate() {
            match good {
                Some(good) => writer.image(&grid.values, |_, i| good.lamps[lamp].values[i]),
                None => writer.image(&grid.values, above(self.size[0])),
            }
        }
    }

    fn read_shot(&self, reader: &mut Reader, good: Option<&Shot>) -> Option<Shot> {
        let pose = [reader.number()?, reader.number()?, reader.number()?, reader.number()?];
        let [width, height] = self.size;
        let mut lamps = Vec::new();
        for lamp in 0..self.lamps {
            let values = match good {
                Some(good) => reader.image(width * height, |_, i| good.lamps[lamp].values[i]),
                None => reader.image(width * height, above(width)),
            };
            lamps.push(Grid::new(width, height, values?));
        }
        Some(Shot { pose: Pose::from_array(pose), lamps })
    }
}

fn above(width: usize) -> impl Fn(&[f32], usize) -> f32 {
    move |values, i| if i < width { 0.0 } else { values[i - width] }
}

/// What was learnt by the same job, but for its false rejects and for names that stand in no image.
pub(super) fn learnt(job: &Job) -> Option<Learnt> {
    let bytes = job.cache?.get(&key(job))?;
    ron::from_str(std::str::from_utf8(&bytes).ok()?).ok()
}

pub(super) fn keep_learnt(job: &Job, learnt: &Learnt) {
    if let (Some(cache), Ok(text)) = (job.cache, ron::to_string(learnt)) {
        cache.put(&key(job), text.as_bytes());
    }
}

fn key(job: &Job) -> Key {
    let mut design = essence(job.design);
    let turns = variation::free_turns(job.design);
    for ((bare, named), turn) in design.dims.iter_mut().zip(&job.design.dims).zip(turns) {
        // The name of a dimension that varies names the stream of its draws.
        if turn || !is_exact(&named.range) {
            bare.name = named.name.clone();
        }
    }
    // Models name components, by which faults are reported.
    for (bare, named) in design.components.iter_mut().zip(&job.design.components) {
        bare.name = named.name.clone();
    }
    design.train = job.design.train.clone();
    let beside: Vec<_> = (0..job.liaison.components).map(|c| job.liaison.neighbours(c)).collect();
    Key::new("learnt", &(design, job.station, &job.camera, job.modes, job.tree, beside))
}
