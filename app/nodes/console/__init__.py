"""The console process: serves the web page and draws the scene from the navigator's messages.

Entry: `node.run_console`. Reading order: `node`, `link.navigator_link` (network),
`scene.scene_thread` (model and drawing), `panels.tabs` (user interface), `web.gateway` (HTTP).
"""
