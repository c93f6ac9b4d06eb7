//! Elements of an OpenSCENARIO file with their parameters filled in, and what is refused of them.
//!
//! A reader that ends with `None` has refused something, and its callers do not refuse again what follows from it.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use avastra_road::Lines;
use roxmltree::Node;

use super::catalogue::Library;
use super::expression;
use super::parameter;

/// The longest step of an episode, s: a scenario is one step.
pub const DURATION_S_MAX: f64 = 600.0;

/// Gives the texts of the files that a file names.
pub trait Files {
    /// The scenario at a path that a file of variations names.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn scenario(&self, path: &str) -> Result<String, String>;

    /// The map at a path that the scenario names.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn map(&self, path: &str) -> Result<String, String>;

    /// The `.xosc` files in a folder of catalogues: what each is called, without its ending, and its text.
    ///
    /// # Errors
    /// Why they cannot be read.
    fn catalogues(&self, folder: &str) -> Result<Vec<(String, String)>, String>;
}

/// Something that the language cannot say, or that is no OpenSCENARIO.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
pub struct Refusal {
    /// The scenario that a file of variations names, where the line is one of that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scenario: Option<String>,
    pub line: u32,
    /// The name of the XML element.
    pub element: String,
    pub reason: String,
}

/// Letters of a reason: it may have an expression of the file in it.
const REASON_MAX: usize = 500;

/// More refusals do not help.
const REFUSALS_MAX: usize = 100;

/// Positions may lie in routes and trajectories of other positions so deep.
const NESTED_MAX: usize = 16;

/// Entries of catalogues that one scenario may ask for: each may name others.
const ENTRIES_MAX: usize = 10_000;

/// Larger numbers are no place, speed or time of a scenario. It keeps all arithmetic finite.
const NUMBER_MAX: f64 = 1e7;

/// Where something stands in the file, to be refused later.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mark {
    pub line: u32,
    pub element: String,
    /// Where it begins in its own file: elements of a catalogue all have the line of what refers to it.
    pub at: usize,
}

/// The subject of a refusal: an element, or the mark of one.
pub trait Marked {
    fn mark(self, source: &Source) -> Mark;
}

impl Marked for Node<'_, '_> {
    fn mark(self, source: &Source) -> Mark {
        source.mark(self)
    }
}

impl Marked for &Mark {
    fn mark(self, _: &Source) -> Mark {
        self.clone()
    }
}

/// The parameters that are in force, and what was found wrong and worth a note so far.
#[derive(Debug)]
pub struct Source<'f> {
    pub library: &'f Library<'f>,
    /// The folders of catalogues, by the elements that name them.
    pub folders: BTreeMap<String, (Mark, String)>,
    /// How many catalogues deep the text lies that is read, and where and under which name the outermost is referred to.
    pub depth: usize,
    outermost: Option<(u32, String)>,
    /// How many entries of catalogues were read, and how deep positions lie in one another.
    entries: usize,
    nested: usize,
    lines: Rc<Lines>,
    /// Whether a value is one that its own declaration excludes.
    pub is_excluded: bool,
    /// The minor version of the file; 2 of 1.2.
    pub minor: i32,
    /// The variables of the file with their values; `None` for those that the story sets.
    pub variables: BTreeMap<String, Option<String>>,
    /// The names of the acts that begin with the scenario.
    pub acts_at_once: BTreeSet<String>,
    /// Whether its world is left-handed: what other files count to the left, it counts to the right.
    pub is_left_handed: bool,
    /// The entities that have a controller of the player's.
    pub controlled: BTreeSet<String>,
    parameters: BTreeMap<String, String>,
    /// Those of the texts around the entry of a catalogue that is read, the outermost first.
    outer: Vec<BTreeMap<String, String>>,
    /// How often an entry asked for a parameter that it does not declare.
    pub sees_more: usize,
    /// Parameters and entities of which something was refused: what follows from that is not told again.
    torn: BTreeSet<String>,
    /// How often something was refused, or would have been were it not told already.
    told: usize,
    /// Values that were asked for in place of those of the file, and whether a declaration has taken them.
    asked: BTreeMap<String, (String, bool)>,
    refused: BTreeSet<Refusal>,
    notes: BTreeSet<String>,
}

impl<'f> Source<'f> {
    /// `lines` are those of the file, and `asked` values for its parameters.
    pub fn new(lines: Rc<Lines>, asked: &BTreeMap<String, String>, library: &'f Library<'f>) -> Source<'f> {
        Source {
            library,
            folders: BTreeMap::new(),
            depth: 0,
            outermost: None,
            entries: 0,
            nested: 0,
            lines,
            is_excluded: false,
            minor: 0,
            variables: BTreeMap::new(),
            parameters: BTreeMap::new(),
            acts_at_once: BTreeSet::new(),
            is_left_handed: false,
            controlled: BTreeSet::new(),
            outer: Vec::new(),
            sees_more: 0,
            torn: BTreeSet::new(),
            told: 0,
            asked: asked.iter().map(|(name, value)| (name.clone(), (value.clone(), false))).collect(),
            refused: BTreeSet::new(),
            notes: BTreeSet::new(),
        }
    }

    /// Where an element stands.
    pub fn mark(&self, node: Node) -> Mark {
        let element = node.tag_name().name().to_owned();
        let at = node.range().start;
        let line = self.outermost.as_ref().map_or_else(|| self.lines.of(at), |(line, _)| *line);
        Mark { line, element, at }
    }

    /// Reads within an entry of a catalogue, of which messages name the reference to it.
    pub fn within<T>(
        &mut self,
        reference: Node,
        whose: &str,
        parameters: BTreeMap<String, String>,
        read: impl FnOnce(&mut Self) -> Option<T>,
    ) -> Option<T> {
        self.entries += 1;
        let reason = format!("it asks for more than {ENTRIES_MAX} entries of catalogues");
        self.refuse_if(self.entries > ENTRIES_MAX, reference, reason)?;
        let before = core::mem::replace(&mut self.parameters, parameters);
        let outermost = self.outermost.clone();
        if outermost.is_none() {
            self.outermost = Some((self.mark(reference).line, whose.to_owned()));
        }
        self.depth += 1;
        self.outer.push(before);
        let found = read(self);
        self.depth -= 1;
        self.outermost = outermost;
        self.parameters = self.outer.pop().unwrap_or_default();
        found
    }

    /// Reads what may lie in its own kind.
    pub fn nested<T>(&mut self, node: Node, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let reason = format!("positions lie in one another more than {NESTED_MAX} deep");
        self.refuse_if(self.nested >= NESTED_MAX, node, reason)?;
        self.nested += 1;
        let found = read(self);
        self.nested -= 1;
        found
    }

    /// Reads an element that declares parameters. They have their declared values unless a reference has given others.
    pub fn scoped<T>(&mut self, node: Node, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let before = self.parameters.clone();
        let own = elements(node, "ParameterDeclarations").flat_map(children);
        for declared in own.collect::<Vec<Node>>() {
            let Some(name) = self.named(declared, "name") else { continue };
            let is_given = self.depth > 0 && self.parameters.contains_key(&name);
            if !is_given && let Some(value) = self.text(declared, "value") {
                self.parameters.insert(name, value);
            }
        }
        let found = read(self);
        self.parameters = before;
        found
    }

    /// The value of a parameter.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        self.parameters.get(name).map(String::as_str)
    }

    /// All parameters with their values.
    pub fn parameters(&self) -> &BTreeMap<String, String> {
        &self.parameters
    }

    /// Whether anything was refused.
    pub fn is_refused(&self) -> bool {
        !self.refused.is_empty()
    }

    /// Refuses values for parameters that the file does not declare.
    pub fn refuse_undeclared(&mut self, root: Node) {
        let unknown = self.asked.iter().filter(|(_, (_, is_taken))| !is_taken).map(|(name, _)| name.clone());
        for name in unknown.collect::<Vec<_>>() {
            self.refuse::<()>(root, format!("it declares no parameter `{name}`"));
        }
    }

    /// All that was refused, by lines.
    pub fn refusals(self) -> Vec<Refusal> {
        self.refused.into_iter().collect()
    }

    pub fn notes(&self) -> BTreeSet<String> {
        self.notes.clone()
    }

    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.insert(text.into());
    }

    /// Refuses what stands somewhere. `None`, so that a reader can end with it.
    pub fn refuse<T>(&mut self, at: impl Marked, reason: impl Into<String>) -> Option<T> {
        self.told += 1;
        if self.refused.len() < REFUSALS_MAX {
            let Mark { line, element, .. } = at.mark(self);
            let reason = match &self.outermost {
                Some((_, whose)) => format!("{whose}: {}", reason.into()),
                None => reason.into(),
            };
            let reason = match reason.char_indices().nth(REASON_MAX) {
                Some((end, _)) => format!("{}…", &reason[..end]),
                None => reason,
            };
            self.refused.insert(Refusal { scenario: None, line, element, reason });
        }
        None
    }

    /// Refuses what stands somewhere if that is wrong; `None` then.
    pub fn refuse_if(&mut self, is_wrong: bool, at: impl Marked, reason: impl Into<String>) -> Option<()> {
        if is_wrong { self.refuse(at, reason) } else { Some(()) }
    }

    /// Does something for an entity; if anything is refused meanwhile, what follows from that is not told again.
    pub fn about<T>(&mut self, entity: &str, act: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let before = self.told;
        let done = act(self);
        if self.told > before {
            self.tear(entity);
        }
        done
    }

    /// Notes that something of an entity was refused.
    pub fn tear(&mut self, entity: &str) {
        self.torn.insert(entity.to_owned());
    }

    /// Whether something of an entity was refused, so that it need not be what the file says.
    pub fn is_torn(&self, entity: &str) -> bool {
        self.torn.contains(entity)
    }

    /// Declares the parameters that a `ParameterDeclarations` within an element lists.
    pub fn declare(&mut self, parent: Node) {
        for list in parent.children().filter(|node| node.has_tag_name("ParameterDeclarations")) {
            for declared in elements(list, "ParameterDeclaration") {
                let Some(name) = self.named(declared, "name") else { continue };
                let value = match self.asked.get_mut(&name) {
                    Some((value, is_taken)) => {
                        *is_taken = true;
                        Some(value.clone())
                    }
                    None => self.text(declared, "value"),
                };
                match value.filter(|value| parameter::check(self, declared, value).is_some()) {
                    Some(value) => drop(self.parameters.insert(name, value)),
                    None => self.tear(&format!("${name}")),
                }
            }
        }
    }

    /// A child that must be there.
    pub fn required<'a, 'input>(
        &mut self,
        node: Node<'a, 'input>,
        name: &'static str,
    ) -> Option<Node<'a, 'input>> {
        element(node, name).or_else(|| self.refuse(node, format!("it has no `{name}`")))
    }

    /// An attribute that must be there.
    pub fn text(&mut self, node: Node, name: &str) -> Option<String> {
        match node.attribute(name) {
            Some(value) => self.filled(node, value),
            None => self.refuse(node, format!("it has no `{name}`")),
        }
    }

    /// The name of a parameter or variable, which is not filled in.
    pub fn named(&mut self, node: Node, name: &str) -> Option<String> {
        match node.attribute(name) {
            Some(value) => Some(plain(value).to_owned()),
            None => self.refuse(node, format!("it has no `{name}`")),
        }
    }

    /// A finite number that must be there.
    pub fn number(&mut self, node: Node, name: &str) -> Option<f64> {
        let text = self.text(node, name)?;
        match text.trim().parse::<f64>() {
            Ok(number) if number.abs() <= NUMBER_MAX => Some(number),
            Ok(_) => self.refuse(node, format!("`{name}` is {text}, which no scenario has")),
            Err(_) => self.refuse(node, format!("`{name}` is `{text}`, which is no number")),
        }
    }

    pub fn number_or(&mut self, node: Node, name: &str, default: f64) -> Option<f64> {
        if node.has_attribute(name) { self.number(node, name) } else { Some(default) }
    }

    /// A way to the left, m, or a turn to the left, rad.
    pub fn left(&mut self, node: Node, name: &str) -> Option<f64> {
        let number = self.number(node, name)?;
        // The sum makes no -0 of 0.
        Some(if self.is_left_handed { 0.0 - number } else { number })
    }

    pub fn left_or_0(&mut self, node: Node, name: &str) -> Option<f64> {
        if node.has_attribute(name) { self.left(node, name) } else { Some(0.0) }
    }

    pub fn integer(&mut self, node: Node, name: &str) -> Option<i32> {
        let text = self.text(node, name)?;
        // A parameter may be a sum, which is printed as a number with a fraction.
        match text.trim().parse::<f64>() {
            Ok(number) if number.fract() == 0.0 && number.abs() < 1e6 => Some(number as i32),
            _ => self.refuse(node, format!("`{name}` is `{text}`, which is no whole number")),
        }
    }

    /// A switch, or what it is without one.
    pub fn switch(&mut self, node: Node, name: &str, default: bool) -> Option<bool> {
        if !node.has_attribute(name) {
            return Some(default);
        }
        match self.text(node, name)?.as_str() {
            "true" | "1" => Some(true),
            "false" | "0" => Some(false),
            other => self.refuse(node, format!("`{name}` is `{other}`, neither `true` nor `false`")),
        }
    }

    /// One of the words that the standard has for an attribute; the empty one if it is not there.
    pub fn word(&mut self, node: Node, name: &str, known: &[&'static str]) -> Option<&'static str> {
        if !node.has_attribute(name) {
            return Some("");
        }
        let text = self.text(node, name)?;
        let found = known.iter().find(|word| **word == text).copied();
        found.or_else(|| self.refuse(node, format!("`{name}` is `{text}`; it may be {}", known.join(", "))))
    }

    /// A number from 0 on.
    pub fn amount(&mut self, node: Node, name: &str) -> Option<f64> {
        let number = self.number(node, name)?;
        self.refuse_if(number < 0.0, node, format!("`{name}` is {number}, less than 0"))?;
        Some(number)
    }

    /// A value with its parameters filled in.
    fn filled(&mut self, node: Node, value: &str) -> Option<String> {
        if !value.contains('$') {
            return Some(value.trim().to_owned());
        }
        let names = value.split(|letter: char| !(letter.is_alphanumeric() || "_.$".contains(letter)));
        if names.filter(|word| word.starts_with('$')).any(|word| self.torn.contains(word)) {
            self.told += 1;
            return None;
        }
        let found = filled(value, &self.parameters);
        // As esmini has it; the standard leaves an entry with the parameters that it declares.
        let around = || {
            let mut all: BTreeMap<String, String> = self.outer.iter().flatten().map(pair).collect();
            all.extend(self.parameters.iter().map(pair));
            filled(value, &all)
        };
        match found {
            Err(reason) if !self.outer.is_empty() => match around() {
                Ok(found) => {
                    self.sees_more += 1;
                    self.note("entries of catalogues see the parameters of the file, too");
                    Some(found)
                }
                Err(_) => self.refuse(node, reason),
            },
            found => found.map_or_else(|reason| self.refuse(node, reason), Some),
        }
    }
}

fn pair((name, value): (&String, &String)) -> (String, String) {
    (name.clone(), value.clone())
}

/// The name of a parameter or variable as others refer to it. Some files write the `$` before it, also where they declare it.
pub fn plain(name: &str) -> &str {
    name.trim().trim_start_matches('$')
}

/// A value with its parameters: `$name` and `${$name / 3.6}`.
///
/// # Errors
/// The part that is not understood.
pub fn filled(value: &str, parameters: &BTreeMap<String, String>) -> Result<String, String> {
    let value = value.trim();
    if let Some(inner) = value.strip_prefix("${").and_then(|rest| rest.strip_suffix('}')) {
        return match (expression::value(inner, parameters), expression::joined(inner, parameters)) {
            (Ok(number), _) => Ok(number.to_string()),
            (Err(_), Some(joined)) => Ok(joined),
            (Err(reason), None) => Err(format!("`{value}`: {reason}")),
        };
    }
    let Some(name) = value.strip_prefix('$') else { return Ok(value.to_owned()) };
    parameters.get(name).cloned().ok_or_else(|| format!("no parameter is called `{name}`"))
}

/// The children of an element with a name.
pub fn elements<'a, 'input>(
    node: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

/// All children that are elements.
pub fn children<'a, 'input>(node: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    node.children().filter(Node::is_element)
}

pub fn element<'a, 'input>(node: Node<'a, 'input>, name: &'static str) -> Option<Node<'a, 'input>> {
    elements(node, name).next()
}
