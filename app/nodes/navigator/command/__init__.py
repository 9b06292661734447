"""From the command of the planner or the operator to the command stream."""
