//! Diagnostics: what is wrong with a spec, as data.
//!
//! A stage returns what it could make and a list of these. Nothing here prints; `cli` renders them.

mod explain;
mod fix;
pub mod suggest;

pub use explain::{codes, explain, title};
pub use fix::{Applicability, Edit, Fix, apply};

use serde::Serialize;

/// A stretch of bytes in one source file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize)]
pub struct Span {
    /// Which file: an index into [`Sources`]; 0 is the spec itself.
    pub file: u32,
    pub start: u32,
    pub end: u32,
}

/// The texts that the spans point into, in the order they were read.
#[derive(Debug, Clone, Default)]
pub struct Sources {
    /// (name as the user gave it, text).
    pub files: Vec<(String, String)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub enum Severity {
    Error,
    Warning,
}

/// A place that takes part in a diagnostic, with what is to be said about it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Label {
    pub span: Span,
    pub text: String,
    pub primary: bool,
}

/// One fault or doubt, in the user's names and numbers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// `E0305`, `W0502`: the key of its page in `gonogo explain`.
    pub code: &'static str,
    pub severity: Severity,
    pub message: String,
    pub labels: Vec<Label>,
    /// What to do about it, in words; the title of the first fix where there is one.
    pub help: Option<String>,
    pub notes: Vec<String>,
    /// Changes of the text that mend it; the first is the most likely.
    pub fixes: Vec<Fix>,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn error(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, span, message.into())
    }

    /// A warning at `span`.
    pub fn warning(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, span, message.into())
    }

    fn new(code: &'static str, severity: Severity, span: Span, message: String) -> Self {
        let labels = vec![Label { span, text: String::new(), primary: true }];
        Diagnostic { code, severity, message, labels, help: None, notes: Vec::new(), fixes: Vec::new() }
    }

    /// What the primary label says beside the source.
    pub fn label(mut self, text: impl Into<String>) -> Self {
        self.labels[0].text = text.into();
        self
    }

    /// A second place that matters.
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into(), primary: false });
        self
    }

    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help = Some(text.into());
        self
    }

    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// The one change that mends it: safe to make without asking.
    pub fn fix(self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.with_fix(Fix::new(title, Applicability::MachineApplicable).edit(span, text))
    }

    /// A change that mends it if it is what was meant.
    pub fn suggest(self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.with_fix(Fix::new(title, Applicability::MaybeIncorrect).edit(span, text))
    }

    /// The name that was probably meant.
    pub fn meant(self, span: Span, name: &str) -> Self {
        self.suggest(format!("did you mean `{name}`?"), span, name)
    }

    /// Adds a fix; its title is the help unless something else was said.
    pub fn with_fix(mut self, fix: Fix) -> Self {
        self.help.get_or_insert_with(|| fix.title.clone());
        self.fixes.push(fix);
        self
    }

    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
