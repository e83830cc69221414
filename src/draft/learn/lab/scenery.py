"""How a simulation looks: a checked ground in one colour, a pale sky and one sun."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import mujoco

SKY = (0.86, 0.90, 0.94)
GROUND, OTHER = (0.52, 0.55, 0.57), (0.66, 0.68, 0.70)
SQUARE = 0.5  # Side of the squares on the ground [m].
_SUN = (-0.35, 0.45, -1.0)


def dress(spec: mujoco.MjSpec) -> None:
    """Change what a scene of mjlab looks like, and nothing of how it moves."""
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
    spec.add_texture(
        name="draft_ground",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=GROUND,
        rgb2=OTHER,
        width=256,
        height=256,
    )
    ground = spec.add_material(
        name="draft_ground",
        texuniform=True,
        texrepeat=(1 / SQUARE, 1 / SQUARE),
        specular=0.0,
        shininess=0.0,
    )
    ground.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "draft_ground"
    for geom in spec.body("terrain").geoms:
        geom.material = "draft_ground"
        geom.rgba = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default: the material's colour holds.


def _light(spec: mujoco.MjSpec) -> None:
    visual = spec.visual
    visual.headlight.ambient = (0.45,) * 3
    visual.headlight.diffuse = (0.25,) * 3
    visual.headlight.specular = (0.0,) * 3
    visual.quality.shadowsize = 4096
    visual.quality.offsamples = 4
    visual.rgba.fog = visual.rgba.haze = (*SKY, 1.0)
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
