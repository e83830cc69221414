"""Appearance of a simulation: a checked ground in one colour, a pale sky and one sun."""

from __future__ import annotations

import mujoco
import numpy as np

SKY = (0.86, 0.90, 0.94)
GROUND = (0.68, 0.70, 0.72)
# Side of a square on the ground [m], squares along a patch of 8 m, brightness of the dark ones.
SQUARE, SQUARES, DARKER = 0.5, 16, 0.80
_PIXELS = 32  # Pixels per side of a square.
_SUN = (-0.35, 0.45, -1.0)


def dress(spec: mujoco.MjSpec) -> None:
    """Change the appearance of a scene of mjlab, and nothing of its physics."""
    _light(spec)
    spec.add_texture(
        name="draft_sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.62, 0.72, 0.84),
        rgb2=SKY,
        width=256,
        height=256,
    )
    texture = spec.add_texture(
        name="draft_ground",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        nchannel=3,
        width=SQUARES * _PIXELS,
        height=SQUARES * _PIXELS,
    )
    texture.data = _checker().tobytes()
    ground = spec.add_material(
        name="draft_ground",
        rgba=(*GROUND, 1.0),
        texuniform=True,
        # MuJoCo counts repetitions per two metres. The browser's viewer stretches the texture
        # over each height field, which is one patch, so both show the same squares.
        texrepeat=(2 / (SQUARES * SQUARE),) * 2,
        specular=0.0,
        shininess=0.0,
    )
    ground.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "draft_ground"
    for geom in spec.body("terrain").geoms:
        geom.material = "draft_ground"
        geom.rgba = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default: the material's colour is used.


def _checker() -> np.ndarray:
    """Texture of squares in two shades, shape (pixels, pixels, 3)."""
    row, column = np.indices((SQUARES * _PIXELS,) * 2) // _PIXELS
    shade = np.where((row + column) % 2, 255, round(255 * DARKER)).astype(np.uint8)
    return np.repeat(shade[..., None], 3, axis=2)


def _light(spec: mujoco.MjSpec) -> None:
    visual = spec.visual
    visual.headlight.ambient[:] = 0.45
    visual.headlight.diffuse[:] = 0.25
    visual.headlight.specular[:] = 0.0
    visual.quality.shadowsize = 4096
    visual.quality.offsamples = 4
    visual.rgba.fog[:] = visual.rgba.haze[:] = (*SKY, 1.0)
    for light in spec.lights:
        light.active = False
    spec.worldbody.add_light(
        name="draft_sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        dir=_SUN,
        diffuse=(0.55, 0.55, 0.52),
        specular=(0.15,) * 3,
        castshadow=True,
    )
