//! Things in a row, each as near to where it would like to be as the others let it.
//!
//! In: wishes, weights, and the least distances between neighbours. Out: places in the same order. By pooling adjacent
//! violators (Barlow et al. 1972): the exact least-squares answer, in one pass.

/// Places in order, `gaps[i]` at least between `i` and `i + 1`, with the least weighted sum of squared distances from
/// `wanted`. Weights are positive; there is one gap fewer than there are wishes.
pub fn spread(wanted: &[f64], weights: &[f64], gaps: &[f64]) -> Vec<f64> {
    let offsets: Vec<f64> = std::iter::once(0.0)
        .chain(gaps.iter().scan(0.0, |at, g| {
            *at += g;
            Some(*at)
        }))
        .collect();
    // Less the room that the things before need, the places must only not fall.
    let mut pools: Vec<Pool> = Vec::new();
    for ((wish, weight), offset) in wanted.iter().zip(weights).zip(&offsets) {
        let mut pool = Pool { mean: wish - offset, weight: *weight, count: 1 };
        while let Some(before) = pools.pop_if(|p| p.mean > pool.mean) {
            pool = before.with(&pool);
        }
        pools.push(pool);
    }
    let means = pools.iter().flat_map(|p| std::iter::repeat_n(p.mean, p.count));
    means.zip(&offsets).map(|(mean, offset)| mean + offset).collect()
}

/// Neighbours that have to stand as close as they may.
struct Pool {
    mean: f64,
    weight: f64,
    count: usize,
}

impl Pool {
    fn with(self, other: &Pool) -> Pool {
        let weight = self.weight + other.weight;
        let mean = (self.mean * self.weight + other.mean * other.weight) / weight;
        Pool { mean, weight, count: self.count + other.count }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_that_do_not_clash_are_granted() {
        assert_eq!(spread(&[0.0, 10.0, 20.0], &[1.0; 3], &[5.0, 5.0]), [0.0, 10.0, 20.0]);
        assert!(spread(&[], &[], &[]).is_empty());
    }

    #[test]
    fn equal_wishes_stand_symmetrically() {
        assert_eq!(spread(&[7.0; 3], &[1.0; 3], &[2.0, 2.0]), [5.0, 7.0, 9.0]);
    }

    #[test]
    fn weight_pulls_the_pool() {
        let places = spread(&[0.0, 0.0], &[3.0, 1.0], &[4.0]);
        assert_eq!(places, [-1.0, 3.0]);
    }

    /// Against a search over a fine grid of two free places.
    #[test]
    fn nothing_nearer_to_the_wishes_keeps_the_gaps() {
        let (wanted, weights, gaps) = ([3.0, 1.0, 2.5], [1.0, 2.0, 1.5], [1.0, 0.5]);
        let cost = |p: &[f64]| (0..3).map(|i| weights[i] * (p[i] - wanted[i]).powi(2)).sum::<f64>();
        let best = spread(&wanted, &weights, &gaps);
        assert!(best[1] - best[0] >= 1.0 - 1e-12 && best[2] - best[1] >= 0.5 - 1e-12);
        for a in 0..60 {
            for b in 0..60 {
                let first = f64::from(a) * 0.1 - 1.0;
                let second = first + 1.0 + f64::from(b) * 0.05;
                let third = (second + 0.5).max(wanted[2]);
                assert!(cost(&best) <= cost(&[first, second, third]) + 1e-9);
            }
        }
    }
}
