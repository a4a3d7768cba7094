//! `assembly`: which piece of which part stands where.
//!
//! In: `root` and `place` statements. Out: components, parents before their children, each with its part, the frame it
//! is placed in and its pose with its tolerance zone.

use super::borrowed::{Asking, asked};
use super::family::Family;
use super::fields::Fields;
use super::model::{Component, Expr, Part, PoseExpr};
use super::part::PartSource;
use super::scope::{Remark, Resolver};
use super::seat::{Seat, copies};
use super::tolerance::General;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Stmt, Value};
use crate::units::{Quantity, Range};
use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;

/// More components than this are a slip of the pen.
const MAX_COMPONENTS: usize = 4096;

const AXES: [(&str, Quantity); 6] = [
    ("x", Quantity::Length),
    ("y", Quantity::Length),
    ("z", Quantity::Length),
    ("rx", Quantity::Angle),
    ("ry", Quantity::Angle),
    ("rz", Quantity::Angle),
];

/// The parts and materials that placements refer to.
pub struct Catalogue<'a> {
    pub parts: BTreeMap<&'a str, PartSource<'a>>,
    pub families: BTreeMap<&'a str, Family<'a>>,
    pub materials: BTreeMap<&'a str, usize>,
}

/// The assembly as built: one part per component, so that every piece has draws of its own.
#[derive(Default)]
pub struct Assembled {
    pub parts: Vec<Part>,
    pub components: Vec<Component>,
    /// Components by the name they were placed under: `alignment_pin` names three.
    pub groups: BTreeMap<String, Vec<usize>>,
    /// Names of the parts that were placed.
    pub placed: BTreeSet<String>,
}

impl Resolver {
    pub fn assemble(&mut self, body: &ast::Body, span: Span, catalogue: &Catalogue) -> Assembled {
        let mut built = Assembled::default();
        let places: Vec<&ast::Place> = body.lines.iter().filter_map(as_place).collect();
        let counts = pieces(body);
        self.written = body.lines.iter().filter_map(component_name).map(|name| name.text.clone()).collect();
        self.root(body, span, catalogue, &counts, &mut built);
        if built.components.is_empty() {
            return built;
        }
        self.unique_names(body);
        let mut waiting = places;
        // Placements may be written in any order: each round builds those whose support stands.
        while !waiting.is_empty() {
            let (ready, rest): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|place| self.ready(place, &built));
            if ready.is_empty() {
                self.unsupported(&rest, &built);
                break;
            }
            ready.iter().for_each(|place| self.place(place, catalogue, &counts, &mut built));
            waiting = rest;
        }
        built
    }

    fn root(
        &mut self,
        body: &ast::Body,
        span: Span,
        catalogue: &Catalogue,
        counts: &BTreeMap<&str, u64>,
        built: &mut Assembled,
    ) {
        let roots: Vec<_> = body.lines.iter().filter_map(as_root).collect();
        let Some((name, part)) = roots.first() else {
            self.report(Diagnostic::error("E0207", span, "the assembly has no root").label("`root` is missing").help(
                format!(
                    "write `root {}`: the part on which the others are placed",
                    catalogue.parts.keys().next().copied().unwrap_or("plate")
                ),
            ));
            return;
        };
        for (again, _) in &roots[1..] {
            let message = "an assembly has one root: all others are placed";
            let fault = Diagnostic::error("E0202", again.span, message).label("a second root");
            let help = format!("write `place {} on {}`", again.text, name.text);
            self.report(fault.also(name.span, "the root").help(help));
        }
        let wanted = part.unwrap_or(name);
        let identity = Seat { component: usize::MAX, frame: PoseExpr::identity() };
        if let Some(part) = self.piece(wanted, &name.text, catalogue, counts, built) {
            let pose = (PoseExpr::identity(), [false; 6]);
            let names = std::mem::take(&mut self.locals);
            self.standing.add(&name.text, names, None);
            built.groups.insert(name.text.clone(), vec![0]);
            built.components.push(component(name.text.clone(), part, identity, pose, name.span));
        }
    }

    fn unique_names(&mut self, body: &ast::Body) {
        let mut seen: BTreeMap<&str, Span> = BTreeMap::new();
        for line in &body.lines {
            let Some(name) = component_name(line) else { continue };
            match seen.get(name.text.as_str()) {
                Some(first) if matches!(line.stmt, Stmt::Place(_)) => {
                    let first = *first;
                    self.duplicate("component", name, first);
                }
                _ => {
                    seen.insert(&name.text, name.span);
                }
            }
        }
    }

    fn place(
        &mut self,
        place: &ast::Place,
        catalogue: &Catalogue,
        counts: &BTreeMap<&str, u64>,
        built: &mut Assembled,
    ) {
        let Some(seats) = self.seats(&place.on, built) else { return };
        let count = place.count.as_ref().map_or(1, |c| c.value);
        if count != seats.len() as u64 {
            return self.counts_differ(place, count, seats.len());
        }
        if built.components.len() + seats.len() > MAX_COMPONENTS {
            let message = format!("more than {MAX_COMPONENTS} components");
            return self.report(Diagnostic::error("E0212", place.name.span, message).label("too many components"));
        }
        let wanted = place.part.as_ref().unwrap_or(&place.name);
        let copies = seats.len();
        for (copy, seat) in seats.into_iter().enumerate() {
            let name = if place.count.is_some() {
                format!("{}[{}]", place.name.text, copy + 1)
            } else {
                place.name.text.clone()
            };
            let Some(part) = self.piece(wanted, &name, catalogue, counts, built) else { return };
            let names = std::mem::take(&mut self.locals);
            let own = self.standing.add(&place.name.text, names, Some(seat.component));
            self.standing.ask(Some(Asking { own, below: seat.component, copy, copies }));
            let pose = self.pose(place, &name);
            self.standing.ask(None);
            built.groups.entry(place.name.text.clone()).or_default().push(built.components.len());
            built.components.push(component(name, part, seat, pose, place.name.span));
        }
    }

    /// Whether all that a placement needs has been placed. What is written nowhere is reported when it is looked for.
    fn ready(&self, place: &ast::Place, built: &Assembled) -> bool {
        let stands = |path: &ast::Path| built.groups.contains_key(&path.segments[0].name.text);
        let lends = |path: &ast::Path| {
            let lender = &path.segments[0].name.text;
            *lender == place.name.text || stands(path) || !self.written.contains(lender)
        };
        stands(&place.on) && asked(place).into_iter().all(lends)
    }

    /// A part for one component, whose names stay in `locals`; dimensions carry the component's name when the part is placed more than once.
    fn piece(
        &mut self,
        wanted: &ast::Name,
        component: &str,
        catalogue: &Catalogue,
        counts: &BTreeMap<&str, u64>,
        built: &mut Assembled,
    ) -> Option<usize> {
        let Some(source) = catalogue.parts.get(wanted.text.as_str()) else {
            if let Some(family) = catalogue.families.get(wanted.text.as_str()) {
                self.family_placed(wanted, *family);
                return None;
            }
            self.unknown_part(wanted, catalogue);
            return None;
        };
        let several = counts.get(wanted.text.as_str()).is_some_and(|&n| n > 1);
        let path = if several { component } else { &wanted.text };
        let part = self.part(*source, path, &catalogue.materials);
        built.parts.push(part);
        built.placed.insert(wanted.text.clone());
        Some(built.parts.len() - 1)
    }

    fn unknown_part(&mut self, wanted: &ast::Name, catalogue: &Catalogue) {
        let known = self.kinds.get(&wanted.text).copied();
        let diagnostic = match known {
            Some(kind) => {
                Diagnostic::error("E0203", wanted.span, format!("expected a part, `{}` is a {kind}", wanted.text))
                    .label(format!("a {kind}"))
            }
            None => Diagnostic::error("E0201", wanted.span, format!("no part is named `{}`", wanted.text))
                .label("unknown part"),
        };
        let names = catalogue.parts.keys().copied();
        self.report(match nearest(&wanted.text, names.clone()) {
            Some(near) => diagnostic.meant(wanted.span, near),
            None => diagnostic.help(format!("parts: {}", names.collect::<Vec<_>>().join(", "))),
        });
    }

    fn counts_differ(&mut self, place: &ast::Place, count: u64, seats: usize) {
        let part = &place.part.as_ref().unwrap_or(&place.name).text;
        let target = place.on.segments.iter().map(|s| s.name.text.as_str()).collect::<Vec<_>>().join(".");
        let message = format!("{count}x `{part}` on `{target}`, which has {}", copies(seats));
        let span = place.count.as_ref().map_or(place.name.span, |c| c.span);
        let help = if count < seats as u64
            && place.on.segments.len() <= 2
            && place.on.segments.iter().all(|s| s.index.is_none())
        {
            let chosen = if count == 1 { "1".to_string() } else { format!("1..{count}") };
            format!("write `{seats}x {part}`, or place on `{target}[{chosen}]`")
        } else {
            format!("write `place {} = {seats}x {part} on {target}`", place.name.text)
        };
        let fault = Diagnostic::error("E0505", span, message).label("counts differ").also(place.on.span, copies(seats));
        self.report(match (&place.count, &place.part) {
            (Some(count), _) => fault.suggest(help, count.span, format!("{seats}x")),
            (None, Some(part)) => fault.suggest(help, Span { end: part.span.start, ..part.span }, format!("{seats}x ")),
            (None, None) => {
                let name = &place.name;
                fault.suggest(help, Span { start: name.span.end, ..name.span }, format!(" = {seats}x {part}"))
            }
        });
    }

    fn unsupported(&mut self, waiting: &[&ast::Place], built: &Assembled) {
        let names: Vec<&str> = waiting.iter().map(|p| p.name.text.as_str()).collect();
        for place in waiting {
            let support = &place.on.segments[0].name;
            if names.contains(&support.text.as_str()) || self.written.contains(&support.text) {
                continue;
            }
            let message = format!("no component is named `{}`", support.text);
            let diagnostic = Diagnostic::error("E0201", support.span, message).label("unknown component");
            let known = built.groups.keys().map(String::as_str);
            self.report(match nearest(&support.text, known.clone().chain(names.iter().copied())) {
                Some(near) => diagnostic.meant(support.span, near),
                None => diagnostic.help(format!("components so far: {}", known.collect::<Vec<_>>().join(", "))),
            });
        }
        let reported = self.diagnostics.len();
        self.placement_cycle(waiting);
        if self.diagnostics.len() == reported {
            self.waits_for_its_own(waiting, built);
        }
    }

    /// Reports the first placement whose support stands, but whose place needs a dimension of what waits for it in turn.
    fn waits_for_its_own(&mut self, waiting: &[&ast::Place], built: &Assembled) {
        let stands = |name: &str| built.groups.contains_key(name);
        for place in waiting.iter().filter(|place| stands(&place.on.segments[0].name.text)) {
            let lenders = asked(place).into_iter();
            let missing = lenders
                .map(|path| (path, &path.segments[0].name.text))
                .find(|(_, name)| waiting.iter().any(|other| other.name.text == **name && !stands(name)));
            let Some((path, lender)) = missing else { continue };
            let message = format!(
                "the place of `{}` needs a dimension of `{lender}`, which is not placed before it",
                place.name.text
            );
            let fault = Diagnostic::error("E0504", path.span, message).label("each waits for the other");
            let help = "define the dimension above all parts with `let`, and use that name in both places";
            return self.report(fault.help(help));
        }
    }

    /// Follows supports from each waiting placement until one repeats; reports the first circle.
    fn placement_cycle(&mut self, waiting: &[&ast::Place]) {
        let by_name: BTreeMap<&str, &ast::Place> = waiting.iter().map(|p| (p.name.text.as_str(), *p)).collect();
        for start in waiting {
            let mut chain = vec![*start];
            while let Some(next) = chain.last().and_then(|p| by_name.get(p.on.segments[0].name.text.as_str())) {
                if std::ptr::eq(*next, *start) {
                    return self.report_cycle(&chain);
                }
                if chain.len() > waiting.len() {
                    break;
                }
                chain.push(*next);
            }
        }
    }

    fn report_cycle(&mut self, chain: &[&ast::Place]) {
        let names: Vec<String> = chain.iter().chain(chain.first()).map(|p| format!("`{}`", p.name.text)).collect();
        let message = format!("{}: nothing carries them", names.join(" on "));
        let mut diagnostic = Diagnostic::error("E0504", chain[0].on.span, message).label("placed in a circle");
        for place in &chain[1..] {
            diagnostic = diagnostic.also(place.on.span, "and here");
        }
        self.report(diagnostic.help("place one of them on the root, or on what the root carries"));
    }

    fn pose(&mut self, place: &ast::Place, name: &str) -> (PoseExpr, [bool; 6]) {
        let body = place.body.as_ref();
        let owner = format!("place {}", place.name.text);
        let fields = body.map_or_else(
            || Fields::none(&owner, place.name.span),
            |body| Fields::of_body(&owner, place.name.span, body),
        );
        self.check_fields(&fields, &AXES.map(|(axis, _)| axis));
        let mut free = [false; 6];
        let exprs: Vec<Expr> = AXES
            .iter()
            .enumerate()
            .map(|(i, &(axis, quantity))| {
                let path = format!("{name}.{axis}");
                free[i] = is_free(fields.get(axis));
                self.axis(fields.get(axis), quantity, &path).unwrap_or(Expr::Const(0.0))
            })
            .collect();
        let [x, y, z, rx, ry, rz] = <[Expr; 6]>::try_from(exprs).unwrap_or_else(|_| [0; 6].map(|_| Expr::Const(0.0)));
        (PoseExpr { t: [x, y, z], r: [rx, ry, rz] }, free)
    }

    fn axis(&mut self, value: Option<&Value>, quantity: Quantity, path: &str) -> Option<Expr> {
        let value = value?;
        let dim = self.dim_of(value)?;
        if !is_free(Some(value)) {
            return self.dimension(dim, quantity, General::Basic, path);
        }
        if quantity == Quantity::Angle {
            let turn = Range { low: -PI, nominal: 0.0, high: PI };
            return Some(self.new_dim(path.to_string(), quantity, turn, Remark::default(), dim.span));
        }
        let message = "only a turn can be `free`";
        self.report(
            Diagnostic::error("E0211", dim.span, message).label("a length needs limits").help("write `0 ±0.1`"),
        );
        None
    }
}

fn component(name: String, part: usize, seat: Seat, (pose, free): (PoseExpr, [bool; 6]), span: Span) -> Component {
    let parent = (seat.component != usize::MAX).then_some(seat.component);
    Component { name, part, parent, frame: seat.frame, pose, free, span }
}

fn is_free(value: Option<&Value>) -> bool {
    matches!(value, Some(Value::Dim(dim)) if dim.word() == Some("free"))
}

fn as_place(line: &ast::Line) -> Option<&ast::Place> {
    match &line.stmt {
        Stmt::Place(place) => Some(place),
        _ => None,
    }
}

/// The name of the component, or of the components, that a line puts into the assembly.
fn component_name(line: &ast::Line) -> Option<&ast::Name> {
    match &line.stmt {
        Stmt::Place(place) => Some(&place.name),
        Stmt::Root { name, .. } => Some(name),
        _ => None,
    }
}

fn as_root(line: &ast::Line) -> Option<(&ast::Name, Option<&ast::Name>)> {
    match &line.stmt {
        Stmt::Root { name, part } => Some((name, part.as_ref())),
        _ => None,
    }
}

/// How often each part is placed.
fn pieces(body: &ast::Body) -> BTreeMap<&str, u64> {
    let mut counts: BTreeMap<&str, u64> = BTreeMap::new();
    for line in &body.lines {
        let (part, count) = match &line.stmt {
            Stmt::Place(p) => (p.part.as_ref().unwrap_or(&p.name), p.count.as_ref().map_or(1, |c| c.value)),
            Stmt::Root { name, part } => (part.as_ref().unwrap_or(name), 1),
            _ => continue,
        };
        let total = counts.entry(&part.text).or_default();
        *total = total.saturating_add(count);
    }
    counts
}
