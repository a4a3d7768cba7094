//! The light of a station: what one photo tells about its lamps, and what must be left open.
//!
//! Images are linear in light. Lamps that keep their power within a third are weighed once, on the calibration photo.
//! Lamps that do not (daylight, a hand-held camera) say nothing about the next photo: then every image of a draw is seen
//! under many mixes of the lamps, and each window is brought to the same grey around its node. Never decides.

use super::grid::Grid;
use super::linear;
use super::math::power;
use super::model::Lamp;

/// Lamps whose power drifts by more than this share are left open.
const STEADY: f64 = 0.3;
/// Mixes of open lamps under which every draw is seen.
const MIXES: usize = 6;
/// Mean grey (share of full scale) to which the surroundings of a node are brought under open light.
const SURROUNDINGS: f64 = 0.4;
/// Mean grey that an automatic exposure gives the surroundings: least and most.
const EXPOSURES: [f64; 2] = [0.1, 0.8];
/// No lamp is dimmer than this share of its power.
const DIMMEST: f64 = 1e-3;

/// The light under which densities are made.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Weights per lamp, and the drifts: what varies together, as a change of the weights (standard deviation).
    Steady { weights: Vec<f64>, drifts: Vec<Vec<f64>> },
    /// Least and largest weight per lamp; every mix is as likely (log-uniform), and so is every exposure.
    Open { ranges: Vec<[f64; 2]> },
}

impl Light {
    /// From the calibrated weight of every lamp.
    pub fn new(weights: &[f64], lamps: &[Lamp]) -> Light {
        if lamps.iter().all(|l| l.drift <= STEADY) {
            return Light::Steady { weights: weights.to_vec(), drifts: drifts(weights, lamps) };
        }
        let total = |sum: f64| sum.max(f64::MIN_POSITIVE);
        let scale = total(weights.iter().sum()) / total(lamps.iter().map(|l| l.power).sum());
        // What an open lamp gave in one photo is no centre for the next.
        let range = |(&weight, lamp): (&f64, &Lamp)| {
            range(if lamp.drift <= STEADY { weight } else { lamp.power * scale }, lamp.drift)
        };
        Light::Open { ranges: weights.iter().zip(lamps).map(range).collect() }
    }

    pub fn is_open(&self) -> bool {
        matches!(self, Light::Open { .. })
    }

    /// What a draw (one image per lamp) looks like: once under steady light, in several mixes under open light. Clipped
    /// as the sensor clips. `draw` is its number.
    pub fn seen(&self, images: &[Grid], draw: usize, surroundings: &[bool]) -> Vec<Grid> {
        match self {
            Light::Steady { weights, .. } => vec![clipped(mixed(images, weights))],
            Light::Open { ranges } => {
                let mix = |k: usize| {
                    let at = spread_evenly(draw * MIXES + k, ranges.len() + 1);
                    let weights: Vec<f64> = at.iter().zip(ranges).map(|(&u, range)| within(range, u)).collect();
                    let grey = EXPOSURES[0] + (EXPOSURES[1] - EXPOSURES[0]) * at[ranges.len()];
                    let exposed = clipped(levelled(mixed(images, &weights), surroundings, grey));
                    levelled(exposed, surroundings, SURROUNDINGS)
                };
                (0..MIXES).map(mix).collect()
            }
        }
    }

    /// A photo's window as it is compared with what is [`Light::seen`].
    pub fn level(&self, window: Grid, surroundings: &[bool]) -> Grid {
        if self.is_open() { levelled(window, surroundings, SURROUNDINGS) } else { window }
    }
}

/// One drift per light of the station: the patches of a room rise and fall together. Uniform within ± d is d / √3.
fn drifts(weights: &[f64], lamps: &[Lamp]) -> Vec<Vec<f64>> {
    let lights = lamps.iter().map(|l| l.light).max().map_or(0, |last| last + 1);
    let of = |light: u32| -> Vec<f64> {
        let own = |(w, lamp): (&f64, &Lamp)| if lamp.light == light { w * lamp.drift / 3f64.sqrt() } else { 0.0 };
        weights.iter().zip(lamps).map(own).collect()
    };
    (0..lights).map(of).filter(|d| d.iter().any(|&v| v > 0.0)).collect()
}

/// Least and largest weight of a lamp that drifts by ± `drift`.
pub fn range(power: f64, drift: f64) -> [f64; 2] {
    [power * (1.0 - drift).max(DIMMEST), power * (1.0 + drift)]
}

/// The weight at `u` in 0..1 of a log-uniform lamp; 0 for a lamp that gives nothing.
pub fn within([low, high]: &[f64; 2], u: f64) -> f64 {
    if *low > 0.0 { low * power(high / low, u) } else { 0.0 }
}

fn mixed(images: &[Grid], weights: &[f64]) -> Grid {
    let mut sum = Grid::filled(images[0].width, images[0].height, 0.0);
    for (image, &weight) in images.iter().zip(weights) {
        sum.values.iter_mut().zip(&image.values).for_each(|(s, v)| *s += v * weight as f32);
    }
    sum
}

fn clipped(mut image: Grid) -> Grid {
    image.values.iter_mut().for_each(|v| *v = v.min(1.0));
    image
}

/// The image times what brings the mean of its surroundings to `grey`.
fn levelled(mut image: Grid, surroundings: &[bool], grey: f64) -> Grid {
    /// Below this mean grey there is no light to speak of.
    const DARK: f64 = 1e-6;
    let (mut sum, mut count) = (0.0, 0usize);
    for (&value, _) in image.values.iter().zip(surroundings).filter(|(_, outside)| **outside) {
        sum += f64::from(value);
        count += 1;
    }
    let gain = (grey / (sum / count.max(1) as f64).max(DARK)) as f32;
    image.values.iter_mut().for_each(|v| *v *= gain);
    image
}

/// Point number `index` of an additive recurrence in 0..1 that fills `dimensions` evenly: its steps are the powers of the root
/// of x^(d+1) = x + 1 (Roberts 2018).
fn spread_evenly(index: usize, dimensions: usize) -> Vec<f64> {
    let mut root = 1.5f64;
    for _ in 0..40 {
        root = power(1.0 + root, 1.0 / (dimensions + 1) as f64);
    }
    let step = |d: usize| (0..=d).fold(1.0, |power, _| power / root);
    (0..dimensions).map(|d| (0.5 + step(d) * (index + 1) as f64).fract()).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn daylight_is_open_and_a_lamp_is_not() {
        let lamp = |light, drift| Lamp { name: "lamp".into(), light, power: 1.0, drift };
        let steady = Light::new(&[2.0, 0.0, 4.0], &[lamp(0, 0.15), lamp(1, 0.3), lamp(1, 0.3)]);
        let Light::Steady { weights, drifts } = &steady else { panic!("not steady") };
        assert_eq!(weights, &[2.0, 0.0, 4.0]);
        assert_eq!(drifts, &[vec![2.0 * 0.15 / 3f64.sqrt(), 0.0, 0.0], vec![0.0, 0.0, 4.0 * 0.3 / 3f64.sqrt()]]);
        let Light::Open { ranges } = Light::new(&[2.0, 0.0], &[lamp(0, 0.1), lamp(1, 0.9)]) else { panic!("not open") };
        // The lamp that keeps its power keeps its weight; the other gives what it was said to, in the photo's measure.
        assert!((ranges[0][0] - 1.8).abs() < 1e-12 && (ranges[0][1] - 2.2).abs() < 1e-12);
        assert!((ranges[1][0] - 0.1).abs() < 1e-12 && (ranges[1][1] - 1.9).abs() < 1e-12);
    }

    #[test]
    fn open_light_leaves_contrast_and_takes_brightness() {
        let surroundings = [true, true, false, false];
        let dim = Grid::new(2, 2, vec![0.1, 0.1, 0.3, 0.05]);
        let bright = Grid::new(2, 2, dim.values.iter().map(|v| v * 7.0).collect());
        let light = Light::Open { ranges: vec![[0.1, 10.0]] };
        let [a, b] = [dim.clone(), bright].map(|g| light.level(g, &surroundings));
        assert!(a.values.iter().zip(&b.values).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!((a.at(0, 0) - 0.4).abs() < 1e-6 && (a.at(0, 1) - 1.2).abs() < 1e-6);
        let seen = light.seen(std::slice::from_ref(&dim), 3, &surroundings);
        assert_eq!(seen.len(), MIXES);
        // A dark spot never clips; a bright one does where the exposure is long.
        assert!(seen.iter().all(|g| (g.at(1, 1) - 0.2).abs() < 1e-5 && g.at(0, 1) < 1.2 + 1e-5));
        assert!(seen.iter().any(|g| g.at(0, 1) < 1.0));
    }

    #[test]
    fn mixes_fill_the_ranges_evenly() {
        let n = 500;
        for dimension in 0..4 {
            let mut values: Vec<f64> = (0..n).map(|i| spread_evenly(i, 4)[dimension]).collect();
            values.sort_by(f64::total_cmp);
            let widest = values.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
            assert!(values[0] >= 0.0 && values[n - 1] < 1.0 && widest < 12.0 / n as f64, "{dimension}: {widest}");
        }
    }

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
