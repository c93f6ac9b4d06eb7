//! Reference drivers where somebody tries to make them crash: with their perfect eyes they are the
//! careful drivers that the verdicts take them for.

use std::sync::atomic::AtomicBool;

use avastra::model::Avoidability;
use avastra::study::play;

use crate::world::run_against;
use crate::world::space;

/// Episodes on each road.
const EPISODES: u32 = 12;

/// Whom they do run into, nobody could have avoided, even without any delay: somebody who walks or drives
/// onto the way where the way is the vehicle's already.
#[test]
fn careful_drivers_run_into_nobody_whom_anybody_could_avoid() {
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
        assert!(at_fault.is_empty(), "{ads}: {at_fault:?}");
        assert!(arrived * 100 >= 95 * numbers.len(), "{ads}: {arrived} of {} arrive", numbers.len());
    }
}
