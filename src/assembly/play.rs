//! How near two faces can come, and how far apart they can be, over all limits and placement zones.
//!
//! In: a contact's gauge, the expressions of its faces and of the placements between them. Out: the least and largest
//! distance, and what each dimension takes of it at the worst. One dimension at a time is put to its limits; the worst
//! corner follows from these shifts (the farthest vertex of the zonotope they span) and is then evaluated in full.

use super::matching::{Gauge, Lie};
use super::sides::{Joint, Side, moved};
use crate::design::model::{Design, DimId, Values};
use crate::solid::Surface;
use nalgebra::Vector3;

/// What limits and zones can do to the distance of two faces.
#[derive(Debug, Clone)]
pub(crate) struct Play {
    /// The least and the largest distance (mm); negative where the faces enter each other.
    pub range: [f64; 2],
    /// What each dimension takes at the least distance, the largest first.
    pub shares: Vec<Share>,
}

/// What one dimension takes of the distance at the worst corner.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Share {
    pub dim: DimId,
    /// Its value there: one of its limits.
    pub at: f64,
    /// mm.
    pub loss: f64,
    /// Whether it moves an axis or a centre sideways rather than changing a size.
    pub sideways: bool,
}

/// Both faces of a contact at any draw.
pub(crate) struct Mating<'a> {
    pub design: &'a Design,
    pub joint: &'a Joint<'a>,
    pub sides: &'a [Side; 2],
    pub gauge: &'a Gauge,
}

impl Mating<'_> {
    /// How the faces lie to each other at these dimensions.
    pub fn lies(&self, values: &Values) -> Vec<Lie> {
        let poses = self.joint.poses(values);
        let surface = |k: usize| -> Option<Surface> { Some(moved(&self.sides[k].at(values)?, &poses[k])) };
        match (surface(0), surface(1)) {
            (Some(s), Some(t)) => self.gauge.lies(&s, &t),
            _ => Vec::new(),
        }
    }

    /// `values` are nominal, before and after; `None` where a face is of another kind at its limits.
    pub fn play(&self, values: &mut Values) -> Option<Play> {
        let still = self.lies(values);
        let moves = self.moves(values, &still)?;
        let corner = (0..still.len())
            .map(|k| worst(still[k], &moves.iter().map(|m| m.at(k)).collect::<Vec<_>>()))
            .min_by(|a, b| a.margin.total_cmp(&b.margin))?;
        for (m, end) in moves.iter().zip(&corner.ends) {
            if let Some(end) = end {
                values[m.dim.0 as usize] = m.values[*end];
            }
        }
        let reached = self.lies(values).iter().map(Lie::margin).reduce(f64::min);
        moves.iter().for_each(|m| values[m.dim.0 as usize] = self.design.dims[m.dim.0 as usize].range.nominal);
        let most = (0..still.len()).map(|k| widest(still[k], k, &moves)).reduce(f64::max)?;
        Some(Play { range: [reached?, most], shares: corner.shares(&moves) })
    }

    /// What each dimension that counts does at either limit.
    fn moves(&self, values: &mut Values, still: &[Lie]) -> Option<Vec<Move>> {
        let mut dims = self.joint.dims();
        self.sides.iter().for_each(|s| s.dims(&mut dims));
        let mut moves = Vec::new();
        for dim in self.joint.varying(dims) {
            let (slot, range) = (dim.0 as usize, self.design.dims[dim.0 as usize].range);
            let mut ends = [range.low, range.high].map(|value| {
                values[slot] = value;
                self.lies(values)
            });
            values[slot] = range.nominal;
            for lies in &mut ends {
                if lies.len() != still.len() {
                    return None;
                }
                lies.iter_mut().zip(still).for_each(|(l, s)| *l = l.minus(s));
            }
            if ends.iter().flatten().any(|l| l.gap.abs() + l.offset.norm() > NOTHING) {
                moves.push(Move { dim, values: [range.low, range.high], ends });
            }
        }
        Some(moves)
    }
}

/// Less than this (mm) is what rounding leaves.
const NOTHING: f64 = 1e-9;

/// What a dimension does at its two limits, per probe.
struct Move {
    dim: DimId,
    values: [f64; 2],
    ends: [Vec<Lie>; 2],
}

impl Move {
    fn at(&self, probe: usize) -> [Lie; 2] {
        [self.ends[0][probe], self.ends[1][probe]]
    }
}

/// The corner of the limits where two faces come nearest at one probe.
struct Corner {
    margin: f64,
    /// Per move the limit it stands at; `None` for nominal.
    ends: Vec<Option<usize>>,
    towards: Vector3<f64>,
    probe: Vec<[Lie; 2]>,
}

/// Directions of single limits that the search starts from, at most.
const MOST_STARTS: usize = 24;
/// Most rounds of the search from one start; each can only make the corner worse.
const ROUNDS: usize = 8;

/// For a direction of the offset the worst limit of every dimension is known, and these limits give the offset a new
/// direction: repeated from every direction that one dimension alone moves it, and two together do.
fn worst(still: Lie, moves: &[[Lie; 2]]) -> Corner {
    if let Some(way) = still.way {
        return towards(still, moves, way);
    }
    let offsets: Vec<Vector3<f64>> =
        moves.iter().flatten().map(|l| l.offset).filter(|o| o.norm() > NOTHING).take(MOST_STARTS).collect();
    let two = offsets.iter().enumerate().flat_map(|(i, p)| offsets[..i].iter().map(move |q| p + q));
    let starts = offsets.iter().copied().chain([still.offset]).chain(two).filter_map(|o| o.try_normalize(NOTHING));
    let starts: Vec<Vector3<f64>> = starts.chain([Vector3::zeros()]).collect();
    let corners = starts.into_iter().map(|start| {
        let mut corner = towards(still, moves, start);
        for _ in 0..ROUNDS {
            let next = towards(still, moves, corner.towards);
            if next.margin >= corner.margin - NOTHING {
                break;
            }
            corner = next;
        }
        corner
    });
    corners.min_by(|a, b| a.margin.total_cmp(&b.margin)).unwrap_or_else(|| towards(still, moves, Vector3::zeros()))
}

/// The corner that takes most while the offset points this way.
fn towards(still: Lie, moves: &[[Lie; 2]], way: Vector3<f64>) -> Corner {
    let taken = |l: &Lie| way.dot(&l.offset) - l.gap;
    let end = |ends: &[Lie; 2]| {
        let worse = usize::from(taken(&ends[1]) > taken(&ends[0]));
        (taken(&ends[worse]) > 0.0).then_some(worse)
    };
    let ends: Vec<Option<usize>> = moves.iter().map(end).collect();
    let mut lie = still;
    for (m, end) in moves.iter().zip(&ends) {
        if let Some(end) = end {
            lie = lie.plus(&m[*end]);
        }
    }
    let towards = lie.way.or_else(|| lie.offset.try_normalize(NOTHING)).unwrap_or(way);
    Corner { margin: lie.margin(), ends, towards, probe: moves.to_vec() }
}

impl Corner {
    fn shares(&self, moves: &[Move]) -> Vec<Share> {
        let share = |((m, end), lies): ((&Move, &Option<usize>), &[Lie; 2])| {
            let end = (*end)?;
            let sideways = self.towards.dot(&lies[end].offset);
            let loss = sideways - lies[end].gap;
            Some(Share { dim: m.dim, at: m.values[end], loss, sideways: sideways > loss / 2.0 })
        };
        let mut shares: Vec<Share> = moves.iter().zip(&self.ends).zip(&self.probe).filter_map(share).collect();
        shares.sort_by_key(|s| std::cmp::Reverse((s.loss / NOTHING) as i64));
        shares
    }
}

/// The largest gap at one probe, with the axes as they are at nominal.
fn widest(still: Lie, probe: usize, moves: &[Move]) -> f64 {
    let more = |m: &Move| m.ends.iter().map(|e| e[probe].gap).fold(0.0, f64::max);
    still.margin() + moves.iter().map(more).sum::<f64>()
}
