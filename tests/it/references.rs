//! Reference drivers where somebody tries to make them crash: with their perfect eyes they are the
//! careful drivers that the verdicts take them for.

use std::sync::atomic::AtomicBool;

use avastra::study::play;

use crate::world::run_against;
use crate::world::space;

/// Episodes on each road.
const EPISODES: u32 = 12;

/// The models know vehicles on a straight road: at night, in the wet, one of them may meet a
/// pedestrian whom another avoids. It may happen in one episode of thirty.
#[test]
fn careful_drivers_run_into_almost_nobody_in_random_search() {
    let space = space("avastra45.ava");
    for ads in ["cc", "fsm", "rss"] {
        let run = run_against(ads, space.clone(), EPISODES, 19, &[]);
        let numbers: Vec<usize> = (0..run.episodes()).collect();
        let (mut arrived, mut at_fault) = (0, Vec::new());
        play::<()>(&run, &numbers, 2, &AtomicBool::new(false), &mut |summary, log| {
            arrived += usize::from(log.end.name() == "arrived");
            at_fault.extend(summary.collisions.into_iter().filter(|finding| !finding.facts.struck));
            assert_eq!(log.red_runs, 0, "{ads}, episode {}", summary.episode);
            Ok(())
        })
        .expect("nothing here fails");
        assert!(at_fault.len() * 30 <= numbers.len(), "{ads}: {at_fault:?}");
        assert!(arrived * 100 >= 95 * numbers.len(), "{ads}: {arrived} of {} arrive", numbers.len());
    }
}
