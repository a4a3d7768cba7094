//! `inspect` and `train`: what to answer for, and how hard to train.

use super::assemble::Assembled;
use super::fields::Fields;
use super::model::{Inspect, Train, Watch};
use super::scope::Resolver;
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::syntax::ast::{Args, Body, Name, Path, Stmt};
use crate::units::Quantity;

/// Share of good assemblies that may be rejected when nothing is said.
const FALSE_REJECT: f64 = 0.001;

/// Training images when nothing is said.
const IMAGES: u64 = 14;

impl Resolver {
    /// Without `watch` every component is watched; the root, which has no faults of its own, for what may lie on it.
    pub fn inspect(&mut self, body: Option<(&Body, Span)>, built: &Assembled) -> Inspect {
        let nothing = Body::default();
        let (body, span) = body.unwrap_or((&nothing, Span::default()));
        let fields = Fields::of_body("inspect", span, body);
        self.check_fields(&fields, &["false_reject"]);
        let statements = |line: &crate::syntax::ast::Line| matches!(line.stmt, Stmt::Watch { .. });
        let all = !body.lines.iter().any(statements);
        let mut depths: Vec<Option<Option<u32>>> =
            (0..built.components.len()).map(|i| (all && i > 0).then_some(None)).collect();
        let mut root = all && !built.components.is_empty();
        for line in &body.lines {
            match &line.stmt {
                Stmt::Watch { path, args } => {
                    let depth = args.as_ref().and_then(|args| self.depth(args, path));
                    let named = self.watched(path, built);
                    root |= named.contains(&0);
                    named.into_iter().for_each(|i| depths[i] = Some(depth));
                }
                Stmt::Ignore(path) => {
                    let named = self.watched(path, built);
                    root &= !named.contains(&0);
                    named.into_iter().for_each(|i| depths[i] = None);
                }
                _ => {}
            }
        }
        let watch = depths.iter().enumerate().filter_map(|(component, d)| d.map(|depth| Watch { component, depth }));
        let watch: Vec<Watch> = watch.collect();
        // What is wrong elsewhere may be why.
        let faulty = self.diagnostics.iter().any(Diagnostic::is_error);
        if watch.is_empty() && !faulty && !built.components.is_empty() && span != Span::default() {
            let message = "nothing is watched";
            self.report(
                Diagnostic::error("E0207", span, message)
                    .label("every photo would be a go")
                    .help("remove an `ignore`, or add a `watch`"),
            );
        }
        let false_reject = self.exact_or(&fields, "false_reject", Quantity::Ratio, FALSE_REJECT, [1e-9, 0.5]);
        Inspect { watch, root, false_reject, span }
    }

    fn depth(&mut self, args: &Args, path: &Path) -> Option<u32> {
        let owner = Name { text: "watch".to_string(), span: path.span };
        let fields = Fields::of_args(&owner, args);
        self.check_fields(&fields, &["depth"]);
        fields.get("depth").map(|_| self.whole_or(&fields, "depth", 1, [1, 16]) as u32)
    }

    /// The components a path names.
    fn watched(&mut self, path: &Path, built: &Assembled) -> Vec<usize> {
        let Some((first, rest)) = path.segments.split_first() else { return Vec::new() };
        let Some(group) = built.groups.get(&first.name.text) else {
            if self.written.contains(&first.name.text) {
                return Vec::new();
            }
            let message = format!("no component is named `{}`", first.name.text);
            let diagnostic = Diagnostic::error("E0201", first.name.span, message).label("unknown component");
            let known = built.groups.keys().map(String::as_str);
            self.report(match nearest(&first.name.text, known.clone()) {
                Some(near) => diagnostic.meant(first.name.span, near),
                None => diagnostic.help(format!("components: {}", known.collect::<Vec<_>>().join(", "))),
            });
            return Vec::new();
        };
        if let Some(feature) = rest.first() {
            let message = format!("expected a component, `{}.{}` is a feature", first.name.text, feature.name.text);
            self.report(
                Diagnostic::error("E0203", path.span, message)
                    .label("a feature")
                    .help(format!("name the component: `{}`", first.name.text)),
            );
            return Vec::new();
        }
        self.chosen(first, group.len()).map_or_else(Vec::new, |chosen| chosen.into_iter().map(|i| group[i]).collect())
    }

    /// How many draws: spread is learnt from two on.
    fn images(&mut self, fields: &Fields) -> u32 {
        let images = self.whole_or(fields, "images", IMAGES, [1, 10_000]);
        if let (true, Some(value)) = (images < 2, fields.get("images")) {
            self.report(
                Diagnostic::error("E0701", value.span(), "from one image nothing can be learnt about spread")
                    .label("too few images")
                    .suggest(format!("write `images = {IMAGES}`"), value.span(), IMAGES.to_string()),
            );
        }
        images as u32
    }

    pub fn train(&mut self, body: Option<(&Body, Span)>) -> Train {
        let nothing = Body::default();
        let (body, span) = body.unwrap_or((&nothing, Span::default()));
        let fields = Fields::of_body("train", span, body);
        self.check_fields(&fields, &["images", "seed", "levels", "samples", "draw"]);
        // Seeds beyond 2^53 would not survive the way through a float.
        const LARGEST_SEED: u64 = 1 << 53;
        Train {
            images: self.images(&fields),
            seed: self.whole_or(&fields, "seed", 1, [0, LARGEST_SEED]),
            levels: self.whole_or(&fields, "levels", 4, [1, 8]) as u32,
            samples: self.whole_or(&fields, "samples", 16, [1, 65_536]) as u32,
            uniform: self.word_or(&fields, "draw", &[("uniform", true), ("nominal", false)], true),
        }
    }
}
