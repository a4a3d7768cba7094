//! `outline`: a profile from corner to corner, for `prism` and `revolve`.
//!
//! In: an outline as written. Out: an [`Outline`] whose sides make one closed boundary at nominal and at the limits of
//! every dimension of its own, or diagnostics that point at the side. Resolved once: whatever is made from it shares its
//! dimensions.

use super::dimension::trim;
use super::feature::Names;
use super::fields::point_dims;
use super::model::{Corner, DimId, Expr, Outline, OutlinePath, OutlineSide};
use super::profile::{self, Fault};
use super::scope::Resolver;
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, CornerKind, Stmt};
use crate::units::Quantity;
use std::collections::BTreeSet;

/// More sides than this are a slip of the pen, and would not be checked in time.
const MAX_SIDES: usize = 200;

/// What the dimensions of the first corner are named under.
const START: &str = "start";
/// How the faces of broken corners end: `rail.base_corner`.
const CORNER: &str = "_corner";

/// An outline of the part at hand.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// `None` when it has faults, which are reported.
    outline: Option<Outline>,
    span: Span,
    used: bool,
}

/// An outline with the places of its lines, for messages.
struct Placed {
    outline: Outline,
    name: ast::Name,
    sides: Vec<Span>,
}

impl Resolver {
    /// Resolves the outlines of a part, whose dimensions are named under `path`.
    pub fn draw_outlines(&mut self, body: &ast::Body, path: &str) {
        for line in &body.lines {
            let Stmt::Outline { name, body } = &line.stmt else { continue };
            if let Some(first) = self.outlines.get(&name.text) {
                let first = first.span;
                self.duplicate("outline", name, first);
                continue;
            }
            let outline = self.outline(name, body, &Names::plain(path).child(&name.text));
            self.outlines.insert(name.text.clone(), Drawn { outline, span: name.span, used: false });
        }
    }

    /// The outline of that name; `None` if there is none, or one with faults.
    pub fn outline_named(&mut self, name: &str, span: Span) -> Option<Outline> {
        if let Some(drawn) = self.outlines.get_mut(name) {
            drawn.used = true;
            return drawn.outline.clone();
        }
        let diagnostic =
            Diagnostic::error("E0201", span, format!("no outline is named `{name}`")).label("unknown outline");
        self.report(match nearest(name, self.outlines.keys().map(String::as_str)) {
            Some(near) => diagnostic.meant(span, near),
            None => diagnostic.help(format!("draw it in the part: `outline {name} {{ from (0, 0) … }}`")),
        });
        None
    }

    pub fn warn_unused_outlines(&mut self) {
        let unused = self.outlines.iter().filter(|(_, drawn)| !drawn.used);
        let unused: Vec<(String, Span)> = unused.map(|(name, drawn)| (name.clone(), drawn.span)).collect();
        for (name, span) in unused {
            self.unused("outline", &name, span);
        }
    }

    /// Whether an outline to be turned lies on the right side of its axis; reports if not.
    pub fn right_of_axis(&mut self, outline: &Outline, span: Span) -> bool {
        /// Rounding of an arc that touches the axis (mm).
        const ON_AXIS: f64 = -1e-9;
        let corners = std::iter::once(&outline.start).chain(outline.sides.iter().map(|s| &s.to));
        let corners = corners.map(|p| self.lowest(&p[0]));
        let stretches = profile::trace(outline, &self.nominal).unwrap_or_default();
        let least = corners.chain(stretches.iter().map(profile::Stretch::least_x)).fold(f64::INFINITY, f64::min);
        if least >= ON_AXIS {
            return true;
        }
        let message = format!("the outline reaches {} mm beyond the axis it is turned about", trim(-least));
        self.report(
            Diagnostic::error("E0213", span, message)
                .label("x is the distance from the axis")
                .help("keep every x at 0 or above, within its limits too"),
        );
        false
    }

    /// Whether the sides of an outline to be extruded leave the names of its ends free; reports if not.
    pub fn ends_are_free(&mut self, outline: &Outline, span: Span) -> bool {
        let Some(side) = outline.sides.iter().find(|s| ["top", "bottom"].contains(&s.name.as_str())) else {
            return true;
        };
        let message = format!("a prism of this outline has two faces named `{}`: a side and an end", side.name);
        self.report(
            Diagnostic::error("E0202", span, message)
                .label("its ends are `top` and `bottom`")
                .help(format!("give the side another name: `{}_side`", side.name)),
        );
        false
    }

    fn outline(&mut self, name: &ast::Name, body: &ast::Body, names: &Names) -> Option<Outline> {
        let placed = self.read_outline(name, body, names)?;
        let faults = self.outline_fault(&placed.outline);
        match faults {
            None => {
                self.warn_leaning(&placed);
                Some(placed.outline)
            }
            Some((fault, limit)) => {
                self.report_outline(&placed, fault, limit);
                None
            }
        }
    }

    fn read_outline(&mut self, name: &ast::Name, body: &ast::Body, names: &Names) -> Option<Placed> {
        let start = self.start(name, body, &names.child(START));
        let mut seen: BTreeSet<&str> = BTreeSet::new();
        let (mut sides, mut spans) = (Vec::new(), Vec::new());
        for line in &body.lines {
            let Stmt::Side(side) = &line.stmt else { continue };
            if let Some(own) = &side.name
                && (!seen.insert(&own.text) || own.text == START || own.text.ends_with(CORNER))
            {
                self.side_name_taken(own);
            }
            spans.push(line.span);
            sides.push(self.side(side, spans.len(), names));
        }
        if sides.len() > MAX_SIDES {
            let message = format!("outline `{}` has {} sides, the limit is {MAX_SIDES}", name.text, sides.len());
            self.report(Diagnostic::error("E0212", name.span, message).label("too many sides"));
            return None;
        }
        let (start, start_corner) = start?;
        let sides: Option<Vec<OutlineSide>> = sides.into_iter().collect();
        let outline = Outline { start, start_corner, sides: sides? };
        Some(Placed { outline, name: name.clone(), sides: spans })
    }

    /// Where the outline begins: its first line, and its only `from`.
    fn start(&mut self, name: &ast::Name, body: &ast::Body, names: &Names) -> Option<([Expr; 2], Corner)> {
        let starts = body.lines.iter().enumerate().filter_map(|(i, line)| match &line.stmt {
            Stmt::Start { at, corner } => Some((i, line.span, at, corner.as_ref())),
            _ => None,
        });
        let starts: Vec<_> = starts.collect();
        let Some((index, span, at, corner)) = starts.first() else {
            let message = format!("outline `{}` begins nowhere", name.text);
            let help = "begin with `from (0, 0)`";
            self.report(Diagnostic::error("E0207", name.span, message).label("`from` is missing").help(help));
            return None;
        };
        if let Some((_, again, ..)) = starts.get(1) {
            let message = "an outline begins once";
            self.report(Diagnostic::error("E0202", *again, message).label("again").also(*span, "begins here"));
        } else if *index > 0 {
            let message = "`from` is the first line of an outline";
            self.report(Diagnostic::error("E0101", *span, message).label("not the first").help("move it up"));
        }
        Some((self.corner_point(at, names)?, self.corner(*corner, names)?))
    }

    fn side_name_taken(&mut self, name: &ast::Name) {
        let message = match name.text.as_str() {
            START => format!("`{START}` is no name for a side: where an outline begins is called that"),
            text if text.ends_with(CORNER) => format!("`{text}` is no name for a side: broken corners are called that"),
            text => format!("two sides of one outline are named `{text}`"),
        };
        self.report(Diagnostic::error("E0202", name.span, message).label("taken").help("choose another name"));
    }

    fn side(&mut self, side: &ast::Side, number: usize, names: &Names) -> Option<OutlineSide> {
        let name = side.name.as_ref().map_or_else(|| number.to_string(), |n| n.text.clone());
        let names = names.child(&name);
        let to = self.corner_point(&side.to, &names);
        let path = match &side.arc {
            None => Some(OutlinePath::Line),
            Some(arc) => {
                let (left, long) = (arc.hand.text == "left", arc.long);
                let radius = self.own_size(&arc.radius, General::Basic, &names.of("radius", false));
                radius.map(|radius| OutlinePath::Arc { radius, left, long })
            }
        };
        let corner = self.corner(side.corner.as_ref(), &names);
        Some(OutlineSide { name, to: to?, path: path?, corner: corner? })
    }

    fn corner(&mut self, corner: Option<&ast::Corner>, names: &Names) -> Option<Corner> {
        let Some(corner) = corner else { return Some(Corner::Sharp) };
        let (word, make): (_, fn(Expr) -> Corner) = match corner.kind {
            CornerKind::Round => ("round", Corner::Round),
            CornerKind::Chamfer => ("chamfer", Corner::Chamfer),
        };
        self.own_size(&corner.size, General::Edge, &names.of(word, false)).map(make)
    }

    /// A size that is positive at every limit.
    fn own_size(&mut self, dim: &ast::Dim, general: General, name: &str) -> Option<Expr> {
        self.no_each(dim);
        let expr = self.dimension(dim, Quantity::Length, general, name)?;
        self.positive(&expr, name, dim.span, false).then_some(expr)
    }

    fn corner_point(&mut self, point: &ast::Point, names: &Names) -> Option<[Expr; 2]> {
        let dims = point_dims(point);
        let [x, y] = dims.as_slice() else {
            self.wrong_form(point.span, "two coordinates `(x, y)`");
            return None;
        };
        let [x, y] = [(x, "x"), (y, "y")].map(|(dim, axis)| {
            self.no_each(dim);
            self.dimension(dim, Quantity::Length, General::Basic, &names.of(axis, false))
        });
        Some([x?, y?])
    }

    fn no_each(&mut self, dim: &ast::Dim) {
        if dim.each {
            let message = "`each` belongs to a dimension of a feature, and an outline is one for all copies";
            self.report(Diagnostic::error("E0211", dim.span, message).label("not here"));
        }
    }

    /// The first fault at nominal or at a limit of one of the outline's dimensions, with that dimension.
    fn outline_fault(&self, outline: &Outline) -> Option<(Fault, Option<DimId>)> {
        let mut values = self.nominal.clone();
        match profile::trace(outline, &values) {
            Err(fault) => return Some((fault, None)),
            Ok(stretches) => {
                if let Some(fault) = profile::touching(&stretches) {
                    return Some((fault, None));
                }
            }
        }
        let count = |values: &[f64]| profile::trace(outline, values).map(|s| s.len());
        let sides = count(&values);
        for id in outline_dims(outline) {
            let i = id.0 as usize;
            for limit in [self.dims[i].range.low, self.dims[i].range.high] {
                let nominal = std::mem::replace(&mut values[i], limit);
                let found = count(&values);
                values[i] = nominal;
                match found {
                    Err(fault) => return Some((fault, Some(id))),
                    // A side that closes the outline only at a limit has no length otherwise.
                    found if found != sides => return Some((Fault::NoLength { side: outline.sides.len() }, Some(id))),
                    _ => {}
                }
            }
        }
        None
    }

    /// Warns of sides that are drawn along an axis and lean within tolerance, because each end has a dimension of its own.
    fn warn_leaning(&mut self, placed: &Placed) {
        let outline = &placed.outline;
        let corners: Vec<&[Expr; 2]> =
            std::iter::once(&outline.start).chain(outline.sides.iter().map(|s| &s.to)).collect();
        // The last pair are the ends of the side that closes the outline, if there is one.
        let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
        for (i, (from, to)) in pairs.enumerate() {
            for (axis, letter) in ["x", "y"].into_iter().enumerate() {
                let [Expr::Dim(a), Expr::Dim(b)] = [&from[axis], &to[axis]] else { continue };
                let [a, b] = [a, b].map(|id| &self.dims[id.0 as usize]);
                let straight = outline.sides.get(i).is_none_or(|s| s.path == OutlinePath::Line);
                if !straight || a.name == b.name || a.range != b.range {
                    continue;
                }
                let scale = self.file_scale(Quantity::Length, b.span);
                let [low, high] = [b.range.low, b.range.high].map(|v| trim(v / scale));
                let message = format!("outline `{}`: {} leans within tolerance", placed.name.text, placed.side(i));
                let diagnostic = Diagnostic::warning("W0312", b.span, message)
                    .label(format!("a dimension of its own, as the {letter} of the corner before"))
                    .also(a.span, "drawn by itself")
                    .help(format!(
                        "write `let {letter}_{} = {low} .. {high}` above the outline, and its name in both places",
                        i + 1
                    ));
                self.report(diagnostic);
            }
        }
    }

    fn report_outline(&mut self, placed: &Placed, fault: Fault, limit: Option<DimId>) {
        let Told { side, message, label, help } = placed.told(fault);
        let place = |side: usize| placed.sides.get(side).copied().unwrap_or(placed.name.span);
        let message = format!("outline `{}`{message}", placed.name.text);
        let span = side.map_or(placed.name.span, place);
        let mut diagnostic = Diagnostic::error("E0213", span, message).label(label).help(help);
        if let Fault::Touch { sides: [other, _], .. } = fault {
            diagnostic = diagnostic.also(place(other), "this one");
        }
        if let Some(id) = limit {
            let dim = &self.dims[id.0 as usize];
            diagnostic = diagnostic.also(dim.span, format!("so at a limit of `{}`", dim.name));
        }
        self.report(diagnostic);
    }
}

/// A fault in words.
struct Told {
    /// The side to point at; `None` for the whole outline.
    side: Option<usize>,
    message: String,
    label: &'static str,
    help: String,
}

impl Placed {
    fn told(&self, fault: Fault) -> Told {
        let told = |side: usize, message: String, label, help: &str| Told {
            side: Some(side),
            message: format!(": {message}"),
            label,
            help: help.to_string(),
        };
        match fault {
            Fault::NoLength { side } => {
                let help = match side < self.sides.len() {
                    true => "remove this side",
                    false => "write the last corner with the dimensions of the first, or leave it out",
                };
                told(side, format!("{} has no length", self.side(side)), "ends where it begins", help)
            }
            Fault::ShortRadius { side, radius, half } => {
                let [apart, radius] = [2.0 * half, radius].map(millimetres);
                let message =
                    format!("the ends of {} are {apart} mm apart, too far for a radius of {radius}", self.side(side));
                let help = format!("write `radius {}` or more", millimetres((half * 1e3).ceil() / 1e3));
                told(side, message, "the arc does not reach", &help)
            }
            Fault::BesideArc { side } => {
                let message = "only a corner between two lines can be broken".to_string();
                let help = "remove the corner's size, and draw what stands there as a side of its own";
                told(side, message, "its corner lies on an arc", help)
            }
            Fault::TwoCorners => {
                let message = "the last corner is the first one".to_string();
                let help = "give the corner's size once, behind `from`";
                told(self.sides.len() - 1, message, "ends where the outline begins", help)
            }
            Fault::NoRoom { side } => {
                let message = "breaking this corner leaves nothing of a side".to_string();
                let help = "make the corner's size smaller";
                told(side, message, "too large for the sides beside it", help)
            }
            Fault::Touch { sides: [a, b], at } => {
                let [x, y] = at.map(millimetres);
                let message = format!("{} meets {} at ({x}, {y})", self.side(b), self.side(a));
                told(b, message, "meets another side", "an outline goes round once, without touching itself")
            }
            Fault::Flat => Told {
                side: None,
                message: " encloses nothing".to_string(),
                label: "no area",
                help: "draw at least three sides, or two with an arc".to_string(),
            },
        }
    }

    /// What a side is called in a message.
    fn side(&self, side: usize) -> String {
        match self.outline.sides.get(side) {
            Some(s) if s.name != (side + 1).to_string() => format!("side `{}`", s.name),
            Some(_) => format!("side {}", side + 1),
            None => "the straight side that closes it".to_string(),
        }
    }
}

/// A length in a message, to the micrometre.
fn millimetres(v: f64) -> f64 {
    (v * 1e3).round() / 1e3
}

/// The dimensions of an outline, each once.
fn outline_dims(outline: &Outline) -> BTreeSet<DimId> {
    let mut dims = Vec::new();
    outline.exprs().into_iter().for_each(|e| e.dims(&mut dims));
    dims.into_iter().collect()
}
