"""All that stands on mjlab."""

from draft.learn.silence import start_warp

# Before any module of this package: mjlab imports `draft.learn.register`, which imports these.
start_warp()
import mjlab  # noqa: E402, F401
