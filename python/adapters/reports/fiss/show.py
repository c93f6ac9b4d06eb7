"""FISS drives over an active stop line from rest: `pip install fiss-planner==1.0.0 && python show.py`.

A vehicle stands on a straight lane before a line that is active. It follows each plan of `LocalPlanner.step` exactly. Exits with 3 if it passes the line.
"""

import sys

import fiss_planner as fiss
import numpy as np

LINE, LIMIT, DT, SECONDS = 100.0, 8.6, 0.1, 15.0


def road():
    along = np.arange(0.0, 201.0)
    lane = fiss.MapLane()
    lane.id, lane.speed_limit = 0, LIMIT
    lane.centerline = np.column_stack([along, 0.0 * along])
    lane.left, lane.right = lane.centerline + [0.0, 1.75], lane.centerline - [0.0, 1.75]
    made = fiss.RoadMap()
    made.add_lane(lane)
    made.add_stop_line(fiss.StopLine(0, 0, LINE, True))
    made.finalize()
    return made


def play(planner, gap, aside):
    """The first plan's flags and speed at its end, and when the front passes the line."""
    params, config = fiss.VehicleParams(), fiss.LocalPlannerConfig()
    config.planner.type = fiss.planner_type_from_string(planner)
    local = fiss.LocalPlanner(config, params)
    local.set_map(road(), [0])
    local.set_stop_line_active(0, True)
    half, first = params.length / 2.0, None
    state = fiss.EgoState(LINE - gap - half, aside, 0.0, 0.0, 0.0, 0.0)
    for step in range(round(SECONDS / DT)):
        output = local.step(DT * step, state, [], LIMIT)
        plan = output.trajectory
        if first is None:
            flags = [name for name in ("fallback", "degraded", "emergency") if getattr(output, name)]
            first = ", ".join(flags) or "none", float(plan.v[-1])
        if len(plan.t) > 1:
            state = fiss.EgoState(*(float(values[1]) for values in (plan.x, plan.y, plan.yaw, plan.v, plan.a)), 0.0)
        if state.x + half > LINE:
            return first, f"passes the line at {DT * (step + 1):.1f} s with {state.v:.2f} m/s"
    return first, "stays"


passed = False
print("planner    before the line  beside the centre  first plan: flags, speed at its end")
for planner in ("fiss_plus", "fiss", "fop_plus", "fop"):
    for aside in (0.0, 0.1):
        (flags, speed), end = play(planner, 2.5, aside)
        passed |= end != "stays"
        print(f"{planner:10} {2.5:9.1f} m {aside:15.1f} m       {flags}, {speed:.2f} m/s: {end}")
sys.exit(3 if passed else 0)
