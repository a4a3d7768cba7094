//! Exposure that differs from photo to photo, where the spec writes `vary { exposure … }`.
//!
//! In: a station and the number of a photo. Out: the factor on that photo's light, and lamps that drift so much more.
//! Exposure is one factor on all lamps, so under steady light a node that allows for drifts of every lamp allows for it;
//! under open light every photo is metered, and the factor is how far it lies beside what was metered.

use crate::design::model::{PerPhoto, Station};
use crate::rng::Stream;
use crate::runtime::light::Light;
use crate::runtime::model::Lamp;

/// How the photos of a station are exposed.
#[derive(Debug, Clone)]
pub struct Exposing {
    exposure: PerPhoto,
    /// By light, what its lamps drift by themselves (± this share).
    drifts: Vec<f64>,
}

impl Exposing {
    pub fn new(station: &Station) -> Exposing {
        Exposing { exposure: station.exposure, drifts: station.lights.iter().map(|light| light.drift).collect() }
    }

    /// The factor of a photo beside the nominal exposure; 1 where none varies.
    pub fn factor(&self, seed: u64, photo: u64) -> f64 {
        if self.exposure.varies {
            self.exposure.at(Stream::new(seed, "exposure", photo).uniform()) / self.exposure.range.nominal
        } else {
            1.0
        }
    }

    /// The grey that a camera which meters every photo to `usual` exposes to; nothing where the spec is silent.
    pub fn metered(&self, usual: f64, factor: f64) -> Option<f64> {
        self.exposure.varies.then_some(usual * self.exposure.range.nominal * factor)
    }

    /// What a lamp of the model drifts by itself.
    pub fn drift_of(&self, lamp: &Lamp) -> f64 {
        self.drifts.get(lamp.light as usize).copied().unwrap_or(lamp.drift)
    }
}

/// Lamps whose drift allows for the exposure too: the variances of the two add. Under open light photos are metered, and
/// there is nothing to allow for.
pub fn widened(mut lamps: Vec<Lamp>, exposure: &PerPhoto) -> Vec<Lamp> {
    let powers: Vec<f64> = lamps.iter().map(|lamp| lamp.power).collect();
    if exposure.varies && !Light::new(&powers, &lamps).is_open() {
        lamps.iter_mut().for_each(|lamp| lamp.drift = lamp.drift.hypot(exposure.half_share()));
    }
    lamps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Range;

    const TEN: PerPhoto = PerPhoto { range: Range { low: 0.9, nominal: 1.0, high: 1.1 }, varies: true };

    fn lamp(drift: f64) -> Lamp {
        Lamp { name: "lamp".into(), light: 0, power: 2.0, drift }
    }

    fn exposing(exposure: PerPhoto) -> Exposing {
        Exposing { exposure, drifts: vec![0.1] }
    }

    #[test]
    fn factors_fill_the_written_range_and_nothing_else() {
        let told = exposing(TEN);
        let factors: Vec<f64> = (0..2000).map(|photo| told.factor(7, photo)).collect();
        let (least, most) = factors.iter().fold((9.0_f64, 0.0_f64), |(a, b), &f| (a.min(f), b.max(f)));
        let mean = factors.iter().sum::<f64>() / 2000.0;
        assert!((0.9..0.901).contains(&least) && (1.099..=1.1).contains(&most), "{least} {most}");
        // Uniform: the mean of 2000 draws within ± 0.1 has a standard deviation of 0.0013.
        assert!((mean - 1.0).abs() < 0.006, "{mean}");
        assert_eq!(told.factor(7, 3), told.factor(7, 3));
        assert_ne!(told.factor(7, 3), told.factor(8, 3));
        let silent = exposing(PerPhoto { varies: false, ..TEN });
        assert_eq!((silent.factor(7, 3), silent.metered(0.5, 1.0)), (1.0, None));
    }

    #[test]
    fn a_metered_photo_lies_beside_its_nominal_grey() {
        let dark = PerPhoto { range: Range { low: 0.4, nominal: 0.5, high: 0.6 }, varies: true };
        let told = exposing(dark);
        let greys: Vec<f64> = (0..200).filter_map(|photo| told.metered(0.6, told.factor(1, photo))).collect();
        assert!(greys.len() == 200 && greys.iter().all(|g| (0.24..=0.36).contains(g)), "{greys:?}");
    }

    /// Two uniform errors of ± 0.1 have together the variance of one of ± 0.1 √2. What is known of a lamp by itself is the spec's.
    #[test]
    fn steady_lamps_drift_by_the_exposure_too() {
        let widened_drift = |drift: f64, exposure: &PerPhoto| widened(vec![lamp(drift)], exposure)[0].drift;
        assert!((widened_drift(0.1, &TEN) - 0.1 * 2f64.sqrt()).abs() < 1e-12);
        assert_eq!(widened_drift(0.1, &PerPhoto { varies: false, ..TEN }), 0.1);
        assert_eq!(widened_drift(0.9, &TEN), 0.9, "an open lamp");
        assert_eq!(exposing(TEN).drift_of(&lamp(0.14)), 0.1);
    }
}
