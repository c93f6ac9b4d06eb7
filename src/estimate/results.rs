//! What an estimate found: probabilities and rates with their intervals.
//!
//! Computed from the parts alone. While some are missing, the result covers those that are there, and says so.

use crate::statistics::{Interval, binomial, mean, variance_of_mean};

use crate::estimate::part::PartRecord;
use crate::estimate::settings::{EstimateSettings, EventKind, Method};

/// The result of an estimate; written to `results.json`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EstimateResults {
    /// Raised whenever a field changes its meaning or goes away.
    pub schema: u32,
    pub event: EventKind,
    pub method: Method,
    /// Number of parts that are there, and of all parts.
    pub parts: usize,
    pub parts_wanted: usize,
    pub roads: Vec<RoadEstimate>,
    /// All roads together, each as often as any other; `None` until each road has the same parts.
    pub together: Option<Probability>,
}

/// The estimate on one road.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct RoadEstimate {
    pub road: String,
    #[serde(flatten)]
    pub estimate: Probability,
}

/// A probability, and the rate that follows from it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Probability {
    /// Probability of the event in an episode.
    pub probability: f64,
    /// Clopper and Pearson's exact interval where events are counted; Student's over the parts where episodes split, cut
    /// off at 0 and 1: too short where most parts have not found the event. `None` where all parts are alike: they say
    /// nothing about the spread.
    pub interval: Option<Interval>,
    /// Episodes with the event in 1,000 km, as a ratio of means; `None` if nothing was driven. Its interval is that of the
    /// probability over the mean distance, which it takes as known.
    pub per_1000_km: Option<f64>,
    pub per_1000_km_interval: Option<Interval>,
    /// Episodes from start to end, and how far they went together.
    pub episodes: u64,
    pub driven_km: f64,
    /// Everything that was simulated, h.
    pub simulated_h: f64,
    /// Of splitting: the simulated hours that counting would need for a standard error as small, over those that were
    /// needed. A rough figure, from the spread of the parts: `None` for fewer than twenty of them, or where most have
    /// not found the event.
    pub gain: Option<f64>,
    /// Parts whose estimate is 0.
    pub parts_without: usize,
    pub parts: usize,
}

/// Parts from which on a gain is told. Ours.
const GAIN_PARTS_MIN: usize = 20;

impl EstimateResults {
    /// The result over parts in any order.
    pub fn new(settings: &EstimateSettings, records: &[PartRecord]) -> EstimateResults {
        let roads = &settings.run.roads;
        let of = |road: usize| -> Vec<&PartRecord> {
            let mut own: Vec<_> = records.iter().filter(|record| record.part.road == road).collect();
            own.sort_by_key(|record| record.part.number);
            own
        };
        let by_road: Vec<Vec<&PartRecord>> = (0..roads.len()).map(of).collect();
        let numbers = |own: &[&PartRecord]| own.iter().map(|record| record.part.number).collect::<Vec<_>>();
        let is_even = by_road.iter().all(|own| numbers(own) == numbers(&by_road[0]) && !own.is_empty());
        let named = roads.iter().zip(&by_road).filter(|(_, own)| !own.is_empty());
        EstimateResults {
            schema: 1,
            event: settings.event,
            method: settings.method,
            parts: records.len(),
            parts_wanted: settings.parts as usize * roads.len(),
            roads: named
                .map(|(road, own)| RoadEstimate {
                    road: road.clone(),
                    estimate: Probability::new(settings.method, std::slice::from_ref(own)),
                })
                .collect(),
            together: is_even.then(|| Probability::new(settings.method, &by_road)),
        }
    }
}

impl Probability {
    /// Over the parts of some roads, by road, the same numbers on each.
    fn new(method: Method, by_road: &[Vec<&PartRecord>]) -> Probability {
        let all = || by_road.iter().flatten();
        let roads = by_road.len() as f64;
        // The nth parts of all roads are one sample.
        let samples: Vec<f64> = (0..by_road[0].len())
            .map(|number| by_road.iter().map(|own| own[number].probability).sum::<f64>() / roads)
            .collect();
        let estimate = mean(&samples).expect("there is a part");
        let probability = estimate.mean;
        let episodes: u64 = all().map(|record| u64::from(record.episodes)).sum();
        let events: u64 = all().map(|record| u64::from(record.events)).sum();
        let interval = match method {
            Method::Count => Some(binomial(events, episodes)),
            Method::Split => estimate.interval.map(|found| Interval {
                low: found.low.max(0.0),
                high: found.high.map(|high| high.min(1.0)),
            }),
        };
        let driven_km = all().map(|record| record.driven_m).sum::<f64>() / 1000.0;
        let (simulated_s, duration_s) = all().fold((0.0, 0.0), |(all_s, whole_s), record| {
            (all_s + record.simulated_s, whole_s + record.duration_s)
        });
        let per_km = episodes as f64 / driven_km;
        let scaled = |value: f64| 1000.0 * value * per_km;
        let is_driven = driven_km > 0.0;
        let variance = variance_of_mean(&samples);
        let parts_without = samples.iter().filter(|&&sample| sample == 0.0).count();
        let is_telling = samples.len() >= GAIN_PARTS_MIN && 2 * parts_without <= samples.len();
        // Counting has this variance after so many episodes, each of the mean duration.
        let counting_s = probability * (1.0 - probability) / variance * duration_s / episodes as f64;
        Probability {
            probability,
            interval,
            per_1000_km: is_driven.then(|| scaled(probability)),
            per_1000_km_interval: interval
                .filter(|_| is_driven)
                .map(|found| Interval { low: scaled(found.low), high: found.high.map(scaled) }),
            episodes,
            driven_km,
            simulated_h: simulated_s / 3600.0,
            gain: (method == Method::Split && is_telling && variance > 0.0).then(|| counting_s / simulated_s),
            parts_without,
            parts: samples.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::part::Part;

    fn record(road: usize, number: u32, events: u32) -> PartRecord {
        PartRecord {
            probability: f64::from(events) / 100.0,
            episodes: 100,
            driven_m: 50_000.0,
            duration_s: 4000.0,
            events,
            simulated_s: 4000.0,
            ..PartRecord::new(Part { road, number })
        }
    }

    #[test]
    fn counted_parts_give_the_exact_interval_and_the_rate() {
        let parts = [record(0, 0, 1), record(0, 1, 3), record(1, 0, 0), record(1, 1, 0)];
        let by_road = [vec![&parts[0], &parts[1]], vec![&parts[2], &parts[3]]];
        let found = Probability::new(Method::Count, &by_road);
        assert!((found.probability - 0.01).abs() < 1e-15);
        assert_eq!(found.interval, Some(binomial(4, 400)));
        // Two in a hundred episodes of half a kilometre on the first road, none on the second.
        assert!((found.per_1000_km.unwrap() - 20.0).abs() < 1e-9);
        let first = Probability::new(Method::Count, &by_road[..1]);
        assert!((first.per_1000_km.unwrap() - 40.0).abs() < 1e-9);
        assert_eq!((first.episodes, first.parts, first.parts_without, first.gain), (200, 2, 0, None));
        // Of 2,000 episodes: p (1 - p) / 2,000 is the variance of counting; that of twenty parts with 1 % and 3 % in turn
        // is 1e-4 / 19.
        let many: Vec<PartRecord> = (0..20).map(|number| record(0, number, 1 + 2 * (number % 2))).collect();
        let split = Probability::new(Method::Split, &[many.iter().collect()]);
        let gain = split.gain.unwrap();
        assert!((gain - 0.02 * 0.98 / 2000.0 / (1e-4 / 19.0)).abs() < 1e-9, "{gain}");
        let nothing = Probability::new(Method::Split, &by_road[1..]);
        assert_eq!((nothing.probability, nothing.interval, nothing.gain), (0.0, None, None));
    }
}
