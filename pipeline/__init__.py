"""From recordings to fitted breaths, tables and reports."""

from sim import use_one_thread

use_one_thread()
