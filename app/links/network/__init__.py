"""zenoh sessions, subscriptions and requests."""
