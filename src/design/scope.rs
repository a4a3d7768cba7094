//! What names mean: the files' title blocks, the named dimensions, and the table of dimensions as it grows.
//!
//! In: syntax trees. Out: a [`Resolver`] that the other files of this stage extend with their own kind of statement.

use super::borrowed::Standing;
use super::model::{DimId, Dimension, Expr, Sense};
use super::outline::Drawn;
use super::survey::Readings;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::iso::General;
use crate::syntax::ast;
use crate::units::{Quantity, Range};
use std::collections::{BTreeMap, BTreeSet};

/// Names may refer to names this many times over; a bound on recursion, far above any drawing.
const MAX_CHAIN: usize = 64;

/// What the title block of a file says.
#[derive(Debug, Clone, Copy)]
pub struct Title {
    /// mm in the file's unit of length.
    pub length: f64,
    /// rad in the file's unit of angle.
    pub angle: f64,
    /// `None` for `tolerances exact`.
    pub general: Option<General>,
}

impl Default for Title {
    fn default() -> Self {
        Title { length: 1.0, angle: 1f64.to_radians(), general: None }
    }
}

/// A value with what it measures; `None` for a bare number, which takes the quantity of its surroundings.
#[derive(Debug, Clone)]
pub struct Typed {
    pub expr: Expr,
    pub quantity: Option<Quantity>,
}

/// Whether a name stands for its dimension, sampled once and shared, or for the nominal value of a new dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    Shared,
    Nominal,
}

/// A `let`, evaluated at its first use.
#[derive(Debug, Clone)]
pub struct Named {
    pub dim: ast::Dim,
    pub span: Span,
    /// Path that names its dimension: `pin_size`, `pin[2].length`.
    pub path: String,
    shared: Option<Typed>,
    nominal: Option<Typed>,
    busy: bool,
}

impl Named {
    pub fn new(name: &ast::Name, dim: &ast::Dim, path: String) -> Self {
        Named { dim: dim.clone(), span: name.span, path, shared: None, nominal: None, busy: false }
    }

    /// A name whose value is known already.
    pub fn given(name: &ast::Name, dim: &ast::Dim, path: String, shared: Typed, nominal: Typed) -> Self {
        Named { shared: Some(shared), nominal: Some(nominal), ..Named::new(name, dim, path) }
    }
}

/// What the drawing says of a dimension beyond its range.
#[derive(Debug, Clone, Default)]
pub struct Remark {
    /// MMC and LMC as stated.
    pub states: Option<[f64; 2]>,
    /// Where the words `mmc` and `lmc` stand.
    pub state_words: Option<[Span; 2]>,
    /// The fit class as stated.
    pub fit: Option<(String, Span)>,
    /// Every copy of a pattern has its own.
    pub each: bool,
}

/// The stage at work.
#[derive(Debug, Clone, Default)]
pub struct Resolver {
    /// Title block per file; the index is that of [`crate::diag::Sources`].
    pub titles: Vec<Title>,
    /// File-wide names, and those of the part at hand.
    pub globals: BTreeMap<String, Named>,
    pub locals: BTreeMap<String, Named>,
    /// The `let`s inside parts and families by name: in which, and where. Others ask for them in vain.
    pub inside: BTreeMap<String, (String, Span)>,
    /// Names that were used: what is not is warned of.
    pub used: BTreeSet<Span2>,
    /// Families that a member was taken from.
    pub used_families: BTreeSet<String>,
    /// Indices of the materials in use.
    pub used_materials: BTreeSet<usize>,
    /// Where units are written: what has the wrong one is shown with another.
    pub units: BTreeSet<Span2>,
    /// The components that stand so far, whose pieces a placement may ask for their dimensions.
    pub standing: Standing,
    /// The names of parts that nothing in their part uses: another piece's placement may.
    pub idle: BTreeMap<Span2, String>,
    /// Components that are written, and features that could not be made: neither is unknown.
    pub written: BTreeSet<String>,
    pub failed: BTreeSet<String>,
    /// Arguments that are unknown and reported, with the one that was probably meant.
    pub meant: Vec<(Span, String)>,
    /// What each name of the spec names: `part`, `material` …, for messages.
    pub kinds: BTreeMap<String, &'static str>,
    pub dims: Vec<Dimension>,
    /// One per dimension.
    pub remarks: Vec<Remark>,
    /// The nominal value of every dimension.
    pub nominal: Vec<f64>,
    /// The outlines of the part at hand.
    pub outlines: BTreeMap<String, Drawn>,
    /// Lines or features of all pieces so far, whichever are more.
    pub lines_in_all: u64,
    pub diagnostics: Vec<Diagnostic>,
    /// What every number was taken for, if somebody asked for it.
    pub readings: Option<Readings>,
    /// Names being evaluated, outermost first.
    chain: Vec<(String, Span)>,
}

/// A span as an ordered key.
pub type Span2 = (u32, u32, u32);

impl Resolver {
    /// One that keeps what it took every number for.
    pub fn with_readings() -> Self {
        Resolver { readings: Some(Readings::default()), ..Resolver::default() }
    }

    pub fn title(&self, span: Span) -> Title {
        self.titles.get(span.file as usize).copied().unwrap_or_default()
    }

    pub fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    pub fn mark_used(&mut self, span: Span) {
        self.used.insert((span.file, span.start, span.end));
    }

    pub fn is_used(&self, span: Span) -> bool {
        self.used.contains(&(span.file, span.start, span.end))
    }

    /// A new row in the table of dimensions.
    pub fn new_dim(&mut self, name: String, quantity: Quantity, range: Range, remark: Remark, span: Span) -> Expr {
        let id = DimId(self.dims.len() as u32);
        let nominal = range.nominal;
        self.nominal.push(nominal);
        self.dims.push(Dimension { name, quantity, range, sense: Sense::Neutral, mmc: nominal, lmc: nominal, span });
        self.remarks.push(remark);
        Expr::Dim(id)
    }

    /// The value a path stands for.
    pub fn lookup(&mut self, path: &ast::Path, usage: Use) -> Option<Typed> {
        let Some(name) = path.word() else { return self.borrowed(path, usage) };
        let local = self.locals.contains_key(name);
        let table = if local { &self.locals } else { &self.globals };
        let Some(named) = table.get(name) else {
            self.unknown_dimension(name, path.span);
            return None;
        };
        let cached = if usage == Use::Shared { &named.shared } else { &named.nominal };
        if let Some(value) = cached.clone() {
            let span = named.span;
            self.mark_used(span);
            return Some(value);
        }
        let named = named.clone();
        self.mark_used(named.span);
        if named.busy || self.chain.len() >= MAX_CHAIN {
            self.cyclic(name, named.span, path.span, named.busy);
            return None;
        }
        let value = self.evaluate(name, local, &named, usage);
        let entry = if local { self.locals.get_mut(name) } else { self.globals.get_mut(name) }?;
        *(if usage == Use::Shared { &mut entry.shared } else { &mut entry.nominal }) = value.clone();
        value
    }

    fn evaluate(&mut self, name: &str, local: bool, named: &Named, usage: Use) -> Option<Typed> {
        self.set_busy(name, local, true);
        self.chain.push((name.to_string(), named.span));
        let value = self.named_value(named, usage);
        self.chain.pop();
        self.set_busy(name, local, false);
        value
    }

    fn set_busy(&mut self, name: &str, local: bool, busy: bool) {
        let table = if local { &mut self.locals } else { &mut self.globals };
        if let Some(named) = table.get_mut(name) {
            named.busy = busy;
        }
    }

    /// Names of the part at hand, or of the file, whose limits nobody has asked for.
    pub fn unread_names(&self, local: bool) -> Vec<String> {
        let table = if local { &self.locals } else { &self.globals };
        table.iter().filter(|(_, named)| named.shared.is_none()).map(|(name, _)| name.clone()).collect()
    }

    fn cyclic(&mut self, name: &str, defined: Span, used: Span, busy: bool) {
        let from = self.chain.iter().position(|(n, _)| n == name).unwrap_or(0);
        let names: Vec<String> = self.chain[from..].iter().map(|(n, _)| format!("`{n}`")).collect();
        let message = if busy {
            format!("{} needs `{name}`: a circle of names has no value", names.join(" needs "))
        } else {
            format!("`{name}` is defined through more than {MAX_CHAIN} other names")
        };
        let help = format!("give one of them a number, such as `let {name} = 10`");
        self.report(
            Diagnostic::error("E0208", defined, message).label("defined here").also(used, "needed here").help(help),
        );
    }

    fn unknown_dimension(&mut self, name: &str, span: Span) {
        let known = self.locals.keys().chain(self.globals.keys()).map(String::as_str);
        let near = nearest(name, known).map(str::to_string);
        let diagnostic =
            Diagnostic::error("E0201", span, format!("no dimension is named `{name}`")).label("unknown name");
        let diagnostic = match (near, self.inside.get(name)) {
            (Some(near), None) => diagnostic.meant(span, &near),
            (None, None) if thread(name).is_some() => {
                let size = thread(name).unwrap_or_default();
                let title = format!("a thread is drawn with its major diameter: write `{size} basic`");
                diagnostic.suggest(title, span, format!("{size} basic"))
            }
            (None, None) => diagnostic.help(format!("define it above: `let {name} = 10`")),
            (near, Some((part, defined))) => {
                let diagnostic = diagnostic.also(*defined, format!("this one belongs to the pieces of `{part}`"));
                match near {
                    Some(near) => diagnostic.meant(span, &near),
                    None => diagnostic.help(format!("move that `let` out of `{part}`, to the top of the file")),
                }
            }
        };
        self.report(diagnostic);
    }
}

/// The diameter in `M6` or `M2.5`.
fn thread(name: &str) -> Option<&str> {
    let size = name.strip_prefix('M')?;
    size.parse::<f64>().is_ok_and(|d| (1.0..=100.0).contains(&d)).then_some(size)
}
