"""Messages about the design of a page, and the server that answers them on this machine."""

from __future__ import annotations

import http.client
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from draft.browser.designer import Designer, source
from draft.browser.page import page
from draft.design.references import open_design
from draft.errors import DraftError
from draft.laws.actuators import FILE
from draft.learn.policy.walk import plane_xml
from draft.serving.messages import MOST, MessageServer
from tests.model import own_parts

pytest.importorskip("mjswan", reason="needs the extra page")

Open = Callable[..., Any]


def message(reference: str = "cheetah", **more: Any) -> str:
    own = source(open_design(reference))
    asked = {name: own[name] for name in ("files", "binary", "values")}
    return json.dumps({"id": 3, "title": "t", "color": "#000"} | asked | more)


def answer(text: str) -> dict[str, Any]:
    return json.loads(Designer("walk").answer(text))


def test_a_message_is_answered_by_the_robot_with_its_verdict_and_its_text() -> None:
    values = {"thigh_length": 0.3}
    found = answer(message("quadruped", values=values))
    design = open_design("quadruped").spec.resolve(values)
    assert found["id"] == 3
    assert found["robot"]["xml"] == plane_xml(design.build())
    assert found["robot"]["said"]["accepted"]
    assert next(one for one in found["fields"] if one["name"] == "thigh_length")["text"] == "0.3"
    known = message("quadruped", values=values, known=[found["robot"]["network"]])
    assert "network" in found
    assert "network" not in answer(known)


def test_a_refused_design_is_a_robot_with_its_findings() -> None:
    found = answer(message(values={"actuators.leg.peak_torque": 1}))["robot"]["said"]
    assert not found["accepted"]
    assert ["error", "cannot_stand"] in [one[:2] for one in found["findings"]]


def test_fields_are_all_parameters_and_what_actuators_state() -> None:
    design = open_design("quadruped")
    found = {one["name"]: one["text"] for one in answer(message("quadruped"))["fields"]}
    assert {*design.spec.parameters} < {*found}
    assert found["shank_radius"] == "0.8 * thigh_radius"
    for quantity in design.spec.actuators["leg"].stated:
        assert f"actuators.leg.{quantity}" in found


@pytest.mark.parametrize(
    ("asked", "cause"),
    [
        ("", "the page sent a message that cannot be read: it: Invalid JSON"),
        ("[]", "the page sent a message that cannot be read"),
        (message(values=[1]), "the page sent a message that cannot be read: values"),
        (message(more=1), "the page sent a message that cannot be read: more"),
        (message(values={"thigh": 1}), "'thigh' is not a parameter"),
        (message(values={"thigh_length": 3}), "thigh_length = 3 m is outside its range"),
        (message(values={"thigh_length": "1 +"}), "thigh_length"),
        (message(files={}), "file not found"),
        (message(files={"../tree.yaml": ""}), "file not found"),
        (message(binary={"a.stl": "A"}), "the page sent a message that cannot be read: binary.a"),
        (message(binary={"a.stl": "AAAA"}), "a.stl a robot has no such file"),
        (
            message(files={"parameters.yaml": "a: [", "tree.yaml": ""}),
            "parameters.yaml:2:1 not valid YAML",
        ),
    ],
)
def test_what_is_wrong_is_an_answer(asked: str, cause: str) -> None:
    (problem, *_) = answer(asked)["problems"]
    assert cause in f"{problem['where']} {problem['cause']}"


def test_files_of_messages_are_never_read_from_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "laws.json").write_bytes(FILE.read_bytes())
    monkeypatch.chdir(tmp_path)
    files = source(open_design("cheetah"))["files"]
    files["parameters.yaml"] += "\ntrends: laws.json\n"
    (problem,) = answer(message(files=files))["problems"]
    assert (problem["where"], problem["cause"]) == ("laws.json", "file not found")
    own = {"laws.json": Path("laws.json").read_text("utf-8")}
    assert "robot" in answer(message(files=files | own))


def test_parts_that_are_no_text_go_with_their_robot(tmp_path: Path) -> None:
    design = own_parts.everything().resolve()
    own = source(design)
    assert {"parts/box.stl", "hook.stl"} == {*own["binary"]}
    assert "motor.obj" in own["files"]
    asked = {name: own[name] for name in ("files", "binary", "values")}
    found = answer(message(**asked))
    assert found["robot"]["xml"] == plane_xml(design.build())
    folder = own_parts.folder(tmp_path / "robot", design.spec, {})
    text = page([folder], tmp_path / "page", live=True)[0].read_text("utf-8")
    assert own["binary"]["hook.stl"] in text


@pytest.fixture
def server() -> Iterator[MessageServer]:
    made = MessageServer({"index.html": b"page", "a.js": b"1"}, "/designer", lambda text: "[]")
    yield made
    made.close()


def request(server: MessageServer, method: str, path: str, **headers: str) -> tuple[int, bytes]:
    body = headers.pop("body", None)
    connection = http.client.HTTPConnection("127.0.0.1", server.port)
    connection.request(method, path, body, {k.replace("_", "-"): v for k, v in headers.items()})
    found = connection.getresponse()
    content = found.read()
    connection.close()
    return found.status, content


JSON = {"Content_Type": "application/json", "body": "{}"}


def test_a_server_has_its_files_and_answers_messages(server: MessageServer) -> None:
    assert request(server, "GET", "/") == (200, b"page")
    assert request(server, "GET", "/a.js?x=1") == (200, b"1")
    assert request(server, "POST", "/designer", **JSON) == (200, b"[]")


@pytest.mark.parametrize("path", ["/../../etc/passwd", "/%2e%2e/a", "/b.js", "/designer"])
def test_a_server_has_no_other_files(server: MessageServer, path: str) -> None:
    assert request(server, "GET", path)[0] == 404


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"Host": "evil.example"}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "null"}, 403),
        ({"Content_Type": "text/plain"}, 400),
        ({"Content_Length": "-1"}, 400),
        ({"Content_Length": "9" * 5000}, 400),
    ],
)
def test_other_sites_and_odd_messages_are_refused(
    server: MessageServer, headers: dict[str, str], status: int
) -> None:
    assert request(server, "POST", "/designer", **{**JSON, **headers})[0] == status


def test_a_message_that_is_too_long_is_refused_to_whoever_still_sends_it(
    server: MessageServer,
) -> None:
    long = {**JSON, "body": "x" * (3 * MOST)}
    assert request(server, "POST", "/designer", **long)[0] == 413
    assert request(server, "POST", "/designer", **JSON)[0] == 200


def test_a_fault_of_draft_is_an_answer_and_its_server_stays(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(text: bytes) -> str:
        raise RuntimeError("a fault")

    server = MessageServer({}, "/designer", fail)
    status, content = request(server, "POST", "/designer", **JSON)
    assert (status, content[:12]) == (500, b"Draft failed")
    assert "RuntimeError: a fault" in capsys.readouterr().err
    assert request(server, "POST", "/designer", **JSON)[0] == 500
    server.close()


def test_a_port_that_is_taken_is_said(server: MessageServer) -> None:
    with pytest.raises(DraftError, match="another page or program uses it"):
        MessageServer({}, "/designer", lambda text: "", server.port)


@pytest.mark.parametrize(
    ("options", "cause"),
    [
        ({"live": True, "python": True}, "`live` and `python` both let a page change designs"),
        ({"live": True, "single": True}, "a page of one file changes no designs"),
        ({"python": True, "policies": ["a.onnx"]}, "has only the policies that ship with Draft"),
    ],
)
def test_pages_without_room_for_a_designer_say_so(
    options: dict[str, Any], cause: str, tmp_path: Path
) -> None:
    with pytest.raises(DraftError, match=re.escape(cause)):
        page(["cheetah"], tmp_path / "page", **options)
    assert not (tmp_path / "page").exists()
