"""Options of the test run."""

import os
import shutil
import tempfile
import zlib

from hypothesis import settings

try:
    from hypothesis.internal.conjecture import providers
except ImportError:  # an older one, which draws from no module's constants
    providers = None

# As many processes as cores run tests: threads of their linear algebra would wait for each other.
# Set before numpy is imported here, and for the commands that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

USUAL = 60
"""Examples of a property test that does not say how many."""
LONG = 250
"""How many times more examples `--long` draws."""


def pytest_configure(config):
    # How long an example takes says what else the machine does, not what the package does.
    settings.register_profile("untimed", deadline=None, max_examples=USUAL)
    settings.load_profile("untimed")
    if not explores(config) and hasattr(providers, "_get_local_constants"):
        # Hypothesis draws from the constants of all modules that happen to be imported by then:
        # what a test draws, and how long it takes, would depend on the tests in front of it.
        none = providers.Constants()
        providers._get_local_constants = lambda: none
    # No test reads or fills the user's own cache of solutions.
    config.cache_folder = tempfile.mkdtemp(prefix="gcodejerk-cache-")
    os.environ["GCODEJERK_CACHE"] = config.cache_folder
    # The first command that tests start compiles our modules; hundreds after it need not.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_unconfigure(config):
    shutil.rmtree(config.cache_folder, ignore_errors=True)


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write tests/golden/*/out.* anew; their difference is reviewed like code",
    )
    parser.addoption(
        "--explore",
        action="store_true",
        help="draw other examples in property tests than every usual run does",
    )
    parser.addoption(
        "--long",
        action="store_true",
        help=f"draw {LONG} times as many examples in property tests, and take all of what other "
        "tests take in strides: hours, on demand",
    )


QUICK = (
    *("unit/test_nc_program.py", "unit/test_nc_o_words.py", "unit/test_nc_tokenizer.py"),
    *("unit/test_nc_dialects.py", "unit/test_nc_expressions.py", "unit/test_nc_subprograms.py"),
    *("unit/test_cycles_expansion.py", "unit/test_cycles_drilling.py"),
    *(
        "unit/test_motion_residual.py",
        "unit/test_motion_condition3.py",
        "unit/test_motion_cascade.py",
    ),
    *("unit/test_motion_maps.py", "unit/test_motion_sampling.py", "unit/test_motion_symmetric.py"),
    *("unit/test_machine_loader.py", "unit/test_machine_model.py", "unit/test_machine_schema.py"),
    *("unit/test_plan.py", "unit/test_move.py", "unit/test_stream.py", "unit/test_designs.py"),
    *("unit/test_emit_base.py", "unit/test_emit_linuxcnc.py", "unit/test_emit_csv.py"),
    *("unit/test_verify.py", "unit/test_verify_cycles.py", "unit/test_order_of_words.py"),
    *("unit/test_rewrite_pipeline.py", "unit/test_rewrite_expanded.py", "unit/test_report.py"),
    *("unit/test_batch_inputs.py", "unit/test_cli_map.py", "unit/test_cli_outputs.py"),
    *("unit/test_amplitude_map.py", "unit/test_layers.py", "golden/test_golden.py"),
)
"""Modules of the quick tests, below this folder: some of every room."""
NOT_QUICK = ("test_what_does_not_end", "test_measured_spectra", "test_a_series_runs_on_over_chunks")
"""Beginnings of names of their tests that take seconds."""


def pytest_itemcollected(item):
    module = item.path.as_posix().rpartition("/tests/")[2]
    if module in QUICK and not item.name.startswith(NOT_QUICK):
        item.add_marker("quick")


def explores(config):
    """Whether the run draws what every usual one does not."""
    return config.getoption("--long") or config.getoption("--explore")


def pytest_runtest_setup(item):
    # A change is judged by the same draws wherever its tests run; what they do not come to, the
    # runs that explore do, each of which draws others. Parts of a test draw by their own names.
    test = getattr(item, "obj", None)
    if hasattr(test, "hypothesis") and not explores(item.config):
        test._hypothesis_internal_use_seed = zlib.crc32(item.nodeid.encode())


def pytest_collection_modifyitems(config, items):
    if not config.getoption("--long"):
        return
    for item in items:
        test = getattr(getattr(item, "obj", None), "hypothesis", None)
        own = getattr(item.obj, "_hypothesis_internal_use_settings", None)
        if test is not None and own is not None:
            examples = LONG * own.max_examples
            item.obj._hypothesis_internal_use_settings = settings(own, max_examples=examples)
