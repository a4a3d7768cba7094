//! What a workshop has its own word for, put together from primitives: holes and chamfered cylinders.
//!
//! A hole stands on the face it is drilled into: that face is z = 0 of the feature, and the hole goes down from there,
//! whatever its depth. Like the tool that makes it, it also clears a little above, so that no skin is left where the face
//! lies higher within its tolerance. Its features are named `bore`, `head` and `point`. A chamfered cylinder is a turned
//! outline whose sides have the names of a plain cylinder's faces.

use super::dimension::trim;
use super::interval::{half, minus, plus, times};
use super::model::{
    Corner, Expr, Extent, Feature, FeatureCopy, Op, Outline, OutlinePath, OutlineSide, PoseExpr, Shape,
};
use super::shape::Sizes;
use crate::diag::Diagnostic;
use crate::units::Quantity;

/// Angles of drills and countersinks lie between these (degrees): a point flatter or slimmer is a slip of the pen.
const ANGLES: [f64; 2] = [10.0, 170.0];
/// How far a hole clears above its face (mm), but no farther than its mouth's radius: more than the general tolerance of
/// anything shorter than a metre, less than what stands apart on a part. No drawing has it: where a face of the part lay level
/// with its end, the two would part within tolerance, and a face that nobody sees would come and go.
const CLEARANCE: f64 = 0.937;
/// That of a countersink when nothing is said (rad).
const RIGHT_ANGLE: f64 = std::f64::consts::FRAC_PI_2;

impl Sizes<'_, '_> {
    /// `hole(d, h)`, with a drill's point below its depth when `tip` is given.
    pub fn hole(&mut self) -> Option<Shape> {
        self.known(&["d", "h", "tip"]);
        self.takes_material()?;
        let (d, h) = (self.size("d", "6"), self.extent("h"));
        let tip = self.has("tip").then(|| self.angle("tip"));
        let (d, h) = (d?, h?);
        let mut features = vec![self.bore(d.clone(), h.clone(), self.clearance(&d))];
        match (tip, h) {
            (Some(_), Extent::Through) => {
                self.no_end("tip", "a hole that goes through has no point");
                return None;
            }
            (Some(angle), Extent::Length(h)) => {
                let length = times(&d, 0.5 / (angle / 2.0).tan());
                let below = minus(Expr::Const(0.0), plus(h, length.clone()));
                let cone = Shape::Cone { d1: Expr::Const(0.0), d2: d, h: Extent::Length(length) };
                features.push(self.member("point", cone, below));
            }
            (None, _) => {}
        }
        Some(Shape::Group { features })
    }

    /// A bore with a wider cylinder at its mouth for a screw's head.
    pub fn counterbore(&mut self) -> Option<Shape> {
        self.known(&["d", "h", "head_d", "head_h"]);
        self.takes_material()?;
        let (d, h) = (self.size("d", "6"), self.extent("h"));
        let (head_d, head_h) = (self.size("head_d", "11"), self.size("head_h", "6"));
        let (d, h, head_d, head_h) = (d?, h?, head_d?, head_h?);
        let wide = self.larger(&head_d, "head_d", &d, "d");
        let deep = match &h {
            Extent::Length(h) => self.larger(h, "h", &head_h, "head_h"),
            Extent::Through => true,
        };
        let clear = Expr::Const(self.clearance(&head_d));
        let head = Shape::Cylinder { d: head_d, h: Extent::Length(plus(head_h.clone(), clear)) };
        let features = vec![self.bore(d, h, 0.0), self.member("head", head, minus(Expr::Const(0.0), head_h))];
        (wide && deep).then_some(Shape::Group { features })
    }

    /// A bore with a cone at its mouth, `head_d` wide in the face.
    pub fn countersink(&mut self) -> Option<Shape> {
        self.known(&["d", "h", "head_d", "angle"]);
        self.takes_material()?;
        let (d, h, head_d) = (self.size("d", "6"), self.extent("h"), self.size("head_d", "12"));
        let angle = self.angle("angle");
        let (d, h, head_d) = (d?, h?, head_d?);
        if !self.larger(&head_d, "head_d", &d, "d") {
            return None;
        }
        let depth = times(&minus(head_d.clone(), d.clone()), 0.5 / (angle / 2.0).tan());
        if let Extent::Length(h) = &h
            && self.resolver.lowest(&minus(h.clone(), depth.clone())) <= 0.0
        {
            let message = "the hole must be deeper than its head at every limit";
            let span = self.span_of("h");
            self.resolver.report(
                Diagnostic::error("E0307", span, message)
                    .label("ends inside the head")
                    .help("make `h` larger, or `h = through`"),
            );
            return None;
        }
        let clear = self.clearance(&head_d);
        let wide = plus(head_d, Expr::Const(2.0 * clear * (angle / 2.0).tan()));
        let height = plus(depth.clone(), Expr::Const(clear));
        let cone = Shape::Cone { d1: d.clone(), d2: wide, h: Extent::Length(height) };
        let features = vec![self.bore(d, h, 0.0), self.member("head", cone, minus(Expr::Const(0.0), depth))];
        Some(Shape::Group { features })
    }

    /// `cylinder(d, h)`, its ends broken by `chamfer`, `chamfer_top` or `chamfer_bottom`: a body gets narrower there, a
    /// hole wider.
    pub fn cylinder(&mut self) -> Option<Shape> {
        self.known(&["d", "h", "chamfer", "chamfer_top", "chamfer_bottom"]);
        let (d, h) = (self.size("d", "10"), self.extent("h"));
        let both = self.has("chamfer").then(|| self.edge("chamfer"));
        let [bottom, top] = ["chamfer_bottom", "chamfer_top"].map(|key| {
            let own = self.has(key).then(|| self.edge(key));
            if own.is_some() && both.is_some() {
                self.no_end(key, "`chamfer` breaks both ends already");
            }
            own.or_else(|| both.clone())
        });
        let (d, h) = (d?, h?);
        if bottom.is_none() && top.is_none() {
            return Some(Shape::Cylinder { d, h });
        }
        let zero = || Some(Expr::Const(0.0));
        let (bottom, top) = (bottom.unwrap_or_else(zero)?, top.unwrap_or_else(zero)?);
        let Extent::Length(h) = h else {
            let key = ["chamfer", "chamfer_bottom", "chamfer_top"].into_iter().find(|key| self.has(key))?;
            self.no_end(key, "a cylinder that goes through has no ends to break");
            return None;
        };
        self.room_for_chamfers(&d, &h, &bottom, &top).then(|| self.turned_cylinder(&d, h, bottom, top))
    }

    fn room_for_chamfers(&mut self, d: &Expr, h: &Expr, bottom: &Expr, top: &Expr) -> bool {
        let side = minus(minus(h.clone(), bottom.clone()), top.clone());
        let wide = |end: &Expr| self.context.void || self.resolver.lowest(&minus(half(d), end.clone())) > 0.0;
        if self.resolver.lowest(&side) > 0.0 && wide(bottom) && wide(top) {
            return true;
        }
        let message = "the chamfers leave nothing of the cylinder's side or end at some limit";
        let key = ["chamfer", "chamfer_bottom", "chamfer_top"].into_iter().find(|key| self.has(key));
        let span = self.span_of(key.unwrap_or("d"));
        self.resolver.report(
            Diagnostic::error("E0307", span, message)
                .label("too large")
                .help("a chamfer must be less than the radius, and two less than the height"),
        );
        false
    }

    /// The outline goes round from the axis at z = 0 and back to it at z = h.
    fn turned_cylinder(&self, d: &Expr, h: Expr, bottom: Expr, top: Expr) -> Shape {
        let radius = half(d);
        let end = |by: &Expr| match self.context.void {
            true => plus(radius.clone(), by.clone()),
            false => minus(radius.clone(), by.clone()),
        };
        let mut sides = vec![side("bottom", [end(&bottom), Expr::Const(0.0)])];
        if bottom != Expr::Const(0.0) {
            sides.push(side("chamfer_bottom", [radius.clone(), bottom]));
        }
        sides.push(side("side", [radius.clone(), minus(h.clone(), top.clone())]));
        if top != Expr::Const(0.0) {
            sides.push(side("chamfer_top", [end(&top), h.clone()]));
        }
        sides.push(side("top", [Expr::Const(0.0), h]));
        let start = [Expr::Const(0.0), Expr::Const(0.0)];
        Shape::Revolve { outline: Outline { start, start_corner: Corner::Sharp, sides } }
    }

    /// Reports a hole that would add material.
    fn takes_material(&mut self) -> Option<()> {
        if self.context.void {
            return Some(());
        }
        let word = &self.fields.owner;
        let message = format!("a {word} takes material away, and here it would add some");
        let help = match self.context.in_cut {
            true => "in a group that is cut, holes are added",
            false => "write `cut` in place of `add` or `keep`",
        };
        self.resolver.report(Diagnostic::error("E0211", self.fields.span, message).label("not cut").help(help));
        None
    }

    /// A cylinder from its depth up to `clear` mm above the face.
    fn bore(&self, d: Expr, h: Extent, clear: f64) -> Feature {
        let (bottom, h) = match h {
            Extent::Length(h) => (minus(Expr::Const(0.0), h.clone()), Extent::Length(plus(h, Expr::Const(clear)))),
            Extent::Through => (Expr::Const(0.0), Extent::Through),
        };
        self.member("bore", Shape::Cylinder { d, h }, bottom)
    }

    /// How far a hole with this mouth clears above its face (mm).
    fn clearance(&self, d: &Expr) -> f64 {
        CLEARANCE.min(d.eval(&self.resolver.nominal) / 2.0)
    }

    /// A feature of the group that stands at `z` on its axis.
    fn member(&self, name: &str, shape: Shape, z: Expr) -> Feature {
        let mut pose = PoseExpr::identity();
        pose.t[2] = z;
        let copies = vec![FeatureCopy { shape, pose }];
        Feature { name: name.to_string(), op: Op::Add, patterned: false, copies, span: self.context.span }
    }

    /// The whole angle of a cone (rad).
    fn angle(&mut self, key: &str) -> f64 {
        let angle = self.resolver.exact_or(self.fields, key, Quantity::Angle, RIGHT_ANGLE, [f64::MIN, f64::MAX]);
        let [low, high] = ANGLES;
        if (low..=high).contains(&angle.to_degrees()) {
            return angle;
        }
        let message = format!("`{key}` is {low} to {high} degrees, this is {}", trim(angle.to_degrees()));
        let span = self.span_of(key);
        self.resolver.report(Diagnostic::error("E0211", span, message).label("out of range"));
        RIGHT_ANGLE
    }

    fn no_end(&mut self, key: &str, message: &str) {
        let span = self.span_of(key);
        self.resolver
            .report(Diagnostic::error("E0211", span, message).label("not here").help(format!("remove `{key}`")));
    }
}

fn side(name: &str, to: [Expr; 2]) -> OutlineSide {
    OutlineSide { name: name.to_string(), to, path: OutlinePath::Line, corner: Corner::Sharp }
}
