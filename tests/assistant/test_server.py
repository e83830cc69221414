"""`draft mcp` in a process of its own, as an assistant starts and asks it."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcp")

from mcp import Client, StdioServerParameters
from mcp.shared.exceptions import MCPDeprecationWarning
from mcp.types import CallToolResult, ImageContent, TextContent

import draft
from draft.metrics import of_design
from tests.commands import Command

pytestmark = pytest.mark.slow
PNG = b"\x89PNG\r\n\x1a\n"


def command(folder: Path, *options: str) -> list[str]:
    return [sys.executable, "-m", "draft", "mcp", str(folder), *options]


def talk(
    folder: Path, ask: Callable[[Client], Awaitable[None]], *options: str, mode: str = "auto"
) -> None:
    """Start the server of a folder, and ask it by the protocol's own client."""

    async def run() -> None:
        program, *arguments = command(folder, *options)
        server = StdioServerParameters(command=program, args=arguments)
        async with Client(server, mode=mode) as client:
            await ask(client)

    # In a thread: tests of pages leave an event loop running in this one.
    with ThreadPoolExecutor(1) as pool:
        pool.submit(asyncio.run, run()).result()


def text(result: CallToolResult) -> str:
    (content,) = result.content
    assert isinstance(content, TextContent)
    return content.text


def test_a_spoken_task_is_solved(tmp_path: Path) -> None:
    """A quadruped below 25 kg that carries 10 kg for an hour."""

    async def ask(client: Client) -> None:
        async def told(name: str, /, **given: Any) -> Any:
            found = await client.call_tool(name, given)
            assert not found.is_error, text(found)
            assert json.loads(text(found)) == found.structured_content
            return found.structured_content

        offered = {tool.name: tool for tool in (await client.list_tools()).tools}
        assert offered["solve"].input_schema["required"] == ["design", "conditions"]
        assert "quadruped" in await told("list_robots")
        copied = await told("new_robot", name="mule", like="quadruped")
        assert copied == {"folder": "mule"}
        start = await told("check", design="mule")
        assert start["accepted"]
        assert start["mass_kg"] > 25
        known = {one["name"] for one in (await told("metrics"))["metrics"]}
        assert {"mass", "payload_hour", "endurance_standing"} <= known
        measured = await told("metrics", design="mule", values={"payload": 10})
        assert measured["metrics"]["mass"] == pytest.approx(start["mass_kg"] + 10)
        conditions = ["mass <= 25", "payload_hour >= 10", "endurance_standing >= 1"]
        found = await told("solve", design="mule", conditions=conditions, save_as="light")
        assert found["met"]
        assert found["file"] == "mule/designs/light.yaml"
        assert all(one["why"] for one in found["moved"])
        against = await told("compare", designs=["mule", "mule:light"], metrics=["mass"])
        (part,) = against["against_first"]
        assert {one["name"] for one in found["moved"]} == set(part["shares"])
        assert part["better"]["mass"] > 0.9
        checked = await told("check", design="mule:light", simulate=True)
        assert checked["accepted"]
        drawn = await client.call_tool("picture", {"designs": ["mule", "mule:light"], "width": 320})
        if drawn.is_error:
            assert "MuJoCo cannot draw on this machine" in text(drawn)
        else:
            (image,) = drawn.content
            assert isinstance(image, ImageContent)
            assert image.mime_type == "image/png"
            assert base64.b64decode(image.data).startswith(PNG)

    talk(tmp_path, ask)
    spec = draft.load(tmp_path / "mule")
    assert float(spec.resolve("light").mass) <= 25
    assert "else mass <= 25" in (tmp_path / "mule" / "designs" / "light.yaml").read_text()
    loaded = spec.resolve("light", {"payload": 10.0})
    assert loaded.accepted
    values = of_design(loaded, ["mass", "hold_time", "endurance_standing"])
    assert float(values["mass"]) <= 35
    assert float(values["hold_time"]) >= 3600
    assert float(values["endurance_standing"]) >= 1


def test_refusals_are_errors_of_tools_and_no_training_is_offered(tmp_path: Path) -> None:
    async def ask(client: Client) -> None:
        names = [tool.name for tool in (await client.list_tools()).tools]
        assert "train" not in names
        assert "check" in names
        for name, given, message in (
            ("check", {"design": "../x"}, "'../x' is outside the folder that is served"),
            ("check", {"design": 3}, "`design` 3 is not text"),
            ("train", {"design": "cheetah", "out": "run"}, "'train' is not allowed"),
            ("walk", {}, "there is no tool 'walk'"),
        ):
            found = await client.call_tool(name, given)
            assert found.is_error
            assert text(found).startswith(message)

    talk(tmp_path, ask)
    assert list(tmp_path.iterdir()) == []


def test_training_is_offered_where_it_is_allowed(tmp_path: Path) -> None:
    async def ask(client: Client) -> None:
        assert "train" in [tool.name for tool in (await client.list_tools()).tools]
        found = await client.call_tool("train", {"design": "hopper", "out": "runs/a"})
        assert "is not allowed" not in text(found)
        assert found.is_error

    talk(tmp_path, ask, "--allow-training")
    assert not (tmp_path / "runs").exists()


def test_pings_are_answered_while_a_tool_works(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    done: list[str] = []

    async def ask(client: Client) -> None:
        async def screen() -> None:
            given = {"design": "quadruped", "vary": ["thigh_length=0.2:0.4"], "out": "a.parquet"}
            assert not (await client.call_tool("screen", {**given, "n": 100_000})).is_error
            done.append("screen")

        async def ping() -> None:
            while not (tmp_path / "a.parquet.parts").exists():
                await asyncio.sleep(0.01)
            with pytest.warns(MCPDeprecationWarning):  # The newest protocol has none.
                await client.send_ping()
            done.append("ping")

        await asyncio.gather(screen(), ping())

    talk(tmp_path, ask, mode="legacy")
    assert done == ["ping", "screen"]


def test_standard_output_has_the_protocol_alone(tmp_path: Path) -> None:
    """Also where an extension of Draft or a library prints."""
    start = {
        "protocolVersion": "2025-06-18",
        "capabilities": {},
        "clientInfo": {"name": "test", "version": "1"},
    }
    module = tmp_path / "noisy.py"
    module.write_text(
        "import os, sys\n"
        "from draft.assistant import tools\n"
        "def noisy():\n"
        "    print('noise')\n"
        "    os.system('echo noise')\n"
        "    return []\n"
        "tools.descriptions = noisy\n"
        "from draft.cli import main\n"
        "sys.exit(main(['mcp', sys.argv[1]]))\n"
    )
    (tmp_path / "served").mkdir()
    messages = (
        {"id": 1, "method": "initialize", "params": start},
        {"method": "notifications/initialized"},
        {"id": 2, "method": "tools/call", "params": {"name": "metrics", "arguments": {}}},
        {"id": 3, "method": "tools/call", "params": {"name": "list_robots"}},
    )
    with subprocess.Popen(
        [sys.executable, module, tmp_path / "served"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        assert server.stderr is not None
        for message in messages:
            server.stdin.write(json.dumps({"jsonrpc": "2.0"} | message) + "\n")
        server.stdin.flush()
        lines = [json.loads(server.stdout.readline()) for _ in range(3)]
        server.stdin.close()
        assert server.stdout.read() == ""
        assert server.stderr.read().count("noise") == 2
    assert server.returncode == 0
    assert [line["id"] for line in lines] == [1, 2, 3]
    assert all("result" in line for line in lines)


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal")
def test_an_interrupt_ends_it(tmp_path: Path) -> None:
    with subprocess.Popen(
        command(tmp_path), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        assert server.stderr is not None
        server.stdin.write(b'{"jsonrpc": "2.0", "id": 1, "method": "ping"}\n')
        server.stdin.flush()
        assert b'"id":1' in server.stdout.readline()
        os.kill(server.pid, signal.SIGINT)
        assert server.wait() == -signal.SIGINT
        assert server.stderr.read() == b""


def test_a_folder_that_is_missing_is_refused(tmp_path: Path) -> None:
    err = Command().refuses("mcp", tmp_path / "nowhere")
    assert "nowhere'\n  make it, or name another one" in err


def test_without_the_library_the_message_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "mcp", None)
    err = Command().refuses("mcp", tmp_path)
    assert err.startswith("error: mcp is not installed\n  ")
    assert "mcp" in err.splitlines()[1]
