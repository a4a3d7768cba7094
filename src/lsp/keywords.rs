//! The words of the language that are no names, its units, general tolerances and fits: what hovers and completions say.
//!
//! Tests hold the keywords against the grammar, and units and classes against what the compiler takes.

/// Where a word may stand: the name of the block, `file` outside all, or what it follows.
pub struct Keyword {
    pub word: &'static str,
    pub within: &'static str,
    pub doc: &'static str,
    /// What completion writes, in the snippets of the protocol; the word alone if empty.
    pub snippet: &'static str,
}

const fn word(within: &'static str, word: &'static str, snippet: &'static str, doc: &'static str) -> Keyword {
    Keyword { word, within, doc, snippet }
}

/// The words of the language that are no names. A word with two meanings has two entries.
pub const KEYWORDS: &[Keyword] = &[
    word("file", "gonogo", "gonogo 1", "the version of the language; the first statement of every file"),
    word("file", "units", "units mm deg", "units of numbers without one: length, then angle"),
    word(
        "file",
        "tolerances",
        "tolerances ${1:ISO2768-m}",
        "general tolerance of sizes without their own: ISO 2768-1 class, or `exact`",
    ),
    word("file", "use", "use \"$1\"", "brings another file's blocks and named dimensions into this spec"),
    word(
        "file",
        "let",
        "let ${1:name} = $0",
        "a named dimension: drawn once for each assembly, the same wherever its name stands; mm unless it has a unit",
    ),
    word("file", "material", "material ${1:name} {\n    kind = ${2:matt}$0\n}", "how a surface answers light"),
    word(
        "file",
        "part",
        "part ${1:name} {\n    material = $2\n\n    add ${3:body} = $0\n}",
        "a part: its material and its features, from top to bottom",
    ),
    word("file", "assembly", "assembly ${1:name} {\n    root $0\n}", "which part is the root, and what stands on it"),
    word(
        "file",
        "station",
        "station ${1:bench} {\n    camera fixed {\n        $0\n    }\n\n    light room = room(patches = 9)\n}",
        "camera, lights, floor, and what varies from photo to photo",
    ),
    word("file", "inspect", "inspect {\n    $0\n}", "what the inspector answers for"),
    word("file", "train", "train {\n    images = 14$0\n}", "how hard to train"),
    word("part", "let", "let ${1:name} = $0", "a named dimension of each piece of this part; mm unless it has a unit"),
    word("part", "add", "add ${1:name} = $0", "adds a shape to what stands above"),
    word("part", "cut", "cut ${1:name} = $0", "cuts a shape from what stands above"),
    word("part", "keep", "keep ${1:name} = $0", "keeps only what lies inside a shape"),
    word(
        "part",
        "outline",
        "outline ${1:name} {\n    from (0, 0)\n    $0\n}",
        "an outline, drawn from corner to corner, for `prism` and `revolve`",
    ),
    word(
        "part",
        "table",
        "table ${1:d} (${2:h}) {\n    row ${3:6} = (${4:10})\n}",
        "sizes of a family of parts: a row for each value of a parameter, a column for each name",
    ),
    word("table", "row", "row ${1:6} = ($0)", "one size: the parameter's value, and what each column is then"),
    word(
        "feature",
        "group",
        "group {\n    add ${1:name} = $0\n}",
        "features of their own, added, cut or kept as a whole",
    ),
    word("feature", "at", "at (${1:0}, ${2:0}, ${3:0})", "moves the feature: `at (x, y, z)`, mm"),
    word(
        "feature",
        "turn",
        "turn (${1:0}, ${2:0}, ${3:0})",
        "turns the feature about its own axes, x first: `turn (rx, ry, rz)`, deg",
    ),
    word("feature", "on", "on $0", "the pattern of the copies, or what a component is placed on"),
    word("outline", "from", "from (${1:0}, ${2:0})", "where the outline begins, mm"),
    word("outline", "line", "line to (${1:0}, ${2:0})", "a straight side to a corner, mm"),
    word(
        "outline",
        "arc",
        "arc to (${1:0}, ${2:0}) radius ${3:10} ${4|left,right|}",
        "an arc to a corner: `arc to (x, y) radius r left`",
    ),
    word("side", "to", "", "the corner a side leads to, or the second face of a measure"),
    word("side", "radius", "", "of the arc, mm"),
    word("side", "left", "", "the arc runs counter-clockwise"),
    word("side", "right", "", "the arc runs clockwise"),
    word("side", "long", "", "the arc is more than half a turn"),
    word("side", "round", "", "rounds the corner with this radius, mm"),
    word("side", "chamfer", "", "cuts the corner off at this distance on both sides, mm"),
    word("assembly", "root", "root $0", "the part that the others stand on"),
    word(
        "assembly",
        "place",
        "place ${1:name} on $0",
        "puts pieces of a part on a component or on one of its features",
    ),
    word(
        "assembly",
        "measure",
        "measure ${1:name} = from $2 to $0",
        "the distance of two faces, mm, and behind `within` the limits it has to keep",
    ),
    word("measure", "from", "", "the first face of a measure"),
    word("measure", "within", "", "the limits that a measure has to keep, mm"),
    word(
        "station",
        "camera",
        "camera ${1|fixed,auto|} {\n    $0\n}",
        "the camera: as installed, or as the compiler may choose it",
    ),
    word("station", "light", "light ${1:name} = $0", "a lamp, or the light of the room"),
    word("station", "floor", "floor {\n    material = $0\n}", "the endless plane that the assembly stands on"),
    word("station", "vary", "vary {\n    $0\n}", "what varies from photo to photo"),
    word("camera", "fixed", "", "the camera stands where the spec says"),
    word("camera", "auto", "", "the compiler chooses the camera's place within ranges"),
    word("inspect", "watch", "watch $0", "watches a component; without any, all are watched"),
    word("inspect", "ignore", "ignore $0", "takes a component out"),
    word("dimension", "basic", "", "exactly this, whatever the general tolerance"),
    word("dimension", "each", "", "every copy of the pattern has its own"),
    word("dimension", "mmc", "", "the size at maximum material condition"),
    word("dimension", "nominal", "", "the size aimed at"),
    word("dimension", "lmc", "", "the size at least material condition"),
    word("dimension", "through", "", "beyond the part at both ends; in cuts only"),
    word("dimension", "free", "", "any turn: drawn over a whole turn"),
];

/// Units, with what they measure.
pub const UNITS: &[(&str, &str)] = &[
    ("mm", "millimetres"),
    ("um", "micrometres, 0.001 mm"),
    ("cm", "centimetres, 10 mm"),
    ("m", "metres, 1000 mm"),
    ("in", "inches, 25.4 mm"),
    ("deg", "degrees"),
    ("rad", "radians"),
    ("px", "pixels"),
    ("%", "a share: hundredths"),
];

/// General tolerances of the title block.
pub const GENERAL: &[(&str, &str)] = &[
    ("ISO2768-f", "ISO 2768-1 fine: ±0.1 mm at 10 mm"),
    ("ISO2768-m", "ISO 2768-1 medium: ±0.2 mm at 10 mm"),
    ("ISO2768-c", "ISO 2768-1 coarse: ±0.5 mm at 10 mm"),
    ("ISO2768-v", "ISO 2768-1 very coarse: ±1 mm at 10 mm"),
    ("exact", "sizes without a tolerance are exact"),
];

/// Fits that workshops keep tools for, the usual ones first.
pub const HOLES: &[&str] = &["H7", "H8", "H6", "H9", "H11", "F7", "G7", "G6", "K7", "N7", "P7", "JS7", "E9", "D10"];
pub const SHAFTS: &[&str] = &["h6", "g6", "f7", "h7", "k6", "m6", "n6", "p6", "js6", "h9", "h11", "e8", "d9"];
