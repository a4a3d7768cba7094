//! Triangles of a solid: constrained Delaunay in each face's own plane, over the samples the edges share.
//!
//! In: a [`Solid`] without triangles. Out: a [`TriMesh`], or the face that could not be filled. Neighbouring faces use
//! the same samples of their common edge, so the mesh is closed without any joining; a seam uses no point of its own
//! but on a sphere, where both its sides share them.

use super::border::{Grid, Outline};
use super::ring::{Chart, Node, Ring, lay_out, offsets};
use super::surface::tube_angle;
use super::{Face, Quality, Solid, Surface, TriMesh, tolerance};
use nalgebra::{Point3, Vector3};
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::HashMap;

/// Triangulates every face; the error is the index of a face whose outline crosses itself.
pub(super) fn triangulate(solid: &Solid, quality: &Quality) -> Result<TriMesh, usize> {
    let offsets = offsets(solid.vertices.len(), &solid.edges);
    let mut wanted: Vec<Vec<Point3<f64>>> = vec![Vec::new(); solid.faces.len()];
    let mut open = 0;
    for _ in 0..ROUNDS {
        let mut mesh = TriMesh { positions: positions(solid), ..TriMesh::default() };
        for (face, wanted) in wanted.iter().enumerate() {
            let patch = patch(solid, face, &offsets, quality, wanted, &mut mesh.positions).ok_or(face)?;
            fill(solid, face, &patch, &mut mesh).ok_or(face)?;
        }
        let sides = Sides::of(&mesh);
        if let Some(face) = sides.open() {
            return Err(face);
        }
        let doubled = sides.doubled();
        if doubled.is_empty() {
            return Ok(mesh);
        }
        // Two faces round the same few edges have the same diagonals: one of them gets a node in the middle of each.
        for (a, b, faces) in doubled {
            let curved = |f: &&usize| !matches!(solid.surface(**f), Surface::Plane { .. });
            let Some(&face) = faces.iter().rev().find(curved) else { return Err(faces[0]) };
            wanted[face].push(nalgebra::center(&mesh.positions[a as usize], &mesh.positions[b as usize]));
            open = face;
        }
    }
    Err(open)
}

/// How often diagonals that two faces have in common are looked for.
const ROUNDS: usize = 6;

/// One side of a triangle, from its lower vertex: the higher one, whether the triangle runs upwards along it, and the face.
type Side = (u32, bool, u32);

/// The sides of all triangles, by their lower vertex; those between the same vertices together.
struct Sides {
    /// Where the sides of each vertex begin, and where those of the last end.
    starts: Vec<usize>,
    all: Vec<Side>,
}

impl Sides {
    fn of(mesh: &TriMesh) -> Sides {
        let sides = |(t, face): (&[u32; 3], &u32)| [0, 1, 2].map(|k| (t[k], t[(k + 1) % 3], *face));
        let sides = || mesh.triangles.iter().zip(&mesh.faces).flat_map(sides);
        let mut starts = vec![0; mesh.positions.len() + 1];
        sides().for_each(|(a, b, _)| starts[a.min(b) as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let mut next = starts.clone();
        let mut all = vec![(0, false, 0); 3 * mesh.triangles.len()];
        for (a, b, face) in sides() {
            let place = &mut next[a.min(b) as usize];
            all[*place] = (a.max(b), a < b, face);
            *place += 1;
        }
        starts.windows(2).for_each(|w| all[w[0]..w[1]].sort_unstable());
        Sides { starts, all }
    }

    /// The lower vertex of a side, and all that run between the same two.
    fn groups(&self) -> impl Iterator<Item = (u32, &[Side])> {
        let from = |(a, w): (usize, &[usize])| {
            self.all[w[0]..w[1]].chunk_by(|s, t| s.0 == t.0).map(move |group| (a as u32, group))
        };
        self.starts.windows(2).enumerate().flat_map(from)
    }

    /// A face with a side that no triangle goes back along.
    fn open(&self) -> Option<usize> {
        let unpaired = |(_, group): &(u32, &[Side])| 2 * group.iter().filter(|s| s.1).count() != group.len();
        self.groups().find(unpaired).map(|(_, group)| group[0].2 as usize)
    }

    /// Sides that more than two triangles meet at, with the faces.
    fn doubled(&self) -> Vec<(u32, u32, Vec<usize>)> {
        let many = self.groups().filter(|(_, group)| group.len() > 2);
        many.map(|(a, group)| (a, group[0].0, group.iter().map(|s| s.2 as usize).collect())).collect()
    }
}

/// Corners, then the inner samples of every edge, as [`offsets`] counts them.
fn positions(solid: &Solid) -> Vec<Point3<f64>> {
    let mut positions = solid.vertices.clone();
    for edge in &solid.edges {
        let last = edge.samples.len() - 1;
        let first = usize::from(edge.ends[0].is_some());
        positions.extend_from_slice(&edge.samples[first..last]);
    }
    positions
}

/// A face's outline and the nodes inside it.
struct Patch<'a> {
    chart: Chart<'a>,
    outline: Outline,
    inner: Vec<Node>,
}

fn patch<'a>(
    solid: &'a Solid,
    face: usize,
    offsets: &[u32],
    quality: &Quality,
    wanted: &[Point3<f64>],
    positions: &mut Vec<Point3<f64>>,
) -> Option<Patch<'a>> {
    let (chart, rings) = rings(solid, face, offsets)?;
    let mut fresh = |uv: [f64; 2]| {
        positions.push(chart.at(uv));
        positions.len() as u32 - 1
    };
    let outline = Outline::new(&chart, &rings, &mut Grid { steps: steps(&chart, &rings, quality), fresh: &mut fresh })?;
    let mut inner = inner_nodes(&chart, &outline, quality, &mut fresh);
    inner.extend(wanted.iter().filter_map(|p| {
        let uv = outline.inside(&chart, p)?;
        Some(Node { uv, id: fresh(uv) })
    }));
    Some(Patch { chart, outline, inner })
}

pub(super) fn rings<'a>(solid: &'a Solid, face: usize, offsets: &[u32]) -> Option<(Chart<'a>, Vec<Ring>)> {
    let Face { outward, loops, .. } = &solid.faces[face];
    lay_out(solid.surface(face), *outward, &solid.edges, offsets, loops)
}

/// Nodes for a whole turn where a face has no edge to take them from.
pub(super) fn steps(chart: &Chart, rings: &[Ring], quality: &Quality) -> [usize; 2] {
    match chart.surface {
        Surface::Sphere { .. } | Surface::Torus { .. } => chart.steps(quality),
        _ => [rings.iter().map(|r| r.nodes.len()).max().unwrap_or(1), 1],
    }
}

/// Nodes inside a face that is curved: without them a triangle between two holes would cut the bulge off. On spheres and
/// tori a lattice of angles; on a cylinder or cone that is no plain strip, rows at the heights where the border has nodes.
fn inner_nodes(
    chart: &Chart,
    outline: &Outline,
    quality: &Quality,
    fresh: &mut dyn FnMut([f64; 2]) -> u32,
) -> Vec<Node> {
    let Some(period) = chart.periods()[0] else { return Vec::new() };
    if rows_of_strip(chart.surface, outline).is_some() {
        return Vec::new();
    }
    let girth = girth(chart.surface, outline);
    let point = |uv: [f64; 2]| flat(chart, girth, uv);
    let segments = |ring: &[Node]| -> Vec<[[f64; 2]; 2]> {
        (0..ring.len()).map(|i| [point(ring[i].uv), point(ring[(i + 1) % ring.len()].uv)]).collect()
    };
    let border: Vec<_> = std::iter::once(&outline.outer).chain(&outline.holes).flat_map(|r| segments(r)).collect();
    let range = |k: usize| {
        let all = outline.outer.iter().map(|n| n.uv[k]);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |r, x| [r[0].min(x), r[1].max(x)])
    };
    let (rows, steps) = lattice_rows(chart, outline, quality, range(1));
    let columns = chart.places(0, range(0), steps);
    let step = (point([period, 0.0])[0] - point([0.0, 0.0])[0]).abs() / steps as f64;
    let clearance = step * CLEARANCE;
    let mut nodes = Vec::new();
    for v in rows {
        let crossings = outline.crossings(v);
        let [_, y] = point([0.0, v]);
        let near = |s: &&[[f64; 2]; 2]| {
            let (low, high) = (s[0][1].min(s[1][1]), s[0][1].max(s[1][1]));
            low - clearance < y && y < high + clearance
        };
        let near: Vec<&[[f64; 2]; 2]> = border.iter().filter(near).collect();
        for u in &columns {
            let uv = [*u, v];
            let inside = crossings.partition_point(|c| c < u) % 2 == 1;
            if inside && near.iter().all(|s| distance(point(uv), **s) > clearance) {
                nodes.push(Node { uv, id: fresh(uv) });
            }
        }
    }
    nodes
}

/// Least distance of an inner node from the border, as a share of a step.
const CLEARANCE: f64 = 0.4;
/// More heights than this at the border of a cylinder's or cone's face are no steps but a curve: rows are then spaced evenly.
const MOST_LEVELS: usize = 12;
/// Distance of evenly spaced rows, in steps round the axis; and the most rows.
const ROW_STEPS: f64 = 1.5;
const MOST_ROWS: f64 = 256.0;

/// Heights v of the rows, and nodes for a whole turn along u.
fn lattice_rows(chart: &Chart, outline: &Outline, quality: &Quality, range: [f64; 2]) -> (Vec<f64>, usize) {
    let surface = chart.surface;
    if matches!(surface, Surface::Sphere { .. } | Surface::Torus { .. }) {
        let steps = chart.steps(quality);
        return (chart.places(1, range, steps[1]), steps[0]);
    }
    let radius = girth_in_mm(surface, outline);
    let steps = quality.steps(radius);
    let mut rows: Vec<f64> = outline.outer.iter().chain(outline.holes.iter().flatten()).map(|n| n.uv[1]).collect();
    rows.sort_by(f64::total_cmp);
    rows.dedup_by(|a, b| (*a - *b).abs() < tolerance::WELD);
    if rows.len() > MOST_LEVELS {
        let mm = |v: f64| flat(chart, 1.0, [0.0, v])[1];
        let (low, high) = (mm(range[0]), mm(range[1]));
        let step = std::f64::consts::TAU * radius / steps as f64 * ROW_STEPS;
        let count = ((high - low) / step).ceil().clamp(2.0, MOST_ROWS) as usize;
        rows = (1..count).map(|k| range[0] + (range[1] - range[0]) * k as f64 / count as f64).collect();
    }
    (rows, steps)
}

/// Radius of a cylinder, mean radius of a cone's face.
fn girth_in_mm(surface: &Surface, outline: &Outline) -> f64 {
    match surface {
        Surface::Cylinder { radius, .. } => *radius,
        _ => girth(surface, outline),
    }
}

fn distance(p: [f64; 2], [a, b]: [[f64; 2]; 2]) -> f64 {
    let (d, q) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let share = (d[0] * q[0] + d[1] * q[1]) / (d[0] * d[0] + d[1] * d[1]).max(f64::MIN_POSITIVE);
    let share = share.clamp(0.0, 1.0);
    (q[0] - d[0] * share).hypot(q[1] - d[1] * share)
}

/// The plane that a face is triangulated in: the chart with v stretched to distance along the surface, so that circles
/// about the axis and rulings stay straight and triangles keep their shape.
fn flat(chart: &Chart, girth: f64, uv: [f64; 2]) -> [f64; 2] {
    match chart.surface {
        Surface::Plane { .. } | Surface::Cylinder { .. } => uv,
        Surface::Cone { half_angle, .. } => [uv[0] * girth, slant(*half_angle, uv[1])],
        Surface::Sphere { radius, .. } => [uv[0], radius * (uv[1] / radius - 1.0).clamp(-1.0, 1.0).asin()],
        Surface::Torus { major, minor, .. } => {
            let own = chart.own(uv);
            let (x, y) = (own[0] / minor * (major.abs() + minor), minor * tube_angle(*major, *minor, own[1]));
            if chart.turned { [y, -x] } else { [x, y] }
        }
    }
}

/// Distance from the apex of a cone at chart coordinate `v`.
fn slant(half_angle: f64, v: f64) -> f64 {
    (2.0 * v.max(0.0) / half_angle.sin()).sqrt()
}

/// Mean radius of a cone's face: what a radian of turn is worth in mm. One for the others, whose charts are in mm.
fn girth(surface: &Surface, outline: &Outline) -> f64 {
    let Surface::Cone { half_angle, .. } = surface else { return 1.0 };
    let sum: f64 = outline.outer.iter().map(|n| slant(*half_angle, n.uv[1])).sum();
    sum / outline.outer.len() as f64 * half_angle.sin()
}

/// Adds the triangles of one face.
fn fill(solid: &Solid, face: usize, patch: &Patch, mesh: &mut TriMesh) -> Option<()> {
    if let Some((nodes, low)) = strip(patch) {
        let triangles = zipped(&nodes, low);
        add_triangles(solid, face, &patch.chart, &nodes, triangles, mesh);
        return Some(());
    }
    let mut nodes: Vec<Node> = Vec::new();
    let mut border: Vec<[usize; 2]> = Vec::new();
    for ring in std::iter::once(&patch.outline.outer).chain(&patch.outline.holes) {
        let start = nodes.len();
        nodes.extend_from_slice(ring);
        let end = nodes.len();
        border.extend((start..end).map(|i| [i, if i + 1 < end { i + 1 } else { start }]));
    }
    nodes.extend_from_slice(&patch.inner);
    let girth = girth(patch.chart.surface, &patch.outline);
    let points: Vec<[f64; 2]> = nodes.iter().map(|n| flat(&patch.chart, girth, n.uv)).collect();
    let is_plain = matches!(patch.chart.surface, Surface::Plane { .. }) && patch.outline.holes.len() < 2;
    let plain = if is_plain { super::flat::triangles(&points, patch.outline.outer.len()) } else { None };
    let triangles = plain.or_else(|| delaunay(&points, &border))?;
    add_triangles(solid, face, &patch.chart, &nodes, triangles, mesh);
    Some(())
}

/// Nodes of two rows along circles about the axis, and how many the lower one has: most faces of cylinders and cones, and flat
/// quadrangles whose sides run along the chart.
fn strip(patch: &Patch) -> Option<(Vec<Node>, usize)> {
    let (mut low, high) = rows_of_strip(patch.chart.surface, &patch.outline)?;
    let count = low.len();
    low.extend(high);
    Some((low, count))
}

/// The two rows, by ascending u, of a face that has no other nodes.
fn rows_of_strip(surface: &Surface, outline: &Outline) -> Option<(Vec<Node>, Vec<Node>)> {
    let outer = &outline.outer;
    if !outline.holes.is_empty() || matches!(surface, Surface::Sphere { .. } | Surface::Torus { .. }) {
        return None;
    }
    let reach = outer.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |r, n| [r[0].min(n.uv[1]), r[1].max(n.uv[1])]);
    let level = |n: &Node, v: f64| (n.uv[1] - v).abs() < tolerance::POINT;
    if reach[1] - reach[0] < tolerance::WELD || !outer.iter().all(|n| level(n, reach[0]) || level(n, reach[1])) {
        return None;
    }
    let before = |i: usize| &outer[(i + outer.len() - 1) % outer.len()];
    let start = (0..outer.len()).find(|i| level(&outer[*i], reach[0]) && !level(before(*i), reach[0]))?;
    let turned = outer[start..].iter().chain(&outer[..start]).copied();
    let (low, mut high): (Vec<Node>, Vec<Node>) = turned.partition(|n| level(n, reach[0]));
    high.reverse();
    let ascends = |row: &[Node]| row.windows(2).all(|w| w[0].uv[0] < w[1].uv[0]);
    (ascends(&low) && ascends(&high)).then_some((low, high))
}

/// Triangles between two rows of ascending u, the one that lags being advanced.
fn zipped(nodes: &[Node], low: usize) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(nodes.len());
    let (mut i, mut j) = (0, low);
    loop {
        let next = |k: usize, end: usize| if k + 1 < end { nodes[k + 1].uv[0] } else { f64::INFINITY };
        let (a, b) = (next(i, low), next(j, nodes.len()));
        if a.is_infinite() && b.is_infinite() {
            return triangles;
        }
        if a <= b {
            triangles.push([i, i + 1, j]);
            i += 1;
        } else {
            triangles.push([i, j + 1, j]);
            j += 1;
        }
    }
}

/// Share of a face's size that its nodes are shaken by before they are triangulated.
const SHAKE: f64 = 1e-9;

/// Points moved a hair's breadth, each its own way: exact predicates are slow on points of one circle, of which every
/// round face is full, and any of their triangulations is as good as another.
fn shaken(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let reach = points.iter().fold(0.0, |r: f64, p| r.max(p[0].abs()).max(p[1].abs()));
    // Low-discrepancy steps (golden ratio and the root of two): no two neighbours move alike.
    let move_by = |i: usize, step: f64| ((i as f64 * step).fract() - 0.5) * reach * SHAKE;
    let place = |(i, p): (usize, &[f64; 2])| [p[0] + move_by(i, 0.618_033_988_75), p[1] + move_by(i, 0.414_213_562_37)];
    points.iter().enumerate().map(place).collect()
}

/// Adds triangles of nodes, counter-clockwise in the chart; one with two corners at a pole is no triangle.
fn add_triangles(
    solid: &Solid,
    face: usize,
    chart: &Chart,
    nodes: &[Node],
    triangles: Vec<[usize; 3]>,
    mesh: &mut TriMesh,
) {
    let Face { outward, .. } = solid.faces[face];
    let sense = if outward { 1.0 } else { -1.0 };
    let normals: Vec<Vector3<f64>> = nodes.iter().map(|n| chart.normal(n.uv) * sense).collect();
    for [a, b, c] in triangles {
        let corners = if outward { [a, b, c] } else { [a, c, b] };
        let ids = corners.map(|i| nodes[i].id);
        if ids[0] != ids[1] && ids[1] != ids[2] && ids[2] != ids[0] {
            mesh.triangles.push(ids);
            mesh.normals.push(corners.map(|i| normals[i]));
            mesh.faces.push(face as u32);
        }
    }
}

/// Triangles, counter-clockwise, to the left of the border; `None` when it crosses itself.
fn delaunay(points: &[[f64; 2]], border: &[[usize; 2]]) -> Option<Vec<[usize; 3]>> {
    let (firsts, place) = welded(points);
    let border: Vec<[usize; 2]> = border.iter().map(|e| e.map(|i| place[i])).filter(|[a, b]| a != b).collect();
    let distinct: Vec<[f64; 2]> = firsts.iter().map(|i| points[*i]).collect();
    let vertices: Vec<Point2<f64>> = shaken(&distinct).into_iter().map(|p| Point2::new(p[0], p[1])).collect();
    let mut crossed = false;
    let cdt: ConstrainedDelaunayTriangulation<Point2<f64>> =
        ConstrainedDelaunayTriangulation::try_bulk_load_cdt(vertices, border.clone(), |_| crossed = true).ok()?;
    if crossed || cdt.num_vertices() != firsts.len() {
        return None;
    }
    let mut open = Vec::new();
    for [a, b] in border.iter().map(|e| e.map(FixedVertexHandle::from_index)) {
        open.push(cdt.get_edge_from_neighbors(a, b)?.face().fix());
    }
    let mut seen = vec![false; cdt.num_all_faces()];
    let mut triangles = Vec::new();
    while let Some(face) = open.pop() {
        if std::mem::replace(&mut seen[face.index()], true) {
            continue;
        }
        let face = cdt.face(face).as_inner()?;
        triangles.push(face.vertices().map(|v| firsts[v.fix().index()]));
        let across = face.adjacent_edges().into_iter().filter(|e| !e.is_constraint_edge());
        open.extend(across.map(|e| e.rev().face().fix()));
    }
    Some(triangles)
}

/// Points that are equal to the last bit made one: the first of each, and which of those each point is.
fn welded(points: &[[f64; 2]]) -> (Vec<usize>, Vec<usize>) {
    let mut known: HashMap<[u64; 2], usize> = HashMap::new();
    let mut firsts = Vec::new();
    let mut place = Vec::with_capacity(points.len());
    for (i, p) in points.iter().enumerate() {
        // Adding zero makes one zero of the two.
        let at = *known.entry(p.map(|c| (c + 0.0).to_bits())).or_insert_with(|| {
            firsts.push(i);
            firsts.len() - 1
        });
        place.push(at);
    }
    (firsts, place)
}
