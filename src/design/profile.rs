//! An outline with numbers: its straight and round stretches, corners included.
//!
//! In: an [`Outline`] and one value per dimension. Out: the [`Stretch`]es in order, closed, or the [`Fault`] that keeps
//! them from being one boundary. Pure plane geometry in mm: knows no part and reports nothing.

use super::model::{Corner, Outline, OutlinePath, Values};

/// Points closer than this are one (mm): a hundredth of what any drawing dimensions.
pub const SAME_POINT: f64 = 1e-6;

/// A point of the plane of the outline.
pub type Point = [f64; 2];

/// A stretch of the boundary, from where the one before it ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// The side it belongs to, counted from 0; the straight side that closes the outline comes last. A broken corner
    /// belongs to the side before it.
    pub side: usize,
    /// Whether it stands for the corner behind that side.
    pub corner: bool,
    pub from: Point,
    pub to: Point,
    pub bend: Option<Bend>,
}

/// The circle of an arc; `left` when it is run counter-clockwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    pub centre: Point,
    pub radius: f64,
    pub left: bool,
}

/// Why stretches do not make one boundary. Sides are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// A side ends where it begins.
    NoLength { side: usize },
    /// The radius of an arc is less than half the distance of its ends (mm).
    ShortRadius { side: usize, radius: f64, half: f64 },
    /// A corner next to an arc is to be broken: the corner where `side` ends.
    BesideArc { side: usize },
    /// Both the first and the last corner are given, and they are one.
    TwoCorners,
    /// Breaking the corner where `side` ends leaves nothing of a side beside it.
    NoRoom { side: usize },
    /// Two sides cross or touch.
    Touch { sides: [usize; 2], at: Point },
    /// The boundary encloses nothing.
    Flat,
}

/// The boundary at these values. Whether it meets itself is asked by [`touching`], which takes longer.
pub fn trace(outline: &Outline, values: &Values) -> Result<Vec<Stretch>, Fault> {
    let sides = straight_and_round(outline, values)?;
    let breaks = breaks(outline, values, &sides)?;
    let stretches = with_corners(&sides, &breaks)?;
    if area(&stretches).abs() < SAME_POINT * SAME_POINT { Err(Fault::Flat) } else { Ok(stretches) }
}

/// Enclosed area in mm²; positive when the boundary runs counter-clockwise.
pub fn area(stretches: &[Stretch]) -> f64 {
    let chord = |s: &Stretch| cross(s.from, s.to) / 2.0;
    let bow = |s: &Stretch| {
        s.bend.map_or(0.0, |b| {
            let angle = swept(s, &b);
            let segment = b.radius * b.radius * (angle - angle.sin()) / 2.0;
            if b.left { segment } else { -segment }
        })
    };
    stretches.iter().map(|s| chord(s) + bow(s)).sum()
}

/// Two sides that cross or touch elsewhere than where one follows the other.
pub fn touching(stretches: &[Stretch]) -> Option<Fault> {
    let n = stretches.len();
    for (i, a) in stretches.iter().enumerate() {
        for (k, b) in stretches.iter().enumerate().skip(i + 1) {
            let joins = |p: Point| (k == i + 1 && near(p, a.to)) || (i == 0 && k == n - 1 && near(p, a.from));
            if let Some(at) = meetings(a, b).into_iter().find(|p| !joins(*p)) {
                return Some(Fault::Touch { sides: [a.side, b.side], at });
            }
        }
    }
    None
}

impl Stretch {
    pub fn length(&self) -> f64 {
        self.bend.map_or(distance(self.from, self.to), |b| b.radius * swept(self, &b))
    }

    /// The point at share `t` of its length, and the direction to its right (outwards on a counter-clockwise boundary).
    pub fn at(&self, t: f64) -> (Point, Point) {
        match &self.bend {
            None => {
                let along = scaled(minus(self.to, self.from), 1.0 / distance(self.from, self.to));
                (plus(self.from, scaled(minus(self.to, self.from), t)), [along[1], -along[0]])
            }
            Some(b) => {
                let sign = if b.left { 1.0 } else { -1.0 };
                let start = minus(self.from, b.centre);
                let angle = start[1].atan2(start[0]) + sign * t * swept(self, b);
                let out = [angle.cos(), angle.sin()];
                (plus(b.centre, scaled(out, b.radius)), scaled(out, sign))
            }
        }
    }

    /// Signed distance of `p` from the line or circle it runs on: positive to its right.
    pub fn offset(&self, p: Point) -> f64 {
        match &self.bend {
            None => cross(minus(p, self.from), minus(self.to, self.from)) / distance(self.from, self.to),
            Some(b) => (distance(p, b.centre) - b.radius) * if b.left { 1.0 } else { -1.0 },
        }
    }

    /// The smallest x on it.
    pub fn least_x(&self) -> f64 {
        let ends = self.from[0].min(self.to[0]);
        let pole = self.bend.map(|b| [b.centre[0] - b.radius, b.centre[1]]);
        pole.filter(|p| self.holds(*p)).map_or(ends, |p| p[0].min(ends))
    }

    /// Whether `p`, which lies on its line or circle, lies between its ends.
    fn holds(&self, p: Point) -> bool {
        if near(p, self.from) || near(p, self.to) {
            return true;
        }
        match &self.bend {
            None => {
                let along = minus(self.to, self.from);
                (0.0..=dot(along, along)).contains(&dot(minus(p, self.from), along))
            }
            Some(b) => swept(&Stretch { to: p, ..*self }, b) <= swept(self, b),
        }
    }
}

/// Whether `p` lies inside the boundary: how often a ray in +x leaves it, by crossings of each stretch.
pub fn encloses(stretches: &[Stretch], p: Point) -> bool {
    stretches.iter().map(|s| crossings(s, p)).sum::<usize>() % 2 == 1
}

fn crossings(s: &Stretch, p: Point) -> usize {
    let Some(b) = &s.bend else {
        let above = (s.from[1] > p[1]) != (s.to[1] > p[1]);
        let share = (p[1] - s.from[1]) / (s.to[1] - s.from[1]);
        return usize::from(above && s.from[0] + share * (s.to[0] - s.from[0]) > p[0]);
    };
    // An arc is cut at the top and bottom of its circle into runs that only rise or only fall.
    let mut heights = vec![s.from];
    let mut poles: Vec<Point> = [1.0, -1.0].map(|v| [b.centre[0], b.centre[1] + v * b.radius]).to_vec();
    poles.retain(|q| !near(*q, s.from) && !near(*q, s.to) && s.holds(*q));
    poles.sort_by(|q, r| swept(&Stretch { to: *q, ..*s }, b).total_cmp(&swept(&Stretch { to: *r, ..*s }, b)));
    heights.extend(poles);
    heights.push(s.to);
    let run = |ends: &[Point]| {
        let above = (ends[0][1] > p[1]) != (ends[1][1] > p[1]);
        let reach = (b.radius * b.radius - (p[1] - b.centre[1]).powi(2)).max(0.0).sqrt();
        let right = (ends[0][0] + ends[1][0]) / 2.0 > b.centre[0];
        usize::from(above && b.centre[0] + if right { reach } else { -reach } > p[0])
    };
    heights.windows(2).map(run).sum()
}

/// The sides as written, each with the bend of an arc, and the straight one that closes the outline.
fn straight_and_round(outline: &Outline, values: &Values) -> Result<Vec<Stretch>, Fault> {
    let point = |p: &[super::model::Expr; 2]| [p[0].eval(values), p[1].eval(values)];
    let start = point(&outline.start);
    let mut from = start;
    let mut sides = Vec::new();
    for (side, written) in outline.sides.iter().enumerate() {
        let to = point(&written.to);
        if near(from, to) {
            return Err(Fault::NoLength { side });
        }
        let bend = match &written.path {
            OutlinePath::Line => None,
            OutlinePath::Arc { radius, left, long } => Some(bend(side, [from, to], radius.eval(values), *left, *long)?),
        };
        sides.push(Stretch { side, corner: false, from, to, bend });
        from = to;
    }
    if !near(from, start) {
        sides.push(Stretch { side: sides.len(), corner: false, from, to: start, bend: None });
    }
    Ok(sides)
}

/// The circle of this radius through both ends: its centre lies to the left of the chord when a short arc runs left.
fn bend(side: usize, [from, to]: [Point; 2], radius: f64, left: bool, long: bool) -> Result<Bend, Fault> {
    let half = distance(from, to) / 2.0;
    if radius < half - SAME_POINT {
        return Err(Fault::ShortRadius { side, radius, half });
    }
    let chord = scaled(minus(to, from), 0.5 / half);
    let height = (radius * radius - half * half).max(0.0).sqrt() * if left != long { 1.0 } else { -1.0 };
    let middle = scaled(plus(from, to), 0.5);
    Ok(Bend { centre: plus(middle, [-chord[1] * height, chord[0] * height]), radius, left })
}

/// What becomes of the corner behind each side: how far it is set back along both sides, and the radius of a round one.
#[derive(Clone, Copy)]
struct Break {
    setback: f64,
    radius: Option<f64>,
}

fn breaks(outline: &Outline, values: &Values, sides: &[Stretch]) -> Result<Vec<Option<Break>>, Fault> {
    let mut corners: Vec<&Corner> = outline.sides.iter().map(|s| &s.corner).collect();
    if corners.len() < sides.len() {
        corners.push(&outline.start_corner);
    } else if outline.start_corner != Corner::Sharp {
        if corners.last().is_some_and(|c| **c != Corner::Sharp) {
            return Err(Fault::TwoCorners);
        }
        corners.pop();
        corners.push(&outline.start_corner);
    }
    let broken = |(i, corner): (usize, &&Corner)| {
        let (here, next) = (&sides[i], &sides[(i + 1) % sides.len()]);
        let straight = here.bend.is_none() && next.bend.is_none();
        let of = |setback, radius| match straight {
            true => Ok(Some(Break { setback, radius })),
            false => Err(Fault::BesideArc { side: here.side }),
        };
        match corner {
            Corner::Sharp => Ok(None),
            Corner::Chamfer(size) => of(size.eval(values), None),
            Corner::Round(size) => {
                let radius = size.eval(values);
                let (a, b) = (minus(here.to, here.from), minus(next.to, next.from));
                let turn = cross(a, b).atan2(dot(a, b)).abs();
                of(radius * (turn / 2.0).tan(), Some(radius))
            }
        }
    };
    corners.iter().enumerate().map(broken).collect()
}

/// A straight side that its corners use up to the end is left out: two equal rounds make a full round.
fn with_corners(sides: &[Stretch], breaks: &[Option<Break>]) -> Result<Vec<Stretch>, Fault> {
    let n = sides.len();
    let back = |i: usize| breaks[i % n].map_or(0.0, |b| b.setback);
    let mut shortened = Vec::with_capacity(n);
    for (i, s) in sides.iter().enumerate() {
        let (before, behind) = (back(i + n - 1), back(i));
        let left = distance(s.from, s.to) - before - behind;
        if s.bend.is_none() && left < -SAME_POINT {
            let culprit = if behind > 0.0 { s } else { &sides[(i + n - 1) % n] };
            return Err(Fault::NoRoom { side: culprit.side });
        }
        let along = scaled(minus(s.to, s.from), 1.0 / distance(s.from, s.to));
        let (from, to) = (plus(s.from, scaled(along, before)), plus(s.to, scaled(along, -behind)));
        shortened.push(if before + behind > 0.0 { Stretch { from, to, ..*s } } else { *s });
    }
    let mut all = Vec::new();
    for (i, s) in shortened.iter().enumerate() {
        if s.bend.is_some() || !near(s.from, s.to) {
            all.push(*s);
        }
        if let Some(corner) = breaks[i] {
            all.push(corner_stretch([&sides[i], &sides[(i + 1) % n]], s.to, shortened[(i + 1) % n].from, corner));
        }
    }
    Ok(all)
}

/// The stretch that stands for the corner between two straight sides.
fn corner_stretch([a, b]: [&Stretch; 2], from: Point, to: Point, corner: Break) -> Stretch {
    let bend = corner.radius.map(|radius| {
        let along = scaled(minus(a.to, a.from), 1.0 / distance(a.from, a.to));
        let left = cross(along, minus(b.to, b.from)) > 0.0;
        let inward = if left { [-along[1], along[0]] } else { [along[1], -along[0]] };
        Bend { centre: plus(from, scaled(inward, radius)), radius, left }
    });
    Stretch { side: a.side, corner: true, from, to, bend }
}

/// The angle an arc sweeps, over 0 up to a whole turn (rad).
fn swept(s: &Stretch, b: &Bend) -> f64 {
    let (u, v) = (minus(s.from, b.centre), minus(s.to, b.centre));
    let angle = cross(u, v).atan2(dot(u, v)) * if b.left { 1.0 } else { -1.0 };
    angle.rem_euclid(std::f64::consts::TAU)
}

/// Points that two stretches have in common; of stretches that overlap, their ends.
fn meetings(a: &Stretch, b: &Stretch) -> Vec<Point> {
    let mut found = match (&a.bend, &b.bend) {
        (None, None) => lines_meet(a, b),
        (None, Some(bend)) => line_meets_circle(a, bend),
        (Some(bend), None) => line_meets_circle(b, bend),
        (Some(p), Some(q)) => circles_meet(p, q),
    };
    found.retain(|p| a.holds(*p) && b.holds(*p));
    let on = |s: &Stretch, p: Point| s.offset(p).abs() < SAME_POINT && s.holds(p);
    found.extend([b.from, b.to].into_iter().filter(|p| on(a, *p)));
    found.extend([a.from, a.to].into_iter().filter(|p| on(b, *p)));
    found
}

fn lines_meet(a: &Stretch, b: &Stretch) -> Vec<Point> {
    let (u, v) = (minus(a.to, a.from), minus(b.to, b.from));
    let det = cross(u, v);
    if det.abs() < SAME_POINT * SAME_POINT {
        return Vec::new();
    }
    let t = cross(minus(b.from, a.from), v) / det;
    vec![plus(a.from, scaled(u, t))]
}

fn line_meets_circle(line: &Stretch, b: &Bend) -> Vec<Point> {
    let away = line.offset(b.centre);
    let along = scaled(minus(line.to, line.from), 1.0 / distance(line.from, line.to));
    let foot = plus(line.from, scaled(along, dot(minus(b.centre, line.from), along)));
    let reach = b.radius * b.radius - away * away;
    if reach < 0.0 {
        return Vec::new();
    }
    [reach.sqrt(), -reach.sqrt()].map(|t| plus(foot, scaled(along, t))).to_vec()
}

fn circles_meet(p: &Bend, q: &Bend) -> Vec<Point> {
    let apart = distance(p.centre, q.centre);
    if apart < SAME_POINT {
        return Vec::new();
    }
    let t = (apart * apart + p.radius * p.radius - q.radius * q.radius) / (2.0 * apart);
    let height = p.radius * p.radius - t * t;
    if height < 0.0 {
        return Vec::new();
    }
    let along = scaled(minus(q.centre, p.centre), 1.0 / apart);
    let foot = plus(p.centre, scaled(along, t));
    [height.sqrt(), -height.sqrt()].map(|h| plus(foot, [-along[1] * h, along[0] * h])).to_vec()
}

fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn scaled(a: Point, by: f64) -> Point {
    [a[0] * by, a[1] * by]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn distance(a: Point, b: Point) -> f64 {
    let d = minus(a, b);
    d[0].hypot(d[1])
}

fn near(a: Point, b: Point) -> bool {
    distance(a, b) < SAME_POINT
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::model::{Expr, OutlineSide};
    use std::f64::consts::PI;

    fn side(x: f64, y: f64, path: OutlinePath, corner: Corner) -> OutlineSide {
        OutlineSide { name: String::new(), to: [x, y].map(Expr::Const), path, corner }
    }

    fn line(x: f64, y: f64) -> OutlineSide {
        side(x, y, OutlinePath::Line, Corner::Sharp)
    }

    fn arc(x: f64, y: f64, radius: f64, left: bool, long: bool) -> OutlineSide {
        side(x, y, OutlinePath::Arc { radius: Expr::Const(radius), left, long }, Corner::Sharp)
    }

    fn outline(sides: Vec<OutlineSide>) -> Outline {
        Outline { start: [0.0, 0.0].map(Expr::Const), start_corner: Corner::Sharp, sides }
    }

    fn square(corner: impl Fn() -> Corner) -> Outline {
        let corners = [[10.0, 0.0], [10.0, 10.0], [0.0, 10.0]];
        let sides = corners.map(|[x, y]| side(x, y, OutlinePath::Line, corner())).to_vec();
        Outline { start_corner: corner(), ..outline(sides) }
    }

    #[test]
    fn areas_have_their_closed_forms() {
        let area = |o: &Outline| super::area(&trace(o, &[]).unwrap());
        assert!((area(&square(|| Corner::Sharp)) - 100.0).abs() < 1e-12);
        assert!((area(&square(|| Corner::Chamfer(Expr::Const(1.0)))) - 98.0).abs() < 1e-12);
        assert!((area(&square(|| Corner::Round(Expr::Const(2.0)))) - (100.0 - 4.0 * (4.0 - PI))).abs() < 1e-12);
        let half_disc = outline(vec![line(10.0, 0.0), arc(0.0, 0.0, 5.0, true, false)]);
        assert!((area(&half_disc) - 12.5 * PI).abs() < 1e-9);
        // Clockwise, and more than half a turn.
        let lens = |long| outline(vec![arc(0.0, 10.0, 10.0, false, long)]);
        let segment = 50.0 * (PI / 3.0 - (PI / 3.0).sin());
        assert!((area(&lens(false)) + segment).abs() < 1e-9);
        assert!((area(&lens(true)) + 100.0 * PI - segment).abs() < 1e-9);
    }

    #[test]
    fn faults_are_found_and_name_their_side() {
        let fault = |sides| {
            let stretches = trace(&outline(sides), &[]);
            stretches.map_or_else(Some, |s| touching(&s))
        };
        assert_eq!(fault(vec![line(10.0, 0.0), line(10.0, 0.0), line(0.0, 5.0)]), Some(Fault::NoLength { side: 1 }));
        let short = fault(vec![line(10.0, 0.0), arc(0.0, 0.0, 4.0, true, false)]);
        assert_eq!(short, Some(Fault::ShortRadius { side: 1, radius: 4.0, half: 5.0 }));
        assert_eq!(fault(vec![line(10.0, 0.0), line(20.0, 0.0)]), Some(Fault::Flat));
        let bow_tie = fault(vec![line(10.0, 10.0), line(10.0, 0.0), line(0.0, 11.0)]);
        assert!(matches!(bow_tie, Some(Fault::Touch { sides: [0, 2], .. })), "{bow_tie:?}");
        let spike = fault(vec![line(10.0, 0.0), line(10.0, 10.0), line(5.0, 0.0), line(0.0, 10.0)]);
        assert!(matches!(spike, Some(Fault::Touch { sides: [0, 2], .. })), "{spike:?}");
        let bitten = fault(vec![line(10.0, 0.0), line(10.0, 1.0), arc(0.0, 1.0, 5.5, true, false), line(0.0, 0.5)]);
        assert_eq!(bitten, None);
        let through = fault(vec![line(10.0, 0.0), line(10.0, 1.0), arc(0.0, 1.0, 5.5, false, false), line(0.0, 0.5)]);
        assert!(matches!(through, Some(Fault::Touch { sides: [0, 2], .. })), "{through:?}");
    }

    #[test]
    fn two_equal_rounds_make_a_full_round() {
        let stadium = trace(&square(|| Corner::Round(Expr::Const(5.0))), &[]).unwrap();
        assert_eq!(stadium.len(), 4);
        assert!((area(&stadium) - 25.0 * PI).abs() < 1e-9 && touching(&stadium).is_none());
    }

    #[test]
    fn corners_need_room_and_straight_sides() {
        let with = |corner: Corner| {
            let mut square = square(|| Corner::Sharp);
            square.sides[1].corner = corner;
            square
        };
        let no_room = trace(&with(Corner::Round(Expr::Const(10.1))), &[]);
        assert_eq!(no_room, Err(Fault::NoRoom { side: 1 }));
        let mut arched = with(Corner::Chamfer(Expr::Const(1.0)));
        arched.sides[2].path = OutlinePath::Arc { radius: Expr::Const(8.0), left: true, long: false };
        assert_eq!(trace(&arched, &[]), Err(Fault::BesideArc { side: 1 }));
    }

    #[test]
    fn a_point_is_inside_when_its_signed_distances_say_so() {
        let round = trace(&square(|| Corner::Round(Expr::Const(3.0))), &[]).unwrap();
        let truth = |p: Point| {
            let beyond = p.map(|v| (v - 5.0f64).abs() - 2.0);
            let outside = beyond[0].max(0.0).hypot(beyond[1].max(0.0)) + beyond[0].max(beyond[1]).min(0.0);
            outside < 3.0
        };
        for i in 0..900 {
            let p = [(i % 30) as f64 * 0.401 - 1.0, (i / 30) as f64 * 0.403 - 1.0];
            assert_eq!(encloses(&round, p), truth(p), "{p:?}");
        }
    }

    #[test]
    fn a_stretch_is_run_at_constant_speed_with_the_right_hand_outside() {
        let stretches = trace(&square(|| Corner::Round(Expr::Const(3.0))), &[]).unwrap();
        for s in &stretches {
            let steps: Vec<Point> = (0..=8).map(|i| s.at(i as f64 / 8.0).0).collect();
            assert!(near(steps[0], s.from) && near(steps[8], s.to));
            let first = distance(steps[0], steps[1]);
            assert!(steps.windows(2).all(|w| (distance(w[0], w[1]) - first).abs() < 1e-9));
            let (p, out) = s.at(0.4);
            assert!(s.offset(p).abs() < 1e-9 && s.offset(plus(p, out)) > 0.0);
            assert!(
                !encloses(&stretches, plus(p, scaled(out, 1e-3))) && encloses(&stretches, plus(p, scaled(out, -1e-3)))
            );
        }
    }
}
