//! Reference drivers where somebody tries to make them crash: with their perfect eyes they are the
//! careful drivers that the verdicts take them for.

use std::sync::atomic::AtomicBool;

use avastra::study::play;

use crate::world::run_against;
use crate::world::space;

#[test]
fn careful_drivers_run_into_nobody_in_random_search() {
    let space = space("avastra45.ava");
    for ads in ["cc", "fsm", "rss"] {
        let run = run_against(ads, space.clone(), 40, 19, &[]);
        let numbers: Vec<usize> = (0..run.episodes()).collect();
        let mut arrived = 0;
        play::<()>(&run, &numbers, 2, &AtomicBool::new(false), &mut |summary, log| {
            arrived += usize::from(log.end.name() == "arrived");
            let at_fault = summary.collisions.iter().find(|finding| !finding.facts.struck);
            assert!(at_fault.is_none(), "{ads}, episode {}: {at_fault:?}", summary.episode);
            assert_eq!(log.red_runs, 0, "{ads}, episode {}", summary.episode);
            Ok(())
        })
        .expect("nothing here fails");
        assert!(arrived * 100 >= 95 * numbers.len(), "{ads}: {arrived} of {} arrive", numbers.len());
    }
}
