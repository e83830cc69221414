"""All that stands on mjlab."""

# Before any module of this package: mjlab imports `draft.learn.register`, which imports these.
import mjlab  # noqa: F401
