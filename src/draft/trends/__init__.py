"""What real hardware says: actuator and structure laws, and the data they are fitted to."""
