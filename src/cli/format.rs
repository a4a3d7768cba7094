//! `gonogo fmt`: specs in their one canonical layout.

use super::Exit;
use super::args::{Fmt, Global};
use super::messages;
use super::output::{self, DASH, Failure};
use crate::diag::Sources;
use crate::syntax;
use std::path::Path;

/// Lays out every spec; with `--check` only names those that would change.
pub fn format(args: &Fmt, global: &Global) -> Result<Exit, Failure> {
    let mut exit = Exit::Fine;
    for path in &args.specs {
        exit = exit.max(one(path, args.check, global)?);
    }
    Ok(exit)
}

fn one(path: &Path, check: bool, global: &Global) -> Result<Exit, Failure> {
    let text = output::read_text(path)?;
    let laid_out = match syntax::format(&text) {
        Ok(laid_out) => laid_out,
        Err(diagnostics) => {
            let sources = Sources { files: vec![(path.display().to_string(), text)] };
            messages::print(&diagnostics, &sources, global)?;
            return Ok(Exit::Faults);
        }
    };
    let is_canonical = laid_out == text;
    match (check, path == Path::new(DASH)) {
        (true, _) if is_canonical => Ok(Exit::Fine),
        (true, _) => output::line(&path.display().to_string()).map(|()| Exit::Faults),
        (false, true) => output::write(path, laid_out.as_bytes()).map(|()| Exit::Fine),
        (false, false) if is_canonical => Ok(Exit::Fine),
        (false, false) => output::write(path, laid_out.as_bytes()).map(|()| Exit::Fine),
    }
}
