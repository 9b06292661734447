"""Roadmap: the graph of verified moves between viewpoints, and the best paths over it.

Entry: `roadmap_builder.RoadmapBuilder`, which runs once per step. Reading order: `roadmap` (nodes
and edges), `shortest_tree`, `sampling` and `viewpoint_sampler` (new nodes), `connection` (edges),
`local_planner` and `rrt_star` (edges around obstacles), `narrow_passages`, `root_connection` (from
the robot into the roadmap), `robot_path` (feasibility and shortcuts), `thinning`.
"""
