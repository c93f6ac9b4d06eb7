//! Poses of lanes against a naive twin: the words of the OpenDRIVE standard, evaluated at one station at a time.

use proptest::prelude::*;

use crate::{Lane, LanePlace, RoadMap, Route};
use avastra_base::geometry::{Path, Vec2, unit_vector, wrap_angle};

/// Largest errors of a pose: m, and a twentieth of a degree.
const POSITION_M_MAX: f64 = 5e-3;
const HEADING_RAD_MAX: f64 = 0.05 * core::f64::consts::PI / 180.0;

/// No comparison nearer to a place where the definition jumps, m.
const NEAR_JUMP_M: f64 = 2e-3;

/// `a + b x + c x² + d x³` from a station on.
#[derive(Debug, Clone)]
struct Record {
    begin_m: f64,
    terms: [f64; 4],
}

/// A straight or an arc of one lane to each side, with widths and offsets of any slope.
#[derive(Debug, Clone)]
struct Made {
    length_m: f64,
    curvature_per_m: f64,
    left_hand: bool,
    offsets: Vec<Record>,
    left: Vec<Record>,
    right: Vec<Record>,
}

fn value(records: &[Record], s_m: f64) -> f64 {
    let Some(record) = records.iter().rev().find(|record| record.begin_m <= s_m) else { return 0.0 };
    let x = s_m - record.begin_m;
    record.terms.iter().rev().fold(0.0, |sum, term| sum * x + term)
}

impl Made {
    fn text(&self) -> String {
        let records = |name: &str, begin: &str, records: &[Record]| -> String {
            let one = |Record { begin_m, terms: [a, b, c, d] }: &Record| {
                format!(r#"<{name} {begin}="{begin_m}" a="{a}" b="{b}" c="{c}" d="{d}"/>"#)
            };
            records.iter().map(one).collect()
        };
        let lane = |id: i32, widths: &[Record]| {
            format!(r#"<lane id="{id}" type="driving">{}</lane>"#, records("width", "sOffset", widths))
        };
        format!(
            r#"<OpenDRIVE><road id="1" length="{length}" junction="-1" rule="{rule}"><planView>
            <geometry s="0" x="7" y="-3" hdg="0.4" length="{length}"><arc curvature="{k}"/></geometry></planView>
            <lanes>{offsets}<laneSection s="0"><left>{left}</left><right>{right}</right></laneSection></lanes>
            </road></OpenDRIVE>"#,
            length = self.length_m,
            rule = if self.left_hand { "LHT" } else { "RHT" },
            k = self.curvature_per_m,
            offsets = records("laneOffset", "s", &self.offsets),
            left = lane(1, &self.left),
            right = lane(-1, &self.right),
        )
    }

    /// Centre of a lane at a station.
    fn place(&self, lane: i32, s_m: f64) -> Vec2 {
        let half_m = value(if lane > 0 { &self.left } else { &self.right }, s_m) / 2.0;
        let t_m = value(&self.offsets, s_m) + f64::from(lane) * half_m;
        let heading_rad = 0.4 + self.curvature_per_m * s_m;
        let chord_m = if self.curvature_per_m == 0.0 {
            s_m
        } else {
            2.0 * libm::sin(self.curvature_per_m * s_m / 2.0) / self.curvature_per_m
        };
        let reference = Vec2::new(7.0, -3.0) + unit_vector((0.4 + heading_rad) / 2.0) * chord_m;
        reference + unit_vector(heading_rad + core::f64::consts::FRAC_PI_2) * t_m
    }

    /// Direction of traffic, by a difference.
    fn heading_rad(&self, lane: i32, s_m: f64) -> f64 {
        let step = self.place(lane, s_m + 1e-5) - self.place(lane, s_m - 1e-5);
        let along = (lane < 0) != self.left_hand;
        libm::atan2(step.y, step.x) + if along { 0.0 } else { core::f64::consts::PI }
    }

    fn jumps_m(&self) -> impl Iterator<Item = f64> {
        let all = self.offsets.iter().chain(&self.left).chain(&self.right);
        all.map(|record| record.begin_m).chain([0.0, self.length_m])
    }

    /// Compares the poses of both lanes with the definition, every half metre and on either side of each jump.
    fn compare(&self) -> Result<(), TestCaseError> {
        let map = RoadMap::from_opendrive("made", &self.text()).expect("it is a map");
        for lane in &map.lanes {
            for s_m in self.stations_m() {
                let pose = lane.centre.pose_at(lane.station_of(s_m));
                let expected = self.place(lane.key.lane, s_m);
                let apart_m = (pose.position - expected).norm();
                prop_assert!(apart_m < POSITION_M_MAX, "{apart_m} m at {s_m} of {:?} in {self:?}", lane.key);
                let turn_rad = wrap_angle(pose.heading_rad - self.heading_rad(lane.key.lane, s_m)).abs();
                prop_assert!(turn_rad < HEADING_RAD_MAX, "{turn_rad} rad at {s_m} of {:?}", lane.key);
            }
        }
        Ok(())
    }

    fn stations_m(&self) -> impl Iterator<Item = f64> {
        let steps = (0..).map(|i| f64::from(i) * 0.5).take_while(|s_m| *s_m < self.length_m);
        let beside = self.jumps_m().flat_map(|s_m| [s_m - 2.0 * NEAR_JUMP_M, s_m + 2.0 * NEAR_JUMP_M]);
        let inside = move |s_m: &f64| {
            (0.0..self.length_m).contains(s_m) && self.jumps_m().all(|at_m| (at_m - s_m).abs() > NEAR_JUMP_M)
        };
        steps.chain(beside).filter(inside).collect::<Vec<_>>().into_iter()
    }
}

/// Up to three records; each goes on from any value with any slope, so that there are tapers and steps.
fn records(least: f64, most: f64) -> impl Strategy<Value = Vec<Record>> {
    let bend = || prop_oneof![Just(0.0), -0.5..0.5_f64];
    let one = (5.0..40.0_f64, least..most, bend(), bend());
    prop::collection::vec(one, 1..4).prop_map(move |all| {
        let mut begin_m = 0.0;
        let record = |(length_m, a, slope, bend): (f64, f64, f64, f64)| {
            // At most half a metre to each side comes of the slope, and as much of the bend.
            let terms = [a, slope / length_m, bend / (length_m * length_m), 0.0];
            let record = Record { begin_m, terms };
            begin_m += length_m;
            record
        };
        let mut records: Vec<Record> = all.into_iter().map(record).collect();
        // The last one stays level: it reaches to the end of the road.
        let level = records[records.len() - 1].terms[0];
        records.extend([Record { begin_m, terms: [level, 0.0, 0.0, 0.0] }]);
        records
    })
}

proptest! {
    #[test]
    fn a_pose_is_that_of_the_definition(
        length_m in 60.0..160.0_f64,
        curvature_per_m in prop_oneof![Just(0.0), -0.04..0.04_f64],
        left_hand: bool,
        offsets in records(-2.0, 2.0),
        left in records(2.0, 5.0),
        right in records(2.0, 5.0),
    ) {
        Made { length_m, curvature_per_m, left_hand, offsets, left, right }.compare()?;
    }

    /// A taper that joins what is before and behind it: slopes up to 1:1, on straights that need no vertex.
    #[test]
    fn a_taper_tilts_nothing_but_itself(slope in -1.0..1.0_f64, begin_m in 1.0..40.0_f64, left_hand: bool) {
        taper(slope, begin_m, left_hand).compare()?;
    }
}

fn taper(slope: f64, begin_m: f64, left_hand: bool) -> Made {
    let wide = || vec![Record { begin_m: 0.0, terms: [3.5, 0.0, 0.0, 0.0] }];
    let offsets = vec![
        Record { begin_m: 0.0, terms: [0.0; 4] },
        Record { begin_m, terms: [0.0, slope, 0.0, 0.0] },
        Record { begin_m: begin_m + 10.0, terms: [10.0 * slope, 0.0, 0.0, 0.0] },
    ];
    Made { length_m: 300.0, curvature_per_m: 0.0, left_hand, offsets, left: wide(), right: wide() }
}

/// A taper that ends where a lane section does: the lanes of a route and those of another vehicle's way are
/// joined there.
#[test]
fn a_taper_that_ends_with_its_lane_tilts_no_other_lane() {
    let text = taper(0.3, 0.0, false).text();
    let widths = r#"<width a="3.5"/>"#;
    let section = format!(
        r#"<laneSection s="10"><right><lane id="-1" type="driving"><link><predecessor id="-1"/></link>{widths}</lane></right></laneSection></lanes>"#
    );
    let map = RoadMap::from_opendrive("made", &text.replace("</lanes>", &section)).expect("it is a map");
    let lane = |section: usize| {
        let found = |lane: &&Lane| (lane.key.section, lane.key.lane) == (section, -1);
        map.lanes.iter().find(found).expect("both sections have it")
    };
    let place = |s_m| map.place("1", -1, s_m).expect("it is there");
    let route = Route::find(&map, LanePlace { station_m: 0.5, ..place(0.0) }, place(290.0)).expect("a way");
    let joined = Path::join([&lane(0).centre, &lane(1).centre]).expect("300 metres");
    for (path, name) in [(&joined, "joined"), (&route.path, "route")] {
        for behind_m in [12.0, 40.0, 150.0] {
            let heading_rad = path.pose_at(behind_m).heading_rad;
            assert!(wrap_angle(heading_rad - 0.4).abs() < 1e-9, "{name} at {behind_m}: {heading_rad}");
        }
        let tilted_rad = wrap_angle(path.pose_at(5.0).heading_rad - 0.4);
        assert!((tilted_rad - libm::atan2(0.3, 1.0)).abs() < 1e-9, "{name}: {tilted_rad}");
    }
}
