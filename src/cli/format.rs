//! `gonogo fmt`: specs in their one canonical layout.

use super::Exit;
use super::args::{Fmt, Global};
use super::diff;
use super::messages::{self, Messages};
use super::output::{self, DASH, Failure};
use crate::diag::Sources;
use crate::syntax;
use std::io;
use std::path::Path;

/// Lays out every spec; with `--check` only names those that would change, with `--diff` shows how.
pub fn format(args: &Fmt, global: &Global) -> Result<Exit, Failure> {
    let mut messages = Messages::new(global);
    let mut exit = Exit::Fine;
    for path in &args.specs {
        exit = exit.max(one(path, args, global, &mut messages)?);
    }
    messages.finish()?;
    Ok(exit)
}

fn one(path: &Path, args: &Fmt, global: &Global, messages: &mut Messages) -> Result<Exit, Failure> {
    let text = output::read_text(path)?;
    let laid_out = match syntax::format(&text) {
        Ok(laid_out) => laid_out,
        Err(diagnostics) => {
            let sources = Sources { files: vec![(path.display().to_string(), text)] };
            messages.add(&diagnostics, &sources)?;
            return Ok(Exit::Faults);
        }
    };
    let is_canonical = laid_out == text;
    if args.check || args.diff {
        return if is_canonical { Ok(Exit::Fine) } else { tell(path, &text, &laid_out, args, global) };
    }
    if path == Path::new(DASH) || !is_canonical {
        output::write(path, laid_out.as_bytes())?;
    }
    Ok(Exit::Fine)
}

/// What would change, and changes nothing.
fn tell(path: &Path, text: &str, laid_out: &str, args: &Fmt, global: &Global) -> Result<Exit, Failure> {
    let name = path.display().to_string();
    if args.diff {
        let diff = diff::unified(&name, text, laid_out, messages::has_colour(global, &io::stdout()));
        output::write(Path::new(DASH), diff.as_bytes())?;
    } else {
        output::line(&name)?;
    }
    Ok(Exit::Faults)
}
