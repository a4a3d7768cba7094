//! Arithmetic over dimensions, with what each operand measures.
//!
//! Lengths add to lengths and angles to angles; plain numbers scale either; a length over a length is a ratio. A bare number
//! added to a length is a length in the unit of its file.

use super::dimension::spoken;
use super::model::Expr;
use super::scope::{Resolver, Typed, Use};
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::Sum;
use crate::units::Quantity;

/// Larger expressions are a slip of the pen: names that are sums of names grow by powers of two.
const MAX_TERMS: usize = 1000;

impl Resolver {
    /// The value of what stands inside parentheses.
    pub fn sum(&mut self, sum: &Sum, usage: Use) -> Option<Typed> {
        match sum {
            Sum::Quantity(q) => self.quantity(q),
            Sum::Path(path) => self.lookup(path, usage),
            Sum::Group(inner) => self.sum(inner, usage),
            Sum::Negative(inner) => {
                let value = self.sum(inner, usage)?;
                Some(Typed { expr: folded(Expr::Neg(Box::new(value.expr))), quantity: value.quantity })
            }
            Sum::Binary(sign, a, b) => {
                let (a, b) = (self.sum(a, usage), self.sum(b, usage));
                self.binary(*sign, a?, b?, sum_span(sum))
            }
        }
    }

    fn binary(&mut self, sign: char, a: Typed, b: Typed, span: Span) -> Option<Typed> {
        if terms(&a.expr) + terms(&b.expr) > MAX_TERMS {
            let message = format!("this sum has more than {MAX_TERMS} terms, those behind its names counted");
            self.report(
                Diagnostic::error("E0212", span, message).label("too long").help("give one of its names a number"),
            );
            return None;
        }
        let quantity = match (sign, a.quantity, b.quantity) {
            ('+' | '-', x, y) if x == y => x,
            ('+' | '-', Some(q), None) | ('+' | '-', None, Some(q)) => Some(q),
            ('*', Some(Quantity::Ratio) | None, q) | ('*' | '/', q, Some(Quantity::Ratio) | None) => q,
            ('/', x, y) if x == y => Some(Quantity::Ratio),
            (_, Some(x), Some(y)) if matches!(sign, '+' | '-') => {
                self.wrong_quantity(x, y, span);
                return None;
            }
            _ => {
                let message = format!("this has no quantity: {} {sign} {}", spoken(a.quantity), spoken(b.quantity));
                self.report(
                    Diagnostic::error("E0205", span, message).label("neither a length nor an angle nor a ratio"),
                );
                return None;
            }
        };
        let additive = matches!(sign, '+' | '-');
        let scale = |t: Typed, resolver: &Self| match (additive, t.quantity, quantity) {
            (true, None, Some(q)) => scaled(t.expr, resolver.file_scale(q, span)),
            _ => t.expr,
        };
        let (a, b) = (Box::new(scale(a, self)), Box::new(scale(b, self)));
        let expr = match sign {
            '+' => Expr::Add(a, b),
            '-' => Expr::Sub(a, b),
            '*' => Expr::Mul(a, b),
            _ => Expr::Div(a, b),
        };
        Some(Typed { expr: folded(expr), quantity })
    }
}

/// Leaves of the expression.
fn terms(expr: &Expr) -> usize {
    match expr {
        Expr::Const(_) | Expr::Dim(_) => 1,
        Expr::Neg(a) => terms(a),
        Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) | Expr::Div(a, b) => terms(a) + terms(b),
    }
}

/// The expression times a constant.
pub fn scaled(expr: Expr, scale: f64) -> Expr {
    match expr {
        expr if scale == 1.0 => expr,
        Expr::Const(v) => Expr::Const(v * scale),
        expr => Expr::Mul(Box::new(Expr::Const(scale)), Box::new(expr)),
    }
}

/// An operation on two constants as a constant: nominal values hold nothing else.
fn folded(expr: Expr) -> Expr {
    let constants = match &expr {
        Expr::Neg(a) => matches!(**a, Expr::Const(_)),
        Expr::Add(a, b) | Expr::Sub(a, b) | Expr::Mul(a, b) | Expr::Div(a, b) => {
            matches!((&**a, &**b), (Expr::Const(_), Expr::Const(_)))
        }
        Expr::Const(_) | Expr::Dim(_) => false,
    };
    if constants { Expr::Const(expr.eval(&[])) } else { expr }
}

/// From the first operand to the last.
fn sum_span(sum: &Sum) -> Span {
    match sum {
        Sum::Quantity(q) => q.span,
        Sum::Path(path) => path.span,
        Sum::Negative(a) | Sum::Group(a) => sum_span(a),
        Sum::Binary(_, a, b) => Span { end: sum_span(b).end, ..sum_span(a) },
    }
}
