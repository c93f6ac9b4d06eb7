//! The results of an estimate: probabilities and rates with their intervals, and where the probability lies.
//!
//! Computed from the parts alone. While some are missing, the result covers those that are there, and says so.

use std::collections::BTreeMap;

use avastra_base::statistics::{Interval, binomial_missing, bisect, weighted};

use crate::estimate::part::{Event, Part, PartRecord};
use crate::estimate::settings::{EstimateSettings, EventKind, Method};

/// The population that an estimate's rates refer to.
pub const FRAME: &str = "these are rates of the episodes of this space, which searches for trouble, with every road as often as any \
                         other: no rates on the road";

/// The result of an estimate; written to `results.json`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EstimateResults {
    /// Raised whenever a field changes its meaning or goes away.
    pub schema: u32,
    pub event: EventKind,
    pub method: Method,
    /// Number of parts that are there, and of all parts, if no rule stops the estimate before.
    pub parts: usize,
    pub parts_wanted: usize,
    /// Largest share of estimates like this whose interval misses the truth, over all looks that the stopping rules
    /// take; and the share for the look that this interval belongs to.
    pub missing: f64,
    pub missing_at_look: f64,
    pub roads: Vec<RoadEstimate>,
    /// All roads together, each as often as any other; `None` until each road has the same parts.
    pub together: Option<Probability>,
    /// The goals (`--precision`, `--hours`) that were missed though all parts are played, or a limit stopped them, in words.
    pub missed_goals: Vec<String>,
    /// Where the probability lies, the most of it first; empty for a method that does not keep its events.
    pub mass: Vec<Mass>,
}

/// The estimate on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RoadEstimate {
    pub road: String,
    #[serde(flatten)]
    pub estimate: Probability,
}

/// The contribution of a row on a road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Mass {
    pub road: String,
    /// The row, as the table calls it; `None` where what was hit appeared by no action.
    pub row: Option<String>,
    /// Share of the probability on all roads together.
    pub share: f64,
    /// Events that it was found in.
    pub events: u32,
}

/// A probability, and the rate that follows from it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Probability {
    /// Probability of the event in an episode.
    pub probability: f64,
    /// Clopper and Pearson's exact interval where events are counted; Fay and Feuer's for weighted events where rows are tried
    /// out. Its upper end allows for an event as heavy as any could have been.
    pub interval: Interval,
    /// Episodes with the event in 1,000 km, as a ratio of means; `None` if nothing was driven. Its interval is that of the
    /// probability over the mean distance, which it takes as known.
    pub per_1000_km: Option<f64>,
    pub per_1000_km_interval: Option<Interval>,
    /// Likewise in an hour of driving, that is in 600 steps of 6 s.
    pub per_hour: Option<f64>,
    pub per_hour_interval: Option<Interval>,
    /// Episodes from start to end, and how far they went together.
    pub episodes: u64,
    pub driven_km: f64,
    /// Everything that was simulated, h.
    pub simulated_h: f64,
    /// The simulated hours that counting would need for an interval as narrow, over those that were needed. A rough
    /// figure: `None` for counting, and where too few events were met.
    pub gain: Option<f64>,
    /// Effective number of events (Kish): this many events of equal weight would say as much. `None` if there are no
    /// weights.
    pub effective_events: Option<f64>,
    /// Parts whose estimate is 0.
    pub parts_without: usize,
    pub parts: usize,
}

/// Effective events, or parts with the event, from which on a gain is told. Ours.
const GAIN_EVENTS_MIN: f64 = 10.0;

/// The input of the results.
#[derive(Debug, Clone, Copy)]
pub struct Found<'a> {
    pub records: &'a [PartRecord],
    pub events: &'a [(Part, Event)],
    /// Everything that a pilot simulated before, s.
    pub pilot_s: f64,
    /// The labels of the table's rows.
    pub labels: &'a [String],
}

impl EstimateResults {
    /// The result over parts in any order.
    pub fn new(settings: &EstimateSettings, found: Found) -> EstimateResults {
        let roads = &settings.run.conditions.roads;
        let of = |road: usize| -> Vec<&PartRecord> {
            let mut own: Vec<_> = found.records.iter().filter(|record| record.part.road == road).collect();
            own.sort_by_key(|record| record.part.number);
            own
        };
        let by_road: Vec<Vec<&PartRecord>> = (0..roads.len()).map(of).collect();
        let numbers = |own: &[&PartRecord]| own.iter().map(|record| record.part.number).collect::<Vec<_>>();
        let is_even = by_road.iter().all(|own| numbers(own) == numbers(&by_road[0]) && !own.is_empty());
        let named = roads.iter().zip(&by_road).filter(|(_, own)| !own.is_empty());
        let missing_at_look = settings.missing_at_look();
        let parts_wanted = settings.parts as usize * roads.len();
        let sample =
            |by_road, pilot_s| Sample { method: settings.method, by_road, pilot_s, missing: missing_at_look };
        let together = is_even.then(|| sample(&by_road, found.pilot_s).probability());
        let is_over = |probability: &&Probability| {
            found.records.len() == parts_wanted || settings.is_enough(probability)
        };
        EstimateResults {
            missed_goals: together
                .as_ref()
                .filter(is_over)
                .map_or_else(Vec::new, |found| settings.missed_goals(found)),
            schema: 2,
            event: settings.event.clone(),
            method: settings.method,
            parts: found.records.len(),
            parts_wanted,
            missing: super::settings::MISSING,
            missing_at_look,
            roads: named
                .map(|(road, own)| RoadEstimate {
                    road: road.clone(),
                    estimate: sample(std::slice::from_ref(own), found.pilot_s / roads.len() as f64)
                        .probability(),
                })
                .collect(),
            together,
            mass: mass(roads, &by_road, found),
        }
    }
}

/// Where the probability lies.
fn mass(roads: &[String], by_road: &[Vec<&PartRecord>], found: Found) -> Vec<Mass> {
    // Each road as often as any other, however many of its episodes were played.
    let episodes: Vec<f64> =
        by_road.iter().map(|own| own.iter().map(|record| f64::from(record.episodes)).sum()).collect();
    let mut sums: BTreeMap<(usize, Option<usize>), (f64, u32)> = BTreeMap::new();
    for (part, event) in found.events {
        let (weight, events) = sums.entry((part.road, event.row)).or_default();
        *weight += event.weight / episodes[part.road];
        *events += 1;
    }
    let all: f64 = sums.values().map(|(weight, _)| weight).sum();
    let mut mass: Vec<Mass> = sums
        .into_iter()
        .map(|((road, row), (weight, events))| Mass {
            road: roads[road].clone(),
            row: row.map(|row| found.labels[row].clone()),
            share: weight / all,
            events,
        })
        .collect();
    mass.sort_by(|a, b| b.share.total_cmp(&a.share));
    mass
}

/// The parts of some roads, by road, the same numbers on each.
#[derive(Clone, Copy)]
struct Sample<'a> {
    method: Method,
    by_road: &'a [Vec<&'a PartRecord>],
    pilot_s: f64,
    missing: f64,
}

impl Sample<'_> {
    fn probability(self) -> Probability {
        let all = || self.by_road.iter().flatten();
        let roads = self.by_road.len() as f64;
        // The nth parts of all roads are one sample.
        let samples: Vec<f64> = (0..self.by_road[0].len())
            .map(|number| self.by_road.iter().map(|own| own[number].probability).sum::<f64>() / roads)
            .collect();
        let probability = samples.iter().sum::<f64>() / samples.len() as f64;
        let episodes: u64 = all().map(|record| u64::from(record.episodes)).sum();
        let events: u64 = all().map(|record| u64::from(record.events)).sum();
        let (variance, heaviest) = self.spread();
        let interval = match self.method {
            Method::Count => binomial_missing(events, episodes, self.missing),
            Method::Probe => {
                let Interval { low, high } = weighted(probability, variance, heaviest, self.missing);
                Interval { low, high: high.map(|high| high.min(1.0)) }
            }
        };
        let driven_km = all().map(|record| record.driven_m).sum::<f64>() / 1000.0;
        let (simulated_s, duration_s) = all().fold((self.pilot_s, 0.0), |(all_s, whole_s), record| {
            (all_s + record.simulated_s, whole_s + record.duration_s)
        });
        // The rate in so many kilometres or hours, of which all episodes together had so many.
        let rates = |in_all: f64, of: f64| {
            let scaled = |value: f64| of * value * episodes as f64 / in_all;
            let between = Interval { low: scaled(interval.low), high: interval.high.map(scaled) };
            (in_all > 0.0).then(|| (scaled(probability), between)).unzip()
        };
        let (per_1000_km, per_1000_km_interval) = rates(driven_km, 1000.0);
        let (per_hour, per_hour_interval) = rates(duration_s / 3600.0, 1.0);
        let parts_without = samples.iter().filter(|&&sample| sample == 0.0).count();
        let effective_events = self.effective_events();
        let is_telling = match self.method {
            Method::Count => false,
            Method::Probe => effective_events.is_some_and(|events| events >= GAIN_EVENTS_MIN),
        };
        let counting_s =
            || counted_episodes(probability, interval, self.missing) * duration_s / episodes as f64;
        Probability {
            probability,
            interval,
            per_1000_km,
            per_1000_km_interval,
            per_hour,
            per_hour_interval,
            episodes,
            driven_km,
            simulated_h: simulated_s / 3600.0,
            gain: is_telling.then(|| counting_s() / simulated_s),
            effective_events,
            parts_without,
            parts: samples.len(),
        }
    }

    /// The variance of the mean, and the share of it that the heaviest value has.
    fn spread(self) -> (f64, f64) {
        let roads = self.by_road.len() as f64;
        self.by_road.iter().fold((0.0, 0.0_f64), |(variance, heaviest), own| {
            let count: f64 = own.iter().map(|record| f64::from(record.episodes)).sum();
            let sum: f64 = own.iter().map(|record| record.probability * f64::from(record.episodes)).sum();
            let squares: f64 = own.iter().map(|record| record.weight_squares).sum();
            let of_road = (squares - sum * sum / count).max(0.0) / (count - 1.0).max(1.0) / count;
            let largest = own.iter().map(|record| record.weight_max).fold(0.0, f64::max);
            (variance + of_road / (roads * roads), heaviest.max(largest / count / roads))
        })
    }

    /// See [`Probability::effective_events`].
    fn effective_events(self) -> Option<f64> {
        if self.method != Method::Probe {
            return None;
        }
        let all = || self.by_road.iter().flatten();
        let sum: f64 = all().map(|record| record.probability * f64::from(record.episodes)).sum();
        let squares: f64 = all().map(|record| record.weight_squares).sum();
        Some(if squares > 0.0 { sum * sum / squares } else { 0.0 })
    }
}

/// The number of episodes after which counting events of this probability has an interval as narrow.
fn counted_episodes(probability: f64, Interval { low, high }: Interval, missing: f64) -> f64 {
    let width = high.unwrap_or(1.0) - low;
    let is_narrow = |log_episodes: f64| {
        let episodes = libm::exp(log_episodes);
        let found = weighted(probability, probability / episodes, 1.0 / episodes, missing);
        found.high.unwrap_or(1.0) - found.low <= width
    };
    // From one episode to more than any estimate counts.
    libm::exp(bisect(0.0, 30.0, is_narrow))
}

#[cfg(test)]
mod tests {
    use super::*;
    use avastra_base::statistics::binomial;

    fn record(road: usize, number: u32, events: u32) -> PartRecord {
        PartRecord {
            part: Part { road, number },
            probability: f64::from(events) / 100.0,
            episodes: 100,
            driven_m: 50_000.0,
            duration_s: 4000.0,
            events,
            weight_squares: f64::from(events),
            weight_max: 1.0,
            simulated_s: 4000.0,
            ..PartRecord::default()
        }
    }

    fn found(method: Method, by_road: &[Vec<&PartRecord>]) -> Probability {
        Sample { method, by_road, pilot_s: 0.0, missing: 0.05 }.probability()
    }

    #[test]
    fn counted_parts_give_the_exact_interval_and_the_rate() {
        let parts = [record(0, 0, 1), record(0, 1, 3), record(1, 0, 0), record(1, 1, 0)];
        let by_road = [vec![&parts[0], &parts[1]], vec![&parts[2], &parts[3]]];
        let both = found(Method::Count, &by_road);
        assert!((both.probability - 0.01).abs() < 1e-15);
        assert_eq!(both.interval, binomial(4, 400));
        // Two in a hundred episodes of half a kilometre on the first road, none on the second.
        assert!((both.per_1000_km.unwrap() - 20.0).abs() < 1e-9);
        let first = found(Method::Count, &by_road[..1]);
        assert!((first.per_1000_km.unwrap() - 40.0).abs() < 1e-9);
        // Forty seconds each.
        assert!((both.per_hour.unwrap() - 0.9).abs() < 1e-9);
        assert!((both.per_hour_interval.unwrap().low - 90.0 * both.interval.low).abs() < 1e-9);
        assert_eq!((first.episodes, first.parts, first.parts_without, first.gain), (200, 2, 0, None));
        let many: Vec<PartRecord> = (0..20).map(|number| record(0, number, 1 + 2 * (number % 2))).collect();
        // Whole weights are counts: no gain, and nearly the interval of counting.
        let probed = found(Method::Probe, &[many.iter().collect()]);
        assert!((probed.gain.unwrap() - 1.0).abs() < 0.03, "{probed:?}");
        assert!((probed.effective_events.unwrap() - 40.0).abs() < 1e-9);
        let exact = binomial(40, 2000);
        assert!((probed.interval.low - exact.low).abs() < 3e-4, "{probed:?} {exact:?}");
        assert!((probed.interval.high.unwrap() - exact.high.unwrap()).abs() < 3e-4, "{probed:?} {exact:?}");
        // Nothing in 200 episodes: what counting would say of them.
        let nothing = found(Method::Probe, &by_road[1..]);
        assert_eq!((nothing.probability, nothing.interval.low, nothing.gain), (0.0, 0.0, None));
        assert!((nothing.interval.high.unwrap() - 3.6888794541139363 / 200.0).abs() < 1e-9, "{nothing:?}");
    }

    #[test]
    fn the_mass_lies_where_the_weight_is() {
        let parts = [record(0, 0, 2), record(1, 0, 1)];
        let by_road = [vec![&parts[0]], vec![&parts[1]]];
        let event =
            |road, row, weight| (Part { road, number: 0 }, Event { episode: 0, step: 0, row, weight });
        let events = [event(0, Some(1), 0.1), event(0, Some(1), 0.2), event(1, None, 0.9)];
        let labels = ["a".to_owned(), "b".to_owned()];
        let roads = ["one".to_owned(), "two".to_owned()];
        let found = Found { records: &parts, events: &events, pilot_s: 0.0, labels: &labels };
        let mass = mass(&roads, &by_road, found);
        assert_eq!((mass[0].road.as_str(), mass[0].row.as_deref(), mass[0].events), ("two", None, 1));
        assert!((mass[0].share - 0.75).abs() < 1e-12);
        assert_eq!((mass[1].row.as_deref(), mass[1].events), (Some("b"), 2));
    }
}
