//! Completions for shells, and manual pages: both made from the one description of the command line.

use super::Exit;
use super::args::Cli;
use super::output::{self, Failure};
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct Completions {
    /// The shell to complete for.
    pub shell: Shell,
}

#[derive(Debug, Args)]
pub struct Man {
    /// Where the pages go: `gonogo.1` and one a command.
    pub dir: PathBuf,
}

/// Prints a script of completions.
pub fn completions(args: &Completions) -> Result<Exit, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "gonogo", &mut script);
    output::line(String::from_utf8_lossy(&script).trim_end())?;
    Ok(Exit::Fine)
}

/// Writes the manual pages.
pub fn man(args: &Man) -> Result<Exit, Failure> {
    output::make_dir(&args.dir)?;
    let mut root = Cli::command().disable_help_subcommand(true);
    root.build();
    pages(&root, "gonogo", args)?;
    Ok(Exit::Fine)
}

/// The page of a command and those of the commands below it.
fn pages(command: &clap::Command, name: &str, args: &Man) -> Result<(), Failure> {
    let mut page = Vec::new();
    let rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
    rendered.map_err(|e| Failure(format!("cannot write the page of `{name}`: {e}")))?;
    output::write(&args.dir.join(format!("{name}.1")), &page)?;
    let below = command.get_subcommands().filter(|c| !c.is_hide_set());
    below.into_iter().try_for_each(|c| pages(c, &format!("{name}-{}", c.get_name()), args))
}
