//! The pictures: sound files of the size of a page, and in the documentation what the code draws today.
//!
//! `GONOGO_BLESS=1 cargo test --test drawing` rewrites those of the documentation (refused where CI is set); look at them
//! before committing.

#![cfg(feature = "compile")]

use gonogo::artifacts::Artifact;
use gonogo::drawing::svg::text_width;
use gonogo::{Options, compile};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Files of the documentation, and what they are copies of.
const PRINTED: [(&str, &str); 6] = [
    ("liaison.svg", "liaison.svg"),
    ("error_tree_hd_pin.svg", "error_trees/hd_pin.svg"),
    ("error_tree_wheel_a2.svg", "error_trees/wheel_a2.svg"),
    ("object_tree.svg", "object_tree.svg"),
    ("exploded.svg", "exploded.svg"),
    ("assembled.svg", "assembled.svg"),
];
/// A picture of the documentation is no larger (bytes).
const LARGEST: usize = 60 << 10;
/// Coordinates this close are equal: what another processor's rounding may change (px).
const EQUAL: f64 = 0.1;

#[test]
fn the_documentation_shows_what_the_code_draws() {
    let files = wheel();
    let folder = root().join("docs/src/pattern_wheel");
    let bless = std::env::var_os("GONOGO_BLESS").is_some_and(|v| v == "1");
    let in_ci = std::env::var_os("CI").is_some_and(|v| !v.is_empty());
    for (name, source) in PRINTED {
        let drawn = &files[source];
        assert!(drawn.len() <= LARGEST, "{name} has {} bytes", drawn.len());
        let path = folder.join(name);
        if bless && !in_ci {
            fs::write(&path, drawn).unwrap();
        }
        let printed = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        if let Some(difference) = difference(&printed, drawn) {
            panic!("{} shows another {source}: {difference}; bless it after a look", path.display());
        }
    }
}

#[test]
fn pictures_are_well_formed_and_stand_alone() {
    for (spec, files) in both() {
        for (name, text) in files.iter().filter(|(name, _)| name.ends_with(".svg")) {
            let tags = tags(text).unwrap_or_else(|fault| panic!("{spec}, {name}: {fault}"));
            let used: BTreeSet<&str> = tags.iter().map(|t| t.name.as_str()).collect();
            let known = BTreeSet::from(["svg", "title", "rect", "g", "path", "circle", "text"]);
            assert!(used.is_subset(&known), "{name}: {used:?}");
            let refers =
                tags.iter().flat_map(|t| &t.attributes).find(|(key, _)| key.contains("href") || key.starts_with("on"));
            assert_eq!(refers, None, "{name}");
            assert_eq!(text.matches("http").count(), 1, "{name} names more than its name space");
        }
    }
}

#[test]
fn nothing_lies_outside_the_view_box() {
    for (spec, files) in both() {
        for (name, text) in files.iter().filter(|(name, _)| name.ends_with(".svg")) {
            let tags = tags(text).unwrap();
            let view: Vec<f64> = numbers(tags[0].get("viewBox")).collect();
            let points: Vec<[f64; 2]> = tags.iter().flat_map(extent).collect();
            assert!(points.len() > 20, "{name}");
            for [x, y] in points {
                let inside = x >= view[0] && x <= view[0] + view[2] && y >= view[1] && y <= view[1] + view[3];
                assert!(inside, "{spec}, {name}: ({x}, {y}) outside of {view:?}");
            }
        }
    }
}

#[test]
fn texts_do_not_overlap() {
    for (name, text) in wheel().iter().filter(|(name, _)| name.ends_with(".svg")) {
        let boxes: Vec<[f64; 4]> = tags(text).unwrap().iter().filter(|t| t.name == "text").map(text_box).collect();
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[..i] {
                let apart = a[0] >= b[2] || b[0] >= a[2] || a[1] >= b[3] || b[1] >= a[3];
                assert!(apart, "{name}: {a:?} and {b:?}");
            }
        }
    }
}

#[test]
fn any_number_of_threads_draws_the_same() {
    let drawn = |threads: usize| {
        let pool = rayon_pool(threads);
        pool.install(|| pictures(PLATE))
    };
    assert!(drawn(1) == drawn(3));
}

/// Section III: every surface and every contact of the diagram is in the picture, in the DOT and in the JSON.
#[test]
fn no_surface_and_no_contact_is_lost() {
    let files = wheel();
    let data: serde_json::Value = serde_json::from_str(&files["liaison.json"]).unwrap();
    let pairs = data["liaisons"].as_array().unwrap();
    let contacts: usize = pairs.iter().map(|p| p["contacts"].as_array().unwrap().len()).sum();
    let mut surfaces = BTreeSet::new();
    for (pair, contact) in pairs.iter().flat_map(|p| p["contacts"].as_array().unwrap().iter().map(move |c| (p, c))) {
        surfaces.insert((pair["a"].to_string(), contact["faces"][0].to_string()));
        surfaces.insert((pair["b"].to_string(), contact["faces"][1].to_string()));
    }
    assert_eq!((contacts, surfaces.len()), (27, 43));
    let svg = tags(&files["liaison.svg"]).unwrap();
    let legend_dots = 2;
    assert_eq!(svg.iter().filter(|t| t.name == "circle").count(), surfaces.len() + legend_dots);
    let wires = svg.iter().filter(|t| t.name == "title").count() - 1;
    assert_eq!(wires, contacts);
    let dot = &files["liaison.dot"];
    assert_eq!(dot.matches("subgraph cluster_").count(), 10);
    assert_eq!((dot.matches(" -- ").count(), dot.matches("shape=").count()), (contacts, surfaces.len()));
}

/// Twelve pegs of one part in twelve holes of the other: one row each, one wire with its count.
#[test]
fn many_alike_surfaces_share_a_row() {
    let files = drawn("pegs.gng", |name| match name {
        "pegs.gng" => Ok(PEGS.into()),
        _ => Err(std::io::ErrorKind::NotFound.into()),
    });
    let svg = &files["liaison.svg"];
    for text in [">hole[1…12].side<", ">peg[1…12].side<", ">12×<"] {
        assert!(svg.contains(text), "{text}: {svg}");
    }
    assert!(svg.contains("2 components, 26 mating surfaces, 13 contacts"), "{svg}");
}

const PEGS: &str = "gonogo 1
units mm deg
tolerances exact

material steel {
    metal       = steel
    reflectance = 0.5
    roughness   = 0.2
}

part base {
    material = steel

    add slab = cylinder(d = 60, h = 5)
    add peg  = 12x cylinder(d = 4 -0.004/-0.012, h = 9) on circle(r = 22, from = 0 deg)
}

part cover {
    material = steel

    add slab = cylinder(d = 60, h = 3)
    cut hole = 12x cylinder(d = 4 +0.012/0, h = through) on circle(r = 22, from = 0 deg)
}

assembly pegs {
    root base

    place cover on base {
        z = 5
    }
}

station bench {
    camera fixed {
        image     = 96 x 72 px
        focal     = 16
        pitch     = 0.05
        aim       = (0, 0, 4)
        distance  = 250
        elevation = 65
        azimuth   = -90
    }

    light room = room(patches = 1)
}

inspect pegs {
    false_reject = 1 %
}

train {
    images = 4
    seed   = 7
}
";

/// Fig. 9: the tree of the high density pin, level by level.
#[test]
fn the_error_tree_as_data_is_that_of_fig_9() {
    let files = wheel();
    let trees: serde_json::Value = serde_json::from_str(&files["error_trees.json"]).unwrap();
    let tree = trees.as_array().unwrap().iter().find(|t| t["component"] == "hd_pin").unwrap();
    let at = |level: u64| -> Vec<&str> {
        let nodes = tree["nodes"].as_array().unwrap().iter().filter(|n| n["level"] == level);
        nodes.map(|n| n["component"].as_str().unwrap()).collect()
    };
    assert_eq!(at(1), ["wheel_a1", "wheel_a2"]);
    assert_eq!(at(2), ["alignment_pin[1]", "alignment_pin[2]", "alignment_pin[3]", "unlatch_pin"]);
    assert_eq!(at(3), ["gear", "locking_ring"]);
    let first = &tree["nodes"][1];
    assert_eq!((&first["parent"], &first["through"][0]["to"]), (&0.into(), &"hd_hole.side".into()));
    let dashed = tags(&files["error_trees/hd_pin.svg"]).unwrap();
    let dashed = dashed.iter().filter(|t| t.attributes.iter().any(|(k, _)| k == "stroke-dasharray")).count();
    let in_legend = 1;
    assert_eq!(dashed, tree["loops"].as_array().unwrap().len() + in_legend);
}

#[test]
fn coordinates_are_compared_by_value() {
    assert_eq!(difference("<a x=\"1.00\"/>", "<a x=\"1.05\"/>"), None);
    assert!(difference("<a x=\"1.0\"/>", "<a x=\"1.5\"/>").is_some());
    assert!(difference("<a x=\"1\"/>", "<b x=\"1\"/>").is_some());
}

#[test]
fn the_checker_of_tags_sees_faults() {
    assert!(tags("<svg><g></g></svg>").is_ok());
    for broken in ["<svg><g></svg></g>", "<svg>", "<svg a=1></svg>", "<svg>a & b</svg>", "<svg a=\"<\"/>", "<g/><g/>"] {
        assert!(tags(broken).is_err(), "{broken}");
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// Everything that is drawn of a spec, by file.
type Pictures = BTreeMap<String, String>;

const WHEEL: &str = "specs/pattern_wheel.gng";
const PLATE: &str = "tests/data/two_pins.gng";

/// The pattern wheel's pictures, drawn once for all tests.
fn wheel() -> &'static Pictures {
    static DRAWN: OnceLock<Pictures> = OnceLock::new();
    DRAWN.get_or_init(|| pictures(WHEEL))
}

fn both() -> [(&'static str, Pictures); 2] {
    [(WHEEL, wheel().clone()), (PLATE, pictures(PLATE))]
}

fn pictures(spec: &str) -> Pictures {
    drawn(spec, |name| fs::read_to_string(root().join(Path::new(name))))
}

fn drawn(spec: &str, read: impl Fn(&str) -> std::io::Result<String>) -> Pictures {
    let wanted = [Artifact::Liaison, Artifact::ErrorTrees, Artifact::ObjectTree, Artifact::Exploded];
    let options = Options { wanted: BTreeSet::from(wanted), ..Options::default() };
    let compiled = compile(spec, &read, &options, &|_| {});
    assert!(!compiled.diagnostics.iter().any(|d| d.is_error()), "{:#?}", compiled.diagnostics);
    compiled.artifacts.into_iter().map(|(name, bytes)| (name, String::from_utf8(bytes).unwrap())).collect()
}

/// The first piece that differs: a number by more than [`EQUAL`], or anything else.
fn difference(a: &str, b: &str) -> Option<String> {
    let (left, right) = (pieces(a), pieces(b));
    let same = |(l, r): &(&str, &str)| match (l.parse::<f64>(), r.parse::<f64>()) {
        (Ok(l), Ok(r)) => (l - r).abs() <= EQUAL,
        _ => l == r,
    };
    let differs = left.iter().copied().zip(right.iter().copied()).find(|pair| !same(pair));
    match differs {
        Some((l, r)) => Some(format!("{l:?} became {r:?}")),
        None => (left.len() != right.len()).then(|| "one of them goes on".into()),
    }
}

/// Numbers, and what is between them.
fn pieces(text: &str) -> Vec<&str> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let kind = is_number(first);
        let mut end = rest.find(|c| is_number(c) != kind).unwrap_or(rest.len());
        if kind {
            // Numbers of a path may follow each other with only a sign between them.
            end = rest[1..end].find('-').map_or(end, |at| at + 1);
        }
        pieces.push(&rest[..end]);
        rest = &rest[end..];
    }
    pieces
}

/// An opening or empty tag, and the text right behind it.
#[derive(Debug)]
struct Tag {
    name: String,
    attributes: Vec<(String, String)>,
    text: String,
}

impl Tag {
    fn get(&self, key: &str) -> &str {
        let found = self.attributes.iter().find(|(k, _)| k == key);
        found.map(|(_, value)| value.as_str()).unwrap_or_default()
    }

    fn number(&self, key: &str) -> f64 {
        self.get(key).parse().unwrap_or_else(|_| panic!("{key} of {self:?}"))
    }
}

/// The tags of a document with one root, or what is wrong with it: tags that do not close or cross, attributes without
/// quotes, characters that have to be escaped.
fn tags(text: &str) -> Result<Vec<Tag>, String> {
    let mut open: Vec<String> = Vec::new();
    let mut tags: Vec<Tag> = Vec::new();
    for part in text.split('<').skip(1) {
        let (inside, after) = part.split_once('>').ok_or_else(|| format!("`<{part}` does not end"))?;
        is_escaped(after)?;
        if let Some(name) = inside.strip_prefix('/') {
            let opened = open.pop();
            if opened.as_deref() != Some(name) {
                return Err(format!("`</{name}>` closes {opened:?}"));
            }
            continue;
        }
        if open.is_empty() && !tags.is_empty() {
            return Err("a second root".into());
        }
        let (inside, empty) = inside.strip_suffix('/').map_or((inside, false), |i| (i, true));
        let (name, rest) = inside.split_once(' ').unwrap_or((inside, ""));
        tags.push(Tag { name: name.into(), attributes: attributes(rest)?, text: after.trim().into() });
        if !empty {
            open.push(name.into());
        }
    }
    if open.is_empty() { Ok(tags) } else { Err(format!("{open:?} stay open")) }
}

fn attributes(mut rest: &str) -> Result<Vec<(String, String)>, String> {
    let mut found = Vec::new();
    while !rest.trim().is_empty() {
        let (key, value) = rest.split_once("=\"").ok_or_else(|| format!("`{rest}` is no attribute"))?;
        let (value, after) = value.split_once('"').ok_or_else(|| format!("`{value}` does not end"))?;
        is_escaped(value)?;
        found.push((key.trim().into(), value.into()));
        rest = after;
    }
    Ok(found)
}

fn is_escaped(text: &str) -> Result<(), String> {
    let entities = ["&amp;", "&lt;", "&gt;", "&quot;"];
    let naked = text.match_indices('&').find(|(at, _)| !entities.iter().any(|e| text[*at..].starts_with(e)));
    let controls = text.chars().any(|c| c.is_control() && c != '\n');
    if naked.is_some() || controls { Err(format!("`{text}` is not escaped")) } else { Ok(()) }
}

fn numbers(list: &str) -> impl Iterator<Item = f64> {
    list.split(' ').map(move |n| n.parse().unwrap_or_else(|_| panic!("{list}")))
}

/// Points that a tag reaches, control points included.
fn extent(tag: &Tag) -> Vec<[f64; 2]> {
    match tag.name.as_str() {
        "rect" => {
            let [x, y, w, h] = ["x", "y", "width", "height"].map(|k| tag.number(k));
            vec![[x, y], [x + w, y + h]]
        }
        "circle" => {
            let [x, y, r] = ["cx", "cy", "r"].map(|k| tag.number(k));
            vec![[x - r, y - r], [x + r, y + r]]
        }
        "text" => {
            let [left, top, right, bottom] = text_box(tag);
            vec![[left, top], [right, bottom]]
        }
        "path" => course(tag.get("d")),
        _ => Vec::new(),
    }
}

/// Left, top, right and bottom of a text.
fn text_box(tag: &Tag) -> [f64; 4] {
    let [x, y, size] = ["x", "y", "font-size"].map(|k| tag.number(k));
    let width = text_width(&tag.text, size);
    let left = match tag.get("text-anchor") {
        "middle" => x - width / 2.0,
        "end" => x - width,
        _ => x,
    };
    [left, y - 0.75 * size, left + width, y + 0.2 * size]
}

/// The points of a path of M, l, h, v and c.
fn course(data: &str) -> Vec<[f64; 2]> {
    let mut pen = [0.0; 2];
    let mut points = Vec::new();
    let commands: Vec<usize> = data.match_indices(|c: char| c.is_ascii_alphabetic()).map(|(at, _)| at).collect();
    let ends = commands.iter().skip(1).copied().chain([data.len()]);
    for (from, to) in commands.iter().copied().zip(ends) {
        let values: Vec<f64> = numbers(&data[from + 1..to]).collect();
        let moved = |i: usize| [pen[0] + values[i], pen[1] + values[i + 1]];
        let reached = match &data[from..from + 1] {
            "M" => vec![[values[0], values[1]]],
            "l" => vec![moved(0)],
            "h" => vec![[pen[0] + values[0], pen[1]]],
            "v" => vec![[pen[0], pen[1] + values[0]]],
            "c" => vec![moved(0), moved(2), moved(4)],
            other => panic!("{other}"),
        };
        pen = reached[reached.len() - 1];
        points.extend(reached);
    }
    points
}
