//! A view written as SVG.
//!
//! In: components as they stand, and paths between them. Out: the file: what is seen of every line, scaled to the page, with
//! the names of the parts beside it. Arcs are written as curves, so they stay round at any size.

use super::super::ink::{BLACK, GREY, HEADING, NOTE, TEXT};
use super::super::svg::{Anchor, Path, Point, Svg};
use super::Item;
use super::anchor::{Piece, anchors};
use super::hidden::Covers;
use super::label::{self, Seen, Side};
use super::lines::{self, Circle, Line, Weight};
use super::projection::Projection;
use nalgebra::{Point3, Vector3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The drawing fits into this (px).
const PAGE: [f64; 2] = [620.0, 860.0];
/// Stretches shorter than this are specks, gaps shorter than this are none (px).
const SPECK: f64 = 0.7;
/// Points this near to the line between their neighbours say nothing (px).
const STRAIGHT: f64 = 0.06;
/// Widths of lines (px): outlines, edges, paths and leaders, as 4 : 2 : 1.
const WIDE: f64 = 1.6;
const NARROW: f64 = 0.8;
const FINE: f64 = 0.5;
/// A chain line: long dash, gap, dot, gap (px).
const CHAIN: &str = "10 2.5 1.5 2.5";
/// From the drawing to the names, and of that the level part of a leader (px).
const AWAY: f64 = 36.0;
const LEVEL: f64 = 10.0;
/// The end of a leader (px).
const END: f64 = 1.5;
/// From the drawing to its title (px).
const APART: f64 = 26.0;
/// From the middle of a line of text to its base line, in sizes of the font.
const BASE: f64 = 0.36;

/// The view of `items`, with `paths` in the assembly's frame.
pub(super) fn draw(title: &str, items: &[Item], paths: &[[Point3<f64>; 2]]) -> String {
    let projection = Projection::default();
    let all: Vec<Vec<Line>> = items.iter().map(|item| lines::lines(item, &projection)).collect();
    let covers = Covers::new(items.iter().flat_map(|item| triangles(item, &projection)));
    let page = Page::around(all.iter().flatten());
    let mut svg = Svg::default();
    let runs = |lines: &Vec<Line>| -> Vec<Run> { lines.iter().flat_map(|l| page.runs(l, &covers)).collect() };
    let runs: Vec<Vec<Run>> = all.iter().map(runs).collect();
    items.iter().zip(&runs).for_each(|(item, runs)| svg.named(item.name, |svg| draw_runs(svg, &page, runs)));
    svg.group(&chain(), |svg| paths.iter().for_each(|path| draw_path(svg, &page, &projection, path, &covers)));
    let anchors = anchors(&pieces(&page, &runs), items.len());
    let named = || items.iter().zip(&anchors);
    let seen = named().filter_map(|(item, at)| at.map(|[left, right]| Seen { name: item.name, left, right }));
    name_parts(&mut svg, &seen.collect::<Vec<_>>());
    let unseen: Vec<&str> = named().filter(|(_, at)| at.is_none()).map(|(item, _)| item.name).collect();
    surround(&mut svg, title, &unseen);
    svg.finish(title)
}

fn triangles<'a>(item: &'a Item, projection: &'a Projection) -> impl Iterator<Item = [Point3<f64>; 3]> + 'a {
    let points: Vec<Point3<f64>> =
        item.solid.mesh.positions.iter().map(|p| projection.point(&(item.pose * p))).collect();
    item.solid.mesh.triangles.iter().map(move |t| t.map(|i| points[i as usize]))
}

/// A stretch of a line that is seen.
struct Run {
    weight: Weight,
    points: Vec<Point3<f64>>,
    circle: Option<Circle>,
}

/// Where the drawing lies on the page.
struct Page {
    /// px per mm.
    scale: f64,
}

impl Page {
    fn around<'a>(lines: impl Iterator<Item = &'a Line>) -> Page {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in lines.flat_map(|l| &l.points) {
            low = [low[0].min(p.x), low[1].min(p.y)];
            high = [high[0].max(p.x), high[1].max(p.y)];
        }
        let fits = |i: usize| PAGE[i] / (high[i] - low[i]);
        let scale = fits(0).min(fits(1));
        Page { scale: if scale.is_finite() && scale > 0.0 { scale } else { 1.0 } }
    }

    fn px(&self, p: &Point3<f64>) -> Point {
        [p.x * self.scale, -p.y * self.scale]
    }

    /// The length on paper (px).
    fn length(&self, points: &[Point3<f64>]) -> f64 {
        points.windows(2).map(|p| (p[1] - p[0]).xy().norm() * self.scale).sum()
    }

    /// The stretches of a line that nothing covers.
    fn runs(&self, line: &Line, covers: &Covers) -> Vec<Run> {
        let mut runs: Vec<Vec<Point3<f64>>> = Vec::new();
        for (points, aside) in line.points.windows(2).zip(line.aside.windows(2)) {
            let (a, b) = (points[0], points[1]);
            for [low, high] in covers.seen(&(a + aside[0]), &(b + aside[1])) {
                let (from, to) = (a + (b - a) * low, a + (b - a) * high);
                match runs.last_mut() {
                    Some(run) if self.goes_on(run, &from) => run.push(to),
                    _ => runs.push(vec![from, to]),
                }
            }
        }
        runs.retain(|points| self.length(points) > SPECK);
        runs.into_iter().map(|points| Run { weight: line.weight, points, circle: line.circle }).collect()
    }

    /// Whether a run ends where another stretch begins, but for a gap that is none.
    fn goes_on(&self, run: &[Point3<f64>], from: &Point3<f64>) -> bool {
        run.last().is_some_and(|end| self.length(&[*end, *from]) < SPECK)
    }
}

/// What is seen of every part, piece by piece.
fn pieces(page: &Page, runs: &[Vec<Run>]) -> Vec<Piece> {
    let of_run = |part: usize, run: &Run| -> Vec<Piece> {
        run.points.windows(2).map(|p| Piece { part, ends: [page.px(&p[0]), page.px(&p[1])] }).collect()
    };
    runs.iter().enumerate().flat_map(|(part, runs)| runs.iter().flat_map(move |r| of_run(part, r))).collect()
}

fn draw_runs(svg: &mut Svg, page: &Page, runs: &[Run]) {
    for (weight, width) in [(Weight::Narrow, NARROW), (Weight::Wide, WIDE)] {
        let mut path = Path::default();
        runs.iter().filter(|r| r.weight == weight).for_each(|run| trace(&mut path, page, run));
        svg.path(&path, &format!("fill=\"none\" stroke=\"{BLACK}\" stroke-width=\"{width}\" stroke-linecap=\"round\" stroke-linejoin=\"round\""));
    }
}

/// Adds a run to a path: arcs as curves, everything else as straight pieces.
fn trace(path: &mut Path, page: &Page, run: &Run) {
    path.move_to(page.px(&run.points[0]));
    match run.circle {
        Some(circle) => arc(path, page, &run.points, &circle),
        None => {
            let flat: Vec<Point> = run.points.iter().map(|p| page.px(p)).collect();
            simplified(&flat).into_iter().skip(1).for_each(|p| path.line_to(p));
        }
    }
}

/// The arc through the points as cubic curves of a quarter turn at most: the projection of a circle's curve is the curve of
/// the projections.
fn arc(path: &mut Path, page: &Page, points: &[Point3<f64>], circle: &Circle) {
    let radii = points.windows(2).map(|p| {
        let (a, b) = (p[0] - circle.centre, p[1] - circle.centre);
        circle.axis.dot(&a.cross(&b)).atan2(a.dot(&b))
    });
    let whole: f64 = radii.sum::<f64>().clamp(-TAU, TAU);
    let pieces = (whole.abs() / FRAC_PI_2).ceil().max(1.0);
    let step = whole / pieces;
    let reach = 4.0 / 3.0 * (step / 4.0).tan();
    let turn = nalgebra::Rotation3::from_axis_angle(&circle.axis, step);
    let mut from: Vector3<f64> = points[0] - circle.centre;
    for _ in 0..pieces as usize {
        let to = turn * from;
        let controls = [from + circle.axis.cross(&from) * reach, to - circle.axis.cross(&to) * reach];
        path.curve_to(controls.map(|c| page.px(&(circle.centre + c))), page.px(&(circle.centre + to)));
        from = to;
    }
}

/// The points without those on the line between their neighbours (Douglas and Peucker 1973).
fn simplified(points: &[Point]) -> Vec<Point> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        (keep[first], keep[last]) = (true, true);
        let off = |i: usize| distance(points[i], points[first], points[last]);
        let far = (first + 1..last).max_by(|a, b| off(*a).total_cmp(&off(*b)));
        if let Some(far) = far.filter(|i| off(*i) > STRAIGHT) {
            open.extend([(first, far), (far, last)]);
        }
    }
    points.iter().zip(keep).filter_map(|(p, keep)| keep.then_some(*p)).collect()
}

/// From a point to the piece between two others.
fn distance(p: Point, a: Point, b: Point) -> f64 {
    let ([dx, dy], [px, py]) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = dx * dx + dy * dy;
    let share = if square > 0.0 { ((px * dx + py * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    (px - share * dx).hypot(py - share * dy)
}

fn chain() -> String {
    format!("fill=\"none\" stroke=\"{GREY}\" stroke-width=\"{FINE}\" stroke-dasharray=\"{CHAIN}\"")
}

/// What is seen of a path of insertion.
fn draw_path(svg: &mut Svg, page: &Page, projection: &Projection, ends: &[Point3<f64>; 2], covers: &Covers) {
    let [a, b] = [0, 1].map(|i| projection.point(&ends[i]));
    for [low, high] in covers.seen(&a, &b) {
        let [from, to] = [low, high].map(|share| page.px(&(a + (b - a) * share)));
        svg.line(from, to, "");
    }
}

/// Names beside the drawing, with leaders.
fn name_parts(svg: &mut Svg, seen: &[Seen]) {
    let Some([low, high]) = svg.extent() else { return };
    let labels = label::labels(seen, [low[0], high[0]], AWAY - LEVEL);
    svg.group(&format!("fill=\"none\" stroke=\"{GREY}\" stroke-width=\"{FINE}\""), |svg| {
        for label in &labels {
            let (x, out) = beside(label.side, [low[0], high[0]]);
            let mut path = Path::default();
            path.move_to([x, label.y]);
            path.line_to([x - out * LEVEL, label.y]);
            path.line_to(label.anchor);
            svg.path(&path, "");
            svg.circle(label.anchor, END, &format!("fill=\"{BLACK}\" stroke=\"none\""));
        }
    });
    svg.group(&format!("fill=\"{BLACK}\""), |svg| {
        for label in &labels {
            let (x, out) = beside(label.side, [low[0], high[0]]);
            let anchor = if label.side == Side::Left { Anchor::End } else { Anchor::Start };
            svg.text([x + 4.0 * out, label.y + BASE * TEXT], anchor, TEXT, label.name, "");
        }
    });
}

/// Where the leaders of a side end, and the direction away from the drawing.
fn beside(side: Side, borders: [f64; 2]) -> (f64, f64) {
    match side {
        Side::Left => (borders[0] - AWAY, -1.0),
        Side::Right => (borders[1] + AWAY, 1.0),
    }
}

/// The title above the drawing, and below it what cannot be seen.
fn surround(svg: &mut Svg, title: &str, unseen: &[&str]) {
    let [low, high] = svg.extent().unwrap_or([[0.0; 2]; 2]);
    svg.text(
        [low[0], low[1] - APART / 2.0],
        Anchor::Start,
        HEADING,
        title,
        &format!("fill=\"{BLACK}\" font-weight=\"bold\""),
    );
    if !unseen.is_empty() {
        let note = format!("Hidden: {}", unseen.join(", "));
        svg.text([low[0], high[1] + APART], Anchor::Start, NOTE, &note, &format!("fill=\"{GREY}\""));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::sample::plate;
    use nalgebra::Isometry3;

    /// A disc of ø40 × 20: what is seen is the whole upper rim, half of the lower one, and two sides.
    #[test]
    fn a_cylinder_shows_its_rims_and_two_sides() {
        let (radius, height) = (20.0, 20.0);
        let solid = plate("disc", height, 2.0 * radius, &[]);
        let projection = Projection::default();
        let item = Item { name: "disc", solid: &solid, pose: Isometry3::identity() };
        let lines = lines::lines(&item, &projection);
        let covers = Covers::new(triangles(&item, &projection));
        let page = Page { scale: 1.0 };
        let runs: Vec<Run> = lines.iter().flat_map(|l| page.runs(l, &covers)).collect();
        let drawn =
            |weight| -> f64 { runs.iter().filter(|r| r.weight == weight).map(|r| page.length(&r.points)).sum() };
        let [flat, up] = [projection.vector(&Vector3::z()).z, projection.vector(&Vector3::z()).y];
        let half_rim: f64 = (0..10_000)
            .map(|i| f64::from(i) / 10_000.0 * TAU / 2.0)
            .fold(0.0, |sum, t| sum + radius * t.sin().hypot(flat * t.cos()) * TAU / 20_000.0);
        let close = |a: f64, b: f64| (a - b).abs() < 0.01 * b;
        assert!(close(drawn(Weight::Narrow), half_rim), "{} {half_rim}", drawn(Weight::Narrow));
        let wide = 2.0 * half_rim + 2.0 * height * up;
        assert!(close(drawn(Weight::Wide), wide), "{} {wide}", drawn(Weight::Wide));
    }

    /// The middle of a curve of a quarter turn at most is on the circle to 0.03 % of its radius.
    #[test]
    fn an_arc_ends_where_its_points_end() {
        let circle = Circle { centre: Point3::origin(), axis: Vector3::z_axis() };
        let turn = |k: usize| TAU * k as f64 / 64.0;
        let points: Vec<Point3<f64>> = (0..=48).map(|k| Point3::new(turn(k).cos(), turn(k).sin(), 0.0)).collect();
        let mut path = Path::default();
        trace(&mut path, &Page { scale: 100.0 }, &Run { weight: Weight::Wide, points, circle: Some(circle) });
        let mut svg = Svg::default();
        svg.path(&path, "");
        let reach = svg.extent().unwrap();
        assert_eq!(reach.map(|c| c.map(f64::round)), [[-100.0, -100.0], [100.0, 100.0]]);
        assert_eq!(svg.finish("").matches("d=\"M100 0c").count(), 1);
    }

    #[test]
    fn straight_chains_keep_their_ends_only() {
        let chain: Vec<Point> = (0..50).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(simplified(&chain), [[0.0, 0.0], [49.0, 98.0]]);
        assert_eq!(simplified(&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]).len(), 3);
    }
}
