//! All variations of a file, and what is made of them.

use std::collections::BTreeSet;
use std::rc::Rc;

use avastra_road::Lines;
use roxmltree::Document;

use super::catalogue::Library;
use super::scene::Scene;
use super::sky::Sky;
use super::source::{Refusal, Source};
use super::story::{self, Story};
use super::variation::Values;
use super::vocabulary;

/// A file of another tool in the language.
#[derive(Debug)]
pub struct Imported {
    /// `None` of a file that avastra exported: its scenario stands alone.
    pub space: Option<String>,
    /// A scenario that stands alone, or plays the only row of the space, which it uses as `NAME.ava`.
    pub scenario: Option<String>,
    /// The maps, as paths from the file of the other tool; the text names each by its file name alone.
    pub maps: BTreeSet<String>,
    /// Differences between the drive here and the file.
    pub notes: BTreeSet<String>,
}

/// One variation of a scenario.
pub struct Variant {
    pub values: Values,
    /// As a path from the file that is imported.
    pub map: String,
    pub scene: Scene,
    pub sky: Sky,
    pub duration_s: f64,
}

/// All variations of a file.
pub struct Whole<'a> {
    pub ego: Option<&'a str>,
    pub description: String,
    pub notes: BTreeSet<String>,
    /// One or more.
    pub variants: Vec<Variant>,
    /// How many variations have values that the scenario's own constraints exclude.
    pub excluded: usize,
    /// Whether the scenario has nothing that no version has.
    pub is_known: bool,
}

impl Whole<'_> {
    /// Reads the scenario with the values of one variation. A refusal comes with whether the file itself excludes the
    /// values.
    pub fn add(
        &mut self,
        document: &Document,
        lines: &Rc<Lines>,
        library: &Library,
        values: Values,
        asked: &Values,
    ) -> Result<(), (Vec<Refusal>, bool)> {
        let mut source = Source::new(Rc::clone(lines), asked, library);
        // Reports about values that the file excludes are dropped, so they are repeated for other values.
        if !self.is_known {
            let found = vocabulary::looked_over(document.root_element());
            self.is_known = found.unknown.is_empty();
            for (node, reason) in found.unknown {
                source.refuse::<()>(node, reason);
            }
            found.noted.into_iter().for_each(|note| source.note(note));
        }
        let story = story::read(&mut source, document, self.ego);
        let story = story.filter(|_| !source.is_excluded);
        let found = story.and_then(|story| {
            let scene = Scene::of(&mut source, &story)?;
            Some((scene, self.sky(&mut source, &story)?, story))
        });
        let (is_excluded, notes) = (source.is_excluded, source.notes());
        match (found, source.refusals()) {
            (Some((scene, sky, story)), refusals) if refusals.is_empty() => {
                self.notes.extend(notes);
                self.description.clone_from(&story.description);
                let map = library.beside(&story.map.1.replace('\\', "/"));
                let duration_s = story.duration_s;
                self.variants.push(Variant { values, map, scene, sky, duration_s });
                Ok(())
            }
            (_, refusals) => {
                self.excluded += usize::from(is_excluded);
                Err((refusals, is_excluded))
            }
        }
    }

    /// The sky of a variation. Each step of the space lets it change, whatever its row is: so all variations have the same.
    fn sky(&self, source: &mut Source, story: &Story) -> Option<Sky> {
        let own = Sky::of(story.weather.clone(), &story.changes);
        let first = self.variants.first().map(|variant| &variant.sky);
        let differs = first.is_some_and(|first| (own.changes() || first.changes()) && own != *first);
        let mark = story.changes.first().map_or(&story.map.0, |change| &change.mark);
        source.refuse_if(differs, mark, "a sky that changes is read where all variations have the same")?;
        Some(own)
    }
}
