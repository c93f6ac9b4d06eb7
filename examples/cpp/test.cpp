// Tests of avastra.hpp: JSON, messages, answers, paths and ways, and the conversation.
//
//   c++ -g -std=c++17 -Wall -Wextra -Wpedantic -Wconversion -Wshadow -fsanitize=address,undefined -o test examples/cpp/test.cpp
//   ./test                  # prints nothing but a last line
//   ./test --lines FILE     # reads recorded lines, broken ones too: each must end in a reply or a ProtocolError
//
// The expected numbers of paths and ways are those of the Python package (python/avastra) for the same three messages.

#include "avastra.hpp"

#include <fstream>

namespace {

int failures = 0;

#define CHECK(condition)                                                             \
    do {                                                                             \
        if (!(condition)) {                                                          \
            std::cerr << "line " << __LINE__ << ": " << #condition << std::endl;     \
            ++failures;                                                              \
        }                                                                            \
    } while (false)

bool near(double one, double other) { return std::fabs(one - other) <= 1e-9 * std::max(1.0, std::fabs(other)); }

/// The text of the ProtocolError that a function throws, or `none`.
template <class Function>
std::string error_of(Function function) {
    try {
        function();
    } catch (const avastra::ProtocolError& error) {
        return error.what();
    }
    return "none";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// A text with one part replaced.
std::string with(std::string text, const std::string& part, const std::string& other) {
    const std::size_t at = text.find(part);
    return at == std::string::npos ? "the part is missing" : text.replace(at, part.size(), other);
}

// A straight of 10 m, a bend of 10 m radius, and a straight with a limit of 5 m/s; a yield sign, a stop sign and a light.

const std::string init_line =
    R"({"type":"init","protocol":"avastra-ads/1","simulator":"avastra 0.1.0","tick_us":20000,"period_us":100000,)"
    R"("observation":"perceived","vehicle":{"length":4.7,"width":2.06,"height":2.05,"wheelbase":2.837007,)"
    R"("rear_axle_to_front":3.705,"rear_axle_to_back":0.995,"max_steer":0.5127,"max_steer_rate":0.436,"max_accel":2.0,)"
    R"("max_decel":6.0,"mass":2120.0}})";

const std::string map_line =
    R"({"type":"map","id":"bend","opendrive":null,"lanes":[{"id":"a","length":40.0,"s":[0.0,2.0,4.0,40.0],)"
    R"("centerline":[[0.0,0.0],[2.0,0.0],[4.0,0.0],[40.0,0.0]],"left":[[0.0,1.75],[2.0,1.75],[4.0,1.75],[40.0,1.75]],)"
    R"("right":[[0.0,-1.75],[2.0,-1.75],[4.0,-1.75],[40.0,-1.75]],"speed_limit":13.9,"turn":"straight","junction":null,)"
    R"("successors":[],"predecessors":[],"left_neighbor":{"id":"b","same_direction":true,"gap":0.0},)"
    R"("right_neighbor":null,"changes_left":[],"changes_right":[],"stop_lines":[],"signs":[],"precedence":"equal"},)"
    R"({"id":"b","length":40.0,"s":[0.0,2.0,4.0,40.0],"centerline":[[0.0,3.5],[2.0,3.5],[4.0,3.5],[40.0,3.5]],)"
    R"("left":[[0.0,5.25],[2.0,5.25],[4.0,5.25],[40.0,5.25]],"right":[[0.0,1.75],[2.0,1.75],[4.0,1.75],[40.0,1.75]],)"
    R"("speed_limit":13.9,"turn":"straight","junction":null,"successors":[],"predecessors":[],)"
    R"("left_neighbor":{"id":"a","same_direction":false,"gap":0.0},"right_neighbor":{"id":"a","same_direction":true,)"
    R"("gap":0.0},"changes_left":[],"changes_right":[],"stop_lines":[],"signs":[],"precedence":"equal"}],)"
    R"("signals":[{"id":"7","x":20.0,"y":-4.0}],"crosswalks":[]})";

const std::string reset_line =
    R"({"type":"reset","seed":5077240519623781,"map":"bend","start":{"x":0.0,"y":0.0,"heading":0.0,"speed":0.0},)"
    R"("goal":{"x":17.0,"y":10.0,"heading":1.2,"lane":"a","route_s":26.0},"route":{"lanes":[{"id":"a","from":0.0,)"
    R"("to":28.0}],"length":28.0,"spacing":2.0,"path":[[0.0,0.0,0.0,0.0,13.9],[2.0,0.0,0.0,0.0,13.9],[4.0,0.0,0.0,0.0,)"
    R"(13.9],[6.0,0.0,0.0,0.0,13.9],[8.0,0.0,0.0,0.0,13.9],[10.0,0.0,0.0,0.0,13.9],[11.986693,0.199334,0.2,0.1,13.9],)"
    R"([13.894183,0.78939,0.4,0.1,13.9],[15.646425,1.746644,0.6,0.1,13.9],[17.173561,3.032933,0.8,0.1,13.9],[18.41471,)"
    R"(4.596977,1.0,0.1,13.9],[19.320391,6.376422,1.2,0.1,13.9],[20.045106,8.240501,1.2,0.0,5.0],[20.769822,10.104579,)"
    R"(1.2,0.0,5.0],[21.494537,11.968657,1.2,0.0,5.0]],"changes":[],"stop_lines":[{"route_s":25.0,"signal":"7"}],)"
    R"("signs":[{"route_s":6.0,"kind":"yield"},{"route_s":12.0,"kind":"stop"}],"crosswalks":[[13.0,15.0]]}})";

std::string step_line(int seq, double route_s, double speed, const std::string& state) {
    std::string line = R"({"type":"step","seq":)" + std::to_string(seq) + R"(,"t_us":)" + std::to_string(seq * 100'000) +
                       R"(,"ego":{"x":0.0,"y":0.0,"heading":0.0,"vx":0.0,"vy":0.0,"speed":)";
    avastra::json::append(line, speed);
    line += R"(,"accel":0.0,"yaw_rate":0.0,"steer":0.0,"touched":false,"lane":null,"s":0.0,"d":0.0,"route_s":)";
    avastra::json::append(line, route_s);
    return line + R"(,"route_d":0.5,"position_std":0.07},"objects":[{"id":1,"class":"car","x":40.0,"y":-1.8,"heading":0.01,"vx":3.0,)"
                  R"("vy":4.0,"length":4.8,"width":1.85,"height":1.45,"visible":1.0}],"signals":[{"id":"7","state":")" +
           state + R"("}],"conditions":{"light":1.0,"rain":0.0,"visibility":10000.0,"water":0.0,"friction":0.85}})";
}

std::string text_of(const std::string& json) { return std::get<std::string>(avastra::json::parse(json).data); }

double number_of(const std::string& json) { return std::get<double>(avastra::json::parse(json).data); }

void json_is_read() {
    CHECK(text_of(R"("a\"\\\/\b\f\n\r\t")") == "a\"\\/\b\f\n\r\t");
    CHECK(text_of(R"("\u0041\u00e9\u20ac\ud83d\ude97")") == "A\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\x97");
    CHECK(text_of("\"\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\x97\x7F\"") == "\xC3\xA9\xE2\x82\xAC\xF0\x9F\x9A\x97\x7F");
    CHECK(text_of(R"("\u0000")") == std::string(1, '\0'));
    CHECK(number_of("0") == 0.0 && number_of("-0.5e-1") == -0.05 && number_of(" 12E+2\r\n") == 1200.0);
    CHECK(std::signbit(number_of("-0")));
    CHECK(number_of("9007199254740991") == 9007199254740991.0);
    CHECK(number_of("0.1") == 0.1 && number_of("123456.789012") == 123456.789012);
    CHECK(number_of("1.7976931348623157e308") == std::numeric_limits<double>::max());
    CHECK(number_of("2.2250738585072014e-308") == std::numeric_limits<double>::min());
    // A number too small for a double is 0, as in Python.
    CHECK(number_of("1e-999") == 0.0 && number_of("0." + std::string(400, '0') + "1") == 0.0 && number_of("0e999") == 0.0);
    CHECK(std::get<std::vector<avastra::json::Value>>(avastra::json::parse("[1,[],{},true,false,null]").data).size() == 6);

    const std::string long_number(400, '9');
    for (const std::string& broken : std::vector<std::string>{
             "", " ", "nul", "truth", "NaN", "Infinity", "-Infinity", "-", "+1", ".5", "1.", "1.e5", "1e", "1e+", "01", "-01", "0x10", "1e999", "-1e999",
             long_number, "1 2", "[", "[1", "[1,", "[1,]", "[,1]", "[1 2]", "]", "{", "{1:2}", "{\"a\"}", "{\"a\":}", "{\"a\":1,}", "{\"a\":1 \"b\":2}",
             "{\"a\":1,\"a\":2}", "{a:1}", "\"", "\"a", "\"\\", "\"\\x\"", "\"\\u12\"", "\"\\u12g4\"", "\"\\ud83d\"", "\"\\ud83d\\n\"", "\"\\ud83d\\u0041\"",
             "\"\\ude97\"", "\"\n\"", "\"\t\"", std::string("\"\0\"", 3), std::string("\0", 1), "\"\x80\"", "\"\xC0\x80\"", "\"\xE0\x80\x80\"",
             "\"\xED\xA0\x80\"", "\"\xF4\x90\x80\x80\"", "\"\xF5\x80\x80\x80\"", "\"\xE2\x82\"", "\"\xC3", "'a'", "\xEF\xBB\xBF{}", "[1]]", "//", "[\x0B]"}) {
        if (!contains(error_of([&] { avastra::json::parse(broken); }), "no JSON")) {
            std::cerr << "read as JSON: " << broken << std::endl;
            ++failures;
        }
    }

    const auto nested = [](int depth) { return std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']'); };
    CHECK(error_of([&] { avastra::json::parse(nested(60)); }) == "none");
    CHECK(contains(error_of([&] { avastra::json::parse(nested(100)); }), "too many"));
    CHECK(contains(error_of([&] { avastra::json::parse(std::string(1'000'000, '[')); }), "too many"));
    std::string many = "{\"a0\":0";
    for (int index = 1; index < 1000; ++index) many += ",\"a" + std::to_string(index) + "\":0";
    CHECK(error_of([&] { avastra::json::parse(many + "}"); }) == "none");
    CHECK(contains(error_of([&] { avastra::json::parse(many + ",\"a7\":0}"); }), "twice"));
}

void json_is_written() {
    for (const double number : {0.1, -1.0 / 3.0, 1e22, 2.2250738585072014e-308, 1.7976931348623157e308, 123456.789012, 0.0}) {
        std::string text;
        avastra::json::append(text, number);
        CHECK(number_of(text) == number);
    }
    std::string text;
    avastra::json::append(text, std::string_view("a\"\\\n\x1B\x7F\xC3\xA9\xFF\xE2\x82"));
    CHECK(text == "\"a\\\"\\\\\\u000a\\u001b\\u007f\xC3\xA9\\ufffd\\ufffd\\ufffd\"");
    CHECK(avastra::detail::cut("\xC3\xA9\xC3\xA9\xC3\xA9", 2) == "\xC3\xA9\xC3\xA9");
}

/// Keeps what it is told, and answers what it is given.
struct Probe : avastra::Driver {
    Probe() : Driver({"probe", "1", "acceleration"}) {}

    void init(const avastra::Init& init) override { told = init; }
    void map(const avastra::Map& map) override { roads = &map; }
    void reset(const avastra::Reset& reset) override { start = reset; }
    avastra::Answer step(const avastra::Step& step) override {
        seen = step;
        if (problem == 1) throw std::runtime_error("no plan \xFF");
        if (problem == 2) throw 7;
        return answer;
    }

    avastra::Init told;
    const avastra::Map* roads = nullptr;
    avastra::Reset start;
    avastra::Step seen;
    avastra::Answer answer = avastra::Acceleration{-2.5};
    int problem = 0;
};

void messages_are_read() {
    Probe probe;
    avastra::Conversation conversation(probe);
    CHECK(conversation.reply(init_line) ==
          R"({"type":"ready","protocol":"avastra-ads/1","name":"probe","version":"1","answer":"acceleration","deterministic":true})");
    CHECK(probe.told.vehicle.wheelbase == 2.837007 && probe.told.tick_us == 20'000 && !probe.told.answer);
    CHECK(near(probe.told.vehicle.rear_axle_to_centre(), 1.355));
    CHECK(conversation.reply(map_line + "\r") == R"({"type":"ready"})");
    CHECK(!probe.roads->opendrive && probe.roads->lane("b").left_neighbor->id == "a" && probe.roads->lane("a").left[1].y == 1.75);
    CHECK(contains(error_of([&] { probe.roads->lane("c"); }), "no lane `c`"));
    CHECK(conversation.reply(reset_line) == R"({"type":"ready"})");
    CHECK(probe.start.seed == 5077240519623781 && probe.start.route.path.size() == 15 && probe.start.route.crosswalks[0].to == 15.0);
    CHECK(conversation.reply(step_line(3, 1.5, 2.5, "red")) == R"({"type":"acceleration","seq":3,"accel":-2.5})");
    CHECK(probe.seen.t_us == 300'000 && probe.seen.ego.route_s == 1.5 && !probe.seen.ego.lane && probe.seen.signals[0].state == "red");
    CHECK(probe.seen.objects[0].kind == "car" && probe.seen.objects[0].speed() == 5.0 && !probe.seen.objects[0].lights);
    CHECK(!conversation.reply(R"({"type":"event","kind":"collision","t_us":1,"with":2})"));

    // Fields of later versions are ignored, optional ones may be null or there, fields may come in any order.
    const std::string step = step_line(0, 0.0, 0.0, "red");
    CHECK(conversation.reply(with(step, "\"visible\":1.0", R"("news":{"a":[1]},"lights":"left","visible":1.0)")));
    CHECK(probe.seen.objects[0].lights == "left");
    CHECK(conversation.reply(with(step, "\"visible\":1.0", R"("lights":null,"visible":0.5)")) && probe.seen.objects[0].visible == 0.5);
    CHECK(conversation.reply(with(with(step, "\"seq\":0,", ""), "\"objects\"", "\"seq\":0,\"objects\"")));

    const auto error = [&](const std::string& line) { return error_of([&] { conversation.reply(line); }); };
    CHECK(error(with(step, "\"route_s\":0,", "")) == "`step.ego.route_s` is missing");
    CHECK(error(with(step, "\"touched\":false", "\"touched\":0")) == "`step.ego.touched` must be true or false");
    CHECK(error(with(step, "\"width\":1.85", "\"width\":\"1\"")) == "`step.objects[0].width` must be a number");
    CHECK(error(with(step, "\"width\":1.85", "\"width\":null")) == "`step.objects[0].width` must be a number");
    CHECK(error(with(step, "\"seq\":0", "\"seq\":-1")) == "`step.seq` must be an integer of at least 0, below 2^53");
    CHECK(contains(error(with(step, "\"seq\":0", "\"seq\":0.5")), "must be an integer"));
    CHECK(contains(error(with(step, "\"seq\":0", "\"seq\":9007199254740992")), "must be an integer"));
    CHECK(error(with(reset_line, "[2.0,0.0,0.0,0.0,13.9]", "[2.0,0.0]")) == "`reset.route.path[1]` must be a list of numbers, and has too few");
    CHECK(contains(error(R"({"type":"dance"})"), "`dance` is no message"));
    CHECK(error("[]") == "`message` must be an object" && error("{}") == "`message.type` is missing");

    Probe other;
    avastra::Conversation fresh(other);
    const auto first = [&](const std::string& line) { return error_of([&] { fresh.reply(line); }); };
    CHECK(contains(first(step), "must be `init`"));
    CHECK(contains(first(with(init_line, "avastra-ads/1", "avastra-ads/2")), "speaks avastra-ads/2"));
    CHECK(contains(first(with(init_line, "\"tick_us\"", "\"answer\":\"control\",\"tick_us\"")), "gives only `acceleration`"));
    CHECK(first(init_line) == "none");
    CHECK(contains(first(reset_line), "before the first `map`"));
    CHECK(first(map_line) == "none");
    CHECK(contains(first(step), "before the first `reset`"));
    other.ready.name.clear();
    CHECK(contains(first(init_line), "`ready.name`"));
}

void answers_are_written() {
    Probe probe;
    avastra::Conversation conversation(probe);
    for (const std::string& line : {init_line, map_line, reset_line}) conversation.reply(line);
    const auto said = [&](const char* kind, const avastra::Answer& answer) {
        probe.ready.answer = kind;
        probe.answer = answer;
        std::string text = "nothing";
        const std::string error = error_of([&] { text = *conversation.reply(step_line(1, 0.0, 0.0, "red")); });
        return error == "none" ? text : error;
    };
    using namespace avastra;
    constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
    CHECK(said("control", Control{1.2, -0.01}) == R"({"type":"control","seq":1,"accel":1.2,"steer":-0.01})");
    CHECK(said("control", Pedals{0.25, 0.0, -0.01}) == R"({"type":"control","seq":1,"throttle":0.25,"brake":0,"steer":-0.01})");
    CHECK(said("acceleration", Acceleration{1.0 / 3.0, {}, "go"}) ==
          R"({"type":"acceleration","seq":1,"accel":0.3333333333333333,"lane_change":"go"})");
    const Internal internal{"follow \"3\"", std::vector<Point>{{1.0, 2.0}, {3.5, 4.0}}, Pose{1.0, 2.0, 0.5}, 4.2};
    CHECK(said("acceleration", Acceleration{0.0, internal}) ==
          R"({"type":"acceleration","seq":1,"accel":0,"internal":{"reason":"follow \"3\"","planned":[[1,2],[3.5,4]],)"
          R"("localized":{"x":1,"y":2,"heading":0.5},"plan_ms":4.2}})");
    CHECK(said("trajectory", Trajectory{{{0, 1.0, 2.0, 0.5, 3.0}, {1'100'000, 4.0, 5.0, 0.5, 3.0, -1.0}}}) ==
          R"({"type":"trajectory","seq":1,"points":[{"t_us":0,"x":1,"y":2,"heading":0.5,"v":3},)"
          R"({"t_us":1100000,"x":4,"y":5,"heading":0.5,"v":3,"a":-1}]})");

    CHECK(said("control", Acceleration{0.0}) == "`step` returned acceleration, but the driver announced `control`");
    CHECK(said("control", Control{nan, 0.0}) == "`control.accel` is nan, and must be finite");
    CHECK(said("control", Control{0.0, -inf}) == "`control.steer` is infinite, and must be finite");
    CHECK(said("control", Control{0.0, 90.0}) == "`control.steer` is 90, and must be from -3.2 to 3.2");
    CHECK(said("control", Pedals{1.5, 0.0, 0.0}) == "`control.throttle` is 1.5, and must be from 0 to 1");
    CHECK(said("acceleration", Acceleration{0.0, {}, "now"}) == "`acceleration.lane_change` is \"now\", and must be \"wait\" or \"go\"");
    CHECK(said("acceleration", Acceleration{0.0, {std::string(201, 'a')}}) == "`acceleration.internal.reason` has 201 characters, and must have at most 200");
    CHECK(contains(said("acceleration", Acceleration{0.0, {std::nullopt, std::vector<Point>{{0.0, nan}}}}), "`acceleration.internal.planned[0][1]` is nan"));
    CHECK(contains(said("acceleration", Acceleration{0.0, {std::nullopt, std::vector<Point>(1001)}}), "at most 1,000"));
    CHECK(contains(said("acceleration", Acceleration{0.0, {std::nullopt, std::nullopt, std::nullopt, inf}}), "`acceleration.internal.plan_ms` is infinite"));
    CHECK(contains(said("trajectory", Trajectory{{{0, 0.0, 0.0, 0.0, 0.0}}}), "2 to 1,000"));
    CHECK(said("trajectory", Trajectory{{{0, 0.0, 0.0, 0.0, 0.0}, {1'500'000, 0.0, nan, 0.0, 0.0}}}) == "`trajectory.points[1].y` is nan, and must be finite");
    CHECK(contains(said("trajectory", Trajectory{{{0, 0.0, 0.0, 0.0, 0.0}, {0, 0.0, 0.0, 0.0, 0.0}}}), "`trajectory.points[1].t_us`"));
    CHECK(contains(said("trajectory", Trajectory{{{0, 0.0, 0.0, 0.0, -0.1}, {1'500'000, 0.0, 0.0, 0.0, 0.0}}}), "`trajectory.points[0].v` is -0.1"));
    CHECK(contains(said("trajectory", Trajectory{{{0, 0.0, 0.0, 0.0, 0.0}, {1'000'000, 0.0, 0.0, 0.0, 0.0}}}), "at least 1 s beyond"));
    CHECK(contains(said("trajectory", Trajectory{{{200'000, 0.0, 0.0, 0.0, 0.0}, {2'000'000, 0.0, 0.0, 0.0, 0.0}}}), "begin at the time of the step"));
}

avastra::Step step_at(double route_s, double speed, const std::string& state) {
    avastra::Step step;
    step.ego.route_s = route_s, step.ego.speed = speed, step.ego.route_d = 0.5, step.t_us = 300'000;
    step.signals = {{"7", state}};
    return step;
}

void paths_and_ways_are_pythons() {
    Probe probe;
    avastra::Conversation conversation(probe);
    for (const std::string& line : {init_line, map_line, reset_line}) conversation.reply(line);
    const avastra::Vehicle& vehicle = probe.told.vehicle;
    avastra::Way way(vehicle, *probe.roads, probe.start), asked(vehicle, *probe.roads, probe.start);
    const avastra::Path& path = way.path;
    CHECK(near(path.length(), 27.980009949872258));

    // Station and offset; then x, y, heading and curvature there.
    for (const auto& [station, offset, x, y, heading, curvature] : std::vector<std::array<double, 6>>{
             {-3.0, 1.0, -3, 1, 0, 0},
             {5.5, -1.0, 5.5, -1, 0, 0},
             {9.9, 0.0, 9.9000000000000004, 0, 0.045037473403751971, 0.047579263073650124},
             {15.3, 2.0, 14.082037397252115, 3.1710030700400189, 0.53088430788271834, 0.10016683699261386},
             {27.0, 0.5, 20.673403403077966, 11.236428130141331, 1.200000206031351, 1.1534044452865544e-07},
             {31.0, -2.0, 24.452931554428201, 14.058690866519905, 1.200000206031351, 0},
         }) {
        const avastra::Pose pose = path.at(station, offset);
        CHECK(near(pose.x, x) && near(pose.y, y) && near(pose.heading, heading) && near(path.curvature(station), curvature));
    }

    // A point; then station, offset and heading beside the path, station and offset beside the smoothed path.
    const avastra::Path smooth = path.smoothed();
    for (const auto& [x, y, station, offset, heading, smooth_station, smooth_offset] : std::vector<std::array<double, 7>>{
             {-4.0, 2.0, -4, 2, 0, -4, 2},
             {3.0, -1.0, 3, -1, 0, 3, -1},
             {11.0, 3.0, 11.294504141049407, 2.8851792021997418, 0.12966636919376384, 11.433257266163308, 2.6772270831917324},
             {14.0, 0.5, 13.993336275106561, -0.30812953378246627, 0.39999999118135943, 13.911515976025314, -0.57196865062582614},
             {19.0, 9.0, 24.30919044246226, 1.2492900787291532, 1.1999999570884734, 24.026378805678689, 1.2306982195152218},
             {25.0, 30.0, 46.056158772449983, 3.2665647050134607, 1.200000206031351, 45.787087883228651, 3.2665671490694965},
             {10.0, 10.0, 14.991670109494871, 9.9500415760289407, 0.49999985784742629, 14.883492912010025, 9.6873475773466282},
         }) {
        const avastra::Beside one = path.project(x, y), other = smooth.project(x, y);
        CHECK(near(one.station, station) && near(one.offset, offset) && near(one.heading, heading));
        CHECK(near(other.station, smooth_station) && near(other.offset, smooth_offset));
    }

    const avastra::Path seam({{0, 0}, {1, 0}, {1.004, 0.0}, {0.998, 0.001}, {2, 0}, {2.005, 0}});
    CHECK(seam.xy().size() == 3 && near(seam.length(), 2.005));
    bool refused = false;
    try {
        avastra::Path({{1, 1}, {1, 1}});
    } catch (const std::invalid_argument&) {
        refused = true;
    }
    CHECK(refused);
    CHECK(avastra::wrap(-avastra::pi) == avastra::pi && near(avastra::wrap(7.0), 0.7168146928204138) && near(avastra::wrap(-7.0), -0.7168146928204138));
    // A place that is no number is no reason to leave the memory of the path.
    CHECK(std::isnan(path.at(std::numeric_limits<double>::quiet_NaN()).x) && way.speed(std::numeric_limits<double>::quiet_NaN()) > 0.0);
    path.project(std::numeric_limits<double>::quiet_NaN(), 0.0);
    CHECK(near(way.speed(1e300), 5.0));

    // Ego's station and speed and the light, one after another; then the stop (below 0: none), speed, curvature and wanted speed.
    struct Row {
        double route_s, speed;
        const char* state;
        double stop, allowed, curvature, wanted;
    };
    constexpr double none = -1.0;
    for (const Row& row : std::vector<Row>{
             {0.0, 8.0, "green", 12.0, 7.4833147735478835, 0, 0},
             {3.0, 4.0, "green", 12.0, 7.0710678118654764, 0, 0},
             {6.0, 1.0, "green", 12.0, 6.1644140029689769, 0, 0},
             {7.0, 0.05, "green", none, 6.1644140029689769, 0, 6.1644140029689769},
             {7.5, 2.0, "green", none, 6.1644140029689769, 0, 5.0990195135927854},
             {9.5, 5.0, "yellow", 25.0, 5.6568542494923806, 0, 3.9855990766759266},
             {12.0, 10.0, "yellow", 25.0, 4.4721359549995796, 0.10000000000000001, 0},
             {14.0, 6.0, "yellow", 25.0, 4.4721359549995796, 0.10000000000000001, 0},
             {19.0, 6.0, "yellow", 25.0, 4.4721359549995796, 0.10000000000000001, 0},
             {19.5, 12.0, "red", 25.0, 4.4721359549995796, 0.10000000000000001, 0},
             {21.0, 3.0, "red", 25.0, 4.4721359549995796, 0.10000000000000001, 0},
             {21.0, 1.0, "green", none, 4.4721359549995796, 0.10000000000000001, 4.4721359549995796},
             {22.5, 3.0, "red", none, 4.4721359549995796, 0.10000000000000001, 4.4721359549995796},
             {23.0, 2.0, "unknown", none, 4.4721359549995796, 0.10000000000000001, 4.4721359549995796},
         }) {
        const avastra::Step step = step_at(row.route_s, row.speed, row.state);
        CHECK(way.stop(step).value_or(none) == row.stop);
        CHECK(near(way.speed(row.route_s), row.allowed) && near(way.curvature(row.route_s), row.curvature));
        CHECK(near(asked.wanted_speed(step), row.wanted));
    }
    // Too fast to stop at yellow with 4 m/s²; the stop sign is behind already.
    CHECK(!avastra::Way(vehicle, *probe.roads, probe.start).stop(step_at(13.0, 10.0, "yellow")));

    const auto [left, right] = way.room(5.0);
    CHECK(near(left, 5.25) && near(right, 1.75));
    const std::vector<avastra::TrajectoryPoint> braking = way.braking(step_at(4.0, 5.0, "green"));
    CHECK(braking.size() == 31 && near(braking[5].x, 5.75) && near(braking[5].y, 0.5) && near(braking[5].v, 2.0));
    CHECK(near(braking[30].x, 6.083333333333333) && braking[30].v == 0.0 && braking[30].t_us == 3'300'000 && *braking[30].a == -6.0);
}

void conversations_end() {
    const auto lead = [](Probe& probe, const std::string& lines, std::string& said) {
        std::istringstream in(lines);
        return avastra::converse(probe, in, [&](const std::string& line) {
            said = line;
            return true;
        });
    };
    const std::string begin = init_line + "\n\r\n" + map_line + "\n" + reset_line + "\n", step = step_line(0, 0.0, 0.0, "red") + "\n";
    Probe probe;
    std::string said;
    CHECK(lead(probe, begin + step + "{\"type\":\"close\"}\n" + "garbage\n", said) == 0 && contains(said, "\"acceleration\""));
    CHECK(lead(probe, begin + step, said) == 0);
    CHECK(lead(probe, "", said) == 0);
    CHECK(lead(probe, begin + "{\"type\":\n", said) == 2 && contains(said, "{\"type\":\"error\",\"message\":\"no JSON"));
    probe.problem = 1;
    CHECK(lead(probe, begin + step, said) == 1 && said == R"({"type":"error","message":"no plan \ufffd"})");
    probe.problem = 2;
    CHECK(lead(probe, begin + step, said) == 1 && contains(said, "no std::exception"));
}

/// Every line of a file in a conversation of its own, after what it needs.
int read_lines(const char* file) {
    std::ifstream in(file, std::ios::binary);
    std::size_t read = 0, refused = 0;
    for (std::string line; std::getline(in, line); ++read) {
        Probe probe;
        avastra::Conversation conversation(probe);
        for (const std::string& before : {init_line, map_line, reset_line}) conversation.reply(before);
        refused += error_of([&] { conversation.reply(line); }) != "none";
    }
    std::cout << read << " lines, " << refused << " refused" << std::endl;
    return read > 0 ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
    if (count == 3 && std::string(arguments[1]) == "--lines") return read_lines(arguments[2]);
    json_is_read();
    json_is_written();
    messages_are_read();
    answers_are_written();
    paths_and_ways_are_pythons();
    // `converse` prints its errors, too. They are shown only if something is wrong.
    std::ostringstream errors;
    std::streambuf* before = std::cerr.rdbuf(errors.rdbuf());
    const int failed = failures;
    conversations_end();
    std::cerr.rdbuf(before);
    if (failures > failed) std::cerr << errors.str();
    std::cout << (failures == 0 ? "all tests passed" : "tests failed") << std::endl;
    return failures == 0 ? 0 : 1;
}
