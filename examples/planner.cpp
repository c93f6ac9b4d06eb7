// A planner under test in C++, with nothing but the standard library: it keeps to its lane and keeps its distance.
//
//   c++ -O2 -std=c++17 -o planner examples/planner.cpp
//   avastra ads check --ads ./planner
//   avastra run scenarios/avastra45.ava --ads ./planner
//
// docs/reference/protocol.md describes the messages. This program answers with accelerations, so avastra steers along the route. It
// reads numbers out of the text of a message by the names of their fields; a real planner would use a JSON library.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <string>

// The number after `"name":`, looked for from a place in the text on.
static double number(const std::string& text, const std::string& name, std::size_t from = 0) {
    const std::string key = "\"" + name + "\":";
    const std::size_t at = text.find(key, from);
    return at == std::string::npos ? 0.0 : std::strtod(text.c_str() + at + key.size(), nullptr);
}

static bool is(const std::string& text, const std::string& type) {
    return text.find("{\"type\":\"" + type + "\"") == 0;
}

// The intelligent driver model: the acceleration behind something at a gap (m), that drives at a speed (m/s).
static double follow(double speed, double wanted_speed, double gap, double other_speed) {
    const double reach = 4.0 + std::max(0.0, 1.5 * speed + speed * (speed - other_speed) / (2.0 * std::sqrt(1.5 * 3.0)));
    const double interaction = reach / std::max(gap, 0.1);
    return 1.5 * (1.0 - std::pow(speed / wanted_speed, 4.0) - interaction * interaction);
}

int main() {
    std::ios::sync_with_stdio(false);
    std::string line;
    while (std::getline(std::cin, line)) {
        // Lines about a collision come right before a step, each on its own.
        if (is(line, "init")) {
            std::cout << R"({"type":"ready","protocol":"avastra-ads/1","name":"example_cpp","version":"1",)"
                      << R"("answer":"acceleration","deterministic":true})" << std::endl;
        } else if (is(line, "map") || is(line, "reset")) {
            std::cout << R"({"type":"ready"})" << std::endl;
        } else if (is(line, "step")) {
            const double x = number(line, "x"), y = number(line, "y"), heading = number(line, "heading");
            const double speed = number(line, "speed"), wanted_speed = 9.0;
            double accel = follow(speed, wanted_speed, 1000.0, wanted_speed);
            // Each object begins with its id; what lies within 2 m beside the way straight ahead is followed.
            for (std::size_t at = line.find("\"objects\""); (at = line.find("{\"id\":", at + 1)) != std::string::npos;) {
                if (line.compare(at + 6, 1, "\"") == 0) break;  // the ids of lights are strings: the objects are over
                const double dx = number(line, "x", at) - x, dy = number(line, "y", at) - y;
                const double ahead = std::cos(heading) * dx + std::sin(heading) * dy;
                const double left = std::cos(heading) * dy - std::sin(heading) * dx;
                const double along = std::cos(heading) * number(line, "vx", at) + std::sin(heading) * number(line, "vy", at);
                const double gap = ahead - number(line, "length", at) / 2.0 - 3.705;
                if (gap > 0.0 && std::fabs(left) < 2.0) {
                    accel = std::min(accel, follow(speed, wanted_speed, gap, std::max(0.0, along)));
                }
            }
            accel = std::clamp(accel, -8.0, 2.0);
            std::cout << R"({"type":"acceleration","seq":)" << static_cast<long long>(number(line, "seq"))
                      << R"(,"accel":)" << accel << "}" << std::endl;
        } else if (is(line, "close")) {
            return 0;
        }
    }
    return 0;
}
