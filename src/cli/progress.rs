//! Progress of long work: a bar on a terminal, plain lines otherwise.

use super::output::plural;
use std::collections::VecDeque;
use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressStyle};

use crate::train::TrainedEpisode;

use super::output::remark;

/// How far a run or a study is. Dropping it clears the bar.
pub struct Progress {
    count: Count,
    found: usize,
}

impl Progress {
    /// `quiet` shows nothing at all; `resumed` episodes count as done already.
    pub fn new(total: u64, resumed: u64, quiet: bool) -> Progress {
        let template = "{bar:30} {pos}/{len} episodes, {msg}, {per_sec}, {eta} left";
        let count = Count::new(total, resumed, quiet, template, "no counted collision");
        Progress { count, found: 0 }
    }

    /// One more episode is done, with so many counted collisions.
    pub fn episode(&mut self, counted: usize) {
        self.found += counted;
        self.count.up(format!("{} counted", plural(self.found, "collision")));
    }
}

/// Episodes over which a training's progress is averaged.
const RECENT: usize = 25;

/// How far a training is. Dropping it clears the bar.
pub struct TrainingProgress {
    count: Count,
    found: usize,
    /// Sums of rewards of the last episodes.
    recent: VecDeque<f64>,
}

impl TrainingProgress {
    /// `quiet` shows nothing at all; `resumed` episodes count as done already.
    pub fn new(total: u64, resumed: u64, quiet: bool) -> TrainingProgress {
        let template = "{bar:20} {pos}/{len} episodes, {msg}, {eta} left";
        let count = Count::new(total, resumed, quiet, template, "");
        TrainingProgress { count, found: 0, recent: VecDeque::new() }
    }

    /// One more episode has been learned from.
    pub fn episode(&mut self, trained: &TrainedEpisode) {
        self.found += trained.summary.counted();
        self.recent.push_back(trained.sum);
        if self.recent.len() > RECENT {
            self.recent.pop_front();
        }
        let mean = self.recent.iter().sum::<f64>() / self.recent.len() as f64;
        let loss = trained.lesson.loss.map_or("no loss yet".to_owned(), |loss| format!("loss {loss:.3}"));
        self.count.up(format!(
            "return {mean:.1}, {} counted, ε {:.2}, {loss}",
            plural(self.found, "collision"),
            trained.exploration_epsilon
        ));
    }
}

/// Episodes done of all: a bar on a terminal; elsewhere a line for each tenth of them.
struct Count {
    bar: Option<ProgressBar>,
    lines: bool,
    total: u64,
    done: u64,
}

impl Count {
    fn new(total: u64, done: u64, quiet: bool, template: &str, message: &'static str) -> Count {
        let terminal = std::io::stderr().is_terminal();
        let bar = (!quiet && terminal).then(|| {
            let bar = ProgressBar::new(total).with_position(done);
            bar.set_style(ProgressStyle::with_template(template).expect("a fixed template"));
            bar.set_message(message);
            bar
        });
        Count { bar, lines: !quiet && !terminal, total, done }
    }

    fn up(&mut self, message: String) {
        self.done += 1;
        if let Some(bar) = &self.bar {
            bar.set_message(message);
            bar.inc(1);
        } else if self.lines && (self.done * 10 / self.total > (self.done - 1) * 10 / self.total) {
            remark(&format!("{}/{} episodes, {message}", self.done, self.total));
        }
    }
}

impl Drop for Count {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
