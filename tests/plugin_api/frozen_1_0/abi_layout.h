/*
 * The layout of version 1.0: sizes, places and values of everything in relign/plugin.h on a 64-bit
 * machine. Of the frozen copy they hold exactly (RELIGN_LAYOUT_IS_EXACT); of the tree's header too,
 * whose structs may be longer. This file fails to compile where one of them moves. Nobody edits it.
 *
 * Included from C11 and from C++17.
 */
#ifndef RELIGN_TESTS_ABI_LAYOUT_H
#define RELIGN_TESTS_ABI_LAYOUT_H

#include <relign/plugin.h>
#include <stddef.h>

#ifdef __cplusplus
#define ABI_ASSERT(condition, text) static_assert(condition, text)
#else
#define ABI_ASSERT(condition, text) _Static_assert(condition, text)
#endif
/* clang-format off */
#ifdef RELIGN_LAYOUT_IS_EXACT
#define ABI_SIZE(type, bytes) ABI_ASSERT(sizeof(type) == (bytes), "the size of " #type " changed");
#else
#define ABI_SIZE(type, bytes) ABI_ASSERT(sizeof(type) >= (bytes), #type " lost members");
#endif
#define ABI_OFFSET(type, member, bytes) ABI_ASSERT(offsetof(type, member) == (bytes), #type "::" #member " moved");
#define ABI_VALUE(name, value) ABI_ASSERT((name) == (value), #name " changed");

ABI_VALUE(RELIGN_ABI_MAJOR, 1)
ABI_VALUE(RELIGN_OK, 0)
ABI_VALUE(RELIGN_STOP, 1)
ABI_VALUE(RELIGN_FAILED, -1)
ABI_VALUE(RELIGN_BAD_ARGUMENT, -2)
ABI_VALUE(RELIGN_UNSUPPORTED, -3)
ABI_VALUE(RELIGN_SAMPLE_FLOAT32, 1)
ABI_VALUE(RELIGN_LOG_DEBUG, 0)
ABI_VALUE(RELIGN_LOG_INFO, 1)
ABI_VALUE(RELIGN_LOG_WARNING, 2)
ABI_VALUE(RELIGN_OBSERVES_IMAGES, 1 << 0)
ABI_VALUE(RELIGN_OBSERVES_MERIT, 1 << 1)
ABI_VALUE(RELIGN_OBSERVES_START, 1 << 2)
ABI_VALUE(RELIGN_OBSERVES_BOX, 1 << 3)
ABI_VALUE(RELIGN_OBSERVES_DESIGN, 1 << 4)
ABI_VALUE(RELIGN_OBSERVES_LEVEL, 1 << 5)

ABI_VALUE(sizeof(relign_text), 16) /* has no struct_size: it can never grow */
ABI_OFFSET(relign_text, data, 0)
ABI_OFFSET(relign_text, size, 8)

ABI_SIZE(relign_text_sink, 24)
ABI_OFFSET(relign_text_sink, struct_size, 0)
ABI_OFFSET(relign_text_sink, reserved, 4)
ABI_OFFSET(relign_text_sink, context, 8)
ABI_OFFSET(relign_text_sink, write, 16)

ABI_SIZE(relign_image, 40)
ABI_OFFSET(relign_image, struct_size, 0)
ABI_OFFSET(relign_image, sample_format, 4)
ABI_OFFSET(relign_image, width, 8)
ABI_OFFSET(relign_image, height, 12)
ABI_OFFSET(relign_image, channels, 16)
ABI_OFFSET(relign_image, reserved, 20)
ABI_OFFSET(relign_image, pixels, 24)
ABI_OFFSET(relign_image, row_stride_bytes, 32)

ABI_SIZE(relign_host, 80)
ABI_OFFSET(relign_host, struct_size, 0)
ABI_OFFSET(relign_host, abi_major, 4)
ABI_OFFSET(relign_host, abi_minor, 8)
ABI_OFFSET(relign_host, threads, 12)
ABI_OFFSET(relign_host, context, 16)
ABI_OFFSET(relign_host, plugin_folder, 24)
ABI_OFFSET(relign_host, cache_folder, 40)
ABI_OFFSET(relign_host, fail, 56)
ABI_OFFSET(relign_host, log, 64)
ABI_OFFSET(relign_host, get_extension, 72)

ABI_SIZE(relign_parameters, 64)
ABI_OFFSET(relign_parameters, struct_size, 0)
ABI_OFFSET(relign_parameters, reserved, 4)
ABI_OFFSET(relign_parameters, context, 8)
ABI_OFFSET(relign_parameters, json, 16)
ABI_OFFSET(relign_parameters, number, 32)
ABI_OFFSET(relign_parameters, integer, 40)
ABI_OFFSET(relign_parameters, boolean, 48)
ABI_OFFSET(relign_parameters, text, 56)

ABI_SIZE(relign_task, 72)
ABI_OFFSET(relign_task, struct_size, 0)
ABI_OFFSET(relign_task, axes, 4)
ABI_OFFSET(relign_task, budget, 8)
ABI_OFFSET(relign_task, observes, 12)
ABI_OFFSET(relign_task, seed, 16)
ABI_OFFSET(relign_task, box_lower, 24)
ABI_OFFSET(relign_task, box_upper, 32)
ABI_OFFSET(relign_task, largest_move, 40)
ABI_OFFSET(relign_task, image_width, 48)
ABI_OFFSET(relign_task, image_height, 52)
ABI_OFFSET(relign_task, axes_json, 56)

ABI_SIZE(relign_observation, 56)
ABI_OFFSET(relign_observation, struct_size, 0)
ABI_OFFSET(relign_observation, step, 4)
ABI_OFFSET(relign_observation, pose, 8)
ABI_OFFSET(relign_observation, merit, 16)
ABI_OFFSET(relign_observation, limits_low, 24)
ABI_OFFSET(relign_observation, limits_high, 32)
ABI_OFFSET(relign_observation, image, 40)
ABI_OFFSET(relign_observation, machine_seconds, 48)

ABI_SIZE(relign_trial, 64)
ABI_OFFSET(relign_trial, struct_size, 0)
ABI_OFFSET(relign_trial, reserved, 4)
ABI_OFFSET(relign_trial, context, 8)
ABI_OFFSET(relign_trial, task, 16)
ABI_OFFSET(relign_trial, first, 24)
ABI_OFFSET(relign_trial, step, 32)
ABI_OFFSET(relign_trial, move, 40)
ABI_OFFSET(relign_trial, recommend, 48)
ABI_OFFSET(relign_trial, get_service, 56)

ABI_SIZE(relign_algorithm_interface, 40)
ABI_OFFSET(relign_algorithm_interface, struct_size, 0)
ABI_OFFSET(relign_algorithm_interface, reserved, 4)
ABI_OFFSET(relign_algorithm_interface, create, 8)
ABI_OFFSET(relign_algorithm_interface, run, 16)
ABI_OFFSET(relign_algorithm_interface, destroy, 24)
ABI_OFFSET(relign_algorithm_interface, get_extension, 32)

ABI_VALUE(RELIGN_RUN_STEPS_SPENT, 0)
ABI_VALUE(RELIGN_RUN_FINISHED, 1)

ABI_SIZE(relign_reference_service, 16)
ABI_OFFSET(relign_reference_service, struct_size, 0)
ABI_OFFSET(relign_reference_service, reserved, 4)
ABI_OFFSET(relign_reference_service, image, 8)

ABI_SIZE(relign_measures_service, 40)
ABI_OFFSET(relign_measures_service, struct_size, 0)
ABI_OFFSET(relign_measures_service, reserved, 4)
ABI_OFFSET(relign_measures_service, context, 8)
ABI_OFFSET(relign_measures_service, list, 16)
ABI_OFFSET(relign_measures_service, measure, 24)
ABI_OFFSET(relign_measures_service, why, 32)

ABI_SIZE(relign_prior_service, 32)
ABI_OFFSET(relign_prior_service, struct_size, 0)
ABI_OFFSET(relign_prior_service, reserved, 4)
ABI_OFFSET(relign_prior_service, context, 8)
ABI_OFFSET(relign_prior_service, draw, 16)
ABI_OFFSET(relign_prior_service, why, 24)

ABI_SIZE(relign_run_service, 32)
ABI_OFFSET(relign_run_service, struct_size, 0)
ABI_OFFSET(relign_run_service, reserved, 4)
ABI_OFFSET(relign_run_service, context, 8)
ABI_OFFSET(relign_run_service, run, 16)
ABI_OFFSET(relign_run_service, why, 24)

ABI_SIZE(relign_run_outcome, 40)
ABI_OFFSET(relign_run_outcome, struct_size, 0)
ABI_OFFSET(relign_run_outcome, steps, 4)
ABI_OFFSET(relign_run_outcome, end, 8)
ABI_OFFSET(relign_run_outcome, reserved, 12)
ABI_OFFSET(relign_run_outcome, last, 16)
ABI_OFFSET(relign_run_outcome, best, 24)
ABI_OFFSET(relign_run_outcome, recommendation, 32)

ABI_SIZE(relign_model_service, 80)
ABI_OFFSET(relign_model_service, struct_size, 0)
ABI_OFFSET(relign_model_service, reserved, 4)
ABI_OFFSET(relign_model_service, context, 8)
ABI_OFFSET(relign_model_service, scene_json, 16)
ABI_OFFSET(relign_model_service, image_width, 32)
ABI_OFFSET(relign_model_service, image_height, 36)
ABI_OFFSET(relign_model_service, mount, 40)
ABI_OFFSET(relign_model_service, capture, 48)
ABI_OFFSET(relign_model_service, noise_free, 56)
ABI_OFFSET(relign_model_service, unmount, 64)
ABI_OFFSET(relign_model_service, why, 72)

ABI_SIZE(relign_noise_level_interface, 40)
ABI_OFFSET(relign_noise_level_interface, struct_size, 0)
ABI_OFFSET(relign_noise_level_interface, reserved, 4)
ABI_OFFSET(relign_noise_level_interface, create, 8)
ABI_OFFSET(relign_noise_level_interface, draw, 16)
ABI_OFFSET(relign_noise_level_interface, destroy, 24)
ABI_OFFSET(relign_noise_level_interface, get_extension, 32)

ABI_SIZE(relign_scene_interface, 80)
ABI_OFFSET(relign_scene_interface, struct_size, 0)
ABI_OFFSET(relign_scene_interface, reserved, 4)
ABI_OFFSET(relign_scene_interface, create, 8)
ABI_OFFSET(relign_scene_interface, describe, 16)
ABI_OFFSET(relign_scene_interface, reference, 24)
ABI_OFFSET(relign_scene_interface, mount, 32)
ABI_OFFSET(relign_scene_interface, unmount, 40)
ABI_OFFSET(relign_scene_interface, capture, 48)
ABI_OFFSET(relign_scene_interface, noise_free_mse, 56)
ABI_OFFSET(relign_scene_interface, destroy, 64)
ABI_OFFSET(relign_scene_interface, get_extension, 72)

ABI_SIZE(relign_scene_noise_free, 16)
ABI_OFFSET(relign_scene_noise_free, struct_size, 0)
ABI_OFFSET(relign_scene_noise_free, reserved, 4)
ABI_OFFSET(relign_scene_noise_free, render, 8)

ABI_SIZE(relign_stage_move, 40)
ABI_OFFSET(relign_stage_move, struct_size, 0)
ABI_OFFSET(relign_stage_move, reserved, 4)
ABI_OFFSET(relign_stage_move, limits_low, 8)
ABI_OFFSET(relign_stage_move, limits_high, 16)
ABI_OFFSET(relign_stage_move, machine_seconds, 24)
ABI_OFFSET(relign_stage_move, moved, 32)

ABI_SIZE(relign_scene_stage, 32)
ABI_OFFSET(relign_scene_stage, struct_size, 0)
ABI_OFFSET(relign_scene_stage, reserved, 4)
ABI_OFFSET(relign_scene_stage, begin, 8)
ABI_OFFSET(relign_scene_stage, move_by, 16)
ABI_OFFSET(relign_scene_stage, capture, 24)

ABI_SIZE(relign_plugin_description, 40)
ABI_OFFSET(relign_plugin_description, struct_size, 0)
ABI_OFFSET(relign_plugin_description, abi_major, 4)
ABI_OFFSET(relign_plugin_description, abi_minor, 8)
ABI_OFFSET(relign_plugin_description, min_host_minor, 12)
ABI_OFFSET(relign_plugin_description, manifest_json, 16)
ABI_OFFSET(relign_plugin_description, build_info, 24)
ABI_OFFSET(relign_plugin_description, get_interface, 32)

/* clang-format on */
#endif
