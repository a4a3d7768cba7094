//! What editors show in the text without being asked: limits behind fits and general tolerances, and the arguments of the
//! call that is being typed.

use super::context::context;
use super::numbers::{limits, unit};
use super::project::Project;
use super::words::Owner;
use crate::syntax::ast::{Size, Tolerance};
use lsp_types::{
    InlayHint, InlayHintLabel, InlayHintTooltip, ParameterInformation, ParameterLabel, Range, SignatureHelp,
    SignatureInformation,
};

/// Limits behind the dimensions of a range that have a fit class, or no tolerance but the general one.
pub fn inlay(project: &Project, file: u32, range: Range) -> Vec<InlayHint> {
    let Some(text) = project.text(file) else { return Vec::new() };
    let (start, end) = (text.offset(range.start), text.offset(range.end));
    let mut hints = Vec::new();
    project.each_dim(file, &mut |site| {
        let dim = site.dim;
        if (dim.span.end as usize) < start || dim.span.start as usize > end {
            return;
        }
        let origin = match (&dim.tolerance, &dim.size) {
            (Some(Tolerance::Fit(_)), _) => "ISO 286",
            (None, Size::Quantity(_)) => "general tolerance",
            _ => return,
        };
        let Some(reading) = project.reading(dim.span).filter(|r| r.range.low < r.range.high) else { return };
        hints.push(InlayHint {
            position: text.position(dim.span.end as usize),
            label: InlayHintLabel::String(limits(reading)),
            kind: None,
            text_edits: None,
            tooltip: Some(InlayHintTooltip::String(format!("{origin},{}", unit(reading.quantity)))),
            padding_left: Some(true),
            padding_right: None,
            data: None,
        });
    });
    hints
}

/// The arguments of the call that a place lies in.
pub fn signature(text: &str, offset: usize) -> Option<SignatureHelp> {
    let here = context(text, offset);
    let owner: &Owner = here.call.as_ref().and_then(|_| here.owner())?;
    let key = here.words.first().copied();
    let active = key.and_then(|key| owner.arguments.iter().position(|a| a.name == key)).map(|i| i as u32);
    let parameters = owner.arguments.iter().map(|a| ParameterInformation {
        label: ParameterLabel::Simple(a.name.to_string()),
        documentation: Some(lsp_types::Documentation::String(format!("{} ({})", a.doc, a.takes.unit()))),
    });
    let signature = SignatureInformation {
        label: owner.signature(),
        documentation: Some(lsp_types::Documentation::String(owner.doc.to_string())),
        parameters: Some(parameters.collect()),
        active_parameter: active,
    };
    Some(SignatureHelp { signatures: vec![signature], active_signature: Some(0), active_parameter: active })
}
