//! Progress of long work, on stderr: a bar on a terminal, plain lines elsewhere, nothing in JSON or with `--quiet`.
//!
//! A bar is as wide as the terminal: its message is cut, never folded. Lines begin after some seconds, so that short
//! work says nothing. A bar that is dropped is cleared: so does `indicatif` with every bar that is not finished otherwise.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};

use avastra_base::outside::in_line;
use avastra_campaign::train::TrainedEpisode;

use super::clock::now;
use super::output::{Output, Telling, plural, remark};

/// How far a run or a study is. Dropping it clears the bar.
pub struct Progress {
    count: Count,
    found: usize,
    /// The word after the number of collisions, which says what kind is told: `counted`, for example.
    how: &'static str,
    /// Simulated time so far, s, if its minutes are counted in place of episodes.
    simulated_s: Option<f64>,
}

impl Progress {
    /// `resumed` episodes count as done already.
    pub fn new(output: &Output, how: &'static str, total: u64, resumed: u64) -> Progress {
        let count = Count::new(output, "episodes", total, resumed);
        Progress { count, found: 0, how, simulated_s: None }
    }

    /// The progress of so many hours of simulated time, of which `simulated_s` are done already.
    pub fn of_hours(output: &Output, how: &'static str, hours: f64, simulated_s: f64) -> Progress {
        let count = Count::of_hours(output, hours, simulated_s);
        Progress { count, found: 0, how, simulated_s: Some(simulated_s) }
    }

    /// One more episode is done, with so many of the collisions that are told.
    pub fn episode(&mut self, found: usize) {
        self.episode_of(found, 0.0);
    }

    /// As [`Progress::episode`]; the episode took so long in the simulation.
    pub fn episode_of(&mut self, found: usize, duration_s: f64) {
        self.found += found;
        let more = units(&mut self.simulated_s, duration_s);
        self.count.up(more, format!("{} {}", plural(self.found, "collision"), self.how));
    }
}

/// What an episode adds to the count: itself, or whole minutes if these are counted.
fn units(simulated_s: &mut Option<f64>, duration_s: f64) -> u64 {
    let Some(so_far_s) = simulated_s else { return 1 };
    let before = minutes(*so_far_s);
    *so_far_s += duration_s;
    minutes(*so_far_s) - before
}

/// Whole minutes of a time.
fn minutes(time_s: f64) -> u64 {
    (time_s / 60.0) as u64
}

/// Episodes over which a training's progress is averaged.
const RECENT: usize = 25;

/// How far a training is. Dropping it clears the bar.
pub struct TrainingProgress {
    count: Count,
    found: usize,
    /// As in [`Progress`].
    simulated_s: Option<f64>,
    /// Sums of rewards of the last episodes.
    recent: VecDeque<f64>,
}

impl TrainingProgress {
    /// `resumed` episodes count as done already.
    pub fn new(output: &Output, total: u64, resumed: u64) -> TrainingProgress {
        let count = Count::new(output, "episodes", total, resumed);
        TrainingProgress { count, found: 0, simulated_s: None, recent: VecDeque::new() }
    }

    /// As [`Progress::of_hours`].
    pub fn of_hours(output: &Output, hours: f64, simulated_s: f64) -> TrainingProgress {
        let count = Count::of_hours(output, hours, simulated_s);
        TrainingProgress { count, found: 0, simulated_s: Some(simulated_s), recent: VecDeque::new() }
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
        let (found, epsilon) = (self.found, trained.exploration_epsilon);
        let more = units(&mut self.simulated_s, trained.simulated_s);
        self.count.up(more, format!("{found} counted, return {mean:.1}, ε {epsilon:.2}, {loss}"));
    }
}

/// Pieces of work that threads do, each like the others. Dropping it clears the bar.
pub struct Pieces(Mutex<Count>);

impl Pieces {
    /// `noun` names the pieces.
    pub fn new(output: &Output, noun: &'static str, total: usize) -> Pieces {
        Pieces(Mutex::new(Count::new(output, noun, total as u64, 0)))
    }

    /// One more piece is done.
    pub fn one(&self) {
        self.0.lock().expect("no thread panics while counting").up(1, String::new());
    }

    /// Prints something while the bar is out of the way.
    pub fn aside(&self, print: impl FnOnce()) {
        match &self.0.lock().expect("no thread panics while counting").bar {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }
}

/// Work that does not know how far it is: the time spent runs on a terminal. Dropping it clears the line.
pub struct Working {
    _bar: Option<ProgressBar>,
}

impl Working {
    pub fn new(output: &Output, doing: impl Into<String>) -> Working {
        let bar = (output.telling() == Telling::Bar).then(|| {
            let style = ProgressStyle::with_template("{spinner} {elapsed}, {wide_msg}");
            let bar = ProgressBar::new_spinner().with_message(in_line(&doing.into()).into_owned());
            bar.set_style(style.expect("a fixed template"));
            // The bar makes a thread for it, and panics where the system gives none.
            if std::thread::Builder::new().spawn(|| {}).is_ok_and(|tried| tried.join().is_ok()) {
                bar.enable_steady_tick(Duration::from_millis(200));
            }
            bar
        });
        Working { _bar: bar }
    }
}

/// Work that ends sooner is not worth a line in a log.
const SILENT: Duration = Duration::from_secs(2);

/// Pieces done of all: a bar on a terminal; elsewhere a line for each tenth of them.
struct Count {
    bar: Option<ProgressBar>,
    lines: bool,
    noun: &'static str,
    begun: Instant,
    total: u64,
    done: u64,
}

impl Count {
    /// The minutes of so many hours of simulated time, of which `simulated_s` are done already.
    fn of_hours(output: &Output, hours: f64, simulated_s: f64) -> Count {
        let total = (60.0 * hours).ceil() as u64;
        Count::new(output, "simulated minutes", total, minutes(simulated_s).min(total))
    }

    fn new(output: &Output, noun: &'static str, total: u64, done: u64) -> Count {
        let telling = output.telling();
        let bar = (telling == Telling::Bar).then(|| {
            let template = format!("{{bar:20}} {{pos}}/{{len}} {noun}, {{eta}} left  {{wide_msg}}");
            let bar = ProgressBar::new(total).with_position(done);
            bar.set_style(ProgressStyle::with_template(&template).expect("a fixed template"));
            bar
        });
        Count { bar, lines: telling == Telling::Lines, noun, begun: now(), total, done }
    }

    /// So many more are done. The last episode of a run by time ends after it.
    fn up(&mut self, more: u64, message: String) {
        let before = self.done;
        self.done = (self.done + more).min(self.total);
        if let Some(bar) = &self.bar {
            bar.set_message(message);
            bar.set_position(self.done);
        } else if self.lines
            && self.done * 10 / self.total > before * 10 / self.total
            && self.begun.elapsed() >= SILENT
        {
            let message = if message.is_empty() { message } else { format!(", {message}") };
            remark(&format!("{}/{} {}{message}", self.done, self.total, self.noun));
        }
    }
}
