"""The layout for Foxglove names topics, fields and services that there are."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

import tulip_view.bridge
from tulip_ros import topics
from tulip_ros.schemas import message_class

LAYOUT = json.loads(Path(tulip_view.bridge.__file__).with_name("tulip.foxglove.json").read_text())
PANELS: dict[str, dict[str, Any]] = LAYOUT["configById"]
TOPICS = {f"/{topic.name}": topic for topic in topics.TOPICS}
SERVICES = {f"/{service.name}": service for service in topics.SERVICES}


def of_kind(kind: str) -> list[dict[str, Any]]:
    return [panel for name, panel in PANELS.items() if name.startswith(f"{kind}!")]


def resolve(path: str) -> str:
    """Return the type of a field as in /motion_state.com[1]; a KeyError tells which part does not exist."""
    topic, *fields = path.split(".")
    kind = TOPICS[topic].type_name
    for field in fields:
        name, index = re.fullmatch(r"(\w+)(?:\[(\d+)\])?", field).groups()  # type: ignore[union-attr]
        owner = kind if "/msg/" in kind else kind.replace("/", "/msg/")
        kind = message_class(owner).get_fields_and_field_types()[name]
        if index is not None:
            kind, length = re.fullmatch(r"(\w+)\[(\d+)\]", kind).groups()  # type: ignore[union-attr]
            assert int(index) < int(length), path
    return kind


@pytest.mark.parametrize(
    "path",
    [each["value"] for kind in ("Plot", "StateTransitions") for panel in of_kind(kind) for each in panel["paths"]],
)
def test_curve_shows_a_number_or_a_word_that_there_is(path: str):
    assert resolve(path) in ("double", "float", "string", "uint8", "uint16", "uint32"), path


def test_other_panels_show_topics_that_there_are():
    [robot], [camera] = of_kind("3D"), of_kind("Image")
    shown = [*robot["topics"], camera["imageMode"]["imageTopic"]]
    shown += [panel["topicToRender"] for panel in of_kind("DiagnosticSummary")]
    shown += [panel["topicPath"] for panel in of_kind("RawMessages")]
    assert set(shown) <= TOPICS.keys()
    assert camera["cameraTopic"] == camera["imageMode"]["imageTopic"]  # the names of older and newer viewers


def test_buttons_call_services_with_the_fields_that_they_have():
    panels = of_kind("CallService")
    wanted = {name for name, service in SERVICES.items() if service.server in ("user_input", "recorder", "driver")}
    assert {panel["serviceName"] for panel in panels} == wanted
    for panel in panels:
        request = SERVICES[panel["serviceName"]].type.Request
        assert json.loads(panel["requestPayload"]).keys() == request.get_fields_and_field_types().keys()


def test_buttons_publish_only_what_a_person_may():
    for panel in of_kind("Publish"):
        [topic] = [each for each in topics.FROM_PEOPLE if f"/{each.name}" == panel["topicName"]]
        assert panel["datatype"] == topic.type_name
        assert json.loads(panel["value"]).keys() == topic.message.get_fields_and_field_types().keys()
    [robot] = of_kind("3D")
    assert robot["publish"]["poseEstimateTopic"] in {f"/{topic.name}" for topic in topics.FROM_PEOPLE}


def test_every_panel_has_its_place():
    def placed(tree: Any) -> list[str]:
        if isinstance(tree, str):
            return [tree, *(name for tab in PANELS[tree].get("tabs", ()) for name in placed(tab["layout"]))]
        return placed(tree["first"]) + placed(tree["second"])

    assert sorted(placed(LAYOUT["layout"])) == sorted(PANELS)
