//! How far the compiler is: a line on standard error while it is a terminal, seconds by stage at the end if asked for.

use super::args::{Global, MessageFormat};
use super::output::{self, Failure};
use crate::{Progress, Stage};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// With a bar and the time that is left, for stages of several steps; with the time so far for those of one.
const COUNTED: &str = "{prefix:>5} {msg:<9} {bar:30} {pos}/{len}, {eta} left";
const SINGLE: &str = "{prefix:>5} {msg:<9} {spinner} {elapsed}";
/// Between two turns of the spinner.
const TICK: Duration = Duration::from_millis(200);

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
        Monitor { bar, times: Mutex::new(Times { stage: None, since: Instant::now(), spent: Vec::new() }) }
    }

    /// To be told by the compiler.
    pub fn note(&self, progress: Progress) {
        if let Ok(mut times) = self.times.lock()
            && times.stage != Some(progress.stage)
        {
            times.turn(Some(progress.stage));
            self.begin(progress);
        }
        self.bar.set_length(progress.total as u64);
        self.bar.set_position(progress.done as u64);
    }

    /// A new stage has a new clock: what is left of it is judged by its own pace.
    fn begin(&self, progress: Progress) {
        let template = if progress.total > 1 { COUNTED } else { SINGLE };
        if let Ok(style) = ProgressStyle::with_template(template) {
            self.bar.set_style(style);
        }
        let at = Stage::ALL.iter().position(|s| *s == progress.stage).unwrap_or(0);
        self.bar.set_prefix(format!("{}/{}", at + 1, Stage::ALL.len()));
        self.bar.set_message(progress.stage.name());
        self.bar.reset_eta();
        self.bar.reset_elapsed();
        if !self.bar.is_hidden() {
            self.bar.enable_steady_tick(TICK);
        }
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
        if let Ok(mut times) = self.times.lock() {
            times.turn(None);
        }
    }

    /// Prints the seconds spent on `spec`, by stage: a table on standard error, or one object a line on standard output where
    /// messages are JSON.
    pub fn print_timings(&self, spec: &str, global: &Global) -> Result<(), Failure> {
        let Ok(times) = self.times.lock() else { return Ok(()) };
        if global.message_format == MessageFormat::Json {
            return output::line(&times.json(spec));
        }
        times.table(spec).iter().for_each(|line| output::remark(line));
        Ok(())
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

    fn total(&self) -> Duration {
        self.spent.iter().map(|(_, d)| *d).sum()
    }

    fn table(&self, spec: &str) -> Vec<String> {
        let total = self.total().as_secs_f64();
        let line = |name: &str, seconds: f64| {
            let share = if total > 0.0 { 100.0 * seconds / total } else { 0.0 };
            format!("{name:<10} {seconds:>9.3} s {share:>4.0} %")
        };
        let stages = self.spent.iter().map(|(stage, spent)| line(stage.name(), spent.as_secs_f64()));
        [format!("{spec}:")].into_iter().chain(stages).chain([line("total", total)]).collect()
    }

    fn json(&self, spec: &str) -> String {
        let stage = |(stage, spent): &(Stage, Duration)| serde_json::json!({ "stage": stage.name(), "seconds": spent.as_secs_f64() });
        let stages: Vec<_> = self.spent.iter().map(stage).collect();
        serde_json::json!({ "timings": { "spec": spec, "stages": stages, "total": self.total().as_secs_f64() } })
            .to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times() -> Times {
        let spent = vec![(Stage::Design, Duration::from_millis(5)), (Stage::View, Duration::from_millis(15))];
        Times { stage: None, since: Instant::now(), spent }
    }

    #[test]
    fn timings_are_a_table_or_an_object() {
        let expected = [
            "a.gng:",
            "design         0.005 s   25 %",
            "view           0.015 s   75 %",
            "total          0.020 s  100 %",
        ];
        assert_eq!(times().table("a.gng"), expected);
        let value: serde_json::Value = serde_json::from_str(&times().json("a.gng")).unwrap();
        assert_eq!(value["timings"]["stages"][1]["stage"], "view");
        assert_eq!(value["timings"]["total"], 0.02);
    }

    #[test]
    fn a_stage_that_comes_again_is_booked_on_the_same_line() {
        let mut times = Times { stage: None, since: Instant::now(), spent: Vec::new() };
        for stage in [Stage::Design, Stage::View, Stage::Design] {
            times.turn(Some(stage));
        }
        times.turn(None);
        assert_eq!(times.spent.iter().map(|(s, _)| *s).collect::<Vec<_>>(), [Stage::Design, Stage::View]);
    }
}
