//! A photo with what was found drawn over it, after the paper's Figs. 11 to 13.
//!
//! In: the photo's bytes and the verdict. Out: a PNG. The tilted box shows where the assembly was found; every node of the
//! object tree has as many boxes as its level (the assembly itself is the first), joined at the corners to the node above
//! it; an X marks a mismatch: bold where a component is blamed, thin where another's fault explains it.

use super::font;
use crate::report::shrunk;
use crate::runtime::inspect::{Decision, NodeReport, Verdict};
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, Limits, Rgb, RgbImage};
use std::io::Cursor;

type Point = [f64; 2];

const ASSEMBLY: Rgb<u8> = Rgb([250, 200, 40]);
const GOOD: Rgb<u8> = Rgb([60, 220, 90]);
const FAULTY: Rgb<u8> = Rgb([255, 40, 40]);
const EXPLAINED: Rgb<u8> = Rgb([255, 150, 60]);
const PAPER: Rgb<u8> = Rgb([0, 0, 0]);
/// Boxes of one node lie this far inside one another (px).
const GAP: f64 = 3.0;
/// Side of a dot of the letters (px).
const DOT: u32 = 2;

/// The overlay as a PNG file; the reason why not, for photos that cannot be decoded.
pub fn png(photo: &[u8], verdict: &Verdict) -> Result<Vec<u8>, String> {
    let grey = decoded(photo).map_err(|e| e.to_string())?.into_luma8();
    let mut picture = RgbImage::from_fn(grey.width(), grey.height(), |x, y| Rgb([grey.get_pixel(x, y).0[0]; 3]));
    draw(&mut picture, verdict);
    let mut bytes = Vec::new();
    picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png).map_err(|e| e.to_string())?;
    Ok(bytes)
}

/// The photo may be anything: it was not said that it could be judged.
fn decoded(photo: &[u8]) -> Result<DynamicImage, ImageError> {
    const LARGEST: u64 = 256 << 20;
    let mut limits = Limits::default();
    limits.max_alloc = Some(LARGEST);
    let mut reader = ImageReader::new(Cursor::new(photo)).with_guessed_format()?;
    reader.limits(limits);
    reader.decode()
}

fn draw(picture: &mut RgbImage, verdict: &Verdict) {
    let mut pen = Pen { picture };
    for node in &verdict.nodes {
        let above = node.parent.and_then(|p| verdict.nodes.get(p)).map(|n| n.outline).or(verdict.outline);
        if let Some(above) = above {
            pen.line(above[0], node.outline[0], colour(node), 1);
        }
    }
    if let Some(outline) = verdict.outline {
        // A little outside the outermost node, whose box would cover it.
        pen.quad(shrunk(outline, -GAP), ASSEMBLY, 2);
    }
    verdict.nodes.iter().for_each(|node| pen.node(node));
    for (row, finding) in verdict.findings.iter().enumerate() {
        pen.text([6, 24 + 16 * row as u32], &format!("{}: {}", finding.component, finding.fault), FAULTY);
    }
    let (word, ink) = match verdict.decision {
        Decision::Go => ("go", GOOD),
        Decision::NoGo => ("no-go", FAULTY),
        Decision::CannotInspect => ("cannot inspect", ASSEMBLY),
    };
    pen.text([6, 6], word, ink);
}

fn colour(node: &NodeReport) -> Rgb<u8> {
    match (node.faulty, node.explained) {
        (false, _) => GOOD,
        (true, true) => EXPLAINED,
        (true, false) => FAULTY,
    }
}

struct Pen<'a> {
    picture: &'a mut RgbImage,
}

impl Pen<'_> {
    fn node(&mut self, node: &NodeReport) {
        let ink = colour(node);
        for ring in 0..=node.level {
            self.quad(shrunk(node.outline, GAP * f64::from(ring)), ink, 1);
        }
        if node.faulty {
            let [a, b, c, d] = node.crossed;
            let width = if node.explained { 1 } else { 3 };
            self.line(a, c, ink, width);
            self.line(b, d, ink, width);
        }
    }

    fn quad(&mut self, corners: [Point; 4], ink: Rgb<u8>, width: u32) {
        for i in 0..4 {
            self.line(corners[i], corners[(i + 1) % 4], ink, width);
        }
    }

    /// A line of square dots, one a pixel of its longer side.
    fn line(&mut self, from: Point, to: Point, ink: Rgb<u8>, width: u32) {
        /// No photo is larger; wild coordinates are not worth drawing.
        const FARTHEST: f64 = 50_000.0;
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        let length = dx.abs().max(dy.abs());
        if !from.iter().chain(&to).all(|v| v.abs() < FARTHEST) {
            return;
        }
        let steps = length.ceil().max(1.0);
        for i in 0..=steps as u32 {
            let t = f64::from(i) / steps;
            let offset = f64::from(width - 1) / 2.0;
            self.square([from[0] + dx * t - offset, from[1] + dy * t - offset], width, ink);
        }
    }

    fn square(&mut self, corner: Point, side: u32, ink: Rgb<u8>) {
        let [x, y] = corner.map(|v| v.floor() as i64);
        for (x, y) in (0..i64::from(side)).flat_map(|j| (0..i64::from(side)).map(move |i| (x + i, y + j))) {
            let inside =
                x >= 0 && y >= 0 && x < i64::from(self.picture.width()) && y < i64::from(self.picture.height());
            if inside {
                self.picture.put_pixel(x as u32, y as u32, ink);
            }
        }
    }

    /// Letters on a dark ground.
    fn text(&mut self, [left, top]: [u32; 2], text: &str, ink: Rgb<u8>) {
        let [wide, high] = font::SIZE;
        for (i, letter) in text.chars().enumerate() {
            let x = left + i as u32 * (wide + 1) * DOT;
            for (row, bits) in (0..high + 2).zip([0].into_iter().chain(font::rows(letter)).chain([0])) {
                for column in 0..=wide {
                    let set = column < wide && bits >> (wide - 1 - column) & 1 == 1;
                    let at = [x + column * DOT, top + row * DOT].map(f64::from);
                    self.square(at, DOT, if set { ink } else { PAPER });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::pose::Pose;

    fn node(level: u32, faulty: bool) -> NodeReport {
        NodeReport {
            name: "pin".into(),
            level,
            parent: None,
            outline: [[10.0, 10.0], [50.0, 10.0], [50.0, 40.0], [10.0, 40.0]],
            crossed: [[10.0, 10.0], [50.0, 10.0], [50.0, 40.0], [10.0, 40.0]],
            score: 0.0,
            against: Vec::new(),
            best_fault: "missing".into(),
            inside: 1.0,
            unlike: Default::default(),
            strangeness: 0.0,
            lift: None,
            beyond: 0.0,
            faulty,
            explained: false,
        }
    }

    fn overlay(node: NodeReport) -> RgbImage {
        let verdict = Verdict {
            decision: Decision::Go,
            reason: String::new(),
            pose: Some(Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 }),
            scale: 1.0,
            locator_score: 1.0,
            findings: Vec::new(),
            nodes: vec![node],
            outline: Some([[2.0, 2.0], [60.0, 2.0], [60.0, 44.0], [2.0, 44.0]]),
        };
        let mut photo = Vec::new();
        image::GrayImage::new(64, 48).write_to(&mut Cursor::new(&mut photo), ImageFormat::Png).unwrap();
        image::load_from_memory(&png(&photo, &verdict).unwrap()).unwrap().into_rgb8()
    }

    #[test]
    fn a_node_has_a_box_for_the_assembly_and_one_for_each_level() {
        for level in 1..4 {
            let picture = overlay(node(level, false));
            let right = (31..=50).filter(|&x| *picture.get_pixel(x, 28) == GOOD).count();
            assert_eq!(right, level as usize + 1);
        }
    }

    #[test]
    fn a_fault_is_crossed_out() {
        let picture = overlay(node(1, true));
        assert_eq!(*picture.get_pixel(30, 25), FAULTY);
        assert_ne!(*overlay(node(1, false)).get_pixel(30, 25), FAULTY);
    }

    #[test]
    fn rubbish_has_no_overlay_and_wild_corners_are_left_out() {
        let mut wild = node(1, true);
        wild.outline[2] = [f64::NAN, 1e30];
        overlay(wild.clone());
        let verdict = Verdict {
            decision: Decision::Go,
            reason: String::new(),
            pose: None,
            scale: 1.0,
            locator_score: 0.0,
            findings: Vec::new(),
            nodes: vec![wild],
            outline: None,
        };
        assert!(png(b"rubbish", &verdict).is_err());
    }
}
