"""Options of the test run."""

import os
import shutil
import signal
import tempfile
import zlib
from collections import Counter

from hypothesis import settings

try:
    from hypothesis.internal.conjecture import providers
except ImportError:  # an older one, which draws from no module's constants
    providers = None

# As many processes as cores run tests: threads of their linear algebra would wait for each other.
# Set before numpy is imported here, and for the commands that tests start.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# What a shell starts in the background ignores interrupts, and so would the commands of the tests.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

USUAL = 60
"""Examples of a property test that does not say how many."""
LONG = 250
"""How many times more examples `--long` draws."""

SHARE = 8
"""One in how many repeats `--repeats-of` takes."""


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
    config.cases = Counter()
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
    parser.addoption(
        "--repeats-of",
        metavar="NAME",
        help=f"of the tests with the mark `repeats`, one in {SHARE}: which ones, NAME decides",
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
NOT_QUICK = (
    *("test_what_does_not_end", "test_measured_spectra", "test_a_series_runs_on_over_chunks"),
    "test_shortest_is_written_only_where",
)
"""Beginnings of names of their tests that take seconds."""

REPEATS = {
    "clients/test_cycles_playback.py": {
        "test_holes_are_as_deep_and_ways_as_high_as_in_the_controllers_own_cycles": 2,
    },
    "clients/test_freecad.py": {
        "test_a_job_is_posted_with_a_stock_post_and_its_rapids_rewritten": 2,
    },
    "clients/test_interpreter_processing.py": {
        "test_interpreter_finds_the_same_end_points_before_and_after": 4,
    },
    "clients/test_interpreter_reading.py": {
        "test_every_real_file_reads_as_the_interpreter_runs_it": 2,
    },
    "clients/test_linuxcnc_guard.py": {
        "test_elsewhere_the_rapids_are_those_of_the_program": 3,
        "test_what_a_guard_costs": 2,
    },
    "clients/test_linuxcnc_hal.py": {
        "test_a_feeder_that_dies_stops_the_machine_in_front_of_the_next_rapid": 2,
        "test_a_machine_that_is_switched_off_in_a_stream_stays_where_it_stops": 2,
        "test_behind_an_abort_the_program_runs_from_its_start": 2,
        "test_behind_run_from_line_the_machine_stands_at_the_first_stream": 2,
        "test_feed_hold_and_override_keep_the_limits_and_the_ends": 2,
        "test_without_its_file_of_samples_nothing_moves": 2,
    },
    "clients/test_linuxcnc_playback.py": {
        "test_what_is_played_is_what_was_reported": 2,
    },
    "clients/test_page_browser.py": {
        "test_a_click_on_the_path_chooses_and_both_themes_are_drawn": 2,
    },
    "corpus/test_corpus.py": {
        "test_every_real_program_is_processed_and_verified": 4,
    },
    "golden/test_sheets.py": {
        "test_sheet_is_the_golden_one": 6,
    },
    "property/test_control_settings.py": {
        "test_without_the_inserted_lines_a_program_is_what_it_was": 4,
    },
    "property/test_every_control.py": {
        "test_nothing_is_written_that_its_proof_refuses": 4,
        "test_what_is_drawn_is_rewritten": 4,
    },
    "property/test_families.py": {
        "test_a_stepped_simulation_leaves_as_much": 3,
    },
    "property/test_linuxcnc_hal.py": {
        "test_every_pair_is_accepted_and_shortened_samples_are_not": 2,
    },
    "property/test_never_worse.py": {
        "test_no_written_rapid_is_worse_than_the_control_s_own": 3,
    },
    "property/test_never_worse_rows.py": {
        "test_no_rows_are_worse_than_the_control_s_own_rapid": 2,
    },
    "property/test_profiles.py": {
        "test_every_profile_keeps_what_it_promises": 4,
    },
    "property/test_programs.py": {
        "test_programs_are_drawn_for_every_dialect_that_has_streams": 3,
    },
    "property/test_reading.py": {
        "test_quick_and_careful_reading_agree_behind_a_shift_of_the_frame": 4,
    },
    "property/test_rows_damage.py": {
        "test_a_file_that_ends_behind_any_line_is_found": 3,
        "test_any_changed_byte_is_found": 3,
    },
    "property/test_second_reading.py": {
        "test_the_second_reading_agrees_on_real_files": 3,
        "test_the_second_reading_agrees_on_the_examples_of_linuxcnc": 0,
        "test_the_second_reading_agrees_with_the_first": 6,
    },
    "property/test_verify_damage.py": {
        "test_every_damage_is_noticed": 15,
    },
    "property/test_verify_outputs.py": {
        "test_every_output_is_accepted_whatever_profile_todays_rapids_follow": 4,
        "test_every_output_of_every_dialect_is_accepted": 6,
    },
    "property/test_verify_profiles.py": {
        "test_damage_is_noticed_on_every_profile": 10,
        "test_most_feeds_changed_by_one_percent_are_noticed": 9,
        "test_outputs_on_drawn_machines_are_accepted": 5,
        "test_outputs_on_shipped_machines_are_accepted": 4,
    },
    "unit/test_amplitude_map.py": {
        "test_nothing_within_the_limits_is_much_better_than_the_choice": 4,
    },
    "unit/test_batch_files.py": {
        "test_a_kill_at_any_moment_leaves_no_half_file": 0,
    },
    "unit/test_batch_jobs.py": {
        "test_a_folder_is_processed_into_another_one_with_its_tree": 2,
        "test_asked_to_end_it_ends_quietly_and_leaves_nothing_half_written": 5,
        "test_check_of_many_writes_nothing": 2,
        "test_failures_of_every_kind_stop_nobody_else": 2,
        "test_programs_that_freecad_posts_go_through_in_one_run": 0,
    },
    "unit/test_cli_compare.py": {
        "test_a_measured_spectrum_is_compared_and_drawn": 0,
        "test_a_picture_as_pdf": 0,
        "test_a_picture_as_svg_names_what_it_shows": 0,
        "test_a_picture_shows_something": 4,
    },
    "unit/test_cli_map.py": {
        "test_a_picture_as_pdf": 0,
        "test_a_picture_as_svg_names_what_it_shows": 0,
        "test_a_picture_is_a_png_that_shows_something": 2,
        "test_the_maps_of_all_conditions_are_one_picture": 3,
    },
    "unit/test_comparison.py": {
        "test_settling_is_where_a_simulated_envelope_stays_below_the_tolerance": 4,
        "test_worst_in_band_is_that_of_a_dense_scan": 3,
    },
    "unit/test_control_settings.py": {
        "test_an_old_shaper_that_nobody_states_is_refused": 3,
        "test_an_old_value_that_the_control_does_not_take_is_refused": 3,
    },
    "unit/test_cycles_controls.py": {
        "test_a_writer_that_does_not_doubt_is_found_out": 4,
    },
    "unit/test_designs.py": {
        "test_measured_spectra_go_through_every_design": 8,
    },
    "unit/test_emit_points.py": {
        "test_rows_are_proven_whatever_the_controls_own_rapids_follow": 5,
    },
    "unit/test_faults.py": {
        "test_a_disk_that_fills_up_leaves_the_old_output": 3,
        "test_a_disk_that_is_full_for_a_process_leaves_nothing": 3,
        "test_killed_at_drawn_moments_a_batch_leaves_whole_files_only": 0,
        "test_killed_before_any_call_to_the_system_it_leaves_no_half_file": 4,
        "test_two_in_place_runs_at_once_leave_one_whole_program": 0,
    },
    "unit/test_figures.py": {
        "test_a_comparison_shows_every_axis_with_no_word_over_another_or_over_a_line": 5,
        "test_a_simulation_is_readable_whatever_frequencies_it_spans": 3,
        "test_no_word_of_a_map_stands_over_another": 3,
        "test_no_word_of_three_maps_stands_over_another": 6,
    },
    "unit/test_filters.py": {
        "test_a_stepped_simulation_leaves_as_much": 3,
    },
    "unit/test_freecad_post.py": {
        "test_the_class_rewrites_each_section_and_gives_the_arguments_back": 2,
    },
    "unit/test_fuzzing.py": {
        "test_a_harness_finds_nothing_in_a_few_hundred_inputs": 8,
    },
    "unit/test_hosts.py": {
        "test_each_host_names_this_command_and_the_machine": 4,
    },
    "unit/test_jobs_of_one.py": {
        "test_a_run_that_is_cut_leaves_nothing_half_written_and_nobody_behind": 0,
        "test_sections_find_what_the_whole_does": 2,
        "test_the_same_bytes_with_one_process_and_with_three": 8,
    },
    "unit/test_machine_document.py": {
        "test_a_hostile_text_is_refused_without_being_expanded": 15,
    },
    "unit/test_motion_candidates.py": {
        "test_cascades_of_candidates_leave_what_their_profiles_do": 5,
        "test_symmetric_candidates_leave_what_their_profiles_do": 5,
    },
    "unit/test_motion_optimal.py": {
        "test_a_move_of_many_seconds_asks_no_programme_that_takes_minutes": 3,
    },
    "unit/test_motion_ramps.py": {
        "test_designs_are_legal_and_never_worse_than_the_stretched_conventional_profile": 3,
        "test_designs_are_near_the_best_that_brute_force_finds": 4,
    },
    "unit/test_motion_refining.py": {
        "test_a_long_move_is_left_with_no_more_than_jerks_in_every_interval_leave": 2,
    },
    "unit/test_motion_together.py": {
        "test_no_profile_leaves_less_at_the_last_arrival_than_is_stated": 2,
    },
    "unit/test_nc_branches.py": {
        "test_deep_nesting_takes_linear_time": 3,
    },
    "unit/test_nc_common.py": {
        "test_what_is_certain_is_so_for_each_of_them": 6,
    },
    "unit/test_nc_o_words.py": {
        "test_what_does_not_end_is_left_alone": 2,
    },
    "unit/test_nc_reading_two_ways.py": {
        "test_both_ways_agree_on_an_odd_line_anywhere_in_a_run": 3,
        "test_both_ways_agree_on_every_odd_line_in_a_run": 3,
        "test_both_ways_agree_on_every_real_file": 14,
    },
    "unit/test_nc_without_feed.py": {
        "test_the_quick_way_and_the_careful_one_leave_the_same": 5,
    },
    "unit/test_parameters.py": {
        "test_the_search_finds_what_brute_force_finds": 12,
    },
    "unit/test_path_limits.py": {
        "test_verify_accepts_what_is_planned_by_every_law": 3,
    },
    "unit/test_planning_pvt.py": {
        "test_an_optimum_of_many_segments_is_rows_too": 0,
    },
    "unit/test_resolution.py": {
        "test_points_are_whole_steps_that_the_control_keeps": 5,
    },
    "unit/test_same_streams.py": {
        "test_what_is_written_once_or_each_time_is_the_same": 3,
    },
    "unit/test_second_ahead.py": {
        "test_lines_by_variables_taken_at_once_do_what_they_do_one_by_one": 2,
    },
    "unit/test_simulation.py": {
        "test_pictures_are_drawn": 2,
    },
    "unit/test_stamp_options.py": {
        "test_options_need_not_be_repeated": 3,
    },
    "unit/test_storage.py": {
        "test_outputs_and_reports_do_not_depend_on_where_columns_are": 3,
    },
    "unit/test_terminal.py": {
        "test_a_map_of_a_measured_spectrum": 0,
    },
    "unit/test_verify_alike.py": {
        "test_one_damaged_stream_among_hundreds_alike_is_found": 4,
    },
    "unit/test_verify_laws.py": {
        "test_both_have_the_same_rapids": 5,
        "test_what_is_written_for_such_a_machine_is_proven": 5,
    },
}
"""Tests of many cases of a kind: which one in how many comes before a change lands; 0 is none of
them, where a cheaper test holds the kind. A stride that divides how many values a parameter has
never comes to some of them, which may be kinds: take one that does not. CI runs a share of these,
another one of each change."""


def pytest_itemcollected(item):
    module = item.path.as_posix().rpartition("/tests/")[2]
    test = getattr(item, "originalname", item.name)
    count = item.config.cases[module, test]
    item.config.cases[module, test] += 1
    every = REPEATS.get(module, {}).get(test, 1)
    if not every or count % every:
        item.add_marker("repeats")
    elif module in QUICK and not item.name.startswith(NOT_QUICK):
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
    name = config.getoption("--repeats-of")
    if name is not None:
        parts = ([], [])
        for item in items:
            other = zlib.crc32(f"{name} {item.nodeid}".encode()) % SHARE
            parts[bool(other and item.get_closest_marker("repeats"))].append(item)
        items[:], left = parts
        config.hook.pytest_deselected(items=left)
    if not config.getoption("--long"):
        return
    for item in items:
        test = getattr(getattr(item, "obj", None), "hypothesis", None)
        own = getattr(item.obj, "_hypothesis_internal_use_settings", None)
        if test is not None and own is not None:
            examples = LONG * own.max_examples
            item.obj._hypothesis_internal_use_settings = settings(own, max_examples=examples)
