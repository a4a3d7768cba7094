//! `--watch`: the work is done again whenever a file that it read has changed.
//!
//! By looking four times a second at what the files hold. Specs are few and small, so that costs next to nothing, and it
//! works alike on network drives, in containers, and with editors that replace a file instead of writing it, where change
//! notices of the system do not.

use super::deps::Input;
use super::output::{self, DASH, Failure};
use super::{Exit, judge};
use clap::Args;
use std::io::{IsTerminal, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(250);

#[derive(Debug, Args)]
pub struct Watch {
    /// Do it again whenever a spec or a file that it uses changes; ends when standard input does, if that is no terminal.
    #[arg(long)]
    pub watch: bool,
    /// Stop watching after so many rounds.
    #[arg(long, value_name = "N", requires = "watch")]
    pub rounds: Option<u64>,
}

/// What a round came to: how it ended, and what it looked at.
pub struct Round {
    pub exit: Result<Exit, Failure>,
    pub inputs: Vec<Input>,
    /// `2 errors, 1 warning`.
    pub summary: String,
}

impl Watch {
    /// Does `round` once, or again and again; the exit code is the last round's.
    pub fn run(&self, specs: &[PathBuf], mut round: impl FnMut() -> Round) -> Result<Exit, Failure> {
        if !self.watch {
            return round().exit;
        }
        if specs.iter().any(|spec| spec == Path::new(DASH)) {
            return Err(Failure("standard input cannot be watched: name the spec's file".into()));
        }
        let ended = end_of_input();
        let mut number = 0;
        loop {
            number += 1;
            let start = Instant::now();
            let Round { exit, mut inputs, summary } = round();
            let exit = exit.unwrap_or_else(|Failure(why)| {
                output::remark(&judge::coded(&why));
                Exit::Trouble
            });
            // A spec that could not be read is waited for.
            let unread = specs.iter().filter(|spec| !inputs.iter().any(|i| i.path == **spec));
            let unread: Vec<Input> = unread.map(|spec| Input::now(spec)).collect();
            inputs.extend(unread);
            let seconds = start.elapsed().as_secs_f64();
            output::remark(&format!("round {number}: {summary} in {seconds:.2} s; watching {}", files(&inputs)));
            if self.rounds.is_some_and(|rounds| number >= rounds) || !wait(&inputs, &ended) {
                return Ok(exit);
            }
        }
    }
}

fn files(inputs: &[Input]) -> String {
    match inputs.len() {
        1 => "1 file".into(),
        n => format!("{n} files"),
    }
}

/// Waits until an input differs from what it was; false when standard input ended first.
fn wait(inputs: &[Input], ended: &AtomicBool) -> bool {
    loop {
        if inputs.iter().any(|input| Input::now(&input.path) != *input) {
            return true;
        }
        if ended.load(Ordering::Relaxed) {
            return false;
        }
        std::thread::sleep(PAUSE);
    }
}

/// Becomes true when standard input ends: whoever started us has gone. A terminal is left alone, so that we can run in the
/// background of a shell.
fn end_of_input() -> Arc<AtomicBool> {
    let ended = Arc::new(AtomicBool::new(false));
    if !std::io::stdin().is_terminal() {
        let told = Arc::clone(&ended);
        std::thread::spawn(move || {
            let (mut buffer, mut input) = ([0; 512], std::io::stdin().lock());
            while input.read(&mut buffer).is_ok_and(|n| n > 0) {}
            told.store(true, Ordering::Relaxed);
        });
    }
    ended
}
