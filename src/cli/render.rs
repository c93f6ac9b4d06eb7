//! `avastra render`: moments of an emitted scenario as a picture.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::action::ActionTable;
use crate::ads::Selected;
use crate::geometry::Vec2;
use crate::model::{Claim, Scenario};
use crate::report::{Snapshot, picture};
use crate::run::Stage;
use crate::sim::DT_S;

use super::arguments::RenderArguments;
use super::error::Failure;
use super::files::write;
use super::load;
use super::output::Output;

/// A contact is marked this long after it happened, s.
const CONTACT_SHOWN_S: f64 = 1.0;
/// Moments of a strip: this many, one second apart, the last at the first collision.
const STRIP_LEN: u32 = 7;
/// Without a collision: this far apart, the first at the last action, s.
const ACTION_STRIDE_S: f64 = 2.0;

/// Draws the file's scenario.
pub fn render(output: &Output, arguments: &RenderArguments) -> Result<(), Failure> {
    let (table, scenario) = load::scenario(output, &arguments.file)?;
    let scenario = &scenario;
    let times_s = times(arguments, scenario, table.space().episode.step_s)?;
    let asked =
        load::asked(arguments.ads.as_deref(), arguments.ads_config.as_deref(), arguments.ads_cmd.as_deref())?;
    let (ads, _) = asked.selected_for(scenario)?;
    let (moments, names) = moments(&table, scenario, &ads, &times_s)?;
    // A strip ends with its scenario.
    if moments.is_empty() || (!arguments.strip && moments.len() < times_s.len()) {
        return Err(Failure::usage(format!(
            "`{}` is over before {} s",
            scenario.name,
            times_s[moments.len()]
        )));
    }
    let svg = picture(&moments, &names);
    let path = arguments.output.clone().unwrap_or_else(|| {
        let stem = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from(format!("{stem}.svg"))
    });
    let on_stdout = path == Path::new("-");
    if on_stdout {
        output.say(svg.trim_end());
    } else {
        write(&path, &svg)?;
        output.tell(&path.display().to_string());
    }
    let svg = on_stdout.then_some(svg);
    output.result(serde_json::json!({ "picture": path, "times_s": times_s[..moments.len()], "svg": svg }));
    Ok(())
}

/// The moments asked for, rising.
fn times(arguments: &RenderArguments, scenario: &Scenario, step_s: f64) -> Result<Vec<f64>, Failure> {
    if !arguments.strip {
        let mut times_s = arguments.at.clone();
        if times_s.is_empty() {
            return Err(Failure::usage("say which moments: `--at T`, `--at T1,T2,…` or `--strip`"));
        }
        if let Some(time_s) = times_s.iter().find(|time_s| !(time_s.is_finite() && **time_s >= 0.0)) {
            return Err(Failure::usage(format!("`--at {time_s}` is no moment of an episode")));
        }
        times_s.sort_by(f64::total_cmp);
        return Ok(times_s);
    }
    let first_s = scenario.claims.iter().find_map(|claim| match claim {
        Claim::Collision { time, .. } => time.map(|time| time.si()),
        _ => None,
    });
    let Some(first_s) = first_s else {
        let acted = scenario.steps.iter().rfind(|step| step.row.is_some());
        let acted = acted.ok_or_else(|| {
            Failure::usage("`--strip` needs a scenario with an action or a collision: use `--at`")
        })?;
        // The action is carried out between two ticks and is seen one tick later.
        let begin_s = acted.number as f64 * step_s + DT_S;
        return Ok((0..STRIP_LEN).map(|n| begin_s + ACTION_STRIDE_S * f64::from(n)).collect());
    };
    let back = |n: u32| (first_s - f64::from(STRIP_LEN - 1 - n)).max(0.0);
    Ok((0..STRIP_LEN).map(back).collect())
}

/// The world at the first tick at or after each time, as far as the episode lasts; and what the author calls road users,
/// by number, where the engine has no name for them.
fn moments(
    table: &ActionTable,
    scenario: &Scenario,
    ads: &Selected,
    times_s: &[f64],
) -> Result<(Vec<Snapshot>, BTreeMap<u32, String>), Failure> {
    let mut moments: Vec<Snapshot> = Vec::new();
    let mut last_contact: Option<(f64, Vec2)> = None;
    let stage = Stage::new(table, scenario)?;
    let log = stage.play(ads, &mut |world, ads, contacts| {
        if let Some(contact) = contacts.last() {
            last_contact = Some((contact.time_s, contact.point));
        }
        // Half a tick of slack: times are decimals, ticks are multiples of 20 ms.
        while times_s.get(moments.len()).is_some_and(|&time_s| world.time_s() + DT_S / 2.0 >= time_s) {
            let fresh = last_contact.filter(|(time_s, _)| world.time_s() - time_s <= CONTACT_SHOWN_S);
            moments.push(Snapshot {
                world: world.clone(),
                status: ads.status().clone(),
                contact: fresh.map(|(_, point)| point),
            });
        }
    });
    let name = |(id, own): (u32, usize)| (id, table.space().bodies[own].name.clone());
    Ok((moments, log.own_bodies().into_iter().map(name).collect()))
}
