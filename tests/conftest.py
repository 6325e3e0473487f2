"""What all tests share."""

from __future__ import annotations

import signal

# Tests interrupt processes of their own, which would inherit the deafness of a test run that was started in
# the background.
signal.signal(signal.SIGINT, signal.default_int_handler)
