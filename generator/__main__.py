import os
import sys

from .cli import EXIT_FAILED, main

code = main()
try:
    sys.stdout.flush()
except OSError:  # which would come a second time, as a warning, when Python ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    code = code or EXIT_FAILED
sys.exit(code)
