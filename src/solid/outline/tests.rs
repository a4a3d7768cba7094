//! Formulas of outlines against areas, and outlines that are refused.

use super::*;
use crate::design::model::{Expr, OutlineSide};

fn number(p: Point) -> [Expr; 2] {
    p.map(Expr::Const)
}

/// End, arc (radius, left, long), corner at the end.
type Drawn = (Point, Option<(f64, bool, bool)>, Corner);

fn outline(start: Point, sides: &[Drawn]) -> Outline {
    let side = |(i, (to, arc, corner)): (usize, &Drawn)| OutlineSide {
        name: (i + 1).to_string(),
        to: number(*to),
        path: match arc {
            None => OutlinePath::Line,
            Some((r, left, long)) => OutlinePath::Arc { radius: Expr::Const(*r), left: *left, long: *long },
        },
        corner: corner.clone(),
    };
    Outline { start: number(start), start_corner: Corner::Sharp, sides: sides.iter().enumerate().map(side).collect() }
}

fn holds(profile: &Profile, p: Point) -> bool {
    let inside = |i: usize| match &profile.carriers[i].0 {
        Carrier::Line { normal, offset } => dot(*normal, p) < *offset,
        Carrier::Circle { centre, radius } => length(minus(p, *centre)) < *radius,
    };
    profile.formula.holds(&inside)
}

/// Area by counting the cells of a fine lattice.
fn counted(profile: &Profile) -> f64 {
    let n = 400;
    let (low, high) = (profile.low, profile.high);
    let step = [(high[0] - low[0]) / n as f64, (high[1] - low[1]) / n as f64];
    let cell = |k: usize| [low[0] + step[0] * ((k % n) as f64 + 0.5), low[1] + step[1] * ((k / n) as f64 + 0.5)];
    (0..n * n).filter(|k| holds(profile, cell(*k))).count() as f64 * step[0] * step[1]
}

#[test]
fn formulas_have_the_area_of_their_outlines() {
    let sharp = || Corner::Sharp;
    let cases = [
        // A square, a spiral of walls, a slot with round ends, a moon, a rounded and a chamfered corner.
        (
            outline(
                [0.0, 0.0],
                &[([4.0, 0.0], None, sharp()), ([4.0, 4.0], None, sharp()), ([0.0, 4.0], None, sharp())],
            ),
            16.0,
        ),
        (
            outline(
                [0.0, 0.0],
                &[
                    [5.0, 0.0],
                    [5.0, 5.0],
                    [1.0, 5.0],
                    [1.0, 2.0],
                    [3.0, 2.0],
                    [3.0, 3.0],
                    [2.0, 3.0],
                    [2.0, 4.0],
                    [4.0, 4.0],
                    [4.0, 1.0],
                    [0.0, 1.0],
                ]
                .map(|p| (p, None, sharp())),
            ),
            15.0,
        ),
        (
            outline(
                [0.0, 0.0],
                &[
                    ([6.0, 0.0], None, sharp()),
                    ([6.0, 2.0], Some((1.0, true, false)), sharp()),
                    ([0.0, 2.0], None, sharp()),
                    ([0.0, 0.0], Some((1.0, true, false)), sharp()),
                ],
            ),
            12.0 + PI,
        ),
        (
            outline(
                [0.0, -2.0],
                &[([0.0, 2.0], Some((2.0, true, false)), sharp()), ([0.0, -2.0], Some((2.5, false, false)), sharp())],
            ),
            2.0 * PI - (2.5 * 2.5 * (0.8f64).asin() - 1.5 * 2.0),
        ),
        (
            outline(
                [0.0, 0.0],
                &[
                    ([4.0, 0.0], None, Corner::Round(Expr::Const(1.0))),
                    ([4.0, 4.0], None, Corner::Chamfer(Expr::Const(1.0))),
                    ([0.0, 4.0], None, sharp()),
                ],
            ),
            16.0 - (1.0 - PI / 4.0) - 0.5,
        ),
    ];
    for (i, (outline, area)) in cases.iter().enumerate() {
        let profile = Profile::new(outline, &[]).unwrap();
        let exact = signed_area(&pieces(outline, &[]).unwrap()).abs();
        assert!((exact - area).abs() < 1e-12, "{i}: {exact} {area}");
        assert!((counted(&profile) - area).abs() < 6e-3 * area, "{i}: {} {area}", counted(&profile));
    }
}

#[test]
fn outlines_that_cross_are_refused() {
    let bow = outline([0.0, 0.0], &[[4.0, 4.0], [4.0, 0.0], [0.0, 5.0]].map(|p| (p, None, Corner::Sharp)));
    assert!(Profile::new(&bow, &[]).unwrap_err().contains("cross"));
    let short = outline(
        [0.0, 0.0],
        &[([4.0, 0.0], Some((1.0, true, false)), Corner::Sharp), ([2.0, 3.0], None, Corner::Sharp)],
    );
    assert!(Profile::new(&short, &[]).unwrap_err().contains("more than its diameter"));
    let round =
        outline([0.0, 0.0], &[([4.0, 0.0], None, Corner::Round(Expr::Const(9.0))), ([4.0, 3.0], None, Corner::Sharp)]);
    assert!(Profile::new(&round, &[]).unwrap_err().contains("use up"));
}
