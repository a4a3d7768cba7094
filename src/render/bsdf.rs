//! How a surface answers light: matt, metal, and plastic under a coat.
//!
//! In: two directions, or one and random numbers, in the frame of the surface with its normal along +z; both point away from the
//! surface. Out: value, density, sampled direction. Never knows where on the surface it is.
//!
//! Microfacets: GGX (Walter et al. 2007), stretched along the grooves of machining (Burley 2012), with height-correlated Smith shadowing (Heitz 2014), `alpha` unsquared, visible
//! normals by spherical caps (Dupuy and Benyoub 2023). Single scattering: rough metals lose some energy, as published.

use super::vector::{Vec3, cosine_direction, sine_cosine};
use std::f32::consts::PI;

/// Smallest GGX alpha: a polished surface. Below, the lobe is narrower than `f32` resolves.
const LEAST_ALPHA: f32 = 1e-3;
/// Refractive index of the coat of plastics.
const COAT_INDEX: f32 = 1.5;
/// Share of diffuse light in a medium of index 1.5 that its surface returns inwards: 1 - (1 - 0.0918) / 1.5² with the
/// outer diffuse reflectance of Fresnel's equations integrated over the hemisphere.
const COAT_INNER_REFLECTANCE: f32 = 0.596_4;

/// A surface at one point.
#[derive(Debug, Clone, Copy)]
pub(super) enum Bsdf {
    /// Lambert.
    Matt { albedo: f32 },
    /// Conductor of index n + ik; `scale` multiplies Fresnel's term. GGX alpha along the frame's x and y.
    Metal { alpha: [f32; 2], n: f32, k: f32, scale: f32 },
    /// Lambert under a dielectric coat.
    Plastic { albedo: f32, alpha: f32 },
}

/// What a pair of directions gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    /// BSDF times the cosine of the incoming direction (1/sr).
    pub value: f32,
    /// Density with which [`Bsdf::sample`] draws the incoming direction (1/sr).
    pub pdf: f32,
}

const NOTHING: Scatter = Scatter { value: 0.0, pdf: 0.0 };

impl Bsdf {
    /// Light from `wi` towards `wo`. Zero if either is below the surface.
    pub fn evaluate(&self, wo: Vec3, wi: Vec3) -> Scatter {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return NOTHING;
        }
        match *self {
            Bsdf::Matt { albedo } => Scatter { value: albedo * wi.z / PI, pdf: wi.z / PI },
            Bsdf::Metal { alpha, n, k, scale } => {
                let (lobe, cosine) = reflection(alpha.map(|a| a.max(LEAST_ALPHA)), wo, wi);
                Scatter { value: lobe.value * (scale * conductor(cosine, n, k)).min(1.0), pdf: lobe.pdf }
            }
            Bsdf::Plastic { albedo, alpha } => plastic(albedo, alpha.max(LEAST_ALPHA), wo, wi),
        }
    }

    /// Draws an incoming direction for `wo` with u uniform in [0, 1)³. `None` if it ends below the surface.
    pub fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<(Vec3, Scatter)> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = match *self {
            Bsdf::Matt { .. } => cosine_direction([u[0], u[1]]),
            Bsdf::Metal { alpha, .. } => mirrored(wo, alpha.map(|a| a.max(LEAST_ALPHA)), [u[0], u[1]]),
            Bsdf::Plastic { albedo, alpha } if u[2] < coat_share(albedo, wo.z) => {
                mirrored(wo, [alpha.max(LEAST_ALPHA); 2], [u[0], u[1]])
            }
            Bsdf::Plastic { .. } => cosine_direction([u[0], u[1]]),
        };
        let scatter = self.evaluate(wo, wi);
        (scatter.pdf > 0.0).then_some((wi, scatter))
    }
}

/// Reflectance of a dielectric coat over a Lambert body; light bounces between body and coat until it leaves.
fn plastic(albedo: f32, alpha: f32, wo: Vec3, wi: Vec3) -> Scatter {
    let (coat, cosine) = reflection([alpha; 2], wo, wi);
    let entered = (1.0 - dielectric(wo.z)) * (1.0 - dielectric(wi.z)) / (COAT_INDEX * COAT_INDEX);
    let body = albedo * entered / (1.0 - albedo * COAT_INNER_REFLECTANCE) * wi.z / PI;
    let share = coat_share(albedo, wo.z);
    Scatter { value: coat.value * dielectric(cosine) + body, pdf: share * coat.pdf + (1.0 - share) * wi.z / PI }
}

/// Probability of sampling the coat rather than the body.
fn coat_share(albedo: f32, cosine: f32) -> f32 {
    let coat = dielectric(cosine);
    (coat / (coat + (1.0 - coat) * albedo)).clamp(0.1, 0.9)
}

/// The mirror image of `wo` about a random visible facet.
fn mirrored(wo: Vec3, alpha: [f32; 2], u: [f32; 2]) -> Vec3 {
    let facet = visible_facet(wo, alpha, u);
    facet * (2.0 * wo.dot(&facet)) - wo
}

/// A facet normal drawn among those visible from `wo`.
fn visible_facet(wo: Vec3, [ax, ay]: [f32; 2], u: [f32; 2]) -> Vec3 {
    let stretched = Vec3::new(ax * wo.x, ay * wo.y, wo.z).normalize();
    let (sine, cosine) = sine_cosine(u[0]);
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let cap = Vec3::new(radius * cosine, radius * sine, z) + stretched;
    Vec3::new(ax * cap.x, ay * cap.y, cap.z.max(0.0)).normalize()
}

/// A perfectly reflecting microfacet surface, and the cosine at which the facets are met.
fn reflection(alpha: [f32; 2], wo: Vec3, wi: Vec3) -> (Scatter, f32) {
    let facet = (wo + wi).normalize();
    let density = facet_density(alpha, facet);
    let (out, into) = (masking(alpha, wo), masking(alpha, wi));
    let common = density / (4.0 * wo.z);
    (Scatter { value: common / (1.0 + out + into), pdf: common / (1.0 + out) }, wo.dot(&facet).clamp(0.0, 1.0))
}

/// GGX distribution of facet normals (1/sr).
fn facet_density([ax, ay]: [f32; 2], facet: Vec3) -> f32 {
    // Round lobes keep their own formula: the stretched one rounds otherwise, and images have to stay what they were.
    let slopes = if ax == ay {
        (facet.x * facet.x + facet.y * facet.y) / (ax * ax)
    } else {
        (facet.x / ax) * (facet.x / ax) + (facet.y / ay) * (facet.y / ay)
    };
    let spread = slopes + facet.z * facet.z;
    1.0 / (PI * (ax * ay) * spread * spread)
}

/// Smith's Λ: 1 / (1 + Λ) is the share of facets not masked in a direction.
fn masking([ax, ay]: [f32; 2], w: Vec3) -> f32 {
    let slopes = if ax == ay {
        let tangent2 = (w.x * w.x + w.y * w.y) / (w.z * w.z);
        ax * ax * tangent2
    } else {
        ((ax * w.x) * (ax * w.x) + (ay * w.y) * (ay * w.y)) / (w.z * w.z)
    };
    ((1.0 + slopes).sqrt() - 1.0) / 2.0
}

/// Fresnel reflectance of a conductor for unpolarised light met at `cosine`, exact.
fn conductor(cosine: f32, n: f32, k: f32) -> f32 {
    let (c2, n2, k2) = (cosine * cosine, n * n, k * k);
    let s2 = 1.0 - c2;
    let difference = n2 - k2 - s2;
    let modulus = (difference * difference + 4.0 * n2 * k2).sqrt();
    let twice = 2.0 * cosine * (0.5 * (modulus + difference)).max(0.0).sqrt();
    let perpendicular = (modulus + c2 - twice) / (modulus + c2 + twice);
    let (a, b) = (c2 * modulus + s2 * s2, twice * s2);
    let parallel = perpendicular * (a - b) / (a + b);
    0.5 * (perpendicular + parallel)
}

/// Fresnel reflectance of the coat from outside.
fn dielectric(cosine: f32) -> f32 {
    let inner = (1.0 - (1.0 - cosine * cosine) / (COAT_INDEX * COAT_INDEX)).sqrt();
    let perpendicular = (cosine - COAT_INDEX * inner) / (cosine + COAT_INDEX * inner);
    let parallel = (COAT_INDEX * cosine - inner) / (COAT_INDEX * cosine + inner);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    const SILVER: Bsdf = Bsdf::Metal { alpha: [0.3; 2], n: 0.0, k: 1.0, scale: 1.0 };

    fn direction(cosine: f32, turns: f32) -> Vec3 {
        let (s, c) = sine_cosine(turns);
        let radius = (1.0 - cosine * cosine).sqrt();
        Vec3::new(radius * c, radius * s, cosine)
    }

    /// ∫ f over the hemisphere by the midpoint rule in cosine and azimuth.
    fn over_hemisphere(f: impl Fn(Vec3) -> f64) -> f64 {
        let (rows, columns) = (400, 400);
        let mut sum = 0.0;
        for i in 0..rows {
            for j in 0..columns {
                let cosine = (i as f32 + 0.5) / rows as f32;
                sum += f(direction(cosine, (j as f32 + 0.5) / columns as f32));
            }
        }
        sum * std::f64::consts::TAU / (rows * columns) as f64
    }

    fn kinds() -> [Bsdf; 8] {
        [
            Bsdf::Matt { albedo: 0.7 },
            Bsdf::Metal { alpha: [0.15; 2], n: 1.5, k: 7.4, scale: 0.9 },
            Bsdf::Metal { alpha: [0.5; 2], n: 2.4, k: 4.1, scale: 1.0 },
            Bsdf::Plastic { albedo: 0.5, alpha: 0.2 },
            SILVER,
            Bsdf::Metal { alpha: [0.08, 0.3], n: 2.4, k: 4.1, scale: 1.0 },
            Bsdf::Metal { alpha: [0.5, 0.15], n: 0.0, k: 1.0, scale: 1.0 },
            Bsdf::Plastic { albedo: 0.9, alpha: 0.6 },
        ]
    }

    #[test]
    fn fresnel_at_normal_incidence_is_the_textbook_figure() {
        let r0 = |n: f32, k: f32| ((n - 1.0).powi(2) + k * k) / ((n + 1.0).powi(2) + k * k);
        assert!((conductor(1.0, 1.507, 7.367) - r0(1.507, 7.367)).abs() < 1e-5);
        assert!((conductor(1.0, 2.396, 4.138) - r0(2.396, 4.138)).abs() < 1e-5);
        assert!((dielectric(1.0) - 0.04).abs() < 1e-6 && (dielectric(0.0) - 1.0).abs() < 1e-6);
        // Without absorption the conductor's formula is the dielectric's.
        for cosine in [0.1, 0.4, 0.9] {
            assert!((conductor(cosine, 1.5, 0.0) - dielectric(cosine)).abs() < 1e-5);
        }
    }

    #[test]
    fn light_runs_both_ways() {
        let mut s = Stream::new(1, "reciprocity", 0);
        for bsdf in kinds() {
            for _ in 0..200 {
                let [a, b] = [0; 2].map(|_| direction(s.between(0.05, 1.0) as f32, s.uniform() as f32));
                let (there, back) = (bsdf.evaluate(a, b).value / b.z, bsdf.evaluate(b, a).value / a.z);
                assert!((there - back).abs() <= 1e-4 * there.max(1e-3), "{bsdf:?} {there} {back}");
            }
        }
    }

    #[test]
    fn the_density_integrates_to_what_sampling_keeps() {
        let mut s = Stream::new(2, "kept", 0);
        for bsdf in kinds() {
            for cosine in [0.3, 0.9] {
                let wo = direction(cosine, 0.1);
                let integral = over_hemisphere(|wi| f64::from(bsdf.evaluate(wo, wi).pdf));
                let n = 20_000;
                let kept =
                    (0..n).filter(|_| bsdf.sample(wo, [0.0; 3].map(|_: f32| s.uniform() as f32)).is_some()).count();
                assert!((integral - kept as f64 / n as f64).abs() < 0.015, "{bsdf:?} {integral} {kept}");
            }
        }
    }

    /// χ² of sampled directions against the integral of the density over cells equal in cosine and azimuth.
    #[test]
    fn samples_follow_the_density() {
        let mut s = Stream::new(3, "chi", 0);
        let (rows, columns, fine, n) = (8, 8, 24, 40_000);
        for bsdf in kinds() {
            let wo = direction(0.6, 0.3);
            let mut counts = vec![0.0_f64; rows * columns];
            for _ in 0..n {
                if let Some((wi, _)) = bsdf.sample(wo, [0.0; 3].map(|_: f32| s.uniform() as f32)) {
                    let turns = f64::from(wi.y).atan2(f64::from(wi.x)) / std::f64::consts::TAU;
                    let column = ((turns.rem_euclid(1.0)) * columns as f64) as usize;
                    counts[((wi.z * rows as f32) as usize).min(rows - 1) * columns + column.min(columns - 1)] += 1.0;
                }
            }
            let (mut chi, mut cells) = (0.0, 0);
            for (cell, &count) in counts.iter().enumerate() {
                let mut expected = 0.0;
                for i in 0..fine * fine {
                    let cosine = ((cell / columns) as f32 + ((i / fine) as f32 + 0.5) / fine as f32) / rows as f32;
                    let turns = ((cell % columns) as f32 + ((i % fine) as f32 + 0.5) / fine as f32) / columns as f32;
                    expected += f64::from(bsdf.evaluate(wo, direction(cosine, turns)).pdf);
                }
                expected *= std::f64::consts::TAU / (rows * columns * fine * fine) as f64 * f64::from(n);
                if expected > 10.0 {
                    chi += (count - expected).powi(2) / expected;
                    cells += 1;
                }
            }
            // Mean `cells`, standard deviation √(2 cells): five of them, and room for the quadrature of the peak.
            let bound = f64::from(cells) + 5.0 * (2.0 * f64::from(cells)).sqrt() + 10.0;
            assert!(chi < bound, "{bsdf:?}: {chi} in {cells} cells");
        }
    }

    #[test]
    fn sampling_and_quadrature_give_the_same_albedo_and_never_more_than_one() {
        let mut s = Stream::new(4, "albedo", 0);
        for bsdf in kinds() {
            for cosine in [0.15, 0.5, 0.95] {
                let wo = direction(cosine, 0.7);
                let exact = over_hemisphere(|wi| f64::from(bsdf.evaluate(wo, wi).value));
                let n = 20_000;
                let mean = (0..n)
                    .filter_map(|_| bsdf.sample(wo, [0.0; 3].map(|_: f32| s.uniform() as f32)))
                    .map(|(_, scatter)| f64::from(scatter.value / scatter.pdf))
                    .sum::<f64>()
                    / f64::from(n);
                assert!((mean - exact).abs() < 0.012 && exact < 1.005, "{bsdf:?} {cosine}: {mean} {exact}");
            }
        }
    }

    #[test]
    fn white_plastic_under_a_smooth_coat_returns_nearly_everything() {
        let white = Bsdf::Plastic { albedo: 1.0, alpha: 0.1 };
        let albedo = over_hemisphere(|wi| f64::from(white.evaluate(direction(0.8, 0.0), wi).value));
        assert!((albedo - 1.0).abs() < 0.01, "{albedo}");
    }

    /// Moments of the facets drawn against their density, where the viewer is straight above, aslant either way and grazing.
    #[test]
    fn facets_are_drawn_as_they_are_seen() {
        let mut s = Stream::new(9, "facets", 0);
        for alpha in [[0.3, 0.3], [0.25, 0.5], [0.6, 0.25]] {
            for (cosine, turns) in [(1.0, 0.0), (0.6, 0.0), (0.6, 0.25), (0.2, 0.1)] {
                let wo = direction(cosine, turns);
                // The mean of any function over drawn facets is its integral over facets times their density.
                let density = |h: Vec3| {
                    let seen = wo.dot(&h).max(0.0) / ((1.0 + masking(alpha, wo)) * wo.z);
                    f64::from(seen * facet_density(alpha, h))
                };
                let functions: [fn(Vec3) -> f64; 4] =
                    [|_| 1.0, |h| f64::from(h.z), |h| f64::from(h.x * h.x), |h| f64::from(h.y)];
                let n = 20_000;
                let drawn: Vec<Vec3> =
                    (0..n).map(|_| visible_facet(wo, alpha, [0.0; 2].map(|_: f32| s.uniform() as f32))).collect();
                for (i, f) in functions.into_iter().enumerate() {
                    let exact = over_hemisphere(|h| density(h) * f(h));
                    let mean = drawn.iter().map(|&h| f(h)).sum::<f64>() / f64::from(n);
                    let variance = drawn.iter().map(|&h| (f(h) - mean).powi(2)).sum::<f64>() / f64::from(n);
                    let error = (variance / f64::from(n)).sqrt();
                    assert!((mean - exact).abs() < 4.5 * error + 2e-3, "{alpha:?} {wo:?} {i}: {mean} {exact}");
                }
            }
        }
    }

    #[derive(serde::Deserialize)]
    struct Row {
        along: f32,
        across: f32,
        degrees: f32,
        cosines: Vec<f32>,
        albedo: Vec<f64>,
    }

    /// The furnace: Mitsuba's facets integrated another way (tests/oracle/mitsuba/albedo.py).
    #[test]
    fn rough_metal_loses_what_an_independent_quadrature_says() {
        let table: Vec<Row> = serde_json::from_str(include_str!("../../tests/oracle/mitsuba/albedo.json")).unwrap();
        let mut s = Stream::new(10, "furnace", 0);
        for row in &table {
            let metal = Bsdf::Metal { alpha: [row.along, row.across], n: 0.0, k: 1.0, scale: 1.0 };
            for (&cosine, &exact) in row.cosines.iter().zip(&row.albedo) {
                assert!(exact <= 1.0);
                let wo = direction(cosine, row.degrees / 360.0);
                let n = 10_000;
                let weights: Vec<f64> = (0..n)
                    .map(|_| metal.sample(wo, [0.0; 3].map(|_: f32| s.uniform() as f32)))
                    .map(|drawn| drawn.map_or(0.0, |(_, scatter)| f64::from(scatter.value / scatter.pdf)))
                    .collect();
                // No draw brings more than it takes: the weight is G2 / G1.
                assert!(weights.iter().all(|&w| w < 1.0 + 1e-4));
                let mean = weights.iter().sum::<f64>() / f64::from(n);
                let variance = weights.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / f64::from(n);
                let error = (variance / f64::from(n)).sqrt();
                let at = format!("{} {} {}° {cosine}", row.along, row.across, row.degrees);
                assert!((mean - exact).abs() < 4.5 * error + 3e-4, "{at}: {mean} ± {error}, quadrature {exact}");
            }
        }
        assert!(table.len() >= 10);
    }

    #[test]
    fn equal_alphas_are_a_round_lobe() {
        let round = Bsdf::Metal { alpha: [0.2; 2], n: 2.4, k: 4.1, scale: 1.0 };
        let nearly = Bsdf::Metal { alpha: [0.2, 0.2 * (1.0 + 1e-6)], n: 2.4, k: 4.1, scale: 1.0 };
        let wi = direction(0.7, 0.2);
        for turns in [0.0, 0.1, 0.37, 0.5] {
            let wo = direction(0.5, turns);
            let (a, b) = (round.evaluate(wo, wi), nearly.evaluate(wo, wi));
            assert!((a.value / b.value - 1.0).abs() < 1e-4 && (a.pdf / b.pdf - 1.0).abs() < 1e-4, "{a:?} {b:?}");
        }
    }

    /// Where the facets lie along one direction only, light spreads across the grooves and not along them.
    #[test]
    fn light_spreads_across_the_grooves() {
        let metal = Bsdf::Metal { alpha: [0.05, 0.4], n: 2.4, k: 4.1, scale: 1.0 };
        let wo = Vec3::z();
        let (along, across) = (metal.evaluate(wo, direction(0.9, 0.0)), metal.evaluate(wo, direction(0.9, 0.25)));
        assert!(across.value > 20.0 * along.value, "{along:?} {across:?}");
    }
}
