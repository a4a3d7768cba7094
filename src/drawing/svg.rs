//! SVG as text: shapes go in, a self-contained file comes out.
//!
//! In: shapes in px, y downwards. Out: well-formed XML without scripts, style sheets or references to elsewhere, whose
//! `viewBox` is what was drawn plus a margin: nothing can lie outside. Coordinates are rounded to a fixed number of steps per px, paths
//! are written in relative steps of these, so rounding does not add up. Never knows what is drawn.

use std::fmt::Write;

/// Coordinates are whole multiples of this part of a px: a twentieth of the thinnest line.
const STEPS: f64 = 50.0;
/// White round what is drawn (px).
const MARGIN: f64 = 12.0;
/// The fonts asked for; any sans-serif will do.
const FONTS: &str = "Helvetica, Arial, sans-serif";
/// Room for fonts that run wider than Helvetica (DejaVu Sans does).
const WIDEST_FONT: f64 = 1.1;
/// Above and below the base line, in sizes of the font.
const ASCENT: f64 = 0.8;
const DESCENT: f64 = 0.25;

/// A point in px, y downwards.
pub type Point = [f64; 2];

/// Which end of a text its point is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A picture in the making.
#[derive(Debug, Clone)]
pub struct Svg {
    body: String,
    low: Point,
    high: Point,
}

impl Default for Svg {
    fn default() -> Self {
        Svg { body: String::new(), low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] }
    }
}

impl Svg {
    /// What `draw` adds shares these attributes, which are written as they are: `fill="none" stroke="#000"`.
    pub fn group(&mut self, attributes: &str, draw: impl FnOnce(&mut Svg)) {
        let _ = writeln!(self.body, "<g {attributes}>");
        draw(self);
        self.body.push_str("</g>\n");
    }

    /// What `draw` adds belongs to something with a name, which viewers show as a tool tip.
    pub fn named(&mut self, name: &str, draw: impl FnOnce(&mut Svg)) {
        let _ = writeln!(self.body, "<g><title>{}</title>", escaped(name));
        draw(self);
        self.body.push_str("</g>\n");
    }

    /// A rectangle between two corners, its own corners rounded to `radius` px.
    pub fn rect(&mut self, low: Point, high: Point, radius: f64, attributes: &str) {
        self.reach(low);
        self.reach(high);
        let [x, y] = low.map(number);
        let [w, h] = [0, 1].map(|i| number(high[i] - low[i]));
        let round = if radius > 0.0 { format!(" rx=\"{}\"", number(radius)) } else { String::new() };
        let _ = writeln!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\"{round}{}/>",
            spaced(attributes)
        );
    }

    pub fn circle(&mut self, centre: Point, radius: f64, attributes: &str) {
        self.reach(centre.map(|c| c - radius));
        self.reach(centre.map(|c| c + radius));
        let ([x, y], r) = (centre.map(number), number(radius));
        let _ = writeln!(self.body, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{r}\"{}/>", spaced(attributes));
    }

    pub fn line(&mut self, from: Point, to: Point, attributes: &str) {
        let mut path = Path::default();
        path.move_to(from);
        path.line_to(to);
        self.path(&path, attributes);
    }

    /// Nothing, where the path is empty.
    pub fn path(&mut self, path: &Path, attributes: &str) {
        if path.data.is_empty() {
            return;
        }
        self.reach(path.low);
        self.reach(path.high);
        let _ = writeln!(self.body, "<path d=\"{}\"{}/>", path.data, spaced(attributes));
    }

    /// A line of text whose base line begins, is centred or ends at `at`; `size` in px.
    pub fn text(&mut self, at: Point, anchor: Anchor, size: f64, text: &str, attributes: &str) {
        let width = if attributes.contains("bold") { bold_width(text, size) } else { text_width(text, size) };
        let left = match anchor {
            Anchor::Start => at[0],
            Anchor::Middle => at[0] - width / 2.0,
            Anchor::End => at[0] - width,
        };
        self.reach([left, at[1] - ASCENT * size]);
        self.reach([left + width, at[1] + DESCENT * size]);
        let ([x, y], size, text) = (at.map(number), number(size), escaped(text));
        let anchor = match anchor {
            Anchor::Start => "",
            Anchor::Middle => " text-anchor=\"middle\"",
            Anchor::End => " text-anchor=\"end\"",
        };
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\"{anchor}{}>{text}</text>",
            spaced(attributes)
        );
    }

    /// Lowest and highest corner of what is drawn so far; `None` before anything is.
    pub fn extent(&self) -> Option<[Point; 2]> {
        (self.low[0] <= self.high[0]).then_some([self.low, self.high])
    }

    /// The file, on white, with a title for readers who hear pictures.
    pub fn finish(self, title: &str) -> String {
        let [low, high] = self.extent().unwrap_or([[0.0; 2]; 2]);
        let (low, high) = (low.map(|c| (c - MARGIN).floor()), high.map(|c| (c + MARGIN).ceil()));
        let [x, y] = low.map(number);
        let [w, h] = [0, 1].map(|i| number(high[i] - low[i]));
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"{x} {y} {w} {h}\" \
             font-family=\"{FONTS}\">\n<title>{}</title>\n",
            escaped(title)
        );
        let _ = writeln!(text, "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" fill=\"#fff\"/>");
        text.push_str(&self.body);
        text.push_str("</svg>\n");
        text
    }

    fn reach(&mut self, point: Point) {
        (self.low, self.high) = reached(self.low, self.high, point);
    }
}

/// Lines and curves, each from where the one before ended.
#[derive(Debug, Clone)]
pub struct Path {
    data: String,
    /// Where the pen is, in whole steps.
    pen: [i64; 2],
    low: Point,
    high: Point,
}

impl Default for Path {
    fn default() -> Self {
        Path { data: String::new(), pen: [0; 2], low: [f64::INFINITY; 2], high: [f64::NEG_INFINITY; 2] }
    }
}

impl Path {
    pub fn move_to(&mut self, to: Point) {
        self.reach(to);
        self.pen = to.map(steps);
        let [x, y] = self.pen.map(stepped);
        let _ = write!(self.data, "M{x} {y}");
    }

    pub fn line_to(&mut self, to: Point) {
        self.reach(to);
        let [x, y] = self.relative(to);
        let _ = match (x.as_str(), y.as_str()) {
            (_, "0") => write!(self.data, "h{x}"),
            ("0", _) => write!(self.data, "v{y}"),
            _ => write!(self.data, "l{x} {y}"),
        };
        self.pen = to.map(steps);
    }

    /// A cubic curve with two control points.
    pub fn curve_to(&mut self, controls: [Point; 2], to: Point) {
        let points = [controls[0], controls[1], to];
        points.iter().for_each(|p| self.reach(*p));
        let [[a, b], [c, d], [x, y]] = points.map(|p| self.relative(p));
        let _ = write!(self.data, "c{a} {b} {c} {d} {x} {y}");
        self.pen = to.map(steps);
    }

    fn relative(&self, to: Point) -> [String; 2] {
        [0, 1].map(|i| stepped(steps(to[i]) - self.pen[i]))
    }

    fn reach(&mut self, point: Point) {
        (self.low, self.high) = reached(self.low, self.high, point);
    }
}

fn reached(low: Point, high: Point, point: Point) -> (Point, Point) {
    ([0, 1].map(|i| low[i].min(point[i])), [0, 1].map(|i| high[i].max(point[i])))
}

/// Whole steps; a coordinate that is no number becomes 0.
fn steps(value: f64) -> i64 {
    (value * STEPS).round() as i64
}

/// `12.34`, `5`, `-0.5`
fn number(value: f64) -> String {
    stepped(steps(value))
}

fn stepped(steps: i64) -> String {
    let text = format!("{:.2}", steps as f64 / STEPS);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

fn spaced(attributes: &str) -> String {
    if attributes.is_empty() { String::new() } else { format!(" {attributes}") }
}

/// Text as XML takes it, also inside quotes. What XML cannot hold becomes U+FFFD.
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

/// How wide a text is at most (px) in the sans-serif fonts in use, at a size in px.
pub fn text_width(text: &str, size: f64) -> f64 {
    text.chars().map(char_width).sum::<f64>() * size * WIDEST_FONT
}

/// The same in bold.
pub fn bold_width(text: &str, size: f64) -> f64 {
    const BOLDER: f64 = 1.12;
    BOLDER * text_width(text, size)
}

/// Advance widths of Helvetica in ems, to about 0.05.
fn char_width(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '\'' | '|' => 0.24,
        't' | 'f' | 'I' | '.' | ',' | ':' | ';' | '!' | '/' | '[' | ']' | ' ' | '·' => 0.28,
        'r' | '(' | ')' | '-' | '°' => 0.34,
        'c' | 'k' | 's' | 'v' | 'x' | 'y' | 'z' | 'J' => 0.5,
        'w' | 'C' | 'D' | 'H' | 'N' | 'R' | 'U' => 0.73,
        'm' | 'M' | 'O' | 'Q' | 'G' => 0.84,
        'W' | '@' | '…' | '→' | '↔' | '%' => 1.0,
        'A'..='Z' => 0.67,
        c if c.is_ascii() => 0.56,
        c if c < '\u{1100}' => 0.65,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let written = [0.0, -0.001, 5.0, -0.5, 12.344, 1e3].map(number);
        assert_eq!(written, ["0", "0", "5", "-0.5", "12.34", "1000"]);
    }

    #[test]
    fn names_cannot_break_the_file() {
        let mut svg = Svg::default();
        svg.text([0.0, 0.0], Anchor::Start, 10.0, "a<b & \"c\"\u{1}", "");
        let text = svg.finish("</title><script>");
        assert!(text.contains("a&lt;b &amp; &quot;c&quot;\u{fffd}"), "{text}");
        assert!(!text.contains("<script"), "{text}");
    }

    #[test]
    fn relative_steps_do_not_drift() {
        let mut path = Path::default();
        path.move_to([0.0, 0.0]);
        (1..=1000).for_each(|i| path.line_to([f64::from(i) * 0.013, 1.0 + f64::from(i % 2)]));
        assert_eq!(path.pen, [650, 50]);
    }

    #[test]
    fn the_view_box_holds_everything_drawn() {
        let mut svg = Svg::default();
        svg.circle([10.0, 20.0], 5.0, "");
        svg.text([0.0, 40.0], Anchor::End, 10.0, "mm", "");
        let text = svg.finish("t");
        let width = text_width("mm", 10.0);
        let left = (-width - MARGIN).floor();
        assert!(text.contains(&format!("viewBox=\"{left} 3 ")), "{text}");
    }
}
