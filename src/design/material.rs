//! `material`: how a surface answers light.

use super::fields::Fields;
use super::model::{Colour, Grooves, Lay, Material, MaterialKind, Tint};
use super::scope::Resolver;
use crate::diag::Diagnostic;
use crate::syntax::ast::{Body, Name, Value};
use crate::units::{Quantity, Range};

/// Complex refractive indices. Rounded from refractiveindex.info (CC0): steel from Karlsson (austenitic stainless), aluminium
/// from Mathewson and in blue, where that ends, from Rakić; brass from Querry (Cu70Zn30), copper from Querry.
#[expect(clippy::approx_constant, reason = "3.14 is what was measured of copper")]
const METALS: [(&str, Metal); 4] = [
    ("steel", Metal { white: [2.4, 4.1], led: [[1.68, 3.12], [1.97, 3.56], [2.33, 4.07], [3.25, 4.91]] }),
    ("aluminium", Metal { white: [1.4, 7.4], led: [[0.63, 5.45], [0.90, 6.26], [1.44, 7.26], [2.60, 7.64]] }),
    ("brass", Metal { white: [0.45, 3.6], led: [[1.09, 1.83], [0.57, 2.57], [0.45, 3.48], [0.49, 5.27]] }),
    ("copper", Metal { white: [0.32, 3.3], led: [[1.17, 2.04], [1.00, 2.24], [0.32, 3.14], [0.42, 4.98]] }),
];

/// The colours of the columns of [`Metal::led`].
const LEDS: [Colour; 4] = [Colour::Blue, Colour::Green, Colour::Red, Colour::Infrared];

/// Refractive index n and extinction k of a metal.
#[derive(Clone, Copy)]
struct Metal {
    /// Near 0.6 µm, where white light and a monochrome sensor have their weight.
    white: [f64; 2],
    led: [[f64; 2]; 4],
}

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
        let metal = (kind == MaterialKind::Metal).then(|| self.word_or(&fields, "metal", &METALS, METALS[0].1));
        let index = metal.map_or(COAT, |m| m.white);
        // Who gives numbers of his own has measured them under his own light.
        let own = fields.get("n").is_some() || fields.get("k").is_some();
        let led = metal.filter(|_| !own).map(|m| m.led).into_iter().flatten();
        let (reflectance, roughness) = usual(kind);
        Material {
            name: name.text.clone(),
            kind,
            n: self.exact_or(&fields, "n", Quantity::Ratio, index[0], [0.01, 10.0]),
            k: self.exact_or(&fields, "k", Quantity::Ratio, index[1], [0.0, 20.0]),
            tints: LEDS.into_iter().zip(led).map(|(colour, [n, k])| Tint { colour, n, k }).collect(),
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
