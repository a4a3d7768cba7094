//! Builds the scene: where the camera stands, which lamps shine, what each piece is made of, where the assembly is.
//!
//! In: a station of the design and an instance of the assembly. Out: [`Camera`], [`Lamp`]s and a [`Scene`], all in the
//! station's frame (mm, rad), which is the assembly's frame when the assembly stands at (0, 0, 0) unturned. Every lamp
//! and every patch of the room's light is a light group of its own, because images are linear in light and only the
//! customer's photo knows the weights. Never draws anything but finishes, never touches a photo.

use super::turning::axes;
use super::{Body, Emitter, Finish, Ground, Lamp, Scene};
use crate::design::model::{CameraSpec, Grooves, Lay, LightShape, LightSpec, Material, Station};
use crate::rng::Stream;
use crate::runtime::camera::{Camera, Vec3, cross, dot, normalise, sub};
use crate::solid::{Solid, TriMesh};
use crate::units::Range;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

/// The component number under which the floor draws its finish: no component of a design has it.
pub const FLOOR: usize = u32::MAX as usize;

/// A panel aimed closer than this to the vertical (sine of the angle) has no horizontal side; x takes its place.
const VERTICAL: f64 = 1e-6;

/// Where a camera stands: distance from its aim (mm), elevation above the horizon and azimuth from +x towards +y (rad).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    pub distance: f64,
    pub elevation: f64,
    pub azimuth: f64,
}

/// One sample of the assembly. All three lists have one entry per component of the design.
#[derive(Debug, Clone)]
pub struct Instance {
    /// `None` for a component that is missing.
    pub solids: Vec<Option<Arc<Solid>>>,
    /// Part to assembly frame.
    pub poses: Vec<Isometry3<f64>>,
    pub finishes: Vec<Finish>,
}

/// The camera of a spec at a place, as designed: without installation error, with the middle of its range of k1.
///
/// The image's x is horizontal and its up is the world's z; straight from above, up is the way the camera faces.
pub fn camera(spec: &CameraSpec, placing: Placed) -> Camera {
    let (sin_e, cos_e) = placing.elevation.sin_cos();
    let (sin_a, cos_a) = placing.azimuth.sin_cos();
    let back = [cos_e * cos_a, cos_e * sin_a, sin_e];
    let forward = back.map(|v| -v);
    let right = [-sin_a, cos_a, 0.0];
    Camera {
        position: [0, 1, 2].map(|i| spec.aim[i] + placing.distance * back[i]),
        axes: [right, cross(forward, right), forward],
        focal: spec.focal.nominal / spec.pitch,
        centre: spec.image.map(|n| f64::from(n) / 2.0),
        k1: (spec.k1.low + spec.k1.high) / 2.0,
        k2: spec.k2,
        size: spec.image,
    }
}

/// The lamps of a station in the order of its lights, a room's patches from the zenith down. Group i is lamp i.
///
/// A ring light rides on the camera, so it is the camera as installed that must be given.
pub fn lamps(station: &Station, camera: &Camera) -> Vec<Lamp> {
    let named = station.lights.iter().flat_map(|light| emitters(light, camera));
    let lights = light_of_group(station);
    let lamp = |(group, (name, emitter))| Lamp { name, emitter, group, colour: station.lights[lights[group]].colour };
    named.enumerate().map(lamp).collect()
}

/// For every light group of [`lamps`], the light of the station (index) it belongs to: whose power and drift it shares.
pub fn light_of_group(station: &Station) -> Vec<usize> {
    let patches = |light: &LightSpec| match light.shape {
        LightShape::Room { patches } => patches.max(1) as usize,
        LightShape::Ring { .. } | LightShape::Panel { .. } => 1,
    };
    station.lights.iter().enumerate().flat_map(|(i, light)| std::iter::repeat_n(i, patches(light))).collect()
}

/// The finish of one component in one image: reflectance and roughness log-uniform in their ranges.
///
/// Each (seed, image, component) has a stream of its own, so a change to one component leaves the others' draws alone.
pub fn finish(material: &Material, seed: u64, image: u64, component: usize) -> Finish {
    let mut stream = Stream::new(seed, &format!("finish of image {image}"), component as u64);
    let reflectance = log_uniform(&material.reflectance, stream.uniform());
    let roughness = log_uniform(&material.roughness, stream.uniform());
    let mottle_seed = stream.bits();
    let edge_break = log_uniform(&material.edge_break, stream.uniform());
    Finish { reflectance, roughness, mottle_seed, edge_break, ..finish_nominal(material) }
}

/// The finish of a material with every number at its nominal value.
pub fn finish_nominal(material: &Material) -> Finish {
    Finish {
        kind: material.kind,
        n: material.n,
        k: material.k,
        tints: material.tints.clone(),
        reflectance: material.reflectance.nominal,
        roughness: material.roughness.nominal,
        edge_break: material.edge_break.nominal,
        mottle: material.mottle,
        mottle_size: material.mottle_size,
        mottle_seed: 0,
        lay: material.lay,
    }
}

/// The whole scene: the instance standing at (x, y, z in mm, turn about z in rad), lamps from [`lamps`], and the floor
/// if the station has one and its finish is given. The floor belongs to the station and stays where it is.
pub fn scene(
    station: &Station,
    instance: &Instance,
    standing: [f64; 4],
    lamps: Vec<Lamp>,
    ground: Option<Finish>,
) -> Scene {
    let floor = station.floor.as_ref().zip(ground);
    let ground = floor.map(|(f, finish)| Ground { z: f.z, finish, origin: Point3::new(0.0, 0.0, f.z) });
    let groups = lamps.iter().map(|lamp| lamp.group + 1).max().unwrap_or(0);
    Scene { bodies: bodies(instance, standing), ground, lamps, groups }
}

/// The bodies of an instance standing at (x, y, z in mm, turn about z in rad), missing components left out.
pub fn bodies(instance: &Instance, standing: [f64; 4]) -> Vec<Body> {
    let stand = stand(standing);
    let present = instance.solids.iter().enumerate().filter_map(|(i, solid)| Some((i, solid.as_ref()?)));
    // Pieces that are one solid are one mesh.
    let mut meshes: HashMap<*const Solid, Arc<TriMesh>> = HashMap::new();
    let body = |(component, solid): (usize, &Arc<Solid>)| Body {
        mesh: meshes.entry(Arc::as_ptr(solid)).or_insert_with(|| Arc::new(solid.mesh.clone())).clone(),
        pose: stand * instance.poses[component],
        finish: instance.finishes[component].clone(),
        component,
        axes: match instance.finishes[component].lay {
            Some(Lay { grooves: Grooves::Circular, .. }) => axes(solid),
            _ => Arc::default(),
        },
    };
    present.map(body).collect()
}

/// Assembly frame to station frame: T(x, y, z) · Rz(rz).
pub fn stand([x, y, z, rz]: [f64; 4]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rz))
}

fn emitters(light: &LightSpec, camera: &Camera) -> Vec<(String, Emitter)> {
    match light.shape {
        LightShape::Ring { inner, outer, setback } => {
            let frame = ring_frame(camera, setback);
            vec![(light.name.clone(), Emitter::Ring { frame, inner, outer })]
        }
        LightShape::Panel { width, height, at, aim } => {
            let frame = panel_frame(at, aim);
            vec![(light.name.clone(), Emitter::Panel { frame, width, height })]
        }
        LightShape::Room { patches } => room(&light.name, patches),
    }
}

/// At the front of the lens, moved back by `setback`, +z along the view.
fn ring_frame(camera: &Camera, setback: f64) -> Isometry3<f64> {
    let forward = camera.axes[2];
    frame([0, 1, 2].map(|i| camera.position[i] - setback * forward[i]), camera.axes)
}

/// At `at`, +z towards `aim`, x horizontal, y upright.
fn panel_frame(at: Vec3, aim: Vec3) -> Isometry3<f64> {
    let z = normalise(sub(aim, at));
    let level = cross([0.0, 0.0, 1.0], z);
    let x = if dot(level, level) < VERTICAL * VERTICAL { [1.0, 0.0, 0.0] } else { normalise(level) };
    frame(at, [x, cross(z, x), z])
}

/// The rigid transform whose frame stands at `origin` with these axes (right-handed, orthonormal).
fn frame(origin: Vec3, axes: [Vec3; 3]) -> Isometry3<f64> {
    let columns = Matrix3::from_columns(&axes.map(Vector3::from));
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns));
    Isometry3::from_parts(Translation3::from(Vector3::from(origin)), rotation)
}

/// The upper hemisphere in `patches` of equal solid angle: one is the whole; more are a cap at the zenith and rings of
/// sectors, every other ring turned by half a sector. Nine are 1 + 4 + 4. A sector's azimuths are low in 0..2π and high
/// above it, beyond 2π where the sector reaches over +x.
fn room(name: &str, patches: u32) -> Vec<(String, Emitter)> {
    if patches <= 1 {
        return vec![(name.to_owned(), sky([0.0, 1.0], [0.0, TAU]))];
    }
    let share = 1.0 / f64::from(patches);
    let mut skies = vec![sky([f64::from(patches - 1) * share, 1.0], [0.0, TAU])];
    let mut below = 1;
    for (ring, sectors) in ring_sizes(patches).into_iter().enumerate() {
        let band = [f64::from(patches - below - sectors) * share, f64::from(patches - below) * share];
        let turn = if ring % 2 == 1 { 0.5 } else { 0.0 };
        let azimuth = |k: u32| (f64::from(k) + turn) * TAU / f64::from(sectors);
        skies.extend((0..sectors).map(|k| sky(band, [azimuth(k), azimuth(k + 1)])));
        below += sectors;
    }
    skies.into_iter().enumerate().map(|(i, sky)| (format!("{name}[{}]", i + 1), sky)).collect()
}

/// Sectors per ring from the cap down. As many rings as squarish patches need; the wide lower rings take the rest.
fn ring_sizes(patches: u32) -> Vec<u32> {
    let side = (TAU / f64::from(patches)).sqrt();
    let cap = (1.0 - 1.0 / f64::from(patches)).acos();
    let rings = (((FRAC_PI_2 - cap) / side).ceil() as u32).clamp(1, patches - 1);
    let (each, rest) = ((patches - 1) / rings, (patches - 1) % rings);
    (0..rings).map(|ring| each + u32::from(ring >= rings - rest)).collect()
}

fn sky([sin_low, sin_high]: [f64; 2], [azimuth_low, azimuth_high]: [f64; 2]) -> Emitter {
    Emitter::Sky { sin_low, sin_high, azimuth_low, azimuth_high }
}

/// The value at `u` in 0..1 of a log-uniform draw; uniform where the range reaches zero.
fn log_uniform(range: &Range, u: f64) -> f64 {
    if range.low <= 0.0 || range.high <= range.low {
        return range.at(u);
    }
    range.low * (range.high / range.low).powf(u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::model::{CameraPlacing, Colour, MaterialKind, PerPhoto, Response};
    use crate::diag::Span;

    fn spec() -> CameraSpec {
        CameraSpec {
            image: [640, 480],
            focal: Range::symmetric(16.0, 0.08),
            pitch: 0.0074,
            aim: [0.0, 0.0, 12.0],
            placing: CameraPlacing::Fixed { distance: 330.0, elevation: 1.08, azimuth: -FRAC_PI_2 },
            k1: Range { low: -0.05, nominal: 0.0, high: 0.0 },
            k2: 0.0,
            vignetting: Range::exactly(0.0),
            full_well: f64::INFINITY,
            depth: 8,
            install_mm: 1.5,
            install_rad: 0.007,
            blur: PerPhoto::exactly(0.5),
            response: Response::Linear,
            span: Span::default(),
        }
    }

    fn station(shapes: Vec<LightShape>) -> Station {
        let light = |shape| LightSpec {
            name: "lamp".into(),
            shape,
            colour: Colour::White,
            power: 1.0,
            drift: 0.15,
            span: Span::default(),
        };
        Station {
            name: "S".into(),
            camera: spec(),
            lights: shapes.into_iter().map(light).collect(),
            floor: None,
            x: Range::symmetric(0.0, 4.0),
            y: Range::symmetric(0.0, 4.0),
            z: Range::exactly(0.0),
            rz: Range::symmetric(0.0, 0.1),
            exposure: PerPhoto::exactly(1.0),
            noise: 0.005,
            span: Span::default(),
        }
    }

    fn material() -> Material {
        Material {
            name: "steel".into(),
            kind: MaterialKind::Metal,
            n: 2.4,
            k: 4.1,
            tints: Vec::new(),
            reflectance: Range { low: 0.4, nominal: 0.6, high: 0.9 },
            roughness: Range { low: 0.05, nominal: 0.1, high: 0.2 },
            edge_break: Range::exactly(0.0),
            mottle: 0.0,
            mottle_size: [1.0; 3],
            lay: None,
            span: Span::default(),
        }
    }

    #[test]
    fn the_camera_is_look_at_with_its_lens_and_sees_its_aim_in_the_middle() {
        let placed = Placed { distance: 330.0, elevation: 62f64.to_radians(), azimuth: -FRAC_PI_2 };
        let built = camera(&spec(), placed);
        let same = Camera::look_at(built.position, [0.0, 0.0, 12.0], 16.0 / 0.0074, [640, 480]);
        assert!(sub(built.position, [0.0, -154.9256, 303.3727]).iter().all(|e| e.abs() < 1e-3));
        for (a, b) in built.axes.iter().zip(same.axes) {
            assert!(sub(*a, b).iter().all(|e| e.abs() < 1e-12));
        }
        assert_eq!(built.k1, -0.025);
        let centre = built.project([0.0, 0.0, 12.0]).unwrap();
        assert!((centre[0] - 320.0).abs() < 1e-9 && (centre[1] - 240.0).abs() < 1e-9);
    }

    #[test]
    fn the_view_turns_smoothly_through_the_zenith() {
        let at = |elevation| camera(&spec(), Placed { distance: 330.0, elevation, azimuth: 0.7 });
        let (near, zenith) = (at(FRAC_PI_2 - 1e-7), at(FRAC_PI_2));
        for (a, b) in near.axes.iter().zip(zenith.axes) {
            assert!(sub(*a, b).iter().all(|e| e.abs() < 1e-6));
        }
    }

    #[test]
    fn a_ring_faces_the_scene_from_behind_the_lens() {
        let camera = camera(&spec(), Placed { distance: 330.0, elevation: 1.08, azimuth: -FRAC_PI_2 });
        let shape = LightShape::Ring { inner: 45.0, outer: 75.0, setback: 20.0 };
        let [lamp] = lamps(&station(vec![shape]), &camera).try_into().unwrap();
        let Emitter::Ring { frame, .. } = lamp.emitter else { panic!("not a ring") };
        let aim = frame.inverse_transform_point(&Point3::new(0.0, 0.0, 12.0));
        assert!((aim - Point3::new(0.0, 0.0, 350.0)).norm() < 1e-9, "{aim}");
    }

    #[test]
    fn a_panel_is_level_and_upright_and_faces_its_aim() {
        let shape = LightShape::Panel { width: 40.0, height: 180.0, at: [190.0, -60.0, 210.0], aim: [0.0, 0.0, 10.0] };
        let camera = camera(&spec(), Placed { distance: 330.0, elevation: 1.08, azimuth: -FRAC_PI_2 });
        let [lamp] = lamps(&station(vec![shape]), &camera).try_into().unwrap();
        let Emitter::Panel { frame, .. } = lamp.emitter else { panic!("not a panel") };
        let local = frame.inverse_transform_point(&Point3::new(0.0, 0.0, 10.0));
        assert!(local.x.abs() < 1e-9 && local.y.abs() < 1e-9 && local.z > 200.0, "{local}");
        assert!((frame.rotation * Vector3::x()).z.abs() < 1e-12);
        assert!((frame.rotation * Vector3::y()).z > 0.0);
        let overhead = panel_frame([0.0, 0.0, 300.0], [0.0, 0.0, 10.0]);
        assert!((overhead.rotation * Vector3::z() + Vector3::z()).norm() < 1e-12);
    }

    #[test]
    fn room_patches_have_equal_solid_angle_and_cover_the_sky_once() {
        let camera = camera(&spec(), Placed { distance: 330.0, elevation: 1.08, azimuth: -FRAC_PI_2 });
        for patches in 1..60 {
            let station = station(vec![LightShape::Room { patches }]);
            let lamps = lamps(&station, &camera);
            assert_eq!(lamps.len(), patches as usize);
            assert_eq!(light_of_group(&station).len(), lamps.len());
            for lamp in &lamps {
                let Emitter::Sky { sin_low, sin_high, azimuth_low, azimuth_high } = lamp.emitter else { panic!() };
                let solid_angle = (sin_high - sin_low) * (azimuth_high - azimuth_low);
                assert!((solid_angle - TAU / f64::from(patches)).abs() < 1e-12);
                assert!(sin_low > -1e-12 && (0.0..TAU).contains(&azimuth_low));
            }
            for (sine, azimuth) in [(0.01, 0.1), (0.3, 3.0), (0.5, 6.2), (0.7, 0.01), (0.95, 4.0)] {
                assert_eq!(lamps.iter().filter(|l| shines_from(l, sine, azimuth)).count(), 1, "{patches}");
            }
        }
        assert_eq!(ring_sizes(9), [4, 4]);
    }

    fn shines_from(lamp: &Lamp, sine: f64, azimuth: f64) -> bool {
        let Emitter::Sky { sin_low, sin_high, azimuth_low, azimuth_high } = lamp.emitter else { return false };
        let around = azimuth_low + (azimuth - azimuth_low).rem_euclid(TAU);
        (sin_low..sin_high).contains(&sine) && around < azimuth_high
    }

    #[test]
    fn groups_are_numbered_through_and_named() {
        let shapes = vec![LightShape::Ring { inner: 1.0, outer: 2.0, setback: 0.0 }, LightShape::Room { patches: 3 }];
        let station = station(shapes);
        let camera = camera(&spec(), Placed { distance: 330.0, elevation: 1.08, azimuth: -FRAC_PI_2 });
        let lamps = lamps(&station, &camera);
        let names: Vec<&str> = lamps.iter().map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["lamp", "lamp[1]", "lamp[2]", "lamp[3]"]);
        assert!(lamps.iter().enumerate().all(|(i, l)| l.group == i));
        assert_eq!(light_of_group(&station), [0, 1, 1, 1]);
    }

    #[test]
    fn finishes_are_log_uniform_and_keyed_by_image_and_component() {
        let steel = material();
        let draws: Vec<Finish> = (0..2000).map(|i| finish(&steel, 1, i, 3)).collect();
        assert!(draws.iter().all(|f| (0.4..0.9).contains(&f.reflectance) && (0.05..0.2).contains(&f.roughness)));
        let mean = draws.iter().map(|f| f.roughness.ln()).sum::<f64>() / 2000.0;
        assert!((mean - 0.1f64.ln()).abs() < 0.03, "{mean}");
        assert_eq!(draws[7], finish(&steel, 1, 7, 3));
        assert_ne!(draws[7], finish(&steel, 1, 7, 4));
        assert_ne!(draws[7].mottle_seed, draws[8].mottle_seed);
        assert_eq!(finish_nominal(&steel).roughness, 0.1);
    }

    #[test]
    fn standing_turns_before_it_moves() {
        let moved = stand([10.0, 0.0, 0.0, FRAC_PI_2]) * Point3::new(1.0, 0.0, 5.0);
        assert!((moved - Point3::new(10.0, 1.0, 5.0)).norm() < 1e-12);
    }
}
