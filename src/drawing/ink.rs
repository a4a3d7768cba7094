//! What lines and colours mean, the same in every picture.
//!
//! In: contacts. Out: colours, words and legends. Colour tells the class of a fit and nothing else; the colours keep apart
//! for readers with any kind of colour vision, and as greys.

use super::svg::{Anchor, Point, Svg, text_width};
use crate::assembly::contact::{Contact, ContactKind, Fit};

/// Outlines and text.
pub const BLACK: &str = "#1a1a1a";
/// Frames, leaders, notes.
pub const GREY: &str = "#6b6b6b";
/// Inside of the boxes.
pub const PAPER: &str = "#f6f6f4";

/// Size of text, of notes and of headings (px).
pub const TEXT: f64 = 11.0;
pub const NOTE: f64 = 10.0;
pub const HEADING: f64 = 12.5;
/// Radius of the circle that stands for a surface (px).
pub const DOT: f64 = 3.2;
/// Between the entries of a legend, and from a sample to its word (px).
const LEGEND_GAP: f64 = 22.0;
const SAMPLE: f64 = 22.0;

/// How two surfaces fit, as far as a picture tells it apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// No sizes to compare: planes and cones bear on each other.
    Seat,
    Clearance,
    Transition,
    Interference,
}

impl Class {
    const ALL: [Class; 4] = [Class::Seat, Class::Clearance, Class::Transition, Class::Interference];

    pub fn of(contact: &Contact) -> Class {
        match contact.fit {
            None => Class::Seat,
            Some(Fit::Clearance) => Class::Clearance,
            Some(Fit::Transition) => Class::Transition,
            Some(Fit::Interference) => Class::Interference,
        }
    }

    pub fn colour(self) -> &'static str {
        match self {
            Class::Seat => "#3d3d3d",
            Class::Clearance => "#2b7bba",
            Class::Transition => "#d98b00",
            Class::Interference => "#c0272d",
        }
    }

    pub fn word(self) -> &'static str {
        match self {
            Class::Seat => "seat",
            Class::Clearance => "clearance fit",
            Class::Transition => "transition fit",
            Class::Interference => "interference fit",
        }
    }
}

/// The circle of a surface: open for a plane, full for a round one.
pub fn dot(svg: &mut Svg, at: Point, round: bool) {
    svg.circle(at, DOT, if round { "fill=\"#1a1a1a\"" } else { "fill=\"#fff\"" });
}

/// Whether a surface is drawn as a full circle.
pub fn is_round(contact: &Contact) -> bool {
    contact.kind != ContactKind::Plane
}

/// `clearance fit 0.004 … 0.024 mm, 69.12 mm²`
pub fn figures(contact: &Contact) -> String {
    let [low, high] = contact.gap_range;
    let gap = match Class::of(contact) {
        Class::Seat if low == 0.0 && high == 0.0 => String::new(),
        _ => format!(" {} … {} mm", short(low, 4), short(high, 4)),
    };
    format!("{}{gap}, {} mm²", Class::of(contact).word(), short(contact.area, 2))
}

/// A number without the zeros at its end.
fn short(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// One entry of a legend: how it looks, and its word.
pub struct Entry<'a> {
    pub sample: Sample,
    pub word: &'a str,
}

pub enum Sample {
    Wire(Class),
    Dashed,
    Dot { round: bool },
}

/// What the lines of these classes and the circles of these surfaces (round or plane) mean: what is not drawn has no entry.
pub fn entries(classes: &[Class], rounds: &[bool]) -> Vec<Entry<'static>> {
    let wires = Class::ALL.into_iter().filter(|c| classes.contains(c));
    let wires = wires.map(|c| Entry { sample: Sample::Wire(c), word: c.word() });
    let dots =
        [(false, "plane surface"), (true, "round surface")].into_iter().filter(|(round, _)| rounds.contains(round));
    wires.chain(dots.map(|(round, word)| Entry { sample: Sample::Dot { round }, word })).collect()
}

/// A row of samples and words, its top left corner at `at`.
pub fn legend(svg: &mut Svg, at: Point, entries: &[Entry]) {
    let middle = at[1] + NOTE / 2.0;
    let mut left = at[0];
    for entry in entries {
        let right = match entry.sample {
            Sample::Wire(class) => {
                svg.line([left, middle], [left + SAMPLE, middle], &wire(class));
                left + SAMPLE
            }
            Sample::Dashed => {
                svg.line([left, middle], [left + SAMPLE, middle], &dashed());
                left + SAMPLE
            }
            Sample::Dot { round } => {
                svg.group(&format!("stroke=\"{BLACK}\""), |svg| dot(svg, [left + DOT, middle], round));
                left + 2.0 * DOT
            }
        };
        svg.text([right + 5.0, middle + 0.35 * NOTE], Anchor::Start, NOTE, entry.word, &format!("fill=\"{BLACK}\""));
        left = right + 5.0 + text_width(entry.word, NOTE) + LEGEND_GAP;
    }
}

/// Attributes of a line between two surfaces.
pub fn wire(class: Class) -> String {
    format!("fill=\"none\" stroke=\"{}\" stroke-width=\"1.3\"", class.colour())
}

/// Attributes of a line that closes a loop.
pub fn dashed() -> String {
    format!("fill=\"none\" stroke=\"{GREY}\" stroke-width=\"1\" stroke-dasharray=\"5 3\"")
}
