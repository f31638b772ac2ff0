"""The command line of `eomgen bench speed`."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from typing import Any

from bench import report
from bench.process import require_posix
from bench.speed.data import Data
from bench.speed.page import render
from bench.speed.picture import plot
from bench.speed.plan import measure
from bench.speed.probes import PROBES
from bench.speed.targets import targets
from eomgen.errors import CheckError, OptionError, shown


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """The options."""
    parser = report.Parser(
        prog="eomgen bench speed",
        description="Times compiled modules beside hand-written C and other tools; writes speed.json, speed.md and "
        "speed.png. Run it on a quiet machine, with the Python that has the contenders installed.",
        epilog="examples:\n  eomgen bench speed                       the full run, about 10 minutes\n"
        "  eomgen bench speed --quick               one round of the targets, about a minute\n"
        "  eomgen bench speed --from-json results/speed.json",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--quick", action="store_true", help="one round, fewer sizes and contenders")
    report.add_output(parser)
    parser.add_argument("--probe", nargs="+", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.probe and options.probe[0] not in PROBES:
        raise OptionError(f"there is no probe {shown(options.probe[0])}")
    return options


def measured(quick: bool) -> dict[str, Any]:
    """The contents of `speed.json`, the targets among them."""
    require_posix("speed")
    found = measure(quick)
    found["targets"] = [{**row._asdict(), "met": row.met} for row in targets(Data(found))]
    return found


def main() -> int:
    """Runs the suite; the exit code is 1 where something of eomgen failed or gave a wrong answer."""
    options = parse()
    if options.probe:
        name, *words = options.probe
        print(json.dumps(PROBES[name](*words)))
        return 0
    report.require("matplotlib", "the plot of speed", "bench")
    found = report.produce(
        "speed",
        options,
        lambda: measured(options.quick),
        lambda found: render(Data(found)),
        lambda found, path: plot(Data(found), path),
    )
    failed = [r for r in found["records"] if r["problem"] and r["who"].startswith(("ours", "eomgen", *PROBES))]
    if failed:
        first = failed[0]
        raise CheckError(f"{len(failed)} measurements failed; the first: {first['who']}: {first['problem']}")
    return 0


if __name__ == "__main__":
    sys.exit(report.command(main))
