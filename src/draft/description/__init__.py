"""Robot descriptions: URDF and MJCF into links, joints, masses and geometry; segments."""
