"""`draft screen`: screen designs by arrays, into one Parquet file."""

from __future__ import annotations

from draft.cli import explore_options as x
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values
from draft.explore.settings import ScreenSettings


@x.options(ScreenSettings)
def main(
    reference: DesignArgument,
    /,
    *,
    settings: ScreenSettings,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    json: JsonOutput = False,
) -> int:
    """Screen very many designs by closed-form metrics and the filter, into one file."""
    from draft.explore.screen import screen

    robot = x.robot(reference, design)
    return x.run_rows(screen, robot, settings, str(settings.out), values, payload, json)
