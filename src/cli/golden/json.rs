//! `gonogo golden … --message-format json`: one object a line on standard output, for programs.
//!
//! In: what was found about a golden. Out: a line with its file, its verdict and every difference; and one at the end with
//! the count of each. Keys are only ever added; `reason` tells these lines from diagnostics.

use crate::cli::output::{self, Failure};
use crate::golden::{Allowed, Difference};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// What is known about one golden.
pub struct Said<'a> {
    pub spec: &'a Path,
    pub golden: &'a Path,
    /// `contacts`; nothing where no stage writes it.
    pub stage: Option<&'static str>,
    /// `equal`, `differs`, `missing`, `stale`, `unclear`, `stranger`.
    pub verdict: &'static str,
    /// Why an `unclear` one is that.
    pub why: Option<&'a str>,
    pub differences: &'a [Difference],
    /// Where the new output was kept.
    pub kept: Option<&'a Path>,
    pub diff: Option<String>,
    /// What `bless` did or would do about it.
    pub done: Option<&'static str>,
}

/// How many goldens got each verdict, in a fixed order of keys.
#[derive(Default)]
pub struct Counts(BTreeMap<&'static str, usize>);

impl Counts {
    /// Prints the line of a golden and counts it.
    pub fn say(&mut self, said: &Said) -> Result<(), Failure> {
        *self.0.entry(said.verdict).or_default() += 1;
        output::line(&object(said).to_string())
    }

    /// Prints the last line: `more` is what the command adds.
    pub fn finish(&self, more: &[(&str, Value)]) -> Result<(), Failure> {
        const VERDICTS: [&str; 6] = ["equal", "differs", "missing", "stale", "unclear", "stranger"];
        let mut all = json!({ "reason": "golden-summary" });
        for verdict in VERDICTS {
            all[verdict] = json!(self.0.get(verdict).copied().unwrap_or(0));
        }
        for (key, value) in more {
            all[*key] = value.clone();
        }
        output::line(&all.to_string())
    }
}

fn object(said: &Said) -> Value {
    let differences: Vec<Value> = said.differences.iter().map(difference).collect();
    json!({
        "reason": "golden", "spec": said.spec, "file": said.golden, "stage": said.stage, "verdict": said.verdict,
        "message": said.why, "differences": differences, "kept": said.kept, "diff": said.diff, "done": said.done,
    })
}

fn difference(difference: &Difference) -> Value {
    let tolerance = match difference.allowed {
        None => Value::Null,
        Some(Allowed::Number(t)) => json!({ "absolute": t.absolute, "share": t.share }),
        Some(Allowed::Picture(t)) => json!({ "mean": t.mean, "most": t.most }),
    };
    json!({
        "path": difference.path, "expected": difference.blessed, "actual": difference.now, "tolerance": tolerance,
    })
}
