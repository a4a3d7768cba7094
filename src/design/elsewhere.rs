//! What things are called in other languages and programs, for suggestions.
//!
//! In: a word that nothing here has. Out: the word of the language for it, or where that is said. Knows no spec.

/// What arguments and fields are called elsewhere, the likeliest first.
const ARGUMENTS: [(&str, &[&str]); 35] = [
    ("dia", &["d"]),
    ("diam", &["d"]),
    ("diameter", &["d"]),
    ("d_head", &["head_d"]),
    ("height", &["h", "z"]),
    ("h", &["z"]),
    ("thickness", &["h", "z"]),
    ("t", &["z", "h"]),
    ("length", &["h", "l", "x", "y"]),
    ("len", &["h", "l", "x", "y"]),
    ("l", &["h", "x", "y"]),
    ("depth", &["h", "y", "z"]),
    ("width", &["x", "y"]),
    ("w", &["x", "y"]),
    ("b", &["y"]),
    ("size", &["image"]),
    ("profile", &["outline"]),
    ("sketch", &["outline"]),
    ("distance", &["pitch"]),
    ("spacing", &["pitch"]),
    ("start", &["from"]),
    ("radius", &["r"]),
    ("resolution", &["image"]),
    ("pixels", &["image"]),
    ("focal_length", &["focal"]),
    ("lens", &["focal"]),
    ("f", &["focal"]),
    ("pixel_size", &["pitch"]),
    ("pixel_pitch", &["pitch"]),
    ("working_distance", &["distance"]),
    ("target", &["aim"]),
    ("look_at", &["aim"]),
    ("brightness", &["power"]),
    ("intensity", &["power"]),
    ("color", &["reflectance"]),
];

/// What shapes and lights are called elsewhere.
const CALLS: [(&str, &str); 26] = [
    ("cube", "box"),
    ("cuboid", "box"),
    ("block", "box"),
    ("plate", "box"),
    ("rect", "box"),
    ("cyl", "cylinder"),
    ("rod", "cylinder"),
    ("disc", "cylinder"),
    ("disk", "cylinder"),
    ("tube", "cylinder"),
    ("ball", "sphere"),
    ("donut", "torus"),
    ("ring", "torus"),
    ("extrude", "prism"),
    ("linear_extrude", "prism"),
    ("polygon", "prism"),
    ("lathe", "revolve"),
    ("revolution", "revolve"),
    ("rotate_extrude", "revolve"),
    ("drill", "hole"),
    ("bore", "hole"),
    ("cbore", "counterbore"),
    ("csink", "countersink"),
    ("ringlight", "ring"),
    ("ring_light", "ring"),
    ("ambient", "room"),
];

/// Where something is said that another program says here: who has no such field, the field, the help.
const INSTEAD: [(&str, &[&str], &str); 10] = [
    (
        "camera",
        &["position", "pos", "at", "location"],
        "a camera stands at `distance`, `elevation` and `azimuth` from the point `aim`",
    ),
    ("camera", &["exposure", "noise", "gain"], "`exposure` and `noise` stand in `vary { … }` of the station"),
    ("camera", &["fov", "angle"], "the field of view is that of `focal`, `pitch` and `image`"),
    ("place", &["rotation", "rotate", "turn", "angle"], "a component is turned by `rx`, `ry` and `rz`"),
    ("place", &["at", "position", "offset", "pos"], "a component is moved by `x`, `y` and `z`"),
    (
        "material",
        &["density", "name", "type"],
        "a material says how a surface looks: `kind`, `reflectance`, `roughness`",
    ),
    ("circle", COUNTS, COPIES),
    ("line", COUNTS, COPIES),
    ("grid", &["rows", "count", "n", "number", "copies", "instances"], COPIES),
    (
        "train",
        &["epochs", "lr", "batch", "learning_rate"],
        "nothing here is fitted step by step: `images` says how much is rendered",
    ),
];

const COUNTS: &[&str] = &["count", "n", "number", "copies", "instances"];
const COPIES: &str = "copies are counted before the shape: `3x cylinder(…)`";

/// The names of this language for a field of another, of those in `known`, the likeliest first.
pub fn field<'k>(word: &str, known: &[&'k str]) -> Vec<&'k str> {
    let ours =
        ARGUMENTS.iter().find(|(theirs, _)| *theirs == word.to_ascii_lowercase()).map_or(&[][..], |(_, ours)| *ours);
    ours.iter().filter_map(|ours| known.iter().find(|k| *k == ours).copied()).collect()
}

/// The shape or light of this language for one of another, if it is one of `known`.
pub fn call<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let (_, ours) = CALLS.iter().find(|(theirs, _)| *theirs == word.to_ascii_lowercase())?;
    known.iter().find(|k| *k == ours).copied()
}

/// Where `owner` has what another program calls `word`.
pub fn instead(owner: &str, word: &str) -> Option<&'static str> {
    let kind = owner.split(' ').next().unwrap_or_default();
    INSTEAD.iter().find(|(of, words, _)| *of == kind && words.contains(&word)).map(|(.., help)| *help)
}
