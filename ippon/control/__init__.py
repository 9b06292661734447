"""Control: velocity commands along a path, drive modes, and the safety filter.

Entry: `path_follower.PathFollower`, then `safety_filter.filter_command` on its command. Read in the
order: `path_follower`, `acceleration_limits`, `drive_mode`, `obstacles`, `drops`, `safety_filter`.
"""
