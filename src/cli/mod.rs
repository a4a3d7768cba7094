//! The command line: the only place that prints, reads arguments, and knows terminals, files and clocks.
//!
//! In: arguments. Out: files, text and an exit code. Judges and computes nothing itself.

mod args;
mod compile;
mod demo;
mod deps;
mod diff;
mod fix;
mod font;
mod format;
mod golden;
mod import;
mod judge;
mod keep;
mod library;
mod lsp;
mod messages;
mod output;
mod overlay;
mod photos;
mod progress;
mod prove;
/// The formats by the name they were first known under.
pub mod report {
    pub use super::messages::{github, human, json, sarif, short};
}
mod report_page;
mod rig;
mod shells;
mod timings;
mod verdict;
mod watch;

use crate::diag;
use args::{Cli, Command, Explain, Golden};
use clap::Parser;
use output::Failure;
use std::process::ExitCode;

/// What the exit code says. `inspect`: all go, a no-go, something could not be judged; others: fine, diagnostics, usage or
/// the outside world. Ordered: the worst of several is their maximum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    Fine = 0,
    Faults = 1,
    Trouble = 2,
}

/// Runs the program.
pub fn main() -> ExitCode {
    let exit = match Cli::try_parse() {
        Ok(cli) => run(&cli).unwrap_or_else(|Failure(why)| {
            output::remark(&judge::coded(&why));
            Exit::Trouble
        }),
        Err(usage) => {
            // Help and version are no errors; clap knows where each belongs.
            let _ = usage.print();
            if usage.use_stderr() { Exit::Trouble } else { Exit::Fine }
        }
    };
    ExitCode::from(exit as u8)
}

fn run(cli: &Cli) -> Result<Exit, Failure> {
    let global = &cli.global;
    match &cli.command {
        Command::Compile(args) => compile::compile(args, global),
        Command::Check(args) => compile::check(args, global),
        Command::Fmt(args) => format::format(args, global),
        Command::Calibrate(args) => judge::calibrate(args),
        Command::Inspect(args) => judge::inspect(args, global),
        Command::Report(args) => report_page::report(args, global),
        Command::Prove(args) => prove::prove(args, global),
        Command::Explain(args) => explain(args),
        Command::Golden(Golden::Check(args)) => golden::check(args, global),
        Command::Golden(Golden::Bless(args)) => golden::bless(args, global),
        Command::Import(args) => import::import(args, global),
        Command::Std(args) => library::std(args, global),
        Command::Demo(args) => demo::demo(args, global),
        Command::Lsp(_) => lsp::lsp(),
        Command::Completions(args) => shells::completions(args),
        Command::Man(args) => shells::man(args),
    }
}

/// Prints the page of a diagnostic, or all codes by one line each.
fn explain(args: &Explain) -> Result<Exit, Failure> {
    let Some(code) = args.code.as_ref().map(|code| code.to_ascii_uppercase()) else {
        diag::codes()
            .try_for_each(|code| output::line(&format!("{code}  {}", diag::title(code).unwrap_or_default())))?;
        return Ok(Exit::Fine);
    };
    let Some(page) = diag::explain(&code) else {
        let near = match diag::suggest::nearest(&code, diag::codes()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`gonogo explain` lists all".to_string(),
        };
        return Err(Failure(format!("there is no diagnostic `{}`; {near}", args.code.as_deref().unwrap_or_default())));
    };
    output::line(page.trim_end())?;
    Ok(Exit::Fine)
}
