//! The SARIF log against the schema that OASIS publishes.
//!
//! `tests/data/sarif-2.1.0.schema.json` is the schema of the standard's repository, unchanged, as the crate serde-sarif 0.8.0
//! carries it. It is read here by a validator of just the keywords it uses; any other keyword fails the test.

#![cfg(feature = "cli")]

use gonogo::cli::report::sarif;
use gonogo::design::load;
use serde_json::{Map, Value, json};
use std::fs;
use std::path::PathBuf;

/// What spoils a log.
type Damage = fn(&mut Value);

fn schema() -> Value {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/sarif-2.1.0.schema.json");
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn logs_of_many_faults_keep_to_the_schema() {
    let schema = schema();
    let texts = [
        "gonogo 1\nlet a = 3;\nlet b = 4 +0.1 -0.2\npart p {\n    material = steel\n",
        "gonogo 1\nlet a = b\nlet a = 3 ±0.1\nmaterial steel { metal = steel }\npart p {\n    material = stel\n    add s = box(x = a)\n}\n\
         assembly s { root p }\nstation b { light r = room() }\n",
        "gonogo 2\nuse \"nothing there.gng\"\n",
        "",
    ];
    for text in texts {
        let read = |name: &str| match name {
            "specs/a ±.gng" => Ok(text.to_string()),
            _ => Err(std::io::Error::new(std::io::ErrorKind::NotFound, "not found")),
        };
        let loaded = load("specs/a ±.gng", &read, &[]);
        assert!(!loaded.diagnostics.is_empty());
        let log: Value = serde_json::from_str(&sarif([(&loaded.sources, loaded.diagnostics.as_slice())])).unwrap();
        assert_eq!(log["runs"][0]["results"].as_array().unwrap().len(), loaded.diagnostics.len());
        assert_eq!(faults(&schema, &schema, &log, "log"), Vec::<String>::new());
    }
    let nothing: Value = serde_json::from_str(&sarif([])).unwrap();
    assert_eq!(faults(&schema, &schema, &nothing, "log"), Vec::<String>::new());
}

#[test]
fn the_validator_refuses_what_the_schema_does() {
    let schema = schema();
    let log = || -> Value { serde_json::from_str(&sarif([])).unwrap() };
    let damages: [(&str, Damage); 7] = [
        ("required", |l| drop(l.as_object_mut().unwrap().remove("version"))),
        ("enum", |l| l["version"] = json!("2.0.0")),
        ("type", |l| l["runs"][0]["results"] = json!(3)),
        ("additionalProperties", |l| l["runs"][0]["colour"] = json!("red")),
        ("minimum", |l| l["runs"][0]["results"] = json!([{ "message": { "text": "x" }, "ruleIndex": -2 }])),
        ("anyOf", |l| l["runs"][0]["results"] = json!([{ "message": {} }])),
        ("uniqueItems", |l| {
            let rule = l["runs"][0]["tool"]["driver"]["rules"][0].clone();
            l["runs"][0]["tool"]["driver"]["rules"] = json!([rule, rule]);
        }),
    ];
    for (keyword, damage) in damages {
        let mut log = log();
        damage(&mut log);
        let found = faults(&schema, &schema, &log, "log");
        assert!(found.iter().any(|f| f.contains(keyword)), "{keyword}: {found:?}");
    }
}

/// What of `value` does not keep to `schema`, a part of `root` (JSON Schema draft 7).
fn faults(root: &Value, schema: &Value, value: &Value, at: &str) -> Vec<String> {
    let rules: &Map<String, Value> = schema.as_object().expect("a schema is an object");
    if let Some(target) = rules.get("$ref").and_then(Value::as_str) {
        let target = root.pointer(target.strip_prefix('#').unwrap()).expect("a reference into the schema");
        return faults(root, target, value, at);
    }
    let mut found = Vec::new();
    for (keyword, rule) in rules {
        found.extend(broken(root, schema, keyword, rule, value, at));
    }
    found
}

fn broken(root: &Value, schema: &Value, keyword: &str, rule: &Value, value: &Value, at: &str) -> Vec<String> {
    let list = |rule: &Value| rule.as_array().unwrap().clone();
    let holds = |good: bool| if good { Vec::new() } else { vec![format!("{at}: {keyword}: {rule}")] };
    let fits = |rule: &Value| list(rule).iter().filter(|s| faults(root, s, value, at).is_empty()).count();
    match (keyword, value) {
        ("$schema" | "$id" | "title" | "description" | "default" | "definitions" | "format", _) => Vec::new(),
        ("type", _) => holds(has_type(value, rule.as_str().unwrap())),
        ("enum", _) => holds(list(rule).contains(value)),
        ("anyOf", _) => holds(fits(rule) >= 1),
        ("oneOf", _) => holds(fits(rule) == 1),
        ("minimum", Value::Number(n)) => holds(n.as_f64() >= rule.as_f64()),
        ("maximum", Value::Number(n)) => holds(n.as_f64() <= rule.as_f64()),
        ("minItems", Value::Array(items)) => holds(items.len() as u64 >= rule.as_u64().unwrap()),
        ("uniqueItems", Value::Array(items)) => holds((1..items.len()).all(|i| !items[..i].contains(&items[i]))),
        ("items", Value::Array(items)) => {
            let each = items.iter().enumerate();
            each.flat_map(|(i, item)| faults(root, rule, item, &format!("{at}[{i}]"))).collect()
        }
        ("required", Value::Object(map)) => holds(list(rule).iter().all(|key| map.contains_key(key.as_str().unwrap()))),
        ("properties", Value::Object(map)) => {
            let known = map.iter().filter_map(|(key, v)| Some((key, rule.get(key)?, v)));
            known.flat_map(|(key, rule, v)| faults(root, rule, v, &format!("{at}.{key}"))).collect()
        }
        ("additionalProperties", Value::Object(map)) => {
            let known = |key: &String| schema.get("properties").is_some_and(|p| p.get(key).is_some());
            let more = map.iter().filter(|(key, _)| !known(key));
            let refused = |(key, v): (&String, &Value)| match rule {
                Value::Bool(true) => Vec::new(),
                Value::Bool(false) => vec![format!("{at}.{key}: additionalProperties")],
                rule => faults(root, rule, v, &format!("{at}.{key}")),
            };
            more.flat_map(refused).collect()
        }
        ("pattern", Value::String(text)) => holds(matches(rule.as_str().unwrap(), text)),
        (
            "minimum"
            | "maximum"
            | "minItems"
            | "uniqueItems"
            | "items"
            | "required"
            | "properties"
            | "additionalProperties"
            | "pattern",
            _,
        ) => Vec::new(),
        (unknown, _) => panic!("the validator does not know `{unknown}`"),
    }
}

fn has_type(value: &Value, name: &str) -> bool {
    match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "boolean" => value.is_boolean(),
        other => panic!("the validator does not know the type `{other}`"),
    }
}

/// The only pattern of the schema that a log of ours meets is that of a version.
fn matches(pattern: &str, text: &str) -> bool {
    match pattern {
        "[0-9]+(\\.[0-9]+){3}" => text.split('.').count() == 4,
        other => panic!("the validator does not know the pattern `{other}` of `{text}`"),
    }
}
