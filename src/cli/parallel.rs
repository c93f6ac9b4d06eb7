//! Work on many files at once; results come in the order of the files.

use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use crate::run::on_threads;

use super::arguments::FilesArguments;

/// Worker threads: as many as asked for, or one for each core.
pub fn jobs(asked: Option<u32>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    asked.map_or_else(cores, |jobs| jobs as usize)
}

/// Does `work` for every file on as many threads as [`jobs`] says.
pub fn each_file<T: Send>(many: &FilesArguments, work: impl Fn(&PathBuf) -> T + Sync) -> Vec<T> {
    let numbered: Vec<(usize, &PathBuf)> = many.files.iter().enumerate().collect();
    let work = |&(number, file): &(usize, &PathBuf), tell: &mut dyn FnMut(_) -> bool| {
        tell((number, work(file)));
    };
    let mut done = Vec::new();
    let Ok(()) = on_threads(&numbered, jobs(many.jobs), &AtomicBool::new(false), work, &mut |result| {
        done.push(result);
        Ok::<_, Infallible>(())
    });
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_the_order_of_the_files() {
        let files = (0..50).map(|number| PathBuf::from(number.to_string())).collect();
        let many = FilesArguments { files, jobs: Some(3) };
        let names = each_file(&many, |file| file.display().to_string());
        assert!(names.iter().enumerate().all(|(number, name)| *name == number.to_string()));
        assert!(each_file(&FilesArguments { files: Vec::new(), jobs: None }, |_| ()).is_empty());
    }
}
