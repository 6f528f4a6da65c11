"""Parameter names of AMCL for ROS 1, for users with an old file.

Nothing is translated silently: for example, the noise of the odometry is a different number.
"""

from __future__ import annotations

NEW_NAMES = {
    "kld_err": "pf_err",
    "kld_z": "pf_z",
    "laser_max_beams": "max_beams",
    "laser_z_hit": "z_hit",
    "laser_z_short": "z_short",
    "laser_z_max": "z_max",
    "laser_z_rand": "z_rand",
    "laser_sigma_hit": "sigma_hit",
    "laser_lambda_short": "lambda_short",
    "odom_model_type": "robot_model_type",
    "odom_alpha1": "alpha1",
    "odom_alpha2": "alpha2",
    "odom_alpha3": "alpha3",
    "odom_alpha4": "alpha4",
    "odom_alpha5": "alpha5",
    "initial_pose_x": "initial_pose.x",
    "initial_pose_y": "initial_pose.y",
    "initial_pose_a": "initial_pose.yaw",
}
"""Nav2's name of each."""

GONE = frozenset(
    {
        "gui_publish_rate",
        "initial_cov_aa",
        "initial_cov_xx",
        "initial_cov_yy",
        "restore_defaults",
        "use_map_topic",
    }
)
"""Names without a successor."""

_MODELS = {
    "diff": "nav2_amcl::DifferentialMotionModel",
    "diff-corrected": "nav2_amcl::DifferentialMotionModel",
    "omni": "nav2_amcl::OmniMotionModel",
    "omni-corrected": "nav2_amcl::OmniMotionModel",
}


def ros1_remedy(name: str, text: str) -> str | None:
    """Return what to write instead of a parameter of ROS 1, which has the value `text`.

    None if ROS 1 had no such parameter, or Nav2 still has it.
    """
    if name in GONE:
        return "delete the line; only AMCL for ROS 1 has this parameter"
    new = NEW_NAMES.get(name)
    if new is None:
        return None
    if name == "odom_model_type":
        model = _MODELS.get(text, _MODELS["diff"])
        return f"Nav2 has {new} instead: write '{new}: {model}'"
    if name.startswith("odom_alpha"):
        # ROS 1 confused variance and standard deviation, and still does in `diff` and `omni`.
        return f"Nav2 calls it {new}; a value tuned for a model without '-corrected' will not fit"
    return f"Nav2 calls it {new}"
