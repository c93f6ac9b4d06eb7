//! Elements and attributes with their line numbers, over `roxmltree`.

use roxmltree::Node;

use crate::RoadError;

/// An error at a line of the file.
pub fn wrong(line: u32, message: impl Into<String>) -> RoadError {
    RoadError::Map { line, message: message.into() }
}

/// Where each line of a text begins, so that a line number needs no new count.
#[derive(Debug)]
pub struct Lines(Vec<usize>);

impl Lines {
    pub fn new(text: &str) -> Lines {
        let after_breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Lines(core::iter::once(0).chain(after_breaks).collect())
    }

    /// The line of a byte, counted from 1.
    pub fn of(&self, at: usize) -> u32 {
        u32::try_from(self.0.partition_point(|begin| *begin <= at)).unwrap_or(u32::MAX)
    }
}

/// An XML element.
#[derive(Clone, Copy)]
pub struct Element<'a, 'input> {
    node: Node<'a, 'input>,
    lines: &'a Lines,
}

impl<'a, 'input> Element<'a, 'input> {
    pub fn new(node: Node<'a, 'input>, lines: &'a Lines) -> Element<'a, 'input> {
        Element { node, lines }
    }

    pub fn name(&self) -> &'a str {
        self.node.tag_name().name()
    }

    pub fn line(&self) -> u32 {
        self.lines.of(self.node.range().start)
    }

    /// An error at this element.
    pub fn wrong(&self, message: impl Into<String>) -> RoadError {
        wrong(self.line(), message)
    }

    pub fn elements(self) -> impl Iterator<Item = Element<'a, 'input>> {
        let lines = self.lines;
        self.node.children().filter(Node::is_element).map(move |node| Element { node, lines })
    }

    pub fn children(self, name: &str) -> impl Iterator<Item = Element<'a, 'input>> {
        self.elements().filter(move |child| child.name() == name)
    }

    pub fn child(self, name: &str) -> Option<Element<'a, 'input>> {
        self.children(name).next()
    }

    pub fn attribute(&self, name: &str) -> Option<&'a str> {
        self.node.attribute(name).map(str::trim)
    }

    /// An attribute that must be there.
    pub fn text(&self, name: &str) -> Result<&'a str, RoadError> {
        match self.attribute(name) {
            Some(value) if !value.is_empty() => Ok(value),
            _ => Err(self.wrong(format!("`{}` lacks its `{name}`", self.name()))),
        }
    }

    /// A finite number that must be there.
    pub fn number(&self, name: &str) -> Result<f64, RoadError> {
        self.parse_number(name, self.text(name)?)
    }

    /// A finite number, or `default` if the attribute is missing.
    pub fn number_or(&self, name: &str, default: f64) -> Result<f64, RoadError> {
        self.attribute(name).map_or(Ok(default), |value| self.parse_number(name, value))
    }

    pub fn integer(&self, name: &str) -> Result<i32, RoadError> {
        let value = self.text(name)?;
        value.parse().map_err(|_| self.odd(name, value, "no whole number"))
    }

    fn parse_number(&self, name: &str, value: &str) -> Result<f64, RoadError> {
        match value.parse::<f64>() {
            Ok(number) if number.abs() <= NUMBER_MAX => Ok(number),
            Ok(_) => Err(self.odd(name, value, "no number a road can have")),
            Err(_) => Err(self.odd(name, value, "no number")),
        }
    }

    /// An error at an attribute whose value is not what it must be.
    fn odd(&self, name: &str, value: &str, what: &str) -> RoadError {
        self.wrong(format!("`{name}` of `{}` is `{value}`, which is {what}", self.name()))
    }
}

/// Limit on numbers: larger than any coordinate, station or coefficient of a real map. It keeps all arithmetic
/// finite.
const NUMBER_MAX: f64 = 1e9;
