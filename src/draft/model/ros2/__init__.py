"""Package of a robot for ROS 2: description, controllers, and launch files for RViz and Gazebo."""
