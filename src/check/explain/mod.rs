//! What each code means, for `avastra explain`: one page of prose, a wrong example and a right one.
//!
//! The pages are files beside this one. Their examples stand as if in `scenarios/`, under the name
//! `example.ava`, and are compiled by the tests.

#[cfg(test)]
mod tests;

/// The page of one code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// `AV0101`.
    pub code: &'static str,
    /// The whole page, Markdown.
    pub text: &'static str,
}

macro_rules! page {
    ($code:literal) => {
        Page { code: $code, text: include_str!(concat!("pages/", $code, ".md")) }
    };
}

/// Every page, by code.
pub const PAGES: &[Page] = &[
    page!("AV0001"),
    page!("AV0002"),
    page!("AV0003"),
    page!("AV0004"),
    page!("AV0005"),
    page!("AV0006"),
    page!("AV0007"),
    page!("AV0008"),
    page!("AV0009"),
    page!("AV0010"),
    page!("AV0011"),
    page!("AV0012"),
    page!("AV0101"),
    page!("AV0102"),
    page!("AV0103"),
    page!("AV0104"),
    page!("AV0105"),
    page!("AV0106"),
    page!("AV0107"),
    page!("AV0108"),
    page!("AV0109"),
    page!("AV0110"),
    page!("AV0111"),
    page!("AV0112"),
    page!("AV0201"),
    page!("AV0202"),
    page!("AV0203"),
    page!("AV0204"),
    page!("AV0205"),
    page!("AV0206"),
    page!("AV0207"),
    page!("AV0208"),
    page!("AV0209"),
    page!("AV0210"),
    page!("AV0211"),
    page!("AV0301"),
    page!("AV0302"),
    page!("AV0303"),
    page!("AV0304"),
    page!("AV0305"),
    page!("AV0306"),
    page!("AV0307"),
    page!("AV0308"),
    page!("AV0309"),
    page!("AV0310"),
    page!("AV0401"),
    page!("AV0402"),
    page!("AV0403"),
    page!("AV0404"),
    page!("AV0405"),
    page!("AV0406"),
    page!("AV0407"),
    page!("AV0408"),
    page!("AV0409"),
    page!("AV0410"),
    page!("AV0501"),
    page!("AV0502"),
    page!("AV0503"),
    page!("AV0504"),
    page!("AV0601"),
    page!("AV0602"),
    page!("AV0603"),
    page!("AV0604"),
    page!("AV0605"),
    page!("AV0606"),
    page!("AV0607"),
    page!("AV0608"),
    page!("AV0701"),
    page!("AV0702"),
    page!("AV0703"),
    page!("AV0704"),
    page!("AV0705"),
    page!("AV0706"),
    page!("AV0707"),
    page!("AV0708"),
    page!("AV0801"),
    page!("AV0802"),
    page!("AV0901"),
    page!("AV0902"),
];

/// The page of a code, however its letters are written.
pub fn page(code: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.code.eq_ignore_ascii_case(code))
}

impl Page {
    /// What the code means, in a few words.
    pub fn title(&self) -> &'static str {
        let line = self.text.lines().next().unwrap_or_default();
        line.split_once(": ").map_or(line, |(_, title)| title)
    }

    /// The first paragraph, on one line.
    pub fn summary(&self) -> String {
        let paragraphs = self.text.split("\n\n");
        paragraphs.skip(1).take(1).collect::<String>().replace('\n', " ")
    }

    /// The source under a heading: `Wrong` or `Right`.
    pub fn example(&self, heading: &str) -> &'static str {
        let section = self.text.split(heading).nth(1).unwrap_or_default();
        let from_fence = section.split("```ava\n").nth(1).unwrap_or_default();
        from_fence.split("```").next().unwrap_or_default()
    }
}
