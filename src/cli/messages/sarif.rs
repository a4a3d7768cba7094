//! SARIF 2.1.0 (OASIS Standard): one log for all specs of a run, with rules, related places and fixes.

use super::place::Place;
use super::word;
use crate::diag::{self, Diagnostic, Edit, Fix, Label, Sources, Span};
use serde_json::{Value, json};

/// The log of what was found in each spec, also when it is nothing: a code scanner closes what is not there any more.
pub fn sarif<'a>(found: impl IntoIterator<Item = (&'a Sources, &'a [Diagnostic])>) -> String {
    let results: Vec<Value> =
        found.into_iter().flat_map(|(sources, list)| list.iter().map(|d| result(sources, d))).collect();
    let driver = json!({ "name": "gonogo", "semanticVersion": env!("CARGO_PKG_VERSION"), "rules": rules() });
    let run = json!({ "tool": { "driver": driver }, "columnKind": "unicodeCodePoints", "results": results });
    let log = json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [run],
    });
    format!("{log:#}\n")
}

/// Every code with its page, so that `ruleIndex` never moves between runs.
fn rules() -> Vec<Value> {
    let rule = |code: &'static str| {
        let level = if code.starts_with('W') { "warning" } else { "error" };
        let page = diag::explain(code).unwrap_or_default().trim_end();
        json!({
            "id": code, "shortDescription": { "text": diag::title(code).unwrap_or_default() },
            "help": { "text": page, "markdown": page }, "defaultConfiguration": { "level": level },
        })
    };
    diag::codes().map(rule).collect()
}

fn result(sources: &Sources, d: &Diagnostic) -> Value {
    let (primary, related): (Vec<&Label>, Vec<&Label>) = d.labels.iter().partition(|l| l.primary);
    let mut text = d.message.clone();
    let more = d.notes.iter().map(|note| format!("note: {note}")).chain(d.help.iter().map(|h| format!("help: {h}")));
    more.for_each(|line| text = format!("{text}\n{line}"));
    let mut value = json!({
        "ruleId": d.code, "level": word(d.severity), "message": { "text": text },
        "locations": primary.iter().map(|l| location(sources, l)).collect::<Vec<_>>(),
    });
    if let Some(index) = diag::codes().position(|code| code == d.code) {
        value["ruleIndex"] = json!(index);
    }
    if !related.is_empty() {
        value["relatedLocations"] = related.iter().map(|l| location(sources, l)).collect();
    }
    if !d.fixes.is_empty() {
        value["fixes"] = d.fixes.iter().map(|f| fix(sources, f)).collect();
    }
    value
}

fn location(sources: &Sources, label: &Label) -> Value {
    let (artifact, region) = (artifact(sources, label.span), region(sources, label.span));
    let mut value = json!({ "physicalLocation": { "artifactLocation": artifact, "region": region } });
    if !label.text.is_empty() {
        value["message"] = json!({ "text": label.text });
    }
    value
}

fn fix(sources: &Sources, fix: &Fix) -> Value {
    let mut files: Vec<u32> = fix.edits.iter().map(|e| e.span.file).collect();
    files.sort_unstable();
    files.dedup();
    let replacement =
        |edit: &Edit| json!({ "deletedRegion": region(sources, edit.span), "insertedContent": { "text": edit.text } });
    let change = |file: u32| {
        let edits = fix.edits.iter().filter(|e| e.span.file == file);
        let replacements: Vec<Value> = edits.map(replacement).collect();
        let whole = Span { file, ..Span::default() };
        json!({ "artifactLocation": artifact(sources, whole), "replacements": replacements })
    };
    let changes: Vec<Value> = files.into_iter().map(change).collect();
    json!({ "description": { "text": fix.title }, "artifactChanges": changes })
}

fn artifact(sources: &Sources, span: Span) -> Value {
    json!({ "uri": uri(sources.files.get(span.file as usize).map_or("", |(name, _)| name)) })
}

fn region(sources: &Sources, span: Span) -> Value {
    let Place { line, column, end_line, end_column, .. } = Place::of(sources, span);
    json!({ "startLine": line, "startColumn": column, "endLine": end_line, "endColumn": end_column })
}

/// A path as a URI reference (RFC 3986): relative unless it begins at the root.
fn uri(path: &str) -> String {
    let mut uri = String::from(if path.starts_with('/') { "file://" } else { "" });
    for byte in path.replace('\\', "/").bytes() {
        match byte {
            b'/' | b'-' | b'.' | b'_' | b'~' => uri.push(byte.into()),
            _ if byte.is_ascii_alphanumeric() => uri.push(byte.into()),
            _ => uri += &format!("%{byte:02X}"),
        }
    }
    uri
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;

    #[test]
    fn a_result_has_its_rule_its_places_and_its_fix() {
        let (sources, diagnostics) = example();
        let log: Value = serde_json::from_str(&sarif([(&sources, diagnostics.as_slice())])).unwrap();
        let run = &log["runs"][0];
        let result = &run["results"][0];
        let index = result["ruleIndex"].as_u64().unwrap() as usize;
        assert_eq!(run["tool"]["driver"]["rules"][index]["id"], "E0202");
        let region = &result["locations"][0]["physicalLocation"]["region"];
        assert_eq!(*region, json!({ "startLine": 3, "startColumn": 5, "endLine": 3, "endColumn": 6 }));
        let change = &result["fixes"][0]["artifactChanges"][0];
        assert_eq!(change["artifactLocation"]["uri"], "plate.gng");
        assert_eq!(change["replacements"][0]["insertedContent"]["text"], "a_2");
    }

    #[test]
    fn paths_are_uris() {
        assert_eq!(uri("specs/a b±.gng"), "specs/a%20b%C2%B1.gng");
        assert_eq!(uri("/tmp/a.gng"), "file:///tmp/a.gng");
        assert_eq!(uri(r"parts\pin.gng"), "parts/pin.gng");
    }
}
