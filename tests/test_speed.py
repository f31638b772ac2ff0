"""The parts of `eomgen bench speed`: its processes, what is run, its targets and its page. Nothing here is timed."""

import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from bench import process, report
from bench.speed import page, picture, targets
from bench.speed.__main__ import parse
from bench.speed.cells import HAND, LIMIT
from bench.speed.data import SOME, Data, add, amount, new_record, spread
from bench.speed.plan import plan
from bench.speed.targets import Side, compared
from eomgen.errors import OptionError


def python(text: str, limit: float = LIMIT) -> process.Finished:
    return process.run([sys.executable, "-c", text], limit)


def alive(number: int) -> bool:
    """Whether a process is at work; one that has ended and is not yet waited for is not."""
    try:
        os.kill(number, 0)
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_process_is_stopped_with_all_it_started(tmp_path: Path) -> None:
    note = tmp_path / "note"
    done = process.run(["sh", "-c", f"sleep 600 & echo $! > '{note}'; echo '{{}}'; wait"], limit=2.0)
    assert (done.code, done.problem, done.answers()) == (None, "> 2 s", [])
    patience = time.monotonic() + 10
    while alive(int(note.read_text())) and time.monotonic() < patience:
        time.sleep(0.05)
    assert not alive(int(note.read_text()))


def test_a_process_gives_its_answers_or_its_error() -> None:
    done = python("print('building'); print('{\"a\": 1}'); print('{\"b\": [2]}'); held = bytearray(64 * 10**6)")
    assert (done.code, done.answers()) == (0, [{"a": 1}, {"b": [2]}])
    assert 64 < done.peak < 200 + process.resident(resource.getrusage(resource.RUSAGE_SELF))
    failed = python("raise ValueError('no such thing')")
    assert (failed.code, failed.problem) == (1, "error: ValueError: no such thing")
    assert python("import os; os._exit(7)").problem == "error: exit code 7"


def example(quick: bool) -> Data:
    """A run in which every cell of the plan takes the same time and memory."""
    records = {}
    for cell in plan(quick):
        for who in HAND.values() if cell.who == "hand" else [cell.who]:
            record = records.setdefault((who, cell.case, cell.links), new_record(who, cell.case, cell.links))
            if cell.case == "probe":
                names = {"threads": ["1", "2"], "peak": ["gflops", "most"]}.get(who, ["extra", "extra_new", "ns"])
                facts: dict[str, Any] = {"states": 10_000_000, "cores": 2, "lanes": 8}
            elif cell.case in ("cached", "virgin"):
                names, facts = ["seconds", "peak"], {}
            else:
                names, facts = ["ns", "best", "single", "build"], {"operations": {"+": 50, "sin": 5, "cos": 5}}
            for _ in range(cell.rounds):
                add(record, {"values": dict.fromkeys(names, 2.0), "facts": facts})
    names = ("cpu", "cores", "load", "system", "python", "compiler", "flags", "date", "commit")
    machine = {**dict.fromkeys(names, "x"), "packages": {}, "load_after": 0.0}
    return Data(
        {
            "records": list(records.values()),
            "arguments": {"quick": quick},
            "rounds": 1 if quick else 3,
            "minutes": 1.0,
            "machine": machine,
        }
    )


@pytest.mark.parametrize("quick", [False, True])
def test_every_target_is_measured(quick: bool) -> None:
    rows = targets.targets(example(quick))
    assert [row.what for row in rows if row.share is None] == []
    assert {row.ratio.partition(" ")[0] for row in rows} <= {"1.00", "0.25", "4.00", ""}
    assert len(rows) > 30
    short = ("≤ 700 ms", "≤ 1.50 s")  # of 2 s
    assert all(row.met is not (row.target.startswith("≥") or row.target in short) for row in rows)


def test_a_ratio_is_taken_within_a_round() -> None:
    """Medians of ratios 2, 1/2 and 2, not the ratio of the medians 4 and 4."""
    ours, theirs = (new_record(who, "rigid", 5) for who in ("ours", "heyoka"))
    for a, b in ((2, 1), (4, 8), (8, 4)):
        add(ours, {"values": {"ns": a, "best": a}})
        add(theirs, {"values": {"ns": b, "best": b}})
    data = Data({"records": [ours, theirs], "arguments": {"quick": False}})
    sides = Side("ours", "rigid", 5), Side("heyoka", "rigid", 5)
    row = compared(data, "batch", *sides, most=1.5)
    assert (row.measured, row.ratio, row.fastest) == ("4.00 ns / 4.00 ns", "2.00 × (0.50 – 2.00)", "2.00 ×")
    assert row.met is False
    assert compared(data, "batch", *sides, most=2.0).met is True
    assert compared(data, "batch", *sides, least=0.5).share == 1
    assert compared(data, "batch", *sides[::-1], least=2.5).met is False
    add(theirs, {"problem": "> 60 s"})
    row = compared(data, "batch", *sides, most=1.5)
    assert (row.measured, row.ratio, row.met) == ("heyoka: > 60 s", "–", None)


def test_the_page_says_what_failed() -> None:
    data = example(False)
    record = data.record("heyoka", "rigid", 5)
    assert record is not None
    add(record, {"problem": "not installed"})
    text = page.render(data)
    assert "heyoka: not installed" in text
    assert "* heyoka, 5 rigid links: not installed" in text
    assert f"take microseconds {report.whole(SOME)}" in text
    assert "10 000 000 states of 5 rigid links" in text


def test_the_page_in_results_is_that_of_its_json() -> None:
    data = Data(report.load(str(report.ROOT / "results" / "speed.json"), "speed"))
    assert page.render(data) == (report.ROOT / "results" / "speed.md").read_text(encoding="utf-8")


def test_the_picture_is_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    picture.plot(example(False), tmp_path / "speed.png")
    assert (tmp_path / "speed.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("value", "metric", "text"),
    [(999.4, "ns", "999 ns"), (999.6, "ns", "1.00 µs"), (0.5, "ns", "0.50 ns"), (61.0, "extra", "61.0 MB"),
     (0.35, "seconds", "350 ms"), (12.34, "build", "12.3 s")],
)  # fmt: skip
def test_amounts_have_the_unit_that_suits_them(value: float, metric: str, text: str) -> None:
    assert amount(value, metric) == text


def test_a_spread_is_in_the_unit_of_its_median() -> None:
    assert spread([900.0, 1500.0, 2000.0], "1.50 µs", "ns") == "1.50 µs (0.90 – 2.00)"
    assert spread([3.0], "3.00 ×") == "3.00 ×"


def test_probes_are_named() -> None:
    assert parse(["--probe", "memory", "1000", "c"]).probe == ["memory", "1000", "c"]
    with pytest.raises(OptionError, match="there is no probe 'memry'"):
        parse(["--probe", "memry"])
