"""What rmw_zenoh puts on the network: key expressions, tokens and attachments."""
