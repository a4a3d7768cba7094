//! Interference within tolerance, with the dimension that would cure it (W0502).
//!
//! In: contacts whose faces can enter each other and what each dimension takes at the worst. Out: one warning per placement
//! and kind, for the contact where most is missing; a note names the other copies. What is offered as a cure is worked out, never guessed: a limit that
//! alone leaves no interference, cut so that pasting it is safe.

use super::check::{face_name, full, hollow};
use super::contact::{Contact, ContactKind, Tight};
use super::liaison::Liaison;
use super::play::Share;
use crate::design::model::{Design, DimId, Expr};
use crate::diag::{Diagnostic, Span};
use crate::solid::Solid;
use crate::units::Quantity;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Planes that can enter each other by less than this (mm) are not worth a warning.
const FLUSH: f64 = 1e-3;
/// Shortfalls that differ by less than this (mm) are equal: the first is told.
const SAME: f64 = 1e-9;
/// A zone or limit that is cut to less than this share of itself cannot be held for the price.
const HOLDABLE: f64 = 0.1;
/// Contributors named in a note.
const NAMED: usize = 4;

/// W0502, in the order of the components whose placement is most to blame.
pub(crate) fn warnings(design: &Design, solids: &[Arc<Solid>], liaison: &Liaison, tight: &[Tight]) -> Vec<Diagnostic> {
    let axes = axes(design);
    let mut worst: BTreeMap<Told, Worst> = BTreeMap::new();
    for tight in tight {
        let Some(contact) =
            liaison.between(tight.a.component, tight.b.component).find(|c| c.a == tight.a && c.b == tight.b)
        else {
            continue;
        };
        let flat = contact.kind == ContactKind::Plane;
        let case = Case { contact, shares: &tight.shares, axes: &axes, missing: -contact.play[0] };
        if flat && case.missing < FLUSH {
            continue;
        }
        let owner = case.owner();
        // Pieces of one part that rest alike are told of once, and so are copies of one placement.
        let component = &design.components[owner];
        let part = &design.parts[component.part].name;
        let key = if flat { Told::Flat(part) } else { Told::Round(component.span.file, component.span.start, part) };
        let found = worst.entry(key).or_insert_with(|| Worst { owner, case, alike: BTreeSet::new() });
        found.alike.insert(owner);
        if found.case.missing < case.missing - SAME {
            (found.owner, found.case) = (owner, case);
        }
    }
    let mut worst: Vec<(bool, Worst)> = worst.into_iter().map(|(told, w)| (matches!(told, Told::Flat(_)), w)).collect();
    worst.sort_by_key(|(flat, w)| (*flat, w.owner));
    worst.iter().map(|(flat, w)| w.diagnostic(design, solids, *flat)).collect()
}

/// What one warning is for.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Told<'a> {
    /// Where the placement is written, and of which part.
    Round(u32, u32, &'a str),
    /// A part by name.
    Flat(&'a str),
}

/// The worst case of one warning.
struct Worst<'a> {
    owner: usize,
    case: Case<'a>,
    /// All components that have such a case.
    alike: BTreeSet<usize>,
}

impl Worst<'_> {
    fn diagnostic(&self, design: &Design, solids: &[Arc<Solid>], flat: bool) -> Diagnostic {
        let told = self.case.diagnostic(design, solids, self.owner, flat);
        let others = self.alike.iter().filter(|c| **c != self.owner);
        let others: Vec<String> = others.map(|c| format!("`{}`", design.components[*c].name)).collect();
        let few = others.len().min(NAMED);
        match others.len() {
            0 => told,
            n if n > few => told.note(format!("so can {} and {} others", others[..few].join(", "), n - few)),
            _ => told.note(format!("so can {}", others.join(", "))),
        }
    }
}

/// The axis of a component's placement (0..3 along, 3..6 about) that each dimension is.
type Axes = BTreeMap<DimId, (usize, usize)>;

fn axes(design: &Design) -> Axes {
    let mut axes = Axes::new();
    for (component, c) in design.components.iter().enumerate() {
        for (axis, expr) in c.pose.t.iter().chain(&c.pose.r).enumerate() {
            // A name shared with a size is not the placement's alone to tighten.
            let own = |dim: &DimId| design.dims[dim.0 as usize].name == format!("{}.{}", c.name, AXES[axis]);
            if let Expr::Dim(dim) = expr
                && own(dim)
            {
                axes.insert(*dim, (component, axis));
            }
        }
    }
    axes
}

/// A contact whose faces can enter each other.
#[derive(Clone, Copy)]
struct Case<'a> {
    contact: &'a Contact,
    shares: &'a [Share],
    axes: &'a Axes,
    /// By how much they can (mm).
    missing: f64,
}

impl Case<'_> {
    /// The component whose placement takes most; the later one if no placement does.
    fn owner(&self) -> usize {
        let placed = self.shares.iter().find_map(|s| self.axes.get(&s.dim));
        placed.map_or(self.contact.b.component, |(component, _)| *component)
    }

    fn diagnostic(&self, design: &Design, solids: &[Arc<Solid>], owner: usize, flat: bool) -> Diagnostic {
        let span = design.components[owner].span;
        let warning = if flat {
            let [a, b] = [self.contact.a, self.contact.b].map(|f| face_name(design, solids, f));
            let message = format!("`{b}` can enter `{a}` by {:.4} mm within tolerance", self.missing);
            let [low, high] = self.contact.play;
            Diagnostic::warning("W0502", span, message)
                .label(format!("limits and zones leave {low:.4} to {high:.4} mm between them"))
        } else {
            let (hole, pin) =
                (face_name(design, solids, hollow(self.contact)), face_name(design, solids, full(self.contact)));
            Diagnostic::warning("W0502", span, format!("`{pin}` can meet `{hole}` within tolerance")).label(self.room())
        };
        let warning = match self.contributors(design) {
            Some(note) => warning.note(note),
            None => warning,
        };
        match self.cure(design) {
            // What nobody can hold is no cure: the hole is made wider instead.
            Some(Cure { kept, paste: Some(_), .. }) if kept < HOLDABLE && self.is_fit() => {
                let hole = face_name(design, solids, hollow(self.contact));
                warning.help(format!("`{hole}` wider by {} mm", rounded_up(2.0 * self.missing)))
            }
            Some(Cure { help, paste: Some((span, text)), .. }) => warning.suggest(help, span, text),
            Some(Cure { help, .. }) if flat => {
                warning.help(format!("{help}; or give that length a name with `let`, and place by it"))
            }
            Some(Cure { help, .. }) => warning.help(help),
            None => warning,
        }
    }

    /// Whether a hole is too narrow, which a wider one would mend.
    fn is_fit(&self) -> bool {
        self.contact.fit.is_some()
    }

    /// What clearance there is, and what placement takes of it.
    fn room(&self) -> String {
        let left = self.contact.gap_range[0];
        let reach: f64 = self.shares.iter().filter(|s| s.sideways).map(|s| s.loss).sum();
        if reach <= SAME {
            format!("at MMC they interfere by {:.4} mm", -left)
        } else if left < 0.0 {
            format!("at MMC they interfere by {:.4} mm, and placement allows ±{reach:.4} mm", -left)
        } else {
            // Of faces with diameters the gap is their difference.
            let left = if self.is_fit() { left / 2.0 } else { left };
            format!("at MMC {left:.4} mm of clearance is left to every side, but placement allows ±{reach:.4} mm")
        }
    }

    /// Who takes most, if there are several.
    fn contributors(&self, design: &Design) -> Option<String> {
        let name = |s: &Share| format!("`{}` takes {:.4} mm", design.dims[s.dim.0 as usize].name, s.loss);
        let named: Vec<String> = self.shares.iter().filter(|s| s.loss > FLUSH / 10.0).take(NAMED).map(name).collect();
        (named.len() > 1).then(|| named.join(", "))
    }

    /// The limit that alone leaves no interference: of a placement if one will do, with its text, else of a size.
    fn cure(&self, design: &Design) -> Option<Cure> {
        let placed = |s: &&Share| self.axes.contains_key(&s.dim);
        let zone = self.shares.iter().filter(placed).find(|s| s.loss > self.missing + SAME);
        let size = || self.shares.iter().filter(|s| !placed(s)).find(|s| s.loss > self.missing - SAME);
        let share = zone.or_else(size)?;
        let dim = &design.dims[share.dim.0 as usize];
        let axis = self.axes.get(&share.dim).map(|(_, axis)| *axis);
        let turns = dim.quantity == Quantity::Angle || axis.is_some_and(|a| a >= 3);
        let mut kept = (1.0 - self.missing / share.loss).max(0.0);
        if share.sideways && !turns {
            kept = kept.min(self.kept_across(share, (share.at - dim.range.nominal).abs()));
        }
        let (scale, unit) = if turns { (1f64.to_degrees(), " deg") } else { (1.0, "") };
        let room = (share.at - dim.range.nominal) * kept * scale;
        let nominal = (dim.range.nominal * scale * 1e6).round() / 1e6 + 0.0;
        if let Some(axis) = axis {
            let room = rounded_down(room.abs());
            // In whatever units the file is written.
            let unit = if turns { "deg" } else { "mm" };
            let text = format!("{nominal} {unit} ±{room} {unit}");
            return Some(Cure { help: format!("{} = {text}", AXES[axis]), paste: Some((dim.span, text)), kept });
        }
        let limit = nominal + rounded_down(room.abs()).parse::<f64>().unwrap_or(0.0) * room.signum();
        let limit = (limit * 1e6).round() / 1e6;
        let word = if share.at > dim.range.nominal { "at most" } else { "at least" };
        Some(Cure { help: format!("`{}` {word} {limit}{unit}", dim.name), paste: None, kept })
    }
}

/// A limit that leaves no interference.
struct Cure {
    help: String,
    /// Where it is written, and what to write there.
    paste: Option<(Span, String)>,
    /// The share of the deviation that it leaves.
    kept: f64,
}

impl Case<'_> {
    /// The share of `reach` (mm) that a zone may keep where zones across each other add up as the sides of a right angle,
    /// so that each loses less than it is wide.
    fn kept_across(&self, share: &Share, reach: f64) -> f64 {
        if share.loss > reach * (1.0 - SAME) {
            return 1.0;
        }
        let all: f64 = self.shares.iter().filter(|s| s.sideways).map(|s| s.loss).sum();
        let others = all * all - reach * reach;
        let left = (all - self.missing).max(0.0);
        (left * left - others).max(0.0).sqrt() / reach
    }
}

/// A positive number cut to two significant digits, so that what is pasted is never wider than what was worked out.
fn rounded_down(value: f64) -> String {
    let decimals = (1.0 - value.max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, MOST_DECIMALS) as usize;
    let scale = 10f64.powi(decimals as i32);
    format!("{:.decimals$}", (value * scale + 1e-9).floor() / scale)
}

/// A positive number raised to two significant digits.
fn rounded_up(value: f64) -> String {
    let decimals = (1.0 - value.max(f64::MIN_POSITIVE).log10().floor()).clamp(0.0, MOST_DECIMALS) as usize;
    let scale = 10f64.powi(decimals as i32);
    format!("{:.decimals$}", (value * scale - 1e-9).ceil() / scale)
}

/// The axes of a placement as the spec calls them.
const AXES: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
/// Finer than a nanometre nothing is said.
const MOST_DECIMALS: f64 = 6.0;
