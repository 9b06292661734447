"""Compiles the kernels once, before the processes of the tests would each do it."""

from app.process.kernel_cache import use_kernel_cache


def main() -> None:
    """Use the cache of the tests."""
    use_kernel_cache()
    from app.nodes.navigator.config import NavigatorConfig
    from app.nodes.navigator.warm_up import warm_up

    warm_up(NavigatorConfig(), lambda _: None)


if __name__ == "__main__":
    main()
