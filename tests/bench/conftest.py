"""The benchmarks are scripts, run by hand: no tests, and nothing to import."""

collect_ignore_glob = ["*.py"]
