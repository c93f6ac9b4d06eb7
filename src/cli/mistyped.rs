//! The error for a mistyped command, or for a command's old name.

use clap::error::{ContextKind, ContextValue};

use avastra_lang::syntax::nearest;

use super::{help, output};

/// An unknown command's error with its present name, or else with the command that differs least. For `rn`, clap's own
/// measure prefers `render` to `run`.
pub fn with_nearest_command(mut error: clap::Error) -> clap::Error {
    let is_option =
        |value: &&ContextValue| matches!(value, ContextValue::String(word) if word.starts_with("--"));
    let option = error.get(ContextKind::InvalidArg).filter(is_option);
    if let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand).or(option)
        && let Some(now) = help::moved(word)
    {
        return help::command().error(error.kind(), format!("`{word}` is now `{now}`"));
    }
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand).cloned() else {
        return error;
    };
    // Words of `ads` have other neighbours.
    if output::command_line().iter().find(|argument| !argument.starts_with('-')) != Some(&word) {
        return error;
    }
    let command = help::command();
    let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
    if let Some(near) = nearest(&word, commands.map(clap::Command::get_name)) {
        error.insert(ContextKind::SuggestedSubcommand, ContextValue::Strings(vec![near.to_owned()]));
    }
    error
}
