//! `part`: names, material and outlines of a part, and its feature list.

use super::family::Member;
use super::feature::{Context, MAX_COPIES};
use super::fields::Fields;
use super::model::Part;
use super::scope::{Named, Resolver};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{self, Stmt, Value};
use std::collections::BTreeMap;

/// More features than this in one part, copies counted, are a slip of the pen.
const MAX_FEATURES: u64 = 4000;
/// More lines or features than this in all parts of the assembly, every piece counted, would not be judged in time.
const MAX_LINES_IN_ALL: u64 = 200_000;

/// A part as written.
#[derive(Debug, Clone, Copy)]
pub struct PartSource<'a> {
    pub name: &'a ast::Name,
    pub body: &'a ast::Body,
    /// Of which family, and in which size.
    pub member: Option<Member<'a>>,
}

impl Resolver {
    /// One piece of a part; its names stay behind in `locals`. Its dimensions are named under `path`: the part's name, or the component's when the part
    /// is placed more than once, so that every piece has draws of its own.
    pub fn part(&mut self, source: PartSource, path: &str, materials: &BTreeMap<&str, usize>) -> Part {
        let Some(names) = self.part_names(source, path) else {
            return Part { name: source.name.text.clone(), material: 0, features: Vec::new(), span: source.name.span };
        };
        self.locals = names;
        self.outlines = BTreeMap::new();
        let bounded = self.few_enough(source);
        self.draw_outlines(source.body, path);
        let features = if bounded { self.features(source.body, &Context::part(path)) } else { Vec::new() };
        self.check_features(&format!("part `{}`", source.name.text), source.name.span, source.body);
        self.note_idle_names();
        self.warn_unused_outlines();
        self.read_unread_names(true);
        let material = self.part_material(source, materials);
        Part { name: source.name.text.clone(), material, features, span: source.name.span }
    }

    /// Counts the features before any is built, so that patterns of patterns cost nothing when they are too many.
    fn few_enough(&mut self, source: PartSource) -> bool {
        let (name, total) = (&source.name.text, leaves(source.body));
        if total > MAX_FEATURES {
            let message = format!("part `{name}` has {total} features, the limit is {MAX_FEATURES}");
            self.report(Diagnostic::error("E0212", source.name.span, message).label("too many features"));
            return false;
        }
        self.lines_in_all += total.max(lines(source.body));
        if self.lines_in_all > MAX_LINES_IN_ALL {
            let message =
                format!("the pieces of the assembly have more than {MAX_LINES_IN_ALL} lines or features in all");
            self.report(Diagnostic::error("E0212", source.name.span, message).label("too many pieces of this part"));
            return false;
        }
        true
    }

    /// The named dimensions of a part; `None` for a member of a family in a size it does not have.
    fn part_names(&mut self, source: PartSource, path: &str) -> Option<BTreeMap<String, Named>> {
        self.locals = BTreeMap::new();
        let mut names = match source.member {
            Some(member) => self.member_names(member, path)?,
            None => BTreeMap::new(),
        };
        for line in &source.body.lines {
            if let Stmt::Let { name, dim } = &line.stmt {
                self.define(&mut names, name, dim, format!("{path}.{}", name.text));
            }
        }
        Some(names)
    }

    /// Adds a `let` to a table, unless its name is taken or is a word of the language.
    pub fn define(&mut self, names: &mut BTreeMap<String, Named>, name: &ast::Name, dim: &ast::Dim, path: String) {
        if ["free", "through", "exact"].contains(&name.text.as_str()) {
            let message = format!("`{}` is a word of the language", name.text);
            self.report(Diagnostic::error("E0202", name.span, message).label("choose another name"));
        } else if let Some(first) = names.get(&name.text) {
            let first = first.span;
            self.duplicate("dimension", name, first);
        } else {
            names.insert(name.text.clone(), Named::new(name, dim, path));
        }
    }

    pub fn duplicate(&mut self, kind: &str, name: &ast::Name, first: Span) {
        let message = format!("{kind} `{}` is defined twice", name.text);
        self.report(
            Diagnostic::error("E0202", name.span, message)
                .label("defined again")
                .also(first, "first defined here")
                .suggest(format!("name it `{}_2`", name.text), name.span, format!("{}_2", name.text)),
        );
    }

    fn note_idle_names(&mut self) {
        let idle = self.locals.iter().filter(|(_, named)| !self.is_used(named.span));
        let idle: Vec<_> = idle.map(|(name, d)| ((d.span.file, d.span.start, d.span.end), name.clone())).collect();
        self.idle.extend(idle);
    }

    /// Warns of names of parts that nobody used, in their part or in a placement.
    pub fn warn_idle_names(&mut self) {
        for ((file, start, end), name) in std::mem::take(&mut self.idle) {
            let span = Span { file, start, end };
            if !self.is_used(span) {
                self.unused("dimension", &name, span);
            }
        }
    }

    pub fn unused(&mut self, kind: &str, name: &str, span: Span) {
        let message = format!("{kind} `{name}` is never used");
        self.report(Diagnostic::warning("W0209", span, message).label("not used").help("use it or remove it"));
    }

    /// Reports a feature list, of a part or of a group, that does not begin with a body.
    pub fn check_features(&mut self, owner: &str, span: Span, body: &ast::Body) {
        let written = body.lines.iter().find_map(as_feature);
        let help = "begin with a body: `add body = box(x = 10, y = 10, z = 10)`";
        match written {
            None => self.report(
                Diagnostic::error("E0207", span, format!("{owner} has no features"))
                    .label("nothing is made here")
                    .help(help),
            ),
            Some(first) if first.op.text != "add" => self.report(
                Diagnostic::error("E0207", first.op.span, format!("{owner} begins with `{}`", first.op.text))
                    .label("there is nothing to take from yet")
                    .help(help),
            ),
            _ => {}
        }
    }

    fn part_material(&mut self, source: PartSource, materials: &BTreeMap<&str, usize>) -> usize {
        let fields = Fields::of_body(&format!("part {}", source.name.text), source.name.span, source.body);
        self.check_fields(&fields, &["material"]);
        // What a member is made of, it may say itself.
        if let Some(value) = source.member.and_then(|m| Fields::of_args(&m.call.name, &m.call.args).get("material")) {
            return self.material_named(value, materials);
        }
        match fields.get("material") {
            None => {
                let example = materials.keys().next().copied().unwrap_or("steel");
                self.missing(&fields, "material", example);
                0
            }
            Some(value) => self.material_named(value, materials),
        }
    }

    /// Index of the material a field names.
    pub fn material_named(&mut self, value: &Value, materials: &BTreeMap<&str, usize>) -> usize {
        if let Value::Text(name) = value
            && materials.contains_key(name.text.as_str())
        {
            let message = "a name stands without quotes";
            self.report(Diagnostic::error("E0211", name.span, message).label("a string").fix(
                format!("write `material = {}`", name.text),
                name.span,
                name.text.clone(),
            ));
            return 0;
        }
        let Value::Dim(dim) = value else {
            self.wrong_form(value.span(), "the name of a material");
            return 0;
        };
        let Some(name) = dim.word() else {
            self.wrong_form(value.span(), "the name of a material");
            return 0;
        };
        if let Some(index) = materials.get(name) {
            self.used_materials.insert(*index);
            return *index;
        }
        let known_as = self.kinds.get(name).copied();
        let diagnostic = match known_as {
            Some(kind) => Diagnostic::error("E0203", dim.span, format!("expected a material, `{name}` is a {kind}"))
                .label(format!("a {kind}")),
            None => {
                Diagnostic::error("E0201", dim.span, format!("no material is named `{name}`")).label("unknown material")
            }
        };
        self.report(match nearest(name, materials.keys().copied()) {
            Some(near) => diagnostic.meant(dim.span, near),
            None if known_as.is_some() => {
                diagnostic.help(format!("materials: {}", materials.keys().copied().collect::<Vec<_>>().join(", ")))
            }
            None => diagnostic.help(format!("define it: `material {name} {{ kind = matt }}`")),
        });
        0
    }
}

/// The feature a line adds or cuts.
pub fn as_feature(line: &ast::Line) -> Option<&ast::Feature> {
    match &line.stmt {
        Stmt::Feature(feature) => Some(feature),
        _ => None,
    }
}

/// How many primitives a feature list comes to, with the copies of patterns and of patterns of groups. A pattern that is
/// refused for its count has none.
fn leaves(body: &ast::Body) -> u64 {
    let copies = |f: &ast::Feature| f.count.as_ref().map_or(1, |c| if c.value > MAX_COPIES { 0 } else { c.value });
    let one = |f: &ast::Feature| match &f.shape {
        ast::Shape::Group { body, .. } => leaves(body),
        ast::Shape::Call(_) => 1,
    };
    let features = body.lines.iter().filter_map(as_feature);
    features.fold(0, |sum, f| sum.saturating_add(copies(f).saturating_mul(one(f))))
}

/// Statements of a body and of the blocks in it.
fn lines(body: &ast::Body) -> u64 {
    let inner = |line: &ast::Line| match &line.stmt {
        Stmt::Outline { body, .. } => lines(body),
        Stmt::Feature(feature) => match &feature.shape {
            ast::Shape::Group { body, .. } => lines(body),
            ast::Shape::Call(_) => 0,
        },
        _ => 0,
    };
    body.lines.iter().map(|line| 1 + inner(line)).sum()
}
