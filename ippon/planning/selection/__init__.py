"""Selection: which viewpoint the robot goes to.

Entries: `target_selector.TargetSelector` and, for what may be the object,
`closer_look.CloserLookSelector`. Reading order: `node_selection` (scores and eq. (5)),
`target_hysteresis`, `target_selector`; `look_target`, `interrupted_looks`, `cluster_look`,
`closer_look`, `passing_look`, `out_of_reach` and `detours`.
"""
