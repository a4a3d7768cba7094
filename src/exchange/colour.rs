//! What a part looks like in a viewer: a colour for its material.
//!
//! In: a [`Material`] as the station's monochrome camera sees it. Out: a [`Paint`]. A guess by design: inspection never uses
//! it.

use crate::design::model::{Material, MaterialKind};

/// Colour (linear RGB, 0..=1), how metallic and how rough, as physically based viewers take them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paint {
    pub rgb: [f64; 3],
    pub metallic: f64,
    pub roughness: f64,
}

/// Metals by refractive index near 0.6 µm, with their usual colour: steel, aluminium, brass, copper.
const METALS: [([f64; 2], [f64; 3]); 4] = [
    ([2.4, 4.1], [0.56, 0.57, 0.58]),
    ([1.4, 7.4], [0.91, 0.92, 0.92]),
    ([0.45, 3.6], [0.89, 0.73, 0.40]),
    ([0.32, 3.3], [0.93, 0.62, 0.52]),
];

impl Paint {
    /// The paint of a material at nominal.
    pub fn of(material: &Material) -> Paint {
        let grey = material.reflectance.nominal.clamp(0.0, 1.0);
        let metal = material.kind == MaterialKind::Metal;
        Paint {
            rgb: if metal { nearest_metal([material.n, material.k]) } else { [grey; 3] },
            metallic: if metal { 1.0 } else { 0.0 },
            // Viewers square it; the spec gives the width of the distribution itself.
            roughness: material.roughness.nominal.clamp(0.0, 1.0).sqrt(),
        }
    }

    /// The colour with the transfer curve of sRGB, which STEP means.
    pub fn srgb(&self) -> [f64; 3] {
        self.rgb.map(|v| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 })
    }
}

fn nearest_metal([n, k]: [f64; 2]) -> [f64; 3] {
    let off = |m: &([f64; 2], [f64; 3])| (m.0[0] - n).hypot(m.0[1] - k);
    METALS.iter().min_by(|a, b| off(a).total_cmp(&off(b))).map_or([0.5; 3], |m| m.1)
}
