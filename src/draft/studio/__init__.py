"""The studio: a robot in the browser with a slider for each of its numbers.

`library`, `fields` and `session` do not depend on the browser; `skins`, `plots` and `cards` turn a
design into triangles, SVG and HTML; `scene3d`, `controls`, `panel` and `server` use viser.
"""
