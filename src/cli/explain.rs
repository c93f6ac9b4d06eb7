//! `avastra explain`: what a code means.

use avastra_lang::check::explain::{PAGES, Page, page};
use avastra_lang::syntax::nearest;

use super::arguments::ExplainArguments;
use super::error::Failure;
use super::output::Output;
use super::schema;

/// Prints the page of a code, a list of all, or what JSON looks like.
pub fn explain(output: &Output, arguments: &ExplainArguments) -> Result<(), Failure> {
    let Some(code) = &arguments.code else {
        for page in PAGES {
            output.say(&format!("{}  {}", page.code, page.title()));
        }
        output.say("json    what `--format json` prints");
        let pages: Vec<serde_json::Value> = PAGES.iter().map(record).collect();
        output.result(serde_json::json!({ "pages": pages, "always": [], "shapes": [] }));
        return Ok(());
    };
    if code == "json" {
        output.say(&schema::in_words());
        output.result(
            serde_json::json!({ "pages": [], "always": schema::always(), "shapes": schema::shapes() }),
        );
        return Ok(());
    }
    let Some(page) = page(code) else {
        let near = nearest(&code.to_uppercase(), PAGES.iter().map(|page| page.code));
        let hint =
            near.map_or("`avastra explain` lists all".to_owned(), |near| format!("did you mean `{near}`?"));
        return Err(Failure::usage(format!("there is no code `{code}`: {hint}")));
    };
    output.say(page.text.trim_end());
    output.result(serde_json::json!({ "pages": [record(page)], "always": [], "shapes": [] }));
    Ok(())
}

fn record(page: &Page) -> serde_json::Value {
    serde_json::json!({ "code": page.code, "title": page.title(), "text": page.text })
}
