//! Heights of the nodes of a tree that grows to the right.
//!
//! In: parents and heights. Out: the middle of every node. After Reingold and Tilford (1981), with contours level by level
//! for nodes of different heights: children stand as close as their subtrees allow, a parent in the middle of its children,
//! and equal subtrees are drawn equally.

/// Between two siblings, and between nodes of different families (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct Gaps {
    pub siblings: f64,
    pub families: f64,
}

/// The middle of every node, the root's being 0. `parents` stand before their children, the root first; `heights` in px.
pub(super) fn tidy(parents: &[Option<usize>], heights: &[f64], gaps: Gaps) -> Vec<f64> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); parents.len()];
    parents.iter().enumerate().for_each(|(i, p)| p.iter().for_each(|p| children[*p].push(i)));
    let mut contours: Vec<Contour> = vec![Vec::new(); parents.len()];
    let mut shifts = vec![0.0; parents.len()];
    for node in (0..parents.len()).rev() {
        let below: Vec<Contour> = children[node].iter().map(|c| std::mem::take(&mut contours[*c])).collect();
        let (mut contour, at) = join(&below, gaps);
        let middle = (at.first().unwrap_or(&0.0) + at.last().unwrap_or(&0.0)) / 2.0;
        children[node].iter().zip(&at).for_each(|(c, y)| shifts[*c] = y - middle);
        contour.iter_mut().flatten().for_each(|y| *y -= middle);
        contour.insert(0, [-heights[node] / 2.0, heights[node] / 2.0]);
        contours[node] = contour;
    }
    let mut middles = vec![0.0; parents.len()];
    (0..parents.len()).for_each(|i| middles[i] = parents[i].map_or(0.0, |p| middles[p]) + shifts[i]);
    middles
}

/// Of a subtree: from where to where it reaches, level by level, from the height of its root.
type Contour = Vec<[f64; 2]>;

/// Sets subtrees one below the other: their common contour, and the heights of their roots.
fn join(subtrees: &[Contour], gaps: Gaps) -> (Contour, Vec<f64>) {
    let mut joint: Contour = Vec::new();
    let mut at = Vec::new();
    for subtree in subtrees {
        let gap = |level: usize| if level == 0 { gaps.siblings } else { gaps.families };
        let clear = |(level, (above, below)): (usize, (&[f64; 2], &[f64; 2]))| above[1] + gap(level) - below[0];
        let need = joint.iter().zip(subtree).enumerate().map(clear).fold(f64::NEG_INFINITY, f64::max);
        let y = if need.is_finite() { need } else { 0.0 };
        for (level, [low, high]) in subtree.iter().enumerate() {
            match joint.get_mut(level) {
                Some(reach) => reach[1] = high + y,
                None => joint.push([low + y, high + y]),
            }
        }
        at.push(y);
    }
    (joint, at)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAPS: Gaps = Gaps { siblings: 2.0, families: 3.0 };

    #[test]
    fn a_parent_stands_in_the_middle_of_its_children() {
        let middles = tidy(&[None, Some(0), Some(0), Some(0)], &[4.0; 4], GAPS);
        assert_eq!(middles, [0.0, -6.0, 0.0, 6.0]);
    }

    #[test]
    fn a_chain_is_straight() {
        assert_eq!(tidy(&[None, Some(0), Some(1)], &[4.0, 10.0, 1.0], GAPS), [0.0; 3]);
    }

    /// A root whose two children have two and three children of uneven heights.
    #[test]
    fn nodes_of_a_level_keep_their_distance_and_equal_subtrees_are_equal() {
        let parents = [None, Some(0), Some(0), Some(1), Some(1), Some(2), Some(2), Some(2)];
        let heights = [4.0, 4.0, 8.0, 2.0, 6.0, 2.0, 6.0, 4.0];
        let y = tidy(&parents, &heights, GAPS);
        let apart = |a: usize, b: usize| y[b] - y[a] - (heights[a] + heights[b]) / 2.0;
        assert!(apart(1, 2) >= 2.0 - 1e-9 && apart(4, 5) >= 3.0 - 1e-9);
        assert!([(3, 4), (5, 6), (6, 7)].iter().all(|(a, b)| apart(*a, *b) >= 2.0 - 1e-9));
        assert_eq!(y[4] - y[3], y[6] - y[5]);
        assert!((y[1] + y[2]).abs() < 1e-9 && (y[3] + y[4] - 2.0 * y[1]).abs() < 1e-9);
    }
}
