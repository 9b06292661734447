"""The state of the view: messages in, scene out."""
