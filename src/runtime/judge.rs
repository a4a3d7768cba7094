//! A calibrated model, ready to judge: densities of every node under every hypothesis.
//!
//! In: a model, the lamps' weights and the sensor's noise. Out: log-likelihoods of a photo's nodes. Never decides.

use super::camera::Camera;
use super::density::{Density, Floor, mean_of};
use super::grid::Grid;
use super::light::{Light, LightEvidence};
use super::look::Look;
use super::model::{Image, Model, Node};
use super::parts::{Listener, Part, nobody};
use super::pose::Pose;
use super::rise::Lift;
use super::settle::Expected;
use super::sight::{Glance, Reduced, Sight};
use super::strange::{self, Unlikeness};
use super::window::{Frame, Stencil, Window, mask_of};

/// Coefficients overlap, and what a model gets wrong it gets wrong along whole edges: a node's count for this many independent
/// ones beside the evidence of its place. Measured as the scatter of good photos' log-likelihoods.
pub const INDEPENDENT: f64 = 100.0;
/// Photo values from here on count as clipped.
pub const CLIP: f32 = 0.98;

/// A node's geometry and training images, independent of the light.
pub struct NodeImages {
    pub window: Window,
    pub stencil: Stencil,
    glance: Option<Glance>,
    /// Pixels of the window that no fault of the component changes.
    surroundings: Vec<bool>,
    /// Standard deviation of the node's shift (node px).
    spread: [f64; 2],
    /// Per hypothesis, per draw, one image per lamp; the disturbed states come after the node's own hypotheses.
    hypotheses: Vec<Vec<Vec<Grid>>>,
    /// Number of own hypotheses.
    pub own: usize,
}

impl NodeImages {
    /// `levelled` says that the node is judged by its contrast with its surroundings, see [`Light::level`]. `None` when its plane is
    /// behind the camera.
    pub fn new(node: &Node, nominal: &Camera, home: &Pose, lamps: usize, levelled: bool) -> Option<NodeImages> {
        let grid = |image: &Image| {
            let step = node.steps[image.lamp as usize] as f32;
            let values = image.rows.iter().flat_map(|row| &row.0).map(|&v| f32::from(v) * step).collect();
            Grid::new(node.size[0] as usize, node.size[1] as usize, values)
        };
        let mask = mask_of(node);
        let draws = |images: &Vec<Image>| images.chunks(lamps).map(|draw| draw.iter().map(grid).collect()).collect();
        let own = node.hypotheses.iter().map(|h| &h.images);
        let stencil = Stencil::new(&mask, node.levels);
        let surroundings = surroundings(&mask);
        let mut wanted = stencil.covered(node.size.map(|s| s as usize));
        if levelled {
            wanted.iter_mut().zip(&surroundings).for_each(|(wanted, outside)| *wanted |= outside);
        }
        let window = Window::new(Frame::of(node), nominal, home)?.masked(wanted);
        Some(NodeImages {
            glance: Glance::new(&window, &stencil),
            window,
            stencil,
            surroundings,
            spread: node.spread.map(|s| s / f64::from(node.factor)),
            hypotheses: own.chain(node.disturbed.iter().map(|d| &d.images)).map(draws).collect(),
            own: node.hypotheses.len(),
        })
    }

    /// Mean coefficients of one hypothesis in each lamp's own image.
    pub fn lamp_means(&self, hypothesis: usize) -> Vec<Vec<f32>> {
        let draws = &self.hypotheses[hypothesis];
        let lamps = draws[0].len();
        let mean = |lamp: usize| {
            let mut sum = vec![0.0f32; draws[0][lamp].values.len()];
            for draw in draws {
                sum.iter_mut().zip(&draw[lamp].values).for_each(|(s, v)| *s += v);
            }
            let share = 1.0 / draws.len() as f32;
            let grid = &draws[0][lamp];
            let mean = Grid::new(grid.width, grid.height, sum.into_iter().map(|s| s * share).collect());
            self.stencil.coefficients(&mean)
        };
        (0..lamps).map(mean).collect()
    }

    /// Coefficients of every draw of a hypothesis under the given light.
    fn lit(&self, hypothesis: usize, light: &Light) -> Vec<Vec<f32>> {
        let draws = self.hypotheses[hypothesis].iter().enumerate();
        let seen = draws.flat_map(|(i, images)| light.seen(images, i, &self.surroundings));
        seen.map(|image| self.stencil.coefficients(&image)).collect()
    }

    /// The densities of all hypotheses and then of all disturbed states under the given light.
    ///
    /// `references` are windows of correct assemblies as [`NodeImages::reference`] cuts them: what they have in common with
    /// no render is expected of every photo of the station, wherever a hypothesis looks like the good state. Also how unlike
    /// the rendered good state they are.
    pub fn densities(&self, light: &Light, noise: f64, references: &[Grid]) -> (Vec<Density>, Vec<Unlikeness>) {
        let mut densities = self.rendered(self.hypotheses.len(), light, noise);
        let level = |window: &Grid| self.stencil.coefficients(&light.level(window.clone(), &self.surroundings));
        let levelled: Vec<Vec<f32>> = references.iter().map(level).collect();
        let unlike = levelled.iter().map(|z| self.unlike(&densities[0].surprise(z))).collect();
        let gaps: Vec<Vec<f32>> = levelled.iter().map(|z| densities[0].gap(z)).collect();
        if !gaps.is_empty() {
            let shares: Vec<Vec<f32>> = densities.iter().map(|d| d.shared(&densities[0])).collect();
            densities.iter_mut().zip(&shares).for_each(|(d, share)| d.adapt(&gaps, share));
        }
        (densities, unlike)
    }

    /// How unlike the good state a correct assembly is, given its surprise: glints wander, so a square may show what those
    /// beside it showed.
    fn unlike(&self, surprise: &[f32]) -> Unlikeness {
        strange::unlikeness(&self.stencil.widened(&self.stencil.square_means(surprise)))
    }

    /// The densities of the first `count` hypotheses as renders alone make them.
    fn rendered(&self, count: usize, light: &Light, noise: f64) -> Vec<Density> {
        let noise = noise / f64::from(self.window.frame.factor);
        let good = self.lit(0, light);
        let searched = self.glance.as_ref().map(|g| g.cells.clone());
        let floor = Floor::new(&self.stencil.levels, noise, &mean_of(&good), searched);
        let density = |hypothesis: usize| {
            let samples = if hypothesis == 0 { good.clone() } else { self.lit(hypothesis, light) };
            Density::fit(&samples, self.lamp_columns(hypothesis, light), &floor)
        };
        (0..count).map(density).collect()
    }

    /// What a drift of the light does to a hypothesis, one column per drift: images are linear in light.
    fn lamp_columns(&self, hypothesis: usize, light: &Light) -> Vec<Vec<f32>> {
        let Light::Steady { drifts, .. } = light else { return Vec::new() };
        let means = self.lamp_means(hypothesis);
        let column = |drift: &Vec<f64>| {
            let mut sum = vec![0.0f32; means[0].len()];
            for (mean, &scale) in means.iter().zip(drift) {
                sum.iter_mut().zip(mean).for_each(|(s, v)| *s += v * scale as f32);
            }
            sum
        };
        drifts.iter().map(column).collect()
    }
}

/// What a node's window holds in one photo.
pub struct Evidence {
    /// Log-likelihood per hypothesis, each at its own best shift.
    pub log_likelihoods: Vec<f64>,
    /// Share of the window inside the photo.
    pub inside: f64,
    /// Best shift under the good state (node px).
    pub shift: [f64; 2],
    /// How high the part appears to stand; `None` before calibration, and where that cannot be told.
    pub lift: Option<Lift>,
    /// By how much the good state fits better beyond the reach of the search (log-likelihood).
    pub beyond: f64,
    /// How far from the first density the node is, square by square: mean of [`Density::surprise`].
    pub unlike: Unlikeness,
}

/// What lies outside a mask; everything where nothing does.
fn surroundings(mask: &[Vec<bool>]) -> Vec<bool> {
    let outside: Vec<bool> = mask.iter().flatten().map(|m| !m).collect();
    if outside.contains(&true) { outside } else { vec![true; outside.len()] }
}

/// A photo reduced by every factor the nodes use.
pub struct Pyramid(Vec<(u32, Reduced)>);

impl Pyramid {
    pub fn new(light: &Grid, factors: impl Iterator<Item = u32>) -> Pyramid {
        let mut sorted: Vec<u32> = factors.collect();
        sorted.sort_unstable();
        sorted.dedup();
        Pyramid(sorted.into_iter().map(|f| (f, Reduced::new(light.reduced(f as usize)))).collect())
    }

    /// # Panics
    /// When the pyramid was not made for this factor.
    pub fn at(&self, factor: u32) -> &Reduced {
        &self.0.iter().find(|(f, _)| *f == factor).expect("a factor the pyramid was made for").1
    }
}

impl NodeImages {
    /// The node in a photo at a pose, ready to be weighed under some densities (at least one).
    pub fn look<'a>(
        &'a self,
        densities: &'a [Density],
        light: &'a Light,
        reduced: &'a Reduced,
        camera: &Camera,
        pose: &Pose,
        listener: &'a Listener<'a>,
    ) -> Look<'a> {
        listener(Part::Windows);
        let node = (&self.window, &self.stencil, self.glance.as_ref());
        let sight = Sight::new(node, (light, &self.surroundings), reduced, (camera, pose));
        Look::new(densities, self.spread, sight, listener)
    }

    /// Evidence for each density of a look; each re-aligns by itself within the local search. The first one's place is known as
    /// well as `expected` says.
    pub fn evidence(&self, look: &Look, expected: Option<&Expected>) -> Evidence {
        let weight = (self.stencil.len() as f64 / INDEPENDENT).max(1.0);
        let spread = self.spread.map(|s| s * f64::from(self.window.frame.factor));
        let at = expected.map_or([0.0; 2], |e| e.at);
        let free = Expected { at, spread };
        let good = expected.map_or_else(|| look.likeliest(0, &free, 1.0), |e| look.likeliest(0, e, weight));
        let others = (1..look.densities.len()).map(|density| look.likeliest(density, &free, 1.0).0);
        let (shift, coefficients) = (look.shift(good.1), look.coefficients(good.1));
        (look.listener)(Part::Unknown);
        let unlike = strange::unlikeness(&self.stencil.square_means(&look.densities[0].surprise(coefficients)));
        let log_likelihoods = std::iter::once(good.0).chain(others).collect();
        Evidence { log_likelihoods, inside: look.inside, shift, lift: None, beyond: look.beyond(), unlike }
    }

    /// The shift (node px) at which a density fits best.
    pub fn best_shift(
        &self,
        density: &Density,
        light: &Light,
        reduced: &Reduced,
        camera: &Camera,
        pose: &Pose,
    ) -> [f64; 2] {
        self.look(std::slice::from_ref(density), light, reduced, camera, pose, &nobody).best_shift()
    }

    /// The node's window in a photo of a correct assembly at its most likely shift, and the shift in px of the photo.
    pub fn reference(
        &self,
        light: &Light,
        noise: f64,
        reduced: &Reduced,
        camera: &Camera,
        pose: &Pose,
    ) -> (Grid, [f64; 2]) {
        let good = &self.rendered(1, light, noise)[0];
        let look = self.look(std::slice::from_ref(good), light, reduced, camera, pose, &nobody);
        let window = self.window.cut(&reduced.grid, &self.window.place(camera, pose), look.best_shift());
        (window, look.measured_shift().map(|v| v * f64::from(self.window.frame.factor)))
    }

    /// The node's coefficients at a pose, and which of them touch clipped pixels.
    pub fn observe(&self, reduced: &Reduced, camera: &Camera, pose: &Pose) -> (Vec<f32>, Vec<bool>) {
        let placed = self.window.place(camera, pose);
        let image = self.window.cut(&reduced.grid, &placed, [0.0, 0.0]);
        (self.stencil.coefficients(&image), self.stencil.touching(&image, CLIP))
    }
}

/// Everything light-independent of a model.
pub struct Prepared {
    pub nodes: Vec<NodeImages>,
    pub home: Pose,
}

impl Prepared {
    /// `None` when a node cannot be seen by the model's own camera.
    pub fn new(model: &Model) -> Option<Prepared> {
        let home = Pose::home(&model.station);
        let lamps = &model.station.lamps;
        let levelled = Light::new(&vec![1.0; lamps.len()], lamps).is_open();
        let node = |n: &Node| NodeImages::new(n, &model.station.camera, &home, lamps.len(), levelled);
        Some(Prepared { nodes: model.nodes.iter().map(node).collect::<Option<_>>()?, home })
    }

    pub fn pyramid(&self, light: &Grid) -> Pyramid {
        Pyramid::new(light, self.nodes.iter().map(|n| n.window.frame.factor))
    }

    /// The nodes' evidence about the light at a pose, each under the hypothesis named.
    pub fn light_evidence(
        &self,
        pyramid: &Pyramid,
        camera: &Camera,
        pose: &Pose,
        hypotheses: &[usize],
    ) -> Vec<LightEvidence> {
        let of = |(node, &hypothesis): (&NodeImages, &usize)| {
            let (z, clipped) = node.observe(pyramid.at(node.window.frame.factor), camera, pose);
            LightEvidence { z, clipped, lamps: node.lamp_means(hypothesis) }
        };
        self.nodes.iter().zip(hypotheses).map(of).collect()
    }
}
