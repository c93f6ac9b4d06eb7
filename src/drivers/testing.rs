//! A test rig: hand-made roads, a small plant and scripted objects, without the `World`.

use std::sync::Arc;

use avastra_base::geometry::{OrientedBox, Pose, Vec2, distance_m, unit_vector, wrap_angle};
use avastra_lang::model::vocabulary::{Body, ShownLights};
use avastra_road::testing::{lanes, road, street};
use avastra_road::{RoadMap, Route, Signal, StopLine};
use avastra_world::sim;
use avastra_world::sim::{
    Conditions, Control, DT_S, EgoMotion, Scene, Sensed, SensedObject, SignalColour, VehicleParameters,
    pedal_acceleration_mps2,
};

use super::driver::Ads;
use super::registry::by_name;

pub use avastra_world::sim::testing::corner;

pub const CLEAR_DAY: Conditions =
    Conditions { light: 1.0, rain_mmph: 0.0, visibility_m: 10_000.0, water_mm: 0.0, friction: 0.85 };

/// A straight road of 600 m along +x.
pub fn straight() -> Arc<Scene> {
    scene(&[(600.0, 0.0, 0.0)])
}

/// Where the lanes of [`two_lanes`] are in which its route starts and ends, m.
pub const SOURCE_Y_M: f64 = -5.25;
pub const TARGET_Y_M: f64 = -1.75;

/// A one-way road of two lanes along +x, 400 m long. The route starts in the right-hand lane, and has its goal after
/// 350 m in the left-hand one. A solid line closes the way between them after `open_m`.
pub fn two_lanes(open_m: f64) -> Arc<Scene> {
    let mark = format!(r#"<roadMark sOffset="0" type="broken"/><roadMark sOffset="{open_m}" type="solid"/>"#);
    let lanes = lanes(&[(-1, "driving", 3.5, &mark), (-2, "driving", 3.5, "")]);
    let road = street("1", [0.0, 0.0, 0.0, 400.0], "-1", "", &lanes, "");
    sim::testing::scene(&road, ("1", -2, 0.0), ("1", -1, 350.0))
}

/// Straights, a right-angled bend of 15 m radius to the left and a hairpin of 10 m to the right,
/// each entered and left by clothoids of 8 m.
pub fn winding() -> Arc<Scene> {
    let bend = 1.0 / 15.0;
    let hairpin = -1.0 / 10.0;
    let quarter_rad = core::f64::consts::FRAC_PI_2;
    scene(&[
        (120.0, 0.0, 0.0),
        (8.0, 0.0, bend),
        (15.0 * quarter_rad - 8.0, bend, bend),
        (8.0, bend, 0.0),
        (80.0, 0.0, 0.0),
        (8.0, 0.0, hairpin),
        (20.0 * quarter_rad - 8.0, hairpin, hairpin),
        (8.0, hairpin, 0.0),
        (150.0, 0.0, 0.0),
    ])
}

/// A ring of 125.7 m in two halves, with one lane. The route leads from 10 m into the first half to 55 m into the
/// second, and on through its start.
pub fn ring() -> Arc<Scene> {
    let link = r#"<link><predecessor id="-1"/><successor id="-1"/></link>"#;
    let lane = lanes(&[(-1, "driving", 3.5, link)]);
    let half_m = 20.0 * core::f64::consts::PI;
    let half = |id: &str, other: &str, x_m: f64, heading_rad: f64| {
        let plan = format!(
            r#"<geometry s="0" x="{x_m}" y="0" hdg="{heading_rad}" length="{half_m}"><arc curvature="0.05"/></geometry>"#
        );
        let links = format!(
            r#"<predecessor elementType="road" elementId="{other}" contactPoint="end"/>
            <successor elementType="road" elementId="{other}" contactPoint="start"/>"#
        );
        road(id, half_m, "-1", &links, &plan, &lane, "")
    };
    let quarter_rad = core::f64::consts::FRAC_PI_2;
    let halves = [half("1", "2", 20.0, quarter_rad), half("2", "1", -20.0, -quarter_rad)];
    sim::testing::scene(&halves.concat(), ("1", -1, 10.0), ("2", -1, 55.0))
}

/// A lane each way, 3.5 m wide, from pieces of length (m) and curvature at both ends (1/m). Limit
/// 13.9 m/s; the route keeps to the right-hand lane, and a signal has its line at 100 m.
fn scene(pieces: &[(f64, f64, f64)]) -> Arc<Scene> {
    let mut plan = String::new();
    let mut pose = Pose::new(0.0, 0.0, 0.0);
    let mut station_m = 0.0;
    for &(length_m, from, to) in pieces {
        let shape = if from != to {
            format!("<spiral curvStart=\"{from}\" curvEnd=\"{to}\"/>")
        } else if from != 0.0 {
            format!("<arc curvature=\"{from}\"/>")
        } else {
            "<line/>".into()
        };
        let (x, y, heading) = (pose.position.x, pose.position.y, pose.heading_rad);
        plan += &format!(
            "<geometry s=\"{station_m}\" x=\"{x}\" y=\"{y}\" hdg=\"{heading}\" length=\"{length_m}\">{shape}</geometry>"
        );
        station_m += length_m;
        let steps = 1000;
        let step_m = length_m / f64::from(steps);
        for step in 0..steps {
            let curvature = from + (to - from) * (f64::from(step) + 0.5) / f64::from(steps);
            let middle_rad = pose.heading_rad + curvature * step_m / 2.0;
            pose.position += unit_vector(middle_rad) * step_m;
            pose.heading_rad += curvature * step_m;
        }
    }
    let lanes = lanes(&[(1, "driving", 3.5, ""), (-1, "driving", 3.5, "")]);
    let road = road("1", station_m, "-1", "", &plan, &lanes, "");
    let text = format!(r#"<OpenDRIVE><header name="by hand"/>{road}</OpenDRIVE>"#);
    let mut map = RoadMap::from_opendrive("by hand", &text).expect("the road is sound");
    let start = map.place("1", -1, 0.0).expect("the road begins");
    let goal = map.place("1", -1, station_m - 40.0).expect("the road is long");
    let mut route = Route::find(&map, start, goal).expect("one lane leads there");
    route.stop_lines.push(StopLine { station_m: 100.0, signal: 0 });
    let position = route.path.pose_at(100.0).offset(10.0, -4.0).position;
    map.signals.push(Signal {
        id: "1".into(),
        position,
        junction: None,
        group: 0,
        for_vehicles: true,
        lanes: Vec::new(),
    });
    Arc::new(Scene::new(map.into(), route))
}

/// An object that keeps its velocity until it brakes.
pub fn object(id: u32, body: Body, pose: Pose, speed_mps: f64) -> SensedObject {
    let (length_m, width_m, height_m) = match body {
        Body::Pedestrian => (0.5, 0.5, 1.75),
        Body::SchoolBus => (11.0, 2.44, 3.1),
        Body::BoxTruck => (7.5, 2.4, 3.2),
        Body::Jeep | Body::Sedan | Body::SUV | Body::Hatchback => (4.8, 1.85, 1.45),
        Body::Motorcycle | Body::Bicycle => (2.0, 0.7, 1.6),
        Body::Animal => (1.6, 0.5, 1.2),
        Body::Object => (1.0, 1.0, 0.8),
    };
    SensedObject {
        id,
        body,
        pose,
        velocity_mps: unit_vector(pose.heading_rad) * speed_mps,
        length_m,
        width_m,
        height_m,
        visible_fraction: 1.0,
        distance_m: 0.0,
        is_unlit: false,
        has_siren: false,
        lights: ShownLights::Off,
    }
}

/// The sensor input on a clear day at a pose and a speed, where there are no lights.
pub fn sensed(rear_axle: Pose, speed_mps: f64, objects: Vec<SensedObject>) -> Sensed {
    let ego = EgoMotion::straight(rear_axle, speed_mps);
    Sensed { time_s: 0.0, ego, objects, signals: vec![], conditions: CLEAR_DAY }
}

/// A driver on a road with scripted objects.
pub struct Rig {
    pub scene: Arc<Scene>,
    pub ads: Box<dyn Ads>,
    pub sensed: Sensed,
    pedals_mps2: f64,
    /// Least distance to any object so far, m.
    pub gap_m_min: f64,
    /// Largest distance of the rear axle from the route so far, m.
    pub offset_m_max: f64,
}

impl Rig {
    pub fn new(scene: &Arc<Scene>, ads: Box<dyn Ads>, speed_mps: f64) -> Rig {
        let signals = vec![SignalColour::Green];
        Rig {
            scene: Arc::clone(scene),
            ads,
            sensed: Sensed { signals, ..sensed(scene.route.path.pose_at(0.0), speed_mps, vec![]) },
            pedals_mps2: 0.0,
            gap_m_min: f64::INFINITY,
            offset_m_max: 0.0,
        }
    }

    /// With a driver of the registry.
    pub fn driven_by(name: &str, scene: &Arc<Scene>, seed: u64, speed_mps: f64) -> Rig {
        let entry = by_name(name).expect("it is registered");
        Rig::new(scene, (entry.build)(scene, seed), speed_mps)
    }

    /// Where the rear axle is.
    pub fn place(&self) -> Vec2 {
        self.sensed.ego.rear_axle.position
    }

    pub fn speed_mps(&self) -> f64 {
        self.sensed.ego.speed_mps
    }

    pub fn station_m(&self) -> f64 {
        self.scene.route.path.project(self.place()).station_m
    }

    pub fn run(&mut self, duration_s: f64) {
        self.run_least(duration_s, |_| 0.0);
    }

    /// Runs; returns the least of a value after each tick.
    pub fn run_least(&mut self, duration_s: f64, mut value: impl FnMut(&Rig) -> f64) -> f64 {
        (0..(duration_s / DT_S) as usize).fold(f64::INFINITY, |least, _| {
            self.tick();
            least.min(value(self))
        })
    }

    /// Runs; returns whether something held after any tick.
    pub fn run_any(&mut self, duration_s: f64, holds: impl Fn(&Rig) -> bool) -> bool {
        self.run_least(duration_s, |rig| if holds(rig) { 0.0 } else { 1.0 }) == 0.0
    }

    /// Brings the distances to the objects up to date.
    pub fn measure(&mut self) {
        let car = VehicleParameters::MKZ;
        let centre = self.sensed.ego.rear_axle.offset(car.rear_axle_to_centre_m(), 0.0);
        let outline = OrientedBox::new(centre, car.length_m, car.width_m);
        for object in &mut self.sensed.objects {
            let other = OrientedBox::new(object.pose, object.length_m, object.width_m);
            object.distance_m = distance_m(&outline, &other);
            self.gap_m_min = self.gap_m_min.min(object.distance_m);
        }
    }

    pub fn tick(&mut self) -> Control {
        let car = VehicleParameters::MKZ;
        self.measure();
        let control = self.ads.drive(&self.sensed);
        let ego = &mut self.sensed.ego;
        let wanted_mps2 = pedal_acceleration_mps2(control.throttle_pct, control.brake_pct);
        self.pedals_mps2 += (wanted_mps2 - self.pedals_mps2) * (DT_S / 0.15);
        let speed_mps = (ego.speed_mps + self.pedals_mps2.clamp(-6.0, 2.0) * DT_S).max(0.0);
        ego.steer_rad += ((control.steer_rad - ego.steer_rad) * (DT_S / 0.1)).clamp(-0.0087, 0.0087);
        ego.yaw_rate_radps = speed_mps * libm::tan(ego.steer_rad) / car.wheelbase_m;
        ego.acceleration_mps2 = (speed_mps - ego.speed_mps) / DT_S;
        ego.speed_mps = speed_mps;
        let middle_rad = ego.rear_axle.heading_rad + ego.yaw_rate_radps * DT_S / 2.0;
        ego.rear_axle.position += unit_vector(middle_rad) * (speed_mps * DT_S);
        ego.rear_axle.heading_rad = wrap_angle(ego.rear_axle.heading_rad + ego.yaw_rate_radps * DT_S);
        let beside = self.scene.route.path.project(ego.rear_axle.position);
        self.offset_m_max = self.offset_m_max.max(beside.distance_m);
        for object in &mut self.sensed.objects {
            object.pose.position += object.velocity_mps * DT_S;
        }
        self.sensed.time_s += DT_S;
        control
    }
}
