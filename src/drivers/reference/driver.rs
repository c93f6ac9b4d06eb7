//! A reference driver: a published model of careful braking in a car that follows its route.
//!
//! The route, its lights and ordinary traffic are the business of [`Idm`], which sees here with the model's
//! own reaction time (what was seen, carried on at constant speed) and brakes for others no harder than is
//! comfortable. Whatever is harder is the model's reaction to a risk.
//!
//! A reference driver is the judge's careful driver: what is in its line of sight, and near enough for
//! the fog, it knows as it truly is. Darkness and rain do not blind it, it ignores traffic behind it, and
//! it does not swerve: the published models brake.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use crate::driver::Ads;
use crate::kit::{Guide, Helm};
use crate::status::{Reason, Status};
use avastra_world::sim::{
    Conditions, Control, DT_S, FRAME_S, Scene, Sensed, SensedObject, VehicleParameters,
};

use super::encounter::Encounter;
use super::idm::Idm;
use super::reflex::{Braking, Reflex};

/// Comfortable deceleration for other road users, m/s² (what Treiber's page of the
/// IDM uses).
pub(super) const COMFORTABLE_MPS2: f64 = 3.0;
/// Part of an outline that must be in sight for the road user to be recognised. Ours.
const SEEN_PART_MIN: f64 = 0.25;
/// Slower than this towards the way is no movement towards it, m/s.
const TOWARDS_MPS_MIN: f64 = 0.05;

/// Whether a careful driver sees an object: enough of its outline is in the line of sight, and it is no
/// farther away than one can see in the fog.
pub fn in_sight(object: &SensedObject, conditions: &Conditions) -> bool {
    object.visible_fraction >= SEEN_PART_MIN && object.distance_m <= conditions.visibility_m
}

/// A published model of how a careful driver brakes.
pub trait Model: Clone + Send + 'static {
    /// Times and slopes of its reaction.
    fn braking(&self) -> Braking;

    /// The deceleration that it wants because of a road user, m/s²; 0 is no risk.
    fn demand_mps2(&self, encounter: &Encounter) -> f64;
}

/// A driver of the model `M`.
#[derive(Debug, Clone)]
pub struct Reference<M> {
    route: Idm,
    model: M,
    reflex: Reflex,
    /// The deceleration that the model demands since the last look, m/s², and the id of the object that is the reason.
    demand: Option<(f64, u32)>,
    /// The objects in sight at the last looks, the newest last.
    looks: VecDeque<Vec<SensedObject>>,
    /// The senses that the route's driver is given; kept for their buffers.
    shown: Option<Sensed>,
    /// The encounters of the last look by object.
    watched: BTreeMap<u32, Encounter>,
    helm: Helm,
    /// The deceleration that the model gave in the last tick, m/s².
    braking_mps2: f64,
    /// Whether it looks aside before a lane change. A view that is a reaction time late is enough to drive by. It is not
    /// enough where the driver has just taken over, has seen nothing yet, and would change lanes blindly.
    looks_aside: bool,
}

impl<M: Model> Reference<M> {
    pub fn new(scene: &Arc<Scene>, model: M) -> Reference<M> {
        Reference {
            route: Idm::new(scene),
            reflex: Reflex::new(model.braking()),
            model,
            demand: None,
            looks: VecDeque::new(),
            shown: None,
            watched: BTreeMap::new(),
            helm: Helm::default(),
            braking_mps2: 0.0,
            looks_aside: false,
        }
    }

    /// Looks at every object in sight: sets what the model demands and what the route's driver learns.
    fn look(&mut self, sensed: &Sensed, station_m: f64) {
        let is_full = self.looks.len() > self.delay_frames();
        let mut seen = self.looks.pop_front_if(|_| is_full).unwrap_or_default();
        seen.clear();
        seen.extend(sensed.objects.iter().filter(|object| in_sight(object, &sensed.conditions)));
        let front_m = VehicleParameters::MKZ.front_m(station_m);
        self.demand = None;
        let mut watched = BTreeMap::new();
        for object in &seen {
            let guide: &Guide = self.route.guide();
            let ego = &sensed.ego;
            let found = Encounter::seen(guide, object, front_m, ego.speed_mps, ego.acceleration_mps2);
            let Some(mut encounter) = found else { continue };
            if let Some(before) = self.watched.get(&object.id) {
                encounter.other_mps2 = (encounter.other_mps - before.other_mps) / FRAME_S;
                if encounter.towards_mps > TOWARDS_MPS_MIN {
                    let nearer_m = (before.side_gap_m - encounter.side_gap_m).max(0.0);
                    encounter.aside_m = before.aside_m + nearer_m;
                }
            }
            watched.insert(object.id, encounter);
            let demand_mps2 = self.model.demand_mps2(&encounter);
            if demand_mps2 > self.demand.map_or(0.0, |(most_mps2, _)| most_mps2) {
                self.demand = Some((demand_mps2, object.id));
            }
        }
        self.watched = watched;
        self.looks.push_back(seen);
    }

    /// Number of looks between seeing an object and reacting to it.
    fn delay_frames(&self) -> usize {
        (self.model.braking().reaction_s / FRAME_S).ceil() as usize
    }

    /// The senses with the oldest look, carried on to the present at constant speed.
    fn delayed(&self, sensed: &Sensed, mut shown: Sensed) -> Sensed {
        let Sensed { time_s, ego, objects: _, signals, conditions } = sensed;
        (shown.time_s, shown.ego, shown.conditions) = (*time_s, *ego, *conditions);
        shown.signals.clone_from(signals);
        shown.objects.clear();
        if self.looks.len() <= self.delay_frames() {
            return shown;
        }
        let age_s = (self.looks.len() - 1) as f64 * FRAME_S + self.helm.since_look_s();
        let objects = self.looks.front().into_iter().flatten();
        shown.objects.extend(objects.map(|object| {
            let mut object = *object;
            object.pose.position += object.velocity_mps * age_s;
            object
        }));
        shown
    }
}

impl<M: Model> Ads for Reference<M> {
    fn drive(&mut self, sensed: &Sensed) -> Control {
        if self.helm.is_first() {
            self.route.find_place(&sensed.ego.rear_axle);
        }
        let station_m = self.helm.locate(self.route.guide(), sensed.ego.rear_axle.position).station_m;
        if self.helm.looks() {
            self.look(sensed, station_m);
            if let Some(seen) = self.looks.back().filter(|_| self.looks_aside) {
                self.route.glance(seen, sensed.ego.speed_mps, station_m);
            }
        }
        let shown = self.shown.take().unwrap_or_else(|| sensed.clone());
        let shown = self.delayed(sensed, shown);
        self.helm.tick();
        let (demand_mps2, because_of) = self.demand.unwrap_or((0.0, 0));
        let now_mps2 = self.reflex.step(demand_mps2, DT_S);
        self.braking_mps2 = now_mps2;
        // The models mean what the car does, which follows the pedal with a lag.
        let mut later = self.reflex;
        let later_mps2 = later.step(demand_mps2, DT_S);
        let lag_s = VehicleParameters::MKZ.pedal_lag_s;
        let braking_mps2 = now_mps2 + (later_mps2 - now_mps2) * (lag_s / DT_S);
        let control = self.route.drive_with(&shown, |model_mps2, reason| {
            let for_others = matches!(reason, Reason::Stop(_) | Reason::Follow(_) | Reason::Yield(_));
            let route_mps2 = if for_others { model_mps2.max(-COMFORTABLE_MPS2) } else { model_mps2 };
            if braking_mps2 > 0.0 && -braking_mps2 < route_mps2 {
                (-braking_mps2, Reason::Yield(because_of))
            } else {
                (route_mps2, reason)
            }
        });
        self.shown = Some(shown);
        control
    }

    fn status(&self) -> &Status {
        self.route.status()
    }

    fn braking_mps2(&self) -> f64 {
        self.braking_mps2
    }

    fn take_over(&mut self, sensed: &Sensed) {
        self.looks_aside = true;
        self.route.take_over(sensed);
    }
}

#[cfg(test)]
mod tests {
    use crate::testing::{Rig, SOURCE_Y_M, TARGET_Y_M, object, two_lanes};
    use avastra_base::geometry::Pose;
    use avastra_lang::model::vocabulary::Body;

    /// How far a careful human has moved to its side after 2 s, while a faster vehicle comes from behind, m.
    fn moved_aside_m(takes_over: bool) -> f64 {
        let mut rig = Rig::driven_by("cc", &two_lanes(300.0), 0, 8.0);
        rig.sensed.objects = vec![object(1, Body::Sedan, Pose::new(-15.0, TARGET_Y_M, 0.0), 13.0)];
        if takes_over {
            // Its first thought is to change lanes, because it has seen nothing yet.
            rig.ads.drive(&rig.sensed);
            rig.ads.take_over(&rig.sensed);
        }
        rig.run(2.0);
        rig.place().y - SOURCE_Y_M
    }

    #[test]
    fn one_that_takes_over_looks_aside_before_it_changes_lanes() {
        let (blindly_m, carefully_m) = (moved_aside_m(false), moved_aside_m(true));
        assert!(blindly_m > 0.1, "{blindly_m}");
        assert!(carefully_m.abs() < 0.05, "{carefully_m}");
    }

    #[test]
    fn one_that_takes_over_knows_the_lane_that_it_is_in() {
        for name in ["cc", "fsm", "rss", "r157"] {
            let mut rig = Rig::driven_by(name, &two_lanes(300.0), 0, 0.8);
            // Another driver has changed lanes, and creeps towards a person that stands in the target lane.
            rig.sensed.ego.rear_axle = Pose::new(150.0, TARGET_Y_M, 0.0);
            rig.sensed.objects = vec![object(1, Body::Pedestrian, Pose::new(160.0, TARGET_Y_M, 0.0), 0.0)];
            rig.run(12.0);
            assert!(rig.gap_m_min > 1.0, "{name}: {} m", rig.gap_m_min);
            assert!(rig.offset_m_max < 0.1, "{name}: {} m beside its lane", rig.offset_m_max);
        }
    }
}
