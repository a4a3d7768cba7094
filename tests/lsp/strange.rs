//! Messages that make no sense, places that are nowhere and texts that are no specs.

use crate::editor::Editor;
use serde_json::json;

/// All requests that take a place in a text.
const METHODS: [&str; 13] = [
    "textDocument/hover",
    "textDocument/completion",
    "textDocument/signatureHelp",
    "textDocument/definition",
    "textDocument/references",
    "textDocument/documentHighlight",
    "textDocument/documentSymbol",
    "textDocument/codeAction",
    "textDocument/formatting",
    "textDocument/prepareRename",
    "textDocument/rename",
    "textDocument/inlayHint",
    "textDocument/semanticTokens/full",
];

#[test]
fn messages_that_make_no_sense_are_answered() {
    let mut editor = Editor::new();
    editor.open("/w/a.gng", "gonogo 1\nlet a = 1\n");
    let wrong = [json!(null), json!(7), json!("x"), json!([]), json!({}), json!({ "textDocument": { "uri": 1 } })];
    for method in METHODS.iter().chain(&["workspace/symbol", "workspace/executeCommand"]) {
        for params in &wrong {
            assert!(editor.raw(method, params.clone()).is_err(), "{method} {params}");
        }
    }
    // Texts that are not open, and places that are nowhere.
    let far = json!({ "line": 4_000_000_000_u32, "character": 4_000_000_000_u32 });
    for uri in ["file:///w/a.gng", "file:///w/none.gng", "untitled:Untitled-1", "file://host/%ff"] {
        for method in METHODS {
            let params = json!({
                "textDocument": { "uri": uri }, "position": far, "newName": "b", "options": { "tabSize": 4, "insertSpaces": true },
                "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1, "isRetrigger": false }, "range": { "start": far, "end": far },
            });
            let answer = editor.raw(method, params);
            assert!(answer.is_ok() || method == "textDocument/rename", "{method} {uri}: {answer:?}");
        }
    }
    assert!(editor.raw("initialize", json!({})).is_err());
}

#[test]
fn texts_that_were_never_saved_have_answers() {
    let mut editor = Editor::new();
    let text = "gonogo 1\nlet a = 6 H7\nlet b = (a * 2)\n";
    let document = json!({ "uri": "untitled:Untitled-1", "languageId": "gonogo", "version": 1, "text": text });
    editor.notify("textDocument/didOpen", json!({ "textDocument": document }));
    let at = json!({ "textDocument": { "uri": "untitled:Untitled-1" }, "position": { "line": 2, "character": 9 } });
    let hover = editor.raw("textDocument/hover", at).unwrap();
    assert!(hover["contents"]["value"].as_str().unwrap().contains("6.000 … 6.012 mm"), "{hover}");
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(24))]

    /// A spec cut and pasted at random has answers everywhere.
    #[test]
    fn no_text_and_no_place_is_too_strange(
        at in 0.0f64..1.0,
        cut in 0usize..60,
        paste in proptest::sample::select(vec!["", "(", "{", "}", "±µ🔩", " \n", "part x {\n add y = ", "on gear.", "// ", "\"", "\r"]),
        places in proptest::collection::vec((0u32..200, 0u32..90), 4),
    ) {
        let text = include_str!("../../specs/pinned_plate.gng");
        let start = text.floor_char_boundary((at * text.len() as f64) as usize);
        let end = text.ceil_char_boundary((start + cut).min(text.len()));
        let mut editor = Editor::new();
        editor.open("/w/a.gng", &format!("{}{paste}{}", &text[..start], &text[end..]));
        for (line, character) in places {
            let position = json!({ "line": line, "character": character });
            for method in METHODS {
                let params = json!({
                    "textDocument": { "uri": "file:///w/a.gng" }, "position": position, "newName": "other",
                    "options": { "tabSize": 4, "insertSpaces": true },
                    "context": { "includeDeclaration": true, "diagnostics": [], "triggerKind": 1, "isRetrigger": false },
                    "range": { "start": position, "end": position },
                });
                let answer = editor.raw(method, params);
                proptest::prop_assert!(answer.is_ok() || method == "textDocument/rename", "{method}: {answer:?}");
            }
        }
    }
}
