//! A spec as an editor asks about it: trees, and what every number in them was taken for.
//!
//! In: the name of a spec and a way to read texts. Out: [`Survey`], also of a spec with faults. The design itself is that
//! of [`load`](super::load()); nothing here resolves anything.

use super::interval::bounds;
use super::load::{Loaded, Outcome, Read, load_with};
use super::model::{Expr, Sense};
use super::scope::{Resolver, Use};
use crate::diag::Span;
use crate::syntax::ast::{self, Stmt};
use crate::units::{Quantity, Range};

/// What is known of a spec.
#[derive(Debug)]
pub struct Survey {
    pub loaded: Loaded,
    /// What could be read of every file, in the order of the sources; nothing of one that was not found.
    pub trees: Vec<ast::File>,
    /// In the order of their places; one for each place, that of the first piece where a part is placed several times.
    pub readings: Vec<Reading>,
    /// Whether any file has an assembly; one that only lends parts to others has none.
    pub has_assembly: bool,
}

/// What a number of the spec was taken for, in mm, rad, px or as a ratio.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    pub span: Span,
    pub quantity: Quantity,
    pub range: Range,
    pub mmc: f64,
    pub lmc: f64,
    /// `None` for arithmetic and for what is no size of a part.
    pub sense: Option<Sense>,
    /// `gear.bore.d`
    pub name: Option<String>,
}

/// Readings as they come in. MMC and LMC are known only when all parts are.
#[derive(Debug, Clone, Default)]
pub struct Readings {
    open: Vec<(Span, Quantity, Expr)>,
    settled: Vec<Reading>,
}

/// Loads the spec at `path`, and keeps what an editor asks about.
pub fn survey(path: &str, read: Read) -> Survey {
    let Outcome { loaded, trees, resolver } = load_with(path, read, &[], Resolver::with_readings());
    let mut readings = resolver.readings.map(|r| r.settled).unwrap_or_default();
    let place = |r: &Reading| (r.span.file, r.span.start, r.span.end);
    readings.sort_by_key(place);
    readings.dedup_by_key(|r| place(r));
    let mut by_file = vec![ast::File::default(); loaded.sources.files.len()];
    for tree in trees {
        if let Some(slot) = by_file.get_mut(tree.file as usize) {
            *slot = tree.tree;
        }
    }
    let is_assembly = |line: &ast::Line| matches!(line.stmt, Stmt::Assembly { .. });
    let has_assembly = by_file.iter().flat_map(|f| &f.lines).any(is_assembly);
    Survey { loaded, trees: by_file, readings, has_assembly }
}

impl Resolver {
    /// Keeps what a number was taken for, if anybody wants to know.
    pub fn note_reading(&mut self, span: Span, quantity: Quantity, expr: &Expr) {
        if let Some(readings) = &mut self.readings {
            readings.open.push((span, quantity, expr.clone()));
        }
    }

    /// The same for a number that is not sampled with the parts.
    pub fn note_range(&mut self, span: Span, quantity: Quantity, range: Range) {
        if let Some(readings) = &mut self.readings {
            let (mmc, lmc) = (range.nominal, range.nominal);
            readings.settled.push(Reading { span, quantity, range, mmc, lmc, sense: None, name: None });
        }
    }

    /// Works out the limits of what was noted so far: to be called when the senses of all dimensions are known.
    pub fn settle_readings(&mut self) {
        if self.readings.is_none() {
            return;
        }
        let Some(mut readings) = self.readings.take() else { return };
        let mmc: Vec<f64> = self.dims.iter().map(|d| d.mmc).collect();
        let lmc: Vec<f64> = self.dims.iter().map(|d| d.lmc).collect();
        for (span, quantity, expr) in readings.open.drain(..) {
            let range =
                Range { nominal: expr.eval(&self.nominal), ..bounds(&expr, &|id| self.dims[id.0 as usize].range) };
            let (sense, name) = match expr {
                Expr::Dim(id) => {
                    let dim = &self.dims[id.0 as usize];
                    (Some(dim.sense), (dim.span == span).then(|| dim.name.clone()))
                }
                _ => (None, None),
            };
            let (mmc, lmc) = (expr.eval(&mmc), expr.eval(&lmc));
            readings.settled.push(Reading { span, quantity, range, mmc, lmc, sense, name });
        }
        self.readings = Some(readings);
    }

    /// Reads the named dimensions that nothing has read so far: of the part at hand, or those outside all parts. What is
    /// wrong with them is not reported, and they stay unused.
    pub fn read_unread_names(&mut self, local: bool) {
        if self.readings.is_none() {
            return;
        }
        if !local {
            self.locals.clear();
        }
        let (reported, used) = (self.diagnostics.len(), std::mem::take(&mut self.used));
        for name in self.unread_names(local) {
            let name = ast::Name { text: name, span: Span::default() };
            let segments = vec![ast::Segment { name, index: None }];
            self.lookup(&ast::Path { segments, span: Span::default() }, Use::Shared);
        }
        self.diagnostics.truncate(reported);
        self.used = used;
    }
}
