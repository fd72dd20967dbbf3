import sys

from .cli import ended, main

sys.exit(ended(main()))
