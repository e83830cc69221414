"""What one policy for all legs can do: writes docs/any-legs.md.

    python -m benchmarks.any_legs --out examples/results/any_legs.json    # four minutes
    python -m benchmarks.zero_shot --out examples/results/zero_shot.json  # seven
    python -m benchmarks.zero_shot --velocity-noise 0.5 --out examples/results/zero_shot_noisy.json
    python -m benchmarks.looks --out examples/results/looks.json          # half a minute
    python -m docs.any_legs --pictures   # film strips of robots that walk, and the page
    python -m docs.any_legs              # the page alone

`--policy FILE` of each of them takes another policy than the one that ships.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

import mujoco  # noqa: E402

from benchmarks import any_legs, looks, zero_shot  # noqa: E402
from benchmarks.roll_outs import PUSH, number, run_as_command  # noqa: E402
from docs import any_legs_text as text  # noqa: E402
from docs.pictures import shrink  # noqa: E402
from draft.errors import counted  # noqa: E402
from draft.files import write  # noqa: E402
from draft.learn.bodies.features import GRAVITY  # noqa: E402
from draft.learn.bodies.legged import LeggedRobot  # noqa: E402
from draft.learn.policy.playback import Playback, Scenario  # noqa: E402
from draft.learn.policy.policy import ANY, FAMILY, Policy, open_policy  # noqa: E402
from draft.learn.policy.reduced import LegsPolicy, open_legs_policy  # noqa: E402
from draft.twins.compare import Comparison, compare_twin  # noqa: E402
from draft.validation.arms import by_maker  # noqa: E402

ROOT = Path(__file__).resolve().parents[1]
PAGE, IMAGES = ROOT / "docs/any-legs.md", ROOT / "docs/images/any_legs"
UNSEEN = ROOT / "examples/results/any_legs.json"
REAL = ROOT / "examples/results/zero_shot.json"
LOOKS = ROOT / "examples/results/looks.json"
NOISY = ROOT / "examples/results/zero_shot_noisy.json"
RESULTS = (UNSEEN, REAL, LOOKS, NOISY)
# Number of strips, time that a robot walks [s], and width of a strip [pixels].
PICTURES, SECONDS, WIDTH = 12, 4.0, 720
_MASSES = ("body_mass", "body_inertia", "body_ipos", "body_iquat")
BEFORE = 5696  # Iterations of the trainings that the policy goes on from.


def main(
    pictures: bool = False,
    robots: Path = zero_shot.ROBOTS,
    policy: Path = ANY,
    only: tuple[str, ...] = (),
) -> None:
    """Write the page.

    Args:
        pictures: whether to draw the film strips anew.
        robots: folder of the descriptions.
        policy: policy of all legs.
        only: robots of the strips; by default a dozen that walk.
    """
    unseen, real, seen, noisy = (json.loads(file.read_text("utf-8")) for file in RESULTS)
    if pictures:
        names = only or pictured(real)
        files = {entry.key: entry.file for entry in zero_shot.entries(robots)}
        legs = open_legs_policy(policy)
        IMAGES.mkdir(parents=True, exist_ok=True)
        for old in IMAGES.glob("*.png"):
            old.unlink()
        for name in names:
            strip(legs, files[name], IMAGES / f"{name}.png")
    write(PAGE, page(unseen, real, seen, noisy, drawn()))
    print(PAGE)


def pictured(real: Mapping[str, Any]) -> list[str]:
    """A dozen robots that walk: those that follow best, half of them on two legs if there are."""
    found = {}
    for group, at in zero_shot.AT.items():
        rows = [row for row in zero_shot.machines(real, group) if zero_shot.walks(row, at)]
        rows.sort(key=lambda row: row["cases"][f"{at:g}"]["error"])
        found[group] = [row["robot"] for row in rows]
    four, two = found.values()
    few = min(len(two), max(PICTURES // 2, PICTURES - len(four)))
    return [*four[: PICTURES - few], *two[:few]]


def drawn() -> list[str]:
    """Robots whose film strips are there."""
    return sorted(path.stem for path in IMAGES.glob("*.png"))


class _Maker(Playback):
    """A robot with the masses of its maker."""

    def __init__(self, policy: Policy, twin: Comparison, member: LeggedRobot, speed: float) -> None:
        super().__init__(policy, twin.design, Scenario((speed, 0.0, 0.0)))
        own = mujoco.MjModel.from_xml_string(member.xml)
        for i in range(1, own.nbody):
            place = self.model.body(own.body(i).name).id
            for name in _MASSES:
                getattr(self.model, name)[place] = getattr(own, name)[i]
        mujoco.mj_setConst(self.model, self.data)
        self.reset()


def strip(legs: LegsPolicy, file: Path, path: Path) -> None:
    """Draw a film strip of a robot at the command of its bar, unless it falls."""
    from draft.learn.policy.video import AZIMUTH

    twin = compare_twin(file, poses=2, key=path.stem)
    member = by_maker(twin)
    speed = zero_shot.AT[zero_shot.group_of({"legs": len(member.feet)})]
    root = math.sqrt(GRAVITY * member.leg_length)
    player = _Maker(legs.of_robot(member), twin, member, speed * root)
    with looks.film(player, path, SECONDS, AZIMUTH) as shoot:
        outcome = player.play(SECONDS, shoot)
    words = f"{path.stem}: {outcome.speed / root:.2f} sqrt(g L)"
    if outcome.falls:
        print(f"{words}, {counted(outcome.falls, 'fall')}: left out")
        return
    shrink(path, WIDTH)
    print(f"{words}, {path.stat().st_size / 1000:.0f} kB")


def page(
    unseen: Mapping[str, Any],
    real: Mapping[str, Any],
    seen: Mapping[str, Any],
    noisy: Mapping[str, Any],
    images: Sequence[str],
) -> str:
    """The page.

    Args:
        unseen: results of `benchmarks.any_legs`.
        real: results of `benchmarks.zero_shot`.
        seen: results of `benchmarks.looks`.
        noisy: results of `benchmarks.zero_shot` with another noise.
        images: robots with film strips.
    """
    action = unseen["action"]
    words = {"ms": f"{action['ms']:.2g}", "joints": action["joints"], "push": PUSH}
    words["noise"] = unseen["policy"]["velocity_noise"]
    words["family"] = open_policy(FAMILY).velocity_noise
    words["noisy"] = noisy["velocity_noise"]
    for name, (group, at) in zip(("four", "two"), zero_shot.AT.items(), strict=True):
        of = zero_shot.machines(real, group)
        up = sum(row["cases"][f"{at:g}"]["up"] for row in of) / len(of)
        words[name] = number(up, "%")
        words[f"noisy_{name}"] = number(zero_shot.share(noisy, group), "%")
    each = counted(unseen["replicas"], "roll-out")
    walk = number(zero_shot.share(real, zero_shot.TWO), "%")
    bodies = sum(row["bodies"] for row in unseen["kinds"] if row["trained"])
    starts = real["replicas"]
    of_real = {"each": counted(starts, "roll-out"), "error": zero_shot.ERROR}
    of_real["up"] = f"{math.ceil(zero_shot.UP * starts - 1e-9)} of {starts}"
    return "\n".join(
        (
            "# Any legs: one policy",
            "",
            "<!-- Written by `python -m docs.any_legs`; do not edit. -->",
            "",
            *text.INTRODUCTION.format(
                **words,
                seconds=unseen["seconds"],
                first=BEFORE,
                second=unseen["policy"]["iterations"],
            ).splitlines(),
            "",
            *text.TRIM.splitlines(),
            "",
            *text.DESIGNS.splitlines(),
            "",
            *_of_policy(unseen["policy"], real["policy"]),
            *_used(real),
            "",
            "## What was asked of it",
            "",
            *_bars([*any_legs.bars(unseen), *zero_shot.bars(real)]),
            "",
            "## Bodies that it was not trained with",
            "",
            *text.BODIES.format(bodies=bodies, each=each).splitlines(),
            "",
            *_table(any_legs.COLUMNS, unseen["kinds"]),
            "",
            "## How they look",
            "",
            *text.SEEN.format(hertz=looks.VIBRATION).splitlines(),
            "",
            *_rows(looks.HEADINGS, [looks.cells(row) for row in seen["kinds"]]),
            "",
            "## Real robots",
            "",
            *text.ROBOTS.format(**of_real).splitlines(),
            "",
            *_robots(real),
            *_pictures(images),
            "## What does not walk, and why",
            "",
            *text.WHY.format(walk=walk, twelve=f"{unseen['family']['ratio']:.2f}").splitlines(),
            "",
            *_failures(real),
        )
    )


def _of_policy(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Which policy the numbers are of."""
    line = f"Measured: the policy that ships, seed {first['seed']}."
    if first["digest"] == second["digest"]:
        return [line]
    other = f"{second['iterations']} iterations, seed {second['seed']}"
    return [line, f"The real robots were measured with another one: {other}."]


def _used(real: Mapping[str, Any]) -> list[str]:
    """What real quadrupeds do with the policy that Draft uses for their legs."""
    rows = [row for row in zero_shot.machines(real, zero_shot.FOUR) if zero_shot.FAMILY in row]
    if not rows:
        return []
    cases = [one["up"] for row in rows for one in row[zero_shot.FAMILY]["cases"].values()]
    up = number(sum(cases) / len(cases), "%")
    return [
        "",
        "Quadrupeds of twelve joints Draft drives by the policy of all quadrupeds. With it,",
        f"{len(rows)} real ones stay up in {up} of the roll-outs below.",
    ]


def _bars(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    lines = ["| what | measured | bar | |", "| --- | ---: | ---: | --- |"]
    for row in rows:
        limit = f"{'at least' if row['at_least'] else 'at most'} {number(row['bar'], row['unit'])}"
        word = "met" if row["met"] else "**missed**"
        value = number(row["value"], row["unit"])
        lines.append(f"| {row['what']} | {value} | {limit} | {word} |")
    return lines


def _table(columns: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return _rows(tuple(columns), [[cell(row) for cell in columns.values()] for row in rows])


def _rows(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [f"| {' | '.join(headings)} |", "| --- |" + " ---: |" * (len(headings) - 1)]
    return lines + [f"| {' | '.join(row)} |" for row in rows]


def _robots(real: Mapping[str, Any]) -> list[str]:
    lines = []
    for title, (group, rows) in zero_shot.tables(real).items():
        heading = f"### {title[0].upper()}{title[1:]}"
        lines += [heading, "", *_table(zero_shot.columns(group), rows), ""]
    noted = [row for row in real["robots"] if row.get("notes")]
    lines += [f"- {row['robot']}: {'; '.join(row['notes'])}." for row in noted]
    return [*lines, ""] if noted else lines


def _pictures(images: Sequence[str]) -> list[str]:
    if not images:
        return []
    four, two = zero_shot.AT.values()
    lines = [
        "### How they walk",
        "",
        f"At {four:g} sqrt(g L), and on two legs at {two:g}: time and way below each picture. The",
        "bodies are those that Draft draws, with the makers' masses.",
        "",
    ]
    for name in images:
        lines += [f"![{name}, walking](images/any_legs/{name}.png)", "", f"{name}", ""]
    return lines


def _failures(real: Mapping[str, Any]) -> list[str]:
    """Robots that do not walk, with what is known of each, and those that are not measured."""
    lines = []
    for group, at in zero_shot.AT.items():
        for row in zero_shot.machines(real, group):
            if zero_shot.walks(row, at):
                continue
            one = row["cases"][f"{at:g}"]
            error = "" if one["error"] is None else f", error {one['error']:.2f}"
            words = f"- {row['robot']}, at {at:g}: {number(one['up'], '%')} up{error}"
            if row["farthest"]:
                words += f"; outside the region: {'; '.join(row['farthest'])}"
            cause = text.CAUSES.get(row["robot"])
            lines.append(f"{words}. {cause}" if cause else f"{words}.")
    missing = [row for row in real["robots"] if "reason" in row and not row["again"]]
    if missing:
        lines += ["", "Not measured:", ""] if lines else ["Not measured:", ""]
        lines += [f"- {row['robot']}: {row['reason']}." for row in missing]
    return [*lines, ""] if lines else ["All walk.", ""]


if __name__ == "__main__":
    run_as_command(main, __doc__)
