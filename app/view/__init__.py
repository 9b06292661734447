"""What the operator sees: messages to a scene model, and the model to viser."""
