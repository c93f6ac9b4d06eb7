//! `avastra explain`: what a code means.

use crate::check::explain::{PAGES, Page, page};
use crate::syntax::nearest;

use super::arguments::ExplainArguments;
use super::error::Failure;
use super::output::Output;

/// Prints the page of a code, or a list of all.
pub fn explain(output: &Output, arguments: &ExplainArguments) -> Result<(), Failure> {
    let Some(code) = &arguments.code else {
        for page in PAGES {
            output.say(&format!("{}  {}", page.code, page.title()));
        }
        let pages: Vec<serde_json::Value> = PAGES.iter().map(record).collect();
        output.result("explain", serde_json::json!({ "pages": pages }));
        return Ok(());
    };
    let Some(page) = page(code) else {
        let near = nearest(&code.to_uppercase(), PAGES.iter().map(|page| page.code));
        let hint =
            near.map_or("`avastra explain` lists all".to_owned(), |near| format!("did you mean `{near}`?"));
        return Err(Failure::usage(format!("there is no code `{code}`: {hint}")));
    };
    output.say(page.text.trim_end());
    output.result("explain", serde_json::json!({ "pages": [record(page)] }));
    Ok(())
}

fn record(page: &Page) -> serde_json::Value {
    serde_json::json!({ "code": page.code, "title": page.title(), "text": page.text })
}
