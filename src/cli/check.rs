//! `avastra check`: every static check, and a look at the stages.

use std::path::Path;
use std::sync::Arc;

use avastra_base::outside::Shown;
use avastra_lang::check::Loaded;
use avastra_lang::model::Space;
use avastra_lang::syntax::ast::FileId;
use avastra_lang::syntax::{Diagnostic, apply_fixes};
use avastra_world::action::{ActionTable, audit};
use avastra_world::places::{self, Scenes};
use avastra_world::sim::ENGINE;

use super::arguments::{CheckArguments, Dump};
use super::error::Failure;
use super::files::write_again;
use super::load;
use super::output::{Output, plural};

/// Checks each file by itself; the mistakes of all are printed before the command fails.
pub fn check(output: &Output, arguments: &CheckArguments) -> Result<(), Failure> {
    let (mut errors, mut warnings) = (0, 0);
    let mut files = Vec::new();
    let (mut unread, mut failed) = (Vec::new(), Vec::new());
    let mut scenes = Scenes::default();
    // The warnings about the previous file's space. Most often this file has the same space.
    let mut warned: Option<(Arc<Space>, Vec<Diagnostic>)> = None;
    for path in &arguments.files {
        let mut loaded = match load::read_and_check(path) {
            Ok(loaded) => loaded,
            Err(failure) => {
                failed.push(serde_json::json!({ "file": path, "error": failure.to_string() }));
                unread.push(failure);
                continue;
            }
        };
        if arguments.fix && fix(output, path, &loaded)? {
            // Other files may use it.
            load::forget();
            loaded = load::read_and_check(path)?;
        }
        match (&warned, &loaded.space) {
            (Some((of, found)), Some(space)) if Arc::ptr_eq(of, space) => {
                loaded.diagnostics.extend(found.iter().cloned());
            }
            _ => {
                let before = loaded.diagnostics.len();
                places::warn(&mut loaded, &mut scenes);
                warned = loaded.space.clone().map(|space| (space, loaded.diagnostics[before..].to_vec()));
            }
        }
        output.diagnostics(&loaded.sources, &loaded.diagnostics);
        output.diagnostics(&loaded.sources, &shown(output, std::mem::take(&mut loaded.remarks)));
        let wrong = loaded.diagnostics.iter().filter(|diagnostic| diagnostic.is_error()).count();
        errors += wrong;
        warnings += loaded.diagnostics.len() - wrong;
        let table = loaded.space.clone().map(ActionTable::new);
        let dump = match arguments.dump {
            Some(Dump::Ast) => Some(json(&loaded.files[0].tree)),
            Some(Dump::Actions) => table.as_ref().map(|table| json(&table.file())),
            None => None,
        };
        if let Some(dump) = &dump {
            output.document(&serde_json::to_string_pretty(dump).expect("it is JSON already"));
        }
        let audit = table.as_ref().filter(|_| arguments.audit && wrong == 0).map(audit);
        if let Some(audit) = &audit {
            output.say(&audit.to_string());
        }
        // With a dump, stdout holds JSON alone.
        match older(&loaded) {
            _ if dump.is_some() || wrong > 0 => {}
            Some(engine) => output.say(&format!(
                "{}: made in world `{engine}`, this is `{ENGINE}`: it cannot be replayed here",
                path.shown()
            )),
            None => output.tell(&format!("{}: no mistakes", path.shown())),
        }
        files.push(serde_json::json!({ "file": path, "errors": wrong, "dump": dump, "audit": audit }));
    }
    output.result(
        serde_json::json!({ "errors": errors, "warnings": warnings, "files": files, "failed": failed }),
    );
    if arguments.strict {
        errors += warnings;
    }
    // The last one is told as the reason of the command's failure.
    let last = match errors {
        0 => unread.pop(),
        errors => Some(Failure::Source { errors }),
    };
    unread.iter().for_each(|failure| output.fault(failure));
    last.map_or(Ok(()), Err)
}

/// The world in which a scenario or policy was made, if it is another than this one.
fn older(loaded: &Loaded) -> Option<&str> {
    let scenario = loaded.scenario.as_ref().and_then(|scenario| scenario.origin.engine.as_deref());
    let made = scenario.or(loaded.policy.as_ref().map(|policy| policy.origin.engine.as_str()));
    made.filter(|engine| *engine != ENGINE)
}

/// Remarks about the file itself; what is remarked about a file that it uses is told where that file is checked, and
/// with `--verbose`.
fn shown(output: &Output, mut remarks: Vec<Diagnostic>) -> Vec<Diagnostic> {
    let is_own = |remark: &Diagnostic| remark.place().is_none_or(|place| place.file == FileId::default());
    remarks.retain(|remark| !output.quiet && (output.verbose || is_own(remark)));
    remarks
}

/// Makes the changes that the diagnostics offer in the file itself; whether there were any.
fn fix(output: &Output, path: &Path, loaded: &Loaded) -> Result<bool, Failure> {
    let root = FileId::default();
    let (text, made) = apply_fixes(root, loaded.sources.text(root), &loaded.diagnostics);
    if made > 0 {
        write_again(path, &text)?;
        output.tell(&format!("{}: {} made", path.shown(), plural(made, "change")));
    }
    Ok(made > 0)
}

fn json(value: &impl serde::Serialize) -> serde_json::Value {
    serde_json::to_value(value).expect("trees and tables have string keys only")
}
