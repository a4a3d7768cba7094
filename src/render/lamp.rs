//! Lamps: flat sources of finite size, and the sky in patches.
//!
//! In: [`Lamp`]s of a scene. Out: where a ray meets a lamp, and directions drawn towards one with their density. Every lamp
//! has radiance 1 and belongs to a light group. Never traces a ray.

use super::accel::Ray;
use super::vector::{Vec3, sine_cosine};
use crate::scene::{Emitter, Lamp};
use nalgebra::Isometry3;
use std::f32::consts::{PI, TAU};

/// A direction drawn towards a light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Towards {
    pub direction: Vec3,
    /// Distance to the light (mm); infinite for the sky.
    pub distance: f32,
    /// Density of the draw (1/sr).
    pub pdf: f32,
}

/// A flat lamp with a body: bright on the front, black on the back.
#[derive(Debug, Clone)]
pub(super) struct FlatLamp {
    centre: Vec3,
    x: Vec3,
    y: Vec3,
    /// The side that emits.
    normal: Vec3,
    outline: Outline,
    area: f32,
    pub group: usize,
}

#[derive(Debug, Clone, Copy)]
enum Outline {
    /// Squares of the inner and outer radius.
    Ring { inner2: f32, outer2: f32 },
    /// Half the width (along x) and height (along y).
    Panel { half_width: f32, half_height: f32 },
}

/// Where a ray meets a lamp.
#[derive(Debug, Clone, Copy)]
pub(super) struct LampHit {
    pub t: f32,
    /// Cosine at the lamp: positive on the bright side.
    pub cosine: f32,
}

impl FlatLamp {
    /// `None` for the sky.
    pub fn new(lamp: &Lamp) -> Option<FlatLamp> {
        match lamp.emitter {
            Emitter::Ring { frame, inner, outer } => {
                let [inner2, outer2] = [inner, outer].map(|r| (r * r) as f32);
                Some(FlatLamp::placed(&frame, Outline::Ring { inner2, outer2 }, PI * (outer2 - inner2), lamp.group))
            }
            Emitter::Panel { frame, width, height } => {
                let outline = Outline::Panel { half_width: width as f32 / 2.0, half_height: height as f32 / 2.0 };
                Some(FlatLamp::placed(&frame, outline, (width * height) as f32, lamp.group))
            }
            Emitter::Sky { .. } => None,
        }
    }

    fn placed(frame: &Isometry3<f64>, outline: Outline, area: f32, group: usize) -> FlatLamp {
        let axes = frame.rotation.to_rotation_matrix().into_inner().cast::<f32>();
        FlatLamp {
            centre: frame.translation.vector.cast(),
            x: axes.column(0).into_owned(),
            y: axes.column(1).into_owned(),
            normal: axes.column(2).into_owned(),
            outline,
            area,
            group,
        }
    }

    /// Where a ray with a unit direction meets the lamp, on either side, at 0 < t < `ray.reach`.
    pub fn hit(&self, ray: &Ray) -> Option<LampHit> {
        let cosine = -self.normal.dot(&ray.direction);
        let t = self.normal.dot(&(ray.origin - self.centre)) / cosine;
        // A ray along the lamp's plane gives a t that is infinite or not a number.
        if !(t > 0.0 && t < ray.reach && t.is_finite()) {
            return None;
        }
        let offset = ray.origin + ray.direction * t - self.centre;
        let (x, y) = (offset.dot(&self.x), offset.dot(&self.y));
        let inside = match self.outline {
            Outline::Ring { inner2, outer2 } => (inner2..=outer2).contains(&(x * x + y * y)),
            Outline::Panel { half_width, half_height } => x.abs() <= half_width && y.abs() <= half_height,
        };
        inside.then_some(LampHit { t, cosine })
    }

    /// A direction from a point to a point of the lamp's face, uniform in area. `None` from behind the lamp.
    pub fn sample(&self, from: Vec3, u: [f32; 2]) -> Option<Towards> {
        let [x, y] = match self.outline {
            Outline::Ring { inner2, outer2 } => {
                let radius = (inner2 + (outer2 - inner2) * u[0]).sqrt();
                let (sine, cosine) = sine_cosine(u[1]);
                [radius * cosine, radius * sine]
            }
            Outline::Panel { half_width, half_height } => {
                [half_width * (2.0 * u[0] - 1.0), half_height * (2.0 * u[1] - 1.0)]
            }
        };
        let way = self.centre + self.x * x + self.y * y - from;
        let distance = way.norm();
        let direction = way / distance;
        let pdf = self.pdf(distance, -self.normal.dot(&direction));
        (pdf > 0.0 && pdf.is_finite()).then_some(Towards { direction, distance, pdf })
    }

    /// Density (1/sr) of [`FlatLamp::sample`] for a point of the face at this distance and cosine; 0 from behind.
    pub fn pdf(&self, distance: f32, cosine: f32) -> f32 {
        if cosine > 0.0 { distance * distance / (cosine * self.area) } else { 0.0 }
    }

    /// Radiance of a white matt surface at `at` that faces the lamp: the lamp's irradiance over π, the lamp taken as a point.
    pub fn white(&self, at: Vec3) -> f32 {
        let way = at - self.centre;
        let cosine = self.normal.dot(&way) / way.norm();
        cosine.max(0.0) * self.area / (PI * way.norm_squared())
    }
}

/// The sky: every patch of every group, taken as one light.
#[derive(Debug, Clone, Default)]
pub(super) struct Sky {
    patches: Vec<Patch>,
    /// Sum of the patches' solid angles (sr).
    solid_angle: f32,
}

#[derive(Debug, Clone)]
struct Patch {
    sines: [f32; 2],
    /// Azimuth covered (rad).
    width: f32,
    /// Horizontal directions of the two azimuths.
    edges: [[f32; 2]; 2],
    solid_angle: f32,
    group: usize,
}

impl Sky {
    pub fn new(lamps: &[Lamp]) -> Sky {
        let patches: Vec<Patch> = lamps.iter().filter_map(Patch::new).collect();
        let solid_angle = patches.iter().map(|p| p.solid_angle).sum();
        Sky { patches, solid_angle }
    }

    pub fn is_empty(&self) -> bool {
        self.patches.is_empty()
    }

    /// Whether any patch holds the direction.
    pub fn covers(&self, direction: Vec3) -> bool {
        self.patches.iter().any(|p| p.holds(direction))
    }

    /// The light group of every patch that holds the direction.
    pub fn groups(&self, direction: Vec3) -> impl Iterator<Item = usize> {
        self.patches.iter().filter(move |p| p.holds(direction)).map(|p| p.group)
    }

    /// Radiance of a white matt surface that faces the sky.
    pub fn white(&self) -> f32 {
        self.solid_angle / TAU
    }
}

impl Patch {
    fn new(lamp: &Lamp) -> Option<Patch> {
        let Emitter::Sky { sin_low, sin_high, azimuth_low, azimuth_high } = lamp.emitter else { return None };
        let azimuths = [azimuth_low as f32, azimuth_high as f32];
        let sines = [sin_low as f32, sin_high as f32];
        let edges = azimuths.map(|a| {
            let (sine, cosine) = sine_cosine(a / TAU);
            [cosine, sine]
        });
        let width = azimuths[1] - azimuths[0];
        let solid_angle = (sines[1] - sines[0]) * width;
        (solid_angle > 0.0).then_some(Patch { sines, width, edges, solid_angle, group: lamp.group })
    }

    fn holds(&self, d: Vec3) -> bool {
        // The zenith belongs to the patches that reach it.
        if d.z < self.sines[0] || (d.z >= self.sines[1] && self.sines[1] < 1.0) {
            return false;
        }
        let after = |edge: [f32; 2]| edge[0] * d.y - edge[1] * d.x >= 0.0;
        match () {
            () if self.width > TAU - 1e-4 => true,
            () if self.width <= PI => after(self.edges[0]) && !after(self.edges[1]),
            () => after(self.edges[0]) || !after(self.edges[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::model::Colour;
    use crate::rng::Stream;

    fn patches(rows: usize, columns: usize) -> Vec<Lamp> {
        let mut lamps = Vec::new();
        for i in 0..rows * columns {
            let (row, column) = ((i / columns) as f64, (i % columns) as f64);
            let width = std::f64::consts::TAU / columns as f64;
            lamps.push(Lamp {
                name: format!("sky {i}"),
                emitter: Emitter::Sky {
                    sin_low: row / rows as f64,
                    sin_high: (row + 1.0) / rows as f64,
                    azimuth_low: column * width,
                    azimuth_high: (column + 1.0) * width,
                },
                group: i,
                colour: Colour::White,
            });
        }
        lamps
    }

    #[test]
    fn a_direction_of_the_upper_hemisphere_is_in_exactly_one_patch() {
        for (rows, columns) in [(1, 1), (1, 2), (2, 3), (3, 4), (1, 9)] {
            let sky = Sky::new(&patches(rows, columns));
            let mut s = Stream::new(1, "sky", 0);
            for _ in 0..2000 {
                let z = s.uniform() as f32;
                let (sine, cosine) = sine_cosine(s.uniform() as f32);
                let radius = (1.0 - z * z).sqrt();
                let d = Vec3::new(radius * cosine, radius * sine, z);
                assert_eq!(sky.groups(d).count(), 1, "{rows} {columns} {d:?}");
                assert_eq!(sky.groups(-d).count(), 0);
            }
            assert!((sky.white() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn draws_fall_on_the_lamp_with_the_stated_density() {
        let frame = Isometry3::look_at_rh(
            &nalgebra::Point3::new(30.0, -20.0, 100.0),
            &nalgebra::Point3::origin(),
            &nalgebra::Vector3::z(),
        )
        .inverse();
        // `look_at_rh` looks along -z: turn the frame so that +z faces the origin.
        let frame =
            frame * nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI);
        let emitters =
            [Emitter::Ring { frame, inner: 20.0, outer: 40.0 }, Emitter::Panel { frame, width: 30.0, height: 60.0 }];
        let mut s = Stream::new(2, "lamp", 0);
        for emitter in emitters {
            let lamp = FlatLamp::new(&Lamp { name: String::new(), emitter, group: 0, colour: Colour::White }).unwrap();
            for _ in 0..500 {
                let from = Vec3::new(3.0, 2.0, 1.0);
                let towards = lamp.sample(from, [s.uniform() as f32, s.uniform() as f32]).unwrap();
                let ray = Ray { origin: from, direction: towards.direction, reach: f32::INFINITY };
                // A draw on the very rim may round to the other side.
                let Some(hit) = lamp.hit(&ray) else { continue };
                assert!((hit.t - towards.distance).abs() < 1e-3 && hit.cosine > 0.0);
                assert!((lamp.pdf(hit.t, hit.cosine) / towards.pdf - 1.0).abs() < 1e-3);
            }
            assert!(lamp.sample(Vec3::new(60.0, -40.0, 200.0), [0.5, 0.5]).is_none(), "the back is black");
        }
    }
}
