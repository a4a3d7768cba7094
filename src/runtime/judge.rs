//! A calibrated model, ready to judge: densities of every node under every hypothesis.
//!
//! In: a model, the lamps' weights and the sensor's noise. Out: log-likelihoods of a photo's nodes. Never decides.

use super::camera::Camera;
use super::density::{Density, Floor, mean_of};
use super::grid::Grid;
use super::linear;
use super::model::{Hypothesis, Image, Model, Node};
use super::pose::Pose;
use super::window::{Frame, Placed, Stencil, Window, mask_of};

/// Local search: shifts of up to this many px of the photo each way. More would let a part that stands too high pass as
/// one that stands a little further back.
const SHIFTS: i32 = 2;
/// Photo values from here on count as clipped.
pub const CLIP: f32 = 0.98;
/// Resolution levels per node.
pub const LEVELS: u32 = 2;

/// A node's geometry and training images, independent of the light.
pub struct NodeImages {
    pub window: Window,
    pub stencil: Stencil,
    /// Standard deviation of the node's shift (node px).
    spread: [f64; 2],
    /// Per hypothesis, per draw, one image per lamp.
    hypotheses: Vec<Vec<Vec<Grid>>>,
}

impl NodeImages {
    /// `None` when the node's plane is behind the camera.
    pub fn new(node: &Node, nominal: &Camera, home: &Pose, lamps: usize) -> Option<NodeImages> {
        let grid = |image: &Image| {
            let step = node.steps[image.lamp as usize] as f32;
            let values = image.rows.iter().flatten().map(|&v| f32::from(v) * step).collect();
            Grid::new(node.size[0] as usize, node.size[1] as usize, values)
        };
        let draws = |h: &Hypothesis| h.images.chunks(lamps).map(|draw| draw.iter().map(grid).collect()).collect();
        Some(NodeImages {
            window: Window::new(Frame::of(node), nominal, home)?,
            stencil: Stencil::new(&mask_of(node), LEVELS),
            spread: node.spread.map(|s| s / f64::from(node.factor)),
            hypotheses: node.hypotheses.iter().map(draws).collect(),
        })
    }

    pub fn hypotheses(&self) -> usize {
        self.hypotheses.len()
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

    /// Coefficients of every draw of a hypothesis under the given lamp weights, clipped as the sensor clips.
    fn relit(&self, hypothesis: usize, weights: &[f64]) -> Vec<Vec<f32>> {
        let light = |draw: &Vec<Grid>| {
            let mut sum = vec![0.0f32; draw[0].values.len()];
            for (grid, &weight) in draw.iter().zip(weights) {
                sum.iter_mut().zip(&grid.values).for_each(|(s, v)| *s += v * weight as f32);
            }
            sum.iter_mut().for_each(|s| *s = s.min(1.0));
            self.stencil.coefficients(&Grid::new(draw[0].width, draw[0].height, sum))
        };
        self.hypotheses[hypothesis].iter().map(light).collect()
    }

    /// The densities of all hypotheses under the given light.
    pub fn densities(&self, weights: &[f64], drift: &[f64], noise: f64) -> Vec<Density> {
        let noise = noise / f64::from(self.window.frame.factor);
        let good = self.relit(0, weights);
        let floor = Floor::new(&self.stencil.levels, noise, &mean_of(&good));
        let density = |hypothesis: usize| {
            let samples = if hypothesis == 0 { good.clone() } else { self.relit(hypothesis, weights) };
            let lamps = self.lamp_columns(hypothesis, weights, drift);
            Density::fit(&samples, lamps, &floor)
        };
        (0..self.hypotheses.len()).map(density).collect()
    }

    /// A lamp that drifts by ± d (uniform) moves the image by its own share times d / √3.
    fn lamp_columns(&self, hypothesis: usize, weights: &[f64], drift: &[f64]) -> Vec<Vec<f32>> {
        let means = self.lamp_means(hypothesis);
        let scales = weights.iter().zip(drift).map(|(w, d)| (w * d / 3f64.sqrt()) as f32);
        let columns = means.into_iter().zip(scales).filter(|(_, s)| *s > 0.0);
        columns.map(|(mean, s)| mean.into_iter().map(|v| v * s).collect()).collect()
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
    /// Evidence for every hypothesis at a pose; each re-aligns by itself within the local search.
    pub fn evidence(&self, densities: &[Density], reduced: &Grid, camera: &Camera, pose: &Pose) -> Evidence {
        let placed = self.window.place(camera, pose);
        let inside = self.window.cut(reduced, &placed, [0.0, 0.0]).1;
        let shifted = self.shifted(reduced, &placed);
        let mut best = vec![(f64::NEG_INFINITY, 0usize); densities.len()];
        for (index, (prior, _, z)) in shifted.iter().enumerate() {
            for (density, best) in densities.iter().zip(&mut best) {
                let score = density.gaussian(z) + prior;
                if score > best.0 {
                    *best = (score, index);
                }
            }
        }
        let robust = |(density, &(_, index)): (&Density, &(f64, usize))| {
            let (prior, _, z) = &shifted[index];
            density.student(z) + prior
        };
        let log_likelihoods = densities.iter().zip(&best).map(robust).collect();
        Evidence { log_likelihoods, inside, shift: shifted[best[0].1].1 }
    }

    /// The shift (node px) at which a density fits best.
    pub fn best_shift(&self, density: &Density, reduced: &Grid, camera: &Camera, pose: &Pose) -> [f64; 2] {
        let placed = self.window.place(camera, pose);
        let scored =
            self.shifted(reduced, &placed).into_iter().map(|(prior, shift, z)| (density.gaussian(&z) + prior, shift));
        scored.max_by(|a, b| a.0.total_cmp(&b.0)).map_or([0.0; 2], |(_, shift)| shift)
    }

    /// Log prior, shift and coefficients for every shift of the local search.
    fn shifted(&self, reduced: &Grid, placed: &Placed) -> Vec<(f64, [f64; 2], Vec<f32>)> {
        let step = 1.0 / f64::from(self.window.frame.factor);
        let mut out = Vec::new();
        for j in -SHIFTS..=SHIFTS {
            for i in -SHIFTS..=SHIFTS {
                let shift = [f64::from(i) * step, f64::from(j) * step];
                let prior: f64 = (0..2).map(|k| -0.5 * (shift[k] / self.spread[k]).powi(2)).sum();
                let (image, _) = self.window.cut(reduced, placed, shift);
                out.push((prior, shift, self.stencil.coefficients(&image)));
            }
        }
        out
    }

    /// The node's coefficients at a pose, and which of them touch clipped pixels.
    pub fn observe(&self, reduced: &Grid, camera: &Camera, pose: &Pose) -> (Vec<f32>, Vec<bool>) {
        let placed = self.window.place(camera, pose);
        let (image, _) = self.window.cut(reduced, &placed, [0.0, 0.0]);
        (self.stencil.coefficients(&image), self.stencil.touching(&image, CLIP))
    }
}

/// One node's part in the search for the lamps' weights.
pub struct LightEvidence {
    pub z: Vec<f32>,
    pub clipped: Vec<bool>,
    /// Per lamp: the node's coefficients in that lamp's image.
    pub lamps: Vec<Vec<f32>>,
}

/// How well the lamps explain the photo.
#[derive(Debug, Clone, PartialEq)]
pub struct LightFit {
    pub weights: Vec<f64>,
    /// Correlation of the photo's coefficients with the re-synthesis.
    pub correlation: f64,
}

/// Non-negative lamp weights that explain the nodes' gradients best, robustly (Huber), drawn weakly towards `prior`.
/// Images are linear in light, so gradients are too, and an offset drops out.
pub fn fit_lamps(evidence: &[LightEvidence], prior: &[f64], pull: f64) -> LightFit {
    const ROUNDS: usize = 4;
    let mut weights = prior.to_vec();
    let mut scale: Option<f32> = None;
    for _ in 0..ROUNDS {
        weights = fit_once(evidence, &weights, prior, pull, scale);
        scale = Some(typical_residual(evidence, &weights));
    }
    LightFit { correlation: correlation(evidence, &weights), weights }
}

/// One weighted least squares; `scale` is the residual from which Huber's weight falls.
fn fit_once(evidence: &[LightEvidence], current: &[f64], prior: &[f64], pull: f64, scale: Option<f32>) -> Vec<f64> {
    let n = prior.len();
    let (mut a, mut b) = (vec![0.0; n * n], vec![0.0; n]);
    for node in evidence {
        let residual = residuals(node, current);
        for k in (0..node.z.len()).filter(|&k| !node.clipped[k]) {
            let huber = scale.map_or(1.0, |s| (2.0 * s / residual[k].abs().max(1e-9)).min(1.0));
            for i in 0..n {
                let wi = f64::from(node.lamps[i][k] * huber);
                b[i] += wi * f64::from(node.z[k]);
                for j in 0..=i {
                    a[i * n + j] += wi * f64::from(node.lamps[j][k]);
                }
            }
        }
    }
    for i in 0..n {
        for j in 0..i {
            a[j * n + i] = a[i * n + j];
        }
    }
    for i in 0..n {
        let ridge = a[i * n + i] * pull + 1e-30;
        a[i * n + i] += ridge;
        b[i] += ridge * prior[i];
    }
    linear::nonnegative(&a, &b)
}

fn residuals(node: &LightEvidence, weights: &[f64]) -> Vec<f32> {
    let mut rest = node.z.clone();
    for (lamp, &weight) in node.lamps.iter().zip(weights) {
        rest.iter_mut().zip(lamp).for_each(|(r, &v)| *r -= v * weight as f32);
    }
    rest
}

fn typical_residual(evidence: &[LightEvidence], weights: &[f64]) -> f32 {
    let mut all: Vec<f32> = Vec::new();
    for node in evidence {
        let rest = residuals(node, weights);
        all.extend(rest.iter().zip(&node.clipped).filter(|(_, c)| !**c).map(|(r, _)| r.abs()));
    }
    // The median of |e| of a normal e is 0.6745 standard deviations.
    (linear::median(&mut all) / 0.6745).max(1e-9)
}

fn correlation(evidence: &[LightEvidence], weights: &[f64]) -> f64 {
    let (mut zz, mut mm, mut zm) = (0.0, 0.0, 0.0);
    for node in evidence {
        let rest = residuals(node, weights);
        for k in (0..node.z.len()).filter(|&k| !node.clipped[k]) {
            let (z, m) = (f64::from(node.z[k]), f64::from(node.z[k] - rest[k]));
            zz += z * z;
            mm += m * m;
            zm += z * m;
        }
    }
    if zz * mm > 0.0 { zm / (zz * mm).sqrt() } else { 0.0 }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lamp_weights_come_back_in_spite_of_outliers() {
        let value = |k: usize, lamp: usize| ((k * (7 + 3 * lamp) + lamp) as f32 * 0.7).sin();
        let lamps: Vec<Vec<f32>> = (0..3).map(|lamp| (0..400).map(|k| value(k, lamp)).collect()).collect();
        let truth = [0.8, 0.0, 2.5];
        let mut z: Vec<f32> = (0..400).map(|k| (0..3).map(|l| lamps[l][k] * truth[l] as f32).sum()).collect();
        for wild in z.iter_mut().step_by(10) {
            *wild += 30.0;
        }
        let clipped = vec![false; z.len()];
        let fit = fit_lamps(&[LightEvidence { z, clipped, lamps }], &[1.0, 1.0, 1.0], 1e-4);
        for (weight, truth) in fit.weights.iter().zip(truth) {
            assert!((weight - truth).abs() < 0.05, "{:?}", fit.weights);
        }
    }
}
