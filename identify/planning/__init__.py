"""What to measure next: postures, impacts and sensors that determine parameters best."""
