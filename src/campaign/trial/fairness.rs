//! Whether a road user appeared fairly, judged from the outside.
//!
//! Written apart from the rule `no_teleport` and from `world::place`, which it tests. The formulas are plain: they ignore
//! the time in which a brake builds up, and so ask for a little less.

use avastra_base::geometry::distance_m;
use avastra_base::kinematics;
use avastra_base::kinematics::{CAREFUL_BRAKING_MPS2, CAREFUL_DELAY_S};
use avastra_lang::model::vocabulary::Verb;
use avastra_world::action::SpawnRequest;
use avastra_world::sim::World;

/// Rounding of figures, m.
const SLACK_M: f64 = 0.1;

/// Why the road user with this id appeared unfairly, in words; `None` if it appeared fairly or is gone.
pub(super) fn complaint(world: &World, request: &SpawnRequest, id: u32) -> Option<String> {
    let newcomer = world.obstacle(id)?;
    let overlaps = world
        .obstacles_on_level()
        .any(|other| other.id != id && distance_m(&other.outline, &newcomer.outline) <= 0.0);
    if overlaps || newcomer.distance_m <= 0.0 {
        return Some("it appears inside another road user".to_owned());
    }
    let ego_mps = world.ego().speed_mps;
    let along_mps = world.ego_outline().pose.forward().dot(&newcomer.velocity_mps);
    let stopping_m = |closing_mps: f64| {
        let closing_mps = closing_mps.max(0.0);
        kinematics::stopping_m(closing_mps, CAREFUL_DELAY_S, CAREFUL_BRAKING_MPS2)
    };
    // An oncoming vehicle passes in a separate lane, so it needs no stopping zone.
    let zone_m = match request.verb {
        Verb::DriveAhead => stopping_m(ego_mps - along_mps.max(0.0)),
        Verb::WalkAhead | Verb::WalkOpposite => stopping_m(ego_mps - along_mps),
        Verb::CrossRoad | Verb::Walk | Verb::Stand => stopping_m(ego_mps),
        Verb::Overtake | Verb::DriveBehind | Verb::DriveOpposite | Verb::Follow => 0.0,
    };
    if newcomer.distance_m + SLACK_M < zone_m {
        return Some(format!(
            "it appears at {:.1} m, inside the stopping zone of {zone_m:.1} m",
            newcomer.distance_m
        ));
    }
    let notice_m = ego_mps * CAREFUL_DELAY_S;
    let sensed = world.sensed();
    let in_view = sensed.objects.iter().any(|object| object.id == id && object.visible_fraction > 0.0);
    let sight_m = world.conditions().visibility_m;
    if request.verb != Verb::Overtake
        && in_view
        && newcomer.distance_m < sight_m
        && newcomer.distance_m + SLACK_M < notice_m
    {
        return Some(format!("it appears in plain view at {:.1} m of {notice_m:.1} m", newcomer.distance_m));
    }
    None
}
