//! The shots a model is made from: draws of the assembly, each correct and with every error mode.

use super::kept::Kept;
use super::plan::Plan;
use super::shots::{self, Setup, Shot};
use crate::assembly::fault::ErrorMode;
use crate::design::model::Design;
use crate::diag::Diagnostic;
use crate::rng::Stream;

/// All shots of a number of draws.
pub struct Shots {
    pub good: Vec<Shot>,
    /// Per scene of the plan, per draw.
    pub faulty: Vec<Vec<FaultyShot>>,
}

pub struct FaultyShot {
    pub shot: Shot,
    /// Per mode of the scene, its place in the sweep (0..1).
    pub places: Vec<f64>,
}

/// Which draws: the seed of their streams and how many, of which the first `faulty` are taken in every faulty scene too.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    pub seed: u64,
    pub count: u32,
    pub faulty: u32,
}

impl Draws {
    /// Number of shots of a plan.
    pub fn shots(&self, plan: &Plan) -> usize {
        self.count as usize + self.faulty.min(self.count) as usize * plan.scenes.len()
    }
}

/// One draw's shots: correct, and in every faulty scene it is taken in.
pub struct Taken {
    pub good: Shot,
    pub faulty: Vec<FaultyShot>,
}

/// Renders every draw in every scene, or takes it from what is kept, with `done` called after each shot.
pub fn synthesise(
    design: &Design,
    setup: &Setup,
    plan: &Plan,
    modes: &[ErrorMode],
    draws: Draws,
    kept: &Kept,
    done: &dyn Fn(),
) -> Result<Shots, Vec<Diagnostic>> {
    let mut out = Shots { good: Vec::new(), faulty: plan.scenes.iter().map(|_| Vec::new()).collect() };
    for image in 0..u64::from(draws.count) {
        let scenes = if image < u64::from(draws.faulty) { &plan.scenes[..] } else { &[] };
        let taken = match kept.draw(draws.seed, image, scenes) {
            Some(taken) => {
                (0..=taken.faulty.len()).for_each(|_| done());
                taken
            }
            None => {
                let taken = take(design, setup, scenes, modes, (draws.seed, image), done)?;
                kept.keep_draw(draws.seed, image, scenes, &taken);
                taken
            }
        };
        out.good.push(taken.good);
        out.faulty.iter_mut().zip(taken.faulty).for_each(|(scene, shot)| scene.push(shot));
    }
    Ok(out)
}

/// Renders one draw.
fn take(
    design: &Design,
    setup: &Setup,
    scenes: &[Vec<usize>],
    modes: &[ErrorMode],
    (seed, image): (u64, u64),
    done: &dyn Fn(),
) -> Result<Taken, Vec<Diagnostic>> {
    let drawn = shots::draw(design, setup.station, seed, image)?;
    let mut noise = Stream::new(seed, "render", image);
    let (good, base) = shots::take_good(setup, &drawn, noise.bits());
    done();
    let mut faulty = Vec::new();
    for scene in scenes {
        let sizes: Vec<[f64; 3]> = scene.iter().map(|&m| place_in_sweep(seed, m, image)).collect();
        let faults: Vec<_> = scene.iter().map(|&m| &modes[m]).zip(sizes.iter().copied()).collect();
        let shot = shots::take_faulty(setup, &drawn, &drawn.instance(&faults), noise.bits(), &base);
        faulty.push(FaultyShot { shot, places: sizes.iter().map(|u| u[0]).collect() });
        done();
    }
    Ok(Taken { good, faulty })
}

/// Places in a mode's sweep, spread evenly over the draws by the golden ratio (additive recurrence).
fn place_in_sweep(seed: u64, mode: usize, image: u64) -> [f64; 3] {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let start = Stream::new(seed, "sweep", mode as u64).uniform();
    let mut stream = Stream::new(seed, "fault", (mode as u64) << 32 | image);
    [(start + GOLDEN * image as f64).fract(), stream.uniform(), stream.uniform()]
}
