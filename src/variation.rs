//! Draws of a design's dimensions within their tolerance zones (section III of the paper).
//!
//! In: a [`Design`], a seed and the number of an image. Out: one value per dimension. Every dimension has its own stream,
//! named after it, so an edit to one dimension leaves the draws of all others as they were. Never looks at geometry.

use crate::design::model::{Design, DimId, Dimension, Expr};
use crate::rng::Stream;
use crate::units::Range;
use std::f64::consts::PI;

/// One value per dimension (mm, rad), indexed by [`crate::design::model::DimId`].
///
/// Between the limits uniformly or, unless `train.uniform`, triangularly with the mode at nominal. A turn the spec calls
/// free is drawn over a whole turn about its nominal value, whatever its range says.
pub fn draw(design: &Design, seed: u64, image: u64) -> Vec<f64> {
    let turns = free_turns(design);
    let uniform = design.train.uniform;
    design.dims.iter().zip(turns).map(|(d, turn)| draw_one(d, turn, uniform, seed, image)).collect()
}

/// One dimension's value in the draw of that number: what [`draw`] gives it.
pub fn draw_of(design: &Design, dim: DimId, free_turn: bool, image: u64) -> f64 {
    let train = &design.train;
    draw_one(&design.dims[dim.0 as usize], free_turn, train.uniform, train.seed, image)
}

/// The value below which a dimension stays with this probability (0..1).
pub fn quantile(design: &Design, dim: DimId, free_turn: bool, u: f64) -> f64 {
    let Range { low, nominal, high } = design.dims[dim.0 as usize].range;
    if free_turn {
        return nominal + PI * (2.0 * u - 1.0);
    }
    if design.train.uniform || high <= low {
        return low + (high - low) * u;
    }
    let split = (nominal - low) / (high - low);
    if u < split {
        low + ((high - low) * (nominal - low) * u).sqrt()
    } else {
        high - ((high - low) * (high - nominal) * (1.0 - u)).sqrt()
    }
}

/// Marks the dimensions that are a free turn of some component.
pub fn free_turns(design: &Design) -> Vec<bool> {
    let mut free = vec![false; design.dims.len()];
    for component in &design.components {
        for axis in 0..3 {
            if let (true, Expr::Dim(id)) = (component.free[3 + axis], &component.pose.r[axis]) {
                free[id.0 as usize] = true;
            }
        }
    }
    free
}

fn draw_one(dimension: &Dimension, free_turn: bool, uniform: bool, seed: u64, image: u64) -> f64 {
    let mut stream = Stream::new(seed, &format!("dimension {}", dimension.name), image);
    let range = dimension.range;
    if free_turn {
        range.nominal + stream.between(-PI, PI)
    } else if range.high <= range.low {
        range.nominal
    } else if uniform {
        stream.between(range.low, range.high)
    } else {
        stream.triangular(range.low, range.nominal, range.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample;

    #[test]
    fn draws_stay_within_the_limits_and_reach_both_halves() {
        let design = sample::pattern_wheel().design;
        let draws: Vec<Vec<f64>> = (0..200).map(|image| draw(&design, 7, image)).collect();
        let free = free_turns(&design);
        for (i, dim) in design.dims.iter().enumerate().filter(|(i, _)| !free[*i]) {
            assert!(draws.iter().all(|v| (dim.range.low..=dim.range.high).contains(&v[i])), "{}", dim.name);
            if dim.range.low < dim.range.nominal && dim.range.nominal < dim.range.high {
                assert!(draws.iter().any(|v| v[i] < dim.range.nominal), "{}", dim.name);
                assert!(draws.iter().any(|v| v[i] > dim.range.nominal), "{}", dim.name);
            }
        }
    }

    #[test]
    fn a_new_dimension_does_not_reshuffle_the_others() {
        let design = sample::pattern_wheel().design;
        let before = draw(&design, 3, 5);
        let mut edited = design.clone();
        edited.dims[0].name.push_str("_renamed");
        let after = draw(&edited, 3, 5);
        assert_eq!(before[1..], after[1..]);
        assert_ne!(before[0], after[0]);
    }

    #[test]
    fn one_dimension_is_drawn_as_all_are() {
        let mut design = sample::pattern_wheel().design;
        for uniform in [true, false] {
            design.train.uniform = uniform;
            let free = free_turns(&design);
            let all = draw(&design, design.train.seed, 4);
            let dims = (0..design.dims.len()).map(|i| DimId(i as u32));
            let each: Vec<f64> = dims.map(|d| draw_of(&design, d, free[d.0 as usize], 4)).collect();
            assert_eq!(all, each);
        }
    }

    #[test]
    fn quantiles_are_those_of_the_draws() {
        let mut design = sample::pattern_wheel().design;
        for uniform in [true, false] {
            design.train.uniform = uniform;
            let n = 2000;
            let mut drawn: Vec<f64> = (0..n).map(|k| draw_of(&design, DimId(0), false, k)).collect();
            drawn.sort_by(f64::total_cmp);
            let width = design.dims[0].range.high - design.dims[0].range.low;
            for share in [0.1, 0.3, 0.5, 0.8] {
                let found = drawn[(share * n as f64) as usize];
                assert!((found - quantile(&design, DimId(0), false, share)).abs() < 0.04 * width);
            }
        }
    }

    #[test]
    fn a_free_turn_covers_the_whole_circle() {
        let design = sample::pattern_wheel().design;
        let turn = free_turns(&design).iter().position(|f| *f).expect("the shaft turns freely");
        let angles: Vec<f64> = (0..400).map(|image| draw(&design, 1, image)[turn]).collect();
        let mean = angles.iter().sum::<f64>() / angles.len() as f64;
        assert!(mean.abs() < 0.3, "{mean}");
        assert!(angles.iter().any(|a| *a < -3.0) && angles.iter().any(|a| *a > 3.0));
    }
}
