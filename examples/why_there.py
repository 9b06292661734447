# %% [markdown]
# Replay a session, and plot why the robot went where it went: its way over the map, coloured by
# the reason that it gave at the time, and the reasons over time.
"""Plot why a robot went where it went."""

# %% Read the session
import argparse
import itertools
import re
from pathlib import Path

import numpy as np
from plotly.colors import qualitative
from plotly.subplots import make_subplots

from app.export.session_data import need_map, read_session_data
from app.messages import keys
from app.messages.control import decode
from app.messages.status import Status

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("session", type=Path, help="folder of a session, or its file")
parser.add_argument("out", type=Path, nargs="?", default=Path("why-there.html"))
arguments = parser.parse_args()
session, out = read_session_data(arguments.session), arguments.out
start_ns = session.recording.start_ns
said = [
    ((message.time_ns - start_ns) * 1e-9, decode(message.payload, Status))
    for message in session.recording.all_messages((keys.STATUS,))
]
trail = np.array([(p.time_ns - start_ns, p.x, p.y) for p in session.timeline.trail])

# %% One stretch for each reason, without its figures: "going to the viewpoint by the sofa (near)"
FIGURES = re.compile(r"[:,].*| \(\d+%\)")
stretches = []
for why, group in itertools.groupby(said, lambda one: FIGURES.sub("", one[1].why)):
    times_s, statuses = zip(*group, strict=True)
    first, last = np.searchsorted(1e-9 * trail[:, 0], [times_s[0], times_s[-1]])
    way = trail[max(first - 1, 0) : last + 1, 1:]
    stretches.append((why, times_s, statuses, way))
    metres = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    print(f"{times_s[0]:7.1f} s  {metres:5.1f} m  {statuses[0].why}")

# %% Plot them: over the map, and over time
figure = make_subplots(rows=2, row_heights=[0.75, 0.25], vertical_spacing=0.08)
indices, _, voxel_m = need_map(session)
height_m = (indices[:, 2] + 0.5) * voxel_m
walls = np.unique(indices[(height_m > 0.2) & (height_m < 1.4), :2], axis=0) * voxel_m
grey = {"color": "lightgrey", "size": 4, "symbol": "square"}
figure.add_scattergl(
    x=walls[:, 0], y=walls[:, 1], mode="markers", marker=grey, name="map", hoverinfo="skip"
)
colors = dict(zip({why for why, *_ in stretches}, itertools.cycle(qualitative.Safe), strict=False))
named = set()
for why, times_s, statuses, way in stretches:
    style = {"line": {"color": colors[why], "width": 4}, "legendgroup": why, "name": why}
    figure.add_scatter(
        x=way[:, 0], y=way[:, 1], mode="lines+markers", hovertext=statuses[0].why,
        showlegend=why not in named, **style,
    )  # fmt: skip
    best = [status.best_ooi for status in statuses]
    hover = [status.why for status in statuses]
    figure.add_scatter(x=times_s, y=best, hovertext=hover, showlegend=False, row=2, col=1, **style)
    named.add(why)
figure.update_yaxes(scaleanchor="x", scaleratio=1, row=1, col=1)
figure.update_yaxes(title="best match", range=[0, 1], row=2, col=1)
figure.update_xaxes(title="s", row=2, col=1)
figure.update_layout(title=f"Why it went there: {session.name}", template="plotly_white")
figure.write_html(out)
session.recording.close()
print(out)
