"""Style sheet of self-contained HTML reports; dark on screen, light on paper."""

from typing import Final

REPORT_STYLE: Final = """
:root{color-scheme:dark;--back:#14161a;--text:#e8eaed;--dim:#9aa0a6;--line:#33373d}
@media print{:root{color-scheme:light;--back:#fff;--text:#111;--dim:#555;--line:#ccc}}
body{background:var(--back);color:var(--text);font:15px/1.5 system-ui,sans-serif;
max-width:1120px;margin:32px auto;padding:0 16px;font-variant-numeric:tabular-nums}
h1{font-size:24px}h2{font-size:18px;margin-top:40px}
table{border-collapse:collapse;width:100%;font-size:14px;margin:8px 0}
th,td{text-align:right;padding:4px 8px;border-bottom:1px solid var(--line);white-space:nowrap}
th:first-child,td:first-child{text-align:left}td.wide{white-space:normal;text-align:left}
a{color:#56b4e9}
.dim{color:var(--dim)}.warn{border-left:4px solid #E69F00;padding:8px 12px;background:#E69F0018}
code{font-size:12px;overflow-wrap:anywhere;white-space:normal}
"""
