"""Benchmark suites, run by `eomgen bench SUITE` in a checkout; every ``bench/*.py`` with a ``main`` is one."""
