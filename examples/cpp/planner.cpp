// A driving system under test in C++: it obeys lights, signs and limits, follows, and gives way.
//
//   c++ -O2 -std=c++17 -o planner examples/cpp/planner.cpp
//   avastra ads check --ads ./planner
//   avastra run scenarios/avastra45_law.ava --ads ./planner
//
// It answers with accelerations, so avastra steers along the route and changes lanes. Each step collects what limits the speed: the
// limit, what is seen, lines and other road users. Each gives an acceleration, and the smallest one is the answer.

#include "avastra.hpp"

using avastra::Beside, avastra::Object, avastra::Step;

namespace {

/// Gaining speed, comfortable and firm braking, m/s². The braking is a magnitude.
constexpr double accel_mps2 = 1.5, decel_mps2 = 2.0, firm_mps2 = 2.8;
/// Room when standing behind something, m, and distance to a leader, s.
constexpr double gap_m = 2.0, headway_s = 1.5;
/// How far ahead other road users are predicted, s, and in which steps, s.
constexpr double horizon_s = 6.0, predicted_every_s = 0.25;
/// Passing before or after a crossing road user leaves at least this, s.
constexpr double margin_s = 1.0;
/// At night the perception loses pedestrians. So each is remembered for a while, µs.
constexpr std::int64_t remembered_us = 1'000'000;

/// A reason to brake: something at a gap (m) ahead of the front bumper, and its speed along the path, m/s.
struct Limit {
    double gap, speed;
    std::string reason;
};

/// A road user as seen from the path: its place, its speed along and across, and half its extent along and across.
struct Seen {
    Beside place;
    double along, across, half_length, half_width;
};

/// A road user will be in our way between two times from now (s) and two stations (m), and has this speed along the path there, m/s.
struct Crossing {
    double begin_s, end_s, near, far, along;
};

/// The intelligent driver model (Treiber et al., 2000): the acceleration behind a limit, m/s².
double follow(double speed, const Limit& limit) {
    const double closing = speed * (speed - limit.speed) / (2.0 * std::sqrt(accel_mps2 * decel_mps2));
    const double wanted = gap_m + std::max(0.0, headway_s * speed + closing);
    return accel_mps2 * (1.0 - std::pow(wanted / std::max(limit.gap, 0.1), 2.0));
}

/// Time for a distance (m) when gaining speed up to a top speed, s.
double time_for(double distance, double speed, double top) {
    const double until_top = std::max(0.0, top - speed) / accel_mps2;
    const double gained = (speed + accel_mps2 * until_top / 2.0) * until_top;
    if (distance <= gained) return (std::sqrt(speed * speed + 2.0 * accel_mps2 * std::max(distance, 0.0)) - speed) / accel_mps2;
    return until_top + (distance - gained) / std::max({top, speed, 0.1});
}

/// Whether a road user may turn or step out at any moment.
bool on_foot(const Object& other) { return other.kind == "pedestrian" || other.kind == "animal"; }

/// The driver: `serve` calls its functions as the messages come.
class Planner : public avastra::Driver {
public:
    Planner() : Driver({"example_cpp", "2", "acceleration"}) {}

    void init(const avastra::Init& init) override { vehicle_ = init.vehicle; }

    void map(const avastra::Map& map) override { map_ = &map; }

    // Nothing of the last episode may be left.
    void reset(const avastra::Reset& reset) override {
        way_.emplace(vehicle_, *map_, reset);
        walkers_.clear();
    }

    avastra::Answer step(const Step& step) override {
        const double speed = step.ego.speed, front = step.ego.route_s + vehicle_.rear_axle_to_front;
        double wanted = std::min(way_->speed(step.ego.route_s + 0.5 * speed), speed_by_sight(step.conditions.visibility));
        for (const Object& other : step.objects) {
            if (on_foot(other)) walkers_[other.id] = {step.t_us, other};
        }
        for (const auto& [id, seen] : walkers_) {
            if (step.t_us - seen.first <= remembered_us) wanted = std::min(wanted, speed_beside(seen.second, step.ego));
        }
        // Above the wanted speed the model's own free term would brake too hard.
        double accel = speed < wanted ? accel_mps2 * (1.0 - std::pow(speed / wanted, 4.0)) : std::max(wanted - speed, -firm_mps2);
        std::string reason = "free";

        std::vector<Limit> limits;
        if (const auto line = way_->stop(step)) limits.push_back({*line - front, 0.0, "light or sign"});
        for (const Object& other : step.objects) {
            if (const auto limit = limit_of(other, step.ego, wanted)) limits.push_back(*limit);
        }
        for (const Limit& limit : limits) {
            const double behind = follow(speed, limit);
            if (behind < accel) accel = behind, reason = limit.reason;
        }
        return avastra::Acceleration{std::max(accel, -vehicle_.max_decel), {reason}};
    }

private:
    /// A speed from which the vehicle stops within what is seen (m), after 1.15 s and with 6 m/s², in m/s.
    static double speed_by_sight(double visibility) {
        constexpr double reaction_s = 1.15, braking_mps2 = 6.0;
        return braking_mps2 * (std::sqrt(reaction_s * reaction_s + 2.0 * visibility / braking_mps2) - reaction_s);
    }

    /// A road user, so long (s) from now at constant velocity, as seen from the path.
    Seen seen(const Object& other, double after_s) const {
        const Beside place = way_->path.project(other.x + after_s * other.vx, other.y + after_s * other.vy);
        const double cos = std::cos(place.heading), sin = std::sin(place.heading);
        const double turned = other.heading - place.heading, ahead = std::fabs(std::cos(turned)), beside = std::fabs(std::sin(turned));
        return {place, other.vx * cos + other.vy * sin, other.vy * cos - other.vx * sin,
                (ahead * other.length + beside * other.width) / 2.0, (beside * other.length + ahead * other.width) / 2.0};
    }

    /// Whether a road user is where the ego vehicle will drive. Before and in a lane change the vehicle is beside the path.
    bool in_the_way(const Seen& other, const avastra::Ego& ego, double margin) const {
        const double reach = vehicle_.width / 2.0 + other.half_width + margin;
        return other.place.offset > std::min(ego.route_d, 0.0) - reach && other.place.offset < std::max(ego.route_d, 0.0) + reach;
    }

    /// A speed (m/s) to pass a pedestrian close beside the way, who may step out at any moment; infinite if there is no need.
    double speed_beside(const Object& walker, const avastra::Ego& ego) const {
        constexpr double beside_m = 1.5, passing_mps = 1.5;
        const Seen now = seen(walker, 0.0);
        const double ahead = now.place.station - ego.route_s;
        if (ahead < 0.0 || !in_the_way(now, ego, beside_m)) return std::numeric_limits<double>::infinity();
        return std::sqrt(passing_mps * passing_mps + 2.0 * decel_mps2 * std::max(ahead - vehicle_.rear_axle_to_front, 0.0));
    }

    /// How a road user limits the speed: as a leader, or as one whose way crosses ours.
    std::optional<Limit> limit_of(const Object& other, const avastra::Ego& ego, double wanted) const {
        const bool walks = on_foot(other);
        const double margin = walks ? 0.7 : 0.3, front = ego.route_s + vehicle_.rear_axle_to_front;
        const Seen now = seen(other, 0.0);
        const std::string name = " " + other.kind + " " + std::to_string(other.id);
        if (in_the_way(now, ego, margin)) {
            if (now.place.station < front) return std::nullopt;
            return Limit{now.place.station - now.half_length - front, std::max(now.along, 0.0), "follow" + name};
        }

        const std::optional<Crossing> crossing = predicted(other, now, ego, margin);
        if (!crossing || crossing->far < front) return std::nullopt;
        double near = crossing->near;
        // On a crosswalk a pedestrian gets the whole crosswalk.
        for (const avastra::Range& crosswalk : way_->route.crosswalks) {
            const bool on_it = near < crosswalk.to + 1.0 && crossing->far > crosswalk.from;
            if (walks && on_it && front < crosswalk.from) near = std::min(near, crosswalk.from);
        }
        const double between_s = walks ? 2.0 * margin_s : margin_s;
        const double arrives_s = time_for(near - front, ego.speed, wanted);
        const double clears_s = time_for(crossing->far + vehicle_.length - front, ego.speed, wanted);
        if (clears_s + between_s < crossing->begin_s || arrives_s > crossing->end_s + between_s) return std::nullopt;
        return Limit{near - front, crossing->along, "give way to" + name};
    }

    /// When and where a road user comes into our way if it goes on at constant velocity.
    std::optional<Crossing> predicted(const Object& other, const Seen& now, const avastra::Ego& ego, double margin) const {
        std::optional<Crossing> result;
        const bool comes = now.across * now.place.offset < 0.0 && std::fabs(now.across) > 0.4;
        const bool behind = now.place.station < ego.route_s + vehicle_.rear_axle_to_front;
        for (double after_s = predicted_every_s; after_s <= horizon_s; after_s += predicted_every_s) {
            const Seen then = seen(other, after_s);
            if (!in_the_way(then, ego, margin)) continue;
            // In a bend a vehicle of the next lane only seems to come over. So a shallow crossing counts if it is near and real.
            // A vehicle behind gives way itself.
            const bool shallow = std::fabs(then.along) > 2.0 * std::fabs(then.across);
            if (shallow && (!comes || behind || after_s > 2.0)) continue;
            const double station = then.place.station;
            if (!result) result = Crossing{after_s, after_s, station, station, std::max(then.along, 0.0)};
            result->end_s = after_s;
            result->near = std::min(result->near, station - then.half_length);
            result->far = std::max(result->far, station + then.half_length);
        }
        return result;
    }

    avastra::Vehicle vehicle_;
    const avastra::Map* map_ = nullptr;
    std::optional<avastra::Way> way_;
    /// The pedestrians of this episode, by id: when they were last seen, and how.
    std::map<std::int64_t, std::pair<std::int64_t, Object>> walkers_;
};

}  // namespace

int main() {
    Planner planner;
    return avastra::serve(planner);
}
