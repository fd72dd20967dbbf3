import signal
import sys

from .cli import ended, main

# A farm that cancels a task interrupts it as Ctrl-C does.
signal.signal(signal.SIGTERM, signal.default_int_handler)
sys.exit(ended(main()))
