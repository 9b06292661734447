"""ROS 2 nodes whose middleware is rmw_zenoh: its keys, tokens and attachments, without ROS 2."""
