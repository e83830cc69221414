"""The STEP file, read again: parts stand where the design has them, with its volumes and masses."""

# pyright: reportAttributeAccessIssue=false
# (The kernel's compiled modules carry no types.)
from __future__ import annotations

import csv
import io
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from draft import geometry as g
from draft.errors import DraftError, RefusedError
from draft.spec.primitives import colors
from draft.values import scalar
from tests.helpers import BOX, robot
from tests.model.shipped import SHIPPED, built

pytest.importorskip("OCP", reason="the extra cad is not installed")

from OCP.BRepGProp import BRepGProp  # noqa: E402
from OCP.gp import gp_Pnt, gp_Vec  # noqa: E402
from OCP.GProp import GProp_GProps  # noqa: E402
from OCP.IFSelect import IFSelect_ReturnStatus  # noqa: E402
