//! The one canonical layout.
//!
//! In: the text of a spec. Out: the same spec as everybody would have laid it out. Comments stay, numbers keep their
//! digits, and formatting twice changes nothing. A text with syntax errors is left alone.

use super::ast::*;
use super::table;
use crate::diag::Diagnostic;

/// Longer lines have their arguments one per line.
const WIDTH: usize = 120;
const INDENT: &str = "    ";

/// `text` in canonical layout, or its syntax errors.
pub fn format(text: &str) -> Result<String, Vec<Diagnostic>> {
    let (file, diagnostics) = super::parse(text, 0);
    if !diagnostics.is_empty() {
        return Err(diagnostics);
    }
    let mut out = String::new();
    lines(&mut out, &file.lines, 0);
    gaps(&mut out, &file.end, 0, file.lines.is_empty());
    while out.ends_with("\n\n") {
        out.pop();
    }
    Ok(out)
}

fn lines(out: &mut String, lines: &[Line], depth: usize) {
    let widths = run_widths(lines);
    let columns = table::widths(lines);
    for (i, line) in lines.iter().enumerate() {
        gaps(out, &line.before, depth, i == 0);
        let after_block = i > 0 && depth == 0 && (body(&line.stmt).is_some() || body(&lines[i - 1].stmt).is_some());
        if after_block && line.before.is_empty() {
            out.push('\n');
        }
        match table::row(line, &columns) {
            Some(row) => indented(out, depth, &row),
            None => statement(out, line, depth, widths[i]),
        }
    }
}

/// Blank lines collapse to one, and none stands at the edge of a block.
fn gaps(out: &mut String, gaps: &[Gap], depth: usize, first: bool) {
    let mut at_edge = first;
    for gap in gaps {
        match gap {
            Gap::Comment(text) => {
                indented(out, depth, text);
                at_edge = false;
            }
            Gap::Blank if at_edge || out.ends_with("\n\n") => {}
            Gap::Blank => out.push('\n'),
        }
    }
}

fn statement(out: &mut String, line: &Line, depth: usize, width: usize) {
    let room = WIDTH.saturating_sub(depth * INDENT.len());
    let mut text = head_and_tail(&line.stmt, width, Layout::Flat);
    if text.chars().count() > room || text.contains('\n') {
        text = head_and_tail(&line.stmt, width, Layout::Broken);
    }
    let text = text.replace('\n', &format!("\n{}", INDENT.repeat(depth)));
    let after = line.after.as_ref().map_or(String::new(), |note| format!("  {note}"));
    let Some(body) = body(&line.stmt) else { return indented(out, depth, &format!("{text}{after}")) };
    if body.lines.is_empty() && body.end.iter().all(|g| *g == Gap::Blank) && body.open.is_none() {
        return indented(out, depth, &format!("{text} {{}}{after}"));
    }
    let open = body.open.as_ref().map_or(String::new(), |note| format!("  {note}"));
    indented(out, depth, &format!("{text} {{{open}"));
    lines(out, &body.lines, depth + 1);
    gaps(out, &body.end, depth + 1, body.lines.is_empty());
    while out.ends_with("\n\n") {
        out.pop();
    }
    indented(out, depth, &format!("}}{after}"));
}

fn indented(out: &mut String, depth: usize, text: &str) {
    out.push_str(&INDENT.repeat(depth));
    out.push_str(text);
    out.push('\n');
}

/// The width to which the names before `=` are padded, for every line: that of the longest in its run of neighbours.
fn run_widths(lines: &[Line]) -> Vec<usize> {
    let width = |line: &Line| head(&line.stmt).filter(|_| body(&line.stmt).is_none()).map(|head| head.chars().count());
    let own: Vec<Option<usize>> = lines.iter().map(width).collect();
    let mut widths = vec![0; lines.len()];
    let mut start = 0;
    while start < lines.len() {
        let joins = |i: &usize| own[*i].is_some() && lines[*i].before.is_empty();
        let end = if own[start].is_some() { (start + 1..lines.len()).find(|i| !joins(i)) } else { Some(start + 1) };
        let end = end.unwrap_or(lines.len());
        let longest = own[start..end].iter().flatten().copied().max().unwrap_or(0);
        widths[start..end].fill(longest);
        start = end;
    }
    widths
}

/// What stands before the `=`.
fn head(stmt: &Stmt) -> Option<String> {
    Some(match stmt {
        Stmt::Let { name, .. } => format!("let {}", name.text),
        Stmt::Feature(f) => format!("{} {}", f.op.text, f.name.text),
        Stmt::Light { name, .. } => format!("light {}", name.text),
        Stmt::Measure(m) => format!("measure {}", m.name.text),
        Stmt::Field { key, .. } => key.text.clone(),
        _ => return None,
    })
}

fn body(stmt: &Stmt) -> Option<&Body> {
    match stmt {
        Stmt::Material { body, .. }
        | Stmt::Part { body, .. }
        | Stmt::Family { body, .. }
        | Stmt::Table { body, .. }
        | Stmt::Outline { body, .. }
        | Stmt::Assembly { body, .. }
        | Stmt::Station { body, .. }
        | Stmt::Camera { body, .. }
        | Stmt::Floor(body)
        | Stmt::Vary(body)
        | Stmt::Inspect { body, .. }
        | Stmt::Train(body) => Some(body),
        Stmt::Place(place) => place.body.as_ref(),
        Stmt::Feature(feature) => match &feature.shape {
            Shape::Group { body, .. } => Some(body),
            Shape::Call(_) => None,
        },
        _ => None,
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Layout {
    Flat,
    /// Arguments one per line.
    Broken,
}

/// The statement without its body, `=` padded to `width`.
fn head_and_tail(stmt: &Stmt, width: usize, layout: Layout) -> String {
    if let Some(head) = head(stmt) {
        return format!("{head:width$} = {}", tail(stmt, layout));
    }
    let named = |word: &str, name: &Name| format!("{word} {}", name.text);
    let optional = |word: &str, name: &Option<Name>| name.as_ref().map_or(word.to_string(), |n| named(word, n));
    match stmt {
        Stmt::Version(n) => format!("gonogo {n}"),
        Stmt::Units(length, angle) => format!("units {} {}", length.text, angle.text),
        Stmt::Tolerances(class) => named("tolerances", class),
        Stmt::Use(file) => format!("use \"{}\"", file.text),
        Stmt::Material { name, .. } => named("material", name),
        Stmt::Part { name, .. } => named("part", name),
        Stmt::Outline { name, .. } => named("outline", name),
        Stmt::Start { at, corner: c } => format!("from {}{}", point(at), corner(c)),
        Stmt::Side(s) => side(s),
        Stmt::Assembly { name, .. } => named("assembly", name),
        Stmt::Station { name, .. } => named("station", name),
        Stmt::Root { name, part } => {
            format!("{}{}", named("root", name), part.as_ref().map_or(String::new(), |p| format!(" = {}", p.text)))
        }
        Stmt::Place(p) => place(p),
        Stmt::Camera { name, mode, .. } => {
            [name, mode].into_iter().flatten().fold("camera".into(), |c, n| named(&c, n))
        }
        Stmt::Floor(_) => "floor".to_string(),
        Stmt::Vary(_) => "vary".to_string(),
        Stmt::Inspect { name, .. } => optional("inspect", name),
        Stmt::Watch { path, args: None } => format!("watch {}", path_text(path)),
        Stmt::Watch { path, args: Some(list) } => format!("watch {} {}", path_text(path), args(list, layout)),
        Stmt::Ignore(path) => format!("ignore {}", path_text(path)),
        Stmt::Train(_) => "train".to_string(),
        Stmt::Family { name, params, .. } => format!("part {}{}", name.text, table::names(params)),
        Stmt::Table { name, columns, .. } => format!("table {} {}", name.text, table::names(columns)),
        Stmt::Member { name, call: c } => format!("part {} = {}", name.text, call(c, layout)),
        // Rows are laid out with those of their table.
        Stmt::Row { .. } => String::new(),
        Stmt::Let { .. } | Stmt::Feature(_) | Stmt::Light { .. } | Stmt::Measure(_) | Stmt::Field { .. } => {
            String::new()
        }
    }
}

fn tail(stmt: &Stmt, layout: Layout) -> String {
    match stmt {
        Stmt::Let { dim: d, .. } => dim(d),
        Stmt::Light { call: c, .. } => call(c, layout),
        Stmt::Measure(m) => measure(m),
        Stmt::Field { value: v, .. } => value(v),
        Stmt::Feature(f) => feature(f, layout),
        _ => String::new(),
    }
}

fn feature(f: &Feature, layout: Layout) -> String {
    let shape = match &f.shape {
        Shape::Call(c) => call(c, layout),
        Shape::Group { word, .. } => word.text.clone(),
    };
    let mut text = format!("{}{shape}", count(&f.count));
    if let Some(at) = &f.at {
        text += &format!(" at {}", point(at));
    }
    if let Some(turn) = &f.turn {
        text += &format!(" turn {}", point(turn));
    }
    if let Some(on) = &f.on {
        // The shape's arguments are broken first; the pattern's only if they carry comments.
        text += &format!(" on {}", call(on, Layout::Flat));
    }
    text
}

fn side(s: &Side) -> String {
    let word = if s.arc.is_some() { "arc" } else { "line" };
    let name = s.name.as_ref().map_or(String::new(), |n| format!(" {}", n.text));
    let bend = s.arc.as_ref().map_or(String::new(), |arc| {
        let long = if arc.long { " long" } else { "" };
        format!(" radius {} {}{long}", dim(&arc.radius), arc.hand.text)
    });
    format!("{word}{name} to {}{bend}{}", point(&s.to), corner(&s.corner))
}

fn corner(c: &Option<Corner>) -> String {
    c.as_ref().map_or(String::new(), |c| {
        let word = if c.kind == CornerKind::Round { "round" } else { "chamfer" };
        format!(" {word} {}", dim(&c.size))
    })
}

fn place(p: &Place) -> String {
    let part = p.part.as_ref().map_or(String::new(), |part| format!(" = {}{}", count(&p.count), part.text));
    format!("place {}{part} on {}", p.name.text, path_text(&p.on))
}

fn measure(m: &Measure) -> String {
    let face = |f: &Face| format!("{}.{}", segment_text(&f.component), f.face.text);
    let within = m.within.as_ref().map_or(String::new(), |d| format!(" within {}", dim(d)));
    format!("from {} to {}{within}", face(&m.from), face(&m.to))
}

fn count(count: &Option<Count>) -> String {
    count.as_ref().map_or(String::new(), |c| format!("{}x ", c.value))
}

fn call(c: &Call, layout: Layout) -> String {
    format!("{}{}", c.name.text, args(&c.args, layout))
}

fn args(list: &Args, layout: Layout) -> String {
    let arg = |a: &Arg| format!("{} = {}", a.key.text, value(&a.value));
    let commented = !list.end.is_empty() || list.list.iter().any(|a| !a.before.is_empty() || a.after.is_some());
    if !commented && (layout == Layout::Flat || list.list.len() < 2) {
        return format!("({})", list.list.iter().map(arg).collect::<Vec<_>>().join(", "));
    }
    let mut text = "(\n".to_string();
    for a in &list.list {
        a.before.iter().for_each(|note| text += &format!("{INDENT}{note}\n"));
        let after = a.after.as_ref().map_or(String::new(), |note| format!("  {note}"));
        text += &format!("{INDENT}{},{after}\n", arg(a));
    }
    list.end.iter().for_each(|note| text += &format!("{INDENT}{note}\n"));
    text + ")"
}

fn value(v: &Value) -> String {
    match v {
        Value::Text(text) => format!("\"{}\"", text.text),
        Value::Point(p) => point(p),
        Value::Extent { width, height, unit, .. } => format!("{width} x {height}{}", unit_text(unit)),
        Value::Dim(d) => dim(d),
    }
}

fn point(p: &Point) -> String {
    format!("({}){}", p.dims.iter().map(dim).collect::<Vec<_>>().join(", "), unit_text(&p.unit))
}

pub(super) fn dim(d: &Dim) -> String {
    let size = match &d.size {
        Size::Quantity(q) => quantity(q),
        Size::Sum(s) => format!("({})", sum(s)),
        Size::Path(p) => path_text(p),
        Size::States { states, unit } => {
            let states: Vec<String> = states.iter().map(|(name, q)| format!("{} {}", name.text, quantity(q))).collect();
            format!("{{ {} }}{}", states.join(", "), unit_text(unit))
        }
    };
    let tolerance = d.tolerance.as_ref().map_or(String::new(), tolerance);
    format!("{size}{tolerance}{}", if d.each { " each" } else { "" })
}

fn tolerance(t: &Tolerance) -> String {
    match t {
        Tolerance::PlusMinus(q) => format!(" ±{}", quantity(q)),
        Tolerance::Deviations { upper, lower, unit } => format!(" {}/{}{}", upper.text, lower.text, unit_text(unit)),
        Tolerance::Limits(q) => format!(" .. {}", quantity(q)),
        Tolerance::Fit(class) => format!(" {}", class.text),
        Tolerance::Basic => " basic".to_string(),
    }
}

fn sum(s: &Sum) -> String {
    match s {
        Sum::Quantity(q) => quantity(q),
        Sum::Path(p) => path_text(p),
        Sum::Negative(a) => format!("-{}", sum(a)),
        Sum::Binary(sign, a, b) => format!("{} {sign} {}", sum(a), sum(b)),
        Sum::Group(a) => format!("({})", sum(a)),
    }
}

fn quantity(q: &Quantity) -> String {
    format!("{}{}", q.number.text, unit_text(&q.unit))
}

fn unit_text(unit: &Option<Name>) -> String {
    unit.as_ref().map_or(String::new(), |u| format!(" {}", u.text))
}

fn path_text(p: &Path) -> String {
    p.segments.iter().map(segment_text).collect::<Vec<_>>().join(".")
}

fn segment_text(s: &Segment) -> String {
    let index = |i: &Index| i.last.map_or(format!("[{}]", i.first), |last| format!("[{}..{last}]", i.first));
    format!("{}{}", s.name.text, s.index.as_ref().map_or(String::new(), index))
}
