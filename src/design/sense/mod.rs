//! Which way material goes when a dimension grows, and so what MMC and LMC are.
//!
//! A size of an `add` or a `keep` is external: material grows with it. A size under an odd number of cuts is internal.
//! Where a size is an expression, each dimension in it has the sign of its derivative; a dimension of an outline has that
//! of the outline's area. Two cases need more than signs: a dimension used both ways (`add` a slab of height t, `cut` a
//! pocket of depth t - 3), and one that also moves features (steps stacked on one another). For those the part's boundary is
//! asked where it goes: if all of it goes one way, that is the sense. If it goes both ways, a dimension that is the size
//! of something keeps that size's sense, for what it moves only moves; one that is a size both ways has no sense and is
//! reported, unless the spec states its MMC and LMC. A dimension that only moves features is neutral.

mod body;
mod motion;
#[cfg(test)]
mod tests;

use super::model::{DimId, Expr, Part, Sense, Shape};
use super::scope::Resolver;
use crate::diag::{Applicability, Diagnostic, Fix, Span};
use crate::iso;
use crate::units::Range;
use body::{Body, Leaf};
use motion::{Motion, Nominal};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// A dimension of a part, the same in all its pieces.
type Place = ([u32; 3], usize);

/// Ways in which one dimension is used.
#[derive(Debug, Clone, Default)]
struct Uses {
    /// As a size that adds material, and as one that takes it.
    external: bool,
    internal: bool,
    /// In a pose.
    moves: bool,
    /// Where the boundary goes; asked only where the signs do not settle it.
    motion: Motion,
}

impl Uses {
    fn unsettled(&self) -> bool {
        self.moves || (self.external && self.internal)
    }

    fn sense(&self) -> Sense {
        let one_way = |external: bool, internal: bool| match (external, internal) {
            (true, false) => Some(Sense::External),
            (false, true) => Some(Sense::Internal),
            _ => None,
        };
        let seen = one_way(self.motion.gained.is_some(), self.motion.lost.is_some());
        seen.or(one_way(self.external, self.internal)).unwrap_or(Sense::Neutral)
    }
}

impl Resolver {
    /// Sets sense, MMC and LMC of every dimension from the parts that use it.
    pub fn senses(&mut self, parts: &[Part]) {
        let mut uses = vec![Uses::default(); self.dims.len()];
        let mut values = self.nominal.clone();
        for part in parts {
            Body::of(part).leaves.iter().for_each(|leaf| self.leaf_uses(leaf, &mut values, &mut uses));
        }
        self.motions(parts, &values, &mut uses);
        for (id, uses) in uses.into_iter().enumerate() {
            self.settle(id, uses);
        }
    }

    fn leaf_uses(&self, leaf: &Leaf, values: &mut [f64], uses: &mut [Uses]) {
        let sign = if leaf.void { -1.0 } else { 1.0 };
        leaf.pose_dims().into_iter().for_each(|id| uses[id.0 as usize].moves = true);
        let outlined = leaf.outline_dims();
        for expr in leaf.shape.exprs() {
            self.signs(expr, sign, &|id| !outlined.contains(&id), uses);
        }
        if let Shape::Prism { h: super::model::Extent::Length(h), .. } = leaf.shape {
            self.signs(h, sign, &|_| true, uses);
        }
        for id in outlined {
            let [grows, shrinks] =
                motion::outline_growth(leaf, id, self.dims[id.0 as usize].range.half_width(), values);
            let used = &mut uses[id.0 as usize];
            used.external |= if leaf.void { shrinks } else { grows };
            used.internal |= if leaf.void { grows } else { shrinks };
        }
    }

    /// Asks the boundaries of parts about the dimensions that signs alone do not settle, once for all pieces of a part, and of
    /// all parts on all threads.
    fn motions(&self, parts: &[Part], values: &[f64], uses: &mut [Uses]) {
        let (mut asked, mut first, mut all) = (BTreeSet::new(), Vec::new(), Vec::new());
        for (index, part) in parts.iter().enumerate() {
            let body = Body::of(part);
            let dims = body.leaves.iter().flat_map(|leaf| leaf.pose_dims().into_iter().chain(leaf.size_dims()));
            let open: BTreeSet<DimId> = dims.filter(|id| uses[id.0 as usize].unsettled()).collect();
            all.push((self.places(&open), open));
            if asked.insert(part.name.as_str()) {
                first.push((index, body));
            }
        }
        let widths: Vec<f64> = self.dims.iter().map(|dim| dim.range.half_width()).collect();
        let answer = |values: &mut Vec<f64>, (index, body): (usize, Body)| {
            let (places, open) = &all[index];
            let nominal = Nominal::of(body, values, open.len());
            let ask = |(place, id): (&Place, &DimId)| (*place, nominal.motion(*id, widths[id.0 as usize], values));
            (parts[index].name.as_str(), places.iter().zip(open).map(ask).collect::<BTreeMap<Place, Motion>>())
        };
        let known: Vec<(&str, BTreeMap<Place, Motion>)> =
            first.into_par_iter().map_init(|| values.to_vec(), answer).collect();
        let known: BTreeMap<&str, BTreeMap<Place, Motion>> = known.into_iter().collect();
        for (part, (places, open)) in parts.iter().zip(&all) {
            for (place, id) in places.iter().zip(open) {
                let Some(Motion { gained, lost }) = known[part.name.as_str()].get(place).cloned() else { continue };
                let seen = &mut uses[id.0 as usize].motion;
                seen.gained = seen.gained.take().or(gained);
                seen.lost = seen.lost.take().or(lost);
            }
        }
    }

    /// What names a dimension of a part in all its pieces: where it is written, and which of the copies there it is.
    fn places(&self, dims: &BTreeSet<DimId>) -> Vec<Place> {
        let mut counts: BTreeMap<[u32; 3], usize> = BTreeMap::new();
        let place = |id: &DimId| {
            let Span { file, start, end } = self.dims[id.0 as usize].span;
            let count = counts.entry([file, start, end]).or_default();
            *count += 1;
            ([file, start, end], *count)
        };
        dims.iter().map(place).collect()
    }

    /// Walks an expression with the sign of its derivative so far, counting the dimensions that `counts` lets through.
    fn signs(&self, expr: &Expr, sign: f64, counts: &dyn Fn(DimId) -> bool, uses: &mut [Uses]) {
        let nominal = |e: &Expr| e.eval(&self.nominal);
        match expr {
            Expr::Const(_) => {}
            Expr::Dim(id) if counts(*id) => {
                let used = &mut uses[id.0 as usize];
                used.external |= sign > 0.0;
                used.internal |= sign < 0.0;
            }
            Expr::Dim(_) => {}
            Expr::Neg(a) => self.signs(a, -sign, counts, uses),
            Expr::Add(a, b) => {
                self.signs(a, sign, counts, uses);
                self.signs(b, sign, counts, uses);
            }
            Expr::Sub(a, b) => {
                self.signs(a, sign, counts, uses);
                self.signs(b, -sign, counts, uses);
            }
            Expr::Mul(a, b) => {
                self.signs(a, sign * nominal(b), counts, uses);
                self.signs(b, sign * nominal(a), counts, uses);
            }
            Expr::Div(a, b) => {
                self.signs(a, sign * nominal(b), counts, uses);
                self.signs(b, -sign * nominal(a), counts, uses);
            }
        }
    }

    fn settle(&mut self, id: usize, uses: Uses) {
        let sense = uses.sense();
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
        match remark.states {
            Some(_) if sense != Sense::Neutral && [mmc, lmc] != by_sense => self.against_sense(id, [mmc, lmc]),
            None if sense == Sense::Neutral && uses.external && uses.internal => self.ambiguous(id, &uses),
            _ => {}
        }
        if let Some((class, span)) = remark.fit {
            self.doubt_class(&class, span, sense);
        }
    }

    /// A size both ways, on a boundary that goes both ways.
    fn ambiguous(&mut self, id: usize, uses: &Uses) {
        let (Some(gained), Some(lost)) = (&uses.motion.gained, &uses.motion.lost) else { return };
        let dim = &self.dims[id];
        let unit = self.file_scale(dim.quantity, dim.span);
        let shown = |v: f64| super::dimension::trim(v / unit);
        let Range { low, nominal, high } = dim.range;
        let message = format!(
            "no one size of `{}` has most material: `{}` gains some where `{}` loses some",
            dim.name, gained.face, lost.face
        );
        let [low, nominal, high] = [low, nominal, high].map(shown);
        let stated = |mmc: f64, lmc: f64| format!("{{ mmc {mmc}, nominal {nominal}, lmc {lmc} }}");
        let [larger, smaller] = [stated(high, low), stated(low, high)];
        let diagnostic = Diagnostic::warning("W0311", dim.span, message)
            .label("MMC and LMC are taken as its nominal size")
            .suggest("most material when it is largest", dim.span, larger)
            .suggest("most material when it is smallest", dim.span, smaller);
        self.report(match gained.span == lost.span {
            true => diagnostic.also(gained.span, "gains material and loses some when it grows"),
            false => diagnostic
                .also(gained.span, "gains material when it grows")
                .also(lost.span, "loses material when it grows"),
        });
    }

    fn against_sense(&mut self, id: usize, [mmc, lmc]: [f64; 2]) {
        let dim = &self.dims[id];
        let (body, extreme) = if dim.sense == Sense::Internal { ("a hole", "smallest") } else { ("a body", "largest") };
        let message =
            format!("{body} has most material when it is {extreme}: mmc {mmc} and lmc {lmc} are the wrong way round");
        let fault = Diagnostic::error("E0305", dim.span, message).label("against the sense of the feature");
        self.report(match self.remarks[id].state_words {
            Some([first, second]) => {
                let fix = Fix::new("swap them", Applicability::MachineApplicable);
                fault.with_fix(fix.edit(first, "lmc").edit(second, "mmc"))
            }
            None => fault.help("swap them"),
        });
    }

    fn doubt_class(&mut self, class: &str, span: crate::diag::Span, sense: Sense) {
        let hole = iso::is_hole_class(class);
        let (kind, used, meant) = match sense {
            Sense::Internal if !hole => ("a shaft", "a hole", class.to_uppercase()),
            Sense::External if hole => ("a hole", "a body", class.to_lowercase()),
            _ => return,
        };
        let message = format!("`{class}` is the class of {kind}, and this is the size of {used}");
        self.report(Diagnostic::warning("W0304", span, message).label(format!("used for {used}")).meant(span, &meant));
    }
}
