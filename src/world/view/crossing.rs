//! Where a driver's way crosses the route of the ego vehicle.

use crate::state::driver::Driver;
use crate::state::ego::VehicleParameters;
use crate::view::around::Around;
use avastra_road::LaneIndex;

impl Driver {
    /// From its front to where its way next crosses the ego vehicle's route, and from the ego vehicle's front to there,
    /// m. The second is below 0 if the ego vehicle is past it.
    pub fn ways_to_crossing(&self, length_m: f64, around: &Around) -> Option<(f64, f64)> {
        self.next_crossing(length_m, around, None).map(|(_, ways)| ways)
    }

    /// The lane of that crossing, with the two ways; of the crossings in one lane, if that is given.
    pub fn next_crossing(
        &self,
        length_m: f64,
        around: &Around,
        within: Option<LaneIndex>,
    ) -> Option<(LaneIndex, (f64, f64))> {
        let front_m = self.station_m + length_m / 2.0;
        let ego_front_m = VehicleParameters::MKZ.front_m(around.ego_station_m);
        let is_meant = |lane: LaneIndex| within.is_none_or(|within| lane == within);
        let ahead = around.scene.route.conflicts.iter().filter(|conflict| is_meant(conflict.lane));
        let ahead = ahead.filter_map(|conflict| {
            let own_m = self.way.lane_begin_m(conflict.lane)? + conflict.lane_station_m - front_m;
            (own_m > 0.0).then_some((conflict.lane, (own_m, conflict.station_m - ego_front_m)))
        });
        ahead.min_by(|(_, (a_m, _)), (_, (b_m, _))| a_m.total_cmp(b_m))
    }
}
