//! Paths of light from the camera back to the lamps.
//!
//! In: a [`World`] and a camera ray. Out: radiance per light group, all groups from the same path. At every surface one ray
//! goes to each lamp and one to the sky; the path goes on by sampling the surface; what both ways can find is weighted
//! by the power heuristic (Veach 1997). Never knows a pixel.

use super::Settings;
use super::accel::Ray;
use super::bsdf::{Bsdf, Scatter};
use super::lamp::{LampHit, Towards};
use super::vector::{Frame, Vec3};
use super::world::{Encounter, Spot, World};
use sobol_burley::sample_4d;

/// Paths whose throughput falls below this end: what they could still bring is below 1/10 of a grey level.
const LEAST_THROUGHPUT: f32 = 2e-4;
/// A shadow ray that could bring less than this share of the lamp's white is traced with proportional probability and
/// counted for more, so that the mean stays exact.
const ROULETTE_SHARE: f32 = 0.01;

/// Which way of finding light counts: both in earnest, one alone as a test of the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Strategy {
    Both,
    #[cfg(test)]
    LampsOnly,
    #[cfg(test)]
    SurfacesOnly,
}

impl Strategy {
    /// Weight of a direction drawn towards a lamp with density `lamp`, where the surface would draw it with `surface`.
    fn of_lamp(self, lamp: f32, surface: f32) -> f32 {
        match self {
            Strategy::Both => power_heuristic(lamp, surface),
            #[cfg(test)]
            Strategy::LampsOnly => 1.0,
            #[cfg(test)]
            Strategy::SurfacesOnly => 0.0,
        }
    }

    /// Weight of a direction drawn from the surface.
    fn of_surface(self, surface: f32, lamp: f32) -> f32 {
        match self {
            Strategy::Both => power_heuristic(surface, lamp),
            #[cfg(test)]
            Strategy::LampsOnly => 0.0,
            #[cfg(test)]
            Strategy::SurfacesOnly => 1.0,
        }
    }
}

fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

/// Follows paths through a world.
pub(super) struct Tracer<'a> {
    pub world: &'a World,
    segments: u32,
    strategy: Strategy,
    secondary_roughness: f32,
    /// White of every lamp, then of the sky if there is one: the unit of the clamp and of the roulette. The sources of light
    /// are numbered in this order.
    whites: Vec<f32>,
    clamp: f32,
}

/// A path on its way.
struct Walk {
    ray: Ray,
    throughput: f32,
    /// Density with which the surface drew the direction; `None` for the camera's ray.
    pdf: Option<f32>,
}

/// The random numbers of one path: sets of four, each well spread over the samples of the pixel.
pub(super) struct Dice {
    /// Which sample of the pixel, of how many.
    pub index: u32,
    pub samples: u32,
    /// Names the pixel.
    pub key: u32,
}

impl Dice {
    /// Two rolls of one set for two draws of the same kind: over the samples each is well spread, and both together.
    pub fn pair(&self, set: u32) -> [[f32; 4]; 2] {
        let seed = self.seed(set);
        [sample_4d(self.index, 0, seed), sample_4d(self.index + self.samples, 0, seed)]
    }

    /// Set number `set`: Owen-scrambled Sobol points (Burley 2020), one scramble per pixel and set.
    pub fn roll(&self, set: u32) -> [f32; 4] {
        sample_4d(self.index, 0, self.seed(set))
    }

    fn seed(&self, set: u32) -> u32 {
        let mut seed = self.key ^ set.wrapping_mul(0x9e37_79b9);
        seed = (seed ^ (seed >> 16)).wrapping_mul(0x85eb_ca6b);
        seed = (seed ^ (seed >> 13)).wrapping_mul(0xc2b2_ae35);
        seed ^ (seed >> 16)
    }
}

impl<'a> Tracer<'a> {
    pub fn new(world: &'a World, settings: &Settings, strategy: Strategy) -> Tracer<'a> {
        let sky = (!world.sky.is_empty()).then(|| world.sky.white());
        let whites = world.lamps.iter().map(|l| l.white(world.middle)).chain(sky).collect();
        Tracer {
            world,
            segments: settings.segments.max(1),
            strategy,
            secondary_roughness: settings.secondary_roughness as f32,
            whites,
            clamp: settings.clamp.map_or(f32::INFINITY, |c| c as f32),
        }
    }

    /// Adds the light that arrives along a camera ray (unit direction) to `light`, one entry per group.
    pub fn trace(&self, ray: Ray, dice: &Dice, light: &mut [f32]) {
        let mut walk = Walk { ray, throughput: 1.0, pdf: None };
        for depth in 0..self.segments - 1 {
            match self.world.closest(&walk.ray) {
                Encounter::Surface(spot) => match self.scatter(&walk, spot, depth, dice, light) {
                    Some(next) => walk = next,
                    None => return,
                },
                Encounter::Lamp { index, hit } => return self.reach_lamp(&walk, index, hit, depth, light),
                Encounter::Nothing => return self.reach_sky(&walk, depth, light),
                Encounter::Inside => return,
            }
        }
        self.finish(&walk, light);
    }

    /// The last segment: only a lamp at its end matters, so most need no ray.
    fn finish(&self, walk: &Walk, light: &mut [f32]) {
        let (depth, things) = (self.segments - 1, |ray: &Ray| self.world.occluded_by_things(ray));
        match self.world.lamp_ahead(&walk.ray) {
            Some((index, hit)) if hit.cosine > 0.0 && !things(&Ray { reach: hit.t, ..walk.ray }) => {
                self.reach_lamp(walk, index, hit, depth, light);
            }
            None if self.world.sky.covers(walk.ray.direction) && !things(&walk.ray) => {
                self.reach_sky(walk, depth, light);
            }
            _ => {}
        }
    }

    /// Light from all lamps at a surface, and the way on.
    fn scatter(&self, walk: &Walk, mut spot: Spot, depth: u32, dice: &Dice, light: &mut [f32]) -> Option<Walk> {
        if depth > 0 {
            spot.bsdf = roughened(spot.bsdf, self.secondary_roughness);
        }
        let vertex = Vertex::new(spot, walk, depth);
        let set = 1 + depth * self.sets_per_vertex();
        let [[u, v, lobe, roulette], for_sky] = dice.pair(set);
        self.gather_lamps(&vertex, roulette, |pair| dice.roll(set + 1 + pair), light);
        self.gather_sky(&vertex, for_sky, light);
        let (local, scatter) = vertex.spot.bsdf.sample(vertex.wo, [u, v, lobe])?;
        let direction = vertex.frame.to_world(local);
        let throughput = walk.throughput * scatter.value / scatter.pdf;
        let goes_on = vertex.spot.geometric.dot(&direction) > 0.0 && throughput > LEAST_THROUGHPUT;
        let ray = Ray { origin: vertex.origin, direction, reach: f32::INFINITY };
        goes_on.then_some(Walk { ray, throughput, pdf: Some(scatter.pdf) })
    }

    /// One set for the surface and the sky, and one for every two lamps.
    fn sets_per_vertex(&self) -> u32 {
        1 + (self.world.lamps.len() as u32).div_ceil(2)
    }

    /// Light that comes straight from each lamp.
    fn gather_lamps(&self, vertex: &Vertex, roulette: f32, roll: impl Fn(u32) -> [f32; 4], light: &mut [f32]) {
        let mut numbers = [0.0; 4];
        for (source, lamp) in self.world.lamps.iter().enumerate() {
            if source % 2 == 0 {
                numbers = roll(source as u32 / 2);
            }
            let u = if source % 2 == 0 { [numbers[0], numbers[1]] } else { [numbers[2], numbers[3]] };
            let Some(towards) = lamp.sample(vertex.origin, u) else { continue };
            let scatter = vertex.spot.bsdf.evaluate(vertex.wo, vertex.frame.to_local(towards.direction));
            self.straight(vertex, source, &towards, scatter, roulette, light);
        }
    }

    /// Light that comes straight from the sky: one direction for all its patches, drawn as the surface draws, because the
    /// sky is wide and the surface choosy.
    fn gather_sky(&self, vertex: &Vertex, [u, v, lobe, roulette]: [f32; 4], light: &mut [f32]) {
        if self.world.sky.is_empty() {
            return;
        }
        if let Some((local, scatter)) = vertex.spot.bsdf.sample(vertex.wo, [u, v, lobe]) {
            let direction = vertex.frame.to_world(local);
            if self.world.sky.covers(direction) {
                let towards = Towards { direction, distance: f32::INFINITY, pdf: scatter.pdf };
                self.straight(vertex, self.world.lamps.len(), &towards, scatter, roulette, light);
            }
        }
    }

    /// Adds what a direction drawn towards a source brings, unless something is in the way.
    fn straight(
        &self,
        vertex: &Vertex,
        source: usize,
        towards: &Towards,
        scatter: Scatter,
        roulette: f32,
        light: &mut [f32],
    ) {
        if vertex.spot.geometric.dot(&towards.direction) <= 0.0 {
            return;
        }
        let weight = self.strategy.of_lamp(towards.pdf, scatter.pdf);
        let amount = vertex.throughput * scatter.value / towards.pdf * weight;
        let held = if vertex.depth > 0 { amount.min(self.clamp * self.whites[source]) } else { amount };
        let amount = self.survivor(held, source, roulette);
        if amount > 0.0 && !self.world.shadowed(vertex.origin, towards.direction, towards.distance) {
            self.credit(source, towards.direction, amount, light);
        }
    }

    /// The amount after the roulette: 0, or as it was, or raised to the least amount that is worth a ray.
    fn survivor(&self, amount: f32, source: usize, roulette: f32) -> f32 {
        let least = ROULETTE_SHARE * self.whites[source];
        if amount >= least {
            amount
        } else if roulette * least < amount {
            least
        } else {
            0.0
        }
    }

    /// A path that ends on a lamp after `depth` surfaces.
    fn reach_lamp(&self, walk: &Walk, source: usize, hit: LampHit, depth: u32, light: &mut [f32]) {
        if hit.cosine > 0.0 {
            let pdf = self.world.lamps[source].pdf(hit.t, hit.cosine);
            self.credit(source, walk.ray.direction, self.arriving(walk, source, pdf, depth), light);
        }
    }

    /// A path that leaves the scene after `depth` surfaces.
    fn reach_sky(&self, walk: &Walk, depth: u32, light: &mut [f32]) {
        // The direction towards the sky is drawn with the surface's own density.
        let (source, pdf) = (self.world.lamps.len(), walk.pdf.unwrap_or(0.0));
        if self.world.sky.covers(walk.ray.direction) {
            self.credit(source, walk.ray.direction, self.arriving(walk, source, pdf, depth), light);
        }
    }

    /// What a path brings that found a source by itself, where the source would draw its last direction with density `pdf`.
    fn arriving(&self, walk: &Walk, source: usize, pdf: f32, depth: u32) -> f32 {
        let weight = walk.pdf.map_or(1.0, |own| self.strategy.of_surface(own, pdf));
        let amount = walk.throughput * weight;
        if depth > 1 { amount.min(self.clamp * self.whites[source]) } else { amount }
    }

    fn credit(&self, source: usize, direction: Vec3, amount: f32, light: &mut [f32]) {
        match self.world.lamps.get(source) {
            Some(lamp) => add(light, lamp.group, amount),
            None => self.world.sky.groups(direction).for_each(|group| add(light, group, amount)),
        }
    }
}

/// A lamp whose group is out of range lights nothing.
fn add(light: &mut [f32], group: usize, amount: f32) {
    if let Some(sum) = light.get_mut(group) {
        *sum += amount;
    }
}

/// A surface point on a path.
struct Vertex {
    spot: Spot,
    frame: Frame,
    /// Towards the viewer, in `frame`.
    wo: Vec3,
    /// Where rays start.
    origin: Vec3,
    throughput: f32,
    /// Surfaces met before this one.
    depth: u32,
}

impl Vertex {
    fn new(spot: Spot, walk: &Walk, depth: u32) -> Vertex {
        let frame = match spot.grooves {
            Some(along) => Frame::along(spot.shading, along),
            None => Frame::around(spot.shading),
        };
        let wo = frame.to_local(-walk.ray.direction);
        Vertex { origin: spot.lifted(), spot, frame, wo, throughput: walk.throughput, depth }
    }
}

/// The same surface with its GGX alpha at least `least`: what is seen in a mirror is seen less sharply.
fn roughened(bsdf: Bsdf, least: f32) -> Bsdf {
    match bsdf {
        Bsdf::Metal { alpha, n, k, scale } => Bsdf::Metal { alpha: alpha.map(|a| a.max(least)), n, k, scale },
        Bsdf::Plastic { albedo, alpha } => Bsdf::Plastic { albedo, alpha: alpha.max(least) },
        Bsdf::Matt { .. } => bsdf,
    }
}
