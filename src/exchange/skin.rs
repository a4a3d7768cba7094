//! The boundary of a solid as exchange formats want it: every edge between two vertices, every face within one outer loop.
//!
//! In: a [`Solid`], whose closed edges have no vertex and whose round faces have no seam. Out: a [`Skin`] with both, grouped
//! in shells. Same faces, same curves, same surfaces; nothing is moved.

use super::polar::Polar;
use super::seam::{Foot, Plan, Seam, Seamstress};
use super::track::Track;
use crate::solid::{Solid, Surface};
use nalgebra::Point3;
use std::collections::BTreeMap;

/// A loop of (rim, runs forward), with its face on the left seen from outside.
pub(super) type Loop = Vec<(usize, bool)>;

/// An edge or a piece of one, or a seam.
#[derive(Debug, Clone)]
pub(super) struct Rim {
    pub track: Track,
    /// Indices into [`Skin::points`].
    pub ends: [usize; 2],
}

/// A face of the solid.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    /// Index into [`Solid::faces`].
    pub face: usize,
    /// The map its seams follow; `None` for a plane.
    pub polar: Option<Polar>,
    /// The outer loop first. None at all for a whole sphere.
    pub loops: Vec<Loop>,
}

#[derive(Debug, Clone)]
pub(super) struct Skin {
    pub points: Vec<Point3<f64>>,
    pub rims: Vec<Rim>,
    pub panels: Vec<Panel>,
    /// Indices into [`Skin::panels`]: the outside first, then voids.
    pub shells: Vec<Vec<usize>>,
}

impl Skin {
    /// `None` for a solid whose edges have no samples, which the kernel does not make.
    pub fn new(solid: &Solid) -> Option<Skin> {
        let mut sewing = Seamstress::new(solid)?;
        let plans: Vec<Plan> = (0..solid.faces.len()).map(|f| sewing.open(f)).collect();
        sewing.quarter(&plans);
        let mut tailor = Tailor::new(sewing);
        let panels = plans.into_iter().enumerate().map(|(f, plan)| tailor.panel(f, plan)).collect();
        Some(Skin { points: tailor.points, rims: tailor.rims, panels, shells: shells(solid) })
    }
}

/// Makes rims of edges, then panels of faces.
struct Tailor<'a> {
    sewing: Seamstress<'a>,
    points: Vec<Point3<f64>>,
    rims: Vec<Rim>,
    /// Rims of each edge, from its start to its end.
    pieces: Vec<Vec<usize>>,
    /// Vertices of the marks of each edge.
    vertices: Vec<Vec<usize>>,
}

impl<'a> Tailor<'a> {
    fn new(sewing: Seamstress<'a>) -> Self {
        let points = sewing.solid.vertices.clone();
        let mut tailor = Tailor { sewing, points, rims: Vec::new(), pieces: Vec::new(), vertices: Vec::new() };
        (0..tailor.sewing.tracks.len()).for_each(|edge| tailor.cut_edge(edge));
        tailor
    }

    /// Cuts an edge at its marks; a closed one without a mark gets its vertex where it starts.
    fn cut_edge(&mut self, edge: usize) {
        let ends = self.sewing.solid.edges[edge].ends;
        let mut marks = self.sewing.marks[edge].clone();
        if ends[0].is_none() && marks.is_empty() {
            marks.push(0.0);
        }
        let track = self.sewing.tracks[edge].clone();
        let fresh: Vec<usize> = marks.iter().map(|t| self.vertex(track.at(*t))).collect();
        let mut stops: Vec<(f64, usize)> = marks.into_iter().zip(fresh.iter().copied()).collect();
        match ends {
            [Some(a), Some(b)] => {
                stops.insert(0, (0.0, a));
                stops.push((1.0, b));
            }
            _ => stops.push((stops[0].0 + 1.0, stops[0].1)),
        }
        let piece = |w: &[(f64, usize)]| Rim { track: track.part(w[0].0, w[1].0), ends: [w[0].1, w[1].1] };
        let first = self.rims.len();
        self.rims.extend(stops.windows(2).map(piece));
        self.pieces.push((first..self.rims.len()).collect());
        self.vertices.push(fresh);
    }

    fn vertex(&mut self, p: Point3<f64>) -> usize {
        self.points.push(p);
        self.points.len() - 1
    }

    fn panel(&mut self, face: usize, plan: Plan) -> Panel {
        let solid = self.sewing.solid;
        let mut loops: Vec<Loop> = solid.faces[face].loops.iter().map(|l| self.rims_of(l)).collect();
        if let Some(outer) = plan.outer.filter(|o| *o < loops.len()) {
            loops[..=outer].rotate_right(1);
        }
        if let (Some([u, v]), Some(polar)) = (plan.square, &plan.polar) {
            loops.splice(0..0, self.square(polar, u, v, solid.faces[face].outward));
        }
        // A whole sphere needs no loop: formats have a word for it, which readers know of spheres only.
        let sphere = matches!(solid.surface(face), Surface::Sphere { .. });
        if !(sphere && loops.is_empty()) {
            self.sew(&mut loops, &plan);
        }
        Panel { face, polar: plan.polar, loops }
    }

    fn rims_of(&self, halves: &[(usize, bool)]) -> Loop {
        let pieces = |&(edge, forward): &(usize, bool)| {
            let mut rims: Loop = self.pieces[edge].iter().map(|r| (*r, forward)).collect();
            if !forward {
                rims.reverse();
            }
            rims
        };
        halves.iter().flat_map(pieces).collect()
    }

    /// The seams of a torus that goes round both ways, as the loop that bounds it once it is cut open.
    fn square(&mut self, polar: &Polar, u: f64, v: f64, outward: bool) -> Option<Loop> {
        let corner = polar.on_torus(u, v)?;
        let round = polar.parallel(u, v)?;
        let vertex = self.vertex(corner);
        let first = self.rims.len();
        for track in [round, polar.meridian(u, corner, corner)] {
            self.rims.push(Rim { track, ends: [vertex; 2] });
        }
        let (round, up) = (first, first + 1);
        let sides = vec![(round, true), (up, true), (round, false), (up, false)];
        Some(if outward { sides } else { sides.into_iter().rev().map(|(r, f)| (r, !f)).collect() })
    }

    /// Sews the seams in: each joins two loops, or a loop and a pole, to one that runs along it there and back.
    fn sew(&mut self, loops: &mut Vec<Loop>, plan: &Plan) {
        let mut poles: BTreeMap<usize, usize> = BTreeMap::new();
        for Seam { feet, track } in &plan.seams {
            let ends = feet.map(|foot| match foot {
                Foot::Corner(v) => v,
                Foot::On(edge, t) => self.vertices[edge][self.sewing.marked(edge, t).unwrap_or(0)],
                Foot::Pole(k) => {
                    let p = track.at(k as f64);
                    *poles.entry(k).or_insert_with(|| self.vertex(p))
                }
            });
            let seam = self.rims.len();
            self.rims.push(Rim { track: track.clone(), ends });
            let first = self.take(loops, ends[0]);
            let second = self.take(loops, ends[1]);
            let there = first.into_iter().chain([(seam, true)]);
            let merged = there.chain(second).chain([(seam, false)]).collect();
            loops.insert(0, merged);
        }
    }

    /// Takes the loop through a vertex out of the list, turned to start there; empty at a pole.
    fn take(&self, loops: &mut Vec<Loop>, vertex: usize) -> Loop {
        let starts = |&(rim, forward): &(usize, bool)| self.rims[rim].ends[usize::from(!forward)] == vertex;
        let found = loops.iter().enumerate().find_map(|(i, l)| l.iter().position(starts).map(|k| (i, k)));
        let Some((i, k)) = found else { return Vec::new() };
        let mut taken = loops.remove(i);
        taken.rotate_left(k);
        taken
    }
}

/// Faces joined by edges, the shell with the greatest volume first; voids have a negative one.
fn shells(solid: &Solid) -> Vec<Vec<usize>> {
    let mut owner: Vec<usize> = (0..solid.faces.len()).collect();
    fn root(owner: &[usize], mut i: usize) -> usize {
        while owner[i] != i {
            i = owner[i];
        }
        i
    }
    for edge in &solid.edges {
        let [a, b] = edge.faces.map(|f| root(&owner, f));
        owner[a.max(b)] = a.min(b);
    }
    let mut shells: BTreeMap<usize, (f64, Vec<usize>)> = BTreeMap::new();
    (0..solid.faces.len()).for_each(|f| shells.entry(root(&owner, f)).or_default().1.push(f));
    let mesh = &solid.mesh;
    for (triangle, face) in mesh.triangles.iter().zip(&mesh.faces) {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize].coords);
        shells.entry(root(&owner, *face as usize)).or_default().0 += a.dot(&b.cross(&c)) / 6.0;
    }
    let mut shells: Vec<(f64, Vec<usize>)> = shells.into_values().collect();
    shells.sort_by(|a, b| b.0.total_cmp(&a.0));
    shells.into_iter().map(|s| s.1).collect()
}
