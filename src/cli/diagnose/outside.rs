//! What `diagnose` says of a driving system of any kind: what the finding hangs on, as it shows from outside.

use avastra_campaign::oracle::{Fate, HangsOn, Response, Swap, Swaps};

use super::modules::noise_text;

/// All about one finding.
pub fn whole_text(swaps: &Swaps) -> String {
    let [table, response, beside] = [table_text(swaps), response_text(swaps), beside_text(swaps)];
    format!("{table}{response}{beside}\n\n{}", sentence(swaps))
}

/// What it hangs on, in a word or two.
pub fn cause(swaps: &Swaps) -> String {
    swaps.hangs_on.map_or("none", HangsOn::name).to_owned()
}

fn table_text(swaps: &Swaps) -> String {
    let Swaps { noun, from_s, .. } = swaps;
    let head = format!("from {from_s:.1} s on");
    let mut text =
        format!("\n{head:<50}{:<20}{:<24}{}", "what becomes of it", "the drive", "with other noise");
    for swap in &swaps.swaps {
        let (change, fate) = (swap.change.in_words(), swap.fate.in_words(noun));
        let noise = swap.noise.map_or(String::new(), noise_text);
        // Lights are changed earlier.
        let early =
            if swap.from_s < *from_s { format!(" from {:.1} s on", swap.from_s) } else { String::new() };
        let line = format!("{:<50}{fate:<20}{:<24}{noise}", change + &early, drive_text(swap));
        text.push_str(&format!("\n{}", line.trim_end()));
    }
    if let Some(chance) = swaps.chance {
        let count = format!("no {noun} in {} of {}", chance.vanished, chance.replays);
        text.push_str(&format!("\n{:<94}{count}", "nothing changed (chance)"));
    }
    text
}

/// What a change did to the drive.
fn drive_text(swap: &Swap) -> String {
    match (swap.differs_s, swap.told_s) {
        (Some(differs_s), _) => format!("differs from {differs_s:.2} s"),
        (None, None) if swap.change.is_told() => "nothing was changed".to_owned(),
        (None, _) => "is the same".to_owned(),
    }
}

fn response_text(swaps: &Swaps) -> String {
    let Some(Response { shown_s, late_s, braking, minds_its_like, minds_speed, .. }) = swaps.response else {
        return "\n\nIts reactions were not measured: there was no straight and free way at 5 m/s, or the program failed.".to_owned();
    };
    let mut text = format!("\n\nIt was told at {shown_s:.1} s of a car in its way that was not there:");
    match late_s {
        None => text.push_str("\n- It did nothing about it."),
        Some(late_s) => text.push_str(&format!("\n- It reacted after {late_s:.2} s.")),
    }
    match braking {
        Some(part) if late_s.is_some() => {
            text.push_str(&format!("\n- It braked with {:.0} % of what was needed.", 100.0 * part));
        }
        _ if late_s.is_some() => text.push_str("\n- It drove around it."),
        _ => {}
    }
    if minds_its_like == Some(false) {
        text.push_str("\n- It did nothing about a road user like the one that this is about.");
    }
    if late_s.is_some() && minds_speed == Some(false) {
        text.push_str("\n- It did the same if the car was as fast as itself.");
    }
    text
}

/// Where it drives on straight roads, if that is beside its route.
fn beside_text(swaps: &Swaps) -> String {
    if swaps.offset_m == 0.0 {
        return String::new();
    }
    let side = if swaps.offset_m > 0.0 { "left" } else { "right" };
    format!("\n\nOn straight roads it drives {:.2} m to the {side} of its route.", swaps.offset_m.abs())
}

/// The verdict in a sentence that follows from the evidence alone.
pub fn sentence(swaps: &Swaps) -> String {
    let noun = swaps.noun;
    let late_s = swaps.response.and_then(|response| response.late_s).unwrap_or_default();
    let braking = swaps.response.and_then(|response| response.braking).unwrap_or_default();
    let Some(hangs_on) = swaps.hangs_on else {
        return format!("nothing is named that the {noun} hangs on: {}", lack_text(swaps));
    };
    let (what, why) = match hangs_on {
        HangsOn::IgnoredLights => (
            "ignored lights",
            "it passed one that was not green, and drives the same whatever lights show".to_owned(),
        ),
        HangsOn::IgnoredRoadUser => (
            "an ignored road user",
            "it drives the same if it is not told of it, and does nothing about one like it in its way"
                .to_owned(),
        ),
        HangsOn::IgnoredSpeeds => {
            ("ignored speeds", "it drives the same if it is told that others stand".to_owned())
        }
        HangsOn::Delay => (
            "a delay",
            format!("it reacts after {late_s:.2} s, and told of things so long before, there is no {noun}"),
        ),
        HangsOn::Latency => ("the latency of the profile", format!("obeyed at once, there is no {noun}")),
        HangsOn::Perception => ("what is perceived", format!("told the truth, there is no {noun}")),
        HangsOn::Brakes => {
            let percent = 100.0 * braking;
            let why = format!(
                "it brakes with {percent:.0} % of what is needed, and with stronger brakes there is no {noun}"
            );
            ("the brakes", why)
        }
        HangsOn::Steering => {
            ("the steering", format!("it drives beside its route, and turned back there is no {noun}"))
        }
        HangsOn::Sides => ("left and right", format!("with both exchanged there is no {noun}")),
        HangsOn::Room => {
            ("how much room it keeps", format!("told of others nearer or larger, there is no {noun}"))
        }
    };
    format!("the {noun} hangs on {what}: {why}")
}

/// Why nothing is named.
fn lack_text(swaps: &Swaps) -> String {
    let noun = swaps.noun;
    let removing: Vec<String> = swaps
        .swaps
        .iter()
        .filter(|swap| swap.noise.is_some_and(|noise| noise.is_told_apart()))
        .map(|swap| swap.change.in_words())
        .collect();
    let failed = swaps.swaps.iter().any(|swap| swap.fate == Fate::Failed);
    match (&swaps.chance, removing.as_slice()) {
        _ if failed => "the program failed when something was changed".to_owned(),
        (Some(chance), []) => format!(
            "what removes it is not told apart from chance, which removes it in {} of {} replays",
            chance.vanished, chance.replays
        ),
        (_, []) => format!("no change that is made for sure removes the {noun}"),
        (_, _) if swaps.response.is_none() => "its reactions could not be measured".to_owned(),
        (_, all) => {
            format!("these remove the {noun}, and would save a sound driver, too: {}", all.join("; "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_campaign::oracle::Change;

    #[test]
    fn a_table_says_what_was_not_used() {
        let swap = |change, told_s, differs_s| Swap {
            change,
            fate: Fate::Same,
            from_s: 2.0,
            told_s,
            differs_s,
            noise: None,
        };
        let swaps = Swaps {
            noun: "breach",
            found_s: 9.0,
            from_s: 2.0,
            swaps: vec![
                swap(Change::Red, Some(2.0), None),
                swap(Change::WithoutAll, None, None),
                swap(Change::Braking(2.0), None, Some(4.0)),
            ],
            response: None,
            offset_m: -0.3,
            passed_light: true,
            chance: None,
            hangs_on: Some(HangsOn::IgnoredLights),
        };
        let text = whole_text(&swaps);
        for wanted in [
            "it is told that lights are red                    breach              is the same",
            "it is told of nobody                              breach              nothing was changed",
            "its brake acts 2.0 times as strongly              breach              differs from 4.00 s",
            "were not measured",
            "0.30 m to the right of its route",
            "the breach hangs on ignored lights",
        ] {
            assert!(text.contains(wanted), "{wanted}: {text}");
        }
    }
}
