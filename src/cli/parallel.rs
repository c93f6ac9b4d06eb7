//! The same work for many files, on threads: results come in the order of the files.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Worker threads: as many as asked for, or one for each core.
pub fn jobs(asked: Option<u32>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    asked.map_or_else(cores, |jobs| jobs as usize)
}

/// Does `work` for every file on as many threads as [`jobs`] says.
pub fn each_file<T: Send>(
    files: &[PathBuf],
    asked: Option<u32>,
    work: impl Fn(&PathBuf) -> T + Sync,
) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::with_capacity(files.len()));
    std::thread::scope(|scope| {
        for _ in 0..jobs(asked).min(files.len()) {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some(file) = files.get(number) else { break };
                    let result = work(file);
                    done.lock().expect("no worker panics while it holds the lock").push((number, result));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no worker panics while it holds the lock");
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_files() {
        let files: Vec<PathBuf> = (0..50).map(|number| PathBuf::from(number.to_string())).collect();
        let names = each_file(&files, Some(3), |file| file.display().to_string());
        assert!(names.iter().enumerate().all(|(number, name)| *name == number.to_string()));
        assert!(each_file(&[], None, |_| ()).is_empty());
    }
}
