"""Open-vocabulary networks, one module or package each.

To add a backend, write a `Segmenter` here, add its name to `config.Backend` and load it in
`loading.py`.
"""
