"""Shell completion: what bash offers for commands, options, choices and designs."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from draft.cli.completion import script
from draft.spec.load import shipped
from tests.commands import Command

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


@needs_bash
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("bu",), ["build"]),
        (("sur",), ["surface", "survey"]),
        (("se",), ["sensitivity"]),
        (("deploy", "--sk"), ["--skill"]),
        (("--v",), ["--version"]),
        (("--install-completion", ""), ["bash", "zsh"]),
        (("show", "b"), ["biped", "bear"]),
        (("show", "qu"), ["quadruped"]),
        (("show", "bear", "--j"), ["--json"]),
        (("show", "quadruped", ":"), ["bear", "cheetah", "giraffe", "robot"]),
        (("show", "quadruped", ":", "ch"), ["cheetah"]),
        (("show", "--json", "gi"), ["giraffe"]),
        (("build", "quadruped", "--design", "ch"), ["cheetah"]),
        (("build", "ro"), ["robot"]),
        (("export", "bear", "--format", "u"), ["urdf", "usd"]),
        (("export", "bear", "--format", "urdf", "m"), ["mjcf", "mjlab"]),
        (("export", "bear", "--out", "some", "m"), []),
        (("train", "cheetah", "--stage", ""), ["base", "velocity", "terrain", "push", "any"]),
        (("import", "x.urdf", "--population", ""), ["humanoid", "quadruped"]),
        (("learn", ""), ["show", "robot"]),
        (("learn", "show", "--re"), ["--recipe"]),
        (("learn", "show", "che"), ["cheetah"]),
        (("trends", "figures", "--o"), ["--out"]),
        (("study", "re"), ["report", "results"]),
        (("study", "ro"), ["robot"]),
        (("study", "collect", "--"), ["--out", "--help"]),
        (("study", "mine.yaml", "--dr"), ["--dry-run"]),
        (("new", "mine", "--like", ""), list(shipped())),
        (("nothing", "x"), []),
    ],
)
def test_bash_offers_what_continues_the_line(
    completion: Path, words: tuple[str, ...], expected: list[str]
) -> None:
    assert offered(completion, *words) == expected


def test_the_script_is_installed_for_the_login_shell(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("SHELL", "/usr/bin/bash")
    path = tmp_path / "data/bash-completion/completions/draft"
    assert f"source {path}" in command("--install-completion").out
    assert path.read_text() == script()
    assert f"bashcompinit && source {path}" in command("--install-completion zsh").out
    for shell, words in (("/bin/fish", ""), ("", ""), ("bash", " tcsh")):
        monkeypatch.setenv("SHELL", shell)
        err = command.refuses(f"--install-completion{words}")
        assert "run draft --install-completion bash or zsh" in err
