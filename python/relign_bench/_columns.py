"""Columns of closing lines that data frames contain.

Written by tests/results/records/documents_test.cpp from trial_columns.
"""

#: One value per trial.
TABLED = (
    "criterion_optimum_deficit",
)

#: One value per step.
PER_STEP = (
    "glued_mse",
    "glued_mse_error",
    "best_mse",
    "best_mse_error",
    "field_mtf_deficit",
    "centre_px",
    "rotation_px",
    "pose_um",
    "tilt_arcmin",
    "further_score_1",
    "further_score_2",
    "further_score_3",
    "further_score_4",
)
