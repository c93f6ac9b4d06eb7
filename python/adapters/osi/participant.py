"""A small OSI traffic participant, to try the adapter with: `participant.py PORT` listens there (0: any, which it prints).

It reads `SensorView`s, keeps to the route (`reference_line` of the first one) at 8 m/s, brakes for what is within 2 m of it ahead, and answers with a
`TrafficUpdate` whose `future_trajectory` reaches 3 s. It knows no lights.
"""

import math
import socket
import sys

import betterosi as osi
from driver import micros, receive, send, stamp

CRUISE, ACCEL, DECEL = 8.0, 1.5, 4.0


def main(port):
    server = socket.create_server(("127.0.0.1", port))
    print(server.getsockname()[1], flush=True)
    connection, _ = server.accept()
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    route = []
    while True:
        try:
            view = osi.SensorView.from_binary(receive(connection))
        except ConnectionError:
            return
        truth = view.global_ground_truth
        if truth.reference_line:
            route = [(point.world_position.x, point.world_position.y) for point in truth.reference_line[0].poly_line]
        send(connection, update(view, truth, route).to_binary())


def update(view, truth, route):
    host = next(moving for moving in truth.moving_object if moving.id.value == view.host_vehicle_id.value)
    others = [moving for moving in truth.moving_object if moving is not host]
    here, speed = host.base.position, math.hypot(host.base.velocity.x, host.base.velocity.y)
    at = min(range(len(route)), key=lambda index: math.dist(route[index], (here.x, here.y)))
    ahead = route[at + 2:at + 12 + round(speed**2 / DECEL)]
    blocked = any(math.dist(point, (other.base.position.x, other.base.position.y)) < 2.0 for point in ahead for other in others)
    accel = -DECEL if blocked else max(-2.0, min(ACCEL, CRUISE - speed))
    # The route has a point each metre, so its indices are stations.
    now, trajectory, way = micros(view.timestamp), [], 0.0
    for index in range(31):
        x, y, heading = place(route, at + way)
        trajectory.append(osi.StatePoint(timestamp=stamp(now + 100_000 * index), position=osi.Vector3d(x=x, y=y, z=here.z), orientation=osi.Orientation3d(yaw=heading)))
        way += speed * 0.1
        speed = min(max(speed + accel * 0.1, 0.0), CRUISE)
    own = osi.MovingObject(id=host.id, base=host.base, future_trajectory=trajectory)
    return osi.TrafficUpdate(timestamp=stamp(now + 100_000), update=[own])


def place(route, station):
    """A point of the route, and its direction, `station` points along."""
    index = min(max(int(station), 0), len(route) - 2)
    (ax, ay), (bx, by) = route[index], route[index + 1]
    fraction = station - index
    return ax + (bx - ax) * fraction, ay + (by - ay) * fraction, math.atan2(by - ay, bx - ax)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 0)
