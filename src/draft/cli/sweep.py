"""`draft sweep`: compile designs and measure their models, into a folder of Parquet parts."""

from __future__ import annotations

from draft.cli import explore_options as x
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values
from draft.explore.settings import SweepSettings


@x.options(SweepSettings)
def main(
    reference: DesignArgument,
    /,
    *,
    settings: SweepSettings,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    json: JsonOutput = False,
) -> int:
    """Build very many designs and measure their models, into a folder of Parquet parts."""
    from draft.explore.sweep import sweep

    robot = x.robot(reference, design)
    x.print_policy(settings.policy, robot)
    return x.run_rows(sweep, robot, settings, str(settings.out), values, payload, json)
