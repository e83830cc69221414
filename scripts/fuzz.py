"""Try random faults in specs, expressions and descriptions, and print what Draft mishandles.

    uv run --all-extras python scripts/fuzz.py --n 10000
    uv run --all-extras python scripts/fuzz.py --kind spec --seed 123 --n 1   # one again

The suite tries the first few hundred seeds of each kind (tests/test_fuzz.py).
"""

from __future__ import annotations

import argparse
import faulthandler
import itertools
import os
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "disabled")
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests import mutations

HANGING = 300.0  # until the stack is printed and the run ends [s]


def main() -> int:
    """Run the trials; return 0 if all are handled well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--n", type=int, default=1000, help="trials of all kinds together")
    parser.add_argument("--seed", type=int, default=1000, help="seed of the first trial")
    parser.add_argument("--kind", choices=mutations.TRIALS, help="one kind of trial alone")
    parser.add_argument("--minutes", type=float, default=None, help="end after this time")
    given = parser.parse_args()
    kinds = [given.kind] if given.kind else [*mutations.TRIALS]
    trials = itertools.islice(
        ((kind, seed) for seed in itertools.count(given.seed) for kind in kinds), given.n
    )
    end = time.monotonic() + 60 * given.minutes if given.minutes else float("inf")
    codes: Counter[str] = Counter()
    wrong = 0
    for kind, seed in trials:
        if time.monotonic() > end:
            break
        faulthandler.dump_traceback_later(HANGING, exit=True)
        with tempfile.TemporaryDirectory() as folder:
            try:
                outcome = mutations.run(kind, seed, Path(folder))
            except Exception as error:
                outcome = mutations.Outcome(70, f"{type(error).__name__}: {error}")
        codes[f"{kind} {outcome.code}"] += 1
        if outcome.fault:
            wrong += 1
            print(f"MISHANDLED --kind {kind} --seed {seed} --n 1\n{outcome.fault}\n", flush=True)
    faulthandler.cancel_dump_traceback_later()
    shown = ", ".join(f"{name}: {count}" for name, count in sorted(codes.items()))
    print(f"{codes.total()} trials, {wrong} mishandled; by kind and exit code {shown}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
