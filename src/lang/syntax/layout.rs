//! Where lines break: documents that stay on one line if they fit, after Wadler's "A prettier printer".
//!
//! Knows nothing of the language; `print` makes the documents.

/// A longer line is broken where it can be, characters.
pub const WIDTH: usize = 110;
/// Blanks of one level of indentation.
pub const INDENT: usize = 2;

/// A piece of text that may be laid out in two ways.
#[derive(Debug, Clone)]
pub enum Layout {
    Text(String),
    /// This text, or a line break in a broken group.
    Line(&'static str),
    /// Nothing, or this text in a broken group.
    IfBroken(&'static str),
    /// Parts, one after the other.
    Row(Vec<Layout>),
    /// A part, one level of indentation deeper.
    Nest(Box<Layout>),
    /// On one line if it fits; otherwise every `Line` directly in it breaks.
    Group(Box<Layout>),
}

impl Layout {
    pub fn text(text: impl Into<String>) -> Self {
        Layout::Text(text.into())
    }

    pub fn row(parts: impl IntoIterator<Item = Layout>) -> Self {
        Layout::Row(parts.into_iter().collect())
    }

    pub fn group(parts: impl IntoIterator<Item = Layout>) -> Self {
        Layout::Group(Box::new(Layout::row(parts)))
    }

    pub fn nest(parts: impl IntoIterator<Item = Layout>) -> Self {
        Layout::Nest(Box::new(Layout::row(parts)))
    }

    /// `open item, item close`, or one item a line with a comma after each.
    pub fn listed(open: &str, items: impl IntoIterator<Item = Layout>, close: &str) -> Self {
        let mut inside = Vec::new();
        for item in items {
            if !inside.is_empty() {
                inside.extend([Layout::text(","), Layout::Line(" ")]);
            }
            inside.push(item);
        }
        if inside.is_empty() {
            return Layout::text(format!("{open}{close}"));
        }
        inside.insert(0, Layout::Line(""));
        inside.push(Layout::IfBroken(","));
        Layout::group([Layout::text(open), Layout::nest(inside), Layout::Line(""), Layout::text(close)])
    }

    /// The text on one line, however long.
    pub fn flat(&self) -> String {
        let mut out = String::new();
        lay_out(self, &mut out, 0, 0, usize::MAX);
        out
    }

    /// The text, if it begins in `column` of a line with this indentation.
    pub fn render(&self, indent: usize, column: usize) -> String {
        let mut out = String::new();
        lay_out(self, &mut out, indent, column, WIDTH);
        out
    }
}

/// Lays out. The stack holds the parts still to come, with their indentation and whether they are broken.
fn lay_out(layout: &Layout, out: &mut String, indent: usize, column: usize, width: usize) {
    let mut column = column;
    let mut todo = vec![(indent, false, layout)];
    while let Some((indent, broken, next)) = todo.pop() {
        match next {
            Layout::Text(text) => {
                out.push_str(text);
                column += text.chars().count();
            }
            Layout::Line(_) if broken => {
                out.push('\n');
                out.extend(std::iter::repeat_n(' ', indent));
                column = indent;
            }
            Layout::Line(flat) => {
                out.push_str(flat);
                column += flat.len();
            }
            Layout::IfBroken(text) if broken => out.push_str(text),
            Layout::IfBroken(_) => {}
            Layout::Row(parts) => todo.extend(parts.iter().rev().map(|part| (indent, broken, part))),
            Layout::Nest(inside) => todo.push((indent + INDENT, broken, inside)),
            Layout::Group(inside) => {
                let room = width.saturating_sub(column);
                let breaks = width != usize::MAX && !fits(inside, &todo, room);
                todo.push((indent, breaks, inside));
            }
        }
    }
}

/// Whether a group on one line, with the text after it up to the next possible line break, fits in `room`.
fn fits(inside: &Layout, after: &[(usize, bool, &Layout)], room: usize) -> bool {
    let mut left = room;
    let mut todo = vec![(false, inside)];
    let mut after = after.iter().rev();
    // Groups that follow may break by themselves later, so their first line break ends the line.
    let mut groups_break = false;
    loop {
        let Some((broken, next)) = todo.pop() else {
            let Some((_, broken, next)) = after.next() else { return true };
            todo.push((*broken, *next));
            groups_break = true;
            continue;
        };
        let taken = match next {
            Layout::Text(text) => text.chars().count(),
            Layout::Line(_) if broken => return true,
            Layout::Line(flat) => flat.len(),
            Layout::IfBroken(text) if broken => text.len(),
            Layout::IfBroken(_) => 0,
            Layout::Row(parts) => {
                todo.extend(parts.iter().rev().map(|part| (broken, part)));
                0
            }
            Layout::Nest(inside) => {
                todo.push((broken, inside));
                0
            }
            Layout::Group(inside) => {
                todo.push((groups_break, inside));
                0
            }
        };
        match left.checked_sub(taken) {
            Some(rest) => left = rest,
            None => return false,
        }
    }
}
