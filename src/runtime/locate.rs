//! Where the assembly stands in a photo: a search over the pose on the plate, carried through the camera.
//!
//! In: orientation fields of the photo, edge points with 3-D positions. Out: a pose with its score, and those that rival it.
//! Coarse: all poses of a grid, scored by the mean agreement of edge orientations (Steger 2002; the exhaustive first level of
//! the paper's search), polarity kept unless the model says that the light decides it. Fine: the best few follow their edges
//! to sub-pixel accuracy by robust least squares. Never judges a component.

use super::camera::{Camera, Vec3, sub};
use super::field::Field;
use super::follow::{EDGE_SIGMA, View, follow};
use super::grid::Grid;
use super::model::{Locator, Model, PointGroup, PointSet};
use super::parts::{Listener, Part, nobody};
use super::pose::{Installation, Pose, Stood};
use super::settle;

/// How many coarse poses are followed, quickly, and how many of them to the end.
const BEAM: usize = 12;
const FINALISTS: usize = 3;
const MOST_RIVALS: usize = 3;
/// A pose that has this share of the best one's score is a rival of it, followed to the end or quickly, if it moves the edges by so
/// many px of the photo. Edges can be had by a shadow, or by the grain of wood.
const RIVAL: f64 = 0.8;
const QUICK_RIVAL: f64 = 0.6;
const APART: f64 = 3.0;
/// A first look at a pose of the grid asks one point in so many; one pose in so many is looked at again, or at least so many.
const FIRST_LOOK: usize = 4;
const KEPT_OF: usize = 8;
const LEAST_KEPT: usize = 500;
/// A coarse step moves edge points by at most this many coarse px.
const COARSE_STEP_PX: f64 = 1.0;

/// Edges are followed at resolutions of up to so many px; beyond, a px is a small part of anything.
const MOST_PIXELS: usize = 1_000_000;
/// Poses of the coarse grid at most, far above any real station: a model that asks for more gets wider steps.
const MOST_POSES: f64 = 1e6;

/// An edge point: position (mm, assembly frame) and a second point 1 mm along the edge.
#[derive(Debug, Clone, Copy)]
pub struct EdgePoint {
    pub at: Vec3,
    pub along: Vec3,
}

impl EdgePoint {
    fn from_row(row: &[i32; 6]) -> EdgePoint {
        let at = [0, 1, 2].map(|i| f64::from(row[i]) * 1e-3);
        EdgePoint { at, along: [0, 1, 2].map(|i| at[i] + f64::from(row[i + 3]) * 1e-3) }
    }

    /// The row of the model file.
    pub fn to_row(self) -> [i32; 6] {
        let d = sub(self.along, self.at);
        let round = |v: f64| (v * 1e3).round() as i32;
        [round(self.at[0]), round(self.at[1]), round(self.at[2]), round(d[0]), round(d[1]), round(d[2])]
    }

    /// Place in the field's px and the direction in which light grows there.
    pub fn seen(&self, camera: &Camera, pose: &Pose) -> Option<([f64; 2], [f32; 2])> {
        self.seen_as(camera, &pose.stood())
    }

    /// The same of an assembly that stands so.
    pub(super) fn seen_as(&self, camera: &Camera, stood: &Stood) -> Option<([f64; 2], [f32; 2])> {
        let p = camera.project(stood.apply(self.at))?;
        let q = camera.project(stood.apply(self.along))?;
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let length = (dx * dx + dy * dy).sqrt();
        (length > 1e-9).then(|| (p, [(-dy / length) as f32, (dx / length) as f32]))
    }
}

/// The model's edge points, ready to search with.
pub struct Search {
    coarse_factor: u32,
    fine_factor: u32,
    unsigned: bool,
    groups: Vec<Vec<Alternative>>,
    /// Per group, the standard deviation of its component's place (px of the photo).
    plays: Vec<f64>,
}

struct Alternative {
    coarse: Vec<EdgePoint>,
    fine: Vec<EdgePoint>,
}

/// A pose with what speaks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    pub pose: Pose,
    /// Mean agreement of the fine edge points, -1..1.
    pub score: f64,
}

/// The fields of one photo.
pub struct Fields {
    pub coarse: Field,
    pub fine: Field,
    /// Finer ones with their factors, for the last word on the pose.
    finer: Vec<(u32, Field)>,
}

/// A photo's field at one resolution, and the camera that sees it so.
struct Level<'a> {
    field: &'a Field,
    camera: Camera,
    factor: u32,
}

impl<'a> Level<'a> {
    fn new(field: &'a Field, camera: &Camera, factor: u32) -> Level<'a> {
        Level { field, camera: camera.reduced(factor), factor }
    }
}

/// How thoroughly edges are followed: steps, and one edge point in so many.
#[derive(Clone, Copy)]
struct Effort {
    rounds: usize,
    stride: usize,
}

const QUICK: Effort = Effort { rounds: 4, stride: 4 };
const FULL: Effort = Effort { rounds: 9, stride: 1 };

impl Search {
    pub fn new(model: &Model) -> Search {
        Search::without(model, None)
    }

    /// The same without the points of one group.
    pub fn without(model: &Model, skipped: Option<usize>) -> Search {
        let play = |group: &PointGroup| model.nodes.iter().find(|n| n.name == group.name).map_or(0.0, settle::play);
        let groups = model.locator.groups.iter().enumerate().filter(|(i, _)| Some(*i) != skipped);
        Search::of(&model.locator, groups.map(|(_, group)| (group, play(group))))
    }

    /// Each group with the standard deviation of its component's place (px of the photo).
    fn of<'a>(locator: &Locator, groups: impl Iterator<Item = (&'a PointGroup, f64)>) -> Search {
        let points = |rows: &[[i32; 6]]| rows.iter().map(EdgePoint::from_row).collect();
        let set = |s: &PointSet| Alternative { coarse: points(&s.coarse), fine: points(&s.fine) };
        let (groups, plays) = groups.map(|(g, play)| (g.alternatives.iter().map(set).collect(), play)).unzip();
        Search { coarse_factor: locator.coarse, fine_factor: locator.fine, unsigned: locator.unsigned, groups, plays }
    }

    /// Orientation fields of a photo whose pixels have noise `noise`.
    pub fn fields(&self, photo: &Grid, noise: f64) -> Fields {
        let field = |factor: u32, smooth| {
            Field::new(photo.reduced(factor as usize), noise / f64::from(factor), smooth, self.unsigned)
        };
        let pixels = |factor: u32| (photo.width / factor as usize) * (photo.height / factor as usize);
        let halves = std::iter::successors(Some(self.fine_factor / 2), |f| Some(f / 2));
        let finer = halves.take_while(|&f| f > 0 && pixels(f) <= MOST_PIXELS).map(|f| (f, field(f, false))).collect();
        Fields { coarse: field(self.coarse_factor, true), fine: field(self.fine_factor, false), finer }
    }

    /// The best pose within `standing` (ranges of x, y, z, rz), or `None` when there is nothing to go by.
    pub fn locate(&self, fields: &Fields, camera: &Camera, standing: &[[f64; 2]; 4]) -> Option<Located> {
        self.located(fields, camera, standing, 0, &nobody).into_iter().next()
    }

    /// The best pose, and what others the edges speak for nearly as clearly; best first. Tells the parts of its work.
    pub(super) fn rivals(
        &self,
        fields: &Fields,
        camera: &Camera,
        standing: &[[f64; 2]; 4],
        listener: &Listener,
    ) -> Vec<Located> {
        self.located(fields, camera, standing, MOST_RIVALS, listener)
    }

    /// The best pose, and of others that are worth following so many, as far as the edges speak nearly as clearly of them.
    fn located(
        &self,
        fields: &Fields,
        camera: &Camera,
        standing: &[[f64; 2]; 4],
        most: usize,
        listener: &Listener,
    ) -> Vec<Located> {
        listener(Part::Poses);
        let candidates = self.coarse(fields, &camera.reduced(self.coarse_factor), standing);
        listener(Part::Edges);
        let fine = Level::new(&fields.fine, camera, self.fine_factor);
        let followed = |pose: Pose, effort: Effort| {
            let pose = self.refine(&fine, pose, standing, effort);
            Located { pose, score: self.score(&fields.fine, &fine.camera, &pose) }
        };
        let quick: Vec<Located> = candidates.into_iter().map(|pose| followed(pose, QUICK)).collect();
        let followed_on = self.worth_following(quick, camera, most).into_iter();
        let finalists = followed_on.map(|found| followed(found.pose, FULL)).collect();
        let rivals = self.distinct(finalists, camera, RIVAL);
        let finer = |pose, (factor, field): &(u32, Field)| {
            self.refine(&Level::new(field, camera, *factor), pose, standing, FULL)
        };
        rivals.iter().map(|r| Located { pose: fields.finer.iter().fold(r.pose, finer), ..*r }).collect()
    }

    /// The best of the poses that were followed quickly, and what rivals them from further off.
    fn worth_following(&self, mut quick: Vec<Located>, camera: &Camera, most: usize) -> Vec<Located> {
        quick.sort_by(|a, b| b.score.total_cmp(&a.score));
        let rivals = self.distinct(quick.clone(), camera, QUICK_RIVAL);
        quick.truncate(FINALISTS);
        let others: Vec<Located> = rivals.into_iter().filter(|rival| !quick.contains(rival)).collect();
        quick.extend(others.into_iter().take(most));
        quick
    }

    /// Those that score at least this share of the best, best first, without what is as good as one of them.
    fn distinct(&self, mut all: Vec<Located>, camera: &Camera, share: f64) -> Vec<Located> {
        all.sort_by(|a, b| b.score.total_cmp(&a.score));
        let least = all.first().map_or(0.0, |best| best.score - (1.0 - share) * best.score.abs());
        let mut distinct: Vec<Located> = Vec::new();
        for found in all.into_iter().filter(|f| f.score >= least) {
            if distinct.iter().all(|other| self.speed(camera, &other.pose, &found.pose) > APART) {
                distinct.push(found);
            }
        }
        distinct
    }

    /// The best poses of the grid, one per neighbourhood, best first.
    fn coarse(&self, fields: &Fields, camera: &Camera, standing: &[[f64; 2]; 4]) -> Vec<Pose> {
        let axes = self.grid(camera, standing);
        let mut promising = self.promising(fields, camera, &axes);
        // Sheet after sheet, so that each is made once.
        promising.sort_by_key(|&(_, [k, l, i, j])| [l, k, i, j]);
        let mut scored = Vec::new();
        for some in promising.chunk_by(|a, b| a.1[..2] == b.1[..2]) {
            let [k, l, ..] = some[0].1;
            let sheet = self.sheet(camera, axes[2][k], axes[3][l], &axes);
            for &(_, [_, _, i, j]) in some {
                let (x, y) = (axes[0][i], axes[1][j]);
                let score = sheet.score(&fields.coarse, x - axes[0][0], y - axes[1][0], 1);
                scored.push((score, Pose { x, y, z: axes[2][k], rz: axes[3][l] }));
            }
        }
        scored.sort_by(|a, b| b.0.total_cmp(&a.0));
        let step = axes.each_ref().map(|a| if a.len() > 1 { a[1] - a[0] } else { 1.0 });
        let mut kept: Vec<Pose> = Vec::new();
        for (_, pose) in scored {
            let near = |k: &Pose| {
                let (a, b) = (k.to_array(), pose.to_array());
                (0..4).all(|i| (a[i] - b[i]).abs() < 1.5 * step[i])
            };
            if !kept.iter().any(near) {
                kept.push(pose);
            }
            if kept.len() == BEAM {
                break;
            }
        }
        kept
    }

    /// The poses of the grid (indices of z, rz, x, y) that score best by a few of their points.
    fn promising(&self, fields: &Fields, camera: &Camera, axes: &[Vec<f64>; 4]) -> Vec<(f64, [usize; 4])> {
        let mut scored = Vec::new();
        for (l, &rz) in axes[3].iter().enumerate() {
            for (k, &z) in axes[2].iter().enumerate() {
                let sheet = self.sheet(camera, z, rz, axes);
                for (i, &x) in axes[0].iter().enumerate() {
                    for (j, &y) in axes[1].iter().enumerate() {
                        let score = sheet.score(&fields.coarse, x - axes[0][0], y - axes[1][0], FIRST_LOOK);
                        scored.push((score, [k, l, i, j]));
                    }
                }
            }
        }
        let most = (scored.len() / KEPT_OF).max(LEAST_KEPT);
        scored.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        scored.truncate(most);
        scored
    }

    /// Grid values along each axis, so fine that no edge point moves more than a coarse step.
    fn grid(&self, camera: &Camera, standing: &[[f64; 2]; 4]) -> [Vec<f64>; 4] {
        let home = Pose::from_array(standing.map(|[a, b]| (a + b) / 2.0));
        let mut counts = [0.0f64; 4];
        for (axis, count) in counts.iter_mut().enumerate() {
            let [low, high] = standing[axis];
            let small = (high - low).max(1e-9) * 1e-3;
            let mut moved = home.to_array();
            moved[axis] += small;
            let speed = self.speed(camera, &home, &Pose::from_array(moved)) / small;
            let steps = ((high - low) * speed / COARSE_STEP_PX).ceil().clamp(0.0, 400.0);
            *count = if high - low < 1e-9 { 0.0 } else { steps.max(2.0) };
        }
        while counts.iter().map(|c| c + 1.0).product::<f64>() > MOST_POSES {
            counts = counts.map(|c| if c > 2.0 { (c * 0.8).floor().max(2.0) } else { c });
        }
        [0, 1, 2, 3].map(|axis| {
            let ([low, high], steps) = (standing[axis], counts[axis]);
            let at = |i: u32| if steps == 0.0 { low } else { low + (high - low) * f64::from(i) / steps };
            (0..=steps as u32).map(at).collect()
        })
    }

    /// Root mean square motion of the coarse edge points between two poses (px).
    fn speed(&self, camera: &Camera, a: &Pose, b: &Pose) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for point in self.groups.iter().flatten().flat_map(|alternative| &alternative.coarse) {
            if let (Some(p), Some(q)) = (camera.project(a.apply(point.at)), camera.project(b.apply(point.at))) {
                sum += (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
                count += 1.0;
            }
        }
        if count == 0.0 { 0.0 } else { f64::sqrt(sum / count) }
    }

    /// The coarse points at one height and turn, with their motion per mm of x and y.
    fn sheet(&self, camera: &Camera, z: f64, rz: f64, axes: &[Vec<f64>; 4]) -> Sheet {
        let base = Pose { x: axes[0][0], y: axes[1][0], z, rz };
        let (dx, dy) = (axes[0][axes[0].len() - 1] - base.x, axes[1][axes[1].len() - 1] - base.y);
        let (dx, dy) = (dx.max(1e-6), dy.max(1e-6));
        let middle = Pose { x: base.x + dx / 2.0, y: base.y + dy / 2.0, ..base }.stood();
        let right = Pose { x: base.x + dx, ..base }.stood();
        let up = Pose { y: base.y + dy, ..base }.stood();
        let base = base.stood();
        let place = |point: &EdgePoint| -> Option<SheetPoint> {
            let (_, direction) = point.seen_as(camera, &middle)?;
            let at = camera.project(base.apply(point.at))?;
            let right = camera.project(right.apply(point.at))?;
            let up = camera.project(up.apply(point.at))?;
            let per = |q: [f64; 2], d: f64| [(q[0] - at[0]) / d, (q[1] - at[1]) / d];
            Some(SheetPoint { at, per_x: per(right, dx), per_y: per(up, dy), direction })
        };
        let alternatives =
            |group: &Vec<Alternative>| group.iter().map(|a| a.coarse.iter().filter_map(place).collect()).collect();
        Sheet { groups: self.groups.iter().map(alternatives).collect() }
    }

    /// Mean agreement of the fine points at a pose; groups count by their number of points.
    pub fn score(&self, field: &Field, camera: &Camera, pose: &Pose) -> f64 {
        let group = |alternatives: &Vec<Alternative>| {
            let agreement = |a: &Alternative| (agreement(field, camera, pose, a), a.fine.len());
            best_of(alternatives.iter().map(agreement))
        };
        let points = |group: &Vec<Alternative>| group.iter().map(|a| a.fine.len()).max().unwrap_or(0);
        let weight: usize = self.groups.iter().map(points).sum();
        self.groups.iter().map(group).sum::<f64>() / weight.max(1) as f64
    }

    /// The fine points of the alternatives that fit best at a pose, one in `stride`, each with its weight. The points of a part
    /// that has play move together, so all of them tell no more than the play lets them: with a common error of variance p²
    /// beside σ² of each, n points count 1 / (1 + n p² / σ²) each.
    fn chosen(&self, field: &Field, camera: &Camera, pose: &Pose, factor: u32, stride: usize) -> Vec<(EdgePoint, f64)> {
        let clear = |a: &Alternative| agreement(field, camera, pose, a) / (a.fine.len().max(1) as f64).sqrt();
        let best = |(group, play): (&Vec<Alternative>, &f64)| {
            // Where there is no choice nothing is compared.
            let points = if let [only] = &group[..] {
                &only.fine[..]
            } else {
                let scored = group.iter().map(|a| (clear(a), a));
                scored.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(&[][..], |(_, a)| &a.fine)
            };
            let noise = EDGE_SIGMA * f64::from(factor);
            let weight = 1.0 / (1.0 + points.len() as f64 * (play / noise).powi(2));
            points.iter().step_by(stride).map(|&p| (p, weight)).collect::<Vec<_>>()
        };
        self.groups.iter().zip(&self.plays).flat_map(best).collect()
    }

    /// Follows the edges from `pose` by robust least squares over the axes that may vary.
    fn refine(&self, level: &Level, pose: Pose, standing: &[[f64; 2]; 4], effort: Effort) -> Pose {
        let Level { field, camera, factor } = *level;
        let free: Vec<usize> = (0..4).filter(|&i| standing[i][1] - standing[i][0] > 1e-9).collect();
        let spread = free.iter().map(|&i| (standing[i][1] - standing[i][0]) * 10.0).collect::<Vec<_>>();
        let with = |parameters: &[f64]| {
            let mut array = pose.to_array();
            free.iter().zip(parameters).for_each(|(&i, v)| array[i] += v);
            Pose::from_array(array)
        };
        let camera = &camera;
        let view = View { field, camera };
        let parameters = follow(vec![0.0; free.len()], &spread, effort.rounds, |parameters, reach| {
            let pose = with(parameters);
            let points = self.chosen(field, camera, &pose, factor, effort.stride);
            let seen_at = |p: &[f64]| {
                let stood = with(p).stood();
                move |point: &EdgePoint| camera.project(stood.apply(point.at))
            };
            view.pulls(&points, reach, parameters, seen_at, &pose)
        });
        with(&parameters).held(standing)
    }

    /// Poses of several photos and the installation they share, from starting poses: regularised by the spec's priors.
    pub fn install(
        &self,
        fields: &[Fields],
        nominal: &Camera,
        starts: &[Pose],
        standing: &[[f64; 2]; 4],
        spread: &[f64; 8],
    ) -> (Installation, Vec<Pose>) {
        let free: Vec<usize> = (0..4).filter(|&i| standing[i][1] - standing[i][0] > 1e-9).collect();
        let mut spreads = spread.to_vec();
        for _ in starts {
            spreads.extend(free.iter().map(|&i| standing[i][1] - standing[i][0]));
        }
        let split = |parameters: &[f64], photo: usize| {
            let mut eight = [0.0; 8];
            eight.copy_from_slice(&parameters[..8]);
            let mut array = starts[photo].to_array();
            let own = &parameters[8 + photo * free.len()..];
            free.iter().zip(own).for_each(|(&i, v)| array[i] += v);
            (Installation::from_array(eight), Pose::from_array(array))
        };
        let at_level = |start: Vec<f64>, factor: u32, field: &dyn Fn(&Fields) -> &Field| {
            follow(start, &spreads, FULL.rounds, |parameters, reach| {
                let mut all = Vec::new();
                for (photo, fields) in fields.iter().enumerate() {
                    let (installation, pose) = split(parameters, photo);
                    let camera = installation.apply(nominal).reduced(factor);
                    let points = self.chosen(field(fields), &camera, &pose, factor, FULL.stride);
                    let view = View { field: field(fields), camera: &camera };
                    let seen_at = |p: &[f64]| {
                        let (installation, pose) = split(p, photo);
                        let (camera, stood) = (installation.apply(nominal).reduced(factor), pose.stood());
                        move |point: &EdgePoint| camera.project(stood.apply(point.at))
                    };
                    all.extend(view.pulls(&points, reach, parameters, seen_at, &pose));
                }
                all
            })
        };
        let mut parameters = at_level(vec![0.0; spreads.len()], self.fine_factor, &|f| &f.fine);
        for level in 0..fields.iter().map(|f| f.finer.len()).min().unwrap_or(0) {
            parameters = at_level(parameters, fields[0].finer[level].0, &|f| &f.finer[level].1);
        }
        let installation = split(&parameters, 0).0;
        (installation, (0..starts.len()).map(|photo| split(&parameters, photo).1).collect())
    }
}

struct Sheet {
    groups: Vec<Vec<Vec<SheetPoint>>>,
}

struct SheetPoint {
    at: [f64; 2],
    per_x: [f64; 2],
    per_y: [f64; 2],
    direction: [f32; 2],
}

impl Sheet {
    /// Sum over groups of the best alternative's agreement.
    /// Only every `stride`-th point is asked.
    fn score(&self, field: &Field, dx: f64, dy: f64, stride: usize) -> f64 {
        let sum = |points: &Vec<SheetPoint>| {
            let points = points.iter().step_by(stride);
            let agreement = |p: &SheetPoint| {
                field.agreement([0, 1].map(|i| p.at[i] + dx * p.per_x[i] + dy * p.per_y[i]), p.direction)
            };
            let count = points.len();
            (f64::from(points.map(agreement).sum::<f32>()), count)
        };
        self.groups.iter().map(|alternatives| best_of(alternatives.iter().map(sum))).sum()
    }
}

/// Sum of the agreements of an alternative's fine points.
fn agreement(field: &Field, camera: &Camera, pose: &Pose, alternative: &Alternative) -> f64 {
    let stood = pose.stood();
    let seen = alternative.fine.iter().filter_map(|p| p.seen_as(camera, &stood));
    seen.map(|(at, direction)| f64::from(field.agreement(at, direction))).sum()
}

/// The clearest of some sums of agreements, each with its number of points. By chance a sum of n agreements grows with
/// √n and their mean falls with it, so alternatives of unlike size are compared in standard deviations, in the measure of
/// the largest.
fn best_of(sums: impl Iterator<Item = (f64, usize)>) -> f64 {
    let (mut clearest, mut most) = (f64::NEG_INFINITY, 0);
    for (sum, points) in sums.filter(|(_, points)| *points > 0) {
        clearest = clearest.max(sum / (points as f64).sqrt());
        most = most.max(points);
    }
    if most == 0 { 0.0 } else { clearest * (most as f64).sqrt() }
}

#[cfg(test)]
mod tests;
