//! How far the compiler is: a line on standard error while it is a terminal, seconds by stage at the end if asked for.

use super::output;
use crate::{Progress, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Listens to the compiler.
pub struct Monitor {
    bar: ProgressBar,
    times: Mutex<Times>,
}

struct Times {
    stage: Option<Stage>,
    since: Instant,
    spent: Vec<(Stage, Duration)>,
}

impl Monitor {
    pub fn new() -> Monitor {
        // Draws nothing unless standard error is a terminal.
        let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len}") {
            bar.set_style(style);
        }
        Monitor { bar, times: Mutex::new(Times { stage: None, since: Instant::now(), spent: Vec::new() }) }
    }

    /// To be told by the compiler.
    pub fn note(&self, progress: Progress) {
        if let Ok(mut times) = self.times.lock()
            && times.stage != Some(progress.stage)
        {
            times.turn(Some(progress.stage));
            self.bar.set_message(format!("{:<10}", progress.stage.name()));
        }
        self.bar.set_length(progress.total as u64);
        self.bar.set_position(progress.done as u64);
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
        if let Ok(mut times) = self.times.lock() {
            times.turn(None);
        }
    }

    /// Prints the seconds spent, by stage.
    pub fn print_timings(&self) {
        let Ok(times) = self.times.lock() else { return };
        let total: Duration = times.spent.iter().map(|(_, d)| *d).sum();
        for (stage, spent) in &times.spent {
            output::remark(&format!("{:<10} {:>9.3} s", stage.name(), spent.as_secs_f64()));
        }
        output::remark(&format!("{:<10} {:>9.3} s", "total", total.as_secs_f64()));
    }
}

impl Times {
    /// Books the time since the last turn on the stage that ends.
    fn turn(&mut self, next: Option<Stage>) {
        let now = Instant::now();
        if let Some(stage) = self.stage {
            let spent = now - self.since;
            match self.spent.iter_mut().find(|(s, _)| *s == stage) {
                Some((_, sum)) => *sum += spent,
                None => self.spent.push((stage, spent)),
            }
        }
        self.stage = next;
        self.since = now;
    }
}
