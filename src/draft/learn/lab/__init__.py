"""Learning on mjlab: environments, PPO, evaluation and viewers."""

from draft.learn.silence import start_warp

# First, before any module of this package: mjlab imports `draft.learn.register`, which uses them.
start_warp()
import mjlab  # noqa: E402, F401
