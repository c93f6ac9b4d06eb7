//! Results for people: pages to look at (`page`, with the data of `recording`, `mind`, `ground` and `overview`), pictures
//! of maps and of moments of an episode, tables of text, and the text of all studies (`results`).

mod canvas;
mod columns;
mod ground;
mod labels;
mod mind;
mod overview;
mod page;
mod picture;
mod recording;
mod results;
mod road;
mod study;
mod trials;
mod words;

pub use overview::{of_estimate, of_run, of_study};
pub use page::{Page, Scene};
pub use picture::{Snapshot, Subject, picture};
pub use recording::{Recording, record, record_another};
pub use results::{Chapter, results};
pub use road::draw;
pub use study::study;
pub use trials::trials;
