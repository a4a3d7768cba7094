//! An editor without a screen, for tests: it keeps texts, counts positions by itself, and asks the server.

#![allow(dead_code)]

use gonogo::lsp::Server;
use serde_json::{Value, json};
use std::collections::BTreeMap;

pub const WHEEL: &str = "file:///specs/pattern_wheel.gng";

/// The position of an offset: lines by their `\n`, letters by their UTF-16 units.
pub fn position(text: &str, offset: usize) -> Value {
    let line = text[..offset].matches('\n').count();
    let start = text[..offset].rfind('\n').map_or(0, |at| at + 1);
    json!({ "line": line, "character": text[start..offset].encode_utf16().count() })
}

fn offset(text: &str, position: &Value) -> usize {
    let line = position["line"].as_u64().unwrap() as usize;
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    let units: Vec<u16> = text[start..].encode_utf16().take(position["character"].as_u64().unwrap() as usize).collect();
    start + String::from_utf16(&units).unwrap().len()
}

/// A text after edits, as the protocol has them: none meet.
pub fn applied(text: &str, edits: &[Value]) -> String {
    let mut places: Vec<(usize, usize, &str)> = edits
        .iter()
        .map(|e| (offset(text, &e["range"]["start"]), offset(text, &e["range"]["end"]), e["newText"].as_str().unwrap()))
        .collect();
    places.sort();
    let mut text = text.to_string();
    places.iter().rev().for_each(|(start, end, new)| text.replace_range(*start..*end, new));
    text
}

pub struct Editor {
    server: Server,
    texts: BTreeMap<String, String>,
    disk: BTreeMap<String, String>,
    shown: BTreeMap<String, Vec<Value>>,
    version: i64,
}

fn uri(file: &str) -> String {
    format!("file://{file}")
}

impl Editor {
    pub fn new() -> Editor {
        Editor::with_files(&[])
    }

    /// With files on a disk of its own.
    pub fn with_files(files: &[(&str, String)]) -> Editor {
        let disk: BTreeMap<String, String> = files.iter().map(|(n, t)| (n.to_string(), t.clone())).collect();
        let copy = disk.clone();
        let missing = || std::io::Error::from(std::io::ErrorKind::NotFound);
        let mut server = Server::new(Box::new(move |name| copy.get(name).cloned().ok_or_else(missing)));
        server.request("initialize", json!({})).unwrap();
        server.know(disk.keys().cloned().collect());
        Editor { server, texts: BTreeMap::new(), disk, shown: BTreeMap::new(), version: 0 }
    }

    pub fn disk(&self, file: &str) -> String {
        self.disk[file].clone()
    }

    pub fn notify(&mut self, method: &str, params: Value) {
        self.server.notification(method, params).unwrap();
        for (_, params) in self.server.refresh() {
            let file = params["uri"].as_str().unwrap().trim_start_matches("file://").to_string();
            self.shown.insert(file, params["diagnostics"].as_array().unwrap().clone());
        }
    }

    pub fn open(&mut self, file: &str, text: &str) {
        self.version += 1;
        self.texts.insert(file.to_string(), text.to_string());
        let document = json!({ "uri": uri(file), "languageId": "gonogo", "version": self.version, "text": text });
        self.notify("textDocument/didOpen", json!({ "textDocument": document }));
    }

    pub fn change(&mut self, file: &str, old: &str, new: &str) {
        self.version += 1;
        let text = self.texts.get_mut(file).unwrap();
        let at = text.find(old).unwrap();
        let range = json!({ "start": position(text, at), "end": position(text, at + old.len()) });
        *text = text.replacen(old, new, 1);
        let document = json!({ "uri": uri(file), "version": self.version });
        let change = json!([{ "range": range, "text": new }]);
        self.notify("textDocument/didChange", json!({ "textDocument": document, "contentChanges": change }));
    }

    pub fn close(&mut self, file: &str) {
        self.notify("textDocument/didClose", json!({ "textDocument": { "uri": uri(file) } }));
    }

    /// The diagnostics on the screen.
    pub fn shown(&self, file: &str) -> Vec<Value> {
        self.shown.get(file).cloned().unwrap_or_default()
    }

    pub fn raw(&mut self, method: &str, params: Value) -> Result<Value, String> {
        self.server.request(method, params).map_err(|fault| fault.message)
    }

    /// A request about a file.
    pub fn ask(&mut self, method: &str, file: &str, mut params: Value) -> Value {
        params["textDocument"] = json!({ "uri": uri(file) });
        self.raw(method, params).unwrap()
    }

    /// The parameters of a request at the first letter of a text's first `needle`.
    fn at(&self, file: &str, needle: &str) -> Value {
        let text = &self.texts[file];
        let at = text.find(needle).unwrap_or_else(|| panic!("no `{needle}` in {file}"));
        json!({ "position": position(text, at) })
    }

    pub fn hover(&mut self, file: &str, needle: &str) -> String {
        let hover = self.ask("textDocument/hover", file, self.at(file, needle));
        hover["contents"]["value"].as_str().unwrap_or_default().to_string()
    }

    pub fn signature(&mut self, file: &str, needle: &str) -> Value {
        let mut at = self.at(file, needle);
        let character = at["position"]["character"].as_u64().unwrap() + "from = ".len() as u64;
        at["position"]["character"] = json!(character);
        self.ask("textDocument/signatureHelp", file, at)
    }

    /// The line where what is named at `needle` is defined.
    pub fn definition_line(&mut self, file: &str, needle: &str) -> String {
        let found = self.ask("textDocument/definition", file, self.at(file, needle));
        let target =
            found["uri"].as_str().unwrap_or_else(|| panic!("nothing at {needle}")).trim_start_matches("file://");
        let line = found["range"]["start"]["line"].as_u64().unwrap() as usize;
        self.texts[target].lines().nth(line).unwrap().trim().to_string()
    }

    pub fn references(&mut self, file: &str, needle: &str) -> Vec<(String, Value)> {
        let mut at = self.at(file, needle);
        at["context"] = json!({ "includeDeclaration": true });
        let found = self.ask("textDocument/references", file, at);
        let place =
            |l: &Value| (l["uri"].as_str().unwrap().trim_start_matches("file://").to_string(), l["range"].clone());
        found.as_array().unwrap().iter().map(place).collect()
    }

    /// The texts that a rename changes, as they are then.
    pub fn rename(&mut self, file: &str, needle: &str, new: &str) -> Result<BTreeMap<String, String>, String> {
        let mut params = self.at(file, needle);
        params["textDocument"] = json!({ "uri": uri(file) });
        params["newName"] = json!(new);
        let edit = self.raw("textDocument/rename", params)?;
        let changes = edit["changes"].as_object().unwrap().iter();
        Ok(changes
            .map(|(uri, edits)| {
                let name = uri.trim_start_matches("file://").to_string();
                let text = self.texts.get(&name).unwrap_or_else(|| &self.disk[&name]);
                let changed = applied(text, edits.as_array().unwrap());
                (name, changed)
            })
            .collect())
    }

    /// The labels of what is proposed at an offset.
    pub fn complete(&mut self, file: &str, at: usize) -> Vec<String> {
        let position = position(&self.texts[file], at);
        let found = self.ask("textDocument/completion", file, json!({ "position": position }));
        let label = |item: &Value| item["label"].as_str().unwrap().to_string();
        found.as_array().unwrap_or(&Vec::new()).iter().map(label).collect()
    }

    /// The code actions at `needle`.
    pub fn actions(&mut self, file: &str, needle: &str) -> Vec<Value> {
        let at = self.at(file, needle)["position"].clone();
        let params = json!({ "range": { "start": at, "end": at }, "context": { "diagnostics": [] } });
        self.ask("textDocument/codeAction", file, params).as_array().unwrap().clone()
    }

    pub fn text(&self, file: &str) -> &str {
        &self.texts[file]
    }
}
