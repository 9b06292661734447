"""Lists: goals one after the other, "my keys, the two bags and a hat".

Entry: `goal_list.read_goals`.
"""
