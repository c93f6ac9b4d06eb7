//! Reference drivers in episodes of random search: with perfect perception they are as careful as the verdicts
//! assume.

use std::sync::atomic::AtomicBool;

use avastra::model::Avoidability;
use avastra::run::play;

use crate::world::{run_against, space};

/// Episodes on each road.
const EPISODES: u32 = 12;

/// A careful driver hits an obstacle in at most one episode of thirty, and then no other careful driver would
/// have avoided it: it crosses so late that only swerving at once would help, and the models brake.
#[test]
fn careful_drivers_hit_no_obstacle_that_another_avoids() {
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
        assert!(avoided == 0 && at_fault.len() * 30 <= numbers.len(), "{ads}: {at_fault:?}");
        assert!(arrived * 100 >= 95 * numbers.len(), "{ads}: {arrived} of {} arrive", numbers.len());
    }
}
