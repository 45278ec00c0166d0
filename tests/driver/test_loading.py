"""Anybody's body by its name: found, or refused with words that help."""

from __future__ import annotations

from pathlib import Path

import pytest
from bodies import ROBOT

from tulip_driver.contract import BodyError
from tulip_driver.loading import make_body, read_options

MODULE = """
from tulip_driver.echo import EchoBody
NUMBER = 3
class Mine(EchoBody):
    def __init__(self, robot, port=1):
        super().__init__(robot)
        if port < 0:
            raise ValueError("port is negative")
        self.port = port
class Plain:
    def __init__(self, robot): pass
    def start(self): pass
    def exchange(self, command): pass
    def stop(self): pass
class Lame:
    def start(self): pass
    def stop(self): pass
"""


@pytest.fixture(autouse=True)
def _modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "somebodys_robot.py").write_text(MODULE)
    (tmp_path / "broken_robot.py").write_text("import a_library_that_nobody_has")
    monkeypatch.syspath_prepend(tmp_path)


def test_a_class_is_made_with_the_robot_and_the_users_options() -> None:
    body = make_body("somebodys_robot:Mine", ROBOT, read_options(["port=4747"]))
    assert body.port == 4747  # type: ignore[attr-defined]


def test_a_class_with_the_three_methods_need_not_inherit() -> None:
    make_body("somebodys_robot:Plain", ROBOT, {})


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("somebodys_robot", [], "expected package.module:Class"),
        ("nobodys_robot:Mine", [], "there is no module 'nobodys_robot'.*PYTHONPATH"),
        ("nobodys.robot:Mine", [], "there is no module 'nobodys'"),
        ("broken_robot:Mine", [], "cannot be imported: No module named 'a_library_that_nobody_has'"),
        ("somebodys_robot:Yours", [], "no class 'Yours'. Bodies in it: EchoBody, Mine, Plain"),
        ("somebodys_robot:NUMBER", [], "no class 'NUMBER'"),
        ("somebodys_robot:Lame", [], "class Lame lacks exchange"),
        ("somebodys_robot:Mine", ["baud=9600"], "'baud'.*takes: port"),
        ("somebodys_robot:Mine", ["port=-1"], "port is negative"),
        ("somebodys_robot:Mine", ["port"], "expected name=value"),
        ("tulip_driver.contract:Body", [], "class Body lacks exchange, start, stop"),
    ],
)
def test_what_cannot_be_used_is_refused_with_what_to_do(name: str, options: list[str], words: str) -> None:
    with pytest.raises(BodyError, match=words):
        make_body(name, ROBOT, read_options(options))
