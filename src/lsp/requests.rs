//! Requests by method: parameters to what is asked about, answers to JSON.

use super::desk::Desk;
use super::server::{Fault, INVALID_PARAMS, METHOD_NOT_FOUND, REQUEST_FAILED, Server, params};
use super::{complete, fixes, hints, hover, layout, outline, rename, uri};
use crate::design::{library, path_beside};
use lsp_types::{
    CodeActionParams, CompletionParams, DocumentFormattingParams, DocumentHighlight, DocumentSymbolParams,
    DocumentSymbolResponse, ExecuteCommandParams, GotoDefinitionParams, HoverParams, InlayHintParams, Location, Range,
    ReferenceParams, RenameParams, SemanticTokens, SemanticTokensParams, SymbolInformation, TextDocumentPositionParams,
    TextEdit, Uri, WorkspaceEdit, WorkspaceSymbolParams,
};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// The command that returns the page of a diagnostic, `["E0305"]`, or a file of the parts library, `["std/iso2338"]`.
pub const EXPLAIN: &str = "gonogo.explain";

/// More names than this answer no search.
const MAX_FOUND: usize = 256;

pub fn answer(server: &mut Server, method: &str, value: Value) -> Result<Value, Fault> {
    match method {
        "textDocument/hover" => json(hover_at(server, params::<HoverParams>(value)?)),
        "textDocument/completion" => json(completion(server, params::<CompletionParams>(value)?)),
        "textDocument/signatureHelp" => json(signature(server, params::<lsp_types::SignatureHelpParams>(value)?)),
        "textDocument/definition" => json(definition(server, params::<GotoDefinitionParams>(value)?)),
        "textDocument/references" => json(references(server, params::<ReferenceParams>(value)?)),
        "textDocument/documentHighlight" => {
            json(highlights(server, params::<lsp_types::DocumentHighlightParams>(value)?))
        }
        "textDocument/documentSymbol" => json(symbols(server, params::<DocumentSymbolParams>(value)?)),
        "workspace/symbol" => json(search(server, &params::<WorkspaceSymbolParams>(value)?.query)),
        "textDocument/codeAction" => json(fixes::actions(server, &params::<CodeActionParams>(value)?)),
        "textDocument/formatting" => json(formatting(server, params::<DocumentFormattingParams>(value)?)),
        "textDocument/prepareRename" => json(prepare(server, params::<TextDocumentPositionParams>(value)?)),
        "textDocument/rename" => json(renamed(server, params::<RenameParams>(value)?)?),
        "textDocument/inlayHint" => json(inlay(server, params::<InlayHintParams>(value)?)),
        "textDocument/semanticTokens/full" => json(colours(server, params::<SemanticTokensParams>(value)?)),
        "workspace/executeCommand" => explain(&params::<ExecuteCommandParams>(value)?),
        _ => Err(Fault::new(METHOD_NOT_FOUND, format!("`{method}` is not known here"))),
    }
}

fn json<T: Serialize>(answer: T) -> Result<Value, Fault> {
    serde_json::to_value(answer).map_err(|e| Fault::new(REQUEST_FAILED, e.to_string()))
}

/// A place in an open text: its file's name, and the offset.
fn place(desk: &Desk, at: &TextDocumentPositionParams) -> Option<(String, usize)> {
    let name = uri::name(&at.text_document.uri);
    let offset = desk.open.get(&name)?.text.offset(at.position);
    Some((name, offset))
}

fn hover_at(server: &mut Server, params: HoverParams) -> Option<lsp_types::Hover> {
    let (name, offset) = place(&server.desk, &params.text_document_position_params)?;
    let (project, file) = server.desk.project_of(&name)?;
    hover::hover(&project, file, offset)
}

fn completion(server: &mut Server, params: CompletionParams) -> Option<Vec<lsp_types::CompletionItem>> {
    let (name, offset) = place(&server.desk, &params.text_document_position)?;
    let (project, file) = server.desk.project_of(&name)?;
    let files = usable(&server.desk, &name);
    let text = &server.desk.open.get(&name)?.text;
    Some(complete::complete(&project, text, file, offset, &files))
}

/// What `use` may take in a file: other files of the workspace, from its folder.
fn usable(desk: &Desk, name: &str) -> Vec<String> {
    let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
    let beside = |other: &String| {
        let mut up = String::new();
        let mut at = folder;
        loop {
            if let Some(rest) = other.strip_prefix(at).and_then(|rest| rest.strip_prefix('/')) {
                return Some(format!("{up}{rest}"));
            }
            at = at.rsplit_once('/')?.0;
            up += "../";
        }
    };
    let own = desk.known().filter(|other| *other != name).filter_map(beside);
    own.chain(library::files().map(|(name, _)| name.to_string())).collect()
}

fn signature(server: &mut Server, params: lsp_types::SignatureHelpParams) -> Option<lsp_types::SignatureHelp> {
    let (name, offset) = place(&server.desk, &params.text_document_position_params)?;
    hints::signature(server.desk.open.get(&name)?.text.as_str(), offset)
}

fn definition(server: &mut Server, params: GotoDefinitionParams) -> Option<Location> {
    let (name, offset) = place(&server.desk, &params.text_document_position_params)?;
    let (project, file) = server.desk.project_of(&name)?;
    let library = server.frame().explains;
    used_file(&project, file, offset, library).or_else(|| rename::definition(&project, file, offset, library))
}

/// The file that a `use` at a place names.
fn used_file(project: &super::project::Project, file: u32, offset: usize, library: bool) -> Option<Location> {
    let tree = project.survey.trees.get(file as usize)?;
    let name = tree.lines.iter().find_map(|line| match &line.stmt {
        crate::syntax::ast::Stmt::Use(name)
            if (name.span.start as usize..=name.span.end as usize).contains(&offset) =>
        {
            Some(name)
        }
        _ => None,
    })?;
    if library::is_meant(&name.text) {
        return Some(Location::new(uri::library_address(&name.text).filter(|_| library)?, Range::default()));
    }
    let used = path_beside(project.name(file), &name.text);
    project.file(&used)?;
    Some(Location::new(uri::address(&used)?, Range::default()))
}

fn references(server: &mut Server, params: ReferenceParams) -> Option<Vec<Location>> {
    let (name, offset) = place(&server.desk, &params.text_document_position)?;
    let (project, file) = server.desk.project_of(&name)?;
    let mention = project.named_at(file, offset).into_iter().next()?;
    let target = rename::Target::of(&project, mention.symbol);
    let mut found: Vec<Location> = Vec::new();
    for root in server.desk.readers(target.file()) {
        let project = server.desk.project(&root);
        for location in rename::references(&project, &target, params.context.include_declaration) {
            if !found.contains(&location) {
                found.push(location);
            }
        }
    }
    Some(found)
}

fn highlights(server: &mut Server, params: lsp_types::DocumentHighlightParams) -> Option<Vec<DocumentHighlight>> {
    let (name, offset) = place(&server.desk, &params.text_document_position_params)?;
    let (project, file) = server.desk.project_of(&name)?;
    let mention = project.named_at(file, offset).into_iter().next()?;
    let text = project.text(file)?;
    let here = project.index().mentions_of(mention.symbol).filter(|m| m.span.file == file);
    Some(here.map(|m| DocumentHighlight { range: text.range_of(m.span), kind: None }).collect())
}

fn symbols(server: &mut Server, params: DocumentSymbolParams) -> Option<DocumentSymbolResponse> {
    let (project, file) = server.desk.project_of(&uri::name(&params.text_document.uri))?;
    Some(DocumentSymbolResponse::Nested(outline::symbols(&project, file)))
}

/// Names of the open specs that contain the letters asked for.
// The protocol's structure still has a field that it has taken back.
#[allow(deprecated)]
fn search(server: &mut Server, query: &str) -> Vec<SymbolInformation> {
    let query = query.to_lowercase();
    let mut found = Vec::new();
    for root in server.desk.all_roots() {
        let project = server.desk.project(&root);
        let named = project.index().symbols.iter().filter(|s| s.name.to_lowercase().contains(&query));
        found.extend(named.filter_map(|symbol| {
            Some(SymbolInformation {
                name: symbol.name.clone(),
                kind: outline::kind(symbol.kind),
                tags: None,
                deprecated: None,
                location: project.location(symbol.span)?,
                container_name: Some(symbol.kind.word().to_string()),
            })
        }));
    }
    found.truncate(MAX_FOUND);
    found
}

fn formatting(server: &mut Server, params: DocumentFormattingParams) -> Option<Vec<TextEdit>> {
    let name = uri::name(&params.text_document.uri);
    layout::edits(&server.desk.open.get(&name)?.text)
}

fn prepare(server: &mut Server, params: TextDocumentPositionParams) -> Option<Range> {
    let (name, offset) = place(&server.desk, &params)?;
    let (project, file) = server.desk.project_of(&name)?;
    let (_, span) = rename::subject(&project, file, offset)?;
    Some(project.text(file)?.range_of(span))
}

fn renamed(server: &mut Server, params: RenameParams) -> Result<WorkspaceEdit, Fault> {
    let refused = |why: String| Fault::new(REQUEST_FAILED, why);
    let nothing = || refused("there is no name here".to_string());
    let (name, offset) = place(&server.desk, &params.text_document_position).ok_or_else(nothing)?;
    let (project, file) = server.desk.project_of(&name).ok_or_else(nothing)?;
    let (symbol, _) = rename::subject(&project, file, offset).ok_or_else(nothing)?;
    let target = rename::Target::of(&project, symbol);
    if uri::address(target.file()).is_none() {
        return Err(refused(format!("`{}` is not yours to change", target.file())));
    }
    let mut all: BTreeMap<String, Vec<TextEdit>> = BTreeMap::new();
    for root in server.desk.readers(target.file()) {
        let project = server.desk.project(&root);
        let edits = rename::rename(&project, &root, &target, &params.new_name, &|name| server.desk.text_of(name));
        for (name, edits) in edits.map_err(refused)? {
            let here = all.entry(name).or_default();
            edits.into_iter().for_each(|edit| {
                if !here.contains(&edit) {
                    here.push(edit)
                }
            });
        }
    }
    Ok(edit_of(all))
}

/// Edits by file name as the protocol has them.
pub fn edit_of(edits: BTreeMap<String, Vec<TextEdit>>) -> WorkspaceEdit {
    // The protocol's type asks for a hash map with addresses as keys.
    #[allow(clippy::mutable_key_type)]
    let changes: std::collections::HashMap<Uri, Vec<TextEdit>> =
        edits.into_iter().filter_map(|(name, edits)| Some((uri::address(&name)?, edits))).collect();
    WorkspaceEdit { changes: Some(changes), ..WorkspaceEdit::default() }
}

fn inlay(server: &mut Server, params: InlayHintParams) -> Option<Vec<lsp_types::InlayHint>> {
    let (project, file) = server.desk.project_of(&uri::name(&params.text_document.uri))?;
    Some(hints::inlay(&project, file, params.range))
}

fn colours(server: &mut Server, params: SemanticTokensParams) -> Option<SemanticTokens> {
    let (project, file) = server.desk.project_of(&uri::name(&params.text_document.uri))?;
    Some(SemanticTokens { result_id: None, data: outline::colours(&project, file) })
}

fn explain(params: &ExecuteCommandParams) -> Result<Value, Fault> {
    let code = params.arguments.first().and_then(Value::as_str);
    match (params.command.as_str(), code) {
        (EXPLAIN, Some(code)) => hover::page(code)
            .or_else(|| library::text(code))
            .map(Value::from)
            .ok_or_else(|| Fault::new(INVALID_PARAMS, format!("there is no diagnostic `{code}`"))),
        (EXPLAIN, None) => Err(Fault::new(INVALID_PARAMS, "the command takes the code of a diagnostic")),
        (other, _) => Err(Fault::new(INVALID_PARAMS, format!("there is no command `{other}`"))),
    }
}
