//! An XML document as a tree of elements. `quick-xml` writes it.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An element with its attributes, and either its children or a text.
#[derive(Debug, Clone)]
pub struct Element {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Element>,
    text: Option<String>,
}

impl Element {
    pub fn new(name: &'static str) -> Element {
        Element { name, attributes: Vec::new(), children: Vec::new(), text: None }
    }

    /// An element that holds a text and nothing else.
    pub fn text(name: &'static str, text: impl ToString) -> Element {
        Element { text: Some(text.to_string()), ..Element::new(name) }
    }

    #[must_use]
    pub fn with(mut self, name: &'static str, value: impl ToString) -> Element {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// An attribute that is a measured number.
    #[must_use]
    pub fn measured(self, name: &'static str, value: f64) -> Element {
        self.with(name, number(value))
    }

    #[must_use]
    pub fn holding(mut self, child: Element) -> Element {
        self.children.push(child);
        self
    }

    #[must_use]
    pub fn holding_all(mut self, children: impl IntoIterator<Item = Element>) -> Element {
        self.children.extend(children);
        self
    }

    /// Its tag.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Names and values, in the order of the document.
    pub fn attributes(&self) -> &[(&'static str, String)] {
        &self.attributes
    }

    /// The value of an attribute, if it has it.
    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_str())
    }

    /// Its child elements, in the order of the document.
    pub fn children(&self) -> &[Element] {
        &self.children
    }

    /// With other values of attributes: `other` is asked of each, in the order of the document.
    #[must_use]
    pub fn with_values(&self, other: &mut dyn FnMut(&str) -> Option<String>) -> Element {
        let attributes = self.attributes.iter();
        let attributes: Vec<_> =
            attributes.map(|(name, value)| (*name, other(value).unwrap_or_else(|| value.clone()))).collect();
        let children = self.children.iter().map(|child| child.with_values(other)).collect();
        Element { name: self.name, attributes, children, text: self.text.clone() }
    }

    /// With a child after its first one.
    #[must_use]
    pub fn holding_second(mut self, child: Element) -> Element {
        self.children.insert(1.min(self.children.len()), child);
        self
    }

    /// The document whose root this is, indented by two spaces.
    pub fn document(&self) -> String {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        let declared = writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)));
        declared.and_then(|()| self.write(&mut writer)).expect("memory takes everything");
        let mut text = String::from_utf8(writer.into_inner()).expect("it is written from strings");
        text.push('\n');
        text
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> std::io::Result<()> {
        let attributes = self.attributes.iter().map(|(name, value)| (*name, value.as_str()));
        let start = BytesStart::new(self.name).with_attributes(attributes);
        if self.children.is_empty() && self.text.is_none() {
            return writer.write_event(Event::Empty(start));
        }
        writer.write_event(Event::Start(start))?;
        if let Some(text) = &self.text {
            writer.write_event(Event::Text(BytesText::new(text)))?;
        }
        self.children.iter().try_for_each(|child| child.write(writer))?;
        writer.write_event(Event::End(BytesEnd::new(self.name)))
    }
}

/// A number to the nearest millionth, without zeros at its end: a micrometre is far below what a simulator keeps.
pub fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_minus_zero() {
        let shown = [0.0, -0.0, -1e-9, 1.0, 100.0, 0.1 + 0.2, -2.5, 1_234.567_891_2].map(number);
        assert_eq!(shown, ["0", "0", "0", "1", "100", "0.3", "-2.5", "1234.567891"]);
    }
}
