//! `avastra render`: moments of an emitted scenario as a picture.

use std::path::{Path, PathBuf};

use avastra_base::outside::Shown;
use avastra_campaign::episode::Recorder;
use avastra_campaign::run::Stage;
use avastra_drivers::{Selected, Status};
use avastra_exchange::report::{Snapshot, Subject, picture};
use avastra_lang::model::{Claim, Scenario};
use avastra_world::action::ActionTable;
use avastra_world::sim::{DT_S, World};

use super::arguments::RenderArguments;
use super::error::Failure;
use super::files::{must_end_in, write_result};
use super::load;
use super::look::{self, Looked};
use super::output::Output;

/// A contact is marked this long after it happened, s.
const CONTACT_SHOWN_S: f64 = 1.0;
/// The moments of a strip, s before the first collision or else the first breach.
const STRIP_S: [f64; 5] = [4.0, 2.5, 1.5, 0.5, 0.0];
/// Without either: this far apart, the first at the last action, s.
const ACTION_STRIDE_S: f64 = 2.0;

/// Draws the file's scenario.
pub fn render(output: &Output, arguments: &RenderArguments) -> Result<(), Failure> {
    if let Some(extra) = arguments.rest.first() {
        let hint = match arguments.at.is_empty() {
            true => "",
            false => ": moments are separated by commas, as in `--at 2,9.5`",
        };
        return Err(Failure::usage(format!("unexpected argument `{extra}`{hint}")));
    }
    let stem = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
    let path = arguments.output.clone().unwrap_or_else(|| PathBuf::from(format!("{stem}.svg")));
    let on_stdout = path == Path::new("-");
    if !on_stdout {
        must_end_in(&path, "svg")?;
    }
    let Looked { table, scenario, changed } = look::scenario(output, &arguments.file)?;
    let scenario = &scenario;
    let times_s = times(arguments, scenario, table.space().episode.step_s)?;
    let asked = load::asked(arguments.against.ads.as_deref())?;
    let (ads, is_recorded) = asked.selected_for(scenario)?;
    let (moments, mut subject, is_same) = moments(&table, scenario, &ads, &times_s)?;
    let is_same = is_same.filter(|_| is_recorded);
    if !is_recorded {
        subject.title = title_of_another(arguments, scenario, &subject);
    } else if changed.is_some() && is_same == Some(false) {
        subject.title = format!("{}: what plays now, not what was recorded", scenario.name);
    }
    let banner = changed.map(|changed| changed.banner(is_same));
    banner.iter().for_each(|banner| output.warn(&format!("{}: {banner}", arguments.file.shown())));
    // A strip ends with its scenario.
    if moments.is_empty() || (!arguments.strip && moments.len() < times_s.len()) {
        return Err(Failure::usage(format!(
            "`{}` is over before {} s",
            scenario.name,
            times_s[moments.len()]
        )));
    }
    let svg = picture(&moments, &subject);
    if on_stdout {
        output.document(svg.trim_end());
    } else {
        write_result(arguments.output.as_ref(), &path, &svg)?;
        output.tell(&path.shown().to_string());
    }
    let svg = on_stdout.then_some(svg);
    output.result(serde_json::json!({
        "picture": path, "times_s": times_s[..moments.len()], "changed": banner, "svg": svg,
    }));
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
    let claimed_s = |is_of_a_collision: bool| {
        scenario.claims.iter().find_map(|claim| match claim {
            Claim::Collision { time, .. } if is_of_a_collision => time.map(|time| time.si()),
            Claim::Breach { time, .. } if !is_of_a_collision => time.map(|time| time.si()),
            _ => None,
        })
    };
    let first_s = claimed_s(true).or_else(|| claimed_s(false));
    let Some(first_s) = first_s else {
        let acted = scenario.steps.iter().rfind(|step| step.row.is_some());
        let acted = acted.ok_or_else(|| {
            Failure::usage("`--strip` needs a scenario with an action or a collision: use `--at`")
        })?;
        // The action is carried out between two ticks and is seen one tick later.
        let begin_s = acted.number as f64 * step_s + DT_S;
        return Ok((0..STRIP_S.len()).map(|n| begin_s + ACTION_STRIDE_S * n as f64).collect());
    };
    // The last panel is of the tick after a contact, which shows it.
    Ok(STRIP_S.iter().map(|before_s| (first_s - before_s + DT_S / 2.0).max(0.0)).collect())
}

/// The world at the first tick at or after each time, as far as the episode lasts. Also the subject of the picture, and
/// whether the episode is the recorded one, if the file says.
fn moments(
    table: &ActionTable,
    scenario: &Scenario,
    ads: &Selected,
    times_s: &[f64],
) -> Result<(Vec<Snapshot>, Subject, Option<bool>), Failure> {
    let mut seen: Vec<(World, Status)> = Vec::new();
    let mut recorder = Recorder::default();
    let stage = Stage::new(table, scenario)?;
    let log = stage.play(ads, &mut |world, ads, contacts| {
        recorder.note(world, ads, contacts);
        // Half a tick of slack: times are decimals, ticks are multiples of 20 ms.
        while times_s.get(seen.len()).is_some_and(|&time_s| world.time_s() + DT_S / 2.0 >= time_s) {
            seen.push((world.clone(), ads.status().clone()));
        }
    });
    let contacts = || log.collisions.iter().map(|collision| collision.contact);
    let snapshot = |(world, status): (World, Status)| {
        let since_s = |time_s: f64| world.time_s() - time_s;
        let is_shown = |time_s: f64| (0.0..=CONTACT_SHOWN_S).contains(&since_s(time_s));
        Snapshot {
            contact: contacts().rfind(|contact| is_shown(contact.time_s)),
            braking: recorder.braking(world.ticks()),
            world,
            status,
        }
    };
    let moments = seen.into_iter().map(snapshot).collect();
    let name = |(id, own): (u32, usize)| (id, table.space().bodies[own].name.clone());
    let names = log.own_bodies().into_iter().map(name).collect();
    let hit = log.collisions.first().map(|first| (first.contact.obstacle, first.contact.time_s));
    let title = match scenario.docs.first() {
        Some(doc) => format!("{}: {}", scenario.name, doc.trim()),
        None => scenario.name.clone(),
    };
    Ok((moments, Subject { title, hit, names }, stage.is_as_recorded(&log)))
}

/// The title of a drive that is not the recorded one. It names the driving system and what happens, because the crash in the
/// file may not happen.
fn title_of_another(arguments: &RenderArguments, scenario: &Scenario, subject: &Subject) -> String {
    let driver = arguments.against.ads.as_deref().unwrap_or("another driving system");
    match subject.hit {
        Some((obstacle, at_s)) => {
            format!("{}, driven by {driver}: collision with npc#{obstacle} at {at_s:.2} s", scenario.name)
        }
        None => format!("{}, driven by {driver}: no collision", scenario.name),
    }
}
