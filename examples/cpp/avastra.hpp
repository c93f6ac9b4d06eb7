// A client for the protocol avastra-ads/1 in one header: attach a driving system in C++ to avastra.
//
//   #include "avastra.hpp"
//
//   struct Cruise : avastra::Driver {
//       Cruise() : Driver({"cruise", "1", "acceleration"}) {}
//       avastra::Answer step(const avastra::Step& step) override { return avastra::Acceleration{8.0 - step.ego.speed}; }
//   };
//
//   int main() {
//       Cruise cruise;
//       return avastra::serve(cruise);
//   }
//
// The header needs C++17 and the standard library. docs/reference/protocol.md is the specification. `planner.cpp` beside this
// file is a driver that knows lights, signs and other traffic. The Python package in python/avastra has the same types.
//
// Contents: errors and JSON, messages from avastra, answers, Driver, Path, Way, serve.
//
// Units are SI. The map frame is right-handed. Headings are rad, counter-clockwise from +x. Left is positive. The ego vehicle
// is placed at the centre of its rear axle, an object at the centre of its outline.
//
// The header leaves out sockets: use standard input and output, or read lines yourself and give them to `Conversation`.

#ifndef AVASTRA_HPP
#define AVASTRA_HPP

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <initializer_list>
#include <iostream>
#include <limits>
#include <locale>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>
#include <vector>

#if __has_include(<unistd.h>)
#include <unistd.h>
#define AVASTRA_POSIX 1
#else
#define AVASTRA_POSIX 0
#endif

namespace avastra {

inline constexpr const char* protocol = "avastra-ads/1";

/// A message is not what the protocol says. The text names the field and the problem.
class ProtocolError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// avastra sent something that this header does not understand. `serve` then ends with status 2 instead of 1.
class NotUnderstood : public ProtocolError {
public:
    using ProtocolError::ProtocolError;
};

// --- JSON ---------------------------------------------------------------------------------------------------------

namespace json {

struct Member;

/// A parsed value. A number is a double, which holds every integer of the protocol exactly.
struct Value {
    std::variant<std::nullptr_t, bool, double, std::string, std::vector<Value>, std::vector<Member>> data = nullptr;
};

/// A field of an object. Fields keep their order.
struct Member {
    std::string name;
    Value value;
};

/// Lists and objects may lie in each other this deep. Messages of the protocol need five.
inline constexpr int depth_max = 64;

/// Length of the UTF-8 character at `text[at]` in bytes, or 0 if the bytes are no character.
inline std::size_t utf8_length(std::string_view text, std::size_t at) {
    const auto byte = [&](std::size_t index) -> unsigned { return static_cast<unsigned char>(text[index]); };
    const unsigned first = byte(at);
    if (first < 0x80) return 1;
    const std::size_t length = first >= 0xC2 && first < 0xE0 ? 2 : first >= 0xE0 && first < 0xF0 ? 3 : first >= 0xF0 && first < 0xF5 ? 4 : 0;
    if (length == 0 || text.size() - at < length) return 0;
    // The second byte rules out overlong forms, surrogates and what lies beyond U+10FFFF.
    const unsigned low = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
    const unsigned high = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
    if (byte(at + 1) < low || byte(at + 1) > high) return 0;
    for (std::size_t index = 2; index < length; ++index) {
        if ((byte(at + index) & 0xC0) != 0x80) return 0;
    }
    return length;
}

/// Reads one JSON text (RFC 8259) strictly. It also refuses a name that stands twice in an object, as the protocol does.
class Parser {
public:
    explicit Parser(std::string_view text) : text_(text) {}

    /// The value that fills the whole text. Throws `NotUnderstood` with the place of the problem.
    Value document() {
        Value result = value(0);
        skip_blanks();
        if (at_ != text_.size()) fail("more text after the value");
        return result;
    }

private:
    [[noreturn]] void fail(const char* problem) const {
        throw NotUnderstood("no JSON: " + std::string(problem) + " at byte " + std::to_string(at_));
    }

    /// The next byte, or 0 at the end. A byte 0 in the text is no part of any JSON, so the two need no distinction.
    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

    void skip_blanks() {
        while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t' || text_[at_] == '\r' || text_[at_] == '\n')) ++at_;
    }

    bool accept(char wanted) {
        skip_blanks();
        if (peek() != wanted) return false;
        ++at_;
        return true;
    }

    Value word(std::string_view wanted, Value result) {
        if (text_.substr(at_, wanted.size()) != wanted) fail("an unknown word");
        at_ += wanted.size();
        return result;
    }

    Value value(int depth) {
        if (depth > depth_max) fail("too many lists and objects in each other");
        skip_blanks();
        switch (peek()) {
            case '{': return {object(depth)};
            case '[': return {list(depth)};
            case '"': return {text()};
            case 't': return word("true", {true});
            case 'f': return word("false", {false});
            case 'n': return word("null", {nullptr});
            default: return {number()};
        }
    }

    std::vector<Value> list(int depth) {
        std::vector<Value> values;
        ++at_;
        if (accept(']')) return values;
        do values.push_back(value(depth + 1));
        while (accept(','));
        if (!accept(']')) fail("a list does not end");
        return values;
    }

    std::vector<Member> object(int depth) {
        std::vector<Member> members;
        ++at_;
        if (accept('}')) return members;
        // Most objects of the protocol have some 15 fields.
        members.reserve(16);
        do {
            skip_blanks();
            if (peek() != '"') fail("a field has no name");
            std::string name = text();
            if (!accept(':')) fail("a field has no value");
            members.push_back({std::move(name), value(depth + 1)});
        } while (accept(','));
        if (!accept('}')) fail("an object does not end");
        if (has_twice(members)) fail("a field stands twice in an object");
        return members;
    }

    static bool has_twice(const std::vector<Member>& members) {
        if (members.size() <= 32) {
            for (std::size_t one = 1; one < members.size(); ++one) {
                for (std::size_t other = 0; other < one; ++other) {
                    if (members[one].name == members[other].name) return true;
                }
            }
            return false;
        }
        // Sorting keeps a hostile object from costing quadratic time.
        std::vector<std::string_view> names;
        for (const Member& member : members) names.push_back(member.name);
        std::sort(names.begin(), names.end());
        return std::adjacent_find(names.begin(), names.end()) != names.end();
    }

    std::string text() {
        std::string result;
        ++at_;
        for (;;) {
            const std::size_t begin = at_;
            while (at_ < text_.size() && text_[at_] >= ' ' && text_[at_] < '\x7f' && text_[at_] != '"' && text_[at_] != '\\') ++at_;
            result.append(text_, begin, at_ - begin);
            if (at_ == text_.size()) fail("a text does not end");
            const char next = text_[at_];
            if (next == '"') {
                ++at_;
                return result;
            }
            if (next == '\\') {
                escape(result);
            } else {
                if (next >= '\0' && next < ' ') fail("a control character in a text");
                const std::size_t length = utf8_length(text_, at_);
                if (length == 0) fail("bytes that are not UTF-8");
                result.append(text_, at_, length);
                at_ += length;
            }
        }
    }

    void escape(std::string& into) {
        ++at_;
        static constexpr std::string_view names = "\"\\/bfnrt", meanings = "\"\\/\b\f\n\r\t";
        const char name = peek();
        if (name == 'u') {
            ++at_;
            unsigned code = hex();
            if (code >= 0xD800 && code < 0xDC00) {
                // A character beyond U+FFFF is written as two escapes, a surrogate pair.
                if (text_.substr(at_, 2) != "\\u") fail("half a surrogate pair");
                at_ += 2;
                const unsigned low = hex();
                if (low < 0xDC00 || low > 0xDFFF) fail("half a surrogate pair");
                code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
            } else if (code >= 0xDC00 && code < 0xE000) {
                fail("half a surrogate pair");
            }
            append_utf8(into, code);
            return;
        }
        const std::size_t which = at_ < text_.size() ? names.find(name) : std::string_view::npos;
        if (which == std::string_view::npos) fail("an unknown escape");
        into += meanings[which];
        ++at_;
    }

    unsigned hex() {
        unsigned code = 0;
        for (int digit = 0; digit < 4; ++digit, ++at_) {
            const char c = peek();
            const int value = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1;
            if (value < 0) fail("an escape needs four hexadecimal digits");
            code = code * 16 + static_cast<unsigned>(value);
        }
        return code;
    }

    static void append_utf8(std::string& into, unsigned code) {
        const auto tail = [&](unsigned shift) { into += static_cast<char>(0x80 | ((code >> shift) & 0x3F)); };
        if (code < 0x80) {
            into += static_cast<char>(code);
        } else if (code < 0x800) {
            into += static_cast<char>(0xC0 | (code >> 6));
            tail(0);
        } else if (code < 0x10000) {
            into += static_cast<char>(0xE0 | (code >> 12));
            tail(6), tail(0);
        } else {
            into += static_cast<char>(0xF0 | (code >> 18));
            tail(12), tail(6), tail(0);
        }
    }

    std::size_t digits() {
        const std::size_t begin = at_;
        while (peek() >= '0' && peek() <= '9') ++at_;
        if (at_ == begin) fail(begin == text_.size() ? "the text ends too early" : "an unexpected character");
        return at_ - begin;
    }

    double number() {
        const std::size_t begin = at_;
        if (peek() == '-') ++at_;
        const bool leading_zero = peek() == '0';
        if (digits() > 1 && leading_zero) fail("a number begins with 0");
        if (peek() == '.') ++at_, digits();
        if (peek() == 'e' || peek() == 'E') {
            ++at_;
            if (peek() == '+' || peek() == '-') ++at_;
            digits();
        }
        return converted(text_.substr(begin, at_ - begin));
    }

    double converted(std::string_view digits) const {
        double result = 0.0;
#if defined(__cpp_lib_to_chars)
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), result);
        if (error == std::errc()) return result;
        if (is_tiny(digits)) return 0.0;
#else
        // Some standard libraries (libc++) have no `from_chars` for a double yet. Their streams are exact, but slow.
        if (is_short(digits, result)) return result;
        std::istringstream stream{std::string(digits)};
        stream.imbue(std::locale::classic());
        if (stream >> result) return result;
        if (is_tiny(digits)) return 0.0;
#endif
        fail("a number that is too large");
    }

    /// Converts a number of at most 15 digits and without an exponent, as nearly all are. Then both parts of the fraction are exact.
    [[maybe_unused]] static bool is_short(std::string_view digits, double& into) {
        if (digits.size() > 16) return false;
        double whole = 0.0, scale = 1.0;
        bool fraction = false;
        for (const char c : digits.substr(digits[0] == '-')) {
            if (c == 'e' || c == 'E') return false;
            if (c == '.') {
                fraction = true;
            } else {
                whole = whole * 10.0 + (c - '0');
                if (fraction) scale *= 10.0;
            }
        }
        into = (digits[0] == '-' ? -whole : whole) / scale;
        return true;
    }

    /// Whether a number that no double can hold is too small rather than too large.
    static bool is_tiny(std::string_view digits) {
        const std::size_t exponent = digits.find_first_of("eE");
        const std::string_view mantissa = digits.substr(0, exponent);
        const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
        const std::size_t first = mantissa.find_first_of("123456789");
        if (first == std::string_view::npos) return true;
        long power = static_cast<long>(point) - static_cast<long>(first);
        if (exponent != std::string_view::npos) {
            const bool negative = digits[exponent + 1] == '-';
            long size = 0;
            for (const char c : digits.substr(exponent + 1)) {
                // The bound keeps the sum within a long; no line is that long.
                if (c >= '0' && c <= '9') size = std::min(size * 10 + (c - '0'), 1'000'000'000L);
            }
            power += negative ? -size : size;
        }
        return power < 0;
    }

    std::string_view text_;
    std::size_t at_ = 0;
};

/// Reads one JSON text. Throws `NotUnderstood`.
inline Value parse(std::string_view text) { return Parser(text).document(); }

/// Appends a number as JSON: the shortest digits that read back as the same double, whatever the locale is.
inline void append(std::string& into, double number) {
#if defined(__cpp_lib_to_chars)
    std::array<char, 32> buffer{};
    const auto written = std::to_chars(buffer.data(), buffer.data() + buffer.size(), number);
    into.append(buffer.data(), written.ptr);
#else
    for (int precision = std::numeric_limits<double>::digits10; precision <= std::numeric_limits<double>::max_digits10; ++precision) {
        std::ostringstream stream;
        stream.imbue(std::locale::classic());
        stream.precision(precision);
        stream << number;
        double back = 0.0;
        std::istringstream reader(stream.str());
        reader.imbue(std::locale::classic());
        if ((reader >> back && back == number) || precision == std::numeric_limits<double>::max_digits10) {
            into += stream.str();
            return;
        }
    }
#endif
}

/// Appends a text in quotes. Bytes that are not UTF-8 become U+FFFD, because an error text may hold anything.
inline void append(std::string& into, std::string_view text) {
    into += '"';
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        const std::size_t length = utf8_length(text, at);
        if (length == 0) {
            into += "\\ufffd";
        } else if (c == '"' || c == '\\') {
            into += '\\';
            into += c;
        } else if (length == 1 && (c < ' ' || c == '\x7f')) {
            constexpr std::string_view hex = "0123456789abcdef";
            into += "\\u00";
            into += hex[static_cast<unsigned char>(c) >> 4];
            into += hex[static_cast<unsigned char>(c) & 15];
        } else {
            into.append(text, at, length);
        }
        at += std::max<std::size_t>(length, 1);
    }
    into += '"';
}

}  // namespace json

// --- Messages from avastra ----------------------------------------------------------------------------------------
//
// The fields have the names of the protocol, except `Object::kind` (there `class`). A field that is null or absent is an empty
// `std::optional`. Fields of later versions are ignored.

/// A place in the map frame, m.
struct Point {
    double x = 0.0, y = 0.0;
};

/// A place and a heading in the map frame: m, m, rad.
struct Pose {
    double x = 0.0, y = 0.0, heading = 0.0;
};

/// Two stations, m.
struct Range {
    double from = 0.0, to = 0.0;
};

/// The ego vehicle: m, rad, rad/s, m/s² and kg. The deceleration is a magnitude.
struct Vehicle {
    double length = 0.0, width = 0.0, height = 0.0, wheelbase = 0.0, rear_axle_to_front = 0.0, rear_axle_to_back = 0.0;
    double max_steer = 0.0, max_steer_rate = 0.0, max_accel = 0.0, max_decel = 0.0, mass = 0.0;

    /// From the rear axle forward to the centre of the outline, m.
    double rear_axle_to_centre() const { return (rear_axle_to_front - rear_axle_to_back) / 2.0; }
};

/// The first message.
struct Init {
    std::string protocol, simulator;
    /// Length of a tick and time between two steps, µs.
    std::int64_t tick_us = 0, period_us = 0;
    /// `perceived` or `truth`.
    std::string observation;
    Vehicle vehicle;
    /// The kind of answer that the user asks for.
    std::optional<std::string> answer;
};

/// The next driving lane on one side. `gap` is the width of what lies between, m.
struct Neighbor {
    std::string id;
    bool same_direction = false;
    double gap = 0.0;
};

/// Where a lane stops for a light.
struct LaneStopLine {
    double s = 0.0;
    std::string signal;
};

/// Where a lane stops or gives way by a sign: `stop` or `yield`.
struct LaneSign {
    double s = 0.0;
    std::string kind;
};

/// A driving lane. `centerline`, `left` and `right` have a point for each station in `s`.
struct Lane {
    std::string id;
    double length = 0.0;
    std::vector<double> s;
    std::vector<Point> centerline, left, right;
    /// m/s
    double speed_limit = 0.0;
    /// `straight`, `left`, `right` or `u_turn`.
    std::string turn;
    std::optional<std::string> junction;
    std::vector<std::string> successors, predecessors;
    std::optional<Neighbor> left_neighbor, right_neighbor;
    std::vector<Range> changes_left, changes_right;
    std::vector<LaneStopLine> stop_lines;
    std::vector<LaneSign> signs;
    /// `priority`, `equal` or `yield`.
    std::string precedence;
};

/// A traffic light.
struct MapSignal {
    std::string id;
    double x = 0.0, y = 0.0;
};

/// A crosswalk with its corners in order.
struct Crosswalk {
    std::string id;
    std::vector<Point> outline;
};

/// The road network.
struct Map {
    std::string id;
    /// Absolute path of the OpenDRIVE file.
    std::optional<std::string> opendrive;
    std::vector<Lane> lanes;
    std::vector<MapSignal> signals;
    std::vector<Crosswalk> crosswalks;
    /// Places of the lanes in `lanes`, by id. Reading a message fills it.
    std::map<std::string, std::size_t, std::less<>> places;

    /// The lane of this id. Throws `ProtocolError` if there is none.
    const Lane& lane(std::string_view lane_id) const {
        const auto found = places.find(lane_id);
        if (found == places.end()) throw ProtocolError("the map has no lane `" + std::string(lane_id) + "`");
        return lanes[found->second];
    }
};

/// Where the rear axle starts, and how fast, m/s.
struct Start {
    double x = 0.0, y = 0.0, heading = 0.0, speed = 0.0;
};

struct Goal {
    double x = 0.0, y = 0.0, heading = 0.0;
    std::string lane;
    double route_s = 0.0;
};

/// The route is in this lane between two of its stations.
struct RouteLane {
    std::string id;
    double from = 0.0, to = 0.0;
};

/// A lane change: the path performs it between two stations. It must be over by `latest`. It goes `lateral` m to the left.
struct RouteChange {
    double from = 0.0, to = 0.0, latest = 0.0, lateral = 0.0;
};

struct RouteStopLine {
    double route_s = 0.0;
    std::string signal;
};

struct RouteSign {
    double route_s = 0.0;
    std::string kind;
};

/// A point of the route's path. Curvature in 1/m, positive to the left; limit in m/s.
struct RoutePoint {
    double x = 0.0, y = 0.0, heading = 0.0, curvature = 0.0, speed_limit = 0.0;
};

/// A crossing of the route with another lane, at `route_s` and at `s` of that lane.
struct Conflict {
    double route_s = 0.0;
    std::string lane;
    double s = 0.0;
    /// Heading of that lane minus that of the route, rad; positive comes from the right.
    double angle = 0.0;
};

/// The way to the goal. `path` has a point every `spacing` m, lane changes included. It goes on beyond the goal.
struct Route {
    std::vector<RouteLane> lanes;
    double length = 0.0, spacing = 0.0;
    std::vector<RoutePoint> path;
    std::vector<RouteChange> changes;
    std::vector<RouteStopLine> stop_lines;
    std::vector<RouteSign> signs;
    std::vector<Range> crosswalks;
    /// Where the path crosses other lanes inside junctions; only if `Ready::wants` has `conflicts`.
    std::optional<std::vector<Conflict>> conflicts;
};

/// The beginning of an episode.
struct Reset {
    /// For everything random in the driver.
    std::int64_t seed = 0;
    std::string map;
    Start start;
    Goal goal;
    Route route;
    /// The seed in full, as scenarios have it; only if `Ready::wants` has `names`.
    std::optional<std::string> episode_seed;
};

/// The ego vehicle. `vx` and `vy` are in the map frame, `speed` and `accel` along the vehicle.
struct Ego {
    double x = 0.0, y = 0.0, heading = 0.0, vx = 0.0, vy = 0.0, speed = 0.0, accel = 0.0, yaw_rate = 0.0;
    /// Angle of the road wheels, rad.
    double steer = 0.0;
    /// It has hit, or been hit by, something in this episode.
    bool touched = false;
    std::optional<std::string> lane;
    double s = 0.0, d = 0.0, route_s = 0.0, route_d = 0.0;
    /// Standard deviation of x and of y, m.
    double position_std = 0.0;
};

/// Another road user. `kind` is the protocol's `class`: `car`, `pedestrian`, …
struct Object {
    std::int64_t id = 0;
    std::string kind;
    double x = 0.0, y = 0.0, heading = 0.0, vx = 0.0, vy = 0.0, length = 0.0, width = 0.0, height = 0.0;
    /// The part in sight, from 0 to 1.
    double visible = 1.0;
    /// `hazard`, `left`, `right` or `flash`.
    std::optional<std::string> lights;
    /// Acceleration in the map frame, m/s²; turn, rad/s; time since it is known, s. Only if `Ready::wants` has `motion`.
    std::optional<double> ax, ay, yaw_rate, age;
    /// Its number in scenarios and reports, for logs. Only if `Ready::wants` has `names`.
    std::optional<std::int64_t> npc;

    /// m/s, at least 0.
    double speed() const { return std::hypot(vx, vy); }
};

/// A traffic light now: `red`, `yellow`, `green` or `unknown`.
struct Signal {
    std::string id, state;
};

/// Light from 0 to 1, rain in mm/h, visibility in m, water on the road in mm, coefficient of tyre friction.
struct Conditions {
    double light = 1.0, rain = 0.0, visibility = 0.0, water = 0.0, friction = 0.0;
};

/// What is known now. It wants an answer.
struct Step {
    /// Number of the step in its episode.
    std::int64_t seq = 0;
    /// Time in the episode, µs.
    std::int64_t t_us = 0;
    Ego ego;
    std::vector<Object> objects;
    std::vector<Signal> signals;
    Conditions conditions;

    /// Time in the episode, s.
    double time() const { return static_cast<double>(t_us) / 1e6; }
};

/// Something happened: `collision` or `end`. Later versions may add kinds.
struct Event {
    std::string kind;
    std::int64_t t_us = 0;
};

// --- Answers ------------------------------------------------------------------------------------------------------

/// What the driver believes and intends, for pictures, logs and measures. All of it is optional.
struct Internal {
    /// What limits the speed now, for example `follow 3`: at most 200 characters.
    std::optional<std::string> reason = std::nullopt;
    /// Where the rear axle shall be, every 0.1 s from now on: at most 1,000 points.
    std::optional<std::vector<Point>> planned = std::nullopt;
    /// Where the driver believes its rear axle is.
    std::optional<Pose> localized = std::nullopt;
    /// Time that planning took, ms.
    std::optional<double> plan_ms = std::nullopt;
};

/// Acceleration (m/s², negative brakes) and angle of the road wheels (rad, left is positive, within ±3.2).
struct Control {
    double accel, steer;
    Internal internal = {};
};

/// As `Control`, with two pedals from 0 to 1 in place of the acceleration.
struct Pedals {
    double throttle, brake, steer;
    Internal internal = {};
};

/// An acceleration alone, m/s². avastra steers along the route.
struct Acceleration {
    double accel;
    Internal internal = {};
    /// What becomes of the next lane change: `wait`, `go`, or empty. If it is empty, avastra looks for room.
    std::string lane_change = {};
};

/// Where the rear axle shall be at a time of the episode. Speed `v` from 0 to 100 m/s, acceleration `a` in m/s².
struct TrajectoryPoint {
    std::int64_t t_us;
    double x, y, heading, v;
    std::optional<double> a = std::nullopt;
};

/// 2 to 1,000 points with rising times, from now or before to at least 1 s from now.
struct Trajectory {
    std::vector<TrajectoryPoint> points;
    Internal internal = {};
};

/// `Control` and `Pedals` are answers of the kind `control`.
using Answer = std::variant<Control, Pedals, Acceleration, Trajectory>;

// --- Driver -------------------------------------------------------------------------------------------------------

/// What a driver says of itself.
struct Ready {
    /// What is under test, as reports name it: 1 to 100 characters each.
    std::string name, version;
    /// What `step` returns: `control`, `trajectory` or `acceleration`.
    std::string answer;
    /// Whether the same reset and steps lead to the same answers.
    bool deterministic = true;
    /// Groups of fields that are sent beside the others: `motion`, `conflicts`, `names`.
    std::vector<std::string> wants = {};
};

/// A driving system under test. Derive from it, write `step`, and hand an object of it to `serve`.
///
/// One process drives many episodes. An answer may depend only on the map, the reset and the steps since. So seed random
/// numbers in `reset`, and take the time from the messages. An exception of any function ends the process and becomes a
/// finding, `ads_error`, with the text of the exception.
class Driver {
public:
    explicit Driver(Ready self) : ready(std::move(self)) {}
    virtual ~Driver() = default;

    /// The vehicle and the rates. It stays valid as long as the driver. A driver that can answer in several ways sets
    /// `ready.answer` here.
    virtual void init(const Init&) {}
    /// The map of the following episodes. It stays valid until the next call of `map`.
    virtual void map(const Map&) {}
    /// Start, goal and route of the next episode. It stays valid until the next call of `reset`. Forget the last episode here.
    virtual void reset(const Reset&) {}
    /// The answer for the next period. `step` is valid during the call.
    virtual Answer step(const Step& step) = 0;
    /// Something happened. avastra wants no answer.
    virtual void event(const Event&) {}
    /// The last call.
    virtual void close() {}

    Ready ready;
};

// --- Reading and writing messages ---------------------------------------------------------------------------------

namespace detail {

/// A place in a message, as a chain up to the message's type. Only an error makes a text of it.
struct Where {
    const Where* outer = nullptr;
    const char* name = nullptr;
    std::size_t index = 0;

    std::string text() const {
        if (outer == nullptr) return name;
        return outer->text() + (name != nullptr ? "." + std::string(name) : "[" + std::to_string(index) + "]");
    }
};

[[noreturn]] inline void not_understood(const Where& where, const char* problem) {
    throw NotUnderstood("`" + where.text() + "` " + problem);
}

/// The fields of an object, each read into a variable of the right type.
class Fields {
public:
    Fields(const json::Value& value, const Where& where) : members_(std::get_if<std::vector<json::Member>>(&value.data)), where_(where) {
        if (members_ == nullptr) not_understood(where, "must be an object");
    }

    template <class T>
    void operator()(const char* name, T& into) {
        const Where inner{&where_, name};
        const json::Value* found = find(name);
        if (found == nullptr) not_understood(inner, "is missing");
        read(*found, inner, into);
    }

    template <class T>
    void operator()(const char* name, std::optional<T>& into) {
        const json::Value* found = find(name);
        if (found == nullptr || std::holds_alternative<std::nullptr_t>(found->data)) return;
        read(*found, Where{&where_, name}, into.emplace());
    }

private:
    const json::Value* find(std::string_view name) {
        // Fields are asked for in the order of the protocol, so the next one is nearly always right.
        for (std::size_t tried = 0; tried < members_->size(); ++tried) {
            if (next_ >= members_->size()) next_ = 0;
            const json::Member& member = (*members_)[next_++];
            if (member.name == name) return &member.value;
        }
        return nullptr;
    }

    const std::vector<json::Member>* members_;
    const Where& where_;
    std::size_t next_ = 0;
};

inline void read(const json::Value& value, const Where& where, double& into) {
    const double* number = std::get_if<double>(&value.data);
    if (number == nullptr) not_understood(where, "must be a number");
    into = *number;
}

inline void read(const json::Value& value, const Where& where, std::int64_t& into) {
    const double* number = std::get_if<double>(&value.data);
    if (number == nullptr || !(*number >= 0.0 && *number < 9007199254740992.0) || std::floor(*number) < *number) {
        not_understood(where, "must be an integer of at least 0, below 2^53");
    }
    into = static_cast<std::int64_t>(*number);
}

inline void read(const json::Value& value, const Where& where, bool& into) {
    const bool* truth = std::get_if<bool>(&value.data);
    if (truth == nullptr) not_understood(where, "must be true or false");
    into = *truth;
}

inline void read(const json::Value& value, const Where& where, std::string& into) {
    const std::string* text = std::get_if<std::string>(&value.data);
    if (text == nullptr) not_understood(where, "must be a text");
    into = *text;
}

/// A list of at least so many numbers. A later version may add some at the end.
inline void read_row(const json::Value& value, const Where& where, std::initializer_list<double*> into) {
    const auto* row = std::get_if<std::vector<json::Value>>(&value.data);
    if (row == nullptr || row->size() < into.size()) not_understood(where, "must be a list of numbers, and has too few");
    std::size_t index = 0;
    for (double* number : into) {
        read((*row)[index], Where{&where, nullptr, index}, *number);
        ++index;
    }
}

inline void read(const json::Value& value, const Where& where, Point& into) { read_row(value, where, {&into.x, &into.y}); }

inline void read(const json::Value& value, const Where& where, Range& into) { read_row(value, where, {&into.from, &into.to}); }

inline void read(const json::Value& value, const Where& where, RoutePoint& into) {
    read_row(value, where, {&into.x, &into.y, &into.heading, &into.curvature, &into.speed_limit});
}

// Each `fields` lists the fields of one class. The template `read` below finds it by the class.

inline void fields(Fields& field, Vehicle& into) {
    field("length", into.length), field("width", into.width), field("height", into.height);
    field("wheelbase", into.wheelbase);
    field("rear_axle_to_front", into.rear_axle_to_front), field("rear_axle_to_back", into.rear_axle_to_back);
    field("max_steer", into.max_steer), field("max_steer_rate", into.max_steer_rate);
    field("max_accel", into.max_accel), field("max_decel", into.max_decel), field("mass", into.mass);
}

inline void fields(Fields& field, Neighbor& into) {
    field("id", into.id), field("same_direction", into.same_direction), field("gap", into.gap);
}

inline void fields(Fields& field, LaneStopLine& into) { field("s", into.s), field("signal", into.signal); }

inline void fields(Fields& field, LaneSign& into) { field("s", into.s), field("kind", into.kind); }

inline void fields(Fields& field, MapSignal& into) { field("id", into.id), field("x", into.x), field("y", into.y); }

inline void fields(Fields& field, Crosswalk& into) { field("id", into.id), field("outline", into.outline); }

inline void fields(Fields& field, Start& into) {
    field("x", into.x), field("y", into.y), field("heading", into.heading), field("speed", into.speed);
}

inline void fields(Fields& field, Goal& into) {
    field("x", into.x), field("y", into.y), field("heading", into.heading), field("lane", into.lane), field("route_s", into.route_s);
}

inline void fields(Fields& field, RouteLane& into) { field("id", into.id), field("from", into.from), field("to", into.to); }

inline void fields(Fields& field, RouteChange& into) {
    field("from", into.from), field("to", into.to), field("latest", into.latest), field("lateral", into.lateral);
}

inline void fields(Fields& field, RouteStopLine& into) { field("route_s", into.route_s), field("signal", into.signal); }

inline void fields(Fields& field, RouteSign& into) { field("route_s", into.route_s), field("kind", into.kind); }

inline void fields(Fields& field, Signal& into) { field("id", into.id), field("state", into.state); }

inline void fields(Fields& field, Conditions& into) {
    field("light", into.light), field("rain", into.rain), field("visibility", into.visibility), field("water", into.water);
    field("friction", into.friction);
}

inline void fields(Fields& field, Ego& into) {
    field("x", into.x), field("y", into.y), field("heading", into.heading), field("vx", into.vx), field("vy", into.vy);
    field("speed", into.speed), field("accel", into.accel), field("yaw_rate", into.yaw_rate), field("steer", into.steer);
    field("touched", into.touched), field("lane", into.lane), field("s", into.s), field("d", into.d);
    field("route_s", into.route_s), field("route_d", into.route_d), field("position_std", into.position_std);
}

inline void fields(Fields& field, Object& into) {
    field("id", into.id), field("class", into.kind), field("x", into.x), field("y", into.y), field("heading", into.heading);
    field("vx", into.vx), field("vy", into.vy), field("length", into.length), field("width", into.width);
    field("height", into.height), field("visible", into.visible), field("lights", into.lights);
    field("ax", into.ax), field("ay", into.ay), field("yaw_rate", into.yaw_rate), field("age", into.age), field("npc", into.npc);
}

template <class T>
void read(const json::Value& value, const Where& where, T& into);

template <class T>
void read(const json::Value& value, const Where& where, std::vector<T>& into) {
    const auto* list = std::get_if<std::vector<json::Value>>(&value.data);
    if (list == nullptr) not_understood(where, "must be a list");
    into.resize(list->size());
    for (std::size_t index = 0; index < list->size(); ++index) read((*list)[index], Where{&where, nullptr, index}, into[index]);
}

inline void fields(Fields& field, Init& into) {
    field("protocol", into.protocol), field("simulator", into.simulator);
    field("tick_us", into.tick_us), field("period_us", into.period_us), field("observation", into.observation);
    field("answer", into.answer), field("vehicle", into.vehicle);
}

inline void fields(Fields& field, Lane& into) {
    field("id", into.id), field("length", into.length), field("s", into.s);
    field("centerline", into.centerline), field("left", into.left), field("right", into.right);
    field("speed_limit", into.speed_limit), field("turn", into.turn), field("junction", into.junction);
    field("successors", into.successors), field("predecessors", into.predecessors);
    field("left_neighbor", into.left_neighbor), field("right_neighbor", into.right_neighbor);
    field("changes_left", into.changes_left), field("changes_right", into.changes_right);
    field("stop_lines", into.stop_lines), field("signs", into.signs), field("precedence", into.precedence);
}

inline void fields(Fields& field, Map& into) {
    field("id", into.id), field("opendrive", into.opendrive), field("lanes", into.lanes);
    field("signals", into.signals), field("crosswalks", into.crosswalks);
    for (std::size_t index = 0; index < into.lanes.size(); ++index) into.places.emplace(into.lanes[index].id, index);
}

inline void fields(Fields& field, Conflict& into) {
    field("route_s", into.route_s), field("lane", into.lane), field("s", into.s), field("angle", into.angle);
}

inline void fields(Fields& field, Route& into) {
    field("lanes", into.lanes), field("length", into.length), field("spacing", into.spacing), field("path", into.path);
    field("changes", into.changes), field("stop_lines", into.stop_lines), field("signs", into.signs);
    field("crosswalks", into.crosswalks), field("conflicts", into.conflicts);
}

inline void fields(Fields& field, Reset& into) {
    field("seed", into.seed), field("map", into.map), field("start", into.start), field("goal", into.goal), field("route", into.route);
    field("episode_seed", into.episode_seed);
}

inline void fields(Fields& field, Step& into) {
    field("seq", into.seq), field("t_us", into.t_us), field("ego", into.ego), field("objects", into.objects);
    field("signals", into.signals), field("conditions", into.conditions);
}

inline void fields(Fields& field, Event& into) { field("kind", into.kind), field("t_us", into.t_us); }

template <class T>
void read(const json::Value& value, const Where& where, T& into) {
    Fields field(value, where);
    fields(field, into);
}

/// Number of characters in a text of UTF-8.
inline std::size_t characters(std::string_view text) {
    std::size_t count = 0;
    for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
    return count;
}

/// Writes an answer. It refuses what the protocol does not allow, with a `ProtocolError` that names the field.
class Writer {
public:
    explicit Writer(std::int64_t seq) : seq_(seq) {}

    std::string operator()(const Control& control) {
        const Where where = begin("control");
        field(where, "accel", control.accel), field(where, "steer", control.steer, 3.2);
        return end(where, control.internal);
    }

    std::string operator()(const Pedals& pedals) {
        const Where where = begin("control");
        field(where, "throttle", pedals.throttle, 1.0, 0.0), field(where, "brake", pedals.brake, 1.0, 0.0);
        field(where, "steer", pedals.steer, 3.2);
        return end(where, pedals.internal);
    }

    std::string operator()(const Acceleration& acceleration) {
        const Where where = begin("acceleration");
        field(where, "accel", acceleration.accel);
        const std::string& change = acceleration.lane_change;
        if (!change.empty()) {
            if (change != "wait" && change != "go") refuse({&where, "lane_change"}, "is \"" + change + "\", and must be \"wait\" or \"go\"");
            key("lane_change"), json::append(text_, std::string_view(change));
        }
        return end(where, acceleration.internal);
    }

    std::string operator()(const Trajectory& trajectory) {
        const Where where = begin("trajectory"), list{&where, "points"};
        const std::vector<TrajectoryPoint>& points = trajectory.points;
        if (points.size() < 2 || points.size() > 1000) refuse(list, "has " + std::to_string(points.size()) + " points, and must have 2 to 1,000");
        key("points");
        char before = '[';
        for (std::size_t index = 0; index < points.size(); ++index) {
            const TrajectoryPoint& point = points[index];
            const Where inner{&list, nullptr, index};
            if (point.t_us < 0 || (index > 0 && point.t_us <= points[index - 1].t_us)) {
                refuse({&inner, "t_us"}, "is " + std::to_string(point.t_us) + ", and must be at least 0 and rise from point to point");
            }
            text_ += before;
            text_ += "{\"t_us\":" + std::to_string(point.t_us);
            field(inner, "x", point.x, 1e7), field(inner, "y", point.y, 1e7), field(inner, "heading", point.heading, 1e3);
            field(inner, "v", point.v, 100.0, 0.0);
            if (point.a) field(inner, "a", *point.a);
            text_ += '}';
            before = ',';
        }
        text_ += ']';
        return end(where, trajectory.internal);
    }

private:
    [[noreturn]] static void refuse(const Where& where, const std::string& problem) {
        throw ProtocolError("`" + where.text() + "` " + problem);
    }

    Where begin(const char* type) {
        text_ = "{\"type\":\"" + std::string(type) + "\",\"seq\":" + std::to_string(seq_);
        return {nullptr, type};
    }

    void key(const char* name) {
        if (text_.back() != '{') text_ += ',';
        text_ += '"';
        text_ += name;
        text_ += "\":";
    }

    void field(const Where& outer, const char* name, double number, double high = std::numeric_limits<double>::max()) {
        field(outer, name, number, high, -high);
    }

    void field(const Where& outer, const char* name, double number, double high, double low) {
        check({&outer, name}, number, high, low);
        key(name), json::append(text_, number);
    }

    static void check(const Where& where, double number, double high, double low) {
        std::string shown;
        if (!std::isfinite(number)) {
            refuse(where, std::isnan(number) ? "is nan, and must be finite" : "is infinite, and must be finite");
        }
        if (number >= low && number <= high) return;
        json::append(shown, number), shown += ", and must be from ", json::append(shown, low), shown += " to ", json::append(shown, high);
        refuse(where, "is " + shown);
    }

    std::string end(const Where& outer, const Internal& internal) {
        const Where where{&outer, "internal"};
        if (internal.reason || internal.planned || internal.localized || internal.plan_ms) {
            key("internal"), text_ += '{';
            if (internal.reason) {
                const std::size_t length = characters(*internal.reason);
                if (length > 200) refuse({&where, "reason"}, "has " + std::to_string(length) + " characters, and must have at most 200");
                key("reason"), json::append(text_, std::string_view(*internal.reason));
            }
            if (internal.planned) planned({&where, "planned"}, *internal.planned);
            if (internal.localized) {
                const Where inner{&where, "localized"};
                key("localized"), text_ += '{';
                field(inner, "x", internal.localized->x), field(inner, "y", internal.localized->y);
                field(inner, "heading", internal.localized->heading);
                text_ += '}';
            }
            if (internal.plan_ms) field(where, "plan_ms", *internal.plan_ms);
            text_ += '}';
        }
        text_ += '}';
        return std::move(text_);
    }

    void planned(const Where& where, const std::vector<Point>& points) {
        if (points.size() > 1000) refuse(where, "has " + std::to_string(points.size()) + " points, and must have at most 1,000");
        key("planned"), text_ += '[';
        constexpr double any = std::numeric_limits<double>::max();
        for (std::size_t index = 0; index < points.size(); ++index) {
            const Where inner{&where, nullptr, index};
            check({&inner, nullptr, 0}, points[index].x, any, -any), check({&inner, nullptr, 1}, points[index].y, any, -any);
            text_ += index > 0 ? ",[" : "[";
            json::append(text_, points[index].x), text_ += ',', json::append(text_, points[index].y);
            text_ += ']';
        }
        text_ += ']';
    }

    std::int64_t seq_;
    std::string text_;
};

/// The first so many characters of a text.
inline std::string_view cut(std::string_view text, std::size_t count) {
    std::size_t at = 0;
    for (; count > 0 && at < text.size(); --count) at += std::max<std::size_t>(json::utf8_length(text, at), 1);
    return text.substr(0, at);
}

}  // namespace detail

// --- Path ---------------------------------------------------------------------------------------------------------

inline constexpr double pi = 3.14159265358979323846;

/// The same angle in (-π, π].
inline double wrap(double angle) {
    const double turned = std::fmod(angle + pi, 2.0 * pi);
    return turned > 0.0 ? turned - pi : turned + pi;
}

/// A point as seen from a path.
struct Beside {
    /// Along the path, m. It is below 0 or beyond the length where the path is thought to go on straight.
    double station = 0.0;
    /// To the left of the path, m.
    double offset = 0.0;
    /// Of the path at that station, rad.
    double heading = 0.0;
};

/// A polyline with stations, measured from its first point. Beyond its ends it goes on straight.
class Path {
public:
    /// Throws `std::invalid_argument` unless there are two different points.
    ///
    /// Points within a centimetre of the one before are left out: lanes of a map may miss their successors by millimetres, and
    /// the step across such a seam, which may even lead backwards, is no heading of the road. The last point stays.
    explicit Path(const std::vector<Point>& points) {
        constexpr double seam_m = 0.01;
        for (const Point& point : points) {
            if (xy_.empty() || distance(point, xy_.back()) > seam_m) xy_.push_back(point);
        }
        if (!points.empty() && distance(points.back(), xy_.back()) > 0.0) {
            while (xy_.size() > 1 && distance(points.back(), xy_.back()) <= seam_m) xy_.pop_back();
            if (distance(points.back(), xy_.back()) > 1e-6) xy_.push_back(points.back());
        }
        if (xy_.size() < 2) throw std::invalid_argument("a path needs two different points");
        stations_.push_back(0.0);
        for (std::size_t index = 1; index < xy_.size(); ++index) {
            const double dx = xy_[index].x - xy_[index - 1].x, dy = xy_[index].y - xy_[index - 1].y;
            stations_.push_back(stations_.back() + std::hypot(dx, dy));
            headings_.push_back(std::atan2(dy, dx));
            directions_.push_back({std::cos(headings_.back()), std::sin(headings_.back())});
        }
    }

    /// The points that were kept, and the station of each, m.
    const std::vector<Point>& xy() const { return xy_; }
    const std::vector<double>& stations() const { return stations_; }

    /// m
    double length() const { return stations_.back(); }

    /// The path with its points averaged twice over `reach` neighbours on both sides. Its ends stay.
    ///
    /// Roads go from straight to bend at once, and a planner that bounds how fast the wheel turns finds no way along that. With
    /// points 1 m apart and a `reach` of 1 the change takes some 5 m, and a bend of 6 m is cut by 0.1 m.
    Path smoothed(std::size_t reach = 1) const {
        std::vector<Point> points = xy_;
        for (int round = 0; round < 2; ++round) {
            std::vector<Point> averaged;
            for (std::size_t index = 0; index < points.size(); ++index) {
                const std::size_t span = std::min({reach, index, points.size() - 1 - index});
                Point sum;
                for (std::size_t near = index - span; near <= index + span; ++near) sum.x += points[near].x, sum.y += points[near].y;
                const double count = static_cast<double>(2 * span + 1);
                averaged.push_back({sum.x / count, sum.y / count});
            }
            points = std::move(averaged);
        }
        return Path(points);
    }

    /// The pose at a station, `offset` m to the left of it.
    Pose at(double station, double offset = 0.0) const {
        const std::size_t index = segment(station);
        const Point& along = directions_[index];
        const double ahead = station - stations_[index];
        return {xy_[index].x + ahead * along.x - offset * along.y, xy_[index].y + ahead * along.y + offset * along.x, heading(station)};
    }

    /// 1/m, positive to the left: how much the heading turns within `reach` m on both sides.
    double curvature(double station, double reach = 2.0) const {
        return wrap(heading(station + reach) - heading(station - reach)) / (2.0 * reach);
    }

    /// Where a point lies beside the path. It looks at every eighth vertex first, then at all around the nearest of them.
    Beside project(double x, double y) const {
        constexpr std::size_t stride = 8;
        const std::size_t last = xy_.size() - 1;
        const auto squared = [&](std::size_t index) {
            const double dx = x - xy_[index].x, dy = y - xy_[index].y;
            return dx * dx + dy * dy;
        };
        std::size_t near = 0;
        double least = squared(0);
        const auto look = [&](std::size_t index) {
            const double here = squared(index);
            if (here < least) least = here, near = index;
        };
        for (std::size_t index = stride; index < last; index += stride) look(index);
        look(last);
        const std::size_t begin = near > stride ? near - stride : 0, end = std::min(near + stride, last);
        for (std::size_t index = begin; index <= end; ++index) look(index);
        const std::size_t before = near > 0 ? near - 1 : 0, after = std::min(near, last - 1);
        const auto [one_squared, one] = beside(before, x, y);
        if (before == after) return one;
        const auto [other_squared, other] = beside(after, x, y);
        return other_squared < one_squared ? other : one;
    }

    /// The heading turns evenly from the middle of a segment to the middle of the next, rad.
    double heading(double station) const {
        const std::size_t index = segment(station);
        const double middle = (stations_[index] + stations_[index + 1]) / 2.0;
        const bool ahead = station > middle;
        if (ahead ? index + 1 >= headings_.size() : index == 0) return headings_[index];
        const std::size_t other = ahead ? index + 1 : index - 1;
        const double other_middle = (stations_[other] + stations_[other + 1]) / 2.0;
        const double share = (station - middle) / (other_middle - middle);
        return wrap(headings_[index] + share * wrap(headings_[other] - headings_[index]));
    }

private:
    static double distance(const Point& one, const Point& other) { return std::hypot(one.x - other.x, one.y - other.y); }

    /// The squared distance to a segment, and the point as seen from it. The first and last segments go on for ever.
    std::pair<double, Beside> beside(std::size_t index, double x, double y) const {
        const Point& direction = directions_[index];
        const double dx = x - xy_[index].x, dy = y - xy_[index].y;
        const double along = direction.x * dx + direction.y * dy, left = direction.x * dy - direction.y * dx;
        double kept = along;
        if (index > 0) kept = std::max(kept, 0.0);
        if (index + 1 < headings_.size()) kept = std::min(kept, stations_[index + 1] - stations_[index]);
        // Beside a corner the nearest place is the corner itself.
        const double offset = std::copysign(std::hypot(along - kept, left), left);
        const double station = stations_[index] + kept;
        return {(along - kept) * (along - kept) + left * left, {station, offset, heading(station)}};
    }

    std::size_t segment(double station) const {
        const auto after = std::upper_bound(stations_.begin(), stations_.end(), station);
        const std::size_t count = static_cast<std::size_t>(after - stations_.begin());
        return std::min(count > 0 ? count - 1 : 0, headings_.size() - 1);
    }

    std::vector<Point> xy_;
    std::vector<double> stations_, headings_;
    /// Cosine and sine of each heading.
    std::vector<Point> directions_;
};

// --- Way ----------------------------------------------------------------------------------------------------------

/// The route of an episode as most drivers need it: how fast, how much room, and where to stop for a light or a sign.
///
/// Stations are `route_s` of the protocol, those of the rear axle. Objects are not looked at: whom to follow and whom to give way
/// to is what a driver under test decides. A `Way` keeps a reference to the map, so make a new one in each `reset`.
class Way {
public:
    Vehicle vehicle;
    Route route;
    /// Station of the goal, m.
    double goal;
    Path path;

    /// `lateral_accel` bounds the speed in bends, `decel` (a magnitude) is the braking before them, both in m/s².
    /// Throws `std::invalid_argument` for a route of fewer than two points.
    Way(const Vehicle& ego_vehicle, const Map& map, const Reset& reset, double lateral_accel = 2.0, double decel = 1.5)
        : vehicle(ego_vehicle), route(reset.route), goal(reset.goal.route_s), path(points(reset.route)), map_(&map),
          held_(reset.route.stop_lines.size()) {
        for (const RoutePoint& point : route.path) {
            speeds_.push_back(std::min(point.speed_limit, std::sqrt(lateral_accel / std::max(std::fabs(point.curvature), 1e-6))));
        }
        for (std::size_t index = speeds_.size() - 1; index-- > 0;) {
            const double next = speeds_[index + 1];
            speeds_[index] = std::min(speeds_[index], std::sqrt(next * next + 2.0 * decel * route.spacing));
        }
    }

    /// What limits and bends, here and ahead, allow, m/s.
    double speed(double station) const { return speeds_[place(station)]; }

    /// 1/m, positive to the left.
    double curvature(double station) const { return route.path[place(station)].curvature; }

    /// The station that the front must not pass now, for a light or a stop sign; empty if there is none.
    ///
    /// Ask in every step: it remembers at which signs the vehicle has stopped, and for which lights it has begun to stop. A
    /// yellow light that needs harder braking than 4 m/s² is passed. A yield sign asks for no stop: whether to give way there
    /// is the driver's own business.
    std::optional<double> stop(const Step& step) {
        const double front = step.ego.route_s + vehicle.rear_axle_to_front;
        const std::optional<double> light = light_line(step, front), sign = sign_line(step, front);
        if (!light || !sign) return light ? light : sign;
        return std::min(*light, *sign);
    }

    /// What limits, bends and a line that holds ask for, m/s: braking at `decel` (m/s²) to stop `gap` m before the line.
    ///
    /// It is the speed for 1 s from now, because a planner comes to it with some delay. It calls `stop`.
    double wanted_speed(const Step& step, double decel = 1.5, double gap = 1.5) {
        const Ego& ego = step.ego;
        const double wanted = std::min(speed(ego.route_s), speed(ego.route_s + 1.5 * ego.speed));
        const std::optional<double> line = stop(step);
        if (!line) return wanted;
        const double left = *line - gap - ego.route_s - vehicle.rear_axle_to_front - ego.speed;
        return std::min(wanted, std::sqrt(2.0 * decel * std::max(left, 0.0)));
    }

    /// A way out for a planner without a plan: braking as hard as the vehicle can, at its distance beside the route.
    /// `seconds` is from 1 to 99; throws `std::invalid_argument`.
    std::vector<TrajectoryPoint> braking(const Step& step, double seconds = 3.0) const {
        if (!(seconds >= 1.0 && seconds <= 99.0)) throw std::invalid_argument("`seconds` of `braking` must be from 1 to 99");
        constexpr double period = 0.1;
        const double decel = vehicle.max_decel;
        std::vector<TrajectoryPoint> result;
        double station = step.ego.route_s, speed_now = step.ego.speed;
        const std::int64_t count = std::llround(seconds / period);
        for (std::int64_t index = 0; index <= count; ++index) {
            const Pose pose = path.at(station, step.ego.route_d);
            // Also at rest: a controller that looks ahead must find the brake pressed there.
            result.push_back({step.t_us + index * 100'000, pose.x, pose.y, pose.heading, speed_now, -decel});
            const double braked = std::min(period, speed_now / decel);
            station += speed_now * braked - decel * braked * braked / 2.0;
            // Rounding must not make it roll backwards.
            speed_now = std::max(speed_now - decel * braked, 0.0);
        }
        return result;
    }

    /// How far lanes of the own direction reach to the left (first) and to the right of the path, m; both positive.
    /// Throws `ProtocolError` if the map lacks a lane of the route.
    std::pair<double, double> room(double station) const {
        const auto on = std::find_if(route.lanes.begin(), route.lanes.end(), [&](const RouteLane& lane) { return lane.to >= station; });
        if (route.lanes.empty()) throw ProtocolError("the route has no lanes");
        const Lane* own = &map_->lane((on == route.lanes.end() ? route.lanes.back() : *on).id);
        const Pose here = path.at(station);
        const auto edge = [&](std::optional<Neighbor> Lane::*side, std::vector<Point> Lane::*border) {
            const Lane* lane = own;
            // The count ends the search on a map whose lanes are neighbours in a circle.
            for (std::size_t count = 0; count < map_->lanes.size(); ++count) {
                const std::optional<Neighbor>& neighbor = lane->*side;
                if (!neighbor || !neighbor->same_direction || neighbor->gap > 0.5) break;
                lane = &map_->lane(neighbor->id);
            }
            return std::fabs(Path(lane->*border).project(here.x, here.y).offset);
        };
        return {edge(&Lane::left_neighbor, &Lane::left), edge(&Lane::right_neighbor, &Lane::right)};
    }

private:
    /// A vehicle whose front is no farther than this beyond a line still waits at it, m.
    static constexpr double over_m = 1.0;

    static std::vector<Point> points(const Route& of) {
        std::vector<Point> result;
        for (const RoutePoint& point : of.path) result.push_back({point.x, point.y});
        return result;
    }

    std::size_t place(double station) const {
        const double index = station / route.spacing, last = static_cast<double>(route.path.size() - 1);
        // Written so that NaN, too, ends at the first point.
        return index >= 0.0 ? static_cast<std::size_t>(std::min(index, last)) : 0;
    }

    std::optional<double> light_line(const Step& step, double front) {
        constexpr double yellow_decel = 4.0;
        for (std::size_t index = 0; index < route.stop_lines.size(); ++index) {
            const RouteStopLine& line = route.stop_lines[index];
            const double distance = line.route_s - front;
            const auto signal = std::find_if(step.signals.begin(), step.signals.end(), [&](const Signal& one) { return one.id == line.signal; });
            const bool red = signal != step.signals.end() && signal->state == "red";
            const bool yellow = signal != step.signals.end() && signal->state == "yellow";
            if ((!red && !yellow) || distance < -over_m) {
                held_[index] = false;
                continue;
            }
            // Once begun, braking goes on: a driver that brakes late would otherwise be let through in the middle of it.
            const double hardest = red ? vehicle.max_decel : yellow_decel;
            if (held_[index] || step.ego.speed * step.ego.speed <= 2.0 * hardest * std::max(distance, 0.1)) {
                held_[index] = true;
                return line.route_s;
            }
        }
        return std::nullopt;
    }

    std::optional<double> sign_line(const Step& step, double front) {
        // A vehicle that stands (m/s) no farther than this before the line (m) has stopped at it.
        constexpr double at_sign_m = 3.0, stands = 0.1;
        for (; signs_done_ < route.signs.size(); ++signs_done_) {
            const RouteSign& sign = route.signs[signs_done_];
            const double distance = sign.route_s - front;
            const bool has_stopped = distance < at_sign_m && step.ego.speed < stands;
            if (sign.kind == "stop" && !has_stopped && distance >= -over_m) return sign.route_s;
        }
        return std::nullopt;
    }

    const Map* map_;
    std::vector<double> speeds_;
    std::size_t signs_done_ = 0;
    std::vector<bool> held_;
};

// --- The conversation ---------------------------------------------------------------------------------------------

/// One driver in conversation: takes a line, gives the answer. For transports of your own and for tests; `serve` needs no help.
class Conversation {
public:
    explicit Conversation(Driver& driver) : driver_(driver) {}

    /// The answer to a line, without the end of line; empty where none is due. Throws `ProtocolError`, and whatever the driver throws.
    std::optional<std::string> reply(std::string_view line) {
        const json::Value message = json::parse(line);
        detail::Where where{nullptr, "message"};
        std::string type;
        detail::Fields(message, where)("type", type);
        where.name = type.c_str();
        if (type == "init") {
            Init init;
            detail::read(message, where, init);
            init_ = std::move(init);
            return ready();
        }
        if (!init_) throw NotUnderstood("the first message is `" + type + "`, and must be `init`");
        if (type == "step") return step(message, where);
        if (type == "map") {
            // A map that is not understood must not replace half of the old one.
            Map map;
            detail::read(message, where, map);
            map_ = std::move(map);
            driver_.map(*map_);
            return "{\"type\":\"ready\"}";
        }
        if (type == "reset") {
            Reset reset;
            detail::read(message, where, reset);
            if (!map_) throw NotUnderstood("`reset` comes before the first `map`");
            reset_ = std::move(reset);
            driver_.reset(*reset_);
            return "{\"type\":\"ready\"}";
        }
        if (type == "event") {
            Event event;
            detail::read(message, where, event);
            driver_.event(event);
        } else if (type == "close") {
            closed_ = true;
            driver_.close();
        } else {
            throw NotUnderstood("`" + type + "` is no message of " + protocol);
        }
        return std::nullopt;
    }

    /// Whether `close` came.
    bool closed() const { return closed_; }

private:
    std::string ready() {
        if (init_->protocol != protocol) throw NotUnderstood("the simulator speaks " + init_->protocol + ", this header " + protocol);
        driver_.init(*init_);
        const Ready& self = driver_.ready;
        for (const auto& [name, text] : {std::pair{"name", &self.name}, std::pair{"version", &self.version}}) {
            if (text->empty() || detail::characters(*text) > 100) {
                throw ProtocolError("`ready." + std::string(name) + "` must have 1 to 100 characters");
            }
        }
        if (self.answer != "control" && self.answer != "trajectory" && self.answer != "acceleration") {
            throw ProtocolError("`ready.answer` is `" + self.answer + "`, and must be `control`, `trajectory` or `acceleration`");
        }
        if (init_->answer && *init_->answer != self.answer) {
            throw ProtocolError("asked for answers of kind `" + *init_->answer + "`, and gives only `" + self.answer + "`");
        }
        std::string text = "{\"type\":\"ready\",\"protocol\":\"" + std::string(protocol) + "\",\"name\":";
        json::append(text, std::string_view(self.name)), text += ",\"version\":", json::append(text, std::string_view(self.version));
        text += ",\"answer\":\"" + self.answer + "\",\"deterministic\":" + (self.deterministic ? "true" : "false");
        for (std::size_t index = 0; index < self.wants.size(); ++index) {
            text += index == 0 ? ",\"wants\":[" : ",";
            json::append(text, std::string_view(self.wants[index]));
        }
        return text + (self.wants.empty() ? "}" : "]}");
    }

    std::string step(const json::Value& message, const detail::Where& where) {
        Step step;
        detail::read(message, where, step);
        if (!reset_) throw NotUnderstood("`step` comes before the first `reset`");
        const Answer answer = driver_.step(step);
        static constexpr std::array kinds = {"control", "control", "acceleration", "trajectory"};
        const std::string kind = answer.valueless_by_exception() ? "nothing" : kinds[answer.index()];
        if (kind != driver_.ready.answer) {
            throw ProtocolError("`step` returned " + kind + ", but the driver announced `" + driver_.ready.answer + "`");
        }
        std::string text = std::visit(detail::Writer(step.seq), answer);
        if (const Trajectory* trajectory = std::get_if<Trajectory>(&answer)) {
            const std::int64_t first = trajectory->points.front().t_us, last = trajectory->points.back().t_us;
            if (first > step.t_us || last < step.t_us + 1'000'000) {
                throw ProtocolError("the trajectory goes from " + std::to_string(first) + " to " + std::to_string(last) +
                                    " µs; it must begin at the time of the step, " + std::to_string(step.t_us) +
                                    ", or before, and reach at least 1 s beyond it");
            }
        }
        return text;
    }

    Driver& driver_;
    std::optional<Init> init_;
    std::optional<Map> map_;
    std::optional<Reset> reset_;
    bool closed_ = false;
};

/// Leads the whole conversation: reads lines from `in` and hands each answer, without the end of line, to `say`.
///
/// `say` returns false if avastra is gone. Returns the exit status: 0 after `close` or the end of the input, 1 if the driver
/// threw or answered what the protocol does not allow, 2 if avastra sent something that is not understood. In the last two cases
/// avastra gets an `error`, and the text is on standard error.
inline int converse(Driver& driver, std::istream& in, const std::function<bool(const std::string&)>& say) {
    const auto fail = [&](const std::string& text, int status) {
        std::cerr << driver.ready.name << ": " << text << std::endl;
        std::string error = "{\"type\":\"error\",\"message\":";
        json::append(error, detail::cut(text, 2000));
        say(error + "}");
        return status;
    };
    Conversation conversation(driver);
    try {
        for (std::string line; std::getline(in, line);) {
            if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
            const std::optional<std::string> reply = conversation.reply(line);
            if (conversation.closed() || (reply && !say(*reply))) return 0;
        }
        driver.close();
        return 0;
    } catch (const NotUnderstood& error) {
        return fail(error.what(), 2);
    } catch (const std::exception& error) {
        return fail(error.what(), 1);
    } catch (...) {
        return fail("the driver threw something that is no std::exception", 1);
    }
}

/// Serves a driver over standard input and output until avastra closes the conversation. Return its result from `main`.
///
/// Standard output belongs to the protocol. So its descriptor is moved away at the beginning, and descriptor 1 becomes a copy of 2:
/// whatever the driver or a library prints goes to standard error. Call it once in a process, before other threads print.
/// `converse` says what it returns.
inline int serve(Driver& driver) {
#if AVASTRA_POSIX
    const int out = ::dup(1);
    if (out < 0 || ::dup2(2, 1) < 0) {
        std::cerr << "standard output and standard error must be open" << std::endl;
        return 1;
    }
    // avastra may end first. Then a write must fail instead of ending the process by a signal.
    std::signal(SIGPIPE, SIG_IGN);
    const auto say = [out](std::string line) {
        line += '\n';
        for (std::size_t at = 0; at < line.size();) {
            const auto written = ::write(out, line.data() + at, line.size() - at);
            if (written < 0 && errno == EINTR) continue;
            if (written <= 0) return false;
            at += static_cast<std::size_t>(written);
        }
        return true;
    };
    // What was printed before is still in the buffers, and goes to standard error, too.
    std::cout.flush(), std::fflush(stdout);
#else
    // Without descriptors only `std::cout` can be led away, not `printf`.
    std::cout.rdbuf(std::cerr.rdbuf());
    const auto say = [](const std::string& line) {
        return std::fwrite(line.data(), 1, line.size(), stdout) == line.size() && std::fputc('\n', stdout) != EOF && std::fflush(stdout) == 0;
    };
#endif
    // Reading byte by byte from C's standard input would be slow.
    std::ios::sync_with_stdio(false);
    // What the driver prints shall be there when it crashes.
    std::cout << std::unitbuf;
    return converse(driver, std::cin, [&](const std::string& line) {
#if AVASTRA_POSIX
        std::fflush(stdout);
#endif
        return say(line);
    });
}

}  // namespace avastra

#endif
