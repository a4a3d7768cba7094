//! Edge points for the locator: where every good render has an edge of the same direction, whatever the light.
//!
//! In: shots of correct assemblies, the nominal item buffer. Out: 3-D edge points with polarity. An edge that turns its
//! polarity with the light or the draw averages out and is left behind, and so is one on a component that a modelled
//! fault can carry away.

use super::shots::Shot;
use crate::rng::Stream;
use crate::runtime::camera::{Camera, Vec3, normalise, sub};
use crate::runtime::field::{Field, doubled, halved};
use crate::runtime::grid::Grid;
use crate::runtime::linear;
use crate::runtime::locate::EdgePoint;
use crate::runtime::pose::Pose;

/// Mean orientation over the draws (0..1) that a point must reach.
const LEAST_AGREEMENT: f32 = 0.65;
/// The same for unsigned edges: the light takes the contrast away now and then, which moves no edge.
const LEAST_UNSIGNED: f32 = 0.4;
/// Noise level under which orientations fade, share of full scale.
const NOISE: f64 = 0.01;

/// An edge point that scatters more than this from shot to shot (standard deviation, px of the field) is no sure one.
const MOST_SCATTER: f64 = 0.3;

/// A place of the nominal image: its point of the assembly, if it may serve.
pub type Surface<'a> = dyn Fn(usize, usize) -> Option<Vec3> + 'a;

/// What the edges are looked for in.
pub struct Ground<'a> {
    pub shots: &'a [&'a Shot],
    pub camera: Camera,
    pub home: Pose,
    /// px of the photo per px of the search, a multiple of the shots' own factor.
    pub factor: u32,
    /// Factor of the shots.
    pub base: u32,
    /// Nominal lamp powers.
    pub powers: &'a [f64],
    pub seed: u64,
    /// Look for edges whose place is sure even if the light decides which of their sides is the brighter.
    pub unsigned: bool,
}

/// At most `count` points, evenly thinned.
pub fn find(ground: &Ground, surface: &Surface, count: usize) -> Vec<EdgePoint> {
    let camera = ground.camera.reduced(ground.factor);
    let [width, height] = camera.size.map(|s| s as usize);
    let fields: Vec<(Field, &Pose)> =
        ground.shots.iter().enumerate().map(|(i, shot)| (field(ground, shot, i), &shot.pose)).collect();
    let mut mean = vec![[0.0f32; 2]; (width + 1) * (height + 1)];
    let mut points: Vec<Option<Vec3>> = vec![None; mean.len()];
    for y in 2..height.saturating_sub(1) {
        for x in 2..width.saturating_sub(1) {
            let Some(point) = surface(x, y) else { continue };
            let index = y * (width + 1) + x;
            points[index] = Some(point);
            mean[index] = mean_orientation(ground, &fields, &camera, point, [x as f64, y as f64]);
        }
    }
    let least = if ground.unsigned { LEAST_UNSIGNED } else { LEAST_AGREEMENT };
    let candidates = peaks(&mean, &points, least, width + 1, height + 1);
    let thinned = thin(candidates, count);
    let point = |(x, y): &(usize, usize)| {
        let index = y * (width + 1) + x;
        let near = edge_point(&camera, &ground.home, points[index]?, [*x as f64, *y as f64], mean[index])?;
        settled(&camera, &ground.home, &fields, near, points[index]?, mean[index])
    };
    let settled: Vec<(EdgePoint, f64)> = thinned.iter().filter_map(point).collect();
    // Alternatives are compared by their number of points too: none may lose more of them than another.
    if ground.unsigned { settled.into_iter().map(|(point, _)| point).collect() } else { sure(settled) }
}

/// The points whose place scatters little from shot to shot: on a wide rounding the light decides where an edge is. At least
/// half of all.
fn sure(mut points: Vec<(EdgePoint, f64)>) -> Vec<EdgePoint> {
    points.sort_by(|a, b| a.1.total_cmp(&b.1));
    let count = points.iter().filter(|(_, scatter)| *scatter <= MOST_SCATTER).count().max(points.len().div_ceil(2));
    points.into_iter().take(count).map(|(point, _)| point).collect()
}

/// Orientation field of a shot under its own random mix of lamps.
fn field(ground: &Ground, shot: &Shot, index: usize) -> Field {
    let mut stream = Stream::new(ground.seed, "locator light", index as u64);
    // From a fifth to twice the described power: a description is a prior only.
    let weights: Vec<f64> = ground.powers.iter().map(|p| p * stream.between(0.2f64.ln(), 2f64.ln()).exp()).collect();
    let light = shot.lit(&weights).reduced((ground.factor / ground.base) as usize);
    Field::new(light, NOISE, false, false)
}

/// Mean over the shots of the unit gradient at the image of `point`, brought back to the nominal image: a gradient is a
/// covector, so it transforms with the transposed Jacobian.
fn mean_orientation(
    ground: &Ground,
    fields: &[(Field, &Pose)],
    camera: &Camera,
    point: Vec3,
    at: [f64; 2],
) -> [f32; 2] {
    let Some(steps) = steps_in_space(camera, &ground.home, point, at) else { return [0.0; 2] };
    let mut sum = [0.0f32; 2];
    for (field, pose) in fields {
        let Some(p) = camera.project(pose.apply(point)) else { continue };
        let Some(g) = field.gradient_at(p) else { continue };
        let mut back = [0.0f32; 2];
        for (b, step) in back.iter_mut().zip(&steps) {
            let Some(q) = camera.project(pose.apply(*step)) else { continue };
            *b = ((q[0] - p[0]) * f64::from(g[0]) + (q[1] - p[1]) * f64::from(g[1])) as f32;
        }
        let length = (back[0] * back[0] + back[1] * back[1]).sqrt();
        let strength = length + (3.0 * NOISE / 2.0) as f32;
        let unit = back.map(|b| b / strength);
        let unit = if ground.unsigned { doubled(unit) } else { unit };
        sum = [sum[0] + unit[0], sum[1] + unit[1]];
    }
    let mean = sum.map(|s| s / fields.len().max(1) as f32);
    if ground.unsigned { halved(mean) } else { mean }
}

/// The points of the assembly one px to the right of and below `at`, on the horizontal plane through `point`.
fn steps_in_space(camera: &Camera, home: &Pose, point: Vec3, at: [f64; 2]) -> Option<[Vec3; 2]> {
    let z = home.apply(point)[2];
    let origin = camera.on_plane(at, z)?;
    let step = |to: [f64; 2]| {
        let q = camera.on_plane(to, z)?;
        let d = sub(q, origin);
        let p = home.apply(point);
        Some(home.invert([p[0] + d[0], p[1] + d[1], p[2] + d[2]]))
    };
    Some([step([at[0] + 1.0, at[1]])?, step([at[0], at[1] + 1.0])?])
}

/// Local maxima across the edge of the mean orientation's length.
fn peaks(mean: &[[f32; 2]], points: &[Option<Vec3>], least: f32, width: usize, height: usize) -> Vec<(usize, usize)> {
    let length = |i: usize| (mean[i][0] * mean[i][0] + mean[i][1] * mean[i][1]).sqrt();
    let mut out = Vec::new();
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let i = y * width + x;
            let here = length(i);
            if points[i].is_none() || here < least {
                continue;
            }
            let horizontal = mean[i][0].abs() > mean[i][1].abs();
            let step = if horizontal { 1 } else { width };
            if here >= length(i - step) && here > length(i + step) {
                out.push((x, y));
            }
        }
    }
    out
}

/// At most `count` of the candidates, one per cell of a grid as coarse as it takes.
fn thin(candidates: Vec<(usize, usize)>, count: usize) -> Vec<(usize, usize)> {
    let mut stride = 1usize;
    loop {
        let mut kept: Vec<(usize, usize)> = Vec::new();
        let mut taken = std::collections::BTreeSet::new();
        for &(x, y) in &candidates {
            if taken.insert((x / stride, y / stride)) {
                kept.push((x, y));
            }
        }
        if kept.len() <= count {
            return kept;
        }
        stride += 1;
    }
}

fn edge_point(camera: &Camera, home: &Pose, point: Vec3, at: [f64; 2], gradient: [f32; 2]) -> Option<EdgePoint> {
    // The gradient is the edge's direction turned by +90 degrees from x to y, so the direction is (gy, -gx).
    let length = f64::from((gradient[0] * gradient[0] + gradient[1] * gradient[1]).sqrt());
    let direction = [f64::from(gradient[1]) / length, -f64::from(gradient[0]) / length];
    let steps = steps_in_space(camera, home, point, at)?;
    let along: Vec3 =
        std::array::from_fn(|i| (steps[0][i] - point[i]) * direction[0] + (steps[1][i] - point[i]) * direction[1]);
    let unit = normalise(along);
    // The point lies on the pixel corner's own ray, not on the surface sample beside it.
    let plane = camera.on_plane(at, home.apply(point)[2]).map(|p| home.invert(p))?;
    Some(EdgePoint { at: plane, along: std::array::from_fn(|i| plane[i] + unit[i]) })
}

/// The point moved across its edge to where the shots have the edge in the middle, the place to a fraction of a px, and how far
/// the shots scatter about it (standard deviation, px of the field).
fn settled(
    camera: &Camera,
    home: &Pose,
    fields: &[(Field, &Pose)],
    near: EdgePoint,
    surface: Vec3,
    gradient: [f32; 2],
) -> Option<(EdgePoint, f64)> {
    /// As far as the nearest pixel corner may be, and a little.
    const REACH: f64 = 1.5;
    // Where the edge is not found, it is as far off as that.
    let distance = |(field, pose): &(Field, &Pose)| -> Option<f32> {
        let (at, direction) = near.seen(camera, pose)?;
        Some(field.nearest_edge(at, direction, REACH).map_or(REACH, |(distance, _)| distance) as f32)
    };
    let distances: Vec<f32> = fields.iter().filter_map(distance).collect();
    let mut found: Vec<f32> = distances.iter().copied().filter(|d| f64::from(*d) < REACH).collect();
    if found.is_empty() {
        return Some((near, REACH));
    }
    let middle = linear::median(&mut found);
    let mut apart: Vec<f32> = distances.iter().map(|d| (d - middle).abs()).collect();
    // The median distance of a normal variable from its mean is 0.6745 standard deviations.
    let scatter = f64::from(linear::median(&mut apart)) / 0.6745;
    let (at, direction) = near.seen(camera, home)?;
    let moved = [0, 1].map(|k| at[k] + f64::from(middle) * f64::from(direction[k]));
    Some((edge_point(camera, home, surface, moved, gradient)?, scatter))
}

/// The grey value below which a share of the pixels lies.
pub fn quantile(grid: &Grid, mask: impl Fn(usize) -> bool, share: f64) -> f32 {
    let mut values: Vec<f32> = grid.values.iter().enumerate().filter(|(i, _)| mask(*i)).map(|(_, &v)| v).collect();
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f32::total_cmp);
    values[((values.len() - 1) as f64 * share) as usize]
}
