//! Reference drivers in episodes of random search: with perfect perception they are as careful as the verdicts
//! assume.

use std::sync::atomic::AtomicBool;

use avastra::model::Avoidability;
use avastra::run::play;

use crate::world::{run_against, space};

/// Episodes on each road.
const EPISODES: u32 = 25;

/// A careful driver hits an obstacle in at most one episode of twenty: mostly one that crosses so late that only swerving at once
/// would help, and the models brake. In at most one of fifty another careful driver would have avoided it.
#[test]
fn careful_drivers_hit_few_obstacles_that_another_avoids() {
    let space = space("avastra45.ava");
    for ads in ["cc", "fsm", "rss"] {
        let run = run_against(ads, space.clone(), EPISODES, 19, &[]);
        let numbers: Vec<usize> = (0..run.episodes()).collect();
        let (mut arrived, mut at_fault) = (0, Vec::new());
        play::<()>(&run, &numbers, 2, &AtomicBool::new(false), &mut |summary, log| {
            arrived += usize::from(log.end.name() == "arrived");
            at_fault.extend(summary.collisions.into_iter().filter(|finding| {
                !finding.facts.struck && finding.judgement.class != Avoidability::Unavoidable
            }));
            assert_eq!(log.red_runs, 0, "{ads}, episode {}", summary.episode);
            Ok(())
        })
        .expect("nothing here fails");
        let avoided = at_fault.iter().filter(|finding| finding.facts.avoidable).count();
        let of = numbers.len();
        assert!(avoided * 50 <= of && at_fault.len() * 20 <= of, "{ads}: {avoided} avoided, {at_fault:?}");
        assert!(arrived * 100 >= 95 * numbers.len(), "{ads}: {arrived} of {} arrive", numbers.len());
    }
}
