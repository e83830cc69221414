"""The studio: a robot in the browser, with every number of it under a slider.

`library` and `session` know no browser; `shapes`, `plots` and `cards` turn a design into triangles,
SVG and HTML; `scene3d`, `fields`, `panel` and `server` speak with viser.
"""
