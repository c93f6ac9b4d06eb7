//! Work on many files at once; results come in the order of the files.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;

use avastra_base::outside::Shown;
use avastra_campaign::run::{RunError, on_threads};
use avastra_drivers::external::Program;

use super::arguments::FilesArguments;
use super::error::Failure;
use super::interrupt;
use super::output::{Output, plural};
use super::progress::{Pieces, Working};

/// Worker threads: as many as asked for, or one for each core. A driving system behind a socket may serve one connection
/// at a time, so its default is one thread. Behind a socket it must also show that it serves a connection for each thread.
pub fn jobs(asked: Option<u32>, program: Option<&Arc<Program>>) -> Result<usize, Failure> {
    let cores = || match program {
        Some(program) if program.settings().command.is_socket() => 1,
        _ => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let jobs = asked.map_or_else(cores, |jobs| jobs as usize);
    if let Some(program) = program {
        program.reserve(jobs).map_err(|failure| RunError::External(Box::new(failure)))?;
    }
    Ok(jobs)
}

/// The result for each file, in the order of the files.
pub struct PerFile<T> {
    pub done: Vec<T>,
    failed: Vec<(PathBuf, Failure)>,
    files: usize,
}

impl<T> PerFile<T> {
    /// Files that failed, for the result in JSON.
    pub fn failed_in_json(&self) -> Vec<serde_json::Value> {
        let entry = |(file, failure): &(PathBuf, Failure)| serde_json::json!({ "file": file, "error": failure.to_string() });
        self.failed.iter().map(entry).collect()
    }

    /// Whether the command was about one file only.
    pub fn is_single(&self) -> bool {
        self.files == 1
    }

    /// A broken file does not hide the results of the others, but the command fails.
    ///
    /// # Errors
    /// The failure of the only file, or how many failed and could not be `done`.
    pub fn complete(mut self, done: &str) -> Result<(), Failure> {
        match self.failed.len() {
            0 => Ok(()),
            _ if self.failed.iter().any(|(_, failure)| matches!(failure, Failure::Stopped)) => {
                Err(Failure::Stopped)
            }
            _ if self.files == 1 => Err(self.failed.remove(0).1),
            failed => Err(Failure::usage(format!("{} could not be {done}", plural(failed, "file")))),
        }
    }
}

/// Hands on what came of the files from `next` on, up to the first that is not done; returns that one.
fn hand_on<T>(
    mut next: usize,
    results: &BTreeMap<usize, Result<T, Failure>>,
    tell: &mut dyn FnMut(&T),
) -> usize {
    while let Some(found) = results.get(&next) {
        found.iter().for_each(&mut *tell);
        next += 1;
    }
    next
}

/// Does `work` for every file on as many threads as [`jobs`] says, for `program` if one is to drive. With several files, it
/// says which failed. After Ctrl-C, the files under way are finished, and it says which files are not done.
pub fn each_file<T: Send>(
    output: &Output,
    many: &FilesArguments,
    program: Option<&Arc<Program>>,
    work: impl Fn(&PathBuf) -> Result<T, Failure> + Sync,
) -> Result<PerFile<T>, Failure> {
    each_file_in_turn(output, many, program, work, &mut |_| {})
}

/// As [`each_file`], and hands on what came of each file as soon as it and all before it are done.
pub fn each_file_in_turn<T: Send>(
    output: &Output,
    many: &FilesArguments,
    program: Option<&Arc<Program>>,
    work: impl Fn(&PathBuf) -> Result<T, Failure> + Sync,
    tell: &mut dyn FnMut(&T),
) -> Result<PerFile<T>, Failure> {
    let jobs = jobs(many.jobs, program)?;
    let numbered: Vec<(usize, &PathBuf)> = many.files.iter().enumerate().collect();
    let (mut results, mut next) = (BTreeMap::new(), 0);
    let (single, several) = match many.files.as_slice() {
        [file] => (Some(Working::new(output, file.shown().to_string())), None),
        files => (None, Some(Pieces::new(output, "files", files.len()))),
    };
    let work = |&(number, file): &(usize, &PathBuf), tell: &mut dyn FnMut(_) -> bool| {
        tell((number, work(file)));
    };
    // One file has nothing to be ended in good order.
    let stop = if several.is_some() { interrupt::stop_on_interrupt() } else { Arc::default() };
    let Ok(()) = on_threads(&numbered, jobs, &stop, work, &mut |(number, found)| {
        results.insert(number, found);
        if let Some(pieces) = &several {
            pieces.one();
            pieces.aside(|| next = hand_on(next, &results, tell));
        }
        Ok::<_, Infallible>(())
    });
    drop((single, several));
    hand_on(next, &results, tell);
    let mut all = PerFile { done: Vec::new(), failed: Vec::new(), files: many.files.len() };
    for (number, file) in numbered {
        match results.remove(&number).unwrap_or(Err(Failure::Stopped)) {
            Ok(found) => all.done.push(found),
            Err(failure) => {
                if !all.is_single() {
                    output.say(&format!("{}: {failure}", file.shown()));
                }
                all.failed.push((file.clone(), failure));
            }
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_files() {
        let output = Output::silent();
        let files = (0..50).map(|number| PathBuf::from(number.to_string())).collect();
        let many = FilesArguments { files, jobs: Some(3) };
        let mut told = Vec::new();
        let work = |file: &PathBuf| match file.shown().to_string() {
            name if name == "7" => Err(Failure::usage("not this one")),
            name => Ok(name),
        };
        let mut tell = |name: &String| told.push(name.clone());
        let names = each_file_in_turn(&output, &many, None, work, &mut tell).unwrap();
        let wanted: Vec<String> =
            (0..50).filter(|&number| number != 7).map(|number| number.to_string()).collect();
        assert_eq!((&names.done, &told), (&wanted, &wanted));
        assert_eq!(names.failed_in_json(), [serde_json::json!({ "file": "7", "error": "not this one" })]);
        assert_eq!(names.complete("read").unwrap_err().to_string(), "1 file could not be read");
    }
}
