"""Tests that take long, by name: those that repeat what others show, left to the day of a release, and others."""

from ivps import ALIKE

REPEATS = (
    "tests/cli/test_certify_command.py::test_a_library_is_certified_with_the_claims_that_are_stated_of_it",
    "tests/cli/test_diagnose_command.py::test_a_right_code_exits_0_and_what_cannot_show_is_said",
    "tests/cli/test_endings.py::test_a_disk_with_no_room_is_one_sentence_with_the_file[page]",
    "tests/cli/test_endings.py::test_ctrl_c_while_a_command_loads_is_one_sentence[0.25]",
    "tests/cli/test_endings.py::test_ctrl_c_while_a_command_loads_is_one_sentence[0.4166666666666667]",
    "tests/cli/test_endings.py::test_ctrl_c_while_a_command_loads_is_one_sentence[0.9166666666666666]",
    "tests/cli/test_json_keys.py::test_a_command_prints_the_documented_keys[precision planar_pendulum --case rotating --t-end 2 "
    "--methods rattle --repeat 0 --h 0.125,0.0625 --workers 1 --out out]",
    "tests/cli/test_practice.py::test_energy_is_kept_over_a_hundred_thousand_steps[double-pendulum]",
    "tests/cli/test_practice.py::test_energy_is_kept_over_a_hundred_thousand_steps[stretched-M]",
    "tests/cli/test_sensitivities_command.py::test_what_a_damped_system_received_varies_as_its_energy_does",
    "tests/compiler/test_kernels.py::test_machine_code_and_python_do_what_the_scheme_file_says[radau2_ggl on double-pendulum]",
    "tests/compiler/test_kernels.py::test_machine_code_and_python_do_what_the_scheme_file_says[radau2_ggl on planar]",
    "tests/compiler/test_kernels.py::test_machine_code_and_python_do_what_the_scheme_file_says[radau2_index2 on planar]",
    "tests/methods/test_chain_ida.py::test_two_hundred_links_swing_as_rattle_has_them[index2]",
    "tests/methods/test_compiled_formulations.py::test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8[baumgarte-0.0003]",
    "tests/methods/test_compiled_formulations.py::test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8[ode-0.003]",
    "tests/methods/test_ensemble_runs.py::test_a_member_whose_G_loses_rank_goes_on_as_its_own_run_does[stop]",
    "tests/methods/test_ensemble_runs.py::test_every_kind_of_problem_has_the_bits_of_its_own_run[torus]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[gauss2]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[generalized_alpha]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[lobatto3]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[radau2_ggl]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[rk4+symproj]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[stiff:midpoint]",
    "tests/methods/test_ensemble_runs.py::test_every_scheme_has_the_bits_of_its_own_run[symplectic_euler]",
    "tests/methods/test_ensemble_runs.py::test_members_with_weights_of_their_own_have_the_bits_of_runs_with_them",
    "tests/methods/test_finite.py::test_no_method_comes_to_the_end_of_a_run_beyond_the_end_of_the_motion[atanh-nothing]",
    "tests/methods/test_finite.py::test_no_method_comes_to_the_end_of_a_run_beyond_the_end_of_the_motion[mass-nothing]",
    "tests/methods/test_finite.py::test_no_method_comes_to_the_end_of_a_run_beyond_the_end_of_the_motion[momentum-nothing]",
    "tests/methods/test_gradient.py::test_a_functional_that_drops_imaginary_parts_is_differentiated_by_differences_with_a_warning[abs]",
    "tests/methods/test_gradient.py::test_the_gradient_over_a_hundred_thousand_steps_is_that_of_complex_step[spherical_pendulum]",
    "tests/methods/test_heyoka.py::test_it_gives_the_certified_motion[in-velocities]",
    "tests/methods/test_native_least_squares.py::test_both_kinds_of_callbacks_give_the_same_run_under_redundant_constraints[cvode:adams-1e-05]",
    "tests/methods/test_native_least_squares.py::test_both_kinds_of_callbacks_give_the_same_run_under_redundant_constraints[ida:ode-1e-05]",
    "tests/methods/test_native_least_squares.py::test_both_kinds_of_callbacks_give_the_same_run_under_redundant_constraints[ida:ode-1e-11]",
    "tests/methods/test_native_solvers.py::test_a_run_ends_in_the_same_way[rank loss]",
    "tests/methods/test_native_solvers.py::test_both_kinds_of_callbacks_give_the_same_run[slider_crank-cvode:bdf-1e-05]",
    "tests/methods/test_native_solvers.py::test_both_kinds_of_callbacks_give_the_same_run[slider_crank-cvode:bdf-1e-11]",
    "tests/methods/test_native_solvers.py::test_both_kinds_of_callbacks_give_the_same_run[spherical_pendulum-ida:ode-1e-05]",
    "tests/methods/test_native_solvers.py::test_both_kinds_of_callbacks_give_the_same_run[spherical_pendulum-ida:ode-1e-11]",
    "tests/methods/test_native_solvers.py::test_cold_and_warm_processes_and_three_at_once_agree",
    "tests/methods/test_projected_cvode.py::test_steps_end_on_the_manifold_and_follow_the_motion_written_by_hand[relativistic]",
    "tests/methods/test_redundant.py::test_solvers_move_as_without_what_is_redundant_and_share_the_force_of_constraint[cvode:bdf]",
    "tests/methods/test_redundant.py::test_solvers_move_as_without_what_is_redundant_and_share_the_force_of_constraint[ida:ode]",
    "tests/methods/test_redundant.py::test_solvers_move_as_without_what_is_redundant_and_share_the_force_of_constraint[scipy:DOP853]",
    "tests/methods/test_sensitivities.py::test_derivatives_at_the_start_are_those_of_starts_that_are_projected[p0]",
    "tests/methods/test_sensitivities.py::test_every_kind_of_problem_agrees_with_complex_step[slider_crank]",
    "tests/methods/test_sensitivities.py::test_every_scheme_agrees_with_complex_step[rk4+proj]",
    "tests/methods/test_sensitivities.py::test_poisson_systems_agree_with_complex_step[free_rigid_body-strang]",
    "tests/methods/test_sensitivities.py::test_poisson_systems_agree_with_complex_step[lotka_volterra-symplectic_euler]",
    "tests/methods/test_solver_steps.py::test_unknowns_are_named_and_in_their_order[chain]",
    "tests/methods/test_tangent_growth.py::test_the_tangent_is_that_of_the_discrete_scheme[free_rigid_body-hlw-lie]",
    "tests/methods/test_tangent_growth.py::test_the_tangent_is_that_of_the_discrete_scheme[planar_pendulum-horizontal-generalized_alpha]",
    "tests/methods/test_variational_equations.py::test_a_mass_matrix_that_moves_and_momenta_as_unknowns_are_differentiated[stretched-H]",
    "tests/methods/test_variational_equations.py::test_derivatives_are_those_of_fine_steps[double_pendulum-index1]",
    "tests/methods/test_variational_equations.py::test_derivatives_are_those_of_fine_steps[slider_crank-index2]",
    "tests/methods/test_variational_equations.py::test_derivatives_are_those_of_fine_steps[spherical_pendulum-ggl]",
    "tests/methods/test_variational_equations.py::test_derivatives_are_those_of_fine_steps[torus-baumgarte]",
    "tests/methods/test_variational_equations.py::test_derivatives_of_a_pendulum_are_those_of_its_closed_form[index2]",
    "tests/methods/test_variational_equations.py::test_poisson_systems_are_differentiated_and_so_are_the_values_that_are_kept[casimirs]",
    "tests/methods/test_variational_equations.py::test_poisson_systems_are_differentiated_and_so_are_the_values_that_are_kept[ode]",
    "tests/pages/test_browser_gallery.py::test_a_page_fits_light_and_dark_narrow_and_wide[1200-dark]",
    "tests/problems/test_car_axis.py::test_schemes_reach_the_published_end_at_their_order[lobatto3-4]",
    "tests/problems/test_driven_slider_crank.py::test_schemes_keep_their_order_on_a_mechanism_that_is_driven_and_damped[lobatto3-4]",
    "tests/problems/test_mechanisms.py::test_ida_brings_the_squeezer_where_the_certified_reference_says[ida:index2]",
    "tests/problems/test_slider_crank_sundials.py::test_ida_has_the_same_gradient",
    "tests/reports/test_engines_report.py::test_an_adapter_poses_the_motion_of_the_problem[Mici, constrained leapfrog on chain10]",
    "tests/schemes/test_lobatto.py::test_machine_code_does_what_the_files_say_where_the_mass_depends_on_q[radau2_ggl]",
    "tests/schemes/test_ode_schemes.py::test_machine_code_does_what_the_files_say[local:midpoint]",
    "tests/schemes/test_ode_schemes.py::test_machine_code_does_what_the_files_say[midpoint+symproj]",
    "tests/schemes/test_ode_schemes.py::test_machine_code_does_what_the_files_say[stiff:midpoint]",
    "tests/schemes/test_schemes.py::test_order_is_as_claimed[energy_momentum-butane]",
    "tests/schemes/test_schemes.py::test_order_is_as_claimed[radau2_ggl-andrews_squeezer]",
    "tests/schemes/test_splitting.py::test_the_manifold_is_kept_over_long_runs[rotation-with-forces]",
    "tests/studies/test_certificate.py::test_the_claims_that_a_mistake_breaks_are_the_ones_that_do_not_hold[massless]",
    "tests/studies/test_certificate.py::test_the_claims_that_a_mistake_breaks_are_the_ones_that_do_not_hold[sign]",
    "tests/studies/test_chaos.py::test_false_rates_on_known_answers",
    "tests/studies/test_diagnose.py::test_effects_are_what_is_measured[old_force on butane]",
    "tests/starts/test_distributions.py::"
    "test_an_ensemble_of_one_energy_has_the_same_distribution_after_a_run_and_one_of_another_measure_has_not",
    "tests/starts/test_distributions.py::test_a_member_is_the_same_however_many_there_are[energy]",
    "tests/starts/test_distributions.py::test_a_walk_on_an_oval_with_a_waist_is_uniform_along_it",
    "tests/starts/test_distributions.py::test_angles_of_one_energy_are_those_of_a_pendulum_seen_at_random_times[nearly-over]",
    "tests/studies/test_energy_of_runs.py::test_no_bound_of_another_method_is_violated_by_a_run_four_times_as_long[generalized_alpha-rotating]",
    "tests/studies/test_energy_of_runs.py::test_no_bound_of_another_method_is_violated_by_a_run_four_times_as_long[radau2_ggl-rotating]",
    "tests/studies/test_energy_of_runs.py::test_no_bound_of_another_method_is_violated_by_a_run_four_times_as_long[scipy:Radau-fast swing]",
    "tests/studies/test_extremes.py::test_no_name_of_a_parameter_changes_what_ida_solves[lam1]",
    "tests/studies/test_extremes.py::test_no_name_of_a_parameter_changes_what_ida_solves[v1]",
    "tests/studies/test_kept_ensembles.py::test_a_dask_cluster_makes_the_bits_of_one_process",
    "tests/studies/test_long.py::test_an_ensemble_that_is_ended_in_any_way_goes_on_to_the_same_bits[kill, term, ctrl-c]",
    "tests/studies/test_long_in_lanes.py::test_members_in_lanes_have_the_bits_of_runs_by_themselves[local]",
    "tests/studies/test_long_in_lanes.py::test_members_whose_G_loses_rank_go_on_by_themselves[stop]",
    "tests/studies/test_work_precision.py::test_the_command_says_what_errors_are_against[no reference]",
    "tests/systems/test_chains.py::test_a_hundred_thousand_links_take_their_steps",
    "tests/systems/test_chains.py::test_compiled_loops_keep_the_number_type_of_the_run",
    "tests/systems/test_chains.py::test_functions_are_those_of_the_system_written_out[four_bar]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:baumgarte---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:ggl---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:index1---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:index3---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[ida:ode---driven_and_forced]",
    "tests/systems/test_in_time.py::test_a_driven_pendulum_is_that_of_its_angle[lobatto4---driven_and_forced]",
    "tests/systems/test_in_time.py::test_the_multiplier_of_positions_does_not_act_on_the_time[radau3_ggl-5]",
    "tests/systems/test_in_time.py::test_what_is_symplectic_stays_symplectic_in_time[lobatto3]",
    "tests/systems/test_in_time.py::test_what_is_symplectic_stays_symplectic_in_time[rattle/suzuki4]",
    "tests/systems/test_lattice.py::test_a_step_is_the_same_by_loops_and_by_straight_lines[darboux:midpoint]",
    "tests/systems/test_lattice.py::test_a_step_is_the_same_by_loops_and_by_straight_lines[darboux:verlet]",
    "tests/systems/test_lattice.py::test_kernels_of_splittings_hold_no_matrix_and_take_any_number_of_sites",
    "tests/systems/test_own_problem.py::test_every_command_that_takes_a_problem_takes_a_file[bench]",
)
"""Their names, as pytest has them."""

LONG = (
    "tests/cli/test_certify_command.py::test_a_certificate_replaces_another_one_and_nothing_else",
    "tests/cli/test_command_line.py::test_run_on_the_tolerance_driven_side_agrees_with_rattle",
    "tests/compiler/test_kernels.py::test_several_processes_may_compile_the_same_kernel_at_once",
    "tests/joints/test_points.py::test_a_long_chain_has_names_up_to_a_number_of_nodes",
    "tests/methods/test_ensemble_runs.py::test_of_three_equal_weights_at_the_ends_those_of_order_4_are_the_most_accurate",
    "tests/methods/test_gradient.py::test_a_functional_that_drops_imaginary_parts_is_differentiated_by_differences_with_a_warning[real]",
    "tests/methods/test_gradient.py::test_a_run_that_stops_has_no_gradient",
    "tests/methods/test_gradient.py::test_the_gradient_by_initial_values_is_a_vector_along_the_manifold",
    "tests/methods/test_native_least_squares.py::test_a_run_ends_in_the_same_way_where_a_value_is_no_longer_finite",
    "tests/methods/test_native_solvers.py::test_a_long_chain_has_an_analytic_band",
    "tests/methods/test_native_solvers.py::test_what_is_followed_through_a_loss_of_rank_is_the_same",
    "tests/methods/test_projected_cvode.py::test_a_run_beyond_the_end_of_the_motion_does_not_come_to_its_end",
    "tests/methods/test_sensitivities.py::test_a_start_that_leaves_the_manifold_is_put_back_on_it_and_the_run_stays_there",
    "tests/methods/test_sensitivities.py::test_parameters_in_the_expressions_of_a_start_are_differentiated",
    "tests/methods/test_sensitivities.py::test_rattle_agrees_with_complex_step_to_the_bits_of_its_values",
    "tests/reports/test_engines_report.py::test_the_vertical_seen_from_the_top_is_that_of_its_certified_motion",
    "tests/studies/test_advise.py::test_a_start_moves_onto_the_manifold_that_other_parameters_make",
    "tests/starts/test_distributions.py::test_angles_of_a_double_pendulum_of_one_energy_are_those_of_quadrature",
    "tests/starts/test_distributions.py::test_states_in_a_box_are_those_that_are_uniform_in_angles_and_their_momenta",
    "tests/studies/test_ensemble.py::test_starts_of_one_energy_have_it_and_parameters_vary_within_their_bounds",
)
"""Tests that no other one repeats, and that take long: the gate runs them among the slow ones."""

_OF_EACH_KIND = ("rattle", "shake", "lobatto3", "gauss2", "radau2_ggl", "energy_momentum", "se", "rk4")

SAMPLED = {
    "tests/cli/test_practice.py::test_machine_code_gives_the_same_and_keeps_float32": lambda case: case.startswith("energy_momentum"),
    "tests/cli/test_endings.py::test_lists_are_printed_in_whatever_encoding_there_is": lambda case: "ASCII" in case or case == "list-DOS",
    "tests/compiler/test_kernels.py::test_machine_code_and_python_do_what_the_scheme_file_says": lambda case: (
        not case.startswith(("ggl_vi", "implicit", "lie", "livens", "rattle_g", "rattle_i", "rk4", "seproj", "symplectic_euler_"))
        and not case.startswith(
            ("radau2_index2", "radau2_ggl on st", "se on ", "gauss2 on st", "gauss3", "lobatto2 on s", "lobatto4 on s", "midpoint on d")
        )
    ),
    "tests/compiler/test_printed.py::test_c_compiles_without_a_warning_and_gives_the_same": lambda case: case not in ALIKE,
    "tests/compiler/test_printed.py::test_python_gives_the_numbers_of_daebench_itself": lambda case: case not in ALIKE,
    "tests/methods/test_chain_ida.py::test_residual_and_start_are_those_of_the_system_written_out": lambda case: (
        case.startswith("one node") or case.endswith(("index3", "ggl"))
    ),
    "tests/methods/test_formulations.py::test_residual_vanishes_at_the_start": lambda case: (
        not case.startswith("butane") or case.endswith(("index3-plain", "ggl-derivative"))
    ),
    "tests/methods/test_rescaling.py::test_a_motion_has_the_same_digits_in_other_units": lambda case: (
        case.endswith("-fast") or case.startswith(_OF_EACH_KIND)
    ),
    "tests/reports/test_engines_report.py::test_an_adapter_poses_the_motion_of_the_problem": lambda case: (
        "Mici" not in case or case.endswith(("pendulum", "slider"))
    ),
    "tests/reports/test_engines_report.py::test_the_energy_of_the_engine_is_that_of_daebench_up_to_a_constant": lambda case: (
        "Mici" not in case or case.endswith(("pendulum", "slider"))
    ),
    "tests/schemes/test_lobatto.py::test_lobatto_is_symplectic_reversible_and_on_the_manifold_at_large_steps": lambda case: (
        case.startswith(("lobatto2", "lobatto3")) or case.endswith(("spherical-fast", "coupled-rods"))
    ),
    "tests/studies/test_diagnose.py::test_a_scheme_of_daebench_is_never_accused": lambda case: case in _OF_EACH_KIND,
}
"""Tests with many cases, and whether the gate runs one of them, by its name: the others are for the day of a release."""

PLACES = ("planar", "slider_crank", "stretched-H", "torus", "two_bodies_on_sphere")
"""Initial value problems that the gate sweeps over a scheme of each kind only."""
