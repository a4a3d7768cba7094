//! What a placement stands on: a component, and the frame of one of its features.
//!
//! In: a path such as `plate.mount.screw[2]`. Out: a frame per copy, in the component's frame; features of groups too.

use super::assemble::Assembled;
use super::interval::{plus, times};
use super::model::{Expr, Feature, PoseExpr, Shape};
use super::scope::Resolver;
use crate::diag::Diagnostic;
use crate::diag::suggest::nearest;
use crate::syntax::ast::{self, Segment};
use nalgebra::{Rotation3, UnitQuaternion};

/// A component and the frame of one of its features, in the component's frame.
pub struct Seat {
    pub component: usize,
    pub frame: PoseExpr,
}

impl Resolver {
    /// Where copies placed on `path` stand, in order.
    pub fn seats(&mut self, path: &ast::Path, built: &Assembled) -> Option<Vec<Seat>> {
        let (first, rest) = path.segments.split_first()?;
        let group = built.groups.get(&first.name.text)?;
        let mut seats = Vec::new();
        for component in self.chosen(first, group.len())?.into_iter().map(|i| group[i]) {
            let part = &built.parts[built.components[component].part];
            let owner = format!("part `{}`", part.name);
            let frames = self.frames_on(&owner, &part.features, rest, &PoseExpr::identity())?;
            seats.extend(frames.into_iter().map(|frame| Seat { component, frame }));
        }
        Some(seats)
    }

    /// The frames that a path picks among features, within a frame of their own.
    fn frames_on(
        &mut self,
        owner: &str,
        features: &[Feature],
        path: &[Segment],
        within: &PoseExpr,
    ) -> Option<Vec<PoseExpr>> {
        let Some((first, rest)) = path.split_first() else { return Some(vec![within.clone()]) };
        let feature = self.feature_named(owner, features, &first.name)?;
        let mut frames = Vec::new();
        for i in self.chosen(first, feature.copies.len())? {
            let copy = &feature.copies[i];
            let Some(frame) = composed(within, &copy.pose) else {
                self.no_frame(&first.name);
                return None;
            };
            match (&copy.shape, rest.first()) {
                (Shape::Group { features }, Some(_)) => {
                    let owner = format!("group `{}`", feature.name);
                    frames.extend(self.frames_on(&owner, features, rest, &frame)?);
                }
                (_, Some(deeper)) => {
                    let message = format!("`{}` has no features of its own", feature.name);
                    let label = "only groups and holes have";
                    self.report(Diagnostic::error("E0203", deeper.name.span, message).label(label));
                    return None;
                }
                (_, None) => frames.push(frame),
            }
        }
        Some(frames)
    }

    fn feature_named<'f>(&mut self, owner: &str, features: &'f [Feature], name: &ast::Name) -> Option<&'f Feature> {
        let found = features.iter().find(|f| f.name == name.text);
        // A part that could not be made has no features, and why has been said.
        if found.is_none() && !features.is_empty() && !self.failed.contains(&name.text) {
            let message = format!("{owner} has no feature `{}`", name.text);
            let diagnostic = Diagnostic::error("E0201", name.span, message).label("unknown feature");
            let names = features.iter().map(|f| f.name.as_str());
            self.report(match nearest(&name.text, names.clone()) {
                Some(near) => diagnostic.meant(name.span, near),
                None => diagnostic.help(format!("its features: {}", names.collect::<Vec<_>>().join(", "))),
            });
        }
        found
    }

    fn no_frame(&mut self, name: &ast::Name) {
        let message =
            format!("`{}` stands in a group whose turn has a tolerance, so its own frame has no fixed turn", name.text);
        self.report(
            Diagnostic::error("E0203", name.span, message)
                .label("nothing can be placed on it")
                .help("place it on the group, or make the group's turn exact"),
        );
    }

    /// Indices that `[2]` or `[1..3]` picks among `count`; all without an index.
    pub fn chosen(&mut self, segment: &Segment, count: usize) -> Option<Vec<usize>> {
        let Some(index) = &segment.index else { return Some((0..count).collect()) };
        let last = index.last.unwrap_or(index.first);
        if index.first >= 1 && index.first <= last && last <= count as u64 {
            return Some((index.first as usize - 1..last as usize).collect());
        }
        let message = format!("`{}` has {}", segment.name.text, copies(count));
        let last = format!("[{}]", index.first.clamp(1, count.max(1) as u64));
        self.report(Diagnostic::error("E0505", index.span, message).label("no such copy").suggest(
            format!("write `{}{last}`", segment.name.text),
            index.span,
            last,
        ));
        None
    }
}

/// `outer · inner`, if the turns that have to be multiplied are numbers.
fn composed(outer: &PoseExpr, inner: &PoseExpr) -> Option<PoseExpr> {
    let [[ox, oy, oz], [ix, iy, iz]] = [&outer.r, &inner.r].map(|r| r.clone());
    let zero = Expr::Const(0.0);
    let turn = angles(&outer.r);
    let t = match &turn {
        Some(turn) => moved(&outer.t, turn, &inner.t),
        None if inner.t.iter().all(|e| *e == zero) => outer.t.clone(),
        None => return None,
    };
    if ox == zero && oy == zero {
        return Some(PoseExpr { t, r: [ix, iy, plus(oz, iz)] });
    }
    let (roll, pitch, yaw) = (turn? * angles(&inner.r)?).euler_angles();
    Some(PoseExpr { t, r: [roll, pitch, yaw].map(Expr::Const) })
}

/// The turn `Rz · Ry · Rx`, if it is made of numbers.
fn angles(r: &[Expr; 3]) -> Option<UnitQuaternion<f64>> {
    match r {
        [Expr::Const(x), Expr::Const(y), Expr::Const(z)] => Some(UnitQuaternion::from_euler_angles(*x, *y, *z)),
        _ => None,
    }
}

/// `t + turn · by`
fn moved(t: &[Expr; 3], turn: &UnitQuaternion<f64>, by: &[Expr; 3]) -> [Expr; 3] {
    let matrix = Rotation3::from(*turn);
    [0, 1, 2].map(|row| {
        let turned = (0..3).map(|column| times(&by[column], matrix[(row, column)]));
        turned.fold(t[row].clone(), plus)
    })
}

/// `3 copies`
pub fn copies(count: usize) -> String {
    if count == 1 { "1 copy".to_string() } else { format!("{count} copies") }
}

#[cfg(test)]
mod tests {
    use super::super::model::DimId;
    use super::*;
    use nalgebra::Isometry3;

    #[test]
    fn composed_poses_are_products_of_poses() {
        let values = [0.3, -2.0, 1.1];
        let d = |i| Expr::Dim(DimId(i));
        let c = Expr::Const;
        let outer = [
            PoseExpr { t: [d(0), c(2.0), d(1)], r: [c(0.4), c(-1.2), c(2.0)] },
            PoseExpr { t: [d(0), c(2.0), d(1)], r: [c(0.0), c(0.0), c(0.7)] },
        ];
        let inner = [
            PoseExpr { t: [d(2), d(1), c(4.0)], r: [c(1.0), c(0.2), c(-0.3)] },
            PoseExpr { t: [c(1.0), d(1), c(4.0)], r: [c(0.0), c(0.0), c(0.0)] },
        ];
        let apart = |a: &Isometry3<f64>, b: &Isometry3<f64>| {
            (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
        };
        for (o, i) in outer.iter().flat_map(|o| inner.iter().map(move |i| (o, i))) {
            let both = composed(o, i).unwrap();
            assert!(apart(&both.eval(&values), &(o.eval(&values) * i.eval(&values))) < 1e-9, "{o:?} {i:?}");
        }
        let loose = PoseExpr { t: [c(0.0), c(0.0), c(0.0)], r: [d(0), c(0.0), c(0.0)] };
        assert_eq!(composed(&loose, &inner[0]), None);
        let about_z = PoseExpr { t: [c(0.0), c(0.0), c(0.0)], r: [c(0.0), c(0.0), d(0)] };
        let seated = PoseExpr { t: [c(0.0), c(0.0), c(0.0)], r: [c(0.5), c(0.0), d(2)] };
        let both = composed(&about_z, &seated).unwrap();
        assert!(apart(&both.eval(&values), &(about_z.eval(&values) * seated.eval(&values))) < 1e-12);
    }
}
