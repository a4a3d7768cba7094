//! `material`: how a surface answers light.

use super::fields::Fields;
use super::model::{Grooves, Lay, Material, MaterialKind};
use super::scope::Resolver;
use crate::diag::Diagnostic;
use crate::syntax::ast::{Body, Name, Value};
use crate::units::{Quantity, Range};

/// Complex refractive indices near 0.6 µm, where white light and a monochrome sensor have their weight. Rounded from
/// refractiveindex.info (CC0): steel from Karlsson (austenitic stainless), aluminium from Mathewson, brass from Querry
/// (Cu70Zn30), copper from Querry.
const METALS: [(&str, [f64; 2]); 4] =
    [("steel", [2.4, 4.1]), ("aluminium", [1.4, 7.4]), ("brass", [0.45, 3.6]), ("copper", [0.32, 3.3])];

/// Index of the clear coat of a plastic.
const COAT: [f64; 2] = [1.5, 0.0];

/// Size of blotches when nothing is said (mm).
const BLOTCH: f64 = 8.0;

/// Broken edges when nothing is said (mm): what a deburring tool leaves.
const EDGE_BREAK: Range = Range { low: 0.05, nominal: 0.1, high: 0.2 };

/// Roughness along the grooves as a share of that across them, when nothing is said: what a sharp tool leaves.
const ALONG: f64 = 0.3;

const FIELDS: [&str; 11] = [
    "kind",
    "metal",
    "n",
    "k",
    "reflectance",
    "roughness",
    "edge_break",
    "mottle",
    "mottle_size",
    "lay",
    "lay_roughness",
];

impl Resolver {
    pub fn material(&mut self, name: &Name, body: &Body) -> Material {
        let fields = Fields::of_body(&format!("material {}", name.text), name.span, body);
        self.check_fields(&fields, &FIELDS);
        let kinds = [("metal", MaterialKind::Metal), ("plastic", MaterialKind::Plastic), ("matt", MaterialKind::Matt)];
        let implied = if fields.get("metal").is_some() { MaterialKind::Metal } else { MaterialKind::Matt };
        let kind = self.word_or(&fields, "kind", &kinds, implied);
        let index = match kind {
            MaterialKind::Metal => self.word_or(&fields, "metal", &METALS, METALS[0].1),
            _ => COAT,
        };
        let (reflectance, roughness) = usual(kind);
        Material {
            name: name.text.clone(),
            kind,
            n: self.exact_or(&fields, "n", Quantity::Ratio, index[0], [0.01, 10.0]),
            k: self.exact_or(&fields, "k", Quantity::Ratio, index[1], [0.0, 20.0]),
            reflectance: self.range_within(&fields, "reflectance", Quantity::Ratio, reflectance, [0.0, 1.0]),
            roughness: self.range_within(&fields, "roughness", Quantity::Ratio, roughness, [0.001, 1.0]),
            edge_break: self.range_within(&fields, "edge_break", Quantity::Length, EDGE_BREAK, [0.0, 10.0]),
            mottle: self.exact_or(&fields, "mottle", Quantity::Ratio, 0.0, [0.0, 1.0]),
            mottle_size: self.mottle_size(&fields),
            lay: self.lay(&fields, kind),
            span: name.span,
        }
    }

    /// The grooves of machining: `lay = circular`, or along an axis.
    fn lay(&mut self, fields: &Fields, kind: MaterialKind) -> Option<Lay> {
        let words = [
            ("none", None),
            ("circular", Some(Grooves::Circular)),
            ("x", Some(Grooves::Straight(0))),
            ("y", Some(Grooves::Straight(1))),
            ("z", Some(Grooves::Straight(2))),
        ];
        let grooves = self.word_or(fields, "lay", &words, None);
        let along = self.exact_or(fields, "lay_roughness", Quantity::Ratio, ALONG, [0.01, 1.0]);
        match (fields.get("lay"), fields.get("lay_roughness")) {
            (Some(value), _) if grooves.is_some() && kind != MaterialKind::Metal => {
                self.report(
                    Diagnostic::error("E0211", value.span(), "only a metal has a lay")
                        .label("not a metal")
                        .help("write `kind = metal`, or leave `lay` out"),
                );
                None
            }
            (None, Some(value)) => {
                let message = "`lay_roughness` is along the grooves, and there are none";
                self.report(
                    Diagnostic::error("E0211", value.span(), message)
                        .label("without a `lay`")
                        .help("write `lay = circular` for a turned part, `lay = x` for one that is ground along x"),
                );
                None
            }
            _ => grooves.map(|grooves| Lay { grooves, along }),
        }
    }

    /// One size for round blotches, or three for grain.
    fn mottle_size(&mut self, fields: &Fields) -> [f64; 3] {
        let sizes = match fields.get("mottle_size") {
            Some(Value::Dim(_)) => {
                [self.exact_or(fields, "mottle_size", Quantity::Length, BLOTCH, [0.01, f64::MAX]); 3]
            }
            _ => self.point_or(fields, "mottle_size", [BLOTCH; 3]),
        };
        if sizes.iter().all(|&s| s > 0.0) {
            return sizes;
        }
        self.wrong_form(fields.span, "blotches larger than zero");
        [BLOTCH; 3]
    }
}

/// Reflectance and roughness when nothing is said: wide, because pieces differ.
fn usual(kind: MaterialKind) -> (Range, Range) {
    let range = |low, nominal, high| Range { low, nominal, high };
    match kind {
        MaterialKind::Metal => (range(0.4, 0.55, 0.7), range(0.06, 0.15, 0.3)),
        MaterialKind::Plastic => (range(0.1, 0.25, 0.4), range(0.1, 0.2, 0.3)),
        MaterialKind::Matt => (range(0.1, 0.25, 0.4), Range::exactly(1.0)),
    }
}
