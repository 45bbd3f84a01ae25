"""For programs that make an OpenGL context before they draw: Penny needs none."""


class GLContext:
    """Does nothing."""

    def __init__(self, max_width: int, max_height: int):
        pass

    def make_current(self) -> None:
        """Nothing to be done."""

    def free(self) -> None:
        """Nothing to be done."""
