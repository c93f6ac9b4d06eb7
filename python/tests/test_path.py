"""Paths and ways."""

import math
import unittest

import avastra
from avastra import messages
from stand_in import INIT, World, line


class Paths(unittest.TestCase):
    def test_a_pose_is_projected_to_where_it_comes_from(self):
        path = line(bend=True)
        for index in range(0, 1950):
            station, offset = index * 0.1 + 0.05, (index % 7 - 3) * 0.8
            pose = path.at(station, offset)
            beside = path.project(pose.x, pose.y)
            self.assertAlmostEqual(beside.station, station, delta=0.35 if 79 < station < 100 else 1e-6)
            self.assertAlmostEqual(beside.offset, offset, delta=0.05 if 79 < station < 100 else 1e-6)

    def test_beyond_its_ends_a_path_goes_on_straight(self):
        path = avastra.Path([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)])
        self.assertEqual(path.project(-3.0, 1.0), avastra.Beside(-3.0, 1.0, 0.0))
        self.assertAlmostEqual(path.at(25.0).y, 15.0)
        self.assertAlmostEqual(path.project(9.0, 14.0).station, 24.0)
        self.assertAlmostEqual(path.project(9.0, 14.0).offset, 1.0)

    def test_the_outside_of_a_corner_belongs_to_the_corner(self):
        beside = avastra.Path([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]).project(13.0, -4.0)
        self.assertAlmostEqual(beside.station, 10.0)
        self.assertAlmostEqual(beside.offset, -5.0)

    def test_a_smoothed_path_turns_less_abruptly_and_stays_near(self):
        path = line(bend=True)
        smooth = path.smoothed(2)
        def steepest(on):
            turns = [on.curvature(station, 0.5) for station in range(2, 180)]
            return max(abs(after - before) for before, after in zip(turns, turns[1:]))
        self.assertLess(steepest(smooth), 0.45 * steepest(path))
        self.assertLess(max(abs(path.project(*point).offset) for point in smooth.xy), 0.2)
        self.assertEqual((smooth.xy[0], smooth.xy[-1]), (path.xy[0], path.xy[-1]))

    def test_a_seam_of_millimetres_has_no_heading_of_its_own(self):
        seam = avastra.Path([(0.0, 0.0), (2.0, 0.0), (1.9999, -0.0005), (4.0, 0.0)])
        self.assertAlmostEqual(seam.at(2.0).heading, 0.0)
        self.assertEqual(seam.length, 4.0)
        for gap in (1e-7, 1e-4, 2e-3, 9e-3):
            for side in range(8):
                angle = side * math.pi / 4.0
                begin = (10.0 + gap * math.cos(angle), gap * math.sin(angle))
                path = avastra.Path([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), begin, (15.0, 0.0), (20.0, 0.0)])
                for tenth in range(0, 201):
                    pose = path.at(tenth / 10.0)
                    self.assertAlmostEqual(pose.heading, 0.0, delta=0.003)
                    self.assertAlmostEqual(pose.y, 0.0, delta=0.01)

    def test_a_path_ends_where_its_last_point_is(self):
        self.assertEqual(avastra.Path([(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (10.004, 0.0)]).xy[-1], (10.004, 0.0))
        self.assertEqual(avastra.Path([(0.0, 0.0), (0.004, 0.0)]).length, 0.004)

    def test_a_path_needs_two_points(self):
        with self.assertRaisesRegex(ValueError, "two different points, and has 1"):
            avastra.Path([(1.0, 1.0), (1.0, 1.0)])

    def test_angles_are_wrapped(self):
        for turns in range(-3, 4):
            self.assertAlmostEqual(avastra.wrap(1.0 + turns * 2.0 * math.pi), 1.0)
        self.assertEqual(avastra.wrap(-math.pi), math.pi)


def way(road):
    world = World(road)
    vehicle = messages.read(messages.Init, INIT, "init").vehicle
    reset = messages.read(messages.Reset, world.reset(), "reset")
    return world, avastra.Way(vehicle, messages.read(messages.Map, world.map, "map"), reset)


def step(world):
    return messages.read(messages.Step, world.step(0), "step")


class Ways(unittest.TestCase):
    def test_a_bend_is_slow_and_braked_for_in_time(self):
        _, on = way("bend")
        self.assertAlmostEqual(on.speed(85.0), math.sqrt(2.0 * 12.0), delta=0.3)
        self.assertEqual(on.speed(5.0), 13.9)
        for station in (40.0, 56.0, 70.0):
            braked = math.sqrt(on.speed(74.0) ** 2 + 2.0 * 1.5 * (74.0 - station))
            self.assertAlmostEqual(on.speed(station), min(braked, 13.9), delta=0.01)

    def test_the_room_reaches_over_lanes_of_the_own_direction(self):
        self.assertEqual([round(side, 3) for side in way("straight")[1].room(20.0)], [1.75, 1.75])
        self.assertEqual([round(side, 3) for side in way("beside")[1].room(20.0)], [5.25, 1.75])

    def test_a_light_holds_while_it_can_be_stopped_for(self):
        world, on = way("light")
        world.x, world.speed = 90.0, 13.0
        self.assertIsNone(on.stop(step(world)), "too late")
        world.speed = 5.0
        self.assertEqual(on.stop(step(world)), 95.0)
        world.speed = 13.0
        self.assertEqual(on.stop(step(world)), 95.0, "who brakes late goes on braking")
        world.time_us = 26_000_000
        self.assertIsNone(on.stop(step(world)), "green")

    def test_a_line_that_holds_is_braked_for_evenly(self):
        world, on = way("light")
        world.x, world.speed = 70.0, 5.0
        left = 95.0 - 1.5 - 65.0 - 3.705 - 5.0
        self.assertAlmostEqual(on.wanted_speed(step(world)), math.sqrt(2.0 * 1.5 * left), places=6)
        world.time_us = 26_000_000
        self.assertEqual(on.wanted_speed(step(world)), 13.9)

    def test_braking_ends_where_the_brakes_end_it(self):
        world, on = way("straight")
        world.speed = 12.0
        points = on.braking(step(world))
        self.assertEqual((points[0].t_us, points[-1].t_us, points[-1].v), (0, 3_000_000, 0.0))
        self.assertAlmostEqual(points[-1].x - points[0].x, 12.0**2 / (2.0 * 6.0), places=6)
        for tenth in range(1, 200):
            world.speed = tenth * 0.07
            self.assertGreaterEqual(min(point.v for point in on.braking(step(world))), 0.0)

    def test_at_a_stop_sign_one_stops_once(self):
        world = World("straight")
        message = world.reset()
        message["route"]["signs"] = [{"route_s": 10.0, "kind": "yield"}, {"route_s": 40.0, "kind": "stop"}]
        vehicle = messages.read(messages.Init, INIT, "init").vehicle
        on = avastra.Way(vehicle, messages.read(messages.Map, world.map, "map"), messages.read(messages.Reset, message, "reset"))
        self.assertEqual(on.stop(step(world)), 40.0)
        world.x, world.speed = 40.0, 0.0
        self.assertIsNone(on.stop(step(world)), "it stands there")
        world.speed = 3.0
        self.assertIsNone(on.stop(step(world)), "it has stood there")
