//! Expressions over the ranges of their dimensions.

use super::model::{DimId, Expr};
use crate::units::Range;

/// The range of an expression over the ranges of its dimensions, by interval arithmetic. Wider than the truth where one
/// dimension occurs twice.
pub fn bounds(expr: &Expr, range: &dyn Fn(DimId) -> Range) -> Range {
    match expr {
        Expr::Const(v) => between(*v, *v),
        Expr::Dim(id) => range(*id),
        Expr::Neg(a) => {
            let a = bounds(a, range);
            between(-a.high, -a.low)
        }
        Expr::Add(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a + b),
        Expr::Sub(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a - b),
        Expr::Mul(a, b) => corners(bounds(a, range), bounds(b, range), |a, b| a * b),
        Expr::Div(a, b) => {
            let divisor = bounds(b, range);
            if divisor.low <= 0.0 && divisor.high >= 0.0 {
                return between(f64::NEG_INFINITY, f64::INFINITY);
            }
            corners(bounds(a, range), divisor, |a, b| a / b)
        }
    }
}

/// Nobody asks an interval for its nominal value.
fn between(low: f64, high: f64) -> Range {
    Range { low, nominal: f64::NAN, high }
}

fn corners(a: Range, b: Range, f: fn(f64, f64) -> f64) -> Range {
    let all = [f(a.low, b.low), f(a.low, b.high), f(a.high, b.low), f(a.high, b.high)];
    // `min` and `max` skip NaN; a quotient without value is refused at its nominal.
    between(all.iter().copied().fold(f64::INFINITY, f64::min), all.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

/// A sum, with constants folded.
pub fn plus(a: Expr, b: Expr) -> Expr {
    match (a, b) {
        (Expr::Const(a), Expr::Const(b)) => Expr::Const(a + b),
        (a, Expr::Const(0.0)) => a,
        (Expr::Const(0.0), b) => b,
        (a, b) => Expr::Add(Box::new(a), Box::new(b)),
    }
}

/// A difference, with constants folded.
pub fn minus(a: Expr, b: Expr) -> Expr {
    match (a, b) {
        (Expr::Const(a), Expr::Const(b)) => Expr::Const(a - b),
        (a, Expr::Const(0.0)) => a,
        (Expr::Const(0.0), b) => Expr::Neg(Box::new(b)),
        (a, b) => Expr::Sub(Box::new(a), Box::new(b)),
    }
}

/// A product with a constant, folded where it can be. Cosines of right angles are exact.
pub fn times(expr: &Expr, factor: f64) -> Expr {
    /// Below this a cosine is that of a right angle.
    const RIGHT_ANGLE: f64 = 1e-15;
    let factor = if factor.abs() < RIGHT_ANGLE { 0.0 } else { factor };
    match expr {
        Expr::Const(v) => Expr::Const(v * factor),
        _ if factor == 0.0 => Expr::Const(0.0),
        expr => Expr::Mul(Box::new(expr.clone()), Box::new(Expr::Const(factor))),
    }
}

/// Half of a length, with constants folded.
pub fn half(expr: &Expr) -> Expr {
    match expr {
        Expr::Const(v) => Expr::Const(v / 2.0),
        expr => Expr::Div(Box::new(expr.clone()), Box::new(Expr::Const(2.0))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_hold_every_value_of_an_expression() {
        let dims = [Range { low: -1.0, nominal: 0.0, high: 2.0 }, Range { low: 3.0, nominal: 3.5, high: 4.0 }];
        let [a, b] = [0, 1].map(|i| Box::new(Expr::Dim(DimId(i))));
        let exprs = [
            Expr::Add(a.clone(), b.clone()),
            Expr::Sub(a.clone(), b.clone()),
            Expr::Mul(a.clone(), b.clone()),
            Expr::Div(a.clone(), b.clone()),
            Expr::Neg(a.clone()),
        ];
        for expr in exprs {
            let range = bounds(&expr, &|id| dims[id.0 as usize]);
            for (i, j) in (0..=10).flat_map(|i| (0..=10).map(move |j| (i, j))) {
                let value = expr.eval(&[dims[0].at(i as f64 / 10.0), dims[1].at(j as f64 / 10.0)]);
                assert!(range.low <= value && value <= range.high, "{expr:?} {value} {range:?}");
            }
        }
        assert_eq!(bounds(&Expr::Div(b, a), &|id| dims[id.0 as usize]).high, f64::INFINITY);
    }

    #[test]
    fn constants_fold() {
        let d = || Expr::Dim(DimId(0));
        assert_eq!(plus(Expr::Const(1.0), Expr::Const(2.0)), Expr::Const(3.0));
        assert_eq!(plus(Expr::Const(0.0), d()), d());
        assert_eq!(minus(d(), Expr::Const(0.0)), d());
        assert_eq!(times(&d(), 1e-17), Expr::Const(0.0));
        assert_eq!(half(&Expr::Const(3.0)), Expr::Const(1.5));
    }
}
