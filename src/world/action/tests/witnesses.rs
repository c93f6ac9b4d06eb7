//! Witnesses run: those of equalities that depend on each other, and those of the shipped spaces. Witnesses of random
//! spaces are tried in `promise`.

use std::path::Path;

use crate::action::tests::Plain;
use crate::action::{ActionTable, Situation};
use avastra_lang::check::{Loaded, ReadError, load};
use avastra_lang::model::{Reach, RulesInForce};
use avastra_lang::prove::witness;

const HEAD: &str = "language 1
road corner {
  map: \"made_up.xodr\"
  start: lane 1/-1 at 10 m
  goal: lane 1/-1 at 90 m
}
";

/// A straight road of 100 m: small, because it is read twice for every space.
const MAP: &str = r#"<OpenDRIVE><header name="made up"/><road id="1" length="100" junction="-1">
<type s="0" type="town"><speed max="11" unit="m/s"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center>
<right><lane id="-1" type="driving"><width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
</road></OpenDRIVE>"#;

pub(super) fn compiled(text: &str) -> Loaded {
    let is_map = |path: &Path| path.ends_with("made_up.xodr");
    let read = |path: &Path| -> Result<String, ReadError> {
        Ok(if is_map(path) { MAP.to_owned() } else { text.to_owned() })
    };
    load(Path::new("a.ava"), &read).unwrap()
}

/// Equalities that depend on each other are solved in the order of their dependence, whatever the order of declaration.
/// Both drawing and the search for witnesses do so.
#[test]
fn a_chain_of_equalities_is_solved_from_its_end() {
    let speeds =
        ["first", "second", "third", "fourth"].map(|name| format!("any {name}: Speed in 1 m/s .. 20 m/s"));
    let text = format!(
        "{HEAD}action ahead({}) {{ spawn Sedan ahead 50 m {{ lane: Current, speed: first, does: DriveAhead }} }}\n\
         rule r0 on ahead: first == second * 0.5 + 4 m/s\n\
         rule r1 on ahead: second == third * 0.5 + 4 m/s\n\
         rule r2 on ahead: third == fourth * 0.5 + 4 m/s\n",
        speeds.join(", ")
    );
    let space = compiled(&text).space.unwrap();
    let row = space.rows.iter().find(|row| row.label == "ahead()").unwrap();
    let road = &space.roads[0];
    assert!(witness(&space, row, road).is_some());
    let rules = RulesInForce::by_default(&space);
    let memory = space.initial_memory(0);
    for step in 0..8 {
        let situation = Situation {
            memory: &memory,
            road,
            rules: &rules,
            surroundings: &Plain(0.0),
            seed: 0,
            step,
            happened_s: &[],
        };
        let offer = ActionTable::new(space.clone()).offer(&situation, row.index);
        assert!(offer.is_ok(), "{offer:?}");
    }
}

/// Every row of the shipped spaces has a witness on every road, and every witness runs.
#[test]
fn shipped_rows_have_witnesses_that_run() {
    for path in ["scenarios/avastra45.ava", "scenarios/deepcollision52.ava"] {
        let table = crate::action::tests::table(path);
        let space = table.space();
        let rules = RulesInForce::new(space, &[], &[]).unwrap();
        for row in table.rows() {
            for (road, reach) in space.roads.iter().zip(&row.roads) {
                if matches!(reach, Reach::Dead { .. }) {
                    continue;
                }
                let found =
                    witness(space, row, road).unwrap_or_else(|| panic!("{} on {}", row.label, road.name));
                let memory = &found.memory;
                let situation = Situation {
                    memory,
                    road,
                    rules: &rules,
                    surroundings: &Plain(0.0),
                    seed: 0,
                    step: 0,
                    happened_s: &[],
                };
                let judged = table.check(&situation, row.index, &found.values);
                assert!(judged.is_ok(), "{} on {}: {judged:?}", row.label, road.name);
            }
        }
    }
}
