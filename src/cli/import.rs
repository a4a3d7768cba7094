//! `gonogo import`: designs of other tools as parts of this language.

use super::Exit;
use super::args::{Global, Import};
use super::messages;
use super::output::{self, DASH, Failure};
use crate::diag::Sources;
use std::path::Path;

/// Writes the part that a `.csg` file draws; nothing when anything in it has no counterpart.
pub fn import(args: &Import, global: &Global) -> Result<Exit, Failure> {
    let text = output::read_text(&args.design)?;
    let file = if args.design == Path::new(DASH) { "<stdin>".to_string() } else { args.design.display().to_string() };
    let name = args.name.clone().unwrap_or_else(|| name_of(&args.design));
    match crate::import::openscad(&text, &file_name(&args.design), &name) {
        Ok(part) => {
            output::write(args.output.as_deref().unwrap_or(Path::new(DASH)), part.as_bytes())?;
            Ok(Exit::Fine)
        }
        Err(diagnostics) => {
            messages::print(&diagnostics, &Sources { files: vec![(file, text)] }, global)?;
            Ok(Exit::Faults)
        }
    }
}

fn file_name(path: &Path) -> String {
    match path.file_name() {
        Some(name) if path != Path::new(DASH) => name.to_string_lossy().into_owned(),
        _ => "standard input".to_string(),
    }
}

/// The part is called like its file, with what a name cannot hold as underscores.
fn name_of(path: &Path) -> String {
    let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let name = name.trim_matches('_').to_ascii_lowercase();
    match name.chars().next() {
        None => "part_1".to_string(),
        Some(first) if first.is_ascii_digit() => format!("part_{name}"),
        // Words that may stand behind a value are no names.
        Some(_) if ["on", "at", "turn", "basic", "each"].contains(&name.as_str()) => format!("{name}_part"),
        Some(_) => name,
    }
}
