"""The commands as functions (`commands`), and the options that the terminal has for them (`options`)."""
