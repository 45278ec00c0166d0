"""The generated interfaces: they load, survive serialization, and mirror the cores' types."""

from __future__ import annotations

import dataclasses
import importlib
import re
from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message

import tulip_msgs
from tulip_description.robot_io import JointCommand
from tulip_motion.interface import HeadMode, MotionMode, MotionState, Side, Support, WalkMode
from tulip_msgs import msg
from tulip_msgs.action import Kick
from tulip_ros import schemas
from tulip_ros.time import from_message, header, stamp_of, to_message
from tulip_strategy.interface import GamePhase, GameState, Penalty, SecondaryState, SetPlay, UserRequest
from tulip_vision.features import Feature, FeatureClass

INTERFACES = Path(__file__).parents[2] / "tulip_msgs"


def declared(kind: str) -> list[str]:
    return sorted(path.stem for path in (INTERFACES / kind).iterdir())


def test_the_generated_package_wins_over_the_folder_of_definitions():
    assert tulip_msgs.__file__ is not None
    assert Path(tulip_msgs.__file__).parent != INTERFACES


@pytest.mark.parametrize("kind", ["msg", "srv", "action"])
def test_every_definition_is_generated(kind: str):
    module = importlib.import_module(f"tulip_msgs.{kind}")
    assert [name for name in declared(kind) if not hasattr(module, name)] == []


@pytest.mark.parametrize("name", declared("msg"))
def test_messages_survive_serialization(name: str):
    message_class = getattr(msg, name)
    message = message_class()
    for count, (field, kind) in enumerate(message_class.get_fields_and_field_types().items(), start=1):
        array = re.fullmatch(r"double\[(\d+)\]", kind)
        if array:
            setattr(message, field, np.arange(int(array[1])) + 0.5)
        elif kind == "double":
            setattr(message, field, count + 0.25)
        elif kind == "string":
            setattr(message, field, f"text {count}")
        elif kind.startswith("uint"):
            setattr(message, field, count)
        elif kind == "sequence<double>":
            setattr(message, field, [0.5, -1.5])
    again = deserialize_message(serialize_message(message), message_class)
    assert again == message
    for field, kind in message_class.get_fields_and_field_types().items():
        if kind.startswith("double"):
            np.testing.assert_array_equal(getattr(again, field), getattr(message, field))


@pytest.mark.parametrize(
    ("values", "message", "prefix"),
    [
        (WalkMode, msg.WalkCommand, ""),
        (HeadMode, msg.HeadCommand, ""),
        (MotionMode, msg.MotionState, ""),
        (Support, msg.MotionState, "SUPPORT_"),
        (GamePhase, msg.GameState, ""),
        (SecondaryState, msg.GameState, "SECONDARY_"),
        (SetPlay, msg.GameState, "SET_PLAY_"),
        (Penalty, msg.GameState, "PENALTY_"),
        (UserRequest, msg.UserCommand, ""),
        (FeatureClass, msg.Feature, ""),
        (Side, Kick.Goal, ""),
    ],
)
def test_constants_equal_those_of_the_cores(values: type, message: type, prefix: str):
    assert {each.name: int(each) for each in values} == {
        each.name: getattr(message, prefix + each.name) for each in values
    }


@pytest.mark.parametrize(
    ("domain", "message"),
    [
        (JointCommand, msg.JointCommand),
        (Feature, msg.Feature),
        (GameState, msg.GameState),
        (MotionState, msg.MotionState),
    ],
)
def test_messages_carry_every_field_of_the_cores_types(domain: type, message: type):
    fields = {field.name for field in dataclasses.fields(domain)} - {"stamp", "soles"}
    assert fields <= set(message.get_fields_and_field_types())


def test_every_number_has_a_comment():
    for path in INTERFACES.glob("*/*.*"):
        for line in path.read_text().splitlines():
            words = line.split()
            if words and re.match(r"float64", words[0]):
                assert "#" in line, f"{path.name}: {line}"


def test_definition_holds_the_types_of_all_fields():
    text = schemas.definition("tulip_msgs/msg/WorldState")
    parts = re.findall(r"^MSG: (.*)$", text, re.MULTILINE)
    assert sorted(parts) == ["builtin_interfaces/Time", "std_msgs/Header", "tulip_msgs/ObjectEstimate"]


def test_unknown_type_is_named():
    with pytest.raises(LookupError, match="nowhere_msgs/msg/Thing is not installed"):
        schemas.message_class("nowhere_msgs/msg/Thing")


@pytest.mark.parametrize("stamp", [0, 1, 999_999_999, 1_000_000_000, 1_795_308_275_873_544_321])
def test_stamps_survive_messages(stamp: int):
    assert from_message(to_message(stamp)) == stamp
    assert stamp_of(msg.WalkCommand(header=header(stamp, "map"))) == stamp


def test_negative_stamp_is_refused():
    with pytest.raises(ValueError, match="stamp is -1 ns"):
        to_message(-1)
