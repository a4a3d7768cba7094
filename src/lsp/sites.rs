//! Where numbers stand in the tree, and what stands in which block.

use super::words::{Role, Takes, owner};
use crate::syntax::ast::{Args, Body, Dim, Line, Name, Point, Shape, Stmt, Value};

/// A dimension as written, with what its place takes; `None` where any dimension may stand.
pub struct Dims<'a> {
    pub dim: &'a Dim,
    pub takes: Option<Takes>,
}

/// The lines in the braces of a statement, with the name of the block they stand in.
pub fn body_of(stmt: &Stmt) -> Option<(&'static str, &Body)> {
    Some(match stmt {
        Stmt::Material { body, .. } => ("material", body),
        Stmt::Part { body, .. } | Stmt::Family { body, .. } => ("part", body),
        Stmt::Table { body, .. } => ("table", body),
        Stmt::Outline { body, .. } => ("outline", body),
        Stmt::Assembly { body, .. } => ("assembly", body),
        Stmt::Station { body, .. } => ("station", body),
        Stmt::Camera { body, .. } => ("camera", body),
        Stmt::Floor(body) => ("floor", body),
        Stmt::Vary(body) => ("vary", body),
        Stmt::Inspect { body, .. } => ("inspect", body),
        Stmt::Train(body) => ("train", body),
        Stmt::Place(place) => ("place", place.body.as_ref()?),
        Stmt::Feature(feature) => match &feature.shape {
            Shape::Group { body, .. } => ("part", body),
            Shape::Call(_) => return None,
        },
        _ => return None,
    })
}

/// Shows every statement, those in braces after the one that has them, with the block it stands in.
pub fn each_line<'a>(lines: &'a [Line], block: &'static str, visit: &mut dyn FnMut(&'a Line, &'static str)) {
    for line in lines {
        visit(line, block);
        if let Some((inner, body)) = body_of(&line.stmt) {
            each_line(&body.lines, inner, visit);
        }
    }
}

/// The dimensions of a statement that stands in `block`, without those of the statements in its braces.
pub fn dims_of<'a>(stmt: &'a Stmt, block: &str, out: &mut Vec<Dims<'a>>) {
    let any = |dim| Dims { dim, takes: None };
    match stmt {
        Stmt::Let { dim, .. } => out.push(any(dim)),
        Stmt::Feature(feature) => {
            if let Shape::Call(call) = &feature.shape {
                arguments(&call.name, &call.args, Role::Shape, out);
            }
            [&feature.at, &feature.turn].into_iter().flatten().for_each(|p| point(p, None, out));
            feature.on.iter().for_each(|on| arguments(&on.name, &on.args, Role::Pattern, out));
        }
        Stmt::Start { at, corner } => {
            point(at, None, out);
            out.extend(corner.iter().map(|c| any(&c.size)));
        }
        Stmt::Side(side) => {
            point(&side.to, None, out);
            out.extend(side.arc.iter().map(|arc| any(&arc.radius)));
            out.extend(side.corner.iter().map(|c| any(&c.size)));
        }
        Stmt::Measure(measure) => out.extend(measure.within.iter().map(any)),
        Stmt::Row { cells, .. } => out.extend(cells.iter().map(any)),
        Stmt::Member { call, .. } => call.args.list.iter().for_each(|arg| {
            let material = (arg.key.text == "material").then_some(Takes::Material);
            value(&arg.value, material, out);
        }),
        Stmt::Light { call, .. } => arguments(&call.name, &call.args, Role::Light, out),
        Stmt::Watch { args: Some(args), .. } => {
            args.list.iter().for_each(|arg| value(&arg.value, Some(Takes::Whole), out));
        }
        Stmt::Field { key, value: v } => {
            let takes = owner(block, &[Role::Block]).and_then(|o| o.argument(&key.text)).map(|a| a.takes);
            value(v, takes, out);
        }
        _ => {}
    }
}

fn arguments<'a>(name: &Name, args: &'a Args, role: Role, out: &mut Vec<Dims<'a>>) {
    let owner = owner(&name.text, &[role]);
    for arg in &args.list {
        value(&arg.value, owner.and_then(|o| o.argument(&arg.key.text)).map(|a| a.takes), out);
    }
}

fn value<'a>(value: &'a Value, takes: Option<Takes>, out: &mut Vec<Dims<'a>>) {
    match value {
        Value::Dim(dim) => out.push(Dims { dim, takes }),
        Value::Point(p) => point(p, takes, out),
        Value::Text(_) | Value::Extent { .. } => {}
    }
}

fn point<'a>(point: &'a Point, takes: Option<Takes>, out: &mut Vec<Dims<'a>>) {
    out.extend(point.dims.iter().map(|dim| Dims { dim, takes }));
}
