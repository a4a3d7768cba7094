//! Parsing never panics, and formatting neither changes what a spec says nor itself.

#![cfg(feature = "cli")]

use gonogo::syntax::ast::{Body, File, Gap, Line, Shape, Stmt};
use gonogo::syntax::{format, parse};
use proptest::prelude::*;

const SPECS: [&str; 6] = [
    include_str!("../specs/pattern_wheel.gng"),
    include_str!("../specs/four_screws.gng"),
    include_str!("../specs/pinned_plate.gng"),
    include_str!("../specs/shapes.gng"),
    include_str!("../specs/bearing_block.gng"),
    include_str!("../specs/std/iso4762.gng"),
];

/// The tree without blank lines, which are layout.
fn meaning(text: &str) -> serde_json::Value {
    let (mut file, diagnostics) = parse(text, 0);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}\n{text}");
    strip_file(&mut file);
    serde_json::to_value(&file).unwrap()
}

fn strip_file(file: &mut File) {
    strip_lines(&mut file.lines);
    file.end.retain(|gap| *gap != Gap::Blank);
}

fn strip_lines(lines: &mut [Line]) {
    for line in lines {
        line.before.retain(|gap| *gap != Gap::Blank);
        match &mut line.stmt {
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
            | Stmt::Train(body) => strip_body(body),
            Stmt::Feature(feature) => {
                if let Shape::Group { body, .. } = &mut feature.shape {
                    strip_body(body);
                }
            }
            Stmt::Place(place) => place.body.iter_mut().for_each(strip_body),
            _ => {}
        }
    }
}

fn strip_body(body: &mut Body) {
    strip_lines(&mut body.lines);
    body.end.retain(|gap| *gap != Gap::Blank);
}

fn assert_formats(text: &str) {
    let once = format(text).unwrap();
    assert_eq!(meaning(&once), meaning(text), "{once}");
    assert_eq!(format(&once).unwrap(), once);
}

#[test]
fn formatting_keeps_what_the_specs_say() {
    SPECS.iter().for_each(|text| assert_formats(text));
}

#[test]
fn formatting_keeps_comments_everywhere() {
    let text = "// head\ngonogo 1 // version\n\n\n\npart  pin{ // open\n// first\nmaterial=steel//behind\n\n\n add a=2x cylinder( // one\n d=6+0/-0.1, h=3 // two\n )at(1,2)turn(0 deg,0,(90 deg-a)) on line(pitch=3)\n// last\n\n}\ntrain{images=4}\n// end";
    assert_formats(text);
    let laid_out = format(text).unwrap();
    for comment in ["// head", "// version", "// open", "// first", "//behind", "// one", "// two", "// last", "// end"]
    {
        assert_eq!(laid_out.matches(comment).count(), 1, "{comment}\n{laid_out}");
    }
}

#[test]
fn formatting_keeps_comments_of_groups_and_outlines() {
    let text = "part p{\n//above\noutline  o{//open\nfrom(0,0)round 1//start\n//between\nline a to(10±0.1,0)mm chamfer 2\narc to(0,5)radius 8 left long//arc\n//last\n}\ncut g=2x group at(0,0,1)on line(pitch=3){//group\nadd a=hole(d=1,h=2)//hole\n//end\n}//behind\n}\nassembly a{\nroot p\nmeasure m=from p.o.1 to p.g[2].a.+x within 1..2//measure\n}";
    assert_formats(text);
    let laid_out = format(text).unwrap();
    for comment in ["above", "open", "start", "between", "arc", "last", "group", "hole", "end", "behind", "measure"] {
        assert_eq!(laid_out.matches(&format!("//{comment}")).count(), 1, "{comment}\n{laid_out}");
    }
    for line in [
        "    outline o {  //open\n        from (0, 0) round 1  //start\n",
        "        line a to (10 ±0.1, 0) mm chamfer 2\n        arc to (0, 5) radius 8 left long  //arc\n",
        "    cut g = 2x group at (0, 0, 1) on line(pitch = 3) {  //group\n        add a = hole(d = 1, h = 2)  //hole\n",
        "    measure m = from p.o.1 to p.g[2].a.+x within 1 .. 2  //measure\n",
    ] {
        assert!(laid_out.contains(line), "{line}\n{laid_out}");
    }
}

#[test]
fn formatting_wraps_what_is_too_long() {
    let text = format!(
        "station s {{\n    light l = panel(width = 100, height = 100, at = ({0}, {0}, {0}), aim = ({0}, {0}, {0}))\n}}\n",
        "1000000.000000"
    );
    assert_formats(&text);
    assert!(format(&text).unwrap().contains("    light l = panel(\n        width = 100,\n"));
}

#[test]
fn spellings_of_one_dimension_become_one() {
    let canonical = "let a = 6 ±0.1 deg\n";
    for spelling in ["let a=6+/-0.1°", "let  a = 6 ± 0.1 deg", "let a = 6 +/- 0.1 deg"] {
        assert_eq!(format(spelling).unwrap(), canonical, "{spelling}");
    }
    assert_eq!(format("let b = 10 −0.005/−0.014").unwrap(), "let b = 10 -0.005/-0.014\n");
}

#[test]
fn deep_nesting_is_refused_and_not_overflowed() {
    for depth in [31, 33, 100_000] {
        let text = format!("gonogo 1\nlet a = {}1{}\n", "(".repeat(depth), ")".repeat(depth));
        assert_eq!(parse(&text, 0).1.is_empty(), depth <= 32, "{depth}");
    }
    parse(&"{".repeat(100_000), 0);
    let groups = |depth: usize| {
        format!("part p {{\n{}add a = sphere(d = 1)\n{}}}\n", "add a = group {\n".repeat(depth), "}\n".repeat(depth))
    };
    for depth in [20, 40, 20_000] {
        assert_eq!(parse(&groups(depth), 0).1.is_empty(), depth <= 30, "{depth}");
        load(&groups(depth));
    }
    parse(&"part p {\n".repeat(10_000), 0);
    // Braces that line up with nothing, and one that ends what many parentheses began: each bracket is looked at once.
    parse(&format!("part p {{\n{}{}", "  a {\n".repeat(20_000), " }\n".repeat(20_000)), 0);
    parse(&format!("part p {{\n{}\n}}\n", "add a = (\n".repeat(20_000)), 0);
}

#[test]
fn a_long_statement_list_is_read_in_time() {
    let text = format!("part p {{\n{}}}\n", "    cut a = cylinder(d = 6 H7, h = (a + b * (c - 1 mm)))\n".repeat(5_000));
    assert!(parse(&text, 0).1.is_empty());
}

#[test]
fn a_long_sum_is_refused_and_not_overflowed() {
    for terms in [200, 400, 100_000] {
        let text = format!("gonogo 1\nlet a = ({}1)\n", "1 + ".repeat(terms));
        assert_eq!(parse(&text, 0).1.is_empty(), terms < 300, "{terms}");
        load(&text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn garbage_never_panics(text in "\\PC{0,80}(\n\\PC{0,40}){0,6}") {
        load(&text);
    }

    #[test]
    fn words_of_the_language_in_any_order_never_panic(words in proptest::collection::vec(word(), 0..60)) {
        load(&format!("gonogo 1\n{}", words.join(" ")));
    }

    #[test]
    fn parts_of_any_shape_never_panic(
        sides in proptest::collection::vec(side(), 1..9),
        features in proptest::collection::vec(feature(), 1..6),
        deep in 0usize..4,
    ) {
        let (open, close) = ("cut g = 2x group turn (0, 30 ±1, 0) on line(pitch = 3 ±0.1) {\n".repeat(deep), "}\n".repeat(deep));
        let named = features.iter().enumerate().map(|(i, f)| f.replacen("NAME", &format!("f{i}"), 1));
        let features = named.collect::<Vec<_>>().join("\n");
        load(&format!(
            "gonogo 1\nmaterial m {{\n kind = matt\n}}\npart p {{\n material = m\n let a = 5 ±0.1\n outline o {{\n from (a, 0)\n{}\n }}\n\
             add base = box(x = 20, y = a, z = 10)\n{open}{features}\n{close}}}\nassembly s {{\n root p\n}}\n\
             station b {{\n light r = room(patches = 1)\n}}\n",
            sides.join("\n")
        ));
    }

    #[test]
    fn mutated_specs_never_panic(spec in 0usize..4, at in 0.0f64..1.0, cut in 0usize..40, insert in word()) {
        let text = SPECS[spec];
        let start = text.floor_char_boundary((at * text.len() as f64) as usize);
        let end = text.ceil_char_boundary((start + cut).min(text.len()));
        load(&format!("{}{insert}{}", &text[..start], &text[end..]));
    }
}

fn load(text: &str) {
    let loaded = gonogo::design::load("x.gng", &|_| Ok(text.to_string()), &[]);
    assert_eq!(loaded.design.is_none(), loaded.diagnostics.iter().any(|d| d.is_error()));
    gonogo::cli::report::human(&loaded.sources, &loaded.diagnostics, false);
    if let Ok(laid_out) = format(text) {
        assert_eq!(format(&laid_out).unwrap(), laid_out);
    }
}

/// A token of the language, or something that nearly is one.
fn word() -> impl Strategy<Value = String> {
    let words = [
        "part",
        "group",
        "outline",
        "from (0, 0)",
        "line to (10, 0) round 1",
        "arc nose to (0, 5) radius 8 left long",
        "prism(outline = a, h = 3)",
        "counterbore(d = 3, h = through, head_d = 5, head_h = 2)",
        "measure",
        "within",
        "material",
        "assembly",
        "station",
        "place",
        "on",
        "at",
        "cut",
        "add",
        "let",
        "pin",
        "steel",
        "x",
        "=",
        "{",
        "}",
        "\n",
        "(",
        ")",
        "[",
        "]",
        ",",
        "..",
        ".",
        "±",
        "+0.1/-0.2",
        "H7",
        "g6",
        "1e308",
        "-",
        "*",
        "/",
        "(a / 0)",
        "6 mm",
        "3x",
        "1000000000x",
        "cylinder(d = 6, h = through)",
        "circle(d = 3)",
        "each",
        "basic",
        "free",
        "\"",
        "//",
        "\r\n",
        "%",
        "°",
        "{ mmc 1, lmc 2 }",
        "use",
        "train",
        "inspect",
        "watch",
        "root",
        "camera",
        "light",
        "room()",
        "99999999999999999999",
        "[0]",
        "[1..3]",
        "é",
    ];
    proptest::sample::select(words.to_vec()).prop_map(str::to_string)
}

/// A line of an outline, on a coarse grid so that corners coincide and sides touch.
fn side() -> impl Strategy<Value = String> {
    let corner = proptest::sample::select(vec!["", " round 1", " round 2 ±0.5", " chamfer 1", " chamfer (a - 4)"]);
    let bend = proptest::sample::select(vec!["", "", "", " radius 3 left", " radius a right", " radius 6 left long"]);
    (0i32..6, -3i32..5, bend, corner, proptest::bool::ANY).prop_map(|(x, y, bend, corner, named)| {
        let word = if bend.is_empty() { "line" } else { "arc" };
        let x = if named { format!("(a * {x} / 2)") } else { (2 * x).to_string() };
        format!("{word} to ({x}, {}){bend}{corner}", 2 * y)
    })
}

/// A feature called NAME.
fn feature() -> impl Strategy<Value = String> {
    let shapes = [
        "prism(outline = o, h = a)",
        "prism(outline = o, h = through)",
        "revolve(outline = o)",
        "torus(d = 12, tube = a)",
        "cylinder(d = a, h = 12, chamfer = 1 ±0.2)",
        "cylinder(d = 4, h = through)",
        "cone(d1 = a, d2 = 0, h = 6)",
        "sphere(d = (2 * a))",
        "hole(d = 3, h = a, tip = 118)",
        "counterbore(d = 3, h = through, head_d = a, head_h = 2)",
        "countersink(d = 3, h = 8, head_d = a)",
    ];
    let places = ["", " at (0, 0, a)", " at (1 ±0.1, 2, 10) turn (90, 0, 0)", " on circle(d = a)"];
    let operations = ["add", "cut", "keep"];
    let select = |list: &[&'static str]| proptest::sample::select(list.to_vec());
    (select(&operations), select(&shapes), select(&places))
        .prop_map(|(operation, shape, place)| format!("{operation} NAME = {shape}{place}"))
}

/// Layout is a hint where a bracket is missing, and nothing where none is.
#[test]
fn valid_text_is_read_however_it_is_laid_out() {
    for text in [
        // The `}` of an inner block lines up with the outer one.
        "station s {\n    camera fixed {\n        focal = 16\n}\n    light l = room()\n}\n",
        "part p {\n      cut c = group {\n      add a = sphere(d = 1)\n  }\n    add b = sphere(d = 1)\n  }\n",
        // Words that begin blocks, as names inside parentheses.
        "let a = (\npart.top\n)\n",
        "let a = (\npart\n  + 1)\n",
        "let a = (\npart\n+ 1)\n",
        "let a = (1 +\nstation\n    - assembly.b)\npart p {\n}\n",
        // Beside the same inside a block.
        "part p {\nadd a = box(x = (\ntrain\n), y = 2)\n}\ntrain {\nimages = 3\n}\n",
    ] {
        let (file, diagnostics) = parse(text, 0);
        assert!(diagnostics.is_empty() && file.lost.is_empty(), "{diagnostics:#?}\n{text}");
        assert_eq!(meaning(&format(text).unwrap()), meaning(text));
    }
}

/// Guesses are made where something is wrong, and nowhere else.
#[test]
fn a_fault_of_one_item_leaves_the_others_as_they_are() {
    let odd = "station s {\n    camera fixed {\n        focal = 16\n}\n    light l = room()\n}\n";
    let text = format!("{odd}part p {{\n    add a = sphere(d = (1 + ))\n}}\n{odd}");
    let (file, diagnostics) = parse(&text, 0);
    assert_eq!(diagnostics.iter().map(|d| d.code).collect::<Vec<_>>(), ["E0101"], "{diagnostics:#?}");
    assert_eq!(file.lines.len(), 3);
}
