//! Random parts against Open CASCADE: volume, area, faces by kind of surface, edges and corners, and the triangles.
//!
//! The parts and their figures are in `oracle/parts.txt`, made once by `oracle/make_parts.py`. Every part is evaluated on
//! every run; those that differ are listed together, the smallest first. `GONOGO_PARTS=FILE` judges the parts of another
//! file instead.

#![cfg(feature = "compile")]

use gonogo::design::load;
use gonogo::design::model::{Expr, Feature, Part, PoseExpr};
use gonogo::solid::{Quality, Solid, Surface, evaluate};
use nalgebra::Isometry3;
use std::collections::BTreeMap;
use std::panic::catch_unwind;

const PARTS: &str = include_str!("oracle/parts.txt");
/// Relative difference of volume and area from Open CASCADE's.
const EXACT: f64 = 1e-6;

/// A part of the data with what is expected of it.
#[derive(Debug)]
struct Case {
    name: String,
    /// `at (x, y, z) turn (rx, ry, rz)` of all features together.
    pose: Option<String>,
    features: Vec<String>,
    expected: Expected,
}

#[derive(Debug)]
enum Expected {
    Figures(Figures),
    /// It touches itself along a line: refused, or of this volume and area.
    Touching(Figures),
    Refused(String),
}

#[derive(Debug, Clone, PartialEq)]
struct Figures {
    volume: f64,
    area: f64,
    faces: BTreeMap<&'static str, usize>,
    edges: usize,
    corners: usize,
}

#[test]
fn every_part_has_the_figures_of_open_cascade() {
    let other =
        std::env::var("GONOGO_PARTS").map(|path| std::fs::read_to_string(path).expect("GONOGO_PARTS names a file"));
    let cases = read(other.as_deref().unwrap_or(PARTS));
    let mut tally: BTreeMap<char, [usize; 2]> = BTreeMap::new();
    let mut failures: Vec<(usize, String)> = Vec::new();
    for (case, outcome) in cases.iter().zip(judge_all(&cases)) {
        let tally = tally.entry(case.family()).or_default();
        match outcome {
            Outcome::Right => tally[0] += 1,
            Outcome::Wrong(why) => {
                tally[1] += 1;
                failures.push((case.features.len(), format!("{}\n{why}\n", case.text())));
            }
        }
    }
    println!("family: right, wrong: {tally:?}");
    failures.sort();
    let list: Vec<&str> = failures.iter().map(|(_, text)| text.as_str()).collect();
    assert!(failures.is_empty(), "{} of {} parts differ\n\n{}", list.len(), cases.len(), list.join("\n"));
}

enum Outcome {
    Right,
    Wrong(String),
}

/// Judges the cases on two threads; the answers keep the cases' order.
fn judge_all(cases: &[Case]) -> Vec<Outcome> {
    let (left, right) = cases.split_at(cases.len() / 2);
    let judge_half = |half: &[Case]| half.iter().map(judge).collect::<Vec<_>>();
    std::thread::scope(|scope| {
        let other = scope.spawn(|| judge_half(right));
        let mut all = judge_half(left);
        all.extend(other.join().expect("a panic of the kernel is caught case by case"));
        all
    })
}

fn judge(case: &Case) -> Outcome {
    let result = catch_unwind(|| case.solid()).unwrap_or_else(|_| Err(vec!["panic".into()]));
    match (&case.expected, result) {
        (Expected::Figures(expected), Ok(solid)) => verdict(differences(expected, &solid)),
        (Expected::Touching(expected), Ok(solid)) => verdict(differences(&expected.counted_in(&solid), &solid)),
        (Expected::Touching(_), Err(codes)) if codes == ["E0407"] => Outcome::Right,
        (Expected::Refused(code), Err(codes)) if fitting(code, &codes) => Outcome::Right,
        (Expected::Refused(code), Ok(solid)) => {
            Outcome::Wrong(format!("is built, {code} expected: {:?}", Figures::of(&solid)))
        }
        (_, Err(codes)) => Outcome::Wrong(format!("is refused: {codes:?}")),
    }
}

/// Pieces that touch along a line may be reported as either.
fn fitting(expected: &str, codes: &[String]) -> bool {
    codes == [expected] || expected == "E0405" && codes == ["E0407"]
}

fn verdict(differences: Vec<String>) -> Outcome {
    if differences.is_empty() { Outcome::Right } else { Outcome::Wrong(differences.join("\n")) }
}

fn differences(expected: &Figures, solid: &Solid) -> Vec<String> {
    let found = Figures::of(solid);
    let mut out = Vec::new();
    for (what, a, b) in [("volume", found.volume, expected.volume), ("area", found.area, expected.area)] {
        let off = (a / b - 1.0).abs();
        if off.is_nan() || off > EXACT {
            out.push(format!("{what} {a}: off by {:.1e}", a / b - 1.0));
        }
    }
    let counts = |f: &Figures| (f.faces.clone(), f.edges, f.corners);
    if counts(&found) != counts(expected) {
        out.push(format!("{:?} edges {} corners {}", found.faces, found.edges, found.corners));
    }
    out.extend(mesh_faults(solid));
    out
}

/// Closed, and no farther from the solid than its chords.
fn mesh_faults(solid: &Solid) -> Vec<String> {
    let mut sides: BTreeMap<(u32, u32), usize> = BTreeMap::new();
    let mut volume = 0.0;
    for t in &solid.mesh.triangles {
        for k in 0..3 {
            *sides.entry((t[k], t[(k + 1) % 3])).or_default() += 1;
        }
        let [a, b, c] = t.map(|v| solid.mesh.positions[v as usize].coords);
        volume += a.dot(&b.cross(&c)) / 6.0;
    }
    let open = sides.iter().filter(|((a, b), n)| **n != 1 || sides.get(&(*b, *a)) != Some(&1)).count();
    let mut out = Vec::new();
    if open > 0 {
        out.push(format!("{open} of {} sides of triangles are open", sides.len()));
    }
    let off = (volume - solid.volume).abs();
    if off.is_nan() || off > Quality::default().chord * solid.area {
        out.push(format!("the triangles hold {volume}, the solid {}", solid.volume));
    }
    out
}

impl Figures {
    fn of(solid: &Solid) -> Figures {
        let mut faces = BTreeMap::new();
        for face in &solid.faces {
            *faces.entry(kind(&solid.surfaces[face.surface])).or_default() += 1;
        }
        let (edges, corners) = (solid.edges.len(), solid.vertices.len());
        Figures { volume: solid.volume, area: solid.area, faces, edges, corners }
    }

    /// The same volume and area with the counts of a solid.
    fn counted_in(&self, solid: &Solid) -> Figures {
        Figures { volume: self.volume, area: self.area, ..Figures::of(solid) }
    }

    /// `volume V area A faces 2 plane 1 cylinder edges E corners C`.
    fn read(text: &str) -> Figures {
        let words: Vec<&str> = text.split_whitespace().collect();
        let after = |key: &str| words[words.iter().position(|w| *w == key).unwrap() + 1];
        let faces = words.windows(2).filter_map(|w| Some((known(w[1])?, w[0].parse().ok()?))).collect();
        Figures {
            volume: after("volume").parse().unwrap(),
            area: after("area").parse().unwrap(),
            faces,
            edges: after("edges").parse().unwrap(),
            corners: after("corners").parse().unwrap(),
        }
    }
}

const KINDS: [&str; 5] = ["plane", "cylinder", "cone", "sphere", "torus"];

fn known(kind: &str) -> Option<&'static str> {
    KINDS.into_iter().find(|k| *k == kind)
}

fn kind(surface: &Surface) -> &'static str {
    match surface {
        Surface::Plane { .. } => "plane",
        Surface::Cylinder { .. } => "cylinder",
        Surface::Cone { .. } => "cone",
        Surface::Sphere { .. } => "sphere",
        Surface::Torus { .. } => "torus",
    }
}

fn read(text: &str) -> Vec<Case> {
    text.split("\npart ").skip(1).map(Case::read).collect()
}

impl Case {
    fn read(text: &str) -> Case {
        let mut lines = text.lines().filter(|l| !l.is_empty());
        let name = lines.next().unwrap().to_string();
        let (mut pose, mut features, mut expected) = (None, Vec::new(), None);
        for line in lines {
            match line.split_once(" ").unwrap_or((line, "")) {
                ("at", _) => pose = Some(line.to_string()),
                ("=", code) if code.starts_with('E') => expected = Some(Expected::Refused(code.into())),
                ("=", figures) if figures.ends_with(" or E0407") => {
                    expected = Some(Expected::Touching(Figures::read(figures)));
                }
                ("=", figures) => expected = Some(Expected::Figures(Figures::read(figures))),
                _ => features.push(line.to_string()),
            }
        }
        Case { name, pose, features, expected: expected.unwrap() }
    }

    fn family(&self) -> char {
        self.name.chars().next().unwrap()
    }

    fn text(&self) -> String {
        let mut lines = vec![format!("part {}", self.name)];
        lines.extend(self.pose.clone());
        lines.extend(self.features.clone());
        lines.push(format!("{:?}", self.expected));
        lines.join("\n")
    }

    /// The solid, or the codes of the diagnostics.
    fn solid(&self) -> Result<Solid, Vec<String>> {
        let codes = |found: Vec<gonogo::diag::Diagnostic>| found.iter().map(|d| d.code.to_string()).collect::<Vec<_>>();
        let (mut part, values) = load_part(&self.features).map_err(codes)?;
        if let Some(pose) = &self.pose {
            // The language reads the pose, too: as that of a feature.
            let frame = [format!("add frame = box(x = 1, y = 1, z = 1) {pose}")];
            let (frame, values) = load_part(&frame).map_err(codes)?;
            place(&mut part.features, &frame.features[0].copies[0].pose.eval(&values));
        }
        evaluate(&part, &values, &Quality::default()).map_err(codes)
    }
}

/// The part that consists of these features, and the nominal values of its dimensions.
fn load_part(features: &[String]) -> Result<(Part, Vec<f64>), Vec<gonogo::diag::Diagnostic>> {
    let text = format!(
        "gonogo 1\nmaterial steel {{ metal = steel }}\npart piece {{\nmaterial = steel\n{}\n}}\n\
         assembly one {{\nroot piece\n}}\nstation bench {{\nlight room = room(patches = 1)\n}}\n",
        features.join("\n")
    );
    let loaded = load("part.gng", &|_| Ok(text.clone()), &[]);
    let design = loaded.design.ok_or(loaded.diagnostics)?;
    let values = design.nominal();
    Ok((design.parts.into_iter().next().unwrap(), values))
}

/// Moves all features together.
fn place(features: &mut [Feature], frame: &Isometry3<f64>) {
    for copy in features.iter_mut().flat_map(|f| &mut f.copies) {
        let pose = frame * copy.pose.eval(&[]);
        let (rx, ry, rz) = pose.rotation.euler_angles();
        let t = pose.translation.vector;
        copy.pose = PoseExpr { t: [t.x, t.y, t.z].map(Expr::Const), r: [rx, ry, rz].map(Expr::Const) };
    }
}
