//! One JSON object a line, for programs: code, severity, message, labels and fixes with byte offsets and with 1-based lines
//! and columns, help, notes. Keys are only ever added.

use super::place::Place;
use super::word;
use crate::diag::{Diagnostic, Edit, Fix, Label, Sources, Span};
use serde_json::{Value, json};

/// The lines; `_colour` is for the others of its kind.
pub fn json(sources: &Sources, diagnostics: &[Diagnostic], _colour: bool) -> String {
    diagnostics.iter().map(|d| format!("{}\n", object(sources, d))).collect()
}

fn object(sources: &Sources, d: &Diagnostic) -> Value {
    let labels: Vec<Value> = d.labels.iter().map(|l| label(sources, l)).collect();
    let fixes: Vec<Value> = d.fixes.iter().map(|f| fix(sources, f)).collect();
    json!({
        "code": d.code, "severity": word(d.severity), "message": d.message,
        "labels": labels, "help": d.help, "notes": d.notes, "fixes": fixes,
    })
}

fn label(sources: &Sources, label: &Label) -> Value {
    let mut value = place(sources, label.span);
    value["text"] = json!(label.text);
    value["primary"] = json!(label.primary);
    value
}

fn fix(sources: &Sources, fix: &Fix) -> Value {
    let edit = |edit: &Edit| {
        let mut value = place(sources, edit.span);
        value["text"] = json!(edit.text);
        value
    };
    let edits: Vec<Value> = fix.edits.iter().map(edit).collect();
    json!({ "title": fix.title, "applicability": fix.applicability, "edits": edits })
}

fn place(sources: &Sources, span: Span) -> Value {
    let place = Place::of(sources, span);
    json!({
        "file": place.file, "start": span.start, "end": span.end, "line": place.line, "column": place.column,
        "end_line": place.end_line, "end_column": place.end_column,
    })
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;

    #[test]
    fn there_is_one_object_a_line() {
        let (sources, diagnostics) = example();
        let value: Value = serde_json::from_str(&json(&sources, &diagnostics, false)).unwrap();
        assert_eq!(value["code"], "E0202");
        assert_eq!(value["labels"][1]["line"], 2);
        assert_eq!(value["labels"][0]["primary"], true);
        let fix = &value["fixes"][0];
        assert_eq!((&fix["applicability"], &fix["edits"][0]["text"]), (&json!("maybe-incorrect"), &json!("a_2")));
        assert_eq!((&fix["edits"][0]["start"], &fix["edits"][0]["end_column"]), (&json!(29), &json!(6)));
    }
}
