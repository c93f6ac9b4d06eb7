//! The results of all studies, as one text in Markdown: `RESULTS.md`. It follows only from the studies' files and from
//! what was kept of playing them, so it is written again to the same bytes.

use std::collections::BTreeMap;

use avastra_base::outside::in_markdown_cell;
use avastra_campaign::study::{
    Agreement, BaselineComparison, ComparedFigure, ComparedPair, Departures, MeasuredAgent, MeasuredRoad,
    P_MAX, Played, PublishedTable, StudyFile, StudySettings, Verdict, measured_roads,
};

use super::study::estimate;

/// The text before the first chapter; `{folder}` is where the studies are.
const HEAD: &str = "\
# Results

`avastra study results` wrote this file from the studies in `{folder}/*.yaml` and from what was kept of playing them,
`*.jsonl` beside them; no figure is typed by hand, and a test writes it again. Everything was played against avastra's
own driving systems in avastra's own world: no figure says anything about Apollo or LGSVL, which the paper used.
How these drive the tests of Euro NCAP, the pre-crash types of NHTSA and the ranges of UN R157, by family: [scenarios/catalogue](scenarios/catalogue/README.md).

How to read it:
- A number is the mean over independent trainings (or repetitions, of agents that have nothing to learn), in brackets with Student's 95 % interval over them; where none was found at all, with Poisson's, which takes collisions to be independent.
- Â12 is how probable it is that a value of the first is larger than one of the second; 0.5 is chance. Beside it p of Mann–Whitney's test after Holm's correction over the study, and p of Wilcoxon's test over pairs that met the same episodes, not corrected.
- Published figures are single numbers without intervals, so only ours are tested.
";

/// Measures that every study shows.
const SHOWN: [&str; 3] = ["counted", "kinds", "kinds_per_h"];

/// A study with what was kept of playing it.
pub struct Chapter {
    /// Its name, that of its file.
    pub name: String,
    /// The command that plays it.
    pub command: String,
    pub file: StudyFile,
    /// The settings that the file asks for today.
    pub wanted: StudySettings,
    pub played: Option<Played>,
}

/// All studies of a folder: first those with published figures, then the others.
pub fn results(folder: &str, chapters: &[Chapter]) -> String {
    let mut chapters: Vec<&Chapter> = chapters.iter().collect();
    chapters.sort_by_key(|chapter| (chapter.file.published.is_empty(), chapter.name.clone()));
    let mut text = HEAD.replace("{folder}", folder);
    text.push_str(&answers_text(&chapters));
    for chapter in chapters {
        let Chapter { name, command, file, .. } = chapter;
        text.push_str(&format!("\n## {name}\n"));
        if let Some(question) = &file.question {
            text.push_str(&format!("\n*{question}*\n"));
        }
        match &chapter.played {
            None => text.push_str(&format!("\nNot played yet: `{command}`\n")),
            Some(played) => text.push_str(&played_text(chapter, played)),
        }
    }
    text
}

/// The measures by which the answers say who finds more.
const ANSWERED: [(&str, &str); 2] =
    [("counted", "collisions after training"), ("kinds_per_h", "kinds an hour")];

/// Of each study that was played in full: whom it tells apart from its first baseline, by road.
fn answers_text(chapters: &[&Chapter]) -> String {
    let (mut rows, mut open) = (Vec::new(), Vec::new());
    for Chapter { name, played, file, wanted, .. } in chapters {
        let Some(baseline) = file.baselines.first() else { continue };
        // A part of a study tells nobody apart.
        let Some(played) = played.as_ref().filter(|played| played.departures(wanted).smaller.is_empty())
        else {
            open.push(name.as_str());
            continue;
        };
        let roads = measured_roads(&played.settings, &played.cells);
        for agent in played.settings.agents.iter().filter(|agent| agent.label != *baseline) {
            let answer = |measure: &str| answer(&roads, measure, &agent.label, baseline);
            let answers: Vec<String> = ANSWERED.iter().filter_map(|(measure, _)| answer(measure)).collect();
            if answers.len() == ANSWERED.len() {
                let compared = vec![name.clone(), format!("{} / {baseline}", agent.label)];
                rows.push([compared, answers].concat());
            }
        }
    }
    if rows.is_empty() && open.is_empty() {
        return String::new();
    }
    let unanswered = match open.is_empty() {
        true => String::new(),
        false => format!("\nNot answered, because not played in full: {}.\n", open.join(", ")),
    };
    if rows.is_empty() {
        return format!("\n## Answers\n{unanswered}");
    }
    let head = ["study", "comparison"].into_iter().chain(ANSWERED.map(|(_, words)| words));
    format!(
        "\n## Answers\n\nOn how many roads the first of two finds more, finds less, and is not told apart (p ≥ {P_MAX} after Holm's \
         correction over the study). A kind counts if it recurs, and the training is charged.\n\n{}{unanswered}",
        table(head, rows)
    )
}

/// How many roads tell an agent apart from a baseline by a measure; `None` if they were not compared.
fn answer(roads: &[MeasuredRoad], measure: &str, agent: &str, baseline: &str) -> Option<String> {
    let all = roads.iter().flat_map(|road| &road.comparisons).filter(|one| one.measure == measure);
    let (mut more, mut less, mut open) = (0, 0, 0);
    for one in all {
        let superiority = match (one.agent == agent, one.baseline == agent) {
            (true, false) if one.baseline == baseline => one.superiority,
            (false, true) if one.agent == baseline => 1.0 - one.superiority,
            _ => continue,
        };
        match one.p_holm < P_MAX {
            false => open += 1,
            true if superiority > 0.5 => more += 1,
            true => less += 1,
        }
    }
    (more + less + open > 0).then(|| format!("{more} more, {less} less, {open} open"))
}

fn played_text(chapter: &Chapter, played: &Played) -> String {
    let mut text = conditions_text(chapter, played);
    let roads = measured_roads(&played.settings, &played.cells);
    let roads: Vec<&MeasuredRoad> = roads.iter().filter(|road| !road.agents.is_empty()).collect();
    let published = chapter.file.published.iter().map(|table| table.measure.as_str());
    let more =
        published.filter(|measure| !SHOWN.contains(measure)).collect::<std::collections::BTreeSet<_>>();
    for measure in SHOWN.into_iter().chain(more) {
        text.push_str(&format!("\n{}\n\n{}", title(measure, played), measure_table(measure, played, &roads)));
    }
    for table in &chapter.file.published {
        text.push_str(&published_text(table, played));
    }
    for (measure, question) in
        [("counted", "Who counts more collisions"), ("kinds_per_h", "Who finds more kinds in an hour")]
    {
        text.push_str(&comparisons_text(measure, question, &roads));
    }
    if let Some(remarks) = &chapter.file.remarks {
        text.push_str(&format!("\nWhat to make of it: {}\n", remarks.trim()));
    }
    text
}

/// How large it was, by what it was played, and how to play it again.
fn conditions_text(chapter: &Chapter, played: &Played) -> String {
    let settings = &played.settings;
    let Departures { smaller, other } = played.departures(&chapter.wanted);
    let mut text = String::new();
    if !smaller.is_empty() {
        text.push_str(&format!("\n**Smaller than the study: {}.**\n", smaller.join("; ")));
    }
    if !other.is_empty() {
        text.push_str(&format!("\n**Not the study as it stands today: {}.**\n", other.join("; ")));
    }
    let mut alike: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for agent in &settings.agents {
        let size = match &agent.training {
            None if agent.searched == 0 => counted(agent.repeats, "repetition"),
            None => {
                format!("{} of {}", counted(agent.repeats, "repetition"), counted(agent.searched, "episode"))
            }
            Some(plan) => {
                format!("{} of {}", counted(agent.repeats, "training"), counted(plan.episodes, "episode"))
            }
        };
        alike.entry(size).or_default().push(&agent.label);
    }
    let sizes = alike.iter().map(|(size, labels)| format!("{size} ({})", labels.join(", ")));
    let plan = &settings.evaluation;
    let config = chapter.file.ads_config.as_deref().and_then(|config| config.rsplit('/').next());
    let config = config.map(|config| format!(" with `{config}`"));
    let commit = played.commit.as_deref().map(|commit| format!(", commit {commit}"));
    let took = played.wall_s().map(|wall_s| format!(" in {} of one worker", duration(wall_s)));
    text.push_str(&format!(
        "\n{} of {} cells of {}. Each is judged by {} under each of {}; all seeds follow from {}. \
         Played by avastra {}{}, world `{}`, against `{}`{}: {:.1} h simulated{}. Play it again: `{}`\n",
        played.cells.len(),
        settings.agents.iter().map(|agent| agent.repeats as usize).sum::<usize>()
            * settings.conditions.roads.len(),
        sizes.collect::<Vec<_>>().join(", "),
        counted(plan.episodes, "episode"),
        counted(plan.seeds, "seed"),
        settings.first_seed,
        settings.conditions.avastra,
        commit.unwrap_or_default(),
        settings.conditions.engine,
        settings.conditions.ads,
        config.unwrap_or_default(),
        played.simulated_h(),
        took.unwrap_or_default(),
        chapter.command,
    ));
    text
}

/// `3 trainings`, `1 training`.
fn counted(count: u32, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// A span of time in the unit that fits it.
fn duration(time_s: f64) -> String {
    match time_s {
        ..120.0 => format!("{time_s:.0} s"),
        ..7200.0 => format!("{:.0} min", time_s / 60.0),
        _ => format!("{:.1} h", time_s / 3600.0),
    }
}

/// The title of a measure, above its table.
fn title(measure: &str, played: &Played) -> String {
    let episodes = played.settings.evaluation.episodes;
    match measure {
        "counted" => format!("Counted collisions in {episodes} episodes:"),
        "kinds" => "Kinds of failures that recur, of everything that was found:".to_owned(),
        "kinds_per_h" => "The same of an hour of everything that was simulated:".to_owned(),
        "ttfc_s" => "Time to the first counted collision, s, over the episodes that have one:".to_owned(),
        other => format!("`{other}`:"),
    }
}

fn measure_table(measure: &str, played: &Played, roads: &[&MeasuredRoad]) -> String {
    let rows = played.settings.agents.iter().map(|agent| {
        let cell = |road: &&MeasuredRoad| {
            let found = road.agents.iter().find(|found| found.agent == agent.label);
            let found = found.and_then(|found: &MeasuredAgent| found.measures.get(measure));
            found.map_or("-".to_owned(), estimate)
        };
        [agent.label.clone()].into_iter().chain(roads.iter().map(cell)).collect()
    });
    table(["agent"].into_iter().chain(roads.iter().map(|road| road.road.as_str())), rows)
}

/// A table of published figures beside ours, with what agrees.
fn published_text(published: &PublishedTable, played: &Played) -> String {
    let settings = &played.settings;
    let agents: Vec<&str> = settings.agents.iter().map(|agent| agent.label.as_str()).collect();
    let roads: Vec<&str> = settings.conditions.roads.iter().map(String::as_str).collect();
    let Agreement { figures, pairs } = Agreement::new(published, &agents, &roads, &played.cells);
    let mut text = format!("\nBeside {} (`{}`):\n", published.source, published.measure);
    if figures.is_empty() {
        return text + "\nnothing of it was played.\n";
    }
    let rows = figures.iter().map(|figure| {
        let within = figure.is_within().map_or("-", |is_within| if is_within { "yes" } else { "no" });
        vec![
            figure.road.clone(),
            figure.agent.clone(),
            figure.published.to_string(),
            estimate(&figure.ours),
            within.to_owned(),
        ]
    });
    text.push_str(&format!(
        "\n{}",
        table(["road", "agent", "published", "ours", "within our interval"], rows)
    ));
    let within = figures.iter().filter_map(ComparedFigure::is_within);
    let (within, judged) = within.fold((0, 0), |(yes, all), is| (yes + usize::from(is), all + 1));
    text.push_str(&format!("\n{within} of {judged} published figures lie within our interval."));
    let of = |verdict: Verdict| pairs.iter().filter(|pair| pair.verdict == verdict).collect::<Vec<_>>();
    for (verdict, words) in [
        (Verdict::Same, "go the same way here"),
        (Verdict::Opposite, "go the other way here"),
        (Verdict::NotToldApart, "are not told apart here"),
    ] {
        let found = of(verdict);
        if !found.is_empty() {
            text.push_str(&format!(
                " {} of {} orders {words}{}: {}.",
                found.len(),
                pairs.len(),
                if verdict == Verdict::NotToldApart { format!(" (p ≥ {P_MAX})") } else { String::new() },
                orders_text(&found)
            ));
        }
    }
    text + "\n"
}

/// `ddqn > random on corner, boulevard; …`
fn orders_text(pairs: &[&ComparedPair]) -> String {
    let mut by_order: Vec<(String, Vec<&str>)> = Vec::new();
    for pair in pairs {
        let order = format!("{} > {}", pair.larger, pair.smaller);
        match by_order.iter_mut().find(|(known, _)| *known == order) {
            Some((_, roads)) => roads.push(&pair.road),
            None => by_order.push((order, vec![&pair.road])),
        }
    }
    let orders = by_order.iter().map(|(order, roads)| format!("{order} on {}", roads.join(", ")));
    orders.collect::<Vec<_>>().join("; ")
}

/// Every agent beside every baseline, by one measure.
fn comparisons_text(measure: &str, question: &str, roads: &[&MeasuredRoad]) -> String {
    let mut rows: Vec<(String, BTreeMap<&str, &BaselineComparison>)> = Vec::new();
    for road in roads {
        for one in road.comparisons.iter().filter(|one| one.measure == measure) {
            let name = format!("{} / {}", one.agent, one.baseline);
            match rows.iter_mut().find(|(known, _)| *known == name) {
                Some((_, found)) => drop(found.insert(&road.road, one)),
                None => rows.push((name, BTreeMap::from([(road.road.as_str(), one)]))),
            }
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    let rows = rows.into_iter().map(|(name, found)| {
        let cell = |road: &&MeasuredRoad| match found.get(road.road.as_str()) {
            None => "-".to_owned(),
            Some(one) => {
                let pairs = one.paired.map_or(String::new(), |paired| format!(", in pairs {:.3}", paired.p));
                format!("{:.2} (p {:.3}{pairs})", one.superiority, one.p_holm)
            }
        };
        [name].into_iter().chain(roads.iter().map(cell)).collect()
    });
    let head = ["comparison"].into_iter().chain(roads.iter().map(|road| road.road.as_str()));
    format!("\n{question} (Â12):\n\n{}", table(head, rows))
}

/// A table in Markdown; all columns but the first are aligned right.
fn table<'a>(head: impl IntoIterator<Item = &'a str>, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| in_markdown_cell(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let head: Vec<String> = head.into_iter().map(str::to_owned).collect();
    let rule: String = (0..head.len()).map(|column| if column == 0 { "|---" } else { "|--:" }).collect();
    let mut text = format!("{}{rule}|\n", line(&head));
    rows.into_iter().for_each(|row| text.push_str(&line(&row)));
    text
}
