"""A policy behind the gRPC service `EgodriverService` as a driving system under test.

AlpaSim and Autoware's CARLA runtime (`autoware_carla_scenario`) drive policies through this service; PyPI `carla-driver-interface` has its
messages, under whose names the fields below are. The option says which policy:

- `egodriver:HOST:PORT`: the one that is served there;
- `egodriver:route_follower` or `egodriver:constant_speed`: a policy of the package, served by this process over a socket of its own.

A policy gets where the ego vehicle is and how it moves, the route ahead, and as `renderer_data` what CARLA's runtime sends: road users, the lights on the
route and the speed limit. There are no cameras and no LiDAR, because avastra has no sensors to render: what drives by images cannot be tested this way.
Its frame `local` is the map frame, its frame `rig` lies on the ground below the rear axle. Its plan is the trajectory that avastra's controller follows; a
plan that is empty or too short goes on at rest, and a policy that ends the session has failed.
"""

import contextlib
import math
import sys

import avastra
import grpc
from carla_driver_interface import contract, protocol
from carla_driver_interface.geometry import Pose, Trajectory, waypoints_to_proto
from carla_driver_interface.policies import load_policy
from carla_driver_interface.server import serving

#: The route is sent this far ahead, m, in points this far apart, m.
AHEAD, SPACING = 100.0, 2.0
#: A plan reaches at least this far beyond the step, µs: the protocol asks for 1 s.
REACH_US = 1_000_000
LIGHTS = {"red": "RED", "yellow": "YELLOW", "green": "GREEN"}
#: A call that takes longer is given up, s: avastra's own limit is the shorter one.
TIMEOUT = 60.0


class Policy(avastra.Driver):
    answer = "trajectory"

    def __init__(self, choice):
        self.resources = contextlib.ExitStack()
        if ":" not in choice:
            port = self.resources.enter_context(serving(load_policy(choice), port=0, host="127.0.0.1"))
            choice = f"127.0.0.1:{port}"
        channel = self.resources.enter_context(grpc.insecure_channel(choice, options=protocol.channel_options()))
        self.stub = protocol.EgodriverServiceStub(channel)
        version, self.revision = contract.negotiate(self.stub, timeout=TIMEOUT)
        self.name, self.version = f"egodriver {version.version_id}"[:100], version.git_hash[:100] or "unknown"
        self.session = None
        self.episodes = 0

    def init(self, init):
        self.vehicle, self.period_us = init.vehicle, init.period_us

    def map(self, map):
        self.roads = map

    def reset(self, reset):
        self.end()
        self.way = avastra.Way(self.vehicle, self.roads, reset)
        self.episodes += 1
        # A name is all that a policy is told of the episode besides the seed; it must not decide anything.
        self.session = f"avastra-{self.episodes}"
        request = protocol.DriveSessionRequest(session_uuid=self.session, random_seed=reset.seed)
        request.debug_info.scene_id = reset.map
        self.stub.start_session(request, timeout=TIMEOUT, metadata=contract.contract_metadata(self.revision))

    def step(self, step):
        ego = step.ego
        rig = Pose.from_xyz_yaw(ego.x, ego.y, 0.0, ego.heading)
        motion = protocol.RolloutEgoTrajectory(session_uuid=self.session)
        motion.trajectory.CopyFrom(Trajectory([step.t_us], [rig]).to_proto())
        motion.dynamic_states.append(protocol.DynamicState(
            linear_velocity=protocol.Vec3(x=ego.speed), linear_acceleration=protocol.Vec3(x=ego.accel),
            angular_velocity=protocol.Vec3(z=ego.yaw_rate)))
        self.stub.submit_egomotion_observation(motion, timeout=TIMEOUT)
        route = protocol.Route(timestamp_us=step.t_us, waypoints=waypoints_to_proto(rig.inverse().transform_points(self.ahead(ego))))
        self.stub.submit_route(protocol.RouteRequest(session_uuid=self.session, route=route), timeout=TIMEOUT)
        answer = self.stub.drive(protocol.DriveRequest(
            session_uuid=self.session, time_now_us=step.t_us, time_query_us=step.t_us + self.period_us,
            renderer_data=self.world(step).SerializeToString()), timeout=TIMEOUT)
        if answer.terminate_session:
            raise RuntimeError("the policy ends the session (`terminate_session`)")
        return avastra.Trajectory(self.plan(step, answer.trajectory))

    def ahead(self, ego):
        """The route from the ego vehicle on, up to the goal."""
        last = min(ego.route_s + AHEAD, max(self.way.goal, ego.route_s + SPACING))
        count = max(2, math.ceil((last - ego.route_s) / SPACING) + 1)
        stations = [min(ego.route_s + index * SPACING, last) for index in range(count)]
        return [(*self.way.path.at(station)[:2], 0.0) for station in stations]

    def world(self, step):
        """What CARLA's runtime sends of the world."""
        data = protocol.CarlaRendererData(snapshot_timestamp_us=step.t_us, speed_limit_mps=self.limit(step.ego.route_s))
        state, data.ego_traffic_light_distance_m = self.light(step)
        data.ego_traffic_light = protocol.TrafficLightState.Value(f"TRAFFIC_LIGHT_STATE_{state}")
        for other in step.objects:
            actor = data.actors.add(track_id=str(other.id), type_id="walker" if other.kind in ("pedestrian", "animal") else f"vehicle.{other.kind}")
            pose = Pose.from_xyz_yaw(other.x, other.y, other.height / 2.0, other.heading)
            actor.pose_local_to_aabb.CopyFrom(pose.to_proto())
            actor.aabb.size_x, actor.aabb.size_y, actor.aabb.size_z = other.length, other.width, other.height
            # Velocities are those along the object's own axes, as for the ego vehicle.
            along, left = math.cos(other.heading), math.sin(other.heading)
            actor.dynamic_state.linear_velocity.x = along * other.vx + left * other.vy
            actor.dynamic_state.linear_velocity.y = along * other.vy - left * other.vx
        return data

    def limit(self, station):
        points = self.way.route.path
        return points[min(max(int(station / self.way.route.spacing), 0), len(points) - 1)].speed_limit

    def light(self, step):
        """What the next light on the route shows, and how far its line is from the front, m; NONE and -1 without one."""
        front = step.ego.route_s + self.vehicle.rear_axle_to_front
        states = {signal.id: signal.state for signal in step.signals}
        for line in self.way.route.stop_lines:
            if line.route_s >= front and line.signal in states:
                return LIGHTS.get(states[line.signal], "UNKNOWN"), line.route_s - front
        return "NONE", -1.0

    def plan(self, step, planned):
        """The plan as points from now on; at rest where it ends before it must."""
        ego = step.ego
        points = [avastra.TrajectoryPoint(step.t_us, ego.x, ego.y, ego.heading, v=ego.speed)]
        for at in planned.poses:
            last = points[-1]
            if at.timestamp_us <= last.t_us:
                continue
            quat, place = at.pose.quat, at.pose.vec
            heading = math.atan2(2.0 * (quat.w * quat.z + quat.x * quat.y), 1.0 - 2.0 * (quat.y**2 + quat.z**2))
            speed = math.dist((last.x, last.y), (place.x, place.y)) / (at.timestamp_us - last.t_us) * 1e6
            points.append(avastra.TrajectoryPoint(at.timestamp_us, place.x, place.y, heading, v=speed))
        last = points[-1]
        if len(points) == 1 or last.t_us < step.t_us + REACH_US:
            points.append(avastra.TrajectoryPoint(max(last.t_us, step.t_us + REACH_US) + 100_000, last.x, last.y, last.heading, v=0.0))
        return points

    def end(self):
        if self.session is not None:
            self.stub.close_session(protocol.DriveSessionCloseRequest(session_uuid=self.session), timeout=TIMEOUT)
            self.session = None

    def close(self):
        self.end()
        self.resources.close()


if __name__ == "__main__":
    avastra.serve(lambda: Policy(sys.argv[1] if len(sys.argv) > 1 else "route_follower"))
