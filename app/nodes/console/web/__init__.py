"""The public port: pages, logins, WebSockets and their limits."""
