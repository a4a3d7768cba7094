//! Writes a feature list as a part of this language.
//!
//! In: steps with patterns. Out: the text of a spec with one part, in canonical layout, with names a person can go on from.

use super::feature::{Item, Op, Outline, Pattern, Shape, Step};
use super::lower::FACETED;
use super::placement::Placement;
use crate::diag::{Diagnostic, Span};
use std::collections::BTreeMap;

/// Coordinates and sizes are written to five decimals where that is what they are (mm).
const DIGITS: f64 = 1e5;
const MEANT: f64 = 5e-8;
/// Others to eight: solids tell corners apart that are 1e-7 mm from each other.
const MANY_DIGITS: f64 = 1e8;
/// Sizes that ISO 2768 has general tolerances for (mm); there is none for the point of a cone.
const GENERAL: std::ops::Range<f64> = 0.5..4000.0;
/// A cut whose ends are no farther inside than this goes through (mm).
const THROUGH: f64 = 1e-6;

/// The text of the part called `name`, drawn in `file`; of several they have numbers.
pub fn parts(parts: &[Vec<Step>], file: &str, name: &str) -> Result<String, Vec<Diagnostic>> {
    let own = |i: usize| if parts.len() == 1 { name.to_string() } else { format!("{name}_{}", i + 1) };
    let parts: String = parts.iter().enumerate().map(|(i, steps)| part(steps, &own(i), name)).collect();
    let file = file.replace(['\n', '\r'], " ");
    let text = format!(
        "gonogo 1\n\nunits mm deg\ntolerances ISO2768-m\n\n\
         // From {file}, which OpenSCAD wrote. Sizes have the general tolerance of the line above, places and outlines are exact:\n\
         // give what matters a tolerance of its own. A size is `basic` where a face of another feature lies on its own: name it\n\
         // with `let`, and use that name in both. Round shapes are round; those of {FACETED} facets ($fn) or fewer are prisms.\n\n\
         material {name}_surface {{\nkind = matt\n}}\n\n\
         {parts}"
    );
    crate::syntax::format(&text).map_err(|faults| {
        let why = faults.first().map_or(String::new(), |fault| fault.message.clone());
        let message = format!("`{name}` cannot be the name of a part, or the part is too large: {why}");
        vec![Diagnostic::error("E0903", Span::default(), message).label("nothing is written")]
    })
}

fn part(steps: &[Step], name: &str, family: &str) -> String {
    let mut writer = Writer { outlines: Vec::new(), extent: extent(steps), names: Vec::new() };
    let features = writer.features(steps, true);
    let outlines: String = writer.outlines.iter().enumerate().map(|(i, o)| outline(i + 1, o)).collect();
    format!("part {name} {{\nmaterial = {family}_surface\n\n{outlines}{features}}}\n\n")
}

/// A box around all that is added.
pub fn extent(steps: &[Step]) -> [[f64; 3]; 2] {
    let mut found = [[f64::MAX; 3], [f64::MIN; 3]];
    for step in steps.iter().filter(|step| step.op == Op::Add) {
        let corners: Vec<[f64; 3]> = match &step.item {
            Item::Group(inner) => extent(inner).to_vec(),
            Item::Solid { shape, place } => {
                places(place, &step.pattern).iter().flat_map(|place| box_of(shape, place)).collect()
            }
        };
        for corner in corners {
            for axis in 0..3 {
                found[0][axis] = found[0][axis].min(corner[axis]);
                found[1][axis] = found[1][axis].max(corner[axis]);
            }
        }
    }
    found
}

fn box_of(shape: &Shape, place: &Placement) -> Vec<[f64; 3]> {
    let [low, high] = shape.extent();
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 0 { low[axis] } else { high[axis] });
    (0..8).map(|i| place.point(corner(i))).collect()
}

/// Where the copies of a pattern stand; their turns in a circle are left out, as a box around a circle of boxes has room.
pub fn places(place: &Placement, pattern: &Option<Pattern>) -> Vec<Placement> {
    let moved = |x: f64, y: f64, turn: f64| Placement {
        at: [place.at[0] + x, place.at[1] + y, place.at[2]],
        turn: [place.turn[0], place.turn[1], place.turn[2] + turn],
    };
    match pattern {
        None => vec![*place],
        Some(Pattern::Line { count, pitch, angle }) => {
            let (sin, cos) = angle.to_radians().sin_cos();
            (0..*count).map(|i| moved(cos * pitch * i as f64, sin * pitch * i as f64, 0.0)).collect()
        }
        Some(Pattern::Grid { count, columns, x, y }) => {
            let rows = count / columns;
            let offset = |i: usize, n: usize| i as f64 - (n - 1) as f64 / 2.0;
            (0..*count).map(|i| moved(x * offset(i % columns, *columns), y * offset(i / columns, rows), 0.0)).collect()
        }
        Some(Pattern::Circle { count, d, from }) => {
            let angle = |i: usize| from + 360.0 * i as f64 / *count as f64;
            let arm = |i: usize| angle(i).to_radians().sin_cos();
            (0..*count).map(|i| moved(arm(i).1 * d / 2.0, arm(i).0 * d / 2.0, angle(i))).collect()
        }
    }
}

struct Writer {
    outlines: Vec<Outline>,
    extent: [[f64; 3]; 2],
    /// How often each name was used, a table for every group that is open.
    names: Vec<BTreeMap<&'static str, usize>>,
}

impl Writer {
    fn features(&mut self, steps: &[Step], top: bool) -> String {
        self.names.push(BTreeMap::new());
        let text = steps.iter().map(|step| self.feature(step, top)).collect();
        self.names.pop();
        text
    }

    fn feature(&mut self, step: &Step, top: bool) -> String {
        let op = match step.op {
            Op::Add => "add",
            Op::Cut => "cut",
            Op::Keep => "keep",
        };
        let name = self.name(step);
        match &step.item {
            Item::Group(inner) => {
                let inner = self.features(inner, false);
                format!("{op} {name} = group {{\n{inner}}}\n")
            }
            Item::Solid { shape, place } => {
                let through = top && step.op == Op::Cut && self.goes_through(shape, place, &step.pattern);
                let (count, on) = step.pattern.as_ref().map_or((String::new(), String::new()), pattern);
                format!(
                    "{op} {name} = {count}{}{}{on}\n",
                    self.shape(shape, &step.exact, through),
                    placed(place, through)
                )
            }
        }
    }

    /// `hole`, then `hole_2`.
    fn name(&mut self, step: &Step) -> String {
        let word = word(step);
        let Some(used) = self.names.last_mut() else { return word.to_string() };
        let number = used.entry(word).or_default();
        *number += 1;
        if *number == 1 { word.to_string() } else { format!("{word}_{number}") }
    }

    /// Whether a cut leaves the part at both ends: then it is drawn through.
    fn goes_through(&self, shape: &Shape, place: &Placement, pattern: &Option<Pattern>) -> bool {
        let h = match shape {
            Shape::Cylinder { h, .. } | Shape::Prism { h, .. } | Shape::Box { z: h, .. } => *h,
            _ => return false,
        };
        if self.extent[0][0] > self.extent[1][0] {
            return false;
        }
        places(place, pattern).iter().all(|place| {
            let (foot, top) = (place.point([0.0; 3]), place.point([0.0, 0.0, h]));
            let axis = [0, 1, 2].map(|i| (top[i] - foot[i]) / h);
            let along = |p: [f64; 3]| -> f64 { (0..3).map(|i| axis[i] * (p[i] - foot[i])).sum() };
            let corner = |i: usize| [0, 1, 2].map(|k| self.extent[i >> k & 1][k]);
            (0..8).map(|i| along(corner(i))).all(|t| t >= -THROUGH && t <= h + THROUGH)
        })
    }

    fn shape(&mut self, shape: &Shape, exact: &[&str], through: bool) -> String {
        let size = |name: &str, value: f64| match number(value) {
            text if exact.contains(&name) || !GENERAL.contains(&value) => format!("{name} = {text} basic"),
            text => format!("{name} = {text}"),
        };
        let height = |name: &str, h: f64| if through { format!("{name} = through") } else { size(name, h) };
        match shape {
            Shape::Box { x, y, z } => format!("box({}, {}, {})", size("x", *x), size("y", *y), height("z", *z)),
            Shape::Cylinder { d, h } => format!("cylinder({}, {})", size("d", *d), height("h", *h)),
            Shape::Frustum { d1, d2, h } => {
                format!("frustum({}, {}, {})", size("d1", *d1), size("d2", *d2), size("h", *h))
            }
            Shape::Sphere { d } => format!("sphere({})", size("d", *d)),
            Shape::Torus { d, tube } => format!("torus(d = {}, tube = {})", number(*d), number(*tube)),
            Shape::Prism { outline, h } => {
                format!("prism(outline = outline_{}, {})", self.outline(outline), height("h", *h))
            }
            Shape::Revolve { outline } => format!("revolve(outline = outline_{})", self.outline(outline)),
        }
    }

    /// The number of an outline, the same for equal ones.
    fn outline(&mut self, outline: &Outline) -> usize {
        let known = self.outlines.iter().position(|other| other == outline);
        known.unwrap_or_else(|| {
            self.outlines.push(outline.clone());
            self.outlines.len() - 1
        }) + 1
    }
}

fn word(step: &Step) -> &'static str {
    match (&step.item, step.op) {
        (Item::Group(_), Op::Cut) => "opening",
        (Item::Group(_), _) => "body",
        (Item::Solid { shape, .. }, op) => match (shape, op) {
            (_, Op::Keep) => "limit",
            (Shape::Box { .. }, Op::Cut) => "pocket",
            (Shape::Box { .. }, _) => "block",
            (Shape::Cylinder { .. }, Op::Cut) => "hole",
            (Shape::Cylinder { .. }, _) => "post",
            (Shape::Frustum { .. }, Op::Cut) => "sink",
            (Shape::Frustum { .. }, _) => "taper",
            (Shape::Sphere { .. }, Op::Cut) => "dent",
            (Shape::Sphere { .. }, _) => "ball",
            (Shape::Torus { .. }, Op::Cut) => "groove",
            (Shape::Torus { .. }, _) => "bead",
            (Shape::Prism { .. }, Op::Cut) => "cutout",
            (Shape::Prism { .. }, _) => "plate",
            (Shape::Revolve { .. }, Op::Cut) => "recess",
            (Shape::Revolve { .. }, _) => "turned",
        },
    }
}

/// `at (…) turn (…)`, as far as they are needed.
fn placed(place: &Placement, through: bool) -> String {
    let mut at = place.at;
    // Along its own axis a cut that goes through stands anywhere.
    let axis = match place.turn {
        [0.0, 0.0, _] => Some(2),
        [90.0 | -90.0, 0.0, 0.0] => Some(1),
        [0.0, 90.0 | -90.0, 0.0] => Some(0),
        _ => None,
    };
    if let (true, Some(axis)) = (through, axis) {
        at[axis] = 0.0;
    }
    let [x, y, z] = at.map(number);
    let moved = match (x.as_str(), y.as_str(), z.as_str()) {
        ("0", "0", "0") => String::new(),
        (_, _, "0") => format!(" at ({x}, {y})"),
        _ => format!(" at ({x}, {y}, {z})"),
    };
    let [a, b, c] = place.turn.map(number);
    let turned = if [&a, &b, &c].iter().all(|t| *t == "0") { String::new() } else { format!(" turn ({a}, {b}, {c})") };
    moved + &turned
}

/// Count and place of a pattern.
fn pattern(pattern: &Pattern) -> (String, String) {
    match pattern {
        Pattern::Line { count, pitch, angle } => {
            let angle = if number(*angle) == "0" { String::new() } else { format!(", angle = {}", number(*angle)) };
            (format!("{count}x "), format!(" on line(pitch = {}{angle})", number(*pitch)))
        }
        Pattern::Grid { count, columns, x, y } => {
            let on = format!(" on grid(columns = {columns}, x = {}, y = {})", number(*x), number(*y));
            (format!("{count}x "), on)
        }
        Pattern::Circle { count, d, from } => {
            let from = if number(*from) == "0" { String::new() } else { format!(", from = {}", number(*from)) };
            (format!("{count}x "), format!(" on circle(d = {}{from})", number(*d)))
        }
    }
}

fn outline(number_of: usize, outline: &Outline) -> String {
    let mut text = format!("outline outline_{number_of} {{\n");
    let round = if outline.round > 0.0 { format!(" round {} basic", number(outline.round)) } else { String::new() };
    let point = |[x, y]: [f64; 2]| format!("({}, {})", number(x), number(y));
    let arc = |side: usize| outline.arcs.iter().find(|(s, _)| *s == side).map(|(_, r)| *r);
    for (i, corner) in outline.corners.iter().enumerate() {
        text += &match (i, arc(i)) {
            (0, _) => format!("from {}{round}\n", point(*corner)),
            (_, Some(r)) => format!("arc to {} radius {} left\n", point(*corner), number(r)),
            (_, None) => format!("line to {}{round}\n", point(*corner)),
        };
    }
    if let (Some(r), Some(first)) = (arc(0), outline.corners.first()) {
        text += &format!("arc to {} radius {} left\n", point(*first), number(r));
    }
    text + "}\n\n"
}

/// With few digits where few are meant, and with many where the number is none: corners that coincide in the design have to
/// coincide here, to less than the solids can tell.
fn number(value: f64) -> String {
    let rounded = |digits: f64| (value * digits).round() / digits;
    let short = rounded(DIGITS);
    let value = if (value - short).abs() < MEANT { short } else { rounded(MANY_DIGITS) };
    if value == 0.0 { "0".to_string() } else { value.to_string() }
}
