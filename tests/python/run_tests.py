"""run_tests.py NAME: runs one file of tests. Exit code 77 where nothing could run: SKIPPED."""

import sys
import unittest

SKIPPED = 77

if __name__ == "__main__":
    try:
        import numpy  # noqa: F401
    except ImportError as missing:
        print(f"SKIPPED: {missing} (Debian: python3-numpy)")
        sys.exit(SKIPPED)
    suite = unittest.defaultTestLoader.loadTestsFromName(sys.argv[1])
    result = unittest.TextTestRunner(verbosity=2).run(suite)
    if not result.wasSuccessful() or result.testsRun == 0:
        sys.exit(1)
    sys.exit(SKIPPED if result.skipped else 0)
