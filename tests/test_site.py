"""The pages of the site do what they say, and the site builds without a warning."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

import draft
from docs import blocks, generated_pages, live
from draft.cli import COMMANDS, functions
from draft.metrics import METRICS
from draft.metrics.capabilities import CAPABILITIES
from tests.environments import warm

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
# Extras with which a page works, all of which it names; it is followed with no others.
NEEDS = {
    "agents": (),
    "start": ("explore", "figures", "report", "view"),
    "explanation/bands": (),
    "explanation/filter": (),
    "explanation/probabilities": (),
    "howto/arm": (),
    "howto/before-you-switch-it-on": (),
    "howto/biped": (),
    "howto/explore": ("explore", "figures", "report"),
    "howto/extend": (),
    "howto/fixed-arm": ("explore",),
    "howto/hand": ("explore",),
    "howto/hexapod": (),
    "howto/import": ("report",),
    "howto/levers": ("figures",),
    "howto/motors": (),
    "howto/own-parts": (),
    "howto/page": ("page",),
    "howto/payload": ("report",),
    "howto/quadruped": ("explore",),
    "howto/ros": (),
    "howto/to-a-machine": ("cad",),
    "howto/train": (),
    "howto/wheeled": ("explore",),
    "howto/walk": ("report",),
}
# Packages that a page says how to install.
ALSO = {"howto/ros": ("pin",)}
EXAMPLES = generated_pages.examples()
MAKERS = {"unitree": "Unitree", "deeprobotics": "DeepRobotics"}


def _python(*words: str, folder: Path) -> str:
    """What Python prints with these arguments in a folder; it must end without an error."""
    done = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        env=os.environ | {"PYTHONWARNINGS": "ignore", "MPLBACKEND": "Agg"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("page", NEEDS)
def test_a_page_works_as_written_in_an_empty_folder(
    page: str, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    for extra in NEEDS[page]:
        assert re.search(rf"extra (`{extra}`|{extra}\b)", text)
    for package in ALSO.get(page, ()):
        assert f"pip install {package}" in text
    python = warm(tmp_path_factory, NEEDS[page], ALSO.get(page, ()))
    (tmp_path / "folder").mkdir()
    blocks.copy_examples(tmp_path / "folder")
    blocks.follow(DOCS / f"{page}.md", tmp_path / "folder", python)


def test_every_page_of_tasks_is_tested_and_has_its_picture() -> None:
    pages = sorted((DOCS / "howto").glob("*.md"))
    assert {f"howto/{page.stem}" for page in pages} - {"howto/index"} == {
        name for name in NEEDS if name.startswith("howto/")
    }
    for page in pages:
        if page.stem == "index":
            continue
        picture = DOCS / "images" / "howto" / f"{page.stem}.png"
        assert f"(../images/howto/{page.stem}.png)" in page.read_text(encoding="utf-8")
        assert 2_000 < picture.stat().st_size < 150_000


@pytest.mark.parametrize(
    ("robot", "title"),
    [("hexapod", "hexapod"), ("biped", "biped"), ("arm", "fixed-arm"), ("hand", "hand")],
)
def test_a_robot_that_a_page_builds_is_the_one_that_ships(robot: str, title: str) -> None:
    page = (DOCS / "howto" / f"{title}.md").read_text(encoding="utf-8")
    files = re.findall(rf"```yaml\n# {robot}/(\S+)\n(.*?)```", page, re.DOTALL)
    assert {name for name, _ in files} == {
        one.name for one in (ROOT / "src/draft/robots" / robot).iterdir()
    }
    for name, text in files:
        shipped = (ROOT / "src/draft/robots" / robot / name).read_text(encoding="utf-8")
        schema, own = shipped.split("\n", 1)
        assert schema.startswith("# yaml-language-server: ")
        assert own == text


def test_commands_metrics_and_capabilities_are_all_on_their_pages() -> None:
    commands = generated_pages.commands()
    for command in COMMANDS:
        assert f"\n## draft {command}\n" in commands
        for name in functions(command)[1]:
            assert f"\n### draft {command} {name}\n" in commands
    assert commands.count("usage: draft ") == commands.count("```text")
    metrics = generated_pages.metrics()
    for metric in METRICS.values():
        assert f"\n## {metric.name}\n\n{metric.doc}\n" in metrics
        assert f"- formula: `{metric.formula}`" in metrics
    capabilities = generated_pages.capabilities()
    for name, one in CAPABILITIES.items():
        assert f"| `{name}` | {one.label} |" in capabilities


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the site, built without a warning."""
    for module in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(module)
    out = tmp_path_factory.mktemp("built") / "site"
    _python("-m", "docs.site", "--out", str(out), folder=ROOT)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 1920, 600])
def test_no_cell_of_results_has_three_lines_and_no_command_is_cut(
    site: Path, browser: Any, width: int
) -> None:
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto((site / "results.html").as_uri())
    lines = page.evaluate(
        """() => [...document.querySelectorAll("td.text-right p")].map(
            p => p.getBoundingClientRect().height / parseFloat(getComputedStyle(p).lineHeight))"""
    )
    assert len(lines) > 100
    assert max(lines) < 1.5
    for name in ("index", "learning", "howto/biped"):
        page.goto((site / f"{name}.html").as_uri())
        commands = page.evaluate(
            """() => [...document.querySelectorAll(".highlight-sh pre")].map(
                pre => pre.scrollWidth - pre.clientWidth)"""
        )
        assert commands
        assert max(commands) <= 0
        # Nothing sticks out of the page either.
        wide = page.evaluate("() => document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0
    page.close()


@pytest.mark.slow
def test_the_site_opens_without_a_network(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 40
    for page in pages:
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(
            r'<(?:script|img|link rel="stylesheet")[^>]* (?:src|href)="([^"]+)"', text
        )
        assert not [url for url in loaded if url.startswith(("http", "//"))], page
    assert (site / "search.html").is_file()
    front = (site / "index.html").read_text(encoding="utf-8")
    assert "pip install uv" in re.sub(r"<[^>]+>", "", front)


@pytest.mark.slow
def test_the_front_of_the_site_is_a_page_in_which_robots_walk(site: Path, browser: Any) -> None:
    pytest.importorskip("mjswan", reason="needs the extra page")
    links = re.findall(r'(?:src|href)="(live/\w+.html)"', (DOCS / "live.md").read_text())
    assert {*links} == {f"live/{path.name}" for path in (site / "live").iterdir()}
    page = browser.new_context().new_page()
    page.goto((site / "index.html").as_uri())
    (live,) = (one for one in page.frames if "quadrupeds" in one.url)
    live.wait_for_function("window.draftPage && draftPage.robots.every(one => one.qpos[0] > 0.2)")
    page.context.close()


@pytest.mark.parametrize("name", live.REAL)
def test_the_gallery_states_the_masses_of_real_robots(name: str, tmp_path: Path) -> None:
    (description,) = (live.DESCRIPTIONS / name).glob("*.urdf")
    found = draft.import_robot(description, tmp_path / name)
    own = sum(float(mass) for mass in re.findall(r'<mass value="([^"]+)"', description.read_text()))
    maker, _, model = name.partition("_")
    row = f"{MAKERS[maker]} {model.title()}</a> | {found.spec.resolve().mass:.1f} | {own:.1f} |"
    assert row in (DOCS / "live.md").read_text(encoding="utf-8")


def test_sample_outputs_have_no_gaps() -> None:
    pages = [ROOT / "README.md", *DOCS.glob("*.md"), *DOCS.glob("[!g]*/*.md")]
    shown = [
        f"{page.name}:{block.line}"
        for page in pages
        for block in blocks.blocks(page)
        if block.language == "text" and "..." in block.text
    ]
    assert len(pages) > 20
    assert not shown


# A page of the tests' own, whose faults the runner of pages must find.


def write(folder: Path, text: str) -> Path:
    page = folder / "page.md"
    page.write_text(text, encoding="utf-8")
    return page


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("```sh\ndraft check quadrupet\n```\n", "ends with 2"),
        ("```sh\ncurl example.com\n```\n", "is no command of Draft"),
        ("<!-- arguments only -->\n```sh\ndraft train bear --minuts 8\n```\n", "minuts"),
        ("```sh\ndraft list\n```\n\n```text\nelephant\n```\n", "'elephant' is not printed"),
        ("```yaml\nname: nobody\n```\n", "a file's name is missing"),
        ("```python\n1 / 0\n```\n", "ZeroDivisionError"),
    ],
)
def test_a_page_that_does_not_work_is_found(text: str, message: str, tmp_path: Path) -> None:
    page = write(tmp_path, f"# Page\n\n{text}")
    with pytest.raises(blocks.BlockError, match=message):
        blocks.follow(page, tmp_path)


def test_a_page_writes_and_changes_files(tmp_path: Path) -> None:
    page = write(
        tmp_path,
        "```yaml\n# a/b.yaml\none:\n  two: 2\n```\n"
        '```yaml\n# a/b.yaml, below "one:"\n  three: 3\n```\n'
        '```yaml\n# a/b.yaml, instead of "two: 2"\n  two: 4\n```\n',
    )
    blocks.follow(page, tmp_path)
    assert (tmp_path / "a" / "b.yaml").read_text() == "one:\n  three: 3\n  two: 4\n"


def test_output_is_compared_up_to_spaces(tmp_path: Path) -> None:
    text = "```sh\nuv run --extra view draft list\n```\n\n```text\n2  A body\n```\n"
    blocks.follow(write(tmp_path, text), tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_draws_its_picture(script: Path, tmp_path: Path) -> None:
    for module in ("matplotlib", *(("optuna",) if "optimise" in script.read_text() else ())):
        pytest.importorskip(module)
    assert _python(str(script), folder=tmp_path).strip()
    if "savefig" in script.read_text(encoding="utf-8"):
        assert (tmp_path / f"{script.stem}.png").stat().st_size > 5_000


def test_examples_are_short_and_each_has_a_title_and_a_picture() -> None:
    assert len(EXAMPLES) >= 10
    for script in EXAMPLES:
        text = script.read_text(encoding="utf-8")
        assert len(text.splitlines()) < 60, script
        first = (ast.get_docstring(ast.parse(text)) or "").splitlines()[0]
        assert 10 < len(first) < 100, script
        picture = generated_pages.IMAGES / f"{script.stem}.png"
        assert 2_000 < picture.stat().st_size < 150_000
        assert f"../../../examples/{script.name}" in generated_pages.example(script)


def test_the_page_for_agents_is_short_and_its_robots_are_three() -> None:
    page = DOCS / "agents.md"
    assert len(page.read_text(encoding="utf-8").splitlines()) <= 230
    written = [block.text for block in blocks.blocks(page) if block.language == "yaml"]
    folders = {found[1] for text in written if (found := re.match(r"# (\w+)/", text))}
    assert folders == {"monoped", "rover", "long_dog"}


def test_llms_txt_links_to_files_that_exist() -> None:
    text = (ROOT / "llms.txt").read_text(encoding="utf-8")
    assert text.startswith("# Draft\n\n> ")
    links = re.findall(r"\]\(([^)]+)\)", text)
    assert len(links) > 15
    for link in links:
        assert (ROOT / link).exists(), link


def test_the_citation_has_what_the_format_requires() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(citation)
    assert (
        citation["version"]
        == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    )
    assert all({"name"} == set(author) for author in citation["authors"])
