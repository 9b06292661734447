"""Planning: from the map to the viewpoint to go to and a path there.

Entry: `planner.ViewpointPlanner`. Below it: `selection` (the target), `visibility` (gain of
viewpoints), `roadmap` (paths between them) and `terrain` (where the body can drive).
"""
