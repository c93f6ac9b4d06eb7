//! Files that a scenario names: maps and catalogues. Each is read once, however many variations of the scenario there are.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use avastra_road::RoadMap;
use roxmltree::Node;

use super::body::Body;
use super::ground::{Ground, Known, once};
use super::source::Files;
use super::source::{Source, children, element, elements, filled, plain};
use super::vocabulary;

/// Where the catalogues of a kind are named, and what their entries are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Kind(&'static str, &'static str);

pub const VEHICLE: Kind = Kind("VehicleCatalog", "Vehicle");
pub const PEDESTRIAN: Kind = Kind("PedestrianCatalog", "Pedestrian");
pub const OBJECT: Kind = Kind("MiscObjectCatalog", "MiscObject");
pub const MANOEUVRE: Kind = Kind("ManeuverCatalog", "Maneuver");
pub const ROUTE: Kind = Kind("RouteCatalog", "Route");
pub const TRAJECTORY: Kind = Kind("TrajectoryCatalog", "Trajectory");
pub const ENVIRONMENT: Kind = Kind("EnvironmentCatalog", "Environment");

/// Catalogues within catalogues are read this deep.
const DEPTH_MAX: usize = 8;

/// An entry of a catalogue.
#[derive(Debug, Clone)]
struct Entry {
    text: Rc<str>,
    /// The error in it; empty if there is none.
    reason: String,
    /// The parts of it that are not read.
    noted: BTreeSet<String>,
    /// The name that its catalogue gives itself, if only the catalogue's file has the name that was asked for.
    other_name: Option<String>,
}

/// The catalogues of a folder, with the names of their files.
type Folder = Rc<Vec<(String, String)>>;

/// The files that a scenario names, as far as they were read.
pub struct Library<'f> {
    /// Bodies of entries, by the entry and the values that it is given.
    pub bodies: RefCell<BTreeMap<String, Body>>,
    files: &'f dyn Files,
    /// The folder of the scenario, before the paths that it names; empty if it is that of the file that is imported.
    folder: String,
    maps: Known<String, Ground>,
    folders: Known<String, Vec<(String, String)>>,
    /// Each entry that was asked for; `None` if there is none.
    entries: RefCell<BTreeMap<(String, String), Option<Entry>>>,
}

impl core::fmt::Debug for Library<'_> {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Library").finish_non_exhaustive()
    }
}

impl<'f> Library<'f> {
    pub fn new(files: &'f dyn Files, folder: String) -> Library<'f> {
        Library {
            files,
            folder,
            bodies: RefCell::default(),
            maps: Known::default(),
            folders: Known::default(),
            entries: RefCell::default(),
        }
    }

    /// A path of the scenario as one of the file that is imported.
    pub fn beside(&self, path: &str) -> String {
        format!("{}{path}", self.folder)
    }

    /// The map at a path.
    ///
    /// # Errors
    /// Why it cannot be read.
    pub fn map(&self, path: &str) -> Result<Rc<Ground>, String> {
        let read = || {
            let text = self.files.map(&self.beside(path))?;
            RoadMap::from_opendrive("map", &text).map(Ground::new).map_err(|error| error.to_string())
        };
        once(&self.maps, path.to_owned(), read)
    }

    fn folder(&self, path: &str) -> Result<Folder, String> {
        once(&self.folders, path.to_owned(), || self.files.catalogues(&self.beside(path)))
    }

    /// An entry of a catalogue of that name in one of the folders, or else of a file of that name, as esmini finds it.
    /// Most variations ask for the same ones.
    fn entry(
        &self,
        folders: &[(String, Folder)],
        kinds: &[Kind],
        catalogue: &str,
        name: &str,
    ) -> Option<Entry> {
        let places: Vec<&str> = folders.iter().map(|(path, _)| path.as_str()).collect();
        let key = (format!("{kinds:?} {places:?}"), format!("{catalogue:?} {name:?}"));
        if let Some(known) = self.entries.borrow().get(&key) {
            return known.clone();
        }
        let find = |is_by_file: bool| {
            let files = || folders.iter().flat_map(|(_, files)| files.iter());
            let named = files().filter(|(stem, _)| !is_by_file || stem == catalogue);
            named.into_iter().find_map(|(_, text)| entry_in(text, kinds, catalogue, name, is_by_file))
        };
        let found = find(false).or_else(|| find(true));
        self.entries.borrow_mut().insert(key, found.clone());
        found
    }
}

/// An entry of the catalogue that a file holds, if that is called so or its name does not count.
fn entry_in(text: &str, kinds: &[Kind], catalogue: &str, name: &str, is_by_file: bool) -> Option<Entry> {
    let document = avastra_road::well_formed(text).ok()?;
    let is_named = |node: &Node, name: &str| node.attribute("name") == Some(name);
    let list = document.descendants().find(|node| node.has_tag_name("Catalog"));
    let list = list.filter(|node| is_by_file || is_named(node, catalogue))?;
    let is_of_kind = |node: &Node| kinds.iter().any(|Kind(_, element)| node.has_tag_name(*element));
    let found = children(list).find(|node| is_named(node, name) && is_of_kind(node))?;
    let vocabulary::Found { unknown, noted } = vocabulary::looked_over(found);
    let reason = unknown
        .first()
        .map_or(String::new(), |(node, reason)| format!("`{}`: {reason}", node.tag_name().name()));
    let own = list.attribute("name").unwrap_or("");
    let other_name = (own != catalogue).then(|| own.to_owned());
    Some(Entry { text: Rc::from(&text[found.range()]), reason, noted, other_name })
}

/// Notes the folders of catalogues.
pub fn locate(source: &mut Source, root: Node) {
    let locations: Vec<Node> = elements(root, "CatalogLocations").flat_map(children).collect();
    for location in locations {
        let Some(directory) = element(location, "Directory") else { continue };
        let mark = source.mark(directory);
        if let Some(path) = source.text(directory, "path") {
            source.folders.insert(location.tag_name().name().to_owned(), (mark, path));
        }
    }
}

/// The body that an entry describes, read once for all variations that ask for it with the same values.
pub fn body(
    source: &mut Source,
    reference: Node,
    kinds: &[Kind],
    read: impl FnOnce(&mut Source, Node) -> Option<Body>,
) -> Option<Body> {
    let (catalogue, name) = (source.text(reference, "catalogName")?, source.text(reference, "entryName")?);
    let folders: Vec<&String> = source.folders.values().map(|(_, path)| path).collect();
    let of = format!("{folders:?} {catalogue:?} {name:?}");
    let key = format!("{of} {:?}", assigned(source, reference)?);
    if let Some(known) = source.library.bodies.borrow().get(&key) {
        return Some(known.clone());
    }
    let sees_more = source.sees_more;
    let found = entry(source, reference, kinds, read)?;
    // One that asks for the file's own parameters may be another one next time.
    if source.sees_more == sees_more {
        source.library.bodies.borrow_mut().insert(key, found.clone());
    }
    Some(found)
}

/// The values that a reference gives to parameters of an entry.
fn assigned(source: &mut Source, reference: Node) -> Option<BTreeMap<String, String>> {
    let mut assigned = BTreeMap::new();
    for one in elements(reference, "ParameterAssignments").flat_map(children) {
        let name = source.named(one, "parameterRef")?;
        assigned.insert(name, source.text(one, "value")?);
    }
    Some(assigned)
}

/// Reads the entry of a catalogue that a `CatalogReference` names, with the values that it gives to the entry's parameters.
pub fn entry<T>(
    source: &mut Source,
    reference: Node,
    kinds: &[Kind],
    read: impl FnOnce(&mut Source, Node) -> Option<T>,
) -> Option<T> {
    let (catalogue, name) = (source.text(reference, "catalogName")?, source.text(reference, "entryName")?);
    if source.depth >= DEPTH_MAX {
        return source.refuse(reference, format!("catalogues lie in one another more than {DEPTH_MAX} deep"));
    }
    let assigned = assigned(source, reference)?;
    let mut folders = Vec::new();
    for Kind(location, _) in kinds {
        let Some((mark, path)) = source.folders.get(*location).cloned() else { continue };
        match source.library.folder(&path) {
            Ok(found) => folders.push((path, found)),
            Err(reason) => return source.refuse(&mark, format!("`{path}`: {reason}")),
        }
    }
    let whose = format!("`{name}` of `{catalogue}`");
    let Some(Entry { text, reason, noted, other_name }) =
        source.library.entry(&folders, kinds, &catalogue, &name)
    else {
        let kinds: Vec<String> = kinds.iter().map(|Kind(_, element)| format!("`{element}`")).collect();
        let mut reason = format!("no {} `{name}` in a catalogue `{catalogue}`", kinds.join(" or "));
        let mut files = folders.iter().flat_map(|(_, files)| files.iter());
        if files.any(|(_, text)| avastra_road::well_formed(text).is_err()) {
            reason += "; a file there is not well-formed, and is left out";
        }
        return source.refuse(reference, reason);
    };
    if let Some(own) = other_name {
        source.note(format!(
            "the catalogue `{catalogue}` calls itself `{own}`: it is found by the name of its file"
        ));
    }
    noted.into_iter().for_each(|note| source.note(note));
    let document = avastra_road::well_formed(&text).ok().filter(|_| reason.is_empty());
    let Some(document) = document else { return source.refuse(reference, format!("{whose}: {reason}")) };
    let found = document.root_element();
    let parameters = match given(found, assigned) {
        Ok(parameters) => parameters,
        Err(reason) => return source.refuse(reference, format!("{whose}: {reason}")),
    };
    source.within(reference, &whose, parameters, |source| read(source, found))
}

/// The values of an entry's parameters: those that are assigned, and the defaults of the others.
fn given(entry: Node, assigned: BTreeMap<String, String>) -> Result<BTreeMap<String, String>, String> {
    let declared: Vec<Node> = elements(entry, "ParameterDeclarations").flat_map(children).collect();
    let is_declared =
        |name: &&String| declared.iter().any(|one| one.attribute("name").map(plain) == Some(name.as_str()));
    if let Some(name) = assigned.keys().find(|name| !is_declared(name)) {
        return Err(format!("it declares no parameter `{name}`"));
    }
    let mut parameters = assigned;
    for one in declared {
        let (Some(name), Some(value)) = (one.attribute("name").map(plain), one.attribute("value")) else {
            continue;
        };
        if !parameters.contains_key(name) {
            let value = filled(value, &parameters)?;
            parameters.insert(name.to_owned(), value);
        }
    }
    Ok(parameters)
}
