"""Compiles the kernels once, before the processes of the tests would each do it."""

from app.process.kernel_cache import COMPLETE, use_kernel_cache


def main() -> None:
    """Use the cache of the tests; there is nothing to do if it is complete."""
    folder = use_kernel_cache()
    if folder is not None and (folder / COMPLETE).exists():
        return
    from app.nodes.navigator.config import NavigatorConfig
    from app.nodes.navigator.warm_up import warm_up

    warm_up(NavigatorConfig(), lambda _: None)


if __name__ == "__main__":
    main()
