"""Tables of `avastra export --to csv` as ASAM OSI recordings: `python record.py corner_0004.csv …` writes `corner_0004.mcap` beside each.

Each tick is a `GroundTruth` on the topic `ground_truth`, with every road user's place, heading, velocity and size; the file has the metadata
`net.asam.osi.trace`, so viewers (Lichtblick, Foxglove) and validators open it. `betterosi` writes the messages and the container. The host vehicle
is object 1; a road user that claims call `npc#N` is object 1000 + N. Lights, lanes and weather are not in the table and so not in the recording.
"""

import csv
import itertools
import math
import pathlib
import sys

import betterosi as osi

HOST, OBJECTS = 1, 1_000
Kind = osi.MovingObject.VehicleClassification.Type
#: Bodies of avastra that are no car.
VEHICLES = {"BoxTruck": Kind.HEAVY_TRUCK, "SchoolBus": Kind.BUS, "Motorcycle": Kind.MOTORBIKE, "Bicycle": Kind.BICYCLE}


def main(tables):
    for table in map(pathlib.Path, tables):
        target = table.with_suffix(".mcap")
        with open(table, newline="") as file, osi.Writer(target) as writer:
            rows = csv.DictReader(file)
            for time, moment in itertools.groupby(rows, key=lambda row: row["time_s"]):
                writer.add(ground_truth(float(time), moment))
        print(target)


def ground_truth(time_s, rows):
    nanos = round(time_s * 1e9)
    major, minor, patch = map(int, osi.DEFAULT_VERSION.split("."))
    return osi.GroundTruth(
        version=osi.InterfaceVersion(version_major=major, version_minor=minor, version_patch=patch),
        timestamp=osi.Timestamp(seconds=nanos // 10**9, nanos=nanos % 10**9),
        host_vehicle_id=osi.Identifier(value=HOST),
        moving_object=[moving_object(row) for row in rows],
    )


def moving_object(row):
    user, heading = int(row["id"]), float(row["heading_rad"])
    number = lambda name: float(row[name])
    base = osi.BaseMoving(
        dimension=osi.Dimension3d(length=number("length_m"), width=number("width_m"), height=number("height_m")),
        position=osi.Vector3d(x=number("x_m"), y=number("y_m"), z=number("height_m") / 2),
        orientation=osi.Orientation3d(roll=0.0, pitch=0.0, yaw=math.remainder(heading, math.tau)),
        velocity=osi.Vector3d(x=number("vx_mps"), y=number("vy_mps"), z=0.0),
    )
    identifier = osi.Identifier(value=HOST if user == 0 else OBJECTS + user)
    # A body of the author's own has a name that only the author knows.
    body = row.get("like") or row["body"]
    types = osi.MovingObject.Type
    others = {"Pedestrian": types.PEDESTRIAN, "Animal": types.ANIMAL, "Object": types.OTHER}
    if body in others:
        return osi.MovingObject(id=identifier, base=base, type=others[body])
    kind = osi.MovingObject.VehicleClassification(type=VEHICLES.get(body, Kind.CAR))
    return osi.MovingObject(id=identifier, base=base, type=osi.MovingObject.Type.VEHICLE, vehicle_classification=kind)


if __name__ == "__main__":
    main(sys.argv[1:])
