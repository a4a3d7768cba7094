//! Where a camera would see a fault better.
//!
//! In: a fault that the station's camera hardly shows. Out: the view about the same aim, at the same distance, from which
//! the fault changes most of the image: pixels that show another face or component. Advice only: nothing is rendered, and
//! no camera is moved.

use super::Job;
use super::shots::Drawn;
use crate::assembly::fault::ErrorMode;
use crate::runtime::camera::Camera;
use crate::scene::build::{self, Placed, bodies};
use crate::view::item_buffer::ItemBuffer;
use serde::{Deserialize, Serialize};

/// Views that are tried (deg): elevations, and azimuths all round in steps.
const ELEVATIONS: [f64; 4] = [30.0, 45.0, 60.0, 75.0];
const AZIMUTH_STEP: f64 = 30.0;
/// They are looked at in an image reduced to about this width (px).
const WIDTH: u32 = 160;
/// A view is worth mentioning when the fault changes this many times as many pixels as here.
const WORTHWHILE: f64 = 2.0;
/// Fewer pixels (of the reduced image) than this show nothing anywhere.
const LEAST_PIXELS: usize = 8;

/// A view and what a fault in the middle of its sweep changes in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OtherView {
    /// deg.
    pub elevation: f64,
    pub azimuth: f64,
    /// px of the full image, from there and from the station's camera.
    pub pixels: usize,
    pub here: usize,
}

/// The good assembly from every view that is tried.
pub struct Views<'a> {
    nominal: &'a Drawn,
    here: (Camera, ItemBuffer),
    others: Vec<(f64, f64, Camera, ItemBuffer)>,
    /// px of the photo per px of the images looked at.
    reduced: u32,
}

impl<'a> Views<'a> {
    pub fn new(job: &Job, nominal: &'a Drawn) -> Self {
        let spec = &job.station.camera;
        let reduced = (spec.image[0] / WIDTH).max(1);
        let distance = (0..3).map(|i| (job.camera.position[i] - spec.aim[i]).powi(2)).sum::<f64>().sqrt();
        let good = |camera: Camera| (camera, seen(nominal, &[], &camera));
        let round = (0..(360.0 / AZIMUTH_STEP) as usize).map(|k| AZIMUTH_STEP * k as f64 - 180.0);
        let places = round.flat_map(|azimuth| ELEVATIONS.map(|elevation| (elevation, azimuth)));
        let other = |(elevation, azimuth): (f64, f64)| {
            let placed = Placed { distance, elevation: elevation.to_radians(), azimuth: azimuth.to_radians() };
            let (camera, buffer) = good(build::camera(spec, placed).reduced(reduced));
            (elevation, azimuth, camera, buffer)
        };
        Views { nominal, here: good(job.camera.reduced(reduced)), others: places.map(other).collect(), reduced }
    }

    /// The view that shows a fault best, if it shows it much better than the station's camera.
    pub fn better(&self, mode: &ErrorMode) -> Option<OtherView> {
        let changed = |camera: &Camera, good: &ItemBuffer| {
            let faulty = seen(self.nominal, &[(mode, [0.5; 3])], camera);
            (0..good.id.len()).filter(|&i| (good.id[i], good.face[i]) != (faulty.id[i], faulty.face[i])).count()
        };
        let here = changed(&self.here.0, &self.here.1);
        let seen_from = self.others.iter().map(|(e, a, camera, good)| (changed(camera, good), *e, *a));
        // The first of equals: the same advice on every machine.
        let best = seen_from.reduce(|best, next| if next.0 > best.0 { next } else { best });
        let (pixels, elevation, azimuth) = best?;

        let full = (self.reduced * self.reduced) as usize;
        let worthwhile = pixels >= LEAST_PIXELS && pixels as f64 > WORTHWHILE * here as f64;
        worthwhile.then_some(OtherView { elevation, azimuth, pixels: pixels * full, here: here * full })
    }
}

fn seen(drawn: &Drawn, faults: &[(&ErrorMode, [f64; 3])], camera: &Camera) -> ItemBuffer {
    ItemBuffer::of(&bodies(&drawn.instance(faults), drawn.standing.to_array()), camera)
}

impl OtherView {
    /// Words for a note.
    pub fn advice(&self) -> String {
        let OtherView { elevation, azimuth, pixels, here } = self;
        format!(
            "from `elevation = {elevation:.0} deg`, `azimuth = {azimuth:.0} deg` it shows other faces in about {pixels} px, \
             here in {here}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{analyse, error_tree, fault};
    use crate::solid::{Quality, evaluate};
    use std::sync::Arc;

    /// Straight from above a raised pin covers what it covered before; from the side it stands out.
    #[test]
    fn a_raised_pin_is_seen_better_from_the_side_than_from_above() {
        let text = include_str!("../../tests/data/two_pins.gng");
        let mut design = crate::design::load("two_pins.gng", &|_| Ok(text.into()), &[]).design.expect("a fine spec");
        let nominal = design.nominal();
        let solid = |c: usize| {
            Arc::new(
                evaluate(&design.parts[design.components[c].part], &nominal, &Quality::default()).expect("a solid"),
            )
        };
        let solids: Vec<_> = (0..design.components.len()).map(solid).collect();
        let (found, _) = analyse(&design, &solids);
        let modes = fault::modes(&design, &found.liaison, &found.insertion, &solids);
        let spec = &mut design.stations[0].camera;
        spec.placing =
            crate::design::model::CameraPlacing::Fixed { distance: 300.0, elevation: 90f64.to_radians(), azimuth: 0.0 };
        let camera = build::camera(spec, Placed { distance: 300.0, elevation: 90f64.to_radians(), azimuth: 0.0 });
        let tree = error_tree::error_tree(&found.liaison, 0, None);
        let station = &design.stations[0];
        let job = Job {
            design: &design,
            station,
            camera,
            modes: &modes,
            liaison: &found.liaison,
            tree: &tree,
            spec: String::new(),
            cache: None,
        };
        let drawn = super::super::shots::nominal(&design, station).map_err(|_| ()).expect("a nominal draw");
        let views = Views::new(&job, &drawn);
        let raised = modes.iter().find(|m| m.kind == fault::FaultKind::NotSeated).expect("pins can stand too high");
        let better = views.better(raised).expect("some view shows it");
        assert!(better.elevation <= 60.0 && better.pixels > 2 * better.here, "{better:?}");
        let missing = modes.iter().find(|m| m.kind == fault::FaultKind::Missing).expect("pins can be missing");
        assert!(views.better(missing).is_none_or(|v| v.here > 0), "what is seen from above is not unseen");
    }
}
