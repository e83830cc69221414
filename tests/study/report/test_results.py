"""The page and the terminal's tables say what the results hold."""

from __future__ import annotations

import re
import shutil
import statistics
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from PIL import Image

from draft.cli.display.results import commands
from draft.study.report import folder as files
from draft.study.report import writing
from draft.study.report.collect import collect
from draft.study.report.figures import shrink
from draft.study.report.markdown import markdown
from draft.study.report.occupancy import Utilisation
from draft.study.report.sections import Contents, Source
from draft.study.report.tables import all_tables
from draft.study.report.writing import write_page
from tests.commands import Command
from tests.learn import synthetic

# 3.1 and 4.2 m/s times 0.94 and 1 by seed, times 0.93 with inertia errors; see `synthetic.able`.
KICKS = {
    ("cheetah", "nominal"): "3.01 (2.91–3.10)",
    ("cheetah", "perturbed inertia"): "2.80 (2.71–2.88)",
    ("bear", "nominal"): "4.07 (3.95–4.20)",
    ("bear", "perturbed inertia"): "3.79 (3.67–3.91)",
}
PRINTED = """\
Order of the designs by the median over seeds, how often a bootstrap over seeds gives just this \
order, and the order that it gives next most often. A seed that passes no level counts as below \
all others; ties are broken at random.
skill       arm                order by median  probability  next  seeds
kick        nominal            bear > cheetah   > 99 %             2
kick        perturbed inertia  bear > cheetah   > 99 %             2
kick/√(gL)  nominal            bear > cheetah   > 99 %             2
kick/√(gL)  perturbed inertia  bear > cheetah   > 99 %             2
"""


def text_of(folder: Path, page: Path) -> str:
    study = files.read(folder, results=True)
    used = Utilisation(study)
    source = Source(folder, page, {}, commands(study, folder, page, ()))
    contents = Contents(study, all_tables(study, used), {}, source)
    return markdown(contents.page(), page.parent)


def test_the_page_names_each_design_and_skill_with_its_seeds(
    collected: Path, tmp_path: Path
) -> None:
    said = text_of(collected, tmp_path / "results.md")
    for skill in ("Top speed", "Step", "Kick", "Efficiency"):
        (line,) = [row for row in said.splitlines() if row.startswith(f"- **{skill}")]
        assert all(design in line for design in synthetic.DESIGNS)
    speeds = [synthetic.able("cheetah", seed, "nominal")[0] for seed in (0, 1, 2)]
    middle, low, high = statistics.median(speeds), min(speeds), max(speeds)
    assert f"cheetah {middle:.2f} ({low:.2f}–{high:.2f})" in said
    for heading in ("With inertia errors", "What limits them", "Learning", "How to redo it"):
        assert f"\n## {heading}\n" in said
    assert "giraffe > bear > cheetah" in said
    assert "3 seeds give little certainty" in said
    assert "Recipe `laptop`" in said
    assert "three.yaml   # to studies/three" in said
    assert "In motion" not in said
    assert not re.search(r"\b(nan|None|inf)\b", said)


def test_numbers_and_strips_of_the_page_are_those_of_the_data(tmp_path: Path) -> None:
    # Another study gives another page: nothing is written into the text.
    folder = synthetic.study(tmp_path / "s", ("bear",), (5,), ("nominal",), ("push",))
    out = tmp_path / "out"
    collect(folder, out)
    (out / "strips").mkdir()
    (out / "strips/bear-run.png").write_bytes(b"")
    said = text_of(out, tmp_path / "docs/page.md")
    assert "Designs: bear. Stages: push. Seed 5." in said
    assert "cheetah" not in said
    assert "With inertia errors" not in said
    assert "Order of the designs" not in said
    assert "![bear: run](../out/strips/bear-run.png)" in said


def test_the_page_is_written_with_small_figures_and_again_the_same(
    collected: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    page = Path("docs/results.md")
    (tmp_path / "docs/images/results").mkdir(parents=True)
    (tmp_path / "docs/images/results/old.png").write_bytes(b"")
    study = files.read(collected, results=True)
    lines = commands(study, collected, page, ())
    found = write_page(study, collected, page, lines)
    first = {path: path.read_bytes() for path in found}
    assert all(len(data) < 100_000 for path, data in first.items() if path.suffix == ".png")
    links = re.findall(r"!\[[^]]+\]\(([^)]+)\)", page.read_text())
    assert sorted(links) == sorted(p.relative_to("docs").as_posix() for p in found[1:])
    assert {path.name for path in Path("docs/images/results").iterdir()} == {
        path.name for path in found[1:]
    }
    assert {path: path.read_bytes() for path in write_page(study, collected, page, lines)} == first
    assert str(tmp_path) not in page.read_text()


def test_a_shrunk_picture_looks_the_same(tmp_path: Path) -> None:
    rows = np.linspace(0, 255, 400).astype(np.uint8)
    image = np.stack([np.tile(rows, (200, 1))] * 3, axis=2)
    path = tmp_path / "a.png"
    Image.fromarray(image).save(path)
    shrink(path, 200)
    with Image.open(path) as small:
        assert small.size == (200, 100)
        seen = np.asarray(small.convert("RGB")).astype(int)
    assert np.abs(seen - image[::2, ::2]).max() <= 6


def test_results_are_printed_as_tables(tmp_path: Path, command: Command) -> None:
    folder = synthetic.study(tmp_path / "s", ("cheetah", "bear"), (0, 1), stages=("push",))
    out = tmp_path / "out"
    said = command(f"study collect {folder} --out {out}").out
    assert f"{out}: 4 runs, 4 new, 0 changed; 0." in said
    assert "missing: cheetah: no velocity policy was trained" in said
    shown = command(f"study results {out}").out
    said = "\n".join(line.rstrip() for line in shown.splitlines())
    for (design, arm), kick in KICKS.items():
        (row,) = [line for line in said.splitlines() if re.match(f"{design} .* {arm} ", line)]
        assert row.split()[-4:] == [*kick.split(), "not", "evaluated"]
    assert PRINTED in said
    assert "cheetah, bear  push   0, 1" in said
    told = command.json(f"study results {out}")
    assert told["provenance"][0]["Draft"] == "0.1.0"
    assert [row["design"] for row in told["capability"]] == ["cheetah"] * 2 + ["bear"] * 2


def test_results_or_a_page_that_cannot_be_are_refused(
    source: Path, collected: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.chdir(tmp_path)
    err = command.refuses(f"study results {collected} --write page.html")
    assert "is not a Markdown file" in err
    err = command.refuses(f"study results {source}")
    assert f"'draft study collect {source} --out DIR'" in err
    err = command.refuses("study results")
    assert "'examples/results/three_quadrupeds' holds no results" in err


def test_the_page_in_the_repository_is_what_its_command_writes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    root = Path(__file__).parents[3]
    page = Path("docs/results.md")
    kept = (root / page).read_text(encoding="utf-8")
    (line,) = re.findall(r"<!-- Written by `draft (.+?)`; do not edit. -->", kept)
    shutil.copytree(root / "examples/results", tmp_path / "examples/results")
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs/learning.md").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(writing, "save", lambda folder, makers, *_: [])
    command(line)
    written = page.read_text(encoding="utf-8")
    assert written.splitlines() == kept.splitlines()
