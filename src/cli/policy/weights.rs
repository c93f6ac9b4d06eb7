//! `avastra policy weights`: a policy's network for other tools.

use crate::cli::arguments::WeightsArguments;
use crate::cli::error::Failure;
use crate::cli::files::{place, write_result};
use crate::cli::load;
use crate::cli::output::Output;
use avastra_base::outside::Shown;
use avastra_campaign::emit;
use avastra_search::agent::Face;

use super::acting;

/// Writes the weights as safetensors.
pub fn weights(output: &Output, arguments: &WeightsArguments) -> Result<(), Failure> {
    let path = place(arguments.output.as_ref(), arguments.file.with_extension("safetensors"))?;
    let (table, policy) = load::policy(output, &arguments.file)?;
    let acting = acting(&table, &policy, Face::Network)?;
    write_result(arguments.output.as_ref(), &path, &emit::safetensors(acting.network()))?;
    let (shape, count) = (acting.network().shape(), acting.network().parameters().len());
    let widths: Vec<String> = shape.layers.iter().map(ToString::to_string).collect();
    let head = if shape.dueling { ", and the state's value as the last output" } else { "" };
    output.say(&format!("{}: {count} numbers of {}{head}", path.shown(), widths.join("-")));
    output.result(serde_json::json!({ "file": path, "layers": shape.layers, "dueling": shape.dueling }));
    Ok(())
}
