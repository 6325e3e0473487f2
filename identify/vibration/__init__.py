"""The study of vibration: config, problem, fit, and what is said of it."""
