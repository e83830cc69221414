"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg."""
