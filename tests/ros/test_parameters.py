"""A core's parameters as ROS parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum

import pytest

from tulip_ros import parameters
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, session
from tulip_strategy.game_input import GameInputParameters
from tulip_strategy.user_input import UserInputParameters


class Foot(Enum):
    LEFT = 0
    RIGHT = 1


@dataclass(frozen=True)
class GaitParameters:
    step_time: float = 0.5


@dataclass(frozen=True)
class WalkParameters:
    gain: float = 1.0
    steps: int = 3
    name: str = "walk"
    enabled: bool = True
    weights: tuple[float, ...] = (1.0, 2.0)
    rows: tuple[tuple[float, float], ...] = ((1.0, 2.0), (3.0, 4.0))
    foot: Foot = Foot.LEFT
    words: tuple[str, ...] = ()
    limit: float | None = None
    gait: GaitParameters = field(default_factory=GaitParameters)

    def __post_init__(self) -> None:
        if self.gain <= 0:
            raise ValueError(f"gain is {self.gain}; expected > 0")


def test_values_are_replaced_by_dotted_name_and_brought_to_the_fields_type():
    result = parameters.replace(
        WalkParameters(),
        {
            "gain": 2,
            "gait.step_time": 0.25,
            "rows": [5, 6],
            "weights": [1, 0],
            "foot": "right",
            "words": ["a"],
            "limit": 3.0,
        },
        "walk",
    )
    assert result == WalkParameters(
        gain=2.0,
        gait=GaitParameters(0.25),
        rows=((5.0, 6.0),),
        weights=(1.0, 0.0),
        foot=Foot.RIGHT,
        words=("a",),
        limit=3.0,
    )
    assert isinstance(result.gain, float) and isinstance(result.weights[0], float)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gian", 1.0, "Did you mean gain"),
        ("gain", "much", "walk.gain is 'much'; expected a number"),
        ("gain", True, "expected a number"),
        ("steps", 1.5, "expected an integer"),
        ("name", 3, "expected text"),
        ("enabled", 1, "expected true or false"),
        ("weights", 1.0, "expected a list of numbers"),
        ("rows", [1.0, 2.0, 3.0], "2 a row"),
        ("foot", "middle", "one of left, right"),
        ("gain", -1.0, "gain is -1.0; expected > 0"),
        ("gait", 1.0, "no parameter"),
    ],
)
def test_unfit_values_are_refused_by_name(name: str, value: object, message: str):
    with pytest.raises(BadInputError, match=message):
        parameters.replace(WalkParameters(), {name: value}, "walk")


@pytest.mark.ros
def test_node_declares_every_field_and_takes_values_from_the_command_line(ros_domain: int):
    arguments = ["test", "--ros-args", "-p", "gain:=3", "-p", "gait.step_time:=0.75"]
    with session(lambda: ComponentNode("walk"), arguments=arguments) as (node, _):
        result = node.load(WalkParameters())
        assert result == WalkParameters(gain=3.0, gait=GaitParameters(0.75))
        assert node.get_parameter("gain").value == 3.0
        assert list(node.get_parameter("rows").value) == [1.0, 2.0, 3.0, 4.0]
        assert set(parameters.flatten(WalkParameters())) <= set(node._parameters)


@pytest.mark.ros
def test_malformed_arguments_are_bad_input(ros_domain: int, tmp_path):
    file = tmp_path / "bad.yaml"
    file.write_text("walk: [1\n")
    arguments = ["test", "--ros-args", "--params-file", str(file)]
    with pytest.raises(BadInputError, match=r"bad\.yaml"), session(lambda: ComponentNode("walk"), arguments=arguments):
        pass


@pytest.mark.parametrize("value", [math.nan, [0.1, math.nan, 0.1]])
def test_nan_is_no_number(value: object):
    name = "stale_after" if isinstance(value, float) else "walk_test_limits"
    defaults = GameInputParameters() if isinstance(value, float) else UserInputParameters()
    with pytest.raises(BadInputError, match="expected a"):
        parameters.replace(defaults, {name: value}, "node")
