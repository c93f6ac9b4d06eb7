//! The meaning of each code, for `avastra explain`: one page of prose, a wrong example and a right one.
//!
//! The pages are files in `pages/`. The tests compile their examples as `scenarios/example.ava`.

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

macro_rules! pages {
    [$($code:literal),* $(,)?] => {
        &[$(Page { code: $code, text: include_str!(concat!("pages/", $code, ".md")) }),*]
    };
}

/// Every page, by code.
pub const PAGES: &[Page] = pages![
    "AV0001", "AV0002", "AV0003", "AV0004", "AV0005", "AV0006", "AV0007", "AV0008", "AV0009", "AV0010",
    "AV0011", "AV0012", "AV0013", "AV0101", "AV0102", "AV0103", "AV0104", "AV0105", "AV0106", "AV0107",
    "AV0108", "AV0109", "AV0110", "AV0111", "AV0112", "AV0113", "AV0114", "AV0201", "AV0202", "AV0203",
    "AV0204", "AV0205", "AV0206", "AV0207", "AV0208", "AV0209", "AV0210", "AV0211", "AV0301", "AV0302",
    "AV0303", "AV0304", "AV0305", "AV0306", "AV0307", "AV0308", "AV0309", "AV0310", "AV0401", "AV0402",
    "AV0403", "AV0404", "AV0405", "AV0406", "AV0407", "AV0408", "AV0409", "AV0410", "AV0411", "AV0412",
    "AV0413", "AV0414", "AV0415", "AV0416", "AV0501", "AV0502", "AV0503", "AV0504", "AV0601", "AV0602",
    "AV0603", "AV0604", "AV0605", "AV0606", "AV0607", "AV0608", "AV0609", "AV0701", "AV0702", "AV0703",
    "AV0704", "AV0705", "AV0706", "AV0707", "AV0708", "AV0801", "AV0802", "AV0901", "AV0902",
];

/// The page of a code, in capital or small letters.
pub fn page(code: &str) -> Option<&'static Page> {
    PAGES.iter().find(|page| page.code.eq_ignore_ascii_case(code))
}

impl Page {
    /// The meaning of the code, in a few words.
    pub fn title(&self) -> &'static str {
        let line = self.text.lines().next().unwrap_or_default();
        line.split_once(": ").map_or(line, |(_, title)| title)
    }

    /// The first paragraph, on one line.
    pub fn summary(&self) -> String {
        self.text.split("\n\n").nth(1).unwrap_or_default().replace('\n', " ")
    }

    /// The source under a heading: `Wrong` or `Right`.
    pub fn example(&self, heading: &str) -> &'static str {
        let section = self.text.split(heading).nth(1).unwrap_or_default();
        let from_fence = section.split("```ava\n").nth(1).unwrap_or_default();
        from_fence.split("```").next().unwrap_or_default()
    }
}
