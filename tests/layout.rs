//! The layout on generated specs: it changes nothing that is said, keeps every comment in order, and is its own layout.
//!
//! Specs are generated as text with blank lines, comments, tabs, line ends and long lines wherever the language allows
//! them. The oracle for comments does not know the parser: it reads them from the two texts.

#![cfg(feature = "cli")]

use gonogo::syntax::ast::{File, Gap};
use gonogo::syntax::{format, parse};
use proptest::prelude::*;
use proptest::sample::select;
use serde_json::Value;

/// A line of a generated text: blanks, a comment, or nothing.
fn gap() -> impl Strategy<Value = String> {
    select(vec!["", "", "\n", "\n\n\n", "  // ± above 🔩\n", "\t//tight\n\n//next \n", " \t\n// after blanks\n"])
        .prop_map(str::to_string)
}

/// What may stand behind a statement on its line.
fn behind() -> impl Strategy<Value = String> {
    select(vec!["", "", "", "  ", "// behind", "\t//µ \t", " // with \"quotes\" and { ( "]).prop_map(str::to_string)
}

fn name() -> impl Strategy<Value = String> {
    select(vec![
        "a",
        "bore",
        "_x",
        "slab_of_steel",
        "parts",
        "part",
        "place",
        "z9",
        "a_name_that_is_so_long_that_lines_break_because_of_it",
    ])
    .prop_map(str::to_string)
}

fn space() -> impl Strategy<Value = &'static str> {
    select(vec!["", " ", "  ", "\t"])
}

fn number() -> impl Strategy<Value = String> {
    select(vec!["1", "80", "0.5", "6.000", "1e3", "12.5E-2", "-3", "−0.25", "1000000.000000", "007"])
        .prop_map(str::to_string)
}

fn quantity() -> impl Strategy<Value = String> {
    (number(), select(vec!["", "", " mm", "um", " deg", "°", " %", "µm"])).prop_map(|(n, unit)| n + unit)
}

fn sum() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![quantity(), name(), name().prop_map(|n| format!("-{n}"))];
    leaf.prop_recursive(3, 12, 2, |inner| {
        (inner.clone(), select(vec!["+", " - ", " * ", "\n/\n", "\n  - ", " +\t"]), inner, any::<bool>())
            .prop_map(|(a, sign, b, group)| if group { format!("({a}{sign}{b})") } else { format!("{a} {sign} {b}") })
    })
}

fn size() -> impl Strategy<Value = String> {
    prop_oneof![
        quantity(),
        sum().prop_map(|s| format!("( {s})")),
        name(),
        (name(), 1u8..9).prop_map(|(n, i)| format!("{n}.top[{i}..9]")),
        quantity().prop_map(|q| format!("{{mmc {q},nominal 2 , lmc 3}} mm")),
    ]
}

fn dim() -> impl Strategy<Value = String> {
    let tolerance = prop_oneof![
        3 => Just(String::new()),
        1 => quantity().prop_map(|q| format!(" ±{q}").replace("±-", "±").replace("±−", "±")),
        1 => Just(" +/- 0.1".to_string()),
        1 => Just(" +0.1/-0.2 um".to_string()),
        1 => Just(" .. 12 mm".to_string()),
        1 => Just(" H7".to_string()),
        1 => Just(" basic".to_string()),
    ];
    (size(), tolerance, select(vec!["", "", " each"])).prop_map(|(size, tolerance, each)| {
        // Stated limits and paths take no tolerance that would make another path of them.
        let bare = size.starts_with('{');
        if bare { format!("{size}{each}") } else { format!("{size}{tolerance}{each}") }
    })
}

fn point() -> impl Strategy<Value = String> {
    (dim(), dim(), proptest::option::of(dim()), select(vec!["", " mm", " deg"])).prop_map(|(x, y, z, unit)| {
        let z = z.map_or(String::new(), |z| format!(",\n{z}"));
        format!("({x} , {y}{z}){unit}")
    })
}

fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => dim(),
        1 => point(),
        1 => Just("640x480 px".to_string()),
        1 => Just("\"a // b\"".to_string()),
    ]
}

/// `(a = 1, // one ⏎ b = 2)`
fn args() -> impl Strategy<Value = String> {
    let between = select(vec!["", " ", "\n", " // in the list\n", "\n\n// above\n// twice\n", "\t"]);
    let one = (between, name(), value(), select(vec!["", " ", "\n", " // before the comma\n"]));
    (
        proptest::collection::vec(one, 0..4),
        select(vec!["", "\n", " // last\n", "\n// last\n// of all\n"]),
        any::<bool>(),
    )
        .prop_map(|(list, end, comma)| {
            let comma = if comma && !list.is_empty() { "," } else { "" };
            let list: Vec<String> =
                list.into_iter().map(|(gap, k, v, after)| format!("{gap}{k} ={v}{after}")).collect();
            format!("({}{comma}{end})", list.join(","))
        })
}

fn call() -> impl Strategy<Value = String> {
    (select(vec!["cylinder", "box", "ring", "x9"]), args()).prop_map(|(word, args)| format!("{word}{args}"))
}

fn path() -> impl Strategy<Value = String> {
    (name(), select(vec!["", ".bore", "[2]", "[1..3] . b[2]"])).prop_map(|(n, rest)| n + rest)
}

/// Statements between braces, each with what may stand above and behind it.
fn block(statement: impl Strategy<Value = String>) -> impl Strategy<Value = String> {
    let lines = proptest::collection::vec((gap(), space(), statement, behind()), 0..5);
    (lines, behind(), gap()).prop_map(|(lines, open, end)| {
        let line =
            |(above, indent, stmt, behind): (String, &str, String, String)| format!("{above}{indent}{stmt} {behind}\n");
        let lines: String = lines.into_iter().map(line).collect();
        format!("{{{open}\n{lines}{end}}}")
    })
}

fn field() -> impl Strategy<Value = String> {
    (name(), space(), value()).prop_map(|(key, blank, value)| format!("{key}{blank}={blank}{value}"))
}

fn feature() -> impl Strategy<Value = String> {
    let at = proptest::option::of(point().prop_map(|p| format!(" at {p}")));
    let turn = proptest::option::of(point().prop_map(|p| format!(" turn{p}")));
    let on = proptest::option::of(call().prop_map(|c| format!(" on {c}")));
    (select(vec!["add", "cut", "keep"]), name(), select(vec!["", "3x ", "1000x "]), call(), at, turn, on).prop_map(
        |(op, name, count, call, at, turn, on)| {
            let [at, turn, on] = [at, turn, on].map(Option::unwrap_or_default);
            format!("{op} {name}={count}{call}{at}{turn}{on}")
        },
    )
}

fn part_statement() -> impl Strategy<Value = String> {
    let side = prop_oneof![
        (point(), select(vec!["", " round 1 ±0.1", " chamfer 2"]))
            .prop_map(|(p, corner)| format!("line to {p}{corner}")),
        (name(), point(), dim()).prop_map(|(n, p, r)| format!("arc {n} to {p} radius {r} left  long")),
        point().prop_map(|p| format!("from {p} round 2")),
    ];
    let plain = prop_oneof![
        3 => feature(),
        1 => field(),
        1 => (name(), dim()).prop_map(|(n, d)| format!("let  {n}= {d}")),
        1 => (name(), block(side)).prop_map(|(n, body)| format!("outline {n}{body}")),
    ];
    plain.prop_recursive(2, 8, 4, |inner| {
        (name(), block(inner)).prop_map(|(n, body)| format!("cut {n} = 2x group at (0, 0) on line(pitch = 3) {body}"))
    })
}

fn item() -> impl Strategy<Value = String> {
    let place = (name(), path(), proptest::option::of(block(field())))
        .prop_map(|(n, on, body)| format!("place {n} = 3x {n}  on {on} {}", body.unwrap_or_default()));
    let assembly = prop_oneof![
        place,
        name().prop_map(|n| format!("root {n}={n}")),
        (name(), dim()).prop_map(|(n, d)| format!("measure {n} = from a.b.+x  to c[2].d.2_corner within {d}")),
    ];
    let station = prop_oneof![
        block(field()).prop_map(|b| format!("camera fixed{b}")),
        block(field()).prop_map(|b| format!("vary {b}")),
        (name(), call()).prop_map(|(n, c)| format!("light {n}={c}")),
    ];
    let inspect = prop_oneof![
        (path(), args()).prop_map(|(p, a)| format!("watch {p}{a}")),
        path().prop_map(|p| format!("ignore {p}")),
        field(),
    ];
    prop_oneof![
        Just("gonogo 1".to_string()),
        Just("units\tmm   deg".to_string()),
        Just("tolerances ISO2768-m".to_string()),
        Just("use  \"parts//pin.gng\"".to_string()),
        (name(), dim()).prop_map(|(n, d)| format!("let {n} ={d}")),
        (name(), block(field())).prop_map(|(n, b)| format!("material {n}{b}")),
        (name(), block(part_statement())).prop_map(|(n, b)| format!("part {n} {b}")),
        (name(), block(assembly)).prop_map(|(n, b)| format!("assembly {n}{b}")),
        (name(), block(station)).prop_map(|(n, b)| format!("station {n}{b}")),
        block(inspect).prop_map(|b| format!("inspect {b}")),
        block(field()).prop_map(|b| format!("train{b}")),
    ]
}

fn spec() -> impl Strategy<Value = String> {
    let items = proptest::collection::vec((gap(), item(), behind()), 0..6);
    let end = select(vec!["", "\n", "\n\n\n", "// no line end", "\n// last\n\n// of all\n\n"]);
    (items, end, select(vec!["\n", "\n", "\r\n"])).prop_map(|(items, end, line_end)| {
        let text: String = items.into_iter().map(|(above, item, behind)| format!("{above}{item} {behind}\n")).collect();
        (text + end).replace('\n', line_end)
    })
}

/// The tree as data, without blank lines and with nothing but names where spans were: layout is not meaning.
fn meaning(text: &str) -> Value {
    let (file, diagnostics) = parse(text, 0);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}\n{text}");
    let mut tree = serde_json::to_value::<File>(file).unwrap();
    without_blanks(&mut tree);
    tree
}

fn without_blanks(tree: &mut Value) {
    let blank = serde_json::to_value(Gap::Blank).unwrap();
    match tree {
        Value::Array(list) => {
            list.retain(|entry| *entry != blank);
            list.iter_mut().for_each(without_blanks);
        }
        Value::Object(fields) => fields.values_mut().for_each(without_blanks),
        _ => {}
    }
}

/// The comments of a text in their order, found without the parser: from `//` outside quotes to the end of the line.
fn comments(text: &str) -> Vec<String> {
    let of_line = |line: &str| {
        let mut quoted = false;
        let at = line.char_indices().find(|(at, c)| {
            quoted ^= *c == '"';
            !quoted && line[*at..].starts_with("//")
        });
        at.map(|(at, _)| line[at..].trim_end().to_string())
    };
    text.lines().filter_map(of_line).collect()
}

fn assert_lays_out(text: &str) {
    let once = format(text).unwrap_or_else(|faults| panic!("{faults:#?}\n{text}"));
    assert_eq!(meaning(&once), meaning(text), "\n{text}\n=>\n{once}");
    assert_eq!(comments(&once), comments(text), "\n{text}\n=>\n{once}");
    assert_eq!(format(&once).unwrap(), once, "not its own layout:\n{text}");
    assert!(!once.contains(['\t', '\r']), "{once:?}");
    assert!(once.lines().all(|line| line.trim_end() == line), "blanks at the end of a line:\n{once}");
    assert!(!once.contains("\n\n\n") && !once.starts_with('\n') && !once.ends_with("\n\n"), "too many blanks:\n{once}");
}

/// Unoptimised, the generators nest deeper than the stack of a test's thread.
const STACK: usize = 64 << 20;

#[test]
fn generated_specs_are_laid_out_and_nothing_else() {
    let test = || {
        let config = ProptestConfig { source_file: Some(file!()), ..ProptestConfig::with_cases(500) };
        proptest::test_runner::TestRunner::new(config).run(&spec(), |text| {
            assert_lays_out(&text);
            Ok(())
        })
    };
    let outcome = std::thread::Builder::new().stack_size(STACK).spawn(test).unwrap().join().unwrap();
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

#[test]
fn blank_lines_at_edges_go_whatever_their_number() {
    for blanks in ["\n", "\n\n", "\n\n\n\n"] {
        let text = format!("{blanks}gonogo 1{blanks}part a {{ // open{blanks}b = 1{blanks}}}{blanks}");
        assert_lays_out(&text);
        assert_eq!(format(&text).unwrap(), "gonogo 1\n\npart a {  // open\n    b = 1\n}\n", "{text:?}");
    }
}

#[test]
fn a_comment_behind_an_argument_stays_with_it() {
    let text = "part p {\nadd a = cylinder( // the pin\n d = 6, // diameter\n h = 3 // height\n // no chamfer\n)\n}\n";
    assert_lays_out(text);
    let lines = "    add a = cylinder(\n        // the pin\n        d = 6,  // diameter\n        h = 3,  // height\n        // no chamfer\n    )\n";
    assert!(format(text).unwrap().contains(lines), "{}", format(text).unwrap());
}
