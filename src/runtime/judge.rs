//! A calibrated model, ready to judge: densities of every node under every hypothesis.
//!
//! In: a model, the lamps' weights and the sensor's noise. Out: log-likelihoods of a photo's nodes. Never decides.

use super::camera::Camera;
use super::density::{Density, Floor, mean_of};
use super::grid::Grid;
use super::light::{Light, LightEvidence};
use super::model::{Image, Model, Node};
use super::pose::Pose;
use super::settle::Expected;
use super::window::{Frame, Placed, Stencil, Window, mask_of};

/// Local search: shifts of up to this many standard deviations of the node's place, and at most so many px of the photo,
/// each way. More would let a part that stands too high pass as one that stands a little further back.
const REACH: f64 = 2.0;
const LARGEST_REACH: f64 = 12.0;
/// Shifts that Gaussian noise likes best, among which Student's decides.
const SHORT_LIST: usize = 4;
/// Coefficients overlap, and what a model gets wrong it gets wrong along whole edges: a node's count for this many independent
/// ones beside the evidence of its place. Measured as the scatter of good photos' log-likelihoods.
const INDEPENDENT: f64 = 100.0;
/// Photo values from here on count as clipped.
pub const CLIP: f32 = 0.98;

/// A node's geometry and training images, independent of the light.
pub struct NodeImages {
    pub window: Window,
    pub stencil: Stencil,
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
    /// `None` when the node's plane is behind the camera.
    pub fn new(node: &Node, nominal: &Camera, home: &Pose, lamps: usize) -> Option<NodeImages> {
        let grid = |image: &Image| {
            let step = node.steps[image.lamp as usize] as f32;
            let values = image.rows.iter().flat_map(|row| &row.0).map(|&v| f32::from(v) * step).collect();
            Grid::new(node.size[0] as usize, node.size[1] as usize, values)
        };
        let mask = mask_of(node);
        let draws = |images: &Vec<Image>| images.chunks(lamps).map(|draw| draw.iter().map(grid).collect()).collect();
        let own = node.hypotheses.iter().map(|h| &h.images);
        Some(NodeImages {
            window: Window::new(Frame::of(node), nominal, home)?,
            stencil: Stencil::new(&mask, node.levels),
            surroundings: surroundings(&mask),
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
    /// no render is expected of every photo of the station, wherever a hypothesis looks like the good state.
    pub fn densities(&self, light: &Light, noise: f64, references: &[Grid]) -> Vec<Density> {
        let mut densities = self.rendered(light, noise);
        let level = |window: &Grid| self.stencil.coefficients(&light.level(window.clone(), &self.surroundings));
        let gaps: Vec<Vec<f32>> = references.iter().map(|window| densities[0].gap(&level(window))).collect();
        if !gaps.is_empty() {
            let shares: Vec<Vec<f32>> = densities.iter().map(|d| d.shared(&densities[0])).collect();
            densities.iter_mut().zip(&shares).for_each(|(d, share)| d.adapt(&gaps, share));
        }
        densities
    }

    /// The densities as renders alone make them.
    fn rendered(&self, light: &Light, noise: f64) -> Vec<Density> {
        let noise = noise / f64::from(self.window.frame.factor);
        let good = self.lit(0, light);
        let floor = Floor::new(&self.stencil.levels, noise, &mean_of(&good));
        let density = |hypothesis: usize| {
            let samples = if hypothesis == 0 { good.clone() } else { self.lit(hypothesis, light) };
            Density::fit(&samples, self.lamp_columns(hypothesis, light), &floor)
        };
        (0..self.hypotheses.len()).map(density).collect()
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
    /// How far from the first density the node is where it is farthest: mean of [`Density::surprise`] in a square.
    pub strangeness: f64,
}

/// A node's coefficients at one shift (node px), with the shift's log prior.
pub struct Shifted {
    prior: f64,
    shift: [f64; 2],
    coefficients: Vec<f32>,
}

/// A node in a photo, at every shift of the local search.
pub struct Look {
    shifted: Vec<Shifted>,
    inside: f64,
}

/// Log-likelihood and index of the shift at which a density fits best.
fn likeliest(density: &Density, shifted: &[Shifted], prior: &dyn Fn(&Shifted) -> f64) -> (f64, usize) {
    let mut quick: Vec<(f64, usize)> =
        shifted.iter().enumerate().map(|(i, s)| (density.gaussian(&s.coefficients) + prior(s), i)).collect();
    quick.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let robust = |&(_, i): &(f64, usize)| (density.student(&shifted[i].coefficients) + prior(&shifted[i]), i);
    let listed = quick.iter().take(SHORT_LIST).map(robust);
    listed.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))).unwrap_or((f64::NEG_INFINITY, 0))
}

/// Shifts along one axis (node px) for a standard deviation in node px: half px of the photo where they are few, half
/// px of the node where they are many.
fn steps(spread: f64, factor: u32) -> Vec<f64> {
    /// A reach of more px than this is searched coarsely.
    const FEW: f64 = 2.0;
    const FINE_STEP: f64 = 0.5;
    let px = f64::from(factor);
    let reach = (REACH * spread * px).min(LARGEST_REACH).round().max(FEW);
    let step = if reach <= FEW { FINE_STEP } else { (px / 2.0).max(1.0) };
    let count = (reach / step).round() as i32;
    (-count..=count).map(|i| f64::from(i) * step / px).collect()
}

/// What lies outside a mask; everything where nothing does.
fn surroundings(mask: &[Vec<bool>]) -> Vec<bool> {
    let outside: Vec<bool> = mask.iter().flatten().map(|m| !m).collect();
    if outside.contains(&true) { outside } else { vec![true; outside.len()] }
}

/// A photo reduced by every factor the nodes use.
pub struct Pyramid(Vec<(u32, Grid)>);

impl Pyramid {
    pub fn new(light: &Grid, factors: impl Iterator<Item = u32>) -> Pyramid {
        let mut sorted: Vec<u32> = factors.collect();
        sorted.sort_unstable();
        sorted.dedup();
        Pyramid(sorted.into_iter().map(|f| (f, light.reduced(f as usize))).collect())
    }

    /// # Panics
    /// When the pyramid was not made for this factor.
    pub fn at(&self, factor: u32) -> &Grid {
        &self.0.iter().find(|(f, _)| *f == factor).expect("a factor the pyramid was made for").1
    }
}

impl NodeImages {
    /// The node in a photo at a pose.
    pub fn look(&self, light: &Light, reduced: &Grid, camera: &Camera, pose: &Pose) -> Look {
        let placed = self.window.place(camera, pose);
        let inside = self.window.cut(reduced, &placed, [0.0, 0.0]).1;
        Look { shifted: self.shifted(reduced, &placed, light), inside }
    }

    /// The shift (px of the photo) at which a density fits best.
    pub fn shift(&self, density: &Density, look: &Look) -> [f64; 2] {
        let factor = f64::from(self.window.frame.factor);
        look.shifted[likeliest(density, &look.shifted, &|s| s.prior).1].shift.map(|v| v * factor)
    }

    /// Evidence for each of some densities (at least one); each re-aligns by itself within the local search. The first one's
    /// place is known as well as `expected` says.
    pub fn evidence(&self, densities: &[Density], look: &Look, expected: Option<&Expected>) -> Evidence {
        let factor = f64::from(self.window.frame.factor);
        let weight = (self.stencil.len() as f64 / INDEPENDENT).max(1.0);
        let prior = |s: &Shifted, at: [f64; 2], spread: [f64; 2]| -> f64 {
            (0..2).map(|k| -0.5 * ((s.shift[k] * factor - at[k]) / spread[k]).powi(2)).sum()
        };
        let free =
            |s: &Shifted| expected.map_or(s.prior, |e| prior(s, e.at, self.spread.map(|spread| spread * factor)));
        let held = |s: &Shifted| expected.map_or(s.prior, |e| weight * prior(s, e.at, e.spread));
        let (first, others) = densities.split_first().expect("a node has a good state");
        let good = likeliest(first, &look.shifted, &held);
        let others = others.iter().map(|density| likeliest(density, &look.shifted, &free).0);
        let Shifted { shift, ref coefficients, .. } = look.shifted[good.1];
        let strangeness = self.stencil.highest_mean(&first.surprise(coefficients)).unwrap_or(0.0);
        let log_likelihoods = std::iter::once(good.0).chain(others).collect();
        Evidence { log_likelihoods, inside: look.inside, shift, strangeness }
    }

    /// The shift (node px) at which a density fits best.
    pub fn best_shift(
        &self,
        density: &Density,
        light: &Light,
        reduced: &Grid,
        camera: &Camera,
        pose: &Pose,
    ) -> [f64; 2] {
        let placed = self.window.place(camera, pose);
        let shifted = self.shifted(reduced, &placed, light);
        shifted[likeliest(density, &shifted, &|s| s.prior).1].shift
    }

    /// The node at every shift of the local search.
    fn shifted(&self, reduced: &Grid, placed: &Placed, light: &Light) -> Vec<Shifted> {
        let [columns, rows] = self.spread.map(|spread| steps(spread, self.window.frame.factor));
        let mut out = Vec::new();
        for &y in &rows {
            for &x in &columns {
                let shift = [x, y];
                let prior: f64 = (0..2).map(|k| -0.5 * (shift[k] / self.spread[k]).powi(2)).sum();
                let (image, _) = self.window.cut(reduced, placed, shift);
                let image = light.level(image, &self.surroundings);
                out.push(Shifted { prior, shift, coefficients: self.stencil.coefficients(&image) });
            }
        }
        out
    }

    /// The node's window in a photo of a correct assembly, at its most likely shift.
    pub fn reference(
        &self,
        light: &Light,
        noise: f64,
        reduced: &Grid,
        camera: &Camera,
        pose: &Pose,
    ) -> (Grid, [f64; 2]) {
        let good = &self.rendered(light, noise)[0];
        let shift = self.best_shift(good, light, reduced, camera, pose);
        let window = self.window.cut(reduced, &self.window.place(camera, pose), shift).0;
        (window, shift.map(|v| v * f64::from(self.window.frame.factor)))
    }

    /// The node's coefficients at a pose, and which of them touch clipped pixels.
    pub fn observe(&self, reduced: &Grid, camera: &Camera, pose: &Pose) -> (Vec<f32>, Vec<bool>) {
        let placed = self.window.place(camera, pose);
        let (image, _) = self.window.cut(reduced, &placed, [0.0, 0.0]);
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
        let lamps = model.station.lamps.len();
        let node = |n: &Node| NodeImages::new(n, &model.station.camera, &home, lamps);
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
