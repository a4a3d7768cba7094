//! How long people wait for the language: `cargo bench --bench language`.
//!
//! A generated spec of 10,000 lines is read and laid out; the pattern wheel is checked; and an editor types into the long
//! spec and waits for its diagnostics.

use gonogo::artifacts::Artifact;
use gonogo::assembly::piece::Shelf;
use gonogo::{Options, compile, design, lsp, syntax};
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::io::{BufRead, BufReader, Read as _, Write as _};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;

/// Lines of the generated spec, about.
const LINES: usize = 10_000;
const WHEEL: &str = include_str!("../specs/pattern_wheel.gng");

fn main() {
    divan::main();
}

/// A tower of plates, each a part of 20 lines and a placement of 4.
fn long_spec() -> String {
    let plates = LINES / 24;
    let mut text = "gonogo 1\n\nunits mm deg\ntolerances ISO2768-m\n\nmaterial steel {\n    metal = steel\n}\n\nlet width = 20 ±0.1\n\n".to_string();
    for i in 1..=plates {
        writeln!(
            text,
            "// Plate {i} of the tower, ±0.1 where nothing else is said.\npart plate_{i} {{\n    material = steel\n\n    let t = 4 ±0.05\n\n    add slab  = box(x = (width * 2), y = 30 ±0.2, z = t)\n    cut bore  = 3x cylinder(d = 6 H7, h = through) on circle(d = 18 basic, from = 90 deg)\n    cut slot  = 4x box(x = 2 +0.1/0 each, y = 1.5 ±0.05, z = through) at (0, 12, 0) on line(pitch = 4)  // slots\n    cut screw = counterbore(d = 3.4, h = through, head_d = 6.5, head_h = 2) at (-15, 0, t)\n\n    outline lip {{\n        from (0, 0)\n        line to (5, 0) round 1\n        line edge to (5, 3)\n        line to (0, 3)\n    }}\n    add rim = prism(outline = lip, h = 2 ±0.1) at (10, 5, (t - 1))\n}}\n"
        )
        .unwrap();
    }
    text += "assembly tower {\n    root plate_1\n";
    for i in 2..=plates {
        writeln!(text, "    place plate_{i} on plate_{} {{\n        z  = 4 ±0.05\n        rz = 0 ±0.1\n    }}", i - 1)
            .unwrap();
    }
    text + "}\n\nstation bench {\n    light room = room(power = 1 ±10 %)\n}\n"
}

#[divan::bench]
fn parse_10_000_lines(bencher: divan::Bencher) {
    let text = long_spec();
    assert_eq!(syntax::parse(&text, 0).1, []);
    let lines = divan::counter::ItemsCount::new(text.lines().count());
    bencher.counter(lines).bench(|| syntax::parse(&text, 0));
}

#[divan::bench]
fn fmt_10_000_lines(bencher: divan::Bencher) {
    let text = long_spec();
    bencher.bench(|| syntax::format(&text));
}

#[divan::bench]
fn design_10_000_lines(bencher: divan::Bencher) {
    let text = long_spec();
    bencher.bench(|| design::load("tower.gng", &|_| Ok(text.clone()), &[]));
}

#[divan::bench]
fn check_pattern_wheel(bencher: divan::Bencher) {
    let options = Options { wanted: BTreeSet::from([Artifact::View]), ..Options::default() };
    bencher.bench(|| compile("pattern_wheel.gng", &|_| Ok(WHEEL.to_string()), &options, &|_| {}));
}

/// What follows a pause in typing: all stages of `check`, after a change in one of ten parts; with the solids that an editor's
/// server keeps, and without.
#[divan::bench(args = [true, false])]
fn check_again_after_a_change(bencher: divan::Bencher, keeps: bool) {
    let shelf = keeps.then(Arc::<Shelf>::default);
    let round = Cell::new(0);
    bencher.bench_local(|| {
        round.set(round.get() + 1);
        let text = WHEEL.replacen("length = 33.2", &format!("length = 33.{}", 2 + round.get() % 2), 1);
        let options = Options { shelf: shelf.clone(), ..Options::default() };
        compile("pattern_wheel.gng", &|_| Ok(text.clone()), &options, &|_| {})
    });
}

/// From the keystroke to the diagnostics, without the pipe.
#[divan::bench]
fn keystroke_in_10_000_lines(bencher: divan::Bencher) {
    let missing = |_: &str| Err(std::io::Error::from(std::io::ErrorKind::NotFound));
    let mut server = lsp::Server::new(Box::new(missing));
    server.request("initialize", serde_json::json!({})).unwrap();
    server.notification("textDocument/didOpen", opened()).unwrap();
    server.refresh();
    let (server, mut version) = (RefCell::new(server), 1);
    bencher
        .with_inputs(|| {
            version += 1;
            typed(version)
        })
        .bench_local_values(|change| {
            server.borrow_mut().notification("textDocument/didChange", change).unwrap();
            server.borrow_mut().refresh()
        });
}

/// The same through the program and its pipes, as an editor waits for it.
#[divan::bench]
fn keystroke_in_10_000_lines_over_pipes(bencher: divan::Bencher) {
    let session = RefCell::new(Session::start());
    let mut version = 1;
    bencher.bench_local(|| {
        version += 1;
        session.borrow_mut().keystroke(version);
    });
}

const URI: &str = "file:///tower.gng";

fn opened() -> serde_json::Value {
    let document = serde_json::json!({ "uri": URI, "languageId": "gonogo", "version": 1, "text": long_spec() });
    serde_json::json!({ "textDocument": document })
}

/// A digit typed into the second plate, and taken away again by the next keystroke.
fn typed(version: i64) -> serde_json::Value {
    let (line, character) = (37, 43);
    let end = character + (version % 2);
    let range = serde_json::json!({ "start": { "line": line, "character": character }, "end": { "line": line, "character": end } });
    let text = if version % 2 == 0 { "1" } else { "" };
    serde_json::json!({ "textDocument": { "uri": URI, "version": version }, "contentChanges": [{ "range": range, "text": text }] })
}

struct Session {
    child: Child,
    out: BufReader<ChildStdout>,
}

impl Session {
    fn start() -> Session {
        let program =
            Command::new(env!("CARGO_BIN_EXE_gonogo")).arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = program.unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        let mut session = Session { child, out };
        session.send(serde_json::json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": {} }));
        session.receive();
        session.send(serde_json::json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": opened() }));
        session.wait_for(1);
        session
    }

    fn keystroke(&mut self, version: i64) {
        let params = typed(version);
        self.send(serde_json::json!({ "jsonrpc": "2.0", "method": "textDocument/didChange", "params": params }));
        self.wait_for(version);
    }

    fn wait_for(&mut self, version: i64) {
        while self.receive()["params"]["version"] != version {}
    }

    fn send(&mut self, message: serde_json::Value) {
        let text = message.to_string();
        let input = self.child.stdin.as_mut().unwrap();
        write!(input, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        input.flush().unwrap();
    }

    fn receive(&mut self) -> serde_json::Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            self.out.read_line(&mut line).unwrap();
            match line.trim_end().strip_prefix("Content-Length: ") {
                Some(n) => length = n.parse().unwrap(),
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.out.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        self.child.wait().ok();
    }
}
