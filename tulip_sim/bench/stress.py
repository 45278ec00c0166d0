"""Half an hour of random commands: walks, stops, footstep goals, kicks, pushes; nothing may fall, and nothing grow."""

from __future__ import annotations

import math
import resource

import numpy as np

from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_motion.interface import KickGoal, KickKind, MotionMode, Side, WalkCommand, WalkMode
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.timing import TICK

DURATION = 1800.0  # [s]
WINDOW = 300.0  # [s] figures of the first and the last window are compared
SEEDS = 2
START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and ball
PUSH = 6.0  # [N s] at most: well inside the map of bench push
COMMAND = WalkCommand(0, WalkMode.STAND)


class Stress:
    """One run."""

    def __init__(self, seed: int) -> None:
        self.body = Body(seed, START)
        self.rng = np.random.default_rng([seed, 7])
        self.time = 0.0
        self.errors = np.zeros((round(DURATION / WINDOW) + 1, 2))  # [rad^2] sum over the ticks, and their number
        self.counts = dict.fromkeys(("walk", "stand", "go", "kick", "push"), 0)
        self.body.go(0.5)
        self._desired = self.body.motion.state().joint_positions_desired

    def run(self, command: WalkCommand, seconds: float) -> None:
        """Hold a command for a time [s], or until the robot falls."""
        for _ in range(round(seconds * 1000 / TICK)):
            if self.body.fallen:
                return
            self.body.tick(command)
            state = self.body.motion.state()
            # The angles desired at the last tick are those in force now.
            error = float(np.mean((self._desired - state.joint_positions) ** 2))
            self.errors[int(self.time / WINDOW)] += (error, 1.0)
            self._desired = state.joint_positions_desired
            self.time += TICK / 1000.0

    def act(self) -> None:
        """Do something at random."""
        rng = self.rng
        kind = str(rng.choice(list(self.counts), p=(0.5, 0.12, 0.13, 0.1, 0.15)))
        self.counts[kind] += 1
        if kind == "walk":
            forward, left, turn = rng.uniform((-0.35, -0.25, -1.2), (0.6, 0.25, 1.2)).tolist()
            self.run(WalkCommand(0, WalkMode.WALK, (forward, left, turn)), float(rng.uniform(0.5, 4.0)))
        elif kind == "stand":
            self.run(COMMAND, float(rng.uniform(0.5, 3.0)))
        elif kind == "go":
            odometry = self.body.motion.odometry()
            here = pose_on_ground(odometry.position, odometry.orientation)
            goal = here @ Pose2D(*rng.uniform((-0.5, -0.5, -1.5), (1.0, 0.5, 1.5)).tolist())
            self.run(WalkCommand(0, WalkMode.GO, goal=goal), 6.0)
        elif kind == "kick":
            for _ in range(20):  # until the steps have ended
                self.run(COMMAND, 0.25)
                if self.body.motion.mode is MotionMode.STAND:
                    break
            kick = KickKind.SIDE if rng.random() < 0.3 else KickKind.FORWARD
            side = Side(int(rng.integers(2)))
            direction = 0.0 if kick is KickKind.FORWARD else (math.pi / 2 if side is Side.LEFT else -math.pi / 2)
            self.body.motion.start_kick(KickGoal(side, direction, float(rng.uniform(0.8, 2.0)), kick))
            self.run(COMMAND, 4.0)
        else:
            angle, force = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.0, PUSH) * 10.0
            self.body.world.push([force * math.cos(angle), force * math.sin(angle), 0.0], 100)
            self.run(WalkCommand(0, WalkMode.WALK, (0.2, 0.0, 0.0)), 2.0)


def memory() -> float:
    """Return the most memory that this process has held so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def measure(seed: int) -> Row:
    """Run for half an hour of simulated time, or until the robot falls."""
    stress = Stress(seed)
    early_memory = 0.0
    while stress.time < DURATION and not stress.body.fallen:
        stress.act()
        if early_memory == 0.0 and stress.time > WINDOW:
            early_memory = memory()
    truth, odometry = stress.body.world.truth(), stress.body.motion.odometry()
    x, y = START.transform((float(odometry.position[0]), float(odometry.position[1])))
    off = math.hypot(x - float(truth.base_position[0]), y - float(truth.base_position[1]))
    windows = stress.errors[stress.errors[:, 1] > 0.5 * WINDOW * 1000 / TICK]
    first, last = (1000.0 * math.sqrt(square / count) for square, count in (windows[0], windows[-1]))
    return {
        "seed": seed,
        "upright": not stress.body.fallen,
        "time [s]": round(stress.time, 1),
        **{f"{kind} commands": count for kind, count in stress.counts.items()},
        "way [m]": round(odometry.distance, 1),
        "joint error, first 300 s [mrad]": round(first, 2),
        "joint error, last 300 s [mrad]": round(last, 2),
        "memory at 300 s [MB]": round(early_memory, 1),
        "memory at the end [MB]": round(memory(), 1),
        "odometry error at the end [m]": round(off, 2),
        "greatest tilt [rad]": round(stress.body.greatest_tilt, 3),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return one line a run."""
    lines = [
        f"Random walks, turns, stops, footstep goals, kicks and pushes up to {PUSH:.0f} N s for"
        f" {DURATION / 60.0:.0f} simulated minutes.",
        "",
        "| seed | upright | time | commands | way | joint error: first, last 5 min | memory: at 5 min, end"
        " | odometry off | tilt, most |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        commands = sum(value for key, value in row.items() if key.endswith(" commands"))
        lines.append(
            f"| {row['seed']} | {'yes' if row['upright'] else 'no'} | {row['time [s]'] / 60.0:.1f} min | {commands}"
            f" | {row['way [m]']:.0f} m | {row['joint error, first 300 s [mrad]']},"
            f" {row['joint error, last 300 s [mrad]']} mrad | {row['memory at 300 s [MB]']:.0f},"
            f" {row['memory at the end [MB]']:.0f} MB | {row['odometry error at the end [m]']} m"
            f" | {row['greatest tilt [rad]']} rad |"
        )
    return lines


BENCH = Bench("stress", "Half an hour of random commands", [(seed,) for seed in range(SEEDS)], measure, summarize)
