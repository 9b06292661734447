"""The thread that owns the scene, and what each browser sees of it."""
