//! Outlines in numbers: corners rounded and cut off, and a formula that tells inside from outside.
//!
//! In: an [`Outline`] and values. Out: a [`Profile`]: lines and circles, and a [`Formula`] over their sides. A polygon is its
//! convex hull less its pockets, each again a hull less pockets (the convex deficiency tree of Sklansky, 1972); an arc adds
//! or takes away the segment between it and its chord. Says nothing of space: `primitive` extrudes or turns the profile.

use super::csg::Formula;
use super::tolerance;
use crate::design::model::{Corner, Outline, OutlinePath, Values};
use std::f64::consts::{PI, TAU};

type Point = [f64; 2];

/// An unbounded line or a whole circle, with an inside.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Carrier {
    /// Inside where `normal · p < offset`.
    Line {
        normal: Point,
        offset: f64,
    },
    Circle {
        centre: Point,
        radius: f64,
    },
}

/// An outline made of carriers.
#[derive(Debug, Clone)]
pub(super) struct Profile {
    /// With the name of the side; empty for a line that only the formula needs.
    pub carriers: Vec<(Carrier, String)>,
    pub formula: Formula,
    pub low: Point,
    pub high: Point,
}

impl Profile {
    /// Errors say what is wrong, to follow the feature's name.
    pub fn new(outline: &Outline, values: &Values) -> Result<Self, String> {
        let mut pieces = pieces(outline, values)?;
        if signed_area(&pieces) < 0.0 {
            pieces = pieces.iter().rev().map(Piece::reversed).collect();
        }
        let pieces = separated(pieces.iter().flat_map(|p| p.split(STEEPEST)).collect())?;
        let mut carriers = Carriers::default();
        let formula = carriers.region(&pieces);
        let ends = pieces.iter().flat_map(Piece::extremes);
        let (low, high) = ends.fold(([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]), |(low, high), p| {
            ([low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])])
        });
        Ok(Profile { carriers: carriers.list, formula, low, high })
    }
}

/// Sides shorter than this (mm) are no sides.
const SHORTEST: f64 = 10.0 * tolerance::WELD;
/// Arcs are split so that each turns by at most this (rad): its tangents at both ends then meet near it.
const STEEPEST: f64 = 1.8;
/// How often arcs that come near another side are halved before they count as touching it.
const ROUNDS: usize = 8;

/// A straight or round side.
#[derive(Debug, Clone)]
struct Piece {
    from: Point,
    to: Point,
    arc: Option<Bow>,
    name: String,
}

/// Centre, and the angle swept, positive counter-clockwise.
#[derive(Debug, Clone, Copy)]
struct Bow {
    centre: Point,
    radius: f64,
    sweep: f64,
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn along(a: Point, d: Point, by: f64) -> Point {
    [a[0] + d[0] * by, a[1] + d[1] * by]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn length(a: Point) -> f64 {
    a[0].hypot(a[1])
}

/// The sides as drawn, then the corners worked in.
fn pieces(outline: &Outline, values: &Values) -> Result<Vec<Piece>, String> {
    let at = |p: &[crate::design::model::Expr; 2]| [p[0].eval(values), p[1].eval(values)];
    let start = at(&outline.start);
    let mut pieces: Vec<Piece> = Vec::new();
    let mut corners: Vec<&Corner> = Vec::new();
    let mut from = start;
    for side in &outline.sides {
        let to = at(&side.to);
        pieces.push(Piece::drawn(from, to, &side.path, &side.name, values)?);
        corners.push(&side.corner);
        from = to;
    }
    if length(minus(from, start)) > SHORTEST {
        let name = (pieces.len() + 1).to_string();
        pieces.push(Piece { from, to: start, arc: None, name });
        corners.push(&outline.start_corner);
    } else if let (Some(last), Some(corner)) = (pieces.last_mut(), corners.last_mut()) {
        last.to = start;
        if matches!(corner, Corner::Sharp) {
            *corner = &outline.start_corner;
        }
    }
    let finite = pieces.iter().all(|p| p.to.iter().all(|c| c.abs() <= super::primitive::LARGEST));
    if pieces.len() < 2 || !finite {
        return Err("has an outline without an inside, or out of reach".into());
    }
    with_corners(&pieces, &corners, values)
}

/// Cuts off and rounds the corners between straight sides.
fn with_corners(pieces: &[Piece], corners: &[&Corner], values: &Values) -> Result<Vec<Piece>, String> {
    let mut cut: Vec<Piece> = pieces.to_vec();
    let mut worked = Vec::new();
    for (i, corner) in corners.iter().enumerate() {
        let next = (i + 1) % pieces.len();
        let size = match corner {
            Corner::Sharp => {
                worked.push(None);
                continue;
            }
            Corner::Round(size) | Corner::Chamfer(size) => size.eval(values),
        };
        if pieces[i].arc.is_some() || pieces[next].arc.is_some() {
            return Err(format!(
                "has a corner at the end of side `{}` that is not between straight sides",
                pieces[i].name
            ));
        }
        let (back, on) = (pieces[i].direction(), pieces[next].direction());
        let turn = cross(back, on).atan2(dot(back, on));
        let round = matches!(corner, Corner::Round(_));
        let reach = if round { size * (turn.abs() / 2.0).tan() } else { size };
        if !(size > SHORTEST && reach.is_finite()) {
            return Err(format!("has a corner at the end of side `{}` that is not above zero", pieces[i].name));
        }
        let (from, to) = (along(pieces[i].to, back, -reach), along(pieces[i].to, on, reach));
        (cut[i].to, cut[next].from) = (from, to);
        let centre = along(from, [-back[1], back[0]], size * turn.signum());
        let arc = round.then_some(Bow { centre, radius: size, sweep: turn });
        worked.push(Some(Piece { from, to, arc, name: format!("{}_corner", pieces[i].name) }));
    }
    let mut all = Vec::new();
    for ((side, corner), drawn) in cut.into_iter().zip(worked).zip(pieces) {
        let left = dot(minus(side.to, side.from), drawn.direction());
        if side.arc.is_none() && left < -SHORTEST {
            return Err(format!("has corners that use up more than side `{}`", drawn.name));
        }
        if side.arc.is_some() || left > SHORTEST {
            all.push(side);
        }
        all.extend(corner);
    }
    Ok(all)
}

impl Piece {
    fn drawn(from: Point, to: Point, path: &OutlinePath, name: &str, values: &Values) -> Result<Piece, String> {
        let chord = length(minus(to, from));
        if chord.is_nan() || chord <= SHORTEST {
            return Err(format!("has an outline whose side `{name}` has no length"));
        }
        let arc = match path {
            OutlinePath::Line => None,
            OutlinePath::Arc { radius, left, long } => {
                let radius = radius.eval(values);
                let rise = radius * radius - chord * chord / 4.0;
                if radius.is_nan() || radius <= SHORTEST || rise < -tolerance::POINT * radius {
                    return Err(format!(
                        "has an arc `{name}` whose ends are {chord:.4} mm apart, more than its diameter"
                    ));
                }
                let direction = [(to[0] - from[0]) / chord, (to[1] - from[1]) / chord];
                let aside = if left == long { -1.0 } else { 1.0 } * rise.max(0.0).sqrt();
                let middle = along(from, direction, chord / 2.0);
                let centre = along(middle, [-direction[1], direction[0]], aside);
                // From the centre as computed, so that both ends lie on the circle alike.
                let radius = length(minus(from, centre));
                let (a, b) = (minus(from, centre), minus(to, centre));
                let short = cross(a, b).atan2(dot(a, b)).abs();
                let sweep = if *long { TAU - short } else { short };
                Some(Bow { centre, radius, sweep: if *left { sweep } else { -sweep } })
            }
        };
        Ok(Piece { from, to, arc, name: name.to_string() })
    }

    fn direction(&self) -> Point {
        let d = minus(self.to, self.from);
        [d[0] / length(d), d[1] / length(d)]
    }

    fn reversed(&self) -> Piece {
        let arc = self.arc.map(|bow| Bow { sweep: -bow.sweep, ..bow });
        Piece { from: self.to, to: self.from, arc, name: self.name.clone() }
    }

    /// In equal parts that turn by at most `most`.
    fn split(&self, most: f64) -> Vec<Piece> {
        let Some(bow) = self.arc else { return vec![self.clone()] };
        let parts = (bow.sweep.abs() / most).ceil().max(1.0) as usize;
        let start = minus(self.from, bow.centre);
        let turned = |k: usize| {
            let (sin, cos) = (bow.sweep * k as f64 / parts as f64).sin_cos();
            [bow.centre[0] + start[0] * cos - start[1] * sin, bow.centre[1] + start[0] * sin + start[1] * cos]
        };
        let end = |k: usize| {
            if k == 0 {
                self.from
            } else if k == parts {
                self.to
            } else {
                turned(k)
            }
        };
        let part = |k| Piece {
            from: end(k),
            to: end(k + 1),
            arc: Some(Bow { sweep: bow.sweep / parts as f64, ..bow }),
            name: self.name.clone(),
        };
        (0..parts).map(part).collect()
    }

    /// Twice the area between the piece and the origin.
    fn double_area(&self) -> f64 {
        let segment = self.arc.map_or(0.0, |b| b.radius * b.radius * (b.sweep - b.sweep.sin()));
        cross(self.from, self.to) + segment
    }

    /// Corners of a triangle round the piece: its ends and where its tangents meet.
    fn hull(&self) -> Vec<Point> {
        let mut hull = vec![self.from, self.to];
        if let Some(bow) = self.arc {
            let middle = minus([(self.from[0] + self.to[0]) / 2.0, (self.from[1] + self.to[1]) / 2.0], bow.centre);
            let stretch = 1.0 / (bow.sweep / 2.0).cos().powi(2);
            hull.push(along(bow.centre, middle, stretch));
        }
        hull
    }

    /// Points of a box round the piece.
    fn extremes(&self) -> Vec<Point> {
        self.hull()
    }
}

fn signed_area(pieces: &[Piece]) -> f64 {
    pieces.iter().map(Piece::double_area).sum::<f64>() / 2.0
}

/// Halves arcs until no piece's triangle meets another's but at a common end.
fn separated(mut pieces: Vec<Piece>) -> Result<Vec<Piece>, String> {
    if signed_area(&pieces) < SHORTEST {
        return Err("has an outline without an inside".into());
    }
    for _ in 0..ROUNDS {
        let n = pieces.len();
        let mut close = vec![false; n];
        for i in 0..n {
            for j in i + 1..n {
                let shared = if (i + 1) % n == j {
                    Some(pieces[i].to)
                } else if (j + 1) % n == i {
                    Some(pieces[j].to)
                } else {
                    None
                };
                if n > 2 && meet(&pieces[i].hull(), &pieces[j].hull(), shared) || n == 2 {
                    let straight = pieces[i].arc.is_none() && pieces[j].arc.is_none();
                    if straight {
                        return Err(crossing(&pieces[i], &pieces[j]));
                    }
                    (close[i], close[j]) = (true, true);
                }
            }
        }
        if !close.contains(&true) {
            return Ok(pieces);
        }
        let halves = |(p, close): (&Piece, bool)| {
            let angle = p.arc.map_or(0.0, |b| b.sweep.abs());
            if close { p.split(angle * 0.5 + f64::EPSILON) } else { vec![p.clone()] }
        };
        pieces = pieces.iter().zip(close).flat_map(halves).collect();
    }
    let n = pieces.len();
    let pairs = (0..n).flat_map(|i| (i + 2..n).map(move |j| (i, j)));
    let near = pairs.filter(|(i, j)| (j + 1) % n != *i);
    let met = near.into_iter().find(|(i, j)| meet(&pieces[*i].hull(), &pieces[*j].hull(), None));
    let (i, j) = met.unwrap_or((0, 1));
    Err(crossing(&pieces[i], &pieces[j]))
}

fn crossing(a: &Piece, b: &Piece) -> String {
    format!("has an outline whose sides `{}` and `{}` cross or touch", a.name, b.name)
}

/// Whether two convex polygons come within tolerance of each other, other than at a corner they share.
fn meet(a: &[Point], b: &[Point], shared: Option<Point>) -> bool {
    if let Some(apex) = shared {
        return sectors_meet(a, b, apex);
    }
    !(apart(a, b) || apart(b, a))
}

/// Whether a line along an edge of `a`, or square to it, has the two on different sides.
fn apart(a: &[Point], b: &[Point]) -> bool {
    let n = a.len();
    (0..n).any(|i| {
        let d = minus(a[(i + 1) % n], a[i]);
        let size = length(d);
        let parts = |normal: Point| {
            let of = |points: &[Point]| {
                let heights = points.iter().map(|p| dot(minus(*p, a[i]), normal) / size);
                heights.fold([f64::INFINITY, f64::NEG_INFINITY], |r, h| [r[0].min(h), r[1].max(h)])
            };
            let (p, q) = (of(a), of(b));
            p[1] + SHORTEST < q[0] || q[1] + SHORTEST < p[0]
        };
        size > 0.0 && (parts([-d[1], d[0]]) || parts(d))
    })
}

/// Least angle (rad) that two sides may enclose at their corner.
const SHARPEST: f64 = 1e-6;

/// Whether two triangles with a common corner overlap: their directions seen from there do.
fn sectors_meet(a: &[Point], b: &[Point], apex: Point) -> bool {
    let directions = |points: &[Point]| -> Vec<f64> {
        let others = points.iter().map(|p| minus(*p, apex)).filter(|d| length(*d) > SHORTEST);
        others.map(|d| d[1].atan2(d[0])).collect()
    };
    let (a, b) = (directions(a), directions(b));
    let Some(&reference) = a.first() else { return false };
    let wrap = |x: f64| (x - reference + PI).rem_euclid(TAU) - PI;
    let range = |angles: &[f64]| {
        let first = angles.first().map_or(0.0, |x| wrap(*x));
        let spread = angles.iter().map(|x| (wrap(*x) - first + PI).rem_euclid(TAU) - PI);
        spread.fold([first, first], |r, d| [r[0].min(first + d), r[1].max(first + d)])
    };
    let (p, q) = (range(&a), range(&b));
    // The second range may lie a whole turn off.
    [-TAU, 0.0, TAU].iter().any(|t| p[0] < q[1] + t + SHARPEST && q[0] + t < p[1] + SHARPEST)
}

/// Collects carriers while formulas are made.
#[derive(Default)]
struct Carriers {
    list: Vec<(Carrier, String)>,
}

impl Carriers {
    fn region(&mut self, pieces: &[Piece]) -> Formula {
        let points: Vec<Point> = pieces.iter().map(|p| p.from).collect();
        let edges: Vec<usize> = pieces.iter().map(|p| self.chord(p)).collect();
        let corners: Vec<Vertex> =
            (0..points.len()).map(|i| Vertex { at: points[i], edge: edges[i], inside: true }).collect();
        let mut added = vec![self.polygon(&corners)];
        let mut taken = Vec::new();
        for (piece, chord) in pieces.iter().zip(&edges) {
            let Some(bow) = piece.arc else { continue };
            let circle =
                Formula::Side(self.push(Carrier::Circle { centre: bow.centre, radius: bow.radius }, &piece.name));
            if bow.sweep > 0.0 {
                added.push(Formula::All(vec![circle, Formula::not(Formula::Side(*chord))]));
            } else {
                taken.push(Formula::not(Formula::All(vec![circle, Formula::Side(*chord)])));
            }
        }
        let whole = if added.len() == 1 { added.remove(0) } else { Formula::Any(added) };
        if taken.is_empty() {
            return whole;
        }
        taken.insert(0, whole);
        Formula::All(taken)
    }

    fn push(&mut self, carrier: Carrier, name: &str) -> usize {
        self.list.push((carrier, name.to_string()));
        self.list.len() - 1
    }

    /// The line through the ends of a piece; it has a name where the piece is straight.
    fn chord(&mut self, piece: &Piece) -> usize {
        let name = if piece.arc.is_some() { "" } else { &piece.name };
        self.line(piece.from, piece.to, name)
    }

    /// Inside is on the left.
    fn line(&mut self, from: Point, to: Point, name: &str) -> usize {
        let d = minus(to, from);
        let normal = [d[1] / length(d), -d[0] / length(d)];
        self.push(Carrier::Line { normal, offset: dot(normal, from) }, name)
    }

    /// The hull of a simple polygon given counter-clockwise, less its pockets.
    fn polygon(&mut self, corners: &[Vertex]) -> Formula {
        let n = corners.len();
        let hull = hull(corners);
        let mut terms = Vec::new();
        let mut pockets = Vec::new();
        for (k, &a) in hull.iter().enumerate() {
            let b = hull[(k + 1) % hull.len()];
            let between: Vec<usize> = (1..).map(|s| (a + s) % n).take_while(|i| *i != b).collect();
            let (from, to) = (corners[a].at, corners[b].at);
            if between.iter().all(|i| off_line(from, to, corners[*i].at).abs() < SHORTEST) {
                terms.push(corners[a].literal());
                continue;
            }
            let lid = self.line(from, to, "");
            terms.push(Formula::Side(lid));
            // The pocket's border: along the lid, then back along the chain with its other side inside.
            let mut pocket = vec![Vertex { at: from, edge: lid, inside: true }];
            let chain: Vec<usize> = std::iter::once(a).chain(between).collect();
            let back = chain.iter().rev().scan(b, |corner, &edge| {
                let vertex =
                    Vertex { at: corners[*corner].at, edge: corners[edge].edge, inside: !corners[edge].inside };
                *corner = edge;
                Some(vertex)
            });
            pocket.extend(back);
            pockets.push(pocket);
        }
        for pocket in pockets {
            let inside = self.polygon(&pocket);
            terms.push(Formula::not(inside));
        }
        Formula::All(terms)
    }
}

/// A corner of a polygon and the carrier of the edge that leaves it.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    at: Point,
    edge: usize,
    /// Whether the polygon lies on the carrier's inside.
    inside: bool,
}

impl Vertex {
    fn literal(&self) -> Formula {
        let side = Formula::Side(self.edge);
        if self.inside { side } else { Formula::not(side) }
    }
}

/// Distance of `p` to the left of the line.
fn off_line(from: Point, to: Point, p: Point) -> f64 {
    let d = minus(to, from);
    cross(d, minus(p, from)) / length(d)
}

/// Corners of the convex hull, as places in the polygon, in its order (Jarvis 1973: polygons here are short).
fn hull(corners: &[Vertex]) -> Vec<usize> {
    let n = corners.len();
    let before = |a: &usize, b: &usize| {
        corners[*a].at[0].total_cmp(&corners[*b].at[0]).then(corners[*a].at[1].total_cmp(&corners[*b].at[1]))
    };
    let start = (0..n).min_by(before).unwrap_or(0);
    let mut hull = vec![start];
    loop {
        let here = hull[hull.len() - 1];
        let mut best = (here + 1) % n;
        for j in (0..n).filter(|j| *j != here) {
            let off = off_line(corners[here].at, corners[best].at, corners[j].at);
            let far = |k: usize| length(minus(corners[k].at, corners[here].at));
            if off < -SHORTEST || (off < SHORTEST && far(j) > far(best)) {
                best = j;
            }
        }
        if best == start || hull.len() > n {
            return hull;
        }
        hull.push(best);
    }
}

#[cfg(test)]
mod tests;
