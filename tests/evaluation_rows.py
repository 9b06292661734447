"""Rows of an evaluation for tests."""

from ippon.evaluation.row import EpisodeRow


def make_row(**change) -> EpisodeRow:
    """Make a row with figures that a test chooses; everything else is plain."""
    values = {
        "episode_id": "1.bed.0.untold", "method": "ippon", "home": "1", "start_index": 0,
        "start_x_m": 0.0, "start_y_m": 0.0, "start_yaw_rad": 0.0, "goal": "bed",
        "context": "", "seed": 1, "robot": "zed", "image_width": 320, "image_height": 200,
        "config_hash": "abc", "version": "ippon 0", "success": True, "spl": 0.5,
        "soft_spl": 0.5, "path_length_m": 10.0, "shortest_path_m": 5.0,
        "distance_to_goal_m": 0.0, "ending": "found", "failure": "none", "time_s": 60.0,
        "frames": 100, "hits": 0, "first_seen_s": 3.0, "explored_m2": 20.0, "best_ooi": 1.0,
        "candidates": 1, "path_x_m": (0.0, 1.0), "path_y_m": (0.0, 0.0),
        "planner_ms_p50": 5.0, "planner_ms_p95": 20.0, "step_ms_p50": 8.0, "wall_s": 6.0,
        "cpu_s": 6.0, "realtime_factor": 10.0,
    }  # fmt: skip
    return EpisodeRow(**{**values, **change})
