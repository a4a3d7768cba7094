//! Which way material goes when a dimension grows, and so what MMC and LMC are.
//!
//! A size of an `add` or a `keep` is external: material grows with it. A size of a `cut` is internal. Where a size is an
//! expression, each dimension in it has the sign of its derivative. A dimension used both ways, or only for a position,
//! is neutral: its MMC and LMC are its nominal value unless the spec states them.

use super::model::{DimId, Expr, Op, Part, Sense};
use super::part::shape_exprs;
use super::scope::Resolver;
use crate::diag::Diagnostic;
use crate::iso;
use crate::units::Range;

/// Ways in which one dimension is used.
#[derive(Debug, Clone, Copy, Default)]
struct Uses {
    external: bool,
    internal: bool,
}

impl Resolver {
    /// Sets sense, MMC and LMC of every dimension from the parts that use it.
    pub fn senses(&mut self, parts: &[Part]) {
        let mut uses = vec![Uses::default(); self.dims.len()];
        for feature in parts.iter().flat_map(|part| &part.features) {
            for copy in &feature.copies {
                for expr in shape_exprs(&mut copy.shape.clone()) {
                    let sign = if feature.op == Op::Cut { -1.0 } else { 1.0 };
                    self.signs(expr, sign, &mut uses);
                }
            }
        }
        for (id, uses) in uses.into_iter().enumerate() {
            self.settle(id, uses);
        }
    }

    /// Walks an expression with the sign of its derivative so far.
    fn signs(&self, expr: &Expr, sign: f64, uses: &mut [Uses]) {
        match expr {
            Expr::Const(_) => {}
            Expr::Dim(DimId(id)) => {
                let used = &mut uses[*id as usize];
                used.external |= sign > 0.0;
                used.internal |= sign < 0.0;
            }
            Expr::Neg(a) => self.signs(a, -sign, uses),
            Expr::Add(a, b) => {
                self.signs(a, sign, uses);
                self.signs(b, sign, uses);
            }
            Expr::Sub(a, b) => {
                self.signs(a, sign, uses);
                self.signs(b, -sign, uses);
            }
            Expr::Mul(a, b) => {
                self.signs(a, sign * self.nominal_of(b), uses);
                self.signs(b, sign * self.nominal_of(a), uses);
            }
            Expr::Div(a, b) => {
                self.signs(a, sign * self.nominal_of(b), uses);
                self.signs(b, -sign * self.nominal_of(a) * self.nominal_of(b).powi(2), uses);
            }
        }
    }

    fn nominal_of(&self, expr: &Expr) -> f64 {
        let values: Vec<f64> = self.dims.iter().map(|d| d.range.nominal).collect();
        expr.eval(&values)
    }

    fn settle(&mut self, id: usize, uses: Uses) {
        let sense = match (uses.external, uses.internal) {
            (true, false) => Sense::External,
            (false, true) => Sense::Internal,
            _ => Sense::Neutral,
        };
        let Range { low, nominal, high } = self.dims[id].range;
        let remark = self.remarks[id].clone();
        let by_sense = match sense {
            Sense::External => [high, low],
            Sense::Internal => [low, high],
            Sense::Neutral => [nominal, nominal],
        };
        let [mmc, lmc] = remark.states.unwrap_or(by_sense);
        let dim = &mut self.dims[id];
        (dim.sense, dim.mmc, dim.lmc) = (sense, mmc, lmc);
        if remark.states.is_some() && sense != Sense::Neutral && [mmc, lmc] != by_sense {
            self.against_sense(id, [mmc, lmc]);
        }
        if let Some((class, span)) = remark.fit {
            self.doubt_class(&class, span, sense);
        }
    }

    fn against_sense(&mut self, id: usize, [mmc, lmc]: [f64; 2]) {
        let dim = &self.dims[id];
        let (body, extreme) = if dim.sense == Sense::Internal { ("a hole", "smallest") } else { ("a body", "largest") };
        let message =
            format!("{body} has most material when it is {extreme}: mmc {mmc} and lmc {lmc} are the wrong way round");
        let help = format!("swap them: `{{ mmc {lmc}, nominal {}, lmc {mmc} }}`", dim.range.nominal);
        let span = dim.span;
        self.report(Diagnostic::error("E0305", span, message).label("against the sense of the feature").help(help));
    }

    fn doubt_class(&mut self, class: &str, span: crate::diag::Span, sense: Sense) {
        let hole = iso::is_hole_class(class);
        let (kind, used, meant) = match sense {
            Sense::Internal if !hole => ("a shaft", "a hole", class.to_uppercase()),
            Sense::External if hole => ("a hole", "a body", class.to_lowercase()),
            _ => return,
        };
        let message = format!("`{class}` is the class of {kind}, and this is the size of {used}");
        self.report(
            Diagnostic::warning("W0304", span, message)
                .label(format!("used for {used}"))
                .help(format!("did you mean `{meant}`?")),
        );
    }
}
