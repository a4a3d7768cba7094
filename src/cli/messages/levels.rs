//! Which warnings count: `-D warnings`, `-D W0304`, `--allow W0310`.

use crate::diag::suggest::nearest;
use crate::diag::{self, Diagnostic, Severity};

/// What `-D` takes for all warnings at once.
const ALL: &str = "warnings";

/// The diagnostics as asked for: allowed warnings are gone, denied ones are errors. What is allowed by name stays allowed
/// under `-D warnings`.
pub fn applied(diagnostics: &[Diagnostic], deny: &[String], allow: &[String]) -> Vec<Diagnostic> {
    let named = |list: &[String], d: &Diagnostic| list.iter().any(|code| code == d.code);
    let kept = diagnostics.iter().filter(|d| d.is_error() || !named(allow, d));
    let judged = |d: &Diagnostic| {
        let denied = named(deny, d) || deny.iter().any(|class| class == ALL);
        Diagnostic { severity: if denied { Severity::Error } else { d.severity }, ..d.clone() }
    };
    kept.map(judged).collect()
}

/// For clap: `warnings` or the code of a warning.
pub fn denied(text: &str) -> Result<String, String> {
    if text == ALL { Ok(text.to_string()) } else { warning(text) }
}

/// For clap: the code of a warning.
pub fn warning(text: &str) -> Result<String, String> {
    let code = text.to_ascii_uppercase();
    let is_warning = |code: &&str| code.starts_with('W');
    if diag::codes().filter(is_warning).any(|known| known == code) {
        return Ok(code);
    }
    if diag::codes().any(|known| known == code) {
        return Err("it is an error, and only warnings can be allowed or denied".to_string());
    }
    match nearest(&code, diag::codes().filter(is_warning)) {
        Some(near) => Err(format!("there is no such warning; did you mean `{near}`?")),
        None => Err("there is no such warning; `gonogo explain` lists all".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Span;

    #[test]
    fn what_is_allowed_by_name_stays_allowed() {
        let of = |code| Diagnostic::warning(code, Span::default(), "");
        let all = [of("W0304"), of("W0310"), Diagnostic::error("E0301", Span::default(), "")];
        let left = |deny: &[&str], allow: &[&str]| -> Vec<(&str, bool)> {
            let [deny, allow] = [deny, allow].map(|l| l.iter().map(|c| c.to_string()).collect::<Vec<_>>());
            applied(&all, &deny, &allow).iter().map(|d| (d.code, d.is_error())).collect()
        };
        assert_eq!(left(&[], &[]), [("W0304", false), ("W0310", false), ("E0301", true)]);
        assert_eq!(left(&["warnings"], &["W0310", "E0301"]), [("W0304", true), ("E0301", true)]);
        assert_eq!(left(&["W0310"], &[]), [("W0304", false), ("W0310", true), ("E0301", true)]);
    }

    #[test]
    fn only_warnings_that_exist_have_levels() {
        assert_eq!(denied("warnings"), Ok("warnings".into()));
        assert_eq!(warning("w0310"), Ok("W0310".into()));
        assert!(warning("E0301").unwrap_err().contains("is an error"));
        assert!(warning("W0390").unwrap_err().contains("did you mean `W03"));
        assert!(warning("warnings").is_err());
    }
}
