//! The server without its wires: messages in, answers and notifications out.
//!
//! In: methods and parameters of the protocol as JSON, and what the slow stages found. Out: results as JSON, or why there
//! are none. A message that makes no sense is answered with an error and changes nothing.

use super::desk::{Desk, Disk};
use super::report::{self, Board, Frame};
use super::requests;
use super::text::Text;
use super::uri;
use crate::diag::{Diagnostic, Sources};
use lsp_types::{
    CompletionOptions, DidChangeTextDocumentParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
    DidSaveTextDocumentParams, InlayHintServerCapabilities, OneOf, PublishDiagnosticsParams, RenameOptions,
    SemanticTokenModifier, SemanticTokensFullOptions, SemanticTokensLegend, SemanticTokensOptions, ServerCapabilities,
    SignatureHelpOptions, TextDocumentSyncCapability, TextDocumentSyncKind, TextDocumentSyncOptions,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Why a request has no result: a code of JSON-RPC, and words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    pub code: i32,
    pub message: String,
}

pub const INVALID_REQUEST: i32 = -32600;
pub const METHOD_NOT_FOUND: i32 = -32601;
pub const INVALID_PARAMS: i32 = -32602;
pub const NOT_INITIALIZED: i32 = -32002;
pub const REQUEST_FAILED: i32 = -32803;

impl Fault {
    pub fn new(code: i32, message: impl Into<String>) -> Fault {
        Fault { code, message: message.into() }
    }
}

/// Parameters of a request, or why they are none.
pub fn params<P: DeserializeOwned>(value: Value) -> Result<P, Fault> {
    serde_json::from_value(value).map_err(|e| Fault::new(INVALID_PARAMS, e.to_string()))
}

/// A method with its parameters, for the client.
pub type Notice = (&'static str, Value);

/// A spec to be put through the slow stages, with the open texts as they were.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    pub root: String,
    /// Of the texts: what was found is of no use once they have changed.
    pub revision: u64,
    pub texts: BTreeMap<String, String>,
}

/// What the slow stages found in a spec.
struct Checked {
    diagnostics: Vec<Diagnostic>,
    sources: Sources,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Life {
    New,
    Running,
    ShutDown,
}

pub struct Server {
    pub(super) desk: Desk,
    frame: Frame,
    life: Life,
    /// Counts changes of texts.
    revision: u64,
    /// What the slow stages found, by spec; of the texts as they are.
    checked: BTreeMap<String, Checked>,
    /// What the client shows.
    shown: Board,
    /// Texts that changed since diagnostics were last sent.
    touched: BTreeSet<String>,
}

impl Server {
    /// A server that reads files through `disk`.
    pub fn new(disk: Disk) -> Server {
        Server {
            desk: Desk::new(disk),
            frame: Frame::default(),
            life: Life::New,
            revision: 0,
            checked: BTreeMap::new(),
            shown: Board::new(),
            touched: BTreeSet::new(),
        }
    }

    /// Whether the client has said goodbye in due form.
    pub fn is_shut_down(&self) -> bool {
        self.life == Life::ShutDown
    }

    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The specs of the workspace, for what uses what.
    pub fn know(&mut self, files: Vec<String>) {
        self.desk.know(files);
    }

    pub fn request(&mut self, method: &str, value: Value) -> Result<Value, Fault> {
        match (self.life, method) {
            (Life::New, "initialize") => self.initialize(&value),
            (Life::New, _) => Err(Fault::new(NOT_INITIALIZED, "the first request is `initialize`")),
            (Life::ShutDown, _) => Err(Fault::new(INVALID_REQUEST, "the server is shut down")),
            (Life::Running, "initialize") => Err(Fault::new(INVALID_REQUEST, "the server is initialized already")),
            (Life::Running, "shutdown") => {
                self.life = Life::ShutDown;
                Ok(Value::Null)
            }
            (Life::Running, method) => requests::answer(self, method, value),
        }
    }

    /// Parameters that make no sense are taken for those of a client that knows more than we do.
    fn initialize(&mut self, value: &Value) -> Result<Value, Fault> {
        self.frame.explains = value["initializationOptions"]["explainLinks"] == json!(true);
        self.life = Life::Running;
        let server = json!({ "name": "gonogo", "version": env!("CARGO_PKG_VERSION") });
        let capabilities = serde_json::to_value(capabilities());
        let capabilities = capabilities.map_err(|e| Fault::new(REQUEST_FAILED, e.to_string()))?;
        Ok(json!({ "capabilities": capabilities, "serverInfo": server }))
    }

    /// What the client tells. Whether a text was saved, so that the slow stages need not wait for a pause.
    pub fn notification(&mut self, method: &str, value: Value) -> Result<bool, Fault> {
        if self.life != Life::Running {
            return Ok(false);
        }
        match method {
            "textDocument/didOpen" => self.opened(params(value)?),
            "textDocument/didChange" => self.changed(params(value)?)?,
            "textDocument/didClose" => self.closed(&params(value)?),
            "textDocument/didSave" => {
                let _: DidSaveTextDocumentParams = params(value)?;
                return Ok(true);
            }
            _ => {}
        }
        Ok(false)
    }

    fn opened(&mut self, params: DidOpenTextDocumentParams) {
        let name = uri::name(&params.text_document.uri);
        self.touch(&name);
        self.desk.put(name, Text::new(params.text_document.text), params.text_document.version);
    }

    fn changed(&mut self, params: DidChangeTextDocumentParams) -> Result<(), Fault> {
        let name = uri::name(&params.text_document.uri);
        let edit = |text: &mut Text| params.content_changes.iter().for_each(|change| text.change(change));
        let done = self.desk.edit(&name, params.text_document.version, edit);
        done.ok_or_else(|| Fault::new(INVALID_PARAMS, format!("`{name}` is not open")))?;
        self.touch(&name);
        Ok(())
    }

    fn closed(&mut self, params: &DidCloseTextDocumentParams) {
        let name = uri::name(&params.text_document.uri);
        self.desk.close(&name);
        self.touch(&name);
    }

    fn touch(&mut self, name: &str) {
        self.revision += 1;
        self.touched.insert(name.to_string());
        // What was found stands at places that may have moved.
        self.checked.clear();
    }

    /// Runs the quick stages over what has changed: the diagnostics that the client has to show differently.
    pub fn refresh(&mut self) -> Vec<Notice> {
        if self.touched.is_empty() {
            return Vec::new();
        }
        let mut board = Board::new();
        for root in self.desk.all_roots() {
            let found = report::of_project(&self.desk.project(&root), self.frame);
            merge(&mut board, found);
        }
        self.publish(board)
    }

    /// The specs for the slow stages: those of open texts with an assembly and nothing wrong so far.
    pub fn jobs(&mut self) -> Vec<Job> {
        let texts = self.desk.open.iter().map(|(name, document)| (name.clone(), document.text.as_str().to_string()));
        let texts: BTreeMap<String, String> = texts.collect();
        let mut jobs = Vec::new();
        for root in self.desk.all_roots() {
            let project = self.desk.project(&root);
            if project.survey.loaded.design.is_some() && !self.checked.contains_key(&root) {
                jobs.push(Job { root, revision: self.revision, texts: texts.clone() });
            }
        }
        jobs
    }

    /// Takes what the slow stages found: the diagnostics that the client has to show differently.
    pub fn checked(&mut self, job: &Job, diagnostics: Vec<Diagnostic>, sources: Sources) -> Vec<Notice> {
        if job.revision != self.revision {
            return Vec::new();
        }
        self.checked.insert(job.root.clone(), Checked { diagnostics, sources });
        let mut board = Board::new();
        for root in self.desk.all_roots() {
            let found = match self.checked.get(&root) {
                Some(checked) => report::of(&checked.diagnostics, &checked.sources, self.frame),
                None => report::of_project(&self.desk.project(&root), self.frame),
            };
            merge(&mut board, found);
        }
        self.publish(board)
    }

    /// The diagnostics of the specs of a file as far as they are known: with the texts that they point into.
    pub(super) fn found(&mut self, name: &str) -> Vec<(Vec<Diagnostic>, Sources)> {
        let mut found = Vec::new();
        for root in self.desk.roots(name).into_iter().take(1) {
            let project = self.desk.project(&root);
            found.push(match self.checked.get(&root) {
                Some(checked) => (checked.diagnostics.clone(), checked.sources.clone()),
                None => (project.survey.loaded.diagnostics.clone(), project.survey.loaded.sources.clone()),
            });
        }
        found
    }

    pub(super) fn frame(&self) -> Frame {
        self.frame
    }

    fn publish(&mut self, board: Board) -> Vec<Notice> {
        let empty = Vec::new();
        let names: BTreeSet<&String> = board.keys().chain(self.shown.keys()).chain(&self.touched).collect();
        let mut notices = Vec::new();
        for name in names {
            let [old, new] = [&self.shown, &board].map(|b| b.get(name).unwrap_or(&empty));
            if old == new && !self.touched.contains(name) {
                continue;
            }
            let Some(uri) = uri::address(name) else { continue };
            let version = self.desk.open.get(name).map(|document| document.version);
            let params = PublishDiagnosticsParams { uri, diagnostics: new.clone(), version };
            notices.extend(serde_json::to_value(params).map(|value| ("textDocument/publishDiagnostics", value)));
        }
        self.touched.clear();
        self.shown = board;
        notices
    }
}

/// One fault of a file that two specs use is shown once.
fn merge(board: &mut Board, found: Board) {
    for (name, diagnostics) in found {
        let here = board.entry(name).or_default();
        for diagnostic in diagnostics {
            if !here.contains(&diagnostic) {
                here.push(diagnostic);
            }
        }
    }
}

fn capabilities() -> ServerCapabilities {
    let legend = SemanticTokensLegend {
        token_types: super::outline::COLOURS.to_vec(),
        token_modifiers: vec![SemanticTokenModifier::DECLARATION],
    };
    let characters = |list: &[&str]| Some(list.iter().map(|c| c.to_string()).collect());
    ServerCapabilities {
        text_document_sync: Some(TextDocumentSyncCapability::Options(TextDocumentSyncOptions {
            open_close: Some(true),
            change: Some(TextDocumentSyncKind::INCREMENTAL),
            save: Some(lsp_types::TextDocumentSyncSaveOptions::Supported(true)),
            ..TextDocumentSyncOptions::default()
        })),
        hover_provider: Some(true.into()),
        completion_provider: Some(CompletionOptions {
            trigger_characters: characters(&[".", "(", "\"", " "]),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: characters(&["(", ","]),
            ..SignatureHelpOptions::default()
        }),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        workspace_symbol_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(true.into()),
        document_formatting_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: Default::default(),
        })),
        inlay_hint_provider: Some(OneOf::Right(InlayHintServerCapabilities::Options(Default::default()))),
        semantic_tokens_provider: Some(
            SemanticTokensOptions {
                legend,
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..SemanticTokensOptions::default()
            }
            .into(),
        ),
        execute_command_provider: Some(lsp_types::ExecuteCommandOptions {
            commands: vec![requests::EXPLAIN.to_string()],
            ..Default::default()
        }),
        ..ServerCapabilities::default()
    }
}
