"""Tests that repeat for one more case what others show, and take long: for the day of a release, as those marked in their files."""

REPEATS = (
    "tests/cli/test_certify_command.py::test_a_library_is_certified_with_the_claims_that_are_stated_of_it",
    "tests/cli/test_endings.py::test_a_disk_with_no_room_is_one_sentence_with_the_file[page]",
    "tests/methods/test_compiled_formulations.py::test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8[baumgarte-0.0003]",
    "tests/methods/test_compiled_formulations.py::test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8[ode-0.003]",
    "tests/methods/test_ensemble_runs.py::test_a_member_whose_G_loses_rank_goes_on_as_its_own_run_does[stop]",
    "tests/methods/test_ensemble_runs.py::test_members_with_weights_of_their_own_have_the_bits_of_runs_with_them",
    "tests/methods/test_finite.py::test_no_method_comes_to_the_end_of_a_run_beyond_the_end_of_the_motion[atanh-nothing]",
    "tests/methods/test_redundant.py::test_solvers_move_as_without_what_is_redundant_and_share_the_force_of_constraint[ida:ode]",
    "tests/methods/test_sensitivities.py::test_derivatives_at_the_start_are_those_of_starts_that_are_projected[p0]",
    "tests/methods/test_variational_equations.py::test_derivatives_of_a_pendulum_are_those_of_its_closed_form[index2]",
    "tests/pages/test_lessons.py::test_a_notebook_is_a_plain_script_too[extremes]",
    "tests/pages/test_lessons.py::test_the_controls_of_a_lesson_answer_with_a_picture_and_with_words[extremes]",
    "tests/problems/test_car_axis.py::test_schemes_reach_the_published_end_at_their_order[lobatto3-4]",
    "tests/problems/test_driven_slider_crank.py::test_schemes_keep_their_order_on_a_mechanism_that_is_driven_and_damped[lobatto3-4]",
    "tests/studies/test_distributions.py::test_a_member_is_the_same_however_many_there_are[energy]",
    "tests/studies/test_distributions.py::test_a_walk_on_an_oval_with_a_waist_is_uniform_along_it",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:baumgarte---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:index1---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:index3---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:ode---driven_and_forced]",
    "tests/systems/test_in_time.py::test_what_is_symplectic_stays_symplectic_in_time[rattle]",
)
"""Their names, as pytest has them."""

PLACES = ("planar", "slider_crank", "stretched-H", "torus", "two_bodies_on_sphere")
"""Initial value problems that the gate sweeps over a scheme of each kind only."""
