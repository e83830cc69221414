"""Shell completion: what bash offers for commands, options, choices and designs."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from draft.cli import COMMANDS, functions, main
from draft.cli.completion import entries, script

bash = shutil.which("bash")
needs_bash = pytest.mark.skipif(bash is None, reason="bash is not installed")


@pytest.fixture(scope="module")
def completion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The completion script in a file."""
    path = tmp_path_factory.mktemp("completion") / "draft"
    path.write_text(script())
    return path


def offered(completion: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words after `draft`, in this folder."""
    words = ("draft", *words)
    quoted = " ".join(f"'{word}'" for word in words)
    code = f"""
        source '{completion}'
        COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1}
        _draft
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    done = subprocess.run(
        [bash or "bash", "--norc", "-uc", code], capture_output=True, text=True, check=True
    )
    assert done.stderr == ""
    return done.stdout.split("\n")[:-1] if done.stdout.strip() else []


def test_every_option_of_every_command_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    known = {entry.command: {*entry.options, "--help"} for entry in entries()}
    paths = [[name] for name in COMMANDS]
    paths += [[name, verb] for name in COMMANDS for verb in functions(name)[1]]
    assert {" ".join(path) for path in paths} == set(known)
    for path in paths:
        if functions(path[0])[0] is None and len(path) == 1:
            assert main([*path, "--help"]) == 0
        else:
            with pytest.raises(SystemExit):
                main([*path, "--help"])
        told = capsys.readouterr().out
        listed = set(re.findall(r"^ +(?:-h, )?(--[a-z][a-z-]*)", told, re.MULTILINE)) or {"--help"}
        assert known[" ".join(path)] == listed, path


@needs_bash
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("bu",), ["build"]),
        (
            ("s",),
            ["show", "studio", "screen", "sweep", "study", "surface", "survey", "schema"],
        ),
        (("--v",), ["--version"]),
        (("--install-completion", ""), ["bash", "zsh"]),
        (("show", "b"), ["bear"]),
        (("show", "qu"), ["quadruped"]),
        (("show", "bear", "--j"), ["--json"]),
        (("show", "quadruped", ":"), ["bear", "cheetah", "giraffe", "robot"]),
        (("show", "quadruped", ":", "ch"), ["cheetah"]),
        (("show", "--json", "gi"), ["giraffe"]),
        (("build", "quadruped", "--design", "ch"), ["cheetah"]),
        (("build", "ro"), ["robot"]),
        (("export", "bear", "--format", "u"), ["urdf"]),
        (("export", "bear", "--format", "urdf", "m"), ["mjcf"]),
        (("export", "bear", "--out", "some", "m"), []),
        (("train", "cheetah", "--stage", ""), ["base", "velocity", "terrain", "push"]),
        (("import", "x.urdf", "--population", ""), ["humanoid", "quadruped"]),
        (("learn", ""), ["show", "robot"]),
        (("learn", "show", "--re"), ["--recipe"]),
        (("learn", "show", "che"), ["cheetah"]),
        (("trends", "figures", "--o"), ["--out"]),
        (("study", "re"), ["report", "results"]),
        (("study", "ro"), ["robot"]),
        (("study", "collect", "--"), ["--out", "--help"]),
        (("study", "mine.yaml", "--dr"), ["--dry-run"]),
        (("new", "mine", "--like", ""), ["hopper", "humanoid", "quadruped"]),
        (("nothing", "x"), []),
    ],
)
def test_bash_offers_what_continues_the_line(
    completion: Path, words: tuple[str, ...], expected: list[str]
) -> None:
    assert offered(completion, *words) == expected


def test_the_script_is_installed_for_the_login_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("SHELL", "/usr/bin/bash")
    path = tmp_path / "data/bash-completion/completions/draft"
    assert main(["--install-completion"]) == 0
    assert f"source {path}" in capsys.readouterr().out
    assert path.read_text() == script()
    assert main(["--install-completion", "zsh"]) == 0
    assert f"bashcompinit && source {path}" in capsys.readouterr().out


@pytest.mark.parametrize(("shell", "arguments"), [("/bin/fish", []), ("", []), ("bash", ["tcsh"])])
def test_a_shell_without_completion_is_reported(
    shell: str,
    arguments: list[str],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("SHELL", shell)
    assert main(["--install-completion", *arguments]) == 2
    assert "run draft --install-completion bash or zsh" in capsys.readouterr().err
