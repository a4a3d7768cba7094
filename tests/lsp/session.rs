//! A session with the program over its pipes, as an editor has it.

use crate::editor::{self, WHEEL, position};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

/// The program at the other end of a pipe.
struct Session {
    child: Child,
    out: BufReader<ChildStdout>,
    next: i64,
    /// Notifications that came while something else was waited for.
    kept: Vec<Value>,
}

impl Session {
    fn start() -> Session {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        let child = command.arg("lsp").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
        let mut child = child.spawn().unwrap();
        let out = BufReader::new(child.stdout.take().unwrap());
        Session { child, out, next: 0, kept: Vec::new() }
    }

    fn send(&mut self, message: &Value) {
        let text = message.to_string();
        let input = self.child.stdin.as_mut().unwrap();
        write!(input, "Content-Length: {}\r\n\r\n{text}", text.len()).unwrap();
        input.flush().unwrap();
    }

    fn receive(&mut self) -> Value {
        let mut length = 0;
        loop {
            let mut line = String::new();
            assert!(self.out.read_line(&mut line).unwrap() > 0, "the server has closed its pipe");
            match line.trim_end().split_once(": ") {
                Some(("Content-Length", n)) => length = n.parse().unwrap(),
                Some(_) => {}
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.out.read_exact(&mut bytes).unwrap();
        serde_json::from_slice(&bytes).unwrap()
    }

    fn notify(&mut self, method: &str, params: Value) {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }));
    }

    /// The whole response.
    fn ask(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }));
        loop {
            let message = self.receive();
            if message["id"] == json!(id) {
                return message;
            }
            self.kept.push(message);
        }
    }

    fn result(&mut self, method: &str, params: Value) -> Value {
        let response = self.ask(method, params);
        assert!(response["error"].is_null(), "{method}: {response}");
        response["result"].clone()
    }

    /// The next diagnostics of a text in a version that `wanted` likes.
    fn diagnostics(&mut self, version: i64, wanted: impl Fn(&[Value]) -> bool) -> Vec<Value> {
        let mut early = std::mem::take(&mut self.kept).into_iter();
        loop {
            let message = early.next().unwrap_or_else(|| self.receive());
            let is_it =
                message["method"] == "textDocument/publishDiagnostics" && message["params"]["version"] == version;
            if let (true, Some(list)) = (is_it, message["params"]["diagnostics"].as_array())
                && wanted(list)
            {
                return list.clone();
            }
        }
    }
}

/// An edit of the text: the server is told, and the text follows.
fn type_over(session: &mut Session, text: &mut String, version: i64, old: &str, new: &str) {
    let at = text.find(old).unwrap();
    let range = json!({ "start": position(text, at), "end": position(text, at + old.len()) });
    *text = text.replacen(old, new, 1);
    session.notify(
        "textDocument/didChange",
        json!({ "textDocument": { "uri": WHEEL, "version": version }, "contentChanges": [{ "range": range, "text": new }] }),
    );
}

#[test]
fn a_session_over_pipes() {
    let mut session = Session::start();
    let refused = session.ask("textDocument/hover", json!({}));
    assert_eq!(refused["error"]["code"], -32002);
    let capabilities = session.result("initialize", json!({ "processId": null, "rootUri": null, "capabilities": {} }));
    assert_eq!(capabilities["capabilities"]["renameProvider"]["prepareProvider"], true);
    session.notify("initialized", json!({}));

    let mut text = include_str!("../../specs/pattern_wheel.gng").to_string();
    let document = json!({ "uri": WHEEL, "languageId": "gonogo", "version": 1, "text": text });
    session.notify("textDocument/didOpen", json!({ "textDocument": document }));
    assert_eq!(session.diagnostics(1, |_| true), Vec::<Value>::new(), "the quick stages find nothing");
    // The slow stages begin by themselves when nothing is typed.
    let slow = session.diagnostics(1, |list| !list.is_empty());
    assert!(slow.iter().all(|d| d["code"] == "W0502" && d["severity"] == 2), "{slow:#?}");

    // Broken, and mended.
    type_over(&mut session, &mut text, 2, "material = brass\n", "material = bras\n");
    let broken = session.diagnostics(2, |_| true);
    assert_eq!((broken.len(), &broken[0]["code"]), (1, &json!("E0201")), "{broken:#?}");
    assert!(broken[0]["message"].as_str().unwrap().contains("help: did you mean `brass`?"), "{broken:#?}");
    type_over(&mut session, &mut text, 3, "material = bras\n", "material = brass // ±µ🔩\n");
    assert_eq!(session.diagnostics(3, |_| true), Vec::<Value>::new());
    session.notify("textDocument/didSave", json!({ "textDocument": { "uri": WHEEL } }));
    assert_eq!(session.diagnostics(3, |list| !list.is_empty()).len(), slow.len());

    let at = |text: &str, needle: &str, skip: usize| json!({ "textDocument": { "uri": WHEEL }, "position": position(text, text.find(needle).unwrap() + skip) });
    let hover = session.result("textDocument/hover", at(&text, "4 +0.012/0 each", 0));
    let said = hover["contents"]["value"].as_str().unwrap();
    assert!(said.contains("4.000 … 4.012 mm") && said.contains("MMC 4.000, LMC 4.012"), "{said}");
    let definition = session.result("textDocument/definition", at(&text, "on wheel_a1.hd_hole", 4));
    let expected = position(&text, text.find("place wheel_a1 on").unwrap() + "place ".len());
    assert_eq!(definition["range"]["start"], expected);

    let mut rename = at(&text, "let gear_height", 5);
    rename["newName"] = json!("height_of_gear");
    let edits = session.result("textDocument/rename", rename.clone());
    let edits = edits["changes"][WHEEL].as_array().unwrap().clone();
    assert_eq!(edits.len(), text.matches("gear_height").count());
    rename["newName"] = json!("each");
    let refused = session.ask("textDocument/rename", rename);
    assert_eq!(refused["error"]["message"], "`each` is a word of the language");

    type_over(&mut session, &mut text, 4, "    root gear\n", "root   gear\n\n\n");
    session.diagnostics(4, |_| true);
    let options = json!({ "tabSize": 4, "insertSpaces": true });
    let edits =
        session.result("textDocument/formatting", json!({ "textDocument": { "uri": WHEEL }, "options": options }));
    let laid_out = editor::applied(&text, edits.as_array().unwrap());
    assert_eq!(laid_out, gonogo::syntax::format(&text).unwrap());

    let malformed = session.ask("textDocument/hover", json!({ "textDocument": 7 }));
    assert_eq!(malformed["error"]["code"], -32602, "{malformed}");
    assert_eq!(session.ask("no/such", json!(null))["error"]["code"], -32601);
    session.notify("textDocument/didChange", json!([1, 2, 3]));
    assert_eq!(session.result("shutdown", json!(null)), Value::Null);
    session.notify("exit", json!(null));
    assert!(session.child.wait().unwrap().success());
}

#[test]
fn a_client_that_goes_without_a_word_is_noticed() {
    let mut session = Session::start();
    drop(session.child.stdin.take());
    assert_eq!(session.child.wait().unwrap().code(), Some(1));
}
