//! How far a new output may be from the blessed one. Every blessed file says it at its head, and who reviews it may change it:
//!
//! ```text
//! // tolerance: ±0.001 ±0.01 %
//! // tolerance of area: ±0.02 ±0.1 %
//! // tolerance of pictures: mean 0.5, most 12
//! ```
//!
//! The first line is for numbers with decimals: so much, and so much of the blessed value. Whole numbers are equal or not,
//! unless a line names their field or one around it.

use std::collections::BTreeMap;
use std::fmt;

const MARK: &str = "// tolerance";

/// A number may differ by `absolute + share · |blessed|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    pub absolute: f64,
    pub share: f64,
}

/// Grey levels of 255, after the pictures were reduced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureTolerance {
    /// Average over all pixels and channels of the difference without its sign.
    pub mean: f64,
    /// The largest difference.
    pub most: f64,
}

/// What a file allows.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerances {
    pub decimals: Tolerance,
    pub named: BTreeMap<String, Tolerance>,
    pub pictures: PictureTolerance,
}

/// What is written where a stage is blessed for the first time. Numbers of an artifact are rounded, and the last digit may
/// turn over on another processor: that much is allowed, and what pixels at an edge and sums over triangles do.
const USUAL: &[(&str, &str)] = &[
    ("design", "// tolerance: ±0.00002 ±0 %\n"),
    ("brep", "// tolerance: ±0.002 ±0.001 %\n"),
    ("contacts", "// tolerance: ±0.0002 ±0 %\n// tolerance of area: ±0.02 ±0.1 %\n"),
    ("liaison", "// tolerance: ±0.0002 ±0 %\n// tolerance of area: ±0.02 ±0.1 %\n"),
    ("insertion", "// tolerance: ±0.002 ±0 %\n"),
    ("measures", "// tolerance: ±0.0005 ±0.1 %\n"),
    (
        "view",
        "// tolerance: ±0.01 ±0.01 %\n// tolerance of full: ±1 ±0 %\n// tolerance of visible: ±1 ±0 %\n\
         // tolerance of pixels: ±3 ±1 %\n",
    ),
    ("images", "// tolerance: ±0.5 ±0 %\n// tolerance of pictures: mean 0.5, most 12\n"),
    ("model", "// tolerance: ±0.001 ±0.1 %\n"),
];

impl Default for Tolerances {
    fn default() -> Tolerances {
        Tolerances {
            decimals: Tolerance { absolute: 1e-3, share: 1e-4 },
            named: BTreeMap::new(),
            pictures: PictureTolerance { mean: 0.5, most: 12.0 },
        }
    }
}

/// The head of a file that is blessed for the first time; `stem` as in `error_trees`.
pub fn usual(stem: &str) -> &'static str {
    // Trees of names have no numbers to allow anything for.
    USUAL.iter().find(|(known, _)| *known == stem).map_or("", |(_, text)| text)
}

/// The lines of a blessed text that say what it allows, to be kept.
pub fn head(text: &str) -> String {
    text.lines().filter(|l| l.starts_with(MARK)).map(|l| format!("{l}\n")).collect()
}

/// A line that says nothing we understand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unclear {
    /// From 1.
    pub line: usize,
    pub text: String,
}

impl fmt::Display for Unclear {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: `{}` is no tolerance; write `{MARK} of area: ±0.01 ±0.1 %`", self.line, self.text)
    }
}

impl Tolerances {
    /// What the lines of a blessed text allow.
    pub fn of(text: &str) -> Result<Tolerances, Unclear> {
        let mut all = Tolerances::default();
        for (line, text) in (1..).zip(text.lines()) {
            if let Some(rule) = text.strip_prefix(MARK) {
                all.add(rule).ok_or_else(|| Unclear { line, text: text.into() })?;
            }
        }
        Ok(all)
    }

    /// ` of area: ±0.02 ±0.1 %`
    fn add(&mut self, rule: &str) -> Option<()> {
        let (subject, amount) = rule.split_once(':')?;
        match subject.trim() {
            "" => self.decimals = amount_of(amount)?,
            "of pictures" => self.pictures = picture_amount_of(amount)?,
            subject => {
                let name = subject.strip_prefix("of ")?.trim();
                self.named.insert(name.into(), amount_of(amount)?);
            }
        }
        Some(())
    }
}

/// `±0.02`, or `±0.02 ±0.1 %`
fn amount_of(text: &str) -> Option<Tolerance> {
    let mut parts = text.trim().strip_prefix('±')?.split('±');
    let absolute = positive(parts.next()?)?;
    let share = match parts.next() {
        Some(percent) => positive(percent.trim().strip_suffix('%')?)? / 100.0,
        None => 0.0,
    };
    parts.next().is_none().then_some(Tolerance { absolute, share })
}

/// `mean 0.5, most 12`
fn picture_amount_of(text: &str) -> Option<PictureTolerance> {
    let (mean, most) = text.split_once(',')?;
    let [mean, most] = [mean.trim().strip_prefix("mean ")?, most.trim().strip_prefix("most ")?].map(positive);
    Some(PictureTolerance { mean: mean?, most: most? })
}

fn positive(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0)
}

impl Tolerance {
    pub fn allows(&self, blessed: f64, now: f64) -> bool {
        (blessed - now).abs() <= self.absolute + self.share * blessed.abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_at_first_is_understood() {
        for (stem, text) in USUAL {
            assert!(Tolerances::of(text).is_ok(), "{stem}");
            assert_eq!(head(&format!("{text}// area in mm²\n(a: 1)\n")), *text);
        }
        let view = Tolerances::of(usual("view")).unwrap();
        assert!(view.named["pixels"].allows(100.0, 104.0) && !view.named["pixels"].allows(100.0, 104.5));
        assert_eq!(Tolerances::of(usual("images")).unwrap().pictures, PictureTolerance { mean: 0.5, most: 12.0 });
    }

    #[test]
    fn what_is_not_understood_is_named() {
        for bad in
            ["of area ±1", ": 0.1", ": ±-1", "of x: ±1 ±2", ": ±1 ±2 ±3 %", "of pictures: mean 1", "s: ±1", ": ±inf"]
        {
            let unclear =
                Tolerances::of(&format!("// a\n// tolerance{}{bad}\n", if bad.starts_with("of") { " " } else { "" }));
            assert_eq!(unclear.map_err(|u| u.line), Err(2), "{bad}");
        }
    }
}
