"""An ASAM OSI traffic participant as a driving system under test: `osi:HOST:PORT`, with PyPI `betterosi` for the messages.

The participant listens; this connects to it. Each message is a little-endian 32-bit length and the bytes of the protobuf message, as in `.osi` traces. Each
step it gets a `SensorView` and answers a `TrafficUpdate` for the host vehicle, as the OSMP interface of a traffic participant has it. Without a number it
starts `participant.py` beside this file, a participant that keeps to the route and brakes for what is ahead.

- `SensorView.timestamp` is the time of the episode: where it falls back to 0, another episode begins. `global_ground_truth` has the host vehicle and the
  road users (`moving_object`), the lights of the map (`traffic_light`), and in the first message of an episode the lanes with their centre lines, the route
  as `reference_line` 1, and the path of the OpenDRIVE file as `map_reference`. `host_vehicle_data.vehicle_motion` is the motion of the rear axle.
- Ids of avastra's lanes and lights are texts: their places on the map, from 1, are their numbers here.
- Of the update the `future_trajectory` is followed, if it reaches 1 s ahead; otherwise the state of `base` at its timestamp is, and from there on its
  acceleration along its heading.

OSI has no handshake, so the version is the one that `betterosi` writes, and whether the participant is deterministic is taken for granted.
"""

import math
import pathlib
import socket
import struct
import subprocess
import sys

import avastra
import betterosi as osi

HOST = 1
#: Road users have ids from here on, lanes and lights too: an identifier is unique among all objects.
OBJECTS, LANES, LIGHTS = 1_000, 1_000_000, 2_000_000
ROUTE = 3_000_000
REACH = 1.0
VEHICLES = {"car": "CAR", "truck": "HEAVY_TRUCK", "bus": "BUS", "motorcycle": "MOTORBIKE", "cyclist": "BICYCLE"}


class Participant(avastra.Driver):
    name = "OSI traffic participant"
    version = osi.DEFAULT_VERSION if isinstance(osi.DEFAULT_VERSION, str) else "3"
    answer = "trajectory"

    def __init__(self, address):
        self.child = None
        if not address:
            script = pathlib.Path(__file__).with_name("participant.py")
            self.child = subprocess.Popen([sys.executable, str(script), "0"], stdout=subprocess.PIPE, text=True)
            address = f"127.0.0.1:{self.child.stdout.readline().strip()}"
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def init(self, init):
        self.vehicle = init.vehicle

    def map(self, map):
        self.roads = map
        self.lanes = {lane.id: LANES + index for index, lane in enumerate(map.lanes, 1)}
        self.lights = {signal.id: LIGHTS + index for index, signal in enumerate(map.signals, 1)}

    def reset(self, reset):
        self.way = avastra.Way(self.vehicle, self.roads, reset)

    def step(self, step):
        ego, vehicle = step.ego, self.vehicle
        truth = osi.GroundTruth(timestamp=stamp(step.t_us), host_vehicle_id=osi.Identifier(value=HOST))
        truth.moving_object.append(self.host(ego))
        truth.moving_object.extend(moving(other) for other in step.objects)
        truth.traffic_light.extend(self.light(signal) for signal in step.signals if signal.id in self.lights)
        if step.seq == 0:
            truth.map_reference = self.roads.opendrive or ""
            truth.lane.extend(self.lane(lane) for lane in self.roads.lanes)
            points = [osi.ReferenceLine.ReferenceLinePoint(world_position=vector(point.x, point.y), s_position=index * self.way.route.spacing)
                      for index, point in enumerate(self.way.route.path)]
            truth.reference_line.append(osi.ReferenceLine(id=osi.Identifier(value=ROUTE), poly_line=points))
        motion = osi.HostVehicleData.VehicleMotion(
            position=vector(ego.x, ego.y), orientation=osi.Orientation3d(yaw=ego.heading), velocity=vector(ego.vx, ego.vy),
            acceleration=vector(ego.accel * math.cos(ego.heading), ego.accel * math.sin(ego.heading)))
        data = osi.HostVehicleData(timestamp=stamp(step.t_us), host_vehicle_id=osi.Identifier(value=HOST), vehicle_motion=motion)
        view = osi.SensorView(timestamp=stamp(step.t_us), host_vehicle_id=osi.Identifier(value=HOST), global_ground_truth=truth, host_vehicle_data=data)
        send(self.socket, view.to_binary())
        update = osi.TrafficUpdate.from_binary(receive(self.socket))
        own = next((moved for moved in update.update if moved.id is not None and moved.id.value == HOST), None)
        if own is None:
            raise ValueError(f"the TrafficUpdate has no object {HOST}, the host vehicle")
        return avastra.Trajectory(self.points(step, own, update.timestamp))

    def host(self, ego):
        vehicle = self.vehicle
        to_centre = vehicle.rear_axle_to_front - vehicle.length / 2.0
        x, y = ego.x + to_centre * math.cos(ego.heading), ego.y + to_centre * math.sin(ego.heading)
        base = osi.BaseMoving(
            dimension=osi.Dimension3d(length=vehicle.length, width=vehicle.width, height=vehicle.height),
            position=vector(x, y, vehicle.height / 2.0), orientation=osi.Orientation3d(yaw=ego.heading), velocity=vector(ego.vx, ego.vy),
            acceleration=vector(ego.accel * math.cos(ego.heading), ego.accel * math.sin(ego.heading)), orientation_rate=osi.Orientation3d(yaw=ego.yaw_rate))
        lanes = [osi.Identifier(value=self.lanes[ego.lane])] if ego.lane in self.lanes else []
        return osi.MovingObject(
            id=osi.Identifier(value=HOST), base=base, type=osi.MovingObject.Type.VEHICLE, assigned_lane_id=lanes,
            vehicle_attributes=osi.MovingObject.VehicleAttributes(bbcenter_to_rear=vector(-to_centre, 0.0)))

    def light(self, signal):
        color = getattr(osi.TrafficLight.Classification.Color, signal.state.upper(), osi.TrafficLight.Classification.Color.UNKNOWN)
        at = next(place for place in self.roads.signals if place.id == signal.id)
        stops = [osi.Identifier(value=self.lanes[lane.id]) for lane in self.roads.lanes if any(line.signal == signal.id for line in lane.stop_lines)]
        return osi.TrafficLight(
            id=osi.Identifier(value=self.lights[signal.id]), base=osi.BaseStationary(position=vector(at.x, at.y)),
            classification=osi.TrafficLight.Classification(color=color, mode=osi.TrafficLight.Classification.Mode.CONSTANT, assigned_lane_id=stops))

    def lane(self, lane):
        kind = osi.Lane.Classification.Type
        before, after = (self.numbered(ids) for ids in (lane.predecessors, lane.successors))
        pairs = [osi.Lane.Classification.LanePairing(antecessor_lane_id=a, successor_lane_id=b) for a in before or [None] for b in after or [None]]
        return osi.Lane(id=osi.Identifier(value=self.lanes[lane.id]), classification=osi.Lane.Classification(
            type=kind.INTERSECTION if lane.junction else kind.DRIVING, centerline=[vector(*point) for point in lane.centerline],
            centerline_is_driving_direction=True, lane_pairing=pairs))

    def numbered(self, ids):
        return [osi.Identifier(value=self.lanes[id]) for id in ids if id in self.lanes]

    def points(self, step, own, when):
        """The update as a trajectory of the rear axle."""
        ego = step.ego
        points = [avastra.TrajectoryPoint(step.t_us, ego.x, ego.y, ego.heading, v=ego.speed)]
        for at in own.future_trajectory:
            self.add(points, micros(at.timestamp), at.position, at.orientation.yaw)
        if points[-1].t_us < step.t_us + 1e6 * REACH:
            base = own.base
            del points[1:]
            heading = base.orientation.yaw
            accel = base.acceleration.x * math.cos(heading) + base.acceleration.y * math.sin(heading) if base.acceleration else 0.0
            self.add(points, max(micros(when), step.t_us + 20_000), base.position, heading)
            # The update says how fast it is there; the way there may begin at rest.
            speed, last = math.hypot(base.velocity.x, base.velocity.y), points[-1]
            first = points[-1] = avastra.TrajectoryPoint(last.t_us, last.x, last.y, heading, v=speed)
            for index in range(1, 16):
                after = 0.1 * index
                lasts = min(after, speed / -accel) if accel < 0.0 else after
                way = speed * lasts + accel * lasts**2 / 2.0
                points.append(avastra.TrajectoryPoint(first.t_us + round(1e6 * after), first.x + way * math.cos(heading),
                                                      first.y + way * math.sin(heading), heading, v=max(speed + accel * lasts, 0.0)))
        return points

    def add(self, points, t_us, position, heading):
        last = points[-1]
        if t_us <= last.t_us:
            return
        to_centre = self.vehicle.rear_axle_to_front - self.vehicle.length / 2.0
        x, y = position.x - to_centre * math.cos(heading), position.y - to_centre * math.sin(heading)
        speed = math.dist((x, y), (last.x, last.y)) / (t_us - last.t_us) * 1e6
        points.append(avastra.TrajectoryPoint(t_us, x, y, heading, v=speed))

    def close(self):
        self.socket.close()
        if self.child is not None:
            self.child.wait(timeout=3.0)


def moving(other):
    base = osi.BaseMoving(
        dimension=osi.Dimension3d(length=other.length, width=other.width, height=other.height),
        position=vector(other.x, other.y, other.height / 2.0), orientation=osi.Orientation3d(yaw=other.heading), velocity=vector(other.vx, other.vy))
    types = osi.MovingObject.Type
    others = {"pedestrian": types.PEDESTRIAN, "animal": types.ANIMAL, "object": types.OTHER}
    if other.kind in others:
        return osi.MovingObject(id=osi.Identifier(value=OBJECTS + other.id), base=base, type=others[other.kind])
    vehicle = osi.MovingObject.VehicleClassification
    kind = getattr(vehicle.Type, VEHICLES.get(other.kind, "UNKNOWN"))
    return osi.MovingObject(id=osi.Identifier(value=OBJECTS + other.id), base=base, type=types.VEHICLE, vehicle_classification=vehicle(type=kind))


def vector(x, y, z=0.0):
    return osi.Vector3d(x=x, y=y, z=z)


def stamp(t_us):
    return osi.Timestamp(seconds=t_us // 1_000_000, nanos=t_us % 1_000_000 * 1000)


def micros(timestamp):
    return timestamp.seconds * 1_000_000 + timestamp.nanos // 1000


def send(connection, message):
    connection.sendall(struct.pack("<I", len(message)) + message)


def receive(connection):
    (length,) = struct.unpack("<I", exactly(connection, 4))
    return exactly(connection, length)


def exactly(connection, count):
    data = bytearray()
    while len(data) < count:
        chunk = connection.recv(count - len(data))
        if not chunk:
            raise ConnectionError("the OSI participant closed the connection")
        data += chunk
    return bytes(data)


if __name__ == "__main__":
    avastra.serve(lambda: Participant(sys.argv[1] if len(sys.argv) > 1 else ""))
